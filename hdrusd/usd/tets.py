"""TetMesh: its surface, as usdrecord shows it."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from hdrusd.report import Kind
from hdrusd.usd.arrays import integers, rows
from hdrusd.usd.surface import Note, Surface
from hdrusd.usd.triangles import corners, face_normals


def read_tets(prim: Usd.Prim, time: Usd.TimeCode, note: Note) -> Surface | None:
    """The outer triangles, those authored or else those of one tetrahedron only; flat."""
    mesh = UsdGeom.TetMesh(prim)
    given = rows(mesh.GetPointsAttr().Get(time), 3)
    faces = rows(mesh.GetSurfaceFaceVertexIndicesAttr().Get(time), 3)
    if faces is None and rows(mesh.GetTetVertexIndicesAttr().Get(time), 4) is not None:
        faces = rows(UsdGeom.TetMesh.ComputeSurfaceFaces(mesh, time), 3)
    if given is None or faces is None or faces.dtype.kind not in "iu":
        return None
    points = given[:, :3].astype(np.float32)
    indices = integers(faces[:, :3].ravel())
    left_handed = mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded
    tri = corners(np.full(len(faces), 3), indices, left_handed=left_handed)
    there = ((tri.vertex >= 0) & (tri.vertex < len(points))).all(axis=1)
    if not there.all():
        note(Kind.INVALID, "mesh-index", "faces name points that are not there; left")
        tri = tri.where(there)
    finite = np.asarray(np.isfinite(points).all(axis=1))
    if not finite.all():
        note(Kind.INVALID, "mesh-not-finite", "points are not finite; their faces left")
        tri = tri.where(finite[tri.vertex].all(axis=1))
    return Surface(
        points,
        tri,
        lambda some: face_normals(points, some),
        lambda values, interpolation, some: some.take(values, interpolation),
    )
