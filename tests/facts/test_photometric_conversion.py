"""What is written is read as it was, and both formats shine alike in every direction."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from photometric_files import GAMMA, IES, LDT, QUADRANT, ies_text, ldt_text
from test_eulumdat import CASES
from test_photometric_hostile import SEEDS, WORDS

from hdrusd.errors import InputError
from hdrusd.photometry.conversion import to_eulumdat, to_ies
from hdrusd.photometry.eulumdat import EulumdatFile, LampSet, parse_eulumdat, write_eulumdat
from hdrusd.photometry.ies import IesFile, Tilt, is_ies, parse_ies, write_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.report import Report

Document = IesFile | EulumdatFile

#: Half of the seventh digit, twice: cd/klm and lumens are rounded.
SEVEN = 1e-6


def parse(data: bytes, report: Report | None = None) -> Document:
    report = Report() if report is None else report
    return parse_ies(data, IES, report) if is_ies(data) else parse_eulumdat(data, LDT, report)


def write(file: Document) -> bytes:
    return write_ies(file) if isinstance(file, IesFile) else write_eulumdat(file)


def said(value: Any) -> Any:
    """A document as plain values, without where in a file they stand."""
    if isinstance(value, Document | Tilt):
        return [said(getattr(value, f.name)) for f in fields(value) if f.name not in ("at", "head")]
    return value.tolist() if isinstance(value, np.ndarray) else value


def lamp_of(file: Document) -> Luminaire:
    return file.luminaire(IES if isinstance(file, IesFile) else LDT, Report())


def shines_alike(one: Document, other: Document) -> None:
    """At all nodes of both, and in lumens."""
    a, b = lamp_of(one), lamp_of(other)
    peak = float(a.candela.max())
    for source in (a, b):
        planes = np.repeat(source.planes, len(source.angles)) % 360.0
        gamma = np.tile(source.angles, len(source.planes))
        first, second = a.value(planes, gamma), b.value(planes, gamma)
        assert np.abs(first - second).max() <= SEVEN * peak
    assert b.flux() == pytest.approx(a.flux(), rel=2 * SEVEN)  # 1 lm of 500,000


WORDS_OF_FILES = st.text(
    st.characters(min_codepoint=0x21, max_codepoint=0x2FFF, exclude_categories=["C", "Z"]),
    max_size=30,
).filter(lambda text: "[" not in text and "]" not in text)
SIZES = st.floats(-3.0, 3.0)
POSITIVE = st.floats(1e-3, 1e6)
CANDELA = st.floats(0.0, 1e6)


@st.composite
def planes_and_angles(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    ends = draw(st.sampled_from([(0, 90), (0, 180), (90, 270), (0, 360)]))
    inner = draw(st.sets(st.integers(ends[0] * 2 + 1, ends[1] * 2 - 1), max_size=6))
    one = draw(st.booleans())
    planes = [0.0] if one else sorted([*map(float, ends), *(half / 2 for half in inner)])
    angles = sorted(half / 4 for half in draw(st.sets(st.integers(0, 720), min_size=2, max_size=7)))
    return planes, angles


@st.composite
def ies_files(draw: st.DrawFn) -> IesFile:
    planes, angles = draw(planes_and_angles())
    count = len(planes) * len(angles)
    candela = draw(st.lists(CANDELA, min_size=count, max_size=count))
    if planes[-1] == 360.0:  # which is plane 0 again
        candela[-len(angles) :] = candela[: len(angles)]
    keys = st.sampled_from(["TEST", "MANUFAC", "LUMINAIRE", "OWN", "OTHER"])
    tilt = Tilt(1.0, np.array([0.0, 90.0]), np.array([draw(st.floats(0.5, 1.0)), 1.0]))
    return IesFile(
        edition=draw(st.sampled_from([1986, 1991, 1995, 2002, 2019])),
        keywords=draw(st.dictionaries(keys, WORDS_OF_FILES)),
        tilt=draw(st.sampled_from([None, tilt])),
        lamps=float(draw(st.integers(1, 4))),
        lumens=draw(st.one_of(st.just(-1.0), st.floats(100.0, 1e5))),
        multiplier=draw(st.floats(1e-3, 1e3)),
        type="C",
        feet=draw(st.booleans()),
        size=(draw(SIZES), draw(SIZES), draw(SIZES)),
        ballast=draw(st.floats(0.1, 1.5)),
        companion=draw(st.floats(0.5, 1.5)),
        watts=draw(POSITIVE),
        angles=np.array(angles),
        planes=np.array(planes),
        candela=np.array(candela).reshape(len(planes), len(angles)),
        head="",
        at=lambda part, index: IES,
    )


@given(ies_files())
def test_an_ies_file_is_read_as_it_was_written(file: IesFile) -> None:
    assert said(parse_ies(write_ies(file), IES, Report())) == said(file)


@given(ies_files())
def test_an_ies_file_shines_alike_as_eulumdat_and_back(file: IesFile) -> None:
    there = to_eulumdat(file, IES, Report())
    again = parse_eulumdat(write_eulumdat(there), LDT, Report())
    assert said(again) == said(there)
    shines_alike(file, again)
    back = to_ies(again, LDT, Report())
    assert said(parse_ies(write_ies(back), IES, Report())) == said(back)
    shines_alike(file, back)
    shines_alike(file, to_ies(file, IES, Report()))


@given(
    symmetry=st.sampled_from(sorted(CASES)),
    values=st.lists(st.floats(0.0, 1e4), min_size=40, max_size=40),
    lumens=st.floats(1.0, 1e6),
    texts=st.lists(WORDS_OF_FILES, min_size=5, max_size=5),
    sizes=st.lists(st.floats(0.0, 3000.0), min_size=9, max_size=9),
    count=st.integers(1, 3),
)
def test_a_eulumdat_file_is_read_as_it_was_written(
    symmetry: int,
    values: list[float],
    lumens: float,
    texts: list[str],
    sizes: list[float],
    count: int,
) -> None:
    stored = len(CASES[symmetry][0])
    rows = np.array(values[: stored * len(GAMMA)]).reshape(stored, len(GAMMA))
    file = parse_eulumdat(ldt_text(rows, symmetry=symmetry).encode(), LDT, Report())
    company, name, number, test, lamp = texts
    file = replace(
        file,
        company=company,
        name=name,
        number=number,
        test=test,
        housing=tuple(sizes[:3]),
        opening=tuple(sizes[3:]),
        lamps=(LampSet(float(count), lamp, lumens, "3000 K", "80", 40.0),),
    )
    again = parse_eulumdat(write_eulumdat(file), LDT, Report())
    assert said(again) == said(file)
    there = parse_ies(write_ies(to_ies(file, LDT, Report())), IES, Report())
    shines_alike(file, there)
    back = to_eulumdat(there, IES, Report())
    assert back.symmetry == file.symmetry
    assert back.lamps[0].lumens == pytest.approx(lumens, rel=1e-12)
    shines_alike(file, back)


@settings(max_examples=60)
@given(
    st.sampled_from(SEEDS),
    st.lists(st.tuples(st.integers(0, 100), st.sampled_from(WORDS)), max_size=4),
)
def test_what_can_be_read_can_be_converted(seed: bytes, changes: list[tuple[int, bytes]]) -> None:
    breaks = b"\r\n" if b"\r\n" in seed else b" "
    parts = seed.replace(b"\n", b" \n ").split(b" ") if breaks == b" " else seed.split(breaks)
    for index, word in changes:
        parts[index % len(parts)] = word
    converts(breaks.join(parts))


@given(st.binary(max_size=300))
def test_any_bytes(data: bytes) -> None:
    converts(data)
    converts(b"TILT=NONE\n" + data)


def converts(data: bytes) -> None:
    """Only InputError; and what comes out reads and shines as what went in."""
    try:
        file = parse(data)
        lamp_of(file)
        made = [convert(file, LDT, Report()) for convert in (to_ies, to_eulumdat)]
    except InputError:
        return
    for document in made:
        shines_alike(file, parse(write(document)))


def codes(convert: Any, text: str) -> set[str]:
    report = Report()
    convert(parse(text.encode("utf-8"), report), IES, report)
    return report.codes()


STATED = "[TEST] 1\n[TESTLAB] us\n[ISSUEDATE] today\n[MANUFAC] we"


def test_what_has_no_place_is_a_finding() -> None:
    plain = ies_text(keywords=STATED)
    assert codes(to_ies, plain) == set()
    assert codes(to_ies, ies_text()) == {"photometric-filled"}
    assert codes(to_eulumdat, plain) == {"photometric-filled", "photometric-lost"}  # TESTLAB
    fits = plain.replace("[TESTLAB] us\n", "")
    assert codes(to_eulumdat, fits) == {"photometric-filled"}
    for lost in (
        fits.replace("today", "today " * 20),
        fits.replace("1 1 100", "1 1.1 100").replace("IESNA:LM-63-2002", "IES:LM-63-2019"),
        fits.replace("2 0 0 0", "2 -0.1 0.5 -0.1"),
    ):
        assert codes(to_eulumdat, lost) == {"photometric-filled", "photometric-lost"}
    assert "photometric-lost" in codes(to_ies, ldt_text())  # direct ratios, housing


def test_text_without_a_keyword_is_carried_or_a_finding() -> None:
    free = "Free text of a lamp\nanother line " + 300 * "x"
    report = Report()
    old = parse(ies_text(label="", keywords=f"{free}\n[OTHER] said").encode())
    assert isinstance(old, IesFile)
    made = to_ies(old, IES, report)
    lines = made.keywords["OTHER"].split("\n")
    assert lines[:2] == ["said", "Free text of a lamp"]
    assert "".join(lines[2:]) == "another line " + 300 * "x"
    assert max(map(len, write(made).splitlines())) <= 256
    assert [f.code for f in report] == ["photometric-filled"]
    assert parse(write(made)).keywords == made.keywords  # type: ignore[union-attr]
    found = Report()
    to_eulumdat(old, IES, found)
    assert "text without a keyword: no place in the new file" in {f.text for f in found}


@pytest.mark.parametrize("start", [-180.0, 7.5, 15.0])
def test_a_turn_is_written_from_0_to_360(start: float) -> None:
    planes = start + np.arange(0.0, 360.0, 15.0)
    rows: npt.NDArray[np.float64] = 100.0 + np.outer(planes % 360.0, [1.0, 2.0])
    file = parse(ies_text(rows, planes=planes.tolist(), angles=(0, 90)).encode())
    for convert in (to_ies, to_eulumdat):
        made = convert(file, IES, Report())
        assert made.planes[0] == 0.0
        assert made.planes[-1] == (360.0 if convert is to_ies else (planes % 360.0).max())
        shines_alike(file, parse(write(made)))


def test_types_a_and_b_are_no_eulumdat() -> None:
    file = parse(ies_text([1, 2, 3, 4], planes=(-5, 5), angles=(-3, 3), type="B").encode())
    with pytest.raises(InputError, match="photometry of type B; EULUMDAT has type C alone"):
        to_eulumdat(file, IES, Report())
    assert to_ies(file, IES, Report()).type == "B"


def test_length_lies_along_c_0_in_lm_63_and_along_c_90_in_eulumdat() -> None:
    made = to_eulumdat(parse(ies_text(size=(0.3, 1.2, 0.05)).encode()), IES, Report())
    assert made.opening == (300.0, 1200.0, 50.0, 50.0, 50.0, 50.0)
    assert lamp_of(made).opening == lamp_of(parse(ies_text(size=(0.3, 1.2, 0.05)).encode())).opening
    round_one = to_eulumdat(parse(ies_text(size=(-0.2, -0.2, 0)).encode()), IES, Report())
    assert round_one.opening[:2] == (200.0, 0.0)
    back = to_ies(round_one, LDT, Report())
    assert back.size == (-0.2, -0.2, 0.0)


def test_what_eulumdat_says_of_an_absolute_file() -> None:
    made = to_eulumdat(parse(ies_text().encode()), IES, Report())
    assert (made.lamps[0].count, made.output_ratio, made.downward) == (-1.0, 100.0, 100.0)
    assert made.lamps[0].lumens == pytest.approx(1127.302726, rel=3e-6)
    assert made.symmetry == 4
    assert made.planes.tolist() == list(range(0, 360, 45))
    relative = to_eulumdat(parse(ies_text(lumens=2000.0).encode()), IES, Report())
    assert relative.lamps[0].count == 1.0
    assert relative.candela.tolist() == (np.array(QUADRANT) / 2).tolist()
    assert relative.output_ratio == 56.37


def test_lm_63_is_written_as_of_2002() -> None:
    old = ies_text(label="IESNA91", photometric=0.8, lumens=900.0)
    data = write(to_ies(parse(old.encode()), IES, Report()))
    assert data.startswith(b"IESNA:LM-63-2002\r\n")
    assert b"\r\n1 900 0.8 5 3 1 2 0 0 0\r\n1 1 100\r\n" in data
    assert lamp_of(parse(data)).value(0, 0) == pytest.approx(320.0)


@pytest.mark.parametrize("end", [270.0, 315.0, 360.0])
def test_a_whole_turn_ends_at_360(end: float) -> None:
    planes = np.arange(0.0, end + 1.0, 45.0 if end != 270.0 else 90.0)
    rows: npt.NDArray[np.float64] = 100.0 + np.outer(planes % 360.0, [1.0, 2.0])
    file = parse(ies_text(rows, planes=planes.tolist(), angles=(0, 90)).encode())
    made = to_ies(file, IES, Report())
    assert made.planes[-1] == 360.0
    assert made.candela[-1].tolist() == made.candela[0].tolist()
    shines_alike(file, made)


STREET = sorted((Path(__file__).parents[2] / "samples/street/luminaires").glob("*.[il][ed][st]"))


@pytest.mark.parametrize("path", STREET, ids=lambda path: path.name)
def test_the_street_luminaires_both_ways(path: Path) -> None:
    file = parse(path.read_bytes())
    assert said(parse(write(file))) == said(file)
    for convert in (to_ies, to_eulumdat):
        shines_alike(file, parse(write(convert(file, LDT, Report()))))


def test_samples_are_there() -> None:
    assert len(STREET) == 3


def test_the_truth_files_both_ways(testdata: Path) -> None:
    files = sorted((testdata / "truth" / "photometry").iterdir())
    assert len(files) >= 5
    for path in files:
        file = parse(path.read_bytes())
        assert said(parse(write(file))) == said(file)
        for convert in (to_ies, to_eulumdat):
            shines_alike(file, parse(write(convert(file, LDT, Report()))))
