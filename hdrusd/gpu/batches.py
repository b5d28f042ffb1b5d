"""Which lights are added where: rectangles of the screen, each with a batch of lights.

A batch costs a pixel its start (the G-buffer read, the place found again, the sum
blended), about as much as ten dull lamps, and each light of it its own, whether it is
there or dark filling. So lamps without and with a cone share the batches that hold
their rests, and sizes are few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int32]

#: Sizes that not one rectangle in so many wants are no program of their own.
_RARE = 16


@dataclass(frozen=True, slots=True, eq=False)
class Lists:
    """For each of k rectangles, a part of ``order``: where a light's texels begin, one by one."""

    order: Ints  # (n,)
    first: Ints  # (k,)
    count: Ints  # (k,)

    @staticmethod
    def same(order: Ints, rectangles: int) -> Lists:
        """All of ``order`` for every rectangle."""
        count = np.full(rectangles, len(order), np.int32)
        return Lists(order, np.zeros_like(count), count)

    @property
    def alike(self) -> bool:
        """Whether all rectangles have as many."""
        return bool(np.all(self.count == self.count[:1]))

    def after(self, begin: int) -> Lists:
        """The same where ``order`` is joined to another of ``begin`` entries."""
        return Lists(self.order, self.first + np.int32(begin), self.count)


@dataclass(frozen=True, slots=True, eq=False)
class Draws:
    """Instances of one program: ``sizes`` lights of the first kind and of the coned kind."""

    sizes: tuple[int, int]
    rectangles: Ints  # (m,) numbers of rectangles
    lists: Ints  # (m, 4) first, count of the one kind, first, count of the other


def batches(
    lists: Lists,
    sizes: tuple[int, ...],
    rows: int,
    coned: Lists,
    coned_sizes: tuple[int, ...],
    coned_rows: int,
    varyings: int,
) -> list[Draws]:
    """Cut the lists of the rectangles into batches; ``rows``: texels of a light of either kind.

    ``sizes``, ascending: how many lights a batch may hold; both kinds together no more than
    ``varyings`` texels. Either kind may be empty.
    """
    rectangles = np.arange(len(lists.count), dtype=np.int32)
    draws = []
    rests = []
    for which, (kind, own) in enumerate(((lists, sizes), (coned, coned_sizes))):
        full = kind.count // own[-1]
        at = np.repeat(rectangles, full)
        number = np.arange(len(at)) - np.repeat(np.cumsum(full) - full, full)
        table = np.zeros((len(at), 4), np.int32)
        table[:, 2 * which] = kind.first[at] + number * own[-1]
        table[:, 2 * which + 1] = own[-1]
        if len(at):
            draws.append(Draws((own[-1], 0) if which == 0 else (0, own[-1]), at, table))
        rest = kind.count - full * own[-1]
        size = np.concatenate([[0], own])[np.searchsorted(own, rest, "left") + (rest > 0)]
        rests.append((kind.first + full * own[-1], rest, size))
    (first, count, size), (cone_first, cone_count, cone_size) = rests
    together = size * rows + cone_size * coned_rows <= varyings
    table = np.stack([first, count, cone_first, cone_count], axis=1).astype(np.int32)
    for chosen, one, two in (
        (together, size, cone_size),
        (~together, size, np.zeros_like(cone_size)),
        (~together, np.zeros_like(size), cone_size),
    ):
        pairs = np.stack([one, two], axis=1)
        at = rectangles[chosen & (pairs.sum(axis=1) > 0)]
        found, pair = _common(pairs[at], len(rectangles) // _RARE)
        for k in np.unique(pair):
            one_pair = at[pair == k]
            draws.append(Draws((int(found[k, 0]), int(found[k, 1])), one_pair, table[one_pair]))
    return draws


def _common(pairs: Ints, least: int) -> tuple[Ints, npt.NDArray[np.intp]]:
    """Pairs of sizes (m, 2) as numbers of the distinct ones (k, 2).

    Those of fewer than ``least`` rectangles take the next larger one that there is.
    """
    found, which, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    which = which.reshape(-1)
    for number in np.argsort(count, kind="stable"):
        larger = np.flatnonzero(np.all(found >= found[number], axis=1) & (count > 0))
        larger = larger[larger != number]
        if count[number] < least and len(larger):
            next_larger = larger[np.argmin(found[larger].sum(axis=1))]
            count[next_larger] += count[number]
            count[number] = 0
            which[which == number] = next_larger
    return found, which
