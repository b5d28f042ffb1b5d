"""3D Studio (.3ds): what its mesh editor and its keyframer say, as one scene.

The mesh editor (MDATA) has materials, and objects in the world: meshes, lights, cameras.
The keyframer (KFDATA) has a tree of nodes that use them, with pivots and tracks; where it
knows an object, the object stands and moves as there.

Source: Autodesk, 3D Studio File Toolkit for release 3, appendix "3DS Chunk Definitions".
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.importers.left_open import leave_open
from hdrusd.importers.tds_cameras import RawCamera, camera, read_camera
from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.importers.tds_keyframer import (
    AMBIENT,
    CAMERA,
    LIGHT,
    OBJECT,
    SPOT,
    KeyNode,
    read_keyframer,
)
from hdrusd.importers.tds_keys import RATE, TrackReader
from hdrusd.importers.tds_lights import RawLight, light, read_light
from hdrusd.importers.tds_maps import MapReader
from hdrusd.importers.tds_materials import MaterialReader
from hdrusd.importers.tds_meshes import MeshMaker, MeshReader, RawMesh
from hdrusd.importers.tds_nodes import Aimed, Placer, standing
from hdrusd.legacy.scene import RGB, TRS, LegacyScene, Node
from hdrusd.report import Kind, Report

_MESH_DATA, _KEY_DATA = 0x3D3D, 0xB000
_MATERIAL, _OBJECT, _MASTER_SCALE, _AMBIENT_LIGHT = 0xAFFF, 0x4000, 0x0100, 0x2100
_MESH, _LIGHT, _CAMERA, _AMBIENT_OBJECT = 0x4100, 0x4600, 0x4700, 0x4680
_HIDDEN = 0x4010
#: Versions, shadow settings, the editor's views, and what USE_... chunks switch on.
_SILENT = frozenset(
    {0x0002, 0x0005, 0x3D3E, 0x1100, 0x1200, 0x1300, 0x1400, 0x1410, 0x1420, 0x1430, 0x1440}
    | {0x1450, 0x1460, 0x1500, 0x2200, 0x2210, 0x2300, 0x2302, 0x2310, 0x3000}
    | {0x7000, 0x7001, 0x7010, 0x7011, 0x7012, 0x7020}
)
#: What the editor does with an object.
_SILENT_IN_OBJECT = frozenset({0x4011, 0x4014, 0x4016})
#: Metres a unit that can be meant.
_SCALES = (1e-9, 1e9)
#: Sizes of a scene that a camera can be made for, units.
_SIZES = (1e-3, 1e9)


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read a 3D Studio file; the ``Importer`` of "3ds". Raises InputError where it is none."""
    document = Document(resolver.source, resolver.read(), report, resolver.limits)
    return _SceneReader(document, resolver).read()


@dataclass(slots=True)
class _Objects:
    """The named objects of the mesh editor; of one name the first counts."""

    meshes: dict[str, list[RawMesh]] = field(default_factory=dict)
    lights: dict[str, RawLight] = field(default_factory=dict)
    cameras: dict[str, RawCamera] = field(default_factory=dict)
    hidden: set[str] = field(default_factory=set)

    def __contains__(self, name: str) -> bool:
        return name in self.meshes or name in self.lights or name in self.cameras


