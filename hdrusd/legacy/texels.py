"""Which texel of a texture stands at a place of a surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import Texture, UVTransform

Array = npt.NDArray[Any]


def texels(texture: Texture, uv: Array, width: int, height: int) -> tuple[Array, Array, Array]:
    """Row, column (n,) of the texel at each place, and whether there is one (wrap "black")."""
    uv = np.nan_to_num(_transformed(uv, texture.transform), posinf=0.0, neginf=0.0)
    column, in_s = _wrapped(uv[:, 0], texture.wrap_s, width)
    row, in_t = _wrapped(1.0 - uv[:, 1], texture.wrap_t, height)
    return row, column, in_s & in_t


def _transformed(uv: Array, form: UVTransform | None) -> Array:
    if form is None:
        return uv
    s, t = uv[:, 0] * form.scale[0], uv[:, 1] * form.scale[1]
    turn = np.radians(form.rotation)
    return np.stack(
        [
            s * np.cos(turn) - t * np.sin(turn) + form.translation[0],
            s * np.sin(turn) + t * np.cos(turn) + form.translation[1],
        ],
        axis=1,
    )


def _wrapped(at: Array, wrap: str, size: int) -> tuple[Array, npt.NDArray[np.bool_]]:
    inside = np.ones(len(at), np.bool_)
    if wrap == "black":
        inside = (at >= 0.0) & (at <= 1.0)
    if wrap == "repeat":
        at = at - np.floor(at)
    elif wrap == "mirror":
        at = 1.0 - np.abs(at % 2.0 - 1.0)
    return np.clip(np.floor(np.clip(at, 0.0, 1.0) * size), 0, size - 1).astype(np.int64), inside
