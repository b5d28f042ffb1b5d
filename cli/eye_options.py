"""Options about whoever looks at the pictures, shared by ``render`` and ``tonemap``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from hdrusd.frames import has_placeholder, parse_frames

from .options import FILE, NumberRange

if TYPE_CHECKING:
    from hdrusd.course import Start
    from hdrusd.eye.observer import Observer
    from hdrusd.eye.screen import Screen
    from hdrusd.glare.model import GlareModel

F = TypeVar("F", bound=Callable[..., Any])


def eye_options(function: F) -> F:
    """Observer, display, what of the eye is modelled, and where its state comes from."""
    for option in (
        click.option(
            "--video",
            type=FILE,
            help="Write the pictures as .mp4 too (SDR; extra: video).",
        ),
        click.option(
            "--plot",
            is_flag=True,
            help="Plot luminance, state and thresholds over time beside the pictures "
            "(extra: plot); the numbers are in the .csv there.",
        ),
        click.option(
            "--cuts",
            metavar="FRAMESPEC",
            help="Frames that begin a new view; so does a frame of another camera.",
        ),
        click.option(
            "--cut",
            type=click.Choice(["keep", "reset"]),
            default="keep",
            show_default=True,
            help="At a cut the eye keeps its state, or is adapted to the new view.",
        ),
        click.option(
            "--state-out",
            type=FILE,
            help="JSON for the states of the eye, for --resume and --state-in. "
            "[default: beside numbered pictures, NAME.eye.json]",
        ),
        click.option(
            "--state-in",
            type=FILE,
            help="Start with the state of the eye in this .json or EXR frame: that of the latest "
            "frame before the first one, else the last.",
        ),
        click.option(
            "--warm-up",
            metavar="SECONDS",
            type=NumberRange(0.0),
            default=0.0,
            help="Look at the first frame for so long after --adapt-from or --state-in.",
        ),
        click.option(
            "--adapt-from",
            metavar="L[,SECONDS]",
            help="Before the first frame the eye was adapted to L cd/m2, or saw it for SECONDS "
            "out of the dark. [default: adapted to the first frame]",
        ),
        click.option(
            "--screen",
            metavar="NAME|KEY=VALUE[,...]",
            help="Screen and its room; see: hdrusd screens.",
        ),
        click.option(
            "--observer",
            metavar="NAME|KEY=VALUE[,...]",
            help="Whose eye, as elderly or age=70,pigment=0.5; see: hdrusd observers.",
        ),
        click.option(
            "--night-vision",
            type=click.Choice(["none", "colour", "acuity", "all"]),
            default="none",
            show_default=True,
            help="Loss of colour, of detail, or of both where it is dark.",
        ),
        click.option(
            "--glare",
            metavar="MODEL",
            help="Veil of scattered light: cie135, spencer95 or ward97. [default: none]",
        ),
    ):
        function = option(function)
    return function


def chosen_observer(options: dict[str, Any]) -> Observer:
    """Raises UnknownNameError, ParameterError, InputError."""
    from hdrusd.eye.observer import Observer

    return Observer.parse(options["observer"]) if options["observer"] else Observer()


def chosen_screen(options: dict[str, Any]) -> Screen | None:
    """None where the user names none. Raises as ``chosen_observer``."""
    from hdrusd.eye.screen import Screen

    return Screen.parse(options["screen"]) if options["screen"] else None


def chosen_glare(options: dict[str, Any]) -> GlareModel | None:
    """Raises UnknownNameError."""
    from hdrusd.glare.model import MODELS

    name = options["glare"]
    return None if name in (None, "none") else MODELS[name]


def chosen_start(options: dict[str, Any], first: float) -> Start:
    """What the eye did before the frame ``first``. Raises UsageError."""
    from hdrusd.course import Start

    text, file, warm_up = options["adapt_from"], options["state_in"], options["warm_up"]
    if text is not None and file is not None:
        raise click.UsageError("--adapt-from and --state-in exclude one another")
    if text is None and file is None and warm_up:
        raise click.UsageError("--warm-up: want --adapt-from or --state-in too")
    if file is not None:
        return Start(file=file, before=first, warm_up=warm_up)
    luminance, seconds = _adapted(text) if text is not None else (None, None)
    return Start(luminance, seconds, warm_up=warm_up)


def _adapted(text: str) -> tuple[float, float | None]:
    """``L`` or ``L,SECONDS`` of --adapt-from."""
    luminance, comma, seconds = text.partition(",")
    try:
        numbers = float(luminance), float(seconds) if comma else None
    except ValueError:
        numbers = -1.0, None
    if not (0.0 < numbers[0] < 1e12 and (numbers[1] is None or 0.0 <= numbers[1] < 1e12)):
        raise click.UsageError(f"--adapt-from {text}: want cd/m2 above 0, or cd/m2,seconds")
    return numbers


def chosen_cuts(options: dict[str, Any]) -> list[float]:
    """Frames of --cuts. Raises FrameError."""
    return parse_frames(options["cuts"]) if options["cuts"] else []


def beside(pattern: str, suffix: str) -> Path | None:
    """The file of a numbered sequence as a whole: night.####.png and .json is night.eye.json."""
    if not has_placeholder(pattern):
        return None
    path = Path(pattern)
    return path.with_name(f"{path.name.split('#')[0].rstrip('._-') or 'sequence'}.eye{suffix}")


def plot_file(pattern: str, options: dict[str, Any]) -> Path | None:
    """Where --plot goes. Raises UsageError where there is no sequence in time."""
    if not options["plot"]:
        return None
    plot = beside(pattern, ".png")
    if plot is None or not options.get("sequence", True):
        raise click.UsageError("--plot: want a numbered sequence, as out.####.png")
    return plot


def night_vision(options: dict[str, Any]) -> dict[str, bool]:
    """--night-vision as what Viewing and Job call its parts."""
    chosen = options["night_vision"]
    return {"acuity": chosen in ("acuity", "all"), "night_colour": chosen in ("colour", "all")}


def flicker_of(log: Path | None) -> dict[str, float]:
    """What a sequence in time says of its steadiness, for --json and --report."""
    from hdrusd.adaptation_log import AdaptationLog
    from hdrusd.by_products import flicker

    if log is None or not log.is_file():
        return {}
    return {"flicker": round(flicker(AdaptationLog.read_csv(log)), 6)}
