"""Walls with holes in them: arches, window recesses, surrounds, hoods, railings.

A facade is modelled facing -Y: X to the right of who looks at it, Z up, Y into
the building. Its wall is the plane y = 0; what projects has negative y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from street_model import Array
from street_shapes import Kit, Shape

#: Mouldings: y and z of the section from bottom to top, in metres, for ``Shape.extrude``.
STRING_COURSE = ((0.0, 0.0), (-0.10, 0.04), (-0.16, 0.16), (-0.16, 0.24), (0.0, 0.30))
CORNICE = (
    (0.0, 0.0),
    (-0.12, 0.05),
    (-0.12, 0.22),
    (-0.38, 0.42),
    (-0.62, 0.46),
    (-0.62, 0.62),
    (0.0, 0.72),
)
HOOD = ((0.0, 0.0), (-0.10, 0.05), (-0.26, 0.12), (-0.26, 0.20), (0.0, 0.26))


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall: straight jambs up to the springing, then an arc (rise 0: a lintel).

    ``rise`` is at most half the width (a semicircle).
    """

    left: float
    right: float
    bottom: float
    springing: float
    rise: float = 0.0
    segments: int = 6

    @property
    def top(self) -> float:
        """Height of the crown."""
        return self.springing + self.rise

    def head(self, offset: float = 0.0) -> Array:
        """(k, 2) x and z of the arc or lintel from left to right, ``offset`` metres outside it."""
        if self.rise == 0.0:
            z = self.springing + offset
            return np.array(((self.left - offset, z), (self.right + offset, z)))
        half = (self.right - self.left) / 2.0
        radius = (half * half + self.rise * self.rise) / (2.0 * self.rise)
        reach = math.asin(min(1.0, half / radius))
        t = np.linspace(-reach, reach, self.segments + 1)
        centre = self.springing + self.rise - radius
        x = (self.left + self.right) / 2.0 + (radius + offset) * np.sin(t)
        return np.stack((x, centre + (radius + offset) * np.cos(t)), axis=1)

    def outline(self, offset: float = 0.0) -> Array:
        """(k, 2) x and z from the foot of the left jamb over the head to that of the right."""
        left = (self.left - offset, self.bottom)
        right = (self.right + offset, self.bottom)
        return np.vstack((left, self.head(offset), right))


def _upright(xz: Array, y: float) -> Array:
    """(..., 2) x and z as (..., 3) points in the plane ``y``."""
    return np.stack((xz[..., 0], np.full(xz.shape[:-1], y), xz[..., 1]), axis=-1)


def rectangle(
    shape: Shape, x0: float, x1: float, z0: float, z1: float, y: float, back: bool = False
) -> None:
    """A plain upright rectangle that faces -Y, or +Y when ``back``; nothing when it is empty."""
    if x1 - x0 < 1e-6 or z1 - z0 < 1e-6:
        return
    a, b = (x1, x0) if back else (x0, x1)
    shape.quad((a, y, z0), (b, y, z0), (b, y, z1), (a, y, z1))


def wall(
    shape: Shape,
    bounds: tuple[float, float, float, float],
    hole: Opening,
    y: float = 0.0,
    back: bool = False,
) -> None:
    """The wall x0, x1, z0, z1 around a hole, its corners shared so that no crack opens."""
    x0, x1, z0, z1 = bounds
    levels = [z for z in (z0, hole.bottom, hole.springing, z1) if z0 <= z <= z1]
    for low, high in pairwise(levels):
        rectangle(shape, x0, hole.left, low, high, y, back)
        rectangle(shape, hole.right, x1, low, high, y, back)
    rectangle(shape, hole.left, hole.right, z0, hole.bottom, y, back)
    head = hole.head()
    above = np.stack((head[:, 0], np.full(len(head), z1)), axis=1)
    corners = np.stack((head[:-1], head[1:], above[1:], above[:-1]), axis=1)
    shape.faces(_upright(corners[:, ::-1] if back else corners, y))


def reveal(shape: Shape, hole: Opening, y0: float, y1: float, sill: bool = True) -> None:
    """The inside of a hole from the plane y0 back to y1: jambs, head and, if asked, its floor."""
    a, b, z0, z1 = hole.left, hole.right, hole.bottom, hole.springing
    shape.quad((a, y0, z0), (a, y1, z0), (a, y1, z1), (a, y0, z1))
    shape.quad((b, y1, z0), (b, y0, z0), (b, y0, z1), (b, y1, z1))
    head = hole.head()
    shape.grid(np.stack((_upright(head, y1), _upright(head, y0))))
    if sill:
        shape.quad((a, y0, z0), (b, y0, z0), (b, y1, z0), (a, y1, z0))


