"""A GLSL function as a NumPy function, to compare it with its twin.

Transform feedback in a vertex shader: no rasteriser, no texture format, float32 in
and out, results in order.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, overload

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.program import UniformValue, build
from hdrusd.gpu.source import Defines, from_text
from hdrusd.gpu.tables import Tables

_KINDS = {"f": ("float", "vec", "f4"), "i": ("int", "ivec", "i4"), "u": ("uint", "uvec", "u4")}
_TYPES = {
    name if width == 1 else f"{vector}{width}": (dtype, () if width == 1 else (width,))
    for name, vector, dtype in _KINDS.values()
    for width in (1, 2, 3, 4)
}

Array = npt.NDArray[Any]


@overload
def evaluate(
    ctx: moderngl.Context,
    include: str | Sequence[str],
    expression: str,
    arrays: Mapping[str, npt.ArrayLike],
    outputs: str,
    *,
    uniforms: Mapping[str, UniformValue] | None = None,
    defines: Defines | None = None,
) -> Array: ...


@overload
def evaluate(
    ctx: moderngl.Context,
    include: str | Sequence[str],
    expression: str,
    arrays: Mapping[str, npt.ArrayLike],
    outputs: Mapping[str, str],
    *,
    uniforms: Mapping[str, UniformValue] | None = None,
    defines: Defines | None = None,
) -> dict[str, Array]: ...


def evaluate(
    ctx: moderngl.Context,
    include: str | Sequence[str],
    expression: str,
    arrays: Mapping[str, npt.ArrayLike],
    outputs: str | Mapping[str, str],
    *,
    uniforms: Mapping[str, UniformValue] | None = None,
    defines: Defines | None = None,
) -> Array | dict[str, Array]:
    """Run GLSL once per row.

    ``include``: one or more files, as in an ``#include``, or texts with line breaks.
    ``arrays``: inputs by name, (n,) or (n, 2 to 4); floats go in as float32, integers as
    int or uint.
    ``expression``: the name of a function, which gets the inputs in their order; or
    an expression over the input names. ``outputs``: its GLSL type, "float" or "vec3";
    the result is (n,) or (n, k). For several results, a mapping of names to types,
    and statements that assign to them ("a = f(x); b = g(x);"); the result is a dict.
    Raises ShaderError.
    """
    columns = {name: _column(np.asarray(value)) for name, value in arrays.items()}
    (count,) = {len(column) for column in columns.values()}
    if isinstance(outputs, str):
        if re.fullmatch(r"\w+", expression) and expression not in columns:
            expression = f"{expression}({', '.join(columns)})"
        expression = f"result = {expression};"
        types = {"result": outputs}
    else:
        types = dict(outputs)

    includes = [include] if isinstance(include, str) else include
    text = [name if "\n" in name else f'#include "{name}"' for name in includes]
    text += [f"in {_glsl_type(column)} {name};" for name, column in columns.items()]
    text += [
        f"{'' if _TYPES[kind][0] == 'f4' else 'flat '}out {kind} {name};"
        for name, kind in types.items()
    ]
    text += ["void main()", "{", "    gl_Position = vec4(0.0);", f"    {expression}", "}"]
    source = from_text("\n".join(text), "<evaluate>", defines)

    program = build(ctx, source, varyings=tuple(types))
    buffers = {name: ctx.buffer(column) for name, column in columns.items()}
    layout = np.dtype([(name, *_TYPES[kind]) for name, kind in types.items()])
    captured = ctx.buffer(reserve=max(count, 1) * layout.itemsize)
    tables = Tables(ctx)
    # An input that the expression does not read is not an attribute of the program.
    used = [name for name in columns if name in program]
    vertices = ctx.vertex_array(
        program,
        [(buffers[n], f"{columns[n].shape[1]}{columns[n].dtype.kind}4", n) for n in used],
    )
    try:
        tables.use(program, uniforms or {}, 0)
        vertices.transform(captured, mode=moderngl.POINTS, vertices=count)
        rows = np.frombuffer(captured.read(), layout)[:count]
    finally:
        for buffer in (captured, *buffers.values()):
            buffer.release()
        vertices.release()
        program.release()
        tables.release()
    results = {name: rows[name].copy() for name in types}
    return results["result"] if isinstance(outputs, str) else results


def _column(value: Array) -> Array:
    if value.ndim not in (1, 2) or (value.ndim == 2 and not 1 <= value.shape[1] <= 4):
        raise ValueError(f"an input of shape {value.shape}; want (n,) or (n, 1 to 4)")
    dtype = {"i": np.int32, "u": np.uint32}.get(value.dtype.kind, np.float32)
    return np.ascontiguousarray(value.reshape(len(value), -1), dtype)


def _glsl_type(column: Array) -> str:
    scalar, vector, _ = _KINDS[column.dtype.kind]
    return scalar if column.shape[1] == 1 else f"{vector}{column.shape[1]}"
