"""Exposure-bracketed pictures of one scene merged into light, and light into cd/m2.

A pixel's light is E = sum(w h g(Z)) / sum(w h^2) over the pictures, h their exposures, g the
inverse of the response (photometry/response.py), w a weight that noisy and saturated codes do
not have (Robertson, Borman and Stevenson 2003, equation 8): the likeliest E where codes are
equally sure, longer exposures counting for more. E is in units of the response's own; one
factor, from a known luminance, makes cd/m2 of it.

Exposure: h = t S / N^2 with t in s, S the ISO speed, N the f-number, up to a factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance
from hdrusd.errors import HdrusdError
from hdrusd.photometry.response import DARK, SATURATED, Response, bell

Floats = npt.NDArray[np.float64]
Light = npt.NDArray[np.float32]

#: K of L = K N^2 / (t S), the luminance that comes out at ``CODE``: by the standard output
#: sensitivity of ISO 12232, 10/S lx s give that code, and q = 0.65 is the lens's share there.
#: K of a reflected-light meter by ISO 2720 is 10.6 to 13.4.
CAMERA_CONSTANT = 10.0 / 0.65
CODE = 118.0 / 255.0

#: A pixel departs where its code is further from what the others say than this many times the
#: noise, and by some codes of 8 bits.
_NOISES, _CODES = 6.0, 2.0

#: Levels of the code range of each of which the noise is known.
_LEVELS = 16

#: How much of the middle of a code range two pictures share where they are compared.
_SURE = 0.05

#: Of a pixel that no picture holds: noise in all, saturated in all, or one after the other.
HELD, TOO_DARK, TOO_BRIGHT, BETWEEN = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class Exposed:
    """What the codes 0 ... top of one picture say.

    ``exposure``: h. ``light``: (c, top + 1) float32, E of each code. ``weight``: (top + 1)
    float32, w h^2; 0 where a code is noise or saturated. ``tolerance``: (c, top + 1) float32, by
    how much E may differ from the merged one; None before the noise is known.
    """

    exposure: float
    light: Light
    weight: Light
    tolerance: Light | None = None

    @property
    def top(self) -> int:
        """The highest code."""
        return len(self.weight) - 1

    @property
    def dark(self) -> float:
        """The highest code that is noise."""
        return DARK[self.top] * self.top

    @property
    def saturated(self) -> float:
        """The lowest code that is saturated."""
        return SATURATED * self.top


def exposed(response: Response, exposure: float, top: int) -> Exposed:
    """The tables of a picture of ``exposure`` with codes 0 ... ``top``, 255 or 65535."""
    share = np.arange(top + 1) / top
    weight = np.where((share > DARK[top]) & (share < SATURATED), bell(share), 0.0)
    light = response.table(top) / exposure
    return Exposed(
        exposure, light.astype(np.float32), (weight * exposure * exposure).astype(np.float32)
    )


def _look_up(table: npt.NDArray[Any], codes: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """``table`` (c or 1, n) at ``codes`` (..., c), each channel in its own row."""
    out = np.empty(codes.shape, table.dtype)
    for channel in range(codes.shape[-1]):
        out[..., channel] = table[channel % len(table)][codes[..., channel]]
    return out


def merge(
    codes: Sequence[npt.NDArray[Any]], pictures: Sequence[Exposed]
) -> tuple[Light, npt.NDArray[np.uint8]]:
    """E of every pixel and channel, (..., c) float32, and which pictures hold it, (..., c).

    ``codes``: (..., c) integers of each of ``pictures``, which rise in exposure. What no picture
    holds gets its bound: E of the lowest saturated code in the shortest exposure where it is
    saturated; the reading of the longest where all is noise, at most E of the highest noisy code;
    the geometric mean of both bounds where it falls between two exposures.
    """
    total = np.zeros(codes[0].shape, np.float32)
    weights = np.zeros(codes[0].shape, np.float32)
    for code, picture in zip(codes, pictures, strict=True):
        weight = picture.weight[code]
        weights += weight
        total += weight * _look_up(picture.light, code)
    state = np.zeros(codes[0].shape, np.uint8)
    lost = np.nonzero(weights <= 0.0)
    weights[lost] = 1.0
    total /= weights
    if len(lost[0]):
        values, states = _bounds([code[lost] for code in codes], pictures, lost[-1])
        total[lost], state[lost] = values, states
    return total, state


def _bounds(
    codes: Sequence[npt.NDArray[Any]], pictures: Sequence[Exposed], channel: npt.NDArray[np.intp]
) -> tuple[Light, npt.NDArray[np.uint8]]:
    """The best bound, (n), of what no picture holds, and why it is not held."""
    least = np.zeros(len(channel), np.float32)
    most = np.full(len(channel), np.inf, np.float32)
    for code, picture in zip(codes, pictures, strict=True):
        row = channel % len(picture.light)
        low = picture.light[row, int(picture.dark)]
        high = picture.light[row, int(np.ceil(picture.saturated))]
        most = np.where(code <= picture.dark, np.minimum(most, low), most)
        least = np.where(code >= picture.saturated, np.maximum(least, high), least)
    longest = pictures[-1]
    reading = longest.light[channel % len(longest.light), codes[-1]]
    bright, dark = least > 0.0, np.isfinite(most)
    both = np.sqrt(least * np.where(dark, most, 0.0))
    value = np.where(bright & dark, both, np.where(bright, least, np.minimum(reading, most)))
    state = np.where(bright & dark, BETWEEN, np.where(bright, TOO_BRIGHT, TOO_DARK))
    return value.astype(np.float32), state.astype(np.uint8)


def steady(codes: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Which of n pixels show the same light in all pictures, whatever the response is.

    ``codes`` (n, p, c) as shares, pictures rising in exposure. A code in one picture comes with
    one code in the next, so a pixel that is far from the median of its like saw something move.
    """
    kept = np.ones(len(codes), np.bool_)
    for k in range(codes.shape[1] - 1):
        for channel in range(codes.shape[2]):
            group = np.rint(codes[:, k, channel] * 255.0).astype(np.int64)
            value = codes[:, k + 1, channel]
            away = np.abs(value - _medians(group, value)[group])
            usual = _medians(group, away)[group]
            many = np.bincount(group, minlength=256)[group] >= 5
            kept &= ~many | (away <= 6.0 * usual + 3.0 / 255.0)
    return kept


