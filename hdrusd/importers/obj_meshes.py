"""Meshes of an OBJ file: checked faces, split by group, with only the points they use."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.importers.obj_statements import ABSENT, BAD, Statements
from hdrusd.importers.obj_text import Bools, Doubles, Integers, Tally
from hdrusd.legacy.scene import Floats, Ints, Mesh, Subset, Vec3

#: From here on float32 coordinates lie more than 1/1024 of a unit apart: 24 bits, 2^13 units.
_FAR = 8192.0


@dataclass(frozen=True, slots=True)
class Faces:
    """Some faces: columns as in ``Statements``, the material as a number in the scene."""

    counts: Ints
    lines: Integers
    group: Ints
    material: Ints
    corners: Ints  # (sum of counts, 3)

    @property
    def starts(self) -> Integers:
        """The first corner of each face."""
        return np.cumsum(self.counts, dtype=np.int64) - self.counts

    def take(self, order: Integers) -> Faces:
        """The faces of these numbers, in this order."""
        counts = self.counts[order]
        first = np.cumsum(counts, dtype=np.int64) - counts
        corner = np.repeat(self.starts[order] - first, counts) + np.arange(int(counts.sum()))
        columns = (self.lines[order], self.group[order], self.material[order])
        return Faces(counts, *columns, self.corners[corner])

    def by_group(self) -> list[Faces]:
        """One record for each group, in the order of the groups."""
        if np.any(np.diff(self.group) < 0):
            return self.take(np.argsort(self.group, kind="stable")).by_group()
        bounds = np.flatnonzero(np.diff(self.group, prepend=-1, append=-1))
        corner = np.append(self.starts, len(self.corners))[bounds].tolist()
        parts = []
        for number, (begin, end) in enumerate(pairwise(bounds)):
            rows = slice(begin, end)
            columns = (self.counts[rows], self.lines[rows], self.group[rows], self.material[rows])
            parts.append(Faces(*columns, self.corners[corner[number] : corner[number + 1]]))
        return parts

    def note(self, tally: Tally, code: str, where: Bools) -> None:
        """Count the corners that ``where`` marks, with the line of the first."""
        if where.any():
            face = np.searchsorted(self.starts, np.argmax(where), side="right") - 1
            tally.note(code, int(self.lines[face]), int(np.count_nonzero(where)))


def usable_faces(file: Statements, materials: Ints, tally: Tally) -> Faces:
    """The faces whose indices are there and whose points are finite; the others are counted.

    ``materials[i]`` is the scene's number for the name ``file.uses[i]``; its last
    entry is for faces without ``usemtl``.
    """
    worn = materials[file.face_material]
    faces = Faces(file.face_counts, file.face_lines, file.face_group, worn, file.corners)
    if not faces.counts.size:
        return faces
    vertex, texcoord, normal = faces.corners.T
    points = len(file.points)
    astray = (vertex < 0) | (vertex >= points)
    for index, count in ((texcoord, len(file.texcoords)), (normal, len(file.normals))):
        astray |= (index == BAD) | (index >= count)
    largest = float(np.finfo(np.float32).max)
    sound = np.abs(file.points) <= largest  # NaN is not <= either
    broken_corner = np.zeros(len(vertex), bool)
    if not sound.all():
        broken = ~np.all(sound, axis=1)
        broken_corner = broken[np.clip(vertex, 0, points - 1)] & ~astray
    keep = np.ones(faces.counts.size, bool)
    for code, corner in (("face-index", astray), ("face-point", broken_corner)):
        if corner.any():
            bad = np.logical_or.reduceat(corner, faces.starts) & keep
            tally.note(code, int(faces.lines[np.argmax(bad)]), int(np.count_nonzero(bad)))
            keep &= ~bad
    return faces if keep.all() else faces.take(np.flatnonzero(keep))


def recentre(file: Statements, faces: Faces) -> Vec3 | None:
    """Move all points near the origin if float32 would blur them; returns where they were.

    Map coordinates (UTM: 5 000 000 m) keep half a metre in float32. One offset
    for the whole file, so that neighbours still share their borders exactly.
    """
    if not faces.counts.size:
        return None
    used = np.zeros(len(file.points), bool)
    used[faces.corners[:, 0]] = True
    columns = file.points[used].T.copy()  # of long rows NumPy makes faster work
    low, high = columns.min(axis=1), columns.max(axis=1)
    reach = max(float(np.abs(low).max()), float(np.abs(high).max()))
    if reach < _FAR or float((high - low).max()) > reach:
        return None
    centre = np.round((low + high) / 2.0)
    file.points[used] -= centre
    x, y, z = centre.tolist()
    return x, y, z


def mesh_of(file: Statements, faces: Faces, name: str, source: Path, tally: Tally) -> Mesh:
    """The faces of one group as a mesh."""
    used, indices = _compact(faces.corners[:, 0])
    points = file.points.take(used, axis=0)
    line = file.groups[int(faces.group[0])].line or int(faces.lines[0])
    uv = _texcoords(file, faces, tally)
    material, subsets = _materials(faces.material)
    return Mesh(
        name=name,
        source=SourceRef(source, line),
        points=points.astype(np.float32),
        face_counts=np.ascontiguousarray(faces.counts),
        face_indices=indices,
        normals=_normals(file, faces, points, indices, tally),
        normals_interpolation="faceVarying",
        uvs={} if uv is None else {"st": (uv, "faceVarying")},
        colors=_colors(file, used, line, tally),
        material=material,
        subsets=subsets,
    )


def _compact(vertex: Ints) -> tuple[Integers, Ints]:
    """The vertices in use, rising, and the corners as numbers among them."""
    low, high = int(vertex.min()), int(vertex.max())
    if high - low > 8 * vertex.size:  # few corners spread over a large table
        used, indices = np.unique(vertex, return_inverse=True)
        return used.astype(np.int64), indices.astype(np.int32)
    flags = np.zeros(high - low + 1, bool)
    flags[vertex - low] = True
    numbers = np.cumsum(flags, dtype=np.int32) - np.int32(1)
    return np.flatnonzero(flags) + low, numbers[vertex - low]


def _texcoords(file: Statements, faces: Faces, tally: Tally) -> Floats | None:
    index = faces.corners[:, 1]
    bad = index == ABSENT
    if bad.all():
        return None
    values = file.texcoords.take(np.maximum(index, 0), axis=0)
    bad |= _not_finite(values)
    faces.note(tally, "texcoord-missing", bad)
    if bad.all():
        return None
    values[bad] = 0.0
    return values


def _normals(
    file: Statements, faces: Faces, points: Doubles, indices: Ints, tally: Tally
) -> Floats | None:
    index = faces.corners[:, 2]
    bad = index == ABSENT
    if bad.all():
        return None
    values = file.normals.take(np.maximum(index, 0), axis=0)
    none = values == 0.0
    bad |= _not_finite(values) | (none[:, 0] & none[:, 1] & none[:, 2])
    faces.note(tally, "normal-missing", bad)
    if bad.all():
        return None
    if bad.any():
        flat = np.repeat(_face_normals(points[indices], faces), faces.counts, axis=0)
        values[bad] = flat[bad]
    return values


def _not_finite(values: Floats) -> Bools | np.bool_:
    """Of rows, (n,); one False where all are finite."""
    finite = np.isfinite(values)
    return np.False_ if finite.all() else ~finite.all(axis=1)


def _face_normals(corner: Doubles, faces: Faces) -> Doubles:
    """Unit normals of polygons by Newell's sum of cross products; +Z for one of no area."""
    starts = faces.starts
    following = np.arange(1, len(corner) + 1)
    following[starts + faces.counts - 1] = starts
    corner = corner - np.repeat(corner[starts], faces.counts, axis=0)
    area = np.add.reduceat(np.cross(corner, corner[following]), starts, axis=0)
    length = np.sqrt(np.sum(area * area, axis=1))
    area[length == 0.0] = (0.0, 0.0, 1.0)
    return np.asarray(area / np.where(length == 0.0, 1.0, length)[:, None])


def _colors(file: Statements, used: Integers, line: int, tally: Tally) -> Floats | None:
    if file.colors is None:
        return None
    values = file.colors[used]
    missing = ~np.isfinite(values).all(axis=1)
    if missing.all():
        return None
    if missing.any():
        tally.note("vertex-color-missing", line, int(np.count_nonzero(missing)))
        values[missing] = 1.0
    return values


def _materials(material: Ints) -> tuple[int | None, tuple[Subset, ...]]:
    """Either one material for all faces or a subset for each."""
    first = int(material[0])
    if np.all(material == first):
        return first, ()
    order = np.argsort(material, kind="stable").astype(np.int32)
    ranked = material[order]
    cuts = np.flatnonzero(np.diff(ranked)) + 1
    parts = np.split(order, cuts)
    return None, tuple(Subset(int(material[part[0]]), part) for part in parts)
