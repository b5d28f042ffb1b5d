"""Faces and meshes of an OpenFlight file as rows of attributes, and their polygons.

Source: OpenFlight Specification 16.5, "Face Record" (5), "Mesh Records" (84 to 86),
"Vertex List Record" (72), "Morph Vertex List Record" (89).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdrusd.importers.flt_palettes import Palettes
from hdrusd.importers.flt_records import (
    FACE,
    MESH,
    MESH_PRIMITIVE,
    MESH_VERTICES,
    MORPH_LIST,
    VERTEX_LIST,
    Document,
    Grouped,
    Integers,
)
from hdrusd.importers.flt_vertices import (
    Flags,
    Floats,
    Vertices,
    palette_vertices,
    pool_vertices,
    rows,
    unpacked,
    whole,
)
from hdrusd.report import Kind

#: Draw types.
CULLED, WIREFRAMES, SURROUNDED, POINTS = 0, (2, 3), 4, (8, 9, 10)
#: Templates: with blending; of these the ones that turn with the viewer.
BLENDED, BILLBOARDS = (1, 2, 4), (2, 4)

_ROW = 84  # bytes of a mesh record, the longer one
_FACE_LEAST = 64  # of revision 14.2
_NO_COLOR, _PACKED, _HIDDEN = 0x40000000, 0x10000000, 0x04000000
_STRIP, _FAN, _QUADS, _POLYGON = 1, 2, 3, 4


@dataclass(slots=True)
class Faces:
    """A row for each face and each mesh, in the file's order."""

    record: Integers
    draw: Integers
    template: Integers
    texture: Integers  # palette index, -1 without
    material: Integers
    alpha: Integers  # 0 to 255
    lit: Flags
    gouraud: Flags  # colours of the vertices count
    hidden: Flags
    color: Floats  # (f, 3)


@dataclass(slots=True)
class Polygons:
    """Corners of polygon i: ``vertex[start[i] : start[i] + count[i]]``, -1 for a bad one."""

    face: Integers  # row of ``Faces``
    count: Integers
    vertex: Integers  # row of ``Vertices``
    vertices: Vertices

    @property
    def start(self) -> Integers:
        """The first corner of each."""
        return np.cumsum(self.count) - self.count


def ranges(start: Integers, count: Integers) -> Integers:
    """start[0], start[0] + 1, ... (count[0] of them), start[1], ..."""
    first = np.cumsum(count) - count
    return np.repeat(start - first, count) + np.arange(int(count.sum()), dtype=np.int64)


def read_faces(document: Document, palettes: Palettes) -> Faces:
    """The attributes of all faces and meshes."""
    records = document.records.of(FACE, MESH)
    is_mesh = document.records.op[records] == MESH
    short = document.records.size[records] < _FACE_LEAST + 4 * is_mesh
    if short.any():
        first = int(records[short][0])
        text = f"{int(short.sum())} face records shorter than {_FACE_LEAST} bytes; left out"
        document.add(Kind.INVALID, "flt-face", first, document.text(first, 4, 8), text)
        records, is_mesh = records[~short], is_mesh[~short]
    table = rows(document.buffer, document.records.at[records], _ROW).copy()
    table[is_mesh, 12:80] = table[is_mesh, 16:84]  # a mesh has 4 more bytes before the rest
    size = document.records.size[records] - 4 * is_mesh
    flags = whole(table, 44, ">u4")
    mode = table[:, 48]
    texture = whole(table, 28, ">i2")
    index = whole(table, 20, ">u2")
    if document.version >= 1510:
        index = np.where(size >= 72, whole(table, 68, ">i4"), -1)
    color = palettes.color(np.where((flags & _NO_COLOR) != 0, -1, index))
    packed = (flags & _PACKED) != 0
    color[packed] = unpacked(table[packed, 56:60])
    color[(table[:, 19] != 0) & (texture >= 0)] = 1.0  # "texture white"
    transparency = whole(table, 40, ">u2")
    return Faces(
        records,
        table[:, 18].astype(np.int64),
        table[:, 25].astype(np.int64),
        texture,
        whole(table, 30, ">i2"),
        255 - (transparency * 255 + 32767) // 65535,
        mode >= 2,
        (mode == 1) | (mode == 3),
        (flags & _HIDDEN) != 0,
        color,
    )


def read_polygons(document: Document, palettes: Palettes, faces: Faces) -> Polygons:
    """The polygons of all faces and meshes; what hangs on no face is left out with a finding."""
    lists = document.records.of(VERTEX_LIST, MORPH_LIST)
    parents = document.records.parent[lists]
    is_face = parents >= 0
    is_face[is_face] = document.records.op[parents[is_face]] == FACE
    lists, parents = lists[is_face], parents[is_face]  # others are those of light points
    row = np.searchsorted(faces.record, parents)
    known = row < len(faces.record)
    known[known] = faces.record[row[known]] == parents[known]
    lists, row = lists[known], row[known]
    offsets, count = list_offsets(document, lists)
    vertices, vertex = palette_vertices(document, palettes, offsets)
    return _with_meshes(document, palettes, faces, Polygons(row, count, vertex, vertices))


