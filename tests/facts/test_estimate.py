"""Estimate rules: I = colour att(d_ref) E_ref d_ref^2, with att(d_ref) = 1/2."""

from __future__ import annotations

import math

import pytest
from builders import lamp
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.errors import UnknownNameError
from hdrusd.photometry.estimate import (
    DEFAULT_RULE,
    RULES,
    attenuation,
    reference_distance,
)

NIGHT = RULES["night-20lx"]


def test_attenuation_is_opengls() -> None:
    # k = (1, 0, 0.01), d = 5: 1 / 1.25 = 0.8
    assert attenuation(lamp(attenuation=(1.0, 0.0, 0.01)), 5.0) == pytest.approx(0.8, rel=1e-15)


@pytest.mark.parametrize(
    ("k", "distance"),
    [
        ((1.0, 0.0, 0.01), 10.0),
        ((1.0, 0.1, 0.0), 10.0),
        ((1.0, 1.0, 1.0), (math.sqrt(5) - 1) / 2),
        ((0.0, 0.0, 0.02), 10.0),  # no bound at the lamp: where it is 1/2
        ((0.0, 0.2, 0.0), 10.0),
    ],
)
def test_reference_distance_is_where_half_is_left(
    k: tuple[float, float, float], distance: float
) -> None:
    light = lamp(attenuation=k)
    assert reference_distance(light, 1e6) == pytest.approx(distance, rel=1e-14)
    assert attenuation(light, distance) == pytest.approx(0.5, rel=1e-14)


def test_a_fall_that_hardly_begins_is_cut_at_a_kilometre() -> None:
    assert reference_distance(lamp(attenuation=(1.0, 0.0, 1e-12)), 50.0) == 1000.0
    # Half is left at 1 / k1 with a quadratic part that is lost beside it.
    nearly_linear = lamp(attenuation=(1.0, 0.01, 1e-18))
    assert reference_distance(nearly_linear, 50.0) == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("k", [None, (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
def test_without_a_fall_it_is_a_tenth_of_the_scene(k: tuple[float, float, float] | None) -> None:
    assert reference_distance(lamp(attenuation=k), 300.0) == pytest.approx(30.0, rel=1e-15)
    assert reference_distance(lamp(attenuation=k), 0.0) == 1.0


def test_candela_of_a_street_lamp() -> None:
    # k = (1, 0, 0.01): d = 10 m, att = 1/2; 20 lx there were 20 * 0.5 * 10^2 = 1000 cd.
    light = lamp(attenuation=(1.0, 0.0, 0.01))
    assert NIGHT.strength(light, 500.0) == pytest.approx(1000.0, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "lux"), [("night-20lx", 20.0), ("interior-100lx", 100.0), ("day-10000lx", 1e4)]
)
def test_a_rule_is_what_its_name_says(name: str, lux: float) -> None:
    rule = RULES[name]
    assert rule.name == name
    assert rule.strength(lamp(kind="directional"), 100.0) == lux
    assert rule.luminance == pytest.approx(lux / math.pi, rel=1e-15)  # a white surface under it
    assert rule.lux((0.2, 0.1, 0.0)) == pytest.approx((0.2 * lux, 0.1 * lux, 0.0))


@given(st.tuples(*[st.floats(0.0, 100.0)] * 3), st.floats(0.0, 1e6))
def test_any_attenuation_gives_a_sound_strength(
    k: tuple[float, float, float], diagonal: float
) -> None:
    strength = NIGHT.strength(lamp(attenuation=k), diagonal)
    assert math.isfinite(strength)
    assert strength > 0.0


def test_the_default_exists_and_a_wrong_name_is_helped() -> None:
    assert DEFAULT_RULE in RULES.names()
    with pytest.raises(UnknownNameError, match="did you mean night-20lx"):
        RULES["night-20lux"]
