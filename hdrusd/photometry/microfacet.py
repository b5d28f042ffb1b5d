"""The highlight of UsdPreviewSurface: GGX microfacets under a clear coat.

f = F D G / (4 N.L N.V) of Walter et al. 2007 (Microfacet models for refraction through
rough surfaces, eqs. 20, 33, 34) with separable Smith shadowing G = G1(N.L) G1(N.V) and
the Fresnel term of Schlick 1994. alpha is roughness squared. Twin of ``microfacet.glsl``.

What a layer reflects is lost to what lies below it: diffuse (1 - F), with F at V.H. The
text of UsdPreviewSurface (2.6) leaves this open; its reference shader and glTF 2.0
(appendix B) do so. A clear coat of 4 % (index 1.5) lies on the rest in the same way.
Seen at a grazing angle a white and smooth surface so gives more than it gets: 7 % at 66
degrees, 30 % at 78, for a reflectance of 1; below 0.5 it never does at these.

Made for many lights a pixel: ``ggx_gain`` holds what does not depend on the light, and
the lobe is a quotient without powers. sin^2 of the half angle takes the place of N.H,
because 1 - (N.H)^2 has no digits left in float32 where alpha is 0.001:

    D = alpha^2 / (pi (alpha^2 + (1 - alpha^2) sin^2)^2)
    G1(c) = 2 c / (c + sqrt(alpha^2 + (1 - alpha^2) c^2))
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

#: The smallest alpha: of a smoother surface a lamp's highlight is smaller than the lamp.
MIN_ALPHA = 1e-3

#: Reflectance of a clear coat at normal incidence, and what is left to 1.
COAT_F0, COAT_REST = 0.04, 0.96


def alpha_from_roughness(roughness: Array) -> Array:
    """Width of the lobe: roughness squared, not below ``MIN_ALPHA``."""
    return np.maximum(np.square(roughness), MIN_ALPHA)


def grazing_reflectance(f0: Array, metallic: Array) -> Array:
    """F90 (..., 3): a metal keeps its F0; others reflect all, or less where F0 is below 2 %.

    No known substance reflects less than 2 %: a darker F0 is an artist's way to take the
    highlight away, and F0 = 0 takes it away altogether.
    """
    dielectric = np.minimum(50.0 * np.max(f0, axis=-1, keepdims=True), 1.0)
    m = np.asarray(metallic)[..., None]
    return np.asarray(dielectric * (1.0 - m) + f0 * m)


def schlick_weight(cosine: Array) -> Array:
    """(1 - V.H)^5: share of F90 in the Fresnel reflectance."""
    return np.maximum(1.0 - np.asarray(cosine), 0.0) ** 5


def fresnel(f0: Array, f90: Array, weight: Array) -> Array:
    """Reflectance (..., 3) between F0 and F90 by ``schlick_weight`` (...)."""
    return np.asarray(f0 + (f90 - f0) * np.asarray(weight)[..., None])


def half_squares(normal: Array, light: Array, view: Array, nl: Array, nv: Array) -> Array:
    """(..., 2): squares of the length of H = L + V in the surface, and of H. Unit vectors (..., 3).

    The part in the surface has no cancellation where H is near N. A half vector that
    points into the surface counts as lying in it.
    """
    h = light + view
    s = h - normal * np.maximum(nl + nv, 0.0)[..., None]
    return np.stack([np.sum(s * s, axis=-1), np.maximum(np.sum(h * h, axis=-1), 1e-8)], axis=-1)


def half_angles(normal: Array, light: Array, view: Array, nl: Array, nv: Array) -> Array:
    """(..., 2): sin^2 of the angle between N and H, and V.H, from ``half_squares``."""
    part, whole = np.moveaxis(half_squares(normal, light, view, nl, nv), -1, 0)
    return np.stack([part / whole, 0.5 * np.sqrt(whole)], axis=-1)


def smith_side(cosine: Array, alpha2: Array) -> Array:
    """Denominator of the Smith G1 of GGX: c + sqrt(alpha^2 + (1 - alpha^2) c^2).

    1 / (its value for N.L times its value for N.V) is G / (4 N.L N.V).
    """
    c = np.maximum(cosine, 0.0)
    return np.asarray(c + np.sqrt(alpha2 + (1.0 - alpha2) * c * c))


def ggx_gain(nv: Array, alpha2: Array, scale: float) -> Array:
    """What ``ggx_lobe`` needs of a pixel: everything that no light changes.

    ``scale`` is 1/pi; 1 for ``petit2010``, whose luminances are larger by pi.
    """
    return np.asarray(scale * alpha2 / smith_side(nv, alpha2))


def ggx_lobe(gain: Array, alpha2: Array, nl: Array, sine2: Array) -> Array:
    """D G / (4 N.L N.V): luminance per lux (sr^-1) where the Fresnel reflectance is 1."""
    d = alpha2 + (1.0 - alpha2) * sine2
    return np.asarray(gain / (d * d * smith_side(nl, alpha2)))


def ggx_lobe_of_half(gain: Array, alpha2: Array, nl: Array, squares: Array) -> Array:
    """``ggx_lobe`` from ``half_squares`` (..., 2): one quotient a light instead of three."""
    return ggx_lobe(gain, alpha2, nl, squares[..., 0] / squares[..., 1])


def layered(below: Array, f: Array, lobe: Array) -> Array:
    """Luminance per lux (..., 3) of a layer that reflects ``f`` (..., 3) in a lobe (...).

    ``below`` (..., 3): that of what lies under it, which gets 1 - ``f``.
    """
    return np.asarray(below + f * (np.asarray(lobe)[..., None] - below))


def coat_reflectance(amount: Array, weight: Array) -> Array:
    """Reflectance of a clear coat from its amount in [0, 1] and ``schlick_weight``."""
    return np.asarray(amount * (COAT_F0 + COAT_REST * weight))
