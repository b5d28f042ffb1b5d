"""Which subtrees of a scene stand in several places and become prototypes.

A node that several parents hold, or one holds several times, is written once and instanced.
Nodes are told apart by identity: readers share what the source shares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from pxr import Sdf

from hdrusd.legacy.scene import Node
from hdrusd.usd.transform import first_matrix

#: Two spaces are alike for lamps below this relative difference of their metric.
_ALIKE = 1e-9


def shared_nodes(roots: Sequence[Node], pinned: Set[int]) -> set[int]:
    """The ids of nodes that become prototypes: used several times, with something to be shown.

    Not so ``pinned`` ones, by id. Nor what holds lamps where the spaces of its places differ
    by more than a turn: a lamp's size is written in its own space and must come out alike.
    """
    order = list(every_node(roots))
    uses: dict[int, int] = {}
    for held in [*roots, *(child for node in order for child in node.children)]:
        uses[id(held)] = uses.get(id(held), 0) + 1
    filled: set[int] = set()
    lit: set[int] = set()
    for node in reversed(order):
        below = [id(child) for child in node.children]
        if node.lights or not lit.isdisjoint(below):
            lit.add(id(node))
        if node.meshes or node.lights or node.cameras or not filled.isdisjoint(below):
            filled.add(id(node))
    several = {key for key, count in uses.items() if count > 1 and key in filled} - pinned
    uneven = _in_unlike_spaces(roots, order) if several & lit else set()
    return several - (uneven & lit)


def every_node(roots: Sequence[Node]) -> Iterator[Node]:
    """Every node of a scene once, behind all that hold it."""
    done: set[int] = set()
    order: list[Node] = []
    stack = [(root, False) for root in roots]
    while stack:
        node, left = stack.pop()
        if left:
            order.append(node)
        elif id(node) not in done:
            done.add(id(node))
            stack.append((node, True))
            stack += [(child, False) for child in node.children]
    return reversed(order)


def _in_unlike_spaces(roots: Sequence[Node], order: Sequence[Node]) -> set[int]:
    """The ids of nodes whose places differ by more than a turn, or have no volume.

    A space is told by its metric, W W^T of its axes in the world, and its handedness.
    """
    spaces: dict[int, npt.NDArray[np.float64] | None] = {}  # None: several
    root = np.append(np.eye(3).ravel(), 1.0)

    def meet(node: Node, space: npt.NDArray[np.float64] | None) -> None:
        if id(node) not in spaces:
            spaces[id(node)] = space
            return
        known = spaces[id(node)]
        if known is None or space is None or not _like(known, space):
            spaces[id(node)] = None

    for node in roots:
        meet(node, root)
    for node in order:
        space, below = spaces[id(node)], None
        if space is not None and node.children:
            axes = first_matrix(node)[:3, :3]
            with np.errstate(all="ignore"):
                metric = axes @ space[:9].reshape(3, 3) @ axes.T
                below = np.append(metric.ravel(), space[9] * np.sign(np.linalg.det(axes)))
        for child in node.children:
            meet(child, below)
    return {key for key, space in spaces.items() if space is None or space[9] == 0.0}


def _like(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> bool:
    with np.errstate(all="ignore"):
        return bool(a[9] == b[9] and np.abs(a[:9] - b[:9]).max() <= _ALIKE * np.abs(a[:9]).max())


@dataclass(slots=True)
class Copies:
    """Where prototypes stand: what is written in one comes to stand in all its places."""

    holder: Sdf.Path  # of the prototypes
    uses: dict[Sdf.Path, list[Sdf.Path]] = field(default_factory=dict)  # prototype to instances
    instances: dict[Sdf.Path, Sdf.Path] = field(default_factory=dict)  # and back
    _roots: dict[Sdf.Path, list[Sdf.Path]] = field(default_factory=dict)

    def add(self, use: Sdf.Path, prototype: Sdf.Path) -> None:
        """An instance of a prototype; ``use`` may itself be written in another."""
        self.uses.setdefault(prototype, []).append(use)
        self.instances[use] = prototype

    def prototype(self, path: Sdf.Path) -> Sdf.Path | None:
        """The prototype that something is written in; None where it stands itself."""
        if not path.HasPrefix(self.holder) or path == self.holder:
            return None
        return path.GetPrefixes()[self.holder.pathElementCount]

    def roots(self, prototype: Sdf.Path) -> list[Sdf.Path]:
        """All places of a prototype on the stage. To be asked when all instances are known."""
        if prototype not in self._roots:
            self._roots[prototype] = [
                place for use in self.uses.get(prototype, ()) for place in self.places(use)
            ]
        return self._roots[prototype]

    def places(self, path: Sdf.Path) -> list[Sdf.Path]:
        """All places on the stage of what is written at a path."""
        prototype = self.prototype(path)
        if prototype is None:
            return [path]
        return [path.ReplacePrefix(prototype, root) for root in self.roots(prototype)]

    def first(self, path: Sdf.Path) -> Sdf.Path:
        """The first of its places."""
        while (prototype := self.prototype(path)) is not None:
            path = path.ReplacePrefix(prototype, self.uses[prototype][0])
        return path

    def written(self, path: Sdf.Path) -> Sdf.Path:
        """Where that is written which stands at a place on the stage."""
        while above := next((p for p in path.GetPrefixes() if p in self.instances), None):
            path = path.ReplacePrefix(above, self.instances[above])
        return path
