"""Shapes of UsdLux lights in the world, and what they are told beside their strength."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.report import Report
from hdrusd.scene import CYLINDER, POINT, RECT, SPHERE
from hdrusd.usd.light import read_light_row
from hdrusd.usd.light_controls import light_key

#: One float32 rounding of each length.
ULP = 2.0**-24


def read(prim: Usd.Prim, unit: float = 1.0, report: Report | None = None) -> Any:
    world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode(0))
    got = read_light_row(prim, Usd.TimeCode(0), world, unit, Report() if report is None else report)
    assert got is not None
    return got[0]


def placed(light: Any, *rows: tuple[float, float, float]) -> Usd.Prim:
    """The light under a transform whose first rows are X, Y, Z."""
    matrix = Gf.Matrix4d(*[v for row in rows for v in (*row, 0)], 1, 2, 3, 1)
    UsdGeom.Xformable(light.GetPrim()).AddTransformOp().Set(matrix)
    return light.GetPrim()


def test_a_rectangle_in_centimetres() -> None:
    light = UsdLux.RectLight.Define(new_stage(0.01), "/Panel")
    light.CreateWidthAttr(120.0)
    light.CreateHeightAttr(60.0)
    light.CreateIntensityAttr(4000.0)
    got = read(placed(light, (1, 0, 0), (0, 1, 0), (0, 0, 1)), 0.01)
    assert got["shape"] == RECT
    assert got["position"] == pytest.approx([0.01, 0.02, 0.03])
    assert got["x"] == pytest.approx([0.6, 0, 0], rel=ULP)
    assert got["y"] == pytest.approx([0, 0.3, 0], rel=ULP)
    assert got["axis"] == pytest.approx([0, 0, -1])
    assert got["intensity"] == pytest.approx([4000 * 1.2 * 0.6] * 3, rel=4 * ULP)


@pytest.mark.parametrize(
    ("rows", "axis"),
    [
        # Leaning -Z: the light shines square to its plane.
        (((2, 0, 0), (1, 3, 0), (0.5, 0.5, 1)), (0, 0, -1)),
        # Mirrored along x, along z, and turned half about y: always on the side of -Z.
        (((-1, 0, 0), (0, 1, 0), (0, 0, 1)), (0, 0, -1)),
        (((1, 0, 0), (0, 1, 0), (0, 0, -1)), (0, 0, 1)),
        (((-1, 0, 0), (0, 1, 0), (0, 0, -1)), (0, 0, 1)),
    ],
)
@pytest.mark.parametrize("kind", [UsdLux.RectLight, UsdLux.DiskLight])
def test_flat_lights_under_any_transform(kind: Any, rows: Any, axis: Any) -> None:
    light = kind.Define(new_stage(), "/Panel")
    got = read(placed(light, *rows))
    assert got["axis"] == pytest.approx(axis)
    half = 0.5  # of a width and a radius of 1 and 0.5
    assert got["x"] == pytest.approx(np.multiply(rows[0], half))
    assert got["y"] == pytest.approx(np.multiply(rows[1], half))
    # intensity 1 nit: cd on the axis = area.
    face = np.linalg.norm(np.cross(got["x"], got["y"]))
    area = 4.0 * face if kind is UsdLux.RectLight else math.pi * face
    assert got["intensity"] == pytest.approx([area] * 3, rel=1e-6)


def test_a_sphere_with_and_without_size() -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    light.CreateRadiusAttr(0.25)
    assert (read(light.GetPrim())["shape"], read(light.GetPrim())["radius"]) == (SPHERE, 0.25)
    light.CreateTreatAsPointAttr(True)
    assert read(light.GetPrim())["shape"] == POINT
    light.GetTreatAsPointAttr().Set(False)
    light.GetRadiusAttr().Set(0.0)
    light.CreateNormalizeAttr(True)
    assert read(light.GetPrim())["shape"] == POINT


def test_a_cylinder_lies_along_x() -> None:
    light = UsdLux.CylinderLight.Define(new_stage(), "/Tube")
    light.CreateLengthAttr(3.0)
    light.CreateRadiusAttr(0.2)
    report = Report()
    got = read(placed(light, (0, 2, 0), (-2, 0, 0), (0, 0, 2)), report=report)
    assert got["shape"] == CYLINDER
    assert got["x"] == pytest.approx([0, 3, 0])
    assert got["radius"] == pytest.approx(0.4)
    assert got["intensity"] == pytest.approx([2 * 0.4 * 6.0] * 3)
    light.CreateTreatAsLineAttr(True)
    assert read(light.GetPrim())["shape"] == CYLINDER
    assert not report.codes()


@pytest.mark.parametrize("kind", [UsdLux.SphereLight, UsdLux.CylinderLight])
def test_what_is_stretched_is_told(kind: Any) -> None:
    report = Report()
    light = kind.Define(new_stage(), "/Lamp")
    read(placed(light, (1, 0, 0), (0, 1, 0), (0, 0, 1.5)), report=report)
    assert report.codes() == {"light-shape"}


def test_a_tube_may_be_stretched_along_itself() -> None:
    report = Report()
    light = UsdLux.CylinderLight.Define(new_stage(), "/Tube")
    read(placed(light, (4, 0, 0), (0, 1, 0), (0, 0, 1)), report=report)
    assert not report.codes()


@pytest.mark.parametrize("kind", [UsdLux.RectLight, UsdLux.DiskLight])
def test_a_flat_light_without_area_is_a_point_with_lamberts_cosine(kind: Any) -> None:
    light = kind.Define(new_stage(), "/Panel")
    UsdLux.LightAPI(light.GetPrim()).CreateNormalizeAttr(True)
    (light.GetWidthAttr() if kind is UsdLux.RectLight else light.GetRadiusAttr()).Set(0.0)
    got = read(light.GetPrim())
    assert (got["shape"], got["exponent"], got["outer"]) == (POINT, 1.0, math.pi / 2)
    assert got["intensity"] == pytest.approx([1.0] * 3)


def test_the_frame_of_a_sheared_point_is_square_and_mirrored_where_it_is() -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    light.CreateTreatAsPointAttr(True)
    got = read(placed(light, (-1, 0.2, 0), (0.3, 1, 0), (0, 0.5, 1)))
    frame = np.stack([got["x"], got["y"], -got["axis"]])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(-1.0)


def test_a_distant_light_fills_an_angle() -> None:
    light = UsdLux.DistantLight.Define(new_stage(), "/Sun")
    light.CreateAngleAttr(2.0)
    assert read(light.GetPrim())["angle"] == pytest.approx(math.radians(1.0))


def test_keys_differ_and_stay() -> None:
    stage = new_stage()
    one, two = (UsdLux.SphereLight.Define(stage, f"/{n}").GetPrim() for n in ("One", "Two"))
    assert read(one)["key"] == light_key(one) != light_key(two)
    # blake2b of "/One", 8 bytes, little-endian: the same in every run and on every machine.
    again = UsdLux.SphereLight.Define(new_stage(), "/One").GetPrim()
    assert read(again)["key"] == read(one)["key"]


def test_factors_shadows_and_filters() -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    prim = light.GetPrim()
    got = read(prim)
    assert (got["diffuse"], got["specular"], got["shadow"]) == (1.0, 1.0, 1)
    light.CreateDiffuseAttr(0.5)
    light.CreateSpecularAttr(-1.0)
    shadow = UsdLux.ShadowAPI.Apply(prim)
    assert read(prim)["shadow"] == 1
    shadow.CreateShadowEnableAttr(False)
    shadow.CreateShadowColorAttr(Gf.Vec3f(0.5))
    light.GetFiltersRel().AddTarget(Sdf.Path("/Filter"))
    report = Report()
    got = read(prim, report=report)
    assert (got["diffuse"], got["specular"], got["shadow"]) == (0.5, 0.0, 0)
    assert report.codes() == {"light-multiplier", "shadow-input", "light-filters"}
    kinds = {f.code: str(f.kind) for f in report}
    assert kinds["light-multiplier"] == "clamped"


def test_shadow_inputs_that_change_nothing_are_no_findings() -> None:
    light = UsdLux.SphereLight.Define(new_stage(), "/Lamp")
    shadow = UsdLux.ShadowAPI.Apply(light.GetPrim())
    shadow.CreateShadowColorAttr(Gf.Vec3f(0.0))
    shadow.CreateShadowDistanceAttr(-1.0)
    report = Report()
    read(light.GetPrim(), report=report)
    assert not report.codes()
