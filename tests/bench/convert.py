"""``python -m tests.bench.convert``: large databases through ``convert``, by its parts.

Scenes of many small things, and with the extended test data large files (``tests.bench.readers``).
Each is converted in a process of its own, the least of three times of each part; seconds are of
processor time, ``a thing`` is what reading, writing and validating take together over the number of
lights or meshes. ``start`` is what a renderer reads of the result before its first frame. Memory is
the most that the process held, its imports included.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import click

from tests.bench import scenes
from tests.bench.readers import CARS, TANKS
from tests.bench.repeated import repeated_flt, repeated_obj

ROUNDS = 3

#: Files, what makes them, of how many, and what these are.
_SCENES: tuple[tuple[str, Callable[[Path, int], None], int, str], ...] = (
    ("lamps.gltf", scenes.lamps, 4000, "light"),
    ("one_node.dae", scenes.lamps_of_one_node, 4000, "light"),
    ("posts.gltf", scenes.posts, 5000, "post"),
    ("meshes.gltf", scenes.meshes, 5100, "mesh"),
)

_CHILD = """
import json, resource, sys, time
from pathlib import Path
import hdrusd.convert
from hdrusd.conversion import Options
from hdrusd.errors import InputError
from hdrusd.importers.importer import IMPORTERS, SUFFIXES
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader
from pxr import Usd
source, target = map(Path, sys.argv[1:3])
IMPORTERS[SUFFIXES[source.suffix.lower()]]  # its imports are not its rate
spent = {}
def timed(name, call):
    def run(*args, **more):
        start = time.process_time()
        try:
            return call(*args, **more)
        finally:
            spent[name] = time.process_time() - start
    return run
hdrusd.convert.read_legacy = timed("read", hdrusd.convert.read_legacy)
hdrusd.convert.validate = timed("validate", hdrusd.convert.validate)
result = timed("all", hdrusd.convert.convert)(source, target, Options())
timed("account", result.as_dict)()
spent["peak"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
reader = StageReader(Usd.Stage.Open(str(target)), Report(), default_sky=False)
try:
    timed("start", reader.read)(0.0, Camera())
except InputError:  # lamps alone: nothing to be drawn
    pass
spent["write"] = spent["all"] + spent["account"] - spent["read"] - spent["validate"]
print(json.dumps(spent | {"meshes": result.counts["meshes"]}))
"""


def measured(path: Path) -> dict[str, float]:
    """The least of each part over some conversions."""
    found = []
    with tempfile.TemporaryDirectory(prefix="hdrusd-converted-") as folder:
        for number in range(ROUNDS):
            target = Path(folder) / f"{number}.usda"
            command = [sys.executable, "-c", _CHILD, str(path), str(target)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            found.append(json.loads(done.stdout))
    return {name: min(float(row[name]) for row in found) for name in found[0]}


@click.command()
@click.option("--data", type=click.Path(path_type=Path, exists=True, file_okay=False))
def main(data: Path | None) -> None:
    """Print a Markdown table; without test data of the scenes alone."""
    if data is None and "HDRUSD_TESTDATA" in os.environ:
        data = Path(os.environ["HDRUSD_TESTDATA"]) / "data"
    with tempfile.TemporaryDirectory(prefix="hdrusd-convert-") as scratch:
        folder = Path(scratch)
        files: list[tuple[Path, int, str]] = []
        for name, make, count, thing in _SCENES:
            make(folder / name, count)
            files.append((folder / name, count, thing))
        if data is not None:
            repeated_obj(data / "gazebo/suv/meshes/suv.obj", folder / "cars.obj", CARS)
            repeated_flt(data / "osgearth/data/tank.FLT", folder / "tanks.flt", TANKS)
            files += [(folder / name, 0, "mesh") for name in ("cars.obj", "tanks.flt")]
        print("| file | things | read s | write s | validate s | a thing | start s | peak MB |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        for file, count, thing in files:
            row = measured(file)
            count = count or round(row["meshes"])
            each = 1000.0 * (row["read"] + row["write"] + row["validate"]) / count
            print(
                f"| {file.name} | {count} x {thing} | {row['read']:.2f} | {row['write']:.2f} "
                f"| {row['validate']:.2f} | {each:.2f} ms | {row['start']:.2f} "
                f"| {row['peak']:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
