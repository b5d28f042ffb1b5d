"""Encodings of colour.glsl against colour.py. pow() is exp2(y log2 x): 1e-5 on weak drivers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd import colour
from hdrusd.gpu.evaluate import evaluate

UNIT = np.linspace(0.0, 1.0, 1001).astype(np.float32)[:, None] * np.ones(3, np.float32)
LIGHT = np.geomspace(1e-4, 2e4, 1000).astype(np.float32)[:, None] * np.ones(3, np.float32)


def glsl(gl: Any, call: str, rgb: np.ndarray) -> np.ndarray:
    return evaluate(gl, "colour.glsl", call, {"rgb": rgb}, "vec3")


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("gamma_encode", (2.2,)),
        ("gamma_decode", (2.2,)),
        ("bt1886_encode", (0.1, 100.0)),
        ("bt1886_decode", (0.1, 100.0)),
        ("bt1886_encode", (0.0, 500.0)),
    ],
)
def test_relative(gl: Any, name: str, more: tuple) -> None:
    got = glsl(gl, f"{name}(rgb, {', '.join(map(str, more))})", UNIT)
    wanted = getattr(colour, name)(UNIT.astype(np.float64), *more)
    np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-5)


def test_pq_encode(gl: Any) -> None:
    got = glsl(gl, "pq_encode(rgb)", LIGHT)
    # The 79th power of a number near 1 whose log2 has an error of 2^-22: 2e-5.
    wanted = colour.pq_encode(LIGHT.astype(np.float64))
    np.testing.assert_allclose(got, wanted, rtol=0, atol=3e-5)


def test_pq_decode(gl: Any) -> None:
    got = glsl(gl, "pq_decode(rgb)", UNIT[1:])
    # Judged as a code value, like the other: a step of 12 bits is 2.4e-4.
    back = colour.pq_encode(got.astype(np.float64))
    np.testing.assert_allclose(back, UNIT[1:], rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", ["to_rec2020", "from_rec2020"])
def test_rec2020(gl: Any, name: str) -> None:
    rgb = np.random.default_rng(5).uniform(0.0, 100.0, (500, 3)).astype(np.float32)
    got = glsl(gl, name, rgb)
    # Three products of up to 166 and two sums, weights rounded: 8 roundings of 2^-24.
    wanted = getattr(colour, name)(rgb.astype(np.float64))
    np.testing.assert_allclose(got, wanted, rtol=0, atol=8 * 2.0**-24 * 166)
