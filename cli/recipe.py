"""``hdrusd recipe``."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from hdrusd.errors import HdrusdError

from .options import FILE, measure_options, root_options, tell


@click.group("recipe")
def command() -> None:
    """Write a first photometry file, by what a database holds."""


@command.command("init")
@click.argument("source", type=FILE)
@click.argument("output", type=click.Path(path_type=Path, allow_dash=True), required=False)
@measure_options
@root_options
@click.option("--overwrite", is_flag=True, help="Replace OUTPUT where it exists.")
@click.option("-q", "--quiet", is_flag=True, help="No findings on the terminal.")
def init(
    source: Path,
    output: Path | None,
    roots: tuple[Path, ...],
    search: tuple[Path, ...],
    source_unit: float | None,
    up: Literal["Y", "Z"] | None,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Propose photometry for the lamps of SOURCE, as OUTPUT [photometry.toml beside it; - prints].

    Lamps are found by lights and light points, glowing materials, names, and bright spots in
    textures; numbers are typical of each class, with its range and source. What is only
    suspected is commented out. Edit it, then: hdrusd convert SOURCE STAGE.usda
    """
    from hdrusd.importers.importer import Resolver
    from hdrusd.photometry.sidecar import FILE_NAME
    from hdrusd.recipe.making import write_recipe
    from hdrusd.report import Report

    output = source.parent / FILE_NAME if output is None else output
    printed = str(output) == "-"
    if not printed and output.is_dir():
        raise click.UsageError(f"{output}: a folder; want the name of a file")
    if not printed and output.exists() and output.samefile(source):
        raise click.UsageError(f"{output}: the database itself; want another OUTPUT")
    if not printed and output.exists() and not overwrite:
        raise HdrusdError(f"{output}: exists; want another OUTPUT, or --overwrite")
    report = Report()
    resolver = Resolver(source, report, roots, search)
    target = None if printed else output
    found = write_recipe(resolver, target, source_unit=source_unit, up=up)
    if printed:
        click.echo(found.text, nl=False)
    tell(report, quiet)
    if not printed:
        click.echo(f"{output}: {found.entries} entries, {found.suspicions} suspicions")
