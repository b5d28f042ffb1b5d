"""``hdrusd operators``."""

from __future__ import annotations

import click


@click.command("operators")
@click.argument("name", required=False)
def command(name: str | None) -> None:
    """List the tone mapping operators, or explain NAME: parameters, units, source."""
    from hdrusd.tonemap.operator import OPERATORS

    if name is None:
        names = OPERATORS.names()
        width = max(len(known) for known in names)
        for known in names:
            click.echo(f"{known:<{width}}  {OPERATORS[known].title}")
        return
    operator = OPERATORS[name]
    click.echo(f"{operator.name}: {operator.title}")
    click.echo(f"  {operator.cite}")
    if operator.advance is not None:
        click.echo("  in time: a sequence has a state, which goes on from frame to frame")
    for parameter in operator.parameters:
        unit = f" {parameter.unit}" if parameter.unit else ""
        default = "none" if parameter.default is None else parameter.default
        click.echo(f"  --set {parameter.name}={default}{unit}: {parameter.meaning}")
