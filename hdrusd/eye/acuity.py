"""How fine the eye resolves, and the blur that shows it. Twin of acuity.glsl.

G. Ward Larson, H. Rushmeier, C. Piatko, IEEE TVCG 3(4), 1997, section 4.4: a fit to the
gratings of S. Shlaer, J. General Physiology 21, 1937. What is finer than half a cycle of
the finest grating is blurred away: each pixel is read from the level of a mip chain whose
texels are that wide. The level is found for the samples of the foveal image and is bilinear
between them, as their logarithms adapt the eye.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import clean
from hdrusd.eye.foveal import Foveal, directions

Array = npt.NDArray[Any]

#: cd/m2; below it acuity stays (1.2 cycles per degree).
DARKEST_ADAPTATION = 1e-5

#: Per cent of the samples that may be darker than what is looked at for sharpness.
DARK_SHARE = 5


def resolvable(adapting: npt.ArrayLike) -> Array:
    """Finest grating that is seen (...), cycles per degree, at a foveal luminance in cd/m2."""
    x = np.log10(np.maximum(np.asarray(adapting, np.float64), DARKEST_ADAPTATION))
    return np.asarray(17.25 * np.arctan(1.4 * x + 0.35) + 25.72)


def pixel_angles(foveal: Foveal, size: tuple[int, int]) -> Array:
    """Side of a pixel at each sample (fh, fw), degrees: the square root of its solid angle.

    ``size``: width and height of the frame, pixels.
    """
    fh, fw = foveal.rgb.shape[:2]
    width = 2.0 * math.tan(math.radians(min(foveal.field[0], 179.0)) / 2.0) / size[0]
    cosine = -directions((fw, fh), foveal.field)[..., 2]
    return np.asarray(np.degrees(width) * cosine**1.5)


def acuity_levels(foveal: Foveal, size: tuple[int, int]) -> Array | None:
    """Level of the mip chain at each sample (fh, fw), below 0 where pixels are not seen apart.

    ``foveal``: of the frame as the eye has it, with its veil; ``size``: width and height of
    the frame, pixels. None where a whole frame is left sharp: where the luminance that 5 %
    of the samples do not exceed resolves all its pixels.

    A sample is as sharp as the sharpest beside it: blurs reach half a degree, and what is dark
    and lies next to a lamp would gather the lamp's light in blots that the lamp has no part in.
    """
    y = foveal.luminance
    angles = pixel_angles(foveal, size)
    dark = np.percentile(y, DARK_SHARE)
    if 2.0 * angles.max() * resolvable(dark) >= 1.0:
        return None
    level = np.minimum(-np.log2(2.0 * angles * resolvable(y)), top_level(size))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(level, 1, mode="edge"), (3, 3))
    return np.asarray(around.min(axis=(2, 3)))


def top_level(size: tuple[int, int]) -> int:
    """The level that is a single texel."""
    return (max(size) - 1).bit_length()


def halve(level: npt.ArrayLike) -> Array:
    """The next level of a mip chain (ceil(h / 2), ceil(w / 2), c): means of 2 x 2 texels.

    Of an odd side the last texel counts twice.
    """
    level = np.asarray(level)
    height, width = level.shape[:2]
    padded = np.pad(level, [(0, height % 2), (0, width % 2), (0, 0)], mode="edge")
    return np.asarray(
        (padded[0::2, 0::2] + padded[0::2, 1::2] + padded[1::2, 0::2] + padded[1::2, 1::2]) / 4.0
    )


def mip_chain(image: npt.ArrayLike, count: int) -> list[Array]:
    """``count`` + 1 levels of an image (h, w, c), itself first."""
    levels = [np.asarray(image)]
    for _ in range(count):
        levels.append(halve(levels[-1]))
    return levels


def between_samples(samples: Array, size: tuple[int, int]) -> Array:
    """Samples (fh, fw) at the centres of pixels (h, w): bilinear, held beyond the outermost."""
    fh, fw = samples.shape
    x = np.clip((np.arange(size[0]) + 0.5) * fw / size[0] - 0.5, 0.0, fw - 1.0)
    y = np.clip((np.arange(size[1]) + 0.5) * fh / size[1] - 0.5, 0.0, fh - 1.0)
    return mip_texel(samples[..., None], np.stack(np.meshgrid(x, y), axis=-1) + 0.5)[..., 0]


def mip_texel(image: Array, place: Array) -> Array:
    """An image (h, w, c) at places (..., 2), x and y in texels: bilinear, its edge continued.

    Texel i has its centre at i + 0.5.
    """
    height, width = image.shape[:2]
    base = np.floor(place - 0.5)
    part = (place - 0.5 - base)[..., None, :]
    x0, y0 = np.moveaxis(base.astype(np.int64), -1, 0)
    columns = [np.clip(x0 + i, 0, width - 1) for i in (0, 1)]
    rows = [np.clip(y0 + i, 0, height - 1) for i in (0, 1)]
    above, below = (
        image[row, columns[0]] + part[..., 0] * (image[row, columns[1]] - image[row, columns[0]])
        for row in rows
    )
    return np.asarray(above + part[..., 1] * (below - above))


def acuity_blur(image: npt.ArrayLike, foveal: Foveal) -> Array:
    """A frame (h, w, c) as finely as the eye resolves it; the definition of gpu/vision.py.

    ``foveal``: its foveal image, both with the eye's veil. Trilinear: bilinear in two levels
    of the mip chain, linear between them. NaN and negative values count as 0, infinity as
    colour.BRIGHTEST.
    """
    image = clean(image)
    height, width = image.shape[:2]
    samples = acuity_levels(foveal, (width, height))
    if samples is None:
        return image
    level = np.maximum(between_samples(samples, (width, height)), 0.0)
    chain = mip_chain(image, min(math.floor(level.max()) + 1, top_level((width, height))))
    at = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)
    lower = np.minimum(np.floor(level), max(len(chain) - 2, 0))
    result = np.array(image)
    for number, (fine, coarse) in enumerate(pairwise(chain)):
        chosen = lower == number
        place = at[chosen] / 2.0**number
        near, far = mip_texel(fine, place), mip_texel(coarse, place / 2.0)
        result[chosen] = near + (level[chosen] - number)[:, None] * (far - near)
    return result
