"""Supersampling: a frame as the mean of several whose pixel grids are shifted.

The pixel filter is a box of one pixel: a pixel's value is the mean luminance over its
square, which is what a luminance meter with a square field would read. No wider
filter is offered; it would spread a lamp's luminance over its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import gcd

import moderngl

from hdrusd.gpu.blending import blending
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.scene import Camera


def offsets(samples: int) -> Iterator[tuple[float, float]]:
    """Places inside a pixel, from -0.5 to 0.5: a lattice near the golden ratio.

    Both coordinates are evenly spread and their mean is 0, so that one sample is the
    pixel's centre.
    """
    step = next(
        near
        for distance in range(samples + 1)
        for near in (round(samples * 0.618034) + distance, round(samples * 0.618034) - distance)
        if near > 0 and gcd(near, samples) == 1
    )
    for i in range(samples):
        yield (i + 0.5) / samples - 0.5, (i * step % samples + 0.5) / samples - 0.5


def shifted(camera: Camera, offset: tuple[float, float], size: tuple[int, int]) -> Camera:
    """The camera whose pixel centres are where ``offset`` (pixels) was in the pixels of this."""
    left, right, bottom, top = camera.window
    x = offset[0] * (right - left) / size[0]
    y = offset[1] * (top - bottom) / size[1]
    return replace(camera, window=(left + x, right + x, bottom + y, top + y))


class Accumulator:
    """The sum of frames on the GPU."""

    def __init__(self, ctx: moderngl.Context, programs: Programs, size: tuple[int, int]) -> None:
        self.ctx = ctx
        self.programs = programs
        self.texture = ctx.texture(size, 4, dtype="f4")
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.frame = ctx.framebuffer([self.texture])

    def release(self) -> None:
        """Give its memory back."""
        release(self.frame, self.texture)

    def clear(self) -> None:
        """Begin anew."""
        self.frame.clear()

    def add(self, frame: moderngl.Texture, weight: float) -> None:
        """Add ``weight`` times a frame of the same size."""
        vao = self.programs.fullscreen("gpu/shaders/accumulate.frag")
        frame.use(0)
        vao.program["frame"], vao.program["weight"] = 0, weight
        with blending(self.ctx, self.frame):
            vao.render(moderngl.TRIANGLES, vertices=3)
