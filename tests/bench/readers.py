"""``python -m tests.bench.readers``: large databases through our readers, rates and memory.

A car of the extended test data, repeated until the file is of the class that such databases
have: OBJ by its text, OpenFlight by its records (every copy with vertices of its own),
OpenSceneGraph and FLT of the OBJ by ``osgconv`` where that is installed. Each is read in a
process of its own, the least of three times; MB/s are of processor time, memory is the most that
the process held, its imports included.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import click

#: Copies of the car, and of the tank.
CARS, TANKS = 300, 265

ROUNDS = 3

_CHILD = """
import json, resource, sys, time
from pathlib import Path
from hdrusd.importers.importer import IMPORTERS, SUFFIXES, Resolver, read
from hdrusd.report import Report
path, report = Path(sys.argv[1]), Report()
IMPORTERS[SUFFIXES[path.suffix.lower()]]  # its imports are not its rate
start = time.process_time()
scene = read(Resolver(path, report), report)
seconds = time.process_time() - start
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"seconds": seconds, "peak": peak, "triangles": scene.counts()["triangles"]}))
"""


def repeated_obj(source: Path, target: Path, copies: int) -> None:
    """The lines of an OBJ over and over, each copy beside the last, indices moved on."""
    lines = source.read_text(encoding="latin-1").splitlines()
    counts = [sum(line.split(" ", 1)[0] == key for line in lines) for key in ("v", "vt", "vn")]
    corner = re.compile(r"(\d+)/(\d*)/?(\d*)")
    with target.open("w", encoding="latin-1") as file:
        for copy in range(copies):
            v, t, n = (copy * count for count in counts)

            def moved(match: re.Match[str], v: int = v, t: int = t, n: int = n) -> str:
                parts = [str(int(match[1]) + v)]
                parts += [str(int(g) + o) if g else "" for g, o in ((match[2], t), (match[3], n))]
                return "/".join(parts)

            for line in lines:
                key = line.split(" ", 1)[0]
                if key == "f":
                    line = corner.sub(moved, line)
                elif key == "v":
                    x, y, z = line.split()[1:4]
                    line = f"v {float(x) + 40.0 * copy:.4f} {y} {z}"
                elif key in ("o", "g"):
                    line = f"{line}_{copy}"
                elif key == "mtllib" and copy:
                    continue
                file.write(line + "\n")


def records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The records of an OpenFlight file: code and bytes."""
    at = 0
    while at < len(data):
        code, size = struct.unpack_from(">HH", data, at)
        if code == 67:  # the vertex palette's own record; its vertices follow
            size = struct.unpack_from(">i", data, at + 4)[0]
        yield code, data[at : at + size]
        at += size


def repeated_flt(source: Path, target: Path, copies: int) -> None:
    """The tree of an OpenFlight file over and over, every copy with its own vertices."""
    head, palette, tree = b"", b"", []
    for code, data in records(source.read_bytes()):
        if code == 67:
            palette = data[8:]
        elif tree or code == 10:
            tree.append((code, data))
        else:
            head += data
    body = tree[1:-1]  # between the first push and the last pop
    with target.open("wb") as file:
        file.write(head + struct.pack(">HHi", 67, 8, 8 + copies * len(palette)))
        for _ in range(copies):
            file.write(palette)
        file.write(tree[0][1])
        for copy in range(copies):
            offset = copy * len(palette)
            file.write(b"".join(_moved(code, data, offset) for code, data in body))
        file.write(tree[-1][1])


def _moved(code: int, data: bytes, offset: int) -> bytes:
    """A record whose vertex list (72) points into another copy of the palette."""
    if code != 72 or not offset:
        return data
    count = len(data) // 4 - 1
    places = struct.unpack(f">{count}i", data[4:])
    return data[:4] + struct.pack(f">{count}i", *(place + offset for place in places))


def measured(path: Path) -> dict[str, float]:
    """The least of some readings."""
    found = []
    for _ in range(ROUNDS):
        command = [sys.executable, "-c", _CHILD, str(path)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found.append(json.loads(done.stdout))
    return min(found, key=lambda row: float(row["seconds"]))


@click.command()
@click.option("--data", type=click.Path(path_type=Path, exists=True, file_okay=False))
def main(data: Path | None) -> None:
    """Print a Markdown table."""
    if data is None and "HDRUSD_TESTDATA" not in os.environ:
        raise click.UsageError("no data: want --data or HDRUSD_TESTDATA")
    data = data or Path(os.environ["HDRUSD_TESTDATA"]) / "data"
    with tempfile.TemporaryDirectory(prefix="hdrusd-readers-") as scratch:
        folder = Path(scratch)
        obj = folder / "cars.obj"
        repeated_obj(data / "gazebo/suv/meshes/suv.obj", obj, CARS)
        flt = folder / "tanks.flt"
        repeated_flt(data / "osgearth/data/tank.FLT", flt, TANKS)
        files = [obj, flt]
        converter = shutil.which("osgconv")
        for name in ("cars.osgt", "cars.osgb") if converter else ():
            subprocess.run([str(converter), obj, folder / name], check=True, capture_output=True)
            files.append(folder / name)
        print("| file | MB | triangles | CPU s | MB/s | peak MB |")
        print("| --- | --- | --- | --- | --- | --- |")
        for file in files:
            row, size = measured(file), file.stat().st_size / 1e6
            print(
                f"| {file.name} | {size:.1f} | {row['triangles']:.0f} | {row['seconds']:.2f} "
                f"| {size / row['seconds']:.0f} | {row['peak']:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
