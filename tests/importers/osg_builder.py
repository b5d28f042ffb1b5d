"""OpenSceneGraph text files for tests: put together from strings, written, read back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from hypothesis import HealthCheck, settings

from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.osg import read
from hdrusd.legacy.scene import LegacyScene, Light, Material, Mesh, Node
from hdrusd.report import Finding, Report

HEADER = "#Ascii Scene \n#Version 161 \n#Generator OpenSceneGraph 3.6.5 \n\n"

#: A unit square, counter-clockwise, and four points of a strip that covers it.
SQUARE = "0 0 0 \n 1 0 0 \n 1 1 0 \n 0 1 0"
STRIP = "0 0 0 \n 1 0 0 \n 0 1 0 \n 1 1 0"

#: For hypothesis: files are written, so an example takes its time.
quick = settings(
    max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


class Loaded(NamedTuple):
    """A scene and what was said about it."""

    scene: LegacyScene
    report: Report

    @property
    def mesh(self) -> Mesh:
        """The only mesh."""
        (mesh,) = self.scene.meshes
        return mesh

    @property
    def faces(self) -> list[list[int]]:
        """The corner indices of the only mesh, face by face."""
        indices = iter(self.mesh.face_indices.tolist())
        return [[next(indices) for _ in range(count)] for count in self.mesh.face_counts.tolist()]

    @property
    def material(self) -> Material:
        """The only material."""
        (material,) = self.scene.materials
        return material

    @property
    def light(self) -> Light:
        """The only light."""
        (light,) = self.scene.lights
        return light

    @property
    def root(self) -> Node:
        """The only root."""
        (root,) = self.scene.roots
        return root

    def nodes(self) -> Iterator[Node]:
        """Every node, parents first."""
        waiting = list(reversed(self.scene.roots))
        while waiting:
            node = waiting.pop()
            yield node
            waiting += reversed(node.children)

    def node(self, name: str) -> Node:
        """The first node of that name."""
        return next(node for node in self.nodes() if node.name == name)

    def codes(self) -> set[str]:
        """Codes of the findings, without the one that every file of this format has."""
        return self.report.codes() - {"osg-axes"}

    def finding(self, code: str) -> Finding:
        """The only finding of a code."""
        (finding,) = (f for f in self.report if f.code == code)
        return finding


def load(folder: Path, text: str | bytes, *, limits: Limits | None = None) -> Loaded:
    """Write the text as .osgt if it begins with the header, else as .osg, and read it."""
    content = text if isinstance(text, bytes) else text.encode()
    path = folder / ("scene.osgt" if content.startswith(b"#Ascii") else "scene.osg")
    path.write_bytes(content)
    report = Report()
    return Loaded(read(Resolver(path, report, limits=limits or Limits()), report), report)


# --- .osgt --------------------------------------------------------------------------------


def group(*children: str, fields: str = "", kind: str = "osg::Group") -> str:
    """A node with children; ``fields`` stand before them."""
    inside = "\n".join(children)
    return f"{kind} {{\n{fields}\nChildren {len(children)} {{\n{inside}\n}}\n}}"


def scene(*children: str, fields: str = "") -> str:
    """A whole .osgt file: a Group of ``children``."""
    return HEADER + group(*children, fields=fields) + "\n"


def array(role: str, kind: str, rows: str, binding: str = "BIND_PER_VERTEX") -> str:
    """``NormalArray TRUE { osg::Vec3Array {...} }`` with one row to a line."""
    count = len(rows.splitlines())
    values = f"Binding {binding} \nvector {count} {{\n{rows}\n}}"
    return f"{role}Array TRUE {{\nosg::{kind} {{\n{values}\n}}\n}}"


def coordinates(rows: str) -> str:
    """Texture coordinates of unit 0."""
    inside = array("X", "Vec2Array", rows).partition("\n")[2].rpartition("\n")[0]
    return f"TexCoordArrayList 1 {{\n{inside}\n}}"


def geometry(
    sets: str = "osg::DrawArrays {\nMode QUADS \nCount 4 \n}",
    points: str = SQUARE,
    more: str = "",
    kind: str = "Vec3Array",
) -> str:
    """A Geometry: primitive sets, points, further arrays and fields."""
    primitives = f"PrimitiveSetList 1 {{\n{sets}\n}}"
    return f"osg::Geometry {{\n{more}\n{primitives}\n{array('Vertex', kind, points)}\n}}"


def geode(*drawables: str, fields: str = "", kind: str = "osg::Geode") -> str:
    """A Geode with drawables."""
    inside = "\n".join(drawables)
    return f"{kind} {{\n{fields}\nDrawables {len(drawables)} {{\n{inside}\n}}\n}}"


def state_set(
    modes: str = "", attributes: str = "", unit: str = "", fields: str = "", units: int = 1
) -> str:
    """A StateSet; ``unit`` are the texture attributes of unit 0, which is switched on."""
    parts = [fields]
    if modes:
        parts.append(f"ModeList 1 {{\n{modes}\n}}")
    if attributes:
        parts.append(f"AttributeList 1 {{\n{attributes}\n}}")
    if unit:
        on = "Data 1 {\nGL_TEXTURE_2D ON \n}\n" * units
        parts.append(f"TextureModeList {units} {{\n{on}}}")
        data = f"Data 1 {{\n{unit}\n}}\n" * units
        parts.append(f"TextureAttributeList {units} {{\n{data}}}")
    inside = "\n".join(parts)
    return f"StateSet TRUE {{\nosg::StateSet {{\n{inside}\n}}\n}}"


def material(fields: str, value: str = "OFF") -> str:
    """A Material attribute with its Value line."""
    return f"osg::Material {{\n{fields}\n}}\nValue {value} "


def texture(image: str, fields: str = "WRAP_S REPEAT \nWRAP_T REPEAT ") -> str:
    """A Texture2D attribute with an Image of the given fields."""
    return (
        f"osg::Texture2D {{\n{fields}\nImage TRUE {{\nClassName osg::Image \n{image}\n}}\n}}\n"
        "Value OFF "
    )


def named(file: str) -> str:
    """The fields of an external image."""
    return f'FileName "{file}" \nWriteHint 0 2 '


def inlined(size: str, pixel_format: int, data: str, packing: int = 1) -> str:
    """The fields of an image whose pixels stand in the file."""
    return (
        f'FileName "in.rgb" \nWriteHint 0 0 \nOrigin 0 \nSize {size} \n'
        f"InternalTextureFormat {pixel_format} \nPixelFormat {pixel_format} \nDataType 5121 \n"
        f'Packing {packing} \nAllocationMode 1 \nData 1 {{\n"{data}" }}'
    )


def light_source(fields: str, more: str = "") -> str:
    """A LightSource with its Light."""
    return f"osg::LightSource {{\n{more}\nLight TRUE {{\nosg::Light {{\n{fields}\n}}\n}}\n}}"


# --- .osg ---------------------------------------------------------------------------------


def old_geometry(
    sets: str = "DrawArrays QUADS 0 4", points: str = SQUARE, more: str = "", before: str = ""
) -> str:
    """A Geometry in the older syntax."""
    count = len(points.splitlines())
    return (
        f"Geometry {{\n{before}\nPrimitiveSets 1\n{{\n{sets}\n}}\n"
        f"VertexArray Vec3Array {count}\n{{\n{points}\n}}\n{more}\n}}"
    )


def old_geode(*drawables: str, fields: str = "") -> str:
    """A Geode in the older syntax."""
    inside = "\n".join(drawables)
    return f"Geode {{\n{fields}\nnum_drawables {len(drawables)}\n{inside}\n}}\n"


def old_group(*children: str, fields: str = "", kind: str = "Group") -> str:
    """A node with children in the older syntax."""
    inside = "\n".join(children)
    return f"{kind} {{\n{fields}\nnum_children {len(children)}\n{inside}\n}}\n"


# --- a square in a state ------------------------------------------------------------------

UVS = coordinates("0 0 \n1 0 \n1 1 \n0 1")


def dressed(folder: Path, state: str, *, more: str = UVS) -> Loaded:
    """A square in a Geode with a StateSet."""
    return load(folder, scene(geode(geometry(more=more), fields=state)))


def old_dressed(folder: Path, state: str, before: str = "") -> Loaded:
    """A square in a Geode with a StateSet in the older syntax."""
    body = f"StateSet {{\n{state}\n}}"
    return load(folder, old_geode(old_geometry(before=before), fields=body))
