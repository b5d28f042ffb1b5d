"""How much of a stage wears each material: faces, and m2 in all places, for the account."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from hdrusd.account.wear import Worn
from hdrusd.usd.placed_area import PlacedArea, place_kinds, placed_areas
from hdrusd.usd.triangles import corners

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_EARLIEST = Usd.TimeCode.EarliestTime()


@dataclass(slots=True)
class Areas:
    """Sums by material, of meshes that are visible at the first time."""

    stage: Usd.Stage
    _faces: dict[Sdf.Path, int] = field(default_factory=dict)
    _areas: dict[Sdf.Path, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unit = UsdGeom.GetStageMetersPerUnit(self.stage)
        cache = UsdGeom.XformCache(_EARLIEST)
        meshes: list[_Dressed] = []
        worlds: list[Gf.Matrix4d] = []
        everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        for prim in Usd.PrimRange(self.stage.GetPseudoRoot(), everything):
            if prim.IsA(UsdGeom.Mesh) and (
                UsdGeom.Imageable(prim).ComputeVisibility(_EARLIEST) != "invisible"
            ):
                meshes.append(_dressed(prim))
                worlds.append(cache.GetLocalToWorldTransform(prim))
        alike = {mesh: number for number, mesh in enumerate(dict.fromkeys(meshes))}
        owners = [alike[mesh] for mesh in meshes]
        placed = placed_areas(place_kinds(worlds, unit), owners)
        places = np.bincount(owners, minlength=len(alike)).tolist() if owners else []
        vectors: dict[Sdf.Path, _Faces] = {}
        for mesh, number in alike.items():
            if mesh.path not in vectors:
                vectors[mesh.path] = _Faces.of(self.stage.GetPrimAtPath(mesh.path))
            self._add(mesh, vectors[mesh.path], placed[number], places[number])

    def worn(self, material: Usd.Prim) -> Worn:
        """Of a material; where on its pictures is not asked."""
        path = _own(material).GetPath()
        area = self._areas.get(path, 0.0)
        return Worn(self._faces.get(path, 0), area if np.isfinite(area) else 0.0, None, None)

    def _add(self, mesh: _Dressed, faces: _Faces, placed: PlacedArea, places: int) -> None:
        areas = faces.areas(placed)
        for material, index in zip(mesh.materials, faces.parts, strict=True):
            if material is not None and len(areas):
                own = areas[index]
                self._faces[material] = self._faces.get(material, 0) + len(own) * places
                self._areas[material] = self._areas.get(material, 0.0) + float(own.sum())


@dataclass(frozen=True, slots=True)
class _Dressed:
    """A mesh, and what its subsets and the rest of it wear: in another place that may differ."""

    path: Sdf.Path  # in its prototype where it has one
    materials: tuple[Sdf.Path | None, ...]


def _dressed(mesh: Usd.Prim) -> _Dressed:
    subsets = UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets()
    prims = [*(subset.GetPrim() for subset in subsets), mesh]
    bound = (UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0] for prim in prims)
    materials = (_own(it.GetPrim()).GetPath() if it else None for it in bound)
    return _Dressed(_own(mesh).GetPath(), tuple(materials))


@dataclass(frozen=True, slots=True, eq=False)
class _Faces:
    """The faces of a mesh in its own units; none of one whose arrays disagree."""

    vectors: Array  # (t, 3), area vectors of the triangles they are fanned into
    face: Ints  # (t,)
    count: int
    parts: tuple[Ints, ...]  # the faces of its subsets, and the rest

    @classmethod
    def of(cls, prim: Usd.Prim) -> _Faces:
        mesh = UsdGeom.Mesh(prim)
        counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get(_EARLIEST) or [], np.int64)
        found = _triangles(mesh, counts)
        vectors, face = found or (np.zeros((0, 3)), np.zeros(0, np.int64))
        count = len(counts) if found else 0
        rest, parts = np.ones(count, np.bool_), []
        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            index = np.asarray(subset.GetIndicesAttr().Get(_EARLIEST) or [], np.int64)
            parts.append(index[(index >= 0) & (index < count)])
            rest[parts[-1]] = False
        return cls(vectors, face, count, (*parts, np.flatnonzero(rest)))

    def areas(self, placed: PlacedArea) -> Array:
        """m2 of each face in all places."""
        areas = placed.of(self.vectors)
        sound = np.where(np.isfinite(areas), areas, 0.0)
        return np.asarray(np.bincount(self.face, sound, self.count), np.float64)


def _own(prim: Usd.Prim) -> Usd.Prim:
    return prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim


def _triangles(mesh: UsdGeom.Mesh, counts: Ints) -> tuple[Array, Ints] | None:
    """Area vectors (t, 3) of the triangles of a mesh, and their faces (t,)."""
    points = np.asarray(mesh.GetPointsAttr().Get(_EARLIEST) or [], np.float64).reshape(-1, 3)
    indices = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(_EARLIEST) or [], np.int64)
    if not len(indices) or indices.min() < 0 or indices.max() >= len(points):
        return None
    try:
        triangles = corners(counts, indices, left_handed=False)
    except ValueError:
        return None
    a, b, c = np.moveaxis(points[triangles.vertex], 1, 0)
    with np.errstate(invalid="ignore", over="ignore"):
        return 0.5 * np.cross(b - a, c - a), triangles.face
