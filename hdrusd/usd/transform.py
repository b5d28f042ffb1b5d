"""Transforms and node animation as xform ops.

A USD stage has a range and does not repeat what is inside it: an animation that loops is
written as often as it runs until the last one of the scene ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf

from hdrusd.legacy.scene import TRS, Channel, Node
from hdrusd.usd import specs

#: A held value ends this share of a time code before the next sample.
_STEP = 1e-3


#: Samples of one channel; one that loops is repeated no further.
_MOST_SAMPLES = 100_000

Doubles = npt.NDArray[np.float64]

_TYPES = Sdf.ValueTypeNames


def last_key(nodes: Iterable[Node]) -> float:
    """When the last animation of some nodes ends, those that loop once through, s."""
    ends = (float(c.times[-1]) for node in nodes for c in node.animation if len(c.times))
    return max(ends, default=0.0)


def write_transform(
    prim: Sdf.PrimSpec, node: Node, codes_per_second: float, end: float = 0.0
) -> None:
    """Author a node's transform; what loops is repeated until ``end``, s."""
    if node.animation:
        _animate(prim, at_rest(node), node.animation, codes_per_second, end)
        return
    if isinstance(node.transform, TRS):
        _static(prim, node.transform)
    elif node.transform is not None and not np.array_equal(node.transform, np.eye(4)):
        matrix = Gf.Matrix4d(np.asarray(node.transform, np.float64))
        specs.move(prim, "transform", _TYPES.Matrix4d, matrix)


def at_rest(node: Node) -> TRS:
    """What an animated node has where no channel drives it."""
    return node.transform if isinstance(node.transform, TRS) else _decompose(node.transform)


def first_matrix(node: Node) -> Doubles:
    """(4, 4), row vectors, of a node at the first keys of its animation."""
    if not node.animation and not isinstance(node.transform, TRS):
        return np.eye(4) if node.transform is None else np.asarray(node.transform, np.float64)
    trs = at_rest(node)
    values: dict[str, Any] = {
        "translation": trs.translation,
        "rotation": trs.rotation,
        "scale": trs.scale,
    }
    values |= {c.path: tuple(c.values[0].tolist()) for c in node.animation if len(c.times)}
    matrix = np.array(Gf.Matrix3d(_quaternion(values["rotation"])), np.float64)
    made = np.eye(4)
    made[:3, :3] = np.array(values["scale"])[:, None] * matrix
    made[3, :3] = values["translation"]
    return made


def _static(prim: Sdf.PrimSpec, trs: TRS) -> None:
    if any(trs.translation):
        specs.move(prim, "translate", _TYPES.Double3, Gf.Vec3d(*trs.translation))
    if trs.rotation != (0.0, 0.0, 0.0, 1.0):
        specs.move(prim, "orient", _TYPES.Quatd, _quaternion(trs.rotation))
    if trs.scale != (1.0, 1.0, 1.0):
        specs.move(prim, "scale", _TYPES.Double3, Gf.Vec3d(*trs.scale))


def _animate(
    prim: Sdf.PrimSpec, trs: TRS, channels: tuple[Channel, ...], rate: float, end: float
) -> None:
    driven = {channel.path for channel in channels}
    still = {
        "translation": Gf.Vec3d(*trs.translation),
        "rotation": _quaternion(trs.rotation),
        "scale": Gf.Vec3d(*trs.scale),
    }
    ops = {
        part: specs.move(prim, op, kind, None if part in driven else still[part])
        for part, op, kind in (
            ("translation", "translate", _TYPES.Double3),
            ("rotation", "orient", _TYPES.Quatd),
            ("scale", "scale", _TYPES.Double3),
        )
    }
    for channel in channels:
        codes, values = samples(channel, rate, end)
        path, turns = ops[channel.path].path, channel.path == "rotation"
        for code, value in zip(codes.tolist(), values.tolist(), strict=True):
            told = _quaternion(value) if turns else Gf.Vec3d(*value)
            prim.layer.SetTimeSample(path, code, told)


def samples(channel: Channel, rate: float, end: float) -> tuple[Doubles, Doubles]:
    """Time codes (n,) and values (n, 3 or 4) that mean a channel when they are joined by lines.

    A step holds the earlier value until just before the next; what loops goes on until
    ``end``, s, or as far as ``repetitions`` says.
    """
    codes, values = np.round(channel.times * rate, 6), channel.values
    if channel.interpolation == "step" and len(codes) > 1:
        codes, values = _held(codes, values)
    if channel.loop != "none" and len(codes) > 1:
        codes, values = _repeated(codes, values, channel.loop, repetitions(channel, end))
    if channel.path == "rotation":
        values = _shortest_arcs(values)
    return codes, values


def pose(node: Node, codes: Doubles, rate: float, end: float) -> tuple[Doubles, Doubles, Doubles]:
    """Translations (n, 3), rotations (n, 4) x y z w and scales (n, 3) of a node at time codes."""
    trs, count = at_rest(node), len(codes)
    found = {
        "translation": np.tile(trs.translation, (count, 1)),
        "rotation": np.tile(trs.rotation, (count, 1)),
        "scale": np.tile(trs.scale, (count, 1)),
    }
    for channel in node.animation:
        if not len(channel.times):
            continue
        keys, values = samples(channel, rate, end)
        if channel.path == "rotation":
            found["rotation"] = _turned(keys, _units(values), codes)
        else:
            columns = [np.interp(codes, keys, column) for column in values.T]
            found[channel.path] = np.stack(columns, axis=1)
    return found["translation"], _units(found["rotation"]), found["scale"]


