"""The JSON of a glTF file: its container and typed access that believes nothing.

glTF 2.0 specification (ISO/IEC 12113:2022), sections 2.7 to 2.9 for JSON and URIs,
4 for the binary container. Every value is checked where it is read: a wrong one is a
finding and the format's default stands in for it.
"""

from __future__ import annotations

import json
import reprlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import RGB
from hdrusd.report import Kind, Report

_GLB_MAGIC = b"glTF"
_CHUNK_JSON = 0x4E4F534A
_CHUNK_BIN = 0x004E4942

#: USD and the GPU hold these numbers as float32; a larger one would become infinite there.
_LARGEST = float(np.finfo(np.float32).max)

#: Integers in extras must fit the 64 bits that USD has for them.
_EXTRAS_INTEGER = 1 << 63
_EXTRAS_ENTRIES = 64
_EXTRAS_TEXT = 1024


@dataclass(slots=True)
class Document:
    """A parsed file: ``root`` is its JSON object, ``binary`` the BIN chunk of a GLB."""

    source: Path
    report: Report
    limits: Limits
    data: Mapping[str, Any]
    binary: memoryview | None = None
    _tables: dict[str, list[Item]] = field(default_factory=dict)

    @property
    def root(self) -> Item:
        """The top-level object."""
        return Item(self, "", self.data)

    def table(self, name: str) -> list[Item]:
        """The top-level array ``name``; an entry that is no object reads as an empty one."""
        found = self._tables.get(name)
        if found is None:
            found = self._tables[name] = self.root.children(name)
        return found

    def extensions(self, key: str) -> list[str]:
        """The names in ``extensionsUsed`` or ``extensionsRequired``."""
        values = self.data.get(key, [])
        return [v for v in values if isinstance(v, str)] if isinstance(values, list) else []

    def keep_going(self, error: InputError, code: str, thing: str, consequence: str) -> None:
        """Turn an error about one thing into a finding; the rest of the file is used."""
        text = f"{error.problem}; {consequence}"
        self.report.add(Kind.INVALID, code, error.source, one_line(thing), text)


