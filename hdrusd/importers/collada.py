"""COLLADA (.dae, .zae, .kmz) to a LegacyScene.

An own reader on expat rather than pycollada: that loses all geometry where numbers have decimal
commas, believes counts, knows no lines to name, leaves out wrap modes, ``extra``, animation, and
checks neither cycles nor depth; what it would save is smaller than what would have to be mended.

Sources: Khronos, COLLADA - Digital Asset Schema Release 1.4.1, 2nd edition (2008); 1.5.0.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.collada_animations import AnimationReader
from hdrusd.importers.collada_archive import unpack
from hdrusd.importers.collada_cameras import CameraReader
from hdrusd.importers.collada_document import Document, named
from hdrusd.importers.collada_geometry import GeometryReader
from hdrusd.importers.collada_lights import LightReader
from hdrusd.importers.collada_materials import MaterialReader
from hdrusd.importers.collada_nodes import NodeReader
from hdrusd.importers.collada_skins import SkinReader
from hdrusd.importers.collada_sources import Sources
from hdrusd.importers.collada_textures import TextureReader
from hdrusd.importers.collada_xml import Element, parse
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Kind, Report

_READ = frozenset(
    (
        "asset",
        "extra",
        "scene",
        "library_animations",
        "library_cameras",
        "library_controllers",
        "library_effects",
        "library_geometries",
        "library_images",
        "library_lights",
        "library_materials",
        "library_nodes",
        "library_visual_scenes",
    )
)
#: What stands in a scene by an instance: a library's children, and the library.
_INSTANCED = {
    "geometry": "library_geometries",
    "controller": "library_controllers",
    "light": "library_lights",
    "camera": "library_cameras",
}
#: X_UP is right -Y, up +X, in +Z: (x, y, z) becomes (-y, x, z) with Y up. For row vectors.
_X_UP = np.array([[0.0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source`` and the pictures it refers to.

    Raises InputError where it is no XML, no COLLADA, has entities, or its nodes are no tree.
    """
    content = resolver.read()
    if not content:
        raise InputError(resolver.source, "empty file; want a COLLADA document")
    pieces, archive = unpack(content, resolver)
    if resolver.source.suffix.lower() == ".kmz":
        text = "the place on the globe, in its KML, is not read"
        report.add(Kind.DROPPED, "collada-element", SourceRef(resolver.source), "", text)
    root = parse(pieces, resolver.source, resolver.limits, report)
    document = Document(resolver.source, report, resolver.limits, root, stated=resolver.stated)
    sources = Sources(document)
    textures = TextureReader(document, resolver, archive)
    nodes = NodeReader(
        document,
        GeometryReader(document, sources),
        MaterialReader(document, textures),
        LightReader(document),
        CameraReader(document),
        AnimationReader(document, sources),
        SkinReader(document, sources),
    )
    scene = _visual_scene(document)
    roots = [] if scene is None else nodes.roots(scene)
    if document.up == "X_UP" and roots:
        text = "X is up; turned so that Y is"
        document.note(Kind.REPLACED, "collada-up-axis", root, "", text)
        roots = [Node("x_up", document.ref(root), transform=_X_UP, children=roots)]
    _unused_materials(document, nodes)
    _note_unread(document)
    _note_unplaced(document)
    return LegacyScene(
        source=resolver.source,
        format="collada",
        roots=roots,
        meshes=nodes.meshes,
        materials=nodes.table,
        lights=nodes.lights.lights,
        cameras=nodes.cameras.cameras,
        skins=nodes.bent,
        up="Z" if document.up == "Z_UP" else "Y",
        unit_m=document.unit_m,
        unit_stated=document.unit_stated,
        up_stated=document.up_stated,
        generator=document.generator,
    )


def _visual_scene(document: Document) -> Element | None:
    """The scene that is shown; the first of the library where none is named."""
    root = document.root
    instance = root.path("scene", "instance_visual_scene")
    found = None if instance is None else document.resolve(instance, "url", "visual_scene")
    library = [
        scene for lib in root.all("library_visual_scenes") for scene in lib.all("visual_scene")
    ]
    if found is None and library:
        found = library[0]
        text = f"no usable scene is named; the first, {named(found, '')!r}, is read"
        document.note(Kind.ASSUMED, "scenes-other", root, "", text)
    elif len(library) > 1:
        text = f"{len(library)} visual scenes; {named(found or library[0], '')!r} is read"
        document.note(Kind.DROPPED, "scenes-other", root, "", text)
    if found is None:
        document.note(Kind.MISSING, "scene-empty", root, "", "no visual scene in the file")
    return found


def _unused_materials(document: Document, nodes: NodeReader) -> None:
    """Materials that no mesh wears stay in the table: a later one may."""
    worn = {material.source for material in nodes.table}
    for library in document.root.all("library_materials"):
        for element in library.all("material"):
            if document.ref(element) not in worn:
                nodes.material(element, {})


def _note_unplaced(document: Document) -> None:
    """What the libraries hold and nothing in the file names; only what is named is read."""
    used = {
        address.rpartition("#")[2]
        for element in document.root.walk()
        for address in (element.get("url"), element.get("source"))
    }
    for tag, library in _INSTANCED.items():
        things = [thing for lib in document.root.all(library) for thing in lib.all(tag)]
        lost = [thing for thing in things if thing.get("id") not in used]
        if lost:
            names = ", ".join(named(thing, "no name")[:60] for thing in lost[:3])
            more = ", ..." if len(lost) > 3 else ""
            text = f"{library}: {len(lost)} of {len(things)} stand nowhere: {names}{more}; not read"
            document.note(Kind.DROPPED, "unplaced", lost[0], "", text)


def _note_unread(document: Document) -> None:
    """Libraries without a reader, and extras, by exporter and by what they belong to."""
    for child in document.root.children:
        if child.tag not in _READ:
            text = f"{child.tag[:60]} is not read"
            document.note(Kind.DROPPED, "collada-element", child, "", text)
    profiles: Counter[tuple[str, str]] = Counter()
    first: dict[tuple[str, str], Element] = {}
    for element in document.root.walk():
        for extra in element.all("extra"):
            for technique in extra.all("technique"):
                key = technique.get("profile")[:60], element.tag[:60]
                profiles[key] += 1
                first.setdefault(key, technique)
    for (profile, tag), count in profiles.items():
        text = (
            f"extra of {profile or 'no profile'} on {count} {tag}: short values are kept where "
            "the thing has room for them, the rest is dropped"
        )
        document.note(Kind.DROPPED, "collada-extra", first[profile, tag], "", text)
