"""What a format leaves open of its unit and its up axis, and what is taken for it."""

from __future__ import annotations

from hdrusd.errors import SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Kind, Report


def leave_open(
    scene: LegacyScene,
    resolver: Resolver,
    report: Report,
    code: str,
    name: str,
    *,
    unit: str,
    up: str,
) -> None:
    """Note in ``scene`` that its format states neither, with a finding for what nobody states.

    ``name``: of the format; ``unit``, ``up``: what is taken, in words.
    """
    scene.unit_stated = scene.up_stated = False
    rows = ("unit", "unit", unit, "--source-unit"), ("up", "up axis", up, "--up")
    taken = [row for row in rows if row[0] not in resolver.stated]
    if taken:
        lacks = " and ".join(f"no {what}" for _, what, _, _ in taken)
        words = ", ".join(text for _, _, text, _ in taken)
        options = ", ".join(option for _, _, _, option in taken)
        text = f"{name} states {lacks}: {words} ({options})"
        report.add(Kind.ASSUMED, code, SourceRef(scene.source), "", text)
