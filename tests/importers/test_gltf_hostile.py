"""glTF input that is out to break the reader, and the real files of the test data."""

from __future__ import annotations

import copy
import gc
import json
import math
import os
import time
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import LIGHTS, TRIANGLE, Doc, animated, load, nodes
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdrusd.errors import InputError

DATA = os.environ.get("HDRUSD_TESTDATA")
needs_data = pytest.mark.skipif(DATA is None, reason="HDRUSD_TESTDATA names no test data")

JSON_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-3, 70_000)
    | st.sampled_from([10**30, 1e39, -1.0, 0.5, math.nan, math.inf])
    | st.sampled_from(["", "\ud800", "data:;base64,AAAA", "../x", "VEC2", "MASK", "CUBICSPLINE"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)


def everything() -> dict[str, Any]:
    doc = Doc(
        extensions={LIGHTS: {"lights": [{"type": "spot", "color": [1, 1, 1], "spot": {}}]}},
        nodes=[{"mesh": 0, "children": [1], "rotation": [0, 0, 0, 1]}, {"camera": 0, "extras": {}}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1, "zfar": 9}}],
        images=[{"bufferView": 0}, {"uri": "a.png"}],
        samplers=[{"wrapS": 33071, "magFilter": 9728}],
        textures=[{"source": 0, "sampler": 0}, {"source": 1}],
        scenes=[{"nodes": [0]}],
        scene=0,
    )
    transform = {"offset": [0, 1], "rotation": 1, "scale": [1, 2], "texCoord": 1}
    base = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    material = {"pbrMetallicRoughness": {"baseColorTexture": base}, "alphaMode": "BLEND"}
    doc.json["materials"] = [material | {"emissiveTexture": {"index": 1}, "extras": {"a": 1}}]
    uv, colour = doc.add(TRIANGLE[:, :2]), doc.add([[9, 9, 9, 9]] * 3, "u1", normalized=True)
    position, normal = doc.add(TRIANGLE), doc.add([[0, 0, 1]] * 3)
    doc.mesh([0, 1, 2], POSITION=position, NORMAL=normal, TEXCOORD_0=uv, COLOR_0=colour)
    doc.primitive.update(material=0, mode=4)
    animated(doc, "translation", [0, 1], np.zeros((6, 3)), "CUBICSPLINE")
    return {**doc.json, "buffers": [{"byteLength": len(doc.body)}], "body": bytes(doc.body)}


EVERYTHING = everything()
BODY = EVERYTHING.pop("body")


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of every value in a JSON document."""
    keys: Any = list(value) if isinstance(value, dict) else ()
    if isinstance(value, list):
        keys = range(len(value))
    return [p for key in keys for p in [(*path, key), *places(value[key], (*path, key))]]


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(st.tuples(st.sampled_from(places(EVERYTHING)), JSON_VALUES), max_size=3))
def test_mutated_documents_convert_or_end_in_an_input_error(
    tmp_path: Path, changes: list[tuple[tuple[Any, ...], Any]]
) -> None:
    document = copy.deepcopy(EVERYTHING)
    for path, value in changes:
        parent: Any = document
        try:
            for key in path[:-1]:
                parent = parent[key]
            parent[path[-1]] = value
        except (KeyError, IndexError, TypeError):  # an earlier change took the place away
            continue
    (tmp_path / "body.bin").write_bytes(BODY)
    if document.get("buffers") == [{"byteLength": len(BODY)}]:
        document["buffers"][0]["uri"] = "body.bin"
    path = tmp_path / "scene.gltf"
    path.write_text(json.dumps(document))
    try:
        with np.errstate(all="raise", under="ignore"):
            scene, report = load(path)
    except InputError:
        return
    for mesh in scene.meshes:
        assert np.isfinite(mesh.points).all()
        assert mesh.face_indices.min() >= 0
        assert mesh.face_indices.max() < len(mesh.points)
        assert mesh.material is None or mesh.material < len(scene.materials)
        for values in (mesh.normals, mesh.colors, *(uv for uv, _ in mesh.uvs.values())):
            assert values is None or (len(values) == len(mesh.points) and np.isfinite(values).all())
    for node in nodes(scene):
        assert all(n < len(scene.meshes) for n in node.meshes)
        assert all(n < len(scene.lights) for n in node.lights)
    told = json.loads(json.dumps(report.as_dict()))
    assert len(told["findings"]) == len(list(report))


HOSTILE = {
    "dag_two_parents.gltf": "nodes 1 and 2",
    "deep_chain.gltf": "nested deeper than 256",
    "empty.glb": "empty file",
    "huge_count.gltf": "4000000000 elements",
    "huge_glb_chunk.glb": "cut short",
    "nan_lights.gltf": None,
    "node_cycle.gltf": "cycle",
    "uri_file.gltf": "/buffers/1",
    "uri_traversal.gltf": None,
}


@needs_data
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_end_soon_and_small(name: str) -> None:
    path = Path(str(DATA)) / "data" / "hostile" / name

    def attempt() -> None:
        match = HOSTILE[name]
        if match is None:
            assert len(load(path)[1]) > 0
        else:
            with pytest.raises(InputError, match=match):
                load(path)

    # Without what other tests have left: the collector would look through it again and again.
    gc.collect()
    gc.freeze()
    try:
        start = time.process_time()
        attempt()
        assert time.process_time() - start < 1.0
    finally:
        gc.unfreeze()
    tracemalloc.start()
    attempt()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 500e6


#: (meshes = primitives of triangles, triangles, lights, cameras) of the data's manifest.
REAL = {
    "castle-demo/gltf/punctual_lights/test_lights.glb": (145, 1730, 3, 1),
    "castle-demo/gltf/punctual_lights/test_lights.gltf": (145, 1730, 3, 1),
    "gltf-blender-io/03_skinned_cylinder/03_skinned_cylinder.gltf": (1, 316, 0, 0),
    "gltf-blender-io/14_emission_strength/14_emission_strength.gltf": (18, 17280, 0, 0),
    "gltf-blender-io/22_vertex_color/22_vertex_color.gltf": (3, 5, 0, 0),
    "godot-demos/physical_light_camera_units/living_room.glb": (7, 5088, 0, 0),
    "godot-demos/truck_town/town/model/town_model.gltf": (75, 60930, 0, 0),
    "kenney-racing/models/vehicle-truck-green.glb": (6, 1104, 0, 0),
    "openmaterial/lights/pointLight.gltf": (0, 0, 3, 0),
    "openmaterial/objects/vehicle_example.gltf": (48, 42500, 0, 0),
    "synthetic/night_corner.glb": (14, 3088, 4, 1),
}


@needs_data
@pytest.mark.parametrize("name", REAL)
def test_real_files_have_the_counts_of_their_manifest(name: str) -> None:
    root = Path(str(DATA)) / "data"
    counts = load(root / name, roots=[root])[0].counts()
    found = tuple(counts[key] for key in ("meshes", "triangles", "lights", "cameras"))
    assert found == REAL[name]
