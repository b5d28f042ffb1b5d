"""The face lists of a COLLADA mesh as corners: which row of each input a corner uses.

COLLADA 1.4.1, chapter 5: triangles, polylist, polygons, tristrips, trifans.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.importers.collada_document import Document
from hdrusd.importers.collada_xml import Element
from hdrusd.report import Kind

Longs = npt.NDArray[np.int64]

FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
LINES = ("lines", "linestrips")

#: No exporter interleaves more inputs; a hostile offset would make rows of any width.
MOST_INPUTS = 64


@dataclass(frozen=True, slots=True)
class Input:
    """``<input>``: what it means, the element it reads, its column in ``p`` and its set."""

    semantic: str
    source: Element
    offset: int
    number: int


@dataclass(slots=True)
class Faces:
    """Faces of one primitive: (f,) corner counts, (corners, columns) row numbers."""

    counts: Longs
    corners: Longs

    def keep(self, good: npt.NDArray[np.bool_]) -> Faces:
        """Only the faces that are ``good``, (f,)."""
        if good.all():
            return self
        return Faces(self.counts[good], self.corners[np.repeat(good, self.counts)])


def read_inputs(document: Document, primitive: Element) -> list[Input]:
    """The inputs of a primitive whose source is there, in the file's order."""
    inputs = []
    for item in primitive.all("input"):
        wanted = "vertices" if item.get("semantic") == "VERTEX" else "source"
        source = document.resolve(item, "source", wanted)
        offset, number = item.get("offset") or item.get("idx") or "0", item.get("set") or "0"
        if source is None:
            continue
        if not (offset.isdecimal() and len(offset) < 4 and int(offset) < MOST_INPUTS):
            text = f"offset {offset[:20]!r}; want a whole number below {MOST_INPUTS}; not used"
            document.note(Kind.INVALID, "collada-number", item, item.get("semantic"), text)
            continue
        short = number.isdecimal() and len(number) < 10
        inputs.append(Input(item.get("semantic"), source, int(offset), int(number) if short else 0))
    return inputs


def read_faces(document: Document, primitive: Element, thing: str) -> Faces:
    """The faces of a primitive; those that do not come out even are dropped with a finding.

    Raises InputError where there is none.
    """
    columns = 1 + max(
        (int(word) for word in map(_offset, primitive.all("input")) if word.isdecimal()), default=0
    )
    if columns > MOST_INPUTS:
        raise document.error(primitive, f"{columns} columns of indices; want {MOST_INPUTS} at most")
    if primitive.tag == "polylist":
        faces = _polylist(document, primitive, columns, thing)
    elif primitive.tag == "triangles":
        rows = _rows(document, primitive, list(primitive.all("p")), columns, thing)
        if rest := len(rows) % 3:
            text = f"{len(rows)} corners are no whole triangles; the last {rest} dropped"
            document.note(Kind.INVALID, "collada-faces", primitive, thing, text)
        whole = len(rows) // 3
        faces = Faces(np.full(whole, 3), rows[: whole * 3])
    else:
        faces = _by_element(document, primitive, columns, thing)
    declared = primitive.get("count")
    if primitive.tag in ("triangles", "polylist") and declared != str(len(faces.counts)):
        text = f"counts {declared[:20] or 'no'} faces and has {len(faces.counts)}; those are used"
        document.note(Kind.INVALID, "collada-count", primitive, thing, text)
    small = faces.counts < 3
    if small.any():
        text = f"{int(small.sum())} faces of fewer than three corners dropped"
        document.note(Kind.INVALID, "collada-faces", primitive, thing, text)
        faces = faces.keep(~small)
    if not len(faces.counts):
        raise document.error(primitive, f"{primitive.tag} without a face that can be used")
    return faces


def _offset(item: Element) -> str:
    word = item.get("offset") or item.get("idx") or "0"
    return word if len(word) < 4 else "0"


def _rows(
    document: Document, primitive: Element, lists: list[Element], columns: int, thing: str
) -> Longs:
    """(corners, columns) of all ``p`` together."""
    parts = [document.indices(item) for item in lists]
    values = np.concatenate(parts) if parts else np.empty(0, np.int64)
    if rest := len(values) % columns:
        text = f"{len(values)} indices for {columns} inputs a corner; the last {rest} dropped"
        document.note(Kind.INVALID, "collada-faces", primitive, thing, text)
    return values[: len(values) - rest].reshape(-1, columns)


def _polylist(document: Document, primitive: Element, columns: int, thing: str) -> Faces:
    rows = _rows(document, primitive, list(primitive.all("p")), columns, thing)
    place = primitive.child("vcount")
    if place is None:
        raise document.error(primitive, "polylist without vcount")
    counts = document.indices(place)
    ends = np.cumsum(np.clip(counts, 0, len(rows) + 1).astype(np.float64))  # cannot overflow
    used = int(np.searchsorted(ends, float(len(rows)), side="right"))
    used = min(used, int(np.argmax(counts < 0)) if (counts < 0).any() else used)
    corners = int(ends[used - 1]) if used else 0
    if used != len(counts) or corners != len(rows):
        text = (
            f"vcount asks for {len(counts)} faces; {used} are there, "
            f"{len(rows) - corners} corners dropped"
        )
        document.note(Kind.INVALID, "collada-faces", primitive, thing, text)
    return Faces(counts[:used], rows[:corners])


def _by_element(document: Document, primitive: Element, columns: int, thing: str) -> Faces:
    """polygons, tristrips and trifans: a ``p`` for each face or strip."""
    lists = list(primitive.all("p"))
    holed = list(primitive.all("ph"))
    if holed:
        text = f"holes of {len(holed)} polygons are filled"
        document.note(Kind.REPLACED, "collada-holes", primitive, thing, text)
        lists += [item for ph in holed for item in ph.all("p")]
    parts = [document.indices(item) for item in lists]
    sizes = np.array([len(part) for part in parts], np.int64)
    if (sizes % columns).any():
        text = f"{int((sizes % columns > 0).sum())} lists of indices do not come out even; dropped"
        document.note(Kind.INVALID, "collada-faces", primitive, thing, text)
        parts = [part for part in parts if len(part) % columns == 0]
        sizes = np.array([len(part) for part in parts], np.int64)
    rows = (np.concatenate(parts) if parts else np.empty(0, np.int64)).reshape(-1, columns)
    counts = sizes // columns
    if primitive.tag == "polygons":
        return Faces(counts, rows)
    triangles = np.maximum(counts - 2, 0)
    first = np.repeat(np.cumsum(counts) - counts, triangles)  # the first corner of the strip
    before = np.repeat(np.cumsum(triangles) - triangles, triangles)
    step = np.arange(len(first)) - before
    at = first + step
    if primitive.tag == "trifans":
        order = np.stack([first, at + 1, at + 2], axis=1)
    else:  # every second triangle of a strip winds the other way
        odd = step % 2
        order = np.stack([at, at + 1 + odd, at + 2 - odd], axis=1)
    return Faces(np.full(len(first), 3), rows[order.reshape(-1)])
