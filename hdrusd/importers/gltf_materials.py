"""Materials of glTF as OpenGL records with the PBR numbers beside them.

glTF 2.0 specification, section 3.9; KHR_materials_pbrSpecularGlossiness,
KHR_materials_unlit, KHR_materials_emissive_strength. Emission is in cd/m2: that is the
unit of ``emissiveFactor`` times texture (KHR_materials_emissive_strength, overview).
What lies over or bends the highlight is in gltf_layers.py.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

from hdrusd.importers.gltf_document import Document, Item, one_line
from hdrusd.importers.gltf_images import Textures, channel
from hdrusd.importers.gltf_layers import clearcoat, reflectance
from hdrusd.legacy.scene import RGB, Material, Texture, normal_texels
from hdrusd.report import Kind

_READ_EXTENSIONS = {
    "KHR_materials_clearcoat",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_materials_emissive_strength",
}
_ALPHA_MODES: dict[str, Literal["opaque", "mask", "blend"]] = {
    "OPAQUE": "opaque",
    "MASK": "mask",
    "BLEND": "blend",
}
_PBR_FIELDS = {"metallic", "roughness"}
#: Fields of the OpenGL record of which glTF knows nothing.
_NOT_IN_GLTF = {"ambient", "specular", "shininess"}

#: Beyond it a normal map's strength says nothing more, and float32 would end.
_STRONGEST = 1e6


@dataclass(slots=True)
class _Surface:
    """What the metallic or the glossy model says."""

    base: tuple[float, ...]  # RGBA
    base_map: Texture | None
    specular: RGB
    pbr: dict[str, float]
    defaults: set[str] = field(default_factory=set)
    maps: dict[str, Texture | None] = field(default_factory=dict)  # by the fields of Material


def read_materials(document: Document, textures: Textures) -> list[Material]:
    """All materials, in the file's order, so that its numbers stay valid."""
    items = document.table("materials")
    return [_material(item, item.name or f"material_{n}", textures) for n, item in enumerate(items)]


def default_material(document: Document) -> Material:
    """The material that glTF gives to a primitive without one: white (section 3.7.2.1)."""
    return Material(
        name="gltf_default",
        source=document.root.ref,
        diffuse=(1.0, 1.0, 1.0),
        emission_cd_m2=True,
        pbr={"metallic": 1.0, "roughness": 1.0},
        defaults=frozenset(_NOT_IN_GLTF | {"diffuse", "alpha", "emission"} | _PBR_FIELDS),
    )


def _material(item: Item, name: str, textures: Textures) -> Material:
    glossy = item.extension("KHR_materials_pbrSpecularGlossiness")
    surface = _metallic(item, textures) if glossy is None else _glossy(glossy, textures)
    mode = _alpha_mode(item)
    opacity_map = None
    if mode != "opaque" and surface.base_map is not None:
        opacity_map = replace(surface.base_map, channel="a")
    emission = _emission(item)
    if emission is None:
        surface.defaults.add("emission")
    lit = item.extension("KHR_materials_unlit") is None
    over = _relief(item, textures)
    if lit:
        over |= clearcoat(item, textures, surface.pbr)
    else:  # it knows no highlight, so exporters leave out factors whose default is metal
        dull = {"metallic": 0.0, "roughness": 1.0}
        surface = replace(surface, specular=(0.0, 0.0, 0.0), pbr=dull, maps={})
    maps: dict[str, Any] = surface.maps | over
    dropped = sorted(set(item.child("extensions").data) - _READ_EXTENSIONS)
    if dropped:
        text = f"dropped: no home yet for {', '.join(one_line(part) for part in dropped)}"
        item.note(Kind.DROPPED, "material-part", text)
    red, green, blue, alpha = surface.base
    return Material(
        name=name,
        source=item.ref,
        diffuse=(red, green, blue),
        specular=surface.specular,
        emission=emission or (0.0, 0.0, 0.0),
        alpha=1.0 if mode == "opaque" else alpha,
        diffuse_map=surface.base_map,
        emission_map=textures.get(item, "emissiveTexture"),
        opacity_map=opacity_map,
        alpha_mode=mode,
        alpha_cutoff=item.number("alphaCutoff", 0.5, low=0.0),
        two_sided=item.flag("doubleSided"),
        lit=lit,
        emission_cd_m2=True,
        pbr=surface.pbr,
        defaults=frozenset(surface.defaults),
        extras=item.extras(),
        **maps,
    )


