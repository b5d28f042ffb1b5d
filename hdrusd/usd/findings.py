"""Findings about prims; the file that they name is the stage's root layer."""

from __future__ import annotations

from pathlib import Path

from pxr import Usd

from hdrusd.errors import SourceRef
from hdrusd.report import Kind, Report


def place_of(stage: Usd.Stage) -> SourceRef:
    """Where a finding about a stage is."""
    return SourceRef(Path(stage.GetRootLayer().identifier))


def prim_finding(report: Report, prim: Usd.Prim, kind: Kind, code: str, text: str) -> None:
    """Note a finding about a prim, or, at the pseudo-root, about the stage as a whole."""
    thing = "" if prim.IsPseudoRoot() else str(prim.GetPath())
    report.add(kind, code, place_of(prim.GetStage()), thing, text)
