"""GGX: Walter et al. 2007 written out, the energy it keeps, and published luminances."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import light_row

from hdrusd.photometry.microfacet import (
    MIN_ALPHA,
    alpha_from_roughness,
    coat_reflectance,
    fresnel,
    ggx_gain,
    ggx_lobe,
    grazing_reflectance,
    half_angles,
    schlick_weight,
)
from hdrusd.photometry.shading import shade

PI = math.pi
UP = np.array([0.0, 0.0, 1.0])
ALPHAS = [1e-3, 0.01, 0.09, 0.25, 0.49, 1.0]


def direction(cosine: Any, azimuth: Any = 0.0) -> np.ndarray:
    sine = np.sqrt(1.0 - np.square(cosine))
    parts = np.broadcast_arrays(sine * np.cos(azimuth), sine * np.sin(azimuth), cosine)
    return np.stack(parts, axis=-1)


def distribution(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """D of Walter et al. 2007, eq. 33, as it stands there, with the tangent."""
    tangent2 = 1.0 / np.square(cosine) - 1.0
    return alpha**2 / (PI * cosine**4 * np.square(alpha**2 + tangent2))


def shadowing(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """G1 of eq. 34."""
    tangent2 = 1.0 / np.square(cosine) - 1.0
    return 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * tangent2))


def lobe(light: np.ndarray, view: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """(D G / (4 N.L N.V), V.H) by the functions under test; N is +Z."""
    nl, nv = light[..., 2], view[..., 2]
    angles = half_angles(UP, light, view, nl, nv)
    alpha2 = np.float64(alpha**2)
    return ggx_lobe(ggx_gain(nv, alpha2, 1 / PI), alpha2, nl, angles[..., 0]), angles[..., 1]


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_lobe_is_the_published_one(alpha: float) -> None:
    rng = np.random.default_rng(2007)
    light, view = (direction(rng.uniform(0.05, 1, 500), rng.uniform(0, 6, 500)) for _ in "lv")
    half = light + view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    nl, nv = light[:, 2], view[:, 2]
    wanted = distribution(half[:, 2], alpha) * shadowing(nl, alpha) * shadowing(nv, alpha)
    got, vh = lobe(light, view, alpha)
    np.testing.assert_allclose(got, wanted / (4.0 * nl * nv), rtol=1e-9)
    np.testing.assert_allclose(vh, np.sum(view * half, axis=-1), rtol=1e-12)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_distribution_is_normalised(alpha: float) -> None:
    """The facets' areas projected on the surface add up to it: integral of D cos = 1.

    With sin^2 = s it is pi times the integral of D ds from 0 to 1. At N.L = N.V = 1 the lobe
    is D / 4. Midpoints of 4,000 steps of log s from 1e-6 alpha^2 on, below which are 1e-6.
    """
    low = 1e-6 * alpha**2
    edges = np.exp(np.linspace(math.log(low), 0.0, 4001))
    middle = np.sqrt(edges[1:] * edges[:-1])
    gain = ggx_gain(np.float64(1.0), np.float64(alpha**2), 1 / PI)
    d = 4.0 * ggx_lobe(gain, np.float64(alpha**2), np.float64(1.0), middle)
    total = PI * (np.sum(d * np.diff(edges)) + d[0] * low)
    assert total == pytest.approx(1.0, abs=1e-5)


def reflected(cosine: float, alpha: float, f0: float, f90: float) -> float:
    """Share of uniform light that the lobe sends to an eye at N.V = ``cosine``.

    Half vectors on a grid of equal shares of D cos, so that the integrand has no peak.
    """
    n = 400
    share, turn = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n * 2 * PI)
    nh = np.sqrt((1.0 - share) / (1.0 + (alpha**2 - 1.0) * share))
    half, view = direction(nh, turn), direction(cosine)
    vh = half @ view
    light = 2.0 * vh[..., None] * half - view
    nl = light[..., 2]
    seen = (nl > 0.0) & (vh > 0.0)
    value, _ = lobe(np.where(seen[..., None], light, UP), view, alpha)
    f = f0 + (f90 - f0) * schlick_weight(vh)
    weight = f * value * nl * 4.0 * vh / (distribution(nh, alpha) * nh)
    return float(np.mean(np.where(seen, weight, 0.0)))


@pytest.mark.parametrize("alpha", ALPHAS)
def test_white_furnace_returns_no_more_than_came(alpha: float) -> None:
    """A perfect mirror's facets return all but what they shadow: at most 1."""
    for cosine in (1.0, 0.7, 0.4, 0.1, 0.02):
        share = reflected(cosine, alpha, 1.0, 1.0)
        assert share <= 1.0 + 1e-3
        assert share >= (0.95 if alpha <= 0.01 and cosine >= 0.1 else 0.3)


