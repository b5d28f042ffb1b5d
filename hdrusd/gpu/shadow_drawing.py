"""Casters drawn into the tiles of the shadow atlas.

An instance of a draw call is a tile, so that their number does not multiply the number of
calls: matrices come from a texture, and clip distances keep each tile to itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.casters import TABLE, Group, Run
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.shadow_views import frustum_sees
from hdrusd.gpu.surfaces import set_used

Doubles = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]

#: Tiles drawn together: bounds the memory that their matrices take.
_TOGETHER = 256

#: Instances drawn together, or one tile's: the rest of what bounds it.
_PAIRS = 250_000

#: Texels of a tile's row in the table (shadow.vert).
_ROW = 6

#: GL_CLIP_DISTANCE0 to 4, which moderngl has no names for.
_CLIP_DISTANCES = range(0x3000, 0x3005)


@dataclass(frozen=True, slots=True, eq=False)
class Tiles:
    """Tiles, one a row: squares of the atlas and what is seen through them."""

    matrices: Doubles  # (t, 4, 4) row-vector, from the casters' origin to clip space
    balls: Doubles  # (t, 4) the tile's eye from the lamp in its frame; lamp's radius squared
    tangents: Doubles  # (t,)
    squares: Doubles  # (t, 3) left, bottom, side in texels
    links: npt.NDArray[np.int64]  # (t,) the shadow link of its light, 0 for everything

    def __len__(self) -> int:
        return len(self.links)

    def __getitem__(self, which: Any) -> Tiles:
        return Tiles(
            self.matrices[which],
            self.balls[which],
            self.tangents[which],
            self.squares[which],
            self.links[which],
        )

    def table(self, size: tuple[int, int]) -> Doubles:
        """(t, 6, 4) rows of the table that shadow.vert reads."""
        rows = np.empty((len(self), _ROW, 4))
        rows[:, :4] = self.matrices.swapaxes(1, 2)
        half = self.squares[:, 2:] / 2.0
        rows[:, 4, :2] = (self.squares[:, :2] + half) * (2.0 / np.asarray(size)) - 1.0
        rows[:, 4, 2:] = np.concatenate([half * (2.0 / size[0]), self.tangents[:, None]], axis=1)
        rows[:, 5] = self.balls
        return rows


def join(parts: Sequence[Tiles]) -> Tiles:
    """The tiles of all, in order."""
    names = ("matrices", "balls", "tangents", "squares", "links")
    return Tiles(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def seen_by(tiles: Tiles, group: Group) -> Booleans:
    """(t, b): whether a tile sees a box of the group, and its light's link lets it cast."""
    allowed = group.named[tiles.links][:, group.kinds]
    seen: Booleans = allowed & frustum_sees(tiles.matrices, group.boxes)
    return seen


@dataclass(frozen=True, slots=True, eq=False)
class _Target:
    texture: moderngl.Texture
    framebuffer: moderngl.Framebuffer

    def release(self) -> None:
        self.framebuffer.release()
        self.texture.release()


