"""What tiles look at: cones, cube faces, cascades. NumPy only."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from small_scenes import lights, look

from hdrusd.gpu.cascades import distant_view, view_balls
from hdrusd.gpu.shadow_views import BORDER, frustum_sees, lit_faces, local_view, widest_angle
from hdrusd.scene import CYLINDER, DISK, NO_CONE, Camera, Profile

DOWN = np.array([0.0, 0.0, -1.0])
angles = st.floats(-math.pi, math.pi)


def view(**fields: Any) -> Any:
    (light,) = lights({"axis": (0.0, 0.0, -1.0)} | fields)
    return local_view(light, np.zeros(3), (), samples=16, small=0.1, near=0.001)


def test_faces_that_a_light_can_reach() -> None:
    # +X, -X, +Y, -Y, +Z, -Z; half a space down: all but the upper one.
    assert lit_faces(DOWN, math.pi / 2).tolist() == [True, True, True, True, False, True]
    assert lit_faces(DOWN, math.radians(30)).tolist() == [False] * 5 + [True]
    assert lit_faces(DOWN, NO_CONE).all()
    # A face begins 45 degrees from the axis.
    assert lit_faces(DOWN, math.radians(46)).sum() == 5


@example(-3.03125, 3.03125, 0.05078125)  # a narrow cone between two looked-at directions
@given(angles, angles, st.floats(0.05, 3.2))
def test_no_lit_direction_is_without_a_face(turn: float, tilt: float, angle: float) -> None:
    axis = np.array(
        [math.cos(turn) * math.cos(tilt), math.sin(turn) * math.cos(tilt), math.sin(tilt)]
    )
    directions = np.random.default_rng(3).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lit = directions[directions @ axis > math.cos(min(angle, math.pi))]
    major = np.argmax(np.abs(lit), axis=1)
    faces = 2 * major + (lit[np.arange(len(lit)), major] < 0.0)
    assert lit_faces(axis, angle)[faces].all()


def test_the_angle_of_lights() -> None:
    table = np.ones((2, 3), np.float32)
    narrow = Profile(table, (0.0, 1.0), (0.0, math.radians(60.0)))
    type_b = Profile(table, (0.0, 1.0), (0.0, 0.1), type="B")
    (cone, disk, profiled, other) = lights(
        {"outer": 0.4}, {"shape": DISK}, {"profile": 0}, {"profile": 1}
    )
    found = [widest_angle(light, (narrow, type_b)) for light in (cone, disk, profiled, other)]
    assert found == [0.4, math.pi / 2, math.radians(60.0), NO_CONE]


def test_kinds_by_shape_and_cone() -> None:
    assert view(outer=1.2).kind == "SHADOW_SPOT"
    assert view(outer=1.4).kind == "SHADOW_CUBE"
    tube = view(shape=CYLINDER, x=(1.0, 0.0, 0.0), radius=0.05)
    assert tube.kind == "SHADOW_CUBE SHADOW_TUBE"
    assert len(tube.matrices(64)) == 16 * 6
    assert (
        view(shape=DISK, x=(1.0, 0, 0), y=(0, 1.0, 0), outer=1.0).kind == "SHADOW_SPOT SHADOW_DISK"
    )


def test_a_cone_fills_its_tile() -> None:
    """Its rim lies a border of texels inside; depth is 1 - near / distance."""
    spot = view(outer=0.5, position=(1.0, 2.0, 3.0), radius=0.1)
    (matrix,) = spot.matrices(128)
    turn = np.linspace(0.0, 2 * math.pi, 50)
    rim = [math.tan(0.5) * np.cos(turn), math.tan(0.5) * np.sin(turn), -np.ones(50), np.zeros(50)]
    clip = (7.0 * np.stack(rim, axis=1) + (1.0, 2.0, 3.0, 1.0)) @ matrix
    ends = np.max(np.abs(clip[:, :2] / clip[:, 3:]), axis=0)
    assert ends == pytest.approx([1 - 2 * BORDER / 128] * 2, rel=3e-3)
    assert clip[:, 2] / clip[:, 3] / 2 + 0.5 == pytest.approx(1 - 0.1 / 7.0)


@given(angles, angles, st.floats(0.05, 1.4), st.floats(0.5, 1e4))
def test_balls_hold_their_part_of_the_view(
    turn: float, tilt: float, half: float, reach: float
) -> None:
    at = (math.cos(turn) * math.cos(tilt), math.sin(turn) * math.cos(tilt), math.sin(tilt))
    up = (0.0, 0.0, 1.0) if abs(at[2]) < 0.9 else (1.0, 0.0, 0.0)
    camera = look((0.0, 0.0, 0.0), at, up, half=math.tan(half))
    centres, radii = view_balls(camera, reach)
    ends = reach * np.array([1 / 64, 1 / 16, 1 / 4, 1.0])
    starts = np.concatenate([[0.0], ends[:-1]])
    left, right, bottom, top = camera.window
    rng = np.random.default_rng(4)
    for centre, radius, start, end in zip(centres, radii, starts, ends, strict=True):
        z = rng.uniform(start, end, (100, 1))
        x, y = rng.uniform(left, right, (100, 1)), rng.uniform(bottom, top, (100, 1))
        points = z * (x * camera.right + y * np.array(camera.up) - camera.back)
        assert np.all(np.linalg.norm(points - centre, axis=1) <= radius * (1 + 1e-9))
    # As large whichever way the camera looks.
    assert radii == pytest.approx(view_balls(look(half=math.tan(half)), reach)[1])


@given(st.tuples(*[st.floats(-50, 50)] * 3), st.floats(0.0, 0.1))
def test_maps_of_a_distant_light_hold_what_is_seen(eye: Any, angle: float) -> None:
    (light,) = lights({"position": (0.0, 0.6, 0.8), "w": 0.0, "angle": angle})
    camera = replace(look(eye, tuple(np.add(eye, (1.0, 0.2, -0.1))), (0, 0, 1)), far=100.0)
    bounds = np.array([[-60.0, -60.0, -60.0], [60.0, 60.0, 60.0]])
    seen = distant_view(light, camera, np.zeros(3), bounds, 16)
    centres, radii = view_balls(camera, 100.0)
    for k, matrix in enumerate(seen.matrices(512)):
        i = k % len(radii)
        for direction in np.concatenate([np.eye(3), -np.eye(3)]):
            point = np.append(centres[i] + eye + 0.99 * radii[i] * direction, 1.0)
            assert np.all(np.abs(point @ matrix)[:2] < 0.97)
    # All that casts is between the planes.
    corners = np.array(np.meshgrid(*[(-60.0, 60.0)] * 3)).reshape(3, -1).T
    depths = corners @ seen.frame[2]
    assert seen.depths[0] < depths.min()
    assert seen.depths[1] > depths.max()


def test_an_orthographic_camera_has_one_map() -> None:
    camera = Camera(window=(-4.0, 4.0, -3.0, 3.0), orthographic=True)
    centres, radii = view_balls(camera, 20.0)
    assert centres == pytest.approx(np.array([[0.0, 0.0, -10.0]]))
    assert radii == pytest.approx([math.hypot(5.0, 10.0)])


def test_boxes_in_a_frustum() -> None:
    spot = view(outer=0.5, position=(0.0, 0.0, 10.0))
    boxes = np.array(
        [
            [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)],  # below
            [(0.0, 0.0, 20.0), (1.0, 1.0, 1.0)],  # behind
            [(9.0, 0.0, 0.0), (1.0, 1.0, 1.0)],  # beside
            [(9.0, 0.0, 0.0), (5.0, 1.0, 1.0)],  # reaches in
            [(0.0, 0.0, 0.0), (99.0, 99.0, 99.0)],  # around
        ]
    )
    assert frustum_sees(spot.matrices(64), boxes).tolist() == [[True, False, False, True, True]]
