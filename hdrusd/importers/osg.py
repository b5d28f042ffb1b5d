"""Reader for OpenSceneGraph text: ``.osgt`` and the older ``.osg``.

The tree is walked with an explicit stack, since its depth is the file's choice:
an object may be used in many places, and a reference may lead back to an
ancestor. A shared node is one node, and a shared Geometry one mesh, wherever
they look the same: below different states they do not.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers (.osgt),
src/osgWrappers/deprecated-dotosg (.osg).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.expansion import check_expansion
from hdrusd.importers.importer import Resolver
from hdrusd.importers.osg_geometry import GeometryReader
from hdrusd.importers.osg_light_points import LightPointReader
from hdrusd.importers.osg_lights import LightReader
from hdrusd.importers.osg_materials import Look, MaterialReader
from hdrusd.importers.osg_nodes import DRAWABLES, NODES, Description, NodeReader
from hdrusd.importers.osg_shapes import read_shape
from hdrusd.importers.osg_state import RenderState, StateReader
from hdrusd.importers.osg_text import Document, Statement, listed, parse, triple
from hdrusd.importers.osg_textures import TextureReader
from hdrusd.legacy.scene import TRS, LegacyScene, Mesh, Node
from hdrusd.report import Kind, Report


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``. Raises InputError when nothing can be used."""
    return read_text(resolver.read(), resolver, report)


def read_text(data: bytes, resolver: Resolver, report: Report) -> LegacyScene:
    """Read text that stands for ``resolver.source``. Raises InputError."""
    return read_document(parse(data, resolver.source, report, resolver.limits), resolver)


def read_document(document: Document, resolver: Resolver) -> LegacyScene:
    """The scene of a tree, whatever form it was in. Raises InputError."""
    return _SceneReader(document, resolver).read()


@dataclass(slots=True)
class _Visit:
    """A node still to be read, and the list of children that it goes into."""

    place: Statement | None  # None: a reference to nothing; an empty node keeps its place
    into: list[Node]
    state: RenderState
    ancestors: tuple[Any, ...]  # (id of the parent's statement, its ancestors), () at the root
    depth: int