def surround(
    shape: Shape, hole: Opening, width: float, projection: float, inner_edge: bool = False
) -> None:
    """A flat moulding around a hole: its face and outer edge.

    The inner edge is the reveal's, when that begins at the moulding's face.
    """
    inner, outer = hole.outline(), hole.outline(width)
    face = np.stack((inner[:-1], inner[1:], outer[1:], outer[:-1]), axis=1)
    shape.faces(_upright(face, -projection))
    edges = [(outer, -projection, 0.0)]
    if inner_edge:
        edges.append((inner, 0.0, -projection))
    for edge, front, back in edges:
        near, far = _upright(edge, front), _upright(edge, back)
        shape.faces(np.stack((near[:-1], near[1:], far[1:], far[:-1]), axis=1))


def pediment(shape: Shape, x0: float, x1: float, z: float) -> None:
    """A triangular gable above a window, 0.28 m deep."""
    y, mid, top = -0.28, (x0 + x1) / 2.0, z + 0.16 * (x1 - x0) + 0.10
    shape.faces([((x0, y, z + 0.08), (x1, y, z + 0.08), (mid, y, top))])
    shape.faces(
        [
            ((x0, y, z), (x1, y, z), (x1, y, z + 0.08), (x0, y, z + 0.08)),
            ((x0, 0.0, z), (x1, 0.0, z), (x1, y, z), (x0, y, z)),
            ((x1, y, z + 0.08), (x1, 0.0, z + 0.08), (mid, 0.0, top), (mid, y, top)),
            ((x0, 0.0, z + 0.08), (x0, y, z + 0.08), (mid, y, top), (mid, 0.0, top)),
        ]
    )


def railing(iron: Shape, x0: float, x1: float, z: float, y: float, height: float) -> None:
    """Two rails and thin upright bars every 0.3 m, at the plane ``y``."""
    for low in (z + 0.08, z + height - 0.05):
        iron.box((x0, y - 0.02, low), (x1, y + 0.02, low + 0.05), "yYZz")
    bars = np.arange(x0 + 0.15, x1, 0.3)
    edges = ((-0.012, 0.0), (0.0, -0.012), (0.012, 0.0))  # a bar's section: two faces to the street
    foot, head = (
        np.array([[(x + dx, y + dy, h) for dx, dy in edges] for x in bars])
        for h in (z + 0.10, z + height - 0.05)
    )
    for i in (0, 1):
        iron.faces(np.stack((foot[:, i], foot[:, i + 1], head[:, i + 1], head[:, i]), axis=1))


def balcony(kit: Kit, x0: float, x1: float, z: float, depth: float = 0.75) -> None:
    """A stone slab on consoles with an iron railing, its floor at ``z``."""
    stone = kit["Trim"]
    slab = ((0.0, z - 0.22), (-depth + 0.08, z - 0.14), (-depth, z - 0.10), (-depth, z), (0.0, z))
    stone.extrude(slab, x0, x1)
    for x in np.arange(x0 + 0.6, x1 - 0.3, 2.0):
        stone.box((x - 0.1, -0.45, z - 0.5), (x + 0.1, 0.0, z - 0.18), "xXyz")
    railing(kit["Iron"], x0 + 0.04, x1 - 0.04, z, -depth + 0.08, 1.0)


@dataclass(frozen=True, slots=True)
class WindowStyle:
    """How the windows of a storey look. Lengths in metres."""

    width: float
    height: float
    sill: float  # above the storey's floor
    rise: float = 0.0
    surround: float = 0.14
    hood: str = "none"  # "none", "hood", "pediment"
    guard: bool = False


def window(
    kit: Kit,
    wall_name: str,
    bounds: tuple[float, float, float, float],
    style: WindowStyle,
    pane: str,
) -> None:
    """One bay of a storey: the wall x0, x1, z0, z1 with a recessed window in its middle."""
    x0, x1, z0, _ = bounds
    middle, half = (x0 + x1) / 2.0, style.width / 2.0
    springing = z0 + style.sill + style.height - style.rise
    hole = Opening(middle - half, middle + half, z0 + style.sill, springing, style.rise)
    wall(kit[wall_name], bounds, hole)
    trim = kit["Trim"]
    reveal(trim, hole, -0.06, 0.26, sill=False)
    a, b, low, high = hole.left, hole.right, hole.bottom, hole.top
    corners = ((a, 0.22, low), (b, 0.22, low), (b, 0.22, high), (a, 0.22, high))
    kit[pane].picture(corners, (0.0, 0.0, 1.0, 1.0))
    edge = style.surround
    surround(trim, hole, edge, 0.06)
    trim.box((a - edge - 0.06, -0.16, low - 0.12), (b + edge + 0.06, 0.26, low), "xXyzZ")
    if style.hood == "hood":
        profile = np.add(HOOD, (0.0, high + edge))
        trim.extrude(profile, a - edge - 0.14, b + edge + 0.14)
    elif style.hood == "pediment":
        pediment(trim, a - edge - 0.16, b + edge + 0.16, high + edge)
    if style.guard:
        railing(kit["Iron"], a, b, low, -0.06, 0.75)
