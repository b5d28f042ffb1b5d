"""FBX 7.4 as text, by hand: files of known content without the data set.

Every object has a number; ``connect`` says what hangs on what. Properties are written by
``P`` with the type that the format wants.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import pytest

from hdrusd.importers.importer import Resolver, read
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Report

#: The binding is never imported here: only a worker may.
needs_ufbx = pytest.mark.skipif(
    find_spec("ufbx") is None, reason="ufbx is not installed: pip install 'hdrusd[fbx]'"
)

SQUARE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))
#: float32 of a number of magnitude 1: half a unit in the last place.
EPS = 6e-8
#: FBX's ticks of time, 1/s.
SECOND = 46186158000

_DOUBLE3 = ("Lcl Translation", "Lcl Rotation", "Lcl Scaling")


def P(name: str, *values: float | str, kind: str = "") -> str:
    """A property: "Number", "Color" or "Vector3D" by the count of its values, or ``kind``."""
    if not kind:
        kind = name if name in _DOUBLE3 else {1: "Number", 3: "Vector3D"}[len(values)]
    shown = ",".join(f'"{v}"' if isinstance(v, str) else f"{v!r}" for v in values)
    flags = "A+U" if kind.startswith("user ") else "A"
    kind = kind.removeprefix("user ")
    return f'P: "{name}", "{kind}", "", "{flags}",{shown}'


def array(name: str, values: Sequence[float]) -> str:
    """An array: its length, then its values."""
    return f"{name}: *{len(values)} {{\n a: {','.join(map(repr, values))}\n}}"


class Fbx:
    """A file in the making."""

    def __init__(self, *, unit: float = 1.0, axes: Sequence[int] = (1, 1, 2, 1, 0, 1)) -> None:
        """``unit``: centimetres; ``axes``: number and sign of up, front and right."""
        words = ("UpAxis", "UpAxisSign", "FrontAxis", "FrontAxisSign", "CoordAxis", "CoordAxisSign")
        pairs = zip(words, axes, strict=True)
        self.settings = [P(word, value, kind="int") for word, value in pairs]
        self.settings.append(P("UnitScaleFactor", unit))
        self.objects: list[str] = []
        self.connections: list[str] = []
        self._last = 1000

    def add(self, kind: str, name: str, sub: str, *body: str, under: int | None = 0) -> int:
        """An object; ``under``: what it hangs on, 0 the root, None nothing yet."""
        self._last += 1
        prefix = {"Model": "Model", "Texture": "Texture"}.get(kind, kind)
        if kind == "NodeAttribute":
            prefix = "NodeAttribute"
        lines = "\n".join(body)
        self.objects.append(f'{kind}: {self._last}, "{prefix}::{name}", "{sub}" {{\n{lines}\n}}')
        if under is not None:
            self.connect(self._last, under)
        return self._last

    def connect(self, child: int, parent: int, prop: str = "") -> None:
        """``child`` hangs on ``parent``, or on a property of it."""
        tail = f',"{prop}"' if prop else ""
        self.connections.append(f'C: "{"OP" if prop else "OO"}",{child},{parent}{tail}')

    def model(self, name: str, sub: str = "Null", *props: str, under: int = 0) -> int:
        """A node."""
        return self.add("Model", name, sub, "Version: 232", properties(*props), under=under)

    def attribute(self, sub: str, *props: str, under: int) -> int:
        """What makes a node a light, a camera, a bone."""
        body = f'TypeFlags: "{sub}"'
        return self.add("NodeAttribute", "", sub, body, properties(*props), under=under)

    def mesh(
        self,
        under: int,
        points: Sequence[Sequence[float]],
        faces: Sequence[Sequence[int]],
        *layers: str,
    ) -> int:
        """Polygons: the last index of each is written as its complement."""
        flat = [float(v) for point in points for v in point]
        corners = [i for face in faces for i in (*face[:-1], ~face[-1])]
        shown = "Layer: 0 {\nVersion: 100\n" + "".join(
            f'LayerElement: {{\nType: "{layer.partition(":")[0]}"\n'
            f"TypedIndex: {layer.partition(':')[2].split()[0]}\n}}\n"
            for layer in layers
        )
        body = (array("Vertices", flat), array("PolygonVertexIndex", corners), *layers)
        return self.add("Geometry", "", "Mesh", *body, f"{shown}}}", under=under)

    def curve(self, under: int, prop: str, keys: Sequence[tuple[float, float]]) -> int:
        """Straight lines between keys (seconds, value) of one number, "d|X" of a curve node."""
        times = [round(time * SECOND) for time, _ in keys]
        body = (
            "Default: 0",
            "KeyVer: 4009",
            array("KeyTime", times),
            array("KeyValueFloat", [value for _, value in keys]),
            array("KeyAttrFlags", [4]),  # linear
            array("KeyAttrDataFloat", [0, 0, 0, 0]),
            array("KeyAttrRefCount", [len(keys)]),
        )
        made = self.add("AnimationCurve", "", "", *body, under=None)
        self.connect(made, under, prop)
        return made

    def take(self) -> int:
        """An animation stack with one layer, whose number this is."""
        stop = P("LocalStop", 10 * SECOND, kind="KTime")
        stack = self.add("AnimationStack", "Take", "", properties(stop), under=None)
        return self.add("AnimationLayer", "Base", "", under=stack)

    def text(self) -> str:
        """The file."""
        parts = (
            "; FBX 7.4.0 project file",
            "FBXHeaderExtension: {\nFBXHeaderVersion: 1003\nFBXVersion: 7400\n"
            'Creator: "made by hand"\n}',
            f"GlobalSettings: {{\nVersion: 1000\n{properties(*self.settings)}\n}}",
            "Objects: {\n" + "\n".join(self.objects) + "\n}",
            "Connections: {\n" + "\n".join(self.connections) + "\n}",
        )
        return "\n".join(parts) + "\n"

    def write(self, folder: Path, name: str = "made.fbx") -> Path:
        """The file, written."""
        path = folder / name
        path.write_text(self.text(), encoding="utf-8")
        return path


def properties(*props: str) -> str:
    """A block of properties."""
    return "Properties70: {\n" + "\n".join(props) + "\n}"


def layer(
    kind: str,
    field: str,
    values: Sequence[float],
    indices: Sequence[int] = (),
    *,
    number: int = 0,
    name: str = "",
    mapping: str = "ByPolygonVertex",
) -> str:
    """A layer element: "LayerElementUV", its field "UV", values and the index of each corner."""
    word = {"Materials": "Materials", "Normals": "NormalsIndex", "Colors": "ColorIndex"}
    how = "IndexToDirect" if indices or field == "Materials" else "Direct"
    body = [
        "Version: 101",
        f'Name: "{name}"',
        f'MappingInformationType: "{mapping}"',
        f'ReferenceInformationType: "{how}"',
        array(field, values),
    ]
    if indices:
        body.append(array(word.get(field, f"{field}Index"), indices))
    lines = "\n".join(body)
    return f"{kind}: {number} {{\n{lines}\n}}"


def load(path: Path) -> tuple[LegacyScene, Report]:
    """What the reader makes of a file."""
    report = Report()
    return read(Resolver(path, report), report), report


def square(fbx: Fbx, name: str = "square", *layers: str, under: int = 0) -> int:
    """A node with a square; its number."""
    node = fbx.model(name, "Mesh", under=under)
    fbx.mesh(node, SQUARE, [(0, 1, 2, 3)], *layers)
    return node
