"""Histogram adjustment: known curves, the loop against the filling, and what always holds."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from hdrusd.eye.foveal import Foveal
from hdrusd.eye.threshold import tvi_ward
from hdrusd.tonemap.histogram import (
    Anchor,
    Histogram,
    adapted_anchor,
    fill,
    histogram,
    level,
    proportionate,
    trimmed,
)

#: 20 bins from 0.01 to 10,000 cd/m2, for a display of 1 to 100 cd/m2.
COUNTS = [0, 5, 20, 60, 120, 200, 150, 80, 40, 20, 10, 8, 6, 5, 4, 4, 3, 2, 2, 1]
NIGHT = Histogram(np.array(COUNTS, float), math.log(0.01), math.log(1e4), 0.0)
SCENE = [0.05, 0.5, 5.0, 50.0, 500.0]

#: What the loop makes of it, computed elsewhere; it agrees with pcond's binary to 7e-7.
HUMAN = [1.405189, 4.850775, 13.717156, 43.288788, 73.140683]
LINEAR = [1.113174, 7.172833, 54.763433, 79.350350, 91.722097]

#: What it converges to (human ceiling), at the edges.
FILLED = [1, 1, 1.18633, 1.97115, 2.89895, 3.97348, 5.20053, 6.58743, 8.98041, 13.35590, 21.48537,
          30.23817, 39.74529, 48.79028, 57.88148, 66.35975, 76.07988, 84.29341, 90.25602, 96.64040,
          100]  # fmt: skip

ANYWHERE = Anchor(1.0, 1.0)


def filled(h: Histogram, low: float = 1.0, high: float = 100.0, **options: object):
    return fill(h, low, high, tvi_ward(np.exp(h.centres)), ANYWHERE, **options)


@pytest.mark.parametrize(("threshold", "wanted"), [(tvi_ward, HUMAN), (proportionate, LINEAR)])
def test_loop(threshold, wanted: list[float]) -> None:
    curve = trimmed(NIGHT, 1.0, 100.0, threshold)
    np.testing.assert_allclose(curve.display(SCENE), wanted, rtol=5e-7)


def test_loop_vectors(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    vectors = json.loads(text)["2_ward_hist"]
    for name, threshold in (("human", tvi_ward), ("linear-ceiling", proportionate)):
        curve = trimmed(NIGHT, 1.0, 100.0, threshold)
        cumulated = curve.log_display / math.log(100.0)
        np.testing.assert_allclose(cumulated, vectors[f"{name} cumulative"], rtol=1e-12)
    np.testing.assert_allclose(curve.display(SCENE), vectors["map linear-ceiling Ld"], rtol=1e-12)


def test_filling() -> None:
    np.testing.assert_allclose(np.exp(filled(NIGHT, floor=0.0).log_display), FILLED, rtol=2e-6)


def test_loop_gives_up_where_everything_fits() -> None:
    # 20 to 200 cd/m2 on a display of 1 to 100.
    h = Histogram(np.array([1.0, 5.0, 1.0]), math.log(20.0), math.log(200.0), math.log(60.0))
    assert trimmed(h, 1.0, 100.0, proportionate) is None


def test_narrow_scene_is_in_proportion() -> None:
    counts = np.array([0, 10, 60, 200, 300, 200, 60, 10, 0, 0], float)
    h = Histogram(counts, math.log(20.0), math.log(200.0), math.log(60.0))
    anchor = adapted_anchor(h, 1.0, 100.0, tvi_ward)
    # tvi(10) / tvi(60): an adapted viewer's thresholds.
    assert anchor.display / anchor.scene == pytest.approx(0.301670399, rel=5e-9)
    curve = fill(h, 1.0, 100.0, tvi_ward(np.exp(h.centres)), anchor)
    # 1e-7 is where the iteration ends, in ln units.
    np.testing.assert_allclose(curve.display([20.0, 200.0]), [6.03340797, 60.3340797], rtol=2e-7)
    # Beyond what the histogram has seen, the same factor up to white.
    np.testing.assert_allclose(curve.display([10.0, 1e4]), [3.01670399, 100.0], rtol=2e-7)


def test_anchor_of_proportion() -> None:
    # pcond's linear map without -s: the mean goes to the middle of the display's range.
    h = Histogram(np.ones(4), 0.0, 1.0, math.log(0.5))
    assert adapted_anchor(h, 1.0, 100.0, proportionate) == pytest.approx((0.5, 10.0))


def test_what_is_not_seen_gets_no_contrast() -> None:
    threshold = tvi_ward(np.exp(NIGHT.centres))
    threshold[12:] = np.inf
    curve = fill(NIGHT, 1.0, 100.0, threshold, ANYWHERE)
    assert (np.diff(curve.log_display)[12:] == 0.0).all()
    assert (np.diff(curve.log_display)[:12] > 0.0).all()


@pytest.mark.parametrize(("display", "at"), [(1e-9, 1.0), (1e9, 100.0), (30.0, None)])
def test_anchor_places_what_does_not_fill_the_display(display: float, at: float | None) -> None:
    # Thresholds a hundred times the adapted ones leave a hundredth of the slopes.
    threshold = 100.0 * tvi_ward(np.exp(NIGHT.centres))
    curve = fill(NIGHT, 1.0, 100.0, threshold, Anchor(10.0, display))
    rise = math.exp(np.ptp(curve.log_display))
    assert rise < 3.0
    if at is None:
        assert float(curve.display(10.0)) == pytest.approx(30.0, rel=1e-6)
    else:  # it stays on the display
        assert np.exp(curve.log_display[0 if at == 1.0 else -1]) == pytest.approx(at, rel=1e-6)


def test_blind_eye_sees_nothing() -> None:
    curve = fill(NIGHT, 1.0, 100.0, np.full(20, np.inf), Anchor(1.0, 5.0))
    np.testing.assert_allclose(np.exp(curve.log_display), 5.0, rtol=1e-12)


#: Empty bins and others: a weight is at least that of a single pixel.
COUNT = st.just(0.0) | st.floats(1e-3, 1e3)
COUNT_LISTS = st.lists(COUNT, min_size=20, max_size=100).filter(lambda c: sum(c) > 1.0)


@st.composite
def histograms(draw: st.DrawFn) -> Histogram:
    counts = np.array(draw(COUNT_LISTS))
    bmin = draw(st.floats(-14.0, 8.0))
    width = draw(st.floats(0.01, 25.0))
    return Histogram(counts, bmin, bmin + width, bmin + 0.5 * width)


DISPLAYS = st.tuples(st.floats(1e-3, 5.0), st.floats(20.0, 1e4))


@given(histograms(), DISPLAYS, st.floats(0.01, 100.0), st.integers(0, 60), st.floats(1e-3, 1e3))
def test_never_falls_and_stays_on_the_display(
    h: Histogram, display: tuple[float, float], worse: float, unseen: int, wanted: float
) -> None:
    low, high = display
    threshold = worse * tvi_ward(np.exp(h.centres))
    threshold[unseen:] = np.inf
    curve = fill(h, low, high, threshold, Anchor(math.exp(h.mean), wanted))
    assert (np.diff(curve.log_display) >= 0.0).all()
    assert curve.log_display[0] >= math.log(low) - 1e-9
    assert curve.log_display[-1] <= math.log(high) + 1e-9


def smooth(y: np.ndarray) -> np.ndarray:
    """A threshold like the eye's (dark light, de Vries-Rose, Weber), without steps."""
    return 0.001 + 0.02 * np.sqrt(y) + 0.056 * y


