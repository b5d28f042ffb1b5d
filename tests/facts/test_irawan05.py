"""Irawan et al. 2005 in pictures and in time, against numbers computed outside of this project."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdrusd.errors import HdrusdError, ParameterError
from hdrusd.eye.adaptation import Eye, Goal, adapted, equivalent_luminance, looked, thresholds
from hdrusd.eye.mesopic import mesopic
from hdrusd.eye.observer import Observer
from hdrusd.eye.retina import ROD, Adaptation, unbleached
from hdrusd.eye.screen import Screen
from hdrusd.eye.threshold import tvi_ward
from hdrusd.tonemap.curve import Curve
from hdrusd.tonemap.histogram import Histogram
from hdrusd.tonemap.irawan05 import OPERATOR, anchor, seen_curve
from hdrusd.tonemap.operator import Moment, Need, State, statistics

OBSERVER = Observer(pupil="moon-spencer")
FIELD = (40.0, 25.0)
TIMES = (0.0, 0.1, 1.0, 10.0, 60.0, 600.0)

#: Log-normal counts of 40 bins over four decades.
COUNTS = np.array(
    [1, 2, 4, 7, 12, 21, 35, 56, 88, 131, 190, 264, 355, 459, 573, 689, 798, 891, 959, 995]
)
COUNTS = np.concatenate([COUNTS, COUNTS[::-1]]).astype(np.float64)

#: From and to cd/m2: first bin's ln, luminances, and display cd/m2 of them by time in s, on a
#: display of 1 to 100 cd/m2.
COURSES = {
    (1000.0, 1.0): (
        math.log(0.01),
        (0.1, 0.3, 1.0, 3.0, 10.0),
        {
            0.0: (1.0098, 1.0320, 1.1097, 1.3411, 2.2281),
            1.0: (1.0418, 1.1369, 1.4826, 2.5951, 7.4899),
            60.0: (1.1689, 1.5036, 2.5362, 4.7095, 6.8514),
            600.0: (1.2899, 1.6356, 2.6973, 4.4676, 6.6262),
        },
    ),
    (1.0, 1000.0): (
        math.log(10.0),
        (100.0, 300.0, 1000.0, 3000.0, 1e4),
        {
            0.0: (99.12, 100.0, 100.0, 100.0, 100.0),
            1.0: (9.70, 41.50, 80.25, 96.92, 100.0),
            60.0: (1.1534, 2.2721, 13.3215, 48.4841, 86.8256),
            600.0: (1.1423, 2.1494, 11.1817, 45.2183, 87.5838),
        },
    ),
}

#: Equivalent luminance, cd/m2, at TIMES.
EQUIVALENT = {
    (1000.0, 1.0): (239.71, 222.92, 65.688, 36.677, 2.0305, 1.0487),
    (1.0, 1000.0): (4.172, 36.89, 116.4, 531.6, 832.5, 999.84),
}


def goal_of(luminance: float) -> Goal:
    """Of white light, whose S/P is taken as 2.26."""
    share = float(mesopic(luminance, 2.26 * luminance)[1])
    return Goal.of(luminance, luminance, OBSERVER, FIELD)._replace(share=share)


def stepped(before: float, now: float, t: float) -> tuple[Eye, Goal]:
    at = goal_of(now)
    return looked(adapted(goal_of(before)), at, t, OBSERVER), at


def course(before: float, now: float, t: float) -> Curve:
    first = COURSES[before, now][0]
    h = Histogram(COUNTS, first, first + math.log(1e4), 0.0)
    eye, at = stepped(before, now, t)
    # Without highlights the curve is what the eye tells apart and no more.
    return seen_curve(h, eye, at, OPERATOR.moment({"highlights": 0.0}, observer=OBSERVER))


@pytest.mark.parametrize(("before", "now"), COURSES)
def test_display_after_a_step(before: float, now: float) -> None:
    _, scene, wanted = COURSES[before, now]
    for t, display in wanted.items():
        # Half of the last digit, of three to five.
        np.testing.assert_allclose(course(before, now, t).display(scene), display, rtol=6e-4)


# The vectors' weight of rods and cones takes S = 2.26 Y, as ``stepped`` does.
@pytest.mark.parametrize(("before", "now"), COURSES)
def test_equivalent_luminance(before: float, now: float) -> None:
    for t, wanted in zip(TIMES, EQUIVALENT[before, now], strict=True):
        assert equivalent_luminance(*stepped(before, now, t)) == pytest.approx(wanted, rel=5e-4)


def test_vectors_in_full(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    table = json.loads(text)["2_irawan"]
    for (before, now), (_, scene, _) in COURSES.items():
        for t in TIMES:
            row = table[f"step {before}->{now} t={t}"]
            eye, at = stepped(before, now, t)
            assert equivalent_luminance(eye, at) == pytest.approx(row["Aeq"], rel=1e-6)
            least = np.minimum(*thresholds(eye, at, now * np.array([0.1, 1, 10]), OBSERVER))
            np.testing.assert_allclose(least, row["tvia min"], rtol=1e-6)
            curve = course(before, now, t)
            # Water-filling and the reference's own iteration.
            used = float(np.ptp(curve.log_display))
            assert used == pytest.approx(row["used ln range"], rel=1e-4)
            wanted = next(row[key] for key in row if key.startswith("Ld at"))
            np.testing.assert_allclose(curve.display(scene), wanted, rtol=1e-4)


def test_an_adapted_eye_is_anchored_as_ward_has_it() -> None:
    for luminance in (0.01, 1.0, 50.0, 1e4):
        at = goal_of(luminance)
        found = anchor(adapted(at), at, 1.0, 100.0)
        wanted = luminance * float(tvi_ward(10.0) / tvi_ward(luminance))
        assert found.scene == luminance
        # The goal's sigma is found again by bisection.
        assert found.display == pytest.approx(wanted, rel=1e-6)


def test_photon_catch_alone_leaves_rods_able() -> None:
    eye, at = stepped(1000.0, 0.001, 60.0)
    photon = Observer(pupil="moon-spencer", rod_bleach="photon")
    _, full = thresholds(eye, at, 0.001, OBSERVER)
    _, least = thresholds(eye, at, 0.001, photon)
    excess = unbleached(ROD, 0.001 * at.area) - eye.rod.pigment
    assert float(full) / float(least) == pytest.approx(10.0 ** (12.0 * excess), rel=0.2)


def test_slow_time_is_the_observers() -> None:
    eye = Eye(*[Adaptation(0.0, 100.0, 1.0)] * 2)
    at = Goal(0.0, 0.0, 10.0, 1.0)
    later = looked(eye, at, 30.0, Observer(slow=30.0))
    assert later.cone.slow == later.rod.slow == pytest.approx(100.0 * math.exp(-1.0))


# Pictures: 16 x 25 pixels of a degree or so, log-normal about a luminance.


def picture(luminance: float, seed: int = 1, spread: float = 1.5) -> np.ndarray:
    rng = np.random.default_rng(seed)
    grey = luminance * np.exp(spread * rng.standard_normal((16, 25)))
    return np.repeat(grey[..., None], 3, axis=-1)


def moment_of(rgb: np.ndarray, params: dict | None = None) -> Moment:
    plain = OPERATOR.moment(params, observer=OBSERVER)
    return replace(plain, statistics=statistics(rgb, Need.FOVEAL, FIELD))


def advance(state: State | None, moment: Moment, dt: float) -> State:
    assert OPERATOR.advance is not None
    return OPERATOR.advance(state, moment, dt)


def values(moment: Moment, state: State, scene: Any = None) -> np.ndarray:
    """Display-linear values of greys, cd/m2."""
    scene = np.geomspace(1e-4, 1e6, 200) if scene is None else np.asarray(scene)
    grey = np.repeat(scene[:, None], 3, axis=-1)
    return OPERATOR.apply(grey, moment=replace(moment, state=state))[:, 1]


@settings(max_examples=25)
@given(
    st.floats(-3.0, 4.0),
    st.floats(-3.0, 4.0),
    st.floats(0.0, 100.0),
    st.floats(0.0, 3.0),
    st.sampled_from([0.0, 0.2, 5.0]),
)
def test_two_steps_are_one(before: float, now: float, a: float, b: float, smoothing: float) -> None:
    dark, light = (
        moment_of(picture(10.0**x, i), {"smoothing": smoothing})
        for i, x in enumerate((before, now))
    )
    state = advance(None, dark, math.inf)
    twice = advance(advance(state, light, a), light, b)
    once = advance(state, light, a + b)
    for key in ("cone", "rod"):
        np.testing.assert_allclose(twice[key], once[key], rtol=1e-9, atol=1e-9)
    assert twice["curve_from"] == once["curve_from"]
    # Water-filling ends within 1e-7, and there are four of them.
    np.testing.assert_allclose(twice["curve"], once["curve"], rtol=0, atol=1e-6)


def test_time_ends_at_the_still() -> None:
    dim = moment_of(picture(1.0))
    state = advance(advance(None, moment_of(picture(1000.0)), math.inf), dim, math.inf)
    assert state == advance(None, dim, math.inf)
    assert state == OPERATOR.steady(dim).state


def test_no_time_changes_no_picture() -> None:
    # The first instant of a new frame is shown by the curve of the one before.
    before, now = moment_of(picture(100.0, 1)), moment_of(picture(500.0, 2))
    state = advance(None, before, math.inf)
    scene = np.geomspace(20.0, 1000.0, 50)
    was, at_once = values(before, state, scene), values(now, advance(state, now, 0.0), scene)
    # The curve's corners are met at other places.
    np.testing.assert_allclose(at_once, was, rtol=0, atol=0.01)
    plain = moment_of(picture(500.0, 2), {"smoothing": 0.0})
    assert np.abs(values(plain, advance(state, plain, 0.0), scene) - was).max() > 0.1


def test_a_passing_car_does_not_flicker() -> None:
    # Light on a fifth of the picture in each second frame.
    rgb, lamps = picture(100.0), picture(100.0)
    lamps[2:8, 2:16] = 1e5
    frames = [moment_of(rgb), moment_of(lamps)]
    scene = np.array([30.0, 100.0, 300.0])
    state = advance(None, frames[0], math.inf)
    shown, unsmoothed = [], []
    for i in range(30):
        frame = frames[i % 2]
        plain = replace(frame, parameters={**frame.parameters, "smoothing": 0.0})
        unsmoothed.append(values(plain, advance(state, plain, 1.0 / 30.0), scene))
        state = advance(state, frame, 1.0 / 30.0)
        shown.append(values(frame, state, scene))
    jumps, without = (np.abs(np.diff(part[10:], axis=0)).max() for part in (shown, unsmoothed))
    assert without > 0.05
    # A frame of 1/30 s moves it 1 - exp(-1/6) = 15 % of the way.
    assert jumps < 0.2 * without


def test_after_a_blank_field_there_is_nothing_to_continue() -> None:
    # An eye adapted to an even field sees the new picture by its own state at once.
    blank, dim = moment_of(np.full((16, 25, 3), 1000.0)), moment_of(picture(1.0))
    plain = moment_of(picture(1.0), {"smoothing": 0.0})
    state = advance(None, blank, math.inf)
    assert advance(state, dim, 0.0) == advance(state, plain, 0.0)


@pytest.mark.parametrize(("before", "now"), COURSES)
def test_bright_to_dark_begins_black_and_dark_to_bright_white(before: float, now: float) -> None:
    blank, view = moment_of(np.full((16, 25, 3), before)), moment_of(picture(now))
    state = advance(None, blank, math.inf)
    middle = [float(values(view, advance(state, view, t), [now])[0]) for t in TIMES]
    if before > now:
        assert middle[0] < 0.02
        assert middle[0] < middle[1] < middle[2]
        assert middle[-1] > 2.0 * middle[0]
    else:
        assert middle[0] > 0.98
        assert (np.diff(middle) <= 1e-9).all()
        assert middle[-1] < 0.3


def test_curve_of_any_instant_rises() -> None:
    views = [moment_of(picture(10.0**x, i)) for i, x in enumerate((-3, 3, 0, 1, -2))]
    state = None
    for i in range(20):
        view = views[i % 5]
        state = advance(state, view, 0.05)
        assert (np.diff(values(view, state)) >= -1e-7).all()


def test_state_is_json_and_short() -> None:
    state = advance(None, moment_of(picture(1.0)), math.inf)
    text = json.dumps(state)
    assert json.loads(text) == state
    assert len(text) < 4000


def test_rods_adapt_to_what_rods_see() -> None:
    # The blue of the night has more of it than the same luminance of red.
    blue, red = np.zeros((2, 16, 25, 3))
    blue[..., 2], red[..., 0] = 1.0 / 0.0722, 1.0 / 0.2126
    states = [advance(None, moment_of(rgb), math.inf) for rgb in (blue, red)]
    assert states[0]["cone"][0] == pytest.approx(states[1]["cone"][0])
    assert states[0]["rod"][0] > 20.0 * states[1]["rod"][0]


def test_weights_of_the_picture() -> None:
    # A lamp in the corner counts less for eyes that stay about the centre.
    rgb = np.full((50, 80, 3), 1.0)
    rgb[:10, :10] = 1000.0
    light = {}
    for weights in ("uniform", "centre", "gaze"):
        view = replace(
            moment_of(rgb, {"weights": weights}), statistics=statistics(rgb, Need.FOVEAL, (80, 50))
        )
        light[weights] = advance(None, view, math.inf)["cone"][0]
    assert light["uniform"] > light["centre"] > light["gaze"]


def test_trace() -> None:
    assert OPERATOR.trace is not None
    view = moment_of(np.full((16, 25, 3), 1.0))
    got = OPERATOR.trace(OPERATOR.steady(view))
    assert got["goal luminance [cd/m2]"] == pytest.approx(1.0)
    assert got["goal luminance of rods [cd/m2]"] == pytest.approx(1.0)
    assert got["equivalent luminance [cd/m2]"] == pytest.approx(1.0, rel=1e-6)
    assert got["pupil [mm]"] == pytest.approx(4.9)
    assert got["threshold of cones [cd/m2]"] == pytest.approx(0.391301527)
    assert got["threshold of rods [cd/m2]"] == pytest.approx(0.463778896)
    assert got["threshold [cd/m2]"] == pytest.approx(0.391301527)
    assert got["sigma of cones [td]"] == pytest.approx(29.812045)
    assert got["cone pigment"] == pytest.approx(0.99811781)
    # One luminance and 1 % more need no more than that of the display.
    assert 0.0 < got["display range used"] <= math.log(1.011) / math.log(100.0)


def test_screen_without_black() -> None:
    view = replace(moment_of(picture(1.0)), screen=Screen(black=0.0))
    got = values(view, advance(None, view, math.inf))
    assert got[0] == pytest.approx(0.0, abs=1e-3)
    assert got[-1] == 1.0


@pytest.mark.parametrize(
    "change",
    [
        {"cone": [1.0, 1.0]},
        {"cone": [1.0, -1.0, 1.0]},
        {"rod": [1.0, 1.0, 0.0]},
        {"rod": [math.nan, 1.0, 0.5]},
        {"curve": [1.0]},
        {"curve": [1.0, "x"]},
        {"curve": [0.0, math.inf]},
        {"curve": [0.0] * 100_000},
        {"curve_from": [2.0, 1.0]},
        {"curve_from": None},
    ],
)
def test_a_state_of_something_else(change: dict) -> None:
    view = moment_of(picture(1.0))
    state = {**advance(None, view, math.inf), **change}
    with pytest.raises(ParameterError, match="want what an earlier frame left"):
        advance(state, view, 1.0)
    with pytest.raises(ParameterError, match="want what an earlier frame left"):
        OPERATOR.uniforms(replace(view, state=state))


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"weights": "left"}, "weights: left; want"),
        ({"smoothing": -1.0}, "smoothing: -1.0; want"),
        ({"exponent": 3.0}, "exponent: 3.0; want"),
    ],
)
def test_senseless_parameter(params: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        OPERATOR.check(params)


def test_statistics_without_a_foveal_image() -> None:
    rgb = picture(1.0)
    with pytest.raises(HdrusdError, match="foveal"):
        OPERATOR.apply(rgb, statistics(rgb))


def test_highlights_are_brighter_than_what_is_just_told_apart() -> None:
    """A lamp dazzles an eye that is adapted to a dark road; beside it all stays as it was."""
    rgb = np.full((40, 40, 3), 0.5)
    rgb[:20] = 0.2
    rgb[4:8, 4:8] = 5000.0
    shown = {}
    for share in (0.0, 0.5, 1.0):
        moment = moment_of(rgb, {"highlights": share, "smoothing": 0.0})
        curve = OPERATOR.apply(rgb, moment=OPERATOR.steady(moment))
        shown[share] = curve[4, 4, 1], curve[0, 0, 1]
    assert shown[0.0][0] < 0.1 < shown[0.5][0] <= shown[1.0][0] <= 1.0
    assert shown[0.0][1] == pytest.approx(shown[1.0][1], rel=1e-6)
