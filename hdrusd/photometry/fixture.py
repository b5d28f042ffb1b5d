"""Whether a lamp stands inside its own fixture: a pole, a housing or a lantern's glass.

A database of a time without shadows puts its lights where they look well, and that is often
inside a closed mesh. Rays from the light's place say so: of those in all directions most end
on the mesh that holds it, and so do those of its beam, or the light would get out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import PhotometricLight

Floats = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]

#: Share of all directions, and of the beam, that one mesh stops when it holds a lamp: a pole
#: may be open on top. Several meshes together, as panes and a roof, leave less; two walls and
#: the ceiling in a corner of a room stop 7/8.
ALONE, TOGETHER = 0.75, 0.95

#: So much of what is stopped is so within this distance, m. In a corner of a room it is 7/8 at
#: most.
CLOSE, NEAR = 0.9, 0.75

#: m2 and m: the surface of a fixture and the diagonal of its box, at most: those of a pole of
#: 15 m with its arm and lantern. A car has 20 m2 and more, a telephone box 10.
LARGEST_AREA, LONGEST = 10.0, 20.0

#: Rays: 2 % of all directions are ten of them.
_RAYS = 512

#: Pairs of a triangle and a ray that are compared at a time.
_PAIRS = 2_000_000

#: Triangles whose cap is wider than acos of this are tried with every ray.
_WIDE = 0.1

#: Of barycentric coordinates: no ray slips through an edge that two triangles share.
_EDGE = 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """Directions from a lamp, unit vectors: all round, and in its beam with a weight each."""

    round: Floats  # (r, 3)
    beam: Floats  # (b, 3)
    weight: Floats  # (b,) of sum 1


def lamp_rays(light: PhotometricLight, axis: Floats) -> Rays:
    """The rays of a light that shines along ``axis`` (3,).

    A light with a photometric file counts as one that shines all round: what its fixture
    shades is in the file already.
    """
    everywhere = _everywhere()
    if light.profile or (light.cutoff >= 180.0 and light.exponent <= 0.0):
        return Rays(everywhere, everywhere, np.full(_RAYS, 1.0 / _RAYS))
    # A focus ends at right angles to the axis.
    widest = min(light.cutoff, 90.0) if light.exponent > 0.0 else light.cutoff
    beam = _cap(axis, math.cos(math.radians(widest)))
    weight = np.maximum(beam @ axis, 0.0) ** light.exponent if light.exponent > 0.0 else None
    if weight is None or not weight.sum() > 0.0:
        weight = np.ones(_RAYS)
    return Rays(everywhere, beam, weight / weight.sum())


@cache
def _everywhere() -> Floats:
    return _cap(np.array([0.0, 0.0, 1.0]), -1.0)


def _cap(axis: Floats, least: float) -> Floats:
    """(n, 3) unit vectors spread evenly where the cosine to ``axis`` is ``least`` or more.

    Vogel's spiral: equal areas, turned by the golden angle.
    """
    number = np.arange(_RAYS) + 0.5
    along = 1.0 - (1.0 - least) * number / _RAYS
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    turn = number * math.pi * (3.0 - math.sqrt(5.0))
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    frame = np.stack([side, np.cross(axis, side), axis])
    spread = np.stack([across * np.cos(turn), across * np.sin(turn), along], axis=1)
    return np.asarray(spread @ frame)


def distances(triangles: Floats, rays: Floats, least: float) -> Floats:
    """(r,) m along each ray (r, 3) from the origin to the first triangle beyond ``least``.

    ``triangles`` (t, 3, 3): corners in m from the origin; either side stops a ray. Infinite
    where none does. Moeller and Trumbore 1997, for those pairs whose ray lies in the cap
    about a triangle's corners.
    """
    found = np.full(len(rays), np.inf)
    length = np.linalg.norm(triangles, axis=2, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        corners = triangles / length
        middle = corners.sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        cap = np.min(np.einsum("tcx,tx->tc", corners, middle), axis=1)
    wide = ~(cap > _WIDE)  # also where a corner is the origin itself
    cap[wide], middle[wide] = -np.inf, 0.0
    step = max(_PAIRS // len(rays), 1)
    for first in range(0, len(triangles), step):
        some = slice(first, first + step)
        face, ray = np.nonzero(middle[some] @ rays.T >= cap[some, None] - 1e-6)
        corner, way = triangles[some][face], rays[ray]
        one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        across = np.cross(way, two)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            scale = 1.0 / np.einsum("px,px->p", one, across)
            u = -np.einsum("px,px->p", corner[:, 0], across) * scale
            turned = np.cross(-corner[:, 0], one)
            v = np.einsum("px,px->p", way, turned) * scale
            far = np.einsum("px,px->p", two, turned) * scale
            hit = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE) & (far > least)
        np.minimum.at(found, ray[hit], far[hit])
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Stopped:
    """Which rays of a lamp one or several meshes stop."""

    round: Booleans  # (r,) of those all round
    near: Booleans  # (r,) of these within ``NEAR``
    beam: Booleans  # (b,)

    def holds(self, weight: Floats, share: float) -> bool:
        """Whether the lamp is held: ``share`` of all directions and of its beam are stopped."""
        all_round, near = float(self.round.mean()), float(self.near.mean())
        close = all_round >= share and near >= CLOSE * all_round
        return close and float(weight[self.beam].sum()) >= share - 1e-9

    def __or__(self, other: Stopped) -> Stopped:
        return Stopped(self.round | other.round, self.near | other.near, self.beam | other.beam)


def stopped(triangles: Floats, rays: Rays, radius: float) -> Stopped:
    """What triangles (t, 3, 3), in m from the lamp, stop of its rays.

    What is nearer than the lamp's own ``radius`` (m) stops nothing: shadows begin there.
    """
    around = distances(triangles, rays.round, radius)
    same = rays.beam is rays.round
    beam = around if same else distances(triangles, rays.beam, radius)
    return Stopped(np.isfinite(around), around <= NEAR, np.isfinite(beam))


def fixtures(meshes: list[Stopped], rays: Rays) -> list[int]:
    """Which of the small meshes about a lamp are its fixture.

    First those that hold it alone; then those that do so together, if they do, each that
    stops a ray.
    """
    alone = [i for i, mesh in enumerate(meshes) if mesh.holds(rays.weight, ALONE)]
    rest = [i for i in range(len(meshes)) if i not in alone and meshes[i].round.any()]
    if rest:
        whole = meshes[rest[0]]
        for i in rest[1:]:
            whole = whole | meshes[i]
        if whole.holds(rays.weight, TOGETHER):
            return sorted(alone + rest)
    return alone


def area(triangles: Floats) -> float:
    """m2 of triangles (t, 3, 3)."""
    sides = triangles[:, 1:] - triangles[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2.0)
