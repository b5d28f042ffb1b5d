"""The area of the lamps that wear a material: ``LampAreas``, from the meshes that were placed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom

from hdrusd.legacy.scene import LegacyScene, Mesh
from hdrusd.photometry.lamp_area import LampArea, mean_area
from hdrusd.usd.fixtures import PlacedMesh
from hdrusd.usd.placed_area import place_kinds
from hdrusd.usd.sharing import Copies
from hdrusd.usd.triangles import corners

Doubles = npt.NDArray[np.float64]


class LampAreas:
    """Of the meshes of one stage, as they stand at its first time, each where it first stands.

    ``wearers``: the meshes that have each material.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        scene: LegacyScene,
        placed: Sequence[PlacedMesh],
        copies: Copies,
        wearers: Mapping[int | None, Sequence[int]],
    ) -> None:
        self.stage = stage
        self.scene = scene
        self.placed = placed
        self.copies = copies
        self.wearers = wearers
        self._cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        self._unit = UsdGeom.GetStageMetersPerUnit(stage)
        self._places: dict[int, list[int]] = {}  # in ``placed``, by mesh
        for number, mesh in enumerate(placed):
            self._places.setdefault(mesh.mesh, []).append(number)

    def of(self, material: int) -> LampArea | None:
        """Of what one mesh has of a material, which is taken for one lamp; the mean of all meshes.

        None where no mesh wears it, or only over no area.
        """
        meshes = self.wearers.get(material, ())
        faces = {index: _faces(self.scene.meshes[index], material) for index in meshes}
        numbers = sorted(place for index in meshes for place in self._places.get(index, ()))
        worn = [self.placed[number] for number in numbers if len(faces[self.placed[number].mesh])]
        kinds = place_kinds([self._world(self.copies.first(one.node)) for one in worn], self._unit)
        alike: dict[tuple[int, int], LampArea] = {}
        lamps: list[LampArea] = []
        for one, kind, factor in zip(worn, kinds.kind.tolist(), kinds.factor.tolist(), strict=True):
            key = one.mesh, kind
            if key not in alike:
                with np.errstate(all="ignore"):
                    alike[key] = LampArea.of(faces[one.mesh] @ kinds.cofactors[kind])
            lamp = alike[key]
            lamps.append(LampArea(lamp.seen * factor, lamp.surface * factor))
        return mean_area(lamps)

    def _world(self, path: Sdf.Path) -> Gf.Matrix4d:
        return self._cache.GetLocalToWorldTransform(self.stage.GetPrimAtPath(path))


def _faces(mesh: Mesh, material: int) -> Doubles:
    """(t, 3) area vectors of the triangles that wear a material, in the mesh's own units."""
    wears = mesh.wears(material)
    if not wears.any():
        return np.empty((0, 3))
    triangles = corners(mesh.face_counts, mesh.face_indices, left_handed=False).select(wears)
    a, b, c = np.moveaxis(mesh.points[triangles.vertex].astype(np.float64), 1, 0)
    return np.asarray(0.5 * np.cross(b - a, c - a))
