"""Lumens to candela on the axis, by how a lamp spreads its light.

I = Phi / W, with W the solid angle weighted by the share of the axial intensity: 4 pi of a
sphere, 2 pi of a half space, pi of a cosine (Lambert), 2 pi (1 - cos a) of a cone with a
hard edge, and of any cone and focus the integral of the very falloff that is rendered
(``flux.py``): W = 2 pi int c(t) |cos t|^n sin t dt.

A lamp that is a flat face or a tube shines by its shape, whatever is said: pi of a face, which is
Lambert's and has one side, pi^2 of a tube, whose sides shine by sin t from its length. Cone and
focus, about an axis square to that, are factors on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.flux import flux
from hdrusd.photometry.light import PhotometricLight

Spread = Literal["sphere", "hemisphere", "lambert", "cone"]

#: What shines: a ball or a point, one side of something flat, a tube without its ends.
Emitter = Literal["ball", "face", "tube"]

Array = npt.NDArray[Any]

#: Steps of the midpoint rule over each part of a cone; its error goes with their square.
_STEPS = 1 << 15


@dataclass(frozen=True, slots=True)
class Beam:
    """Cone and focus of a lamp as UsdLux ShapingAPI has them; as it stands, all around alike."""

    cutoff: float = 180.0  # degrees, half-angle
    softness: float = 0.0
    exponent: float = 0.0
    emitter: Emitter = "ball"

    @property
    def shaped(self) -> bool:
        """Whether cone or focus keep some of its light."""
        return self.cutoff < 180.0 or self.exponent > 0.0


#: What a lamp without a cone becomes where its light goes into a half space.
SHAPES: dict[Spread, Beam] = {
    "hemisphere": Beam(cutoff=90.0),
    "lambert": Beam(cutoff=90.0, exponent=1.0),
}

#: sr, W of the spreads that need no beam.
_SOLID = {"sphere": 4.0 * math.pi, "hemisphere": 2.0 * math.pi, "lambert": math.pi}

#: How the shapes shine without a cone, and W of them.
OWN: dict[Emitter, str] = {"ball": "sphere", "face": "lambert", "tube": "tube"}
_OWN_SOLID: dict[Emitter, float] = {"ball": 4.0 * math.pi, "face": math.pi, "tube": math.pi**2}


def solid_angle(spread: str, beam: Beam) -> float:
    """W of a spread, sr; of "cone" that of the beam. ``spread``: a Spread, or one of ``OWN``."""
    if spread == OWN[beam.emitter]:
        return _OWN_SOLID[beam.emitter]
    return _SOLID.get(spread) or beam_solid_angle(beam)


def beam_solid_angle(beam: Beam) -> float:
    """The integral of a beam's share of its axial intensity over all directions, sr."""
    if beam.emitter != "ball":
        return _shape_solid_angle(beam) if beam.shaped else _OWN_SOLID[beam.emitter]
    lamp = PhotometricLight(
        "spot", 1.0, cutoff=beam.cutoff, softness=beam.softness, exponent=beam.exponent
    )
    return flux(lamp) or 0.0


@lru_cache
def _shape_solid_angle(beam: Beam) -> float:
    """W = int c(t) |cos t|^n s(t) sin t dt, sr, with s(t) the sum of the shape's share about the
    axis: 2 pi cos t before a face, 0 behind it; 4 E(sin^2 t) of a tube, for the mean over p of
    sqrt(1 - sin^2 t cos^2 p), with E the complete elliptic integral of the second kind.
    """
    end = 0.5 * math.pi if beam.emitter == "face" else math.pi
    outer = math.radians(min(beam.cutoff, 180.0))
    inner = outer * (1.0 - min(max(beam.softness, 0.0), 1.0)) if outer < math.pi else outer
    marks = sorted({0.0, *(min(mark, end) for mark in (inner, 0.5 * math.pi, outer))})
    total = 0.0
    for low, high in pairwise(marks):
        if high > outer:
            break
        step = (high - low) / _STEPS
        angle = low + (np.arange(_STEPS) + 0.5) * step
        cosine = np.abs(np.cos(angle))
        edge = np.clip((angle - inner) / max(outer - inner, 1e-300), 0.0, 1.0)
        share = (1.0 - edge * edge * (3.0 - 2.0 * edge)) * cosine**beam.exponent
        about = 2.0 * math.pi * cosine if beam.emitter == "face" else 4.0 * _elliptic(cosine)
        total += float(np.sum(share * about * np.sin(angle))) * step
    return total


def _elliptic(cosine: Array) -> Array:
    """E(1 - cosine^2), cosine in (0, 1]: arithmetic-geometric mean, Abramowitz and Stegun 17.6."""
    a, b = np.ones_like(cosine), cosine
    missing, power = 0.5 * (1.0 - cosine * cosine), 0.5
    for _ in range(8):
        a, b, c = 0.5 * (a + b), np.sqrt(a * b), 0.5 * (a - b)
        power *= 2.0
        missing = missing + power * c * c
    return np.asarray(0.5 * math.pi / a * (1.0 - missing))
