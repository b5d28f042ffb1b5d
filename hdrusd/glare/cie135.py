"""The CIE's functions for the light that an eye scatters, by age and colour of the iris.

J. J. Vos and T. J. T. P. van den Berg, "Disability glare", CIE 135/1-6, 1999: the total glare
function, with the optical core, for all angles. "CIE equations for disability glare", CIE 146,
2002: its simpler forms. All give sr^-1, which is cd/m2 per lux at the eye; ``theta`` in
degrees (...), ``age`` in years, ``pigment`` 0 very dark, 0.5 brown, 1 green to blue-green,
1.2 light blue.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.eye.observer import Observer
from hdrusd.glare.model import Array, GlareModel


def total_glare(
    theta: npt.ArrayLike, age: float = 35.0, pigment: float = 0.5, *, normalised: bool = True
) -> Array:
    """The total glare function of CIE 135/1-6, 0 to 100 degrees.

    ``normalised``: divided by what Vos and van den Berg give for its integral over the
    hemisphere, 1 + p (0.0417 + 0.055 q); it then comes to 1.010 at 35 years, to 1.017 at 70.
    """
    t = np.asarray(theta, np.float64)
    q = (age / 70.0) ** 4
    wide = 1.0 + (t / 0.1) ** 2
    core = 9.2e6 / (1.0 + (t / 0.0046) ** 2) ** 1.5 + 1.5e5 / (1.0 + (t / 0.045) ** 2) ** 1.5
    iris = 1300.0 / wide**1.5 + 0.8 / np.sqrt(wide)
    lens = 400.0 / wide + 3e-8 * t**2 + pigment * iris
    total = (1.0 - 0.08 * q) * core + (1.0 + 1.6 * q) * lens + 2.5e-3 * pigment
    return np.asarray(total / (1.0 + pigment * (0.0417 + 0.055 * q)) if normalised else total)


def general_glare(theta: npt.ArrayLike, age: float = 35.0, pigment: float = 0.5) -> Array:
    """The general equation of CIE 146, 0.1 to 100 degrees."""
    t = np.asarray(theta, np.float64)
    older = 1.0 + (age / 62.5) ** 4
    return np.asarray(
        10.0 / t**3 + (5.0 / t**2 + 0.1 * pigment / t) * older + 2.5e-3 * pigment, np.float64
    )


def small_angle_glare(theta: npt.ArrayLike, age: float = 35.0) -> Array:
    """The small angle equation of CIE 146, 0.1 to 30 degrees."""
    t = np.asarray(theta, np.float64)
    return np.asarray(10.0 / t**3 + 5.0 / t**2 * (1.0 + (age / 62.5) ** 4), np.float64)


def stiles_holladay(theta: npt.ArrayLike, age: float = 0.0) -> Array:
    """10 / theta^2 of Stiles and Holladay, 3 to 30 degrees; with an age that of CIE 146."""
    t = np.asarray(theta, np.float64)
    return np.asarray(10.0 * (1.0 + (age / 70.0) ** 4) / t**2, np.float64)


def _psf(theta: npt.ArrayLike, observer: Observer) -> Array:
    return total_glare(theta, observer.age, observer.pigment)


MODEL = GlareModel(
    name="cie135",
    title="CIE total glare function",
    cite="Vos and van den Berg, CIE 135/1-6, 1999",
    psf=_psf,
    by_observer=True,
)
