"""``hdrusd convert``."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from hdrusd.errors import HdrusdError, InputError, one_line
from hdrusd.photometry.estimate import DEFAULT_RULE, RULES

from .options import (
    FILE,
    PLACE,
    STRICT,
    NumberRange,
    finish,
    measure_options,
    report_options,
    root_options,
    tell,
    write_report,
)

if TYPE_CHECKING:
    from hdrusd.account.many import Converted
    from hdrusd.conversion import Options


@click.command("convert")
@click.argument("sources", metavar="SOURCE...", nargs=-1, type=PLACE)
@click.argument("output", type=PLACE)
@click.option(
    "--photometry",
    type=FILE,
    help="Photometry file. [default: photometry.toml beside, or nearest above in a folder SOURCE]",
)
@click.option(
    "--estimate",
    metavar="RULE",
    default=DEFAULT_RULE,
    show_default=True,
    help=f"Rule for lights and emission without a unit: {', '.join(RULES.names())}.",
)
@click.option(
    "--gamma",
    type=NumberRange(0.1, 10.0),
    help="Exponent in R = T^gamma * D of all materials; overrides the photometry file. "
    "[default: the photometry file's, else 2.2]",
)
@click.option(
    "--meters-per-unit",
    "--metersPerUnit",
    type=NumberRange(1e-9, 1e9),
    default=1.0,
    show_default=True,
    help="Unit of the stage.",
)
@measure_options
@root_options
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1, 64),
    help="Files converted at once, of several. [default: one a core]",
)
@report_options
def command(
    sources: tuple[Path, ...],
    output: Path,
    photometry: Path | None,
    estimate: str,
    gamma: float | None,
    meters_per_unit: float,
    source_unit: float | None,
    up: str | None,
    roots: tuple[Path, ...],
    search: tuple[Path, ...],
    jobs: int | None,
    report_file: Path | None,
    strict: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Turn SOURCE into a photometric stage OUTPUT.usda, or many into stages below a folder.

    SOURCE: a database (.3ds .ac .b3d .dae .fbx .flt .glb .gltf .ive .kmz .lwo .ms3d .obj .off
    .osg .osgb .osgt .ply .stl .x .zae), or a stage (.usd .usda .usdc .usdz). Beside OUTPUT stand
    its layers (geometry, look, photometry) and textures. A stage stays where it is and as it is;
    OUTPUT names it below a layer with its photometry, and may not replace it.

    Several sources, or a folder, which stands for every database below it, become the same tree
    of stages below the folder OUTPUT. Each may name files anywhere in that folder; one that is
    refused, or that kills its reader, does not stop the others. Hidden files, links that lead out
    and what hdrusd wrote are passed over.
    """
    if not sources:  # the one name that is there went to OUTPUT
        raise click.UsageError("Missing argument 'OUTPUT'.")
    from hdrusd.conversion import Options
    from hdrusd.convert import OUTPUT_SUFFIXES

    options = Options(
        photometry=photometry,
        estimate=estimate,
        gamma=gamma,
        meters_per_unit=meters_per_unit,
        source_unit=source_unit,
        up=up,
        roots=roots,
        search=search,
    )
    telling = Telling(report_file, strict=strict, as_json=as_json, quiet=quiet)
    if len(sources) > 1 or sources[0].is_dir():
        if output.is_file() or output.suffix.lower() in OUTPUT_SUFFIXES:
            raise click.UsageError(f"{output}: want a folder for the stages of many sources")
        _convert_many(sources, output, options, jobs, telling)
        return
    if jobs is not None:
        raise click.UsageError("--jobs: want several sources, or a folder")
    if output.suffix.lower() not in OUTPUT_SUFFIXES:
        if not sources[0].exists():  # a folder by a wrong name may be meant
            raise InputError(sources[0], "no such file or folder")
        raise click.UsageError(f"{output}: want a name that ends in {' or '.join(OUTPUT_SUFFIXES)}")
    _convert_one(sources[0], output, options, telling)


