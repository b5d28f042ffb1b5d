"""Smoothing groups: which faces around a vertex share a normal there.

A face is in any of 32 groups, a bit each. At a vertex a face takes the sum of the
normals of all faces there that share a group with it, each weighted by its angle, so
that how a flat part is cut into triangles makes no difference (G. Thuermer and
C. A. Wuethrich, Computing vertex normals from polygonal facets, 1998). A face in no group
keeps its own.

Source: Autodesk, 3D Studio File Toolkit for release 3, SMOOTH_GROUP.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import Floats

#: Sets of groups in one mesh that are told apart; each costs a pass over its faces.
MOST_SETS = 256

#: Faces at a time: their work arrays stay in the processor's cache.
_BLOCK = 2048

#: Vertices, of all sets together, that one pass may have: so many, or so many a corner.
_FEW, _FEW_A_CORNER = 4096, 4

#: A sum of normals, weighted by angles, below which they point apart.
_CANCELLED = 1e-6

Doubles = npt.NDArray[np.float64]
Groups = npt.NDArray[np.uint32]
Corners = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


def reduced(groups: Groups) -> tuple[Groups, bool]:
    """Groups of at most ``MOST_SETS`` different sets, and whether that changed them.

    Where there are more, each face keeps the lowest of its groups alone.
    """
    if len(_sets(groups)) <= MOST_SETS:
        return groups, False
    return groups & (~groups + np.uint32(1)), True


def smoothed(points: Floats, corners: Corners, groups: Groups) -> Floats:
    """Unit normals at the corners of triangles, (3 f, 3), row by row as ``corners``.

    points: (n, 3); corners: (f, 3) in [0, n); groups: (f,), of few different sets
    (``reduced``). +Z where faces have no area.
    """
    numbers = np.ascontiguousarray(corners.T)
    facing, angles = _measured(points, numbers)
    own = np.ascontiguousarray(facing.T, np.float32)
    out = np.empty((len(own), 3, 3), np.float32)
    if not groups.all():
        out[:] = own[:, None]
    for vertices, count, shared, mine in _passes(numbers, len(points), groups):
        given, taken = _chosen(shared), _chosen(mine)
        weighted = facing[:, None, given] * angles[:, given]
        to = vertices[:, given].reshape(-1)
        sums = np.stack([np.bincount(to, part.reshape(-1), count) for part in weighted])
        normal, length = _unit(sums.astype(np.float64, copy=False))
        at = vertices.T[taken].reshape(-1)
        found = np.ascontiguousarray(normal.T, np.float32).take(at, axis=0)
        whole = length > _CANCELLED  # faces back to back cancel: each keeps its own
        if not whole.all():
            found = np.where(whole.take(at)[:, None], found, np.repeat(own[taken], 3, axis=0))
        out[taken] = found.reshape(-1, 3, 3)
    return out.reshape(-1, 3)


def _measured(points: Floats, numbers: Corners) -> tuple[Doubles, Doubles]:
    """Unit normals (3, f) of faces (3, f), and the angles (3, f) at their corners."""
    # Components first: of long rows NumPy makes faster work than of many short ones.
    place = np.ascontiguousarray(points.T, np.float64)
    facing, angles = np.empty(numbers.shape), np.empty(numbers.shape)
    for start in range(0, numbers.shape[1], _BLOCK):
        block = slice(start, start + _BLOCK)
        a, b, c = (place.take(row[block], axis=1) for row in numbers)
        edges = (b - a, c - b, a - c)
        facing[:, block], area = _unit(_cross(edges[0], -edges[2]))
        for k in range(3):
            np.arctan2(area, -_dot(edges[k], edges[k - 1]), out=angles[k, block])
    return facing, angles


def _passes(
    numbers: Corners, count: int, groups: Groups
) -> Iterator[tuple[Corners, int, Bools, Bools]]:
    """How to sum: vertices (3, f) of faces, their count, and which faces give and which take.

    One pass for each set, over all faces that share a group with it. Sets that share none
    need one pass for all, if each has vertices of its own and these do not become too many.
    """
    sets = _sets(groups[groups != 0])
    if np.bitwise_or.reduce(sets) == sets.sum(dtype=np.uint64) and (
        len(sets) == 1 or len(sets) * count <= max(_FEW, _FEW_A_CORNER * numbers.size)
    ):
        some = groups != 0
        apart = numbers + np.searchsorted(sets, groups) * count if len(sets) > 1 else numbers
        yield apart, count * len(sets), some, some
        return
    for mask in sets:
        yield numbers, count, (groups & mask) != 0, groups == mask


def _sets(groups: Groups) -> Groups:
    """The different ones, rising."""
    alike = len(groups) > 0 and bool((groups == groups[0]).all())
    return groups[:1] if alike else np.unique(groups)


def _chosen(faces: Bools) -> slice | npt.NDArray[np.int64]:
    """An index for the marked ones; of all it costs no copy."""
    return slice(None) if faces.all() else np.flatnonzero(faces)


def _cross(a: Doubles, b: Doubles) -> Doubles:
    """Of vectors (3, k)."""
    x, y, z = a
    u, v, w = b
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u])


def _dot(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _unit(vectors: Doubles) -> tuple[Doubles, Doubles]:
    """Vectors (3, k) at length 1, +Z for those of none, and their lengths (k,)."""
    length = np.sqrt(_dot(vectors, vectors))
    none = length == 0.0
    if not none.any():
        return vectors / length, length
    vectors = np.where(none, ((0.0,), (0.0,), (1.0,)), vectors)
    return vectors / np.where(none, 1.0, length), length
