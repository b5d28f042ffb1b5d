"""Meshes of 3D Studio: faces, materials, smoothing groups; where the keyframer puts them."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from tds_builder import (
    IDENTITY,
    OBJECT_NODE,
    SQUARE,
    SQUARE_FACES,
    chunk,
    color,
    faces,
    file,
    floats,
    load_bytes,
    material,
    mesh,
    node,
    points,
    position,
    rotation,
    scale,
    square,
    text,
    wears,
    words,
    world_points,
)

from hdrusd.importers.importer import IMPORTERS, SUFFIXES
from hdrusd.legacy.scene import TRS
from hdrusd.report import Kind

#: A cube around the origin, corners by the bits of their number, outward faces.
CUBE = [tuple(2.0 * (i >> axis & 1) - 1.0 for axis in range(3)) for i in range(8)]
CUBE_FACES = [
    *((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4)),
    *((2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)),
]


def smoothing(*groups: int) -> bytes:
    """A SMOOTH_GROUP."""
    return chunk(0x4150, struct.pack(f"<{len(groups)}I", *groups))


def cube(*groups: int) -> bytes:
    """The cube with a smoothing group for each face."""
    return mesh("Cube", points(CUBE), faces(CUBE_FACES, smoothing(*groups)))


def test_the_format_is_registered() -> None:
    assert SUFFIXES[".3ds"] == "3ds"
    assert "3ds" in IMPORTERS.names()


def test_a_square_stands_in_the_world_with_z_up(tmp_path: Path) -> None:
    loaded = load_bytes(tmp_path, file(material("m"), square("Square", wears("m", 0, 1))))
    assert (loaded.scene.format, loaded.scene.up, loaded.scene.unit_m) == ("3ds", "Z", 1.0)
    assert loaded.mesh.points.tolist() == [list(map(float, row)) for row in SQUARE]
    assert loaded.mesh.face_counts.tolist() == [3, 3]
    assert loaded.mesh.face_indices.tolist() == [0, 1, 2, 0, 2, 3]
    assert (loaded.mesh.material, loaded.mesh.subsets) == (0, ())
    assert (loaded.root.name, loaded.root.transform, loaded.root.meshes) == ("Square", None, [0])
    assert loaded.report.codes() == {"3ds-units"}


def test_master_scale_is_metres_a_unit(tmp_path: Path) -> None:
    loaded = load_bytes(tmp_path, file(chunk(0x0100, floats(0.0254)), square()))
    assert loaded.scene.unit_m == pytest.approx(0.0254)
    assert "1 unit = 0.0254 m" in loaded.finding("3ds-units").text
    for wrong in (0.0, -1.0, 1e30, math.nan):
        loaded = load_bytes(tmp_path, file(chunk(0x0100, floats(wrong)), square()))
        assert loaded.scene.unit_m == 1.0
        assert {"3ds-master-scale", "3ds-value"} & loaded.report.codes()


def test_ambient_light_is_the_scenes_and_nobodys_emission(tmp_path: Path) -> None:
    content = file(color(0x2100, 0.25, 0.5, 1.0), material("m"), square("S", wears("m", 0, 1)))
    loaded = load_bytes(tmp_path, content)
    assert loaded.scene.ambient == (0.25, 0.5, 1.0)
    assert (loaded.material.ambient, loaded.material.emission) == ((0.2,) * 3, (0.0,) * 3)


def test_materials_become_subsets_and_bare_faces_are_said(tmp_path: Path) -> None:
    parts = (wears("red", 0), wears("gone", 2))
    three = mesh("T", points([*SQUARE, (2, 2, 2)]), faces([*SQUARE_FACES, (0, 1, 4)], *parts))
    loaded = load_bytes(tmp_path, file(three, material("red", color(0xA020, 1, 0, 0))))
    names = {
        loaded.scene.materials[subset.material].name: subset.faces.tolist()
        for subset in loaded.mesh.subsets
    }
    assert names == {"red": [0], "gone": [2], "3ds_default": [1]}
    assert loaded.finding("3ds-material").kind is Kind.MISSING
    assert loaded.finding("3ds-material-none").text.startswith("1 faces")


def test_a_face_with_two_materials_wears_the_last(tmp_path: Path) -> None:
    parts = (wears("a", 0, 1), wears("b", 1, 7))
    loaded = load_bytes(tmp_path, file(material("a"), material("b"), square("S", *parts)))
    assert [subset.faces.tolist() for subset in loaded.mesh.subsets] == [[0], [1]]
    assert loaded.finding("3ds-face-material").text.startswith("1 faces of b")
    assert loaded.finding("3ds-face-number").text.startswith("1 faces of b")


def test_texture_coordinates_run_up_and_stay_at_their_points(tmp_path: Path) -> None:
    uvs = ((0, 0), (2, 0), (2, 1), (0, 1))
    content = mesh("S", points(SQUARE), points(uvs, 0x4140), faces(SQUARE_FACES))
    values, interpolation = load_bytes(tmp_path, file(content)).mesh.uvs["st"]
    assert (values.tolist(), interpolation) == ([[0, 0], [2, 0], [2, 1], [0, 1]], "vertex")


@pytest.mark.parametrize("groups", [(), (0,) * 12])
def test_faces_in_no_group_are_flat(tmp_path: Path, groups: tuple[int, ...]) -> None:
    content = cube(*groups) if groups else mesh("Cube", points(CUBE), faces(CUBE_FACES))
    assert load_bytes(tmp_path, file(content)).mesh.normals is None


def test_a_smooth_cube_has_the_diagonals_as_normals(tmp_path: Path) -> None:
    """By angle, a square counts once however it is cut: (1, 1, 1) / sqrt 3 at each corner."""
    found = load_bytes(tmp_path, file(cube(*(1,) * 12))).mesh
    assert found.normals is not None
    assert found.normals_interpolation == "faceVarying"
    wanted = found.points[found.face_indices] / math.sqrt(3.0)
    np.testing.assert_allclose(found.normals, wanted, atol=3e-7)


def test_sides_in_groups_of_their_own_keep_their_edges(tmp_path: Path) -> None:
    found = load_bytes(tmp_path, file(cube(*(1 << side for side in range(6) for _ in "ab")))).mesh
    assert found.normals is not None
    side = np.repeat(np.eye(3)[[2, 2, 1, 1, 0, 0]] * np.tile([[-1], [1]], (3, 1)), 6, axis=0)
    np.testing.assert_allclose(found.normals, side, atol=1e-7)


def test_faces_that_share_one_of_several_groups_are_smooth(tmp_path: Path) -> None:
    """Bottom in 1, top in 2, one wall in both: the wall is smooth to both, they are to it."""
    groups = [1, 1, 2, 2, 3, 3, *(0,) * 6]
    found = load_bytes(tmp_path, file(cube(*groups))).mesh
    assert found.normals is not None
    at = found.normals.reshape(-1, 3, 3)
    half = math.sqrt(0.5)
    np.testing.assert_allclose(at[4, 0], (0, -half, -half), atol=1e-6)  # wall, below
    np.testing.assert_allclose(at[4, 2], (0, -half, half), atol=1e-6)  # wall, above
    np.testing.assert_allclose(at[6], [(0, 1, 0)] * 3, atol=1e-7)  # the wall behind is flat


def test_flat_shading_ignores_groups(tmp_path: Path) -> None:
    flat = material("flat", chunk(0xA100, words(1)))
    parts = (wears("flat", *range(12)), smoothing(*(1,) * 12))
    content = file(flat, mesh("Cube", points(CUBE), faces(CUBE_FACES, *parts)))
    assert load_bytes(tmp_path, content).mesh.normals is None


def test_faces_back_to_back_keep_their_own_normals(tmp_path: Path) -> None:
    both = mesh("S", points(SQUARE), faces([(0, 1, 2), (0, 2, 1)], smoothing(1, 1)))
    found = load_bytes(tmp_path, file(both)).mesh
    assert found.normals is not None
    np.testing.assert_allclose(found.normals, [(0, 0, 1)] * 3 + [(0, 0, -1)] * 3, atol=1e-7)


def test_hidden_objects_and_what_has_no_home(tmp_path: Path) -> None:
    flags = chunk(0x4010) + chunk(0x4012)
    hidden = mesh("H", points(SQUARE), faces(SQUARE_FACES, flags=0xF), flags=flags)
    loaded = load_bytes(tmp_path, file(hidden, chunk(0x2201), chunk(0x9999, b"abc")))
    assert not loaded.root.visible
    dropped = {
        str(finding.source).split(", ")[1]: finding.thing
        for finding in loaded.findings("3ds-dropped")
    }
    assert dropped == {"OBJ_DOESNT_CAST": "H", "USE_FOG": ""}
    unknown = loaded.finding("3ds-unknown")
    assert unknown.source.place == f"byte {len(file(hidden, chunk(0x2201)))}, 0x9999"
    assert unknown.text.startswith("unknown chunk of 3 bytes")
    assert loaded.finding("3ds-face-wrap").text.startswith("2 faces")


# -- the keyframer --------------------------------------------------------------------------


def still(place: tuple[float, ...] = (0, 0, 0), turn: tuple[float, ...] = (0, 0, 0, 1)) -> bytes:
    """Tracks of one key."""
    return position((0, place)) + rotation((0, turn)) + scale((0, (1, 1, 1)))


def test_what_stands_as_in_the_editor_has_its_points_there(tmp_path: Path) -> None:
    """A frame at (5, 6, 7), turned by a quarter about Z: the keyframer says the same."""
    matrix = (0, 1, 0, -1, 0, 0, 0, 0, 1, 5, 6, 7)
    tracks = still((5, 6, 7), (math.pi / 2, 0, 0, -1))
    content = file(square("S", matrix=matrix), keyframer=[node(OBJECT_NODE, "S", 0, tracks)])
    loaded = load_bytes(tmp_path, content)
    np.testing.assert_allclose(world_points(loaded)["S"], SQUARE, atol=1e-6)
    # and the mesh itself stands about its own origin: world (0, 0, 0) is (-6, 5, -7) there
    np.testing.assert_allclose(loaded.mesh.points[0], (-6, 5, -7), atol=1e-6)


def test_angles_turn_clockwise_as_their_axis_points(tmp_path: Path) -> None:
    tracks = still((0, 0, 0), (math.pi / 2, 0, 0, 1))
    content = file(square("S"), keyframer=[node(OBJECT_NODE, "S", 0, tracks)])
    moved = world_points(load_bytes(tmp_path, content))["S"]
    np.testing.assert_allclose(moved[1], (0, -1, 0), atol=1e-6)  # +X goes to -Y


def test_a_pivot_is_where_the_place_is_and_turns_go_about(tmp_path: Path) -> None:
    parts = chunk(0xB013, floats(1, 1, 0)) + still((1, 1, 0), (math.pi, 0, 0, 1))
    content = file(square("S"), keyframer=[node(OBJECT_NODE, "S", 0, parts)])
    loaded = load_bytes(tmp_path, content)
    np.testing.assert_allclose(world_points(loaded)["S"][0], (2, 2, 0), atol=1e-6)
    (inner,) = loaded.root.children
    assert inner.transform == TRS((-1.0, -1.0, 0.0))


def test_a_mirrored_frame_keeps_its_points(tmp_path: Path) -> None:
    """The keyframer of a mirrored object has no mirror; its points must not move."""
    matrix = (-1, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0, 0)
    content = file(
        square("S", matrix=matrix), keyframer=[node(OBJECT_NODE, "S", 0, still((3, 0, 0)))]
    )
    np.testing.assert_allclose(world_points(load_bytes(tmp_path, content))["S"], SQUARE, atol=1e-6)


def test_children_hang_on_their_parents_and_instances_share_a_mesh(tmp_path: Path) -> None:
    dummy = node(OBJECT_NODE, "$$$DUMMY", 7, chunk(0xB011, text("car")), still((10, 0, 0)))
    wheels = [
        node(OBJECT_NODE, "S", i, chunk(0xB011, text(f"wheel{i}")), still((0, i, 0)), parent=7)
        for i in (1, 2)
    ]
    loaded = load_bytes(tmp_path, file(square("S"), keyframer=[*wheels, dummy]))
    assert loaded.root.name == "car"
    assert [child.name for child in loaded.root.children] == ["wheel1", "wheel2"]
    assert [child.meshes for child in loaded.root.children] == [[0], [0]]
    assert len(loaded.scene.meshes) == 1
    assert loaded.root.transform == TRS((10.0, 0.0, 0.0))


def test_without_numbers_parents_count_in_order(tmp_path: Path) -> None:
    header = chunk(0xB010, text("S"), words(0, 0, 0xFFFF))
    below = chunk(0xB010, text("T"), words(0, 0, 0))
    nodes = [chunk(OBJECT_NODE, header, still()), chunk(OBJECT_NODE, below, still((0, 0, 4)))]
    loaded = load_bytes(tmp_path, file(square("S"), square("T"), keyframer=nodes))
    assert [child.name for child in loaded.root.children] == ["T"]


def test_objects_that_the_keyframer_leaves_out_are_there(tmp_path: Path) -> None:
    nodes = [node(OBJECT_NODE, "S", 0, still()), node(OBJECT_NODE, "gone", 1, still())]
    loaded = load_bytes(tmp_path, file(square("S"), square("T"), keyframer=nodes))
    assert [root.name for root in loaded.scene.roots] == ["S", "gone", "T"]
    assert loaded.finding("3ds-object").thing == "gone"


def test_hidden_nodes_and_hide_keys(tmp_path: Path) -> None:
    hide = chunk(0xB029, struct.pack("<H8xI", 0, 2), struct.pack("<IHIH", 0, 0, 30, 0))
    nodes = [
        node(OBJECT_NODE, "S", 0, still(), flags=0x0800),
        node(OBJECT_NODE, "T", 1, still(), hide),
    ]
    loaded = load_bytes(tmp_path, file(square("S"), square("T"), keyframer=nodes))
    assert [root.visible for root in loaded.scene.roots] == [False, False]
    assert "hidden and shown" in loaded.finding("3ds-track-dropped").text


def test_motion_is_thirty_frames_a_second(tmp_path: Path) -> None:
    tracks = position((0, (0, 0, 0)), (60, (6, 0, 0)), flags=3)
    content = file(square("S"), keyframer=[node(OBJECT_NODE, "S", 0, tracks)])
    loaded = load_bytes(tmp_path, content)
    (channel,) = loaded.root.animation
    assert (channel.path, channel.loop) == ("translation", "loop")
    assert channel.times.tolist() == [0.0, 2.0]  # two keys are a straight line
    assert channel.values.tolist() == [[0, 0, 0], [6, 0, 0]]
    assert loaded.finding("3ds-frame-rate").kind is Kind.ASSUMED


def test_a_node_without_tracks_stands_in_its_own_frame(tmp_path: Path) -> None:
    matrix = (0, 2, 0, -2, 0, 0, 0, 0, 2, 5, 6, 7)
    content = file(square("S", matrix=matrix), keyframer=[node(OBJECT_NODE, "S", 0)])
    np.testing.assert_allclose(world_points(load_bytes(tmp_path, content))["S"], SQUARE, atol=1e-6)


def test_a_frame_without_volume_is_left_alone(tmp_path: Path) -> None:
    flat = (*IDENTITY[:6], 0, 0, 0, 0, 0, 0)
    content = file(
        square("S", matrix=flat), keyframer=[node(OBJECT_NODE, "S", 0, still((9, 9, 9)))]
    )
    loaded = load_bytes(tmp_path, content)
    np.testing.assert_array_equal(world_points(loaded)["S"], SQUARE)
    assert loaded.finding("3ds-matrix").kind is Kind.INVALID


def test_nodes_below_themselves_are_cut(tmp_path: Path) -> None:
    nodes = [
        node(OBJECT_NODE, "S", 1, still(), parent=2),
        node(OBJECT_NODE, "T", 2, still(), parent=1),
        node(OBJECT_NODE, "U", 3, still(), parent=9),
    ]
    content = file(square("S"), square("T"), square("U"), keyframer=nodes)
    loaded = load_bytes(tmp_path, content)
    assert sorted(world_points(loaded)) == ["S", "T", "U"]
    assert loaded.finding("3ds-cycle").kind is Kind.INVALID
    assert loaded.finding("3ds-parent").kind is Kind.MISSING
