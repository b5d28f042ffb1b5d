"""MaterialX nodes whose outputs come to a constant, a texture or a primvar with a factor.

Definitions: MaterialX specification 1.39, standard nodes, and the implementation of
``place2d``, ``rotate2d``, ``tiledimage`` and ``normalmap`` in its standard library.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hdrusd.colour import srgb_decode
from hdrusd.report import Kind
from hdrusd.scene import TextureRef, TextureUse
from hdrusd.usd.network import (
    EIGHT_BIT,
    Findings,
    Matrix,
    Node,
    Signal,
    Values,
    constant_place,
    rows,
    transform_2d,
)

#: Nodes that are looked at for one input; a graph may name one node from many places.
_MOST_NODES = 128

#: Steps of arithmetic on the way to texture coordinates.
_MOST_STEPS = 16

_SRGB = ("srgb_texture", "srgb_rec709_scene", "srgb_rec709_display", "sRGB", "g22_rec709")
_LINEAR = ("lin_rec709", "lin_rec709_scene", "lin_srgb", "raw", "data", "none", "Raw")

_WRAPS = {"constant": "black", "black": "black", "clamp": "clamp", "mirror": "mirror"}
_LETTERS = {"r": 0, "g": 1, "b": 2, "a": 3, "x": 0, "y": 1, "z": 2, "w": 3}
_WIDTHS = {"float": 1, "vector2": 2, "color3": 3, "vector3": 3, "color4": 4, "vector4": 4}


def node_kind(node: Node) -> tuple[str, list[str]]:
    """Category and types of a MaterialX node: ND_multiply_color3FA is multiply, [color3FA]."""
    prefix, _, rest = node.id.partition("_")
    category, *types = rest.split("_") if prefix == "ND" else ("",)
    return category, types


def width_of(types: list[str]) -> int:
    """Numbers in a node's own type."""
    return _WIDTHS.get(types[0].removesuffix("FA"), 1) if types else 1


