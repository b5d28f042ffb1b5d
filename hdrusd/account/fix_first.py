"""What to fix first: the few things in which a converted scene is likely to be most wrong.

Impact is a share of the scene times the decades (log10) by which it may be off. Lights count
by flux, lumens of lamps and lux on level ground times the ground for what comes from afar; what
glows, pi L A, counts among all of both, for it is seen but lights nothing. Surfaces count by
area. An estimate from a colour may be off by a decade, one by a lamp's class by half of that, a
stated number without a source by a tenth. What is too little to be listed is summed with its like.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hdrusd.account.fix import COMMAND, LEAST, MOST, PHOTOMETRY, Entry, Scene
from hdrusd.account.fix_lights import dark, held, lights
from hdrusd.account.fix_pictures import lost, unused
from hdrusd.account.fix_surfaces import doubts, glowing
from hdrusd.photometry.albedo import words

#: What a reader takes for the unit that nobody states: lux go with its square. Of a scene of a
#: plausible size, m, it seldom is anything else; of another it must be.
_UNITS_TAKEN = {
    "obj-units": "1 m",
    "osg-axes": "1 m",
    "assimp-axes": "1 m",
    "3ds-units": "1 m",
    "flt-unit": "1 m",
    "fbx-unit": "1 cm",
}
_SIZES = (0.5, 30_000.0)
_PLAUSIBLE, _IMPLAUSIBLE = 0.15, 2.0

#: How large things are whose name a source may have, m across all three dimensions.
_THINGS: tuple[tuple[str, tuple[float, float]], ...] = (
    ("car cars suv sedan taxi van auto pkw voiture coche", (2.5, 8.0)),
    ("truck bus lorry ambulance lkw camion", (4.0, 30.0)),
    ("lamp lamppost streetlamp streetlight lantern laterne lampadaire farola", (0.2, 25.0)),
    ("sign bollard hydrant bench mailbox schild", (0.2, 12.0)),
    ("house haus maison casa garage", (4.0, 60.0)),
    ("person human man woman pedestrian", (0.5, 2.8)),
)


def fix_first(scene: Scene) -> list[dict[str, Any]]:
    """The entries by falling impact, ``MOST`` of them."""
    kinds = (dark, lights, held, glowing, _units, lost, doubts, unused, _patterns)
    entries = [entry for kind in kinds for entry in kind(scene) if entry.impact >= LEAST]
    entries.sort(key=lambda entry: -entry.impact)
    return [{"rank": n, **entry.as_dict()} for n, entry in enumerate(entries[:MOST], start=1)]


def _units(scene: Scene) -> Iterator[Entry]:
    if scene.unit_stated or scene.area <= 0.0:
        return
    guesses = (f["code"] for f in scene.findings if f["kind"] != "replaced")
    guessed = next((_UNITS_TAKEN[code] for code in guesses if code in _UNITS_TAKEN), None)
    called = set(words(scene.name))
    thing = next((size for names, size in _THINGS if called & set(names.split())), None)
    low, high = thing or _SIZES
    plausible = low <= scene.diagonal <= high
    if plausible and not guessed:
        return
    said = f"the source has none, {guessed} is taken" if guessed else "as the source has it"
    what = f"unit of length: {said}; all is {scene.diagonal:.3g} m across"
    if not plausible:
        what += f", and {scene.name if thing else 'a scene'} should be {low:g} to {high:g} m"
    why = "illuminance goes with the square of a length"
    impact = _PLAUSIBLE if plausible else _IMPLAUSIBLE
    yield Entry(impact, what, why, COMMAND, "--source-unit METERS")


def _patterns(scene: Scene) -> Iterator[Entry]:
    for finding in scene.findings:
        if finding["code"] == "sidecar-no-match":
            what = f"pattern {finding['thing']!r} ({finding['place']}): {finding['text']}"
            yield Entry(0.5, what, "what it says is not used", PHOTOMETRY, None)