@given(histograms(), DISPLAYS, st.floats(0.1, 10.0))
def test_slopes_are_counts_below_the_ceiling(
    h: Histogram, display: tuple[float, float], worse: float
) -> None:
    low, high = display
    span = math.log(high / low)
    assume(h.bmax - h.bmin > 1.25 * span)  # below, contrast is held back further
    scene = np.exp(h.centres)
    threshold = worse * smooth(scene)
    curve = fill(h, low, high, threshold, ANYWHERE, display_threshold=smooth)
    shown = np.exp(0.5 * (curve.log_display[:-1] + curve.log_display[1:]))
    ceiling = smooth(shown) / shown / (threshold / scene)
    slope = np.diff(curve.log_display) / h.width
    # The iteration ends at 1e-7 in ln units, and thresholds over luminance follow that.
    near = 1e-5 * ceiling + 1e-6 / h.width
    assert (slope <= ceiling + near).all()
    if np.ptp(curve.log_display) < span - 1e-6:  # all that is seen fits the display
        assert (slope >= ceiling - near).all()
    else:
        counts = h.counts + 1e-3 * h.counts.mean()
        level_of = slope / counts
        cut = slope < ceiling - near
        if cut.any():
            # One level for all that do not reach their ceiling, and no more for the others.
            np.testing.assert_allclose(level_of[cut], level_of[cut].max(), rtol=1e-6)
            assert (level_of <= level_of[cut].max() * (1.0 + 1e-6)).all()


@given(histograms())
def test_filling_is_what_the_loop_converges_to(h: Histogram) -> None:
    # With a ceiling that does not move with the curve, since the loop gives nothing back.
    assume(h.bmax - h.bmin > 1.25 * math.log(100.0))
    loop = trimmed(h, 1.0, 100.0, proportionate, tolerance=1e-7)
    assume(loop is not None)
    scene = np.exp(h.centres)
    curve = fill(h, 1.0, 100.0, scene, ANYWHERE, display_threshold=proportionate, floor=0.0)
    np.testing.assert_allclose(curve.log_display, loop.log_display, rtol=0, atol=1e-4)


