"""The importer interface, the list of importers, and the door through which they open files."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Protocol

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.cycle_search import put_off
from hdrusd.importers.unplaced import note_unplaced
from hdrusd.legacy.scene import LegacyScene
from hdrusd.registry import Registry
from hdrusd.report import Kind, Report


@dataclass(frozen=True, slots=True)
class Limits:
    """What a hostile file may cost us. A declared size is never believed beyond these."""

    file_bytes: int = 2 << 30
    pixels: int = 16384 * 16384
    vertices: int = 100_000_000
    nodes: int = 1_000_000
    depth: int = 256
    worker_bytes: int = 2 << 30  # address space of a third-party reader's process
    worker_seconds: int = 120  # its wall time, and its processor time


class _Folders:
    """What lies in the folders that are looked into, each listed once."""

    def __init__(self) -> None:
        self._names: dict[tuple[int, int], dict[str, str]] = {}  # by device and inode

    def existing(self, path: Path) -> Path | None:
        """``path`` as it stands, else the like of it in another case; None if neither is there."""
        try:
            if path.exists():
                return path.resolve()
            about = path.parent.stat()
            if not stat.S_ISDIR(about.st_mode):
                return None
            folder = about.st_dev, about.st_ino
            if folder not in self._names:
                entries = sorted(path.parent.iterdir(), reverse=True)  # the first stays
                self._names[folder] = {entry.name.casefold(): entry.name for entry in entries}
            name = self._names[folder].get(path.name.casefold())
            return None if name is None else (path.parent / name).resolve()
        except (OSError, ValueError, RuntimeError):  # a name too long or unspeakable, link loops
            return None


@dataclass(slots=True)
class Resolver:
    """Opens files for a reader, and only below the declared roots.

    Links are followed before the check, only regular files are opened, and no
    file above ``limits.file_bytes`` is read. Roots are the input's own folder
    and those that the user declares.
    """

    source: Path
    report: Report
    roots: Sequence[Path] = ()
    search: Sequence[Path] = ()
    limits: Limits = field(default_factory=Limits)
    found: set[Path] = field(default_factory=set)  # what ``find`` has answered, by real paths
    stated: frozenset[str] = frozenset()  # "unit", "up": what a person states of the source
    _folders: _Folders = field(default_factory=_Folders)

    def __post_init__(self) -> None:
        base = self.source.resolve().parent
        self.search = [Path(p).resolve() for p in self.search]
        self.roots = [base, *(Path(p).resolve() for p in self.roots), *self.search]

    def read(self, path: Path | None = None) -> bytes:
        """The bytes of ``path``, or of the source itself. Raises InputError."""
        path = self.source if path is None else path
        with self._opening(path):
            return path.read_bytes()

    def read_view(self, path: Path | None = None) -> memoryview:
        """As ``read``, into memory of large pages, where NumPy is given some: half the time."""
        path = self.source if path is None else path
        with self._opening(path) as size, path.open("rb") as file:
            content = np.empty(size, np.uint8).data
            return content[: file.readinto(content)]

    @contextmanager
    def _opening(self, path: Path) -> Iterator[int]:
        """The size of a regular file that is about to be read; InputError for what goes wrong."""
        try:
            if not path.exists():
                raise InputError(path, "no such file")
            if not path.is_file():
                raise InputError(path, "not a regular file")
            size = path.stat().st_size
            if size > self.limits.file_bytes:
                raise InputError(path, f"{size} bytes; at most {self.limits.file_bytes} are read")
            yield size
        except OSError as problem:  # no permission, a broken disk
            raise InputError(
                path, f"cannot be read: {problem.strerror or problem}; want a readable file"
            ) from problem

    def find(self, reference: str, place: SourceRef, *, thing: str = "") -> Path | None:
        """The file that a reference names, or None with a finding.

        Tried in turn: as written beside the source; its base name in the folders
        ``textures``, ``materials/textures``, ``../materials/textures`` and the
        search paths; then each without regard to case. Backslashes and trailing
        blanks are mended. A hit outside the roots is refused.
        """
        name = reference.strip().replace("\\", "/")
        if not name or "\0" in name:
            self.report.add(
                Kind.MISSING, "file-missing", place, thing, f"{reference!r}: not a file name"
            )
            return None
        base = self.source.resolve().parent
        tail = PurePosixPath(name).name
        folders = [
            base,
            base / "textures",
            base / "materials" / "textures",
            base.parent / "materials" / "textures",
            *self.search,
        ]
        candidates = [base / name, *(folder / tail for folder in folders)]
        refused: Path | None = None
        other: Path | None = None  # what is there and no file
        for tried, candidate in enumerate(candidates):
            found = self._folders.existing(candidate)
            if found is None:
                continue
            if found.is_dir() or (self._below(found) and not found.is_file()):
                other = other or found
                continue
            if not self.allowed(found):
                refused = refused or found
                continue
            if tried > 0 or not candidate.exists():
                self.report.add(
                    Kind.ASSUMED,
                    "file-found-elsewhere",
                    place,
                    thing,
                    f"{reference}: not found as written; {found.parent.name}/{found.name} is used",
                )
            self.found.add(found)
            return found
        why = "not found; add --search-path"
        if other:
            why = f"{'a folder' if other.is_dir() else 'not a regular file'}; want a file"
        if refused:
            why = "outside the declared roots"
            ancestor = Path(os.path.commonpath([base, refused.parent]))
            if ancestor != ancestor.parent:  # the whole disk is no root that one declares
                why += f"; --root {ancestor} would allow it"
        code = "file-refused" if refused else "file-missing"
        self.report.add(Kind.MISSING, code, place, thing, f"{reference}: {why}")
        return None

    def allowed(self, path: Path) -> bool:
        """Whether a regular file lies, links followed, below one of the roots."""
        real = path.resolve()
        return real.is_file() and self._below(real)

    def _below(self, real: Path) -> bool:
        return any(real.is_relative_to(root) for root in self.roots)


def resolver_of(path: Path, above: Resolver) -> Resolver:
    """For what an external file names: relative to itself, below the same roots."""
    return replace(above, source=path)


class Importer(Protocol):
    """What a format must offer: one call."""

    def __call__(self, resolver: Resolver, report: Report) -> LegacyScene:
        """Read ``resolver.source``. Raises InputError when nothing can be used."""
        ...


#: Name of the format to its reader.
IMPORTERS: Registry[Importer] = Registry("importer", "hdrusd.importers")
IMPORTERS.add("collada", "hdrusd.importers.collada:read")
IMPORTERS.add("fbx", "hdrusd.importers.fbx:read")
IMPORTERS.add("flt", "hdrusd.importers.flt:read")
IMPORTERS.add("3ds", "hdrusd.importers.tds:read")
IMPORTERS.add("gltf", "hdrusd.importers.gltf:read")
IMPORTERS.add("obj", "hdrusd.importers.obj:read")
IMPORTERS.add("osg", "hdrusd.importers.osg:read")
IMPORTERS.add("osgb", "hdrusd.importers.osg:read")
IMPORTERS.add("assimp", "hdrusd.importers.assimp:read")
IMPORTERS.add("osgconv", "hdrusd.importers.osg:read")

#: File suffix (lower case) to the name of its format.
SUFFIXES = {
    ".dae": "collada",
    ".zae": "collada",
    ".kmz": "collada",
    ".3ds": "3ds",
    ".fbx": "fbx",
    ".flt": "flt",
    ".gltf": "gltf",
    ".glb": "gltf",
    ".obj": "obj",
    ".osg": "osg",
    ".osgt": "osg",
    ".osgb": "osgb",
    ".ive": "osgconv",
    ".ac": "assimp",
    ".b3d": "assimp",
    ".lwo": "assimp",
    ".ms3d": "assimp",
    ".off": "assimp",
    ".ply": "assimp",
    ".stl": "assimp",
    ".x": "assimp",
}


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read a legacy file by its suffix. Raises InputError."""
    with put_off():
        scene = read_part(resolver, report)
    note_unplaced(scene, report)
    return scene


def read_part(resolver: Resolver, report: Report) -> LegacyScene:
    """Read a legacy file that another one may be made of, by its suffix. Raises InputError."""
    suffix = resolver.source.suffix.lower()
    name = SUFFIXES.get(suffix, suffix.removeprefix("."))
    if name not in IMPORTERS:
        raise InputError(
            resolver.source, f"{suffix or 'no suffix'}: no reader; want {', '.join(SUFFIXES)}"
        )
    return IMPORTERS[name](resolver, report)
