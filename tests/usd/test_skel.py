"""UsdSkel: where trigonometry and arithmetic say that joints and blend shapes take points."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, UsdGeom, UsdSkel

from hdrusd.report import Report
from hdrusd.scene import Camera, Draw
from hdrusd.usd.extract import StageReader

#: A strip of two quads along x, from the shoulder at 0 past the elbow at 1 to the hand at 2.
STRIP = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 1), (1, 0, 1), (2, 0, 1)]
#: By default the hand's points hang on the elbow's joint, all others on the shoulder's.
HAND = [0, 0, 1, 0, 0, 1]
ALONG = Gf.Matrix4d().SetTranslate(Gf.Vec3d(1, 0, 0))


def about_y(degrees: float) -> Gf.Quatf:
    half = math.radians(degrees) / 2.0
    return Gf.Quatf(math.cos(half), 0.0, math.sin(half), 0.0)


class Arm:
    """A strip of mesh on two joints; the elbow bends about y by 90 degrees from time 0 to 1."""

    def __init__(
        self,
        indices: Any = HAND,
        weights: Any = (1.0,) * 6,
        *,
        each: int = 1,
        constant: bool = False,
        place: Any = (0.0, 0.0, 0.0),
    ) -> None:
        self.stage = new_stage()
        UsdSkel.Root.Define(self.stage, "/Root")
        skeleton = UsdSkel.Skeleton.Define(self.stage, "/Root/Skel")
        skeleton.AddTranslateOp().Set(Gf.Vec3d(*place))
        skeleton.CreateJointsAttr(["A", "A/B"])
        skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1), ALONG])
        skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1), ALONG])
        self.animation = UsdSkel.Animation.Define(self.stage, "/Root/Anim")
        self.animation.CreateJointsAttr(["A", "A/B"])
        self.animation.CreateTranslationsAttr([Gf.Vec3f(0), Gf.Vec3f(1, 0, 0)])
        self.animation.CreateScalesAttr([Gf.Vec3h(1), Gf.Vec3h(1)])
        self.rotations = self.animation.CreateRotationsAttr()
        self.rotations.Set([about_y(0), about_y(0)], 0)
        self.rotations.Set([about_y(0), about_y(90)], 1)
        UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(
            ["/Root/Anim"]
        )
        self.mesh = UsdGeom.Mesh.Define(self.stage, "/Root/Strip")
        self.mesh.CreatePointsAttr(STRIP)
        self.mesh.CreateFaceVertexCountsAttr([4, 4])
        self.mesh.CreateFaceVertexIndicesAttr([0, 1, 4, 3, 1, 2, 5, 4])
        self.mesh.CreateSubdivisionSchemeAttr("none")
        self.binding = UsdSkel.BindingAPI.Apply(self.mesh.GetPrim())
        self.binding.CreateSkeletonRel().SetTargets(["/Root/Skel"])
        if indices is not None:
            self.binding.CreateJointIndicesPrimvar(constant, each).Set(list(indices))
            self.binding.CreateJointWeightsPrimvar(constant, each).Set(list(weights))

    def world(self, time: float, report: Report | None = None) -> tuple[Any, Any, Draw]:
        """Points and normals in the world by the order of STRIP, and the draw."""
        reader = StageReader(self.stage, Report() if report is None else report)
        draw = reader.read(time, Camera()).draws[0]
        return (*placed(draw), draw)


def placed(draw: Draw) -> tuple[Any, Any]:
    """The six points and their normals: corners 0 1 4, 0 4 3, 1 2 5, 1 5 4 of the strip."""
    order = [0, 1, 7, 5, 2, 8]
    matrix = draw.transforms[0]
    points = draw.geometry.points[order] @ matrix[:3, :3] + matrix[3, :3]
    return points, draw.geometry.normals[order] @ matrix[:3, :3]


def test_a_bent_elbow_takes_the_hand_down() -> None:
    """About y, x turns to -z: the hand, one beyond the elbow, comes to lie one below it."""
    arm = Arm()
    straight, _, _ = arm.world(0.0)
    assert straight == pytest.approx(np.array(STRIP, float), abs=1e-6)
    bent, _, draw = arm.world(1.0)
    assert bent[2] == pytest.approx([1, 0, -1], abs=1e-6)
    assert bent[5] == pytest.approx([2, 0, -1], abs=1e-6)  # z turns to x
    assert bent[[0, 1, 3, 4]] == pytest.approx(np.array(STRIP, float)[[0, 1, 3, 4]], abs=1e-6)
    assert draw.moving


def test_between_the_keys_the_angle_is_between() -> None:
    bent, _, _ = Arm().world(0.5)
    root = math.sqrt(0.5)
    assert bent[2] == pytest.approx([1 + root, 0, -root], abs=1e-6)


def test_linear_blending_is_the_mean_of_two_places() -> None:
    """Half on each joint: half way between (2, 0, 0) and (1, 0, -1)."""
    arm = Arm([0, 1] * 6, [1, 0, 1, 0, 0.5, 0.5, 1, 0, 1, 0, 1, 0], each=2)
    bent, _, _ = arm.world(1.0)
    assert bent[2] == pytest.approx([1.5, 0, -0.5], abs=1e-6)


def test_dual_quaternions_keep_the_length() -> None:
    """Half on each joint is a bend by 45 degrees, at the same distance from the elbow."""
    arm = Arm([0, 1] * 6, [1, 0, 1, 0, 0.5, 0.5, 1, 0, 1, 0, 1, 0], each=2)
    arm.binding.CreateSkinningMethodAttr("dualQuaternion")
    bent, _, _ = arm.world(1.0)
    root = math.sqrt(0.5)
    assert bent[2] == pytest.approx([1 + root, 0, -root], abs=1e-5)


def test_skinned_geometry_stands_where_its_skeleton_does() -> None:
    arm = Arm(place=(0, 10, 0))
    arm.mesh.AddTranslateOp().Set(Gf.Vec3d(0, 0, 77))  # UsdSkel: of no account
    bent, _, _ = arm.world(1.0)
    assert bent[2] == pytest.approx([1, 10, -1], abs=1e-6)


def test_one_joint_for_all_moves_the_place_alone() -> None:
    """Constant influences: the arrays stay as they are, the matrix turns."""
    arm = Arm([1], [1.0], constant=True)
    reader = StageReader(arm.stage, Report())
    first, second = (reader.read(t, Camera()).draws[0] for t in (0.0, 1.0))
    assert second.geometry is first.geometry
    assert second.moving
    points, _ = placed(second)
    assert points[2] == pytest.approx([1, 0, -1], abs=1e-6)


def test_authored_normals_turn_with_the_joints() -> None:
    arm = Arm()
    arm.mesh.CreateNormalsAttr([(1, 0, 0)] * 6)
    arm.mesh.SetNormalsInterpolation("vertex")
    _, normals, _ = arm.world(1.0)
    assert normals[2] == pytest.approx([0, 0, -1], abs=1e-6)
    assert normals[0] == pytest.approx([1, 0, 0], abs=1e-6)


def test_normals_at_corners_turn_with_the_joints_of_their_points() -> None:
    arm = Arm()
    arm.mesh.CreateNormalsAttr([(1, 0, 0)] * 8)
    arm.mesh.SetNormalsInterpolation("faceVarying")
    _, normals, _ = arm.world(1.0)
    assert normals[2] == pytest.approx([0, 0, -1], abs=1e-6)
    assert normals[1] == pytest.approx([1, 0, 0], abs=1e-6)


def test_without_normals_they_are_those_of_the_bent_shape() -> None:
    arm = Arm([1] * 6)
    arm.rotations.Set([about_y(0), about_y(90)], 0)
    _, normals, _ = arm.world(0.0)
    # The strip in the plane y = 0 turns within it.
    assert np.abs(normals) == pytest.approx(np.tile([0.0, 1.0, 0.0], (6, 1)), abs=1e-6)


def test_a_pose_that_does_not_vary_is_read_once() -> None:
    arm = Arm()
    arm.rotations.Clear()
    arm.rotations.Set([about_y(0), about_y(90)])
    reader = StageReader(arm.stage, Report())
    first, second = (reader.read(t, Camera()).draws for t in (0.0, 1.0))
    assert second[0] is first[0]
    assert not first[0].moving
    assert placed(first[0])[0][2] == pytest.approx([1, 0, -1], abs=1e-6)


def test_a_binding_that_does_not_fit_shows_the_bind_pose_and_says_so() -> None:
    report = Report()
    points, _, _ = Arm([0, 9, 0], [1.0] * 3).world(1.0, report)
    assert "skel-binding" in report.codes()
    assert points == pytest.approx(np.array(STRIP, float), abs=1e-6)


# -- blend shapes -------------------------------------------------------------------------


def smiling(*, joints: bool = False) -> tuple[Arm, UsdSkel.BlendShape]:
    """The hand's first point rises by 2 along y; the weight runs from 0 to 1."""
    arm = Arm() if joints else Arm(None)
    arm.animation.CreateBlendShapesAttr(["other", "rise"])
    weights = arm.animation.CreateBlendShapeWeightsAttr()
    weights.Set([0.9, 0.0], 0)
    weights.Set([0.9, 1.0], 1)
    shape = UsdSkel.BlendShape.Define(arm.stage, "/Root/Strip/rise")
    shape.CreateOffsetsAttr([(0, 2, 0)])
    shape.CreatePointIndicesAttr([2])
    arm.binding.CreateBlendShapesAttr(["rise"])
    arm.binding.CreateBlendShapeTargetsRel().SetTargets(["/Root/Strip/rise"])
    return arm, shape


