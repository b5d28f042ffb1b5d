"""3D Studio files that are broken, hostile or from the wild: a scene with findings or InputError.

Counts of real files are those of another importer, assimp 6.0.5, and of the files' own chunks.
"""

from __future__ import annotations

import math
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tds_builder import (
    CAMERA_NODE,
    CAMERA_TARGET,
    OBJECT_NODE,
    SPOT_NODE,
    SQUARE,
    SQUARE_FACES,
    Loaded,
    camera,
    chunk,
    color,
    faces,
    file,
    floats,
    load,
    load_bytes,
    material,
    mesh,
    node,
    omni,
    percent,
    points,
    position,
    quick,
    rotation,
    scale,
    spot,
    square,
    text,
    texture,
    track,
    wears,
    words,
    world_points,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import TRS, Node
from hdrusd.report import Kind

SMOOTH = chunk(0x4150, struct.pack("<2I", 1, 3))
UVS = points([(0, 0), (1, 0), (1, 1), (0, 1)], 0x4140)
SPLINE = struct.pack("<H8xI", 2, 2) + struct.pack("<IH5f3f", 0, 31, 0, 0, 0, 0, 1, 1, 2, 3)

#: A file that has some of everything.
VALID = file(
    chunk(0x0100, floats(1.0)),
    color(0x2100, 0.1, 0.1, 0.2),
    material(
        "m",
        color(0xA020, 1, 0.5, 0.25),
        percent(0xA040, 30),
        percent(0xA084, 50),
        texture(0xA200, "gone.tga", chunk(0xA354, floats(2)), chunk(0xA35C, floats(30))),
        texture(0xA230, "bump.tga", chunk(0xA351, words(2))),
    ),
    mesh(
        "Square",
        points(SQUARE),
        UVS,
        chunk(0x4160, floats(0, 1, 0, -1, 0, 0, 0, 0, 1, 5, 6, 7)),
        faces(SQUARE_FACES, wears("m", 0, 1), SMOOTH),
    ),
    omni("Lamp", (0, 0, 5), chunk(0x0010, floats(1, 1, 1)), spot((1, 0, 0), 40, 60)),
    camera("Eye", (0, -9, 1), (0, 0, 0)),
    keyframer=[
        node(
            OBJECT_NODE,
            "Square",
            0,
            chunk(0xB013, floats(1, 0, 0)),
            chunk(0xB020, SPLINE, struct.pack("<IH3f", 9, 0, 4, 5, 6)),
            rotation((0, (1, 0, 0, 1)), (9, (2, 0, 1, 0))),
            scale((0, (1, 1, 1))),
        ),
        node(CAMERA_NODE, "Eye", 1, position((0, (0, -9, 1)), (9, (0, -8, 1))), parent=0),
        node(CAMERA_TARGET, "Eye", 2, position((0, (0, 0, 0)), (9, (0, 0, 1)))),
        node(SPOT_NODE, "Lamp", 3, track(0xB025, (0, (1, 1, 1)))),
    ],
)


def check(loaded: Loaded) -> None:
    """All that a reader promises of a scene."""
    scene = loaded.scene
    for found in scene.meshes:
        assert np.isfinite(found.points).all()
        assert found.face_counts.min() >= 3
        assert found.face_counts.sum() == found.face_indices.size
        assert np.unique(found.face_indices).tolist() == list(range(len(found.points)))
        if found.normals is not None:
            assert found.normals.shape == (found.face_indices.size, 3)
            np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0, atol=1e-5)
        for values, _ in found.uvs.values():
            assert len(values) == len(found.points)
            assert np.isfinite(values).all()
        worn = [] if found.material is None else [found.material]
        worn += [subset.material for subset in found.subsets]
        assert set(worn) <= set(range(len(scene.materials)))
    for light in scene.lights:
        assert all(map(math.isfinite, (*light.diffuse, light.spot_cutoff)))
        assert 0.0 <= light.spot_cutoff <= 180.0
    for eye in scene.cameras:
        assert 0.0 < eye.fov_y < 180.0
        assert 0.0 < eye.near < eye.far < math.inf
    stack: list[Node] = list(scene.roots)
    count = 0
    while stack:
        place = stack.pop()
        count += 1
        assert count < 1000  # a tree
        stack.extend(place.children)
        if isinstance(place.transform, TRS):
            numbers = (*place.transform.translation, *place.transform.scale)
            assert all(map(math.isfinite, numbers))
            assert math.hypot(*place.transform.rotation) == pytest.approx(1.0, abs=1e-6)
        for channel in place.animation:
            assert np.isfinite(channel.values).all()
            assert (np.diff(channel.times) > 0).all()
            assert len(channel.times) == len(channel.values)
    for finding in loaded.report:
        assert len(str(finding)) < 1000


