"""``write_look`` and ``write_photometric``: one Material prim, two layers.

The look layer holds the database as it was (8-bit textures, marked sRGB); the
photometry layer puts a second surface over it, with reflectance maps (raw), cd/m2
and our schema. Muting either leaves the other whole.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pxr import Gf, Sdf, Usd, UsdShade

from hdrusd.legacy.scene import RGB, Four, Material, Texture, UVTransform
from hdrusd.photometry.confidence import confidence
from hdrusd.usd.preview import roughness_from_shininess

_API = "HdrusdPhotometricMaterialAPI"

_NONE: Four = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Map:
    """A texture file as a material uses it; ``file`` is relative to the layer."""

    file: str
    texture: Texture
    raw: bool
    scale: RGB = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Surface:
    """What a surface is in photometric terms, ready to be written."""

    diffuse: RGB  # D
    gamma: float
    specular: RGB = (0.0, 0.0, 0.0)
    diffuse_map: Map | None = None  # reflectance map, R = T^gamma D
    source_texture: str = ""
    emission: RGB = (0.0, 0.0, 0.0)  # cd/m2, at 1.0 of its map
    luminance: float = 0.0  # cd/m2
    peak: bool = False  # ``emission`` is that of its map's brightest texel, not of full code
    emission_map: Map | None = None
    replaces_reflection: bool = False
    opacity_map: Map | None = None
    specular_map: Map | None = None
    #: "normal", "occlusion", "metallic", "roughness", "clearcoat", "clearcoat_roughness".
    data_maps: Mapping[str, Map] = field(default_factory=dict)
    vertex_color: str = ""
    vertex_opacity: str = ""
    provenance: str = ""
    rule: str = ""
    source: str = ""


def write_look(
    stage: Usd.Stage,
    path: Sdf.Path,
    material: Material,
    maps: dict[str, Map],
    vertex_color: str,
    vertex_opacity: str = "",
) -> None:
    """The legacy look as UsdPreviewSurface; ``maps`` by "diffuse", "normal": as the fields.

    ``vertex_color``, ``vertex_opacity``: primvars that it reads, or nothing. A picture without a
    map is missing, refused or broken: the reference stays in the extras.
    """
    network = _Network(stage, path, "Look")
    network.color("diffuseColor", material.diffuse, maps.get("diffuse"), vertex_color)
    network.color("emissiveColor", _shown(material), maps.get("emission"), "")
    prim = network.material.GetPrim()
    display_name(prim, material.name)
    lost = {
        name: texture.image.name
        for name, texture in material.maps().items()
        if name.removesuffix("_map") not in maps
    }
    keep_extras(prim, {**material.extras, **lost})
    _write_common(network, material, material.specular, maps, vertex_opacity)


def write_photometric(
    stage: Usd.Stage, path: Sdf.Path, material: Material, surface: Surface
) -> None:
    """The photometric surface over the look, and the schema that says how it came about."""
    network = _Network(stage, path, "Photometric")
    black = (0.0, 0.0, 0.0)
    if surface.replaces_reflection:
        network.color("diffuseColor", black, None, "")
    else:
        network.color("diffuseColor", surface.diffuse, surface.diffuse_map, surface.vertex_color)
    network.color("emissiveColor", surface.emission, surface.emission_map, "")
    specular = black if surface.replaces_reflection else surface.specular
    maps = {} if surface.replaces_reflection else dict(surface.data_maps)
    for role, used in (("opacity", surface.opacity_map), ("specular", surface.specular_map)):
        if used is not None:
            maps[role] = used
    dark = surface.replaces_reflection
    _write_common(network, material, specular, maps, surface.vertex_opacity, dark=dark)
    prim = network.material.GetPrim()
    prim.ApplyAPI(_API)
    types = Sdf.ValueTypeNames
    _set(prim, "photometric:gamma", types.Float, surface.gamma)
    _set(prim, "photometric:diffuse", types.Color3f, Gf.Vec3f(*surface.diffuse))
    if surface.source_texture:
        _set(prim, "photometric:sourceTexture", types.Asset, Sdf.AssetPath(surface.source_texture))
    if surface.luminance > 0.0:
        value = prim.CreateAttribute("photometric:luminance", types.Float, False)
        value.Set(surface.luminance)
    if surface.emission_map is not None:
        asset = Sdf.AssetPath(surface.emission_map.file)
        _set(prim, "photometric:hdrTexture", types.Asset, asset)
    if surface.vertex_color:
        _set(prim, "photometric:vertexColor", types.Token, surface.vertex_color)
    if surface.provenance:
        _set(prim, "photometric:provenance", types.Token, surface.provenance)
    if surface.rule:
        _set(prim, "photometric:rule", types.String, surface.rule)
    if surface.source:
        _set(prim, "photometric:source", types.String, surface.source)
    trust = confidence(surface.provenance, surface.rule, surface.source)
    _set(prim, "photometric:confidence", types.Token, trust)
    if material.pbr is None:
        _set(prim, "legacy:specularColor", types.Color3f, Gf.Vec3f(*specular))
        _set(prim, "legacy:shininess", types.Float, material.shininess)
    _set(prim, "legacy:ambient", types.Color3f, Gf.Vec3f(*material.ambient))
    _set(prim, "legacy:emission", types.Color3f, Gf.Vec3f(*material.emission))


def _shown(material: Material) -> RGB:
    """Emission as the LDR look shows it: cd/m2 has no place there, white is 1."""
    peak = max(material.emission)
    if not material.emission_cd_m2 or peak <= 1.0:
        return material.emission
    r, g, b = (c / peak for c in material.emission)
    return r, g, b


def _write_common(
    network: _Network,
    material: Material,
    specular: RGB,
    maps: Mapping[str, Map],
    vertex_opacity: str,
    *,
    dark: bool = False,
) -> None:
    """Gloss, opacity and data, which both surfaces share; a dark one reflects nothing at all."""
    pbr = material.pbr or {}
    roughness = pbr.get("roughness", roughness_from_shininess(material.shininess))
    if "glossiness" in pbr:
        roughness = 1.0 - pbr["glossiness"]
    if dark or material.pbr is None or "glossiness" in pbr:
        network.number("useSpecularWorkflow", 1, Sdf.ValueTypeNames.Int)
        network.color("specularColor", specular, maps.get("specular"), "")
    else:
        network.data("metallic", pbr.get("metallic", 0.0), maps.get("metallic"))
        if "ior" in pbr:
            network.number("ior", pbr["ior"])
    network.data("roughness", roughness, maps.get("roughness"))
    if "clearcoat" in pbr and not dark:
        network.data("clearcoat", pbr["clearcoat"], maps.get("clearcoat"))
        sharp = pbr.get("clearcoat_roughness", 0.0)
        network.data("clearcoatRoughness", sharp, maps.get("clearcoat_roughness"))
    if "occlusion" in maps:
        network.data("occlusion", 1.0, maps["occlusion"])
    if "normal" in maps:
        network.normal(maps["normal"])
    if material.alpha_mode == "opaque" or (
        material.alpha_mode == "mask" and material.alpha_cutoff <= 0.0  # which nothing is below
    ):
        return
    if "opacity" in maps:
        network.scalar("opacity", maps["opacity"], material.alpha)
    else:
        network.number("opacity", material.alpha)
        if vertex_opacity:
            network.primvar("opacity", vertex_opacity, "float", material.alpha)
    if material.alpha_mode == "mask":
        network.number("opacityThreshold", material.alpha_cutoff)
    else:  # what blends fades whole, highlight and glow with it: OpenGL's and glTF's alpha
        network.token("opacityMode", "presence")


class _Network:
    """One UsdPreviewSurface under a Material, texture nodes made as they are asked for."""

    def __init__(self, stage: Usd.Stage, path: Sdf.Path, name: str) -> None:
        self.stage = stage
        self.material = UsdShade.Material.Define(stage, path)
        self.path = path.AppendChild(name)
        self.surface = UsdShade.Shader.Define(stage, self.path)
        self.surface.CreateIdAttr("UsdPreviewSurface")
        output = self.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        self.material.CreateSurfaceOutput().ConnectToSource(output)

    def color(self, name: str, value: RGB, used: Map | None, primvar: str) -> None:
        port = self.surface.CreateInput(name, Sdf.ValueTypeNames.Color3f)
        port.Set(Gf.Vec3f(*value))
        if used is not None:
            port.ConnectToSource(self._texture(name, used, (*used.scale, 1.0)), "rgb")
        elif primvar:
            self.primvar(name, primvar, "float3", Gf.Vec3f(*value))

    def primvar(self, name: str, primvar: str, kind: str, absent: object) -> None:
        """What a mesh says of an input; ``absent`` where it says nothing."""
        reader = self._node(f"{name}_primvar", f"UsdPrimvarReader_{kind}")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(primvar)
        reader.CreateInput("fallback", Sdf.ValueTypeNames.Find(kind)).Set(absent)
        reader.CreateOutput("result", Sdf.ValueTypeNames.Find(kind))
        self.surface.GetInput(name).ConnectToSource(reader.ConnectableAPI(), "result")

    def number(
        self, name: str, value: float, kind: Sdf.ValueTypeName = Sdf.ValueTypeNames.Float
    ) -> None:
        self.surface.CreateInput(name, kind).Set(value)

    def token(self, name: str, value: str) -> None:
        self.surface.CreateInput(name, Sdf.ValueTypeNames.Token).Set(value)

    def scalar(self, name: str, used: Map, factor: float) -> None:
        """One channel of a texture, times ``factor``."""
        self._channel(name, used, (factor,) * 4)

    def data(self, name: str, value: float, used: Map | None) -> None:
        """A number, or one channel of a texture by its own scale and bias in its place."""
        self.number(name, value)
        if used is not None:
            self._channel(name, used, used.texture.scale, used.texture.bias)

    def normal(self, used: Map) -> None:
        """A normal map in tangent space."""
        port = self.surface.CreateInput("normal", Sdf.ValueTypeNames.Normal3f)
        node = self._texture("normal", used, used.texture.scale, used.texture.bias)
        port.ConnectToSource(node, "rgb")

    def _channel(self, name: str, used: Map, scale: Four, bias: Four = _NONE) -> None:
        port = self.surface.CreateInput(name, Sdf.ValueTypeNames.Float)
        channel = "r" if used.texture.channel == "rgb" else used.texture.channel
        port.ConnectToSource(self._texture(name, used, scale, bias), channel)

    def _texture(
        self, name: str, used: Map, scale: Four, bias: Four = _NONE
    ) -> UsdShade.ConnectableAPI:
        node = self._node(f"{name}_texture", "UsdUVTexture")
        types, texture = Sdf.ValueTypeNames, used.texture
        node.CreateInput("file", types.Asset).Set(Sdf.AssetPath(used.file))
        node.CreateInput("sourceColorSpace", types.Token).Set("raw" if used.raw else "sRGB")
        node.CreateInput("wrapS", types.Token).Set(texture.wrap_s)
        node.CreateInput("wrapT", types.Token).Set(texture.wrap_t)
        if scale != (1.0, 1.0, 1.0, 1.0):
            node.CreateInput("scale", types.Float4).Set(Gf.Vec4f(*scale))
        if bias != _NONE:
            node.CreateInput("bias", types.Float4).Set(Gf.Vec4f(*bias))
        reader = self._node(f"{name}_st", "UsdPrimvarReader_float2")
        reader.CreateInput("varname", types.String).Set(texture.uv_set)
        reader.CreateOutput("result", types.Float2)
        coordinates = reader
        if texture.transform is not None:
            coordinates = self._transform(name, texture.transform, reader)
        node.CreateInput("st", types.Float2).ConnectToSource(coordinates.ConnectableAPI(), "result")
        for output, kind in (("rgb", types.Float3), *((c, types.Float) for c in "rgba")):
            node.CreateOutput(output, kind)
        return node.ConnectableAPI()

    def _transform(
        self, name: str, transform: UVTransform, reader: UsdShade.Shader
    ) -> UsdShade.Shader:
        node = self._node(f"{name}_transform", "UsdTransform2d")
        types = Sdf.ValueTypeNames
        node.CreateInput("in", types.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
        node.CreateInput("scale", types.Float2).Set(Gf.Vec2f(*transform.scale))
        node.CreateInput("rotation", types.Float).Set(transform.rotation)
        node.CreateInput("translation", types.Float2).Set(Gf.Vec2f(*transform.translation))
        node.CreateOutput("result", types.Float2)
        return node

    def _node(self, name: str, kind: str) -> UsdShade.Shader:
        # Beside the surface: a shader may not hold others, only a material or a node graph.
        beside = self.path.GetParentPath().AppendChild(f"{self.path.name}_{name}")
        node = UsdShade.Shader.Define(self.stage, beside)
        node.CreateIdAttr(kind)
        return node


def _set(prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    prim.CreateAttribute(name, kind, False, Sdf.VariabilityUniform).Set(value)


def display_name(prim: Usd.Prim, name: str) -> None:
    """Keep a source's name where the prim's differs."""
    if name and prim.GetName() != name:
        prim.SetDisplayName(name[:200])


def keep_extras(prim: Usd.Prim, extras: Mapping[str, Any]) -> None:
    """What a source says beyond its format, as JSON in the prim's metadata."""
    if extras:
        prim.SetCustomDataByKey("hdrusd:extras", json.dumps(dict(extras), default=str))


def bind(prim: Usd.Prim, material: Sdf.Path) -> None:
    """Bind a material by path; its prim may stand in another layer."""
    UsdShade.MaterialBindingAPI.Apply(prim).GetDirectBindingRel().SetTargets([material])
