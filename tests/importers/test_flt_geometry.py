"""OpenFlight faces and meshes: points, normals, colours, materials, textures."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from flt_builder import (
    SQUARE,
    Loaded,
    Pool,
    color_index,
    colors,
    database,
    face,
    inside,
    load,
    material,
    node,
    record,
    texture,
    thing,
    vertex,
)

from hdrusd.importers.flt_geometry import SUBFACE_LIFT
from hdrusd.report import Kind

UP = (0.0, 0.0, 1.0)


def dressed(folder: Path, palettes: bytes = b"", version: int = 1650, **fields: object) -> Loaded:
    """A square with texture coordinates in an object, under some palettes."""
    pool = Pool()
    corners = pool.add(*(vertex(p, UP, p[:2]) for p in SQUARE))
    content = database(
        thing("o", face(corners, **fields)),  # type: ignore[arg-type]
        palettes=palettes,
        vertices=pool.data,
        version=version,
    )
    return load(folder, content)


# --- points and faces ---------------------------------------------------------------------


def test_faces_share_the_vertices_that_they_name(tmp_path: Path) -> None:
    pool = Pool()
    a, b, c, d = pool.square()
    content = database(thing("o", face([a, b, c]), face([a, c, d])), vertices=pool.data)
    mesh = load(tmp_path, content).mesh
    assert (mesh.name, mesh.points.tolist()) == ("o", [list(p) for p in SQUARE])
    assert mesh.face_counts.tolist() == [3, 3]
    assert mesh.face_indices.tolist() == [0, 1, 2, 0, 2, 3]
    assert (mesh.normals, mesh.uvs, mesh.colors, mesh.two_sided) == (None, {}, None, False)


def test_attributes_of_vertices(tmp_path: Path) -> None:
    mesh = dressed(tmp_path).mesh
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [list(UP)] * 4
    values, interpolation = mesh.uvs["st"]
    assert (values.tolist(), interpolation) == ([list(p[:2]) for p in SQUARE], "vertex")


def test_a_vertex_without_a_normal_takes_the_faces(tmp_path: Path) -> None:
    """Three lean to +X; the fourth has none, and the face looks up."""
    pool = Pool()
    corners = pool.add(*(vertex(p, (1.0, 0.0, 0.0)) for p in SQUARE[:3]), vertex(SQUARE[3]))
    mesh = load(tmp_path, database(thing("o", face(corners)), vertices=pool.data)).mesh
    assert mesh.normals_interpolation == "faceVarying"
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[1, 0, 0]] * 3 + [[0, 0, 1]]


def test_sides(tmp_path: Path) -> None:
    """Draw type 0 is culled from behind, 1 is not: two meshes."""
    pool = Pool()
    both = face(pool.square()), face(pool.square(1.0), draw=1)
    made = load(tmp_path, database(thing("o", *both), vertices=pool.data))
    assert [m.two_sided for m in made.scene.meshes] == [False, True]
    assert [m.two_sided for m in made.scene.materials] == [False, True]


def test_hidden_faces_are_in_a_hidden_node(tmp_path: Path) -> None:
    made = dressed(tmp_path, flags=0x04000000)
    own = made.node("o")
    assert own.meshes == []
    assert [(child.visible, child.meshes) for child in own.children] == [(False, [0])]


def test_subfaces_stand_off_the_face_below(tmp_path: Path) -> None:
    """The same four vertices, once as they are and once lifted, in feet."""
    pool = Pool()
    corners = pool.square()
    upon = record(19) + face(corners, name="mark") + record(20)
    content = database(thing("o", face(corners) + upon), vertices=pool.data, unit=4)
    made = load(tmp_path, content)
    below, above = made.scene.meshes
    assert (below.points[:, 2] == 0.0).all()
    np.testing.assert_allclose(above.points[:, 2], SUBFACE_LIFT / 0.3048, rtol=1e-6)
    assert made.finding("flt-subface").kind is Kind.REPLACED


def test_points_far_out_keep_their_places(tmp_path: Path) -> None:
    """At 5,000 km a 32-bit float knows half a metre; the node's transform knows all."""
    pool = Pool()
    far = 5.0e6
    corners = pool.add(*(vertex((far + x / 8.0, y, -far)) for x, y, _ in SQUARE))
    made = load(tmp_path, database(thing("o", face(corners)), vertices=pool.data))
    (holder,) = made.node("o").children
    assert holder.meshes == [0]
    shift = np.array(getattr(holder.transform, "translation"))  # noqa: B009
    placed = made.mesh.points.astype(np.float64) + shift
    np.testing.assert_array_equal(placed, [(far + x / 8.0, y, -far) for x, y, _ in SQUARE])
    assert made.finding("flt-far-points").kind is Kind.REPLACED


