"""What an entry of what to fix first is, and what a ranking asks of a scene.

An entry is worth little where many things of one kind share the scene; together they are one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

Row = Mapping[str, Any]

#: Rows of lights that are one to a person.
Group = Sequence[Row]

#: Entries that are worth a person's morning, and the impact from which on one is.
MOST, LEAST = 10, 0.02

PHOTOMETRY, COMMAND, SOURCE = "photometry.toml", "command line", "source"

#: Of many things these are named.
_NAMED = 3

#: The entry of the photometry file that a rule names.
_ENTRY = re.compile(r":((?:light|lamp|material)\[\d+\]|ambient)")

#: Decades that a number may be off by its confidence.
DECADES = {"none": 1.0, "low": 0.5, "medium": 0.1, "high": 0.0}

#: What a person is told of a number by its confidence.
TRUST = {
    "none": "guessed from a colour without a unit",
    "low": "typical of its class, or somebody's guess",
    "medium": "stated without a source, or by the lamp's type",
    "high": "measured, or stated with its source",
}

#: What stands beside a number that is written back as it is, so that a copy is not trusted more
#: than the original: a guess stays one, and who fills in a source has looked.
KEPT = {
    "none": {"provenance": "estimated"},
    "low": {"provenance": "estimated"},
    "medium": {"source": ""},
    "high": {},
}


@dataclass(frozen=True, slots=True)
class Entry:
    """One thing to fix; ``write`` goes ``where``, None where there is nothing to copy."""

    impact: float
    what: str
    why: str
    where: str
    write: str | None

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "impact": round(self.impact, 4),
            "what": self.what,
            "why": self.why,
            "where": self.where,
            "write": self.write,
        }


@dataclass(frozen=True)
class Scene:
    """What a ranking needs of a conversion. ``ground``: m2 below it; ``diagonal``: m;
    ``findings``: their JSON form.
    """

    lights: Sequence[Row]
    materials: Sequence[Row]
    images: Sequence[Row]
    findings: Sequence[Row]
    ground: float
    diagonal: float
    unit_stated: bool = False
    name: str = ""  # of the source file, without its suffix

    def flux(self, row: Row) -> float:
        """Lumens that a row of lights sends into the scene in the states that are shown."""
        if row["kind"] in ("distant", "ambient"):
            # Where there is no ground, walls are what is lit, and they stand each their way.
            lux, area = row["level_lux"], self.ground
            if not self.ground:
                lux, area = row["value"], self.diagonal**2
            return float(lux * row["lamps_shown"] * area)
        return float((row["flux_lm"] or 0.0) * row["lamps_shown"])

    def glow(self, row: Row) -> float:
        """Lumens of a material that glows on one side: pi L A."""
        return math.pi * float(row["luminance_cd_m2"]) * float(row["area_m2"])

    @cached_property
    def lit(self) -> float:
        """Lumens of all lights."""
        return sum(map(self.flux, self.lights))

    @cached_property
    def lumens(self) -> float:
        """Lumens of lights and of what glows."""
        return self.lit + sum(map(self.glow, self.materials))

    @cached_property
    def area(self) -> float:
        """m2 of all surfaces."""
        return float(sum(row["area_m2"] for row in self.materials))


def first(tables: Sequence[str]) -> str:
    """Entries; of very many the first."""
    more = [f"# and {len(tables) - MOST} more like these"] if len(tables) > MOST else []
    return "\n".join([*tables[:MOST], *more])


def entries(named: Iterable[tuple[str, str]]) -> str | None:
    """Entries by name; a second one of a name would not count."""
    found: dict[str, str] = {}
    for name, text in named:
        found.setdefault(name, text)
    return first(list(found.values())) if found else None


def entry_of(row: Row) -> str:
    """The entry of the photometry file that a number is from, "" where it is from elsewhere."""
    found = _ENTRY.search(row["rule"] or "")
    return found[1] if found else ""


def rule_of(row: Row) -> str:
    """The rule of a number; of one of the photometry file the file."""
    return str(_ENTRY.split(row["rule"])[0] if entry_of(row) else row["rule"] or row["provenance"])


def few(names: Sequence[str]) -> str:
    """The first of the different names."""
    different = list(dict.fromkeys(names))
    return ", ".join(different[:_NAMED]) + (", ..." if len(different) > _NAMED else "")


def share_of(part: float, whole: float) -> float:
    """The share that ``part`` is of ``whole``; 0 of nothing."""
    return part / whole if whole > 0.0 else 0.0


def percent(share: float) -> str:
    """A share as a person reads it."""
    return f"{100.0 * share:.0f} %" if share >= 0.01 else "under 1 %"
