"""Shading networks: nodes at a time, and what their outputs come to.

A renderer that runs no shader code can follow a network as far as its inputs are
constants, textures and primvars with a factor and an offset: a ``Signal``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdShade

from hdrusd.errors import SourceRef
from hdrusd.report import Kind, Report
from hdrusd.scene import TextureUse
from hdrusd.usd.assets import resolved_asset
from hdrusd.usd.findings import first_place
from hdrusd.usd.lux import connection_end

Values = tuple[float, ...]
Four = tuple[float, float, float, float]
Matrix = npt.NDArray[np.float64]

#: Formats whose texels are mostly 8-bit integers.
EIGHT_BIT = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".gif", ".webp")

#: Texture coordinate sets that one surface can read.
MAX_UV_SETS = 4


@dataclass(frozen=True, slots=True)
class Signal:
    """What reaches an input: ``value``, or a texture in its place, times a primvar if named."""

    value: Values
    use: TextureUse | None = None
    primvar: str = ""
    absent: Values = ()  # what stands for the primvar on a mesh without it

    @property
    def constant(self) -> bool:
        """Whether it is the same everywhere."""
        return self.use is None and not self.primvar

    def times(self, factor: Values) -> Signal | None:
        """The signal times a constant; None where a texture's one channel would need several."""
        if self.use is None:
            return replace(self, value=_each(self.value, factor, lambda a, b: a * b))
        four = _four(factor, self.use, 1.0)
        if four is None:
            return None
        scale, bias = _mul(self.use.scale, four), _mul(self.use.bias, four)
        return replace(self, use=replace(self.use, scale=scale, bias=bias))

    def plus(self, offset: Values) -> Signal | None:
        """The signal plus a constant; None where that is no single signal any more."""
        if self.primvar:
            return None
        if self.use is None:
            return replace(self, value=_each(self.value, offset, lambda a, b: a + b))
        four = _four(offset, self.use, 0.0)
        if four is None:
            return None
        r, g, b, a = (x + y for x, y in zip(self.use.bias, four, strict=True))
        return replace(self, use=replace(self.use, bias=(r, g, b, a)))

    def channel(self, index: int) -> Signal | None:
        """One of its components, 0 to 3; None where it has no such one."""
        if self.primvar or not 0 <= index < 4:
            return None
        if self.use is not None:
            if self.use.channel >= 0:
                return self if index == 0 else None
            return replace(self, value=self.value[:1], use=replace(self.use, channel=index))
        return Signal((self.value[index],)) if index < len(self.value) else None


def _mul(x: Four, y: Four) -> Four:
    r, g, b, a = (u * v for u, v in zip(x, y, strict=True))
    return r, g, b, a


def _each(a: Values, b: Values, operation: Any) -> Values:
    """Component by component; a single number goes with each."""
    width = max(len(a), len(b))
    if len(a) not in (1, width) or len(b) not in (1, width):
        width = min(len(a), len(b))
    a, b = (v * width if len(v) == 1 else v[:width] for v in (a, b))
    return tuple(float(operation(x, y)) for x, y in zip(a, b, strict=True))


def _four(values: Values, use: TextureUse, rest: float) -> Four | None:
    """A factor or an offset for the four components of a texel; ``rest`` where none is given."""
    if len(set(values)) == 1:
        return (values[0],) * 4
    if use.channel >= 0:
        return None
    r, g, b, a = (*values, rest, rest)[:4]
    return r, g, b, a


class Node:
    """A shader node at a time: values and sources through interfaces and node graphs."""

    def __init__(self, shader: UsdShade.Shader, time: Usd.TimeCode) -> None:
        self.shader = shader
        self.time = time

    @property
    def id(self) -> str:
        """What ``info:id`` says, "" where it says nothing."""
        return str(self.shader.GetIdAttr().Get() or "")

    def attribute(self, name: str) -> Usd.Attribute | None:
        """Its own attribute of an input."""
        own = self.shader.GetPrim().GetAttribute(f"inputs:{name}")
        return own if own else None

    def producer(self, name: str) -> Usd.Attribute | None:
        """The attribute whose value reaches input ``name``."""
        own = self.attribute(name)
        return connection_end(own) if own else None

    def value(self, name: str, default: Any) -> Any:
        """The constant that reaches an input; its own where a node feeds it."""
        attribute = self.producer(name)
        if attribute is None:
            return default
        if UsdShade.Output.IsOutput(attribute):
            attribute = self.shader.GetPrim().GetAttribute(f"inputs:{name}")
        value = attribute.Get(self.time)
        return default if value is None else value

    def source(self, name: str) -> Node | None:
        """The node that feeds input ``name``, or None for a constant."""
        attribute = self.producer(name)
        if attribute is None or not UsdShade.Output.IsOutput(attribute):
            return None
        shader = UsdShade.Shader(attribute.GetPrim())
        return Node(shader, self.time) if shader else None

    def output(self, name: str) -> str:
        """Which output of that node: "rgb", "a"."""
        attribute = self.producer(name)
        return str(attribute.GetBaseName()) if attribute is not None else ""

    def authored(self, name: str) -> bool:
        """Whether the file says anything about an input."""
        attribute = self.producer(name)
        return attribute is not None and bool(attribute.HasAuthoredValue())


