"""Which surfaces are the glass of a lamp: they stand before it and let its light through.

The light of a lamp is its own row of ``scene.LIGHT``; the surface that is seen to glow is
drawn beside it and would hide it. What glows elsewhere, or is large, hides as all else does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hdrusd.scene import Draw, Geometry, RenderScene

Doubles = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]

#: A glass comes as near to its lamp as so many of the lamp's radii, or so many m.
_RADII, _NEAR = 3.0, 0.3

#: m; a glass has a shorter diagonal.
_LARGEST = 3.0

#: Pairs of a box and a lamp that are compared at a time.
_PAIRS = 1_000_000


def box_of(points: npt.NDArray[np.floating]) -> Doubles:
    """(2, 3) middle and half size of what points (n, 3) span; zeros for none."""
    places = points.astype(np.float64) if len(points) else np.zeros((1, 3))
    low, high = places.min(axis=0), places.max(axis=0)
    return np.array([low + high, high - low]) / 2.0


def placed_boxes(box: Doubles, transforms: Doubles) -> Doubles:
    """(n, 2, 3) middle and half size in the world of a box (2, 3) in n places (n, 4, 4)."""
    middle = box[0] @ transforms[:, :3, :3] + transforms[:, 3, :3]
    return np.stack([middle, box[1] @ np.abs(transforms[:, :3, :3])], axis=1)


def lamp_glass(boxes: Doubles, lights: npt.NDArray[np.void]) -> Booleans:
    """(n,) which of (n, 2, 3) boxes, middle and half size in m, are a lamp's glass.

    ``lights``: dtype LIGHT; distant ones have no glass.
    """
    found = np.zeros(len(boxes), np.bool_)
    small = np.flatnonzero(2.0 * np.linalg.norm(boxes[:, 1], axis=1) < _LARGEST)
    lamps = lights[lights["w"] > 0.0]
    for box, _ in near_pairs(boxes[small], lamps["position"], glass_reach(lamps)):
        found[small[box]] = True
    return found


def glass_reach(lights: npt.NDArray[np.void]) -> Doubles:
    """(n,) m: what glows no farther from a lamp than this is its glass."""
    return np.asarray(np.maximum(_RADII * lights["radius"], _NEAR))


def near_pairs(boxes: Doubles, places: Doubles, reach: Doubles) -> Iterator[tuple[Ints, Ints]]:
    """Numbers of boxes (b, 2, 3) and of places (n, 3) that are within the ``reach`` (n,) of them.

    In parts of some million comparisons each.
    """
    if not len(boxes) or not len(places):
        return
    # Along one axis the places that may be near follow one another.
    axis = int(np.argmax(np.ptp(places, axis=0)))
    order = np.argsort(places[:, axis])
    places, reach = places[order], reach[order]
    middle, half = boxes[:, 0], boxes[:, 1]
    wide = half[:, axis] + float(reach.max())
    first = np.searchsorted(places[:, axis], middle[:, axis] - wide)
    count = np.searchsorted(places[:, axis], middle[:, axis] + wide, "right") - first
    step = max(_PAIRS // len(places), 1)
    for start in range(0, len(boxes), step):
        some = slice(start, start + step)
        box = np.repeat(np.arange(len(boxes))[some], count[some])
        before = np.repeat(np.cumsum(count[some]) - count[some], count[some])
        place = first[box] + np.arange(len(box)) - before
        beyond = np.maximum(np.abs(places[place] - middle[box]) - half[box], 0.0)
        close = np.linalg.norm(beyond, axis=1) <= reach[place]
        yield box[close], order[place[close]]


class LampGlass:
    """Takes the glass of lamps out of a scene; keeps the boxes of what glows."""

    def __init__(self) -> None:
        self._boxes: dict[str, tuple[Geometry, Doubles]] = {}

    def removed(self, scene: RenderScene) -> list[Draw]:
        """A scene's draws, those that glow without the copies that are a lamp's glass."""
        glows = [any(m.emission) or m.emission_map is not None for m in scene.materials]
        glowing = [i for i, draw in enumerate(scene.draws) if draw.casts and glows[draw.material]]
        draws = list(scene.draws)
        before, self._boxes = self._boxes, {}
        if not glowing:
            return draws
        boxes = []
        for i in glowing:
            geometry = draws[i].geometry
            known = before.get(geometry.key)
            if known is None or known[0] is not geometry:
                known = geometry, box_of(geometry.points)
            self._boxes[geometry.key] = known
            boxes.append(placed_boxes(known[1], draws[i].transforms))
        glass = lamp_glass(np.concatenate(boxes), scene.lights)
        ends = np.cumsum([len(own) for own in boxes])
        for i, own in zip(glowing, np.split(glass, ends[:-1]), strict=True):
            if own.any():
                draws[i] = replace(draws[i], transforms=draws[i].transforms[~own])
        return draws
