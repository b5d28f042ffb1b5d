"""Step one of shader 1: what each pixel shows, into the G-buffer."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.buffers import corner_buffer, instance_rows, mirrored, weld
from hdrusd.gpu.program import Programs
from hdrusd.gpu.textures import TextureCache
from hdrusd.scene import Draw, Geometry, Material, RenderScene, TextureUse

#: Maps of a material: field of scene.Material, name of the define.
_MAPS = {
    "diffuse_map": "DIFFUSE_MAP",
    "emission_map": "EMISSION_MAP",
    "opacity_map": "OPACITY_MAP",
}

#: Frames for which a buffer that nothing draws is kept.
_KEEP = 2

Key = tuple[str, int, bool, bool]


@dataclass(slots=True)
class _Uploaded:
    """One geometry in one material on the GPU, and room for its instances."""

    geometry: Geometry
    vao: moderngl.VertexArray
    buffers: tuple[moderngl.Buffer, ...]
    instances: moderngl.Buffer
    capacity: int
    used: int

    def release(self) -> None:
        self.vao.release()
        for buffer in (*self.buffers, self.instances):
            buffer.release()


class SurfacePass:
    """Draws scenes into whatever framebuffer is bound; keeps what was uploaded."""

    def __init__(
        self, ctx: moderngl.Context, programs: Programs, textures: TextureCache, scale: float
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.textures = textures
        self.scale = scale
        self._frame = 0
        self._kept: dict[Key, _Uploaded] = {}

    def draw(self, scene: RenderScene) -> None:
        """All draws of a scene; depth test on, colour attachments as in gbuffer.frag."""
        self._frame += 1
        prepared: set[moderngl.Program] = set()
        bound = -1
        for draw in sorted(scene.draws, key=lambda d: d.material):
            material = scene.materials[draw.material]
            program = self._program(draw.geometry, material)
            if program not in prepared:
                self._prepare(program, scene)
                prepared.add(program)
                bound = -1
            if draw.material != bound:
                self._use_material(program, material)
                bound = draw.material
            self._draw(draw, program, material, scene)
        self._drop_unused()

    def _program(self, geometry: Geometry, material: Material) -> moderngl.Program:
        """The variant for what is there: a map that is not used must cost nothing."""
        defines = {define: 1 for name, define in _MAPS.items() if getattr(material, name)}
        if defines:
            defines["TEXTURED"] = 1
        if material.vertex_color in geometry.colors:
            defines["VERTEX_COLOR"] = 1
        return self.programs.get("gpu/shaders/gbuffer.vert", "gpu/shaders/gbuffer.frag", defines)

    def _prepare(self, program: moderngl.Program, scene: RenderScene) -> None:
        camera = scene.camera
        rotation = np.eye(4)
        rotation[:3, :3] = camera.rotation()
        matrix = np.ascontiguousarray(rotation @ camera.projection(), np.float32)
        program["view_projection"].write(matrix)  # type: ignore[union-attr]
        set_used(program, "forward", tuple(-np.asarray(camera.back)))
        set_used(program, "ambient", scene.ambient)
        set_used(program, "lambert_scale", self.scale)

    def _draw(
        self, draw: Draw, program: moderngl.Program, material: Material, scene: RenderScene
    ) -> None:
        ctx = self.ctx
        rows = instance_rows(draw, scene.camera)
        flipped = mirrored(draw)
        set_used(program, "back_sign", -1.0 if draw.double_sided else 1.0)
        if draw.double_sided:
            ctx.disable(moderngl.CULL_FACE)
        else:
            ctx.enable(moderngl.CULL_FACE)
        for mirror in (False, True):
            chosen = rows[flipped == mirror]
            if len(chosen) == 0:
                continue
            uploaded = self._upload(draw, program, material, mirror, len(chosen))
            uploaded.instances.write(chosen)
            set_used(program, "handedness", -1.0 if mirror else 1.0)
            ctx.front_face = "cw" if mirror else "ccw"
            uploaded.vao.render(moderngl.TRIANGLES, instances=len(chosen))

    def _upload(
        self, draw: Draw, program: moderngl.Program, material: Material, mirror: bool, count: int
    ) -> _Uploaded:
        """The buffers of a draw, anew when its geometry changed or its instances outgrew it."""
        key = (draw.geometry.key, draw.material, draw.double_sided, mirror)
        kept = self._kept.get(key)
        stale = kept is not None and (
            kept.geometry is not draw.geometry
            or kept.capacity < count
            or kept.vao.program != program
        )
        if kept is not None and not stale:
            kept.used = self._frame
            return kept
        if kept is not None:
            kept.release()
        color = material.vertex_color if material.vertex_color in draw.geometry.colors else ""
        data, content = corner_buffer(draw.geometry, material.uv_sets(), color)
        welded, indices = weld(data)
        vertices, elements = self.ctx.buffer(welded), self.ctx.buffer(indices)
        instances = self.ctx.buffer(reserve=count * 48)
        used = [(part, name) for part, name in content if name in program]
        layout = " ".join(
            part if name in program else f"{4 * int(part[0])}x" for part, name in content
        )
        vao = self.ctx.vertex_array(
            program,
            [
                (vertices, layout, *(name for _, name in used)),
                (instances, "4f 4f 4f /i", "in_row0", "in_row1", "in_row2"),
            ],
            elements,
        )
        buffers = (vertices, elements)
        self._kept[key] = _Uploaded(draw.geometry, vao, buffers, instances, count, self._frame)
        return self._kept[key]

    def _drop_unused(self) -> None:
        for key in [k for k, v in self._kept.items() if v.used < self._frame - _KEEP]:
            self._kept.pop(key).release()

    def _use_material(self, program: moderngl.Program, material: Material) -> None:
        for name in (
            "diffuse",
            "specular",
            "shininess",
            "metallic",
            "emission",
            "opacity",
            "opacity_threshold",
        ):
            set_used(program, name, getattr(material, name))
        uv_sets = material.uv_sets()
        for unit, name in enumerate(_MAPS):
            use: TextureUse | None = getattr(material, name)
            if use is not None:
                self._use_map(program, name, unit, use, min(uv_sets.index(use.uv_set), 3))

    def _use_map(
        self, program: moderngl.Program, name: str, unit: int, use: TextureUse, uv: int
    ) -> None:
        uploaded = self.textures.get(use.texture)
        scale, bias = np.asarray(use.scale), np.asarray(use.bias)
        matrix: npt.NDArray[np.float64] = np.reshape(use.matrix, (2, 3)).astype(np.float64)
        if uploaded is None:  # the texture's fallback, through the same scale and bias
            bias = np.asarray(use.fallback) * scale + bias
            scale = np.zeros(4)
            self.textures.blank.use(unit)
        else:
            matrix = matrix * np.reshape(uploaded.scale, (2, 1))
            matrix[:, 2] += uploaded.offset
            uploaded.texture.use(unit)
        set_used(program, name.replace("_map", "_image"), unit)
        set_used(program, f"{name}.uv", uv)
        set_used(program, f"{name}.u", tuple(matrix[0]))
        set_used(program, f"{name}.v", tuple(matrix[1]))
        set_used(program, f"{name}.scale", tuple(scale))
        set_used(program, f"{name}.bias", tuple(bias))
        set_used(program, f"{name}.channel", use.channel)


def set_used(program: moderngl.Program, name: str, value: object) -> None:
    """Set a uniform, unless the compiler found it unused and removed it."""
    member = program.get(name, None)
    if member is not None:
        member.value = value  # type: ignore[union-attr]
