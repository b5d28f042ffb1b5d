"""Counts of every database beside those that a manifest gives, which other programs made.

    python -m tests.counts [DIR] [--markdown FILE]

DIR (default $HDRUSD_TESTDATA/data) holds MANIFEST.md, whose table has the columns file,
format, bytes, meshes, triangles, materials, textures, lights. Only rows that differ are
shown, ours after theirs; docs/counts.md says why. Files that a reader refuses are told with
its line. Counts of a stage are those of its conversion.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.errors import InputError
from hdrusd.importers.importer import Resolver, read
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Report
from hdrusd.usd.source_stage import STAGES

COLUMNS = ("meshes", "triangles", "materials", "textures", "lights")


@dataclass(slots=True)
class Count:
    """One file: what the manifest says and what was found; ``refusal`` is a reader's line."""

    name: str
    theirs: dict[str, int] = field(default_factory=dict)
    ours: dict[str, int] = field(default_factory=dict)
    refusal: str = ""
    codes: frozenset[str] = frozenset()  # of the findings

    @property
    def differing(self) -> dict[str, tuple[int, int]]:
        """Column to theirs and ours, where they are not equal."""
        pairs = {key: (value, self.ours.get(key)) for key, value in self.theirs.items()}
        return {k: (a, b) for k, (a, b) in pairs.items() if b is not None and a != b}


def manifest(path: Path) -> Iterator[Count]:
    """The rows of MANIFEST.md that have counts."""
    for line in path.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) < 9 or not re.fullmatch(r"\d+", cells[3]):
            continue
        numbers = [re.match(r"\d+", cell) for cell in cells[3:8]]
        theirs = {key: int(n[0]) for key, n in zip(COLUMNS, numbers, strict=True) if n}
        yield Count(cells[0], theirs)


def scene_counts(scene: LegacyScene) -> dict[str, int]:
    """As the manifest counts: what hangs below the roots, shared things as often as they hang."""
    meshes = triangles = lights = 0
    stack: list[Node] = list(scene.roots)
    while stack:
        node = stack.pop()
        stack.extend(node.children)
        meshes += len(node.meshes)
        lights += len(node.lights)
        triangles += sum(int((scene.meshes[m].face_counts - 2).sum()) for m in node.meshes)
    counts = scene.counts()
    counts.update(meshes=meshes, triangles=triangles, lights=lights)
    return {key: counts[key] for key in COLUMNS}


def count(folder: Path, row: Count) -> Count:
    """Fill in what we find in a file of the manifest."""
    path = folder / row.name
    report = Report()
    roots = (folder.joinpath(*path.relative_to(folder).parts[:2]),)
    try:
        if path.suffix.lower() in STAGES:
            with tempfile.TemporaryDirectory() as scratch:
                output = Path(scratch) / "stage.usda"
                counts = convert(path, output, Options(roots=roots), report).counts
                row.ours = {key: counts[key] for key in COLUMNS}
        else:
            row.ours = scene_counts(read(Resolver(path, report, roots), report))
    except InputError as error:
        row.refusal = str(error).replace(f"{folder}/", "")
    row.codes = frozenset(report.codes())
    return row


def run_counts(folder: Path) -> list[Count]:
    """Every file of ``folder``/MANIFEST.md, counted."""
    return [count(folder, row) for row in manifest(folder / "MANIFEST.md")]


def markdown(rows: list[Count]) -> str:
    """The rows that differ, and a closing line of totals."""
    lines = ["| file | differs (manifest, hdrusd) |", "| --- | --- |"]
    for row in rows:
        parts = [f"{key} {a}, {b}" for key, (a, b) in row.differing.items()]
        if row.refusal or parts:
            lines.append(f"| {row.name} | {row.refusal or '; '.join(parts)} |")
    equal = sum(not row.refusal and not row.differing for row in rows)
    return "\n".join([*lines, "", f"{len(rows)} files: {equal} equal in all columns.", ""])


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.counts", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    options = parser.parse_args()
    folder = options.folder
    if folder is None:
        if "HDRUSD_TESTDATA" not in os.environ:
            parser.error("no folder: name one or set HDRUSD_TESTDATA")
        folder = Path(os.environ["HDRUSD_TESTDATA"]) / "data"
    text = markdown(run_counts(folder))
    print(text, end="")
    if options.markdown is not None:
        options.markdown.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
