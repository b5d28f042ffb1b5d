"""photometry.toml: what a person knows about the lamps and surfaces of a database.

    gamma = 2.2
    [ambient]
    illuminance = 0.05          # lx
    [[light]]
    match = "Luminaire_*"       # shell pattern on the light's or its node's name
    candela = 3200
    illuminant = "HP1"          # the lamp's kind of light (CIE), for its S/P; or sp_ratio = 0.6
    fixture_shadow = true       # the mesh that it stands in shades it
    [[light]]
    match = "RoadLamp_*"
    ies = "road.ies"            # LM-63 or EULUMDAT, relative to this file
    lumens = 5600               # of the luminaire; or scale, a factor on the file's candela
    axis = [0, 0, -1]           # where gamma = 0 points, in the axes of the light's node
    c0 = [1, 0, 0]              # where C = 0 points
    [[material]]
    match = "LampGlass*"
    luminance = 12000           # cd/m2
    [[material]]
    match = "WetRoad"
    diffuse = [0.5, 0.5, 0.5]   # D of R = T^gamma D
    specular = [0.02, 0.02, 0.02]  # reflectance at normal incidence
    roughness = 0.3             # GGX; or shininess, Blinn and Phong's exponent
    [[camera]]
    match = "Driver"            # a node that becomes a camera
    fov = 50                    # degrees, vertical
    [[node]]
    match = "DebugMarkers"
    visible = false

Unknown keys, values of the wrong kind and patterns that match nothing are findings.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from textwrap import shorten
from typing import Any, get_args

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.light import Provenance
from hdrusd.photometry.scotopic_light import ILLUMINANTS
from hdrusd.report import Kind, Report

#: The name under which it is looked for beside the source.
FILE_NAME = "photometry.toml"


@dataclass(frozen=True, slots=True)
class _Range:
    """Numbers that a key takes, ends included."""

    least: float
    most: float

    def __str__(self) -> str:
        return f"a number from {self.least:g} to {self.most:g}"


@dataclass(frozen=True, slots=True)
class _Three:
    """A list of three numbers that a key takes; ``some``: not all of them 0."""

    each: _Range
    some: str = ""  # what three zeros lack

    def __str__(self) -> str:
        return f"three of {self.each}"


#: cd, lx or cd/m2: 32-bit floats end at 3e38, and a lamp of 1 mm makes nits of candela times 3e5.
_STRENGTH = _Range(0.0, 1e30)
_KELVIN = _Range(1000.0, 10_000.0)  # the range of UsdLux's blackbody colours
_GAMMA = _Range(0.1, 10.0)
_RGB = _Three(_Range(0.0, 1e6))
_HUE = _Three(_RGB.each, "black has no hue; want a number above 0")
_DIRECTION = _Three(_Range(-1e6, 1e6), "no direction; want a number other than 0")
_COMMON: dict[str, Any] = {"match": str, "source": str, "provenance": str}
_KEYS: dict[str, dict[str, Any]] = {
    "light": _COMMON
    | {
        "candela": _STRENGTH,
        "illuminance": _STRENGTH,
        "temperature": _KELVIN,
        "color": _HUE,
        "ies": str,
        "scale": _Range(0.0, 1e6),
        "lumens": _STRENGTH,
        "axis": _DIRECTION,
        "c0": _DIRECTION,
        "radius": _Range(1e-3, 1e3),  # m
        "sp_ratio": _Range(0.01, 100.0),
        "illuminant": str,
        "fixture_shadow": bool,
        "enabled": bool,
    },
    "material": _COMMON
    | {
        "luminance": _STRENGTH,
        "hdr_texture": bool,
        "temperature": _KELVIN,
        "color": _HUE,
        "diffuse": _RGB,
        "gamma": _GAMMA,
        "specular": _Three(_Range(0.0, 1.0)),
        "roughness": _Range(0.0, 1.0),
        "shininess": _Range(0.0, 1e5),
    },
    "camera": {
        "match": str,
        "fov": _Range(0.1, 179.0),  # degrees
        "near": _Range(1e-6, 1e9),  # source units
        "far": _Range(1e-6, 1e12),
    },
    "node": {"match": str, "visible": bool},
}
_AMBIENT = {
    "illuminance": _STRENGTH,
    "temperature": _KELVIN,
    "color": _HUE,
    "source": str,
    "provenance": str,
}

#: Keys that say something only beside another one.
_COMPANIONS = {"scale": "ies", "lumens": "ies", "axis": "ies", "c0": "ies"}

#: Of two keys that say one thing the first counts.
_RIVALS = (
    ("lumens", "scale"),
    ("ies", "candela"),
    ("sp_ratio", "illuminant"),
    ("roughness", "shininess"),
)


@dataclass(slots=True)
class Rule:
    """One table of the file: its keys, where it stands, and whether anything matched."""

    section: str
    place: SourceRef
    values: Mapping[str, Any]
    matched: bool = False
    late: bool = False  # it fits something, but only what a rule before it has taken

    @property
    def pattern(self) -> str:
        """The shell pattern, case counts."""
        return str(self.values["match"])

    def number(self, key: str) -> float | None:
        """A number, or None where the rule does not say."""
        value = self.values.get(key)
        return None if value is None else float(value)

    def three(self, key: str) -> tuple[float, float, float] | None:
        """A linear Rec. 709 colour or a direction, or None."""
        value = self.values.get(key)
        return None if value is None else (float(value[0]), float(value[1]), float(value[2]))

    @property
    def sp(self) -> float:
        """The S/P of the lamp, stated or by its kind; 0 where the rule does not say."""
        stated = self.number("sp_ratio")
        return ILLUMINANTS.get(self.values.get("illuminant", ""), 0.0) if stated is None else stated

    @property
    def provenance(self) -> Provenance:
        """measured, authored (the default: somebody wrote it down) or estimated."""
        return self.values.get("provenance", "authored")  # type: ignore[no-any-return]

    @property
    def source(self) -> str:
        """Where the number comes from, in the author's words."""
        return str(self.values.get("source", ""))


