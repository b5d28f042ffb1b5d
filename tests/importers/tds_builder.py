"""3D Studio files for tests: chunks put together, written to a folder, read back."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from hypothesis import HealthCheck, settings

from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.tds import read
from hdrusd.legacy.scene import LegacyScene, Light, Material, Mesh, Node
from hdrusd.report import Finding, Report

#: For hypothesis: files are written, so an example takes its time.
quick = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

#: A unit square in the XY plane, two triangles.
SQUARE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
SQUARE_FACES = ((0, 1, 2), (0, 2, 3))
IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)

OBJECT_NODE, CAMERA_NODE, CAMERA_TARGET, OMNI_NODE = 0xB002, 0xB003, 0xB004, 0xB005
SPOT_TARGET, SPOT_NODE = 0xB006, 0xB007


def chunk(tag: int, *parts: bytes) -> bytes:
    """A chunk with its header."""
    body = b"".join(parts)
    return struct.pack("<HI", tag, len(body) + 6) + body


def floats(*values: float) -> bytes:
    """32-bit floats."""
    return struct.pack(f"<{len(values)}f", *values)


def words(*values: int) -> bytes:
    """16-bit integers."""
    return struct.pack(f"<{len(values)}H", *values)


def text(name: str) -> bytes:
    """A string with its zero byte."""
    return name.encode() + b"\0"


def color(tag: int, *rgb: float) -> bytes:
    """A colour inside a chunk of its own."""
    return chunk(tag, chunk(0x0010, floats(*rgb)))


def percent(tag: int, value: int) -> bytes:
    """A percentage inside a chunk of its own."""
    return chunk(tag, chunk(0x0030, struct.pack("<h", value)))


def texture(tag: int, name: str, *parts: bytes, amount: int = 100) -> bytes:
    """A map."""
    return chunk(tag, chunk(0x0030, words(amount)), chunk(0xA300, text(name)), *parts)


def material(name: str, *parts: bytes) -> bytes:
    """A MAT_ENTRY."""
    return chunk(0xAFFF, chunk(0xA000, text(name)), *parts)


def faces(corners: Iterable[Sequence[int]], *parts: bytes, flags: int = 7) -> bytes:
    """A FACE_ARRAY with what says more of its faces."""
    rows = [words(*corner, flags) for corner in corners]
    return chunk(0x4120, words(len(rows)), *rows, *parts)


def wears(name: str, *numbers: int) -> bytes:
    """The faces of a material."""
    return chunk(0x4130, text(name), words(len(numbers), *numbers))


def points(rows: Iterable[Sequence[float]], tag: int = 0x4110) -> bytes:
    """A POINT_ARRAY, or another array of floats."""
    packed = [floats(*row) for row in rows]
    return chunk(tag, words(len(packed)), *packed)


def mesh(name: str, *parts: bytes, flags: bytes = b"") -> bytes:
    """A named object that is a mesh."""
    return chunk(0x4000, text(name), flags, chunk(0x4100, *parts))


def square(name: str = "Square", *face_parts: bytes, matrix: Sequence[float] = IDENTITY) -> bytes:
    """The unit square."""
    return mesh(
        name, points(SQUARE), chunk(0x4160, floats(*matrix)), faces(SQUARE_FACES, *face_parts)
    )


def omni(name: str, place: Sequence[float], *parts: bytes) -> bytes:
    """A named object that is a light."""
    return chunk(0x4000, text(name), chunk(0x4600, floats(*place), *parts))


def spot(target: Sequence[float], hotspot: float, falloff: float, *parts: bytes) -> bytes:
    """What makes a light a spotlight."""
    return chunk(0x4610, floats(*target, hotspot, falloff), *parts)


def camera(
    name: str,
    place: Sequence[float],
    target: Sequence[float],
    roll: float = 0.0,
    lens: float = 35.0,
) -> bytes:
    """A named object that is a camera."""
    return chunk(0x4000, text(name), chunk(0x4700, floats(*place, *target, roll, lens)))


def track(tag: int, *keys: tuple[int, Sequence[float]], flags: int = 0) -> bytes:
    """A track of keys without spline parameters."""
    rows = [struct.pack("<IH", frame, 0) + floats(*values) for frame, values in keys]
    return chunk(tag, struct.pack("<H8xI", flags, len(rows)), *rows)


def node(
    tag: int, name: str, number: int, *parts: bytes, parent: int = 0xFFFF, flags: int = 0
) -> bytes:
    """A node of the keyframer."""
    header = chunk(0xB010, text(name), words(flags, 0, parent))
    return chunk(tag, chunk(0xB030, words(number)), header, *parts)


def position(*keys: tuple[int, Sequence[float]], flags: int = 0) -> bytes:
    """A POS_TRACK_TAG."""
    return track(0xB020, *keys, flags=flags)


def rotation(*keys: tuple[int, Sequence[float]]) -> bytes:
    """A ROT_TRACK_TAG: angle in radians, axis."""
    return track(0xB021, *keys)


def scale(*keys: tuple[int, Sequence[float]]) -> bytes:
    """A SCL_TRACK_TAG."""
    return track(0xB022, *keys)


def file(*parts: bytes, keyframer: Sequence[bytes] = ()) -> bytes:
    """A whole file: what the mesh editor has, and nodes."""
    keys = [chunk(0xB000, *keyframer)] if keyframer else []
    return chunk(0x4D4D, chunk(0x0002, struct.pack("<I", 3)), chunk(0x3D3D, *parts), *keys)


class Loaded(NamedTuple):
    """A scene and what was said about it."""

    scene: LegacyScene
    report: Report

    @property
    def mesh(self) -> Mesh:
        """The only mesh."""
        (found,) = self.scene.meshes
        return found

    @property
    def material(self) -> Material:
        """The only material."""
        (found,) = self.scene.materials
        return found

    @property
    def light(self) -> Light:
        """The only light."""
        (found,) = self.scene.lights
        return found

    @property
    def root(self) -> Node:
        """The only root."""
        (found,) = self.scene.roots
        return found

    def findings(self, code: str) -> list[Finding]:
        """The findings of one code."""
        return [finding for finding in self.report if finding.code == code]

    def finding(self, code: str) -> Finding:
        """The only finding of one code."""
        (found,) = self.findings(code)
        return found


def load(path: Path, limits: Limits | None = None, roots: tuple[Path, ...] = ()) -> Loaded:
    """Read a 3D Studio file."""
    report = Report()
    resolver = Resolver(path, report, roots=roots, limits=limits or Limits())
    return Loaded(read(resolver, report), report)


def load_bytes(tmp_path: Path, content: bytes, limits: Limits | None = None) -> Loaded:
    """Write ``content`` as model.3ds and read it."""
    path = tmp_path / "model.3ds"
    path.write_bytes(content)
    return load(path, limits)


def load_material(tmp_path: Path, *parts: bytes) -> Loaded:
    """A square that wears the one material "m"."""
    return load_bytes(tmp_path, file(material("m", *parts), square("Square", wears("m", 0, 1))))


def world_points(loaded: Loaded) -> dict[str, np.ndarray]:
    """Where the points of each mesh stand at the first frame, by the name of the mesh."""
    from hdrusd.importers.tds_nodes import matrix

    found: dict[str, np.ndarray] = {}
    stack = [(root, np.eye(4)) for root in loaded.scene.roots]
    while stack:
        place, above = stack.pop()
        world = matrix(place) @ above
        stack.extend((child, world) for child in place.children)
        for number in place.meshes:
            some = loaded.scene.meshes[number]
            found[some.name] = some.points.astype(float) @ world[:3, :3] + world[3, :3]
    return found
