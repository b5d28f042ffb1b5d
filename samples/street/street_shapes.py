"""Shape: gathers the faces of one material and turns them into a Mesh.

Faces are given as arrays of corners, counter-clockwise from outside. Without
texture coordinates a face gets "box mapping": the two coordinates that its plane
is most parallel to, over the metres that one repeat of the texture covers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from street_model import Array, Material, Mesh, Vec3

Corners = npt.ArrayLike

#: The corners of a unit cube's faces, counter-clockwise from outside, keyed as ``box`` has them.
_CUBE = {
    "x": ((0, 1, 0), (0, 0, 0), (0, 0, 1), (0, 1, 1)),
    "X": ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)),
    "y": ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)),
    "Y": ((1, 1, 0), (0, 1, 0), (0, 1, 1), (1, 1, 1)),
    "z": ((0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 0)),
    "Z": ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
}


def _unit(vectors: Array) -> Array:
    """``vectors`` (..., 3) at length 1; a zero vector becomes +Z."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    safe = np.where(length > 0.0, length, 1.0)
    return np.where(length > 0.0, vectors / safe, np.array((0.0, 0.0, 1.0)))


def _face_normals(faces: Array) -> Array:
    """(n, 3) unit normals of (n, 3 or 4, 3) corners, by the cross product of diagonals."""
    if faces.shape[1] == 4:
        return _unit(np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1]))
    return _unit(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]))


