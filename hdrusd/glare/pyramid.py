"""The veil by a pyramid of smoothed pictures: what gpu/glare.py draws, and its definition.

Level k is level k - 1 at half the size, through (1, 3, 3, 1) / 8 along both axes: a pixel keeps
its place, where 2 x 2 means would move its light to the middle of ever larger texels, and with
it the halo of a small lamp, which then jumps as the lamp moves. Enlarged again by (1, 3) / 4, a
level spreads a pixel over a Gaussian; blurred by (1, 2, 1) / 4 before, over a wider one:

    sigma^2 = (4^k - 1) / 2   and   4^k - 1 / 2   pixels^2.

f_v is fitted by such Gaussians with weights that are not negative (``weights``: within 1 % from
NARROWEST to WIDEST degrees, where pixels are small enough), and levels stand for it from fine
to coarse:

- the first level is the coarsest one that still fits;
- levels ``first`` to ``last`` are drawn, in distances of the picture;
- what is wider is added at the texels of ``last`` by a dense matrix, with the true angle and
  solid angle of each texel of a perspective picture: the rest of the Gaussians up to WIDEST
  degrees, and what all drawn levels leave of f_v beyond.

A fourth channel, 1 in the frame, goes the same way and becomes the share S m that leaves a
pixel and arrives in the frame (veil.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hdrusd.colour import clean
from hdrusd.errors import HdrusdError
from hdrusd.eye.observer import Observer
from hdrusd.glare.model import Array, GlareModel
from hdrusd.glare.veil import LAMP, kernel, pixel_angle, plane

#: Degrees between which the Gaussians are fitted.
NARROWEST, WIDEST = 0.02, 8.0

#: Texels around the frame that a level has too: light of the frame lies in them, and lamps.
MARGIN = 2

#: Largest relative error of the fit that a first level may have.
_TOLERANCE = 0.01

#: Most texels of the level that the dense matrix works on.
_DENSE = 2500

#: Cells of the table of the wide part, even in the root of the chord between directions.
_CELLS = 1 << 15


def sigmas(first: int, levels: int) -> Array:
    """(levels, 2) sigma in pixels of levels from ``first`` on: as they are, and blurred."""
    power = 4.0 ** np.arange(first, first + levels)
    return np.sqrt(np.stack([(power - 1.0) / 2.0, power - 0.5], axis=-1))


def nonnegative_least_squares(matrix: Array, wanted: Array) -> Array:
    """The x >= 0 for which ``matrix`` x is nearest to ``wanted``.

    C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23.
    """
    columns = matrix.shape[1]
    active, x = np.zeros(columns, bool), np.zeros(columns)
    for _ in range(10 * columns):
        gain = np.where(active, -np.inf, matrix.T @ (wanted - matrix @ x))
        if gain.max(initial=-np.inf) <= 1e-10:
            break
        active[np.argmax(gain)] = True
        while active.any():
            free = np.zeros(columns)
            free[active] = np.linalg.lstsq(matrix[:, active], wanted, rcond=None)[0]
            below = active & (free <= 0.0)
            if not below.any():
                x = free
                break
            # As far towards it as all stay positive; who arrives at 0 leaves.
            step = float(np.min(x[below] / (x[below] - free[below])))
            x = np.where(active, x + step * (free - x), 0.0)
            active &= ~(below & (x <= 1e-14))
            x[~active] = 0.0
    return x


def gaussians(theta: npt.ArrayLike, sigma: npt.ArrayLike) -> Array:
    """(..., n) of unit Gaussians of ``sigma`` (n,) at ``theta`` (...), degrees; sr^-1."""
    s = np.radians(np.asarray(sigma, np.float64))
    t = np.radians(np.asarray(theta, np.float64))[..., None]
    return np.asarray(np.exp(-0.5 * (t / s) ** 2) / (2.0 * math.pi * s**2))


def fitted(
    model: GlareModel, observer: Observer, pixel: float, sigma: npt.ArrayLike
) -> tuple[Array, float]:
    """Weights (n,) of Gaussians of ``sigma`` (n,) degrees that stand for f_v, and their error.

    The relative error is least in squares over even steps of log theta, from NARROWEST, or half
    a pixel, to WIDEST; what is returned is the largest. ``pixel`` in degrees.
    """
    theta = np.geomspace(min(max(NARROWEST, 0.5 * pixel), 0.5 * WIDEST), WIDEST, 1200)
    wanted = kernel(model, observer, pixel, theta)
    ratios = gaussians(theta, sigma) / wanted[:, None]
    found = nonnegative_least_squares(ratios, np.ones(len(theta)))
    return found, float(np.max(np.abs(ratios @ found - 1.0)))


@lru_cache(maxsize=64)
def weights(
    model: GlareModel, observer: Observer, pixel: float
) -> tuple[int, tuple[tuple[float, float], ...]]:
    """The first level, and of it and each following one the weights as it is and blurred.

    ``pixel`` in degrees.
    """
    top = max(math.ceil(math.log2(3.0 / (1.12 * pixel))), 0) + 1
    best = 0, np.zeros((top + 1, 2))
    for first in range(top + 1):
        sigma = sigmas(first, top + 1 - first) * pixel
        counts = sigma > 0.0  # level 0 as it is spreads nothing
        found = np.zeros(sigma.shape)
        found[counts], error = fitted(model, observer, pixel, sigma[counts])
        if first > 0 and error > _TOLERANCE:
            break
        best = first, found
    return best[0], tuple((float(own), float(blurred)) for own, blurred in best[1])


@dataclass(frozen=True, slots=True, eq=False)
class Pyramid:
    """What to draw for a model, an observer and a perspective picture of a size.

    ``size`` (w, h) pixels, ``field`` degrees. Levels ``first`` to ``last`` are drawn with
    ``weights``, as they are and blurred. ``spread`` (n, n) float32: between the texels of
    ``last`` and one more on every side, bottom row first. ``table``: the wide part of the
    kernel by the root of the chord, sr^-1; empty where the model has no point spread.
    ``rays`` (n, 3): unit vectors through those texels.
    """

    size: tuple[int, int]
    field: tuple[float, float]
    first: int
    last: int
    weights: tuple[tuple[float, float], ...]
    spread: Array
    table: Array
    rays: Array

    def level_size(self, level: int) -> tuple[int, int]:
        """(w, h) of a level in texels, without its margin."""
        return _level_size(self.size, level)

    def wide_light(self, texels: Array, lamps: Array | None = None) -> Array:
        """What the texels of ``last`` (h, w, 4), bottom row first, and lamps (k, 6) add to them.

        All with one texel of the margin; cd/m2 and the share of the frame.
        """
        out = self.spread @ np.asarray(texels, np.float32).reshape(-1, 4)
        if lamps is not None and self.table.size:
            for rows in np.array_split(lamps, max(math.ceil(len(lamps) / 256), 1)):
                spread = _looked_up(self.table, self.rays, rows[:, :3])
                out[:, :3] += spread @ rows[:, 3:].astype(np.float32)
        return np.asarray(out.reshape(texels.shape))

    def splats(self, level: int, lamps: Array) -> tuple[Array, Array]:
        """Lamps (k, 6) as texels of a level: column and row (n, 2) with the margin,

        and the luminance (n, 3) to add there. A lamp is shared out as the levels do with a
        pixel, in the end by a quadratic B-spline over 3 x 3 texels. Lamps that are too far
        from the frame to reach it by this level give none.
        """
        ahead = lamps[lamps[:, 2] < -1e-3]
        size, half = np.array(self.size), np.array(plane(self.field))
        at = ahead[:, :2] / -ahead[:, 2:3]
        place = (at / half + 1.0) * 0.5 * size / 2.0**level - 0.5 + MARGIN
        limits = np.array(self.level_size(level)) + 2 * MARGIN
        near = np.all((place > -2.0) & (place < limits + 1), axis=1)
        ahead, place = ahead[near], place[near]
        # As a pixel there would have it: lux over the solid angle of a texel.
        area = 4.0 * math.prod(half) / math.prod(self.size) * 4.0**level
        luminance = ahead[:, 3:] / (area * np.abs(ahead[:, 2:3]) ** 3)
        centre = np.rint(place)
        off = place - centre
        share = np.stack([0.5 * (0.5 - off) ** 2, 0.75 - off**2, 0.5 * (0.5 + off) ** 2])
        places, lights = [], []
        for y in range(3):
            for x in range(3):
                places.append(centre + (x - 1, y - 1))
                lights.append(luminance * (share[x, :, 0] * share[y, :, 1])[:, None])
        texels = np.concatenate(places).astype(np.int64)
        inside = np.all((texels >= 0) & (texels < limits), axis=1)
        return texels[inside], np.concatenate(lights)[inside]

    def paint(self, picture: npt.ArrayLike, lamps: npt.ArrayLike | None = None) -> Array:
        """The veiled picture (h, w, 3) in cd/m2, top row first; lamps as in veil.py."""
        rgb = clean(np.asarray(picture, np.float64))[::-1]
        if rgb.shape[1::-1] != self.size:
            raise HdrusdError(f"picture of {rgb.shape[1]} x {rgb.shape[0]}; want {self.size}")
        rows = None if lamps is None else as_lamps(lamps)
        level = np.concatenate([rgb, np.ones((*rgb.shape[:2], 1))], axis=-1)
        levels = [np.pad(level, _around(MARGIN))]
        for _ in range(self.last):
            levels.append(_halved(levels[-1]))
        inner = slice(MARGIN - 1, 1 - MARGIN)
        veil = np.pad(self.wide_light(levels[-1][inner, inner], rows), _around(MARGIN - 1))
        for k in range(self.last, self.first - 1, -1):
            source = levels[k]
            if k < self.last:
                veil = _enlarged(veil, source.shape[1::-1], 1, MARGIN)
            if self.weights:
                if rows is not None:
                    place, light = self.splats(k, rows)
                    np.add.at(source[..., :3], (place[:, 1], place[:, 0]), light)
                own, blurred = self.weights[k - self.first]
                veil = veil + own * source + blurred * _blurred(source)
        veil = _enlarged(veil, self.size, self.first, 0)
        return np.asarray(((1.0 - veil[..., 3:]) * rgb + veil[..., :3])[::-1])


def as_lamps(lamps: npt.ArrayLike) -> Array:
    """Rows of lamps, float64, without those that give nothing; raises HdrusdError."""
    rows = np.asarray(lamps, np.float64)
    if rows.ndim != 2 or rows.shape[1] != LAMP or not np.all(np.isfinite(rows)):
        raise HdrusdError(
            f"lamps of shape {rows.shape}; want finite rows of a direction and lux per channel"
        )
    return rows[np.any(rows[:, 3:] > 0.0, axis=1)]


@lru_cache(maxsize=4)
def pyramid(
    model: GlareModel, observer: Observer, size: tuple[int, int], field: tuple[float, float]
) -> Pyramid:
    """The pyramid for a picture of ``size`` (w, h) pixels and ``field`` degrees.

    Raises HdrusdError for a field that no perspective picture has.
    """
    pixel = pixel_angle(size, field)
    last = 0
    while math.prod(_level_size(size, last)) > _DENSE:
        last += 1
    if model.psf is None:
        return _of_shares(model, size, field, last)
    first, fit = weights(model, observer, pixel)
    last = max(first, last)
    drawn = (*fit, *[(0.0, 0.0)] * (last + 1 - first - len(fit)))[: last + 1 - first]
    table = _wide_table(model, observer, pixel, last)
    rays = _rays(size, field, last)
    texel = 4.0 * math.prod(plane(field)) / math.prod(size) * 4.0**last
    solid = (texel * np.abs(rays[:, 2]) ** 3).astype(np.float32)
    parts = np.array_split(rays, max(len(rays) // 256, 1))
    spread = np.concatenate([_looked_up(table, part, rays) * solid for part in parts])
    return Pyramid(size, field, first, last, drawn, spread, table, rays)


def _of_shares(
    model: GlareModel, size: tuple[int, int], field: tuple[float, float], last: int
) -> Pyramid:
    """Of a model without a point spread: nothing but the dense matrix."""
    if model.shares is None:
        raise HdrusdError(f"glare model {model.name}: has neither point spread nor shares")
    rays = _rays(size, field, last)
    # How much of the frame each texel holds: the fourth channel of the level.
    row, column = (np.pad(np.ones((n, 1, 1)), _around(MARGIN)) for n in size)
    for _ in range(last):
        row, column = _halved(row), _halved(column)
    middle = row.shape[1] // 2
    across, down = (v[MARGIN - 1 : 1 - MARGIN, middle, 0] for v in (row, column))
    inside = np.outer(down, across).ravel()
    spread = model.shares(rays @ rays.T, inside).astype(np.float32)
    return Pyramid(size, field, last, last, (), spread, np.zeros(0, np.float32), rays)


def _wide_table(model: GlareModel, observer: Observer, pixel: float, last: int) -> Array:
    """What levels up to ``last`` leave of the kernel, (_CELLS,) float32, sr^-1."""
    chord = (math.sqrt(2.0) * (np.arange(_CELLS) + 0.5) / _CELLS) ** 2
    theta = np.degrees(2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)))
    first, fit = weights(model, observer, pixel)
    sigma, weight = sigmas(first, len(fit)) * pixel, np.array(fit)
    # Variance, degrees^2, that the texels of ``last`` add by being made and enlarged.
    smooth = (4.0**last - 1.0) / 2.0 * pixel**2
    sums = []
    for part, added in ((slice(None, last + 1 - first), 0.0), (slice(last + 1 - first, None), smooth)):
        counts = weight[part] > 0.0
        s = np.sqrt(sigma[part][counts] ** 2 - added)
        sums.append(gaussians(theta, s) @ weight[part][counts])
    # Of 1 / theta^2, smoothing by a variance makes 1 / (theta^2 - 2 variance).
    beyond = kernel(model, observer, pixel, np.sqrt(theta**2 + 2.0 * smooth)) - sums[0]
    return np.where(theta < WIDEST, sums[1], np.maximum(beyond, 0.0)).astype(np.float32)


def _looked_up(table: Array, a: Array, b: Array) -> Array:
    """(n, m) float32 of the table between unit vectors (n, 3) and (m, 3)."""
    root = np.sqrt(np.sqrt(np.maximum(2.0 - 2.0 * (a @ b.T), 0.0)))
    cell = (root * (_CELLS / math.sqrt(2.0))).astype(np.int32)
    return np.asarray(table[np.minimum(cell, _CELLS - 1)])


def _level_size(size: tuple[int, int], level: int) -> tuple[int, int]:
    return -(-size[0] >> level), -(-size[1] >> level)


def _rays(size: tuple[int, int], field: tuple[float, float], level: int) -> Array:
    """Unit vectors (n, 3) through the texels of a level and one more around, bottom row first."""
    x, y = (
        half * (2.0 * (np.arange(-1, texels + 1) + 0.5) * 2.0**level / pixels - 1.0)
        for half, texels, pixels in zip(
            plane(field), _level_size(size, level), size, strict=True
        )
    )
    grid = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), -1.0)], axis=-1).reshape(-1, 3)
    return np.asarray(grid / np.linalg.norm(grid, axis=1, keepdims=True))


def _around(texels: int) -> list[tuple[int, int]]:
    return [(texels, texels), (texels, texels), (0, 0)]


def _halved(level: Array) -> Array:
    """The next level of one with its MARGIN, with its own; by (1, 3, 3, 1) / 8, dark beyond."""
    for axis in (0, 1):
        texels = (level.shape[axis] - 2 * MARGIN + 1) // 2 + 2 * MARGIN
        # Texel i is made of 2 i - 1 to 2 i + 2, counted from the frame's edge.
        low = 2 * MARGIN - MARGIN + 1
        high = 2 * texels + 2 - low - level.shape[axis]
        padded = np.pad(level, [(low, high) if a == axis else (0, 0) for a in range(3)])
        taps = [np.take(padded, np.arange(texels) * 2 + i, axis) for i in range(4)]
        level = 0.125 * (taps[0] + taps[3]) + 0.375 * (taps[1] + taps[2])
    return level


def _blurred(level: Array) -> Array:
    """By (1, 2, 1) / 4 along rows and columns; dark beyond."""
    padded = np.pad(level, _around(1))
    level = 0.25 * (padded[:-2] + padded[2:]) + 0.5 * padded[1:-1]
    return np.asarray(0.25 * (level[:, :-2] + level[:, 2:]) + 0.5 * level[:, 1:-1])


def _enlarged(veil: Array, size: tuple[int, ...], levels: int, margin: int) -> Array:
    """A level with its MARGIN, ``levels`` finer, (w, h) texels of which ``margin`` are around.

    Linear between the centres of texels.
    """
    for axis, count in ((0, size[1]), (1, size[0])):
        place = (np.arange(count) - margin + 0.5) / 2.0**levels - 0.5 + MARGIN
        low = np.clip(np.floor(place).astype(np.int64), 0, veil.shape[axis] - 2)
        part = np.clip(place - low, 0.0, 1.0).reshape([-1 if a == axis else 1 for a in range(3)])
        veil = (1.0 - part) * np.take(veil, low, axis) + part * np.take(veil, low + 1, axis)
    return veil
