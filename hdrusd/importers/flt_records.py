"""The records of an OpenFlight file: found once, with their levels, and read without belief.

A file is a row of records, each with an operation code and a length of 16 bits, big
endian. A node's children stand between a push and a pop; what belongs to the node
itself (matrix, comment, long name) follows it on its own level. What does not fit into
65,535 bytes goes on in continuation records.

Source: OpenFlight Scene Description Database Specification 16.5 (Presagis, 2016),
chapters "OpenFlight Concepts" and "OpenFlight Record Types"; the numbers of records in
this package are its operation codes.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.flt_walk import walk
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.report import Kind, Report

Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]

HEADER, GROUP, OBJECT, FACE, DOF = 1, 2, 4, 5, 14
PUSH, POP, PUSH_SUBFACE, POP_SUBFACE = 10, 11, 19, 20
CONTINUATION, COMMENT, LONG_ID = 23, 31, 33
REPLICATE, INSTANCE, DEFINITION, EXTERNAL = 60, 61, 62, 63
VERTEX_PALETTE, VERTEX_LIST, LOD = 67, 72, 73
MESH, MESH_VERTICES, MESH_PRIMITIVE, MORPH_LIST, SWITCH = 84, 85, 86, 89, 96
EXTENSION, LIGHT_SOURCE, LIGHT_POINT = 100, 101, 111
INDEXED_LIGHT_POINT, LIGHT_POINT_SYSTEM, INDEXED_STRING = 130, 131, 132

_PUSHES = (PUSH, PUSH_SUBFACE, 21, 122)
_POPS = (POP, POP_SUBFACE, 22, 123)
#: Records that may have children. Old beads, BSP, sound, road, path, text, clip region, CAT,
#: curve and road construction are among them.
NODES = frozenset(
    {HEADER, GROUP, 3, OBJECT, DOF, 55, INSTANCE, DEFINITION, EXTERNAL, LOD, MESH, 87, 91, 92, 95}
    | {SWITCH, 98, EXTENSION, LIGHT_SOURCE, LIGHT_POINT, 115, 126, 127}
    | {INDEXED_LIGHT_POINT, LIGHT_POINT_SYSTEM}
)

#: Bytes of a header and of the largest record of fixed size that is read as an array.
_HEADER = struct.Struct(">HH")
PADDING = 128

#: The oldest and newest revision whose layouts are known.
_OLDEST, _NEWEST = 1420, 1699

#: Vertex coordinate units to metres.
_UNITS = {0: 1.0, 1: 1000.0, 4: 0.3048, 5: 0.0254, 8: 1852.0}

#: USD and the GPU hold numbers as float32.
_LARGEST = float(np.finfo(np.float32).max)


@dataclass(slots=True)
class Records:
    """Where the records of a file are. Arrays of one length; continuations are not among them.

    ``at``: byte of each; ``op``; ``size`` with the header; ``level``: of nesting;
    ``subface``: levels of them that are subfaces.
    """

    at: Integers
    op: npt.NDArray[np.uint16]
    size: Integers
    level: npt.NDArray[np.int32]
    subface: npt.NDArray[np.int32]
    opener: Integers  # the push that each record stands behind, -1 at the top
    parent: Integers  # the node or face that has each record in its block, -1 at the top
    continued: dict[int, list[int]]  # record to the bytes where it goes on

    def of(self, *ops: int) -> Integers:
        """The numbers of the records with one of these codes, in the file's order."""
        return np.flatnonzero(np.isin(self.op, ops))

    def before(self, candidates: Integers, records: Integers) -> Integers:
        """For each record the last of the candidates before it in the same block, or -1.

        So what belongs to a node, or is put between its children, finds the node.
        """
        wide = len(self.at) + 1
        keys = self.level[candidates].astype(np.int64) * wide + candidates
        order = np.argsort(keys, kind="stable")
        level = self.level[records].astype(np.int64)
        place = np.searchsorted(keys[order], level * wide + records) - 1
        if not len(candidates):
            return np.full(len(records), -1, np.int64)
        found = np.where(place >= 0, candidates[order][np.maximum(place, 0)], -1)
        fits = (found > self.opener[records]) & (self.level[np.maximum(found, 0)] == level)
        return np.where(fits, found, -1)


