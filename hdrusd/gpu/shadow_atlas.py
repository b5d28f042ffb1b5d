"""Where the tiles of shadow maps lie in one texture, and how large each may be.

The tiles of a light are equal squares side by side, its block. Blocks of the same height
stand on shelves; heights are powers of two, so that a block that goes leaves room for the
next one. What size a tile has depends on the frame alone while all lights fit; where some
must go without, those that had tiles in the frame before keep them rather.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


#: Texels that no texture has.
_TOO_HIGH = 1 << 16


@dataclass(frozen=True, slots=True)
class Block:
    """``columns`` x ``rows`` square tiles of ``cell`` texels; ``rows`` a power of two."""

    cell: int
    columns: int
    rows: int = 1

    @property
    def shelf(self) -> tuple[int, int]:
        """Height and cell: blocks that share a shelf have both in common."""
        return self.cell * self.rows, self.cell


def height_needed(blocks: Mapping[Block, int], width: int) -> int:
    """Texels that so many of each block are high on shelves of ``width``.

    More than ``_TOO_HIGH`` where they are higher than that, or one is too wide.
    First-fit decreasing, shelf by shelf: what ``Atlas.refill`` does.
    """
    shelves: dict[tuple[int, int], Counter[int]] = {}
    for block, count in blocks.items():
        if block.columns * block.cell > width:
            return _TOO_HIGH + 1
        shelves.setdefault(block.shelf, Counter())[block.columns] += count
    total = 0
    for (height, cell), columns in shelves.items():
        while columns and total <= _TOO_HIGH:
            room = width // cell
            for size in sorted(columns, reverse=True):
                taken = min(columns[size], room // size)
                room -= taken * size
                columns[size] -= taken
            columns = +columns
            total += height
    return total


def smallest_atlas(
    blocks: Mapping[Block, int], size: tuple[int, int], limit: int
) -> tuple[int, int]:
    """Width and height, powers of two, of a texture with room for the blocks.

    ``size`` where they fit into that; ``limit``, a side, where they need all.
    """
    if size[0] and height_needed(blocks, size[0]) <= size[1]:
        return size
    best = limit, limit
    width = 1024
    while width <= limit:
        needed = height_needed(blocks, width)
        height = 1024
        while height < needed:
            height *= 2
        # Not smaller than it was in either way: what grows now and then is not drawn often.
        wide, high = max(width, size[0]), max(height, size[1])
        if high <= limit and wide * high < best[0] * best[1]:
            best = wide, high
        width *= 2
    return best


@dataclass(slots=True)
class _Shelf:
    y: int
    height: int
    cell: int
    taken: int = 0  # a bit for each cell


@dataclass(slots=True)
class Atlas:
    """Places of blocks by the keys of their lights."""

    width: int
    height: int
    places: dict[int, tuple[Block, int, int]] = field(default_factory=dict)
    _shelves: list[_Shelf] = field(default_factory=list)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in texels."""
        return self.width, self.height

    def keep(self, wanted: Mapping[int, Block]) -> bool:
        """Give every key its block; True where all that had one like it stays where it is.

        Otherwise all was placed anew: nothing of the texture is worth anything. The blocks
        must fit (``height_needed``).
        """
        for key in [key for key, (block, _, _) in self.places.items() if wanted.get(key) != block]:
            self._drop(key)
        missing = [key for key in wanted if key not in self.places]
        if all(self._place(key, wanted[key]) for key in _ordered(missing, wanted)):
            return True
        self.places.clear()
        self._shelves.clear()
        if not all(self._place(key, wanted[key]) for key in _ordered(wanted, wanted)):
            raise ValueError("more blocks than the shadow atlas has room for")
        return False

    def _drop(self, key: int) -> None:
        block, x, y = self.places.pop(key)
        shelf = next(s for s in self._shelves if s.y == y)
        shelf.taken &= ~(_bits(block.columns) << (x // block.cell))
        if not shelf.taken:
            self._shelves.remove(shelf)

    def _place(self, key: int, block: Block) -> bool:
        bits = _bits(block.columns)
        for shelf in self._shelves:
            if (shelf.height, shelf.cell) == block.shelf:
                for column in range(self.width // block.cell - block.columns + 1):
                    if not shelf.taken & (bits << column):
                        shelf.taken |= bits << column
                        self.places[key] = block, column * block.cell, shelf.y
                        return True
        shelf_at = self._gap(block.shelf[0])
        if shelf_at is None or block.columns * block.cell > self.width:
            return False
        self._shelves.append(_Shelf(shelf_at, *block.shelf, taken=bits))
        self._shelves.sort(key=lambda s: s.y)
        self.places[key] = block, 0, shelf_at
        return True

    def _gap(self, height: int) -> int | None:
        """The lowest place for a new shelf."""
        free = 0
        for shelf in self._shelves:
            if shelf.y - free >= height:
                break
            free = shelf.y + shelf.height
        return free if free + height <= self.height else None


def _bits(columns: int) -> int:
    return (1 << columns) - 1


def _ordered(keys: Iterable[int], wanted: Mapping[int, Block]) -> list[int]:
    return sorted(keys, key=lambda key: (*wanted[key].shelf, wanted[key].columns), reverse=True)


def tile_sizes(
    importance: Doubles,
    largest: Integers,
    columns: Integers,
    rows: Integers,
    width: int,
    smallest: int = 64,
    held: npt.NDArray[np.bool_] | None = None,
) -> Integers:
    """(n,) texels of each light's tiles: powers of two, as large as fit; 0 for none.

    ``importance`` (n,): the size that a light wants is in proportion to it, up to
    ``largest`` (n,). Where not even ``smallest`` tiles of all fit, the least important
    lights get none. ``columns``, ``rows`` (n,): of the blocks, rows 0 for a light that wants
    none. ``held`` (n,): lights that have tiles already; when some must go
    without, they count half as much again, so that shadows do not come and go.
    """
    wants = (rows > 0) & (columns * np.maximum(rows, 1) > 0)
    sizes = np.zeros(len(importance), np.int64)
    if not wants.any():
        return sizes
    ranked = np.flatnonzero(wants)[np.argsort(-importance[wants], kind="stable")]
    relative = importance / importance[ranked[0]]
    most = int(min(24, np.ceil(-np.log2(max(float(relative[ranked[-1]]), 2.0**-24)))))
    for level in range(most, -25, -1):
        share = np.minimum(relative * 2.0**level, 1.0)
        wanted = np.exp2(np.floor(np.log2(np.maximum(largest * share, 1.0)))).astype(np.int64)
        sizes = np.where(wants, np.clip(wanted, smallest, np.maximum(largest, smallest)), 0)
        if _fit(sizes, columns, rows, width):
            return sizes
        if np.all(sizes[wants] == smallest):
            break
    if held is not None:
        weighed = np.where(held, 1.5, 1.0) * importance
        ranked = ranked[np.argsort(-weighed[ranked], kind="stable")]
    # A longer list takes more room: bisection.
    low, high = 0, len(ranked)
    while low < high:
        middle = (low + high + 1) // 2
        tried = np.zeros_like(sizes)
        tried[ranked[:middle]] = smallest
        if _fit(tried, columns, rows, width):
            low = middle
        else:
            high = middle - 1
    sizes[:] = 0
    sizes[ranked[:low]] = smallest
    return sizes


def _fit(sizes: Integers, columns: Integers, rows: Integers, width: int) -> bool:
    if np.sum(sizes**2 * columns * rows) > width**2:
        return False
    used = sizes > 0
    kinds, counts = np.unique(
        np.stack([sizes[used], columns[used], rows[used]], axis=1), axis=0, return_counts=True
    )
    blocks = {Block(*map(int, kind)): int(n) for kind, n in zip(kinds, counts, strict=True)}
    return height_needed(blocks, width) <= width