class _SceneReader:
    """Reads one file."""

    def __init__(self, document: Document, resolver: Resolver) -> None:
        self.document = document
        self.resolver = resolver
        self.scene = LegacyScene(resolver.source, "3ds", up="Z")
        self.materials = MaterialReader(document, MapReader(document, resolver))
        self.meshes = MeshReader(document)
        self.tracks = TrackReader(document)
        self.objects = _Objects()
        self.keys: list[KeyNode] = []
        self.scale = 1.0
        self._made: dict[tuple[str, bool], list[int]] = {}

    def read(self) -> LegacyScene:
        """The whole scene."""
        for chunk in self.document.children(self.document.root()):
            if chunk.tag == _MESH_DATA:
                self._mesh_data(chunk)
            elif chunk.tag == _KEY_DATA and not self.keys:
                self.keys = read_keyframer(self.document, chunk, self.tracks)
            else:
                self.document.unread(chunk, "", _SILENT)
        self._units()
        self.size = self._size()
        self.maker = MeshMaker(self.document, self.materials.entries, self.scene.materials)
        self._ambient_node()
        self._keyed()
        self._unkeyed()
        counts = self.scene.counts()
        if not any(counts[name] for name in ("meshes", "lights", "cameras", "materials")):
            raise InputError(self.scene.source, "no mesh, light, camera or material in it")
        return self.scene

    # -- the mesh editor -------------------------------------------------------------------

    def _mesh_data(self, parent: Chunk) -> None:
        document = self.document
        for chunk in document.children(parent):
            if chunk.tag == _MATERIAL:
                self.materials.read(chunk)
            elif chunk.tag == _OBJECT:
                self._object(chunk)
            elif chunk.tag == _MASTER_SCALE:
                self.scale = document.number(chunk, 1.0)
            elif chunk.tag == _AMBIENT_LIGHT:
                self.scene.ambient = document.color(chunk, "ambient light")
            else:
                document.unread(chunk, "", _SILENT)

    def _object(self, parent: Chunk) -> None:
        """A named object: a mesh, a light or a camera, and flags."""
        document, objects = self.document, self.objects
        name, begin = document.text(parent)
        if name in objects:
            text = "a second object of this name; the first one counts"
            document.note(Kind.INVALID, "3ds-duplicate", parent, name, text)
            return
        for chunk in document.children(parent, begin):
            if chunk.tag == _MESH:
                raw = self.meshes.read(chunk, name)
                objects.meshes.setdefault(name, []).extend([] if raw is None else [raw])
            elif chunk.tag == _LIGHT:
                objects.lights[name] = read_light(document, chunk, name)
            elif chunk.tag == _CAMERA:
                found = read_camera(document, chunk, name)
                if found is not None:
                    objects.cameras[name] = found
            elif chunk.tag == _AMBIENT_OBJECT:
                color = document.color(chunk, name)
                self.scene.ambient = self.scene.ambient or color
            elif chunk.tag == _HIDDEN:
                objects.hidden.add(name)
            else:
                document.unread(chunk, name, _SILENT_IN_OBJECT)

    def _units(self) -> None:
        document, source = self.document, SourceRef(self.document.file)
        low, high = _SCALES
        if not low <= self.scale <= high:
            text = f"master scale {self.scale:g}; want {low:g} to {high:g}; 1 is used"
            document.report.add(Kind.INVALID, "3ds-master-scale", source, "", text)
            self.scale = 1.0
        self.scene.unit_m = self.scale
        taken = {"unit": f"1 unit = {self.scale:g} m by its master scale", "up": "Z up"}
        leave_open(self.scene, self.resolver, document.report, "3ds-units", "3DS", **taken)

    def _size(self) -> float:
        """The diagonal of all that stands in the mesh editor, source units."""
        corners = [np.array((raw.place, raw.target)) for raw in self.objects.cameras.values()]
        corners += [np.array([raw.place]) for raw in self.objects.lights.values()]
        for raw in (raw for found in self.objects.meshes.values() for raw in found):
            ends = _ends(raw.points)
            if ends is not None and not np.isfinite(ends).all():
                ends = _ends(raw.points[np.isfinite(raw.points).all(axis=1)])
            corners += [] if ends is None else [ends]
        if not corners:
            return 1.0
        every = np.concatenate(corners)
        diagonal = float(np.linalg.norm(every.max(axis=0) - every.min(axis=0)))
        return min(max(diagonal, _SIZES[0]), _SIZES[1])

    # -- the keyframer ---------------------------------------------------------------------

    def _ambient_node(self) -> None:
        for key in self.keys:
            if key.kind == AMBIENT and "color" in key.tracks:
                self.scene.ambient = _first_color(key)

    def _keyed(self) -> None:
        """What the keyframer knows, in its tree."""
        aims: dict[int, Aimed] = {}
        for number, key in enumerate(self.keys):
            if key.kind in (LIGHT, SPOT) and key.name in self.objects.lights:
                aims[number] = _aimed_light(self.objects.lights[key.name])
            elif key.kind == CAMERA and key.name in self.objects.cameras:
                aims[number] = _aimed_camera(self.objects.cameras[key.name])
        nodes: list[Node] = []
        Placer(self.document, self.keys, aims, nodes).place()
        parents = {key.parent for key in self.keys}
        moving = False
        for number, (key, node) in enumerate(zip(self.keys, nodes, strict=True)):
            moving = moving or bool(node.animation)
            if key.kind == OBJECT:
                self._dress(key, node)
            elif number in aims:
                self._equip(key, node)
            elif key.kind in (LIGHT, SPOT, CAMERA):
                self._note_absent(key)
            elif number not in parents:
                continue  # a target, which shows nothing, or the ambient light
            above = self.scene.roots if key.parent is None else nodes[key.parent].children
            above.append(node)
        if moving:
            source = SourceRef(self.document.file)
            text = f"the format states no frame rate: {RATE:g} frames a second"
            self.document.report.add(Kind.ASSUMED, "3ds-frame-rate", source, "", text)

    def _dress(self, key: KeyNode, node: Node) -> None:
        """Give a node its meshes; beside a pivot they hang on an inner node."""
        node.visible = node.visible and key.name not in self.objects.hidden
        if key.name not in self.objects.meshes:
            if key.name != "$$$DUMMY":
                self._note_absent(key)
            return
        numbers, local = self._local_meshes(key.name)
        if not local:
            self._rest(key, node)
        elif not {"position", "rotation", "scale"} & key.tracks.keys():
            node.transform = self._own_frame(key.name)
        elif any(key.pivot):
            x, y, z = key.pivot
            inner = Node(f"{node.name}_pivot", node.source, TRS((-x, -y, -z)))
            node.children.append(inner)
            node = inner
        node.meshes += numbers

    def _note_absent(self, key: KeyNode) -> None:
        text = "no such object in the file, or none that can be used; an empty node"
        self.document.note(Kind.MISSING, "3ds-object", key.chunk, key.title, text)

    def _rest(self, key: KeyNode, node: Node) -> None:
        """A mesh of no usable frame stays where the mesh editor has it."""
        text = "its frame has no volume, so that its own tracks cannot move it"
        self.document.note(Kind.INVALID, "3ds-matrix", key.chunk, key.title, text)
        node.transform, node.animation = None, ()

    def _own_frame(self, name: str) -> npt.NDArray[np.float64] | None:
        raw = self.objects.meshes[name][:1]
        local = raw[0].world_to_local() if raw else None
        return None if local is None else np.asarray(np.linalg.inv(local))

    def _local_meshes(self, name: str) -> tuple[list[int], bool]:
        """The meshes of an object in its own frame, and whether it has one."""
        frames = [raw.world_to_local() for raw in self.objects.meshes[name]]
        local = all(frame is not None for frame in frames)
        key = name, local
        if key not in self._made:
            self._made[key] = []
            for raw, frame in zip(self.objects.meshes[name], frames, strict=True):
                self._add_mesh(self._made[key], raw, frame if local else None)
        return self._made[key], local

    def _add_mesh(
        self, numbers: list[int], raw: RawMesh, frame: npt.NDArray[np.float64] | None
    ) -> None:
        mesh = self.maker.make(raw, frame)
        if mesh is not None:
            numbers.append(len(self.scene.meshes))
            self.scene.meshes.append(mesh)

    def _equip(self, key: KeyNode, node: Node) -> None:
        """Give a node its light or camera, with what the keyframer says of it."""
        node.visible = node.visible and key.name not in self.objects.hidden
        first = {name: track.values[0].tolist() for name, track in key.tracks.items()}
        if key.kind == CAMERA:
            raw = self.objects.cameras[key.name]
            width = first.get("field of view", [raw.width])[0]
            self._add_camera(node, raw, width)
            return
        moved: dict[str, Any] = {}
        if "color" in key.tracks:
            moved["color"] = _first_color(key)
        for name in ("hotspot", "falloff"):
            if name in first:
                moved[name] = first[name][0]
        self._add_light(node, self.objects.lights[key.name], moved)

    # -- what the keyframer does not know ----------------------------------------------------

    def _unkeyed(self) -> None:
        known = {(key.kind, key.name) for key in self.keys}
        document, objects = self.document, self.objects
        for name, found in objects.meshes.items():
            if (OBJECT, name) not in known and found:
                node = Node(name, document.ref(found[0].chunk))
                for raw in found:
                    self._add_mesh(node.meshes, raw, None)
                self._stand(node)
        for name, raw_light in objects.lights.items():
            if not {(LIGHT, name), (SPOT, name)} & known:
                node = standing(name, document.ref(raw_light.chunk), _aimed_light(raw_light))
                self._add_light(node, raw_light, {})
                self._stand(node)
        for name, raw_camera in objects.cameras.items():
            if (CAMERA, name) not in known:
                node = standing(name, document.ref(raw_camera.chunk), _aimed_camera(raw_camera))
                self._add_camera(node, raw_camera, raw_camera.width)
                self._stand(node)

    def _stand(self, node: Node) -> None:
        node.visible = node.name not in self.objects.hidden
        self.scene.roots.append(node)

    def _add_light(self, node: Node, raw: RawLight, moved: dict[str, Any]) -> None:
        node.lights.append(len(self.scene.lights))
        self.scene.lights.append(light(self.document, raw, self.scale, moved))

    def _add_camera(self, node: Node, raw: RawCamera, width: float) -> None:
        node.cameras.append(len(self.scene.cameras))
        self.scene.cameras.append(camera(self.document, raw, width, self.size))


def _ends(points: npt.NDArray[np.float32]) -> npt.NDArray[np.float64] | None:
    """The least and the largest coordinates."""
    if not len(points):
        return None
    columns = np.ascontiguousarray(points.T)  # of long rows NumPy makes faster work
    with np.errstate(invalid="ignore"):  # a NaN that signals
        return np.stack([columns.min(axis=1), columns.max(axis=1)]).astype(np.float64)


def _aimed_light(raw: RawLight) -> Aimed:
    return Aimed(raw.place, raw.target if raw.spot else None, raw.roll)


def _aimed_camera(raw: RawCamera) -> Aimed:
    return Aimed(raw.place, raw.target, raw.roll)


def _first_color(key: KeyNode) -> RGB:
    r, g, b = key.tracks["color"].values[0].tolist()
    return r, g, b
