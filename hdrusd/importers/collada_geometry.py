"""Geometries of COLLADA as prototypes: arrays once, materials for each instance.

COLLADA 1.4.1, chapter 5, ``geometry`` and ``mesh``. Primitives that read the same inputs become
one ``Mesh`` with a subset for each material symbol, so a geometry is mostly one mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.collada_document import LARGEST, Document, Doubles, extras, named
from hdrusd.importers.collada_primitives import (
    FACES,
    LINES,
    Faces,
    Input,
    Longs,
    read_faces,
    read_inputs,
)
from hdrusd.importers.collada_sources import Sources
from hdrusd.importers.collada_xml import Element
from hdrusd.legacy.scene import Floats, Interpolation, Mesh
from hdrusd.report import Kind

Flags = npt.NDArray[np.bool_]


class _LimitError(InputError):
    """More than the limits allow: that ends the reading, not just the primitive."""


@dataclass(frozen=True, slots=True)
class Prototype:
    """A mesh without materials: ``symbols`` has for each face the number of its symbol.

    ``sets``: the numbers of the file's texture coordinate sets, in the order of st, st1, ...
    """

    mesh: Mesh
    names: tuple[str, ...]
    symbols: npt.NDArray[np.int32]
    sets: tuple[int, ...]
    used: Longs  # (n,) the rows of the file's positions that the mesh's points are


@dataclass(slots=True)
class _Group:
    """Primitives with the same inputs."""

    inputs: list[Input]
    columns: int
    faces: list[Faces] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    place: Element | None = None


class GeometryReader:
    """Reads geometries when they are first used; each once."""

    def __init__(self, document: Document, sources: Sources) -> None:
        self._document = document
        self._sources = sources
        self._known: dict[int, tuple[Prototype, ...]] = {}
        self._corners = 0

    def read(self, geometry: Element) -> tuple[Prototype, ...]:
        """The prototypes of a geometry; none, with a finding, where it has no faces."""
        if id(geometry) not in self._known:
            self._known[id(geometry)] = self._read(geometry)
        return self._known[id(geometry)]

    def _read(self, geometry: Element) -> tuple[Prototype, ...]:
        document = self._document
        name = named(geometry, "geometry")
        mesh = geometry.child("mesh", "convex_mesh")
        if mesh is None or mesh.tag != "mesh":
            kinds = ", ".join(sorted({child.tag for child in geometry.children})) or "nothing"
            text = f"geometry of {kinds}; want a mesh; dropped"
            document.note(Kind.DROPPED, "collada-geometry", geometry, name, text)
            return ()
        groups: dict[Any, _Group] = {}
        for child in mesh.children:
            if child.tag in LINES:
                text = f"{child.tag} dropped; want faces"
                document.note(Kind.DROPPED, "primitive-mode", child, name, text)
            elif child.tag in FACES:
                self._add(groups, child, name)
            elif child.tag not in ("source", "vertices", "extra"):
                text = f"{child.tag[:40]} in a mesh is not read"
                document.note(Kind.DROPPED, "collada-element", child, name, text)
        made = []
        for number, group in enumerate(groups.values()):
            label = name if len(groups) == 1 else f"{name}_{number}"
            try:
                made.append(self._prototype(geometry, group, label))
            except InputError as error:
                self._keep_going(error, name)
        return tuple(made)

    def _keep_going(self, error: InputError, name: str) -> None:
        if isinstance(error, _LimitError):
            raise error
        text = f"{error.problem}; primitive dropped"
        self._document.report.add(Kind.INVALID, "primitive-dropped", error.source, name, text)

    def _add(self, groups: dict[Any, _Group], primitive: Element, name: str) -> None:
        try:
            faces = read_faces(self._document, primitive, name)
        except InputError as error:
            self._keep_going(error, name)
            return
        self._corners += len(faces.corners)
        limit = 6 * self._document.limits.vertices  # a closed surface has 6 corners a vertex
        if self._corners > limit:
            where = self._document.ref(primitive)
            raise _LimitError(where, f"more than {limit} corners of faces up to here")
        inputs = read_inputs(self._document, primitive)
        columns = faces.corners.shape[1]
        key = columns, *((i.semantic, id(i.source), i.offset, i.number) for i in inputs)
        group = groups.setdefault(key, _Group(inputs, columns))
        group.place = group.place or primitive
        group.faces.append(faces)
        group.names.append(primitive.get("material"))

    def _prototype(self, geometry: Element, group: _Group, name: str) -> Prototype:
        document, place = self._document, group.place or geometry
        vertex = next((i for i in group.inputs if i.semantic == "VERTEX"), None)
        if vertex is None:
            raise document.error(place, "no usable input VERTEX")
        shared = [
            Input(i.semantic, i.source, vertex.offset, i.number)
            for i in read_inputs(document, vertex.source)
        ]
        position = next((i for i in shared if i.semantic == "POSITION"), None)
        if position is None:
            raise document.error(place, "vertices without a usable POSITION")
        points = _three(self._sources.table(position.source))
        if points is None:
            raise document.error(position.source, "positions of fewer than three numbers")
        names = tuple(dict.fromkeys(group.names))
        symbols = np.concatenate(
            [
                np.full(len(f.counts), names.index(n), np.int32)
                for f, n in zip(group.faces, group.names, strict=True)
            ]
        )
        faces = Faces(
            np.concatenate([f.counts for f in group.faces]),
            np.concatenate([f.corners for f in group.faces]),
        )
        good = self._good_faces(place, name, faces, points, vertex.offset)
        faces, symbols = faces.keep(good), symbols[good]
        rest = [i for i in group.inputs if i is not vertex] + [
            i for i in shared if i is not position
        ]
        numbers = faces.corners[:, vertex.offset]
        mask = np.zeros(len(points), bool)
        mask[numbers] = True
        used = np.flatnonzero(mask)
        compact = (np.cumsum(mask, dtype=np.int32) - np.int32(1))[numbers]
        attribute = _Attributes(document, self._sources, place, name, faces.corners, used)
        normals = attribute.read([i for i in rest if i.semantic == "NORMAL"][:1], 3, 3)
        if normals is not None:
            normals = self._mended(place, name, normals, points, numbers, compact, faces.counts)
        coordinates = sorted((i for i in rest if i.semantic == "TEXCOORD"), key=lambda i: i.number)
        sets = {i.number: i for i in reversed(coordinates)}
        uvs = {}
        kept: list[int] = []
        for number in sorted(sets):
            found = attribute.read([sets[number]], 2, 2)
            if found is not None:
                uvs["st" if not kept else f"st{len(kept)}"] = found
                kept.append(number)
        colours = [i for i in rest if i.semantic == "COLOR"]
        colors = attribute.read(sorted(colours, key=lambda i: i.number)[:1], 3, 4)
        self._note_lost(place, name, rest, colours)
        mesh = Mesh(
            name=name,
            source=document.ref(geometry),
            points=points[used].astype(np.float32),
            face_counts=faces.counts.astype(np.int32),
            face_indices=compact,
            normals=None if normals is None else normals[0],
            normals_interpolation="vertex" if normals is None else normals[1],
            uvs=uvs,
            colors=None if colors is None else colors[0],
            colors_interpolation="vertex" if colors is None else colors[1],
            two_sided=_two_sided(document, geometry),
        )
        return Prototype(mesh, names, symbols, tuple(kept), used)

    def _good_faces(
        self, place: Element, name: str, faces: Faces, points: Doubles, offset: int
    ) -> Flags:
        """(f,) which faces have points that are there and finite. Raises InputError for none."""
        numbers = faces.corners[:, offset]
        there = (numbers >= 0) & (numbers < len(points))
        finite: Flags = np.all(np.abs(points) <= LARGEST, axis=1)  # a NaN compares false
        if there.all() and finite.all():
            return np.ones(len(faces.counts), np.bool_)
        whole = there.copy()
        whole[there] = finite[numbers[there]]
        starts = np.cumsum(faces.counts) - faces.counts
        good: Flags = np.logical_and.reduceat(whole, starts)
        if not good.all():
            lost = int((~good).sum())
            text = f"{lost} of {len(good)} faces use points that are not there or not finite"
            self._document.note(Kind.INVALID, "face-point", place, name, f"{text}; dropped")
        if not good.any():
            raise self._document.error(place, f"none of {len(good)} faces can be used")
        return good

    def _mended(
        self,
        place: Element,
        name: str,
        normals: tuple[Floats, Interpolation],
        points: Doubles,
        numbers: Longs,
        compact: npt.NDArray[np.int32],
        counts: Longs,
    ) -> tuple[Floats, Interpolation]:
        """Normals of length 0 get that of their face, then at each corner.

        numbers: (c,) the rows of ``points`` at the corners; compact: those of normals for each
        point.
        """
        values, interpolation = normals
        none = values == 0.0
        bad: Flags = none[:, 0] & none[:, 1] & none[:, 2]
        if not bad.any():
            return normals
        text = f"{int(bad.sum())} of {len(bad)} normals are missing, 0 or not finite"
        self._document.note(
            Kind.REPLACED, "mesh-normals", place, name, f"{text}; the face's own is used"
        )
        if interpolation == "vertex":
            values, bad = values[compact], bad[compact]
        facing = np.repeat(face_normals(points[numbers], counts), counts, axis=0)
        return np.where(bad[:, None], facing, values).astype(np.float32), "faceVarying"

    def _note_lost(
        self, place: Element, name: str, rest: Sequence[Input], colours: Sequence[Input]
    ) -> None:
        lost = sorted({i.semantic for i in rest} - {"NORMAL", "TEXCOORD", "COLOR"})
        if len(colours) > 1:
            lost.append("colours beyond the first set")
        if lost:
            text = f"{', '.join(word[:40] for word in lost[:20])} dropped: no home"
            self._document.note(Kind.DROPPED, "mesh-attribute", place, name, text)


@dataclass(frozen=True, slots=True)
class _Attributes:
    """Reads what stands at the corners of one group. ``used``: (n,) the points that stay."""

    document: Document
    sources: Sources
    place: Element
    name: str
    corners: Longs
    used: Longs

    def read(
        self, inputs: list[Input], least: int, width: int
    ) -> tuple[Floats, Interpolation] | None:
        """The values of the first of ``inputs``, filled with 1 up to ``width``.

        For each point where the input shares the points' numbers in number and column, else
        for each corner. None, with a finding, where they cannot be used.
        """
        if not inputs:
            return None
        given = inputs[0]
        try:
            table = self.sources.table(given.source)
        except InputError as error:
            self._dropped(given, error.problem)
            return None
        if table.shape[1] < least:
            self._dropped(given, f"{table.shape[1]} numbers a row; want {least}")
            return None
        depth = table[:, 2:] if given.semantic == "TEXCOORD" else table[:, :0]
        if np.nan_to_num(depth).any():
            text = "third texture coordinate dropped"
            self.document.note(Kind.DROPPED, "texcoord-depth", self.place, self.name, text)
        rows = self.corners[:, given.offset]
        vertex = self._is_vertex(given)
        if vertex:
            rows = self.used
        where: Interpolation = "vertex" if vertex else "faceVarying"
        sound = table.shape[1] >= width and bool((np.abs(table[:, :width]) <= LARGEST).all())
        if sound and len(rows) and rows.min() >= 0 and rows.max() < len(table):
            return table[:, :width].astype(np.float32).take(rows, axis=0), where
        bad = (rows < 0) | (rows >= len(table))
        if bad.all():
            self._dropped(given, f"no index within its {len(table)} rows")
            return None
        values = np.ones((len(rows), width), np.float32)
        taken = table[np.where(bad, 0, rows), :width]
        broken: Flags = bad | ~np.all(np.abs(taken) <= LARGEST, axis=1)
        values[:, : taken.shape[1]] = np.where(broken[:, None], 0.0, taken)
        if broken.any() and given.semantic != "NORMAL":  # those are mended from the faces
            text = f"{given.semantic}: {int(broken.sum())} of {len(rows)} are missing or not finite"
            self.document.note(
                Kind.INVALID, "attribute-not-finite", self.place, self.name, f"{text}; 0 is used"
            )
        return values, where

    def _is_vertex(self, given: Input) -> bool:
        """Whether the input is read by the points' own numbers."""
        offsets = [
            int(item.get("offset") or "0")
            for item in self.place.all("input")
            if item.get("semantic") == "VERTEX" and (item.get("offset") or "0").isdecimal()
        ]
        return offsets[:1] == [given.offset]

    def _dropped(self, given: Input, why: str) -> None:
        text = f"{given.semantic[:40]}: {why}; dropped"
        self.document.note(Kind.INVALID, "attribute-dropped", self.place, self.name, text)


def face_normals(points: Doubles, counts: Longs) -> Doubles:
    """(f, 3) unit normals of polygons by Newell's sum; +Z for those without area.

    points: (c, 3) of the corners, face by face; counts: (f,) corners of each.
    """
    starts = np.cumsum(counts) - counts
    following = np.arange(1, len(points) + 1)
    following[starts + counts - 1] = starts
    first = np.repeat(points[starts], counts, axis=0)  # near the origin nothing cancels
    crossed = np.cross(points - first, points[following] - first)
    sums = np.add.reduceat(crossed, starts, axis=0)
    largest = np.abs(sums).max(axis=1, keepdims=True)
    sums = np.where(largest > 0.0, sums / np.where(largest > 0.0, largest, 1.0), (0.0, 0.0, 1.0))
    unit: Doubles = sums / np.sqrt((sums * sums).sum(axis=1, keepdims=True))
    return unit


def _three(table: Doubles) -> Doubles | None:
    return table[:, :3] if table.shape[1] >= 3 else None


def _two_sided(document: Document, geometry: Element) -> bool:
    """Both sides are seen unless an exporter says otherwise; the format has no culling."""
    stated = extras(geometry).get("double_sided")
    return stated is None or document.value(stated, 1.0) != 0.0
