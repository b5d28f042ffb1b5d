"""The shared truth set: every case that this version supports, by the set's own checker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from truth.cases import blinn_phong_session, check, read_cases, render_case

from hdrusd.report import Report

#: The cases of the shared set that this version supports.
SUPPORTED = {
    "ambient_plus_point",
    "area_sphere",
    "blinn_phong",
    "emissive_quads_cm",
    "headlights_anim",
    "instanced_lamps",
    "point_plane",
    "point_tilted_cm",
    "room_flux",
    "shadow_box",
    "spot_soft_cm",
    "sun_cards",
    "texture_lambert",
    "two_coloured_lights",
}


@pytest.fixture
def truth(testdata: Path) -> Path:
    folder = testdata / "truth"
    if not (folder / "expected.json").is_file():
        pytest.skip("the test data has no truth set")
    return folder


def test_every_supported_case_passes(gl: Any, truth: Path, tmp_path: Path) -> None:
    cases = [case for case in read_cases(truth) if not case.unsupported]
    assert {case.id for case in cases} >= SUPPORTED
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
    (case,) = [case for case in read_cases(truth) if case.id == "blinn_phong"]
    render_case(gl, case, tmp_path, Report(), blinn_phong_session(case, tmp_path))
    good, text = check(truth, tmp_path, [case], None)
    assert good, text
