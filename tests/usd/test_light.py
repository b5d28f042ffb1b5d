"""Lights written and read back; the fallback says the same as the photometry; rows for shader 1."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.photometry.light import PhotometricLight, chromaticity
from hdrusd.report import Report
from hdrusd.scene import NO_CONE
from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.light import (
    light_time_varying,
    read_dome,
    read_light,
    read_light_row,
    write_legacy_falloff,
    write_light,
)
from hdrusd.usd.lux import read_lux

#: One float32 rounding.
ULP = 2.0**-24


def f32(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers that a float attribute holds exactly."""
    return st.floats(low, high, width=32)


COLORS = st.tuples(*[st.floats(1e-3, 10.0)] * 3).map(lambda color: chromaticity(color)[0])
COMMON = {
    "intensity": f32(2.0**-20, 2.0**40),
    "chromaticity": COLORS,
    "sp": st.one_of(st.just(0.0), f32(2.0**-10, 60.0)),
    "provenance": st.sampled_from(["measured", "authored", "estimated"]),
    "rule": st.sampled_from(["", "night-20lx", "photometry.toml:light[1]"]),
    "source": st.sampled_from(["", 'Datenblatt für 7012 lm, "TST-604"\n2nd line']),
}
RADII = f32(2.0**-10, 2.0**6)
POINTS = st.builds(PhotometricLight, st.just("point"), radius=RADII, **COMMON)
SPOTS = st.builds(
    PhotometricLight,
    st.just("spot"),
    cutoff=f32(0.0, 179.0),
    softness=f32(0.0, 1.0),
    exponent=f32(0.0, 128.0),
    radius=RADII,
    **COMMON,
)
PROFILES = st.builds(
    PhotometricLight,
    st.just("point"),
    radius=RADII,
    profile=st.sampled_from(["./street.textures/road_1a2b3c4d.ies", "./x.ldt"]),
    **COMMON,
)
DISTANT = st.builds(PhotometricLight, st.sampled_from(["distant", "ambient"]), **COMMON)
UNITS = st.sampled_from([1.0, 0.01, 0.0254, 1000.0])
SCALES = st.sampled_from([1.0, 0.1, 37.5])


def written(light: PhotometricLight, unit: float, scale: float) -> tuple[Usd.Prim, float]:
    """The light in a stage of ``unit``, below a parent of ``scale``; metres of its own unit."""
    stage = new_stage(unit)
    parent = UsdGeom.Xform.Define(stage, "/Street")
    parent.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(scale))
    return write_light(stage, Sdf.Path("/Street/Lamp"), light, scale=scale * unit), scale * unit


@settings(deadline=None)
@given(st.one_of(POINTS, SPOTS, PROFILES, DISTANT), UNITS, SCALES)
def test_what_is_written_is_read(light: PhotometricLight, unit: float, scale: float) -> None:
    prim, metres = written(light, unit, scale)
    back = read_light(prim, scale=metres)
    names = ("kind", "cutoff", "softness", "exponent", "profile", "sp", "provenance", "rule")
    for name in (*names, "source"):
        assert getattr(back, name) == getattr(light, name), name
    # Only beside a file does the strength pass through nits: six roundings, radius squared.
    assert back.intensity == pytest.approx(light.intensity, rel=6 * ULP if light.profile else 0.0)
    # Three channels rounded once; the luminance that is divided out sees all three.
    assert back.chromaticity == pytest.approx(light.chromaticity, rel=2 * ULP)
    if light.kind in ("point", "spot"):
        assert back.radius == pytest.approx(light.radius, rel=2 * ULP)


@settings(deadline=None)
@given(st.one_of(POINTS, SPOTS, PROFILES, DISTANT), UNITS, SCALES)
def test_plain_usdlux_says_the_same(light: PhotometricLight, unit: float, scale: float) -> None:
    prim, _ = written(light, unit, scale)
    reading = read_lux(prim)
    assert reading is not None
    # Rounded to 32 bits: intensity, colour, radius (squared) or angle (squared): 2^-24 each.
    wanted = np.multiply(light.chromaticity, light.intensity)
    assert reading.intensity == pytest.approx(wanted, rel=4.5 * ULP)
    assert np.dot(LUMINANCE_WEIGHTS, reading.intensity) == pytest.approx(
        light.intensity, rel=4.5 * ULP
    )


def test_the_plain_values_are_those_of_the_decision() -> None:
    # docs/decisions/0007: nits, normalize 0, exposure 0, a real radius.
    prim, _ = written(PhotometricLight("point", 5000.0), 1.0, 1.0)
    light = UsdLux.SphereLight(prim)
    assert light.GetIntensityAttr().Get() == pytest.approx(
        636_619.77, abs=0.04
    )  # float32 steps by 1/16
    assert light.GetNormalizeAttr().Get() is False
    assert light.GetExposureAttr().Get() == 0.0
    assert light.GetRadiusAttr().Get() == pytest.approx(0.05, rel=ULP)
    assert light.GetTreatAsPointAttr().Get() is True
    assert not prim.HasAPI(UsdLux.ShapingAPI)
    sun, _ = written(PhotometricLight("distant", 0.25), 0.01, 1.0)
    nits = 0.25 / (math.pi * math.sin(math.radians(0.265)) ** 2)
    assert UsdLux.DistantLight(sun).GetIntensityAttr().Get() == pytest.approx(nits, rel=1e-6)
    sky, _ = written(PhotometricLight("ambient", math.pi), 0.01, 1.0)
    assert UsdLux.DomeLight(sky).GetIntensityAttr().Get() == pytest.approx(1.0, rel=ULP)


