"""Symmetries of LM-63, interpolation and flux of a luminaire in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from photometric_files import ies, ies_text

from hdrusd.errors import InputError
from hdrusd.photometry.luminaire import Luminaire


def of_c(planes: list[float]) -> Luminaire:
    """Candela 1 + number of the plane, alike in all gamma."""
    rows = [[1.0 + index] * 2 for index in range(len(planes))]
    return ies(ies_text(rows, planes=planes, angles=(0, 90)))


def test_one_plane_is_a_figure_of_rotation() -> None:
    assert of_c([0.0]).value([0, 77, 180, 359.9], 45.0).tolist() == [1.0] * 4


def test_a_quadrant_is_mirrored_twice() -> None:
    got = of_c([0.0, 30.0, 90.0]).value([30, 150, 210, 330, 0, 180, 90, 270], 45.0)
    assert got.tolist() == [2, 2, 2, 2, 1, 1, 3, 3]


def test_a_half_is_mirrored_about_c_0() -> None:
    got = of_c([0.0, 60.0, 120.0, 180.0]).value([60, 300, 120, 240, 0, 180, 30, 330], 45.0)
    assert got.tolist() == [2, 2, 3, 3, 1, 4, 1.5, 1.5]


@pytest.mark.parametrize("planes", [[90.0, 150.0, 270.0], [90.0, 150.0, 180.0, 270.0]])
def test_a_half_is_mirrored_about_c_90(planes: list[float]) -> None:
    lamp = of_c(planes)
    assert lamp.value([90, 150, 270], 45.0).tolist() == [1, 2, len(planes)]
    for c in (90.0, 100.0, 150.0, 170.0, 180.0, 200.0, 260.0):
        assert lamp.value((180.0 - c) % 360.0, 45.0) == pytest.approx(lamp.value(c, 45.0)), c


@pytest.mark.parametrize("planes", [[0.0, 90.0, 200.0, 360.0], [0.0, 90.0, 200.0, 280.0]])
def test_all_planes_go_round(planes: list[float]) -> None:
    lamp = of_c(planes)
    last = 4.0 if planes[-1] == 360.0 else 1.0
    assert lamp.value([0, 45, 90, 200], 45.0).tolist() == [1, 1.5, 2, 3]
    below = planes[-1] if planes[-1] < 360.0 else 200.0
    value = 4.0 if planes[-1] < 360.0 else 3.0
    assert lamp.value((below + 360.0) / 2, 45.0) == pytest.approx((value + last) / 2)


@pytest.mark.parametrize(
    "planes",
    [
        [7.5 + 15 * i for i in range(24)],
        [15.0 * i for i in range(1, 25)],
        [-180.0 + 15 * i for i in range(25)],
        [-180.0 + 15 * i for i in range(24)],
        [45.0, 135.0, 225.0, 315.0],
        [90.0 + 15 * i for i in range(25)],
        [5.0, 20.0, 100.0, 200.0, 280.0, 350.0],
    ],
)
def test_a_whole_turn_begins_anywhere(planes: list[float]) -> None:
    rows = [[100.0 + plane % 360.0] * 2 for plane in planes]
    lamp = ies(ies_text(rows, planes=planes, angles=(0, 90)))
    for plane, row in zip(planes, rows, strict=True):
        assert lamp.value([plane, plane + 360.0], 45.0) == pytest.approx([row[0]] * 2)
    # In a line between two neighbours, also through the plane where the file begins.
    ring = sorted({plane % 360.0 for plane in planes})
    for low, high in zip(ring, [*ring[1:], ring[0] + 360.0], strict=True):
        middle = (low + high) / 2.0
        assert lamp.value(middle, 45.0) == pytest.approx(100.0 + (low + high % 360.0) / 2.0), low
    unfolded, candela = lamp.unfolded()
    assert (unfolded[0], unfolded[-1]) == (0.0, 360.0)
    assert candela[0].tolist() == candela[-1].tolist()


@pytest.mark.parametrize("planes", [[180.0, 270.0, 360.0], [0.0, 60.0, 120.0, 200.0], [0.0, 45.0]])
def test_a_part_of_a_turn_is_no_turn(planes: list[float]) -> None:
    with pytest.raises(InputError, match="or a whole turn"):
        of_c(planes)


def test_ends_that_are_moved_stay_in_order() -> None:
    with pytest.raises(InputError, match="not in ascending order"):
        of_c([0.0, 30.0, 90.002, 90.004])


def test_nearly_a_symmetry_is_one() -> None:
    assert of_c([0.0, 30.0, 89.995]).value([330.0, 179.999], 45.0) == pytest.approx(
        [2, 1], abs=1e-4
    )


@pytest.mark.parametrize("type", ["A", "B"])
def test_h_of_types_a_and_b(type: str) -> None:
    rows = [[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]]
    mirrored = ies(ies_text(rows, planes=(0, 30, 90), angles=(-10, 10), type=type))
    assert mirrored.value([-30, 30, -90, 0], -10.0).tolist() == [2, 2, 3, 1]
    assert mirrored.value(-30, [10.0, 0.0, 11.0, -11.0]).tolist() == [20, 11, 0, 0]
    whole = ies(ies_text(rows, planes=(-20, 0, 30), angles=(-10, 10), type=type))
    assert whole.value([-20, -10, 30, 31, -21], -10.0).tolist() == [1, 1.5, 3, 0, 0]


def test_flux_of_an_even_source() -> None:
    for planes in ([0.0], [0.0, 90.0], [0.0, 180.0], [90.0, 270.0], [0.0, 90.0, 180.0, 270.0]):
        rows = np.full((len(planes), 2), 100.0)
        lamp = ies(ies_text(rows, planes=planes, angles=(0, 180)))
        assert lamp.flux() == pytest.approx(400 * math.pi, rel=1e-12)


def test_flux_between_two_gammas() -> None:
    # cd falls in a line from 100 at 0 to nothing at pi/2: 2 pi times the integral of
    # 100 (1 - g / (pi/2)) sin g, which is 100 (1 - 2/pi).
    lamp = ies(ies_text([100.0, 0.0], planes=(0,), angles=(0, 90)))
    assert lamp.flux() == pytest.approx(200 * math.pi * (1 - 2 / math.pi), rel=1e-12)


@pytest.mark.parametrize("type", ["A", "B"])
def test_flux_of_an_even_window(type: str) -> None:
    # A: solid angle (sin 20 - sin -10) x 60 degrees; B: the same of H and V turned about.
    rows = np.full((2, 2), 50.0)
    planes, angles = ((-30, 30), (-10, 20)) if type == "A" else ((-10, 20), (-30, 30))
    lamp = ies(ies_text(rows, planes=planes, angles=angles, type=type))
    sines = math.sin(math.radians(20)) + math.sin(math.radians(10))
    assert lamp.flux() == pytest.approx(50 * math.radians(60) * sines, rel=1e-12)


def test_flux_of_a_quadrant_is_that_of_a_fine_sum() -> None:
    # By 1,000 x 1,000 midpoints elsewhere: 1127.3027 lm.
    assert ies(ies_text()).flux() == pytest.approx(1127.302726, rel=3e-6)


@given(
    c=st.floats(-720.0, 720.0),
    gamma=st.floats(-10.0, 190.0),
    planes=st.sampled_from([[0.0], [0.0, 90.0], [0.0, 50.0, 180.0], [90.0, 270.0], [0.0, 270.0]]),
)
def test_a_value_is_between_those_of_the_file(c: float, gamma: float, planes: list[float]) -> None:
    lamp = of_c(planes)
    value = float(lamp.value(c, gamma))
    if 0.0 <= gamma <= 90.0:
        assert 1.0 - 1e-9 <= value <= len(planes) + 1e-9
    else:
        assert value == 0.0
