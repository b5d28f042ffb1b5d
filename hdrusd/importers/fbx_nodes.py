"""The tree of an FBX file. ufbx gives pivots, pre- and post-rotations as one TRS."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hdrusd.importers.fbx_animations import AnimationReader
from hdrusd.importers.fbx_cameras import LOOK, read_camera
from hdrusd.importers.fbx_document import Document, user_properties
from hdrusd.importers.fbx_held import Held
from hdrusd.importers.fbx_lights import read_light
from hdrusd.importers.fbx_meshes import MeshReader, set_names
from hdrusd.importers.fbx_skins import Weights, read_skin
from hdrusd.legacy.scene import TRS, Camera, Light, Node, Skin
from hdrusd.report import Kind

_FAR = float(np.finfo(np.float32).max)
_SHOWN, _HIDDEN = 1, 2
#: Properties of a node that name another one to turn to.
_AIMS = ("LookAtProperty", "UpVectorProperty")


def wearers(document: Document) -> dict[int, set[tuple[str, ...]]]:
    """To the number of each material the names of the coordinate sets of meshes with it."""
    found: dict[int, set[tuple[str, ...]]] = {}
    for node in document.scene.nodes:
        if node.mesh is not None:
            names = set_names(node.mesh)
            for material in node.materials:
                found.setdefault(int(material.typed_id), set()).add(names)
    return found


@dataclass(slots=True)
class NodeReader:
    """Reads the tree, and what hangs on it into tables."""

    document: Document
    two_sided: Sequence[bool]  # of each material
    lights: list[Light] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    skins: list[Skin] = field(default_factory=list)
    meshes: MeshReader = field(init=False)
    roots: list[Node] = field(init=False)
    _nodes: dict[int, Node] = field(default_factory=dict)
    _known: dict[tuple[str, int], int] = field(default_factory=dict)
    _skinned: list[tuple[Node, Held]] = field(default_factory=list)
    _animations: AnimationReader = field(init=False)
    _lods: dict[int, Held] = field(init=False)
    _hidden: set[int] = field(init=False)

    def __post_init__(self) -> None:
        scene = self.document.scene
        weights = Weights(self.document)
        self.meshes = MeshReader(self.document, self.two_sided, weights)
        self._animations = AnimationReader(self.document)
        self._lods = {int(n.typed_id): lod for lod in scene.lod_groups for n in lod.instances}
        layers = [layer for layer in scene.display_layers if not layer.visible]
        self._hidden = {int(node.typed_id) for layer in layers for node in layer.nodes}
        top = self._node(scene.root_node)
        still = top.transform is None and not top.animation
        self.roots = top.children if still else [top]
        for node, mesh in self._skinned:
            self._bind(node, mesh, weights)

    def _bind(self, node: Node, mesh: Held, weights: Weights) -> None:
        key = "skin", int(mesh.typed_id)
        if key not in self._known:
            skin = read_skin(self.document, weights, mesh, self._nodes)
            if skin is None:
                return
            self._known[key] = len(self.skins)
            self.skins.append(skin)
        node.skin = self._known[key]

    def _node(self, found: Held) -> Node:
        document = self.document
        name = found.name or ("root" if found.is_root else f"node_{found.typed_id}")
        place = document.ref("node", name)
        rest, animation = self._animations.read(found, self._rest(found, name))
        if 0.0 in rest.scale:
            text = f"scale {list(rest.scale)} flattens what is below"
            document.note(Kind.ASSUMED, "node-singular", place, name, text)
        made = Node(
            name,
            place,
            transform=None if rest == TRS() and not animation else rest,
            animation=animation,
            visible=self._visible(found),
            extras=user_properties(document, found, place),
        )
        self._nodes[int(found.typed_id)] = made
        made.children = [self._node(child) for child in found.children]
        self._levels(found, made)
        self._attach(found, made)
        for link in found.connections_dst:
            if link.dst_prop in _AIMS:
                text = f"aims at {link.src.name}; keeps the rotation that is stated"
                document.note(Kind.REPLACED, "fbx-look-at", place, name, text)
        return made

    def _rest(self, found: Held, name: str) -> TRS:
        transform = found.local_transform
        flat = *transform.translation, *transform.rotation, *transform.scale
        unit = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)
        place = self.document.ref("node", name)
        x, y, z, i, j, k, w, a, b, c = self.document.numbers(flat, unit, place, "its transform")
        length = math.hypot(i, j, k, w)
        if length == 0.0:
            i, j, k, w, length = 0.0, 0.0, 0.0, 1.0, 1.0
        turn = i / length, j / length, k / length, w / length
        return TRS((x, y, z), turn, (a, b, c))

    def _visible(self, found: Held) -> bool:
        """Visibility is a number, which ufbx takes for a flag: 100 in the oldest files."""
        shown = found.props.find_real("Visibility", 1.0) > 0.0
        shown = self._animations.visible(found, shown)
        if found.props.find_prop("Show") is not None:
            shown = shown and bool(found.props.find_bool("Show", True))
        return shown and int(found.typed_id) not in self._hidden

    # -- what hangs on a node ----------------------------------------------------------------------

    def _attach(self, found: Held, made: Node) -> None:
        if found.mesh is not None:
            materials = tuple(int(material.typed_id) for material in found.materials)
            number = self.meshes.read(found.mesh, materials, found.mesh.name or made.name)
            if number is not None:
                made.meshes.append(number)
                if self.meshes.meshes[number].joint_indices is not None:
                    self._skinned.append((made, found.mesh))
        if found.light is not None:
            key = "light", int(found.light.typed_id)
            if key not in self._known:
                self._known[key] = len(self.lights)
                light = read_light(self.document, found.light, found.light.name or made.name)
                self.lights.append(light)
            made.lights.append(self._known[key])
        if found.camera is not None:
            key = "camera", int(found.camera.typed_id)
            if key not in self._known:
                self._known[key] = len(self.cameras)
                name = found.camera.name or made.name
                self.cameras.append(read_camera(self.document, found.camera, name))
            place = self.document.ref("node", made.name)
            view = Node(f"{made.name}_view", place, transform=LOOK, cameras=[self._known[key]])
            made.children.append(view)

    def _levels(self, found: Held, made: Node) -> None:
        """Levels of detail: each child from its distance to the next one's."""
        lod = self._lods.get(int(found.typed_id))
        if lod is None or not made.children:
            return
        children = len(made.children)
        levels = list(lod.lod_levels)[:children]
        known = len(levels) == children and all(0.0 <= d <= _FAR for d, _ in levels)
        place = self.document.ref("node", made.name)
        if lod.relative_distances or not known:
            text = "levels of detail by their size on the screen, or of no usable distance"
            text = f"{text}; the first of {children} is shown"
            self.document.note(Kind.REPLACED, "fbx-lod", place, made.name, text)
            made.kind, made.switch_on = "switch", (True, *[False] * (children - 1))
            return
        shown = [int(display) for _, display in levels]
        if _SHOWN in shown or _HIDDEN in shown:
            text = "levels shown or hidden at all distances; their distances are used"
            self.document.note(Kind.REPLACED, "fbx-lod", place, made.name, text)
        begins = [float(distance) for distance, _ in levels]
        made.kind, made.lod_ranges = "lod", tuple(zip(begins, [*begins[1:], _FAR], strict=True))


def note_unread(document: Document, nodes: Mapping[str, str]) -> None:
    """Kinds of elements that are not read: a finding for each. ``nodes``: table to words."""
    for table, words in nodes.items():
        elements = getattr(document.scene, table)
        if len(elements):
            names = ", ".join(element.name for element in list(elements)[:4] if element.name)
            text = f"{len(elements)} {words} not read{f': {names}' if names else ''}"
            document.note(Kind.DROPPED, "fbx-element", document.ref(table), "", text)


def note_unplaced(document: Document) -> None:
    """Meshes, lights and cameras that no node has, which are not read: a finding for each kind."""
    for table in ("meshes", "lights", "cameras"):
        lost = [one for one in getattr(document.scene, table) if not len(one.instances)]
        if lost:
            names = ", ".join(one.name for one in lost[:4] if one.name)
            text = f"{len(lost)} {table} that no node has, not read{f': {names}' if names else ''}"
            document.note(Kind.DROPPED, "unplaced", document.ref(table), "", text)
