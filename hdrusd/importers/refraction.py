"""The index of refraction of a surface, from what it reflects at normal incidence."""

from __future__ import annotations

import math

#: What reflects all has no index of refraction; this one reflects it but for 4e-6.
_MIRROR = 1e6


def index_of(reflectance: float) -> float:
    """Of F0 = ((n - 1) / (n + 1))^2 (Fresnel), for F0 from 0 to 1."""
    root = math.sqrt(reflectance)
    return min((1.0 + root) / max(1.0 - root, 1.0 / _MIRROR), _MIRROR)