class Findings:
    """Reads numbers and file names of one material; what is wrong with them is a finding."""

    def __init__(self, report: Report, place: SourceRef, prim: Usd.Prim) -> None:
        self.report = report
        self.place = place
        self.prim = prim

    def finding(self, code: str, text: str, kind: Kind = Kind.DROPPED) -> None:
        """A finding about the material."""
        self.report.add(kind, code, self.place, str(first_place(self.prim)), text)

    def numbers(self, node: Node, name: str, default: Values) -> Values:
        """Finite numbers; the default where a layer gives the input something else."""
        value = node.value(name, default)
        array = np.ravel(np.asarray(value))
        if array.dtype.kind in "fiub" and len(array) == len(default) and np.isfinite(array).all():
            return tuple(float(v) for v in array)
        text = f"{name} {shorten(str(value), 60)}; want {len(default)} finite numbers"
        self.finding("value-invalid", text, Kind.INVALID)
        return default

    def number(self, node: Node, name: str, default: float) -> float:
        """One finite number."""
        return self.numbers(node, name, (default,))[0]

    def color(self, name: str, value: Values) -> Values:
        """A colour that is nowhere negative."""
        usable = tuple(max(v, 0.0) for v in value)
        if usable != value:
            self.finding("color-invalid", f"{name} {value}; want 0 or more", Kind.INVALID)
        return usable

    def share(self, name: str, value: float) -> float:
        """A number from 0 to 1."""
        usable = min(max(value, 0.0), 1.0)
        if usable != value:
            self.finding("value-range", f"{name} {value:g}; {usable:g} is used", Kind.CLAMPED)
        return usable

    def four(self, node: Node, name: str, default: Four) -> Four:
        """Four finite numbers."""
        r, g, b, a = self.numbers(node, name, default)
        return r, g, b, a

    def file(self, node: Node, name: str) -> str:
        """The file that a texture node names; "" where it names none."""
        asset, attribute = node.value("file", None), node.producer("file")
        if isinstance(asset, Sdf.AssetPath) and asset.path and attribute is not None:
            return resolved_asset(attribute, asset)
        self.finding("texture-missing", f"{name}: texture names no file", Kind.MISSING)
        return ""


def transform_2d(scale: Values, rotation: float, translation: Values) -> Matrix:
    """UsdTransform2d as a (3, 3) column-vector matrix: scale, rotate (degrees, ccw), move."""
    c, s = math.cos(math.radians(rotation)), math.sin(math.radians(rotation))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    matrix = np.asarray(turn @ np.diag([*scale, 1.0]))
    matrix[:2, 2] = translation
    return matrix


def constant_place(s: float, t: float) -> Matrix:
    """The (3, 3) matrix that leads every coordinate to one place of the texture."""
    return np.array([[0.0, 0.0, s], [0.0, 0.0, t], [0.0, 0.0, 1.0]])


def rows(matrix: Matrix) -> Values:
    """The six numbers of ``TextureUse.matrix``."""
    return tuple(float(v) for v in matrix[:2].ravel())


def surface_nodes(material: UsdShade.Material, time: Usd.TimeCode) -> list[Node]:
    """The nodes behind the surface outputs: of the universal context first, then of MaterialX.

    A stage gives a material in several contexts so that each renderer takes the one that it
    knows best. UsdPreviewSurface is read whole and MaterialX in part, so it comes first.
    """
    nodes = []
    for context in ("", "glslfx", "mtlx"):
        output = material.GetSurfaceOutput(context) if context else material.GetSurfaceOutput()
        if output:
            end = connection_end(output.GetAttr())
            shader = UsdShade.Shader(end.GetPrim())
            if shader and end != output.GetAttr():
                nodes.append(Node(shader, time))
    return nodes