class Grouped:
    """Values by their keys: finds those of one key without looking at the others."""

    def __init__(self, keys: Integers, values: Integers) -> None:
        order = np.argsort(keys, kind="stable")
        self.keys, self.values = keys[order], values[order]

    def __getitem__(self, key: int) -> Integers:
        """The values of a key, in their order; none where it has none."""
        low, high = np.searchsorted(self.keys, [key, key + 1])
        return self.values[low:high]


@dataclass(slots=True)
class Document:
    """One file. ``data`` ends with ``PADDING`` zeros, so that no array reads past it."""

    file: Path
    report: Report
    limits: Limits
    resolver: Resolver
    data: bytes
    buffer: Bytes
    records: Records
    version: int
    unit_m: float
    unit_stated: bool = True

    def ref(self, record: int) -> SourceRef:
        """Where a record stands."""
        return SourceRef(self.file, f"byte {int(self.records.at[record])}")

    def add(self, kind: Kind, code: str, record: int, thing: str, text: str) -> None:
        """A finding about a record."""
        self.report.add(kind, code, self.ref(record), thing, text)

    def body(self, record: int) -> bytes:
        """All bytes of a record, its header among them, continuations joined."""
        at, size = int(self.records.at[record]), int(self.records.size[record])
        whole = self.data[at : at + size]
        for more in self.records.continued.get(record, ()):
            length = _HEADER.unpack_from(self.data, more)[1]
            whole += self.data[more + 4 : more + length]
        return whole

    def integers(self, record: int, offset: int, layout: str) -> tuple[int, ...]:
        """Whole numbers by ``struct`` letters; what a short record does not have is 0."""
        form = struct.Struct(f">{layout}")
        at = int(self.records.at[record]) + offset
        if offset + form.size > int(self.records.size[record]):
            body = self.body(record)[offset:]
            return form.unpack_from(body + bytes(form.size))
        return form.unpack_from(self.data, at)

    def numbers(
        self, record: int, offset: int, layout: str, default: tuple[float, ...], thing: str = ""
    ) -> tuple[float, ...]:
        """Finite numbers; the default, with a finding if they are there and not finite."""
        form = struct.Struct(f">{layout}")
        if offset + form.size > int(self.records.size[record]):
            return default
        found = form.unpack_from(self.data, int(self.records.at[record]) + offset)
        if all(abs(value) <= _LARGEST for value in found):  # False for NaN
            return found
        text = f"op {int(self.records.op[record])}, bytes {offset} on: not finite; "
        shown = ", ".join(f"{value:g}" for value in default)
        self.add(Kind.INVALID, "flt-number", record, thing, f"{text}{shown} is used")
        return default

    def text(self, record: int, offset: int = 4, length: int | None = None) -> str:
        """A text that ends with a zero byte, or with the record."""
        body = self.body(record)
        end = len(body) if length is None else min(offset + length, len(body))
        return decoded(body[offset:end])


def decoded(raw: bytes) -> str:
    """A text of a fixed field: up to its first zero byte, UTF-8 or else Latin-1."""
    raw = raw.partition(b"\0")[0]
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()


