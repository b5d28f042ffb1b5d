"""photometry/area.glsl against area.py: what float32 loses, relative to the light seen face on.

Small helpers are held to counted roundings. The illuminances cannot be: their sums cancel, by
an amount that depends on the place. They are held to shares of what a surface that faces the
light would get, near to the light and up to 10 km away.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.photometry import area

FILE = "photometry/area.glsl"
TEXT = Path(area.__file__).with_suffix(".glsl").read_text(encoding="utf-8")
FUNCTIONS = {
    name: (kind, [p.split()[-1] for p in parameters.split(",")])
    for kind, name, parameters in re.findall(r"^(\w+) (\w+)\(([^)]*)\)\s*\{", TEXT, re.MULTILINE)
}

N = 2048
#: One rounding to float32, relative.
R = 2.0**-24

rng = np.random.default_rng(1760)


def f32(values: Any) -> np.ndarray:
    return np.asarray(values, np.float32).astype(np.float64)


def unit() -> np.ndarray:
    v = rng.normal(size=(N, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


AXIS = unit()
X = np.cross(AXIS, unit())
X *= rng.uniform(0.05, 1.0, (N, 1)) / np.linalg.norm(X, axis=1, keepdims=True)
ROUND = np.cross(AXIS, X)
SHEARED = rng.uniform(0.2, 2.0, (N, 1)) * ROUND + rng.uniform(-0.5, 0.5, (N, 1)) * X
HALF = np.linalg.norm(X, axis=1) + np.linalg.norm(SHEARED, axis=1)
NORMAL = unit()
RADIUS = f32(HALF * rng.uniform(0.1, 0.4, N))


def places(low: float, high: float) -> np.ndarray:
    """Vectors to the light of ``low`` to ``high`` times its size, all in front of it."""
    away = unit()
    away -= 2.0 * np.maximum(np.sum(away * AXIS, axis=1), 0.0)[:, None] * AXIS
    return f32(away * (HALF * np.exp(rng.uniform(np.log(low), np.log(high), N)))[:, None])


def glsl(gl: Any, name: str, *inputs: np.ndarray) -> np.ndarray:
    kind, parameters = FUNCTIONS[name]
    arrays = dict(zip(parameters, inputs, strict=True))
    return evaluate(gl, FILE, name, arrays, kind).astype(np.float64)


def test_twins_have_the_same_parameters() -> None:
    for name, (_, parameters) in FUNCTIONS.items():
        assert list(inspect.signature(getattr(area, name)).parameters) == parameters


def test_constants_are_the_same() -> None:
    numbers = {float(v) for v in re.findall(r"(?<![\w.])\d+\.\d+", TEXT)}
    step = 2.0 * np.pi / area.SIDES
    wanted = [area.FAR**2, np.cos(step), np.sin(step), np.sqrt(step / np.sin(step))]
    wanted += [*area.STRIPS, *area.STRIP_WEIGHTS]
    for value in wanted:
        assert min(abs(value - n) for n in numbers) <= R * value
    assert f"AREA_SIDES = {area.SIDES};" in TEXT


def test_seen_part(gl: Any) -> None:
    first, last = (f32(rng.uniform(-1, 1, N)) for _ in range(2))
    first[:3], last[:3] = (0.0, -1.0, 0.0), (0.0, -1.0, -1.0)
    got = glsl(gl, "seen_part", first, last)
    # A difference, rounded, and a quotient of it.
    assert got == pytest.approx(area.seen_part(first, last), abs=6 * R)
    assert got[:3].tolist() == [[0, 1], [0, 0], [0, 0]]


@pytest.mark.parametrize(("low", "high", "share"), [(0.01, 1.0, 3e-6), (1.0, 50.0, 1e-4)])
def test_edge_term(gl: Any, low: float, high: float, share: float) -> None:
    start = places(low, high)
    part = f32(np.sort(rng.uniform(0, 1, (N, 2)), axis=1))
    got = glsl(gl, "edge_term", start, f32(2 * X), f32(NORMAL), part)
    wanted = area.edge_term(start, f32(2 * X), f32(NORMAL), part)
    size = np.linalg.norm(X, axis=1) / np.linalg.norm(start, axis=1)
    assert np.max(np.abs(got - wanted) / np.minimum(size, 1.0)) <= share


CASES: dict[str, tuple[np.ndarray, ...]] = {
    "rect_illuminance": (AXIS, X, SHEARED),
    "disk_illuminance": (AXIS, X, ROUND),
    "ellipse_illuminance": (X, SHEARED),
    "four_points": (X, SHEARED),
    "line_mean": (X,),
    "sphere_illuminance": (RADIUS,),
    "cylinder_illuminance": (X, RADIUS),
}
#: From, to, in sizes of the light; largest difference as a share of 1 / d^2.
RANGES = [(0.05, 2.0, 1e-4), (2.0, 60.0, 1e-3), (60.0, 1e4, 2e-5)]


@pytest.mark.parametrize(("low", "high", "share"), RANGES)
@pytest.mark.parametrize("name", CASES)
def test_illuminance(gl: Any, name: str, low: float, high: float, share: float) -> None:
    if name == "ellipse_illuminance" and high > 100.0:
        pytest.skip("disk_illuminance asks it only for what is near")
    p = places(low, high)
    inputs = [p, f32(NORMAL), *map(f32, CASES[name])]
    got, wanted = glsl(gl, name, *inputs), getattr(area, name)(*inputs)
    assert np.isfinite(got).all()
    d2 = np.sum(p * p, axis=1)
    face = np.maximum(1.0 / d2, wanted)
    if name in ("four_points", "line_mean"):
        face = np.maximum(d2**-1.5, wanted)
    assert np.max(np.abs(got - wanted) / face) <= share


def test_an_ellipse_goes_by_its_polygon(gl: Any) -> None:
    p = places(0.1, 20.0)
    inputs = [p, f32(NORMAL), f32(AXIS), f32(X), f32(SHEARED)]
    got, wanted = glsl(gl, "disk_illuminance", *inputs), area.disk_illuminance(*inputs)
    face = np.maximum(1.0 / np.sum(p * p, axis=1), wanted)
    assert np.max(np.abs(got - wanted) / face) <= 1e-3


def test_circle(gl: Any) -> None:
    p, r2 = places(0.05, 1e4), f32(np.sum(X * X, axis=1))
    got = glsl(gl, "circle_illuminance", p, f32(NORMAL), f32(AXIS), r2)
    wanted = area.circle_illuminance(p, f32(NORMAL), f32(AXIS), r2)
    d2 = np.sum(p * p, axis=1)
    # Relative to the light face on: some 30 roundings, and those of the way from the axis.
    assert np.max(np.abs(got - wanted) / np.maximum(1.0 / d2, wanted)) <= 60 * R


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_infinite(gl: Any, name: str) -> None:
    """On the light, in its plane, at its rim, inside of it."""
    x = np.broadcast_to([0.5, 0.0, 0.0], (6, 3))
    y = np.broadcast_to([0.0, 0.5, 0.0], (6, 3))
    p = np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0, 1e-9], [0.5, 0, 1e-6], [2, 0, 0]])
    n = np.broadcast_to([0.0, 0.0, 1.0], (6, 3))
    shapes = {3: (-n, x, y), 2: (x, y), 1: (x,)}
    given: tuple[np.ndarray, ...] = shapes[len(CASES[name])]
    if name == "sphere_illuminance":
        given = (np.full(6, 0.5),)
    elif name == "cylinder_illuminance":
        given = (x, np.full(6, 0.5))
    assert np.isfinite(glsl(gl, name, p, n, *given)).all()
    assert np.isfinite(getattr(area, name)(p, n, *given)).all()


def test_a_circle_beyond_the_fourth_root_of_float32(gl: Any) -> None:
    p = f32([[6e9, 0.0, 8e9], [0.0, 0.0, 1e10]])
    n = np.array([[0.0, 0.0, 1.0]] * 2)
    got = glsl(gl, "circle_illuminance", p, n, -n, np.ones(2))
    assert got == pytest.approx([0.64e-20, 1e-20], rel=20 * R)
