"""The split sum against integrals over the whole sky, and its parts against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.photometry.environment import (
    LAST,
    STEP,
    TABLE,
    WIDTHS,
    blur_level,
    blurred,
    blurred_levels,
    main_direction,
    mean_schlick,
    reflected,
    reflected_table,
    table_place,
)
from hdrusd.photometry.microfacet import fresnel, ggx_gain, ggx_lobe, half_angles, schlick_weight
from hdrusd.photometry.sky import sky_uv, texel_directions, texel_solid_angles

PI = math.pi
H, W = 128, 256
TOWARDS = texel_directions(H, W).reshape(-1, 3)
ANGLES = np.broadcast_to(texel_solid_angles(H, W), (H, W)).ravel()
F0 = np.array([0.04, 0.5, 0.9])
F90 = np.ones(3)

OVERCAST = np.where(TOWARDS[:, 1] > 0, (1 + 2 * TOWARDS[:, 1]) / 3, 0.1)
HALVES = np.where(TOWARDS[:, 1] > 0, 1.0, 0.075)


@pytest.fixture(scope="module")
def table() -> Any:
    return reflected_table()


def bilinear(picture: Any, uv: Any, *, around: bool) -> Any:
    """What GL_LINEAR reads of rows that go up; ``around``: the columns repeat."""
    h, w = picture.shape[:2]
    x, y = uv * [w, h] - 0.5
    i, j = math.floor(x), math.floor(y)
    column = (lambda k: k % w) if around else (lambda k: min(max(k, 0), w - 1))
    rows = [min(max(k, 0), h - 1) for k in (j, j + 1)]
    low, high = (
        picture[r, column(i)] * (1 - x + i) + picture[r, column(i + 1)] * (x - i) for r in rows
    )
    return low * (1 - y + j) + high * (y - j)


def split_sum(levels: Any, table: Any, n: Any, v: Any, alpha: float) -> Any:
    nv = float(n @ v)
    level = float(blur_level(np.asarray(alpha)))
    k = min(int(level), LAST - 1)
    uv = sky_uv(main_direction(n, 2 * nv * n - v, np.asarray(alpha)))
    near, far = (bilinear(levels[i][::-1], uv, around=True) for i in (k, k + 1))
    entry = bilinear(table, table_place(np.asarray(nv), np.asarray(alpha)), around=False)
    return (near * (k + 1 - level) + far * (level - k)) * reflected(F0, F90, entry)


def integral(sky: Any, n: Any, v: Any, alpha: float) -> Any:
    """The whole lobe over the whole sky, a texel a direction."""
    nl, nv = TOWARDS @ n, float(n @ v)
    front = nl > 0
    a2 = np.asarray(alpha**2)
    angles = half_angles(n[None], TOWARDS[front], v[None], nl[front], np.asarray(nv))
    lobe = ggx_lobe(ggx_gain(np.asarray(nv), a2, np.asarray(1 / PI)), a2, nl[front], angles[:, 0])
    f = fresnel(F0[None], F90[None], schlick_weight(angles[:, 1]))
    return np.sum(f * (sky[front] * lobe * nl[front] * ANGLES[front])[:, None], axis=0)


def worst(sky: Any, table: Any, roughness: float, degrees: float) -> float:
    """Largest relative error over views of one angle to a surface that leans by 30 degrees."""
    levels = blurred_levels(np.repeat(sky.reshape(H, W, 1), 3, axis=-1))
    n = np.array([0.5, math.sqrt(0.75), 0.0])
    t, b = np.array([math.sqrt(0.75), -0.5, 0.0]), np.array([0.0, 0.0, 1.0])
    off = []
    for turn in np.radians([0.0, 90.0, 180.0]):
        across = math.cos(turn) * t + math.sin(turn) * b
        v = math.cos(math.radians(degrees)) * n + math.sin(math.radians(degrees)) * across
        wanted = integral(sky, n, v, roughness**2)
        off.append(np.abs(split_sum(levels, table, n, v, roughness**2) / wanted - 1.0).max())
    return float(max(off))


@pytest.mark.parametrize("roughness", [0.3, 0.5, 0.7, 1.0])
@pytest.mark.parametrize("degrees", [0.0, 45.0, 70.0, 80.0])
def test_an_even_sky_is_mirrored_as_the_integral_says(
    table: Any, roughness: float, degrees: float
) -> None:
    # Left over: the table's steps, and the texels of the integral.
    assert worst(np.ones(H * W), table, roughness, degrees) < 0.005


@pytest.mark.parametrize(
    ("sky", "degrees", "off"),
    [
        (OVERCAST, 0.0, 0.06),
        (OVERCAST, 45.0, 0.09),
        (OVERCAST, 70.0, 0.26),
        (HALVES, 0.0, 0.03),
        (HALVES, 45.0, 0.08),
        (HALVES, 70.0, 0.5),
    ],
)
def test_how_far_a_sky_of_contrast_is_off_by_the_view(
    table: Any, sky: Any, degrees: float, off: float
) -> None:
    errors = [worst(sky, table, roughness, degrees) for roughness in (0.35, 0.5, 0.7, 1.0)]
    assert max(errors) < off


# -- the table


def test_a_smooth_surface_reflects_what_schlick_says(table: Any) -> None:
    # alpha is 1e-4 there; where N.V is not much more, the surface shadows itself.
    nv = np.linspace(0.0, 1.0, TABLE)[2:] ** 2
    bent = (1 - nv) ** 5
    assert table[0, 2:, 0] == pytest.approx(1 - bent, abs=2e-3)
    assert table[0, 2:, 1] == pytest.approx(bent, abs=2e-3)


def test_a_rough_surface_seen_from_above() -> None:
    # alpha = 1, V = N: D = 1 / pi and G / (4 N.L N.V) = 1 / (2 (1 + N.L)), so that it is the
    # integral of x / (1 + x) over x = N.L from 0 to 1.
    assert reflected_table(3)[2, 2].sum() == pytest.approx(1 - math.log(2), rel=1e-3)


def test_no_lobe_reflects_more_than_it_gets(table: Any) -> None:
    assert (table >= 0.0).all()
    assert table.sum(axis=-1).max() <= 1.0 + 1e-3


def test_table_places_are_the_middles_of_texels_at_both_ends() -> None:
    ends = table_place(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    assert ends * TABLE == pytest.approx(np.array([[0.5, 0.5], [TABLE - 0.5, TABLE - 0.5]]))


def test_what_the_diffuse_part_loses() -> None:
    # Midpoints in N.L^2 (so weighted by N.L) and in the turn.
    nl = np.sqrt((np.arange(400) + 0.5) / 400)[:, None]
    turn = (np.arange(400) + 0.5) / 400 * PI
    for nv in (0.0, 0.1, 0.3, 0.5, 0.8, 1.0):
        lv = nl * nv + np.sqrt(1 - nl**2) * math.sqrt(1 - nv * nv) * np.cos(turn)
        wanted = np.mean((1 - np.sqrt((1 + lv) / 2)) ** 5)
        assert mean_schlick(np.asarray(nv)) == pytest.approx(wanted, abs=2e-5)


# -- the blur


@pytest.mark.parametrize("level", [1, 2, 3, 4, 5])
def test_the_blur_is_the_mean_over_the_lobe(level: int) -> None:
    alpha, width = STEP ** (level - LAST), WIDTHS[level]
    sky = np.zeros((H, W, 3))
    sky[20:40, 10:60] = 1.0
    sky[90:, 200:] = [0.2, 0.5, 1.0]
    got = blurred(sky, alpha, width).reshape(-1, 3)
    axes = texel_directions(width // 2, width).reshape(-1, 3)
    for k in np.random.default_rng(5).integers(0, len(axes), 25):
        cosine = np.maximum(TOWARDS @ axes[k], 0.0)
        lobe = cosine / (alpha**2 + (1 - alpha**2) * (0.5 - 0.5 * cosine)) ** 2 * ANGLES
        assert got[k] == pytest.approx(lobe @ sky.reshape(-1, 3) / lobe.sum(), abs=5e-5)


def test_an_even_sky_stays_even_and_levels_have_their_sizes() -> None:
    levels = blurred_levels(np.full((3, 7, 3), 5.0))
    assert [level.shape for level in levels] == [(w // 2, w, 3) for w in WIDTHS]
    assert max(np.abs(level - 5.0).max() for level in levels) < 1e-12


def test_levels_by_alpha() -> None:
    alphas = np.array([1.0, 0.4, 0.16, 0.064, 0.0256, 1e-3, 0.0])
    assert blur_level(alphas) == pytest.approx([5, 4, 3, 2, 1, 0, 0], abs=1e-12)


def test_main_direction_is_the_mirror_s_for_a_smooth_surface_and_the_normal_for_a_rough_one() -> (
    None
):
    n, r = np.array([[0.0, 1.0, 0.0]] * 2), np.array([[0.6, 0.8, 0.0]] * 2)
    got = main_direction(n, r, np.array([0.0, 1.0]))
    assert got == pytest.approx(np.array([r[0], n[0]]), abs=1e-15)
