"""Shader 1: a RenderScene becomes an HDR frame in cd/m2.

Two steps. The G-buffer: what each pixel shows, drawn once. The lights: one
instanced draw call for the plain ones and one for those with a cone, each
instance adding a batch of lights to every pixel that shows a surface. A batch
reaches the fragment shader as flat varyings, which on a software device cost a
third of reading a buffer in every pixel. There is no limit to their number, and
every light counts everywhere: nothing is cut off by distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.buffers import light_texels
from hdrusd.gpu.program import Programs
from hdrusd.gpu.surfaces import SurfacePass, set_used
from hdrusd.gpu.textures import TextureCache
from hdrusd.scene import Camera, ImageData, RenderScene, TextureRef
from hdrusd.units import TEXTURE_GAMMA

Reflection = Literal["lambert", "petit2010"]

#: Factor between R E and luminance: Lambert's 1/pi, and the paper's 1.
REFLECTION_SCALE: dict[str, float] = {"lambert": 1.0 / math.pi, "petit2010": 1.0}

#: Lights a batch by rows a light: 31 flat vec4 are what OpenGL 3.3 grants between stages.
_BATCH = {2: 15, 4: 7}


class HdrRenderer:
    """Draws frames of one size; the HDR texture stays on the GPU until it is read.

    ``load`` decodes a texture (images.py), or gives None and says so itself.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        size: tuple[int, int],
        load: Callable[[TextureRef], ImageData | None],
        *,
        reflection: Reflection = "lambert",
        gamma: float = TEXTURE_GAMMA,
    ) -> None:
        self.ctx = ctx
        self.size = size
        self.scale = REFLECTION_SCALE[reflection]
        textures = TextureCache(ctx, load, gamma)
        self.surfaces = SurfacePass(ctx, programs, textures, self.scale)
        self._lights = {
            rows: programs.get(
                "gpu/shaders/light.vert",
                "gpu/shaders/light.frag",
                {"ROWS": rows, "BATCH": batch} | ({"CONES": 1} if rows == 4 else {}),
            )
            for rows, batch in _BATCH.items()
        }
        self._layers = [ctx.texture(size, 4, dtype="f4") for _ in range(5)]
        for layer in self._layers:
            layer.filter = (moderngl.NEAREST, moderngl.NEAREST)
        depth = ctx.depth_texture(size)
        self._gbuffer = ctx.framebuffer(self._layers, depth)
        self._frame = ctx.framebuffer([self.hdr], depth)
        self._vaos = {rows: ctx.vertex_array(p, []) for rows, p in self._lights.items()}

    @property
    def hdr(self) -> moderngl.Texture:
        """RGBA32F, cd/m2 in RGB, 1 in A where there is a surface; bottom row first."""
        return self._layers[4]

    def render(self, scene: RenderScene) -> moderngl.Texture:
        """Draw one moment; returns ``hdr``."""
        self.draw_surfaces(scene)
        self.add_lights(scene)
        return self.hdr

    def read(self) -> npt.NDArray[np.float32]:
        """The frame as (h, w, 3) float32 in cd/m2, top row first."""
        return np.ascontiguousarray(self.layer(4)[::-1, :, :3])

    def layer(self, index: int) -> npt.NDArray[np.float32]:
        """A layer of the G-buffer as (h, w, 4): position, normal, diffuse, specular, frame."""
        w, h = self.size
        return np.frombuffer(self._layers[index].read(), np.float32).reshape(h, w, 4)

    def draw_surfaces(self, scene: RenderScene) -> None:
        """Step one: G-buffer, and emission plus ambient in the frame."""
        ctx = self.ctx
        self._gbuffer.use()
        self._gbuffer.clear(depth=1.0)
        if any(scene.background):
            self._frame.use()
            self._frame.clear(*scene.background, 0.0, depth=1.0)
            self._gbuffer.use()
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = "<"
        self.surfaces.draw(scene)

    def add_lights(self, scene: RenderScene) -> None:
        """Step two: every light on every pixel that shows a surface."""
        ctx = self.ctx
        self._frame.use()
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        ctx.depth_func = ">"
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        self._frame.depth_mask = False
        for texels in light_texels(scene.lights, scene.camera):
            count, rows = texels.shape[:2]
            if count == 0:
                continue
            table = ctx.texture((rows, count), 4, np.ascontiguousarray(texels), dtype="f4")
            table.filter = (moderngl.NEAREST, moderngl.NEAREST)
            program = self._lights[rows]
            for unit, name in enumerate(("g_position", "g_normal", "g_diffuse", "g_specular")):
                self._layers[unit].use(unit)
                set_used(program, name, unit)
            table.use(4)
            set_used(program, "lights", 4)
            set_used(program, "first", 0)
            set_used(program, "count", count)
            set_used(program, "lambert_scale", self.scale)
            set_used(program, "toward_eye", _toward_eye(scene.camera))
            batches = -(-count // _BATCH[rows])
            self._vaos[rows].render(moderngl.TRIANGLES, vertices=3, instances=batches)
            table.release()
        self._frame.depth_mask = True
        ctx.enable_only(moderngl.NOTHING)


def _toward_eye(camera: Camera) -> tuple[float, float, float]:
    """Unit vector to an orthographic camera; zero for one that stands somewhere."""
    return camera.back if camera.orthographic else (0.0, 0.0, 0.0)
