"""Meshes of glTF: each primitive of triangles becomes one ``Mesh``.

glTF 2.0 specification, section 3.7.2. Attributes may have any component type
(KHR_mesh_quantization). Vertices that no face uses are left out: primitives often share
one large set of vertices, and an unused one shows nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.gltf_accessors import Accessors
from hdrusd.importers.gltf_document import Document, Item, one_line
from hdrusd.importers.gltf_images import uv_set_name
from hdrusd.importers.gltf_skins import SETS, SkinReader
from hdrusd.legacy.scene import Floats, Interpolation, Ints, Material, Mesh
from hdrusd.report import Kind

_TRIANGLES, _STRIP, _FAN = range(4, 7)
_OTHER_MODES = {0: "points", 1: "lines", 2: "a line loop", 3: "a line strip"}
_TEXCOORDS = {f"TEXCOORD_{number}" for number in range(16)}
_READ_ATTRIBUTES = {"POSITION", "NORMAL", "COLOR_0"} | _TEXCOORDS
_READ_ATTRIBUTES |= {f"{what}_{number}" for what in ("JOINTS", "WEIGHTS") for number in range(SETS)}

_ONES = np.ones(3, np.float32)

Corners = npt.NDArray[Any]  # (f, 3) whole numbers, dtype as the file has it


class _LimitError(InputError):
    """More than the limits allow: that ends the reading, not just the primitive."""


@dataclass(slots=True)
class _Vertices:
    """The attributes of one primitive, row by row the same vertex."""

    points: Floats
    normals: Floats | None
    uvs: dict[str, Floats]
    colors: Floats | None
    joints: tuple[Ints, Floats] | None = None  # indices and weights

    def take(self, used: npt.NDArray[np.bool_]) -> _Vertices:
        """Only those vertices."""
        return _Vertices(
            self.points[used],
            None if self.normals is None else self.normals[used],
            {name: uv[used] for name, uv in self.uvs.items()},
            None if self.colors is None else self.colors[used],
            None if self.joints is None else (self.joints[0][used], self.joints[1][used]),
        )


class MeshReader:
    """Reads all meshes of a document.

    ``by_mesh[i]`` lists the entries of ``meshes`` that glTF mesh i became; ``errors``
    says why primitives came to nothing. A primitive without a material wears number
    ``default_material``.
    """

    def __init__(
        self,
        document: Document,
        accessors: Accessors,
        materials: list[Material],
        skins: SkinReader,
    ) -> None:
        self._document = document
        self._skins = skins
        self._accessors = accessors
        self._materials = materials
        self.default_material = len(materials)
        self.meshes: list[Mesh] = []
        self.by_mesh: list[list[int]] = []
        self.errors: list[InputError] = []
        self._points = 0
        self._faces = 0
        self._uv_sets: dict[int, set[str]] = {}  # that a material reads
        self._lost: Counter[str] = Counter()
        with np.errstate(over="ignore", under="ignore"):  # of ``_all_finite``
            for number, item in enumerate(document.table("meshes")):
                self.by_mesh.append(self._mesh(item, number, item.name or f"mesh_{number}"))
        for key, count in sorted(self._lost.items()):
            text = f"{one_line(key)} of {count} meshes dropped: no home"
            document.root.note(Kind.DROPPED, "mesh-attribute", text)

    def _mesh(self, item: Item, mesh_number: int, name: str) -> list[int]:
        entries = []
        lost: set[str] = set()
        for number, primitive in enumerate(item.children("primitives")):
            attributes = primitive.child("attributes")
            lost |= attributes.data.keys() - _READ_ATTRIBUTES
            if primitive.data.get("targets"):
                lost.add("morph targets")
            mode = primitive.integer("mode") if "mode" in primitive else _TRIANGLES
            if mode is None or mode not in (_TRIANGLES, _STRIP, _FAN):
                shape = _OTHER_MODES.get(-1 if mode is None else mode, "an unknown mode")
                text = f"{shape} dropped; want triangles"
                primitive.note(Kind.DROPPED, "primitive-mode", text)
                self.errors.append(primitive.error(text))
                continue
            try:
                label = f"{name}_{number}"
                mesh = self._primitive(primitive, attributes, mode, mesh_number, label)
            except _LimitError:
                raise
            except InputError as error:
                self.errors.append(error)
                self._document.keep_going(error, "primitive-dropped", name, "primitive dropped")
                continue
            entries.append(len(self.meshes))
            self.meshes.append(mesh)
        self._lost.update(lost)
        return entries

    def _primitive(
        self, item: Item, attributes: Item, mode: int, mesh_number: int, name: str
    ) -> Mesh:
        position = attributes.index("POSITION", "accessors")
        if position is None:
            raise item.error("primitive without a usable POSITION")
        vertices = self._vertices(item, attributes, position)
        count = len(vertices.points)
        vertices.joints = self._skins.influences(mesh_number, attributes, count, name)
        corners = self._corners(item, mode, len(vertices.points))
        corners = _good_faces(item, corners, vertices.points)
        vertices, indices = _used_only(vertices, corners)
        if vertices.normals is not None:
            vertices.normals = _mended_normals(item, vertices.normals, vertices.points, indices)
        material = item.index("material", "materials")
        if material is None:
            material = self.default_material
            two_sided = False
        else:
            two_sided = self._materials[material].two_sided
            self._check_uv_sets(item, material, vertices.uvs)
        vertex: Interpolation = "vertex"
        counts = np.empty(len(indices) // 3, np.int32)
        counts.fill(3)
        return Mesh(
            name=name,
            source=item.ref,
            points=vertices.points,
            face_counts=counts,
            face_indices=indices,
            normals=vertices.normals,
            uvs={key: (uv, vertex) for key, uv in vertices.uvs.items()},
            colors=vertices.colors,
            material=material,
            two_sided=two_sided,
            joint_indices=None if vertices.joints is None else vertices.joints[0],
            joint_weights=None if vertices.joints is None else vertices.joints[1],
        )

    def _check_budget(self, item: Item) -> None:
        """Shared accessors let a small file name many vertices; their sum is what counts.

        A closed surface of triangles has twice as many faces as vertices (Euler).
        """
        limit = self._document.limits.vertices
        if self._points > limit or self._faces > 2 * limit:
            text = f"more than {limit} vertices or {2 * limit} triangles up to here"
            raise _LimitError(item.ref, text)

    def _vertices(self, item: Item, attributes: Item, position: int) -> _Vertices:
        points = self._accessors.floats(position, 3)
        self._points += len(points)
        self._check_budget(item)
        uvs = {}
        for key in sorted(attributes.data.keys() & _TEXCOORDS):
            uv = self._attribute(attributes, key, len(points), 2)
            if uv is not None:
                flipped = uv.copy()
                np.subtract(_ONES[0], uv[:, 1], out=flipped[:, 1])
                uvs[uv_set_name(int(key.removeprefix("TEXCOORD_")))] = flipped
        return _Vertices(
            points,
            self._attribute(attributes, "NORMAL", len(points), 3),
            uvs,
            self._colors(attributes, len(points)),
        )

    def _attribute(self, attributes: Item, key: str, count: int, *widths: int) -> Floats | None:
        """(count, n) float32, or None where it is missing or, with a finding, broken.

        Numbers that are not finite become 0, but for normals, which are mended later.
        """
        index = attributes.index(key, "accessors")
        if index is None:
            return None
        try:
            values = self._accessors.floats(index, *widths)
            if len(values) != count:
                raise attributes.error(f"{key} has {len(values)} elements, POSITION {count}")
        except InputError as error:
            self._document.keep_going(error, "attribute-dropped", key, "dropped")
            return None
        if key == "NORMAL":
            return values
        if _all_finite(values):
            return values
        finite = np.isfinite(values)
        text = f"{key}: {int((~finite).any(axis=1).sum())} elements are not finite; 0 is used"
        attributes.note(Kind.INVALID, "attribute-not-finite", text)
        return np.where(finite, values, np.float32(0.0))

    def _colors(self, attributes: Item, count: int) -> Floats | None:
        colors = self._attribute(attributes, "COLOR_0", count, 3, 4)
        if colors is None or colors.shape[1] == 4:
            return colors
        opaque = np.ones((count, 4), np.float32)
        opaque[:, :3] = colors
        return opaque

    def _corners(self, item: Item, mode: int, points: int) -> Corners:
        """The triangles as (f, 3) vertex numbers, not yet held against ``points``."""
        if "indices" in item:
            index = item.index("indices", "accessors")
            if index is None:
                raise item.error("no usable indices")
            order = self._accessors.integers(index)
        else:
            order = np.arange(points, dtype=np.uint32)
        self._faces += len(order) // 3 if mode == _TRIANGLES else len(order)
        self._check_budget(item)
        if mode != _TRIANGLES:
            return _strip(order) if mode == _STRIP else _fan(order)
        if rest := len(order) % 3:
            text = f"{len(order)} vertex numbers are no whole triangles; the last {rest} dropped"
            item.note(Kind.INVALID, "mesh-indices", text)
        return order[: len(order) - rest].reshape(-1, 3)

    def _check_uv_sets(self, item: Item, number: int, uvs: dict[str, Floats]) -> None:
        material = self._materials[number]
        used = self._uv_sets.get(number)
        if used is None:
            used = self._uv_sets[number] = {map.uv_set for map in material.maps().values()}
        if used <= uvs.keys():
            return
        for name in sorted(used - uvs.keys()):
            called = one_line(material.name)
            text = f"{called} reads texture coordinates {name}, which the mesh has not"
            item.note(Kind.MISSING, "mesh-uv-set", text)


def _strip(order: npt.NDArray[Any]) -> Corners:
    """Triangle i of a strip is i, i+1, i+2, the last two swapped where i is odd."""
    corners = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    corners[1::2, 1:] = corners[1::2, :0:-1]
    return corners


def _fan(order: npt.NDArray[Any]) -> Corners:
    """Triangle i of a fan is i+1, i+2, 0 (glTF's order, which keeps the provoking vertex)."""
    first = np.broadcast_to(order[:1], len(order[2:]))
    return np.stack([order[1:-1], order[2:], first], axis=1)


def _all_finite(values: Floats) -> bool:
    """Whether all are; a sum of squares that does not overflow says so in half the time."""
    flat = values.reshape(-1)
    return math.isfinite(flat.dot(flat)) or bool(np.isfinite(flat).all())


def _good_faces(item: Item, corners: Corners, points: Floats) -> Corners:
    """Without the faces that use vertices that are not there or not finite. Raises InputError."""
    total = len(corners)
    if total and int(corners.max()) >= len(points):
        corners = corners[np.all(corners < len(points), axis=1)]
        text = (
            f"{total - len(corners)} of {total} triangles use vertex numbers past the "
            f"{len(points)} vertices; dropped"
        )
        item.note(Kind.INVALID, "mesh-indices", text)
    if not _all_finite(points):
        before = len(corners)
        whole: npt.NDArray[np.bool_] = np.all(np.isfinite(points), axis=1)
        corners = corners[whole[corners].all(axis=1)]
        text = f"{before - len(corners)} of {total} triangles have corners that are not finite"
        item.note(Kind.INVALID, "mesh-points", f"{text}; dropped")
    if not len(corners):
        raise item.error(f"none of {total} triangles can be used")
    return corners


def _used_only(vertices: _Vertices, corners: Corners) -> tuple[_Vertices, Ints]:
    """The vertices that the faces use, and the faces' numbers among those."""
    used = np.zeros(len(vertices.points), bool)
    flat = corners.reshape(-1)
    used[flat.astype(np.intp)] = True
    if np.count_nonzero(used) == len(used):
        if flat.dtype == np.uint32:  # the numbers are below that of the vertices: no copy
            return vertices, np.ascontiguousarray(flat).view(np.int32)
        return vertices, flat.astype(np.int32)
    numbers = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return vertices.take(used), numbers[flat]


def _mended_normals(item: Item, normals: Floats, points: Floats, indices: Ints) -> Floats:
    """Normals that are zero or not finite get the direction of the faces around them."""
    lengths = np.abs(normals).dot(_ONES)  # a product in a third of the time of any(axis=1)
    if np.count_nonzero(lengths) == len(lengths) and _all_finite(lengths):
        return normals
    bad = (lengths == 0.0) | ~np.isfinite(normals).all(axis=1)
    if not bad.any():
        return normals
    corners = indices.reshape(-1, 3)
    corners = corners[bad[corners].any(axis=1)]
    a, b, c = (points[corners[:, k]].astype(np.float64) for k in range(3))
    facing = np.cross(b - a, c - a)  # twice the area long, so large faces weigh more
    sums = np.zeros((len(points), 3))
    for k in range(3):
        sums[:, k] = np.bincount(
            corners.reshape(-1), np.repeat(facing[:, k], 3), minlength=len(points)
        )
    sums[~sums.any(axis=1)] = (0.0, 0.0, 1.0)  # faces without area: any direction does
    directions = sums[bad]
    mended = normals.copy()
    mended[bad] = directions / np.sqrt((directions**2).sum(axis=1, keepdims=True))
    text = f"{int(bad.sum())} normals are zero or not finite; taken from the faces around them"
    item.note(Kind.REPLACED, "mesh-normals", text)
    return mended
