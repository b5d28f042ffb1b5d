"""The letters of photometric files: neither format says which encoding a file has.

Files are ASCII, Latin-1 as Windows programs write them, or UTF-8 with or without a byte order
mark. Bytes that are sound UTF-8 by chance are next to unknown.
"""

from __future__ import annotations


def decoded(data: bytes) -> str:
    """The text of a file, its lines ended by line feeds: UTF-8, else Latin-1."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def encoded(text: str) -> bytes:
    """The bytes of a text, which ``decoded`` reads: Latin-1, or UTF-8 where that cannot say it."""
    utf8 = text.encode("utf-8")
    try:
        data = text.encode("latin-1")
    except UnicodeEncodeError:
        return utf8
    return data if decoded(data) == decoded(utf8) else utf8
