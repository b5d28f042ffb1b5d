"""Threshold versus intensity: the smallest step of luminance that an adapted eye sees.

Fits to psychophysical data: J. Ferwerda, S. Pattanaik, P. Shirley, D. Greenberg, "A Model
of Visual Adaptation for Realistic Image Synthesis", SIGGRAPH 1996 (cones, rods); the single
curve of G. Ward Larson, H. Rushmeier, C. Piatko, "A Visibility Matching Tone Reproduction
Operator for High Dynamic Range Scenes", IEEE TVCG 3(4), 1997, Table 1. Adapting luminance
and threshold in cd/m2, any shape, float64; luminance 0 has the threshold of the dark.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

#: log10 cd/m2 that stands for darkness: below every joint of the curves.
_DARK = -30.0


def tvi_cone(adapting: npt.ArrayLike) -> Array:
    """Threshold of the cones in cd/m2 at an adapting luminance in cd/m2 (Ferwerda 1996)."""
    return np.power(10.0, _cone(_log10(adapting)))


def tvi_rod(adapting: npt.ArrayLike) -> Array:
    """Threshold of the rods in cd/m2 at an adapting luminance in cd/m2 (Ferwerda 1996)."""
    return np.power(10.0, _rod(_log10(adapting)))


def tvi_ward(adapting: npt.ArrayLike) -> Array:
    """Threshold of the whole eye in cd/m2: rods below 0.96 cd/m2, cones above (Ward 1997)."""
    x = _log10(adapting)
    return np.power(10.0, np.where(x < -0.0184, _rod(x), _cone(x)))


def _log10(adapting: npt.ArrayLike) -> Array:
    logs: Array = np.log10(np.maximum(np.asarray(adapting, np.float64), 10.0**_DARK))
    return logs


def _cone(x: Array) -> Array:
    # The power's base is 0.0026 at the lower joint and negative further down.
    bend = np.maximum(0.249 * x + 0.65, 0.0) ** 2.7 - 0.72
    return np.where(x >= 1.9, x - 1.255, np.where(x <= -2.6, -0.72, bend))


def _rod(x: Array) -> Array:
    bend = np.maximum(0.405 * x + 1.6, 0.0) ** 2.18 - 2.86
    return np.where(x >= -1.44, x - 0.395, np.where(x <= -3.94, -2.86, bend))
