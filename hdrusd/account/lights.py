"""The account of a converted light for the report: what the source says, the rule, what it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hdrusd.legacy.scene import Light
from hdrusd.photometry.confidence import confidence
from hdrusd.photometry.flux import flux
from hdrusd.photometry.light import PhotometricLight
from hdrusd.photometry.match_patterns import Patterns, Thing
from hdrusd.units import sphere_luminance

#: Units of ``value`` by kind; with a photometric file it is a factor.
UNITS = {"point": "cd", "spot": "cd", "distant": "lx", "ambient": "lx"}

#: Of a light with a photometric file.
FACTOR = "times the file"


def light_row(
    name: str,
    path: str,
    light: PhotometricLight,
    source: Light | None = None,
    *,
    place: str = "",
    node: str = "",
    places: int = 1,
    file_flux: float | None = None,
    level: float = 1.0,
) -> dict[str, Any]:
    """One row. ``node``: its name; ``places``: at which it stands; ``file_flux``: lm of its file
    times its factor; ``level``: of what comes from afar the share that a level ground gets.

    ``value`` and ``luminance_cd_m2`` are of one lamp, ``flux_lm`` of one too; ``lamps`` is how
    many there are, ``lamps_shown`` how many of them the selected states show: all, until somebody
    has looked.
    """
    local = light.kind in ("point", "spot")
    lamps = places * (1 if source is None else source.lamps)
    lumens = file_flux if light.profile else flux(light)
    seen = local and not light.profile and light.radius > 0.0
    return {
        "name": name,
        "path": path,
        "place": place,
        "node": node,
        "kind": light.kind,
        "lamps": lamps,
        "lamps_shown": lamps,
        "value": light.intensity,
        "unit": FACTOR if light.profile else UNITS[light.kind],
        "chromaticity": list(light.chromaticity),
        "radius_m": light.radius if local else None,
        "luminance_cd_m2": sphere_luminance(light.intensity, light.radius) if seen else None,
        "flux_lm": lumens,
        "level_lux": None if local else light.intensity * level,
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


def pattern_finder(
    rows: Sequence[Mapping[str, Any]],
) -> Callable[[Sequence[Mapping[str, Any]]], list[str]]:
    """Of a group of ``rows`` the patterns of the photometry file that fit it and no other row."""
    things = [Thing((str(row["name"]), str(row["node"])), str(row["path"])) for row in rows]
    patterns, numbers = Patterns(things), {id(row): number for number, row in enumerate(rows)}

    def find(group: Sequence[Mapping[str, Any]]) -> list[str]:
        found, _ = patterns.of([numbers[id(row)] for row in group])
        return [pattern for pattern, _ in found]

    return find
