"""Which meshes hold a lamp: rays against closed forms, and shapes whose answer is plain."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hdrusd.photometry.fixture import (
    NEAR,
    Stopped,
    area,
    distances,
    fixtures,
    lamp_rays,
    stopped,
)
from hdrusd.photometry.light import PhotometricLight

Floats = npt.NDArray[np.float64]

DOWN = np.array([0.0, 0.0, -1.0])
POINT = PhotometricLight("point", 100.0)
RAYS = lamp_rays(POINT, DOWN)


def spot(cutoff: float, exponent: float = 0.0) -> PhotometricLight:
    return PhotometricLight("spot", 100.0, cutoff=cutoff, exponent=exponent)


def box(low: Any, high: Any, *, without: str = "") -> Floats:
    """(t, 3, 3) the sides of a box but those named: "x" is that of the lowest x, "X" the other."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    sides = []
    for axis, name in enumerate("xyz"):
        for end, letter in ((low, name), (high, name.upper())):
            if letter not in without:
                corner = np.array([low, low, high, high])
                corner[:, (axis + 2) % 3] = [low[(axis + 2) % 3], high[(axis + 2) % 3]] * 2
                corner[:, axis] = end[axis]
                sides += [corner[[0, 1, 2]], corner[[1, 3, 2]]]
    return np.array(sides)


def cube(half: float) -> Floats:
    return box([-half] * 3, [half] * 3)


def held(*meshes: Floats, light: PhotometricLight = POINT, axis: Floats = DOWN) -> list[int]:
    rays = lamp_rays(light, axis)
    return fixtures([stopped(mesh, rays, light.radius) for mesh in meshes], rays)


# -- rays ---------------------------------------------------------------------------------


def test_rays_end_on_a_box_where_they_leave_it() -> None:
    half = np.array([0.3, 0.5, 2.0])
    middle = np.array([0.1, -0.2, 1.5])
    found = distances(box(middle - half, middle + half), RAYS.round, 0.0)
    planes = np.where(RAYS.round > 0.0, middle + half, middle - half)
    assert found == pytest.approx(np.min(planes / RAYS.round, axis=1), rel=1e-9)


def test_small_triangles_stop_what_large_ones_do() -> None:
    """A side cut into 2 x 40^2 triangles, most of which are tried with few rays."""
    steps = np.linspace(-1.0, 1.0, 41)
    x, y = (grid.ravel() for grid in np.meshgrid(steps[:-1], steps[:-1]))
    width = steps[1] - steps[0]
    corner = np.stack([x, y, np.full(x.shape, -0.4)], axis=1)
    one, two = np.array([width, 0, 0]), np.array([0, width, 0])
    fine = np.concatenate(
        [
            np.stack([corner, corner + one, corner + two], axis=1),
            np.stack([corner + one, corner + two, corner + one + two], axis=1),
        ]
    )
    coarse = box((-1, -1, -0.4), (1, 1, 0), without="xXyYZ")
    found = distances(fine, RAYS.round, 0.0)
    assert np.array_equal(np.isfinite(found), np.isfinite(distances(coarse, RAYS.round, 0.0)))
    # Solid angle of a square of half side a seen square from d: 4 atan(a^2 / (d sqrt(2a^2+d^2))).
    solid = 4.0 * math.atan(1.0 / (0.4 * math.sqrt(2.16)))
    # 512 rays: one in 512 for each that lies beside the edge of 64 cells, and fewer do.
    assert np.isfinite(found).mean() == pytest.approx(solid / (4.0 * math.pi), abs=5 / 512)


def test_what_is_nearer_than_the_radius_stops_nothing() -> None:
    assert np.isinf(distances(cube(0.02), RAYS.round, 0.05)).all()
    both = np.concatenate([cube(0.02), cube(0.3)])
    assert distances(both, RAYS.round, 0.05).min() == pytest.approx(0.3, rel=1e-2)


def test_triangles_through_the_lamp_and_without_extent() -> None:
    through = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 1, 1]] * 3], float)
    assert np.isinf(distances(through, RAYS.round, 0.0)).all()


