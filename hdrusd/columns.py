"""Text by the columns that it takes on a terminal: East Asian characters take two.

Unicode Standard Annex 11 (East Asian Width): wide and fullwidth characters are two columns
wide, what combines with the character before it none. Ambiguous ones, Greek among them, are one
wide outside East Asian fonts.
"""

from __future__ import annotations

from collections.abc import Iterator
from unicodedata import category, east_asian_width

#: What stands for the rest of a text that is cut.
_MORE = "..."


def columns(text: str) -> int:
    """Columns that a text takes."""
    return len(text) if text.isascii() else sum(map(_column, text))


def cut(text: str, width: int) -> str:
    """The text, or what of it fits into ``width`` columns with dots behind."""
    if columns(text) <= width:
        return text
    return text[: _fitting(text, width - len(_MORE))] + _MORE


def padded(text: str, width: int) -> str:
    """The text in ``width`` columns: cut, or with blanks behind."""
    text = cut(text, width)
    return text + " " * (width - columns(text))


def wrapped(text: str, width: int, indent: str = "") -> list[str]:
    """Lines of at most ``width`` columns, those behind the first with ``indent``.

    Broken at blanks; what is wider than a line, as text without blanks is, anywhere.
    """
    lines: list[str] = []
    line = ""
    for word in _pieces(text, width - columns(indent)):
        longer = f"{line} {word}" if line.strip() else line + word
        if columns(longer) > width and line.strip():
            lines.append(line.rstrip())
            longer = indent + word
        line = longer
    return [*lines, line] if line.strip() else lines


def _pieces(text: str, width: int) -> Iterator[str]:
    for word in text.split(" "):
        while columns(word) > width:
            here = max(_fitting(word, width), 1)
            yield word[:here]
            word = word[here:]
        yield word


def _column(character: str) -> int:
    if category(character) in ("Mn", "Me"):
        return 0
    return 2 if east_asian_width(character) in "WF" else 1


def _fitting(text: str, width: int) -> int:
    """How many characters of the beginning fit."""
    for count, character in enumerate(text):
        width -= _column(character)
        if width < 0:
            return count
    return len(text)
