"""Textures as reflectance maps, and what a surface sends back.

R = T^gamma * D (Petit and Bremond 2010, section 3): an 8-bit texture made for
daylight times the material's diffuse colour is a reflectance. Lambert: L = R E / pi;
the paper's own L = R E is ``petit2010`` (brighter by pi). Specular: Blinn-Phong,
normalised so that the highlight's energy does not grow with the exponent. Twin of
``reflectance.glsl``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def reflectance_table(gamma: float, diffuse: float) -> npt.NDArray[np.float64]:
    """R of the 256 codes of an 8-bit channel: (code / 255)^gamma * D, unclipped. Shape (256,)."""
    codes: npt.NDArray[np.float64] = np.arange(256) / 255.0
    return np.asarray(codes**gamma * diffuse, np.float64)


def lambert(reflectance: Array, lux: Array, scale: float) -> Array:
    """cd/m2 of a diffuse surface: R E * scale, scale 1/pi (Lambert) or 1 (``petit2010``)."""
    return np.asarray(reflectance * lux * scale)


def half_cosine(nl: Array, nv: Array, lv: Array) -> Array:
    """N.H from N.L, N.V and L.V, H being halfway between light and eye (Blinn 1977).

    (N.L + N.V) / |L + V|, with |L + V|^2 = 2 + 2 L.V for unit vectors.
    """
    return np.asarray((nl + nv) / np.sqrt(np.maximum(2.0 + 2.0 * lv, 1e-12)))


def blinn_phong(cosine: Array, shininess: Array, scale: float) -> Array:
    """Luminance per lux and unit of specular reflectance, from N.H: sr^-1.

    (n + 8) / (8 pi) (N.H)^n with ``scale`` = 1/pi; with ``scale`` = 1 the raw
    OpenGL (N.H)^n of ``petit2010``.
    """
    lobe = np.maximum(cosine, 1e-9) ** shininess
    normal = np.where(scale < 1.0, (shininess + 8.0) / 8.0 * scale, 1.0)
    return np.asarray(lobe * normal)
