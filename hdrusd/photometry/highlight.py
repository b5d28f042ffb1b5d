"""Highlights of area lights by a representative point.

Luminance of a highlight = f(l) E g: the lobe f of the surface towards the point of the light
that is nearest to the reflected ray (Karis 2013, Real Shading in Unreal Engine 4), the
exact illuminance E of area.py, and ``highlight_share`` g. It holds the share w by which the
light widens the lobe. Karis adds half the light's angle to alpha, which loses half of the
highlight where both are equal. Here their squares add, as variances do, each direction for
itself: half sides or radii x, y of the light move the half vector h by u and by z,
u = (I - h h^T) x / (d |l + v|), and

    w = alpha^2 / sqrt(det(alpha^2 I + k (u u^T + z z^T)))
      = 1 / sqrt(1 + k (u^2 + z^2) / alpha^2 + k^2 |u x z|^2 / alpha^4)

with k = 1 for an ellipse and 4/pi for straight sides, so that a mirror shows the light's own
luminance. Error against integration of the GGX lobe, alpha from 0.01 to 1, lights of up to 1
rad across, N.V from 1 to 0.4 (tests/facts/test_highlight.py): where the reflected ray meets
the middle of the light 20 %, beside it at most 60 % of that peak. Blinn's and Phong's lobe of
the exponent n counts as alpha^2 = 2 / (n + 2). A distant light of half angle a is a sphere of
the radius sin(a) in the distance 1.

Twin of ``highlight.glsl``. Vectors (..., 3), in metres; p from the surface to the centre of
the light, r the reflected ray and v the way to the eye (unit), the rest as in area.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.area import dot

Array = npt.NDArray[Any]

#: k of lights with straight sides.
STRAIGHT = 4.0 / np.pi


def plane_offset(p: Array, r: Array, axis: Array) -> Array:
    """From the centre of a flat light to where the ray meets its plane; far off where it does not.

    A ray that leaves the plane meets it nowhere: then the point of it that is far away counts.
    """
    towards = -dot(r, axis)
    distance = np.sqrt(dot(p, p))
    far = 1e3 * distance
    way = np.where(towards > 1e-6, -dot(p, axis) / np.maximum(towards, 1e-6), far)
    return np.asarray(r * np.clip(way, 0.0, far)[..., None] - p)


def plane_coordinates(q: Array, x: Array, y: Array) -> Array:
    """(..., 2) a and b of the point a x + b y of a plane that is nearest to q."""
    xx, xy, yy = dot(x, x), dot(x, y), dot(y, y)
    qx, qy = dot(q, x), dot(q, y)
    scale = 1.0 / np.maximum(xx * yy - xy * xy, 1e-30)
    return np.stack([(qx * yy - qy * xy) * scale, (qy * xx - qx * xy) * scale], axis=-1)


def rect_point(p: Array, r: Array, axis: Array, x: Array, y: Array) -> Array:
    """To the representative point of a parallelogram."""
    at = np.clip(plane_coordinates(plane_offset(p, r, axis), x, y), -1.0, 1.0)
    return np.asarray(p + at[..., :1] * x + at[..., 1:] * y)


def disk_point(p: Array, r: Array, axis: Array, x: Array, y: Array) -> Array:
    """To that of a disk."""
    at = plane_coordinates(plane_offset(p, r, axis), x, y)
    at = at / np.sqrt(np.maximum(dot(at, at), 1.0))[..., None]
    return np.asarray(p + at[..., :1] * x + at[..., 1:] * y)


def sphere_point(p: Array, r: Array, radius: Array) -> Array:
    """To that of a sphere: from its centre at most the radius towards the ray."""
    beside = r * np.maximum(dot(p, r), 0.0)[..., None] - p
    share = radius / np.sqrt(np.maximum(dot(beside, beside), 1e-20))
    return np.asarray(p + beside * np.minimum(share, 1.0)[..., None])


def cylinder_point(p: Array, r: Array, x: Array, radius: Array) -> Array:
    """To that of a cylinder: on its axis nearest to the ray, then as for a sphere."""
    along, across = dot(r, x), np.maximum(dot(x, x), 1e-20)
    bend = np.maximum(across - along * along, 1e-6 * across)
    at = np.clip((dot(r, p) * along - dot(p, x)) / bend, -1.0, 1.0)
    return sphere_point(p + at[..., None] * x, r, radius)


def spread(p: Array, v: Array, x: Array, y: Array) -> Array:
    """(..., 2) u^2 + z^2 and |u x z|^2 of a flat light; y of a cylinder is its radius, across."""
    inverse = 1.0 / np.sqrt(np.maximum(dot(p, p), 1e-20))
    way = p * inverse[..., None]
    both = way + v
    size2 = np.maximum(dot(both, both), 1e-6)
    u, z = x - way * dot(x, way)[..., None], y - way * dot(y, way)[..., None]
    u = u - both * (dot(u, both) / size2)[..., None]
    z = z - both * (dot(z, both) / size2)[..., None]
    scale = inverse * inverse / size2
    turn = np.cross(u, z) * scale[..., None]
    return np.stack([(dot(u, u) + dot(z, z)) * scale, dot(turn, turn)], axis=-1)


def sphere_spread(p: Array, v: Array, radius: Array) -> Array:
    """The same of a sphere."""
    d2 = np.maximum(dot(p, p), np.maximum(np.square(radius), 1e-20))
    both = p / np.sqrt(np.maximum(dot(p, p), 1e-20))[..., None] + v
    # 4 cos^2 of the angle between v and h.
    size2 = np.maximum(dot(both, both), 1e-6)
    angle2 = np.square(radius) / d2
    return np.stack([angle2 * (0.25 + 1.0 / size2), 0.25 * angle2 * angle2 / size2], axis=-1)


def lobe_share(area: Array, k: float, alpha2: Array) -> Array:
    """w: by what a lobe of alpha^2 is lower, for what ``spread`` gives."""
    first, second = k * area[..., 0], k * k * area[..., 1]
    return np.asarray(1.0 / np.sqrt(1.0 + (first + second / alpha2) / alpha2))


def highlight_share(share: Array, nl: Array, middle: Array) -> Array:
    """G from w: the narrower the lobe, the more the representative point's cosine counts.

    ``nl``: N.L of the representative point, ``middle``: of the light's centre, in which E is.
    """
    raised = np.clip(np.maximum(nl, 0.0) / np.maximum(middle, 1e-3), 0.0, 4.0)
    return np.asarray(share * (1.0 + (raised - 1.0) * (1.0 - share)))


def blinn_alpha2(shininess: Array) -> Array:
    """alpha^2 of the GGX lobe that is as wide as Blinn's and Phong's of this exponent."""
    return np.asarray(2.0 / (np.asarray(shininess) + 2.0))
