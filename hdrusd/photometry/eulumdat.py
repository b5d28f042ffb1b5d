"""EULUMDAT photometric files (.ldt): one value a line, cd per 1000 lm of the lamps.

The format of A. Stockmar (1990), as DIAL describes it: 26 lines on the luminaire, six for
each set of lamps, ten direct ratios, the angles of all C planes and of gamma, and the
planes that the symmetry leaves. C = 0 lies across the luminaire, its length along C = 90.

``parse_eulumdat`` and ``write_eulumdat`` have a file as it stands, ``EulumdatFile.luminaire``
what it means.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.file_text import decoded, encoded
from hdrusd.photometry.luminaire import (
    MOST_ANGLES,
    MOST_BYTES,
    MOST_VALUES,
    At,
    Doubles,
    Luminaire,
    Opening,
    checked,
    plain,
)
from hdrusd.report import Kind, Report

Indices = npt.NDArray[np.intp]

#: Lines before the lamps, lines a set of lamps, direct ratios.
_HEADER, _LAMP, _RATIOS = 26, 6, 10

_MOST_SETS = 20

_MOST_LINES = MOST_VALUES + 3 * MOST_ANGLES

_MILLIMETRE = 1e-3

#: Degrees by which a plane may be off the end of a symmetry.
_NEAR = 0.01

#: First and last of the C planes that a symmetry leaves.
_ENDS = {2: ((0.0, 180.0),), 3: ((-90.0, 90.0), (90.0, 270.0)), 4: ((0.0, 90.0),)}

_UNREADABLE = "want an EULUMDAT file"


@dataclass(frozen=True, slots=True)
class LampSet:
    """One set of lamps, six lines."""

    count: float  # below 0 for absolute photometry
    name: str
    lumens: float  # of all lamps of the set
    colour: str
    rendering: str
    watts: float  # with ballast


@dataclass(frozen=True, slots=True, eq=False)
class EulumdatFile:
    """What an EULUMDAT file says, in its own numbers and units."""

    company: str
    type_indicator: int  # 1 point, symmetric about the vertical; 2 linear; 3 point, any other
    symmetry: int  # 0 none, 1 about the vertical, 2 about C 0-180, 3 about C 90-270, 4 both
    plane_step: float  # degrees; 0 for uneven ones
    angle_step: float
    test: str
    name: str
    number: str
    file_name: str
    date: str
    housing: tuple[float, ...]  # length, width, height in mm; width 0 is a circle
    opening: tuple[float, ...]  # length, width, height in C 0, 90, 180 and 270 in mm
    downward: float  # share of the flux, percent
    output_ratio: float  # flux of the luminaire to that of its lamps, percent
    conversion: float
    tilt: float  # degrees, while it was measured
    lamps: tuple[LampSet, ...]
    ratios: Doubles  # (10,) direct ratios
    planes: Doubles  # (mc,) all C planes from 0 to below 360
    angles: Doubles  # (n,)
    candela: Doubles  # (k, n) cd/klm of the planes that ``symmetry`` leaves
    unreadable: tuple[int, ...]  # lines with no number, none of them part of the light
    at: At

    @property
    def factor(self) -> float:
        """Candela of 1 cd/klm of the file."""
        return self.conversion * self.lamps[0].lumens / 1000.0

    def luminaire(self, place: SourceRef, report: Report) -> Luminaire:
        """What the file means. Raises InputError."""
        if len(self.lamps) > 1:
            lumens = self.lamps[0].lumens
            text = f"{len(self.lamps)} sets of lamps; the first, of {lumens:g} lm, is shown"
            report.add(Kind.ASSUMED, "profile-lamp-sets", SourceRef(place.file, 26), "", text)
        chosen = _stored(self.symmetry, self.planes, place)
        planes = _stored_planes(self.symmetry, self.planes, chosen, self.at)
        candela = self.candela
        if self.symmetry == 0 and 0.01 < planes[-1] - planes[0] < 359.99:
            # All round: 0 and 90 alone are no quadrant here.
            planes = np.append(planes, planes[0] + 360.0)
            candela = np.concatenate([candela, candela[:1]])
        keywords = {"MANUFAC": self.company, "LUMINAIRE": self.name, "LUMCAT": self.number}
        return checked(
            place,
            report,
            name=self.name or place.file.name,
            type="C",
            planes=planes,
            angles=self.angles,
            candela=candela,
            factor=self.factor,
            lumens=None if self.lamps[0].count < 0.0 else self.lamps[0].lumens,
            opening=self._opening(),
            keywords=keywords,
            at=self.at,
        )

    def _opening(self) -> Opening:
        """The luminous area; without one the luminaire's own size. A width of 0 is a circle."""
        metres = [_metres(size) for size in (*self.opening, *self.housing)]
        length, width = metres[:2] if any(metres[:2]) else metres[6:8]
        is_round = width == 0.0 and length > 0.0
        return Opening(width or length, length, max(metres[2:6]), is_round)


