"""photometry/sky.glsl and environment.glsl against the NumPy functions of the same names."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.photometry.environment import (
    blur_level,
    main_direction,
    mean_schlick,
    reflected,
    table_place,
)
from hdrusd.photometry.sky import ambient_lux, sh_polynomials, sky_uv

SKY, ENVIRONMENT = "photometry/sky.glsl", "photometry/environment.glsl"
ROUNDING = 2.0**-24
N = 4096

#: What a driver's atan may be off by, rad: GLSL 3.30 says nothing; Vulkan 1.3 (Precision of
#: SPIR-V Instructions) grants 4096 ulp, of angles up to pi.
ATAN = 4096 * 2 * ROUNDING * math.pi

rng = np.random.default_rng(2013)


def f32(values: Any) -> Any:
    return np.asarray(values, np.float32).astype(np.float64)


def unit(count: int = N) -> Any:
    v = rng.normal(size=(count, 3))
    return f32(v / np.linalg.norm(v, axis=1, keepdims=True))


def test_sky_uv(gl: Any) -> None:
    directions = np.concatenate([unit(), np.eye(3), -np.eye(3)])
    got = evaluate(gl, SKY, "sky_uv", {"direction": directions}, "vec2")
    wanted = sky_uv(directions)
    around = np.abs(got[:, 0] - wanted[:, 0])
    # u of 0 and 1 are the same meridian; at the poles any longitude is right.
    level = np.hypot(directions[:, 0], directions[:, 2]) > 1e-6
    assert np.minimum(around, 1.0 - around)[level].max() <= ATAN / (2 * math.pi) + 2 * ROUNDING
    assert np.abs(got[:, 1] - wanted[:, 1]).max() <= ATAN / math.pi + 2 * ROUNDING


def test_ambient_lux(gl: Any) -> None:
    normals = unit()
    coefficients = f32(rng.normal(size=(18, 3)) * 10.0 + [[20.0, 0.0, -20.0]])
    rows = ", ".join("vec3({!r}, {!r}, {!r})".format(*row) for row in coefficients.tolist())
    expression = f"ambient_lux(normal, vec3[18]({rows}))"
    got = evaluate(gl, SKY, expression, {"normal": normals}, "vec3")
    wanted = ambient_lux(normals, coefficients)
    assert (wanted == 0.0).any()
    # Each term is a product of at most 8 factors and sums, and there are 18 to add.
    sizes = np.abs(sh_polynomials(np.abs(normals))) @ np.abs(coefficients)
    # 35 z^4 - 30 z^2 + 3 and its like cancel: what they are made of is up to 68.
    assert np.all(np.abs(got - wanted) <= 26 * ROUNDING * (sizes + 68 * np.abs(coefficients).max()))


def test_blur_level(gl: Any) -> None:
    alpha = f32(np.concatenate([[0.0, 1e-3, 1.0], np.exp(rng.uniform(-9, 0, N))]))
    got = evaluate(gl, ENVIRONMENT, "blur_level", {"alpha": alpha}, "float")
    # log2: 3 ulp or 2^-21 (Vulkan 1.3), of up to 14; a product and a sum.
    assert np.abs(got - blur_level(alpha)).max() <= 14 * 8 * ROUNDING + 2.0**-21


def test_table_place(gl: Any) -> None:
    inputs = {"nv": f32(rng.uniform(-0.1, 1.1, N)), "alpha": f32(rng.uniform(0, 1, N))}
    got = evaluate(gl, ENVIRONMENT, "table_place", inputs, "vec2")
    assert np.abs(got - table_place(**inputs)).max() <= 8 * ROUNDING


def test_main_direction(gl: Any) -> None:
    inputs = {"normal": unit(), "mirrored": unit(), "alpha": f32(rng.uniform(0, 1, N))}
    got = evaluate(gl, ENVIRONMENT, "main_direction", inputs, "vec3")
    assert np.abs(got - main_direction(**inputs)).max() <= 16 * ROUNDING


def test_reflected(gl: Any) -> None:
    inputs = {"f0": f32(rng.uniform(0, 1, (N, 3))), "f90": f32(rng.uniform(0, 1, (N, 3)))}
    inputs["entry"] = f32(rng.uniform(0, 1, (N, 2)))
    got = evaluate(gl, ENVIRONMENT, "reflected", inputs, "vec3")
    assert np.abs(got - reflected(**inputs)).max() <= 4 * 2 * ROUNDING


def test_mean_schlick(gl: Any) -> None:
    nv = f32(np.linspace(0.0, 1.0, N))
    got = evaluate(gl, ENVIRONMENT, "mean_schlick", {"nv": nv}, "float")
    assert got == pytest.approx(mean_schlick(nv), abs=8 * 0.09 * ROUNDING)
