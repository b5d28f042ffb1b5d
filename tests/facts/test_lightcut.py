"""Far lamps seen as one: the bound against brute force, the trees, what must not merge."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.photometry import lightcut
from hdrusd.photometry.light import cone_factor, focus_factor, inverse_edge
from hdrusd.photometry.lightcut import EPSILON, LOBE_SHARE, Tiles, cut
from hdrusd.photometry.lighttree import LightTree, build_tree, may_merge, merged_lights
from hdrusd.scene import RECT, SPHERE, light_rows

Array = Any
EYE = np.array([1000.0, -2000.0, 30.0])


def at(*offset: Any) -> Array:
    """A place relative to the eye, or several."""
    return EYE + np.array(offset)


def table_of(tree: LightTree, lights: Array) -> Array:
    return np.concatenate([lights, merged_lights(tree, lights)])


def tiles(centre: Array, radius: Array, lobe: float | Array = math.inf) -> Tiles:
    """Balls about ``centre``, in the world, seen from EYE."""
    way = np.atleast_2d(np.asarray(centre, np.float64)) - EYE
    far = np.linalg.norm(way, axis=1, keepdims=True)
    ones = np.ones(len(way), np.float32)
    return Tiles(
        centre=way.astype(np.float32),
        radius=(ones * radius).astype(np.float32),
        lobe=(ones * lobe).astype(np.float32),
        toward_eye=(-way / np.maximum(far, 1e-9)).astype(np.float32),
    )


def fields(lights: Array, x: Array) -> Array:
    """(m, n, 3) vectors from points (m, 3) towards n lights, 1/m2: beam / d^2 long."""
    way = lights["position"] - x[:, None]
    d2 = np.sum(way**2, axis=-1)
    unit = way / np.sqrt(d2)[..., None]
    cosine = -np.sum(unit * lights["axis"], axis=-1)
    beam = cone_factor(cosine, lights["inner"], inverse_edge(lights["inner"], lights["outer"]))
    beam = beam * focus_factor(cosine, lights["exponent"])
    size = beam * np.minimum(1.0 / d2, 1.0 / np.maximum(lights["radius"], 1e-9) ** 2)
    return unit * size[..., None]


def illuminances(lights: Array, x: Array, normal: Array) -> Array:
    """(m, 3) lx."""
    cosines = np.einsum("mnk,mk->mn", fields(lights, x), normal)
    return np.maximum(cosines, 0.0) @ lights["intensity"]


def scalar_illuminances(lights: Array, x: Array) -> Array:
    """(m,) lx: what each lamp gives a plane that faces it, by its strongest channel."""
    return np.linalg.norm(fields(lights, x), axis=-1) @ lights["intensity"].max(axis=1)


def unit_vectors(rng: Any, *shape: int) -> Array:
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def points_of(rng: Any, centre: Array, radius: float, count: int) -> Array:
    """Points of a ball, half of them on its surface."""
    depth = np.where(np.arange(count) % 2, 1.0, rng.uniform(0, 1, count) ** (1 / 3))
    return centre + radius * depth[:, None] * unit_vectors(rng, count)


def lamps(rng: Any, count: int, spread: float = 60.0, **fields: Any) -> Array:
    rows = light_rows(count)
    rows["position"] = EYE + rng.uniform(-spread, spread, (count, 3)) * (1.0, 1.0, 0.15)
    rows["intensity"] = rng.lognormal(7.0, 1.0, (count, 1)) * (1.0, 0.72, 0.42)
    rows["radius"], rows["shadow"] = 0.05, 0
    for name, value in fields.items():
        rows[name] = value
    return rows


DOWN = (0.0, 0.6, -0.8)
BEAMS: dict[str, dict[str, Any]] = {
    "plain": {},
    "wide soft cone": {"axis": DOWN, "inner": 0.4, "outer": 1.4},
    "half space": {"axis": (0.6, 0.0, -0.8), "inner": 0.2, "outer": math.pi},
    "narrow cone": {"axis": (0.0, 1.0, 0.0), "inner": 0.14, "outer": 0.31},
    "hard cone": {"axis": DOWN, "inner": 0.9, "outer": 0.9},
    "focus": {"axis": DOWN, "exponent": 2.0},
    "strong focus": {"axis": (0.8, 0.0, -0.6), "exponent": 20.0},
    "cone and focus": {"axis": DOWN, "inner": 0.3, "outer": 1.2, "exponent": 4.0},
}


@pytest.mark.parametrize("beam", BEAMS)
@pytest.mark.parametrize("epsilon", [0.01, EPSILON, 0.3])
def test_the_error_is_never_above_the_bound(beam: str, epsilon: float) -> None:
    rng = np.random.default_rng(11)
    # Plain lamps beside them, of which the light lets the beams merge.
    lights = np.concatenate([lamps(rng, 40), lamps(rng, 300, spread=30.0, **BEAMS[beam])])
    centre = EYE + rng.uniform(-90, 90, (40, 3)) * (1.0, 1.0, 0.15) - (0, 0, 30)
    radius = rng.lognormal(-1.0, 1.0, 40)
    tree = build_tree(lights)
    whole = table_of(tree, lights)
    tile, row = cut(tree, EYE, tiles(centre, radius), epsilon)
    shaped = whole["axis"][:, 2] != -1.0 if beam != "plain" else whole["w"] == 1.0
    assert np.any(shaped[row] & (row >= len(lights))) or epsilon < 0.3
    for k in range(len(radius)):
        x = points_of(rng, centre[k], radius[k], 200)
        normal = unit_vectors(rng, 200)
        error = illuminances(whole[row[tile == k]], x, normal) - illuminances(lights, x, normal)
        allowed = epsilon * scalar_illuminances(lights, x)
        # 2e-6: float32 of the places, 1e-7 each, of which the inverse square is the third power.
        assert np.all(np.abs(error).max(axis=1) <= allowed * (1 + 2e-6))


@pytest.mark.parametrize("beam", BEAMS)
def test_the_bound_of_one_node_is_no_better_and_not_much_worse_than_the_truth(beam: str) -> None:
    rng = np.random.default_rng(21)
    worst = 0.0
    for _ in range(300):
        lights = lamps(rng, rng.integers(2, 6), rng.lognormal(-1.5, 0.7), **BEAMS[beam])
        tree = build_tree(lights)
        nodes = lightcut._Nodes(tree, EYE)
        # Places about the edge of the cone, or anywhere.
        axis = lights["axis"][0]
        angle = rng.uniform(0.0, min(lights["outer"][0] * 1.1, math.pi), 100)
        across = np.cross(axis, unit_vectors(rng, 100))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        way = np.cos(angle)[:, None] * axis + np.sin(angle)[:, None] * across
        x = EYE + rng.lognormal(0.5, 0.7, (100, 1)) * way
        points = tiles(x, 0.0)
        columns = np.column_stack([points.centre, points.radius]).astype(np.float32).T
        beams = nodes.beams.take(np.zeros(100, int)) if len(tree.beams) else None
        bound, light, _ = lightcut.bound(columns, np.repeat(nodes.table[:1], 100, axis=0).T, beams)
        merged = merged_lights(tree, lights)[:1]
        strength = lights["intensity"][:, 0]
        exact = np.einsum("mnk,n->mk", fields(lights, x), strength)
        error = np.linalg.norm(
            exact - np.einsum("mnk,n->mk", fields(merged, x), merged["intensity"][:, 0]), axis=1
        )
        good = np.isfinite(bound)
        assert np.all(error[good] <= bound[good] * (1 + 1e-5))
        assert np.all(light <= scalar_illuminances(lights, x) * (1 + 1e-5))
        if beam == "plain":
            # Without (b), which is for a horizon between the lamps: (a) alone, both in float32.
            r, size = np.linalg.norm(x - merged["position"], axis=1)[good], tree.radius[0]
            second = nodes.table[0, 6] * (3 * r - 2 * size) / r**3 / (r - size) ** 2
            assert np.all(error[good] <= second * (1 + 1e-5))
        worst = max(worst, float(np.max(error[good] / bound[good], initial=0.0)))
    assert worst > 0.05


def test_the_bound_holds_for_surfaces_whose_horizon_runs_between_the_lamps() -> None:
    rng = np.random.default_rng(5)
    lights = lamps(rng, 64, spread=6.0)
    centre = at(40.0, 0.0, 0.0)
    tree = build_tree(lights)
    whole = table_of(tree, lights)
    for epsilon in (0.02, 0.1, 0.5):
        _, row = cut(tree, EYE, tiles(centre, 0.5), epsilon)
        x = points_of(rng, centre, 0.5, 500)
        across = np.cross(lights["position"][rng.integers(0, 64, 500)] - x, unit_vectors(rng, 500))
        normal = across / np.linalg.norm(across, axis=1, keepdims=True)
        error = illuminances(whole[row], x, normal) - illuminances(lights, x, normal)
        assert np.all(np.abs(error).max(axis=1) <= epsilon * scalar_illuminances(lights, x))


def test_colours_are_bounded_one_by_one() -> None:
    rng = np.random.default_rng(6)
    lights = lamps(rng, 120)
    lights["intensity"] = rng.uniform(0, 1000, (120, 3)) * (rng.uniform(size=(120, 3)) > 0.4)
    tree = build_tree(lights)
    whole = table_of(tree, lights)
    centre = at(0.0, 0.0, -20.0)
    for epsilon in (0.05, 0.5):
        _, row = cut(tree, EYE, tiles(centre, 1.0), epsilon)
        assert np.any(row >= 120)
        assert whole["intensity"][row].sum(axis=0) == pytest.approx(
            lights["intensity"].sum(axis=0), rel=1e-12
        )
        x, normal = points_of(rng, centre, 1.0, 400), unit_vectors(rng, 400)
        error = illuminances(whole[row], x, normal) - illuminances(lights, x, normal)
        assert np.all(np.abs(error).max(axis=1) <= epsilon * scalar_illuminances(lights, x))


def test_two_lamps_in_line_differ_by_the_remainder() -> None:
    # (a) is attained by lamps in one line with the place: 1/(r - u)^2 + 1/(r + u)^2 - 2/r^2.
    lights = lamps(np.random.default_rng(0), 2, intensity=1.0, radius=0.0)
    lights["position"] = at((9.0, 0, 0), (11.0, 0, 0))
    difference = 1 / 81 + 1 / 121 - 2 / 100
    # For the nearer half alone the remainder of its side is 1 / 81 - 1 / 100 - 2 / 1000.
    second = 2 * (3 - 0.2) / (100 * 81)
    first = 2 * 1.0 / (2 * 9**3)
    total = 2 / 101
    assert difference < second
    merging = (second + first) / total
    tree = build_tree(lights)
    for epsilon, rows in ((merging * 1.0001, [2]), (merging * 0.9999, [0, 1])):
        _, row = cut(tree, EYE, tiles(EYE, 0.0), epsilon)
        assert sorted(row) == rows


def test_every_light_is_there_once_for_each_tile() -> None:
    rng = np.random.default_rng(2)
    lights = lamps(rng, 300)
    tree = build_tree(lights)
    leaves: list[Any] = [[k] for k in range(300)] + [None] * tree.merged
    for node in reversed(range(len(tree.child))):
        if tree.child[node] >= 0:
            below = tree.row[tree.child[node] : tree.child[node] + 2]
            leaves[tree.row[node]] = leaves[below[0]] + leaves[below[1]]
    centre = EYE + rng.uniform(-50, 50, (30, 3))
    tile, row = cut(tree, EYE, tiles(centre, 2.0))
    assert np.all(np.diff(tile) >= 0)
    for k in range(30):
        found = [light for r in row[tile == k] for light in leaves[r]]
        assert sorted(found) == list(range(300))


def test_a_merged_lamp_has_the_candela_of_its_lamps_at_their_centroid() -> None:
    lights = lamps(np.random.default_rng(0), 2)
    lights["position"] = at((0.0, 0, 0), (4.0, 0, 0))
    lights["intensity"] = ((300.0, 30.0, 3.0), (100.0, 10.0, 1.0))
    lights["radius"] = (0.1, 0.2)
    (merged,) = merged_lights(build_tree(lights), lights)
    assert merged["position"] == pytest.approx(at(1.0, 0, 0), rel=1e-12)
    assert merged["intensity"] == pytest.approx((400.0, 40.0, 4.0), rel=1e-12)
    assert merged["radius"] == pytest.approx(0.2, rel=1e-7)  # float32 in the tree
    assert merged["key"] == -1


def test_what_is_not_alike_stays_alone() -> None:
    rng = np.random.default_rng(3)
    ones = lamps(rng, 10)
    for name, value in (
        ("profile", 0),
        ("shape", RECT),
        ("w", 0.0),
        ("exponent", 1.0),
        ("outer", 3.5),
        ("intensity", -1.0),
        ("intensity", 0.0),
        ("position", np.nan),
        ("intensity", 1e30),
        ("shape", SPHERE),
    ):
        lights = ones.copy()
        lights["radius"] = 0.2
        lights[name][3] = value
        assert np.array_equal(np.flatnonzero(~may_merge(lights)), [3])
        assert build_tree(lights).merged == 8
    for name, value in (
        ("link", 1),
        ("shadow", 1),
        ("shape", SPHERE),
        ("diffuse", 0.5),
        ("exponent", 2.0),
    ):
        lights = ones.copy()
        lights[name][3:5] = value  # the radius of a ball is 0.05 m
        assert build_tree(lights).merged == 8  # 8 lamps of one kind, 2 of another
    kinds = np.array([-1, -1, -1, -1, 0, 0, 0, 0, 7, 7])
    assert build_tree(ones, kinds).merged == 4


def test_moving_lights_keep_their_rows() -> None:
    lights = lamps(np.random.default_rng(4), 50)
    moving = np.arange(50) % 10 == 0
    _, row = cut(build_tree(lights, np.where(moving, -1, 0)), EYE, tiles(at(500.0, 0, 0), 1.0), 0.5)
    assert set(np.flatnonzero(moving)) <= set(row)
    assert len(row) < 10


def test_zero_epsilon_merges_only_what_stands_in_one_place() -> None:
    lights = lamps(np.random.default_rng(8), 40)
    lights["position"][20:] = lights["position"][20]
    tree = build_tree(lights)
    _, row = cut(tree, EYE, tiles(at(0, 0, 90.0), 5.0), 0.0)
    assert set(range(20)) <= set(row)
    assert len(row) < 25
    merged = table_of(tree, lights)[row[row >= 40]]
    assert np.allclose(merged["position"], lights["position"][20], rtol=0, atol=1e-9)


def test_a_tile_around_its_lamps_has_them_all() -> None:
    lights = lamps(np.random.default_rng(9), 64, spread=5.0)
    _, row = cut(build_tree(lights), EYE, tiles(EYE, 30.0), 10.0)
    assert sorted(row) == list(range(64))


def test_narrow_lobes_keep_lamps_apart() -> None:
    # Two lamps 2 m apart across the way, 50 m ahead of a place 10 m below the eye's axis.
    lights = lamps(np.random.default_rng(1), 2, intensity=100.0)
    lights["position"] = at((60.0, -1.0, 0), (60.0, 1.0, 0))
    place = at(10.0, 0.0, -1.0)
    tree = build_tree(lights)
    to_lamp = lights["position"].mean(axis=0) - place
    to_eye = EYE - place
    unit = [v / np.linalg.norm(v) for v in (to_lamp, to_eye)]
    turned = 1.0 / np.linalg.norm(to_lamp) / np.linalg.norm(unit[0] + unit[1])
    assert turned > 0.15  # they face one another: the half vector turns 8 times as much
    for lobe, rows in ((turned / LOBE_SHARE * 1.001, 1), (turned / LOBE_SHARE * 0.999, 2)):
        _, row = cut(tree, EYE, tiles(place, 0.0, lobe), 0.5)
        assert len(row) == rows


def test_cones_that_miss_a_tile_are_left_out_and_nothing_else() -> None:
    rng = np.random.default_rng(12)
    count = 400
    lights = lamps(rng, count)
    lights["axis"] = unit_vectors(rng, count)
    lights["outer"] = rng.choice([0.05, 0.3, 1.0, 2.0, 3.0, 4.0], count)
    lights["inner"] = lights["outer"] * 0.7
    centre = EYE + rng.uniform(-60, 60, (25, 3)) * (1, 1, 0.2)
    radius = rng.lognormal(0.0, 1.0, 25)
    tile, row = cut(build_tree(lights), EYE, tiles(centre, radius), 0.0)
    assert np.all(row < count)
    assert len(row) < 0.8 * 25 * count
    for k in range(25):
        left = np.setdiff1d(np.arange(count), row[tile == k])
        x = points_of(rng, centre[k], radius[k], 300)
        assert not fields(lights[left], x).any()
        # What is kept touches the ball, up to the sphere about the cone's edge: angles.
        kept = lights[row[tile == k]]
        way = centre[k] - kept["position"]
        far = np.linalg.norm(way, axis=1)
        angle = np.arccos(np.clip(np.sum(way * kept["axis"], axis=1) / far, -1, 1))
        reach = np.arcsin(np.minimum(radius[k] / far, 1.0))
        inside = (angle - reach <= kept["outer"] + 1e-4) | (far <= radius[k] * 1.0001)
        assert np.all(inside | (kept["outer"] > math.pi))


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_lights_and_no_tiles(count: int) -> None:
    lights = lamps(np.random.default_rng(0), count)
    tree = build_tree(lights)
    assert len(merged_lights(tree, lights)) == max(count - 1, 0)
    _, row = cut(tree, EYE, tiles(at(9.0, 0, 0), 1.0), 0.0)
    assert sorted(row) == list(range(count))
    none = Tiles(*(k[:0] for k in (np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros((1, 3)))))
    assert all(len(k) == 0 for k in cut(tree, EYE, none))


def test_lamps_in_one_place_and_in_steps_of_ten_are_no_deep_trees() -> None:
    lights = lamps(np.random.default_rng(0), 2000)
    lights["position"][:1000] = EYE
    lights["position"][1000:, 0] = 1e7 * 0.97 ** np.arange(1000)
    tree = build_tree(lights)
    depth = np.zeros(len(tree.child), int)
    for node in np.flatnonzero(tree.child >= 0):
        depth[tree.child[node] : tree.child[node] + 2] = depth[node] + 1
    # A quarter at least on each side: log(2000) / log(4 / 3), and 3 lamps split 1 to 2.
    assert depth.max() <= 28
