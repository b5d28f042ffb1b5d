"""A stage and what belongs to it appear whole or not at all: made beside, renamed into place."""

from __future__ import annotations

import errno
import fcntl
import os
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from hdrusd.errors import InputError, OutputError
from hdrusd.leftovers import left_behind, private_name, remove

#: In a work folder: what stood in the places of what was made.
_ASIDE = "replaced"

#: Bytes in the name of a file, as common file systems have it.
_LONGEST_NAME = 255


def check_path(path: Path) -> None:
    """Refuse names that USD's asset paths cannot have. Raises InputError."""
    for character in str(path):
        if unicodedata.category(character) in {"Cc", "Cs"}:
            text = f"the path has a {character!a} in it; want one of printable characters"
            raise InputError(path, text)


def check_output(output: Path, suffixes: Sequence[str]) -> None:
    """Refuse what cannot become the name of a stage. Raises InputError."""
    check_path(output.absolute())
    if output.suffix.lower() not in suffixes:
        raise InputError(output, f"{output.suffix or 'no suffix'}; want {suffixes[0]}")
    if output.is_dir():
        raise InputError(output, "a folder; want the name of a file")
    longest = f"{output.stem}.photometry.usda"
    if len(longest.encode()) > _LONGEST_NAME:
        raise InputError(output, f"a name of {len(output.name)} characters; want a shorter one")
    textures = output.parent / f"{output.stem}.textures"
    if textures.exists() and not (output.exists() and output.with_name(longest).exists()):
        # It would be replaced, and may well be the source's own.
        raise InputError(textures, "not of an earlier conversion; want another name for OUTPUT")


@contextmanager
def work_folder(output: Path) -> Iterator[Path]:
    """A folder beside ``output`` that is gone in the end, as are parents made for nothing.

    An OSError of what is written is about ``output``: nobody knows the folder's name.
    """
    above = (output.parent, *output.parent.parents)
    made = [parent for parent in above if not parent.exists()]
    nearest = next(parent for parent in above if parent.exists())
    if not nearest.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, "not a folder; want one to write in", str(nearest))
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        clear_leftovers(output, done=False)
        folder = _beside(output)
        try:
            yield folder
        except OSError as problem:
            if problem.filename is None or str(problem.filename).startswith(str(folder)):
                raise _refused(output, problem) from problem
            raise
        except OutputError as problem:
            if problem.path.is_relative_to(folder):
                raise OutputError(output, problem.reason) from problem
            raise
        finally:
            remove(folder)
        clear_leftovers(output, done=True)
    finally:
        for parent in made:
            with suppress(OSError):  # it is not there, or not empty
                parent.rmdir()


def _beside(output: Path) -> Path:
    folder = output.parent.absolute() / private_name()
    try:
        folder.mkdir(mode=0o700)
    except OSError as problem:
        raise _refused(output, problem) from problem
    return folder


def clear_leftovers(output: Path, *, done: bool) -> None:
    """Remove what dead processes left beside ``output``.

    Who died between two renames has set an earlier stage aside; nobody else has it. It stays
    until a run over that output is ``done`` and has replaced it.
    """
    parts = ("geometry.usdc", "look.usda", "photometry.usda", "textures")
    own = {output.name, *(f"{output.stem}.{part}" for part in parts)}
    for path in left_behind(output.parent):
        aside = {each.name for each in (path / _ASIDE).glob("*")}
        if not aside or (done and aside <= own):
            remove(path)


def _refused(output: Path, problem: OSError) -> OSError:
    text = str(problem.strerror or problem)
    if not text.startswith("cannot be written"):
        text = f"cannot be written ({text})"
    return OSError(problem.errno or errno.EIO, text, str(output))


def move_into_place(folder: Path, output: Path) -> None:
    """Rename what was made; the root layer last, so that it never names what is not there.

    What stood there before is set aside, and put back when a rename fails. Of two runs at once
    one waits for the other, or parts of both would stand there.
    """
    with _turn(output.parent):
        _rename_all(folder, output)


@contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """No other process renames into a folder meanwhile; the kernel forgets the dead."""
    with ExitStack() as held:
        with suppress(OSError):  # it may not be listed, or its file system locks no folders
            handle = os.open(folder, os.O_RDONLY)
            held.callback(os.close, handle)
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def _rename_all(folder: Path, output: Path) -> None:
    names = sorted((p.name for p in folder.iterdir()), key=lambda name: name == output.name)
    old = folder / _ASIDE
    old.mkdir()
    touched: list[str] = []
    try:
        for name in names:
            touched.append(name)
            target = output.parent / name
            if target.exists():
                target.rename(old / name)
            (folder / name).rename(target)
    except BaseException:
        for name in reversed(touched):
            target = output.parent / name
            with suppress(OSError):  # the others are put back all the same
                if not (folder / name).exists() and target.exists():
                    target.rename(folder / name)
                if (old / name).exists():
                    (old / name).rename(target)
        raise
