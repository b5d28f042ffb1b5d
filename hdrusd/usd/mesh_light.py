"""Mesh lights: ``mesh_light_rows``, points spread over a mesh with MeshLightAPI.

``POINTS`` points of equal share, stratified by area and the same in every frame, each a
Lambertian point that shines on the front of the mesh. Error against the exact light, for a
flat square (tests/usd/test_mesh_light.py): 1 % from one width away, 3 % at half a width, and
nearer the points show. The colour is that of the light's inputs: a bound material's own glow
does not tint it (``light:materialSyncMode``).
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

#: Points that stand for a mesh.
POINTS = 64

#: Steps of the R2 sequence (Roberts 2018): powers of the plastic number.
_R2 = np.array([0.7548776662466927, 0.5698402909980532])


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
    """(POINTS,) ``scene.LIGHT``, none for a mesh without area; and its luminance, cd/m2.

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
    key = light_key(prim)
    chosen, weights = _spread(areas / area, np.random.default_rng(key & 0xFFFFFFFF))
    rows = light_rows(POINTS)
    square_metres = area * meters_per_unit**2
    rows["position"] = np.einsum("nk,nkj->nj", weights, triangles[chosen]) * meters_per_unit
    rows["axis"] = turn[chosen] / (2.0 * areas[chosen])[:, None]
    rows["intensity"] = luminance * square_metres / POINTS
    rows["radius"] = math.sqrt(square_metres / POINTS / math.pi)
    rows["exponent"] = 1.0
    rows["inner"] = rows["outer"] = math.pi / 2
    rows["key"] += key
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
    shares: npt.NDArray[np.float64], generator: np.random.Generator
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.float64]]:
    """Triangles (n,) and barycentric weights (n, 3) of ``POINTS`` points.

    Every point has the same share of the area; those of one triangle lie in it by the R2
    sequence, which fills a square evenly, folded onto it.
    """
    ends = np.cumsum(shares)
    along = (np.arange(POINTS) + 0.5) / POINTS
    chosen = np.minimum(np.searchsorted(ends, along), len(shares) - 1)
    first = np.searchsorted(chosen, chosen)  # of the points in the same triangle
    step = np.arange(POINTS) - first
    u, v = ((generator.random(2) + step[:, None] * _R2) % 1.0).T
    outside = u + v > 1.0
    u, v = np.where(outside, 1.0 - u, u), np.where(outside, 1.0 - v, v)
    return chosen, np.stack([1.0 - u - v, u, v], axis=1)
