"""A sky in a lat-long picture: which texel a direction sees, and what it gives a surface.

The illuminance of a normal is the sky's luminance folded with a clamped cosine, which
hardly passes more than the first bands of spherical harmonics (Ramamoorthi and
Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps"). Bands
0, 1, 2 and 4 are kept; band 3 and all other odd ones give nothing. A sky in two halves
is exact. What is left out of a source too small to be resolved is at most 5.9 % of the
lux that it gives a facing surface (9.4 % without band 4), so sources that matter are
taken out first and become lights (``split_suns``). Twin of ``sky.glsl``.

Directions here are in the dome's own axes: the picture's top row is towards +Y, its
middle towards +Z, a quarter of its width from the left towards +X (OpenEXR's lat-long
map, which UsdLux takes over). Pixel edges, not their centres, are the poles and the
seam, as in every texture look-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.units import LUMINANCE_WEIGHTS

Array = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]

#: Coefficients of ``ambient_lux``: 1 + 3 + 5 + 9.
SH_TERMS = 18

#: What a clamped cosine passes of each band, A_l (Ramamoorthi and Hanrahan 2001, eq. 8).
_PASSED = np.repeat([math.pi, 2 * math.pi / 3, math.pi / 4, -math.pi / 24], [1, 3, 5, 9])

#: Factors that make ``sh_polynomials`` orthonormal on the sphere (Sloan 2008, appendix A2).
_BANDS = (
    (1 / 4,),
    (3 / 4, 3 / 4, 3 / 4),
    (15 / 4, 15 / 4, 5 / 16, 15 / 4, 15 / 16),
    (315 / 16, 315 / 32, 45 / 16, 45 / 32, 9 / 256, 45 / 32, 45 / 64, 315 / 32, 315 / 256),
)
_NORMAL = np.sqrt(np.concatenate(_BANDS) / math.pi)

#: A source counts as a sun when it is within this angle and gives this share of what the
#: sky gives a plane on average over all directions that the plane may face.
SUN_RADIUS = math.radians(3.0)
SUN_SHARE = 0.08
_SUNS = 8

#: What is as bright as a tenth of its ring is part of something larger.
_SURROUNDINGS = 0.9


#: Texels are not believed beyond this; the sun's disc has 1.6e9 cd/m2.
BRIGHTEST = 1e12


@dataclass(frozen=True, slots=True)
class Sun:
    """A small bright source of a sky, as a distant light."""

    direction: tuple[float, float, float]  # unit vector towards it
    lux: tuple[float, float, float]  # on a facing plane, per channel
    angle: float  # rad, half the angle that it fills


def sky_direction(uv: Array) -> Doubles:
    """Unit vectors, (..., 3), that texture coordinates (..., 2) show; v is up, in [0, 1]."""
    longitude = math.pi * (1.0 - 2.0 * uv[..., 0])
    latitude = math.pi * (uv[..., 1] - 0.5)
    level = np.cos(latitude)
    parts = [level * np.sin(longitude), np.sin(latitude), level * np.cos(longitude)]
    return np.stack(parts, axis=-1)


def sky_uv(direction: Array) -> Doubles:
    """Texture coordinates, (..., 2), of unit vectors (..., 3); u in [0, 1], v up."""
    x, y, z = direction[..., 0], direction[..., 1], direction[..., 2]
    u = 0.5 - np.arctan2(x, z) / (2.0 * math.pi)
    v = 0.5 + np.arctan2(y, np.hypot(x, z)) / math.pi
    return np.stack([u, v], axis=-1)


def texel_directions(height: int, width: int) -> Doubles:
    """(h, w, 3) unit vectors of the texels' centres, top row first."""
    u = (np.arange(width) + 0.5) / width
    v = 1.0 - (np.arange(height) + 0.5) / height
    return sky_direction(np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1))


def texel_solid_angles(height: int, width: int) -> Doubles:
    """(h, 1) solid angle of a texel of each row, sr; all of them add up to 4 pi."""
    edges = np.cos(np.linspace(0.0, math.pi, height + 1))
    return (edges[:-1] - edges[1:])[:, None] * (2.0 * math.pi / width)


def sound_texels(texels: Array) -> tuple[Array, int]:
    """A sky in which every texel is a luminance, and how many were none.

    What is negative or no number becomes 0, what is infinite or beyond ``BRIGHTEST`` the
    brightest of the others.
    """
    with np.errstate(invalid="ignore"):
        sound = (texels >= 0.0) & (texels <= np.float32(BRIGHTEST))
    if sound.all():
        return texels, 0
    largest = np.max(texels, initial=0.0, where=sound)
    with np.errstate(invalid="ignore"):
        bright = ~sound & (texels > 0.0)
    fixed = np.where(sound, texels, np.where(bright, largest, 0)).astype(texels.dtype)
    return fixed, int(np.count_nonzero(~sound.all(axis=-1)))


