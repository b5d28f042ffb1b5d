"""``MaterialReader``: a material's network, and our schema over it, as shader 1 wants it.

UsdPreviewSurface and the nodes that come with it, after the UsdPreviewSurface
specification (OpenUSD, docs/spec_usdpreviewsurface.rst, version 2.5) and the shader
definitions of OpenUSD 26.11, which add ``opacityMode``. MaterialX is in materialx.py.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdShade

from hdrusd.report import Kind, Report
from hdrusd.scene import RGB, Material, TextureRef, TextureUse
from hdrusd.usd.findings import place_of
from hdrusd.usd.ggx import build_material, f0_from_ior, level_fallback, note_clearcoat
from hdrusd.usd.materialx import is_materialx_surface, read_materialx
from hdrusd.usd.network import (
    EIGHT_BIT,
    MAX_UV_SETS,
    Findings,
    Node,
    Signal,
    Values,
    constant_place,
    rows,
    surface_nodes,
    transform_2d,
)

#: Exponent range that a roughness maps to; at 1e5 the lobe is half a degree wide.
_MAX_SHININESS = 1e5

_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}

#: What an 8-bit normal map needs to become a direction, in the words of the specification.
_NORMAL_SCALE, _NORMAL_BIAS = (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0)


def shininess_from_roughness(roughness: float) -> float:
    """Blinn-Phong exponent n = 2 / alpha^2 - 2, with alpha = roughness^2 of a preview surface."""
    alpha = max(roughness, 1e-3) ** 2
    return min(max(2.0 / (alpha * alpha) - 2.0, 0.0), _MAX_SHININESS)


def roughness_from_shininess(shininess: float) -> float:
    """The inverse, for the plain values that other renderers read."""
    return float((2.0 / (max(shininess, 0.0) + 2.0)) ** 0.25)


class MaterialReader:
    """Reads the materials of one stage; each lack is a finding, once a material."""

    def __init__(self, stage: Usd.Stage, report: Report) -> None:
        self.report = report
        self.place = place_of(stage)

    def read(self, material: UsdShade.Material, time: Usd.TimeCode) -> Material | None:
        """The material at ``time``, or None when it has no surface that we know."""
        findings = Findings(self.report, self.place, material.GetPrim())
        nodes = surface_nodes(material, time)
        made = next((m for n in nodes if (m := _read(n, findings)) is not None), None)
        if made is None:
            what = nodes[0].id or "a node without id" if nodes else "no surface"
            text = f"{what}; want UsdPreviewSurface or a surface of MaterialX; grey is used"
            findings.finding("material-unknown", text)
            return None
        made = _photometric(made, _Photometric(material.GetPrim(), time))
        if len(made.uv_sets()) > MAX_UV_SETS:
            text = f"{len(made.uv_sets())} texture coordinate sets; {MAX_UV_SETS} are read"
            findings.finding("uv-sets", text)
        return made


def _read(surface: Node, findings: Findings) -> Material | None:
    if surface.id == "UsdPreviewSurface":
        return _Preview(findings).read(surface)
    if is_materialx_surface(surface.id):
        return read_materialx(surface, findings)
    return None


class _Preview:
    """One UsdPreviewSurface network."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings

    def read(self, surface: Node) -> Material:
        findings, signal = self.findings, partial(self._signal, surface)
        self._note_displacement(surface)
        ior = self._ior(surface)
        if surface.value("useSpecularWorkflow", 0) == 1:
            specular, metallic = signal("specularColor", (0.0, 0.0, 0.0)), Signal((0.0,))
        else:
            specular, metallic = Signal((f0_from_ior(ior),) * 3), signal("metallic", (0.0,))
        threshold = max(findings.number(surface, "opacityThreshold", 0.0), 0.0)
        made = build_material(
            findings,
            {
                "diffuse": signal("diffuseColor", (0.18, 0.18, 0.18)),
                "specular": specular,
                "metallic": metallic,
                "roughness": signal("roughness", (0.5,)),
                "clearcoat": signal("clearcoat", (0.0,)),
                "clearcoat_roughness": signal("clearcoatRoughness", (0.01,)),
                "emission": signal("emissiveColor", (0.0, 0.0, 0.0)),
                "opacity": signal("opacity", (1.0,)),
                "occlusion": signal("occlusion", (1.0,)),
            },
            threshold=threshold,
            presence=self._presence(surface),
            normal_map=self._normal(surface),
        )
        note_clearcoat(findings, made, ior)
        return made

    def _ior(self, surface: Node) -> float:
        if surface.source("ior") is not None:
            self.findings.finding(
                "node-unknown", "ior: a texture or primvar is not read; 1.5 is used"
            )
            return 1.5
        return max(self.findings.number(surface, "ior", 1.5), 0.0)

    def _presence(self, surface: Node) -> bool:
        mode = str(surface.value("opacityMode", "transparent"))
        if mode not in ("transparent", "presence"):
            text = f"opacityMode {mode}; want transparent or presence; transparent is used"
            self.findings.finding("value-invalid", text, Kind.INVALID)
        return mode == "presence"

    def _note_displacement(self, surface: Node) -> None:
        value = self.findings.number(surface, "displacement", 0.0)
        if surface.source("displacement") is not None or value != 0.0:
            self.findings.finding("displacement-unused", "displacement is not shown")

    # -- inputs --------------------------------------------------------------------------

    def _signal(self, node: Node, name: str, default: Values) -> Signal:
        """What reaches an input: a texture, a primvar, or its constant."""
        source = node.source(name)
        if source is None:
            return Signal(self.findings.numbers(node, name, default))
        if source.id == "UsdUVTexture":
            use = self._texture(source, name, _CHANNELS.get(node.output(name), -1), len(default))
            return Signal(default, use)
        if source.id.startswith("UsdPrimvarReader_"):
            return self._primvar(node, source, name, default)
        text = f"{name}: {source.id or 'a node without id'} is not read"
        self.findings.finding("node-unknown", text)
        return Signal(self.findings.numbers(node, name, default))

    def _primvar(self, node: Node, reader: Node, name: str, default: Values) -> Signal:
        """A primvar on the colour or the opacity; elsewhere the value that stands for it."""
        absent = self.findings.numbers(reader, "fallback", (0.0,) * len(default))
        primvar = str(reader.value("varname", "") or "")
        if primvar and name == "diffuseColor":
            return Signal((1.0, 1.0, 1.0), primvar=primvar, absent=absent)
        if primvar and name == "opacity":
            return Signal(absent, primvar=primvar, absent=absent)
        if not reader.authored("fallback"):
            absent = self.findings.numbers(node, name, default)
        shown = ", ".join(f"{v:g}" for v in absent)
        self.findings.finding("node-unknown", f"{name}: primvar is not read; {shown} is used")
        return Signal(absent)

    def _texture(self, node: Node, name: str, channel: int, width: int) -> TextureUse:
        findings = self.findings
        file = findings.file(node, name)
        data = width == 1 or name == "normal"
        uv_set, matrix = self._coordinates(node)
        ref = TextureRef(
            file=file,
            decode=self._decode(node, name, file, data and channel != 3),  # type: ignore[arg-type]
            wrap_s=_wrap(node.value("wrapS", "useMetadata")),
            wrap_t=_wrap(node.value("wrapT", "useMetadata")),
        )
        return TextureUse(
            texture=ref,
            uv_set=uv_set,
            matrix=matrix,
            scale=findings.four(node, "scale", (1.0, 1.0, 1.0, 1.0)),
            bias=findings.four(node, "bias", (0.0, 0.0, 0.0, 0.0)),
            channel=0 if width == 1 and channel < 0 else channel,
            fallback=findings.four(node, "fallback", (0.0, 0.0, 0.0, 1.0)),
        )

    def _decode(self, node: Node, name: str, file: str, data: bool) -> str:
        """How codes become numbers. ``auto`` would curve an 8-bit picture that holds data."""
        space = str(node.value("sourceColorSpace", "auto"))
        if space in ("raw", "sRGB"):
            return "linear" if space == "raw" else "gamma"
        if not data:
            return "auto"
        if file.lower().endswith(EIGHT_BIT):
            text = f"{name}: sourceColorSpace is not stated; read raw, as {name} is no colour"
            self.findings.finding("data-color-space", text, Kind.ASSUMED)
        return "linear"

    def _normal(self, surface: Node) -> TextureUse | None:
        """The normal map, whose texels times scale plus bias are directions in tangent space."""
        source, flat = surface.source("normal"), (0.0, 0.0, 1.0)
        if source is None:
            if self.findings.numbers(surface, "normal", flat) != flat:
                self.findings.finding("normal-constant", "a normal without a texture is not shown")
            return None
        if source.id != "UsdUVTexture":
            text = f"normal: {source.id or 'a node without id'} is not read"
            self.findings.finding("node-unknown", text)
            return None
        use = self._texture(source, "normal", -1, 3)
        stated = source.authored("scale") or source.authored("bias")
        if not stated and use.texture.file.lower().endswith(EIGHT_BIT):
            text = "normal: 8-bit texture without scale and bias; (2, 2, 2, 1) and (-1, -1, -1, 0)"
            self.findings.finding("normal-scale", f"{text} are used", Kind.GUESSED)
            use = replace(use, scale=_NORMAL_SCALE, bias=_NORMAL_BIAS)
        return use if source.authored("fallback") else level_fallback(use)

    def _coordinates(self, texture: Node) -> tuple[str, Values]:
        """The primvar and the 2 x 3 matrix that lead to the texture's coordinates."""
        findings, matrix, node, name = self.findings, np.eye(3), texture, "st"
        for _ in range(8):  # a chain of transforms; more than a few is a loop
            source = node.source(name)
            if source is None:
                if node.authored(name):
                    s, t = findings.numbers(node, name, (0.0, 0.0))
                    return "st", rows(matrix @ constant_place(s, t))
                break
            if source.id == "UsdPrimvarReader_float2":
                return str(source.value("varname", "") or "st"), rows(matrix)
            if source.id != "UsdTransform2d":
                findings.finding("node-unknown", f"st: {source.id} is not read; st is used")
                return "st", rows(matrix)
            matrix = matrix @ transform_2d(
                findings.numbers(source, "scale", (1.0, 1.0)),
                findings.number(source, "rotation", 0.0),
                findings.numbers(source, "translation", (0.0, 0.0)),
            )
            node, name = source, "in"
        findings.finding("texture-coordinates", "a texture names none; st is used", Kind.ASSUMED)
        return "st", rows(matrix)


