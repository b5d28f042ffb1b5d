"""What the rods see, and what colour is left at night. Twin of scotopic.glsl.

The true scotopic luminance needs spectra. From RGB it is estimated; of the 24 ColorChecker
patches 5 % lie below and 5 % above these ratios of the linear form to the truth: daylight D65
0.80 to 1.04, incandescent A 0.75 to 1.08, white LEDs 0.88 to 1.21, fluorescent lamps 0.95 to
1.26, high-pressure sodium HP1 1.18 to 1.98. Lamps state their own ratio for that reason
(photometry/scotopic_light.py). RGB is linear Rec. 709 in cd/m2, (..., 3).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance

Array = npt.NDArray[Any]

#: Scotopic cd/m2 of 1 in each channel; fitted to CIE 1951 V' over spectra of lamps and paints.
SCOTOPIC_WEIGHTS = (0.0602851, 1.0859576, 1.0491639)

#: Scotopic over photopic luminance (S/P) of RGB white by these weights.
WHITE_RATIO = sum(SCOTOPIC_WEIGHTS)

#: Linear Rec. 709 to CIE 1931 XYZ (IEC 61966-2-1): one row a coordinate.
RGB_TO_XYZ = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)

#: cd/m2 between which cones take over from rods (Ward Larson et al. 1997, section 4.3).
ROD_LIMIT, CONE_LIMIT = 5.62e-3, 5.62

#: Share of the blue shift in ``night_colour``: full, it is a look more than what is seen.
TINT = 0.3

#: RGB of luminance 1 and chromaticity (0.25, 0.25), the blue of the night; its X + Y + Z.
NIGHT_BLUE = np.linalg.inv(RGB_TO_XYZ) @ [1.0, 1.0, 2.0]
NIGHT_SUM = 4.0


def scotopic(rgb: npt.ArrayLike) -> Array:
    """Scotopic luminance (...) in scotopic cd/m2; never negative, and linear."""
    rgb = np.asarray(rgb)
    r, g, b = SCOTOPIC_WEIGHTS
    return np.asarray(r * rgb[..., 0] + g * rgb[..., 1] + b * rgb[..., 2])


def scotopic_larson(rgb: npt.ArrayLike) -> Array:
    """Scotopic luminance (...) by Y (1.33 (1 + (Y + Z) / X) - 1.68); black is 0.

    G. Ward Larson, H. Rushmeier, C. Piatko, IEEE TVCG 3(4), 1997, section 4.3.
    """
    x, y, z = np.moveaxis(np.asarray(rgb) @ RGB_TO_XYZ.T, -1, 0)
    ratio = (y + z) / np.where(x > 0.0, x, np.inf)
    return np.asarray(y * (1.33 * (1.0 + ratio) - 1.68))


def white_relative(scotopic_luminance: npt.ArrayLike) -> Array:
    """Scotopic luminance in units in which it equals the photopic one of RGB white."""
    return np.asarray(scotopic_luminance) / WHITE_RATIO


def ward_scotopic(rgb: npt.ArrayLike, s_n: npt.ArrayLike) -> Array:
    """Colour (..., 3) fading to the grey that rods see.

    By a ramp of luminance from ROD_LIMIT to CONE_LIMIT (Ward Larson et al. 1997, section 4.3,
    and Radiance's pcond). ``s_n`` (...): ``white_relative`` scotopic luminance.
    """
    rgb, s_n = np.asarray(rgb), np.asarray(s_n)
    k = np.clip((luminance(rgb) - ROD_LIMIT) / (CONE_LIMIT - ROD_LIMIT), 0.0, 1.0)[..., None]
    return np.asarray(k * rgb + (1.0 - k) * s_n[..., None])


def jensen_night(rgb: npt.ArrayLike, s_n: npt.ArrayLike) -> Array:
    """Colour (..., 3) turning into the blue of the night.

    H. W. Jensen et al., Night Rendering, UUCS-00-016, 2000; W. Thompson, P. Shirley,
    J. Ferwerda, J. Graphics Tools 7(1), 2002. Between 0.01 and 4 cd/m2 the chromaticity goes
    to xy = (0.25, 0.25) and the luminance to the scotopic one.
    """
    rgb, s_n = np.asarray(rgb), np.asarray(s_n)
    y = luminance(rgb)
    t = np.clip((np.log10(np.maximum(y, 1e-9)) + 2.0) / 2.6, 0.0, 1.0)
    s = t * t * (3.0 - 2.0 * t)
    # Mixing xy is mixing RGB / (X + Y + Z); all times that sum, so that black divides by nothing.
    total = np.maximum(rgb @ RGB_TO_XYZ.sum(axis=0), 1e-9)
    blue = (1.0 - s) * total / NIGHT_SUM
    gain = ((1.0 - s) * s_n + s * y) / (s * y + blue)
    return np.asarray((s[..., None] * rgb + blue[..., None] * NIGHT_BLUE) * gain[..., None])


def night_colour(
    rgb: npt.ArrayLike, s_n: npt.ArrayLike, night_ramp: float = 1.0, night_tint: float = TINT
) -> Array:
    """What colour is left (..., 3), cd/m2: the ramp of rods and cones, then some of the blue.

    ``rgb`` is as the eye has it, with its veil; ``s_n`` as in ``ward_scotopic``. Shares in
    [0, 1]: ``night_ramp`` of ``ward_scotopic``, ``night_tint`` of ``jensen_night``; with one of
    them 0 and the other 1 it is that one alone.
    """
    rgb = np.asarray(rgb)
    grey = rgb + night_ramp * (ward_scotopic(rgb, s_n) - rgb)
    return np.asarray(grey + night_tint * (jensen_night(rgb, s_n) - grey))
