"""Where an LM-63 file that can be read differs from what its edition wants, line by line."""

from __future__ import annotations

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.photometry.conversion import REQUIRED
from hdrusd.photometry.ies import KEYWORDS, LABELS, IesFile, keyword, label_line
from hdrusd.report import Kind, Report

#: Characters of a line in LM-63-2002 and 2019.
_LINE = 256

_LAMPS = "lamps, lumens and multiplier"
_SIZE = "width, length and height"
_FACTORS = "ballast factor, its companion and watts"

#: Signs of width, length and height that stand for a shape (LM-63-2002, luminous openings).
_SHAPES = {
    (0, 0, 0): "point",
    (1, 1, 0): "rectangle",
    (1, 1, 1): "box",
    (-1, -1, 0): "ellipse",
    (-1, -1, 1): "vertical cylinder",
    (-1, -1, -1): "ellipsoid",
    (-1, 1, -1): "horizontal cylinder along C 0",
    (1, -1, -1): "horizontal cylinder along C 90",
    (-1, 0, -1): "vertical ellipse facing C 0",
    (-1, 0, 0): "circle",  # up to 1995
    (-1, 0, 1): "vertical cylinder",
}

#: First and last angles in a plane, first and last planes.
_ANGLES = {"C": ((0.0, 90.0), (90.0, 180.0)), "A": ((-90.0, 0.0), (90.0,))}
_ANGLES["B"] = _ANGLES["A"]
_PLANES = {"C": ((0.0, 90.0), (0.0, 90.0, 180.0, 270.0, 360.0)), "A": ((-90.0, 0.0), (90.0,))}
_PLANES["B"] = _PLANES["A"]


def shape(file: IesFile) -> str | None:
    """The luminous opening by the signs of its sizes; None for signs that mean nothing."""
    found = _SHAPES.get(tuple(np.sign(file.size).astype(int).tolist()))
    equal = abs(file.size[0]) == abs(file.size[1])
    round_ones = {"ellipse": "circle", "ellipsoid": "sphere"}
    return round_ones.get(found, found) if found is not None and equal else found


def check_ies(file: IesFile, place: SourceRef, report: Report) -> None:
    """A finding for each deviation."""
    _check_head(file, place, report)
    _check_numbers(file, report)
    _check_ends(file, report, "angles", "angles in a plane", _ANGLES[file.type])
    _check_ends(file, report, "planes", "planes", _PLANES[file.type])
    if shape(file) is None:
        width, length, height = file.size
        text = f"width {width:g}, length {length:g}, height {height:g}: signs of no known shape"
        report.add(Kind.INVALID, "photometric-opening", file.at(_SIZE, 0), "", text)


def _check_head(file: IesFile, place: SourceRef, report: Report) -> None:
    told: dict[str, list[int]] = {}  # text -> first line, and how many there are

    def tell(line: int, text: str) -> None:
        told.setdefault(text, [line, 0])[1] += 1

    strict = file.edition >= 2002
    lines = file.head.split("\n")[:-1]
    label = LABELS[file.edition]
    at = label_line(lines)
    if at is not None and lines[at].rstrip() != label:
        tell(at + 1, f"label {lines[at].strip()!r}; want {label!r}")
    if at:
        tell(1, "empty lines before the label; want it first")
    for number, line in enumerate(lines, start=1):
        if number - 1 == at:
            continue
        found = keyword(line)
        if strict and len(line) > _LINE:
            tell(number, f"a line of more than {_LINE} characters")
        if found is None:
            if line.strip() and file.edition >= 1991:
                tell(number, "text without a keyword")
        elif not found[0]:
            tell(number, "a keyword without a name")
        elif strict and found[0] not in KEYWORDS | {"MORE"} and not line.lstrip().startswith("[_"):
            tell(number, f"[{found[0]}] is not defined; want [_{found[0]}]")
    for text, (first, count) in told.items():
        whole = text if count == 1 else f"{text}; {count} lines of that kind"
        report.add(Kind.INVALID, "photometric-header", SourceRef(place.file, first), "", whole)
    if strict:
        for key in REQUIRED:
            if not file.keywords.get(key):
                text = f"no [{key}], which LM-63-{file.edition} requires"
                end = SourceRef(place.file, len(lines) + 1)
                report.add(Kind.MISSING, "photometric-header", end, "", text)


def _check_numbers(file: IesFile, report: Report) -> None:
    def tell(part: str, index: int, text: str) -> None:
        report.add(Kind.INVALID, "photometric-number", file.at(part, index), "", text)

    if file.lamps < 1.0 or file.lamps != round(file.lamps):
        tell(_LAMPS, 0, f"{file.lamps:g} lamps; want 1 or more")
    if file.lumens <= 0.0 and file.lumens != -1.0:
        tell(_LAMPS, 1, f"{file.lumens:g} lumens a lamp; want more than 0, or -1 (absolute)")
    if file.watts <= 0.0:
        tell(_FACTORS, 2, f"{file.watts:g} W; want more than 0")
    if file.edition in (1995, 2002) and file.companion != 1.0:
        text = f"{file.companion:g} after the ballast factor is not used in {file.edition}; want 1"
        tell(_FACTORS, 1, text)
    digits = f"{file.companion:.5f}"
    if file.edition == 2019 and (digits[:2] != "1." or set(digits[2:]) - {"0", "1"}):
        tell(_FACTORS, 1, f"file generation {file.companion:g}; want 1.00000 to 1.11111")


def _check_ends(
    file: IesFile,
    report: Report,
    part: str,
    what: str,
    wanted: tuple[tuple[float, ...], tuple[float, ...]],
) -> None:
    values = file.planes if part == "planes" else file.angles
    for index, name, choice in ((0, "start", wanted[0]), (len(values) - 1, "end", wanted[1])):
        value = float(values[index])
        if value not in choice:
            listed = " or ".join(f"{end:g}" for end in choice)
            text = f"{what} {name} at {value:g}; type {file.type} wants {listed}"
            report.add(Kind.INVALID, "photometric-angles", file.at(part, index), "", text)
