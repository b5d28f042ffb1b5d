"""USD validators for photometry.

USD knows the validators from ``schemas/validation/plugInfo.json`` and imports this
module when one of them is first asked for; in usdview and ``usdchecker`` too, with
the plug-in on ``PXR_PLUGINPATH_NAME``. An exception that leaves a check ends the whole
validation in OpenUSD 26.11, so none does: a check that breaks down says so as an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import wraps
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade, UsdValidation

from hdrusd.colour import luminance
from hdrusd.errors import SchemaRegistrationError
from hdrusd.schemas import register
from hdrusd.usd import lux

register()

#: How far two statements of one quantity may differ, relative to the larger.
AGREEMENT = 1e-3


@dataclass(frozen=True, slots=True)
class _Fault:
    """What a check yields; ``name`` is USD's name of the error."""

    name: str
    text: str
    warning: bool = False


@dataclass(frozen=True, slots=True)
class _Range:
    """What numbers are allowed, ends included."""

    least: float
    most: float
    want: str


_FINITE = _Range(-math.inf, math.inf, "a finite number")
_NOT_NEGATIVE = _Range(0.0, math.inf, "0 or more")
_POSITIVE = _Range(math.ulp(0.0), math.inf, "above 0")
#: A reflectance of 1 may have been through float32 a few times.
_REFLECTANCE = _Range(0.0, 1.0 + 1e-6, "0 to 1")


_Check = Callable[[Any, UsdValidation.ValidationTimeRange], Iterator[_Fault]]


def _task(check: _Check) -> Callable[..., list[UsdValidation.ValidationError]]:
    """The function that USD calls, from a generator of faults of a prim or a stage."""

    @wraps(check)
    def run(
        subject: Any, span: UsdValidation.ValidationTimeRange
    ) -> list[UsdValidation.ValidationError]:
        faults: list[_Fault] = []
        try:
            faults.extend(check(subject, span))
        except Exception as problem:  # see the module's text
            faults.append(_Fault("CheckFailed", f"the check broke down: {problem!r}"))
        prim = subject.GetPseudoRoot() if isinstance(subject, Usd.Stage) else subject
        site = UsdValidation.ValidationErrorSite(prim.GetStage(), prim.GetPath())
        kind = UsdValidation.ValidationErrorType
        return [
            UsdValidation.ValidationError(
                fault.name, kind.Warn if fault.warning else kind.Error, [site], fault.text
            )
            for fault in faults
        ]

    return run


@_task
def check_stage_units(stage: Usd.Stage, span: Any) -> Iterator[_Fault]:
    """The metersPerUnit of the stage is authored, finite and above 0; the upAxis is authored."""
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        yield _Fault("MissingMetersPerUnit", "no metersPerUnit; want it authored, best 1")
    else:
        unit = UsdGeom.GetStageMetersPerUnit(stage)
        if not (math.isfinite(unit) and unit > 0.0):
            yield _Fault("BadMetersPerUnit", f"metersPerUnit {unit:g}; want finite and above 0")
    if not stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis):
        yield _Fault("MissingUpAxis", 'no upAxis; want "Y" or "Z"')


_LIGHT_NUMBERS = {
    "intensity": _NOT_NEGATIVE,
    "exposure": _FINITE,
    "color": _NOT_NEGATIVE,
    "colorTemperature": _NOT_NEGATIVE,
    **dict.fromkeys(("radius", "width", "height", "length", "angle"), _NOT_NEGATIVE),
    "photometric:scotopicPhotopicRatio": _POSITIVE,
    "photometric:luminousIntensity": _NOT_NEGATIVE,
    "photometric:illuminance": _NOT_NEGATIVE,
}
_AREA_KINDS = frozenset({"sphere", "disk", "rect", "cylinder"})


