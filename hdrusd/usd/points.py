"""UsdGeomPoints: a small sphere at each point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from hdrusd.report import Kind
from hdrusd.usd.arrays import rows
from hdrusd.usd.surface import Floats, Note, Surface
from hdrusd.usd.triangles import Corners, corners

#: Points that are drawn as an icosahedron each; more are octahedra.
_FEW = 1 << 16

#: Points that are drawn at all, of one prim: 1 GiB of corners.
MOST_POINTS = 1 << 20

#: Width of points and curves that state none: Hydra's.
DEFAULT_WIDTH = 1.0

_G = (1.0 + 5.0**0.5) / 2.0
_ICOSAHEDRON = np.array(
    [
        *([-1, _G, 0], [1, _G, 0], [-1, -_G, 0], [1, -_G, 0]),
        *([0, -1, _G], [0, 1, _G], [0, -1, -_G], [0, 1, -_G]),
        *([_G, 0, -1], [_G, 0, 1], [-_G, 0, -1], [-_G, 0, 1]),
    ]
) / np.sqrt(1.0 + _G * _G)
_ICOSAHEDRON_FACES = np.array(
    [
        *([0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11]),
        *([1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8]),
        *([3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9]),
        *([4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]),
    ]
)
_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_OCTAHEDRON_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
)


def read_points(prim: Usd.Prim, time: Usd.TimeCode, note: Note) -> Surface | None:
    """Spheres of few sides at the points, as wide as ``widths`` says, with round normals."""
    schema = UsdGeom.Points(prim)
    given = rows(schema.GetPointsAttr().Get(time), 3)
    if given is None:
        return None
    points = given[:, :3].astype(np.float32)
    if len(points) > MOST_POINTS:
        text = f"the first {MOST_POINTS} of {len(points)} points are drawn"
        note(Kind.CLAMPED, "points-limit", text)
        points = points[:MOST_POINTS]
    widths = given_widths(schema, time, note)
    if len(widths) not in (1, len(given)):
        text = f"{len(widths)} widths for {len(given)} points; {DEFAULT_WIDTH:g} is used"
        note(Kind.INVALID, "width", text)
        widths = np.array([DEFAULT_WIDTH], np.float32)
    radii = np.broadcast_to(widths[: len(points)] / 2.0, len(points))
    keep = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(radii) & (radii > 0.0))
    if len(keep) < len(points):
        text = "points without a finite place and a positive width are left out"
        note(Kind.INVALID, "mesh-not-finite", text)
    few = len(keep) <= _FEW
    ball = (_ICOSAHEDRON if few else _OCTAHEDRON).astype(np.float32)
    faces = _ICOSAHEDRON_FACES if few else _OCTAHEDRON_FACES
    shell = (points[keep, None] + radii[keep, None, None] * ball).reshape(-1, 3)
    indices = faces + len(ball) * np.arange(len(keep))[:, None, None]
    tri = corners(np.full(len(keep) * len(faces), 3), indices.ravel(), left_handed=False)
    return Surface(
        shell,
        tri,
        lambda some: ball[some.vertex.ravel() % len(ball)],
        lambda values, interpolation, some: _expand(
            values, interpolation, some, keep[some.vertex // len(ball)]
        ),
    )


def given_widths(schema: UsdGeom.Points | UsdGeom.Curves, time: Usd.TimeCode, note: Note) -> Floats:
    """(n,) primvars:widths, then widths, then ``DEFAULT_WIDTH``, which is a finding."""
    primvar = UsdGeom.PrimvarsAPI(schema).GetPrimvar("widths")
    stated = primvar and primvar.HasValue()
    value = primvar.ComputeFlattened(time) if stated else schema.GetWidthsAttr().Get(time)
    widths = rows(value, 1)
    if widths is None:
        note(Kind.ASSUMED, "width", f"no widths; {DEFAULT_WIDTH:g} is used, as in Hydra")
        return np.array([DEFAULT_WIDTH], np.float32)
    return widths[:, 0].astype(np.float32)


def _expand(
    values: npt.NDArray[np.generic],
    interpolation: str,
    tri: Corners,
    point: npt.NDArray[np.int64],
) -> Floats | None:
    """Values at the corners; ``point`` (t, 3) is the one that each corner's ball is of."""
    every = interpolation in ("vertex", "varying", "faceVarying")
    return Corners(point, point, tri.face).take(values, "vertex" if every else "constant")
