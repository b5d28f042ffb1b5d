"""Lamps of one make, whose colour, radius and cone travel once; and batches that lose none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from parity import assert_is_its_shading
from small_scenes import lights
from test_light_parity import AXIS, MATERIALS, scene

from hdrusd.gpu.batches import Lists, batches
from hdrusd.gpu.light_tables import light_classes
from hdrusd.scene import Camera

SODIUM, XENON = np.array([1.0, 0.6, 0.2]), np.array([0.7, 0.8, 1.0])


def along(count: int, colour: Any = SODIUM, **more: Any) -> list[dict[str, Any]]:
    """Lamps of one make in a row, each stronger than the last."""
    return [
        {"position": (-1.5 + 3.0 * k / count, 0.8, 1.6), "intensity": (20.0 + k) * colour} | more
        for k in range(count)
    ]


BEAM = {"axis": AXIS, "inner": 0.2, "outer": 0.6}


def classes(*rows: dict[str, Any]) -> dict[str, int]:
    found = light_classes(lights(*rows), Camera())
    return {" ".join(kind.defines): len(kind.members) for kind in found}


@pytest.mark.parametrize("material", MATERIALS)
def test_lamps_and_beams_of_one_make_each(gl: Any, material: str) -> None:
    rows = [*along(17, radius=0.3), *along(7, XENON, radius=0.2, **BEAM)]
    assert classes(*rows) == {"LAMPS": 17, "BEAMS": 7}
    assert_is_its_shading(gl, scene(MATERIALS[material], *rows))


@pytest.mark.parametrize("material", ["ggx", "blinn", "matte"])
def test_many_of_one_make_among_others(gl: Any, material: str) -> None:
    rows = [*along(33), *along(31, XENON, **BEAM), *along(4, XENON), *along(3, **BEAM)]
    assert classes(*rows) == {"LAMPS": 33, "BEAMS": 31, "PLAIN": 4, "CONES": 3}
    assert_is_its_shading(gl, scene(MATERIALS[material], *rows))


@pytest.mark.parametrize("count", [1, 5, 29, 30, 31, 61])
def test_batch_borders_of_one_make(gl: Any, count: int) -> None:
    """A lamp lost or taken twice is a missing number."""
    rows = [row | {"intensity": SODIUM * 1.5**k} for k, row in enumerate(along(count))]
    assert_is_its_shading(gl, scene(MATERIALS["matte"], *rows))


def test_what_makes_lamps_different() -> None:
    for other in (
        {"radius": 0.3},
        {"intensity": (1.0, 0.6, 0.2001)},
        {"w": 0.0},
        {"intensity": (np.nan, 0.6, 0.2)},
    ):
        assert classes(*along(3), along(1)[0] | other) == {"PLAIN": 4}
        assert classes(*along(30), along(1)[0] | other) == {"LAMPS": 30, "PLAIN": 1}
    for other in ({"inner": 0.1}, {"outer": 0.7}):
        assert classes(*along(2, **BEAM), along(1, **BEAM)[0] | other) == {"CONES": 3}


def test_lamps_that_take_light_away_are_of_a_make_too(gl: Any) -> None:
    """The strongest channel, with its sign, is the strength."""
    rows = [*along(8), {"position": (0.0, 0.8, 1.2), "intensity": -5.0 * SODIUM}]
    assert classes(*rows) == {"LAMPS": 9}
    assert_is_its_shading(gl, scene(MATERIALS["matte"], *rows))


@pytest.mark.parametrize("seed", range(4))
def test_every_light_is_drawn_once_in_every_rectangle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = rng.integers(0, 70, (2, 300)).astype(np.int32)
    order = np.arange(10_000, dtype=np.int32)
    one, two = (Lists(order, np.cumsum(n, dtype=np.int32) - n, n) for n in count)
    sizes, coned = (1, 4, 8, 15, 22, 30), (1, 4, 8, 15)
    draws = batches(one, sizes, 1, two, coned, 2, 30)
    drawn: list[set[int]] = [set() for _ in range(600)]
    for each in draws:
        assert each.sizes[0] + 2 * each.sizes[1] <= 30
        for rectangle, (first, n, other, m) in zip(each.rectangles, each.lists, strict=True):
            parts = (rectangle, first, n), (300 + rectangle, other, m)
            for (at, begin, number), size in zip(parts, each.sizes, strict=True):
                new = set(range(begin, begin + min(number, size)))
                assert not new & drawn[at]
                drawn[at] |= new
    for at, (first, n) in enumerate(zip([*one.first, *two.first], count.ravel(), strict=True)):
        assert drawn[at] == set(range(first, first + n))
    assert len({each.sizes for each in draws}) <= 16, "programs are few"
