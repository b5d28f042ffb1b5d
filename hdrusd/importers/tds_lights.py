"""Lights of 3D Studio: omni and spot, with a multiplier and ranges.

Hotspot and falloff are whole angles: all light up to the one, none beyond the other.
A light keeps its strength over any distance unless DL_ATTENUATE stands beside its
ranges: then it is whole up to the inner one, none at the outer one, and half midway,
which is what an estimate needs to know.

Source: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions"
(N_DIRECT_LIGHT).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hdrusd.importers.tds_chunks import COLORS, Chunk, Document, preferred
from hdrusd.legacy.scene import RGB, Light, Vec3
from hdrusd.report import Kind

_SPOT, _OFF, _ATTENUATE, _EXCLUDE = 0x4610, 0x4620, 0x4625, 0x4654
_NUMBERS = {
    0x4656: "roll",
    0x4657: "aspect",
    0x4659: "inner_range",
    0x465A: "outer_range",
    0x465B: "multiplier",
}
#: Chunks that are there or not.
_SWITCHES = {
    0x4651: "rectangular cone",
    0x4652: "overshoot (light beyond the cone)",
    0x4653: "projected picture",
}
#: How shadows are made, which is the renderer's own business, and the drawn cone.
_SHADOWS = frozenset({0x4627, 0x4630, 0x4640, 0x4641, 0x4658})
_SILENT = _SHADOWS | {0x4650, 0x4655}

#: Distances between which a range is one, source units.
_NEAREST, _FARTHEST = 1e-6, 1e9
#: A whole angle in degrees that is the whole space.
_ROUND = 360.0


@dataclass(slots=True)
class RawLight:
    """A light as it stands in the file, in the world. Angles in degrees; ``spot``: has a cone."""

    name: str
    chunk: Chunk
    place: Vec3 = (0.0, 0.0, 0.0)
    color: RGB = (1.0, 1.0, 1.0)
    spot: bool = False
    target: Vec3 = (0.0, 0.0, 0.0)
    hotspot: float = 44.0
    falloff: float = 45.0
    off: bool = False
    attenuated: bool = False
    numbers: dict[str, float] = field(default_factory=dict)
    excluded: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    @property
    def roll(self) -> float:
        """About the axis of the cone."""
        return math.fmod(self.numbers.get("roll", 0.0), 360.0)


def read_light(document: Document, chunk: Chunk, name: str) -> RawLight:
    """An N_DIRECT_LIGHT."""
    raw = RawLight(name, chunk)
    raw.place = document.triple(chunk, raw.place, name)
    colors: dict[int, RGB] = {}
    for child in document.children(chunk, min(chunk.begin + 12, chunk.end)):
        tag = child.tag
        if tag in COLORS:
            document.add_color(colors, child, name)
        elif tag == _SPOT:
            _cone(document, raw, child)
        elif tag in _NUMBERS:
            raw.numbers[_NUMBERS[tag]] = document.number(child, math.nan, name)
        elif tag == _EXCLUDE:
            raw.excluded.append(document.text(child)[0])
        elif tag == _OFF:
            raw.off = True
        elif tag == _ATTENUATE:
            raw.attenuated = True
        else:
            document.unread(child, name, _SILENT)
    raw.numbers = {key: value for key, value in raw.numbers.items() if math.isfinite(value)}
    raw.color = preferred(colors) or raw.color
    return raw


def _cone(document: Document, raw: RawLight, chunk: Chunk) -> None:
    values = document.floats(chunk, 5, raw.name)
    if values is None:
        return
    raw.spot = True
    raw.target = (values[0], values[1], values[2])
    raw.hotspot, raw.falloff = values[3], values[4]
    for child in document.children(chunk, chunk.begin + 20):
        if child.tag in _NUMBERS:
            raw.numbers[_NUMBERS[child.tag]] = document.number(child, math.nan, raw.name)
        elif child.tag in _SWITCHES:
            raw.lost.append(_SWITCHES[child.tag])
        else:
            document.unread(child, raw.name, _SILENT)


def light(document: Document, raw: RawLight, unit: float, moved: Mapping[str, Any]) -> Light:
    """The light at its node's origin, looking along -Z.

    ``moved``: colour, hotspot and falloff of the keyframer, where it has them, which go
    before those of the mesh editor. ``unit``: metres a source unit.
    """
    color: RGB = moved.get("color", raw.color)
    multiplier = raw.numbers.get("multiplier", 1.0)
    r, g, b = (multiplier * c for c in color)
    extras: dict[str, Any] = {"color": color, **raw.numbers}
    attenuation, reach = _attenuation(document, raw)
    if raw.excluded:
        extras["excluded"] = tuple(raw.excluded)
        text = f"lights all but {', '.join(raw.excluded[:8])}: no home; lights these too"
        document.note(Kind.DROPPED, "3ds-light-exclude", raw.chunk, raw.name, text)
    if raw.lost:
        text = f"{', '.join(raw.lost)}: no home; a round cone"
        document.note(Kind.DROPPED, "3ds-light-cone", raw.chunk, raw.name, text)
    cutoff, inner = 180.0, None
    if raw.spot:
        hotspot, falloff = moved.get("hotspot", raw.hotspot), moved.get("falloff", raw.falloff)
        extras |= {"hotspot": hotspot, "falloff": falloff}
        cutoff, inner = _angles(document, raw, hotspot, falloff)
    return Light(
        raw.name,
        document.ref(raw.chunk),
        "spot" if raw.spot else "point",
        diffuse=(r, g, b),
        specular=(r, g, b),
        attenuation=attenuation,
        spot_cutoff=cutoff,
        spot_inner=inner,
        range=None if reach is None else reach * unit,
        enabled=not raw.off,
        extras=extras,
    )


def _angles(
    document: Document, raw: RawLight, hotspot: float, falloff: float
) -> tuple[float, float]:
    """Half-angles of the cone and of its full part."""
    outer = min(max(falloff, 0.0), _ROUND)
    inner = min(max(hotspot, 0.0), outer)
    if (inner, outer) != (hotspot, falloff):
        text = f"hotspot {hotspot:g}, falloff {falloff:g} degrees; {inner:g} and {outer:g} are used"
        document.note(Kind.CLAMPED, "3ds-light-angle", raw.chunk, raw.name, text)
    if inner < outer:
        text = "the cone's edge fades by UsdLux softness between hotspot and falloff"
        document.note(Kind.REPLACED, "3ds-light-edge", raw.chunk, raw.name, text)
    return outer / 2.0, inner / 2.0


def _attenuation(
    document: Document, raw: RawLight
) -> tuple[tuple[float, float, float], float | None]:
    """OpenGL's attenuation that is half where the light's is, and the light's outer range."""
    inner, outer = raw.numbers.get("inner_range", 0.0), raw.numbers.get("outer_range", 0.0)
    if not raw.attenuated:
        return (1.0, 0.0, 0.0), None
    half = 0.5 * (max(inner, 0.0) + outer)
    if not (half > _NEAREST and outer < _FARTHEST):
        text = f"attenuated between {inner:g} and {outer:g}; want distances; read as not attenuated"
        document.note(Kind.INVALID, "3ds-light-range", raw.chunk, raw.name, text)
        return (1.0, 0.0, 0.0), None
    text = f"whole up to {inner:g} and none beyond {outer:g} units: read as half at {half:g}"
    document.note(Kind.REPLACED, "3ds-light-range", raw.chunk, raw.name, text)
    return (1.0, 1.0 / half, 0.0), outer
