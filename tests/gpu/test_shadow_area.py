"""Soft shadows of lights that have a size: against closed forms of what is seen of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shadow_scenes import (
    EDGE,
    HEIGHT,
    STEP,
    along,
    draw,
    half_plane,
    maps,
    plane,
    rect_light,
    rectangle_factor,
    scene,
    seen,
    segment,
    slab,
)
from small_scenes import look

from hdrusd.gpu.shadow_views import pattern
from hdrusd.scene import CYLINDER, DISK, SPHERE


@pytest.mark.parametrize("samples", [16, 64])
def test_a_rectangle_behind_an_edge(gl: Any, samples: int) -> None:
    """What is seen of it is a rectangle again."""
    shown = scene(rect_light(), draw(plane(40.0)), draw(half_plane()))
    places = along((-2.2, 0.2, 0.0), (2.2, 0.2, 0.0), 353)
    x, y = places[:, 0], 0.2
    # The ray from x past the edge reaches the light's plane here.
    cut = np.clip(x - x * HEIGHT / EDGE, -0.8, 0.8)
    sides = (-0.5 - y) / HEIGHT, (0.5 - y) / HEIGHT
    part = rectangle_factor((cut - x) / HEIGHT, (0.8 - x) / HEIGHT, *sides)
    whole = rectangle_factor((-0.8 - x) / HEIGHT, (0.8 - x) / HEIGHT, *sides)
    share = seen(gl, shown, places, shadows=maps(gl, samples=samples))
    wrong = np.abs(share - part / whole)
    assert wrong.max() < STEP * 16 / samples
    assert math.sqrt(np.mean(wrong**2)) < 0.35 * STEP * 16 / samples
    # Sure where all or nothing is seen, but for the texels of the last point.
    assert np.all(share[cut >= 0.8] <= 1.0 / samples)
    assert np.all(share[cut <= -0.8] >= 1.0 - 1.6 / samples)


@pytest.mark.parametrize("turn", [0.0, 0.7, math.pi / 2])
def test_a_disk_half_behind_an_edge(gl: Any, turn: float) -> None:
    """Below the edge, which passes under its middle, half of it is seen, whatever its vectors."""
    c, s = 0.6 * math.cos(turn), 0.6 * math.sin(turn)
    light = rect_light(shape=DISK, x=(c, s, 0.0), y=(-s, c, 0.0))
    shown = scene(light, draw(plane(40.0)), draw(half_plane()))
    assert seen(gl, shown, [(0.0, 0.0, 0.0)])[0] == pytest.approx(0.5, abs=STEP / 2)


def test_a_sphere_behind_an_edge(gl: Any) -> None:
    """Its outline is a disk; the edge cuts a segment off."""
    radius = 0.3
    shown = scene(rect_light(shape=SPHERE, radius=radius), draw(plane(40.0)), draw(half_plane()))
    places = along((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), 201)
    # The middle's distance from the plane through the point and the edge, on the side of light.
    x = places[:, 0]
    distance = x * (HEIGHT - EDGE) / np.hypot(x, EDGE)
    assert np.abs(seen(gl, shown, places) - segment(-distance / radius)).max() < STEP


def test_a_tube_behind_an_edge_across_it(gl: Any) -> None:
    """Thin and 2 m long: from below, what is seen of it grows with the cut.

    E of a line from u0 to u1 (tangents of the angle at which it is seen) on a surface parallel
    to it is in proportion to the integral of cos^4 da: from 1 / (1 + u^2)^2.
    """
    light = rect_light(shape=CYLINDER, x=(1.0, 0.0, 0.0), radius=0.02)
    shown = scene(light, draw(plane(40.0)), draw(half_plane()))
    places = along((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 161)
    x = places[:, 0]

    def integral(u: np.ndarray) -> np.ndarray:
        return np.asarray(u / (2.0 * (1.0 + u * u)) + np.arctan(u) / 2.0)

    cut = np.clip(x - x * HEIGHT / EDGE, -1.0, 1.0)
    ends = [integral((e - x) / HEIGHT) for e in (np.full_like(x, -1.0), cut, np.ones_like(x))]
    share = seen(gl, shown, places)
    assert np.abs(share - (ends[2] - ends[1]) / (ends[2] - ends[0])).max() < STEP


def test_a_wide_sun_behind_an_edge(gl: Any) -> None:
    """Straight above, 5 degrees wide to each side: the edge cuts a segment off its disk."""
    angle = math.radians(5.0)
    sun = {"position": (0.0, 0.0, 1.0), "w": 0.0, "intensity": 1000.0, "angle": angle}
    camera = look((0, -7, 5), (0, 0, 0), (0, 0, 1), half=0.5)
    shown = scene(sun, draw(plane(40.0)), draw(half_plane()), camera=camera)
    places = along((-0.2, 0.0, 0.0), (0.2, 0.0, 0.0), 161)
    wanted = segment(-places[:, 0] / (EDGE * math.tan(angle)))
    assert np.abs(seen(gl, shown, places) - wanted).max() < STEP


def test_unhidden_lights_are_seen_whole(gl: Any) -> None:
    """A plane under each light, near and far: no acne of any of the sample points."""
    for fields in (
        {},
        {"shape": DISK},
        {"shape": SPHERE, "radius": 0.5},
        {"shape": CYLINDER, "radius": 0.2},
        {"inner": 1.0, "outer": 1.1},
    ):
        shown = scene(rect_light(**fields), draw(plane(40.0)), draw(slab((9, 9, 0), (9.2, 9.2, 9))))
        share = seen(gl, shown, along((-0.3, 0.0, 0.0), (35.0, -9.0, 0.0), 801))
        assert np.all(share == 1.0), fields


def test_a_small_light_has_hard_shadows(gl: Any) -> None:
    shown = scene(rect_light(x=(0.01, 0, 0), y=(0, 0.01, 0)), draw(plane(40.0)), draw(half_plane()))
    assert maps(gl).update(shown).kind[0] == "SHADOW_CUBE"
    shown.lights["radius"], shown.lights["shape"] = 0.05, SPHERE
    assert maps(gl).update(shown).kind[0] == "SHADOW_CUBE"


@pytest.mark.parametrize("count", [4, 16, 64])
@pytest.mark.parametrize("kind", ["SHADOW_RECT", "SHADOW_DISK", "SHADOW_BALL", "SHADOW_TUBE"])
def test_sample_points_are_even(kind: str, count: int) -> None:
    """Means and spreads of even outlines: a square's, a disk's, a tube's."""
    points = pattern(kind, count)
    assert np.all(np.abs(points[:, :3]) <= 1.0)
    mean, spread = points[:, :3].mean(axis=0), np.mean(points[:, :3] ** 2, axis=0)
    error = 1.5 / count
    assert np.all(np.abs(mean) < error)
    wanted = {
        "SHADOW_RECT": (1 / 3, 1 / 3, 0.0),
        "SHADOW_DISK": (1 / 4, 1 / 4, 0.0),
        "SHADOW_BALL": (1 / 4, 1 / 4, 1 / 4),  # of a disk, whichever way one looks
        "SHADOW_TUBE": (1 / 3, 1 / 3, 1 / 3),  # of strips
    }[kind]
    assert np.all(np.abs(spread - wanted) < 0.2 * count**-0.5 + error / 3)
