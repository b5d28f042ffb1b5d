"""Node transforms as xform ops: order, animation, shortest arcs, steps; spaces of lights."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_spec, new_stage, node
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pxr import Gf, Usd, UsdGeom

from hdrusd.legacy.scene import TRS, Channel
from hdrusd.usd.transform import (
    aim,
    is_flat,
    last_key,
    matrices,
    rigid,
    uniform_scale,
    write_transform,
)

RATE = 24.0
NUMBERS = st.floats(-10.0, 10.0).map(lambda v: round(v, 3))
QUATERNIONS = (
    st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: tuple((q / np.linalg.norm(q)).tolist()))
)


def written(transform: Any = None, *channels: Channel) -> tuple[UsdGeom.Xform, float]:
    stage = new_stage()
    made = node(transform=transform, animation=channels)
    end = last_key([made])
    write_transform(new_spec(stage, "/Node", "Xform"), made, RATE, end)
    return UsdGeom.Xform.Get(stage, "/Node"), end * RATE


def matrix(form: UsdGeom.Xform, code: float | None = None) -> np.ndarray:
    time = Usd.TimeCode.Default() if code is None else Usd.TimeCode(code)
    return np.array(form.ComputeLocalToWorldTransform(time))


def rotation(xyzw: tuple[float, ...]) -> np.ndarray:
    """(3, 3) row-vector matrix of a unit quaternion, written out."""
    x, y, z, w = xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def about_y(degrees: float, sign: float = 1.0) -> tuple[float, float, float, float]:
    half = math.radians(degrees) / 2
    return (0.0, sign * math.sin(half), 0.0, sign * math.cos(half))


def channel(path: Any, times: Any, values: Any, **more: Any) -> Channel:
    return Channel(path, np.array(times, float), np.array(values, float), **more)


@settings(deadline=None)
@given(st.tuples(*[NUMBERS] * 3), QUATERNIONS, st.tuples(*[NUMBERS] * 3))
def test_scale_then_rotate_then_translate(t: Any, q: Any, s: Any) -> None:
    form, end = written(TRS(t, q, s))
    wanted = np.eye(4)
    wanted[:3, :3] = np.diag(s) @ rotation(q)
    wanted[3, :3] = t
    # USD takes an orientation's half angle by the arc cosine of its real part, which a rounding
    # of 2^-53 moves by as much over the sine; below 2^-26 there is none.
    half_sine = max(float(np.linalg.norm(q[:3])) / float(np.linalg.norm(q)), 2.0**-26)
    rounding = 4.0 * 2.0**-53 / half_sine * max(map(abs, s))
    assert matrix(form) == pytest.approx(wanted, abs=1e-12 + rounding)
    assert end == 0.0


def test_a_matrix_is_kept_as_it_is() -> None:
    sheared = np.array([[1, 0.5, 0, 0], [0, 2, 0, 0], [0, 0, 3, 0], [4, 5, 6, 1.0]])
    assert matrix(written(sheared)[0]) == pytest.approx(sheared, abs=0)


@pytest.mark.parametrize("transform", [None, TRS(), np.eye(4)])
def test_nothing_is_written_for_nothing(transform: Any) -> None:
    assert written(transform)[0].GetOrderedXformOps() == []


def test_seconds_become_time_codes_and_values_are_interpolated() -> None:
    form, end = written(None, channel("translation", [0.0, 2.0], [[0, 0, 0], [10, 0, 4]]))
    assert end == 48.0
    assert matrix(form, 24.0)[3, :3] == pytest.approx([5.0, 0.0, 2.0], abs=1e-12)


def test_what_no_channel_drives_stays() -> None:
    rest = TRS((1.0, 2.0, 3.0), about_y(90.0), (2.0, 2.0, 2.0))
    form, _ = written(rest, channel("translation", [0.0, 1.0], [[0, 0, 0], [8, 0, 0]]))
    wanted = 2.0 * rotation(about_y(90.0))
    assert matrix(form, 12.0)[:3, :3] == pytest.approx(wanted, abs=1e-12)
    assert matrix(form, 12.0)[3, 0] == pytest.approx(4.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rotation_turns_on_the_shortest_arc(sign: float) -> None:
    # q and -q are one rotation; half way between 0 and 90 degrees is 45, whatever the sign.
    turn = channel("rotation", [0.0, 1.0], [about_y(0.0), about_y(90.0, sign)])
    form, _ = written(None, turn)
    assert matrix(form, 12.0)[:3, :3] == pytest.approx(rotation(about_y(45.0)), abs=1e-6)


def test_rotations_are_slerped() -> None:
    turn = channel("rotation", [0.0, 1.0], [about_y(0.0), about_y(120.0)])
    form, _ = written(None, turn)
    # A quarter of the time is a quarter of the angle, which linear interpolation misses by 3.
    assert matrix(form, 6.0)[:3, :3] == pytest.approx(rotation(about_y(30.0)), abs=1e-6)


@pytest.mark.parametrize("length", [1.0, 0.5, 2.0])
def test_joints_turn_as_nodes_do_whatever_the_length_of_a_quaternion(length: float) -> None:
    second = np.multiply(about_y(90.0), length)
    turn = channel("rotation", [0.0, 1.0], [about_y(0.0), second])
    (made,) = matrices(node(animation=(turn,)), np.array([12.0]), RATE, 24.0)
    assert made[:3, :3] == pytest.approx(rotation(about_y(45.0)), abs=1e-12)


def test_a_quaternion_of_no_length_is_no_turn() -> None:
    form, _ = written(TRS(rotation=(0.0, 0.0, 0.0, 0.5)))
    assert matrix(form) == pytest.approx(np.eye(4))
    form, _ = written(None, channel("rotation", [0.0], [[0.0, 0.0, 0.0, 0.0]]))
    assert matrix(form, 0.0) == pytest.approx(np.eye(4))


def test_a_step_holds_until_the_next_key() -> None:
    steps = channel(
        "translation", [0.0, 1.0, 2.0], [[0, 0, 0], [1, 0, 0], [5, 0, 0]], interpolation="step"
    )
    form, end = written(None, steps)
    assert end == 48.0
    for code, wanted in ((0.0, 0), (12.0, 0), (23.9, 0), (24.0, 1), (47.9, 1), (48.0, 5)):
        assert matrix(form, code)[3, 0] == pytest.approx(wanted, abs=1e-9)


def test_steps_that_lie_closer_than_a_step_is_wide() -> None:
    steps = channel(
        "translation", [0.0, 1e-6, 1.0], [[0, 0, 0], [1, 0, 0], [2, 0, 0]], interpolation="step"
    )
    form, _ = written(None, steps)
    assert matrix(form, 0.0)[3, 0] == pytest.approx(0.0)
    assert matrix(form, 12.0)[3, 0] == pytest.approx(1.0)


def test_a_matrix_below_an_animation_is_taken_apart() -> None:
    base = np.eye(4)
    base[:3, :3] = np.diag([1.0, 2.0, 3.0]) @ rotation(about_y(30.0))
    base[3, :3] = (7.0, 8.0, 9.0)
    form, _ = written(base, channel("translation", [0.0, 1.0], [[0, 0, 0], [2, 0, 0]]))
    got = matrix(form, 12.0)
    assert got[:3, :3] == pytest.approx(base[:3, :3], abs=1e-9)
    assert got[3, :3] == pytest.approx([1.0, 0.0, 0.0])


# -- spaces of lights ---------------------------------------------------------------------


VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS).filter(lambda v: np.linalg.norm(v) > 0.1)


@example((0.0, 0.002, 5.0))
@example((1e-9, -2e-9, 1.0))
@example((0.0, 0.0, 1.0))
@example((0.0, 1e-9, -1.0))
@given(VECTORS)
def test_aim_turns_minus_z(direction: tuple[float, float, float]) -> None:
    turn = aim(direction)
    got = Gf.Vec3d(0, 0, -1) if turn is None else Gf.Rotation(turn).TransformDir(Gf.Vec3d(0, 0, -1))
    assert np.array(got) == pytest.approx(direction / np.linalg.norm(direction), abs=1e-9)


@example((3.0, 0.0, 0.001), (3.0, 0.001, 0.001))
@given(VECTORS, VECTORS)
def test_aim_turns_x_to_the_right_as_nearly_as_it_can(direction: Any, right: Any) -> None:
    turn = aim(direction, right)
    move = Gf.Rotation(turn) if turn is not None else Gf.Rotation(Gf.Vec3d(0, 0, 1), 0.0)
    axis = direction / np.linalg.norm(direction)
    assert np.array(move.TransformDir(Gf.Vec3d(0, 0, -1))) == pytest.approx(axis, abs=1e-9)
    part = right - axis * (axis @ right)
    if np.linalg.norm(part) > 1e-5 * np.linalg.norm(right):  # of nearly parallel ones, by rounding
        got = np.array(move.TransformDir(Gf.Vec3d(1, 0, 0)))
        assert got == pytest.approx(part / np.linalg.norm(part), abs=1e-9)


def test_aim_of_nothing_is_none() -> None:
    assert aim((0.0, 0.0, 0.0)) is None
    assert aim((0.0, 0.0, -5.0)) is None


@pytest.mark.parametrize(
    ("scale", "mean", "even"),
    [
        ((2, 2, 2), 2.0, True),
        ((-2, 2, 2), 2.0, True),
        ((1, 2, 4), 2.0, False),
        ((0, 2, 2), 0.0, False),
        ((0, 0, 0), 0.0, False),
    ],
)
def test_uniform_scale(scale: tuple[float, ...], mean: float, even: bool) -> None:
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 2, 3), 40.0))
    world = Gf.Matrix4d().SetScale(Gf.Vec3d(*scale)) * turn
    got = uniform_scale(world)
    # The cube root of a determinant that is 0 but for one rounding of 8: 1e-5.
    assert got[0] == pytest.approx(mean, rel=1e-12, abs=2e-5)
    assert got[1] is even
    assert is_flat(world) is (0 in scale)
    small = world * Gf.Matrix4d().SetScale(1e-6)
    assert is_flat(small) is (0 in scale)


@pytest.mark.parametrize(
    "scale", [(3, 1, 1), (1, 5, 0.2), (-1, 2, 3), (0, 1, 1), (1, 1, 0), (0, 0, 0)]
)
def test_rigid_keeps_the_axis_of_a_skewed_space(scale: tuple[float, ...]) -> None:
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 1, 0), 40.0))
    world = turn * Gf.Matrix4d().SetScale(Gf.Vec3d(*scale))
    world.SetTranslateOnly(Gf.Vec3d(1, 2, 3))
    got = np.array(rigid(world))
    assert got[:3, :3] @ got[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(got[:3, :3]) == pytest.approx(1.0)
    assert got[3, :3].tolist() == [1, 2, 3]
    z = np.array(world)[2, :3]
    if np.linalg.norm(z) > 0:
        assert got[2, :3] == pytest.approx(z / np.linalg.norm(z), abs=1e-12)
