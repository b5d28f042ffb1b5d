"""Every database and stage below a folder, from reading to a picture, hostile ones included.

    python -m tests.corpus [DIR] [--out DIR] [--markdown FILE] [--only PATTERN]
                           [--workers N] [--gallery DIR [--public]]

A legacy file is converted, checked and rendered; a USD file is described and rendered, and
then, as a row of its own, converted, checked and rendered. Each command runs in a process of
its own under limits, which its worker processes inherit. A file passes when it ends in a picture
with light in it (black where all its materials are), or in one line on standard error and a
documented exit code; either way nothing may be written outside the output folder and nothing
half-written may stay.

A file in ``set/model/...`` below DIR may name files anywhere in ``set/model`` (``--root``),
because some models keep their textures beside the folder of their meshes. ``--gallery``
writes contact sheets of the pictures, and what each file lost by the codes of docs/findings.md.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.images import read_exr
from hdrusd.importers.importer import SUFFIXES as LEGACY
from hdrusd.usd.source_stage import STAGES

from .gallery import PRIVATE, write_sheets

#: What follows the name of a stage that was converted before it was rendered.
CONVERTED = ", converted"

#: Files whose picture is black: the camera of this one stands in a hall and ends before its walls.
BLACK = ("gazebo/office_building/*",)

#: Exit codes of the README that say why a file ended without a picture.
REFUSALS = range(1, 6)

#: Address space of what reads a file first, and of each of its worker processes, bytes: a
#: declared size that is believed ends here.
READING_BYTES = 2 << 30

#: Wall time of each command, seconds.
SECONDS = 60.0

WIDTH, HEIGHT = 320, 180

_PROGRAM = """
import resource, sys
if {limit}:
    resource.setrlimit(resource.RLIMIT_AS, ({limit}, {limit}))
from hdrusd.cli import main
sys.argv[0] = "hdrusd"
main()
"""

COLUMNS = ("file", "outcome", "triangles", "materials", "textures", "lights", "findings", "seconds")


@dataclass(slots=True)
class Row:
    """What became of one file. ``problem`` is empty where it passed."""

    name: str  # relative to the folder, with slashes; a stage's second row ends in CONVERTED
    code: int = 0
    message: str = ""  # the line on standard error of a refusal
    seconds: float = 0.0
    counts: dict[str, int] = field(default_factory=dict)
    findings: int | None = None  # of conversion and rendering together
    codes: Counter[str] = field(default_factory=Counter)  # of those that are listed
    lit: float = 0.0  # share of the pixels above 0 cd/m2
    dark: bool = False  # no material of it reflects or emits
    problem: str = ""

    @property
    def outcome(self) -> str:
        """For a table: the picture's lit share, the refusal, or what is wrong."""
        if self.problem:
            return f"**{self.problem}**"
        if self.code:
            return f"exit {self.code}: {self.message}"
        if self.dark:
            return "picture, black as its materials"
        return f"picture, {self.lit:.0%} lit" if self.lit >= 0.01 else "picture, under 1% lit"

    def cells(self) -> list[str]:
        """One cell a column of ``COLUMNS``."""
        shown = [self.counts.get(name) for name in COLUMNS[2:6]]
        numbers = ["" if value is None else str(value) for value in (*shown, self.findings)]
        return [self.name, self.outcome, *numbers, f"{self.seconds:.1f}"]


class WrongError(Exception):
    """A file did not end as it must; the text says how."""


