"""``python -m tests.bench``: one table, with the machine and versions that it is of.

Times are medians of several runs, wall and CPU of all threads; on a shared machine the
CPU figure is the steadier one. The baseline of each ratio stands in its row.
"""

from __future__ import annotations

import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import click
import moderngl
import numpy as np

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.errors import SourceRef
from hdrusd.gpu.context import create_context, describe
from hdrusd.images import write_exr, write_png
from hdrusd.job import Job
from hdrusd.legacy.scene import Image, Texture
from hdrusd.maps import MapWriter
from hdrusd.photometry.reflectance import reflectance_table
from hdrusd.render import Renderer, render_sequence
from hdrusd.report import Report
from hdrusd.scene import RenderScene, light_rows
from hdrusd.tonemap.operator import OPERATORS

ROOT = Path(__file__).resolve().parents[2]
SIZE = (1280, 720)
LIGHTS = (1, 8, 20, 100, 256)


@dataclass(frozen=True, slots=True)
class Time:
    """Median seconds: on the clock, and of all threads together."""

    wall: float
    cpu: float

    def __str__(self) -> str:
        return f"{self.wall * 1e3:7.1f} ms ({self.cpu * 1e3:.0f} CPU)"


def measure(work: Callable[[], object], runs: int = 5) -> Time:
    """Median of ``runs`` after one that does not count."""
    work()
    wall, cpu = [], []
    for _ in range(runs):
        clock, process = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - clock)
        cpu.append(time.process_time() - process)
    return Time(statistics.median(wall), statistics.median(cpu))


def start(*command: str, runs: int = 5) -> float:
    """Median wall seconds of a fresh process."""
    times = []
    for _ in range(runs):
        clock = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - clock)
    return statistics.median(times)


def street_lights(scene: RenderScene, count: int) -> np.ndarray:
    """``count`` lamps along the scene: every fifth a spot, the rest shine evenly."""
    rng = np.random.default_rng(3)
    points = np.concatenate([d.transforms[:, 3, :3] for d in scene.draws])
    low, high = points.min(axis=0), points.max(axis=0)
    lights = light_rows(count)
    lights["position"] = rng.uniform(low, high, (count, 3))
    lights["position"][:, 2] = 8.0
    lights["radius"] = 0.1
    lights["intensity"] = 3000.0
    lights["inner"][::5], lights["outer"][::5] = 0.6, 1.0
    return lights


def bench_frames(ctx: moderngl.Context, stage: Path) -> list[str]:
    """Shader 1 and 2 by number of lights, the picture in CPU memory."""
    job = Job(stage=stage, width=SIZE[0], height=SIZE[1], operator=OPERATORS["reinhard02"])
    renderer = Renderer(ctx, job, Report())
    camera = renderer.reader.camera(renderer.camera_path, 1.0, SIZE[0] / SIZE[1])
    scene = renderer.reader.read(1.0, camera)
    assert renderer.display is not None
    display = renderer.display
    rows = [
        f"| frame, {SIZE[0]} x {SIZE[1]}, N lights | shader 1 | + shader 2 (Reinhard) | / N=1 |"
    ]
    rows.append("| --- | --- | --- | --- |")
    base = 0.0
    for count in LIGHTS:
        lit = replace(scene, lights=street_lights(scene, count))

        def shader1(lit: RenderScene = lit) -> None:
            renderer.hdr.render(lit)
            renderer.hdr.read()

        def both(lit: RenderScene = lit) -> None:
            display.show(renderer.hdr.render(lit), {})
            renderer.hdr.read()

        one, two = measure(shader1), measure(both)
        base = base or two.cpu
        rows.append(f"| {count} | {one} | {two} | {two.cpu / base:.2f} |")
    own = measure(lambda: renderer.frame(1.0))
    rows.append(f"| the street's own {len(scene.lights)} | | {own} | {own.cpu / base:.2f} |")
    triangles = scene.triangles()
    return [f"Sample street: {triangles} triangles, {len(scene.draws)} draws.", "", *rows]


def bench_sequence(ctx: moderngl.Context, stage: Path, folder: Path) -> list[str]:
    """Frames a second end to end: stage in, float EXR and PNG on disk."""
    frames = 24
    job = Job(
        stage=stage,
        times=[float(1 + i) for i in range(frames)],
        exr=str(folder / "f.####.exr"),
        png=str(folder / "f.####.png"),
        operator=OPERATORS["reinhard02"],
        width=SIZE[0],
        height=SIZE[1],
    )
    clock = time.perf_counter()
    for _ in render_sequence(ctx, job, Report()):
        pass
    whole = time.perf_counter() - clock
    renderer = Renderer(ctx, replace(job, exr=None, png=None), Report())
    drawing = measure(lambda: renderer.frame(1.0), 3)
    rgb = renderer.frame(1.0).hdr
    writing = measure(lambda: write_exr(folder / "one.exr", rgb), 3)
    return [
        "| sequence, 24 frames, float EXR + PNG | value |",
        "| --- | --- |",
        f"| end to end, start included | {frames / whole:.2f} frames/s |",
        f"| one frame without writing | {drawing} |",
        f"| one float ZIP EXR | {writing} |",
    ]


