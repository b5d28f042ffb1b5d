"""The fixtures of converted lamps: found on the written stage, left out of their shadows.

``photometry/fixture.py`` says what holds a lamp. What holds one and is too large to be its
fixture (poles merged with the ground, a wall) shades it as all else does. Everything is
taken as it is at the stage's first time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.legacy.scene import LegacyScene, Mesh
from hdrusd.photometry.fixture import (
    ALONE,
    LARGEST_AREA,
    LONGEST,
    NEAR,
    Rays,
    Stopped,
    area,
    fixtures,
    lamp_rays,
    stopped,
)
from hdrusd.photometry.light import PhotometricLight
from hdrusd.usd.triangles import corners

Floats = npt.NDArray[np.float64]

#: Triangles that are looked at for all lamps of a scene: some seconds.
_MOST_TRIANGLES = 100_000_000


@dataclass(frozen=True, slots=True)
class PlacedMesh:
    """A mesh of the source at a node; ``path`` is what a collection names."""

    path: Sdf.Path
    node: Sdf.Path
    mesh: int  # in LegacyScene.meshes


@dataclass(slots=True)
class Lamp:
    """A local light of the stage, and what stands about it."""

    prim: Usd.Prim
    light: PhotometricLight
    fixtures: list[PlacedMesh] = field(default_factory=list)
    too_large: PlacedMesh | None = None  # holds it as a fixture does
    looked_at: bool = True  # False: there was too much to look at


def find_fixtures(
    stage: Usd.Stage,
    scene: LegacyScene,
    placed: Sequence[PlacedMesh],
    lamps: Sequence[Lamp],
    together: Callable[[Sdf.Path, Sdf.Path], bool],
) -> None:
    """Fill in ``fixtures`` and ``too_large`` of lamps.

    ``together``: whether things at two paths are ever shown at once.
    """
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    if lamps and placed:
        _Search(scene, cache, unit, lamps, together).run(placed)


def free_from(light: Usd.Prim, meshes: Iterable[PlacedMesh]) -> None:
    """Leave meshes out of the shadows of a light: excludes of its shadowLink collection."""
    collection = UsdLux.LightAPI(light).GetShadowLinkCollectionAPI()
    for mesh in meshes:
        collection.ExcludePath(mesh.path)


class _Search:
    """One search: mesh by mesh, so that the triangles of each are in the world once."""

    def __init__(
        self,
        scene: LegacyScene,
        cache: UsdGeom.XformCache,
        unit: float,
        lamps: Sequence[Lamp],
        together: Callable[[Sdf.Path, Sdf.Path], bool],
    ) -> None:
        self.scene = scene
        self.together = together
        self.stage = lamps[0].prim.GetStage()
        self.cache = cache
        self.unit = unit
        self.lamps = lamps
        frames = np.array([self._world(lamp.prim.GetPath()) for lamp in lamps])
        self.positions: Floats = frames[:, 3, :3]
        self.rays = [_rays(lamp.light, frame) for lamp, frame in zip(lamps, frames, strict=True)]
        # Along one axis the lamps that may be near a mesh follow one another.
        self.axis = int(np.argmax(np.ptp(self.positions, axis=0)))
        self.order = np.argsort(self.positions[:, self.axis])
        self.sorted: Floats = self.positions[self.order, self.axis]
        self.small: list[list[tuple[PlacedMesh, Stopped]]] = [[] for _ in lamps]
        self.large: list[list[tuple[PlacedMesh, Stopped]]] = [[] for _ in lamps]
        self.left = _MOST_TRIANGLES

    def run(self, placed: Sequence[PlacedMesh]) -> None:
        boxes = [_box(mesh) for mesh in self.scene.meshes]
        opaque = _opaque_materials(self.scene)
        for each in placed:
            box = boxes[each.mesh]
            if box is None:
                continue
            world = self._world(each.node)
            near = [
                number
                for number in self._near(*_placed_box(box, world)).tolist()
                if self.together(each.path, self.lamps[number].prim.GetPath())
            ]
            if not near or not self._shown(each.node):
                continue
            triangles = _triangles(self.scene.meshes[each.mesh], opaque)
            if len(triangles) == 0:
                continue
            if self.left < len(triangles) * len(near):
                for number in near:
                    self.lamps[number].looked_at = False
                continue
            self.left -= len(triangles) * len(near)
            self._look(each, triangles @ world[:3, :3] + world[3, :3], near)
        for lamp, rays, small, large in zip(
            self.lamps, self.rays, self.small, self.large, strict=True
        ):
            lamp.fixtures = [small[i][0] for i in fixtures([it for _, it in small], rays)]
            held = [mesh for mesh, it in large if it.holds(rays.weight, ALONE)]
            lamp.too_large = held[0] if held else None

    def _look(self, mesh: PlacedMesh, triangles: Floats, near: Sequence[int]) -> None:
        """What a mesh stops of the lamps that are near its box."""
        low, high = triangles.min(axis=1), triangles.max(axis=1)
        size = float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
        small = size <= LONGEST and area(triangles) <= LARGEST_AREA
        for number in near:
            place, light = self.positions[number], self.lamps[number].light
            beside = np.all((low <= place + NEAR) & (high >= place - NEAR), axis=1)
            if not beside.any():
                continue
            # Of a small mesh all stops the lamp; what is large may only lie close about it.
            about = triangles if small else triangles[beside]
            it = stopped(about - place, self.rays[number], light.radius)
            if it.near.any():
                (self.small if small else self.large)[number].append((mesh, it))

    def _near(self, low: Floats, high: Floats) -> npt.NDArray[np.intp]:
        """The numbers of the lamps in a box that is grown by ``NEAR``."""
        low, high = low - NEAR, high + NEAR
        first = np.searchsorted(self.sorted, low[self.axis])
        end = np.searchsorted(self.sorted, high[self.axis], "right")
        some = self.order[first:end]
        places = self.positions[some]
        return np.asarray(some[np.all((places >= low) & (places <= high), axis=1)])

    def _shown(self, path: Sdf.Path) -> bool:
        prim = UsdGeom.Imageable(self.stage.GetPrimAtPath(path))
        return bool(prim.ComputeVisibility(self.cache.GetTime()) != UsdGeom.Tokens.invisible)

    def _world(self, path: Sdf.Path) -> Floats:
        """(4, 4) local to world metres."""
        prim = self.stage.GetPrimAtPath(path)
        matrix: Gf.Matrix4d = self.cache.GetLocalToWorldTransform(prim)
        world = np.array(matrix, np.float64)
        world[:, :3] *= self.unit
        return world


def _rays(light: PhotometricLight, frame: Floats) -> Rays:
    axis = -frame[2, :3]
    length = float(np.linalg.norm(axis))
    return lamp_rays(light, axis / length if length > 0.0 else np.array([0.0, 0.0, -1.0]))


def _box(mesh: Mesh) -> Floats | None:
    """(2, 3) lowest and highest corner in the mesh's space; None where there is none."""
    points = mesh.points[np.isfinite(mesh.points).all(axis=1)].astype(np.float64)
    return np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else None


def _placed_box(box: Floats, world: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest corner, (3,) m, of a box (2, 3) in the world."""
    middle = (box[0] + box[1]) / 2.0 @ world[:3, :3] + world[3, :3]
    half = (box[1] - box[0]) / 2.0 @ np.abs(world[:3, :3])
    return middle - half, middle + half


def _opaque_materials(scene: LegacyScene) -> npt.NDArray[np.bool_]:
    """(m + 1,) which materials let no light through; the last stands for no material."""
    opaque = [material.alpha_mode == "opaque" for material in scene.materials]
    return np.array([*opaque, True])


def _triangles(mesh: Mesh, opaque: npt.NDArray[np.bool_]) -> Floats:
    """(t, 3, 3) the opaque triangles of a mesh in its own space, those with an extent."""
    wear = np.full(len(mesh.face_counts), -1 if mesh.material is None else mesh.material)
    for subset in mesh.subsets:
        wear[subset.faces] = subset.material
    made = corners(mesh.face_counts, mesh.face_indices, left_handed=mesh.left_handed)
    made = made.where(opaque[wear][made.face])
    triangles: Floats = mesh.points[made.vertex].astype(np.float64)
    return triangles[np.isfinite(triangles).all(axis=(1, 2))]
