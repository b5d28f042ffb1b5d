"""Uniforms of an operator: numbers as they are, arrays as textures to fetch from."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.program import set_uniforms
from hdrusd.tonemap.operator import Uniforms

_GL_SAMPLER_2D = 0x8B5E


class Tables:
    """Textures for tables, kept by name until a table of another shape has that name."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._textures: dict[str, moderngl.Texture] = {}

    def use(self, program: moderngl.Program, uniforms: Uniforms, unit: int) -> None:
        """Set ``uniforms``; tables (n,), (h, w) or (h, w, c) are bound to ``unit`` and on.

        As textures of n x 1 or w x h texels, row 0 first; an array that is no sampler in the
        shader stays an array. Raises ShaderError for a name that
        the program does not have.
        """
        numbers: dict[str, Any] = {}
        for name, value in uniforms.items():
            if isinstance(value, np.ndarray) and _is_sampler(program, name):
                self._texture(name, value).use(unit)
                numbers[name], unit = unit, unit + 1
            else:
                numbers[name] = value
        set_uniforms(program, numbers)

    def release(self) -> None:
        """Free the textures."""
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()

    def _texture(self, name: str, table: npt.NDArray[Any]) -> moderngl.Texture:
        table = np.ascontiguousarray(np.atleast_2d(table), np.float32)
        height, width = table.shape[:2]
        components = table.shape[2] if table.ndim == 3 else 1
        texture = self._textures.get(name)
        if texture is None or (texture.size, texture.components) != ((width, height), components):
            if texture is not None:
                texture.release()
            texture = self.ctx.texture((width, height), components, dtype="f4", alignment=1)
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
            texture.repeat_x = texture.repeat_y = False
            self._textures[name] = texture
        texture.write(table, alignment=1)
        return texture


def _is_sampler(program: moderngl.Program, name: str) -> bool:
    return name in program and getattr(program[name], "gl_type", 0) == _GL_SAMPLER_2D
