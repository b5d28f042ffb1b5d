"""Mesh lights: ``mesh_light_rows``, points spread over a mesh with MeshLightAPI.

About ``POINTS`` Lambertian points that shine on the front of the mesh, the same in every
frame: of a mesh of no more triangles, the centroids of the equal parts into which each is cut;
of a larger one, the middles of triangles picked at equal steps of the area. Error against the
exact light, for a flat square (tests/usd/test_mesh_light.py): 1 % from one width away, 3 % at
half a width, and nearer the points show. The colour is that of the light's inputs: the glow of
a bound material does not tint it (``light:materialSyncMode``).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from pxr import Gf, Usd, UsdGeom, UsdLux

from hdrusd.report import Report
from hdrusd.scene import Draw, light_rows
from hdrusd.usd.bindings import Bindings
from hdrusd.usd.geometry import GeometryReader
from hdrusd.usd.gprims import GprimReader
from hdrusd.usd.instancer import Instancers
from hdrusd.usd.light import light_time_varying
from hdrusd.usd.light_controls import light_key, read_controls
from hdrusd.usd.lux import nits, normalized
from hdrusd.usd.varying import hides, place_varies

#: Points that stand for a mesh; up to 144 where its triangles are few and uneven.
POINTS = 64


def is_mesh_light(prim: Usd.Prim) -> bool:
    """Whether a mesh is a light."""
    return bool(prim.IsA(UsdGeom.Mesh)) and bool(prim.HasAPI(UsdLux.MeshLightAPI))


def mesh_light_rows(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    world: Gf.Matrix4d,
    meters_per_unit: float,
    report: Report,
) -> tuple[npt.NDArray[np.void], tuple[float, float, float]]:
    """(n,) ``scene.LIGHT``, none for a mesh without area; and its luminance, cd/m2.

    With ``normalize`` the luminance is divided by the area in scene units, as of all lights.
    """
    triangles = _triangles(prim, time, np.array(world, np.float64), report)
    turn = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    if np.linalg.det(np.array(world, np.float64)[:3, :3]) < 0.0:
        turn = -turn
    areas = 0.5 * np.linalg.norm(turn, axis=1)
    area = float(areas.sum())
    if not (0.0 < area < math.inf):
        return light_rows(0), (0.0, 0.0, 0.0)
    luminance = np.asarray(nits(prim, time)) / (area if normalized(prim, time) else 1.0)
    chosen, weights, shares = _spread(areas / area)
    rows = light_rows(len(chosen))
    square_metres = area * meters_per_unit**2
    rows["position"] = np.einsum("nk,nkj->nj", weights, triangles[chosen]) * meters_per_unit
    rows["axis"] = turn[chosen] / np.maximum(2.0 * areas[chosen], 1e-300)[:, None]
    rows["intensity"] = luminance * (shares * square_metres)[:, None]
    # No nearer than this is a point's light that of its part.
    rows["radius"] = np.sqrt(shares * square_metres / math.pi)
    rows["exponent"] = 1.0
    rows["inner"] = rows["outer"] = math.pi / 2
    rows["key"] += light_key(prim)
    read_controls(prim, time, rows, report)
    return rows, (float(luminance[0]), float(luminance[1]), float(luminance[2]))


class MeshLight:
    """A mesh that is a light: its rows and what is seen of it, kept unless it varies."""

    def __init__(
        self, prim: Usd.Prim, bindings: Bindings, meters_per_unit: float, report: Report
    ) -> None:
        self.prim = prim
        self.report = report
        self.unit = meters_per_unit
        self.luminance = (0.0, 0.0, 0.0)
        self.moving = light_time_varying(prim) or place_varies(prim) or hides(prim)
        self._bindings = bindings
        self._rows: npt.NDArray[np.void] | None = None
        self._shape: GprimReader | None = None

    def rows(self, cache: UsdGeom.XformCache) -> npt.NDArray[np.void]:
        """Its points as ``scene.LIGHT``."""
        if self._rows is None or self.moving:
            world = cache.GetLocalToWorldTransform(self.prim)
            self._rows, self.luminance = mesh_light_rows(
                self.prim, cache.GetTime(), world, self.unit, self.report
            )
        return self._rows

    def draws(self, cache: UsdGeom.XformCache) -> tuple[Draw, ...]:
        """The mesh in the materials that it wears, which the light's luminance replaces."""
        if self._shape is None:
            nothing = Instancers(self.prim.GetStage(), (), self.report)
            self._shape = GprimReader(
                self._bindings, nothing, self.report, meters_per_unit=self.unit
            )
            self._shape.add(self.prim, cache.GetTime())
        return self._shape.draws(cache, cache.GetTime())


def _triangles(
    prim: Usd.Prim, time: Usd.TimeCode, world: npt.NDArray[np.float64], report: Report
) -> npt.NDArray[np.float64]:
    """(t, 3, 3) in the world, scene units."""
    cut = GeometryReader(prim, time, report).cut(str(prim.GetPath()), None, [], "", 0)
    if cut is None:
        return np.zeros((0, 3, 3))
    points = cut.points.astype(np.float64) @ world[:3, :3] + world[3, :3]
    return np.asarray(points.reshape(-1, 3, 3))


def _spread(
    shares: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Triangles (n,), barycentric weights (n, 3) and shares of the area (n,) of the points."""
    if len(shares) > POINTS:
        along = (np.arange(POINTS) + 0.5) / POINTS
        chosen = np.minimum(np.searchsorted(np.cumsum(shares), along), len(shares) - 1)
        return chosen, np.full((POINTS, 3), 1.0 / 3.0), np.full(POINTS, 1.0 / POINTS)
    cuts = np.maximum(np.rint(np.sqrt(POINTS * shares)), 1.0).astype(np.int64)
    parts = []
    for m in np.unique(cuts):
        members, inside = np.flatnonzero(cuts == m), _centroids(int(m))
        chosen = np.repeat(members, len(inside))
        parts.append((chosen, np.tile(inside, (len(members), 1)), shares[chosen] / m**2))
    chosen, weights, share = (np.concatenate(column) for column in zip(*parts, strict=True))
    return chosen, weights, share


def _centroids(m: int) -> npt.NDArray[np.float64]:
    """(m^2, 3) barycentric centroids of the equal triangles that cut each side in m."""
    i, j = np.divmod(np.arange(m * m), m)
    up, down = i + j <= m - 1, i + j <= m - 2
    u = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / m
    v = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / m
    return np.stack([1.0 - u - v, u, v], axis=1)
