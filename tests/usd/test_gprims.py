"""What rests is the same object in every frame; what moves is marked and read again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Usd, UsdGeom

from hdrusd.report import Report
from hdrusd.scene import Camera, RenderScene
from hdrusd.usd.extract import StageReader


def two_frames(stage: Usd.Stage, camera: Camera | None = None) -> tuple[RenderScene, RenderScene]:
    reader = StageReader(stage, Report())
    first, second = (reader.read(t, camera or Camera()) for t in (0.0, 1.0))
    return first, second


def box(stage: Usd.Stage, path: str = "/Box") -> UsdGeom.Cube:
    return UsdGeom.Cube.Define(stage, path)


def drive(prim: Any) -> None:
    """Along x from 0 to 1."""
    op = UsdGeom.Xformable(prim).AddTranslateOp()
    op.Set(Gf.Vec3d(0, 0, 0), 0.0)
    op.Set(Gf.Vec3d(1, 0, 0), 1.0)


def blink(prim: Any) -> None:
    visibility = UsdGeom.Imageable(prim).CreateVisibilityAttr()
    visibility.Set("inherited", 0.0)
    visibility.Set("invisible", 1.0)


def test_a_scene_at_rest_is_the_same_object_at_every_time() -> None:
    stage = new_stage()
    box(stage)
    first, second = two_frames(stage)
    assert second.draws is first.draws
    assert [draw.moving for draw in first.draws] == [False]


def test_at_rest_under_a_framing_camera_too() -> None:
    stage = new_stage()
    box(stage).CreateDoubleSidedAttr(False)
    first, second = two_frames(stage, Camera(framing=True))
    assert second.draws is first.draws
    assert first.draws[0].double_sided


def test_only_what_drives_is_new() -> None:
    stage = new_stage()
    box(stage, "/House")
    drive(UsdGeom.Xform.Define(stage, "/Car"))
    box(stage, "/Car/Body")
    first, second = two_frames(stage)
    rest, car = first.draws
    assert [draw.moving for draw in first.draws] == [False, True]
    assert second.draws[0] is rest
    assert second.draws[1] is not car
    assert second.draws[1].geometry is car.geometry
    assert second.draws[1].transforms[0, 3, :3].tolist() == [1.0, 0.0, 0.0]


def test_what_changes_its_shape_gets_a_new_version() -> None:
    stage = new_stage()
    size = box(stage).CreateSizeAttr()
    size.Set(2.0, 0.0)
    size.Set(4.0, 1.0)
    reader = StageReader(stage, Report())
    first, second, again = (reader.read(t, Camera()).draws[0] for t in (0.0, 1.0, 1.0))
    assert first.moving
    assert first.geometry.version != second.geometry.version
    assert np.abs(second.geometry.points).max() == 2.0
    assert again.geometry is second.geometry  # the same time again: nothing to do


def test_blinking_counts_as_moving() -> None:
    """Its shadow comes and goes, so nothing may be kept of it."""
    stage = new_stage()
    blink(box(stage, "/Sign"))
    box(stage, "/House")
    first, second = two_frames(stage)
    assert sorted(draw.moving for draw in first.draws) == [False, True]
    assert [draw.moving for draw in second.draws] == [False]


def test_two_places_of_one_shape_are_one_draw_and_a_moving_one_another() -> None:
    stage = new_stage()
    stage.CreateClassPrim("/Proto")
    box(stage, "/Proto/Box")
    for name in ("A", "B", "C"):
        prim = stage.DefinePrim(f"/{name}", "Xform")
        prim.GetReferences().AddInternalReference("/Proto")
        prim.SetInstanceable(True)
    drive(stage.GetPrimAtPath("/C"))
    first, second = two_frames(stage)
    assert [(len(d.transforms), d.moving) for d in first.draws] == [(2, False), (1, True)]
    assert first.draws[0].geometry is first.draws[1].geometry
    assert second.draws[0] is first.draws[0]


@pytest.mark.parametrize("what", ["positions", "place", "visibility", "inside", "shape", "nothing"])
def test_copies_move_where_anything_of_them_does(what: str) -> None:
    stage = new_stage()
    made = UsdGeom.PointInstancer.Define(stage, "/I")
    made.CreatePositionsAttr([Gf.Vec3f(0), Gf.Vec3f(3, 0, 0)])
    made.CreateProtoIndicesAttr([0, 0])
    made.CreatePrototypesRel().SetTargets(["/I/Proto"])
    UsdGeom.Xform.Define(stage, "/I/Proto")
    cube = box(stage, "/I/Proto/Box")
    if what == "positions":
        made.GetPositionsAttr().Set([Gf.Vec3f(0), Gf.Vec3f(3, 0, 0)], 0.0)
        made.GetPositionsAttr().Set([Gf.Vec3f(0), Gf.Vec3f(4, 0, 0)], 1.0)
    elif what == "place":
        drive(made)
    elif what == "visibility":
        blink(made)
    elif what == "inside":
        drive(cube)
    elif what == "shape":
        cube.CreateSizeAttr().Set(1.0, 0.0)
        cube.GetSizeAttr().Set(2.0, 1.0)
    first, second = two_frames(stage)
    assert first.draws[0].moving == (what != "nothing")
    if what == "visibility":
        assert not second.draws
    else:
        assert (second.draws[0] is first.draws[0]) == (what == "nothing")
    wanted = {"positions": 4.0, "place": 4.0, "inside": 4.0}.get(what, 3.0)
    if second.draws:
        assert second.draws[0].transforms[1, 3, 0] == pytest.approx(wanted)


def test_topology_that_rests_is_refined_once(monkeypatch: Any) -> None:
    from hdrusd.usd import cage

    count = [0]
    original = cage.refine

    def counted(*arguments: Any, **options: Any) -> Any:
        count[0] += 1
        return original(*arguments, **options)

    monkeypatch.setattr(cage, "refine", counted)
    stage = new_stage()
    mesh = UsdGeom.Mesh.Define(stage, "/Mesh")
    square = [Gf.Vec3f(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    mesh.CreatePointsAttr().Set(square, 0.0)
    mesh.GetPointsAttr().Set([p * 2.0 for p in square], 1.0)
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    reader = StageReader(stage, Report(), level=2)
    widths = [reader.read(t, Camera()).draws[0].geometry.points.max() for t in (0.0, 0.5, 1.0)]
    assert widths == pytest.approx([1.0, 1.5, 2.0])
    assert count[0] == 1
