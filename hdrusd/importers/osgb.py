"""Reader for OpenSceneGraph's binary files, ``.osgb``.

What a binary file says is made into the tree of the text form. A file that
has parts which only another program knows, and no block sizes to pass over them, is given to
osgconv.

Sources: OpenSceneGraph 3.6, src/osgDB/InputStream.cpp (start, decompress), Compressors.cpp.
"""

from __future__ import annotations

import shutil
import struct
import zlib

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers import osgconv
from hdrusd.importers.importer import Resolver
from hdrusd.importers.osg_binary import UnknownPartError, fill
from hdrusd.importers.osg_bytes import Layout
from hdrusd.importers.osg_text import Document
from hdrusd.report import Kind, Report

_HEAD = 20  # two magic numbers, what the file holds, version, attributes
_DOMAINS, _SCHEMA, _SIZES = 1, 2, 4  # attributes
_SCENE = 1
_PIECE = 1 << 18
#: A file may unpack to this many bytes without being asked why.
_FREE = 64 << 20
#: And beyond that to this many times its own size.
_RATIO = 200


def load(resolver: Resolver, report: Report) -> Document:
    """The tree of ``resolver.source``. Raises InputError when nothing can be used."""
    source = resolver.source
    data = resolver.read()
    osgconv.check_head(data, ".osgb", source)
    document = Document(source, report, new=True, binary=True)
    try:
        head = _Head(data, resolver)
        document.generator = f"OpenSceneGraph, file version {head.layout.version}"
        fill(document, head.data, head.at, head.layout, resolver.limits)
    except UnknownPartError as problem:
        if shutil.which("osgconv") is None:
            text = f"{problem}; osgconv may know it; install the package openscenegraph"
            raise InputError(SourceRef(source, f"byte {problem.at}"), text) from problem
        place = SourceRef(source, f"byte {problem.at}")
        report.add(Kind.ASSUMED, "osgb-osgconv", place, "", f"{problem}; read by osgconv")
        return osgconv.load(resolver, report)
    return document


class _Head:
    """The head of a file; then ``data`` from ``at`` on are its objects, unpacked."""

    def __init__(self, data: bytes, resolver: Resolver) -> None:
        self.data = data
        self.at = _HEAD
        self.source = resolver.source
        self.order = "<" if data.startswith(b"\xa1\x0e") else ">"
        if len(data) < _HEAD:
            raise self._error(f"{len(data)} bytes; want a head of {_HEAD}")
        holds, version, attributes = struct.unpack_from(f"{self.order}3I", data, 8)
        if holds != _SCENE:
            raise self._error(f"holds {holds}; want 1, a scene")
        if attributes & _DOMAINS:  # versions of other people's classes
            for _ in range(self._number()):
                self._text()
                self._number()
        compressor = self._text()
        if compressor == "zlib":
            self.data, self.at = self._unpacked(resolver.limits.file_bytes), 0
        elif compressor == "null":
            self._number()
        elif compressor != "0":
            raise UnknownPartError(self.at, f"compressed by {compressor}; want zlib or none")
        schema = _schema(self._text()) if attributes & _SCHEMA else {}
        self.layout = Layout(version, self.order, bool(attributes & _SIZES), schema)

    def _error(self, problem: str) -> InputError:
        return InputError(SourceRef(self.source, f"byte {self.at}"), problem)

    def _number(self) -> int:
        if self.at + 4 > len(self.data):
            raise self._error("ends inside its head; want the whole file")
        self.at += 4
        return int(struct.unpack_from(f"{self.order}I", self.data, self.at - 4)[0])

    def _text(self) -> str:
        count = self._number()
        if self.at + count > len(self.data):
            raise self._error(f"text of {count} bytes; {len(self.data) - self.at} are left")
        self.at += count
        return self.data[self.at - count : self.at].decode("latin-1")

    def _unpacked(self, most: int) -> bytes:
        """What zlib or gzip packed, piece by piece. Raises InputError past the budget."""
        packed = memoryview(self.data)[self.at :]
        budget = min(max(_FREE, _RATIO * len(packed)), most)
        unpacked = bytearray()
        unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 32)
        try:
            for begin in range(0, len(packed), _PIECE):
                piece: bytes | memoryview = packed[begin : begin + _PIECE]
                full = True
                while (full or piece) and not unpacker.eof:
                    made = unpacker.decompress(piece, _PIECE)
                    piece, full = unpacker.unconsumed_tail, len(made) == _PIECE
                    unpacked += made
                    if len(unpacked) > budget:
                        raise self._error(f"unpacks to more than {budget} bytes")
        except zlib.error as problem:
            raise self._error(f"its packed part is damaged: {problem}") from problem
        if not unpacker.eof:
            raise self._error("its packed part is cut; want the whole file")
        return bytes(unpacked)


def _schema(text: str) -> dict[str, list[str]]:
    """``osg::Node=InitialBound:1 UpdateCallback:2``, a line for each class."""
    found = {}
    for line in text.split("\n"):
        label, equals, fields = line.partition("=")
        if equals and not label.startswith("#"):
            found[label.strip()] = [field.partition(":")[0] for field in fields.split()]
    return found