def test_the_valid_file_is_whole(tmp_path: Path) -> None:
    loaded = load_bytes(tmp_path, VALID)
    check(loaded)
    assert loaded.scene.counts() == {
        "meshes": 1,
        "triangles": 2,
        "materials": 1,
        "textures": 1,
        "lights": 1,
        "cameras": 1,
    }
    assert {finding.kind for finding in loaded.report} <= {
        Kind.ASSUMED,
        Kind.REPLACED,
        Kind.DROPPED,
        Kind.MISSING,
    }


@pytest.mark.parametrize("size", range(0, len(VALID), 7))
def test_truncations(tmp_path: Path, size: int) -> None:
    try:
        loaded = load_bytes(tmp_path, VALID[:size])
    except InputError:
        return
    check(loaded)
    assert "3ds-chunk-length" in loaded.report.codes()


@quick
@given(st.data())
def test_mutated_bytes_end_in_a_scene_or_an_input_error(
    tmp_path: Path, data: st.DataObject
) -> None:
    content = bytearray(VALID)
    for _ in range(data.draw(st.integers(1, 8))):
        begin = data.draw(st.integers(0, len(content) - 1))
        piece = data.draw(
            st.binary(min_size=1, max_size=4)
            | st.sampled_from(
                [b"\xff\xff", b"\0\0\xc0\x7f", b"\1\0\x80\x7f", b"\xff\xff\x7f\x7f", b"\0\0\0\0"]
            )
        )
        content[begin : begin + len(piece)] = piece
    try:
        check(load_bytes(tmp_path, bytes(content)))
    except InputError:
        return


@quick
@given(st.binary(max_size=200))
def test_any_bytes_behind_the_first_chunk(tmp_path: Path, body: bytes) -> None:
    for parts in ((body,), (chunk(0x3D3D, body),), (chunk(0x3D3D), chunk(0xB000, body))):
        try:
            check(load_bytes(tmp_path, chunk(0x4D4D, *parts)))
        except InputError:
            continue


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"", "0 bytes"),
        (b"MM", "2 bytes"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "0x5089"),
        (b"# obj\nv 0 0 0\n", "want 0x4D4D"),
        (file(), "no mesh"),
        (file(keyframer=[node(OBJECT_NODE, "S", 0)]), "no mesh"),
    ],
)
def test_what_is_no_3ds_is_refused(tmp_path: Path, content: bytes, match: str) -> None:
    with pytest.raises(InputError, match=match) as error:
        load_bytes(tmp_path, content)
    assert "model.3ds" in str(error.value)


def test_declared_lengths_and_counts_are_not_believed(tmp_path: Path) -> None:
    """Every length and count at its largest: no memory for what is not there, no hang."""
    square_chunk = square("S", wears("m", 0, 1), SMOOTH)
    whole = file(material("m"), square_chunk)
    cases = []
    for tag in (0x4D4D, 0x3D3D, 0x4000, 0x4100, 0x4110, 0x4120, 0x4130, 0xAFFF):
        at = whole.index(struct.pack("<H", tag))
        cases.append(whole[: at + 2] + b"\xff\xff\xff\xff" + whole[at + 6 :])
        cases.append(whole[: at + 2] + b"\0\0\0\0" + whole[at + 6 :])
    counts = [whole.index(struct.pack("<H", tag)) + 6 for tag in (0x4110, 0x4120)]
    cases += [whole[:at] + b"\xff\xff" + whole[at + 2 :] for at in counts]
    tracemalloc.start()
    for content in cases:
        try:
            check(load_bytes(tmp_path, content))
        except InputError:
            continue
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8 << 20


def test_arrays_that_are_cut_off_drop_their_mesh_alone(tmp_path: Path) -> None:
    short = chunk(0x4110, words(9), floats(0, 0, 0))
    loaded = load_bytes(tmp_path, file(mesh("S", short, faces(SQUARE_FACES)), square("T")))
    assert [found.name for found in loaded.scene.meshes] == ["T"]
    assert loaded.finding("3ds-array").text.startswith("9 rows declared, 1 are there")


def test_faces_with_bad_points_are_dropped_and_counted(tmp_path: Path) -> None:
    rows = [*SQUARE, (math.nan, 0, 0), (0, math.inf, 0)]
    some = [*SQUARE_FACES, (0, 1, 4), (0, 1, 5), (0, 1, 6), (9, 9, 9)]
    loaded = load_bytes(tmp_path, file(mesh("S", points(rows), faces(some))))
    check(loaded)
    assert loaded.mesh.face_counts.tolist() == [3, 3]
    assert loaded.finding("3ds-face-index").text.startswith("2 faces")
    assert loaded.finding("3ds-face-point").text.startswith("2 faces")
    empty = load_bytes(tmp_path, file(mesh("S", points(rows), faces([(9, 9, 9)])), material("m")))
    assert empty.finding("3ds-no-faces").thing == "S"


