"""Small glTF documents with compressed parts; encoding needs the libraries that decode."""

from __future__ import annotations

import base64
import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import COMPONENTS, TYPES, Doc, load

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import Mesh

EXT, KHR = "EXT_meshopt_compression", "KHR_meshopt_compression"
DRACO = "KHR_draco_mesh_compression"

needs_meshopt = pytest.mark.skipif(
    find_spec("meshopt") is None, reason="meshopt is not installed: pip install 'hdrusd[meshopt]'"
)
needs_draco = pytest.mark.skipif(
    find_spec("DracoPy") is None, reason="DracoPy is not installed: pip install 'hdrusd[draco]'"
)

#: A grid of 9 x 5 vertices, 1/8 apart: (i / 8, j / 8, 0), and two triangles a cell, facing +z.
COLUMNS, ROWS = 9, 5
PLACES = np.array([[i, j, 0] for j in range(ROWS) for i in range(COLUMNS)])
GRID = (PLACES / 8).astype("f4")
FACES = np.array(
    [
        triangle
        for j in range(ROWS - 1)
        for i in range(COLUMNS - 1)
        for a in [j * COLUMNS + i]
        for triangle in ([a, a + 1, a + COLUMNS], [a + 1, a + COLUMNS + 1, a + COLUMNS])
    ]
)


class Compressed(Doc):
    """A document whose second buffer, if any, stands in for what meshopt decompresses."""

    def __init__(self, *required: str) -> None:
        super().__init__(extensionsUsed=list(required), extensionsRequired=list(required))
        self.placeholder: dict[str, Any] = {"byteLength": 1 << 20}

    def meshopt(
        self,
        values: Any,
        dtype: str,
        mode: str = "ATTRIBUTES",
        *,
        version: int = 0,
        name: str = EXT,
        **accessor: Any,
    ) -> int:
        """An accessor of ``values`` in a view that meshopt has compressed; rows padded to 4."""
        import meshopt

        array = np.asarray(values, "<" + dtype)
        width = 1 if array.ndim == 1 else array.shape[1]
        rows = array.reshape(len(array), width)
        if mode == "ATTRIBUTES":
            size = -(-rows.itemsize * width // 4) * 4
            padded = np.zeros((len(rows), size), np.uint8)
            padded[:, : rows.itemsize * width] = rows.view(np.uint8).reshape(len(rows), -1)
            packed = meshopt.encode_gltf_buffer(padded, mode, version)
        else:
            size = rows.itemsize
            packed = meshopt.encode_gltf_buffer(array, mode)
        view = self.packed_view(packed, len(rows), size, mode, name=name)
        return self.accessor(view, len(rows), COMPONENTS[dtype], TYPES[width], **accessor)

    def packed_view(
        self, packed: bytes, count: int, stride: int, mode: str = "ATTRIBUTES", **more: Any
    ) -> int:
        name = more.pop("name", EXT)
        own = self.json["bufferViews"]
        own.pop(self.view(packed))
        start = len(self.body) - len(packed)
        part = {"buffer": 0, "byteOffset": start, "byteLength": len(packed)}
        part |= {"count": count, "byteStride": stride, "mode": mode, **more}
        view: dict[str, Any] = {"buffer": 1, "byteOffset": 0, "byteLength": count * stride}
        if mode == "ATTRIBUTES":
            view["byteStride"] = stride
        own.append({**view, "extensions": {name: part}})
        return len(own) - 1

    def draco(
        self,
        packed: bytes,
        ids: dict[str, int],
        accessors: dict[str, int],
        indices: int,
        **more: Any,
    ) -> None:
        """A mesh of one primitive that Draco has compressed, on a node."""
        extension = {"bufferView": self.view(packed), "attributes": ids}
        primitive = {"attributes": accessors, "indices": indices, "mode": 4, **more}
        primitive["extensions"] = {DRACO: extension}
        self.json.setdefault("nodes", []).append({"mesh": len(self.json.setdefault("meshes", []))})
        self.json["meshes"].append({"primitives": [primitive]})

    def write(self, path: Path) -> Path:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.body).decode()
        buffers = [{"byteLength": len(self.body), "uri": uri}]
        if any("extensions" in view for view in self.json["bufferViews"]):
            buffers.append(self.placeholder)
        path.write_text(json.dumps({**self.json, "buffers": buffers}))
        return path


def assert_is_grid(mesh: Mesh, tolerance: float = 0.0) -> None:
    """The triangles of the grid as corners in space, in any order, each from any corner."""
    assert_same_triangles(mesh.points[mesh.face_indices.reshape(-1, 3)], GRID[FACES], tolerance)


def assert_same_triangles(found: Any, wanted: Any, tolerance: float) -> None:
    """Triangles, (f, 3, 3), whose corners are multiples of 1/8 but for the tolerance."""
    assert len(found) == len(wanted)
    np.testing.assert_allclose(found, np.rint(found * 8) / 8, rtol=0, atol=tolerance)
    assert _turned(found) == _turned(wanted)


def _turned(triangles: Any) -> list[Any]:
    """Each from its least corner on, so that their sense of rotation stays."""
    whole = np.rint(np.asarray(triangles, "f8") * 8).astype(int).tolist()
    return sorted(min([t, t[1:] + t[:1], t[2:] + t[:2]]) for t in whole)


def sound_or_told(path: Path, pieces: int) -> None:
    """A damaged file is refused, or each of its ``pieces`` is a sound mesh or a finding."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            scene, report = load(path, limits=Limits(worker_seconds=30))
    except InputError:
        return
    assert len(scene.meshes) <= pieces
    assert len(list(report)) >= pieces - len(scene.meshes)
    for mesh in scene.meshes:
        assert np.isfinite(mesh.points).all()
        assert mesh.face_indices.max() < len(mesh.points)
