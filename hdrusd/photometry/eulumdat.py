"""EULUMDAT photometric files (.ldt): one value a line, cd per 1000 lm of the lamps.

The format of A. Stockmar (1990), as DIAL describes it: 26 lines on the luminaire, six for
each set of lamps, ten direct ratios, the angles of all C planes and of gamma, and the
planes that the symmetry leaves. C = 0 lies across the luminaire, its length along C = 90.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.luminaire import (
    MOST_ANGLES,
    MOST_BYTES,
    MOST_VALUES,
    Doubles,
    Luminaire,
    Opening,
    checked,
)
from hdrusd.report import Kind, Report

Indices = npt.NDArray[np.intp]

#: Lines before the lamps, lines a set of lamps, direct ratios.
_HEADER, _LAMP, _RATIOS = 26, 6, 10

_MOST_SETS = 20

_MOST_LINES = MOST_VALUES + 3 * MOST_ANGLES

_MILLIMETRE = 1e-3

_UNREADABLE = "want an EULUMDAT file"


def read_eulumdat(data: bytes, place: SourceRef, report: Report) -> Luminaire:
    """Read the bytes of an EULUMDAT file. Raises InputError."""
    if len(data) > MOST_BYTES:
        raise InputError(place, f"{len(data)} bytes; want at most {MOST_BYTES}")
    lines = _Lines(data, place)
    if len(lines.text) < _HEADER:
        raise InputError(place, f"{len(lines.text)} lines; {_UNREADABLE}")
    symmetry = lines.count(3, "symmetry", 0, 4)
    plane_count = lines.count(4, "number of C planes", 1, MOST_ANGLES)
    angle_count = lines.count(6, "number of gamma angles", 2, MOST_ANGLES)
    sets = lines.count(26, "number of lamp sets", 1, _MOST_SETS)

    lumens = lines.number(_HEADER + 3, "luminous flux")
    absolute = lines.number(_HEADER + 1, "number of lamps") < 0.0
    if sets > 1:
        text = f"{sets} sets of lamps; the first, of {lumens:g} lm, is shown"
        report.add(Kind.ASSUMED, "profile-lamp-sets", place, "", text)

    chosen = _stored(symmetry, plane_count, place)
    if len(chosen) * angle_count > MOST_VALUES:
        problem = f"{len(chosen)} x {angle_count} intensities; want at most {MOST_VALUES}"
        raise InputError(place, problem)
    start = _HEADER + _LAMP * sets + _RATIOS + 1
    planes = lines.numbers(start, plane_count, "C planes")
    angles = lines.numbers(start + plane_count, angle_count, "gamma angles")
    first = start + plane_count + angle_count
    candela = lines.numbers(first, len(chosen) * angle_count, "luminous intensities")
    lines.finish(first + len(chosen) * angle_count, report)

    keywords = {"MANUFAC": lines.text[0], "LUMINAIRE": lines.text[8], "LUMCAT": lines.text[9]}
    return checked(
        place,
        report,
        name=lines.text[8] or place.file.name,
        type="C",
        planes=_stored_planes(symmetry, planes, chosen, place),
        angles=angles,
        candela=candela.reshape(len(chosen), angle_count),
        factor=lines.number(24, "conversion factor") * lumens / 1000.0,
        lumens=None if absolute else lumens,
        opening=_opening(lines),
        keywords=keywords,
    )


def _stored(symmetry: int, count: int, place: SourceRef) -> Indices:
    """Indices, from 0, of the C planes whose intensities the file has, in its order."""
    parts = {0: 1, 1: 1, 2: 2, 3: 4, 4: 4}[symmetry]
    if count % parts:
        raise InputError(
            place, f"{count} C planes; symmetry {symmetry} wants a multiple of {parts}"
        )
    if symmetry == 1:
        return np.arange(1)
    if symmetry == 3:  # from C 270 over 360 = 0 to C 90
        return np.arange(3 * count // 4, 3 * count // 4 + count // 2 + 1) % count
    return np.arange({0: count, 2: count // 2 + 1, 4: count // 4 + 1}[symmetry])


def _stored_planes(symmetry: int, planes: Doubles, chosen: Indices, place: SourceRef) -> Doubles:
    """Their angles, ascending: -90 to 90 for symmetry 3. InputError where they do not fit."""
    angles = planes[chosen]
    if symmetry == 1:
        return np.zeros(1)
    if symmetry == 3:
        angles = np.where(np.arange(len(angles)) < len(planes) // 4, angles - 360.0, angles)
    ends = {2: (0.0, 180.0), 3: (-90.0, 90.0), 4: (0.0, 90.0)}.get(symmetry)
    if ends is not None and np.abs(angles[[0, -1]] - ends).max() > 0.01:
        text = f"C planes {angles[0]:g} to {angles[-1]:g} of symmetry {symmetry}"
        raise InputError(place, f"{text}; want {ends[0]:g} to {ends[1]:g}")
    return np.asarray(angles)


def _opening(lines: _Lines) -> Opening:
    """The luminous area; without one the luminaire's own size. A width of 0 is a circle."""
    sizes = [lines.size(line) for line in (16, 17)]
    if not any(sizes):
        sizes = [lines.size(line) for line in (13, 14)]
    length, width = sizes
    height = max(lines.size(line) for line in (18, 19, 20, 21))
    return Opening(width or length, length, height, round=width == 0.0 and length > 0.0)


class _Lines:
    """The lines of a file, counted from 1 as the format does."""

    def __init__(self, data: bytes, place: SourceRef) -> None:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        lines = text.split("\n", _MOST_LINES)[:_MOST_LINES]
        self.text = [line.strip(" \t\x00\x1a") for line in lines]
        self.place = place

    def number(self, line: int, what: str) -> float:
        """The number on a line, whatever its decimal sign."""
        return float(self.numbers(line, 1, what)[0])

    def count(self, line: int, what: str, least: int, most: int) -> int:
        """The integer on a line."""
        value = self.number(line, what)
        if not (least <= value <= most and value == round(value)):
            raise InputError(
                SourceRef(self.place.file, line),
                f"{what}: {value:g}; want an integer from {least} to {most}",
            )
        return int(value)

    def numbers(self, line: int, count: int, what: str) -> Doubles:
        """``count`` lines of one number each."""
        left = max(len(self.text) - line + 1, 0)
        if count > left:
            raise InputError(self.place, f"{what}: {left} lines left; want {count}")
        chosen = self.text[line - 1 : line - 1 + count]
        values = np.array([_number(text) for text in chosen])
        broken = np.flatnonzero(~np.isfinite(values))
        if len(broken):
            index = int(broken[0])
            problem = f"{what}: {chosen[index][:40]!r} is no number; {_UNREADABLE}"
            raise InputError(SourceRef(self.place.file, line + index), problem)
        return values

    def size(self, line: int) -> float:
        """A length, m; it is no part of the light, so what is broken is 0."""
        value = _number(self.text[line - 1]) * _MILLIMETRE
        return value if 0.0 < value < 1e6 else 0.0

    def finish(self, line: int, report: Report) -> None:
        """A finding where more follows."""
        rest = sum(bool(text) for text in self.text[line - 1 :])
        if rest:
            text = f"{rest} lines after the last intensity are not read"
            report.add(Kind.DROPPED, "profile-trailing", self.place, "", text)


def _number(text: str) -> float:
    """A number with a decimal point or comma; NaN for anything else."""
    if "_" in text:
        return math.nan
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan
