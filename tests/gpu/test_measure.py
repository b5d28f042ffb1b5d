"""Statistics measured on the GPU against their definition in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd.colour import BRIGHTEST
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.measure import Measurer
from hdrusd.gpu.program import Programs
from hdrusd.tonemap.operator import FLOOR, Need, Statistics, statistics

#: A luminance is three products and two sums of float32: five roundings of 2^-24.
ONE = 5 * 2.0**-24
#: A block adds up 128 luminances.
SUM = ONE + 128 * 2.0**-24
#: A block's sum of log2 is below 128 x 40, so its last place is 2^-11 for 128 pixels; log2
#: itself errs by up to 2^-21 of 16 pixels, and each of their products by 2^-24.
LOG = ONE + np.log(2.0) * (2.0**-11 / 128 + 2.0**-21 / 16) + 2.0**-24
#: Half a bin: 1/256 of the lower end.
BIN = 1.0 / 256.0 + ONE


def texture(gl: Any, rgb: np.ndarray, dtype: str = "f4") -> Any:
    height, width = rgb.shape[:2]
    data = np.ascontiguousarray(rgb, {"f4": np.float32, "f2": np.float16}[dtype])
    return gl.texture((width, height), rgb.shape[2], data, dtype=dtype, alignment=1)


def measure(gl: Any, rgb: np.ndarray, need: Need = Need.PERCENTILES, dtype: str = "f4") -> Any:
    return Measurer(gl, Programs(gl)).measure(texture(gl, rgb, dtype), need)


def night(height: int, width: int) -> np.ndarray:
    """Twelve decades of luminance and every hue."""
    random = np.random.default_rng(7)
    level = 10.0 ** random.uniform(-4.0, 8.0, (height, width, 1))
    return (level * random.uniform(0.1, 1.0, (height, width, 3))).astype(np.float32)


def agree(got: Statistics, wanted: Statistics) -> None:
    assert got.log_average == pytest.approx(wanted.log_average, rel=LOG)
    assert got.minimum == pytest.approx(wanted.minimum, rel=ONE)
    assert got.maximum == pytest.approx(wanted.maximum, rel=ONE)
    assert got.average == pytest.approx(wanted.average, rel=SUM)
    assert got.p01 == pytest.approx(wanted.p01, rel=BIN)
    assert got.p99 == pytest.approx(wanted.p99, rel=BIN)


# Multiples of a block and of a bin texel, one more, one less, a line, a column, a pixel.
@pytest.mark.parametrize("size", [(64, 96), (65, 97), (63, 95), (1, 200), (200, 1), (1, 1), (3, 7)])
def test_equal_to_numpy(gl: Any, size: tuple[int, int]) -> None:
    rgb = night(*size)
    agree(measure(gl, rgb), statistics(rgb))


def test_rgba_and_half(gl: Any) -> None:
    rgb = np.clip(night(33, 50), 1e-3, 6e4).astype(np.float16)
    rgba = np.concatenate([rgb, np.full((33, 50, 1), 1e4, np.float16)], axis=-1)
    agree(measure(gl, rgba, dtype="f2"), statistics(rgb))


def test_black_and_dim_pixels_are_masked(gl: Any) -> None:
    rgb = night(40, 40)
    rgb[::2] = 0.0
    rgb[1::4, ::2] = 0.9 * FLOOR
    agree(measure(gl, rgb), statistics(rgb))


def test_broken_pixels_do_not_spread(gl: Any) -> None:
    rgb = night(40, 40)
    rgb[3, 5] = np.nan
    rgb[4, 6] = -7.0
    rgb[5, 7, 1] = np.nan
    rgb[6, 8] = -np.inf
    agree(measure(gl, rgb), statistics(rgb))
    rgb[7, 9] = np.inf
    got = measure(gl, rgb)
    assert got.maximum == pytest.approx(BRIGHTEST, rel=ONE)
    agree(got, statistics(rgb))


def test_black_frame(gl: Any) -> None:
    assert measure(gl, np.zeros((9, 9, 3))) == statistics(np.zeros((9, 9, 3)))


def test_one_luminance_has_exact_percentiles(gl: Any) -> None:
    got = measure(gl, np.full((20, 30, 3), 123.0))
    assert got.p01 == got.p99 == got.minimum == got.maximum


def test_few_lamps_in_the_dark(gl: Any) -> None:
    # 1 % of 10,000 pixels: the 99 % percentile is the last dark one.
    rgb = np.full((100, 100, 3), 0.5, np.float32)
    rgb[0] = 2e4
    agree(measure(gl, rgb), statistics(rgb))
    rgb[1, 0] = 2e4
    agree(measure(gl, rgb), statistics(rgb))


def test_only_what_is_needed(gl: Any) -> None:
    rgb = night(10, 10)
    assert measure(gl, rgb, Need.NOTHING) is None
    averages = measure(gl, rgb, Need.AVERAGES)
    assert averages.p01 is None
    assert averages.p99 is None
    assert averages.log_average == measure(gl, rgb).log_average


def test_foveal_image_alone_tells_the_rest(gl: Any) -> None:
    rgb = night(200, 300)
    measurer = Measurer(gl, Programs(gl))
    got = measurer.measure(texture(gl, rgb), Need.FOVEAL, top_first=True)
    wanted = statistics(rgb, Need.FOVEAL)
    assert got.foveal.points.size == wanted.foveal.points.size == 168 * 112
    assert got.log_average == pytest.approx(wanted.log_average, rel=ONE)
    assert got.minimum == pytest.approx(wanted.minimum, rel=ONE)
    assert got.maximum == pytest.approx(wanted.maximum, rel=ONE)
    assert got.average == pytest.approx(wanted.average, rel=SUM)
    assert got.p01 is got.p99 is wanted.p01 is wanted.p99 is None
    # Twelve decades of ln have a standard deviation of 8; four of that of the points' mean.
    whole = statistics(rgb)
    error = 4.0 * 8.0 / np.sqrt(got.foveal.points.size)
    assert np.log(got.log_average) == pytest.approx(np.log(whole.log_average), abs=error)
    # Samples have 7 or 8 pixels a side, so that pixels weigh differently by a third at most.
    assert got.average == pytest.approx(whole.average, rel=0.05)


def test_context_is_left_as_it_was(gl: Any) -> None:
    measurer = Measurer(gl, Programs(gl))
    for size in ((16, 16), (40, 24), (16, 16)):  # targets are remade
        rgb = night(*size)
        agree(measurer.measure(texture(gl, rgb)), statistics(rgb))
    # The resting framebuffer is bound again: without one this would be an OpenGL error.
    assert evaluate(gl, [], "x * 2.0", {"x": [1.0]}, "float").tolist() == [2.0]
