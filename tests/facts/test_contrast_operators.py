"""Ward 1994 and Ferwerda et al. 1996: factors from thresholds, and what the screen shows.

Numbers of the factors are from independent programs.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import luminance
from hdrusd.errors import ParameterError
from hdrusd.eye.screen import Screen
from hdrusd.tonemap import ferwerda96, ward94
from hdrusd.tonemap.ferwerda96 import adapted_light, durand_weight, walraven_weight
from hdrusd.tonemap.on_screen import on_screen
from hdrusd.tonemap.operator import Moment, statistics
from hdrusd.tonemap.ward94 import contrast_scale


@pytest.mark.parametrize(
    ("adaptation", "scale"),
    [(1.0, 12.026045437760223), (100.0, 0.567197577373806), (1e4, 0.008180310544704134)],
)
def test_ward94_scale(adaptation: float, scale: float) -> None:
    assert contrast_scale(100.0, adaptation) == pytest.approx(scale, rel=1e-6)


@given(st.floats(0.1, 1e4))
def test_ward94_shows_the_screens_own_adaptation_as_it_is(white: float) -> None:
    assert contrast_scale(white, 0.5 * white) == pytest.approx(1.0, rel=1e-14)


def test_ferwerda96_light() -> None:
    cone, rod = ferwerda96.cone_scale(100.0, 5.0), ferwerda96.rod_scale(100.0, 6.0)
    weight = durand_weight(5.0)
    assert cone == pytest.approx(4.136710284668364, rel=1e-6)
    assert rod == pytest.approx(1.2779636415613014, rel=1e-6)
    assert weight == pytest.approx(0.5636266897528158, rel=1e-6)
    got = adapted_light((1.0, 0.8, 0.5), 1.2, cone, rod * weight)
    wanted = (5.001063584969545, 4.173721528035872, 2.9327084426353625)
    np.testing.assert_allclose(got, wanted, rtol=1e-6)


def test_weights_of_rods() -> None:
    assert walraven_weight(5.0) == pytest.approx(0.9404761904761905, rel=1e-12)
    # Only rods in the dark, only cones in the light: at 20 cd/m2 by Durand, 400 by Walraven.
    assert durand_weight(0.0) == walraven_weight(0.0) == 1.0
    assert durand_weight(20.0) == walraven_weight(400.0) == durand_weight(1e5) == 0.0


def test_rods_see_blue_and_grey() -> None:
    # At 0.01 cd/m2 a blue light is shown brighter than a red one of its luminance, and paler.
    red, blue = np.array([0.01 / 0.2126, 0.0, 0.0]), np.array([0.0, 0.0, 0.01 / 0.0722])
    pixels = np.stack([red, blue])
    got = ferwerda96.OPERATOR.apply(pixels, statistics(np.full((4, 3), 0.01)))
    assert luminance(got[1]) > 5.0 * luminance(got[0])
    assert got[1].min() > 0.0


@pytest.mark.parametrize("operator", [ward94.OPERATOR, ferwerda96.OPERATOR])
def test_what_is_shown_is_the_papers_luminance(operator) -> None:
    # In daylight there are no rods; black + v (white - black) is the scene times one factor.
    screen = Screen(peak=200.0, black=0.5, ambient=100.0, reflectance=0.01)
    pixels = np.array([[300.0] * 3, [1000.0] * 3, [4000.0] * 3])
    stats = statistics(np.full((4, 3), 1000.0))
    v = operator.apply(pixels, moment=Moment(operator.settings(), stats, screen=screen))
    shown = screen.black_level + v[:, 0] * (screen.white_level - screen.black_level)
    factor = contrast_scale if operator.name == "ward94" else ferwerda96.cone_scale
    scale = factor(screen.white_level, 1000.0)
    wanted = np.clip([300 * scale, 1000 * scale, 4000 * scale], 0.0, screen.white_level)
    np.testing.assert_allclose(shown, wanted, rtol=1e-12)


def test_on_screen() -> None:
    # v = (L - black) / (white - black); darker than black is black, brighter than white white.
    grey = np.array([0.5, 1.0, 10.9, 100.0, 500.0])[:, None] * np.ones(3)
    got = on_screen(grey, 1.0, 100.0)
    np.testing.assert_allclose(got[:, 1], [0.0, 0.0, 0.1, 1.0, 1.0], rtol=1e-13, atol=1e-15)
    # Chromaticity is kept: channels in the light's ratio.
    got = on_screen((20.0, 10.0, 5.0), 1.0, 100.0)
    np.testing.assert_allclose(got / got[0], (1.0, 0.5, 0.25), rtol=1e-13)


def test_unknown_weight() -> None:
    with pytest.raises(ParameterError, match="ferwerda96: rods: all; want durand or walraven"):
        ferwerda96.OPERATOR.apply(np.ones((1, 3)), None, {"rods": "all"})
