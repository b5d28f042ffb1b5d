"""RenderScene arrays in the layouts that the shaders read."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.scene import NO_CONE, Camera, Draw, Geometry

Floats = npt.NDArray[np.float32]

#: Texels (of 4 floats) a light: a plain one, and one with a cone or focus.
PLAIN_ROWS = 2
CONE_ROWS = 4


def corner_buffer(
    geometry: Geometry, uv_sets: list[str], color: str
) -> tuple[Floats, list[tuple[str, str]]]:
    """Corner attributes side by side, (3 t, .) float32, and (format, attribute) of each part.

    ``uv_sets``: up to four, two to an attribute; one that the geometry has not is 0.
    ``color``: a primvar of it, or "".
    """
    count = len(geometry.points)
    columns: list[Floats] = [geometry.points, geometry.normals]
    content = [("3f", "in_position"), ("3f", "in_normal")]
    blank = np.zeros((count, 2), np.float32)
    uvs = [geometry.uvs.get(name, blank) for name in uv_sets[:4]]
    for first, name in ((0, "in_uv01"), (2, "in_uv23")):
        pair = uvs[first : first + 2]
        if pair:
            columns += [*pair, blank][:2]
            content.append(("4f", name))
    if color:
        columns.append(geometry.colors[color])
        content.append(("3f", "in_color"))
    return np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32), content


def instance_rows(draw: Draw, camera: Camera) -> Floats:
    """(k, 12) float32: the columns of each transform, relative to the eye.

    The eye is subtracted in float64, so that a stage far from its origin keeps its
    millimetres.
    """
    m = draw.transforms[:, :, :3].copy()
    m[:, 3] -= camera.eye
    return np.ascontiguousarray(m.transpose(0, 2, 1).reshape(-1, 12), np.float32)


def mirrored(draw: Draw) -> npt.NDArray[np.bool_]:
    """(k,) True where a transform turns right hands into left ones."""
    a, b, c = (draw.transforms[:, i, :3] for i in range(3))
    return np.asarray(np.sum(np.cross(a, b) * c, axis=1) < 0.0)


def light_texels(lights: npt.NDArray[np.void], camera: Camera) -> tuple[Floats, Floats]:
    """Plain lights as (n, 2, 4) and those with a cone or focus as (m, 4, 4), for light.vert.

    Dark lights are left out: they add nothing. Positions are relative to the eye.
    """
    lit = lights[np.any(lights["intensity"] != 0.0, axis=1)]
    cone = (lit["outer"] < NO_CONE) | (lit["exponent"] > 0.0)
    return _rows(lit[~cone], camera, PLAIN_ROWS), _rows(lit[cone], camera, CONE_ROWS)


def _rows(lights: npt.NDArray[np.void], camera: Camera, rows: int) -> Floats:
    texels: npt.NDArray[Any] = np.zeros((len(lights), rows, 4), np.float64)
    relative = lights["position"] - lights["w"][:, None] * np.asarray(camera.eye)
    texels[:, 0, :3], texels[:, 0, 3] = relative, lights["w"]
    texels[:, 1, :3], texels[:, 1, 3] = lights["intensity"], lights["radius"]
    if rows == CONE_ROWS:
        texels[:, 2, :3], texels[:, 2, 3] = lights["axis"], lights["exponent"]
        texels[:, 3, 0], texels[:, 3, 1] = lights["inner"], lights["outer"]
    return texels.astype(np.float32)
