"""Conversions between candela, lux and cd/m2: closed forms and published numbers."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd import units

SIZES = st.floats(1e-4, 1e4)
STRENGTHS = st.floats(1e-6, 1e12)


def test_luminance_weights_are_those_of_rec_709() -> None:
    assert units.LUMINANCE_WEIGHTS == (0.2126, 0.7152, 0.0722)
    assert sum(units.LUMINANCE_WEIGHTS) == pytest.approx(1.0, abs=1e-15)


def test_sphere_of_800_lumen() -> None:
    # Phi = 800 lm, r = 0.03 m: I = Phi / 4 pi = 63.6619772 cd, L = I / (pi r^2) = 22515.8186.
    intensity = 800.0 / (4.0 * math.pi)
    assert intensity == pytest.approx(63.6619772, abs=5e-8)
    assert units.sphere_luminance(intensity, 0.03) == pytest.approx(22515.8186, abs=5e-5)


def test_five_thousand_candela_in_a_lamp_of_five_centimetres() -> None:
    # docs/decisions/0007: 636,620 cd/m2.
    assert units.sphere_luminance(5000.0, 0.05) == pytest.approx(636_620, abs=0.5)


def test_the_suns_disc() -> None:
    # 0.53 degrees across and 1.6e9 cd/m2: about 1e5 lx, and L = E / (pi sin^2(a/2)).
    lux = units.distant_illuminance(1.6e9, 0.53)
    assert lux == pytest.approx(1.6e9 * math.pi * math.sin(math.radians(0.265)) ** 2, rel=1e-15)
    assert 1.0e5 < lux < 1.1e5


def test_half_a_sky_of_disc_is_a_hemisphere() -> None:
    # A disc of 180 degrees is the whole half-space: E = pi L.
    assert units.distant_illuminance(1.0, 180.0) == pytest.approx(math.pi, rel=1e-15)
    assert units.dome_illuminance(1.0) == math.pi


def test_a_disc_of_no_size_is_lux() -> None:
    assert units.distant_luminance(0.25, 0.0) == 0.25
    assert units.distant_illuminance(0.25, 0.0) == 0.25


@given(STRENGTHS, SIZES)
def test_sphere_there_and_back(value: float, radius: float) -> None:
    # 1e-15: five roundings of 1.1e-16.
    back = units.sphere_intensity(units.sphere_luminance(value, radius), radius)
    assert back == pytest.approx(value, rel=1e-15)


@given(STRENGTHS, st.floats(0.0, 180.0))
def test_distant_there_and_back(value: float, angle: float) -> None:
    angle = angle if angle > 1e-6 else 0.0
    back = units.distant_illuminance(units.distant_luminance(value, angle), angle)
    assert back == pytest.approx(value, rel=1e-15)


@given(STRENGTHS)
def test_dome_there_and_back(value: float) -> None:
    assert units.dome_illuminance(units.dome_luminance(value)) == pytest.approx(value, rel=1e-15)
