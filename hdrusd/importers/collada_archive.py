"""COLLADA in a ZIP archive: .zae (its manifest names the document) and .kmz of Google Earth.

COLLADA 1.5.0, appendix "zae"; the sizes that an archive declares are not believed.
"""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from collections.abc import Iterator

from hdrusd.errors import InputError
from hdrusd.importers.importer import Resolver

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
        self._budget = min(max(_FREE, _RATIO * len(content)), resolver.limits.file_bytes)
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise InputError(self._file, f"not a ZIP archive: {error}") from error
        self._names: dict[str, zipfile.ZipInfo] = {}
        for info in self._zip.infolist():
            name = info.filename.replace("\\", "/")
            if not info.is_dir():
                self._names.setdefault(name.rpartition("/")[2].casefold(), info)

    def member(self, name: str) -> bytes | None:
        """The bytes of a member by the last part of its name; None where there is none."""
        info = self._names.get(name.replace("\\", "/").rpartition("/")[2].casefold())
        return None if info is None else b"".join(self._pieces(info))

    def document(self) -> list[bytes]:
        """The COLLADA document: that of the manifest, else the first .dae."""
        manifest = self.member("manifest.xml")
        found = _MANIFEST.search(manifest) if manifest is not None else None
        name = found[1].decode("utf-8", "replace") if found else ""
        info = self._names.get(name.partition("#")[0].rpartition("/")[2].casefold())
        if info is None:
            documents = (i for key, i in self._names.items() if key.endswith(".dae"))
            info = next(documents, None)
        if info is None:
            raise InputError(self._file, "archive without a .dae document")
        return list(self._pieces(info))

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


def unpack(content: bytes, resolver: Resolver) -> tuple[list[bytes], Archive | None]:
    """The document in pieces, and the archive that it stands in if it does. Raises InputError."""
    if not content.startswith(_MAGIC):
        return [content], None
    archive = Archive(content, resolver)
    return archive.document(), archive
