"""The block tree of OpenSceneGraph's two text formats, ``.osgt`` and the older ``.osg``.

A statement is the words of one line and the block in braces that may follow it,
on the same line or on the next. Blocks of numbers are kept as bytes and
converted when they are asked for, all at once. Both formats name a field alike
up to case and underscores (``SpotCutoff``, ``spot_cutoff``), so fields are
looked up by such a folded name.

An object that stands in several places is written out at the first and referred
to at the others: in ``.osgt`` by a block that holds its ``UniqueID`` and nothing
else, in ``.osg`` by ``Use ID``.

Sources: OpenSceneGraph 3.6, src/osgDB/InputStream.cpp, OutputStream.cpp,
src/osgPlugins/osg/AsciiStreamOperator.h (.osgt); src/osgDB/Input.cpp,
src/osgWrappers/deprecated-dotosg (.osg).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits
from hdrusd.importers.number_text import wholes
from hdrusd.report import Kind, Report

Doubles = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int64]

#: White space, words up to the end of the line or a mark, and what is there: the end of the line,
#: a block of numbers alone, one of how a renderer buffers an array, which nothing here reads, the
#: begin of another block, its end, a string, one that is not closed.
_SEGMENT = re.compile(
    rb'(\s*+)((?:[^\s{}"][^\n{}"]*+)?+)'
    rb"(?:(\n)|\{([0-9 \n\t\r\f\veE+.\-]*+)\}"
    rb'|(?<=BufferObject TRUE )(\{[^{}"]*+\{[^{}"]*+\}[^{}"]*+\})|(\{)|(\})'
    rb'|"((?:[^"\\]++|\\.)*+)"|("))?+',
    re.DOTALL,
)
_LINE_END, _NUMBERS, _UNREAD, _OPEN, _CLOSE, _STRING, _UNCLOSED = range(3, 10)  # its groups
_DIGITS = b"0123456789 \n\t\r\f\v"
_ESCAPE = re.compile(rb"\\(.)", re.DOTALL)
_INEXACT = 1 << 53  # from here on float64 leaves out whole numbers


@dataclass(slots=True, eq=False)
class Statement:
    """The words of a line, its block if it has one, and the number of the line."""

    words: list[str]
    line: int
    block: Block | None = None

    @property
    def key(self) -> str:
        """The first word, folded; empty where a block has no name."""
        return fold(self.words[0]) if self.words else ""

    @property
    def label(self) -> str:
        """The first word as it stands, for messages."""
        return self.words[0] if self.words else "{"

    @property
    def class_name(self) -> str:
        """The first word without its library: ``osg::Group`` is a ``Group``."""
        return self.words[0].rpartition("::")[2] if self.words else ""

    @property
    def declared(self) -> int | None:
        """The last word as a count, as in ``vector 40 {``; None where it is none."""
        word = self.words[-1] if self.words else ""
        return int(word) if word.isdecimal() and len(word) < 19 else None


@dataclass(slots=True, eq=False)
class Block:
    """What stands between two braces: statements, or numbers alone.

    A binary file has its numbers as ``values`` and the bytes of a picture as ``data``.
    """

    statements: list[Statement] = field(default_factory=list)
    raw: bytes = b""
    values: npt.NDArray[np.number[Any]] | None = None
    data: memoryview | None = None
    _fields: dict[str, Statement] | None = None

    @property
    def fields(self) -> dict[str, Statement]:
        """The first statement of each folded first word."""
        if self._fields is None:
            self._fields = {
                fold(s.words[0]) if s.words else "": s for s in reversed(self.statements)
            }
        return self._fields

    def field(self, key: str) -> Statement | None:
        """The first statement whose folded first word is ``key``."""
        return self.fields.get(key)

    def numbers(self) -> Doubles:
        """All numbers, in order; NaN for a word among numbers that is none."""
        if self.values is not None:
            return self.values.astype(np.float64)
        if not self.statements:
            words = self.raw.split()
            try:
                return np.array(words, dtype=np.float64)
            except ValueError:
                return np.array([_number(word.decode()) for word in words])
        lines = [s.words for s in self.statements if s.words and _numeric(s.words[0])]
        return np.array([_number(word) for words in lines for word in words], dtype=np.float64)

    def floats(self) -> Singles | Doubles:
        """``numbers``, in 32 bits where the file has them so."""
        if self.values is not None and self.values.dtype.kind == "f" and self.values.itemsize == 4:
            return self.values.astype(np.float32, copy=False)
        return self.numbers()

    def indices(self) -> Integers:
        """``numbers`` as indices; -1, which is no index, for what is none."""
        if self.values is not None:
            if self.values.dtype.kind == "u" and self.values.itemsize < 8:
                return self.values.astype(np.int64)
        elif not self.statements and not self.raw.translate(None, _DIGITS):
            found = wholes(self.raw)
            if found is not None and found.max(initial=0) < _INEXACT:
                return found
        numbers = self.numbers()
        good = (numbers >= 0.0) & (numbers < _INEXACT)  # False for NaN
        return np.where(good, numbers, -1.0).astype(np.int64)


@lru_cache(4096)
def fold(word: str) -> str:
    """The name of a field as both formats have it: ``wrap_s`` and ``WRAP_S`` are ``wraps``."""
    return word.replace("_", "").lower()


def triple(values: tuple[float, ...]) -> tuple[float, float, float]:
    """The first three numbers: a colour or a vector."""
    return values[0], values[1], values[2]


def listed(values: tuple[float, ...]) -> str:
    """Numbers as messages show them."""
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def _numeric(word: str) -> bool:
    """Whether a word is a number; ``1.#QNAN`` and its like are what MSVC printed for NaN."""
    return "#" in word or not math.isnan(_number(word)) or word.lower().endswith("nan")


@dataclass(slots=True)
class Document:
    """A parsed file. ``new`` is True for ``.osgt`` and ``.osgb``, False for ``.osg``.

    Where ``binary``, the line of a statement is the number of its first byte.
    """

    file: Path
    report: Report
    new: bool
    binary: bool = False
    generator: str = ""
    root: Block = field(default_factory=Block)
    definitions: dict[str, Statement] = field(default_factory=dict)

    def ref(self, place: Statement) -> SourceRef:
        """Where a statement stands."""
        return SourceRef(self.file, f"byte {place.line}" if self.binary else place.line)

    def add(self, kind: Kind, code: str, place: Statement, thing: str, text: str) -> None:
        """Note a finding at a statement."""
        self.report.add(kind, code, self.ref(place), thing, text)

    def resolve(self, place: Statement) -> Statement | None:
        """The statement that defines the object at ``place``; None with a finding."""
        if not self.new and len(place.words) >= 2 and "Use" in place.words[:-1]:
            name = place.words[place.words.index("Use") + 1]
            found = self.definitions.get(name)
            if found is None:
                self.add(
                    Kind.MISSING, "osg-reference", place, name, "no object in the file has this ID"
                )
            return found
        if place.block is not None and self.new:
            identity = place.block.field("uniqueid")
            if identity is not None and len(identity.words) > 1:
                return self.definitions.get(identity.words[1], place)
        return place

    def field(self, owner: Statement, *keys: str) -> Statement | None:
        """The first field of ``owner`` under any of the folded names."""
        if owner.block is None:
            return None
        fields = owner.block.fields
        for key in keys:
            if key in fields:
                return fields[key]
        return None

    def word(self, owner: Statement, *keys: str) -> str | None:
        """The second word of a field, for names and enumerations."""
        found = self.field(owner, *keys)
        return found.words[1] if found is not None and len(found.words) > 1 else None

    def flag(self, owner: Statement, key: str) -> bool:
        """Whether a field says TRUE or a number other than 0."""
        return self.word(owner, key) not in (None, "FALSE", "0")

    def numbers(self, owner: Statement, count: int, *keys: str) -> tuple[float, ...] | None:
        """``count`` finite numbers of a field; None where left out or, with a finding, broken."""
        found = self.field(owner, *keys)
        if found is None:
            return None
        values = tuple(_number(word) for word in found.words[1 : count + 1])
        if found.block is not None and len(found.words) < 3:  # "Matrix {", never "Sector TRUE {"
            values = tuple(found.block.numbers()[:count].tolist())
        if len(values) != count or not all(map(math.isfinite, values)):
            self.add(
                Kind.INVALID,
                "osg-number",
                found,
                found.label,
                f"want {count} finite numbers; the default stands",
            )
            return None
        return values

    def number(self, owner: Statement, default: float, *keys: str) -> float:
        """One number of a field, or ``default``."""
        found = self.numbers(owner, 1, *keys)
        return default if found is None else found[0]

    def name(self, owner: Statement) -> str:
        """The Name of an object; empty where it has none."""
        return self.word(owner, "name") or ""

    def object(self, owner: Statement, key: str) -> Statement | None:
        """The object in a field: ``Light TRUE { osg::Light {...} }``, in .osg ``Light {...}``."""
        if owner.block is None:
            return None
        if self.new:
            found = owner.block.field(key)
            inner = None if found is None or found.block is None else found.block.statements
            return self.resolve(inner[0]) if inner and inner[0].block is not None else None
        return next((s for s in self.objects(owner.block) if fold(s.class_name) == key), None)

    def objects(self, block: Block | None) -> Iterator[Statement]:
        """The objects that stand in a block, references followed; fields are passed over."""
        for statement in [] if block is None else block.statements:
            if statement.block is not None or (not self.new and statement.key == "use"):
                resolved = self.resolve(statement)
                if resolved is not None:
                    yield resolved


class _Parser:
    """One pass over the bytes with an explicit stack of open blocks."""

    def __init__(self, data: bytes, document: Document, limits: Limits) -> None:
        self.data = data
        self.document = document
        self.limits = limits
        self.line = 1
        self.stack: list[tuple[Statement, Block]] = []
        self.block = document.root
        self.current: Statement | None = None  # what words on the same line are added to

    def run(self) -> None:
        """Fill the document. Raises InputError."""
        for found in _SEGMENT.finditer(self.data):
            blank, text = found.group(1, 2)
            if b"\n" in blank:
                self.line += blank.count(b"\n")
                self.current = None
            if text:
                self._words(text)
            what = found.lastindex
            if what == _LINE_END:
                self.line += 1
                self.current = None
            elif what == _CLOSE:
                self._close()
            elif what == _OPEN:
                self._open()
            elif what == _NUMBERS:
                numbers = found[_NUMBERS]
                self._owner().block = Block(raw=numbers)
                self.line += numbers.count(b"\n")
            elif what == _UNREAD:
                self._owner().block = Block()
                self.line += found[_UNREAD].count(b"\n")
            elif what == _STRING:
                self._string(found[_STRING])
            elif what == _UNCLOSED:
                raise self._error('text: not closed; want "', self.line)
        if self.stack:
            raise self._error(
                f"{self.stack[-1][0].label}: block not closed; want }}",
                self.stack[-1][0].line,
            )

    def _words(self, text: bytes) -> None:
        if self.current is None and text.startswith(b"#"):
            return
        if text.isascii():
            words = list(map(bytes.decode, text.split()))
        else:
            words = [decoded(word) for word in text.split()]
        self._append(words)
        if words[0] == "UniqueID" and len(words) == 2 and self.stack:
            self.document.definitions.setdefault(words[1], self.stack[-1][0])

    def _append(self, words: list[str]) -> None:
        if self.current is None:
            self.current = Statement(words, self.line)
            self.block.statements.append(self.current)
        else:
            self.current.words.extend(words)

    def _string(self, text: bytes) -> None:
        self._append([decoded(_ESCAPE.sub(rb"\1", text) if b"\\" in text else text)])
        self.line += text.count(b"\n")

    def _owner(self) -> Statement:
        """What the block that begins here belongs to; words behind it begin a statement."""
        owner = self.current
        if owner is None:  # a brace on a line of its own belongs to the line before
            last = self.block.statements[-1] if self.block.statements else None
            if last is not None and last.block is None:
                owner = last
            else:
                owner = Statement([], self.line)
                self.block.statements.append(owner)
        if len(owner.words) > 1:
            self._define(owner)
        self.current = None
        return owner

    def _open(self) -> None:
        owner = self._owner()
        self.stack.append((owner, self.block))
        if len(self.stack) > self.limits.depth:
            raise self._error(f"blocks deeper than {self.limits.depth}", self.line)
        owner.block = self.block = Block()

    def _define(self, owner: Statement) -> None:
        """Arrays carry their identity in the line: ``UniqueID Vec2Array_6 Vec2Array 3 {``."""
        for word in ("UniqueID", "ArrayID"):
            if word in owner.words[:-1]:
                identity = owner.words[owner.words.index(word) + 1]
                self.document.definitions.setdefault(
                    identity if word == "UniqueID" else f"ArrayID {identity}", owner
                )

    def _close(self) -> None:
        if not self.stack:
            raise self._error("}: nothing is open here", self.line)
        _, self.block = self.stack.pop()
        self.current = None

    def _error(self, problem: str, line: int) -> InputError:
        return InputError(SourceRef(self.document.file, line), problem)


def decoded(word: bytes) -> str:
    """UTF-8, or Latin-1 where it is not that: old exporters wrote the local code page."""
    try:
        return word.decode()
    except UnicodeDecodeError:
        return word.decode("latin-1")


def parse(data: bytes, file: Path, report: Report, limits: Limits) -> Document:
    """Parse a whole file.

    Raises InputError: empty, not this format, braces that do not match, blocks
    deeper than ``limits.depth``.
    """
    data = data.removeprefix(b"\xef\xbb\xbf")
    head = data[:256].lstrip()
    if not head:
        raise InputError(file, "empty; want OpenSceneGraph text")
    if head.startswith(b"version https://git-lfs"):
        raise InputError(file, "a Git LFS pointer; want the file itself (git lfs pull)")
    if b"\0" in head:
        raise InputError(file, "binary; want OpenSceneGraph text (.osgt, .osg)")
    document = Document(file, report, new=head.startswith(b"#Ascii"))
    if document.new:
        kind = head.split(maxsplit=2)[1:2]
        if kind != [b"Scene"]:
            raise InputError(SourceRef(file, 1), "#Ascii: not a Scene; want #Ascii Scene")
        generator = re.search(rb"^#Generator[ \t]+([^\r\n]*)", data[:1024], re.MULTILINE)
        document.generator = "" if generator is None else decoded(generator[1]).strip()
    _Parser(data, document, limits).run()
    return document
