"""A stage and what belongs to it appear whole or not at all: made beside, renamed into place."""

from __future__ import annotations

import errno
import fcntl
import os
import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from hdrusd.errors import InputError, OutputError
from hdrusd.leftovers import left_behind, private_name, remove

#: In a work folder: what stood in the places of what was made.
_ASIDE = "replaced"

#: Bytes in the name of a file, as common file systems have it.
_LONGEST_NAME = 255

#: What may stand beside OUTPUT: its stem, a point, and one of these. The layers, then a folder.
_LAYERS = _GEOMETRY, _LOOK, _PHOTOMETRY = "geometry.usdc", "look.usda", "photometry.usda"
_TEXTURES = "textures"

#: What stands in the head of the layer that is always there.
_MARK, _HEAD = b'authorship:hdrusd:softwarePackage = "hdrusd"', 1 << 16
_PRIM = re.compile(rb"^(def|over|class)\b", re.MULTILINE)


def check_path(path: Path) -> None:
    """Refuse names that USD's asset paths cannot have. Raises InputError."""
    for character in str(path):
        if unicodedata.category(character) in {"Cc", "Cs"}:
            text = f"the path has a {character!a} in it; want one of printable characters"
            raise InputError(path, text)


def check_output(output: Path, suffixes: Sequence[str], *, over_stage: bool = False) -> None:
    """Refuse what cannot become the name of a stage, or of a layer over one. Raises InputError."""
    check_path(output.absolute())
    if output.suffix.lower() not in suffixes:
        raise InputError(output, f"{output.suffix or 'no suffix'}; want {suffixes[0]}")
    if output.is_dir():
        raise InputError(output, "a folder; want the name of a file")
    longest = f"{output.stem}.{_PHOTOMETRY}"
    if len(longest.encode()) > _LONGEST_NAME:
        raise InputError(output, f"a name of {len(output.name)} characters; want a shorter one")
    textures = output.with_name(f"{output.stem}.{_TEXTURES}")
    if textures.exists() and not (output.exists() and output.with_name(longest).exists()):
        raise _foreign(textures)  # it would be replaced, and may well be the source's own
    layers = (_PHOTOMETRY,) if over_stage else _LAYERS
    _check_layers(output, [output.with_name(f"{output.stem}.{layer}") for layer in layers])


def _check_layers(output: Path, layers: Iterable[Path]) -> None:
    """Refuse to replace layers where nothing says that they are of a conversion into ``output``.

    The photometry stands first and the root last, so that one of them is there whenever a run
    was killed. Raises InputError.
    """
    traces = output, output.with_name(f"{output.stem}.{_PHOTOMETRY}")
    known = any(trace.exists() for trace in traces)
    for layer in layers:
        if layer.is_dir() or (layer.exists() and not known):
            raise _foreign(layer)


def _foreign(place: Path) -> InputError:
    return InputError(place, "not of an earlier conversion; want another name for OUTPUT")


def places(output: Path) -> list[Path]:
    """Where a conversion into ``output`` may write."""
    return [output, *(output.with_name(f"{output.stem}.{part}") for part in (*_LAYERS, _TEXTURES))]


def is_own(file: Path) -> bool:
    """Whether a conversion wrote this stage, or this layer of one: converting it once more would
    take reflectance for pictures, and each run would find more.
    """
    stem = file.stem if file.suffix == ".usda" else ""
    for layer in _LAYERS:
        if file.name.endswith(f".{layer}"):
            stem = file.name.removesuffix(f".{layer}")
    return bool(stem) and _is_converted(file.with_name(f"{stem}.usda"))


def _is_converted(output: Path) -> bool:
    """Whether the layers of a stage of this name are of a conversion into it."""
    photometry = output.with_name(f"{output.stem}.{_PHOTOMETRY}")
    try:
        said, root = _head(photometry), _head(output)
    except OSError:
        return False
    if _MARK in said:
        return True
    # The mark is on the default prim, which may stand far behind, or be none; without lights and
    # materials there is nothing in the layer but what holds for all of it.
    ours = b"Hdrusd" in said or (said.startswith(b"#usda") and not _PRIM.search(said))
    return ours and _named(photometry.name) in root


def earlier_files(output: Path) -> list[Path]:
    """The files of the conversion that stands at ``output``; none where somebody else's does.

    They are those that its layers name: what else lies among its textures is not its own.
    """
    if not _is_converted(output):
        return []
    layers = {layer: output.with_name(f"{output.stem}.{layer}") for layer in _LAYERS}
    try:
        root = _head(output)
        # A stage that stayed as it is may have the name of one of them, and hardly of both.
        if not all(_named(path.name) in root for path in layers.values()):
            layers = {_PHOTOMETRY: layers[_PHOTOMETRY]}
        found = [path for path in layers.values() if path.is_file() and not path.is_symlink()]
        text = b"".join(path.read_bytes() for path in found if path.suffix == ".usda")
    except OSError:
        return []
    folder = output.with_name(f"{output.stem}.{_TEXTURES}")
    if not folder.is_symlink():  # what lies elsewhere stays
        named = re.findall(re.escape(_named(f"{folder.name}/")[:-1]) + rb"([^@/\n]+)@", text)
        textures = (folder / name.decode(errors="surrogateescape") for name in sorted({*named}))
        found += [path for path in textures if path.is_file()]
    return [*found, output] if root else found


def _named(path: str) -> bytes:
    """As a layer names what stands beside it."""
    return f"@./{path}@".encode(errors="surrogateescape")


def _head(file: Path) -> bytes:
    if file.is_symlink() or not file.is_file():  # a pipe would never end
        return b""
    with file.open("rb") as opened:
        return opened.read(_HEAD)


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
            _clear(parent)


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
    own = {path.name for path in places(output)}
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

    What stood there before is set aside, and put back when a rename fails; of an earlier
    conversion into ``output`` all of it, but nothing that hdrusd did not write. Of two runs at
    once one waits for the other, or parts of both would stand there.
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
    """File by file: others' files may lie in the folder of textures."""
    home, old = output.parent, folder / _ASIDE
    made = [path.relative_to(folder) for path in folder.rglob("*") if not path.is_dir()]
    photometry = f"{output.stem}.{_PHOTOMETRY}"  # names textures, and no stage names it yet
    made.sort(key=lambda way: (way.name == output.name, way.name != photometry, way))
    new = set(made)
    _check_layers(output, (home / way for way in made if len(way.parts) == 1))
    before = (path.relative_to(home) for path in earlier_files(output))
    gone = [way for way in before if way not in new]
    inner = {way.parent for way in (*made, *gone)} - {Path()}
    linked = [way for way in inner if (home / way).is_symlink()]  # what lies elsewhere stays there
    touched: list[Path] = []
    try:
        for way in (*linked, *made, *gone):
            touched.append(way)
            target, aside = home / way, old / way
            target.parent.mkdir(exist_ok=True)
            if target.exists():
                aside.parent.mkdir(parents=True, exist_ok=True)
                target.rename(aside)
            if way in new:
                (folder / way).rename(target)
    except BaseException:
        for way in reversed(touched):
            target, aside = home / way, old / way
            with suppress(OSError):  # the others are put back all the same
                if way in new and not (folder / way).exists() and target.exists():
                    target.rename(folder / way)
                if aside.exists():
                    _clear(target)  # a folder in place of a link
                    aside.rename(target)
        raise
    finally:
        for way in inner:
            _clear(home / way)


def _clear(folder: Path) -> None:
    with suppress(OSError):  # it is not there, or not empty
        folder.rmdir()
