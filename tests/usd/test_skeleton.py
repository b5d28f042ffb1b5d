"""Skins written as UsdSkel: skinned points where arithmetic says that joints take them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import HERE, node, one_square, square
from pxr import Usd, UsdGeom, UsdSkel

from hdrusd.checking import validate
from hdrusd.legacy.scene import TRS, Channel, LegacyScene, Node, Skin
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader
from hdrusd.usd.writer import StageWriter

#: A bar of two quads along x: its elbow at 1, its end at 2. Points 0 and 3 at 0, and so on.
BAR = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, 1]], np.float32)
CORNERS = np.array([0, 1, 4, 3, 1, 2, 5, 4], np.int32)
#: The elbow holds the end; the middle is shared in halves.
INDICES = np.array([[0, 0], [0, 1], [1, 0], [0, 0], [0, 1], [1, 0]], np.int32)
WEIGHTS = np.array([[1, 0], [0.5, 0.5], [1, 0]] * 2, np.float32)
QUARTER = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))  # 90 degrees about z
STILL = (0.0, 0.0, 0.0, 1.0)
#: Bent by 90 degrees about z at the elbow: the end stands a bar's length above it.
BENT = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]]


def moved(x: float, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    matrix = np.eye(4)
    matrix[3, :3] = x, y, z
    return matrix


BINDS = np.array([np.eye(4), moved(-1.0)])


def bar(**changes: Any) -> Any:
    values = {
        "points": BAR,
        "face_counts": np.array([4, 4], np.int32),
        "face_indices": CORNERS,
        "uvs": {},
        "joint_indices": INDICES,
        "joint_weights": WEIGHTS,
    }
    return square(**values | changes)


def arm(**elbow: Any) -> tuple[Node, Node]:
    """Shoulder and elbow; the elbow bends from 0 to 1 s."""
    bend = Channel("rotation", np.array([0.0, 1.0]), np.array([STILL, QUARTER]))
    lower = node("elbow", transform=TRS((1.0, 0.0, 0.0)), animation=(bend,), **elbow)
    return node("shoulder", children=[lower]), lower


def bar_scene(*, above: Any = None, binds: np.ndarray = BINDS, **skinned: Any) -> LegacyScene:
    upper, lower = arm()
    body = node("body", meshes=[0], skin=0, **skinned)
    root = node("figure", transform=above, children=[upper, body])
    skin = Skin("rig", HERE, (upper, lower), binds)
    return one_square(roots=[root], meshes=[bar()], skins=[skin])


def written(folder: Path, scene: LegacyScene, unit: float = 1.0) -> tuple[Usd.Stage, Report]:
    report = Report()
    folder.mkdir(exist_ok=True)
    made = StageWriter(folder, "s", scene, report, meters_per_unit=unit, source_unit=1.0, up="Z")
    made.write_geometry()
    made.save()
    return Usd.Stage.Open(str(folder / "s.usda")), report


def points(stage: Usd.Stage, code: float, count: int = 6) -> np.ndarray:
    """The skinned points in the world, metres, in the order of BAR."""
    report = Report()
    (draw,) = StageReader(stage, report, default_sky=False).read(code, Camera()).draws
    assert not report.codes() & {"skel-binding"}
    matrix = draw.transforms[0]
    every = draw.geometry.points @ matrix[:3, :3] + matrix[3, :3]
    # Corners 0 1 4, 0 4 3, 1 2 5, 1 5 4.
    return np.asarray(every[[0, 1, 7, 5, 2, 8]])


def test_a_bar_bent_by_a_quarter_turn(tmp_path: Path) -> None:
    stage, report = written(tmp_path, bar_scene())
    np.testing.assert_allclose(points(stage, 0.0), BAR, atol=1e-5)
    np.testing.assert_allclose(points(stage, 24.0), BENT, atol=1e-5)
    # Half way: 45 degrees.
    half = points(stage, 12.0)
    np.testing.assert_allclose(half[2], [1 + math.sqrt(0.5), math.sqrt(0.5), 0], atol=1e-5)
    assert stage.GetEndTimeCode() == 24.0
    assert not report.codes()
    assert not [problem for problem in validate(stage) if problem.severity == "error"]


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_where_the_skinned_node_stands_does_not_count(tmp_path: Path, unit: float) -> None:
    place = TRS((5.0, 6.0, 7.0), QUARTER, (2.0, 2.0, 2.0))
    stage, _ = written(tmp_path, bar_scene(transform=place, above=moved(0.0, 0.0, 3.0)), unit)
    np.testing.assert_allclose(points(stage, 24.0), np.add(BENT, (0, 0, 3)), atol=1e-5)


def test_the_skinned_node_may_be_animated(tmp_path: Path) -> None:
    drive = Channel("translation", np.array([0.0, 1.0]), np.array([[0, 0, 0], [8.0, 0, 0]]))
    stage, _ = written(tmp_path, bar_scene(animation=(drive,)))
    np.testing.assert_allclose(points(stage, 24.0), BENT, atol=1e-5)
    np.testing.assert_allclose(points(stage, 12.0)[0], [0, 0, 0], atol=1e-5)


def test_a_bind_pose_elsewhere(tmp_path: Path) -> None:
    # The mesh was bound ten units up: B takes it from there to the joints.
    scene = bar_scene(binds=np.array([moved(0.0, -10.0), moved(-1.0, -10.0)]))
    mesh = bar(points=BAR + np.float32([0, 10, 0]))
    scene.meshes[0] = mesh
    stage, _ = written(tmp_path, scene)
    np.testing.assert_allclose(points(stage, 24.0), BENT, atol=1e-5)


def test_joints_in_any_order_and_with_nodes_between(tmp_path: Path) -> None:
    upper, lower = arm()
    between = node("between", transform=TRS(scale=(0.5, 0.5, 0.5)), children=[lower])
    lower.transform = TRS((2.0, 0.0, 0.0), scale=(2.0, 2.0, 2.0))
    upper.children = [between]
    body = node("body", meshes=[0], skin=0)
    skin = Skin("rig", HERE, (lower, upper), BINDS[::-1])
    mesh = bar(joint_indices=1 - INDICES)
    scene = one_square(roots=[upper, body], meshes=[mesh], skins=[skin])
    stage, _ = written(tmp_path, scene)
    np.testing.assert_allclose(points(stage, 24.0), BENT, atol=1e-5)


def test_the_skinned_node_may_be_a_joint_itself(tmp_path: Path) -> None:
    upper, lower = arm()
    lower.meshes, lower.skin = [0], 0
    scene = one_square(
        roots=[upper], meshes=[bar()], skins=[Skin("rig", HERE, (upper, lower), BINDS)]
    )
    stage, _ = written(tmp_path, scene)
    np.testing.assert_allclose(points(stage, 24.0), BENT, atol=1e-5)


def test_joints_become_prims_only_where_something_hangs_on_them(tmp_path: Path) -> None:
    scene = bar_scene()
    stage, _ = written(tmp_path, scene)
    assert not stage.GetPrimAtPath("/s/figure/shoulder")
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/s/figure/body/rig/Skeleton"))
    assert list(skeleton.GetJointsAttr().Get()) == ["shoulder", "shoulder/elbow"]
    # A tool in the hand follows it, as a part of the scene.
    scene = bar_scene()
    elbow = scene.skins[0].joints[1]
    elbow.children.append(node("tool", transform=TRS((1.0, 0.0, 0.0)), meshes=[1]))
    scene.meshes.append(square())
    stage, _ = written(tmp_path / "tool", scene)
    tool = UsdGeom.Xformable(stage.GetPrimAtPath("/s/figure/shoulder/elbow/tool"))
    place = tool.ComputeLocalToWorldTransform(24.0).ExtractTranslation()
    assert list(place) == pytest.approx([1.0, 1.0, 0.0], abs=1e-6)


def test_boxes_hold_the_skinned_points(tmp_path: Path) -> None:
    # The node stands far away, the skin where its joints are.
    stage, _ = written(tmp_path, bar_scene(transform=TRS((500.0, 0.0, 0.0))))
    for code in (0.0, 12.0, 24.0):
        box = UsdGeom.BBoxCache(code, ["default"]).ComputeWorldBound(stage.GetPseudoRoot())
        bounds = box.ComputeAlignedRange()
        every = points(stage, code)
        assert (np.array(bounds.GetMin()) <= every.min(axis=0) + 1e-6).all()
        assert (np.array(bounds.GetMax()) >= every.max(axis=0) - 1e-6).all()
        assert bounds.GetMax()[0] < 3.0


def test_a_hidden_node_hides_its_skin(tmp_path: Path) -> None:
    stage, _ = written(tmp_path, bar_scene(visible=False))
    mesh = stage.GetPrimAtPath("/s/figure/body/rig/square")
    assert UsdGeom.Imageable(mesh).ComputeVisibility() == "invisible"


def test_two_meshes_of_one_rig_share_its_skeleton(tmp_path: Path) -> None:
    scene = bar_scene()
    scene.roots[0].children.append(node("coat", meshes=[0], skin=0))
    stage, _ = written(tmp_path, scene)
    geometry = stage.GetLayerStack(includeSessionLayers=False)[3]
    second = geometry.GetPrimAtPath("/s/figure/coat/rig/Skeleton")
    assert not second.attributes.get("joints")
    draws = StageReader(stage, Report(), default_sky=False).read(24.0, Camera()).draws
    assert len(draws) == 2
    np.testing.assert_array_equal(draws[0].geometry.points, draws[1].geometry.points)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda scene: scene.skins.__setitem__(0, Skin("rig", HERE, (node("lost"),), BINDS[:1])),
        lambda scene: scene.skins.__setitem__(0, Skin("rig", HERE, (), BINDS[:0])),
        lambda scene: setattr(scene.roots[0].children[1], "transform", TRS(scale=(0, 0, 0))),
    ],
)
def test_a_skin_that_cannot_be_bound_leaves_the_mesh_at_its_node(
    tmp_path: Path, spoil: Any
) -> None:
    scene = bar_scene()
    spoil(scene)
    stage, report = written(tmp_path, scene)
    assert report.codes() == {"skin-bind"}
    assert stage.GetPrimAtPath("/s/figure/body/square").IsA(UsdGeom.Mesh)


def test_too_many_poses_are_resampled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hdrusd.usd.skeleton._MOST_POSES", 100)
    scene = bar_scene()
    times = np.linspace(0.0, 1.0, 1001)
    halves = np.radians(45.0 * times)
    turns = np.stack([0 * times, 0 * times, np.sin(halves), np.cos(halves)], axis=1)
    scene.skins[0].joints[1].animation = (Channel("rotation", times, turns),)
    stage, report = written(tmp_path, scene)
    assert report.codes() == {"skin-animation"}
    np.testing.assert_allclose(points(stage, 24.0), BENT, atol=1e-5)
    half = [1 + math.sqrt(0.5), math.sqrt(0.5), 0]
    np.testing.assert_allclose(points(stage, 12.0)[2], half, atol=1e-5)


def test_a_bind_matrix_without_volume_is_a_finding(tmp_path: Path) -> None:
    scene = bar_scene(binds=np.array([np.eye(4), np.diag([1.0, 0.0, 1.0, 1.0])]))
    stage, report = written(tmp_path, scene)
    assert report.codes() == {"skin-bind"}
    # The elbow's pose at the start stands in: nothing moves then.
    np.testing.assert_allclose(points(stage, 0.0), BAR, atol=1e-5)
