"""Domes with pictures: which way a picture stands, what it is multiplied by, what is not read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.report import Report
from hdrusd.scene import Sky
from hdrusd.usd.ambient import read_ambient

ULP = 2.0**-24

#: Axes of the world.
X, Y, Z = np.eye(3)


def dome(kind: str = "DomeLight", picture: str = "sky.exr", up: str = "Y") -> Any:
    stage = new_stage()
    UsdGeom.SetStageUpAxis(stage, up)
    light = getattr(UsdLux, kind).Define(stage, "/Sky")
    light.CreateIntensityAttr(1.0)
    if picture:
        light.CreateTextureFileAttr(Sdf.AssetPath(picture))
    return light


def read(light: Any, report: Report | None = None, **options: Any) -> tuple[Any, tuple[Sky, ...]]:
    cache = UsdGeom.XformCache(Usd.TimeCode(0))
    stage = light.GetPrim().GetStage()
    report = Report() if report is None else report
    return read_ambient(stage, [light.GetPrim()], cache, report, **options)


def sky(light: Any, report: Report | None = None, **options: Any) -> Sky:
    lux, (found,) = read(light, report, **options)
    assert lux == (0.0, 0.0, 0.0)
    return found


def axes(light: Any) -> Any:
    """World directions of the picture's quarter from the left, top row and middle."""
    return np.reshape(sky(light).rotation, (3, 3))


def test_the_factor_is_the_luminance_of_a_white_picture() -> None:
    light = dome()
    light.CreateExposureAttr(3.0)
    light.CreateColorAttr(Gf.Vec3f(1.0, 0.5, 0.25))
    assert sky(light).factor == pytest.approx((8.0, 4.0, 2.0), rel=1e-12)
    light.CreateEnableColorTemperatureAttr(True)
    light.CreateColorTemperatureAttr(3000.0)
    tint = UsdLux.BlackbodyTemperatureAsRgb(3000.0)
    wanted = [8.0 * tint[0], 4.0 * tint[1], 2.0 * tint[2]]
    assert sky(light).factor == pytest.approx(wanted, rel=1e-6)


def test_photometry_of_a_dome_holds_for_its_picture_too() -> None:
    light = dome()
    prim = light.GetPrim()
    prim.CreateAttribute("inputs:photometric:illuminance", Sdf.ValueTypeNames.Float).Set(math.pi)
    assert sky(light).factor == pytest.approx((1.0, 1.0, 1.0), rel=1e-6)


def test_a_picture_repeats_round_the_horizon_and_ends_at_the_poles() -> None:
    texture = sky(dome()).texture
    assert Path(texture.file).name == "sky.exr"
    assert (texture.decode, texture.wrap_s, texture.wrap_t) == ("auto", "repeat", "clamp")


@pytest.mark.parametrize(
    ("kind", "up", "pole", "wanted"),
    [
        # Schema text: top +Y, longitude 0 (the middle) +Z, longitude pi/2 +X.
        ("DomeLight", "Y", None, (X, Y, Z)),
        ("DomeLight", "Z", None, (X, Y, Z)),
        ("DomeLight_1", "Y", None, (X, Y, Z)),
        ("DomeLight_1", "Y", "scene", (X, Y, Z)),
        # Top +Z, the middle -Y.
        ("DomeLight_1", "Z", None, (X, Z, -Y)),
        ("DomeLight_1", "Z", "scene", (X, Z, -Y)),
        ("DomeLight_1", "Y", "Z", (X, Z, -Y)),
        ("DomeLight_1", "Z", "Y", (X, Y, Z)),
        ("DomeLight_1", "Z", "sideways", (X, Z, -Y)),
    ],
)
def test_the_pole(kind: str, up: str, pole: str | None, wanted: Any) -> None:
    light = dome(kind, up=up)
    if pole:
        light.CreatePoleAxisAttr(pole)
    assert axes(light) == pytest.approx(np.stack(wanted), abs=1e-12)


def test_the_transform_turns_the_dome_and_scale_does_not_count() -> None:
    light = dome()
    light.AddScaleOp().Set(Gf.Vec3f(3.0, 3.0, 3.0))
    light.AddTranslateOp().Set(Gf.Vec3d(5.0, 6.0, 7.0))
    light.AddRotateYOp().Set(90.0)
    # About +Y by a quarter: +Z goes to +X, +X to -Z.
    assert axes(light) == pytest.approx(np.stack([-Z, Y, X]), abs=1e-7)
    parents = dome("DomeLight_1", up="Z")
    parents.AddRotateZOp().Set(90.0)
    assert axes(parents) == pytest.approx(np.stack([Y, Z, X]), abs=1e-7)


def test_a_mirrored_dome_stays_mirrored() -> None:
    light = dome()
    light.AddScaleOp().Set(Gf.Vec3f(-2.0, 1.0, 1.0))
    assert axes(light) == pytest.approx(np.stack([-X, Y, Z]), abs=1e-12)


