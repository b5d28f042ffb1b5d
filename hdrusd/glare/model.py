"""What a model of glare is, and those there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.eye.observer import Observer
from hdrusd.registry import Registry

Array = npt.NDArray[Any]


@dataclass(frozen=True, slots=True)
class GlareModel:
    """How an eye scatters light; one of ``psf`` and ``shares`` says it, the other is None.

    ``psf(theta, observer)``: luminance seen at ``theta`` degrees (...) from a source that
    gives 1 lx at the eye, square to its rays: sr^-1. Over the hemisphere it comes to 1.

    ``shares(cosine, weight)``: for a scatter that depends on what else is seen. Of the
    luminance of sample j, what sample i gets, (n, m); ``cosine`` (n, m) of the angles between
    samples, ``weight`` (m,) the part of each that lies in the frame.

    ``by_observer``: whether age and pigment change it.
    """

    name: str
    title: str
    cite: str
    psf: Callable[[npt.ArrayLike, Observer], Array] | None = None
    shares: Callable[[Array, Array], Array] | None = None
    by_observer: bool = False


#: The model where nobody names one.
DEFAULT_MODEL = "cie135"

MODELS: Registry[GlareModel] = Registry("glare model", "hdrusd.glare")
MODELS.add("cie135", "hdrusd.glare.cie135:MODEL")
MODELS.add("spencer95", "hdrusd.glare.spencer95:MODEL")
MODELS.add("ward97", "hdrusd.glare.moon_spencer:MODEL")


def angle(a: npt.ArrayLike, b: npt.ArrayLike) -> Array:
    """Degrees between unit vectors (..., 3), exact for small angles too."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    apart = np.linalg.norm(a - b, axis=-1)
    along = np.linalg.norm(a + b, axis=-1)
    return np.asarray(np.degrees(2.0 * np.arctan2(apart, along)))
