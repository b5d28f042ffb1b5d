"""Surfaces that let something through, by depth peeling (Everitt 2001).

Layer by layer, from the eye on: each has a G-buffer of its own, in which every pixel shows
the nearest blended surface behind the layer before, and is lit as the opaque surfaces are.
Then it goes under what is in front of it (the "under" operator of Porter and Duff 1984,
premultiplied). So the order of the draws does not matter, and surfaces may cross.

    for layer in peeling.layers(scene, surfaces, g_normal):
        lights.add(scene, layer.textures, layer.frame)
    peeling.merge(frame)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.blending import blending
from hdrusd.gpu.program import Programs
from hdrusd.gpu.surfaces import Between, SurfacePass, set_used
from hdrusd.scene import RenderScene

#: What lies behind so many blended surfaces is not shown.
MAX_LAYERS = 8

#: A distance in front of everything.
_NOWHERE = np.array([0.0, 0.0, 0.0, -3e38], np.float32)


@dataclass(frozen=True, slots=True)
class Layer:
    """The G-buffer of one layer, empty where it has no surface."""

    textures: dict[str, moderngl.Texture]  # by the names of their samplers
    hdr: moderngl.Texture
    gbuffer: moderngl.Framebuffer
    frame: moderngl.Framebuffer  # ``hdr`` alone, with the depth of the layer


class Peeling:
    """The layers of one frame after the other, and what they look like together.

    ``extra``: the G-buffers have g_extra.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        size: tuple[int, int],
        *,
        extra: bool = False,
    ) -> None:
        self.ctx = ctx
        self.extra = extra
        self.truncated = False  # whether the last frame had more than ``MAX_LAYERS``
        names = ("g_diffuse", "g_specular", *(("g_extra",) if extra else ()))
        shared = {name: _texture(ctx, size) for name in names}
        hdr, depth = _texture(ctx, size), ctx.depth_texture(size)
        # Only the distances of the layer before are read while one is drawn.
        self._layers = [_layer(ctx, _texture(ctx, size), shared, hdr, depth) for _ in range(2)]
        self._depth = depth
        self._first = ctx.texture((1, 1), 4, _NOWHERE, dtype="f4")
        self._together = _texture(ctx, size)
        self._sum = ctx.framebuffer([self._together])
        self._query = ctx.query(samples=True)
        self._under = programs.fullscreen("gpu/shaders/composite.frag")
        set_used(self._under.program, "pixel", tuple(1.0 / side for side in size))

    def layers(
        self,
        scene: RenderScene,
        surfaces: SurfacePass,
        opaque: moderngl.Texture,
        *,
        sky: npt.NDArray[np.float32] | None = None,
    ) -> Iterator[Layer]:
        """Each layer with emission and ambient, to be lit before the next one is asked for.

        ``opaque``: g_normal of the opaque surfaces, at the same size. ``sky``: as for
        ``SurfacePass.draw``.
        """
        self.truncated = False
        self._sum.clear()
        if not surfaces.blended(scene):
            return
        before = self._first
        for number in range(MAX_LAYERS + 1):
            layer = self._layers[number % 2]
            layer.gbuffer.use()
            layer.gbuffer.clear(depth=1.0)
            self.ctx.enable_only(moderngl.DEPTH_TEST)
            self.ctx.depth_func = "<"
            with self._query:
                between = Between(opaque, before)
                surfaces.draw(scene, "blended", sky=sky, extra=self.extra, between=between)
            if self._query.samples == 0:
                return
            if number == MAX_LAYERS:
                self.truncated = True
                return
            yield layer
            self._composite(layer.hdr, self._sum, (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE))
            before = layer.textures["g_normal"]

    def merge(self, frame: moderngl.Framebuffer) -> None:
        """All layers over the opaque surfaces in ``frame``."""
        self._composite(self._together, frame, (moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA))

    def release(self) -> None:
        """Free what it has on the GPU."""
        self._sum.release()
        for layer in self._layers:
            layer.gbuffer.release()
            layer.frame.release()
            layer.textures["g_normal"].release()
        shared = [t for name, t in self._layers[0].textures.items() if name != "g_normal"]
        for texture in (*shared, self._layers[0].hdr, self._depth, self._first, self._together):
            texture.release()

    def _composite(
        self, layer: moderngl.Texture, onto: moderngl.Framebuffer, blend: tuple[int, int]
    ) -> None:
        layer.use(0)
        set_used(self._under.program, "layer", 0)
        with blending(self.ctx, onto, blend):
            self._under.render(moderngl.TRIANGLES, vertices=3)


def _layer(
    ctx: moderngl.Context,
    normal: moderngl.Texture,
    shared: dict[str, moderngl.Texture],
    hdr: moderngl.Texture,
    depth: moderngl.Texture,
) -> Layer:
    textures = {"g_normal": normal} | shared
    attached = [normal, shared["g_diffuse"], shared["g_specular"], hdr]
    attached += [shared["g_extra"]] if "g_extra" in shared else []
    frame = ctx.framebuffer([hdr], depth)
    return Layer(textures, hdr, ctx.framebuffer(attached, depth), frame)


def _texture(ctx: moderngl.Context, size: tuple[int, int]) -> moderngl.Texture:
    texture = ctx.texture(size, 4, dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