@_task
def check_light(prim: Usd.Prim, span: UsdValidation.ValidationTimeRange) -> Iterator[_Fault]:
    """A light's numbers are sound, and say the same in UsdLux and in photometric units."""
    told = {attribute.GetName() for attribute in prim.GetAuthoredAttributes()}
    sources = {n: lux.input_source(prim, n) for n in _LIGHT_NUMBERS if f"inputs:{n}" in told}
    broken: list[_Fault] = []
    for name, source in sources.items():
        broken += _bad_numbers(source, f"inputs:{name}", span, _LIGHT_NUMBERS[name])
    yield from broken
    kind = lux.light_kind(prim)
    world = None
    if kind in _AREA_KINDS:
        world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime())
        yield from _ambiguous_size(prim, kind, world)
    wrong = "illuminance" if kind in _AREA_KINDS else "luminousIntensity"
    if kind != "other" and _authored(prim, f"inputs:photometric:{wrong}"):
        right = "luminousIntensity (cd)" if kind in _AREA_KINDS else "illuminance (lx)"
        text = f"inputs:photometric:{wrong} has no meaning on a {kind} light; want {right}"
        yield _Fault("WrongQuantity", text)
    if kind in _AREA_KINDS and lux.photometric_file(prim):
        if _authored(prim, "inputs:photometric:luminousIntensity"):
            text = "luminousIntensity beside a photometric file, whose candela count; want one"
            yield _Fault("CandelaAndFile", text, warning=True)
    elif not broken and kind != "other":
        yield from _disagreement(prim, world, _times(sources.values(), span))


def _ambiguous_size(prim: Usd.Prim, kind: str, world: Gf.Matrix4d) -> Iterator[_Fault]:
    """Where renderers may read the size of a light in different ways."""
    unit = UsdGeom.GetStageMetersPerUnit(prim.GetStage())
    normalize = lux.input_source(prim, "normalize").Get(Usd.TimeCode.EarliestTime())
    if normalize is True and unit != 1.0:
        yield _Fault(
            "NormalizedArea",
            f"inputs:normalize = 1 with metersPerUnit {unit:g}: renderers differ on whether the "
            "area counts in scene units or in m2; want normalize = 0 or metersPerUnit 1",
            warning=True,
        )
    if kind not in {"sphere", "cylinder"}:
        return
    linear = np.array(world, np.float64)[:3, :3]
    scales = np.linalg.svd(linear, compute_uv=False) if np.isfinite(linear).all() else np.ones(3)
    if scales[0] - scales[-1] > AGREEMENT * scales[0]:
        yield _Fault(
            "NonUniformScale",
            f"a {kind} light under a non-uniform scale has no single radius; want one scale",
            warning=True,
        )


def _disagreement(
    prim: Usd.Prim, earliest_world: Gf.Matrix4d | None, times: list[Usd.TimeCode]
) -> Iterator[_Fault]:
    """The plain UsdLux reading against the photometric value, once, at the first such time."""
    name, unit = ("illuminance", "lx") if earliest_world is None else ("luminousIntensity", "cd")
    if not _authored(prim, f"inputs:photometric:{name}"):
        return
    source = lux.input_source(prim, f"photometric:{name}")
    for time in times:
        world = earliest_world if time.IsEarliestTime() else None
        said, reading = source.Get(time), lux.read_lux(prim, time, world=world)
        if said is None or reading is None:
            continue
        plain = luminance(reading.intensity)
        if not math.isclose(plain, said, rel_tol=AGREEMENT):
            yield _Fault(
                "Disagreement",
                f"inputs:photometric:{name} {said:.6g} {unit}, but the UsdLux inputs say "
                f"{plain:.6g} {unit}{_when(time)}; want both within 0.1 %",
            )
            return


_MATERIAL_NUMBERS = {
    "photometric:diffuse": _REFLECTANCE,
    "photometric:gamma": _POSITIVE,
    "legacy:shininess": _NOT_NEGATIVE,
}


@_task
def check_material(prim: Usd.Prim, span: UsdValidation.ValidationTimeRange) -> Iterator[_Fault]:
    """Reflectances are physical, and emission says the same in both places."""
    for name, allowed in _MATERIAL_NUMBERS.items():
        yield from _bad_numbers(prim.GetAttribute(name), name, span, allowed)
    luminance = prim.GetAttribute("photometric:luminance")
    faults = list(_bad_numbers(luminance, "photometric:luminance", span, _NOT_NEGATIVE))
    surface = _preview_surface(prim)
    if surface is not None:
        for name in ("diffuseColor", "specularColor"):
            source = lux.input_source(surface, name)
            yield from _bad_numbers(source, f"inputs:{name}", span, _REFLECTANCE)
        emissive = lux.input_source(surface, "emissiveColor")
        faults += _bad_numbers(emissive, "inputs:emissiveColor", span, _NOT_NEGATIVE)
        texture = _emissive_texture(surface)
        if texture is not None:
            scale = lux.input_source(texture, "scale")
            faults += _bad_numbers(scale, f"{texture.GetName()}.inputs:scale", span, _NOT_NEGATIVE)
        if not faults and luminance and luminance.HasAuthoredValue():
            yield from _emission_disagreement(surface, texture, luminance, span)
    yield from faults


