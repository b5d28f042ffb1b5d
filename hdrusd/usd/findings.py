"""Findings about prims; the file that they name is the stage's root layer."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from pxr import Sdf, Usd

from hdrusd.errors import SourceRef
from hdrusd.report import Kind, Report


def place_of(stage: Usd.Stage) -> SourceRef:
    """Where a finding about a stage is."""
    return SourceRef(Path(stage.GetRootLayer().identifier))


def first_place(prim: Usd.Prim) -> Sdf.Path:
    """Its path; of what is in a prototype, whose name USD makes up, that in its first instance."""
    path = prim.GetPath()
    while prim.IsInPrototype():
        while not prim.IsPrototype():
            prim = prim.GetParent()
        instance = _first_instance(prim)
        if not instance:  # gone since
            _first_instance.cache_clear()
            instance = _first_instance(prim)
        path, prim = path.ReplacePrefix(prim.GetPath(), instance.GetPath()), instance
    return path


@lru_cache(maxsize=1024)  # there may be 100,000 instances, and a finding for each of many prims
def _first_instance(prototype: Usd.Prim) -> Usd.Prim:
    return min(prototype.GetInstances(), key=Usd.Prim.GetPath)


def prim_finding(report: Report, prim: Usd.Prim, kind: Kind, code: str, text: str) -> None:
    """Note a finding about a prim, or, at the pseudo-root, about the stage as a whole."""
    thing = "" if prim.IsPseudoRoot() else str(first_place(prim))
    report.add(kind, code, place_of(prim.GetStage()), thing, text)