def read_eulumdat(data: bytes, place: SourceRef, report: Report) -> Luminaire:
    """The luminaire in the bytes of an EULUMDAT file. Raises InputError."""
    return parse_eulumdat(data, place, report).luminaire(place, report)


def parse_eulumdat(data: bytes, place: SourceRef, report: Report) -> EulumdatFile:
    """Read the bytes of an EULUMDAT file as they stand. Raises InputError."""
    if len(data) > MOST_BYTES:
        raise InputError(place, f"{len(data)} bytes; want at most {MOST_BYTES}")
    lines = _Lines(data, place)
    if len(lines.text) < _HEADER:
        raise InputError(place, f"{len(lines.text)} lines; {_UNREADABLE}")
    symmetry = lines.count(3, "symmetry", 0, 4)
    plane_count = lines.count(4, "number of C planes", 1, MOST_ANGLES)
    angle_count = lines.count(6, "number of gamma angles", 2, MOST_ANGLES)
    sets = lines.count(26, "number of lamp sets", 1, _MOST_SETS)
    lines.number(_HEADER + 3, "luminous flux")
    lines.number(_HEADER + 1, "number of lamps")

    start = _HEADER + _LAMP * sets + _RATIOS + 1
    first = {"planes": start, "angles": start + plane_count}
    first["candela"] = first["angles"] + angle_count
    planes = lines.numbers(start, plane_count, "C planes")
    stored = len(_stored(symmetry, planes, SourceRef(place.file, 4)))
    if stored * angle_count > MOST_VALUES:
        problem = f"{stored} x {angle_count} intensities; want at most {MOST_VALUES}"
        raise InputError(place, problem)
    angles = lines.numbers(first["angles"], angle_count, "gamma angles")
    candela = lines.numbers(first["candela"], stored * angle_count, "luminous intensities")
    lines.finish(first["candela"] + stored * angle_count, report)
    type_indicator = lines.loose(2)
    return EulumdatFile(
        company=lines.text[0],
        type_indicator=int(type_indicator) if type_indicator in (0.0, 1.0, 2.0, 3.0) else -1,
        symmetry=symmetry,
        plane_step=lines.loose(5),
        angle_step=lines.loose(7),
        test=lines.text[7],
        name=lines.text[8],
        number=lines.text[9],
        file_name=lines.text[10],
        date=lines.text[11],
        housing=tuple(map(lines.loose, range(13, 16))),
        opening=tuple(map(lines.loose, range(16, 22))),
        downward=lines.loose(22),
        output_ratio=lines.loose(23),
        conversion=lines.number(24, "conversion factor"),
        tilt=lines.loose(25),
        lamps=tuple(_lamp_set(lines, _HEADER + 1 + _LAMP * index) for index in range(sets)),
        ratios=np.array([lines.loose(line) for line in range(start - _RATIOS, start)]),
        planes=planes,
        angles=angles,
        candela=candela.reshape(stored, angle_count),
        unreadable=tuple(lines.unreadable),
        at=lambda part, index: SourceRef(place.file, first[part] + index),
    )


def write_eulumdat(file: EulumdatFile) -> bytes:
    """The bytes of an EULUMDAT file, every digit kept: ``parse_eulumdat`` gives ``file``.

    Latin-1, or UTF-8 where that cannot say it: see ``file_text``.
    """
    lines: list[str] = [file.company]
    lines += map(str, (file.type_indicator, file.symmetry, len(file.planes)))
    lines += [plain(file.plane_step), str(len(file.angles)), plain(file.angle_step)]
    lines += [file.test, file.name, file.number, file.file_name, file.date]
    lines += map(plain, (*file.housing, *file.opening))
    lines += map(plain, (file.downward, file.output_ratio, file.conversion, file.tilt))
    lines += [str(len(file.lamps))]
    for lamp in file.lamps:
        lines += [plain(lamp.count), lamp.name, plain(lamp.lumens), lamp.colour, lamp.rendering]
        lines += [plain(lamp.watts)]
    for values in (file.ratios, file.planes, file.angles, file.candela):
        lines += map(plain, values.ravel().tolist())
    return encoded("".join(f"{line}\r\n" for line in lines))