def test_a_smooth_surface_reflects_as_fresnel_says() -> None:
    """The lobe of alpha = 0.001 is a mirror: what returns is F at the angle of view."""
    for cosine in (1.0, 0.5, 0.2):
        wanted = 0.04 + 0.96 * (1.0 - cosine) ** 5
        assert reflected(cosine, 1e-3, 0.04, 1.0) == pytest.approx(wanted, rel=2e-3)


def test_light_and_eye_may_change_places() -> None:
    """Helmholtz reciprocity of everything: diffuse under highlight under clear coat."""
    rng = np.random.default_rng(1856)
    fields = {
        "diffuse": np.array([0.5, 0.3, 0.1]),
        "specular": np.array([0.04, 0.1, 0.5]),
        "metallic": 0.3,
        "coat": (0.7, 0.02),
    }
    for alpha in (0.01, 0.3):
        a, b = (direction(rng.uniform(0.1, 1), rng.uniform(0, 6)) for _ in "ab")
        there, back = (
            shade(
                np.zeros(3),
                UP,
                fields["diffuse"],
                fields["specular"],
                np.float64(-alpha),
                light_row(1.0, position=tuple(to * 2.0)),
                eye=eye,
                metallic=fields["metallic"],
                coat=fields["coat"],
            )
            / to[2]
            for to, eye in ((a, b), (b, a))
        )
        np.testing.assert_allclose(there, back, rtol=1e-9)


def test_grazing_reflectance() -> None:
    """White for what reflects 2 % or more, F0 for a metal, nothing for F0 = 0."""
    f0 = np.array([[0.04, 0.04, 0.04], [0.01, 0.002, 0.0], [0.0, 0.0, 0.0], [0.9, 0.6, 0.3]])
    got = grazing_reflectance(f0, np.array([0.0, 0.0, 0.0, 1.0]))
    np.testing.assert_allclose(got, [[1.0] * 3, [0.5] * 3, [0.0] * 3, [0.9, 0.6, 0.3]])


def test_schlick() -> None:
    """Schlick 1994, eq. 15: glass at 60 degrees 0.04 + 0.96 / 32 = 7 %."""
    got = fresnel(np.full(3, 0.04), np.ones(3), schlick_weight(np.float64(0.5)))
    assert got == pytest.approx([0.07] * 3, rel=1e-14)


def test_without_reflectance_there_is_lambert_alone() -> None:
    """F0 = 0: exactly rho E / pi, at any roughness and angle, and no coat without weight."""
    lamp = light_row(100.0, position=(3.0, 0.0, 0.5))
    got = shade(
        np.zeros(3), UP, np.full(3, 0.3), np.zeros(3), np.float64(-0.001), lamp,
        eye=np.array([-9.0, 0.0, 0.4]),
    )  # fmt: skip
    lux = 100.0 * 0.5 / 9.25**1.5
    assert got == pytest.approx([0.3 * lux / PI] * 3, rel=1e-14)


def test_highlight_at_normal_incidence() -> None:
    """Lamp and eye straight above: F0 D / 4 with D = 1 / (pi alpha^2), and rho (1 - F0) / pi."""
    lamp = light_row(100.0, position=(0.0, 0.0, 5.0))
    for roughness, scale in ((0.5, 1 / PI), (0.5, 1.0), (0.8, 1 / PI)):
        alpha = float(alpha_from_roughness(np.float64(roughness)))
        got = shade(
            np.zeros(3), UP, np.full(3, 0.2), np.full(3, 0.04), np.float64(-alpha), lamp,
            eye=np.array([0.0, 0.0, 9.0]), scale=scale,
        )  # fmt: skip
        wanted = 4.0 * scale * (0.2 * 0.96 + 0.04 / (4.0 * roughness**4))
        assert got == pytest.approx([wanted] * 3, rel=1e-12)


