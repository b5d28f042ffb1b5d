"""A stage and what belongs to it appear whole or not at all: made beside, renamed into place."""

from __future__ import annotations

import errno
import tempfile
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from hdrusd.errors import InputError

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
        with _beside(output) as folder:
            try:
                yield Path(folder)
            except OSError as problem:
                if problem.filename is None or str(problem.filename).startswith(folder):
                    raise _refused(output, problem) from problem
                raise
    finally:
        for parent in made:
            with suppress(OSError):  # it is not there, or not empty
                parent.rmdir()


def _beside(output: Path) -> tempfile.TemporaryDirectory[str]:
    try:
        return tempfile.TemporaryDirectory(prefix=".hdrusd-", dir=output.parent.absolute())
    except OSError as problem:
        raise _refused(output, problem) from problem


def _refused(output: Path, problem: OSError) -> OSError:
    text = f"cannot be written ({problem.strerror or problem})"
    return OSError(problem.errno or errno.EIO, text, str(output))


def move_into_place(folder: Path, output: Path) -> None:
    """Rename what was made; the root layer last, so that it never names what is not there.

    What stood there before is set aside, and put back when a rename fails.
    """
    names = sorted((p.name for p in folder.iterdir()), key=lambda name: name == output.name)
    old = folder / "replaced"
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
