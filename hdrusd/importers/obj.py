"""Wavefront OBJ with its MTL libraries.

Source: Alias|Wavefront, Advanced Visualizer manual, appendix B1. Polygons stay
polygons; one mesh comes of each object or group that has faces.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.importers import mtl
from hdrusd.importers.importer import Resolver
from hdrusd.importers.left_open import leave_open
from hdrusd.importers.mtl_textures import LONGEST, locate
from hdrusd.importers.obj_meshes import mesh_of, recentre, usable_faces
from hdrusd.importers.obj_statements import Statements, parse
from hdrusd.importers.obj_text import Tally, shorten
from hdrusd.legacy.scene import TRS, Ints, LegacyScene, Material, Node
from hdrusd.report import Kind, Report

#: Code of what was counted to its kind and the words behind the number.
_FINDINGS = {
    "decimal-comma": (Kind.REPLACED, "numbers with a decimal comma: read as a point"),
    "encoding": (Kind.ASSUMED, "words that are not UTF-8: read as Latin-1"),
    "face-corners": (Kind.INVALID, "faces of fewer than three corners: dropped"),
    "face-index": (
        Kind.INVALID,
        "faces with an index that is 0, out of range or no number: dropped",
    ),
    "face-point": (Kind.INVALID, "faces with a point that is not three finite numbers: dropped"),
    "normal-missing": (Kind.REPLACED, "corners without a usable normal: the face's own is taken"),
    "obj-attributes": (Kind.DROPPED, "statements that set smoothing, display or detail: ignored"),
    "obj-elements": (Kind.DROPPED, "statements of points, lines, curves or surfaces: dropped"),
    "obj-unknown": (Kind.INVALID, "lines that are no OBJ statement: ignored"),
    "texcoord-depth": (Kind.DROPPED, "texture vertices with a third coordinate: it is dropped"),
    "texcoord-missing": (
        Kind.REPLACED,
        "corners without usable texture coordinates: (0, 0) is taken",
    ),
    "vertex-color": (Kind.INVALID, "vertices with a colour that is not finite numbers"),
    "vertex-color-missing": (Kind.REPLACED, "vertices without a usable colour: white is taken"),
    "vertex-color-range": (Kind.ASSUMED, "vertices with a colour outside 0 to 1: kept as it is"),
    "vertex-numbers": (Kind.DROPPED, "vertices of 5 or more than 7 numbers: the rest is dropped"),
    "vertex-weight": (Kind.DROPPED, "vertices with a weight w other than 1: it is for curves only"),
}

#: "a.mtl b c.mtl": each name goes on until its suffix.
_AFTER_SUFFIX = re.compile(r"(?<=\.mtl)\s+", re.IGNORECASE)


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read an OBJ file; the ``Importer`` of "obj".

    Raises InputError if it is binary, has no vertex or has more than the limits allow.
    """
    source = resolver.source
    tally = Tally()
    file = parse(resolver, tally)
    scene = LegacyScene(source, "obj", generator=file.generator)
    taken = {"unit": "1 unit = 1 m", "up": "Y up"}
    leave_open(scene, resolver, report, "obj-units", "OBJ", **taken)
    scene.materials = _libraries(file, resolver, report)
    materials = _worn(file, scene.materials, source, report)
    faces = usable_faces(file, materials, tally)
    root = Node(source.stem, SourceRef(source))
    scene.roots.append(root)
    offset = recentre(file, faces)
    if offset is not None:
        root.transform = TRS(translation=offset)
        text = f"coordinates too large for 32-bit floats: kept about {offset}, the root moves there"
        report.add(Kind.REPLACED, "obj-far-points", root.source, root.name, text)
    for part in faces.by_group():
        group = file.groups[int(part.group[0])]
        mesh = mesh_of(file, part, group.name or source.stem, source, tally)
        extras = {key: value for key, value in (("o", group.object), ("g", group.group)) if value}
        root.children.append(
            Node(mesh.name, mesh.source, meshes=[len(scene.meshes)], extras=extras)
        )
        scene.meshes.append(mesh)
    if not scene.meshes:
        text = f"no usable face among {file.face_counts.size}: the scene is empty"
        report.add(Kind.INVALID, "obj-empty", SourceRef(source), "", text)
    tally.report(report, source, _FINDINGS)
    return scene


def _libraries(file: Statements, resolver: Resolver, report: Report) -> list[Material]:
    """The materials of all libraries; of one name the first, as the manual says of mtllib."""
    paths: dict[Path, None] = {}
    for text, line in file.libraries.items():
        place = SourceRef(resolver.source, line)
        paths |= dict.fromkeys(_library_paths(text, place, resolver))
    materials: dict[str, Material] = {}
    for path in paths:
        for material in mtl.read(path, resolver, report):
            if material.name in materials:
                text = f"defined in {materials[material.name].source} already, which counts"
                thing = shorten(material.name)
                report.add(Kind.INVALID, "mtl-duplicate", material.source, thing, text)
            else:
                materials[material.name] = material
    return list(materials.values())


def _library_paths(text: str, place: SourceRef, resolver: Resolver) -> list[Path]:
    """The files of one ``mtllib``: all of it is one name with blanks, or it is several names."""
    text = text.replace('"', " ").strip()
    names = _AFTER_SUFFIX.split(text) if ".mtl" in text.lower() else text.split()
    silent = replace(resolver, report=Report())
    if not 0 < len(text) <= LONGEST or silent.find(text, place) is not None:
        names = [text]
    found = [locate([name], resolver, place, "mtllib") for name in dict.fromkeys(names)]
    return [path for path in found if path is not None]


def _worn(file: Statements, materials: list[Material], source: Path, report: Report) -> Ints:
    """The number of each used name in ``materials``, and last that of no name at all.

    Names that no library defines get a material of defaults, and faces before any
    ``usemtl`` the white one that the manual gives them.
    """
    numbers = {material.name: number for number, material in enumerate(materials)}
    for use in file.uses:
        if use.name not in numbers:
            place = SourceRef(source, use.line)
            text = "no library defines this material; defaults are used"
            report.add(Kind.MISSING, "material-undefined", place, shorten(use.name), text)
            numbers[use.name] = len(materials)
            materials.append(Material(use.name, place, defaults=mtl.FIELDS))
    bare = file.face_material == -1
    if bare.any():
        place = SourceRef(source, int(file.face_lines[np.argmax(bare)]))
        text = f"{np.count_nonzero(bare)} faces before any usemtl: a white material, as OBJ has it"
        report.add(Kind.ASSUMED, "material-none", place, "", text)
        white = (1.0, 1.0, 1.0)
        materials.append(Material("obj_default", place, diffuse=white, defaults=mtl.FIELDS))
    worn = [*(numbers[use.name] for use in file.uses), len(materials) - 1]
    return np.array(worn, np.int32)
