"""Blurred luminance for local operators; the definition is tonemap.operator.blurred.

Four kernels at a time, a vec4 of weights a tap: what costs is to fetch, not to weigh.
"""

from __future__ import annotations

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.program import Programs, set_uniforms
from hdrusd.gpu.tables import Tables
from hdrusd.tonemap.operator import Array

#: Kernels of a texture, and textures that shader 2 has samplers for.
FOUR, MOST = 4, 16


class BlurPass:
    """Separable blurs of a frame's luminance; targets of the last size are kept."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self._tables = Tables(ctx)
        self._targets: list[moderngl.Framebuffer] = []
        self._size = (0, 0)

    def apply(self, hdr: moderngl.Texture, kernels: tuple[Array, ...]) -> list[moderngl.Texture]:
        """RGBA32F textures, four kernels each, of an RGB(A) float texture in cd/m2."""
        if len(kernels) > MOST:
            raise ValueError(f"{len(kernels)} kernels; want {MOST} at most")
        count = -(-len(kernels) // FOUR)
        self._reserve(hdr.size, count + 1)
        between, *results = self._targets
        for i, result in enumerate(results):
            weights = _together(kernels[FOUR * i : FOUR * (i + 1)])
            self._draw(hdr, weights, between, {"LUMINANCE": 1}, (1, 0))
            self._draw(_texture(between), weights, result, {}, (0, 1))
        return [_texture(result) for result in results]

    def release(self) -> None:
        """Free the textures."""
        self._reserve((0, 0), 0)
        self._tables.release()

    def _draw(
        self,
        source: moderngl.Texture,
        weights: npt.NDArray[np.float32],
        target: moderngl.Framebuffer,
        defines: dict[str, int],
        step: tuple[int, int],
    ) -> None:
        taps = weights.shape[1]
        vertices = self.programs.fullscreen("gpu/shaders/blur.frag", defines)
        last = source.width - 1, source.height - 1
        set_uniforms(vertices.program, {"source": 0, "last": last, "step_": step, "taps": taps})
        source.use(0)
        self._tables.use(vertices.program, {"weights": weights}, 1)
        with self.ctx.scope(target, moderngl.NOTHING):
            vertices.render(vertices=3)

    def _reserve(self, size: tuple[int, int], count: int) -> None:
        if self._size != size or len(self._targets) != count:
            for target in self._targets:
                _texture(target).release()
                target.release()
            self._size = size
            self._targets = [
                self.ctx.framebuffer([self.ctx.texture(size, 4, dtype="f4")]) for _ in range(count)
            ]
            for target in self._targets:
                _texture(target).filter = moderngl.NEAREST, moderngl.NEAREST


def _texture(target: moderngl.Framebuffer) -> moderngl.Texture:
    (texture,) = target.color_attachments
    assert isinstance(texture, moderngl.Texture)
    return texture


def _together(kernels: tuple[Array, ...]) -> npt.NDArray[np.float32]:
    """Weights (1, taps, 4) of up to four kernels, centred on the longest."""
    longest = max(kernel.size for kernel in kernels)
    weights = np.zeros((1, longest, FOUR), np.float32)
    for i, kernel in enumerate(kernels):
        start = (longest - kernel.size) // 2
        weights[0, start : start + kernel.size, i] = kernel
    return weights
