"""Where the nodes of a database stand: every path from a root down, with its matrix and names."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Kind, Report
from hdrusd.usd.transform import first_matrix

Doubles = npt.NDArray[np.float64]

#: Places that are looked at beside the first of each thing; what hangs in ever more is a bomb.
REPEATS = 100_000

#: The largest number of others that is said.
_SAID = 10**12

Thing = TypeVar("Thing")


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A node in one of its places. ``world``: (4, 4), row vectors, source units; ``above``: what
    it hangs in, nearest first.
    """

    node: Node
    world: Doubles
    above: tuple[Node, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Its own and those above it, nearest first."""
        return (self.node.name, *(node.name for node in self.above))

    def point(self, local: tuple[float, float, float]) -> Doubles:
        """A point of the node's space in the world, (3,)."""
        return np.asarray(np.array([*local, 1.0]) @ self.world)[:3]

    def direction(self, local: tuple[float, float, float]) -> Doubles:
        """A direction of the node's space in the world, a unit vector; 0 where it is lost."""
        turned = np.array(local) @ self.world[:3, :3]
        length = float(np.linalg.norm(turned))
        return np.asarray(turned / length if length > 0.0 else turned)


def places(scene: LegacyScene) -> Iterator[Place]:
    """Every node, parents first, at the first moment of its animation.

    A node that stands in several places has all of them while there are at most ``REPEATS``
    such places in the scene; ``note_unseen`` tells of the rest.
    """
    stack: list[tuple[Node, Doubles, tuple[Node, ...]]]
    stack = [(node, np.eye(4), ()) for node in reversed(scene.roots)]
    seen: set[int] = set()
    repeats = 0
    while stack:
        node, parent, above = stack.pop()
        if id(node) in seen:
            if repeats == REPEATS:
                continue
            repeats += 1
        seen.add(id(node))
        world = first_matrix(node) @ parent
        yield Place(node, world, above)
        stack.extend((child, world, (node, *above)) for child in reversed(node.children))


def note_unseen(scene: LegacyScene, report: Report) -> None:
    """A finding for places that ``places`` leaves out."""
    distinct, everywhere = count(scene.roots, lambda node: node.children, id)
    note_left(everywhere - distinct - REPEATS, SourceRef(scene.source), report)


def note_left(left: int, place: SourceRef, report: Report) -> None:
    """A finding for ``left`` places that are not looked at; none for 0 or fewer."""
    if left > 0:
        number = f"{left}" if left <= _SAID else f"over {_SAID}"
        text = f"{number} more places of things that stand in several; not looked at"
        report.add(Kind.DROPPED, "recipe-places", place, "", text)


def count(
    roots: Iterable[Thing],
    below: Callable[[Thing], Iterable[Thing]],
    key: Callable[[Thing], Hashable],
) -> tuple[int, int]:
    """How many things there are, and in how many places; ``below``: what hangs in a thing."""
    sizes: dict[Hashable, int] = {}
    roots = list(roots)
    stack = [(thing, False) for thing in roots]
    while stack:
        thing, done = stack.pop()
        if done:
            sizes[key(thing)] = 1 + sum(sizes[key(child)] for child in below(thing))
        elif key(thing) not in sizes:
            sizes[key(thing)] = 0  # until what is below it is known
            stack.append((thing, True))
            stack.extend((child, False) for child in below(thing))
    return len(sizes), sum(sizes[key(root)] for root in roots)
