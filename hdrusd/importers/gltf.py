"""glTF 2.0 and GLB to a LegacyScene (ISO/IEC 12113:2022 and the extensions named below)."""

from __future__ import annotations

from hdrusd.importers.gltf_animations import read_animations
from hdrusd.importers.gltf_cameras import read_cameras
from hdrusd.importers.gltf_compression import LIBRARIES, read_buffers
from hdrusd.importers.gltf_document import Document, load, one_line
from hdrusd.importers.gltf_images import Textures
from hdrusd.importers.gltf_lights import EXTENSION, read_lights
from hdrusd.importers.gltf_materials import default_material, read_materials
from hdrusd.importers.gltf_meshes import MeshReader
from hdrusd.importers.gltf_nodes import NodeReader
from hdrusd.importers.gltf_skins import SkinReader
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Kind, Report

#: Extensions that are read, beside those of compressed meshes, which need a library.
#: KHR_texture_basisu is, in that each such image is a finding.
EXTENSIONS = frozenset(
    {
        EXTENSION,
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_specular",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
        "KHR_texture_basisu",
        "KHR_texture_transform",
        "EXT_texture_webp",
    }
)


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``, a .gltf or .glb file, and the files it refers to.

    One glTF mesh becomes one entry of ``meshes`` per primitive of triangles; nodes share
    them. Metres, +Y up, lights in candela or lux, emission in cd/m2.

    Raises InputError where the container, the JSON, a buffer, the node tree or a required
    extension cannot be used, or where nothing that can be shown is left.
    """
    document = load(resolver, report)
    _check_extensions(document)
    accessors = read_buffers(document, resolver)
    materials = read_materials(document, Textures(document, accessors, resolver))
    lights, light_numbers = read_lights(document)
    skins = SkinReader(document, accessors)
    meshes = MeshReader(document, accessors, materials, skins)
    if any(mesh.material == meshes.default_material for mesh in meshes.meshes):
        materials.append(default_material(document))
    animations = read_animations(document, accessors)
    nodes = NodeReader(document, meshes.by_mesh, light_numbers, animations)
    roots = nodes.roots()
    scene = LegacyScene(
        source=resolver.source,
        format="gltf",
        roots=roots,
        meshes=meshes.meshes,
        materials=materials,
        lights=lights,
        cameras=read_cameras(document),
        skins=skins.finish(nodes.made, meshes.by_mesh),
        generator=document.root.child("asset").text("generator"),
    )
    if not (scene.meshes or scene.lights or scene.cameras):
        if meshes.errors:
            raise meshes.errors[0]
        text = "no mesh, light or camera in the file"
        document.root.note(Kind.MISSING, "scene-empty", text)
    return scene


def _check_extensions(document: Document) -> None:
    for name in document.extensions("extensionsRequired"):
        if name not in EXTENSIONS | LIBRARIES.keys():
            raise document.root.error(f"requires the extension {one_line(name)}, which is not read")
    for name in document.extensions("extensionsUsed"):
        if name not in EXTENSIONS | LIBRARIES.keys():
            text = f"extension {one_line(name)} is not read"
            document.root.note(Kind.DROPPED, "extension-unknown", text)
