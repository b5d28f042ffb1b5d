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

from hdrusd.units import LUMINANCE_WEIGHTS

RGB = tuple[float, float, float]
Array = npt.NDArray[Any]
Provenance = Literal["measured", "authored", "estimated"]


@dataclass(frozen=True, slots=True)
class PhotometricLight:
    """What a lamp is, independent of where it stands.

    ``intensity`` is the photometric strength: cd on the axis, or lux on a facing
    plane for "distant" (on a horizontal plane under open sky for "ambient").
    ``chromaticity`` is linear Rec. 709 with a luminance of 1, so that their
    product is the strength per channel.
    """

    kind: Literal["point", "spot", "distant", "ambient"]
    intensity: float
    chromaticity: RGB = (1.0, 1.0, 1.0)
    cutoff: float = 180.0  # degrees, half-angle; 180 is no cone
    softness: float = 0.0  # share of the cone over which it fades (UsdLux)
    exponent: float = 0.0  # of cos(angle to the axis)
    radius: float = 0.05  # m
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


def angle_from_cosine(cosine: Array) -> Array:
    """The angle in radians, cosine in [-1, 1].

    The shader's twin is the polynomial of Abramowitz and Stegun 4.4.46, good to
    2e-8 rad, because drivers' acos is not.
    """
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def cone_factor(cosine: Array, inner: Array, outer: Array, exponent: Array) -> Array:
    """Share of the axial intensity that a spot sends in a direction.

    ``cosine``: of the angle between the light's axis and the direction of
    emission; ``inner``, ``outer``: radians, full up to the one and nothing beyond
    the other, a smoothstep of the angle (not of its cosine) between them;
    ``exponent``: of the absolute cosine. UsdLux ShapingAPI.
    """
    theta = angle_from_cosine(cosine)
    width = np.maximum(outer - inner, 1e-6)
    t = np.clip((theta - inner) / width, 0.0, 1.0)
    fade = 1.0 - t * t * (3.0 - 2.0 * t)
    return np.asarray(fade * np.maximum(np.abs(cosine), 1e-9) ** exponent)


def light_vector(position: Array, w: Array, point: Array) -> Array:
    """From a surface point to the light, unnormalised: (..., 3).

    ``w`` = 1: ``position`` is a place, in metres. ``w`` = 0: it is the unit vector
    towards a distant light, whose "distance" of 1 makes the same equation hold.
    """
    return np.asarray(position - point * np.asarray(w)[..., None])


def illuminance(cosine: Array, d2: Array, radius: Array) -> Array:
    """cos(theta) / d^2 of equation 1: lux per candela (per lux for a distant light).

    ``cosine``: between the normal and the way to the light; ``d2``: the square of
    the distance, m2, above 0; ``radius``: m, within which the inverse square is not
    followed.
    """
    return np.asarray(np.maximum(cosine, 0.0) / np.maximum(d2, radius * radius))
