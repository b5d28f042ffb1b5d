"""Boxes that meet a box: all of them and no others."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdrusd.usd.boxes import Boxes


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 300), st.sampled_from([1e-3, 1.0, 1e3]))
def test_those_that_meet_are_found_by_a_look_at_all(seed: int, count: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    low = np.round(rng.uniform(-spread, spread, (count, 3)), 2)
    # Flat ones, points, and lengths from a thousandth of the scene to all of it.
    size = spread * 10.0 ** rng.uniform(-3.0, 0.5, (count, 3)) * rng.integers(0, 2, (count, 3))
    boxes = Boxes(low, low + size)
    for _ in range(5):
        one = np.round(rng.uniform(-spread, spread, 3), 2)
        other = one + spread * rng.choice([0.0, 0.01, 1.0], 3)
        meets = np.all((low <= other) & (low + size >= one), axis=1)
        assert boxes.meeting(one, other).tolist() == np.flatnonzero(meets).tolist()


def test_a_touch_is_a_meeting() -> None:
    boxes = Boxes(np.zeros((1, 3)), np.ones((1, 3)))
    assert boxes.meeting(np.ones(3), np.full(3, 2.0)).tolist() == [0]
    assert boxes.meeting(np.full(3, 1.001), np.full(3, 2.0)).tolist() == []


@pytest.mark.filterwarnings("error")
def test_boxes_without_end_meet_what_is_in_them() -> None:
    low = np.array([[-np.inf, 0.0, 0.0], [np.nan, 0.0, 0.0], [5.0, 0.0, 0.0]])
    high = np.array([[np.inf, 1.0, 1.0], [1.0, 1.0, 1.0], [6.0, 1.0, 1.0]])
    boxes = Boxes(low, high)
    assert boxes.meeting(np.full(3, 0.5), np.full(3, 0.6)).tolist() == [0]