def bench_convert(database: Path, folder: Path) -> list[str]:
    """Conversion of the twins, and T^2.2 by table against a power function."""
    rows = ["| convert | time | throughput |", "| --- | --- | --- |"]
    for name in ("street.osgt", "street.gltf"):
        size = sum(f.stat().st_size for f in database.rglob("*") if f.suffix != ".toml") / 2e6
        taken = measure(lambda n=name: convert(database / n, folder / "c.usda", Options()), 3)
        rows.append(f"| {name} with its textures | {taken} | {size / taken.wall:.1f} MB/s |")
    # Noise over a ramp: neither flat nor incompressible, as photographs are.
    ramp = np.linspace(0, 230, 2048)[None, :, None] + np.random.default_rng(1).integers(
        0, 25, (2048, 2048, 3)
    )
    codes = ramp.astype(np.uint8)
    megapixels = codes.shape[0] * codes.shape[1] / 1e6
    table = measure(lambda: reflectance_table(2.2, 0.8)[codes], 3)
    power = measure(lambda: (codes / 255.0) ** 2.2 * 0.8, 3)
    rows.append(
        f"| T^2.2 D by table, 2048 x 2048 | {table} | {megapixels / table.wall:.0f} MP/s, "
        f"{power.wall / table.wall:.1f} x numpy's power |"
    )
    picture = folder / "picture.png"
    write_png(picture, codes)
    place = SourceRef(picture)
    texture = Texture(Image("picture.png", place, path=picture))

    def file_to_file() -> None:
        MapWriter(folder / "maps", "maps", folder, Report()).reflectance(
            texture, (0.8, 0.8, 0.8), 2.2, place, "paint"
        )

    taken = measure(file_to_file, 3)
    rows.append(
        f"| PNG to reflectance EXR, 2048 x 2048 | {taken} | {megapixels / taken.wall:.1f} MP/s |"
    )
    return rows


def bench_start(stage: Path, folder: Path) -> list[str]:
    """Fresh processes."""
    hdrusd = str(Path(sys.executable).parent / "hdrusd")
    python = start(sys.executable, "-c", "pass")
    show = start(hdrusd, "--help")
    first = start(hdrusd, "render", str(stage), str(folder / "first.exr"), "-q", runs=3)
    return [
        "| start-up | wall | / python |",
        "| --- | --- | --- |",
        f"| python -c pass | {python:.3f} s | 1 |",
        f"| hdrusd --help | {show:.3f} s | {show / python:.1f} |",
        f"| first frame of the street, {SIZE[0]} x {SIZE[1]}, as EXR | {first:.2f} s "
        f"| {first / python:.0f} |",
    ]


def machine(ctx: moderngl.Context) -> str:
    """What the numbers are of."""
    device = describe(ctx)
    names = ("usd-core", "numpy", "moderngl", "OpenEXR", "OpenImageIO")
    packages = ", ".join(f"{name} {version(name)}" for name in names)
    model = platform.processor() or platform.machine()
    cpu = Path("/proc/cpuinfo")
    if cpu.is_file():
        lines = cpu.read_text().splitlines()
        model = next(
            (x.partition(":")[2].strip() for x in lines if x.startswith("model name")), model
        )
    return (
        f"{model}; {device['renderer']}, {device['version']}; Python {platform.python_version()}, "
        f"{packages}"
    )


@click.command()
@click.option("--markdown", type=click.Path(path_type=Path), help="Write the table to a file.")
@click.option("--stage", type=click.Path(path_type=Path, exists=True), help="Another stage.")
def main(markdown: Path | None, stage: Path | None) -> None:
    """Print what frames, sequences, conversion and start-up cost here and now."""
    ctx = create_context()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        database = folder / "database"
        maker = ROOT / "samples" / "street" / "make_street.py"
        subprocess.run([sys.executable, str(maker), str(database)], check=True, capture_output=True)
        if stage is None:
            stage = folder / "stage" / "street.usda"
            convert(database / "street.osgt", stage, Options())
        parts = [[machine(ctx)]]
        for part in (
            lambda: bench_frames(ctx, stage),
            lambda: bench_sequence(ctx, stage, folder),
            lambda: bench_convert(database, folder),
            lambda: bench_start(stage, folder),
        ):
            rows = part()
            parts.append(rows)
            click.echo("\n".join(rows) + "\n")
    text = "\n\n".join("\n".join(rows) for rows in parts) + "\n"
    click.echo(parts[0][0])
    if markdown is not None:
        markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
