"""From a luminaire to an even grid, to the atlas, to the candela of a direction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from photometric_files import ies, ies_text

from hdrusd.errors import ParameterError
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.photometry.profile import (
    ATLAS_WIDTH,
    MOST_ANGLES,
    MOST_PLANES,
    RESAMPLED,
    even_profile,
    pack_profiles,
    profile_angles,
    profile_candela,
)
from hdrusd.scene import Profile


def direction(first: float, second: float, type: str) -> np.ndarray:
    """Unit vectors toward C = 0, toward C = 90 and along the axis, of angles in degrees.

    C: LM-63's (sin g cos C, sin g sin C, -cos g) with the axis down. A and B: right, up and
    ahead as the standard's figures have them, A turning about the vertical first, B about
    the horizontal.
    """
    p, a = math.radians(first), math.radians(second)
    if type == "C":
        return np.array([math.sin(a) * math.cos(p), math.sin(a) * math.sin(p), math.cos(a)])
    if type == "A":
        return np.array([math.cos(a) * math.sin(p), math.sin(a), math.cos(a) * math.cos(p)])
    return np.array([math.sin(p), math.cos(p) * math.sin(a), math.cos(p) * math.cos(a)])


def candela(profile: Profile, first: float, second: float) -> float:
    atlas, places = pack_profiles([profile])
    place, grid = places[0].astype(np.float64)
    return float(profile_candela(atlas, place, grid, direction(first, second, profile.type)))


@pytest.mark.parametrize(
    ("type", "vector", "angles"),
    [
        ("C", (0, 0, 1), (None, 0)),
        ("C", (1, 0, 0), (0, 90)),
        ("C", (0, 1, 0), (90, 90)),
        ("C", (-1, 0, 0), (180, 90)),
        ("C", (0, -1, 0), (-90, 90)),
        ("C", (0, 0, -1), (None, 180)),
        ("A", (0, 0, 1), (0, 0)),
        ("A", (1, 0, 0), (90, 0)),
        ("A", (0, 1, 0), (None, 90)),
        ("A", (0, -1, 0), (None, -90)),
        ("A", (0, 0, -1), (180, 0)),
        ("B", (0, 0, 1), (0, 0)),
        ("B", (1, 0, 0), (90, None)),
        ("B", (0, 1, 0), (0, 90)),
        ("B", (0, -1, 0), (0, -90)),
        ("B", (0, 0, -1), (0, 180)),
    ],
)
def test_angles_of_the_axes(
    type: str, vector: tuple[float, ...], angles: tuple[float | None, float | None]
) -> None:
    got = np.degrees(profile_angles(np.array(vector, float), np.array("CAB".index(type))))
    for one, wanted in zip(got, angles, strict=True):
        assert wanted is None or one == pytest.approx(wanted)


@pytest.mark.parametrize("type", ["C", "A", "B"])
@given(first=st.floats(-80.0, 80.0), second=st.floats(1.0, 80.0))
def test_angles_undo_directions(type: str, first: float, second: float) -> None:
    got = profile_angles(direction(first, second, type), np.array("CAB".index(type)))
    assert np.degrees(got) == pytest.approx([first, second], abs=1e-9)


def test_types_a_and_b_part_off_the_axes() -> None:
    # 45 degrees right and up of A is the direction (1/2, 1/sqrt 2, 1/2): of B, H is 30 degrees
    # and V is atan(sqrt 2).
    got = np.degrees(profile_angles(direction(45.0, 45.0, "A"), np.array(2)))
    assert got == pytest.approx([30.0, math.degrees(math.atan(math.sqrt(2.0)))])


EVEN = {
    "quadrant": ies_text(),
    "rotation": ies_text([400, 300, 20], planes=(0,), angles=(0, 30, 90)),
    "half": ies_text(np.arange(12) ** 2, planes=(0, 10, 100, 180), angles=(0, 12.5, 90)),
    "turned half": ies_text(np.arange(12) ** 2, planes=(90, 100, 190, 270), angles=(0, 45, 180)),
    "upward": ies_text(np.arange(8) ** 2, planes=(0, 90, 180, 270), angles=(90, 180)),
    "A": ies_text(np.arange(9) ** 2, planes=(-30, 0, 15), angles=(-20, 0, 5), type="A"),
    "B": ies_text(np.arange(9) ** 2, planes=(0, 7.5, 15), angles=(-20, 0, 5), type="B"),
}


@pytest.mark.parametrize("name", EVEN)
@given(first=st.floats(-89.9, 359.9), second=st.floats(-89.9, 179.9))
def test_the_grid_is_the_file(name: str, first: float, second: float) -> None:
    lamp = ies(EVEN[name])
    profile, lost = even_profile(lamp)
    assert lost == 0.0
    if lamp.type != "C":
        first = first % 180.0 - 90.0
    elif second < 0.0:
        second = -second
    wanted = float(lamp.value(first, second))
    planes, _ = lamp.unfolded()
    if near(first, planes[[0, -1]]) or near(second, lamp.angles[[0, -1]]):
        return  # a step from something to nothing
    # Candela and the grid's steps are 32 bits: two roundings of up to 96 cells of a degree.
    assert candela(profile, first, second) == pytest.approx(wanted, abs=2e-5 * lamp.candela.max())


def near(angle: float, ends: np.ndarray) -> bool:
    return bool(np.abs(angle - ends).min() < 0.1)


def test_grid_sizes() -> None:
    profile, _ = even_profile(ies(EVEN["half"]), "half.ies")
    assert profile.candela.shape == (37, 37)  # steps of 10 degrees all round, and of 2.5
    assert profile.planes == (0.0, pytest.approx(2 * math.pi))
    assert profile.angles == (0.0, pytest.approx(math.pi / 2))
    assert (profile.type, profile.source) == ("C", "half.ies")


def uneven(angles: list[float]) -> Luminaire:
    cosines = 1000.0 * np.cos(np.radians(angles)) ** 4
    return ies(ies_text(cosines, planes=(0,), angles=angles))


def test_angles_without_a_step_are_resampled_and_the_loss_is_stated() -> None:
    angles = [0.0, *sorted(np.random.default_rng(5).uniform(0.1, 89.9, 40)), 90.0]
    lamp = uneven(angles)
    profile, lost = even_profile(lamp)
    assert 0.0 < lost <= RESAMPLED * 1000.0
    assert profile.candela.shape[1] <= MOST_ANGLES
    for angle in np.linspace(0.01, 89.99, 997):
        difference = abs(candela(profile, 0.0, angle) - float(lamp.value(0.0, angle)))
        assert difference <= lost + 0.01


def test_even_angles_that_the_file_rounds_stay_as_many() -> None:
    profile, lost = even_profile(uneven([round(90.0 / 7.0 * i, 1) for i in range(8)]))
    assert profile.candela.shape[1] <= 15
    assert 0.0 < lost <= 1.0


def test_a_fine_grid_is_bounded() -> None:
    angles = [*np.linspace(0.0, 1.0, 4000), 180.0]
    planes = [*np.linspace(0.0, 89.0, 500), 90.0]
    rows = np.random.default_rng(0).integers(0, 999, (501, 4001))
    profile, lost = even_profile(ies(ies_text(rows, planes=planes, angles=angles)))
    assert profile.candela.shape <= (MOST_PLANES, MOST_ANGLES)
    assert 0.0 < lost < 3000.0


def test_an_atlas_of_several() -> None:
    profiles = [even_profile(ies(text))[0] for text in EVEN.values()]
    profiles.append(Profile(profiles[0].candela, profiles[0].planes, (0.0, 0.5)))
    atlas, places = pack_profiles(profiles)
    assert atlas.shape == (math.ceil(places[-2, 0, 0] / ATLAS_WIDTH), ATLAS_WIDTH, 4)
    assert np.array_equal(places[-1, 0], places[0, 0])  # the same candela are kept once
    for profile, (place, grid) in zip(profiles, places.astype(np.float64), strict=True):
        lone, (at,) = pack_profiles([profile])
        vectors = np.random.default_rng(1).normal(size=(500, 3))
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
        got = profile_candela(atlas, place, grid, vectors)
        assert np.array_equal(got, profile_candela(lone, at[0], at[1].astype(np.float64), vectors))
    assert pack_profiles([])[0].shape == (1, ATLAS_WIDTH, 4)


def test_a_lone_value_shines_all_round() -> None:
    profile = Profile(np.full((1, 2), 7.0, np.float32), (0.0, 2 * math.pi), (0.0, math.pi))
    assert [candela(profile, c, g) for c, g in ((0, 0), (270, 90), (10, 180))] == [7.0] * 3


def test_too_many_cells_are_refused() -> None:
    grids = [np.broadcast_to(np.float32(1.0), (1441, 721)) for _ in range(5)]
    profiles = [Profile(grid, (0.0, 1.0), (0.0, 1.0)) for grid in grids]
    with pytest.raises(ParameterError, match="want at most 4194304"):
        pack_profiles(profiles)
