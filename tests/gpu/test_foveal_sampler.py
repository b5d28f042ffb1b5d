"""The foveal image made on the GPU against its definition in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd.eye.foveal import Foveal, foveal
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.foveal import FovealSampler
from hdrusd.gpu.program import Programs

FIELD = (60.0, 36.0)

#: A luminance is three products and two sums of float32: five roundings of 2^-24.
ONE = 5 * 2.0**-24


def texture(gl: Any, rgb: np.ndarray, dtype: str = "f4") -> Any:
    height, width = rgb.shape[:2]
    data = np.ascontiguousarray(rgb, {"f4": np.float32, "f2": np.float16}[dtype])
    return gl.texture((width, height), rgb.shape[2], data, dtype=dtype, alignment=1)


def night(height: int, width: int) -> np.ndarray:
    """Twelve decades of luminance and every hue."""
    random = np.random.default_rng(5)
    level = 10.0 ** random.uniform(-4.0, 8.0, (height, width, 1))
    return (level * random.uniform(0.1, 1.0, (height, width, 3))).astype(np.float32)


def agree(got: Foveal, wanted: Foveal, shape: tuple[int, ...]) -> None:
    fh, fw = wanted.rgb.shape[:2]
    # All terms are positive: a rounding for each of a sum, one for the mean.
    roundings = -(-shape[0] // fh) + -(-shape[1] // fw) + 2
    np.testing.assert_allclose(got.rgb, wanted.rgb, rtol=roundings * 2.0**-24)
    np.testing.assert_allclose(got.points, wanted.points, rtol=ONE)
    assert got.field == wanted.field


# More pixels than points, fewer, a sample a pixel, a line, a column, a pixel.
SIZES = [(288, 512), (97, 301), (40, 66), (35, 61), (1, 700), (700, 1), (1, 1), (2, 3), (480, 31)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("top_first", [True, False])
def test_equal_to_numpy(gl: Any, size: tuple[int, int], top_first: bool) -> None:
    rgb = night(*size)
    frame = rgb if top_first else rgb[::-1]
    got = FovealSampler(gl, Programs(gl)).sample(texture(gl, rgb), FIELD, top_first=top_first)
    agree(got, foveal(frame, FIELD), size)


@pytest.mark.parametrize("field", [(3.0, 2.0), (40.0, 24.0), (150.0, 120.0)])
def test_any_field(gl: Any, field: tuple[float, float]) -> None:
    rgb = night(211, 320)
    got = FovealSampler(gl, Programs(gl)).sample(texture(gl, rgb), field, top_first=True)
    agree(got, foveal(rgb, field), rgb.shape)


def test_rgba_and_half(gl: Any) -> None:
    rgb = np.clip(night(120, 200), 1e-3, 6e4).astype(np.float16)
    rgba = np.concatenate([rgb, np.full((120, 200, 1), 1e4, np.float16)], axis=-1)
    got = FovealSampler(gl, Programs(gl)).sample(texture(gl, rgba, "f2"), FIELD, top_first=True)
    agree(got, foveal(rgb.astype(np.float32), FIELD), rgb.shape)


def test_broken_pixels_do_not_spread(gl: Any) -> None:
    rgb = night(60, 100)
    rgb[3, 5] = np.nan
    rgb[14, 6] = -7.0
    rgb[25, 7, 1] = np.nan
    rgb[36, 8] = -np.inf
    rgb[47, 9] = np.inf
    got = FovealSampler(gl, Programs(gl)).sample(texture(gl, rgb), FIELD, top_first=True)
    agree(got, foveal(rgb, FIELD), rgb.shape)


def test_sizes_in_turn_and_context_as_it_was(gl: Any) -> None:
    sampler = FovealSampler(gl, Programs(gl))
    for size in ((60, 100), (64, 48), (60, 100)):
        rgb = night(*size)
        agree(sampler.sample(texture(gl, rgb), FIELD, top_first=True), foveal(rgb, FIELD), size)
    sampler.release()
    rgb = night(30, 30)
    agree(sampler.sample(texture(gl, rgb), FIELD, top_first=True), foveal(rgb, FIELD), (30, 30))
    # The resting framebuffer is bound again: without one this would be an OpenGL error.
    assert evaluate(gl, [], "x * 2.0", {"x": [1.0]}, "float").tolist() == [2.0]
