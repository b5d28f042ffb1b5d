"""What a plain UsdLux light says, in candela or lux: the one place that reads it.

The formulas are those of the UsdLux schema text of OpenUSD 26.11: ``inputs:intensity``
is a luminance in nits, times 2^exposure, colour and colour temperature, and
``inputs:normalize`` divides by the world-space surface area. With u metres a unit
and world-space lengths in scene units:

    light             normalize = 0                 normalize = 1
    sphere            I = L pi (r u)^2              I = L u^2 / 4
    disk, on axis     I = L pi (r u)^2              I = L u^2
    rect, on axis     I = L w h u^2                 I = L u^2
    cylinder          I = L 2 r l u^2               I = L u^2 / pi
    distant           E = L pi sin^2(a/2)           E = L
    distant, a = 0    E = L                         E = L
    dome              E = pi L                      E = pi L

A cylinder's row is for the directions square to it, its sides alone emit. Whether
a normalised area counts in scene units, as read here, or in square metres is open
(OpenUSD pull request 3587); with metersPerUnit = 1 both are the same.

``treatAsPoint`` and ``treatAsLine`` do not change the number. The multipliers
``inputs:diffuse`` and ``inputs:specular`` are read by usd/light_controls.py; light filters and
colour spaces other than linear Rec. 709 are not read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from hdrusd import units

RGB = tuple[float, float, float]
LuxKind = Literal["sphere", "disk", "rect", "cylinder", "distant", "dome", "other"]

_KINDS: tuple[tuple[Any, LuxKind], ...] = (
    (UsdLux.SphereLight, "sphere"),
    (UsdLux.DiskLight, "disk"),
    (UsdLux.RectLight, "rect"),
    (UsdLux.CylinderLight, "cylinder"),
    (UsdLux.DistantLight, "distant"),
    (UsdLux.DomeLight, "dome"),
    (UsdLux.DomeLight_1, "dome"),
)
_MAX_CONNECTIONS = 32


@dataclass(frozen=True, slots=True)
class LuxReading:
    """Strength of a light before cone, focus, photometric file and texture.

    ``intensity``, per linear Rec. 709 channel: candela along the local -Z axis for
    lights with a place, lux for "distant" (on a facing plane) and "dome"
    (unobstructed). A photometric file multiplies it, and so does a dome's texture.
    Lights of kind "other" (mesh, geometry, volume, portal, plug-in) have no closed
    form: their intensity is 0. ``radius``: m in the world, 0 for lights without one.

    Broken inputs are passed on: the numbers can be negative, infinite or NaN.
    """

    intensity: RGB
    kind: LuxKind
    radius: float


def is_light(prim: Usd.Prim) -> bool:
    """True for every prim with UsdLux LightAPI, built in or applied."""
    return bool(prim) and bool(prim.HasAPI(UsdLux.LightAPI))


def light_kind(prim: Usd.Prim) -> LuxKind:
    """The family of a light; types derived from a UsdLux type count as that."""
    return next((kind for schema, kind in _KINDS if prim.IsA(schema)), "other")


def connection_end(attribute: Usd.Attribute) -> Usd.Attribute:
    """Where a chain of connections ends: an input with a value, or a shader's output.

    The attribute itself when it is not connected, or when the chain ends nowhere, in
    a circle or after more than 32 steps. UsdShade's own search recurses, and a long
    enough chain in a file overflows its stack.
    """
    end = attribute
    for _ in range(_MAX_CONNECTIONS):
        targets = end.GetConnections()
        if not targets:
            return end
        # Several sources are for arrays of lights and shaders; the first one is the value.
        end = attribute.GetStage().GetAttributeAtPath(targets[0])
        if not end:
            break
    return attribute


def input_source(prim: Usd.Prim, name: str) -> Usd.Attribute:
    """The attribute that gives ``inputs:name`` its value: its own, or the input it is connected to.

    A connection that ends at a shader's output has no value to read without running the
    shader, so the light's own attribute stands. Invalid when there is no such input.
    """
    own = prim.GetAttribute(f"inputs:{name}")
    if not own:
        return own
    end = connection_end(own)
    if end is own:
        return own
    return end if UsdShade.Input.IsInput(end) and end.HasValue() else own


def photometric_file(prim: Usd.Prim) -> str:
    """The photometric file of a light, as the stage names it; empty where it has none.

    Its candela are the light's, and what ``read_lux`` gives is a factor on them.
    """
    source = input_source(prim, "shaping:ies:file") if prim.HasAPI(UsdLux.ShapingAPI) else None
    asset = source.Get() if source else None
    return str(asset.path) if isinstance(asset, Sdf.AssetPath) else ""


def read_lux(
    prim: Usd.Prim,
    time: Usd.TimeCode = Usd.TimeCode.Default(),  # noqa: B008 (an immutable value)
    *,
    world: Gf.Matrix4d | None = None,
    meters_per_unit: float | None = None,
) -> LuxReading | None:
    """Candela or lux of a light at a time, from its UsdLux inputs alone; None if it is no light.

    ``world``: local to world, scene units, row vectors; ``meters_per_unit``: of the stage. Both
    are asked of the stage when not given. Under a non-uniform scale a sphere takes the radius
    of the sphere of equal volume, a cylinder that of equal cross-section.
    """
    if not is_light(prim):
        return None
    kind = light_kind(prim)
    normalize = normalized(prim, time)
    if kind == "other":
        return LuxReading((0.0, 0.0, 0.0), kind, 0.0)
    factor, radius = strength_per_nit(prim, time, normalize, world, meters_per_unit)
    red, green, blue = (channel * factor for channel in nits(prim, time))
    return LuxReading((red, green, blue), kind, radius)


def strength_per_nit(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    normalize: bool,
    world: Gf.Matrix4d | None = None,
    meters_per_unit: float | None = None,
) -> tuple[float, float]:
    """Candela on the axis (m2), or lux, that 1 nit makes of a light, and its radius (m).

    The first column, or with ``normalize`` the second, of the table above; (0, 0) for lights
    of kind "other". ``world``, ``meters_per_unit``: as for ``read_lux``.
    """
    kind = light_kind(prim)
    if kind == "other":
        return 0.0, 0.0
    if kind == "dome":
        return units.dome_illuminance(1.0), 0.0
    if kind == "distant":
        return _distant_factor(input_number(prim, "angle", time), normalize), 0.0
    if world is None:
        world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time)
    if meters_per_unit is None:
        meters_per_unit = UsdGeom.GetStageMetersPerUnit(prim.GetStage())
    return _area_factor(prim, kind, time, normalize, world, meters_per_unit)


def normalized(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    """``inputs:normalize``: whether the strength is divided by the area."""
    return _value(prim, "normalize", time) is True


def nits(prim: Usd.Prim, time: Usd.TimeCode) -> RGB:
    """Nits per channel before ``normalize``: intensity 2^exposure colour temperature."""
    exposure = input_number(prim, "exposure", time)
    # math.exp2 raises from here on.
    gain = math.exp2(exposure) if exposure < 1024.0 else math.inf
    scalar = input_number(prim, "intensity", time) * gain
    red, green, blue = (scalar * channel for channel in _color(prim, time))
    if _value(prim, "enableColorTemperature", time) is not True:
        return red, green, blue
    kelvin = input_number(prim, "colorTemperature", time)
    if math.isnan(kelvin):  # BlackbodyTemperatureAsRgb(nan) is a segmentation fault in 26.11
        return math.nan, math.nan, math.nan
    tint = UsdLux.BlackbodyTemperatureAsRgb(kelvin)
    return red * tint[0], green * tint[1], blue * tint[2]


def _distant_factor(angle: float, normalize: bool) -> float:
    """Lux on a facing plane per nit, ``angle`` in degrees across the disc."""
    angle = min(max(angle, 0.0), 360.0)
    if not normalize:
        # Beyond 180 degrees the rest of the disc is behind the plane.
        return units.distant_illuminance(1.0, min(angle, 180.0))
    if angle <= 180.0:
        return 1.0
    # sizeFactor is (2 - sin^2(a/2)) pi there, of which the plane sees pi.
    return 1.0 / (2.0 - math.sin(math.radians(angle) / 2.0) ** 2)


def _area_factor(
    prim: Usd.Prim,
    kind: LuxKind,
    time: Usd.TimeCode,
    normalize: bool,
    world: Gf.Matrix4d,
    meters_per_unit: float,
) -> tuple[float, float]:
    """Candela on the axis per nit (m2), and the world radius (m)."""
    x, y, z = (Gf.Vec3d(world.GetRow3(row)) for row in range(3))
    square_unit = meters_per_unit * meters_per_unit
    face = Gf.Cross(x, y).GetLength()
    if kind == "rect":
        area = (
            input_number(prim, "width", time)
            * input_number(prim, "height", time)
            * face
            * square_unit
        )
        return (square_unit if normalize else area), 0.0
    radius = input_number(prim, "radius", time) * meters_per_unit
    if kind == "sphere":
        radius *= math.cbrt(abs(Gf.Dot(Gf.Cross(x, y), z)))
        candela = square_unit / 4.0 if normalize else units.sphere_intensity(1.0, radius)
    elif kind == "disk":
        radius *= math.sqrt(face)
        candela = square_unit if normalize else math.pi * radius * radius
    else:
        radius *= math.sqrt(Gf.Cross(y, z).GetLength())
        length = input_number(prim, "length", time) * x.GetLength() * meters_per_unit
        candela = square_unit / math.pi if normalize else 2.0 * radius * length
    return candela, radius


def _value(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Any:
    source = input_source(prim, name)
    return source.Get(time) if source else None


def input_number(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> float:
    """A scalar input; NaN where the file wrote something that is no number."""
    value = _value(prim, name, time)
    return float(value) if isinstance(value, (int, float)) else math.nan


def _color(prim: Usd.Prim, time: Usd.TimeCode) -> RGB:
    """``inputs:color``; NaN where the file wrote something that is no colour."""
    value = _value(prim, "color", time)
    if not isinstance(value, (Gf.Vec3f, Gf.Vec3d, Gf.Vec3h)):
        return math.nan, math.nan, math.nan
    return float(value[0]), float(value[1]), float(value[2])