class Shape:
    """The faces of one material, as they are collected."""

    def __init__(self, material: Material) -> None:
        self.material = material
        self._points: list[Array] = []
        self._normals: list[Array] = []
        self._uvs: list[Array] = []
        self._quads: list[npt.NDArray[np.int64]] = []
        self._tris: list[npt.NDArray[np.int64]] = []
        self._count = 0

    def _add(self, points: Array, normals: Array, uvs: Array | None) -> int:
        """Append vertices; returns the index of the first."""
        if uvs is None:
            uvs = self._box_mapping(points, normals)
        first = self._count
        self._points.append(points)
        self._normals.append(normals)
        self._uvs.append(uvs)
        self._count += len(points)
        return first

    def _box_mapping(self, points: Array, normals: Array) -> Array:
        dominant = np.abs(normals).argmax(axis=1)
        across = np.where(dominant == 0, points[:, 1], points[:, 0])
        up = np.where(dominant == 2, points[:, 1], points[:, 2])
        return np.stack((across, up), axis=1) / self.material.tile

    def faces(self, corners: Corners, uvs: npt.ArrayLike | None = None) -> None:
        """Flat faces: (n, 4, 3) quadrangles or (n, 3, 3) triangles, with (n, ., 2) uvs or none."""
        array = np.asarray(corners, dtype=float)
        n, k = array.shape[:2]
        normals = np.repeat(_face_normals(array), k, axis=0)
        flat = None if uvs is None else np.asarray(uvs, dtype=float).reshape(-1, 2)
        first = self._add(array.reshape(-1, 3), normals, flat)
        index = first + np.arange(n * k).reshape(n, k)
        (self._quads if k == 4 else self._tris).append(index)

    def quad(self, a: Vec3, b: Vec3, c: Vec3, d: Vec3, uvs: npt.ArrayLike | None = None) -> None:
        """One quadrangle."""
        self.faces([(a, b, c, d)], None if uvs is None else [uvs])

    def picture(self, corners: Sequence[Vec3], window: tuple[float, float, float, float]) -> None:
        """One quadrangle (first corner bottom left) that shows the window s0, t0, s1, t1."""
        s0, t0, s1, t1 = window
        self.faces([corners], [((s0, t0), (s1, t0), (s1, t1), (s0, t1))])

    def box(self, low: Vec3, high: Vec3, sides: str = "xXyYzZ") -> None:
        """An axis-parallel box; ``sides`` names its faces, lower case the low end of an axis."""
        low_, size = np.array(low), np.subtract(high, low)
        self.faces(low_ + np.array([_CUBE[s] for s in sides], dtype=float) * size)

    def grid(self, points: npt.ArrayLike, uvs: npt.ArrayLike | None = None) -> None:
        """A smooth surface through (rows, columns, 3) points; its normal is columns x rows.

        A vertex's normal is the mean of its quadrangles', so a first column that
        repeats as the last (a tube) is averaged across the seam.
        """
        p = np.asarray(points, dtype=float)
        rows, columns = p.shape[:2]
        corners = np.stack((p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]), axis=2)
        face = _face_normals(corners.reshape(-1, 4, 3)).reshape(rows - 1, columns - 1, 3)
        normals = np.zeros_like(p)
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            normals[i : rows - 1 + i, j : columns - 1 + j] += face
        if np.allclose(p[:, 0], p[:, -1]):
            normals[:, 0] += normals[:, -1]
            normals[:, -1] = normals[:, 0]
        index = np.arange(rows * columns).reshape(rows, columns)
        quads = np.stack((index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]), axis=2)
        flat = None if uvs is None else np.asarray(uvs, dtype=float).reshape(-1, 2)
        first = self._add(p.reshape(-1, 3), _unit(normals.reshape(-1, 3)), flat)
        self._quads.append(first + quads.reshape(-1, 4))

    def cells(self, points: Array, chosen: npt.NDArray[np.bool_]) -> None:
        """The ``chosen`` (rows-1, columns-1) cells of a plane grid, their vertices shared."""
        rows, columns = points.shape[:2]
        index = np.arange(rows * columns).reshape(rows, columns)
        quads = np.stack((index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]), axis=2)
        used, quads = np.unique(quads[chosen], return_inverse=True)
        flat = points.reshape(-1, 3)[used]
        normal = _face_normals(flat[quads.reshape(-1, 4)[:1]])
        first = self._add(flat, np.repeat(normal, len(flat), axis=0), None)
        self._quads.append(first + quads.reshape(-1, 4))

    def revolve(self, profile: npt.ArrayLike, sides: int, centre: Vec3 = (0.0, 0.0, 0.0)) -> None:
        """A profile of (k, 2) radius and height, from bottom to top, turned about +Z."""
        r, z = np.asarray(profile, dtype=float).T
        turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)
        points = np.stack(
            (
                np.outer(r, np.cos(turn)),
                np.outer(r, np.sin(turn)),
                np.repeat(z[:, None], sides + 1, axis=1),
            ),
            axis=2,
        )
        points[:, -1] = points[:, 0]
        around = np.repeat(turn[None, :] / (2.0 * np.pi), len(r), axis=0)
        up = np.repeat(((z - z[0]) / max(z[-1] - z[0], 1e-6))[:, None], sides + 1, axis=1)
        self.grid(points + np.array(centre), np.stack((around, up), axis=2))

    def extrude(self, profile: npt.ArrayLike, x0: float, x1: float) -> None:
        """A moulding along +X: (k, 2) profile of y and z, from bottom to top, faceted, with ends.

        The profile is the street side of the section; the ends close it to the
        straight line between its first and last point.
        """
        p = np.asarray(profile, dtype=float)
        a, b = p[:-1], p[1:]
        left, right = np.full(len(a), x0), np.full(len(a), x1)
        corners = np.stack(
            (
                np.column_stack((left, a)),
                np.column_stack((right, a)),
                np.column_stack((right, b)),
                np.column_stack((left, b)),
            ),
            axis=1,
        )
        self.faces(corners)
        if len(p) > 2:
            fan0 = [[(x0, *p[0]), (x0, *p[i]), (x0, *p[i + 1])] for i in range(1, len(p) - 1)]
            fan1 = [[(x1, *p[0]), (x1, *p[i + 1]), (x1, *p[i])] for i in range(1, len(p) - 1)]
            self.faces(np.array(fan0))
            self.faces(np.array(fan1))

    def disc(self, centre: Vec3, radius: float, sides: int, facing: str) -> None:
        """A flat disc of an even number of ``sides`` that faces -Y, +X or -X ("y", "X", "x")."""
        turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
        u, v = radius * np.cos(turn), radius * np.sin(turn)
        zero = np.zeros(sides)
        ring = {"y": (u, zero, v), "X": (zero, u, v), "x": (zero, -u, v)}[facing]
        points = np.stack(ring, axis=1) + np.array(centre)
        half = np.arange(sides // 2 - 1)
        strip = np.stack((half, half + 1, sides - 2 - half, sides - 1 - half), axis=1)
        uvs = np.stack((0.5 + 0.5 * np.cos(turn), 0.5 + 0.5 * np.sin(turn)), axis=1)
        self.faces(points[strip], uvs[strip])

    def mesh(self, name: str) -> Mesh:
        """Everything gathered so far, rounded to 1 mm, 1e-4 of a repeat and 1e-4 of a normal."""
        return Mesh(
            name,
            self.material,
            np.round(np.concatenate(self._points), 3) + 0.0,
            np.round(np.concatenate(self._normals), 4) + 0.0,
            np.round(np.concatenate(self._uvs), 4) + 0.0,
            np.concatenate(self._quads or [np.empty((0, 4), np.int64)]),
            np.concatenate(self._tris or [np.empty((0, 3), np.int64)]),
        )


class Kit(dict[str, Shape]):
    """Shapes by material name, made when first asked for: ``kit["Stone"].box(...)``."""

    def __init__(self, materials: dict[str, Material]) -> None:
        super().__init__()
        self._materials = materials

    def __missing__(self, name: str) -> Shape:
        self[name] = Shape(self._materials[name])
        return self[name]

    def meshes(self, prefix: str) -> list[Mesh]:
        """A mesh for each material that was used, named ``prefix_Material``."""
        return [shape.mesh(f"{prefix}_{name}") for name, shape in self.items()]
