"""The sums of a conversion's account."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from hdrusd.account.images import CLASSES
from hdrusd.photometry.confidence import LEVELS

Row = Mapping[str, Any]


def totals(
    lights: Sequence[Row],
    materials: Sequence[Row],
    images: Sequence[Row],
    findings: Mapping[str, int],
) -> dict[str, Any]:
    """Lamps by rule and confidence, their lumens; textures, materials, findings by class.

    ``findings``: how many of each kind. What the selected states do not show is in none of the
    sums of lights but ``lamps_not_shown``.
    """
    by_rule: Counter[str] = Counter()
    by_confidence: Counter[str] = Counter()
    shown = [row for row in lights if row["lamps_shown"]]
    for row in shown:
        by_rule[row["rule"] or row["provenance"]] += row["lamps_shown"]
        by_confidence[row["confidence"]] += row["lamps_shown"]
    known = [row["flux_lm"] * row["lamps_shown"] for row in shown if row["flux_lm"] is not None]
    classes = Counter(row["class"] for row in images)
    return {
        "lamps": sum(row["lamps_shown"] for row in shown),
        "lamps_not_shown": sum(row["lamps"] - row["lamps_shown"] for row in lights),
        "skies": sum(row["lamps_shown"] for row in shown if row["kind"] == "ambient"),
        "lamps_by_rule": dict(by_rule.most_common()),
        "lamps_by_confidence": {c: by_confidence[c] for c in LEVELS if by_confidence[c]},
        "flux_lm": float(sum(known)) if known else None,
        "textures_by_class": {c: classes[c] for c in CLASSES if classes[c]},
        "textures_missing": sum(row["missing"] for row in images),
        "textures_broken": sum(row["broken"] for row in images),
        "materials": len(materials),
        "materials_judged": sum(row["reflectance"] is not None for row in materials),
        "materials_doubted": sum(bool(row["doubts"]) for row in materials),
        "findings_by_kind": dict(findings),
    }
