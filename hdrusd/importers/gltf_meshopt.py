"""Buffer views of glTF that meshoptimizer has compressed.

EXT_meshopt_compression and its successor KHR_meshopt_compression, which adds a filter for colours
and a second version of the bit stream of attributes; the properties are the same, and the streams
say their version. Decompressed, a view is what any other is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.exchange_checks import BrokenSceneError
from hdrusd.importers.gltf_accessors import Accessors
from hdrusd.importers.gltf_document import Document, Item
from hdrusd.importers.unpacking import Answer, Unpacker
from hdrusd.report import Kind

NAMES = ("EXT_meshopt_compression", "KHR_meshopt_compression")

#: Mode to the strides that it may have, filters of attributes to theirs.
_MODES = {"ATTRIBUTES": range(4, 257, 4), "TRIANGLES": (2, 4), "INDICES": (2, 4)}
_FILTERS = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "EXPONENTIAL": _MODES["ATTRIBUTES"]}
_NEW_FILTERS = {"COLOR": (4, 8)}  # of the KHR extension


def compressed_views(document: Document) -> Iterator[tuple[int, str, Item]]:
    """The number of each compressed view, the extension's name and its object."""
    for number, view in enumerate(document.table("bufferViews")):
        for name in NAMES:
            extension = view.extension(name)
            if extension is not None:
                yield number, name, extension
                break


def fallback_buffers(document: Document) -> set[int]:
    """The buffers that stand in for decompressed data, which need no bytes and may have none."""
    views, buffers = document.table("bufferViews"), document.table("buffers")
    packed = {number: extension for number, _, extension in compressed_views(document)}
    unread = {number for number, buffer in enumerate(buffers) if _is_marked(buffer)}
    unread |= {_number(views[number]) for number in packed}
    read = {_number(packed.get(number, view)) for number, view in enumerate(views)}
    return {number for number in unread - read if 0 <= number < len(buffers)}


def _number(item: Item) -> int:
    number = item.data.get("buffer")
    return number if type(number) is int else -1


def has_fallback(document: Document) -> bool:
    """Whether every buffer that stands in for decompressed data has bytes."""
    binary = {0} if document.binary is not None else set()
    buffers = document.table("buffers")
    return all("uri" in buffers[n] for n in fallback_buffers(document) - binary)


def _is_marked(buffer: Item) -> bool:
    extensions = (buffer.extension(name) for name in NAMES)
    return any(extension is not None and extension.flag("fallback") for extension in extensions)


class MeshoptViews:
    """Asks for every compressed view, and gives ``accessors`` what comes of it.

    Raises InputError where all together say that they are larger than a file may be.
    """

    def __init__(self, document: Document, accessors: Accessors, unpacker: Unpacker) -> None:
        self._document = document
        self._accessors = accessors
        self._pieces: dict[int, tuple[int, int]] = {}  # of a view: the piece, the bytes
        limit, total = document.limits.file_bytes, 0
        for number, name, extension in compressed_views(document):
            try:
                question = self._question(number, name, extension)
                packed = accessors.part(extension)
            except InputError as error:
                accessors.supply(number, error.problem)
                continue
            size = question["count"] * question["stride"]
            total += size
            if total > limit:
                text = f"{total} bytes when decompressed up to here; at most {limit} are read"
                raise extension.error(text)
            self._pieces[number] = unpacker.ask("meshopt", packed, **question), size

    def _question(self, number: int, name: str, extension: Item) -> dict[str, Any]:
        count, stride = extension.integer("count"), extension.integer("byteStride")
        mode, filter = extension.text("mode"), extension.text("filter", "NONE")
        if not count or stride is None or stride not in _MODES.get(mode, ()):
            raise extension.error("want a count, a known mode and a byteStride that it may have")
        if mode == "TRIANGLES" and count % 3:
            raise extension.error(f"{count} vertex numbers are no whole triangles")
        filters = _FILTERS | _NEW_FILTERS if name == NAMES[1] else _FILTERS
        if filter != "NONE" and (mode != "ATTRIBUTES" or stride not in filters.get(filter, ())):
            raise extension.error("want a known filter of attributes and a byteStride that it has")
        view = self._document.table("bufferViews")[number]
        declared = view.integer("byteLength")
        if "byteStride" in view and view.integer("byteStride") != stride:
            raise extension.error(f"byteStride {stride}; its view has another one")
        if declared is not None and declared != count * stride:
            text = f"byteLength {declared}, but {count} elements of {stride} bytes; those are used"
            view.note(Kind.INVALID, "buffer-view-size", text)
        return {"count": count, "stride": stride, "mode": mode, "filter": filter}

    def take(self, answers: Sequence[Answer]) -> None:
        """Hand the decompressed bytes over. Raises BrokenSceneError where they are others."""
        for number, (piece, size) in self._pieces.items():
            answer = answers[piece]
            if isinstance(answer, str):
                self._accessors.supply(number, answer)
                continue
            [array] = answer
            if array is None or array.dtype != np.uint8 or array.shape != (size,):
                raise BrokenSceneError("a view of another size")
            self._accessors.supply(number, array.data)
            self._accessors.size += size
