"""Rules that turn an OpenGL colour without a unit into photometry, each with a name.

All rest on one reading: the LDR picture's 1.0 is a white diffuse surface under a
reference illuminance E_ref. A legacy light of colour 1 then gives E_ref where its
attenuation is half; an emission of 1 is as bright as that white surface,
E_ref / pi. It is a guess, marked "estimated", and photometry.toml is the cure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hdrusd.registry import Registry

if TYPE_CHECKING:  # the command line's help lists the rules, and NumPy would slow it
    from hdrusd.legacy.scene import RGB, Light

#: cd of a light point of colour and intensity 1, whatever the picture's illuminance: the least
#: of a low-intensity runway edge light where other lights are about (ICAO Annex 14, vol. I, 5.3.9).
#: By luminance a red one then has 10.6 cd (obstacle light of type A: 10), a blue 3.6 (taxiway
#: edge: at least 2).
LIGHT_POINT = 50.0

#: Name and text of that rule, for the report.
LIGHT_POINT_RULE = "light-point-50cd"
LIGHT_POINT_TEXT = "intensity 1.0 of white is 50 cd (a low-intensity runway edge light)"

#: Distance at which an unattenuated legacy light is taken to give E_ref: a tenth of the
#: scene's diagonal, but at least this many metres.
MIN_REFERENCE_DISTANCE = 1.0

#: No reference distance is longer, m: an attenuation that hardly falls says little of a lamp.
MAX_REFERENCE_DISTANCE = 1000.0


@dataclass(frozen=True, slots=True)
class Estimate:
    """A named rule, per unit of colour.

    ``strength``: cd for local lights and lux for directional ones, from the light,
    its attenuation per metre, and the scene's diagonal in m; ``luminance``: cd/m2 of
    emission.
    """

    name: str
    text: str  # for the report
    strength: Callable[[Light, float], float]
    luminance: float
    ambient: float  # lux per unit of light model ambient

    def lux(self, ambient: RGB) -> RGB:
        """Light model ambient as illuminance per channel."""
        r, g, b = (self.ambient * c for c in ambient)
        return r, g, b


def reference_distance(light: Light, diagonal: float) -> float:
    """Where the OpenGL attenuation is one half, m; a tenth of the diagonal if it never is.

    Solves 1 / (k0 + k1 d + k2 d^2) = 1/2 times its value at the lamp (k0, or 1 where
    k0 is 0 and the value has no bound).
    """
    k0, k1, k2 = light.attenuation or (1.0, 0.0, 0.0)
    wanted = 2.0 * k0 if k0 > 0.0 else 2.0
    c = k0 - wanted
    if k2 > 0.0:
        # 2 c / (-b - root): the other form cancels where k2 is small, and divides by it.
        steep = k1 + math.sqrt(max(k1 * k1 - 4.0 * k2 * c, 0.0))
        distance = -2.0 * c / steep if steep > 0.0 else MAX_REFERENCE_DISTANCE
    elif k1 > 0.0:
        distance = -c / k1
    else:
        distance = 0.1 * diagonal
    least = 1e-3 if k1 > 0.0 or k2 > 0.0 else MIN_REFERENCE_DISTANCE
    return min(max(distance, least), MAX_REFERENCE_DISTANCE)


def attenuation(light: Light, distance: float) -> float:
    """OpenGL's 1 / (k0 + k1 d + k2 d^2)."""
    k0, k1, k2 = light.attenuation or (1.0, 0.0, 0.0)
    total = k0 + k1 * distance + k2 * distance * distance
    return 1.0 / total if total > 0.0 else 1.0


def _rule(name: str, lux: float, text: str) -> Estimate:
    def strength(light: Light, diagonal: float) -> float:
        if light.kind == "directional":
            return lux
        distance = reference_distance(light, diagonal)
        # Above 1 OpenGL clamps the colour, so a picture shows no more.
        return lux * min(attenuation(light, distance), 1.0) * distance * distance

    return Estimate(name, text, strength, lux / math.pi, lux)


#: E_ref of a lit street at night.
night_20lx = _rule(
    "night-20lx", 20.0, "colour 1.0 is a white surface under 20 lx (a lit street at night)"
)
#: E_ref of an interior.
interior_100lx = _rule(
    "interior-100lx", 100.0, "colour 1.0 is a white surface under 100 lx (a lit interior)"
)
#: E_ref of an overcast day.
day_10klx = _rule(
    "day-10000lx", 10_000.0, "colour 1.0 is a white surface under 10,000 lx (an overcast day)"
)

#: Rule by name; other packages add theirs.
RULES: Registry[Estimate] = Registry("estimate rule", "hdrusd.estimate")
RULES.add("night-20lx", "hdrusd.photometry.estimate:night_20lx")
RULES.add("interior-100lx", "hdrusd.photometry.estimate:interior_100lx")
RULES.add("day-10000lx", "hdrusd.photometry.estimate:day_10klx")

#: The rule where none is named.
DEFAULT_RULE = "night-20lx"
