"""The one writer: a LegacyScene, walked once, into layers.

street.usda              units, default prim; sublayers, strongest first:
street.photometry.usda   lights, reflectance, cd/m2, our schema
street.look.usda         the look as it was
street.geometry.usdc     nodes, meshes, cameras, bindings, animation
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, Vt

from hdrusd import report as findings
from hdrusd.legacy import scene as legacy
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.usd.camera import write_camera
from hdrusd.usd.fixtures import Lamp, PlacedMesh, find_fixtures, free_from
from hdrusd.usd.light import write_legacy_falloff, write_light
from hdrusd.usd.material import bind, bind_faces, keep_extras
from hdrusd.usd.mesh import write_mesh
from hdrusd.usd.settings import Settings, write_settings
from hdrusd.usd.transform import aim, is_flat, rigid, uniform_scale, write_transform

#: Frame rate of the stages that we write; legacy animation is in seconds.
CODES_PER_SECOND = 24.0

LAYERS = ("photometry", "look", "geometry")

_PROTOTYPES = Sdf.Path("/__Prototypes")


@dataclass(frozen=True, slots=True)
class Place:
    """Where a node of the source came to stand."""

    node: legacy.Node
    path: Sdf.Path


@dataclass(slots=True)
class Names:
    """Valid and unique child names under each prim."""

    taken: dict[Sdf.Path, set[str]] = field(default_factory=dict)

    def child(self, parent: Sdf.Path, wanted: str) -> Sdf.Path:
        """A free path below ``parent`` for a name from the source."""
        names = self.taken.setdefault(parent, set())
        wanted = wanted.strip()[:120] or "unnamed"
        # A digit in front would be replaced, and "1st" and "2nd" be told apart no more.
        base = Tf.MakeValidIdentifier(f"_{wanted}" if wanted[0].isdigit() else wanted)
        name, number = base, 1
        while name in names:
            number += 1
            name = f"{base}_{number}"
        names.add(name)
        return parent.AppendChild(name)


class StageWriter:
    """Writes one scene below ``folder`` as ``stem``.* ; nothing else is touched.

    ``meters_per_unit``: of the stage; ``source_unit``: metres a source unit.
    """

    def __init__(
        self,
        folder: Path,
        stem: str,
        scene: legacy.LegacyScene,
        report: Report,
        *,
        meters_per_unit: float,
        source_unit: float,
        up: str,
    ) -> None:
        self.scene = scene
        self.report = report
        self.source_unit = source_unit
        self.unit = source_unit / meters_per_unit  # scene units a source unit
        self.meters_per_unit = meters_per_unit
        top = Sdf.Path.absoluteRootPath
        self.names = Names({top: {"Render", _PROTOTYPES.name}})
        self.places: list[Place] = []
        self.meshes: list[PlacedMesh] = []
        self.end: float | None = None
        self.first_camera: str | None = None
        root = Sdf.Layer.CreateNew(str(folder / f"{stem}.usda"))
        self.layers = {
            name: Sdf.Layer.CreateNew(
                str(folder / f"{stem}.{name}.{'usdc' if name == 'geometry' else 'usda'}")
            )
            for name in LAYERS
        }
        root.subLayerPaths[:] = [f"./{Path(self.layers[n].identifier).name}" for n in LAYERS]
        self.stage = Usd.Stage.Open(root)
        UsdGeom.SetStageMetersPerUnit(self.stage, meters_per_unit)
        UsdGeom.SetStageUpAxis(self.stage, up)
        if scene.generator:
            root.comment = f"made from {scene.source.name}, {scene.generator[:200]}"
        self.root = self.names.child(top, stem)
        self.looks = self.names.child(self.root, "Looks")
        self.materials = [self.names.child(self.looks, m.name) for m in scene.materials]
        self._prototypes: dict[int, Sdf.Path] = {}

    # -- geometry --------------------------------------------------------------------------

    def write_geometry(self) -> None:
        """Nodes, meshes, cameras, bindings and animation, each into the geometry layer."""
        self._edit("geometry")
        root = UsdGeom.Xform.Define(self.stage, self.root)
        if self.unit != 1.0:
            root.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(self.unit))
        UsdGeom.Scope.Define(self.stage, self.looks)
        uses = self._mesh_uses()
        stack = [(node, self.root, True) for node in reversed(self.scene.roots)]
        while stack:
            node, parent, shown = stack.pop()
            path = self.names.child(parent, node.name)
            self._write_node(node, path, uses, visible=shown and node.visible)
            below = zip(node.children, self._shown_children(node), strict=True)
            stack.extend((child, path, on) for child, on in reversed(list(below)))
        self._edit(None)
        prim = self.stage.GetPrimAtPath(self.root)
        self.stage.SetDefaultPrim(prim)
        Usd.ModelAPI(prim).SetKind(Kind.Tokens.component)
        if self.end is not None:
            self.stage.SetTimeCodesPerSecond(CODES_PER_SECOND)
            self.stage.SetFramesPerSecond(CODES_PER_SECOND)
            self.stage.SetStartTimeCode(0.0)
            self.stage.SetEndTimeCode(self.end)

    def _mesh_uses(self) -> dict[int, int]:
        """How many nodes use each mesh: what is used twice becomes a prototype."""
        uses: dict[int, int] = {}
        stack = list(self.scene.roots)
        while stack:
            node = stack.pop()
            stack.extend(node.children)
            for mesh in node.meshes:
                uses[mesh] = uses.get(mesh, 0) + 1
        return uses

    def _write_node(
        self, node: legacy.Node, path: Sdf.Path, uses: dict[int, int], *, visible: bool
    ) -> None:
        prim = UsdGeom.Xform.Define(self.stage, path)
        self._display_name(prim.GetPrim(), node.name)
        keep_extras(prim.GetPrim(), node.extras)
        end = write_transform(prim, node, CODES_PER_SECOND)
        if end is not None:
            self.end = max(end, self.end or 0.0)
        if any(channel.loop != "none" for channel in node.animation):
            self._finding(
                findings.Kind.REPLACED, "animation-loop", node, "looping animation is played once"
            )
        if not visible:
            prim.CreateVisibilityAttr(UsdGeom.Tokens.invisible)
        self.places.append(Place(node, path))
        for index in node.meshes:
            mesh = self.scene.meshes[index]
            child = self.names.child(path, mesh.name)
            self.meshes.append(PlacedMesh(child, path, index))
            if uses[index] > 1:
                self._instance(child, index)
            else:
                self._mesh(child, mesh)
        for index in node.cameras:
            camera = self.scene.cameras[index]
            child = self.names.child(path, camera.name)
            write_camera(self.stage, child, camera, unit=self.unit)
            self.first_camera = self.first_camera or str(child)

    def _shown_children(self, node: legacy.Node) -> list[bool]:
        """Of levels of detail the finest stays visible, of switches what is on."""
        count = len(node.children)
        if node.kind == "lod" and len(node.lod_ranges) > 1:
            text = f"{count} levels of detail; the nearest is shown at all distances"
            self._finding(findings.Kind.REPLACED, "lod", node, text)
            real = [low for low, high in node.lod_ranges if high > low]
            nearest = min(real, default=0.0)
            shown = [low == nearest and high > low for low, high in node.lod_ranges]
        elif node.kind == "switch":
            shown = list(node.switch_on)
        elif node.kind == "sequence":
            return [index == 0 for index in range(count)]
        else:
            shown = []
        return [*shown, *[node.kind != "lod" or not shown] * count][:count]

    def _mesh(self, path: Sdf.Path, mesh: legacy.Mesh) -> None:
        prim = write_mesh(self.stage, path, mesh)
        self._display_name(prim, mesh.name)
        if mesh.material is not None:
            bind(prim, self.materials[mesh.material])
        for subset in mesh.subsets:
            material = self.materials[subset.material]
            name = self.names.child(path, material.name).name
            faces = Vt.IntArray.FromNumpy(np.ascontiguousarray(subset.faces, np.int32))
            bind_faces(UsdGeom.Mesh(prim), name, faces, material)

    def _instance(self, path: Sdf.Path, index: int) -> None:
        if index not in self._prototypes:
            mesh = self.scene.meshes[index]
            holder = self.names.child(_PROTOTYPES, mesh.name)
            self.stage.CreateClassPrim(_PROTOTYPES)
            UsdGeom.Xform.Define(self.stage, holder)
            self._mesh(holder.AppendChild("Mesh"), mesh)
            self._prototypes[index] = holder
        prim = UsdGeom.Xform.Define(self.stage, path).GetPrim()
        prim.GetReferences().AddInternalReference(self._prototypes[index])
        prim.SetInstanceable(True)

    def write_node_camera(self, place: Place, camera: legacy.Camera) -> Sdf.Path:
        """A camera at a node that the photometry file names."""
        self._edit("geometry")
        path = self.names.child(place.path, camera.name)
        write_camera(self.stage, path, camera, unit=self.unit)
        return path

    def set_visible(self, place: Place, *, visible: bool) -> None:
        """Switch a node on or off in the photometry layer."""
        self._edit("photometry")
        prim = UsdGeom.Imageable(self.stage.GetPrimAtPath(place.path))
        token = UsdGeom.Tokens.inherited if visible else UsdGeom.Tokens.invisible
        prim.CreateVisibilityAttr(token)

    # -- looks and photometry --------------------------------------------------------------

    def edit_materials(self, layer: str, write: Callable[[Usd.Stage, int, Sdf.Path], None]) -> None:
        """Call ``write(stage, index, path)`` for each material, into one layer."""
        self._edit(layer)
        for index, path in enumerate(self.materials):
            write(self.stage, index, path)
            # Defined in each layer, not merely over: either stays whole when the other is muted.
            spec = self.layers[layer].GetPrimAtPath(path)
            spec.specifier = Sdf.SpecifierDef
            spec.typeName = "Material"

    def write_light(
        self,
        place: Place,
        source: legacy.Light,
        light: PhotometricLight,
        right: tuple[float, float, float] | None = None,
    ) -> Usd.Prim:
        """A light at its node, into the photometry layer; ``right``: where its +X points, C = 0."""
        self._edit("photometry")
        path = self.names.child(place.path, source.name)
        node = UsdGeom.Xformable(self.stage.GetPrimAtPath(place.path))
        # What is animated has no value at the default time.
        world = node.ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime())
        scale, even = uniform_scale(world)
        if not even:
            scale = 1.0
        prim = write_light(self.stage, path, light, scale=scale * self.meters_per_unit)
        self._display_name(prim, source.name)
        self._place_light(prim, source, world, even, right)
        write_legacy_falloff(prim, source.range, source.attenuation)
        keep_extras(prim, source.extras)
        prim.SetCustomDataByKey(
            "hdrusd:legacy",
            {
                "diffuse": Gf.Vec3d(*source.diffuse),
                "specular": Gf.Vec3d(*source.specular),
                "ambient": Gf.Vec3d(*source.ambient),
                "spotExponent": float(source.spot_exponent),
            },
        )
        return prim

    def _place_light(
        self,
        prim: Usd.Prim,
        source: legacy.Light,
        world: Gf.Matrix4d,
        even: bool,
        right: tuple[float, float, float] | None,
    ) -> None:
        """Position and aim below the node; a skewed space above is undone, once."""
        form = UsdGeom.Xformable(prim)
        turn = aim(source.direction, right)
        if not even:
            # A lamp is not squeezed by its node's scale: own space = rigid part of the node's.
            local = Gf.Matrix4d(1.0)
            if turn is not None:
                local.SetRotateOnly(turn)
            local.SetTranslateOnly(Gf.Vec3d(*source.position))
            goal = rigid(local * world)
            if not is_flat(world):
                goal *= world.GetInverse()
            else:  # a space without volume cannot be undone, only left
                form.SetResetXformStack(True)
            form.AddTransformOp().Set(goal)
            return
        if any(source.position):
            form.AddTranslateOp().Set(Gf.Vec3d(*source.position))
        if turn is not None and source.kind != "ambient":
            form.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(turn))

    def free_lamps(self, lamps: Sequence[Lamp]) -> None:
        """Find the fixtures of lamps, and leave them out of their shadows."""
        self._edit("photometry")
        find_fixtures(self.stage, self.scene, self.meshes, lamps)
        for lamp in lamps:
            free_from(lamp.prim, lamp.fixtures)

    def write_ambient(self, light: PhotometricLight) -> Usd.Prim:
        """The sky: AmbientAPI on the default prim, and a dome that says the same to others."""
        self._edit("photometry")
        dome = write_light(self.stage, self.names.child(self.root, "Sky"), light)
        root = self.stage.GetPrimAtPath(self.root)
        root.ApplyAPI("HdrusdAmbientAPI")
        types = Sdf.ValueTypeNames
        root.CreateAttribute("photometric:ambient:illuminance", types.Float, False).Set(
            light.intensity
        )
        root.CreateAttribute("photometric:ambient:color", types.Color3f, False).Set(
            Gf.Vec3f(*light.chromaticity)
        )
        root.CreateRelationship("photometric:ambient:light", False).SetTargets([dome.GetPath()])
        return dome

    def write_settings(self, settings: Settings) -> None:
        """Camera, size and eye, into the root layer."""
        self._edit(None)
        write_settings(self.stage, settings)

    def diagonal(self) -> float:
        """Of the whole scene, m."""
        cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), [UsdGeom.Tokens.default_])
        box = cache.ComputeWorldBound(self.stage.GetPseudoRoot()).ComputeAlignedRange()
        return 0.0 if box.IsEmpty() else float(box.GetSize().GetLength()) * self.meters_per_unit

    def save(self) -> None:
        """Write all layers; the root, by which the rest is found, comes last. Raises OSError."""
        for layer in (*self.layers.values(), self.stage.GetRootLayer()):
            try:
                saved = layer.Save()
            except Tf.ErrorException as problem:
                raise OSError(f"{layer.identifier}: {problem}") from problem
            if not saved:
                raise OSError(f"{layer.identifier}: cannot be written")

    def _edit(self, layer: str | None) -> None:
        target = self.stage.GetRootLayer() if layer is None else self.layers[layer]
        self.stage.SetEditTarget(target)

    def _display_name(self, prim: Usd.Prim, name: str) -> None:
        if name and prim.GetName() != name:
            prim.SetDisplayName(name[:200])

    def _finding(self, kind: findings.Kind, code: str, node: legacy.Node, text: str) -> None:
        self.report.add(kind, code, node.source, node.name, text)
