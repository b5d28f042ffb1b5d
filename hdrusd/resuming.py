"""Whether the files that a resumed run would skip were made as it makes them.

Pictures say in the PNG text ``hdrusd:viewing`` how they were seen, EXR frames in their header how
they were drawn. A sequence of both is refused; what says nothing of itself is taken for this
run's, a finding.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.images import read_exr_header, read_png_text
from hdrusd.report import Kind, Report

#: Name of the text in a PNG.
VIEWING = "hdrusd:viewing"

#: Characters of it that are read at most.
_LONGEST = 1 << 16


def viewing_text(setup: Mapping[str, Any]) -> str:
    """What a PNG says of ``Viewing.setup``."""
    return json.dumps(setup, sort_keys=True, default=str)


def check_pictures(files: Iterable[Path], setup: Mapping[str, Any], report: Report) -> None:
    """Raise InputError for the first PNG among ``files`` that another setup has made."""
    own = json.loads(viewing_text(setup))
    silent = []
    for file in _named(files, ".png"):
        said = _said(read_png_text(file, VIEWING))
        if said is None:
            silent.append(file)
        else:
            _refuse(file, "picture", [key for key in own if said.get(key) != own[key]])
    _tell(silent, report)


def check_frames(
    files: Iterable[Path], drawn: Mapping[str, Any], size: tuple[int, int], report: Report
) -> None:
    """Raise InputError for the first EXR among ``files`` that is of another size, or whose

    header is not as ``drawn`` says.
    """
    silent = []
    for file in _named(files, ".exr"):
        try:
            header = read_exr_header(file)
        except InputError:  # it is not looked at any further, so that it may be anything
            header = {}
        if not any(key in header for key in drawn):
            silent.append(file)
            continue
        other = [key.partition(":")[2] for key in drawn if header.get(key) != drawn[key]]
        if "dataWindow" in header:
            low, high = (np.asarray(corner) for corner in header["dataWindow"])
            if tuple(high - low + 1) != size:
                other.append("size")
        _refuse(file, "frame", other)
    _tell(silent, report)


def _named(files: Iterable[Path], suffix: str) -> Iterable[Path]:
    return (file for file in files if file.suffix.lower() == suffix)


def _said(text: str | None) -> dict[str, Any] | None:
    if text is None or len(text) > _LONGEST:
        return None
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return said if isinstance(said, dict) else None


def _refuse(file: Path, what: str, other: list[str]) -> None:
    if other:
        raise InputError(
            file,
            f"a {what} by other settings ({', '.join(other)}); want the same, or another output",
        )


def _tell(silent: list[Path], report: Report) -> None:
    if silent:
        text = f"{len(silent)} files do not say how they were made; taken for this run's"
        report.add(Kind.ASSUMED, "resume-unknown", SourceRef(silent[0]), "", text)