class Telling(NamedTuple):
    """Where the account goes."""

    report_file: Path | None
    strict: bool
    as_json: bool
    quiet: bool

    def account(self, document: dict[str, Any], lines: Callable[[int], list[str]]) -> None:
        """The report, the summary and the JSON object."""
        if not self.quiet:
            for line in lines(shutil.get_terminal_size((100, 24)).columns):
                click.echo(line, err=True)
        if self.as_json:
            click.echo(json.dumps(document))


def _convert_one(source: Path, output: Path, options: Options, telling: Telling) -> None:
    from hdrusd.account.text import summary
    from hdrusd.convert import convert
    from hdrusd.report import Report

    report = Report()
    try:
        result = convert(source, output, options, report)
    except HdrusdError:
        tell(report, telling.quiet)  # what led to it
        if telling.report_file is not None:
            write_report(telling.report_file, report.as_dict())
        raise
    document = result.as_dict()
    if telling.report_file is not None:
        write_report(telling.report_file, document)
    tell(report, telling.quiet)
    telling.account(document, partial(summary, document))
    if not telling.as_json:
        click.echo(_line(output, document))
    finish(report, telling.strict)


def _convert_many(
    sources: tuple[Path, ...], output: Path, options: Options, jobs: int | None, telling: Telling
) -> None:
    from hdrusd.account.many import batch_document
    from hdrusd.account.text import batch_summary
    from hdrusd.batch.plan import plan
    from hdrusd.batch.workers import convert_all
    from hdrusd.map_threads import CORES
    from hdrusd.photometry.sidecar import read_sidecar
    from hdrusd.report import Report

    RULES[options.estimate]  # what is wrong of all files is said once, and at once
    recipes = Report()
    if options.photometry is not None:
        read_sidecar(options.photometry, recipes)

    def passed_over(line: str) -> None:
        if not telling.quiet:
            click.echo(line, err=True)

    tasks = plan(sources, output, options.photometry, passed_over)
    _check_writable(output)
    for path in sorted({task.photometry for task in tasks if task.photometry}):
        with suppress(InputError):  # each of its files is refused, and says so
            read_sidecar(path, recipes)
    tell(recipes, telling.quiet)
    rows: list[Converted] = []
    try:
        with closing(convert_all(tasks, options, jobs or CORES)) as run:
            for row in run:
                rows.append(row)
                if row.code:
                    click.echo(_refusal(row.source, row.error), err=True)
                elif not telling.as_json:
                    click.echo(_line(row.output, row.document))
    finally:  # of an interrupted run what was done
        document = batch_document(rows)
        if telling.report_file is not None:
            write_report(telling.report_file, document)
    telling.account(document, partial(batch_summary, document))
    if any(row.code for row in rows):
        sys.exit(InputError.exit_code)
    if telling.strict and document["findings_by_code"]:
        sys.exit(STRICT)


def _check_writable(output: Path) -> None:
    """Said once before the work, and not of every file after it."""
    home = output.absolute()
    above = next(folder for folder in (home, *home.parents) if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=above):
            pass
    except OSError as problem:
        text = f"{output}: nothing can be written in {above} ({problem.strerror})"
        raise HdrusdError(text) from problem


def _refusal(source: Path, error: str) -> str:
    """With the whole path: many folders may have a file of that name."""
    name = one_line(source.name)  # as errors have it
    rest = error.removeprefix(name) if error.startswith(name) else f": {error}"
    return f"{one_line(str(source))}{rest}"


def _line(output: Path, document: Mapping[str, Any]) -> str:
    from hdrusd.account.text import lights_and_skies

    counts, textures = document["counts"], len(document["textures"])
    return (
        f"{output}: {counts['triangles']} triangles, {counts['materials']} materials, "
        f"{textures} textures, lights: {lights_and_skies(document['totals'])}"
    )
