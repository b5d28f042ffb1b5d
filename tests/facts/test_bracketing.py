"""Brackets merged into light, and light into cd/m2 (photometry/bracketing.py)."""

from __future__ import annotations

import numpy as np
import pytest
from bracketed import shoot

from hdrusd.errors import HdrusdError
from hdrusd.photometry.bracketing import (
    BETWEEN,
    CODE,
    HELD,
    TOO_BRIGHT,
    TOO_DARK,
    camera_factor,
    departs,
    disc,
    exposed,
    factor_of,
    flattest,
    merge,
    noise,
    ratio,
    steady,
    with_tolerance,
)
from hdrusd.photometry.response import bell, linear_response, srgb_response


def pixel(*codes: int) -> list[np.ndarray]:
    """One grey pixel in several pictures."""
    return [np.array([[code]], np.uint8) for code in codes]


def test_pictures_that_agree_give_what_they_say() -> None:
    # Linear codes: 40, 80, 160 at exposures 1, 2, 4 are all E = 40/128.
    tables = [exposed(linear_response(), h, 255) for h in (1.0, 2.0, 4.0)]
    light, state = merge(pixel(40, 80, 160), tables)
    assert light[0, 0] == pytest.approx(40.0 / 128.0, rel=1e-6)  # 3 float32 sums
    assert state[0, 0] == HELD


def test_the_weights_are_the_papers() -> None:
    tables = [exposed(linear_response(), h, 255) for h in (1.0, 4.0)]
    light, _ = merge(pixel(50, 180), tables)
    w = bell(np.array([50.0, 180.0]) / 255.0)
    h, g = np.array([1.0, 4.0]), np.array([50.0, 180.0]) / 128.0
    assert light[0, 0] == pytest.approx((w * h * g).sum() / (w * h * h).sum(), rel=1e-6)


def test_saturated_and_noisy_codes_do_not_count() -> None:
    tables = [exposed(linear_response(), h, 255) for h in (1.0, 8.0, 64.0)]
    light, _ = merge(pixel(3, 30, 255), tables)
    assert light[0, 0] == pytest.approx(30.0 / 128.0 / 8.0, rel=1e-6)


def test_what_no_picture_holds_gets_its_bound() -> None:
    tables = [exposed(linear_response(), h, 255) for h in (1.0, 100.0)]
    light, state = merge(pixel(255, 255), tables)
    assert (light[0, 0], state[0, 0]) == (pytest.approx(250.0 / 128.0), TOO_BRIGHT)
    light, state = merge(pixel(0, 3), tables)
    assert (light[0, 0], state[0, 0]) == (pytest.approx(3.0 / 128.0 / 100.0), TOO_DARK)
    # More than 250 in the long exposure, at most 4 in the short one.
    light, state = merge(pixel(3, 255), tables)
    between = np.sqrt(4.0 / 128.0 * 250.0 / 128.0 / 100.0)
    assert (light[0, 0], state[0, 0]) == (pytest.approx(between), BETWEEN)


def test_channels_have_curves_of_their_own() -> None:
    response = linear_response()
    curves = response.curves * np.array([[1.0], [2.0], [4.0]])
    tables = [exposed(type(response)("three", curves), h, 255) for h in (1.0, 2.0)]
    codes = [np.full((1, 3), 60, np.uint8), np.full((1, 3), 120, np.uint8)]
    light, _ = merge(codes, tables)
    assert light[0] == pytest.approx(np.array([1.0, 2.0, 4.0]) * 60.0 / 128.0, rel=1e-6)


def test_eight_and_sixteen_bits_mix() -> None:
    tables = [exposed(linear_response(), 1.0, 255), exposed(linear_response(), 2.0, 65535)]
    light, _ = merge([np.array([[50]], np.uint8), np.array([[100 * 257]], np.uint16)], tables)
    assert light[0, 0] == pytest.approx(50.0 / 128.0, rel=1e-6)


