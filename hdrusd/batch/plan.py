"""Which files below the named ones are databases, and the stage that each becomes."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from hdrusd.delivery import is_own, places
from hdrusd.errors import InputError, one_line
from hdrusd.importers.importer import SUFFIXES
from hdrusd.photometry.sidecar import FILE_NAME
from hdrusd.usd.source_stage import STAGES

#: Suffixes of what is converted.
DATABASES = {*SUFFIXES, *STAGES}

#: What a stage's name may not end in: its layers are named so.
_LAYERS = (".geometry", ".look", ".photometry")

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
    become one stage, whatever the case of their names, carry their suffix in it; who would still
    write where another one writes or is read, a number.
    Raises InputError where there is nothing to do, and for a place outside ``output``.
    """
    home = output.resolve()
    found = [pair for source in sources for pair in _databases(source, home, tell)]
    if not found:
        suffixes = " ".join(sorted(DATABASES))
        raise InputError(sources[0], f"no database in it; want files that end in {suffixes}")
    unique = {_absolute(file.parent) / file.name: (file, root) for file, root in found}
    base = _common_folder([root or file.parent for file, root in unique.values()])
    stages = _stages({f: place.relative_to(base) for place, (f, _) in unique.items()}, home)
    recipes = {file: photometry or _nearest(file, root) for file, root in unique.values()}
    speaks_of = Counter(recipes.values())
    tasks = [
        Task(
            source=file,
            output=output / stages[file],
            photometry=recipes[file],
            shared=recipes[file] is not None and speaks_of[recipes[file]] > 1,
            root=root,
        )
        for file, root in unique.values()
    ]
    for task in tasks:
        place = task.output.parent.resolve()
        if not place.is_relative_to(home):
            text = f"would be converted into {place}, outside {output}; want a folder without links"
            raise InputError(task.source, text)
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
        files.sort()
        folders[:] = [
            name
            for name in sorted(folders)
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
            elif is_own(file):
                passed_over["stages and layers that hdrusd wrote"].append(file)
            else:
                yield file, source
    for what, paths in passed_over.items():
        if paths:
            names = [one_line(str(path.relative_to(source))) for path in sorted(paths)]
            more = ", ..." if len(names) > _NAMED else ""
            tell(f"{source}: passed over, {what}: {len(names)} ({', '.join(names[:_NAMED])}{more})")


def _absolute(folder: Path) -> Path:
    """As it is called, but for ``..``: behind a link that is the folder above where it leads."""
    return folder.resolve() if ".." in folder.parts else folder.absolute()


def _common_folder(folders: Sequence[Path]) -> Path:
    return Path(os.path.commonpath([_absolute(folder) for folder in folders]))


def _stages(sources: Mapping[Path, Path], home: Path) -> dict[Path, Path]:
    """The stage of each source, both relative. ``sources``: files and their places in the tree."""
    shared = Counter(_key(place) for place in sources.values())
    first = {file: _stage(place, shared) for file, place in sources.items()}
    owners: dict[str, Path | None] = {_folded(file.resolve()): file for file in sources}
    for place in sources.values():
        owners |= dict.fromkeys((_folded(home / folder) for folder in place.parents), None)
    stages: dict[Path, Path] = {}
    # Who has its own name keeps it.
    for file in sorted(sources, key=lambda f: (first[f].stem != sources[f].stem, sources[f])):
        numbered = (first[file].with_stem(f"{first[file].stem}_{n}") for n in count(2))
        for stage in chain([first[file]], numbered):
            wanted = [_folded(place) for place in places(home / stage)]
            if all(owners.get(place, file) == file for place in wanted):
                break
        owners |= dict.fromkeys(wanted, file)
        stages[file] = stage
    return stages


def _folded(path: Path) -> str:
    return str(path).casefold()


def _key(place: Path) -> str:
    return _folded(place.with_suffix(""))


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
