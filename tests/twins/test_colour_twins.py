"""colour.glsl against colour.py. EPS is a rounding of float32, 2^-24."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd import colour
from hdrusd.gpu.evaluate import evaluate

EPS = 2.0**-24
RANDOM = np.random.default_rng(3)
#: Nine decades of luminance and every hue, with black and the sun.
SCENE = np.concatenate(
    [
        10.0 ** RANDOM.uniform(-3.0, 6.0, (500, 1)) * RANDOM.uniform(0.0, 1.0, (500, 3)),
        np.zeros((1, 3)),
        np.full((1, 3), 1.6e9),
    ]
).astype(np.float32)
UNIT = np.concatenate([np.linspace(0.0, 1.0, 3000), [0.0031308, 0.04045]]).astype(np.float32)
GREYS = np.repeat(UNIT[:, None], 3, axis=1)


def glsl(gl: Any, call: str, arrays: dict[str, Any], kind: str) -> np.ndarray:
    return evaluate(gl, "colour.glsl", call, arrays, kind)


def test_luminance(gl: Any) -> None:
    got = glsl(gl, "luminance", {"rgb": SCENE}, "float")
    # Three products, two sums, and the weights themselves rounded.
    np.testing.assert_allclose(got, colour.luminance(SCENE.astype(np.float64)), rtol=6 * EPS)


def test_clean(gl: Any) -> None:
    odd = [np.nan, -np.nan, -1.0, np.inf, -np.inf, 0.0, -0.0, 1e-30, 3.5, 1e13, 3e38]
    rgb = np.array(np.meshgrid(odd, odd, odd), np.float32).reshape(3, -1).T
    np.testing.assert_array_equal(glsl(gl, "clean", {"rgb": rgb}, "vec3"), colour.clean(rgb))


def test_with_luminance(gl: Any) -> None:
    target = RANDOM.uniform(0.0, 2.0, len(SCENE)).astype(np.float32)
    got = glsl(gl, "with_luminance", {"rgb": SCENE, "y": target}, "vec3")
    wanted = colour.with_luminance(SCENE.astype(np.float64), target.astype(np.float64))
    # Luminance (6), a division that need not be exact (2.5 ulp in GLSL 4), a product.
    np.testing.assert_allclose(got, wanted, rtol=12 * EPS)


def test_to_gamut(gl: Any) -> None:
    rgb = np.array(SCENE / SCENE[:, :1].clip(1e-3) * RANDOM.uniform(0, 3, (len(SCENE), 1)), "f4")
    y = colour.luminance(rgb.astype(np.float64)).astype(np.float32)
    got = glsl(gl, "to_gamut", {"rgb": rgb, "y": y}, "vec3")
    wanted = colour.to_gamut(rgb.astype(np.float64), y.astype(np.float64))
    # Two differences of numbers up to the largest channel, a quotient, a product, a sum.
    np.testing.assert_allclose(got, wanted, rtol=0, atol=12 * EPS)


def test_srgb_encode_fit(gl: Any) -> None:
    got = glsl(gl, "srgb_encode_fit", {"x": GREYS}, "vec3")
    # Two roots (2.5 ulp each where a driver takes them from inversesqrt), three products and
    # sums of terms up to 1.1.
    wanted = colour.srgb_encode_fit(GREYS.astype(np.float64))
    np.testing.assert_allclose(got, wanted, rtol=0, atol=16 * EPS)


def test_srgb_decode(gl: Any) -> None:
    got = glsl(gl, "srgb_decode", {"x": GREYS}, "vec3")
    # pow() is exp2(2.4 log2): errors of either are some 1e-5 on weak drivers.
    wanted = colour.srgb_decode(GREYS.astype(np.float64))
    np.testing.assert_allclose(got, wanted, rtol=1e-4, atol=1e-6)


def test_dither(gl: Any) -> None:
    x, y = RANDOM.integers(0, 16384, (2, 1000)).astype(np.uint32)
    got = glsl(gl, "dither", {"x": x, "y": y}, "float")
    np.testing.assert_array_equal(got, colour.dither(x, y))


@pytest.mark.parametrize("offset", [-0.498046875, 0.0, 0.498046875])
def test_quantise(gl: Any, offset: float) -> None:
    codes = (np.repeat(np.arange(256.0)[:, None], 3, axis=1) / 255.0).astype(np.float32)
    offsets = np.full(256, offset, np.float32)
    got = glsl(gl, "quantise", {"code": codes, "offset": offsets}, "uvec3")
    np.testing.assert_array_equal(got, colour.quantise(codes, offsets[:, None]))
    np.testing.assert_array_equal(got[:, 0], np.arange(256))
