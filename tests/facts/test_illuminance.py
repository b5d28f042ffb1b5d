"""Equation 1 of Petit and Bremond 2010, E = I cos(theta) / d^2, and UsdLux's cones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import light_row
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.photometry.light import chromaticity
from hdrusd.photometry.shading import shade
from hdrusd.units import LUMINANCE_WEIGHTS

UP = (0.0, 0.0, 1.0)


def lux(
    light: Any, point: tuple[float, float, float], normal: tuple[float, ...] = UP
) -> np.ndarray:
    """Illuminance per channel: what a surface of reflectance 1 sends back under L = R E."""
    return shade(
        np.array(point),
        np.array(normal),
        np.ones(3),
        np.zeros(3),
        np.float64(0.0),
        light,
        eye=np.array([3.0, 4.0, 50.0]),
        scale=1.0,
    )


def at_angle(degrees: float, distance: float = 10.0) -> tuple[float, float, float]:
    """A point off the axis of a light at the origin that shines along -Z."""
    theta = math.radians(degrees)
    return (distance * math.sin(theta), 0.0, -distance * math.cos(theta))


def share(light: Any, degrees: float) -> float:
    """Of the light's axial intensity, what goes out at an angle to its axis."""
    point = at_angle(degrees)
    towards = tuple(-v / 10.0 for v in point)
    return float(lux(light, point, towards)[0] * 100.0)


def test_a_thousand_candela_at_ten_metres_give_ten_lux() -> None:
    assert lux(light_row(1000.0), (0.0, 0.0, -10.0)) == pytest.approx([10.0] * 3, rel=1e-12)


def test_sixty_degrees_halve_it() -> None:
    # I = 1000 cd, d = 5 m, cos(60 degrees): 20 lx.
    normal = (math.sin(math.pi / 3), 0.0, 0.5)
    assert lux(light_row(1000.0), (0.0, 0.0, -5.0), normal)[1] == pytest.approx(20.0, rel=1e-12)


@given(st.floats(0.1, 1e4), st.floats(1.5, 100.0))
def test_it_falls_with_the_square_of_the_distance(distance: float, factor: float) -> None:
    near = lux(light_row(1000.0), (0.0, 0.0, -distance))[0]
    far = lux(light_row(1000.0), (0.0, 0.0, -distance * factor))[0]
    assert near / far == pytest.approx(factor * factor, rel=1e-12)


def test_light_from_behind_gives_nothing() -> None:
    assert not lux(light_row(1000.0), (0.0, 0.0, 10.0)).any()
    assert not lux(light_row(1000.0), (0.0, 0.0, -10.0), (0.0, 0.0, -1.0)).any()


def test_no_distance_is_shorter_than_the_lamps_radius() -> None:
    lit = lux(light_row(1000.0, radius=0.5), (0.0, 0.0, -0.125))[0]
    assert lit == pytest.approx(1000.0 / 0.25, rel=1e-12)
    assert np.isfinite(lux(light_row(1000.0, radius=0.0), (0.0, 0.0, 0.0))).all()


@pytest.mark.parametrize("distance", [1.0, 1e5])
def test_a_distant_light_gives_its_lux_anywhere(distance: float) -> None:
    sun = light_row(0.25, w=0.0, position=(0.0, 0.0, 1.0), radius=0.0)
    assert lux(sun, (3.0, 1.0, -distance))[0] == pytest.approx(0.25, rel=1e-12)
    tilted = (math.sin(math.pi / 3), 0.0, 0.5)
    assert lux(sun, (3.0, 1.0, -distance), tilted)[0] == pytest.approx(0.125, rel=1e-12)


def test_lights_add_up_and_channels_stay_apart() -> None:
    both = np.concatenate([light_row((100.0, 0.0, 0.0)), light_row((0.0, 200.0, 300.0))])
    assert lux(both, (0.0, 0.0, -10.0)) == pytest.approx([1.0, 2.0, 3.0], rel=1e-12)


