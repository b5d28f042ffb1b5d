"""The pupil's size, and the light that it lets onto the retina.

P. Moon, D. E. Spencer, "On the Stiles-Crawford effect", J. Opt. Soc. Am. 34(6), 1944
(formula as handed down, not read in the original); A. B. Watson, J. I. Yellott, "A unified
formula for light-adapted pupil size", Journal of Vision 12(10):12, 2012, eq. 21.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

#: Watson and Yellott 2012: the age, in years, of the observers of Stanley and Davies,
#: and what one eye alone counts beside two.
_REFERENCE_AGE = 28.58
_ONE_EYE = 0.1


def moon_spencer(luminance: npt.ArrayLike) -> Array:
    """Diameter in mm for an adapting luminance > 0 in cd/m2: 4.9 - 3 tanh(0.4 log10 L)."""
    return np.asarray(4.9 - 3.0 * np.tanh(0.4 * np.log10(luminance)))


def watson_yellott(
    luminance: npt.ArrayLike, area: float = 3600.0, age: float = 30.0, eyes: int = 2
) -> Array:
    """Diameter in mm for a field of ``area`` deg2 of ``luminance`` cd/m2.

    ``age`` in years, 20 to 83 in the data behind it; ``eyes`` that see the field, 1 or 2.
    """
    flux = np.asarray(luminance, np.float64) * area * (1.0 if eyes == 2 else _ONE_EYE)
    share = (flux / 846.0) ** 0.41
    young = 7.75 - 5.75 * share / (share + 2.0)
    return np.asarray(young + (age - _REFERENCE_AGE) * (0.02132 - 0.009562 * young))


def pupil_area(diameter: npt.ArrayLike) -> Array:
    """Area in mm2 of a pupil of ``diameter`` mm."""
    return np.asarray(math.pi / 4.0 * np.square(diameter))


def trolands(luminance: npt.ArrayLike, diameter: npt.ArrayLike) -> Array:
    """Retinal illuminance in td of ``luminance`` cd/m2 through a pupil of ``diameter`` mm."""
    return np.asarray(np.asarray(luminance) * pupil_area(diameter))
