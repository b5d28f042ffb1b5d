"""The frame as the fovea samples it: one mean for each degree, and single pixels beside it.

What adapts an eye is the mean luminance over about the fovea's one degree, so statistics of
vision are taken from the frame at one sample a degree (G. Ward Larson, H. Rushmeier,
C. Piatko, IEEE TVCG 3(4), 1997, section 4.1). Single pixels join in so that lamps much
smaller than a degree are represented, as in the pcond of Radiance since 2017. This is the
definition of gpu/foveal.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import clean, luminance

Array = npt.NDArray[Any]

#: Degrees that the larger side of a frame has where its camera is unknown (pcond's).
DEFAULT_FIELD = 40.0

#: cd/m2 that a sample must exceed to count: less than any night sky has, so it is no sky but
#: nothing. The logarithm of a void would decide what the eye adapts to.
VOID = 1e-5

#: cd/m2 that the eye is adapted to where there is nothing but void.
DARKEST = 1e-6

#: Most samples along a side: 104 degrees, and by then a sample at the edge is 0.4 degrees wide.
MOST = 256

#: Single pixels a sample, along each side: 16 for the area.
POINTS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Foveal:
    """A frame in samples of one degree.

    ``rgb`` (fh, fw, 3): arithmetic means of the pixels in each sample, cd/m2, top row first.
    ``points`` (k,): luminance of single pixels spread over the frame, cd/m2. ``field``: the
    frame's width and height, degrees.
    """

    rgb: Array
    points: Array
    field: tuple[float, float]

    @property
    def luminance(self) -> Array:
        """Luminance of the samples (fh, fw), cd/m2."""
        return luminance(np.asarray(self.rgb, np.float64))


def default_field(width: int, height: int) -> tuple[float, float]:
    """Degrees of a frame of that many square pixels whose larger side has DEFAULT_FIELD."""
    half = math.tan(math.radians(DEFAULT_FIELD / 2.0)) / max(width, height)
    across, down = (math.degrees(2.0 * math.atan(half * side)) for side in (width, height))
    return across, down


def foveal_size(field: tuple[float, float]) -> tuple[int, int]:
    """(fw, fh): samples across and down a field of view in degrees, one a degree at the centre."""
    across, down = (
        2.0 * math.tan(math.radians(min(max(angle, 0.0), 179.0)) / 2.0) / math.radians(1.0)
        for angle in field
    )
    # floor(x + 0.5): halves go up, whatever the language.
    return tuple(min(max(math.floor(n + 0.5), 2), MOST) for n in (across, down))  # type: ignore[return-value]


def borders(pixels: int, samples: int) -> Array:
    """Where samples begin and end (samples + 1,): pixel i belongs to one, each gets a pixel."""
    return (2 * np.arange(samples + 1) * pixels + samples) // (2 * samples)


def grid(width: int, height: int, field: tuple[float, float]) -> tuple[int, int]:
    """(fw, fh) for a frame of that size: a sample is a pixel or larger."""
    fw, fh = foveal_size(field)
    return min(fw, width), min(fh, height)


def point_pixels(width: int, height: int, size: tuple[int, int]) -> Array:
    """Pixels (k, 2), x to the right and y down, whose luminances become ``Foveal.points``.

    One at random, but always the same, in each cell of a grid of 4 fw x 4 fh over the frame;
    all pixels where there are no more than that.
    """
    columns, rows = POINTS * size[0], POINTS * size[1]
    if columns * rows >= width * height:
        y, x = np.divmod(np.arange(width * height), width)
        return np.stack([x, y], axis=-1)
    cell = np.arange(columns * rows)
    row, column = np.divmod(cell, columns)
    # Place in units of 1/65536 of a cell.
    bits = _hash(cell.astype(np.uint32)).astype(np.int64)
    x = ((column << 16) + (bits & 0xFFFF)) * width // (columns << 16)
    y = ((row << 16) + (bits >> 16)) * height // (rows << 16)
    return np.stack([x, y], axis=-1)


def _hash(n: Array) -> Array:
    """32 well mixed bits of 32: "lowbias32" (C. Wellons, Prospecting for Hash Functions, 2018)."""
    n = (n ^ (n >> np.uint32(16))) * np.uint32(0x7FEB352D)
    n = (n ^ (n >> np.uint32(15))) * np.uint32(0x846CA68B)
    n ^= n >> np.uint32(16)
    return n


def foveal(rgb: npt.ArrayLike, field: tuple[float, float]) -> Foveal:
    """The foveal image of a frame (h, w, 3), cd/m2, top row first; ``field`` in degrees.

    NaN and negative channels count as 0, infinity as colour.BRIGHTEST.
    """
    rgb = clean(np.asarray(rgb))
    height, width = rgb.shape[:2]
    fw, fh = size = grid(width, height, field)
    left, top = borders(width, fw), borders(height, fh)
    sums = np.add.reduceat(rgb, left[:-1], axis=1, dtype=np.float64)
    sums = np.add.reduceat(sums, top[:-1], axis=0)
    areas = np.diff(top)[:, None] * np.diff(left)[None, :]
    x, y = point_pixels(width, height, size).T
    points = luminance(rgb[y, x].astype(np.float64))
    return Foveal(sums / areas[..., None], points, field)


def directions(size: tuple[int, int], field: tuple[float, float]) -> Array:
    """Unit vectors (fh, fw, 3) from the eye through the samples' centres.

    +x to the right, +y up, the line of sight along -z; ``size`` is (fw, fh), ``field`` degrees.
    """
    right, up = (math.tan(math.radians(min(angle, 179.0)) / 2.0) for angle in field)
    x = right * ((2 * np.arange(size[0]) + 1) / size[0] - 1.0)
    y = up * (1.0 - (2 * np.arange(size[1]) + 1) / size[1])
    rays = np.stack([*np.meshgrid(x, y), np.full((size[1], size[0]), -1.0)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return rays


def centre_weights(size: tuple[int, int]) -> Array:
    """Weight of each sample (fh, fw): 1 - r^2, r = distance from the centre in 90 samples.

    What pcond's -w does; nothing weighs less than 0.
    """
    x, y = ((np.arange(n) - (n - 1) / 2.0) / 90.0 for n in size)
    return np.maximum(1.0 - x[None, :] ** 2 - y[:, None] ** 2, 0.0)


def gaze_weights(size: tuple[int, int], field: tuple[float, float], spread: float = 10.0) -> Array:
    """Weight of each sample (fh, fw) for eyes that stay about the centre.

    A Gaussian of the angle from the line of sight; ``spread`` is its standard deviation,
    degrees.
    """
    theta = np.degrees(np.arccos(np.minimum(-directions(size, field)[..., 2], 1.0)))
    return np.exp(-0.5 * (theta / spread) ** 2)


def log_mean(y: npt.ArrayLike, weights: npt.ArrayLike | None = None) -> float:
    """Weighted geometric mean of luminance: what the eye adapts to, cd/m2.

    Of samples and weights of one shape; 1 each without weights. Samples of VOID and less show
    nothing that was modelled, and do not count; a frame of nothing else is DARKEST.
    """
    y = np.asarray(y, np.float64)
    w = np.where(y > VOID, 1.0 if weights is None else np.asarray(weights, np.float64), 0.0)
    if not w.any():
        return DARKEST
    return math.exp(float(np.average(np.log(np.maximum(y, VOID)), weights=w)))
