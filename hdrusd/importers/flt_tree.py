"""The tree of one OpenFlight file: nodes put together, with their meshes and lights.

Nodes are made in the file's order, so that an instance definition is whole before it is
referred to; its nodes are shared, not copied. Levels of detail are nodes of their own in
the format; those with one parent and one centre become the children of one "lod" node.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.flt_faces import read_faces, read_polygons
from hdrusd.importers.flt_geometry import GeometryReader
from hdrusd.importers.flt_light_points import LightPointReader
from hdrusd.importers.flt_lights import read_light
from hdrusd.importers.flt_materials import MaterialReader
from hdrusd.importers.flt_nodes import Description, Flags, NodeReader
from hdrusd.importers.flt_palettes import Palettes
from hdrusd.importers.flt_records import (
    DEFINITION,
    EXTERNAL,
    FACE,
    INDEXED_LIGHT_POINT,
    INSTANCE,
    LIGHT_POINT,
    LIGHT_SOURCE,
    MESH,
    SWITCH,
    Document,
    Grouped,
    Integers,
)
from hdrusd.importers.flt_transforms import Doubles
from hdrusd.legacy.scene import TRS, LegacyScene, Light, Mesh, Node
from hdrusd.report import Kind


@dataclass(slots=True)
class Reference:
    """An external reference and the node that its file's nodes go into."""

    record: int
    node: Node


@dataclass(slots=True)
class Tree:
    """What became of a file."""

    root: Node
    named: dict[str, Node] = field(default_factory=dict)  # for references to one node
    references: list[Reference] = field(default_factory=list)

    def scale(self, factor: float) -> None:
        """Make all of it, and its named parts, larger: of a file with other units."""
        for name, node in [*self.named.items(), ("", self.root)]:
            scaled = Node(node.name, node.source, TRS(scale=(factor,) * 3), [node])
            if name:
                self.named[name] = scaled
            else:
                self.root = scaled


@dataclass(slots=True)
class _Switched:
    """Faces of a switch that the same masks show."""

    switch: Node
    shown: tuple[bool, ...]  # by the current mask, then by each

    def child(self, mesh: Mesh) -> Node:
        """One more child of the switch, for a mesh of these faces."""
        node = Node(mesh.name, mesh.source)
        self.switch.children.append(node)
        self.switch.switch_on += (self.shown[0],)
        self.switch.switch_masks = tuple(
            (name, (*mask, on))
            for (name, mask), on in zip(self.switch.switch_masks, self.shown[1:], strict=True)
        )
        return node


