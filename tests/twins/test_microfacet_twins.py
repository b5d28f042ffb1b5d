"""photometry/microfacet.glsl against its NumPy twin: roundings of float32, counted."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.photometry import microfacet

FILE = "photometry/microfacet.glsl"
TEXT = Path(microfacet.__file__).with_suffix(".glsl").read_text(encoding="utf-8")
FUNCTIONS = {
    name: (kind, [p.split()[-1] for p in parameters.split(",")])
    for kind, name, parameters in re.findall(r"^(\w+) (\w+)\(([^)]*)\)\s*\{", TEXT, re.MULTILINE)
}

N = 4096
#: One rounding to float32, relative. GLSL 3.30 promises nothing for roots and quotients;
#: Vulkan 1.3 (Precision of SPIR-V Instructions) does: 2 ulp for 1 / sqrt(x), from which a root
#: follows with 2.5 ulp more, and 2.5 ulp for a quotient.
R = 2.0**-24
INVERSE_ROOT, ROOT, QUOTIENT = 4 * R, 9 * R, 5 * R
SMALLEST = 2.0**-126

rng = np.random.default_rng(1967)


def f32(values: Any) -> np.ndarray:
    return np.asarray(values, np.float32).astype(np.float64)


def uniform(low: float, high: float, *more: int) -> np.ndarray:
    return f32(rng.uniform(low, high, (N, *more)))


def unit(vectors: np.ndarray) -> np.ndarray:
    return f32(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


NORMAL = unit(rng.normal(size=(N, 3)))
VIEW = unit(rng.normal(size=(N, 3)))
#: Half of the lights anywhere, half where the mirror sends the view, to within 0.1 to 1e-4.
AROUND = rng.normal(size=(N, 3)) * np.exp(rng.uniform(np.log(1e-4), np.log(0.1), (N, 1)))
MIRRORED = 2 * np.sum(NORMAL * VIEW, axis=1)[:, None] * NORMAL - VIEW + AROUND
LIGHT = unit(np.where(np.arange(N)[:, None] % 2, MIRRORED, rng.normal(size=(N, 3))))
NL, NV = (f32(np.sum(NORMAL * other, axis=1)) for other in (LIGHT, VIEW))
COSINE = f32(np.concatenate([[-1, -0.1, -0.0, 0.0, 1e-6, 1.0], rng.uniform(-0.2, 1.0, N - 6)]))
ALPHA2 = f32(np.exp(rng.uniform(np.log(1e-6), 0.0, N)))
SINE2 = f32(np.concatenate([[0.0, 1.0], np.exp(rng.uniform(np.log(1e-9), 0.0, N - 2))]))
SQUARES = f32(np.stack([SINE2, np.ones(N)], 1) * np.exp(rng.uniform(np.log(1e-8), 1.3, (N, 1))))
F0, F90 = uniform(0.0, 1.0, 3) ** 2, uniform(0.0, 1.0, 3)
F0 = f32(F0)
UNIT = uniform(0.0, 1.0)


def half_error() -> np.ndarray:
    """Each part of L + V and of n (N.L + N.V), up to 2, is rounded; so are s and the squares."""
    h = LIGHT + VIEW
    h2 = np.sum(h * h, axis=1)
    s = np.sqrt(np.maximum(h2 - (NL + NV) ** 2, 0.0))
    part = 6 * R * np.sqrt(3.0)
    # The three squares and their sum; a half vector that is cut off at the surface is all of it.
    return np.stack([2 * s * part + part**2 + 12 * R * h2, 12 * R * h2], axis=1)


SIDE = ROOT + 6 * R
CASES: dict[str, tuple[tuple[np.ndarray, ...], Any]] = {
    # A mixture of two numbers up to 1.
    "grazing_reflectance": ((F0 * 0.1, UNIT), lambda f90: np.full((N, 3), 5 * R)),
    # The fifth power of a difference, by three products.
    "schlick_weight": ((COSINE,), lambda w: w * 9 * R + SMALLEST),
    "fresnel": ((F0, F90, UNIT), lambda f: np.full((N, 3), 4 * R)),
    "half_squares": ((NORMAL, LIGHT, VIEW, NL, NV), lambda h: half_error()),
    "smith_side": ((COSINE, ALPHA2), lambda s: s * SIDE),
    "ggx_gain": (
        (COSINE, ALPHA2, f32(np.where(np.arange(N) % 2, 1.0, 1 / np.pi))),
        lambda g: g * (SIDE + QUOTIENT + 3 * R),
    ),
    # The sum under the square has 4 roundings, which count twice; four products more.
    "ggx_lobe_of_half": (
        (f32(np.exp(rng.uniform(-14, 1, N))), ALPHA2, COSINE, SQUARES),
        lambda f: f * (SIDE + QUOTIENT + 14 * R),
    ),
    "layered": ((F90, F0, f32(np.exp(rng.uniform(-9, 12, N)))), lambda f: (np.abs(f) + 1) * 5 * R),
    "coat_reflectance": ((UNIT, UNIT[::-1].copy()), lambda f: f * 5 * R),
}


def test_every_function_is_compared_and_has_the_same_parameters() -> None:
    assert FUNCTIONS.keys() == CASES.keys()
    for name, (_, parameters) in FUNCTIONS.items():
        twin = inspect.signature(getattr(microfacet, name))
        assert list(twin.parameters) == parameters


@pytest.mark.parametrize("name", CASES)
def test_glsl_agrees_with_numpy(gl: Any, name: str) -> None:
    kind, parameters = FUNCTIONS[name]
    inputs, error = CASES[name]
    got = evaluate(gl, FILE, name, dict(zip(parameters, inputs, strict=True)), kind)
    wanted = getattr(microfacet, name)(*inputs)
    over = np.abs(got.astype(np.float64) - wanted) - error(wanted)
    worst = np.unravel_index(int(np.argmax(over)), over.shape)
    assert over[worst] <= 0.0, (
        f"{[x[worst[0]] for x in inputs]}: GLSL {got[worst]}, NumPy {wanted[worst]}"
    )


def test_a_narrow_highlight_keeps_its_digits_in_float32(gl: Any) -> None:
    """With alpha = 0.001, over the lobe the shader is within 0.1 % of NumPy in float64.

    A direction is rounded by 6e-8, a lobe of 1e-3 changes by four times that over 1e-3.
    """
    view = np.array([0.6, 0.0, 0.8])
    tilt = np.linspace(0.0, 3e-3, N)  # of the half vector
    half = np.stack([np.sin(tilt), np.zeros(N), np.cos(tilt)], axis=1)
    light = 2.0 * (half @ view)[:, None] * half - view
    columns = {"n": np.tile([0.0, 0.0, 1.0], (N, 1)), "l": light, "v": np.tile(view, (N, 1))}
    text = (
        "ggx_lobe_of_half(ggx_gain(dot(n, v), 1e-6, 1.0), 1e-6, dot(n, l),"
        " half_squares(n, l, v, dot(n, l), dot(n, v)))"
    )
    got = evaluate(gl, FILE, text, columns, "float")
    alpha2 = np.float64(1e-6)
    gain = microfacet.ggx_gain(np.float64(0.8), alpha2, 1.0)
    wanted = microfacet.ggx_lobe(gain, alpha2, light[:, 2], np.sin(tilt) ** 2)
    np.testing.assert_allclose(got, wanted, rtol=1e-3)
