"""The numbers of a photometric file that a data sheet has, ready for JSON."""

from __future__ import annotations

from typing import Any

from hdrusd.photometry.distribution import (
    ZONES,
    fan,
    flux_code,
    found_symmetry,
    nadir_luminance,
    peak,
    sections,
    stated_symmetry,
    upward_share,
    zonal_flux,
)
from hdrusd.photometry.eulumdat import EulumdatFile
from hdrusd.photometry.examine import Examined
from hdrusd.photometry.ies import IesFile
from hdrusd.photometry.ies_check import shape

#: Digits of a number in print and JSON: what 32-bit readers keep.
_DIGITS = 7


def data_sheet(examined: Examined) -> dict[str, Any]:
    """Names with their unit, and numbers, texts, lists of these or None where unknown."""
    file, lamp = examined.file, examined.luminaire
    largest = peak(lamp)
    flux = lamp.flux()
    return {
        **(_of_ies(file) if isinstance(file, IesFile) else _of_eulumdat(file)),
        "type": lamp.type,
        "symmetry_stated": stated_symmetry(lamp),
        "symmetry_found": found_symmetry(lamp),
        "planes": _range(file.planes.tolist()),
        "angles": _range(file.angles.tolist()),
        "peak_cd": _digits(largest.candela),
        "peak_at_deg": [_digits(largest.plane), _digits(largest.angle)],
        "flux_lm": _digits(flux),
        "zones_deg": list(ZONES),
        "zonal_flux_lm": [_digits(value) for value in zonal_flux(lamp)],
        "upward_light_ratio": _digits(upward_share(lamp)),
        "lamp_flux_lm": _digits(lamp.lumens),
        "light_output_ratio": _digits(_ratio(flux, lamp.lumens)),
        "watts": _digits(_watts(file)),
        "efficacy_lm_w": _digits(_ratio(flux, _watts(file))),
        "beam_deg": {section.name: _digits(fan(section, 0.5)) for section in sections(lamp)},
        "field_deg": {section.name: _digits(fan(section, 0.1)) for section in sections(lamp)},
        "opening": _shape(examined),
        "opening_m": [_digits(s) for s in (lamp.opening.x, lamp.opening.y, lamp.opening.height)],
        "nadir_luminance_cd_m2": _digits(nadir_luminance(lamp)),
        "cie_flux_code": None if (code := flux_code(lamp)) is None else list(map(round, code)),
    }


def _of_ies(file: IesFile) -> dict[str, Any]:
    return {
        "format": "IES LM-63",
        "version": str(file.edition),
        "keywords": dict(file.keywords),
        "factors": {
            "multiplier": file.multiplier,
            "ballast": file.ballast,
            **({"ballast_lamp": file.companion} if file.edition <= 1991 else {}),
            **({"file_generation": file.companion} if file.edition == 2019 else {}),
            "all": _digits(file.factor),
        },
    }


def _of_eulumdat(file: EulumdatFile) -> dict[str, Any]:
    keywords = {
        "company": file.company,
        "name": file.name,
        "number": file.number,
        "report": file.test,
        "date": file.date,
        "lamp": file.lamps[0].name,
        "colour": file.lamps[0].colour,
        "rendering": file.lamps[0].rendering,
    }
    return {
        "format": "EULUMDAT",
        "version": "1",
        "keywords": {key: value for key, value in keywords.items() if value},
        "factors": {"conversion": file.conversion, "all": _digits(file.factor)},
    }


def _watts(file: IesFile | EulumdatFile) -> float | None:
    watts = file.watts if isinstance(file, IesFile) else file.lamps[0].watts
    return watts if watts > 0.0 else None


def _ratio(part: float, whole: float | None) -> float | None:
    return part / whole if whole else None


def _shape(examined: Examined) -> str:
    if isinstance(examined.file, IesFile):
        return shape(examined.file) or "unknown"
    opening = examined.luminaire.opening
    if not opening.y:
        return "point"
    return "circle" if opening.round else "rectangle"


def _range(values: list[float]) -> dict[str, Any]:
    return {"count": len(values), "from_deg": values[0], "to_deg": values[-1]}


def _digits(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{_DIGITS}g}")
