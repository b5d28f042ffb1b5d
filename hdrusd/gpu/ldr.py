"""Shader 2: an HDR frame in cd/m2 becomes an 8-bit sRGB picture.

Clean, operator, sRGB curve, dither and the packing into bytes are one pass. The
target is RGBA32UI with 16 bytes of the RGB picture to a texel: on llvmpipe (two
2.5 GHz cores) at 1920x1080 the pass takes 13 ms and the read 1 ms, against 33 and
6 ms with the same arithmetic, an RGBA8 target, and a read as RGB. What costs there is
to convert and swizzle single pixels.
"""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.program import Programs, set_uniforms
from hdrusd.tonemap.operator import Operator, Parameters, Statistics

#: Pixels and target texels of a group: three RGBA32UI texels are 48 bytes.
_GROUP, _TEXELS = 16, 3


class ToneMapper:
    """Applies operators to frames of any size; buffers of the last size are kept."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self._sampler = ctx.sampler(
            repeat_x=False, repeat_y=False, filter=(moderngl.NEAREST, moderngl.NEAREST)
        )
        self._target: moderngl.Framebuffer | None = None
        self._upload: moderngl.Texture | None = None

    def apply(
        self,
        hdr: moderngl.Texture,
        operator: Operator,
        params: Parameters | None = None,
        stats: Statistics | None = None,
        *,
        top_first: bool = False,
    ) -> npt.NDArray[np.uint8]:
        """The picture of an RGB(A) float texture in cd/m2: (h, w, 3) sRGB, top row first.

        The texture's row 0 is the bottom one, as OpenGL draws it, unless
        ``top_first``. NaN and negative channels are black. ``stats`` is what the
        operator needs (Measurer.measure). Raises UnknownNameError, HdrusdError for
        parameters, ShaderError.
        """
        width, height = hdr.size
        settings = operator.settings(params)
        vertices = self.programs.fullscreen(
            "gpu/shaders/ldr.frag",
            {"OPERATOR": operator.function, "OPERATOR_GLSL": f'"{operator.glsl}"'},
        )
        rows: dict[str, Any] = {
            "top_row": 0 if top_first else height - 1,
            "row_step": 1 if top_first else -1,
        }
        shared: dict[str, Any] = {"hdr": 0, "texel": (1.0 / width, 1.0 / height)}
        set_uniforms(vertices.program, shared | rows)
        set_uniforms(vertices.program, operator.uniforms(stats, settings))
        groups = math.ceil(width / _GROUP)
        target = self._target_of((groups * _TEXELS, height))
        hdr.use(0)
        self._sampler.use(0)
        with self.ctx.scope(target, moderngl.NOTHING):
            vertices.render(vertices=3)
        self._sampler.clear(0)
        picture = np.empty((height, groups * _GROUP, 3), np.uint8)
        target.read_into(picture, components=4, dtype="u4", alignment=1)
        return np.ascontiguousarray(picture[:, :width])

    def apply_array(
        self,
        rgb: npt.NDArray[np.float32],
        operator: Operator,
        params: Parameters | None = None,
        stats: Statistics | None = None,
    ) -> npt.NDArray[np.uint8]:
        """As ``apply``, for a frame (h, w, 3) in cd/m2, top row first."""
        return self.apply(self.upload(rgb), operator, params, stats, top_first=True)

    def upload(self, rgb: npt.NDArray[np.float32]) -> moderngl.Texture:
        """A frame (h, w, 3) as a texture whose row 0 is the frame's, valid until the next one."""
        height, width = rgb.shape[:2]
        if self._upload is None or self._upload.size != (width, height):
            if self._upload is not None:
                self._upload.release()
            self._upload = self.ctx.texture((width, height), 3, dtype="f4", alignment=1)
        self._upload.write(np.ascontiguousarray(rgb, np.float32), alignment=1)
        return self._upload

    def _target_of(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        if self._target is None or self._target.size != size:
            if self._target is not None:
                for attachment in self._target.color_attachments:
                    attachment.release()
                self._target.release()
            self._target = self.ctx.framebuffer([self.ctx.texture(size, 4, dtype="u4")])
        return self._target
