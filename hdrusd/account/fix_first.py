"""What to fix first: the few things in which a converted scene is likely to be most wrong.

Impact is a share of the scene times the decades (log10) by which it may be off. Lights count
by flux, lumens of lamps and lux on level ground times the ground for what comes from afar; what
glows, pi L A,
counts among all of both, for it is seen but lights nothing. Surfaces count by area. An estimate
from a colour may be off by a decade, one by a lamp's class by half of that, a stated number
without a source by a tenth.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from hdrusd.account.lights import FACTOR, all_names, group_name, group_patterns, grouped
from hdrusd.photometry.albedo import words
from hdrusd.photometry.recipe_entry import toml_entry, toml_table

Row = Mapping[str, Any]

#: Entries that are worth a person's morning, and the impact from which on one is.
MOST, LEAST = 10, 0.02

#: Decades that a number may be off by its confidence.
_DECADES = {"none": 1.0, "low": 0.5, "medium": 0.1, "high": 0.0}

#: What a person is told of a number by its confidence.
_TRUST = {
    "none": "guessed from a colour without a unit",
    "low": "typical of its class, or somebody's guess",
    "medium": "stated without a source, or by the lamp's type",
    "high": "measured, or stated with its source",
}

#: What stands beside a number that is written back as it is, so that a copy is not trusted more
#: than the original: a guess stays one, and who fills in a source has looked.
_KEPT = {
    "none": {"provenance": "estimated"},
    "low": {"provenance": "estimated"},
    "medium": {"source": ""},
    "high": {},
}

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

#: What glows is looked at: as much as a tenth of the scene, however small it is.
_LOOKED_AT = 0.1

#: White stands in for a missing picture: real surfaces have a third of it.
_MISSING = 0.5

#: The entry of the photometry file that a rule names.
_ENTRY = re.compile(r":((?:light|lamp|material)\[\d+\]|ambient)")

PHOTOMETRY, COMMAND, SOURCE = "photometry.toml", "command line", "source"


@dataclass(frozen=True, slots=True)
class Entry:
    """One thing to fix; ``write`` goes ``where``, None where there is nothing to copy."""

    impact: float
    what: str
    why: str
    where: str
    write: str | None

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "impact": round(self.impact, 4),
            "what": self.what,
            "why": self.why,
            "where": self.where,
            "write": self.write,
        }


@dataclass(frozen=True)
class Scene:
    """What a ranking needs of a conversion. ``ground``: m2 below it; ``diagonal``: m;
    ``findings``: their JSON form.
    """

    lights: Sequence[Row]
    materials: Sequence[Row]
    images: Sequence[Row]
    findings: Sequence[Row]
    ground: float
    diagonal: float
    unit_stated: bool = False
    name: str = ""  # of the source file, without its suffix

    def flux(self, row: Row) -> float:
        """Lumens that a row of lights sends into the scene."""
        if row["kind"] in ("distant", "ambient"):
            # Where there is no ground, walls are what is lit, and they stand each their way.
            lux, area = row["level_lux"], self.ground
            if not self.ground:
                lux, area = row["value"], self.diagonal**2
            return float(lux * row["lamps"] * area)
        return float((row["flux_lm"] or 0.0) * row["lamps"])

    def glow(self, row: Row) -> float:
        """Lumens of a material that glows on one side: pi L A."""
        return math.pi * float(row["luminance_cd_m2"]) * float(row["area_m2"])

    @cached_property
    def lit(self) -> float:
        """Lumens of all lights."""
        return sum(map(self.flux, self.lights))

    @cached_property
    def lumens(self) -> float:
        """Lumens of lights and of what glows."""
        return self.lit + sum(map(self.glow, self.materials))

    @cached_property
    def area(self) -> float:
        """m2 of all surfaces."""
        return float(sum(row["area_m2"] for row in self.materials))


def fix_first(scene: Scene) -> list[dict[str, Any]]:
    """The entries by falling impact, ``MOST`` of them."""
    kinds = (_dark, _lights, _held, _glowing, _units, _missing, _doubts, _unused, _patterns)
    entries = [entry for kind in kinds for entry in kind(scene) if entry.impact >= LEAST]
    entries.sort(key=lambda entry: -entry.impact)
    return [{"rank": n, **entry.as_dict()} for n, entry in enumerate(entries[:MOST], start=1)]


def _dark(scene: Scene) -> Iterator[Entry]:
    if any(row["value"] * row["lamps"] for row in scene.lights):
        return
    if scene.lumens > 0.0:
        what, impact = "nothing lights the scene: no light in the source", 1.0
        why = "what glows is seen, and sends no light to other surfaces"
    else:
        what, impact = "nothing shines: no light in the source, no surface that glows", 3.0
        why = "a stage without light is black at night"
    why += "; full moon gives 0.25 lx, a lit city's sky 0.05; what is only placed in other stages "
    why += "needs none, or their skies add up"
    yield Entry(impact, what, why, PHOTOMETRY, "[ambient]\nilluminance = 0.05")


def _lights(scene: Scene) -> Iterator[Entry]:
    names = all_names(scene.lights)
    for group in grouped(scene.lights):
        row = group[0]
        share = _share(sum(map(scene.flux, group)), scene.lit)
        lamps = sum(r["lamps"] for r in group)
        value = float(f"{row['value']:.4g}")
        many = f"{lamps} lamps, " if lamps > 1 else ""
        unit = f"times {row['file']}" if row["unit"] == FACTOR else row["unit"]
        what = f"{group_name(group)}: {many}{value:g} {unit} by {row['rule'] or row['provenance']}"
        why = f"{_percent(share)} of the scene's light; {_TRUST[row['confidence']]}"
        write: str | None
        if entry := _entry(row):
            write = None  # a second entry would not count, or lose what the first one says besides
            why += f"; the number stands in {entry} there"
        elif row["kind"] == "ambient":
            why += "; full moon gives 0.25 lx"
            write = f"[ambient]\nilluminance = {value:g}"
        elif row["kind"] == "distant":
            write = _tables(group, names, illuminance=value, **_KEPT[row["confidence"]])
        elif row["unit"] == FACTOR:
            stated = {} if row["flux_lm"] is None else {"lumens": round(row["flux_lm"])}
            write = _tables(group, names, ies="FILE", **stated)
        else:
            write = _tables(group, names, candela=value, **_KEPT[row["confidence"]])
        yield Entry(share * _DECADES[row["confidence"]], what, why, PHOTOMETRY, write)


def _tables(group: Sequence[Row], names: Sequence[str], **values: Any) -> str:
    """Entries for a group of lights; of very many that share names with others the first."""
    patterns = group_patterns(group, names)
    tables = [toml_table("light", pattern, **values) for pattern in patterns[:MOST]]
    more = [f"# and {len(patterns) - MOST} more like these"] if len(patterns) > MOST else []
    return "\n".join([*tables, *more])


def _held(scene: Scene) -> Iterator[Entry]:
    """Lamps that what holds them may shade."""
    held = [finding for finding in scene.findings if finding["code"] == "fixture-large"]
    for group in grouped(scene.lights):
        names = {row["name"] for row in group}
        found = [finding["text"] for finding in held if finding["thing"] in names]
        if not found:
            continue
        count = min(len(found), len(group))
        share = _share(sum(map(scene.flux, group)), scene.lit) * count / len(group)
        what = f"{group_name(group)}: {count} of {len(group)} inside a mesh that shades it"
        why = f"{_percent(share)} of the scene's light; {found[0]}"
        yield Entry(share, what, why, SOURCE, None)


def _glowing(scene: Scene) -> Iterator[Entry]:
    for row in scene.materials:
        if not row["luminance_cd_m2"] or not row["area_m2"]:  # nobody sees what nothing wears
            continue
        shares = _share(scene.glow(row), scene.lumens), _share(row["area_m2"], scene.area)
        share = max(*shares, _LOOKED_AT)
        value = float(f"{row['luminance_cd_m2']:.4g}")
        what = f"{row['name']}: {value:g} cd/m2 by {row['rule'] or row['provenance']}"
        why = f"it is seen, and dazzles, at this luminance; {_TRUST[row['confidence']]}"
        write: str | None
        if entry := _entry(row):
            write = None
            why += f"; the number stands in {entry} there"
        else:
            write = toml_entry("material", row["name"], luminance=value, **_KEPT[row["confidence"]])
        yield Entry(share * _DECADES[row["confidence"]], what, why, PHOTOMETRY, write)


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


def _missing(scene: Scene) -> Iterator[Entry]:
    lost = [row for row in scene.images if row["missing"]]
    if not lost:
        return
    share = min(sum(row["share"] for row in lost), 1.0)
    names = ", ".join(row["name"] for row in lost[:3]) + (", ..." if len(lost) > 3 else "")
    what = f"{len(lost)} missing texture{'s' if len(lost) > 1 else ''}: {names}"
    why = f"worn by {_percent(share)} of the surface, which has its plain colour instead"
    # A file that lies outside the roots is there: the finding says which root would allow it.
    refused = (f["text"] for f in scene.findings if f["code"] == "file-refused")
    roots = (re.search(r"--root (.+) would allow it", text) for text in refused)
    root = next((found[0].removesuffix(" would allow it") for found in roots if found), None)
    yield Entry(max(share, 0.05) * _MISSING, what, why, COMMAND, root or "--search-path FOLDER")


def _doubts(scene: Scene) -> Iterator[Entry]:
    for row in scene.materials:
        for doubt in row["doubts"]:
            share = _share(row["area_m2"], scene.area)
            what, why = f"{row['name']}: {doubt['text']}", f"{_percent(share)} of the surface"
            if doubt["citation"]:
                mean, kind = row["reflectance"]["mean"], row["surface_class"] or "what is known"
                limits = f"{doubt['low']:g} to {doubt['high']:g}"
                what = f"{row['name']}: mean reflectance {mean:.3g}; {kind} has {limits}"
                why += f"; {doubt['citation']}"
            where = PHOTOMETRY if doubt["write"] else SOURCE
            yield Entry(share * doubt["decades"], what, why, where, doubt["write"])


def _unused(scene: Scene) -> Iterator[Entry]:
    """Pictures that speak of light and are not used."""
    for row in scene.images:
        if row["class"] == "unused" and row["meant"] == "emission":
            what = f"{row['name']}: its name speaks of light, and nothing uses it"
            named = ", ".join(row["materials"][:3])
            why = f"lamps of {named} may be dark"
            yield Entry(0.5, what, why, SOURCE, None)


def _patterns(scene: Scene) -> Iterator[Entry]:
    for finding in scene.findings:
        if finding["code"] == "sidecar-no-match":
            what = f"pattern {finding['thing']!r} ({finding['place']}): {finding['text']}"
            yield Entry(0.5, what, "what it says is not used", PHOTOMETRY, None)


def _entry(row: Row) -> str:
    """The entry of the photometry file that a number is from, "" where it is from elsewhere."""
    found = _ENTRY.search(row["rule"] or "")
    return found[1] if found else ""


def _share(part: float, whole: float) -> float:
    return part / whole if whole > 0.0 else 0.0


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.01 else "under 1 %"
