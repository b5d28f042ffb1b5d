"""``hdrusd tonemap``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from hdrusd.errors import InputError
from hdrusd.frames import check_pattern, find_frames, frame_path, has_placeholder, parse_frames

from .options import (
    chosen_operator,
    finish,
    operator_options,
    parse_settings,
    report_options,
    tell,
    write_report,
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
@click.option("--reference", is_flag=True, help="On the CPU, by the NumPy definition.")
@click.option("--resume", is_flag=True, help="Skip pictures that are there.")
@operator_options
@report_options
def command(
    source: str,
    output: str,
    frames: str | None,
    reference: bool,
    resume: bool,
    operator: str | None,
    settings: tuple[str, ...],
    report_file: Path | None,
    strict: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Tone map SOURCE (.exr, 1.0 = 1 cd/m2) into OUTPUT (.png); both may hold ####."""
    if Path(output).suffix.lower() != ".png":
        raise click.UsageError(f"{output}: want a name that ends in .png")
    if frames is not None:
        times = parse_frames(frames)
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
    parameters = parse_settings(settings)
    chosen = chosen_operator(operator, parameters)
    jobs = [(file, frame_path(output, time)) for time, file in pairs]
    written: list[str] = []
    with click.progressbar(
        length=len(jobs), label=chosen.name, file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        for file in tonemap_sequence(
            jobs, chosen, parameters, report, reference=reference, resume=resume
        ):
            if file is not None:
                written.append(str(file))
            bar.update(1)
    document = report.as_dict() | {
        "files": written,
        "frames": len(jobs),
        "skipped": len(jobs) - len(written),
    }
    if report_file is not None:
        write_report(report_file, document)
    tell(report, quiet)
    if as_json:
        click.echo(json.dumps(document))
    else:
        for name in written:
            click.echo(name)
    finish(report, strict)
