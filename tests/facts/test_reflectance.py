"""R = T^gamma D, Lambert, Blinn-Phong (Petit and Bremond 2010, section 3)."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from hdrusd.photometry.reflectance import (
    blinn_phong,
    coded_reflectance,
    half_cosine,
    lambert,
    reflectance_table,
)

PI = math.pi


def test_half_becomes_a_fifth() -> None:
    # T = 0.5, D = 1: 0.2176. Code 127.5 lies between two codes, whose values enclose it.
    table = reflectance_table(2.2, 1.0)
    assert table[127] < 0.5**2.2 < table[128]
    assert pytest.approx(0.2176, abs=5e-5) == 0.5**2.2
    assert table[128] == pytest.approx((128 / 255) ** 2.2, rel=1e-14)


def test_black_and_white_stay() -> None:
    for gamma in (1.0, 2.2, 3.0):
        table = reflectance_table(gamma, 0.7)
        assert table[0] == 0.0
        assert table[255] == pytest.approx(0.7, rel=1e-15)


def test_gamma_one_is_linear_and_the_table_rises() -> None:
    assert reflectance_table(1.0, 1.0) == pytest.approx(np.arange(256) / 255, rel=1e-15)
    assert (np.diff(reflectance_table(2.2, 1.0)) > 0.0).all()


def test_diffuse_colour_multiplies() -> None:
    assert reflectance_table(2.2, 0.25) == pytest.approx(reflectance_table(2.2, 1.0) / 4, rel=1e-15)


def test_white_under_ten_lux() -> None:
    # L = R E / pi: 10 / pi = 3.183 cd/m2; the paper's L = R E: 10.
    white = np.ones(3)
    assert lambert(white, 10.0 * white, 1 / PI)[0] == pytest.approx(3.183, abs=5e-4)
    assert lambert(white, 10.0 * white, 1.0)[0] == 10.0


@pytest.mark.parametrize(("shininess", "peak"), [(32.0, 1.59154943), (0.0, 1 / PI)])
def test_peak_of_the_normalised_highlight(shininess: float, peak: float) -> None:
    # (n + 8) / (8 pi) at N.H = 1; printed to 9 digits.
    got = blinn_phong(np.float64(1.0), np.float64(shininess), 1 / PI)
    assert got == pytest.approx(peak, abs=5e-9)


def test_petit2010_has_no_normalisation() -> None:
    got = blinn_phong(np.float64(0.9), np.float64(16.0), 1.0)
    assert got == pytest.approx(0.9**16, rel=1e-14)


@pytest.mark.parametrize("shininess", [8.0, 32.0, 128.0, 1000.0])
def test_the_highlights_energy_does_not_grow_with_the_exponent(shininess: float) -> None:
    # Seen along the normal, H is at half the angle of L. The exact normalisation is
    # (n+2)(n+4) / (8 pi (2^(-n/2) + n)); (n + 8) / (8 pi) is above it by their ratio.
    theta = np.linspace(0.0, PI / 2, 200_001)
    lobe = blinn_phong(np.cos(theta / 2), np.float64(shininess), 1 / PI)
    energy = np.trapezoid(lobe * np.cos(theta) * 2 * PI * np.sin(theta), theta)
    n = shininess
    ratio = (n + 8) * (2 ** (-n / 2) + n) / ((n + 2) * (n + 4))
    assert energy == pytest.approx(ratio, rel=1e-6)  # trapezoids: (pi/2 / 2e5)^2 n
    assert 1.0 < energy < 1.25


def test_exact_normalisation_of_thirty_two() -> None:
    # 1.52191842 sr^-1, which ours exceeds by 4.6 %.
    n = 32.0
    exact = (n + 2) * (n + 4) / (8 * PI * (2 ** (-n / 2) + n))
    assert exact == pytest.approx(1.52191842, abs=5e-9)
    got = float(blinn_phong(np.float64(1.0), np.float64(n), 1 / PI))
    assert got / exact == pytest.approx(1.0457521, abs=5e-7)


def test_half_vector_from_cosines() -> None:
    rng = np.random.default_rng(7)
    n, light, view = (
        v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(3, 200, 3))
    )
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    got = half_cosine(np.sum(n * light, 1), np.sum(n * view, 1), np.sum(light * view, 1))
    # 1e-12: |L + V|^2 = 2 + 2 L.V cancels where they are nearly opposite (L.V > -0.999 here).
    assert got == pytest.approx(np.sum(n * half, 1), abs=1e-12)


def test_opposite_directions_have_a_finite_half_vector() -> None:
    assert np.isfinite(half_cosine(np.float64(0.0), np.float64(0.0), np.float64(-1.0)))


def test_published_vectors(testdata: Path) -> None:
    (file,) = (testdata / "design").glob("*_vectors.json")
    vectors = json.loads(file.read_text())["6_photometry"]
    pi, paper = vectors["Lambert rho=.5: L = rho E/pi; paper L=R*E"]
    lux = vectors["E I=1000cd d=5m cos60deg"]
    assert lux == 1000.0 * 0.5 / 25.0
    half = np.float64(0.5)
    assert lambert(half, np.float64(lux), 1 / PI) == pytest.approx(pi, rel=1e-14)
    assert lambert(half, np.float64(lux), 1.0) == pytest.approx(paper, rel=1e-14)
    key = next(name for name in vectors if name.startswith("blinn-phong norm n=32"))
    got = blinn_phong(np.float64(1.0), np.float64(32.0), 1 / PI)
    assert got == pytest.approx(vectors[key][0], rel=1e-14)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("diffuse", [(0.8, 0.8, 0.8), (0.5, 1.0, 0.0)])
@pytest.mark.parametrize("size", [(1, 1), (3, 5), (130, 257)])
def test_coded_reflectance_is_rounded_once(
    channels: int, diffuse: tuple[float, float, float], size: tuple[int, int]
) -> None:
    """All codes in all channels, odd and even numbers of them, one block and several."""
    codes = np.random.default_rng(3).integers(0, 256, (*size, channels)).astype(np.uint8)
    color = codes[..., :3] if channels > 2 else codes[..., :1]
    wanted = (np.broadcast_to(color, (*size, 3)) / 255.0) ** 2.2 * np.array(diffuse)
    found = coded_reflectance(codes, 2.2, diffuse)
    assert found.dtype == np.float16
    np.testing.assert_array_equal(found[..., :3], wanted.astype(np.float16))
    if channels in (2, 4):
        np.testing.assert_array_equal(found[..., 3], (codes[..., -1] / 255.0).astype(np.float16))
    assert found.shape[2] == (4 if channels in (2, 4) else 3)
