"""``hdrusd convert``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import click

from hdrusd.errors import HdrusdError
from hdrusd.photometry.estimate import DEFAULT_RULE, RULES

from .options import (
    FILE,
    NumberRange,
    finish,
    measure_options,
    report_options,
    root_options,
    tell,
    write_report,
)


@click.command("convert")
@click.argument("source", type=FILE)
@click.argument("output", type=FILE)
@click.option("--photometry", type=FILE, help="Photometry file. [default: photometry.toml beside]")
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
@report_options
def command(
    source: Path,
    output: Path,
    photometry: Path | None,
    estimate: str,
    gamma: float | None,
    meters_per_unit: float,
    source_unit: float | None,
    up: str | None,
    roots: tuple[Path, ...],
    search: tuple[Path, ...],
    report_file: Path | None,
    strict: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Turn SOURCE into a photometric stage OUTPUT.usda.

    SOURCE: a database (.3ds .ac .b3d .dae .fbx .flt .glb .gltf .ive .kmz .lwo .ms3d .obj .off
    .osg .osgb .osgt .ply .stl .x .zae), or a stage (.usd .usda .usdc .usdz). Beside OUTPUT stand
    its layers (geometry, look, photometry) and textures. A stage stays where it is and as it is;
    OUTPUT names it below a layer with its photometry, and may not replace it.
    """
    from hdrusd.account.text import summary
    from hdrusd.conversion import Options
    from hdrusd.convert import OUTPUT_SUFFIXES, convert
    from hdrusd.report import Report

    if output.suffix.lower() not in OUTPUT_SUFFIXES:
        raise click.UsageError(f"{output}: want a name that ends in {' or '.join(OUTPUT_SUFFIXES)}")
    report = Report()
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
    try:
        result = convert(source, output, options, report)
    except HdrusdError:
        tell(report, quiet)  # what led to it
        if report_file is not None:
            write_report(report_file, report.as_dict())
        raise
    document = result.as_dict()
    if report_file is not None:
        write_report(report_file, document)
    tell(report, quiet)
    if not quiet:
        for line in summary(document, shutil.get_terminal_size((100, 24)).columns):
            click.echo(line, err=True)
    if as_json:
        click.echo(json.dumps(document))
    else:
        counts = result.counts
        click.echo(
            f"{output}: {counts['triangles']} triangles, {counts['materials']} materials, "
            f"{len(result.textures)} textures, "
            f"{sum(row['lamps'] for row in result.lights)} lights"
        )
    finish(report, strict)
