"""IES LM-63 photometric files: 1986, 1991, 1995, 2002 and 2019.

IESNA LM-63-2002 and ANSI/IES LM-63-19; candela = value x multiplier x ballast factor, and
x the ballast-lamp photometric factor in 1986 and 1991 alone: the later editions keep its
place for other things. The lumens of the lamps do not scale anything.

``parse_ies`` and ``write_ies`` have a file as it stands, ``IesFile.luminaire`` what it means.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.file_text import decoded, encoded
from hdrusd.photometry.ies_numbers import Numbers
from hdrusd.photometry.luminaire import (
    MOST_ANGLES,
    MOST_BYTES,
    MOST_VALUES,
    At,
    Doubles,
    Luminaire,
    Opening,
    Type,
    checked,
    plain,
)
from hdrusd.report import Kind, Report

_FOOT = 0.3048  # m

#: First line of each edition; 1986 has none.
LABELS = {
    1986: "",
    1991: "IESNA91",
    1995: "IESNA:LM-63-1995",
    2002: "IESNA:LM-63-2002",
    2019: "IES:LM-63-2019",
}

_DEFINED = """
TEST TESTLAB TESTDATE TESTMETHOD NEARFIELD ISSUEDATE DATE MANUFAC LUMCAT LUMINAIRE LAMPCAT LAMP
BALLASTCAT BALLAST MAINTCAT DISTRIBUTION FLASHAREA COLORCONSTANT LAMPPOSITION FILEGENINFO OTHER
SEARCH BLOCK ENDBLOCK
"""

#: Keywords that LM-63 defines; a user's own begin with an underscore.
KEYWORDS = frozenset(_DEFINED.split())

#: "IESNA91", "IESNA:LM-63-1995", "IES:LM-63-2019"
_LABEL = re.compile(r"IES(?:NA)?\s*:?\s*(?:LM-?63-?)?\s*(?:19|20)?(86|91|95|02|19)\b", re.I)
_EDITIONS = {"86": 1986, "91": 1991, "95": 1995, "02": 2002, "19": 2019}
_TILT = re.compile(r"^[ \t]*TILT[ \t]*=[ \t]*([^\r\n]*)", re.I | re.M)
_KEYWORD = re.compile(r"\s*\[([^\[\]]{1,40})\]\s*(.*)")
_TYPES: dict[int, Type] = {1: "C", 2: "B", 3: "A"}

#: Lines of one lamp's tilt: more angles than a goniometer has stops are no tilt.
_MOST_TILT = 1024

#: Numbers a line: ten of 17 digits stay below the 256 characters of LM-63-2002.
_A_LINE = 10


@dataclass(frozen=True, slots=True, eq=False)
class Tilt:
    """The share of its light that a lamp gives at angles of tilt, degrees."""

    geometry: float  # 1 the lamp is vertical, 2 horizontal in any tilt, 3 tilts along
    angles: Doubles
    factors: Doubles


@dataclass(frozen=True, slots=True, eq=False)
class IesFile:
    """What an LM-63 file says, in its own numbers and units."""

    edition: int
    keywords: Mapping[str, str]  # without underscores; the lines of [MORE] follow a line feed
    tilt: Tilt | None
    lamps: float
    lumens: float  # of one lamp; -1 for absolute photometry
    multiplier: float
    type: Type
    feet: bool
    size: tuple[float, float, float]  # width, length, height of the opening; signs tell its shape
    ballast: float
    companion: float  # 1986, 1991 photometric factor; 1995, 2002 unused; 2019 file generation
    watts: float
    angles: Doubles  # (n,)
    planes: Doubles  # (m,)
    candela: Doubles  # (m, n), before any factor
    head: str  # what stands before TILT=
    at: At

    @property
    def lamp_lumens(self) -> float | None:
        """Lumens of all lamps; None of absolute photometry."""
        return self.lamps * self.lumens if self.lamps > 0.0 and self.lumens > 0.0 else None

    @property
    def free_text(self) -> list[str]:
        """The lines without a keyword, as 1986 has them, less the label and empty ones."""
        lines = self.head.split("\n")
        at = label_line(lines)
        return [
            line.strip()
            for number, line in enumerate(lines)
            if line.strip() and number != at and keyword(line) is None
        ]

    @property
    def factor(self) -> float:
        """What the candela are multiplied by, in a level luminaire."""
        factor = self.multiplier * self.ballast
        if self.edition <= 1991:
            factor *= self.companion
        if self.tilt is not None:
            factor *= float(np.interp(0.0, self.tilt.angles, self.tilt.factors))
        return factor

    def luminaire(self, place: SourceRef, report: Report) -> Luminaire:
        """What the file means. Raises InputError."""
        keywords = self.keywords
        return checked(
            place,
            report,
            name=keywords.get("LUMINAIRE") or keywords.get("LUMCAT") or place.file.name,
            type=self.type,
            planes=self.planes,
            angles=self.angles,
            candela=self.candela,
            factor=self.factor,
            lumens=self.lamp_lumens,
            opening=_opening(*self.size, _FOOT if self.feet else 1.0),
            keywords=keywords,
            at=self.at,
        )


def is_ies(data: bytes) -> bool:
    """Whether bytes look like LM-63 rather than EULUMDAT: every LM-63 file has a TILT line."""
    return _TILT.search(decoded(data[:MOST_BYTES])) is not None


def read_ies(
    data: bytes,
    place: SourceRef,
    report: Report,
    tilt_file: Callable[[str], bytes | None] = lambda name: None,
) -> Luminaire:
    """The luminaire in the bytes of an LM-63 file; see ``parse_ies``. Raises InputError."""
    return parse_ies(data, place, report, tilt_file).luminaire(place, report)


def parse_ies(
    data: bytes,
    place: SourceRef,
    report: Report,
    tilt_file: Callable[[str], bytes | None] = lambda name: None,
) -> IesFile:
    """Read the bytes of an LM-63 file as they stand. Raises InputError.

    ``tilt_file``: the bytes of the file that ``TILT=name`` names, None where there is none.
    """
    if len(data) > MOST_BYTES:
        raise InputError(place, f"{len(data)} bytes; want at most {MOST_BYTES}")
    text = decoded(data)
    tilt = _TILT.search(text)
    if tilt is None:
        raise InputError(place, "no TILT= line; want an IES LM-63 file")
    head = text[: tilt.start()]
    edition, keywords = _header(head, place, report)
    line = text.count("\n", 0, tilt.end()) + 1
    numbers = Numbers(text[tilt.end() :], SourceRef(place.file, line))
    tilted = _tilt(tilt[1].strip(), numbers, report, tilt_file)

    lamps, lumens, multiplier = numbers.take(3, "lamps, lumens and multiplier").tolist()
    sizes = numbers.counts(2, "counts of angles", MOST_ANGLES)
    if sizes[0] * sizes[1] > MOST_VALUES:
        problem = f"{sizes[0]} x {sizes[1]} candela; want at most {MOST_VALUES}"
        raise numbers.problem("counts of angles", 0, problem)
    type_code, units = numbers.counts(2, "photometric type and units", 3)
    if type_code not in _TYPES or units not in (1, 2):
        problem = f"type {type_code}, units {units}; want type 1, 2 or 3, units 1 or 2"
        raise numbers.problem("photometric type and units", 0, problem)
    width, length, height = numbers.take(3, "width, length and height").tolist()
    ballast, companion, watts = numbers.take(3, "ballast factor, its companion and watts").tolist()
    angles = numbers.take(sizes[0], "vertical angles")
    planes = numbers.take(sizes[1], "horizontal angles")
    candela = numbers.take(sizes[0] * sizes[1], "candela").reshape(sizes[1], sizes[0])
    numbers.finish("candela", report)
    return IesFile(
        edition=edition,
        keywords=keywords,
        tilt=tilted,
        lamps=lamps,
        lumens=lumens,
        multiplier=multiplier,
        type=_TYPES[type_code],
        feet=units == 1,
        size=(width, length, height),
        ballast=ballast,
        companion=companion,
        watts=watts,
        angles=angles,
        planes=planes,
        candela=candela,
        head=head,
        at=numbers.at,
    )


def write_ies(file: IesFile) -> bytes:
    """The bytes of an LM-63 file, every digit kept: ``parse_ies`` of them gives ``file``.

    ASCII as LM-63 wants it, but for texts that have other letters: see ``file_text``.
    """
    lines = [LABELS[file.edition]] if LABELS[file.edition] else []
    for key, value in file.keywords.items():
        name = key if key in KEYWORDS else f"_{key}"
        first, *more = value.split("\n")
        lines += [f"[{name}] {first}".rstrip(), *(f"[MORE] {line}".rstrip() for line in more)]
    lines += ["TILT=NONE"] if file.tilt is None else _tilt_lines(file.tilt)
    code = next(code for code, type in _TYPES.items() if type == file.type)
    counts = f"{len(file.angles)} {len(file.planes)} {code} {1 if file.feet else 2}"
    lamps = _row([file.lamps, file.lumens, file.multiplier])
    lines += [f"{lamps} {counts} {_row(file.size)}"]
    lines += [_row([file.ballast, file.companion, file.watts])]
    lines += [*_wrapped(file.angles), *_wrapped(file.planes)]
    for plane in file.candela:
        lines += _wrapped(plane)
    return encoded("".join(f"{line}\r\n" for line in lines))


def _row(values: Iterable[float]) -> str:
    return " ".join(map(plain, values))


def _wrapped(values: Doubles) -> list[str]:
    listed = values.tolist()
    return [_row(listed[i : i + _A_LINE]) for i in range(0, len(listed), _A_LINE)]


def with_tilt(data: bytes, file: IesFile) -> bytes:
    """The bytes that ``file`` was read from, made to stand alone.

    The numbers of the file that ``TILT=name`` names are put into its place, as LM-63 has them
    behind ``TILT=INCLUDE``. As it was where there is no such file.
    """
    text = decoded(data)
    tilt = _TILT.search(text)
    if tilt is None or file.tilt is None or tilt[1].strip().upper() == "INCLUDE":
        return data
    lines = "\n".join(_tilt_lines(file.tilt))
    return encoded(f"{text[: tilt.start()]}{lines}{text[tilt.end() :]}")


def _tilt_lines(tilt: Tilt) -> list[str]:
    head = ["TILT=INCLUDE", plain(tilt.geometry), str(len(tilt.angles))]
    return [*head, *_wrapped(tilt.angles), *_wrapped(tilt.factors)]


def _header(text: str, place: SourceRef, report: Report) -> tuple[int, dict[str, str]]:
    """The edition by its label, and the keywords; [MORE] goes on with the last one."""
    lines = text.split("\n")
    at = label_line(lines)
    label = None if at is None else _LABEL.match(lines[at].strip())
    if label is None:
        edition = 1986 if at is None else 2019
        text = f"{'no' if at is None else 'an unknown'} edition label; read as LM-63-{edition}"
        report.add(Kind.ASSUMED, "profile-edition", SourceRef(place.file, (at or 0) + 1), "", text)
    else:
        edition = _EDITIONS[label[1]]
    keywords: dict[str, list[str]] = {}
    last = ""
    for line in lines:
        found = keyword(line)
        if found is not None:
            last = last if found[0] == "MORE" else found[0]
            if last:
                keywords.setdefault(last, []).append(found[1])
    return edition, {key: "\n".join(values) for key, values in keywords.items()}


def label_line(lines: Sequence[str]) -> int | None:
    """Index of the line that names the edition, the first that is not empty; 1986 has none."""
    at = next((number for number, line in enumerate(lines) if line.strip()), None)
    return at if at is not None and lines[at].strip().upper().startswith("IES") else None


def keyword(line: str) -> tuple[str, str] | None:
    """Name and value of a line that has a keyword; a user's name is without its underscore."""
    found = _KEYWORD.match(line)
    return None if found is None else (found[1].strip().upper().lstrip("_ "), found[2].strip())


