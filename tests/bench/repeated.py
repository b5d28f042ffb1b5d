"""Large files for the benchmarks of the readers: a small one of the test data over and over.

Every copy is a thing of its own, as in a database that a tool wrote: its own names, vertices,
chunks, accessors or sources, so that nothing can be read once and used again.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.importers.importer import Resolver, read
from hdrusd.legacy.scene import Mesh
from hdrusd.report import Report


def repeated_obj(source: Path, target: Path, copies: int) -> None:
    """The lines of an OBJ over and over, each copy beside the last, indices moved on."""
    lines = source.read_text(encoding="latin-1").splitlines()
    counts = [sum(line.split(" ", 1)[0] == key for line in lines) for key in ("v", "vt", "vn")]
    corner = re.compile(r"(\d+)/(\d*)/?(\d*)")
    with target.open("w", encoding="latin-1") as file:
        for copy in range(copies):
            v, t, n = (copy * count for count in counts)

            def moved(match: re.Match[str], v: int = v, t: int = t, n: int = n) -> str:
                parts = [str(int(match[1]) + v)]
                parts += [str(int(g) + o) if g else "" for g, o in ((match[2], t), (match[3], n))]
                return "/".join(parts)

            for line in lines:
                key = line.split(" ", 1)[0]
                if key == "f":
                    line = corner.sub(moved, line)
                elif key == "v":
                    x, y, z = line.split()[1:4]
                    line = f"v {float(x) + 40.0 * copy:.4f} {y} {z}"
                elif key in ("o", "g"):
                    line = f"{line}_{copy}"
                elif key == "mtllib" and copy:
                    continue
                file.write(line + "\n")


# -- OpenFlight ------------------------------------------------------------------------------


def records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The records of an OpenFlight file: code and bytes."""
    at = 0
    while at < len(data):
        code, size = struct.unpack_from(">HH", data, at)
        if code == 67:  # the vertex palette's own record; its vertices follow
            size = struct.unpack_from(">i", data, at + 4)[0]
        yield code, data[at : at + size]
        at += size


def repeated_flt(source: Path, target: Path, copies: int) -> None:
    """The tree of an OpenFlight file over and over, every copy with its own vertices."""
    head, palette, tree = b"", b"", []
    for code, data in records(source.read_bytes()):
        if code == 67:
            palette = data[8:]
        elif tree or code == 10:
            tree.append((code, data))
        else:
            head += data
    body = tree[1:-1]  # between the first push and the last pop
    with target.open("wb") as file:
        file.write(head + struct.pack(">HHi", 67, 8, 8 + copies * len(palette)))
        for _ in range(copies):
            file.write(palette)
        file.write(tree[0][1])
        for copy in range(copies):
            offset = copy * len(palette)
            file.write(b"".join(_moved(code, data, offset) for code, data in body))
        file.write(tree[-1][1])


def _moved(code: int, data: bytes, offset: int) -> bytes:
    """A record whose vertex list (72) points into another copy of the palette."""
    if code != 72 or not offset:
        return data
    count = len(data) // 4 - 1
    places = struct.unpack(f">{count}i", data[4:])
    return data[:4] + struct.pack(f">{count}i", *(place + offset for place in places))


# -- 3D Studio -------------------------------------------------------------------------------


def repeated_3ds(source: Path, target: Path, copies: int) -> None:
    """The objects of a 3DS and their keyframer nodes over and over, by other names."""
    editor, keyframer = b"", b""
    for tag, data in _chunks(source.read_bytes()[6:]):
        if tag == 0x3D3D:
            shared = b"".join(_chunk(t, d) for t, d in _chunks(data) if t != 0x4000)
            objects = [d for t, d in _chunks(data) if t == 0x4000]
            renamed = (_chunk(0x4000, _renamed(d, copy)) for copy in range(copies) for d in objects)
            editor = _chunk(tag, shared + b"".join(renamed))
        elif tag == 0xB000:
            shared = b"".join(_chunk(t, d) for t, d in _chunks(data) if t != 0xB002)
            nodes = [d for t, d in _chunks(data) if t == 0xB002]
            moved = (
                _chunk(0xB002, _moved_node(d, copy, len(nodes)))
                for copy in range(copies)
                for d in nodes
            )
            keyframer = _chunk(tag, shared + b"".join(moved))
    target.write_bytes(_chunk(0x4D4D, editor + keyframer))


