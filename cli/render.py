"""``hdrusd render``."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Any

import click

from hdrusd.frames import check_pattern, parse_frames

from .eye_options import (
    beside,
    chosen_cuts,
    chosen_glare,
    chosen_observer,
    chosen_screen,
    chosen_start,
    eye_options,
    flicker_of,
    night_vision,
    plot_file,
)
from .options import (
    FILE,
    NumberRange,
    chosen_operator,
    conclude,
    operator_options,
    parse_settings,
    report_options,
)

#: usdrecord's names and numbers of --complexity, and how often they refine.
COMPLEXITIES = {name: level for level, name in enumerate(("low", "medium", "high", "veryhigh"))}
COMPLEXITIES |= {"1.0": 0, "1.1": 1, "1.2": 2, "1.3": 3}


@click.command("render")
@click.argument("stage", type=FILE)
@click.argument("output", type=str)
@click.option(
    "--frames",
    "-f",
    metavar="FRAMESPEC[,FRAMESPEC]",
    help="Time codes: 101, 101:105, 105:101, 101:109x2, 101:104x0.5. OUTPUT then holds "
    "#### or ###.###. [default: the stage's start]",
)
@click.option(
    "--default-time",
    "--defaultTime",
    "-d",
    is_flag=True,
    help="Render the default time, where nothing is animated.",
)
@click.option(
    "--camera",
    "-cam",
    metavar="PRIM",
    help="Camera by path or name. "
    "[default: the render settings', else the first, else one that frames the stage]",
)
@click.option(
    "--image-width",
    "--imageWidth",
    "-w",
    type=click.IntRange(1, 16384),
    help="Pixels. [default: the render settings' resolution, else 960]",
)
@click.option(
    "--image-height",
    "--imageHeight",
    type=click.IntRange(1, 16384),
    help="Pixels. [default: by the aspect ratio]",
)
@click.option(
    "--complexity",
    "-c",
    type=click.Choice(list(COMPLEXITIES)),
    default="low",
    show_default=True,
    help="Refinement of subdivision meshes and curves: 0 to 3 times.",
)
@click.option("--png", metavar="PATTERN", help="Write tone-mapped pictures too.")
@click.option(
    "--reflection",
    type=click.Choice(["lambert", "petit2010"]),
    default="lambert",
    show_default=True,
    help="L = R E / pi, or the paper's L = R E.",
)
@click.option(
    "--gamma",
    type=NumberRange(0.1, 10.0),
    default=2.2,
    show_default=True,
    help="Exponent that decodes 8-bit textures marked sRGB.",
)
@click.option(
    "--purposes",
    metavar="LIST",
    default="render",
    show_default=True,
    help="Purposes drawn beside default: render, proxy, guide.",
)
@click.option("--mask", metavar="PRIMPATH[,...]", help="Open only these prims.")
@click.option(
    "--variant",
    "variants",
    metavar="PRIM:SET=NAME",
    multiple=True,
    help="Select a variant; may be given more than once.",
)
@click.option("--session-layer", "--sessionLayer", type=FILE, help="Layer over the stage.")
@click.option(
    "--render-settings-prim-path",
    "--renderSettingsPrimPath",
    "-rs",
    metavar="PRIM",
    help="RenderSettings to use. [default: the stage's]",
)
@click.option(
    "--disable-camera-light",
    "--disableCameraLight",
    is_flag=True,
    help="Leave a stage without light dark.",
)
@click.option(
    "--enable-dome-light-visibility",
    "--enableDomeLightVisibility",
    is_flag=True,
    help="Show the sky behind the scene.",
)
@click.option(
    "--samples",
    type=click.IntRange(1, 1024),
    default=1,
    show_default=True,
    help="Samples a pixel; it shows their mean (a box filter of one pixel).",
)
@click.option(
    "--shadows",
    type=click.Choice(["maps", "none"]),
    default="maps",
    show_default=True,
    help="none: every light reaches every surface, as in the paper.",
)
@click.option(
    "--lights",
    type=click.Choice(["auto", "exact", "merged"]),
    default="auto",
    show_default=True,
    help="exact: every light in every pixel. merged: far lamps as one, within 2 % of the "
    "illuminance. auto: merged above 64 lights.",
)
@click.option(
    "--sky-samples",
    type=click.IntRange(0, 1 << 20),
    default=0,
    show_default=True,
    help="Directions in which surfaces hide the sky from one another; 4096 are good to "
    "3 %, 16384 to 1 %. 0: nothing hides it.",
)
@click.option(
    "--compression",
    type=click.Choice(["zip", "piz", "htj2k", "none"]),
    default="zip",
    show_default=True,
    help="Of the EXR, lossless. htj2k is small and quick; readers need OpenEXR 3.4.",
)
@click.option(
    "--scotopic",
    is_flag=True,
    help="Write what rods see as the EXR's layer scotopic.Y, by the S/P ratios of lamps.",
)
@click.option(
    "--mesopic", is_flag=True, help="Write mesopic luminance (CIE 191) as the layer mesopic.Y."
)
@click.option("--half", is_flag=True, help="Half floats in the EXR; above 65504 they clip.")
@click.option(
    "--resume",
    is_flag=True,
    help="Skip frames whose files are there; those of other settings are refused.",
)
@eye_options
@operator_options
@report_options
def command(stage: Path, output: str, **options: Any) -> None:
    """Render STAGE into OUTPUT: .exr for cd/m2, .png for the tone-mapped picture.

    Works on any UsdLux stage. Headless; a software device will do.
    """
    from hdrusd.gpu.context import create_context
    from hdrusd.render import render_sequence
    from hdrusd.report import Report

    report = Report()
    job = _job(stage, output, options)
    started, written, skipped = time.perf_counter(), [], 0
    in_time = False
    total = len(job.times) if job.times is not None else 1
    with click.progressbar(
        length=total, label=stage.name, file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        for frame in render_sequence(create_context(), job, report):
            written += [str(file) for file in frame.files if not frame.skipped]
            in_time |= frame.moment is not None and frame.moment.state is not None
            skipped += frame.skipped
            bar.update(1)
    document = report.as_dict() | {
        "files": written,
        "frames": total,
        "skipped": skipped,
        "seconds": round(time.perf_counter() - started, 3),
    }
    document |= flicker_of(job.log if in_time else None)
    conclude(report, document, written, options)


def _job(stage: Path, output: str, options: dict[str, Any]) -> Any:
    """The options as a Job. Raises UsageError for what does not go together."""
    from hdrusd.job import Job

    suffix = Path(output).suffix.lower()
    if suffix not in (".exr", ".png"):
        raise click.UsageError(f"{output}: want a name that ends in .exr or .png")
    exr, png = (output, options["png"]) if suffix == ".exr" else (None, output)
    if suffix == ".png" and options["png"]:
        raise click.UsageError("--png: OUTPUT is a PNG already; want OUTPUT.exr beside it")
    if exr is None and (options["scotopic"] or options["mesopic"]):
        raise click.UsageError("--scotopic, --mesopic: layers of an EXR; want OUTPUT.exr")
    if png is not None and Path(png).suffix.lower() != ".png":
        raise click.UsageError(f"--png {png}: want a name that ends in .png")
    if options["frames"] is not None and options["default_time"]:
        raise click.UsageError("--frames and --defaultTime exclude one another")
    times = parse_frames(options["frames"]) if options["frames"] is not None else None
    for pattern in (exr, png):
        if pattern is not None:
            check_pattern(pattern, times)
    operator = None
    settings = parse_settings(options["settings"])
    if png is not None and options["operator"]:
        operator = chosen_operator(options["operator"], settings)
    elif png is None:
        _no_picture(options)
    first = times[0] if times else math.inf
    return Job(
        stage=stage,
        times=[float("nan")] if options["default_time"] else times,
        exr=exr,
        png=png,
        camera=options["camera"],
        width=options["image_width"],
        height=options["image_height"],
        operator=operator,
        parameters=settings,
        observer=chosen_observer(options),
        screen=chosen_screen(options),
        glare=chosen_glare(options),
        **night_vision(options),
        start=chosen_start(options, first),
        cut=options["cut"],
        cuts=chosen_cuts(options),
        states=options["state_out"] or (beside(png, ".json") if png else None),
        log=beside(png, ".csv") if png else None,
        plot=plot_file(png or "", options),
        video=options["video"],
        reflection=options["reflection"],
        gamma=options["gamma"],
        purposes=_purposes(options["purposes"]),
        mask=(options["mask"] or "").replace(",", " ").split(),
        variants=options["variants"],
        level=COMPLEXITIES[options["complexity"]],
        session_layer=options["session_layer"],
        settings=options["render_settings_prim_path"],
        default_sky=not options["disable_camera_light"],
        sky_visible=options["enable_dome_light_visibility"],
        samples=options["samples"],
        shadows=options["shadows"] == "maps",
        lights=options["lights"],
        sky_samples=options["sky_samples"],
        scotopic=options["scotopic"],
        mesopic=options["mesopic"],
        half=options["half"],
        compression=options["compression"],
        resume=options["resume"],
    )


#: Options that say how a picture is made of a frame.
_OF_PICTURES = (
    *("operator", "settings", "observer", "screen", "glare", "video", "plot", "cuts"),
    *("adapt_from", "state_in", "state_out", "warm_up"),
)


def _no_picture(options: dict[str, Any]) -> None:
    """Raise UsageError for options that want a picture where there is none."""
    usual = {"night_vision": "none", "cut": "keep"}
    for name in (*_OF_PICTURES, *usual):
        if options[name] and options[name] != usual.get(name):
            option = "set" if name == "settings" else name.replace("_", "-")
            raise click.UsageError(f"--{option}: nothing is tone mapped; want --png or OUTPUT.png")


def _purposes(text: str) -> list[str]:
    purposes = text.replace(",", " ").split()
    for purpose in purposes:
        if purpose not in ("default", "render", "proxy", "guide"):
            raise click.UsageError(f"--purposes: {purpose}; want render, proxy, guide")
    return purposes