def _tilt(
    kind: str, numbers: Numbers, report: Report, tilt_file: Callable[[str], bytes | None]
) -> Tilt | None:
    """What the lamp gives at an angle, as a share of what was measured."""
    if kind.upper() == "NONE":
        return None
    place = numbers.place
    if kind.upper() != "INCLUDE":
        data = tilt_file(kind)
        if data is None or len(data) > MOST_BYTES:
            text = f"TILT={kind}: no such file; the lamp is taken to give its all"
            report.add(Kind.MISSING, "profile-tilt", place, "", text)
            return None
        numbers = Numbers(decoded(data), SourceRef(place.file, f"{kind}:1"))
    (geometry,) = numbers.take(1, "lamp to luminaire geometry").tolist()
    (count,) = numbers.counts(1, "count of tilt angles", _MOST_TILT)
    angles = numbers.take(count, "tilt angles")
    factors = numbers.take(count, "tilt factors")
    if (angles[1:] <= angles[:-1]).any() or max(np.abs(angles).max(), np.abs(factors).max()) > 360:
        problem = "tilt: want ascending angles and factors near 1"
        raise numbers.problem("tilt angles", 0, problem)
    if numbers.place != place:
        numbers.finish("tilt factor", report)
    text = "the lamp's output depends on its tilt; the luminaire is taken to be level"
    report.add(Kind.ASSUMED, "profile-tilt", place, "", text)
    return Tilt(geometry, angles, factors)


def _opening(width: float, length: float, height: float, unit: float) -> Opening:
    """LM-63 counts negative sizes as diameters; a lone one is that of a circle."""
    along, across = abs(length), abs(width)
    if width < 0.0 and length == 0.0:
        along = across
    elif length < 0.0 and width == 0.0:
        across = along
    is_round = width < 0.0 or length < 0.0
    return Opening(along * unit, across * unit, abs(height) * unit, is_round)
