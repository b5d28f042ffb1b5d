"""Surfaces of MaterialX, read as far as GGX with one clearcoat can show them.

Defaults and meanings: the node definitions of MaterialX 1.39 (libraries/bxdf) and, for
what each surface is in the terms of UsdPreviewSurface, its own translation graphs
(standard_surface_to_usd, open_pbr_to_standard_surface). Emission is in cd/m2, which
OpenPBR says and the others leave open.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hdrusd.report import Kind
from hdrusd.scene import Material, TextureUse
from hdrusd.usd.ggx import build_material, f0_from_ior, level_fallback, note_clearcoat
from hdrusd.usd.materialx_nodes import Reducer, product
from hdrusd.usd.network import Findings, Node, Signal, Values

_BLACK, _WHITE, _GREY = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.8, 0.8, 0.8)
_OFF = (0.0,)


@dataclass(frozen=True, slots=True)
class _Layered:
    """The inputs of a layered surface: names and defaults, by what they are."""

    base: tuple[str, Values]
    color: tuple[str, Values]
    metallic: tuple[str, Values]
    specular: tuple[str, Values]
    specular_color: str
    roughness: tuple[str, Values]
    ior: str
    coat: str
    coat_color: str
    coat_roughness: tuple[str, Values]
    coat_ior: tuple[str, float]
    transmission: str
    emission: tuple[str, Values]
    emission_color: tuple[str, Values]
    opacity: tuple[str, Values]
    normal: str
    unread: tuple[str, ...]  # weights that are 0 where there is nothing to show


_STANDARD = _Layered(
    base=("base", (1.0,)),
    color=("base_color", _GREY),
    metallic=("metalness", _OFF),
    specular=("specular", (1.0,)),
    specular_color="specular_color",
    roughness=("specular_roughness", (0.2,)),
    ior="specular_IOR",
    coat="coat",
    coat_color="coat_color",
    coat_roughness=("coat_roughness", (0.1,)),
    coat_ior=("coat_IOR", 1.5),
    transmission="transmission",
    emission=("emission", _OFF),
    emission_color=("emission_color", _WHITE),
    opacity=("opacity", _WHITE),
    normal="normal",
    unread=(
        "diffuse_roughness",
        "subsurface",
        "sheen",
        "specular_anisotropy",
        "coat_anisotropy",
        "coat_affect_color",
        "coat_affect_roughness",
        "thin_film_thickness",
        "transmission_depth",
        "transmission_dispersion",
    ),
)
_OPEN_PBR = _Layered(
    base=("base_weight", (1.0,)),
    color=("base_color", _GREY),
    metallic=("base_metalness", _OFF),
    specular=("specular_weight", (1.0,)),
    specular_color="specular_color",
    roughness=("specular_roughness", (0.3,)),
    ior="specular_ior",
    coat="coat_weight",
    coat_color="coat_color",
    coat_roughness=("coat_roughness", _OFF),
    coat_ior=("coat_ior", 1.6),
    transmission="transmission_weight",
    emission=("emission_luminance", _OFF),
    emission_color=("emission_color", _WHITE),
    opacity=("geometry_opacity", (1.0,)),
    normal="geometry_normal",
    unread=(
        "base_diffuse_roughness",
        "subsurface_weight",
        "fuzz_weight",
        "specular_roughness_anisotropy",
        "coat_roughness_anisotropy",
        "thin_film_weight",
        "transmission_depth",
        "transmission_dispersion_scale",
    ),
)
_GLTF = _Layered(
    base=("", (1.0,)),
    color=("base_color", _WHITE),
    metallic=("metallic", (1.0,)),
    specular=("specular", (1.0,)),
    specular_color="specular_color",
    roughness=("roughness", (1.0,)),
    ior="ior",
    coat="clearcoat",
    coat_color="",
    coat_roughness=("clearcoat_roughness", _OFF),
    coat_ior=("", 1.5),
    transmission="transmission",
    emission=("emissive_strength", (1.0,)),
    emission_color=("emissive", _BLACK),
    opacity=("alpha", (1.0,)),
    normal="normal",
    unread=("iridescence", "sheen_color", "thickness", "anisotropy_strength", "dispersion"),
)


def is_materialx_surface(identifier: str) -> bool:
    """Whether a node is a surface that ``read_materialx`` knows."""
    return identifier in _SURFACES


def read_materialx(surface: Node, findings: Findings) -> Material:
    """The surface as a GGX material; what it has beyond that is a finding."""
    return _SURFACES[surface.id](surface, findings)


def _preview(surface: Node, findings: Findings) -> Material:
    """UsdPreviewSurface as a node of MaterialX: the same inputs, other nodes behind them."""
    reducer = Reducer(findings)
    signal = partial(reducer.signal, surface)
    ior = max(findings.number(surface, "ior", 1.5), 0.0)
    specular, metallic = Signal((f0_from_ior(ior),) * 3), Signal(_OFF)
    if surface.value("useSpecularWorkflow", 0) == 1:
        specular = signal("specularColor", _BLACK)
    else:
        metallic = signal("metallic", _OFF)
    if surface.source("displacement") or findings.number(surface, "displacement", 0.0):
        findings.finding("displacement-unused", "displacement is not shown")
    made = build_material(
        findings,
        {
            "diffuse": signal("diffuseColor", (0.18, 0.18, 0.18)),
            "specular": specular,
            "metallic": metallic,
            "roughness": signal("roughness", (0.5,)),
            "clearcoat": signal("clearcoat", _OFF),
            "clearcoat_roughness": signal("clearcoatRoughness", (0.01,)),
            "emission": signal("emissiveColor", _BLACK),
            "opacity": signal("opacity", (1.0,)),
            "occlusion": signal("occlusion", (1.0,)),
        },
        threshold=max(findings.number(surface, "opacityThreshold", 0.0), 0.0),
        presence=str(surface.value("opacityMode", "")) == "presence",
        normal_map=_normal(reducer, surface, "normal"),
    )
    note_clearcoat(findings, made, ior)
    return made


def _layered(names: _Layered, surface: Node, findings: Findings) -> Material:
    """standard_surface, open_pbr_surface, gltf_pbr."""
    reducer = Reducer(findings)
    signal = partial(reducer.signal, surface)
    times = partial(_times, findings)
    f0 = f0_from_ior(max(findings.number(surface, names.ior, 1.5), 0.0))
    tint = times("specular_color", signal(names.specular_color, _WHITE), signal(*names.specular))
    color = times(names.color[0], signal(*names.color), signal(*names.base))
    coat = signal(names.coat, _OFF)
    if names.coat_color:
        color, coat = _coated(findings, color, coat, signal(names.coat_color, _WHITE))
    glow = times(names.emission_color[0], signal(*names.emission_color), signal(*names.emission))
    opacity, threshold, presence = _opacity(names, surface, reducer)
    made = build_material(
        findings,
        {
            "diffuse": color,
            "specular": tint.times((f0,)) or Signal((f0,) * 3),
            "metallic": signal(*names.metallic),
            "roughness": signal(*names.roughness),
            "clearcoat": coat,
            "clearcoat_roughness": signal(*names.coat_roughness),
            "emission": glow,
            "opacity": opacity,
            "occlusion": signal("occlusion", (1.0,)),
        },
        threshold=threshold,
        presence=presence,
        normal_map=_normal(reducer, surface, names.normal),
    )
    _note_unread(names, surface, findings)
    note_clearcoat(findings, made, findings.number(surface, *names.coat_ior))
    return made


def _times(findings: Findings, name: str, a: Signal, b: Signal) -> Signal:
    """The product of two inputs; of two textures the first alone."""
    made = product(a, b)
    if made is None:
        findings.finding("node-approximated", f"{name}: a product of two textures; one is shown")
    return made or a


def _coated(findings: Findings, color: Signal, coat: Signal, tint: Signal) -> tuple[Signal, Signal]:
    """The base seen through a coat's colour, and the coat's own weight."""
    if tint.constant and set(tint.value) == {1.0}:
        return color, coat
    if not (tint.constant and coat.constant):
        findings.finding("node-approximated", "coat_color: a texture; a clear coat is shown")
        return color, coat
    share = coat.value[0]
    through = color.times(tuple(1.0 + share * (c - 1.0) for c in tint.value))
    return through or color, Signal((share * sum(tint.value) / 3.0,))


def _opacity(names: _Layered, surface: Node, reducer: Reducer) -> tuple[Signal, float, bool]:
    """What reaches the opacity, the threshold of a cut-out, and whether highlights fade too."""
    findings, full = reducer.findings, Signal((1.0,))
    opacity = full
    threshold = 0.0
    mode = findings.number(surface, "alpha_mode", 0.0) if names is _GLTF else 2.0
    if mode > 0.0:
        name, default = names.opacity
        opacity = reducer.signal(surface, name, default)
        opacity = replace(opacity, value=(sum(opacity.value) / len(opacity.value),))
        if opacity.use is not None and opacity.use.channel < 0:
            findings.finding("node-approximated", f"{name}: red stands for a texture's three")
            opacity = replace(opacity, use=replace(opacity.use, channel=0))
        threshold = findings.number(surface, "alpha_cutoff", 0.5) if mode < 2.0 else 0.0
    passing = reducer.signal(surface, names.transmission, _OFF)
    if passing.constant and passing.value[0] <= 0.0:
        return opacity, threshold, True
    findings.finding(
        "node-approximated",
        f"{names.transmission}: light goes straight through, untinted",
        Kind.REPLACED,
    )
    left = passing.times((-1.0,))
    seen = None if left is None else left.plus((1.0,))
    if seen is None or not (opacity.constant and opacity.value[0] >= 1.0):
        return opacity, threshold, True
    return seen, 0.0, False


def _normal(reducer: Reducer, surface: Node, name: str) -> TextureUse | None:
    """A normal map in tangent space."""
    if surface.source(name) is None:
        return None
    made = reducer.signal(surface, name, (0.0, 0.0, 1.0))
    if made.use is None or made.use.channel >= 0:
        return None
    return level_fallback(made.use)


def _note_unread(names: _Layered, surface: Node, findings: Findings) -> None:
    for name in names.unread:
        value = np.ravel(np.asarray(surface.value(name, 0.0)))
        number = value.dtype.kind in "fiub"
        if surface.source(name) is not None or (number and bool(np.any(value != 0))):
            findings.finding("materialx-unused", f"{name} is not shown")


_SURFACES: dict[str, Callable[[Node, Findings], Material]] = {
    "ND_UsdPreviewSurface_surfaceshader": _preview,
    "ND_standard_surface_surfaceshader": partial(_layered, _STANDARD),
    "ND_standard_surface_surfaceshader_100": partial(
        _layered, replace(_STANDARD, base=("base", (0.8,)), color=("base_color", _WHITE))
    ),
    "ND_open_pbr_surface_surfaceshader": partial(_layered, _OPEN_PBR),
    "ND_gltf_pbr_surfaceshader": partial(_layered, _GLTF),
}
