"""Reader for OpenSceneGraph: ``.osgt``, the older ``.osg``, ``.osgb`` and ``.ive``.

The tree is walked with an explicit stack, since its depth is the file's choice:
an object may be used in many places, and a reference may lead back to an
ancestor. A shared node is one node, and a shared Geometry one mesh, wherever
they look the same: below different states they do not. What nodes stand for in
other files is walked in its place.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers (.osgt),
src/osgWrappers/deprecated-dotosg (.osg).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.expansion import check_expansion
from hdrusd.importers.importer import Resolver
from hdrusd.importers.left_open import leave_open
from hdrusd.importers.osg_files import File, Files, load
from hdrusd.importers.osg_lights import LightSwitches
from hdrusd.importers.osg_materials import Look, MaterialReader
from hdrusd.importers.osg_nodes import DRAWABLES, NODES, Description, External
from hdrusd.importers.osg_shapes import read_shape
from hdrusd.importers.osg_state import RenderState
from hdrusd.importers.osg_text import Statement, listed, triple
from hdrusd.legacy.scene import TRS, LegacyScene, Mesh, Node
from hdrusd.report import Kind, Report


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``. Raises InputError when nothing can be used."""
    return _SceneReader(resolver, report).read()


@dataclass(slots=True)
class _Visit:
    """A node still to be read, and the list of children that it goes into."""

    file: File
    place: Statement | Node | None  # a Node: read already; None: a reference to nothing
    into: list[Node]
    state: RenderState
    ancestors: tuple[Any, ...]  # (the parent's statement or file, its ancestors), () at the root
    depth: int


