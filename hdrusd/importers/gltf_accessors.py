"""Buffers, buffer views and accessors of glTF: declared sizes to arrays, bounds first.

glTF 2.0 specification, sections 3.6.1 (buffers, views) and 3.6.2 (accessors, sparse
accessors), 3.11 for normalized integers. An accessor becomes a NumPy view onto the bytes
of the file only after Python integers have shown that it lies inside them, so a huge
count costs nothing.
"""

from __future__ import annotations

import binascii
from collections.abc import Collection
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
import numpy.typing as npt

from hdrusd.importers.gltf_document import Document, Item, one_line
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import Floats
from hdrusd.report import Kind

#: componentType to dtype, and type to the numbers an element.
COMPONENTS = {
    number: np.dtype(name)
    for number, name in zip(
        (5120, 5121, 5122, 5123, 5125, 5126), ("i1", "u1", "<i2", "<u2", "<u4", "<f4"), strict=True
    )
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

#: A sparse accessor may start from zeros that no byte of the file backs; more is refused.
_ZERO_BASE_BYTES = 64 << 20

Elements = npt.NDArray[Any]


class Accessors:
    """All buffers of a document, and arrays made from them.

    Buffers are loaded at once: a missing one leaves nothing worth having, so it is an
    InputError. Those of the numbers ``unread`` are left empty.
    """

    def __init__(
        self, document: Document, resolver: Resolver, unread: Collection[int] = ()
    ) -> None:
        self._document = document
        self._items = document.table("accessors")
        self._views = document.table("bufferViews")
        self._floats: dict[int, Floats] = {}
        self._supplied: dict[int, memoryview | str] = {}
        files: dict[Path, memoryview] = {}
        self._buffers = [
            memoryview(b"") if position in unread else self._buffer(position, item, resolver, files)
            for position, item in enumerate(document.table("buffers"))
        ]
        #: Bytes of all buffers together: what distinct views into them can at most add up to.
        self.size = sum(len(buffer) for buffer in self._buffers)

    def floats(self, index: int, *widths: int) -> Floats:
        """(count, n) float32 with n among ``widths``; normalized integers become -1 to 1.

        Raises InputError when the accessor is broken or reaches past its bytes.
        """
        values = self._floats.get(index)
        if values is None:
            values = self._floats[index] = self._to_floats(index)
        if values.shape[1] not in widths:
            item = self._items[index]
            wanted = " or ".join(str(width) for width in widths)
            raise item.error(f"{values.shape[1]} numbers an element; want {wanted}")
        return values

    def integers(self, index: int) -> Elements:
        """(count,) unsigned integers. Raises InputError."""
        item = self._items[index]
        values = self._elements(item)
        if values.dtype.kind != "u" or values.shape[1] != 1:
            raise item.error("not unsigned SCALAR; want that for indices")
        return np.ascontiguousarray(values[:, 0])

    def view(self, index: int) -> memoryview:
        """The bytes of a buffer view, as many as are there. Raises InputError."""
        item = self._views[index]
        supplied = self._supplied.get(index)
        if supplied is None:
            return self.part(item)
        if isinstance(supplied, str):
            raise item.error(supplied)
        return supplied

    def supply(self, index: int, content: memoryview | str) -> None:
        """Let a buffer view have decompressed bytes, or say what is wrong with it."""
        self._supplied[index] = content

    def part(self, item: Item) -> memoryview:
        """The bytes that an object's buffer, byteOffset and byteLength name. Raises InputError."""
        buffer_index = item.index("buffer", "buffers")
        length = item.integer("byteLength")
        if buffer_index is None or length is None:
            raise item.error("no usable buffer and byteLength")
        buffer = self._buffers[buffer_index]
        start = item.integer("byteOffset") or 0
        if start + length > len(buffer):
            text = f"{length} bytes from {start} of a buffer of {len(buffer)}; cut there"
            item.note(Kind.INVALID, "buffer-view-size", text)
        return buffer[start : start + length]

    def _buffer(
        self, position: int, item: Item, resolver: Resolver, files: dict[Path, memoryview]
    ) -> memoryview:
        declared = item.integer("byteLength")
        uri = item.text("uri")
        if uri.startswith("data:"):
            content = memoryview(data_uri(item, uri))
        elif uri:
            path = resolver.find(unquote(uri), item.ref, thing=item.name)
            if path is None:
                raise item.error(f"buffer {one_line(uri)}: not found or outside the declared roots")
            if path not in files:
                files[path] = resolver.read_view(path)
            content = files[path]
        elif position == 0 and self._document.binary is not None:
            content = self._document.binary
        else:
            raise item.error("buffer without uri and without a GLB chunk; want its bytes")
        if declared is None:
            return content
        if declared > len(content):
            text = f"byteLength {declared}, but there are {len(content)} bytes; those are used"
            item.note(Kind.INVALID, "buffer-size", text)
        return content[:declared]

    def _to_floats(self, index: int) -> Floats:
        item = self._items[index]
        values = self._elements(item)
        if values.dtype.kind == "f":
            whole = values.flags.c_contiguous and values.flags.aligned
            usual = whole and values.dtype == np.float32  # in this machine's order of bytes
            return values if usual else np.require(values, np.float32, ["C", "A"])
        floats = values.astype(np.float32, order="C")
        if item.flag("normalized"):
            floats /= np.float32(np.iinfo(values.dtype).max)
            np.maximum(floats, np.float32(-1.0), out=floats)
        return floats

    def _elements(self, item: Item) -> Elements:
        width = WIDTHS.get(item.text("type"))
        dtype = COMPONENTS.get(item.integer("componentType") or 0)
        count = item.integer("count")
        if width is None or dtype is None or not count:
            raise item.error("want SCALAR, VEC2 to VEC4 or MAT4, a known componentType, a count")
        if "bufferView" in item:
            values = self._strided(item, count, width, dtype)
        elif "sparse" not in item:
            raise item.error("neither bufferView nor sparse: there are no data")
        elif count * width * dtype.itemsize > _ZERO_BASE_BYTES:
            raise item.error(f"{count} elements of zeros without bytes of their own")
        else:
            values = np.zeros((count, width), dtype)
        return self._substituted(item, values) if "sparse" in item else values

    def _strided(self, item: Item, count: int, width: int, dtype: np.dtype[Any]) -> Elements:
        index = item.index("bufferView", "bufferViews")
        if index is None:
            raise item.error("no usable bufferView")
        view = self.view(index)
        element = width * dtype.itemsize
        view_item = self._views[index]
        stride = element
        if "byteStride" in view_item:
            stride = view_item.integer("byteStride") or 0
        if stride < element:
            raise item.error(f"byteStride {stride}; an element takes {element} bytes")
        start = item.integer("byteOffset") or 0
        end = start + (count - 1) * stride + element
        if end > len(view):
            raise item.error(f"{count} elements reach to byte {end}; the view has {len(view)}")
        if stride == element:
            return np.ndarray((count, width), dtype, view, start)
        return np.ndarray((count, width), dtype, view, start, (stride, dtype.itemsize))

    def _substituted(self, item: Item, base: Elements) -> Elements:
        sparse = item.child("sparse")
        count = sparse.integer("count")
        where, what = sparse.child("indices"), sparse.child("values")
        dtype = COMPONENTS.get(where.integer("componentType") or 0)
        if not count or dtype is None or dtype.kind != "u":
            raise sparse.error("want a count and unsigned indices")
        places = self._strided(where, count, 1, dtype)[:, 0]
        if int(places.max()) >= len(base):
            raise where.error(f"index {places.max()}; the accessor has {len(base)} elements")
        values = base.copy()
        values[places] = self._strided(what, count, base.shape[1], base.dtype)
        return values


def data_uri(item: Item, uri: str) -> bytes:
    """The content of a ``data:`` URI (RFC 2397), base64 or percent-encoded. Raises InputError."""
    head, comma, body = uri.partition(",")
    if not comma:
        raise item.error("data URI without a comma")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        packed = unquote_to_bytes(body) if "%" in body else body.encode("ascii")
        packed = packed.translate(None, b" \t\r\n")
        padding = b"=" * (-len(packed) % 4)  # some writers leave it out
        return binascii.a2b_base64(packed + padding, strict_mode=True)
    except (binascii.Error, UnicodeEncodeError) as error:
        raise item.error(f"data URI: {error}; want base64") from error
