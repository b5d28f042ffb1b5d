"""What a file defines and stands at no node is told, by every reader that can have such a thing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from collada_builder import SQUARE as CORNERS
from collada_builder import document, geometry, instance, triangles
from fbx_builder import SQUARE, Fbx, needs_ufbx
from fbx_builder import square as fbx_square

from hdrusd.importers.importer import Resolver, read
from hdrusd.report import Report


def told(file: Path) -> list[str]:
    """The texts of the findings of things without a place."""
    report = Report()
    read(Resolver(file, report), report)
    return [finding.text for finding in report if finding.code == "unplaced"]


def gltf(folder: Path, node: dict[str, Any]) -> Path:
    """Two meshes, a light and a camera; one node."""
    primitive = {"attributes": {"POSITION": 0}}
    lights = {"lights": [{"type": "point", "name": "lamp"}]}
    made = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [
            {"name": "wall", "primitives": [primitive]},
            {"name": "hull", "primitives": [primitive, primitive]},
        ],
        "cameras": [{"name": "eye", "type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
        "buffers": [{"uri": "points.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": lights},
    }
    (folder / "points.bin").write_bytes(bytes(36))
    file = folder / "a.gltf"
    file.write_text(json.dumps(made))
    return file


def test_meshes_lights_and_cameras_of_gltf(tmp_path: Path) -> None:
    texts = told(gltf(tmp_path, {"mesh": 0}))
    assert [text.partition(":")[0] for text in texts] == [
        "2 meshes, of 2 triangles, that no node has",  # one for each primitive
        "1 lights that no node has",
        "1 cameras that no node has",
    ]
    assert ["hull" in texts[0], "lamp" in texts[1], "eye" in texts[2]] == [True] * 3


def test_what_has_a_place_is_not_told(tmp_path: Path) -> None:
    light = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    both = [{"mesh": 1}, {"mesh": 0, "camera": 0, **light}]
    file = gltf(tmp_path, {})
    made = json.loads(file.read_text())
    made["nodes"] = [{"children": [1, 2]}, *both]
    file.write_text(json.dumps(made))
    assert told(file) == []


def collada(folder: Path, *names: str) -> Path:
    """A document whose nodes have geometry "g" alone, of those named; and a lamp."""
    light = "<technique_common><point><color>1 1 1</color></point></technique_common>"
    body = "".join(
        geometry(triangles("0 1 2", name=name), points=CORNERS, name=name) for name in names
    )
    libraries = (
        f"<library_geometries>{body}</library_geometries>"
        f'<library_lights><light id="l" name="lamp">{light}</light></library_lights>'
    )
    file = folder / "a.dae"
    file.write_text(document(libraries, f'<node id="n">{instance()}</node>'))
    return file


def test_what_a_collada_document_does_not_instance(tmp_path: Path) -> None:
    assert told(collada(tmp_path, "g", "hull")) == [
        "library_geometries: 1 of 2 stand nowhere: hull; not read",
        "library_lights: 1 of 1 stand nowhere: lamp; not read",
    ]


@needs_ufbx
def test_a_mesh_of_fbx_that_hangs_on_nothing(tmp_path: Path) -> None:
    fbx = Fbx()
    fbx_square(fbx)
    assert told(fbx.write(tmp_path)) == []
    fbx.mesh(0, SQUARE, [(0, 1, 2, 3)])
    fbx.connections.pop()
    assert told(fbx.write(tmp_path)) == ["1 meshes that no node has, not read"]
