"""The scale and palette of Radiance's falsecolor, and the legend that goes with them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import srgb_encode
from hdrusd.errors import HdrusdError
from hdrusd.tonemap.falsecolour import (
    OPERATOR,
    falsecolour_palette,
    falsecolour_position,
    falsecolour_step,
)
from hdrusd.tonemap.legend import SMALLEST, paint_legend, tick_luminances


def test_position() -> None:
    # Three decades below 1000 cd/m2; what lies beyond the ends is clipped to them.
    y = np.array([0.0, 0.5, 1.0, 10.0, 100.0, 1000.0, 1e6])
    wanted = [0.0, 0.0, 0.0, 1 / 3, 2 / 3, 1.0, 1.0]
    np.testing.assert_allclose(falsecolour_position(y, 1000.0, 3.0), wanted, atol=1e-15)


def test_palette() -> None:
    # (1.6 v - 0.6, 8/3 v below 3/8 and 1.6 - 1.6 v above, 1 - 8/3 v), clipped.
    got = falsecolour_palette([0.0, 0.1875, 0.375, 0.6875, 1.0])
    wanted = [[0, 0, 1], [0, 0.5, 0.5], [0, 1, 0], [0.5, 0.5, 0], [1, 0, 0]]
    np.testing.assert_allclose(got, wanted, atol=1e-15)


@pytest.mark.parametrize(
    ("palette", "v", "wanted"),
    # pm3d (sqrt v, v^3, sin 2 pi v); hot (3v, 3v - 1, 3v - 2); eco (2v, 2v - 1, 1 - 2v); clipped.
    [
        ("pm3d", 0.0, (0.0, 0.0, 0.0)),
        ("pm3d", 0.25, (0.5, 0.015625, 1.0)),
        ("pm3d", 1.0, (1.0, 1.0, 0.0)),
        ("hot", 0.5, (1.0, 0.5, 0.0)),
        ("hot", 0.75, (1.0, 1.0, 0.25)),
        ("eco", 0.25, (0.5, 0.0, 0.5)),
        ("eco", 0.75, (1.0, 0.5, 0.0)),
    ],
)
def test_other_palettes(palette: str, v: float, wanted: tuple) -> None:
    np.testing.assert_allclose(falsecolour_palette(v, palette), wanted, rtol=0, atol=1e-15)


def test_linear_scale() -> None:
    got = falsecolour_position([0.0, 250.0, 1000.0, 4000.0], 1000.0, 0.0)
    np.testing.assert_allclose(got, [0.0, 0.25, 1.0, 1.0], rtol=1e-15)
    assert tick_luminances(1000.0, 0.0)[1:3] == [125.0, 250.0]


def test_steps() -> None:
    # (floor(8 v) + 0.5) / 8; the very top belongs to the highest step.
    got = falsecolour_step([0.0, 0.124, 0.125, 0.99, 1.0], 8.0)
    np.testing.assert_allclose(got, [0.0625, 0.0625, 0.1875, 0.9375, 0.9375], rtol=1e-15)


def test_legend_has_the_palette_and_the_steps_of_the_picture() -> None:
    picture = np.zeros((270, 480, 3), np.uint8)
    paint_legend(picture, 1000.0, 0.0, "hot", 3.0)
    colours = {tuple(int(c) for c in row) for row in picture[12:-5, 4]}
    # 1/6, 1/2 and 5/6 of the scale: (3v, 3v - 1, 3v - 2) x 255, rounded.
    assert colours == {(128, 0, 0), (255, 128, 0), (255, 255, 128)}


def test_picture_shows_the_palette() -> None:
    rgb = np.array([1.0, 10.0, 100.0, 1000.0])[:, None] * np.ones(3)
    shown = srgb_encode(OPERATOR.apply(rgb, None, {"decades": 3.0}))
    # What the display is sent is linear; encoded, it is the palette again (1e-7: the sRGB
    # standard's rounded thresholds).
    np.testing.assert_allclose(shown, falsecolour_palette([0.0, 1 / 3, 2 / 3, 1.0]), atol=1e-6)


def test_colour_of_the_light_does_not_matter() -> None:
    same = np.array([[100.0, 100.0, 100.0], [100.0 / 0.2126, 0.0, 0.0], [0.0, 0.0, 100.0 / 0.0722]])
    got = OPERATOR.apply(same)
    np.testing.assert_allclose(got, got[[0, 0, 0]], rtol=1e-12)


def test_ticks() -> None:
    ticks = tick_luminances(1000.0, 4.0)
    assert len(ticks) == 9
    np.testing.assert_allclose(ticks[::2], [0.1, 1.0, 10.0, 100.0, 1000.0], rtol=1e-12)


def test_legend_shows_the_colours_of_the_picture() -> None:
    picture = np.full((270, 480, 3), 77, np.uint8)
    paint_legend(picture, 1000.0, 4.0)
    assert (picture[:, SMALLEST[1] :] == 77).all()
    # Eight ticks above the lowest, evenly spaced, below the line of the unit.
    ticks = 8 + np.flatnonzero((picture[8:, 11] == 255).all(axis=-1))
    assert ticks.size == 9
    # Rounded to pixels: spaces differ by one.
    assert np.ptp(np.diff(ticks)) <= 1
    for row, value in zip(ticks[::-1], tick_luminances(1000.0, 4.0), strict=True):
        wanted = 255.0 * falsecolour_palette(falsecolour_position(value, 1000.0, 4.0))
        # The bar has a colour per row, so half a row off: 4/3 of 255 over 240 rows; and rounding.
        assert np.abs(picture[row, 4] - wanted).max() <= 255 * (8 / 3) * 0.5 / 240 + 0.5


def test_legend_is_written_in_digits() -> None:
    picture = np.zeros((*SMALLEST, 3), np.uint8)
    paint_legend(picture, 1000.0, 2.0)
    dots = picture.max(axis=-1) == 255
    # Rows of dots, as on any small display: 1000 at the top of the bar, 10 at its foot.
    one = np.array([[0, 1, 0], [1, 1, 0], [0, 1, 0], [0, 1, 0], [1, 1, 1]])
    zero = np.array([[1, 1, 1], [1, 0, 1], [1, 0, 1], [1, 0, 1], [1, 1, 1]])
    space = np.zeros((5, 1), int)
    thousand = np.hstack([one, space, zero, space, zero, space, zero, space]).astype(bool)
    ten = np.hstack([one, space, zero, np.zeros((5, 5), int)]).astype(bool)

    def rows_with(text: np.ndarray) -> list[int]:
        windows = np.lib.stride_tricks.sliding_window_view(dots, text.shape)
        return np.unique(np.nonzero((windows == text).all(axis=(-1, -2)))[0]).tolist()

    (top,), (foot,) = rows_with(thousand), rows_with(ten)
    assert top < foot


@given(st.floats(1e-9, 1e12), st.floats(0.1, 20.0), st.integers(0, 900), st.integers(0, 1600))
def test_legend_of_any_scale(scale: float, decades: float, more_h: int, more_w: int) -> None:
    picture = np.zeros((SMALLEST[0] + more_h, SMALLEST[1] + more_w, 3), np.uint8)
    paint_legend(picture, scale, decades)
    assert picture.any()


def test_legend_on_too_small_a_picture() -> None:
    with pytest.raises(HdrusdError, match="10 x 20 pixels; want"):
        paint_legend(np.zeros((20, 10, 3), np.uint8), 1000.0, 3.0)


@pytest.mark.parametrize(
    "params",
    [{"decades": 0.0}, {"scale": -1.0}, {"scale": "wide"}, {"palette": "jet"}, {"steps": 1.0}],
)
def test_senseless_parameter(params: dict) -> None:
    with pytest.raises(HdrusdError, match="want"):
        OPERATOR.apply(np.ones((1, 1, 3)), None, params)
