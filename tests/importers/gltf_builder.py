"""Small glTF documents, put together accessor by accessor."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.importers.gltf import read
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Report

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "f4")
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "f4")
LIGHTS = "KHR_lights_punctual"


class Doc:
    """A glTF document that is put together accessor by accessor."""

    def __init__(self, **parts: Any) -> None:
        self.body = bytearray()
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [], **parts}
        self.json.setdefault("accessors", [])

    def view(self, content: bytes, **more: Any) -> int:
        self.body += bytes(-len(self.body) % 4)
        view = {"buffer": 0, "byteOffset": len(self.body), "byteLength": len(content), **more}
        self.body += content
        self.json["bufferViews"].append(view)
        return len(self.json["bufferViews"]) - 1

    def add(self, values: Any, dtype: str = "f4", **more: Any) -> int:
        array = np.asarray(values, "<" + dtype)
        width = 1 if array.ndim == 1 else array.shape[1]
        view = self.view(array.tobytes())
        return self.accessor(view, len(array), COMPONENTS[dtype], TYPES[width], **more)

    def accessor(self, view: int | None, count: int, component: int, kind: str, **more: Any) -> int:
        accessor = {"componentType": component, "count": count, "type": kind, **more}
        if view is not None:
            accessor["bufferView"] = view
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def mesh(self, indices: Any = None, dtype: str = "u2", **attributes: Any) -> Doc:
        """One mesh of one primitive on one node; ``indices`` may be a number or values."""
        primitive: dict[str, Any] = {"attributes": attributes}
        if indices is not None:
            primitive["indices"] = indices if isinstance(indices, int) else self.add(indices, dtype)
        self.json.setdefault("meshes", []).append({"primitives": [primitive]})
        self.json.setdefault("nodes", [{"mesh": 0}])
        return self

    @property
    def primitive(self) -> dict[str, Any]:
        return self.json["meshes"][-1]["primitives"][0]

    def write(self, path: Path) -> Path:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.body).decode()
        whole = {**self.json, "buffers": [{"byteLength": len(self.body), "uri": uri}]}
        path.write_text(json.dumps(whole))
        return path


def glb(document: dict[str, Any], body: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body += bytes(-len(body) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def load(path: Path, **options: Any) -> tuple[LegacyScene, Report]:
    report = Report()
    return read(Resolver(path, report, **options), report), report


def load_doc(tmp_path: Path, doc: Doc, **options: Any) -> tuple[LegacyScene, Report]:
    return load(doc.write(tmp_path / "scene.gltf"), **options)


def load_json(tmp_path: Path, **parts: Any) -> tuple[LegacyScene, Report]:
    return load_doc(tmp_path, Doc(**parts))


def only_triangle(tmp_path: Path, **attributes: Any) -> Doc:
    doc = Doc()
    return doc.mesh(POSITION=doc.add(TRIANGLE), **{k: doc.add(v) for k, v in attributes.items()})


def animated(
    doc: Doc, path: str, times: Any, values: Any, mode: str = "LINEAR", node: int = 0
) -> None:
    """One animation of one channel, with a sampler of its own."""
    sampler = {"input": doc.add(times), "output": doc.add(values), "interpolation": mode}
    channel = {"sampler": 0, "target": {"node": node, "path": path}}
    doc.json.setdefault("animations", []).append({"samplers": [sampler], "channels": [channel]})


def nodes(scene: LegacyScene) -> list[Node]:
    """Every node below the roots."""
    found, pending = [], list(scene.roots)
    while pending:
        found.append(pending.pop())
        pending += found[-1].children
    return found
