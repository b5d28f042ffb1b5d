"""The chunks of a 3D Studio file: bounds, names, and typed reads that believe nothing.

A chunk is a 16-bit number, a 32-bit length that counts these six bytes too, data of its
own and chunks inside. Lengths are held against the chunk around, counts against the
bytes that are there; how deep chunks nest is what the readers ask for, not what the
file says.

Source: Autodesk, 3D Studio File Toolkit for release 3, appendix "3DS Chunk Definitions".
"""

from __future__ import annotations

import math
import struct
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits
from hdrusd.importers.obj_text import shorten
from hdrusd.importers.tds_names import NAMES
from hdrusd.legacy.scene import RGB, Vec3
from hdrusd.report import Kind, Report

#: Of every file: the chunk around all others.
M3D_MAGIC = 0x4D4D

_HEADER = struct.Struct("<HI")
_COLOR_F, _COLOR_24, _LIN_COLOR_24, _LIN_COLOR_F = range(0x0010, 0x0014)
#: Colours for the screen, then those marked as linear.
COLORS = (_COLOR_F, _COLOR_24, _LIN_COLOR_F, _LIN_COLOR_24)
_INT_PERCENTAGE = 0x0030
#: A whole number of percent, and a share as a float.
PERCENTAGES = (_INT_PERCENTAGE, 0x0031)
#: A name is 10 to 64 characters by the format; what is longer than this is not one.
_LONGEST_NAME = 4096


@dataclass(frozen=True, slots=True)
class Chunk:
    """``tag`` at ``offset``; its data are the bytes from ``begin`` to before ``end``."""

    tag: int
    offset: int
    begin: int
    end: int

    @property
    def name(self) -> str:
        """As the toolkit calls it, or its number."""
        return NAMES.get(self.tag, f"0x{self.tag:04X}")


