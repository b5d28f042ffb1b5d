"""The keys of a photometry file: what each may be, and which of them contradict each other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten
from typing import Any, get_args

from hdrusd.errors import SourceRef
from hdrusd.photometry.lamp_types import LAMP_TYPES
from hdrusd.photometry.light import Provenance
from hdrusd.photometry.light_unit import LIGHT_UNITS
from hdrusd.photometry.scotopic_light import ILLUMINANTS
from hdrusd.photometry.sky_presets import PRESETS
from hdrusd.photometry.spread import Spread
from hdrusd.report import Kind, Report


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers that a key takes, ends included."""

    least: float
    most: float

    def __str__(self) -> str:
        return f"a number from {self.least:g} to {self.most:g}"


@dataclass(frozen=True, slots=True)
class Three:
    """A list of three numbers that a key takes; ``some``: not all of them 0."""

    each: Range
    some: str = ""  # what three zeros lack

    def __str__(self) -> str:
        return f"three of {self.each}"


@dataclass(frozen=True, slots=True)
class Places:
    """A list of lists of three numbers that a key takes, at least one."""

    each: Three

    def __str__(self) -> str:
        return f"a list of places, each {self.each}"


@dataclass(frozen=True, slots=True)
class Word:
    """One of some words."""

    words: tuple[str, ...]

    def __str__(self) -> str:
        return ", ".join(self.words)


#: cd, lx or cd/m2: 32-bit floats end at 3e38, and a lamp of 1 mm makes nits of candela times 3e5.
_STRENGTH = Range(0.0, 1e30)
_KELVIN = Range(1000.0, 10_000.0)  # the range of UsdLux's blackbody colours
_RGB = Three(Range(0.0, 1e6))
_HUE = Three(_RGB.each, "black has no hue; want a number above 0")
_DIRECTION = Three(Range(-1e6, 1e6), "no direction; want a number other than 0")
_ORIGIN: dict[str, Any] = {"source": str, "provenance": Word(get_args(Provenance))}
_COMMON = {"match": str} | _ORIGIN

#: Of all textures, or of a material.
GAMMA = Range(0.1, 10.0)

#: What each key of each section takes.
KEYS: dict[str, dict[str, Any]] = {
    "light": _COMMON
    | {
        "candela": _STRENGTH,
        "lumens": _STRENGTH,
        "spread": Word(get_args(Spread)),
        "illuminance": _STRENGTH,
        "distance": Range(1e-3, 1e6),  # m
        "watts": Range(0.0, 1e9),  # electric
        "radiant_watts": Range(0.0, 1e9),
        "efficacy": Range(1e-3, 683.0),  # lm/W
        "lamp": Word(tuple(LAMP_TYPES)),
        "temperature": _KELVIN,
        "color": _HUE,
        "ies": str,
        "scale": Range(0.0, 1e6),
        "axis": _DIRECTION,
        "c0": _DIRECTION,
        "radius": Range(1e-3, 1e3),  # m
        "sp_ratio": Range(0.01, 100.0),
        "illuminant": Word(tuple(ILLUMINANTS)),
        "fixture_shadow": bool,
        "enabled": bool,
    },
    "material": _COMMON
    | {
        "luminance": _STRENGTH,
        "candela": _STRENGTH,
        "lumens": _STRENGTH,
        "area": Range(1e-9, 1e9),  # m2
        "hdr_texture": bool,
        "temperature": _KELVIN,
        "color": _HUE,
        "diffuse": _RGB,
        "gamma": GAMMA,
        "specular": Three(Range(0.0, 1.0)),
        "roughness": Range(0.0, 1.0),
        "shininess": Range(0.0, 1e5),
    },
    "camera": {
        "match": str,
        "fov": Range(0.1, 179.0),  # degrees
        "near": Range(1e-6, 1e9),  # source units
        "far": Range(1e-6, 1e12),
    },
    "node": {"match": str, "visible": bool},
}
AMBIENT: dict[str, Any] = _ORIGIN | {
    "illuminance": _STRENGTH,
    "preset": Word(tuple(PRESETS)),
    "altitude": Range(-18.0, 90.0),  # degrees, of sun or moon
    "azimuth": Range(-360.0, 360.0),
    "temperature": _KELVIN,
    "color": _HUE,
}

#: A lamp that the database lacks is placed, and is then like any light.
_SOURCE_UNITS = Three(Range(-1e12, 1e12))
KEYS["lamp"] = KEYS["light"] | {
    "name": str,
    "at": Places(_SOURCE_UNITS),
    "offset": _SOURCE_UNITS,
    "cutoff": Range(0.1, 180.0),  # degrees, half-angle
}

#: Of a source that is a stage already.
_USD: dict[str, Any] = {"light_unit": Word(tuple(LIGHT_UNITS))}
_SOURCE: dict[str, Any] = {"unit": Range(1e-9, 1e9), "up": Word(("Y", "Z"))}  # m

#: Tables of which there is one.
_SINGLE = {"ambient": AMBIENT, "source": _SOURCE, "usd": _USD}

#: Keys that say something only beside one of others.
_COMPANIONS: dict[str, dict[str, tuple[str, ...]]] = {
    "light": {
        "scale": ("ies",),
        "c0": ("ies",),
        "axis": ("ies", "spread"),
        "spread": ("lumens", "watts", "radiant_watts"),
        "distance": ("illuminance",),
        "watts": ("lamp", "efficacy"),
        "efficacy": ("watts", "radiant_watts"),
    },
    "material": {"area": ("candela", "lumens")},
    "ambient": {"altitude": ("preset",), "azimuth": ("preset",)},
}

