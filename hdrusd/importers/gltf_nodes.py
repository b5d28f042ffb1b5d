"""The node tree of glTF (section 3.5), proved to be a tree before it is walked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from hdrusd.importers.gltf_document import Document, Item
from hdrusd.importers.gltf_lights import EXTENSION as LIGHTS_EXTENSION
from hdrusd.legacy.scene import TRS, Channel, Node
from hdrusd.report import Kind

#: Off by more than this, a quaternion was not meant to be of length 1; below it is rounding.
_UNIT_TOLERANCE = 1e-3

#: Where a node is, but for a matrix.
_PLACEMENT = frozenset({"translation", "rotation", "scale"})


class NodeReader:
    """Makes the nodes of one scene.

    ``by_mesh`` and ``lights`` map the file's numbers to those of the scene's tables,
    ``animations`` gives the channels of a node.
    """

    def __init__(
        self,
        document: Document,
        by_mesh: Sequence[Sequence[int]],
        lights: Sequence[int | None],
        animations: Mapping[int, tuple[Channel, ...]],
    ) -> None:
        self._document = document
        self._by_mesh = by_mesh
        self._lights = lights
        self._animations = animations
        self.made: dict[int, Node] = {}  # by number

    def roots(self) -> list[Node]:
        """The trees of the default scene. Raises InputError for what is no tree, or too deep."""
        items = self._document.table("nodes")
        limits = self._document.limits
        if len(items) > limits.nodes:
            raise self._document.root.error(f"{len(items)} nodes; at most {limits.nodes} are read")
        children = [item.indices("children", "nodes") for item in items]
        parents = _parents(items, children)
        roots = self._scene_roots(items, parents)
        made = self.made = {number: self._node(items[number], number) for number in roots}
        result = list(made.values())
        pending = [(number, 1) for number in roots]
        while pending:
            number, depth = pending.pop()
            if depth > limits.depth:
                raise items[number].error(f"nested deeper than {limits.depth} nodes")
            for child in children[number]:
                made[child] = self._node(items[child], child)
                made[number].children.append(made[child])
                pending.append((child, depth + 1))
        if left := len(items) - len(made):
            text = f"{left} of {len(items)} nodes are not part of the scene that is read"
            self._document.root.note(Kind.DROPPED, "nodes-elsewhere", text)
        return result

    def _scene_roots(self, items: list[Item], parents: dict[int, int]) -> list[int]:
        root = self._document.root
        scenes = self._document.table("scenes")
        if not scenes:
            found = [number for number in range(len(items)) if number not in parents]
            if items and not found:
                raise root.error("every node is the child of another: a cycle; want a tree")
            return found
        chosen = root.index("scene", "scenes") or 0
        if len(scenes) > 1:
            text = f"{len(scenes)} scenes; number {chosen} is read"
            root.note(Kind.DROPPED, "scenes-other", text)
        found = list(dict.fromkeys(scenes[chosen].indices("nodes", "nodes")))
        for number in found:
            if number in parents:
                text = (
                    f"node {number} is a root of the scene and a child of node "
                    f"{parents[number]}: a cycle or two places; want a tree"
                )
                raise scenes[chosen].error(text)
        return found

    def _node(self, item: Item, number: int) -> Node:
        animation = self._animations.get(number, ())
        if animation and "matrix" in item:
            text = "animated node with a matrix, which glTF forbids; the animation is dropped"
            item.note(Kind.DROPPED, "animation-matrix", text)
            animation = ()
        mesh = item.index("mesh", "meshes")
        camera = item.index("camera", "cameras")
        return Node(
            name=item.name or f"node_{number}",
            source=item.ref,
            transform=_matrix(item) if "matrix" in item else _trs(item),
            meshes=[] if mesh is None else list(self._by_mesh[mesh]),
            lights=self._node_lights(item),
            cameras=[] if camera is None else [camera],
            animation=animation,
            extras=item.extras(),
        )

    def _node_lights(self, item: Item) -> list[int]:
        extension = item.extension(LIGHTS_EXTENSION)
        if extension is None:
            return []
        number = extension.integer("light")
        if number is None or number >= len(self._lights):
            text = f"light {number}; want one of {len(self._lights)}; no light here"
            extension.note(Kind.INVALID, "light-index", text)
            return []
        light = self._lights[number]
        if light is None:
            text = f"light {number} was dropped; no light here"
            extension.note(Kind.MISSING, "light-missing", text)
            return []
        return [light]


def _parents(items: list[Item], children: list[list[int]]) -> dict[int, int]:
    """The parent of each child. Raises InputError where there are two, or a node is its own."""
    parents: dict[int, int] = {}
    for number, below in enumerate(children):
        for child in below:
            if child in parents:
                text = f"node {child} is a child of nodes {parents[child]} and {number}"
                raise items[child].error(f"{text}; want a tree")
            parents[child] = number
    return parents


def _trs(item: Item) -> TRS | None:
    if _PLACEMENT.isdisjoint(item.data):
        return None
    x, y, z = item.numbers("translation", (0.0, 0.0, 0.0))
    sx, sy, sz = item.numbers("scale", (1.0, 1.0, 1.0))
    if sx == 0.0 or sy == 0.0 or sz == 0.0:
        text = f"scale {[sx, sy, sz]} flattens what is below"
        item.note(Kind.ASSUMED, "node-singular", text)
    return TRS((x, y, z), _rotation(item), (sx, sy, sz))


def _rotation(item: Item) -> tuple[float, float, float, float]:
    x, y, z, w = item.numbers("rotation", (0.0, 0.0, 0.0, 1.0))
    length = math.hypot(x, y, z, w)
    if abs(length - 1.0) > _UNIT_TOLERANCE:
        then = "no rotation is used" if length == 0.0 else "scaled to 1"
        text = f"rotation of length {length:g}; want 1; {then}"
        item.note(Kind.INVALID, "node-rotation", text)
    if length == 0.0:
        return 0.0, 0.0, 0.0, 1.0
    return x / length, y / length, z / length, w / length


def _matrix(item: Item) -> npt.NDArray[np.float64]:
    """(4, 4) for row vectors: glTF's column-major matrix for columns is that, read by rows."""
    if not _PLACEMENT.isdisjoint(item.data):
        text = "matrix beside translation, rotation or scale; the matrix is used"
        item.note(Kind.INVALID, "node-matrix", text)
    identity = tuple(np.eye(4).reshape(-1).tolist())
    matrix = np.array(item.numbers("matrix", identity), np.float64).reshape(4, 4)
    last = matrix[:, 3].tolist()
    if last != [0.0, 0.0, 0.0, 1.0]:
        text = f"matrix whose fourth row is {last}; want 0, 0, 0, 1; that is used"
        item.note(Kind.INVALID, "node-matrix", text)
        matrix[:, 3] = (0.0, 0.0, 0.0, 1.0)
    a, b, c = matrix[:3, :3].tolist()
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    if volume == 0.0:
        item.note(Kind.ASSUMED, "node-singular", "matrix of volume 0 flattens what is below")
    return matrix
