"""glTF views that meshoptimizer has compressed: a grid with closed-form places, packed here.

Rules and names from the specifications of EXT_meshopt_compression and KHR_meshopt_compression.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import load, load_doc
from gltf_compressed import (
    EXT,
    FACES,
    GRID,
    KHR,
    PLACES,
    Compressed,
    assert_is_grid,
    needs_meshopt,
    sound_or_told,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdrusd.errors import InputError

pytestmark = needs_meshopt


def grid(name: str = EXT, version: int = 0, mode: str = "TRIANGLES") -> Compressed:
    """The grid, its points as float32."""
    doc = Compressed(name)
    points = doc.meshopt(GRID, "f4", name=name, version=version)
    indices = doc.meshopt(FACES.reshape(-1), "u2", mode, name=name)
    doc.mesh(indices, POSITION=points)
    return doc


@pytest.mark.parametrize("mode", ["TRIANGLES", "INDICES"])
@pytest.mark.parametrize(("name", "version"), [(EXT, 0), (KHR, 0), (KHR, 1)])
def test_a_compressed_grid_is_the_grid(tmp_path: Path, name: str, version: int, mode: str) -> None:
    scene, report = load_doc(tmp_path, grid(name, version, mode))
    assert_is_grid(scene.meshes[0])
    assert list(report) == []


def test_quantized_places_are_decompressed_and_divided(tmp_path: Path) -> None:
    """KHR_mesh_quantization: uint16 normalized are c / 65535, in rows of 8 bytes."""
    doc = Compressed(EXT, "KHR_mesh_quantization")
    points = doc.meshopt(PLACES * 5, "u2", normalized=True)
    doc.mesh(doc.meshopt(FACES.reshape(-1), "u4", "TRIANGLES"), POSITION=points)
    mesh = load_doc(tmp_path, doc)[0].meshes[0]
    whole = mesh.points.astype("f8") * 65535 / 5
    np.testing.assert_allclose(whole, PLACES, rtol=2**-23, atol=0)  # a float32 division


def test_the_box_of_gltfpack_has_its_12_triangles(testdata: Path) -> None:
    path = testdata / "data" / "gltf-transform" / "extensions" / "test" / "in" / "BoxMeshopt.glb"
    scene, report = load(path)
    [mesh] = scene.meshes
    assert list(report) == []
    transform: Any = scene.roots[0].transform
    points = mesh.points.astype("f8") * transform.scale + transform.translation
    # Its scale is 1 / 16383 in 9 digits: 1 unit, from -0.5 to 0.5.
    assert {tuple(corner) for corner in np.round(points, 7).tolist()} == {
        (x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)
    }
    corners = points[mesh.face_indices.reshape(-1, 3)]
    a, b, c = (corners[:, k] for k in range(3))
    facing = np.cross(b - a, c - a)
    assert len(facing) == 12
    np.testing.assert_allclose(np.sqrt((facing**2).sum(1)), 1.0, rtol=1e-6)  # areas of 1/2
    outwards = corners.mean(axis=1) * 2.0  # the centre of a face is 1/2 from that of the box
    assert ((facing * outwards).sum(axis=1) > 0.5).all()
    assert mesh.normals is not None
    normals = mesh.normals[mesh.face_indices.reshape(-1, 3)]
    np.testing.assert_allclose(normals, np.repeat(facing[:, None], 3, axis=1), atol=1e-6)


# Filters


def filtered(doc: Compressed, rows: Any, filter: str, name: str = EXT) -> int:
    """A view of rows that a filter of meshopt made."""
    import meshopt

    rows = np.ascontiguousarray(rows)
    packed = meshopt.encode_gltf_buffer(rows, "ATTRIBUTES")
    return doc.packed_view(packed, *rows.shape, name=name, filter=filter)


def test_exponential_places_of_few_bits_are_exact(tmp_path: Path) -> None:
    import meshopt

    doc = Compressed(EXT)
    view = filtered(doc, meshopt.encode_filter_exp(GRID, 15), "EXPONENTIAL")
    points = doc.accessor(view, len(GRID), 5126, "VEC3")
    doc.mesh(doc.meshopt(FACES.reshape(-1), "u2", "TRIANGLES"), POSITION=points)
    assert_is_grid(load_doc(tmp_path, doc)[0].meshes[0])


@pytest.mark.parametrize(("bits", "stride", "component"), [(8, 4, 5120), (16, 8, 5122)])
def test_octahedral_normals(tmp_path: Path, bits: int, stride: int, component: int) -> None:
    import meshopt

    angles = np.linspace(0.0, 2.0 * math.pi, len(GRID))
    tilt = np.linspace(0.0, math.pi, len(GRID))
    unit = np.stack(
        [np.sin(tilt) * np.cos(angles), np.sin(tilt) * np.sin(angles), np.cos(tilt)], axis=1
    )
    rows = meshopt.encode_filter_oct(np.hstack([unit, np.ones((len(unit), 1))]), stride, bits)
    doc = Compressed(EXT)
    view = filtered(doc, rows, "OCTAHEDRAL")
    normals = doc.accessor(view, len(GRID), component, "VEC3", normalized=True)
    doc.mesh(FACES.reshape(-1), POSITION=doc.add(GRID), NORMAL=normals)
    mesh = load_doc(tmp_path, doc)[0].meshes[0]
    # Half a step e in u and v, so 2 e in 1 - |u| - |v|: sqrt(6) e, at least 1 / sqrt(3) from the
    # centre of the octahedron: sqrt(18) e on the sphere; half a step more for the result.
    step = 0.5 / (2 ** (bits - 1) - 1)
    np.testing.assert_allclose(mesh.normals, unit, atol=(math.sqrt(18.0) + 1.0) * step + 1e-6)


def test_quaternions_of_an_animation(tmp_path: Path) -> None:
    import meshopt

    half = np.linspace(0.1, 1.4, 8)
    unit = np.stack([np.sin(half) * 0.6, np.sin(half) * 0.8, 0.0 * half, np.cos(half)], axis=1)
    doc = Compressed(EXT)
    doc.mesh(FACES.reshape(-1), POSITION=doc.add(GRID))
    view = filtered(doc, meshopt.encode_filter_quat(unit, 8, 16), "QUATERNION")
    turns = doc.accessor(view, len(unit), 5122, "VEC4", normalized=True)
    times = doc.meshopt(np.arange(8.0), "f4")
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    doc.json["animations"] = [
        {"samplers": [{"input": times, "output": turns}], "channels": [channel]}
    ]
    [found] = load_doc(tmp_path, doc)[0].roots[0].animation
    np.testing.assert_array_equal(found.times, np.arange(8.0))
    # Three numbers of steps of 1 / sqrt(2) / 32767, the fourth of their squares, each rounded to
    # 1 / 32767: below 4 of its halves. q and -q turn alike.
    signs = np.sign((found.values * unit).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(found.values * signs, unit, atol=4 * 0.5 / 32767)


def test_colours_are_of_the_newer_extension_alone(tmp_path: Path) -> None:
    import meshopt

    # Greys have no chroma; luma of 8 bits keeps 0 and 255, alpha of 7 bits keeps 1.
    grey = np.linspace(0.0, 1.0, len(GRID))
    rows = meshopt.encode_filter_color(np.stack([grey] * 3 + [np.ones_like(grey)], 1), 4, 8)
    for name in (KHR, EXT):
        doc = Compressed(name)
        view = filtered(doc, rows, "COLOR", name)
        colour = doc.accessor(view, len(GRID), 5121, "VEC4", normalized=True)
        doc.mesh(FACES.reshape(-1), POSITION=doc.add(GRID), COLOR_0=colour)
        scene, report = load_doc(tmp_path, doc)
        colours = scene.meshes[0].colors
        if name == EXT:
            assert colours is None
            assert report.codes() == {"attribute-dropped"}
            continue
        assert colours is not None
        assert colours[[0, -1]].tolist() == [[0, 0, 0, 1], [1, 1, 1, 1]]
        np.testing.assert_allclose(colours[:, :3], grey[:, None] * np.ones(3), atol=1.5 / 255)


# Fallback


def test_a_fallback_buffer_is_not_read(tmp_path: Path) -> None:
    doc = grid()
    doc.json["extensionsRequired"] = []
    doc.placeholder |= {"uri": "gone.bin", "extensions": {EXT: {"fallback": True}}}
    assert_is_grid(load_doc(tmp_path, doc)[0].meshes[0])
    doc.json["bufferViews"].append({"buffer": 1, "byteLength": 4})  # somebody needs it
    with pytest.raises(InputError, match=r"/buffers/1: buffer gone.bin: not found"):
        load_doc(tmp_path, doc)


@pytest.mark.parametrize("required", [True, False])
def test_without_meshopt_one_line_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, required: bool
) -> None:
    doc = grid()
    doc.json["extensionsRequired"] *= required
    path = doc.write(tmp_path / "scene.gltf")
    monkeypatch.setitem(sys.modules, "meshopt", None)
    text = f"requires the extension {EXT}, which is not read .*; want pip install 'hdrusd.meshopt.'"
    with pytest.raises(InputError, match=text) as caught:
        load(path)
    assert caught.value.exit_code == 3


def test_without_meshopt_the_fallback_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    doc = grid()
    doc.json["extensionsRequired"] = []
    points = (GRID * 2).astype("<f4").tobytes()
    (tmp_path / "b.bin").write_bytes(points + FACES.astype("<u2").tobytes())
    doc.placeholder = {"uri": "b.bin", "byteLength": len(points) + 2 * FACES.size}
    doc.json["bufferViews"][1]["byteOffset"] = len(points)
    path = doc.write(tmp_path / "scene.gltf")
    assert_is_grid(load(path)[0].meshes[0])
    monkeypatch.setitem(sys.modules, "meshopt", None)
    scene, report = load(path)
    np.testing.assert_array_equal(scene.meshes[0].points, GRID * 2)
    assert report.codes() == {"compression-fallback"}


def test_the_decoders_stay_in_their_worker(tmp_path: Path) -> None:
    path = grid().write(tmp_path / "scene.gltf")
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from hdrusd.importers.importer import Resolver, read\n"
        "from hdrusd.report import Report\n"
        "report = Report()\n"
        f"assert read(Resolver(Path({str(path)!r}), report), report).meshes\n"
        "assert not {'meshopt', 'DracoPy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


# What is wrong


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"count": 44}, "45 elements reach to byte 540; the view has 528"),
        ({"count": 30}, "Malformed"),
        ({"count": 70}, "Malformed"),
        ({"count": 0}, "want a count"),
        ({"count": -45}, "want a count"),
        ({"count": 10**30}, "when decompressed"),
        ({"count": 1 << 28}, "when decompressed"),
        ({"count": 1 << 26}, "cannot be decompressed"),
        ({"byteStride": 0}, "byteStride"),
        ({"byteStride": 16}, "byteStride"),
        ({"byteStride": 13}, "byteStride"),
        ({"byteStride": 260}, "byteStride"),
        ({"mode": "TRIANGLES"}, "byteStride"),
        ({"mode": "STRIPS"}, "mode"),
        ({"filter": "OCTAHEDRAL"}, "filter"),
        ({"filter": "SEPIA"}, "filter"),
        ({"buffer": 1}, "buffer without uri"),
        ({"buffer": 7}, "buffer"),
        ({"buffer": [0]}, "buffer"),
        ({"byteLength": 5}, "cannot be decompressed"),
        ({"byteOffset": 10**9}, "cannot be decompressed"),
        ({"byteOffset": 1}, "cannot be decompressed"),
    ],
)
def test_wrong_words_are_one_line(tmp_path: Path, change: dict[str, Any], match: str) -> None:
    doc = grid()
    doc.json["bufferViews"][0]["extensions"][EXT] |= change
    if change.get("count") == 1 << 26:
        del doc.json["bufferViews"][0]["byteStride"]
    path = doc.write(tmp_path / "scene.gltf")
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=match) as caught:
            load(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)
    assert peak < 16 << 20


def test_a_length_that_is_not_count_times_stride_is_told(tmp_path: Path) -> None:
    doc = grid()
    doc.json["bufferViews"][0]["byteLength"] = 541
    scene, report = load_doc(tmp_path, doc)
    assert_is_grid(scene.meshes[0])
    assert report.codes() == {"buffer-view-size"}


def test_compressed_bytes_are_used_once(tmp_path: Path) -> None:
    """Views that overlap by all but a byte would multiply what a small file costs."""
    doc = grid()
    first = doc.json["bufferViews"][0]["extensions"][EXT]
    for _ in range(2):  # the same once more costs nothing
        doc.json["bufferViews"].append(doc.json["bufferViews"][0])
    assert_is_grid(load_doc(tmp_path, doc)[0].meshes[0])
    for shift in range(1, 9):
        other = {**first, "byteLength": first["byteLength"] - shift}
        doc.json["bufferViews"].append({"buffer": 1, "byteLength": 540, "extensions": {EXT: other}})
    with pytest.raises(InputError, match="overlap"):
        load_doc(tmp_path, doc)


def test_one_broken_view_costs_what_stands_on_it(tmp_path: Path) -> None:
    doc = grid()
    normals = doc.meshopt(GRID, "f4")
    doc.primitive["attributes"]["NORMAL"] = normals
    doc.json["bufferViews"][2]["extensions"][EXT]["byteLength"] -= 3
    scene, report = load_doc(tmp_path, doc)
    assert_is_grid(scene.meshes[0])
    assert scene.meshes[0].normals is None
    [finding] = report
    assert (finding.code, finding.source.place) == ("attribute-dropped", "/bufferViews/2")
    assert "cannot be decompressed: ValueError" in finding.text


MUTATION = st.tuples(st.integers(0, 10_000), st.integers(1, 255), st.integers(0, 3))


@settings(
    max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(MUTATION, min_size=30, max_size=60))
def test_broken_streams_read_or_end_in_an_input_error(
    tmp_path: Path, changes: list[tuple[int, int, int]]
) -> None:
    """Many streams a file, each with a byte flipped or its end cut, or neither."""
    doc = grid()
    good = bytes(doc.body)
    views, accessors = list(doc.json["bufferViews"]), list(doc.json["accessors"])
    del doc.json["bufferViews"][:], doc.json["accessors"][:]
    del doc.json["meshes"], doc.body[:]
    for number, (place, flip, cut) in enumerate(changes):
        body = bytearray(good)
        body[place % len(body)] ^= flip
        base = len(doc.body)
        doc.body += body
        for view in views:
            part = dict(view["extensions"][EXT])
            part["byteOffset"] += base
            part["byteLength"] -= cut if place % 2 else 0
            doc.json["bufferViews"].append({**view, "extensions": {EXT: part}})
        doc.json["accessors"] += [
            {**a, "bufferView": 2 * number + a["bufferView"]} for a in accessors
        ]
        primitive = {"attributes": {"POSITION": 2 * number}, "indices": 2 * number + 1}
        doc.json.setdefault("meshes", []).append({"primitives": [primitive]})
    sound_or_told(doc.write(tmp_path / "scene.gltf"), len(changes))
