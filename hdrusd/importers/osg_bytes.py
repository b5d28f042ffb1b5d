"""Numbers, text and blocks of a binary OpenSceneGraph file.

Sources: OpenSceneGraph 3.6, src/osgPlugins/osg/BinaryStreamOperator.h.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hdrusd.importers.osg_gl import GL_NAMES, value_name
from hdrusd.importers.osg_layouts import DTYPES, Element
from hdrusd.importers.osg_text import Block, decoded

#: Letters of a layout to those of ``struct``, where they differ.
_STRUCT = {"b": "B", "c": "b", "C": "B", "g": "I", "v": "i", "e": "i"}
_WORDS: dict[str, Callable[[Any], str]] = {
    "b": lambda value: "TRUE" if value else "FALSE",
    "f": lambda value: str(np.float32(value)),  # the shortest that is this number
    "d": repr,
    "g": lambda value: GL_NAMES.get(value, str(value)),
    "v": value_name,
}


class DamagedError(Exception):
    """Bytes that make no sense."""


@dataclass(slots=True)
class Layout:
    """What the head of a file says about the rest of it."""

    version: int
    order: str  # "<" or ">", as in ``struct``
    sizes: bool  # whether blocks state their size
    schema: dict[str, list[str]] = field(default_factory=dict)


class Bytes:
    """A file and where we are in it. Every method raises DamagedError past ``end``."""

    def __init__(self, data: bytes, start: int, layout: Layout) -> None:
        self.data = data
        self.at = start
        self.end = len(data)  # of the object that is being read
        self.layout = layout
        self._structs: dict[tuple[str, int], struct.Struct] = {}
        self._dtypes = {code: np.dtype(layout.order + name) for code, name in DTYPES.items()}
        self._uint = struct.Struct(f"{layout.order}I")
        # the size of a block has 8 bytes since version 149
        self.size = struct.Struct(
            f"{layout.order}Q" if layout.version > 148 else f"{layout.order}I"
        )

    def advance(self, count: int) -> int:
        """Where ``count`` bytes begin, which are passed."""
        begin = self.at
        if count > self.end - begin:
            raise DamagedError(f"{count} bytes wanted, {max(self.end - begin, 0)} are left")
        self.at = begin + count
        return begin

    def number(self) -> int:
        """A number of 4 bytes."""
        at = self.at
        if self.end - at < 4:
            self.advance(4)
        self.at = at + 4
        value: int
        (value,) = self._uint.unpack_from(self.data, at)
        return value

    def flag(self) -> bool:
        """A byte that says whether something follows."""
        return self.data[self.advance(1)] != 0

    def text(self) -> str:
        """A text after its length."""
        return decoded(self.text_bytes())

    def text_bytes(self) -> bytes:
        """A text in its own encoding."""
        count = self.number()
        begin = self.advance(count)
        return self.data[begin : begin + count]

    def open(self) -> int:
        """Begin a block; where it ends, or where the one around it does if it has no size."""
        if not self.layout.sizes:
            return self.end
        begin = self.advance(self.size.size)
        end = begin + int(self.size.unpack_from(self.data, begin)[0])
        if not self.at <= end <= self.end:
            raise DamagedError(f"a block up to byte {end}; want byte {self.at} to {self.end}")
        return end

    def view(self, code: str, width: int, count: int) -> Block:
        """A block of ``count`` rows of numbers, which stay where they are."""
        dtype = self._dtypes[code]
        begin = self.advance(dtype.itemsize * width * count)
        values = np.frombuffer(self.data, dtype, width * count, begin)
        if code == "b":
            text = np.full(2 * len(values), ord(" "), np.uint8)
            text[::2] = np.where(values, ord("1"), ord("0"))
            return Block(raw=text.tobytes())
        return Block(values=values)

    def words(self, element: Element) -> list[str]:
        """Numbers as the text form has them."""
        key = element.code, element.times
        reader = self._structs.get(key)
        if reader is None:
            code = _STRUCT.get(element.code, element.code)
            reader = struct.Struct(f"{self.layout.order}{element.times}{code}")
            self._structs[key] = reader
        values = reader.unpack_from(self.data, self.advance(reader.size))
        if element.names is not None:
            return [element.names.get(value, str(value)) for value in values]
        return [_WORDS.get(element.code, str)(value) for value in values]
