"""Faces of an OpenFlight file gathered into meshes, one for each node and kind of face.

Faces of a node share a mesh, and its points wherever they name the same vertex; their
materials are subsets of it. Apart stand faces that are hidden, that are culled from
behind, that have vertex colours, and subfaces: those lie in the plane of the face that
they are drawn upon, so they are lifted off it by ``SUBFACE_LIFT`` for each level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.flt_faces import (
    BILLBOARDS,
    CULLED,
    POINTS,
    SURROUNDED,
    WIREFRAMES,
    Faces,
    Polygons,
    ranges,
)
from hdrusd.importers.flt_materials import MaterialReader
from hdrusd.importers.flt_palettes import Palettes
from hdrusd.importers.flt_records import Document, Integers
from hdrusd.importers.flt_vertices import Flags, Floats
from hdrusd.legacy.scene import Mesh, Subset
from hdrusd.report import Kind

Doubles = npt.NDArray[np.float64]

#: How far a subface stands off the face below it, m. Seen from a height h at a distance z it
#: is nearer by lift z / h, and 24 bits of depth with a near plane at n tell z^2 / (2^24 n): enough
#: for z h up to 3,000 m^2 at n = 0.1 m, and so little that its shadow is not seen.
SUBFACE_LIFT = 0.002

#: Coordinates that float32 holds worse than this, m, get an origin of their own.
_PRECISION = 5e-4


@dataclass(slots=True)
class NodeMesh:
    """A mesh and where it goes."""

    owner: int  # record of the node
    hidden: bool
    apart: int  # number of the switch's child that it is; 0 for a mesh of its node
    mesh: Mesh
    offset: tuple[float, float, float] | None  # of its origin, where its points are far out


@dataclass(slots=True)
class _Sorted:
    """Polygons in the order of their groups and materials, and the points of all groups."""

    polygon: Integers  # of ``Polygons``
    group: Integers
    face: Integers  # row of ``Faces``
    material: Integers
    count: Integers
    corner: Integers  # row of ``Vertices``, for each corner
    index: Integers  # row of ``points``, for each corner
    point_vertex: Integers  # row of ``Vertices``, for each point
    point_group: Integers
    points: Doubles


class GeometryReader:
    """Makes the meshes of one file."""

    def __init__(self, document: Document, palettes: Palettes, materials: MaterialReader) -> None:
        self.document = document
        self.palettes = palettes
        self.materials = materials

    def read(
        self,
        faces: Faces,
        polygons: Polygons,
        owner: Integers,
        hidden: Flags,
        apart: Integers,
        transparency: Integers,
    ) -> list[NodeMesh]:
        """The meshes, in the order of the file.

        ``owner``: the record of the node that has each face; ``hidden``: faces never shown;
        ``apart``: the number of faces that a switch shows together, 0 for others;
        ``transparency``: of the objects about them, 0 to 255.
        """
        usable = self._usable(faces, polygons)
        faces = replace(faces, alpha=(faces.alpha * (255 - transparency) + 127) // 255)
        shown = np.zeros(len(faces.record), np.bool_)
        shown[polygons.face[usable]] = True
        if not shown.any():
            return []
        gouraud = self._gouraud(faces, polygons, usable)
        material, colored = self.materials.assign(
            self.document, self.palettes, faces, gouraud, shown
        )
        subface = self.document.records.subface[faces.record].astype(np.int64)
        self._notes(faces, shown, subface)
        # Owners in the order of the file, then the kind of face: one number for both.
        kind = hidden * 8 + (faces.draw == CULLED) * 4 + colored * 2 + (subface > 0)
        _, group = np.unique(owner * 16 + kind, return_inverse=True)
        parts = int(apart.max(initial=0)) + 1
        _, group = np.unique(group.ravel() * parts + apart, return_inverse=True)
        made = self._sorted(polygons, usable, group.ravel().astype(np.int64), material, subface)
        return self._meshes(made, faces, polygons, owner, hidden, apart, gouraud, colored)

    # -- which polygons there are ----------------------------------------------------------

    def _usable(self, faces: Faces, polygons: Polygons) -> Flags:
        draw = faces.draw[polygons.face]
        lines = np.isin(draw, WIREFRAMES)
        few = ~lines & ~np.isin(draw, POINTS) & (polygons.count < 3)
        self._lost(faces, polygons, lines | few, Kind.DROPPED, "flt-lines", "lines and points")
        good = ~lines & ~few & ~np.isin(draw, POINTS)
        bad = np.zeros(len(good), np.bool_)
        filled = np.flatnonzero(polygons.count > 0)
        if len(filled):
            wrong = np.add.reduceat(polygons.vertex < 0, polygons.start[filled], dtype=np.int64)
            bad[filled] = wrong > 0
        text = "faces with a vertex that is not there or not finite"
        self._lost(faces, polygons, good & bad, Kind.INVALID, "flt-vertex", text)
        return np.asarray(good & ~bad)

    def _lost(
        self, faces: Faces, polygons: Polygons, lost: Flags, kind: Kind, code: str, what: str
    ) -> None:
        if lost.any():
            record = int(faces.record[polygons.face[np.flatnonzero(lost)[0]]])
            text = f"{what}: {int(lost.sum())}, this is the first; left out"
            self.document.add(kind, code, record, self.document.text(record, 4, 8), text)

    def _gouraud(self, faces: Faces, polygons: Polygons, usable: Flags) -> Flags:
        """Faces that have, and show, a colour of any of their vertices."""
        corner = np.repeat(usable & faces.gouraud[polygons.face], polygons.count)
        face = np.repeat(polygons.face, polygons.count)[corner]
        has = polygons.vertices.has_color[polygons.vertex[corner]]
        found = np.zeros(len(faces.record), np.bool_)
        found[face[has]] = True
        return found

    def _notes(self, faces: Faces, shown: Flags, subface: Integers) -> None:
        """Findings about ways to draw faces, one of each for the whole file."""
        notes = (
            (np.isin(faces.template, BILLBOARDS), "flt-billboard", "faces turn with the viewer; "),
            (faces.draw == SURROUNDED, "flt-outline", "faces have an outline of another colour; "),
            (subface > 0, "flt-subface", "faces are drawn upon others; "),
        )
        ends = (
            "kept at rest",
            "without it",
            f"lifted off them by {SUBFACE_LIFT:g} m a level",
        )
        for (some, code, text), end in zip(notes, ends, strict=True):
            found = np.flatnonzero(some & shown)
            if len(found):
                record = int(faces.record[found[0]])
                thing = self.document.text(record, 4, 8)
                said = f"{len(found)} {text}{end}"
                self.document.add(Kind.REPLACED, code, record, thing, said)

    # -- points ----------------------------------------------------------------------------

    def _sorted(
        self,
        polygons: Polygons,
        usable: Flags,
        group: Integers,
        material: Integers,
        subface: Integers,
    ) -> _Sorted:
        """Polygons by group and material; points shared in a group, but of subfaces."""
        which = np.flatnonzero(usable)
        face = polygons.face[which]
        order = np.lexsort((material[face], group[face]))  # stable: the file's order within
        which, face = which[order], face[order]
        count = polygons.count[which]
        corner = polygons.vertex[ranges(polygons.start[which], count)]
        rows, total = len(polygons.vertices.position), len(corner)
        level = np.repeat(subface[face], count)
        own = np.where(level > 0, rows + np.arange(total), corner)
        corner_group = np.repeat(group[face], count)
        keys, first, index = np.unique(
            corner_group * (rows + total) + own, return_index=True, return_inverse=True
        )
        if len(keys) > self.document.limits.vertices:
            text = f"more than {self.document.limits.vertices} points"
            raise InputError(self.document.file, text)
        vertex = corner[first]
        made = _Sorted(
            which,
            group[face],
            face,
            material[face],
            count,
            corner,
            index.ravel(),
            vertex,
            corner_group[first],
            polygons.vertices.position[vertex],
        )
        if (level > 0).any():
            lift = SUBFACE_LIFT / self.document.unit_m * level[first]
            normal = np.repeat(_face_normals(polygons.vertices.position[corner], count), count, 0)
            made.points += lift[:, None] * normal[first]
        return made

    # -- meshes ----------------------------------------------------------------------------

    def _meshes(
        self,
        made: _Sorted,
        faces: Faces,
        polygons: Polygons,
        owner: Integers,
        hidden: Flags,
        apart: Integers,
        gouraud: Flags,
        colored: Flags,
    ) -> list[NodeMesh]:
        groups = int(made.group[-1]) + 1
        numbers = np.arange(groups + 1)
        at_polygon = np.searchsorted(made.group, numbers)
        at_point = np.searchsorted(made.point_group, numbers)
        at_corner = np.concatenate([[0], np.cumsum(made.count)])[at_polygon]
        found = []
        for number in range(groups):
            some = slice(int(at_polygon[number]), int(at_polygon[number + 1]))
            if some.start == some.stop:
                continue
            corners = slice(int(at_corner[number]), int(at_corner[number + 1]))
            rows = slice(int(at_point[number]), int(at_point[number + 1]))
            face = int(made.face[some.start])
            record = int(owner[face])
            mesh, offset = self._mesh(made, polygons, record, some, corners, rows)
            mesh = replace(mesh, two_sided=bool(faces.draw[face] != CULLED))
            if colored[face]:
                mesh = self._with_colors(mesh, made, faces, polygons, gouraud, some, corners, rows)
            flags = bool(hidden[face]), int(apart[face])
            found.append((int(made.face[some].min()), record, *flags, mesh, offset))
        found.sort(key=lambda entry: entry[0])
        return [NodeMesh(*entry[1:]) for entry in found]

    def _mesh(
        self,
        made: _Sorted,
        polygons: Polygons,
        record: int,
        some: slice,
        corners: slice,
        rows: slice,
    ) -> tuple[Mesh, tuple[float, float, float] | None]:
        document, vertices = self.document, polygons.vertices
        name = document.text(record, 4, 8) or "faces"
        points, vertex = made.points[rows], made.point_vertex[rows]
        low, high = points.min(axis=0), points.max(axis=0)
        offset = None
        if max(np.abs(low).max(), np.abs(high).max()) * 2.0**-24 > _PRECISION / document.unit_m:
            middle = np.rint(0.5 * (low + high))
            points = points - middle
            offset = (float(middle[0]), float(middle[1]), float(middle[2]))
        count = made.count[some]
        mesh = Mesh(
            name,
            document.ref(record),
            points.astype(np.float32),
            count.astype(np.int32),
            (made.index[corners] - rows.start).astype(np.int32),
        )
        has = vertices.has_normal[vertex]
        if has.all():
            mesh = replace(mesh, normals=vertices.normal[vertex])
        elif has.any():
            corner = made.corner[corners]
            flat = np.repeat(_face_normals(vertices.position[corner], count), count, axis=0)
            normals = np.where(vertices.has_normal[corner][:, None], vertices.normal[corner], flat)
            mesh = replace(
                mesh, normals=normals.astype(np.float32), normals_interpolation="faceVarying"
            )
        return self._dressed(
            mesh, made.material[some], vertices.has_uv[vertex], vertices.uv[vertex]
        ), offset

    def _dressed(self, mesh: Mesh, material: Integers, has_uv: Flags, uv: Floats) -> Mesh:
        """With its materials, and texture coordinates where any are there."""
        if has_uv.any():
            mesh = replace(mesh, uvs={"st": (uv, "vertex")})
        starts = np.flatnonzero(np.diff(material, prepend=-1))
        if len(starts) == 1:
            mesh = replace(mesh, material=int(material[0]))
        else:
            ends = [*starts[1:].tolist(), len(material)]
            mesh = replace(
                mesh,
                subsets=tuple(
                    Subset(int(material[start]), np.arange(start, end, dtype=np.int32))
                    for start, end in zip(starts.tolist(), ends, strict=True)
                ),
            )
        textured = any(
            self.materials.materials[int(material[start])].diffuse_map is not None
            for start in starts
        )
        if textured and not has_uv.all():
            text = f"{int((~has_uv).sum())} textured vertices without texture coordinates"
            code = "flt-no-coordinates"
            self.document.report.add(Kind.MISSING, code, mesh.source, mesh.name, text)
            if "st" not in mesh.uvs:  # all of it has one texel
                mesh = replace(mesh, uvs={"st": (uv, "vertex")})
        return mesh

    def _with_colors(
        self,
        mesh: Mesh,
        made: _Sorted,
        faces: Faces,
        polygons: Polygons,
        gouraud: Flags,
        some: slice,
        corners: slice,
        rows: slice,
    ) -> Mesh:
        """A colour a vertex; a corner where a face's own stands in."""
        vertices = polygons.vertices
        vertex = made.point_vertex[rows]
        face = made.face[some]
        if gouraud[face].all() and vertices.has_color[vertex].all():
            return replace(mesh, colors=_opaque(vertices.color[vertex]))
        corner = made.corner[corners]
        corner_face = np.repeat(face, made.count[some])
        own = gouraud[corner_face] & vertices.has_color[corner]
        color = np.where(own[:, None], vertices.color[corner], faces.color[corner_face])
        return replace(mesh, colors=_opaque(color), colors_interpolation="faceVarying")


def _opaque(color: Floats) -> Floats:
    """RGB as RGBA; the format has its transparency in the faces."""
    full = np.ones((len(color), 1), np.float32)
    return np.concatenate([color.astype(np.float32), full], axis=1)


def _face_normals(corners: Doubles, count: Integers) -> Doubles:
    """Unit normals (f, 3) of polygons by their corners in a row; 0 of what has no area.

    Newell's sum over the edges, from the first corner of each.
    """
    start = np.cumsum(count) - count
    near = corners - np.repeat(corners[start], count, axis=0)
    following = np.arange(len(corners)) + 1
    following[start + count - 1] = start
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        total = np.add.reduceat(np.cross(near, near[following]), start, axis=0)
        length = np.linalg.norm(total, axis=1)
        good = (length > 0.0) & np.isfinite(length)
        return np.where(good[:, None], total / np.where(good, length, 1.0)[:, None], 0.0)
