"""Light that was painted or photographed into a texture: soft shadows, glowing lamps.

A reflectance map that holds light is lit twice. Neither can be known from the picture alone,
so these are suspicions, with statistics that leave hard-edged things alone: a shadow's edge
is wide and keeps the hue, a painted line's is narrow; a lamp's glow falls off over several
texels, a white dot's does not. What has a hard edge is not found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.units import LUMINANCE_WEIGHTS

Array = npt.NDArray[Any]

#: Texels a side of a picture that is looked at; of a larger one every k-th.
OVERVIEW = 2048

#: Blocks along each side, on which shadows are looked for; smaller pictures say too little.
_BLOCKS = 64
_LEAST = 32

#: A shadow takes at least half of the light.
_SHADE = 2.0

#: Its edge is at least this share of the picture wide; a hard edge, as blurred here, is 0.08.
_EDGE = 0.2

#: Bright and dark blocks have the same chromaticity within this (r and g of r + g + b = 1).
_HUE = 0.02

#: Side of the picture on which lamps are looked for.
_SIDE = 512

#: Code 250 of 255 at gamma 2.2: as bright as a camera tells.
_FULL = (250.0 / 255.0) ** 2.2

#: Of the rest of a picture with lamps in it, and share of it that they take.
_DIM, _MOST = 0.2, 0.02

#: Texels over which a glow falls to half at least; scaling and JPEG blur an edge by one or two.
_GLOW = 3


@dataclass(frozen=True, slots=True)
class Shade:
    """A suspected baked shadow: bright over dark, and the width of its edge (share of a side)."""

    ratio: float
    edge: float


def baked_shadow(linear: Array) -> Shade | None:
    """A soft modulation of a picture in linear values, (h, w, 3), that keeps its hue.

    The logarithm of the block means' luminance, smoothed by a Gaussian of 2 blocks, spans D
    (5th to 95th percentile) with gradients up to G (their 95th percentile): its edges are D / G
    wide. A step, smoothed so, has sqrt(2 pi) 2/64 = 0.08; a ramp has its own width.
    """
    if min(linear.shape[:2]) < _LEAST:
        return None
    blocks = _smooth(_block_means(linear, _BLOCKS))
    luminance = blocks @ np.asarray(LUMINANCE_WEIGHTS)
    if not (luminance > 1e-4).all():
        return None  # black holds no hue, and a cut-out's surroundings are no shadow
    log = np.log(luminance)
    dark, bright = np.quantile(log, (0.05, 0.95))
    if bright - dark < np.log(_SHADE):
        return None
    down, across = np.gradient(log)
    steep = np.quantile(np.hypot(down * log.shape[0], across * log.shape[1]), 0.95)
    edge = float((bright - dark) / steep)
    hue = blocks / blocks.sum(axis=-1, keepdims=True)
    lit, shaded = (log >= np.quantile(log, 0.75)), (log <= np.quantile(log, 0.25))
    shift = float(np.abs(hue[lit].mean(axis=0) - hue[shaded].mean(axis=0)).max())
    if edge < _EDGE or shift > _HUE:
        return None
    return Shade(float(np.exp(bright - dark)), edge)


def baked_lamps(linear: Array) -> int:
    """How many texels (of a picture of at most 512) are full, few, and in a wide glow; 0: no lamp.

    Of the texels at each distance from the full ones the mean luminance is taken. A glow is
    still above half of the way down to the picture's median after ``_GLOW`` texels, falls all
    the way, and has come down to a quarter of it at 8 times that.
    """
    if min(linear.shape[:2]) < _LEAST or linear.max() < _FULL:
        return 0
    picture = _block_means(linear, min(_SIDE, max(linear.shape[:2])))
    luminance = picture @ np.asarray(LUMINANCE_WEIGHTS)
    full = picture.max(axis=-1) >= _FULL
    count, ground = int(full.sum()), float(np.median(luminance))
    if not 0 < count <= _MOST * full.size or ground > _DIM:
        return 0
    rings, reached = [], full
    for _ in range(8 * _GLOW):
        grown = _grown(reached)
        ring = grown & ~reached
        if not ring.any():
            return 0
        rings.append((float(luminance[ring].mean()) - ground) / (1.0 - ground))
        reached = grown
    falling = bool((np.diff(rings) <= 0.01).all())
    return count if rings[_GLOW - 1] > 0.5 and falling and rings[-1] < 0.25 else 0


def _block_means(linear: Array, most: int) -> Array:
    """The picture as means of at most ``most`` blocks a side, (m, n, 3)."""
    rows, columns = (min(size, most) for size in linear.shape[:2])
    high, wide = linear.shape[0] // rows, linear.shape[1] // columns
    if (high * rows, wide * columns) == linear.shape[:2]:  # whole blocks, several times as fast
        lines = linear.reshape(rows, high, -1).sum(axis=1)
        return np.asarray(lines.reshape(rows, columns, wide, 3).sum(axis=2) / (high * wide))
    top = np.arange(rows) * linear.shape[0] // rows
    left = np.arange(columns) * linear.shape[1] // columns
    sums = np.add.reduceat(np.add.reduceat(linear, top, axis=0), left, axis=1)
    heights = np.diff(np.append(top, linear.shape[0]))
    widths = np.diff(np.append(left, linear.shape[1]))
    return np.asarray(sums / (heights[:, None, None] * widths[None, :, None]))


def _smooth(blocks: Array) -> Array:
    """A binomial filter with the variance of a Gaussian of 2 blocks; the border goes on."""
    for _ in range(8):  # each has a variance of 1/2
        for axis in (0, 1):
            padded = np.pad(blocks, [(1, 1) if a == axis else (0, 0) for a in range(3)], "edge")
            size = blocks.shape[axis]
            before, middle, after = (
                np.take(padded, range(k, k + size), axis=axis) for k in range(3)
            )
            blocks = 0.25 * before + 0.5 * middle + 0.25 * after
    return blocks


def _grown(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """The mask and its four neighbours."""
    grown = mask.copy()
    grown[1:] |= mask[:-1]
    grown[:-1] |= mask[1:]
    grown[:, 1:] |= mask[:, :-1]
    grown[:, :-1] |= mask[:, 1:]
    return grown
