"""Uniforms of a program, written only when they change.

moderngl takes some microseconds a uniform, and a scene has hundreds of draws of which
most share theirs.
"""

from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np
import numpy.typing as npt

#: Uniforms by name, as the bytes that the program keeps.
UniformBytes = Mapping[str, bytes]


def floats(values: npt.ArrayLike) -> bytes:
    """A float, vector, matrix or array of them as a program keeps it."""
    return np.asarray(values, np.float32).tobytes()


class Uniforms:
    """What one program was last told."""

    def __init__(self, program: moderngl.Program) -> None:
        members = {name: program[name] for name in program}
        self._members = {n: m for n, m in members.items() if isinstance(m, moderngl.Uniform)}
        self._values: dict[str, bytes] = {}

    def write(self, values: UniformBytes) -> None:
        """Set uniforms; what the compiler found unused and removed is passed over.

        That may be a uniform, or the end of an array.
        """
        known = self._values
        for name, value in values.items():
            if known.get(name) != value and name in self._members:
                member = self._members[name]
                member.write(value[: 4 * member.dimension * member.array_length])
                known[name] = value
