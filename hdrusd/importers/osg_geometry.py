"""An OpenSceneGraph Geometry as a mesh without material.

How bindings become interpolations: PER_VERTEX is "vertex", or "faceVarying"
where the deprecated index arrays give an attribute its own numbering; OVERALL is
"constant"; PER_PRIMITIVE and PER_PRIMITIVE_SET are spread over the faces,
"uniform". An array without a binding is taken as PER_VERTEX when it has a value
for each vertex and as OVERALL when it has one value.
"""

from __future__ import annotations

import numpy as np

from hdrusd.importers.osg_arrays import ArrayReader, VertexArray
from hdrusd.importers.osg_primitives import Bools, Polygons, PrimitiveReader
from hdrusd.importers.osg_text import Document, Doubles, Integers, Singles, Statement
from hdrusd.legacy.scene import Floats, Interpolation, Mesh
from hdrusd.report import Kind

#: Where float32 cannot hold a coordinate this well, in source units, it is said.
_PRECISION = 1e-3
#: And up to here it always can: it rounds a number by at most its 2^-24th part.
_PRECISE = _PRECISION * 2.0**23
#: Vertex attributes that have no home, by the names of their fields through the versions.
_UNUSED = tuple(
    (f"{stem}array", f"{stem}arraylist", f"{stem}data")
    for stem in ("secondarycolor", "fogcoord", "vertexattrib")
)


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
        points, finite = self._points(vertices, name)
        indices = vertices.indices
        polygons = self.primitives.read(geometry, len(points) if indices is None else len(indices))
        corners = polygons.elements if indices is None else indices[polygons.elements]
        if indices is not None or not finite:
            keep = polygons.where(_finite(points, corners))
            if not keep.all():
                corners = corners[np.repeat(keep, polygons.counts)]
                polygons = polygons.keep(keep)
                text = f"{int((~keep).sum())} faces without a finite position; left out"
                document.add(Kind.INVALID, "osg-vertex", geometry, name, text)
        if not len(polygons.counts):
            document.add(Kind.DROPPED, "osg-no-faces", geometry, name, "no faces; left out")
            return None
        attributes = _Attributes(document, name, vertices, polygons)
        normals = attributes.read("normals", self.arrays.array(geometry, "Normal"), 3)
        colors = attributes.read("colours", self.arrays.array(geometry, "Color"), 4)
        uvs = {}
        for unit, coordinates in self.arrays.texture_coordinates(geometry).items():
            found = attributes.read(f"texture coordinates {unit}", coordinates, 2)
            if found is not None:
                uvs[uv_set(unit)] = found
        for keys in _UNUSED:
            unused = document.field(geometry, *keys)
            if unused is not None:
                text = f"{unused.words[0]}: dropped"
                document.add(Kind.DROPPED, "osg-vertex-attribute", unused, name, text)
        return Mesh(
            name,
            document.ref(geometry),
            points if finite else np.where(np.isfinite(points), points, np.float32(0.0)),
            polygons.counts.astype(np.int32),
            corners.astype(np.int32),
            normals=None if normals is None else normals[0],
            normals_interpolation="vertex" if normals is None else normals[1],
            uvs=uvs,
            colors=None if colors is None else colors[0],
            colors_interpolation="vertex" if colors is None else colors[1],
        )

    def _points(self, vertices: VertexArray, name: str) -> tuple[Floats, bool]:
        """The points in 32 bits, and whether all are finite."""
        values = _columns(vertices.values, 3, 0.0)
        points = _single(values)
        if np.maximum.reduce(np.abs(points), axis=None) <= _PRECISE:  # False for NaN
            return points, True
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
        return points, bool(np.isfinite(points).all())


def _finite(points: Floats, corners: Integers) -> Bools:
    """Whether a corner is a point, and a finite one."""
    finite = np.logical_and.reduce(np.isfinite(points), axis=1)
    good = (corners >= 0) & (corners < len(points))
    good[good] = finite[corners[good]]
    return good


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
        self, role: str, attribute: VertexArray | None, width: int
    ) -> tuple[Floats, Interpolation] | None:
        """Values (., width) float32 and their interpolation; None, with a finding, if unusable."""
        if attribute is None:
            return None
        binding = self._binding(role, attribute)
        values = attribute.values if width == 2 else attribute.normalised()
        if binding in ("OFF", "UNDEFINED"):
            if binding == "UNDEFINED":
                self._drop(attribute, role, f"{len(values)} values and no binding")
            return None
        rows = _single(_columns(values, width, 1.0 if width == 4 else 0.0))
        picked: Integers | slice
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
        if isinstance(picked, slice):
            first, wanted = 0, picked.stop
        else:
            if attribute.indices is not None and interpolation in ("constant", "uniform"):
                picked = _taken(attribute.indices, picked)
            first, wanted = picked.min(initial=0), int(picked.max(initial=-1)) + 1
        if first < 0 or wanted > len(rows):
            self._drop(attribute, role, f"{len(rows)} values; want {wanted}")
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

    def _per_vertex(self, attribute: VertexArray) -> tuple[Integers | slice, Interpolation]:
        own, shared = attribute.indices, self.vertices.indices
        same = own is shared or (
            own is not None and shared is not None and np.array_equal(own, shared)
        )
        if same:  # one numbering for both: a value for each vertex
            extra = len(attribute.values) - len(self.vertices.values)
            if extra > 0:
                text = f"{extra} values more than vertices; those are left out"
                self.document.add(Kind.INVALID, "osg-count", attribute.place, self.name, text)
            return slice(len(self.vertices.values)), "vertex"
        elements = self.polygons.elements
        return elements if own is None else _taken(own, elements), "faceVarying"

    def _drop(self, attribute: VertexArray, role: str, why: str) -> None:
        text = f"{role}: {why}; dropped"
        self.document.add(Kind.INVALID, "osg-attribute", attribute.place, self.name, text)


def _taken(indices: Integers, elements: Integers) -> Integers:
    """``indices[elements]``, and -1 for an element that has no index."""
    inside = (elements >= 0) & (elements < len(indices))
    return np.where(inside, indices[np.where(inside, elements, 0)] if len(indices) else -1, -1)


def _single(values: Singles | Doubles) -> Floats:
    """A copy in 32 bits; infinite where they cannot hold a number."""
    if values.dtype == np.float32:
        return values.astype(np.float32)
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _columns(values: Singles | Doubles, width: int, fill: float) -> Singles | Doubles:
    """Rows of ``width`` numbers: further ones cut, missing ones ``fill``."""
    have = values.shape[1]
    if have == width:
        return values
    if have > width:
        return values[:, :width]
    padded = np.full((len(values), width), fill, values.dtype)
    padded[:, :have] = values
    return padded
