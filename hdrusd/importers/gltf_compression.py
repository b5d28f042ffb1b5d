"""Compressed meshes of glTF: which library reads them, and what there is without it.

A library reads broken data in a worker (``unpacking``); what it gives stands in the place of
what was compressed, so that no other reader of glTF knows of compression.
"""

from __future__ import annotations

from importlib.util import find_spec

from hdrusd.errors import InputError
from hdrusd.importers import gltf_draco, gltf_meshopt
from hdrusd.importers.exchange_checks import BrokenSceneError
from hdrusd.importers.gltf_accessors import Accessors
from hdrusd.importers.gltf_document import Document
from hdrusd.importers.importer import Resolver
from hdrusd.importers.unpacking import Unpacker
from hdrusd.report import Kind

#: Extension to the module that reads it and the extra that installs that.
LIBRARIES = {
    gltf_draco.NAME: ("DracoPy", "draco"),
    **dict.fromkeys(gltf_meshopt.NAMES, ("meshopt", "meshopt")),
}


def read_buffers(document: Document, resolver: Resolver) -> Accessors:
    """The accessors of a document, in which nothing is compressed any more.

    Without its library what is compressed is read from the uncompressed data beside it, with a
    finding. Raises InputError where there are none, or as Accessors does.
    """
    required = document.extensions("extensionsRequired")
    named = {*required, *document.extensions("extensionsUsed")} & LIBRARIES.keys()
    usable = {name for name in named if find_spec(LIBRARIES[name][0]) is not None}
    for name in sorted(named - usable):
        library, extra = LIBRARIES[name]
        install = f"want pip install 'hdrusd[{extra}]'"
        if name in required or not _stands_without(document, name):
            text = f"requires the extension {name}, which is not read without {library}; {install}"
            raise document.root.error(text)
        text = f"{name} is not read without {library}; what is uncompressed is used; {install}"
        document.root.note(Kind.REPLACED, "compression-fallback", text)
    if not usable:
        return Accessors(document, resolver)
    meshopt = not usable.isdisjoint(gltf_meshopt.NAMES)
    unread = gltf_meshopt.fallback_buffers(document) if meshopt else ()
    accessors = Accessors(document, resolver, unread)
    unpacker = Unpacker(resolver, accessors.size)
    requests: list[gltf_meshopt.MeshoptViews | gltf_draco.DracoPrimitives] = []
    if meshopt:
        requests.append(gltf_meshopt.MeshoptViews(document, accessors, unpacker))
    if gltf_draco.NAME in usable:
        requests.append(gltf_draco.DracoPrimitives(document, accessors, unpacker))
    answers = unpacker.answers()
    try:
        for request in requests:
            request.take(answers)
    except BrokenSceneError as error:
        text = f"the decoder answered nonsense ({error}); want a file that it can read"
        raise InputError(resolver.source, text) from error
    return accessors


def _stands_without(document: Document, name: str) -> bool:
    """Whether everything that ``name`` compresses has uncompressed data beside it."""
    if name == gltf_draco.NAME:
        return gltf_draco.has_fallback(document)
    return gltf_meshopt.has_fallback(document)