@pytest.mark.parametrize("weight", [0.0, 0.25, 1.0])
def test_offsets_are_added_by_their_weight(weight: float) -> None:
    arm, _ = smiling()
    points, _, draw = arm.world(weight)
    wanted = np.array(STRIP, float)
    wanted[2, 1] += 2.0 * weight
    assert points == pytest.approx(wanted, abs=1e-6)
    assert draw.moving


def test_an_inbetween_is_hit_at_its_weight() -> None:
    """Linear from 0 to (0, 5, 0) at a half, and on to (0, 2, 0) at one."""
    arm, shape = smiling()
    between = shape.CreateInbetween("half")
    between.SetWeight(0.5)
    between.SetOffsets([(0, 5, 0)])
    heights = [float(arm.world(t)[0][2, 1]) for t in (0.25, 0.5, 0.75, 1.0)]
    assert heights == pytest.approx([2.5, 5.0, 3.5, 2.0], abs=1e-6)


def test_normal_offsets_are_added_to_authored_normals() -> None:
    arm, shape = smiling()
    arm.mesh.CreateNormalsAttr([(0, 1, 0)] * 6)
    arm.mesh.SetNormalsInterpolation("vertex")
    shape.CreateNormalOffsetsAttr([(1, 0, 0)])
    _, normals, _ = arm.world(0.5)
    assert normals[2] == pytest.approx([0.5, 1, 0], abs=1e-6)
    assert normals[0] == pytest.approx([0, 1, 0], abs=1e-6)


