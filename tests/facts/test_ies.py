"""IES LM-63: what the numbers of a file mean, edition by edition."""

from __future__ import annotations

import re

import numpy as np
import pytest
from photometric_files import GAMMA, IES, QUADRANT, ies, ies_text

from hdrusd.errors import InputError
from hdrusd.photometry.ies import is_ies, read_ies, with_tilt
from hdrusd.photometry.luminaire import Opening
from hdrusd.report import Report

#: (C, gamma) and cd of the quadrant, by hand and by two other readers.
VALUES = [
    (0, 0, 400.0),
    (0, 22.5, 380.0),
    (22.5, 45, 280.0),
    (45, 60, 500 / 3),
    (135, 60, 500 / 3),
    (200, 30, 9220 / 27),
    (300, 80, 1430 / 27),
    (10, 90, 86 / 9),
    (10, 100, 0.0),
]


@pytest.mark.parametrize(("c", "gamma", "candela"), VALUES)
def test_candela_of_a_quadrant(c: float, gamma: float, candela: float) -> None:
    assert ies(ies_text()).value(c, gamma) == pytest.approx(candela, rel=1e-12)


def test_a_luminaire_says_what_the_file_says() -> None:
    lamp = ies(ies_text(lumens=1800.0))
    assert (lamp.name, lamp.type, lamp.lumens) == ("Spot 12", "C", 1800.0)
    assert lamp.planes.tolist() == [0, 45, 90]
    assert lamp.angles.tolist() == list(GAMMA)
    assert lamp.candela.tolist() == [list(row) for row in QUADRANT]
    assert ies(ies_text()).lumens is None


@pytest.mark.parametrize(
    ("label", "factor"),
    [
        ("", 0.9 * 0.8),  # 1986
        ("IESNA86", 0.9 * 0.8),
        ("IESNA91", 0.9 * 0.8),
        ("IESNA:LM-63-1995", 0.9),
        ("IESNA:LM-63-2002", 0.9),
        ("IES:LM-63-2019", 0.9),
        ("IES:LM-63-2031", 0.9),
    ],
)
def test_the_photometric_factor_is_that_of_1986_and_1991(label: str, factor: float) -> None:
    report = Report()
    text = ies_text(label=label, multiplier=2.0, ballast=0.9, photometric=0.8, lumens=5000)
    assert ies(text, report).value(0, 0) == pytest.approx(400 * 2.0 * factor, rel=1e-12)
    assert report.codes() == (set() if label and "2031" not in label else {"profile-edition"})


def test_keywords_go_on() -> None:
    text = ies_text(keywords="[TEST] 12\n[OTHER]  first\n[MORE] second\n[_OWN] x\nno keyword")
    found = ies(text).keywords
    assert found == {"TEST": "12", "OTHER": "first\nsecond", "OWN": "x"}


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_numbers_stand_anywhere(end: str) -> None:
    head, body = ies_text().split("TILT=NONE\n")
    spread = ", ".join(body.split()) + "\n\x1a\n"
    report = Report()
    lamp = ies((head + "TILT=NONE\n" + spread).replace("\n", end), report)
    assert lamp.value(45, 60) == pytest.approx(500 / 3)
    assert not report.codes()


TILTED = "1\n3\n0 45 90\n0.9 0.95 1.2"


def test_included_tilt_holds_for_a_level_luminaire() -> None:
    report = Report()
    lamp = ies(ies_text(tilt=f"TILT=INCLUDE\n{TILTED}"), report)
    assert lamp.value(0, 0) == pytest.approx(360.0)
    assert report.codes() == {"profile-tilt"}


def test_tilt_of_a_file() -> None:
    files = {"lamp.tlt": TILTED.encode()}
    data = ies_text(tilt="TILT=lamp.tlt").encode()
    assert read_ies(data, IES, Report(), files.get).value(0, 0) == pytest.approx(360.0)
    report = Report()
    assert read_ies(data, IES, report).value(0, 0) == pytest.approx(400.0)
    assert [str(finding.kind) for finding in report] == ["missing"]


