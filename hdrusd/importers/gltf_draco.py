"""Primitives of glTF whose vertices and triangles Draco has compressed.

KHR_draco_mesh_compression: the attributes of a primitive that the extension names, and its
indices, are those of a Draco mesh, and their accessors say what the numbers mean. Such a
primitive is replaced by one whose accessors stand on views of what was decompressed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.exchange_checks import BrokenSceneError
from hdrusd.importers.gltf_accessors import COMPONENTS, WIDTHS, Accessors
from hdrusd.importers.gltf_document import Document, Item
from hdrusd.importers.unpacking import Answer, Unpacker
from hdrusd.importers.unpacking_worker import Array
from hdrusd.report import Kind

NAME = "KHR_draco_mesh_compression"

#: Modes of a primitive that may be compressed; decompressed it is triangles.
_TRIANGLES, _STRIP = 4, 5
_UNSIGNED_INT = 5125
#: What an accessor says of bytes that are not those of the Draco mesh.
_OF_BYTES = {"bufferView", "byteOffset", "sparse"}


def compressed_primitives(mesh: Item) -> Iterator[tuple[int, Item, Item]]:
    """The number of each compressed primitive of a mesh, it and the extension's object."""
    for number, primitive in enumerate(mesh.children("primitives")):
        extension = primitive.extension(NAME)
        if extension is not None:
            yield number, primitive, extension


def has_fallback(document: Document) -> bool:
    """Whether the accessors of every compressed primitive have bytes of their own."""
    table = document.table("accessors")
    for mesh in document.table("meshes"):
        for _, item, _ in compressed_primitives(mesh):
            numbers = [*item.child("attributes").data.values(), item.data.get("indices")]
            used = (table[n] for n in numbers if type(n) is int and 0 <= n < len(table))
            if not all("bufferView" in accessor or "sparse" in accessor for accessor in used):
                return False
    return True


@dataclass(slots=True)
class _Primitive:
    mesh: int
    number: int
    item: Item
    extension: Item
    accessors: dict[str, Item]  # by attribute, in the order of the question
    asked: int | str  # the piece, or what is wrong


