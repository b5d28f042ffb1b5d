"""FBX: animation, skins, levels of detail, and what has no home yet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fbx_builder import SQUARE, Fbx, P, array, layer, load, needs_ufbx, properties, square

from hdrusd.legacy.scene import TRS

pytestmark = needs_ufbx


def animate(
    fbx: Fbx,
    target: int,
    prop: str,
    axis: str,
    *keys: tuple[float, float],
    **rest: float,
) -> None:
    """Straight lines on one number of a property of ``target``; ``rest``: its other numbers."""
    take = fbx.take()
    short = {"Lcl Translation": "T", "Lcl Rotation": "R", "Lcl Scaling": "S"}.get(prop, prop)
    still = properties(*(P(f"d|{other}", value) for other, value in rest.items()))
    node = fbx.add("AnimationCurveNode", short, "", still, under=take)
    fbx.connect(node, target, prop)
    fbx.curve(node, f"d|{axis}", keys)


def test_straight_lines_keep_their_keys(tmp_path: Path) -> None:
    fbx = Fbx()
    node = fbx.model("moving", "Mesh", P("Lcl Translation", 1.0, 2.0, 3.0))
    fbx.mesh(node, SQUARE, [(0, 1, 2, 3)])
    animate(fbx, node, "Lcl Translation", "X", (0.5, 0.0), (2.5, 4.0), Y=2.0, Z=3.0)
    scene, report = load(fbx.write(tmp_path))
    (node,) = scene.roots
    (channel,) = node.animation
    assert channel.path == "translation"
    # ticks of 1 / 46186158000 s
    np.testing.assert_allclose(channel.times, [0.5, 2.5], atol=1e-10)
    np.testing.assert_allclose(channel.values, [[0, 2, 3], [4, 2, 3]], atol=1e-12)
    assert "animation-cubic" not in report.codes()


def test_turns_go_as_far_as_they_say(tmp_path: Path) -> None:
    """A turn of 360 degrees in 2 s about Y: at each sample the angle is 180 t degrees."""
    fbx = Fbx()
    node = square(fbx)
    animate(fbx, node, "Lcl Rotation", "Y", (0.0, 0.0), (2.0, 360.0))
    scene, report = load(fbx.write(tmp_path))
    (channel,) = scene.roots[0].animation
    assert channel.path == "rotation"
    half = np.radians(180.0 * channel.times) / 2.0
    want = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=1)
    np.testing.assert_allclose(channel.values, want, atol=1e-9)
    # slerp goes the shorter way: no step may reach 180 degrees
    assert np.diff(channel.times).max() < 1.0
    assert "animation-cubic" in report.codes()


def test_what_cannot_move_is_said(tmp_path: Path) -> None:
    fbx = Fbx()
    node = fbx.model("lamp", "Light")
    light = fbx.attribute("Light", P("Intensity", 100.0), under=node)
    animate(fbx, light, "Intensity", "Intensity", (0.0, 0.0), (1.0, 200.0))
    scene, report = load(fbx.write(tmp_path))
    assert scene.lights[0].diffuse == (1.0, 1.0, 1.0)
    (finding,) = [f for f in report if f.code == "animation-path"]
    assert "Intensity" in finding.text
    assert finding.thing == "lamp"


def test_skin(tmp_path: Path) -> None:
    """Two bones; the mesh stood at (10, 0, 0) when it was bound, the bones at (10, 0 or 1, 0)."""
    fbx = Fbx()
    body = square(fbx)
    bones = [fbx.model("low", "LimbNode", P("Lcl Translation", 10.0, 0.0, 0.0))]
    bones += [fbx.model("high", "LimbNode", P("Lcl Translation", 0.0, 1.0, 0.0), under=bones[0])]
    geometry = 1002  # the square's, made after its node
    skin = fbx.add("Deformer", "bend", "Skin", "Version: 101", under=geometry)
    held = ([0, 1, 2], [1.0, 3.0, 0.25]), ([2, 1], [0.75, 1.0])
    for number, (bone, (points, weights)) in enumerate(zip(bones, held, strict=True)):
        mesh = np.eye(4)
        mesh[3, :3] = (10.0, 0.0, 0.0)
        link = mesh.copy()
        link[3, 1] = number
        cluster = fbx.add(
            "Deformer",
            "",
            "Cluster",
            "Version: 100",
            array("Indexes", points),
            array("Weights", weights),
            # FBX 7: the mesh in the space of the bone; the bone in the world
            array("Transform", (mesh @ np.linalg.inv(link)).reshape(-1).tolist()),
            array("TransformLink", link.reshape(-1).tolist()),
            under=skin,
        )
        fbx.connect(bone, cluster)
    assert body == geometry - 1
    scene, report = load(fbx.write(tmp_path))
    (found,) = scene.skins
    by_name = {node.name: node for node in scene.roots}
    assert by_name["square"].skin == 0
    assert found.joints == (by_name["low"], by_name["low"].children[0])
    for number, inverse in enumerate(found.inverse_binds):
        at = [0.0, 0.0, 0.0, 1.0] @ inverse
        np.testing.assert_allclose(at, [0.0, -number, 0.0, 1.0], atol=1e-12)
    (mesh,) = scene.meshes
    assert mesh.joint_indices is not None
    assert mesh.joint_weights is not None
    dense = np.zeros((4, 2))
    for point, (joints, weights) in enumerate(
        zip(mesh.joint_indices, mesh.joint_weights, strict=True)
    ):
        np.add.at(dense[point], joints, weights)
    np.testing.assert_allclose(dense, [[1, 0], [0.75, 0.25], [0.25, 0.75], [1, 0]], atol=1e-7)
    # The last one is held by none; with weights of 0 it would go to the origin.
    (finding,) = [f for f in report if f.code == "skin-weights"]
    assert "1 of 4 points" in finding.text


def test_geometric_transform_of_a_skinned_mesh_counts_once(tmp_path: Path) -> None:
    """FBX SDK: bone now, bone at bind inverted, mesh at bind, geometric transform, point."""
    fbx = Fbx()
    node = fbx.model("n", "Mesh", P("GeometricTranslation", 3.0, 0.0, 0.0))
    geometry = fbx.mesh(node, SQUARE, [(0, 1, 2, 3)])
    bone = fbx.model("bone", "LimbNode", P("Lcl Translation", 0.0, 5.0, 0.0))
    skin = fbx.add("Deformer", "s", "Skin", "Version: 101", under=geometry)
    link = np.eye(4)
    link[3, 1] = 5.0
    body = (
        array("Indexes", [0, 1, 2, 3]),
        array("Weights", [1.0] * 4),
        array("Transform", np.linalg.inv(link).reshape(-1).tolist()),
        array("TransformLink", link.reshape(-1).tolist()),
    )
    fbx.connect(bone, fbx.add("Deformer", "", "Cluster", "Version: 100", *body, under=skin))
    scene, _ = load(fbx.write(tmp_path))
    points = np.column_stack([scene.meshes[0].points, np.ones(4)])
    world = points @ scene.skins[0].inverse_binds[0] @ link
    np.testing.assert_allclose(world[:, :3], np.add(SQUARE, (3.0, 0.0, 0.0)), atol=1e-6)


def test_levels_of_detail(tmp_path: Path) -> None:
    """Thresholds 100 and 300: the middle level is shown between them."""
    fbx = Fbx()
    group = fbx.model("lamp", "LodGroup")
    thresholds = properties(
        P("ThresholdsUsedAsPercentage", 0, kind="bool"),
        P("Thresholds|Level0", 100.0),
        P("Thresholds|Level1", 300.0),
    )
    fbx.add("NodeAttribute", "", "LodGroup", 'TypeFlags: "LodGroup"', thresholds, under=group)
    for name in ("near", "middle", "far"):
        square(fbx, name, under=group)
    scene, _ = load(fbx.write(tmp_path))
    (node,) = scene.roots
    assert node.kind == "lod"
    assert [low for low, _ in node.lod_ranges] == [0.0, 100.0, 300.0]
    assert [high for _, high in node.lod_ranges][:2] == [100.0, 300.0]


def test_shapes_cages_and_constraints_are_findings(tmp_path: Path) -> None:
    fbx = Fbx()
    square(fbx)
    geometry = 1002
    blend = fbx.add("Deformer", "smile", "BlendShape", "Version: 100", under=geometry)
    channel = fbx.add("Deformer", "c", "BlendShapeChannel", "Version: 100", under=blend)
    shape = (array("Indexes", [0]), array("Vertices", [0.0, 0.0, 1.0]))
    fbx.add("Geometry", "s", "Shape", "Version: 100", *shape, under=channel)
    fbx.add("Constraint", "aim", "Aim", 'Type: "Aim"', under=0)
    line = (array("Points", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), array("PointsIndex", [0, ~1]))
    fbx.add("Geometry", "wire", "Line", *line, under=fbx.model("wire", "Line"))
    scene, report = load(fbx.write(tmp_path))
    assert scene.meshes[0].points[0].tolist() == [0.0, 0.0, 0.0]
    assert {"fbx-blend-shape", "fbx-element"} <= report.codes()
    unread = " ".join(f.text for f in report if f.code == "fbx-element")
    assert "curves of lines" in unread
    assert "constraints" in unread


def test_without_normals_they_are_made(tmp_path: Path) -> None:
    fbx = Fbx()
    square(fbx)
    scene, report = load(fbx.write(tmp_path))
    (mesh,) = scene.meshes
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1]] * len(mesh.normals), atol=1e-7)
    assert "fbx-normals" in report.codes()
    assert scene.roots[0].transform in (None, TRS())
    flat = layer("LayerElementNormal", "Normals", [0.0, 1.0, 0.0] * 4)
    fbx = Fbx()
    square(fbx, "own", flat)
    scene, report = load(fbx.write(tmp_path, "own.fbx"))
    assert scene.meshes[0].normals.tolist() == [[0.0, 1.0, 0.0]] * 4
    assert "fbx-normals" not in report.codes()
