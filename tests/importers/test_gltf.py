"""glTF containers, buffers, accessors and primitives.

Numbers come from the glTF 2.0 specification, not from the reader.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import (
    LIGHTS,
    SQUARE,
    TRIANGLE,
    Doc,
    glb,
    load,
    load_doc,
    load_json,
    only_triangle,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits

# Container


def refused(tmp_path: Path, content: bytes, match: str) -> None:
    path = tmp_path / "broken.glb"
    path.write_bytes(content)
    with pytest.raises(InputError, match=match) as error:
        load(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"", "empty"),
        (b"glTF\2\0\0\0", "headers alone"),
        (struct.pack("<4sII", b"glTF", 1, 20) + bytes(8), "version 1"),
        (struct.pack("<4sII", b"glTF", 2, 100) + bytes(20), "cut short"),
        (
            struct.pack("<4sIII4s", b"glTF", 2, 24, 1 << 30, b"JSON") + b"{}  ",
            "chunk of 1073741824",
        ),
        (struct.pack("<4sIII4s", b"glTF", 2, 24, 4, b"BIN\0") + b"{}  ", "not JSON"),
        (b"{\n oops", r":2: not JSON"),
        (b"[" * 200_000, "nested too deeply"),
        (b'{"a": ' + b"9" * 5000 + b"}", "not JSON"),
        (b'{"asset": "\xff"}', "not UTF-8"),
        (b"[]", "no JSON object"),
        (b"{}", "version ''; want 2.x"),
        (b'{"asset": {"version": "1.0"}}', "version '1.0'; want 2.x"),
        (b'{"asset": {"version": "2.0", "minVersion": "2.1"}}', "minVersion"),
    ],
)
def test_a_broken_container_is_one_clear_line(tmp_path: Path, content: bytes, match: str) -> None:
    refused(tmp_path, content, match)


def test_glb_and_gltf_of_the_same_document_read_the_same(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path, TEXCOORD_0=TRIANGLE[:, :2])
    doc.json["asset"]["generator"] = "by hand"
    text, _ = load_doc(tmp_path, doc)
    path = tmp_path / "scene.glb"
    buffers = [{"byteLength": len(doc.body)}]
    path.write_bytes(glb({**doc.json, "buffers": buffers}, bytes(doc.body)) + b"tail")
    binary, report = load(path)
    assert text.generator == binary.generator == "by hand"
    assert (text.format, text.up, text.unit_m) == ("gltf", "Y", 1.0)
    np.testing.assert_array_equal(text.meshes[0].points, binary.meshes[0].points)
    np.testing.assert_array_equal(text.meshes[0].uvs["st"][0], binary.meshes[0].uvs["st"][0])
    assert report.codes() == {"glb-trailing"}


def test_required_extensions_are_refused_by_name_and_used_ones_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the extension ACME_smell, which is not read"):
        load_json(tmp_path, extensionsRequired=["ACME_smell"])
    _, report = load_json(tmp_path, extensionsUsed=["ACME_smell", LIGHTS])
    assert [f.text for f in report if f.code == "extension-unknown"] == [
        "extension ACME_smell is not read"
    ]


# Buffers and accessors


def test_buffer_files_are_percent_decoded_and_kept_inside_the_roots(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    doc = only_triangle(tmp_path)
    path = inside / "scene.gltf"
    (inside / "my buffer.bin").write_bytes(doc.body)
    (tmp_path / "outside.bin").write_bytes(doc.body)
    for uri, good in (("my%20buffer.bin", True), ("../outside.bin", False)):
        buffers = [{"byteLength": len(doc.body), "uri": uri}]
        path.write_text(json.dumps({**doc.json, "buffers": buffers}))
        if good:
            assert load(path)[0].counts()["triangles"] == 1
        else:
            with pytest.raises(InputError, match=r"/buffers/0: buffer ../outside.bin"):
                load(path)
    assert load(path, roots=[tmp_path])[0].counts()["triangles"] == 1


@pytest.mark.parametrize("uri", ["data:;base64,AA*A", "data:nothing", "gone.bin", ""])
def test_a_buffer_without_bytes_is_an_error(tmp_path: Path, uri: str) -> None:
    path = tmp_path / "scene.gltf"
    buffers = [{"byteLength": 3, "uri": uri}]
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "buffers": buffers}))
    with pytest.raises(InputError, match="/buffers/0"):
        load(path)


def test_the_declared_length_of_a_buffer_is_held_against_its_bytes(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    path = tmp_path / "scene.gltf"
    (tmp_path / "b.bin").write_bytes(doc.body)

    def declare(length: int) -> str:
        buffers = [{"byteLength": length, "uri": "b.bin"}]
        return "\ufeff" + json.dumps({**doc.json, "buffers": buffers})  # with a byte order mark

    path.write_text(declare(37), encoding="utf-8")
    scene, report = load(path)
    assert scene.counts()["triangles"] == 1
    assert report.codes() == {"buffer-size"}
    path.write_text(declare(35), encoding="utf-8")
    with pytest.raises(InputError, match="reach to byte 36"):
        load(path)


def test_interleaved_vertices_are_read_by_stride(tmp_path: Path) -> None:
    doc = Doc()
    both = np.hstack([SQUARE, -SQUARE]).astype("<f4")
    view = doc.view(both.tobytes(), byteStride=24)
    doc.mesh(
        [0, 1, 2, 2, 1, 3],
        POSITION=doc.accessor(view, 4, 5126, "VEC3"),
        NORMAL=doc.accessor(view, 3 + 1, 5126, "VEC3", byteOffset=12),
    )
    mesh = load_doc(tmp_path, doc)[0].meshes[0]
    np.testing.assert_array_equal(mesh.points, SQUARE)
    np.testing.assert_array_equal(mesh.normals[1:], -SQUARE[1:])  # the first is zero: mended
    assert mesh.points.flags.c_contiguous
    assert mesh.points.dtype == np.float32
    assert mesh.face_indices.dtype == np.int32


# Section 3.11: f = max(c / 127, -1), c / 255, max(c / 32767, -1), c / 65535.
@pytest.mark.parametrize(
    ("dtype", "raw", "normalized", "expected"),
    [
        ("i1", [-128, -127, 127], True, [-1.0, -1.0, 1.0]),
        ("u1", [0, 51, 255], True, [0.0, 0.2, 1.0]),
        ("i2", [-32768, -32767, 32767], True, [-1.0, -1.0, 1.0]),
        ("u2", [0, 13107, 65535], True, [0.0, 0.2, 1.0]),
        ("i1", [-128, 0, 127], False, [-128.0, 0.0, 127.0]),
        ("u2", [0, 1, 65535], False, [0.0, 1.0, 65535.0]),
    ],
)
def test_integers_become_floats_as_the_format_says(
    tmp_path: Path, dtype: str, raw: list[int], normalized: bool, expected: list[float]
) -> None:
    doc = Doc()
    values = np.zeros((3, 3))
    values[:, 0] = raw
    position = doc.add(values, dtype, normalized=normalized)
    mesh = load_doc(tmp_path, doc.mesh(POSITION=position))[0].meshes[0]
    # one float32 division
    np.testing.assert_allclose(mesh.points[:, 0], expected, rtol=2**-23, atol=0)


@pytest.mark.parametrize("with_base", [True, False])
def test_sparse_accessors_replace_elements(tmp_path: Path, with_base: bool) -> None:
    doc = Doc()
    where = doc.view(np.array([1, 2], "<u2").tobytes())
    what = doc.view(np.array([[5, 0, 0], [0, 6, 0]], "<f4").tobytes())
    sparse = {
        "count": 2,
        "indices": {"bufferView": where, "componentType": 5123},
        "values": {"bufferView": what},
    }
    base = doc.view(TRIANGLE.tobytes()) if with_base else None
    position = doc.accessor(base, 3, 5126, "VEC3", sparse=sparse)
    points = load_doc(tmp_path, doc.mesh(POSITION=position))[0].meshes[0].points
    np.testing.assert_array_equal(points, [[0, 0, 0], [5, 0, 0], [0, 6, 0]])
    sparse["indices"]["componentType"] = 5125  # 0x00020001 is past the end
    with pytest.raises(InputError, match="sparse"):
        load_doc(tmp_path, doc)


@pytest.mark.parametrize(
    "change",
    [
        {"count": 4},
        {"count": 4_000_000_000},
        {"count": 10**30},
        {"byteOffset": 1},
        {"bufferView": 9},
        {"componentType": 5124},
        {"type": "MAT4"},
        {"count": 0},
        {"count": -3},
    ],
)
def test_accessors_past_their_bytes_or_senseless_are_refused(
    tmp_path: Path, change: dict[str, Any]
) -> None:
    doc = only_triangle(tmp_path)
    doc.json["accessors"][0] |= change
    with pytest.raises(InputError, match=r"/accessors/0|primitives/0"):
        load_doc(tmp_path, doc)


def test_zeros_without_bytes_are_bounded(tmp_path: Path) -> None:
    doc = Doc()
    where = doc.view(np.array([1], "<u2").tobytes())
    what = doc.view(np.ones((1, 3), "<f4").tobytes())
    sparse = {
        "count": 1,
        "indices": {"bufferView": where, "componentType": 5123},
        "values": {"bufferView": what},
    }
    doc.mesh(POSITION=doc.accessor(None, 90_000_000, 5126, "VEC3", sparse=sparse))
    with pytest.raises(InputError, match="zeros without bytes"):
        load_doc(tmp_path, doc)


# Primitives


def test_the_texture_origin_moves_to_the_bottom_and_sets_are_named(tmp_path: Path) -> None:
    uv = np.array([[0, 0], [0.25, 0.75], [1, 1]], "f4")
    mesh = load_doc(tmp_path, only_triangle(tmp_path, TEXCOORD_0=uv, TEXCOORD_2=uv))[0].meshes[0]
    assert set(mesh.uvs) == {"st", "st2"}
    values, interpolation = mesh.uvs["st"]
    assert interpolation == "vertex"
    np.testing.assert_array_equal(values, [[0, 1], [0.25, 0.25], [1, 0]])


def test_strips_and_fans_keep_one_orientation(tmp_path: Path) -> None:
    """Section 3.7.2.1: strips {v_i, v_(i+1+i%2), v_(i+2-i%2)}, fans {v_(i+1), v_(i+2), v_0}."""
    zigzag = np.array([[x // 2, x % 2, 0] for x in range(6)], "f4")
    doc = Doc()
    doc.mesh(POSITION=doc.add(zigzag))
    doc.primitive["mode"] = 5
    strip = load_doc(tmp_path, doc)[0].meshes[0]
    faces = strip.face_indices.reshape(-1, 3)
    assert faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]
    a, b, c = (strip.points[faces[:, k]] for k in range(3))
    assert len(set(np.sign(np.cross(b - a, c - a)[:, 2]).tolist())) == 1
    doc.primitive["mode"] = 6
    fan = load_doc(tmp_path, doc)[0].meshes[0]
    assert fan.face_indices.reshape(-1, 3).tolist() == [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]]


def test_points_and_lines_are_dropped_with_a_finding(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    doc.json["meshes"][0]["primitives"].append({**doc.primitive, "mode": 1})
    scene, report = load_doc(tmp_path, doc)
    assert len(scene.meshes) == 1
    assert [(f.code, f.source.place) for f in report] == [
        ("primitive-mode", "/meshes/0/primitives/1")
    ]


def test_only_the_faces_with_wrong_corners_are_dropped(tmp_path: Path) -> None:
    doc = Doc()
    points = np.vstack([SQUARE, [[math.nan, 0, 0], [9, 9, 9]]])
    indices = [0, 1, 2, 2, 1, 60, 2, 1, 3, 2, 1, 4, 0, 1]
    scene, report = load_doc(tmp_path, doc.mesh(indices, POSITION=doc.add(points)))
    mesh = scene.meshes[0]
    assert mesh.face_indices.reshape(-1, 3).tolist() == [[0, 1, 2], [2, 1, 3]]
    np.testing.assert_array_equal(mesh.points, SQUARE)  # unused vertices are left out
    texts = [f.text for f in report]
    assert sum("last 2 dropped" in t for t in texts) == 1
    assert sum(t.startswith("1 of 4 triangles use vertex numbers past") for t in texts) == 1
    assert sum("not finite" in t for t in texts) == 1


def test_colours_gain_an_alpha_and_odd_attributes_are_findings(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path, NORMAL=TRIANGLE[:2], TANGENT=np.ones((3, 4)))
    colour = doc.add([[255, 0, 51]] * 3, "u1", normalized=True)
    doc.json["bufferViews"][-1]["byteLength"] = 9
    doc.primitive["attributes"]["COLOR_0"] = colour
    doc.primitive["targets"] = [{"POSITION": 0}]
    scene, report = load_doc(tmp_path, doc)
    expected = [[1.0, 0.0, 0.2, 1.0]] * 3
    np.testing.assert_allclose(scene.meshes[0].colors, expected, rtol=2**-23)
    assert scene.meshes[0].normals is None
    texts = " ".join(f.text for f in report)
    assert "NORMAL has 2 elements, POSITION 3" in texts
    assert "TANGENT of 1 meshes dropped" in texts
    assert "morph targets of 1 meshes dropped" in texts


def test_unusable_normals_come_from_the_faces_around_them(tmp_path: Path) -> None:
    normals = np.array([[0, 0, 0], [math.nan, 0, 0], [1, 0, 0]], "f4")
    scene, report = load_doc(tmp_path, only_triangle(tmp_path, NORMAL=normals))
    np.testing.assert_array_equal(scene.meshes[0].normals, [[0, 0, 1], [0, 0, 1], [1, 0, 0]])
    assert report.codes() == {"mesh-normals"}


def test_a_mesh_is_shared_by_its_nodes_and_white_where_it_has_no_material(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    doc.json["meshes"][0]["name"] = "Body"
    doc.json["meshes"][0]["primitives"].append({**doc.primitive, "material": 0})
    doc.json["materials"] = [{"name": "two", "doubleSided": True}]
    doc.json["nodes"] = [{"mesh": 0}, {"mesh": 0}]
    scene, _ = load_doc(tmp_path, doc)
    assert [m.name for m in scene.meshes] == ["Body_0", "Body_1"]
    assert [root.meshes for root in scene.roots] == [[0, 1], [0, 1]]
    assert [scene.materials[m.material or 0].diffuse for m in scene.meshes] == [(1.0, 1.0, 1.0)] * 2
    assert [m.two_sided for m in scene.meshes] == [False, True]
    assert scene.meshes[0].material == 1  # the format's default, behind those of the file


def test_shared_accessors_cannot_multiply_past_the_limit(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    doc.json["meshes"][0]["primitives"] *= 100
    assert len(load_doc(tmp_path, doc, limits=Limits(vertices=300))[0].meshes) == 100
    with pytest.raises(InputError, match="more than 299 vertices"):
        load_doc(tmp_path, doc, limits=Limits(vertices=299))
    doc = Doc()
    doc.mesh([0, 1, 2] * 100, POSITION=doc.add(TRIANGLE))
    assert load_doc(tmp_path, doc, limits=Limits(vertices=50))[0].counts()["triangles"] == 100
    with pytest.raises(InputError, match="or 98 triangles"):
        load_doc(tmp_path, doc, limits=Limits(vertices=49))
