"""The curve in GLSL against NumPy, and every variant of ward97 as an operator."""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.testing import check_operator
from hdrusd.tonemap.curve import (
    Curve,
    curve,
    curve_at,
    curve_shown,
    curve_step,
    curve_value,
)
from hdrusd.tonemap.operator import OPERATORS

VARIANTS = [
    {"ceiling": "human"},
    {"method": "linear"},
    {"method": "linear", "ceiling": "human"},
    {"weights": "centre"},
    {"weights": "gaze"},
    {"solver": "pcond"},
    {"solver": "pcond", "ceiling": "human"},
    {"solver": "pcond", "method": "linear"},
    {"white": 1000.0, "black": 0.001},
]


@pytest.mark.parametrize("params", VARIANTS)
def test_operator(gl: Any, params: dict) -> None:
    check_operator(OPERATORS["ward97"], gl, params)


def test_parts(gl: Any) -> None:
    random = np.random.default_rng(2)
    table = math.log(0.01) + np.cumsum(random.uniform(0.0, 0.2, 101))
    uniforms = Curve(-8.0, 9.0, table, 0.01, 900.0).uniforms()
    y = np.concatenate([[0.0, 1e-38], np.geomspace(1e-6, 1e12, 3000)]).astype(np.float32)
    got = evaluate(gl, "tonemap/curve.glsl", "curve_value", {"y": y}, "float", uniforms=uniforms)
    # ln y is up to 28 and off by a few of its roundings, 2e-6 each; so is what follows from it,
    # relatively, times the steepest slope, 0.2 / 0.17. Then the roundings of the division.
    wanted = curve_value(y, uniforms)
    np.testing.assert_allclose(got, wanted, rtol=2e-5, atol=1e-6)
    rgb = y[:, None] * random.uniform(0.0, 2.0, (y.size, 3)).astype(np.float32)
    got = evaluate(gl, "tonemap/curve.glsl", "curve", {"rgb": rgb}, "vec3", uniforms=uniforms)
    np.testing.assert_allclose(got, curve(rgb, uniforms), rtol=1e-4, atol=1e-5)


def test_steps_of_the_curve(gl: Any) -> None:
    """The shader takes them one by one; places are up to 250 and off by roundings of 2e-5."""
    random = np.random.default_rng(4)
    table = math.log(0.01) + np.cumsum(random.uniform(0.0, 0.2, 101))
    uniforms = Curve(-8.0, 9.0, table, 0.01, 900.0).uniforms()

    def on_gpu(name: str, arrays: dict[str, np.ndarray], kind: str, *read: str) -> np.ndarray:
        own = {f"curve_{key}": uniforms[f"curve_{key}"] for key in read}
        return evaluate(gl, "tonemap/curve.glsl", name, arrays, kind, uniforms=own)

    rgb = np.geomspace(1e-6, 1e12, 3000)[:, None] * random.uniform(0.1, 2.0, (3000, 3))
    rgb = rgb.astype(np.float32)
    at = curve_at(rgb, uniforms)
    np.testing.assert_allclose(on_gpu("curve_at", {"rgb": rgb}, "float", "place"), at, atol=1e-4)
    # Every step by its middle, and what lies beyond both ends.
    at = np.concatenate([np.arange(-3.0, 106.0) + 0.5, [-1e3, 1e6]]).astype(np.float32)
    steps = curve_step(at, uniforms)
    got = on_gpu("curve_step", {"at": at}, "vec2", "steps", "last")
    np.testing.assert_array_equal(got, steps)
    assert len(np.unique(steps, axis=0)) == 102
    wanted = curve_shown(at, steps, uniforms)
    arrays = {"at": at, "from": steps.astype(np.float32)}
    got = on_gpu("curve_shown", arrays, "float", "to", "last")
    np.testing.assert_allclose(got, wanted, rtol=2e-5, atol=1e-6)


def test_one_texel(gl: moderngl.Context) -> None:
    uniforms = Curve(0.0, 1.0, np.array([1.0, 2.0]), 1.0, 50.0).uniforms()
    y = np.array([0.5, 1.0, 1.5, math.e, 5.0, 1e9])
    got = evaluate(gl, "tonemap/curve.glsl", "curve_value", {"y": y}, "float", uniforms=uniforms)
    # In proportion: e times as bright, all the way.
    np.testing.assert_allclose(got, np.clip((math.e * y - 1.0) / 49.0, 0.0, 1.0), rtol=1e-5)
