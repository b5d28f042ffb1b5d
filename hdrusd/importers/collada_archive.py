"""COLLADA in a ZIP archive: .zae (its manifest names the document) and .kmz of Google Earth.

Members have whole paths, and what the document names is relative to it. COLLADA 1.5.0,
appendix "zae"; the sizes that an archive declares are not believed.
"""

from __future__ import annotations

import io
import posixpath
import re
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile
from urllib.parse import unquote

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.report import Kind

_MAGIC = b"PK\x03\x04"
_PIECE = 1 << 20
#: An archive may unpack to this many bytes without being asked why.
_FREE = 64 << 20
#: And beyond that to this many times its own size: XML of numbers packs 5 to 50 times.
_RATIO = 200
_MANIFEST = re.compile(rb"<dae_root[^>]*>\s*([^<]+?)\s*</")


class Archive:
    """The members of one archive, unpacked when asked for and within one budget."""

    def __init__(self, content: bytes, resolver: Resolver) -> None:
        self._file = resolver.source
        self._report = resolver.report
        self._budget = min(max(_FREE, _RATIO * len(content)), resolver.limits.file_bytes)
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise InputError(self._file, f"not a ZIP archive: {error}") from error
        self._members: dict[str, zipfile.ZipInfo] = {}  # by whole paths
        for info in self._zip.infolist():
            if not info.is_dir():
                self._members.setdefault(_path("", info.filename), info)
        self._likes = [_grouped(self._members, alike) for alike in (str.casefold, _base)]
        self._folder = ""  # of the document

    def picture(self, references: Sequence[str], place: SourceRef, thing: str) -> bytes | None:
        """The bytes of the member that the first of ``references`` names; None if none does.

        As written, relative to the document; else, with a finding, the only one of that path
        or of the longest end of it without regard to case.
        """
        paths = [_path(self._folder, reference) for reference in references]
        path = next((path for path in paths if path in self._members), None)
        if path is None:
            path = next((found for path in paths if (found := self._like(path))), None)
            if path is None:
                return None
            text = f"{references[0][:200]}: not there, seen from the document; {path[:200]} is used"
            self._report.add(Kind.ASSUMED, "file-found-elsewhere", place, thing, text)
        return b"".join(self._pieces(self._members[path]))

    def document(self) -> list[bytes]:
        """The COLLADA document: that of the manifest, else the first .dae."""
        place = self._like("manifest.xml")
        manifest = b"" if place is None else b"".join(self._pieces(self._members[place]))
        found = _MANIFEST.search(manifest)
        name = found[1].decode("utf-8", "replace").partition("#")[0] if found else ""
        named = _path("", unquote(name))
        documents = [path for path in self._members if path.casefold().endswith(".dae")]
        path = named if named in self._members else self._like(named) or next(iter(documents), None)
        if path is None:
            raise InputError(self._file, "archive without a .dae document")
        if path != named and (name or len(documents) > 1):
            said = f"the manifest names {name[:200]!r}" if name else "no manifest names a document"
            text = f"{said}; of {len(documents)}, {path[:200]} is read"
            self._report.add(Kind.ASSUMED, "collada-archive", SourceRef(self._file), "", text)
        self._folder = posixpath.dirname(path)
        return list(self._pieces(self._members[path]))

    def _like(self, path: str) -> str | None:
        """The only path that is like this one but for case; else that which ends most like it."""
        for likes, alike in zip(self._likes, (str.casefold, _base), strict=True):
            found = likes.get(alike(path), [])
            ends = [_common_end(path, other) for other in found]
            if ends and ends.count(max(ends)) == 1:
                return found[ends.index(max(ends))]
        return None

    def _pieces(self, info: zipfile.ZipInfo) -> Iterator[bytes]:
        try:
            with self._zip.open(info) as stream:
                while piece := stream.read(_PIECE):
                    self._budget -= len(piece)
                    if self._budget < 0:
                        text = f"unpacks to more than {_RATIO} times its size; not read"
                        raise InputError(self._file, f"{info.filename[:80]}: {text}")
                    yield piece
        except (
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            OSError,
            ValueError,
            RuntimeError,  # encrypted; a method that Python has not is its NotImplementedError
        ) as error:
            raise InputError(self._file, f"{info.filename[:80]}: cannot be unpacked") from error


def _path(folder: str, name: str) -> str:
    """A member's path from the top of the archive."""
    return posixpath.normpath(posixpath.join(folder, name.strip().replace("\\", "/")))


def _base(path: str) -> str:
    return posixpath.basename(path).casefold()


def _common_end(one: str, other: str) -> int:
    """How many names at the ends of two paths are the same but for case."""
    names = (reversed(path.casefold().split("/")) for path in (one, other))
    pairs = zip(*names, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _grouped(paths: Iterable[str], alike: Callable[[str], str]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for path in paths:
        found.setdefault(alike(path), []).append(path)
    return found


def unpack(content: bytes, resolver: Resolver) -> tuple[list[bytes], Archive | None]:
    """The document in pieces, and the archive that it stands in if it does. Raises InputError."""
    if not content.startswith(_MAGIC):
        return [content], None
    archive = Archive(content, resolver)
    return archive.document(), archive
