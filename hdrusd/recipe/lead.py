"""One thing that speaks for a lamp, as the photometry file's text has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hdrusd.photometry.lamp_classes import LampClass


@dataclass(slots=True)
class Lead:
    """One suspicion: ``section`` of the photometry file, the pattern that fits what is meant.

    ``found``: what kind of evidence; ``certain``: it is a lamp, whatever its strength.
    """

    section: Literal["light", "material", "lamp"]
    pattern: str  # "": no pattern fits it alone
    found: str
    reason: str
    kind: LampClass | None
    certain: bool
    count: int = 1
    strength: tuple[float, ...] = ()  # of the lights: their luminance in the source, least first
    offset: tuple[float, ...] | None = None  # of a lamp in its node's space, source units
    at: tuple[tuple[float, ...], ...] = ()  # or where lamps are, of nodes that no pattern tells
    twin: bool = False  # light points that stand where other lights do
    where: str = "the top of it; want the middle of the lamp"  # what ``offset`` or ``at`` is

    @property
    def counts(self) -> bool:
        """Whether it becomes an entry that counts: without a number it would say dark."""
        return self.certain and self.kind is not None and not self.twin and bool(self.pattern)
