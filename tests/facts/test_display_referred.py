"""PBR Neutral, ACES and AgX: curves for exposed RGB; numbers from independent programs."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.errors import ParameterError
from hdrusd.tonemap import aces, agx, exposure, pbr_neutral
from hdrusd.tonemap.operator import statistics

#: Grey of 18 %, an orange, and a pink past white.
EXPOSED = np.array([[0.18, 0.18, 0.18], [1.0, 0.5, 0.1], [4.0, 2.0, 1.0]])

WANTED = {
    pbr_neutral.neutral: [
        [0.14, 0.14, 0.14],
        [0.8690909090909091, 0.4225288762060063, 0.06527924989808402],
        [0.9832558139534884, 0.6399513870477753, 0.46829917359491874],
    ],
    aces.narkowicz: [
        [0.2668989203894968, 0.2668989203894968, 0.2668989203894968],
        [0.8037974683544302, 0.6163069544364508, 0.1258396775638155],
        [0.9734171097148379, 0.914855072463768, 0.8037974683544302],
    ],
    aces.hill: [
        [0.10559124722893051, 0.10559124722893057, 0.10559019131645825],
        [0.6388706820294097, 0.3838670460535018, 0.08220005358350266],
        [0.9281324477425611, 0.8110373439230668, 0.6699071744727977],
    ],
    agx.agx_base: [
        [0.21484819266725425, 0.2148481924060964, 0.21484819264269928],
        [0.6065537857503625, 0.4165636197386003, 0.20967115039594794],
        [0.8706220125075246, 0.7336433255905138, 0.6240031166483572],
    ],
}

OPERATORS = [pbr_neutral.OPERATOR, aces.OPERATOR, agx.OPERATOR]


@pytest.mark.parametrize("curve", WANTED, ids=lambda curve: curve.__name__)
def test_three_colours(curve) -> None:
    np.testing.assert_allclose(curve(EXPOSED), WANTED[curve], rtol=1e-6)


def test_neutral_shows_base_colours_as_they_are() -> None:
    # Up to 0.8 a colour is only less by the 4 % that a dielectric reflects.
    colour = np.array([0.8, 0.3, 0.1])
    np.testing.assert_allclose(pbr_neutral.neutral(colour), colour - 0.04, rtol=1e-14)


def test_neutral_is_smooth_where_the_reflection_is_taken_off() -> None:
    # x - x^2 / 0.16 below 0.08 and 0.04 above: equal there in value and in slope.
    x = 0.08 + np.array([-1e-6, 0.0, 1e-6])
    low, at, high = pbr_neutral.neutral(x[:, None] * np.ones(3))[:, 0]
    assert at == pytest.approx(0.04, rel=1e-14)
    assert (at - low) == pytest.approx(high - at, rel=1e-4)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
def test_they_take_the_cameras_exposure(operator) -> None:
    # f/16, 1/125 s at ISO 100 saturate at 38,400 cd/m2: that luminance is exposed 1.
    ev100 = exposure.ev100_from_settings(16.0, 1.0 / 125.0, 100.0)
    by_ev = operator.apply(EXPOSED * 38400.0, None, {"ev100": ev100})
    by_scale = operator.apply(EXPOSED, None, {"scale": 1.0})
    np.testing.assert_allclose(by_ev, by_scale, rtol=1e-12)
    # An average of 12.5 / 100 cd/m2 is EV 0, which saturates at 1.2 cd/m2.
    automatic = operator.apply(EXPOSED * 1.2, statistics(np.full((1, 3), 0.125)))
    np.testing.assert_allclose(automatic, by_scale, rtol=1e-12)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
def test_bad_exposure_names_the_operator(operator) -> None:
    with pytest.raises(ParameterError, match=f"^{operator.name}: ev100: bright; want"):
        operator.apply(EXPOSED, None, {"ev100": "bright"})


def test_agx_keeps_grey_grey_and_dark_rising() -> None:
    grey = np.geomspace(1e-6, 1e3, 300)[:, None] * np.ones(3)
    got = agx.agx_base(grey)
    # Matrices printed to nine digits, whose rows sum to 1.
    np.testing.assert_allclose(got, got[:, :1] * np.ones(3), rtol=1e-7)
    assert (np.diff(got[:, 0]) >= 0.0).all()
    # The fit's value at 1, -17.86 + 78.01 - 126.7 + ... = 0.982057, to the power 2.2.
    assert got[-1, 0] == pytest.approx(0.982057**2.2, rel=1e-6)


def test_unknown_fit() -> None:
    with pytest.raises(ParameterError, match="aces: fit: odt; want narkowicz or hill"):
        aces.OPERATOR.apply(EXPOSED, None, {"fit": "odt"})
