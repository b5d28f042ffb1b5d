"""The veil of Ward et al. 1997, from Moon and Spencer's adaptation luminance.

G. Ward Larson, H. Rushmeier, C. Piatko, IEEE TVCG 3(4), 1997, section 4.2, after P. Moon and
D. E. Spencer, J. Opt. Soc. Am. 35, 1945: an eye is adapted to 0.92 of what the fovea sees and
0.08 of what the rest of the frame gives, by cos(theta) / theta^2. That sum is divided by the
sum of its weights, so only what lies in the frame counts, and a uniform frame stays as it is.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.glare.model import Array, GlareModel

#: Of what is seen, the share that the veil takes and gives.
SHARE = 0.08

#: Natural logarithm of the range of luminance below which pcond paints no veil.
LEAST_RANGE = 4.5


def weights(cosine: npt.ArrayLike) -> Array:
    """cos(theta) / theta^2 by cos(theta): 0.5 c / (1 - c), 0 for the sample itself and behind.

    Samples closer than 1e-6 rad are the same.
    """
    c = np.asarray(cosine, np.float64)
    other = (c > 0.0) & (c < 1.0 - 5e-13)
    return np.where(other, 0.5 * c / np.where(other, 1.0 - c, 1.0), 0.0)


def shares(cosine: Array, weight: Array) -> Array:
    """(n, m): of the luminance of sample j what it adds to the veil of sample i.

    ``cosine`` (n, m) of the angles between them; ``weight`` (m,): the part of sample j that
    lies in the frame, which its luminance has already been multiplied by.
    """
    w = weights(cosine)
    total = np.asarray(w @ np.asarray(weight, np.float64))
    return SHARE * w / np.where(total > 0.0, total, np.inf)[:, None]


def veil(luminance: npt.ArrayLike, directions: npt.ArrayLike) -> Array:
    """cd/m2 (n, ...) of the veil on samples of ``luminance`` (n, ...), by unit vectors (n, 3)."""
    d = np.asarray(directions, np.float64)
    return np.asarray(
        np.tensordot(shares(d @ d.T, np.ones(len(d))), np.asarray(luminance, np.float64), 1)
    )


def adapted(luminance: npt.ArrayLike, directions: npt.ArrayLike) -> Array:
    """cd/m2 (n, ...) that an eye looking at each sample is adapted to: 0.92 L + veil."""
    luminance = np.asarray(luminance, np.float64)
    return (1.0 - SHARE) * luminance + veil(luminance, directions)


def is_worthwhile(least: float, most: float) -> bool:
    """Whether pcond paints a veil on a frame of that range of luminance, cd/m2."""
    return 0.0 < least < most and math.log(most / least) >= LEAST_RANGE


MODEL = GlareModel(
    name="ward97",
    title="Veil of the adaptation luminance",
    cite="Ward Larson, Rushmeier, Piatko, IEEE TVCG 1997; Moon and Spencer 1945",
    shares=shares,
)
