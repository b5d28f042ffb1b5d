"""How large what a scene shows stands on the stage: meshes, and the ground below all of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from pxr import Gf, Usd, UsdGeom

from hdrusd.usd.fixtures import PlacedMesh
from hdrusd.usd.placed_area import PlacedArea, place_kinds, placed_areas
from hdrusd.usd.sharing import Copies


def mesh_areas(
    stage: Usd.Stage, placed: Iterable[PlacedMesh], copies: Copies
) -> dict[int, PlacedArea]:
    """What all visible places of each mesh make of its areas, at the first time."""
    time, unit = Usd.TimeCode.EarliestTime(), UsdGeom.GetStageMetersPerUnit(stage)
    cache = UsdGeom.XformCache(time)
    meshes: list[int] = []
    worlds: list[Gf.Matrix4d] = []
    places = ((one.mesh, path) for one in placed for path in copies.places(one.path))
    for mesh, path in places:
        prim = stage.GetPrimAtPath(path)
        if UsdGeom.Imageable(prim).ComputeVisibility(time) != UsdGeom.Tokens.invisible:
            meshes.append(mesh)
            worlds.append(cache.GetLocalToWorldTransform(prim))
    return placed_areas(place_kinds(worlds, unit), meshes)


def extents(stage: Usd.Stage) -> tuple[float, float]:
    """Of the bounding box of all that is visible, at the first time: its diagonal, m, and the
    ground below it, m2.
    """
    cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), [UsdGeom.Tokens.default_])
    box = cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    if box.IsEmpty():
        return 0.0, 0.0
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    size: Gf.Vec3d = box.GetSize() * unit
    up = 1 if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else 2
    ground = float(np.prod([size[axis] for axis in range(3) if axis != up]))
    return float(box.GetSize().GetLength()) * unit, ground


def is_shown(prim: Usd.Prim) -> bool:
    """Whether something is on the stage and visible, at the first time."""
    if not prim or not prim.IsActive():
        return False
    visibility = UsdGeom.Imageable(prim).ComputeVisibility(Usd.TimeCode.EarliestTime())
    return bool(visibility != UsdGeom.Tokens.invisible)


def level_share(lights: Sequence[Usd.Prim]) -> float:
    """Of distant lights, what a level ground gets of their lux: the mean cosine, at the first time.

    0 of one that shines from below.
    """
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    shares = []
    for prim in lights:
        way = cache.GetLocalToWorldTransform(prim).TransformDir(Gf.Vec3d(0.0, 0.0, -1.0))
        up = 1 if UsdGeom.GetStageUpAxis(prim.GetStage()) == UsdGeom.Tokens.y else 2
        shares.append(max(-way.GetNormalized()[up], 0.0))
    return float(np.mean(shares)) if shares else 0.0
