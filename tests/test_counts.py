"""docs/counts.md is true: each difference from the manifest stands there, with its finding."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tests.counts import COLUMNS, Count, run_counts

DOCUMENT = (Path(__file__).parents[1] / "docs" / "counts.md").read_text(encoding="utf-8")

#: What tests/counts.py says of a file without counts.
ALL = "all", "-", "refused"


def rows(heading: str) -> list[list[str]]:
    """The cells of the table below a heading."""
    _, _, section = DOCUMENT.partition(f"\n## {heading}\n")
    lines = section.partition("\n## ")[0].splitlines()
    table = [line.strip("|").split("|") for line in lines if line.startswith("|")]
    return [[cell.strip() for cell in cells] for cells in table[2:]]


DIFFERENCES = rows("Each difference")
RULES = {name.strip("`") for name, _ in rows("Why")}


def differences(found: Count) -> list[tuple[str, str, str]]:
    """Column, theirs and ours, as the document writes them."""
    if found.refusal:
        return [ALL]
    return [(column, str(a), str(b)) for column, (a, b) in found.differing.items()]


def test_every_rule_is_explained_and_used() -> None:
    used = {rule for *_, rules in DIFFERENCES for rule in re.split(r",\s*", rules)}
    assert used == RULES
    assert {column for _, column, *_ in DIFFERENCES} <= {*COLUMNS, "all"}
    assert len({(file, column) for file, column, *_ in DIFFERENCES}) == len(DIFFERENCES)


@cache
def run_once(folder: Path) -> list[Count]:
    """The counts of a folder, which take a minute."""
    return run_counts(folder)


@pytest.fixture
def counted(testdata: Path) -> list[Count]:
    """Every file of the manifest."""
    return run_once(testdata / "data")


def test_each_difference_is_listed_and_each_listed_one_occurs(counted: list[Count]) -> None:
    listed = [(file, column, a, b) for file, column, a, b, _, _ in DIFFERENCES]
    found = [(row.name, *difference) for row in counted for difference in differences(row)]
    assert sorted(found) == sorted(listed)


def test_what_is_lost_is_told(counted: list[Count]) -> None:
    codes = {row.name: row.codes for row in counted}
    silent = [
        (file, code) for file, *_, code, _ in DIFFERENCES if code != "-" and code not in codes[file]
    ]
    assert silent == []


def test_the_totals_of_the_document(counted: list[Count]) -> None:
    equal = sum(not differences(row) for row in counted)
    assert f"Of {len(counted)} files {equal} are equal in all columns." in DOCUMENT