class Reducer:
    """Reduces what feeds the inputs of one material's surface."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self._left = 0

    def signal(self, node: Node, name: str, default: Values) -> Signal:
        """What reaches an input of the surface; what cannot be followed is a finding."""
        self._left = _MOST_NODES
        made = self._input(node, name, default)
        if made is None:
            source = node.source(name)
            what = (source.id or "a node without id") if source else "a loop"
            text = f"{name}: {what} does not come to a constant or a texture"
            self.findings.finding("node-unknown", text)
            made = Signal(self.findings.numbers(node, name, default))
        return self._fitted(made, name, len(default))

    def _fitted(self, made: Signal, name: str, width: int) -> Signal:
        """The signal with as many numbers as its input has."""
        value = made.value
        if width > 1:
            value = value * width if len(value) == 1 else (*value, *(0.0,) * width)[:width]
        elif len(value) > 1:
            value = (sum(value[:3]) / len(value[:3]),)
        use = made.use
        if width == 1 and use is not None and use.channel < 0:
            self.findings.finding("node-approximated", f"{name}: red stands for a texture's three")
            use = replace(use, channel=0)
        return replace(made, value=value, use=use)

    def _input(self, node: Node, name: str, default: Values) -> Signal | None:
        source = node.source(name)
        if source is None:
            return Signal(self._constant(node, name, default))
        if self._left <= 0:
            return None
        self._left -= 1
        return self._reduce(source, node.output(name))

    def _constant(self, node: Node, name: str, default: Values) -> Values:
        """Numbers of an input; a colour that says it is coded as sRGB is decoded."""
        value = node.value(name, default)
        if len(default) > 1 and np.size(value) == 1:  # a number where a colour is wanted
            return self.findings.numbers(node, name, default[:1]) * len(default)
        values = self.findings.numbers(node, name, default)
        if len(default) == 3 and _color_space(node, name) in _SRGB:
            return tuple(float(v) for v in srgb_decode(np.clip(values, 0.0, None)))
        return values

    # -- nodes ---------------------------------------------------------------------------

    def _reduce(self, node: Node, output: str) -> Signal | None:
        category, types = node_kind(node)
        width = width_of(types)
        if category in ("image", "tiledimage"):
            return self._image(node, category, types)
        if category == "UsdUVTexture":
            made = self._image(node, category, ["color4"])
            return made.channel(_LETTERS[output]) if made and output in _LETTERS else made
        if category in ("geompropvalue", "UsdPrimvarReader", "geomcolor"):
            return self._primvar(node, category)
        if category == "constant":
            return Signal(self._constant(node, "value", (0.0,) * width))
        if category in ("multiply", "divide", "add", "subtract"):
            return self._arithmetic(node, category, width)
        if category == "normalmap":
            return self._normal_map(node)
        return self._other(node, category, types, output)

    def _other(self, node: Node, category: str, types: list[str], output: str) -> Signal | None:
        width = width_of(types)
        if category == "mix":
            return self._mix(node, width)
        made = self._input(node, "in", (0.0,) * width)
        if made is None:
            return None
        if category == "convert":
            return _converted(made, _WIDTHS.get(types[1], 1) if len(types) > 1 else 1)
        if category == "invert":
            amount = self.findings.numbers(node, "amount", (1.0,) * width)
            less = made.times((-1.0,))
            return None if less is None or node.source("amount") else less.plus(amount)
        if category == "extract":
            return made.channel(int(self.findings.number(node, "index", 0.0)))
        if category.startswith("separate"):
            return made.channel(_LETTERS.get(output.removeprefix("out"), -1))
        if category == "swizzle":
            return _swizzled(made, str(node.value("channels", "")))
        if category == "clamp":
            return made if self._keeps(node, width) else None
        return made if category == "dot" else None

    def _keeps(self, node: Node, width: int) -> bool:
        """Whether a clamp leaves numbers from 0 to 1 alone."""
        low = self.findings.numbers(node, "low", (0.0,) * width)
        high = self.findings.numbers(node, "high", (1.0,) * width)
        steady = node.source("low") is None and node.source("high") is None
        return steady and max(low) <= 0.0 and min(high) >= 1.0

    def _arithmetic(self, node: Node, category: str, width: int) -> Signal | None:
        neutral = 1.0 if category in ("multiply", "divide") else 0.0
        a = self._input(node, "in1", (0.0,) * width)
        b = self._input(node, "in2", (neutral,) * width)
        if a is None or b is None:
            return None
        if category == "divide":
            if not b.constant or 0.0 in b.value:
                return None
            return a.times(tuple(1.0 / v for v in b.value))
        if category == "multiply":
            return product(a, b)
        if category == "subtract":
            negative = b.times((-1.0,))
            if negative is None:
                return None
            b = negative
        return _sum(a, b)

    def _mix(self, node: Node, width: int) -> Signal | None:
        share = self._input(node, "mix", (0.0,))
        if share is None or not share.constant:
            return None
        weights = share.value, tuple(1.0 - v for v in share.value)
        parts = []
        for name, weight in zip(("fg", "bg"), weights, strict=True):
            made = self._input(node, name, (0.0,) * width)
            if made is None and any(weight):
                return None
            parts.append(Signal((0.0,) * width) if made is None else made.times(weight))
        a, b = parts
        return None if a is None or b is None else _sum(a, b)

    def _normal_map(self, node: Node) -> Signal | None:
        """Twice ``in`` less 1, x and y times ``scale``: a direction in tangent space."""
        made = self._input(node, "in", (0.5, 0.5, 1.0))
        if made is None or str(node.value("space", "tangent")) != "tangent":
            return None
        if node.source("scale") is not None:
            return None
        two = np.size(node.value("scale", 1.0)) > 1
        x, y = (self.findings.numbers(node, "scale", (1.0,) * (2 if two else 1)) * 2)[:2]
        doubled = made.times((2.0 * x, 2.0 * y, 2.0))
        return None if doubled is None else doubled.plus((-x, -y, -1.0))

    def _primvar(self, node: Node, category: str) -> Signal | None:
        if category == "geomcolor":
            return Signal((1.0, 1.0, 1.0), primvar="displayColor", absent=(0.0, 0.0, 0.0))
        reader = category == "UsdPrimvarReader"
        name = str(node.value("varname" if reader else "geomprop", "") or "")
        absent = self._constant(node, "fallback" if reader else "default", (0.0, 0.0, 0.0))
        return Signal((1.0, 1.0, 1.0), primvar=name, absent=absent) if name else None

    # -- textures ------------------------------------------------------------------------

    def _image(self, node: Node, category: str, types: list[str]) -> Signal:
        findings, width = self.findings, width_of(types)
        usd = category == "UsdUVTexture"
        file = findings.file(node, "image")
        uv_set, matrix = self._coordinates(node, "st" if usd else "texcoord")
        if category == "tiledimage":
            matrix = _tiling(node, findings) @ matrix
        names = ("wrapS", "wrapT") if usd else ("uaddressmode", "vaddressmode")
        wrap_s, wrap_t = (
            "repeat" if category == "tiledimage" else self._wrap(node, name) for name in names
        )
        fallback = findings.numbers(node, "fallback" if usd else "default", (0.0,) * width)
        use = TextureUse(
            texture=TextureRef(file, self._decode(node, file, types), wrap_s, wrap_t),  # type: ignore[arg-type]
            uv_set=uv_set,
            matrix=rows(matrix),
            channel=0 if width == 1 else -1,
            fallback=_texel(fallback),
        )
        if usd:
            scale = findings.four(node, "scale", (1.0,) * 4)
            use = replace(use, scale=scale, bias=findings.four(node, "bias", (0.0,) * 4))
        return Signal(fallback, use)

    def _decode(self, node: Node, file: str, types: list[str]) -> str:
        """By the colour space of the file's input; MaterialX takes what has none as it is."""
        space = _color_space(node, "file")
        if space in _SRGB:
            return "gamma"
        color = bool(types) and types[0].startswith("color")
        if space and space not in _LINEAR:
            text = f"{space}: want srgb_texture or lin_rec709; taken as linear Rec. 709"
            self.findings.finding("color-space", text, Kind.REPLACED)
        elif color and not space and file.lower().endswith(EIGHT_BIT):
            text = f"{file.rpartition('/')[2]}: no colour space is stated; taken as linear"
            self.findings.finding("color-space", text, Kind.ASSUMED)
        return "linear"

    def _wrap(self, node: Node, name: str) -> str:
        return _WRAPS.get(str(node.value(name, "periodic")), "repeat")

    def _coordinates(self, image: Node, name: str) -> tuple[str, Matrix]:
        """The primvar and the (3, 3) matrix that lead to a texture's coordinates."""
        matrix, node = np.eye(3), image
        for _ in range(_MOST_STEPS):
            source = node.source(name)
            if source is None:
                if node.authored(name):
                    s, t = self.findings.numbers(node, name, (0.0, 0.0))
                    return "st", matrix @ constant_place(s, t)
                return "st", matrix  # the default: the first set of coordinates
            category, _ = node_kind(source)
            if category == "texcoord":
                index = int(self.findings.number(source, "index", 0.0))
                return "st" if index <= 0 else f"st{index}", matrix
            if category in ("geompropvalue", "UsdPrimvarReader"):
                port = "geomprop" if category == "geompropvalue" else "varname"
                return str(source.value(port, "") or "st"), matrix
            step = _step(source, category, self.findings)
            if step is None:
                break
            matrix, name, node = matrix @ step[0], step[1], source
        text = f"{name}: {source.id if source else 'a loop'} is not read; st is used"
        self.findings.finding("node-unknown", text)
        return "st", matrix


