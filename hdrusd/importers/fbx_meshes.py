"""Meshes of FBX: polygons as they are, with values at corners, and faces by material.

What ufbx calls a vertex is a point here. Its v runs up, as ours does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.importers.fbx_document import LARGEST, Document
from hdrusd.importers.fbx_held import Held
from hdrusd.importers.fbx_skins import Weights
from hdrusd.importers.fbx_textures import uv_key
from hdrusd.legacy.scene import Floats, Interpolation, Mesh, Subset
from hdrusd.report import Kind

_Bools = npt.NDArray[np.bool_]


def set_names(mesh: Held) -> tuple[str, ...]:
    """The names of a mesh's coordinate sets in the order of their numbers."""
    return tuple(found.name for found in sorted(mesh.uv_sets, key=lambda found: int(found.index)))


@dataclass(slots=True)
class MeshReader:
    """Reads meshes into ``meshes``; one is shared by all nodes that have it with one look."""

    document: Document
    two_sided: Sequence[bool]  # of each material
    weights: Weights
    meshes: list[Mesh] = field(default_factory=list)
    _known: dict[tuple[int, tuple[int, ...]], int | None] = field(default_factory=dict)

    def read(self, mesh: Held, materials: tuple[int, ...], name: str) -> int | None:
        """The number of a mesh with these materials; None where it has no face."""
        key = int(mesh.typed_id), materials
        if key not in self._known:
            made = self._read(mesh, materials, name)
            self._known[key] = None if made is None else len(self.meshes)
            if made is not None:
                self.meshes.append(made)
        return self._known[key]

    def _read(self, mesh: Held, materials: tuple[int, ...], name: str) -> Mesh | None:
        document = self.document
        place = document.ref("mesh", name)
        points = mesh.vertices.rows(3)
        corners = mesh.vertex_indices.integers()
        faces = mesh.faces.rows(2, np.int64)
        good = self._good_faces(mesh, points, corners, faces, place)
        if not good.any():
            if len(faces):
                text = f"none of {len(faces)} faces can be used; dropped"
                document.note(Kind.INVALID, "primitive-dropped", place, name, text)
            return None
        where = _corners_of(faces[good])  # of the corners that stay, in order
        counts = faces[good, 1]
        points = np.where(np.abs(points) < LARGEST, points, 0.0).astype(np.float32)
        self._note_lost(mesh, place)
        corner = _Corners(document, where, corners, len(points), place)
        normals = corner.values(mesh.vertex_normal, 3, "normals")
        uvs = {}
        for number, found in enumerate(sorted(mesh.uv_sets, key=lambda s: int(s.index))):
            values = corner.values(found.vertex_uv, 2, f"coordinates {found.name!r}")
            if values is not None:
                uvs[uv_key(number)] = values
        colors = None
        if len(mesh.color_sets):
            colors = corner.values(mesh.color_sets[0].vertex_color, 4, "colours")
        if mesh.generated_normals:
            text = "no normals; made from the smoothing of its faces and edges"
            document.note(Kind.ASSUMED, "fbx-normals", place, name, text)
        material, subsets = self._subsets(mesh, materials, good, place)
        worn = {s.material for s in subsets} | ({material} if material is not None else set())
        joints, weights = self.weights.of(mesh, len(points))
        return Mesh(
            name,
            place,
            points,
            counts.astype(np.int32),
            corners[where].astype(np.int32),
            normals=None if normals is None else normals[0],
            normals_interpolation="vertex" if normals is None else normals[1],
            uvs=uvs,
            colors=None if colors is None else colors[0],
            colors_interpolation="vertex" if colors is None else colors[1],
            material=material,
            subsets=subsets,
            two_sided=not worn or any(self.two_sided[number] for number in worn),
            joint_indices=joints,
            joint_weights=weights,
        )

    def _good_faces(
        self,
        mesh: Held,
        points: npt.NDArray[np.float64],
        corners: npt.NDArray[np.int64],
        faces: npt.NDArray[np.int64],
        place: SourceRef,
    ) -> _Bools:
        """Faces of three corners or more, with indices and places that can be used."""
        good: _Bools = faces[:, 1] >= 3
        holes = mesh.face_hole.rows(1, np.bool_)
        if len(holes) == len(faces):
            good &= ~holes
        short = int((~good).sum())
        if short:
            text = f"{short} faces of one or two corners, or holes in others; dropped"
            self.document.note(Kind.DROPPED, "primitive-mode", place, mesh.name, text)
        good &= (faces[:, 0] >= 0) & (faces.sum(axis=1) <= len(corners))
        usable = (corners >= 0) & (corners < len(points))
        if len(points):
            whole: _Bools = np.all(np.abs(points) < LARGEST, axis=1)  # NaN is not below
            usable &= whole[np.clip(corners, 0, len(points) - 1)]
        # A face is good if none of its corners is bad: differences of a running count.
        bad = np.concatenate([[0], np.cumsum(~usable)])
        begin = np.clip(faces[:, 0], 0, len(corners))
        end = np.clip(faces.sum(axis=1), 0, len(corners))
        before = int(good.sum())
        good &= bad[end] == bad[begin]
        if int(good.sum()) < before:
            text = f"{before - int(good.sum())} of {before} faces have corners that are not there"
            self.document.note(
                Kind.INVALID, "mesh-points", place, mesh.name, f"{text} or not finite; dropped"
            )
        return good

    def _subsets(
        self, mesh: Held, materials: tuple[int, ...], good: _Bools, place: SourceRef
    ) -> tuple[int | None, tuple[Subset, ...]]:
        """The material of all faces, or the faces of each."""
        if not materials:
            text = "no material; OpenGL's default is used"
            self.document.note(Kind.ASSUMED, "material-none", place, mesh.name, text)
            return None, ()
        slots = mesh.face_material.integers()
        slots = slots[good] if len(slots) == len(good) else np.zeros(int(good.sum()), np.int64)
        beyond = (slots < 0) | (slots >= len(materials))
        if beyond.any():
            text = f"{int(beyond.sum())} faces of a material that is not there; the first is used"
            self.document.note(Kind.INVALID, "fbx-face-material", place, mesh.name, text)
            slots = np.where(beyond, 0, slots)
        used = np.unique(slots)
        if len(used) == 1:
            return materials[int(used[0])], ()
        numbers = np.array(materials)[slots]
        return None, tuple(
            Subset(int(number), np.flatnonzero(numbers == number).astype(np.int32))
            for number in np.unique(numbers)
        )

    def _note_lost(self, mesh: Held, place: SourceRef) -> None:
        lost = []
        if len(mesh.color_sets) > 1:
            lost.append(f"{len(mesh.color_sets) - 1} further colour sets")
        if len(mesh.blend_deformers):
            text = "blend shapes; the base shape is kept"
            self.document.note(Kind.DROPPED, "fbx-blend-shape", place, mesh.name, text)
        if len(mesh.cache_deformers):
            lost.append("a geometry cache")
        if int(mesh.subdivision_display_mode) or len(mesh.edge_crease) or mesh.vertex_crease.exists:
            text = "a cage that is subdivided where it was made; its polygons are kept"
            self.document.note(Kind.DROPPED, "fbx-subdivision", place, mesh.name, text)
        if lost:
            text = f"{', '.join(lost)} dropped: no home"
            self.document.note(Kind.DROPPED, "mesh-attribute", place, mesh.name, text)


