"""Lists of lights by tiles: what they hold, what they may leave out, when they are kept."""

from __future__ import annotations

import math
import tracemalloc
from typing import Any

import numpy as np
import pytest
from small_scenes import look

from hdrusd.gpu.tiles import STILL, LightLists, TileList, tile_balls
from hdrusd.photometry.light import cone_factor, inverse_edge
from hdrusd.photometry.lightcut import Tiles, reached
from hdrusd.scene import DISK, RECT, SPHERE, Camera, light_rows

Array = Any
SIZE = (640, 360)
CAMERAS = {
    "straight": Camera(eye=(5.0, 6.0, 7.0), window=(-0.8, 0.8, -0.45, 0.45)),
    "shifted": Camera(window=(0.1, 1.7, -0.9, 0.0)),
    "turned": look((40.0, -3.0, 9.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "orthographic": look((0.0, 0.0, 50.0), half=20.0, orthographic=True),
}


def grid(tile: int = 40) -> Array:
    """(k, 4) rectangles of a picture of SIZE."""
    columns, rows = np.meshgrid(np.arange(0, SIZE[0], tile), np.arange(0, SIZE[1], tile))
    corner = np.stack([columns.ravel(), rows.ravel()], axis=1)
    return np.concatenate([corner, corner + tile], axis=1).astype(np.int32)


def seen(camera: Camera, pixels: Array, depth: Array) -> Array:
    """(n, 3) places in the world of pixels (n, 2) at depths (n,)."""
    left, right, bottom, top = camera.window
    x = left + pixels[:, 0] / SIZE[0] * (right - left)
    y = bottom + pixels[:, 1] / SIZE[1] * (top - bottom)
    grow = np.ones_like(depth) if camera.orthographic else depth
    across = (x * grow)[:, None] * np.array(camera.right) + (y * grow)[:, None] * camera.up
    return np.array(camera.eye) + across - depth[:, None] * np.array(camera.back)


def balls(camera: Camera, rng: Any) -> tuple[Tiles, Array, Array]:
    """Balls of the grid at random depths, and these."""
    rectangles = grid()
    near = rng.lognormal(2.5, 1.0, len(rectangles)).astype(np.float32)
    far = (near * (1.0 + rng.exponential(0.3, len(rectangles)))).astype(np.float32)
    lobe = np.full(len(rectangles), np.inf, np.float32)
    return tile_balls(rectangles, near, far, lobe, SIZE, camera), near, far


def lamps(rng: Any, count: int, **fields: Any) -> Array:
    rows = light_rows(count)
    rows["position"] = rng.uniform(-60, 60, (count, 3)) * (1.0, 0.2, 1.0)
    rows["intensity"] = rng.lognormal(6.0, 1.0, (count, 1)) * (1.0, 0.8, 0.5)
    rows["radius"] = 0.05
    for name, value in fields.items():
        rows[name] = value
    return rows


def unit_vectors(rng: Any, count: int) -> Array:
    v = rng.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def of_tile(lists: dict[int, TileList], tile: int) -> Array:
    return np.concatenate(
        [one.rows[one.first[tile] : one.first[tile] + one.count[tile]] for one in lists.values()]
    )


@pytest.mark.parametrize("name", CAMERAS)
def test_a_ball_holds_what_its_tile_shows(name: str) -> None:
    camera, rng = CAMERAS[name], np.random.default_rng(1)
    tiles, near, far = balls(camera, rng)
    for k, (left, bottom, right, top) in enumerate(grid()):
        pixels = rng.uniform((left, bottom), (right, top), (60, 2))
        pixels[:4] = [(left, bottom), (left, top), (right, bottom), (right, top)]
        depth = rng.choice([near[k], far[k]], 60).astype(np.float64)
        place = seen(camera, pixels, depth) - camera.eye
        distance = np.linalg.norm(place - tiles.centre[k], axis=1)
        assert np.all(distance <= tiles.radius[k])
        # No point of it is in the middle, so the ball is no larger than the diagonal.
        corners = seen(camera, pixels[:4].repeat(2, axis=0), np.tile([near[k], far[k]], 4))
        diagonal = np.linalg.norm(corners[:, None] - corners, axis=-1).max()
        assert tiles.radius[k] <= diagonal * 1.001
        away = tiles.toward_eye[k] @ tiles.centre[k]
        assert away < 0.0
        assert np.linalg.norm(tiles.toward_eye[k]) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("name", ["straight", "turned", "orthographic"])
@pytest.mark.parametrize("merging", [False, True])
def test_lists_light_a_tile_as_all_lights_do(name: str, merging: bool) -> None:
    rng = np.random.default_rng(2)
    camera = CAMERAS[name]
    plain, cones = lamps(rng, 150), lamps(rng, 150)
    cones["axis"] = np.where(np.arange(150)[:, None] % 2, (0.0, -1.0, 0.0), unit_vectors(rng, 150))
    cones["outer"], cones["inner"] = 0.9, 0.4
    lights = np.concatenate([plain, cones])
    keeper = LightLists()
    table = keeper.update(lights, np.full(300, merging))
    assert (len(table) > 300) == merging
    assert np.array_equal(table[:300], lights)
    kinds = np.where(table["outer"] < 4.0, 1, 0)
    tiles, near, far = balls(camera, rng)
    epsilon = 0.05
    lists = keeper.lists(kinds, tiles, camera.eye, epsilon)
    assert sorted(lists) == [0, 1]
    for k, (left, bottom, right, top) in enumerate(grid()):
        rows = of_tile(lists, k)
        assert np.all(kinds[lists[1].rows] == 1)
        x = seen(
            camera,
            rng.uniform((left, bottom), (right, top), (20, 2)),
            rng.uniform(near[k], far[k], 20),
        )
        normal = unit_vectors(rng, 20)
        wanted, field = illuminance(lights, x, normal)
        got, _ = illuminance(table[rows], x, normal)
        # Leaving out what is dark changes the order of the sum only: 300 roundings of 1e-16.
        allowed = epsilon * field if merging else 1e-13 * field
        assert np.all(np.abs(got - wanted) <= allowed)
    assert len(lists[1].rows) < 0.7 * 150 * len(tiles.radius)


def illuminance(lights: Array, x: Array, normal: Array) -> tuple[Array, Array]:
    """Lux in the first channel on a plane with a normal, and on one that faces each lamp."""
    way = lights["position"] - x[:, None]
    d2 = np.sum(way**2, axis=-1)
    unit = way / np.sqrt(d2)[..., None]
    cosine = -np.sum(unit * lights["axis"], axis=-1)
    beam = cone_factor(cosine, lights["inner"], inverse_edge(lights["inner"], lights["outer"]))
    lux = beam * lights["intensity"][:, 0] / np.maximum(d2, lights["radius"] ** 2)
    nl = np.maximum(np.einsum("mnk,mk->mn", unit, normal), 0.0)
    return np.sum(nl * lux, axis=1), np.sum(lux, axis=1)


def test_lights_that_are_everywhere_are_listed_once() -> None:
    rng = np.random.default_rng(3)
    lights = lamps(rng, 40)
    lights["w"][:10] = 0.0
    lights["profile"][10:20] = 0
    lights["shape"][20:30] = SPHERE
    keeper = LightLists()
    keeper.update(lights, np.zeros(40, np.bool_))
    kinds = np.repeat([0, 1, 2, -1], 10)
    tiles, _, _ = balls(CAMERAS["straight"], rng)
    lists = keeper.lists(kinds, tiles, CAMERAS["straight"].eye)
    for number in range(3):
        one = lists[number]
        assert list(one.rows) == list(range(10 * number, 10 * number + 10))
        assert not one.first.any()
        assert np.all(one.count == 10)
    assert sorted(lists) == [0, 1, 2]


def test_flat_lights_do_not_shine_backwards() -> None:
    lights = lamps(np.random.default_rng(0), 3)
    lights["position"] = (0.0, 0.0, 0.0)
    lights["axis"] = (0.0, 0.0, -1.0)
    lights["x"], lights["y"] = (2.0, 0.0, 0.0), (0.0, 0.5, 0.5)
    lights["shape"] = RECT, DISK, SPHERE
    z = np.array([5.0, 3.9, -3.0], np.float32)
    tiles = Tiles(
        centre=np.stack([0 * z, 0 * z, z], axis=1),
        radius=np.full(3, 1.0, np.float32),
        lobe=np.full(3, np.inf, np.float32),
        toward_eye=np.tile(np.float32([0, 0, 1]), (3, 1)),
    )
    tile, light = reached(lights, (0.0, 0.0, 0.0), tiles)
    # |x| + |y| = 2.71 m, the radius 0.05 and the ball 1 m: 3.9 m behind it no part is before it.
    assert list(light[tile == 0]) == [2]
    assert list(light[tile == 1]) == [2]
    assert list(light[tile == 2]) == [0, 1, 2]


def test_lists_are_kept_while_nothing_changes() -> None:
    rng = np.random.default_rng(4)
    lights = lamps(rng, 60)
    keeper = LightLists()
    merge = np.ones(60, np.bool_)
    table = keeper.update(lights, merge)
    tiles, _, _ = balls(CAMERAS["straight"], rng)
    eye = CAMERAS["straight"].eye
    kinds = np.zeros(len(table), np.int32)
    first = keeper.lists(kinds, tiles, eye)
    assert keeper.update(lights.copy(), merge) is table
    assert keeper.lists(kinds.copy(), tiles, eye) is first
    assert keeper.lists(kinds, tiles, (9.0, 9.0, 9.0)) is not first
    brighter = lights.copy()
    brighter["intensity"] *= 2.0
    assert keeper.update(brighter, merge)["intensity"][-1] == pytest.approx(
        2.0 * table["intensity"][-1]
    )
    assert not len(keeper.update(lights, np.zeros(60, np.bool_))[60:])


def test_traffic_is_not_merged_and_joins_when_it_stands() -> None:
    rng = np.random.default_rng(5)
    lights = lamps(rng, 60)
    keeper = LightLists()
    merge = np.ones(60, np.bool_)
    assert len(keeper.update(lights, merge)) == 60 + 59
    for _ in range(3):
        lights = lights.copy()
        lights["position"][:5, 0] += 0.3
        table = keeper.update(lights, merge)
        assert len(table) == 60 + 54
        assert np.array_equal(table[:60], lights)
    tiles, _, _ = balls(CAMERAS["straight"], rng)
    lists = keeper.lists(np.zeros(len(table), np.int32), tiles, CAMERAS["straight"].eye, 1.0)
    assert all(set(range(5)) <= set(of_tile(lists, k)) for k in range(len(tiles.radius)))
    for _ in range(STILL):
        table = keeper.update(lights, merge)
    assert len(table) == 60 + 59


def test_lights_that_go_out_and_come_back() -> None:
    keeper = LightLists()
    rng = np.random.default_rng(8)
    for count in (5, 0, 3, 1, 0, 5):
        lights = lamps(rng, count)
        table = keeper.update(lights, np.ones(count, np.bool_))
        assert len(table) == count + max(count - 1, 0)
        assert keeper.in_trees == (count if count > 1 else 0)


@pytest.mark.parametrize("count", [0, 1])
def test_few_lights_and_no_tiles(count: int) -> None:
    keeper = LightLists()
    table = keeper.update(lamps(np.random.default_rng(0), count), np.ones(count, np.bool_))
    kinds = np.zeros(len(table), np.int32)
    tiles, _, _ = balls(CAMERAS["straight"], np.random.default_rng(1))
    lists = keeper.lists(kinds, tiles, (0.0, 0.0, 0.0))
    assert [list(one.count) for one in lists.values()] == [[1] * len(tiles.radius)] * count
    none = keeper.lists(kinds, tiles.part(0, 0), (0.0, 0.0, 0.0))
    assert all(len(one.count) == 0 for one in none.values())


def test_thousands_of_beams_do_not_take_memory_for_all_pairs() -> None:
    rng = np.random.default_rng(6)
    lights = lamps(rng, 4096)
    lights["axis"], lights["outer"], lights["inner"] = unit_vectors(rng, 4096), 0.02, 0.01
    centre = rng.uniform(-200, 200, (3600, 3)).astype(np.float32)
    away = np.linalg.norm(centre, axis=1, keepdims=True)
    ones = np.ones(3600, np.float32)
    tiles = Tiles(centre, 0.1 * ones, math.inf * ones, -centre / away)
    tracemalloc.start()
    tile, _ = reached(lights, (0.0, 0.0, 0.0), tiles)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # One byte a pair would be 15 MB; the lists themselves are 8 bytes a pair that is lit.
    assert peak < 8e6 + 40 * len(tile)
    assert len(tile) < 0.01 * 3600 * 4096


def test_places_that_are_no_numbers_merge_with_nothing() -> None:
    rng = np.random.default_rng(7)
    lights = lamps(rng, 30)
    lights["position"][4] = np.nan
    lights["position"][5] = 1e300
    keeper = LightLists()
    table = keeper.update(lights, np.ones(30, np.bool_))
    tiles, _, _ = balls(CAMERAS["straight"], rng)
    lists = keeper.lists(np.zeros(len(table), np.int32), tiles, CAMERAS["straight"].eye, 1.0)
    assert all({4, 5} <= set(of_tile(lists, k)) for k in range(len(tiles.radius)))
    assert np.all(np.isfinite(table["position"][30:]))
