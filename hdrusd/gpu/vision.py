"""Acuity on the GPU: a frame as finely as the eye resolves it; the definition is eye/acuity.py.

A pixel's level of the mip chain is bilinear between four samples of the foveal image, so the
frame is drawn as the rectangles between samples, each with its four levels: no texture is read
for them, rectangles that stay sharp are left out, and the others are drawn once for each pair
of levels that they need. Shares of texels are by hand, as filters keep 8 bits of them.
Chosen by time on llvmpipe (two 2.5 GHz cores), processor time at 1920x1080: 140 ms where all
of a frame is blurred, of which 40 ms are for its storing and 20 ms for the chain.
"""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.eye.acuity import acuity_levels, top_level
from hdrusd.eye.foveal import Foveal
from hdrusd.gpu.program import Programs, set_uniforms
from hdrusd.gpu.source import Defines

Floats = npt.NDArray[np.float32]

_VERTEX, _FRAGMENT = "gpu/shaders/acuity.vert", "gpu/shaders/acuity.frag"

#: Levels by which an interpolated one may be off.
_ROUNDING = 1e-4


class AcuityPass:
    """Blurs frames of any size; textures of the last size are kept."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self._sampler = ctx.sampler(
            repeat_x=False, repeat_y=False, filter=(moderngl.NEAREST, moderngl.NEAREST)
        )
        self._size = (0, 0)
        self._result: moderngl.Framebuffer | None = None
        self._levels: list[moderngl.Framebuffer] = []  # from level 1 on
        self._cells = ctx.buffer(reserve=40, dynamic=True)
        self._vaos: dict[moderngl.Program, moderngl.VertexArray] = {}

    def apply(
        self, hdr: moderngl.Texture, foveal: Foveal, *, top_first: bool = False
    ) -> moderngl.Texture:
        """RGBA32F of an RGBA32F texture, cd/m2, valid until the next one; or ``hdr`` itself.

        ``foveal``: of this frame, both with the eye's veil. The texture's row 0 is the bottom
        one, as OpenGL draws it, unless ``top_first``. Alpha, which may be a luminance too, is
        blurred alike. NaN and negative colours count as 0; where a frame stays sharp they stay.
        """
        if hdr.components != 4:
            raise ValueError(f"a texture of {hdr.components} components; want RGBA")
        samples = acuity_levels(foveal, hdr.size)
        if samples is None or samples.max() <= 0.0:
            return hdr
        self._reserve(hdr.size)
        assert self._result is not None
        row = (0.0, 1.0) if top_first else (hdr.height, -1.0)
        last = min(math.floor(samples.max()), top_level(hdr.size) - 1)
        chain = [hdr, *self._halve(hdr, last + 1, row)]
        cells = _cells(samples if top_first else samples[::-1], hdr.size)
        least, most = cells[:, 4:8].min(axis=1), cells[:, 4:8].max(axis=1)
        # What the rasteriser interpolates may round past a corner's level, to a level beside.
        floor, ceiling = np.floor(least - _ROUNDING), np.floor(most + _ROUNDING)
        if not (most > 0.0).all():
            source = self.ctx.framebuffer([hdr])
            self.ctx.copy_framebuffer(self._result, source)
            source.release()
        density = samples.shape[1] / hdr.width, samples.shape[0] / hdr.height
        shared = {"size": hdr.size, "last": last, "density": density, "row": row}
        with self.ctx.scope(self._result, moderngl.NOTHING):
            for number in range(last + 1):
                below = number == 0 or np.minimum(ceiling, last) >= number
                chosen = (most > 0.0) & below & (np.minimum(floor, last) <= number)
                self._draw(cells[chosen], number, chain[number : number + 2], shared)
        return _texture(self._result)

    def release(self) -> None:
        """Free the textures and buffers."""
        self._reserve((0, 0))
        for vao in self._vaos.values():
            vao.release()
        self._vaos.clear()
        self._cells.release()
        self._sampler.release()

    def _draw(
        self,
        cells: Floats,
        number: int,
        levels: list[moderngl.Texture],
        shared: dict[str, Any],
    ) -> None:
        """Cells that may have pixels between level ``number`` and the next."""
        if self._cells.size < cells.nbytes:
            self._cells.orphan(2 * cells.nbytes)
        self._cells.write(cells)
        defines: Defines = {"FIRST": 1} if number == 0 else {}
        program = self.programs.get(_VERTEX, _FRAGMENT, defines)
        if program not in self._vaos:
            content = (self._cells, "4f 4f 2f /i", "in_area", "in_corners", "in_cell")
            self._vaos[program] = self.ctx.vertex_array(program, [content])
        own = {"number": number, "scale": 0.5**number}
        set_uniforms(program, shared | own)
        for unit, (name, texture) in enumerate(zip(("fine", "coarse"), levels, strict=True)):
            set_uniforms(program, {name: unit, f"{name}_texel": _texel(texture)})
            texture.use(unit)
            self._sampler.use(unit)
        self._vaos[program].render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(cells))
        for unit in range(len(levels)):
            self._sampler.clear(unit)

    def _halve(
        self, hdr: moderngl.Texture, count: int, row: tuple[float, float]
    ) -> list[moderngl.Texture]:
        """Levels 1 to ``count`` of the mip chain, top row first."""
        while len(self._levels) < count:
            width, height = self._levels[-1].size if self._levels else self._size
            texture = self.ctx.texture((-(-width // 2), -(-height // 2)), 4, dtype="f4")
            self._levels.append(self.ctx.framebuffer([texture]))
        source = hdr
        self._sampler.use(0)
        for target in self._levels[:count]:
            first = source is hdr
            defines: Defines = {"CLEAN": 1} if first else {}
            vertices = self.programs.fullscreen("gpu/shaders/halve.frag", defines)
            place = {"row": row if first else (0.0, 1.0), "texel": _texel(source)}
            set_uniforms(vertices.program, {"image": 0, **place})
            source.use(0)
            with self.ctx.scope(target, moderngl.NOTHING):
                vertices.render(vertices=3)
            source = _texture(target)
        self._sampler.clear(0)
        return [_texture(target) for target in self._levels[:count]]

    def _reserve(self, size: tuple[int, int]) -> None:
        if size == self._size:
            return
        for target in [*self._levels, *([self._result] if self._result else [])]:
            _texture(target).release()
            target.release()
        self._size, self._levels, self._result = size, [], None
        if all(size):
            texture = self.ctx.texture(size, 4, dtype="f4")
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
            self._result = self.ctx.framebuffer([texture])


def _cells(samples: npt.NDArray[np.float64], size: tuple[int, int]) -> Floats:
    """((fw + 1) (fh + 1), 10): area, levels of the corners, column and row, as acuity.vert has.

    ``samples`` (fh, fw), the row of texture row 0 first. Those outside have the outermost level.
    """
    fh, fw = samples.shape
    x, y = (
        np.clip((np.arange(count + 2) - 0.5) / count, 0.0, 1.0) * side
        for count, side in zip((fw, fh), size, strict=True)
    )
    levels = np.pad(samples, 1, mode="edge")
    column, row = np.meshgrid(np.arange(fw + 1), np.arange(fh + 1))
    area = [x[column], y[row], x[column + 1], y[row + 1]]
    corners = [levels[row + j, column + i] for j in (0, 1) for i in (0, 1)]
    parts = np.stack([*area, *corners, column - 1.0, row - 1.0], axis=-1)
    return parts.reshape(-1, 10).astype(np.float32)


def _texel(texture: moderngl.Texture) -> tuple[float, float]:
    return 1.0 / texture.width, 1.0 / texture.height


def _texture(target: moderngl.Framebuffer) -> moderngl.Texture:
    (texture,) = target.color_attachments
    assert isinstance(texture, moderngl.Texture)
    return texture
