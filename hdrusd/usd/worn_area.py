"""The area of the lamps that wear a material: ``lamp_area``, from the meshes that were placed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom

from hdrusd.legacy.scene import LegacyScene, Mesh
from hdrusd.photometry.lamp_area import LampArea, mean_area
from hdrusd.usd.fixtures import PlacedMesh
from hdrusd.usd.sharing import Copies
from hdrusd.usd.triangles import corners

Doubles = npt.NDArray[np.float64]


def lamp_area(
    stage: Usd.Stage,
    scene: LegacyScene,
    placed: Sequence[PlacedMesh],
    copies: Copies,
    material: int,
) -> LampArea | None:
    """Of what one mesh has of a material, which is taken for one lamp; the mean of all meshes.

    As they stand at the stage's first time, each mesh where it first stands. None where no mesh
    wears it, or only over no area.
    """
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    faces: dict[int, Doubles] = {}
    lamps: list[LampArea] = []
    for mesh in placed:
        if mesh.mesh not in faces:
            faces[mesh.mesh] = _faces(scene.meshes[mesh.mesh], material)
        if len(faces[mesh.mesh]):
            world = _world(cache, stage, copies.first(mesh.node))
            with np.errstate(all="ignore"):
                lamps.append(LampArea.of(faces[mesh.mesh] @ _cofactors(world) * unit**2))
    return mean_area(lamps)


def _faces(mesh: Mesh, material: int) -> Doubles:
    """(t, 3) area vectors of the triangles that wear a material, in the mesh's own units."""
    wears = np.full(len(mesh.face_counts), mesh.material == material)
    for subset in mesh.subsets:
        wears[subset.faces] = subset.material == material
    if not wears.any():
        return np.empty((0, 3))
    triangles = corners(mesh.face_counts, mesh.face_indices, left_handed=False).select(wears)
    a, b, c = np.moveaxis(mesh.points[triangles.vertex].astype(np.float64), 1, 0)
    return np.asarray(0.5 * np.cross(b - a, c - a))


def _world(cache: UsdGeom.XformCache, stage: Usd.Stage, path: Sdf.Path) -> Doubles:
    matrix = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path))
    return np.array(matrix, np.float64)[:3, :3]


def _cofactors(matrix: Doubles) -> Doubles:
    """What area vectors (row vectors) are multiplied by where points are by ``matrix``."""
    x, y, z = matrix
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
