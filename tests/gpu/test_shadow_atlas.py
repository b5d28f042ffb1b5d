"""Tiles in the shadow atlas: within it, apart from one another, and staying where they are."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.gpu.shadow_atlas import Atlas, Block, height_needed, smallest_atlas, tile_sizes

WIDTH = 1024
blocks = st.builds(
    Block,
    cell=st.sampled_from([64, 128, 256]),
    columns=st.integers(1, 4),
    rows=st.sampled_from([1, 2, 4]),
)
frames = st.lists(st.dictionaries(st.integers(0, 20), blocks, max_size=12), max_size=6)


def fits(wanted: dict[int, Block]) -> bool:
    return height_needed(Counter(wanted.values()), WIDTH) <= WIDTH


def check(atlas: Atlas, wanted: dict[int, Block]) -> None:
    """Every block is there, inside, and covers no texel of another one."""
    covered = np.zeros((WIDTH // 64, WIDTH // 64), int)
    assert {key: block for key, (block, _, _) in atlas.places.items()} == wanted
    for block, x, y in atlas.places.values():
        w, h = block.columns * block.cell, block.rows * block.cell
        assert x >= 0
        assert y >= 0
        assert x + w <= WIDTH
        assert y + h <= WIDTH
        covered[y // 64 : (y + h) // 64, x // 64 : (x + w) // 64] += 1
    assert covered.max(initial=0) <= 1


@given(frames)
def test_blocks_never_overlap_and_stay(sequence: list[dict[int, Block]]) -> None:
    atlas = Atlas(WIDTH, WIDTH)
    for wanted in filter(fits, sequence):
        before = dict(atlas.places)
        stayed = atlas.keep(wanted)
        check(atlas, wanted)
        if stayed:
            for key, place in before.items():
                assert wanted.get(key) != place[0] or atlas.places[key] == place


def test_nothing_moves_when_one_comes_and_goes() -> None:
    atlas = Atlas(WIDTH, WIDTH)
    atlas.keep({1: Block(256, 3), 2: Block(128, 5)})
    before = dict(atlas.places)
    assert atlas.keep({1: Block(256, 3), 2: Block(128, 5), 3: Block(256, 1)})
    assert atlas.keep({1: Block(256, 3), 2: Block(128, 5)})
    assert atlas.places == before


def test_height_is_that_of_full_shelves() -> None:
    # 1024 texels hold four cells of 256: 3 + 1, 3 + 1, 3, 3 are four shelves.
    assert height_needed({Block(256, 3): 4, Block(256, 1): 2}, WIDTH) == 4 * 256
    assert height_needed({Block(256, 5): 1}, WIDTH) > WIDTH


def test_an_atlas_is_as_small_as_its_blocks_let_it_be() -> None:
    # Five tiles of 1024 in a row are 8192 x 1024; two shelves of them 8192 x 2048.
    assert smallest_atlas({Block(1024, 5): 1}, (0, 0), 8192) == (8192, 1024)
    assert smallest_atlas({Block(1024, 5): 2}, (0, 0), 8192) == (8192, 2048)
    # It is kept while all fits, and grows in the direction that is missing.
    assert smallest_atlas({Block(64, 1): 1}, (8192, 1024), 8192) == (8192, 1024)
    assert smallest_atlas({Block(2048, 1): 1}, (8192, 1024), 8192) == (8192, 2048)


def sizes(importance: list[float], width: int = 4096, columns: int = 6) -> list[int]:
    n = len(importance)
    found = tile_sizes(
        np.array(importance),
        np.full(n, 512),
        np.full(n, columns),
        np.ones(n, np.int64),
        width,
    )
    return [int(s) for s in found]


def test_few_lights_have_the_largest_tiles() -> None:
    assert sizes([1.0, 1e-3]) == [512, 512]


def test_the_important_have_larger_tiles() -> None:
    # 4096^2 texels hold 10.7 lights of six tiles of 512: not all of 40 are that large.
    found = sizes([1.0] * 4 + [0.1] * 36)
    assert found[:4] == [512] * 4
    assert len(set(found[4:])) == 1
    assert 64 <= found[4] <= 256


def test_the_least_important_go_without() -> None:
    # Tiles of 64 texels: 16 a shelf of 1024, 2 lights of 6; 16 shelves: 32 lights.
    found = sizes(list(np.linspace(2.0, 1.0, 40)), width=1024)
    assert found == [64] * 32 + [0] * 8


def test_no_light_wants_a_shadow() -> None:
    none = np.zeros(3, np.int64)
    assert not tile_sizes(np.ones(3), none, none, none, 1024).any()


@given(st.lists(st.floats(1e-12, 1e6), min_size=1, max_size=60))
def test_sizes_always_fit(importance: list[float]) -> None:
    found = sizes(importance, width=1024)
    wanted = {i: Block(s, 6) for i, s in enumerate(found) if s}
    assert fits(wanted)
    Atlas(WIDTH, WIDTH).keep(wanted)


def test_too_much_is_refused() -> None:
    with pytest.raises(ValueError, match="more blocks"):
        Atlas(64, 64).keep({1: Block(64, 2)})
