"""Shader 1's definition in NumPy against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import light_row

from hdrusd.photometry.shading import shade

PI = math.pi
UP = np.array([0.0, 0.0, 1.0])
ORIGIN = np.zeros(3)


def luminance(light: Any, **changes: Any) -> np.ndarray:
    """cd/m2 of a surface element at the origin that faces +Z, seen from straight above."""
    values: dict[str, Any] = {
        "position": ORIGIN,
        "normal": UP,
        "diffuse": np.zeros(3),
        "specular": np.zeros(3),
        "shininess": np.float64(0.0),
        "eye": np.array([0.0, 0.0, 9.0]),
    } | changes
    scale = values.pop("scale", 1 / PI)
    eye = values.pop("eye")
    return shade(*values.values(), light, eye=eye, scale=scale)


def above(height: float, intensity: float = 1000.0, **changes: Any) -> Any:
    return light_row(intensity, position=(0.0, 0.0, height), **changes)


def test_a_grey_surface_under_a_lamp_at_sixty_degrees() -> None:
    # I = 1000 cd, d = 5 m, 60 degrees: E = 20 lx; R = 0.5: 3.18309886 cd/m2, or 10 by L = R E.
    place = (5.0 * math.sin(PI / 3), 0.0, 2.5)
    grey = np.full(3, 0.5)
    lamp = light_row(1000.0, position=place)
    assert luminance(lamp, diffuse=grey)[0] == pytest.approx(3.18309886, abs=5e-9)
    assert luminance(lamp, diffuse=grey, scale=1.0)[0] == pytest.approx(10.0, rel=1e-12)


def test_a_highlight_in_the_mirror_direction() -> None:
    # E = 10 lx, N.H = 1, n = 32: 10 * 0.5 * 1.59154943 cd/m2.
    got = luminance(above(10.0), specular=np.full(3, 0.5), shininess=np.float64(32.0))
    assert got == pytest.approx([7.95774715] * 3, abs=5e-8)


def test_a_highlight_may_exceed_one() -> None:
    got = luminance(above(1.0), specular=np.ones(3), shininess=np.float64(1000.0))
    assert got[0] == pytest.approx(1000.0 * 1008.0 / (8 * PI), rel=1e-12)


def test_petit2010_highlight_is_opengls() -> None:
    # (N.H)^n E with H halfway between 40 degrees and the normal.
    theta = math.radians(40.0)
    lamp = light_row(1000.0, position=(10 * math.sin(theta), 0.0, 10 * math.cos(theta)))
    got = luminance(lamp, specular=np.ones(3), shininess=np.float64(16.0), scale=1.0)
    lux = 10.0 * math.cos(theta)
    assert got[0] == pytest.approx(lux * math.cos(theta / 2) ** 16, rel=1e-12)


def test_nothing_shines_from_below() -> None:
    white = np.ones(3)
    got = luminance(above(-5.0), diffuse=white, specular=white, shininess=np.float64(0.0))
    assert not got.any()


def test_channels_and_lights_add_up() -> None:
    red, blue = (
        light_row((100.0, 0, 0), position=(0, 0, 1.0)),
        light_row((0, 0, 50.0), position=(0, 0, 1.0)),
    )
    both = luminance(np.concatenate([red, blue]), diffuse=np.array([0.5, 0.5, 1.0]))
    assert both * PI == pytest.approx([50.0, 0.0, 50.0], rel=1e-12)


def test_a_spot_lights_only_its_cone() -> None:
    aimed = above(2.0, axis=(0.0, 0.0, -1.0), inner=0.3, outer=0.3)
    turned = above(2.0, axis=(1.0, 0.0, 0.0), inner=0.3, outer=0.3)
    assert luminance(aimed, diffuse=np.ones(3))[0] == pytest.approx(250.0 / PI, rel=1e-12)
    assert not luminance(turned, diffuse=np.ones(3)).any()


def test_light_model_of_a_lamp_inside_the_surface() -> None:
    assert np.isfinite(luminance(above(0.0), diffuse=np.ones(3))).all()


def test_pixels_are_independent() -> None:
    rng = np.random.default_rng(3)
    position = rng.uniform(-3, 3, (4, 5, 3))
    normal = rng.normal(size=(4, 5, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    diffuse, specular = rng.uniform(0, 1, (2, 4, 5, 3))
    shininess = rng.uniform(1, 100, (4, 5))
    lamps = np.concatenate([above(4.0), light_row(80.0, position=(1, 2, 3), exponent=3.0)])
    eye = np.array([0.0, -9.0, 2.0])
    whole = shade(position, normal, diffuse, specular, shininess, lamps, eye=eye)
    one = shade(
        position[2, 3], normal[2, 3], diffuse[2, 3], specular[2, 3], shininess[2, 3], lamps, eye=eye
    )
    assert whole[2, 3] == pytest.approx(one, rel=1e-14)
