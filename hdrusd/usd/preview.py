"""``read_material``: a UsdPreviewSurface network, and our schema over it, as shader 1 wants it."""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdShade

from hdrusd.errors import SourceRef
from hdrusd.report import Kind, Report
from hdrusd.scene import RGB, Material, TextureRef, TextureUse
from hdrusd.usd.assets import resolved_asset
from hdrusd.usd.lux import connection_end

#: Exponent range that a roughness maps to; at 1e5 the lobe is half a degree wide.
_MAX_SHININESS = 1e5

#: Inputs of UsdPreviewSurface that shader 1 has no term for yet, with the value that means "off".
_UNUSED = {"clearcoat": 0.0, "displacement": 0.0, "occlusion": 1.0}

_CHANNELS = {"rgb": -1, "r": 0, "g": 1, "b": 2, "a": 3, "rgba": -1}


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
        self.place = SourceRef(Path(stage.GetRootLayer().identifier))

    def read(self, material: UsdShade.Material, time: Usd.TimeCode) -> Material | None:
        """The material at ``time``, or None when it has no surface that we know."""
        prim = material.GetPrim()
        shader = _surface_shader(material)
        if shader is None or shader.GetIdAttr().Get() != "UsdPreviewSurface":
            what = shader.GetIdAttr().Get() if shader else "no surface"
            self._finding(prim, "material-unknown", f"{what}; want UsdPreviewSurface; grey is used")
            return None
        surface = _Node(shader, time)
        self._note_unused(prim, surface)
        diffuse, diffuse_map = self._color(prim, surface, "diffuseColor", (0.18, 0.18, 0.18))
        emission, emission_map = self._color(prim, surface, "emissiveColor", (0.0, 0.0, 0.0))
        opacity_map = self._texture(prim, surface, "opacity")
        opacity = self._number(prim, surface, "opacity", 1.0)
        threshold = self._number(prim, surface, "opacityThreshold", 0.0)
        if threshold <= 0.0 and (opacity < 1.0 or opacity_map is not None):
            lens = opacity_map is None and (emission_map is not None or any(emission))
            threshold = 0.0 if lens else 0.5  # a lamp behind its glass must not be cut away
            how = "solid, for it glows" if lens else "as a cut-out at opacity 0.5"
            self._finding(prim, "alpha-blend", f"blending is drawn {how}", Kind.REPLACED)
        specular, metallic = self._specular(prim, surface)
        roughness = self._factor(prim, surface, "roughness", 0.5)
        shininess = shininess_from_roughness(roughness)
        ours = _Photometric(prim, time)
        if ours.shininess is not None:
            shininess = ours.shininess
        if ours.specular is not None:
            specular, metallic = ours.specular, 0.0
        primvar = _primvar(surface, "diffuseColor")
        if primvar and primvar == ours.vertex_color and ours.diffuse is not None:
            diffuse = ours.diffuse  # R = D V; the network has no node that multiplies
        return Material(
            diffuse=diffuse,
            diffuse_map=diffuse_map,
            vertex_color=ours.vertex_color or primvar,
            specular=specular,
            shininess=shininess,
            metallic=metallic,
            emission=emission,
            emission_map=emission_map,
            opacity=opacity,
            opacity_map=opacity_map,
            opacity_threshold=threshold,
        )

    def _specular(self, prim: Usd.Prim, surface: _Node) -> tuple[RGB, float]:
        if surface.value("useSpecularWorkflow", 0) == 1:
            color, used = self._color(prim, surface, "specularColor", (0.0, 0.0, 0.0))
            if used is not None:
                self._finding(prim, "specular-texture", "specularColor texture is not used")
            return color, 0.0
        ior = max(self._number(prim, surface, "ior", 1.5), 0.0)
        f0 = ((1.0 - ior) / (1.0 + ior)) ** 2
        return (f0, f0, f0), self._factor(prim, surface, "metallic", 0.0)

    def _factor(self, prim: Usd.Prim, surface: _Node, name: str, default: float) -> float:
        """An input from 0 to 1; a texture on it has no term yet, and the default holds."""
        if self._texture(prim, surface, name) is not None:
            self._finding(prim, f"{name}-texture", f"{name} texture is not used; {default} is")
            return default
        return min(max(self._number(prim, surface, name, default), 0.0), 1.0)

    def _number(self, prim: Usd.Prim, node: _Node, name: str, default: float) -> float:
        (value,) = self._numbers(prim, node, name, (default,))
        return value

    def _numbers(
        self, prim: Usd.Prim, node: _Node, name: str, default: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Finite numbers; the default where a layer gives the input something else."""
        value = node.value(name, default)
        array = np.ravel(np.asarray(value))
        if array.dtype.kind in "fiub" and len(array) == len(default) and np.isfinite(array).all():
            return tuple(float(v) for v in array)
        text = f"{name} {shorten(str(value), 60)}; want {len(default)} finite numbers"
        self._finding(prim, "value-invalid", text, Kind.INVALID)
        return default

    def _note_unused(self, prim: Usd.Prim, surface: _Node) -> None:
        for name, off in _UNUSED.items():
            used = surface.connected(name)
            if used or abs(self._number(prim, surface, name, off) - off) > 1e-6:
                self._finding(prim, f"{name}-unused", f"{name} is not shown")
        if surface.connected("normal"):
            self._finding(prim, "normal-map-unused", "normal map is not shown")

    def _color(
        self, prim: Usd.Prim, surface: _Node, name: str, default: RGB
    ) -> tuple[RGB, TextureUse | None]:
        """A colour input as (constant, texture). A primvar on diffuseColor is a factor on white."""
        if _primvar(surface, name):
            if name == "diffuseColor":
                return (1.0, 1.0, 1.0), None
            self._finding(prim, "node-unknown", f"{name}: primvar is not read; {default} is used")
            return default, None
        value = self._numbers(prim, surface, name, default)
        r, g, b = (max(v, 0.0) for v in value)
        if (r, g, b) != value:
            self._finding(prim, "color-invalid", f"{name} {value}; want 0 or more", Kind.INVALID)
        return (r, g, b), self._texture(prim, surface, name)

    def _texture(self, prim: Usd.Prim, surface: _Node, name: str) -> TextureUse | None:
        source = surface.source(name)
        if source is None:
            return None
        kind = source.GetIdAttr().Get()
        if kind != "UsdUVTexture":
            self._finding(
                prim, "node-unknown", f"{name}: {kind or 'a node without id'} is not read"
            )
            return None
        texture = _Node(source, surface.time)
        asset = texture.value("file", None)
        attribute = texture.producer("file")
        file = ""
        if isinstance(asset, Sdf.AssetPath) and asset.path and attribute is not None:
            file = resolved_asset(attribute, asset)
        else:
            self._finding(prim, "texture-missing", f"{name}: texture names no file", Kind.MISSING)
        space = str(texture.value("sourceColorSpace", "auto"))
        decode = {"raw": "linear", "sRGB": "gamma"}.get(space, "auto")
        uv_set, matrix = self._coordinates(prim, texture)
        return TextureUse(
            texture=TextureRef(
                file=file,
                decode=decode,  # type: ignore[arg-type]
                wrap_s=_wrap(texture.value("wrapS", "useMetadata")),
                wrap_t=_wrap(texture.value("wrapT", "useMetadata")),
            ),
            uv_set=uv_set,
            matrix=matrix,
            scale=self._four(prim, texture, "scale", (1.0, 1.0, 1.0, 1.0)),
            bias=self._four(prim, texture, "bias", (0.0, 0.0, 0.0, 0.0)),
            channel=_CHANNELS.get(surface.output(name), -1),
            fallback=self._four(prim, texture, "fallback", (0.0, 0.0, 0.0, 1.0)),
        )

    def _coordinates(self, prim: Usd.Prim, texture: _Node) -> tuple[str, tuple[float, ...]]:
        """The primvar and the 2 x 3 matrix that lead to the texture's coordinates."""
        node = texture.source("st")
        matrix = np.eye(3)
        for _ in range(8):  # a chain of transforms; more than a few is a loop
            if node is None:
                break
            kind = node.GetIdAttr().Get()
            inner = _Node(node, texture.time)
            if kind == "UsdPrimvarReader_float2":
                name = inner.value("varname", "st")
                return str(name or "st"), tuple(float(v) for v in matrix[:2].ravel())
            if kind != "UsdTransform2d":
                self._finding(prim, "node-unknown", f"st: {kind} is not read; st is used")
                break
            matrix = matrix @ transform_2d(
                self._numbers(prim, inner, "scale", (1.0, 1.0)),
                self._number(prim, inner, "rotation", 0.0),
                self._numbers(prim, inner, "translation", (0.0, 0.0)),
            )
            node = inner.source("in")
        return "st", tuple(float(v) for v in matrix[:2].ravel())

    def _four(
        self, prim: Usd.Prim, node: _Node, name: str, default: tuple[float, ...]
    ) -> tuple[float, float, float, float]:
        r, g, b, a = self._numbers(prim, node, name, default)
        return r, g, b, a

    def _finding(self, prim: Usd.Prim, code: str, text: str, kind: Kind = Kind.DROPPED) -> None:
        self.report.add(kind, code, self.place, str(prim.GetPath()), text)


def transform_2d(
    scale: tuple[float, ...], rotation: float, translation: tuple[float, ...]
) -> npt.NDArray[np.float64]:
    """UsdTransform2d as a (3, 3) column-vector matrix: scale, rotate (degrees, ccw), move."""
    c, s = math.cos(math.radians(rotation)), math.sin(math.radians(rotation))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    matrix = np.asarray(turn @ np.diag([*scale, 1.0]))
    matrix[:2, 2] = translation
    return matrix


def _primvar(surface: _Node, name: str) -> str:
    """The primvar that a reader feeds straight into an input; "" where there is none."""
    source = surface.source(name)
    if source is None or not str(source.GetIdAttr().Get()).startswith("UsdPrimvarReader_"):
        return ""
    return str(_Node(source, surface.time).value("varname", "") or "")


def _surface_shader(material: UsdShade.Material) -> UsdShade.Shader | None:
    """The node behind the surface output of the universal render context."""
    output = material.GetSurfaceOutput()
    if not output:
        return None
    end = connection_end(output.GetAttr())
    shader = UsdShade.Shader(end.GetPrim())
    return shader if shader and end != output.GetAttr() else None


class _Node:
    """A shader node at a time: values and sources through interfaces and node graphs."""

    def __init__(self, shader: UsdShade.Shader, time: Usd.TimeCode) -> None:
        self.shader = shader
        self.time = time

    def producer(self, name: str) -> Usd.Attribute | None:
        """The attribute whose value reaches input ``name``."""
        own = self.shader.GetPrim().GetAttribute(f"inputs:{name}")
        return connection_end(own) if own else None

    def value(self, name: str, default: Any) -> Any:
        attribute = self.producer(name)
        if attribute is None:
            return default
        if UsdShade.Output.IsOutput(attribute):  # connected to a node: its own value, if any
            attribute = self.shader.GetPrim().GetAttribute(f"inputs:{name}")
        value = attribute.Get(self.time)
        return default if value is None else value

    def source(self, name: str) -> UsdShade.Shader | None:
        """The node that feeds input ``name``, or None for a constant."""
        attribute = self.producer(name)
        if attribute is None or not UsdShade.Output.IsOutput(attribute):
            return None
        shader = UsdShade.Shader(attribute.GetPrim())
        return shader if shader else None

    def output(self, name: str) -> str:
        """Which output of that node: "rgb", "a"."""
        attribute = self.producer(name)
        return str(attribute.GetBaseName()) if attribute is not None else ""

    def connected(self, name: str) -> bool:
        return self.source(name) is not None


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


def _wrap(mode: Any) -> str:
    """UsdUVTexture's wrap; useMetadata without metadata is black, as its text says."""
    mode = str(mode)
    return mode if mode in ("repeat", "clamp", "mirror") else "black"
