"""Averages that follow in time: of the photographic operator, and of an automatic camera."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.errors import ParameterError
from hdrusd.tonemap.operator import OPERATORS, Moment, Operator, statistics
from hdrusd.tonemap.smoothing import followed

OPERATORS_IN_TIME = {"reinhard02": "ln_average", "exposure": "ev100"}

times = st.floats(0.0, 1e3)
logs = st.floats(-20.0, 20.0)


def moment(operator: Operator, luminance: float) -> Moment:
    """A frame of one luminance, cd/m2."""
    return operator.moment(None, statistics(np.full((2, 2, 3), luminance)))


def test_time_constants() -> None:
    # 1/e is left after 0.4 s toward light, and after 0.8 s toward dark.
    assert followed(0.0, 1.0, 0.4) == pytest.approx(1.0 - math.exp(-1.0), rel=1e-15)
    assert followed(1.0, 0.0, 0.8) == pytest.approx(math.exp(-1.0), rel=1e-15)
    assert followed(3.0, 7.0, math.inf) == 7.0
    assert followed(3.0, 7.0, 0.0) == 3.0


@given(logs, logs, times, times)
def test_two_steps_are_one(before: float, now: float, a: float, b: float) -> None:
    twice = followed(followed(before, now, a), now, b)
    assert twice == pytest.approx(followed(before, now, a + b), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", OPERATORS_IN_TIME)
def test_stills_are_as_without_time(name: str) -> None:
    operator = OPERATORS[name]
    still = moment(operator, 37.0)
    wanted = operator.uniforms(still)
    for key, value in operator.uniforms(operator.steady(still)).items():
        # The logarithm of the average and back.
        assert value == pytest.approx(wanted[key], rel=1e-14)


@pytest.mark.parametrize(("name", "unit"), [("reinhard02", math.e), ("exposure", 2.0)])
def test_the_average_is_followed_in_its_logarithm(name: str, unit: float) -> None:
    # From 1 to 100 cd/m2, 0.4 s: the scale has come 1 - 1/e of the way in its logarithm.
    operator = OPERATORS[name]
    assert operator.advance is not None
    dark, light = moment(operator, 1.0), moment(operator, 100.0)
    state = operator.advance(operator.steady(dark).state, light, 0.4)
    assert json.loads(json.dumps(state)) == state
    scales = [
        next(iter(operator.uniforms(m).values()))
        for m in (dark, replace(light, state=state), light)
    ]
    way = math.log(scales[0] / scales[1]) / math.log(scales[0] / scales[2])
    assert way == pytest.approx(1.0 - math.exp(-1.0), rel=1e-12)
    # What is remembered is that logarithm, of base e or 2.
    key = OPERATORS_IN_TIME[name]
    begin = operator.steady(dark).state
    assert begin is not None
    moved = (state[key] - begin[key]) * math.log(unit)
    assert moved == pytest.approx(way * math.log(100.0), rel=1e-12)


def test_trace() -> None:
    operator = OPERATORS["reinhard02"]
    assert operator.advance is not None
    assert operator.trace is not None
    dark, light = moment(operator, 1.0), moment(operator, 100.0)
    state = operator.advance(operator.steady(dark).state, light, 0.4)
    got = operator.trace(replace(light, state=state))
    assert got["goal luminance [cd/m2]"] == pytest.approx(100.0)
    assert got["adaptation [cd/m2]"] == pytest.approx(100.0 ** (1.0 - math.exp(-1.0)))
    operator = OPERATORS["exposure"]
    assert operator.trace is not None
    # 12.5 cd/m2 are EV 0 at ISO 1, and EV 6.64 at ISO 100.
    assert operator.trace(moment(operator, 12.5)) == pytest.approx(
        dict.fromkeys(("exposure value [EV]", "goal exposure value [EV]"), math.log2(100.0))
    )


def test_a_fixed_exposure_remembers_nothing() -> None:
    operator = OPERATORS["exposure"]
    assert operator.advance is not None
    assert operator.trace is not None
    fixed = operator.moment({"ev100": 3.0})
    assert operator.advance({"ev100": 9.0}, fixed, 1.0) == {}
    assert operator.trace(operator.steady(fixed)) == pytest.approx({"exposure value [EV]": 3.0})


@pytest.mark.parametrize("name", OPERATORS_IN_TIME)
@pytest.mark.parametrize("value", [math.nan, math.inf, "bright", None, [1.0]])
def test_a_state_of_something_else(name: str, value: object) -> None:
    operator = OPERATORS[name]
    assert operator.advance is not None
    frame = moment(operator, 1.0)
    for state in ({OPERATORS_IN_TIME[name]: value}, {"cone": 1.0}):
        with pytest.raises(ParameterError, match="want what an earlier frame left"):
            operator.advance(state, frame, 1.0)
        with pytest.raises(ParameterError, match="want what an earlier frame left"):
            operator.uniforms(replace(frame, state=state))