def test_filling_is_what_the_loop_converges_to_for_an_eye() -> None:
    loop = trimmed(NIGHT, 1.0, 100.0, tvi_ward, tolerance=1e-7)
    curve = filled(NIGHT, floor=0.0)
    np.testing.assert_allclose(curve.log_display, loop.log_display, rtol=0, atol=1e-6)


@given(histograms())
def test_start_changes_nothing(h: Histogram) -> None:
    other = filled(Histogram(h.counts[::-1] + 1.0, h.bmin - 1.0, h.bmax + 0.5, h.mean))
    threshold = smooth(np.exp(h.centres))
    cold, warm = (
        fill(h, 1.0, 100.0, threshold, ANYWHERE, display_threshold=smooth, start=start)
        for start in (None, other)
    )
    np.testing.assert_allclose(warm.log_display, cold.log_display, rtol=0, atol=1e-5)


@given(COUNT_LISTS, st.data())
def test_level_is_exact(counts: list[float], data: st.DataObject) -> None:
    counts = np.array(counts)
    size = counts.size
    ceiling = np.array(data.draw(st.lists(st.floats(0.0, 10.0), min_size=size, max_size=size)))
    total = data.draw(st.floats(0.01, 20.0))
    slope = level(counts, ceiling, total)
    assert (slope <= ceiling).all()
    reachable = ceiling[counts > 0.0].sum()
    if ceiling.sum() <= total:
        assert (slope == ceiling).all()
    else:
        assert slope.sum() == pytest.approx(min(total, reachable), rel=1e-9)
        rising = (slope < ceiling) & (counts > 0.0)
        if rising.any():
            factor = slope[rising] / counts[rising]
            np.testing.assert_allclose(factor, factor[0], rtol=1e-12)
            # Full bins are those whose share would be more.
            assert (factor[0] * counts >= slope * (1.0 - 1e-12)).all()


def foveal_of(samples: np.ndarray, points: np.ndarray) -> Foveal:
    return Foveal(samples[..., None] * np.ones(3), points, (40.0, 30.0))


def test_histogram_weighs_samples_and_points_alike() -> None:
    h = histogram(foveal_of(np.array([[1.0, 10.0]]), np.full(40, 100.0)), bins=10)
    assert h.bmin == pytest.approx(0.0)
    assert h.bmax == pytest.approx(math.log(101.0))
    np.testing.assert_allclose(h.counts, [1, 0, 0, 0, 1, 0, 0, 0, 0, 2])
    assert h.mean == pytest.approx((math.log(10.0) + 2.0 * math.log(100.0)) / 4.0)
    weighted = histogram(foveal_of(np.array([[1.0, 10.0]]), np.full(40, 100.0)), [[3, 1]], bins=10)
    np.testing.assert_allclose(weighted.counts, [3, 0, 0, 0, 1, 0, 0, 0, 0, 4])


def test_histogram_of_extremes() -> None:
    black = histogram(foveal_of(np.zeros((2, 2)), np.zeros(4)))
    assert black.bmin == pytest.approx(math.log(1e-7))
    assert black.bmax > black.bmin
    assert black.counts.sum() == 8.0
    sun = histogram(foveal_of(np.full((2, 2), 1e12), np.full(4, 0.1)))
    assert sun.bmin == pytest.approx(math.log(0.1))
    assert sun.bmax == pytest.approx(math.log(1.01e7))
    assert sun.counts[0] == sun.counts[-1] == 4.0
    # What is darker than any night sky is nothing, unless there is nothing else.
    void = histogram(foveal_of(np.array([[0.0, 1e-6, 3.0, 5.0]]), np.full(4, 4.0)))
    assert void.bmin == pytest.approx(math.log(3.0))
    assert void.counts.sum() == 6.0
    assert void.mean == pytest.approx(math.log(3.0 * 5.0 * 4.0**4) / 6.0)
    one = histogram(foveal_of(np.full((2, 2), 50.0), np.full(4, 50.0)))
    assert one.bmax - one.bmin == pytest.approx(math.log(1.01))
    assert filled(one).display(50.0) > 0.0


def test_pcond_splits_the_lowest_bin() -> None:
    samples, points = np.array([[1.0, 1.0, 10.0]]), np.full(3, 100.0)
    plain = histogram(foveal_of(samples, points), bins=99)
    split = histogram(foveal_of(samples, points), bins=100, pcond=True)
    assert split.width == pytest.approx(plain.width)
    assert split.bmin == pytest.approx(plain.bmin - plain.width)
    np.testing.assert_allclose(split.counts[2:], plain.counts[1:])
    np.testing.assert_allclose(split.counts[:2], 0.5 * plain.counts[0])
