"""``hdrusd info``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from .options import FILE


@click.command("info")
@click.argument("file", type=FILE)
@click.option("--json", "as_json", is_flag=True, help="Print it as one JSON object.")
def command(file: Path, as_json: bool) -> None:
    """Say what FILE holds: a legacy database, a stage, or a frame in cd/m2."""
    suffix = file.suffix.lower()
    if suffix == ".exr":
        facts = _frame(file)
    elif suffix in (".usd", ".usda", ".usdc", ".usdz"):
        facts = _stage(file)
    else:
        facts = _legacy(file)
    if as_json:
        click.echo(json.dumps(facts))
        return
    width = max(len(name) for name in facts)
    for name, value in facts.items():
        click.echo(f"{name:<{width}}  {value}")


def _frame(file: Path) -> dict[str, Any]:
    from dataclasses import asdict

    from hdrusd.images import read_exr
    from hdrusd.tonemap.operator import statistics

    rgb, header = read_exr(file)
    facts: dict[str, Any] = {"size": f"{rgb.shape[1]} x {rgb.shape[0]}"}
    stated = "whiteLuminance" in header
    facts["unit"] = "cd/m2" if stated else "not stated (no whiteLuminance)"
    measured = asdict(statistics(rgb))
    facts |= {name: float(f"{v:.6g}") for name, v in measured.items() if v is not None}
    facts |= {k: v for k, v in header.items() if k.startswith("hdrusd:")}
    return facts


def _stage(file: Path) -> dict[str, Any]:
    from hdrusd.report import Report
    from hdrusd.usd.extract import StageReader
    from hdrusd.usd.opening import open_stage
    from hdrusd.usd.settings import read_settings

    report = Report()
    stage = open_stage(file, report=report)
    reader = StageReader(stage, report, default_sky=False)
    settings = read_settings(stage)
    time = stage.GetStartTimeCode()
    camera = reader.camera(settings.camera, time, 16 / 9)
    scene = reader.read(time, camera, sky_visible=True)  # lights alone are worth telling too
    return {
        "metersPerUnit": reader.unit,
        "frames": f"{stage.GetStartTimeCode():g} to {stage.GetEndTimeCode():g}, "
        f"{stage.GetTimeCodesPerSecond():g} a second",
        "triangles": scene.triangles(),
        "draws": len(scene.draws),
        "materials": len(scene.materials),
        "lights": len(scene.lights),
        "ambient_lx": [round(v, 6) for v in scene.ambient],
        "camera": camera.name,
        "resolution": settings.resolution,
        "findings": report.summary(),
    }


def _legacy(file: Path) -> dict[str, Any]:
    from hdrusd.importers.importer import Resolver, read
    from hdrusd.report import Report

    report = Report()
    scene = read(Resolver(file, report), report)
    facts: dict[str, Any] = {"format": scene.format, "generator": scene.generator or "not stated"}
    facts |= scene.counts()
    facts |= {"unit_m": scene.unit_m, "up": scene.up, "findings": report.summary()}
    return facts
