"""RenderScene arrays on the GPU: geometry kept between frames, lights as one texture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.scene import NO_CONE, Camera, Draw, Geometry

#: Texels (of 4 floats) a light: a plain one, and one with a cone or focus.
PLAIN_ROWS = 2
CONE_ROWS = 4


@dataclass(slots=True)
class Uploaded:
    """One geometry's vertex buffer, and the frame that last drew it."""

    version: int
    buffer: moderngl.Buffer
    layout: str
    attributes: list[str]
    vertices: int
    used: int


class GeometryCache:
    """Vertex buffers by geometry key: what does not change is uploaded once."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.frame = 0
        self._kept: dict[tuple[str, tuple[str, ...], str], Uploaded] = {}

    def get(self, geometry: Geometry, uv_sets: list[str], color: str) -> Uploaded:
        """The buffer for ``geometry`` with these texture coordinate sets and colour primvar."""
        key = (geometry.key, tuple(uv_sets), color)
        kept = self._kept.get(key)
        if kept is None or kept.version != geometry.version:
            if kept is not None:
                kept.buffer.release()
            kept = self._upload(geometry, uv_sets, color)
            self._kept[key] = kept
        kept.used = self.frame
        return kept

    def next_frame(self, keep: int = 2) -> None:
        """Release what no draw has used for ``keep`` frames."""
        self.frame += 1
        for key in [k for k, v in self._kept.items() if v.used < self.frame - keep]:
            self._kept.pop(key).buffer.release()

    def _upload(self, geometry: Geometry, uv_sets: list[str], color: str) -> Uploaded:
        columns = [geometry.points, geometry.normals]
        layout, attributes = ["3f", "3f"], ["in_position", "in_normal"]
        uvs = [geometry.uvs.get(name) for name in uv_sets]
        blank = np.zeros((len(geometry.points), 2), np.float32)
        for first, name in ((0, "in_uv01"), (2, "in_uv23")):
            pair = uvs[first : first + 2]
            if pair:
                arrays = [a if a is not None else blank for a in pair]
                columns += [*arrays, blank][:2]
                layout.append("4f")
                attributes.append(name)
        colors = geometry.colors.get(color) if color else None
        if colors is not None:
            columns.append(colors)
            layout.append("3f")
            attributes.append("in_color")
        data = np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32)
        return Uploaded(
            version=geometry.version,
            buffer=self.ctx.buffer(data),
            layout=" ".join(layout),
            attributes=attributes,
            vertices=len(data),
            used=self.frame,
        )


def instance_rows(draw: Draw, camera: Camera) -> npt.NDArray[np.float32]:
    """(k, 12) float32: the columns of each transform, relative to the eye.

    The eye is subtracted in float64, so that a stage far from its origin keeps its
    millimetres.
    """
    m = draw.transforms.copy()
    m[:, 3, :3] -= np.asarray(camera.eye)
    return np.ascontiguousarray(m[:, :, :3].transpose(0, 2, 1).reshape(-1, 12), np.float32)


def mirrored(draw: Draw) -> npt.NDArray[np.bool_]:
    """(k,) True where a transform turns right hands into left ones."""
    return np.asarray(np.linalg.det(draw.transforms[:, :3, :3]) < 0.0)


def light_texels(
    lights: npt.NDArray[np.void], camera: Camera
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Plain lights as (n, 2, 4) and those with a cone or focus as (m, 4, 4), for light.vert.

    Dark lights are left out: they add nothing. Positions are relative to the eye.
    """
    lit = lights[np.any(lights["intensity"] != 0.0, axis=1)]
    cone = (lit["outer"] < NO_CONE) | (lit["exponent"] > 0.0)
    return _rows(lit[~cone], camera, PLAIN_ROWS), _rows(lit[cone], camera, CONE_ROWS)


def _rows(lights: npt.NDArray[np.void], camera: Camera, rows: int) -> npt.NDArray[np.float32]:
    texels: npt.NDArray[Any] = np.zeros((len(lights), rows, 4), np.float64)
    relative = lights["position"] - lights["w"][:, None] * np.asarray(camera.eye)
    texels[:, 0, :3], texels[:, 0, 3] = relative, lights["w"]
    texels[:, 1, :3], texels[:, 1, 3] = lights["intensity"], lights["radius"]
    if rows == CONE_ROWS:
        texels[:, 2, :3], texels[:, 2, 3] = lights["axis"], lights["exponent"]
        texels[:, 3, 0], texels[:, 3, 1] = lights["inner"], lights["outer"]
    return texels.astype(np.float32)