def test_texture_coordinates_that_do_not_fit(tmp_path: Path) -> None:
    few = mesh("S", points(SQUARE), points([(0, 0)], 0x4140), faces(SQUARE_FACES))
    loaded = load_bytes(tmp_path, file(few))
    assert loaded.mesh.uvs == {}
    broken = points([(0, 0), (math.nan, 0), (1, 1), (0, 1)], 0x4140)
    loaded = load_bytes(tmp_path, file(mesh("S", points(SQUARE), broken, faces(SQUARE_FACES))))
    assert loaded.mesh.uvs["st"][0][1].tolist() == [0, 0]
    assert loaded.finding("3ds-texcoords").kind is Kind.INVALID


def test_very_many_smoothing_groups_end_soon(tmp_path: Path) -> None:
    fan = [(0, i % 60000 + 1, i % 60000 + 2) for i in range(60000)]
    rows = np.zeros((60003, 3), "<f4")
    rows[:, 0], rows[:, 1] = np.arange(60003) % 7, np.arange(60003) % 5
    groups = chunk(0x4150, np.arange(1, 60001, dtype="<u4").tobytes())
    array = chunk(0x4110, words(60003), rows.tobytes())
    loaded = load_bytes(tmp_path, file(mesh("S", array, faces(fan, groups))))
    check(loaded)
    assert loaded.finding("3ds-smoothing").kind is Kind.REPLACED


def test_limits(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="more than 5 points and faces"):
        load_bytes(tmp_path, file(square()), Limits(vertices=5))
    with pytest.raises(InputError, match="more than 20 chunks"):
        load_bytes(tmp_path, file(square(), chunk(0x9999) * 30), Limits(nodes=20))
    chain = [node(OBJECT_NODE, "S", i, parent=i - 1 if i else 0xFFFF) for i in range(300)]
    with pytest.raises(InputError, match="nested deeper than 256"):
        load_bytes(tmp_path, file(square("S"), keyframer=chain))
    backwards = [node(OBJECT_NODE, "S", i, parent=i + 1 if i < 299 else 0xFFFF) for i in range(300)]
    with pytest.raises(InputError, match="nested deeper than 256"):
        load_bytes(tmp_path, file(square("S"), keyframer=backwards))


def test_names_of_any_kind(tmp_path: Path) -> None:
    latin = chunk(0x4000, b"Stra\xdfe\0", chunk(0x4100, points(SQUARE), faces(SQUARE_FACES)))
    endless = chunk(0x4000, b"x" * 9999, b"\0", chunk(0x4100, points(SQUARE), faces(SQUARE_FACES)))
    loaded = load_bytes(tmp_path, file(latin, endless, square(""), square("../a")))
    check(loaded)
    assert [root.name for root in loaded.scene.roots] == ["Straße", "x" * 4096, "", "../a"]
    assert loaded.finding("encoding").kind is Kind.ASSUMED


@pytest.mark.parametrize("name", ["/dev/zero", "..\\..\\secret.tga", "C:\\maps\\a.tga", "a\nb.tga"])
def test_texture_names_stay_inside(tmp_path: Path, name: str) -> None:
    content = file(material("m", texture(0xA200, name)), square("S", wears("m", 0, 1)))
    found = load_bytes(tmp_path, content).material.diffuse_map
    assert found is not None
    assert found.image.missing
    assert found.image.name == name


def test_a_second_object_of_a_name_does_not_count(tmp_path: Path) -> None:
    loaded = load_bytes(tmp_path, file(square("S"), square("S"), omni("S", (0, 0, 0))))
    assert len(loaded.scene.meshes) == 1
    assert len(loaded.findings("3ds-duplicate")) == 2


def test_trailing_bytes_and_a_short_length(tmp_path: Path) -> None:
    content = bytearray(file(square()) + b"\0\0\0")
    loaded = load_bytes(tmp_path, bytes(content))
    assert {"3ds-length", "3ds-trailing"} <= loaded.report.codes()
    assert len(loaded.scene.meshes) == 1


def test_a_string_at_the_end_of_its_chunk(tmp_path: Path) -> None:
    content = file(square("S"), chunk(0xAFFF, chunk(0xA000, b"abc")), chunk(0x4000, text("e")))
    loaded = load_bytes(tmp_path, content)
    assert "abc" in {material.name for material in loaded.scene.materials}
    assert loaded.findings("3ds-value")


