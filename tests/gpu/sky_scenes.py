"""G-buffers from arrays, skies from pictures, and what the passes of the sky add to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.program import Programs
from hdrusd.gpu.sky import SkyPass
from hdrusd.report import Report
from hdrusd.scene import ImageData, Sky, TextureRef

Array = npt.NDArray[Any]

EVERYWAY = tuple(np.eye(3).ravel().tolist())


def sky(name: str = "sky.exr", **fields: Any) -> Sky:
    values = {"factor": (1.0, 1.0, 1.0), "rotation": EVERYWAY} | fields
    return Sky(TextureRef(name, "auto", "repeat", "clamp"), **values)


def sky_pass(
    gl: moderngl.Context, report: Report | None = None, **pictures: Array | None
) -> SkyPass:
    """Skies whose pictures are ``pictures`` by their names without ``.exr``."""

    def load(ref: TextureRef) -> ImageData | None:
        pixels = pictures[ref.file.removesuffix(".exr")]
        return None if pixels is None else ImageData(pixels)

    return SkyPass(gl, Programs(gl), load, 2.2, Report() if report is None else report)


class GBuffer:
    """Layers (h, w, 4), top row first; no surface where the normal is 0."""

    def __init__(self, gl: moderngl.Context, **layers: Array) -> None:
        self.gl = gl
        self.size = layers["g_normal"].shape[1::-1]
        self.layers = {name: self._texture(layer) for name, layer in layers.items()}
        self.hdr = self._texture(np.zeros((*layers["g_normal"].shape[:2], 4)))
        solid = np.any(layers["g_normal"][..., :3] != 0.0, axis=-1)
        depth = gl.depth_texture(self.size)
        self.frame = gl.framebuffer([self.hdr], depth)
        self._fill(solid)

    def _texture(self, layer: Array) -> moderngl.Texture:
        texture = self.gl.texture(self.size, 4, _rows_up(layer), dtype="f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _fill(self, solid: Array) -> None:
        """Depth 1 where there is nothing, 0.5 elsewhere."""
        self.frame.use()
        self.frame.clear(depth=1.0)
        self.gl.enable_only(moderngl.DEPTH_TEST)
        height = len(solid)
        for row, column in zip(*np.nonzero(solid), strict=True):
            self.frame.clear(depth=0.5, viewport=(int(column), int(height - 1 - row), 1, 1))
        self.gl.enable_only(moderngl.NOTHING)

    def read(self) -> Array:
        """(h, w, 4) of the frame, top row first."""
        width, height = self.size
        found = np.frombuffer(self.hdr.read(), np.float32).reshape(height, width, 4)
        return found[::-1].astype(np.float64)


def _rows_up(layer: Array) -> bytes:
    return np.ascontiguousarray(layer[::-1], np.float32).tobytes()


def surfaces(
    normal: Array, depth: Array, *, f0: Array | float = 0.04, metallic: float = 0.0, **more: Any
) -> Mapping[str, Array]:
    """Layers of a G-buffer: ``rho`` reflectance, ``alpha`` of GGX (or ``shininess``), ``coat``.

    ``scattered``: what sky light becomes.
    """
    shape = normal.shape[:2]
    gloss = np.broadcast_to(more.get("shininess", -np.asarray(more.get("alpha", 0.25))), shape)
    rho = np.broadcast_to(more.get("rho", 0.5), (*shape, 3))
    layers = {
        "g_normal": np.concatenate([normal, depth[..., None]], axis=-1),
        "g_diffuse": np.concatenate([rho, gloss[..., None]], axis=-1),
        "g_specular": np.concatenate(
            [np.broadcast_to(f0, (*shape, 3)), np.full((*shape, 1), metallic)], axis=-1
        ),
    }
    if "scattered" in more:
        layers["g_scattered"] = np.concatenate(
            [np.broadcast_to(more["scattered"], (*shape, 3)), np.zeros((*shape, 1))], axis=-1
        )
    if "coat" in more:
        extra = np.zeros((*shape, 4))
        extra[..., :2] = more["coat"]
        layers["g_extra"] = extra
    return layers
