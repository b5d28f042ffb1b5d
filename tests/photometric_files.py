"""Photometric files in code, and what they are read as."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.ies import read_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.report import Report

IES = SourceRef(Path("lamp.ies"))
LDT = SourceRef(Path("lamp.ldt"))

#: A quadrant of a small downlight: gamma, C, and candela of every C.
GAMMA = (0.0, 22.5, 45.0, 67.5, 90.0)
C = (0.0, 45.0, 90.0)
QUADRANT = ((400, 380, 300, 150, 10), (400, 360, 260, 120, 8), (400, 340, 220, 90, 6))

TYPES = {"C": 1, "B": 2, "A": 3}


def words(values: npt.ArrayLike) -> str:
    return " ".join(f"{value:.10g}" for value in np.ravel(values))


def ies_text(
    candela: npt.ArrayLike = QUADRANT,
    *,
    angles: Sequence[float] = GAMMA,
    planes: Sequence[float] = C,
    label: str = "IESNA:LM-63-2002",
    keywords: str = "[LUMINAIRE] Spot 12",
    tilt: str = "TILT=NONE",
    lamps: int = 1,
    lumens: float = -1.0,
    multiplier: float = 1.0,
    type: str = "C",
    units: int = 2,
    size: Sequence[float] = (0.0, 0.0, 0.0),
    ballast: float = 1.0,
    photometric: float = 1.0,
) -> str:
    """An LM-63 file; size: width, length, height."""
    head = [line for line in (label, keywords, tilt) if line]
    counts = f"{len(angles)} {len(planes)} {TYPES[type]} {units}"
    body = [
        f"{lamps} {lumens:g} {multiplier:g} {counts} {words(size)}",
        f"{ballast:g} {photometric:g} 100",
        words(angles),
        words(planes),
        *(words(row) for row in np.reshape(candela, (len(planes), len(angles)))),
    ]
    return "\n".join(head + body) + "\n"


def ldt_text(
    candela: npt.ArrayLike = QUADRANT,
    *,
    symmetry: int = 4,
    planes: Sequence[float] = tuple(range(0, 360, 45)),
    angles: Sequence[float] = GAMMA,
    lumens: Sequence[float] = (1000.0,),
    lamps: int = 1,
    conversion: float = 1.0,
    decimal: str = ".",
) -> str:
    """An EULUMDAT file, 26 lines, the lamp sets, ten ratios, angles and cd/klm."""
    lines = ["Maker", 1, symmetry, len(planes), 45, len(angles), 22.5, "report", "Spot 12"]
    lines += ["12-A", "spot.ldt", "2026-01-01", 600, 300, 100, 500, 250, 40, 40, 40, 40]
    lines += [100, 80, conversion, 0, len(lumens)]
    for flux in lumens:
        lines += [lamps, "LED", flux, 4000, 80, 100]
    lines += [0.5] * 10 + [*planes, *angles, *np.ravel(candela).tolist()]
    shown = (f"{x:.10g}".replace(".", decimal) if not isinstance(x, str) else x for x in lines)
    return "\r\n".join(shown) + "\r\n"


def ies(text: str, report: Report | None = None) -> Luminaire:
    return read_ies(text.encode("latin-1"), IES, Report() if report is None else report)


def ldt(text: str, report: Report | None = None) -> Luminaire:
    return read_eulumdat(text.encode("latin-1"), LDT, Report() if report is None else report)
