"""The block tree of a binary OpenSceneGraph file, ``.osgb``: that of the text form.

A file is objects inside objects: the name of the class, the number of the object, and the fields
that ``osg_layouts`` knows. Where the file states the sizes of its blocks, as it does since
OpenSceneGraph 3.2, a class or a field that is not known is passed over; where it does not, the
rest cannot be read. Objects are read by generators on a stack of our own, since how deep they
stand is the file's choice: each yields the objects inside, whose turn it is then. Arrays stay
views of the file; a count is compared with the bytes that are left before anything is made of it.

Sources: OpenSceneGraph 3.6, src/osgDB/InputStream.cpp, include/osgDB/DataTypes,
src/osgPlugins/osg/BinaryStreamOperator.h.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits
from hdrusd.importers.osg_bytes import Bytes, DamagedError, Layout
from hdrusd.importers.osg_layouts import DTYPES, Element, Field, plan
from hdrusd.importers.osg_text import Block, Document, Statement
from hdrusd.importers.osg_type_numbers import ARRAYS, MODES, SETS
from hdrusd.report import Kind

#: Key frames of osgAnimation: bytes of a value.
_KEYS = {"Double": 8, "Float": 4, "Vec2": 8, "Vec3": 12, "Vec4": 16, "Quat": 32, "Matrix": 128}
_CHANNEL = re.compile(f"({'|'.join(_KEYS)})(Step|Linear|SphericalLinear|CubicBezier)Channel")
_INLINE_DATA, _INLINE_FILE = 0, 1
_ZEROS = bytes(64)  # more than fields of a class that may be absent in a row
_OBJECTS_PER_NODE = 16  # of the limit on nodes: arrays, primitive sets, states


class UnknownPartError(Exception):
    """Something that only the program that wrote it can read; where, and what it is."""

    def __init__(self, at: int, text: str) -> None:
        self.at = at
        super().__init__(text)


def fill(document: Document, data: bytes, start: int, layout: Layout, limits: Limits) -> None:
    """Read the objects of ``data`` from ``start`` on into the tree of ``document``.

    Raises InputError where the file is cut or damaged, UnknownPartError where it says what only
    another reader may know.
    """
    _Objects(document, data, start, layout, limits).run()


class _Opened(NamedTuple):
    """An object of which a part is read, and where it ends."""

    rest: Reader
    statement: Statement
    end: int


#: What reads an object or a part of it: it yields the objects inside, None where one is done.
Reader = Iterator[_Opened | None]


class _Objects(Bytes):
    """One pass over the bytes."""

    def __init__(
        self, document: Document, data: bytes, start: int, layout: Layout, limits: Limits
    ) -> None:
        super().__init__(data, start, layout)
        self.document = document
        self.limits = limits
        self.count = 0
        self._plans: dict[str, tuple[Field, ...] | None] = {}

    def run(self) -> None:
        """Read the one object that the file is. Raises InputError, UnknownPartError."""
        try:
            root = self._object(self.document.root)
            stack = [] if root is None else [root]
            while stack:
                self._read_on(stack)
        except DamagedError as problem:
            raise self._error(f"{problem}; want a whole, undamaged file") from problem

    def _read_on(self, stack: list[_Opened]) -> None:
        """Read the object on top up to the next one inside, which is put on it, or to its end."""
        opened = stack[-1]
        self.end = opened.end
        try:
            inner = next(opened.rest)
        except StopIteration:
            stack.pop()
        except (UnknownPartError, DamagedError) as problem:
            if not self.layout.sizes:
                raise
            self._unread(opened.statement, problem, opened.end)
            stack.pop()
        else:
            if inner is not None:
                stack.append(inner)
            if len(stack) > self.limits.depth:
                raise self._error(f"objects deeper than {self.limits.depth}")
            return
        if self.layout.sizes:
            self.at = opened.end

    def _unread(self, place: Statement, problem: Exception, end: int) -> None:
        text = f"{problem}; {end - self.at} bytes are passed over"
        kind = Kind.INVALID if isinstance(problem, DamagedError) else Kind.DROPPED
        self.document.add(kind, "osg-unread", place, place.label, text)

    def _error(self, problem: str) -> InputError:
        return InputError(SourceRef(self.document.file, f"byte {self.at}"), problem)

    # -- objects ---------------------------------------------------------------------------

    def _object(self, block: Block) -> _Opened | None:
        """Put an object into a block, without its fields; None if it has none to be read."""
        start = self.at
        label = self.text()
        statement = Statement([label], start)
        block.statements.append(statement)
        if label == "NULL":
            return None
        end = self.open()
        number = str(self.number())
        statement.block = inner = Block()
        definitions = self.document.definitions
        if number in definitions:
            inner.statements.append(Statement(["UniqueID", number], start))
            self.at = end if self.layout.sizes else self.at
            return None
        fields = self._plan(label)
        if self.layout.sizes and self.at == end and fields != ():  # in a part that was passed over
            text = f"object {number} was in a part that is not known"
            self.document.add(Kind.MISSING, "osg-reference", statement, label, text)
            return None
        definitions[number] = statement
        self.count += 1
        if self.count > _OBJECTS_PER_NODE * self.limits.nodes:
            raise self._error(f"more than {_OBJECTS_PER_NODE * self.limits.nodes} objects")
        if fields is not None:
            return _Opened(self._fields(fields, inner, label), statement, end)
        problem = UnknownPartError(self.at, f"{label} is no class that is known here")
        if not self.layout.sizes:
            raise problem
        self._unread(statement, problem, end)
        self.at = end
        return None

    def _plan(self, label: str) -> tuple[Field, ...] | None:
        """The fields of a class; None if it is not known."""
        if label not in self._plans:
            self._plans[label] = plan(label, self.layout.version, self.layout.schema)
        return self._plans[label]

    def _fields(self, fields: tuple[Field, ...], block: Block, label: str) -> Reader:
        """Read the fields of a class into a block."""
        statements = block.statements
        data, passed = self.data, 0
        for name, optional, layout, absent, skipped, code in fields:
            if passed:
                passed -= 1
                continue
            if skipped:
                self.advance(skipped)
                continue
            if absent > 1 and data.startswith(_ZEROS[:absent], self.at, self.end):
                self.at += absent
                passed = absent - 1
                continue
            if optional and not self.flag():
                continue
            place = self.at
            if code == "O":
                if self.flag():
                    inner = Block()
                    statements.append(Statement([name, "TRUE"], place, inner))
                    yield self._object(inner)
            elif code == "s":
                text = self.text()
                if text:
                    statements.append(Statement([name, text], place))
            elif code in DTYPES:
                statements.append(Statement([name, *self.words(layout[0])], place))
            elif code == "[":
                count, items = self.number(), layout[0].inside
                if not count:
                    continue
                line = Statement([name, str(count)], place)
                statements.append(line)
                if items[0].code in DTYPES and len(items) == 1:
                    line.block = self.view(items[0].code, items[0].times, count)
                else:
                    yield from self._items(count, items, line)
            elif code == "-O":
                if self.flag() and (unread := self._pass_object()) is not None:
                    yield unread
            elif code == "!":
                raise UnknownPartError(place, f"{label}: {name} is not known here")
            else:
                line = Statement([name], place)
                statements.append(line)
                yield from self._layout(layout, line, block)

    def _pass_object(self) -> _Opened | None:
        """Pass over an object; one whose size is not known is read, into nothing."""
        if not self.layout.sizes:
            return self._object(Block())
        if self.text_bytes() != b"NULL":
            self.at = self.open()
        return None

    def _items(self, count: int, layout: tuple[Element, ...], line: Statement) -> Reader:
        """Read ``count`` times what a layout says, into a block of ``line``."""
        if len(layout) == 1 and layout[0].code in DTYPES:
            line.block = self.view(layout[0].code, layout[0].times, count)
            return
        line.block = block = Block()
        sizes = [element.size for element in layout]
        if None not in sizes and "g" not in [element.code for element in layout]:
            self.advance(count * sum(filter(None, sizes)))  # rows of several types; nobody's
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
                line.words += self.words(element)
            elif code == "=":
                line.words.append(element.word)
            elif code in "nN{":
                yield from self._group(element, line)
            elif code != ":":
                yield from _SPECIAL[code](self, line)

    def _group(self, element: Element, line: Statement) -> Reader:
        count = None
        if element.code != "{":
            count = self.number()
            line.words.append(str(count))
            if element.code == "N" and not count:
                return
        self.open()
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
        present = self.flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            yield from self._bare_object(line)

    def _bracketed_object(self, line: Statement) -> Reader:
        present = self.flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            self.open()
            yield from self._bare_object(line)

    def _string(self, line: Statement) -> Reader:
        line.words.append(self.text())
        yield from ()

    def _optional_string(self, line: Statement) -> Reader:
        present = self.flag()
        line.words += ["TRUE", self.text()] if present else ["FALSE"]
        yield from ()

    def _matrix(self, line: Statement) -> Reader:
        self.open()
        line.block = self.view("d", 16, 1)
        yield from ()

    def _bytes(self, line: Statement) -> Reader:
        line.block = self.view("C", 1, self.number())
        yield from ()

    def _optional_array(self, line: Statement) -> Reader:
        present = self.flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            yield from self._array(line)

    def _array(self, line: Statement) -> Reader:
        """An array that is no object: ``ArrayID 2 Vec3fArray 40 {`` in the text form."""
        number = str(self.number())
        line.words += ["ArrayID", number]
        if f"ArrayID {number}" in self.document.definitions:
            return
        kind = self.number()
        if kind >= len(ARRAYS):
            raise UnknownPartError(self.at, f"array of type {kind}; want 0 to 31")
        (name, code, width), count = ARRAYS[kind], self.number()
        line.words += [name, str(count)]
        self.open()
        line.block = self.view(code, width, count)
        self.document.definitions[f"ArrayID {number}"] = line
        yield from ()

    def _primitive_set(self, line: Statement) -> Reader:
        """A primitive set that is no object: ``DrawArrays GL_TRIANGLES 0 0 36`` as text."""
        kind, mode = self.number(), self.number()
        if kind not in SETS:
            raise UnknownPartError(self.at, f"primitive set of type {kind}; want 50 to 54")
        name, code = SETS[kind]
        line.words += [name, f"GL_{MODES[mode]}" if mode < len(MODES) else str(mode)]
        if self.layout.version > 96:
            line.words.append(str(self.number()))  # instances
        if kind in (50, 51):
            line.words += self.words(Element("i"))
        if code is None:
            line.words += self.words(Element("i"))
            return
        count = self.number()
        line.words.append(str(count))
        self.open()
        line.block = self.view(code, 1, count)
        yield from ()

    def _channel(self, line: Statement) -> Reader:
        """A channel of an osgAnimation::Animation, which is passed over."""
        kind = self.text()
        line.words.append(kind)
        self.open()
        found = _CHANNEL.fullmatch(kind)
        if found is None:
            raise UnknownPartError(self.at, f"animation channel {kind} is not known here")
        for _ in ("name", "name of the target"):
            self.text()
        if self.flag():
            count = self.number()
            self.open()
            value = _KEYS[found[1]] * (3 if found[2] == "CubicBezier" else 1)
            if found[1] == "Matrix" and self.layout.sizes:
                value += self.size.size
            self.advance(count * (8 + value))
        yield from ()

    def _shown_text(self, line: Statement) -> Reader:
        """The text of an osgText::Text; one of other than Latin letters is an array."""
        if not self.flag():
            raise UnknownPartError(self.at, "text of other letters is not known here")
        line.words.append(self.text())
        yield from ()

    # -- images ------------------------------------------------------------------------------

    def _optional_image(self, line: Statement) -> Reader:
        present = self.flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            yield from self._image(line)

    def _bracketed_image(self, line: Statement) -> Reader:
        present = self.flag()
        line.words.append("TRUE" if present else "FALSE")
        if present:
            self.open()
            yield from self._image(line)

    def _image(self, line: Statement) -> Reader:
        """An image; its bytes stay where they are."""
        place = self.at
        label = self.text() if self.layout.version > 94 else "osg::Image"
        number = str(self.number())
        line.block = inner = Block()
        if number in self.document.definitions:
            inner.statements.append(Statement(["UniqueID", number], place))
            return
        self.document.definitions[number] = line

        def add(*words: str) -> Statement:
            statement = Statement(list(words), self.at)
            inner.statements.append(statement)
            return statement

        add("ClassName", label)
        add("FileName", self.text())
        hint, how = self.number(), self.number()
        add("WriteHint", str(hint), str(how))
        if how == _INLINE_DATA:
            add("Origin", str(self.number()))
            add("Size", *self.words(Element("i", 3)))
            for name in ("InternalTextureFormat", "PixelFormat", "DataType", "Packing"):
                add(name, *self.words(Element("i")))
            self.number()  # how the memory was allocated
        if how in (_INLINE_DATA, _INLINE_FILE):
            count = self.number()
            begin = self.advance(count)
            if count:
                held = add("Data" if how == _INLINE_DATA else "InlineFile", str(count))
                held.block = Block(data=memoryview(self.data)[begin : self.at])
        if how == _INLINE_DATA:
            self.advance(4 * self.number())  # where the smaller levels begin
        # what an image has beyond that is written by the program, whatever its class
        yield from self._fields(self._plan("osg::Object") or (), inner, "osg::Object")


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
    "K": _Objects._channel,
    "T": _Objects._shown_text,
    "m": _Objects._image,
    "Y": _Objects._optional_image,
    "Z": _Objects._bracketed_image,
}
