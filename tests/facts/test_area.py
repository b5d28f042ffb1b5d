"""Area lights against integration over their surface, closed forms and the truth set."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.photometry import area
from hdrusd.photometry.area import (
    cylinder_illuminance,
    disk_illuminance,
    line_mean,
    rect_illuminance,
    sphere_illuminance,
)

Array = np.ndarray
E = np.eye(3)
DOWN = -E[2]

rng = np.random.default_rng(1760)


def midpoints(count: int) -> Array:
    return (np.arange(count) + 0.5) / count


def integral(p: Array, n: Array, spots: Array, normals: Array, weights: Array) -> float:
    """Lux per unit of sum(weights) of cd that facing spots at p + ``spots`` would give."""
    v = p + spots
    d2 = np.sum(v * v, axis=-1)
    cosines = np.maximum(v @ n, 0.0) * np.maximum(-np.sum(v * normals, axis=-1), 0.0)
    return float(np.sum(weights * cosines / d2**2))


def rect_spots(x: Array, y: Array, count: int) -> Array:
    u = 2.0 * midpoints(count) - 1.0
    a, b = np.meshgrid(u, u)
    return a.reshape(-1, 1) * x + b.reshape(-1, 1) * y


def disk_spots(x: Array, y: Array, count: int) -> Array:
    r, f = np.meshgrid(np.sqrt(midpoints(count)), 2.0 * np.pi * midpoints(count))
    return (r * np.cos(f)).reshape(-1, 1) * x + (r * np.sin(f)).reshape(-1, 1) * y


def flat_integral(p: Array, n: Array, axis: Array, spots: Array) -> float:
    return integral(p, n, spots, axis, np.full(len(spots), 1.0 / len(spots)))


def sphere_integral(p: Array, n: Array, radius: float, count: int = 300) -> float:
    """Over the directions that it fills, per cd: L = 1 / (pi r^2)."""
    d = float(np.linalg.norm(p))
    towards = p / d
    side = np.cross(towards, E[np.argmin(np.abs(towards))])
    side /= np.linalg.norm(side)
    up = np.cross(towards, side)
    lean, turn = np.meshgrid(np.arcsin(radius / d) * midpoints(count), 2 * np.pi * midpoints(count))
    cos, sin = np.cos(lean), np.sin(lean)
    height = cos * (n @ towards) + sin * (np.cos(turn) * (n @ side) + np.sin(turn) * (n @ up))
    solid = 2.0 * np.pi * np.arcsin(radius / d) * float(np.mean(np.maximum(height, 0.0) * sin))
    return solid / (np.pi * radius**2)


def cylinder_integral(p: Array, n: Array, x: Array, radius: float) -> float:
    """Per cd square to it: L = 1 / (4 r |x|)."""
    along = x / np.linalg.norm(x)
    out = -(p - (p @ along) * along)
    out /= np.linalg.norm(out)
    side = np.cross(along, out)
    turn, u = np.meshgrid(np.pi * (midpoints(200) - 0.5), 2.0 * midpoints(2500) - 1.0)
    normals = np.cos(turn).reshape(-1, 1) * out + np.sin(turn).reshape(-1, 1) * side
    spots = radius * normals + u.reshape(-1, 1) * x
    # Half of the side: pi r 2 |x|.
    return integral(p, n, spots, normals, np.full(len(spots), 0.5 * np.pi / len(spots)))


def unit() -> Array:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def square_to(axis: Array) -> Array:
    v = np.cross(axis, unit())
    return v / np.linalg.norm(v)


def in_front(axis: Array, distance: float) -> Array:
    """The way to a light of this axis from somewhere at least 0.1 distance before its plane."""
    while True:
        p = unit() * distance
        if p @ axis < -0.1 * distance:
            return p


#: Distance in half sizes of the light, and error relative to the largest of: the integral, and
#: a hundredth of what faces it. The midpoint rule of 300 x 300 is good to 1e-5 from 1 on.
DISTANCES = [0.3, 1.0, 3.0, 10.0, 45.0, 55.0, 300.0]


def flat_errors(
    found: Callable[..., Any], spots: Callable[..., Array], distance: float, *, circle: bool
) -> list[float]:
    errors = []
    for _ in range(8):
        axis, n = unit(), unit()
        x = square_to(axis)
        round_ = np.cross(axis, x)
        y = round_ if circle else 0.6 * round_ + 0.3 * x
        p = in_front(axis, distance * np.sqrt(x @ x + y @ y))
        if p @ n < -0.5 * np.linalg.norm(p):
            n = -n
        grid = spots(x, y, 300)
        face = flat_integral(p, p / np.linalg.norm(p), axis, grid)
        wanted = flat_integral(p, n, axis, grid)
        errors.append((float(found(p, n, axis, x, y)) - wanted) / max(wanted, 0.01 * face))
    return errors


@pytest.mark.parametrize("distance", DISTANCES)
def test_rectangles_and_parallelograms(distance: float) -> None:
    # Beyond FAR what the horizon cuts is seen by four points: a share of 1 / FAR, of which
    # four points find all but a fifth.
    bound = 3e-4 if distance < area.FAR else 0.3
    errors = flat_errors(rect_illuminance, rect_spots, distance, circle=False)
    assert np.max(np.abs(errors)) <= bound
    assert np.median(np.abs(errors)) <= 2e-5


@pytest.mark.parametrize("circle", [True, False])
@pytest.mark.parametrize("distance", DISTANCES)
def test_disks(distance: float, circle: bool) -> None:
    bound = 2e-3 if distance < area.FAR else 0.3
    errors = flat_errors(disk_illuminance, disk_spots, distance, circle=circle)
    assert np.max(np.abs(errors)) <= bound
    assert np.median(np.abs(errors)) <= 1e-4


def test_a_disk_near_its_rim() -> None:
    # 3 % of the radius below the rim, where the polygon of 64 sides is worst.
    x, y = E[0], 0.999 * E[1]  # no circle
    for turn in np.linspace(0.0, 0.1, 9):
        p = -np.array([np.cos(turn), 0.999 * np.sin(turn), -0.03])
        got = float(disk_illuminance(p, E[2], DOWN, x, y))
        close = float(disk_illuminance(p, E[2], DOWN, x, E[1]))
        assert got == pytest.approx(close, rel=0.03)


def test_below_a_rectangle_s_corner() -> None:
    # Configuration factor of Siegel and Howell (C-14): a x b rectangle, c below one corner.
    a, b, c = 1.2, 0.6, 2.0
    x, y = a / c, b / c
    p, q = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    factor = (x / p * np.arctan(y / p) + y / q * np.arctan(x / q)) / (2 * np.pi)
    to = np.array([a / 2, b / 2, c])
    got = rect_illuminance(to, E[2], DOWN, a / 2 * E[0], b / 2 * E[1])
    assert float(got) == pytest.approx(np.pi * factor / (a * b), rel=1e-13)


@pytest.mark.parametrize("aside", [0.0, 0.3, 1.0, 4.0, 200.0])
def test_a_parallel_disk(aside: float) -> None:
    # Foote 1915: E = pi L / 2 (1 - (h^2 + x^2 - R^2) / sqrt((h^2 + x^2 + R^2)^2 - 4 R^2 x^2)).
    h, r = 0.7, 0.5
    s = h * h + aside * aside
    foote = 0.5 * np.pi * (1 - (s - r * r) / np.sqrt((s + r * r) ** 2 - 4 * r * r * aside**2))
    got = disk_illuminance(np.array([aside, 0, h]), E[2], DOWN, r * E[0], r * E[1])
    # The published form cancels far from the axis.
    assert float(got) == pytest.approx(foote / (np.pi * r * r), rel=1e-15 * s * s / (r * h) ** 2)


@pytest.mark.parametrize("shape", [rect_illuminance, disk_illuminance])
def test_the_back_is_dark(shape: Callable[..., Any]) -> None:
    for p in (np.array([0.1, 0.2, -1.0]), np.array([2.0, 0.0, 0.0])):
        assert float(shape(p, p / np.linalg.norm(p), DOWN, E[0], E[1])) == 0.0


@pytest.mark.parametrize("distance", [1.001, 1.1, 1.5, 3.0, 30.0, 1000.0])
def test_spheres(distance: float) -> None:
    for _ in range(8):
        n, p = unit(), unit() * distance * 0.25
        wanted = sphere_integral(p, n, 0.25)
        got = float(sphere_illuminance(p, n, np.array(0.25)))
        # Of the midpoint rule: a third of the square of a step, and a kink along the horizon.
        assert got == pytest.approx(wanted, rel=1e-5, abs=2e-5 / (p @ p))


def test_a_whole_sphere_shines_as_a_point() -> None:
    p, n = np.array([0.3, 0.4, 1.2]), E[2]
    assert float(sphere_illuminance(p, n, np.array(0.5))) == pytest.approx(
        1.2 / float(np.linalg.norm(p)) ** 3, rel=1e-14
    )


def test_on_and_inside_a_sphere_half_of_all_directions_shine() -> None:
    # A hemisphere tilted by theta gives pi L (1 + cos(theta)) / 2, with L = 1 / (pi r^2).
    for theta in np.linspace(0.0, np.pi, 7):
        n = np.array([np.sin(theta), 0.0, np.cos(theta)])
        for d in (0.2, 0.1, 0.01):
            got = float(sphere_illuminance(d * E[2], n, np.array(0.2)))
            assert got == pytest.approx((1 + np.cos(theta)) / 2 / 0.04, rel=2e-3, abs=0.02)


#: Distance from the axis in radii, and the largest error as a share of the light, or of a
#: fifth of what a surface that faces it gets.
CYLINDERS = [(1.1, 0.05), (1.5, 0.02), (2.0, 0.01), (4.0, 0.01), (20.0, 0.01)]


@pytest.mark.parametrize(("distance", "share"), CYLINDERS)
def test_cylinders(distance: float, share: float) -> None:
    for radius, half in ((0.1, 0.5), (0.02, 0.6), (0.3, 0.3)):
        for _ in range(4):
            along, n = unit(), unit()
            middle = rng.uniform(-1.5, 1.5) * half * along
            p = middle + distance * radius * square_to(along)
            near = p - np.clip(p @ along, -half, half) * along
            face = cylinder_integral(p, near / np.linalg.norm(near), half * along, radius)
            wanted = cylinder_integral(p, n, half * along, radius)
            got = float(cylinder_illuminance(p, n, half * along, np.array(radius)))
            assert abs(got - wanted) <= share * max(wanted, 0.2 * face)


def test_a_line_without_width_shines_by_its_cosine() -> None:
    # Square to it and parallel to the surface, h away: h^2 / d^4 along the line.
    h, half = 0.8, 1.5
    t = np.linspace(-half, half, 200_001)
    f = h * h / (h * h + t * t) ** 2
    wanted = float(np.sum((f[1:] + f[:-1]) / 2) * (t[1] - t[0])) / (2 * half)
    got = cylinder_illuminance(h * E[2], E[2], half * E[0], np.array(0.0))
    # What the six strips miss of int cos(f) df over half a turn.
    assert float(got) == pytest.approx(wanted, rel=2e-4)
    assert h * float(line_mean(h * E[2], E[2], half * E[0])) == pytest.approx(wanted, rel=1e-9)


def test_a_cylinder_s_ends_are_dark() -> None:
    got = cylinder_illuminance(np.array([2.0, 0.05, 0.0]), E[0], E[0], np.array(0.1))
    assert float(got) == 0.0


@pytest.mark.parametrize("shape", ["rect", "disk", "sphere", "cylinder"])
def test_far_away_all_are_points(shape: str) -> None:
    p, n = 1e5 * unit(), unit()
    n *= np.sign(n @ p)
    d2 = p @ p
    axis = -E[2] * np.sign(p[2])
    points = n @ p / d2**1.5
    small = np.array(0.1)
    got, wanted = {
        "rect": (rect_illuminance(p, n, axis, E[0], E[1]), points * -(p @ axis) / np.sqrt(d2)),
        "disk": (disk_illuminance(p, n, axis, E[0], E[1]), points * -(p @ axis) / np.sqrt(d2)),
        "sphere": (sphere_illuminance(p, n, small), points),
        # Square to it all of 2 r l is seen, else by the sine.
        "cylinder": (
            cylinder_illuminance(p, n, E[0], small),
            points * np.sqrt(1 - p[0] ** 2 / d2),
        ),
    }[shape]
    assert float(got) == pytest.approx(float(wanted), rel=1e-4)


# -- the truth set ------------------------------------------------------------------------


def truth(folder: Path, case: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    cases = {c["id"]: c for c in json.loads((folder / "expected.json").read_text())["cases"]}
    return json.loads((folder / cases[case]["photometry"]).read_text()), cases[case]["probes"]


@pytest.mark.parametrize("case", ["area_rect", "area_disk_cm", "area_sphere"])
def test_probes_of_the_truth_set(testdata: Path, case: str) -> None:
    scene, probes = truth(testdata / "truth", case)
    (light,), (material,) = scene["lights"], scene["materials"]
    luminance, rho = np.array(light["luminance_rgb"]), np.array(material["reflectance_rgb"])
    centre = np.array(light["center_m"])
    for probe in probes:
        p, n = centre - probe["point_m"], np.array(probe["normal"])
        if case == "area_sphere":
            r = light["radius_m"]
            lux = np.pi * r * r * sphere_illuminance(p, n, np.array(r))
        else:
            axis = np.array(light["emission_normal"])
            if case == "area_rect":
                x = np.array(light["width_dir"]) * light["width_m"] / 2
                y = np.cross(axis, light["width_dir"]) * light["height_m"] / 2
                lux = 4 * np.linalg.norm(np.cross(x, y)) * rect_illuminance(p, n, axis, x, y)
            else:
                x, y = light["radius_m"] * E[0], light["radius_m"] * E[2]
                lux = np.pi * light["radius_m"] ** 2 * disk_illuminance(p, n, axis, x, y)
        # Written with 7 digits, places too; sources agree within 0.1 %.
        assert rho * luminance * lux / np.pi == pytest.approx(probe["expect"]["RGB"], rel=3e-6)