@pytest.mark.parametrize(("degrees", "wanted"), [(0.0, 1.0), (39.9, 1.0), (40.1, 0.0), (120, 0.0)])
def test_a_hard_cone_ends_at_its_angle(degrees: float, wanted: float) -> None:
    row = light_row(1.0, inner=math.radians(40.0), outer=math.radians(40.0))
    assert share(row, degrees) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize(
    ("degrees", "wanted"),
    # UsdLux ShapingAPI: 1 - smoothstep of the angle, from cone angle (1 - softness) to cone angle.
    [(10.0, 1.0), (20.0, 1.0), (25.0, 0.84375), (30.0, 0.5), (35.0, 0.15625), (40.0, 0.0)],
)
def test_a_soft_cone_fades_by_a_smoothstep_of_the_angle(degrees: float, wanted: float) -> None:
    row = light_row(1.0, inner=math.radians(20.0), outer=math.radians(40.0))
    # 1e-7: arccos near the axis loses half of a double's digits.
    assert share(row, degrees) == pytest.approx(wanted, abs=1e-7)


def test_focus_is_a_power_of_the_cosine() -> None:
    # OpenGL's spot exponent: (max(v.s, 0))^e; UsdLux takes the absolute cosine.
    assert share(light_row(1.0, exponent=8.0), math.degrees(math.acos(0.95))) == pytest.approx(
        0.66342043, abs=5e-9
    )
    assert share(light_row(1.0, exponent=2.0), 60.0) == pytest.approx(0.25, rel=1e-12)
    assert share(light_row(1.0, exponent=2.0), 120.0) == pytest.approx(0.25, rel=1e-12)


def test_cone_and_focus_multiply() -> None:
    row = light_row(1.0, exponent=2.0, inner=math.radians(40.0), outer=math.radians(80.0))
    assert share(row, 60.0) == pytest.approx(0.25 * 0.5, rel=1e-6)


def test_flux_of_a_cone() -> None:
    # 800 lm in a uniform cone of 30 degrees half-angle: I = Phi / (2 pi (1 - cos 30)) cd.
    intensity = 950.358934
    theta = np.linspace(0.0, math.pi, 20_001)
    row = light_row(intensity, inner=math.radians(30.0), outer=math.radians(30.0))
    points = 10.0 * np.stack([np.sin(theta), 0.0 * theta, -np.cos(theta)], axis=-1)
    one = np.ones(points.shape)
    lit = shade(
        points, -points / 10.0, one, 0.0 * one, np.zeros(len(theta)), row, eye=np.ones(3), scale=1.0
    )
    flux = np.trapezoid(lit[:, 0] * 100.0 * 2.0 * math.pi * np.sin(theta), theta)
    assert flux == pytest.approx(800.0, rel=3e-4)  # half a step of the grid at the cone's edge


@given(st.tuples(*[st.floats(1e-3, 1e3)] * 3))
def test_chromaticity_has_luminance_one_and_keeps_the_product(
    color: tuple[float, float, float],
) -> None:
    hue, strength = chromaticity(color)
    assert np.dot(LUMINANCE_WEIGHTS, hue) == pytest.approx(1.0, rel=1e-14)
    assert np.multiply(hue, strength) == pytest.approx(np.array(color), rel=1e-14)


def test_chromaticity_of_the_lamp_in_the_decision() -> None:
    # docs/decisions/0003: (1, 0.8, 0.5) has luminance 0.8209 and becomes (1.218, 0.975, 0.609).
    hue, strength = chromaticity((1.0, 0.8, 0.5))
    assert strength == pytest.approx(0.82086, abs=1e-12)
    assert hue == pytest.approx((1.218, 0.975, 0.609), abs=5e-4)


def test_black_has_no_hue() -> None:
    assert chromaticity((0.0, 0.0, 0.0)) == ((1.0, 1.0, 1.0), 0.0)
