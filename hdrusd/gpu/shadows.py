"""Shadow maps: for every light, how much of it each surface sees.

One depth texture, the atlas, holds the tiles of all lights (gpu/shadow_views.py,
gpu/cascades.py); shaders/shadow.glsl reads them. A tile is drawn when its light or what
stands still has changed. Where something moves, a second atlas keeps what stands still: a
tile that sees a moving caster is restored from it and only what moves is drawn.

Error: edges of shadows are right to one texel of the tile, softened over one; the light of
an area source is seen in steps of 1 / samples, softened likewise. A shadow begins within
about two texels, plus what 24 bits of depth leave open (1.8e-7 distance^2 / near), of where
its caster touches the receiver.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.gpu.cascades import DistantView, distant_view
from hdrusd.gpu.casters import Casters, Group
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.shadow_atlas import Atlas, Block, smallest_atlas, tile_sizes
from hdrusd.gpu.shadow_drawing import TileDrawing, Tiles, join, seen_by
from hdrusd.gpu.shadow_views import View, local_view, pattern
from hdrusd.gpu.textures import TextureCache
from hdrusd.report import Kind, Report
from hdrusd.scene import RenderScene

Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]
Lights = npt.NDArray[np.void]

#: Texels of the largest and smallest tiles.
_LARGEST = {"SHADOW_SPOT": 2048, "SHADOW_CUBE": 1024, "SHADOW_ORTHO": 2048}
_SMALLEST = 64

#: Of a light with sample points each tile is this much smaller: many add up.
_SAMPLED = 4

#: An area light up to this half size (m) has one sample point; in a small scene less.
SMALL_LIGHT = 0.1

#: What makes a light's tiles be drawn anew; its intensity does not.
_SEEN_FROM = ["position", "w", "radius", "axis", "outer", "x", "y", "shape", "profile", "angle"]
_SEEN_FROM += ["shadow_link"]


def shadow_rows(kind: str) -> int:
    """Texels of a light of this kind that shadow.glsl reads (SHADOW_ROWS)."""
    return 6 if "SHADOW_ORTHO" in kind else 2


@dataclass(frozen=True, slots=True, eq=False)
class Shadows:
    """For each light of the scene: #defines in words, "" without shadows; and (n, 6, 4) texels."""

    kind: npt.NDArray[np.str_]
    rows: Floats