def _pair(light: np.ndarray, moved: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Codes of two pictures, of which the second sees ``moved``, and where they depart."""

    def linear(exposure: np.ndarray) -> np.ndarray:
        return np.clip(exposure, 0.0, 1.0)

    stops = (0.0, 1.0)
    codes = [shoot(light, 0.0, response=linear), shoot(moved, 1.0, response=linear)]
    flat = [code.reshape(-1, 1) for code in codes]
    tables = [exposed(linear_response(), 2.0**s, 255) for s in stops]
    sigma = noise(flat, tables, merge(flat, tables)[0])
    tables = [with_tolerance(table, sigma) for table in tables]
    merged, _ = merge(codes, tables)
    pairs = zip(codes, tables, strict=True)
    return codes, [departs(code, table, merged) for code, table in pairs]


def test_noise_alone_does_not_depart() -> None:
    light = np.tile(np.linspace(0.4, 2.0, 200), (100, 1))[..., None]
    _, away = _pair(light, light)
    assert np.count_nonzero(away[0] | away[1]) <= 2  # of 20,000, at six times the noise


def test_what_moves_departs_where_it_moved() -> None:
    light = np.full((100, 100, 1), 0.5)
    moved = light.copy()
    moved[20:40, 30:50] = 1.5
    _, away = _pair(light, moved)
    found = away[0] | away[1]
    assert found[20:40, 30:50].mean() > 0.99
    assert np.count_nonzero(found) - np.count_nonzero(found[20:40, 30:50]) <= 2


def test_departures_need_the_noise() -> None:
    table = exposed(linear_response(), 1.0, 255)
    with pytest.raises(HdrusdError, match="want with_tolerance"):
        departs(np.zeros((1, 1), np.uint8), table, np.zeros((1, 1), np.float32))


def test_noise_is_measured_in_codes() -> None:
    rng = np.random.default_rng(3)
    true = np.full((20000, 1), 100.0)
    codes = [
        np.clip(np.rint(true * h + rng.normal(0.0, 3.0, true.shape)), 0, 255).astype(np.uint8)
        for h in (1.0, 2.0)
    ]
    tables = [exposed(linear_response(), h, 255) for h in (1.0, 2.0)]
    sigma = noise(codes, tables, (true / 128.0).astype(np.float32))
    assert 255.0 * sigma[[6, 12]] == pytest.approx(3.0, rel=0.1)  # levels of codes 100 and 200


def test_a_wrong_exposure_shows_in_the_ratio() -> None:
    codes = np.arange(40, 110, dtype=np.uint8)[:, None]
    a, b = (exposed(linear_response(), h, 255) for h in (1.0, 1.5))
    assert ratio(codes, 2 * codes, a, b) == pytest.approx(0.75, rel=1e-5)
    assert np.isnan(ratio(codes[:3], 2 * codes[:3], a, b))


def test_flat_pixels_of_all_levels_are_chosen() -> None:
    rng = np.random.default_rng(4)
    level = rng.uniform(0.0, 1.0, 4096)
    spread = rng.uniform(0.0, 1.0, 4096)
    chosen = flattest(level[:, None, None], spread, 512)
    assert len(chosen) == len(set(chosen.tolist())) == 512
    assert np.histogram(level[chosen], 8, (0.0, 1.0))[0].min() >= 48
    assert spread[chosen].mean() < 0.15
    assert len(flattest(level[:1, None, None], spread[:1], 512)) == 1


def test_pixels_that_moved_are_sifted_whatever_the_response() -> None:
    rng = np.random.default_rng(6)
    light = rng.uniform(0.05, 1.0, (4000, 1))
    codes = np.stack([np.sqrt(light * h).clip(0.0, 1.0) for h in (0.1, 0.3, 0.9)], axis=1)
    codes += rng.normal(0.0, 1.0 / 255.0, codes.shape)
    assert steady(codes.clip(0.0, 1.0)).mean() > 0.97
    codes[:200, 1:] = np.sqrt(0.5 * np.array([0.3, 0.9]))[None, :, None]
    kept = steady(codes.clip(0.0, 1.0))
    changed = np.abs(np.sqrt(light[:200, 0]) - np.sqrt(0.5)) > 0.15
    assert not kept[:200][changed].any()
    assert kept[200:].mean() > 0.95


def test_discs() -> None:
    assert np.argwhere(disc((5, 5), 3, 1, 0.0)).tolist() == [[1, 3]]
    assert np.count_nonzero(disc((9, 9), 4, 4, 1.0)) == 5
    # Pixels whose centres lie within 3 of a centre: 29.
    assert np.count_nonzero(disc((9, 9), 4, 4, 3.0)) == 29


def test_calibration_makes_the_mean_luminance() -> None:
    light = np.array([[1.0, 2.0, 3.0], [3.0, 2.0, 1.0]])
    # Both pixels weigh the same: the mean is (2, 2, 2), luminance 2.
    assert factor_of(light, 500.0) == pytest.approx(250.0)
    for nothing in (np.zeros((4, 3)), np.zeros((0, 3)), np.full((1, 3), np.nan)):
        with pytest.raises(HdrusdError, match="no light"):
            factor_of(nothing, 1.0)


def test_the_camera_equation() -> None:
    # 1/60 s, f/4, ISO 100: 10/0.65 16 60 / 100 = 147.7 cd/m2 come out at code 118.
    exposure = 100.0 / 60.0 / 16.0
    table = exposed(srgb_response(), exposure, 255)
    said = table.light[0, round(CODE * 255)] * camera_factor(srgb_response())
    assert said == pytest.approx(147.69, rel=1e-4)
    # By ISO 2720's K = 12.5: 12.5 16 60 / 100 = 120.
    said = table.light[0, 118] * camera_factor(srgb_response(), 12.5)
    assert said == pytest.approx(120.0, rel=1e-5)
