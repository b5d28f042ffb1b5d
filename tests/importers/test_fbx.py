"""FBX: unit, axes, the tree, polygons. Files are made by hand; a reader runs in its worker."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from fbx_builder import EPS, SQUARE, Fbx, P, layer, load, needs_ufbx, square

from hdrusd.errors import InputError
from hdrusd.legacy.scene import TRS, Node

pytestmark = needs_ufbx


def matrix(node: Node) -> npt.NDArray[np.float64]:
    """The node's TRS for column vectors."""
    trs = node.transform if isinstance(node.transform, TRS) else TRS()
    x, y, z, w = trs.rotation
    made = np.eye(4)
    made[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    made[:3, :3] *= trs.scale
    made[:3, 3] = trs.translation
    return made


def moved(*by: float) -> npt.NDArray[np.float64]:
    """A shift, for column vectors."""
    made = np.eye(4)
    made[:3, 3] = by
    return made


def turned(x: float, y: float, z: float) -> npt.NDArray[np.float64]:
    """FBX's default order: about X, then Y, then Z; degrees."""
    made = np.eye(4)
    for axis, angle in enumerate(np.radians((x, y, z))):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        one = np.eye(4)
        one[i, i] = one[j, j] = np.cos(angle)
        one[j, i], one[i, j] = np.sin(angle), -np.sin(angle)
        made = one @ made
    return made


@pytest.mark.parametrize(("centimetres", "metres"), [(1.0, 0.01), (100.0, 1.0), (2.54, 0.0254)])
def test_unit_is_the_files(tmp_path: Path, centimetres: float, metres: float) -> None:
    fbx = Fbx(unit=centimetres)
    square(fbx)
    scene, report = load(fbx.write(tmp_path))
    assert scene.unit_m == pytest.approx(metres, rel=1e-15)
    assert scene.meshes[0].points.max() == 1.0  # not scaled on the way
    assert "fbx-unit" not in report.codes()


def test_y_and_z_up_are_the_files(tmp_path: Path) -> None:
    for axes, up in (((1, 1, 2, 1, 0, 1), "Y"), ((2, 1, 1, -1, 0, 1), "Z")):
        fbx = Fbx(axes=axes)
        square(fbx)
        scene, report = load(fbx.write(tmp_path, f"{up}.fbx"))
        assert scene.up == up
        assert scene.roots[0].name == "square"
        assert scene.roots[0].transform is None
        assert "fbx-axes" not in report.codes()


@pytest.mark.parametrize(
    ("axes", "place"),
    [
        ((0, 1, 2, 1, 1, -1), (-2.0, 1.0, 3.0)),  # +X is up, -Y is right, +Z is front
        ((1, 1, 2, -1, 0, 1), (1.0, 2.0, -3.0)),  # left-handed: +Z goes away from the viewer
    ],
)
def test_other_axes_are_turned(
    tmp_path: Path, axes: tuple[int, ...], place: tuple[float, ...]
) -> None:
    """A point (1, 2, 3) stands where the axes of the file say."""
    fbx = Fbx(axes=axes)
    fbx.mesh(fbx.model("n", "Mesh"), [(1.0, 2.0, 3.0), (0, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    scene, report = load(fbx.write(tmp_path))
    assert scene.up == "Y"
    assert "fbx-axes" in report.codes()
    node, world = scene.roots[0], np.eye(4)
    while True:
        world = world @ matrix(node)
        if node.meshes:
            break
        (node,) = node.children
    point = world @ [*scene.meshes[0].points[0], 1.0]
    np.testing.assert_allclose(point[:3], place, atol=4 * EPS)


def test_pivots_and_rotations_follow_the_sdk(tmp_path: Path) -> None:
    """T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1 of the FBX SDK's documentation."""
    t, r, s = (1.0, -2.0, 3.0), (10.0, 20.0, -30.0), (2.0, 0.5, 1.5)
    pre, post = (40.0, 0.0, 15.0), (0.0, -25.0, 5.0)
    r_off, r_piv = (0.1, 0.2, 0.3), (1.0, 2.0, -1.0)
    s_off, s_piv = (-0.5, 0.25, 0.125), (0.5, -0.5, 2.0)
    g_move, g_turn, g_scale = (3.0, 0.0, 1.0), (0.0, 90.0, 0.0), (1.0, 2.0, 1.0)
    fbx = Fbx()
    vector = "Vector3D"
    node = fbx.model(
        "pivots",
        "Mesh",
        P("RotationActive", 1, kind="bool"),
        P("Lcl Translation", *t),
        P("Lcl Rotation", *r),
        P("Lcl Scaling", *s),
        P("PreRotation", *pre, kind=vector),
        P("PostRotation", *post, kind=vector),
        P("RotationOffset", *r_off, kind=vector),
        P("RotationPivot", *r_piv, kind=vector),
        P("ScalingOffset", *s_off, kind=vector),
        P("ScalingPivot", *s_piv, kind=vector),
        P("GeometricTranslation", *g_move, kind=vector),
        P("GeometricRotation", *g_turn, kind=vector),
        P("GeometricScaling", *g_scale, kind=vector),
    )
    fbx.mesh(node, SQUARE, [(0, 1, 2, 3)])
    scene, _ = load(fbx.write(tmp_path))
    scaled = np.diag([*s, 1.0])
    want = moved(*t) @ moved(*r_off) @ moved(*r_piv) @ turned(*pre) @ turned(*r)
    want = want @ np.linalg.inv(turned(*post)) @ np.linalg.inv(moved(*r_piv)) @ moved(*s_off)
    want = want @ moved(*s_piv) @ scaled @ np.linalg.inv(moved(*s_piv))
    np.testing.assert_allclose(matrix(scene.roots[0]), want, atol=1e-14)
    geometric = moved(*g_move) @ turned(*g_turn) @ np.diag([*g_scale, 1.0])
    points = np.column_stack([np.array(SQUARE), np.ones(4)]) @ geometric.T
    np.testing.assert_allclose(scene.meshes[0].points, points[:, :3], atol=8 * EPS)


def test_a_child_that_ignores_its_parents_scale(tmp_path: Path) -> None:
    """InheritType 2 (Rrs) of a child at (1, 0, 0) under a scale of 2: moved by it, not scaled."""
    fbx = Fbx()
    parent = fbx.model("parent", "Null", P("Lcl Scaling", 2.0, 2.0, 2.0))
    child = fbx.model(
        "child",
        "Mesh",
        P("InheritType", 2, kind="enum"),
        P("Lcl Translation", 1.0, 0.0, 0.0),
        under=parent,
    )
    fbx.mesh(child, SQUARE, [(0, 1, 2, 3)])
    scene, _ = load(fbx.write(tmp_path))

    def corner(node: Node, above: npt.NDArray[np.float64]) -> npt.NDArray[np.float64] | None:
        world = above @ matrix(node)
        if node.meshes:
            return world @ [1.0, 1.0, 0.0, 1.0]
        found = (corner(below, world) for below in node.children)
        return next((point for point in found if point is not None), None)

    np.testing.assert_allclose(corner(scene.roots[0], np.eye(4)), [3, 1, 0, 1], atol=1e-14)


def test_polygons_keep_their_corners(tmp_path: Path) -> None:
    points = [*SQUARE, (2.0, 0.5, 0.0)]
    fbx = Fbx()
    red, blue = (
        fbx.add("Material", "red", "", under=None),
        fbx.add("Material", "blue", "", under=None),
    )
    node = fbx.model("n", "Mesh")
    fbx.connect(red, node)
    fbx.connect(blue, node)
    normals = [0.0, 0.0, 1.0] * 4 + [0.0, 1.0, 0.0] * 3
    uv = [0.0, 0.0, 0.25, 0.5]
    fbx.mesh(
        node,
        points,
        [(0, 1, 2, 3), (1, 4, 2)],
        layer("LayerElementNormal", "Normals", normals),
        layer("LayerElementUV", "UV", uv, [0, 1, 1, 0, 0, 0, 1], name="first"),
        layer("LayerElementUV", "UV", [0.5, 0.75], [0] * 7, number=1, name="second"),
        layer("LayerElementColor", "Colors", [1.0, 0.5, 0.25, 0.125], [0] * 7),
        layer("LayerElementMaterial", "Materials", [1, 0], mapping="ByPolygon"),
    )
    scene, report = load(fbx.write(tmp_path))
    (mesh,) = scene.meshes
    assert mesh.points.tolist() == [list(p) for p in points]
    assert mesh.face_counts.tolist() == [4, 3]
    assert mesh.face_indices.tolist() == [0, 1, 2, 3, 1, 4, 2]
    assert mesh.normals_interpolation == "faceVarying"
    assert mesh.normals is not None
    assert mesh.normals.reshape(-1).tolist() == normals
    first, how = mesh.uvs["st"]
    assert how == "faceVarying"
    assert first.tolist() == [uv[2 * i : 2 * i + 2] for i in (0, 1, 1, 0, 0, 0, 1)]
    second, how = mesh.uvs["st1"]
    assert how == "vertex"  # the same at all corners of each point
    assert second.tolist() == [[0.5, 0.75]] * 5
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1.0, 0.5, 0.25, 0.125]] * 5
    names = {scene.materials[s.material].name: s.faces.tolist() for s in mesh.subsets}
    assert names == {"blue": [0], "red": [1]}
    assert report.codes() == set()


def test_mesh_of_two_nodes_is_one(tmp_path: Path) -> None:
    fbx = Fbx()
    a, b = fbx.model("a", "Mesh"), fbx.model("b", "Mesh", P("Lcl Translation", 5.0, 0.0, 0.0))
    fbx.connect(fbx.mesh(a, SQUARE, [(0, 1, 2, 3)]), b)
    scene, _ = load(fbx.write(tmp_path))
    assert len(scene.meshes) == 1
    assert [node.meshes for node in scene.roots] == [[0], [0]]


def test_same_mesh_in_other_materials_is_another(tmp_path: Path) -> None:
    fbx = Fbx()
    a, b = fbx.model("a", "Mesh"), fbx.model("b", "Mesh")
    fbx.connect(fbx.mesh(a, SQUARE, [(0, 1, 2, 3)]), b)
    fbx.add("Material", "red", "", under=a)
    fbx.add("Material", "blue", "", under=b)
    scene, _ = load(fbx.write(tmp_path))
    worn = [scene.meshes[node.meshes[0]].material for node in scene.roots]
    assert [scene.materials[m].name for m in worn if m is not None] == ["red", "blue"]


def test_hidden_nodes_and_user_properties(tmp_path: Path) -> None:
    fbx = Fbx()
    group = fbx.model("group", "Null", P("lane", 3, kind="user int"), P("Visibility", 0.0))
    square(fbx, under=group)
    dim = fbx.model("dim", "Mesh", P("Show", 0, kind="bool"))
    fbx.mesh(dim, SQUARE, [(0, 1, 2, 3)])
    square(fbx, "seen")
    scene, _ = load(fbx.write(tmp_path))
    assert {node.name: node.visible for node in scene.roots} == {
        "group": False,
        "dim": False,
        "seen": True,
    }
    assert scene.roots[0].extras == {"lane": 3.0}


def test_points_lines_and_empty_files(tmp_path: Path) -> None:
    fbx = Fbx()
    fbx.mesh(fbx.model("n", "Mesh"), SQUARE, [(0, 1), (0, 1, 2)])
    scene, report = load(fbx.write(tmp_path))
    assert scene.meshes[0].face_counts.tolist() == [3]
    assert "primitive-mode" in report.codes()
    scene, report = load(Fbx().write(tmp_path, "none.fbx"))
    assert scene.roots == []
    assert "scene-empty" in report.codes()


def test_ufbx_stays_in_its_worker(tmp_path: Path) -> None:
    fbx = Fbx()
    square(fbx)
    load(fbx.write(tmp_path))
    assert "ufbx" not in sys.modules


def test_without_ufbx_one_line_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Fbx().write(tmp_path)
    monkeypatch.setitem(sys.modules, "ufbx", None)
    with pytest.raises(InputError, match=r"pip install 'hdrusd\[fbx\]'") as caught:
        load(path)
    assert caught.value.exit_code == 3
    assert "\n" not in str(caught.value)
