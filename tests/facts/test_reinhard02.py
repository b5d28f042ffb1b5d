"""Reinhard et al. 2002 and 2003 against published formulas and independent programs.

The 3 x 3 picture and its results were computed outside of this project; HDR Toolbox
agrees with them to 10 digits, pfstmo to 6e-7.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import luminance
from hdrusd.errors import HdrusdError, UnknownNameError
from hdrusd.tonemap.operator import FLOOR, Need, Statistics, log_average, statistics
from hdrusd.tonemap.reinhard02 import OPERATOR, automatic_key, automatic_white, reinhard02

PICTURE = np.array([[0.01, 0.1, 1.0], [5.0, 10.0, 50.0], [100.0, 1000.0, 5000.0]])
GREY = np.repeat(PICTURE[..., None], 3, axis=-1)

WHITE_MAXIMUM = (
    (0.00017555900579608157, 0.001752820906499552, 0.017256024578114478),
    (0.08070998765392366, 0.1493665766441887, 0.46755746561763506),
    (0.6372870484257986, 0.9482730271665739, 1.0),
)
WHITE_INFINITE = (
    (0.0001755590017967838, 0.00175282050720068, 0.01725598526835389),
    (0.08070906836299202, 0.14936317409688507, 0.4675042160392389),
    (0.6371419051878738, 0.9461177366318477, 0.9887380937264839),
)
AUTOMATIC = (
    (0.00018988690532590032, 0.0018956294563648897, 0.018638312555564484),
    (0.08672586749112586, 0.15960946564663056, 0.48707817834758227),
    (0.6550807974421822, 0.9499807677276753, 0.989579323538808),
)


def of_the_paper(delta: float = 1e-6) -> Statistics:
    """All pixels count and delta keeps the logarithm finite, as in the 2002 paper."""
    average = log_average(PICTURE, floor=None, delta=delta)
    return Statistics(average, PICTURE.min(), PICTURE.max(), float(PICTURE.mean()), 0.01, 5000.0)


@pytest.mark.parametrize(
    ("delta", "average"), [(1e-6, 10.251163286289177), (1e-5, 10.252304054936006)]
)
def test_log_average(delta: float, average: float) -> None:
    # 1e-12: float64 exp and log of nine values.
    assert of_the_paper(delta).log_average == pytest.approx(average, rel=1e-12)


def test_black_pixel_is_not_counted() -> None:
    black = PICTURE.copy()
    black[0, 0] = 0.0
    assert log_average(black, floor=None, delta=1e-6) == pytest.approx(
        3.6840361369001493, rel=1e-12
    )
    assert log_average(black) == pytest.approx(24.38449420228684, rel=1e-12)


@pytest.mark.parametrize(
    ("params", "wanted"),
    [
        ({}, WHITE_MAXIMUM),
        ({"white": math.inf}, WHITE_INFINITE),
        ({"key": "auto", "white": "auto"}, AUTOMATIC),
    ],
    ids=["white maximum", "white infinite", "automatic"],
)
def test_published_picture(params: dict, wanted: tuple) -> None:
    got = OPERATOR.apply(GREY, of_the_paper(), params)
    # 1e-12: a dozen float64 operations after a logarithm.
    np.testing.assert_allclose(got, np.repeat(np.array(wanted)[..., None], 3, -1), rtol=1e-12)


def test_automatic_key_and_white() -> None:
    average = of_the_paper().log_average
    assert automatic_key(average, 0.01, 5000.0) == pytest.approx(0.19469313691958437, rel=1e-12)
    assert automatic_white(0.01, 5000.0) == pytest.approx(23437.5, rel=1e-12)


def test_key_of_an_average_in_the_middle_is_018() -> None:
    assert automatic_key(10.0, 1.0, 100.0) == pytest.approx(0.18, rel=1e-12)
    assert automatic_key(7.0, 7.0, 7.0) == 0.18


def test_key_at_the_ends_of_the_range() -> None:
    # f = -1 and +1: 0.18 / 4 and 0.18 x 4, also for an average outside of the percentiles.
    assert automatic_key(0.5, 1.0, 100.0) == pytest.approx(0.045, rel=1e-12)
    assert automatic_key(200.0, 1.0, 100.0) == pytest.approx(0.72, rel=1e-12)


def test_log_average_becomes_key_over_one_plus_key() -> None:
    rgb = np.full(3, 4.0)
    got = reinhard02(rgb, 0.18 / 4.0, 0.0)
    np.testing.assert_allclose(got, 0.18 / 1.18, rtol=1e-14)


def test_white_is_reached_at_white() -> None:
    # Scaled luminance equal to white: s (1 + 1) / (1 + s) is 1 only where s = 1.
    for white in (1.0, 3.0, 50.0):
        got = reinhard02(np.full(3, white), 1.0, white**-2.0)
        np.testing.assert_allclose(got, 1.0, rtol=1e-14)


@given(st.tuples(*[st.floats(1e-4, 1e5)] * 3), st.floats(0.01, 1.0), st.floats(1.0, 1e4))
def test_luminance_follows_equation_4(rgb: tuple, key: float, white: float) -> None:
    y = float(luminance(rgb))
    s = key * y
    wanted = min(s * (1.0 + s / white**2) / (1.0 + s), 1.0)
    got = reinhard02(np.array(rgb), key, white**-2.0)
    # The gamut step subtracts the grey from the largest channel.
    assert float(luminance(got)) == pytest.approx(wanted, rel=1e-9)


def test_frame_without_light_stays_black() -> None:
    stats = statistics(np.zeros((2, 2, 3)))
    assert stats == Statistics(FLOOR, FLOOR, FLOOR, 0.0, FLOOR, FLOOR)
    for params in ({}, {"key": "auto", "white": "auto"}):
        assert not OPERATOR.apply(np.zeros((2, 2, 3)), None, params).any()


def test_statistics() -> None:
    # 200 luminances and a black pixel: 1 % do not exceed the 2nd, 99 % not the 198th.
    y = np.append(np.arange(1.0, 201.0), 0.0)
    stats = statistics(np.repeat(y[:, None], 3, -1))
    # luminance() of grey is within three roundings of the grey.
    assert stats.minimum == pytest.approx(1.0, rel=1e-15)
    assert stats.maximum == pytest.approx(200.0, rel=1e-15)
    assert stats.p01 == pytest.approx(2.0, rel=1e-15)
    assert stats.p99 == pytest.approx(198.0, rel=1e-15)
    assert stats.average == pytest.approx(20100.0 / 201.0, rel=1e-14)
    assert stats.log_average == pytest.approx(math.exp(math.lgamma(201.0) / 200.0), rel=1e-13)


def test_statistics_of_broken_pixels() -> None:
    rgb = np.array([[np.nan] * 3, [-5.0] * 3, [2.0] * 3])
    assert statistics(rgb) == statistics(np.clip(np.nan_to_num(rgb), 0.0, None))


def test_percentiles_are_asked_for_where_they_are_used() -> None:
    assert OPERATOR.needs(OPERATOR.settings()) == Need.AVERAGES
    assert OPERATOR.needs(OPERATOR.settings({"key": "auto"})) == Need.PERCENTILES
    without = Statistics(1.0, 1.0, 1.0, 1.0)
    with pytest.raises(HdrusdError, match="percentiles"):
        OPERATOR.apply(GREY, without, {"white": "auto"})


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"key": -0.1}, "key: -0.1; want"),
        ({"key": "bright"}, "key: bright; want"),
        ({"key": math.nan}, "key: nan; want"),
        ({"white": -1.0}, "white: -1.0; want"),
    ],
)
def test_senseless_parameter(params: dict, message: str) -> None:
    with pytest.raises(HdrusdError, match=message):
        OPERATOR.apply(GREY, None, params)


def test_unknown_parameter() -> None:
    with pytest.raises(UnknownNameError, match="kay: unknown; did you mean key"):
        OPERATOR.apply(GREY, None, {"kay": 0.18})
