"""The one writer: a LegacyScene, walked once, into layers.

street.usda              units, default prim; sublayers, strongest first:
street.photometry.usda   lights, reflectance, cd/m2, our schema
street.look.usda         the look as it was
street.geometry.usdc     nodes, meshes, cameras, bindings, animation
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from pxr import Gf, Kind, Sdf, Usd, UsdGeom

from hdrusd.legacy import scene as legacy
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.usd.ambient import write_ambient
from hdrusd.usd.camera import write_camera
from hdrusd.usd.fixtures import Lamp, PlacedMesh
from hdrusd.usd.freed_lamps import free_lamps
from hdrusd.usd.layer_files import new_layer, save_layer
from hdrusd.usd.light import write_legacy_falloff, write_light
from hdrusd.usd.light_string import write_light_string
from hdrusd.usd.material import display_name, keep_extras
from hdrusd.usd.names import Names
from hdrusd.usd.settings import Settings, write_settings
from hdrusd.usd.transform import aim, is_flat, rigid, uniform_scale
from hdrusd.usd.tree import CODES_PER_SECOND, PROTOTYPES, Place, TreeWriter

LAYERS = ("photometry", "look", "geometry")


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
        write_camera(self.stage, path, camera, unit=self.unit)
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
                spec = Sdf.CreatePrimInLayer(self.layers[layer], path)
                spec.specifier = Sdf.SpecifierDef
                spec.typeName = "Material"
        for index, path in enumerate(self.materials):
            write(self.stage, index, path)

    def write_light(
        self,
        place: Place,
        source: legacy.Light,
        light: PhotometricLight,
        right: tuple[float, float, float] | None = None,
    ) -> Usd.Prim:
        """A light at its node, into the photometry layer; ``right``: where its +X points, C = 0.

        Of a string of lamps the PointInstancer.
        """
        self._edit("photometry")
        path = self.names.child(place.path, source.name)
        # What is in a prototype is in the world where that stands.
        first = self.tree.copies.first(place.path)
        node = UsdGeom.Xformable(self.stage.GetPrimAtPath(first))
        # What is animated has no value at the default time.
        world = node.ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime())
        if source.positions is None:
            scale, even = uniform_scale(world)
            unit = (scale if even else 1.0) * self.meters_per_unit
            prim = write_light(self.stage, path, light, scale=unit)
            self._place_light(prim, source, world, even, right)
        else:
            prim = write_light_string(
                self.stage, path, source, light, world, self.meters_per_unit, right
            )
        display_name(prim, source.name)
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
        cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), [UsdGeom.Tokens.default_])
        box = cache.ComputeWorldBound(self.stage.GetPseudoRoot()).ComputeAlignedRange()
        return 0.0 if box.IsEmpty() else float(box.GetSize().GetLength()) * self.meters_per_unit

    def save(self) -> None:
        """Select states and write all layers; the root, which names them, last. Raises OSError."""
        self.tree.select(self.layers["geometry"], self.layers["photometry"])
        for layer in (*self.layers.values(), self.stage.GetRootLayer()):
            save_layer(layer)

    def _edit(self, layer: str | None) -> None:
        target = self.stage.GetRootLayer() if layer is None else self.layers[layer]
        self.stage.SetEditTarget(target)