def test_a_file_gives_the_candela_and_usdlux_multiplies_them() -> None:
    # UsdLux, text of ShapingAPI: intensity pi r^2 times the file's candela.
    lamp = PhotometricLight("point", 0.8, radius=0.2, profile="./road.ies")
    prim, metres = written(lamp, 1.0, 1.0)
    assert UsdLux.LightAPI(prim).GetIntensityAttr().Get() == pytest.approx(
        0.8 / (math.pi * 0.04), rel=ULP
    )
    shaping = UsdLux.ShapingAPI(prim)
    assert shaping.GetShapingIesFileAttr().Get().path == "./road.ies"
    assert shaping.GetShapingConeAngleAttr().Get() == 180.0
    assert (
        not prim.HasAttribute("inputs:photometric:luminousIntensity")
        or not prim.GetAttribute("inputs:photometric:luminousIntensity").HasAuthoredValue()
    )
    # A stranger's candela beside a file are no factor on it.
    prim.GetAttribute("inputs:photometric:luminousIntensity").Set(5000.0)
    assert read_light(prim, scale=metres).intensity == pytest.approx(0.8, rel=6 * ULP)


def test_photometry_is_the_truth_where_both_are_there() -> None:
    prim, metres = written(PhotometricLight("point", 5000.0), 1.0, 1.0)
    UsdLux.LightAPI(prim).GetIntensityAttr().Set(1.0)
    assert read_light(prim, scale=metres).intensity == 5000.0


def test_a_stranger_s_light_is_read_by_its_usdlux_inputs() -> None:
    stage = new_stage()
    light = UsdLux.SphereLight.Define(stage, "/Lamp")
    light.CreateRadiusAttr(0.5)
    light.CreateIntensityAttr(100.0)
    light.CreateColorAttr(Gf.Vec3f(1, 0, 0))
    back = read_light(light.GetPrim())
    assert back.intensity == pytest.approx(100.0 * math.pi * 0.25 * 0.2126, rel=1e-7)
    assert back.chromaticity == pytest.approx((1 / 0.2126, 0.0, 0.0), rel=1e-7)
    assert (back.kind, back.provenance) == ("point", "authored")


def test_what_is_no_light_is_refused() -> None:
    stage = new_stage()
    with pytest.raises(ValueError, match="/Box is no light"):
        read_light(UsdGeom.Cube.Define(stage, "/Box").GetPrim())


def test_range_and_attenuation_are_kept() -> None:
    prim, _ = written(PhotometricLight("point", 10.0), 1.0, 1.0)
    spec = prim.GetStage().GetRootLayer().GetPrimAtPath(prim.GetPath())
    write_legacy_falloff(spec, 25.0, (1.0, 0.5, 0.25))
    assert prim.GetAttribute("photometric:legacy:range").Get() == 25.0
    assert prim.GetAttribute("photometric:legacy:attenuation").Get() == Gf.Vec3f(1.0, 0.5, 0.25)
    assert read_light(prim).intensity == 10.0


# -- rows for shader 1 --------------------------------------------------------------------


def row(prim: Usd.Prim, unit: float = 1.0, time: float = 0.0, report: Report | None = None) -> Any:
    code = Usd.TimeCode(time)
    world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code)
    return read_light_row(prim, code, world, unit, Report() if report is None else report)


