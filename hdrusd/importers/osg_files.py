"""The files that an OpenSceneGraph scene is made of: the source, and those that its nodes name.

A ProxyNode stands for other files, a PagedLOD has levels in other files. Each file is read once.
What is OpenSceneGraph's own, in whatever form, is read as a part of the tree, below the state of
the node that names it. Other formats are read by their own readers, as OpenSceneGraph does by
its plug-ins, whose axes and units are followed: Y up is turned to Z up, but for the formats that
state no axis and are taken as they stand; an OpenFlight file comes in metres, and a unit of all
others is a unit, whatever they state. Of the plug-ins for OBJ, COLLADA, 3DS, PLY, STL and AC3D
this was seen in what osgconv 3.6.5 writes.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg (ProxyNode.cpp, PagedLOD.cpp),
src/osgDB/DatabasePager.cpp; src/osgPlugins/OpenFlight/ReaderWriterFLT.cpp (units),
src/osgPlugins/obj/ReaderWriterOBJ.cpp (noRotation).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers import importer, osgb, osgconv
from hdrusd.importers.importer import SUFFIXES, Limits, Resolver, resolver_of
from hdrusd.importers.osg_geometry import GeometryReader
from hdrusd.importers.osg_light_points import LightPointReader
from hdrusd.importers.osg_lights import LightReader, LightSwitches
from hdrusd.importers.osg_materials import MaterialReader
from hdrusd.importers.osg_nodes import External, NodeReader
from hdrusd.importers.osg_state import StateReader
from hdrusd.importers.osg_text import Document, Statement, parse
from hdrusd.importers.osg_textures import TextureReader
from hdrusd.legacy.merge import merge, rescaled
from hdrusd.legacy.scene import Image, LegacyScene, Node
from hdrusd.report import Kind, Report

_OWN = {"osg", "osgb", "osgconv"}  # formats of OpenSceneGraph itself
_NOT_TURNED = {".ac", ".ply", ".stl"}
_Y_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], np.float64)


def load(resolver: Resolver, report: Report) -> Document:
    """The tree of ``resolver.source``, by its suffix. Raises InputError."""
    kind = SUFFIXES.get(resolver.source.suffix.lower())
    if kind == "osgb":
        return osgb.load(resolver, report)
    if kind == "osgconv":
        return osgconv.load(resolver, report)
    return parse(resolver.read(), resolver.source, report, resolver.limits)


class File:
    """A file in a form of OpenSceneGraph's, and what reads it into ``scene``."""

    def __init__(
        self,
        document: Document,
        resolver: Resolver,
        materials: MaterialReader,
        switches: LightSwitches,
        images: dict[Path, Image],
    ) -> None:
        most = resolver.limits.vertices
        self.document = document
        self.resolver = resolver
        self.path = resolver.source.resolve()
        self.described = NodeReader(document, most)
        self.states = StateReader(document)
        self.geometries = GeometryReader(document, most)
        self.lights = LightReader(document, self.states, switches)
        self.points = LightPointReader(document, switches.lights)
        materials.add_file(document, TextureReader(document, resolver, images))
        self.roots: list[Statement] = list(document.objects(document.root))


@dataclass(slots=True)
class Files:
    """All files of a scene, each read once."""

    scene: LegacyScene
    report: Report
    materials: MaterialReader
    switches: LightSwitches
    limits: Limits
    _images: dict[Path, Image] = field(default_factory=dict)
    _read: dict[Path, File | Node | None] = field(default_factory=dict)
    _found: dict[tuple[Path, str, str], Path | None] = field(default_factory=dict)
    _points: int = 0

    def add(self, document: Document, resolver: Resolver) -> File:
        """A file in a form of OpenSceneGraph's."""
        file = File(document, resolver, self.materials, self.switches, self._images)
        self._read[file.path] = file
        return file

    def find(self, external: External, file: File, name: str) -> Path | None:
        """The file that a node ``name`` of ``file`` names; None, with a finding."""
        key = file.path, external.folder, external.name
        if key not in self._found:
            self._found[key] = self._find(external, file, name)
        return self._found[key]

    def _find(self, external: External, file: File, name: str) -> Path | None:
        place = file.document.ref(external.place)
        folder = external.folder.replace("\\", "/")
        reference = external.name.replace("\\", "/")
        try:
            if folder and file.resolver.allowed(file.path.parent / folder / reference):
                reference = f"{folder.rstrip('/')}/{reference}"
        except (OSError, ValueError, RuntimeError):  # no path at all, or a loop of links
            pass
        return file.resolver.find(reference, place, thing=name)

    def read(self, path: Path, external: External, file: File, name: str) -> File | Node | None:
        """A file, or the node that holds all of one in another format.

        None, with a finding at the node ``name`` of ``file``, where it cannot be read.
        """
        if path not in self._read:
            self._read[path] = None
            resolver = resolver_of(path, file.resolver)
            try:
                if SUFFIXES.get(path.suffix.lower()) in _OWN:
                    return self.add(load(resolver, self.report), resolver)
                self._read[path] = self._foreign(resolver)
            except InputError as error:
                text = f"{error}; left out"
                file.document.add(Kind.INVALID, "osg-external", external.place, name, text)
        return self._read[path]

    def count(self, points: int) -> None:
        """Count points. Raises InputError where all files have too many."""
        most = self.limits.vertices
        if self._points + points > most:
            text = f"more than {most} points with the files that it is made of"
            raise InputError(self.scene.source, text)
        self._points += points

    def _foreign(self, resolver: Resolver) -> Node:
        """The node that holds what another reader makes of a file. Raises InputError."""
        # What its format leaves open OpenSceneGraph decides, as is said below.
        open_to = {"up"} if resolver.source.suffix.lower() == ".flt" else {"unit", "up"}
        resolver = replace(resolver, stated=frozenset(open_to))
        part = importer.read_part(resolver, self.report)
        self.count(sum(len(mesh.points) for mesh in part.meshes))
        path = resolver.source
        turned = part.up == "Y" and path.suffix.lower() not in _NOT_TURNED
        holder = Node(path.stem, SourceRef(path), _Y_UP.copy() if turned else None)
        said = ["Y up is turned to Z up" if turned else "Z is up"]
        if part.format == "flt":
            said.append("in metres")
            if part.unit_m != 1.0:
                turn = np.eye(4) if holder.transform is None else np.asarray(holder.transform)
                holder.transform = turn @ np.diag((*(part.unit_m,) * 3, 1.0))
                part.lights = [rescaled(light, part.unit_m) for light in part.lights]
                said[-1] = f"units of {part.unit_m:g} m are scaled to metres"
        else:
            stated = "" if part.unit_m == 1.0 else f", though it states {part.unit_m:g} m"
            said.append(f"1 unit is 1 unit of this scene{stated}")
        text = f"a part of {self.scene.source.name}: {', '.join(said)}, as in OpenSceneGraph"
        self.report.add(Kind.ASSUMED, "osg-external-axes", SourceRef(path), path.name, text)
        if part.ambient is not None and self.scene.ambient not in (None, part.ambient):
            text = "ambient light of a part of the scene; that of the first part is used for all"
            self.report.add(Kind.DROPPED, "osg-light-model", SourceRef(path), path.name, text)
        holder.children = merge(self.scene, part)
        return holder
