"""How much of a stage wears each material: faces, and m2 in all places, for the account."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom, UsdShade

from hdrusd.account.wear import Worn
from hdrusd.usd.triangles import corners

Array = npt.NDArray[np.float64]

_EARLIEST = Usd.TimeCode.EarliestTime()


@dataclass(slots=True)
class Areas:
    """Sums by material, of meshes that are visible at the first time."""

    stage: Usd.Stage
    _faces: dict[Sdf.Path, int] = field(default_factory=dict)
    _areas: dict[Sdf.Path, float] = field(default_factory=dict)
    _meshes: dict[Sdf.Path, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unit = UsdGeom.GetStageMetersPerUnit(self.stage)
        cache = UsdGeom.XformCache(_EARLIEST)
        everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        for prim in Usd.PrimRange(self.stage.GetPseudoRoot(), everything):
            hidden = prim.IsA(UsdGeom.Mesh) and (
                UsdGeom.Imageable(prim).ComputeVisibility(_EARLIEST) == "invisible"
            )
            if prim.IsA(UsdGeom.Mesh) and not hidden:
                volume = abs(cache.GetLocalToWorldTransform(prim).GetDeterminant3())
                self._add(prim, (float(np.cbrt(volume)) * unit) ** 2)

    def worn(self, material: Usd.Prim) -> Worn:
        """Of a material; where on its pictures is not asked."""
        path = _own(material).GetPath()
        area = self._areas.get(path, 0.0)
        return Worn(self._faces.get(path, 0), area if np.isfinite(area) else 0.0, None, None)

    def _add(self, mesh: Usd.Prim, scale: float) -> None:
        """``scale``: m2 a square unit of the mesh."""
        own = _own(mesh).GetPath()
        if own not in self._meshes:
            self._meshes[own] = _face_areas(UsdGeom.Mesh(mesh))
        areas = self._meshes[own]
        rest = np.ones(len(areas), np.bool_)
        for subset in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets():
            index = np.asarray(subset.GetIndicesAttr().Get(_EARLIEST) or [], np.int64)
            index = index[(index >= 0) & (index < len(rest))]
            rest[index] = False
            self._count(subset.GetPrim(), areas[index], scale)
        self._count(mesh, areas[rest], scale)

    def _count(self, prim: Usd.Prim, areas: Array, scale: float) -> None:
        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if bound and len(areas):
            path = _own(bound.GetPrim()).GetPath()
            self._faces[path] = self._faces.get(path, 0) + len(areas)
            self._areas[path] = self._areas.get(path, 0.0) + float(areas.sum()) * scale


def _own(prim: Usd.Prim) -> Usd.Prim:
    return prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim


def _face_areas(mesh: UsdGeom.Mesh) -> Array:
    """Square units of each face, fanned; none of a mesh whose arrays disagree."""
    points = np.asarray(mesh.GetPointsAttr().Get(_EARLIEST) or [], np.float64).reshape(-1, 3)
    counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get(_EARLIEST) or [], np.int64)
    indices = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(_EARLIEST) or [], np.int64)
    if not len(indices) or indices.min() < 0 or indices.max() >= len(points):
        return np.zeros(0)
    try:
        triangles = corners(counts, indices, left_handed=False)
    except ValueError:
        return np.zeros(0)
    with np.errstate(invalid="ignore", over="ignore"):
        a, b, c = np.moveaxis(points[triangles.vertex], 1, 0)
        areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=-1)
    sound = np.where(np.isfinite(areas), areas, 0.0)
    return np.asarray(np.bincount(triangles.face, sound, len(counts)), np.float64)
