"""Strings of lamps: written as one instancer, read back as rows at their places."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import lamp, new_stage
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.legacy.scene import Light
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.scene import SPHERE
from hdrusd.usd.instanced_lights import instanced_rows
from hdrusd.usd.instancer import Instancers
from hdrusd.usd.light_string import write_light_string
from hdrusd.usd.lux import is_light

PLACES = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 20.0, 5.0]])
BALL = PhotometricLight("point", 80.0, radius=0.25)
BEAM = PhotometricLight("spot", 80.0, cutoff=20.0, radius=0.25)
#: One float32 rounding.
ULP = 2.0**-24


def string(**changes: Any) -> Light:
    """A lamp at three places."""
    return lamp(**{"positions": PLACES} | changes)


def written(
    source: Light, light: PhotometricLight, matrix: Gf.Matrix4d, unit: float = 1.0, **options: Any
) -> tuple[Usd.Stage, np.ndarray]:
    """The stage, and the rows that shader 1 gets."""
    stage = new_stage()
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    node = UsdGeom.Xform.Define(stage, "/node")
    node.AddTransformOp().Set(matrix)
    path = Sdf.Path("/node/string")
    prim = write_light_string(stage, path, source, light, matrix, unit, **options)
    report = Report()
    instancers = Instancers(stage, {"default", "render"}, report)
    instancers.add(prim)
    (copies,) = (c for c in instancers.copies(Usd.TimeCode(0)) if is_light(c.source))
    rows = instanced_rows(copies, Usd.TimeCode(0), unit, report)
    assert not report.codes()
    return stage, rows


MOVED = Gf.Matrix4d().SetRotate(Gf.Rotation((1, 2, 3), 40.0)) * Gf.Matrix4d().SetTranslate(
    (100.0, 200.0, 300.0)
)
MATRICES = {
    "rigid": MOVED,
    "scaled": Gf.Matrix4d().SetScale(3.0) * MOVED,
    "stretched": Gf.Matrix4d().SetScale((2.0, 1.0, 0.5)) * MOVED,
    "mirrored": Gf.Matrix4d().SetScale((-1.0, 1.0, 1.0)) * MOVED,
    "flat": Gf.Matrix4d().SetScale((1.0, 1.0, 0.0)) * MOVED,
}


@pytest.mark.parametrize("unit", [1.0, 0.01])
@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES)
def test_lamps_stand_where_their_node_has_them(matrix: Gf.Matrix4d, unit: float) -> None:
    """They keep their size and their candela whatever their node does to space."""
    _, rows = written(string(), BALL, matrix, unit)
    wanted = [np.array(matrix.Transform(Gf.Vec3d(*place))) * unit for place in PLACES.tolist()]
    np.testing.assert_allclose(rows["position"], wanted, atol=400.0 * unit * ULP)
    np.testing.assert_allclose(rows["intensity"], 80.0, rtol=4 * ULP)
    np.testing.assert_allclose(rows["radius"], 0.25, rtol=8 * ULP)
    assert (rows["shape"] == SPHERE).all()  # it is seen
    assert (rows["shadow"] == 0).all()
    assert len(set(rows["key"].tolist())) == 3


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES)
def test_beams_go_each_its_way(matrix: Gf.Matrix4d) -> None:
    ways = np.array([[0.0, 0.6, 0.8], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    stage, rows = written(string(kind="spot", directions=ways), BEAM, matrix)
    linear = np.array(matrix)[:3, :3]
    wanted = ways @ linear
    length = np.linalg.norm(wanted, axis=1, keepdims=True)
    there = length[:, 0] > 0.0  # squeezed away in the flat space
    np.testing.assert_allclose(
        rows["axis"][there], (wanted / np.maximum(length, 1e-300))[there], atol=16 * ULP
    )
    np.testing.assert_allclose(rows["outer"], math.radians(20.0), rtol=4 * ULP)
    one = string(kind="spot", direction=(0.0, 0.6, 0.8))
    _, alike = written(one, BEAM, matrix)
    np.testing.assert_allclose(alike["axis"], np.tile(rows["axis"][0], (3, 1)), atol=16 * ULP)
    assert stage.GetPrimAtPath("/node/string").GetTypeName() == "PointInstancer"


def test_the_glass_of_a_beam_has_the_area_and_the_luminance_of_the_lamp() -> None:
    """A polygon of 16 sides in front, facing the way that the light goes."""
    stage, _ = written(string(kind="spot"), BEAM, Gf.Matrix4d(1.0))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/node/string/Lamp/Glass"))
    points = np.array(mesh.GetPointsAttr().Get(), np.float64)
    order = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    corners = points[order]
    area = 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    np.testing.assert_allclose(area, [0.0, 0.0, -math.pi * 0.25**2], rtol=1e-6, atol=1e-9)
    glow = stage.GetPrimAtPath("/node/string/Lamp/Glass/Glow")
    assert glow.GetAttribute("photometric:luminance").Get() == pytest.approx(
        80.0 / (math.pi * 0.25**2), rel=ULP
    )


def test_c0_turns_a_profile_about_its_axis() -> None:
    """+X is the part of C = 0 that is square to the beam."""
    ways = np.array([[0.0, 0.6, 0.8], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    file = PhotometricLight("point", 1.0, profile="./lamp.ies", radius=0.25)
    right = (1.0, 1.0, 0.0)
    stage, _ = written_profile(string(directions=ways), file, right)
    turns = UsdGeom.PointInstancer(stage.GetPrimAtPath("/node/string")).GetOrientationsfAttr()
    for turn, way in zip(turns.Get(), ways, strict=True):
        rotation = Gf.Rotation(Gf.Quatd(turn))
        side = np.array(right) - way * np.dot(right, way)
        np.testing.assert_allclose(rotation.TransformDir(Gf.Vec3d(0, 0, -1)), way, atol=1e-6)
        np.testing.assert_allclose(
            rotation.TransformDir(Gf.Vec3d(1, 0, 0)), side / np.linalg.norm(side), atol=1e-6
        )


def written_profile(
    source: Light, light: PhotometricLight, right: tuple[float, float, float]
) -> tuple[Usd.Stage, Usd.Prim]:
    """A string with a photometric file, which is not there to be read."""
    stage = new_stage()
    UsdGeom.Xform.Define(stage, "/node")
    path = Sdf.Path("/node/string")
    return stage, write_light_string(stage, path, source, light, Gf.Matrix4d(1.0), 1.0, right)


def test_far_away_places_keep_their_distances() -> None:
    """A database in metres from the pole: float32 alone would round to half a metre."""
    far = PLACES + np.array([5_000_000.25, 0.0, 0.125])
    _, rows = written(string(positions=far), BALL, Gf.Matrix4d(1.0))
    np.testing.assert_allclose(rows["position"], far, atol=1e-5)


def test_ten_thousand_lamps_are_four_prims_at_most() -> None:
    places = np.random.default_rng(1).uniform(-1000.0, 1000.0, (10_000, 3))
    stage, rows = written(string(positions=places), BALL, Gf.Matrix4d(1.0))
    below = list(Usd.PrimRange(stage.GetPrimAtPath("/node/string")))
    assert [prim.GetName() for prim in below] == ["string", "Lamp"]
    assert len(rows) == 10_000
    assert not UsdLux.SphereLight(below[1]).GetTreatAsPointAttr().Get()
