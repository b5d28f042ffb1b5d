"""The fixtures of converted lamps: found on the written stage, left out of their shadows.

``photometry/fixture.py`` says what holds a lamp. What holds one and is too large to be its
fixture (poles merged with the ground, a wall) shades it as all else does. Everything is
taken as it is at the stage's first time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

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
from hdrusd.usd.boxes import Boxes
from hdrusd.usd.triangles import corners

Floats = npt.NDArray[np.float64]

#: Triangles that are looked at for all lamps of a scene: some seconds.
_MOST_TRIANGLES = 100_000_000

#: Meshes whose triangles are kept: those of the places that follow one another.
_KEPT = 8


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


#: A mesh, its axes in the world and its origin from a lamp, the lamp's rays and radius.
_Key = tuple[int, bytes, tuple[float, ...], int, float]


class _Search:
    """One search: mesh by mesh, so that the triangles of each are in the world once.

    What stands about a lamp as it does about another, posts of one make, is looked at once.
    """

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
        made: dict[tuple[object, ...], Rays] = {}
        self.rays = [
            _rays(lamp.light, frame, made) for lamp, frame in zip(lamps, frames, strict=True)
        ]
        # Along one axis the lamps that may be near a mesh follow one another.
        self.axis = int(np.argmax(np.ptp(self.positions, axis=0)))
        self.order = np.argsort(self.positions[:, self.axis])
        self.sorted: Floats = self.positions[self.order, self.axis]
        self.small: list[list[tuple[PlacedMesh, Stopped]]] = [[] for _ in lamps]
        self.large: list[list[tuple[PlacedMesh, Stopped]]] = [[] for _ in lamps]
        self.known: dict[_Key, tuple[bool, Stopped | None]] = {}
        self.left = _MOST_TRIANGLES

    def run(self, placed: Sequence[PlacedMesh]) -> None:
        boxes = [_box(mesh) for mesh in self.scene.meshes]
        opaque = _opaque_materials(self.scene)
        meshes = lru_cache(_KEPT)(lambda number: _triangles(self.scene.meshes[number], opaque))
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
            triangles = meshes(each.mesh)
            if len(triangles):
                self._look(each, triangles, world, near)
        for lamp, rays, small, large in zip(
            self.lamps, self.rays, self.small, self.large, strict=True
        ):
            lamp.fixtures = [small[i][0] for i in fixtures([it for _, it in small], rays)]
            held = [mesh for mesh, it in large if it.holds(rays.weight, ALONE)]
            lamp.too_large = held[0] if held else None

    def _look(
        self, mesh: PlacedMesh, triangles: Floats, world: Floats, near: Sequence[int]
    ) -> None:
        """What a mesh stops of the lamps that are near its box. ``triangles``: in its space."""
        keys = {number: self._key(mesh.mesh, world, number) for number in near}
        new = list({key: number for number, key in keys.items() if key not in self.known}.items())
        if new:
            if self.left < len(triangles):
                for number in near:
                    self.lamps[number].looked_at = False
                return
            self.left -= len(triangles)
            self._stop(triangles @ world[:3, :3] + world[3, :3], new)
        for number, key in keys.items():
            if key not in self.known:
                self.lamps[number].looked_at = False
                continue
            small, it = self.known[key]
            if it is not None:
                (self.small if small else self.large)[number].append((mesh, it))

    def _key(self, mesh: int, world: Floats, number: int) -> _Key:
        """Where a mesh stands about a lamp, to a micrometre."""
        axes = (np.round(world[:3, :3], 12) + 0.0).tobytes()
        way = np.round(world[3, :3] - self.positions[number], 6) + 0.0
        return (
            mesh,
            axes,
            tuple(way.tolist()),
            id(self.rays[number]),
            self.lamps[number].light.radius,
        )

    def _stop(self, triangles: Floats, new: Sequence[tuple[_Key, int]]) -> None:
        """Find what triangles, in the world, stop of lamps."""
        low, high = triangles.min(axis=1), triangles.max(axis=1)
        size = float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
        small = size <= LONGEST and area(triangles) <= LARGEST_AREA
        boxes = Boxes(low, high)
        for key, number in new:
            place, light = self.positions[number], self.lamps[number].light
            beside = boxes.meeting(place - NEAR, place + NEAR)
            # Of a small mesh all stops the lamp; what is large may only lie close about it.
            about = triangles if small else triangles[beside]
            if self.left < len(about):
                continue
            it = None
            if len(beside):
                self.left -= len(about)
                it = stopped(about - place, self.rays[number], light.radius)
            self.known[key] = small, it if it is not None and it.near.any() else None

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


def _rays(light: PhotometricLight, frame: Floats, made: dict[tuple[object, ...], Rays]) -> Rays:
    """The rays of a lamp; of lamps that shine alike the same ones, kept in ``made``."""
    axis = -frame[2, :3]
    length = float(np.linalg.norm(axis))
    axis = axis / length if length > 0.0 else np.array([0.0, 0.0, -1.0])
    key = axis.tobytes(), light.cutoff, light.exponent, bool(light.profile)
    if key not in made:
        made[key] = lamp_rays(light, axis)
    return made[key]


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
    made = corners(mesh.face_counts, mesh.face_indices, left_handed=mesh.left_handed)
    made = made.where(opaque[mesh.face_materials()][made.face])
    triangles: Floats = mesh.points[made.vertex].astype(np.float64)
    return triangles[np.isfinite(triangles).all(axis=(1, 2))]
