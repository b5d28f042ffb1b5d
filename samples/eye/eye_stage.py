"""A USD stage written by pxr alone: meshes, materials, lights and cameras in photometric units.

Metres, Z up, 24 time codes a second from 0. Shapes come from the sample street's modeller.
Each light has UsdLux numbers in nits, which any renderer reads, and hdrusd's photometric
attributes, which say the same in candela or lux.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, Vt

import hdrusd.schemas

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "street"))

from street_model import Mesh, Node, Vec3

hdrusd.schemas.register()

FPS = 24
SIZE = (640, 360)

#: Weights of luminance (ITU-R BT.709).
_LUMINANCE = np.array((0.2126, 0.7152, 0.0722))

Types = Sdf.ValueTypeNames


@dataclass(frozen=True)
class Finish:
    """A surface: reflectance, or the luminance of what glows.

    With a ``texture`` (sRGB) the reflectance is texture^2.2 times ``reflectance``, the
    luminance is that of the picture's white. ``roughness`` None: matt, no highlight.
    ``share`` of the light from everywhere arrives; ``daylight`` names a picture of it over the
    primvar of that name.
    """

    name: str
    reflectance: Vec3 = (0.5, 0.5, 0.5)
    texture: str = ""
    tile: float = 2.0  # m that one repeat of the texture covers
    roughness: float | None = None
    f0: float = 0.04
    luminance: float = 0.0  # cd/m2
    kelvin: float = 0.0  # of the light it gives; 0: of this colour
    colour: Vec3 = (1.0, 1.0, 1.0)
    share: float = 1.0
    daylight: str = ""
    source: str = ""  # of the numbers


def tint(kelvin: float, colour: Vec3 = (1.0, 1.0, 1.0)) -> Gf.Vec3f:
    """Linear Rec. 709 of luminance 1: of a black body, or of ``colour`` where that has 0 K."""
    rgb = np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin) if kelvin else colour)
    return Gf.Vec3f(*map(float, rgb / (_LUMINANCE @ rgb)))


class EyeStage:
    """The stage while it is written; ``save`` ends it."""

    def __init__(self, path: Path, seconds: float) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        layer = Sdf.Layer.CreateAnonymous(".usda")
        self.path, self.stage = path, Usd.Stage.Open(layer)
        self.end = round(seconds * FPS) - 1
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        UsdGeom.SetStageUpAxis(self.stage, UsdGeom.Tokens.z)
        self.stage.SetTimeCodesPerSecond(FPS)
        self.stage.SetFramesPerSecond(FPS)
        self.stage.SetStartTimeCode(0)
        self.stage.SetEndTimeCode(self.end)
        world = UsdGeom.Xform.Define(self.stage, "/World")
        self.stage.SetDefaultPrim(world.GetPrim())
        self._finishes: dict[Finish, UsdShade.Material] = {}

    def save(self) -> Path:
        """Write the file, whole or not at all."""
        temporary = self.path.with_name(f".{self.path.name}")
        self.stage.GetRootLayer().Export(str(temporary))
        return temporary.replace(self.path)

    # -- places ----------------------------------------------------------------------------

    def place(
        self,
        path: str,
        keys: Sequence[tuple[float, Vec3]] | Vec3 = (0.0, 0.0, 0.0),
        *,
        heading: Sequence[tuple[float, float]] | float = 0.0,
        tilt: float = 0.0,
    ) -> str:
        """An Xform at a point, or at keys of (s, point), linear between them.

        ``heading`` in degrees about +Z, also by keys; then ``tilt`` about its own +X.
        """
        form = UsdGeom.Xform.Define(self.stage, f"/World/{path}")
        self._move(form, keys, heading, tilt)
        return str(form.GetPath())

    def _move(
        self,
        form: UsdGeom.Xformable,
        keys: Sequence[tuple[float, Vec3]] | Vec3,
        heading: Sequence[tuple[float, float]] | float,
        tilt: float,
    ) -> None:
        move, turn = form.AddTranslateOp(), form.AddRotateZOp()
        if isinstance(keys[0], tuple):
            for seconds, point in keys:
                move.Set(Gf.Vec3d(*point), seconds * FPS)
        else:
            move.Set(Gf.Vec3d(*keys))
        if isinstance(heading, (int, float)):
            turn.Set(float(heading))
        else:
            for seconds, degrees in heading:
                turn.Set(float(degrees), seconds * FPS)
        if tilt:
            form.AddRotateXOp().Set(float(tilt))

    def camera(
        self,
        name: str,
        keys: Sequence[tuple[float, Vec3]] | Vec3,
        fov: float,
        heading: Sequence[tuple[float, float]] | float = 0.0,
        tilt: float = 0.0,
    ) -> None:
        """A camera that looks along +Y, turned by ``heading``; ``fov``: degrees across.

        It becomes that of the render settings.
        """
        camera = UsdGeom.Camera.Define(self.stage, f"/World/{name}")
        self._move(camera, keys, heading, 90.0 + tilt)
        aperture = 36.0
        camera.CreateHorizontalApertureAttr(aperture)
        camera.CreateVerticalApertureAttr(aperture * SIZE[1] / SIZE[0])
        camera.CreateFocalLengthAttr(aperture / 2.0 / math.tan(math.radians(fov) / 2.0))
        camera.CreateClippingRangeAttr(Gf.Vec2f(0.05, 5000.0))
        settings = UsdRender.Settings.Define(self.stage, "/Render/Settings")
        settings.CreateCameraRel().SetTargets([camera.GetPath()])
        settings.CreateResolutionAttr(Gf.Vec2i(*SIZE))
        self.stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")

    # -- surfaces --------------------------------------------------------------------------

    def surfaces(
        self, parent: str, meshes: Iterable[Mesh], *, daylight: tuple[float, float] | None = None
    ) -> None:
        """Meshes of the street's modeller below a place, their materials being Finishes.

        ``daylight``: y of the two ends of the daylight picture.
        """
        for mesh in meshes:
            prim = UsdGeom.Mesh.Define(self.stage, f"{parent}/{mesh.name}")
            corners = np.concatenate([mesh.quads.ravel(), mesh.tris.ravel()]).astype(np.int32)
            counts = np.repeat((4, 3), (len(mesh.quads), len(mesh.tris))).astype(np.int32)
            prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corners))
            prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(counts))
            prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.points.astype(np.float32)))
            prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(mesh.normals.astype(np.float32)))
            prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
            prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
            box = np.stack((mesh.points.min(axis=0), mesh.points.max(axis=0)))
            prim.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(box.astype(np.float32)))
            primvars = UsdGeom.PrimvarsAPI(prim)
            if mesh.material.texture:
                self._coordinates(primvars, "st", mesh.uvs)
            if daylight is not None:
                along = (mesh.points[:, 1] - daylight[0]) / (daylight[1] - daylight[0])
                self._coordinates(primvars, "daylight", np.stack((along, 0 * along + 0.5), axis=1))
            UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(self._material(mesh.material))

    def _coordinates(self, primvars: UsdGeom.PrimvarsAPI, name: str, uvs: np.ndarray) -> None:
        primvar = primvars.CreatePrimvar(name, Types.TexCoord2fArray, UsdGeom.Tokens.vertex)
        primvar.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(uvs, np.float32)))

    def tree(self, parent: str, root: Node) -> None:
        """A tree of the street's modeller: of levels of detail the finest."""
        for node in root.shown():
            self.tree(parent, node)
        self.surfaces(parent, root.meshes)

    def _material(self, finish: Finish) -> UsdShade.Material:
        if finish in self._finishes:
            return self._finishes[finish]
        path = f"/World/Looks/{finish.name}"
        material = UsdShade.Material.Define(self.stage, path)
        shader = UsdShade.Shader.Define(self.stage, f"{path}/Surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        # F0 itself; black is a surface without a highlight, which is quick to draw.
        shader.CreateInput("useSpecularWorkflow", Types.Int).Set(1)
        f0 = 0.0 if finish.roughness is None else finish.f0
        shader.CreateInput("specularColor", Types.Color3f).Set(Gf.Vec3f(f0))
        shader.CreateInput("roughness", Types.Float).Set(finish.roughness or 1.0)
        glow = finish.luminance * np.array(tint(finish.kelvin, finish.colour))
        inputs = {"diffuseColor": (0.0, 0.0, 0.0) if any(glow) else finish.reflectance}
        if any(glow):
            inputs["emissiveColor"] = tuple(map(float, glow))
        for name, value in inputs.items():
            used = shader.CreateInput(name, Types.Color3f)
            if finish.texture and any(value):
                node = self._picture(path, "Picture", finish.texture, "st", "sRGB", value)
                used.ConnectToSource(node, "rgb")
            else:
                used.Set(Gf.Vec3f(*value))
        if finish.daylight:
            node = self._picture(path, "Daylight", finish.daylight, "daylight", "raw")
            shader.CreateInput("occlusion", Types.Float).ConnectToSource(node, "r")
        elif finish.share != 1.0:
            shader.CreateInput("occlusion", Types.Float).Set(finish.share)
        self._provenance(material.GetPrim(), finish)
        self._finishes[finish] = material
        return material

    def _picture(
        self, path: str, name: str, file: str, primvar: str, space: str, scale: Vec3 = (1, 1, 1)
    ) -> UsdShade.ConnectableAPI:
        reader = UsdShade.Shader.Define(self.stage, f"{path}/{name}Place")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Types.String).Set(primvar)
        node = UsdShade.Shader.Define(self.stage, f"{path}/{name}")
        node.CreateIdAttr("UsdUVTexture")
        node.CreateInput("file", Types.Asset).Set(f"./textures/{file}")
        node.CreateInput("sourceColorSpace", Types.Token).Set(space)
        node.CreateInput("scale", Types.Float4).Set(Gf.Vec4f(*scale, 1.0))
        wrap = "repeat" if space == "sRGB" else "clamp"
        for side in ("wrapS", "wrapT"):
            node.CreateInput(side, Types.Token).Set(wrap)
        node.CreateInput("st", Types.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
        return node.ConnectableAPI()

    def _provenance(self, prim: Usd.Prim, finish: Finish) -> None:
        if finish.luminance:
            prim.ApplyAPI("HdrusdPhotometricMaterialAPI")
            prim.GetAttribute("photometric:luminance").Set(finish.luminance)
            prim.GetAttribute("photometric:provenance").Set("authored")
            if finish.source:
                prim.GetAttribute("photometric:source").Set(finish.source)

    # -- lights ----------------------------------------------------------------------------

    def rectangle(
        self,
        path: str,
        centre: Vec3,
        size: tuple[float, float],
        luminance: float,
        *,
        kelvin: float = 0.0,
        shadows: bool = True,
        source: str = "",
    ) -> Usd.Prim:
        """A flat lamp, ``size`` along x and y, that shines down: I = L A."""
        light = UsdLux.RectLight.Define(self.stage, f"/World/{path}")
        light.CreateWidthAttr(size[0])
        light.CreateHeightAttr(size[1])
        light.AddTranslateOp().Set(Gf.Vec3d(*centre))
        candela = luminance * size[0] * size[1]
        return self._light(
            light, luminance, kelvin, shadows, source, ("luminousIntensity", candela)
        )

    def ball(
        self,
        path: str,
        centre: Vec3,
        radius: float,
        candela: float,
        *,
        kelvin: float = 0.0,
        source: str = "",
    ) -> Usd.Prim:
        """A lamp that shines alike to all sides; it is a point, seen as little as one."""
        light = UsdLux.SphereLight.Define(self.stage, f"/World/{path}")
        light.CreateRadiusAttr(radius)
        light.CreateTreatAsPointAttr(True)
        light.AddTranslateOp().Set(Gf.Vec3d(*centre))
        nits = candela / (math.pi * radius**2)
        return self._light(light, nits, kelvin, True, source, ("luminousIntensity", candela))

    def beam(
        self, path: str, centre: Vec3, radius: float, file: str, *, tilt: float, kelvin: float,
        source: str,
    ) -> Usd.Prim:  # fmt: skip
        """A lamp that looks along +Y, ``tilt`` degrees up, with the candela of a file."""
        light = UsdLux.SphereLight.Define(self.stage, path)
        light.CreateRadiusAttr(radius)
        light.CreateTreatAsPointAttr(True)
        light.AddTranslateOp().Set(Gf.Vec3d(*centre))
        light.AddRotateXOp().Set(90.0 + tilt)  # 90: -Z becomes +Y, +Y becomes +Z
        shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
        shaping.CreateShapingIesFileAttr(f"./{file}")
        nits = 1.0 / (math.pi * radius**2)  # times the file's candela
        return self._light(light, nits, kelvin, True, source)

    def distant(
        self, path: str, heading: float, elevation: float, illuminance: float, *, source: str,
        kelvin: float = 0.0, angle: float = 0.53,
    ) -> Usd.Prim:  # fmt: skip
        """A sun or a moon ``elevation`` degrees high, its light going towards ``heading``.

        E = L pi sin^2(angle / 2) on a plane that faces it.
        """
        light = UsdLux.DistantLight.Define(self.stage, f"/World/{path}")
        light.CreateAngleAttr(angle)
        light.AddRotateZOp().Set(heading)
        light.AddRotateXOp().Set(90.0 - elevation)
        nits = illuminance / (math.pi * math.sin(math.radians(angle) / 2.0) ** 2)
        return self._light(light, nits, kelvin, True, source, ("illuminance", illuminance))

    def _light(
        self,
        light: UsdLux.BoundableLightBase | UsdLux.NonboundableLightBase,
        nits: float,
        kelvin: float,
        shadows: bool,
        source: str,
        photometric: tuple[str, float] | None = None,
    ) -> Usd.Prim:
        light.CreateIntensityAttr(nits)
        light.CreateNormalizeAttr(False)
        light.CreateColorAttr(tint(kelvin))
        prim = light.GetPrim()
        if not shadows:
            UsdLux.ShadowAPI.Apply(prim).CreateShadowEnableAttr(False)
        prim.ApplyAPI("HdrusdPhotometricLightAPI")
        if photometric is not None:
            prim.GetAttribute(f"inputs:photometric:{photometric[0]}").Set(photometric[1])
        prim.GetAttribute("photometric:provenance").Set("authored")
        if source:
            prim.GetAttribute("photometric:source").Set(source)
        return prim

    def ambient(
        self, illuminance: float, colour: Vec3 = (1.0, 1.0, 1.0), *, dome: bool = True
    ) -> None:
        """Light from everywhere alike, lx; with the dome that says so to other renderers."""
        hue = tint(0.0, colour)
        root = self.stage.GetDefaultPrim()
        root.ApplyAPI("HdrusdAmbientAPI")
        root.GetAttribute("photometric:ambient:illuminance").Set(illuminance)
        root.GetAttribute("photometric:ambient:color").Set(hue)
        if dome:
            sky = UsdLux.DomeLight.Define(self.stage, "/World/Sky")
            sky.CreateIntensityAttr(illuminance / math.pi)
            sky.CreateColorAttr(hue)
            root.GetRelationship("photometric:ambient:light").SetTargets([sky.GetPath()])
