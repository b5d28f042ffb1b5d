"""Lamps that are seen: the shapes of area lights as draws of their luminance.

A rectangle, disk or cylinder is seen at intensity / area, whatever its cone, focus or
photometric file: with a file at the candela that it has on the axis. A ball is seen when it
shines alike to all sides; one with a beam has no one luminance and is not drawn, nor is a
point. Flat lights are seen from the side that shines only. Lamps cast no shadow, and reflect
nothing. The outline of a round lamp is a polygon within 0.1 % of its radius.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import has_beam
from hdrusd.scene import (
    CYLINDER,
    DISK,
    POINT,
    RECT,
    RGB,
    SPHERE,
    Draw,
    Geometry,
    Material,
    Profile,
    TextureUse,
)
from hdrusd.usd.instanced_lights import joined
from hdrusd.usd.light_bounds import seen_area

Rows = npt.NDArray[np.void]
Doubles = npt.NDArray[np.float64]

#: Shape, material, and whether it moves.
_Key = tuple[int, int, bool]

#: Draw of a mesh by its number, material, and whether it moves.
_GlowKey = tuple[int, int, bool]

#: Sides of round lamps.
SIDES = 64


@dataclass(frozen=True, slots=True, eq=False)
class _Glow:
    """Draws of a mesh that is a light."""

    draws: tuple[Draw, ...]
    luminance: RGB
    sp: float
    moving: bool


class Emitters:
    """What of the lights of one moment is seen: ``show`` them, then ask for ``draws``."""

    def __init__(self) -> None:
        self._shown: list[tuple[Rows, TextureUse | None, bool]] = []
        self._glows: list[_Glow] = []
        self._kept: dict[_Key, Draw] = {}
        self._glowing: dict[_GlowKey, tuple[Draw, Draw]] = {}  # the mesh's own, and as it glows
        self._materials: dict[Material, Material] = {}  # of the last moment, by their values

    def clear(self) -> None:
        """Forget the lights, for the next moment."""
        self._shown, self._glows = [], []

    def show(self, rows: Rows, texture: TextureUse | None = None, *, moving: bool = False) -> None:
        """Note rows of ``scene.LIGHT``; ``texture`` lies on rectangles, first pixel at +X +Y."""
        self._shown.append((rows, texture, moving))

    def show_mesh(
        self, draws: Iterable[Draw], luminance: RGB, *, sp: float = 0.0, moving: bool = False
    ) -> None:
        """Note a mesh of this luminance, cd/m2; ``sp`` as ``LIGHT.sp``."""
        self._glows.append(_Glow(tuple(draws), luminance, sp, moving))

    def draws(
        self, first_material: int, profiles: tuple[Profile, ...]
    ) -> tuple[tuple[Draw, ...], tuple[Material, ...]]:
        """The draws, and their materials, which have the numbers from ``first_material`` on.

        Those that nothing moves are the same objects at every time; materials are too.
        """
        materials: dict[Material, int] = {}
        places: dict[tuple[int, int, bool], list[Doubles]] = {}
        alike_drawn: dict[tuple[bool, TextureUse | None], list[Rows]] = {}
        for some, texture, moving in self._shown:
            alike_drawn.setdefault((moving, texture), []).append(some)
        # Still ones first: what moving ones add does not renumber their materials.
        for (moving, texture), together in sorted(alike_drawn.items(), key=_moves):
            rows = joined(together)
            rows = rows[_seen(rows)]
            if not len(rows):
                continue
            alike = np.column_stack([rows["shape"], rows["sp"], _luminance(rows, profiles)])
            kinds, which = np.unique(alike, axis=0, return_inverse=True)
            at = _places(rows)
            for index, (shape, sp, *luminance) in enumerate(kinds):
                made = _material(luminance, texture, float(sp))
                number = materials.setdefault(made, len(materials))
                places.setdefault((int(shape), number, moving), []).append(at[which == index])
        kept, self._kept = self._kept, {}
        draws = [
            self._draw(kept, (shape, first_material + number, moving), np.concatenate(at))
            for (shape, number, moving), at in places.items()
        ]
        glowed, self._glowing = self._glowing, {}
        for glow in self._glows:
            made = _material(glow.luminance, None, glow.sp)
            number = materials.setdefault(made, len(materials))
            for draw in glow.draws:
                key = id(draw), first_material + number, glow.moving or draw.moving
                draws.append(self._glow(glowed, key, draw))
        self._materials = {made: self._materials.get(made, made) for made in materials}
        return tuple(draws), tuple(self._materials.values())

    def _glow(self, kept: dict[_GlowKey, tuple[Draw, Draw]], key: _GlowKey, draw: Draw) -> Draw:
        if key not in kept:
            _, material, moving = key
            kept[key] = draw, replace(draw, material=material, moving=moving, casts=False)
        self._glowing[key] = kept[key]  # with the mesh's own, whose number is thus not given again
        return kept[key][1]

    def _draw(self, kept: dict[_Key, Draw], key: _Key, places: Doubles) -> Draw:
        shape, material, moving = key
        draw = kept.get(key)
        if draw is None or not np.array_equal(draw.transforms, places):
            draw = Draw(_SHAPES[shape], material, places, moving=moving, casts=False)
        self._kept[key] = draw
        return draw


def beamed_balls(rows: Rows) -> npt.NDArray[np.bool_]:
    """(n,) which lamps shine, have a size, and are not seen: balls with a beam."""
    return np.asarray((rows["shape"] == SPHERE) & has_beam(rows) & _shining(rows))


def _moves(item: tuple[tuple[bool, TextureUse | None], list[Rows]]) -> bool:
    return item[0][0]


def _seen(rows: Rows) -> npt.NDArray[np.bool_]:
    return np.asarray((rows["shape"] != POINT) & _shining(rows) & ~beamed_balls(rows))


def _shining(rows: Rows) -> npt.NDArray[np.bool_]:
    shape = rows["shape"]
    lit = (rows["intensity"] > 0.0).any(axis=1)
    sized = (rows["radius"] > 0.0) | (shape == RECT) | (shape == DISK)
    return np.asarray(lit & sized & (rows["w"] > 0.0))


def _luminance(rows: Rows, profiles: tuple[Profile, ...]) -> Doubles:
    """cd/m2 per channel, (n, 3): candela over the area seen from the axis."""
    candela = np.array([_on_axis(profiles, int(number)) for number in rows["profile"]])
    exact = np.asarray(rows["intensity"] * (candela / seen_area(rows))[:, None], np.float32)
    # Copies of one lamp differ by roundings; to 2^-20 they have one material.
    bits = (exact.view(np.uint32) + np.uint32(8)) & ~np.uint32(15)
    return np.asarray(bits.view(np.float32), np.float64)


def _on_axis(profiles: tuple[Profile, ...], number: int) -> float:
    if number < 0:
        return 1.0
    profile = profiles[number]
    nadir = profile.type == "C" and profile.angles[0] == 0.0
    return float(profile.candela[:, 0].mean() if nadir else profile.candela.max())


def _material(luminance: Iterable[float], texture: TextureUse | None, sp: float) -> Material:
    red, green, blue = (float(v) for v in luminance)
    dark = (0.0, 0.0, 0.0)
    if texture is None:
        return Material(diffuse=dark, emission=(red, green, blue), emission_sp=sp)
    scaled = replace(texture, scale=(red, green, blue, 1.0))
    emission = red, green, blue
    return Material(diffuse=dark, emission=emission, emission_map=scaled, emission_sp=sp)


def _places(rows: Rows) -> Doubles:
    """(n, 4, 4) from the unit shapes below to the world, row vectors."""
    result = np.zeros((len(rows), 4, 4))
    shape, radius = rows["shape"][:, None], rows["radius"][:, None]
    x, y, z = rows["x"], rows["y"], -rows["axis"]
    along = x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
    across = y - along * np.sum(along * y, axis=1, keepdims=True)
    across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    upward = np.cross(along, across)
    flat, tube = (shape == RECT) | (shape == DISK), shape == CYLINDER
    result[:, 0, :3] = np.where(flat | tube, x, radius * along)
    result[:, 1, :3] = np.where(flat, y, radius * across)
    result[:, 2, :3] = np.where(flat, z, radius * upward)
    result[:, 3, :3] = rows["position"]
    result[:, 3, 3] = 1.0
    return result


def _geometry(name: str, points: Doubles, normals: Doubles, uvs: Doubles | None = None) -> Geometry:
    """Corner arrays (3 t, .) of one of the unit shapes."""
    st = {} if uvs is None else {"st": np.asarray(uvs, np.float32)}
    points32, normals32 = (np.ascontiguousarray(a, np.float32) for a in (points, normals))
    return Geometry(f"emitter:{name}", 0, points32, normals32, st, {})


def _square() -> Geometry:
    """-1 to 1 in x and y, facing -Z; the picture's first pixel at +X +Y, t up."""
    corners = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [1, -1, 0]])
    points = corners.astype(np.float64)
    uvs = np.stack([0.5 - 0.5 * points[:, 0], 0.5 + 0.5 * points[:, 1]], axis=1)
    return _geometry("rect", points, np.broadcast_to([0.0, 0.0, -1.0], points.shape), uvs)


