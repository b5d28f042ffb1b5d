"""Triangle meshes of 3D Studio: points, faces, materials, texture coordinates.

Points stand in the file where the mesh editor shows them, in the world. MESH_MATRIX says
which frame the mesh has; the keyframer's transforms start from there, and a mirrored one
is a right-handed frame with its X axis turned over, as the keyframer knows no mirror.

Source: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions"
(N_TRI_OBJECT).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.importers.tds_materials import Entry, default_material
from hdrusd.importers.tds_normals import MOST_SETS, reduced, smoothed
from hdrusd.legacy.scene import Floats, Ints, Material, Mesh, Subset
from hdrusd.report import Kind

_POINTS, _FACES, _MATERIAL, _TEXCOORDS = 0x4110, 0x4120, 0x4130, 0x4140
_SMOOTHING, _MATRIX, _BOX_MAP = 0x4150, 0x4160, 0x4190
#: Selections, the colour in the editor, the icon of a mapping that is in the coordinates.
_SILENT = frozenset({0x4111, 0x4165, 0x4170})

#: A face at a seam of its mapping.
_WRAP_FLAGS = 0x18
#: Of the volume of a frame's axes to their lengths: below it the frame is flat.
_FLAT = 1e-9

_IDENTITY = np.eye(4)

Doubles = npt.NDArray[np.float64]
_Words = npt.NDArray[np.uint16]
#: An index of rows; one of all of them costs no copy.
_Rows = slice | npt.NDArray[np.int64]


@dataclass(slots=True)
class RawMesh:
    """A mesh as it stands in the file. ``wears``: names by number, ``worn``: -1 is none."""

    name: str
    chunk: Chunk
    points: Floats = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    faces: _Words = field(default_factory=lambda: np.zeros((0, 3), np.uint16))
    texcoords: Floats | None = None
    groups: npt.NDArray[np.uint32] | None = None
    matrix: Doubles | None = None  # (4, 4), row vectors, local to world
    wears: list[str] = field(default_factory=list)
    worn: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    whole: bool = True  # False: an array that is cut off

    def world_to_local(self) -> Doubles | None:
        """(4, 4) from the file's points into the frame of the keyframer; None: it has no volume."""
        if self.matrix is None or np.array_equal(self.matrix, _IDENTITY):
            return _IDENTITY
        axes = self.matrix[:3, :3]
        size = float(np.linalg.norm(axes, axis=1).prod())
        volume = float(np.linalg.det(axes))
        if not abs(volume) > _FLAT * size:
            return None
        inverse = np.linalg.inv(self.matrix)
        if volume < 0.0:
            inverse = inverse @ np.diag((-1.0, 1.0, 1.0, 1.0))
        return np.asarray(inverse) if np.isfinite(inverse).all() else None


