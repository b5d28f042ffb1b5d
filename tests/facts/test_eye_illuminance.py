"""Lux that lamps beside the frame give at the eye: E = I / d^2 in the way they shine."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders import light_row

from hdrusd.photometry.eye_illuminance import eye_illuminance, in_frame
from hdrusd.photometry.shading import shade
from hdrusd.scene import CYLINDER, DISK, RECT, SPHERE, Camera, Profile, RenderScene

#: A window of 90 degrees each way, from 2 m above the origin along -z.
CAMERA = Camera(eye=(0.0, 2.0, 0.0), window=(-1.0, 1.0, -1.0, 1.0))


def rows(*lights: Any, camera: Camera = CAMERA, profiles: tuple[Profile, ...] = ()) -> np.ndarray:
    return eye_illuminance(
        RenderScene(lights=np.concatenate(lights), camera=camera, profiles=profiles)
    )


def at(*position: float, **changes: Any) -> Any:
    return light_row((1000.0, 800.0, 500.0), position=position, **changes)


def test_a_thousand_candela_at_ten_metres() -> None:
    (row,) = rows(at(10.0, 2.0, 0.0))
    np.testing.assert_allclose(row, [1.0, 0.0, 0.0, 10.0, 8.0, 5.0], rtol=1e-12, atol=1e-15)


def test_only_what_the_frame_does_not_hold() -> None:
    inside, beside, behind = at(1.0, 2.0, -5.0), at(5.1, 2.0, -5.0), at(0.0, 2.0, 5.0)
    got = rows(inside, beside, behind)
    assert got.shape == (2, 6)
    np.testing.assert_allclose(got[1, :3], [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(got[:, :3], axis=1), 1.0, rtol=1e-12)


def test_directions_turn_with_the_camera() -> None:
    # Looks along +x; what was ahead is now to its left.
    turned = replace(CAMERA, right=(0.0, 0.0, 1.0), back=(-1.0, 0.0, 0.0))
    (row,) = rows(at(0.0, 2.0, -4.0), camera=turned)
    np.testing.assert_allclose(row[:3], [-1.0, 0.0, 0.0], atol=1e-15)


def test_frame_of_a_shifted_window() -> None:
    shifted = replace(CAMERA, window=(0.0, 2.0, -1.0, 1.0))
    ways = np.array([(-0.1, 0.0, -1.0), (1.9, 0.0, -1.0), (1.0, 0.0, 1.0), (0.5, 1.1, -1.0)])
    assert in_frame(ways, shifted).tolist() == [False, True, False, False]


@pytest.mark.parametrize(
    "changes",
    [
        {"radius": 0.05},
        {"inner": 0.3, "outer": 0.9, "exponent": 3.0, "axis": (-1.0, 0.0, 0.0)},
        {"shape": SPHERE, "radius": 0.3},
        {"shape": RECT, "radius": 0.0, "axis": (-0.8, 0.6, 0.0), "x": (0.0, 0.0, 0.1)},
        {"shape": DISK, "radius": 0.0, "axis": (-0.6, 0.0, 0.8), "x": (0.0, 0.1, 0.0)},
        {"shape": CYLINDER, "radius": 0.02, "x": (0.06, 0.08, 0.0)},
        {"profile": 0, "axis": (-1.0, 0.0, 0.0), "x": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0)},
    ],
)
def test_as_shader_1_lights_a_surface_that_faces_the_lamp(changes: dict[str, Any]) -> None:
    """30 m away, where a lamp of 20 cm is a point within 1e-4."""
    if changes.get("shape") == RECT:
        changes = changes | {"y": (0.06, 0.08, 0.0)}
    if changes.get("shape") == DISK:
        changes = changes | {"y": (0.08, 0.0, 0.06)}
    light = at(29.0, -5.0, 6.0, **changes)
    candela = np.linspace(900.0, 100.0, 4 * 7).reshape(4, 7).astype(np.float32)
    profiles = (Profile(candela, (0.0, 2.0 * math.pi), (0.0, math.pi)),)
    (row,) = rows(light, profiles=profiles)
    towards = light["position"][0] - np.array(CAMERA.eye)
    towards /= np.linalg.norm(towards)
    wanted = shade(
        np.array(CAMERA.eye),
        towards,
        np.ones(3),
        np.zeros(3),
        np.float64(0.0),
        light,
        eye=np.array([9.0, 9.0, 9.0]),
        scale=1.0,
        profiles=profiles,
    )
    assert wanted[0] > 0.0
    np.testing.assert_allclose(row[3:], wanted, rtol=2e-4)


def test_flat_lamps_shine_to_one_side() -> None:
    for shape in (RECT, DISK):
        assert len(rows(at(10.0, 2.0, 0.0, shape=shape, axis=(1.0, 0.0, 0.0)))) == 0


def test_lamp_on_the_eye_is_its_own_size_away() -> None:
    (row,) = rows(at(0.0, 2.0, 1e-9, radius=0.1))
    np.testing.assert_allclose(row[3:], [1e5, 8e4, 5e4], rtol=1e-12)
    assert np.all(np.isfinite(rows(at(0.0, 2.0, 0.0, radius=0.0))))


def test_distant_light() -> None:
    sun = light_row(5.0, position=(0.0, 1.0, 0.0), w=0.0, axis=(0.0, -1.0, 0.0))
    (row,) = rows(sun)
    np.testing.assert_allclose(row, [0.0, 1.0, 0.0, 5.0, 5.0, 5.0], atol=1e-15)


def test_none() -> None:
    assert eye_illuminance(RenderScene()).shape == (0, 6)
    assert rows(at(9.0, 2.0, 0.0), camera=replace(CAMERA, orthographic=True)).shape == (0, 6)
    assert rows(light_row(0.0, position=(9.0, 2.0, 0.0))).shape == (0, 6)