def reduced(texels: Array, width: int) -> Doubles:
    """A picture of any size with at most ``width`` columns and half as many rows, float64.

    Means over blocks, rows weighted by their solid angle, so that the flux is kept.
    """
    h, w = texels.shape[:2]
    rows, columns = min(h, max(width // 2, 1)), min(w, width)
    starts = np.arange(columns) * w // columns
    out = np.add.reduceat(texels, starts, axis=1, dtype=np.float64)
    out /= np.diff(starts, append=w)[:, None]
    if rows == h:
        return out
    weights = texel_solid_angles(h, 1)
    starts = np.arange(rows) * h // rows
    total = np.add.reduceat(out * weights[..., None], starts, axis=0)
    return np.asarray(total / np.add.reduceat(weights, starts, axis=0)[..., None])


def split_suns(texels: Doubles) -> tuple[Doubles, list[Sun]]:
    """A sky without its small bright sources, and these: what one loses the other has.

    ``texels`` (h, w, 3), cd/m2 or any unit, is not changed. A source is what stands out
    of its surroundings (a ring of the same width around it); it stays in the sky
    unless its illuminance on a facing plane is a share of the sky's mean one,
    ``SUN_SHARE``. Eight of them at most, the brightest first.
    """
    rest = texels.copy()
    directions = texel_directions(*texels.shape[:2])
    weights = np.broadcast_to(texel_solid_angles(*texels.shape[:2]), texels.shape[:2])
    # Over all directions of a plane its mean illuminance is a quarter of the sky's flux.
    least = SUN_SHARE / 4.0 * float(np.sum((texels @ LUMINANCE_WEIGHTS) * weights))
    suns: list[Sun] = []
    while len(suns) < _SUNS and least > 0.0:
        luminance = rest @ LUMINANCE_WEIGHTS
        peak = np.unravel_index(int(np.argmax(luminance)), luminance.shape)
        cosine = directions @ directions[peak]
        near = cosine >= math.cos(SUN_RADIUS)
        ring = ~near & (cosine >= math.cos(2.0 * SUN_RADIUS))
        if not ring.any():
            break  # too coarse a picture to tell a source from its surroundings
        around = np.quantile(rest[ring], _SURROUNDINGS, axis=0)
        excess = np.maximum(rest[near] - around, 0.0) * weights[near][:, None]
        lux = excess.sum(axis=0)
        if float(lux @ LUMINANCE_WEIGHTS) < least:
            break
        suns.append(_sun(directions[near], excess, lux, weights[near]))
        rest[near] = np.minimum(rest[near], around)
    return rest, suns


def _sun(directions: Doubles, excess: Doubles, lux: Doubles, weights: Doubles) -> Sun:
    """The light of texels: their flux, its middle, and the disc of the same spread."""
    share = excess @ LUMINANCE_WEIGHTS
    middle = share @ directions
    middle /= np.linalg.norm(middle)
    # A disc of half-angle a has a mean square distance of a^2 / 2 from its middle, and a
    # texel of solid angle s one of s / 6, which is no width of the source's.
    square = np.sum((directions - middle) ** 2, axis=-1)
    spread = float(share @ (square - weights / 6.0)) / float(share.sum())
    x, y, z = (float(v) for v in middle)
    r, g, b = (float(v) for v in lux)
    return Sun((x, y, z), (r, g, b), math.sqrt(max(2.0 * spread, 0.0)))


def irradiance_coefficients(texels: Doubles) -> Doubles:
    """(18, 3) for ``ambient_lux``, of a sky (h, w, 3) in cd/m2: lux in the dome's axes."""
    h, w = texels.shape[:2]
    weighted = (texels * texel_solid_angles(h, w)[..., None]).reshape(-1, 3)
    moments = sh_polynomials(texel_directions(h, w).reshape(-1, 3)).T @ weighted
    return np.asarray(moments * (_PASSED * _NORMAL**2)[:, None])


def turned_coefficients(coefficients: Doubles, rotation: Array) -> Doubles:
    """Coefficients (18, 3) in the dome's axes as ones in the world's.

    ``rotation`` (3, 3): the dome's X, Y and Z in the world, row by row. Bands do not mix,
    so values at enough directions give the new ones without loss.
    """
    spiral = np.arange(64) + 0.5
    y = 1.0 - spiral / 32.0
    across, turn = np.sqrt(1.0 - y * y), spiral * (math.pi * (1.0 + math.sqrt(5.0)))
    world = np.stack([across * np.cos(turn), y, across * np.sin(turn)], axis=-1)
    values = sh_polynomials(world @ np.reshape(rotation, (3, 3)).T) @ coefficients
    return np.asarray(np.linalg.lstsq(sh_polynomials(world), values, rcond=None)[0], np.float64)


def sh_polynomials(normal: Array) -> Doubles:
    """(..., 18): bands 0, 1, 2 and 4 of the real spherical harmonics without their factors."""
    x, y, z = normal[..., 0], normal[..., 1], normal[..., 2]
    xx, yy, zz = x * x, y * y, z * z
    terms = [
        np.ones_like(x),
        y,
        z,
        x,
        x * y,
        y * z,
        3 * zz - 1,
        x * z,
        xx - yy,
        x * y * (xx - yy),
        y * z * (3 * xx - yy),
        x * y * (7 * zz - 1),
        y * z * (7 * zz - 3),
        (35 * zz - 30) * zz + 3,
        x * z * (7 * zz - 3),
        (xx - yy) * (7 * zz - 1),
        x * z * (xx - 3 * yy),
        xx * (xx - 3 * yy) - yy * (3 * xx - yy),
    ]
    return np.stack(terms, axis=-1)


def ambient_lux(normal: Array, coefficients: Array) -> Doubles:
    """Illuminance, (..., 3) lux, of surfaces under open sky by their unit normals (..., 3).

    ``coefficients`` (18, 3), in the same axes. Never negative: what the series undershoots
    beside a strong source is 0.
    """
    return np.maximum(sh_polynomials(normal) @ coefficients, 0.0)