def _relief(item: Item, textures: Textures) -> dict[str, Texture | None]:
    """The normal map, and the occlusion 1 + strength (x - 1) of its map's red."""
    normal, occlusion = (textures.get(item, f"{key}Texture") for key in ("normal", "occlusion"))
    if normal is not None:
        info = item.child("normalTexture")
        strength = info.number("scale", 1.0, low=-_STRONGEST, high=_STRONGEST)
        scale, bias = normal_texels(strength)
        normal = replace(normal, scale=scale, bias=bias)
    strength = item.child("occlusionTexture").number("strength", 1.0, low=0.0, high=1.0)
    return {
        "normal_map": normal,
        "occlusion_map": channel(occlusion, "r", strength, 1.0 - strength),
    }


def _metallic(item: Item, textures: Textures) -> _Surface:
    pbr = item.child("pbrMetallicRoughness")
    keys = {"metallic": "metallicFactor", "roughness": "roughnessFactor"}
    defaults = _NOT_IN_GLTF | {name for name, key in keys.items() if key not in pbr}
    if "baseColorFactor" not in pbr:
        defaults |= {"diffuse", "alpha"}
    numbers = {name: pbr.number(key, 1.0, low=0.0, high=1.0) for name, key in keys.items()}
    packed = textures.get(pbr, "metallicRoughnessTexture")
    maps = {
        "metallic_map": channel(packed, "b", numbers["metallic"]),
        "roughness_map": channel(packed, "g", numbers["roughness"]),
    }
    if numbers["metallic"] == 0.0:  # as many files say whose picture is occlusion and roughness
        maps["metallic_map"] = None
    specular, numbers = reflectance(item, numbers)
    if specular is None:
        specular = (0.0, 0.0, 0.0)
    else:
        defaults = defaults - {"specular"}
    return _Surface(
        base=_factor(pbr, "baseColorFactor", 4),
        base_map=textures.get(pbr, "baseColorTexture"),
        specular=specular,
        pbr=numbers,
        defaults=set(defaults),
        maps=maps,
    )


def _glossy(item: Item, textures: Textures) -> _Surface:
    defaults = {"ambient", "shininess"}
    if "diffuseFactor" not in item:
        defaults |= {"diffuse", "alpha"}
    if "specularFactor" not in item:
        defaults.add("specular")
    if "glossinessFactor" not in item:
        defaults.add("glossiness")
    red, green, blue = _factor(item, "specularFactor", 3)
    gloss = item.number("glossinessFactor", 1.0, low=0.0, high=1.0)
    shine = textures.get(item, "specularGlossinessTexture")  # its alpha is the glossiness
    return _Surface(
        base=_factor(item, "diffuseFactor", 4),
        base_map=textures.get(item, "diffuseTexture"),
        specular=(red, green, blue),
        pbr={"glossiness": gloss},
        defaults=defaults,
        maps={
            "specular_map": shine,
            "roughness_map": channel(shine, "a", -gloss, 1.0),
        },
    )


def _factor(item: Item, key: str, width: int) -> tuple[float, ...]:
    return item.numbers(key, (1.0,) * width, low=0.0, high=1.0)


def _emission(item: Item) -> RGB | None:
    """Factor times strength in cd/m2, or None where the file does not say."""
    strength_item = item.extension("KHR_materials_emissive_strength")
    strength = 1.0
    if strength_item is not None:
        strength = strength_item.number("emissiveStrength", 1.0, low=0.0)
    if "emissiveFactor" not in item:
        return None
    red, green, blue = item.light_colour("emissiveFactor", (0.0, 0.0, 0.0))
    return red * strength, green * strength, blue * strength


def _alpha_mode(item: Item) -> Literal["opaque", "mask", "blend"]:
    mode = item.text("alphaMode", "OPAQUE")
    if mode not in _ALPHA_MODES:
        text = f"alphaMode {mode[:40]!r}; want OPAQUE, MASK or BLEND; OPAQUE is used"
        item.note(Kind.INVALID, "material-alpha", text)
    return _ALPHA_MODES.get(mode, "opaque")