def _ring() -> Doubles:
    """(SIDES + 1, 2) corners of the polygon that has the area of the unit circle, closed."""
    turn = np.linspace(0.0, 2.0 * np.pi, SIDES + 1)
    step = 2.0 * np.pi / SIDES
    fit = float(np.sqrt(step / np.sin(step)))
    return np.asarray(fit * np.stack([np.cos(turn), np.sin(turn)], axis=1))


def _disk() -> Geometry:
    """The unit disk in x and y, facing -Z."""
    ring = np.pad(_ring(), ((0, 0), (0, 1)))
    points = np.stack([np.zeros((SIDES, 3)), ring[1:], ring[:-1]], axis=1).reshape(-1, 3)
    return _geometry("disk", points, np.broadcast_to([0.0, 0.0, -1.0], points.shape))


def _band(name: str, rings: Doubles, normals: Doubles) -> Geometry:
    """Quads between neighbours of a grid (m, SIDES + 1, 3), seen from outside."""

    def corners(grid: Doubles) -> Doubles:
        a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
        return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3)

    return _geometry(name, corners(rings), corners(normals))


def _tube() -> Geometry:
    """The side of the cylinder of radius 1 about X, from -1 to 1."""
    ring = np.pad(_ring(), ((0, 0), (1, 0)))
    ends = np.array([[[-1.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]]])
    return _band("cylinder", ring + ends, np.broadcast_to(ring, (2, *ring.shape)))


def _ball() -> Geometry:
    """The unit sphere about X."""
    lean = np.linspace(0.0, np.pi, SIDES // 2 + 1)[:, None, None]
    ring = np.pad(_ring(), ((0, 0), (1, 0)))
    rings = ring * np.sin(lean) - np.cos(lean) * np.array([1.0, 0.0, 0.0])
    return _band("sphere", rings, rings)


_SHAPES = {RECT: _square(), DISK: _disk(), CYLINDER: _tube(), SPHERE: _ball()}