@dataclass(slots=True, eq=False)
class _Lamp:
    """A light that casts shadows, over time."""

    signature: bytes
    full: View | DistantView  # all that it can shine on
    faces: npt.NDArray[np.bool_]  # those of ``full`` on which something casts
    outlines: Tiles  # those of ``full``, at their widest
    place: tuple[Block, int, int] | None = None
    tiles: Tiles | None = None
    moves: bool = False  # it was elsewhere in the frame before
    drawn: bool = False
    kept: bool = False  # what stands still is kept apart too
    saw: npt.NDArray[np.bool_] | None = None  # (t,) tiles that showed something that moves
    sees: npt.NDArray[np.bool_] | None = None  # (t,) of ``full``: those that do now

    @property
    def view(self) -> View | DistantView:
        return self.full.with_faces(self.faces) if isinstance(self.full, View) else self.full

    def of_view(self, seen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """A flag for each tile of ``full`` as one for each tile of ``view``."""
        if isinstance(self.full, DistantView):
            return seen
        return seen.reshape(-1, len(self.faces))[:, self.faces].ravel()

    def block(self, cell: int) -> Block:
        """What its tiles take in the atlas."""
        faces = int(np.sum(self.faces))
        return Block(cell, faces * (self.full.points // self.full.rows), self.full.rows)


class ShadowMaps:
    """The shadow maps of one renderer.

    ``samples``: points of an area light, a multiple of 4; ``limit``: texels of the side of
    the largest atlas. ``report`` takes one finding when lights do not fit.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        textures: TextureCache,
        *,
        samples: int = 16,
        limit: int = 8192,
        report: Report | None = None,
        place: SourceRef | None = None,
    ) -> None:
        if samples % 4:
            raise ValueError(f"{samples} samples; want a multiple of 4")
        self.ctx = ctx
        self.samples = samples
        self.limit = min(limit, int(ctx.info["GL_MAX_TEXTURE_SIZE"]))
        self.casters = Casters(ctx, programs, textures, report, place)
        self.left_out: npt.NDArray[np.intp] = np.zeros(0, np.intp)
        self._drawing = TileDrawing(ctx, programs)
        self._report, self._place = report, place or SourceRef(Path())
        self._lamps: dict[int, _Lamp] = {}
        self._atlas = Atlas(0, 0)
        self._rounding = 0.0
        self._said = False

    @property
    def defines(self) -> dict[str, int]:
        """For every program that includes shadow.glsl."""
        return {"SAMPLES": self.samples}

    def uniforms(self, kind: str) -> dict[str, float | Floats]:
        """For a program of this kind, beside the unit of ``shadow_atlas``."""
        aspect = self._atlas.width / max(self._atlas.height, 1)
        values: dict[str, float | Floats] = {
            "shadow_rounding": self._rounding,
            "shadow_aspect": aspect,
        }
        for word in kind.split()[1:]:
            values["shadow_samples"] = pattern(word, self.samples).astype(np.float32)
        return values

    def use(self, unit: int) -> None:
        """Bind the atlas for ``sampler2DShadow shadow_atlas``."""
        self._drawing.use(unit)

    def release(self) -> None:
        """Give the GPU's memory back."""
        release(self.casters, self._drawing)

    def update(self, scene: RenderScene) -> Shadows:
        """Draw what has changed for this moment's lights, casters and camera.

        Binds the context's resting framebuffer; changes textures and states of OpenGL.
        """
        if self.casters.update(scene):
            self._lamps.clear()
        lights = scene.lights
        wanted = (lights["shadow"] > 0) & np.any(lights["intensity"] > 0.0, axis=1)
        bounds = self.casters.bounds()
        # Roundings of a caster's place: the place, four products and their sums.
        self._rounding = float(np.max(np.abs(bounds))) * 2.0**-22
        lamps = self._current(scene, np.flatnonzero(wanted), bounds)
        self._look(lamps)
        keys = {int(lights["key"][i]) for i in lamps}
        for key in self._lamps.keys() - keys:
            del self._lamps[key]
        lamps = {i: lamp for i, lamp in lamps.items() if lamp.faces.any()}
        sizes = self._sizes(scene, lamps)
        self._find_left_out(scene, [i for i in lamps if not sizes[i]], len(lamps))
        lamps = {i: lamp for i, lamp in lamps.items() if sizes[i]}
        self._settle({int(lights["key"][i]): (lamp, sizes[i]) for i, lamp in lamps.items()})
        self._draw(list(lamps.values()))
        kind = np.full(len(lights), "", "U40")
        rows = np.zeros((len(lights), 6, 4), np.float32)
        for i, lamp in lamps.items():
            assert lamp.place is not None
            block, x, y = lamp.place
            data = lamp.view.data(block.cell, (x, y), self._atlas.size)
            kind[i], rows[i, : len(data)] = lamp.full.kind, data
        return Shadows(kind, rows)

    def _current(
        self, scene: RenderScene, wanted: npt.NDArray[np.intp], bounds: Doubles
    ) -> dict[int, _Lamp]:
        """The lamps by the numbers of their lights; those that changed anew."""
        still = self.casters.bounds(moving=False)
        extent = float(np.linalg.norm(still[1] - still[0])) or 1.0
        small = min(SMALL_LIGHT, extent / 100.0)
        # Depth is 1 - near / distance in 24 bits: fine enough up to the other end of the scene.
        near = min(0.05, 1e-4 * extent)
        current: dict[int, _Lamp] = {}
        for i in wanted:
            light = scene.lights[i]
            key, old = int(light["key"]), self._lamps.get(int(light["key"]))
            signature = b"".join(light[name].tobytes() for name in _SEEN_FROM)
            full: View | DistantView
            if light["w"] <= 0.0:
                origin = self.casters.origin
                full = distant_view(light, scene.camera, origin, bounds, self.samples)
                signature += full.signature()
            elif old is None or old.signature != signature:
                full = local_view(
                    light,
                    self.casters.origin,
                    scene.profiles,
                    samples=self.samples,
                    small=small,
                    near=near,
                )
            if old is None or old.signature != signature:
                block = Block(_SMALLEST, len(full.faces))
                outlines = _tiles(full, int(light["shadow_link"]), block, 0, 0)
                seen = _see(outlines, self.casters.still)
                lamp = _Lamp(signature, full, _faces(full, seen), outlines)
                if old is not None:
                    lamp.place, lamp.moves = old.place, True
                self._lamps[key] = lamp
            elif isinstance(old.full, DistantView):
                old.full = full  # its data are relative to the eye
            current[int(i)] = self._lamps[key]
        return current

    def _look(self, lamps: dict[int, _Lamp]) -> None:
        """Which tiles see something that moves; their faces are in use from now on."""
        parts = [lamp.outlines for lamp in lamps.values()]
        if not parts or not self.casters.moving:
            for lamp in lamps.values():
                lamp.sees = None
            return
        seen = _see(join(parts), self.casters.moving)
        ends = np.cumsum([len(part) for part in parts])
        for lamp, own in zip(lamps.values(), np.split(seen, ends[:-1]), strict=True):
            lamp.sees = own
            faces = lamp.faces | _faces(lamp.full, own)
            if not np.array_equal(faces, lamp.faces):
                lamp.faces = faces
                lamp.drawn, lamp.saw = False, None

    def _sizes(self, scene: RenderScene, lamps: dict[int, _Lamp]) -> dict[int, int]:
        """Texels of each light's tiles by what it gives where the camera is; 0: no room."""
        if not lamps:
            return {}
        lights = scene.lights[list(lamps)]
        local = lights["w"] > 0.0
        power = _power(lights, scene)
        away = np.linalg.norm(lights["position"] - scene.camera.eye, axis=1)
        importance = np.sqrt(power) / np.maximum(np.maximum(away, lights["radius"]), 1e-3)
        importance = np.clip(importance, 1e-30, 1e30)
        importance[~local] = 4.0 * np.max(importance[local], initial=1.0)
        blocks = [lamp.block(1) for lamp in lamps.values()]
        columns = np.array([block.columns for block in blocks])
        rows = np.array([block.rows for block in blocks])
        largest = np.array([_LARGEST[lamp.full.kind.split()[0]] for lamp in lamps.values()])
        largest = np.where(rows > 1, largest // _SAMPLED, largest)
        room = 2 ** np.floor(np.log2(np.maximum(self.limit // columns, 1))).astype(np.int64)
        held = np.array([lamp.place is not None for lamp in lamps.values()])
        sizes = tile_sizes(
            importance, np.minimum(largest, room), columns, rows, self.limit, _SMALLEST, held
        )
        return dict(zip(lamps, sizes.tolist(), strict=True))

    def _find_left_out(self, scene: RenderScene, left_out: list[int], among: int) -> None:
        self.left_out = np.array(left_out, np.intp)
        if not left_out or self._report is None or self._said:
            return
        self._said = True
        first = scene.lights[left_out[:3]]
        listed = ", ".join(
            f"({', '.join(f'{v:.6g}' for v in light['position'])}) m with {power:.3g} cd"
            if light["w"] > 0.0
            else f"a distant one with {power:.3g} lx"
            for light, power in zip(first, _power(first, scene), strict=True)
        )
        more = ", ..." if len(left_out) > 3 else ""
        text = (
            f"{len(left_out)} of {among} lights shine without shadows in the first such frame: no "
            f"room in a shadow map of {self.limit} x {self.limit}; at {listed}{more}"
        )
        self._report.add(Kind.DROPPED, "shadow-budget", self._place, "", text)

    def _settle(self, wanted: dict[int, tuple[_Lamp, int]]) -> None:
        """A place in the atlas for each; who gets another one must be drawn anew."""
        blocks = {key: lamp.block(cell) for key, (lamp, cell) in wanted.items()}
        size = smallest_atlas(Counter(blocks.values()), self._atlas.size, self.limit)
        if size != self._atlas.size:
            self._atlas = Atlas(*size)
        lost = self._drawing.resize(size)
        lost = not self._atlas.keep(blocks) or lost
        for key in self._lamps.keys() - blocks.keys():
            self._lamps[key].place = None
        for key, (lamp, _) in wanted.items():
            place = self._atlas.places[key]
            if lost or place != lamp.place or not lamp.drawn:
                lamp.place, lamp.drawn = place, False
                lamp.tiles = _tiles(lamp.view, int(lamp.outlines.links[0]), *place)

    def _draw(self, lamps: list[_Lamp]) -> None:
        """What has changed in the tiles."""
        anew: list[Tiles] = []
        keep: list[Tiles] = []
        again: list[Tiles] = []
        for lamp in lamps:
            assert lamp.tiles is not None
            sees = np.zeros(len(lamp.tiles), np.bool_)
            if lamp.sees is not None:
                sees = lamp.of_view(lamp.sees)
            fresh = not lamp.drawn or lamp.saw is None
            if fresh:
                lamp.kept = False
            changed = sees if lamp.saw is None else sees | lamp.saw
            if fresh and (lamp.moves or not sees.any()):
                # A light that moves is drawn anew each time: worth keeping are those that rest.
                anew.append(lamp.tiles)
            elif changed.any():
                if not lamp.kept:
                    keep.append(lamp.tiles)
                    lamp.kept = True
                again.append(lamp.tiles if fresh else lamp.tiles[changed])
            lamp.drawn, lamp.saw = True, sees
        if anew:
            self._drawing.draw(join(anew), [*self.casters.still, *self.casters.moving])
        if keep:
            self._drawing.keep(join(keep), self.casters.still)
        if again:
            self._drawing.redraw(join(again), self.casters.moving)


def _power(lights: Lights, scene: RenderScene) -> Doubles:
    """(n,) cd or lux of the brightest channel, in the brightest direction."""
    power: Doubles = np.max(lights["intensity"], axis=1)
    for number, profile in enumerate(scene.profiles):
        power[lights["profile"] == number] *= np.max(profile.candela, initial=0.0)
    return power


def _faces(view: View | DistantView, seen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """(f,) faces of which any tile has a flag; of a distant light all or none."""
    faces = np.asarray(seen.reshape(-1, len(view.faces)).any(axis=0))
    return faces if isinstance(view, View) else np.full(len(faces), bool(faces.any()))


def _see(tiles: Tiles, groups: list[Group]) -> npt.NDArray[np.bool_]:
    """(t,) the tiles that see any caster of the groups."""
    seen = np.zeros(len(tiles), np.bool_)
    for group in groups:
        # So many tiles at a time that the flags of all boxes stay small.
        some = max(20_000_000 // max(len(group.boxes), 1), 1)
        for first in range(0, len(tiles), some):
            block = slice(first, first + some)
            seen[block] |= seen_by(tiles[block], group).any(axis=1)
    return seen


def _tiles(view: View | DistantView, link: int, block: Block, left: int, bottom: int) -> Tiles:
    """The tiles of a view in its block: sample points in rows, the faces of each together."""
    cell, faces = block.cell, len(view.faces)
    number = np.arange(view.points * faces)
    point, face = number // faces, number % faces
    across = view.points // view.rows
    squares = np.stack(
        [
            left + cell * (point % across * faces + face),
            bottom + cell * (point // across),
            np.full(len(number), cell),
        ],
        axis=1,
    )
    return Tiles(
        matrices=view.matrices(cell),
        balls=view.balls(),
        tangents=np.full(len(number), view.tangents(cell)),
        squares=squares.astype(np.float64),
        links=np.full(len(number), link, np.int64),
    )
