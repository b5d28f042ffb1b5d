"""Lamps that are seen: shapes, sides and luminances of the draws made from light rows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import light_row, new_stage, png
from pxr import Gf, Sdf, UsdGeom, UsdLux

from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.scene import CYLINDER, DISK, POINT, RECT, SPHERE, Camera, Draw, Profile, RenderScene
from hdrusd.usd.emitters import Emitters
from hdrusd.usd.extract import StageReader
from hdrusd.usd.light import write_light

RECTANGLE = {"shape": RECT, "x": [0.6, 0, 0], "y": [0, 0.3, 0]}


def seen(rows: Any, profiles: tuple[Profile, ...] = ()) -> tuple[tuple[Draw, ...], Any]:
    emitters = Emitters()
    emitters.show(rows)
    return emitters.draws(5, profiles)


def placed(draw: Draw) -> np.ndarray:
    """World points (t, 3, 3) of the first copy."""
    matrix = draw.transforms[0]
    points = draw.geometry.points.astype(np.float64) @ matrix[:3, :3] + matrix[3, :3]
    return points.reshape(-1, 3, 3)


def faces(draw: Draw) -> np.ndarray:
    """Area vectors of the triangles on the side that is drawn."""
    p = placed(draw)
    turn = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 2
    return turn * np.sign(np.linalg.det(draw.transforms[0][:3, :3]))


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize(("shape", "area"), [(RECT, 4.0), (DISK, math.pi)])
def test_flat_lights_face_their_axis(shape: int, area: float, mirror: float) -> None:
    x, y = np.array([0.6 * mirror, 0, 0]), np.array([0.1, 0.3, 0])
    row = light_row(100.0, shape=shape, x=x, y=y, position=[1, 2, 3], axis=[0, 0, -1])
    (draw,), (material,) = seen(row)
    size = area * 0.18
    assert faces(draw).sum(axis=0) == pytest.approx([0, 0, -size], abs=1e-6)
    assert np.linalg.norm(faces(draw), axis=1).sum() == pytest.approx(size, rel=1e-6)
    assert placed(draw).reshape(-1, 3).mean(axis=0) == pytest.approx([1, 2, 3], abs=1e-6)
    assert material.emission == pytest.approx((100.0 / size,) * 3, rel=2e-6)
    assert (draw.material, draw.casts, draw.double_sided, draw.moving) == (5, False, False, False)
    assert material.diffuse == (0.0, 0.0, 0.0)


def test_a_cylinder_is_seen_without_its_ends() -> None:
    row = light_row(10.0, shape=CYLINDER, x=[0, 2.0, 0], y=[0, 0, 1.0], radius=0.25)
    (draw,), (material,) = seen(row)
    area = faces(draw)
    # A polygon of 64 sides that has the area of the circle: 2e-4 more around.
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(2 * math.pi * 0.25 * 4, rel=1e-3)
    assert np.abs(area[:, 1]).max() < 1e-9
    outward = placed(draw).mean(axis=1)
    assert (outward[:, 0] * area[:, 0] + outward[:, 2] * area[:, 2] > 0).all()
    assert material.emission == pytest.approx((10.0 / (2 * 0.25 * 4),) * 3, rel=2e-6)


def test_a_ball() -> None:
    row = light_row(10.0, shape=SPHERE, radius=0.5, position=[0, 0, 7])
    (draw,), (material,) = seen(row)
    points = placed(draw).reshape(-1, 3) - [0, 0, 7]
    assert np.linalg.norm(points, axis=1) == pytest.approx(0.5, rel=1e-3)
    outward = np.sum(placed(draw).mean(axis=1) * faces(draw), axis=1)
    centred = outward - 7.0 * faces(draw)[:, 2]
    assert (centred >= 0).all()
    assert material.emission == pytest.approx((10.0 / (math.pi * 0.25),) * 3, rel=2e-6)


@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({"shape": POINT, "radius": 0.05}, 0),
        ({"shape": SPHERE, "radius": 0.05}, 1),
        ({"shape": SPHERE, "radius": 0.05, "outer": 0.5}, 0),
        ({"shape": SPHERE, "radius": 0.05, "exponent": 2.0}, 0),
        ({"shape": SPHERE, "radius": 0.05, "w": 0.0}, 0),
        (RECTANGLE | {"outer": 0.5}, 1),
        (RECTANGLE | {"intensity": 0.0}, 0),
        ({"shape": CYLINDER, "radius": 0.0}, 0),
    ],
)
def test_what_is_seen(changes: dict[str, Any], count: int) -> None:
    row = light_row(**({"intensity": 1.0} | changes))
    assert len(seen(row)[0]) == count


def test_with_a_photometric_file_it_has_the_luminance_of_its_axis() -> None:
    candela = np.array([[300.0, 100.0], [500.0, 100.0]], np.float32)
    profile = Profile(candela, (0.0, 6.0), (0.0, 1.5))
    _, (material,) = seen(light_row(2.0, profile=0, **RECTANGLE), (profile,))
    assert material.emission == pytest.approx((2 * 400.0 / 0.72,) * 3, rel=2e-6)


def test_copies_of_one_lamp_are_one_draw() -> None:
    rows = np.concatenate(
        [light_row(1.0, shape=SPHERE, radius=0.1, position=[i, 0, 0]) for i in range(9)]
    )
    rows["intensity"] *= 1.0 + 2e-8 * np.arange(9)[:, None]
    (draw,), (_,) = seen(rows)
    assert draw.transforms[:, 3, 0].tolist() == list(range(9))


def test_what_does_not_move_is_the_same_object() -> None:
    emitters = Emitters()
    found = []
    for _ in range(2):
        emitters.clear()
        emitters.show(light_row(1.0, **RECTANGLE))
        found.append(emitters.draws(0, ())[0][0])
    assert found[0] is found[1]


# -- in stages ----------------------------------------------------------------------------


def scene_of(stage: Any, report: Report | None = None) -> RenderScene:
    reader = StageReader(stage, Report() if report is None else report)
    return reader.read(0.0, reader.camera(None, 0.0, 1.0))


def test_a_picture_is_seen_upright_from_the_lit_side(tmp_path: Path) -> None:
    stage = new_stage()
    light = UsdLux.RectLight.Define(stage, "/Sign")
    light.CreateIntensityAttr(50.0)
    light.CreateTextureFileAttr(Sdf.AssetPath(str(png(tmp_path / "a.png"))))
    scene = scene_of(stage)
    assert len(scene.lights) == 4
    (draw,) = scene.draws
    material = scene.materials[draw.material]
    assert material.emission_map is not None
    assert material.emission_map.scale == (50.0, 50.0, 50.0, 1.0)
    assert material.emission_map.uv_set == "st"
    # Top left as seen from -Z: u = 0, t = 1 at +X +Y.
    corner = np.flatnonzero((placed(draw).reshape(-1, 3)[:, :2] > 0).all(axis=1))[0]
    assert draw.geometry.uvs["st"][corner].tolist() == [0.0, 1.0]


def test_converted_lamps_are_not_drawn_twice() -> None:
    """Their lenses are in the geometry; the balls that carry their candela are points."""
    stage = new_stage()
    UsdGeom.Cube.Define(stage, "/Lens")
    write_light(stage, Sdf.Path("/Lamp"), PhotometricLight("point", 5000.0))
    scene = scene_of(stage)
    assert scene.lights["shape"].tolist() == [POINT]
    assert len(scene.draws) == 1


def test_lamps_in_instancers_are_seen_where_they_are() -> None:
    stage = new_stage()
    instancer = UsdGeom.PointInstancer.Define(stage, "/Row")
    lamp = UsdLux.SphereLight.Define(stage, "/Row/Lamp")
    lamp.CreateRadiusAttr(0.1)
    instancer.CreatePrototypesRel().SetTargets([lamp.GetPath()])
    instancer.CreateProtoIndicesAttr([0, 0])
    instancer.CreatePositionsAttr([Gf.Vec3f(0), Gf.Vec3f(5, 0, 0)])
    scene = scene_of(stage)
    (draw,) = scene.draws
    assert draw.transforms[:, 3, 0].tolist() == [0.0, 5.0]
    assert not draw.moving


def test_a_lamp_that_changes_is_moving() -> None:
    stage = new_stage()
    lamp = UsdLux.DiskLight.Define(stage, "/Lamp")
    lamp.CreateIntensityAttr().Set(1.0, 0.0)
    lamp.GetIntensityAttr().Set(3.0, 2.0)
    (draw,) = scene_of(stage).draws
    assert draw.moving


def test_a_static_stage_keeps_its_draws_and_materials() -> None:
    stage = new_stage()
    for number in range(3):
        light = UsdLux.RectLight.Define(stage, f"/Panel{number}")
        light.CreateIntensityAttr(1.0 + number)
    mesh = UsdGeom.Mesh.Define(stage, "/Glow")
    mesh.CreatePointsAttr([Gf.Vec3f(*p) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0))])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    UsdLux.MeshLightAPI.Apply(mesh.GetPrim())
    reader = StageReader(stage, Report())
    first, *others = [reader.read(float(time), Camera()) for time in range(4)]
    assert len(first.draws) == 4
    for scene in others:
        assert list(map(id, scene.draws)) == list(map(id, first.draws))
        assert list(map(id, scene.materials)) == list(map(id, first.materials))


def test_a_ball_with_a_beam_is_a_finding_unless_it_is_called_a_point() -> None:
    stage, report = new_stage(), Report()
    UsdGeom.Cube.Define(stage, "/Box")
    lamp = UsdLux.SphereLight.Define(stage, "/Lamp")
    lamp.CreateIntensityAttr(5.0)
    UsdLux.ShapingAPI.Apply(lamp.GetPrim()).CreateShapingConeAngleAttr(40.0)
    reader = StageReader(stage, report)
    for time in range(2):
        assert len(reader.read(float(time), Camera()).draws) == 1
    assert [f.code for f in report if f.thing == "/Lamp"] == ["light-not-seen"]
    lamp.CreateTreatAsPointAttr(True)
    report = Report()
    StageReader(stage, report).read(0.0, Camera())
    assert "light-not-seen" not in report.codes()
