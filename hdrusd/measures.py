"""The unit and the up axis of a source: what it states, and what a person states of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hdrusd.errors import SourceRef
from hdrusd.photometry.sidecar import Sidecar
from hdrusd.report import Kind, Report

Value = float | str


@dataclass(frozen=True, slots=True)
class Measures:
    """``unit_m``: metres a unit; ``up``: "Y" or "Z"; None of what is not stated."""

    unit_m: float | None = None
    up: str | None = None


def stated_measures(
    own: Measures,
    asked: Measures,
    sidecar: Sidecar,
    source: SourceRef,
    report: Report,
    *,
    shared: bool,
) -> Measures:
    """What a person states of a source and counts; None where the source's ``own`` does.

    ``asked`` by options goes before the photometry file's ``[source]``. That of several sources
    (``shared``) fills in what a source leaves open and replaces nothing. Where the source says
    otherwise there is a finding.
    """

    def choose(
        key: str, own: Value | None, asked: Value | None, file: Value | None
    ) -> Value | None:
        stated, by = asked, "option"
        if stated is None and file is not None:
            if shared and own is not None and not _same(own, file):
                sidecar.pass_over(key)
                return None
            stated, by = file, f"[source] {key}"
        if own is not None and stated is not None and not _same(own, stated):
            text = f"the file says {_shown(own)}; {_shown(stated)} is used, by {by}"
            report.add(Kind.REPLACED, "source-measure", source, "", text)
        return stated

    unit = choose("unit", own.unit_m, asked.unit_m, sidecar.unit_m)
    up = choose("up", own.up, asked.up, sidecar.up)
    return Measures(None if unit is None else float(unit), None if up is None else str(up))


def _same(one: Value, other: Value) -> bool:
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return math.isclose(one, other, rel_tol=1e-9)


def _shown(value: Value) -> str:
    return f"{value} up" if isinstance(value, str) else f"{value:.6g} m"
