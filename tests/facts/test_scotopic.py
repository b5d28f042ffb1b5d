"""Scotopic luminance from RGB, the ramp of rods and cones, the blue of the night."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import luminance
from hdrusd.eye.scotopic import (
    CONE_LIMIT,
    NIGHT_BLUE,
    NIGHT_SUM,
    RGB_TO_XYZ,
    ROD_LIMIT,
    WHITE_RATIO,
    jensen_night,
    night_colour,
    scotopic,
    scotopic_larson,
    ward_scotopic,
    white_relative,
)

#: Scotopic luminance of D65 white, XYZ (0.9505, 1, 1.0890), by the form of Larson 1997.
LARSON_WHITE = 1.33 * (1.0 + 2.0890 / 0.9505) - 1.68

WHITE = np.ones(3)
COLORS = st.lists(st.floats(1e-9, 1e9), min_size=3, max_size=3).map(np.array)


def to_xyz(rgb: np.ndarray) -> np.ndarray:
    return np.asarray(rgb @ RGB_TO_XYZ.T)


def to_rgb(xyz: list[float]) -> np.ndarray:
    return np.linalg.solve(RGB_TO_XYZ, np.array(xyz))


def test_white_has_the_ratio_of_the_fit() -> None:
    assert pytest.approx(2.1954066, rel=1e-12) == WHITE_RATIO
    assert scotopic(WHITE) == pytest.approx(2.1954066, rel=1e-12)
    assert scotopic([1.0, 0.5, 0.2]) == pytest.approx(0.81309668, rel=1e-8)
    assert white_relative(scotopic(3.0 * WHITE)) == pytest.approx(3.0, rel=1e-12)


def test_the_form_of_larson() -> None:
    assert pytest.approx(2.5730615, rel=1e-7) == LARSON_WHITE
    assert scotopic_larson(WHITE) == pytest.approx(LARSON_WHITE, rel=1e-12)
    # Equal energy white: 1.33 x 3 - 1.68.
    assert scotopic_larson(to_rgb([1, 1, 1])) == pytest.approx(2.31, rel=1e-12)
    assert scotopic_larson(np.zeros(3)) == 0.0


@given(COLORS)
def test_both_forms_are_positive(rgb: np.ndarray) -> None:
    assert scotopic(rgb) > 0.0
    assert scotopic_larson(rgb) > 0.0


def test_the_ramp_of_ward() -> None:
    rgb = np.array([1.0, 0.5, 0.2])
    grey = white_relative(scotopic(rgb))
    k = (0.58464 - ROD_LIMIT) / (CONE_LIMIT - ROD_LIMIT)
    assert k == pytest.approx(0.103131601, rel=1e-8)
    wanted = [0.435298188, 0.383732388, 0.352792907]
    assert ward_scotopic(rgb, grey) == pytest.approx(wanted, rel=1e-8)
    # Above 5.62 cd/m2 cones alone, below 0.00562 rods alone.
    assert ward_scotopic(10 * rgb, grey) == pytest.approx(10 * rgb, rel=1e-12)
    assert ward_scotopic(0.009 * rgb, grey) == pytest.approx(np.full(3, grey), rel=1e-12)


@pytest.mark.parametrize(
    ("xyz", "wanted"),
    [
        ([0.0095, 0.01, 0.0109], [0.01001142, 0.01001142, 0.02002284]),
        ([0.2, 0.2, 0.1], [0.16397449, 0.16397449, 0.17644957]),
        ([5.0, 5.0, 5.0], [5.0, 5.0, 5.0]),
    ],
)
def test_the_blue_of_jensen(xyz: list[float], wanted: list[float]) -> None:
    # Luminances by the form of Larson, as in the paper.
    rgb = to_rgb(xyz)
    found = jensen_night(rgb, scotopic_larson(rgb) / LARSON_WHITE)
    assert to_xyz(found) == pytest.approx(wanted, rel=1e-6)


def test_the_night_is_of_one_hue() -> None:
    assert to_xyz(NIGHT_BLUE) == pytest.approx([1.0, 1.0, NIGHT_SUM - 2.0], rel=1e-12)
    dark = jensen_night(np.array([[0.004, 0.0, 0.0], [0.0, 0.001, 0.02], [0, 0, 0]]), 2e-3)
    assert dark == pytest.approx(np.tile(2e-3 * NIGHT_BLUE, (3, 1)), rel=1e-12)


def test_both_are_switched_apart() -> None:
    rgb = np.array([0.3, 0.2, 0.05])
    s_n = white_relative(scotopic(rgb))
    ward, jensen = ward_scotopic(rgb, s_n), jensen_night(rgb, s_n)
    assert night_colour(rgb, s_n, 0.0, 0.0) == pytest.approx(rgb, rel=1e-12)
    assert night_colour(rgb, s_n, 1.0, 0.0) == pytest.approx(ward, rel=1e-12)
    assert night_colour(rgb, s_n, 0.0, 1.0) == pytest.approx(jensen, rel=1e-12)
    assert night_colour(rgb, s_n) == pytest.approx(0.7 * ward + 0.3 * jensen, rel=1e-12)


@given(COLORS)
def test_a_night_has_no_negative_colours(rgb: np.ndarray) -> None:
    found = night_colour(rgb, white_relative(scotopic(rgb)))
    assert np.isfinite(found).all()
    assert (found >= 0.0).all()


def test_white_keeps_its_luminance() -> None:
    # Where S_n is Y, neither changes the luminance, in the dark, at dusk or by day.
    for y in np.logspace(-5, 3, 33):
        found = night_colour(y * WHITE, y)
        assert luminance(found) == pytest.approx(y, rel=1e-12)


def test_vectors(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    glare = json.loads(text)["5_glare"]
    inputs = [(0.0095, 0.01, 0.0109), (0.2, 0.2, 0.1), (5, 5, 5)]
    key = "jensen_night XYZ=(.0095,.01,.0109),(0.2,0.2,0.1),(5,5,5): [s, XYZ]"
    for xyz, (_, wanted) in zip(inputs, glare[key], strict=True):
        rgb = to_rgb(list(xyz))
        found = to_xyz(jensen_night(rgb, scotopic_larson(rgb) / LARSON_WHITE))
        assert found == pytest.approx(wanted, rel=1e-6)
    rgb = np.array([1.0, 0.5, 0.2])
    _, wanted = glare["ward_scotopic rgb=(1,.5,.2): [k, rgb]"]
    assert ward_scotopic(rgb, white_relative(scotopic(rgb))) == pytest.approx(wanted, rel=1e-9)
    found = scotopic([[1, 1, 1], [1, 0.5, 0.2]])
    assert found == pytest.approx(glare["scotopic of rgb=(1,1,1),(1,.5,.2)"], rel=1e-9)
