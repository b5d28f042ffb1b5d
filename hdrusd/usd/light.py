"""Lights: ``write_light`` from photometry, ``read_light`` back, ``read_light_row`` for shader 1.

The photometric attributes are the truth; plain UsdLux values that mean the same
stand beside them for every other renderer: nits, ``normalize`` 0, a real radius
(docs/decisions/0007). A light with a photometric file has no photometric attribute: the
file's candela are the truth, which UsdLux inputs multiply (usd/profile.py).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdLux

from hdrusd.photometry.confidence import confidence
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Kind, Report
from hdrusd.scene import light_rows
from hdrusd.units import LUMINANCE_WEIGHTS, distant_luminance, dome_luminance, sphere_luminance
from hdrusd.usd import specs
from hdrusd.usd.area import shape_row
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.light_controls import SP_RATIO, light_key, read_controls, scotopic_ratio
from hdrusd.usd.lux import LuxReading, connection_end, input_number, photometric_file, read_lux

#: Full angle of a distant light that we write: the sun's and the moon's, degrees.
DISTANT_ANGLE = 0.53

#: How far plain and photometric values may differ before that is said.
AGREEMENT = 1e-3

API = "HdrusdPhotometricLightAPI"
INTENSITY = "inputs:photometric:luminousIntensity"
ILLUMINANCE = "inputs:photometric:illuminance"

_TYPES = Sdf.ValueTypeNames


def write_light(
    stage: Usd.Stage, path: Sdf.Path, light: PhotometricLight, *, scale: float = 1.0
) -> Usd.Prim:
    """Define the UsdLux light and its photometry; it shines along its own -Z.

    ``scale``: metres that one unit of the light's own space measures in the world,
    so that the radius written is the lamp's.
    """
    with Sdf.ChangeBlock():
        write_light_spec(specs.define_on(stage, path, light_type(light)), light, scale=scale)
    return stage.GetPrimAtPath(path)


def light_type(light: PhotometricLight) -> str:
    """The UsdLux type that a light becomes."""
    return {"distant": "DistantLight", "ambient": "DomeLight"}.get(light.kind, "SphereLight")


def write_light_spec(prim: Sdf.PrimSpec, light: PhotometricLight, *, scale: float = 1.0) -> None:
    """What ``write_light`` says, in a prim of the light's type that says nothing yet."""
    if light.kind == "distant":
        _input(prim, "angle", _TYPES.Float, DISTANT_ANGLE)
        nits = distant_luminance(light.intensity, DISTANT_ANGLE)
    elif light.kind == "ambient":
        nits = dome_luminance(light.intensity)
    else:
        _input(prim, "radius", _TYPES.Float, light.radius / scale)
        specs.attribute(prim, "treatAsPoint", _TYPES.Bool, True)
        nits = sphere_luminance(light.intensity, light.radius)
        _write_shaping(prim, light)
    _input(prim, "intensity", _TYPES.Float, nits)
    _input(prim, "color", _TYPES.Color3f, Gf.Vec3f(*light.chromaticity))
    _input(prim, "normalize", _TYPES.Bool, False)
    write_origin(prim, light)
    if not light.profile:
        name = INTENSITY if light.kind in ("point", "spot") else ILLUMINANCE
        specs.attribute(prim, name, _TYPES.Float, light.intensity)
    if light.sp:
        _input(prim, SP_RATIO, _TYPES.Float, light.sp)


def write_origin(prim: Sdf.PrimSpec, light: PhotometricLight) -> None:
    """Apply our schema and say where the light's numbers come from."""
    specs.apply(prim, API)
    _uniform(prim, "photometric:provenance", _TYPES.Token, light.provenance)
    if light.rule:
        _uniform(prim, "photometric:rule", _TYPES.String, light.rule)
    if light.source:
        _uniform(prim, "photometric:source", _TYPES.String, light.source)
    trust = confidence(light.provenance, light.rule, light.source)
    _uniform(prim, "photometric:confidence", _TYPES.Token, trust)


