"""Writes the street as an OpenSceneGraph ASCII scene (.osgt, format version 161).

The order of the properties in an object is the reader's: OpenSceneGraph looks for
each in turn and takes what does not come for absent. An object that was written
before stands as its class and UniqueID alone. Array rows are not indented, which
halves the file.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

import numpy as np
from street_model import Light, Material, Mesh, Node, rotate
from street_model import Path as Motion

_CLASSES = {
    "group": "osg::Group",
    "matrix": "osg::MatrixTransform",
    "pat": "osg::PositionAttitudeTransform",
    "lod": "osg::LOD",
    "switch": "osg::Switch",
}

#: The GL light that stands for each kind: the sun is 0, of the others any number may burn.
_LIGHT_NUMBERS = {"SunLight": 0, "LuminaireLamp": 1, "ArcadeLamp": 2, "Headlamp": 3, "ShopLamp": 4}


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.6g}" for value in values)


class _Writer:
    """Indents, numbers objects, and remembers which were written."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._depth = 0
        self._next_id = 1
        self._ids: dict[object, int] = {}

    def line(self, text: str) -> None:
        """One line at the current depth; a brace at either end changes the depth."""
        if text.startswith("}"):
            self._depth -= 1
        self._file.write(f"{'  ' * self._depth}{text} \n")
        if text.endswith("{"):
            self._depth += 1

    def begin(self, cls: str, key: object = None) -> bool:
        """Open an object; False when ``key`` was written before and the object is now complete."""
        self.line(f"{cls} {{")
        known = key is not None and key in self._ids
        if not known:
            number = self._next_id
            self._next_id += 1
            if key is not None:
                self._ids[key] = number
        else:
            number = self._ids[key]
        self.line(f"UniqueID {number}")
        if known:
            self.line("}")
        return not known

    def rows(self, values: np.ndarray) -> None:
        """``vector n { ... }`` with a row of numbers for each row of ``values``."""
        form = " ".join(["%.6g"] * values.shape[1]) + " \n"
        self.line(f"vector {len(values)} {{")
        self._file.write((form * len(values)) % tuple(values.reshape(-1).tolist()))
        self.line("}")

    def array(self, name: str, cls: str, values: np.ndarray) -> None:
        """A vertex attribute with a value for each vertex."""
        self.line(f"{name} TRUE {{")
        self.begin(cls)
        self.line("Binding BIND_PER_VERTEX")
        self.rows(values)
        self.line("}")
        self.line("}")

    def elements(self, mode: str, index: np.ndarray) -> None:
        """A DrawElements of four numbers a row, as OpenSceneGraph breaks its lines."""
        flat = index.reshape(-1)
        short = int(flat.max(initial=0)) < 65536
        self.begin(f"osg::DrawElements{'UShort' if short else 'UInt'}")
        self.line(f"Mode {mode}")
        self.line(f"vector {len(flat)} {{")
        full = len(flat) - len(flat) % 4
        self._file.write(("%d %d %d %d \n" * (full // 4)) % tuple(flat[:full].tolist()))
        if full < len(flat):
            self._file.write(" ".join(str(i) for i in flat[full:]) + " \n")
        self.line("}")
        self.line("}")


def _state_set(w: _Writer, material: Material) -> None:
    """The StateSet of a material, shared by everything that wears it."""
    w.line("StateSet TRUE {")
    if w.begin("osg::StateSet", ("state", material.name)):
        w.line("DataVariance STATIC")
        w.line("ModeList 2 {")
        w.line(f"GL_CULL_FACE {'OFF' if material.two_sided else 'ON'}")
        w.line("GL_LIGHTING ON")
        w.line("}")
        w.line("AttributeList 1 {")
        w.begin("osg::Material")
        w.line(f'Name "{material.name}"')
        for name, colour in (
            ("Ambient", material.diffuse),
            ("Diffuse", material.diffuse),
            ("Specular", material.specular),
            ("Emission", material.emission),
        ):
            rgba = _numbers((*colour, 1.0))
            w.line(f"{name} TRUE Front {rgba} Back {rgba}")
        shine = _numbers((material.shininess,))
        w.line(f"Shininess TRUE Front {shine} Back {shine}")
        w.line("}")
        w.line("Value OFF")
        w.line("}")
        if material.texture is not None:
            _texture(w, material.texture)
        w.line("}")
    w.line("}")


def _texture(w: _Writer, file: str) -> None:
    """Texture unit 0 of a StateSet; the Texture2D is shared by all that show this file."""
    w.line("TextureModeList 1 {")
    w.line("Data 1 {")
    w.line("GL_TEXTURE_2D ON")
    w.line("}")
    w.line("}")
    w.line("TextureAttributeList 1 {")
    w.line("Data 1 {")
    if w.begin("osg::Texture2D", ("texture", file)):
        for axis in "STR":
            w.line(f"WRAP_{axis} REPEAT")
        w.line("MIN_FILTER LINEAR_MIPMAP_LINEAR")
        w.line("MAG_FILTER LINEAR")
        w.line("Image TRUE {")
        w.line("ClassName osg::Image")
        w.line(f"UniqueID {w._next_id}")
        w._next_id += 1
        w.line(f'FileName "textures/{file}"')
        w.line("WriteHint 0 2")
        w.line("DataVariance STATIC")
        w.line("}")
        w.line("}")
    w.line("Value OFF")
    w.line("}")
    w.line("}")


def _geode(w: _Writer, name: str, meshes: list[Mesh]) -> None:
    """A Geode with a Geometry for each mesh."""
    w.begin("osg::Geode")
    w.line(f'Name "{name}"')
    w.line(f"Drawables {len(meshes)} {{")
    for mesh in meshes:
        if not w.begin("osg::Geometry", mesh):
            continue
        w.line(f'Name "{mesh.name}"')
        w.line("DataVariance STATIC")
        _state_set(w, mesh.material)
        sets = [("QUADS", mesh.quads), ("TRIANGLES", mesh.tris)]
        sets = [(mode, index) for mode, index in sets if len(index)]
        w.line(f"PrimitiveSetList {len(sets)} {{")
        for mode, index in sets:
            w.elements(mode, index)
        w.line("}")
        w.array("VertexArray", "osg::Vec3Array", mesh.points)
        w.array("NormalArray", "osg::Vec3Array", mesh.normals)
        if mesh.material.texture is not None:
            w.line("TexCoordArrayList 1 {")
            w.begin("osg::Vec2Array")
            w.line("Binding BIND_PER_VERTEX")
            w.rows(mesh.uvs)
            w.line("}")
            w.line("}")
        w.line("}")
    w.line("}")
    w.line("}")


def _light_source(w: _Writer, node: Node, light: Light) -> None:
    """A LightSource; the node's place and direction go into the Light itself."""
    number = _LIGHT_NUMBERS[light.name]
    w.begin("osg::LightSource")
    w.line(f'Name "{node.name}"')
    w.line("CullingActive FALSE")
    w.line("StateSet TRUE {")
    if w.begin("osg::StateSet", ("light", number)):
        w.line("DataVariance STATIC")
        w.line("ModeList 1 {")
        w.line(f"GL_LIGHT{number} ON")
        w.line("}")
        w.line("}")
    w.line("}")
    axis = rotate(node.rotation, (0.0, 0.0, -1.0))
    directional = light.kind == "directional"
    # A directional light's position points back to where it comes from, with w = 0.
    place = (*(-a for a in axis), 0.0) if directional else (*node.translation, 1.0)
    w.line("Light TRUE {")
    w.begin("osg::Light")
    w.line(f"LightNum {number}")
    w.line("Ambient 0 0 0 1")
    w.line(f"Diffuse {_numbers((*light.colour, 1.0))}")
    w.line(f"Specular {_numbers((*light.colour, 1.0))}")
    w.line(f"Position {_numbers(place)}")
    w.line(f"Direction {_numbers(axis)}")
    names = ("ConstantAttenuation", "LinearAttenuation", "QuadraticAttenuation")
    for name, value in zip(names, light.attenuation, strict=True):
        w.line(f"{name} {value:.6g}")
    w.line(f"SpotExponent {light.exponent:.6g}")
    w.line(f"SpotCutoff {light.cutoff:.6g}")
    w.line("}")
    w.line("}")
    w.line("}")


def _path(w: _Writer, path: Motion) -> None:
    """The UpdateCallback that plays a path in a loop."""
    w.line("UpdateCallback TRUE {")
    w.begin("osg::AnimationPathCallback")
    w.line("AnimationPath TRUE {")
    w.begin("osg::AnimationPath")
    w.line(f"TimeControlPointMap {len(path.times)} {{")
    for time, position in zip(path.times, path.positions, strict=True):
        w.line(f"Time {time:.6g} {{")
        w.line(f"Position {_numbers(position)}")
        w.line(f"Rotation {_numbers(path.rotation)}")
        w.line("Scale 1 1 1")
        w.line("}")
    w.line("}")
    for _ in range(4):
        w.line("}")


def _matrix(w: _Writer, node: Node) -> None:
    """A MatrixTransform's matrix, of row vectors: the turned axes, then the place."""
    rotation, translation = node.rotation, node.translation
    if node.path is not None:
        rotation, translation = node.path.rotation, tuple(node.path.positions[0])
    w.line("Matrix {")
    for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        w.line(_numbers((*np.round(rotate(rotation, axis), 9) + 0.0, 0.0)))
    w.line(_numbers((*translation, 1.0)))
    w.line("}")


def _root_state(w: _Writer) -> None:
    """Daylight by default: lighting, the sun's light and a sky-coloured ambient."""
    w.line("StateSet TRUE {")
    w.begin("osg::StateSet")
    w.line("DataVariance STATIC")
    w.line("ModeList 3 {")
    for mode in ("GL_LIGHT0", "GL_LIGHTING", "GL_NORMALIZE"):
        w.line(f"{mode} ON")
    w.line("}")
    w.line("AttributeList 1 {")
    w.begin("osg::LightModel")
    w.line("AmbientIntensity 0.35 0.37 0.4 1")
    w.line("}")
    w.line("Value OFF")
    w.line("}")
    w.line("}")
    w.line("}")


def _node(w: _Writer, node: Node, root: bool = False) -> None:
    """A node and all below it. A node without transform, light or children is a bare Geode."""
    if node.light is not None:
        _light_source(w, node, node.light)
        return
    if not w.begin(_CLASSES[node.kind], node):
        return
    w.line(f'Name "{node.name}"')
    if node.path is not None:
        w.line("DataVariance DYNAMIC")
        _path(w, node.path)
    if root:
        _root_state(w)
    count = len(node.children) + bool(node.meshes)
    if count:
        w.line(f"Children {count} {{")
        if node.meshes:
            _geode(w, f"{node.name}_Geode", node.meshes)
        for child in node.children:
            _node(w, child)
        w.line("}")
    if node.kind == "matrix":
        _matrix(w, node)
    elif node.kind == "pat":
        w.line(f"Position {_numbers(node.translation)}")
        w.line(f"Attitude {_numbers(node.rotation)}")
        w.line("Scale 1 1 1")
    elif node.kind == "lod":
        w.line(f"RangeList {len(node.children)} {{")
        starts = (0.0, *node.lod_ends[:-1])
        for start, end in zip(starts, node.lod_ends, strict=True):
            w.line(_numbers((start, end)))
        w.line("}")
    elif node.kind == "switch":
        w.line(f"ValueList {len(node.switch_on)} {{")
        w.line(" ".join("TRUE" if on else "FALSE" for on in node.switch_on))
        w.line("}")
    w.line("}")


def write_osgt(root: Node, path: Path) -> None:
    """Write ``root`` to ``path``, with textures in ``textures/`` beside it. Raises OSError."""
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.write("#Ascii Scene \n#Version 161 \n#Generator OpenSceneGraph 3.6.5 \n\n")
        _node(_Writer(file), root, root=True)