def test_bad_vertices_take_their_faces_along(tmp_path: Path) -> None:
    pool = Pool()
    good = pool.square()
    nan = pool.add(vertex((float("nan"), 0, 0)))
    faces = [face(good), face([*good[:2], *nan]), face([*good[:2], 4]), face([*good[:2], 2**31])]
    made = load(tmp_path, database(thing("o", *faces), vertices=pool.data))
    assert made.mesh.face_counts.tolist() == [4]
    assert "not there or not finite: 3," in made.finding("flt-vertex").text


def test_lines_and_points_are_left_out(tmp_path: Path) -> None:
    pool = Pool()
    square = pool.square()
    faces = [face(square), face(square[:2]), face(square, draw=2), face(square, draw=3)]
    made = load(tmp_path, database(thing("o", *faces), vertices=pool.data))
    assert made.mesh.face_counts.tolist() == [4]
    assert made.finding("flt-lines").text.startswith("lines and points: 3")


def test_a_face_that_stands_elsewhere_is_a_node(tmp_path: Path) -> None:
    pool = Pool()
    step = record(49, struct.pack(">16f", 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1))
    content = database(thing("o", face(pool.square(), name="moved", more=step)), vertices=pool.data)
    made = load(tmp_path, content)
    assert made.node("o").meshes == []
    own = made.node("moved")
    assert (own.meshes, np.asarray(own.transform)[3, 2]) == ([0], 7.0)


# --- meshes -------------------------------------------------------------------------------


def mesh_record(kind: int, indices: list[int], width: int = 2, mask: int = 0x80000000) -> bytes:
    """A mesh (84) of five vertices at (i, i^2, 0) with one primitive."""
    rows = b"".join(struct.pack(">3d", i, i * i, 0) for i in range(5))
    if mask & 0x20000000:
        rows = b"".join(struct.pack(">3d4B", i, i * i, 0, 0, 30, 20, 10 * i) for i in range(5))
    pool = record(85, struct.pack(">II", 5, mask) + rows)
    letter = {1: "B", 2: "H", 4: "I"}[width]
    body = struct.pack(f">hHI{len(indices)}{letter}", kind, width, len(indices), *indices)
    own = node(
        84, "m", 84, {32: struct.pack(">hh", -1, -1), 52: b"\x03" if mask & 0x20000000 else b"\x02"}
    )
    return own + pool + inside(record(86, body))


@pytest.mark.parametrize("width", [1, 2, 4])
@pytest.mark.parametrize(
    ("kind", "faces"),
    [
        (1, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),  # strip: every other one is turned
        (2, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),  # fan
        (3, [[0, 1, 3, 2]]),  # quadrilaterals of a strip
        (4, [[0, 1, 2, 3, 4]]),  # polygon
    ],
)
def test_mesh_primitives(tmp_path: Path, kind: int, faces: list[list[int]], width: int) -> None:
    made = load(tmp_path, database(thing("o", mesh_record(kind, [0, 1, 2, 3, 4], width))))
    mesh = made.mesh
    assert mesh.face_counts.tolist() == [len(f) for f in faces]
    points = mesh.points[mesh.face_indices]
    wanted = [[i, i * i, 0] for f in faces for i in f]
    assert points.tolist() == wanted
    assert not made.report.codes()


