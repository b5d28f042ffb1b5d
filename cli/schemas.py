"""``hdrusd schemas``."""

from __future__ import annotations

import click


@click.command("schemas")
def command() -> None:
    """Print the folder of the schemas: PXR_PLUGINPATH_NAME=$(hdrusd schemas) usdview ..."""
    from hdrusd.schemas import PLUGIN_DIR

    click.echo(str(PLUGIN_DIR))
