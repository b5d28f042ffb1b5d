"""Light sources of an OpenFlight file (101, 102): OpenGL lights with a place.

A spot looks along +Y, turned by its pitch about X and then by its yaw about Z; so does
the light of an infinite source travel. The candela are the business of the estimate
rules, as the format has no unit.

Source: OpenFlight Specification 16.5, "Light Source Record", "Light Source Palette
Record"; the direction as OpenSceneGraph 3.6 reads it (src/osgPlugins/OpenFlight).
"""

from __future__ import annotations

import math
from typing import Literal

from hdrusd.importers.flt_palettes import PaletteLight, Palettes
from hdrusd.importers.flt_records import Document
from hdrusd.legacy.scene import Light, Vec3
from hdrusd.report import Kind

_ENABLED, _GLOBAL = 0x80000000, 0x40000000
_INFINITE, _SPOT = 0, 2
_NO_SPOT = 180.0


def read_light(document: Document, palettes: Palettes, record: int, name: str) -> Light | None:
    """The light of a light source record; None, with a finding, where the palette has none."""
    (index,) = document.integers(record, 16, "i")
    (flags,) = document.integers(record, 24, "I")
    entry = palettes.lights.get(index)
    if entry is None:
        text = f"light source {index} is not in the palette; left out"
        document.add(Kind.MISSING, "flt-light", record, name, text)
        return None
    position = document.numbers(record, 32, "3d", (0.0, 0.0, 0.0), name)
    yaw, pitch = document.numbers(record, 56, "2f", (0.0, 0.0), name)
    if flags & _ENABLED and not flags & _GLOBAL:
        text = "lights only what is below its parent in the source; all of the scene here"
        document.add(Kind.ASSUMED, "flt-light-scope", record, name, text)
    kind = _kind(entry)
    cutoff = _NO_SPOT
    if kind == "spot":
        cutoff = entry.cutoff
        if not 0.0 <= cutoff <= 90.0 and cutoff != _NO_SPOT:
            text = f"spot cutoff {cutoff:g}; want 0 to 90, or 180; read as 180"
            document.add(Kind.CLAMPED, "flt-light-cutoff", record, name, text)
            cutoff = _NO_SPOT
    exponent = max(entry.exponent, 0.0) if kind == "spot" else 0.0
    return Light(
        name,
        document.ref(record),
        "point" if kind == "spot" and cutoff == _NO_SPOT and exponent == 0.0 else kind,
        (0.0, 0.0, 0.0) if kind == "directional" else (position[0], position[1], position[2]),
        direction(yaw, pitch),
        entry.ambient,
        entry.diffuse,
        entry.specular,
        None if kind == "directional" else entry.attenuation,
        spot_cutoff=cutoff,
        spot_exponent=exponent,
        enabled=bool(flags & _ENABLED),
        extras={"palette": entry.name},
    )


def _kind(entry: PaletteLight) -> Literal["point", "spot", "directional", "ambient"]:
    if any(entry.ambient) and not any(entry.diffuse) and not any(entry.specular):
        return "ambient"
    if entry.type == _INFINITE:
        return "directional"
    return "spot" if entry.type == _SPOT else "point"


def direction(yaw: float, pitch: float) -> Vec3:
    """+Y turned by ``pitch`` degrees about X, then by ``yaw`` about Z."""
    # Exact where a file says 90 or 180: a lamp that looks down has no share of Y.
    turn, tilt = (math.radians(math.remainder(angle, 360.0)) for angle in (yaw, pitch))
    level = math.cos(tilt) if abs(math.remainder(pitch, 180.0)) != 90.0 else 0.0
    return 0.0 - math.sin(turn) * level, math.cos(turn) * level, math.sin(tilt)
