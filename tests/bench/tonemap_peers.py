"""``python -m tests.bench.tonemap_peers``: shader 2 beside other tone mappers, in one run.

All map one night picture of 1920 x 1080 in cd/m2, by default the sample street as hdrusd renders
it. They take turns, round by round, so that a busy machine is busy for all of them. Peers that
are missing are named and left out. How to get them (into an environment of their own, PEERS):

    python -m venv PEERS && PEERS/bin/pip install opencv-python-headless pyradiance
    apt-get install pfstools pfstmo

What is counted: hdrusd from the texture in cd/m2, where a renderer has it, to the bytes of the
picture in CPU memory, each frame measured anew and the eye moved on by 1/24 s. OpenCV from array
to array of floats, without an encoding. pfstmo from a stream in a file that is cached, to
nowhere; pcond from file to file: both with what they read and write, and a row beside them says
what that alone costs. Processor time is that of all threads.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click
import moderngl
import numpy as np
import OpenImageIO as oiio

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.course import Course
from hdrusd.glare.model import MODELS
from hdrusd.gpu.context import create_context
from hdrusd.gpu.program import Programs
from hdrusd.images import read_exr, write_exr
from hdrusd.job import Job
from hdrusd.render import Renderer
from hdrusd.report import Report
from hdrusd.tonemap.operator import OPERATORS
from hdrusd.viewing import Eye, Sight, Viewing
from tests.bench.__main__ import ROOT, machine

SIZE, FRAMES_SIZE = (1920, 1080), (1280, 720)
FIELD = (60.0, 36.0)  # degrees
REC709 = ["0.640", "0.330", "0.300", "0.600", "0.150", "0.060", "0.3127", "0.3290"]

REINHARD, IRAWAN = "hdrusd reinhard02", "hdrusd irawan05"
OPENCV, PCOND = "OpenCV TonemapReinhard", "pcond -h"

#: Run by the peers' Python: one array, as many times as lines come in.
_OPENCV = """
import cv2, json, numpy, sys, time
image = numpy.load(sys.argv[1])
mapper = cv2.createTonemapReinhard(2.2, 0.0, 1.0, 0.0)
print(json.dumps(cv2.__version__), flush=True)
for _ in sys.stdin:
    wall, cpu = time.perf_counter(), time.process_time()
    mapper.process(image)
    print(json.dumps([time.perf_counter() - wall, time.process_time() - cpu]), flush=True)
