"""Findings: said once, counted beyond a limit, one line each."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hdrusd.errors import InputError, SourceRef
from hdrusd.report import LISTED, Kind, Report

FILE = Path("some/street.obj")


def report_of(count: int, code: str = "face", file: Path = FILE) -> Report:
    report = Report()
    for line in range(count):
        report.add(Kind.DROPPED, code, SourceRef(file, line), "wall", "a bad face")
    return report


def test_a_new_report_is_empty() -> None:
    report = Report()
    assert len(report) == 0
    assert list(report) == []
    assert report.codes() == set()
    assert report.summary() == "no findings"


def test_the_same_finding_is_said_once() -> None:
    report = report_of(1)
    report.add(Kind.DROPPED, "face", SourceRef(FILE, 0), "wall", "a bad face")
    assert len(report) == 1


@pytest.mark.parametrize(
    "change",
    [
        {"kind": Kind.INVALID},
        {"code": "line"},
        {"source": SourceRef(FILE, 7)},
        {"source": SourceRef(Path("else/street.obj"), 0)},
        {"thing": "floor"},
        {"text": "a good face"},
    ],
)
def test_findings_that_differ_in_anything_are_two(change: dict[str, object]) -> None:
    report = report_of(1)
    first = {
        "kind": Kind.DROPPED,
        "code": "face",
        "source": SourceRef(FILE, 0),
        "thing": "wall",
        "text": "a bad face",
    }
    report.add(**(first | change))  # type: ignore[arg-type]
    assert len(report) == len(list(report)) == 2


def test_findings_keep_their_order() -> None:
    report = Report()
    for name in ("c", "a", "b"):
        report.add(Kind.ASSUMED, "unit", SourceRef(FILE), name, "metres")
    assert [finding.thing for finding in report] == ["c", "a", "b"]


def test_up_to_the_limit_all_are_listed() -> None:
    findings = list(report_of(LISTED))
    assert [finding.source.place for finding in findings] == list(range(LISTED))


def test_beyond_the_limit_one_finding_says_how_many_more() -> None:
    report = report_of(LISTED + 1000)
    findings = list(report)
    assert len(findings) == LISTED + 1
    assert findings[-1].text.startswith("1000 more face;")
    assert (findings[-1].kind, findings[-1].code) == (Kind.DROPPED, "face")
    assert findings[-1].source == SourceRef(FILE)


def test_every_finding_counts_listed_or_not() -> None:
    report = report_of(LISTED + 1000)
    report.add(Kind.MISSING, "file-missing", SourceRef(FILE), "", "a.png: not found")
    assert len(report) == LISTED + 1001
    assert report.summary() == f"{LISTED + 1001} findings: {LISTED + 1000} dropped, 1 missing"
    assert report.codes() == {"face", "file-missing"}


def test_the_limit_is_for_each_code_and_each_file() -> None:
    report = Report()
    for line in range(LISTED):
        for code in ("face", "line"):
            for file in (FILE, Path("other.mtl")):
                report.add(Kind.DROPPED, code, SourceRef(file, line), "", "bad")
    assert len(list(report)) == len(report) == 4 * LISTED


def test_json_lists_what_is_listed_and_counts_the_rest() -> None:
    document = json.loads(json.dumps(report_of(LISTED + 3).as_dict()))
    assert document["format"] == "hdrusd-report/1"
    assert document["summary"] == f"{LISTED + 3} findings: {LISTED + 3} dropped"
    assert len(document["findings"]) == LISTED + 1
    assert document["findings"][4] == {
        "kind": "dropped",
        "code": "face",
        "file": str(FILE),
        "place": 4,
        "thing": "wall",
        "text": "a bad face",
    }


def test_names_from_a_file_cannot_steer_the_terminal() -> None:
    report = Report()
    report.add(Kind.DROPPED, "node", SourceRef(FILE), "a\nb\x1b[2Jc", "no\thome\u2028here")
    (line,) = map(str, report)
    assert line.isprintable()
    assert line == "street.obj: a b [2Jc: no home here"


def test_long_names_are_shortened() -> None:
    report = Report()
    report.add(Kind.DROPPED, "node", SourceRef(FILE), "n" * 200_000, "dropped")
    (line,) = map(str, report)
    assert len(line) < 1000
    assert "200000 characters" in line


def test_an_input_error_is_one_line() -> None:
    error = InputError(SourceRef(FILE, 3), "node 'a\nb\x1b[2J': a child of itself")
    assert str(error) == "street.obj:3: node 'a b [2J': a child of itself"