class _SceneReader:
    """Walks the tree of a file, and of the files that it names."""

    def __init__(self, resolver: Resolver, report: Report) -> None:
        self.limits = resolver.limits
        document = load(resolver, report)
        self.scene = LegacyScene(
            resolver.source, "osg", up="Z", unit_m=1.0, generator=document.generator
        )
        taken = {"unit": "1 unit = 1 m", "up": "Z up"}
        leave_open(self.scene, resolver, report, "osg-axes", "OpenSceneGraph", **taken)
        self.report = report
        self.materials = MaterialReader(self.scene.materials)
        self.switches = LightSwitches(self.scene.lights)
        self.files = Files(self.scene, report, self.materials, self.switches, self.limits)
        self.file = self.files.add(document, resolver)
        self.stack: list[_Visit] = []
        self.count = 0  # nodes and drawables
        self.known = False  # whether any was of a known class
        self._made: dict[tuple[int, int], Node] = {}  # by statement and inherited state
        self._shapes: dict[int, Mesh | None] = {}
        self._meshes: dict[tuple[int, Look], int] = {}
        self._cameras: dict[int, int] = {}
        self._light_models: set[int] = set()
        self._drawn: set[int] = set()  # meshes without their looks, whose points count

    def read(self) -> LegacyScene:
        """The whole scene. Raises InputError past the limits or where no node is known."""
        source = SourceRef(self.scene.source)
        root = RenderState()
        above = self.file, ()
        self.stack = [
            _Visit(self.file, place, self.scene.roots, root, above, 1)
            for place in reversed(self.file.roots)
        ]
        while self.stack:
            self._visit(self.stack.pop())
        check_expansion(self.scene.roots, self.limits)
        self.switches.finish()
        if not self.known:
            raise InputError(source, "no node of a known class; want an OpenSceneGraph scene")
        return self.scene

    def _visit(self, visit: _Visit) -> None:
        file, place = visit.file, visit.place
        if isinstance(place, Node):
            visit.into.append(place)
            return
        if place is None or self._is_cycle(visit, place):
            missing = Node("missing", SourceRef(file.document.file), visible=False)
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
            raise InputError(file.document.ref(place), text)
        found = file.described.read(place)
        node = Node(
            found.name,
            file.document.ref(place),
            found.placement.transform,
            animation=found.placement.animation,
            visible=found.visible,
        )
        self._made[key] = node
        visit.into.append(node)
        if place.class_name in DRAWABLES:
            self._draw(file, node, place, visit.state)
            return
        inner = _unpivoted(node, found)
        inner.kind, inner.extras = found.kind, found.extras
        inner.lod_ranges, inner.lod_on_screen = found.lod_ranges, found.lod_on_screen
        inner.switch_on, inner.switch_masks = found.switch_on, found.switch_masks
        if place.class_name == "LightSource":
            name = file.document.name(place)
            light, state = file.lights.read(place, name, visit.state)
            inner.lights += [] if light is None else [light]
        else:
            state = file.states.below(visit.state, place)
        self._light_model(state)
        if place.class_name == "LightPointNode":
            inner.lights += file.points.read(place, found.name)
        self._camera(inner, found)
        self._drawables(file, inner, found, state)
        self._children(visit, inner, found, state)

    def _children(self, visit: _Visit, node: Node, found: Description, state: RenderState) -> None:
        """Put the children of a node on the stack, those in other files too."""
        file, depth = visit.file, visit.depth + 1
        ancestors = id(found.place), visit.ancestors
        below: list[_Visit] = []
        lost = []
        for number, child in enumerate(found.children):
            if not isinstance(child, External):
                below.append(_Visit(file, child, node.children, state, ancestors, depth))
                continue
            self._count()
            part = self._part(visit, child, found.name)
            if part is None:
                lost.append((number, child.name))
            elif isinstance(part, Node):
                below.append(_Visit(file, part, node.children, state, ancestors, depth))
            else:
                into = node.children
                if len(part.roots) != 1:  # a level is one child
                    holder = Node(part.path.stem, SourceRef(part.document.file))
                    below.append(_Visit(file, holder, into, state, ancestors, depth))
                    into = holder.children
                above = part, ancestors
                below += [_Visit(part, root, into, state, above, depth) for root in part.roots]
        self.stack += reversed(below)
        if lost:
            node.extras = {**node.extras, "files": tuple(name for _, name in lost)}
            numbers = {number for number, _ in lost}
            node.lod_ranges = tuple(
                span for number, span in enumerate(node.lod_ranges) if number not in numbers
            )

    def _part(self, visit: _Visit, external: External, name: str) -> File | Node | None:
        """What a node stands for; None, with a finding, where it is not to be had."""
        file = visit.file
        path = self.files.find(external, file, name)
        if path is None:
            return None
        ancestors = visit.ancestors
        while ancestors:
            if isinstance(ancestors[0], File) and ancestors[0].path == path:
                text = f"{external.name} leads back to this file; cut here"
                file.document.add(Kind.INVALID, "osg-cycle", external.place, name, text)
                return None
            ancestors = ancestors[1]
        return self.files.read(path, external, file, name)

    def _count(self) -> None:
        self.count += 1
        if self.count > self.limits.nodes:
            raise InputError(SourceRef(self.scene.source), f"more than {self.limits.nodes} nodes")

    def _counted(self, place: Statement) -> None:
        self._count()
        self.known = self.known or place.class_name in NODES | DRAWABLES

    def _is_cycle(self, visit: _Visit, place: Statement) -> bool:
        ancestors = visit.ancestors
        while ancestors:
            if ancestors[0] == id(place):
                text = "refers to a node above itself; cut here"
                document = visit.file.document
                document.add(Kind.INVALID, "osg-cycle", place, document.name(place), text)
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

    def _drawables(self, file: File, node: Node, found: Description, state: RenderState) -> None:
        """Meshes go to the Geode's own node unless they are hidden or stand elsewhere."""
        for drawable, where in found.drawables:
            self._counted(drawable)
            own, holder = file.described.read(drawable), node
            if not own.visible or any(where):
                source = file.document.ref(drawable)
                holder = Node(own.name, source, TRS(where), visible=own.visible)
                node.children.append(holder)
            self._draw(file, holder, drawable, state)

    def _draw(self, file: File, node: Node, drawable: Statement, inherited: RenderState) -> None:
        """Add the mesh of a drawable to a node, in the look that the state gives it."""
        if drawable.class_name == "Geometry":
            base = file.geometries.read(drawable)
        else:
            if id(drawable) not in self._shapes:
                self._shapes[id(drawable)] = read_shape(file.document, drawable)
            base = self._shapes[id(drawable)]
        if base is None:
            return
        if id(base) not in self._drawn:
            self._drawn.add(id(base))
            self.files.count(len(base.points))
        state = file.states.below(inherited, drawable)
        self._light_model(state)
        self.switches.drawn(state)
        look = self.materials.look(
            file.document, state, colored=base.colors is not None, uvs=base.uvs
        )
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
            self.report.add(Kind.MISSING, "osg-no-coordinates", mesh.source, mesh.name, text)
        return mesh

    def _light_model(self, state: RenderState) -> None:
        """The first light model's ambient light is the scene's; others that differ are findings."""
        found = state.attribute("LightModel")
        if found is None or id(found.place) in self._light_models:
            return
        document, place = found.document, found.place
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