@dataclass(slots=True)
class Document:
    """The bytes of a file and where findings go. At most ``limits.nodes`` chunks are read."""

    file: Path
    data: bytes
    report: Report
    limits: Limits
    chunks: int = 0
    _latin: set[bytes] = field(default_factory=set)

    def root(self) -> Chunk:
        """The chunk around all others. Raises InputError where the file is none of 3D Studio."""
        if len(self.data) < _HEADER.size:
            raise InputError(self.file, f"{len(self.data)} bytes; want a 3D Studio file")
        tag, length = _HEADER.unpack_from(self.data)
        if tag != M3D_MAGIC:
            raise InputError(self.file, f"begins with 0x{tag:04X}; want 0x4D4D, a 3D Studio file")
        root = Chunk(tag, 0, _HEADER.size, len(self.data))
        if length > len(self.data):
            text = f"cut off: {length} bytes declared, {len(self.data)} are there"
            self.note(Kind.INVALID, "3ds-chunk-length", root, "", text)
        elif length < len(self.data):  # writers that patch it in late forget it; all is read
            text = f"{length} bytes declared of {len(self.data)}; all are read"
            self.note(Kind.ASSUMED, "3ds-length", root, "", text)
        return root

    def children(self, parent: Chunk, begin: int | None = None) -> Iterator[Chunk]:
        """The chunks inside one, from ``begin`` on. Raises InputError past the limit of chunks."""
        at = parent.begin if begin is None else begin
        while at + _HEADER.size <= parent.end:
            tag, length = _HEADER.unpack_from(self.data, at)
            stop = at + length
            chunk = Chunk(tag, at, at + _HEADER.size, min(stop, parent.end))
            if length < _HEADER.size:
                text = f"{length} bytes long; want 6 or more; the rest of {parent.name} is skipped"
                self.note(Kind.INVALID, "3ds-chunk-length", chunk, "", text)
                return
            if stop > parent.end:
                there = parent.end - at
                text = f"{length} bytes declared, {there} are there in {parent.name}; cut"
                self.note(Kind.INVALID, "3ds-chunk-length", chunk, "", text)
            self.chunks += 1
            if self.chunks > self.limits.nodes:
                raise InputError(self.ref(chunk), f"more than {self.limits.nodes} chunks")
            yield chunk
            at = chunk.end
        if at < parent.end:
            text = f"{parent.end - at} bytes behind its last chunk; skipped"
            self.note(Kind.DROPPED, "3ds-trailing", parent, "", text)

    def ref(self, chunk: Chunk) -> SourceRef:
        """Where a chunk stands: its offset in the file and its name."""
        return SourceRef(self.file, f"byte {chunk.offset}, {chunk.name}")

    def note(self, kind: Kind, code: str, chunk: Chunk, thing: str, text: str) -> None:
        """Add a finding about a chunk."""
        self.report.add(kind, code, self.ref(chunk), shorten(thing), text)

    def unread(self, chunk: Chunk, thing: str, silent: Collection[int] = ()) -> None:
        """A finding for a chunk that nobody reads, unless it is known to say nothing here."""
        if chunk.tag in silent:
            return
        size = chunk.end - chunk.begin
        if chunk.tag in NAMES:
            text = f"{chunk.name} has no home; dropped"
            self.note(Kind.DROPPED, "3ds-dropped", chunk, thing, text)
        else:
            text = f"unknown chunk of {size} bytes; dropped"
            self.note(Kind.DROPPED, "3ds-unknown", chunk, thing, text)

    # -- values ----------------------------------------------------------------------------

    def floats(
        self, chunk: Chunk, count: int, thing: str = "", at: int | None = None
    ) -> tuple[float, ...] | None:
        """``count`` finite 32-bit floats; None, with a finding, where they are not there."""
        begin = chunk.begin if at is None else at
        if begin + 4 * count <= chunk.end:
            values = struct.unpack_from(f"<{count}f", self.data, begin)
            if all(map(math.isfinite, values)):
                return values
        self._wrong(chunk, thing, f"{count} finite numbers")
        return None

    def number(self, chunk: Chunk, default: float, thing: str = "", at: int | None = None) -> float:
        """One finite float."""
        values = self.floats(chunk, 1, thing, at)
        return default if values is None else values[0]

    def triple(self, chunk: Chunk, default: Vec3, thing: str = "", at: int | None = None) -> Vec3:
        """Three finite floats."""
        values = self.floats(chunk, 3, thing, at)
        return default if values is None else (values[0], values[1], values[2])

    def word(self, chunk: Chunk, default: int, thing: str = "", at: int | None = None) -> int:
        """One unsigned 16-bit integer."""
        begin = chunk.begin if at is None else at
        if begin + 2 > chunk.end:
            self._wrong(chunk, thing, "a 16-bit number")
            return default
        (value,) = struct.unpack_from("<H", self.data, begin)
        return int(value)

    def text(self, chunk: Chunk, at: int | None = None) -> tuple[str, int]:
        """A string that a zero byte ends, and where the bytes after it begin.

        One that does not end is cut at the end of its chunk, with a finding; one that is
        not UTF-8 is read as Latin-1, with a finding for the first use.
        """
        begin = chunk.begin if at is None else min(at, chunk.end)
        zero = self.data.find(b"\0", begin, chunk.end)
        stop, after = (chunk.end, chunk.end) if zero < 0 else (zero, zero + 1)
        if zero < 0 or stop - begin > _LONGEST_NAME:
            self._wrong(chunk, "", "a name that a zero byte ends")
            stop = min(stop, begin + _LONGEST_NAME)
        raw = self.data[begin:stop]
        try:
            return raw.decode(), after
        except UnicodeDecodeError:
            found = raw.decode("latin-1")
            if raw not in self._latin:
                self._latin.add(raw)
                text = "a name that is not UTF-8: read as Latin-1"
                self.note(Kind.ASSUMED, "encoding", chunk, found, text)
            return found, after

    def color(self, chunk: Chunk, thing: str) -> RGB | None:
        """The colour in a chunk: the one for the screen, else the one marked as linear.

        Release 3 writes both; the first is what older releases and other programs show.
        """
        found: dict[int, RGB] = {}
        for child in self.children(chunk):
            if child.tag in COLORS:
                self.add_color(found, child, thing)
            else:
                self.unread(child, thing)
        color = preferred(found)
        if color is None:
            self._wrong(chunk, thing, "a colour")
        return color

    def add_color(self, found: dict[int, RGB], chunk: Chunk, thing: str) -> None:
        """Put what a chunk of ``COLORS`` itself says under its tag; the first one counts."""
        if chunk.tag in (_COLOR_F, _LIN_COLOR_F):
            values = self.floats(chunk, 3, thing)
            if values is not None:
                found.setdefault(chunk.tag, (values[0], values[1], values[2]))
        elif chunk.begin + 3 <= chunk.end:
            r, g, b = self.data[chunk.begin : chunk.begin + 3]
            found.setdefault(chunk.tag, (r / 255.0, g / 255.0, b / 255.0))
        else:
            self._wrong(chunk, thing, "three bytes")

    def share(self, chunk: Chunk, default: float, thing: str) -> float:
        """A percentage as a share, 0 to 1; what is outside is clamped, with a finding."""
        for child in self.children(chunk):
            if child.tag in PERCENTAGES:
                return self.percentage(child, default, thing)
        self._wrong(chunk, thing, "a percentage")
        return default

    def percentage(self, chunk: Chunk, default: float, thing: str) -> float:
        """The number of a chunk of ``PERCENTAGES`` itself, likewise."""
        if chunk.tag == _INT_PERCENTAGE:
            number = self.word(chunk, round(100.0 * default), thing)
            value = (number - 65536 if number > 32767 else number) / 100.0
        else:
            value = self.number(chunk, default, thing)
        if not 0.0 <= value <= 1.0:
            text = f"{100.0 * value:g} %; clamped to 0 to 100"
            self.note(Kind.CLAMPED, "3ds-percent", chunk, thing, text)
        return min(max(value, 0.0), 1.0)

    def _wrong(self, chunk: Chunk, thing: str, wanted: str) -> None:
        text = f"{chunk.end - chunk.begin} bytes; want {wanted}; the default is used"
        self.note(Kind.INVALID, "3ds-value", chunk, thing, text)


def preferred(found: Mapping[int, RGB]) -> RGB | None:
    """Of several ways to say a colour the first of ``COLORS``."""
    return next((found[tag] for tag in COLORS if tag in found), None)
