"""Mesopic luminance by CIE 191."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hdrusd.colour import luminance
from hdrusd.eye.mesopic import mesopic, mesopic_layer
from hdrusd.eye.scotopic import scotopic

LUMINANCES = st.floats(1e-6, 1e6)
RATIOS = st.floats(0.0, 30.0)


@pytest.mark.parametrize(
    ("lp", "ls", "lm", "m"),
    [
        (0.5, 1.0, 0.577265876, 0.68744272),
        (0.01, 0.02, 0.0165719997, 0.17333960),
        (3.0, 4.0, 3.03045077, 0.92753451),
    ],
)
def test_published_fixed_points(lp: float, ls: float, lm: float, m: float) -> None:
    assert [float(v) for v in mesopic(lp, ls)] == pytest.approx([lm, m], rel=1e-7)


@example(2.0, 27.0)
@given(LUMINANCES, RATIOS)
def test_the_two_equations_of_the_standard_hold(lp: float, ratio: float) -> None:
    lm, m = (float(v) for v in mesopic(lp, lp * ratio))
    v = 683 / 1699
    assert lm == pytest.approx((m * lp + (1 - m) * lp * ratio * v) / (m + (1 - m) * v), rel=1e-12)
    wanted = min(max(0.767 + 0.3334 * math.log10(max(lm, 1e-30)), 0.0), 1.0)
    # The last step was below 1e-8; what is left is at most that by 1 / (1 - slope), and near
    # m = 0 with little for the rods the slope is almost 1.
    assert m == pytest.approx(wanted, abs=1e-6)


def test_by_day_it_is_photopic_and_in_the_dark_scotopic() -> None:
    assert mesopic(6.0, 12.0)[0] == 6.0
    assert mesopic(1e-4, 2e-4)[0] == pytest.approx(2e-4, rel=1e-12)
    assert [float(v) for v in mesopic(0.0, 0.0)] == [0.0, 0.0]


def test_white_lamps_gain_and_sodium_loses_at_dusk() -> None:
    # At 0.3 cd/m2, S/P of 2.46 (D65) and 0.56 (high-pressure sodium).
    white, sodium = mesopic(0.3, [0.3 * 2.46, 0.3 * 0.56])[0]
    assert white > 0.3 > sodium


def test_a_layer_is_pixel_by_pixel() -> None:
    rng = np.random.default_rng(191)
    rgb = 10.0 ** rng.uniform(-4, 2, (5, 7, 3))
    layer = mesopic_layer(rgb)
    assert layer.shape == (5, 7)
    assert layer.dtype == np.float32
    assert layer == pytest.approx(mesopic(luminance(rgb), scotopic(rgb))[0], rel=2.0**-23)
    told = mesopic_layer(rgb, 0.6 * luminance(rgb))
    assert told == pytest.approx(mesopic(luminance(rgb), 0.6 * luminance(rgb))[0], rel=2.0**-23)
    rgb[0, 0] = np.nan
    rgb[1, 1] = -1.0
    assert mesopic_layer(rgb)[[0, 1], [0, 1]].tolist() == [0.0, 0.0]


def test_vectors(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    wanted = json.loads(text)["5_glare"]["mesopic cie191 (Lp=0.5,Ls=1.0),(0.01,0.02),(3,4)"]
    lm, m = mesopic([0.5, 0.01, 3.0], [1.0, 0.02, 4.0])
    assert np.stack([lm, m], axis=1) == pytest.approx(np.array(wanted), rel=1e-6)
