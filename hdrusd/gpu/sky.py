"""Skies of a scene: their light on surfaces, in mirrors, behind everything, and their suns.

A picture is read once; what depends on its dome's transform and strength is done every
frame on a few numbers:

- ``with_suns``: small bright sources become distant lights, which cast shadows;
- ``lux_coefficients``: the rest on surfaces, for ``ambient_lux`` in gbuffer.frag;
- ``add_mirrored``: the rest in glossy surfaces, a pass of its own after the G-buffer;
- ``draw_background``: all of it where no surface is seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.gpu.blending import blending
from hdrusd.gpu.lights import window_uniforms
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.surfaces import set_used
from hdrusd.gpu.textures import linear_texels
from hdrusd.photometry.environment import LAST, WIDTHS, blurred_levels, reflected_table
from hdrusd.photometry.sky import (
    SH_TERMS,
    Sun,
    irradiance_coefficients,
    reduced,
    sky_uv,
    sound_texels,
    split_suns,
    turned_coefficients,
)
from hdrusd.report import Kind, Report
from hdrusd.scene import Camera, ImageData, Material, RenderScene, Sky, TextureRef, light_rows
from hdrusd.units import LUMINANCE_WEIGHTS

Doubles = npt.NDArray[np.float64]

#: Columns of the picture in which suns are looked for, and of the one that is integrated.
_COLUMNS, _INTEGRATED = 2048, 256


@dataclass(slots=True)
class _Read:
    """A picture, in the dome's axes and in its own units."""

    rest: Doubles  # (h, w, 3) without its suns, at most ``_COLUMNS`` wide
    coefficients: Doubles  # (18, 3) of the rest
    suns: list[Sun]
    blurred: moderngl.Texture | None = None
    whole: moderngl.Texture | None = None

    def release(self) -> None:
        for texture in (self.blurred, self.whole):
            if texture is not None:
                texture.release()