@dataclass(slots=True)
class Sidecar:
    """A photometry file, or an empty one."""

    path: Path | None = None
    gamma: float | None = None
    ambient: Rule | None = None
    rules: list[Rule] = field(default_factory=list)

    def match(self, section: str, *names: str) -> Rule | None:
        """The first rule of a section whose pattern fits one of the names."""
        first: Rule | None = None
        for rule in self.rules:
            if rule.section != section or not any(fnmatchcase(n, rule.pattern) for n in names if n):
                continue
            if first is None:
                rule.matched = True
                first = rule
            else:
                rule.late = True
        return first

    def note_unmatched(self, report: Report) -> None:
        """A finding for each pattern that matched nothing."""
        for rule in self.rules:
            if not rule.matched:
                report.add(
                    Kind.MISSING,
                    "sidecar-no-match",
                    rule.place,
                    rule.pattern,
                    "what it fits is taken by a pattern before it; want the narrower one first"
                    if rule.late
                    else f"no {rule.section} of that name",
                )


def read_sidecar(path: Path, report: Report) -> Sidecar:
    """Read a photometry file. Raises InputError when it is no TOML at all."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise InputError(path, f"cannot be read ({problem.strerror})") from problem
    except (ValueError, RecursionError) as problem:  # an integer of 5,000 digits is one too
        raise InputError(path, f"not TOML: {problem}") from problem
    sidecar = Sidecar(path)
    for key, value in document.items():
        place = SourceRef(path, key)
        if key == "gamma":
            if _fits(value, _GAMMA):
                sidecar.gamma = float(value)
            else:
                _invalid(report, place, "", f"{_shown(value)}; want {_GAMMA}")
        elif key == "ambient":
            sidecar.ambient = _read_ambient(value, place, report)
        elif key in _KEYS:
            _read_section(sidecar, key, value, report)
        else:
            _unknown(report, place, key)
    return sidecar


def _read_ambient(table: Any, place: SourceRef, report: Report) -> Rule | None:
    if not isinstance(table, dict):
        _invalid(report, place, "", "want a table, [ambient]")
        return None
    values = _checked(table, _AMBIENT, place, report)
    if "illuminance" not in values:
        _invalid(report, place, "", "no illuminance (lx); not used")
        return None
    return Rule("ambient", place, values)


def _read_section(sidecar: Sidecar, section: str, tables: Any, report: Report) -> None:
    assert sidecar.path is not None
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        _invalid(report, SourceRef(sidecar.path, section), "", f"want tables, [[{section}]]")
        return
    for number, table in enumerate(tables, start=1):
        place = SourceRef(sidecar.path, f"{section}[{number}]")
        values = _checked(table, _KEYS[section], place, report)
        _note_company(values, place, report)
        if "match" in values:
            sidecar.rules.append(Rule(section, place, values))
        else:
            _invalid(report, place, "", "no match; want a name or a pattern")


def _checked(
    table: Mapping[str, Any], keys: Mapping[str, Any], place: SourceRef, report: Report
) -> dict[str, Any]:
    """The keys that are known and of the right kind; the rest are findings."""
    good: dict[str, Any] = {}
    for key, value in table.items():
        if key not in keys:
            _unknown(report, place, key)
        elif not _fits(value, keys[key]):
            _invalid(report, place, key, f"{_shown(value)}; want {_wanted(keys[key])}")
        elif key == "provenance" and value not in get_args(Provenance):
            _invalid(report, place, key, f"{_shown(value)}; want {', '.join(get_args(Provenance))}")
        elif key == "illuminant" and value not in ILLUMINANTS:
            _invalid(report, place, key, f"{_shown(value)}; want {', '.join(ILLUMINANTS)}")
        elif isinstance(keys[key], _Three) and keys[key].some and not any(value):
            _invalid(report, place, key, keys[key].some)
        else:
            good[key] = value
    return good


def _note_company(values: Mapping[str, Any], place: SourceRef, report: Report) -> None:
    """A finding for each key that lacks its companion, or has a rival."""
    for key, companion in _COMPANIONS.items():
        if key in values and companion not in values:
            _invalid(report, place, key, f"not used without {companion}")
    for first, second in _RIVALS:
        if first in values and second in values:
            text = f"{first} beside it says the same and is used"
            report.add(Kind.INVALID, "sidecar-rival", place, second, text)


def _fits(value: Any, kind: Any) -> bool:
    if isinstance(kind, _Three):
        three = isinstance(value, list) and len(value) == 3
        return three and all(_fits(v, kind.each) for v in value)
    if isinstance(kind, _Range):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return number and kind.least <= value <= kind.most
    return isinstance(value, kind)


def _wanted(kind: Any) -> str:
    if isinstance(kind, (_Range, _Three)):
        return str(kind)
    return "true or false" if kind is bool else "a string"


def _shown(value: Any) -> str:
    """A value as a message quotes it: Python has no text for an integer of 5,000 digits."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 64:
        return "a number of more than 64 bits"
    return shorten(repr(value), 60)


def _unknown(report: Report, place: SourceRef, key: str) -> None:
    report.add(Kind.DROPPED, "sidecar-unknown-key", place, key, "unknown key; not used")


def _invalid(report: Report, place: SourceRef, thing: str, text: str) -> None:
    report.add(Kind.INVALID, "sidecar-invalid", place, thing, text)
