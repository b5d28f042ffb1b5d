"""Luminances shown as they are, and the roll-off of ITU-R BT.2390 above the screen's white."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.colour import luminance, pq_decode, pq_encode
from hdrusd.errors import ParameterError
from hdrusd.eye.screen import Screen
from hdrusd.tonemap.absolute import OPERATOR, roll_off
from hdrusd.tonemap.operator import Moment

BRIGHT = Screen("television", peak=1000.0, black=0.005, eotf="pq")


def shown(rgb: np.ndarray, screen: Screen = BRIGHT, **params: object) -> np.ndarray:
    """Luminance in cd/m2 that ``screen`` shows."""
    moment = Moment(OPERATOR.settings(params), screen=screen)
    v = luminance(OPERATOR.apply(rgb, moment=moment))
    return screen.black_level + v * (screen.white_level - screen.black_level)


def test_luminances_are_kept_and_clipped_at_white() -> None:
    y = np.array([0.0, 0.001, 0.005, 0.2, 50.0, 999.0, 1000.0, 1e6])
    wanted = np.clip(y, 0.005, 1000.0)
    # The curve is stored in float32: ln 1000 to 2^-22.
    np.testing.assert_allclose(shown(y[:, None] * np.ones(3)), wanted, rtol=1e-6)


def test_reflections_are_part_of_what_is_seen() -> None:
    # 100 lx on 1 % scatter 0.318 cd/m2: nothing darker can be shown, nothing is added to the rest.
    screen = Screen(peak=100.0, black=0.1, ambient=100.0, reflectance=0.01)
    y = np.array([0.1, 20.0])
    got = shown(y[:, None] * np.ones(3), screen)
    np.testing.assert_allclose(got, [0.1 + 1.0 / np.pi, 20.0], rtol=1e-6)


def test_roll_off_of_bt2390() -> None:
    # In code values of ST 2084: knee 1.5 white - 0.5 source; slope 1 there, 0 at the source.
    white, source = 1000.0, 4000.0
    top, end = pq_encode([white, source])
    knee = 1.5 * top - 0.5 * end
    dark = np.array([0.0, 0.1, 10.0, float(pq_decode(knee))])
    np.testing.assert_array_equal(roll_off(dark, white, source), dark)
    np.testing.assert_allclose(roll_off([4000.0, 1e5], white, source), white, rtol=1e-9)
    # In the middle of the spline (T = 1/2): knee/2 + (end - knee)/8 + top/2.
    middle = 0.5 * knee + (end - knee) / 8.0 + 0.5 * top
    got = roll_off(pq_decode(0.5 * (knee + end)), white, source)
    assert pq_encode(got) == pytest.approx(middle, rel=1e-12)
    assert (np.diff(roll_off(np.geomspace(1.0, 5e3, 500), white, source)) >= 0.0).all()


def test_operator_rolls_off() -> None:
    y = np.geomspace(0.01, 9000.0, 200)
    got = shown(y[:, None] * np.ones(3), above="rolloff", source=4000.0)
    # 1024 straight steps of ln L, in float32.
    np.testing.assert_allclose(got, roll_off(y, 1000.0, 4000.0), rtol=1e-5)


def test_a_source_that_the_screen_reaches_is_not_rolled_off() -> None:
    y = np.array([1.0, 900.0])
    got = shown(y[:, None] * np.ones(3), above="rolloff", source=800.0)
    np.testing.assert_allclose(got, y, rtol=1e-6)


def test_a_dark_screen_rolls_off_from_black() -> None:
    # Code 0.15 at 1 cd/m2, so the source is held to code 0.45 and the knee is black.
    screen = Screen(peak=1.0, black=0.0)
    y = np.geomspace(1e-3, 1e4, 300)
    got = shown(y[:, None] * np.ones(3), screen, above="rolloff")
    assert (np.diff(got) >= -1e-7).all()
    assert got[-1] == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"above": "fold"}, "above: fold; want clip or rolloff"),
        ({"source": 1e6}, "source: 1000000.0; want 1 to 10000"),
    ],
)
def test_senseless_parameter(params: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        OPERATOR.apply(np.ones((1, 3)), None, params)