def _preview_surface(prim: Usd.Prim) -> Usd.Prim | None:
    output = UsdShade.Material(prim).GetSurfaceOutput()
    if not output:
        return None
    shader = UsdShade.Shader(lux.connection_end(output.GetAttr()).GetPrim())
    if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
        return None
    return shader.GetPrim()


def _emissive_node(surface: Usd.Prim) -> Usd.Prim | None:
    """The node whose output is the emission, None where the surface states the colour."""
    own = surface.GetAttribute("inputs:emissiveColor")
    end = lux.connection_end(own) if own else None
    return end.GetPrim() if end and UsdShade.Output.IsOutput(end) else None


def _emissive_texture(surface: Usd.Prim) -> Usd.Prim | None:
    """The UsdUVTexture of the emission, where there is one."""
    node = _emissive_node(surface)
    found = node is not None and UsdShade.Shader(node).GetIdAttr().Get() == "UsdUVTexture"
    return node if found else None


def _emission_disagreement(
    surface: Usd.Prim,
    texture: Usd.Prim | None,
    stated: Usd.Attribute,
    span: UsdValidation.ValidationTimeRange,
) -> Iterator[_Fault]:
    """Luminance against emissiveColor, or against the scale of its texture.

    photometric:luminance is that of the texture's value 1, so no pixel need be read.
    """
    if texture is None:
        if _emissive_node(surface) is not None:
            return  # another node; nothing here says what its 1 is
        name, emissive = "emissiveColor", lux.input_source(surface, "emissiveColor")
        unauthored = (0.0, 0.0, 0.0)  # UsdPreviewSurface's default
    else:
        bias = lux.input_source(texture, "bias")
        if bias and bias.Get(Usd.TimeCode.EarliestTime()) not in (None, Gf.Vec4f(0.0)):
            return  # 1 is not what stands for the luminance
        name, emissive = f"{texture.GetName()}.inputs:scale", lux.input_source(texture, "scale")
        unauthored = (1.0, 1.0, 1.0)  # UsdUVTexture's default
    for time in _times([emissive, stated], span):
        said = stated.Get(time)
        color = emissive.Get(time) if emissive else unauthored
        if said is None or color is None:
            continue
        plain = luminance(color[:3])  # a scale has alpha too
        if not math.isclose(plain, said, rel_tol=AGREEMENT):
            yield _Fault(
                "Disagreement",
                f"photometric:luminance {said:.6g} cd/m2, but {name} has {plain:.6g} cd/m2"
                f"{_when(time)}; want both within 0.1 %",
            )
            return


@_task
def check_ambient(prim: Usd.Prim, span: UsdValidation.ValidationTimeRange) -> Iterator[_Fault]:
    """The ambient term is sound, and its dome light says the same."""
    stated = prim.GetAttribute("photometric:ambient:illuminance")
    tint = prim.GetAttribute("photometric:ambient:color")
    faults = [
        fault
        for source in (stated, tint)
        for fault in _bad_numbers(source, source.GetName(), span, _NOT_NEGATIVE)
    ]
    yield from faults
    targets = prim.GetRelationship("photometric:ambient:light").GetTargets()
    if faults or not targets:
        return
    dome = prim.GetStage().GetPrimAtPath(targets[0])
    if len(targets) > 1 or not lux.is_light(dome) or lux.light_kind(dome) != "dome":
        found = ", ".join(str(path) for path in targets)
        yield _Fault("NoDome", f"photometric:ambient:light is {found}; want one dome light")
        return
    if _authored(dome, "inputs:texture:file"):
        yield _Fault(
            "TexturedDome",
            f"{dome.GetPath()} has a texture, which ambient light has not; want a plain dome",
            warning=True,
        )
        return
    names = ("intensity", "exposure", "color", "enableColorTemperature", "colorTemperature")
    for time in _times([stated, tint, *(lux.input_source(dome, name) for name in names)], span):
        fault = _ambient_disagreement(stated.Get(time), tint.Get(time), dome, time)
        if fault is not None:
            yield fault
            return