class DracoPrimitives:
    """Asks for every compressed primitive, and replaces it with what comes of it."""

    def __init__(self, document: Document, accessors: Accessors, unpacker: Unpacker) -> None:
        self._document = document
        self._accessors = accessors
        self._unpacker = unpacker
        # What many primitives share is made once: by where it lies and what becomes of it.
        self._contents: dict[tuple[int, str, int], memoryview | str] = {}
        self._found = [
            self._ask(number, position, item, extension)
            for number, mesh in enumerate(document.table("meshes"))
            for position, item, extension in compressed_primitives(mesh)
            if item.data.get("mode", _TRIANGLES) in (_TRIANGLES, _STRIP)
        ]

    def _ask(self, mesh: int, number: int, item: Item, extension: Item) -> _Primitive:
        table = self._document.table("accessors")
        attributes, ids = item.child("attributes"), extension.child("attributes")
        found = _Primitive(mesh, number, item, extension, {}, "no usable bufferView")
        wanted = []
        for name in ids.data:
            identity, accessor = ids.integer(name), attributes.index(name, "accessors")
            if identity is not None and accessor is not None:
                found.accessors[name] = table[accessor]
                wanted.append((identity, table[accessor].flag("normalized")))
        view = extension.index("bufferView", "bufferViews")
        if view is not None:
            try:
                packed = self._accessors.view(view)
            except InputError as error:
                found.asked = error.problem
            else:
                found.asked = self._unpacker.ask("draco", packed, attributes=wanted)
        return found

    def take(self, answers: Sequence[Answer]) -> None:
        """Replace the primitives. Raises BrokenSceneError where an answer has no such arrays."""
        meshes = self._document.table("meshes")
        primitives: dict[int, list[Any]] = {}
        for found in self._found:
            answer = found.asked if isinstance(found.asked, str) else answers[found.asked]
            if found.mesh not in primitives:
                primitives[found.mesh] = list(meshes[found.mesh].data["primitives"])
            primitives[found.mesh][found.number] = self._decompressed(found, answer)
        for number, entries in primitives.items():
            mesh = meshes[number]
            data = {**mesh.data, "primitives": entries}
            meshes[number] = Item(self._document, mesh.place, data)

    def _decompressed(self, found: _Primitive, answer: Answer) -> dict[str, Any]:
        """The primitive, with accessors of its own."""
        attributes = dict(found.item.child("attributes").data)
        if isinstance(answer, str):
            faces: Array | str = answer
            rows: list[Array | str] = [answer] * len(found.accessors)
        else:
            faces, *rows = ("Draco has no such attribute" if a is None else a for a in answer)
            if len(rows) != len(found.accessors) or not _is_rows(faces, 3):
                raise BrokenSceneError("a mesh without triangles")
        for (name, accessor), array in zip(found.accessors.items(), rows, strict=True):
            attributes[name] = self._accessor(found, accessor, array)
        whole = {"componentType": _UNSIGNED_INT, "type": "SCALAR"}
        indices = Item(self._document, found.item.place, whole)
        if not isinstance(faces, str):
            faces = faces.reshape(-1, 1)
            self._check_indices(found.item, len(faces))
        data = {**found.item.data, "mode": _TRIANGLES, "attributes": attributes}
        return data | {"indices": self._accessor(found, indices, faces)}

    def _check_indices(self, item: Item, count: int) -> None:
        """Of a strip the accessor counts something else."""
        index = item.index("indices", "accessors")
        if index is not None and item.data.get("mode", _TRIANGLES) == _TRIANGLES:
            self._check_count(self._document.table("accessors")[index], count)

    def _check_count(self, accessor: Item, count: int) -> None:
        declared = accessor.integer("count")
        if declared is not None and declared != count:
            text = f"count {declared}, but Draco has {count} elements; those are used"
            accessor.note(Kind.INVALID, "draco-count", text)

    def _accessor(self, found: _Primitive, accessor: Item, array: Array | str) -> int:
        """The number of a new accessor, like ``accessor``, of what was decompressed."""
        views, accessors = (self._document.table(n) for n in ("bufferViews", "accessors"))
        data = {k: v for k, v in accessor.data.items() if k not in _OF_BYTES}
        data["bufferView"] = len(views)
        content: memoryview | str
        if isinstance(array, str):
            content = array
        else:
            if not _is_rows(array):
                raise BrokenSceneError("an attribute without rows")
            if "count" in data:
                self._check_count(accessor, len(array))
            data["count"] = len(array)
            content = self._content(accessor, array)
        self._accessors.supply(len(views), content)
        views.append(Item(self._document, found.extension.place, {}))
        accessors.append(Item(self._document, accessor.place, data))
        return len(accessors) - 1

    def _content(self, accessor: Item, array: Array) -> memoryview | str:
        """The bytes of numbers as the accessor declares them, or what is wrong with that."""
        place = array.__array_interface__["data"][0]
        key = place, accessor.text("type"), accessor.integer("componentType") or 0
        if key not in self._contents:
            self._contents[key] = _as_declared(array, *key[1:])
        return self._contents[key]


def _is_rows(array: Array | str | None, width: int | None = None) -> bool:
    return isinstance(array, np.ndarray) and array.ndim == 2 and width in (None, array.shape[1])


def _as_declared(array: Array, kind: str, component: int) -> memoryview | str:
    width, dtype = WIDTHS.get(kind), COMPONENTS.get(component)
    if width != array.shape[1] or dtype is None:
        return f"Draco has {array.shape[1]} numbers an element; want those of an accessor"
    with np.errstate(invalid="ignore"):  # a number that is none
        numbers = array.astype(dtype, order="C", copy=False)
    if array.dtype != numbers.dtype and not np.array_equal(numbers, array):
        return f"{array.dtype} numbers of Draco that do not fit the accessor's {numbers.dtype}"
    return numbers.reshape(-1).view(np.uint8).data