def write_legacy_falloff(
    prim: Sdf.PrimSpec,
    reach: float | None,
    attenuation: tuple[float, float, float] | None,
) -> None:
    """Keep a legacy range (m) and attenuation as metadata; light has neither."""
    if reach is not None:
        _uniform(prim, "photometric:legacy:range", _TYPES.Float, reach)
    if attenuation is not None:
        value = Gf.Vec3f(*attenuation)
        _uniform(prim, "photometric:legacy:attenuation", _TYPES.Float3, value)


def read_light(
    prim: Usd.Prim, time: Usd.TimeCode | None = None, *, scale: float = 1.0
) -> PhotometricLight:
    """Undo ``write_light``: the light as photometry means it. ``time``: None is the default one."""
    time = Usd.TimeCode.Default() if time is None else time
    reading = read_lux(prim, time, world=_scaled(scale), meters_per_unit=1.0)
    if reading is None:
        raise ValueError(f"{prim.GetPath()} is no light")
    strength, color = _photometric(prim, reading, time)
    shaping = UsdLux.ShapingAPI(prim)
    has_cone = prim.HasAPI(UsdLux.ShapingAPI)
    cutoff = float(shaping.GetShapingConeAngleAttr().Get()) if has_cone else 180.0
    exponent = float(shaping.GetShapingFocusAttr().Get()) if has_cone else 0.0
    kinds = {"distant": "distant", "dome": "ambient"}
    kind = kinds.get(reading.kind, "spot" if cutoff < 180.0 or exponent > 0.0 else "point")

    def get(name: str) -> str:
        attribute = prim.GetAttribute(name)
        return str(attribute.Get() or "") if attribute else ""

    return PhotometricLight(
        kind=kind,  # type: ignore[arg-type]
        intensity=strength,
        chromaticity=(float(color[0]), float(color[1]), float(color[2])),
        cutoff=cutoff,
        softness=float(shaping.GetShapingConeSoftnessAttr().Get()) if has_cone else 0.0,
        exponent=exponent,
        radius=reading.radius or 0.05,
        profile=photometric_file(prim),
        sp=scotopic_ratio(prim, time) or 0.0,
        provenance=get("photometric:provenance") or "authored",  # type: ignore[arg-type]
        rule=get("photometric:rule"),
        source=get("photometric:source"),
    )


def light_time_varying(prim: Usd.Prim) -> bool:
    """Whether any input of the light, or what it is connected to, may change between frames."""
    return any(
        attribute.ValueMightBeTimeVarying() or connection_end(attribute).ValueMightBeTimeVarying()
        for attribute in prim.GetAuthoredAttributes()
    )


def read_light_row(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    world: Gf.Matrix4d,
    meters_per_unit: float,
    report: Report,
) -> npt.NDArray[np.void] | None:
    """A (1,) array of ``scene.LIGHT`` in world metres; None for domes and what is no light.

    The shape is that of usd/area.py. Cone and focus of an area light are taken from its
    centre. A texture multiplies what it says (usd/light_texture.py).
    """
    reading = read_lux(prim, time, world=world, meters_per_unit=meters_per_unit)
    if reading is None or reading.kind in ("dome", "other"):
        return None
    strength, color = _photometric(prim, reading, time, report)
    row = light_rows(1)
    row["intensity"] = strength * color
    row["radius"], row["key"] = reading.radius, light_key(prim)
    read_controls(prim, time, row, report)
    stretched = shape_row(prim, row, world, meters_per_unit, time)
    if reading.kind == "distant":
        row["position"], row["w"] = -row["axis"], 0.0
        row["angle"] = math.radians(min(max(input_number(prim, "angle", time), 0.0), 180.0)) / 2.0
        return row
    if stretched:
        prim_finding(report, prim, Kind.REPLACED, "light-shape", stretched)
    row["position"] = np.array(world.ExtractTranslation()) * meters_per_unit
    _read_shaping(prim, time, row, report)
    return row


def read_dome(
    prim: Usd.Prim, time: Usd.TimeCode, report: Report
) -> tuple[float, float, float] | None:
    """Illuminance per channel (lx) of a dome light under open sky; None for any other prim.

    A picture (``usd/dome.py``) multiplies it.
    """
    reading = read_lux(prim, time, world=Gf.Matrix4d(1.0), meters_per_unit=1.0)
    if reading is None or reading.kind != "dome":
        return None
    strength, color = _photometric(prim, reading, time, report)
    _note_unused(prim, time, report)
    r, g, b = (float(strength * c) for c in color)
    return r, g, b


