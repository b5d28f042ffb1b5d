"""Shader 2 as a whole against the same steps in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd.colour import dither, quantise, srgb_encode
from hdrusd.errors import HdrusdError, UnknownNameError
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.ldr import ToneMapper
from hdrusd.gpu.program import Programs
from hdrusd.tonemap.operator import OPERATORS, Operator, statistics

REINHARD = OPERATORS["reinhard02"]
CAMERA = OPERATORS["exposure"]
FALSE = OPERATORS["falsecolour"]


@pytest.fixture
def mapper(gl: Any) -> ToneMapper:
    return ToneMapper(gl, Programs(gl))


def night(height: int, width: int) -> np.ndarray:
    random = np.random.default_rng(11)
    level = 10.0 ** random.uniform(-3.0, 5.0, (height, width, 1))
    return (level * random.uniform(0.0, 1.0, (height, width, 3))).astype(np.float32)


def expected(rgb: np.ndarray, operator: Operator) -> np.ndarray:
    height, width = rgb.shape[:2]
    offsets = dither(*np.meshgrid(np.arange(width), np.arange(height)))
    code = srgb_encode(operator.apply(rgb.astype(np.float64)))
    return quantise(code, offsets[..., None]).astype(np.uint8)


@pytest.mark.parametrize("name", ["reinhard02", "exposure", "falsecolour"])
def test_picture_is_the_reference(mapper: ToneMapper, name: str) -> None:
    rgb = night(90, 160)
    operator = OPERATORS[name]
    got = mapper.apply_array(rgb, operator, operator.moment(None, statistics(rgb)))
    assert got.shape == (90, 160, 3)
    assert got.dtype == np.uint8
    assert got.flags.c_contiguous
    off = np.abs(got.astype(int) - expected(rgb, operator))
    # The curve's fit is within 0.08 steps and parity within 0.03: the dither turns that into
    # one step in at most 11 % of the values, and never into two.
    assert off.max() <= 1
    assert (off > 0).mean() < 0.11


@pytest.mark.parametrize("width", [1, 2, 5, 6, 11, 15, 16, 17, 31, 32, 33, 48])
def test_every_pixel_is_in_its_place(mapper: ToneMapper, width: int) -> None:
    # Bytes are packed across pixels; linear light that 8 bits hold comes out exactly.
    codes = np.random.default_rng(width).integers(0, 256, (7, width, 3))
    linear = np.where(codes > 10, ((codes / 255 + 0.055) / 1.055) ** 2.4, codes / 255 / 12.92)
    got = mapper.apply_array(linear.astype(np.float32), CAMERA, CAMERA.moment({"scale": 1.0}))
    assert np.abs(got.astype(int) - codes).max() <= 1
    assert (got != codes).mean() < 0.11


def test_texture_has_its_bottom_row_first(mapper: ToneMapper, gl: Any) -> None:
    rgb = night(12, 20)
    rgba = np.concatenate([rgb, np.ones((12, 20, 1), np.float32)], axis=-1)
    texture = gl.texture((20, 12), 4, np.ascontiguousarray(rgba[::-1]), dtype="f4")
    stats = statistics(rgb)
    np.testing.assert_array_equal(
        mapper.apply(texture, REINHARD, REINHARD.moment(None, stats)),
        mapper.apply_array(rgb, REINHARD, REINHARD.moment(None, stats)),
    )


def test_broken_pixels_do_not_spread(mapper: ToneMapper) -> None:
    rgb = night(16, 32)
    stats = statistics(rgb)
    whole = mapper.apply_array(rgb, REINHARD, REINHARD.moment(None, stats))
    broken = rgb.copy()
    broken[4, 4] = np.nan
    broken[5, 9] = -3.0
    broken[6, 14] = -np.inf
    broken[7, 19] = np.inf
    got = mapper.apply_array(broken, REINHARD, REINHARD.moment(None, stats))
    places = [4, 5, 6, 7], [4, 9, 14, 19]
    assert got[places].tolist() == [[0] * 3, [0] * 3, [0] * 3, [255] * 3]
    got[places] = whole[places]
    np.testing.assert_array_equal(got, whole)


def test_one_broken_channel_leaves_the_others(mapper: ToneMapper) -> None:
    rgb = np.full((4, 4, 3), 0.25, np.float32)
    rgb[..., 1] = np.nan
    got = mapper.apply_array(rgb, CAMERA, CAMERA.moment({"scale": 1.0}))
    assert not got[..., 1].any()
    # sRGB of 0.25 is 0.5371, 137 of 255.
    assert abs(got[..., 0].mean() - 136.96) < 0.6


def test_black_is_black_and_white_is_white(mapper: ToneMapper) -> None:
    rgb = np.zeros((64, 64, 3), np.float32)
    rgb[:, 32:] = 1000.0
    got = mapper.apply_array(rgb, REINHARD, REINHARD.moment(None, statistics(rgb)))
    assert not got[:, :32].any()
    assert (got[:, 32:] == 255).all()


def test_sizes_change(mapper: ToneMapper) -> None:
    for size in ((4, 4), (9, 33), (4, 4)):
        rgb = night(*size)
        got = mapper.apply_array(rgb, REINHARD, REINHARD.moment(None, statistics(rgb)))
        assert np.abs(got.astype(int) - expected(rgb, REINHARD)).max() <= 1


def test_operator_without_its_statistics(mapper: ToneMapper) -> None:
    with pytest.raises(HdrusdError, match="reinhard02: no statistics"):
        mapper.apply_array(night(2, 2), REINHARD, REINHARD.moment())
    with pytest.raises(UnknownNameError, match="kay"):
        REINHARD.moment({"kay": 1.0})


def test_context_is_left_as_it_was(mapper: ToneMapper, gl: Any) -> None:
    mapper.apply_array(night(4, 4), FALSE, FALSE.moment())
    # The resting framebuffer is bound again: without one this would be an OpenGL error.
    assert evaluate(gl, [], "x * 2.0", {"x": [1.0]}, "float").tolist() == [2.0]
