"""Influences of joints: what can be summed comes out of what files have."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.legacy.skinning import MOST_INFLUENCES, influences


def test_weights_add_up_to_one_the_strongest_first() -> None:
    found = influences(np.array([[0, 1, 2, 3]]), np.array([[1.0, 0.0, 3.0, 4.0]]), 4)
    assert found.indices.tolist() == [[3, 2, 0]]
    assert found.weights.tolist() == [[0.5, 0.375, 0.125]]
    assert (found.broken, found.free) == (0, 0)


def test_a_point_that_nothing_holds_is_on_joint_0() -> None:
    found = influences(np.array([[1, 1], [2, 0]]), np.array([[0.0, 0.0], [1.0, 1.0]]), 3)
    assert found.indices[0].tolist() == [0, 0]
    assert found.weights.tolist() == [[1.0, 0.0], [0.5, 0.5]]
    assert found.free == 1


@pytest.mark.parametrize(
    ("index", "weight"), [(9, 1.0), (-1, 1.0), (1, -2.0), (1, np.nan), (1, np.inf), (1, 1e300)]
)
def test_what_cannot_count_is_left_out(index: int, weight: float) -> None:
    found = influences(np.array([[0, index]]), np.array([[2.0, weight]]), 3)
    assert found.indices.tolist() == [[0]]
    assert found.weights.tolist() == [[1.0]]
    assert found.broken == 1


def test_an_index_of_no_weight_need_not_be_there() -> None:
    found = influences(np.array([[0, 255]]), np.array([[1.0, 0.0]]), 1)
    assert (found.broken, found.indices.tolist()) == (0, [[0]])


def test_no_influences_at_all() -> None:
    found = influences(np.zeros((3, 0), int), np.zeros((3, 0)), 2)
    assert found.weights.tolist() == [[1.0]] * 3
    assert found.free == 3


def test_the_strongest_are_kept() -> None:
    count = MOST_INFLUENCES + 4
    found = influences(np.arange(count)[None], np.arange(1.0, count + 1.0)[None], count)
    assert found.indices.shape == (1, MOST_INFLUENCES)
    assert found.indices[0, 0] == count - 1
    assert found.weights.sum() == pytest.approx(1.0, abs=1e-6)