# -- real and hostile files ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "meshes", "triangles", "materials", "textures", "lights", "cameras"),
    [
        ("assimp/3DS/RotatingCube.3DS", 1, 12, 1, 0, 0, 0),
        ("assimp/3DS/TargetCameraAnim.3ds", 1, 12, 1, 0, 0, 1),
        ("assimp/3DS/cube_with_diffuse_texture.3DS", 1, 12, 1, 1, 0, 0),
        ("assimp/3DS/cubes_with_alpha.3DS", 5, 60, 5, 1, 0, 0),
        ("assimp/3DS/test1.3ds", 9, 108, 3, 3, 0, 0),
        ("delta3d/examples/data/StaticMeshes/exampleTerrain/terrain.3ds", 1, 11250, 1, 1, 0, 0),
        ("synthetic/night_street.3ds", 13, 62, 4, 1, 8, 1),
        ("hostile/trunc_box.3ds", 6, 72, 3, 3, 0, 0),  # of nine boxes six are whole
    ],
)
def test_counts_of_real_files(
    testdata: Path,
    name: str,
    meshes: int,
    triangles: int,
    materials: int,
    textures: int,
    lights: int,
    cameras: int,
) -> None:
    loaded = load(testdata / "data" / name)
    check(loaded)
    assert list(loaded.scene.counts().values()) == [
        meshes,
        triangles,
        materials,
        textures,
        lights,
        cameras,
    ]
    allowed = {Kind.ASSUMED, Kind.REPLACED, Kind.MISSING}
    if "hostile" not in name:
        assert {finding.kind for finding in loaded.report} <= allowed


def test_every_real_file_is_listed_above(testdata: Path) -> None:
    found = [path for path in (testdata / "data").rglob("*") if path.suffix.lower() == ".3ds"]
    assert len(found) == 8 + 1


def test_the_empty_file_is_refused(testdata: Path) -> None:
    with pytest.raises(InputError, match=r"empty\.3ds: 0 bytes; want a 3D Studio file"):
        load(testdata / "data" / "hostile" / "empty.3ds")


@pytest.mark.parametrize(
    "name", ["test1.3ds", "cubes_with_alpha.3DS", "cube_with_diffuse_texture.3DS"]
)
def test_what_stands_still_stands_where_the_editor_has_it(testdata: Path, name: str) -> None:
    """Points through the inverse matrix, pivot and tracks come back to where the file has them."""
    path = testdata / "data" / "assimp" / "3DS" / name
    data = path.read_bytes()
    loaded = load(path)
    for found, stands in world_points(loaded).items():
        at = data.index(found.encode() + b"\0")
        at = data.index(b"\x10\x41", at)
        (count,) = struct.unpack_from("<H", data, at + 6)
        wanted = np.frombuffer(data, "<f4", 3 * count, at + 8).reshape(-1, 3)
        assert len(stands) == count
        np.testing.assert_allclose(stands, wanted, atol=2e-6 * np.abs(wanted).max())


def test_the_night_street(testdata: Path) -> None:
    """What the file says, byte by byte: lamps of 100 and 140 degrees, one lamp off, a moon."""
    loaded = load(testdata / "data" / "synthetic" / "night_street.3ds")
    scene = loaded.scene
    lights = {light.name: light for light in scene.lights}
    sodium = [lights[f"Sod0{i}"] for i in range(6)]
    assert {(lamp.kind, lamp.spot_inner, lamp.spot_cutoff) for lamp in sodium} == {
        ("spot", 50.0, 70.0)
    }
    assert sodium[0].diffuse == pytest.approx((1.5, 1.17, 0.75))
    assert [name for name, light in lights.items() if not light.enabled] == ["OffLamp"]
    assert lights["Moon"].kind == "point"
    assert scene.ambient == pytest.approx((0.02, 0.02, 0.03))
    materials = {material.name: material for material in scene.materials}
    assert materials["LAMP"].emission == pytest.approx((1.0, 0.84, 0.6))
    assert materials["ASPHALT"].ambient == pytest.approx((0.1, 0.1, 0.1))
    assert materials["GLASS"].alpha == pytest.approx(0.4)
    asphalt = materials["ASPHALT"].diffuse_map
    assert asphalt is not None
    assert asphalt.transform is not None
    assert asphalt.transform.scale == (30.0, 2.0)
    assert asphalt.image.path is not None
    (driver,) = [root for root in scene.roots if root.cameras]
    move = {channel.path: channel for channel in driver.animation}["translation"]
    assert move.times.tolist() == [0.0, 100 / 30]
    np.testing.assert_allclose(move.values, [(1.8, -58, 1.2), (1.8, 58, 1.2)], rtol=1e-6)
