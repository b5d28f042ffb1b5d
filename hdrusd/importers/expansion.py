"""How large a scene of shared nodes is when each stands in all its places."""

from __future__ import annotations

from collections.abc import Sequence

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import Node


def check_expansion(roots: Sequence[Node], limits: Limits) -> None:
    """Raise InputError for nodes that contain themselves, lie too deep or are too many.

    Shared nodes stand once in memory and many times in a stage: those are counted, and the
    meshes that they hold.
    """
    sizes: dict[int, tuple[int, int]] = {}  # nodes and levels below and with a node
    unfinished: set[int] = set()
    stack: list[tuple[Node, bool]] = [(root, False) for root in roots]
    while stack:
        node, left = stack.pop()
        if id(node) in sizes:
            continue
        if not left:
            if id(node) in unfinished:
                raise InputError(node.source, f"node {node.name!r} contains itself; want a tree")
            unfinished.add(id(node))
            stack.append((node, True))
            stack += [(child, False) for child in node.children]
            continue
        below = [sizes[id(child)] for child in node.children]
        own = 1 + len(node.meshes)
        size = own + sum(count for count, _ in below), 1 + max((d for _, d in below), default=0)
        if size[0] > limits.nodes:
            raise InputError(node.source, f"more than {limits.nodes} nodes with its instances")
        if size[1] > limits.depth:
            text = f"nested deeper than {limits.depth} nodes with its instances"
            raise InputError(node.source, text)
        sizes[id(node)] = size
    total = sum(sizes[id(root)][0] for root in roots)
    if total > limits.nodes:
        text = f"{total} nodes with their instances; at most {limits.nodes} are read"
        raise InputError(roots[0].source, text)
