"""Mesh lights: points whose light is that of the mesh, against the closed form of a square."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Usd, UsdGeom, UsdLux

from hdrusd.photometry.area import rect_illuminance
from hdrusd.photometry.light import illuminance
from hdrusd.report import Report
from hdrusd.usd.extract import StageReader
from hdrusd.usd.mesh_light import POINTS, mesh_light_rows


def square(path: str = "/Panel", side: float = 2.0, faces: int = 1) -> UsdGeom.Mesh:
    """A square of ``faces`` x ``faces`` that faces -Z, of 100 cd/m2."""
    stage = new_stage()
    mesh = UsdGeom.Mesh.Define(stage, path)
    u = np.linspace(-side / 2, side / 2, faces + 1)
    mesh.CreatePointsAttr([Gf.Vec3f(float(x), float(y), 0) for y in u for x in u])
    n = faces + 1
    corners = [
        (j * n + i, (j + 1) * n + i, (j + 1) * n + i + 1, j * n + i + 1)
        for j in range(faces)
        for i in range(faces)
    ]
    mesh.CreateFaceVertexCountsAttr([4] * len(corners))
    mesh.CreateFaceVertexIndicesAttr([v for face in corners for v in face])
    mesh.CreateSubdivisionSchemeAttr("none")
    UsdLux.MeshLightAPI.Apply(mesh.GetPrim())
    UsdLux.LightAPI(mesh.GetPrim()).CreateIntensityAttr(100.0)
    return mesh


def rows_of(mesh: UsdGeom.Mesh, unit: float = 1.0) -> tuple[Any, tuple[float, float, float]]:
    world = mesh.ComputeLocalToWorldTransform(Usd.TimeCode(0))
    return mesh_light_rows(mesh.GetPrim(), Usd.TimeCode(0), world, unit, Report())


def lux(rows: Any, point: np.ndarray, normal: np.ndarray) -> float:
    to = rows["position"] - point
    d2 = np.sum(to * to, axis=1)
    way = to / np.sqrt(d2)[:, None]
    emitted = np.maximum(-np.sum(way * rows["axis"], axis=1), 0.0)
    received = illuminance(way @ normal, 1 / d2, 1 / rows["radius"] ** 2)
    return float(np.sum(rows["intensity"][:, 0] * emitted * received))


#: Distance in widths, and the largest error of the module's text as a share of the light.
ERRORS = [(0.5, 0.03), (1.0, 0.01), (2.0, 0.005), (10.0, 0.003)]


@pytest.mark.parametrize("faces", [1, 3, 20])
@pytest.mark.parametrize(("distance", "error"), ERRORS)
def test_a_square_against_its_closed_form(distance: float, error: float, faces: int) -> None:
    rows, luminance = rows_of(square(faces=faces))
    assert luminance == (100.0, 100.0, 100.0)
    assert 50 <= len(rows) <= 72
    x, y, axis = np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, -1.0])
    for aside in (0.0, 0.5, 1.0):
        point = np.array([aside, -0.3 * aside, -2.0 * distance])
        for n in (np.array([0, 0, 1.0]), np.array([0.6, 0, 0.8])):
            exact = 400.0 * float(rect_illuminance(-point, n, axis, x, y))
            assert lux(rows, point, n) == pytest.approx(exact, rel=error)


def test_the_strength_is_area_times_luminance_in_metres() -> None:
    mesh = square(side=200.0)
    rows, luminance = rows_of(mesh, 0.01)
    assert rows["intensity"].sum(axis=0) == pytest.approx([400.0] * 3, rel=1e-6)
    assert np.abs(rows["position"]).max() <= 1.0
    UsdLux.LightAPI(mesh.GetPrim()).CreateNormalizeAttr(True)
    rows, luminance = rows_of(mesh, 0.01)
    assert luminance == pytest.approx((100.0 / 40_000.0,) * 3)
    assert rows["intensity"].sum(axis=0) == pytest.approx([0.01] * 3, rel=1e-6)


def test_it_shines_on_its_front_also_when_mirrored_or_left_handed() -> None:
    mesh = square()
    assert rows_of(mesh)[0]["axis"] == pytest.approx(np.tile([0, 0, -1.0], (72, 1)))
    UsdGeom.Xformable(mesh).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))
    assert rows_of(mesh)[0]["axis"] == pytest.approx(np.tile([0, 0, -1.0], (72, 1)))
    mesh.CreateOrientationAttr("leftHanded")
    assert rows_of(mesh)[0]["axis"] == pytest.approx(np.tile([0, 0, 1.0], (72, 1)))


def test_points_have_keys_by_path_and_shine_to_one_side() -> None:
    first, again, other = (rows_of(square(p))[0] for p in ("/Panel", "/Panel", "/Sign"))
    assert np.array_equal(first["key"], again["key"])
    assert not set(first["key"]) & set(other["key"])
    assert len(set(first["key"])) == len(first)
    assert set(first["outer"]) == {math.pi / 2}


@pytest.mark.parametrize("faces", [1, 2, 5, 6, 40])
def test_there_are_not_many_points(faces: int) -> None:
    rows, _ = rows_of(square(faces=faces))
    assert POINTS / 2 <= len(rows) <= 144
    assert rows["intensity"].sum(axis=0) == pytest.approx([400.0] * 3, rel=1e-6)


def test_a_mesh_without_area_gives_no_rows() -> None:
    mesh = square()
    mesh.GetPointsAttr().Set([Gf.Vec3f(0)] * 4)
    assert len(rows_of(mesh)[0]) == 0


def test_a_scene_shows_the_mesh_at_its_luminance() -> None:
    mesh = square()
    stage = mesh.GetPrim().GetStage()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    report = Report()
    reader = StageReader(stage, report)
    scene = reader.read(0.0, reader.camera(None, 0.0, 1.0))
    assert len(scene.lights) == 72
    (draw,) = scene.draws
    assert not draw.casts
    assert scene.materials[draw.material].emission == (100.0, 100.0, 100.0)
    assert not report.codes() & {"light-unknown", "light-invalid"}
    assert reader.read(1.0, scene.camera).lights is not scene.lights


def test_a_hostile_mesh_light_is_left_out() -> None:
    mesh = square()
    stage = mesh.GetPrim().GetStage()
    UsdGeom.Cube.Define(stage, "/Box")
    UsdLux.LightAPI(mesh.GetPrim()).GetIntensityAttr().Set(float("nan"))
    report = Report()
    reader = StageReader(stage, report)
    assert len(reader.read(0.0, reader.camera(None, 0.0, 1.0)).lights) == 0
    assert "light-invalid" in report.codes()
