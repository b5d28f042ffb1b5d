"""How disagreeable glare is: position index, UGR and DGP.

Position index above the line of sight: S. K. Guth's, as UGR (CIE 117-1995) has it; below it
that of T. Iwata and M. Tokura (1997) in the form of evalglare. UGR: CIE 117-1995. DGP:
J. Wienold, J. Christoffersen, Energy and Buildings 38(7), 2006. Luminance in cd/m2, solid
angles in sr, angles in degrees.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.glare.model import Array, angle

#: Largest index of Guth's equation that counts.
_MOST = 16.0


def guth_index(tau: npt.ArrayLike, sigma: npt.ArrayLike) -> Array:
    """Position index of a source above the line of sight.

    ``tau``: from the vertical to the plane of source and line of sight; ``sigma``: between
    source and line of sight.
    """
    tau, sigma = np.asarray(tau, np.float64), np.asarray(sigma, np.float64)
    first = (35.2 - 0.31889 * tau - 1.22 * np.exp(-2.0 * tau / 9.0)) * 1e-3 * sigma
    second = (21.0 + 0.26667 * tau - 0.002963 * tau**2) * 1e-5 * sigma**2
    return np.asarray(np.minimum(np.exp(np.minimum(first + second, 50.0)), _MOST))


def iwata_index(horizontal: npt.ArrayLike, vertical: npt.ArrayLike) -> Array:
    """Position index of a source below the line of sight, by its two angles from it, below 90."""
    across, down = (np.tan(np.radians(np.asarray(a, np.float64))) for a in (horizontal, vertical))
    r = np.minimum(np.hypot(across, down), 3.0)
    return np.asarray(1.0 + np.where(r <= 0.6, 0.8, 1.2) * r)


def position_index(direction: npt.ArrayLike) -> Array:
    """Position index (...) of unit vectors (..., 3) in view space: +y up, sight along -z."""
    d = np.asarray(direction, np.float64)
    tau = np.degrees(np.arctan2(np.abs(d[..., 0]), d[..., 1]))
    sigma = angle(d, (0.0, 0.0, -1.0))
    ahead = np.maximum(-d[..., 2], 1e-6)
    across, down = (np.degrees(np.arctan2(np.abs(d[..., k]), ahead)) for k in (0, 1))
    return np.where(d[..., 1] >= 0.0, guth_index(tau, sigma), iwata_index(across, down))


def _squares(luminance: npt.ArrayLike, solid_angle: npt.ArrayLike, index: npt.ArrayLike) -> Array:
    """L^2 omega / P^2 of sources, cd^2/m4 sr."""
    ratio = np.asarray(luminance, np.float64) / np.asarray(index, np.float64)
    return np.asarray(ratio**2 * np.asarray(solid_angle, np.float64))


def ugr(
    luminance: npt.ArrayLike,
    solid_angle: npt.ArrayLike,
    index: npt.ArrayLike,
    background: float,
) -> float:
    """Unified glare rating of sources (n,) before a ``background`` in cd/m2.

    The background is the vertical illuminance at the eye without the sources, over pi.
    Without sources it is -inf.
    """
    total = float(np.sum(_squares(luminance, solid_angle, index)))
    return 8.0 * math.log10(0.25 / background * total) if total > 0.0 else -math.inf


def dgp(
    luminance: npt.ArrayLike,
    solid_angle: npt.ArrayLike,
    index: npt.ArrayLike,
    vertical_lux: float,
) -> float:
    """Daylight glare probability of sources (n,) in ``vertical_lux`` at the eye.

    Wienold and Christoffersen measured it from 0.2 to 0.8 and above 380 lx.
    """
    total = float(np.sum(_squares(luminance, solid_angle, index))) / vertical_lux**1.87
    return 5.87e-5 * vertical_lux + 9.18e-2 * math.log10(1.0 + total) + 0.16
