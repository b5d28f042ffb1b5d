"""The node tree of COLLADA: instances shared, no recursion.

COLLADA 1.4.1, chapter 5: ``node`` and the ``instance_*`` elements. A node that is instanced 300
times is one node below 300 others.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdrusd.importers.collada_animations import AnimationReader
from hdrusd.importers.collada_cameras import CameraReader
from hdrusd.importers.collada_document import Document, Doubles, extras, named
from hdrusd.importers.collada_geometry import GeometryReader, Prototype
from hdrusd.importers.collada_lights import LightReader
from hdrusd.importers.collada_materials import MaterialReader, scalars
from hdrusd.importers.collada_skins import Bound, SkinReader, first_parents
from hdrusd.importers.collada_transforms import WIDTHS, matrices, static_matrix
from hdrusd.importers.collada_xml import Element
from hdrusd.importers.expansion import check_expansion
from hdrusd.legacy.scene import Material, Mesh, Node, Skin, Subset
from hdrusd.report import Kind

_INSTANCES = ("instance_camera", "instance_controller", "instance_geometry", "instance_light")
_READ = frozenset((*WIDTHS, *_INSTANCES, "instance_node", "node", "extra", "asset"))
_CHANNEL = re.compile(r"\D*(\d{1,4})")
#: A controller may name a controller: a skin over a morph.
_CONTROLLERS = 8


@dataclass(frozen=True, slots=True)
class _Skinned:
    """A node whose joints are still to be found."""

    node: Node
    meshes: list[int]
    bound: Bound
    instance: Element
    shape: Doubles | None


@dataclass(slots=True)
class NodeReader:
    """Makes nodes, and with them the tables of meshes and materials."""

    document: Document
    geometries: GeometryReader
    materials: MaterialReader
    lights: LightReader
    cameras: CameraReader
    animations: AnimationReader
    skins: SkinReader
    meshes: list[Mesh] = field(default_factory=list)
    table: list[Material] = field(default_factory=list)
    bent: list[Skin] = field(default_factory=list)
    _mesh_numbers: dict[tuple[int, int, tuple[int | None, ...]], int] = field(default_factory=dict)
    _material_numbers: dict[tuple[int, tuple[str, ...]], int] = field(default_factory=dict)
    _made: dict[int, Node] = field(default_factory=dict)  # by the id of the element
    _waiting: list[_Skinned] = field(default_factory=list)

    def roots(self, scene: Element) -> list[Node]:
        """The trees of a visual scene.

        Raises InputError where nodes instance themselves, or lie too deep, or are too many.
        """
        top = Node("", self.document.ref(scene))
        pending = [(child, top) for child in reversed(self._below(scene))]
        while pending:
            element, parent = pending.pop()
            known = self._made.get(id(element))
            if known is not None:
                parent.children.append(known)
                continue
            node = self._made[id(element)] = self._node(element)
            parent.children.append(node)
            pending += [(child, node) for child in reversed(self._below(element))]
        check_expansion(top.children, self.document.limits)
        above = first_parents(top.children) if self._waiting else {}
        for waiting in self._waiting:
            self._finish(waiting, above)
        return top.children

    def _below(self, element: Element) -> list[Element]:
        """The nodes in an element, those it instances among them, in the file's order."""
        found = []
        for child in element.children:
            if child.tag == "node":
                found.append(child)
            elif child.tag == "instance_node":
                target = self.document.resolve(child, "url", "node")
                if target is not None:
                    found.append(target)
        return found

    def _node(self, element: Element) -> Node:
        document, name = self.document, named(element, f"node_{element.line}")
        for child in element.children:
            if child.tag not in _READ:
                text = f"{child.tag[:40]} of a node is not read"
                document.note(Kind.DROPPED, "collada-element", child, name, text)
        stated = extras(element)
        hidden = stated.get("visibility")
        node = Node(
            name=name,
            source=document.ref(element),
            visible=hidden is None or document.value(hidden, 1.0) != 0.0,
            extras=scalars(document, stated),
        )
        moving = self.animations.read(element, name)
        if moving is not None:
            node.animation, node.transform = moving
        else:
            node.transform = static_matrix(document, element, name)
        for child in element.all(*_INSTANCES):
            self._instance(child, node, element)
        return node

    def _instance(self, instance: Element, node: Node, element: Element) -> None:
        document = self.document
        if instance.tag == "instance_light":
            found = document.resolve(instance, "url", "light")
            number = None if found is None else self.lights.read(found)
            if number is not None:
                node.lights.append(number)
        elif instance.tag == "instance_camera":
            found = document.resolve(instance, "url", "camera")
            number = None if found is None else self.cameras.read(found)
            if number is not None:
                node.cameras.append(number)
        elif instance.tag == "instance_geometry":
            found = document.resolve(instance, "url", "geometry")
            if found is not None:
                node.meshes += self._worn(found, instance, node.name)
        else:
            self._controlled(instance, node, element)

    # -- skins and morphs --------------------------------------------------------------------

    def _controlled(self, instance: Element, node: Node, element: Element) -> None:
        """The mesh of a controller in its bind pose, below the node where it is moved into it."""
        document = self.document
        found = document.resolve(instance, "url", "controller")
        shape: Doubles | None = None
        bound: Bound | None = None
        for _ in range(_CONTROLLERS):
            kind = None if found is None else found.child("skin", "morph")
            if kind is None:
                break
            if kind.tag == "morph":
                what = "morph targets dropped; the base mesh is kept"
                document.note(Kind.DROPPED, "morph", document.root, "", what)
            bind = kind.child("bind_shape_matrix")
            if bind is not None and shape is None:
                values = document.vector(bind, 16)
                shape = None if values is None else matrices("matrix", values[None])[0]
            if kind.tag == "skin" and bound is None:
                bound = self.skins.read(kind, shape)
            found = document.resolve(kind, "source", "geometry", "controller")
            if found is not None and found.tag == "geometry":
                meshes = self._worn(found, instance, node.name, bound)
                if bound is None:
                    self._place(node, meshes, shape)
                else:
                    self._waiting.append(_Skinned(node, meshes, bound, instance, shape))
                return
        text = "controller without a mesh; dropped"
        document.note(Kind.MISSING, "collada-controller", instance, named(element, ""), text)

    def _finish(self, waiting: _Skinned, above: dict[int, Node]) -> None:
        """Give a node its skin, now that all joints are made."""
        node, meshes = waiting.node, waiting.meshes
        skin = self.skins.finish(waiting.bound, waiting.instance, self._made, node, above)
        if skin is None:
            self._place(node, meshes, waiting.shape)
            return
        if node.skin is not None:
            node.children.append(Node(f"{node.name}_skin", node.source))
            node = node.children[-1]
        node.skin = len(self.bent)
        node.meshes += meshes
        self.bent.append(skin)

    def _place(self, node: Node, meshes: list[int], shape: Doubles | None) -> None:
        """Into the bind shape, unless the node stands there itself: exporters do either."""
        own = node.transform if isinstance(node.transform, np.ndarray) else None
        same = own is not None and shape is not None and np.allclose(own, shape, atol=1e-5)
        if shape is None or same or (shape == np.eye(4)).all():
            node.meshes += meshes
            return
        node.children.append(
            Node(f"{node.name}_bind_shape", node.source, transform=shape, meshes=meshes)
        )

    # -- materials of an instance ------------------------------------------------------------

    def _worn(
        self, geometry: Element, instance: Element, thing: str, skin: Bound | None = None
    ) -> list[int]:
        """The meshes of a geometry with the materials that an instance binds."""
        bound: dict[str, Element] = {}
        common = instance.path("bind_material", "technique_common")
        for item in () if common is None else common.all("instance_material"):
            bound.setdefault(item.get("symbol"), item)
        return [
            self._mesh(prototype, bound, instance, thing, skin)
            for prototype in self.geometries.read(geometry)
        ]

    def _mesh(
        self,
        prototype: Prototype,
        bound: dict[str, Element],
        instance: Element,
        thing: str,
        skin: Bound | None,
    ) -> int:
        materials = tuple(
            self._material(symbol, bound.get(symbol), prototype, instance, thing)
            for symbol in prototype.names
        )
        key = id(prototype), id(skin), materials
        if key in self._mesh_numbers:
            return self._mesh_numbers[key]
        self._mesh_numbers[key] = len(self.meshes)
        mesh = prototype.mesh
        worn = [number for number in materials if number is not None]
        both = mesh.two_sided and all(self.table[number].two_sided for number in worn)
        if len(set(materials)) == 1:
            mesh = replace(mesh, material=materials[0], two_sided=both)
        else:
            numbers = np.array([-1 if m is None else m for m in materials], np.int32)
            of_face = numbers[prototype.symbols]
            subsets = tuple(
                Subset(number, np.flatnonzero(of_face == number).astype(np.int32))
                for number in sorted(set(worn))
            )
            mesh = replace(mesh, subsets=subsets, two_sided=both)
        self.meshes.append(mesh if skin is None else _held(mesh, prototype, skin))
        return self._mesh_numbers[key]

    def _material(
        self,
        symbol: str,
        item: Element | None,
        prototype: Prototype,
        instance: Element,
        thing: str,
    ) -> int | None:
        """The number of the material that a symbol stands for; None where it has none."""
        document = self.document
        if item is not None:
            element = document.resolve(item, "target", "material")
        else:
            element = document.ids.get(symbol) if symbol else None
            if element is None or element.tag != "material":
                element = None
                text = f"no material is bound to {symbol[:80]!r}; OpenGL's default is shown"
                document.note(Kind.ASSUMED, "material-none", instance, thing, text)
            else:
                text = f"{symbol[:80]!r} is not bound; the material of that id is used"
                document.note(Kind.ASSUMED, "collada-binding", instance, thing, text)
        if element is None:
            return None
        return self.material(element, self._sets(element, item, prototype, instance, thing))

    def material(self, element: Element, sets: dict[str, str]) -> int:
        """The number of a material whose channels read the coordinates ``sets``."""
        look = self.materials.read(element)
        channels = tuple(sets.get(channel, "st") for channel in look.channels.values())
        key = id(element), channels
        if key not in self._material_numbers:
            self._material_numbers[key] = len(self.table)
            self.table.append(look.bound(sets))
        return self._material_numbers[key]

    def _sets(
        self,
        element: Element,
        item: Element | None,
        prototype: Prototype,
        instance: Element,
        thing: str,
    ) -> dict[str, str]:
        """The channels of a material to the coordinates of a mesh.

        Bound by ``bind_vertex_input``; else by the number in a name such as CHANNEL1; else the
        first set.
        """
        made: dict[str, str] = {}
        numbers: Sequence[int] = prototype.sets
        keys = {n: "st" if k == 0 else f"st{k}" for k, n in enumerate(numbers)}
        bound = {} if item is None else _vertex_inputs(item)
        for channel in dict.fromkeys(self.materials.read(element).channels.values()):
            if not numbers:
                text = f"{named(element, '')} has a texture, the mesh no coordinates"
                self.document.note(Kind.MISSING, "mesh-uv-set", instance, thing, text)
                continue
            if channel in bound and bound[channel] in keys:
                made[channel] = keys[bound[channel]]
                continue
            match = _CHANNEL.fullmatch(channel)
            number = int(match[1]) if match else -1
            made[channel] = keys.get(number, "st")
            if len(numbers) > 1:
                text = f"coordinates {channel[:40]!r} are not bound; {made[channel]} is used"
                self.document.note(Kind.ASSUMED, "collada-texcoord", instance, thing, text)
        return made


def _held(mesh: Mesh, prototype: Prototype, skin: Bound) -> Mesh:
    """A mesh with the influences of its points; those past the skin's are on joint 0."""
    indices, weights = skin.held.indices, skin.held.weights
    used = prototype.used
    held = used < len(indices)
    own = np.zeros((len(used), indices.shape[1]), np.int32)
    share = np.zeros(own.shape, np.float32)
    share[:, 0] = 1.0
    own[held], share[held] = indices[used[held]], weights[used[held]]
    return replace(mesh, joint_indices=own, joint_weights=share)


def _vertex_inputs(item: Element) -> dict[str, int]:
    found = {}
    for bind in item.all("bind_vertex_input"):
        word = bind.get("input_set") or "0"
        if bind.get("input_semantic") in ("TEXCOORD", "") and word.isdecimal() and len(word) < 10:
            found[bind.get("semantic")] = int(word)
    return found
