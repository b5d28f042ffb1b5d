"""Which files below the named ones are databases, and the stage that each becomes."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hdrusd.errors import InputError
from hdrusd.importers.importer import SUFFIXES
from hdrusd.photometry.sidecar import FILE_NAME
from hdrusd.usd.source_stage import STAGES

#: What a stage's name may not end in: its layers are named so.
_LAYERS = (".geometry", ".look", ".photometry")


@dataclass(frozen=True, slots=True)
class Task:
    """One file to convert."""

    source: Path
    output: Path
    photometry: Path | None  # the one given, else the nearest, from beside the source upwards
    shared: bool  # the photometry is that of other sources too
    root: Path | None  # the folder it was found in, whose files it may name


def plan(sources: Sequence[Path], output: Path, photometry: Path | None = None) -> list[Task]:
    """What to do, in the order of the names.

    A folder stands for every database below it; hidden files and folders, what lies in
    ``output``, and links that lead out of the folder are passed over. The tree below the folder,
    or below the folder that all sources share, is the tree below ``output``. Two sources that
    would become one stage, whatever the case of their names, carry their suffix in it.
    Raises InputError where there is nothing to do.
    """
    found = [pair for source in sources for pair in _databases(source, output.resolve())]
    if not found:
        suffixes = " ".join(sorted([*SUFFIXES, *STAGES]))
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


def _databases(source: Path, output: Path) -> Iterator[tuple[Path, Path | None]]:
    if not source.is_dir():
        yield source, None
        return
    home = source.resolve()
    for folder, folders, files in os.walk(source):
        folders[:] = [
            name
            for name in folders
            if not name.startswith(".") and (Path(folder) / name).resolve() != output
        ]
        for name in files:
            file = Path(folder) / name
            known = file.suffix.lower() in SUFFIXES or file.suffix.lower() in STAGES
            if known and not name.startswith(".") and file.resolve().is_relative_to(home):
                yield file, source


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
