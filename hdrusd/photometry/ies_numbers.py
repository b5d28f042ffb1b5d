"""The numbers of an IES LM-63 file, whatever stands between them, and where each is said."""

from __future__ import annotations

import re
from itertools import islice

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.luminaire import Doubles
from hdrusd.report import Kind, Report

_WORD = re.compile(r"[^\s,]+")

#: A comma that is a separator to LM-63, and to some who write it the decimal sign.
_COMMA = re.compile(r"\d,\d")
_COMMAS = re.compile(r"\d,[^\s,]+,\d")

#: What ``luminaire.checked`` calls the parts.
_PARTS = {"planes": "horizontal angles", "angles": "vertical angles"}


class Numbers:
    """The numbers after the TILT line, one after the other, whatever stands between them.

    ``place``: of the first line of ``text``.
    """

    def __init__(self, text: str, place: SourceRef) -> None:
        self.text = text
        self.words = _WORD.finditer(text)
        self.place = place
        self.starts: dict[str, int] = {}

    def at(self, part: str, index: int = 0) -> SourceRef:
        """The line of the ``index``-th number of a part, or of the part after it."""
        return self._line(self._offset(part, index))

    def _offset(self, part: str, index: int) -> int:
        start = self.starts.get(_PARTS.get(part, part), 0)
        word = next(islice(_WORD.finditer(self.text, start), index, None), None)
        return len(self.text.rstrip()) if word is None else word.start()

    def _line(self, offset: int) -> SourceRef:
        lines = self.text.count("\n", 0, offset)
        first = self.place.place
        if isinstance(first, str):  # in the file that TILT= names
            return SourceRef(self.place.file, f"{first.rpartition(':')[0]}:{lines + 1}")
        return SourceRef(self.place.file, (first or 1) + lines)

    def take(self, count: int, what: str) -> Doubles:
        """The next ``count`` numbers; InputError where the file ends first."""
        first = next(self.words, None)
        self.starts[what] = len(self.text) if first is None else first.start()
        chosen = [] if first is None else [first[0]]
        chosen += [word[0] for word in islice(self.words, count - 1)]
        if len(chosen) < count:
            problem = f"{what}: {len(chosen)} numbers left; want {count}"
            raise self.problem(what, len(chosen), problem)
        try:
            values = np.array([float(token) for token in chosen], np.float64)
        except ValueError:
            problem = f"{what}: no number among them"
            raise self.problem(what, _first_bad(chosen), problem) from None
        if not np.isfinite(values).all() or any("_" in token for token in chosen):
            problem = f"{what}: no finite number among them"
            raise self.problem(what, _first_bad(chosen), problem)
        return values

    def counts(self, count: int, what: str, most: int) -> list[int]:
        """The next numbers as integers from 1 to ``most``."""
        values = self.take(count, what)
        if ((values < 1) | (values > most) | (values != np.round(values))).any():
            shown = ", ".join(f"{value:g}" for value in values)
            problem = f"{what}: {shown}; want integers from 1 to {most}"
            raise self.problem(what, 0, problem)
        return [int(value) for value in values]

    def problem(self, part: str, index: int, text: str) -> InputError:
        """What is wrong with a part, and why, where a decimal comma has made two numbers of one."""
        offset = self._offset(part, index)
        end = self.text.find("\n", offset)
        comma = self._comma(len(self.text) if end < 0 else end)
        if comma is not None:
            text += f"; {comma[0]!r} in line {comma[1].place}: decimal commas? want points"
        return InputError(self._line(offset), text)

    def _comma(self, end: int) -> tuple[str, SourceRef] | None:
        """The first word with a comma between digits before ``end``, and its line.

        None where a word has several: there they stand between numbers.
        """
        found = _COMMA.search(self.text, 0, end)
        if found is None or _COMMAS.search(self.text, 0, end):
            return None
        near = self.text[max(found.start() - 12, 0) : found.end() + 12].split()
        return next(word for word in near if _COMMA.search(word)), self._line(found.start())

    def finish(self, last: str, report: Report) -> None:
        """A finding where something follows; DOS ends a text with 0x1A.

        Raises InputError for numbers that decimal commas have made.
        """
        rest = next((word for word in self.words if word[0].strip("\x00\x1a")), None)
        if rest is None:
            return
        comma = self._comma(rest.start())
        if comma is not None and _is_number(rest[0]):
            text = f"{comma[0]!r}, and more numbers than declared: decimal commas? want points"
            raise InputError(comma[1], text)
        text = f"what follows the last {last} is not read"
        report.add(Kind.DROPPED, "profile-trailing", self._line(rest.start()), "", text)


def _first_bad(words: list[str]) -> int:
    """Index of the first word that is no finite number."""
    return next((index for index, word in enumerate(words) if not _is_number(word)), 0)


def _is_number(word: str) -> bool:
    try:
        return "_" not in word and bool(np.isfinite(float(word)))
    except ValueError:
        return False
