"""The nodes of an OpenFlight file: what each says for itself, and what belongs to it.

Source: OpenFlight Specification 16.5, "Node Primary Records", "Ancillary Records".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hdrusd.importers.flt_records import (
    COMMENT,
    DEFINITION,
    DOF,
    EXTERNAL,
    FACE,
    GROUP,
    HEADER,
    INDEXED_STRING,
    INSTANCE,
    LOD,
    LONG_ID,
    MESH,
    NODES,
    OBJECT,
    REPLICATE,
    SWITCH,
    Document,
    Integers,
)
from hdrusd.importers.flt_transforms import TRANSFORMS, Doubles, degrees_of_freedom, read_transform
from hdrusd.report import Kind

#: Records that are read, or that only repeat what others say: bounding volumes, and the
#: palette's vertices.
_READ = frozenset(
    {10, 11, 19, 20, 21, 22, 122, 123, 5, 51, 60, 63, 66, 67, 68, 69, 70, 71, 72, 74, 89}
    | {31, 32, 33, 64, 84, 85, 86, 102, 105, 106, 107, 108, 109, 110, 111, 113, 119, 128, 129, 132}
    | {*TRANSFORMS, *NODES}
)
#: Records without a home, by name.
_DROPPED = {
    7: "vertices of old revisions",
    8: "vertices of old revisions",
    9: "vertices of old revisions",
    50: "vectors",
    52: "further texture layers",
    53: "coordinates of further texture layers",
    65: "eyepoints and trackplanes",
    83: "eyepoints and trackplanes",
    88: "road zones",
    90: "linkages",
    93: "sounds",
    97: "line styles",
    112: "texture mappings",
    114: "names of colours",
    116: "data of a continuously adaptive terrain",
    133: "shaders",
}
#: Nodes without a meaning here; their children are kept.
_OTHER_NODES = {
    3: "level of detail of an old revision",
    55: "separating plane",
    87: "road segment",
    91: "sound",
    92: "road path",
    95: "text",
    98: "clip region",
    100: "extension",
    115: "continuously adaptive terrain",
    126: "curve",
    127: "road construction",
}
_UNNAMED = {HEADER: "db", EXTERNAL: "external", INSTANCE: "instance", DEFINITION: "definition"}

_FORWARD, _SWING, _BACKWARD = 0x40000000, 0x20000000, 0x02000000
_NOT_AT = (("day", 0x80000000), ("dusk", 0x40000000), ("night", 0x20000000))
_NOT_ILLUMINATED = 0x10000000
_ALWAYS = (0.0, float(np.finfo(np.float32).max))

_COMMENTED = 4096  # characters of a comment that are kept
Flags = npt.NDArray[np.bool_]

_WORDS = 1024  # words of a switch mask that are read: 32,768 children
_BITS = 1 << 16  # of all masks of a switch that are kept beside the current one


@dataclass(slots=True)
class Description:
    """One node: the fields of ``legacy.scene.Node``, and where it stands."""

    record: int
    op: int
    name: str
    transform: Doubles | None = None
    copies: int = 0  # further ones, each moved by ``transform`` from the one before
    visible: bool = True
    kind: Literal["group", "switch", "sequence"] = "group"
    lod: tuple[tuple[float, float], tuple[float, ...]] | None = None  # range, centre
    extras: dict[str, Any] = field(default_factory=dict)


@dataclass(slots=True)
class Masks:
    """What a switch shows of its children: (n,) by the current mask, and by each, with names."""

    current: Flags
    every: list[Flags] = field(default_factory=list)
    names: list[str] = field(default_factory=list)


class NodeReader:
    """Describes the nodes of one file."""

    def __init__(self, document: Document) -> None:
        self.document = document
        records = document.records
        self._long: dict[int, int] = {}
        self._comments: dict[int, list[int]] = {}
        self._transforms: dict[int, list[int]] = {}
        self._copies: dict[int, int] = {}
        self._mask_names: dict[int, dict[int, str]] = {}  # of each switch, by number
        self._ancillaries()
        moved = {r for r in (*self._transforms, *self._copies) if records.op[r] in (FACE, MESH)}
        self.moved_faces = np.array(sorted(moved), np.int64)
        nodes = records.of(*(NODES - {MESH}))
        #: Records that become nodes: those of the format, and faces that stand elsewhere.
        self.records: Integers = np.sort(np.concatenate([nodes, self.moved_faces]))
        self._dropped()

    def _ancillaries(self) -> None:
        """What belongs to which node; of faces only where they stand."""
        document, records = self.document, self.document.records
        wanted = records.of(COMMENT, LONG_ID, REPLICATE, INDEXED_STRING, *TRANSFORMS)
        holder = records.before(records.of(FACE, *NODES), wanted)
        holder = np.where(holder >= 0, holder, records.parent[wanted])
        holder = np.maximum(holder, 0)  # before any node: the header's
        op, face = records.op[wanted], np.isin(records.op[holder], (FACE, MESH))
        for code, what in ((COMMENT, "comments"), (LONG_ID, "names")):
            lost = wanted[face & (op == code)]
            if len(lost):
                text = f"{len(lost)} {what} of faces; dropped, as meshes are made of many faces"
                document.add(Kind.DROPPED, "flt-face-names", int(lost[0]), "", text)
        kept = ~face | np.isin(op, (REPLICATE, *TRANSFORMS))
        for record, owner, code in zip(
            wanted[kept].tolist(), holder[kept].tolist(), op[kept].tolist(), strict=True
        ):
            if code == COMMENT:
                self._comments.setdefault(owner, []).append(record)
            elif code == LONG_ID:
                self._long[owner] = record
            elif code == INDEXED_STRING:
                (number,) = document.integers(record, 4, "I")
                self._mask_names.setdefault(owner, {})[number] = document.text(record, 8)
            elif code == REPLICATE:
                self._copies[owner] = max(document.integers(record, 4, "h")[0], 0)
            else:
                self._transforms.setdefault(owner, []).append(record)

    def _dropped(self) -> None:
        """One finding for each kind of record that has no home."""
        document, op = self.document, self.document.records.op
        codes, first, count = np.unique(op, return_index=True, return_counts=True)
        for code, record, number in zip(
            codes.tolist(), first.tolist(), count.tolist(), strict=True
        ):
            if code not in _READ:
                what = _DROPPED.get(code, "unknown")
                text = f"records {code}, {what}: {number}, this is the first; dropped"
                document.add(Kind.DROPPED, "flt-record", record, "", text)

    def name(self, record: int) -> str:
        """The long name of a node, else its short one, else what it is."""
        op = int(self.document.records.op[record])
        if record in self._long:
            found = self.document.text(self._long[record])
            if found:
                return found
        short = "" if op in _UNNAMED and op != HEADER else self.document.text(record, 4, 8)
        return short or _UNNAMED.get(op, "node")

    def describe(self, record: int) -> Description:
        """What a node says."""
        document = self.document
        op, name = int(document.records.op[record]), self.name(record)
        made = Description(record, op, name)
        parts = self._transforms.get(record, ())
        made.transform = read_transform(document, list(parts), name) if parts else None
        made.copies = self._copies.get(record, 0)
        if made.copies and made.transform is None:
            text = f"{made.copies} copies in the same place; left out"
            document.add(Kind.DROPPED, "flt-replicate", record, name, text)
            made.copies = 0
        if record in self._comments:
            texts = (document.text(comment) for comment in self._comments[record])
            made.extras["comment"] = "\n".join(texts)[:_COMMENTED]
        if op == HEADER:
            self._header(made)
        elif op == GROUP:
            self._group(made)
        elif op == OBJECT:
            self._object(made)
        elif op == DOF:
            local = degrees_of_freedom(document, record, name)
            if local is not None:
                made.transform = local if made.transform is None else local @ made.transform
        elif op == LOD:
            self._lod(made)
        elif op == SWITCH:
            made.kind = "switch"
        elif op in _OTHER_NODES:
            text = f"{_OTHER_NODES[op]} (record {op}); its children are kept"
            document.add(Kind.DROPPED, "flt-node", record, name, text)
        return made

    def _header(self, made: Description) -> None:
        document = self.document
        made.extras["revision"] = document.version
        latitude, longitude = document.numbers(made.record, 220, "2d", (0.0, 0.0), made.name)
        if latitude or longitude:
            made.extras["origin"] = {"latitude": latitude, "longitude": longitude}

    def _group(self, made: Description) -> None:
        (flags,) = self.document.integers(made.record, 16, "I")
        old = self.document.version < 1580  # the swing bit alone moved it, and never backwards
        if flags & (_FORWARD | (_SWING if old else _BACKWARD)):
            made.kind = "sequence"
            text = "children are shown one after the other; the first is selected"
            self.document.add(Kind.REPLACED, "flt-sequence", made.record, made.name, text)

    def _object(self, made: Description) -> None:
        (flags,) = self.document.integers(made.record, 12, "I")
        absent = tuple(word for word, flag in _NOT_AT if flags & flag)
        if not absent:
            return
        made.extras["not_at"] = absent
        made.visible = "night" not in absent
        there = "there" if made.visible else "hidden"
        text = f"not displayed at {', '.join(absent)}; the stage is the night, where it is {there}"
        self.document.add(Kind.ASSUMED, "flt-day-night", made.record, made.name, text)

    def _lod(self, made: Description) -> None:
        document, record = self.document, made.record
        far, near = document.numbers(record, 16, "2d", (0.0, 0.0), made.name)
        center = document.numbers(record, 40, "3d", (0.0, 0.0, 0.0), made.name)
        if not 0.0 <= near < far:
            if (near, far) != (0.0, 0.0):
                text = f"in range from {near:g} to {far:g}; taken as always in range"
                document.add(Kind.INVALID, "flt-lod-range", record, made.name, text)
            near, far = _ALWAYS
        made.lod = (near, far), center
        made.extras["range"] = near, far

    def masks(self, record: int, children: int) -> Masks:
        """Which children of a switch each mask has; bit 0 is the first."""
        document, name = self.document, self.name(record)
        current, masks, words = document.integers(record, 16, "3I")
        read = min(words, _WORDS, math.ceil(children / 32))
        at = 28 + 4 * current * words
        body = document.body(record)
        if current >= masks or at + 4 * read > len(body):
            text = f"mask {current} of {masks} with {words} words is not there; all is on"
            document.add(Kind.INVALID, "flt-switch", record, name, text)
            return Masks(np.ones(children, np.bool_))
        found = Masks(_bits(body, at, read, children))
        there = min(masks, (len(body) - 28) // (4 * words)) if words else 0
        if masks > 1 and there * children <= _BITS:
            found.every = [
                _bits(body, 28 + 4 * number * words, read, children) for number in range(there)
            ]
            given = self._mask_names.get(record, {})
            found.names = [given.get(number) or f"mask{number}" for number in range(there)]
        elif masks > 1:
            text = f"{masks} masks of {children} children; the current one, {current}, is kept"
            document.add(Kind.DROPPED, "flt-switch-masks", record, name, text)
        return found

    def object_flags(self, records: Integers) -> tuple[Integers, Integers]:
        """Of some records the transparency (0 to 255) and whether not illuminated; 0 of others."""
        different, row = np.unique(records, return_inverse=True)
        found = np.zeros((2, len(different)), np.int64)
        for number, record in enumerate(different.tolist()):
            if record >= 0 and self.document.records.op[record] == OBJECT:
                flags, _, clear = self.document.integers(record, 12, "IhH")
                found[:, number] = (clear * 255 + 32767) // 65535, bool(flags & _NOT_ILLUMINATED)
        return found[0][row], found[1][row]


def _bits(body: bytes, at: int, words: int, count: int) -> Flags:
    """(count,) bits of a mask, the lowest of the first word first; off past its end."""
    bits = np.frombuffer(body[at : at + 4 * words], ">u4")
    on = ((bits[:, None] >> np.arange(32, dtype=np.uint32)) & 1).astype(np.bool_).ravel()[:count]
    return np.concatenate([on, np.zeros(count - len(on), np.bool_)])
