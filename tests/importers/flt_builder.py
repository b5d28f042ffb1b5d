"""OpenFlight files for tests: put together from records, written, read back.

Layouts are those of the OpenFlight Scene Description Database Specification 16.5, written
down here a second time, so that a slip in the reader is none here.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from hypothesis import HealthCheck, settings

from hdrusd.importers.flt import read
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import LegacyScene, Light, Material, Mesh, Node
from hdrusd.report import Finding, Report

#: For hypothesis: files are written, so an example takes its time.
quick = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

#: A unit square, counter-clockwise from above.
SQUARE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))


class Loaded(NamedTuple):
    """A scene and what was said about it."""

    scene: LegacyScene
    report: Report

    @property
    def mesh(self) -> Mesh:
        """The only mesh."""
        (mesh,) = self.scene.meshes
        return mesh

    @property
    def material(self) -> Material:
        """The only material."""
        (material,) = self.scene.materials
        return material

    @property
    def light(self) -> Light:
        """The only light."""
        (light,) = self.scene.lights
        return light

    def nodes(self) -> Iterator[Node]:
        """Every node, parents first; shared ones as often as they are used."""
        waiting = list(reversed(self.scene.roots))
        while waiting:
            node = waiting.pop()
            yield node
            waiting += reversed(node.children)

    def node(self, name: str) -> Node:
        """The first node of that name."""
        return next(node for node in self.nodes() if node.name == name)

    def finding(self, code: str) -> Finding:
        """The only finding of a code."""
        (finding,) = (f for f in self.report if f.code == code)
        return finding


def load(folder: Path, content: bytes, *, limits: Limits | None = None) -> Loaded:
    """Write a file and read it."""
    path = folder / "scene.flt"
    path.write_bytes(content)
    report = Report()
    return Loaded(read(Resolver(path, report, limits=limits or Limits()), report), report)


# --- records ------------------------------------------------------------------------------


def record(op: int, body: bytes = b"", size: int = 0) -> bytes:
    """A record; ``size``: its length in bytes, filled up with zeros."""
    body = body.ljust(size - 4, b"\0")
    return struct.pack(">HH", op, 4 + len(body)) + body


def text(value: str, size: int) -> bytes:
    """A fixed field."""
    return value.encode()[: size - 1].ljust(size, b"\0")


PUSH, POP = record(10), record(11)


def node(op: int, name: str, size: int, fields: dict[int, bytes] | None = None) -> bytes:
    """A record with an 8-byte name and fields at given bytes."""
    whole = bytearray(record(op, text(name, 8), size))
    for at, value in (fields or {}).items():
        whole[at : at + len(value)] = value
    return bytes(whole)


def inside(*records: bytes) -> bytes:
    """Records between a push and a pop: what stands in the node before."""
    return PUSH + b"".join(records) + POP


def header(version: int = 1650, unit: int = 0) -> bytes:
    """The first record. ``unit``: 0 m, 1 km, 4 feet, 5 inches, 8 nautical miles."""
    fields = {12: struct.pack(">i", version), 60: struct.pack(">hB", 1, unit)}
    return node(1, "db", 324, fields)


def database(
    *records: bytes,
    palettes: bytes = b"",
    vertices: bytes = b"",
    version: int = 1650,
    unit: int = 0,
) -> bytes:
    """A whole file: palettes, vertices, and the records of the tree."""
    palette = struct.pack(">HHI", 67, 8, 8 + len(vertices)) + vertices
    return header(version, unit) + palettes + palette + inside(*records)


# --- palettes -----------------------------------------------------------------------------


def colors(entries: dict[int, tuple[int, int, int]]) -> bytes:
    """A colour palette (32) of 1024 entries, the others white."""
    rows = [bytes((0, *reversed(entries.get(i, (255, 255, 255))))) for i in range(1024)]
    return record(32, bytes(128) + b"".join(rows))


def color_index(entry: int, intensity: int = 127) -> int:
    """The number by which faces and vertices name a colour."""
    return entry * 128 + intensity


def material(
    index: int,
    name: str,
    *,
    ambient: Sequence[float] = (0.2, 0.2, 0.2),
    diffuse: Sequence[float] = (0.5, 0.5, 0.5),
    specular: Sequence[float] = (0.0, 0.0, 0.0),
    emission: Sequence[float] = (0.0, 0.0, 0.0),
    shininess: float = 0.0,
    alpha: float = 1.0,
) -> bytes:
    """A material palette entry (113)."""
    numbers = struct.pack(">14f", *ambient, *diffuse, *specular, *emission, shininess, alpha)
    return record(113, struct.pack(">i", index) + text(name, 12) + bytes(4) + numbers, 84)


def texture(index: int, file: str) -> bytes:
    """A texture palette entry (64)."""
    return record(64, text(file, 200) + struct.pack(">3i", index, 0, 0))


def light_entry(
    index: int,
    name: str,
    kind: int,
    *,
    ambient: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    diffuse: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
    specular: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
    spot: tuple[float, float] = (0.0, 180.0),
    attenuation: Sequence[float] = (1.0, 0.0, 0.0),
) -> bytes:
    """A light source palette entry (102). ``kind``: 0 infinite, 1 local, 2 spot."""
    body = struct.pack(">iii", index, 0, 0) + text(name, 20) + bytes(4)
    body += struct.pack(">12f", *ambient, *diffuse, *specular) + struct.pack(">i", kind)
    body += bytes(40) + struct.pack(">2f", *spot) + struct.pack(">2f", 0.0, 0.0)
    return record(102, body + struct.pack(">3f", *attenuation), 240)


# --- vertices and faces -------------------------------------------------------------------


def vertex(
    position: Sequence[float],
    normal: Sequence[float] | None = None,
    uv: Sequence[float] | None = None,
    *,
    color: int = -1,
    packed: Sequence[int] | None = None,
) -> bytes:
    """A vertex record, 68 to 71 by what it has. ``packed``: r, g, b of 8 bits."""
    op = {(False, False): 68, (True, False): 69, (True, True): 70, (False, True): 71}[
        (normal is not None, uv is not None)
    ]
    flags = 0x1000 if packed is not None else 0x2000 if color < 0 else 0
    body = struct.pack(">HH3d", 0, flags, *position)
    body += b"" if normal is None else struct.pack(">3f", *normal)
    body += b"" if uv is None else struct.pack(">2f", *uv)
    body += bytes((255, *reversed(packed or (0, 0, 0)))) + struct.pack(">i", color)
    return record(op, body, {68: 40, 69: 56, 70: 64, 71: 48}[op])


class Pool:
    """A vertex palette that grows: ``add`` gives the bytes by which faces name vertices."""

    def __init__(self) -> None:
        self.data = b""

    def add(self, *vertices: bytes) -> list[int]:
        """Offsets of vertices that are put at the end."""
        offsets = []
        for each in vertices:
            offsets.append(8 + len(self.data))
            self.data += each
        return offsets

    def square(self, z: float = 0.0) -> list[int]:
        """The unit square at a height, of plain vertices."""
        return self.add(*(vertex((x, y, z)) for x, y, _ in SQUARE))


def face(
    corners: Sequence[int],
    *,
    name: str = "f",
    draw: int = 0,
    white: bool = False,
    template: int = 0,
    texture: int = -1,
    material: int = -1,
    transparency: int = 0,
    flags: int = 0,
    mode: int = 2,
    color: int = -1,
    packed: Sequence[int] | None = None,
    more: bytes = b"",
) -> bytes:
    """A face (5) with its vertex list; ``more`` stands between them, on the face's level."""
    flags |= 0x10000000 if packed is not None else 0
    fields = {
        18: bytes((draw, white)),
        25: bytes((template,)),
        26: struct.pack(">hhh", -1, texture, material),
        40: struct.pack(">H", transparency),
        44: struct.pack(">IB", flags, mode),
        56: bytes((255, *reversed(packed or (0, 0, 0)))),
        68: struct.pack(">ii", color, -1),
    }
    vertices = record(72, struct.pack(f">{len(corners)}I", *corners))
    return node(5, name, 80, fields) + more + inside(vertices)


