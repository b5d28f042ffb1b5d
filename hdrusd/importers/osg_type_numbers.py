"""Numbers that a binary OpenSceneGraph file has for the types of its arrays and primitive sets.

Since version 112 of the format those are objects, which have names.

Sources: OpenSceneGraph 3.6, include/osgDB/DataTypes, src/osgDB/InputStream.cpp.
"""

from __future__ import annotations

_TYPES = {"b": "c", "ub": "C", "s": "h", "us": "H", "i": "i", "ui": "I", "f": "f", "d": "d"}
_SCALARS = "Byte=c UByte=C Short=h UShort=H Int=i UInt=I Float=f Double=d"
_VECTORS = (
    *("2b", "3b", "4b", "4ub", "2s", "3s", "4s", "2f", "3f", "4f", "2d", "3d", "4d", "2ub", "3ub"),
    *("2us", "3us", "4us", "2i", "3i", "4i", "2ui", "3ui", "4ui"),
)

#: Arrays by their numbers: name of the class, code of ``osg_layouts`` of a value, values in a row.
ARRAYS = (
    *((f"{name}Array", code, 1) for name, _, code in (p.partition("=") for p in _SCALARS.split())),
    *((f"Vec{word}Array", _TYPES[word[1:]], int(word[0])) for word in _VECTORS),
)

#: Primitive sets: the class, and what the block holds.
SETS = {
    50: ("DrawArrays", None),
    51: ("DrawArrayLengths", "i"),
    52: ("DrawElementsUByte", "C"),
    53: ("DrawElementsUShort", "H"),
    54: ("DrawElementsUInt", "I"),
}

MODES = (
    *("POINTS", "LINES", "LINE_LOOP", "LINE_STRIP", "TRIANGLES", "TRIANGLE_STRIP", "TRIANGLE_FAN"),
    *("QUADS", "QUAD_STRIP", "POLYGON"),
)
