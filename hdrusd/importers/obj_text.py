"""The text of Wavefront files (.obj, .mtl): encoding, logical lines, numbers in bulk.

Lines are handled in blocks of a few megabytes as NumPy byte arrays, so the cost
of a line does not depend on how the statements are mixed. A block in which a
number is broken is converted once more, word by word.

Source: Alias|Wavefront, Advanced Visualizer manual, appendix B1 (object files).
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.number_text import decimals, wholes
from hdrusd.report import Kind, Report

Bytes = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.int64]
Doubles = npt.NDArray[np.float64]

_BLOCK = 1 << 22  # bytes: the work arrays of one block stay near the processor's cache
_LONGEST_LINE = 1 << 26  # bytes: what one statement may cost in memory is a multiple of it
_LINES_A_RUN = 8  # of one kind, on average: fewer are not worth a copy of each run
_BLANK = 32  # this and every control byte below it separate words
_NEWLINE, _SLASH, _JOINT = 10, 47, 11
_LINE_END = re.compile(rb"(?<!\\)\n")
_INDENT = re.compile(rb"(?m)^[\x01-\x09\x0b-\x20]+")
_COMMENT_TAIL = re.compile(rb"(?m)^([\x01-\x09\x0b-\x20]*#[^\n]*)\\$")
#: A word that begins with # ends the line; "1.#IND" is one word and a broken number.
_COMMENT = re.compile(rb"(?<=[ \t])#[^\n]*")


@dataclass(slots=True)
class Tally:
    """Counts what occurs by the thousand, so that it becomes one finding with its first line."""

    _seen: dict[tuple[str, str], list[int]] = field(default_factory=dict)

    def note(self, code: str, line: int, count: int = 1, thing: str = "") -> None:
        """Count ``count`` occurrences, of which ``line`` is one place."""
        entry = self._seen.setdefault((code, thing), [0, line])
        entry[0] += count
        entry[1] = min(entry[1], line)

    def report(self, report: Report, file: Path, texts: dict[str, tuple[Kind, str]]) -> None:
        """Write the findings: ``texts`` has the kind and the words for each code."""
        for (code, thing), (count, line) in self._seen.items():
            kind, text = texts[code]
            report.add(kind, code, SourceRef(file, line), thing, f"{count} {text}")


def shorten(name: str, limit: int = 64) -> str:
    """``name`` for a message: one that is endless is cut."""
    return name if len(name) <= limit else f"{name[:limit]}... ({len(name)} characters)"


def lines_of(raw: bytes, source: Path) -> bytes:
    """UTF-8 or Latin-1 bytes whose lines end in one line feed, from any mark and any line end.

    Raises InputError for binary data.
    """
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            raw = raw.decode("utf-16").encode()
        except UnicodeDecodeError as error:
            raise InputError(source, f"not the UTF-16 that it claims to be: {error}") from error
    raw = raw.removeprefix(codecs.BOM_UTF8)
    zero = raw.find(b"\0")
    if zero >= 0:
        raise InputError(source, f"binary data (a zero byte at offset {zero}); want text")
    if b"\r" in raw:
        raw = raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return raw if raw.endswith(b"\n") else raw + b"\n"


def decode(raw: bytes, tally: Tally, line: int) -> str:
    """A name as text; bytes that are not UTF-8 are taken as Latin-1 and counted."""
    try:
        return raw.decode()
    except UnicodeDecodeError:
        tally.note("encoding", line)
        return raw.decode("latin-1")


@dataclass(frozen=True, slots=True)
class Block:
    """Whole logical lines: continued ones joined, indentation gone."""

    text: bytes
    starts: Integers  # (lines,), offset of each
    lengths: Integers  # (lines,), with the line end
    numbers: Integers  # (lines,), line number in the file

    def line(self, index: int) -> bytes:
        """The bytes of one line, without its end."""
        start = int(self.starts[index])
        return self.text[start : start + int(self.lengths[index]) - 1]

    def byte(self, offset: int) -> Bytes:
        """The byte at ``offset`` of every line; of the next line where one is shorter."""
        buffer = np.frombuffer(self.text, np.uint8)
        return buffer[np.minimum(self.starts + offset, buffer.size - 1)]

    def arguments(self, chosen: Bools, keyword: int) -> Rows:
        """The bytes of the chosen lines with the first ``keyword`` bytes of each blanked."""
        buffer = np.frombuffer(self.text, np.uint8)
        turns = np.flatnonzero(np.diff(chosen, prepend=False, append=False))
        if turns.size * _LINES_A_RUN < chosen.size:  # mostly they stand together
            bounds = np.append(self.starts, buffer.size)[turns].reshape(-1, 2).tolist()
            text = np.concatenate([buffer[begin:end] for begin, end in bounds])
        else:
            text = buffer[np.repeat(chosen, self.lengths)]
        lengths = self.lengths[chosen]
        starts = np.cumsum(lengths) - lengths
        for offset in range(keyword):
            text[starts + offset] = _BLANK
        return Rows(text, starts)


def blocks(data: bytes, source: Path, size: int = _BLOCK) -> Iterator[Block]:
    """``lines_of`` bytes as blocks of about ``size`` bytes.

    Raises InputError for a line that no program wrote.
    """
    start, number = 0, 1
    while start < len(data):
        match = _LINE_END.search(data, min(start + size, len(data)) - 1)
        end = match.end() if match else len(data)
        if end - start > size + _LONGEST_LINE:
            place = SourceRef(source, number + data.count(b"\n", start, start + size))
            raise InputError(place, f"a line of more than {_LONGEST_LINE} bytes")
        yield _block(data[start:end], number)
        number += data.count(b"\n", start, end)
        start = end


def _block(text: bytes, number: int) -> Block:
    joined = b"\\\n" in text
    if joined:
        text = _COMMENT_TAIL.sub(rb"\1 ", text)  # "# C:\dir\" is not continued
        text = text.replace(b"\\\n", b" \v")
    if not text.endswith(b"\n"):
        text += b"\n"
    starts, lengths = _line_table(text)
    numbers = number + np.arange(starts.size)
    buffer = np.frombuffer(text, np.uint8)
    if joined:
        numbers += np.searchsorted(np.flatnonzero(buffer == _JOINT), starts)
    first = buffer[starts]
    if np.any((first <= _BLANK) & (first != _NEWLINE)):
        text = _INDENT.sub(b"", text)
        starts, lengths = _line_table(text)
    return Block(text, starts, lengths, numbers)


def _line_table(text: bytes) -> tuple[Integers, Integers]:
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == _NEWLINE) + 1
    starts = np.concatenate([[0], ends[:-1]])
    return starts, ends - starts


class Rows(NamedTuple):
    """Lines of words: bytes, and where each line starts."""

    text: Bytes
    starts: Integers


def floats(rows: Rows) -> tuple[Doubles, Integers, int]:
    """Every word as a number: values in file order, words per line, decimal commas mended.

    A word that is not a number becomes NaN; 1e400 becomes infinite.
    """
    rows = _without_comments(rows)
    blank = rows.text <= _BLANK
    counts = _per_line(np.flatnonzero(_first(blank)), rows)
    values = decimals(rows.text.tobytes())
    if values is not None and values.size == counts.sum():
        return values, counts, 0
    words = [line.split() for line in rows.text.tobytes().split(b"\n")[:-1]]
    mended = [to_float(word.decode("latin-1")) for line in words for word in line]
    values = np.array([value for value, _ in mended], np.float64)
    counts = np.array([len(line) for line in words], np.int64)
    return values, counts, sum(comma for _, comma in mended)


def to_float(word: str) -> tuple[float, bool]:
    """One word as a number (NaN if it is none), and whether a decimal comma was mended.

    3ds Max writes commas where the system's language does.
    """
    comma = word.count(",") == 1 and "." not in word
    try:
        value = math.nan if "_" in word else float(word.replace(",", ".") if comma else word)
    except ValueError:
        return math.nan, False
    return value, comma


def columns(values: Doubles, counts: Integers, width: int) -> Doubles:
    """The first ``width`` numbers of each line, (lines, width); NaN where a line is shorter."""
    if values.size == width * counts.size and bool(np.all(counts == width)):
        return values.reshape(-1, width)
    column = np.arange(width)
    index = (np.cumsum(counts) - counts)[:, None] + column
    present = column < counts[:, None]
    table = np.full(present.shape, np.nan)
    table[present] = values[index[present]]
    return table


def corners(rows: Rows) -> tuple[Integers, Integers]:
    """Face corners ``v``, ``v/t``, ``v//n``, ``v/t/n``, mixed at will.

    Returns (corners, 3) indices as written, 0 where absent or not an index, and
    the corners per line.
    """
    rows = _without_comments(rows)
    text = rows.text
    blank, slash = text <= _BLANK, text == _SLASH
    corner_at = np.flatnonzero(_first(blank))
    number_at = np.flatnonzero(_first(blank | slash))
    counts = _per_line(corner_at, rows)
    values = wholes(text.tobytes().replace(b"/", b" "))
    if values is None or values.size != number_at.size:
        return _corners_by_word(text.tobytes())
    slash_at = np.flatnonzero(slash)
    slots = _alike(corner_at, number_at, slash_at)
    if slots == (0, 1, 2):
        return values.reshape(-1, 3), counts
    table = np.zeros((corner_at.size, 3), np.int64)
    if slots:
        table[:, slots] = values.reshape(-1, len(slots))
        return table, counts
    owner = np.searchsorted(corner_at, number_at, side="right") - 1
    slot = np.searchsorted(slash_at, number_at) - np.searchsorted(slash_at, corner_at)[owner]
    good = slot < 3
    table[owner[good], slot[good]] = values[good]
    table[owner[~good]] = 0
    return table, counts


def _alike(corner_at: Integers, number_at: Integers, slash_at: Integers) -> tuple[int, ...]:
    """Which indices all corners have, if all are written the same way; else nothing."""
    corners = corner_at.size
    if not corners:
        return ()
    for slots, slashes in (((0, 1, 2), 2), ((0, 2), 2), ((0, 1), 1), ((0,), 0)):
        if number_at.size != len(slots) * corners or slash_at.size != slashes * corners:
            continue
        number, slash = number_at.reshape(corners, -1), slash_at.reshape(corners, -1)
        good = np.array_equal(number[:, 0], corner_at)
        for column, slot in enumerate(slots[1:], 1):
            good = good and np.array_equal(slash[:, slot - 1] + 1, number[:, column])
        if slots == (0, 2):
            good = good and np.array_equal(slash[:, 0] + 1, slash[:, 1])
        if good:
            return slots
    return ()


def _corners_by_word(text: bytes) -> tuple[Integers, Integers]:
    words = [line.split() for line in text.split(b"\n")[:-1]]
    table = np.array([_corner(word) for line in words for word in line], np.int64)
    return table.reshape(-1, 3), np.array([len(line) for line in words], np.int64)


def _corner(word: bytes) -> tuple[int, int, int]:
    parts = word.split(b"/")
    try:
        indices = [int(part) if part else 0 for part in parts]
    except ValueError:
        return 0, 0, 0
    largest = 1 << 62
    if len(indices) > 3 or b"_" in word or any(abs(index) > largest for index in indices):
        return 0, 0, 0
    v, t, n = (*indices, 0, 0)[:3]
    return v, t, n


def _without_comments(rows: Rows) -> Rows:
    text = rows.text.tobytes()
    if b"#" not in text:
        return rows
    text = _COMMENT.sub(b"", text)
    return Rows(np.frombuffer(text, np.uint8), _line_table(text)[0])


def _first(blank: Bools) -> Bools:
    """Where a word begins, given where there is none."""
    first = ~blank
    first[1:] &= blank[:-1]
    return first


def _per_line(word_at: Integers, rows: Rows) -> Integers:
    lines = rows.starts.size
    width, rest = divmod(word_at.size, max(lines, 1))
    if width and not rest:
        words = word_at.reshape(lines, width)
        if (words[:, 0] >= rows.starts).all() and (words[:-1, -1] < rows.starts[1:]).all():
            return np.full(lines, width, np.int64)
    bounds = np.append(rows.starts, rows.text.size)
    return np.diff(np.searchsorted(word_at, bounds)).astype(np.int64)
