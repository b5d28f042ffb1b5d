"""Where an EULUMDAT file that can be read differs from its format, line by line."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.photometry.conversion import LDT_TEXT
from hdrusd.photometry.distribution import cumulative_flux
from hdrusd.photometry.eulumdat import EulumdatFile, listed_alone, listed_twice
from hdrusd.photometry.luminaire import Doubles, Luminaire
from hdrusd.report import Kind, Report

#: Percent by which a stated share may differ: 0.5 by rounding, 1 by how others integrate.
_PERCENT = 1.5

#: Lines of text, and what they are.
_TEXTS = {1: "company", 8: "report", 9: "name", 10: "number", 12: "date"}

#: Degrees by which angles may be off the step that a file states.
_STEP_ROOM = 0.01


class _Tell(Protocol):
    def __call__(self, code: str, line: int, text: str, kind: Kind = ...) -> None: ...


def check_eulumdat(
    file: EulumdatFile, luminaire: Luminaire, place: SourceRef, report: Report
) -> None:
    """A finding for each deviation."""

    def tell(code: str, line: int, text: str, kind: Kind = Kind.INVALID) -> None:
        report.add(kind, code, SourceRef(place.file, line), "", text)

    for line in file.unreadable:
        tell("photometric-number", line, "no number; read as 0")
    texts = (file.company, file.test, file.name, file.number, file.date)
    for (line, what), text in zip(_TEXTS.items(), texts, strict=True):
        if len(text) > LDT_TEXT:
            tell(
                "photometric-header",
                line,
                f"{what}: {len(text)} characters; want at most {LDT_TEXT}",
            )
    for line, what, missing in ((9, "name", not file.name), (1, "company", not file.company)):
        if missing:
            tell("photometric-header", line, f"no {what}", Kind.MISSING)
    if file.type_indicator < 0:
        tell("photometric-number", 2, "type indicator; want 1, 2 or 3")
    elif (file.type_indicator == 1) != (file.symmetry == 1):
        text = f"type indicator {file.type_indicator}, but symmetry {file.symmetry}"
        tell("photometric-symmetry", 2, f"{text}; both 1 for a figure of rotation")
    for line, what, stated, values in (
        (5, "C planes", file.plane_step, _turn(file)),
        (7, "gamma angles", file.angle_step, file.angles),
    ):
        if stated != 0.0 and len(values) > 2 and not _has_step(values, stated):
            tell(
                "photometric-angles",
                line,
                f"step {stated:g}, but {what} have another; want 0 for uneven ones",
            )
    if file.angles[0] != 0.0 and file.angles[0] != 90.0:
        text = f"gamma starts at {file.angles[0]:g}; want 0"
        report.add(Kind.INVALID, "photometric-angles", file.at("angles", 0), "", text)
    _check_planes(file, report)
    _check_lamps(file, tell)
    _check_shares(file, luminaire, tell)


def _turn(file: EulumdatFile) -> Doubles:
    """The C planes with the first one once more, where all of the turn is listed."""
    if listed_alone(file.symmetry, file.planes) or listed_twice(file.planes):
        return file.planes
    return np.append(file.planes, file.planes[0] + 360.0)


def _check_planes(file: EulumdatFile, report: Report) -> None:
    def tell(index: int, text: str) -> None:
        place = file.at("planes", index)
        report.add(Kind.INVALID, "photometric-angles", place, "", text)

    last = len(file.planes) - 1
    first, end = float(file.planes[0]), float(file.planes[last])
    if first != 0.0:
        tell(0, f"C planes start at {first:g}; want 0")
    if listed_twice(file.planes):
        tell(last, f"C plane {end:g} is the first one again; want those below 360")
    elif listed_alone(file.symmetry, file.planes):
        tell(last, f"C planes end at {end:g}, as symmetry {file.symmetry} does; want all round")


def _check_lamps(file: EulumdatFile, tell: _Tell) -> None:
    lamp = file.lamps[0]
    if lamp.count == 0.0 or lamp.count != round(lamp.count):
        tell(
            "photometric-number", 27, f"{lamp.count:g} lamps; want 1 or more, or below 0 (absolute)"
        )
    if lamp.watts <= 0.0:
        tell("photometric-number", 32, f"{lamp.watts:g} W; want more than 0")
    if file.conversion != 1.0:
        tell(
            "photometric-factor",
            24,
            f"intensities are multiplied by {file.conversion:g}",
            Kind.ASSUMED,
        )
    if file.tilt != 0.0:
        text = f"measured at a tilt of {file.tilt:g} degrees, which is not applied"
        tell("photometric-factor", 25, text, Kind.ASSUMED)
    if min(file.housing + file.opening) < 0.0:
        line = 13 + int(np.argmax(np.less((*file.housing, *file.opening), 0.0)))
        tell("photometric-opening", line, "a size below 0; read as 0")
    if ((file.ratios < 0.0) | (file.ratios > 1.0)).any() or (np.diff(file.ratios) < 0.0).any():
        line = 27 + 6 * len(file.lamps)
        tell("photometric-number", line, "direct ratios; want 0 to 1, none below the one before")


def _check_shares(file: EulumdatFile, luminaire: Luminaire, tell: _Tell) -> None:
    down, flux = cumulative_flux(luminaire, [90.0, 180.0]).tolist()
    found = 100.0 * flux / file.lamps[0].lumens
    if abs(found - file.output_ratio) > _PERCENT:
        text = f"light output ratio {file.output_ratio:g} %, but the intensities give {found:.4g} %"
        tell("photometric-flux", 23, text)
    share = 100.0 * down / flux if flux > 0.0 else 0.0
    if flux > 0.0 and abs(share - file.downward) > _PERCENT:
        text = f"{file.downward:g} % of the flux downwards, but the intensities give {share:.4g} %"
        tell("photometric-flux", 22, text)


def _has_step(values: Doubles, step: float) -> bool:
    return bool(np.abs(np.diff(values) - step).max() <= _STEP_ROOM)
