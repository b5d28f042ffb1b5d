"""``hdrusd check``."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path

import click

from hdrusd.errors import ValidationError

from .options import FILE, STRICT, tell


@click.command("check")
@click.argument("stage", type=FILE)
@click.option("--json", "as_json", is_flag=True, help="Print the problems as JSON.")
@click.option("--strict", is_flag=True, help=f"Exit with {STRICT} on warnings too.")
def command(stage: Path, as_json: bool, strict: bool) -> None:
    """Validate STAGE: units, light intensities, reflectances, sky."""
    from hdrusd.checking import validate
    from hdrusd.report import Report
    from hdrusd.usd.opening import open_stage, usd_warnings

    report = Report()
    opened = open_stage(stage, report=report)
    with usd_warnings(stage, report):
        problems = validate(opened)
    if as_json:
        click.echo(json.dumps([asdict(problem) for problem in problems]))
    else:
        for problem in problems:
            click.echo(f"{stage.name}: {problem.severity}: {problem}")
        tell(report, quiet=False)
    errors = sum(problem.severity == "error" for problem in problems)
    if not as_json:
        click.echo(f"{stage.name}: {errors} errors, {len(problems) - errors} warnings", err=True)
    if errors:
        sys.exit(ValidationError.exit_code)
    if strict and problems:
        sys.exit(STRICT)
