"""What is typical of a lamp by its type: lumens a watt, colour, S/P; each with its source.

For lamps of which no more is known than what their label says. All of it is of the lamp by
itself: what a luminaire keeps of its light is for whoever states ``efficacy`` or ``lumens``.
A typical number within a source's range is ours; "unconfirmed": nobody has read that source.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from hdrusd.photometry.scotopic_light import ILLUMINANTS

RGB = tuple[float, float, float]

#: CCT of CIE illuminants that stand for lamps, K (CIE 15:2018, tables 8 to 13), rounded.
_KELVIN = {
    "A": 2856.0,
    "FL12": 3000.0,
    "FL11": 4000.0,
    "FL10": 5000.0,
    "HP1": 1959.0,
    "HP3": 3144.0,
    "HP4": 4002.0,
    "LED-B1": 2733.0,
    "LED-B2": 2998.0,
    "LED-B3": 4103.0,
    "LED-B4": 5109.0,
    "LED-B5": 6598.0,
}

_DOE = "US Department of Energy, Energy Savers, lighting comparison chart"
#: At 70, 100, 150, 250 and 400 W GE's Lucalox data sheet has up to 91, 100, 110, 129, 135 lm/W.
_EU = "Regulation (EC) 245/2009, annex III, clear high-pressure sodium lamps, unconfirmed"
_R37 = "UN Regulation 37, category H7: 1500 lm, at most 58 W at 13.2 V"
_R99 = "UN Regulation 99, category D2S: 3200 lm, 35 W"
_LED = "white LED luminaires of the 2020s, unconfirmed"
_MERCURY = "mean of two spectra, 1.06 and 1.14: NIST CQS simulation 7.4, Ohno and Davis 2008"


@dataclass(frozen=True, slots=True)
class LampType:
    """A type of lamp. ``steps``: (watts up to, lm/W), rising, the last for all above it too.

    ``least`` and ``most``: lm/W that such lamps have. ``temperature``: K, of its colour, or
    ``color``, linear Rec. 709, where it is like that of no black body. ``spectra``: CIE
    illuminants between which its S/P is interpolated by colour temperature; without them it
    is ``sp_ratio``, by ``sp_source``.
    """

    name: str
    text: str
    steps: tuple[tuple[float, float], ...]
    least: float
    most: float
    source: str
    temperature: float | None
    spectra: tuple[str, ...] = ()
    color: RGB | None = None
    sp_ratio: float = 0.0
    sp_source: str = "CIE 15:2018"

    def efficacy(self, watts: float) -> float:
        """lm/W that is typical of a lamp of ``watts``."""
        return next((lm for most, lm in self.steps if watts <= most), self.steps[-1][1])

    def sp(self, kelvin: float | None = None) -> float:
        """S/P at a colour temperature; None: its typical one."""
        if not self.spectra:
            return self.sp_ratio
        points = sorted((_KELVIN[name], ILLUMINANTS[name]) for name in self.spectra)
        at = min(max(kelvin or self.temperature or points[0][0], points[0][0]), points[-1][0])
        for (k0, s0), (k1, s1) in pairwise(points):
            if at <= k1:
                return s0 + (s1 - s0) * (at - k0) / (k1 - k0)
        return points[-1][1]


def _one(efficacy: float) -> tuple[tuple[float, float], ...]:
    return ((0.0, efficacy),)


_TYPES = (
    LampType("incandescent", "tungsten filament", _one(14.0), 10.0, 17.0, _DOE, 2700.0, ("A",)),
    LampType("halogen", "tungsten halogen", _one(17.0), 12.0, 22.0, _DOE, 3000.0, ("A",)),
    LampType("halogen-vehicle", "12 V headlamp bulb", _one(26.0), 20.0, 30.0, _R37, 3200.0, ("A",)),
    LampType(
        "xenon-vehicle",
        "gas-discharge headlamp bulb",
        _one(91.0),
        80.0,
        95.0,
        _R99,
        4200.0,
        ("HP3", "HP4"),
    ),
    LampType(
        "compact-fluorescent",
        "with its ballast",
        _one(60.0),
        50.0,
        70.0,
        _DOE,
        2700.0,
        ("FL12", "FL11", "FL10"),
    ),
    LampType(
        "fluorescent",
        "straight tube",
        _one(85.0),
        30.0,
        110.0,
        _DOE,
        4000.0,
        ("FL12", "FL11", "FL10"),
    ),
    LampType(
        "mercury-vapour",
        "high-pressure mercury, coated bulb",
        _one(50.0),
        25.0,
        60.0,
        _DOE,
        4000.0,
        sp_ratio=1.10,
        sp_source=_MERCURY,
    ),
    LampType(
        "metal-halide",
        "high-pressure metal halide",
        _one(90.0),
        70.0,
        115.0,
        _DOE,
        4000.0,
        ("HP3", "HP4"),
    ),
    LampType(
        "low-pressure-sodium",
        "the two D lines of sodium",
        _one(140.0),
        60.0,
        150.0,
        _DOE,
        None,
        # Of x, y = 0.571, 0.428 (589.3 nm), less what is below 0 in blue.
        color=(2.78, 0.58, 0.0),
        sp_ratio=0.22,
        sp_source="1700 V'(589.3 nm) over 683 V(589.3 nm)",
    ),
    LampType(
        "high-pressure-sodium",
        "clear bulb, standard colour",
        (
            (45.0, 60.0),
            (55.0, 80.0),
            (75.0, 90.0),
            (105.0, 100.0),
            (155.0, 110.0),
            (255.0, 125.0),
            (605.0, 135.0),
        ),
        50.0,
        140.0,
        f"{_EU}; range: {_DOE}",
        2000.0,
        ("HP1",),
    ),
    LampType(
        "led",
        "white, phosphor on a blue chip",
        _one(110.0),
        60.0,
        160.0,
        _LED,
        4000.0,
        ("LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5"),
    ),
)

#: Lamp types by name.
LAMP_TYPES: dict[str, LampType] = {lamp.name: lamp for lamp in _TYPES}
