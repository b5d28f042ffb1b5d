"""Lamps by type and class: against published lamps, curves and rules."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from hdrusd.photometry.lamp_classes import BY_NAME, LAMP_CLASSES, LampClass, lamp_class
from hdrusd.photometry.lamp_types import LAMP_TYPES
from hdrusd.photometry.recipe_keys import KEYS
from hdrusd.photometry.sky_presets import PRESETS


@pytest.mark.parametrize("name", LAMP_TYPES)
def test_what_is_typical_is_in_the_range(name: str) -> None:
    lamp = LAMP_TYPES[name]
    for watts in (1.0, 50.0, 70.0, 100.0, 150.0, 250.0, 400.0, 1000.0):
        assert lamp.least <= lamp.efficacy(watts) <= lamp.most
    assert lamp.source
    assert (lamp.temperature is None) == (lamp.color is not None)
    assert 0.2 < lamp.sp() < 2.5


@pytest.mark.parametrize(
    ("name", "watts", "lumens", "within"),
    [
        # GE Lucalox, data sheet: rated lm/W of the brightest at each power.
        ("high-pressure-sodium", 70.0, 70.0 * 91.0, 0.04),
        ("high-pressure-sodium", 100.0, 100.0 * 100.0, 0.04),
        ("high-pressure-sodium", 150.0, 150.0 * 110.0, 0.04),
        ("high-pressure-sodium", 250.0, 250.0 * 129.0, 0.04),
        ("high-pressure-sodium", 400.0, 400.0 * 135.0, 0.04),
        # UN Regulation 37, H7: 1500 lm, 58 W at most; UN Regulation 99, D2S: 3200 lm, 35 W.
        ("halogen-vehicle", 58.0, 1500.0, 0.01),
        ("xenon-vehicle", 35.0, 3200.0, 0.01),
        # Regulation (EC) 244/2009, annex II: 806 lm stand for 60 W.
        ("incandescent", 60.0, 806.0, 0.05),
    ],
)
def test_lumens_of_known_lamps(name: str, watts: float, lumens: float, within: float) -> None:
    assert watts * LAMP_TYPES[name].efficacy(watts) == pytest.approx(lumens, rel=within)


def test_sp_of_the_sodium_lines() -> None:
    # CIE 1924 and 1951 at 585 and 590 nm, logarithmically between.
    photopic = 0.8163 * (0.7570 / 0.8163) ** (4.3 / 5.0)
    scotopic = 0.0899 * (0.0655 / 0.0899) ** (4.3 / 5.0)
    expected = 1700.0 * scotopic / (683.0 * photopic)
    assert LAMP_TYPES["low-pressure-sodium"].sp() == pytest.approx(expected, rel=0.03)


def test_the_colour_of_the_sodium_lines() -> None:
    # x, y of 589.3 nm in CIE 1931, between 589 and 590 nm of its table, to linear Rec. 709
    # (IEC 61966-2-1, D65) of Y = 1.
    x, y = 0.5710, 0.4283
    big_x, big_z = x / y, (1.0 - x - y) / y
    red = 3.2406 * big_x - 1.5372 - 0.4986 * big_z
    green = -0.9689 * big_x + 1.8758 + 0.0415 * big_z
    color = LAMP_TYPES["low-pressure-sodium"].color
    assert color is not None
    assert color[:2] == pytest.approx((red, green), rel=0.02)
    assert color[2] == 0.0


def test_sp_follows_the_colour_temperature() -> None:
    led = LAMP_TYPES["led"]
    assert led.sp(2733.0) == 1.21  # LED-B1
    assert led.sp(6598.0) == 2.18  # LED-B5
    assert led.sp((2998.0 + 4103.0) / 2.0) == pytest.approx((1.33 + 1.72) / 2.0)
    assert led.sp(1000.0) == 1.21
    assert led.sp(10_000.0) == 2.18
    assert LAMP_TYPES["high-pressure-sodium"].sp() == 0.56


@pytest.mark.parametrize("lamp", LAMP_CLASSES, ids=lambda lamp: lamp.name)
def test_classes_are_entries_of_a_photometry_file(lamp: LampClass) -> None:
    assert 0.0 < lamp.least <= lamp.typical <= lamp.most
    section = "material" if lamp.key == "luminance" else "light"
    assert lamp.key in KEYS[section]
    assert not lamp.lamp or lamp.lamp in LAMP_TYPES
    assert not (lamp.lamp and lamp.color)
    assert lamp.source


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Car_Headlights_L", "low-beam"),
        ("HighBeam-02", "high-beam"),
        ("StreetLight.013", "street-light"),
        ("Straßenlaterne", "street-light"),
        ("brake_light_left", "stop"),
        ("TrafficLight_Red", "traffic-signal"),
        ("TableTop", None),
        ("", None),
    ],
)
def test_names_tell_of_classes(name: str, found: str | None) -> None:
    made = lamp_class(name)
    assert (made and made.name) == found


def test_the_tubes_luminance_is_its_lumens_over_its_surface() -> None:
    surface = math.pi * 0.026 * 1.2
    tube = BY_NAME["fluorescent-tube"]
    assert tube.typical == pytest.approx(3350.0 / (math.pi * surface), rel=0.01)


def test_the_documents_table_is_this_one() -> None:
    text = (Path(__file__).parents[2] / "docs" / "concept-mapping.md").read_text(encoding="utf-8")
    for lamp in LAMP_TYPES.values():
        kelvin = "-" if lamp.temperature is None else f"{lamp.temperature:g}"
        first, last = lamp.steps[0][1], lamp.steps[-1][1]
        efficacy = f"{first:g}" if first == last else f"{first:g} to {last:g}"
        usual = f"{lamp.least:g} to {lamp.most:g}"
        assert f"| `{lamp.name}` | {efficacy} | {usual} | {kelvin} | {lamp.sp():.2f} |" in text
    for preset in PRESETS.values():
        assert f"| `{preset.name}` | {preset.text} | " in text