def load(resolver: Resolver, report: Report) -> Document:
    """Read and index a file. Raises InputError for what is no OpenFlight, or cut short."""
    source = resolver.source
    data = resolver.read()
    if not data:
        raise InputError(source, "empty file; want an OpenFlight database")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(source, "a Git LFS pointer instead of the file; want the file itself")
    if len(data) < 64 or _HEADER.unpack_from(data)[0] != HEADER:
        raise InputError(source, "no header record; want an OpenFlight database")
    version = struct.unpack_from(">i", data, 12)[0]
    if version < _OLDEST:
        text = f"OpenFlight revision {version}; want {_OLDEST} (14.2) or later"
        raise InputError(SourceRef(source, "byte 12"), text)
    if version > _NEWEST:
        text = f"OpenFlight revision {version}; read as 16"
        report.add(Kind.ASSUMED, "flt-version", SourceRef(source, "byte 12"), "", text)
    unit = data[62]
    if unit not in _UNITS and "unit" not in resolver.stated:
        text = f"vertex coordinate unit {unit}; want 0, 1, 4, 5 or 8; metres are used"
        report.add(Kind.ASSUMED, "flt-unit", SourceRef(source, "byte 62"), "", text)
    places = walk(data, source)
    data += bytes(PADDING)
    buffer = np.frombuffer(data, np.uint8)
    records = _indexed(buffer, places, source, report, resolver.limits)
    unit_m = _UNITS.get(unit, 1.0)
    return Document(
        *(source, report, resolver.limits, resolver, data, buffer, records, version),
        unit_m=unit_m,
        unit_stated=unit in _UNITS,
    )


def _indexed(
    buffer: Bytes,
    at: Integers,
    source: Path,
    report: Report,
    limits: Limits,
) -> Records:
    op = np.asarray(buffer[at].astype(np.uint16) << 8 | buffer[at + 1], np.uint16)
    goes_on = op == CONTINUATION
    continuations = at[goes_on].tolist()
    at, op = at[~goes_on], op[~goes_on]
    size = buffer[at + 2].astype(np.int64) << 8 | buffer[at + 3]
    push, pop = np.isin(op, _PUSHES), np.isin(op, _POPS)
    level = np.cumsum(push, dtype=np.int32) - np.cumsum(pop, dtype=np.int32)
    lowest = int(level.min(initial=0))
    if lowest < 0:
        first = int(at[np.flatnonzero(level < 0)[0]])
        text = f"{-lowest} pops more than pushes; left out"
        report.add(Kind.INVALID, "flt-levels", SourceRef(source, f"byte {first}"), "", text)
        level -= np.minimum(np.minimum.accumulate(level), 0)
    if int(level.max(initial=0)) > limits.depth:
        first = int(at[np.flatnonzero(level > limits.depth)[0]])
        raise InputError(SourceRef(source, f"byte {first}"), f"nested deeper than {limits.depth}")
    level -= push.astype(np.int32)  # a push stands on the level that it leaves
    # Below 0 where the file pops more than it pushes.
    subface = np.cumsum(op == PUSH_SUBFACE, dtype=np.int32) - np.cumsum(
        op == POP_SUBFACE, dtype=np.int32
    )
    subface = np.clip(subface, 0, limits.depth).astype(np.int32)
    nowhere = np.full(len(at), -1, np.int64)
    made = Records(at, op, size, level, subface, nowhere, nowhere.copy(), {})
    numbers = np.arange(len(at))
    pushes = np.flatnonzero(push)
    keys = level[pushes].astype(np.int64) * (len(at) + 1) + pushes
    order = np.argsort(keys, kind="stable")
    wanted = (level.astype(np.int64) - 1) * (len(at) + 1) + numbers
    place = np.searchsorted(keys[order], wanted) - 1
    inside = (level > 0) & (place >= 0)
    made.opener[inside] = pushes[order][place[inside]]
    # A push without a node before it, as some files have, opens a block of the node above.
    owner = np.full(len(at), -1, np.int64)
    owner[pushes] = made.before(made.of(FACE, *NODES), pushes)
    homeless = pushes[(owner[pushes] < 0) & (made.opener[pushes] >= 0)]
    for number in homeless.tolist():  # in order: the push around it has its owner already
        owner[number] = owner[made.opener[number]]
    made.parent[inside] = owner[made.opener[inside]]
    for more in continuations:  # of the record before it
        before = int(np.searchsorted(at, np.int64(more))) - 1
        made.continued.setdefault(before, []).append(more)
    return made
