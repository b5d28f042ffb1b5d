"""The nodes of a LegacyScene as prims: transforms, meshes, cameras, prototypes, states, skins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pxr import Sdf, Usd, UsdGeom, Vt

from hdrusd.legacy.scene import LegacyScene, Mesh, Node
from hdrusd.report import Kind, Report
from hdrusd.usd import specs
from hdrusd.usd.camera import write_camera
from hdrusd.usd.fixtures import PlacedMesh
from hdrusd.usd.mesh import write_mesh
from hdrusd.usd.names import Names
from hdrusd.usd.sharing import Copies, every_node, shared_nodes
from hdrusd.usd.skeleton import Skeletons
from hdrusd.usd.states import MOST, States, select, states_of, write_states
from hdrusd.usd.transform import last_key, repetitions, write_transform

#: Frame rate of the stages that we write; legacy animation is in seconds.
CODES_PER_SECOND = 24.0

PROTOTYPES = Sdf.Path("/__Prototypes")

#: Opinions that the variants of a whole scene may take.
_MOST_OPINIONS = 1_000_000


@dataclass(frozen=True, slots=True)
class Place:
    """A node of the source and where it is written: in all its places, if in a prototype."""

    node: Node
    path: Sdf.Path


@dataclass(slots=True)
class _Choice:
    """The states of a prim, and which of them is selected."""

    states: States
    selected: int
    children: list[Sdf.Path] = field(default_factory=list)


class TreeWriter:
    """Writes the nodes of a scene below ``root`` into ``layer``, the stage's edit target.

    ``unit``: scene units a source unit; ``metres``: a source unit.

    Until ``select`` all states are composed, so that what stands in any can be written to; what
    the selected ones do not show is invisible, by the stage's session layer.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        layer: Sdf.Layer,
        scene: LegacyScene,
        names: Names,
        root: Sdf.Path,
        materials: Sequence[Sdf.Path],
        report: Report,
        *,
        unit: float,
        metres: float,
    ) -> None:
        self.stage = stage
        self.layer = layer
        self.scene = scene
        self.names = names
        self.root = root
        self.materials = materials
        self.report = report
        self.unit = unit
        self.metres = metres
        self.places: list[Place] = []
        self.meshes: list[PlacedMesh] = []
        self.cameras: list[Sdf.Path] = []
        self.copies = Copies(PROTOTYPES)
        nodes = list(every_node(scene.roots))
        self.animated = any(node.animation for node in nodes)
        self.end = last_key(nodes)  # s
        self._choices: dict[Sdf.Path, _Choice] = {}
        self._opinions = 0
        self._skeletons = Skeletons(scene, report, CODES_PER_SECOND, self.end)
        self._shared = shared_nodes(scene.roots, self._skeletons.pinned)
        self._prototypes: dict[int, Sdf.Path] = {}  # of nodes, by id
        self._mesh_prototypes: dict[int, Sdf.Path] = {}  # by number
        self._to_bend: list[tuple[Node, Sdf.Path, list[tuple[Sdf.Path, Mesh]]]] = []

    def write(self) -> None:
        """All of it."""
        # At once: prim by prim they cost a stage the square of their number.
        with Sdf.ChangeBlock():
            self._write_nodes()
        for node, root, bent in self._to_bend:
            self._skeletons.write(self.stage, root, node)
            for path, mesh in bent:
                self._skeletons.bind(self.stage.GetPrimAtPath(path), mesh, root, node)
        # At the end: what is added to a prototype afterwards is added to each of its places.
        with Sdf.ChangeBlock():
            for use, prototype in self.copies.instances.items():
                spec = self.layer.GetPrimAtPath(use)
                spec.referenceList.Prepend(Sdf.Reference("", prototype))
                spec.instanceable = True
            for path, choice in self._choices.items():
                write_states(self.layer, path, choice.states, choice.children, self.metres)
        self.preview()

    def _write_nodes(self) -> None:
        self._make_prototypes()
        stack = self._entered(self.scene.roots, self.root, [True] * len(self.scene.roots))
        while stack:
            node, path, shown = stack.pop()
            if id(node) in self._shared:
                if not shown:
                    specs.hide(self.layer.GetPrimAtPath(path))
                prototype = self._prototypes[id(node)]
                written = prototype in self.copies.uses
                self.copies.add(path, prototype)
                if written:
                    continue
                path, shown = prototype, True
            self._write_node(node, path, visible=shown and node.visible)
            below = self._entered(self._children(node), path, self._shown(node, path))
            if path in self._choices:
                self._choices[path].children = [child for _, child, _ in reversed(below)]
            stack += below

    def _entered(
        self, nodes: Sequence[Node], parent: Sdf.Path, shown: Sequence[bool]
    ) -> list[tuple[Node, Sdf.Path, bool]]:
        """Nodes with their paths, the first one last."""
        named = self._siblings(parent, [(node.name, "Xform") for node in nodes])
        return list(zip(nodes, named, shown, strict=True))[::-1]

    def _siblings(self, parent: Sdf.Path, wanted: Sequence[tuple[str, str]]) -> list[Sdf.Path]:
        """Prims below ``parent``, of names and types."""
        paths = [self.names.child(parent, name) for name, _ in wanted]
        spec = self.layer.GetPrimAtPath(parent)
        for path, (_, kind) in zip(paths, wanted, strict=True):
            Sdf.PrimSpec(spec, path.name, Sdf.SpecifierDef, kind)
        return paths

    def _make_prototypes(self) -> None:
        """Those of shared nodes and of meshes that stand in several, still empty."""
        nodes = [node for node in every_node(self.scene.roots) if id(node) in self._shared]
        meshes = [index for index, count in self._mesh_uses().items() if count > 1]
        if not nodes and not meshes:
            return
        Sdf.CreatePrimInLayer(self.layer, PROTOTYPES).specifier = Sdf.SpecifierClass
        wanted = [node.name for node in nodes]
        wanted += [self.scene.meshes[index].name for index in meshes]
        paths = self._siblings(PROTOTYPES, [(name, "Xform") for name in wanted])
        self._prototypes = dict(zip(map(id, nodes), paths[: len(nodes)], strict=True))
        self._mesh_prototypes = dict(zip(meshes, paths[len(nodes) :], strict=True))

    def _children(self, node: Node) -> list[Node]:
        """The children that become prims: joints on which nothing hangs do not."""
        if node.kind in ("lod", "switch", "sequence"):
            return node.children
        return [child for child in node.children if id(child) not in self._skeletons.bare]

    def _mesh_uses(self) -> dict[int, int]:
        """In how many places each mesh is written: what is in two becomes a prototype."""
        uses: dict[int, int] = {}
        met: set[int] = set()
        stack = list(self.scene.roots)
        while stack:
            node = stack.pop()
            if id(node) in self._shared:
                if id(node) in met:
                    continue
                met.add(id(node))
            stack.extend(node.children)
            for mesh in node.meshes:
                if not self._bent(node, mesh):
                    uses[mesh] = uses.get(mesh, 0) + 1
        return uses

    def _bent(self, node: Node, mesh: int) -> bool:
        return id(node) in self._skeletons.bones and self._skeletons.bends(mesh)

    # -- one node --------------------------------------------------------------------------

    def _write_node(self, node: Node, path: Sdf.Path, *, visible: bool) -> None:
        prim = self.layer.GetPrimAtPath(path)
        specs.display_name(prim, node.name)
        specs.keep(prim, node.extras)
        write_transform(prim, node, CODES_PER_SECOND, self.end)
        self._note_loops(node)
        if not visible:
            specs.hide(prim)
        self.places.append(Place(node, path))
        bent = [index for index in node.meshes if self._bent(node, index)]
        still = [index for index in node.meshes if not self._bent(node, index)]
        kinds = ["Xform" if index in self._mesh_prototypes else "Mesh" for index in still]
        names = [self.scene.meshes[index].name for index in still]
        paths = self._siblings(path, list(zip(names, kinds, strict=True)))
        for index, child in zip(still, paths, strict=True):
            self.meshes.append(PlacedMesh(child, path, index))
            if index in self._mesh_prototypes:
                self._instance(child, index)
            else:
                self._mesh(child, self.scene.meshes[index])
        if bent:
            self._skinned(node, path, bent)
        cameras = [self.scene.cameras[index] for index in node.cameras]
        paths = self._siblings(path, [(camera.name, "Camera") for camera in cameras])
        for camera, child in zip(cameras, paths, strict=True):
            write_camera(self.layer.GetPrimAtPath(child), camera, unit=self.unit)
        self.cameras += paths

    def _note_loops(self, node: Node) -> None:
        loops = [channel for channel in node.animation if channel.loop != "none"]
        if loops:
            times = min(repetitions(channel, self.end) for channel in loops)
            text = (
                f"loops for ever; written {times} times over for the stage, which ends at "
                f"{self.end:g} s"
            )
            self._finding(Kind.REPLACED, "animation-loop", node, text)

    def _mesh(self, path: Sdf.Path, mesh: Mesh) -> None:
        prim = specs.define(self.layer, path, "Mesh")
        write_mesh(prim, mesh)
        specs.display_name(prim, mesh.name)
        if mesh.material is not None:
            specs.bind(prim, self.materials[mesh.material])
        for subset in mesh.subsets:
            material = self.materials[subset.material]
            name = self.names.child(path, material.name).name
            faces = Vt.IntArray.FromNumpy(np.ascontiguousarray(subset.faces, np.int32))
            specs.bind_faces(prim, name, faces, material)

    def _instance(self, path: Sdf.Path, index: int) -> None:
        holder = self._mesh_prototypes[index]
        if holder not in self.copies.uses:
            self._mesh(holder.AppendChild("Mesh"), self.scene.meshes[index])
        self.copies.add(path, holder)

    def _skinned(self, node: Node, path: Sdf.Path, meshes: Sequence[int]) -> None:
        """A SkelRoot with its meshes; its Skeleton is written when the stage has composed them."""
        (root,) = self._siblings(path, [(self._skeletons.bones[id(node)].skin.name, "SkelRoot")])
        self.names.taken.setdefault(root, {})["Skeleton"] = 1
        specs.define(self.layer, root.AppendChild("Skeleton"), "Skeleton")
        bent = []
        for index in meshes:
            mesh = self.scene.meshes[index]
            child = self.names.child(root, mesh.name)
            self.meshes.append(PlacedMesh(child, root, index))
            self._mesh(child, mesh)
            bent.append((child, mesh))
        self._to_bend.append((node, root, bent))

    # -- states ----------------------------------------------------------------------------

    def _shown(self, node: Node, path: Sdf.Path) -> list[bool]:
        """Whether each child is written visible: all are, but for those of states too many."""
        children = self._children(node)
        every = [True] * len(children)
        states = states_of(node, MOST)
        if states is None:
            return every
        size = states.shown.size
        if states.too_many or self._opinions + size > _MOST_OPINIONS:
            number = states.too_many or len(states.names)
            text = f"{number} states of {len(children)} nodes are too many for variants"
            text = f"{text}; what the current one does not show is invisible"
            self._finding(Kind.REPLACED, "state-limit", node, text)
            shown: list[bool] = states.current.tolist()
            return shown
        if states.kind == "lod":
            text = (
                f"{len(states.names)} levels of detail; variants of {path}, the nearest is "
                "selected at all distances"
            )
            self._finding(Kind.REPLACED, "lod", node, text)
        self._opinions += size
        self._choices[path] = _Choice(states, states.selected)
        return every

    def preview(self) -> None:
        """Hide, for the time of writing, what the selected states do not show."""
        session = self.stage.GetSessionLayer()
        with Sdf.ChangeBlock():
            session.Clear()
            for choice in self._choices.values():
                for number in np.flatnonzero(~choice.states.shown[choice.selected]).tolist():
                    prim = Sdf.CreatePrimInLayer(session, choice.children[number])
                    hidden = Sdf.AttributeSpec(prim, "visibility", Sdf.ValueTypeNames.Token)
                    hidden.default = UsdGeom.Tokens.invisible

    def show_all(self) -> None:
        """Hide nothing for its state, until ``preview``."""
        self.stage.GetSessionLayer().Clear()

    def is_shown(self, path: Sdf.Path) -> bool:
        """Whether what is written at a path stands in its first place in the selected states."""
        while True:
            for above in path.GetPrefixes():
                choice = self._choices.get(above.GetParentPath())
                if choice is None or above not in choice.children:
                    continue
                if not choice.states.shown[choice.selected, choice.children.index(above)]:
                    return False
            prototype = self.copies.prototype(path)
            if prototype is None:
                return True
            path = self.copies.uses[prototype][0]

    def show(self, path: Sdf.Path) -> None:
        """Select states that show what is written at a path, as like the source's as can be."""
        changed = False
        for above in path.GetPrefixes():
            choice = self._choices.get(above.GetParentPath())
            if choice is None or above not in choice.children:
                continue
            shown = choice.states.shown
            number = choice.children.index(above)
            if not shown[choice.selected, number]:
                alike = (shown == shown[choice.selected]).sum(axis=1)
                choice.selected = int(np.argmax(np.where(shown[:, number], alike, -1)))
                changed = True
        if changed:
            self.preview()

    def together(self, one: Sdf.Path, other: Sdf.Path) -> bool:
        """Whether any state shows two things; paths as they stand on the stage."""
        if not self._choices:
            return True
        common = one.GetCommonPrefix(other)
        choice = self._choices.get(self.copies.written(common))
        if choice is None or common in (one, other):
            return True
        names = [path.GetPrefixes()[common.pathElementCount].name for path in (one, other)]
        known = [child.name for child in choice.children]
        if not all(name in known for name in names):
            return True  # a mesh or lamp of the node itself
        shown = choice.states.shown
        return bool((shown[:, known.index(names[0])] & shown[:, known.index(names[1])]).any())

    def select(self, source: Sdf.Layer, chosen: Sdf.Layer) -> None:
        """Select one state of each: the source's in a layer, what ``show`` changed in another."""
        with Sdf.ChangeBlock():
            self.stage.GetSessionLayer().Clear()
            for path, choice in self._choices.items():
                select(source, path, choice.states, choice.states.selected)
                if choice.selected != choice.states.selected:
                    select(chosen, path, choice.states, choice.selected)

    def _finding(self, kind: Kind, code: str, node: Node, text: str) -> None:
        self.report.add(kind, code, node.source, node.name, text)
