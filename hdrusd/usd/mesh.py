"""Meshes: ``write_mesh`` from the legacy record, ``read_geometry`` into corner arrays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom, Vt

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import Mesh
from hdrusd.report import Kind, Report
from hdrusd.scene import Geometry
from hdrusd.usd.shapes import read_shape
from hdrusd.usd.triangles import Corners, corners, face_normals, smooth_normals

Floats = npt.NDArray[np.float32]

#: Primvar of vertex colours in the stages that we write.
COLOR_PRIMVAR = "displayColor"


def write_mesh(stage: Usd.Stage, path: Sdf.Path, mesh: Mesh) -> Usd.Prim:
    """Define a UsdGeomMesh (subdivisionScheme none) with its primvars; no material, no transform.

    Legacy units are kept: the root's transform scales them.
    """
    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.points))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(mesh.face_counts))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.face_indices))
    if len(mesh.points):
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        prim.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([low, high])))
    prim.CreateDoubleSidedAttr(mesh.two_sided)  # False too: it asks renderers to cull
    if mesh.left_handed:
        prim.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    primvars = UsdGeom.PrimvarsAPI(prim)
    if mesh.normals is not None:
        prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.normals)))
        prim.SetNormalsInterpolation(mesh.normals_interpolation)
    for name, (values, interpolation) in mesh.uvs.items():
        uv = primvars.CreatePrimvar(name, Sdf.ValueTypeNames.TexCoord2fArray, interpolation)
        uv.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(values)))
    if mesh.colors is not None:
        color = prim.CreateDisplayColorPrimvar(mesh.colors_interpolation)
        color.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.colors[:, :3])))
        if float(mesh.colors[:, 3].min(initial=1.0)) < 1.0:
            opacity = prim.CreateDisplayOpacityPrimvar(mesh.colors_interpolation)
            opacity.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(mesh.colors[:, 3])))
    return prim.GetPrim()


def time_varying(prim: Usd.Prim) -> bool:
    """Whether the shape itself (not its place) may change between frames."""
    names = ("points", "normals", "faceVertexIndices", "faceVertexCounts", "size", "radius")
    attributes = [prim.GetAttribute(n) for n in (*names, "height", "width", "length")]
    attributes += [pv.GetAttr() for pv in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues()]
    return any(a and a.ValueMightBeTimeVarying() for a in attributes)


class GeometryReader:
    """One gprim at one time, from which the triangles of any set of faces are cut."""

    def __init__(self, prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> None:
        self.prim = prim
        self.time = time
        self.report = report
        self.faces = 0
        self.points: Floats = np.zeros((0, 3), np.float32)
        self.triangles: Corners | None = None
        self._normals: Callable[[Corners], Floats] = lambda tri: face_normals(self.points, tri)
        shape = read_shape(prim, time)
        if shape is not None:
            self.points, self.faces = shape.points, len(shape.counts)
            self.triangles = corners(shape.counts, shape.indices, left_handed=self._left_handed())
            if shape.normals is not None:
                normals = shape.normals
                self._normals = lambda tri: normals[tri.vertex.ravel()]
        elif prim.IsA(UsdGeom.Mesh):
            self._read_mesh(UsdGeom.Mesh(prim))

    def _left_handed(self) -> bool:
        orientation = UsdGeom.Gprim(self.prim).GetOrientationAttr().Get(self.time)
        return bool(orientation == UsdGeom.Tokens.leftHanded)

    def _read_mesh(self, mesh: UsdGeom.Mesh) -> None:
        time = self.time
        points = _rows(mesh.GetPointsAttr().Get(time), 3)
        counts, indices = (
            _integers(a.Get(time))
            for a in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
        )
        if points is not None:
            self.points = points.astype(np.float32)
        self.faces = counts.size
        try:
            tri = corners(counts, indices, left_handed=self._left_handed())
        except ValueError as problem:
            self._finding(Kind.INVALID, "mesh-topology", f"{problem}; not drawn")
            return
        bad = (tri.vertex < 0) | (tri.vertex >= len(self.points))
        if bad.any():
            self._finding(Kind.INVALID, "mesh-index", "faces name points that are not there; left")
            keep = ~bad.any(axis=1)
            tri = Corners(tri.vertex[keep], tri.corner[keep], tri.face[keep])
        index = _integers(mesh.GetHoleIndicesAttr().Get(time))
        if index.size:
            solid = np.ones(self.faces, np.bool_)
            solid[index[(index >= 0) & (index < self.faces)]] = False
            tri = tri.select(solid)
        finite: npt.NDArray[np.bool_] = np.asarray(np.isfinite(self.points).all(axis=1))
        if not finite.all():
            self._finding(
                Kind.INVALID, "mesh-not-finite", "points are not finite; their faces left"
            )
            keep = finite[tri.vertex].all(axis=1)
            tri = Corners(tri.vertex[keep], tri.corner[keep], tri.face[keep])
            self.points = np.where(finite[:, None], self.points, 0.0).astype(np.float32)
        self.triangles = tri
        self._choose_normals(mesh)

    def _choose_normals(self, mesh: UsdGeom.Mesh) -> None:
        """primvars:normals, then normals; else flat for polygons, smooth for a subdivision cage."""
        primvar = UsdGeom.PrimvarsAPI(self.prim).GetPrimvar("normals")
        if primvar and primvar.HasValue():
            values, stated = _rows(primvar.ComputeFlattened(self.time), 3), True
            interpolation = str(primvar.GetInterpolation())
        else:
            given = mesh.GetNormalsAttr().Get(self.time)
            values, stated = _rows(given, 3), bool(given)
            interpolation = str(mesh.GetNormalsInterpolation())
        smooth = mesh.GetSubdivisionSchemeAttr().Get() != UsdGeom.Tokens.none

        def normals(tri: Corners) -> Floats:
            taken = None if values is None else tri.take(values, interpolation)
            if taken is None:
                if stated:
                    text = "normals do not fit the mesh; computed"
                    self._finding(Kind.INVALID, "mesh-normals", text)
                return (smooth_normals if smooth else face_normals)(self.points, tri)
            length = np.linalg.norm(taken.astype(np.float64), axis=1)
            usable = (length > 1e-9) & (length < 1e9)  # False for NaN; float32 can square these
            if not usable.all():
                text = "normals without a direction; those of the faces are used there"
                self._finding(Kind.INVALID, "mesh-normals", text)
                taken = np.where(usable[:, None], taken, face_normals(self.points, tri))
            return taken

        self._normals = normals

    def cut(
        self,
        key: str,
        faces: npt.NDArray[np.bool_] | None,
        uv_sets: list[str],
        color: str,
        version: int,
    ) -> Geometry | None:
        """Corner arrays of the faces marked (all when None); None when nothing is left."""
        tri = self.triangles
        if tri is None:
            return None
        if faces is not None:
            tri = tri.select(faces)
        if tri.face.size == 0:
            return None
        uvs = {name: values for name in uv_sets if (values := self._uv(tri, name)) is not None}
        colors = {}
        if color and (values := self._primvar(tri, color, 3)) is not None:
            colors[color] = self._reflecting(values, color)
        return Geometry(
            key=key,
            version=version,
            points=np.ascontiguousarray(self.points[tri.vertex.ravel()]),
            normals=self._normals(tri),
            uvs=uvs,
            colors=colors,
        )

    def _reflecting(self, values: Floats, name: str) -> Floats:
        """Vertex colours as factors on a reflectance: finite and not negative."""
        if np.isfinite(values).all() and (values >= 0.0).all():
            return values
        self._finding(Kind.INVALID, "color-invalid", f"{name} is not finite or negative; 0 there")
        return np.maximum(np.nan_to_num(values, posinf=0.0, neginf=0.0), 0.0)

    def _uv(self, tri: Corners, name: str) -> Floats | None:
        values = self._primvar(tri, name, 2)
        if values is None:
            self._finding(
                Kind.MISSING, "uv-missing", f"no usable primvar {name} for its texture; 0 is used"
            )
        return values

    def _primvar(self, tri: Corners, name: str, width: int) -> Floats | None:
        primvar = UsdGeom.PrimvarsAPI(self.prim).FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue():
            return None
        values = _rows(primvar.ComputeFlattened(self.time), width)
        if values is None:
            return None
        return tri.take(values[:, :width], str(primvar.GetInterpolation()))

    def _finding(self, kind: Kind, code: str, text: str) -> None:
        place = SourceRef(Path(self.prim.GetStage().GetRootLayer().identifier))
        self.report.add(kind, code, place, str(self.prim.GetPath()), text)


def _rows(value: object, width: int) -> npt.NDArray[np.generic] | None:
    """An array attribute as (n, at least ``width``) numbers; None where it is anything else.

    A layer may give a schema's attribute another type, and a primvar indices that lead nowhere.
    """
    array = np.asarray(value if value is not None else [])
    if array.ndim == 0 or array.size == 0 or array.dtype.kind not in "fiu":
        return None
    rows = array.reshape(len(array), -1)
    return rows if rows.shape[1] >= width else None


def _integers(value: object) -> npt.NDArray[np.int64]:
    rows = _rows(value, 1)
    whole = rows is not None and rows.shape[1] == 1 and rows.dtype.kind in "iu"
    return rows.ravel().astype(np.int64) if rows is not None and whole else np.zeros(0, np.int64)
