"""UsdGeom's implicit shapes as polygons: Cube, Sphere, Cylinder(_1), Cone, Capsule(_1), Plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from hdrusd.usd.surface import Surface
from hdrusd.usd.triangles import corners, face_normals

#: Sides of a round shape: at 48 the silhouette is within 0.2 % of the radius.
SIDES = 48

_AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Polygons of a shape; ``normals`` one for each point, or None for flat faces."""

    points: npt.NDArray[np.float32]
    counts: npt.NDArray[np.int64]
    indices: npt.NDArray[np.int64]
    normals: npt.NDArray[np.float32] | None


def read_shape(prim: Usd.Prim, time: Usd.TimeCode) -> Shape | None:
    """Polygons of an implicit shape at a time; None for any other prim."""
    if prim.IsA(UsdGeom.Cube):
        return _cube(float(UsdGeom.Cube(prim).GetSizeAttr().Get(time)))
    if prim.IsA(UsdGeom.Plane):
        plane = UsdGeom.Plane(prim)
        width, length = plane.GetWidthAttr().Get(time), plane.GetLengthAttr().Get(time)
        axis = plane.GetAxisAttr().Get(time)
        # Width lies along x, or z where the axis is X; length along y, or z where it is Y.
        sides = (width, length) if axis == "Z" else (length, width)
        return _plane(float(sides[0]), float(sides[1]), axis)
    if prim.IsA(UsdGeom.Sphere):
        radius = float(UsdGeom.Sphere(prim).GetRadiusAttr().Get(time))
        angle = np.linspace(-np.pi / 2, np.pi / 2, SIDES // 2 + 1)
        return _revolve(np.cos(angle), np.sin(angle), np.cos(angle), np.sin(angle), radius, "Z")
    for kind in (UsdGeom.Cylinder, UsdGeom.Cone, UsdGeom.Capsule):
        if prim.IsA(kind):
            shape = kind(prim)
            radius = float(shape.GetRadiusAttr().Get(time))
            height = float(shape.GetHeightAttr().Get(time))
            top = 0.0 if kind is UsdGeom.Cone else radius
            capped = kind is UsdGeom.Capsule
            return _round(radius, top, height, shape.GetAxisAttr().Get(time), domes=capped)
    for kind in (UsdGeom.Cylinder_1, UsdGeom.Capsule_1):
        if prim.IsA(kind):
            shape = kind(prim)
            bottom = float(shape.GetRadiusBottomAttr().Get(time))
            top = float(shape.GetRadiusTopAttr().Get(time))
            height = float(shape.GetHeightAttr().Get(time))
            capped = kind is UsdGeom.Capsule_1
            return _round(bottom, top, height, shape.GetAxisAttr().Get(time), domes=capped)
    return None


def shape_surface(prim: Usd.Prim, time: Usd.TimeCode) -> Surface | None:
    """The surface of an implicit shape at a time; None for any other prim."""
    shape = read_shape(prim, time)
    if shape is None:
        return None
    left_handed = UsdGeom.Gprim(prim).GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded
    points, normals = shape.points, shape.normals
    return Surface(
        points,
        corners(shape.counts, shape.indices, left_handed=left_handed),
        lambda some: (
            face_normals(points, some) if normals is None else normals[some.vertex.ravel()]
        ),
        lambda values, interpolation, some: some.take(values, interpolation),
    )


def _round(bottom: float, top: float, height: float, axis: str, *, domes: bool) -> Shape:
    """A profile (radius, height, normal's two parts) revolved about the axis.

    ``domes``: half spheres at both ends, else flat discs, none where the radius is 0.
    """
    h = height / 2
    slope = float(np.hypot(height, bottom - top)) or 1.0
    nr, nz = np.full(2, height / slope), np.full(2, (bottom - top) / slope)
    r, z = np.array([bottom, top]), np.array([-h, h])
    if domes:
        angle = np.linspace(0.0, np.pi / 2, SIDES // 4 + 1)
        cos, sin = np.cos(angle), np.sin(angle)
        r = np.concatenate([bottom * cos[::-1], r, top * cos])
        z = np.concatenate([-h - bottom * sin[::-1], z, h + top * sin])
        nr, nz = np.concatenate([cos[::-1], nr, cos]), np.concatenate([-sin[::-1], nz, sin])
    else:
        r, z = np.array([0.0, bottom, *r]), np.array([-h, -h, *z])
        nr, nz = np.array([0.0, 0.0, *nr]), np.array([-1.0, -1.0, *nz])
        if top != 0.0:
            r, z = np.array([*r, top, 0.0]), np.array([*z, h, h])
            nr, nz = np.array([*nr, 0.0, 0.0]), np.array([*nz, 1.0, 1.0])
    return _revolve(r, z, nr, nz, 1.0, axis)


def _revolve(
    r: npt.NDArray[Any],
    z: npt.NDArray[Any],
    nr: npt.NDArray[Any],
    nz: npt.NDArray[Any],
    scale: float,
    axis: str,
) -> Shape:
    turn = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
    cos, sin = np.cos(turn)[None, :], np.sin(turn)[None, :]

    def ring(radial: npt.NDArray[Any], axial: npt.NDArray[Any]) -> npt.NDArray[Any]:
        flat = np.stack(
            np.broadcast_arrays(radial[:, None] * cos, radial[:, None] * sin, axial[:, None]), -1
        )
        return flat.reshape(-1, 3)[:, _AXES[axis]]

    rows, columns = np.mgrid[0 : len(r) - 1, 0:SIDES]
    after = (columns + 1) % SIDES
    quads = np.stack(
        [
            rows * SIDES + columns,
            rows * SIDES + after,
            (rows + 1) * SIDES + after,
            (rows + 1) * SIDES + columns,
        ],
        -1,
    ).reshape(-1, 4)
    return Shape(
        (ring(r, z) * scale).astype(np.float32),
        np.full(len(quads), 4, np.int64),
        quads.ravel(),
        ring(nr, nz).astype(np.float32),
    )


def _cube(size: float) -> Shape:
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Shape(
        np.asarray(points * size / 2, np.float32),
        np.full(6, 4, np.int64),
        np.array(quads, np.int64).ravel(),
        None,
    )


def _plane(first: float, second: float, axis: str) -> Shape:
    corner = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    corner *= np.array([first / 2, second / 2, 0], np.float32)
    return Shape(
        np.asarray(corner[:, _AXES[axis]], np.float32),
        np.array([4], np.int64),
        np.arange(4),
        None,
    )