@dataclass(slots=True)
class MeshReader:
    """Reads the meshes of one file, at most ``limits.vertices`` points and faces in all."""

    document: Document
    vertices: int = 0

    def read(self, chunk: Chunk, name: str) -> RawMesh | None:
        """An N_TRI_OBJECT; None, with a finding, where its arrays are cut off."""
        raw = RawMesh(name, chunk)
        for child in self.document.children(chunk):
            if child.tag == _POINTS:
                raw.points = self._array(raw, child, "<f4", 3)
            elif child.tag == _FACES:
                self._faces(raw, child)
            elif child.tag == _TEXCOORDS:
                raw.texcoords = self._array(raw, child, "<f4", 2)
            elif child.tag == _MATRIX:
                values = self.document.floats(child, 12, name)
                if values is not None:
                    raw.matrix = np.eye(4)
                    raw.matrix[:, :3] = np.array(values).reshape(4, 3)
            else:
                self.document.unread(child, name, _SILENT)
        self.vertices += len(raw.points) + len(raw.faces)
        if self.vertices > self.document.limits.vertices:
            text = f"more than {self.document.limits.vertices} points and faces up to here"
            raise InputError(self.document.ref(chunk), text)
        return raw if raw.whole else None

    def _array(self, raw: RawMesh, chunk: Chunk, kind: str, width: int) -> npt.NDArray[Any]:
        """Rows behind their 16-bit count; a mesh of which some are missing is not whole."""
        count = self.document.word(chunk, 0, raw.name)
        bytes_a_row = width * np.dtype(kind).itemsize
        there = max(chunk.end - chunk.begin - 2, 0) // bytes_a_row
        if there < count:
            text = f"{count} rows declared, {there} are there; the mesh is dropped"
            self.document.note(Kind.INVALID, "3ds-array", chunk, raw.name, text)
            raw.whole = False
            count = 0
        begin = min(chunk.begin + 2, chunk.end)
        return np.frombuffer(self.document.data, kind, count * width, begin).reshape(-1, width)

    def _faces(self, raw: RawMesh, chunk: Chunk) -> None:
        """Corners and flags, then chunks that say more of the faces."""
        rows = self._array(raw, chunk, "<u2", 4)
        raw.faces = rows[:, :3]
        raw.worn = np.full(len(rows), -1, np.int32)
        seams = int(np.count_nonzero(rows[:, 3] & _WRAP_FLAGS))
        if seams:
            text = (
                f"{seams} faces at a seam of their mapping; their coordinates are kept as they are"
            )
            self.document.note(Kind.DROPPED, "3ds-face-wrap", chunk, raw.name, text)
        if not raw.whole:
            return
        for child in self.document.children(chunk, chunk.begin + 2 + 8 * len(rows)):
            if child.tag == _MATERIAL:
                self._wear(raw, child)
            elif child.tag == _SMOOTHING:
                self._smoothing(raw, child)
            elif child.tag == _BOX_MAP:
                text = "six materials, by the side that a face looks to; dropped"
                self.document.note(Kind.DROPPED, "3ds-box-map", child, raw.name, text)
            else:
                self.document.unread(child, raw.name)

    def _wear(self, raw: RawMesh, chunk: Chunk) -> None:
        name, at = self.document.text(chunk)
        count = self.document.word(chunk, 0, raw.name, at)
        there = max(chunk.end - at - 2, 0) // 2
        if there < count:
            text = f"{count} faces of {name} declared, {there} are there"
            self.document.note(Kind.INVALID, "3ds-array", chunk, raw.name, text)
            count = there
        faces = np.frombuffer(self.document.data, "<u2", count, min(at + 2, chunk.end))
        good = faces[faces < len(raw.faces)]
        if len(good) < len(faces):
            text = f"{len(faces) - len(good)} faces of {name} are not there"
            self.document.note(Kind.INVALID, "3ds-face-number", chunk, raw.name, text)
        again = int(np.count_nonzero(raw.worn[good] != -1))
        if again:
            text = f"{again} faces of {name} wear another material already; the last one counts"
            self.document.note(Kind.INVALID, "3ds-face-material", chunk, raw.name, text)
        raw.worn[good] = len(raw.wears)
        raw.wears.append(name)

    def _smoothing(self, raw: RawMesh, chunk: Chunk) -> None:
        there = (chunk.end - chunk.begin) // 4
        if there < len(raw.faces):
            text = f"smoothing groups of {there} faces; want {len(raw.faces)}; none are used"
            self.document.note(Kind.INVALID, "3ds-array", chunk, raw.name, text)
            return
        raw.groups = np.frombuffer(self.document.data, "<u4", len(raw.faces), chunk.begin)


