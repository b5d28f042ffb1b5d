"""``TextureLoader``: the files that materials name, decoded for the GPU, tiles and all."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.images import MAX_PIXELS, read_image
from hdrusd.report import Kind, Report
from hdrusd.scene import ImageData, TextureRef
from hdrusd.usd.assets import asset_bytes, in_package

#: What stands for a tile's number in a file's name.
UDIM = "<UDIM>"

#: Texels of one texture on the GPU, whatever size it would grant: 0.7 GB with mip maps.
MAX_TEXELS = 2**26

#: UDIM: ten tiles in a row, of numbers from 1001 to 1100 (UsdPreviewSurface specification).
_FIRST, _LAST, _ACROSS = 1001, 1100, 10

_EMPTY = np.zeros((0, 0, 1), np.uint8)


class TextureLoader:
    """Decodes textures, in any thread; what is missing or broken is a finding, once.

    ``max_size``: sides that the device grants. Findings wait for ``publish``, so that their
    order does not depend on which thread was first.
    """

    def __init__(self, stage: Path, report: Report, max_size: int = 16384) -> None:
        self.place = SourceRef(stage)
        self.report = report
        self.max_size = max_size
        self._lock = threading.Lock()
        self._found: set[tuple[str, Kind, str, str]] = set()

    def __call__(self, ref: TextureRef) -> ImageData | None:
        """The image, its tiles in it for a UDIM name; None where there is none."""
        if not ref.file:
            return None
        try:
            image = self._tiled(ref.file) if UDIM in ref.file else self._read(ref.file)
        except (InputError, OSError) as problem:
            text = f"{problem}; its fallback value is shown"
            self._note(Kind.MISSING, "texture-unreadable", ref.file, text)
            return None
        return self._bounded(ref, image)

    def publish(self) -> None:
        """Report what was found since the last time, by names."""
        with self._lock:
            found, self._found = sorted(self._found), set()
        for name, kind, code, text in found:
            self.report.add(kind, code, self.place, name, text)

    def _read(self, file: str) -> ImageData:
        inside = asset_bytes(file) if in_package(file) else None
        image = read_image(Path(file), inside)
        if image.dropped:
            self._note(Kind.DROPPED, "image-channels", file, image.dropped)
        if image.pixels.dtype.kind == "f" and not np.isfinite(image.pixels).all():
            self._note(Kind.INVALID, "texture-not-finite", file, "not finite in places; 0 there")
            pixels = np.nan_to_num(image.pixels, nan=0.0, posinf=0.0, neginf=0.0)
            return replace(image, pixels=pixels)
        return image

    # -- tiles ---------------------------------------------------------------------------

    def _tiled(self, file: str) -> ImageData:
        """All tiles that are there. Raises InputError when none is."""
        tiles: dict[tuple[int, int], ImageData] = {}
        texels = 0
        for number in range(_FIRST, _LAST + 1):
            name = file.replace(UDIM, str(number))
            if not _exists(name):
                continue
            row, column = divmod(number - _FIRST, _ACROSS)
            try:
                image = self._read(name)
            except (InputError, OSError) as problem:
                text = f"{problem}; its fallback value is shown"
                self._note(Kind.MISSING, "texture-unreadable", name, text)
                continue
            texels += image.pixels.shape[0] * image.pixels.shape[1]
            if texels > MAX_PIXELS:
                text = f"tiles of more than {MAX_PIXELS} pixels; those from {number} on are left"
                self._note(Kind.CLAMPED, "texture-shrunk", file, text)
                break
            tiles[column, row] = image
        if not tiles:
            raise InputError(Path(file), f"no tile; want one of {_FIRST} to {_LAST}")
        self._note_gaps(file, set(tiles))
        integers = all(tile.integers for tile in tiles.values())
        return ImageData(_EMPTY, Path(file), integers, tiles=tiles)

    def _note_gaps(self, file: str, there: set[tuple[int, int]]) -> None:
        columns, rows = ({place[i] for place in there} for i in (0, 1))
        gaps = [
            _FIRST + _ACROSS * row + column
            for row in range(min(rows), max(rows) + 1)
            for column in range(min(columns), max(columns) + 1)
            if (column, row) not in there
        ]
        if gaps:
            shown = ", ".join(map(str, gaps[:8])) + (" and more" if len(gaps) > 8 else "")
            text = f"no tile {shown}; the fallback value is shown"
            self._note(Kind.MISSING, "texture-tiles", file, text)

    # -- size ----------------------------------------------------------------------------

    def _bounded(self, ref: TextureRef, image: ImageData) -> ImageData:
        """The image, to be halved as often as the device's limits ask for."""
        width, height = texture_size(ref, image)
        halvings = 0
        while max(width, height) > self.max_size or width * height > MAX_TEXELS:
            width, height, halvings = max(width // 2, 1), max(height // 2, 1), halvings + 1
        if halvings == 0:
            return image
        text = f"more than the device holds; shown at 1/{2**halvings} of its width and height"
        self._note(Kind.CLAMPED, "texture-shrunk", ref.file, text)
        return replace(image, halvings=halvings)

    def _note(self, kind: Kind, code: str, file: str, text: str) -> None:
        with self._lock:
            self._found.add((Path(file).name, kind, code, text))


def texture_size(ref: TextureRef, image: ImageData) -> tuple[int, int]:
    """Width and height of what goes to the GPU: a picture and its mirror image, all tiles."""
    if image.tiles is not None:
        columns, rows = ([place[i] for place in image.tiles] for i in (0, 1))
        shapes = [tile.pixels.shape for tile in image.tiles.values()]
        width = max(shape[1] for shape in shapes) * (max(columns) - min(columns) + 1)
        return width + 2, max(shape[0] for shape in shapes) * (max(rows) - min(rows) + 1) + 2
    height, width = image.pixels.shape[:2]
    extra = {"mirror": (2, 0), "black": (1, 2)}
    (across, beside), (up, above) = (extra.get(w, (1, 0)) for w in (ref.wrap_s, ref.wrap_t))
    return width * across + beside, height * up + above


def _exists(name: str) -> bool:
    return asset_bytes(name) is not None if in_package(name) else Path(name).is_file()
