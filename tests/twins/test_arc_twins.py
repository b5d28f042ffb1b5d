"""photometry/arc.glsl against arc.py: a polynomial and counted roundings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.photometry import arc

FILE = "photometry/arc.glsl"
N = 2048

#: One rounding to float32, relative.
R = 2.0**-24

rng = np.random.default_rng(1760)


def f32(values: Any) -> np.ndarray:
    return np.asarray(values, np.float32).astype(np.float64)


def angle(gl: Any, sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    arrays = {"sine": sine, "cosine": cosine}
    return evaluate(gl, FILE, "arc_angle", arrays, "float").astype(np.float64)


def excess(gl: Any, tangent: np.ndarray) -> np.ndarray:
    return evaluate(gl, FILE, "arc_excess", {"tangent": tangent}, "float").astype(np.float64)


def test_the_rest_of_the_arctangent_is_what_its_name_says() -> None:
    t = np.concatenate([[1e-9, 9.99e-3, 1.001e-2, 1.0], rng.uniform(0.0, 1.0, N)])
    assert t + t**3 * arc.arctan_rest(t**2) == pytest.approx(np.arctan(t), rel=1e-14)
    assert arc.arctan_rest(np.array(0.0)) == pytest.approx(-1.0 / 3.0)


def test_arctan_rest(gl: Any) -> None:
    t = np.append(rng.uniform(0.0, 1.0, N), [0.0, 1.0])
    t2 = f32(t**2)
    got = evaluate(gl, FILE, "arctan_rest", {"t2": t2}, "float").astype(np.float64)
    # 2e-8 in the arctangent, that is in t^3 of it; 14 roundings of sums below 1/3.
    away = np.abs(got - arc.arctan_rest(t2)) * t2**1.5
    assert away.max() <= 2e-8 + 14 * R / 3.0


def test_arc_angle(gl: Any) -> None:
    turns = np.concatenate([[0.0, np.pi / 2, np.pi], rng.uniform(0.0, np.pi, N - 3)])
    size = np.exp(rng.uniform(-9.0, 9.0, N))
    sine, cosine = f32(np.maximum(np.sin(turns), 0.0) * size), f32(np.cos(turns) * size)
    # 2e-8 of the angle; a quotient (2.5 ulp), 16 products and sums of the series that count
    # with a third at most, and two differences of pi.
    error = 2e-8 * np.pi + 12 * R * np.pi
    assert angle(gl, sine, cosine) == pytest.approx(arc.arc_angle(sine, cosine), abs=error)
    assert angle(gl, np.zeros(2), np.zeros(2)).tolist() == [0.0, 0.0]


def test_a_small_angle_is_good_to_its_own_size(gl: Any) -> None:
    sine = f32(10.0 ** rng.uniform(-8.0, -2.0, N))
    got = angle(gl, sine, np.ones(N))
    assert got == pytest.approx(np.arctan(sine), rel=2e-8 + 12 * R)


def test_arc_excess(gl: Any) -> None:
    t = f32(10.0 ** rng.uniform(-6.0, 3.0, N))
    # The series has 2e-8 of t in all, which is 6e-8 of the third of t^3 that is left where
    # t is 1, and its first term is good to 2e-6 of itself where t is small.
    wanted = arc.arc_excess(t)
    assert np.abs(excess(gl, t) - wanted).max() <= 20 * R * 1e3
    small = t < 1.0
    got = excess(gl, t)[small]
    series = -(t**3) / 3 + t**5 / 5 - t**7 / 7
    exact = np.where(t < 0.03, series, np.arctan(t) - t)[small]
    assert got == pytest.approx(exact, rel=1e-5)
