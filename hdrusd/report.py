"""What a run lost, guessed, clamped or assumed: nothing is dropped silently."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from hdrusd.errors import SourceRef


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


@dataclass(slots=True)
class Report:
    """The findings of one run, in order, each said once."""

    findings: list[Finding] = field(default_factory=list)
    _seen: set[Finding] = field(default_factory=set, repr=False)

    def add(self, kind: Kind, code: str, source: SourceRef, thing: str, text: str) -> None:
        """Note a finding; the same one twice is kept once."""
        finding = Finding(kind, code, source, thing, text)
        if finding not in self._seen:
            self._seen.add(finding)
            self.findings.append(finding)

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __len__(self) -> int:
        return len(self.findings)

    def codes(self) -> set[str]:
        """The distinct codes, for tests and ``--strict`` decisions."""
        return {finding.code for finding in self.findings}

    def summary(self) -> str:
        """One line: how many of each kind."""
        counts = Counter(str(finding.kind) for finding in self.findings)
        if not counts:
            return "no findings"
        parts = ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items()))
        return f"{len(self.findings)} findings: {parts}"

    def as_dict(self) -> dict[str, Any]:
        """The whole report, ready for ``json.dumps``."""
        return {
            "format": "hdrusd-report/1",
            "summary": self.summary(),
            "findings": [finding.as_dict() for finding in self.findings],
        }

    def to_json(self) -> str:
        """``as_dict`` as text."""
        return json.dumps(self.as_dict(), indent=1)
