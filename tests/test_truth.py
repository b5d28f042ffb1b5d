"""The shared truth set: every case that this version supports, by the set's own checker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from truth.cases import blinn_phong_session, check, read_cases, render_case

from hdrusd.report import Report


@pytest.fixture
def truth(testdata: Path) -> Path:
    folder = testdata / "truth"
    if not (folder / "expected.json").is_file():
        pytest.skip("the test data has no truth set")
    return folder


def test_every_supported_case_passes(gl: Any, truth: Path, tmp_path: Path) -> None:
    cases = [case for case in read_cases(truth) if not case.unsupported]
    assert cases
    for case in cases:
        render_case(gl, case, tmp_path, Report())
    for variant in {case.variant for case in cases}:
        group = [case for case in cases if case.variant == variant]
        good, text = check(truth, tmp_path, group, variant)
        assert good, text


def test_only_photometric_files_are_missing_of_the_core(truth: Path) -> None:
    missing = {case.unsupported for case in read_cases(truth) if case.core and case.unsupported}
    assert missing <= {"photometric files are not read"}


def test_blinn_phong_by_its_own_numbers(gl: Any, truth: Path, tmp_path: Path) -> None:
    """The case's specular colour and exponent in our attributes, over the plain stage."""
    found = [case for case in read_cases(truth) if case.id == "blinn_phong"]
    if not found:
        pytest.skip("the truth set has no such case")
    (case,) = found
    render_case(gl, case, tmp_path, Report(), blinn_phong_session(case, tmp_path))
    good, text = check(truth, tmp_path, [case], None)
    assert good, text
