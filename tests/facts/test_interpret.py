"""What legacy lights and materials mean, rule by rule; the decisions say why."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import HERE, lamp, paint
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.errors import SourceRef
from hdrusd.photometry.estimate import RULES
from hdrusd.photometry.interpret import LAMP_RADIUS, Interpreter, luminance
from hdrusd.photometry.light import chromaticity
from hdrusd.photometry.sidecar import Rule
from hdrusd.report import Report

RED_TEMPERATURE, _ = chromaticity((3.0, 0.5, 0.07))


def interpreter(**changes: Any) -> Interpreter:
    values: dict[str, Any] = {
        "estimate": RULES["night-20lx"],
        "diagonal": 100.0,
        "unit": 1.0,
        "temperature": lambda kelvin: RED_TEMPERATURE,
        "report": Report(),
    }
    return Interpreter(**values | changes)


def rule(**values: Any) -> Rule:
    return Rule("light", SourceRef(Path("photometry.toml"), "light[1]"), {"match": "*"} | values)


def test_candela_of_the_file_is_the_lamps() -> None:
    made = interpreter()
    light = made.light(lamp(candela=1000.0), None)
    assert light is not None
    assert (light.kind, light.intensity, light.provenance) == ("point", 1000.0, "authored")
    assert light.chromaticity == pytest.approx((1.0, 1.0, 1.0), rel=1e-15)
    assert made.report.codes() == {"lamp-radius"}


@given(st.tuples(*[st.floats(1e-3, 10.0)] * 3), st.floats(1e-3, 1e6))
def test_colour_times_intensity_is_kept_per_channel(
    color: tuple[float, float, float], candela: float
) -> None:
    light = interpreter().light(lamp(candela=candela, diffuse=color), None)
    assert light is not None
    product = np.multiply(light.chromaticity, light.intensity)
    # 1e-14: the luminance is divided out and multiplied back, six roundings.
    assert product == pytest.approx(candela * np.array(color), rel=1e-14)


def test_a_rule_comes_before_the_file_and_the_file_before_an_estimate() -> None:
    made = interpreter()
    stated = rule(candela=3200, provenance="measured", source="data sheet")
    light = made.light(lamp(candela=1000.0), stated)
    assert light is not None
    assert (light.intensity, light.provenance) == (3200.0, "measured")
    assert (light.rule, light.source) == ("photometry.toml:light[1]", "data sheet")
    light = made.light(lamp(attenuation=(1.0, 0.0, 0.01)), None)
    assert light is not None
    assert light.intensity == pytest.approx(1000.0, rel=1e-12)  # tests/facts/test_estimate.py
    assert (light.provenance, light.rule) == ("estimated", "night-20lx")
    assert {"light-estimate", "light-attenuation"} <= made.report.codes()


def test_an_estimate_counts_the_colours_luminance_once() -> None:
    dim = interpreter().light(lamp(diffuse=(0.5, 0.5, 0.5)), None)
    full = interpreter().light(lamp(), None)
    assert dim is not None
    assert full is not None
    assert full.intensity / dim.intensity == pytest.approx(2.0, rel=1e-14)
    assert dim.chromaticity == pytest.approx(full.chromaticity)


def test_attenuation_counts_in_source_units() -> None:
    # k2 = 0.01 per square foot: half is left at 10 ft = 3.048 m.
    light = interpreter(unit=0.3048).light(lamp(attenuation=(1.0, 0.0, 0.01)), None)
    assert light is not None
    assert light.intensity == pytest.approx(20.0 * 0.5 * 3.048**2, rel=1e-12)


def test_a_stated_colour_replaces_the_hue_and_not_the_strength() -> None:
    light = interpreter().light(
        lamp(candela=100.0, diffuse=(0.0, 1.0, 0.0)), rule(color=[2.0, 0.0, 0.0])
    )
    assert light is not None
    assert light.chromaticity == pytest.approx((1 / 0.2126, 0.0, 0.0), rel=1e-14)
    assert light.intensity == pytest.approx(71.52, rel=1e-14)  # 100 cd times green's luminance
    light = interpreter().light(lamp(candela=100.0), rule(temperature=2000, candela=50))
    assert light is not None
    assert (light.chromaticity, light.intensity) == (RED_TEMPERATURE, 50.0)


def test_lux_are_for_distant_lights_and_candela_for_the_others() -> None:
    made = interpreter()
    sun = made.light(lamp(kind="directional", lux=0.25), None)
    assert sun is not None
    assert (sun.kind, sun.intensity) == ("distant", 0.25)
    assert not made.report.codes()
    for light, wrong in (
        (lamp(kind="directional", lux=0.25), rule(candela=5)),
        (lamp(candela=10.0), rule(illuminance=5)),
        (lamp(kind="ambient"), rule(candela=5)),
    ):
        made = interpreter()
        meaning = made.light(light, wrong)
        assert meaning is not None
        assert meaning.intensity != 5.0
        assert "sidecar-unit" in made.report.codes()


def test_a_cone_with_an_inner_angle_gets_usd_softness() -> None:
    # Full to 20 degrees, nothing from 40: softness = 1 - 20 / 40.
    light = interpreter().light(
        lamp(kind="spot", candela=30_000.0, spot_cutoff=40.0, spot_inner=20.0), None
    )
    assert light is not None
    assert (light.kind, light.cutoff, light.softness) == ("spot", 40.0, 0.5)


def test_opengls_cone_is_hard_and_its_exponent_is_the_focus() -> None:
    light = interpreter().light(lamp(kind="spot", spot_cutoff=60.0, spot_exponent=2.0), None)
    assert light is not None
    assert (light.cutoff, light.softness, light.exponent) == (60.0, 0.0, 2.0)


def test_a_spot_that_shines_all_around_is_a_point() -> None:
    light = interpreter().light(lamp(kind="spot"), None)
    assert light is not None
    assert light.kind == "point"


def test_a_distant_light_has_no_cone() -> None:
    made = interpreter()
    light = made.light(lamp(kind="directional", lux=1.0, spot_cutoff=30.0, spot_exponent=4.0), None)
    assert light is not None
    assert (light.kind, light.cutoff, light.exponent) == ("distant", 180.0, 0.0)
    assert "light-cone" in made.report.codes()


@pytest.mark.parametrize(
    ("light", "stated", "code"),
    [
        (lamp(enabled=False), None, "light-off"),
        (lamp(), rule(enabled=False, candela=5), "light-off"),
        (lamp(diffuse=(0.0, 0.0, 0.0)), None, "light-dark"),
        (lamp(), rule(candela=0), "light-dark"),
        (lamp(candela=-5.0), None, "light-dark"),
        (lamp(diffuse=(-1.0, -1.0, -1.0)), None, "light-dark"),
        (lamp(kind="ambient", diffuse=(0.0, 0.0, 0.0)), None, "light-dark"),
        (lamp(candela=math.inf), None, "light-intensity"),
        (lamp(candela=math.nan), None, "light-intensity"),
        (lamp(candela=3e38), None, "light-intensity"),  # its luminance would be 4e40 cd/m2
    ],
)
def test_what_gives_no_light_is_not_written(light: Any, stated: Any, code: str) -> None:
    made = interpreter()
    assert made.light(light, stated) is None
    assert code in made.report.codes()


def test_a_light_can_be_switched_on() -> None:
    light = interpreter().light(lamp(enabled=False), rule(enabled=True, candela=5))
    assert light is not None
    assert light.intensity == 5.0


def test_a_negative_channel_takes_no_light_away() -> None:
    made = interpreter()
    light = made.light(lamp(candela=10.0, diffuse=(1.0, -1.0, 0.0)), None)
    assert light is not None
    assert min(light.chromaticity) == 0.0
    assert light.intensity == pytest.approx(2.126, rel=1e-14)
    assert "light-negative" in made.report.codes()


def test_the_lamps_size() -> None:
    made = interpreter()
    light = made.light(lamp(candela=1.0), rule(radius=0.2))
    assert light is not None
    assert light.radius == 0.2
    assert not made.report.codes()
    light = made.light(lamp(candela=1.0), None)
    assert light is not None
    assert light.radius == LAMP_RADIUS
    assert made.report.codes() == {"lamp-radius"}


@pytest.mark.parametrize(
    ("light", "code"),
    [
        (lamp(candela=1.0, range=25.0), "light-range"),
        (lamp(attenuation=(1.0, 0.1, 0.0)), "light-attenuation"),
        (lamp(ambient=(0.1, 0.1, 0.1)), "light-ambient"),
        (lamp(kind="directional", ambient=(0.1, 0.1, 0.1)), "light-ambient"),
        (lamp(specular=(0.1, 0.1, 0.1)), "light-specular"),
        (lamp(candela=1.0, kind="spot", spot_cutoff=40.0, spot_inner=0.0), "spot-edge"),
    ],
)
def test_what_has_no_home_is_said(light: Any, code: str) -> None:
    made = interpreter()
    made.light(light, None)
    (finding,) = [finding for finding in made.report if finding.code == code]
    assert (finding.source, finding.thing) == (HERE, "lamp_07")


def test_an_inverse_square_is_kept_without_a_word() -> None:
    made = interpreter()
    made.light(lamp(candela=1.0, attenuation=(0.0, 0.0, 1.0)), None)
    assert "light-attenuation" not in made.report.codes()


def test_ambient_light_is_the_skys() -> None:
    made = interpreter()
    light = made.light(lamp(kind="ambient", ambient=(0.1, 0.1, 0.2), diffuse=(0, 0, 0)), None)
    assert light is not None
    # 20 lx for 1.0, times 0.1 (0.2126 + 0.7152) + 0.2 0.0722
    assert (light.kind, light.intensity) == ("ambient", pytest.approx(20.0 * 0.10722, rel=1e-14))
    assert made.report.codes() == {"ambient-estimate"}
    light = made.light(lamp(kind="ambient"), rule(illuminance=0.3, source="meter"))
    assert light is not None
    assert (light.intensity, light.source, light.provenance) == (0.3, "meter", "authored")


def test_a_rule_states_what_rods_see_of_a_lamp() -> None:
    made = interpreter()
    for stated, sp in (({"sp_ratio": 0.62}, 0.62), ({"illuminant": "HP1"}, 0.56), ({}, 0.0)):
        light = made.light(lamp(candela=1.0), rule(**stated))
        assert light is not None
        assert light.sp == sp
    assert "light-scotopic" not in made.report.codes()
    sky = made.light(lamp(kind="ambient"), rule(illuminance=0.3, sp_ratio=2.0))
    assert sky is not None
    assert sky.sp == 0.0
    assert "light-scotopic" in made.report.codes()


# -- emission -----------------------------------------------------------------------------


def test_emission_in_cd_m2_is_taken_as_it_stands() -> None:
    glow = paint(emission=(20_000.0, 10_000.0, 0.0), emission_cd_m2=True)
    assert interpreter().emission(glow, None)[:2] == ((20_000.0, 10_000.0, 0.0), "authored")


def test_emission_of_one_is_a_white_surface_under_the_reference() -> None:
    made = interpreter()
    rgb, provenance, name, _ = made.emission(paint(emission=(1.0, 1.0, 1.0)), None)
    assert rgb == pytest.approx([20.0 / math.pi] * 3, rel=1e-15)
    assert (provenance, name) == ("estimated", "night-20lx")
    assert made.report.codes() == {"emission-estimate"}


@pytest.mark.parametrize(
    ("material", "stated", "hue"),
    [
        (paint(), rule(luminance=500, color=[0, 1, 0]), (0.0, 1.0, 0.0)),
        (paint(), rule(luminance=500, temperature=2000), RED_TEMPERATURE),
        (paint(emission=(0.2, 0.0, 0.0)), rule(luminance=500), (1.0, 0.0, 0.0)),
        (paint(diffuse=(0.0, 0.0, 0.3)), rule(luminance=500), (0.0, 0.0, 1.0)),
        (paint(diffuse=(0.0, 0.0, 0.3)), rule(luminance=500, hdr_texture=True), (1.0, 1.0, 1.0)),
        (paint(diffuse=(0.0, 0.0, 0.0)), rule(luminance=500), (1.0, 1.0, 1.0)),
    ],
)
def test_a_stated_luminance_is_the_luminance(
    material: Any, stated: Rule, hue: tuple[float, float, float]
) -> None:
    rgb, provenance, name, _ = interpreter().emission(material, stated)
    wanted = np.array(hue) / luminance(hue) * 500.0
    assert rgb == pytest.approx(tuple(wanted), rel=1e-12)
    assert luminance(rgb) == pytest.approx(500.0, rel=1e-12)
    assert (provenance, name) == ("authored", "photometry.toml:light[1]")


def test_no_emission_is_none() -> None:
    made = interpreter()
    assert made.emission(paint(), None)[0] == (0.0, 0.0, 0.0)
    assert made.emission(paint(emission=(-1.0, -2.0, 0.0)), None)[0] == (0.0, 0.0, 0.0)
    assert made.report.codes() == {"light-negative"}
