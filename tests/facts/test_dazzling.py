"""The lamps that a frame passes on: the most dazzling, others together where they are near."""

from __future__ import annotations

import math

import numpy as np

from hdrusd.eye.observer import Observer
from hdrusd.glare.dazzling import ALONE, MOST_LAMPS, MOST_PIXELS, most_dazzling
from hdrusd.glare.model import MODELS
from hdrusd.glare.veil import lamp_veil


def lamps(across: np.ndarray, up: np.ndarray, lux: np.ndarray) -> np.ndarray:
    """Rows at angles in degrees."""
    a, b = np.radians(across), np.radians(up)
    way = np.stack([np.sin(a) * np.cos(b), np.sin(b), -np.cos(a) * np.cos(b)], axis=1)
    return np.concatenate([way, np.repeat(lux[:, None], 3, axis=1)], axis=1)


def test_few_stay_as_they_are() -> None:
    random = np.random.default_rng(1)
    rows = lamps(*random.uniform(-40.0, 40.0, (2, MOST_LAMPS)), random.uniform(0.0, 2.0, 128))
    got = most_dazzling(rows)
    np.testing.assert_array_equal(got.rows, rows.astype(np.float32))
    assert got[1:] == (0, 0.0, 0)
    assert most_dazzling(np.zeros((0, 6))).rows.shape == (0, 6)


def test_a_town_far_away_keeps_its_light_and_its_veil() -> None:
    """2000 lamps of 12 by 2 degrees; five degrees from them the veil is the same within 1 %."""
    random = np.random.default_rng(2)
    across, up = random.uniform(-6.0, 6.0, 2000), random.uniform(1.0, 3.0, 2000)
    rows = lamps(across, up, random.lognormal(-9.0, 1.0, 2000))
    got = most_dazzling(rows)
    assert len(got.rows) <= MOST_LAMPS
    assert got.merged == 2000 - ALONE
    np.testing.assert_allclose(got.rows[:, 3:].sum(axis=0), rows[:, 3:].sum(axis=0), rtol=1e-6)
    assert got.lost < 1e-6
    np.testing.assert_allclose(np.linalg.norm(got.rows[:, :3], axis=1), 1.0, atol=1e-6)
    rays = lamps(*random.uniform(-20.0, -5.0, (2, 50)), np.ones(50))[:, :3]
    veils = [lamp_veil(r, rays, MODELS["cie135"], Observer(), 0.05) for r in (got.rows, rows)]
    np.testing.assert_allclose(*veils, rtol=0.01)


def test_what_is_too_much_all_over_is_told() -> None:
    """400 alike in a square of 80 degrees: cells hold one each; nothing stands where no lamp is."""
    x, y = (v.ravel() * 4.0 for v in np.mgrid[-10:10, -10:10])
    rows = lamps(x, y, np.ones(400))
    got = most_dazzling(rows)
    assert len(got.rows) == MOST_LAMPS
    assert math.isclose(got.lost, 1.0 - MOST_LAMPS / 400.0)
    apart = np.abs(got.rows[:, None, :3] - rows[None, :, :3]).max(axis=2).min(axis=1)
    assert apart.max() < 1e-6


def test_pixels_that_show_lamps_go_with_them() -> None:
    """Of 400 lamps that are too many, those that are left out veil by their pixels as before."""
    x, y = (v.ravel() * 4.0 for v in np.mgrid[-10:10, -10:10])
    rows = lamps(x, y, np.ones(400))
    pixels, owner = lamps(x, y, -np.ones(400)), np.arange(400)
    got = most_dazzling(rows, pixels, owner)
    lit, shown = got.rows[:MOST_LAMPS], got.rows[MOST_LAMPS:]
    assert {tuple(row) for row in shown[:, :3]} == {tuple(row) for row in lit[:, :3]}
    assert got.pixels == 0
    # A pixel of no lamp, and more pixels than there is room for.
    few = most_dazzling(rows[:1], np.tile(pixels[:1], (600, 1)), np.full(600, -1))
    assert len(few.rows) == 1 + MOST_PIXELS
    assert few.pixels == 600 - MOST_PIXELS