def test_clear_coat_takes_from_what_lies_below() -> None:
    """Straight above: 4 % from the coat, 96 % of what was there without it."""
    lamp = light_row(100.0, position=(0.0, 0.0, 5.0))

    def seen(**more: Any) -> float:
        args = (np.zeros(3), UP, np.full(3, 0.2), np.full(3, 0.1), np.float64(-0.25), lamp)
        return float(shade(*args, eye=np.array([0.0, 0.0, 9.0]), **more)[0])

    bare, half = seen(), seen(coat=(0.5, 0.1))
    coat = 4.0 / (4.0 * PI * 0.1**2)
    assert half == pytest.approx(0.02 * coat + 0.98 * bare, rel=1e-12)
    assert coat_reflectance(np.float64(1.0), np.float64(1.0)) == pytest.approx(1.0)


def test_roughness_zero_is_not_a_point() -> None:
    assert alpha_from_roughness(np.float64(0.0)) == MIN_ALPHA
    assert alpha_from_roughness(np.float64(0.45)) == pytest.approx(0.2025)


@pytest.mark.parametrize("nl", [0.0, 1e-6, 1.0])
@pytest.mark.parametrize("nv", [-0.3, 0.0, 1e-6, 1.0])
def test_grazing_angles_are_finite_in_float32(nl: float, nv: float) -> None:
    light, view = (direction(np.float32(c)).astype(np.float32) for c in (nl, nv))
    light = light * np.float32([-1, 1, 1])
    value, vh = lobe(light, view, 1e-3)
    assert np.isfinite(value)
    assert 0.0 <= vh <= 1.0


def test_light_factors_and_links() -> None:
    """UsdLux diffuse and specular scale the two reflections; a link leaves other draws dark."""
    lamp = light_row(100.0, position=(1.0, 0.0, 2.0))
    args = (np.zeros((2, 3)), np.tile(UP, (2, 1)), np.full((2, 3), 0.2), np.full((2, 3), 0.1))

    def seen(gloss: float, **fields: float) -> np.ndarray:
        row = lamp.copy()
        for name, value in fields.items():
            row[name] = value
        links = np.array([0b01, 0b10])
        eye = np.array([0.0, 0.0, 9.0])
        return shade(*args, np.full(2, gloss), row, eye=eye, links=links)

    for gloss in (-0.25, 20.0):
        whole, matte, bright = seen(gloss), seen(gloss, specular=0.0), seen(gloss, diffuse=0.0)
        np.testing.assert_allclose(matte + bright, whole, rtol=1e-12)
        assert matte.min() > 0.0
        assert bright.min() > 0.0
        np.testing.assert_allclose(seen(gloss, link=2), whole * [[0.0], [1.0]], rtol=1e-12)


def test_published_luminances(testdata: Path) -> None:
    """ggx_metal of the truth set: closed form and Mitsuba 3.9.1, to 0.1 %."""
    folder = testdata / "truth"
    cases = json.loads((folder / "expected.json").read_text())["cases"]
    (case,) = (case for case in cases if case["id"] == "ggx_metal")
    scene = json.loads((folder / "stages/ggx_metal.lights.json").read_text())
    (lamp,), (metal,) = scene["lights"], scene["materials"]
    probes = case["probes"]
    assert len(probes) == 6
    got = shade(
        np.array([probe["point_m"] for probe in probes]),
        np.array([probe["normal"] for probe in probes]),
        np.zeros((6, 3)),
        np.tile(metal["F0"], (6, 1)),
        np.full(6, -(metal["roughness"] ** 2)),
        light_row(tuple(lamp["intensity_rgb_cd"]), position=tuple(lamp["position_m"])),
        eye=np.array(scene["camera"]["eye_m"]),
        metallic=1.0,
    )
    np.testing.assert_allclose(got, [probe["expect"]["RGB"] for probe in probes], rtol=1e-3)
