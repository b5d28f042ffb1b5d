"""What Radiance's pcond does beside the science: its random pixels, its colours, its rounding.

With these our functions meet its pictures; without them a picture of pcond is one draw of
several: it takes a quarter of the pixels at random.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenEXR

from hdrusd.eye.acuity import halve, mip_texel, resolvable
from hdrusd.eye.foveal import Foveal, directions, foveal_size
from hdrusd.eye.scotopic import CONE_LIMIT, ROD_LIMIT
from hdrusd.eye.threshold import tvi_ward
from hdrusd.glare import moon_spencer
from hdrusd.tonemap.curve import Curve, proportional
from hdrusd.tonemap.histogram import Histogram, adapted_anchor, histogram, proportionate, trimmed

#: Field of view of the pictures, degrees, and the display: -u 100 -d 100.
FIELD = (60.0, 35.98339777135764)
LOW, HIGH = 1.0, 100.0

#: Radiance adapts an RGB white to equal energy before it takes Y (sharpened von Kries), so that
#: its luminance weights of Rec. 709 are not those of the standard.
SHARP = np.array([[1.2694, -0.0988, -0.1706], [-0.8364, 1.8006, 0.0357], [0.0297, -0.0315, 1.0018]])
TO_XYZ = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923],
     [0.0193308, 0.1191948, 0.9505322]]
)  # fmt: skip
_TO_EQUAL = (SHARP @ np.ones(3)) / (SHARP @ TO_XYZ.sum(axis=1))
WEIGHTS = (np.linalg.inv(SHARP) @ (_TO_EQUAL[:, None] * (SHARP @ TO_XYZ)))[1]

#: Its scotopic luminance of a colour, 1 for white.
SCOTOPIC = np.array([0.062, 0.608, 0.330])


def picture(file: Path) -> np.ndarray:
    with OpenEXR.File(str(file)) as exr:
        return exr.channels()["RGB"].pixels.astype(np.float64)


def luminance(rgb: np.ndarray) -> np.ndarray:
    return rgb @ WEIGHTS


def through_rgbe(rgb: np.ndarray) -> np.ndarray:
    """A picture in cd/m2 as a Radiance file has it: 8 bits below the largest channel's."""
    _, exponent = np.frexp(rgb.max(axis=-1, keepdims=True) / 179.0)
    step = np.ldexp(179.0, exponent - 8)
    return (np.floor(rgb / step) + 0.5) * step


