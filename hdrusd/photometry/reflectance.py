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

#: Pairs of codes that are looked up at a time: their numbers stay in the cache.
_BLOCK = 3 * 8192


def reflectance_table(gamma: float, diffuse: float) -> npt.NDArray[np.float64]:
    """R of the 256 codes of an 8-bit channel: (code / 255)^gamma * D, unclipped. Shape (256,)."""
    codes: npt.NDArray[np.float64] = np.arange(256) / 255.0
    return np.asarray(codes**gamma * diffuse, np.float64)


def coded_reflectance(
    codes: npt.NDArray[np.uint8], gamma: float, diffuse: tuple[float, float, float]
) -> npt.NDArray[np.float16]:
    """R of 8-bit pixels (h, w, 1 to 4) as half floats (h, w, 3), with their alpha (h, w, 4).

    Grey is spread over three channels; alpha is code / 255. No arithmetic but a table: two
    codes side by side are the number of an entry that holds both results, rounded once.
    """
    if codes.shape[2] < 3:
        codes = codes[..., [0, 0, 0, 1][: codes.shape[2] + 2]]
    channels = codes.shape[2]
    tables = [reflectance_table(gamma, factor) for factor in diffuse]
    tables.append(np.arange(256) / 255.0)
    single = np.stack(tables).astype("<f2").view("<u2").astype(np.uint32)
    # Pairs of three channels begin at red, blue and green in turn, of four at red and blue.
    first = [0] if bool((single[:3] == single[0]).all()) else [0, 2, 1]
    first = first if channels == 3 else [0, 2]
    pairs = [single[a] | single[(a + 1) % channels][:, None] << 16 for a in first]
    table = np.stack(pairs).astype("<u4").ravel()
    start = np.tile(np.arange(len(first)) << 16, _BLOCK // len(first))
    flat = np.ascontiguousarray(codes).reshape(-1)
    flat = np.append(flat, np.uint8(0)) if flat.size % 2 else flat
    two = flat.view("<u2")
    out = np.empty(len(two), "<u4")
    number = np.empty(len(start), np.intp)
    for begin in range(0, len(two), len(start)):
        part = two[begin : begin + len(start)]
        chosen = number[: len(part)]
        chosen[:] = part
        if len(first) > 1:
            chosen += start[: len(part)]
        np.take(table, chosen, out=out[begin : begin + len(part)], mode="wrap")
    return out.view("<f2")[: codes.size].reshape(codes.shape).astype(np.float16, copy=False)


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
