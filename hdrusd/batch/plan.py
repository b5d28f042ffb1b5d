"""Which files below the named ones are databases, and the stage that each becomes."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hdrusd.errors import InputError, one_line
from hdrusd.importers.importer import SUFFIXES
from hdrusd.photometry.sidecar import FILE_NAME
from hdrusd.usd.source_stage import STAGES

#: Suffixes of what is converted.
DATABASES = {*SUFFIXES, *STAGES}

#: What a stage's name may not end in: its layers are named so.
_LAYERS = (".geometry", ".look", ".photometry")

#: The suffix of what hdrusd writes, the layer that is always there, and what stands in its head.
_OWN, _OWN_LAYER = ".usda", ".photometry.usda"
_MARK, _HEAD = b'authorship:hdrusd:softwarePackage = "hdrusd"', 1 << 16
_EMPTY = b"#usda 1.0"

#: Paths that a line of what was passed over names.
_NAMED = 3


@dataclass(frozen=True, slots=True)
class Task:
    """One file to convert."""

    source: Path
    output: Path
    photometry: Path | None  # the one given, else the nearest, from beside the source upwards
    shared: bool  # the photometry is that of other sources too
    root: Path | None  # the folder it was found in, whose files it may name


def plan(
    sources: Sequence[Path],
    output: Path,
    photometry: Path | None = None,
    tell: Callable[[str], None] = lambda line: None,
) -> list[Task]:
    """What to do, in the order of the names.

    A folder stands for every database below it; hidden files and folders, what lies in
    ``output``, what earlier conversions wrote, and links to folders or out of the folder are
    passed over; of the latter three ``tell`` hears a line each. The tree below the folder, or
    below the folder that all sources share, is the tree below ``output``. Two sources that would
    become one stage, whatever the case of their names, carry their suffix in it.
    Raises InputError where there is nothing to do.
    """
    found = [pair for source in sources for pair in _databases(source, output.resolve(), tell)]
    if not found:
        suffixes = " ".join(sorted(DATABASES))
        raise InputError(sources[0], f"no database in it; want files that end in {suffixes}")
    unique = {file.absolute(): (file, root) for file, root in found}
    base = _common_folder([root or file.parent for file, root in unique.values()])
    places = {file: file.absolute().relative_to(base) for file, _ in unique.values()}
    shared = Counter(_key(place) for place in places.values())
    recipes = {file: photometry or _nearest(file, root) for file, root in unique.values()}
    speaks_of = Counter(recipes.values())
    tasks = [
        Task(
            source=file,
            output=output / _stage(places[file], shared),
            photometry=recipes[file],
            shared=recipes[file] is not None and speaks_of[recipes[file]] > 1,
            root=root,
        )
        for file, root in unique.values()
    ]
    return sorted(tasks, key=lambda task: task.source)


def _databases(
    source: Path, output: Path, tell: Callable[[str], None]
) -> Iterator[tuple[Path, Path | None]]:
    if not source.is_dir():
        yield source, None
        return
    home = source.resolve()
    passed_over: dict[str, list[Path]] = defaultdict(list)
    for folder, folders, files in os.walk(source):
        folders[:] = [
            name
            for name in folders
            if not name.startswith(".") and (Path(folder) / name).resolve() != output
        ]
        links = (Path(folder) / name for name in folders)
        passed_over["links to folders"] += filter(Path.is_symlink, links)  # os.walk's part
        for name in files:
            file = Path(folder) / name
            if file.suffix.lower() not in DATABASES or name.startswith("."):
                continue
            if not file.resolve().is_relative_to(home):
                passed_over["links that lead out of it"].append(file)
            elif _is_own(file):
                passed_over["stages and layers that hdrusd wrote"].append(file)
            else:
                yield file, source
    for what, paths in passed_over.items():
        if paths:
            names = [one_line(str(path.relative_to(source))) for path in sorted(paths)]
            more = ", ..." if len(names) > _NAMED else ""
            tell(f"{source}: passed over, {what}: {len(names)} ({', '.join(names[:_NAMED])}{more})")


def _is_own(file: Path) -> bool:
    """Whether a conversion wrote this stage, or this layer of one: converting it once more would
    take reflectance for pictures, and each run would find more.
    """
    stem = file.stem if file.suffix == _OWN else ""
    for layer in ("geometry.usdc", "look.usda", "photometry.usda"):
        if file.name.endswith(f".{layer}"):
            stem = file.name.removesuffix(f".{layer}")
    if not stem:
        return False
    try:
        photometry = _head(file.with_name(f"{stem}{_OWN_LAYER}"))
        if photometry.strip() == _EMPTY:  # over a stage without lights and materials
            return f"@./{stem}{_OWN_LAYER}@".encode() in _head(file.with_name(f"{stem}{_OWN}"))
    except OSError:
        return False
    return _MARK in photometry


def _head(file: Path) -> bytes:
    if file.is_symlink() or not file.is_file():  # a pipe would never end
        return b""
    with file.open("rb") as opened:
        return opened.read(_HEAD)


def _common_folder(folders: Sequence[Path]) -> Path:
    return Path(os.path.commonpath([folder.absolute() for folder in folders]))


def _key(place: Path) -> str:
    return str(place.with_suffix("")).casefold()


def _stage(place: Path, shared: Counter[str]) -> Path:
    """``town/lamp.flt`` to ``town/lamp.usda``."""
    stem = place.stem
    if shared[_key(place)] > 1 or stem.lower().endswith(_LAYERS):
        stem = place.name.replace(".", "_")
    return place.with_name(f"{stem}.usda")


def _nearest(file: Path, root: Path | None) -> Path | None:
    """The photometry file in the first folder that has one, from the file's own up to ``root``."""
    for folder in file.parents:
        if (folder / FILE_NAME).is_file():
            return folder / FILE_NAME
        if folder == (root or file.parent):
            break
    return None