@dataclass(slots=True)
class Item:
    """A JSON object and its place in the file, such as ``/nodes/3``.

    There are many of them, and a frozen one would take three times as long to make.
    """

    document: Document
    place: str
    data: Mapping[str, Any]

    def __contains__(self, key: str) -> bool:
        return key in self.data

    @property
    def ref(self) -> SourceRef:
        """Where this object stands."""
        return SourceRef(self.document.source, self.place or "/")

    @property
    def name(self) -> str:
        """Its ``name``, or nothing."""
        value = self.data.get("name")
        return clean(value) if isinstance(value, str) else ""

    def error(self, problem: str) -> InputError:
        """An error that names this place."""
        name = one_line(self.name)
        return InputError(self.ref, f"{name}: {problem}" if name else problem)

    def note(self, kind: Kind, code: str, text: str) -> None:
        """Add a finding about this object."""
        self.document.report.add(kind, code, self.ref, one_line(self.name), text)

    def _wrong(self, key: str, wanted: str, instead: str) -> None:
        shown = reprlib.repr(self.data[key])
        self.note(Kind.INVALID, "gltf-value", f"{key} is {shown}; want {wanted}; {instead}")

    def text(self, key: str, default: str = "") -> str:
        """A string, free of lone surrogates."""
        if key not in self.data:
            return default
        value = self.data[key]
        if not isinstance(value, str):
            self._wrong(key, "a string", f"{default!r} is used")
            return default
        return clean(value)

    def flag(self, key: str) -> bool:
        """A boolean that defaults to false."""
        value = self.data.get(key, False)
        if not isinstance(value, bool):
            self._wrong(key, "true or false", "false is used")
            return False
        return value

    def finite(self, key: str) -> float | None:
        """A number that float32 holds, or None where it is missing or, with a finding, wrong."""
        if key not in self.data:
            return None
        value = _finite(self.data[key])
        if value is None:
            self._wrong(key, "a finite number", "it is not used")
        return value

    def number(
        self, key: str, default: float, *, low: float = -_LARGEST, high: float = _LARGEST
    ) -> float:
        """A finite number, clamped into ``low`` to ``high`` with a finding."""
        value = self.finite(key)
        if value is None:
            return default
        if low <= value <= high:
            return value
        clamped = min(max(value, low), high)
        text = f"{key} is {value:g}; clamped to {clamped:g}"
        self.note(Kind.CLAMPED, "gltf-range", text)
        return clamped

    def numbers(
        self,
        key: str,
        default: tuple[float, ...],
        *,
        low: float = -_LARGEST,
        high: float = _LARGEST,
    ) -> tuple[float, ...]:
        """As many finite numbers as ``default`` has, each clamped with one finding for all."""
        if key not in self.data:
            return default
        raw = self.data[key]
        values = [_finite(v) for v in raw] if isinstance(raw, list) else []
        good = [v for v in values if v is not None]
        if len(good) != len(values) or len(good) != len(default):
            self._wrong(key, f"{len(default)} finite numbers", f"{list(default)} is used")
            return default
        if low <= min(good) and max(good) <= high:
            return tuple(good)
        clamped = tuple(min(max(v, low), high) for v in good)
        self.note(Kind.CLAMPED, "gltf-range", f"{key} is {good}; clamped to {list(clamped)}")
        return clamped

    def light_colour(self, key: str, default: tuple[float, float, float]) -> RGB:
        """Linear RGB that scales emitted light.

        Above 1 it is outside the format, yet kept: clamping would lose light.
        """
        red, green, blue = self.numbers(key, default, low=0.0)
        if max(red, green, blue) > 1.0:
            text = f"{key} is {[red, green, blue]}, above 1; used as written"
            self.note(Kind.ASSUMED, "colour-above-1", text)
        return red, green, blue

    def integer(self, key: str) -> int | None:
        """A whole number of at least 0, or None where it is missing or, with a finding, wrong."""
        value = self.data.get(key)
        if type(value) is int and value >= 0:
            return value
        if key not in self.data:
            return None
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            self._wrong(key, "a whole number of at least 0", "it is not used")
            return None
        return value

    def index(self, key: str, table: str) -> int | None:
        """A number of an entry of the top-level array ``table``, or None as ``integer`` does."""
        value = self.data.get(key)
        if value is None and key not in self.data:
            return None
        size = len(self.document.table(table))
        if type(value) is int and 0 <= value < size:
            return value
        value = self.integer(key)
        if value is not None and value >= size:
            self._wrong(key, f"one of the {size} {table}", "it is not used")
            return None
        return value

    def indices(self, key: str, table: str) -> list[int]:
        """The good ones of an array of such numbers."""
        raw = self.data.get(key, [])
        if not isinstance(raw, list):
            self._wrong(key, f"an array of numbers of {table}", "it is not used")
            return []
        size = len(self.document.table(table))
        good = [v for v in raw if type(v) is int and 0 <= v < size]
        if len(good) != len(raw):
            lost = f"{len(raw) - len(good)} entries are not used"
            self._wrong(key, f"whole numbers below {size}, the count of {table}", lost)
        return good

    def child(self, key: str) -> Item:
        """The object at ``key``; a missing or, with a finding, wrong one reads as empty."""
        value = self.data.get(key, {})
        if not isinstance(value, dict):
            self._wrong(key, "an object", "it is not used")
            value = {}
        return Item(self.document, f"{self.place}/{key}", value)

    def children(self, key: str) -> list[Item]:
        """The objects of the array at ``key``; positions are kept."""
        values = self.data.get(key, [])
        if not isinstance(values, list):
            self._wrong(key, "an array of objects", "it is not used")
            values = []
        above = f"{self.place}/{key}/"
        for position, value in enumerate(values):
            if not isinstance(value, dict):
                ref = SourceRef(self.document.source, f"{above}{position}")
                text = f"{reprlib.repr(value)}; want an object; it reads as an empty one"
                self.document.report.add(Kind.INVALID, "gltf-value", ref, "", text)
        document = self.document
        return [
            Item(document, f"{above}{position}", value if isinstance(value, dict) else {})
            for position, value in enumerate(values)
        ]

    def extension(self, name: str) -> Item | None:
        """The object of an extension, or None where this object does not use it."""
        if "extensions" not in self.data:
            return None
        extensions = self.child("extensions")
        return extensions.child(name) if name in extensions else None

    def extras(self) -> dict[str, Any]:
        """The scalars of ``extras``: at most 64, texts of at most 1024 characters."""
        raw = self.data.get("extras")
        if raw is None:
            return {}
        entries = raw if isinstance(raw, dict) else {"extras": raw}
        kept: dict[str, Any] = {}
        for key, value in entries.items():
            if len(kept) < _EXTRAS_ENTRIES and len(key) <= _EXTRAS_TEXT and _is_scalar(value):
                kept[clean(key)] = clean(value) if isinstance(value, str) else value
        if lost := len(entries) - len(kept):
            text = f"{lost} of {len(entries)} extras dropped; short scalars are kept"
            self.note(Kind.DROPPED, "extras-dropped", text)
        return kept


