"""The veil that glare paints on a picture: what is painted, and by slow exact means.

Painted is what the viewer's own eye will not add: the scattered light, and not the optical
core of the point spread, through which the viewer looks at the screen anyway. So the kernel is
the point spread with a softened core,

    f_v(theta) = f(sqrt(theta^2 + theta_0^2)),  theta_0 = max(0.1 degrees, 1.2 pixels),

and S, its integral over the hemisphere, is the share of the light that is scattered. A pixel
becomes (1 - S m) L + (f_v * L), m being the part of its own scattered light that stays in the
frame: what leaves the frame comes back from a world that goes on as the pixel is. So a uniform
frame stays uniform up to its edges, and the sum over the frame stays what it was.

Lamps that the picture does not hold, as (n, 6) rows: a unit vector towards them in view space (+x
right, +y up, the line of sight along -z) and what they give at the eye, square to their rays, lx
per channel. Each adds E f_v(theta). They are outside its frame, or so small that its pixels cannot
be trusted. A pixel that shows such a lamp all the same, as luck has it, is a row too: the vector
through it, and per channel minus the share of its luminance, 0 to 1, that is a lamp's. That share
keeps its place in the picture and is not scattered, since the lamp's own row is. Beyond LAST
degrees nothing is added.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hdrusd.errors import HdrusdError
from hdrusd.eye.foveal import directions
from hdrusd.eye.observer import Observer
from hdrusd.glare.model import Array, GlareModel, angle

#: Degrees of theta_0, and the pixels that it is at least.
_CORE, _CORE_PIXELS = 0.1, 1.2

#: Degrees beyond which no light is scattered towards what is seen.
LAST = 100.0

#: Degrees that a perspective picture may be wide or high.
FIELDS = (1e-3, 179.0)

#: A row of lamps: direction, and lx per channel, or minus a pixel's shares.
LAMP = 6


def core(pixel: float) -> float:
    """theta_0 in degrees for pixels of ``pixel`` degrees."""
    return max(_CORE, _CORE_PIXELS * pixel)


def pixel_angle(size: tuple[int, int], field: tuple[float, float]) -> float:
    """Degrees of a pixel in the middle of a picture of (w, h) pixels and ``field`` degrees.

    The root of its area, where it is not square.
    """
    area = math.prod(plane(field)) * 4.0 / math.prod(size)
    return math.degrees(math.sqrt(area))


def plane(field: tuple[float, float]) -> tuple[float, float]:
    """Half the width and height at distance 1 of a field in degrees; raises HdrusdError."""
    low, high = FIELDS
    if not all(low <= a <= high for a in field):
        raise HdrusdError(
            f"field of view: {field[0]:g} x {field[1]:g} degrees; want {low:g} to {high:g}"
        )
    across, down = (math.tan(math.radians(a) / 2.0) for a in field)
    return across, down


def point_spread(model: GlareModel, theta: npt.ArrayLike, observer: Observer) -> Array:
    """sr^-1 at ``theta`` degrees (...); raises HdrusdError for a model without one."""
    if model.psf is None:
        raise HdrusdError(f"glare model {model.name}: has no point spread; want one that has")
    return model.psf(theta, observer)


def kernel(model: GlareModel, observer: Observer, pixel: float, theta: npt.ArrayLike) -> Array:
    """f_v at ``theta`` degrees (...), sr^-1, for pixels of ``pixel`` degrees; 0 beyond LAST."""
    theta = np.asarray(theta, np.float64)
    spread = point_spread(model, np.hypot(theta, core(pixel)), observer)
    return np.where(theta <= LAST, spread, 0.0)


@lru_cache(maxsize=64)
def scattered(model: GlareModel, observer: Observer, pixel: float) -> float:
    """S: the integral of f_v over the hemisphere."""
    # By the logarithm of theta, in which the kernel is smooth: 1e-9 of the integral.
    t = np.geomspace(1e-5, 90.0, 40_001)
    ring = kernel(model, observer, pixel, t) * 2.0 * math.pi * np.sin(np.radians(t))
    return float(np.trapezoid(ring * np.radians(t), np.log(t)))


def pixel_solid_angles(size: tuple[int, int], field: tuple[float, float]) -> Array:
    """Solid angles (h, w), sr, of the pixels of a perspective picture: area cos^3 / f^2."""
    area = 4.0 * math.prod(plane(field)) / math.prod(size)
    return np.asarray(area * np.abs(directions(size, field)[..., 2]) ** 3)


def painted(
    picture: npt.ArrayLike,
    field: tuple[float, float],
    model: GlareModel,
    observer: Observer,
) -> Array:
    """The veiled picture (h, w, c) by FFT: exact for a kernel of distances in the picture.

    ``picture`` in cd/m2. The angle of a distance is the one beside the picture's middle, as is
    the solid angle of a pixel: near the edges of a wide picture this is not what ``seen`` has.
    """
    picture = np.asarray(picture, np.float64)
    height, width = picture.shape[:2]
    pixel = pixel_angle((width, height), field)
    y, x = (np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n)) for n in (height, width))
    r = np.hypot(y[:, None], x[None, :]) * math.radians(pixel)
    weights = kernel(model, observer, pixel, np.degrees(r)) * math.radians(pixel) ** 2
    transform = np.fft.rfft2(weights)

    def convolved(plane: Array) -> Array:
        padded = np.fft.irfft2(np.fft.rfft2(plane, weights.shape) * transform, weights.shape)
        return np.asarray(padded[:height, :width])

    veil = np.stack([convolved(picture[..., k]) for k in range(picture.shape[2])], axis=-1)
    return np.asarray((1.0 - convolved(np.ones((height, width))))[..., None] * picture + veil)


def seen(
    picture: npt.ArrayLike,
    field: tuple[float, float],
    model: GlareModel,
    observer: Observer,
) -> Array:
    """The veiled picture (h, w, c) with the true angle between any two pixels; small ones only.

    Every pixel on every pixel: (w h)^2 numbers are held.
    """
    picture = np.asarray(picture, np.float64)
    height, width, channels = picture.shape
    size = width, height
    rays = directions(size, field).reshape(-1, 3)
    theta = np.degrees(np.arccos(np.clip(rays @ rays.T, -1.0, 1.0)))
    solid = pixel_solid_angles(size, field).ravel()
    weights = kernel(model, observer, pixel_angle(size, field), theta) * solid
    flat = picture.reshape(-1, channels)
    out = (1.0 - weights.sum(axis=1))[:, None] * flat + weights @ flat
    return np.asarray(out.reshape(picture.shape))


def lamp_veil(
    lamps: npt.ArrayLike,
    rays: npt.ArrayLike,
    model: GlareModel,
    observer: Observer,
    pixel: float,
) -> Array:
    """cd/m2 (n, 3) that lamps (k, 6) add in directions (n, 3): the sum of E f_v(theta)."""
    rows, rays = np.asarray(lamps, np.float64).reshape(-1, LAMP), np.asarray(rays, np.float64)
    total = np.zeros((len(rays), 3))
    for row in rows:
        total += kernel(model, observer, pixel, angle(rays, row[:3]))[:, None] * row[3:]
    return total
