"""Where beams go and how fast they fade: cones against balls, bounds on derivatives.

A ball that holds what a tile shows, a beam of ``light.py`` (cone and focus about an axis):
which balls does it miss, which lie in its full part, and how far may the share of its axial
intensity change from one direction to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import inverse_edge
from hdrusd.scene import NO_CONE

Floats = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]

#: Roundings of float32 places that may not decide what is inside of a cone, relative.
_ROUNDING = 4e-6


@dataclass(frozen=True, slots=True, eq=False)
class Beams:
    """Cone and focus of lights: one row each, so that many are fetched at once."""

    #: (n, 11): axis; cosine and sine of the outer angle, of the inner one; 1 for a cone,
    #: 0 for none; exponent; factors of the second-order bound in the full part and in the edge.
    table: Floats

    def take(self, number: npt.NDArray[Any]) -> Beams:
        """Those of ``number`` (m,), with repeats."""
        return Beams(np.take(self.table, number, axis=0))

    @property
    def full(self) -> Floats:
        """Factor of the second-order bound of lightcut.py where the beam is full."""
        return self.table[:, 9]

    @property
    def edge(self) -> Floats:
        """The same where it may fade."""
        return self.table[:, 10]

    def along_and_across(self, way: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats]:
        """How far ``way``, from the lights to places, goes along the axis and off it, m."""
        (x, y, z), (a, b, c) = way, self.table.T[:3]
        # Not from d2 and the first, which leaves nothing of a narrow beam's width.
        u, v, w = y * c - z * b, z * a - x * c, x * b - y * a
        return x * a + y * b + z * c, np.sqrt(u * u + v * v + w * w)

    def misses(self, along: Floats, across: Floats, distance: Floats, ball: Floats) -> Bools:
        """True where no point of a ball (its radius, m) about the place is in the outer cone."""
        cosine, sine = self.table.T[3:5]
        # From the cone's side; from its tip where that is nearer.
        to_side = across * cosine - along * sine
        behind = along * cosine + across * sine < 0.0
        to_cone = np.where(behind & (to_side > 0.0), distance, to_side)
        return np.asarray((self.table[:, 7] > 0.0) & (to_cone > ball + _ROUNDING * distance))

    def holds(self, along: Floats, across: Floats, distance: Floats, ball: Floats) -> Bools:
        """True where the whole ball is in the full part of the cone, or there is no cone."""
        cosine, sine = self.table.T[5:7]
        within = along * sine - across * cosine
        return np.asarray((self.table[:, 7] == 0.0) | (within > ball + _ROUNDING * distance))

    def least_focus(self, along: Floats, across: Floats, distance: Floats, ball: Floats) -> Floats:
        """A lower bound of |cos|^exponent over the ball."""
        exponent = self.table[:, 8]
        if not np.any(exponent):
            return np.ones_like(exponent)
        sine = np.minimum(ball / np.maximum(distance, 1e-20), 1.0)
        cosine = along * np.sqrt(1.0 - sine * sine) - across * sine
        cosine = np.clip(cosine / np.maximum(distance, 1e-20), 1e-9, 1.0)
        return np.where(exponent > 0.0, cosine**exponent, np.float32(1.0))


def beams_of(lights: npt.NDArray[np.void]) -> Beams:
    """The beams of lights (dtype LIGHT)."""
    cone = lights["outer"] < NO_CONE
    outer = np.where(cone, lights["outer"], np.pi)
    inner = np.where(cone, np.minimum(lights["inner"], outer), np.pi)
    # Slope and curvature of the share over directions: smoothstep, and |cos|^k.
    width = inverse_edge(inner, outer)
    slope, bend = 1.5 * width, 6.0 * width * width + 1.5 * width
    focus = lights["exponent"]
    focus_slope, focus_bend = np.sqrt(focus), focus + np.sqrt(focus)
    both_slope, both_bend = slope + focus_slope, bend + 2.0 * slope * focus_slope + focus_bend
    full = (focus_bend + 4.0 * focus_slope + 6.0) / 6.0
    edge = (both_bend + 4.0 * both_slope + 6.0) / 6.0
    columns = [np.cos(outer), np.sin(outer), np.cos(inner), np.sin(inner), cone, focus, full, edge]
    return Beams(np.column_stack([lights["axis"], *columns]).astype(np.float32))
