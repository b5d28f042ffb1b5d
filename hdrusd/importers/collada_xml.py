"""The XML of a COLLADA file as a plain tree, by expat and under limits.

No entity is ever declared or fetched, so there is nothing to expand; elements, depth and text
are what the file has. Names are without their namespace: 1.4 and 1.5 differ in it and exporters
leave it out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits
from hdrusd.report import Kind, Report

#: Elements for each node that the limits allow: a node with its transforms and instances.
_ELEMENTS_A_NODE = 4
#: Levels for each level of nodes, as animations and extras nest too.
_LEVELS_A_NODE = 4
_NO_ATTRIBUTES: Mapping[str, str] = {}


@dataclass(slots=True, eq=False)
class Element:
    """An element: its name, attributes, children in order, own text and line."""

    tag: str
    attributes: Mapping[str, str]
    line: int
    children: tuple[Element, ...] | list[Element] = ()
    text: str = ""

    def get(self, key: str) -> str:
        """An attribute, or nothing."""
        return self.attributes.get(key, "")

    def child(self, *tags: str) -> Element | None:
        """The first child of one of these names."""
        return next((child for child in self.children if child.tag in tags), None)

    def all(self, *tags: str) -> Iterator[Element]:
        """The children of these names, in order."""
        return (child for child in self.children if child.tag in tags)

    def path(self, *tags: str) -> Element | None:
        """The first child of the first child ... of these names."""
        found: Element | None = self
        for tag in tags:
            found = found.child(tag) if found is not None else None
        return found

    def words(self, tag: str) -> str:
        """The text of a child, trimmed; nothing without one."""
        found = self.child(tag)
        return "" if found is None else found.text.strip()

    def walk(self) -> Iterator[Element]:
        """Itself and all elements below, in the file's order, without recursion."""
        pending = [self]
        while pending:
            element = pending.pop()
            yield element
            pending.extend(reversed(element.children))


class _Builder:
    """The handlers of one parse."""

    def __init__(self, file: Path, limits: Limits, encoding: str | None) -> None:
        self.root: Element | None = None
        self._file = file
        self._elements = limits.nodes * _ELEMENTS_A_NODE
        self._depth = limits.depth * _LEVELS_A_NODE
        self._open: list[Element] = []
        self._texts: list[list[str]] = []
        self.parser = expat.ParserCreate(encoding)
        self.parser.buffer_text = True
        self.parser.buffer_size = 1 << 20
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._data
        self.parser.EntityDeclHandler = self._entity
        self.parser.SkippedEntityHandler = self._skipped

    def error(self, problem: str) -> InputError:
        return InputError(SourceRef(self._file, self.parser.CurrentLineNumber), problem)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._elements -= 1
        if self._elements < 0:
            raise self.error("more XML elements than the limits allow")
        if len(self._open) >= self._depth:
            raise self.error(f"XML nested deeper than {self._depth} elements")
        element = Element(
            tag.rpartition(":")[2], attributes or _NO_ATTRIBUTES, self.parser.CurrentLineNumber
        )
        if self._open:
            above = self._open[-1]
            if isinstance(above.children, list):
                above.children.append(element)
            else:
                above.children = [element]
        elif element.tag != "COLLADA":
            raise self.error(f"the XML is a {element.tag[:40]!r}; want COLLADA")
        else:
            self.root = element
        self._open.append(element)
        self._texts.append([])

    def _data(self, text: str) -> None:
        parts = self._texts[-1]
        if parts or not text.isspace():
            parts.append(text)

    def _end(self, _tag: str) -> None:
        self._open.pop().text = "".join(self._texts.pop())

    def _entity(self, name: str, *_rest: object) -> None:
        raise self.error(f"declares the XML entity {name[:40]!r}; files with entities are refused")

    def _skipped(self, name: str, *_rest: object) -> None:
        raise self.error(f"uses the XML entity {name[:40]!r}, which is not declared")


def parse(chunks: Iterable[bytes], file: Path, limits: Limits, report: Report) -> Element:
    """The root of a COLLADA document that comes in pieces.

    Text that is not UTF-8 where it says so is read as Latin-1, with a finding. Raises
    InputError with the line for what is no XML, no COLLADA, has entities or passes the limits.
    """
    pieces = list(chunks)
    builder = _Builder(file, limits, None)
    try:
        return _parsed(builder, pieces)
    except expat.ExpatError as error:
        if _is_utf8(pieces) or not error.lineno:
            raise _not_xml(file, error) from error
        first = error
    builder = _Builder(file, limits, "iso-8859-1")
    try:
        root = _parsed(builder, pieces)
    except expat.ExpatError as error:
        raise _not_xml(file, error) from error
    text = "not UTF-8, as it says; read as Latin-1"
    report.add(Kind.ASSUMED, "encoding", SourceRef(file, first.lineno), "", text)
    return root


def _parsed(builder: _Builder, pieces: list[bytes]) -> Element:
    try:
        for piece in pieces:
            builder.parser.Parse(piece, False)
        builder.parser.Parse(b"", True)
    except (ValueError, LookupError, UnicodeError) as error:  # an encoding Python has not
        raise builder.error(f"not XML that can be read: {error}") from error
    assert builder.root is not None  # expat has told of a file without an element
    return builder.root


def _not_xml(file: Path, error: expat.ExpatError) -> InputError:
    problem = f"not XML: {expat.ErrorString(error.code)}, column {error.offset + 1}"
    return InputError(SourceRef(file, error.lineno), problem)


def _is_utf8(pieces: list[bytes]) -> bool:
    try:
        b"".join(pieces).decode()
    except UnicodeDecodeError:
        return False
    return True
