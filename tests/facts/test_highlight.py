"""Highlights of area lights: the representative point, and integrals of the GGX lobe."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hdrusd.photometry import highlight
from hdrusd.photometry.highlight import (
    STRAIGHT,
    cylinder_point,
    disk_point,
    highlight_share,
    lobe_share,
    rect_point,
    sphere_point,
    sphere_spread,
    spread,
)
from hdrusd.photometry.microfacet import ggx_gain, ggx_lobe, half_angles

Array = np.ndarray
N = np.array([0.0, 0.0, 1.0])

rng = np.random.default_rng(2013)


def lobe(way: Array, v: Array, alpha: float) -> tuple[Array, Array]:
    """Luminance per lux where all is reflected, and N.L, of unit vectors ``way`` (..., 3)."""
    nl, nv = way @ N, np.broadcast_to(v @ N, np.shape(way)[:-1])
    sine2 = half_angles(N, way, v, nl, nv)[..., 0]
    found = ggx_lobe(ggx_gain(nv, alpha**2, 1 / np.pi), alpha**2, nl, sine2)
    return np.where(nl > 0.0, found, 0.0), nl


def spots(kind: str, p: Array, x: Array, y: Array) -> Array:
    u = (np.arange(300) + 0.5) / 150.0 - 1.0
    a, b = (g.reshape(-1, 1) for g in np.meshgrid(u, u))
    if kind == "disk":
        r, turn = np.sqrt((a + 1) / 2), np.pi * b
        a, b = r * np.cos(turn), r * np.sin(turn)
    return np.asarray(p + a * x + b * y)


def integral(kind: str, p: Array, x: Array, y: Array, v: Array, alpha: float) -> Array:
    """(2,) luminance of the highlight of a light of 1 cd/m2 that faces us, and its lux."""
    v3 = spots(kind, p, x, y)
    d2 = np.sum(v3 * v3, axis=1)
    way = v3 / np.sqrt(d2)[:, None]
    found, nl = lobe(way, v, alpha)
    axis = p / np.linalg.norm(p)
    area = (4.0 if kind == "rect" else np.pi) * np.linalg.norm(np.cross(x, y))
    lux = np.maximum(nl, 0.0) * (way @ axis) / d2 * area / len(d2)
    return np.array([np.sum(found * lux), np.sum(lux)])


def approximated(
    kind: str, p: Array, x: Array, y: Array, v: Array, alpha: float, lux: float
) -> float:
    r, axis = 2 * (v @ N) * N - v, -p / np.linalg.norm(p)
    to = (rect_point if kind == "rect" else disk_point)(p, r, axis, x, y)
    found, nl = lobe(to / np.linalg.norm(to), v, alpha)
    w = lobe_share(spread(p, v, x, y), STRAIGHT if kind == "rect" else 1.0, np.array(alpha**2))
    return float(found * lux * highlight_share(w, nl, -axis @ N))


LIGHTS = [
    ("disk", 0.1, 0.1),
    ("disk", 0.4, 0.4),
    ("rect", 0.5, 0.05),
    ("rect", 0.05, 0.5),
    ("rect", 0.3, 0.3),
]


@pytest.mark.parametrize("lean", [0, 40, 65])
@pytest.mark.parametrize("alpha", [0.01, 0.04, 0.1, 0.25, 0.5, 1.0])
@pytest.mark.parametrize(("kind", "wide", "high"), LIGHTS)
def test_against_the_integral(
    kind: str, wide: float, high: float, alpha: float, lean: float
) -> None:
    angle = np.radians(lean)
    v = np.array([-np.sin(angle), 0.0, np.cos(angle)])
    peak = 0.0
    for aside in (0.0, 0.5, 1.0, 1.5, 2.5):
        turn = angle + 0.6 * aside * (wide + alpha)
        if turn > np.radians(85):
            continue
        p = np.array([np.sin(turn), 0.0, np.cos(turn)])
        x, y = wide * np.array([np.cos(turn), 0.0, -np.sin(turn)]), np.array([0.0, high, 0.0])
        wanted, lux = integral(kind, p, x, y, v, alpha)
        got = approximated(kind, p, x, y, v, alpha, lux)
        if aside == 0.0:
            peak = wanted
            assert got == pytest.approx(wanted, rel=0.2)
        assert got == pytest.approx(wanted, abs=0.52 * peak)


@pytest.mark.parametrize(("kind", "wide", "high"), [("rect", 0.1, 0.05), ("disk", 0.1, 0.05)])
@pytest.mark.parametrize("lean", [0, 50])
def test_a_mirror_shows_the_luminance_of_the_light(
    kind: str, wide: float, high: float, lean: float
) -> None:
    angle = np.radians(lean)
    v = np.array([-np.sin(angle), 0.0, np.cos(angle)])
    p = np.array([np.sin(angle), 0.0, np.cos(angle)])
    x, y = wide * np.array([np.cos(angle), 0.0, -np.sin(angle)]), np.array([0.0, high, 0.0])
    lux = integral(kind, p, x, y, v, 1.0)[1]
    # The lobe is 1e-3 wide, a hundredth of the light, whose angle is small.
    assert approximated(kind, p, x, y, v, 1e-3, lux) == pytest.approx(1.0, rel=0.01)


def test_a_small_light_is_a_point() -> None:
    for area in (spread(5 * N, N, 1e-4 * np.eye(3)[0], 1e-4 * np.eye(3)[1]),):
        assert float(lobe_share(area, STRAIGHT, np.array(0.01))) == pytest.approx(1.0, abs=1e-6)
    assert float(highlight_share(np.array(1.0), np.array(0.2), np.array(0.5))) == 1.0


def test_a_sphere_spreads_as_the_disk_that_it_shows() -> None:
    for _ in range(20):
        p, v = rng.normal(size=3), rng.normal(size=3)
        v /= np.linalg.norm(v)
        x = np.cross(p, rng.normal(size=3))
        x *= 0.1 / np.linalg.norm(x)
        y = np.cross(p, x) / np.linalg.norm(p)
        wanted = spread(p, v, x, y)
        assert sphere_spread(p, v, np.array(0.1)) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("kind", ["rect", "disk", "sphere", "cylinder"])
def test_the_representative_point_is_on_the_light_where_the_ray_meets_it(kind: str) -> None:
    x, y = np.array([0.5, 0.1, 0.0]), np.array([0.0, 0.3, 0.0])
    p, axis, radius = np.array([0.2, 0.1, 2.0]), -N, np.array(0.3)
    found: dict[str, Callable[[Array], Any]] = {
        "rect": lambda r: rect_point(p, r, axis, x, y),
        "disk": lambda r: disk_point(p, r, axis, x, y),
        "sphere": lambda r: sphere_point(p, r, radius),
        "cylinder": lambda r: cylinder_point(p, r, x, radius),
    }
    for _ in range(30):
        a, b = rng.uniform(-0.6, 0.6, 2)
        inside = p + (a * x + b * y if kind in ("rect", "disk", "cylinder") else 0.2 * a * N)
        r = inside / np.linalg.norm(inside)
        to = found[kind](r)
        assert to / np.linalg.norm(to) @ r == pytest.approx(1.0, abs=1e-9)


def test_beside_the_light_it_is_on_the_rim() -> None:
    x, y, p = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.3, 0.0]), 2.0 * N
    r = np.array([0.6, 0.0, 0.8])
    assert rect_point(p, r, -N, x, y) == pytest.approx([0.5, 0.0, 2.0])
    assert disk_point(p, r, -N, x, y) == pytest.approx([0.5, 0.0, 2.0])
    # The ball's rim as seen from the ray.
    beside = sphere_point(p, r, np.array(0.3)) - p
    assert np.linalg.norm(beside) == pytest.approx(0.3)
    assert beside @ r == pytest.approx(0.0, abs=1e-12)


def test_a_ray_that_leaves_the_plane_takes_the_far_rim() -> None:
    x, y, p = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.3, 0.0]), 2.0 * N
    r = np.array([0.8, 0.0, -0.6])
    assert rect_point(p, r, -N, x, y) == pytest.approx([0.5, 0.0, 2.0])


def test_blinn_phong_s_width() -> None:
    # (N.H)^n near its peak is exp(-n t^2 / 2); GGX of alpha falls alike where n = 2 / alpha^2.
    assert float(highlight.blinn_alpha2(np.array(198.0))) == pytest.approx(0.01)
