"""Light points of OpenFlight and OpenSceneGraph: points that glow become strings of lamps.

Points of one colour, intensity, size and beam are one ``legacy.scene.Light`` with many
positions. The colour is that on the screen, times the intensity; candela are the business of
the estimate rules, as neither format has a unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import Light

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Different looks of the points of one node, each a light. With more, colours are rounded to
#: quarters; where that is not enough, sizes, intensities and beams are, too, ever more coarsely.
MOST_LOOKS = 256
_COARSER = (0, 1, 2, 3, 4, 6, 8, 16, 64, 256, 1024)

#: Half-angle of a lamp that shines to all sides, degrees.
ALL_SIDES = 180.0

#: Turns at which the outline of a lobe is looked at: its mean converges faster than any power.
_TURNS = 256


@dataclass(frozen=True, slots=True)
class LightPoints:
    """The points of one node, (n,) each but where noted."""

    position: Doubles  # (n, 3), source units
    color: Doubles  # (n, 3), as on the screen
    intensity: Doubles  # factor on the colour
    radius: Doubles  # source units; 0: not stated
    cutoff: Doubles  # degrees, half-angle of the beam; ALL_SIDES is none
    inner: Doubles  # degrees, half-angle of the full part
    direction: Doubles  # (n, 3), the way that the beam goes; not used without one
    on: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        """How many there are."""
        return len(self.position)


def strings(
    points: LightPoints,
    name: str,
    source: SourceRef,
    notes: Callable[[int], Mapping[str, Any]],
) -> tuple[list[Light], bool]:
    """A light for each look of the points, and whether looks had to be rounded to be fewer.

    ``notes``: the raw values of the point of a row, for ``Light.extras``.
    """
    look, first, which = _looks(points)
    rounded = len(first) > MOST_LOOKS
    for level in _COARSER:
        if len(first) <= MOST_LOOKS:
            break
        look, first, which = _looks(_rounded(points, level))
    order = np.argsort(which, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(which, minlength=len(first)))[:-1])
    # In the order in which they stand in the file.
    made = [
        _string(points, groups[group], look[group], name, source, notes(int(first[group])))
        for group in np.argsort(first).tolist()
    ]
    return made, rounded


def _rounded(points: LightPoints, level: int) -> LightPoints:
    """Looks that are fewer: at level 0 by their colours, in quarters.

    At 1 by colours, sizes and intensities in quarters of an octave, angles in steps of 5
    degrees; each level doubles these. What shines goes on to.
    """
    if level == 0:
        return replace(points, color=np.round(points.color * 4.0) / 4.0)
    coarse = 2.0 ** (level - 1)
    beam, step = points.cutoff < ALL_SIDES, min(5.0 * coarse, 90.0)
    cutoff = np.clip(np.round(points.cutoff / step) * step, step, ALL_SIDES - 5.0)
    inner = np.minimum(np.round(points.inner / step) * step, cutoff)
    return replace(
        points,
        color=_octaves(points.color, 0.25 * coarse),
        intensity=_octaves(points.intensity, 0.25 * coarse),
        radius=_octaves(points.radius, 0.25 * coarse),
        cutoff=np.where(beam, cutoff, points.cutoff),
        inner=np.where(beam, inner, points.inner),
    )


def _octaves(values: Doubles, step: float) -> Doubles:
    """Values that are not negative to the nearest of these powers of two; 0 stays 0."""
    there = values > 0.0
    power = np.round(np.log2(np.where(there, values, 1.0)) / step) * step
    return np.where(there, np.exp2(np.clip(power, -126.0, 126.0)), 0.0)


def _looks(points: LightPoints) -> tuple[Doubles, Ints, Ints]:
    """The different looks (k, 8), the first row of each (k,), and which one a row has (n,)."""
    numbers = points.intensity, points.radius, points.cutoff, points.inner, points.on
    columns = np.column_stack([points.color, *numbers])
    look, first, which = np.unique(columns, axis=0, return_index=True, return_inverse=True)
    return look, first.astype(np.int64), which.reshape(-1).astype(np.int64)


def _string(
    points: LightPoints,
    rows: Ints,
    look: Doubles,
    name: str,
    source: SourceRef,
    notes: Mapping[str, Any],
) -> Light:
    red, green, blue, intensity, radius, cutoff, inner, on = look.tolist()
    color = red * intensity, green * intensity, blue * intensity
    beam = cutoff < ALL_SIDES
    ways = points.direction[rows] if beam else None
    alike = ways is None or bool((ways == ways[0]).all())
    x, y, z = (0.0, 0.0, -1.0) if ways is None else ways[0].tolist()
    return Light(
        name,
        source,
        "spot" if beam else "point",
        direction=(x, y, z),
        diffuse=color,
        specular=color,
        spot_cutoff=cutoff,
        spot_inner=inner if beam and inner < cutoff else None,
        enabled=bool(on),
        extras={"color": (red, green, blue), "intensity": intensity, "radius": radius, **notes},
        positions=points.position[rows],
        directions=None if alike else ways,
        radius=radius if radius > 0.0 else None,
    )


def lobe_cone(horizontal: float, vertical: float) -> float:
    """Half-angle (degrees) of the round cone with the solid angle of a lobe of two half-angles.

    A lobe's outline is taken as an ellipse in the angle from its axis,
    1 / theta(phi)^2 = cos^2 phi / a^2 + sin^2 phi / b^2. Its solid angle is the integral of
    1 - cos theta(phi) over phi, that of a round cone 2 pi (1 - cos theta); so the cosine of
    the cone is the mean of those of the outline.
    """
    a, b = (math.radians(min(max(angle, 0.0), 180.0)) for angle in (horizontal, vertical))
    if a == b or min(a, b) == 0.0:
        return math.degrees(min(a, b))
    turn = np.arange(_TURNS) * (2.0 * np.pi / _TURNS)
    outline = a * b / np.hypot(b * np.cos(turn), a * np.sin(turn))
    # 1 - cos by its half-angle: a narrow lobe has no digits left in cos.
    share = float(np.mean(np.sin(0.5 * outline) ** 2))
    return math.degrees(2.0 * math.asin(math.sqrt(share)))
