"""The one writer: a LegacyScene, walked once, into layers.

street.usda              units, default prim; sublayers, strongest first:
street.photometry.usda   lights, reflectance, cd/m2, our schema
street.look.usda         the look as it was
street.geometry.usdc     nodes, meshes, cameras, bindings, animation
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Gf, Kind, Sdf, Usd, UsdGeom

from hdrusd.legacy import scene as legacy
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.usd import specs
from hdrusd.usd.ambient import write_ambient
from hdrusd.usd.camera import write_camera
from hdrusd.usd.fixtures import Lamp, PlacedMesh
from hdrusd.usd.freed_lamps import free_lamps
from hdrusd.usd.layer_files import new_layer, save_layer
from hdrusd.usd.light import light_type, write_legacy_falloff, write_light, write_light_spec
from hdrusd.usd.light_string import write_light_string
from hdrusd.usd.names import Names
from hdrusd.usd.placed import extents
from hdrusd.usd.settings import Settings, write_settings
from hdrusd.usd.transform import aim, is_flat, rigid, uniform_scale
from hdrusd.usd.tree import CODES_PER_SECOND, PROTOTYPES, Place, TreeWriter

LAYERS = ("photometry", "look", "geometry")


@dataclass(frozen=True, slots=True)
class LightAt:
    """A light at a node; ``right``: where its +X points, C = 0 of a photometric file.

    ``path``: of ``light_path``; None: the next one.
    """

    place: Place
    source: legacy.Light
    light: PhotometricLight
    right: legacy.Vec3 | None = None
    path: Sdf.Path | None = None


@dataclass(frozen=True, slots=True)
class _World:
    """The space of a node: to the world's, its mean scale, and whether it is even."""

    matrix: Gf.Matrix4d
    scale: float
    even: bool


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
        self.names = Names({top: {"Render": 1, PROTOTYPES.name: 1}})
        self.places: list[Place] = []
        self.meshes: list[PlacedMesh] = []
        self._worlds: dict[Sdf.Path, _World] = {}  # of nodes with lights, in their first places
        self.first_camera: str | None = None
        root = new_layer(folder / f"{stem}.usda")
        self.layers = {
            name: new_layer(folder / f"{stem}.{name}.{'usdc' if name == 'geometry' else 'usda'}")
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
        self.tree = TreeWriter(
            self.stage,
            self.layers["geometry"],
            scene,
            self.names,
            self.root,
            self.materials,
            report,
            unit=self.unit,
            metres=source_unit,
        )

    # -- geometry --------------------------------------------------------------------------

    def write_geometry(self) -> None:
        """Nodes, meshes, cameras, bindings and animation, each into the geometry layer."""
        self._edit("geometry")
        root = UsdGeom.Xform.Define(self.stage, self.root)
        if self.unit != 1.0:
            root.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(self.unit))
        UsdGeom.Scope.Define(self.stage, self.looks)
        self.tree.write()
        self.places, self.meshes = self.tree.places, self.tree.meshes
        shown = [path for path in self.tree.cameras if self.tree.is_shown(path)]
        if shown:
            self.first_camera = str(self.tree.copies.first(shown[0]))
        self._edit(None)
        prim = self.stage.GetPrimAtPath(self.root)
        self.stage.SetDefaultPrim(prim)
        Usd.ModelAPI(prim).SetKind(Kind.Tokens.component)
        if self.tree.animated:
            self.stage.SetTimeCodesPerSecond(CODES_PER_SECOND)
            self.stage.SetFramesPerSecond(CODES_PER_SECOND)
            self.stage.SetStartTimeCode(0.0)
            self.stage.SetEndTimeCode(round(self.tree.end * CODES_PER_SECOND, 6))

    def write_node_camera(self, place: Place, camera: legacy.Camera) -> Sdf.Path:
        """A camera at a node that the photometry file names; where it first stands."""
        self._edit("geometry")
        path = self.names.child(place.path, camera.name)
        with Sdf.ChangeBlock():
            write_camera(specs.define_on(self.stage, path, "Camera"), camera, unit=self.unit)
        return self.tree.copies.first(path)

    def set_visible(self, place: Place, *, visible: bool) -> None:
        """Switch a node on or off in the photometry layer; on: in a state that shows it."""
        self._edit("photometry")
        if visible:
            self.tree.show(place.path)
        prim = UsdGeom.Imageable(self.stage.GetPrimAtPath(place.path))
        token = UsdGeom.Tokens.inherited if visible else UsdGeom.Tokens.invisible
        prim.CreateVisibilityAttr(token)

    # -- looks and photometry --------------------------------------------------------------

    def edit_materials(self, layer: str, write: Callable[[Usd.Stage, int, Sdf.Path], None]) -> None:
        """Call ``write(stage, index, path)`` for each material, into one layer."""
        self._edit(layer)
        # Defined in each layer, not merely over: either stays whole when the other is muted. All
        # at once: one by one they cost a stage the square of their number.
        with Sdf.ChangeBlock():
            for path in self.materials:
                specs.define(self.layers[layer], path, "Material")
        for index, path in enumerate(self.materials):
            write(self.stage, index, path)

    def light_path(self, place: Place, source: legacy.Light) -> Sdf.Path:
        """A free path at a node for a light, whether it is written or not."""
        return self.names.child(place.path, source.name)

    def metres_at(self, places: Iterable[Place]) -> list[float]:
        """What a unit of the space of each node measures in the world, on the mean of all ways.

        Of a node in several places in the first.
        """
        worlds = self._spaces([place.path for place in places])
        return [world.scale * self.meters_per_unit for world in worlds]

    def _spaces(self, nodes: Sequence[Sdf.Path]) -> list[_World]:
        # What is animated has no value at the default time.
        cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        for node in nodes:
            if node not in self._worlds:
                # What is in a prototype is in the world where that stands.
                first = self.stage.GetPrimAtPath(self.tree.copies.first(node))
                matrix = cache.GetLocalToWorldTransform(first)
                self._worlds[node] = _World(matrix, *uniform_scale(matrix))
        return [self._worlds[node] for node in nodes]

    def write_lights(self, lights: Sequence[LightAt]) -> list[Usd.Prim]:
        """Lights at their nodes, into the photometry layer; of a string the PointInstancer."""
        self._edit("photometry")
        layer = self.layers["photometry"]
        paths = [each.path or self.light_path(each.place, each.source) for each in lights]
        worlds = self._spaces([each.place.path for each in lights])
        with Sdf.ChangeBlock():
            for path, each, world in zip(paths, lights, worlds, strict=True):
                source = each.source
                if source.positions is None:
                    prim = specs.define(layer, path, light_type(each.light))
                    unit = (world.scale if world.even else 1.0) * self.meters_per_unit
                    write_light_spec(prim, each.light, scale=unit)
                    self._place_light(prim, each, world)
                else:
                    prim = specs.define(layer, path, "PointInstancer")
                self._keep_source(prim, source)
        for path, each, world in zip(paths, lights, worlds, strict=True):
            if each.source.positions is not None:
                string = (each.source, each.light, world.matrix, self.meters_per_unit, each.right)
                write_light_string(self.stage, path, *string)
        return [self.stage.GetPrimAtPath(path) for path in paths]

    def _keep_source(self, prim: Sdf.PrimSpec, source: legacy.Light) -> None:
        """What the source says of a light, beside what it means."""
        specs.display_name(prim, source.name)
        write_legacy_falloff(prim, source.range, source.attenuation)
        said = {
            "diffuse": Gf.Vec3d(*source.diffuse),
            "specular": Gf.Vec3d(*source.specular),
            "ambient": Gf.Vec3d(*source.ambient),
            "spotExponent": float(source.spot_exponent),
        }
        specs.keep(prim, source.extras, legacy=said)

    def _place_light(self, prim: Sdf.PrimSpec, placed: LightAt, world: _World) -> None:
        """Position and aim below the node; a skewed space above is undone, once."""
        source, types = placed.source, Sdf.ValueTypeNames
        turn = aim(source.direction, placed.right)
        if not world.even:
            # A lamp is not squeezed by its node's scale: own space = rigid part of the node's.
            local = Gf.Matrix4d(1.0)
            if turn is not None:
                local.SetRotateOnly(turn)
            local.SetTranslateOnly(Gf.Vec3d(*source.position))
            goal = rigid(local * world.matrix)
            if not is_flat(world.matrix):
                goal *= world.matrix.GetInverse()
            else:  # a space without volume cannot be undone, only left
                specs.reset_moves(prim)
            specs.move(prim, "transform", types.Matrix4d, goal)
            return
        if any(source.position):
            specs.move(prim, "translate", types.Double3, Gf.Vec3d(*source.position))
        if turn is not None and source.kind != "ambient":
            specs.move(prim, "orient", types.Quatd, Gf.Quatd(turn))

    def free_lamps(self, lamps: Sequence[Lamp]) -> None:
        """Find the fixtures of lamps, and leave them out of their shadows."""
        self._edit("photometry")
        free_lamps(self.stage, self.scene, self.tree, lamps)

    def write_ambient(self, light: PhotometricLight) -> Usd.Prim:
        """The sky: AmbientAPI on the default prim, and a dome that says the same to others."""
        self._edit("photometry")
        dome = write_light(self.stage, self.names.child(self.root, "Sky"), light)
        root = self.stage.GetPrimAtPath(self.root)
        write_ambient(root, light, dome.GetPath())
        return dome

    def photometry_path(self, name: str) -> Sdf.Path:
        """A free path below the root, for what the caller writes into the photometry layer next."""
        self._edit("photometry")
        return self.names.child(self.root, name)

    def write_settings(self, settings: Settings) -> None:
        """Camera, size and eye, into the root layer."""
        self._edit(None)
        write_settings(self.stage, settings)

    def diagonal(self) -> float:
        """Of the whole scene in its selected states, m."""
        return extents(self.stage)[0]

    def save(self) -> None:
        """Select states and write all layers; the root, which names them, last. Raises OSError."""
        self.tree.select(self.layers["geometry"], self.layers["photometry"])
        for layer in (*self.layers.values(), self.stage.GetRootLayer()):
            save_layer(layer)

    def _edit(self, layer: str | None) -> None:
        target = self.stage.GetRootLayer() if layer is None else self.layers[layer]
        self.stage.SetEditTarget(target)
