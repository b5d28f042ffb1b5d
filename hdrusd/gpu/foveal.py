"""The foveal image of a frame on the GPU; its definition is eye.foveal.foveal.

Every pixel is fetched once, along rows into a texture of fw x h; its columns and the single
pixels cost little beside that. On llvmpipe (two 2.5 GHz cores) at 1920x1080 that is 12 ms of
CPU time; NumPy takes 58 ms once the frame is read. The pixels that every sample has across are
a constant of the program, not a uniform: the loop is unrolled then, and a quarter faster.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.eye.foveal import POINTS, Foveal, grid, point_pixels
from hdrusd.gpu.program import Programs, set_uniforms
from hdrusd.gpu.source import Defines


class _Targets:
    """What one size of frame in one field of view needs."""

    def __init__(
        self, ctx: moderngl.Context, frame: tuple[int, int], size: tuple[int, int]
    ) -> None:
        self.of = frame, size
        places = point_pixels(*frame, size)
        # Any shape will do that holds them in their order, without a row too many.
        across = frame[0] if len(places) == frame[0] * frame[1] else POINTS * size[0]
        shape = across, len(places) // across
        self.places = ctx.texture(
            shape, 2, places.astype(np.uint16).tobytes(), dtype="u2", alignment=1
        )
        self.sums = ctx.texture((size[0], frame[1]), 4, dtype="f4")
        textures = self.sums, ctx.texture(size, 4, dtype="f4"), ctx.texture(shape, 1, dtype="f4")
        for texture in (self.places, *textures):
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self._textures = (self.places, *textures)
        self.rows, self.samples, self.points = (ctx.framebuffer([t]) for t in textures)

    def release(self) -> None:
        for item in (self.rows, self.samples, self.points, *self._textures):
            item.release()


class FovealSampler:
    """Samples textures of any size; targets of the last size and field are kept."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self._sampler = ctx.sampler(
            repeat_x=False, repeat_y=False, filter=(moderngl.NEAREST, moderngl.NEAREST)
        )
        self._targets: _Targets | None = None

    def sample(
        self, hdr: moderngl.Texture, field: tuple[float, float], *, top_first: bool = False
    ) -> Foveal:
        """The foveal image of an RGB(A) float texture in cd/m2; ``field`` in degrees.

        Row 0 of the texture is the frame's bottom one, unless ``top_first``. NaN and negative
        channels count as 0, infinity as colour.BRIGHTEST. In float32: off by at most a rounding
        for each pixel along two sides of a sample.
        """
        width, height = hdr.size
        fw, fh = size = grid(width, height, field)
        targets = self._targets_of(hdr.size, size)
        texel = (1.0 / width, 1.0 / height)
        rows = {"top_row": 0 if top_first else height - 1, "row_step": 1 if top_first else -1}
        hdr.use(0)
        targets.places.use(1)
        self._sampler.use(0)
        frame = {"hdr": 0, "texel": texel}
        across = {"width": width, "samples": fw}
        self._draw("foveal_rows", targets.rows, {**frame, **across}, {"EACH": width // fw})
        self._draw("foveal_points", targets.points, {**frame, "places": 1, **rows})
        self._sampler.clear(0)
        targets.sums.use(0)
        sizes = {"width": width, "height": height, "samples_x": fw, "samples_y": fh}
        self._draw("foveal_columns", targets.samples, {"sums": 0, **sizes, **rows})
        rgb = _read(targets.samples, 4).reshape(fh, fw, 4)[..., :3]
        points = _read(targets.points, 1)
        return Foveal(rgb.astype(np.float64), points.astype(np.float64), field)

    def release(self) -> None:
        """Free the targets."""
        if self._targets is not None:
            self._targets.release()
            self._targets = None

    def _targets_of(self, frame: tuple[int, int], size: tuple[int, int]) -> _Targets:
        if self._targets is None or self._targets.of != (frame, size):
            self.release()
            self._targets = _Targets(self.ctx, frame, size)
        return self._targets

    def _draw(
        self,
        name: str,
        target: moderngl.Framebuffer,
        values: dict[str, Any],
        defines: Defines | None = None,
    ) -> None:
        vertices = self.programs.fullscreen(f"gpu/shaders/{name}.frag", defines)
        set_uniforms(vertices.program, values)
        with self.ctx.scope(target, moderngl.NOTHING):
            vertices.render(vertices=3)


def _read(target: moderngl.Framebuffer, components: int) -> npt.NDArray[np.float32]:
    return np.frombuffer(target.read(components=components, dtype="f4", alignment=1), np.float32)
