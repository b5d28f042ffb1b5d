"""photometry/*.glsl against the NumPy functions of the same names.

float32 in the shader: one rounding is 2^-24 of the value. Inputs are rounded to float32
first, so that both sides see the same numbers.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hdrusd.photometry
from hdrusd.gpu.evaluate import evaluate
from hdrusd.photometry import light, reflectance
from hdrusd.photometry.light import HARD_EDGE

FOLDER = Path(hdrusd.photometry.__file__).parent
MODULES = {"light": light, "reflectance": reflectance}
N = 4096
ROUNDING = 2.0**-24

#: Abramowitz and Stegun 4.4.46 promises 2e-8 rad; its eight products and sums, the root, and
#: pi minus it are rounded to float32 near pi: 10 roundings of 2^-24 times pi at most.
ARCCOS = 2e-8 + 10 * ROUNDING * math.pi

rng = np.random.default_rng(2010)


def functions(name: str) -> dict[str, tuple[str, list[str]]]:
    """GLSL function name to (type, parameter names) of a photometry file."""
    text = (FOLDER / f"{name}.glsl").read_text(encoding="utf-8")
    found = re.findall(r"^(\w+) (\w+)\(([^)]*)\)\s*\{", text, re.MULTILINE)
    return {
        function: (kind, [p.split()[-1] for p in parameters.split(",")])
        for kind, function, parameters in found
    }


def f32(values: Any) -> np.ndarray:
    return np.asarray(values, np.float32).astype(np.float64)


def unit(count: int) -> np.ndarray:
    v = rng.normal(size=(count, 3))
    return f32(v / np.linalg.norm(v, axis=1, keepdims=True))


def log_range(low: float, high: float) -> np.ndarray:
    return f32(np.exp(rng.uniform(np.log(low), np.log(high), N)))


COSINES = f32(np.concatenate([[-1, -0.5, -0.0, 0, 0.5, 1], rng.uniform(-1, 1, N - 6)]))
INNER = f32(rng.uniform(0.0, 1.5, N))
EDGE = log_range(0.5, 100.0)
EXPONENTS = f32(np.concatenate([[0.0, 1.0, 128.0], rng.uniform(0, 128, N - 3)]))
SCALES = f32(np.where(np.arange(N) % 2, 1.0, 1 / math.pi))


def power(base: np.ndarray, exponent: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """What exp2(y log2 x) may be off by. GLSL 3.30 says nothing; Vulkan 1.3 does (Precision of
    SPIR-V Instructions): log2 within 2^-21 for x in [0.5, 2] and 3 ulp elsewhere, exp2 within
    3 + 2 |argument| ulp, numbers below 2^-126 may be 0.
    """
    ulp = 2 * ROUNDING
    log = np.log2(base)
    log_error = np.where((base >= 0.5) & (base <= 2.0), 2.0**-21, 3 * ulp * np.abs(log))
    argument = exponent * log
    argument_error = exponent * log_error + ROUNDING * np.abs(argument)
    relative = math.log(2) * argument_error + (3 + 2 * np.abs(argument)) * ulp
    return np.asarray(wanted * relative + 2.0**-126)


def cone_error(cosine: Any, inner: Any, inverse_width: Any) -> np.ndarray:
    # The slope of a smoothstep is 1.5 at most, so the angle's error counts 1.5 / width times.
    return np.asarray(1.5 * inverse_width * (ARCCOS + 2 * ROUNDING * math.pi) + 6 * ROUNDING)


def focus_error(cosine: Any, exponent: Any) -> np.ndarray:
    base = np.maximum(np.abs(cosine), 1e-9)
    return power(base, exponent, base**exponent)


def blinn_error(cosine: Any, shininess: Any, scale: Any) -> np.ndarray:
    base = np.maximum(cosine, 1e-9)
    norm = np.where(scale < 1.0, (shininess + 8.0) / 8.0 * scale, 1.0)
    return power(base, shininess, base**shininess) * norm + 4 * ROUNDING * base**shininess * norm


def half_error(nl: Any, nv: Any, lv: Any) -> np.ndarray:
    # 2 + 2 L.V cancels: its error of two roundings of 2, relative to what is left, halved by
    # the root; inversesqrt has 2 roundings more, the sum and the product one each.
    left = np.maximum(2.0 + 2.0 * lv, 1e-12)
    return np.abs(nl + nv) / np.sqrt(left) * (4 * ROUNDING / left + 5 * ROUNDING) + 2 * ROUNDING


L, NORMAL, VIEW = unit(N), unit(N), unit(N)
NL, NV, LV = (f32(np.sum(a * b, axis=1)) for a, b in ((L, NORMAL), (NORMAL, VIEW), (L, VIEW)))
POINT = f32(rng.uniform(-100, 100, (N, 3)))
POSITION = f32(rng.uniform(-100, 100, (N, 3)))
W = f32(np.arange(N) % 2)

#: Inputs, and the largest absolute difference, for each function.
CASES: dict[str, tuple[tuple[np.ndarray, ...], Callable[..., Any]]] = {
    "angle_from_cosine": ((COSINES,), lambda c: np.full(N, ARCCOS)),
    "cone_factor": ((COSINES, INNER, EDGE), cone_error),
    "focus_factor": ((COSINES, EXPONENTS), focus_error),
    # One product, exact for w of 0 and 1, and one difference.
    "light_vector": ((POSITION, W, POINT), lambda p, w, q: np.full((N, 3), 200 * ROUNDING)),
    # One product.
    "illuminance": (
        (COSINES, log_range(1e-8, 1e8), log_range(1e-4, 1e6)),
        lambda c, i, r: np.maximum(c, 0.0) * np.minimum(i, r) * 2 * ROUNDING,
    ),
    # Two products.
    "lambert": (
        (f32(rng.uniform(0, 1, (N, 3))), f32(rng.uniform(0, 1e5, (N, 3))), SCALES),
        lambda r, e, s: r * e * s[:, None] * 3 * ROUNDING,
    ),
    "half_cosine": ((NL, NV, LV), half_error),
    "blinn_phong": ((COSINES, EXPONENTS, SCALES), blinn_error),
}


@pytest.mark.parametrize("name", MODULES)
def test_every_glsl_function_has_a_twin_with_the_same_parameters(name: str) -> None:
    found = functions(name)
    assert found
    for function, (_, parameters) in found.items():
        twin = getattr(MODULES[name], function)
        assert list(inspect.signature(twin).parameters) == parameters
    assert found.keys() <= CASES.keys()


@pytest.mark.parametrize("function", CASES)
def test_glsl_agrees_with_numpy(gl: Any, function: str) -> None:
    name = next(name for name in MODULES if function in functions(name))
    kind, parameters = functions(name)[function]
    inputs, error = CASES[function]
    got = evaluate(
        gl, f"photometry/{name}.glsl", function, dict(zip(parameters, inputs, strict=True)), kind
    ).astype(np.float64)
    # A factor for all channels of a vector.
    shaped = [x[:, None] if x is SCALES and kind == "vec3" else x for x in inputs]
    wanted = getattr(MODULES[name], function)(*shaped)
    over = np.abs(got - wanted) - np.broadcast_to(error(*inputs), wanted.shape)
    worst = np.unravel_index(int(np.argmax(over)), over.shape)
    assert over[worst] <= 0.0, (
        f"{function}: {[x[worst[0]] for x in inputs]}: GLSL {got[worst]}, NumPy {wanted[worst]}"
    )


def test_a_hard_edge_is_hard_in_both(gl: Any) -> None:
    degrees = np.array([0.0, 29.99, 30.01, 90.0, 180.0])
    inputs = {
        "cosine": np.cos(np.radians(degrees)),
        "inner": np.full(5, math.radians(30.0)),
        "inverse_width": np.full(5, HARD_EDGE),
    }
    got = evaluate(gl, "photometry/light.glsl", "cone_factor", inputs, "float")
    assert got.tolist() == [1.0, 1.0, 0.0, 0.0, 0.0]
    assert light.cone_factor(*inputs.values()) == pytest.approx(got)
