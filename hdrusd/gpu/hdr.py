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

from hdrusd.gpu.buffers import GeometryCache, instance_rows, light_texels, mirrored
from hdrusd.gpu.program import Programs
from hdrusd.gpu.textures import TextureCache
from hdrusd.scene import Camera, Draw, ImageData, Material, RenderScene, TextureRef, TextureUse
from hdrusd.units import TEXTURE_GAMMA

Reflection = Literal["lambert", "petit2010"]

#: Factor between R E and luminance: Lambert's 1/pi, and the paper's 1.
REFLECTION_SCALE: dict[str, float] = {"lambert": 1.0 / math.pi, "petit2010": 1.0}

#: Lights a batch by rows a light: 31 flat vec4 are what OpenGL 3.3 grants between stages.
_BATCH = {2: 15, 4: 7}

_MAPS = ("diffuse_map", "emission_map", "opacity_map")
_IDENTITY = np.tile(np.eye(4, dtype=np.float32)[:3].reshape(1, 12), (1, 1))


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
        self.geometry = GeometryCache(ctx)
        self.textures = TextureCache(ctx, load, gamma)
        self._surface = programs.get("gpu/shaders/gbuffer.vert", "gpu/shaders/gbuffer.frag")
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
        self._empty = ctx.vertex_array(self._lights[2], [])
        self._vaos = {rows: ctx.vertex_array(p, []) for rows, p in self._lights.items()}

    @property
    def hdr(self) -> moderngl.Texture:
        """RGBA32F, cd/m2 in RGB, 1 in A where there is a surface; bottom row first."""
        return self._layers[4]

    def render(self, scene: RenderScene) -> moderngl.Texture:
        """Draw one moment; returns ``hdr``."""
        self.draw_surfaces(scene)
        self.add_lights(scene)
        self.geometry.next_frame()
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
        ctx, camera = self.ctx, scene.camera
        self._gbuffer.use()
        self._gbuffer.clear(depth=1.0)
        if any(scene.background):
            self._frame.use()
            self._frame.clear(*scene.background, 0.0, depth=1.0)
            self._gbuffer.use()
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = "<"
        program = self._surface
        rotation = np.eye(4)
        rotation[:3, :3] = camera.rotation()
        program["view_projection"].write(
            np.ascontiguousarray(rotation @ camera.projection(), np.float32)
        )
        _set(program, "ambient", scene.ambient)
        _set(program, "lambert_scale", self.scale)
        _set(program, "toward_eye", _toward_eye(camera))
        bound = -1
        for draw in sorted(scene.draws, key=lambda d: d.material):
            material = scene.materials[draw.material]
            if draw.material != bound:
                self._use_material(material)
                bound = draw.material
            self._draw(draw, material, camera)

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
                _set(program, name, unit)
            table.use(4)
            _set(program, "lights", 4)
            _set(program, "first", 0)
            _set(program, "count", count)
            _set(program, "lambert_scale", self.scale)
            _set(program, "toward_eye", _toward_eye(scene.camera))
            batches = -(-count // _BATCH[rows])
            self._vaos[rows].render(moderngl.TRIANGLES, vertices=3, instances=batches)
            table.release()
        self._frame.depth_mask = True
        ctx.enable_only(moderngl.NOTHING)

    def _draw(self, draw: Draw, material: Material, camera: Camera) -> None:
        ctx, program = self.ctx, self._surface
        uploaded = self.geometry.get(draw.geometry, material.uv_sets(), material.vertex_color)
        rows = instance_rows(draw, camera)
        flipped = mirrored(draw)
        present = [
            (layout, name)
            for layout, name in zip(uploaded.layout.split(), uploaded.attributes, strict=True)
        ]
        layout = " ".join(
            part if name in program else f"{int(part[0]) * 4}x" for part, name in present
        )
        names = [name for _, name in present if name in program]
        _set(program, "double_sided", draw.double_sided)
        colored = "in_color" in uploaded.attributes
        for mirror in (False, True):
            chosen = rows[flipped == mirror]
            if len(chosen) == 0:
                continue
            instances = ctx.buffer(chosen)
            content = [
                (uploaded.buffer, layout, *names),
                (instances, "4f 4f 4f /i", "in_row0", "in_row1", "in_row2"),
            ]
            white = None
            if not colored and "in_color" in program:
                white = ctx.buffer(np.ones(3, np.float32))
                content.append((white, "3f /r", "in_color"))
            vao = ctx.vertex_array(program, content)
            _set(program, "handedness", -1.0 if mirror else 1.0)
            if draw.double_sided:
                ctx.disable(moderngl.CULL_FACE)
            else:
                ctx.enable(moderngl.CULL_FACE)
            ctx.front_face = "cw" if mirror else "ccw"
            vao.render(moderngl.TRIANGLES, uploaded.vertices, instances=len(chosen))
            for thing in (vao, instances, white):
                if thing is not None:
                    thing.release()

    def _use_material(self, material: Material) -> None:
        program = self._surface
        for name in ("diffuse", "specular", "shininess", "metallic", "emission", "opacity"):
            _set(program, name, getattr(material, name))
        _set(program, "opacity_threshold", material.opacity_threshold)
        uv_sets = material.uv_sets()
        for unit, name in enumerate(_MAPS):
            self._use_map(name, unit, getattr(material, name), uv_sets)

    def _use_map(self, name: str, unit: int, use: TextureUse | None, uv_sets: list[str]) -> None:
        program = self._surface
        uploaded = None if use is None else self.textures.get(use.texture)
        _set(program, f"{name}.used", use is not None)
        _set(program, name.replace("_map", "_image"), unit)
        if use is None:
            return
        scale, bias = use.scale, use.bias
        (a, b, c, d, e, f) = use.matrix
        if uploaded is None:  # the texture's fallback, through the same scale and bias
            bias = tuple(fb * s + o for fb, s, o in zip(use.fallback, scale, bias, strict=True))  # type: ignore[assignment]
            scale = (0.0, 0.0, 0.0, 0.0)
        else:
            (ks, kt), (os, ot) = uploaded.scale, uploaded.offset
            a, b, c = ks * a, ks * b, ks * c + os
            d, e, f = kt * d, kt * e, kt * f + ot
            uploaded.texture.use(unit)
        _set(program, f"{name}.uv", min(uv_sets.index(use.uv_set), 3))
        _set(program, f"{name}.u", (a, b, c))
        _set(program, f"{name}.v", (d, e, f))
        _set(program, f"{name}.scale", scale)
        _set(program, f"{name}.bias", bias)
        _set(program, f"{name}.channel", use.channel)


def _set(program: moderngl.Program, name: str, value: object) -> None:
    """Set a uniform that the compiler may have found unused and removed."""
    member = program.get(name, None)
    if member is not None:
        member.value = value


def _toward_eye(camera: Camera) -> tuple[float, float, float]:
    return camera.back if camera.orthographic else (0.0, 0.0, 0.0)