def _step(node: Node, category: str, findings: Findings) -> tuple[Matrix, str] | None:
    """What one node does to texture coordinates, and the input that it does it to."""
    pair = (0.0, 0.0)
    if category == "UsdTransform2d":
        scale = findings.numbers(node, "scale", (1.0, 1.0))
        angle = findings.number(node, "rotation", 0.0)
        return transform_2d(scale, angle, findings.numbers(node, "translation", pair)), "in"
    if category == "place2d":
        return _place(node, findings), "texcoord"
    if category == "rotate2d":
        return _turn(findings.number(node, "amount", 0.0)), "in"
    if category in ("multiply", "divide", "add", "subtract") and node.source("in2") is None:
        neutral = 1.0 if category in ("multiply", "divide") else 0.0
        wide = np.size(node.value("in2", neutral)) > 1
        x, y = (findings.numbers(node, "in2", (neutral,) * (2 if wide else 1)) * 2)[:2]
        if category == "divide":
            x, y = (1.0 / v if v else 1.0 for v in (x, y))
        if category == "subtract":
            x, y = -x, -y
        scales = category in ("multiply", "divide")
        return (np.diag([x, y, 1.0]) if scales else _moved(x, y)), "in1"
    return None


def _place(node: Node, findings: Findings) -> Matrix:
    """place2d: about ``pivot``, divided by ``scale``, turned clockwise, less ``offset``."""
    px, py = findings.numbers(node, "pivot", (0.0, 0.0))
    sx, sy = (1.0 / v if v else 1.0 for v in findings.numbers(node, "scale", (1.0, 1.0)))
    ox, oy = findings.numbers(node, "offset", (0.0, 0.0))
    size, turn = np.diag([sx, sy, 1.0]), _turn(findings.number(node, "rotate", 0.0))
    if findings.number(node, "operationorder", 0.0) >= 1.0:
        inner = size @ turn @ _moved(-ox, -oy)
    else:
        inner = _moved(-ox, -oy) @ turn @ size
    return np.asarray(_moved(px, py) @ inner @ _moved(-px, -py))


