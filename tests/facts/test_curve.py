"""A curve from ln to ln: at its edges, between and beyond them, and as pixels get it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import luminance
from hdrusd.eye.screen import Screen
from hdrusd.tonemap.curve import Curve, curve, curve_value, display_range, proportional

#: 1 to 100 cd/m2 of a scene over four steps, on a display of 1 to 50.
BENT = Curve(0.0, math.log(100.0), np.log([2.0, 4.0, 6.0, 20.0, 40.0]), 1.0, 50.0)


def test_edges_and_between() -> None:
    edges = 100.0 ** (np.arange(5) / 4.0)
    np.testing.assert_allclose(BENT.display(edges), [2, 4, 6, 20, 40], rtol=1e-14)
    # The middle of a step in ln is the geometric mean of its ends.
    middles = np.sqrt(edges[:-1] * edges[1:])
    np.testing.assert_allclose(BENT.display(middles), np.sqrt([8, 24, 120, 800]), rtol=1e-14)


def test_in_proportion_beyond_the_ends() -> None:
    np.testing.assert_allclose(BENT.display([0.6, 110.0]), [1.2, 44.0], rtol=1e-14)
    # Until the display ends.
    np.testing.assert_allclose(BENT.display([0.0, 0.5, 125.0, 1e9]), [1, 1, 50, 50])


def test_relative_to_the_display() -> None:
    y = np.geomspace(1e-3, 1e4, 500)
    wanted = (BENT.display(y) - 1.0) / 49.0
    # The table is float32: ln 40 is off by up to 1e-7.
    np.testing.assert_allclose(curve_value(y, BENT.uniforms()), wanted, rtol=0, atol=1e-6)


def test_proportional() -> None:
    line = proportional(0.25, 80.0, 2.0)
    np.testing.assert_allclose(line.display([0.0, 4.0, 100.0, 320.0, 1e6]), [2, 2, 25, 80, 80])
    value = curve_value(np.array([0.0, 100.0, 1e6]), line.uniforms())
    np.testing.assert_allclose(value, [0.0, 23.0 / 78.0, 1.0], rtol=1e-6)


def test_chromaticity_is_kept_inside_the_gamut() -> None:
    rgb = np.array([[10.0, 8.0, 5.0], [0.0, 0.0, 0.0], [1e9, 2e9, 0.0]])
    got = curve(rgb, BENT.uniforms())
    np.testing.assert_allclose(got[0] / got[0, 0], [1.0, 0.8, 0.5], rtol=1e-12)
    assert luminance(got[0]) == pytest.approx(curve_value(luminance(rgb[0]), BENT.uniforms()))
    assert (got[1] == 0.0).all()
    np.testing.assert_allclose(got[2], 1.0, rtol=1e-12)


def test_range_of_a_screen() -> None:
    assert display_range(Screen(peak=100.0, black=1.0)) == (1.0, 100.0)
    assert display_range(Screen(peak=600.0, black=0.0)) == pytest.approx((0.06, 600.0))


@given(
    st.lists(st.floats(0.0, 3.0), min_size=1, max_size=100),
    st.floats(-10.0, 5.0),
    st.floats(0.1, 20.0),
)
def test_never_falls(rises: list[float], bmin: float, width: float) -> None:
    table = np.concatenate([[0.0], np.cumsum(rises)])
    steep = Curve(bmin, bmin + width, table, 0.5, 200.0)
    y = np.geomspace(math.exp(bmin - 5.0), math.exp(bmin + width + 5.0), 300)
    value = curve_value(y, steep.uniforms())
    # Table and its rises are rounded one by one to float32, up to 300 = e^5.7 of them.
    assert (np.diff(value) >= -1e-5).all()
    assert (value >= 0.0).all()
    assert (value <= 1.0).all()
