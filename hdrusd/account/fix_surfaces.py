"""What to fix first of the surfaces: those that glow by a guess, or reflect what none can."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

from hdrusd.account.fix import (
    DECADES,
    KEPT,
    LEAST,
    PHOTOMETRY,
    SOURCE,
    TRUST,
    Entry,
    Row,
    Scene,
    entries,
    entry_of,
    few,
    percent,
    rule_of,
    share_of,
)
from hdrusd.photometry.recipe_entry import toml_entry

#: What glows is looked at: as much as a tenth of the scene, however small it is.
_LOOKED_AT = 0.1

#: Where a surface has its luminance.
_AT = {
    "surface": "",
    "full code": " at full code (255 of 8 bits) of its picture",
    "brightest texel": " in its picture's brightest texel",
}


def glowing(scene: Scene) -> Iterator[Entry]:
    """Surfaces that send out light, which are seen however small they are."""
    small: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for row in scene.materials:
        if not row["luminance_cd_m2"] or not row["area_m2"]:  # nobody sees what nothing wears
            continue
        impact = _glare(scene, [row]) * DECADES[row["confidence"]]
        if impact < LEAST:
            small[row["confidence"], rule_of(row)].append(row)
            continue
        value = f"{row['luminance_cd_m2']:.4g} cd/m2{_AT[row['luminance_of']]}"
        what = f"{row['name']}: {value} by {row['rule'] or row['provenance']}"
        why = f"it is seen, and dazzles, at this luminance; {TRUST[row['confidence']]}"
        write: str | None
        if entry := entry_of(row):
            write = None
            why += f"; the number stands in {entry} there"
        else:
            write = _luminance(row)
        yield Entry(impact, what, why, PHOTOMETRY, write)
    for rows in small.values():
        rows.sort(key=lambda row: -scene.glow(row))
        row = rows[0]
        called = few([row["name"] for row in rows])
        what = f"{len(rows)} glowing surfaces together by {rule_of(row)}: {called}"
        why = f"they are seen, and dazzle, at their luminance; {TRUST[row['confidence']]}"
        if entry_of(row):
            write = None
            why += f"; the numbers stand there, in {few([entry_of(row) for row in rows])}"
        else:
            write = entries((row["name"], _luminance(row)) for row in rows)
        impact = _glare(scene, rows) * DECADES[row["confidence"]]
        yield Entry(impact, what, why, PHOTOMETRY, write)


def _glare(scene: Scene, rows: Sequence[Row]) -> float:
    """The share of the scene that glowing materials are."""
    lumens, area = sum(map(scene.glow, rows)), sum(row["area_m2"] for row in rows)
    return max(share_of(lumens, scene.lumens), share_of(area, scene.area), _LOOKED_AT)


def _luminance(row: Row) -> str:
    value = float(f"{row['luminance_cd_m2']:.4g}")
    return toml_entry("material", row["name"], luminance=value, **KEPT[row["confidence"]])


def doubts(scene: Scene) -> Iterator[Entry]:
    """Reflectances that cannot be, and light in pictures."""
    small: dict[tuple[str, str | None, str | None], list[tuple[float, Row, Row]]]
    small = defaultdict(list)
    for row in scene.materials:
        for doubt in row["doubts"]:
            share = share_of(row["area_m2"], scene.area)
            impact = share * doubt["decades"]
            if impact < LEAST:
                key = doubt["code"], row["surface_class"], doubt["statistic"]
                small[key].append((impact, row, doubt))
                continue
            what, why = f"{row['name']}: {doubt['text']}", f"{percent(share)} of the surface"
            if doubt["citation"]:
                what = f"{row['name']}: {_outside([row], doubt)}"
                why += f"; {doubt['citation']}"
            where = PHOTOMETRY if doubt["write"] else SOURCE
            yield Entry(impact, what, why, where, doubt["write"])
    for found in small.values():
        found.sort(key=lambda each: -each[0])
        rows = [row for _, row, _ in found]
        _, row, doubt = found[0]
        said = _outside(rows, doubt) if doubt["citation"] else f"such as {doubt['text']}"
        what = f"{len(rows)} materials together: {said}: "
        what += few([row["name"] for row in rows])
        share = share_of(sum(row["area_m2"] for row in rows), scene.area)
        why = f"{percent(share)} of the surface"
        if doubt["citation"]:
            why += f"; {doubt['citation']}"
        write = entries((r["name"], d["write"]) for _, r, d in found if d["write"])
        yield Entry(
            sum(impact for impact, _, _ in found), what, why, PHOTOMETRY if write else SOURCE, write
        )


def _outside(rows: Sequence[Row], doubt: Row) -> str:
    """Which statistic of the reflectance of ``rows`` lies where, and where it should."""
    values = [row["reflectance"][doubt["statistic"]] for row in rows]
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    value = low if low == high else f"{low} to {high}"
    if doubt["statistic"] == "p95":
        most = f"{doubt['high']:g}"
        return f"95th percentile of the reflectance {value}; what is known has up to {most}"
    kind = rows[0]["surface_class"] or "what is known"
    return f"mean reflectance {value}; {kind} has {doubt['low']:g} to {doubt['high']:g}"
