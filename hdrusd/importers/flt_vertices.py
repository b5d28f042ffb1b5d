"""Vertices of an OpenFlight file, as arrays: the vertex palette's and those of a mesh.

A face names its vertices by their bytes from the beginning of the vertex palette, so
the palette is not walked: what is named is read where it stands, and believed if there
is a vertex record.

Source: OpenFlight Specification 16.5, "Vertex Palette Records" (67 to 71), "Local
Vertex Pool Record" (85).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.flt_palettes import Palettes
from hdrusd.importers.flt_records import VERTEX_PALETTE, Bytes, Document, Integers
from hdrusd.report import Kind

Floats = npt.NDArray[np.float32]
Flags = npt.NDArray[np.bool_]

_ROW = 64  # bytes of the longest vertex record
_LARGEST = 1e37  # so that differences of coordinates stay within float32


class _Layout(NamedTuple):
    """Where a vertex record has what, in bytes; None where it has none."""

    size: int  # before the colour index, which came with revision 15.1
    normal: int | None
    uv: int | None
    packed: int


_LAYOUTS = {
    68: _Layout(36, None, None, 32),
    69: _Layout(48, 32, None, 44),
    70: _Layout(56, 32, 44, 52),
    71: _Layout(44, None, 32, 40),
}
_POSITION = 8
_NO_COLOR, _PACKED = 0x2000, 0x1000

#: Attribute mask of a local vertex pool, from its left bit, in the order of the data.
_POOL = {"position": 0, "index": 1, "packed": 2, "normal": 3, "uv": 4}
_POOL_LAYERS = range(5, 12)


@dataclass(slots=True)
class Vertices:
    """Rows of vertices. What one lacks is 0, and its ``has_`` is False."""

    position: npt.NDArray[np.float64]  # (v, 3)
    normal: Floats  # (v, 3)
    uv: Floats  # (v, 2)
    color: Floats  # (v, 3)
    has_normal: Flags
    has_uv: Flags
    has_color: Flags

    @classmethod
    def empty(cls, count: int) -> Vertices:
        """Rows without anything."""
        return cls(
            np.zeros((count, 3)),
            np.zeros((count, 3), np.float32),
            np.zeros((count, 2), np.float32),
            np.zeros((count, 3), np.float32),
            np.zeros(count, np.bool_),
            np.zeros(count, np.bool_),
            np.zeros(count, np.bool_),
        )

    def plus(self, others: list[Vertices]) -> Vertices:
        """These rows and, behind them, those of others."""
        if not others:
            return self
        every = [self, *others]
        names = [f.name for f in fields(self)]
        return Vertices(*(np.concatenate([getattr(v, name) for v in every]) for name in names))

    def usable(self) -> Flags:
        """Which positions can be shown. Other values that are not finite are taken away."""
        with np.errstate(invalid="ignore", over="ignore"):
            length = np.einsum("ij,ij->i", self.normal, self.normal, dtype=np.float64)
            self.has_normal &= (length > 1e-12) & (length < 1e12)  # False for NaN
            self.has_uv &= np.asarray((np.abs(self.uv) < _LARGEST).all(axis=1))
            self.normal[~self.has_normal] = 0.0
            self.uv[~self.has_uv] = 0.0
            good = np.asarray((np.abs(self.position) < _LARGEST).all(axis=1))
        self.position[~good] = 0.0
        return good


def rows(buffer: Bytes, at: Integers, size: int) -> Bytes:
    """The ``size`` bytes from each place on, (n, size)."""
    return np.lib.stride_tricks.sliding_window_view(buffer, size)[at]


def whole(table: Bytes, at: int, kind: str) -> Integers:
    """A column of a table of bytes (n, size) as whole numbers (n,); ``kind`` as ">u2"."""
    size = np.dtype(kind).itemsize
    return np.ascontiguousarray(table[:, at : at + size]).view(kind)[:, 0].astype(np.int64)


def floats(table: Bytes, at: int, kind: str, count: int) -> npt.NDArray[np.float64]:
    """Columns of a table of bytes as ``count`` numbers (n, count), of kind ">f4" or ">f8"."""
    size = np.dtype(kind).itemsize * count
    found: npt.NDArray[np.float64] = np.ascontiguousarray(table[:, at : at + size]).view(kind)
    return found


def palette_vertices(
    document: Document, palettes: Palettes, offsets: Integers
) -> tuple[Vertices, Integers]:
    """The vertices at some bytes of the palette, and of each offset its row; -1: not there."""
    if not len(offsets):
        return Vertices.empty(0), offsets
    start = document.records.of(VERTEX_PALETTE).tolist()
    if len(start) != 1:
        text = f"{len(start)} vertex palettes; want one"
        text = f"{text}; the first is used" if start else f"{text}; faces have no vertices"
        record = start[1] if start else 0
        document.add(Kind.INVALID, "flt-palette", record, "", text)
    if not start:
        return Vertices.empty(0), np.full(len(offsets), -1, np.int64)
    different, row = np.unique(offsets, return_inverse=True)
    if len(different) > document.limits.vertices:
        raise InputError(document.file, f"more than {document.limits.vertices} vertices")
    at = document.records.at[start[0]] + different
    there = at + _ROW <= len(document.buffer)
    table = rows(document.buffer, np.where(there, at, 0), _ROW)
    op = np.where(there, whole(table, 0, ">u2"), 0)
    size = whole(table, 2, ">u2")
    made = Vertices.empty(len(different))
    good = np.zeros(len(different), np.bool_)
    for code, layout in _LAYOUTS.items():
        some = np.flatnonzero((op == code) & (size >= layout.size))
        if len(some):
            good[some] = True
            part = table if len(some) == len(table) else table[some]
            _fill(made, some, part, layout, document, palettes)
    good &= made.usable()
    return made, np.where(good, np.arange(len(good)), -1)[row.ravel()]


def _fill(
    made: Vertices,
    some: Integers,
    table: Bytes,
    layout: _Layout,
    document: Document,
    palettes: Palettes,
) -> None:
    """Write the vertices of one kind into rows ``some``."""
    made.position[some] = floats(table, _POSITION, ">f8", 3)
    if layout.normal is not None:
        made.normal[some] = floats(table, layout.normal, ">f4", 3)
        made.has_normal[some] = True
    if layout.uv is not None:
        made.uv[some] = floats(table, layout.uv, ">f4", 2)
        made.has_uv[some] = True
    flags = whole(table, 6, ">u2")
    indexed = whole(table, 2, ">u2") >= layout.size + 4
    index = whole(table, 4, ">u2")  # before revision 15.1
    if document.version >= 1510 and indexed.all():
        index = whole(table, layout.packed + 4, ">i4")
    packed = (flags & _PACKED) != 0
    made.has_color[some] = packed | (((flags & _NO_COLOR) == 0) & (index >= 0))
    made.color[some] = palettes.color(index)
    if packed.any():
        made.color[some[packed]] = unpacked(table[packed, layout.packed : layout.packed + 4])


def unpacked(packed: Bytes) -> Floats:
    """Colours stored as a, b, g, r: (n, 4) bytes to (n, 3)."""
    return np.asarray(packed[:, [3, 2, 1]], np.float32) / np.float32(255.0)


def pool_vertices(
    document: Document, palettes: Palettes, record: int, thing: str
) -> tuple[Vertices, Flags]:
    """The local vertex pool of a mesh, and which of its vertices can be shown."""
    body = np.frombuffer(document.body(record), np.uint8)
    declared, mask = document.integers(record, 4, "2I")
    at: dict[str, int] = {}
    stride = 0
    sizes = {"position": 24, "index": 4, "packed": 4, "normal": 12, "uv": 8}
    for name, bit in _POOL.items():
        if mask & (0x80000000 >> bit):
            at[name] = stride
            stride += sizes[name]
    layers = sum(bool(mask & (0x80000000 >> bit)) for bit in _POOL_LAYERS)
    stride += 8 * layers
    count = min(declared, max(len(body) - 12, 0) // stride) if stride else 0
    if count < declared or "position" not in at:
        count = count if "position" in at else 0
        text = f"pool of {declared} vertices declared; {count} with a position are there"
        document.add(Kind.INVALID, "flt-count", record, thing, text)
    if layers:
        text = f"{layers} further layers of texture coordinates; dropped"
        document.add(Kind.DROPPED, "flt-texture-layer", record, thing, text)
    made = Vertices.empty(count)
    if not count:
        return made, np.zeros(0, np.bool_)
    table = body[12 : 12 + count * stride].reshape(count, stride)
    made.position[:] = floats(table, at["position"], ">f8", 3)
    if "index" in at:  # its first byte is an opacity
        index = whole(table, at["index"], ">u4") & 0xFFFFFF
        made.color[:] = palettes.color(index)
    if "packed" in at:
        made.color[:] = unpacked(table[:, at["packed"] : at["packed"] + 4])
    made.has_color[:] = "index" in at or "packed" in at
    if "normal" in at:
        made.normal[:] = floats(table, at["normal"], ">f4", 3)
        made.has_normal[:] = True
    if "uv" in at:
        made.uv[:] = floats(table, at["uv"], ">f4", 2)
        made.has_uv[:] = True
    return made, made.usable()