def _ambient_disagreement(
    stated: float | None, tint: Gf.Vec3f | None, dome: Usd.Prim, time: Usd.TimeCode
) -> _Fault | None:
    """Channel by channel, relative to the illuminance."""
    color = (1.0, 1.0, 1.0) if tint is None else tuple(tint)
    if not math.isclose(luminance(color), 1.0, rel_tol=AGREEMENT):
        text = f"photometric:ambient:color has a luminance of {luminance(color):.6g}; want 1"
        return _Fault("ColorLuminance", text)
    reading = lux.read_lux(dome, time)
    if reading is None:
        return None
    said = np.multiply(stated or 0.0, color)
    difference = np.abs(said - reading.intensity).max()
    if difference <= AGREEMENT * max(luminance(said), luminance(reading.intensity)):
        return None
    return _Fault(
        "Disagreement",
        f"ambient light of {_channels(said)} lx, but {dome.GetPath()} gives "
        f"{_channels(reading.intensity)} lx{_when(time)}; want both within 0.1 %",
    )


def _bad_numbers(
    source: Usd.Attribute, name: str, span: UsdValidation.ValidationTimeRange, allowed: _Range
) -> Iterator[_Fault]:
    """The first value of an attribute, if any, that is not finite and within ``allowed``."""
    if not source or not source.HasAuthoredValue():
        return
    for time in [Usd.TimeCode.Default(), *_samples([source], span)]:
        value = source.Get(time)
        if value is None:
            continue
        if not isinstance(value, (int, float, Gf.Vec3f, Gf.Vec3d, Gf.Vec3h, Gf.Vec4f)):
            yield _Fault("NoNumber", f"{name} {value!r}; want {allowed.want}")
            return
        numbers = (value,) if isinstance(value, (int, float)) else tuple(value)
        finite = all(map(math.isfinite, numbers))
        if not finite or min(numbers) < allowed.least or max(numbers) > allowed.most:
            problem = f"{name} {_channels(numbers)}{_when(time)}; want {allowed.want}"
            yield _Fault("OutOfRange" if finite else "NotFinite", problem)
            return


def _samples(
    sources: Iterable[Usd.Attribute], span: UsdValidation.ValidationTimeRange
) -> list[Usd.TimeCode]:
    """The times in the span at which any of the attributes has a sample."""
    interval = span.GetInterval()
    found = (a.GetTimeSamplesInInterval(interval) for a in sources if a)
    return [Usd.TimeCode(time) for time in sorted({time for times in found for time in times})]


def _times(
    sources: Iterable[Usd.Attribute], span: UsdValidation.ValidationTimeRange
) -> list[Usd.TimeCode]:
    """Where to compare: at every sample in the span, or once where nothing varies."""
    return _samples(sources, span) or [Usd.TimeCode.EarliestTime()]


def _authored(prim: Usd.Prim, name: str) -> bool:
    attribute = prim.GetAttribute(name)
    return bool(attribute) and bool(lux.connection_end(attribute).HasAuthoredValue())


def _channels(numbers: Any) -> str:
    return ", ".join(f"{number:.6g}" for number in np.ravel(numbers))


def _when(time: Usd.TimeCode) -> str:
    """Nothing for the default and the earliest time, which stand for no sample."""
    sample = time.IsNumeric() and not time.IsEarliestTime()
    return f" at time {time.GetValue():g}" if sample else ""


def _register_checks() -> None:
    """SchemaRegistrationError when USD listed its validators before it knew the plug-in."""
    registry = UsdValidation.ValidationRegistry()
    if not registry.GetValidatorMetadataForKeyword("hdrusd"):
        raise SchemaRegistrationError(
            "USD validators: hdrusd.validation: unknown, because USD was asked for validators "
            "before hdrusd registered its own; import hdrusd.usd first"
        )
    registry.RegisterPluginStageValidator("hdrusd.validation:StageUnits", check_stage_units)
    registry.RegisterPluginPrimValidator("hdrusd.validation:LightIntensity", check_light)
    registry.RegisterPluginPrimValidator("hdrusd.validation:MaterialReflectance", check_material)
    registry.RegisterPluginPrimValidator("hdrusd.validation:AmbientLight", check_ambient)


_register_checks()
