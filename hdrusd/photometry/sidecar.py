"""photometry.toml: what a person knows about the lamps and surfaces of a database.

    gamma = 2.2
    [source]
    unit = 0.0254               # m; and up = "Z": where the format does not say or is wrong
    [ambient]
    illuminance = 0.05          # lx; or preset = "moonlit", with altitude and azimuth
    [[light]]
    match = "Luminaire_*"       # shell pattern on the light's or its node's name
    candela = 3200
    illuminant = "HP1"          # the lamp's kind of light (CIE), for its S/P; or sp_ratio = 0.6
    fixture_shadow = true       # the mesh that it stands in shades it
    [[light]]
    match = "Bulb_*"
    lumens = 800                # with spread: sphere, hemisphere, lambert, cone
    [[light]]
    match = "Headlamp_*"
    illuminance = 20            # lx at a distance, in the far field
    distance = 25               # m
    [[light]]
    match = "Lantern_*"
    watts = 70                  # electric
    lamp = "high-pressure-sodium"  # photometry/lamp_types.py; or efficacy, lm/W
    [[light]]
    match = "RoadLamp_*"
    ies = "road.ies"            # LM-63 or EULUMDAT, relative to this file
    lumens = 5600               # of the luminaire; or scale, a factor on the file's candela
    axis = [0, 0, -1]           # where gamma = 0 points, in the axes of the light's node
    c0 = [1, 0, 0]              # where C = 0 points
    [[material]]
    match = "LampGlass*"
    luminance = 12000           # cd/m2; or candela or lumens, with area, m2
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

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import translate
from pathlib import Path
from typing import Any

from hdrusd.errors import InputError, SourceRef
from hdrusd.input_file import check_input
from hdrusd.photometry.lamp_types import LAMP_TYPES, LampType
from hdrusd.photometry.light import Provenance
from hdrusd.photometry.recipe_keys import (
    GAMMA,
    KEYS,
    checked,
    fits,
    invalid,
    is_strong,
    note_weak,
    shown,
    unknown,
)
from hdrusd.photometry.scotopic_light import ILLUMINANTS
from hdrusd.report import Kind, Report

#: Why something of ``[source]`` is not used.
STATED_ITSELF = "the source states its own, which is used"

#: The name under which it is looked for beside the source.
FILE_NAME = "photometry.toml"


@dataclass(slots=True)
class Rule:
    """One table of the file: its keys, where it stands, and whether anything matched."""

    section: str
    place: SourceRef
    values: Mapping[str, Any]
    matched: bool = False
    late: bool = False  # it fits something, but only what a rule before it has taken
    _compiled: re.Pattern[str] | None = field(default=None, init=False, repr=False, compare=False)

    @property
    def pattern(self) -> str:
        """The shell pattern, case counts; a lamp that has places instead goes by its name."""
        return str(self.values.get("match", self.values.get("name", "Lamp")))

    def fits(self, names: Iterable[str]) -> bool:
        """Whether the pattern fits one of the names; no name is none."""
        if self._compiled is None:  # thousands of rules are asked about thousands of things
            self._compiled = re.compile(translate(self.pattern))
        fits = self._compiled.match
        return any(fits(name) for name in names if name)

    def number(self, key: str) -> float | None:
        """A number, or None where the rule does not say."""
        value = self.values.get(key)
        return None if value is None else float(value)

    def three(self, key: str) -> tuple[float, float, float] | None:
        """A linear Rec. 709 colour or a direction, or None."""
        value = self.values.get(key)
        return None if value is None else (float(value[0]), float(value[1]), float(value[2]))

    @property
    def lamp(self) -> LampType | None:
        """The type of the lamp, or None where the rule does not say."""
        return LAMP_TYPES.get(self.values.get("lamp", ""))

    @property
    def sp(self) -> float:
        """The S/P of the lamp, stated or by its kind or type; 0 where the rule does not say."""
        stated = self.number("sp_ratio")
        if stated is not None:
            return stated
        if "illuminant" in self.values or self.lamp is None:
            return ILLUMINANTS.get(self.values.get("illuminant", ""), 0.0)
        return self.lamp.sp(self.number("temperature"))

    @property
    def provenance(self) -> Provenance:
        """measured, authored (the default: somebody wrote it down) or estimated."""
        return self.values.get("provenance", "authored")  # type: ignore[no-any-return]

    @property
    def source(self) -> str:
        """Where the number comes from, in the author's words."""
        return str(self.values.get("source", ""))


