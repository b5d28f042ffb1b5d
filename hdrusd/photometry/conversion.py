"""LM-63 into EULUMDAT and back: the same candela in the same directions, to seven digits.

C planes keep their numbers. The length of an opening lies along C = 0 in LM-63 and along
C = 90 in EULUMDAT, so width and length change places. LM-63 is written as LM-63-2002: what
reads the edition of 2019 reads that of 2002 too, and its label and its unused factor of 1
claim nothing about how the numbers were made. What a format has no place for is a finding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.distribution import cumulative_flux
from hdrusd.photometry.eulumdat import EulumdatFile, LampSet
from hdrusd.photometry.ies import IesFile
from hdrusd.photometry.luminaire import MOST_ANGLES, MOST_VALUES, Doubles, Luminaire
from hdrusd.report import Kind, Report

#: LM-63-2002 wants them in every file.
REQUIRED = ("TEST", "TESTLAB", "ISSUEDATE", "MANUFAC")

#: Characters of a line of text in EULUMDAT, and of one in LM-63-2002 less its keyword.
LDT_TEXT = 78
_IES_TEXT = 236

_NOT_STATED = "not stated"

#: Lumens a candela at least, which keeps cd/klm below 1e9.
_LEAST_LUMENS = 1e-6

#: Keywords that EULUMDAT has lines for; the last two are our own, for the lamp's.
_CARRIED = {"TEST", "ISSUEDATE", "DATE", "MANUFAC", "LUMCAT", "LUMINAIRE", "LAMP", "LAMPCAT"}
_COLOUR, _RENDERING = "CCT", "CRI"


def to_ies(file: IesFile | EulumdatFile, place: SourceRef, report: Report) -> IesFile:
    """The same luminaire as LM-63-2002. Raises InputError."""
    if isinstance(file, EulumdatFile):
        return _ies_of_eulumdat(file, place, report)
    luminaire = file.luminaire(place, report)
    if file.edition == 2019:
        _lost(report, place, f"the file generation {file.companion:g}")
    planes, candela = _closed(replace(luminaire, candela=np.maximum(file.candela, 0.0)))
    keywords = _with_free_text(file, place, report)
    return replace(
        file,
        edition=2002,
        keywords=_complete(keywords, place, report),
        multiplier=file.multiplier * (file.companion if file.edition <= 1991 else 1.0),
        companion=1.0,
        planes=planes,
        candela=candela,
        head="",
    )


def to_eulumdat(file: IesFile | EulumdatFile, place: SourceRef, report: Report) -> EulumdatFile:
    """The same luminaire as EULUMDAT. Raises InputError, as for LM-63 of types A and B."""
    if isinstance(file, EulumdatFile):
        file.luminaire(place, report)
        return file
    if file.type != "C":
        raise InputError(place, f"photometry of type {file.type}; EULUMDAT has type C alone")
    luminaire = file.luminaire(place, report)
    flux = luminaire.flux()
    peak = float(luminaire.candela.max())
    stated = file.lamp_lumens or 0.0
    absolute = stated < _LEAST_LUMENS * peak or stated == 0.0
    lumens = stated
    if absolute:
        lumens = _rounded(max(flux, _LEAST_LUMENS * peak)) if peak > 0.0 else 1000.0
    symmetry, planes, candela = _stored(file, luminaire, place, report)
    text = _Texts(place, report)
    keys = file.keywords
    lamp = LampSet(
        count=-max(abs(file.lamps), 1.0) if absolute else file.lamps,
        name=text.cut("LAMP", keys.get("LAMP") or keys.get("LAMPCAT") or _NOT_STATED),
        lumens=lumens,
        colour=text.cut(_COLOUR, keys.get(_COLOUR, "")),
        rendering=text.cut(_RENDERING, keys.get(_RENDERING, "")),
        watts=file.watts,
    )
    _tell_what_eulumdat_lacks(file, place, report)
    down = float(cumulative_flux(luminaire, [90.0])[0])
    sizes = _millimetres(luminaire)
    return EulumdatFile(
        company=text.cut("MANUFAC", keys.get("MANUFAC", "")),
        type_indicator=1 if symmetry == 1 else 3,
        symmetry=symmetry,
        plane_step=_step(np.append(planes, 360.0)),
        angle_step=_step(file.angles),
        test=text.cut("TEST", keys.get("TEST", "")),
        name=text.cut("LUMINAIRE", keys.get("LUMINAIRE", "")),
        number=text.cut("LUMCAT", keys.get("LUMCAT", "")),
        file_name=text.cut("file name", place.file.with_suffix(".ldt").name),
        date=text.cut("ISSUEDATE", keys.get("ISSUEDATE") or keys.get("DATE") or ""),
        housing=sizes[:3],
        opening=(*sizes[:2], *[sizes[2]] * 4),
        downward=round(100.0 * down / flux, 2) if flux > 0.0 else 0.0,
        output_ratio=round(100.0 * flux / lumens, 2),
        conversion=1.0,
        tilt=0.0,
        lamps=(lamp,),
        ratios=np.zeros(10),
        planes=planes,
        angles=file.angles,
        candela=_seven(candela * (1000.0 / lumens)),
        unreadable=(),
        at=file.at,
    )


def _ies_of_eulumdat(file: EulumdatFile, place: SourceRef, report: Report) -> IesFile:
    luminaire = file.luminaire(place, report)
    lamp = file.lamps[0]
    count = max(abs(lamp.count), 1.0)
    text = _Texts(place, report, _IES_TEXT)
    said = {
        "TEST": file.test,
        "ISSUEDATE": file.date,
        "MANUFAC": file.company,
        "LUMCAT": file.number,
        "LUMINAIRE": file.name,
        "LAMP": lamp.name,
        _COLOUR: lamp.colour,
        _RENDERING: lamp.rendering,
    }
    keywords = {key: text.cut(key, value) for key, value in said.items() if value.strip()}
    if file.ratios.any():
        _lost(report, place, "the direct ratios")
    if file.tilt != 0.0:
        _lost(report, place, f"the tilt of {file.tilt:g} degrees at which it was measured")
    if any(file.opening[:2]) and any(file.housing):
        _lost(report, place, "the size of the housing")
    if len(set(file.opening[2:])) > 1:
        _lost(report, place, "heights of the opening that differ by plane; the largest is kept")
    opening = luminaire.opening
    sign = -1.0 if opening.round else 1.0
    planes, candela = _closed(luminaire)
    return IesFile(
        edition=2002,
        keywords=_complete(keywords, place, report),
        tilt=None,
        lamps=1.0 if luminaire.lumens is None else count,
        lumens=-1.0 if luminaire.lumens is None else luminaire.lumens / count,
        multiplier=1.0,
        type="C",
        feet=False,
        size=(
            sign * _rounded(opening.y),
            sign * _rounded(opening.x),
            _rounded(opening.height),
        ),
        ballast=1.0,
        companion=1.0,
        watts=max(lamp.watts, 0.0),
        angles=file.angles,
        planes=_seven(planes),
        candela=_seven(candela),
        head="",
        at=file.at,
    )


def _with_free_text(file: IesFile, place: SourceRef, report: Report) -> Mapping[str, str]:
    """The keywords, and behind [OTHER] what stands without one, in lines that are not too long."""
    text = _Texts(place, report, _IES_TEXT)
    said = [
        text.cut("OTHER", line[start : start + _IES_TEXT])
        for line in file.free_text
        for start in range(0, len(line), _IES_TEXT)
    ]
    if not said:
        return file.keywords
    other = file.keywords.get("OTHER")
    return {**file.keywords, "OTHER": "\n".join(said if other is None else [other, *said])}


def _closed(luminaire: Luminaire) -> tuple[Doubles, Doubles]:
    """Planes as LM-63 has them: 90 to 270 for -90 to 90, and a whole turn from 0 to 360."""
    planes, candela = luminaire.planes, luminaire.candela
    if luminaire.type != "C":
        return planes, candela
    if len(planes) == 1:
        return np.zeros(1), candela
    if planes[0] == -90.0 and planes[-1] == 90.0:  # I(C) = I(180 - C)
        return 180.0 - planes[::-1], candela[::-1]
    if (planes[0], planes[-1]) in ((0.0, 90.0), (0.0, 180.0), (90.0, 270.0)):
        return planes, candela
    return luminaire.unfolded()


def _stored(
    file: IesFile, luminaire: Luminaire, place: SourceRef, report: Report
) -> tuple[int, Doubles, Doubles]:
    """EULUMDAT's symmetry, all of its C planes, and the candela of those it stores."""
    ends = float(luminaire.planes[0]), float(luminaire.planes[-1])
    turn, candela = luminaire.unfolded()
    planes = _seven(turn[:-1])
    quarter = len(planes) // 4
    symmetry = {(0.0, 90.0): 4, (0.0, 180.0): 2}.get(ends, 0)
    rows = luminaire.candela if symmetry else candela[:-1]
    if len(luminaire.planes) == 1:
        symmetry, planes, rows = 1, np.zeros(1), luminaire.candela
    elif ends in ((90.0, 270.0), (-90.0, 90.0)):
        if len(planes) % 4 == 0 and (planes[quarter], planes[3 * quarter]) == (90.0, 270.0):
            symmetry = 3
            rows = candela[np.arange(3 * quarter, 5 * quarter + 1) % len(planes)]
    elif ends[1] == ends[0] + 360.0 and (luminaire.candela[0] != luminaire.candela[-1]).any():
        what = f"plane {ends[1]:g}, other than plane {ends[0]:g}"
        _lost(report, file.at("planes", len(luminaire.planes) - 1), what)
    if len(planes) > MOST_ANGLES or rows.size > MOST_VALUES:
        raise InputError(place, f"{len(planes)} C planes without symmetry; want fewer planes")
    return symmetry, planes, rows