def _medians(group: npt.NDArray[np.int64], value: npt.NDArray[Any]) -> Floats:
    """The lower median of ``value`` (n) in each of 256 groups; 0 in empty ones."""
    ordered = value[np.lexsort((value, group))]
    count = np.bincount(group, minlength=256)
    first = np.cumsum(count) - count
    middle = np.minimum(first + np.maximum(count - 1, 0) // 2, len(value) - 1)
    return np.where(count > 0, ordered[middle], 0.0)


def flattest(codes: npt.NDArray[Any], spread: npt.NDArray[Any], most: int) -> npt.NDArray[np.intp]:
    """Which at most ``most`` of n pixels to recover a response from.

    ``codes`` (n, p, c) as shares, ``spread`` (n) how much each differs from its neighbours. They
    are sorted by brightness into strata of one size, and the flattest of each are taken: edges
    move between exposures, and each code must be seen.
    """
    order = np.argsort(codes.mean(axis=(1, 2)), kind="stable")
    strata = np.array_split(order, max(1, min(64, len(order) // 16)))
    each = max(1, most // len(strata))
    chosen = [stratum[np.argsort(spread[stratum], kind="stable")[:each]] for stratum in strata]
    return np.concatenate(chosen)


def noise(codes: Sequence[npt.NDArray[Any]], pictures: Sequence[Exposed], light: Light) -> Floats:
    """Standard deviation of codes, as a share of the range, at ``_LEVELS`` levels of it.

    ``codes``: (n, c) of each picture, ``light`` (n, c) merged from them. By the median of the
    absolute differences from what ``light`` makes each picture show; at least the rounding.
    """
    shares, differences = [], []
    for code, picture in zip(codes, pictures, strict=True):
        held = picture.weight[code] > 0.0
        for channel in range(code.shape[-1]):
            table = picture.light[channel % len(picture.light)].astype(np.float64)
            shown = np.interp(light[..., channel], table, np.arange(len(table)))
            inside = held[..., channel]
            shares.append(code[..., channel][inside] / picture.top)
            differences.append((shown - code[..., channel])[inside] / picture.top)
    share, difference = np.concatenate(shares), np.concatenate(differences)
    level = np.minimum((share * _LEVELS).astype(np.int64), _LEVELS - 1)
    least = 0.5 / 255.0 if all(picture.top == 255 for picture in pictures) else 0.5 / 4095.0
    known, sigma = [], []
    for k in range(_LEVELS):
        found = difference[level == k]
        if len(found) >= 16:
            known.append(k)
            sigma.append(max(1.4826 * float(np.median(np.abs(found))), least))
    if not known:
        return np.full(_LEVELS, least)
    return np.asarray(np.interp(np.arange(_LEVELS), known, sigma))


def with_tolerance(picture: Exposed, sigma: Floats) -> Exposed:
    """``picture`` with the ``tolerance`` that noise (``noise``) leaves."""
    top = picture.top
    share = np.arange(top + 1) / top
    middle = (np.arange(len(sigma)) + 0.5) / len(sigma)
    step = (_NOISES * np.interp(share, middle, sigma) + _CODES / 255.0) * top
    codes = np.arange(top + 1)
    above = np.minimum(codes + np.ceil(step).astype(np.int64), top)
    below = np.maximum(codes - np.ceil(step).astype(np.int64), 0)
    light = picture.light
    wide = np.maximum(light[:, above] - light, light - light[:, below])
    return Exposed(picture.exposure, light, picture.weight, wide.astype(np.float32))


def departs(code: npt.NDArray[Any], picture: Exposed, light: Light) -> npt.NDArray[np.bool_]:
    """Where a picture, (..., c), differs from the merged ``light`` beyond noise, (...).

    Something moved, or the camera did; that is not mended. Raises HdrusdError without tolerance.
    """
    if picture.tolerance is None:
        raise HdrusdError("the noise of a picture is not known; want with_tolerance first")
    away = np.abs(_look_up(picture.light, code) - light) > _look_up(picture.tolerance, code)
    return np.asarray((away & (picture.weight[code] > 0.0)).any(axis=-1))


def ratio(code: npt.NDArray[Any], other: npt.NDArray[Any], a: Exposed, b: Exposed) -> float:
    """The median of E by picture ``a`` over E by ``b`` where both hold it surely; 1 is ideal.

    ``code``, ``other``: (n, c) of the same pixels. NaN where too few pixels are shared.
    """
    low = _SURE * a.exposure**2, _SURE * b.exposure**2
    both = (a.weight[code] > low[0]) & (b.weight[other] > low[1])
    if np.count_nonzero(both) < 16:
        return float("nan")
    return float(np.median(_look_up(a.light, code)[both] / _look_up(b.light, other)[both]))


def disc(shape: tuple[int, ...], x: float, y: float, radius: float) -> npt.NDArray[np.bool_]:
    """The pixels (h, w) whose centres are within ``radius`` of the centre of pixel x, y.

    x to the right and y down from the top left pixel, 0, 0; radius 0 is that pixel.
    """
    down, right = np.ogrid[: shape[0], : shape[1]]
    return np.asarray((right - x) ** 2 + (down - y) ** 2 <= radius * radius + 1e-9)


def factor_of(light: npt.ArrayLike, wanted: float) -> float:
    """What makes the mean luminance of ``light`` (n, 3) the ``wanted`` cd/m2.

    For a spot that was measured; for a lamp of I candela and projected area A in m2, L = I / A
    over all of that area. Raises HdrusdError where there is no light.
    """
    mean = float(np.mean(luminance(np.asarray(light, np.float64)))) if np.size(light) else 0.0
    if not (np.isfinite(mean) and mean > 0.0):
        raise HdrusdError("no light there to calibrate by")
    return wanted / mean


def camera_factor(response: Response, constant: float = CAMERA_CONSTANT) -> float:
    """cd/m2 of E = 1 by L = K N^2 / (t S) at the code ``CODE``, exposures being t S / N^2."""
    grey = np.broadcast_to(response.at(CODE), 3)
    return constant / float(luminance(grey))
