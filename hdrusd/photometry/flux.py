"""The luminous flux of a lamp with a cone and a focus, as shader 1 lets it shine."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import PhotometricLight

#: Gauss-Legendre nodes over the edge of a cone: a smoothstep times a smooth function.
_NODES = 64


def flux(light: PhotometricLight) -> float | None:
    """lm: 2 pi I times the integral of cone(t) |cos t|^e sin t over 0 to pi.

    A photometric file has its own (``Luminaire.flux``), and what is distant has none: None.
    """
    if light.kind not in ("point", "spot") or light.profile:
        return None
    outer = math.radians(min(light.cutoff, 180.0))
    if outer >= math.pi:
        return 2.0 * math.pi * light.intensity * _up_to(math.pi, light.exponent)
    inner = outer * (1.0 - min(max(light.softness, 0.0), 1.0))
    nodes, weights = _rule()
    middle = min(max(0.5 * math.pi, inner), outer)  # where |cos| has a corner
    fading = 0.0
    for low, high in ((inner, middle), (middle, outer)):
        angle = low + (high - low) * 0.5 * (nodes + 1.0)
        t = (angle - inner) / max(outer - inner, 1e-300)
        edge = 1.0 - t * t * (3.0 - 2.0 * t)
        along = edge * np.abs(np.cos(angle)) ** light.exponent * np.sin(angle)
        fading += 0.5 * (high - low) * float(along @ weights)
    return 2.0 * math.pi * light.intensity * (_up_to(inner, light.exponent) + fading)


@cache
def _rule() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Nodes between -1 and 1, and weights; each set is the roots of a matrix of that size."""
    return np.polynomial.legendre.leggauss(_NODES)


def _up_to(angle: float, exponent: float) -> float:
    """The integral of |cos t|^exponent sin t over 0 to ``angle``."""
    cosine = math.cos(angle)
    return (1.0 - math.copysign(abs(cosine) ** (exponent + 1.0), cosine)) / (exponent + 1.0)
