"""What a conversion is asked, and what it answers: ``Options`` and ``Result``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hdrusd.account.fix import Scene
from hdrusd.account.fix_first import fix_first
from hdrusd.account.totals import totals
from hdrusd.importers.importer import Limits
from hdrusd.photometry.estimate import DEFAULT_RULE
from hdrusd.photometry.sidecar import Sidecar, Unmatched
from hdrusd.report import Report


@dataclass(frozen=True, slots=True)
class Options:
    """How to convert. ``gamma`` None: the photometry file's, else 2.2."""

    photometry: Path | None = None
    shared: bool = False  # the photometry file: a pattern of it may be meant for another source
    estimate: str = DEFAULT_RULE
    gamma: float | None = None
    meters_per_unit: float = 1.0
    source_unit: float | None = None  # metres a source unit; None: what the format says
    up: str | None = None  # "Y" or "Z"; None: what the format says
    roots: Sequence[Path] = ()
    search: Sequence[Path] = ()
    limits: Limits = field(default_factory=Limits)


@dataclass(slots=True)
class Result:
    """What was written, and the account of it."""

    output: Path
    report: Report
    counts: dict[str, int]
    lights: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    textures: dict[str, dict[str, object]] = field(default_factory=dict)
    images: list[dict[str, Any]] = field(default_factory=list)
    diagonal: float = 0.0  # m, of the whole scene
    ground: float = 0.0  # m2 below its bounding box
    unit_stated: bool = False  # by whoever asked for the conversion
    source: Path | None = None
    unmatched: list[Unmatched] = field(default_factory=list)
    parts: set[Path] = field(default_factory=set)  # the files that it is made of, real paths

    def note_unmatched(self, sidecar: Sidecar, options: Options) -> None:
        """What of the photometry file fits nothing: for the report, or for whoever shares it."""
        self.unmatched = sidecar.unmatched()
        for pattern in () if options.shared else self.unmatched:
            pattern.note(self.report)

    def as_dict(self) -> dict[str, Any]:
        """JSON form: docs/report.md."""
        document = self.report.as_dict()
        scene = Scene(
            self.lights,
            self.materials,
            self.images,
            document["findings"],
            self.ground,
            self.diagonal,
            self.unit_stated,
            self.source.stem if self.source else "",
        )
        named = {file: {"image": row["name"]} for row in self.images for file in row["files"]}
        return document | {
            "output": str(self.output),
            "counts": self.counts,
            "totals": totals(self.lights, self.materials, self.images, self.report.kinds()),
            "fix_first": fix_first(scene),
            "lights": self.lights,
            "materials": self.materials,
            "images": self.images,
            "textures": {file: made | named.get(file, {}) for file, made in self.textures.items()},
        }
