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
        """The triangles of the faces marked True; faces without a mark are left out."""
        if len(faces) <= int(self.face.max(initial=-1)):
            faces = np.pad(faces, (0, int(self.face.max()) + 1 - len(faces)))
        return self.where(faces[self.face])

    def where(self, keep: npt.ArrayLike) -> Corners:
        """The triangles marked True, (t,)."""
        keep = np.asarray(keep, np.bool_)
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
    return np.repeat(_directions(_areas(points, tri)), 3, axis=0)


def smooth_normals(points: Floats, tri: Corners) -> Floats:
    """Vertex normals, area-weighted over the triangles that meet, (3 t, 3)."""
    area = _areas(points, tri)
    total = np.zeros((len(points), 3))
    for corner in range(3):
        vertex = tri.vertex[:, corner]
        for axis in range(3):
            total[:, axis] += np.bincount(vertex, area[:, axis], minlength=len(points))
    return _directions(total)[tri.vertex.ravel()]


def _areas(points: Floats, tri: Corners) -> npt.NDArray[np.float64]:
    """(t, 3) area vectors, twice as long as the areas are large."""
    x, y, z = (points[:, axis].astype(np.float64) for axis in range(3))
    a, b, c = np.ascontiguousarray(tri.vertex.T)
    result = np.empty((len(a), 3))
    for axis, (u, v) in enumerate(((y, z), (z, x), (x, y))):
        ua, va = u[a], v[a]
        result[:, axis] = (u[b] - ua) * (v[c] - va) - (v[b] - va) * (u[c] - ua)
    return result


def _directions(vectors: npt.NDArray[np.float64]) -> Floats:
    """Unit vectors (n, 3) float32; those of no length stay 0."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    vectors /= np.where(length > 0.0, length, 1.0)[:, None]
    return vectors.astype(np.float32)
