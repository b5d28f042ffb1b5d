"""Where the records of an OpenFlight file begin, found many at a time.

Each record says only how long it is, so that the next one is known when it has been
read: a chain of a million links. But most of them stand right behind a push, whose four
bytes hardly ever occur elsewhere. So walkers start at all that looks like a push, go
from record to record side by side until each comes upon another's start, and the chain
is then followed from start to start. What none of them has reached is walked one by one,
and only what the chain from the first record reaches counts: a guess may be wrong, the
result is not.
"""

from __future__ import annotations

import struct
from array import array
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef

Integers = npt.NDArray[np.int64]

_HEADER = struct.Struct(">HH")
_VERTEX_PALETTE = 67

#: A push, with and without padding: what walkers start from.
_STARTS = (b"\x00\x0a\x00\x04", b"\x00\x0a\x00\x08")

#: Records that a walker passes at most before it is given up.
_STEPS = 64

#: After so many stretches between starts they must have this many records on average.
_TRIED, _WORTH = 10_000, 8

#: More records than a database of 2 GiB has; an index of them is held in memory.
_MOST_RECORDS = 50_000_000


def walk(data: bytes, source: Path) -> Integers:
    """The byte of every record, in order, without the vertices of a palette. Raises InputError."""
    runs = _runs(data)
    places: array[int] = array("q")
    parts: list[Integers] = []
    at, end, count = 0, len(data), 0
    while at < end:
        if runs is not None and data[at : at + 4] in _STARTS:
            goal = runs.starting(at)
            if goal is not None:  # from start to start as long as they lead to one another
                parts += [np.frombuffer(places, np.int64), runs.between(at)]
                places = array("q")
                count += len(parts[-1])
                at = goal
                if len(parts) > 2 * _TRIED and count < len(parts) * _WORTH:
                    runs = None
                continue
        op, size = _HEADER.unpack_from(data[at : at + 4].ljust(4, b"\0"))
        if size < 4 or at + size > end:
            if _only_zeros(data, at):
                break  # they fill up the last block
            place = SourceRef(source, f"byte {at}")
            want = f"want 4 to {end - at}, what is left of the file"
            raise InputError(place, f"record {op} of length {size}; {want}")
        places.append(at)
        at += _past_vertices(data, at) if op == _VERTEX_PALETTE else size
        count += 1
        if count > _MOST_RECORDS:
            raise InputError(SourceRef(source, f"byte {at}"), f"more than {_MOST_RECORDS} records")
    return np.concatenate([*parts, np.frombuffer(places, np.int64)])


def _only_zeros(data: bytes, at: int) -> bool:
    """Whether nothing but zeros is left."""
    return not any(data[at : at + 4096]) and not data[at:].strip(b"\0")


def _runs(data: bytes) -> _Runs | None:
    """The walkers; None where there is nothing to start from, or they lose their way."""
    first = next((at for at in map(data.find, _STARTS) if at >= 0), None)
    if first is None:
        return None
    try:
        return _Runs(data, first % 4)
    except _LostError:
        return None


def _past_vertices(data: bytes, at: int) -> int:
    """Bytes of a vertex palette with its vertices, if there is a record behind them."""
    (length,) = struct.unpack_from(">I", data[at + 4 : at + 8] + bytes(4))
    after = at + length
    if length >= 8 and after + 4 <= len(data):
        op, size = _HEADER.unpack_from(data, after)
        if 1 <= op <= 150 and size >= 4 and after + size <= len(data):
            return int(length)
    return int(length) if length >= 8 and after == len(data) else 8


class _LostError(Exception):
    """Walkers have passed more records than the file can have: the starts are none."""


class _Runs:
    """The walkers of a file, and where they came. ``phase``: of the starts' bytes, modulo 4."""

    def __init__(self, data: bytes, phase: int) -> None:
        words = np.frombuffer(data, ">u4", (len(data) - phase) // 4, phase)
        first, second = (int.from_bytes(start, "big") for start in _STARTS)
        self.start: Integers = np.flatnonzero((words == first) | (words == second)) * 4 + phase
        buffer = np.frombuffer(data, np.uint8)
        is_start = np.zeros(len(data) + 4, np.bool_)
        is_start[self.start] = True
        count = len(self.start)
        at = self.start.copy()
        who = np.arange(count)
        self.goal = np.full(count, -1, np.int64)  # the byte where each comes upon a start
        seen_at, seen_by = [], []
        left = len(data) // 4
        for _ in range(_STEPS):
            inside = at + 4 <= len(data)
            who, at = who[inside], at[inside]
            if not len(who):
                break
            size = buffer[at + 2].astype(np.int64) << 8 | buffer[at + 3]
            palette = (buffer[at] == 0) & (buffer[at + 1] == _VERTEX_PALETTE)
            good = (size >= 4) & (at + size <= len(data)) & ~palette
            who, at, size = who[good], at[good], size[good]
            left -= len(at)
            if left < 0:
                raise _LostError
            seen_at.append(at)
            seen_by.append(who)
            at = at + size
            arrived = is_start[at]
            self.goal[who[arrived]] = at[arrived]
            who, at = who[~arrived], at[~arrived]
        every_at = np.concatenate([*seen_at, np.zeros(0, np.int64)])
        every_by = np.concatenate([*seen_by, np.zeros(0, np.int64)])
        order = np.argsort(every_by, kind="stable")  # of each walker, in its order
        self._at, by = every_at[order], every_by[order]
        self._first = np.searchsorted(by, np.arange(count + 1))
        # The last start that each reaches through its neighbours: where one does not end at
        # the very next start, the stretch ends.
        joined = np.zeros(count, np.bool_)
        joined[:-1] = self.goal[:-1] == self.start[1:]
        broken = np.flatnonzero(~joined)
        self._end = broken[np.searchsorted(broken, np.arange(count))] if count else broken

    def starting(self, at: int) -> int | None:
        """Where the walkers from a byte on come to; None where none starts there."""
        number = int(np.searchsorted(self.start, at))
        if number >= len(self.start) or self.start[number] != at:
            return None
        end = int(self._end[number])
        if end > number:
            return int(self.start[end])
        goal = int(self.goal[number])
        return goal if goal >= 0 else None

    def between(self, at: int) -> Integers:
        """The records from a start to the start that ``starting`` told."""
        number = int(np.searchsorted(self.start, at))
        last = max(int(self._end[number]), number + 1)
        return self._at[self._first[number] : self._first[last]]
