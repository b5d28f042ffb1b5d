"""Photographs as strips of code values, and the exposure that they state (Exif 2.32)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from hdrusd.errors import InputError, SourceRef
from hdrusd.images import check_size, jpeg_ends, made_up
from hdrusd.input_file import check_input
from hdrusd.report import Kind, Report

#: Names under which OpenImageIO gives what Exif calls PhotographicSensitivity.
_SPEEDS = ("Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings", "Exif:ISOSpeed")

#: No exposure is less than this, nor more than its inverse.
_LEAST = 1e-12


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
        check_input(path)
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
            if not jpeg_ends(path):
                raise InputError(path, "broken image (JPEG data without an end); want a whole file")
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
        said = self._input.geterror()
        if pixels is None or made_up(said):
            raise InputError(self.path, f"broken image ({_said(said)})")
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


@dataclass(frozen=True, slots=True)
class Stated:
    """Exposures of all pictures: ``values`` in ``unit``; ``absolute`` where they are t S / N^2.

    ``lacking``: what no picture states, by its name in Exif.
    """

    values: tuple[float, ...]
    unit: str
    absolute: bool
    lacking: tuple[str, ...] = ()


def stated_exposures(
    pictures: Sequence[Photograph], given: Sequence[float] | None, report: Report
) -> Stated:
    """The exposures that the files state, or those that are ``given``, one a picture.

    Aperture or speed that no file states are taken for the same in all, which is a finding.
    Raises InputError where a picture lacks what others state.
    """
    first = pictures[0].path
    if given is not None:
        if len(given) != len(pictures):
            raise InputError(first, f"{len(given)} exposures for {len(pictures)} pictures")
        if not all(math.isfinite(value) and _LEAST < value < 1.0 / _LEAST for value in given):
            raise InputError(first, "exposures: want numbers above 0")
        return Stated(tuple(float(value) for value in given), "relative, as given", False)
    found = [picture.exposure() for picture in pictures]
    names = {"ExposureTime": "time", "FNumber": "aperture", "PhotographicSensitivity": "speed"}
    lacking = []
    for exif, name in names.items():
        without = [p.path for p, e in zip(pictures, found, strict=True) if getattr(e, name) is None]
        if name != "time" and len(without) == len(pictures):
            lacking.append(exif)
        elif without:
            others = f" (nor in {len(without) - 1} others)" if len(without) > 1 else ""
            raise InputError(without[0], f"no {exif} in its Exif{others}; want --ev or --exposures")
    if lacking:
        text = f"no {' and '.join(lacking)} in any picture; taken for the same in all"
        report.add(Kind.ASSUMED, "bracket-aperture", SourceRef(first), "", text)
    values = [(e.time or 0.0) * (e.speed or 1.0) / (e.aperture or 1.0) ** 2 for e in found]
    for picture, value in zip(pictures, values, strict=True):
        if not _LEAST < value < 1.0 / _LEAST:
            raise InputError(picture.path, f"an exposure of {value:.3g}; want --ev or --exposures")
    apertures = {round(e.aperture, 3) for e in found if e.aperture is not None}
    if len(apertures) > 1:
        text = "apertures differ; focus and shading at the edges differ with them"
        report.add(Kind.ASSUMED, "bracket-aperture", SourceRef(first), "", text)
    return Stated(tuple(values), "s ISO / f-number^2", not lacking, tuple(lacking))


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
    return (text.strip().splitlines() or ["unknown format"])[0].partition(' ("')[0]