@pytest.mark.parametrize("scale", [(0.0, 1.0, 1.0), (0.0, 0.0, 0.0), (math.nan, 1.0, 1.0)])
def test_a_dome_flattened_by_its_transform_is_not_turned(scale: tuple[float, ...]) -> None:
    light = dome()
    light.AddScaleOp().Set(Gf.Vec3f(*scale))
    report = Report()
    assert np.reshape(sky(light, report).rotation, (3, 3)) == pytest.approx(np.eye(3))
    assert report.codes() == {"dome-transform"}


def test_a_tiny_dome_is_turned_like_any_other() -> None:
    light = dome()
    light.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(1e-200, 1e-200, 1e-200))
    assert axes(light) == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize("layout", ["mirroredBall", "angular", "cubeMapVerticalCross", "nonsense"])
def test_other_formats_are_uniform_and_a_finding(layout: str) -> None:
    light = dome()
    light.CreateTextureFormatAttr(layout)
    report = Report()
    lux, skies = read(light, report)
    assert lux == pytest.approx((math.pi,) * 3)
    assert skies == ()
    assert report.codes() == {"dome-texture"}


def test_latlong_and_automatic_are_read_without_a_word() -> None:
    for layout in ("latlong", "automatic"):
        light, report = dome(), Report()
        light.CreateTextureFormatAttr(layout)
        assert sky(light, report).factor == pytest.approx((1.0,) * 3)
        assert not report.codes()


def test_a_dome_without_a_picture_is_ambient_light() -> None:
    lux, skies = read(dome(picture=""))
    assert lux == pytest.approx((math.pi,) * 3)
    assert skies == ()


def test_portals_are_a_finding() -> None:
    light, report = dome(), Report()
    light.CreatePortalsRel().AddTarget("/Sky/Window")
    assert sky(light, report).factor == pytest.approx((1.0,) * 3)
    assert report.codes() == {"dome-portals"}


def test_a_hidden_dome_and_a_broken_one_give_nothing() -> None:
    light = dome()
    UsdGeom.Imageable(light.GetPrim()).MakeInvisible()
    assert read(light) == ((0.0, 0.0, 0.0), ())
    broken, report = dome(), Report()
    broken.CreateIntensityAttr(-1.0)
    assert sky(broken, report).factor == (0.0, 0.0, 0.0)
    assert report.codes() == {"light-invalid"}


def test_a_dome_that_a_stated_ambient_light_stands_for_shows_no_picture() -> None:
    light, report = dome(), Report()
    stage = light.GetPrim().GetStage()
    root = UsdGeom.Xform.Define(stage, "/World").GetPrim()
    stage.SetDefaultPrim(root)
    root.ApplyAPI("HdrusdAmbientAPI")
    root.GetAttribute("photometric:ambient:illuminance").Set(10.0)
    root.GetRelationship("photometric:ambient:light").AddTarget("/Sky")
    lux, skies = read(light, report)
    assert (lux, skies) == ((10.0, 10.0, 10.0), ())
    assert report.codes() == {"dome-texture"}


def test_pictures_and_intensities_may_change_in_time() -> None:
    light = dome()
    light.GetTextureFileAttr().Set(Sdf.AssetPath("night.exr"), 0.0)
    light.GetTextureFileAttr().Set(Sdf.AssetPath("day.exr"), 10.0)
    light.GetIntensityAttr().Set(2.0, 0.0)
    found = sky(light)
    assert Path(found.texture.file).name == "night.exr"
    assert found.factor == pytest.approx((2.0,) * 3, rel=4 * ULP)


def test_the_sky_is_seen_where_that_is_asked_for() -> None:
    assert not sky(dome()).visible
    assert sky(dome(), sky_visible=True).visible


def test_shadows_of_a_dome_may_be_switched_off() -> None:
    light = dome()
    assert sky(light).shadow
    UsdLux.ShadowAPI.Apply(light.GetPrim()).CreateShadowEnableAttr(False)
    assert not sky(light).shadow


def test_plain_skies_add_up_and_it_is_said() -> None:
    stage, report = new_stage(), Report()
    domes = [UsdLux.DomeLight.Define(stage, f"/Sky{i}") for i in range(2)]
    for light in domes:
        light.CreateIntensityAttr(1.0)
    cache = UsdGeom.XformCache(Usd.TimeCode(0))
    lux, _ = read_ambient(stage, [light.GetPrim() for light in domes], cache, report)
    assert lux == pytest.approx((2.0 * math.pi,) * 3, rel=1e-6)  # pi L each
    assert report.codes() == {"skies-add"}
    alone = Report()
    read(domes[0], alone)
    assert "skies-add" not in alone.codes()
