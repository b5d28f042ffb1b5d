"""``hdrusd bracket``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from .options import FILE, NumberRange, conclude, report_options


def _numbers(text: str, option: str) -> list[float]:
    """Numbers between commas. Raises BadParameter."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = [math.nan]
    if not all(map(math.isfinite, values)):
        raise click.UsageError(f"{option} {text}: want numbers with commas between them")
    return values


def _whole(values: list[float], text: str, option: str) -> list[int]:
    if any(value != int(value) or abs(value) > 1e6 for value in values):
        raise click.UsageError(f"{option} {text}: want whole pixels")
    return [int(value) for value in values]


@click.command("bracket")
@click.argument("images", nargs=-1, required=True, type=FILE, metavar="IMAGE...")
@click.option(
    "--output", "-o", type=FILE, required=True, metavar="FILE.exr", help="The merged picture."
)
@click.option(
    "--ev",
    metavar="EV,EV,...",
    help="Stops of exposure, one an image, +1 being twice the light; instead of Exif.",
)
@click.option(
    "--exposures",
    metavar="T,T,...",
    help="Exposures, one an image, in any unit (say seconds); instead of Exif.",
)
@click.option(
    "--response",
    metavar="debevec|robertson|srgb|linear|FILE",
    default="debevec",
    show_default=True,
    help="How codes follow light: recovered from the images by either method, or known, or "
    "from the FILE of --response-out.",
)
@click.option("--response-out", type=FILE, help="Write the recovered response as JSON.")
@click.option(
    "--smoothness",
    type=NumberRange(0.0, 1e6),
    help="Debevec and Malik's lambda. [default: 16]",
)
@click.option(
    "--spot",
    "spots",
    multiple=True,
    metavar="X,Y[,R]=CD_M2",
    help="Measured luminance of the disc of R pixels (0: that pixel) around pixel X, Y from "
    "the top left; repeatable.",
)
@click.option("--candela", type=float, help="Intensity of the lamp towards the camera, cd.")
@click.option("--area", type=float, help="Projected area of the lamp, m2; with --candela.")
@click.option(
    "--region",
    metavar="X,Y,W,H",
    help="Pixels that --area covers. [default: the whole picture]",
)
@click.option(
    "--camera-constant",
    type=float,
    metavar="K",
    help="K of L = K N^2 / (t S), which estimates cd/m2 where nothing is measured. "
    "[default: 15.4 (ISO 12232); light meters have 10.6 to 13.4 (ISO 2720)]",
)
@report_options
def command(images: tuple[Path, ...], output: Path, **options: Any) -> None:
    """Merge exposure-bracketed photographs, IMAGE..., into an HDR picture in cd/m2."""
    if output.suffix.lower() != ".exr":
        raise click.UsageError(f"{output}: want a name that ends in .exr")
    if output.absolute() in {image.absolute() for image in images}:
        raise click.UsageError(f"{output}: is one of the images")
    bracket = _asked(images, output, options)

    from hdrusd.bracket.merging import merge_bracket
    from hdrusd.report import Report

    report = Report()
    done = merge_bracket(bracket, report)
    document = report.as_dict() | done
    line = f"{output}: {done['width']} x {done['height']}, peak {done['peak']:.4g} cd/m2"
    conclude(report, document, [line], options)


def _asked(images: tuple[Path, ...], output: Path, options: dict[str, Any]) -> Any:
    """The options as a Bracket. Raises UsageError, ParameterError."""
    from hdrusd.bracket.merging import RESPONSES, Bracket
    from hdrusd.photometry.response import SMOOTHNESS

    if options["ev"] is not None and options["exposures"] is not None:
        raise click.UsageError("--ev and --exposures: want one of them")
    exposures = None
    if options["ev"] is not None:
        stops = _numbers(options["ev"], "--ev")
        if max(map(abs, stops)) > 39.0:
            raise click.UsageError(f"--ev {options['ev']}: want stops of -39 to 39")
        exposures = tuple(2.0**stop for stop in stops)
    elif options["exposures"] is not None:
        exposures = tuple(_numbers(options["exposures"], "--exposures"))
    response: str | Path = options["response"]
    if response not in RESPONSES:
        response = Path(response)
        if not response.is_file():
            raise click.UsageError(
                f"--response {response}: no such file; want one of {', '.join(RESPONSES)} or a file"
            )
    if options["response_out"] is not None and response not in ("debevec", "robertson"):
        raise click.UsageError("--response-out: want a response that is recovered")
    smoothness = options["smoothness"]
    if smoothness is not None and response != "debevec":
        raise click.UsageError("--smoothness: is of --response debevec alone")
    return Bracket(
        images,
        output,
        _calibration(options),
        exposures,
        response,
        options["response_out"],
        SMOOTHNESS if smoothness is None else smoothness,
    )


def _calibration(options: dict[str, Any]) -> Any:
    """The options as a Calibration. Raises UsageError, ParameterError."""
    from hdrusd.bracket.calibration import Calibration, Spot
    from hdrusd.photometry.bracketing import CAMERA_CONSTANT

    spots = []
    for text in options["spots"]:
        where, equals, value = text.partition("=")
        numbers = _numbers(where, "--spot") if equals else []
        if len(numbers) not in (2, 3):
            raise click.UsageError(f"--spot {text}: want X,Y[,R]=CD_M2")
        x, y = _whole(numbers[:2], text, "--spot")
        level = _numbers(value, "--spot")
        if len(level) != 1:
            raise click.UsageError(f"--spot {text}: want X,Y[,R]=CD_M2")
        spots.append(Spot(x, y, numbers[2] if len(numbers) == 3 else 0.0, level[0]))
    region = None
    if options["region"] is not None:
        box = _whole(_numbers(options["region"], "--region"), options["region"], "--region")
        if len(box) != 4:
            raise click.UsageError(f"--region {options['region']}: want X,Y,W,H")
        region = (box[0], box[1], box[2], box[3])
    constant = options["camera_constant"]
    return Calibration(
        tuple(spots),
        options["candela"],
        options["area"],
        region,
        CAMERA_CONSTANT if constant is None else constant,
    )
