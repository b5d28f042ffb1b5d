"""What a run lost, guessed, clamped or assumed: nothing is dropped silently."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from hdrusd.errors import SourceRef, one_line

#: Findings of one kind and code that are listed for one file; more are counted only, so that
#: a hostile file cannot fill the memory or the terminal.
LISTED = 200


class Kind(StrEnum):
    """What happened to the thing, from mild to grave."""

    ASSUMED = "assumed"  # the source leaves it open; a stated rule decided
    GUESSED = "guessed"  # a number was estimated
    CLAMPED = "clamped"  # a value was moved into its legal range
    REPLACED = "replaced"  # kept in another form (inverse square for attenuation)
    DROPPED = "dropped"  # has no home in the result
    MISSING = "missing"  # referred to, not found or refused
    INVALID = "invalid"  # broken in the source; the rest was used


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that did not come through as it stood."""

    kind: Kind
    code: str  # short and stable, for machines: "light-attenuation"
    source: SourceRef
    thing: str  # its name in the source
    text: str  # what happened, and what was wanted

    def __str__(self) -> str:
        thing = f"{self.thing}: " if self.thing else ""
        return f"{self.source}: {thing}{self.text}"

    def as_dict(self) -> dict[str, Any]:
        """JSON form; ``place`` is a line number or a path inside the file."""
        return {
            "kind": str(self.kind),
            "code": self.code,
            "file": str(self.source.file),
            "place": self.source.place,
            "thing": self.thing,
            "text": self.text,
        }


#: What is counted together: kind, code, file.
_Family = tuple[Kind, str, Path]


@dataclass(slots=True)
class Report:
    """The findings of one run, in order, each said once.

    Of one kind and code in one file ``LISTED`` are kept; one finding at the end says how
    many more there were. Those are not compared with one another: repeats count.
    """

    _listed: dict[Finding, None] = field(default_factory=dict, repr=False)
    _counts: Counter[_Family] = field(default_factory=Counter, repr=False)

    def add(self, kind: Kind, code: str, source: SourceRef, thing: str, text: str) -> None:
        """Note a finding; the same one twice is kept once."""
        finding = Finding(kind, code, source, one_line(thing), one_line(text))
        if finding in self._listed:
            return
        family = kind, code, source.file
        self._counts[family] += 1
        if self._counts[family] <= LISTED:
            self._listed[finding] = None

    def __iter__(self) -> Iterator[Finding]:
        yield from self._listed
        for (kind, code, file), count in self._counts.items():
            if count > LISTED:
                text = f"{count - LISTED} more {code}; the first {LISTED} are listed"
                yield Finding(kind, code, SourceRef(file), "", text)

    def __len__(self) -> int:
        return self._counts.total()

    def codes(self) -> set[str]:
        """The distinct codes, for tests and ``--strict`` decisions."""
        return {code for _, code, _ in self._counts}

    def kinds(self) -> dict[str, int]:
        """How many of each kind, those that are not listed too, by the kinds' names."""
        kinds: Counter[str] = Counter()
        for (kind, _, _), count in self._counts.items():
            kinds[str(kind)] += count
        return dict(sorted(kinds.items()))

    def summary(self) -> str:
        """One line: how many of each kind."""
        if not self._counts:
            return "no findings"
        parts = ", ".join(f"{n} {kind}" for kind, n in self.kinds().items())
        return f"{len(self)} findings: {parts}"

    def as_dict(self) -> dict[str, Any]:
        """The whole report, ready for ``json.dumps``."""
        return {
            "format": "hdrusd-report/1",
            "summary": self.summary(),
            "findings": [finding.as_dict() for finding in self],
        }