def matrices(node: Node, codes: Doubles, rate: float, end: float) -> Doubles:
    """(n, 4, 4), row vectors, of a node at time codes."""
    if not node.animation:
        return np.broadcast_to(first_matrix(node), (len(codes), 4, 4))
    places, turns, scales = pose(node, codes, rate, end)
    x, y, z, w = turns.T
    made = np.zeros((len(codes), 4, 4))
    made[:, 0, :3] = np.stack(
        [w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)], 1
    )
    made[:, 1, :3] = np.stack(
        [2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)], 1
    )
    made[:, 2, :3] = np.stack(
        [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z], 1
    )
    made[:, :3, :3] *= scales[:, :, None]
    made[:, 3, :3], made[:, 3, 3] = places, 1.0
    return made


def _units(turns: Doubles) -> Doubles:
    """Quaternions (n, 4) of length 1; no turn for those of length 0."""
    lengths = np.sqrt((turns * turns).sum(axis=1, keepdims=True))
    there = lengths > 0.0
    return np.where(there, turns / np.where(there, lengths, 1.0), (0.0, 0.0, 0.0, 1.0))


def _turned(keys: Doubles, values: Doubles, codes: Doubles) -> Doubles:
    """(n, 4) on the arcs between quaternions at keys, held before the first and after the last."""
    at = np.clip(codes, keys[0], keys[-1])
    before = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, max(len(keys) - 2, 0))
    after = np.minimum(before + 1, len(keys) - 1)
    gap = keys[after] - keys[before]
    share = np.where(gap > 0.0, (at - keys[before]) / np.where(gap > 0.0, gap, 1.0), 0.0)
    a, b = values[before], values[after]
    angle = np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0))
    sine = np.sin(angle)
    arc = sine > 1e-6
    safe = np.where(arc, sine, 1.0)
    left = np.where(arc, np.sin((1.0 - share) * angle) / safe, 1.0 - share)
    right = np.where(arc, np.sin(share * angle) / safe, share)
    return np.asarray(a * left[:, None] + b * right[:, None])


def _held(codes: Doubles, values: Doubles) -> tuple[Doubles, Doubles]:
    """Each value until just before the next."""
    gaps = np.diff(codes)
    times = np.empty(2 * len(codes) - 1)
    times[0::2] = codes
    times[1::2] = codes[1:] - np.minimum(_STEP, 0.5 * gaps)  # keys may lie closer than a step
    held = np.empty((len(times), values.shape[1]))
    held[0::2], held[1::2] = values, values[:-1]
    return times, held


def repetitions(channel: Channel, end: float) -> int:
    """How often a channel that loops is written: until ``end``, s, and not too often."""
    length = float(channel.times[-1] - channel.times[0]) if len(channel.times) else 0.0
    if channel.loop == "none" or length <= 0.0:
        return 1
    each = len(channel.times) * (2 if channel.interpolation == "step" else 1)
    times = max(math.ceil((end - float(channel.times[0])) / length - 1e-9), 1)
    return min(times, max(_MOST_SAMPLES // each, 1))


def _repeated(codes: Doubles, values: Doubles, loop: str, times: int) -> tuple[Doubles, Doubles]:
    """A piece over and over; every second time backwards where it swings."""
    length = codes[-1] - codes[0]
    number = np.arange(times)
    forth, back = codes - codes[0], (codes[-1] - codes)[::-1]
    swings = loop == "swing"
    offsets = np.where((number % 2 == 1)[:, None] & swings, back, forth)
    all_codes = codes[0] + number[:, None] * length + offsets
    order = np.arange(len(codes))
    orders = np.where((number % 2 == 1)[:, None] & swings, order[::-1], order)
    same = (values[0], -values[0]) if values.shape[1] == 4 else (values[0],)  # of quaternions
    if not swings and not any(np.allclose(v, values[-1], rtol=0.0, atol=1e-9) for v in same):
        # It jumps back: just before the next round it is still at its end.
        all_codes[:-1, -1] -= np.minimum(_STEP, 0.5 * (codes[-1] - codes[-2]))
        return all_codes.ravel(), values[orders].reshape(-1, values.shape[1])
    # The end of a round is the beginning of the next.
    kept = np.ones(all_codes.shape, np.bool_)
    kept[1:, 0] = False
    return all_codes[kept], values[orders[kept]]


def _shortest_arcs(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Quaternions with signs such that neighbours lie on one half of the sphere."""
    dots = np.sum(values[1:] * values[:-1], axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(dots < 0.0, -1.0, 1.0)]))
    return np.asarray(values * signs[:, None])


def _quaternion(xyzw: Sequence[float]) -> Gf.Quatd:
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
    if target.GetLength() == 0.0:
        return None
    x, y, z = target.GetNormalized()
    across_z = math.hypot(x, y)
    if z < 0.0 and across_z <= 1e-12:
        return None
    # 1 + cos and the sine's axis are a quaternion of the shortest turn; Gf.Rotation of two
    # vectors takes those within 0.08 degrees of opposite ones for opposite.
    if z > 0.0 and across_z == 0.0:
        return Gf.Quatd(0.0, 0.0, -1.0, 0.0)
    real = across_z * across_z / (1.0 + z) if z > 0.0 else 1.0 - z
    return Gf.Quatd(real, y, -x, 0.0).GetNormalized()


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
