"""Pattanaik et al. 2000 against numbers computed outside of this project.

pfstmo's static form with the paper's rods agrees with them to 1e-6.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.errors import HdrusdError, ParameterError
from hdrusd.eye.screen import Screen
from hdrusd.tonemap.operator import Need, statistics
from hdrusd.tonemap.pattanaik00 import (
    OPERATOR,
    Adaptation,
    appearance,
    cone_sigma,
    hunt_rod_sigma,
    looked,
    paper_rod_sigma,
    pattanaik00,
    pattanaik00_saturation,
    scene_uniforms,
    steady,
)

#: 1000 to 1 cd/m2: by time in s the state, and display cd/m2 for 0.1, 1 and 10 cd/m2
#: on a display of 125 cd/m2, with the paper's rods.
COURSE = {
    0.1: ((287.218292, 513.903702, 0.999500704, 2.88928511e-4), (0.0, 0.0, 0.479)),
    1.0: ((1.00372293, 2.27136117, 0.999504768, 2.45796338e-3), (3.2036, 12.6176, 96.1599)),
    10.0: ((1.0, 1.0, 0.999543634, 0.0184037357), (3.1748, 13.3115, 102.7825)),
    60.0: ((1.0, 1.0, 0.999710146, 0.0376838131), (3.1223, 14.0707, 110.5007)),
}

#: Display share for these luminances, adapted to 10 cd/m2 for long, the paper's rods.
STATIC = (0.01, 0.1, 1.0, 5.0, 10.0, 50.0, 100.0, 1000.0, 5000.0)
STATIC_SHOWN = (
    (0.003512, 0.0057943, 0.0219494),
    (0.0859677, 0.1638024, 0.7769402),
    (1.0, 1.0, 1.0),
)

luminances = st.floats(1e-6, 1e6)
times = st.floats(0.0, 1e4)


def shown(state: Adaptation, y: tuple, white: float = 125.0) -> np.ndarray:
    """Display luminance in cd/m2, of a display without black, for greys ``y``."""
    uniforms = scene_uniforms(state, "paper", 0.0, white)
    grey = np.repeat(np.array(y)[:, None], 3, axis=-1)
    return pattanaik00(grey, uniforms)[:, 1] * white


def test_half_saturations() -> None:
    assert cone_sigma(25.0) == pytest.approx(646.1057885285192, rel=1e-12)
    assert paper_rod_sigma(25.0) == pytest.approx(144.65780964469525, rel=1e-12)
    assert hunt_rod_sigma(25.0) == pytest.approx(827.5284581442515, rel=1e-12)


@pytest.mark.parametrize("t", COURSE)
def test_course(t: float) -> None:
    wanted, display = COURSE[t]
    state = looked(steady(1000.0, 1000.0), 1.0, 1.0, t)
    # Half of the ninth digit; display values have four decimals, one of them three.
    np.testing.assert_allclose(state, wanted, rtol=6e-9)
    np.testing.assert_allclose(
        shown(state, (0.1, 1.0, 10.0)), display, rtol=0, atol=6e-5 if t > 0.1 else 6e-4
    )


def test_course_in_full(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    table = json.loads(text)["4_pattanaik"]
    for t in (0.0, *COURSE):
        row = table[f"1000->1 t={t}"]
        state = looked(steady(1000.0, 1000.0), 1.0, 1.0, t)
        wanted = [row[key] for key in ("Acone", "Arod", "Bcone", "Brod")]
        np.testing.assert_allclose(state, wanted, rtol=1e-6)
        np.testing.assert_allclose(
            shown(state, (0.1, 1.0, 10.0)), row["Ld(0.1,1,10)"], rtol=1e-6, atol=1e-9
        )


def test_static_picture() -> None:
    got = shown(steady(10.0, 10.0), STATIC) / 125.0
    np.testing.assert_allclose(got, np.ravel(STATIC_SHOWN), rtol=1e-6, atol=5.1e-8)


def test_display_luminance_is_between_black_and_white() -> None:
    # v = (Ld - black) / (white - black): the same luminances on a display with a black.
    state, y = steady(10.0, 10.0), (0.1, 1.0, 5.0, 10.0)
    grey = np.repeat(np.array(y)[:, None], 3, axis=-1)
    value = pattanaik00(grey, scene_uniforms(state, "paper", 1.0, 125.0))[:, 0]
    np.testing.assert_allclose(1.0 + value * 124.0, np.maximum(shown(state, y), 1.0), rtol=1e-12)


def test_an_adapted_scene_like_the_display_is_shown_as_it_is() -> None:
    # Cones of the same adaptation and pigment, no rods: the response is the viewer's.
    for white in (50.0, 125.0, 1000.0):
        state = Adaptation(white / 5.0, white / 5.0, 1.0, 0.0)
        y = (0.2 * white, 0.5 * white, white)
        np.testing.assert_allclose(shown(state, y, white), y, rtol=1e-12)


def test_rules_of_appearance() -> None:
    # Scene inside the display's range; wider; shifted up; shifted down.
    assert appearance(0.5, 0.2, 0.6, 0.1) == (1.0, 0.0)
    gain, offset = appearance(0.9, 0.1, 0.6, 0.2)
    assert (gain, gain * 0.9 + offset, gain * 0.1 + offset) == pytest.approx((0.5, 0.6, 0.2))
    assert appearance(0.9, 0.7, 0.6, 0.1) == pytest.approx((1.0, -0.3))
    assert appearance(0.3, 0.05, 0.6, 0.1) == pytest.approx((1.0, 0.05))


def test_colours_of_a_saturated_eye_are_pale() -> None:
    # The slope of the response falls past half saturation, and colourfulness with it.
    uniforms = scene_uniforms(steady(1.0, 1.0), "hunt", 1.0, 100.0)
    exponents = pattanaik00_saturation(np.geomspace(1.0, 1e8, 9), 50.0, uniforms)
    assert exponents[0] <= 1.0
    assert (np.diff(exponents[2:]) < 0.0).all()
    assert exponents[-1] < 0.01
    assert (
        pattanaik00_saturation(
            7.0,
            7.0,
            {
                "pattanaik00_sigma": (30.0, 1.0),
                "pattanaik00_pigment": (1.0, 1.0),
                "pattanaik00_display": (30.0, 0.5),
            },
        )
        == 1.0
    )


def test_pigment_and_neural_times() -> None:
    state = looked(Adaptation(100.0, 100.0, 0.5, 0.5), 1e-9, 1e-9, 0.08)
    assert state.cone == pytest.approx(100.0 * math.exp(-1.0))
    state = looked(Adaptation(100.0, 100.0, 0.5, 0.5), 1e-9, 1e-9, 0.15)
    assert state.rod == pytest.approx(100.0 * math.exp(-1.0))
    state = looked(Adaptation(100.0, 100.0, 0.5, 0.5), 1e-9, 1e-9, 110.0)
    assert state.cone_pigment == pytest.approx(1.0 - 0.5 * math.exp(-1.0))
    state = looked(Adaptation(100.0, 100.0, 0.5, 0.5), 1e-9, 1e-9, 400.0)
    assert state.rod_pigment == pytest.approx(1.0 - 0.5 * math.exp(-1.0))
    assert steady(2e6, 0.04)[2:] == (0.5, 0.5)


@given(st.tuples(*[luminances] * 4), times, times)
def test_two_steps_are_one(lights: tuple, a: float, b: float) -> None:
    begin, now = steady(*lights[:2]), lights[2:]
    twice = looked(looked(begin, *now, a), *now, b)
    np.testing.assert_allclose(twice, looked(begin, *now, a + b), rtol=1e-9, atol=1e-9)


@given(st.tuples(*[luminances] * 4))
def test_ends_of_time(lights: tuple) -> None:
    begin, now = steady(*lights[:2]), lights[2:]
    assert looked(begin, *now, math.inf) == steady(*now)
    assert looked(begin, *now, 0.0) == pytest.approx(begin, rel=1e-9, abs=1e-9)


def frame(luminance: float) -> np.ndarray:
    return np.full((8, 8, 3), luminance)


def test_operator_in_time() -> None:
    assert OPERATOR.advance is not None
    assert OPERATOR.trace is not None
    plain = OPERATOR.moment({"rods": "paper"}, screen=Screen(peak=125.0, black=0.0))
    bright, dim = (
        replace(plain, statistics=statistics(frame(y), Need.FOVEAL)) for y in (1000.0, 1.0)
    )
    state = OPERATOR.advance(OPERATOR.steady(bright).state, dim, 1.0)
    assert json.loads(json.dumps(state)) == state
    # A frame's luminance and white's scotopic weight are within roundings of 1.
    np.testing.assert_allclose(list(state.values()), COURSE[1.0][0], rtol=1e-7)
    got = OPERATOR.apply(frame(10.0), moment=replace(dim, state=state)) * 125.0
    np.testing.assert_allclose(got, COURSE[1.0][1][2], rtol=1e-6)
    trace = OPERATOR.trace(replace(dim, state=state))
    assert trace["goal luminance [cd/m2]"] == pytest.approx(1.0)
    assert trace["adaptation of cones [cd/m2]"] == pytest.approx(1.00372293)
    assert trace["rod pigment"] == pytest.approx(2.45796338e-3)


def test_still_is_adapted() -> None:
    got = OPERATOR.apply(frame(10.0), None, {"rods": "paper"})
    wanted = pattanaik00(frame(10.0), scene_uniforms(steady(10.0, 10.0), "paper", 1.0, 100.0))
    np.testing.assert_allclose(got, wanted, rtol=1e-9)


@pytest.mark.parametrize(
    "state",
    [
        {"cone": 1.0},
        {"cone": 1.0, "rod": 1.0, "cone_pigment": 2.0, "rod_pigment": 0.5},
        {"cone": -1.0, "rod": 1.0, "cone_pigment": 1.0, "rod_pigment": 0.5},
        {"cone": math.inf, "rod": 1.0, "cone_pigment": 1.0, "rod_pigment": 0.5},
        {"cone": "x", "rod": 1.0, "cone_pigment": 1.0, "rod_pigment": 0.5},
    ],
)
def test_a_state_of_something_else(state: dict) -> None:
    moment = OPERATOR.moment(None, statistics(frame(1.0), Need.FOVEAL))
    with pytest.raises(ParameterError, match="want what an earlier frame left"):
        OPERATOR.uniforms(replace(moment, state=state))


def test_senseless_input() -> None:
    with pytest.raises(ParameterError, match="rods: cats; want hunt or paper"):
        OPERATOR.apply(frame(1.0), None, {"rods": "cats"})
    with pytest.raises(HdrusdError, match="foveal"):
        OPERATOR.apply(frame(1.0), statistics(frame(1.0)))
