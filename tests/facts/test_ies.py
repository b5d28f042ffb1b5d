"""IES LM-63: what the numbers of a file mean, edition by edition."""

from __future__ import annotations

import re

import numpy as np
import pytest
from photometric_files import GAMMA, IES, QUADRANT, ies, ies_text

from hdrusd.errors import InputError
from hdrusd.photometry.ies import is_ies, parse_ies, read_ies, with_tilt, write_ies
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


@pytest.mark.parametrize("before", ["\ufeff", "\n", " \r\n\r\n", "\ufeff\n"])
@pytest.mark.parametrize("label", ["IESNA:LM-63-1995", "IESNA:LM-63-2002", "IES:LM-63-2019"])
def test_the_label_is_the_first_line_that_says_something(before: str, label: str) -> None:
    report = Report()
    text = before + ies_text(label=label, ballast=0.9, photometric=0.8)
    file = parse_ies(text.encode("utf-8"), IES, report)
    assert file.edition == int(f"20{label[-2:]}") - 100 * label.endswith("95")
    assert file.factor == pytest.approx(0.9, rel=1e-15)
    assert report.codes() == set()


def test_all_lamps_count_and_absolute_photometry_has_none() -> None:
    for lamps, lumens, wanted in ((2, 3000.0, 6000.0), (1, 3000.0, 3000.0), (3, -1.0, None)):
        assert ies(ies_text(lamps=lamps, lumens=lumens)).lumens == wanted
    for lamps, lumens in ((0, 3000.0), (-1, -1.0), (-2, 3000.0), (2, 0.0)):
        assert ies(ies_text(lamps=lamps, lumens=lumens)).lumens is None


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_letters_of_either_encoding(encoding: str) -> None:
    data = ies_text(keywords="[MANUFAC] Straßenlicht München").encode(encoding)
    file = parse_ies(data, IES, Report())
    assert file.keywords == {"MANUFAC": "Straßenlicht München"}
    again = write_ies(file)
    assert "Straßenlicht München".encode("latin-1") in again
    assert parse_ies(again, IES, Report()).keywords == file.keywords


def test_an_ellipsis_of_windows_ends_no_line() -> None:
    data = ies_text(keywords="[TEST] one\x85 two").encode("latin-1")
    assert parse_ies(data, IES, Report()).keywords == {"TEST": "one\x85 two"}


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


def with_commas(text: str) -> str:
    """All numbers below TILT=NONE with a decimal comma, as a locale writes them."""
    head, body = text.split("TILT=NONE\n")
    return f"{head}TILT=NONE\n{re.sub(r'[.](?=[0-9])', ',', body)}"


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        (ies_text(), 6, "22,5"),  # angles
        (ies_text(np.array(QUADRANT) + 0.5, angles=(0, 20, 40, 60, 90)), 8, "400,5"),
        (ies_text(ballast=0.9), 5, "0,9"),
        (ies_text(size=(0.5, 0.5, 0)), 4, "0,5"),
        (ies_text(multiplier=1.5), 4, "1,5"),
        (ies_text(multiplier=0.5), 4, "0,5"),
        (ies_text(lumens=999.5), 4, "999,5"),
    ],
)
def test_decimal_commas_are_refused(text: str, line: int, word: str) -> None:
    ies(text)
    with pytest.raises(InputError) as error:
        ies(with_commas(text))
    problem = str(error.value)
    assert problem.startswith(f"lamp.ies:{line}: {word!r}") or f"{word!r} in line {line}" in problem
    assert problem.endswith("decimal commas? want points")


@pytest.mark.parametrize("between", [",", ", ", " ,", ",\n"])
def test_commas_between_numbers_are_separators(between: str) -> None:
    head, body = ies_text().split("TILT=NONE\n")
    report = Report()
    lamp = ies(f"{head}TILT=NONE\n{between.join(body.split())}\n", report)
    assert lamp.candela.tolist() == [list(row) for row in QUADRANT]
    assert report.codes() == set()


def test_numbers_after_commas_that_stand_between_numbers_are_left() -> None:
    """``0,45,90`` is no decimal number, so what follows was not made by commas."""
    head, body = ies_text().split("TILT=NONE\n")
    report = Report()
    lamp = ies(f"{head}TILT=NONE\n{','.join(body.split())}\n1 2 3\n", report)
    assert lamp.candela.tolist() == [list(row) for row in QUADRANT]
    assert report.codes() == {"profile-trailing"}


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


@pytest.mark.parametrize("rest", ["", "\n", "\n\x1a", "\n; comment of the laboratory\n", " "])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_that_stands_alone_reads_as_with_its_tilt_file(end: str, rest: str) -> None:
    data = ies_text(tilt="TILT=lamp.tlt").replace("\n", end).encode()
    beside = {"lamp.tlt": (TILTED + rest).replace("\n", end).encode()}
    report = Report()
    file = parse_ies(data, IES, report, beside.get)
    assert ("profile-trailing" in report.codes()) == ("comment" in rest)
    alone = parse_ies(with_tilt(data, file), IES, Report())
    assert alone.tilt is not None
    assert alone.tilt.angles.tolist() == [0, 45, 90]
    assert alone.tilt.factors.tolist() == [0.9, 0.95, 1.2]
    assert alone.candela.tolist() == [list(row) for row in QUADRANT]
    assert alone.factor == pytest.approx(0.9, rel=1e-15)


def test_a_file_that_stands_alone_stays_as_it_is() -> None:
    for tilt in ("TILT=NONE", "TILT=gone.tlt", f"TILT=INCLUDE\n{TILTED}"):
        data = ies_text(tilt=tilt).encode()
        assert with_tilt(data, parse_ies(data, IES, Report())) == data


def test_what_is_wrong_with_a_tilt_file_is_said_at_its_line() -> None:
    data = ies_text(tilt="TILT=a.tlt").encode()
    for text, problem in (
        ("1\n3\n0 45 90\n0.9 x 1\n", "lamp.ies:a.tlt:4: tilt factors: no number among them"),
        ("1\n2\n0 90\n0,9 1,0\n", "lamp.ies:a.tlt:4: '0,9', and more numbers than declared"),
    ):
        with pytest.raises(InputError, match=re.escape(problem)):
            parse_ies(data, IES, Report(), {"a.tlt": text.encode()}.get)


def test_the_kind_of_a_file_by_its_tilt_line() -> None:
    assert is_ies(b"IESNA91\r\nTILT=NONE\r\n")
    assert is_ies(b"free text\r tilt = lamp.tlt")
    assert not is_ies(b"Maker TILT=NONE\n1\n4\n")