def _tell_what_eulumdat_lacks(file: IesFile, place: SourceRef, report: Report) -> None:
    text = "LM-63 has none of these: type indicator 3, direct ratios 0, housing as the opening"
    report.add(Kind.ASSUMED, "photometric-filled", place, "", text)
    if file.free_text:
        _lost(report, place, "text without a keyword")
    others = sorted(file.keywords.keys() - _CARRIED - {_COLOUR, _RENDERING, ""})
    if others:
        _lost(report, place, f"keywords {', '.join(others)}")
    if file.tilt is not None:
        _lost(report, place, "the lamp's output by tilt; it is that of a level luminaire")
    if file.edition == 2019:
        _lost(report, place, f"the file generation {file.companion:g}")
    width, length, height = file.size
    flat_circle = width == length < 0.0 <= height or (width < 0.0 and length == height == 0.0)
    if min(file.size) < 0.0 and not flat_circle:
        _lost(report, place, "the shape of the opening, which is no rectangle and no circle")


def _complete(keywords: Mapping[str, str], place: SourceRef, report: Report) -> dict[str, str]:
    """The required keywords first; "not stated" where there is none."""
    missing = [key for key in REQUIRED if not keywords.get(key)]
    if missing:
        text = f"{', '.join(missing)}: {_NOT_STATED}, which LM-63-2002 requires"
        report.add(Kind.ASSUMED, "photometric-filled", place, "", text)
    return {key: keywords.get(key) or _NOT_STATED for key in REQUIRED} | {
        key: value for key, value in keywords.items() if key not in REQUIRED
    }


