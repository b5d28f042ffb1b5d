"""``python -m tests.bench.textures``: reflectance maps beside OpenImageIO, numbers and files.

The operation R = T^2.2 D from 8-bit codes to half floats, and a folder of textures. Runs are in
turns, and the least of each counts; CPU-ms are of all threads and child processes, and are the
figure to compare on a shared machine. OpenImageIO is given each way that it has: half floats all
through, and single floats that are converted in the end. oiiotool is the wheel's program itself,
without the Python that its script starts.
"""

from __future__ import annotations

import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from hdrusd.errors import SourceRef
from hdrusd.images import write_png
from hdrusd.legacy.scene import Image, Texture
from hdrusd.maps import MapWriter
from hdrusd.photometry.reflectance import coded_reflectance
from hdrusd.report import Report

GREY, COLOR = (0.8, 0.8, 0.8), (0.5, 0.6, 0.7)
Codes = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Time:
    """Least seconds of several runs: on the clock, and of all threads and children."""

    wall: float
    cpu: float

    def __str__(self) -> str:
        return f"{self.cpu * 1e3:.1f} | {self.wall * 1e3:.1f}"


def processor_seconds() -> float:
    """Of this process and the children that it has waited for."""
    child = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + child.ru_utime + child.ru_stime


def measure(works: Mapping[str, Callable[[], object]], runs: int) -> dict[str, Time]:
    """Each in turn, ``runs`` times, after once that does not count."""
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
    for number in range(runs + 1):
        for name, work in works.items():
            clock, cpu = time.perf_counter(), processor_seconds()
            work()
            if number:
                found[name].append((time.perf_counter() - clock, processor_seconds() - cpu))
    return {
        name: Time(min(wall for wall, _ in each), min(cpu for _, cpu in each))
        for name, each in found.items()
    }


def photograph(side: int, seed: int) -> Codes:
    """Noise over a ramp: neither flat nor incompressible, as photographs are."""
    noise = np.random.default_rng(seed).integers(0, 25, (side, side, 3))
    return np.asarray(np.linspace(0, 230, side)[None, :, None] + noise, np.uint8)


def by_openimageio(codes: Codes, kind: str) -> npt.NDArray[np.float16]:
    """Pow and mul of ImageBufAlgo, between them ``kind``; half floats in the end."""
    height, width, channels = codes.shape
    between = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, kind))
    oiio.ImageBufAlgo.pow(between, oiio.ImageBuf(codes), 2.2)
    oiio.ImageBufAlgo.mul(between, between, COLOR)
    return np.asarray((between if kind == "half" else between.copy("half")).get_pixels("half"))


def by_numpy(codes: Codes) -> npt.NDArray[np.float16]:
    """A power function of single floats."""
    linear = (codes / np.float32(255.0)) ** np.float32(2.2)
    return np.asarray(linear * np.array(COLOR, np.float32), np.float16)