@pytest.mark.parametrize("light", [spot(30.0), spot(30.0, 40.0), spot(180.0, 3.0)])
def test_rays_of_a_beam_lie_in_it(light: PhotometricLight) -> None:
    axis = np.array([0.6, 0.0, -0.8])
    rays = lamp_rays(light, axis)
    cosine = rays.beam @ axis
    assert cosine.min() >= math.cos(math.radians(min(light.cutoff, 90.0))) - 1e-12
    assert np.linalg.norm(rays.beam, axis=1) == pytest.approx(1.0)
    assert rays.weight.sum() == pytest.approx(1.0)
    # Mean cosine over a cap of least cosine c under cos^e: (e+1)/(e+2) (1-c^(e+2))/(1-c^(e+1)).
    c, e = math.cos(math.radians(min(light.cutoff, 90.0))), light.exponent
    mean = (e + 1) / (e + 2) * (1 - c ** (e + 2)) / (1 - c ** (e + 1))
    assert rays.weight @ cosine == pytest.approx(mean, rel=1e-3)


def test_a_photometric_file_shines_all_round() -> None:
    rays = lamp_rays(PhotometricLight("spot", 1.0, cutoff=20.0, profile="a.ies"), DOWN)
    assert rays.beam is rays.round


def test_area() -> None:
    assert area(box((0, 0, 0), (1, 2, 3))) == pytest.approx(22.0)


# -- what holds a lamp --------------------------------------------------------------------


def test_a_closed_housing_does() -> None:
    assert held(cube(0.3)) == [0]
    assert held(cube(0.3), light=spot(20.0)) == [0]
    assert held(cube(0.3) + np.array([0.0, 0.0, 0.25])) == [0]


def test_a_pole_open_on_top_does() -> None:
    pole = box((-0.1, -0.1, -7.9), (0.1, 0.1, 0.1), without="zZ")
    assert held(pole) == [0]
    assert held(pole, light=spot(70.0)) == [0]
    assert held(pole, light=spot(12.0)) == [0]


def test_a_room_does_not() -> None:
    """Not even beneath its ceiling and in its corner."""
    room = box((-2, -1.5, -2.4), (2, 1.5, 0.1))
    assert held(room) == []
    for gap in (0.06, 0.1, 0.3):
        assert held(room - [-2.0 + gap, -1.5 + gap, 0.1 - gap]) == []


def test_panes_and_a_roof_do_together() -> None:
    whole = cube(0.25)
    assert held(*whole.reshape(6, 2, 3, 3)) == [0, 1, 2, 3, 4, 5]
    assert held(*whole.reshape(6, 2, 3, 3)[:4]) == []
    # What stands beside a closed lantern is not of it.
    bollard = box((0.4, -0.1, -0.2), (0.5, 0.1, 0.2))
    assert held(bollard, whole) == [1]


def test_walls_and_ceiling_of_a_corner_do_not() -> None:
    """Panels of 2 m, 6 cm from the lamp: they stop 7/8 of all directions at most."""
    panels = box((-0.06, -0.06, -1.9), (1.9, 1.9, 0.06)).reshape(6, 2, 3, 3)
    assert held(panels[0], panels[2], panels[5]) == []


def test_a_wall_that_a_lamp_shines_on_does_not() -> None:
    wall = box((-1, -1, -0.2), (1, 1, -0.1))
    assert stopped(wall, lamp_rays(spot(30.0), DOWN), 0.05).beam.all()
    assert held(wall, light=spot(30.0)) == []


def test_a_can_that_lets_the_beam_out_does_not() -> None:
    can = box((-0.1, -0.1, -0.15), (0.1, 0.1, 0.1), without="z")
    assert held(can, light=spot(25.0)) == []
    assert held(can, light=spot(25.0), axis=-DOWN) == [0]


def test_a_shade_open_above_and_below_does_not() -> None:
    shade = box((-0.15, -0.15, -0.12), (0.15, 0.15, 0.12), without="zZ")
    assert held(shade) == []


def test_a_box_is_near() -> None:
    half = NEAR * 1.2
    assert not stopped(cube(half), RAYS, 0.05).near.any()
    assert held(cube(half)) == []


def test_nothing_holds_nothing() -> None:
    assert fixtures([], RAYS) == []
    none = np.zeros(512, np.bool_)
    assert fixtures([Stopped(none, none, none)], RAYS) == []