def test_a_row_is_in_world_metres() -> None:
    prim, _ = written(PhotometricLight("spot", 800.0, cutoff=40.0, softness=0.5), 0.01, 10.0)
    form = UsdGeom.Xformable(prim)
    form.AddTranslateOp().Set(Gf.Vec3d(1.0, 2.0, 3.0))  # times 10 units of 1 cm
    form.AddRotateXOp().Set(90.0)  # -Z to +Y
    got = row(prim, 0.01)
    assert got["position"][0] == pytest.approx([0.1, 0.2, 0.3], rel=1e-12)
    assert got["axis"][0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert got["w"][0] == 1.0
    assert got["intensity"][0] == pytest.approx([800.0] * 3, rel=3 * ULP)
    assert got["radius"][0] == pytest.approx(0.05, rel=2 * ULP)
    assert got["outer"][0] == pytest.approx(math.radians(40.0), rel=ULP)
    assert got["inner"][0] == pytest.approx(math.radians(20.0), rel=2 * ULP)


@pytest.mark.parametrize(("sp", "read"), [(0.6, 0.6), (100.5, 0.0), (0.0, 0.0), (-1.0, 0.0)])
def test_a_row_has_the_stated_ratio_of_rods_to_cones(sp: float, read: float) -> None:
    prim, _ = written(PhotometricLight("point", 800.0), 1.0, 1.0)
    assert row(prim)["sp"][0] == 0.0
    prim.GetAttribute("inputs:photometric:scotopicPhotopicRatio").Set(sp)
    report = Report()
    assert row(prim, report=report)["sp"][0] == pytest.approx(read, rel=ULP)
    assert report.codes() == (set() if read else {"light-scotopic"})


def test_a_mirrored_parent_turns_the_axis() -> None:
    prim, _ = written(PhotometricLight("spot", 1.0, cutoff=40.0), 1.0, 1.0)
    UsdGeom.Xformable(prim).AddScaleOp().Set(Gf.Vec3f(1.0, 1.0, -1.0))
    assert row(prim)["axis"][0] == pytest.approx([0.0, 0.0, 1.0])


def test_a_distant_row_points_to_the_light() -> None:
    prim, _ = written(PhotometricLight("distant", 0.25), 0.01, 5.0)
    UsdGeom.Xformable(prim).AddRotateXOp().Set(-90.0)  # shines along -Y
    got = row(prim, 0.01)
    assert got["w"][0] == 0.0
    assert got["position"][0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert got["intensity"][0] == pytest.approx([0.25] * 3, rel=3 * ULP)
    assert got["outer"][0] == NO_CONE


@pytest.mark.parametrize("kind", [UsdLux.DiskLight, UsdLux.RectLight])
def test_the_shape_of_a_flat_light_has_lamberts_cosine(kind: Any) -> None:
    light = kind.Define(new_stage(), "/Panel")
    report = Report()
    got = row(light.GetPrim(), report=report)
    assert got["exponent"][0] == 0.0
    assert got["outer"][0] == NO_CONE
    assert not report.codes()


def test_a_cone_on_a_flat_light_comes_on_top() -> None:
    stage = new_stage()
    light = UsdLux.DiskLight.Define(stage, "/Panel")
    shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
    shaping.CreateShapingConeAngleAttr(30.0)
    shaping.CreateShapingFocusAttr(2.0)
    assert row(light.GetPrim())["outer"][0] == pytest.approx(math.radians(30.0))
    assert row(light.GetPrim())["exponent"][0] == 2.0


def test_an_unauthored_cone_is_usdlux_s_ninety_degrees() -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    assert row(light.GetPrim())["outer"][0] == NO_CONE
    UsdLux.ShapingAPI.Apply(light.GetPrim())
    assert row(light.GetPrim())["outer"][0] == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("angle", [180.0, 200.0])
def test_a_cone_of_half_a_turn_is_none(angle: float) -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingConeAngleAttr(angle)
    assert row(light.GetPrim())["outer"][0] == NO_CONE


def test_what_the_row_cannot_say_is_a_finding() -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
    shaping.CreateShapingFocusTintAttr(Gf.Vec3f(1, 0, 0))
    report = Report()
    row(light.GetPrim(), report=report)
    assert report.codes() == {"focus-tint"}


def test_domes_have_no_row_but_lux() -> None:
    dome = UsdLux.DomeLight.Define(new_stage(), "/Sky")
    dome.CreateIntensityAttr(2.0)
    dome.CreateColorAttr(Gf.Vec3f(1.0, 0.5, 0.25))
    assert row(dome.GetPrim()) is None
    report = Report()
    got = read_dome(dome.GetPrim(), Usd.TimeCode(0), report)
    assert got == pytest.approx((2 * math.pi, math.pi, math.pi / 2), rel=1e-12)
    assert not report.codes()


def test_animated_intensity_is_read_at_its_time() -> None:
    prim, _ = written(PhotometricLight("point", 1.0), 1.0, 1.0)
    assert not light_time_varying(prim)
    candela = prim.GetAttribute("inputs:photometric:luminousIntensity")
    candela.Set(100.0, 1.0)
    candela.Set(300.0, 3.0)
    assert light_time_varying(prim)
    assert row(prim, time=2.0)["intensity"][0] == pytest.approx([200.0] * 3, rel=3 * ULP)


def test_what_a_light_is_connected_to_may_vary() -> None:
    stage = new_stage()
    owner = stage.DefinePrim("/Rig")
    dimmer = owner.CreateAttribute("inputs:dimmer", Sdf.ValueTypeNames.Float)
    light = UsdLux.SphereLight.Define(stage, "/Lamp")
    light.CreateIntensityAttr(1.0).AddConnection(dimmer.GetPath())
    dimmer.Set(2.0)
    assert not light_time_varying(light.GetPrim())
    dimmer.Set(1.0, 0.0)
    dimmer.Set(3.0, 1.0)
    assert light_time_varying(light.GetPrim())
    assert row(light.GetPrim(), time=1.0)["intensity"] == pytest.approx(
        3.0 * row(light.GetPrim(), time=0.0)["intensity"]
    )
