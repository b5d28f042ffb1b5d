"""Counts of every database beside those that a manifest gives, which other programs made.

    python -m tests.counts [DIR] [--markdown FILE]

DIR (default $HDRUSD_TESTDATA/data) holds MANIFEST.md, whose table has the columns file,
format, bytes, meshes, triangles, materials, textures, lights. Only rows that differ are
shown, ours after theirs. Files that a reader refuses are told with its line.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hdrusd.errors import InputError
from hdrusd.importers.importer import SUFFIXES, Resolver, read
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Report

COLUMNS = ("meshes", "triangles", "materials", "textures", "lights")
STAGES = (".usd", ".usda", ".usdc", ".usdz")


@dataclass(slots=True)
class Count:
    """One file: what the manifest says and what was found; ``refusal`` is a reader's line."""

    name: str
    theirs: dict[str, int] = field(default_factory=dict)
    ours: dict[str, int] = field(default_factory=dict)
    refusal: str = ""

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


def stage_counts(path: Path) -> dict[str, int]:
    """Of a stage, by ``hdrusd info``."""
    program = "from hdrusd.cli import main; main()"
    command = [sys.executable, "-c", program, "info", str(path), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    described: Mapping[str, object] = json.loads(done.stdout)
    counts = {key: int(str(described[key])) for key in ("triangles", "materials")}
    return counts | {"lights": int(str(described["lights"]).partition(",")[0])}


def count(folder: Path, row: Count) -> Count:
    """Fill in what we find in a file of the manifest."""
    path = folder / row.name
    if path.suffix.lower() in STAGES:
        row.ours = stage_counts(path)
        return row
    if path.suffix.lower() not in SUFFIXES:
        row.refusal = "no reader"
        return row
    report = Report()
    parts = path.relative_to(folder).parts[:2]
    try:
        row.ours = scene_counts(read(Resolver(path, report, (folder.joinpath(*parts),)), report))
    except InputError as error:
        row.refusal = str(error).replace(f"{folder}/", "")
    return row


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
    rows = [count(folder, row) for row in manifest(folder / "MANIFEST.md")]
    text = markdown(rows)
    print(text, end="")
    if options.markdown is not None:
        options.markdown.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