def test_colours_of_a_mesh(tmp_path: Path) -> None:
    made = load(tmp_path, database(thing("o", mesh_record(4, [0, 1, 2], mask=0xA0000000))))
    assert made.mesh.colors is not None
    codes = np.rint(made.mesh.colors[:, :3] * 255).tolist()
    assert codes == [[0, 20, 30], [10, 20, 30], [20, 20, 30]]


def test_a_mesh_that_declares_too_much(tmp_path: Path) -> None:
    own = node(84, "m", 84, {52: b"\x02"})
    pool = record(85, struct.pack(">II3d", 2**32 - 1, 0x80000000, 0, 0, 0))
    part = record(86, struct.pack(">hHI3B", 4, 1, 2**32 - 1, 0, 0, 9))
    made = load(tmp_path, database(thing("o", own + pool + inside(part))))
    assert made.scene.meshes == []
    assert made.report.codes() == {"flt-count", "flt-vertex"}


# --- colours and materials ----------------------------------------------------------------


def test_a_face_reflects_material_times_colour(tmp_path: Path) -> None:
    palettes = colors({5: (255, 127, 0)}) + material(
        2, "paint", ambient=(1, 1, 1), diffuse=(0.5, 0.5, 0.5), specular=(0.1, 0.2, 0.3),
        emission=(0.4, 0.5, 0.6), shininess=20.0, alpha=0.5,
    )  # fmt: skip
    made = dressed(tmp_path, palettes, material=2, color=color_index(5), transparency=0x8000)
    got = made.material
    assert got.name == "paint"
    assert got.diffuse == pytest.approx((0.5, 0.5 * 127 / 255, 0.0), abs=1e-6)
    assert got.ambient == pytest.approx((1.0, 127 / 255, 0.0), abs=1e-6)
    assert got.specular == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)
    assert got.emission == pytest.approx((0.4, 0.5, 0.6), abs=1e-6)
    assert (got.shininess, got.alpha_mode, got.lit) == (20.0, "blend", True)
    assert got.alpha == pytest.approx(0.25, abs=0.5 / 255)  # transparency has 8 bits here


def test_intensity_of_a_colour_index(tmp_path: Path) -> None:
    """64 of 127 steps."""
    made = dressed(tmp_path, colors({3: (255, 255, 255)}), color=color_index(3, 64))
    assert made.material.diffuse == pytest.approx((64 / 127,) * 3, abs=1e-6)


def test_colours_of_old_revisions(tmp_path: Path) -> None:
    """Before 15.1 the index has 16 bits and stands where the colour's name is now."""
    pool = Pool()
    own = bytearray(face(pool.square()))
    own[20:22] = struct.pack(">H", color_index(5))
    content = database(
        thing("o", bytes(own)), palettes=colors({5: (0, 255, 0)}), vertices=pool.data, version=1420
    )
    assert load(tmp_path, content).material.diffuse == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("fields", "color"),
    [
        ({"packed": (255, 51, 0)}, (1.0, 0.2, 0.0)),
        ({"color": -1}, (1.0, 1.0, 1.0)),
        ({"color": color_index(5), "flags": 0x40000000}, (1.0, 1.0, 1.0)),  # no colour
        ({"color": color_index(5), "white": True}, (0.0, 0.0, 1.0)),  # without a texture
        ({"color": color_index(5), "white": True, "texture": 0}, (1.0, 1.0, 1.0)),
    ],
)
def test_which_colour(
    tmp_path: Path, fields: dict[str, object], color: tuple[float, float, float]
) -> None:
    palettes = colors({5: (0, 0, 255)}) + texture(0, "none.rgb")
    made = dressed(tmp_path, palettes, **fields)
    assert made.material.diffuse == pytest.approx(color, abs=1e-6)