def _chunks(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The chunks of a 3DS chunk's data: tag and data."""
    at = 0
    while at < len(data):
        tag, size = struct.unpack_from("<HI", data, at)
        yield tag, data[at + 6 : at + size]
        at += size


def _chunk(tag: int, data: bytes) -> bytes:
    return struct.pack("<HI", tag, 6 + len(data)) + data


def _renamed(data: bytes, copy: int) -> bytes:
    """Data that begin with a name, which gets the number of the copy behind it."""
    name, _, rest = data.partition(b"\0")
    return name + b"_%d\0" % copy + rest


def _moved_node(data: bytes, copy: int, nodes: int) -> bytes:
    """A node (its id, and its name, flags and parent) of another copy of the tree."""
    moved = b""
    for tag, inner in _chunks(data):
        if tag == 0xB030:
            inner = struct.pack("<H", struct.unpack("<H", inner)[0] + copy * nodes)
        elif tag == 0xB010:
            inner = _renamed(inner, copy)
            (parent,) = struct.unpack("<H", inner[-2:])
            if parent != 0xFFFF:
                inner = inner[:-2] + struct.pack("<H", parent + copy * nodes)
        moved += _chunk(tag, inner)
    return moved


# -- glTF ------------------------------------------------------------------------------------


def repeated_glb(source: Path, target: Path, copies: int) -> None:
    """The meshes of a file that we read as a GLB, every copy with nodes and bytes of its own."""
    report = Report()
    scene = read(Resolver(source, report), report)
    meshes = [_arrays(mesh) for mesh in scene.meshes]
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "materials": [{"name": material.name} for material in scene.materials],
    }
    tables: dict[str, list[Any]] = {
        key: [] for key in ("nodes", "meshes", "accessors", "bufferViews")
    }
    binary = bytearray()
    for copy in range(copies):
        for mesh, arrays in zip(scene.meshes, meshes, strict=True):
            numbers = [_accessor(tables, binary, values) for values in arrays]
            keys = ("POSITION", "NORMAL", "TEXCOORD_0")
            primitive = {
                "attributes": dict(zip(keys, numbers, strict=False)),
                "indices": numbers[-1],
                "material": mesh.material,
            }
            name = f"{mesh.name}_{copy}"
            place = [40.0 * copy, 0.0, 0.0]
            node = {"name": name, "mesh": len(tables["meshes"]), "translation": place}
            tables["nodes"].append(node)
            tables["meshes"].append({"name": name, "primitives": [primitive]})
    document["scenes"] = [{"nodes": list(range(len(tables["nodes"])))}]
    document |= tables
    document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(binary)
    with target.open("wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<II", len(binary), 0x004E4942) + binary)


def _arrays(mesh: Mesh) -> tuple[npt.NDArray[Any], ...]:
    """Points, normals, texture coordinates, and indices of the triangles of a mesh."""
    assert mesh.normals is not None
    assert (mesh.face_counts == 3).all()
    columns = mesh.points[mesh.face_indices], mesh.normals, mesh.uvs["st"][0]
    rows, indices = np.unique(np.concatenate(columns, axis=1), axis=0, return_inverse=True)
    return (*np.split(rows, [3, 6], axis=1), indices.reshape(-1).astype("<u4"))


def _accessor(tables: dict[str, list[Any]], binary: bytearray, values: npt.NDArray[Any]) -> int:
    """The number of a new accessor, with a new buffer view, of these values."""
    number = len(tables["accessors"])
    view = {"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes}
    accessor: dict[str, Any] = {"bufferView": number, "count": len(values)}
    if values.ndim == 1:
        accessor |= {"componentType": 5125, "type": "SCALAR"}
    else:
        accessor |= {"componentType": 5126, "type": f"VEC{values.shape[1]}"}
        if values.shape[1] == 3:
            low, high = values.min(axis=0).tolist(), values.max(axis=0).tolist()
            accessor |= {"min": low, "max": high}
    tables["bufferViews"].append(view)
    tables["accessors"].append(accessor)
    binary += values.tobytes()
    return number


# -- COLLADA ---------------------------------------------------------------------------------


def repeated_dae(source: Path, target: Path, copies: int) -> None:
    """The geometries of a COLLADA file and the nodes of its scene over and over, by other ids."""
    text = source.read_text(encoding="utf-8")
    with target.open("w", encoding="utf-8") as file:
        at = 0
        for start, end in (
            _between(text, "<library_geometries>", "</library_geometries>"),
            _between(text, '<node id="', "</visual_scene>"),
        ):
            file.write(text[at:start])
            ids = re.findall(r'\bid="([^"]*)"', text[start:end])
            ids += re.findall(r'<geometry id="([^"]*)"', text)
            named = re.compile(rf'(id="|="#)({"|".join(map(re.escape, ids))})"')
            for copy in range(copies):
                file.write(named.sub(rf'\1\2_{copy}"', text[start:end]))
            at = end
        file.write(text[at:])


def _between(text: str, first: str, last: str) -> tuple[int, int]:
    """From ``first``, or from behind it where it is a whole tag, to before ``last``."""
    start = text.index(first)
    return start + (len(first) if first.endswith(">") else 0), text.index(last, start)