def test_blend_shapes_come_before_joints() -> None:
    arm, shape = smiling(joints=True)
    shape.GetOffsetsAttr().Set([(1, 0, 0)])
    points, _, _ = arm.world(1.0)
    # (3, 0, 0), two beyond the elbow, turns to two below it.
    assert points[2] == pytest.approx([1, 0, -2], abs=1e-6)


def test_offsets_of_points_that_are_not_there_are_a_finding() -> None:
    arm, shape = smiling()
    shape.GetPointIndicesAttr().Set([99])
    report = Report()
    points, _, _ = arm.world(1.0, report)
    assert "skel-binding" in report.codes()
    assert points == pytest.approx(np.array(STRIP, float), abs=1e-6)


def test_a_skinned_cage_is_refined_after_it_is_bent() -> None:
    """Bilinear halves of the bent strip: the middle of the forearm is half way to the hand."""
    arm = Arm()
    arm.mesh.GetSubdivisionSchemeAttr().Set("bilinear")
    reader = StageReader(arm.stage, Report(), level=1)
    geometries = [reader.read(t, Camera()).draws[0].geometry for t in (0.0, 1.0)]
    assert len(geometries[1].points) == 2 * 4 * 2 * 3
    near = np.abs(geometries[1].points - [1, 0, -0.5]).max(axis=1)
    assert near.min() < 1e-6


def test_copies_and_instances_of_a_skinned_mesh_bend_too() -> None:
    """Below a point instancer, and as native instances of one SkelRoot."""
    arm = Arm(place=(0, 10, 0))
    copies = UsdGeom.PointInstancer.Define(arm.stage, "/Copies")
    copies.CreatePositionsAttr([Gf.Vec3f(0, 0, 100)])
    copies.CreateProtoIndicesAttr([0])
    copies.CreatePrototypesRel().SetTargets(["/Root"])
    for name in ("One", "Two"):
        prim = arm.stage.DefinePrim(f"/{name}")
        prim.GetReferences().AddInternalReference("/Root")
        prim.SetInstanceable(True)
        UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(0, 0, 200 if name == "One" else 300))
    scene = StageReader(arm.stage, Report()).read(1.0, Camera())
    hands = []
    for draw in scene.draws:
        assert draw.moving
        for matrix in draw.transforms:
            hands.append((draw.geometry.points[7] @ matrix[:3, :3] + matrix[3, :3]).tolist())
    assert sorted(hand[2] for hand in hands) == pytest.approx([-1, 99, 199, 299], abs=1e-5)
    assert [hand[1] for hand in hands] == pytest.approx([10.0] * 4, abs=1e-5)


def test_a_shape_without_points_follows_one_joint() -> None:
    arm = Arm(None)
    ball = UsdGeom.Cube.Define(arm.stage, "/Root/Ball")
    binding = UsdSkel.BindingAPI.Apply(ball.GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/Root/Skel"])
    binding.CreateJointIndicesPrimvar(True, 1).Set([1])
    binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d().SetTranslate(Gf.Vec3d(2, 0, 0)))
    draws = StageReader(arm.stage, Report()).read(1.0, Camera()).draws
    (cube,) = (draw for draw in draws if draw.moving)
    assert cube.transforms[0, 3, :3] == pytest.approx([1, 0, -1], abs=1e-6)
