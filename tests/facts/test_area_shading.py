"""Area lights in shader 1's definition against the many small lamps that they are made of."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.photometry.shading import shade
from hdrusd.scene import CYLINDER, DISK, RECT, SPHERE, light_rows

Array = np.ndarray

N = np.array([0.0, 0.0, 1.0])
CENTRE = np.array([0.9, 0.0, 1.6])
AXIS = -CENTRE / np.linalg.norm(CENTRE)
X = 0.4 * np.cross((0.0, 1.0, 0.0), AXIS)
Y = np.array([0.0, 0.25, 0.0])


def area_light(shape: int, x: Array, y: Array, radius: float) -> Any:
    row = light_rows(1)
    row["position"], row["axis"], row["x"], row["y"] = CENTRE, AXIS, x, y
    row["shape"], row["radius"], row["intensity"] = shape, radius, 100.0
    return row


def lamps(places: Array, normals: Array, intensity: Array) -> Any:
    """Lambertian points: candela falls with the cosine, and nothing goes backwards."""
    rows = light_rows(len(places))
    rows["position"], rows["axis"], rows["intensity"] = places, normals, intensity[:, None]
    rows["exponent"], rows["inner"], rows["outer"] = 1.0, math.pi / 2, math.pi / 2
    return rows


def middles(count: int) -> Array:
    return (np.arange(count) + 0.5) / count


def flat_lamps(shape: int) -> Any:
    a, b = (2 * g.ravel() - 1 for g in np.meshgrid(middles(24), middles(24)))
    if shape == DISK:
        r, turn = np.sqrt((a + 1) / 2), math.pi * b
        a, b = r * np.cos(turn), r * np.sin(turn)
    places = CENTRE + a[:, None] * X + b[:, None] * (Y if shape == RECT else Y * 1.6)
    return lamps(places, np.tile(AXIS, (len(a), 1)), np.full(len(a), 100.0 / len(a)))


def ball_lamps(radius: float) -> Any:
    # Equal areas; seen from anywhere the sum of the cosines is a quarter of the area.
    z, turn = (g.ravel() for g in np.meshgrid(2 * middles(30) - 1, 2 * math.pi * middles(30)))
    flat = np.sqrt(1 - z * z)
    out = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return lamps(CENTRE + radius * out, out, np.full(len(z), 400.0 / len(z)))


def tube_lamps(x: Array, radius: float) -> Any:
    # Square to it the sum of the cosines is 1 / pi of the side.
    a, turn = (g.ravel() for g in np.meshgrid(2 * middles(40) - 1, 2 * math.pi * middles(24)))
    u = np.cross(x, AXIS) / np.linalg.norm(x)
    out = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * AXIS
    places = CENTRE + a[:, None] * x + radius * out
    return lamps(places, out, np.full(len(a), 100.0 * math.pi / len(a)))


LIGHTS = {
    "rect": (area_light(RECT, X, Y, 0.0), flat_lamps(RECT)),
    "disk": (area_light(DISK, X, 1.6 * Y, 0.0), flat_lamps(DISK)),
    "sphere": (area_light(SPHERE, X, Y, 0.3), ball_lamps(0.3)),
    "cylinder": (area_light(CYLINDER, X, Y, 0.06), tube_lamps(X, 0.06)),
}


def luminance(light: Any, eye: Array, **surface: Any) -> float:
    """cd/m2 of a surface at the origin that faces up."""
    values = {"diffuse": np.zeros(3), "specular": np.zeros(3), "gloss": np.float64(0.0)} | surface
    return float(shade(np.zeros(3), N, lights=light, eye=eye, **values)[1])


ABOVE = np.array([0.1, 0.2, 5.0])
#: Where a mirror shows the middle of the light.
MIRROR = CENTRE * (-1.0, -1.0, 1.0)
#: Mean over the wavy outline of the small lamps, of 24 x 24 and more.
QUADRATURE = 2e-3


@pytest.mark.parametrize("kind", LIGHTS)
def test_diffuse_reflection_is_that_of_the_parts(kind: str) -> None:
    light, parts = LIGHTS[kind]
    got, wanted = (luminance(k, ABOVE, diffuse=np.full(3, 0.5)) for k in (light, parts))
    # Of a cylinder photometry/area.py says 1 %.
    assert got == pytest.approx(wanted, rel=1e-2 if kind == "cylinder" else QUADRATURE)


GLOSS = {
    "ggx": {"gloss": np.float64(-0.1), "specular": np.full(3, 0.9), "metallic": 1.0},
    "wide ggx": {"gloss": np.float64(-0.4), "specular": np.full(3, 0.9), "metallic": 1.0},
    "blinn": {"gloss": np.float64(60.0), "specular": np.full(3, 0.5)},
    "coat": {"gloss": np.float64(-1.0), "specular": np.zeros(3), "coat": (1.0, 0.15)},
}


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("gloss", GLOSS)
def test_highlights_are_near_those_of_the_parts(kind: str, gloss: str) -> None:
    """Within 20 % where the mirrored ray meets the middle, 60 % of that peak beside it."""
    light, parts = LIGHTS[kind]
    peak = luminance(parts, MIRROR, **GLOSS[gloss])
    assert luminance(light, MIRROR, **GLOSS[gloss]) == pytest.approx(peak, rel=0.2)
    for aside in (-1.2, -0.5, 0.3, 0.8):
        eye = MIRROR + aside * np.array([0.5, 0.6, 0.0])
        wanted = luminance(parts, eye, **GLOSS[gloss])
        assert luminance(light, eye, **GLOSS[gloss]) == pytest.approx(wanted, abs=0.6 * peak)


def test_a_wide_distant_light_is_the_ball_that_it_looks_like() -> None:
    """Half angle 0.3 rad: a ball of sin(0.3) in the distance 1, and far away."""
    row = light_rows(1)
    way = CENTRE / np.linalg.norm(CENTRE)
    row["position"], row["w"], row["angle"], row["intensity"] = way, 0.0, 0.3, 1.0
    far = light_rows(1)
    far["position"], far["shape"], far["radius"] = 1e3 * way, SPHERE, 1e3 * math.sin(0.3)
    far["intensity"] = 1e6
    for surface in ({"diffuse": np.full(3, 0.5)}, GLOSS["ggx"], GLOSS["blinn"]):
        for eye in (ABOVE, MIRROR):
            assert luminance(row, eye, **surface) == pytest.approx(
                luminance(far, eye, **surface), rel=1e-9
            )