"""


@dataclass(slots=True)
class Row:
    """One way to map the picture; ``work`` gives wall and processor seconds of doing it once."""

    name: str
    work: Callable[[], tuple[float, float]]
    note: str = ""
    times: list[tuple[float, float]] = field(default_factory=list)

    def milliseconds(self) -> list[float]:
        """Wall smallest and median, processor smallest and median."""
        return [
            1e3 * statistic([each[i] for each in self.times])
            for i in (0, 1)
            for statistic in (min, statistics.median)
        ]

    @property
    def cpu(self) -> float:
        """Smallest processor time in ms: what other work on the machine disturbs least."""
        return self.milliseconds()[2]


def inside(work: Callable[[], object]) -> Callable[[], tuple[float, float]]:
    """Seconds of ``work`` in this process."""

    def once() -> tuple[float, float]:
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        return time.perf_counter() - wall, time.process_time() - cpu

    return once


def command(
    *words: str | Path, source: Path | None = None, path: Path | None = None
) -> Callable[[], tuple[float, float]]:
    """Seconds of a process, its start included, that writes to nowhere.

    ``source``: what it is given as its input; ``path``: where it finds others of its kind.
    """
    places = os.environ.get("PATH", "")
    environment = {**os.environ, "PATH": places if path is None else f"{path}:{places}"}

    def once() -> tuple[float, float]:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall = time.perf_counter()
        with source.open("rb") if source is not None else tempfile.TemporaryFile() as given:
            subprocess.run(
                [str(word) for word in words],
                stdin=given,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=environment,
                check=True,
            )
        wall = time.perf_counter() - wall
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return once


def street(ctx: moderngl.Context, folder: Path, size: tuple[int, int]) -> np.ndarray:
    """The sample street at night, (h, w, 3) in cd/m2."""
    stage = folder / "stage" / "street.usda"
    if not stage.is_file():
        maker, database = ROOT / "samples" / "street" / "make_street.py", folder / "database"
        subprocess.run([sys.executable, str(maker), str(database)], check=True, capture_output=True)
        convert(database / "street.osgt", stage, Options())
    renderer = Renderer(ctx, Job(stage=stage, width=size[0], height=size[1]), Report())
    picture = np.ascontiguousarray(renderer.frame(1.0).hdr[..., :3], np.float32)
    renderer.release()
    return picture


def our_rows(ctx: moderngl.Context, picture: np.ndarray) -> list[Row]:
    """Ways of shader 2, steady frames of a sequence each."""
    height, width = picture.shape[:2]
    rgba = np.concatenate([picture[::-1], np.ones_like(picture[..., :1])], axis=-1)
    texture = ctx.texture((width, height), 4, np.ascontiguousarray(rgba).tobytes(), dtype="f4")
    programs = Programs(ctx)
    irawan = Viewing(OPERATORS["irawan05"])
    glare = replace(irawan, glare=MODELS["cie135"])
    ways = {
        REINHARD: Viewing(OPERATORS["reinhard02"]),
        IRAWAN: irawan,
        f"{IRAWAN}, glare cie135": glare,
        f"{IRAWAN}, glare, acuity, night colour": replace(glare, acuity=True, night_colour=True),
    }

    def row(name: str, viewing: Viewing) -> Row:
        eye, number = Eye(ctx, programs, viewing, Course(viewing.operator)), iter(range(1 << 30))

        def frame() -> None:
            at = next(number)
            eye.show(texture, Sight(at / 24.0, float(at), FIELD))

        return Row(name, inside(frame), "texture to bytes")

    return [row(name, viewing) for name, viewing in ways.items()]


def opencv_row(python: Path, picture: np.ndarray, folder: Path) -> tuple[Row, str]:
    """OpenCV in its own process, timed there; and its version. Raises OSError."""
    np.save(folder / "picture.npy", picture)
    process = subprocess.Popen(
        [str(python), "-W", "ignore", "-c", _OPENCV, str(folder / "picture.npy")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    to, from_ = process.stdin, process.stdout
    version = from_.readline()
    if not version:
        raise OSError(f"{python}: no cv2 there")

    def once() -> tuple[float, float]:
        to.write("\n")
        to.flush()
        wall, cpu = json.loads(from_.readline())
        return wall, cpu

    return Row(OPENCV, once, "array to floats"), f"OpenCV {json.loads(version)}"


def radiance_rows(binaries: Path, picture: np.ndarray, folder: Path) -> list[Row]:
    """Radiance's pcond, and its plain reader and writer of the same file."""
    source = folder / "picture.hdr"
    spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, oiio.FLOAT)
    out: Any = oiio.ImageOutput.create(str(source))
    out.open(str(source), spec)
    out.write_image(picture)
    out.close()
    display = ["-u", "100", "-d", "100", "-p", *REC709]

    def run(*words: str) -> Callable[[], tuple[float, float]]:
        return command(binaries / words[0], *words[1:], source, path=binaries)

    return [
        Row(PCOND, run("pcond", "-h", *display), f"file to file, {' '.join(display)}"),
        Row("pcond", run("pcond", *display), "histogram adjustment alone"),
        Row("ra_rgbe -r", run("ra_rgbe", "-r"), "reading and writing that file alone"),
    ]


def pfs_rows(picture: np.ndarray, folder: Path) -> list[Row]:
    """The operators of pfstmo, and the reading of their stream."""
    stream = folder / "picture.pfs"
    write_exr(folder / "picture.exr", picture)
    with stream.open("wb") as file:
        subprocess.run(
            ["pfsinexr", str(folder / "picture.exr")],
            check=True,
            stdout=file,
            stderr=subprocess.DEVNULL,
        )
    names = ("pfstmo_reinhard02", "pfstmo_pattanaik00")
    rows = [Row(name, command(name, source=stream), "stream to stream") for name in names]
    return [*rows, Row("cat", command("cat", source=stream), "reading the stream alone")]


