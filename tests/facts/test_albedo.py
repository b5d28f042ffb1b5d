"""Reflectance: its statistics in closed form, classes by name, doubts and what mends them."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.photometry.albedo import (
    BRIGHTEST,
    CLASSES,
    DARKEST,
    Reflectance,
    doubt,
    inwards,
    reflectance,
    surface_class,
    words,
)


def test_a_uniform_texture_has_the_reflectance_of_its_code() -> None:
    r = (90 / 255.0) ** 2.2 * 0.7
    found = reflectance(np.full((100, 3), r), np.ones(100))
    assert found is not None
    # Rec. 709 weights add up to 1 within the last digits.
    assert found.mean == pytest.approx(r, rel=1e-12)
    assert found.p95 == pytest.approx(r, rel=1e-12)


def test_the_luminance_of_primaries_is_that_of_rec_709() -> None:
    found = reflectance(np.eye(3), np.array([1.0, 0.0, 0.0]))
    assert found is not None
    assert found.mean == pytest.approx(0.2126, abs=5e-5)  # ITU-R BT.709 in four digits


def test_weights_are_areas() -> None:
    grey = np.repeat([[0.1], [0.5]], 3, axis=1)
    found = reflectance(grey, np.array([3.0, 1.0]))
    assert found is not None
    assert found.mean == pytest.approx(0.2)
    assert found.p95 == pytest.approx(0.5)
    assert reflectance(grey, np.zeros(2)) is None


def test_what_is_above_1_counts_as_it_is_written() -> None:
    found = reflectance(np.full((1, 3), 2.0), np.ones(1))
    assert found is not None
    assert found.mean == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("WetRoad_02", ["wet", "road"]),
        ("Straße", ["strasse"]),
        ("Béton-brut.001", ["beton", "brut"]),
        ("GLASSPane", ["glass", "pane"]),
        ("", []),
    ],
)
def test_names_fall_into_words(name: str, said: list[str]) -> None:
    assert words(name) == said


@pytest.mark.parametrize(
    ("names", "name"),
    [
        (["Asphalt"], "asphalt"),
        (["road_wet_03"], "wet asphalt"),
        (["Fahrbahnmarkierung"], "white road marking"),
        (["road_line_yellow"], "yellow road marking"),
        (["Strasse"], "asphalt"),
        (["béton"], "concrete"),
        (["carretera"], "asphalt"),
        (["Schnee"], "snow"),
        (["material_7", "grass01"], "grass"),
        (["car_paint_red"], "car paint"),
        (["human_skin"], "skin"),
        (["street_lamp"], None),
        (["road_sign"], None),
        (["vehicle_skin"], None),
        (["Tissue_Sand"], None),
        (["lamp_07", "grass01"], None),  # the material's name says enough
        (["broad"], None),  # words, not letters
        (["paint"], None),
    ],
)
def test_classes_are_found_by_words(names: list[str], name: str | None) -> None:
    found = surface_class(*names)
    assert (found.name if found else None) == name


def test_ranges_are_physical_and_cited() -> None:
    for surface in CLASSES:
        assert 0.0 <= surface.low < surface.high <= (0.98 if surface.name == "snow" else BRIGHTEST)
        assert surface.citation
    named = [word for surface in CLASSES for word in surface.words]
    assert len(named) == len(set(named))  # no word of two classes
    assert all(word == " ".join(words(word)) for word in named)  # as names are read


ASPHALT = surface_class("asphalt")


@pytest.mark.parametrize("mean", [0.04, 0.1, 0.2])
def test_asphalt_within_its_range_is_not_doubted(mean: float) -> None:
    assert doubt(Reflectance(mean, 0.6), ASPHALT) is None  # lines may be white


@pytest.mark.parametrize(("mean", "bound"), [(0.5, 0.2), (0.025, 0.04)])
def test_the_factor_brings_the_mean_to_the_nearer_bound(mean: float, bound: float) -> None:
    found = doubt(Reflectance(mean, mean), ASPHALT)
    assert found is not None
    assert found.code == "reflectance-range"
    assert found.factor == pytest.approx(bound / mean)
    assert found.decades == pytest.approx(abs(np.log10(bound / mean)))
    assert "Oke" in found.text


@pytest.mark.parametrize(
    ("found", "code"),
    [
        (Reflectance(0.95, 0.95), "reflectance-high"),
        (Reflectance(0.5, 1.0), "reflectance-high"),
        (Reflectance(0.01, 0.01), "reflectance-low"),
        (Reflectance(0.9, 0.9), None),
        (Reflectance(0.02, 0.02), None),
    ],
)
def test_what_has_no_class_is_held_against_what_is_known(
    found: Reflectance, code: str | None
) -> None:
    wrong = doubt(found, None)
    assert (wrong.code if wrong else None) == code


def test_fresh_snow_may_be_brighter_than_all_else() -> None:
    assert doubt(Reflectance(0.95, 0.97), surface_class("snow")) is None


def test_a_mirror_may_be_black() -> None:
    assert doubt(Reflectance(0.0, 0.0), None, dark=True) is None
    black = doubt(Reflectance(0.0, 0.0), None)
    assert black is not None
    assert black.factor is None  # no factor lifts 0
    assert black.low == DARKEST


@pytest.mark.parametrize("factor", [0.4, 0.123456, 2.0, 3.33333])
@pytest.mark.parametrize("value", [1.0, 0.8, 0.01234])
def test_rounding_stays_inside(value: float, factor: float) -> None:
    rounded = inwards(value, factor)
    wanted = value * factor
    assert rounded <= wanted * (1 + 1e-12) if factor < 1 else rounded >= wanted * (1 - 1e-12)
    assert rounded == pytest.approx(wanted, rel=0.01)  # three digits: at most 1 in 100