def _photometric(
    prim: Usd.Prim, reading: LuxReading, time: Usd.TimeCode, report: Report | None = None
) -> tuple[float, npt.NDArray[np.float64]]:
    """Strength (cd or lx) and colour of luminance 1: the photometric value, else the plain one.

    That the two differ, because somebody edited one of them, is a finding.
    """
    rgb = np.asarray(reading.intensity, np.float64)
    luminance = float(rgb @ LUMINANCE_WEIGHTS)
    usable = luminance > 0.0 and math.isfinite(luminance)
    color = rgb / luminance if usable else np.ones(3)
    distant = reading.kind in ("distant", "dome")
    name = ILLUMINANCE if distant else INTENSITY
    attribute = prim.GetAttribute(name)
    if not attribute or not attribute.HasAuthoredValue():
        return luminance, color
    if photometric_file(prim) and not distant:  # whose candela the UsdLux inputs multiply
        return luminance, color
    stated = input_number(prim, name.removeprefix("inputs:"), time)
    if report is not None and abs(stated - luminance) > AGREEMENT * max(stated, luminance):
        unit = "lx" if distant else "cd"
        text = (
            f"UsdLux inputs say {luminance:.6g} {unit}, photometry {stated:.6g} {unit}; "
            "the latter is shown"
        )
        prim_finding(report, prim, Kind.ASSUMED, "light-disagreement", text)
    return stated, color


def _note_unused(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> None:
    """What UsdLux says of a dome and shader 1 has no term for."""
    for name in ("diffuse", "specular"):
        if input_number(prim, name, time) != 1.0:
            text = f"inputs:{name} of a dome is not used"
            prim_finding(report, prim, Kind.DROPPED, "light-multiplier", text)
    if scotopic_ratio(prim, time) is not None:
        text = f"inputs:{SP_RATIO} of a dome is not used; its colour tells"
        prim_finding(report, prim, Kind.DROPPED, "light-scotopic", text)
    if any(p.GetName().startswith("collection:") for p in prim.GetAuthoredProperties()):
        prim_finding(report, prim, Kind.DROPPED, "light-linking", "a dome lights everything")


def _write_shaping(prim: Sdf.PrimSpec, light: PhotometricLight) -> None:
    if light.cutoff >= 180.0 and light.exponent == 0.0 and not light.profile:
        return
    specs.apply(prim, "ShapingAPI")
    if light.profile:
        _input(prim, "shaping:ies:file", _TYPES.Asset, Sdf.AssetPath(light.profile))
    _input(prim, "shaping:cone:angle", _TYPES.Float, light.cutoff)
    _input(prim, "shaping:cone:softness", _TYPES.Float, light.softness)
    _input(prim, "shaping:focus", _TYPES.Float, light.exponent)


def _read_shaping(
    prim: Usd.Prim, time: Usd.TimeCode, row: npt.NDArray[np.void], report: Report
) -> None:
    if not prim.HasAPI(UsdLux.ShapingAPI):
        return
    shaping = UsdLux.ShapingAPI(prim)
    angle, softness, focus = (
        input_number(prim, f"shaping:{name}", time)
        for name in ("cone:angle", "cone:softness", "focus")
    )
    if not math.isfinite(angle + softness + focus):
        row["exponent"] = math.nan  # the caller leaves it out, with a finding
        return
    if 0.0 <= angle < 180.0:
        outer = math.radians(angle)
        row["outer"] = np.minimum(row["outer"], outer)
        row["inner"] = np.minimum(row["inner"], outer * (1.0 - min(max(softness, 0.0), 1.0)))
    row["exponent"] += max(focus, 0.0)
    tint = shaping.GetShapingFocusTintAttr().Get(time)
    if tint is not None and any(tint):
        prim_finding(report, prim, Kind.DROPPED, "focus-tint", "focus tint is not shown")


def _scaled(scale: float) -> Gf.Matrix4d:
    return Gf.Matrix4d().SetScale(scale)


def _input(prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    specs.attribute(prim, f"inputs:{name}", kind, value)


def _uniform(prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    specs.attribute(prim, name, kind, value, uniform=True)
