"""The lamps that a frame passes on: the most dazzling, and the others together."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.eye.observer import Observer
from hdrusd.glare.dazzling import ALONE, MOST_LAMPS, MOST_PIXELS, most_dazzling
from hdrusd.glare.model import MODELS, angle
from hdrusd.glare.veil import kernel, lamp_veil


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
    np.testing.assert_allclose(np.linalg.norm(got.rows[:, :3], axis=1), 1.0, atol=1e-6)
    rays = lamps(*random.uniform(-20.0, -5.0, (2, 50)), np.ones(50))[:, :3]
    veils = [lamp_veil(r, rays, MODELS["cie135"], Observer(), 0.05) for r in (got.rows, rows)]
    np.testing.assert_allclose(*veils, rtol=0.01)


@pytest.mark.parametrize("count", [1000, 10_000, 100_000])
def test_no_lux_of_a_town_all_over_the_frame_is_lost(count: int) -> None:
    """Lamps over 30 by 30 degrees; five degrees beside them the veil is that of all within 4 %.

    64 parts are boxes of a = 3.75 degrees, of variance a^2 / 12 along each axis. A veil by
    theta^-p is too small by p^2 / 2 of that over theta^2: at p = 2.5 by 8 % for the nearest row of
    them, 6.9 degrees off, by 1 % for one 20 degrees off, and by 3 % for all.
    """
    random = np.random.default_rng(count)
    lux = random.lognormal(-9.0, 1.0, count)
    rows = lamps(*random.uniform(-15.0, 15.0, (2, count)), lux) * [1, 1, 1, 1.0, 0.8, 0.5]
    got = most_dazzling(rows)
    assert len(got.rows) == MOST_LAMPS
    assert got.merged == count - ALONE
    np.testing.assert_allclose(got.rows[:, 3:].sum(axis=0), rows[:, 3:].sum(axis=0), rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(got.rows[:, :3], axis=1), 1.0, atol=1e-6)
    rays = lamps(np.full(13, 20.0), np.linspace(-15.0, 15.0, 13), np.ones(13))[:, :3]
    veil = lamp_veil(got.rows, rays, MODELS["cie135"], Observer(), 0.05)
    wanted = [
        kernel(MODELS["cie135"], Observer(), 0.05, angle(rows[:, :3], ray)) @ rows[:, 3:]
        for ray in rays
    ]
    np.testing.assert_allclose(veil, wanted, rtol=0.04)
    # Nobody is farther than is told from a row, and as near as parts of 30 degrees can be.
    near = np.arccos(np.clip((rows[:, :3] @ got.rows[:, :3].T).max(axis=1), -1.0, 1.0))
    assert np.degrees(near.max()) <= got.within + 0.05  # arccos of a float32's vector
    assert got.within < 5.4  # a box of 3.75 degrees from corner to corner
    np.testing.assert_array_equal(most_dazzling(rows).rows, got.rows)


def test_the_most_dazzling_stay_as_they_are_before_a_town() -> None:
    random = np.random.default_rng(4)
    bright = lamps(*random.uniform(-15.0, 15.0, (2, ALONE)), np.full(ALONE, 50.0))
    town = lamps(*random.uniform(-15.0, 15.0, (2, 5000)), np.full(5000, 1e-4))
    got = most_dazzling(np.concatenate([town, bright]))
    first = {tuple(row) for row in got.rows[:ALONE]}
    assert first == {tuple(row) for row in bright.astype(np.float32).astype(np.float64)}
    np.testing.assert_allclose(got.rows[ALONE:, 3].sum(), len(town) * 1e-4, rtol=1e-6)


def test_a_group_far_off_is_a_row_by_itself() -> None:
    """200 in one place, 100 in another 20 degrees away: two rows, each where its lamps are."""
    places = np.repeat([-10.0, 10.0], [200, 100])
    rows = lamps(places, np.zeros(300), np.ones(300))
    got = most_dazzling(rows)
    assert len(got.rows) == ALONE + 2
    assert got.within < 1e-5
    for place, lux in ((-10.0, 200.0), (10.0, 100.0)):
        there = got.rows[:, 0] * place > 0.0
        np.testing.assert_allclose(got.rows[there, 3].sum(), lux, rtol=1e-6)
        way = lamps(*np.array([[place], [0.0], [1.0]]))[0, :3]
        np.testing.assert_allclose(got.rows[there, :3], np.tile(way, (there.sum(), 1)), atol=1e-7)


def test_lamps_all_about_the_eye() -> None:
    """Opposite pairs have no middle: rows are unit vectors all the same, with all lux."""
    random = np.random.default_rng(5)
    way = random.normal(size=(2000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    rows = np.concatenate([np.concatenate([way, -way]), np.ones((4000, 3))], axis=1)
    got = most_dazzling(rows)
    assert len(got.rows) == MOST_LAMPS
    np.testing.assert_allclose(np.linalg.norm(got.rows[:, :3], axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(got.rows[:, 3:].sum(axis=0), 4000.0, rtol=1e-6)


def test_pixels_that_show_lamps_go_with_them() -> None:
    """Also where lamps stand together: each of 400 is in the rows, so no pixel of one scatters."""
    x, y = (v.ravel() * 4.0 for v in np.mgrid[-10:10, -10:10])
    rows = lamps(x, y, np.ones(400))
    pixels = lamps(x, y, -np.ones(400))
    got = most_dazzling(rows, pixels, np.arange(400))
    lit, shown = got.rows[:MOST_LAMPS], got.rows[MOST_LAMPS:]
    np.testing.assert_allclose(lit[:, 3:].sum(axis=0), 400.0, rtol=1e-6)
    np.testing.assert_array_equal(shown, pixels.astype(np.float32))
    assert got.pixels == 0
    # Pixels of no lamp, and more than there is room for.
    few = most_dazzling(rows[:1], np.tile(pixels[:1], (600, 1)), np.full(600, -1))
    assert len(few.rows) == 1 + MOST_PIXELS
    assert few.pixels == 600 - MOST_PIXELS


def test_pixels_of_the_weakest_lamps_are_left_out() -> None:
    x, y = (v.ravel() for v in np.mgrid[-12:13, -12:13])
    lux = np.random.default_rng(6).permutation(625) + 1.0
    pixels = lamps(x, y, -np.ones(625))
    got = most_dazzling(lamps(x, y, lux), pixels, np.arange(625))
    assert got.pixels == 625 - MOST_PIXELS
    strong = pixels[lux > 625 - MOST_PIXELS].astype(np.float32)
    np.testing.assert_array_equal(got.rows[MOST_LAMPS:], strong)