def _tiling(node: Node, findings: Findings) -> Matrix:
    """tiledimage: times ``uvtiling``, less ``uvoffset``, then by the sizes in the real world."""
    tx, ty = findings.numbers(node, "uvtiling", (1.0, 1.0))
    ox, oy = findings.numbers(node, "uvoffset", (0.0, 0.0))
    ix, iy = (v or 1.0 for v in findings.numbers(node, "realworldimagesize", (1.0, 1.0)))
    rx, ry = findings.numbers(node, "realworldtilesize", (1.0, 1.0))
    return np.asarray(np.diag([rx / ix, ry / iy, 1.0]) @ _moved(-ox, -oy) @ np.diag([tx, ty, 1.0]))


def _turn(degrees: float) -> Matrix:
    """rotate2d of the standard library: clockwise for a positive angle."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _moved(x: float, y: float) -> Matrix:
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def _color_space(node: Node, name: str) -> str:
    attribute = node.producer(name)
    return str(attribute.GetColorSpace()) if attribute is not None else ""


def _texel(values: Values) -> tuple[float, float, float, float]:
    r, g, b, a = (*values * 3, 1.0)[:4] if len(values) == 1 else (*values, 0.0, 1.0)[:4]
    return r, g, b, a


def _converted(made: Signal, width: int) -> Signal:
    if made.use is None:
        value = made.value * width if len(made.value) == 1 else made.value[:width]
        return replace(made, value=value)
    return made


def _swizzled(made: Signal, channels: str) -> Signal | None:
    """One component, or the first ones in their order."""
    if channels and len(set(channels)) == 1:
        return made.channel(_LETTERS.get(channels[0], -1))
    return made if channels in ("rgb", "xyz", "rgba", "xyzw", "xy") else None


def product(a: Signal, b: Signal) -> Signal | None:
    """The product of two signals, of which one is constant, or of a texture and a primvar."""
    if b.constant:
        return a.times(b.value)
    if a.constant:
        return b.times(a.value)
    texture, primvar = (a, b) if a.use is not None else (b, a)
    if texture.use is None or texture.primvar or primvar.use is not None:
        return None
    made = texture.times(primvar.value)
    return replace(made, primvar=primvar.primvar, absent=primvar.absent) if made else None


def _sum(a: Signal, b: Signal) -> Signal | None:
    if b.constant:
        return a if not any(b.value) else a.plus(b.value)
    if a.constant:
        return b if not any(a.value) else b.plus(a.value)
    return None