class _Photometric:
    """What HdrusdPhotometricMaterialAPI says, None where it is silent."""

    def __init__(self, prim: Usd.Prim, time: Usd.TimeCode) -> None:
        def get(name: str) -> Any:
            attribute = prim.GetAttribute(name)
            return attribute.Get(time) if attribute and attribute.HasAuthoredValue() else None

        def color(name: str) -> RGB | None:
            value = get(name)
            if not isinstance(value, (Gf.Vec3f, Gf.Vec3d, Gf.Vec3h)):
                return None
            r, g, b = (float(v) for v in value)
            return (r, g, b) if min(r, g, b) >= 0.0 and math.isfinite(r + g + b) else None

        self.specular = color("legacy:specularColor")
        self.diffuse = color("photometric:diffuse")
        shininess = get("legacy:shininess")
        usable = isinstance(shininess, float) and 0.0 <= shininess < math.inf
        self.shininess = min(shininess, _MAX_SHININESS) if usable else None
        self.vertex_color = str(get("photometric:vertexColor") or "")


def _photometric(made: Material, ours: _Photometric) -> Material:
    """The material with our schema over it: a legacy highlight is Blinn and Phong's."""
    if ours.shininess is not None or ours.specular is not None:
        shininess = ours.shininess
        if shininess is None:
            shininess = shininess_from_roughness(made.roughness)
        made = replace(made, model="blinn", shininess=shininess)
    if ours.specular is not None:
        made = replace(
            made, specular=ours.specular, specular_map=None, metallic=0.0, metallic_map=None
        )
    if ours.vertex_color:
        if made.vertex_color == ours.vertex_color and ours.diffuse is not None:
            made = replace(made, diffuse=ours.diffuse)  # R = D V; no node of the network multiplies
        made = replace(made, vertex_color=ours.vertex_color, vertex_absent=(1.0, 1.0, 1.0))
    return made


def _wrap(mode: Any) -> str:
    """UsdUVTexture's wrap; useMetadata without metadata is black, as its text says."""
    mode = str(mode)
    return mode if mode in ("repeat", "clamp", "mirror") else "black"
