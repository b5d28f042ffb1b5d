"""The area of a lamp from its faces: shapes whose area is known."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from hdrusd.photometry.lamp_area import LampArea, mean_area

#: Area vectors of a box of 2 m x 1 m x 0.1 m.
BOX = np.array(
    [[2, 0, 0], [-2, 0, 0], [0, 0.2, 0], [0, -0.2, 0], [0, 0, 0.1], [0, 0, -0.1]], np.float64
)


def ball(rows: int) -> npt.NDArray[np.float64]:
    """Normals times areas of patches of the unit sphere between parallels, top first, exact."""
    edges = np.linspace(0.0, math.pi, rows + 1)
    turn = (np.arange(2 * rows) + 0.5) * (math.pi / rows)
    middle = (edges[1:] + edges[:-1]) / 2.0
    size = (np.cos(edges[:-1]) - np.cos(edges[1:]))[:, None] * (math.pi / rows)
    level, up = np.sin(middle)[:, None], np.cos(middle)[:, None]
    normal = np.stack([level * np.cos(turn), level * np.sin(turn), up + 0.0 * turn], axis=-1)
    return np.asarray((normal * size[..., None]).reshape(-1, 3))


def test_flat_is_exact_however_it_lies() -> None:
    one = LampArea.of(np.array([[0.0, 0.03, 0.04]]))
    assert (one.seen, one.surface) == pytest.approx((0.05, 0.05), rel=1e-15)
    fan = LampArea.of(np.array([[0.0, 0.015, 0.02]] * 2))
    assert fan.seen == pytest.approx(0.05, rel=1e-15)


def test_a_box_is_seen_along_its_broad_side() -> None:
    box = LampArea.of(BOX)
    assert (box.seen, box.surface) == pytest.approx((2.0, 4.6), rel=1e-12)


def test_a_box_without_its_back_is_seen_through_the_opening() -> None:
    # One broad face is left: the other's normal is the mean of what remains.
    assert LampArea.of(BOX[[0, 2, 3, 4, 5]]).seen == pytest.approx(2.0, rel=1e-12)


def test_a_thing_of_two_sides_is_counted_once() -> None:
    both = LampArea.of(np.array([[0.0, 0.0, 0.3], [0.0, 0.0, -0.3]]))
    assert (both.seen, both.surface) == pytest.approx((0.3, 0.6), rel=1e-12)


def test_a_ball_and_half_of_it_are_a_disc() -> None:
    # The midpoint rule over 200 parallels: (pi / 200)^2 / 24 = 1e-5 of the area.
    whole = ball(200)
    assert LampArea.of(whole).seen == pytest.approx(math.pi, rel=1e-4)
    assert LampArea.of(whole).surface == pytest.approx(4.0 * math.pi, rel=1e-12)
    assert LampArea.of(whole[: len(whole) // 2]).seen == pytest.approx(math.pi, rel=1e-4)


def test_nothing_has_no_area() -> None:
    assert LampArea.of(np.zeros((3, 3))).seen == 0.0
    assert LampArea.of(np.empty((0, 3))).seen == 0.0
    assert LampArea.of(np.array([[np.inf, 0.0, 0.0]])).seen == 0.0
    assert mean_area([LampArea(0.0, 0.0)]) is None


def test_the_mean_over_several_places() -> None:
    lamp = mean_area([LampArea(1.0, 2.0), LampArea(3.0, 6.0), LampArea(0.0, 0.0)])
    assert lamp == LampArea(2.0, 4.0, 2, 1.0, 3.0)
