"""Shader 2: an HDR frame in cd/m2 becomes a picture of 8 bits, for screens of more range 16.

Clean, operator, the screen's curve, dither and the packing into bytes are one pass. The
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

from hdrusd.eye.screen import Screen
from hdrusd.gpu.blurs import BlurPass
from hdrusd.gpu.program import Programs, set_uniforms
from hdrusd.gpu.tables import Tables
from hdrusd.tonemap.operator import Moment, Operator

#: Pixels and target texels of a group: three RGBA32UI texels are 48 bytes.
_GROUP, _TEXELS = 16, 3

#: EOTFs whose codes depend on what the panel emits.
_ABSOLUTE = ("bt1886", "pq")


class ToneMapper:
    """Applies operators to frames of any size; buffers of the last size are kept."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self._sampler = ctx.sampler(
            repeat_x=False, repeat_y=False, filter=(moderngl.NEAREST, moderngl.NEAREST)
        )
        self._blurs = BlurPass(ctx, programs)
        self._tables = Tables(ctx)
        self._target: moderngl.Framebuffer | None = None
        self._upload: moderngl.Texture | None = None

    def apply(
        self,
        hdr: moderngl.Texture,
        operator: Operator,
        moment: Moment,
        *,
        night: tuple[float, float] | None = None,
        rods: bool = False,
        top_first: bool = False,
    ) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint16]:
        """The picture of an RGB(A) float texture in cd/m2: (h, w, 3) code values, top row first.

        Of ``moment.screen``: 16 bits for PQ, else 8. The texture's row 0 is the bottom one, as
        OpenGL draws it, unless ``top_first``. NaN and negative channels are black. ``moment``
        has the operator's complete parameters, and the statistics and state that it needs.
        ``night``: shares of eye.scotopic.night_colour; with ``rods`` alpha is the white-relative
        scotopic luminance.
        Raises HdrusdError for these, ShaderError.
        """
        width, height = hdr.size
        operator = operator.built(moment.parameters)
        screen = moment.screen
        wide = deep(screen)
        eotf = "none" if operator.encoded else screen.eotf
        defines: dict[str, Any] = {
            "OPERATOR": operator.function,
            "OPERATOR_GLSL": f'"{operator.glsl}"',
            "ENCODE": f"encode_{eotf}",
        }
        if night is not None:
            defines["NIGHT"] = int(rods)
        around: list[moderngl.Texture] = []
        if operator.blurs is not None:
            kernels = operator.blurs(moment.parameters)
            around = self._blurs.apply(hdr, kernels)
            defines["BLURS"] = len(kernels)
        vertices = self.programs.fullscreen(f"gpu/shaders/ldr{'16' if wide else ''}.frag", defines)
        shared: dict[str, Any] = {
            "hdr": 0,
            "texel": (1.0 / width, 1.0 / height),
            "top_row": 0 if top_first else height - 1,
            "row_step": 1 if top_first else -1,
            **{f"around_{i}": 1 + i for i in range(len(around))},
        }
        if night is not None:
            shared["night_ramp"], shared["night_tint"] = night
        if eotf in _ABSOLUTE:
            shared["panel"] = screen.black, screen.peak
        set_uniforms(vertices.program, shared)
        self._tables.use(vertices.program, operator.uniforms(moment), 1 + len(around))
        groups = math.ceil(width / _GROUP)
        target = self._target_of((width, height) if wide else (groups * _TEXELS, height), wide)
        for unit, texture in enumerate([hdr, *around]):
            texture.use(unit)
        self._sampler.use(0)
        with self.ctx.scope(target, moderngl.NOTHING):
            vertices.render(vertices=3)
        self._sampler.clear(0)
        if wide:
            codes = np.empty((height, width, 4), np.uint16)
            target.read_into(codes, components=4, dtype="u2", alignment=1)
            return np.ascontiguousarray(codes[..., :3])
        picture = np.empty((height, groups * _GROUP, 3), np.uint8)
        target.read_into(picture, components=4, dtype="u4", alignment=1)
        return np.ascontiguousarray(picture[:, :width])

    def apply_array(
        self, rgb: npt.NDArray[np.float32], operator: Operator, moment: Moment
    ) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint16]:
        """As ``apply``, for a frame (h, w, 3) in cd/m2, top row first."""
        return self.apply(self.upload(rgb), operator, moment, top_first=True)

    def upload(self, rgb: npt.NDArray[np.float32]) -> moderngl.Texture:
        """A frame (h, w, 3 or 4) as a texture whose row 0 is the frame's, valid until the next."""
        height, width, channels = rgb.shape
        kept = self._upload
        if kept is None or (*kept.size, kept.components) != (width, height, channels):
            if kept is not None:
                kept.release()
            kept = self.ctx.texture((width, height), channels, dtype="f4", alignment=1)
            self._upload = kept
        kept.write(np.ascontiguousarray(rgb, np.float32), alignment=1)
        return kept

    def release(self) -> None:
        """Free all that was kept."""
        self._blurs.release()
        self._tables.release()
        self._free_target()
        if self._upload is not None:
            self._upload.release()
            self._upload = None
        self._sampler.release()

    def _target_of(self, size: tuple[int, int], wide: bool) -> moderngl.Framebuffer:
        dtype = "u2" if wide else "u4"
        if self._target is not None:
            (texture,) = self._target.color_attachments
            if (texture.size, getattr(texture, "dtype", None)) == (size, dtype):
                return self._target
        self._free_target()
        self._target = self.ctx.framebuffer([self.ctx.texture(size, 4, dtype=dtype)])
        return self._target

    def _free_target(self) -> None:
        if self._target is not None:
            for attachment in self._target.color_attachments:
                attachment.release()
            self._target.release()
            self._target = None


def deep(screen: Screen) -> bool:
    """Whether a picture for this screen needs more than 8 bits."""
    return screen.eotf == "pq"
