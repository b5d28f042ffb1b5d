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
    across = _unit(_face_vectors(points, corners))
    weighted = across[:, None, :] * _angles(points, corners)[:, :, None]
    out = np.repeat(across[:, None, :], 3, axis=1)
    for mask in np.unique(groups).tolist():
        if mask == 0:
            continue
        shared = np.flatnonzero(groups & np.uint32(mask))
        vertices = corners[shared].reshape(-1)
        parts = weighted[shared].reshape(-1, 3)
        axes = (np.bincount(vertices, parts[:, axis], len(points)) for axis in range(3))
        sums = np.stack([np.asarray(axis, np.float64) for axis in axes], axis=1)
        mine = np.flatnonzero(groups == mask)
        found = sums[corners[mine]]
        # Faces back to back cancel: each keeps its own.
        whole = np.einsum("ijk,ijk->ij", found, found) > 1e-12
        out[mine] = np.where(whole[:, :, None], _unit(found), out[mine])
    return np.ascontiguousarray(out.reshape(-1, 3), np.float32)


def _face_vectors(points: Floats, corners: Corners) -> Doubles:
    a, b, c = (points[corners[:, k]].astype(np.float64) for k in range(3))
    return np.cross(b - a, c - a).astype(np.float64)


def _angles(points: Floats, corners: Corners) -> Doubles:
    """The angle of each triangle at each corner, (f, 3), radians; 0 beside an edge of no length."""
    place = points[corners].astype(np.float64)
    there, back = np.roll(place, -1, axis=1) - place, np.roll(place, 1, axis=1) - place
    sine = np.linalg.norm(np.cross(there, back), axis=2)
    return np.asarray(np.arctan2(sine, np.einsum("ijk,ijk->ij", there, back)))


def _unit(vectors: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    up = np.broadcast_to((0.0, 0.0, 1.0), vectors.shape)
    return np.where(length > 0.0, vectors / np.where(length > 0.0, length, 1.0), up)
