"""Lamps and pixels on the levels of the pyramid (glare/pyramid.py), as texels to add.

Rows are those of veil.py: a lamp is a direction with lux, a pixel that shows lamps which are
rows of their own is one with shares below 0.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.errors import HdrusdError
from hdrusd.glare.model import Array
from hdrusd.glare.veil import LAMP, plane

#: Texels around the frame that a level has too: light of the frame lies in them, and lamps.
MARGIN = 2

#: By how much a pixel counts in the texels of the next level that it reaches along an axis:
#: that which holds it, and the other neighbour.
_SHARES = (0.375, 0.125)


def level_size(size: tuple[int, int], level: int) -> tuple[int, int]:
    """(w, h) in texels of a level of a picture of ``size`` pixels, without its margin."""
    return -(-size[0] >> level), -(-size[1] >> level)


def as_lamps(lamps: npt.ArrayLike) -> Array:
    """Rows that give light, float64; raises HdrusdError for what are no rows."""
    rows = _rows(lamps)
    return rows[np.any(rows[:, 3:] > 0.0, axis=1)]


def shown_pixels(
    lamps: npt.ArrayLike, size: tuple[int, int], field: tuple[float, float]
) -> tuple[npt.NDArray[np.int64], Array]:
    """Pixels that show lamps: column and row from below, (n, 2), and shares (n, 3), 0 to 1.

    Each pixel once, with the largest share that a row gives it. Raises HdrusdError.
    """
    rows = _rows(lamps)
    rows = rows[np.any(rows[:, 3:] < 0.0, axis=1) & (rows[:, 2] < -1e-3)]
    at = rows[:, :2] / -rows[:, 2:3] / np.array(plane(field))
    pixel = np.floor((np.clip(at, -2.0, 2.0) + 1.0) * 0.5 * size).astype(np.int64)
    inside = np.all((pixel >= 0) & (pixel < size), axis=1)
    found, which = np.unique(pixel[inside], axis=0, return_inverse=True)
    shares = np.zeros((len(found), 3))
    np.maximum.at(shares, which.ravel(), np.clip(-rows[inside, 3:], 0.0, 1.0))
    return found, shares


def taken(
    level: int, pixels: npt.NDArray[np.int64], shares: Array
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]:
    """What level 0 or 1 does not get of pixels (n, 2): the pixel, the texel with the margin,

    and the share (., 3) of the pixel's luminance to take from it. Exactly what halving has put
    there.
    """
    if level == 0:
        return pixels, pixels + MARGIN, shares
    # Texel i is made of 2 i - 1 to 2 i + 2: of an even pixel the other one is i - 1.
    own, other = pixels // 2, pixels // 2 + pixels % 2 * 2 - 1
    texels, parts = [], []
    for x, across in zip((own, other), _SHARES, strict=True):
        for y, down in zip((own, other), _SHARES, strict=True):
            texels.append(np.stack([x[:, 0], y[:, 1]], axis=1) + MARGIN)
            parts.append(shares * (across * down))
    return np.tile(pixels, (4, 1)), np.concatenate(texels), np.concatenate(parts)


def splats(
    level: int, lamps: Array, size: tuple[int, int], field: tuple[float, float]
) -> tuple[npt.NDArray[np.int64], Array]:
    """Lamps (k, 6) as texels of a level: column and row (n, 2) with the margin,

    and the luminance (n, 3) to add there. A lamp is shared out as the levels do with a
    pixel, in the end by a quadratic B-spline over 3 x 3 texels. Lamps that are too far
    from the frame to reach it by this level give none.
    """
    ahead = lamps[lamps[:, 2] < -1e-3]
    half = np.array(plane(field))
    at = ahead[:, :2] / -ahead[:, 2:3]
    place = (at / half + 1.0) * 0.5 * size / 2.0**level - 0.5 + MARGIN
    limits = np.array(level_size(size, level)) + 2 * MARGIN
    near = np.all((place > -2.0) & (place < limits + 1), axis=1)
    ahead, place = ahead[near], place[near]
    # As a pixel there would have it: lux over the solid angle of a texel.
    area = 4.0 * math.prod(half) / math.prod(size) * 4.0**level
    luminance = ahead[:, 3:] / (area * np.abs(ahead[:, 2:3]) ** 3)
    centre = np.rint(place)
    off = place - centre
    share = np.stack([0.5 * (0.5 - off) ** 2, 0.75 - off**2, 0.5 * (0.5 + off) ** 2])
    places, lights = [], []
    for y in range(3):
        for x in range(3):
            places.append(centre + np.array([x - 1, y - 1]))
            lights.append(luminance * (share[x, :, 0] * share[y, :, 1])[:, None])
    texels = np.concatenate(places).astype(np.int64)
    inside = np.all((texels >= 0) & (texels < limits), axis=1)
    return texels[inside], np.concatenate(lights)[inside]


def _rows(lamps: npt.ArrayLike) -> Array:
    rows = np.asarray(lamps, np.float64)
    if rows.ndim != 2 or rows.shape[1] != LAMP or not np.all(np.isfinite(rows)):
        raise HdrusdError(
            f"lamps of shape {rows.shape}; want finite rows of a direction and lux per channel"
        )
    return rows
