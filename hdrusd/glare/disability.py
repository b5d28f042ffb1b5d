"""How much glare keeps from being seen: threshold increment of roads, visibility level.

Veiling luminance and threshold increment: EN 13201-3:2015. Visibility level: W. Adrian,
"Visibility of targets: model for calculation", Lighting Research and Technology 21(4), 1989.
Luminance in cd/m2, illuminance in lx, angles in degrees, ages in years.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.glare.model import Array


def veiling_luminance(lux: npt.ArrayLike, theta: npt.ArrayLike, age: float = 23.0) -> Array:
    """cd/m2 (...) of the veil of each source.

    ``lux``: at the eye, on a plane square to the line of sight; ``theta``: from the line of
    sight, 0.1 to 60 degrees, beyond which the standard counts nothing.
    """
    e, t = np.asarray(lux, np.float64), np.asarray(theta, np.float64)
    counts = (t > 0.1) & (t <= 60.0)
    t = np.where(counts, t, 60.0)
    near = 10.0 / t**3 + 5.0 / t**2 * (1.0 + (age / 62.5) ** 4)
    far = 9.86 / t**2 * (1.0 + (age / 66.4) ** 4)
    return np.where(counts, e * np.where(t <= 1.5, near, far), 0.0)


def threshold_increment(veil: npt.ArrayLike, road: npt.ArrayLike) -> Array:
    """Threshold increment in % of a veil on a road of mean luminance ``road``.

    65 Lv / L^0.8 up to 5 cd/m2, which the standard has from 0.05 on, and 95 Lv / L^1.05 above.
    """
    lv, mean = np.asarray(veil, np.float64), np.asarray(road, np.float64)
    return np.where(mean <= 5.0, 65.0 * lv / mean**0.8, 95.0 * lv / mean**1.05)


def threshold(
    background: npt.ArrayLike,
    size: npt.ArrayLike,
    time: float = 2.0,
    age: float = 23.0,
    *,
    negative: bool = False,
) -> Array:
    """Difference of luminance that is just seen, cd/m2 (Adrian 1989).

    ``background``: with the veil, above 0; ``size`` of the target in arcmin; ``time`` for
    which it is seen, s: 2 and more is enough. ``negative``: a target darker than what is
    behind it, which is seen better.
    """
    lb, alpha = np.asarray(background, np.float64), np.asarray(size, np.float64)
    flux, luminance = _ricco_weber(lb)
    delta = 2.6 * (flux / alpha + luminance) ** 2
    if negative:
        delta = delta * _polarity(lb, alpha, delta)
    if time < 2.0:
        delta = delta * _brief(lb, alpha, time)
    return np.asarray(delta * _age(age))


def visibility_level(
    target: npt.ArrayLike,
    background: npt.ArrayLike,
    size: npt.ArrayLike,
    time: float = 2.0,
    age: float = 23.0,
    veil: npt.ArrayLike = 0.0,
) -> Array:
    """How many thresholds a target (...) differs from its background; darker ones are negative.

    ``veil`` lies over both and leaves their difference as it is.
    """
    difference = np.asarray(target, np.float64) - np.asarray(background, np.float64)
    behind = np.asarray(background, np.float64) + np.asarray(veil, np.float64)
    lighter = threshold(behind, size, time, age)
    darker = threshold(behind, size, time, age, negative=True)
    return difference / np.where(difference < 0.0, darker, lighter)


def _ricco_weber(lb: Array) -> tuple[Array, Array]:
    """Roots of the luminous flux and of the luminance that limit small and large targets."""
    log_lb = np.log10(lb)
    ranges = [lb >= 0.6, lb > 0.00418]
    flux = np.select(
        ranges,
        [
            np.log10(4.1925 * lb**0.1556) + 0.1684 * lb**0.5867,
            10.0 ** (-0.072 + 0.3372 * log_lb + 0.0866 * log_lb**2),
        ],
        10.0 ** (0.028 + 0.173 * log_lb),
    )
    luminance = np.select(
        ranges,
        [0.05946 * lb**0.466, 10.0 ** (-1.256 + 0.319 * log_lb)],
        10.0 ** (-0.891 + 0.5275 * log_lb + 0.0227 * log_lb**2),
    )
    return flux, luminance


def _polarity(lb: Array, alpha: Array, delta: Array) -> Array:
    """Factor for dark targets, of backgrounds above 0.004 cd/m2."""
    log_lb = np.log10(lb)
    c = np.where(lb >= 0.1, 0.125, 0.075)
    m = 10.0 ** (-(10.0 ** -(c * (log_lb + 1.0) ** 2 + 0.0245)))
    factor = 1.0 - m * alpha ** (-0.6 * lb**-0.1488) / (2.4 * delta)
    return np.where(lb > 0.004, factor, 1.0)


def _brief(lb: Array, alpha: Array, time: float) -> Array:
    """Factor for targets that are seen for less than 2 s."""
    la, l6 = np.log10(alpha) + 0.523, np.log10(lb) + 6.0
    by_size = 0.36 - 0.0972 * la**2 / (la**2 - 2.513 * la + 2.7895)
    by_luminance = 0.355 - 0.1217 * l6**2 / (l6**2 - 10.4 * l6 + 52.28)
    return np.asarray((np.hypot(by_size, by_luminance) / 2.1 + time) / time)


def _age(age: float) -> float:
    """Factor for observers older than the young ones of the experiments, whose it is 1."""
    if age <= 23.0:
        return 1.0
    if age <= 64.0:
        return (age - 19.0) ** 2 / 2160.0 + 0.99
    return (age - 56.6) ** 2 / 116.3 + 1.43
