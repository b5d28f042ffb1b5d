"""The veil by a pyramid of smoothed pictures: what gpu/glare.py draws, and its definition.

Level k is level k - 1 at half the size, through (1, 3, 3, 1) / 8 along both axes: a pixel keeps
its place, where 2 x 2 means would move its light to the middle of ever larger texels, and with
it the halo of a small lamp, which then jumps as the lamp moves. Enlarged again by (1, 3) / 4, a
level spreads a pixel over a Gaussian; blurred by (1, 2, 1) / 4 before, over a wider one:

    sigma^2 = (4^k - 1) / 2   and   4^k - 1 / 2   pixels^2.

f_v is fitted by such near-Gaussians with weights that are not negative (``weights``: within 5.5 %
from NARROWEST to WIDEST degrees, where pixels are below 0.1 degrees), and levels stand for it
from fine to coarse:

- the first level is the coarsest one that still fits;
- levels ``first`` to ``last`` are drawn, in distances of the picture;
- what is wider is added at the texels of ``last`` by a dense matrix, with the true angle and
  solid angle of each texel of a perspective picture: the rest of the Gaussians up to WIDEST
  degrees, and what all drawn levels leave of f_v beyond.

Away from the middle of a perspective picture a pixel is s = cos^1.5(angle from the axis) as
wide, in the mean of both directions. So the fit is made for NODES values of s, and each texel
takes the weights for its own, in between.

The halo of a lamp is then right within 4 % in the mean over every ring about it from two pixels
on. Single pixels, below 4 degrees, are within 7 % for the most part and 25 % at worst; in the
corners of a picture 60 degrees wide, where pixels are not square, within 15 % for the most part.

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
from hdrusd.eye.scotopic import scotopic, white_relative
from hdrusd.glare.model import Array, GlareModel
from hdrusd.glare.splats import MARGIN, as_lamps, level_size, shown_pixels, splats
from hdrusd.glare.veil import kernel, pixel_angle, plane

#: Degrees between which the Gaussians are fitted.
NARROWEST, WIDEST = 0.02, 8.0

#: Largest relative error of the fit that a first level may have.
_TOLERANCE = 0.055

#: Most texels of the level that the dense matrix works on.
_DENSE = 2500

#: Excess kurtosis of what a level spreads a pixel over, as it is (in the end a B-spline of the
#: fifth degree) and blurred.
EXCESS = (-0.2, -0.3)

#: Values of s, even from 1 to that in the corners, for which weights are fitted.
NODES = 8

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
    # Normal equations: neighbouring Gaussians differ enough for them, and they are small.
    normal, right = matrix.T @ matrix, matrix.T @ wanted
    active, x = np.zeros(columns, bool), np.zeros(columns)
    for _ in range(10 * columns):
        gain = np.where(active, -np.inf, right - normal @ x)
        if gain.max(initial=-np.inf) <= 1e-10:
            break
        active[np.argmax(gain)] = True
        while active.any():
            free = np.zeros(columns)
            free[active] = np.linalg.solve(normal[np.ix_(active, active)], right[active])
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


def gaussians(theta: npt.ArrayLike, sigma: npt.ArrayLike, excess: npt.ArrayLike = 0.0) -> Array:
    """(..., n) of unit Gaussians of ``sigma`` (n,) at ``theta`` (...), degrees; sr^-1.

    ``excess`` (n,): the excess kurtosis along each axis, up to where the Gram-Charlier series,
    in the mean over directions, falls below 0.
    """
    s = np.radians(np.asarray(sigma, np.float64))
    square = (np.radians(np.asarray(theta, np.float64))[..., None] / s) ** 2
    series = 1.0 + np.asarray(excess) / 24.0 * (0.75 * square**2 - 6.0 * square + 6.0)
    return np.asarray(np.exp(-0.5 * square) * np.maximum(series, 0.0) / (2.0 * math.pi * s**2))


def fitted(
    model: GlareModel,
    observer: Observer,
    pixel: float,
    sigma: npt.ArrayLike,
    excess: npt.ArrayLike = 0.0,
) -> tuple[Array, float]:
    """Weights (n,) of ``gaussians`` that stand for f_v, and their error.

    The relative error is least in squares over even steps of log theta, from NARROWEST, or half
    a pixel, to WIDEST; what is returned is the largest. ``pixel`` in degrees.
    """
    theta = np.geomspace(min(max(NARROWEST, 0.5 * pixel), 0.5 * WIDEST), WIDEST, 1200)
    wanted = kernel(model, observer, pixel, theta)
    ratios = gaussians(theta, sigma, excess) / wanted[:, None]
    found = nonnegative_least_squares(ratios, np.ones(len(theta)))
    return found, float(np.max(np.abs(ratios @ found - 1.0)))


@lru_cache(maxsize=64)
def first_level(model: GlareModel, observer: Observer, pixel: float) -> tuple[int, int]:
    """The first level for pixels of ``pixel`` degrees, and the number of levels from it on."""
    top = max(math.ceil(math.log2(3.0 / (1.12 * pixel))), 0) + 1
    first = 0
    while first < top:
        sigma = sigmas(first + 1, top - first) * pixel
        excess = np.broadcast_to(EXCESS, sigma.shape)
        if fitted(model, observer, pixel, sigma.ravel(), excess.ravel())[1] > _TOLERANCE:
            break
        first += 1
    return first, top + 1 - first


def weights(model: GlareModel, observer: Observer, pixel: float, scale: float = 1.0) -> Array:
    """(n, 2) weights of the first and each following level, as it is and blurred.

    ``pixel`` in degrees, in the middle of the picture; ``scale``: how wide pixels are beside it.
    """
    first, levels = first_level(model, observer, pixel)
    sigma = sigmas(first, levels) * pixel * scale
    spreads = sigma > 0.0  # level 0 as it is does not
    found = np.zeros(sigma.shape)
    excess = np.broadcast_to(EXCESS, sigma.shape)[spreads]
    found[spreads] = fitted(model, observer, pixel, sigma[spreads], excess)[0]
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Pyramid:
    """What to draw for a model, an observer and a perspective picture of a size.

    ``size`` (w, h) pixels, ``field`` degrees. Levels ``first`` to ``last`` are drawn with
    ``weights`` (NODES, levels, 2), as they are and blurred, the nodes being even in s from 1
    to ``least``. ``spread`` (n, n) float32: between the texels of ``last`` and one more on
    every side, bottom row first; ``rays`` (n, 3) are the unit vectors through them.
    ``tables`` (NODES, cells): the wide part of the kernel by the root of the chord, sr^-1.
    A model without a point spread has no weights and no tables.
    """

    size: tuple[int, int]
    field: tuple[float, float]
    first: int
    last: int
    least: float
    weights: Array
    spread: Array
    rays: Array
    tables: Array

    def level_size(self, level: int) -> tuple[int, int]:
        """(w, h) of a level in texels, without its margin."""
        return level_size(self.size, level)

    def wide_light(self, texels: Array, lamps: Array | None = None) -> Array:
        """What the texels of ``last`` (h, w, 4), bottom row first, and lamps (k, 6) add to them.

        All with one texel of the margin; cd/m2 and the share of the frame.
        """
        out = self.spread @ np.asarray(texels, np.float32).reshape(-1, 4)
        if lamps is not None and self.tables.size:
            for rows in np.array_split(lamps, max(math.ceil(len(lamps) / 256), 1)):
                spread = _looked_up(self.tables, self.least, self.rays, rows[:, :3])
                out[:, :3] += spread @ rows[:, 3:].astype(np.float32)
        return np.asarray(out.reshape(texels.shape))

    def plane_steps(self, level: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Of a level, at distance 1: the corner of the frame at (0, 0), and a texel's sides."""
        across, down = plane(self.field)
        texel = 2.0**level
        return (-across, -down), (
            2.0 * across * texel / self.size[0],
            2.0 * down * texel / self.size[1],
        )

    def _weights_at(self, level: int, size: tuple[int, ...]) -> Array:
        """(h, w, 2) for the texels of a level with its margin."""
        x, y = (
            corner + (np.arange(n) - MARGIN + 0.5) * step
            for corner, step, n in zip(*self.plane_steps(level), size, strict=True)
        )
        scale = (1.0 + x[None, :] ** 2 + y[:, None] ** 2) ** -0.75
        low, part = _between(scale, self.least)
        drawn = self.weights[:, level - self.first]
        return np.asarray(drawn[low] * (1.0 - part[..., None]) + drawn[low + 1] * part[..., None])

    def paint(self, picture: npt.ArrayLike, lamps: npt.ArrayLike | None = None) -> Array:
        """The veiled picture (h, w, 3) in cd/m2, top row first; lamps as in veil.py.

        A fourth channel is white-relative scotopic luminance; of the veil's, its colour tells.
        """
        whole = clean(np.asarray(picture, np.float64))[::-1]
        rgb = whole[..., :3]
        if rgb.shape[1::-1] != self.size:
            raise HdrusdError(f"picture of {rgb.shape[1]} x {rgb.shape[0]}; want {self.size}")
        rows = None if lamps is None else as_lamps(lamps)
        level = np.concatenate([rgb, np.ones((*rgb.shape[:2], 1))], axis=-1)
        if lamps is not None and self.weights.size:
            pixels, shares = shown_pixels(lamps, self.size, self.field)
            level[pixels[:, 1], pixels[:, 0], :3] *= 1.0 - shares
        levels = [np.pad(level, _around(MARGIN))]
        for _ in range(self.last):
            levels.append(_halved(levels[-1]))
        inner = slice(MARGIN - 1, 1 - MARGIN)
        veil = np.pad(self.wide_light(levels[-1][inner, inner], rows), _around(MARGIN - 1))
        for k in range(self.last, self.first - 1, -1):
            source = levels[k]
            if k < self.last:
                veil = _enlarged(veil, source.shape[1::-1], 1, MARGIN)
            if self.weights.size:
                if rows is not None:
                    place, light = splats(k, rows, self.size, self.field)
                    np.add.at(source[..., :3], (place[:, 1], place[:, 0]), light)
                weight = self._weights_at(k, source.shape[1::-1])
                veil = veil + weight[..., :1] * source + weight[..., 1:] * _blurred(source)
        veil = _enlarged(veil, self.size, self.first, 0)
        rods = white_relative(scotopic(veil[..., :3]))[..., None]
        added = np.concatenate([veil[..., :3], rods], axis=-1)[..., : whole.shape[2]]
        return np.asarray(((1.0 - veil[..., 3:]) * whole + added)[::-1])


@lru_cache(maxsize=4)
def pyramid(
    model: GlareModel, observer: Observer, size: tuple[int, int], field: tuple[float, float]
) -> Pyramid:
    """The pyramid for a picture of ``size`` (w, h) pixels and ``field`` degrees.

    Raises HdrusdError for a field that no perspective picture has.
    """
    pixel = pixel_angle(size, field)
    last = 0
    while math.prod(level_size(size, last)) > _DENSE:
        last += 1
    if model.psf is None:
        return _of_shares(model, size, field, last)
    first, levels = first_level(model, observer, pixel)
    last = max(first, last)
    least = (1.0 + sum(half**2 for half in plane(field))) ** -0.75
    scales = np.linspace(1.0, least, NODES)
    fits = np.stack([weights(model, observer, pixel, scale) for scale in scales])
    drawn = np.pad(fits, [(0, 0), (0, max(last + 1 - first - levels, 0)), (0, 0)])
    tables = np.stack(
        [
            _wide_table(model, observer, pixel, scale, first, last, fit)
            for scale, fit in zip(scales, fits, strict=True)
        ]
    )
    rays = _rays(size, field, last)
    texel = 4.0 * math.prod(plane(field)) / math.prod(size) * 4.0**last
    solid = (texel * np.abs(rays[:, 2]) ** 3).astype(np.float32)
    parts = np.array_split(rays, max(len(rays) // 256, 1))
    spread = np.concatenate([_looked_up(tables, least, part, rays) * solid for part in parts])
    return Pyramid(
        size, field, first, last, least, drawn[:, : last + 1 - first], spread, rays, tables
    )


def _of_shares(
    model: GlareModel, size: tuple[int, int], field: tuple[float, float], last: int
) -> Pyramid:
    """Of a model without a point spread: nothing but the dense matrix."""
    if model.shares is None:
        raise HdrusdError(f"glare model {model.name}: has neither point spread nor shares")
    rays = _rays(size, field, last)
    # How much of the frame each holds: the fourth channel of the level.
    along = [np.pad(np.ones(n), MARGIN) for n in size]
    for _ in range(last):
        along = [_halved_along(part, 0) for part in along]
    across, down = (part[MARGIN - 1 : 1 - MARGIN] for part in along)
    inside = np.outer(down, across).ravel()
    spread = model.shares(rays @ rays.T, inside).astype(np.float32)
    none = np.zeros((NODES, 0))
    return Pyramid(size, field, last, last, 1.0, none, spread, rays, none)


def _wide_table(
    model: GlareModel,
    observer: Observer,
    pixel: float,
    scale: float,
    first: int,
    last: int,
    fit: Array,
) -> Array:
    """What levels up to ``last`` leave of the kernel, (_CELLS,) float32, sr^-1.

    ``fit`` (n, 2): the weights of the first level and the following ones for that scale.
    """
    chord = (math.sqrt(2.0) * (np.arange(_CELLS) + 0.5) / _CELLS) ** 2
    theta = np.degrees(2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)))
    sigma = sigmas(first, len(fit)) * pixel * scale
    # Variance, degrees^2, that the texels of ``last`` add by being made and enlarged.
    smooth = (4.0**last - 1.0) / 2.0 * (pixel * scale) ** 2
    sums = []
    drawn = np.arange(len(fit))[:, None] <= last - first
    for part, added in ((drawn, 0.0), (~drawn, smooth)):
        counts = part & (fit > 0.0)
        variance = sigma[counts] ** 2 - added
        # Variances add up, and so do excesses times their squares.
        fourth = np.broadcast_to(EXCESS, fit.shape)[counts] * sigma[counts] ** 4
        excess = (fourth - EXCESS[0] * added**2) / variance**2
        sums.append(gaussians(theta, np.sqrt(variance), excess) @ fit[counts])
    # Of 1 / theta^2, smoothing by a variance makes 1 / (theta^2 - 2 variance).
    beyond = kernel(model, observer, pixel, np.sqrt(theta**2 + 2.0 * smooth)) - sums[0]
    return np.where(theta < WIDEST, sums[1], np.maximum(beyond, 0.0)).astype(np.float32)