def _lamp_set(lines: _Lines, line: int) -> LampSet:
    return LampSet(
        count=lines.loose(line),
        name=lines.text[line],
        lumens=lines.loose(line + 2),
        colour=lines.text[line + 2],
        rendering=lines.text[line + 3],
        watts=lines.loose(line + 5),
    )


def listed_alone(symmetry: int, planes: Doubles) -> bool:
    """Whether the C planes are only those that the symmetry leaves, and not the whole turn.

    The format wants all of them. What is meant is plain, as the ends are those of the symmetry.
    """
    return any(np.abs(planes[[0, -1]] - ends).max() <= _NEAR for ends in _ENDS.get(symmetry, ()))


def listed_twice(planes: Doubles) -> bool:
    """Whether the C planes end with the first one again, at 360."""
    return bool(np.abs(planes[[0, -1]] - (0.0, 360.0)).max() <= _NEAR)


def _stored(symmetry: int, planes: Doubles, place: SourceRef) -> Indices:
    """Indices, from 0, of the C planes whose intensities the file has, in its order."""
    if symmetry == 1:
        return np.arange(1)
    count = len(planes)
    if listed_alone(symmetry, planes):
        return np.arange(count)
    if symmetry in (2, 4) and listed_twice(planes):
        count -= 1
    parts = {0: 1, 2: 2, 3: 4, 4: 4}[symmetry]
    if count % parts:
        raise InputError(
            place, f"{count} C planes; symmetry {symmetry} wants a multiple of {parts}"
        )
    if symmetry == 3:  # from C 270 over 360 = 0 to C 90
        return np.arange(3 * count // 4, 3 * count // 4 + count // 2 + 1) % count
    return np.arange({0: count, 2: count // 2 + 1, 4: count // 4 + 1}[symmetry])


def _stored_planes(symmetry: int, planes: Doubles, chosen: Indices, at: At) -> Doubles:
    """Their angles, ascending: -90 to 90 for symmetry 3. InputError where they do not fit."""
    angles = planes[chosen]
    if symmetry == 1:
        return np.zeros(1)
    if symmetry == 3 and not listed_alone(symmetry, planes):
        angles = np.where(np.arange(len(angles)) < len(planes) // 4, angles - 360.0, angles)
    ends = _ENDS.get(symmetry)
    if ends is not None and all(np.abs(angles[[0, -1]] - end).max() > _NEAR for end in ends):
        (first, last), *_ = ends
        text = f"C planes {angles[0]:g} to {angles[-1]:g} of symmetry {symmetry}"
        wrong = 0 if abs(angles[0] - first) > _NEAR else -1
        problem = f"{text}; want {first:g} to {last:g}"
        raise InputError(at("planes", int(chosen[wrong])), problem)
    return np.asarray(angles)


def _metres(size: float) -> float:
    """A length of the file; it is no part of the light, so what cannot be one is 0."""
    value = size * _MILLIMETRE
    return value if 0.0 < value < 1e6 else 0.0


class _Lines:
    """The lines of a file, counted from 1 as the format does."""

    def __init__(self, data: bytes, place: SourceRef) -> None:
        lines = decoded(data).split("\n", _MOST_LINES)[:_MOST_LINES]
        self.text = [line.strip(" \t\x00\x1a") for line in lines]
        self.place = place
        self.unreadable: list[int] = []

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

    def loose(self, line: int) -> float:
        """A number that is no part of the light: 0, and noted, where it is none."""
        value = _number(self.text[line - 1]) if line <= len(self.text) else math.nan
        if math.isfinite(value):
            return value
        self.unreadable.append(line)
        return 0.0

    def finish(self, line: int, report: Report) -> None:
        """A finding where more follows."""
        rest = sum(bool(text) for text in self.text[line - 1 :])
        if rest:
            text = f"{rest} lines after the last intensity are not read"
            report.add(Kind.DROPPED, "profile-trailing", SourceRef(self.place.file, line), "", text)


def _number(text: str) -> float:
    """A number with a decimal point or comma; NaN for anything else."""
    if "_" in text:
        return math.nan
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan
