"""UsdLux lights of a source stage: ``read_source_light``, and ``write_light_over`` over them.

A source's light keeps its type, its size, its place and what it is linked to. What is written
over it says the strength twice, as ``write_light`` does: in candela or lux, and in nits with
``normalize`` 0, ``exposure`` 0 and a colour of luminance 1. Where inputs vary in time, so do
the numbers over them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.photometry.light import RGB, PhotometricLight, chromaticity
from hdrusd.usd.light import API, ILLUMINANCE, INTENSITY
from hdrusd.usd.light_bounds import STRONGEST
from hdrusd.usd.light_controls import SP_RATIO
from hdrusd.usd.lux import (
    LuxKind,
    input_number,
    input_source,
    is_light,
    light_kind,
    normalized,
    photometric_file,
    read_lux,
    strength_per_nit,
)
from hdrusd.usd.overs import Overs

#: Inputs that the strength of a light depends on.
_STRENGTH = ("intensity", "exposure", "color", "enableColorTemperature", "colorTemperature")
_SIZES = ("normalize", "radius", "width", "height", "length", "angle")

#: Copies of a light whose candela differ by more than this, relative, have no number in common.
_ALIKE = 1e-6

#: Moments of a light that is read between its time samples, at most.
_MOST_MOMENTS = 10_000

_TYPES = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class Moment:
    """A light at a time: cd on the axis or lux, colour of luminance 1, cd or lx a nit."""

    strength: float
    color: RGB
    per_nit: float


@dataclass(frozen=True, slots=True)
class SourceLight:
    """A light of a source stage as UsdLux 25.05 reads it.

    ``moments``: by time code, of each time sample; by None where nothing varies. ``radius``: m.
    ``alike``: whether all its copies have the same candela. ``resampled``: whether there are
    moments between the time samples, as its strength or its hue is on no straight line there.
    """

    prim: Usd.Prim
    kind: LuxKind
    moments: Mapping[float | None, Moment]
    radius: float
    alike: bool
    resampled: bool = False

    @property
    def brightest(self) -> Moment:
        """The moment of the largest strength: a lamp that blinks, when it is on."""
        return max(self.moments.values(), key=lambda moment: moment.strength)

    @property
    def sound(self) -> bool:
        """Whether all strengths are finite, not negative and not beyond what is computed with."""
        return all(0.0 <= m.strength <= STRONGEST for m in self.moments.values())


#: What ``shaping`` gives of a light that shines all round.
NO_SHAPING = (180.0, 0.0, 0.0)


def shaping(prim: Usd.Prim) -> tuple[float, float, float]:
    """Half-angle of the cone (degrees), its softness and the focus, as shader 1 reads them."""
    if not prim.HasAPI(UsdLux.ShapingAPI):
        return NO_SHAPING
    code = Usd.TimeCode.EarliestTime()
    found = (input_number(prim, f"shaping:{n}", code) for n in ("cone:angle", "cone:softness"))
    angle, softness = found
    focus = input_number(prim, "shaping:focus", code)
    if not math.isfinite(angle + softness + focus):
        return NO_SHAPING
    if not 0.0 <= angle < 180.0:
        angle, softness = NO_SHAPING[:2]
    return angle, min(max(softness, 0.0), 1.0), max(focus, 0.0)


def light_places(stage: Usd.Stage) -> dict[Sdf.Path, list[Usd.Prim]]:
    """Every light of a stage by its path, or that in its prototype, with where it stands."""
    places: dict[Sdf.Path, list[Usd.Prim]] = {}
    everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), everything):
        if is_light(prim):
            own = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
            places.setdefault(own.GetPath(), []).append(prim)
    return places


def copies(prim: Usd.Prim) -> int:
    """How often the point instancers above a light show it; 1 where there are none."""
    count, above = 1, prim.GetParent()
    while above and not above.IsPseudoRoot():
        if above.IsA(UsdGeom.PointInstancer):
            instancer = UsdGeom.PointInstancer(above)
            targets = instancer.GetPrototypesRel().GetForwardedTargets()
            mine = [i for i, path in enumerate(targets) if prim.GetPath().HasPrefix(path)]
            indices = instancer.GetProtoIndicesAttr().Get(Usd.TimeCode.EarliestTime())
            count *= int(np.isin(np.asarray(indices or []), mine).sum())
        above = above.GetParent()
    return count


def is_photometric(prim: Usd.Prim) -> bool:
    """Whether a light has our schema already, and says where its number comes from."""
    stated = prim.GetAttribute("photometric:provenance")
    return bool(prim.HasAPI(API)) and bool(stated) and bool(stated.HasAuthoredValue())


def read_source_light(prim: Usd.Prim, places: Iterable[Usd.Prim]) -> SourceLight | None:
    """A light that stands at ``places``; None for one that has no closed form (kind "other")."""
    kind = light_kind(prim)
    if kind == "other":
        return None
    worlds = [
        UsdGeom.Xformable(p).ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime())
        for p in places
    ]
    times, resampled = _times(prim)
    unit = UsdGeom.GetStageMetersPerUnit(prim.GetStage())
    moments: dict[float | None, Moment] = {}
    radius = 0.0
    codes: list[float | None] = [*times] if times else [None]
    for time in codes:
        code = Usd.TimeCode.Default() if time is None else Usd.TimeCode(time)
        reading = read_lux(prim, code, world=worlds[0], meters_per_unit=unit)
        assert reading is not None
        color, strength = chromaticity(reading.intensity)
        if not all(0.0 <= c < math.inf for c in reading.intensity):
            strength = math.nan
        per_nit, radius = strength_per_nit(prim, code, False, worlds[0], unit)
        moments[time] = Moment(strength, color, per_nit)
    code = Usd.TimeCode.EarliestTime()
    normalize = normalized(prim, code)
    factors = [strength_per_nit(prim, code, normalize, world, unit)[0] for world in worlds]
    alike = max(factors) - min(factors) <= _ALIKE * max(factors) and not _in_instancer(prim)
    return SourceLight(prim, kind, moments, radius, alike, resampled)


def _times(prim: Usd.Prim) -> tuple[list[float], bool]:
    """The times that a light is read at, and whether some are between its time samples.

    Numbers over the source's are joined by straight lines. The source is on these where its
    intensity alone varies; else it is read at every time code, too.
    """
    named = ((name, input_source(prim, name)) for name in (*_STRENGTH, *_SIZES))
    samples = {name: source.GetTimeSamples() for name, source in named if source}
    times = sorted({time for found in samples.values() for time in found})
    curved = any(len(found) > 1 for name, found in samples.items() if name != "intensity")
    held = prim.GetStage().GetInterpolationType() == Usd.InterpolationTypeHeld
    if held or not curved:
        return times, False
    low, high = math.ceil(times[0]), math.floor(times[-1])
    count = min(high - low + 1, _MOST_MOMENTS)
    between = np.linspace(low, high, count).tolist() if count > 0 else []
    every = sorted({*times, *between})
    return every, len(every) > len(times)


def write_light_over(
    overs: Overs, source: SourceLight, light: PhotometricLight, *, radius: float | None = None
) -> None:
    """The light as photometry means it, over the source's.

    ``light.intensity`` is that of the source's brightest moment; the others keep their ratio
    to it. ``radius``: of the lamp (m), where a photometry rule states it and the light has one.
    """
    prim, top = source.prim, source.brightest
    recolored = light.chromaticity != top.color
    bigger = 1.0 if radius is None else _resize(overs, source, radius)
    nits, strengths, colors = {}, {}, {}
    keeps = False  # a size of 0, which has a strength only by normalize
    for time, moment in source.moments.items():
        share = moment.strength / top.strength if top.strength > 0.0 else 1.0
        per_nit = moment.per_nit * bigger
        if per_nit <= 0.0:
            keeps = True
            code = Usd.TimeCode.Default() if time is None else Usd.TimeCode(time)
            world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code)
            per_nit = strength_per_nit(prim, code, True, world)[0]
        strengths[time] = light.intensity * share
        nits[time] = strengths[time] / per_nit if per_nit > 0.0 else 0.0
        colors[time] = Gf.Vec3f(*(light.chromaticity if recolored else moment.color))
    _set(overs, prim, "inputs:intensity", _TYPES.Float, nits)
    _set(overs, prim, "inputs:color", _TYPES.Color3f, colors)
    _neutral(overs, prim, "exposure", _TYPES.Float, 0.0)
    _neutral(overs, prim, "enableColorTemperature", _TYPES.Bool, False)
    if not keeps:
        _neutral(overs, prim, "normalize", _TYPES.Bool, False)
    overs.apply(prim, API)
    if not light.profile and source.alike and not pictured(prim):
        local = source.kind not in ("distant", "dome")
        _set(overs, prim, INTENSITY if local else ILLUMINANCE, _TYPES.Float, strengths)
    if light.sp:
        overs.value(prim, f"inputs:{SP_RATIO}", _TYPES.Float, light.sp)
    if light.profile and light.profile != photometric_file(prim):
        _write_profile(overs, prim, light.profile)
    elif source.kind == "sphere" and not light.profile:
        _write_shaping(overs, prim, light)
    overs.value(prim, "photometric:provenance", _TYPES.Token, light.provenance, uniform=True)
    for name, text in (("rule", light.rule), ("source", light.source)):
        if text:
            overs.value(prim, f"photometric:{name}", _TYPES.String, text, uniform=True)


def pictured(prim: Usd.Prim) -> bool:
    """Whether it is a dome with a picture, whose lux are the picture's business."""
    texture = input_source(prim, "texture:file") if light_kind(prim) == "dome" else None
    return texture is not None and bool(texture) and bool(texture.HasAuthoredValue())


def _resize(overs: Overs, source: SourceLight, radius: float) -> float:
    """Give the lamp a radius (m); by how much its candela a nit grow."""
    own = input_number(source.prim, "radius", Usd.TimeCode.EarliestTime())
    if not (source.radius > 0.0 and own > 0.0):
        return 1.0
    ratio = radius / source.radius
    overs.value(source.prim, "inputs:radius", _TYPES.Float, own * ratio)
    return ratio if source.kind == "cylinder" else ratio * ratio


def _write_profile(overs: Overs, prim: Usd.Prim, profile: str) -> None:
    """A photometric file in the place of cone and focus."""
    overs.apply(prim, "ShapingAPI")
    overs.value(prim, "inputs:shaping:ies:file", _TYPES.Asset, Sdf.AssetPath(profile))
    overs.value(prim, "inputs:shaping:ies:normalize", _TYPES.Bool, False)
    overs.value(prim, "inputs:shaping:cone:angle", _TYPES.Float, 180.0)
    overs.value(prim, "inputs:shaping:focus", _TYPES.Float, 0.0)


def _write_shaping(overs: Overs, prim: Usd.Prim, light: PhotometricLight) -> None:
    """A cone and a focus that a photometry rule gives a ball; its own stay."""
    asked = light.cutoff, light.softness, light.exponent
    if all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(asked, shaping(prim), strict=True)):
        return
    overs.apply(prim, "ShapingAPI")
    for name, value in zip(("cone:angle", "cone:softness", "focus"), asked, strict=True):
        overs.value(prim, f"inputs:shaping:{name}", _TYPES.Float, value)


def _set(
    overs: Overs,
    prim: Usd.Prim,
    name: str,
    kind: Sdf.ValueTypeName,
    values: Mapping[float | None, object],
) -> None:
    if None in values:
        overs.value(prim, name, kind, values[None])
    else:
        overs.samples(prim, name, kind, {t: v for t, v in values.items() if t is not None})


def _neutral(
    overs: Overs, prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, value: object
) -> None:
    """Put an input out of action, where the source has it in action."""
    stated = input_source(prim, name)
    if stated and (stated.Get() not in (None, value) or stated.GetTimeSamples()):
        overs.value(prim, f"inputs:{name}", kind, value)


def _in_instancer(prim: Usd.Prim) -> bool:
    """Whether a point instancer may copy the light at any size."""
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdGeom.PointInstancer):
            return True
        prim = prim.GetParent()
    return False
