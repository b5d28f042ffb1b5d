"""Skies by name: what they give a level ground, and their distributions' closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hdrusd.photometry import sky_models
from hdrusd.photometry.sky import irradiance_coefficients, sh_polynomials, texel_directions
from hdrusd.photometry.sky_presets import PRESETS, level_lux


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("altitude", [None, 20.0, 60.0, 90.0])
def test_a_picture_gives_the_skys_lux(name: str, altitude: float | None) -> None:
    preset = PRESETS[name]
    if preset.altitude is not None and altitude is not None and altitude > preset.most:
        altitude = -9.0
    sky = preset.sky(altitude, 30.0)
    assert preset.source
    if sky.picture is not None:
        assert level_lux(sky.picture) == pytest.approx(sky.lux, rel=1e-3)
        # Below the horizon there is the ground.
        assert not sky.picture[sky.picture.shape[0] // 2 :].any()
        assert sky.picture.min() >= 0.0
    doubled = preset.sky(altitude, 30.0, 2.0 * sky.illuminance)
    assert doubled.illuminance == pytest.approx(2.0 * sky.illuminance, rel=1e-12)
    assert doubled.beam == pytest.approx(2.0 * sky.beam, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "altitude", "lux", "within"),
    [
        ("moonless", None, 1e-3, 0.0),
        # The ends of civil, nautical and astronomical twilight have 2 to 3.5, 0.008 and 6e-4 lx
        # (AMS Glossary of Meteorology); these are Janiczek and DeYoung's.
        ("dusk", -6.0, 3.4, 0.01),
        ("dusk", -12.0, 0.008, 0.02),
        ("dusk", -18.0, 6.5e-4, 0.02),
        ("overcast-day", 30.0, 10_800.0, 1e-12),  # 0.3 + 21 / 2 klx
        ("starlit-city", None, math.pi * 3.17e-3, 1e-12),
    ],
)
def test_the_presets_numbers(name: str, altitude: float | None, lux: float, within: float) -> None:
    assert PRESETS[name].sky(altitude).illuminance == pytest.approx(lux, rel=within)


def test_the_clear_skys_parts() -> None:
    # IES RP-21 at 30 degrees: 127.5 exp(-0.42) klx of sun, 0.8 + 15.5 sqrt(1/2) klx of sky.
    sky = PRESETS["clear-sun"].sky(30.0)
    assert sky.beam == pytest.approx(127_500.0 * math.exp(-0.42), rel=1e-12)
    assert sky.lux == pytest.approx(800.0 + 15_500.0 * math.sqrt(0.5), rel=1e-12)
    assert sky.illuminance == pytest.approx(0.5 * sky.beam + sky.lux, rel=1e-12)


@pytest.mark.parametrize("altitude", [30.0, 45.0, 60.0, 90.0])
def test_sun_and_sky_agree_with_another_source(altitude: float) -> None:
    """IES RP-21 against Janiczek and DeYoung 1987; the latter is good to 10 %, so is the former."""
    sky = PRESETS["clear-sun"].sky(altitude)
    assert sky.illuminance == pytest.approx(sky_models.sunlit_ground(altitude), rel=0.2)


@pytest.mark.parametrize(("altitude", "lux"), [(60.0, 0.216), (90.0, 0.269)])
def test_moonlight_agrees_with_another_source(altitude: float, lux: float) -> None:
    """Janiczek and DeYoung 1987 for the full moon; Krisciunas and Schaefer give 8 to 23 %."""
    assert PRESETS["moonlit"].sky(altitude).illuminance == pytest.approx(lux, rel=0.23)


def test_the_full_moon_outside_the_air() -> None:
    # Magnitude -12.73, and 2.54e-6 lx of magnitude 0 (Allen 1973, Astrophysical Quantities).
    outside = sky_models.moon_lux(90.0) * 10.0 ** (0.4 * 0.172)
    assert outside == pytest.approx(2.54e-6 * 10.0 ** (0.4 * 12.73), rel=0.01)


def test_the_moonlit_sky_of_the_papers_example() -> None:
    """Krisciunas and Schaefer 1991: the terms of eq. 15 and 21, written out for one direction."""
    # Moon at the zenith, 60 degrees from it: X(60) = (1 - 0.96 * 0.75)^-0.5.
    air = (1.0 - 0.96 * 0.75) ** -0.5
    scatter = 10**5.36 * (1.06 + 0.25) + 10 ** (6.15 - 60.0 / 40.0)
    nanolamberts = (
        scatter * 10 ** (-0.4 * 3.84) * 10 ** (-0.4 * 0.172) * (1.0 - 10 ** (-0.4 * 0.172 * air))
    )
    found = sky_models.moonlit_sky(np.array([0.5]), np.array([0.5]), 90.0)
    assert found[0] == pytest.approx(nanolamberts * 1e-5 / math.pi, rel=1e-12)


def test_the_overcast_zenith() -> None:
    """E = 7 pi Lz / 9 of L = Lz (1 + 2 sin) / 3."""
    sky = PRESETS["overcast-day"].sky(90.0)
    assert sky.picture is not None
    zenith = float(sky.picture[0].mean())
    assert zenith == pytest.approx(9.0 * sky.lux / (7.0 * math.pi), rel=1e-3)
    # A third of it at the horizon; the last row's middle is 0.7 degrees above.
    edge = float(sky.picture[sky.picture.shape[0] // 2 - 1].mean())
    sine = math.sin(math.pi / 256.0)
    assert edge / zenith == pytest.approx((1.0 + 2.0 * sine) / 3.0, rel=1e-3)


def test_the_clear_sky_by_the_standards_formula() -> None:
    """ISO 15469 type 12 in one direction against the zenith, sun at 40 degrees."""

    def indicatrix(angle: float) -> float:
        rest = math.exp(-3.0 * math.pi / 2.0)
        return 1.0 + 10.0 * (math.exp(-3.0 * angle) - rest) + 0.45 * math.cos(angle) ** 2

    def gradation(sine: float) -> float:
        return 1.0 - math.exp(-0.32 / sine)

    angle, sine = math.radians(25.0), math.sin(math.radians(55.0))
    expected = gradation(sine) * indicatrix(angle)
    expected /= gradation(1.0) * indicatrix(math.radians(50.0))
    found = sky_models.clear_sky(np.array([sine]), np.array([math.cos(angle)]), 40.0)
    assert found[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("azimuth", "towards"),
    [(0.0, (0, 0, -1)), (90.0, (1, 0, 0)), (180.0, (0, 0, 1)), (270.0, (-1, 0, 0))],
)
def test_the_sun_stands_where_it_is_said(azimuth: float, towards: tuple[int, int, int]) -> None:
    sky = PRESETS["clear-sun"].sky(30.0, azimuth)
    up = math.sin(math.radians(30.0))
    level = math.cos(math.radians(30.0))
    assert sky.towards == pytest.approx((level * towards[0], up, level * towards[2]), abs=1e-15)
    assert sky.picture is not None
    brightest = np.unravel_index(int(np.argmax(sky.picture)), sky.picture.shape)
    way = texel_directions(*sky.picture.shape)[brightest]
    # Within a texel's diagonal of the sun: the sky is brightest about it.
    assert float(way @ np.array(sky.towards)) > math.cos(math.radians(2.0))


def test_shader_1_shows_the_overcast_skys_lux() -> None:
    """Of (1 + 2 sin) / 3 above the horizon bands 0, 1, 2 and 4 pass 0.9989 of 7 pi / 9.

    |s| = 1/2 + 5/8 P2 - 3/16 P4 ..., sign(s) = 3/2 P1 ..., of which pi, 2 pi / 3, pi / 4 and
    -pi / 24 are passed.
    """
    even = 1 / 6 + (1 / 2 + 5 / 8 / 4 + 3 / 16 / 24) / 3
    passed = (even + (1 / 4 + 1 / 3) * 2 / 3) / (7 / 9)
    sky = PRESETS["overcast-day"].sky()
    assert sky.picture is not None
    coefficients = irradiance_coefficients(np.repeat(sky.picture[..., None], 3, axis=-1))
    lux = sh_polynomials(np.array([0.0, 1.0, 0.0])) @ coefficients
    # The midpoint rule over 128 rows: (pi / 128)^2 / 24 = 3e-5.
    assert lux[0] == pytest.approx(passed * sky.lux, rel=1e-4)


def test_what_shines_in_a_sky_has_its_name() -> None:
    shining = {name: preset.body for name, preset in PRESETS.items() if preset.sky().beam > 0.0}
    assert shining == {"moonlit": "Moon", "clear-sun": "Sun"}
    assert {name for name, preset in PRESETS.items() if preset.body} == set(shining)
