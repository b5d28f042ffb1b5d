"""Smoothing groups: which faces around a vertex share a normal there.

A face is in any of 32 groups, a bit each. At a vertex a face takes the sum of the
normals of all faces there that share a group with it, each weighted by its angle, so
that how a flat part is cut into triangles makes no difference (G. Thuermer and
C. A. Wuethrich, Computing vertex normals from polygonal facets, 1998). A face in no group
keeps its own.

Source: Autodesk, 3D Studio File Toolkit for release 3, SMOOTH_GROUP.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import Floats

#: Sets of groups in one mesh that are told apart; each costs a pass over its faces.
MOST_SETS = 256

#: A sum of normals, weighted by angles, below which they point apart.
_CANCELLED = 1e-6

Doubles = npt.NDArray[np.float64]
Groups = npt.NDArray[np.uint32]
Corners = npt.NDArray[np.int64]


def reduced(groups: Groups) -> tuple[Groups, bool]:
    """Groups of at most ``MOST_SETS`` different sets, and whether that changed them.

    Where there are more, each face keeps the lowest of its groups alone.
    """
    if len(np.unique(groups)) <= MOST_SETS:
        return groups, False
    return groups & (~groups + np.uint32(1)), True


def smoothed(points: Floats, corners: Corners, groups: Groups) -> Floats:
    """Unit normals at the corners of triangles, (3 f, 3), row by row as ``corners``.

    points: (n, 3); corners: (f, 3) in [0, n); groups: (f,), of few different sets
    (``reduced``). +Z where faces have no area.
    """
    # Components first: of long rows NumPy makes faster work than of many short ones.
    place = np.ascontiguousarray(points.T, np.float64)
    a, b, c = (place[:, corners[:, k]] for k in range(3))
    edges = (b - a, c - b, a - c)
    facing, area = _unit(_cross(edges[0], -edges[2]))
    angles = np.stack([np.arctan2(area, -_dot(edges[k], edges[k - 1])) for k in range(3)])
    out = np.repeat(np.ascontiguousarray(facing.T, np.float32), 3, axis=0).reshape(-1, 3, 3)
    for mask in np.unique(groups).tolist():
        if mask == 0:
            continue
        shared = np.flatnonzero(groups & np.uint32(mask))
        vertices = corners[shared].T.reshape(-1)
        parts = facing[:, None, shared] * angles[:, shared]
        sums = np.stack([np.bincount(vertices, part.reshape(-1), len(points)) for part in parts])
        normal, length = _unit(sums.astype(np.float64, copy=False))
        mine = np.flatnonzero(groups == mask)
        at = corners[mine]
        found = np.ascontiguousarray(normal.T, np.float32)[at]
        whole = length > _CANCELLED  # faces back to back cancel: each keeps its own
        out[mine] = found if whole.all() else np.where(whole[at][:, :, None], found, out[mine])
    return out.reshape(-1, 3)


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
    if none.any():
        vectors = np.where(none, ((0.0,), (0.0,), (1.0,)), vectors)
    return vectors / np.where(none, 1.0, length), length