@pytest.mark.parametrize(
    ("size", "units", "opening"),
    [
        ((0, 0, 0), 2, Opening()),
        ((0.3, 1.2, 0.1), 2, Opening(1.2, 0.3, 0.1)),  # width, length, height
        ((1, 2, 0), 1, Opening(0.6096, 0.3048, 0.0)),  # feet
        ((-0.2, 0, 0), 2, Opening(0.2, 0.2, 0.0, round=True)),
        ((-0.2, -0.2, -0.2), 2, Opening(0.2, 0.2, 0.2, round=True)),
    ],
)
def test_opening(size: tuple[float, ...], units: int, opening: Opening) -> None:
    assert ies(ies_text(size=size, units=units)).opening == opening


def test_what_is_odd_is_a_finding() -> None:
    report = Report()
    candela = np.array(QUADRANT, float)
    candela[1, 4] = -3.0
    lamp = ies(ies_text(candela) + "7 8 9", report)
    assert lamp.value(45, 90) == 0.0
    assert report.codes() == {"profile-negative", "profile-trailing"}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no TILT= line"),
        ("IESNA91\nTILT=NONE\n", "0 numbers left"),
        ("IESNA91\nTILT=NONE\n1 2 x", "no number"),
        (ies_text().replace("400 380", "nan 380"), "no finite number"),
        (ies_text().replace("400 380", "4_0 380"), "no finite number"),
        (ies_text()[:-4], "14 numbers left; want 15"),
        (ies_text().replace(" 5 3 1 2", " 4000 4000 1 2"), "want at most 2097152"),
        (ies_text().replace(" 5 3 1 2", " 2.5 3 1 2"), "counts of angles"),
        (ies_text().replace(" 5 3 1 2", " 999999999999 3 1 2"), "counts of angles"),
        (ies_text().replace(" 5 3 1 2", " 5 3 4 2"), "photometric type"),
        (ies_text().replace(" 5 3 1 2", " 5 3 1 3"), "units"),
        (ies_text(angles=(0, 45, 22.5, 60, 90)), "ascending"),
        (ies_text(angles=(0, 45, 90, 135, 190)), "want 0 to 180"),
        (ies_text(angles=(0,), candela=[1, 2, 3]), "want 2 or more"),
        (ies_text(planes=(0, 30, 60)), "want 0 alone"),
        (ies_text(planes=(0, 130, 200)), "want 0 alone"),
        (ies_text(multiplier=0.0), "want more than 0"),
        (ies_text(ballast=-1.0), "want more than 0"),
        (ies_text(multiplier=1e300, ballast=1e300), "want more than 0"),
        (ies_text().replace("400 380", "1e308 380"), "want at most 1e+12"),
        (ies_text(tilt="TILT=INCLUDE\n1\n2\n90 0\n1 1"), "ascending"),
        (ies_text(tilt="TILT=INCLUDE\n1\n2000\n90 0\n1 1"), "count of tilt angles"),
        (ies_text(type="A", planes=(0,), angles=(0, 9), candela=[1, 2]), "type A wants 2"),
    ],
)
def test_what_is_broken_is_one_line(text: str, problem: str) -> None:
    with pytest.raises(InputError) as error:
        ies(text)
    assert problem in str(error.value)
    assert re.match(r"lamp\.ies(:\d+|:lamp\.tlt:\d+)?: ", str(error.value))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_that_stands_alone_reads_as_with_its_tilt_file(end: str) -> None:
    data = ies_text(tilt="TILT=lamp.tlt").replace("\n", end).encode()
    beside = {"lamp.tlt": TILTED.replace("\n", end).encode()}
    alone = read_ies(with_tilt(data, beside.get), IES, Report())
    assert alone.candela.tolist() == read_ies(data, IES, Report(), beside.get).candela.tolist()
    for same in (data, ies_text().encode(), with_tilt(data, beside.get), b"EULUMDAT"):
        assert with_tilt(same, {}.get) == same


def test_the_kind_of_a_file_by_its_tilt_line() -> None:
    assert is_ies(b"IESNA91\r\nTILT=NONE\r\n")
    assert is_ies(b"free text\r tilt = lamp.tlt")
    assert not is_ies(b"Maker TILT=NONE\n1\n4\n")
