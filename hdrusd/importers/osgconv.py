"""Reader for OpenSceneGraph's ``.ive``, and for some ``.osgb``, by its program osgconv.

osgconv runs as a worker in a private folder with a copy of the file and writes ``.osgt`` there,
which our reader of OpenSceneGraph text takes in the place of the file. Pictures that stand in
the file arrive in the text. Of others an ``.osgb`` keeps the names; an ``.ive`` forgets a
picture that osgconv cannot open, so those that it asked for are looked up, copied beside the
file, and osgconv runs again. Places in findings are lines of the text.

Sources: OpenSceneGraph 3.6, src/osgDB/InputStream.cpp, src/osgPlugins/osg/BinaryStreamOperator.h,
src/osgPlugins/ive/DataInputStream.cpp.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path, PurePosixPath

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers import worker
from hdrusd.importers.confine import landlock_version
from hdrusd.importers.importer import Resolver
from hdrusd.importers.osg_text import Document, parse
from hdrusd.report import Kind, Report

#: How a file begins, in either byte order.
_HEADS = {
    ".osgb": (b"\xa1\x0e\x91\x6c\x45\x45\xfb\x1a", b"\x6c\x91\x0e\xa1\x1a\xfb\x45\x45"),
    ".ive": (b"\4\3\2\1", b"\1\2\3\4"),
}
#: Folders that the file lies below in the private one: so far ``..`` in a name finds its copy.
_DEPTH = 8
#: Names that osgconv looks up; more are not looked for.
_ASKED = 10_000
_UNREAD = re.compile(r"^Error reading file (.+): (?:file not |read error)", re.MULTILINE)
_PICTURES = (
    *(".bmp", ".bw", ".dds", ".gif", ".int", ".inta", ".jpeg", ".jpg", ".pic", ".png"),
    *(".rgb", ".rgba", ".sgi", ".tga", ".tif", ".tiff"),
)


def load(resolver: Resolver, report: Report) -> Document:
    """The tree of ``resolver.source``. Raises InputError when nothing can be used."""
    source = resolver.source
    suffix = source.suffix.lower()
    data = resolver.read()
    check_head(data, suffix, source)
    program = shutil.which("osgconv")
    if program is None:
        text = f"{suffix} is read by osgconv, which is missing; install the package openscenegraph"
        raise InputError(source, text)
    if not landlock_version():
        text = "this system cannot confine osgconv; it may open files that the source names"
        report.add(Kind.ASSUMED, "worker-unconfined", SourceRef(source), "", text)
    with tempfile.TemporaryDirectory(prefix="hdrusd-") as name:
        folder = Path(name).resolve().joinpath(*"abcdefgh"[:_DEPTH])
        folder.mkdir(parents=True)
        (folder / f"source{suffix}").write_bytes(data)
        text = _convert(program, folder, resolver)
        if _copied(text, folder, resolver):
            _convert(program, folder, resolver)
        converted = folder / "source.osgt"
        if converted.is_symlink() or not converted.is_file():
            raise InputError(source, "osgconv wrote nothing; want a file that it can read")
        return parse(resolver.read(converted), source, report, resolver.limits)


def check_head(data: bytes, suffix: str, source: Path) -> None:
    """Raise InputError unless a file begins as one of its suffix does."""
    if not data:
        raise InputError(source, f"empty; want {suffix}")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(source, "a Git LFS pointer; want the file itself (git lfs pull)")
    if not data.startswith(_HEADS[suffix]):
        raise InputError(source, f"not {suffix}, by its first bytes; want OpenSceneGraph binary")


def _convert(program: str, folder: Path, resolver: Resolver) -> str:
    """One run of osgconv; what it printed. It ends well whatever happened."""
    name = f"source{resolver.source.suffix.lower()}"
    return worker.run(
        [program, "-O", "ForceReadingImage=true PRECISION 17", name, "source.osgt"],
        folder=folder,
        limits=resolver.limits,
        source=resolver.source,
        reader="osgconv",
        environment={"OSG_OPTIMIZER": "OFF"},  # which flattens transforms and merges nodes
    )


def _copied(text: str, folder: Path, resolver: Resolver) -> bool:
    """Copy the pictures that an .ive names to where osgconv looked; whether there is any."""
    if resolver.source.suffix.lower() != ".ive":
        return False
    any_copied = False
    for name in list(dict.fromkeys(_UNREAD.findall(text)))[:_ASKED]:
        if PurePosixPath(name).suffix.lower() not in _PICTURES:
            continue
        found = resolver.find(name, SourceRef(resolver.source))
        if found is None:
            continue
        target = (folder / name).resolve()
        if not target.is_relative_to(folder.parents[_DEPTH - 1]):
            target = folder / PurePosixPath(name).name  # where osgconv looks next
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(resolver.read(found))
        any_copied = True
    return any_copied