def peer_rows(peers: Path, picture: np.ndarray, folder: Path) -> tuple[list[Row], list[str]]:
    """Those that are installed; and versions, or what is missing."""
    rows: list[Row] = []
    versions: list[str] = []
    python = peers / "bin" / "python"
    if python.is_file():
        try:
            row, name = opencv_row(python, picture, folder)
            rows.append(row)
            versions.append(name)
        except OSError as problem:
            versions.append(str(problem))
    found = sorted(peers.glob("lib/python3*/site-packages/pyradiance/bin/pcond"))
    system = shutil.which("pcond")
    if found or system is not None:
        pcond = found[0] if found else Path(system or "")
        rows += radiance_rows(pcond.parent, picture, folder)
        packages = sorted(pcond.parents[2].glob("pyradiance-*.dist-info"))
        versions.append(packages[0].stem if packages else str(pcond))
    if shutil.which("pfstmo_reinhard02") and shutil.which("pfsinexr"):
        rows += pfs_rows(picture, folder)
        told = subprocess.run(["pfstmo_reinhard02", "--help"], capture_output=True, text=True)
        versions.append((told.stdout + told.stderr).split(":")[0].strip())
    missing = {"OpenCV": OPENCV, "pcond": PCOND, "pfstmo": "pfstmo_reinhard02"}
    names = {row.name for row in rows}
    return rows, versions + [f"{peer} is missing" for peer, n in missing.items() if n not in names]


def table(rows: list[Row]) -> list[str]:
    """Milliseconds of each, and the ratios that there are targets for."""
    lines = ["| ms, smallest / median | wall | CPU | |", "| --- | --- | --- | --- |"]
    for row in rows:
        a, b, c, d = row.milliseconds()
        lines.append(f"| {row.name} | {a:.0f} / {b:.0f} | {c:.0f} / {d:.0f} | {row.note} |")
    known = {row.name: row for row in rows}
    ratios = []
    pairs = ((OPENCV, REINHARD), ("pfstmo_reinhard02", REINHARD), (PCOND, IRAWAN))
    for peer, own in (*pairs, ("pfstmo_pattanaik00", IRAWAN)):
        if peer in known:
            wall = known[peer].milliseconds()[0] / known[own].milliseconds()[0]
            cpu = known[peer].cpu / known[own].cpu
            ratios.append(f"{peer} / {own}: {cpu:.1f} of CPU, {wall:.1f} of the clock")
    return [*lines, "", "; ".join(ratios) + "."]


def sequence(picture: np.ndarray, frames: int, folder: Path, options: list[str]) -> str:
    """``hdrusd tonemap`` of float ZIP frames, in which the picture moves; start included."""
    for number in range(1, frames + 1):
        moved = np.roll(picture, -4 * number, axis=1)
        write_exr(folder / f"in.{number:04d}.exr", moved)
    hdrusd = Path(sys.executable).parent / "hdrusd"
    words: list[Any] = [hdrusd, "tonemap", folder / "in.####.exr", folder / "out.####.png"]
    wall, cpu = command(*words, "-q", *options)()
    size = f"{picture.shape[1]} x {picture.shape[0]}"
    told = " ".join(["hdrusd tonemap in.####.exr out.####.png", *options])
    return (
        f"`{told}`, {frames} frames of {size}: {frames / wall:.1f} frames/s "
        f"({cpu / frames * 1e3:.0f} CPU-ms a frame)"
    )


@click.command()
@click.option("--peers", default=".peers/tonemap", show_default=True, help="Environment of peers.")
@click.option("--picture", type=click.Path(path_type=Path, exists=True), help="Another EXR, cd/m2.")
@click.option("--rounds", default=15, show_default=True, help="Times that each has its turn.")
@click.option("--frames", default=240, show_default=True, help="Of the sequence; 0 for none.")
def main(peers: str, picture: Path | None, rounds: int, frames: int) -> None:
    """Print a table of tone mappers, and frames a second of a sequence from EXR to PNG."""
    ctx = create_context()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        hdr = read_exr(picture)[0] if picture is not None else street(ctx, folder, SIZE)
        others, versions = peer_rows(Path(peers).absolute(), hdr, folder)
        rows = [*our_rows(ctx, hdr), *others]
        for number in range(rounds + 1):
            for row in rows:
                taken = row.work()
                if number > 0:  # the first one compiles and fills caches
                    row.times.append(taken)
        click.echo(f"{machine(ctx)}; {'; '.join(versions)}; {hdr.shape[1]} x {hdr.shape[0]}\n")
        click.echo("\n".join(table(rows)) + "\n")
        if frames > 0:
            small = street(ctx, folder, FRAMES_SIZE) if picture is None else hdr
            click.echo(sequence(small, frames, folder, ["--operator", "irawan05"]))


if __name__ == "__main__":
    main()