@dataclass(slots=True)
class _Corners:
    """Takes values at corners: for the corners that stay, or for points where all agree."""

    document: Document
    where: npt.NDArray[np.int64]
    corners: npt.NDArray[np.int64]  # of each corner its point
    points: int
    place: SourceRef

    def values(self, found: Held, width: int, what: str) -> tuple[Floats, Interpolation] | None:
        """The values of an attribute; None where there are none, or with a finding no good ones."""
        if not found.exists:
            return None
        table = found.values.rows(width)
        indices = found.indices.integers()
        if not len(table) or len(indices) != len(self.corners):
            text = f"{what}: {len(indices)} for {len(self.corners)} corners; dropped"
            self.document.note(Kind.INVALID, "attribute-dropped", self.place, "", text)
            return None
        beyond = (indices < 0) | (indices >= len(table))
        sound: _Bools = np.all(np.abs(table) < LARGEST, axis=1)
        table = np.where(sound[:, None], table, 0.0).astype(np.float32)
        if beyond.any() or not sound.all():
            count = int(beyond.sum()) + int((~sound).sum())
            text = f"{what}: {count} are not there or not finite; 0 or another is used"
            self.document.note(Kind.INVALID, "attribute-not-finite", self.place, "", text)
            indices = np.where(beyond, 0, indices)
        values = table[indices[self.where]]
        points = self.corners[self.where]
        common = np.zeros((self.points, width), np.float32)
        common[points] = values
        if bool((common[points] == values).all()):
            return common, "vertex"
        return values, "faceVarying"


def _corners_of(faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The numbers of the corners of faces (begin, count), (sum of counts,)."""
    begin, counts = faces[:, 0], faces[:, 1]
    ends = np.cumsum(counts)
    shift = np.repeat(begin - (ends - counts), counts)
    numbers: npt.NDArray[np.int64] = np.arange(len(shift), dtype=np.int64) + shift
    return numbers