#: Keys that say how strong a lamp with a place is, each row enough with all of its keys.
_ENOUGH = (
    ("candela",),
    ("lumens",),
    ("illuminance", "distance"),
    ("watts", "lamp"),
    ("watts", "efficacy"),
    ("radiant_watts",),
    ("ies",),
)

_COMPANIONS["lamp"] = {k: v for k, v in _COMPANIONS["light"].items() if k != "axis"} | {
    "offset": ("match",)
}

#: Of the keys in a row that say one thing the first that is there counts.
_STRENGTHS = ("candela", "lumens", "illuminance", "watts", "radiant_watts")
_RIVALS: dict[str, tuple[tuple[str, ...], ...]] = {
    "light": (_STRENGTHS, ("sp_ratio", "illuminant")),
    "material": (("luminance", "candela", "lumens"), ("roughness", "shininess")),
}

_RIVALS["lamp"] = _RIVALS["light"]

#: The same of lights with a photometric file, whose flux ``lumens`` then is.
_WITH_FILE = (
    ("lumens", "scale"),
    ("ies", "candela", "watts", "radiant_watts"),
    ("ies", "spread"),
)


def checked(
    table: Mapping[str, Any], section: str, place: SourceRef, report: Report
) -> dict[str, Any]:
    """The keys of a table that are known and of the right kind; the rest are findings."""
    keys = _SINGLE.get(section) or KEYS[section]
    good: dict[str, Any] = {}
    for key, value in table.items():
        kind = keys.get(key)
        if kind is None:
            unknown(report, place, key)
        elif not fits(value, kind):
            invalid(report, place, key, f"{shown(value)}; want {_wanted(kind)}")
        elif isinstance(kind, Three) and kind.some and not any(value):
            invalid(report, place, key, kind.some)
        else:
            good[key] = value
    _note_company(good, section, place, report)
    return good


def _note_company(
    values: Mapping[str, Any], section: str, place: SourceRef, report: Report
) -> None:
    """A finding for each key that lacks its companion, or has a rival."""
    for key, companions in _COMPANIONS.get(section, {}).items():
        if key in values and not any(companion in values for companion in companions):
            invalid(report, place, key, f"not used without {' or '.join(companions)}")
    for row in _RIVALS.get(section, ()):
        if row is not _STRENGTHS or "ies" not in values:
            _note_rivals(row, values, place, report)


def note_file_rivals(
    values: Mapping[str, Any], used: bool, place: SourceRef, report: Report
) -> None:
    """The same beside ``ies``, once it is known whether its file can be used."""
    for row in _WITH_FILE if used else (_STRENGTHS,):
        _note_rivals(row, values, place, report)


def is_strong(values: Iterable[str]) -> bool:
    """Whether keys say how strong a lamp with a place is."""
    return any(set(row) <= set(values) for row in _ENOUGH)


def note_weak(place: SourceRef, report: Report) -> None:
    """A finding: no database says how strong a placed lamp is, so there is nothing to guess from.

    Whether its strength is not there or cannot be used.
    """
    wanted = ", ".join(" and ".join(row) for row in _ENOUGH)
    invalid(report, place, "", f"no strength; not placed; want one of {wanted}")


def _says(key: str, values: Mapping[str, Any]) -> bool:
    """Whether a key is there and says what its rivals do.

    Lux without a distance are those of a light from a direction, for which candela mean nothing:
    a pattern may fit both kinds.
    """
    return key in values and (key != "illuminance" or "distance" in values)


def _note_rivals(
    row: Sequence[str], values: Mapping[str, Any], place: SourceRef, report: Report
) -> None:
    there = [key for key in row if _says(key, values)]
    for key in there[1:]:
        text = f"{there[0]} beside it says the same and is used"
        report.add(Kind.INVALID, "sidecar-rival", place, key, text)


def fits(value: Any, kind: Any) -> bool:
    """Whether a value of TOML is what a key takes."""
    if isinstance(kind, Three):
        three = isinstance(value, list) and len(value) == 3
        return three and all(fits(v, kind.each) for v in value)
    if isinstance(kind, Places):
        return isinstance(value, list) and bool(value) and all(fits(v, kind.each) for v in value)
    if isinstance(kind, Range):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return number and kind.least <= value <= kind.most
    if isinstance(kind, Word):
        return isinstance(value, str) and value in kind.words
    return isinstance(value, kind)


def _wanted(kind: Any) -> str:
    if kind is bool:
        return "true or false"
    return "a string" if kind is str else str(kind)


def shown(value: Any) -> str:
    """A value as a message quotes it: Python has no text for an integer of 5,000 digits."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 64:
        return "a number of more than 64 bits"
    return shorten(repr(value), 60)


def unknown(report: Report, place: SourceRef, key: str) -> None:
    """A finding: a key that there is not."""
    report.add(Kind.DROPPED, "sidecar-unknown-key", place, key, "unknown key; not used")


def invalid(report: Report, place: SourceRef, thing: str, text: str) -> None:
    """A finding: an entry that is not of the right kind."""
    report.add(Kind.INVALID, "sidecar-invalid", place, thing, text)