class _SceneReader:
    """Walks the tree of one document."""

    def __init__(self, document: Document, resolver: Resolver) -> None:
        self.document = document
        self.limits = resolver.limits
        self.scene = LegacyScene(
            resolver.source, "osg", up="Z", unit_m=1.0, generator=document.generator
        )
        self.described = NodeReader(document, resolver.limits.vertices)
        self.states = StateReader(document)
        self.geometries = GeometryReader(document, resolver.limits.vertices)
        self.materials = MaterialReader(
            document, TextureReader(document, resolver), self.scene.materials
        )
        self.lights = LightReader(document, self.scene.lights)
        self.points = LightPointReader(document, self.scene.lights)
        self.stack: list[_Visit] = []
        self.count = 0  # nodes and drawables
        self.known = False  # whether any was of a known class
        self._made: dict[tuple[int, int], Node] = {}  # by statement and inherited state
        self._shapes: dict[int, Mesh | None] = {}
        self._meshes: dict[tuple[int, Look], int] = {}
        self._cameras: dict[int, int] = {}
        self._light_models: set[int] = set()

    def read(self) -> LegacyScene:
        """The whole scene. Raises InputError past the limits or where no node is known."""
        document = self.document
        source = SourceRef(document.file)
        text = "the format states no unit and no up axis; 1 unit is 1 m, Z is up"
        document.report.add(Kind.ASSUMED, "osg-axes", source, "", text)
        root = RenderState()
        roots = list(document.objects(document.root))
        self.stack = [_Visit(place, self.scene.roots, root, (), 1) for place in reversed(roots)]
        while self.stack:
            self._visit(self.stack.pop())
        check_expansion(self.scene.roots, self.limits)
        self.lights.finish()
        if not self.known:
            raise InputError(source, "no node of a known class; want an OpenSceneGraph scene")
        return self.scene

    def _visit(self, visit: _Visit) -> None:
        place = visit.place
        if place is None or self._is_cycle(visit, place):
            missing = Node("missing", SourceRef(self.document.file), visible=False)
            visit.into.append(missing)
            return
        # The same node in the same state looks the same wherever it stands.
        key = id(place), id(visit.state)
        if key in self._made:
            visit.into.append(self._made[key])
            return
        self._counted(place)
        if visit.depth > self.limits.depth:
            text = f"nodes deeper than {self.limits.depth}"
            raise InputError(self.document.ref(place), text)
        found = self.described.read(place)
        node = Node(
            found.name,
            self.document.ref(place),
            found.placement.transform,
            animation=found.placement.animation,
            visible=found.visible,
        )
        self._made[key] = node
        visit.into.append(node)
        if place.class_name in DRAWABLES:
            self._draw(node, place, visit.state)
            return
        state = self.states.below(visit.state, place)
        self._light_model(state)
        inner = _unpivoted(node, found)
        inner.kind, inner.extras = found.kind, found.extras
        inner.lod_ranges, inner.lod_on_screen = found.lod_ranges, found.lod_on_screen
        inner.switch_on, inner.switch_masks = found.switch_on, found.switch_masks
        if place.class_name == "LightSource":
            light = self.lights.read(place, self.document.name(place), state)
            inner.lights += [] if light is None else [light]
        elif place.class_name == "LightPointNode":
            inner.lights += self.points.read(place, found.name)
        self._camera(inner, found)
        self._drawables(inner, found, state)
        ancestors = (id(place), visit.ancestors)
        self.stack.extend(
            _Visit(child, inner.children, state, ancestors, visit.depth + 1)
            for child in reversed(found.children)
        )

    def _counted(self, place: Statement) -> None:
        self.count += 1
        if self.count > self.limits.nodes:
            raise InputError(SourceRef(self.document.file), f"more than {self.limits.nodes} nodes")
        self.known = self.known or place.class_name in NODES | DRAWABLES

    def _is_cycle(self, visit: _Visit, place: Statement) -> bool:
        ancestors = visit.ancestors
        while ancestors:
            if ancestors[0] == id(place):
                text = "refers to a node above itself; cut here"
                name = self.document.name(place)
                self.document.add(Kind.INVALID, "osg-cycle", place, name, text)
                return True
            ancestors = ancestors[1]
        return False

    def _camera(self, node: Node, found: Description) -> None:
        if found.camera is None:
            return
        if found.camera_matrix is not None:
            holder = Node(f"{node.name}_camera", node.source, found.camera_matrix)
            node.children.append(holder)
            node = holder
        if id(found) not in self._cameras:
            self._cameras[id(found)] = len(self.scene.cameras)
            self.scene.cameras.append(found.camera)
        node.cameras.append(self._cameras[id(found)])

    def _drawables(self, node: Node, found: Description, state: RenderState) -> None:
        """Meshes go to the Geode's own node unless they are hidden or stand elsewhere."""
        for drawable, where in found.drawables:
            self._counted(drawable)
            own, holder = self.described.read(drawable), node
            if not own.visible or any(where):
                source = self.document.ref(drawable)
                holder = Node(own.name, source, TRS(where), visible=own.visible)
                node.children.append(holder)
            self._draw(holder, drawable, state)

    def _draw(self, node: Node, drawable: Statement, inherited: RenderState) -> None:
        """Add the mesh of a drawable to a node, in the look that the state gives it."""
        if drawable.class_name == "Geometry":
            base = self.geometries.read(drawable)
        else:
            if id(drawable) not in self._shapes:
                self._shapes[id(drawable)] = read_shape(self.document, drawable)
            base = self._shapes[id(drawable)]
        if base is None:
            return
        state = self.states.below(inherited, drawable)
        self._light_model(state)
        look = self.materials.look(state, colored=base.colors is not None)
        key = id(base), look
        if key not in self._meshes:
            self._meshes[key] = len(self.scene.meshes)
            self.scene.meshes.append(self._dressed(base, look, node.name))
        node.meshes.append(self._meshes[key])

    def _dressed(self, base: Mesh, look: Look, owner: str) -> Mesh:
        mesh = replace(
            base,
            name=base.name or owner,
            material=look.material,
            two_sided=look.two_sided,
            left_handed=look.left_handed,
            colors=base.colors if look.use_colors else None,
        )
        texture = self.scene.materials[look.material].diffuse_map
        if texture is not None and texture.uv_set not in mesh.uvs:
            text = f"no texture coordinates for {texture.image.name}; all of it has one texel"
            report = self.document.report
            report.add(Kind.MISSING, "osg-no-coordinates", mesh.source, mesh.name, text)
        return mesh

    def _light_model(self, state: RenderState) -> None:
        """The first light model's ambient light is the scene's; others that differ are findings."""
        document, place = self.document, state.attribute("LightModel")
        if place is None or id(place) in self._light_models:
            return
        self._light_models.add(id(place))
        separate = document.word(place, "colorcontrol") == "SEPARATE_SPECULAR_COLOR"
        further = {
            "local viewer": document.flag(place, "localviewer"),
            "two-sided lighting": document.flag(place, "twosided"),
            "separate specular colour": separate,
        }
        if any(further.values()):
            text = f"light model: {', '.join(word for word, on in further.items() if on)}; dropped"
            document.add(Kind.DROPPED, "osg-light-model", place, "", text)
        ambient = document.numbers(place, 4, "ambientintensity")
        if ambient is None:
            return
        if self.scene.ambient is None:
            self.scene.ambient = triple(ambient)
        elif self.scene.ambient != triple(ambient):
            text = f"ambient light {listed(triple(ambient))} for a part of the scene"
            text = f"{text}; {listed(self.scene.ambient)} is used for all"
            document.add(Kind.DROPPED, "osg-light-model", place, "", text)


def _unpivoted(node: Node, found: Description) -> Node:
    """The node for the contents: an inner one where an animation turns about a pivot."""
    if not any(found.placement.pivot):
        return node
    x, y, z = found.placement.pivot
    inner = Node(f"{node.name}_pivot", node.source, TRS((-x, -y, -z)))
    node.children.append(inner)
    return inner
