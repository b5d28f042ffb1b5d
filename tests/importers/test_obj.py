"""OBJ geometry: vertices, forms of faces, objects, groups and the materials they wear.

Facts come from the Advanced Visualizer manual, appendix B1, or stand in the file itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from obj_builder import SQUARE, TRIANGLE, load_text, quick

from hdrusd.importers.importer import IMPORTERS
from hdrusd.report import Kind

# Vertices and faces


def test_a_triangle(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, TRIANGLE + "f 1 2 3\n")
    mesh = loaded.mesh
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert mesh.points.dtype == np.float32
    assert mesh.face_counts.tolist() == [3]
    assert mesh.face_indices.tolist() == [0, 1, 2]
    assert mesh.face_counts.dtype == mesh.face_indices.dtype == np.int32
    assert mesh.normals is None
    assert not mesh.uvs
    assert mesh.colors is None
    assert mesh.two_sided
    assert not mesh.left_handed


def test_the_registry_knows_it() -> None:
    assert IMPORTERS["obj"].__module__ == "hdrusd.importers.obj"


def test_unit_and_axis_are_assumed_once(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, TRIANGLE + "f 1 2 3\n")
    assert loaded.scene.unit_m == 1.0
    assert loaded.scene.up == "Y"
    assert loaded.finding("obj-units").kind is Kind.ASSUMED


@pytest.mark.parametrize(
    ("face", "uv", "normals"),
    [
        ("f 1 2 3 4", False, False),
        ("f 1/1 2/2 3/3 4/4", True, False),
        ("f 1//1 2//1 3//1 4//1", False, True),
        ("f 1/1/1 2/2/1 3/3/1 4/4/1", True, True),
        ("f 1/1/ 2/2/ 3/3/ 4/4/", True, False),
        ("f 1/ 2/ 3/ 4/", False, False),
        ("f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1", True, True),
        ("f\t1/1/1\t 2/2/1  3/3/1 4/4/1 \t", True, True),
        ("f +1 2 3 4", False, False),
        ("f 1 2 3 4 # the roof", False, False),
        ("  f 1 2 3 4", False, False),
    ],
)
def test_forms_of_a_face(tmp_path: Path, face: str, uv: bool, normals: bool) -> None:
    loaded = load_text(tmp_path, f"{SQUARE}{face}\n")
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert loaded.mesh.face_counts.tolist() == [4]
    assert loaded.corner_points == corners
    if uv:
        values, interpolation = loaded.mesh.uvs["st"]
        assert interpolation == "faceVarying"
        assert values.tolist() == [corner[:2] for corner in corners]
    else:
        assert not loaded.mesh.uvs
    assert (loaded.mesh.normals is not None) == normals
    if loaded.mesh.normals is not None:
        assert loaded.mesh.normals_interpolation == "faceVarying"
        assert loaded.mesh.normals.tolist() == [[0, 0, 1]] * 4
    assert loaded.report.codes() == {"obj-units", "material-none"}


@st.composite
def polygons(draw: st.DrawFn) -> tuple[str, list[list[tuple[int, int | None, int | None]]]]:
    """Face lines in all forms with the numbers (from 0) that they mean among 9, 7 and 5."""
    lines, meant = [], []
    for form in draw(st.lists(st.sampled_from(["v", "v/t", "v//n", "v/t/n"]), min_size=1)):
        words, corners = [], []
        for _ in range(draw(st.integers(3, 6))):
            corner, written = [], []
            for slot, size in zip("vtn", (9, 7, 5), strict=True):
                index = draw(st.integers(0, size - 1))
                given = slot in form
                corner.append(index if given else None)
                back = draw(st.booleans())
                written.append(str(index - size if back else index + 1) if given else "")
            words.append("/".join(written).rstrip("/"))
            corners.append((corner[0], corner[1], corner[2]))
        lines.append("f " + " ".join(words))
        meant.append(corners)
    return "\n".join(lines) + "\n", meant


@quick
@given(polygons())
def test_faces_of_mixed_forms_mean_what_they_say(tmp_path: Path, case: tuple[str, list]) -> None:
    text, meant = case
    table = "".join(f"v {i} {i * i} 1\n" for i in range(9))
    table += "".join(f"vt {i} {10 + i}\n" for i in range(7))
    table += "".join(f"vn {i + 1} 0 0\n" for i in range(5))
    mesh = load_text(tmp_path, table + text).mesh
    corners = [corner for face in meant for corner in face]
    assert mesh.face_counts.tolist() == [len(face) for face in meant]
    points = mesh.points[mesh.face_indices]
    assert points.tolist() == [[v, v * v, 1] for v, _, _ in corners]
    if mesh.uvs:
        wanted = [(0, 0) if t is None else (t, 10 + t) for _, t, _ in corners]
        assert mesh.uvs["st"][0].tolist() == [list(uv) for uv in wanted]
    else:
        assert all(t is None for _, t, _ in corners)
    for row, (_, _, n) in enumerate(corners):
        if n is not None:
            assert mesh.normals is not None
            assert mesh.normals[row].tolist() == [n + 1, 0, 0]


def test_negative_indices_count_from_the_line_they_stand_on(tmp_path: Path) -> None:
    text = TRIANGLE + "f -3 -2 -1\nv 5 5 5\nf -1 -2 -3\n"
    loaded = load_text(tmp_path, text)
    assert loaded.corner_points == [
        *([0, 0, 0], [1, 0, 0], [0, 1, 0]),
        *([5, 5, 5], [0, 1, 0], [1, 0, 0]),
    ]


def test_vertices_may_come_after_their_faces(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "f 1 2 3\n" + TRIANGLE)
    assert loaded.corner_points == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_only_used_points_are_kept(tmp_path: Path) -> None:
    text = "".join(f"v {i} 0 0\n" for i in range(1000)) + "f 1000 2 500\n"
    mesh = load_text(tmp_path, text).mesh
    assert mesh.points[:, 0].tolist() == [1, 499, 999]
    assert mesh.face_indices.tolist() == [2, 0, 1]


@pytest.mark.parametrize(
    ("number", "value"),
    [("1e2", 100.0), ("-1.5E-3", -0.0015), (".5", 0.5), ("5.", 5.0), ("+2", 2.0), ("1e-400", 0.0)],
)
def test_numbers(tmp_path: Path, number: str, value: float) -> None:
    loaded = load_text(tmp_path, f"{TRIANGLE}v {number} 0 0\nf 2 3 4\n")
    assert loaded.corner_points[2][0] == np.float32(value)


def test_decimal_commas_are_mended_and_said(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "v 0,588235 0 0\nv 1 0 0\nv 0 1,5 0\nf 1 2 3\n")
    assert loaded.corner_points[0][0] == np.float32(0.588235)
    finding = loaded.finding("decimal-comma")
    assert finding.kind is Kind.REPLACED
    assert finding.text.startswith("2 numbers")


def test_vertex_colors(tmp_path: Path) -> None:
    text = "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 0\nv 0 1 0 0 0 1 0.25\nf 1 2 3\n"
    mesh = load_text(tmp_path, text).mesh
    assert mesh.colors_interpolation == "vertex"
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1, 0, 0, 1], [0, 0.5, 0, 1], [0, 0, 1, 0.25]]


def test_a_vertex_without_a_color_beside_colored_ones_is_white(tmp_path: Path) -> None:
    text = "v 0 0 0 1 0 0\nv 1 0 0 nan nan nan\nv 0 1 0\nf 1 2 3\n"
    loaded = load_text(tmp_path, text)
    assert loaded.mesh.colors is not None
    assert loaded.mesh.colors.tolist() == [[1, 0, 0, 1], [1, 1, 1, 1], [1, 1, 1, 1]]
    assert loaded.finding("vertex-color-missing").text.startswith("2 ")
    assert loaded.finding("vertex-color").source.place == 2


def test_colors_outside_the_range_are_said(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "v 0 0 0 255 0 0\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n")
    assert loaded.finding("vertex-color-range").source.place == 1


def test_a_weight_is_for_curves_only(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "v 2 0 0 2\nv 1 0 0 1\nv 0 1 0 1.0\nf 1 2 3\n")
    assert loaded.corner_points[0] == [2, 0, 0]
    assert loaded.finding("vertex-weight").text.startswith("1 ")


def test_texture_vertices_of_one_and_three_numbers(tmp_path: Path) -> None:
    text = TRIANGLE + "vt 0.5\nvt 0.25 0.75 0\nvt 1 1 0.5\nf 1/1 2/2 3/3\n"
    loaded = load_text(tmp_path, text)
    assert loaded.mesh.uvs["st"][0].tolist() == [[0.5, 0], [0.25, 0.75], [1, 1]]
    assert loaded.finding("texcoord-depth").source.place == 6


def test_a_corner_without_uv_beside_ones_with(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, SQUARE + "f 2/2 3/3 4/4\nf 1 2 3\n")
    uv = loaded.mesh.uvs["st"][0].tolist()
    assert uv == [[1, 0], [1, 1], [0, 1], [0, 0], [0, 0], [0, 0]]
    finding = loaded.finding("texcoord-missing")
    assert (finding.source.place, finding.text[:9]) == (11, "3 corners")


@pytest.mark.parametrize("normal", ["0 0 0", "nan 0 1", "0 0", "1e400 0 0"])
def test_an_unusable_normal_becomes_that_of_the_face(tmp_path: Path, normal: str) -> None:
    """The second face lies in the plane x = 0 and turns from +y to +z: its normal is +x."""
    text = f"{TRIANGLE}v 0 0 1\nvn 0 0 1\nvn {normal}\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"
    loaded = load_text(tmp_path, text)
    assert loaded.mesh.normals is not None
    assert loaded.mesh.normals.tolist() == [[0, 0, 1]] * 3 + [[1, 0, 0]] * 3
    assert loaded.finding("normal-missing").source.place == 8


def test_the_normal_of_a_concave_polygon(tmp_path: Path) -> None:
    """An L whose first three corners turn the wrong way; seen from +Z it is counter-clockwise."""
    outline = [(1, 1), (1, 2), (0, 2), (0, 0), (2, 0), (2, 1)]
    text = "".join(f"v {x} {y} 0\n" for x, y in outline) + "vn 0 0 0\nvn 0 1 0\n"
    text += "f 1//1 2//1 3//1 4//1 5//1 6//2\n"
    normals = load_text(tmp_path, text).mesh.normals
    assert normals is not None
    assert normals.tolist() == [[0, 0, 1]] * 5 + [[0, 1, 0]]


def test_map_coordinates_keep_their_millimetres(tmp_path: Path) -> None:
    """UTM metres: float32 alone would give steps of 0.5 m in northing."""
    east, north = 500_000.123, 5_400_000.456
    text = f"v {east} {north} 100\nv {east + 10} {north} 100\nv {east} {north + 10} 100\nf 1 2 3\n"
    loaded = load_text(tmp_path, text)
    transform = loaded.scene.roots[0].transform
    assert transform is not None
    placed = loaded.mesh.points.astype(np.float64) + transform.translation  # type: ignore[union-attr]
    # offsets below 8 m have steps of 2^-21 m, half of it by rounding; decimals of 7 digits + 3
    assert np.abs(placed[0] - [east, north, 100]).max() < 1e-6
    assert loaded.finding("obj-far-points").kind is Kind.REPLACED


def test_coordinates_around_the_origin_stay(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "v -9000 0 0\nv 9000 0 0\nv 0 9000 0\nf 1 2 3\n")
    assert loaded.scene.roots[0].transform is None
    assert loaded.corner_points[0] == [-9000, 0, 0]


# Objects, groups and materials


def test_one_node_and_mesh_for_each_object(tmp_path: Path) -> None:
    text = f"{SQUARE}o lamp post #1\nf 1 2 3\no lamp post #1\nf 1 3 4\no empty\n"
    scene = load_text(tmp_path, text).scene
    (root,) = scene.roots
    assert root.name == "model"
    assert [child.name for child in root.children] == ["lamp post #1"] * 2
    assert [child.meshes for child in root.children] == [[0], [1]]
    assert [child.source.place for child in root.children] == [10, 12]
    assert [mesh.source.place for mesh in scene.meshes] == [10, 12]


def test_a_group_goes_on_where_it_was_left(tmp_path: Path) -> None:
    text = f"{SQUARE}g a\nf 1 2 3\ng b  c\nf 1 3 4\ng a\nf 2 3 4 1\n"
    scene = load_text(tmp_path, text).scene
    assert [mesh.name for mesh in scene.meshes] == ["a", "b c"]
    assert scene.meshes[0].face_counts.tolist() == [3, 4]
    assert scene.meshes[1].points.tolist() == [[0, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_a_group_inside_an_object_has_both_names(tmp_path: Path) -> None:
    text = f"{SQUARE}o car\ng door\nf 1 2 3\no van\nf 1 2 3\n"
    (root,) = load_text(tmp_path, text).scene.roots
    assert [child.name for child in root.children] == ["car/door", "van"]
    assert root.children[0].extras == {"o": "car", "g": "door"}


def test_faces_before_any_name_belong_to_the_file(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, SQUARE + "f 1 2 3\n")
    assert loaded.mesh.name == "model"
    assert loaded.mesh.source.place == 10


def test_materials_become_subsets(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    text = f"mtllib m.mtl\n{SQUARE}"
    text += "usemtl blue\nf 1 2 3\nusemtl red\nf 1 3 4\nusemtl blue\nf 2 3 4\n"
    loaded = load_text(tmp_path, text)
    assert [material.name for material in loaded.scene.materials] == ["red", "blue"]
    assert loaded.mesh.material is None
    subsets = {subset.material: subset.faces.tolist() for subset in loaded.mesh.subsets}
    assert subsets == {0: [1], 1: [0, 2]}


def test_one_material_for_all_faces_needs_no_subset(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl red\nnewmtl blue\n")
    loaded = load_text(tmp_path, f"mtllib m.mtl\n{SQUARE}usemtl blue\ng a\nf 1 2 3\nf 1 3 4\n")
    assert loaded.mesh.material == 1
    assert loaded.mesh.subsets == ()


def test_faces_before_usemtl_are_white(tmp_path: Path) -> None:
    """Manual, usemtl: "If a material name is not specified, a white material is used"."""
    loaded = load_text(tmp_path, f"{SQUARE}f 1 2 3\nusemtl x\nf 1 3 4\n")
    names = [material.name for material in loaded.scene.materials]
    white = loaded.scene.materials[names.index("obj_default")]
    assert white.diffuse == (1.0, 1.0, 1.0)
    assert {subset.material for subset in loaded.mesh.subsets} == {0, 1}
    assert loaded.finding("material-none").source.place == 10


def test_an_undefined_material_keeps_its_name(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, f"{SQUARE}usemtl métal\nf 1 2 3\n")
    assert loaded.material.name == "métal"
    assert "diffuse" in loaded.material.defaults
    finding = loaded.finding("material-undefined")
    assert (finding.kind, finding.source.place) == (Kind.MISSING, 10)


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("mtllib a.mtl", {"a"}),
        ("mtllib a.mtl b.mtl", {"a", "b"}),
        ("mtllib a.mtl  my file.mtl\tb.mtl", {"a", "b", "my"}),
        ("mtllib my file.mtl", {"my"}),
        ('mtllib "my file.mtl"', {"my"}),
        ("mtllib .\\A.MTL", {"a"}),
        ("mtllib no suffix", {"ns"}),
        ("mtllib gone.mtl b.mtl", {"b"}),
        ("mtllib a.mtl\nmtllib b.mtl", {"a", "b"}),
    ],
)
def test_names_of_libraries(tmp_path: Path, statement: str, found: set[str]) -> None:
    for file, name in {"a.mtl": "a", "b.mtl": "b", "my file.mtl": "my", "no suffix": "ns"}.items():
        (tmp_path / file).write_text(f"newmtl {name}\n")
    loaded = load_text(tmp_path, f"{statement}\n{SQUARE}f 1 2 3\n")
    assert {material.name for material in loaded.scene.materials} == found | {"obj_default"}
    assert ("file-missing" in loaded.report.codes()) == ("gone" in statement)


def test_of_two_libraries_the_first_counts(tmp_path: Path) -> None:
    """Manual, mtllib: the first file listed is searched first."""
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (tmp_path / "b.mtl").write_text("newmtl m\nKd 0 1 0\n")
    loaded = load_text(tmp_path, f"mtllib a.mtl b.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")
    assert loaded.material.diffuse == (1.0, 0.0, 0.0)
    assert loaded.finding("mtl-duplicate").source.file.name == "b.mtl"


def test_the_generator_is_the_first_comment(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, f"# Blender v2.79 (sub 0)\n# www\n{SQUARE}f 1 2 3\n")
    assert loaded.scene.generator == "Blender v2.79 (sub 0)"
