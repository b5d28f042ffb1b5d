"""photometry/highlight.glsl against its NumPy twin."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.photometry import highlight

FILE = "photometry/highlight.glsl"
TEXT = Path(highlight.__file__).with_suffix(".glsl").read_text(encoding="utf-8")
FUNCTIONS = {
    name: (kind, [p.split()[-1] for p in parameters.split(",")])
    for kind, name, parameters in re.findall(r"^(\w+) (\w+)\(([^)]*)\)\s*\{", TEXT, re.MULTILINE)
}

N = 2048
#: One rounding to float32, relative.
R = 2.0**-24

rng = np.random.default_rng(2013)


def f32(values: Any) -> np.ndarray:
    return np.asarray(values, np.float32).astype(np.float64)


def unit() -> np.ndarray:
    v = rng.normal(size=(N, 3))
    return f32(v / np.linalg.norm(v, axis=1, keepdims=True))


P, RAY, VIEW = f32(3.0 * unit()), unit(), unit()
AXIS = unit()
X = f32(np.cross(AXIS, unit()) * rng.uniform(0.1, 1.0, (N, 1)))
Y = f32(np.cross(AXIS, X) * rng.uniform(0.3, 2.0, (N, 1)) + 0.3 * X)
RADIUS = f32(rng.uniform(0.01, 0.5, N))
SHARE, NL, MIDDLE = f32(rng.uniform(0, 1, N)), f32(rng.uniform(-1, 1, N)), f32(rng.uniform(0, 1, N))
AREA = f32(10.0 ** rng.uniform(-8, 0, (N, 2)))
ALPHA2 = f32(10.0 ** rng.uniform(-6, 0, N))

#: Inputs; largest difference, absolute and relative. Points lie within 4 m: some 30 roundings
#: of that, but where the ray meets the plane at a grazing angle the place along it is as
#: uncertain as the sine is small: those are left out. Half vectors cancel where light and eye
#: are opposite: left out too.
CASES: dict[str, tuple[tuple[np.ndarray, ...], float, float]] = {
    "plane_offset": ((P, RAY, AXIS), 400 * R, 60 * R),
    "plane_coordinates": ((P, X, Y), 0.0, 400 * R),
    "rect_point": ((P, RAY, AXIS, X, Y), 400 * R, 0.0),
    "disk_point": ((P, RAY, AXIS, X, Y), 400 * R, 0.0),
    "sphere_point": ((P, RAY, RADIUS), 60 * R, 0.0),
    "cylinder_point": ((P, RAY, X, RADIUS), 2000 * R, 0.0),
    "spread": ((P, VIEW, X, Y), 60 * R, 200 * R),
    "sphere_spread": ((P, VIEW, RADIUS), 60 * R, 200 * R),
    "highlight_share": ((SHARE, NL, MIDDLE), 8 * R * 4, 0.0),
    "blinn_alpha2": ((f32(rng.uniform(0, 1000, N)),), 0.0, 6 * R),
}


def glsl(gl: Any, name: str, *inputs: np.ndarray) -> np.ndarray:
    kind, parameters = FUNCTIONS[name]
    arrays = dict(zip(parameters, inputs, strict=True))
    return evaluate(gl, FILE, name, arrays, kind).astype(np.float64)


def test_twins_have_the_same_parameters() -> None:
    for name, (_, parameters) in FUNCTIONS.items():
        assert list(inspect.signature(getattr(highlight, name)).parameters) == parameters
    assert FUNCTIONS.keys() == CASES.keys() | {"lobe_share"}


@pytest.mark.parametrize("name", CASES)
def test_glsl_agrees_with_numpy(gl: Any, name: str) -> None:
    inputs, absolute, relative = CASES[name]
    got, wanted = glsl(gl, name, *inputs), getattr(highlight, name)(*inputs)
    clear = np.ones(N, np.bool_)
    if name in ("plane_offset", "rect_point", "disk_point"):
        clear = np.abs(np.sum(RAY * AXIS, axis=1)) > 0.1
    elif name in ("spread", "sphere_spread"):
        clear = np.sum(P * VIEW, axis=1) > -2.0
    elif name == "plane_coordinates":
        clear = np.abs(wanted).min(axis=1) > 0.1
    error = np.abs(got - wanted).reshape(N, -1).max(axis=1)
    size = np.abs(wanted).reshape(N, -1).max(axis=1)
    assert np.all((error <= absolute + relative * size)[clear])


@pytest.mark.parametrize("k", [1.0, highlight.STRAIGHT])
def test_lobe_share(gl: Any, k: float) -> None:
    got = glsl(gl, "lobe_share", AREA, np.full(N, k), ALPHA2)
    # Two quotients, a root, three products and two sums.
    assert got == pytest.approx(highlight.lobe_share(AREA, k, ALPHA2), rel=25 * R)
