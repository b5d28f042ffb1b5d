"""The account of a conversion as plain text for a terminal: no longer than a screen."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hdrusd.account.fix import COMMAND, PHOTOMETRY, SOURCE
from hdrusd.account.lights import FACTOR, group_name, grouped
from hdrusd.columns import columns, cut, padded, wrapped
from hdrusd.errors import one_line

#: Rows of lights and entries of what to fix that are shown; the report has all.
LIGHTS, ENTRIES = 8, 5

#: Codes of findings that are shown of a batch.
CODES = 8

#: Columns below which and above which a line is not set.
_NARROWEST, _WIDEST = 60, 120

_MORE = "--report FILE has all"


def summary(document: Mapping[str, Any], screen: int) -> list[str]:
    """Lines of at most ``screen`` columns (60 to 120). ``document``: ``Result.as_dict``."""
    width = min(max(screen, _NARROWEST), _WIDEST)
    lines = [
        *_lights(document["lights"], document["totals"], width),
        *_surfaces(document["totals"]),
        *_fixes(document["fix_first"], width),
    ]
    return [cut(line, width) for line in lines]


def batch_summary(document: Mapping[str, Any], screen: int) -> list[str]:
    """As ``summary``, of ``batch_document``."""
    width = min(max(screen, _NARROWEST), _WIDEST)
    totals = document["totals"]
    lines = [document["summary"]]
    lines += [
        f"  {row['kind']}: {row['code']}: {row['findings']} in {_files(row['files'])}"
        for row in document["findings_by_code"][:CODES]
    ]
    if len(document["findings_by_code"]) > CODES:
        left = len(document["findings_by_code"]) - CODES
        lines.append(f"  and {left} more code{'s' if left > 1 else ''}; {_MORE}")
    for unused in document["unused_patterns"]:
        said = one_line(f"{unused['place']}: {unused['pattern']}: {unused['text']}")
        lines += wrapped(said, width, "  ")
    if totals["converted"]:
        lines += [_sum_of_lights(totals), *_surfaces(totals)]
        entries = [
            {**entry, "what": f"{_files(entry['files'])}: {entry['what']}"}
            for entry in document["fix_first"]
        ]
        lines += _fixes(entries, width)
    return [cut(line, width) for line in lines]


def _files(count: int) -> str:
    return f"{count} file{'s' if count > 1 else ''}"


def _lights(
    rows: Sequence[Mapping[str, Any]], totals: Mapping[str, Any], width: int
) -> Iterator[str]:
    yield _sum_of_lights(totals)
    rows = [row for row in rows if row["lamps_shown"]]
    if not rows:
        return
    groups = sorted(grouped(rows), key=_strength, reverse=True)
    cells = [("", "source says", "rule", "result", "confidence"), *map(_cells, groups[:LIGHTS])]
    widths = [max(columns(row[i]) for row in cells) for i in range(5)]
    # What is too wide loses in its names and rules, which the report has in full.
    for column in (2, 0, 1):
        over = sum(widths) + 2 * 5 - width
        widths[column] = max(min(widths[column], 12), widths[column] - max(over, 0))
    for row in cells:
        parts = (padded(cell, n) for cell, n in zip(row, widths, strict=True))
        yield f"  {'  '.join(parts)}".rstrip()
    if len(groups) > LIGHTS:
        yield f"  and {sum(map(len, groups[LIGHTS:]))} more; {_MORE}"


def _sum_of_lights(totals: Mapping[str, Any]) -> str:
    hidden = totals["lamps_not_shown"]
    more = f"; {hidden} more in states not shown" if hidden else ""
    if not totals["lamps"]:
        return f"lights: none{more}"
    lumens = totals["flux_lm"]
    trust = ", ".join(f"{n} {c}" for c, n in totals["lamps_by_confidence"].items())
    flux = "" if lumens is None else f", {lumens:.4g} lm"
    return f"lights: {lights_and_skies(totals)}{flux}{more}; confidence: {trust}"


def lights_and_skies(totals: Mapping[str, Any]) -> str:
    """``4, skies: 1``: how many lights there are, and what else lights the scene."""
    skies = totals["skies"]
    return f"{totals['lamps'] - skies}" + (f", skies: {skies}" if skies else "")


def _strength(group: Sequence[Mapping[str, Any]]) -> float:
    return float(sum((row["flux_lm"] or row["value"]) * row["lamps_shown"] for row in group))


def _cells(group: Sequence[Mapping[str, Any]]) -> tuple[str, str, str, str, str]:
    row = group[0]
    lamps = sum(r["lamps_shown"] for r in group)
    name = one_line(group_name(group)) + (f" ({lamps})" if lamps > 1 else "")
    said = row["source_value"]
    if said is None:
        source = ""
    elif said["unit"] == "colour":
        source = f"colour {' '.join(f'{c:.3g}' for c in said['diffuse'])}"
    else:
        source = f"{said['value']:.4g} {said['unit']}"
    unit = "x" if row["unit"] == FACTOR else row["unit"]
    is_now = f"{row['value']:.4g} {unit}"
    if row["unit"] == FACTOR and row["flux_lm"] is not None:
        is_now = f"{row['flux_lm']:.4g} lm by file"
    return name, source, one_line(row["rule"] or row["provenance"]), is_now, row["confidence"]


def _surfaces(totals: Mapping[str, Any]) -> Iterator[str]:
    classes = ", ".join(f"{n} {c}" for c, n in totals["textures_by_class"].items())
    counts = {word: totals[f"textures_{word}"] for word in ("missing", "broken")}
    lost = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    yield f"textures: {classes or 'none'}" + (f" ({lost})" if lost else "")
    yield (
        f"reflectances: {totals['materials_judged']} of {totals['materials']} materials judged, "
        f"{totals['materials_doubted']} doubted"
    )


def _fixes(entries: Sequence[Mapping[str, Any]], width: int) -> Iterator[str]:
    if not entries:
        return
    yield "what to fix first:"
    for entry in entries[:ENTRIES]:
        yield cut(f"  {entry['rank']}. {one_line(entry['what'])}", width)
        yield from (f"     {line}" for line in wrapped(one_line(entry["why"]), width - 5)[:2])
        if entry["write"]:
            one, *more = re.split(r"\n(?=\[\[|#)", entry["write"])
            head, _, body = one.partition("\n")
            told = f"{entry['where']}: {head} {', '.join(body.splitlines())}".rstrip()
            told += f"; {_MORE}" if more else ""
        elif entry["where"] not in (PHOTOMETRY, COMMAND, SOURCE):
            told = entry["where"]  # which photometry file of a batch
        else:
            continue
        lines = wrapped(one_line(told), width - 5)[:2]
        yield from (f"     {line}" for line in lines)
    if len(entries) > ENTRIES:
        yield f"  and {len(entries) - ENTRIES} more; {_MORE}"
