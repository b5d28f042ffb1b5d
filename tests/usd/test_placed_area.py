"""Areas of faces in the places of their mesh, against the faces as they stand in the world."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from pxr import Gf

import hdrusd.usd.placed_area
from hdrusd.usd.placed_area import PlacedArea, place_kinds, placed_areas

Doubles = npt.NDArray[np.float64]

#: Relative: some ten roundings of float64, of numbers that do not cancel.
CLOSE = 1e-14


def place(axes: npt.ArrayLike) -> Gf.Matrix4d:
    """Three axes, row vectors, somewhere."""
    whole = np.eye(4)
    whole[:3, :3], whole[3, :3] = axes, (3.0, -20.0, 5.0)
    return Gf.Matrix4d(whole.tolist())


def turned(degrees: float) -> Doubles:
    turn = Gf.Matrix3d(Gf.Rotation(Gf.Vec3d(1.0, 2.0, -3.0), degrees))
    return np.array(turn)


def of_one(*axes: npt.ArrayLike, unit: float = 1.0) -> PlacedArea:
    (found,) = placed_areas(place_kinds([place(a) for a in axes], unit), [7] * len(axes)).values()
    return found


def across(edges: Doubles) -> Doubles:
    """Area vectors (n, 3) of parallelograms of two edges each, (n, 2, 3)."""
    return np.cross(edges[:, 0], edges[:, 1])


def test_any_matrix_gives_the_areas_of_the_faces_it_moves() -> None:
    rng = np.random.default_rng(3)
    edges, places = rng.normal(size=(30, 2, 3)), rng.normal(size=(20, 3, 3))
    wanted = sum(np.linalg.norm(across(edges @ one), axis=1) for one in places)
    assert of_one(*places).of(across(edges)) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    ("scale", "areas"),
    [
        ((50.0, 1.0, 50.0), (50.0, 2500.0, 50.0)),
        ((1.0, 10.0, 1.0), (10.0, 1.0, 10.0)),
        ((-2.0, 3.0, 5.0), (15.0, 10.0, 6.0)),
        ((4.0, 5.0, 0.0), (0.0, 0.0, 20.0)),  # flat: a plane in it stays one
        ((1e6, 1e-6, 1.0), (1e-6, 1e6, 1.0)),
        ((7.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_a_scale_of_a_unit_cube(
    scale: tuple[float, float, float], areas: tuple[float, float, float]
) -> None:
    """Of the faces square to x, y and z."""
    for axes in (np.diag(scale), np.diag(scale) @ turned(77.0)):
        found = of_one(axes).of(np.eye(3))
        assert found == pytest.approx(areas, rel=CLOSE if axes[0, 1] == 0.0 else 1e-9, abs=1e-30)


def test_square_metres_are_those_of_the_stage_s_unit() -> None:
    assert of_one(np.eye(3), unit=0.01).of(np.eye(3)) == pytest.approx([1e-4] * 3, rel=CLOSE)


def test_turned_mirrored_and_evenly_scaled_places_are_of_one_kind() -> None:
    uneven = np.diag([1.0, 2.0, 4.0])
    alike = [uneven @ turned(angle) * size for angle, size in ((0, 1), (30, 2), (211, 0.5))]
    alike.append(uneven @ np.diag([1.0, 1.0, -1.0]))
    kinds = place_kinds([place(axes) for axes in alike], 1.0)
    assert kinds.kind.tolist() == [0] * 4
    # Factor times the areas of the faces: (8, 4, 2) times the square of the size.
    rows = np.linalg.norm(kinds.cofactors[0], axis=1)
    assert np.outer(kinds.factor, rows) == pytest.approx(
        np.outer([1.0, 4.0, 0.25, 1.0], [8.0, 4.0, 2.0]), rel=1e-12
    )
    assert len(place_kinds([place(np.eye(3)), place(uneven)], 1.0).cofactors) == 2


def test_meshes_keep_their_places_apart() -> None:
    kinds = place_kinds([place(np.eye(3) * size) for size in (1.0, 2.0, 3.0)], 1.0)
    found = placed_areas(kinds, [5, 2, 5])
    assert {mesh: area.of(np.eye(3)[:1])[0] for mesh, area in found.items()} == {2: 4.0, 5: 10.0}
    assert placed_areas(place_kinds([], 1.0), []) == {}


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e200])
def test_a_place_beyond_all_numbers_has_no_area(wrong: float) -> None:
    assert of_one(np.diag([wrong] * 3), np.eye(3)).of(np.eye(3)).tolist() == [1.0, 1.0, 1.0]


def test_very_many_uneven_places_of_many_faces_are_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    """A face square to x below (1, 1, z), z of 1 to 2 evenly, has 1.5 m2 on average."""
    heights = 1.0 + (np.arange(1000) + 0.5) / 1000
    placed = of_one(*(np.diag([1.0, 1.0, z]) for z in heights))
    faces = np.tile(np.eye(3)[:1], (8, 1))
    assert placed.of(faces) == pytest.approx([1500.0] * 8, rel=1e-12)
    monkeypatch.setattr(hdrusd.usd.placed_area, "_MOST", 800)
    # One of ten stands for its neighbours, which differ by less than 10 / 1000.
    assert placed.of(faces) == pytest.approx([1500.0] * 8, rel=0.01)