def one_degree(rgb: np.ndarray) -> np.ndarray:
    """Its foveal image: samples begin at the pixel above their border (pfilt -1 -b)."""
    height, width = rgb.shape[:2]
    fw, fh = foveal_size(FIELD)
    x, y = (-(-np.arange(n + 1) * pixels // n) for n, pixels in ((fw, width), (fh, height)))
    sums = np.add.reduceat(np.add.reduceat(rgb, x[:-1], axis=1), y[:-1], axis=0)
    return through_rgbe(sums / (np.diff(y)[:, None] * np.diff(x))[..., None])


def random_numbers() -> Iterator[float]:
    """POSIX drand48 as it starts without a seed in glibc: 48 bits, all 0."""
    state = 0
    while True:
        state = (0x5DEECE66D * state + 0xB) % 2**48
        yield state / 2.0**48


def random_pixels(y: np.ndarray, wanted: int, random: Iterator[float]) -> np.ndarray:
    """``wanted`` of the luminances (h, w), without repetition, each with the same chance.

    By random distances in reading order. A scanline is read from its right end, and what is
    left of a distance at its left end is drawn anew.
    """
    found: list[float] = []
    left = y.size
    for row in y:
        rest = row.size
        while rest > 0 and len(found) < wanted:
            draw, passed, skip = next(random), 1.0, 0
            for skip in itertools.count():
                passed *= 1.0 - (wanted - len(found)) / (left - skip)
                if 1.0 - passed >= draw:
                    break
            if skip >= rest:
                left -= rest
                break
            rest -= skip + 1
            left -= skip + 1
            found.append(row[rest])
    return np.array(found)


@dataclass
class Conditioned:
    """What pcond makes of a picture: the pixels before its curve, and the curve."""

    rgb: np.ndarray
    curve: Curve
    proportional: bool

    def display(self) -> np.ndarray:
        """Display-relative colours, without any gamut."""
        y = luminance(self.rgb)
        relative = (self.curve.display(y) - self.curve.black) / (HIGH - self.curve.black)
        if self.proportional:
            relative = y * float(self.curve.display(1e-3)) / 1e-3 / HIGH
        return self.rgb * (relative / y)[..., None]


def grey(rgb: np.ndarray) -> np.ndarray:
    return luminance(rgb)[..., None] * np.ones(3)


def conditioned(rgb: np.ndarray, switches: str) -> Conditioned:
    """What pcond makes with any of -s -v -c -a -l of a picture in cd/m2, by our definitions.

    The order is its own: it blurs the picture, adds the veil, takes the colour, and maps;
    the veil is that of the picture before. With a veil it draws its random pixels twice.
    """
    samples, random = one_degree(rgb), random_numbers()
    h = _histogram(rgb, samples, random)
    veil = np.zeros_like(samples)
    if "v" in switches and h.bmax - h.bmin >= moon_spencer.LEAST_RANGE:
        rays = directions(foveal_size(FIELD), FIELD).reshape(-1, 3)
        veil = moon_spencer.veil(samples.reshape(-1, 3), rays).reshape(samples.shape)
        samples = (1.0 - moon_spencer.SHARE) * samples + veil
        h = _histogram(rgb, samples, random)
    size = rgb.shape[1], rgb.shape[0]
    seen = rgb
    if "a" in switches:
        seen = _blurred(seen, luminance(samples))
    if veil.any():
        spread = [_between(veil[..., i], size) for i in range(3)]
        seen = (1.0 - moon_spencer.SHARE) * seen + np.stack(spread, axis=-1)
    if "c" in switches:
        y = luminance(seen)
        k = np.clip((y - ROD_LIMIT) / (CONE_LIMIT - ROD_LIMIT), 0.0, 1.0)[..., None]
        seen = k * seen + (1.0 - k) * (seen @ SCOTOPIC)[..., None]
    threshold = tvi_ward if "s" in switches else proportionate
    curve = None
    if "l" not in switches:
        curve = trimmed(h, LOW, HIGH, threshold)
    if curve is not None:
        return Conditioned(seen, curve, False)
    anchor = adapted_anchor(h, LOW, HIGH, threshold)
    return Conditioned(seen, proportional(anchor.display / anchor.scene, HIGH), True)


def _histogram(rgb: np.ndarray, samples: np.ndarray, random: Iterator[float]) -> Histogram:
    # The points are those of the picture as it was, with or without a veil.
    points = random_pixels(luminance(rgb), 16 * samples[..., 0].size, random)
    return histogram(Foveal(grey(samples), points, FIELD), pcond=True)


def _between(samples: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Samples (fh, fw) at pixels (h, w): bilinear, and on along the last slope at the edges."""
    for axis, pixels in ((1, size[0]), (0, size[1])):
        count = samples.shape[axis]
        place = (np.arange(pixels) + 0.5) * count / pixels - 0.5
        first = np.clip(np.floor(place).astype(int), 0, count - 2)
        part = place - first
        part = part if axis == 1 else part[:, None]
        samples = samples.take(first, axis) * (1.0 - part) + samples.take(first + 1, axis) * part
    return samples


def _blurred(rgb: np.ndarray, adapting: np.ndarray) -> np.ndarray:
    """Its acuity: a box of about 1.4 cycles' width, between boxes of 1, 2, 4 ... pixels.

    Ours is half a cycle wide: pcond takes half of a pixel's solid angle, and a whole cycle.
    """
    height, width = rgb.shape[:2]
    across, down = (math.tan(math.radians(angle) / 2.0) * 2.0 for angle in FIELD)
    cosine = -directions(adapting.shape[::-1], FIELD)[..., 2]
    solid = across * down / (width * height) * cosine**3
    side = math.radians(1.0) / np.sqrt(0.5 * solid) / resolvable(adapting)
    inner = np.pad(side[1:-1, 1:-1], 1, mode="edge")
    pixels = _between(inner, (width, height))
    at = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)
    level, coarse, result = 1, rgb, rgb.copy()
    while (chosen := pixels > level).any():
        fine, coarse = coarse, halve(coarse)
        place = at[chosen] / level
        near, far = mip_texel(fine, place), mip_texel(coarse, place / 2.0)
        share = np.minimum(pixels[chosen] / level - 1.0, 1.0)[:, None]
        result[chosen] = near + share * (far - near)
        level *= 2
    return result
