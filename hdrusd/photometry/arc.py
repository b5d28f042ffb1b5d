"""The arctangent as shader 1 takes it; twin of ``arc.glsl``, which is good to 2e-8 rad.

GLSL 3.30 promises nothing about atan, and Vulkan 1.3 allows 4096 ulp.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def arctan_rest(t2: Array) -> Array:
    """(arctan(t) / t - 1) / t^2 for t^2 from 0 to 1.

    The shader has Abramowitz and Stegun 4.4.49.
    """
    t2 = np.asarray(t2, np.float64)
    t = np.sqrt(np.maximum(t2, 1e-4))
    series = -1.0 / 3.0 + t2 / 5.0 - t2**2 / 7.0
    return np.where(t2 < 1e-4, series, (np.arctan(t) / t - 1.0) / t**2)


def arc_angle(sine: Array, cosine: Array) -> Array:
    """Angle in rad of sine >= 0 and cosine times any positive number; 0 of none."""
    return np.asarray(np.arctan2(sine, cosine))


def arc_excess(tangent: Array) -> Array:
    """arctan(t) - t for t >= 0, which the shader must not take as a difference where t is small."""
    return np.asarray(np.arctan(tangent) - tangent)