def bench_operation(side: int, runs: int) -> list[str]:
    """R = T^2.2 D of one picture in memory."""
    codes = photograph(side, 1)
    threads = len(os.sched_getaffinity(0))
    parts = np.array_split(codes, threads)
    pool = ThreadPoolExecutor(threads)

    def threaded() -> None:
        list(pool.map(lambda part: coded_reflectance(part, 2.2, COLOR), parts))

    works: dict[str, Callable[[], object]] = {
        "hdrusd, D alike in all channels": lambda: coded_reflectance(codes, 2.2, GREY),
        "hdrusd, three D": lambda: coded_reflectance(codes, 2.2, COLOR),
        f"hdrusd, three D, {threads} threads": threaded,
        "NumPy, power of float32": lambda: by_numpy(codes),
        f"OpenImageIO, {threads} threads, float, then half": lambda: by_openimageio(codes, "float"),
        f"OpenImageIO, {threads} threads, half": lambda: by_openimageio(codes, "half"),
    }
    exact = coded_reflectance(codes, 2.2, COLOR)
    wanted = (codes / 255.0) ** 2.2 * COLOR
    # Rounded once to 11 bits, below 2^-14 to steps of 2^-24.
    np.testing.assert_allclose(exact, wanted, rtol=2**-11, atol=2**-25)
    found = measure(works, runs)
    best = min((t for name, t in found.items() if "OpenImageIO" in name), key=lambda t: t.cpu)
    rows = [
        f"| R = T^2.2 D, {side} x {side} to half | CPU-ms | wall ms | "
        "MP a CPU-s | OpenImageIO / it, CPU | wall |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, taken in found.items():
        rows.append(
            f"| {name} | {taken} | {side * side / taken.cpu / 1e6:.0f} "
            f"| {best.cpu / taken.cpu:.1f} | {best.wall / taken.wall:.1f} |"
        )
    return rows


def bench_folder(count: int, side: int, runs: int, folder: Path) -> list[str]:
    """PNG files to reflectance maps as EXR files, half floats."""
    names = []
    for number in range(count):
        names.append(folder / f"t{number}.png")
        write_png(names[-1], photograph(side, number))
    place = SourceRef(folder / "street.osgt")
    textures = [Texture(Image(name.name, place, path=name)) for name in names]
    program = Path(oiio.__file__).parent / "bin" / "oiiotool"

    def fresh() -> Path:
        """What stands in an earlier one is not written over, for which file systems wait."""
        return Path(tempfile.mkdtemp(dir=folder))

    def ours(*, looks: bool) -> None:
        maps = MapWriter(fresh(), "maps", folder, Report())
        with maps.threaded(texture.image for texture in textures):
            for texture in textures:
                maps.reflectance(texture, COLOR, 2.2, place, "paint")
                if looks:
                    maps.look(texture)

    def theirs() -> None:
        factors, made = ",".join(map(str, COLOR)), fresh()
        for name in names:
            change = ["--powc", "2.2", "--mulc", factors, "-d", "half"]
            target = made / f"{name.stem}.exr"
            subprocess.run([program, name, *change, "-o", target], check=True)

    found = measure(
        {
            "hdrusd, one process": lambda: ours(looks=False),
            "hdrusd, and copies of the pictures": lambda: ours(looks=True),
            "oiiotool, a process a file": theirs,
        },
        runs,
    )
    base = found["oiiotool, a process a file"]
    rows = [
        f"| {count} PNG of {side} x {side} to EXR | CPU-ms | wall ms | oiiotool / it, CPU | wall |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, taken in found.items():
        ratio = f"{base.cpu / taken.cpu:.1f} | {base.wall / taken.wall:.1f}"
        rows.append(f"| {name} | {taken} | {ratio} |")
    return rows


def machine() -> str:
    """What the numbers are of, and how busy it was."""
    names = ", ".join(f"{name} {version(name)}" for name in ("numpy", "OpenImageIO", "OpenEXR"))
    cpu = Path("/proc/cpuinfo")
    lines = cpu.read_text().splitlines() if cpu.is_file() else []
    model = next((x.partition(":")[2].strip() for x in lines if x.startswith("model name")), "")
    return (
        f"{model or platform.machine()}, {len(os.sched_getaffinity(0))} cores, load average "
        f"{os.getloadavg()[0]:.1f}; Python {platform.python_version()}, {names}"
    )


@click.command()
@click.option("--side", default=2048, show_default=True, help="Texels a side, operation.")
@click.option("--count", default=64, show_default=True, help="Textures of the folder.")
@click.option("--runs", default=5, show_default=True, help="Runs, of which the least counts.")
def main(side: int, count: int, runs: int) -> None:
    """Print two tables, with the machine before and after them."""
    click.echo(machine() + "\n")
    click.echo("\n".join(bench_operation(side, 3 * runs)) + "\n")
    with tempfile.TemporaryDirectory() as name:
        click.echo("\n".join(bench_folder(count, 512, max(runs // 2, 1), Path(name))) + "\n")
    click.echo(machine())


if __name__ == "__main__":
    sys.exit(main())
