"""What stands before the lamps of a scene and is their own: glass that glows, and fixtures.

A surface hides a lamp from the eye unless the renderer lets the lamp's light through it anyway:

- what glows within ``glass_reach`` of it is its glass (gpu/lamp_glass.py), whatever its size;
- what its shadow link leaves out (convert: ``fixture-shadow``) and stands about it is its
  fixture, from ``NEAR`` before the lamp on. A photometric file has the fixture in its candela.

A wall between the eye and a wall lamp is neither.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.gpu.lamp_glass import box_of, glass_reach, near_pairs, placed_boxes
from hdrusd.photometry.fixture import LONGEST, NEAR
from hdrusd.scene import Draw, Geometry, RenderScene

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Corners of large glass that are looked at in a frame: some tens of milliseconds.
_MOST_CORNERS = 1_000_000


class OwnParts:
    """Finds the glass and the fixtures of lamps; keeps the boxes of what it has seen."""

    def __init__(self) -> None:
        self._boxes: dict[str, tuple[Geometry, Doubles]] = {}

    def glass(self, scene: RenderScene, lights: npt.NDArray[np.void]) -> tuple[Doubles, Doubles]:
        """Of LIGHT rows (n,): half the width of the glass about each, m, and its farthest corner.

        (n,) both; 0 without glass, infinite where there are too many corners to look at. Of a
        mesh that is larger than a lamp's glass those triangles count that are near the lamp.
        """
        half, far = np.zeros(len(lights)), np.zeros(len(lights))
        glows = [any(m.emission) or m.emission_map is not None for m in scene.materials]
        # Lamps that are drawn by their shape are no other lamp's glass.
        owners, boxes = self._placed(
            scene.draws,
            lambda d: glows[d.material] and not d.geometry.key.startswith("emitter:"),
        )
        reach, places = glass_reach(lights), np.asarray(lights["position"])
        budget = _MOST_CORNERS
        for box, lamp in near_pairs(boxes, places, reach):
            corner = np.abs(boxes[box, 0] - places[lamp]) + boxes[box, 1]
            whole = corner.max(axis=1) <= 2.0 * reach[lamp]
            np.maximum.at(half, lamp[whole], corner[whole].max(axis=1))
            np.maximum.at(far, lamp[whole], np.linalg.norm(corner[whole], axis=1))
            for b in np.unique(box[~whole]):
                some = lamp[~whole & (box == b)]
                draw, copy = owners[b]
                budget -= len(draw.geometry.points)
                if budget < 0:
                    half[some] = far[some] = np.inf
                    continue
                near, across, away = _near_corners(draw, copy, places[some], reach[some])
                np.maximum.at(half, some[near], across)
                np.maximum.at(far, some[near], away)
        return half, far

    def fixture_front(
        self, scene: RenderScene, lights: npt.NDArray[np.void], eye: Doubles
    ) -> Doubles:
        """(n,) m before each lamp, towards ``eye``, where its fixture begins; 0 without one."""
        front = np.zeros(len(lights))
        linked = np.flatnonzero(lights["shadow_link"] > 0)
        if not len(linked):
            return front
        bits = 0
        for link in np.unique(lights["shadow_link"][linked]):
            bits |= 1 << (int(link) - 1)
        owners, boxes = self._placed(scene.draws, lambda d: d.shadow_links & bits != bits)
        small = np.flatnonzero(2.0 * np.linalg.norm(boxes[:, 1], axis=1) <= LONGEST)
        places = np.asarray(lights["position"])[linked]
        for found, at in near_pairs(boxes[small], places, np.full(len(linked), NEAR)):
            box, lamp = small[found], linked[at]
            link = lights["shadow_link"][lamp]
            own = np.array(
                [
                    not owners[b][0].shadow_links >> (int(n) - 1) & 1
                    for b, n in zip(box, link, strict=True)
                ],
                np.bool_,
            )
            box, lamp = box[own], lamp[own]
            begins = _before(boxes[box], np.asarray(lights["position"])[lamp], eye)
            np.maximum.at(front, lamp, np.minimum(begins, NEAR))
        return front

    def _placed(
        self, draws: tuple[Draw, ...], wanted: Callable[[Draw], Any]
    ) -> tuple[list[tuple[Draw, int]], Doubles]:
        """Draws with the number of a copy, and the boxes (n, 2, 3) of these in the world."""
        owners: list[tuple[Draw, int]] = []
        boxes = [np.zeros((0, 2, 3))]
        for draw in filter(wanted, draws):
            geometry = draw.geometry
            known = self._boxes.get(geometry.key)
            if known is None or known[0] is not geometry:
                known = self._boxes[geometry.key] = geometry, box_of(geometry.points)
            boxes.append(placed_boxes(known[1], draw.transforms))
            owners += [(draw, copy) for copy in range(len(draw.transforms))]
        return owners, np.concatenate(boxes)


def _near_corners(
    draw: Draw, copy: int, places: Doubles, reach: Doubles
) -> tuple[Ints, Doubles, Doubles]:
    """Triangles of a draw that come within ``reach`` (n,) of places (n, 3), (k,) each:

    the number of the place, how far they go from it along an axis, and at all.
    """
    matrix = draw.transforms[copy]
    points = draw.geometry.points.astype(np.float64) @ matrix[:3, :3] + matrix[3, :3]
    corners = points.reshape(-1, 3, 3)
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = [(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))]
    for triangle, place in near_pairs(np.stack([low + high, high - low], 1) / 2.0, places, reach):
        apart = corners[triangle] - places[place, None]
        near = triangle_distance(apart) <= reach[place]
        place, apart = place[near], np.abs(apart[near])
        far = np.linalg.norm(apart, axis=2).max(axis=1)
        found.append((place, apart.max(axis=(1, 2)), far))
    place, across, far = (np.concatenate(part) for part in zip(*found, strict=True))
    return place, across, far


def triangle_distance(corners: Doubles) -> Doubles:
    """(k,) from the origin to triangles (k, 3, 3)."""
    sides = np.roll(corners, -1, axis=1) - corners
    square = np.maximum(np.sum(sides * sides, axis=2), 1e-300)
    along = np.clip(-np.sum(corners * sides, axis=2) / square, 0.0, 1.0)
    edge = np.linalg.norm(corners + along[..., None] * sides, axis=2).min(axis=1)
    normal = np.cross(sides[:, 0], sides[:, 1])
    # The origin lies over the triangle where it is on the same side of all three.
    side = np.sum(np.cross(sides, -corners) * normal[:, None], axis=2)
    size = np.linalg.norm(normal, axis=1)
    height = np.abs(np.sum(normal * corners[:, 0], axis=1)) / np.maximum(size, 1e-300)
    return np.asarray(np.where((side >= 0.0).all(axis=1) & (size > 0.0), height, edge))


def _before(boxes: Doubles, places: Doubles, eye: Doubles) -> Doubles:
    """(n,) m from where the way from ``eye`` (3,) enters boxes (n, 2, 3) on to places (n, 3).

    0 where it passes them by.
    """
    way = places - eye
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack(
            [(boxes[:, 0] + sign * boxes[:, 1] - eye) / way for sign in (-1.0, 1.0)], axis=0
        )
    # 0 / 0: along a side of the box, inside it as far as this axis is concerned.
    entry = np.nan_to_num(ends.min(axis=0), nan=-np.inf).max(axis=1)
    leave = np.nan_to_num(ends.max(axis=0), nan=np.inf, posinf=np.inf).min(axis=1)
    through = (entry < leave) & (leave > 0.0)
    length = np.linalg.norm(way, axis=1)
    return np.where(through, (1.0 - np.clip(entry, 0.0, 1.0)) * length, 0.0)
