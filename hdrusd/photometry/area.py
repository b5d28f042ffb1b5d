"""Illuminance from area lights: rectangles, disks, spheres, cylinders that shine by Lambert's law.

Each function gives lux per candela on the light's axis, as ``illuminance`` in light.py does
for a point: E = I f. With luminance L the candela are I = L A, A being the area seen from
the axis: 4 |x cross y| of a rectangle, pi |x cross y| of a disk, pi r^2 of a sphere, 4 |x| r of
a cylinder. Whatever lies below the horizon of the surface gives nothing.

Arrays broadcast; vectors are (..., 3), in metres:

    p     from the surface point to the centre of the light
    n     unit normal of the surface
    axis  unit vector square to a flat light, away from the side that shines
    x, y  half sides of a rectangle, conjugate radii of a disk, half the length of a cylinder

Errors against integration over the light are those of tests/facts/test_area.py. In float32
a term of the contour formula has a few roundings of its own size, which is that of the light
in radians, while their sum is that squared: hence the sum over four points beyond ``FAR``.
Twin of ``area.glsl``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.arc import arc_angle, arc_excess

Array = npt.NDArray[Any]

#: Distance in half diagonals of a light beyond which four points stand for it: the error is
#: below 1e-5 where it is wholly above the horizon.
FAR = 50.0

#: Sides of the polygon that stands for an elliptic disk, and for one that the horizon cuts.
SIDES = 64

#: Nodes and weights on [0, 1] of the quadrature of six points with the weight 1 - s^2 on
#: [-1, 1] (Gauss-Jacobi, alpha = beta = 1): Abramowitz and Stegun 25.4.32, the free nodes of
#: Lobatto's rule of eight points times 1 - s^2.
STRIPS = (0.2092992179024789, 0.5917001814331424, 0.8717401485096066)
STRIP_WEIGHTS = (0.3943905576280672, 0.2216925320225176, 0.0505835770160819)


def dot(a: Array, b: Array) -> Array:
    """Scalar product along the last axis."""
    return np.asarray(np.sum(np.asarray(a) * b, axis=-1))


def seen_part(first: Array, last: Array) -> Array:
    """Which part of a straight line is above the horizon: (..., 2) in [0, 1], from and to.

    ``first``, ``last``: heights of its ends; both 0 where all of it is below.
    """
    first, last = np.asarray(first), np.asarray(last)
    cut = first / np.where(first == last, 1.0, first - last)
    start = np.where(first < 0.0, cut, 0.0)
    end = np.where(last < 0.0, cut, 1.0)
    seen = (first >= 0.0) | (last >= 0.0)
    return np.where(seen[..., None], np.clip(np.stack([start, end], axis=-1), 0.0, 1.0), 0.0)


def edge_term(start: Array, edge: Array, n: Array, part: Array) -> Array:
    """One edge of Lambert's formula (1760, Photometria): its angle times cos of its plane to n.

    ``start``: vector to its first end; ``edge``: to the other end from there; ``part`` of it
    that counts. Half the sum over a closed outline is the illuminance per cd/m2.
    """
    part = np.asarray(part)
    turn = np.cross(start, edge)
    size = np.sqrt(dot(turn, turn))
    a = start + part[..., :1] * edge
    b = start + part[..., 1:] * edge
    angle = arc_angle(size * (part[..., 1] - part[..., 0]), dot(a, b))
    return np.asarray(dot(n, turn) / np.maximum(size, 1e-30) * angle)


def four_points(p: Array, n: Array, x: Array, y: Array) -> Array:
    """Mean over p +- x +- y of cos(theta) / d^3, horizon included: 1/m3."""
    total: Any = 0.0
    for offset in (x + y, x - y, y - x, -x - y):
        v = p + offset
        total = total + np.maximum(dot(n, v), 0.0) / np.square(np.maximum(dot(v, v), 1e-12))
    return np.asarray(0.25 * total)


def rect_illuminance(p: Array, n: Array, axis: Array, x: Array, y: Array) -> Array:
    """Lux per candela of a one-sided parallelogram with the half sides x and y. Exact.

    Lambert's formula for its outline, cut at the horizon: what is cut off is replaced by
    the line along the horizon from where the outline goes below to where it comes back.
    """
    height = -dot(axis, p)
    size = np.cross(x, y)
    total: Any = 0.0
    low = high = np.zeros(np.broadcast_shapes(np.shape(p), np.shape(n)))
    corner, edge, following = -x - y, 2.0 * x, 2.0 * y
    for _ in range(4):
        first, last = dot(n, p + corner), dot(n, p + corner + edge)
        part = seen_part(first, last)
        total = total + edge_term(p + corner, edge, n, part)
        down = (first >= 0.0) & (last < 0.0)
        up = (first < 0.0) & (last >= 0.0)
        low = low + np.where(down[..., None], corner + part[..., 1:] * edge, 0.0)
        high = high + np.where(up[..., None], corner + part[..., :1] * edge, 0.0)
        corner, edge, following = corner + edge, following, -edge
    total = total + edge_term(p + low, high - low, n, np.array([0.0, 1.0]))
    near = np.abs(total) / np.maximum(8.0 * np.sqrt(dot(size, size)), 1e-30)
    far = height * four_points(p, n, x / np.sqrt(3.0), y / np.sqrt(3.0))
    beyond = dot(p, p) > FAR * FAR * (dot(x, x) + dot(y, y))
    return np.asarray(np.where(height > 0.0, np.where(beyond, far, near), 0.0))


def disk_illuminance(p: Array, n: Array, axis: Array, x: Array, y: Array) -> Array:
    """Lux per candela of a one-sided disk with the conjugate radii x and y.

    Exact for a circle wholly above the horizon: Lambert's contour integral of it is
    elementary. An ellipse, and what the horizon cuts, is a polygon of ``SIDES`` sides and
    the same area.
    """
    height = -dot(axis, p)
    r2, other = dot(x, x), dot(y, y)
    near = dot(p, p) <= FAR * FAR * (r2 + other)
    level = dot(n, p)
    reach = np.sqrt(np.square(dot(n, x)) + np.square(dot(n, y)))
    whole = level >= reach
    # Rounding of the radii must not make an ellipse.
    circle = (np.abs(r2 - other) <= 1e-4 * r2) & (np.abs(dot(x, y)) <= 1e-4 * r2)
    exact = circle_illuminance(p, n, axis, r2)
    polygon = ellipse_illuminance(p, n, x, y)
    far = height * four_points(p, n, 0.5 * x, 0.5 * y)
    cut = np.where(near, polygon, far)
    lux = np.where(circle & whole, exact, np.where(level <= -reach, 0.0, cut))
    return np.asarray(np.where(height > 0.0, lux, 0.0))


def circle_illuminance(p: Array, n: Array, axis: Array, r2: Array) -> Array:
    """Lux per candela of a circular disk of radius^2 ``r2`` that is wholly above the horizon.

    With h the height over its plane, q the way from its axis, S = h^2 + q^2 + r^2 and
    D^2 = S^2 - 4 q^2 r^2, the contour integral over the angle, int dw / (S + 2 q r cos w) and
    its like, gives E = L pi r^2 (n_z (D + S - 2 q^2) + 2 h n_q q) / (D (D + S)): for a parallel
    disk Foote's formula (1915, Bull. Bur. Stand. 12). D + S - 2 q^2 = 4 q^2 h^2 / (D + q^2 -
    h^2 - r^2), so nothing cancels however far it is. All squares are shares of S, whose own
    square overflows float32 where it is 4e9 m away.
    """
    height = -dot(axis, p)
    side = p + height[..., None] * axis
    h2, q2 = height * height, dot(side, side)
    s = np.maximum(h2 + q2 + r2, 1e-30)
    h2, q2 = h2 / s, q2 / s
    b = q2 - h2 - r2 / s
    d = np.sqrt(np.maximum(b * b + 4.0 * q2 * h2, 1e-30))
    w = np.where(b > 0.0, 4.0 * q2 * h2 / (d + np.abs(b)), d - b)
    across = 2.0 * height * (dot(n, side) / s)
    return np.asarray(np.maximum(across - dot(n, axis) * w, 0.0) / (d * (d + 1.0) * s))


def ellipse_illuminance(p: Array, n: Array, x: Array, y: Array) -> Array:
    """Lux per candela of the polygon of ``SIDES`` sides that has the area of an elliptic disk."""
    step = 2.0 * np.pi / SIDES
    cos, sin = np.cos(step), np.sin(step)
    fit = np.sqrt(step / sin)
    size = np.cross(x, y)
    total: Any = 0.0
    low = high = np.zeros(np.broadcast_shapes(np.shape(p), np.shape(n)))
    corner, quarter = fit * x, fit * y
    first = dot(n, p + corner)
    for _ in range(SIDES):
        following = cos * corner + sin * quarter
        quarter = cos * quarter - sin * corner
        edge = following - corner
        last = dot(n, p + following)
        part = seen_part(first, last)
        total = total + edge_term(p + corner, edge, n, part)
        down = (first >= 0.0) & (last < 0.0)
        up = (first < 0.0) & (last >= 0.0)
        low = low + np.where(down[..., None], corner + part[..., 1:] * edge, 0.0)
        high = high + np.where(up[..., None], corner + part[..., :1] * edge, 0.0)
        corner, first = following, last
    total = total + edge_term(p + low, high - low, n, np.array([0.0, 1.0]))
    return np.asarray(np.abs(total) / np.maximum(2.0 * np.pi * np.sqrt(dot(size, size)), 1e-30))


def sphere_illuminance(p: Array, n: Array, radius: Array) -> Array:
    """Lux per candela of a sphere. Exact; inside it, as on its surface.

    cos(theta) / d^2 where it is wholly above the horizon; else Snyder's formula (1996, Area
    Light Sources for Real-Time Graphics, MSR-TR-96-11), with t = tan(s) sin(theta) sqrt(1 - y^2),
    sin(s) = r/d, y = -cot(s) cot(theta), written so that a small sphere does not cancel:
    E = L (sin^2(s) (cos(theta) arccos(y) + t) + arctan(t) - t).
    A distant light of half angle a is a sphere of radius sin(a) in the distance 1.
    """
    r2 = np.maximum(np.square(radius), 1e-20)
    d2 = np.maximum(dot(p, p), r2 * 1.000001)
    length = np.sqrt(np.maximum(dot(p, p), 1e-20))
    cosine = np.clip(dot(n, p) / length, -1.0, 1.0)
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 1e-12))
    sin2 = r2 / d2
    tan = np.sqrt(r2 / (d2 - r2))
    y = np.clip(-cosine / (sine * tan), -1.0, 1.0)
    t = tan * sine * np.sqrt(np.maximum(1.0 - y * y, 0.0))
    cut = sin2 * (cosine * arc_angle(np.sqrt(np.maximum(1.0 - y * y, 0.0)), y) + t) + arc_excess(t)
    whole = cosine * cosine >= sin2
    lux = np.where(whole, np.maximum(cosine, 0.0), np.maximum(cut, 0.0) / (np.pi * sin2))
    return np.asarray(lux / d2)


def line_mean(p: Array, n: Array, x: Array) -> Array:
    """Mean over a straight line of cos(theta) / d^3, horizon included: 1/m3.

    ``p``: to its middle, ``x``: half its length. With D the distance from the line and w
    along it, int (A + B w) / (D^2 + w^2)^2 dw in closed form (as Heitz and Hill 2017,
    Real-Time Line- and Disk-Light Shading with LTC).
    """
    half = np.sqrt(np.maximum(dot(x, x), 1e-30))
    along = x / half[..., None]
    middle = dot(p, along)
    across = p - middle[..., None] * along
    square = np.maximum(dot(across, across), 1e-12)
    distance = np.sqrt(square)
    a, b = dot(n, across), dot(n, along)
    part = seen_part(a + b * (middle - half), a + b * (middle + half))
    length = 2.0 * half * (part[..., 1] - part[..., 0])
    start = middle - half + 2.0 * half * part[..., 0]
    end = start + length
    ends = (square + start * start) * (square + end * end)
    angle = arc_angle(distance * length, square + start * end)
    near = a / (2.0 * square) * (length * (square - start * end) / ends + angle / distance)
    near = near + 0.5 * b * length * (start + end) / ends
    far: Any = 0.0
    for sign in (-1.0, 1.0):
        v = p + sign / np.sqrt(3.0) * x
        far = far + 0.5 * np.maximum(dot(n, v), 0.0) / np.square(np.maximum(dot(v, v), 1e-12))
    beyond = dot(p, p) > FAR * FAR * half * half
    return np.asarray(np.where(beyond, far, np.maximum(near, 0.0) / (2.0 * half)))


def cylinder_illuminance(p: Array, n: Array, x: Array, radius: Array) -> Array:
    """Lux per candela (square to it) of the side of a cylinder of half length x; dark ends.

    Strips along it, of which ``line_mean`` is exact, by Gauss' quadrature over those that
    face the point. With f the angle of a strip from the point's direction, seen up to
    cos(f0) = r / rho, and t = tan(f / 2), E = L r int (rho cos(f) - r) int cos / d^3, where
    rho cos(f) - r = (rho + r) (t0^2 - t^2) / (1 + t^2). Near to the surface the strips
    lie closer together where it is nearest: t = t0 s c / (1 - (1 - c) s^2), and c = ((rho^2 -
    r^2) / (rho^2 - r^2 + 4 rho r))^(3/8) was found by trial. Error as a share of the
    light, or of a fifth of what faces it: 1 % from 2 r on, 2 % at 1.5 r, 5 % at 1.1 r from the
    axis. Nothing in front of the ends or inside.
    """
    half2 = np.maximum(dot(x, x), 1e-30)
    across = p - (dot(p, x) / half2)[..., None] * x
    rho = np.sqrt(np.maximum(dot(across, across), 1e-20))
    above = np.maximum(rho - radius, 0.0)
    far = above * (rho + radius)
    root = np.sqrt(far / (far + 4.0 * rho * radius))
    c = np.sqrt(root * np.sqrt(root))
    t0 = np.sqrt(above / (rho + radius))
    out = -across / rho[..., None]
    side = np.cross(x / np.sqrt(half2)[..., None], out)
    total: Any = 0.0
    for node, weight in zip(STRIPS, STRIP_WEIGHTS, strict=True):
        bent = (1.0 - c) * node
        q = 1.0 - bent * node
        t = t0 * node * c / q
        whole = 1.0 + t * t
        cos, sin = (1.0 - t * t) / whole, 2.0 * t / whole
        share = weight * (1.0 + bent * node) * (1.0 - bent * bent) / np.square(q * q * whole)
        for sign in (-1.0, 1.0):
            turned = cos[..., None] * out + (sign * sin)[..., None] * side
            total = total + share * line_mean(p + np.asarray(radius)[..., None] * turned, n, x)
    return np.asarray((rho + radius) * t0**3 * c * total)
