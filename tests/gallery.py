"""Contact sheets of pictures: tiles with a name below each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

T = TypeVar("T")
Pixels = npt.NDArray[np.uint8]

#: Files of the corpus whose pictures are not shown in public: share-alike and copyleft licences,
#: data without a licence of its own, and what is broken on purpose.
PRIVATE = (
    "castle-demo/*",  # GPL-2.0
    "delta3d/*",  # LGPL-2.1
    "osgearth/*",  # LGPL-3.0
    "openmaterial/*",  # CC-BY-SA-4.0
    "usd-wg/full_assets/McUsd/*",  # textures CC-BY-SA-4.0
    "hostile/*",
    "assimp/invalid/*",
    "assimp/glTF2/*",
)

#: Pixels of a tile's picture and of the line below it, and tiles of a sheet.
WIDTH, HEIGHT, LABEL = 240, 135, 14
COLUMNS, ROWS = 7, 12


def tile(picture: Path, name: str) -> Pixels:
    """(HEIGHT + LABEL, WIDTH, 3): a picture made smaller, and its name."""
    source = oiio.ImageBuf(str(picture))
    region = oiio.ROI(0, WIDTH, 0, HEIGHT, 0, 1, 0, 3)
    small = oiio.ImageBufAlgo.resize(source, roi=region)
    if small.has_error:
        raise ValueError(f"{picture}: {small.geterror()}")
    line = oiio.ImageBuf(oiio.ImageSpec(WIDTH, LABEL, 3, oiio.UINT8))
    size = 10
    box = oiio.ImageBufAlgo.text_size(name, size)
    left = min(WIDTH - box.xend - 2, 2)  # of a long name the end is shown
    oiio.ImageBufAlgo.render_text(line, left, LABEL - 4, name, size, textcolor=(0.8,) * 3)
    rows = [np.asarray(buffer.get_pixels(oiio.UINT8)) for buffer in (small, line)]
    return np.concatenate(rows)


def sheet(tiles: Sequence[Pixels]) -> Pixels:
    """Tiles side by side, ``COLUMNS`` in a row; black where there is none."""
    blank = np.zeros_like(tiles[0])
    missing = -len(tiles) % COLUMNS
    rows = batches([*tiles, *[blank] * missing], COLUMNS)
    return np.concatenate([np.concatenate(row, axis=1) for row in rows])


def batches(items: Sequence[T], count: int) -> Iterator[Sequence[T]]:
    """``count`` after ``count`` of them."""
    return (items[i : i + count] for i in range(0, len(items), count))


def write_sheets(pictures: Sequence[tuple[str, Path]], folder: Path) -> list[Path]:
    """Write ``gallery-1.jpg`` and so on of (name, picture); the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    return list(_sheets(pictures, folder))


def _sheets(pictures: Sequence[tuple[str, Path]], folder: Path) -> Iterator[Path]:
    for number, group in enumerate(batches(pictures, COLUMNS * ROWS), 1):
        pixels = sheet([tile(picture, name) for name, picture in group])
        file = folder / f"gallery-{number}.jpg"
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8)
        spec.attribute("Compression", "jpeg:82")
        output = oiio.ImageOutput.create(str(file))
        if not output or not output.open(str(file), spec) or not output.write_image(pixels):
            raise OSError(f"{file}: {oiio.geterror()}")
        output.close()
        yield file
