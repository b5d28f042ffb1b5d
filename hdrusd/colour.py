"""Luminance, gamut, what screens decode (sRGB, gamma, BT.1886, PQ), dither; twin of colour.glsl.

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

#: Linear Rec. 709 to linear Rec. 2020, both of D65 white (ITU-R BT.2087); a row a channel.
REC709_TO_REC2020 = np.array(
    [
        [0.627403914, 0.329283039, 0.043313048],
        [0.069097292, 0.919540395, 0.011362316],
        [0.016391439, 0.088013308, 0.895595253],
    ]
)
REC2020_TO_REC709 = np.linalg.inv(REC709_TO_REC2020)

#: cd/m2 at the top of SMPTE ST 2084, and its constants.
PQ_PEAK = 10000.0
_M1, _M2 = 2610.0 / 16384.0, 2523.0 / 32.0
_C1, _C2, _C3 = 3424.0 / 4096.0, 2413.0 / 128.0, 2392.0 / 128.0

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


def gamma_encode(linear: npt.ArrayLike, gamma: float) -> Array:
    """Display-linear [0, 1] to code values [0, 1] of a screen that is a plain power."""
    return np.asarray(np.asarray(linear) ** (1.0 / gamma))


def gamma_decode(code: npt.ArrayLike, gamma: float) -> Array:
    """Undo ``gamma_encode``."""
    return np.asarray(np.asarray(code) ** gamma)


def bt1886_encode(linear: npt.ArrayLike, black: float, white: float) -> Array:
    """Display-linear [0, 1] to code values [0, 1] of an ITU-R BT.1886 screen.

    ``black`` and ``white`` in cd/m2 are the screen's own, without reflections: code values
    are even in the power 1/2.4 of the luminance between them.
    """
    low, high = black ** (1.0 / 2.4), white ** (1.0 / 2.4)
    light = black + np.asarray(linear) * (white - black)
    return np.asarray((light ** (1.0 / 2.4) - low) / (high - low))


def bt1886_decode(code: npt.ArrayLike, black: float, white: float) -> Array:
    """Undo ``bt1886_encode``: L = a max(V + b, 0)^2.4 of the recommendation, display-linear."""
    low, high = black ** (1.0 / 2.4), white ** (1.0 / 2.4)
    light = (low + np.asarray(code) * (high - low)) ** 2.4
    return np.asarray((light - black) / (white - black))


def pq_encode(light: npt.ArrayLike) -> Array:
    """cd/m2, up to 10,000, to code values [0, 1] (SMPTE ST 2084)."""
    y = (np.clip(light, 0.0, PQ_PEAK) / PQ_PEAK) ** _M1
    return np.asarray(((_C1 + _C2 * y) / (1.0 + _C3 * y)) ** _M2)


def pq_decode(code: npt.ArrayLike) -> Array:
    """Undo ``pq_encode``: code values [0, 1] to cd/m2."""
    e = np.asarray(code) ** (1.0 / _M2)
    return np.asarray(PQ_PEAK * (np.maximum(e - _C1, 0.0) / (_C2 - _C3 * e)) ** (1.0 / _M1))


def to_rec2020(rgb: npt.ArrayLike) -> Array:
    """Linear Rec. 709 (..., 3) in linear Rec. 2020."""
    return np.asarray(np.asarray(rgb) @ REC709_TO_REC2020.T)


def from_rec2020(rgb: npt.ArrayLike) -> Array:
    """Linear Rec. 2020 (..., 3) in linear Rec. 709; negative outside of its gamut."""
    return np.asarray(np.asarray(rgb) @ REC2020_TO_REC709.T)


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
