"""EULUMDAT: which planes a file stores, and what its numbers mean."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from photometric_files import GAMMA, LDT, QUADRANT, ies, ies_text, ldt, ldt_text
from test_ies import VALUES

from hdrusd.errors import InputError
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.luminaire import Opening
from hdrusd.report import Report


@pytest.mark.parametrize(("c", "gamma", "candela"), VALUES)
def test_the_quadrant_is_that_of_the_ies_file(c: float, gamma: float, candela: float) -> None:
    assert ldt(ldt_text()).value(c, gamma) == pytest.approx(candela, rel=1e-12)
    assert ldt(ldt_text()).flux() == pytest.approx(ies(ies_text()).flux(), rel=1e-12)


#: cd/klm over C, stored every 45 degrees, alike in all gamma.
CASES: dict[int, tuple[Sequence[int], Callable[[float], float]]] = {
    # symmetry: planes stored, function of C
    0: (range(0, 360, 45), lambda c: 100 + 50 * math.cos(c - 1.0)),
    1: ((0,), lambda c: 100),
    2: (range(0, 181, 45), lambda c: 100 + 50 * math.cos(c)),
    3: ((270, 315, 0, 45, 90), lambda c: 100 + 50 * math.sin(c)),
    4: ((0, 45, 90), lambda c: 100 + 50 * math.cos(2 * c)),
}


@pytest.mark.parametrize("symmetry", CASES)
def test_planes_of_a_symmetry(symmetry: int) -> None:
    stored, of = CASES[symmetry]
    rows = [[of(math.radians(c))] * len(GAMMA) for c in stored]
    lamp = ldt(ldt_text(rows, symmetry=symmetry))
    for c in range(0, 360, 45):
        assert lamp.value(c, 30.0) == pytest.approx(of(math.radians(c)), rel=1e-9), c
    for c in (22.5, 60.0, 135.0, 200.0, 300.0, 359.0):
        below = 45.0 * (c // 45.0)
        share = (c - below) / 45.0
        ends = of(math.radians(below)), of(math.radians(below + 45.0))
        wanted = ends[0] * (1 - share) + ends[1] * share
        assert lamp.value(c, 30.0) == pytest.approx(wanted, rel=1e-9), c


@pytest.mark.parametrize("planes", [(0, 90), (0, 180), (0, 30), (0, 30, 200)])
def test_planes_without_symmetry_go_all_round(planes: Sequence[float]) -> None:
    rows = [[100.0 * (1 + index)] * len(GAMMA) for index in range(len(planes))]
    lamp = ldt(ldt_text(rows, symmetry=0, planes=planes))
    for c, row in zip(planes, rows, strict=True):
        assert lamp.value(c, 30.0) == row[0]
    between = (planes[-1] + 360.0) / 2.0
    assert lamp.value(between, 30.0) == pytest.approx((rows[-1][0] + rows[0][0]) / 2.0)


def turned(planes: Sequence[float]) -> list[list[float]]:
    return [[200 + 50 * math.cos(math.radians(c - 30.0))] * len(GAMMA) for c in planes]


@pytest.mark.parametrize("start", [5, 15, -180])
def test_a_turn_without_symmetry_begins_anywhere(start: int) -> None:
    planes = range(start, start + 360, 15)
    lamp = ldt(ldt_text(turned(planes), symmetry=0, planes=planes))
    assert lamp.value(planes, 30.0) == pytest.approx([row[0] for row in turned(planes)])
    ends = turned((start - 15, start))
    assert lamp.value(start - 7.5, 30.0) == pytest.approx((ends[0][0] + ends[1][0]) / 2.0)


@pytest.mark.parametrize(
    ("symmetry", "planes"),
    [
        (2, range(0, 361, 45)),  # 360 is 0 again
        (4, range(0, 361, 45)),
        (2, range(0, 181, 45)),  # those that are stored, alone
        (4, range(0, 91, 45)),
        (2, range(0, 181, 60)),  # an even number of them
        (3, range(-90, 91, 45)),
        (3, range(90, 271, 45)),
    ],
)
def test_planes_listed_otherwise_mean_the_same(symmetry: int, planes: range) -> None:
    of = CASES[symmetry][1]
    # The last plane that is stored, whatever the list has.
    last = {2: 180, 3: planes[-1], 4: 90}[symmetry]
    rows = [[of(math.radians(c))] * len(GAMMA) for c in planes if c <= last]
    report = Report()
    lamp = ldt(ldt_text(rows, symmetry=symmetry, planes=planes), report)
    assert report.codes() == set()
    for c in range(0, 360, planes.step):
        assert lamp.value(c, 30.0) == pytest.approx(of(math.radians(c)), rel=1e-9), c


@pytest.mark.parametrize(
    ("symmetry", "wanted"),
    [
        (2, [150.0, 142.677669, 123.570226, 64.644661, 56.508738, 123.570226]),
        (3, [100.0, 117.677669, 140.236893, 135.355339, 84.286516, 59.763107]),
    ],
)
def test_half_planes_as_other_readers_have_them(symmetry: int, wanted: list[float]) -> None:
    stored, of = CASES[symmetry]
    rows = [[of(math.radians(c))] * len(GAMMA) for c in stored]
    got = ldt(ldt_text(rows, symmetry=symmetry)).value([0, 22.5, 60, 135, 200, 300], 45.0)
    assert got == pytest.approx(wanted, rel=1e-7)


def test_candela_are_per_kilolumen() -> None:
    lamp = ldt(ldt_text(lumens=(2500.0,), conversion=1.1, decimal=","))
    assert lamp.value(0, 0) == pytest.approx(400 * 2.5 * 1.1)
    assert lamp.value(0, 22.5) == pytest.approx(380 * 2.5 * 1.1)
    assert lamp.lumens == 2500.0
    absolute = ldt(ldt_text(lumens=(2500.0,), lamps=-1))
    assert absolute.value(0, 0) == pytest.approx(1000.0)
    assert absolute.lumens is None


def test_names_and_sizes() -> None:
    lamp = ldt(ldt_text().replace("Maker", "Lichtwerk Süd"))
    assert (lamp.name, lamp.type) == ("Spot 12", "C")
    assert lamp.keywords["MANUFAC"] == "Lichtwerk Süd"
    assert lamp.opening == Opening(x=0.25, y=0.5, height=0.04)  # its length is along C = 90


def test_of_several_sets_of_lamps_the_first_is_shown() -> None:
    report = Report()
    assert ldt(ldt_text(lumens=(2000.0, 5000.0)), report).value(0, 0) == pytest.approx(800.0)
    assert report.codes() == {"profile-lamp-sets"}


def test_what_follows_is_a_finding() -> None:
    report = Report()
    ldt(ldt_text() + "12\r\n\r\n\x1a", report)
    assert report.codes() == {"profile-trailing"}


def changed(line: int, value: str) -> str:
    lines = ldt_text().split("\r\n")
    lines[line - 1] = value
    return "\r\n".join(lines)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "want an EULUMDAT file"),
        ("\n" * 40, "is no number"),
        (changed(3, "5"), "lamp.ldt:3: symmetry: 5"),
        (changed(4, "1e9"), "number of C planes"),
        (changed(4, "10"), "wants a multiple of 4"),
        (changed(6, "1"), "number of gamma angles"),
        (changed(6, "4000"), "lines left"),
        (changed(26, "0"), "number of lamp sets"),
        (changed(26, "20"), "lines left"),
        (changed(29, "0"), "want more than 0"),
        (changed(29, "inf"), "lamp.ldt:29: luminous flux: 'inf' is no number"),
        (changed(45, "46"), "C planes 0 to 46"),
        (ldt_text(symmetry=3, planes=range(0, 361, 15)), "25 C planes; symmetry 3"),
        (changed(46, "abc"), "lamp.ldt:46: C planes: 'abc' is no number"),
        (changed(52, "-30"), "want 0 to 180"),
        (changed(60, "1_0"), "is no number"),
    ],
)
def test_what_is_broken_is_one_line(text: str, problem: str) -> None:
    with pytest.raises(InputError) as error:
        read_eulumdat(text.encode("latin-1"), LDT, Report())
    assert problem in str(error.value)
    assert "\n" not in str(error.value)


def test_utf_8_and_a_lone_carriage_return() -> None:
    text = ldt_text().replace("Maker", "Lichtwerk Süd").replace("\r\n", "\r")
    lamp = read_eulumdat(text.encode("utf-8"), LDT, Report())
    assert lamp.keywords["MANUFAC"] == "Lichtwerk Süd"
    assert np.array_equal(lamp.candela, QUADRANT)
