"""Polygons to triangles and corners, without a loop over faces.

Faces are fanned from their first corner, as Hydra does (UsdGeomMesh has no other
rule). A corner array has one row for each corner of each triangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """For each triangle corner, where its values are: (t, 3) each but ``face`` (t,)."""

    vertex: Ints  # index into the points
    corner: Ints  # index into the face-varying values
    face: Ints  # which face the triangle came from

    def take(self, values: npt.NDArray[np.generic], interpolation: str) -> Floats | None:
        """Values of a primvar at each corner, (3 t, .) float32; None where the sizes disagree."""
        count = len(values)
        if interpolation == "constant" or (count == 1 and interpolation != "faceVarying"):
            index = np.zeros(self.vertex.size, np.int64)
        elif interpolation in ("vertex", "varying"):
            index = self.vertex.ravel()
        elif interpolation == "faceVarying":
            index = self.corner.ravel()
        elif interpolation == "uniform":
            index = np.repeat(self.face, 3)
        else:
            return None
        if index.size and int(index.max(initial=0)) >= count:
            return None
        return np.ascontiguousarray(values[index], np.float32)

    def select(self, faces: npt.NDArray[np.bool_]) -> Corners:
        """The triangles of the faces marked True."""
        keep = faces[self.face]
        return Corners(self.vertex[keep], self.corner[keep], self.face[keep])


def corners(
    counts: npt.NDArray[np.integer], indices: npt.NDArray[np.integer], *, left_handed: bool
) -> Corners:
    """Triangulate. ``counts`` (f,), ``indices`` (sum of counts,). ValueError if they disagree."""
    counts = np.asarray(counts, np.int64)
    indices = np.asarray(indices, np.int64)
    if counts.size and counts.min() < 0:
        raise ValueError("a face has a negative number of corners")
    if counts.sum() != indices.size:
        raise ValueError(f"faces name {counts.sum()} corners, {indices.size} are given")
    start = np.cumsum(counts) - counts
    triangles = np.maximum(counts - 2, 0)
    face = np.repeat(np.arange(counts.size), triangles)
    first = np.cumsum(triangles) - triangles
    step = np.arange(face.size) - first[face]
    base = start[face]
    corner = np.stack([base, base + step + 1, base + step + 2], axis=1)
    if left_handed:
        corner = corner[:, [0, 2, 1]]
    return Corners(indices[corner], corner, face)


def face_normals(points: Floats, tri: Corners) -> Floats:
    """Flat normals, (3 t, 3): one direction for a triangle's three corners, not unit length."""
    a, b, c = (points[tri.vertex[:, i]].astype(np.float64) for i in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0.0, length, 1.0)
    return np.repeat(normal, 3, axis=0).astype(np.float32)


def smooth_normals(points: Floats, tri: Corners) -> Floats:
    """Vertex normals, area-weighted over the triangles that meet, (3 t, 3)."""
    p = points.astype(np.float64)
    a, b, c = (p[tri.vertex[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    total = np.zeros((len(points), 3))
    for axis in range(3):
        weights = np.repeat(area[:, axis], 3)
        total[:, axis] = np.bincount(tri.vertex.ravel(), weights, minlength=len(points))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    total /= np.where(length > 0.0, length, 1.0)
    return total[tri.vertex.ravel()].astype(np.float32)
