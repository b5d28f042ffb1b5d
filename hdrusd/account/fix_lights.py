"""What to fix first of the lights: whose numbers are guesses, or that nothing shines."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from hdrusd.account.fix import (
    DECADES,
    KEPT,
    LEAST,
    PHOTOMETRY,
    SOURCE,
    TRUST,
    Entry,
    Group,
    Row,
    Scene,
    entry_of,
    few,
    first,
    percent,
    rule_of,
    share_of,
)
from hdrusd.account.lights import FACTOR, group_name, grouped, pattern_finder
from hdrusd.photometry.recipe_entry import toml_table


def dark(scene: Scene) -> Iterator[Entry]:
    """That nothing lights the scene."""
    if any(row["value"] * row["lamps_shown"] for row in scene.lights):
        return
    where = "the states that are shown" if scene.lights else "the source"
    if scene.lumens > 0.0:
        what, impact = f"nothing lights the scene: no light in {where}", 1.0
        why = "what glows is seen, and sends no light to other surfaces"
    else:
        what, impact = f"nothing shines: no light in {where}, no surface that glows", 3.0
        why = "a stage without light is black at night"
    why += "; full moon gives 0.25 lx, a lit city's sky 0.05; what is only placed in other stages "
    why += "needs none, or their skies add up"
    yield Entry(impact, what, why, PHOTOMETRY, "[ambient]\nilluminance = 0.05")


def lights(scene: Scene) -> Iterator[Entry]:
    """Lights by their share and how far they may be off."""
    patterns = pattern_finder(scene.lights)
    small: dict[tuple[str, ...], list[Group]] = defaultdict(list)
    for group in grouped(scene.lights):
        row, lamps = group[0], _lamps(group)
        if not lamps:  # nobody sees what they give
            continue
        share = share_of(sum(map(scene.flux, group)), scene.lit)
        impact = share * DECADES[row["confidence"]]
        if impact < LEAST:
            small[row["kind"], row["confidence"], rule_of(row)].append(group)
            continue
        many = f"{lamps} lamps, " if lamps > 1 else ""
        unit = f"times {row['file']}" if row["unit"] == FACTOR else row["unit"]
        value = float(f"{row['value']:.4g}")
        what = f"{group_name(group)}: {many}{value:g} {unit} by {row['rule'] or row['provenance']}"
        why = f"{percent(share)} of the scene's light; {TRUST[row['confidence']]}"
        write: str | None
        if entry := entry_of(row):
            write = None  # a second entry would not count, or lose what the first one says besides
            why += f"; the number stands in {entry} there"
        elif row["kind"] == "ambient":
            why += "; full moon gives 0.25 lx"
            write = f"[ambient]\nilluminance = {value:g}"
        else:
            write = first(_tables(group, patterns(group)))
        yield Entry(impact, what, why, PHOTOMETRY, write)
    yield from (_small_lights(scene, groups, patterns) for groups in small.values())


def _small_lights(
    scene: Scene, groups: Sequence[Group], patterns: Callable[[Group], list[str]]
) -> Entry:
    """Groups of one kind, confidence and rule, none of which is listed alone."""
    groups = sorted(groups, key=lambda group: -sum(map(scene.flux, group)))
    rows = [row for group in groups for row in group]
    row, lamps = rows[0], _lamps(rows)
    share = share_of(sum(map(scene.flux, rows)), scene.lit)
    called = few([group_name(group) for group in groups])
    values = sorted(row["value"] for row in rows)
    span = " to ".join(dict.fromkeys(f"{value:.4g}" for value in (values[0], values[-1])))
    value = "" if row["unit"] == FACTOR else f", {span} {row['unit']} each"
    what = f"{lamps} lights together{value} by {rule_of(row)}: {called}"
    why = f"{percent(share)} of the scene's light; {TRUST[row['confidence']]}"
    write = None
    if entry_of(row):
        why += f"; the numbers stand there, in {few([entry_of(row) for row in rows])}"
    elif row["kind"] != "ambient":
        tables = [_tables(group, patterns(group)) for group in groups]
        everything = len(rows) == len(scene.lights) and len({_stated(row) for row in rows}) == 1
        # What is dark in the source would shine by a pattern for all.
        if everything and not any(f["code"] == "light-dark" for f in scene.findings):
            tables = [_tables(rows, ["*"])]
        write = first([table for some in tables for table in some])
    return Entry(share * DECADES[row["confidence"]], what, why, PHOTOMETRY, write)


def _lamps(rows: Sequence[Row]) -> int:
    return sum(row["lamps_shown"] for row in rows)


def _stated(row: Row) -> tuple[tuple[str, Any], ...]:
    """The keys that say a light's number as it is."""
    value = float(f"{row['value']:.4g}")
    if row["unit"] == FACTOR:
        lumens = () if row["flux_lm"] is None else (("lumens", round(row["flux_lm"])),)
        return ("ies", "FILE"), *lumens
    key = "illuminance" if row["kind"] == "distant" else "candela"
    return (key, value), *KEPT[row["confidence"]].items()


def _tables(group: Group, patterns: Sequence[str]) -> list[str]:
    return [toml_table("light", pattern, **dict(_stated(group[0]))) for pattern in patterns]


def held(scene: Scene) -> Iterator[Entry]:
    """Lamps that what holds them may shade."""
    told: dict[str, list[str]] = defaultdict(list)
    for finding in scene.findings:
        if finding["code"] == "fixture-large":
            told[finding["thing"]].append(finding["text"])
    little, small, lamps = 0.0, list[str](), 0
    for group in grouped(scene.lights):
        names = dict.fromkeys(row["name"] for row in group)
        found = [text for name in names for text in told[name]]
        if not found:
            continue
        count = min(len(found), len(group))
        share = share_of(sum(map(scene.flux, group)), scene.lit) * count / len(group)
        if share < LEAST:
            little, lamps = little + share, lamps + count
            small.append(group_name(group))
            continue
        what = f"{group_name(group)}: {count} of {len(group)} inside a mesh that shades it"
        why = f"{percent(share)} of the scene's light; {found[0]}"
        yield Entry(share, what, why, SOURCE, None)
    what = f"{lamps} lights together, inside meshes that shade them: {few(small)}"
    why = f"{percent(little)} of the scene's light"
    yield Entry(little, what, why, SOURCE, None)
