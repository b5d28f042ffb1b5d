"""The account of many conversions: sums, and what to fix first in all of them."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hdrusd.account.fix import MOST, PHOTOMETRY
from hdrusd.photometry.sidecar import STATED_ITSELF, Unmatched

Row = Mapping[str, Any]

FORMAT = "hdrusd-batch/1"

#: Files that an entry of what to fix first names.
_NAMED = 3

#: Totals of one conversion that are counts by name.
_BY_NAME = ("lamps_by_rule", "lamps_by_confidence", "textures_by_class", "findings_by_kind")


@dataclass(frozen=True, slots=True)
class Converted:
    """One file of a batch. ``document``: ``Result.as_dict()``, or the findings of a refusal."""

    source: Path
    output: Path
    document: Mapping[str, Any]
    code: int = 0  # the exit code of a conversion of this file alone
    error: str = ""  # the line of a refusal
    photometry: Path | None = None
    shared: bool = False  # the photometry is that of other files too
    unmatched: Sequence[Unmatched] = ()  # its patterns that fit nothing here
    parts: Set[Path] = frozenset()  # the files that it is made of, real paths


@dataclass(slots=True)
class _Fix:
    """Entries that are mended in one way, of several files."""

    impact: float = 0.0
    entries: list[Row] = field(default_factory=list)
    files: list[str] = field(default_factory=list)

    def most(self) -> Row:
        """The gravest entry; of equally grave ones what most files say."""
        said = Counter(entry["what"] for entry in self.entries)
        return max(self.entries, key=lambda entry: (entry["impact"], said[entry["what"]]))


def unused_patterns(rows: Sequence[Converted]) -> list[Unmatched]:
    """The patterns of shared photometry files that fit nothing in any file."""
    sharing: dict[Path, list[set[Unmatched]]] = defaultdict(list)
    for row in rows:
        if row.photometry is not None and row.shared and not row.code:
            sharing[row.photometry].append({_by_place(u) for u in row.unmatched})
    common = (set.intersection(*sets) for sets in sharing.values())
    unused = (pattern for found in common for pattern in found)
    return sorted(unused, key=lambda u: (u.place.file, str(u.place), u.pattern))


def _by_place(pattern: Unmatched) -> Unmatched:
    """Why it fits nothing may differ from file to file."""
    if pattern.text == STATED_ITSELF:
        return pattern
    return Unmatched(pattern.place, pattern.pattern, "nothing of that name in any of its files")


def parts_of_others(rows: Sequence[Converted]) -> set[Path]:
    """The sources that others are made of; of a circle all but the first."""
    converted = {row.source.resolve(): row for row in rows if not row.code}
    inside = {file: (row.parts & converted.keys()) - {file} for file, row in converted.items()}
    named = set[Path]().union(*inside.values())
    reached: set[Path] = set()
    tops: set[Path] = set()
    for file in sorted(converted, key=lambda file: (file in named, file)):
        if file in reached:
            continue
        tops.add(file)
        stack = [file]
        while stack:
            new = inside[stack.pop()] - reached
            reached |= new
            stack.extend(new)
    return {converted[file].source for file in converted.keys() - tops}


def batch_document(rows: Sequence[Converted]) -> dict[str, Any]:
    """JSON form: docs/report.md. Sums, and what to fix first, are not of parts of other files:
    those have them already.
    """
    converted = [row for row in rows if not row.code]
    parts = parts_of_others(rows)
    whole = [row for row in converted if row.source not in parts]
    sums = _totals([row.document["totals"] for row in whole])
    unused = unused_patterns(rows)
    findings = sum(sums["findings_by_kind"].values())
    summary = f"{len(converted)} of {len(rows)} files converted"
    if parts:
        summary += f", {len(parts)} of them parts of others, which the sums leave out"
    return {
        "format": FORMAT,
        "summary": f"{summary}; {findings} findings",
        "totals": {
            "files": len(rows),
            "converted": len(converted),
            "parts": len(parts),
            **sums,
        },
        "findings_by_code": _codes(rows),
        "unused_patterns": [
            # With the whole path: many folders may have a file of that name.
            {"place": f"{u.place.file}:{u.place.place}", "pattern": u.pattern, "text": u.text}
            for u in unused
        ],
        "fix_first": _fix_first(whole),
        "files": [_file(row, part=row.source in parts) for row in rows],
    }


def _file(row: Converted, *, part: bool) -> dict[str, Any]:
    own = {
        "source": str(row.source),
        "output": None if row.code else str(row.output),
        "part": part,
        "code": row.code,
        "error": row.error or None,
    }
    return own | {"report": dict(row.document)}


def _totals(rows: Iterable[Row]) -> dict[str, Any]:
    """The sums of sums; lumens of the lamps whose flux is known."""
    rows = list(rows)
    sums: dict[str, Any] = {}
    for key in _BY_NAME:
        counts: Counter[str] = Counter()
        for row in rows:
            counts.update(row[key])
        sums[key] = dict(counts.most_common())
    for key in next(iter(rows), {}):
        if key not in (*_BY_NAME, "flux_lm"):
            sums[key] = sum(row[key] for row in rows)
    known = [row["flux_lm"] for row in rows if row["flux_lm"] is not None]
    return sums | {"flux_lm": float(sum(known)) if known else None}


def _codes(rows: Sequence[Converted]) -> list[dict[str, Any]]:
    """Listed findings by kind and code, those in most files first."""
    counts: Counter[tuple[str, str]] = Counter()
    files: Counter[tuple[str, str]] = Counter()
    for row in rows:
        here = Counter((f["kind"], f["code"]) for f in row.document["findings"])
        counts.update(here)
        files.update(here.keys())
    order = sorted(files, key=lambda key: (-files[key], -counts[key], key))
    return [
        {"kind": k, "code": c, "findings": counts[k, c], "files": files[k, c]} for k, c in order
    ]


def _in_a_batch(fix: _Fix, count: int) -> Row:
    """The gravest entry of ``fix``; what an option would do to the other files of ``count``."""
    entry = fix.most()
    if (entry["write"] or "").startswith("--source-unit") and len(fix.files) < count:
        why = "; the option is for every file of a run: [source] unit beside these is not"
        return {**entry, "why": entry["why"] + why}
    return entry


def _fix_first(rows: Sequence[Converted]) -> list[dict[str, Any]]:
    """Entries that the same words mend in the same place are one; its impact is the sum over the
    files' shares. A photometry file that is there is named by its path.
    """
    fixes: dict[tuple[str, str], _Fix] = defaultdict(_Fix)
    for row in rows:
        for entry in row.document["fix_first"]:
            if entry["where"] == PHOTOMETRY and row.photometry is not None:
                entry = {**entry, "where": str(row.photometry)}
            fix = fixes[entry["where"], entry["write"] or entry["what"]]
            fix.impact += entry["impact"] / len(rows)
            fix.entries.append(entry)
            if str(row.source) not in fix.files:
                fix.files.append(str(row.source))
    order = sorted(fixes.values(), key=lambda fix: -fix.impact)[:MOST]
    return [
        {
            **_in_a_batch(fix, len(rows)),
            "rank": rank,
            "impact": round(fix.impact, 4),
            "files": len(fix.files),
            "for_example": fix.files[:_NAMED],
        }
        for rank, fix in enumerate(order, start=1)
    ]
