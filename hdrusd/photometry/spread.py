"""Lumens to candela on the axis, by how a lamp spreads its light.

I = Phi / W, with W the solid angle weighted by the share of the axial intensity: 4 pi of a
sphere, 2 pi of a half space, pi of a cosine (Lambert), 2 pi (1 - cos a) of a cone with a
hard edge, and of any cone and focus the integral of the very falloff that is rendered
(``flux.py``): W = 2 pi int c(t) |cos t|^n sin t dt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from hdrusd.photometry.flux import flux
from hdrusd.photometry.light import PhotometricLight

Spread = Literal["sphere", "hemisphere", "lambert", "cone"]


@dataclass(frozen=True, slots=True)
class Beam:
    """Cone and focus of a lamp as UsdLux ShapingAPI has them; as it stands, all around alike."""

    cutoff: float = 180.0  # degrees, half-angle
    softness: float = 0.0
    exponent: float = 0.0

    @property
    def shaped(self) -> bool:
        """Whether it does not shine all around alike."""
        return self.cutoff < 180.0 or self.exponent > 0.0


#: What a lamp without a cone becomes where its light goes into a half space.
SHAPES: dict[Spread, Beam] = {
    "hemisphere": Beam(cutoff=90.0),
    "lambert": Beam(cutoff=90.0, exponent=1.0),
}

#: sr, W of the spreads that need no beam.
_SOLID = {"sphere": 4.0 * math.pi, "hemisphere": 2.0 * math.pi, "lambert": math.pi}


def solid_angle(spread: Spread, beam: Beam) -> float:
    """W of a spread, sr; of "cone" that of the beam."""
    return _SOLID.get(spread) or beam_solid_angle(beam)


def beam_solid_angle(beam: Beam) -> float:
    """The integral of a beam's share of its axial intensity over all directions, sr."""
    lamp = PhotometricLight(
        "spot", 1.0, cutoff=beam.cutoff, softness=beam.softness, exponent=beam.exponent
    )
    return flux(lamp) or 0.0
