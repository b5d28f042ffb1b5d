"""Lists of lights for parts of the screen: what cannot be seen left out, far lamps merged.

A rectangle of the screen and the depths seen in it make a ball (``tile_balls``); the lights
that reach the ball, and the error of taking far ones together, are of photometry/lightcut.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.lightcut import EPSILON, Tiles, cut, reached
from hdrusd.photometry.lighttree import build_tree, has_beam, may_merge, merged_lights
from hdrusd.scene import DISK, RECT, Camera, light_rows

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Lights = npt.NDArray[np.void]

#: Updates in a row without a change after which a light may be merged again.
STILL = 8

#: Roundings of float32 depths and places that a ball must hold too, relative.
_ROUNDING = 1e-5


@dataclass(frozen=True, slots=True, eq=False)
class TileList:
    """Lights of one kind for each of k tiles: ``rows[first : first + count]`` of the table."""

    rows: Ints  # (n,)
    first: Ints  # (k,)
    count: Ints  # (k,)


def tile_balls(
    rectangles: Ints,
    near: Floats,
    far: Floats,
    lobe: Floats,
    size: tuple[int, int],
    camera: Camera,
) -> Tiles:
    """The balls about what k rectangles of the screen show.

    ``rectangles`` (k, 4): left, bottom, right, top in pixels, of a picture of ``size``;
    ``near``, ``far`` (k,): depths of its surfaces, m along the view axis; ``lobe`` (k,): alpha
    of the narrowest highlight, rad, inf where there is none.
    """
    left, right, bottom, top = camera.window
    x = left + rectangles[:, [0, 2]] / size[0] * (right - left)
    y = bottom + rectangles[:, [1, 3]] / size[1] * (top - bottom)
    depth = np.stack([near, far], axis=1).astype(np.float64)
    # (k, x, y, depth): the corners of a frustum, of a box for an orthographic camera.
    grow = np.ones_like(depth) if camera.orthographic else depth
    shape = (len(rectangles), 2, 2, 2)
    corners = np.stack(
        [
            np.broadcast_to(x[:, :, None, None] * grow[:, None, None, :], shape),
            np.broadcast_to(y[:, None, :, None] * grow[:, None, None, :], shape),
            np.broadcast_to(-depth[:, None, None, :], shape),
        ],
        axis=-1,
    ).reshape(-1, 8, 3)
    centre = (corners.min(axis=1) + corners.max(axis=1)) / 2.0
    radius = np.sqrt(np.sum((corners - centre[:, None]) ** 2, axis=2)).max(axis=1)
    distance = np.sqrt(np.sum(centre**2, axis=1))
    axes = np.array([camera.right, camera.up, camera.back])
    toward_eye = -centre / np.maximum(distance, 1e-20)[:, None]
    if camera.orthographic:
        toward_eye = np.broadcast_to([0.0, 0.0, 1.0], centre.shape)
    return Tiles(
        centre=(centre @ axes).astype(np.float32),
        radius=((1.0 + _ROUNDING) * radius + _ROUNDING * distance).astype(np.float32),
        lobe=np.asarray(lobe, np.float32),
        toward_eye=(toward_eye @ axes).astype(np.float32),
    )


class LightLists:
    """The lights of a scene and their trees, kept from frame to frame.

    ``table``: the lights given, then the merged ones; rows of lists are numbers in it.
    """

    def __init__(self) -> None:
        self.table = light_rows(0)
        self._lights = light_rows(0)
        self._still: npt.NDArray[np.int64] = np.zeros(0, np.int64)
        self._in_tree: npt.NDArray[np.intp] = np.zeros(0, np.intp)
        self._tree = build_tree(self._lights)
        self._last: list[npt.NDArray[np.generic]] = []
        self._found: dict[int, TileList] = {}

    @property
    def in_trees(self) -> int:
        """How many lights may be seen as one with others; 0 where each is counted alone."""
        return len(self._in_tree) if self._tree.merged else 0

    def update(self, lights: Lights, merge: Bools) -> Lights:
        """Take the lights of a frame (dtype LIGHT); returns ``table``.

        ``merge`` (n,): which may be merged, if their kind allows: False for what has shadows
        or a shader of its own, for all of them where every light is to be counted alone.
        Few lights that change from one update to the next are not merged until they have
        been ``STILL``: trees are built anew only when that set changes.
        """
        changed = np.ones(len(lights), np.bool_)
        if len(self._lights) == len(lights):
            changed = _bytes(lights) != _bytes(self._lights)
        other = len(self._still) != len(lights)
        if other or 2 * np.count_nonzero(changed) > len(lights):  # another scene, not traffic
            self._still = np.full(len(lights), STILL)
        else:
            self._still = np.where(changed, 0, np.minimum(self._still + 1, STILL))
        chosen = np.flatnonzero(may_merge(lights) & merge & (self._still == STILL))
        same = np.array_equal(chosen, self._in_tree)
        if same and not np.any(changed):
            return self.table
        if not same or np.any(changed[chosen]):
            self._tree, self._in_tree = build_tree(lights[chosen]), chosen
        merged = merged_lights(self._tree, lights[chosen])
        self.table = np.concatenate([lights, merged])
        self._lights, self._last = lights.copy(), []
        return self.table

    def lists(
        self,
        kinds: Ints,
        tiles: Tiles,
        eye: tuple[float, float, float],
        epsilon: float = EPSILON,
    ) -> dict[int, TileList]:
        """For each kind of light what the tiles need of it.

        ``kinds`` (n,): numbers from 0, of every row of ``table``; -1 for what is not to be
        drawn. Lists of the same tiles, eye and kinds are kept.
        """
        key = (
            kinds,
            *(getattr(tiles, name) for name in tiles.__slots__),
            np.array([*eye, epsilon]),
        )
        if self._last and all(map(np.array_equal, key, self._last)):
            return self._found
        alone = np.ones(len(self.table), np.bool_)
        alone[self._in_tree] = False
        alone[len(self._lights) :] = False
        alone &= kinds >= 0
        sided = has_beam(self.table) | np.isin(self.table["shape"], (RECT, DISK))
        beams, open_ = np.flatnonzero(alone & sided), np.flatnonzero(alone & ~sided)
        pairs = [np.zeros((2, 0), np.int32)]
        if len(self._in_tree):
            tile, row = cut(self._tree, eye, tiles, epsilon)
            merged = np.arange(len(self._lights), len(self.table))
            rows = np.concatenate([self._in_tree, merged]).astype(np.int32)
            pairs.append(np.stack([tile, rows[row]]))
        if len(beams):
            tile, light = reached(self.table[beams], eye, tiles)
            pairs.append(np.stack([tile, beams[light].astype(np.int32)]))
        tile, row = np.concatenate(pairs, axis=1)
        kind = kinds[row]
        self._found = {
            int(number): _list(
                tile[kind == number],
                row[kind == number],
                open_[kinds[open_] == number].astype(np.int32),
                len(tiles.radius),
            )
            for number in np.unique(kinds[kinds >= 0])
        }
        self._last = [np.copy(values) for values in key]
        return self._found


def _bytes(lights: Lights) -> npt.NDArray[np.void]:
    """Rows as they lie in memory: NaN equals itself."""
    rows = np.ascontiguousarray(lights)
    return rows.view(np.dtype((np.void, rows.dtype.itemsize)))


def _list(tile: Ints, row: Ints, everywhere: Ints, tiles: int) -> TileList:
    """Pairs and what every tile needs as one list; all of them the same where that is all."""
    if not len(tile):
        whole = np.full(tiles, len(everywhere), np.int32)
        return TileList(everywhere, np.zeros(tiles, np.int32), whole)
    if len(everywhere):
        tile = np.concatenate([tile, np.repeat(np.arange(tiles, dtype=np.int32), len(everywhere))])
        row = np.concatenate([row, np.tile(everywhere, tiles)])
    row = row[np.argsort(tile, kind="stable")]
    count = np.bincount(tile, minlength=tiles).astype(np.int32)
    return TileList(row, np.cumsum(count, dtype=np.int32) - count, count)
