"""The statements of an OBJ file as arrays: vertices, faces, and what was current at each face.

Source: Alias|Wavefront, Advanced Visualizer manual, appendix B1. Vertex colours
behind the coordinates (``v x y z r g b``) are the common extension.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.importers.obj_text import (
    Block,
    Bools,
    Doubles,
    Integers,
    Tally,
    blocks,
    columns,
    corners,
    decode,
    floats,
    lines_of,
    shorten,
)
from hdrusd.legacy.scene import Floats, Ints

ABSENT, BAD = -1, -2  # corner indices: not given; not usable

_OTHER, _SKIP, _V, _VT, _VN, _F = range(6)

#: Statements that carry something but no polygon, and what it is.
_CODES = {
    "obj-elements": "l p vp cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con "
    "bzp bsp cdc cdp res fo",
    "obj-attributes": "s mg bevel c_interp d_interp lod shadow_obj trace_obj ctech stech maplib "
    "usemap call csh",
}
#: Different lines that are remembered as such.
_COUNTED = 1000
_CODE_OF = {word.encode(): code for code, words in _CODES.items() for word in words.split()}


@dataclass(slots=True)
class Group:
    """What ``o`` and ``g`` name: it becomes one mesh if it has faces."""

    object: str
    group: str
    line: int  # of the statement; 0 before the first

    @property
    def name(self) -> str:
        """Both names where both are given, "" where none is."""
        return "/".join(filter(None, [self.object, self.group]))


@dataclass(slots=True)
class MaterialUse:
    """A name behind ``usemtl`` and the first line with it."""

    name: str
    line: int


@dataclass(slots=True)
class Statements:
    """The whole file.

    Indices in ``corners`` count from 0; ABSENT and BAD are negative. ``face_group``
    and ``face_material`` index ``groups`` and ``uses``; a material of -1 is none.
    """

    points: Doubles  # (n, 3); NaN where the file has no number
    colors: Floats | None  # (n, 4); NaN where a vertex has none
    texcoords: Floats  # (m, 2)
    normals: Floats  # (k, 3)
    face_counts: Ints  # (f,), each >= 3
    face_lines: Integers  # (f,)
    face_group: Ints  # (f,)
    face_material: Ints  # (f,)
    corners: Ints  # (sum of counts, 3): vertex, texture vertex, normal
    groups: list[Group]
    uses: list[MaterialUse]
    libraries: dict[str, int]  # the text behind mtllib, and the first line with it
    generator: str


def parse(resolver: Resolver, tally: Tally) -> Statements:
    """Read ``resolver.source``. Raises InputError if it is binary or has no vertex."""
    data = lines_of(resolver.read(), resolver.source)
    collector = _Collector(resolver, tally)
    for block in blocks(data, resolver.source):
        collector.add(block)
    comment = re.match(rb"\s*#+([^\n]*)", data[:1024])
    return collector.finish(decode(comment[1].strip(), tally, 1) if comment else "")


@dataclass(slots=True)
class _Collector:
    resolver: Resolver
    tally: Tally
    totals: dict[int, int] = field(default_factory=lambda: {_V: 0, _VT: 0, _VN: 0})
    points: list[Doubles] = field(default_factory=list)
    colors: list[tuple[int, Floats]] = field(default_factory=list)  # number of the first; rows
    texcoords: list[Floats] = field(default_factory=list)
    normals: list[Floats] = field(default_factory=list)
    counts: list[Ints] = field(default_factory=list)
    lines: list[Integers] = field(default_factory=list)
    corners: list[Ints] = field(default_factory=list)
    groups: list[Group] = field(default_factory=lambda: [Group("", "", 0)])
    group_of: dict[tuple[int, str], int] = field(default_factory=lambda: {(0, ""): 0})
    uses: list[MaterialUse] = field(default_factory=list)
    use_of: dict[str, int] = field(default_factory=dict)
    objects: int = 0
    #: From that line on: the group and the material.
    changes: list[tuple[int, int, int]] = field(default_factory=lambda: [(0, 0, -1)])
    libraries: dict[str, int] = field(default_factory=dict)
    #: Lines that are but counted ("s 1" stands there by the thousand): code and thing.
    counted: dict[bytes, tuple[str, str]] = field(default_factory=dict)

    def add(self, block: Block) -> None:
        kind = _kinds(block)
        read: dict[int, Callable[[Block, Bools], None]] = {
            _V: self._vertices,
            _VT: self._texcoords,
            _VN: self._normals,
        }
        if np.any(kind == _F):
            self._faces(block, kind)
        for code, method in read.items():
            chosen = kind == code
            if chosen.any():
                method(block, chosen)
                self.totals[code] += int(np.count_nonzero(chosen))
        if self.totals[_V] > self.resolver.limits.vertices:
            text = f"more than {self.resolver.limits.vertices} vertices; raise the limit"
            raise InputError(self.resolver.source, text)
        other = np.flatnonzero(kind == _OTHER)
        ends = (block.starts[other] + block.lengths[other] - 1).tolist()
        starts, numbers = block.starts[other].tolist(), block.numbers[other].tolist()
        for start, end, number in zip(starts, ends, numbers, strict=True):
            line = block.text[start:end]
            if line in self.counted:
                finding, thing = self.counted[line]
                self.tally.note(finding, number, thing=thing)
            else:
                self._statement(line, number)

    def _numbers(self, block: Block, chosen: Bools, keyword: int) -> tuple[Doubles, Integers]:
        values, counts, commas = floats(block.arguments(chosen, keyword))
        if commas:
            self.tally.note("decimal-comma", _first_line(block, chosen), commas)
        return values, counts

    def _count(self, code: str, block: Block, chosen: Bools, where: Bools) -> None:
        if where.any():
            line = int(block.numbers[np.flatnonzero(chosen)[np.argmax(where)]])
            self.tally.note(code, line, int(np.count_nonzero(where)))

    def _vertices(self, block: Block, chosen: Bools) -> None:
        values, counts = self._numbers(block, chosen, 1)
        self.points.append(columns(values, counts, 3))
        if bool(np.all(counts == 3)):
            return
        weight = columns(values, counts, 4)[:, 3]
        self._count("vertex-weight", block, chosen, (counts == 4) & (weight != 1.0))
        self._count("vertex-numbers", block, chosen, (counts == 5) | (counts > 7))
        if np.any(counts >= 6):
            colors = columns(values, counts, 7)[:, 3:]
            colors[counts < 6] = np.nan
            colors[counts == 6, 3] = 1.0
            colors[counts > 7, 3] = 1.0
            given = counts >= 6
            bad = given & ~np.isfinite(colors).all(axis=1)
            self._count("vertex-color", block, chosen, bad)
            with np.errstate(invalid="ignore"):
                outside = given & ~bad & ((colors < 0.0) | (colors > 1.0)).any(axis=1)
            self._count("vertex-color-range", block, chosen, outside)
            self.colors.append((self.totals[_V], _single(colors)))

    def _texcoords(self, block: Block, chosen: Bools) -> None:
        values, counts = self._numbers(block, chosen, 2)
        table = columns(values, counts, 2)
        table[counts == 1, 1] = 0.0  # "vt u" is legal
        if bool(np.any(counts > 2)):
            depth = columns(values, counts, 3)[:, 2]
            self._count("texcoord-depth", block, chosen, (counts > 2) & (depth != 0.0))
        self.texcoords.append(_single(table))

    def _normals(self, block: Block, chosen: Bools) -> None:
        values, counts = self._numbers(block, chosen, 2)
        self.normals.append(_single(columns(values, counts, 3)))

    def _faces(self, block: Block, kind: npt.NDArray[np.uint8]) -> None:
        chosen = kind == _F
        table, counts = corners(block.arguments(chosen, 1))
        where = np.flatnonzero(chosen)
        if np.any(table < 0):  # counted back from the vertices above the face
            owner = np.repeat(where, counts)
            for slot, code in enumerate((_V, _VT, _VN)):
                above = self.totals[code] + np.searchsorted(np.flatnonzero(kind == code), owner)
                index = table[:, slot]
                back = np.where(above + index < 0, BAD, above + index)
                table[:, slot] = np.where(index < 0, back, index - 1)
        else:
            table -= 1
        table[table[:, 0] == ABSENT, 0] = BAD
        few = counts < 3
        if few.any():
            self._count("face-corners", block, chosen, few)
            table = table[~np.repeat(few, counts)]
            counts, where = counts[~few], where[~few]
        self.counts.append(counts.astype(np.int32))
        self.lines.append(block.numbers[where])
        self.corners.append(np.minimum(table, np.iinfo(np.int32).max).astype(np.int32))

    def _statement(self, line: bytes, number: int) -> None:
        keyword, *rest = line.split(None, 1)
        text = decode(rest[0].strip(), self.tally, number) if rest else ""
        if keyword == b"o":
            self.objects += 1
            self._enter(text, "", number)
        elif keyword == b"g":
            self._enter(self.groups[self.changes[-1][1]].object, " ".join(text.split()), number)
        elif keyword == b"usemtl":
            self._change(number, material=self._use(text, number) if text else -1)
        elif keyword == b"mtllib":
            self.libraries.setdefault(text, number)
        elif not (keyword in (b"s", b"mg") and text.split()[:1] in ([], ["off"], ["0"])):
            known = _CODE_OF.get(keyword)
            thing = keyword.decode() if known else ""
            self.tally.note(known or "obj-unknown", number, thing=thing)
            if known and line.isascii() and len(self.counted) < _COUNTED:
                self.counted[line] = known, thing

    def _enter(self, name: str, group: str, line: int) -> None:
        """Every ``o`` is an object of its own; ``g`` with a name it had before goes on with it."""
        index = self.group_of.setdefault((self.objects, group), len(self.groups))
        if index == len(self.groups):
            self.groups.append(Group(name, group, line))
            if index > self.resolver.limits.nodes:
                text = f"more than {self.resolver.limits.nodes} objects and groups"
                raise InputError(SourceRef(self.resolver.source, line), text)
        self._change(line, group=index)

    def _use(self, name: str, line: int) -> int:
        index = self.use_of.setdefault(name, len(self.uses))
        if index == len(self.uses):
            self.uses.append(MaterialUse(name, line))
        return index

    def _change(self, line: int, group: int | None = None, material: int | None = None) -> None:
        _, old_group, old_material = self.changes[-1]
        new_group = old_group if group is None else group
        self.changes.append((line, new_group, old_material if material is None else material))

    def finish(self, generator: str) -> Statements:
        if not self.totals[_V]:
            raise InputError(self.resolver.source, "no vertex; want a Wavefront OBJ file")
        lines = _joined(self.lines, np.int64, ())
        changes = np.array(self.changes, np.int64)
        state = np.searchsorted(changes[:, 0], lines, side="right") - 1
        return Statements(
            points=_joined(self.points, np.float64, (3,)),
            colors=self._all_colors(),
            texcoords=_joined(self.texcoords, np.float32, (2,)),
            normals=_joined(self.normals, np.float32, (3,)),
            face_counts=_joined(self.counts, np.int32, ()),
            face_lines=lines,
            face_group=changes[state, 1].astype(np.int32),
            face_material=changes[state, 2].astype(np.int32),
            corners=_joined(self.corners, np.int32, (3,)),
            groups=self.groups,
            uses=self.uses,
            libraries=self.libraries,
            generator=shorten(generator, 200),
        )

    def _all_colors(self) -> Floats | None:
        if not self.colors:
            return None
        table = np.full((self.totals[_V], 4), np.nan, np.float32)
        for first, rows in self.colors:
            table[first : first + len(rows)] = rows
        return table


def _kinds(block: Block) -> npt.NDArray[np.uint8]:
    """Which statement each line is, from its first three bytes."""
    first, second, third = block.byte(0), block.byte(1), block.byte(2)
    blank, blank3 = second <= ord(" "), third <= ord(" ")
    kind = np.full(first.size, _OTHER, np.uint8)
    is_v = first == ord("v")
    kind[is_v & blank] = _V
    kind[is_v & (second == ord("t")) & blank3] = _VT
    kind[is_v & (second == ord("n")) & blank3] = _VN
    kind[(first == ord("f")) & blank] = _F
    kind[(first == ord("\n")) | (first == ord("#"))] = _SKIP
    return kind


def _first_line(block: Block, chosen: Bools) -> int:
    return int(block.numbers[np.argmax(chosen)])


def _single(values: Doubles) -> Floats:
    with np.errstate(all="ignore"):  # too large becomes infinite, and is dealt with as such
        return values.astype(np.float32)


def _joined(
    parts: Iterable[npt.NDArray[Any]], kind: type[np.generic], tail: tuple[int, ...]
) -> npt.NDArray[Any]:
    return np.concatenate([np.zeros((0, *tail), kind), *parts])
