"""An OpenSceneGraph Geometry as a mesh without material.

How bindings become interpolations: PER_VERTEX is "vertex", or "faceVarying"
where the deprecated index arrays give an attribute its own numbering; OVERALL is
"constant"; PER_PRIMITIVE and PER_PRIMITIVE_SET are spread over the faces,
"uniform". An array without a binding is taken as PER_VERTEX when it has a value
for each vertex and as OVERALL when it has one value.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hdrusd.importers.osg_arrays import ArrayReader, Integers, VertexArray
from hdrusd.importers.osg_primitives import Polygons, PrimitiveReader
from hdrusd.importers.osg_text import Document, Doubles, Statement
from hdrusd.legacy.scene import Floats, Interpolation, Mesh
from hdrusd.report import Kind

#: Where float32 cannot hold a coordinate this well, in source units, it is said.
_PRECISION = 1e-3


def uv_set(unit: int) -> str:
    """The key in ``Mesh.uvs`` of a texture unit: st, st1, st2 and so on."""
    return f"st{unit}" if unit else "st"


class GeometryReader:
    """Reads the Geometry objects of one file, each once."""

    def __init__(self, document: Document, vertex_limit: int) -> None:
        self.document = document
        self.arrays = ArrayReader(document, vertex_limit)
        self.primitives = PrimitiveReader(document, vertex_limit)
        self._read: dict[int, Mesh | None] = {}

    def read(self, geometry: Statement) -> Mesh | None:
        """The mesh, with colours and without material; None, with a finding, if it has no faces."""
        if id(geometry) not in self._read:
            self._read[id(geometry)] = self._mesh(geometry)
        return self._read[id(geometry)]

    def _mesh(self, geometry: Statement) -> Mesh | None:
        document, name = self.document, self.document.name(geometry)
        vertices = self.arrays.array(geometry, "Vertex")
        if vertices is None or not len(vertices.values):
            document.add(Kind.DROPPED, "osg-no-vertices", geometry, name, "no vertices; left out")
            return None
        points = self._points(vertices, name)
        indices = vertices.indices
        polygons = self.primitives.read(geometry, len(points) if indices is None else len(indices))
        corners = polygons.elements if indices is None else indices[polygons.elements]
        finite = np.logical_and.reduce(np.isfinite(points), axis=1)
        good = (corners >= 0) & (corners < len(points))
        if not finite.all():
            good[good] = finite[corners[good]]
        if not good.all():
            first = np.cumsum(polygons.counts) - polygons.counts
            keep = np.logical_and.reduceat(good, first)
            corners = corners[np.repeat(keep, polygons.counts)]
            polygons = polygons.keep(keep)
            text = f"{int((~keep).sum())} faces without a finite position; left out"
            document.add(Kind.INVALID, "osg-vertex", geometry, name, text)
        if not len(polygons.counts):
            document.add(Kind.DROPPED, "osg-no-faces", geometry, name, "no faces; left out")
            return None
        mesh = Mesh(
            name,
            document.ref(geometry),
            points if finite.all() else np.where(np.isfinite(points), points, np.float32(0.0)),
            polygons.counts.astype(np.int32),
            corners.astype(np.int32),
        )
        attributes = _Attributes(document, name, vertices, polygons)
        return self._with_attributes(mesh, geometry, attributes)

    def _with_attributes(self, mesh: Mesh, geometry: Statement, reader: _Attributes) -> Mesh:
        normals = self.arrays.array(geometry, "Normal")
        if normals is not None:
            found = reader.read("normals", normals, 3)
            if found is not None:
                mesh = replace(mesh, normals=found[0], normals_interpolation=found[1])
        colors = self.arrays.array(geometry, "Color")
        if colors is not None:
            found = reader.read("colours", colors, 4)
            if found is not None:
                mesh = replace(mesh, colors=found[0], colors_interpolation=found[1])
        uvs = {}
        for unit, coordinates in self.arrays.texture_coordinates(geometry).items():
            found = reader.read(f"texture coordinates {unit}", coordinates, 2)
            if found is not None:
                uvs[uv_set(unit)] = found
        for stem in ("secondarycolor", "fogcoord", "vertexattrib"):
            keys = f"{stem}array", f"{stem}arraylist", f"{stem}data"
            other = self.document.field(geometry, *keys)
            if other is not None:
                text = f"{other.words[0]}: dropped"
                self.document.add(Kind.DROPPED, "osg-vertex-attribute", other, mesh.name, text)
        return replace(mesh, uvs=uvs)

    def _points(self, vertices: VertexArray, name: str) -> Floats:
        values = _columns(vertices.values, 3, 0.0)
        with np.errstate(over="ignore"):  # infinite in float32: those faces are dropped
            points = values.astype(np.float32)
        with np.errstate(invalid="ignore"):
            lost = np.abs(values - points)
        lost = lost.max(initial=0.0, where=np.isfinite(lost))
        if lost > _PRECISION:
            self.document.add(
                Kind.CLAMPED,
                "osg-precision",
                vertices.place,
                name,
                f"coordinates rounded to 32 bits, by up to {lost:.3g} units",
            )
        return points


class _Attributes:
    """Spreads the arrays of one Geometry over its corners, faces or vertices."""

    def __init__(
        self, document: Document, name: str, vertices: VertexArray, polygons: Polygons
    ) -> None:
        self.document = document
        self.name = name
        self.vertices = vertices
        self.polygons = polygons

    def read(
        self, role: str, attribute: VertexArray, width: int
    ) -> tuple[Floats, Interpolation] | None:
        """Values (., width) float32 and their interpolation; None, with a finding, if unusable."""
        binding = self._binding(role, attribute)
        values = attribute.values if width == 2 else attribute.normalised()
        if binding in ("OFF", "UNDEFINED"):
            if binding == "UNDEFINED":
                self._drop(attribute, role, f"{len(values)} values and no binding")
            return None
        with np.errstate(over="ignore"):
            rows = _columns(values, width, 1.0 if width == 4 else 0.0).astype(np.float32)
        interpolation: Interpolation
        if binding == "OVERALL":
            picked, interpolation = np.zeros(1, dtype=np.int64), "constant"
        elif binding == "PER_VERTEX":
            picked, interpolation = self._per_vertex(attribute)
        elif binding in ("PER_PRIMITIVE", "PER_PRIMITIVE_SET"):
            sets = binding == "PER_PRIMITIVE_SET"
            picked = self.polygons.sets if sets else self.polygons.primitives
            interpolation = "uniform"
        else:
            self._drop(attribute, role, f"binding {binding} is unknown")
            return None
        if attribute.indices is not None and interpolation in ("constant", "uniform"):
            picked = _taken(attribute.indices, picked)
        if len(picked) and (picked.min() < 0 or picked.max() >= len(rows)):
            self._drop(attribute, role, f"{len(rows)} values; want {int(picked.max()) + 1}")
            return None
        rows = rows[picked]
        if not np.isfinite(rows).all():
            self._drop(attribute, role, "not all finite")
            return None
        return rows, interpolation

    def _binding(self, role: str, attribute: VertexArray) -> str:
        if attribute.binding != "UNDEFINED":
            return attribute.binding
        count = len(attribute.values)
        guess = {len(self.vertices.values): "PER_VERTEX", 1: "OVERALL"}.get(count)
        if guess is not None:
            self.document.add(
                Kind.ASSUMED,
                "osg-binding",
                attribute.place,
                self.name,
                f"{role} have no binding; {count} values are taken as {guess}",
            )
        return guess or "UNDEFINED"

    def _per_vertex(self, attribute: VertexArray) -> tuple[Integers, Interpolation]:
        own, shared = attribute.indices, self.vertices.indices
        same = own is shared or (
            own is not None and shared is not None and np.array_equal(own, shared)
        )
        if same:  # one numbering for both: a value for each vertex
            extra = len(attribute.values) - len(self.vertices.values)
            if extra > 0:
                text = f"{extra} values more than vertices; those are left out"
                self.document.add(Kind.INVALID, "osg-count", attribute.place, self.name, text)
            return np.arange(len(self.vertices.values), dtype=np.int64), "vertex"
        elements = self.polygons.elements
        return elements if own is None else _taken(own, elements), "faceVarying"

    def _drop(self, attribute: VertexArray, role: str, why: str) -> None:
        text = f"{role}: {why}; dropped"
        self.document.add(Kind.INVALID, "osg-attribute", attribute.place, self.name, text)


def _taken(indices: Integers, elements: Integers) -> Integers:
    """``indices[elements]``, and -1 for an element that has no index."""
    inside = (elements >= 0) & (elements < len(indices))
    return np.where(inside, indices[np.where(inside, elements, 0)] if len(indices) else -1, -1)


def _columns(values: Doubles, width: int, fill: float) -> npt.NDArray[np.float64]:
    """Rows of ``width`` numbers: further ones cut, missing ones ``fill``."""
    have = values.shape[1]
    if have >= width:
        return values[:, :width]
    return np.pad(values, ((0, 0), (0, width - have)), constant_values=fill)
