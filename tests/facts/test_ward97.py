"""Ward 1997 as an operator: which curve it takes, and what its parameters do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hdrusd.colour import luminance
from hdrusd.errors import HdrusdError, ParameterError, UnknownNameError
from hdrusd.eye.foveal import Foveal
from hdrusd.eye.screen import Screen
from hdrusd.eye.threshold import tvi_ward
from hdrusd.tonemap.histogram import histogram, trimmed
from hdrusd.tonemap.operator import OPERATORS, Moment, Need, statistics
from hdrusd.tonemap.ward97 import ward_curve

WARD = OPERATORS["ward97"]
FIELD = (40.0, 30.0)


def night() -> np.ndarray:
    """Seven decades of grey, log-normal, with a lamp."""
    random = np.random.default_rng(3)
    y = np.exp(random.normal(-1.0, 2.0, (120, 160)))
    y[10:12, 20:22] = 2e4
    return y[..., None] * np.ones(3)


def moment(frame: np.ndarray, screen: Screen | None = None, **params: float | str) -> Moment:
    stats = statistics(frame, Need.FOVEAL, FIELD)
    return WARD.moment(params, stats, screen=screen or Screen(peak=100.0, black=1.0))


def foveal_of(at: Moment) -> Foveal:
    assert at.statistics is not None
    assert at.statistics.foveal is not None
    return at.statistics.foveal


def test_fills_the_display() -> None:
    for ceiling in ("linear", "human"):
        curve = ward_curve(moment(night(), ceiling=ceiling))
        assert curve.log_display[0] == pytest.approx(0.0, abs=1e-6)
        assert curve.log_display[-1] == pytest.approx(math.log(100.0), abs=1e-6)
        assert (curve.black, curve.white) == (1.0, 100.0)


def test_linear_ceiling_never_exaggerates_contrast() -> None:
    at = moment(night())
    curve = ward_curve(at)
    width = (curve.bmax - curve.bmin) / 100
    assert (np.diff(curve.log_display) <= width * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("ceiling", ["linear", "human"])
def test_as_pcond_does(ceiling: str) -> None:
    at = moment(night(), solver="pcond", ceiling=ceiling)
    threshold = tvi_ward if ceiling == "human" else lambda y: y
    wanted = trimmed(histogram(foveal_of(at), pcond=True), 1.0, 100.0, threshold)
    assert wanted is not None
    np.testing.assert_array_equal(ward_curve(at).log_display, wanted.log_display)


@pytest.mark.parametrize(
    ("ceiling", "scale"),
    # The display's middle is 10 cd/m2; all of the scene is at 0.5 cd/m2 but for 1 %.
    [("linear", 10.0 / 0.5), ("human", float(tvi_ward(10.0) / tvi_ward(0.5)))],
)
@pytest.mark.parametrize("solver", ["fill", "pcond"])
def test_linear_method(ceiling: str, scale: float, solver: str) -> None:
    at = moment(np.full((60, 80, 3), 0.5), ceiling=ceiling, method="linear", solver=solver)
    y = np.array([0.3, 0.5, 2.0])
    value = luminance(WARD.apply(y[:, None] * np.ones(3), moment=at))
    black = 0.0 if solver == "pcond" else 1.0  # pcond's linear map has no black
    wanted = np.clip((scale * y - black) / (100.0 - black), 0.0, 1.0)
    np.testing.assert_allclose(value, wanted, rtol=1e-5)


@pytest.mark.parametrize("solver", ["fill", "pcond"])
def test_scene_that_fits_is_in_proportion(solver: str) -> None:
    random = np.random.default_rng(4)
    frame = random.uniform(2.0, 20.0, (60, 80, 1)) * np.ones(3)
    at = moment(frame, solver=solver)
    y = np.geomspace(2.5, 15.0, 7)
    shown = ward_curve(at).display(y)
    np.testing.assert_allclose(shown / y, shown[0] / y[0], rtol=1e-6)
    assert 0.5 < float(shown[0] / y[0]) < 5.0


def test_screen_or_parameters_are_the_display() -> None:
    hdr = ward_curve(moment(night(), Screen(peak=1000.0, black=0.0)))
    assert hdr.white == 1000.0
    assert hdr.black == 0.0
    assert math.exp(hdr.log_display[0]) == pytest.approx(0.1, rel=1e-6)
    own = ward_curve(moment(night(), white=400.0, black=0.5))
    assert (own.black, own.white) == (0.5, 400.0)
    assert math.exp(own.log_display[0]) == pytest.approx(0.5, rel=1e-6)
    lit = ward_curve(moment(night(), Screen(peak=100.0, black=1.0, ambient=100.0, reflectance=0.1)))
    # rho E / pi = 3.18 cd/m2 more everywhere.
    assert lit.black == pytest.approx(4.18309886)
    assert lit.white == pytest.approx(103.18309886)


def test_weights_look_at_the_centre() -> None:
    # Dark around, bright in the middle, each over four decades: the more the middle weighs,
    # the more of the display it gets.
    frame = np.geomspace(1e-5, 0.1, 120)[None, :, None] * np.ones((90, 120, 3))
    frame[25:65, 40:80] = np.geomspace(10.0, 1e5, 40)[:, None, None]
    rise = {}
    for weights in ("uniform", "centre", "gaze"):
        shown = ward_curve(moment(frame, weights=weights)).display([10.0, 1e5])
        rise[weights] = shown[1] / shown[0]
    assert rise["uniform"] < rise["centre"] < rise["gaze"]


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"ceiling": "eye"}, "ward97: ceiling: eye; want linear or human"),
        ({"method": 1.0}, "ward97: method: 1.0; want histogram or linear"),
        ({"weights": "left"}, "ward97: weights: left; want uniform or centre or gaze"),
        ({"solver": None}, "ward97: solver: None; want fill or pcond"),
        ({"white": 0.0}, "ward97: white: 0.0; want 0.001 to 1e+06"),
        ({"black": "x"}, "ward97: black: x; want 1e-06 to 1e+06"),
        ({"black": 200.0}, "ward97: black: 200 cd/m2; want less than white, 100 cd/m2"),
    ],
)
def test_bad_parameters(params: dict, message: str) -> None:
    with pytest.raises(ParameterError) as error:
        WARD.check(params)
    assert str(error.value) == message


def test_unknown_parameter() -> None:
    with pytest.raises(UnknownNameError):
        WARD.check({"celing": "human"})


def test_needs_a_foveal_image() -> None:
    assert WARD.needs(WARD.settings()) == Need.FOVEAL
    at = moment(night())
    with pytest.raises(HdrusdError, match="without a foveal image"):
        ward_curve(replace(at, statistics=statistics(night())))
    with pytest.raises(HdrusdError, match="no statistics"):
        ward_curve(replace(at, statistics=None))
