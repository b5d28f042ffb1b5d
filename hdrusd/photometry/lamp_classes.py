"""Lamps by what they are for: how strong such lamps are, for proposals that a person checks.

What a rule demands of a kind of lamp bounds it from both sides; ``typical`` lies between.
Nothing here is used by a conversion unless it is written into a photometry file, with
``source`` and provenance "estimated". "Unconfirmed": nobody has read that source.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hdrusd.photometry.albedo import words

_R112 = "UN Regulation 112 (149), class B"
_R87 = "UN Regulation 87 (148)"
_R7 = "UN Regulation 7 (148)"
_R6 = "UN Regulation 6 (148)"
_R38 = "UN Regulation 38 (148)"
_R23 = "UN Regulation 23 (148)"
_EN12368 = "EN 12368, performance levels 1 to 3 of 200 and 300 mm signals"
_EN12899 = "EN 12899-1, luminance of white, classes L1 to L3, unconfirmed"
_PLG05 = "Institution of Lighting Professionals, PLG05, zones E2 to E4, unconfirmed"
_EN1838 = "EN 1838 (green in an emergency) and DIN 4844-1 (white on mains)"
_EU244 = "Regulation (EC) 244/2009, annex II, table of claimed equivalence, 25 to 100 W"
_EN60081 = "EN 60081, 36 W, 3350 lm, unconfirmed, of 26 mm x 1.2 m: Phi / (pi S)"
_EU245 = "Regulation (EC) 245/2009, 50 to 250 W of high-pressure sodium, unconfirmed"
_ICAO = "ICAO Annex 14, vol. I, table 6-1, types A and B"

#: Red and amber of signal lamps, linear Rec. 709 (UN Regulation 48, 2.29: within their corners).
_RED, _AMBER = (1.0, 0.01, 0.0), (1.0, 0.3, 0.0)

_Key = Literal["candela", "lumens", "luminance"]


@dataclass(frozen=True, slots=True)
class LampClass:
    """One kind of lamp. ``key``: of the photometry file, which says in what ``typical``,
    ``least`` and ``most`` count: cd on the axis, lm, or cd/m2 of a surface.

    ``phrases``: words that name it; one of several words fits a name that has all of them, in
    any order. ``lamp``: a type of photometry/lamp_types.py, or ``color``, or neither.
    """

    name: str
    key: _Key
    typical: float
    least: float
    most: float
    source: str
    phrases: tuple[str, ...]
    lamp: str = ""
    color: tuple[float, float, float] | None = None


LAMP_CLASSES: tuple[LampClass, ...] = (
    LampClass(
        "low-beam",
        "candela",
        10_100.0,
        5_100.0,
        44_100.0,
        f"{_R112}, passing beam: 50V, 75R; most: UN Regulation 123, class C",
        ("low beam", "lowbeam", "dipped beam", "headlight", "headlamp", "abblendlicht"),
        "halogen-vehicle",
    ),
    LampClass(
        "high-beam",
        "candela",
        60_000.0,
        40_500.0,
        215_000.0,
        f"{_R112}, driving beam",
        ("high beam", "highbeam", "main beam", "driving beam", "fernlicht"),
        "halogen-vehicle",
    ),
    LampClass(
        "daytime-running",
        "candela",
        600.0,
        400.0,
        1200.0,
        _R87,
        ("drl", "daytime running", "tagfahrlicht"),
        "led",
    ),
    LampClass(
        "front-position",
        "candela",
        20.0,
        4.0,
        140.0,
        _R7,
        ("position front", "parking light", "sidelight", "standlicht"),
    ),
    LampClass(
        "rear-position",
        "candela",
        8.0,
        4.0,
        17.0,
        _R7,
        ("tail light", "taillight", "tail lamp", "rear light", "rear position", "schlusslicht"),
        color=_RED,
    ),
    LampClass(
        "stop",
        "candela",
        100.0,
        60.0,
        260.0,
        _R7,
        ("brake light", "brakelight", "brake lamp", "stop lamp", "stop light", "bremslicht"),
        color=_RED,
    ),
    LampClass(
        "rear-fog",
        "candela",
        200.0,
        150.0,
        300.0,
        _R38,
        ("rear fog", "nebelschlussleuchte"),
        color=_RED,
    ),
    LampClass(
        "reversing",
        "candela",
        150.0,
        80.0,
        600.0,
        _R23,
        ("reversing", "reverse light", "rueckfahrlicht"),
    ),
    LampClass(
        "direction-indicator",
        "candela",
        250.0,
        50.0,
        1000.0,
        f"{_R6}, categories 1 and 2a",
        ("indicator", "blinker", "turn signal", "turnsignal"),
        color=_AMBER,
    ),
    LampClass(
        "traffic-signal",
        "candela",
        200.0,
        100.0,
        2500.0,
        _EN12368,
        ("traffic light", "trafficlight", "traffic signal", "ampel"),
    ),
    LampClass(
        "obstacle-light",
        "candela",
        32.0,
        10.0,
        32.0,
        _ICAO,
        ("obstacle", "obstruction light", "hindernisfeuer"),
        color=_RED,
    ),
    LampClass(
        "street-light",
        "lumens",
        6300.0,
        4000.0,
        31_250.0,
        _EU245,
        (
            "street light",
            "streetlight",
            "street lamp",
            "streetlamp",
            "road lamp",
            "lamppost",
            "lamp post",
            "strassenlaterne",
            "lampadaire",
            "farola",
        ),
        "high-pressure-sodium",
    ),
    LampClass(
        "household-bulb",
        "lumens",
        806.0,
        249.0,
        1521.0,
        _EU244,
        ("bulb", "lightbulb", "ceiling lamp", "table lamp", "gluehbirne"),
        "led",
    ),
    LampClass(
        "fluorescent-tube",
        "luminance",
        10_900.0,
        5_000.0,
        20_000.0,
        _EN60081,
        ("fluorescent", "neon tube", "leuchtstoff"),
        "fluorescent",
    ),
    LampClass(
        "illuminated-sign",
        "luminance",
        150.0,
        40.0,
        900.0,
        _EN12899,
        ("illuminated sign", "lit sign", "lightbox sign"),
    ),
    LampClass(
        "advertisement",
        "luminance",
        400.0,
        100.0,
        1000.0,
        _PLG05,
        ("billboard", "advert", "advertisement", "werbung"),
    ),
    LampClass(
        "exit-sign",
        "luminance",
        100.0,
        2.0,
        500.0,
        _EN1838,
        ("exit sign", "emergency exit", "notausgang"),
    ),
)

#: Lamp classes by name.
BY_NAME = {lamp.name: lamp for lamp in LAMP_CLASSES}


def lamp_class(name: str) -> LampClass | None:
    """The class that a name tells of, by the phrase with the most words; None of none.

    Of phrases of as many words the first in the table counts.
    """
    there = set(words(name))
    there |= {word[:-1] for word in there if word.endswith("s")}
    best: tuple[int, LampClass] | None = None
    for lamp in LAMP_CLASSES:
        for phrase in lamp.phrases:
            parts = phrase.split()
            if there.issuperset(parts) and (best is None or len(parts) > best[0]):
                best = len(parts), lamp
    return None if best is None else best[1]
