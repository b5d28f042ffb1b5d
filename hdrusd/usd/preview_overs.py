"""UsdPreviewSurface of a source stage: ``read_source_surface``, and ``write_surface_over``.

The network stays as it is. Over it come a new texture node beside the surface where a picture
becomes a reflectance map or shows cd/m2, the values that a photometry rule states, and
``HdrusdPhotometricMaterialAPI`` on the material.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from pxr import Gf, Sdf, Usd, UsdShade

from hdrusd.legacy.scene import RGB, Material, Texture
from hdrusd.report import Kind
from hdrusd.usd.material import Map, Surface
from hdrusd.usd.network import Findings, Node, Values, surface_nodes
from hdrusd.usd.overs import Overs
from hdrusd.usd.textures import UDIM

API = "HdrusdPhotometricMaterialAPI"

#: Inputs of a UsdUVTexture that a node in its place takes over.
_TEXTURE_INPUTS = ("st", "wrapS", "wrapT", "fallback")

_TYPES = Sdf.ValueTypeNames
_BLACK, _WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)

#: The picture that a texture node names, for a thing of the material; None where there is none
#: that may be read. "diffuseColor" and "emissiveColor" are the things.
PictureOf = Callable[[Node, str], Texture | None]


@dataclass(frozen=True, slots=True)
class SourceSurface:
    """A material of a source stage.

    ``material``: in the terms of the other formats. ``diffuse``, ``emission``: the texture
    nodes that feed these, where they are pictures with a factor.
    """

    prim: Usd.Prim
    surface: Node
    material: Material
    diffuse: Node | None = None
    emission: Node | None = None
    fixed: frozenset[str] = field(default_factory=frozenset)  # inputs that nodes unknown feed


def is_photometric(prim: Usd.Prim) -> bool:
    """Whether a material has our schema already."""
    return bool(prim.HasAPI(API))


def preview_surface(material: UsdShade.Material) -> Node | None:
    """The UsdPreviewSurface of a material, or None."""
    nodes = surface_nodes(material, Usd.TimeCode.EarliestTime())
    return next((node for node in nodes if node.id == "UsdPreviewSurface"), None)


def read_source_surface(
    prim: Usd.Prim, surface: Node, findings: Findings, picture_of: PictureOf, *, emission_map: bool
) -> SourceSurface:
    """A material in the terms of the other formats.

    ``diffuse_map`` is set where the diffuse texture is an 8-bit picture for a screen, so that
    R = T^gamma D; a picture that holds reflectance stays as it is. ``emission_map``: whether
    to look at the picture of the emission, too.
    """
    fixed: set[str] = set()
    diffuse_node, diffuse = _color(surface, "diffuseColor", (0.18,) * 3, findings, fixed)
    emission_node, emission = _color(surface, "emissiveColor", _BLACK, findings, fixed)
    roughness = _constant(surface, "roughness", 0.5, findings)
    if surface.value("useSpecularWorkflow", 0) == 1:
        pbr = {"glossiness": 1.0 - roughness}
        specular = _three(findings.numbers(surface, "specularColor", _BLACK))
    else:
        pbr = {"metallic": _constant(surface, "metallic", 0.0, findings), "roughness": roughness}
        specular = _BLACK
    picture = glow = None
    if diffuse_node is not None and not _raw(diffuse_node):
        picture = picture_of(diffuse_node, "diffuseColor")
    if emission_node is not None and emission_map:
        glow = picture_of(emission_node, "emissiveColor")
    material = Material(
        name=prim.GetName(),
        source=findings.place,
        diffuse=diffuse,
        specular=specular,
        emission=emission,
        diffuse_map=picture,
        emission_map=glow,
        emission_cd_m2=True,
        pbr=pbr,
    )
    return SourceSurface(prim, surface, material, diffuse_node, emission_node, frozenset(fixed))


def write_surface_over(
    overs: Overs, source: SourceSurface, glossed: Material, made: Surface, *, hdr: bool
) -> None:
    """The surface in photometric terms over the source's.

    ``glossed``: the material with the highlight that a rule states; ``hdr``: whether the
    emission follows the diffuse picture.
    """
    surface, plain = source.surface.shader.GetPrim(), source.material

    def color(name: str, value: RGB) -> None:
        overs.value(surface, f"inputs:{name}", _TYPES.Color3f, Gf.Vec3f(*value))

    if made.replaces_reflection:
        color("diffuseColor", _BLACK)
        _gloss(overs, source, _BLACK, None)
        coat = source.surface
        if coat.authored("clearcoat") or coat.source("clearcoat") is not None:
            overs.value(surface, "inputs:clearcoat", _TYPES.Float, 0.0)
    else:
        if made.diffuse_map is not None and source.diffuse is not None:
            texture = _file(made.diffuse_map), _WHITE
            _texture(overs, source, "diffuseColor", source.diffuse, *texture)
        elif made.diffuse != plain.diffuse and "diffuseColor" not in source.fixed:
            if source.diffuse is None:
                color("diffuseColor", made.diffuse)
            else:  # a picture of reflectance, with a factor of its own
                factor = Gf.Vec4f(*made.diffuse, 1.0)
                overs.value(source.diffuse.shader.GetPrim(), "inputs:scale", _TYPES.Float4, factor)
        if glossed is not plain:
            pbr = glossed.pbr or {}
            roughness = pbr.get("roughness", 1.0 - pbr.get("glossiness", 0.0))
            _gloss(overs, source, made.specular if "glossiness" in pbr else None, roughness)
        elif made.specular != plain.specular:
            color("specularColor", made.specular)
    template = source.diffuse if hdr else source.emission
    if made.emission_map is not None and template is not None:
        texture = _file(made.emission_map), made.emission
        _texture(overs, source, "emissiveColor", template, *texture)
    elif made.emission != plain.emission and "emissiveColor" not in source.fixed:
        color("emissiveColor", made.emission)
    _describe(overs, source.prim, made)


def _describe(overs: Overs, prim: Usd.Prim, made: Surface) -> None:
    """Our schema on the material: where its numbers come from."""
    overs.apply(prim, API)
    overs.value(prim, "photometric:gamma", _TYPES.Float, made.gamma, uniform=True)
    diffuse = Gf.Vec3f(*made.diffuse)
    overs.value(prim, "photometric:diffuse", _TYPES.Color3f, diffuse, uniform=True)
    if made.diffuse_map is not None:
        look = Sdf.AssetPath(made.source_texture)
        overs.value(prim, "photometric:sourceTexture", _TYPES.Asset, look, uniform=True)
    if made.luminance > 0.0:
        overs.value(prim, "photometric:luminance", _TYPES.Float, made.luminance)
    if made.emission_map is not None:
        file = _file(made.emission_map)
        overs.value(prim, "photometric:hdrTexture", _TYPES.Asset, file, uniform=True)
    for name, text in (("rule", made.rule), ("source", made.source)):
        if text:
            overs.value(prim, f"photometric:{name}", _TYPES.String, text, uniform=True)
    if made.provenance:
        overs.value(prim, "photometric:provenance", _TYPES.Token, made.provenance, uniform=True)


def _gloss(
    overs: Overs, source: SourceSurface, specular: RGB | None, roughness: float | None
) -> None:
    """The highlight that a rule states; ``specular``: None leaves the workflow as it is."""
    surface = source.surface.shader.GetPrim()
    if specular is not None:
        overs.value(surface, "inputs:useSpecularWorkflow", _TYPES.Int, 1)
        overs.value(surface, "inputs:specularColor", _TYPES.Color3f, Gf.Vec3f(*specular))
    if roughness is not None:
        overs.value(surface, "inputs:roughness", _TYPES.Float, roughness)


def _texture(
    overs: Overs,
    source: SourceSurface,
    name: str,
    template: Node,
    file: Sdf.AssetPath,
    scale: RGB,
) -> None:
    """A texture node with a linear map in the place of ``template``, for one input.

    The template stays for what else it feeds.
    """
    surface, old = source.surface.shader.GetPrim(), template.shader.GetPrim()
    values: dict[str, tuple[Sdf.ValueTypeName, object]] = {
        "info:id": (_TYPES.Token, "UsdUVTexture"),
        "inputs:file": (_TYPES.Asset, file),
        "inputs:sourceColorSpace": (_TYPES.Token, "raw"),
        "inputs:scale": (_TYPES.Float4, Gf.Vec4f(*scale, 1.0)),
        "outputs:rgb": (_TYPES.Float3, None),
    }
    links: dict[str, tuple[Sdf.ValueTypeName, list[Sdf.Path]]] = {}
    for key in _TEXTURE_INPUTS:
        own = old.GetAttribute(f"inputs:{key}")
        if not own:
            continue
        if own.HasAuthoredConnections():
            links[own.GetName()] = own.GetTypeName(), own.GetConnections()
        elif own.HasAuthoredValue():
            values[own.GetName()] = own.GetTypeName(), own.Get()
    place = overs.node(surface, f"Photometric_{name}", values)
    for key, (kind, paths) in links.items():
        overs.connect(place, key, kind, [overs.source(path) for path in paths])
    output = place.AppendProperty("outputs:rgb")
    overs.connect(overs.place(surface), f"inputs:{name}", _TYPES.Color3f, [output])


def _color(
    surface: Node, name: str, default: Values, findings: Findings, fixed: set[str]
) -> tuple[Node | None, RGB]:
    """The texture node of a colour and its factor, or None and the constant."""
    node = surface.source(name)
    if node is None:
        own = surface.producer(name)
        if own is not None and own.ValueMightBeTimeVarying():
            fixed.add(name)
            _kept(findings, f"{name} varies in time")
        return None, _three(findings.numbers(surface, name, default))
    file = str(getattr(node.value("file", None), "path", ""))
    varies = (producer := node.producer("file")) is not None and producer.ValueMightBeTimeVarying()
    why = ""
    if node.id != "UsdUVTexture":
        why = f"{name} comes from {node.id or 'a node without id'}"
    elif surface.output(name) != "rgb":
        why = f"{name} comes from one channel of a picture"
    elif UDIM in file:
        why = f"{name}: {file} has tiles, which are read by T^2.2 as they are"
    elif varies:
        why = f"{name}: the picture changes in time"
    elif any(findings.numbers(node, "bias", (0.0, 0.0, 0.0, 0.0))[:3]):
        why = f"{name}: the picture has a bias, and T^2.2 D has none"
    if why:
        fixed.add(name)
        _kept(findings, why)
        return None, _WHITE
    scale = findings.numbers(node, "scale", (1.0, 1.0, 1.0, 1.0))
    return node, _three(scale[:3])


def _kept(findings: Findings, why: str) -> None:
    findings.finding("usd-material-kept", f"{why}; kept as it is", Kind.REPLACED)


def _constant(surface: Node, name: str, default: float, findings: Findings) -> float:
    """A number; the default where a texture gives it."""
    if surface.source(name) is not None:
        return default
    return findings.number(surface, name, default)


def _raw(node: Node) -> bool:
    """Whether a picture holds numbers and no codes for a screen, as the file says."""
    return bool(node.value("sourceColorSpace", "auto") == "raw")


def _three(values: Values) -> RGB:
    red, green, blue = values[:3]
    return red, green, blue


def _file(used: Map) -> Sdf.AssetPath:
    return Sdf.AssetPath(used.file)
