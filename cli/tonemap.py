"""``hdrusd tonemap``."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import click

from hdrusd.errors import InputError
from hdrusd.frames import check_pattern, find_frames, frame_path, has_placeholder, parse_frames

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
    NumberRange,
    chosen_operator,
    conclude,
    operator_options,
    parse_settings,
    report_options,
)


@click.command("tonemap")
@click.argument("source", type=str)
@click.argument("output", type=str)
@click.option(
    "--frames",
    "-f",
    metavar="FRAMESPEC[,FRAMESPEC]",
    help="Frames of a numbered sequence. [default: all that exist]",
)
@click.option(
    "--sequence/--stills",
    default=True,
    show_default=True,
    help="Frames are one course in time, or each is seen for long enough alone.",
)
@click.option(
    "--fps",
    type=NumberRange(0.01, 1000.0),
    help="Frames a second. [default: what the frames say, else 24]",
)
@click.option(
    "--field",
    "across",
    type=NumberRange(0.1, 179.0),
    metavar="DEGREES",
    help="Width of the view. [default: the camera's that the frame states, else the screen's, "
    "else 40 for the larger side]",
)
@click.option("--reference", is_flag=True, help="On the CPU, by the NumPy definition.")
@click.option(
    "--resume",
    is_flag=True,
    help="Skip pictures that are there; those of other settings are refused.",
)
@eye_options
@operator_options
@report_options
def command(source: str, output: str, **options: Any) -> None:
    """Tone map SOURCE (.exr, 1.0 = 1 cd/m2) into OUTPUT (.png); both may hold ####."""
    if options["fps"] is not None and not math.isfinite(options["fps"]):
        raise click.UsageError(f"--fps {options['fps']}: want a number")
    if Path(output).suffix.lower() != ".png":
        raise click.UsageError(f"{output}: want a name that ends in .png")
    if Path(source).is_dir():
        raise click.UsageError(f"'{source}' is a directory; want frames, like night.####.exr")
    if options["frames"] is not None:
        times = parse_frames(options["frames"])
        check_pattern(source, times)
        pairs = [(time, frame_path(source, time)) for time in times]
    else:
        pairs = find_frames(source)
    if not pairs:
        raise InputError(Path(source), "no such frames")
    check_pattern(output, [time for time, _ in pairs] if has_placeholder(source) else None)

    from hdrusd.display import tonemap_sequence
    from hdrusd.report import Report

    report = Report()
    # A single picture has no number that a state could be later than.
    first = pairs[0][0] if has_placeholder(source) else math.inf
    showing = _showing(output, first, options)
    label = showing.viewing.operator.name
    jobs = [(time, file, frame_path(output, time)) for time, file in pairs]
    written: list[str] = []
    with click.progressbar(
        length=len(jobs), label=label, file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        for seen in tonemap_sequence(jobs, showing, report):
            if seen.shown is not None:
                written.append(str(seen.file))
            bar.update(1)
    document = report.as_dict() | {
        "files": written,
        "frames": len(jobs),
        "skipped": len(jobs) - len(written),
    }
    in_time = showing.viewing.operator.advance is not None and not showing.stills
    document |= flicker_of(showing.log if in_time else None)
    conclude(report, document, written, options)


def _showing(output: str, first: float, options: dict[str, Any]) -> Any:
    """The options as a Showing. Raises UsageError, InputError, ParameterError."""
    from hdrusd.display import Showing
    from hdrusd.eye.screen import Screen
    from hdrusd.viewing import Viewing

    parameters = parse_settings(options["settings"])
    operator = chosen_operator(options["operator"], parameters)
    screen = chosen_screen(options) or Screen()
    viewing = Viewing(
        operator,
        parameters,
        chosen_observer(options),
        screen,
        chosen_glare(options),
        **night_vision(options),
    )
    return Showing(
        viewing,
        start=chosen_start(options, first),
        cut=options["cut"],
        cuts=chosen_cuts(options),
        stills=not options["sequence"],
        fps=options["fps"],
        across=options["across"],
        states=options["state_out"] or (beside(output, ".json") if options["sequence"] else None),
        log=beside(output, ".csv"),
        plot=plot_file(output, options),
        video=options["video"],
        resume=options["resume"],
        reference=options["reference"],
    )
