"""How large a lamp is whose faces are known, for I = L A and Phi = pi L S.

A, the area seen from the axis, is that of the faces that look along it: exact for what is
flat and for every convex shape, open or closed. The axis is the mean normal, or of a closed
shape, which has none, the direction that most of its area faces. The other sides of a thing
without thickness do not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

#: Share of its surface that is missing of a shape that counts as closed.
_CLOSED = 1e-3


@dataclass(frozen=True, slots=True)
class LampArea:
    """m2 of one lamp; where it stands in several places, their mean and its range."""

    seen: float  # from the axis
    surface: float
    places: int = 1
    least: float = 0.0  # of ``seen``, over the places
    most: float = 0.0

    @classmethod
    def of(cls, faces: Array) -> LampArea:
        """Of area vectors (n, 3), m2 each: normal times area."""
        faces = np.asarray(faces, np.float64)
        surface = float(np.linalg.norm(faces, axis=1).sum())
        if not 0.0 < surface < np.inf:
            return cls(0.0, 0.0)
        seen = float(np.maximum(faces @ _axis(faces, surface), 0.0).sum())
        return cls(seen, surface)


def mean_area(lamps: list[LampArea]) -> LampArea | None:
    """Of the lamps in all places; None without one that has an area."""
    lamps = [lamp for lamp in lamps if lamp.seen > 0.0]
    if not lamps:
        return None
    seen = [lamp.seen for lamp in lamps]
    surface = sum(lamp.surface for lamp in lamps) / len(lamps)
    return LampArea(sum(seen) / len(seen), surface, len(lamps), min(seen), max(seen))


def _axis(faces: Array, surface: float) -> Array:
    mean = faces.sum(axis=0)
    length = float(np.linalg.norm(mean))
    if length > _CLOSED * surface:
        return np.asarray(mean / length)
    # Sum of a n n^T; its first eigenvector has the most area across it.
    sizes = np.linalg.norm(faces, axis=1, keepdims=True)
    spread = faces.T @ (faces / np.where(sizes > 0.0, sizes, 1.0))
    return np.asarray(np.linalg.eigh(spread)[1][:, -1])
