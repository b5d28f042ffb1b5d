"""IES LM-63 photometric files: 1986, 1991, 1995, 2002 and 2019.

IESNA LM-63-2002 and ANSI/IES LM-63-19; candela = value x multiplier x ballast factor, and
x the ballast-lamp photometric factor in 1986 and 1991 alone: the later editions keep its
place for other things. The lumens of the lamps do not scale anything.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import islice

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.luminaire import (
    MOST_ANGLES,
    MOST_BYTES,
    MOST_VALUES,
    Doubles,
    Luminaire,
    Opening,
    Type,
    checked,
)
from hdrusd.report import Kind, Report

_FOOT = 0.3048  # m

#: "IESNA91", "IESNA:LM-63-1995", "IES:LM-63-2019"
_LABEL = re.compile(r"IES(?:NA)?\s*:?\s*(?:LM-?63-?)?\s*(?:19|20)?(86|91|95|02|19)\b", re.I)
_EDITIONS = {"86": 1986, "91": 1991, "95": 1995, "02": 2002, "19": 2019}
_TILT = re.compile(r"^[ \t]*TILT[ \t]*=[ \t]*([^\r\n]*)", re.I | re.M)
_KEYWORD = re.compile(r"\s*\[([^\[\]]{1,40})\]\s*(.*)")
_WORD = re.compile(r"[^\s,]+")
_TYPES: dict[int, Type] = {1: "C", 2: "B", 3: "A"}

#: Lines of one lamp's tilt: more angles than a goniometer has stops are no tilt.
_MOST_TILT = 1024


def is_ies(data: bytes) -> bool:
    """Whether bytes look like LM-63 rather than EULUMDAT: every LM-63 file has a TILT line."""
    return _TILT.search(_text(data[:MOST_BYTES])) is not None


def read_ies(
    data: bytes,
    place: SourceRef,
    report: Report,
    tilt_file: Callable[[str], bytes | None] = lambda name: None,
) -> Luminaire:
    """Read the bytes of an LM-63 file. Raises InputError.

    ``tilt_file``: the bytes of the file that ``TILT=name`` names, None where there is none.
    """
    if len(data) > MOST_BYTES:
        raise InputError(place, f"{len(data)} bytes; want at most {MOST_BYTES}")
    text = _text(data)
    tilt = _TILT.search(text)
    if tilt is None:
        raise InputError(place, "no TILT= line; want an IES LM-63 file")
    edition, keywords = _header(text[: tilt.start()], place, report)
    numbers = _Numbers(text[tilt.end() :], place)
    factor = _tilt_factor(tilt[1].strip(), numbers, place, report, tilt_file)

    _, lumens, multiplier = numbers.take(3, "lamps, lumens and multiplier").tolist()
    sizes = numbers.counts(2, "counts of angles", MOST_ANGLES)
    if sizes[0] * sizes[1] > MOST_VALUES:
        raise InputError(place, f"{sizes[0]} x {sizes[1]} candela; want at most {MOST_VALUES}")
    type_code, units = numbers.counts(2, "photometric type and units", 3)
    if type_code not in _TYPES or units not in (1, 2):
        raise InputError(
            place, f"type {type_code}, units {units}; want type 1, 2 or 3, units 1 or 2"
        )
    width, length, height = numbers.take(3, "width, length and height").tolist()
    ballast, photometric, _ = numbers.take(3, "ballast factor, its companion and watts").tolist()
    angles = numbers.take(sizes[0], "vertical angles")
    planes = numbers.take(sizes[1], "horizontal angles")
    candela = numbers.take(sizes[0] * sizes[1], "candela").reshape(sizes[1], sizes[0])
    numbers.finish(report)

    factor *= multiplier * ballast * (photometric if edition <= 1991 else 1.0)
    name = keywords.get("LUMINAIRE") or keywords.get("LUMCAT") or place.file.name
    return checked(
        place,
        report,
        name=name,
        type=_TYPES[type_code],
        planes=planes,
        angles=angles,
        candela=candela,
        factor=factor,
        lumens=None if lumens < 0.0 else lumens,
        opening=_opening(width, length, height, _FOOT if units == 1 else 1.0),
        keywords=keywords,
    )


def with_tilt(data: bytes, tilt_file: Callable[[str], bytes | None]) -> bytes:
    """An LM-63 file that stands alone: what ``TILT=name`` names is put into its place.

    LM-63 has the same lines behind ``TILT=INCLUDE``. As it was where there is no such file.
    """
    text = _text(data)
    tilt = _TILT.search(text)
    if tilt is None or tilt[1].strip().upper() in ("NONE", "INCLUDE"):
        return data
    included = tilt_file(tilt[1].strip())
    if included is None or len(included) > MOST_BYTES:
        return data
    lines = _text(included).strip("\n")
    return f"{text[: tilt.start()]}TILT=INCLUDE\n{lines}{text[tilt.end() :]}".encode("latin-1")


def _header(text: str, place: SourceRef, report: Report) -> tuple[int, dict[str, str]]:
    """The edition by its label, and the keywords; [MORE] goes on with the last one."""
    lines = text.splitlines()
    label = _LABEL.match(lines[0].strip()) if lines else None
    if label is None:
        named = bool(lines) and lines[0].strip().upper().startswith("IES")
        edition = 2019 if named else 1986
        text = f"{'an unknown' if named else 'no'} edition label; read as LM-63-{edition}"
        report.add(Kind.ASSUMED, "profile-edition", place, "", text)
    else:
        edition = _EDITIONS[label[1]]
    keywords: dict[str, list[str]] = {}
    last = ""
    for line in lines:
        found = _KEYWORD.match(line)
        if found is not None:
            key = found[1].strip().upper().lstrip("_")
            last = last if key == "MORE" else key
            keywords.setdefault(last, []).append(found[2].strip())
    return edition, {key: "\n".join(values) for key, values in keywords.items()}


def _text(data: bytes) -> str:
    return data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")


def _tilt_factor(
    kind: str,
    numbers: _Numbers,
    place: SourceRef,
    report: Report,
    tilt_file: Callable[[str], bytes | None],
) -> float:
    """What the lamp gives in a level luminaire, as a share of what was measured."""
    if kind.upper() == "NONE":
        return 1.0
    if kind.upper() != "INCLUDE":
        data = tilt_file(kind)
        if data is None or len(data) > MOST_BYTES:
            text = f"TILT={kind}: no such file; the lamp is taken to give its all"
            report.add(Kind.MISSING, "profile-tilt", place, "", text)
            return 1.0
        numbers = _Numbers(_text(data), place)
    numbers.take(1, "lamp to luminaire geometry")
    (count,) = numbers.counts(1, "count of tilt angles", _MOST_TILT)
    angles = numbers.take(count, "tilt angles")
    factors = numbers.take(count, "tilt factors")
    if (angles[1:] <= angles[:-1]).any() or max(np.abs(angles).max(), np.abs(factors).max()) > 360:
        raise InputError(place, "tilt: want ascending angles and factors near 1")
    text = "the lamp's output depends on its tilt; the luminaire is taken to be level"
    report.add(Kind.ASSUMED, "profile-tilt", place, "", text)
    return float(np.interp(0.0, angles, factors))


def _opening(width: float, length: float, height: float, unit: float) -> Opening:
    """LM-63 counts negative sizes as diameters; a lone one is that of a circle."""
    along, across = abs(length), abs(width)
    if width < 0.0 and length == 0.0:
        along = across
    elif length < 0.0 and width == 0.0:
        across = along
    is_round = width < 0.0 or length < 0.0
    return Opening(along * unit, across * unit, abs(height) * unit, is_round)


class _Numbers:
    """The numbers after the TILT line, one after the other, whatever stands between them."""

    def __init__(self, text: str, place: SourceRef) -> None:
        self.words = (match[0] for match in _WORD.finditer(text))
        self.place = place

    def take(self, count: int, what: str) -> Doubles:
        """The next ``count`` numbers; InputError where the file ends first."""
        chosen = list(islice(self.words, count))
        if len(chosen) < count:
            raise InputError(self.place, f"{what}: {len(chosen)} numbers left; want {count}")
        try:
            values = np.array([float(token) for token in chosen], np.float64)
        except ValueError:
            raise InputError(self.place, f"{what}: no number among them") from None
        if not np.isfinite(values).all() or any("_" in token for token in chosen):
            raise InputError(self.place, f"{what}: no finite number among them")
        return values

    def counts(self, count: int, what: str, most: int) -> list[int]:
        """The next numbers as integers from 1 to ``most``."""
        values = self.take(count, what)
        if ((values < 1) | (values > most) | (values != np.round(values))).any():
            shown = ", ".join(f"{value:g}" for value in values)
            raise InputError(self.place, f"{what}: {shown}; want integers from 1 to {most}")
        return [int(value) for value in values]

    def finish(self, report: Report) -> None:
        """A finding where something follows; DOS ends a text with 0x1A."""
        if next((word for word in self.words if word.strip("\x00\x1a")), ""):
            text = "what follows the last candela is not read"
            report.add(Kind.DROPPED, "profile-trailing", self.place, "", text)
