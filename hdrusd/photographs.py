"""Photographs as strips of code values, and the exposure that they state (Exif 2.32)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from hdrusd.errors import InputError
from hdrusd.images import check_size

#: Names under which OpenImageIO gives what Exif calls PhotographicSensitivity.
_SPEEDS = ("Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings", "Exif:ISOSpeed")


@dataclass(frozen=True, slots=True)
class Exposure:
    """What a photograph says of itself: s, f-number and ISO speed; None where it does not."""

    time: float | None
    aperture: float | None
    speed: float | None


class Photograph:
    """An open picture whose rows are decoded strip by strip, from top to bottom.

    ``shape``: height, width and channels (1 or 3, without alpha). ``top``: the highest code, 255
    or 65535, floats being read as 16 bits with 1 saturated. Raises InputError.
    """

    def __init__(self, path: Path) -> None:
        if not path.is_file():
            raise InputError(path, "no such image")
        config = oiio.ImageSpec()
        config.attribute("oiio:UnassociatedAlpha", 1)
        opened = oiio.ImageInput.open(str(path), config)
        if opened is None:
            raise InputError(path, f"not a readable image ({_said(oiio.geterror())})")
        self.path = path
        self._input = opened
        try:
            spec = opened.spec()
            check_size(path, spec.width, spec.height, path.stat().st_size)
            if spec.depth > 1 or spec.nchannels < 1:
                raise InputError(path, "a volume or no channels; want a picture")
        except InputError:
            opened.close()
            raise
        self._spec = spec
        self.shape = (spec.height, spec.width, 3 if spec.nchannels >= 3 else 1)
        self._float = str(spec.format) in ("half", "float", "double")
        self.top = 255 if str(spec.format) == "uint8" else 65535

    def __enter__(self) -> Photograph:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._input.close()

    def rows(self, start: int, stop: int) -> npt.NDArray[Any]:
        """Codes of the rows ``start`` up to ``stop``: (n, w, c) uint8 or uint16."""
        spec, channels = self._spec, self.shape[2]
        kind = oiio.UINT8 if self.top == 255 else oiio.FLOAT if self._float else oiio.UINT16
        if spec.tile_height > 1:
            first = start // spec.tile_height * spec.tile_height
            last = min(-(-stop // spec.tile_height) * spec.tile_height, spec.height)
            x, y = spec.x, spec.y
            block = (x, x + spec.width, y + first, y + last, spec.z, spec.z + 1)
            pixels = self._input.read_tiles(0, 0, *block, 0, channels, kind)
        else:
            first, last = start, stop
            y = spec.y
            pixels = self._input.read_scanlines(0, 0, y + start, y + stop, 0, 0, channels, kind)
        if pixels is None:
            raise InputError(self.path, f"broken image ({_said(self._input.geterror())})")
        codes = np.asarray(pixels).reshape(last - first, spec.width, channels)
        codes = codes[start - first : stop - first]
        if self._float:
            if not np.isfinite(codes).all():
                raise InputError(self.path, "values that are not finite; want codes of 0 to 1")
            codes = np.rint(np.clip(codes, 0.0, 1.0) * 65535.0).astype(np.uint16)
        return codes

    def exposure(self) -> Exposure:
        """The exposure; APEX values (Exif 2.32, annex C) where the plain ones are missing."""
        time, aperture = self._number("ExposureTime"), self._number("FNumber")
        shutter = self._value("Exif:ShutterSpeedValue")
        if time is None and shutter is not None and abs(shutter) < 64.0:
            time = 2.0**-shutter
        stop = self._value("Exif:ApertureValue")
        if aperture is None and stop is not None and abs(stop) < 64.0:
            aperture = 2.0 ** (stop / 2.0)
        speeds = [self._number(name) for name in _SPEEDS]
        return Exposure(time, aperture, next((speed for speed in speeds if speed), None))

    def orientation(self) -> int:
        """How the rows lie, 1 to 8 (TIFF 6.0)."""
        said = self._value("Orientation")
        return int(said) if said is not None and 1.0 <= said <= 8.0 else 1

    def profile(self) -> str:
        """What the colour profile calls itself; empty without one."""
        said = self._spec.get_string_attribute("ICCProfile:profile_description")
        return said if isinstance(said, str) else ""

    def _value(self, name: str) -> float | None:
        said = self._spec.getattribute(name)
        if isinstance(said, (int, float)) and math.isfinite(said):
            return float(said)
        return None

    def _number(self, name: str) -> float | None:
        said = self._value(name)
        return said if said is not None and 0.0 < said < 1e9 else None


def oriented(picture: npt.NDArray[Any], orientation: int) -> npt.NDArray[Any]:
    """A picture (h, w, ...) turned and mirrored so that it stands as TIFF's tag 274 says."""
    if orientation >= 5:
        picture = picture.swapaxes(0, 1)
    if orientation in (2, 3, 6, 7):
        picture = picture[:, ::-1]
    if orientation in (3, 4, 7, 8):
        picture = picture[::-1]
    return picture


def _said(text: str) -> str:
    return (text.strip().splitlines() or ["unknown format"])[0]
