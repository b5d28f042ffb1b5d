"""Discomfort and disability glare, against the standards' equations and evalglare."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hdrusd.glare.disability import (
    threshold,
    threshold_increment,
    veiling_luminance,
    visibility_level,
)
from hdrusd.glare.discomfort import dgp, guth_index, iwata_index, position_index, ugr

#: cd/m2, sr and Guth's angles of two sources.
TWO = np.array([5000.0, 20000.0]), np.array([1e-3, 5e-4]), guth_index([45.0, 0.0], [20.0, 30.0])


def test_guth() -> None:
    got = guth_index([0.0, 45.0, 90.0], [10.0, 20.0, 30.0])
    np.testing.assert_allclose(got, [1.43447654, 1.69045579, 1.46814104], rtol=1e-8)
    assert guth_index(30.0, 0.0) == 1.0
    assert guth_index(0.0, 90.0) == 16.0


def test_iwata_below_the_line_of_sight() -> None:
    # r = tan(angle): 1 + 0.8 r up to 0.6, 1 + 1.2 r to r = 3.
    assert iwata_index(0.0, math.degrees(math.atan(0.5))) == pytest.approx(1.4, rel=1e-12)
    assert iwata_index(45.0, 0.0) == pytest.approx(2.2, rel=1e-12)
    assert iwata_index(80.0, 80.0) == pytest.approx(4.6, rel=1e-12)


def test_position_of_a_direction() -> None:
    a = math.radians(20.0)
    up, down = (0.0, math.sin(a), -math.cos(a)), (0.0, -math.sin(a), -math.cos(a))
    right = math.sin(a), 0.0, -math.cos(a)
    wanted = [guth_index(0.0, 20.0), iwata_index(0.0, 20.0), guth_index(90.0, 20.0)]
    np.testing.assert_allclose(position_index([up, down, right]), wanted, rtol=1e-12)


def test_ugr_and_dgp_of_two_sources() -> None:
    assert ugr(*TWO, 50.0) == pytest.approx(16.9894806, rel=1e-8)
    assert dgp(*TWO, 2000.0) == pytest.approx(0.278105614, rel=1e-8)
    assert ugr([], [], [], 50.0) == -math.inf


def test_disc_on_an_even_background() -> None:
    """A disc of 4 degrees radius, 20 degrees up, 5000 cd/m2 on 50; evalglare run on its fisheye.

    It has 1.5376e-2 sr, P 2.138, 229.06 lx, UGR 20.995 and DGP 0.23025: its pixels.
    """
    solid = 2.0 * math.pi * (1.0 - math.cos(math.radians(4.0)))
    index = guth_index(0.0, 20.0)
    facing = solid * math.cos(math.radians(20.0))
    lux = math.pi * 50.0 + 4950.0 * facing
    around = (lux - 5000.0 * facing) / math.pi
    assert solid == pytest.approx(0.015306, abs=5e-7)
    assert index == pytest.approx(2.1460, abs=5e-5)
    assert lux == pytest.approx(228.27, abs=5e-3)
    assert ugr(5000.0, solid, index, around) == pytest.approx(20.964, abs=5e-4)
    assert dgp(5000.0, solid, index, lux) == pytest.approx(0.230900, abs=1e-6)
    assert ugr(5000.0, solid, index, around) == pytest.approx(20.995, abs=0.04)
    assert dgp(5000.0, solid, index, lux) == pytest.approx(0.230252, abs=1e-3)


def test_threshold_increment() -> None:
    veil = veiling_luminance([0.5, 0.2, 0.05], [5.0, 12.0, 1.0]).sum()
    assert veil == pytest.approx(0.968515376, rel=1e-8)
    np.testing.assert_allclose(
        threshold_increment(veil, [1.0, 8.0]), [62.9534995, 10.3653898], rtol=1e-8
    )


def test_veiling_luminance_at_23_is_ten_over_theta_squared() -> None:
    theta = np.array([2.0, 10.0, 60.0])
    np.testing.assert_allclose(veiling_luminance(1.0, theta), 10.0 / theta**2, rtol=1e-3)
    assert veiling_luminance(1.0, [0.05, 0.1, 61.0]).tolist() == [0.0, 0.0, 0.0]


def test_adrian() -> None:
    assert threshold(1.0, 10.0) == pytest.approx(0.0499079264, rel=1e-8)
    assert threshold(0.1, 10.0, 0.2, 60.0) == pytest.approx(0.0432680309, rel=1e-8)
    dark = threshold(1.0, 7.45, 0.2, 60.0, negative=True)
    assert dark == pytest.approx(0.13770983, rel=1e-8)


def test_adrian_is_continuous_where_his_ranges_meet() -> None:
    # His own fits: they meet within 2 %.
    for edge in (0.6, 0.00418):
        low, high = threshold(np.array([edge * (1 - 1e-9), edge * (1 + 1e-9)]), 10.0)
        assert low == pytest.approx(high, rel=0.02)
    assert threshold(1.0, 10.0, age=64.0) == pytest.approx(threshold(1.0, 10.0, age=64.1), rel=0.02)


def test_visibility_level() -> None:
    seen = threshold(1.0, 10.0)
    assert visibility_level(1.0 + 3.0 * seen, 1.0, 10.0) == pytest.approx(3.0, rel=1e-12)
    darker = threshold(1.0, 10.0, negative=True)
    assert darker < seen
    assert visibility_level(1.0 - 2.0 * darker, 1.0, 10.0) == pytest.approx(-2.0, rel=1e-12)
    # A veil takes visibility away: the threshold is that of both together.
    veiled = visibility_level(1.5, 1.0, 10.0, veil=1.0)
    assert veiled == pytest.approx(0.5 / threshold(2.0, 10.0), rel=1e-12)
