"""The account of a converted light for the report: what the source says, the rule, what it is."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from glob import escape
from itertools import takewhile
from typing import Any

from hdrusd.legacy.scene import Light
from hdrusd.photometry.confidence import confidence
from hdrusd.photometry.flux import flux
from hdrusd.photometry.light import PhotometricLight
from hdrusd.units import sphere_luminance

#: Units of ``value`` by kind; with a photometric file it is a factor.
UNITS = {"point": "cd", "spot": "cd", "distant": "lx", "ambient": "lx"}

#: Of a light with a photometric file.
FACTOR = "times the file"

#: The last of all characters; the digits, each one.
_LAST, _DIGITS = chr(0x10FFFF), tuple("0123456789")


def light_row(
    name: str,
    path: str,
    light: PhotometricLight,
    source: Light | None = None,
    *,
    place: str = "",
    places: int = 1,
    file_flux: float | None = None,
) -> dict[str, Any]:
    """One row. ``places``: at which it stands; ``file_flux``: lm of its file times its factor.

    ``value`` and ``luminance_cd_m2`` are of one lamp, ``flux_lm`` of one too; ``lamps`` is how
    many there are.
    """
    local = light.kind in ("point", "spot")
    lumens = file_flux if light.profile else flux(light)
    seen = local and not light.profile and light.radius > 0.0
    return {
        "name": name,
        "path": path,
        "place": place,
        "kind": light.kind,
        "lamps": places * (1 if source is None else source.lamps),
        "value": light.intensity,
        "unit": FACTOR if light.profile else UNITS[light.kind],
        "chromaticity": list(light.chromaticity),
        "radius_m": light.radius if local else None,
        "luminance_cd_m2": sphere_luminance(light.intensity, light.radius) if seen else None,
        "flux_lm": lumens,
        "provenance": light.provenance,
        "rule": light.rule,
        "source": light.source,
        "confidence": confidence(light.provenance, light.rule, light.source),
        "source_value": None if source is None else source_value(source),
        "file": light.profile or None,
    }


def source_value(light: Light) -> dict[str, Any]:
    """What the source says of a light's strength, in its own unit.

    ``unit``: "cd" or "lx" where the format has them, else "colour": 1 is white on the screen.
    """
    stated = light.lux if light.kind == "directional" else light.candela
    unit = "colour" if stated is None else "lx" if light.kind == "directional" else "cd"
    color = light.ambient if light.kind == "ambient" and any(light.ambient) else light.diffuse
    return {
        "unit": unit,
        "value": stated,
        "diffuse": list(color),
        "candela": light.candela,
        "lux": light.lux,
    }


def grouped(rows: Sequence[Mapping[str, Any]]) -> list[list[Mapping[str, Any]]]:
    """Rows of lights that are one to a person: same rule, value and stem of the name."""
    groups: dict[tuple[object, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        stem = row["name"].rstrip("0123456789._- ")
        key = stem, row["kind"], row["rule"], row["confidence"], f"{row['value']:.3g}", row["file"]
        groups.setdefault(key, []).append(row)
    return list(groups.values())


def group_name(group: Sequence[Mapping[str, Any]]) -> str:
    """``ls0 ... ls5`` of a group."""
    first, last = str(group[0]["name"]), str(group[-1]["name"])
    return first if first == last else f"{first} ... {last}"


def group_pattern(group: Sequence[Mapping[str, Any]], everything: Sequence[str]) -> str:
    """The shell pattern of the photometry file that fits a group and nothing else.

    ``everything``: the names of all lights, sorted. Only the first of the group where names cannot
    tell it from others.
    """
    names = sorted({str(row["name"]) for row in group})
    if len(names) == 1:
        return escape(names[0])
    pairs = zip(names[0], names[-1], strict=False)
    same = "".join(a for a, _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
    stem = same.rstrip("0123456789")
    begins = _between(everything, stem, stem + _LAST)
    if stem and begins == len(group):
        return f"{escape(stem)}*"
    numbered = all(name[len(stem) : len(stem) + 1] in _DIGITS for name in names)
    if stem and numbered and _between(everything, stem + "0", stem + ":") == len(group):
        return f"{escape(stem)}[0-9]*"
    return escape(names[0])


def _between(names: Sequence[str], first: str, end: str) -> int:
    """How many of sorted names stand from ``first`` up to ``end``."""
    return bisect_left(names, end) - bisect_left(names, first)
