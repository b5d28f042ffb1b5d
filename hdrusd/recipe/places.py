"""Where the nodes of a database stand: every path from a root down, with its matrix and names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.usd.transform import first_matrix

Doubles = npt.NDArray[np.float64]

#: Paths that are walked; what hangs in ever more places is a bomb.
_MOST = 100_000


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
    """All of them, parents first, at the first moment of their animation."""
    stack: list[tuple[Node, Doubles, tuple[Node, ...]]]
    stack = [(node, np.eye(4), ()) for node in reversed(scene.roots)]
    for _ in range(_MOST):
        if not stack:
            return
        node, parent, above = stack.pop()
        world = first_matrix(node) @ parent
        yield Place(node, world, above)
        stack.extend((child, world, (node, *above)) for child in reversed(node.children))
