"""Primitive sets of an OpenSceneGraph Geometry as polygons.

A primitive set draws runs of elements, an element being the number of a vertex.
DrawArrays and DrawElements are one run, DrawArrayLengths many. Strips and fans
become triangles as OpenGL 2.1, section 2.6.1 defines them.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg/PrimitiveSet.cpp,
src/osgDB/InputStream.cpp (readPrimitiveSet),
src/osgWrappers/deprecated-dotosg/osg/Geometry.cpp (Primitive_readLocalData).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.osg_text import Document, Integers, Statement
from hdrusd.report import Kind

Bools = npt.NDArray[np.bool_]

_INTEGER = re.compile(r"-?[0-9]{1,15}")
_MOST = 10**15  # whatever is declared beyond this is absurd and still fits 64 bits

_KINDS = {
    "DrawArrays",
    "DrawArrayLengths",
    "DrawElementsUByte",
    "DrawElementsUShort",
    "DrawElementsUInt",
}
#: Modes whose figures share no elements.
_SEPARATE = ("TRIANGLES", "QUADS")
_MODES = ("TRIANGLES", "TRIANGLE_STRIP", "TRIANGLE_FAN", "QUADS", "QUAD_STRIP", "POLYGON")
#: Elements of the smallest figure, elements that each further one takes.
_STEPS = {
    "TRIANGLES": (3, 3),
    "TRIANGLE_STRIP": (3, 1),
    "TRIANGLE_FAN": (3, 1),
    "QUADS": (4, 4),
    "QUAD_STRIP": (4, 2),
}


@dataclass(slots=True)
class Polygons:
    """Faces: corner counts, elements of all corners, and for each face the number of its
    primitive set and of its primitive (a face of TRIANGLES and QUADS, else a whole run).
    """

    counts: Integers
    elements: Integers
    sets: Integers
    primitives: Integers

    def keep(self, faces: Bools) -> Polygons:
        """Only the faces where ``faces`` is True."""
        return Polygons(
            self.counts[faces],
            self.elements[np.repeat(faces, self.counts)],
            self.sets[faces],
            self.primitives[faces],
        )

    def where(self, corners: Bools) -> Bools:
        """The faces of which all corners are True."""
        if not len(self.counts):
            return np.zeros(0, dtype=np.bool_)
        return np.logical_and.reduceat(corners, np.cumsum(self.counts) - self.counts)


@dataclass(frozen=True, slots=True)
class _PrimitiveSet:
    place: Statement
    mode: str
    elements: Integers | None  # None: the elements from ``first`` on, one after another
    first: int
    lengths: Integers  # of the runs


class PrimitiveReader:
    """Reads primitive sets; counts corners against ``limit`` over a whole file."""

    def __init__(self, document: Document, limit: int) -> None:
        self.document = document
        self.limit = limit
        self.corners = 0

    def read(self, geometry: Statement, elements: int) -> Polygons:
        """The faces of a Geometry that has ``elements`` elements. Raises InputError past the limit.

        Points, lines and patches are no faces: a finding with their number.
        """
        parts: list[Polygons] = []
        primitive = 0
        undrawn: dict[str, int] = {}
        for number, item in enumerate(self._sets(geometry)):
            if item.mode not in _MODES:
                undrawn[item.mode] = undrawn.get(item.mode, 0) + 1
                continue
            part = self._polygons(item, elements)
            part.sets += number
            part.primitives += primitive
            primitive += len(part.counts) if item.mode in _SEPARATE else len(item.lengths)
            parts.append(part)
        for mode, count in undrawn.items():
            self.document.add(
                Kind.DROPPED,
                "osg-primitive-mode",
                geometry,
                self.document.name(geometry),
                f"{count} primitive sets of {mode}; only faces are kept",
            )
        if not parts:
            empty = np.zeros(0, dtype=np.int64)
            return Polygons(empty, empty, empty, empty)
        if len(parts) == 1:
            return parts[0]
        return Polygons(
            np.concatenate([part.counts for part in parts]),
            np.concatenate([part.elements for part in parts]),
            np.concatenate([part.sets for part in parts]),
            np.concatenate([part.primitives for part in parts]),
        )

    def _sets(self, geometry: Statement) -> Iterator[_PrimitiveSet]:
        listed = self.document.field(geometry, "primitivesetlist", "primitivesets", "primitives")
        statements = [] if listed is None or listed.block is None else listed.block.statements
        for statement in statements:
            place = self.document.resolve(statement) if statement.block else statement
            if place is None or place.class_name not in _KINDS:
                name = statement.class_name
                self.document.add(
                    Kind.DROPPED, "osg-primitive-class", statement, name, "unknown primitive set"
                )
            elif len(place.words) > 1:
                yield self._line(place)
            else:
                yield self._object(place)

    def _line(self, place: Statement) -> _PrimitiveSet:
        """``DrawArrays TRIANGLES 0 36``: .osg, and .osgt before version 112 with GL_TRIANGLES.

        A number of instances may follow the rest in .osg and precedes it in .osgt.
        """
        mode = place.words[1].removeprefix("GL_")
        numbers = [int(w) for w in place.words[2:] if _INTEGER.fullmatch(w)]
        wanted = {"DrawArrays": 2, "DrawArrayLengths": 2}.get(place.class_name, 1)
        numbers = numbers[-wanted:] if self.document.new else numbers[:wanted]
        if len(numbers) < wanted:
            numbers = [0] * wanted
        if place.class_name == "DrawArrays":
            return _PrimitiveSet(place, mode, None, numbers[0], np.array([numbers[1]]))
        return self._block(place, mode, place, numbers[0], numbers[-1])

    def _object(self, place: Statement) -> _PrimitiveSet:
        """``osg::DrawArrays { UniqueID 3 Mode TRIANGLES Count 36 }``; left out is 0, or POINTS."""
        mode = (self.document.word(place, "mode") or "POINTS").removeprefix("GL_")
        first = self._whole(place, "first")
        if place.class_name == "DrawArrays":
            count = self._whole(place, "count")
            return _PrimitiveSet(place, mode, None, first, np.array([count]))
        vector = self.document.field(place, "vector")
        return self._block(place, mode, vector, first, None if vector is None else vector.declared)

    def _whole(self, place: Statement, key: str) -> int:
        return int(min(max(self.document.number(place, 0.0, key), -_MOST), _MOST))

    def _block(
        self,
        place: Statement,
        mode: str,
        holder: Statement | None,
        first: int,
        declared: int | None,
    ) -> _PrimitiveSet:
        block = None if holder is None else holder.block
        values = np.zeros(0, dtype=np.int64) if block is None else block.indices()
        self._spend(len(values), place)
        if declared is not None and declared != len(values):
            self.document.add(
                Kind.INVALID,
                "osg-count",
                place,
                place.class_name,
                f"{declared} declared, {len(values)} numbers found; those are used",
            )
        if place.class_name == "DrawArrayLengths":
            return _PrimitiveSet(place, mode, None, first, np.maximum(values, 0))
        return _PrimitiveSet(place, mode, values, 0, np.array([len(values)]))

    def _spend(self, corners: int, place: Statement) -> None:
        self.corners += corners
        if self.corners > self.limit:
            raise InputError(self.document.ref(place), f"more than {self.limit} corners in all")

    def _polygons(self, item: _PrimitiveSet, elements: int) -> Polygons:
        available = elements if item.elements is None else len(item.elements)
        lengths = self._clamped(item, available)
        if item.elements is None:
            self._spend(int(lengths.sum()), item.place)
        separate = item.mode in _SEPARATE
        if separate and len(lengths) == 1:
            counts, corners = _single_run(item, int(lengths[0]))
            run = counts
        else:
            starts = item.first + np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64)
            counts, corners, run = faces(item.mode, starts, lengths)
            corners = corners if item.elements is None else item.elements[corners]
        primitives = np.arange(len(counts), dtype=np.int64) if separate else run
        made = Polygons(counts, corners, np.zeros(len(counts), dtype=np.int64), primitives)
        if item.mode == "TRIANGLE_STRIP":
            made = _without_stitches(made)
        corners = made.elements
        if corners.min(initial=0) < 0 or corners.max(initial=-1) >= elements:
            valid = made.where((corners >= 0) & (corners < elements))
            self.document.add(
                Kind.INVALID,
                "osg-index",
                item.place,
                item.place.class_name,
                f"{int((~valid).sum())} faces with an index that is no vertex; "
                f"want 0 to {elements - 1}; left out",
            )
            return made.keep(valid)
        return made

    def _clamped(self, item: _PrimitiveSet, available: int) -> Integers:
        """Lengths of the runs that the elements suffice for. Declared counts may be absurd."""
        room = max(available - item.first, 0) if item.first >= 0 else 0
        if len(item.lengths) == 1 and 0 <= item.lengths[0] <= room:
            return item.lengths
        lengths = np.clip(item.lengths, 0, room)
        if len(lengths) > 1:
            before = np.concatenate([[0], np.cumsum(lengths)[:-1]])
            lengths = np.clip(lengths, 0, np.maximum(room - before, 0))
        if not np.array_equal(lengths, item.lengths):
            wanted = float(item.lengths.sum(dtype=np.float64))
            self.document.add(
                Kind.CLAMPED,
                "osg-draw-count",
                item.place,
                item.place.class_name,
                f"draws {wanted:.0f} elements from {item.first} on, of {available}; "
                f"{int(lengths.sum())} are drawn",
            )
        return lengths


def _single_run(item: _PrimitiveSet, length: int) -> tuple[Integers, Integers]:
    """Corner counts and corners of separate figures: the elements as they follow one another."""
    width, _ = _STEPS[item.mode]
    count = length // width
    end = item.first + count * width
    if item.elements is None:
        corners = np.arange(item.first, end, dtype=np.int64)
    else:
        corners = item.elements[item.first : end]
    return np.full(count, width, dtype=np.int64), corners


def faces(mode: str, starts: Integers, lengths: Integers) -> tuple[Integers, Integers, Integers]:
    """Corner counts, positions of the corners and run of each face, for runs of elements.

    An incomplete figure at the end of a run is left out, as OpenGL leaves it out.
    """
    if mode == "POLYGON":
        runs = np.flatnonzero(lengths >= 3)
        counts = lengths[runs]
        return counts, np.repeat(starts[runs], counts) + _count_up(counts), runs
    least, step = _STEPS[mode]
    per_run = np.where(lengths >= least, (lengths - least) // step + 1, 0)
    run = np.repeat(np.arange(len(lengths)), per_run)
    index = _count_up(per_run)
    base = starts[run] + index * step
    if mode == "TRIANGLE_FAN":
        columns = [starts[run], base + 1, base + 2]
    elif mode == "TRIANGLE_STRIP":  # every second one is wound the other way
        odd = index % 2
        columns = [base + odd, base + 1 - odd, base + 2]
    elif mode == "QUAD_STRIP":
        columns = [base, base + 1, base + 3, base + 2]
    else:
        columns = [base + i for i in range(least)]
    return np.full(len(run), least, dtype=np.int64), np.stack(columns, axis=1).ravel(), run


def _count_up(counts: Integers) -> Integers:
    """0 to n - 1 for each n of ``counts``, one after another."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    return np.arange(total, dtype=np.int64) - np.repeat(ends - counts, counts)


def _without_stitches(made: Polygons) -> Polygons:
    """Strips are joined by triangles without area that name a vertex twice; nothing is lost."""
    a, b, c = made.elements.reshape(-1, 3).T
    return made.keep((a != b) & (b != c) & (a != c))