@pytest.mark.parametrize(("mode", "lit"), [(0, False), (1, False), (2, True), (3, True)])
def test_light_modes(tmp_path: Path, mode: int, lit: bool) -> None:
    """0 and 1 are not illuminated: their colour is shown, whatever the material's."""
    palettes = colors({5: (255, 0, 0)}) + material(0, "m", diffuse=(0.5, 0.5, 0.5))
    made = dressed(tmp_path, palettes, mode=mode, color=color_index(5), material=0)
    assert made.material.lit is lit
    assert made.material.diffuse == ((0.5, 0.0, 0.0) if lit else (1.0, 0.0, 0.0))


def test_objects_that_are_not_illuminated_or_transparent(tmp_path: Path) -> None:
    pool = Pool()
    own = thing("o", face(pool.square()), flags=0x10000000, transparency=0xFFFF // 2)
    made = load(tmp_path, database(own, vertices=pool.data))
    assert (made.material.lit, made.material.alpha_mode) == (False, "blend")
    assert made.material.alpha == pytest.approx(0.5, abs=0.5 / 255)


def test_vertex_colours_and_the_faces_where_they_lack(tmp_path: Path) -> None:
    pool = Pool()
    corners = pool.add(
        *(vertex(p, packed=(51 * i, 0, 0)) for i, p in enumerate(SQUARE[:3])), vertex(SQUARE[3])
    )
    own = face(corners, mode=3, color=color_index(5))
    content = database(thing("o", own), palettes=colors({5: (0, 255, 0)}), vertices=pool.data)
    made = load(tmp_path, content)
    assert made.material.diffuse == (1.0, 1.0, 1.0)
    assert made.mesh.colors_interpolation == "faceVarying"
    assert made.mesh.colors is not None
    wanted = [[0, 0, 0, 1], [0.2, 0, 0, 1], [0.4, 0, 0, 1], [0, 1, 0, 1]]
    np.testing.assert_allclose(made.mesh.colors, wanted, atol=1e-6)


@pytest.mark.parametrize("count", [8, 9])
def test_many_colours_of_faces_become_colours_of_corners(tmp_path: Path, count: int) -> None:
    pool = Pool()
    faces = [face(pool.square(i), packed=(10 * i, 0, 0)) for i in range(count)]
    made = load(tmp_path, database(thing("o", *faces), vertices=pool.data))
    if count == 8:
        assert len(made.scene.materials) == 8
        assert [s.faces.tolist() for s in made.mesh.subsets] == [[i] for i in range(8)]
        assert made.scene.materials[3].name == "color_1e0000"
    else:
        assert made.material.diffuse == (1.0, 1.0, 1.0)
        assert made.mesh.colors is not None
        codes = np.rint(made.mesh.colors[::4, 0] * 255).tolist()
        assert codes == [10 * i for i in range(count)]


def test_what_the_palettes_do_not_have(tmp_path: Path) -> None:
    made = dressed(tmp_path, material=7, texture=9)
    texts = [f.text for f in made.report]
    assert texts == [
        "material 7 is not in the palette; 1 faces are without",
        "texture 9 is not in the palette; 1 faces are without",
    ]
    assert made.material.diffuse_map is None


def test_a_texture_without_coordinates(tmp_path: Path) -> None:
    pool = Pool()
    own = thing("o", face(pool.square(), texture=0))
    made = load(tmp_path, database(own, palettes=texture(0, "no.rgb"), vertices=pool.data))
    assert made.mesh.uvs["st"][0].tolist() == [[0, 0]] * 4
    assert made.finding("flt-no-coordinates").kind is Kind.MISSING


def test_billboards_are_at_rest_and_blended(tmp_path: Path) -> None:
    made = dressed(tmp_path, template=4)
    assert made.material.alpha_mode == "blend"
    assert made.finding("flt-billboard").kind is Kind.REPLACED