class TreeReader:
    """Reads one document into the tables of ``scene``."""

    def __init__(
        self,
        document: Document,
        palettes: Palettes,
        scene: LegacyScene,
        materials: MaterialReader,
        counted: int,
    ) -> None:
        self.document = document
        self.palettes = palettes
        self.scene = scene
        self.materials = materials
        self.nodes = NodeReader(document)
        self.points = LightPointReader(document, palettes)
        self.count = counted  # nodes made so far, of all files
        self._inside: dict[int, Node] = {}  # record to the node that takes its children
        self._definitions: dict[int, tuple[int, Node]] = {}  # number to record and node
        self._lods: dict[int, list[tuple[Node, Description]]] = {}  # by the record of the parent

    def read(self) -> Tree:
        """The tree. Raises InputError past the limits."""
        records = self.nodes.records
        parents = self._node_above(records)
        root = self._counted(Node("", self.document.ref(0)))
        tree = Tree(root)
        for record, parent in zip(records.tolist(), parents.tolist(), strict=True):
            found = self.nodes.describe(record)
            if record == 0:
                root.name, root.extras, root.transform = found.name, found.extras, found.transform
                self._inside[0] = root
                continue
            self._add(found, parent, tree)
        self._geometry(parents)
        self._group_lods()
        return tree

    def _counted(self, node: Node) -> Node:
        self.count += 1
        if self.count > self.document.limits.nodes:
            text = f"more than {self.document.limits.nodes} nodes"
            raise InputError(self.document.file, text)
        return node

    def _node_above(self, records: Integers) -> Integers:
        """The node that each record hangs on: faces and meshes are passed over; 0 is the root."""
        parent = self.document.records.parent
        above = parent[records]
        while True:
            inner = above >= 0
            op = self.document.records.op[above[inner]]
            passed = np.isin(op, (FACE, MESH)) & ~np.isin(above[inner], self.nodes.moved_faces)
            if not passed.any():
                return np.maximum(above, 0)
            numbers = np.flatnonzero(inner)[passed]
            above[numbers] = parent[above[numbers]]

    # -- nodes -----------------------------------------------------------------------------

    def _add(self, found: Description, parent: int, tree: Tree) -> None:
        document, record = self.document, found.record
        above = self._inside.get(parent, tree.root)
        node = self._counted(Node(found.name, document.ref(record), visible=found.visible))
        node.extras = found.extras
        if found.copies and found.transform is not None:
            inner = self._replicated(node, found, found.transform)
        else:
            node.transform, inner = found.transform, node
        inner.kind = found.kind
        self._inside[record] = inner
        tree.named.setdefault(found.name, node)
        if found.op == DEFINITION:
            (number,) = document.integers(record, 6, "H")
            self._definitions[number] = record, node
            return
        above.children.append(node)
        if found.lod is not None:
            self._lods.setdefault(parent, []).append((node, found))
        if found.op == INSTANCE:
            self._instance(inner, found)
        elif found.op == EXTERNAL:
            tree.references.append(Reference(record, inner))
        elif found.op == LIGHT_SOURCE:
            light = read_light(document, self.palettes, record, found.name)
            if light is not None:
                self._shine(inner, [light])
        elif found.op in (LIGHT_POINT, INDEXED_LIGHT_POINT):
            self._shine(inner, self.points.read(record, found.name))

    def _shine(self, node: Node, lights: list[Light]) -> None:
        node.lights += range(len(self.scene.lights), len(self.scene.lights) + len(lights))
        self.scene.lights += lights

    def _replicated(self, node: Node, found: Description, step: Doubles) -> Node:
        """Fill ``node`` with copies of an inner one, each moved from the one before."""
        inner = self._counted(Node(found.name, node.source))
        matrix = np.eye(4)
        for number in range(found.copies + 1):
            place = matrix.copy() if number else None
            copy = self._counted(Node(f"{found.name}_{number}", node.source, place))
            copy.children.append(inner)
            node.children.append(copy)
            with np.errstate(all="ignore"):
                matrix = matrix @ step
            if not (np.abs(matrix) < 1e30).all():
                text = f"{found.copies} copies; from {number + 1} on out of range; left out"
                self.document.add(Kind.INVALID, "flt-replicate", found.record, found.name, text)
                break
        return inner

    def _instance(self, node: Node, found: Description) -> None:
        (number,) = self.document.integers(found.record, 6, "H")
        record, definition = self._definitions.get(number, (-1, None))
        above, parents = found.record, self.document.records.parent
        while above > record >= 0:
            above = int(parents[above])
        if definition is None or above == record:
            text = f"definition {number} does not stand before it; left out"
            if definition is not None:
                text = f"definition {number} refers to itself; cut here"
            self.document.add(Kind.INVALID, "flt-instance", found.record, found.name, text)
            return
        node.children.append(definition)

    # -- meshes ----------------------------------------------------------------------------

    def _geometry(self, parents: Integers) -> None:
        """Meshes into their nodes. ``parents``: of the records that are nodes."""
        document = self.document
        faces = read_faces(document, self.palettes)
        polygons = read_polygons(document, self.palettes, faces)
        own = np.isin(faces.record, self.nodes.moved_faces)
        owner = np.where(own, faces.record, self._node_above(faces.record))
        transparency, dark = self.nodes.object_flags(owner)
        faces.lit &= dark == 0
        apart, switched = self._switches(parents, faces.record, ~own)
        meshes = GeometryReader(document, self.palettes, self.materials).read(
            faces,
            polygons,
            owner,
            faces.hidden,
            apart,
            transparency,
        )
        far = [found for found in meshes if found.offset is not None]
        if far:
            text = f"{len(far)} meshes too far out for 32 bits; moved into the transform of a node"
            report, mesh = document.report, far[0].mesh
            report.add(Kind.REPLACED, "flt-far-points", mesh.source, mesh.name, text)
        for found in meshes:
            node = self._inside[found.owner]
            if found.apart:
                node = self._counted(switched[found.apart - 1].child(found.mesh))
            if found.hidden or found.offset is not None:
                place = None if found.offset is None else TRS(found.offset)
                source = found.mesh.source
                holder = Node(found.mesh.name, source, place, visible=not found.hidden)
                node.children.append(self._counted(holder))
                node = holder
            node.meshes.append(len(self.scene.meshes))
            self.scene.meshes.append(found.mesh)
        for record, lights in self.points.of_faces(faces, polygons, owner).items():
            self._shine(self._inside[record], lights)

    def _switches(
        self, parents: Integers, faces: Integers, flat: Flags
    ) -> tuple[Integers, list[_Switched]]:
        """Set what each switch shows of its nodes; its faces, numbered by what shows them.

        Bits count nodes and faces alike, as they follow one another. ``flat``: faces that are
        no nodes. Returns (faces,) numbers from 1, 0 for faces below no switch, and what they are.
        """
        records = self.nodes.records
        op = self.document.records.op
        child = op[records] != DEFINITION
        nodes = Grouped(parents[child], records[child])
        rows = np.flatnonzero(flat)
        own_faces = Grouped(self.document.records.parent[faces[rows]], rows)
        apart = np.zeros(len(faces), np.int64)
        found: list[_Switched] = []
        for switch in records[op[records] == SWITCH].tolist():
            below, own = nodes[switch], own_faces[switch]
            order = np.argsort(np.concatenate([below, faces[own]]), kind="stable")
            masks = self.nodes.masks(switch, len(order))
            shown = np.ones((1 + len(masks.every), len(order)), np.bool_)
            shown[:, order] = [masks.current, *masks.every]
            node = self._inside[switch]
            node.switch_on = tuple(shown[0, : len(below)].tolist())
            node.switch_masks = tuple(
                (name, tuple(row[: len(below)].tolist()))
                for name, row in zip(masks.names, shown[1:], strict=True)
            )
            if len(own):
                alike, which = np.unique(shown[:, len(below) :].T, axis=0, return_inverse=True)
                apart[own] = len(found) + 1 + which.ravel()
                found += [_Switched(node, tuple(bits.tolist())) for bits in alike]
        return apart, found

    def _group_lods(self) -> None:
        """Levels of detail of one parent and one centre become children of a node."""
        for parent, levels in self._lods.items():
            above = self._inside[parent]
            sets: dict[tuple[float, ...], list[tuple[Node, tuple[float, float]]]] = {}
            for node, found in levels:
                if found.lod is not None:
                    sets.setdefault(found.lod[1], []).append((node, found.lod[0]))
            for members in sets.values():
                ranges = tuple(span for _, span in members)
                if above.kind != "group" or len(set(ranges)) < 2:
                    continue
                first = members[0][0]
                made = self._counted(Node("lod", first.source, kind="lod", lod_ranges=ranges))
                made.children = [node for node, _ in members]
                inside = {id(node) for node in made.children[1:]}
                above.children = [
                    made if node is first else node
                    for node in above.children
                    if id(node) not in inside
                ]
