"""Drago et al. 2003, equation 4, on nine luminances; numbers from an independent program."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hdrusd.errors import ParameterError
from hdrusd.tonemap.drago03 import OPERATOR, drago03_curve, world_adaptation
from hdrusd.tonemap.operator import log_average, statistics

Y = np.array([[0.01, 0.1, 1.0], [5.0, 10.0, 50.0], [100.0, 1000.0, 5000.0]])
GREY = np.repeat(Y[..., None], 3, axis=-1)

#: Bias 0.85, with 1e-6 cd/m2 added under the logarithm.
WANTED = np.array(
    [
        [0.00042043021650595115, 0.0037290318169638146, 0.0307173210490732],
        [0.11573970463169742, 0.18733022744893263, 0.4245801521709888],
        [0.5359799947601741, 0.8480631049223458, 1.0],
    ]
)


def test_nine_luminances() -> None:
    stats = replace(statistics(GREY), log_average=log_average(Y, floor=None, delta=1e-6))
    got = OPERATOR.apply(GREY, stats)
    np.testing.assert_allclose(got, np.repeat(WANTED[..., None], 3, axis=-1), rtol=1e-6)


@pytest.mark.parametrize("bias", [0.5, 0.7, 0.85, 1.0])
def test_brightest_becomes_white_and_black_stays_black(bias: float) -> None:
    got = OPERATOR.apply(np.array([[0.0] * 3, [3.0] * 3, [700.0] * 3]), None, {"bias": bias})
    np.testing.assert_allclose(got[[0, 2]], [[0.0] * 3, [1.0] * 3], rtol=1e-14)


def test_bias_of_one_is_a_plain_logarithm() -> None:
    # ln(0.85) / ln(0.5) of eq. 4 is 0: the base is 10 everywhere.
    y = np.array([0.1, 2.0, 99.0])
    got = drago03_curve(y, 1.0, 99.0, 0.0)
    np.testing.assert_allclose(got, np.log10(1.0 + y) / 2.0, rtol=1e-14)


def test_bias_of_one_half_has_its_base_linear_in_luminance() -> None:
    # ln(0.5) / ln(0.5) = 1: half way to the top the base is 2 + 8 / 2 = 6.
    got = drago03_curve(49.5, 1.0, 99.0, 1.0)
    assert got == pytest.approx(math.log(50.5, 6.0) / 2.0, rel=1e-14)


def test_adaptation() -> None:
    assert world_adaptation(7.0, 0.85) == pytest.approx(7.0, rel=1e-15)
    assert world_adaptation(7.0, 0.75) == pytest.approx(7.0 / 0.9**5, rel=1e-14)


@pytest.mark.parametrize("bias", [0.49, 1.1, "high", math.nan])
def test_senseless_bias(bias: object) -> None:
    with pytest.raises(ParameterError, match=r"drago03: bias: .*; want 0\.5 to 1"):
        OPERATOR.apply(GREY, None, {"bias": bias})
