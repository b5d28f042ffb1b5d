"""Transforms and node animation as xform ops."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from pxr import Gf, Usd, UsdGeom

from hdrusd.legacy.scene import TRS, Channel, Node

#: A held value ends this share of a time code before the next sample.
_STEP = 1e-3


def write_transform(prim: UsdGeom.Xformable, node: Node, codes_per_second: float) -> float | None:
    """Author a node's transform; returns its last time code when it is animated."""
    if node.animation:
        trs = node.transform if isinstance(node.transform, TRS) else _decompose(node.transform)
        return _animate(prim, trs, node.animation, codes_per_second)
    if isinstance(node.transform, TRS):
        _static(prim, node.transform)
    elif node.transform is not None and not np.array_equal(node.transform, np.eye(4)):
        prim.AddTransformOp().Set(Gf.Matrix4d(np.asarray(node.transform, np.float64)))
    return None


def _static(prim: UsdGeom.Xformable, trs: TRS) -> None:
    if any(trs.translation):
        prim.AddTranslateOp().Set(Gf.Vec3d(*trs.translation))
    if trs.rotation != (0.0, 0.0, 0.0, 1.0):
        prim.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(_quaternion(trs.rotation))
    if trs.scale != (1.0, 1.0, 1.0):
        prim.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*trs.scale))


def _animate(
    prim: UsdGeom.Xformable, trs: TRS, channels: tuple[Channel, ...], rate: float
) -> float:
    ops = {
        "translation": prim.AddTranslateOp(),
        "rotation": prim.AddOrientOp(UsdGeom.XformOp.PrecisionDouble),
        "scale": prim.AddScaleOp(UsdGeom.XformOp.PrecisionDouble),
    }
    driven = {channel.path for channel in channels}
    if "translation" not in driven:
        ops["translation"].Set(Gf.Vec3d(*trs.translation))
    if "rotation" not in driven:
        ops["rotation"].Set(_quaternion(trs.rotation))
    if "scale" not in driven:
        ops["scale"].Set(Gf.Vec3d(*trs.scale))
    last = 0.0
    for channel in channels:
        values = channel.values
        if channel.path == "rotation":
            values = _shortest_arcs(values)
        for code, value in _samples(channel, values, rate):
            ops[channel.path].Set(
                _quaternion(value) if channel.path == "rotation" else Gf.Vec3d(*value),
                Usd.TimeCode(code),
            )
            last = max(last, code)
    return last


def _samples(
    channel: Channel, values: npt.NDArray[np.float64], rate: float
) -> list[tuple[float, tuple[float, ...]]]:
    """Time codes and values; a step holds the earlier value until just before the next."""
    codes = channel.times * rate
    samples: list[tuple[float, tuple[float, ...]]] = []
    for index, (code, value) in enumerate(zip(codes, values, strict=True)):
        if channel.interpolation == "step" and index:
            held = tuple(float(v) for v in values[index - 1])
            # Keys may lie closer than the step is wide.
            step = min(_STEP, 0.5 * float(code - codes[index - 1]))
            samples.append((float(code) - step, held))
        samples.append((round(float(code), 6), tuple(float(v) for v in value)))
    return samples


def _shortest_arcs(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Quaternions with signs such that neighbours lie on one half of the sphere."""
    dots = np.sum(values[1:] * values[:-1], axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(dots < 0.0, -1.0, 1.0)]))
    return np.asarray(values * signs[:, None])


def _quaternion(xyzw: tuple[float, ...]) -> Gf.Quatd:
    x, y, z, w = (float(v) for v in xyzw)
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not length > 0.0:
        return Gf.Quatd(1.0)
    return Gf.Quatd(w / length, Gf.Vec3d(x, y, z) / length)


def _decompose(matrix: npt.NDArray[np.float64] | None) -> TRS:
    """A matrix as TRS for an animated node; shear is lost (readers give TRS where they can)."""
    if matrix is None:
        return TRS()
    m = Gf.Transform(Gf.Matrix4d(np.asarray(matrix, np.float64)))
    t, q, s = m.GetTranslation(), m.GetRotation().GetQuat(), m.GetScale()
    i = q.GetImaginary()
    return TRS((t[0], t[1], t[2]), (i[0], i[1], i[2], q.GetReal()), (s[0], s[1], s[2]))


def aim(
    direction: tuple[float, float, float], right: tuple[float, float, float] | None = None
) -> Gf.Quatd | None:
    """The rotation that turns -Z into ``direction``; None when it is -Z already.

    ``right``: where +X goes, as nearly as it can; without it, or along ``direction``, by
    the shortest turn.
    """
    target = Gf.Vec3d(*direction)
    side = None if right is None else across(right, direction)
    if side is not None:
        back = -target.GetNormalized()
        turn = Gf.Matrix3d(*side, *Gf.Cross(back, side), *back)
        return turn.ExtractRotation().GetQuat()
    if target.GetLength() == 0.0 or Gf.IsClose(target.GetNormalized(), Gf.Vec3d(0, 0, -1), 1e-12):
        return None
    return Gf.Rotation(Gf.Vec3d(0, 0, -1), target).GetQuat()


def across(vector: tuple[float, float, float], axis: tuple[float, float, float]) -> Gf.Vec3d | None:
    """The part of a vector across an axis, of length 1; None where there is none."""
    if not any(vector) or not any(axis):
        return None
    way, pole = Gf.Vec3d(*vector).GetNormalized(), Gf.Vec3d(*axis).GetNormalized()
    part = way - pole * Gf.Dot(way, pole)
    return part.GetNormalized() if part.GetLength() > 1e-6 else None


def uniform_scale(world: Gf.Matrix4d) -> tuple[float, bool]:
    """(mean scale, whether it is the same in all directions) of a local to world matrix."""
    values = np.linalg.svd(np.array(world, np.float64)[:3, :3], compute_uv=False)
    mean = float(np.prod(values)) ** (1.0 / 3.0)
    return mean, bool(mean > 0.0 and values[0] - values[-1] <= 1e-6 * values[0])


def is_flat(world: Gf.Matrix4d) -> bool:
    """Whether a matrix squeezes space into a plane, a line or a point, but for rounding."""
    values = np.linalg.svd(np.array(world, np.float64)[:3, :3], compute_uv=False)
    return bool(values[-1] <= 1e-12 * values[0])


def rigid(world: Gf.Matrix4d) -> Gf.Matrix4d:
    """The matrix without scale and shear: where a thing is and which way it looks.

    Its -Z axis is exactly that of ``world``, as a light's must be; the turn about it
    is as near as a right angle allows.
    """
    x, y, z = (Gf.Vec3d(world.GetRow3(row)) for row in range(3))
    z = z.GetNormalized() if z.GetLength() > 0.0 else Gf.Vec3d(0.0, 0.0, 1.0)
    side = x - z * Gf.Dot(x, z)
    if side.GetLength() <= 1e-9 * x.GetLength():
        side = Gf.Cross(y, z)
    if side.GetLength() == 0.0:
        side = Gf.Cross(z, Gf.Vec3d(0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else Gf.Vec3d(1.0, 0.0, 0.0))
    side.Normalize()
    turn = Gf.Matrix3d(*side, *Gf.Cross(z, side), *z)
    return Gf.Matrix4d(turn, world.ExtractTranslation())
