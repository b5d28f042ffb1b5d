"""Pupil diameters of Moon and Spencer 1944 and Watson and Yellott 2012.

The tables were computed outside of this project from the published formulas.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from hdrusd.eye.pupil import moon_spencer, pupil_area, trolands, watson_yellott

LUMINANCE = (1e-4, 0.01, 1.0, 100.0, 1e4)
MOON_SPENCER = (7.6650, 6.8921, 4.9000, 2.9079, 2.1350)
#: 60 x 60 degrees, 30 years, both eyes.
WATSON_YELLOTT = (7.5598, 6.9915, 4.9799, 2.8155, 2.1431)


def test_tables() -> None:
    # Half of the last printed digit.
    np.testing.assert_allclose(moon_spencer(LUMINANCE), MOON_SPENCER, rtol=0, atol=5e-5)
    np.testing.assert_allclose(watson_yellott(LUMINANCE), WATSON_YELLOTT, rtol=0, atol=5e-5)


def test_tables_in_full(testdata: Path) -> None:
    wanted = json.loads(
        next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    )
    table = wanted["2_irawan"]
    got = moon_spencer(table["L"])
    # 1e-12: a dozen operations in float64.
    np.testing.assert_allclose(got, table["pupil moon-spencer mm"], rtol=1e-12)
    got = watson_yellott(table["L"])
    key = "pupil watson-yellott mm (60x60deg, age30)"
    np.testing.assert_allclose(got, table[key], rtol=1e-12)


def test_ends_of_the_range() -> None:
    # 4.9 -+ 3 mm, and at 1 cd/m2 the middle.
    assert moon_spencer(1e-30) == pytest.approx(7.9, abs=1e-9)
    assert moon_spencer(1e30) == pytest.approx(1.9, abs=1e-9)
    assert float(moon_spencer(1.0)) == 4.9
    # At the reference age the formula of Stanley and Davies: 7.75 in the dark, 2 in the light.
    assert watson_yellott(0.0, age=28.58) == pytest.approx(7.75, rel=1e-15)
    assert watson_yellott(1e30, age=28.58) == pytest.approx(2.0, abs=1e-9)


def test_half_way_of_stanley_and_davies() -> None:
    # (L a / 846)^0.41 = 2 halves the range: (7.75 + 2) / 2 mm.
    luminance = 846.0 / 3600.0 * 2.0 ** (1.0 / 0.41)
    assert watson_yellott(luminance, age=28.58) == pytest.approx(4.875, rel=1e-14)


def test_a_wider_field_is_brighter_light() -> None:
    assert watson_yellott(10.0, area=400.0) == pytest.approx(watson_yellott(1.0, area=4000.0))


def test_one_eye_counts_a_tenth() -> None:
    assert watson_yellott(10.0, eyes=1) == pytest.approx(float(watson_yellott(1.0, eyes=2)))


def test_pupils_shrink_with_age_and_with_light() -> None:
    ages = [float(watson_yellott(1.0, age=age)) for age in (20, 40, 60, 80)]
    assert sorted(ages, reverse=True) == ages
    for model in (moon_spencer, watson_yellott):
        assert (np.diff(model(np.geomspace(1e-6, 1e6, 200))) < 0.0).all()


def test_trolands() -> None:
    # By definition: 1 cd/m2 through 1 mm2.
    diameter = 2.0 / math.sqrt(math.pi)
    assert pupil_area(diameter) == pytest.approx(1.0, rel=1e-15)
    assert trolands(7.0, diameter) == pytest.approx(7.0, rel=1e-15)
    assert trolands(1.0, moon_spencer(1.0)) == pytest.approx(18.857409903, rel=1e-10)