def load(resolver: Resolver, report: Report) -> Document:
    """Parse ``resolver.source``, .gltf or .glb by its first bytes.

    Raises InputError for a broken container, for what is no JSON object, and for any
    glTF version other than 2.
    """
    source = resolver.source
    text, binary = resolver.read_view(), None
    if not text:
        raise InputError(source, "empty file; want a glTF 2.0 file")
    if text[:4] == _GLB_MAGIC:
        text, binary = _glb_chunks(text, source, report)
    try:
        data = json.loads(str(text, "utf-8").removeprefix("\ufeff"))
    except UnicodeDecodeError as error:
        raise InputError(source, f"not UTF-8 at byte {error.start}; want glTF JSON") from error
    except json.JSONDecodeError as error:
        place = SourceRef(source, error.lineno)
        raise InputError(place, f"not JSON: {error.msg}, column {error.colno}") from error
    except RecursionError as error:
        raise InputError(source, "JSON nested too deeply to be read") from error
    except ValueError as error:  # a number of thousands of digits
        raise InputError(source, f"not JSON: {error}") from error
    if not isinstance(data, dict):
        raise InputError(source, "no JSON object; want a glTF 2.0 file")
    document = Document(source, report, resolver.limits, data, binary)
    _check_version(document)
    return document


def clean(text: str) -> str:
    """``text`` with lone surrogates, which no file name and no USD string can hold, as '?'."""
    return text if text.isascii() else text.encode("utf-8", "replace").decode("utf-8")


def one_line(text: str) -> str:
    """The beginning of ``text`` for a message: no line breaks, at most 80 characters."""
    return " ".join(text[:80].split())


def _glb_chunks(
    data: memoryview, source: Path, report: Report
) -> tuple[memoryview, memoryview | None]:
    """The JSON chunk and the BIN chunk, every size held against the real one."""
    if len(data) < 20:
        raise InputError(source, f"GLB of {len(data)} bytes; its headers alone take 20")
    _, version, total = struct.unpack_from("<4sII", data)
    if version != 2:
        raise InputError(source, f"GLB version {version}; want 2")
    if total > len(data):
        raise InputError(source, f"GLB cut short: header says {total} bytes, there are {len(data)}")
    if total < len(data):
        text = f"{len(data) - total} bytes after the end that the GLB header states; not read"
        report.add(Kind.DROPPED, "glb-trailing", SourceRef(source), "", text)
    chunks: list[tuple[int, memoryview]] = []
    at = 12
    while at + 8 <= total:
        size, kind = struct.unpack_from("<II", data, at)
        at += 8
        if size > total - at:
            where = SourceRef(source, f"byte {at - 8}")
            raise InputError(where, f"GLB chunk of {size} bytes; {total - at} are left")
        chunks.append((kind, data[at : at + size]))
        at += size
        if len(chunks) == 2:  # whatever follows is of no core type
            break
    if not chunks or chunks[0][0] != _CHUNK_JSON:
        raise InputError(source, "first GLB chunk is not JSON")
    binary = chunks[1][1] if len(chunks) == 2 and chunks[1][0] == _CHUNK_BIN else None
    return chunks[0][1], binary


def _check_version(document: Document) -> None:
    asset = document.root.child("asset")
    version = asset.text("version")
    if not version.startswith("2."):
        raise asset.error(f"version {version[:20]!r}; want 2.x")
    least = asset.text("minVersion", "2.0")
    if least != "2.0":
        raise asset.error(f"minVersion {least[:20]!r}; 2.0 is read")


def _finite(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if abs(number) <= _LARGEST else None  # a NaN compares false


def _is_scalar(value: object) -> bool:
    if isinstance(value, bool):
        return True
    if isinstance(value, int):
        return -_EXTRAS_INTEGER <= value < _EXTRAS_INTEGER
    if isinstance(value, float):
        return bool(np.isfinite(value))
    return isinstance(value, str) and len(value) <= _EXTRAS_TEXT
