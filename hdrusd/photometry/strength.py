"""What an entry of a photometry file makes of a lamp with a place: candela on its axis.

candela                        I
lumens                         I = Phi / W, W by photometry/spread.py
illuminance at a distance      I = E d^2, in the far field
watts                          Phi = P K, K stated or that of the lamp's type, lm/W
radiant_watts                  Phi = P K, K = 683 lm/W or stated
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hdrusd.photometry.confidence import BY_LAMP_TYPE
from hdrusd.photometry.light import Provenance
from hdrusd.photometry.light_unit import LUMENS_PER_WATT
from hdrusd.photometry.sidecar import Rule
from hdrusd.photometry.spread import OWN, Beam, solid_angle
from hdrusd.report import Kind

#: Share of a flux that may be missing without a word.
_SAME = 1e-3

#: Makes a finding of its kind, code and text.
Note = Callable[[Kind, str, str], None]

#: Keys that say how strong a lamp with a place is, the first that is there counting.
STRENGTHS = ("candela", "lumens", "illuminance", "watts", "radiant_watts")


@dataclass(frozen=True, slots=True)
class Stated:
    """A strength, and where it comes from, as ``PhotometricLight`` has them."""

    value: float  # cd
    provenance: Provenance
    rule: str
    source: str


def stated_candela(rule: Rule, beam: Beam, note: Note) -> Stated | None:
    """Candela on the axis; None where the entry does not say. ``beam``: as it will be written."""
    candela = rule.number("candela")
    if candela is not None:
        return Stated(candela, rule.provenance, str(rule.place), rule.source)
    lumens = rule.number("lumens")
    if lumens is not None:
        value, how = _spread(lumens, rule, beam, _usual(beam), note)
        return Stated(value, rule.provenance, f"{rule.place}, {how}", rule.source)
    lux, distance = rule.number("illuminance"), rule.number("distance")
    if lux is not None and distance is not None:
        how = f"{lux:g} lx at {distance:g} m"
        return Stated(lux * distance**2, rule.provenance, f"{rule.place}, {how}", rule.source)
    return _by_watts(rule, beam, note) or _by_radiant_watts(rule, beam, note)


def note_wrong_unit(rule: Rule, wanted: str, keys: tuple[str, ...], note: Note) -> None:
    """A finding where an entry is of another kind of light than it fits."""
    there = [key for key in keys if key in rule.values]
    if there:
        text = f"{rule.place} says {' and '.join(there)}; want {wanted}"
        note(Kind.INVALID, "sidecar-unit", text)


def _by_watts(rule: Rule, beam: Beam, note: Note) -> Stated | None:
    """By electric power."""
    watts, lamp, efficacy = rule.number("watts"), rule.lamp, rule.number("efficacy")
    if watts is None or (lamp is None and efficacy is None):
        return None
    if efficacy is not None:
        value, how = _spread(watts * efficacy, rule, beam, _usual(beam), note)
        how = f"{watts:g} W at {efficacy:g} lm/W, {how}"
        return Stated(value, rule.provenance, f"{rule.place}, {how}", rule.source)
    assert lamp is not None
    typical = lamp.efficacy(watts)
    value, how = _spread(watts * typical, rule, beam, _usual(beam), note)
    text = (
        f"{watts * typical:.4g} lm of {watts:g} W by lamp type {lamp.name}: {typical:g} lm/W, "
        f"{lamp.least:g} to {lamp.most:g} are usual ({lamp.source}); efficacy says otherwise"
    )
    note(Kind.ASSUMED, "lamp-efficacy", text)
    how = f"{watts:g} W at {typical:g} lm/W, {how}"
    name = f"{BY_LAMP_TYPE}{lamp.name}, {rule.place}, {how}"
    if rule.provenance == "estimated":  # guessed watts are worth a guess
        name = f"{rule.place}, {BY_LAMP_TYPE}{lamp.name}, {how}"
    source = "; ".join(text for text in (rule.source, lamp.source) if text)
    return Stated(value, "estimated", name, source)


def _by_radiant_watts(rule: Rule, beam: Beam, note: Note) -> Stated | None:
    """By the power of its light alone; a spot's counts before its cone, as Blender has it."""
    watts = rule.number("radiant_watts")
    if watts is None:
        return None
    efficacy = rule.number("efficacy") or LUMENS_PER_WATT
    value, how = _spread(watts * efficacy, rule, beam, OWN[beam.emitter], note)
    how = f"{watts:g} W at {efficacy:g} lm/W, {how}"
    return Stated(value, rule.provenance, f"{rule.place}, {how}", rule.source)


def _usual(beam: Beam) -> str:
    return "cone" if beam.shaped else OWN[beam.emitter]


def _spread(flux: float, rule: Rule, beam: Beam, usual: str, note: Note) -> tuple[float, str]:
    """Candela of lumens, and how they came about."""
    spread: str = rule.values.get("spread", usual)
    angle = solid_angle(spread, beam)
    candela = flux / angle if angle > 0.0 else 0.0
    how = f"{flux:.6g} lm over {angle:.4g} sr ({spread})"
    if "spread" not in rule.values and (beam.shaped or beam.emitter == "ball"):
        text = f"{how} are {candela:.4g} cd on the axis; spread says otherwise"
        note(Kind.ASSUMED, "light-spread", text)
    elif spread == "cone" and not beam.shaped:
        where = "to all sides" if beam.emitter == "ball" else "as its shape has them"
        note(Kind.ASSUMED, "light-spread", f"has no cone; its lumens go {where}")
    passed = candela * solid_angle("cone", beam)
    if abs(passed - flux) > _SAME * flux:
        text = f"its cone and focus make {passed:.4g} lm of {flux:.6g} lm over {angle:.4g} sr"
        note(Kind.REPLACED, "light-spread", text)
    return candela, how
