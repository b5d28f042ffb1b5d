"""The block tree of a binary OpenSceneGraph file, ``.osgb``: that of the text form.

A file is objects inside objects: the name of the class, the number of the object, and the fields
that ``osg_layouts`` knows. Where the file states the sizes of its blocks, as it does since
OpenSceneGraph 3.2, a class or a field that is not known is passed over; where it does not, the
rest cannot be read. Objects are read by generators on a stack of our own, since how deep they
stand is the file's choice. Arrays stay views of the file; a count is compared with the bytes that
are left before anything is made of it.

Sources: OpenSceneGraph 3.6, src/osgDB/InputStream.cpp, include/osgDB/DataTypes,
src/osgPlugins/osg/BinaryStreamOperator.h.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits
from hdrusd.importers.osg_gl import GL_NAMES, value_name
from hdrusd.importers.osg_layouts import DTYPES, Element, Field, plan
from hdrusd.importers.osg_text import Block, Document, Statement, decoded
from hdrusd.report import Kind

#: What reads one object; it yields those of the objects inside, whose turn it is then.
Reader = Generator["Reader", None, None]

_ARRAY_TYPES = (
    *("ByteArray", "UByteArray", "ShortArray", "UShortArray", "IntArray", "UIntArray"),
    *("FloatArray", "DoubleArray", "Vec2bArray", "Vec3bArray", "Vec4bArray", "Vec4ubArray"),
    *("Vec2sArray", "Vec3sArray", "Vec4sArray", "Vec2fArray", "Vec3fArray", "Vec4fArray"),
    *("Vec2dArray", "Vec3dArray", "Vec4dArray", "Vec2ubArray", "Vec3ubArray", "Vec2usArray"),
    *("Vec3usArray", "Vec4usArray", "Vec2iArray", "Vec3iArray", "Vec4iArray", "Vec2uiArray"),
    *("Vec3uiArray", "Vec4uiArray"),
)
_LETTERS = {"b": "c", "ub": "C", "s": "h", "us": "H", "i": "i", "ui": "I", "f": "f", "d": "d"}
_SCALARS = {"Byte": "c", "UByte": "C", "Short": "h", "UShort": "H", "Int": "i", "UInt": "I"}
#: Primitive sets before version 112: the class, and what the block holds.
_SETS = {
    50: ("DrawArrays", None),
    51: ("DrawArrayLengths", "i"),
    52: ("DrawElementsUByte", "C"),
    53: ("DrawElementsUShort", "H"),
    54: ("DrawElementsUInt", "I"),
}
_MODES = (
    *("POINTS", "LINES", "LINE_LOOP", "LINE_STRIP", "TRIANGLES", "TRIANGLE_STRIP", "TRIANGLE_FAN"),
    *("QUADS", "QUAD_STRIP", "POLYGON"),
)
_INLINE_DATA, _INLINE_FILE = 0, 1
_OBJECTS_PER_NODE = 16  # of the limit on nodes: arrays, primitive sets, states


class UnknownPartError(Exception):
    """Something that only the program that wrote it can read; where, and what it is."""

    def __init__(self, at: int, text: str) -> None:
        self.at = at
        super().__init__(text)


class _DamagedError(Exception):
    """Bytes that make no sense."""


@dataclass(slots=True)
class Layout:
    """What the head of a file says about the rest of it."""

    version: int
    order: str  # "<" or ">", as in ``struct``
    sizes: bool  # whether blocks state their size
    schema: dict[str, list[str]] = field(default_factory=dict)


def fill(document: Document, data: bytes, start: int, layout: Layout, limits: Limits) -> None:
    """Read the objects of ``data`` from ``start`` on into the tree of ``document``.

    Raises InputError where the file is cut or damaged, UnknownPartError where it says what only
    another reader may know.
    """
    _Objects(document, data, start, layout, limits).run()


class _Objects:
    """One pass over the bytes."""

    def __init__(
        self, document: Document, data: bytes, start: int, layout: Layout, limits: Limits
    ) -> None:
        self.document = document
        self.data = data
        self.at = start
        self.end = len(data)  # of the object that is being read
        self.layout = layout
        self.limits = limits
        self.count = 0
        self._plans: dict[str, tuple[Field, ...] | None] = {}
        self._structs: dict[tuple[str, int], struct.Struct] = {}
        order = layout.order
        self._uint = struct.Struct(f"{order}I")
        # block sizes have 8 bytes since version 149
        self._size = struct.Struct(f"{order}Q" if layout.version > 148 else f"{order}I")

    def run(self) -> None:
        """Read the one object that the file is. Raises InputError, UnknownPartError."""
        stack = [self._object(self.document.root)]
        problem: Exception | None = None
        while stack:
            try:
                inner = stack[-1].throw(problem) if problem else next(stack[-1])
            except StopIteration:
                stack.pop()
                problem = None
                continue
            except (UnknownPartError, _DamagedError) as error:  # for the object around
                stack.pop()
                problem = error
                continue
            problem = None
            stack.append(inner)
            if len(stack) > self.limits.depth:
                raise self._error(f"objects deeper than {self.limits.depth}")
        if isinstance(problem, _DamagedError):
            raise self._error(str(problem))
        if problem is not None:
            raise problem

    def _error(self, problem: str) -> InputError:
        return InputError(SourceRef(self.document.file, f"byte {self.at}"), problem)

    # -- numbers and text ------------------------------------------------------------------

    def _advance(self, count: int) -> int:
        """Where ``count`` bytes begin, which are passed."""
        begin = self.at
        if count > self.end - begin:
            raise _DamagedError(f"{count} bytes wanted, {max(self.end - begin, 0)} are left")
        self.at = begin + count
        return begin

    def _number(self) -> int:
        begin = self._advance(4)
        return int(self._uint.unpack_from(self.data, begin)[0])

    def _flag(self) -> bool:
        return self.data[self._advance(1)] != 0

    def _text(self) -> str:
        count = self._number()
        begin = self._advance(count)
        return decoded(self.data[begin : begin + count])

    def _open(self) -> int:
        """Begin a block; where it ends, or where the one around it does if it has no size."""
        if not self.layout.sizes:
            return self.end
        begin = self._advance(self._size.size)
        end = begin + int(self._size.unpack_from(self.data, begin)[0])
        if not self.at <= end <= self.end:
            raise _DamagedError(f"a block up to byte {end}; want byte {self.at} to {self.end}")
        return end

    def _view(self, code: str, width: int, count: int) -> Block:
        """A block of ``count`` rows of numbers, which stay where they are."""
        dtype = np.dtype(self.layout.order + DTYPES[code])
        begin = self._advance(dtype.itemsize * width * count)
        values = np.frombuffer(self.data, dtype, width * count, begin)
        if code == "b":
            text = np.full(2 * len(values), ord(" "), np.uint8)
            text[::2] = np.where(values, ord("1"), ord("0"))
            return Block(raw=text.tobytes())
        return Block(values=values)

    def _words(self, element: Element) -> list[str]:
        """Numbers as the text form has them."""
        key = element.code, element.count
        reader = self._structs.get(key)
        if reader is None:
            letter = {"b": "B", "c": "b", "C": "B", "g": "I", "v": "i", "e": "i"}
            code = letter.get(element.code, element.code)
            reader = struct.Struct(f"{self.layout.order}{element.count}{code}")
            self._structs[key] = reader
        values = reader.unpack_from(self.data, self._advance(reader.size))
        if element.names is not None:
            return [element.names.get(value, str(value)) for value in values]
        return [_WORDS.get(element.code, str)(value) for value in values]

    # -- objects ---------------------------------------------------------------------------

    def _object(self, block: Block) -> Reader:
        """Read an object, or a reference to one, into a block."""
        start = self.at
        label = self._text()
        statement = Statement([label], start)
        block.statements.append(statement)
        if label == "NULL":
            return
        end = self._open()
        number = str(self._number())
        inner = Block([Statement(["UniqueID", number], start)])
        statement.block = inner
        definitions = self.document.definitions
        if number in definitions:
            self.at = end if self.layout.sizes else self.at
            return
        if self.layout.sizes and self.at == end:  # inside something that was passed over
            text = f"object {number} was in a part that is not known"
            self.document.add(Kind.MISSING, "osg-reference", statement, label, text)
            return
        definitions[number] = statement
        self.count += 1
        if self.count > _OBJECTS_PER_NODE * self.limits.nodes:
            raise self._error(f"more than {_OBJECTS_PER_NODE * self.limits.nodes} objects")
        outer, self.end = self.end, end
        try:
            yield from self._fields(label, inner)
        except (UnknownPartError, _DamagedError) as problem:
            if not self.layout.sizes:
                raise
            text = f"{problem}; {end - self.at} bytes are passed over"
            kind = Kind.INVALID if isinstance(problem, _DamagedError) else Kind.DROPPED
            self.document.add(kind, "osg-unread", statement, label, text)
        self.end = outer
        if self.layout.sizes:
            self.at = end

    def _fields(self, label: str, block: Block) -> Reader:
        """Read the fields of a class."""
        if label not in self._plans:
            self._plans[label] = plan(label, self.layout.version, self.layout.schema)
        fields = self._plans[label]
        if fields is None:
            raise UnknownPartError(self.at, f"{label} is no class that is known here")
        statements = block.statements
        for name, optional, layout in fields:
            if optional and not self._flag():
                continue
            place = self.at
            code = layout[0].code if layout else ""
            if code == "O":
                if self._flag():
                    inner = Block()
                    statements.append(Statement([name, "TRUE"], place, inner))
                    yield self._object(inner)
            elif code == "s" and len(layout) == 1:
                text = self._text()
                if text:
                    statements.append(Statement([name, text], place))
            elif code in DTYPES and len(layout) == 1:
                statements.append(Statement([name, *self._words(layout[0])], place))
            elif code == "[":
                yield from self._vector(name, layout[0].inside[0], statements)
            elif code == "!":
                raise UnknownPartError(place, f"{label}: {name} is not known here")
            else:
                line = Statement([name], place)
                statements.append(line)
                yield from self._layout(layout, line, block)

    def _vector(self, name: str, item: Element, statements: list[Statement]) -> Reader:
        place, count = self.at, self._number()
        if not count:
            return
        line = Statement([name, str(count)], place, Block())
        if item.code in DTYPES:
            line.block = self._view(item.code, item.count, count)
            statements.append(line)
            return
        statements.append(line)
        yield from self._items(count, (item,), line)

    def _items(self, count: int, layout: tuple[Element, ...], line: Statement) -> Reader:
        """Read ``count`` times what a layout says, into a block of ``line``."""
        if len(layout) == 1 and layout[0].code in DTYPES:
            line.block = self._view(layout[0].code, layout[0].count, count)
            return
        line.block = block = Block()
        sizes = [element.size for element in layout]
        if None not in sizes and "g" not in [element.code for element in layout]:
            self._advance(count * sum(filter(None, sizes)))  # rows of several types; nobody's
            return
        for _ in range(count):
            if layout[0].code == "o":
                yield self._object(block)
                rest = layout[1:]
            else:
                rest = layout
            if rest:
                yield from self._layout(rest, None, block)

    def _layout(self, layout: tuple[Element, ...], line: Statement | None, block: Block) -> Reader:
        """Read what a layout says into ``line``, or into lines of ``block``."""
        for element in layout:
            code = element.code
            if code == ":" or line is None:
                line = Statement([element.word] if code == ":" else [], self.at)
                block.statements.append(line)
            if code in DTYPES:
                line.words += self._words(element)
            elif code == "=":
                line.words.append(element.word)
            elif code in "nN{":
                yield from self._group(element, line)
            elif code != ":":
                yield from _SPECIAL[code](self, line)

    def _group(self, element: Element, line: Statement) -> Reader:
        count = None
        if element.code != "{":
            count = self._number()
            line.words.append(str(count))
            if element.code == "N" and not count:
                return
        self._open()
        if count is not None:
            yield from self._items(count, element.inside, line)
            return
        inner = Block()
        line.block = inner
        if element.inside[0].code == "o":
            yield self._object(inner)
        else:
            yield from self._layout(element.inside, None, inner)

    # -- the other codes of a layout ---------------------------------------------------------

    def _bare_object(self, line: Statement) -> Reader:
        line.block = line.block or Block()
        yield self._object(line.block)

    def _optional_object(self, line: Statement) -> Reader:
        present = self._flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            yield from self._bare_object(line)

    def _bracketed_object(self, line: Statement) -> Reader:
        present = self._flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            self._open()
            yield from self._bare_object(line)

    def _string(self, line: Statement) -> Reader:
        line.words.append(self._text())
        yield from ()

    def _optional_string(self, line: Statement) -> Reader:
        present = self._flag()
        line.words += ["TRUE", self._text()] if present else ["FALSE"]
        yield from ()

    def _matrix(self, line: Statement) -> Reader:
        self._open()
        line.block = self._view("d", 16, 1)
        yield from ()

    def _bytes(self, line: Statement) -> Reader:
        line.block = self._view("C", 1, self._number())
        yield from ()

    def _optional_array(self, line: Statement) -> Reader:
        present = self._flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            yield from self._array(line)

    def _array(self, line: Statement) -> Reader:
        """An array that is no object: ``ArrayID 2 Vec3fArray 40 {`` in the text form."""
        number = str(self._number())
        line.words += ["ArrayID", number]
        if f"ArrayID {number}" in self.document.definitions:
            return
        kind = self._number()
        if kind >= len(_ARRAY_TYPES):
            raise UnknownPartError(self.at, f"array of type {kind}; want 0 to 31")
        name, count = _ARRAY_TYPES[kind], self._number()
        line.words += [name, str(count)]
        self._open()
        width, code = 1, _SCALARS.get(name.removesuffix("Array"), name[0].lower())
        if name.startswith("Vec"):
            width, code = int(name[3]), _LETTERS[name[4:].removesuffix("Array")]
        line.block = self._view(code, width, count)
        self.document.definitions[f"ArrayID {number}"] = line
        yield from ()

    def _primitive_set(self, line: Statement) -> Reader:
        """A primitive set that is no object: ``DrawArrays GL_TRIANGLES 0 0 36`` as text."""
        kind, mode = self._number(), self._number()
        if kind not in _SETS:
            raise UnknownPartError(self.at, f"primitive set of type {kind}; want 50 to 54")
        name, code = _SETS[kind]
        line.words += [name, f"GL_{_MODES[mode]}" if mode < len(_MODES) else str(mode)]
        if self.layout.version > 96:
            line.words.append(str(self._number()))  # instances
        if kind in (50, 51):
            line.words += self._words(Element("i"))
        if code is None:
            line.words += self._words(Element("i"))
            return
        count = self._number()
        line.words.append(str(count))
        self._open()
        line.block = self._view(code, 1, count)
        yield from ()

    # -- images ------------------------------------------------------------------------------

    def _optional_image(self, line: Statement) -> Reader:
        present = self._flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            yield from self._image(line)

    def _bracketed_image(self, line: Statement) -> Reader:
        present = self._flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            self._open()
            yield from self._image(line)

    def _image(self, line: Statement) -> Reader:
        """An image; its bytes stay where they are."""
        place = self.at
        label = self._text() if self.layout.version > 94 else "osg::Image"
        number = str(self._number())
        line.block = inner = Block([Statement(["UniqueID", number], place)])
        if number in self.document.definitions:
            return
        self.document.definitions[number] = line

        def add(*words: str) -> Statement:
            statement = Statement(list(words), self.at)
            inner.statements.append(statement)
            return statement

        add("ClassName", label)
        add("FileName", self._text())
        hint, how = self._number(), self._number()
        add("WriteHint", str(hint), str(how))
        if how == _INLINE_DATA:
            add("Origin", str(self._number()))
            add("Size", *self._words(Element("i", 3)))
            for name in ("InternalTextureFormat", "PixelFormat", "DataType", "Packing"):
                add(name, *self._words(Element("i")))
            self._number()  # how the memory was allocated
        if how in (_INLINE_DATA, _INLINE_FILE):
            count = self._number()
            begin = self._advance(count)
            if count:
                held = add("Data" if how == _INLINE_DATA else "InlineFile", str(count))
                held.block = Block(data=memoryview(self.data)[begin : self.at])
        if how == _INLINE_DATA:
            self._advance(4 * self._number())  # where the smaller levels begin
        # what an image has beyond that is written by the program, whatever its class
        yield from self._fields("osg::Object", inner)


_WORDS: dict[str, Callable[[Any], str]] = {
    "b": lambda value: "TRUE" if value else "FALSE",
    "f": lambda value: str(np.float32(value)),  # the shortest that is this number
    "d": repr,
    "g": lambda value: GL_NAMES.get(value, str(value)),
    "v": value_name,
}
_SPECIAL: dict[str, Callable[[_Objects, Statement], Reader]] = {
    "o": _Objects._bare_object,
    "O": _Objects._optional_object,
    "X": _Objects._bracketed_object,
    "s": _Objects._string,
    "t": _Objects._optional_string,
    "M": _Objects._matrix,
    "r": _Objects._bytes,
    "a": _Objects._optional_array,
    "A": _Objects._array,
    "p": _Objects._primitive_set,
    "m": _Objects._image,
    "Y": _Objects._optional_image,
    "Z": _Objects._bracketed_image,
}