class RefusedError(Exception):
    """A command ended with one clear line and a documented exit code."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


def corpus_files(folder: Path, only: str = "*") -> list[Path]:
    """The databases and stages below ``folder`` whose relative path matches ``only``."""
    suffixes = {*LEGACY, *STAGES}
    known = (path for path in folder.rglob("*") if path.suffix.lower() in suffixes)
    files = (path for path in known if path.is_file())
    return sorted(path for path in files if fnmatch(path.relative_to(folder).as_posix(), only))


def run_corpus(
    folder: Path, files: Iterable[Path], output: Path, workers: int = 1
) -> Iterator[Row]:
    """Try each file, in order, stages both ways, into a folder of its own below ``output``."""
    tasks = (
        (file, conversion)
        for file in files
        for conversion in ((False, True) if file.suffix.lower() in STAGES else (True,))
    )
    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(lambda task: _try(folder, *task, output), tasks)


def _try(folder: Path, file: Path, conversion: bool, output: Path) -> Row:
    name = file.relative_to(folder).as_posix()
    row = Row(name + CONVERTED * (conversion and file.suffix.lower() in STAGES))
    case = Case(folder, file, conversion, _home(output, row))
    before = listing(folder)
    start = time.perf_counter()
    try:
        case.run(row)
    except RefusedError as refusal:
        row.code, row.message = refusal.code, str(refusal).replace(f"{folder}/", "")
    except WrongError as wrong:
        row.problem = str(wrong)
    row.seconds = time.perf_counter() - start
    row.problem = row.problem or case.strays(refused=row.code != 0)
    if not row.problem and listing(folder) != before:
        row.problem = "the source folder was written to"
    return row


def _home(output: Path, row: Row) -> Path:
    return output / row.name.replace("/", "__")


@dataclass(slots=True)
class Case:
    """One file and the folders it may use: ``out`` for results, ``cwd`` and ``tmp`` for nothing."""

    folder: Path
    file: Path
    conversion: bool  # before it is rendered
    home: Path

    def __post_init__(self) -> None:
        for path in (self.out, *self._empty()):
            path.mkdir(parents=True)

    @property
    def out(self) -> Path:
        """Where the commands are told to write."""
        return self.home / "out"

    def run(self, row: Row) -> None:
        """Fill in ``row``. Raises RefusedError, WrongError."""
        stage = self._converted(row) if self.conversion else self._described(row)
        exr, png = self.out / "frame.exr", self.out / "frame.png"
        size = ["--imageWidth", str(WIDTH), "--imageHeight", str(HEIGHT)]
        rendered = self._json(
            ["render", str(stage), str(exr), "--png", str(png), *size, "--json", "--quiet"]
        )
        row.findings = (row.findings or 0) + len(rendered["findings"])
        row.codes.update(finding["code"] for finding in rendered["findings"])
        rgb, _ = read_exr(exr)
        if rgb.shape != (HEIGHT, WIDTH, 3) or not np.isfinite(rgb).all():
            raise WrongError("the frame has a wrong size or numbers that are not finite")
        if not png.is_file():
            raise WrongError("no PNG")
        row.lit = float((rgb.max(axis=-1) > 0.0).mean())
        row.dark = row.dark or any(fnmatch(row.name, pattern) for pattern in BLACK)
        if row.lit == 0.0 and not (row.dark and row.counts["triangles"]):
            raise WrongError("the picture is black")
        row.dark = row.lit == 0.0

    def _described(self, row: Row) -> Path:
        """The stage as it is, and what ``info`` counts in it."""
        described = self._json(["info", str(self.file), "--json"], READING_BYTES)
        row.counts = {name: described[name] for name in ("triangles", "materials")}
        row.counts["lights"] = int(str(described["lights"]).partition(",")[0])
        return self.file

    def _converted(self, row: Row) -> Path:
        """The stage that ``convert`` makes, checked."""
        stage = self.out / "stage.usda"
        command = ["convert", str(self.file), str(stage), *self._roots(), "--json", "--quiet"]
        converted = self._json(command, READING_BYTES)
        row.counts = converted["counts"] | {
            "textures": len(converted["textures"]),
            "lights": len(converted["lights"]),
        }
        row.findings = len(converted["findings"])
        row.codes.update(finding["code"] for finding in converted["findings"])
        row.dark = _reflects_nothing(converted["materials"])
        self._hdrusd(["check", str(stage)])
        return stage

    def strays(self, *, refused: bool) -> str:
        """What lies where nothing may lie; empty when all is well."""
        wrong = [path for path in self.home.rglob("*") if not path.is_relative_to(self.out)]
        wrong = [path for path in wrong if path not in (self.out, *self._empty())]
        wrong += self.out.rglob(".*")  # temporary files
        if refused:
            wrong += self.out.glob("frame.*")
            if not (self.out / "stage.usda").is_file():  # it was convert that refused
                wrong += self.out.iterdir()
        names = sorted({path.relative_to(self.home).as_posix() for path in wrong})
        return f"left behind: {', '.join(names)}" if names else ""

    def _empty(self) -> tuple[Path, Path]:
        return self.home / "cwd", self.home / "tmp"

    def _roots(self) -> list[str]:
        parts = self.file.relative_to(self.folder).parts[:-1]
        return ["--root", str(self.folder.joinpath(*parts[:2]))] if len(parts) > 1 else []

    def _json(self, arguments: Sequence[str], limit: int = 0) -> dict[str, Any]:
        document: dict[str, Any] = json.loads(self._hdrusd(arguments, limit).splitlines()[-1])
        return document

    def _hdrusd(self, arguments: Sequence[str], limit: int = 0) -> str:
        """Standard output of a command. Raises RefusedError, WrongError."""
        command = [sys.executable, "-c", _PROGRAM.format(limit=limit), *arguments]
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            cwd=self.home / "cwd",
            env=os.environ | {"TMPDIR": str(self.home / "tmp")},
            start_new_session=True,
        )
        try:
            output, errors = child.communicate(timeout=SECONDS)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            raise WrongError(f"{arguments[0]}: still running after {SECONDS:g} s") from None
        if child.returncode == 0:
            return output
        return self._judge(arguments[0], child.returncode, errors)

    def _judge(self, command: str, code: int, errors: str) -> str:
        lines = errors.strip().splitlines()
        if code < 0:
            raise WrongError(f"{command}: ended by signal {-code}")
        if "Traceback" in errors:
            raise WrongError(f"{command}: traceback: {lines[-1]}")
        if code not in REFUSALS:
            raise WrongError(f"{command}: exit code {code} is not documented")
        if len(lines) != 1:
            raise WrongError(f"{command}: exit {code} with {len(lines)} lines on standard error")
        raise RefusedError(code, lines[0])


def _reflects_nothing(materials: list[dict[str, Any]]) -> bool:
    return bool(materials) and not any(
        any(material["diffuse"]) or material["reflectance_map"] or material["luminance_cd_m2"]
        for material in materials
    )


def listing(folder: Path) -> dict[str, tuple[int, int]]:
    """Every path below ``folder`` with its time of modification and size."""
    found = {}
    for path in folder.rglob("*"):
        status = path.lstat()
        found[path.relative_to(folder).as_posix()] = (status.st_mtime_ns, status.st_size)
    return found


def markdown(rows: Sequence[Row]) -> str:
    """The rows as a Markdown table with a closing line of totals."""
    lines = [f"| {' | '.join(COLUMNS)} |", f"| {' | '.join('---' for _ in COLUMNS)} |"]
    for row in rows:
        cells = (cell.replace("|", "\\|") for cell in row.cells())
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, "", totals(rows), ""])


def write_gallery(rows: Iterable[Row], output: Path, gallery: Path, *, public: bool) -> None:
    """Contact sheets of the pictures below ``output`` and ``gallery.md`` into ``gallery``.

    What is black as its materials has no tile, and a stage only one, as it is. ``public``:
    without what may not be shown by its licence, and what is broken on purpose.
    """
    hidden = PRIVATE if public else ()
    pictures, lines = [], ["| file | findings |", "| --- | --- |"]
    for row in rows:
        picture = _home(output, row) / "out" / "frame.png"
        left_out = any(fnmatch(row.name, pattern) for pattern in (*hidden, f"*{CONVERTED}"))
        if row.code or row.problem or row.dark or left_out:
            continue
        pictures.append((row.name, picture))
        codes = ", ".join(f"{code} {count}" for code, count in sorted(row.codes.items()))
        lines.append(f"| {row.name} | {codes or 'none'} |")
    sheets = write_sheets(pictures, gallery)
    shown = "".join(f"![Pictures of the corpus]({sheet.name})\n\n" for sheet in sheets)
    (gallery / "gallery.md").write_text(shown + "\n".join([*lines, ""]), encoding="utf-8")


def totals(rows: Sequence[Row]) -> str:
    """One line: how many pictures, refusals and failures; a stage has two runs."""
    wrong = sum(bool(row.problem) for row in rows)
    refused = sum(not row.problem and row.code != 0 for row in rows)
    pictures = len(rows) - wrong - refused
    return f"{len(rows)} runs: {pictures} pictures, {refused} refused, {wrong} wrong."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print the table as it grows; 0 when every file passed."""
    parser = argparse.ArgumentParser(prog="python -m tests.corpus", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("folder", nargs="?", type=Path, help="[default: $HDRUSD_TESTDATA/data]")
    parser.add_argument("--out", type=Path, help="Keep the stages and pictures in this folder.")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="Write the table.")
    parser.add_argument("--only", default="*", metavar="PATTERN", help="Paths that match.")
    parser.add_argument("--workers", type=int, default=1, help="Files at a time.")
    parser.add_argument("--gallery", type=Path, metavar="DIR", help="Write contact sheets.")
    parser.add_argument("--public", action="store_true", help="In them only what may be shown.")
    options = parser.parse_args(arguments)
    folder = options.folder
    if folder is None:
        if "HDRUSD_TESTDATA" not in os.environ:
            parser.error("no folder: name one or set HDRUSD_TESTDATA")
        folder = Path(os.environ["HDRUSD_TESTDATA"]) / "data"
    folder = folder.resolve()
    rows = []
    with tempfile.TemporaryDirectory(prefix="hdrusd-corpus-") as scratch:
        output = options.out.resolve() if options.out else Path(scratch)
        for row in run_corpus(folder, corpus_files(folder, options.only), output, options.workers):
            rows.append(row)
            print("  ".join(row.cells()), flush=True)
        if options.gallery is not None:
            write_gallery(rows, output, options.gallery, public=options.public)
    print(totals(rows))
    if options.markdown is not None:
        options.markdown.write_text(markdown(rows), encoding="utf-8")
    return int(any(row.problem for row in rows))


if __name__ == "__main__":
    sys.exit(main())
