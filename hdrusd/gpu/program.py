"""Compiled programs, each once; errors that name our files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.errors import ShaderError
from hdrusd.gpu.release import release
from hdrusd.gpu.source import Defines, Source, load

#: What a uniform takes: a number, a vector, or an array of numbers.
UniformValue = float | Sequence[float] | npt.NDArray[Any]

FULLSCREEN = "gpu/shaders/fullscreen.vert"


class Programs:
    """Programs of one context by their files and defines."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self._programs: dict[Any, moderngl.Program] = {}
        self._passes: dict[Any, moderngl.VertexArray] = {}

    def get(self, vertex: str, fragment: str, defines: Defines | None = None) -> moderngl.Program:
        """The program of two files (names as in source.py); raises ShaderError."""
        key = vertex, fragment, tuple(sorted((defines or {}).items()))
        if key not in self._programs:
            self._programs[key] = build(self.ctx, load(vertex, defines), load(fragment, defines))
        return self._programs[key]

    def fullscreen(self, fragment: str, defines: Defines | None = None) -> moderngl.VertexArray:
        """A pass over every pixel of the bound framebuffer: render 3 vertices of it."""
        program = self.get(FULLSCREEN, fragment, defines)
        if program not in self._passes:
            self._passes[program] = self.ctx.vertex_array(program, [])
        return self._passes[program]

    def release(self) -> None:
        """Give all of them back; those that are asked for later are built anew."""
        release(self._passes, self._programs)
        self._passes.clear()
        self._programs.clear()


def build(
    ctx: moderngl.Context,
    vertex: Source,
    fragment: Source | None = None,
    varyings: Sequence[str] = (),
) -> moderngl.Program:
    """Compile and link; raises ShaderError with the driver's log in terms of our files."""
    try:
        return ctx.program(
            vertex_shader=vertex.text,
            fragment_shader=fragment.text if fragment else None,
            varyings=tuple(varyings),
        )
    except moderngl.Error as error:
        log = str(error)
        stage = fragment if fragment and "fragment_shader" in log else vertex
        names = " + ".join(source.name for source in (vertex, fragment) if source)
        raise ShaderError(f"{names}: {stage.rewrite_log(log).strip()}") from error


def set_uniforms(program: moderngl.Program, values: Mapping[str, UniformValue]) -> None:
    """Write uniforms by name, arrays as float32.

    Raises ShaderError for a name that the linked program does not have, which is
    either misspelt or has no effect.
    """
    for name, value in values.items():
        if name not in program:
            raise ShaderError(f"uniform {name}: not in the program; has {', '.join(program)}")
        uniform: Any = program[name]
        if isinstance(value, np.ndarray):
            uniform.write(np.ascontiguousarray(value, np.float32))
        else:
            uniform.value = value
