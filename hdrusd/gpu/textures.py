"""Images on the GPU, linear before they are filtered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.photometry.reflectance import reflectance_table
from hdrusd.scene import ImageData, TextureRef


@dataclass(frozen=True, slots=True)
class Uploaded:
    """A texture, and how its coordinates follow from those of the image: s' = scale s + offset."""

    texture: moderngl.Texture
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


def linear_texels(
    pixels: npt.NDArray[np.generic], decode: str, gamma: float
) -> npt.NDArray[np.generic]:
    """RGBA texels, (h, w, 4) float16 or float32, bottom row first, ready to be filtered.

    8-bit colour becomes T^gamma (photometry/reflectance.py) in half floats: 11 bits,
    relative error below 2^-11, which 256 codes do not exceed. Alpha stays linear.
    """
    h, w, channels = pixels.shape
    dtype = np.float32 if pixels.dtype == np.float32 else np.float16
    out: npt.NDArray[np.generic] = np.ones((h, w, 4), dtype)
    source = pixels[::-1]
    colours = 1 if channels < 3 else 3
    alpha = channels in (2, 4)
    is_8_bit = pixels.dtype == np.uint8
    curved = decode == "gamma" or (decode == "auto" and is_8_bit and channels >= 3)
    if is_8_bit:
        table = reflectance_table(gamma if curved else 1.0, 1.0).astype(dtype)
        out[..., :3] = table[source[..., :colours]]
        if alpha:
            out[..., 3] = reflectance_table(1.0, 1.0).astype(dtype)[source[..., channels - 1]]
        return out
    color = source[..., :colours]
    out[..., :3] = np.maximum(color, 0.0) ** gamma if curved else color
    if alpha:
        out[..., 3] = source[..., channels - 1]
    return out


class TextureCache:
    """Textures by what they refer to; a file is decoded once."""

    def __init__(
        self,
        ctx: moderngl.Context,
        load: Callable[[TextureRef], ImageData | None],
        gamma: float,
    ) -> None:
        self.ctx = ctx
        self.load = load
        self.gamma = gamma
        self.blank = ctx.texture((1, 1), 4, bytes(4))  # where there is no image
        self._kept: dict[TextureRef, Uploaded | None] = {}

    def get(self, ref: TextureRef) -> Uploaded | None:
        """The texture, or None where ``load`` found nothing (it made the finding)."""
        if ref not in self._kept:
            image = self.load(ref)
            self._kept[ref] = None if image is None else self._upload(ref, image)
        return self._kept[ref]

    def _upload(self, ref: TextureRef, image: ImageData) -> Uploaded:
        texels = linear_texels(image.pixels, ref.decode, self.gamma)
        scale, offset = [1.0, 1.0], [0.0, 0.0]
        for i, wrap in enumerate((ref.wrap_s, ref.wrap_t)):
            axis = 1 - i  # s runs along the columns
            # moderngl has repeat and clamp only: the other two are made of texels.
            if wrap == "mirror":
                texels = np.concatenate([texels, np.flip(texels, axis)], axis=axis)
                scale[i] = 0.5
            elif wrap == "black":
                size = texels.shape[axis]
                pad = [(0, 0)] * 3
                pad[axis] = (1, 1)
                texels = np.pad(texels, pad)
                scale[i], offset[i] = size / (size + 2), 1 / (size + 2)
        h, w = texels.shape[:2]
        dtype = "f2" if texels.dtype == np.float16 else "f4"
        texture = self.ctx.texture((w, h), 4, np.ascontiguousarray(texels), dtype=dtype)
        texture.repeat_x = ref.wrap_s in ("repeat", "mirror")
        texture.repeat_y = ref.wrap_t in ("repeat", "mirror")
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        return Uploaded(texture, (scale[0], scale[1]), (offset[0], offset[1]))
