"""``python -m tests.bench.readers``: large databases through our readers, rates and memory.

Files of the extended test data, repeated until they are of the class that such databases have
(``tests.bench.repeated``): a car as OBJ and as GLB, a tank as OpenFlight, a terrain as 3DS, a
filling station as COLLADA; OpenSceneGraph of the OBJ by ``osgconv`` where that is installed. Each
is read in a process of its own, the least of three times; MB/s are of processor time, memory is
the most that the process held, its imports included.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import click

from tests.bench.repeated import (
    repeated_3ds,
    repeated_dae,
    repeated_flt,
    repeated_glb,
    repeated_obj,
)

#: Copies of the car, the tank, the terrain and the filling station.
CARS, TANKS, TERRAINS, STATIONS = 300, 265, 150, 178

ROUNDS = 3

_CHILD = """
import json, re, sys, time
from pathlib import Path
from hdrusd.importers.importer import IMPORTERS, SUFFIXES, Resolver, read
from hdrusd.report import Report
path, report = Path(sys.argv[1]), Report()
IMPORTERS[SUFFIXES[path.suffix.lower()]]  # its imports are not its rate
start = time.process_time()
scene = read(Resolver(path, report), report)
seconds = time.process_time() - start
# of this program alone; what getrusage knows begins with that of the one that started it
peak = int(re.search(r"VmHWM:\\s*(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1024
print(json.dumps({"seconds": seconds, "peak": peak, "triangles": scene.counts()["triangles"]}))
"""


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
        glb = folder / "cars.glb"
        repeated_glb(data / "gazebo/suv/meshes/suv.obj", glb, CARS)
        flt = folder / "tanks.flt"
        repeated_flt(data / "osgearth/data/tank.FLT", flt, TANKS)
        tds = folder / "terrains.3ds"
        terrain = "delta3d/examples/data/StaticMeshes/exampleTerrain/terrain.3ds"
        repeated_3ds(data / terrain, tds, TERRAINS)
        dae = folder / "stations.dae"
        repeated_dae(data / "gazebo/gas_station/meshes/gas_station.dae", dae, STATIONS)
        files = [obj, glb, flt, tds, dae]
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
