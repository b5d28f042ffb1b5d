"""Skins of COLLADA: joints by name, bind matrices, weights of points.

COLLADA 1.4.1, chapter 5: ``skin``, ``joints``, ``vertex_weights``, ``skeleton``. A point is
moved by the bind shape matrix, then by the inverse bind matrix and the place of each joint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.collada_document import LARGEST, Document, Doubles, named
from hdrusd.importers.collada_primitives import read_inputs
from hdrusd.importers.collada_sources import Sources
from hdrusd.importers.collada_transforms import matrices
from hdrusd.importers.collada_xml import Element
from hdrusd.importers.osg_transforms import rotation_matrix
from hdrusd.legacy.scene import TRS, Node, Skin
from hdrusd.legacy.skinning import MOST_INFLUENCES, Influences, influences
from hdrusd.report import Kind


@dataclass(frozen=True, slots=True, eq=False)
class Bound:
    """What a ``skin`` says of itself. ``held``: for each row of the mesh's positions."""

    element: Element
    name: str
    joints: tuple[str, ...]
    by_id: bool  # joints are ids, not scoped ones
    shape: Doubles  # (4, 4), mesh to where it was bound
    binds: Doubles  # (j, 4, 4), from there to each joint
    held: Influences


@dataclass(slots=True)
class SkinReader:
    """Reads the skins of a document; each once."""

    document: Document
    sources: Sources
    _known: dict[int, Bound | None] = field(default_factory=dict)
    _nodes: dict[str, list[Element]] | None = None  # by sid, id and name

    def read(self, skin: Element, shape: Doubles | None) -> Bound | None:
        """A skin; None, with a finding, where it cannot be used."""
        if id(skin) not in self._known:
            try:
                self._known[id(skin)] = self._read(skin, np.eye(4) if shape is None else shape)
            except InputError as error:
                self.dropped(skin, error.problem)
                self._known[id(skin)] = None
        return self._known[id(skin)]

    def dropped(self, skin: Element, why: str) -> None:
        """The finding of a skin that is not used."""
        text = f"{why}; meshes stay in their bind pose"
        self.document.note(Kind.INVALID, "skin-dropped", skin, skin.get("source"), text)

    def _read(self, skin: Element, shape: Doubles) -> Bound:
        document = self.document
        joints, weights = skin.child("joints"), skin.child("vertex_weights")
        if joints is None or weights is None:
            raise document.error(skin, "a skin without joints or weights")
        inputs = {item.semantic: item for item in reversed(read_inputs(document, joints))}
        if "JOINT" not in inputs or "INV_BIND_MATRIX" not in inputs:
            raise document.error(joints, "no usable joints and bind matrices")
        words = tuple(self.sources.names(inputs["JOINT"].source))
        table = self.sources.table(inputs["INV_BIND_MATRIX"].source)
        if not words or table.shape[1] != 16 or len(table) < len(words):
            text = f"{len(table)} rows of {table.shape[1]} numbers for {len(words)} joints"
            raise document.error(joints, f"{text}; want 16 each")
        binds = matrices("matrix", table[: len(words)])
        if not (np.abs(binds) <= LARGEST).all():
            raise document.error(joints, "bind matrices that are not finite")
        by_id = inputs["JOINT"].source.child("IDREF_array") is not None
        name = named(skin, "") or "skin"
        return Bound(skin, name, words, by_id, shape, binds, self._weights(weights, len(words)))

    def _weights(self, place: Element, joints: int) -> Influences:
        """The influences on each point of the mesh, in its own numbers."""
        document = self.document
        inputs = read_inputs(document, place)
        joint = next((item for item in inputs if item.semantic == "JOINT"), None)
        weight = next((item for item in inputs if item.semantic == "WEIGHT"), None)
        count, rows = place.child("vcount"), place.child("v")
        if joint is None or weight is None or count is None or rows is None:
            raise document.error(place, "no usable joints, weights, vcount and v")
        columns = 1 + max(item.offset for item in inputs)
        counts = np.maximum(document.indices(count), 0)  # -1 where there is no number
        words = np.clip(np.nan_to_num(document.numbers(rows), nan=-1.0), -1.0, 2.0**31)
        pairs = words[: len(words) // columns * columns].reshape(-1, columns).astype(np.int64)
        ends = np.cumsum(np.clip(counts, 0, len(pairs) + 1).astype(np.float64))
        whole = int(np.searchsorted(ends, len(pairs), side="right"))
        if whole < len(counts):
            text = f"{len(counts)} points, influences for {whole}"
            document.note(Kind.INVALID, "skin-weights", place, "", text)
        counts = np.where(np.arange(len(counts)) < whole, counts, 0)
        point = np.repeat(np.arange(len(counts)), counts)
        pairs = pairs[: len(point)]
        table = self.sources.table(weight.source)[:, 0]
        number = pairs[:, weight.offset]
        there = (number >= 0) & (number < len(table))
        share = np.where(there, table[np.where(there, number, 0)], np.nan) if len(table) else None
        if share is None:
            raise document.error(place, "no weights")
        # The strongest of each point, so that one with a million costs no more than others.
        order = np.lexsort((-np.nan_to_num(share, nan=-1.0), point))
        point, share, index = point[order], share[order], pairs[order, joint.offset]
        rank = np.arange(len(point)) - np.searchsorted(point, point)
        kept = rank < MOST_INFLUENCES
        if held := len(np.unique(point[~kept & (share > 0.0)])):
            text = f"{held} of {len(counts)} points are held by more than {MOST_INFLUENCES} "
            text += "joints; the strongest are kept"
            document.note(Kind.DROPPED, "skin-weights", place, "", text)
        most = int(rank[kept].max(initial=0)) + 1
        indices = np.zeros((len(counts), most), np.int64)
        weights = np.zeros((len(counts), most))
        indices[point[kept], rank[kept]] = index[kept]
        weights[point[kept], rank[kept]] = share[kept]
        found = influences(indices, weights, joints)
        if found.broken or found.free:
            text = f"{found.broken} influences of joints that are not there, negative or not finite"
            text = f"{text}; {found.free} of {len(counts)} points without any are on joint 0"
            document.note(Kind.INVALID, "skin-weights", place, "", text)
        return found

    def finish(
        self,
        bound: Bound,
        instance: Element,
        made: Mapping[int, Node],
        node: Node,
        above: Mapping[int, Node],
    ) -> Skin | None:
        """The skin of a node with its joints; None, with a finding, where one is not in the scene.

        ``made``: by the id of the element; ``above``: of each node, by its id.
        """
        document = self.document
        inside: dict[str, Element] = {}
        for place in instance.all("skeleton"):
            root = document.lookup(place, place.text, "node")
            for element in () if root is None else root.walk():
                if element.tag == "node" and element.get("sid"):
                    inside.setdefault(element.get("sid"), element)
        joints = []
        for word in bound.joints:
            found = None if bound.by_id else inside.get(word)
            candidates = [found] if found is not None else self._named(word)
            joint = next((made[id(e)] for e in candidates if id(e) in made), None)
            if joint is None:
                self.dropped(bound.element, f"joint {word[:80]!r} is no node of the scene")
                return None
            joints.append(joint)
        binds = self._shape(bound, instance, node, above) @ bound.binds
        return Skin(bound.name, document.ref(bound.element), tuple(joints), binds)

    def _shape(
        self, bound: Bound, instance: Element, node: Node, above: Mapping[int, Node]
    ) -> Doubles:
        """From the mesh to where it was bound.

        Blender's exporter (ControllerExporter.cpp) writes the skinned node's matrix below its
        parent, and binds joints in the world: what is above it has to be added.
        """
        if not self.document.generator.startswith("Blender"):
            return bound.shape
        place, parent = np.eye(4), above.get(id(node))
        while parent is not None:
            place = place @ _at_rest(parent)
            parent = above.get(id(parent))
        if not np.allclose(place, np.eye(4), rtol=0.0, atol=1e-6):
            text = "Blender writes a bind shape below the node's parent; moved with what is above"
            self.document.note(Kind.ASSUMED, "collada-bind-shape", instance, node.name, text)
        return np.asarray(bound.shape @ place)

    def _named(self, word: str) -> list[Element]:
        """The nodes of the document with a sid, an id or a name, those with a sid first."""
        if self._nodes is None:
            self._nodes = {}
            every = [e for e in self.document.root.walk() if e.tag == "node"]
            for key in ("sid", "id", "name"):
                for element in every:
                    if element.get(key):
                        self._nodes.setdefault(element.get(key), []).append(element)
        return self._nodes.get(word, [])


def first_parents(roots: Sequence[Node]) -> dict[int, Node]:
    """The node above each, by id, where it is first met; nothing for the roots."""
    above: dict[int, Node] = {}
    met = {id(root) for root in roots}
    stack = list(reversed(roots))
    while stack:
        node = stack.pop()
        for child in reversed(node.children):
            if id(child) not in met:
                met.add(id(child))
                above[id(child)] = node
                stack.append(child)
    return above


def _at_rest(node: Node) -> Doubles:
    """(4, 4) of a node."""
    if not isinstance(node.transform, TRS):
        return np.eye(4) if node.transform is None else node.transform
    made: Doubles = np.diag((*node.transform.scale, 1.0)) @ rotation_matrix(node.transform.rotation)
    made[3, :3] = node.transform.translation
    return made