@dataclass(slots=True)
class MeshMaker:
    """Makes the scene's meshes, and the numbers of the materials that they wear."""

    document: Document
    entries: Mapping[str, Entry]
    materials: list[Material]
    _numbers: dict[str | None, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, entry in self.entries.items():
            self._numbers[name] = len(self.materials)
            self.materials.append(entry.material)

    def make(self, raw: RawMesh, matrix: Doubles | None) -> Mesh | None:
        """The mesh with its points moved by ``matrix``; None, with a finding, without faces."""
        points = raw.points
        if matrix is not None and matrix is not _IDENTITY:
            with np.errstate(all="ignore"):
                moved = points.astype(np.float64) @ matrix[:3, :3] + matrix[3, :3]
                points = moved.astype(np.float32)
        keep = self._usable(raw, points)
        faces = raw.faces[keep].astype(np.int64)
        if not len(faces):
            text = f"no usable face among {len(raw.faces)}; the mesh is left out"
            self.document.note(Kind.INVALID, "3ds-no-faces", raw.chunk, raw.name, text)
            return None
        used, corners = _used(faces, len(points))
        points = np.require(points[used], np.float32, ["C", "A", "W"])
        material, subsets = _subsets(self._worn(raw, keep))
        uvs = self._texcoords(raw, used)
        worn = {subset.material for subset in subsets} if material is None else {material}
        sided = {self.materials[number].two_sided for number in worn}
        if len(sided) > 1:
            text = "materials of one side and of two; all of the mesh shows both"
            self.document.note(Kind.REPLACED, "3ds-two-sided", raw.chunk, raw.name, text)
        return Mesh(
            raw.name,
            self.document.ref(raw.chunk),
            points,
            np.full(len(corners), 3, np.int32),
            corners.reshape(-1).astype(np.int32),
            normals=self._normals(raw, keep, points, corners),
            normals_interpolation="faceVarying",
            uvs={} if uvs is None else {"st": (uvs, "vertex")},
            material=material,
            subsets=subsets,
            two_sided=True in sided,
        )

    def _usable(self, raw: RawMesh, points: Floats) -> _Rows:
        """Which faces have points that are there and finite."""
        inside = len(raw.faces) > 0 and int(raw.faces.max()) < len(points)
        if inside and np.isfinite(points).all():
            return slice(None)
        there = np.asarray((raw.faces < len(points)).all(axis=1))
        finite = np.asarray(np.isfinite(points).all(axis=1))
        good = there.copy()
        good[there] = finite[raw.faces[there]].all(axis=1)
        for code, count, text in (
            ("3ds-face-index", int(np.count_nonzero(~there)), "a point that is not there"),
            ("3ds-face-point", int(np.count_nonzero(there & ~good)), "a point that is not finite"),
        ):
            if count:
                text = f"{count} faces with {text}: dropped"
                self.document.note(Kind.INVALID, code, raw.chunk, raw.name, text)
        return np.flatnonzero(good)

    def _worn(self, raw: RawMesh, keep: _Rows) -> Ints:
        """The number of each face's material in the scene."""
        worn = raw.worn[keep]
        bare = int(np.count_nonzero(worn == -1))
        table = np.array([*(self._number(raw, name) for name in raw.wears), 0], np.int32)
        if bare:
            text = f"{bare} faces without a material: OpenGL's default"
            self.document.note(Kind.ASSUMED, "3ds-material-none", raw.chunk, raw.name, text)
            table[-1] = self._number(raw, None)
        return table[worn]

    def _number(self, raw: RawMesh, name: str | None) -> int:
        """Of a material; one that is not defined, and that of no name, are OpenGL's default."""
        if name not in self._numbers:
            place = self.document.ref(raw.chunk)
            material = default_material(place)
            if name is not None:
                text = f"{name}: no such material in the file; OpenGL's default is used"
                self.document.note(Kind.MISSING, "3ds-material", raw.chunk, raw.name, text)
                material = Material(name, place, defaults=material.defaults)
            self._numbers[name] = len(self.materials)
            self.materials.append(material)
        return self._numbers[name]

    def _texcoords(self, raw: RawMesh, used: _Rows) -> Floats | None:
        values = raw.texcoords
        if values is None or not len(values):
            return None
        if len(values) < len(raw.points):
            text = f"texture coordinates of {len(values)} points; want {len(raw.points)}; left out"
            self.document.note(Kind.INVALID, "3ds-texcoords", raw.chunk, raw.name, text)
            return None
        values = np.require(values[: len(raw.points)][used], np.float32, ["C", "A", "W"])
        finite = np.isfinite(values)
        if not finite.all():
            bad = ~finite.all(axis=1)
            text = f"texture coordinates of {int(bad.sum())} points are not finite; (0, 0) is used"
            self.document.note(Kind.INVALID, "3ds-texcoords", raw.chunk, raw.name, text)
            values[bad] = 0.0
        return values

    def _normals(
        self,
        raw: RawMesh,
        keep: _Rows,
        points: Floats,
        corners: npt.NDArray[np.int64],
    ) -> Floats | None:
        """Smooth ones where faces say so; None where all faces are flat, as they then are."""
        if raw.groups is None:
            return None
        flat = [name in self.entries and self.entries[name].flat for name in raw.wears]
        groups = np.where(np.array([*flat, False])[raw.worn], 0, raw.groups).astype(np.uint32)[keep]
        if not groups.any():
            return None
        groups, fewer = reduced(groups)
        if fewer:
            text = f"more than {MOST_SETS} sets of smoothing groups; each face keeps its lowest"
            self.document.note(Kind.REPLACED, "3ds-smoothing", raw.chunk, raw.name, text)
        return smoothed(points, corners, groups)


def _used(faces: npt.NDArray[np.int64], count: int) -> tuple[_Rows, npt.NDArray[np.int64]]:
    """The points in use, of ``count``, and the faces' corners as numbers among them."""
    flags = np.zeros(count, np.bool_)
    flags[faces.reshape(-1)] = True
    if flags.all():
        return slice(None), faces
    return np.flatnonzero(flags), (np.cumsum(flags, dtype=np.int64) - 1)[faces]


def _subsets(numbers: Ints) -> tuple[int | None, tuple[Subset, ...]]:
    """Either one material for all faces or a subset for each."""
    first = int(numbers[0])
    if np.all(numbers == first):
        return first, ()
    order = np.argsort(numbers, kind="stable").astype(np.int32)
    ranked = numbers[order]
    parts = np.split(order, np.flatnonzero(np.diff(ranked)) + 1)
    return None, tuple(Subset(int(numbers[part[0]]), part) for part in parts)