def _between(scale: Array, least: float) -> tuple[Array, Array]:
    """Of values of s: the node before each, and how far on it is towards the next, 0 to 1."""
    place = np.clip((1.0 - scale) / max(1.0 - least, 1e-9), 0.0, 1.0) * (NODES - 1)
    low = np.minimum(place.astype(np.int64), NODES - 2)
    return low, place - low


def _looked_up(tables: Array, least: float, a: Array, b: Array) -> Array:
    """(n, m) float32 of the tables between unit vectors (n, 3), whose s counts, and (m, 3)."""
    root = np.sqrt(np.sqrt(np.maximum(2.0 - 2.0 * (a @ b.T), 0.0)))
    cell = np.minimum((root * (_CELLS / math.sqrt(2.0))).astype(np.int32), _CELLS - 1)
    low, part = _between(np.abs(a[:, 2]) ** 1.5, least)
    cell += low[:, None].astype(np.int32) * _CELLS
    share = part[:, None].astype(np.float32)
    flat = tables.ravel()
    return np.asarray(flat.take(cell) * (1.0 - share) + flat.take(cell + _CELLS) * share)


def _rays(size: tuple[int, int], field: tuple[float, float], level: int) -> Array:
    """Unit vectors (n, 3) through the texels of a level and one more around, bottom row first."""
    x, y = (
        half * (2.0 * (np.arange(-1, texels + 1) + 0.5) * 2.0**level / pixels - 1.0)
        for half, texels, pixels in zip(plane(field), level_size(size, level), size, strict=True)
    )
    grid = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), -1.0)], axis=-1).reshape(-1, 3)
    return np.asarray(grid / np.linalg.norm(grid, axis=1, keepdims=True))


def _around(texels: int) -> list[tuple[int, int]]:
    return [(texels, texels), (texels, texels), (0, 0)]


def _halved(level: Array) -> Array:
    """The next level of one with its MARGIN, with its own."""
    return _halved_along(_halved_along(level, 0), 1)


def _halved_along(level: Array, axis: int) -> Array:
    """By (1, 3, 3, 1) / 8 along an axis, dark beyond."""
    texels = (level.shape[axis] - 2 * MARGIN + 1) // 2 + 2 * MARGIN
    # Texel i is made of 2 i - 1 to 2 i + 2, counted from the frame's edge.
    low = MARGIN + 1
    high = 2 * texels + 2 - low - level.shape[axis]
    pads = [(low, high) if a == axis else (0, 0) for a in range(level.ndim)]
    padded = np.pad(level, pads)
    taps = [np.take(padded, np.arange(texels) * 2 + i, axis) for i in range(4)]
    return np.asarray(0.125 * (taps[0] + taps[3]) + 0.375 * (taps[1] + taps[2]))


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