@dataclass(frozen=True, slots=True)
class Unmatched:
    """A pattern that matched nothing in a source, and why."""

    place: SourceRef
    pattern: str
    text: str

    def note(self, report: Report) -> None:
        """A finding of it."""
        report.add(Kind.MISSING, "sidecar-no-match", self.place, self.pattern, self.text)


@dataclass(slots=True)
class Sidecar:
    """A photometry file, or an empty one."""

    path: Path | None = None
    gamma: float | None = None
    ambient: Rule | None = None
    unit_m: float | None = None  # of the source, where it does not say or is wrong
    up: str | None = None  # "Y" or "Z", likewise
    light_unit: str = "nits"  # of a USD source: a name of photometry.light_unit.LIGHT_UNITS
    rules: list[Rule] = field(default_factory=list)
    _passed_over: list[Unmatched] = field(default_factory=list)

    def pass_over(self, key: str) -> None:
        """A key of ``[source]`` is not used: the source says otherwise."""
        assert self.path is not None
        place = SourceRef(self.path, "source")
        self._passed_over.append(Unmatched(place, key, STATED_ITSELF))

    def match(self, section: str, *names: str, path: str = "") -> Rule | None:
        """The first rule of a section whose pattern fits one of the names.

        Or the ``path``, where the pattern is of paths, that is begins with "/": what is above
        a thing is not its name.
        """
        first: Rule | None = None
        for rule in self.rules:
            if rule.section != section:
                continue
            if not rule.fits((*names, path) if rule.pattern.startswith("/") else names):
                continue
            if first is None:
                rule.matched = True
                first = rule
            else:
                rule.late = True
        return first

    def unmatched(self) -> list[Unmatched]:
        """The patterns that matched nothing, and what of ``[source]`` was passed over."""
        return self._passed_over + [
            Unmatched(
                rule.place,
                rule.pattern,
                "what it fits is taken by a pattern before it; want the narrower one first"
                if rule.late
                else f"no {'node' if rule.section == 'lamp' else rule.section} of that name",
            )
            for rule in self.rules
            if not rule.matched
        ]


def read_sidecar(path: Path, report: Report) -> Sidecar:
    """Read a photometry file. Raises InputError when it is no TOML at all."""
    check_input(path)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as problem:  # an integer of 5,000 digits is one too
        raise InputError(path, f"not TOML: {problem}") from problem
    sidecar = Sidecar(path)
    for key, value in document.items():
        place = SourceRef(path, key)
        if key == "gamma":
            if fits(value, GAMMA):
                sidecar.gamma = float(value)
            else:
                invalid(report, place, "", f"{shown(value)}; want {GAMMA}")
        elif key == "usd":
            sidecar.light_unit = str(_table(value, key, place, report).get("light_unit", "nits"))
        elif key == "source":
            stated = _table(value, key, place, report)
            sidecar.unit_m, sidecar.up = stated.get("unit"), stated.get("up")
        elif key == "ambient":
            sidecar.ambient = _read_ambient(value, place, report)
        elif key in KEYS:
            _read_section(sidecar, key, value, report)
        else:
            unknown(report, place, key)
    return sidecar


def _table(table: Any, section: str, place: SourceRef, report: Report) -> dict[str, Any]:
    if not isinstance(table, dict):
        invalid(report, place, "", f"want a table, [{section}]")
        return {}
    return checked(table, section, place, report)


def _read_ambient(table: Any, place: SourceRef, report: Report) -> Rule | None:
    if not isinstance(table, dict):
        invalid(report, place, "", "want a table, [ambient]")
        return None
    values = checked(table, "ambient", place, report)
    if "illuminance" not in values and "preset" not in values:
        invalid(report, place, "", "no illuminance (lx) and no preset; not used")
        return None
    return Rule("ambient", place, values)


def _read_section(sidecar: Sidecar, section: str, tables: Any, report: Report) -> None:
    assert sidecar.path is not None
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        invalid(report, SourceRef(sidecar.path, section), "", f"want tables, [[{section}]]")
        return
    for number, table in enumerate(tables, start=1):
        place = SourceRef(sidecar.path, f"{section}[{number}]")
        values = checked(table, section, place, report)
        lamp = section == "lamp"
        if "match" not in values and not (lamp and "at" in values):
            wanted = "places in at, or a node in match" if lamp else "a name or a pattern in match"
            invalid(report, place, "", f"nothing that it is for; want {wanted}")
        elif lamp and not is_strong(values):
            note_weak(place, report)
        else:
            sidecar.rules.append(Rule(section, place, values))
