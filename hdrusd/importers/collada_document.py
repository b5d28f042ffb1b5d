"""A parsed COLLADA file: ids, unit, up axis, and numbers that are never believed.

Sources: Khronos, COLLADA - Digital Asset Schema Release 1.4.1 (2008) and 1.5.0; the address
syntax of its chapter 3.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.collada_xml import Element
from hdrusd.importers.importer import Limits
from hdrusd.importers.number_text import decimals, wholes
from hdrusd.report import Kind, Report

Doubles = npt.NDArray[np.float64]

#: USD and the GPU hold numbers as float32; a larger one would become infinite there.
LARGEST = float(np.finfo(np.float32).max)
#: An index as a float64 is exact up to here; below it stands every index that can be good.
_INDEX_END = float(np.iinfo(np.int32).max)
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)


@dataclass(slots=True)
class Document:
    """One file. ``ids`` finds an element by its id; the first of a number of like ones."""

    file: Path
    report: Report
    limits: Limits
    root: Element
    generator: str = ""
    unit_m: float = 1.0
    up: str = "Y_UP"
    unit_stated: bool = False
    up_stated: bool = False
    stated: frozenset[str] = frozenset()  # as ``Resolver`` has it
    ids: dict[str, Element] = field(default_factory=dict)
    _commas: bool = False

    def __post_init__(self) -> None:
        for element in self.root.walk():
            name = element.get("id")
            if not name:
                continue
            if name in self.ids:
                text = f"id said a second time, first in line {self.ids[name].line}; that counts"
                self.note(Kind.INVALID, "collada-id", element, name, text)
            else:
                self.ids[name] = element
        asset = self.root.child("asset")
        if asset is None:
            taken = {"unit": "1 unit is 1 m", "up": "Y is up"}
            words = ", ".join(text for key, text in taken.items() if key not in self.stated)
            if words:
                self.note(Kind.ASSUMED, "collada-asset", self.root, "", f"no asset; {words}")
            return
        contributor = asset.child("contributor")
        if contributor is not None:
            self.generator = contributor.words("authoring_tool")
        self._read_unit(asset)
        self.up_stated = bool(asset.words("up_axis"))
        self.up = asset.words("up_axis") or "Y_UP"
        if self.up not in ("X_UP", "Y_UP", "Z_UP"):
            text = f"up_axis {self.up[:40]!r}; want X_UP, Y_UP or Z_UP; Y is up"
            self.note(Kind.INVALID, "collada-asset", asset, "", text)
            self.up, self.up_stated = "Y_UP", False

    def _read_unit(self, asset: Element) -> None:
        unit = asset.child("unit")
        if unit is None or not unit.get("meter"):
            if "unit" not in self.stated:
                text = "no unit; 1 unit is 1 m, the format's default"
                self.note(Kind.ASSUMED, "collada-asset", asset, "", text)
            return
        value = self.numbers(unit, unit.get("meter"))
        if len(value) == 1 and 1e-9 <= value[0] <= 1e9:
            self.unit_m, self.unit_stated = float(value[0]), True
            return
        text = f"unit of {unit.get('meter')[:40]!r} m; 1 m is used"
        self.note(Kind.INVALID, "collada-asset", unit, unit.get("name"), text)

    def ref(self, element: Element) -> SourceRef:
        """Where an element stands."""
        return SourceRef(self.file, element.line)

    def note(self, kind: Kind, code: str, element: Element, thing: str, text: str) -> None:
        """Add a finding about an element."""
        self.report.add(kind, code, self.ref(element), thing, text)

    def error(self, element: Element, problem: str) -> InputError:
        """An error that names an element's line."""
        return InputError(self.ref(element), problem)

    # -- references ------------------------------------------------------------------------

    def resolve(self, element: Element, key: str, *wanted: str) -> Element | None:
        """What an attribute such as ``url="#lamp"`` names; None, with a finding, if nothing.

        ``wanted``: the names of elements that may be meant.
        """
        return self.lookup(element, element.get(key), *wanted)

    def lookup(self, element: Element, address: str, *wanted: str) -> Element | None:
        """As ``resolve``, of an address that stands elsewhere."""
        before, mark, name = address.strip().partition("#")
        what = " or ".join(wanted)
        if mark and before:
            text = f"{address[:200]}: {what} of another file; other files are not read"
            self.note(Kind.DROPPED, "collada-external", element, name, text)
            return None
        name = name if mark else before  # some exporters leave the mark out
        found = self.ids.get(name) or self.ids.get(unquote(name))
        if found is None or found.tag not in wanted:
            why = "not in the file" if found is None else f"is a {found.tag[:40]}"
            text = f"{address[:200]!r}: {why}; want a {what}; not used"
            self.note(Kind.MISSING, "collada-reference", element, name, text)
            return None
        return found

    # -- numbers ---------------------------------------------------------------------------

    def numbers(self, element: Element, text: str | None = None) -> Doubles:
        """All numbers of an element's text; NaN for a word that is none or overflows.

        Decimal commas (French, German exporters) are read as points, with one finding.
        """
        text = element.text if text is None else text
        if "," in text:
            text = self._without_commas(element, text)
        values = decimals(text.encode())
        if values is None:
            words = text.split()
            values = np.array([_number(word) for word in words], np.float64)
            if bad := sum(_NUMBER.fullmatch(word) is None for word in words):
                note = f"{bad} of {len(values)} words of {element.tag[:40]} are no numbers"
                self.note(Kind.INVALID, "collada-number", element, element.get("id"), note)
        if values.size and not np.isfinite(values).all():
            values[np.isinf(values)] = np.nan
        return values

    def _without_commas(self, element: Element, text: str) -> str:
        if "." in text:  # then commas separate
            return text.replace(",", " ")
        if not self._commas:
            self._commas = True
            note = "numbers with a decimal comma; read as a point, here and below"
            self.note(Kind.REPLACED, "decimal-comma", element, "", note)
        return text.replace(",", ".")

    def indices(self, element: Element) -> npt.NDArray[np.int64]:
        """All whole numbers of an element's text; -1 for what cannot be an index."""
        whole = wholes(element.text.encode())
        if whole is not None:
            if whole.size and (whole.min() < 0 or whole.max() > _INDEX_END):
                whole[(whole < 0) | (whole > _INDEX_END)] = -1
            return whole
        values = self.numbers(element)
        bad = ~((values >= 0.0) & (values <= _INDEX_END))  # NaN compares false
        if bad.any():
            values[bad] = -1.0
        return values.astype(np.int64)

    def number(
        self,
        holder: Element,
        tag: str,
        default: float,
        *,
        low: float = -LARGEST,
        high: float = LARGEST,
    ) -> float:
        """The number in the child ``tag``, or in a ``float`` below it, clamped with a finding."""
        place = holder.child(tag)
        if place is None:
            return default
        return self.value(place, default, low=low, high=high)

    def value(
        self, place: Element, default: float, *, low: float = -LARGEST, high: float = LARGEST
    ) -> float:
        """The number of an element itself, or of its ``float`` or ``color``."""
        inner = place.child("float", "color") or place
        values = self.numbers(inner)
        if not len(values) or math.isnan(values[0]):
            text = f"{place.tag} is {inner.text.strip()[:40]!r}; want a number; {default:g} is used"
            self.note(Kind.INVALID, "collada-number", place, "", text)
            return default
        value = float(values[0])
        if low <= value <= high:
            return value
        clamped = min(max(value, low), high)
        text = f"{place.tag} is {value:g}; clamped to {clamped:g}"
        self.note(Kind.CLAMPED, "collada-range", place, "", text)
        return clamped

    def vector(self, place: Element, count: int, least: int | None = None) -> Doubles | None:
        """``count`` finite numbers; fewer, but ``least``, are filled up with 1.

        None, with a finding, where they are not there.
        """
        values = self.numbers(place)[:count]
        enough = len(values) >= (count if least is None else least)
        if not enough or not (np.abs(values) <= LARGEST).all():
            shown = place.text.strip()[:60]
            text = f"{place.tag[:40]} is {shown!r}; want {count} finite numbers; not used"
            self.note(Kind.INVALID, "collada-number", place, place.get("sid"), text)
            return None
        filled = np.ones(count)
        filled[: len(values)] = values
        return filled


def _number(word: str) -> float:
    """A number; of ``0.0.9`` the 0.0 that stands in front, NaN for what begins with none."""
    found = _NUMBER.match(word)
    return float(found.group()) if found else math.nan


def named(element: Element, default: str) -> str:
    """What an element is called: its name, else its id, else ``default``."""
    return element.get("name") or element.get("id") or default


def extras(element: Element) -> dict[str, Element]:
    """The leaves of an element's ``extra`` techniques by name; the first of each name."""
    found: dict[str, Element] = {}
    for extra in element.all("extra"):
        for technique in extra.all("technique"):
            for leaf in technique.walk():
                if leaf is not technique:
                    found.setdefault(leaf.tag, leaf)
    return found
