"""What a UsdLux light is in space: ``shape_row`` fills the shape of a ``scene.LIGHT`` row.

A rectangle or disk under any transform is a parallelogram or an ellipse in the world, and
shines square to its plane on the side of the light's -Z, also where a shear leans that axis.
A stretched sphere shines as the ball of equal volume, a stretched or sheared cylinder as the
one of equal cross-section: a finding. ``treatAsPoint`` makes a sphere a point that is not
seen; ``treatAsLine`` changes nothing, since the cylinder costs no more than a line.

A rectangle or disk without area, which ``normalize`` gives candela all the same, is a point
that shines by Lambert's cosine; a sphere without radius and a cylinder without length are points.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from pxr import Gf, Usd

from hdrusd.scene import CYLINDER, DISK, NO_CONE, RECT, SPHERE
from hdrusd.usd.lux import input_number, light_kind

Vector = npt.NDArray[np.float64]

#: How far a transform may be from the same scale in all directions, relative.
_ROUND = 1e-3


def shape_row(
    prim: Usd.Prim,
    row: npt.NDArray[np.void],
    world: Gf.Matrix4d,
    meters_per_unit: float,
    time: Usd.TimeCode,
) -> str:
    """Shape, axis, x and y of the (1,) row of a light, whose radius is known already.

    Returns what is not as it should be, "" for nothing.
    """
    kind = light_kind(prim)
    x, y, z = np.array(world, np.float64)[:3, :3] * meters_per_unit
    row["axis"], row["x"], row["y"] = _frame(x, y, z)
    row["outer"] = row["inner"] = NO_CONE
    if kind == "distant":
        return ""
    if kind == "sphere":
        point = prim.GetAttribute("treatAsPoint").Get(time) is True
        if point or not row["radius"][0] > 0.0:
            return ""
        row["shape"] = SPHERE
        return "" if _conformal(x, y, z) else "stretched; it shines as the ball of equal volume"
    if kind == "cylinder":
        x = x * input_number(prim, "length", time) / 2.0
        if not np.linalg.norm(x) > 0.0:
            return ""
        row["shape"], row["x"] = CYLINDER, x
        round_ = _conformal(y, z) and max(abs(_cosine(x, y)), abs(_cosine(x, z))) <= _ROUND
        text = "stretched or sheared; it shines as the cylinder of equal cross-section"
        return "" if round_ else text
    radius = input_number(prim, "radius", time) if kind == "disk" else 0.0
    width, height = (
        (2.0 * radius, 2.0 * radius)
        if kind == "disk"
        else (input_number(prim, "width", time), input_number(prim, "height", time))
    )
    x, y = x * width / 2.0, y * height / 2.0
    normal = np.cross(x, y)
    size = float(np.linalg.norm(normal))
    if size == 0.0:
        row["exponent"], row["outer"], row["inner"] = 1.0, math.pi / 2, math.pi / 2
        return ""
    row["shape"], row["x"], row["y"] = (DISK if kind == "disk" else RECT), x, y
    row["axis"] = normal / size * (-1.0 if normal @ z > 0.0 else 1.0)
    return ""


def _frame(x: Vector, y: Vector, z: Vector) -> tuple[Vector, Vector, Vector]:
    """Unit axis, and +X and +Y as near to square as a shear allows; mirrored where the light is."""
    axis = -_unit(z)
    across = _unit(x - axis * (x @ axis))
    up = y - axis * (y @ axis)
    return axis, across, _unit(up - across * (up @ across))


def _unit(v: Vector) -> Vector:
    return np.asarray(v / max(float(np.linalg.norm(v)), 1e-300))


def _cosine(a: Vector, b: Vector) -> float:
    return float(_unit(a) @ _unit(b))


def _conformal(*sides: Vector) -> bool:
    """Whether vectors have one length and are square to one another, but for ``_ROUND``."""
    gram = np.array([[a @ b for b in sides] for a in sides])
    mean = float(np.trace(gram)) / len(sides)
    return bool(np.abs(gram - mean * np.eye(len(sides))).max() <= _ROUND * mean)
