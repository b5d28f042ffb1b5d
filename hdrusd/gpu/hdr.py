"""Shader 1: a RenderScene becomes an HDR frame in cd/m2.

Two steps. The surfaces: what each pixel shows, drawn once into the G-buffer
(gpu/surfaces.py). The lights: one instanced draw call for each class of them, each
instance adding a batch of lights to every pixel that shows a surface. A batch
reaches the fragment shader as flat varyings, which on a software device cost a
third of reading a buffer in every pixel. There is no limit to their number, and
every light counts everywhere: nothing is cut off by distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.light_tables import Extras
from hdrusd.gpu.lights import PROFILE_UNIT, SAMPLES, SHADOW_UNIT, LightPass
from hdrusd.gpu.profiles import PROFILE, ProfileAtlas
from hdrusd.gpu.program import Programs
from hdrusd.gpu.shadows import ShadowMaps
from hdrusd.gpu.supersampling import Accumulator, offsets, shifted
from hdrusd.gpu.surfaces import SurfacePass, set_used
from hdrusd.gpu.textures import TextureCache
from hdrusd.scene import ImageData, RenderScene, TextureRef
from hdrusd.units import TEXTURE_GAMMA

Reflection = Literal["lambert", "petit2010"]
LightMode = Literal["auto", "exact", "merged"]

#: Factor between R E and luminance: Lambert's 1/pi, and the paper's 1.
REFLECTION_SCALE: dict[str, float] = {"lambert": 1.0 / math.pi, "petit2010": 1.0}

#: Layers of the G-buffer, in the order of their attachment.
LAYERS = ("g_normal", "g_diffuse", "g_specular", "hdr")


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
        samples: int = 1,
        shadows: bool = True,
        lights: LightMode = "auto",
        sky_samples: int = 0,
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.size = size
        self.scale = REFLECTION_SCALE[reflection]
        textures = TextureCache(ctx, load, gamma)
        self.surfaces = SurfacePass(ctx, programs, textures, self.scale)
        self._layers = [ctx.texture(size, 4, dtype="f4") for _ in LAYERS]
        for layer in self._layers:
            layer.filter = (moderngl.NEAREST, moderngl.NEAREST)
        depth = ctx.depth_texture(size)
        self._gbuffer = ctx.framebuffer(self._layers, depth)
        self._frame = ctx.framebuffer([self._layers[-1]], depth)
        self.lights = LightPass(ctx, programs, size, self.scale)
        self._samples = tuple(offsets(samples))
        self._profiles = ProfileAtlas(ctx)
        self._shadows = ShadowMaps(ctx, programs, textures, samples=SAMPLES) if shadows else None
        self._sum = Accumulator(ctx, programs, size) if samples > 1 else None

    @property
    def hdr(self) -> moderngl.Texture:
        """RGBA32F, cd/m2 in RGB; A is the share of a pixel with a surface; bottom row first."""
        return self._layers[-1] if self._sum is None else self._sum.texture

    def render(self, scene: RenderScene) -> moderngl.Texture:
        """Draw one moment; returns ``hdr``."""
        self._extras = self._prepare(scene)
        if self._sum is None:
            self._draw(scene)
            return self.hdr
        self._sum.clear()
        for offset in self._samples:
            self._draw(replace(scene, camera=shifted(scene.camera, offset, self.size)))
            self._sum.add(self._layers[-1], 1.0 / len(self._samples))
        return self.hdr

    def _draw(self, scene: RenderScene) -> None:
        self.draw_surfaces(scene)
        self.add_lights(scene)

    def _prepare(self, scene: RenderScene) -> Extras:
        """What does not depend on where in a pixel is looked: profiles and shadows."""
        self._profiles.update(scene.profiles)
        profiles, kinds = self._profiles.of_lights(scene.lights)
        count = len(scene.lights)
        if self._shadows is None:
            none = np.zeros((count, 0, 4), np.float32)
            return Extras(np.full(count, ""), none, kinds, profiles)
        shadows = self._shadows.update(scene)
        return Extras(shadows.kind, shadows.rows, kinds, profiles)

    def _bind(self, program: moderngl.Program, defines: Sequence[str]) -> None:
        """Textures and uniforms of profiles and shadows for a program of the light pass."""
        if PROFILE in defines and self._profiles.texture is not None:
            self._profiles.texture.use(PROFILE_UNIT)
            set_used(program, "profile_atlas", PROFILE_UNIT)
        if self._shadows is not None and "SHADOWED" in defines:
            self._shadows.use(SHADOW_UNIT)
            set_used(program, "shadow_atlas", SHADOW_UNIT)
            kind = " ".join(defines[defines.index("SHADOWED") + 1 :])
            for name, value in self._shadows.uniforms(kind).items():
                set_used(program, name, value)

    def read(self) -> npt.NDArray[np.float32]:
        """The frame as (h, w, 3) float32 in cd/m2, top row first."""
        return np.ascontiguousarray(self._read(self.hdr)[..., :3])

    def layer(self, name: str) -> npt.NDArray[np.float32]:
        """A layer of the G-buffer (``LAYERS``; gbuffer.frag) as (h, w, 4), top row first.

        Of a supersampled frame: of its last sample.
        """
        return self._read(self._layers[LAYERS.index(name)])

    def _read(self, texture: moderngl.Texture) -> npt.NDArray[np.float32]:
        w, h = self.size
        return np.frombuffer(texture.read(), np.float32).reshape(h, w, 4)[::-1]

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
        layers = dict(zip(LAYERS[:-1], self._layers[:-1], strict=True))
        self.lights.add(scene, layers, self._frame, self._extras, self._bind)
