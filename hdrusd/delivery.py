"""A stage and what belongs to it appear whole or not at all: made beside, renamed into place."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from hdrusd.errors import InputError

#: Bytes in the name of a file, as common file systems have it.
_LONGEST_NAME = 255


def check_output(output: Path, suffixes: Sequence[str]) -> None:
    """Refuse what cannot become the name of a stage. Raises InputError."""
    if output.suffix.lower() not in suffixes:
        raise InputError(output, f"{output.suffix or 'no suffix'}; want {suffixes[0]}")
    if output.is_dir():
        raise InputError(output, "a folder; want the name of a file")
    longest = f"{output.stem}.photometry.usda"
    if len(longest.encode()) > _LONGEST_NAME:
        raise InputError(output, f"a name of {len(output.name)} characters; want a shorter one")
    textures = output.parent / f"{output.stem}.textures"
    if textures.exists() and not output.exists():
        # It would be replaced, and may well be the source's own.
        raise InputError(textures, "not of an earlier conversion; want another name for OUTPUT")


@contextmanager
def work_folder(output: Path) -> Iterator[Path]:
    """A folder beside ``output`` that is gone in the end, as are parents made for nothing."""
    above = (output.parent, *output.parent.parents)
    made = [parent for parent in above if not parent.exists()]
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".hdrusd-", dir=output.parent) as folder:
            yield Path(folder)
    finally:
        for parent in made:
            with suppress(OSError):  # it is not there, or not empty
                parent.rmdir()


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
