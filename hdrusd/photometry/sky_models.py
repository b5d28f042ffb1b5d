"""Skies from the literature: how bright in which direction, and what they give a level ground.

Altitudes are degrees above the horizon. Directions come as the sine of their altitude and
the cosine of their angle to sun or moon, arrays of one shape; what is below the horizon is
black, for there the ground is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]

#: IES RP-21, "Recommended Practice for the Calculation of Daylight Availability", J. Illum.
#: Eng. Soc. 13(4), 1984: lux outside the atmosphere, and the extinction of a clear one.
_SOLAR_LUX, _EXTINCTION = 127_500.0, 0.21

#: Krisciunas and Schaefer 1991, Publ. Astron. Soc. Pacific 103, 1033: magnitudes lost in the
#: air at the zenith, and the full moon outside the atmosphere, lx (their eq. 20, footcandles).
_MOON_EXTINCTION = 0.172
_MOON_LUX = 10.0 ** (-0.4 * 3.84) * 10.763910

#: cd/m2 of a nanolambert.
_NANOLAMBERT = 1e-5 / math.pi

#: Janiczek and DeYoung 1987, US Naval Observatory Circular 171: log10 of lux on a level ground
#: as a polynomial of altitude / 90 degrees, from this altitude up.
_SUN = (
    (20.0, (3.74, 3.97, -4.07, 1.47)),
    (5.0, (3.05, 13.28, -45.98, 64.33)),
    (-0.8, (2.88, 22.26, -207.64, 1034.30)),
    (-5.0, (2.88, 21.81, -258.11, -858.36)),
    (-12.0, (2.70, 12.17, -431.69, -1899.83)),
    (-18.0, (13.84, 262.72, 1447.42, 2797.93)),
)


def sunlit_ground(altitude: float) -> float:
    """Lux of sun and sky on a level ground, clear, from 18 degrees below the horizon up."""
    row = next((row for least, row in _SUN if altitude >= least), _SUN[-1][1])
    x = altitude / 90.0
    return float(10.0 ** sum(c * x**i for i, c in enumerate(row)))


def sun_lux(altitude: float) -> float:
    """Lux of the sun on a plane that faces it, through a clear atmosphere (IES RP-21)."""
    return _SOLAR_LUX * math.exp(-_EXTINCTION / math.sin(math.radians(altitude)))


def clear_sky_lux(altitude: float) -> float:
    """Lux of a clear sky without the sun on a level ground (IES RP-21)."""
    return 1000.0 * (0.8 + 15.5 * math.sqrt(math.sin(math.radians(altitude))))


def overcast_lux(altitude: float) -> float:
    """Lux of an overcast sky on a level ground (IES RP-21)."""
    return 1000.0 * (0.3 + 21.0 * math.sin(math.radians(altitude)))


def overcast_sky(sine: Array) -> Doubles:
    """The overcast sky of Moon and Spencer (ISO 15469 type 16) over its zenith: (1 + 2 sin) / 3."""
    return np.where(sine > 0.0, (1.0 + 2.0 * np.asarray(sine)) / 3.0, 0.0)


def clear_sky(sine: Array, to_sun: Array, altitude: float) -> Doubles:
    """The CIE clear sky of low turbidity over its zenith (ISO 15469:2004, type 12).

    Gradation 1 + a exp(b / sin), a = -1, b = -0.32; indicatrix 1 + 10 (exp(-3 x) -
    exp(-3 pi / 2)) + 0.45 cos^2 x of the angle x to the sun.
    """

    def gradation(sin: Array) -> Doubles:
        return 1.0 - np.exp(-0.32 / np.maximum(sin, 1e-6))

    def indicatrix(angle: Array, cosine: Array) -> Doubles:
        ends = math.exp(-1.5 * math.pi)
        return np.asarray(1.0 + 10.0 * (np.exp(-3.0 * angle) - ends) + 0.45 * np.square(cosine))

    cosine = np.clip(to_sun, -1.0, 1.0)
    zenith = math.radians(90.0 - altitude)
    scale = gradation(np.ones(1)) * indicatrix(np.full(1, zenith), np.cos([zenith]))
    luminance = gradation(sine) * indicatrix(np.arccos(cosine), cosine) / scale
    return np.where(np.asarray(sine) > 0.0, luminance, 0.0)


def moon_lux(altitude: float) -> float:
    """Lux of the full moon on a plane that faces it (Krisciunas and Schaefer 1991, eq. 20, 3)."""
    return float(_MOON_LUX * _passed(np.sin(np.float64(math.radians(altitude)))))


def moonlit_sky(sine: Array, to_moon: Array, altitude: float) -> Doubles:
    """cd/m2 that the full moon gives the sky (Krisciunas and Schaefer 1991, eq. 15 and 21).

    The haze of the last degrees about the moon, where they have no formula, goes on as it
    does farther out.
    """
    cosine = np.clip(to_moon, -1.0, 1.0)
    angle = np.degrees(np.arccos(cosine))
    scatter = 10.0**5.36 * (1.06 + np.square(cosine)) + 10.0 ** (6.15 - angle / 40.0)
    moon = _MOON_LUX / 10.763910
    light = scatter * moon * _passed(np.sin(np.float64(math.radians(altitude))))
    return np.where(np.asarray(sine) > 0.0, light * (1.0 - _passed(sine)) * _NANOLAMBERT, 0.0)


def _passed(sine: Array) -> Any:
    """Share of light that comes through the air from an altitude."""
    air = (1.0 - 0.96 * (1.0 - np.square(sine))) ** -0.5
    return 10.0 ** (-0.4 * _MOON_EXTINCTION * air)
