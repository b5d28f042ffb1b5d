"""FBX to a LegacyScene, inside the worker: nothing here may be imported by hdrusd itself.

ufbx 0.0.5 reads FBX 5.0 to 7.7, binary and text. See ``fbx_held`` for its discipline.
"""

from __future__ import annotations

from hdrusd.importers.fbx_document import Document, open_document
from hdrusd.importers.fbx_materials import read_materials
from hdrusd.importers.fbx_nodes import NodeReader, note_unplaced, note_unread, wearers
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import RGB, LegacyScene
from hdrusd.report import Kind, Report

#: Tables of ufbx's scene without a reader.
_UNREAD = {
    "line_curves": "curves of lines",
    "nurbs_curves": "NURBS curves",
    "nurbs_surfaces": "NURBS surfaces",
    "nurbs_trim_surfaces": "trimmed NURBS surfaces",
    "procedural_geometries": "procedural geometries",
    "stereo_cameras": "stereo cameras",
    "camera_switchers": "camera switchers",
    "constraints": "constraints, which are not solved",
    "characters": "characters",
    "audio_clips": "sounds",
}


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``. Raises InputError where ufbx refuses it."""
    document = open_document(resolver, report)
    materials = read_materials(document, wearers(document))
    nodes = NodeReader(document, [material.two_sided for material in materials])
    note_unread(document, _UNREAD)
    note_unplaced(document)
    scene = LegacyScene(
        source=resolver.source,
        format="fbx",
        roots=nodes.roots,
        meshes=nodes.meshes.meshes,
        materials=materials,
        lights=nodes.lights,
        cameras=nodes.cameras,
        skins=nodes.skins,
        up=document.up,
        unit_m=document.unit_m,
        unit_stated=document.unit_stated,
        up_stated=document.up_stated,
        ambient=_ambient(document),
        generator=document.application(),
    )
    if not (scene.meshes or scene.lights or scene.cameras):
        text = "no mesh, light or camera in the file"
        document.note(Kind.MISSING, "scene-empty", document.ref(), "", text)
    return scene


def _ambient(document: Document) -> RGB | None:
    """The ambient light of the scene; black says nothing, as every exporter writes it."""
    color = document.scene.settings.ambient_color
    red, green, blue = document.numbers(
        tuple(color), (0.0, 0.0, 0.0), document.ref("ambient light"), "its colour"
    )
    red, green, blue = max(red, 0.0), max(green, 0.0), max(blue, 0.0)
    return (red, green, blue) if red or green or blue else None
