"""photometry.toml: what a person knows about the lamps and surfaces of a database.

    gamma = 2.2
    [ambient]
    illuminance = 0.05          # lx
    [[light]]
    match = "Luminaire_*"       # shell pattern on the light's or its node's name
    candela = 3200
    [[material]]
    match = "LampGlass*"
    luminance = 12000           # cd/m2
    [[camera]]
    match = "Driver"            # a node that becomes a camera
    fov = 50                    # degrees, vertical
    [[node]]
    match = "DebugMarkers"
    visible = false

Unknown keys, values of the wrong kind and patterns that match nothing are findings.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, get_args

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.light import Provenance
from hdrusd.report import Kind, Report

#: The name under which it is looked for beside the source.
FILE_NAME = "photometry.toml"

_NUMBER = (int, float)
_COMMON: dict[str, Any] = {"match": str, "source": str, "provenance": str}
_KEYS: dict[str, dict[str, Any]] = {
    "light": _COMMON
    | {
        "candela": _NUMBER,
        "illuminance": _NUMBER,
        "temperature": _NUMBER,
        "color": list,
        "radius": _NUMBER,
        "enabled": bool,
        "ies": str,
    },
    "material": _COMMON
    | {
        "luminance": _NUMBER,
        "hdr_texture": bool,
        "temperature": _NUMBER,
        "color": list,
        "diffuse": list,
        "gamma": _NUMBER,
    },
    "camera": {"match": str, "fov": _NUMBER, "near": _NUMBER, "far": _NUMBER},
    "node": {"match": str, "visible": bool},
}
_AMBIENT = {
    "illuminance": _NUMBER,
    "temperature": _NUMBER,
    "color": list,
    "source": str,
    "provenance": str,
}


@dataclass(slots=True)
class Rule:
    """One table of the file: its keys, where it stands, and whether anything matched."""

    section: str
    place: SourceRef
    values: Mapping[str, Any]
    matched: bool = False

    @property
    def pattern(self) -> str:
        """The shell pattern, case counts."""
        return str(self.values["match"])

    def number(self, key: str) -> float | None:
        """A number, or None where the rule does not say."""
        value = self.values.get(key)
        return None if value is None else float(value)

    def color(self, key: str = "color") -> tuple[float, float, float] | None:
        """A linear Rec. 709 colour, or None."""
        value = self.values.get(key)
        return None if value is None else (float(value[0]), float(value[1]), float(value[2]))

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
        for rule in self.rules:
            if rule.section == section and any(fnmatchcase(n, rule.pattern) for n in names if n):
                rule.matched = True
                return rule
        return None

    def note_unmatched(self, report: Report) -> None:
        """A finding for each pattern that matched nothing."""
        for rule in self.rules:
            if not rule.matched:
                report.add(
                    Kind.MISSING,
                    "sidecar-no-match",
                    rule.place,
                    rule.pattern,
                    f"no {rule.section} of that name",
                )


def read_sidecar(path: Path, report: Report) -> Sidecar:
    """Read a photometry file. Raises InputError when it is no TOML at all."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise InputError(path, f"cannot be read ({problem.strerror})") from problem
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as problem:
        raise InputError(path, f"not TOML: {problem}") from problem
    sidecar = Sidecar(path)
    for key, value in document.items():
        place = SourceRef(path, key)
        if key == "gamma":
            if _fits(value, _NUMBER) and value > 0:
                sidecar.gamma = float(value)
            else:
                _invalid(report, place, "", f"gamma {value!r}; want a number above 0")
        elif key == "ambient":
            if isinstance(value, dict):
                sidecar.ambient = Rule(key, place, _checked(value, _AMBIENT, place, report))
            else:
                _invalid(report, place, "", "want a table, [ambient]")
        elif key in _KEYS:
            _read_section(sidecar, key, value, report)
        else:
            _unknown(report, place, key)
    return sidecar


def _read_section(sidecar: Sidecar, section: str, tables: Any, report: Report) -> None:
    assert sidecar.path is not None
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        _invalid(report, SourceRef(sidecar.path, section), "", f"want tables, [[{section}]]")
        return
    for number, table in enumerate(tables, start=1):
        place = SourceRef(sidecar.path, f"{section}[{number}]")
        values = _checked(table, _KEYS[section], place, report)
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
            _invalid(report, place, key, f"{value!r}; {_wanted(key, keys[key])}")
        elif key == "provenance" and value not in get_args(Provenance):
            _invalid(report, place, key, f"{value!r}; want {', '.join(get_args(Provenance))}")
        else:
            good[key] = value
    return good


def _fits(value: Any, kind: Any) -> bool:
    if kind is list:
        return isinstance(value, list) and len(value) == 3 and all(_fits(v, _NUMBER) for v in value)
    if kind == _NUMBER:
        number = isinstance(value, _NUMBER) and not isinstance(value, bool)
        return bool(number and math.isfinite(value) and value >= 0)
    return isinstance(value, kind)


def _wanted(key: str, kind: Any) -> str:
    if kind is list:
        return "want three numbers of at least 0"
    if kind == _NUMBER:
        return "want a number of at least 0"
    return "want true or false" if kind is bool else "want a string"


def _unknown(report: Report, place: SourceRef, key: str) -> None:
    report.add(Kind.DROPPED, "sidecar-unknown-key", place, key, "unknown key; not used")


def _invalid(report: Report, place: SourceRef, thing: str, text: str) -> None:
    report.add(Kind.INVALID, "sidecar-invalid", place, thing, text)
