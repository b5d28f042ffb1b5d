"""Vertex arrays of an OpenSceneGraph Geometry, as the three text syntaxes have them.

    .osg                     NormalBinding PER_VERTEX
                             NormalArray Vec3Array 40 { ... }
    .osgt before version 112 NormalData { Array TRUE ArrayID 2 Vec3fArray 40 { ... }
                               Indices FALSE Binding BIND_PER_VERTEX Normalize 0 }
    .osgt                    NormalArray TRUE { osg::Vec3Array { UniqueID 7
                               Binding BIND_PER_VERTEX vector 40 { ... } } }

Sources: OpenSceneGraph 3.6, src/osgWrappers/deprecated-dotosg/osg/Geometry.cpp,
src/osgWrappers/serializers/osg/Geometry.cpp and Array.cpp.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from hdrusd.errors import InputError
from hdrusd.importers.osg_text import Document, Doubles, Integers, Singles, Statement
from hdrusd.report import Kind

_TYPE = re.compile(r"U?(?:Vec(?P<size>[234]))?(?P<kind>[a-z]{0,2})\w*Array")

#: Full scale of the integer types where OpenGL normalises them (colours and normals).
_FULL_SCALE = {
    "b": 127.0,
    "s": 32767.0,
    "i": 2147483647.0,
    "ub": 255.0,
    "us": 65535.0,
    "ui": 4294967295.0,
}


@dataclass(frozen=True, slots=True)
class VertexArray:
    """Values (n, components), how they are bound, and where they stand.

    ``binding`` is PER_VERTEX, OVERALL, PER_PRIMITIVE, PER_PRIMITIVE_SET, OFF or
    UNDEFINED. ``indices``, deprecated in the format, say which value an element takes.
    """

    place: Statement
    values: Singles | Doubles
    binding: str
    full_scale: float | None  # of the integer type, None for floating point
    indices: Integers | None = None

    def normalised(self) -> Singles | Doubles:
        """The values as OpenGL sees colours and normals."""
        return self.values if self.full_scale is None else self.values / self.full_scale


class ArrayReader:
    """Reads vertex arrays; counts their rows against ``limit`` over a whole file.

    The count is needed because one array may stand for many by reference.
    """

    def __init__(self, document: Document, limit: int) -> None:
        self.document = document
        self.limit = limit
        self.rows = 0

    def array(self, geometry: Statement, role: str) -> VertexArray | None:
        """The array in a role: Vertex, Normal, Color. Raises InputError past the limit."""
        document, key = self.document, role.lower()
        found = document.field(geometry, f"{key}array", f"{key}data")
        if found is None:
            return None
        if found.key == f"{key}data":
            return self._version_91(found)
        if document.new:
            return self._object(document.object(geometry, f"{key}array"))
        binding = document.word(geometry, f"{key}binding")
        return self._old(found, binding, document.field(geometry, f"{key}indices"))

    def texture_coordinates(self, geometry: Statement) -> dict[int, VertexArray]:
        """Texture unit to its array. Raises InputError past the limit."""
        document = self.document
        found: dict[int, VertexArray | None] = {}
        if not document.new:
            statements = geometry.block.statements if geometry.block is not None else []
            indices = {_unit(s): s for s in statements if s.key == "texcoordindices"}
            for statement in statements:
                if statement.key == "texcoordarray" and (unit := _unit(statement)) is not None:
                    found[unit] = self._old(statement, "PER_VERTEX", indices.get(unit))
        elif (listed := document.field(geometry, "texcoordarraylist")) is not None and listed.block:
            for unit, item in enumerate(listed.block.statements):  # "NULL" where a unit has none
                found[unit] = None if item.block is None else self._object(document.resolve(item))
        elif (listed := document.field(geometry, "texcoorddata")) is not None and listed.block:
            for unit, item in enumerate(listed.block.statements):
                found[unit] = self._version_91(item)
        return {unit: values for unit, values in found.items() if values is not None}

    def _object(self, item: Statement | None) -> VertexArray | None:
        if item is None:
            return None
        vector = self.document.field(item, "vector")
        if vector is None:
            return None
        binding = self.document.word(item, "binding") or "BIND_UNDEFINED"
        return self._values(vector, item.class_name, binding)

    def _version_91(self, owner: Statement) -> VertexArray | None:
        source = self._by_array_id(self.document.field(owner, "array"))
        if source is None:
            return None
        binding = self.document.word(owner, "binding") or "BIND_UNDEFINED"
        indices = self._integers(self._by_array_id(self.document.field(owner, "indices")))
        return self._values(source, _type_word(source), binding, indices)

    def _old(
        self, statement: Statement, binding: str | None, indices: Statement | None
    ) -> VertexArray | None:
        source = self.document.resolve(statement)
        if source is None or source.block is None:
            return None
        by_index = None if indices is None else self.document.resolve(indices)
        return self._values(
            source, _type_word(source), binding or "UNDEFINED", self._integers(by_index)
        )

    def _by_array_id(self, statement: Statement | None) -> Statement | None:
        if statement is None or "ArrayID" not in statement.words[:-1]:
            return None
        identity = statement.words[statement.words.index("ArrayID") + 1]
        return self.document.definitions.get(f"ArrayID {identity}")

    def _values(
        self,
        statement: Statement,
        type_name: str,
        binding: str,
        indices: Integers | None = None,
    ) -> VertexArray | None:
        """The numbers of ``statement`` in rows. A declared count is compared, never believed."""
        kind = _array_type(type_name)
        if statement.block is None:
            return None
        if kind is None:
            self.document.add(
                Kind.DROPPED, "osg-array-type", statement, type_name, "no such array type; left out"
            )
            return None
        size, full_scale = kind
        numbers = statement.block.floats()
        rows = len(numbers) // size
        self._spend(rows, statement)
        declared = statement.declared
        if rows * size != len(numbers) or (declared is not None and declared != rows):
            self.document.add(
                Kind.INVALID,
                "osg-count",
                statement,
                type_name,
                f"{declared} declared, {len(numbers)} numbers found; {rows} are used",
            )
        return VertexArray(
            statement,
            numbers[: rows * size].reshape(rows, size),
            binding.removeprefix("BIND_"),
            full_scale,
            indices,
        )

    def _integers(self, statement: Statement | None) -> Integers | None:
        if statement is None or statement.block is None:
            return None
        numbers = statement.block.indices()
        self._spend(len(numbers), statement)
        return numbers

    def _spend(self, rows: int, place: Statement) -> None:
        self.rows += rows
        if self.rows > self.limit:
            raise InputError(self.document.ref(place), f"more than {self.limit} array rows in all")


@lru_cache(256)
def _array_type(name: str) -> tuple[int, float | None] | None:
    """Components of a value and full scale, by the name of a class; None if it is no array's."""
    kind = _TYPE.fullmatch(name)
    if kind is None:
        return None
    short = {"UByte": "ub", "UShort": "us", "UInt": "ui", "Byte": "b", "Short": "s", "Int": "i"}
    letters = kind["kind"] or next((v for k, v in short.items() if name.startswith(k)), "")
    if name.startswith("UVec"):  # UVec4bArray is the old name of Vec4ubArray
        letters = f"u{letters}"
    return int(kind["size"] or 1), _FULL_SCALE.get(letters)


def _unit(statement: Statement) -> int | None:
    word = statement.words[1] if len(statement.words) > 1 else ""
    return int(word) if word.isdecimal() and len(word) < 4 else None


def _type_word(statement: Statement) -> str:
    """``Vec3Array`` of ``VertexArray UniqueID Vec3Array_6 Vec3Array 40 {``; the field's own name
    ends in Array too, and before 0.9.3 there was no type: Vec3.
    """
    words = [word for word in statement.words[1:] if _TYPE.fullmatch(word)]
    return words[-1] if words else "Vec3Array"
