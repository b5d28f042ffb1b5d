"""BT.709 luminance, the sRGB standard, and what the gamut step and the dither promise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hdrusd.colour import (
    BRIGHTEST,
    clean,
    dither,
    luminance,
    quantise,
    srgb_decode,
    srgb_encode,
    srgb_encode_fit,
    to_gamut,
    with_luminance,
)

COLOURS = hnp.arrays(np.float64, (5, 3), elements=st.floats(0.0, 1e6))


def test_luminance_of_the_primaries_is_bt709() -> None:
    assert luminance(np.eye(3)).tolist() == [0.2126, 0.7152, 0.0722]


def test_luminance_of_one_cd_m2_of_white() -> None:
    assert luminance((1.0, 1.0, 1.0)) == pytest.approx(1.0, rel=1e-15)


def test_clean() -> None:
    given_rgb = np.array([np.nan, -1.0, np.inf, -np.inf, 0.0, 3.5], np.float32)
    wanted = np.array([0.0, 0.0, BRIGHTEST, 0.0, 0.0, 3.5], np.float32)
    np.testing.assert_array_equal(clean(given_rgb), wanted)
    assert clean(np.array([65504.0], np.float16)) == 65504.0


@given(COLOURS, st.floats(0.0, 1e6))
def test_with_luminance(rgb: np.ndarray, target: float) -> None:
    got = with_luminance(rgb, target)
    has_colour = luminance(rgb) >= 1e-9
    # 1e-12: a dozen roundings of float64, with room.
    np.testing.assert_allclose(luminance(got)[has_colour], target, rtol=1e-12, atol=1e-300)
    assert not got[~has_colour].any()
    crossed = got[:, [1, 2, 0]] * rgb - got * rgb[:, [1, 2, 0]]  # 0 for equal chromaticity
    np.testing.assert_allclose(crossed, 0.0, atol=1e-12 * max(got.max() * rgb.max(), 1.0))


@given(COLOURS)
def test_gamut_keeps_luminance_up_to_white(rgb: np.ndarray) -> None:
    y = luminance(rgb)
    got = to_gamut(rgb, y)
    assert got.min() >= 0.0
    assert got.max() <= 1.0
    # The subtraction in (most - grey) loses what lies 2^53 below the largest channel.
    np.testing.assert_allclose(luminance(got), np.minimum(y, 1.0), rtol=1e-12, atol=1e-12)


@given(hnp.arrays(np.float64, (5, 3), elements=st.floats(0.0, 1.0)))
def test_gamut_leaves_displayable_colours_alone(rgb: np.ndarray) -> None:
    np.testing.assert_array_equal(to_gamut(rgb, luminance(rgb)), rgb)


def test_gamut_of_a_red_lamp() -> None:
    # (2, 0, 0) has luminance 0.4252: grey + t (rgb - grey) reaches 1 at t = 0.5748 / 1.5748.
    t = 0.5748 / 1.5748
    got = to_gamut((2.0, 0.0, 0.0), 0.4252)
    np.testing.assert_allclose(got, (1.0, 0.4252 * (1 - t), 0.4252 * (1 - t)), rtol=1e-14)


@pytest.mark.parametrize(
    ("linear", "code"),
    # IEC 61966-2-1: the ends, the junction, and middle grey (118 of 255 for 18 %).
    [(0.0, 0.0), (1.0, 1.0), (0.0031308, 0.04045), (0.18, 0.46135613), (0.21404114, 0.5)],
)
def test_srgb(linear: float, code: float) -> None:
    # The standard prints the junction to 4 digits; the others are given to 8.
    assert srgb_encode(linear) == pytest.approx(code, abs=1e-6)
    assert srgb_decode(code) == pytest.approx(linear, abs=1e-6)


@given(st.floats(0.0, 1.0))
def test_srgb_decode_undoes_encode(linear: float) -> None:
    # Its two thresholds are rounded: they disagree by 5e-8 at the junction.
    assert srgb_decode(srgb_encode(linear)) == pytest.approx(linear, abs=1e-7)


def test_fit_is_good_for_8_bits() -> None:
    linear = np.linspace(0.0, 1.0, 1_000_001)
    fit = srgb_encode_fit(linear)
    assert np.abs(fit - srgb_encode(linear)).max() < 0.08 / 255.0
    assert (np.diff(fit) > 0.0).all()
    assert fit[0] == 0.0
    assert fit[-1] == pytest.approx(1.0, abs=1e-15)


def test_dither_is_even_and_below_half_a_step() -> None:
    offsets = dither(*np.meshgrid(np.arange(256), np.arange(256)))
    assert np.abs(offsets).max() < 0.5
    # 256 levels in 65,536 pixels: 256 times each, and the mean is 0.
    levels, counts = np.unique(offsets, return_counts=True)
    assert levels.size == 256
    assert counts.min() > 245
    assert abs(offsets.mean()) < 1.0 / 256.0


def test_dither_varies_most_between_neighbours() -> None:
    # A fixed pattern is seen least at high frequencies: blocks of 4 x 4 hold the whole range.
    offsets = dither(*np.meshgrid(np.arange(256), np.arange(256)))
    means = offsets.reshape(64, 4, 64, 4).mean(axis=(1, 3))
    # White noise has sqrt(1/12 / 16) = 0.072.
    assert means.std() < 0.072 / 2


def test_dithered_mean_is_the_value() -> None:
    offsets = dither(*np.meshgrid(np.arange(256), np.arange(256)))
    for code in (0.002, 17.3, 100.5, 254.9):
        mean = quantise(code / 255.0, offsets).mean()
        # 256 levels and their uneven counts.
        assert mean == pytest.approx(code, abs=1.0 / 128.0)


def test_dither_keeps_what_8_bits_hold() -> None:
    codes = np.arange(256)
    levels = np.unique(dither(*np.meshgrid(np.arange(256), np.arange(256))))
    values = (codes / 255.0).astype(np.float32)
    np.testing.assert_array_equal(
        quantise(values[:, None], levels.astype(np.float32)), np.repeat(codes[:, None], 256, axis=1)
    )