class TileDrawing:
    """The atlas on the GPU: what is shown; and, of tiles that need it, what stands still."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self.size = (0, 0)
        self._shown: _Target | None = None
        self._kept: _Target | None = None
        self._blank: _Target | None = None
        self._squares: dict[moderngl.Program, moderngl.VertexArray] = {}

    def use(self, unit: int) -> None:
        """Bind the atlas; one lit texel where there is none."""
        target = self._shown
        if target is None:
            if self._blank is None:
                self._blank = self._target((1, 1))
                self._blank.framebuffer.clear(depth=1.0)
            target = self._blank
        target.texture.use(unit)

    def release(self) -> None:
        """Give the GPU's memory back."""
        release(self._shown, self._kept, self._blank, self._squares)
        self.size, self._shown, self._kept, self._blank = (0, 0), None, None, None
        self._squares.clear()

    def resize(self, size: tuple[int, int]) -> bool:
        """Make room; True where what was drawn is lost."""
        if size == self.size:
            return False
        for old in (self._shown, self._kept):
            if old is not None:
                old.release()
        self.size, self._shown, self._kept = size, self._target(size), None
        return True

    def draw(self, tiles: Tiles, groups: Sequence[Group]) -> None:
        """Tiles anew."""
        if self._shown is not None:
            self._draw(self._shown, tiles, groups, {})

    def keep(self, tiles: Tiles, groups: Sequence[Group]) -> None:
        """For ``redraw``: tiles with what stands still."""
        if self._kept is None:
            self._kept = self._target(self.size)
            self._kept.texture.compare_func = ""
        self._draw(self._kept, tiles, groups, {})

    def redraw(self, tiles: Tiles, groups: Sequence[Group]) -> None:
        """Tiles as they were kept, and what moves."""
        if self._shown is not None:
            self._draw(self._shown, tiles, groups, {"RESTORE": 1})

    def _target(self, size: tuple[int, int]) -> _Target:
        texture = self.ctx.depth_texture(size)
        texture.compare_func = "<="
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        return _Target(texture, self.ctx.framebuffer(depth_attachment=texture))

    def _draw(
        self,
        target: _Target,
        tiles: Tiles,
        groups: Sequence[Group],
        start: dict[str, int],
    ) -> None:
        ctx = self.ctx
        ctx.enable_only(moderngl.DEPTH_TEST)
        boxes = max(sum(len(group.boxes) for group in groups), 1)
        together = min(max(_PAIRS // boxes, 1), _TOGETHER)
        for first in range(0, len(tiles), together):
            some = tiles[first : first + together]
            table = _Table(some.table(self.size))
            calls = [
                (run, table.add(run))
                for group in groups
                for run in group.runs(seen_by(some, group), some.matrices)
            ]
            textures = table.upload(ctx)
            target.framebuffer.use()
            self._start(len(some), start)
            ctx.depth_func = "<"
            try:
                for distance in _CLIP_DISTANCES:
                    ctx.enable_direct(distance)
                for run, at in calls:
                    self._call(run, at)
            finally:
                for distance in _CLIP_DISTANCES:
                    ctx.disable_direct(distance)
                for texture in textures:
                    texture.release()
                # A bound framebuffer must not be the one that ``resize`` releases.
                ctx.extra["framebuffer"].use()

    def _start(self, count: int, start: dict[str, int]) -> None:
        """Each tile filled: with the far plane, or with what was kept."""
        program = self.programs.get(
            "gpu/shaders/shadow.vert",
            "gpu/shaders/shadow.frag",
            {"TABLE": TABLE, "TILES": 1} | start,
        )
        self._uniforms(program, 0)
        if "RESTORE" in start and self._kept is not None:
            self._kept.texture.use(2)
            set_used(program, "kept", 2)
        if program not in self._squares:
            self._squares[program] = self.ctx.vertex_array(program, [])
        self.ctx.depth_func = "1"
        self._squares[program].render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)

    def _call(self, run: Run, first: int) -> None:
        cutout = run.cutout
        program = run.vao.program
        self._uniforms(program, first)
        if cutout is not None:
            cutout.texture.use(2)
            set_used(program, "opacity_image", 2)
            for name in ("channel", "scale", "bias", "threshold"):
                set_used(program, name, getattr(cutout, name))
        run.vao.render(
            moderngl.TRIANGLES, vertices=run.count, first=run.first, instances=len(run.tiles)
        )

    def _uniforms(self, program: moderngl.Program, first: int) -> None:
        aspect = self.size[0] / self.size[1]
        for name, value in (("tiles", 0), ("pairs", 1), ("first", first), ("aspect", aspect)):
            set_used(program, name, value)


class _Table:
    """Rows for shadow.vert and which of them each instance reads."""

    def __init__(self, tiles: Doubles) -> None:
        self._tiles = tiles
        self._rows = [tiles]
        self._pairs: list[npt.NDArray[np.intp]] = [np.arange(len(tiles))]
        self._row_count = self._pair_count = len(tiles)

    def add(self, run: Run) -> int:
        """Where the instances of a call begin."""
        first = self._pair_count
        pairs = run.tiles
        if run.matrices is not None:
            rows = self._tiles[run.tiles]
            rows[:, :4] = run.matrices.swapaxes(1, 2)
            self._rows.append(rows)
            pairs = np.arange(self._row_count, self._row_count + len(rows))
            self._row_count += len(rows)
        self._pairs.append(pairs)
        self._pair_count += len(pairs)
        return first

    def upload(self, ctx: moderngl.Context) -> tuple[moderngl.Texture, moderngl.Texture]:
        """Textures of both, on units 0 and 1."""
        rows = np.concatenate(self._rows).reshape(-1, 4).astype(np.float32)
        pairs = np.concatenate(self._pairs).astype(np.int32)[:, None]
        textures = _texels(ctx, rows, "f4"), _texels(ctx, pairs, "i4")
        for unit, texture in enumerate(textures):
            texture.use(unit)
        return textures


def _texels(ctx: moderngl.Context, data: npt.NDArray[Any], dtype: str) -> moderngl.Texture:
    width = 1 << TABLE
    height = -(-len(data) // width)
    padded = np.zeros((height * width, data.shape[1]), data.dtype)
    padded[: len(data)] = data
    texture = ctx.texture((width, height), data.shape[1], padded, dtype=dtype)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
