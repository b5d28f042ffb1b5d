"""Writes the textures of ``street_surfaces`` and ``street_pictures`` as 8-bit PNG files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO
import street_pictures as pictures
import street_surfaces as surfaces
from street_model import Array

_DRAWN: tuple[Callable[[], Array], ...] = (
    surfaces.asphalt,
    surfaces.marking,
    surfaces.stone_ashlar,
    surfaces.stone_rusticated,
    surfaces.stone_smooth,
    surfaces.plaster,
    surfaces.brick,
    surfaces.slate,
    surfaces.granite,
    surfaces.pavement,
    surfaces.arcade_floor,
    pictures.window_bare,
    pictures.window_curtain,
    pictures.window_warm,
    pictures.window_cool,
    pictures.shop_books,
    pictures.shop_fashion,
    pictures.shop_cafe,
    pictures.shop_dark,
    pictures.door,
    pictures.awning,
    pictures.signs,
    pictures.poster,
    pictures.plate,
)


def write_textures(folder: Path) -> None:
    """Write every picture as ``folder/name.png``, 8 bits a channel. Raises OSError.

    Values are multiples of 4/255: the eye does not see it, and the files shrink by half.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for picture in _DRAWN:
        pixels = (np.clip(picture(), 0.0, 1.0) * 63.0 + 0.5).astype(np.uint8) * 4
        pixels[pixels == 252] = 255
        path = folder / f"{picture.__name__}.png"
        image = OpenImageIO.ImageBuf(np.ascontiguousarray(pixels))
        image.specmod().attribute("png:compressionLevel", 6)
        if not image.write(str(path)):
            raise OSError(f"{path}: {image.geterror()}")
