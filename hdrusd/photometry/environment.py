"""What a GGX surface mirrors of its surroundings, by the split sum of Karis 2013.

Karis, "Real Shading in Unreal Engine 4": the light that a lobe gathers is taken as the
product of the surroundings blurred by the lobe, looked up in the lobe's main direction
(Lagarde and de Rousiers 2014), and of what the lobe reflects of surroundings that are
white. The second factor is that of photometry/microfacet.py, so an even sky is mirrored
exactly. The blur is that of an eye square above the surface: the rougher the surface
and the flatter the view, the more a sky of strong contrast is off
(tests/facts/test_environment.py has numbers). Twin of ``environment.glsl``.

Level 0 of the blurred surroundings is sharp; level k is made for alpha = 2.5^(k - 5).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.microfacet import ggx_gain, ggx_lobe, schlick_weight
from hdrusd.photometry.sky import reduced, texel_directions, texel_solid_angles

Array = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]

#: Columns of each level, twice its rows: each is the mip map of the one before.
WIDTHS = (1024, 512, 256, 128, 64, 32)

#: The last level, and alpha of one level over that of the level before.
LAST, STEP = 5, 2.5

#: Columns of the picture that is blurred: the lobe of level 1 is three of them wide.
_SOURCE = 256

#: Entries of ``reflected_table`` along each side.
TABLE = 32


def blur_level(alpha: Array) -> Doubles:
    """Level of the blurred surroundings, 0 to ``LAST``, that a lobe of ``alpha`` looks up."""
    level = LAST + np.log2(np.maximum(alpha, 1e-4)) / math.log2(STEP)
    return np.asarray(np.clip(level, 0.0, LAST), np.float64)


def blurred_levels(texels: Array) -> list[Doubles]:
    """The sky (h, w, 3) for lobes of every width: a picture a level, (W / 2, W, 3)."""
    return [
        _resized(reduced(texels, WIDTHS[0]), WIDTHS[0]),
        *(
            blurred(texels, STEP ** (level - LAST), width)
            for level, width in enumerate(WIDTHS[1:], start=1)
        ),
    ]


def blurred(texels: Array, alpha: float, width: int) -> Doubles:
    """(width / 2, width, 3): the sky as a lobe of ``alpha`` sees it along its normal.

    The mean of the sky weighted by D(H) N.L, with N = V (Karis 2013). A lobe that is
    moved along a parallel sees the same sky turned, so the mean over a parallel is a
    product of Fourier series, and no direction is sampled by chance.
    """
    source = reduced(texels, _SOURCE)
    h, w = source.shape[:2]
    towards = texel_directions(h, w).reshape(-1, 3)
    angles = np.broadcast_to(texel_solid_angles(h, w), (h, w))
    sky = np.fft.rfft(source * angles[..., None], axis=1)
    # The middle of the first texel: what it sees is found without moving the lobe.
    start = texel_directions(1, w)[0, 0]
    result = np.empty((width // 2, width, 3))
    for row, latitude in enumerate(math.pi * (0.5 - (np.arange(width // 2) + 0.5) / (width // 2))):
        lobe_axis = np.array([start[0] * math.cos(latitude), 0.0, start[2] * math.cos(latitude)])
        lobe_axis[1] = math.sin(latitude)
        cosine = np.maximum(towards @ lobe_axis, 0.0).reshape(h, w)  # N.L
        sine2 = 0.5 - 0.5 * cosine  # of the angle between N and H
        lobe = cosine / (alpha**2 + (1.0 - alpha**2) * sine2) ** 2
        lobe /= np.sum(lobe * angles)
        passed = sky * np.conj(np.fft.rfft(lobe, axis=1))[..., None]
        # Texels of the result begin elsewhere in their own width than those of the source.
        wave = np.arange(passed.shape[1])
        shift = np.exp(2j * math.pi * wave * (0.5 / width - 0.5 / w))
        series = np.sum(passed, axis=0) * shift[:, None]
        result[row] = np.fft.irfft(series, width, axis=0) * (width / w)
    return np.maximum(result, 0.0)


def _resized(texels: Doubles, width: int) -> Doubles:
    """(width / 2, width, 3) by interpolation between texels, for small pictures."""
    h, w = texels.shape[:2]
    rows = np.clip((np.arange(width // 2) + 0.5) * h / (width // 2) - 0.5, 0.0, h - 1.0)
    first = np.minimum(rows.astype(np.int64), max(h - 2, 0))
    share = (rows - first)[:, None, None]
    texels = texels[first] * (1.0 - share) + texels[np.minimum(first + 1, h - 1)] * share
    columns = (np.arange(width) + 0.5) * w / width - 0.5
    left = np.floor(columns).astype(np.int64)
    share = (columns - left)[None, :, None]
    return np.asarray(texels[:, left % w] * (1.0 - share) + texels[:, (left + 1) % w] * share)


def reflected_table(size: int = TABLE) -> Doubles:
    """(size, size, 2): what a lobe reflects of white surroundings, as factors on F0 and F90.

    Rows: the root of alpha, columns: that of N.V, both from 0 to 1 with their ends.
    The integral of the lobe times N.L over the hemisphere, by 128 x 32 half vectors spread
    like D(H) N.H (Walter et al. 2007, eqs. 35 and 36), but closer at the lobe's far end,
    which counts when it is looked at from the side. Good to 2e-4.
    """
    steps = np.linspace(0.0, 1.0, size)
    alpha = np.maximum(steps, 1e-2)[:, None, None, None] ** 2
    nv = np.maximum(steps, 1e-2)[:, None, None] ** 2
    rest = ((np.arange(128) + 0.5) / 128)[:, None]
    share = 1.0 - rest**3
    turn = math.pi * (np.arange(32) + 0.5) / 32  # the other half circle is the mirror image
    result = np.empty((size, size, 2))
    for row, a in enumerate(alpha):
        nh = np.sqrt((1.0 - share) / (1.0 - (1.0 - a**2) * share))
        sine = np.sqrt(np.maximum(1.0 - nh * nh, 0.0))
        h = np.stack([sine * np.cos(turn), sine * np.sin(turn), nh + 0.0 * turn], axis=-1)
        view = np.concatenate([np.sqrt(1.0 - nv * nv), 0.0 * nv, nv], axis=-1)[:, None]
        vh = np.sum(h * view, axis=-1)
        light = 2.0 * vh[..., None] * h - view
        nl = light[..., 2]
        sine2 = sine * sine + 0.0 * turn
        d = (a / (a * a + (1.0 - a * a) * sine2)) ** 2 / math.pi
        gain = ggx_gain(nv, a * a, 1.0 / math.pi)
        lobe = ggx_lobe(gain, a * a, nl, sine2)
        inside = (nl > 0.0) & (vh > 0.0)
        # dL = 4 V.H dH; H is spread by D N.H, and that by the cube.
        weight = np.where(inside, lobe * nl * 4.0 * vh / (d * nh) * 3.0 * rest**2, 0.0)
        bent = schlick_weight(np.clip(vh, 0.0, 1.0))
        result[row, :, 0] = np.mean(weight * (1.0 - bent), axis=(1, 2))
        result[row, :, 1] = np.mean(weight * bent, axis=(1, 2))
    return result


def table_place(nv: Array, alpha: Array) -> Doubles:
    """Texture coordinates (..., 2) of ``reflected_table``."""
    place = np.stack(np.broadcast_arrays(nv, alpha), axis=-1)
    return np.asarray((np.sqrt(np.clip(place, 0.0, 1.0)) * (TABLE - 1) + 0.5) / TABLE)


def main_direction(normal: Array, mirrored: Array, alpha: Array) -> Doubles:
    """Where a lobe mostly looks, (..., 3), not of unit length: between N and where a mirror does.

    Lagarde and de Rousiers 2014, "Moving Frostbite to Physically Based Rendering", listing
    22; ``normal``, ``mirrored`` (..., 3) unit, ``alpha`` (...).
    """
    smooth = 1.0 - np.asarray(alpha)
    share = (smooth * (np.sqrt(smooth) + alpha))[..., None]
    return np.asarray(normal + (mirrored - normal) * share)


def reflected(f0: Array, f90: Array, entry: Array) -> Doubles:
    """Share (..., 3) of a white sky that a lobe sends on; ``entry`` (..., 2) of the table."""
    return np.asarray(f0 * entry[..., :1] + f90 * entry[..., 1:])


def mean_schlick(nv: Array) -> Doubles:
    """Mean of (1 - V.H)^5 over light from everywhere alike, weighted by N.L.

    F0 + (F90 - F0) times this is what the diffuse part below loses of such light; it does
    not depend on alpha. A polynomial, good to 1e-5 (tests/facts/test_environment.py).
    """
    x = np.asarray(nv, np.float64)
    return (((8.96e-3 * x - 4.363e-2) * x + 8.644e-2) * x - 7.985e-2) * x + 2.816e-2
