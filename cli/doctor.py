"""``hdrusd doctor``."""

from __future__ import annotations

import json
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import click

from hdrusd import __version__
from hdrusd.errors import ContextError, HdrusdError

_PACKAGES = ("usd-core", "numpy", "OpenImageIO", "OpenEXR", "moderngl", "click")


@click.command("doctor")
@click.option("--json", "as_json", is_flag=True, help="Print it as one JSON object.")
def command(as_json: bool) -> None:
    """Say which OpenGL device, versions and missing pieces there are."""
    facts: dict[str, Any] = {
        "hdrusd": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
    }
    code = 0
    for package in _PACKAGES:
        try:
            facts[package] = version(package)
        except PackageNotFoundError:
            facts[package] = f"missing; pip install {package}"
            code = 1
    device, device_code = _device()
    facts |= device
    schemas, schema_code = _schemas()
    facts |= schemas
    if as_json:
        click.echo(json.dumps(facts))
    else:
        width = max(len(name) for name in facts)
        for name, value in facts.items():
            click.echo(f"{name:<{width}}  {value}")
    sys.exit(device_code or schema_code or code)


def _device() -> tuple[dict[str, Any], int]:
    try:
        from hdrusd.gpu.context import create_context, describe

        described = describe(create_context())
    except ContextError as problem:
        return {"OpenGL": str(problem)}, problem.exit_code
    except ImportError as problem:
        return {"OpenGL": f"moderngl cannot be imported ({problem})"}, ContextError.exit_code
    return {f"OpenGL {name}": value for name, value in described.items()}, 0


def _schemas() -> tuple[dict[str, Any], int]:
    try:
        from hdrusd.schemas import PLUGIN_DIR, register

        register()
    except (HdrusdError, ImportError) as problem:
        return {"schemas": str(problem)}, 1
    return {"schemas": str(PLUGIN_DIR)}, 0
