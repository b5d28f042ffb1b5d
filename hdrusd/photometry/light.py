"""A light as photometry means it, and the illuminance it gives.

Petit and Bremond 2010, equation 1: E = sum_k I_k cos(theta) / d^2. Cone and focus
follow UsdLux ShapingAPI (OpenUSD 26.11); focus is OpenGL's spot exponent. Twin of
``light.glsl``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hdrusd.scene import NO_CONE, POINT, SPHERE
from hdrusd.units import LUMINANCE_WEIGHTS

RGB = tuple[float, float, float]
Array = npt.NDArray[Any]
Provenance = Literal["measured", "authored", "estimated"]


#: 1 / rad: the edge of a cone without softness is a millionth of a radian wide.
HARD_EDGE = 1e6

#: m: a ball up to this radius shines as a point does. What it loses where the horizon of a
#: surface cuts it is below radius / distance of the light at normal incidence.
SMALL_SPHERE = 0.1


@dataclass(frozen=True, slots=True)
class PhotometricLight:
    """What a lamp is, independent of where it stands.

    ``intensity`` is the photometric strength: cd on the axis, or lux on a facing
    plane for "distant" (on a horizontal plane under open sky for "ambient"). With a
    ``profile``, a photometric file as the stage names it, it is the factor on the
    file's candela.
    ``sp`` is the ratio of its scotopic to its photopic light; 0: nobody has said, and its
    colour tells. ``chromaticity`` is linear Rec. 709 with a luminance of 1, so that their
    product is the strength per channel.
    """

    kind: Literal["point", "spot", "distant", "ambient"]
    intensity: float
    chromaticity: RGB = (1.0, 1.0, 1.0)
    cutoff: float = 180.0  # degrees, half-angle; 180 is no cone
    softness: float = 0.0  # share of the cone over which it fades (UsdLux)
    exponent: float = 0.0  # of cos(angle to the axis)
    radius: float = 0.05  # m
    profile: str = ""
    sp: float = 0.0
    provenance: Provenance = "estimated"
    rule: str = ""
    source: str = ""


def chromaticity(color: RGB) -> tuple[RGB, float]:
    """A linear colour as (the same with luminance 1, its luminance); black gives white and 0."""
    luminance = float(np.dot(LUMINANCE_WEIGHTS, color))
    if luminance <= 0.0:
        return (1.0, 1.0, 1.0), 0.0
    r, g, b = (float(c) / luminance for c in color)
    return (r, g, b), luminance


def shines_as(lights: npt.NDArray[np.void] | np.void) -> npt.NDArray[np.int32]:
    """(n,) the LIGHT.shape by which lights shine: a small ball, and what is distant, as POINT."""
    small = (lights["shape"] == SPHERE) & (lights["radius"] <= SMALL_SPHERE)
    return np.where(small | (lights["w"] == 0.0), POINT, lights["shape"])


def has_beam(lights: npt.NDArray[np.void]) -> npt.NDArray[np.bool_]:
    """(n,) which LIGHT rows have a cone, a focus or a photometric file."""
    cone = lights["outer"] < NO_CONE
    return np.asarray(cone | (lights["exponent"] > 0.0) | (lights["profile"] >= 0))


def angle_from_cosine(cosine: Array) -> Array:
    """The angle in radians, cosine in [-1, 1].

    The shader's twin is the polynomial of Abramowitz and Stegun 4.4.46, good to
    2e-8 rad, because drivers' acos is not.
    """
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def cone_factor(cosine: Array, inner: Array, inverse_width: Array) -> Array:
    """Share of the axial intensity that a cone lets pass in a direction (UsdLux ShapingAPI).

    ``cosine``: of the angle between the light's axis and the direction of
    emission; ``inner``: radians, full up to here; ``inverse_width``: 1 / rad, of
    the edge beyond it over which a smoothstep of the angle (not of its cosine)
    fades to nothing. A hard edge has ``HARD_EDGE``.
    """
    t = np.clip((angle_from_cosine(cosine) - inner) * inverse_width, 0.0, 1.0)
    return np.asarray(1.0 - t * t * (3.0 - 2.0 * t))


def inverse_edge(inner: Array, outer: Array) -> Array:
    """1 / rad between two cone angles (rad), at most ``HARD_EDGE``."""
    return np.asarray(1.0 / np.maximum(np.asarray(outer) - inner, 1.0 / HARD_EDGE))


def focus_factor(cosine: Array, exponent: Array) -> Array:
    """Share of the axial intensity by UsdLux focus: |cosine|^exponent, OpenGL's spot exponent."""
    return np.asarray(np.maximum(np.abs(cosine), 1e-9) ** exponent)


def light_vector(position: Array, w: Array, point: Array) -> Array:
    """From a surface point to the light, unnormalised: (..., 3).

    ``w`` = 1: ``position`` is a place, in metres. ``w`` = 0: it is the unit vector
    towards a distant light, whose "distance" of 1 makes the same equation hold.
    """
    return np.asarray(position - point * np.asarray(w)[..., None])


def illuminance(cosine: Array, inverse_d2: Array, inverse_radius2: Array) -> Array:
    """cos(theta) / d^2 of equation 1: lux per candela (per lux for a distant light).

    ``cosine``: between the normal and the way to the light; ``inverse_d2``: 1 over
    the square of the distance, 1/m2; ``inverse_radius2``: 1 over that of the lamp's
    radius, at which the inverse square stops: nothing is nearer than its surface.
    """
    return np.asarray(np.maximum(cosine, 0.0) * np.minimum(inverse_d2, inverse_radius2))


def inverse_square(length: Array) -> Array:
    """1 / length^2, 1/m2, finite for a length of 0."""
    return np.asarray(1.0 / np.maximum(np.square(length), 1e-20))
