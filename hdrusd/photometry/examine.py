"""A photometric file of either format, examined: what it says, and all that is odd about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.photometry.eulumdat import EulumdatFile, parse_eulumdat
from hdrusd.photometry.eulumdat_check import check_eulumdat
from hdrusd.photometry.ies import IesFile, is_ies, parse_ies
from hdrusd.photometry.ies_check import check_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.report import Kind, Report

#: Share of the peak by which candela of one direction may differ.
_ROOM = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Examined:
    """A file as it stands, and the luminaire that it means."""

    file: IesFile | EulumdatFile
    luminaire: Luminaire


def examine(
    data: bytes,
    place: SourceRef,
    report: Report,
    tilt_file: Callable[[str], bytes | None] = lambda name: None,
) -> Examined:
    """Read the bytes of a file by what they look like, and check them.

    Each deviation is a finding at its line; InputError, after what was found so far, for
    what makes the candela unknown.
    """
    if is_ies(data) or place.file.suffix.lower() == ".ies":
        ies = parse_ies(data, place, report, tilt_file)
        check_ies(ies, place, report)
        luminaire = ies.luminaire(place, report)
        _check_lumens(ies, luminaire, report)
        file: IesFile | EulumdatFile = ies
    else:
        file = parse_eulumdat(data, place, report)
        luminaire = file.luminaire(place, report)
        check_eulumdat(file, luminaire, place, report)
    if luminaire.type == "C":
        _check_directions(file, luminaire, report)
    return Examined(file, luminaire)


def _check_lumens(file: IesFile, luminaire: Luminaire, report: Report) -> None:
    stated, flux = file.lamp_lumens, luminaire.flux()
    if stated is not None and flux > stated * (1.0 + _ROOM):
        text = f"lamps of {stated:g} lm, but the candela give {flux:.5g} lm"
        place = file.at("lamps, lumens and multiplier", 1)
        report.add(Kind.INVALID, "photometric-flux", place, "", text)


def _check_directions(file: IesFile | EulumdatFile, luminaire: Luminaire, report: Report) -> None:
    """Nadir and zenith are one direction in all planes; after a whole turn the first is again."""
    candela = luminaire.candela
    room = _ROOM * float(candela.max())
    for column, pole in ((0, 0.0), (len(luminaire.angles) - 1, 180.0)):
        values = candela[:, column]
        if luminaire.angles[column] == pole and np.ptp(values) > room:
            text = f"{values.min():g} to {values.max():g} cd at gamma {pole:g}, by the plane"
            report.add(Kind.INVALID, "photometric-pole", file.at("candela", column), "", text)
    last = len(luminaire.planes) - 1
    first, end = float(luminaire.planes[0]), float(luminaire.planes[last])
    whole = isinstance(file, IesFile) and end - first == 360.0
    if whole and np.abs(candela[0] - candela[last]).max() > room:
        text = f"plane {end:g} differs from plane {first:g}, which is the same"
        report.add(Kind.INVALID, "photometric-symmetry", file.at("planes", last), "", text)
