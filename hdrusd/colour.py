"""Luminance, the sRGB transfer functions, gamut and dither; twin of colour.glsl.

RGB is linear with Rec. 709 primaries and D65 white; arrays are (..., 3). Scene
values are absolute, (1, 1, 1) being 1 cd/m2; display values are relative, 1 being
the display's white.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.units import LUMINANCE_WEIGHTS

Array = npt.NDArray[Any]

#: cd/m2 that stand for infinity: past anything seen (the sun's disc is 1.6e9), and low
#: enough for products of two such numbers in float32.
BRIGHTEST = 1e12

#: Luminance below which a colour has no chromaticity (never divide by less).
DARKEST = 1e-9


def luminance(rgb: npt.ArrayLike) -> Array:
    """Luminance of linear RGB (..., 3), in its unit (ITU-R BT.709-6, item 3.2)."""
    rgb = np.asarray(rgb)
    r, g, b = LUMINANCE_WEIGHTS
    luminance: Array = r * rgb[..., 0] + g * rgb[..., 1] + b * rgb[..., 2]
    return luminance


def clean(rgb: npt.ArrayLike) -> Array:
    """Scene RGB in cd/m2 without NaN (becomes 0), negatives (0) and infinity (BRIGHTEST)."""
    rgb = np.asarray(rgb)
    rgb = rgb.astype(np.result_type(rgb, np.float32), copy=False)  # half cannot hold BRIGHTEST
    return np.where(rgb > 0.0, np.minimum(rgb, BRIGHTEST), 0.0)


def with_luminance(rgb: npt.ArrayLike, target: npt.ArrayLike) -> Array:
    """The chromaticity of ``rgb`` (..., 3) at luminance ``target`` (...); black stays black."""
    rgb = np.asarray(rgb)
    y = luminance(rgb)
    gain = np.where(y < DARKEST, 0.0, np.asarray(target) / np.maximum(y, DARKEST))
    return rgb * gain[..., None]


def to_gamut(rgb: npt.ArrayLike, y: npt.ArrayLike) -> Array:
    """Display-linear RGB >= 0 (..., 3) of luminance ``y`` (...) moved into [0, 1].

    Toward the grey of the same luminance, just far enough; white where that grey
    is 1 or more. Colours inside stay as they are.
    """
    rgb = np.asarray(rgb)
    grey = np.minimum(y, 1.0)[..., None]
    most = rgb.max(axis=-1, keepdims=True)
    outside = most > 1.0
    share = np.where(outside, (1.0 - grey) / np.where(outside, most - grey, 1.0), 1.0)
    return np.minimum(np.where(outside, grey + share * (rgb - grey), rgb), 1.0)


def srgb_encode(linear: npt.ArrayLike) -> Array:
    """Display-linear [0, 1] to sRGB code values [0, 1] (IEC 61966-2-1)."""
    linear = np.asarray(linear)
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(linear > 0.0031308, curve, 12.92 * linear)


def srgb_encode_fit(linear: npt.ArrayLike) -> Array:
    """``srgb_encode`` for 8 bits: within 0.08/255 of it, rising, and exact at 0 and 1.

    A cubic in the fourth root (minimax over the curved part, held at both its ends),
    because square roots are cheap and powers dear on llvmpipe: at 1920x1080 on two
    2.5 GHz cores the whole of shader 2 takes 13 ms with this and 19 ms with ``pow``.
    """
    linear = np.asarray(linear)
    q = np.sqrt(np.sqrt(np.maximum(linear, 0.0031308)))
    curve = ((0.9561901 - 0.1376821 * q) * q + 0.2524340) * q - 0.0709420
    return np.where(linear > 0.0031308, curve, 12.92 * linear)


def srgb_decode(code: npt.ArrayLike) -> Array:
    """Undo ``srgb_encode``: code values [0, 1] to display-linear [0, 1]."""
    code = np.asarray(code)
    curve = ((np.maximum(code, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(code > 0.04045, curve, code / 12.92)


def dither(x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
    """Offset in code steps, in (-0.5, 0.5), of the pixel x to the right and y down.

    The R2 sequence by pixel coordinates (Roberts 2018), in integers so that every
    device has the same: 2^32 over the plastic number and over its square. Neighbours
    differ much, any few of them cover the range evenly. 256 levels, whose ends stay
    1/512 clear of the half step: a value that 8 bits hold comes out as it went in.
    """
    n = np.asarray(x, np.uint64) * 3242174889 + np.asarray(y, np.uint64) * 2447445414
    return ((n & 0xFFFFFFFF) >> 24).astype(np.float32) / 256.0 + (0.5 / 256.0 - 0.5)


def quantise(code: npt.ArrayLike, offset: npt.ArrayLike) -> Array:
    """Code values [0, 1] to 0 ... 255, rounded after ``offset`` (code steps) was added."""
    steps = np.asarray(code) * 255.0 + (np.asarray(offset) + 0.5)
    return np.minimum(steps, 255.0).astype(np.uint32)