def group(name: str, *children: bytes, flags: int = 0, more: bytes = b"") -> bytes:
    """A group (2); ``more`` stands on its own level."""
    own = node(2, name, 44, {16: struct.pack(">I", flags)})
    return own + more + (inside(*children) if children else b"")


def thing(
    name: str, *children: bytes, flags: int = 0, transparency: int = 0, more: bytes = b""
) -> bytes:
    """An object (4)."""
    fields = {12: struct.pack(">IhH", flags, 0, transparency)}
    return node(4, name, 28, fields) + more + (inside(*children) if children else b"")


def matrix(rows: Sequence[float]) -> bytes:
    """A matrix (49) of 16 numbers, row by row."""
    return record(49, struct.pack(">16f", *rows))


def moved(x: float, y: float, z: float) -> bytes:
    """The matrix of a translation."""
    return matrix((1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1))


def lod(name: str, near: float, far: float, *children: bytes, center: float = 0.0) -> bytes:
    """A level of detail (73)."""
    fields = {16: struct.pack(">2d", far, near), 40: struct.pack(">3d", center, 0, 0)}
    return node(73, name, 80, fields) + inside(*children)


def external(file: str, flags: int = 0xFFFFFFFF) -> bytes:
    """An external reference (63)."""
    return record(63, text(file, 200) + bytes(4) + struct.pack(">I", flags), 216)


def light_source(
    name: str,
    index: int,
    position: Sequence[float] = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    pitch: float = 0.0,
    flags: int = 0xC0000000,
) -> bytes:
    """A light source (101)."""
    fields = {
        16: struct.pack(">i", index),
        24: struct.pack(">I", flags),
        32: struct.pack(">3d2f", *position, yaw, pitch),
    }
    return node(101, name, 64, fields)


def one_square(*before: bytes, version: int = 1650, unit: int = 0) -> bytes:
    """A file with a square in an object ``o``; ``before`` stands before the object."""
    pool = Pool()
    square = thing("o", face(pool.square()))
    return database(*before, square, vertices=pool.data, version=version, unit=unit)