class SkyPass:
    """The skies of one scene after the other; keeps what was read of their pictures.

    ``load`` decodes a texture, or gives None and says so itself: such a sky is dark.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        load: Callable[[TextureRef], ImageData | None],
        gamma: float,
        report: Report,
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.load = load
        self.gamma = gamma
        self.report = report
        self._read: dict[TextureRef, _Read | None] = {}
        self._table: moderngl.Texture | None = None
        self._vaos: dict[moderngl.Program, moderngl.VertexArray] = {}

    def release(self) -> None:
        """Give the GPU's memory back."""
        release(self._read, self._table, self._vaos)
        self._read.clear()

    def with_suns(self, scene: RenderScene) -> RenderScene:
        """The scene with the suns of its skies as lights; first in every frame."""
        used = {sky.texture for sky in scene.skies}
        for texture in self._read.keys() - used:
            read = self._read.pop(texture)
            if read is not None:
                read.release()
        rows = [_sun_rows(sky, read.suns) for sky, read in self._skies(scene) if read.suns]
        if not rows:
            return scene
        suns = np.concatenate(rows)
        suns["key"] = -1 - np.arange(len(suns))
        return replace(scene, lights=np.concatenate([scene.lights, suns]))

    def lux_coefficients(self, scene: RenderScene) -> npt.NDArray[np.float32]:
        """(18, 3) for ``ambient_lux`` of a normal in the world; the scene's ambient included."""
        total = np.zeros((SH_TERMS, 3))
        total[0] = scene.ambient
        for sky, read in self._skies(scene):
            rotation = np.reshape(sky.rotation, (3, 3))
            total += turned_coefficients(read.coefficients, rotation) * sky.factor
        return np.clip(total, -1e30, 1e30).astype(np.float32)

    def luminance(self, scene: RenderScene, directions: Doubles) -> Doubles:
        """(n, 3) cd/m2 of the skies, without their suns, and of the scene's ambient light.

        ``directions`` (n, 3) unit, in the world, evenly spread: each stands for its part of
        the sphere, so the mean over texels of about that size is what counts.
        """
        total = np.tile(np.asarray(scene.ambient, np.float64) / math.pi, (len(directions), 1))
        columns = max(round(math.sqrt(2.0 * len(directions))), 2)
        for sky, read in self._skies(scene):
            texels = reduced(read.rest, columns)
            h, w = texels.shape[:2]
            u, v = sky_uv(directions @ np.reshape(sky.rotation, (3, 3)).T).T
            row = np.clip(((1.0 - v) * h).astype(np.int64), 0, h - 1)
            total += texels[row, (u * w).astype(np.int64) % w] * sky.factor
        return total

    def draw_background(
        self, scene: RenderScene, frame: moderngl.Framebuffer, size: tuple[int, int]
    ) -> None:
        """The visible skies where ``frame`` has the depth of nothing, added to what is there."""
        for sky, read in self._skies(scene):
            if not sky.visible:
                continue
            whole = self._whole(sky.texture, read)
            program = self._program("gpu/shaders/background.frag", {})
            uniforms = {
                "axes": _world_to_dome(sky),
                "factor": sky.factor,
                "level": _level(scene.camera, size[0], whole.width),
            }
            self._draw(program, {"sky": whole}, uniforms, scene.camera, frame, "<=")

    def add_mirrored(
        self,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        frame: moderngl.Framebuffer,
        scale: float,
        arriving: moderngl.Texture | None = None,
    ) -> None:
        """What GGX surfaces mirror of skies and ambient light, into ``frame`` (blended).

        ``layers``: the G-buffer by the names of its samplers. ``scale``: 1/pi, or 1 for
        ``petit2010``. ``arriving``: what SkyOcclusion found to be left of the sky.
        """
        if not (any(scene.ambient) or scene.skies) or not any(map(_mirrors, scene.materials)):
            return
        textures = {**layers, "reflected_table": self._reflected()}
        uniforms: dict[str, Any] = {"scale": scale * math.pi}
        defines = {"COATED": 1} if "g_extra" in layers else {}
        if arriving is not None:
            textures["arriving"], defines["OCCLUDED"] = arriving, 1
        if any(scene.ambient):
            uniforms["factor"] = tuple(lux / math.pi for lux in scene.ambient)
            program = self._program("gpu/shaders/sky.frag", defines)
            self._draw(program, textures, uniforms, scene.camera, frame, ">")
        for sky, read in self._skies(scene):
            textures["blurred"] = self._blurred(read)
            uniforms |= {"factor": sky.factor, "axes": _world_to_dome(sky)}
            program = self._program("gpu/shaders/sky.frag", defines | {"PICTURE": 1})
            self._draw(program, textures, uniforms, scene.camera, frame, ">")

    # -- passes --------------------------------------------------------------------------

    def _program(self, fragment: str, defines: Mapping[str, int]) -> moderngl.Program:
        return self.programs.get("gpu/shaders/sky.vert", fragment, defines)

    def _draw(
        self,
        program: moderngl.Program,
        textures: Mapping[str, moderngl.Texture],
        uniforms: Mapping[str, Any],
        camera: Camera,
        frame: moderngl.Framebuffer,
        depth: str,
    ) -> None:
        units = {name: unit for unit, name in enumerate(textures)}
        for name, unit in units.items():
            textures[name].use(unit)
        for name, value in {**units, **uniforms, **window_uniforms(camera)}.items():
            set_used(program, name, value)
        if program not in self._vaos:
            self._vaos[program] = self.ctx.vertex_array(program, [])
        with blending(self.ctx, frame, depth=depth):
            self._vaos[program].render(moderngl.TRIANGLES, vertices=3)

    # -- pictures ------------------------------------------------------------------------

    def _skies(self, scene: RenderScene) -> list[tuple[Sky, _Read]]:
        """The skies that shine, and what was read of their pictures."""
        found = []
        for sky in scene.skies:
            if sky.texture not in self._read:
                self._read[sky.texture] = self._prepare(sky)
            read = self._read[sky.texture]
            if read is not None and any(sky.factor):
                found.append((sky, read))
        return found

    def _texels(self, ref: TextureRef) -> npt.NDArray[Any] | None:
        """(h, w, 3) luminances, top row first."""
        image = self.load(ref)
        if image is None:
            return None
        texels = linear_texels(image.pixels, ref.decode, self.gamma)[::-1, :, :3]
        return sound_texels(texels)[0]

    def _prepare(self, sky: Sky) -> _Read | None:
        image = self.load(sky.texture)
        if image is None:
            return None
        h, w = image.pixels.shape[:2]
        if w != 2 * h:
            text = f"{w} x {h} pixels, read as a whole sphere all the same; want 2 to 1"
            self._finding(Kind.ASSUMED, "sky-aspect", sky, text)
        texels = linear_texels(image.pixels, sky.texture.decode, self.gamma)[::-1, :, :3]
        texels, broken = sound_texels(texels)
        if broken:
            text = f"{broken} texels are negative, infinite or no number; 0 or the brightest holds"
            self._finding(Kind.CLAMPED, "sky-texels", sky, text)
        rest, suns = split_suns(reduced(texels, _COLUMNS))
        for sun in suns:
            self._finding(Kind.ASSUMED, "sky-sun", sky, _sun_text(sky, sun))
        return _Read(rest, irradiance_coefficients(reduced(rest, _INTEGRATED)), suns)

    def _finding(self, kind: Kind, code: str, sky: Sky, text: str) -> None:
        path = Path(sky.texture.file)
        self.report.add(kind, code, SourceRef(path), "", text)

    def _blurred(self, read: _Read) -> moderngl.Texture:
        if read.blurred is None:
            texture = self.ctx.texture((WIDTHS[0], WIDTHS[0] // 2), 3, dtype="f4")
            texture.build_mipmaps(0, LAST)
            for level, picture in enumerate(blurred_levels(read.rest)):
                texture.write(_rows_up(picture), level=level)
            texture.repeat_x, texture.repeat_y = True, False
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            read.blurred = texture
        return read.blurred

    def _whole(self, ref: TextureRef, read: _Read) -> moderngl.Texture:
        if read.whole is None:
            texels = self._texels(ref)
            if texels is None:  # it was there a moment ago
                texels = read.rest
            widest = int(self.ctx.info["GL_MAX_TEXTURE_SIZE"])
            if max(texels.shape[:2]) > widest:
                texels = reduced(texels, widest)
            h, w = texels.shape[:2]
            half = texels.dtype == np.float16
            data = np.ascontiguousarray(texels[::-1], np.float16 if half else np.float32)
            texture = self.ctx.texture((w, h), 3, data, dtype="f2" if half else "f4", alignment=1)
            texture.repeat_x, texture.repeat_y = True, False
            texture.build_mipmaps()
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            read.whole = texture
        return read.whole

    def _reflected(self) -> moderngl.Texture:
        if self._table is None:
            table = reflected_table().astype(np.float32)
            self._table = self.ctx.texture(table.shape[:2][::-1], 2, table, dtype="f4")
            self._table.repeat_x = self._table.repeat_y = False
            self._table.filter = (moderngl.LINEAR, moderngl.LINEAR)
        return self._table


def _mirrors(material: Material) -> bool:
    """Whether a material has a GGX highlight."""
    if material.model != "ggx":
        return False
    parts = (*material.specular, material.metallic, material.clearcoat)
    maps = (material.specular_map, material.metallic_map, material.clearcoat_map)
    return any(part > 0.0 for part in parts) or any(maps)


def _rows_up(picture: Doubles) -> bytes:
    """float32, bottom row first."""
    return np.ascontiguousarray(picture[::-1], np.float32).tobytes()


def _world_to_dome(sky: Sky) -> tuple[float, ...]:
    """A mat3, column by column: its rows are the dome's axes in the world."""
    return tuple(float(v) for v in np.reshape(sky.rotation, (3, 3)).T.ravel())


def _level(camera: Camera, pixels: int, texels: int) -> float:
    """Mip level at which a texel is as wide as a pixel in the middle of the picture."""
    if camera.orthographic:
        return 0.0
    left, right, _, _ = camera.window
    angle = (right - left) / pixels
    return max(math.log2(max(angle * texels / (2.0 * math.pi), 1.0)), 0.0)


def _sun_rows(sky: Sky, suns: list[Sun]) -> npt.NDArray[np.void]:
    rows = light_rows(len(suns))
    directions = np.array([sun.direction for sun in suns]) @ np.reshape(sky.rotation, (3, 3))
    rows["w"], rows["position"], rows["axis"] = 0.0, directions, -directions
    rows["intensity"] = np.array([sun.lux for sun in suns]) * sky.factor
    rows["angle"], rows["shadow"] = [sun.angle for sun in suns], sky.shadow
    return rows


def _sun_text(sky: Sky, sun: Sun) -> str:
    lux = float(np.dot(LUMINANCE_WEIGHTS, np.multiply(sun.lux, sky.factor)))
    x, y, z = np.array(sun.direction) @ np.reshape(sky.rotation, (3, 3))
    return (
        f"a source of {lux:.4g} lx, {math.degrees(2.0 * sun.angle):.2g} degrees wide, in the "
        f"direction ({x:.3f}, {y:.3f}, {z:.3f}) shines as a distant light"
    )
