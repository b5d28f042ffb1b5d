"""``hdrusd inspect``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from .options import FILE, root_options, tell


@click.command("inspect")
@click.argument("source", type=FILE)
@root_options
@click.option("--json", "as_json", is_flag=True, help="Print all of it as one JSON object.")
@click.option("-q", "--quiet", is_flag=True, help="No findings on the terminal.")
def command(
    source: Path, roots: tuple[Path, ...], search: tuple[Path, ...], as_json: bool, quiet: bool
) -> None:
    """Print what the database SOURCE says: lights, materials, textures, cameras, nodes.

    In its own numbers, before any of them is interpreted; nothing is written.
    """
    if source.suffix.lower() in (".usd", ".usda", ".usdc", ".usdz"):
        raise click.UsageError(f"{source}: a stage; want hdrusd info")
    from hdrusd.importers.importer import Resolver, read
    from hdrusd.inspection import inspect, lines
    from hdrusd.report import Report

    report = Report()
    scene = read(Resolver(source, report, roots, search), report)
    document = inspect(scene, report)
    if as_json:
        click.echo(json.dumps(document))
        return
    for line in lines(document):
        click.echo(line)
    tell(report, quiet)
