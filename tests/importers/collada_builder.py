"""Small COLLADA documents, put together library by library."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.importers.collada import read
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Report

SQUARE = "0 0 0  1 0 0  1 1 0  0 1 0"
PHONG = "<phong><diffuse><color>.1 .2 .3 1</color></diffuse></phong>"


def numbers(values: Any) -> str:
    """Numbers as the text of an element."""
    return " ".join(repr(float(v)) for v in np.ravel(values))


def source(name: str, values: str, width: int, count: int | None = None) -> str:
    """A source of ``width`` numbers a row; ``count``: what it says of its rows."""
    total = len(values.replace(",", ".").split())
    rows = total // width if count is None else count
    return (
        f'<source id="{name}"><float_array id="{name}-a" count="{rows * width}">{values}'
        f'</float_array><technique_common><accessor source="#{name}-a" count="{rows}" '
        f'stride="{width}"/></technique_common></source>'
    )


def names(name: str, words: str) -> str:
    """A source of words."""
    count = len(words.split())
    array = f'<Name_array id="{name}-a" count="{count}">{words}</Name_array>'
    return f'<source id="{name}">{array}</source>'


def geometry(faces: str, sources: str = "", points: str = SQUARE, name: str = "g") -> str:
    """A mesh of ``faces``, whose points are those of ``points``."""
    return (
        f'<geometry id="{name}" name="{name}"><mesh>{source(f"{name}-p", points, 3)}{sources}'
        f'<vertices id="{name}-v"><input semantic="POSITION" source="#{name}-p"/></vertices>'
        f"{faces}</mesh></geometry>"
    )


def triangles(p: str, more: str = "", material: str = "m", name: str = "g") -> str:
    """Triangles by the points' numbers; ``more``: further inputs."""
    columns = 1 + more.count("<input")
    count = len(p.split()) // (3 * columns)
    return (
        f'<triangles count="{count}" material="{material}">'
        f'<input semantic="VERTEX" source="#{name}-v" offset="0"/>{more}<p>{p}</p></triangles>'
    )


def material(shader: str = PHONG, params: str = "", more: str = "", name: str = "m") -> str:
    """The libraries of one material and its effect."""
    return (
        f'<library_effects><effect id="{name}-fx"><profile_COMMON>{params}'
        f'<technique sid="common">{shader}</technique>{more}</profile_COMMON></effect>'
        f'</library_effects><library_materials><material id="{name}" name="{name}">'
        f'<instance_effect url="#{name}-fx"/></material></library_materials>'
    )


def bound(inputs: str = "", target: str = "m", symbol: str = "m") -> str:
    """A bind_material of one symbol."""
    return (
        f'<bind_material><technique_common><instance_material symbol="{symbol}" '
        f'target="#{target}">{inputs}</instance_material></technique_common></bind_material>'
    )


def instance(bind: str = "", name: str = "g") -> str:
    """An instance of a geometry."""
    return f'<instance_geometry url="#{name}">{bind}</instance_geometry>'


def document(
    libraries: str = "",
    nodes: str = "",
    asset: str = '<unit meter="1"/><up_axis>Z_UP</up_axis>',
    tool: str = "",
    head: str = '<?xml version="1.0" encoding="utf-8"?>',
) -> str:
    """A whole file with ``nodes`` in its scene."""
    return (
        f'{head}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset><contributor><authoring_tool>{tool}</authoring_tool></contributor>{asset}</asset>"
        f'{libraries}<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene>'
        '</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


def mesh_document(
    faces: str, sources: str = "", points: str = SQUARE, bind: str = "", libraries: str = ""
) -> str:
    """A file of one mesh on one node."""
    library = f"<library_geometries>{geometry(faces, sources, points)}</library_geometries>"
    return document(library + libraries, f'<node id="n">{instance(bind)}</node>')


def load(
    folder: Path, content: str | bytes, name: str = "a.dae", **limits: Any
) -> tuple[LegacyScene, Report]:
    """Read a document from a file in ``folder``."""
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    report = Report()
    return read(Resolver(path, report, **limits), report), report


def every_node(roots: Iterable[Node]) -> list[Node]:
    """All nodes of some trees, parents first."""
    return [n for root in roots for n in [root, *every_node(root.children)]]