def list_offsets(document: Document, lists: Integers) -> tuple[Integers, Integers]:
    """Palette offsets that vertex lists name, in one row, and how many each has.

    Of a morphing list the shape at 0 %, which is every other one.
    """
    records = document.records
    morph = records.op[lists] == MORPH_LIST
    step = np.where(morph, 8, 4)
    count = (records.size[lists] - 4) // step
    if morph.any():
        first = int(lists[morph][0])
        text = f"{int(morph.sum())} faces change their shape with the distance; "
        text += "that at 0 % is kept, the nearest"
        document.add(Kind.REPLACED, "flt-morph", first, "", text)
    within = ranges(np.zeros(len(lists), np.int64), count)
    at = np.repeat(records.at[lists] + 4, count) + within * np.repeat(step, count)
    found = whole(rows(document.buffer, at, 4), 0, ">u4")
    if not records.continued:
        return found, count
    parts = np.split(found, np.cumsum(count)[:-1]) if len(lists) else []
    for number, record in enumerate(lists.tolist()):
        if record in records.continued:
            body = document.body(record)[4:]
            every = np.frombuffer(body[: len(body) // 4 * 4], ">u4").astype(np.int64)
            parts[number] = every[:: 2 if morph[number] else 1]
            count[number] = len(parts[number])
    return (np.concatenate(parts) if parts else found), count


def _with_meshes(document: Document, palettes: Palettes, faces: Faces, made: Polygons) -> Polygons:
    """Add the polygons of mesh records, each of which has vertices of its own."""
    pools: list[Vertices] = []
    face, count, vertex = [made.face], [made.count], [made.vertex]
    meshes = np.flatnonzero(document.records.op[faces.record] == MESH)
    if not len(meshes):
        return made
    parts = document.records.of(MESH_PRIMITIVE)
    primitives = Grouped(document.records.parent[parts], parts)
    stores = document.records.of(MESH_VERTICES)
    # A pool follows its mesh on the same level, or is its first child.
    own = document.records.before(faces.record[meshes], stores)
    pools_of = Grouped(np.where(own >= 0, own, document.records.parent[stores]), stores)
    total = len(made.vertices.position)
    for row in meshes.tolist():
        record = int(faces.record[row])
        name = document.text(record, 4, 8)
        store, own_parts = pools_of[record].tolist(), primitives[record].tolist()
        if not store or not own_parts:
            text = "mesh without vertices" if not store else "mesh without primitives"
            document.add(Kind.DROPPED, "flt-no-faces", record, name, f"{text}; left out")
            continue
        pool, good = pool_vertices(document, palettes, store[0], name)
        rows_of = np.where(good, np.arange(len(good)) + total, -1)
        for part in own_parts:
            corners, counts = _primitive(document, part, name, rows_of)
            face.append(np.full(len(counts), row, np.int64))
            count.append(counts)
            vertex.append(corners)
        pools.append(pool)
        total += len(good)
    every = [np.concatenate(part) for part in (face, count, vertex)]
    return Polygons(every[0], every[1], every[2], made.vertices.plus(pools))


def _primitive(
    document: Document, record: int, name: str, rows_of: Integers
) -> tuple[Integers, Integers]:
    """Corners and counts of the polygons of a mesh primitive (86)."""
    nothing = np.zeros(0, np.int64)
    kind, width, declared = document.integers(record, 4, "hHI")
    body = np.frombuffer(document.body(record), np.uint8)[12:]
    if width not in (1, 2, 4) or kind not in (_STRIP, _FAN, _QUADS, _POLYGON):
        text = f"primitive {kind} with indices of {width} bytes; want 1 to 4; 1, 2 or 4; left out"
        document.add(Kind.INVALID, "flt-primitive", record, name, text)
        return nothing, nothing
    size = min(declared, len(body) // width)
    if size < declared:
        text = f"{declared} indices declared; {size} are there"
        document.add(Kind.INVALID, "flt-count", record, name, text)
    index = body[: size * width].view(f">u{width}").astype(np.int64)
    corner = np.append(rows_of, -1)[np.minimum(index, len(rows_of))]
    if kind == _POLYGON:
        return corner, np.array([size], np.int64)
    if kind == _QUADS:  # vertices 0 1 3 2, 2 3 5 4, ...
        first = np.arange(0, max(size - 3, 0), 2)
        picked = first[:, None] + np.array([0, 1, 3, 2])
    elif kind == _FAN:
        first = np.arange(1, max(size - 1, 1))
        picked = np.stack([np.zeros_like(first), first, first + 1], axis=1)
    else:  # every other triangle of a strip is wound the other way
        first = np.arange(max(size - 2, 0))
        turned = (first % 2)[:, None] * np.array([0, 1, -1])
        picked = first[:, None] + np.array([0, 1, 2]) + turned
    return corner[picked].ravel(), np.full(len(picked), picked.shape[1], np.int64)
