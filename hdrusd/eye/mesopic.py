"""Mesopic luminance, CIE 191:2010: between what cones and what rods see.

The standard takes the adaptation of the eye from a luminance of the task's surroundings; here
each pixel is its own surroundings.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import clean, luminance
from hdrusd.eye.scotopic import scotopic as scotopic_of

Array = npt.NDArray[Any]

#: V'(555 nm) as CIE 191 has it: 683 lm/W over 1699 lm/W.
_ROD_WEIGHT = 683.0 / 1699.0

#: m = _OFFSET + _SLOPE log10(Lm) (CIE 191:2010, eq. 3).
_OFFSET, _SLOPE = 0.767, 0.3334

#: How far m may be from its fixed point, and steps that suffice for ratios S/P of 0.26 to 20.
#: For less m may settle slowly where it is nearly 0, for more it may go to and fro: then halves.
_TOLERANCE, _STEPS, _HALVES = 1e-8, 500, 40


def mesopic(photopic: npt.ArrayLike, scotopic: npt.ArrayLike) -> tuple[Array, Array]:
    """Mesopic luminance, cd/m2, and adaptation coefficient m in [0, 1]; each (...).

    ``photopic`` cd/m2 and ``scotopic`` scotopic cd/m2, (...), not negative. From m = 0.5 on,
    Lm = (m Lp + (1 - m) Ls V'0) / (m + (1 - m) V'0) and m by its logarithm are repeated until
    they agree, or, where they do not come to that, halved down to it. m is 0 below about 0.005
    and 1 above 5 cd/m2.
    """
    lp, ls = np.broadcast_arrays(np.asarray(photopic, np.float64), np.asarray(scotopic, np.float64))
    shape = lp.shape
    lp, ls = lp.ravel(), ls.ravel() * _ROD_WEIGHT
    m = np.full(lp.size, 0.5)
    left = np.arange(lp.size)
    for _ in range(_STEPS):
        before = m[left]
        m[left] = _coefficient(_mixed(lp[left], ls[left], before))
        left = left[np.abs(m[left] - before) > _TOLERANCE]
        if not left.size:
            break
    m[left] = _between(lp[left], ls[left])
    return _mixed(lp, ls, m).reshape(shape), m.reshape(shape)


def _between(cones: Array, rods: Array) -> Array:
    """Where Lm and m agree, by halves of 0 to 1: of deep blue light the steps go to and fro."""
    low, high = np.zeros(cones.size), np.ones(cones.size)
    for _ in range(_HALVES):
        m = 0.5 * (low + high)
        above = _coefficient(_mixed(cones, rods, m)) > m
        low, high = np.where(above, m, low), np.where(above, high, m)
    return 0.5 * (low + high)


def _mixed(cones: Array, rods: Array, m: Array) -> Array:
    return (m * cones + (1.0 - m) * rods) / (m + (1.0 - m) * _ROD_WEIGHT)


def _coefficient(lm: Array) -> Array:
    return np.clip(_OFFSET + _SLOPE * np.log10(np.maximum(lm, 1e-30)), 0.0, 1.0)


def mesopic_layer(rgb: npt.ArrayLike, scotopic: npt.ArrayLike | None = None) -> Array:
    """Mesopic luminance (h, w) float32, cd/m2, of a frame (h, w, 3) in cd/m2.

    ``scotopic`` (h, w): its scotopic luminance where lamps state their S/P (default: by the
    colour). NaN and negative values count as 0.
    """
    rgb = clean(rgb)
    rods = scotopic_of(rgb) if scotopic is None else clean(scotopic)
    return mesopic(luminance(rgb), rods)[0].astype(np.float32)
