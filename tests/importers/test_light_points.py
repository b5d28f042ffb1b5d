"""Light points of any format: lobes as cones, points of one look as one string."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hdrusd.errors import SourceRef
from hdrusd.importers.light_points import ALL_SIDES, MOST_LOOKS, LightPoints, lobe_cone, strings

HERE = SourceRef(Path("a.flt"))


@pytest.mark.parametrize("angle", [0.01, 5.0, 60.0, 90.0, 150.0, 180.0])
def test_a_round_lobe_is_its_cone(angle: float) -> None:
    assert lobe_cone(angle, angle) == pytest.approx(angle, rel=1e-15)


def test_a_narrow_lobe_has_the_area_of_its_ellipse() -> None:
    """Pi a b = pi c^2 where angles are small; what is left is of the order of their square."""
    for size in (1e-3, 1e-1, 1.0):
        wanted = size * math.sqrt(6.0)
        assert lobe_cone(3.0 * size, 2.0 * size) == pytest.approx(
            wanted, rel=math.radians(3.0 * size) ** 2 + 1e-13
        )


def test_the_cone_has_the_solid_angle_of_the_lobe() -> None:
    """Directions drawn evenly over the sphere: as many in the lobe as in the cone."""
    a, b = math.radians(70.0), math.radians(25.0)
    rng = np.random.default_rng(5)
    count = 4_000_000
    theta = np.arccos(rng.uniform(-1.0, 1.0, count))
    turn = rng.uniform(0.0, 2.0 * np.pi, count)
    inside = theta**2 * ((np.cos(turn) / a) ** 2 + (np.sin(turn) / b) ** 2) < 1.0
    share = float(inside.mean())
    cone = math.radians(lobe_cone(70.0, 25.0))
    # A share p of n draws is known to sqrt(p (1 - p) / n); five of these.
    within = 5.0 * math.sqrt(share * (1.0 - share) / count)
    assert 0.5 * (1.0 - math.cos(cone)) == pytest.approx(share, abs=within)


def test_half_angles_are_within_the_sphere() -> None:
    assert lobe_cone(500.0, 180.0) == 180.0
    assert lobe_cone(90.0, 0.0) == 0.0


def points(colors: np.ndarray, **changes: np.ndarray) -> LightPoints:
    """Points in a row along X."""
    count = len(colors)
    values = {
        "position": np.arange(count)[:, None] * np.array([1.0, 0.0, 0.0]),
        "color": np.asarray(colors, np.float64),
        "intensity": np.ones(count),
        "radius": np.full(count, 0.1),
        "cutoff": np.full(count, ALL_SIDES),
        "inner": np.full(count, ALL_SIDES),
        "direction": np.tile([0.0, 0.0, 1.0], (count, 1)),
        "on": np.ones(count, np.bool_),
    }
    return LightPoints(**values | changes)


def test_points_of_one_look_are_one_string_in_the_order_of_the_file() -> None:
    red, blue = (1, 0, 0), (0, 0, 1)
    made, rounded = strings(
        points(np.array([red, blue, red, blue, red])), "p", HERE, lambda row: {"row": row}
    )
    assert not rounded
    first, second = made
    assert first.positions is not None
    assert second.positions is not None
    assert (first.diffuse, first.positions[:, 0].tolist()) == (red, [0, 2, 4])
    assert (second.diffuse, second.positions[:, 0].tolist()) == (blue, [1, 3])
    assert (first.extras["row"], second.extras["row"]) == (0, 1)
    assert (first.kind, first.lamps, second.lamps) == ("point", 3, 2)


@pytest.mark.parametrize("name", ["intensity", "radius", "cutoff", "on"])
def test_other_looks_are_other_strings(name: str) -> None:
    values = {"intensity": [1, 2], "radius": [0, 1], "cutoff": [20, 180], "on": [True, False]}
    white = np.ones((2, 3))
    made, _ = strings(points(white, **{name: np.array(values[name])}), "p", HERE, lambda _: {})
    assert [light.lamps for light in made] == [1, 1]


def test_many_colours_are_rounded() -> None:
    colors = np.random.default_rng(2).uniform(0.0, 1.0, (5000, 3))
    made, rounded = strings(points(colors), "p", HERE, lambda _: {})
    assert rounded
    assert len(made) <= 5**3
    assert sum(light.lamps for light in made) == 5000
    few, exact = strings(points(colors[:MOST_LOOKS]), "p", HERE, lambda _: {})
    assert (len(few), exact) == (MOST_LOOKS, False)


def test_points_of_other_sizes_each_become_few_lamps() -> None:
    """Two octaves in quarters are at most 9 sizes; what is rounded is off by an eighth at most."""
    rng = np.random.default_rng(3)
    count = 2000
    size = 0.01 * 2.0 ** rng.uniform(0.0, 2.0, count)
    found, rounded = strings(points(np.ones((count, 3)), radius=size), "p", HERE, lambda _: {})
    assert rounded
    assert len(found) <= 10
    assert sum(light.lamps for light in found) == count
    for light in found:
        assert light.positions is not None
        assert light.radius is not None
        row = light.positions[:, 0].astype(int)
        assert np.abs(np.log2(size[row] / light.radius)).max() <= 0.125 + 1e-12


def test_whatever_the_points_are_like_the_lamps_are_few_and_shine() -> None:
    rng = np.random.default_rng(4)
    count = 3000
    wild = 10.0 ** rng.uniform(-30.0, 30.0, (4, count))
    cutoff = rng.uniform(0.1, 180.0, count)
    changes = {"intensity": wild[0], "radius": wild[1], "cutoff": cutoff, "inner": 0.5 * cutoff}
    colors = np.stack([wild[2], wild[3], np.zeros(count)], axis=1)
    found, rounded = strings(points(colors, **changes), "p", HERE, lambda _: {})
    assert rounded
    assert len(found) <= MOST_LOOKS
    assert sum(light.lamps for light in found) == count
    for light in found:
        assert light.kind == "spot"
        assert light.diffuse[0] > 0.0
        assert light.diffuse[2] == 0.0
        assert 0.0 < light.spot_cutoff < ALL_SIDES
