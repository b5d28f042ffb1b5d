"""Primitive sets, vertex arrays and shapes of OpenSceneGraph files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from osg_builder import (
    HEADER,
    SQUARE,
    STRIP,
    Loaded,
    array,
    coordinates,
    geode,
    geometry,
    load,
    old_geode,
    old_geometry,
    scene,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import Mesh
from hdrusd.report import Kind

SIX = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n2 1 0"


def new(folder: Path, *args: str, limits: Limits | None = None, **more: str) -> Loaded:
    """A scene of one Geometry in the newer syntax."""
    return load(folder, scene(geode(geometry(*args, **more))), limits=limits)


def old(folder: Path, *args: str, **more: str) -> Loaded:
    """A scene of one Geometry in the older syntax."""
    return load(folder, old_geode(old_geometry(*args, **more)))


@pytest.mark.parametrize(
    ("mode", "points", "faces"),
    [
        # OpenGL 2.1, section 2.6.1 and figures 2.2 to 2.4: every face keeps the winding.
        ("TRIANGLES", SIX, [[0, 1, 2], [3, 4, 5]]),
        ("TRIANGLE_STRIP", STRIP, [[0, 1, 2], [2, 1, 3]]),
        ("TRIANGLE_FAN", SQUARE, [[0, 1, 2], [0, 2, 3]]),
        ("QUADS", SQUARE, [[0, 1, 2, 3]]),
        ("QUAD_STRIP", STRIP, [[0, 1, 3, 2]]),
        ("POLYGON", SIX, [[0, 1, 2, 3, 4, 5]]),
    ],
)
@pytest.mark.parametrize("syntax", ["new", "old", "version 91"])
def test_modes(tmp_path: Path, syntax: str, mode: str, points: str, faces: list[list[int]]) -> None:
    count = len(points.splitlines())
    if syntax == "old":
        made = old(tmp_path, f"DrawArrays {mode} 0 {count}", points)
    elif syntax == "new":
        made = new(tmp_path, f"osg::DrawArrays {{\nMode {mode} \nCount {count} \n}}", points)
    else:
        made = new(tmp_path, f"DrawArrays GL_{mode} 0 {count} ", points)
    assert made.faces == faces
    assert not made.codes()


@pytest.mark.parametrize("width", ["UByte", "UShort", "UInt"])
def test_indexed_faces(tmp_path: Path, width: str) -> None:
    made = old(tmp_path, f"DrawElements{width} TRIANGLES 6\n{{\n0 1 2 0\n2 3\n}}")
    assert made.faces == [[0, 1, 2], [0, 2, 3]]
    block = f"osg::DrawElements{width} {{\nMode TRIANGLES \nvector 6 {{\n0 1 2 0 \n2 3 \n}}\n}}"
    assert new(tmp_path, block).faces == [[0, 1, 2], [0, 2, 3]]
    assert new(tmp_path, f"DrawElements{width} GL_TRIANGLES 0 6 {{\n0 1 2 0 2 3 \n}}").faces == [
        [0, 1, 2],
        [0, 2, 3],
    ]


def test_a_strip_for_each_length(tmp_path: Path) -> None:
    sets = "osg::DrawArrayLengths {\nMode TRIANGLE_STRIP \nFirst 1 \nvector 2 {\n3 2 \n}\n}"
    made = new(tmp_path, sets, SIX)  # 1 2 3 is a triangle, 4 5 is none
    assert made.faces == [[1, 2, 3]]
    made = old(tmp_path, "DrawArrayLengths TRIANGLE_FAN 0 2\n{\n3 3\n}", SIX)
    assert made.faces == [[0, 1, 2], [3, 4, 5]]


def test_stitches_of_strips_are_no_faces(tmp_path: Path) -> None:
    made = old(tmp_path, "DrawElementsUByte TRIANGLE_STRIP 8\n{\n0 1 2 2 3 3 4 5\n}", SIX)
    assert made.faces == [[0, 1, 2], [4, 3, 5]]  # the sixth of the strip: turned over
    assert not made.codes()


def test_points_and_lines_are_counted(tmp_path: Path) -> None:
    sets = "DrawArrays LINES 0 2\nDrawArrays LINES 2 2\nDrawArrays POINTS 0 4\nDrawArrays QUADS 0 4"
    made = old(tmp_path, sets)
    assert made.faces == [[0, 1, 2, 3]]
    texts = sorted(f.text for f in made.report if f.code == "osg-primitive-mode")
    assert texts == [
        "1 primitive sets of POINTS; only faces are kept",
        "2 primitive sets of LINES; only faces are kept",
    ]
    alone = new(tmp_path, "osg::DrawArrays {\nCount 4 \n}")  # no Mode is POINTS, which is 0
    assert alone.codes() == {"osg-primitive-mode", "osg-no-faces"}
    assert not alone.scene.meshes


TWO = "DrawArrays TRIANGLES 0 3\nDrawArrays QUADS 0 4"


@pytest.mark.parametrize(
    ("binding", "values", "interpolation", "spread"),
    [
        ("OVERALL", "0 0 1", "constant", [1]),
        ("PER_PRIMITIVE_SET", "0 0 1\n0 0 2", "uniform", [1, 2]),
        ("PER_PRIMITIVE", "0 0 1\n0 0 2", "uniform", [1, 2]),
        ("PER_VERTEX", "0 0 1\n0 0 2\n0 0 3\n0 0 4", "vertex", [1, 2, 3, 4]),
    ],
)
def test_bindings(
    tmp_path: Path, binding: str, values: str, interpolation: str, spread: list[int]
) -> None:
    count = len(values.splitlines())
    more = f"NormalBinding {binding}\nNormalArray Vec3Array {count}\n{{\n{values}\n}}"
    mesh = old(tmp_path, TWO, more=more).mesh
    assert mesh.normals is not None
    assert (mesh.normals_interpolation, mesh.normals[:, 2].tolist()) == (interpolation, spread)
    more = array("Normal", "Vec3Array", values, f"BIND_{binding}")
    mesh = new(tmp_path, TWO.replace(" T", " GL_T").replace(" Q", " GL_Q"), more=more).mesh
    assert mesh.normals is not None
    assert (mesh.normals_interpolation, mesh.normals[:, 2].tolist()) == (interpolation, spread)


def test_a_primitive_is_a_face_of_triangles_and_a_whole_strip(tmp_path: Path) -> None:
    sets = "DrawArrays TRIANGLES 0 6\nDrawArrays TRIANGLE_STRIP 0 4"
    more = "ColorBinding PER_PRIMITIVE\nColorArray Vec4Array 3\n{\n1 0 0 1\n2 0 0 1\n3 0 0 1\n}"
    mesh = old(tmp_path, sets, SIX, more).mesh
    assert mesh.colors is not None
    assert mesh.colors[:, 0].tolist() == [1, 2, 3, 3]


def test_index_arrays_give_corners_their_own_values(tmp_path: Path) -> None:
    more = (
        "VertexIndices UIntArray 4\n{\n3 2 1 0\n}\nNormalBinding PER_VERTEX\n"
        "NormalArray Vec3Array 2\n{\n0 0 1\n0 0 2\n}\nNormalIndices UByteArray 4\n{\n0 1 1 0\n}"
    )
    made = old(tmp_path, more=more)
    assert made.faces == [[3, 2, 1, 0]]
    assert made.mesh.normals is not None
    assert made.mesh.normals_interpolation == "faceVarying"
    assert made.mesh.normals[:, 2].tolist() == [1, 2, 2, 1]


def test_equal_index_arrays_are_one_numbering(tmp_path: Path) -> None:
    more = (
        "VertexIndices UIntArray 4\n{\n3 2 1 0\n}\nTexCoordArray 0 Vec2Array 4\n"
        "{\n0 0\n.25 0\n.5 0\n.75 0\n}\nTexCoordIndices 0 UIntArray 4\n{\n3 2 1 0\n}"
    )
    values, interpolation = old(tmp_path, more=more).mesh.uvs["st"]
    assert (interpolation, values[:, 0].tolist()) == ("vertex", [0.0, 0.25, 0.5, 0.75])


def test_byte_colours_are_255ths(tmp_path: Path) -> None:
    more = array("Color", "Vec4ubArray", "255 51 0 102", "BIND_OVERALL")
    mesh = new(tmp_path, more=more).mesh
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, [[1.0, 0.2, 0.0, 0.4]], rtol=1e-7)  # one rounding
    more = "ColorBinding OVERALL\nColorArray UVec4bArray 1\n{\n255 51 0 102\n}"
    old_mesh = old(tmp_path, more=more).mesh
    assert old_mesh.colors is not None
    np.testing.assert_array_equal(old_mesh.colors, mesh.colors)


def test_three_colours_have_full_alpha(tmp_path: Path) -> None:
    mesh = new(tmp_path, more=array("Color", "Vec3Array", "1 0.5 0", "BIND_OVERALL")).mesh
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1.0, 0.5, 0.0, 1.0]]


def test_units_without_coordinates_are_counted(tmp_path: Path) -> None:
    inside = coordinates("0 0 \n1 0 \n1 1 \n0 1").replace("1 {\nosg", "2 {\nNULL \nosg", 1)
    assert list(new(tmp_path, more=inside).mesh.uvs) == ["st1"]


def test_arrays_of_version_91(tmp_path: Path) -> None:
    rows = SQUARE.replace("\n", " \n")
    text = scene(
        geode(
            "osg::Geometry {\nPrimitiveSetList 1 {\nDrawArrays GL_QUADS 0 4 \n}\nVertexData {\n"
            f"Array TRUE ArrayID 1 Vec3fArray 4 {{\n{rows}\n}}\nIndices FALSE \n"
            "Binding BIND_PER_VERTEX \nNormalize 0 \n}\nTexCoordData 2 {\nData {\nArray FALSE \n"
            "Indices FALSE \nBinding BIND_OFF \nNormalize 0 \n}\nData {\nArray TRUE ArrayID 2 "
            "Vec2fArray 4 {\n0 0 \n1 0 \n1 1 \n0 1 \n}\nIndices FALSE \nBinding BIND_PER_VERTEX \n"
            "Normalize 0 \n}\n}\nNormalData {\nArray TRUE ArrayID 1 \nIndices FALSE \n"
            "Binding BIND_PER_VERTEX \nNormalize 0 \n}\n}"
        )
    )
    made = load(tmp_path, text)
    assert made.faces == [[0, 1, 2, 3]]
    assert list(made.mesh.uvs) == ["st1"]
    np.testing.assert_array_equal(made.mesh.normals, made.mesh.points)  # one array for both
    assert not made.codes()


def test_a_shared_array_is_read_for_each(tmp_path: Path) -> None:
    shared = array("Vertex", "Vec3Array", SQUARE).replace("Binding", "UniqueID 9 \nBinding", 1)
    again = "VertexArray TRUE {\nosg::Vec3Array {\nUniqueID 9 \n}\n}"
    one, two = (
        f"osg::Geometry {{\nPrimitiveSetList 1 {{\nDrawArrays GL_QUADS 0 4 \n}}\n{a}\n}}"
        for a in (shared, again)
    )
    first, second = load(tmp_path, scene(geode(one, two))).scene.meshes
    np.testing.assert_array_equal(first.points, second.points)


def test_drawing_beyond_the_points_is_clamped(tmp_path: Path) -> None:
    made = new(tmp_path, "osg::DrawArrays {\nMode TRIANGLES \nCount 2000000000 \n}")
    assert made.faces == [[0, 1, 2]]
    assert made.finding("osg-draw-count").kind is Kind.CLAMPED
    made = old(tmp_path, "DrawArrays QUADS -3 7\nDrawArrayLengths QUADS 0 2\n{\n4 1000000\n}")
    assert made.faces == [[0, 1, 2, 3]]
    assert [f.code for f in made.report].count("osg-draw-count") == 2


def test_a_face_with_a_wrong_index_is_left_out(tmp_path: Path) -> None:
    made = old(tmp_path, "DrawElementsUInt TRIANGLES 6\n{\n0 1 2 0 2 99\n}")
    assert made.faces == [[0, 1, 2]]
    assert "1 faces" in made.finding("osg-index").text


def test_declared_counts_are_not_believed(tmp_path: Path) -> None:
    text = scene(geode(geometry())).replace("vector 4 {", "vector 2000000000 {")
    made = load(tmp_path, text)
    assert made.faces == [[0, 1, 2, 3]]
    assert "2000000000 declared" in made.finding("osg-count").text


def test_faces_at_no_place_are_left_out(tmp_path: Path) -> None:
    points = SIX.replace("2 0 0", "nan 0 0").replace("2 1 0", "1e400 0 0")
    made = old(tmp_path, "DrawArrays TRIANGLES 0 6", points)
    assert made.faces == [[0, 1, 2]]
    assert np.isfinite(made.mesh.points).all()
    assert "1 faces" in made.finding("osg-vertex").text


def test_attributes_that_do_not_fit_are_dropped(tmp_path: Path) -> None:
    short = array("Normal", "Vec3Array", "0 0 1\n0 0 1")
    made = new(tmp_path, more=short)
    assert (made.mesh.normals, made.codes()) == (None, {"osg-attribute"})
    broken = array("Normal", "Vec3Array", "0 0 1\n0 0 nan\n0 0 1\n0 0 1")
    assert new(tmp_path, more=broken).mesh.normals is None


@pytest.mark.parametrize(
    ("rows", "interpolation"), [("0 0 1", "constant"), ("0 0 1\n0 0 1\n0 0 1\n0 0 1", "vertex")]
)
def test_an_array_without_binding_is_guessed_by_its_size(
    tmp_path: Path, rows: str, interpolation: str
) -> None:
    more = f"NormalArray Vec3Array {len(rows.splitlines())}\n{{\n{rows}\n}}"
    made = old(tmp_path, more=more)
    assert made.mesh.normals_interpolation == interpolation
    assert made.finding("osg-binding").kind is Kind.ASSUMED


def test_double_coordinates_that_are_rounded_are_said(tmp_path: Path) -> None:
    far = "\n".join(f"6378137.33 {row.split()[1]} 0" for row in SQUARE.splitlines())
    made = new(tmp_path, points=far, kind="Vec3dArray")
    assert made.finding("osg-precision").kind is Kind.CLAMPED
    assert abs(float(made.mesh.points[0, 0]) - 6378137.33) <= 0.25  # half a float32 step there


def test_rows_and_corners_are_limited_over_the_file(tmp_path: Path) -> None:
    shared = array("Vertex", "Vec3Array", SQUARE).replace("Binding", "UniqueID 9 \nBinding", 1)
    sets = "PrimitiveSetList 1 {\nDrawArrays GL_QUADS 0 4 \n}"
    parts = [f"osg::Geometry {{\n{sets}\n{shared}\n}}"] * 6
    with pytest.raises(InputError, match="more than 20 array rows"):
        load(tmp_path, scene(geode(*parts)), limits=Limits(vertices=20))
    many = "DrawArrays GL_QUADS 0 4 \n" * 6
    with pytest.raises(InputError, match="more than 20 corners in all"):
        new(tmp_path, many, limits=Limits(vertices=20))


def test_other_attributes_are_findings(tmp_path: Path) -> None:
    more = array("FogCoord", "FloatArray", "0\n0\n0\n0") + "\nVertexAttribArrayList 1 {\nNULL \n}"
    assert new(tmp_path, more=more).codes() == {"osg-vertex-attribute"}
    empty = load(tmp_path, HEADER + geode("osg::Geometry {\n}"))
    assert (empty.scene.meshes, empty.codes()) == ([], {"osg-no-vertices"})


# --- shapes -------------------------------------------------------------------------------

QUARTER = f"Rotation 0 {math.sqrt(0.5)} 0 {math.sqrt(0.5)} "  # about y: z to x
SEGMENTS = 40


def shape(folder: Path, kind: str, fields: str) -> Mesh:
    """The mesh of a shape, from both syntaxes, which must agree."""
    body = f"{kind} {{\n{fields}\n}}"
    made = [
        load(folder, scene(geode(f"osg::ShapeDrawable {{\nShape TRUE {{\nosg::{body}\n}}\n}}"))),
        load(folder, old_geode(f"ShapeDrawable {{\n{body}\ncolor 1 1 1 1\n}}")),
    ]
    np.testing.assert_array_equal(made[0].mesh.points, made[1].mesh.points)
    assert made[0].codes() == {"osg-shape-faces"}
    return made[0].mesh


def volume(mesh: Mesh) -> float:
    """Enclosed volume; positive if the faces are counter-clockwise from outside."""
    points, total, start = mesh.points.astype(np.float64), 0.0, 0
    for count in mesh.face_counts.tolist():
        corners = points[mesh.face_indices[start : start + count]]
        for i in range(1, count - 1):
            total += float(np.linalg.det(corners[[0, i, i + 1]])) / 6.0
        start += count
    return total


#: Of the area of a regular polygon of 40 sides to that of its circle.
ROUND = SEGMENTS / (2.0 * math.pi) * math.sin(2.0 * math.pi / SEGMENTS)


@pytest.mark.parametrize(
    ("kind", "fields", "enclosed", "tolerance"),
    [
        # float32 points: 1e-5 is a hundred roundings; the arcs of 20 rows lose 1 % more.
        ("Box", "HalfLengths 1 2 3 ", 48.0, 1e-6),
        ("Cylinder", "Radius 2 \nHeight 3 ", math.pi * 12.0 * ROUND, 1e-5),
        ("Cone", "Radius 2 \nHeight 3 ", math.pi * 4.0 * ROUND, 1e-5),
        ("Sphere", "Radius 2 ", math.pi * 32.0 / 3.0 * ROUND, 0.01),
        ("Capsule", "Radius 2 \nHeight 3 ", math.pi * (32.0 / 3.0 + 12.0) * ROUND, 0.01),
    ],
)
def test_shapes_enclose_their_volume(
    tmp_path: Path, kind: str, fields: str, enclosed: float, tolerance: float
) -> None:
    mesh = shape(tmp_path, kind, fields)
    assert volume(mesh) == pytest.approx(enclosed, rel=tolerance)
    moved = shape(tmp_path, kind, f"Center 5 6 7 \n{fields}\n{QUARTER}")
    assert volume(moved) == pytest.approx(enclosed, rel=max(tolerance, 1e-5))


def test_normals_point_outwards(tmp_path: Path) -> None:
    mesh = shape(tmp_path, "Capsule", "Radius 2 \nHeight 3 ")
    assert mesh.normals is not None
    nearest = np.zeros_like(mesh.points)  # on the axis of the cylindrical part
    nearest[:, 2] = np.clip(mesh.points[:, 2], -1.5, 1.5)
    np.testing.assert_allclose(mesh.normals, (mesh.points - nearest) / 2.0, atol=1e-6)


def test_a_cone_stands_about_its_centre_of_mass(tmp_path: Path) -> None:
    points = shape(tmp_path, "Cone", f"Center 10 0 0 \nRadius 1 \nHeight 4 \n{QUARTER}").points
    assert points[:, 0].min() == pytest.approx(9.0)  # a quarter of the height behind
    assert points[:, 0].max() == pytest.approx(13.0)


def test_shapes_that_are_none(tmp_path: Path) -> None:
    for body in ("Sphere {\nRadius 0\n}", "Box {\nHalfLengths 1e39 1 1\n}", "HeightField {\n}"):
        made = load(tmp_path, old_geode(f"ShapeDrawable {{\n{body}\n}}"))
        assert (made.scene.meshes, made.codes()) == ([], {"osg-shape"})