def _lost(report: Report, place: SourceRef, what: str) -> None:
    report.add(Kind.DROPPED, "photometric-lost", place, "", f"{what}: no place in the new file")


def _millimetres(luminaire: Luminaire) -> tuple[float, float, float]:
    """Length along C 90, width along C 0, 0 of a circle, and height."""
    opening = luminaire.opening
    circle = opening.round and opening.x == opening.y
    sizes = (opening.y, 0.0 if circle else opening.x, opening.height)
    length, width, height = (_rounded(1000.0 * size) for size in sizes)
    return length, width, height


def _step(values: Doubles) -> float:
    """The step of even values, else 0."""
    steps = np.diff(values)
    return _rounded(float(steps[0])) if np.ptp(steps) < 1e-6 and steps[0] < 360.0 else 0.0


def _rounded(value: float) -> float:
    return float(f"{value:.7g}")


def _seven(values: Doubles) -> Doubles:
    """Seven significant digits: of candela more than any goniophotometer has."""
    rounded = [_rounded(value) for value in values.ravel().tolist()]
    return np.array(rounded, np.float64).reshape(values.shape)


class _Texts:
    """Texts as lines of the other format; what is cut is a finding."""

    def __init__(self, place: SourceRef, report: Report, most: int = LDT_TEXT) -> None:
        self.place, self.report, self.most = place, report, most

    def cut(self, what: str, text: str) -> str:
        """One line without control characters."""
        line = "".join(c if c.isprintable() else " " for c in text).strip()
        kept = line[: self.most].strip()
        if kept != line:
            _lost(self.report, self.place, f"{what}: what is beyond {self.most} letters")
        return kept
