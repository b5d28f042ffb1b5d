"""glTF primitives that Draco has compressed: a grid with closed-form places, packed here.

Rules and names from the specification of KHR_draco_mesh_compression.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import load, load_doc
from gltf_compressed import (
    COLUMNS,
    DRACO,
    FACES,
    GRID,
    ROWS,
    Compressed,
    assert_is_grid,
    needs_draco,
    needs_meshopt,
    sound_or_told,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits

pytestmark = needs_draco

BITS = 14
#: Half a step of 2^14 - 1 over the side of 1, and float32.
CLOSE = 0.5 / (2**BITS - 1) + 2.0**-23


def pack(points: Any = GRID, faces: Any = FACES, **attributes: Any) -> tuple[bytes, int]:
    """A Draco mesh, and the unique id of its positions."""
    import DracoPy

    faces = None if faces is None else np.asarray(faces, np.uint32)
    packed = DracoPy.encode(points, faces, quantization_bits=BITS, **attributes)
    places = [a for a in DracoPy.decode(packed).attributes if a["attribute_type"] == 0]
    return packed, int(places[0]["unique_id"])


def grid(packed: bytes | None = None, **attributes: Any) -> Compressed:
    """The grid; accessors have no bytes of their own."""
    found, position = pack(**attributes)
    doc = Compressed(DRACO)
    points = doc.accessor(None, len(GRID), 5126, "VEC3")
    indices = doc.accessor(None, FACES.size, 5123, "SCALAR")
    doc.draco(packed or found, {"POSITION": position}, {"POSITION": points}, indices)
    return doc


@pytest.mark.parametrize("level", [0, 1, 7, 10])
def test_a_compressed_grid_is_the_grid(tmp_path: Path, level: int) -> None:
    scene, report = load_doc(tmp_path, grid(compression_level=level))
    mesh = scene.meshes[0]
    assert_is_grid(mesh, CLOSE)
    assert len(mesh.points) == COLUMNS * ROWS
    assert list(report) == []


def test_of_a_strip_the_triangles_are_decompressed(tmp_path: Path) -> None:
    doc = grid()
    doc.primitive["mode"] = 5
    doc.json["accessors"][1]["count"] = 100  # of the strip, which is not what is packed
    scene, report = load_doc(tmp_path, doc)
    assert_is_grid(scene.meshes[0], CLOSE)
    assert list(report) == []


def columns_and_rows(points: Any) -> Any:
    return np.rint(points[:, :2] * 8).astype(int)


def test_attributes_are_found_by_their_unique_id(tmp_path: Path) -> None:
    """Each is a function of the place, so their order may be any."""
    places = np.rint(GRID * 8)
    i, j, k = places[:, 0], places[:, 1], np.zeros(len(GRID))
    generic = {
        31: np.stack([i, j, k, k], axis=1).astype(np.uint8),
        7: np.stack([i / 8, 1 - i / 8, k, k], axis=1).astype(np.float32),
        12: np.stack([i * 8191, j * 16383, k], axis=1).astype(np.uint16),
        3: np.stack([i / 16, j / 16], axis=1).astype(np.float32),
    }
    packed, position = pack(generic_attributes=generic)
    doc = Compressed(DRACO)
    accessors = {
        "POSITION": doc.accessor(None, 45, 5126, "VEC3"),
        "JOINTS_0": doc.accessor(None, 45, 5123, "VEC4"),  # wider than what is packed
        "WEIGHTS_0": doc.accessor(None, 45, 5126, "VEC4"),
        "COLOR_0": doc.accessor(None, 45, 5123, "VEC3", normalized=True),
        "TEXCOORD_0": doc.accessor(None, 45, 5126, "VEC2"),
    }
    ids = {"JOINTS_0": 31, "WEIGHTS_0": 7, "COLOR_0": 12, "TEXCOORD_0": 3, "POSITION": position}
    doc.draco(packed, ids, accessors, doc.accessor(None, FACES.size, 5125, "SCALAR"))
    doc.json["nodes"] = [{"mesh": 0, "skin": 0}, *({} for _ in range(COLUMNS))]
    doc.json["skins"] = [{"joints": list(range(1, COLUMNS + 1))}]
    doc.json["scenes"] = [{"nodes": list(range(COLUMNS + 1))}]
    scene, report = load_doc(tmp_path, doc)
    assert list(report) == []
    [mesh] = scene.meshes
    i, j = columns_and_rows(mesh.points).T
    assert mesh.colors is not None
    red = mesh.colors.astype("f8") * 65535
    np.testing.assert_allclose(red[:, :2], np.stack([i * 8191, j * 16383], 1), rtol=2**-23)
    np.testing.assert_array_equal(mesh.uvs["st"][0], np.stack([i / 16, 1 - j / 16], axis=1))
    assert mesh.joint_indices is not None
    assert mesh.joint_weights is not None
    weighted = (mesh.joint_indices * mesh.joint_weights).sum(axis=1)
    np.testing.assert_allclose(weighted, (i * i + j * (8 - i)) / 8, rtol=2**-22, atol=1e-6)


@pytest.mark.parametrize("marked", [0, 1])
def test_signed_integers_are_divided_once(tmp_path: Path, marked: int) -> None:
    """Section 3.11: max(c / 127, -1), whether Draco calls them normalized or the accessor alone."""
    x = np.arange(45) - 22
    raw = np.stack([x, 0 * x, 127 - abs(x)], axis=1).astype(np.int8)
    packed, position = pack(generic_attributes={5: raw.view(np.uint8)}, preserve_order=True)
    head = bytes([4, 2, 3, 0, 5])  # a generic attribute of 3 uint8, not normalized, of id 5
    assert packed.count(head) == 1
    packed = packed.replace(head, bytes([4, 1, 3, marked, 5]))  # of int8
    doc = Compressed(DRACO)
    points = doc.accessor(None, 45, 5126, "VEC3")
    normals = doc.accessor(None, 45, 5120, "VEC3", normalized=True)
    indices = doc.accessor(None, FACES.size, 5123, "SCALAR")
    doc.draco(
        packed,
        {"POSITION": position, "NORMAL": 5},
        {"POSITION": points, "NORMAL": normals},
        indices,
    )
    scene, report = load_doc(tmp_path, doc)
    assert list(report) == []
    i, j = columns_and_rows(scene.meshes[0].points).T
    wanted = raw[j * COLUMNS + i].astype("f8") / 127
    np.testing.assert_allclose(scene.meshes[0].normals, wanted, rtol=2**-23)


def test_other_attributes_are_read_as_ever(tmp_path: Path) -> None:
    doc = grid(preserve_order=True)
    doc.primitive["attributes"]["TEXCOORD_0"] = doc.add(GRID[:, :2])
    mesh = load_doc(tmp_path, doc)[0].meshes[0]
    flipped = mesh.uvs["st"][0] * (1, -1) + (0, 1)
    np.testing.assert_allclose(flipped, mesh.points[:, :2], atol=CLOSE)


def test_primitives_may_share_what_is_packed(tmp_path: Path) -> None:
    """Under accessors of other types, in one mesh and in two."""
    columns = np.rint(GRID * 8).astype(np.uint8)
    packed, position = pack(generic_attributes={9: columns})
    doc = Compressed(DRACO)
    doc.draco(packed, {"POSITION": position}, {}, doc.accessor(None, FACES.size, 5123, "SCALAR"))
    shared = doc.primitive
    points = doc.accessor(None, 45, 5126, "VEC3")
    primitives = []
    for component in (5121, 5123, 5121):
        colour = doc.accessor(None, 45, component, "VEC3", normalized=True)
        extension = {
            **shared["extensions"][DRACO],
            "attributes": {"POSITION": position, "COLOR_0": 9},
        }
        attributes = {"POSITION": points, "COLOR_0": colour}
        more = {"attributes": attributes, "extensions": {DRACO: extension}}
        primitives.append({**shared, **more})
    doc.json["meshes"] = [{"primitives": primitives}, {"primitives": primitives[:1]}]
    doc.json["nodes"] = [{"mesh": 0}, {"mesh": 1}]
    scene, report = load_doc(tmp_path, doc)
    assert list(report) == []
    for mesh, largest in zip(scene.meshes, (255, 65535, 255, 255), strict=True):
        assert_is_grid(mesh, CLOSE)
        assert mesh.colors is not None
        found = mesh.colors[:, :2].astype("f8") * largest
        np.testing.assert_allclose(found, columns_and_rows(mesh.points), rtol=2**-23)


@needs_meshopt
def test_both_compressions_in_one_file(tmp_path: Path) -> None:
    doc = grid()
    doc.json["extensionsUsed"].append("EXT_meshopt_compression")
    points = doc.meshopt(GRID, "f4")
    indices = doc.meshopt(FACES.reshape(-1), "u2", "TRIANGLES")
    doc.json["meshes"].append({"primitives": [{"attributes": {"POSITION": points}}]})
    doc.primitive["indices"] = indices
    scene, report = load_doc(tmp_path, doc)
    assert "unplaced" not in report.codes()
    assert_is_grid(scene.meshes[0], CLOSE)
    assert_is_grid(scene.meshes[1])


# Fallback


def uncompressed_beside(required: bool) -> Compressed:
    """The grid packed, twice its size beside it."""
    packed, position = pack()
    doc = Compressed(DRACO)
    doc.json["extensionsRequired"] *= required
    points, indices = doc.add(GRID * 2), doc.add(FACES.reshape(-1), "u2")
    doc.draco(packed, {"POSITION": position}, {"POSITION": points}, indices)
    return doc


def test_what_is_compressed_comes_first(tmp_path: Path) -> None:
    scene, report = load_doc(tmp_path, uncompressed_beside(required=False))
    assert_is_grid(scene.meshes[0], CLOSE)
    assert list(report) == []


def test_without_draco_what_is_uncompressed_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = uncompressed_beside(required=False).write(tmp_path / "scene.gltf")
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    scene, report = load(path)
    np.testing.assert_array_equal(scene.meshes[0].points, GRID * 2)
    assert report.codes() == {"compression-fallback"}


@pytest.mark.parametrize("required", [True, False])
def test_without_draco_one_line_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, required: bool
) -> None:
    doc = uncompressed_beside(required)
    if not required:
        del doc.json["accessors"][0]["bufferView"]
    path = doc.write(tmp_path / "scene.gltf")
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    text = f"requires the extension {DRACO}, which is not read .*; want pip install 'hdrusd.draco.'"
    with pytest.raises(InputError, match=text) as caught:
        load(path)
    assert caught.value.exit_code == 3


# What is wrong


@pytest.mark.parametrize("count", [3, 44, 46, 4_000_000_000])
def test_what_is_packed_is_counted_not_what_is_declared(tmp_path: Path, count: int) -> None:
    doc = grid()
    doc.json["accessors"][0]["count"] = count
    scene, report = load_doc(tmp_path, doc)
    assert_is_grid(scene.meshes[0], CLOSE)
    assert [(f.code, f.source.place) for f in report] == [("draco-count", "/accessors/0")]


def test_a_point_cloud_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="point cloud; want triangles"):
        load_doc(tmp_path, grid(pack(faces=None)[0]))


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"bufferView": 9}, "no usable bufferView"),
        ({"bufferView": [0]}, "no usable bufferView"),
        ({"bufferView": None}, "no usable bufferView"),
        ({"attributes": {"POSITION": 99}}, "no such attribute"),
        ({"attributes": {"POSITION": 10**30}}, "no such attribute"),
        ({"attributes": {"POSITION": -1}}, "no data"),
        ({"attributes": {}}, "no data"),
        ({"attributes": 7}, "no data"),
    ],
)
def test_wrong_words_are_one_line(tmp_path: Path, changes: dict[str, Any], match: str) -> None:
    doc = grid()
    doc.primitive["extensions"][DRACO] |= changes
    with pytest.raises(InputError, match=match) as caught:
        load_doc(tmp_path, doc)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"type": "VEC2"}, "3 numbers an element"),
        ({"type": "BOX"}, "want SCALAR"),
        ({"componentType": 5124}, "a known componentType"),
        ({"componentType": 5121}, "do not fit the accessor's uint8"),
        ({"componentType": 5125}, "do not fit the accessor's uint32"),
    ],
)
def test_an_accessor_of_other_numbers_is_refused(
    tmp_path: Path, change: dict[str, Any], match: str
) -> None:
    doc = grid()
    doc.json["accessors"][0] |= change
    with pytest.raises(InputError, match=match):
        load_doc(tmp_path, doc)


def test_lying_counts_inside_a_stream_end_soon(tmp_path: Path) -> None:
    """The count of triangles is the first number after the head of 11 bytes, 7 bits a byte."""
    packed = pack(preserve_order=True)[0]
    assert packed[11:13] == bytes([FACES.size // 3, COLUMNS * ROWS])
    for lie in (b"\xff\xff\xff\xff\x0f", b"\xff\xff\xff\xff\x07", b"\x80\x80\x80\x7f"):
        for place in (11, 12):
            broken = packed[:place] + lie + packed[place + 1 :]
            with pytest.raises(InputError, match=r"decompress|decoder") as caught:
                load_doc(tmp_path, grid(broken), limits=Limits(worker_seconds=20))
            assert "\n" not in str(caught.value)


def test_one_broken_mesh_costs_itself(tmp_path: Path) -> None:
    doc = grid()
    packed, position = pack()
    doc.draco(packed[:60], {"POSITION": position}, {"POSITION": 0}, 1)
    scene, report = load_doc(tmp_path, doc)
    [mesh] = scene.meshes
    assert_is_grid(mesh, CLOSE)
    assert [(f.code, f.source.place) for f in report if f.kind == "invalid"] == [
        ("primitive-dropped", f"/meshes/1/primitives/0/extensions/{DRACO}")
    ]


MUTATION = st.tuples(st.integers(0, 10_000), st.integers(1, 255), st.integers(0, 3))


@settings(
    max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(MUTATION, min_size=30, max_size=60))
def test_broken_streams_read_or_end_in_an_input_error(
    tmp_path: Path, changes: list[tuple[int, int, int]]
) -> None:
    """Many streams a file, each with a byte flipped or its end cut."""
    packed, position = pack()
    doc = Compressed(DRACO)
    points = doc.accessor(None, len(GRID), 5126, "VEC3")
    indices = doc.accessor(None, FACES.size, 5123, "SCALAR")
    for place, flip, cut in changes:
        body = bytearray(packed)
        body[place % len(body)] ^= flip
        broken = bytes(body[: len(body) - cut])
        doc.draco(broken, {"POSITION": position}, {"POSITION": points}, indices)
    sound_or_told(doc.write(tmp_path / "scene.gltf"), len(changes))
