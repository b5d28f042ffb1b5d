"""Shader 1: a RenderScene becomes an HDR frame in cd/m2.

The steps of a frame, each a file of its own:

1. ``gpu/surfaces.py``: what each pixel shows, into the G-buffer, with emission and
   ambient light;
2. ``gpu/sky.py``: what surfaces mirror of the sky;
3. ``gpu/lights.py``: every light on every pixel, with shadows (``gpu/shadows.py``) and
   photometric profiles (``gpu/profiles.py``);
4. ``gpu/peeling.py``: surfaces that let something through, layer by layer, by the same
   steps.

A supersampled frame is the mean of such frames (``gpu/supersampling.py``). What else a
frame could be asked for needs no second renderer: a layer of the G-buffer is a texture
already; the part of some lights is step 3 with those lights and another target, since
lights add up; another eye or direction is another ``Camera``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.gpu.casters import Casters
from hdrusd.gpu.light_tables import Extras
from hdrusd.gpu.lights import (
    PROFILE_UNIT,
    SAMPLES,
    SHADOW_UNIT,
    LightMode,
    LightPass,
    common_specular,
)
from hdrusd.gpu.peeling import MAX_LAYERS, Peeling
from hdrusd.gpu.profiles import PROFILE, ProfileAtlas
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.shadows import ShadowMaps
from hdrusd.gpu.sky import SkyPass
from hdrusd.gpu.sky_occlusion import SkyOcclusion
from hdrusd.gpu.small_lamps import SmallLamps
from hdrusd.gpu.supersampling import Accumulator, offsets, shifted
from hdrusd.gpu.surfaces import SurfacePass, set_used
from hdrusd.gpu.textures import TextureCache
from hdrusd.photometry.lightcut import EPSILON
from hdrusd.report import Kind, Report
from hdrusd.scene import ImageData, RenderScene, TextureRef
from hdrusd.units import TEXTURE_GAMMA

Reflection = Literal["lambert", "petit2010"]

#: Factor between R E and luminance: Lambert's 1/pi, and the paper's 1.
REFLECTION_SCALE: dict[str, float] = {"lambert": 1.0 / math.pi, "petit2010": 1.0}

#: Layers of the G-buffer, in the order of their attachment; g_specular and the last only where
#: they are needed.
LAYERS = ("g_normal", "g_diffuse", "g_specular", "hdr", "g_extra")


@dataclass(frozen=True, slots=True)
class Options:
    """How a frame is drawn; what is drawn is in the scene."""

    reflection: Reflection = "lambert"
    gamma: float = TEXTURE_GAMMA  # of 8-bit textures
    samples: int = 1  # a pixel
    shadows: bool = True
    lights: LightMode = "auto"
    sky_samples: int = 0  # directions in which the sky may be hidden


class HdrRenderer:
    """Draws frames of one size; the HDR texture stays on the GPU until it is read.

    ``load`` decodes a texture (images.py), or gives None and says so itself. ``report``
    takes what cannot be shown as it stands; ``place`` is what the findings are of.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        size: tuple[int, int],
        load: Callable[[TextureRef], ImageData | None],
        options: Options = Options(),
        report: Report | None = None,
        place: SourceRef | None = None,
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.size = size
        self.options = options
        self.report = Report() if report is None else report
        self.place = place or SourceRef(Path())
        self.scale = REFLECTION_SCALE[options.reflection]
        self._textures = textures = TextureCache(ctx, load, options.gamma)
        self.surfaces = SurfacePass(ctx, programs, textures, self.scale)
        self.lights = LightPass(ctx, programs, size, self.scale, options.lights)
        self.skies = SkyPass(ctx, programs, load, options.gamma, self.report)
        self._profiles = ProfileAtlas(ctx)
        self._shadows = None
        if options.shadows:
            self._shadows = ShadowMaps(
                ctx, programs, textures, samples=SAMPLES, report=self.report, place=self.place
            )
        self._casters: Casters | None = None  # where there are no shadow maps to have them
        self._occlusion = None
        if options.sky_samples:
            if self._shadows is not None:
                casters = self._shadows.casters
            else:
                casters = Casters(ctx, programs, textures, self.report, self.place)
                self._casters = casters
            self._occlusion = SkyOcclusion(
                ctx,
                programs,
                casters,
                self.skies,
                size,
                self.scale,
                options.sky_samples,
                self.report,
                self.place,
            )
        self._scattered = self._texture() if options.sky_samples else None
        self._layers = {name: self._texture() for name in ("g_normal", "g_diffuse", "hdr")}
        self._one_specular: float | None = 0.0  # what g_specular has all over, without a target
        self._depth = ctx.depth_texture(size)
        self._gbuffer = self._attached()
        self._frame = ctx.framebuffer([self._layers["hdr"]], self._depth)
        self._distances = ctx.framebuffer([self._layers["g_normal"]])
        self._peeling: Peeling | None = None
        self._told_merged = False
        self._small = SmallLamps(ctx, size)
        self._samples = tuple(offsets(options.samples))
        self._sum = Accumulator(ctx, programs, size) if options.samples > 1 else None

    @property
    def hdr(self) -> moderngl.Texture:
        """RGBA32F, cd/m2 in RGB; A is 0 where nothing was drawn; bottom row first."""
        return self._layers["hdr"] if self._sum is None else self._sum.texture

    def render(self, scene: RenderScene) -> moderngl.Texture:
        """Draw one moment; returns ``hdr``."""
        scene = self.skies.with_suns(scene)
        extras = self._extras(scene)
        self._small.begin(scene)
        if self._sum is None:
            self._draw(scene, extras)
            self._look(scene, 1.0)
            self._tell_merged()
            return self.hdr
        self._sum.clear()
        for offset in self._samples:
            camera = shifted(scene.camera, offset, self.size)
            sample = replace(scene, camera=camera)
            self._draw(sample, extras)
            self._look(sample, 1.0 / len(self._samples))
            self._sum.add(self._layers["hdr"], 1.0 / len(self._samples))
        self._tell_merged()
        return self.hdr

    def release(self) -> None:
        """Give the GPU's memory back, but for the programs; it draws no more."""
        # What is bound must not be released.
        self.ctx.extra["framebuffer"].use()
        release(self._occlusion, self._casters, self._shadows, self._profiles, self._peeling)
        release(self.surfaces, self.lights, self.skies, self._sum, self._textures)
        release(self._gbuffer, self._frame, self._distances)
        release(self._layers, self._scattered, self._depth, self._small)

    @property
    def light_error(self) -> float:
        """Bound of what merging lamps has changed in the last frame (photometry/lightcut.py).

        A share of the illuminance by all lamps on a small ball, unhidden; 0 where each lamp
        was counted alone.
        """
        return EPSILON if self.lights.merged else 0.0

    def read(self) -> npt.NDArray[np.float32]:
        """The frame as (h, w, 3) float32 in cd/m2, top row first."""
        w, h = self.size
        frame = self._frame if self._sum is None else self._sum.frame
        pixels = np.frombuffer(frame.read(components=3, dtype="f4"), np.float32)
        return np.ascontiguousarray(pixels.reshape(h, w, 3)[::-1])

    def small_lamps(
        self, frame: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]:
        """Of the last ``frame``, as ``read``: lamps that its pixels cannot show.

        Rows of lamps, of pixels that show them, and whose these are (gpu/small_lamps.py).
        """
        return self._small.rows(frame)

    def layer(self, name: str) -> npt.NDArray[np.float32]:
        """A layer of the G-buffer (``LAYERS``; gbuffer.frag) as (h, w, 4), top row first.

        Of the opaque surfaces alone, 0 where there is none; of a supersampled frame its
        last sample.
        """
        if name == "g_specular" and self._one_specular is not None:
            w, h = self.size
            values = np.full((h, w, 4), [*[self._one_specular] * 3, 0.0], np.float32)
        else:
            values = self._read(self._layers[name])
        if name == "hdr":
            return values
        return np.where(self._read(self._layers["g_normal"])[..., 3:] != 0.0, values, 0.0)

    # -- the steps -----------------------------------------------------------------------

    def _draw(self, scene: RenderScene, extras: Extras) -> None:
        extra = _needs_extra(scene)
        self.draw_surfaces(scene)
        layers = {name: self._layers[name] for name in LAYERS if name in self._layers}
        del layers["hdr"]
        if not extra:
            layers.pop("g_extra", None)
        if self._one_specular is not None:
            layers.pop("g_specular", None)
        arriving = None
        if self._occlusion is not None:
            assert self._scattered is not None
            self._occlusion.add(scene, layers | {"g_scattered": self._scattered}, self._frame)
            arriving = self._occlusion.arriving
        self.skies.add_mirrored(scene, layers, self._frame, self.scale, arriving)
        self.lights.add(scene, layers, self._frame, extras, self._bind)
        self.skies.draw_background(scene, self._frame, self.size)
        self._add_blended(scene, extras, extra)

    def _look(self, scene: RenderScene, share: float) -> None:
        hdr, normal, diffuse = (self._layers[name] for name in ("hdr", "g_normal", "g_diffuse"))
        self._small.look(scene.camera, hdr, normal, diffuse, share)

    def draw_surfaces(self, scene: RenderScene) -> None:
        """Step one: G-buffer, and emission plus ambient in the frame."""
        ctx = self.ctx
        # A sky's mirror image is no lamp's: sky.frag looks it up.
        one_specular = None if scene.skies else common_specular(scene.materials)
        if one_specular is None and "g_specular" not in self._layers:
            self._layers["g_specular"] = self._texture()
        extra = _needs_extra(scene) and "g_extra" not in self._layers
        if extra:
            self._layers["g_extra"] = self._texture()
            if self._peeling is not None:
                self._peeling.release()
                self._peeling = None
        other = (one_specular is None) != (self._one_specular is None)
        self._one_specular = one_specular
        if extra or other:
            self._gbuffer.release()
            self._gbuffer = self._attached()
        # What else the G-buffer holds is read only where there is a surface.
        self._distances.clear()
        self._frame.clear(*scene.background, 0.0)
        self._gbuffer.use()
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = "<"
        self.surfaces.draw(
            scene,
            sky=self.skies.lux_coefficients(scene) if scene.skies else None,
            one_specular=one_specular is not None,
            extra="g_extra" in self._layers,
            sky_apart=self._occlusion is not None,
        )

    def _add_blended(self, scene: RenderScene, extras: Extras, extra: bool) -> None:
        """Step four."""
        if not self.surfaces.blended(scene):
            return
        if self._peeling is None:
            attached = "g_extra" in self._layers
            self._peeling = Peeling(self.ctx, self.programs, self.size, extra=attached)
        peeling = self._peeling
        opaque = self._layers["g_normal"]
        # Nothing hides the sky from what is blended: --sky-samples is for opaque surfaces.
        sky = self.skies.lux_coefficients(scene) if scene.skies else None
        for layer in peeling.layers(scene, self.surfaces, opaque, sky=sky):
            layers = dict(layer.textures)
            if not extra:
                layers.pop("g_extra", None)
            self.skies.add_mirrored(scene, layers, layer.frame, self.scale)
            self.lights.add(scene, layers, layer.frame, extras, self._bind)
        peeling.merge(self._frame)
        if peeling.truncated:
            text = f"what lies behind {MAX_LAYERS} blended surfaces is not shown"
            self.report.add(Kind.DROPPED, "blend-layers", self.place, "", text)

    def _tell_merged(self) -> None:
        """Once, at the first frame in which lamps were taken together."""
        if self._told_merged or not self.lights.merged:
            return
        self._told_merged = True
        text = (
            f"{self.lights.merged} lamps: far ones are taken together, which changes the "
            f"illuminance by {100 * EPSILON:g} % at most of what all lamps give a small ball there"
        )
        self.report.add(Kind.ASSUMED, "lights-merged", self.place, "", text)

    # -- what the steps need -------------------------------------------------------------

    def _texture(self) -> moderngl.Texture:
        texture = self.ctx.texture(self.size, 4, dtype="f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _read(self, texture: moderngl.Texture) -> npt.NDArray[np.float32]:
        w, h = self.size
        return np.frombuffer(texture.read(), np.float32).reshape(h, w, 4)[::-1]

    def _attached(self) -> moderngl.Framebuffer:
        """The G-buffer, with what is scattered of the sky where that comes later."""
        apart = [self._scattered] if self._scattered is not None else []
        left_out = "g_specular" if self._one_specular is not None else ""
        names = [name for name in LAYERS if name in self._layers and name != left_out]
        targets = [*(self._layers[name] for name in names), *apart]
        return self.ctx.framebuffer(targets, self._depth)

    def _extras(self, scene: RenderScene) -> Extras:
        """What does not depend on where in a pixel is looked: profiles and shadows."""
        self._profiles.update(scene.profiles)
        profiles, kinds = self._profiles.of_lights(scene.lights)
        count = len(scene.lights)
        if self._casters is not None:
            self._casters.update(scene)
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


def _needs_extra(scene: RenderScene) -> bool:
    """Whether anything in the scene is read from g_extra: clear coats or light links."""
    coated = any(m.clearcoat > 0.0 or m.clearcoat_map is not None for m in scene.materials)
    return coated or bool(np.any(scene.lights["link"] > 0))
