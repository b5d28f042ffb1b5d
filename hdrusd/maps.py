"""The texture files of a conversion: the look's copies, reflectance maps, HDR maps.

R = T^gamma * D per channel (Petit and Bremond 2010, section 3) as a linear half-float
EXR, alpha untouched: 11 bits are a relative rounding of 2^-11, finer than the 256
codes it is made from. An HDR map is T^gamma scaled so that its brightest texel has
luminance 1 (section 4); the material gives it its cd/m2. Every file is written once,
however many materials share it.
"""

from __future__ import annotations

import shutil
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import srgb_encode
from hdrusd.errors import InputError, SourceRef
from hdrusd.images import MAX_PIXELS, read_small_image, write_exr, write_png
from hdrusd.legacy.scene import RGB, Image, Texture
from hdrusd.map_threads import MapThreads
from hdrusd.photometry.baked import OVERVIEW
from hdrusd.photometry.reflectance import coded_reflectance, reflectance_table
from hdrusd.report import Kind, Report
from hdrusd.texture_names import file_name, format_of, named, origin
from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.material import Map

#: Formats that every USD renderer reads; others are kept as PNG.
_PORTABLE = {".png", ".jpg", ".jpeg", ".exr"}

#: Above this a half float has no value.
_HALF_MAX = 65504.0

#: Bytes of decoded pictures that are kept for the next material.
_KEPT = 512 << 20

#: Pixels of a picture that is decoded ahead; larger ones wait for their turn, one by one.
_SMALL = 1 << 24

#: Texels a side of a map's tiles.
_TILE = 512

Floats = npt.NDArray[np.float64]

#: Of a picture's width and height, rows and columns (n,) of the texels that are wanted.
Places = Callable[[int, int], tuple[npt.NDArray[Any], npt.NDArray[Any]]]


@dataclass(frozen=True, slots=True)
class _Picture:
    """Decoded pixels, (h, w, channels), and whether they are integer codes in the file."""

    pixels: npt.NDArray[np.generic]
    integers: bool
    dropped: str = ""  # what else the file has, in words


class MapWriter:
    """Writes into ``folder``; ``prefix`` is what the layers call that folder.

    ``home``: the source's folder, links followed. Files are named by where a picture lies from
    there, or by its bytes where it is no file: a project has the same names wherever it lies.
    """

    def __init__(self, folder: Path, prefix: str, home: Path, report: Report) -> None:
        self.folder = folder
        self.prefix = prefix
        self.home = home
        self.report = report
        self.written: dict[str, dict[str, object]] = {}  # file -> what it is, for the report
        self.made_of: dict[str, Image] = {}  # file -> the picture
        self._pictures: OrderedDict[str, _Picture | None] = OrderedDict()
        self._kept = 0  # bytes of them
        self._keys: dict[int, tuple[Image, str]] = {}  # of pictures, by id()
        self._broken: set[str] = set()  # keys of pictures that cannot be decoded
        self._looks: dict[str, tuple[str, bool]] = {}  # the file, and whether it holds light
        self._data: dict[str, str] = {}
        self._threads: MapThreads[_Picture | InputError | None] | None = None

    @contextmanager
    def threaded(self, images: Iterable[Image]) -> Iterator[None]:
        """Decode ``images`` ahead by threads, in that order, and write what is made behind.

        Findings stay in the order in which maps are asked for. What writing raises comes out
        of a later call, or of the end of the block, when every file is there.
        """
        keyed = ((key, image) for image in images if (key := self._key(image)) is not None)
        wanted = ((key, partial(_decoded, image, _SMALL)) for key, image in keyed)
        try:
            with MapThreads(wanted) as self._threads:
                yield
        finally:
            self._threads = None

    def look(self, texture: Texture) -> Map | None:
        """A copy of the image as it was; None where it is missing or broken."""
        key = self._key(texture.image)
        if key is None:
            return None
        if key not in self._looks:
            copy = self._copy(texture.image, key)
            if copy is None:
                return None
            self._looks[key] = copy
        name, light = self._looks[key]
        return Map(f"{self.prefix}/{name}", texture, raw=light)

    def data(self, texture: Texture) -> Map | None:
        """A copy of an image whose texels are no colours, with all their bits, to be read raw.

        None where it is missing or broken.
        """
        key = self._key(texture.image)
        if key is None or self._read(texture.image, key) is None:
            return None
        if key not in self._data:
            made = self._deep(texture.image, key) or self.look(texture)
            assert made is not None
            self._data[key] = made.file
        return Map(self._data[key], texture, raw=True)

    def grey(self, image: Image) -> bool:
        """Whether a picture has one value in every texel, and no colours."""
        key = self._key(image)
        picture = None if key is None else self._read(image, key)
        if picture is None:
            return False
        red, *others = np.moveaxis(picture.pixels, -1, 0)[:3]
        return len(others) < 2 or all(np.array_equal(red, other) for other in others)

    def reflectance(
        self, texture: Texture, diffuse: RGB, gamma: float, place: SourceRef, thing: str
    ) -> Map | None:
        """The reflectance map of a texture under diffuse colour D; None where it cannot be had."""
        key = self._key(texture.image)
        picture = None if key is None else self._read(texture.image, key)
        if key is None or picture is None:
            return None
        name = file_name(texture.image, "R", f"{key}|{gamma!r}|{diffuse!r}")
        if name not in self.written:
            clipped = 0
            if picture.pixels.dtype == np.uint8 and min(diffuse) >= 0.0 and max(diffuse) <= 1.0:
                # T and D are at most 1, so is R.
                work = partial(_write_coded, self.folder / name, picture.pixels, gamma, diffuse)
                self._do(8 * picture.pixels.size, work)
            else:
                color = linear(picture, gamma) * np.asarray(diffuse)
                wrong = np.any((color > 1.0) | (color < 0.0), axis=-1)
                clipped = int(wrong.sum())
                if clipped:
                    self.report.add(
                        Kind.CLAMPED,
                        "reflectance-clipped",
                        place,
                        thing,
                        f"{texture.image.name}: reflectance outside 0 to 1 in "
                        f"{100.0 * float(wrong.mean()):.3g} % of the texels "
                        f"({float(color.min()):.4g} to {float(color.max()):.4g}); clipped",
                    )
                self._write(name, np.clip(color, 0.0, 1.0) if clipped else color, picture)
            self.made_of[name] = texture.image
            self.written[name] = {
                "kind": "reflectance",
                "image": texture.image.name,
                "gamma": gamma,
                "diffuse": list(diffuse),
                "clipped_texels": clipped,
            }
        return Map(f"{self.prefix}/{name}", texture, raw=True)

    def luminance(self, texture: Texture, gamma: float, emission: RGB, *, peak: bool) -> Map | None:
        """An emission map in linear values, of which 1 stands for ``emission`` (cd/m2).

        ``peak``: normalised so that its brightest texel, in the light of that colour,
        has the luminance of ``emission``.
        """
        key = self._key(texture.image)
        picture = None if key is None else self._read(texture.image, key)
        if key is None or picture is None:
            return None
        gamma = 1.0 if texture.linear else gamma
        weights = _weights(emission)
        hue = tuple(np.round(weights, 9).tolist()) if peak else ()
        name = file_name(texture.image, "L", f"{key}|{gamma!r}|{peak}|{hue}")
        if name not in self.written:
            color = linear(picture, gamma)
            top = float((color @ weights).max(initial=0.0))
            if peak and top > 0.0:
                color = color / top
            wrong = ((color > _HALF_MAX) | (color < 0.0)).any(axis=-1)
            if wrong.any():
                self.report.add(
                    Kind.CLAMPED,
                    "emission-clipped",
                    texture.image.source,
                    texture.image.name,
                    f"{int(wrong.sum())} texels outside 0 to {_HALF_MAX:g}; clipped",
                )
            self._write(name, np.clip(color, 0.0, _HALF_MAX), picture)
            self.made_of[name] = texture.image
            self.written[name] = {
                "kind": "hdr" if peak else "emission",
                "image": texture.image.name,
                "gamma": gamma,
                "peak_before": top,
            }
        return Map(f"{self.prefix}/{name}", texture, raw=True, scale=emission)

    def relative_luminance(
        self, texture: Texture, gamma: float, emission: RGB, *, peak: bool
    ) -> Floats | None:
        """(h, w) of an emission map as ``luminance`` writes it: 1 is the luminance of ``emission``.

        None where it cannot be had.
        """
        key = self._key(texture.image)
        picture = None if key is None else self._read(texture.image, key)
        if picture is None:
            return None
        values = linear(picture, 1.0 if texture.linear else gamma) @ _weights(emission)
        top = float(values.max(initial=0.0))
        return np.clip(values / top if peak and top > 0.0 else values, 0.0, _HALF_MAX)

    def coded(self, image: Image, *, stated: bool) -> bool:
        """Whether a picture's texels are codes for a screen, as USD's sourceColorSpace has it.

        ``stated``: the stage says sRGB; else it leaves it to the file ("auto"), and 8-bit
        pictures of three colours are codes.
        """
        key = self._key(image)
        picture = None if key is None else self._read(image, key)
        if picture is None:
            return False
        color = picture.pixels.dtype == np.uint8 and picture.pixels.shape[2] >= 3
        return picture.integers if stated else color

    def overview(
        self, image: Image, gamma: float, places: Places | None = None
    ) -> tuple[Floats, Floats | None] | None:
        """T^gamma (h, w, 3) and alpha (h, w) or None, every k-th texel of what is too large.

        ``places``: of its width and height, rows and columns (n,); (1, n) there alone.
        """
        key = self._key(image)
        picture = None if key is None else self._read(image, key)
        if picture is None:
            return None
        step = -(-max(picture.pixels.shape[:2]) // OVERVIEW)
        pixels = picture.pixels[::step, ::step]
        if places is not None:
            pixels = pixels[places(pixels.shape[1], pixels.shape[0])][None]
        color = linear(_Picture(pixels, picture.integers), gamma)
        if pixels.shape[2] not in (2, 4):
            return color, None
        alpha = np.nan_to_num(pixels[..., -1].astype(np.float64))
        return color, np.clip(alpha / 255.0 if pixels.dtype == np.uint8 else alpha, 0.0, 1.0)

    def broken(self, image: Image) -> bool:
        """Whether a picture that something was to be made from could not be decoded."""
        key = self._key(image)
        return key is not None and key in self._broken

    def _write(self, name: str, color: npt.NDArray[Any], picture: _Picture) -> None:
        """Colour (h, w, 3) with the picture's own alpha, as half floats."""
        pixels, channels = picture.pixels, picture.pixels.shape[2]
        if channels in (2, 4):
            alpha = pixels[..., channels - 1 :].astype(np.float64)
            alpha = alpha / 255.0 if pixels.dtype == np.uint8 else alpha
            color = np.concatenate([color, np.clip(np.nan_to_num(alpha), 0.0, 1.0)], axis=-1)
        self._do(color.nbytes, partial(_write_map, self.folder / name, color))

    def _do(self, size: int, work: Callable[[], None]) -> None:
        """Have a file written, which holds ``size`` bytes until then."""
        if self._threads is None:
            work()
        else:
            self._threads.submit(size, work)

    def _deep(self, image: Image, key: str) -> Map | None:
        """Of a format that not every renderer reads, and more than the 8 bits of a look's copy."""
        picture = self._read(image, key)
        if picture is None or picture.pixels.dtype == np.uint8 or format_of(image) in _PORTABLE:
            return None
        name = file_name(image, "D", key)
        self._do(4 * picture.pixels.size, partial(_write_deep, self.folder / name, picture.pixels))
        self.made_of[name] = image
        self.written.setdefault(name, {"kind": "data", "image": image.name})
        return Map(f"{self.prefix}/{name}", Texture(image), raw=True)

    def _copy(self, image: Image, key: str) -> tuple[str, bool] | None:
        """The file, and whether its texels are linear and no codes for a screen."""
        picture = self._read(image, key)
        if picture is None:
            return None
        suffix = format_of(image)
        if suffix in _PORTABLE:
            name = file_name(image, "", key, suffix)
            self._do(0, partial(_write_copy, self.folder / name, image))
        else:
            name = file_name(image, "", key, ".png")
            codes = self._codes(image, picture)
            self._do(codes.nbytes, partial(write_png, self.folder / name, codes))
        self.made_of[name] = image
        self.written.setdefault(name, {"kind": "look", "image": image.name})
        return name, suffix in _PORTABLE and not picture.integers

    def _codes(self, image: Image, picture: _Picture) -> npt.NDArray[np.uint8]:
        """8 bits for a screen: integers in proportion, light by sRGB's curve, alpha as it is."""
        if picture.pixels.dtype == np.uint8:
            return np.asarray(picture.pixels, np.uint8)
        values = np.nan_to_num(picture.pixels.astype(np.float64), posinf=_HALF_MAX, neginf=0.0)
        if not picture.integers:
            color = values[..., : 3 if values.shape[2] > 2 else 1]
            outside = int(((color < 0.0) | (color > 1.0)).any(axis=-1).sum())
            if outside:
                most = f"{outside} of {color[..., 0].size} texels, up to {color.max():.4g}"
                text = f"{most}, are outside 0 to 1; clipped in the look's copy"
                self.report.add(Kind.CLAMPED, "look-clipped", image.source, image.name, text)
            color[:] = srgb_encode(np.clip(color, 0.0, 1.0))
        return (np.clip(values, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)

    def _key(self, image: Image) -> str | None:
        if image.missing:
            return None
        if id(image) not in self._keys:
            self._keys[id(image)] = image, origin(image, self.home)
        return self._keys[id(image)][1]

    def _read(self, image: Image, key: str) -> _Picture | None:
        if key not in self._pictures:
            self._pictures[key] = self._decode(image, key)
            self._kept += _size(self._pictures[key])
            while self._kept > _KEPT and len(self._pictures) > 1:
                self._kept -= _size(self._pictures.popitem(last=False)[1])
        return self._pictures[key]

    def _decode(self, image: Image, key: str) -> _Picture | None:
        found = None if self._threads is None else self._threads.take(key)
        if found is None:
            found = _decoded(image, MAX_PIXELS)
        if isinstance(found, InputError):
            self.report.add(Kind.INVALID, "image-broken", image.source, image.name, found.problem)
            self._broken.add(key)
            return None
        if found is not None and found.dropped:
            text = found.dropped
            self.report.add(Kind.DROPPED, "image-channels", image.source, image.name, text)
        return found


def _size(picture: _Picture | None) -> int:
    return 0 if picture is None else picture.pixels.nbytes


def _decoded(image: Image, most: int) -> _Picture | InputError | None:
    """The picture, or why there is none; None for one of more than ``most`` pixels."""
    if image.pixels is not None:
        return _Picture(image.pixels.reshape(*image.pixels.shape[:2], -1), integers=True)
    try:
        found = read_small_image(named(image), image.data, most)
    except InputError as problem:
        return problem
    return None if found is None else _Picture(found.pixels, found.integers, found.dropped)


def _write_map(path: Path, color: npt.NDArray[Any]) -> None:
    """Half floats by the compression that is quickest and smallest on what had 256 codes.

    PIZ makes a table of values for each piece of a file: of 32 lines, or of a tile.
    """
    write_exr(path, color, half=True, luminance=False, compression="piz", tile=_TILE)


def _write_deep(path: Path, pixels: npt.NDArray[np.generic]) -> None:
    """Floats as they are and integers over their largest; grey is spread over three channels."""
    values = np.nan_to_num(pixels.astype(np.float32))
    if values.shape[2] < 3:
        values = np.concatenate([values[..., :1]] * 3 + [values[..., 1:]], axis=-1)
    write_exr(path, values, luminance=False)


def _write_coded(path: Path, codes: npt.NDArray[Any], gamma: float, diffuse: RGB) -> None:
    _write_map(path, coded_reflectance(codes, gamma, diffuse))


def _write_copy(path: Path, image: Image) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if image.path is None:
        path.write_bytes(image.data or b"")
    else:
        shutil.copyfile(image.path, path)


def _weights(emission: RGB) -> Floats:
    """What the channels of a map add to the luminance of a lamp that is not white; sum 1."""
    weights = np.multiply(LUMINANCE_WEIGHTS, emission)
    total = weights.sum()
    return np.asarray(weights / total if total > 0.0 else LUMINANCE_WEIGHTS, np.float64)


def linear(picture: _Picture, gamma: float) -> Floats:
    """Colour in linear values, (h, w, 3): T^gamma for integer codes, floats as they are.

    8-bit codes go through a table, which is exact; grey is spread over three channels.
    """
    pixels = picture.pixels
    color = pixels[..., :1] if pixels.shape[2] < 3 else pixels[..., :3]
    if pixels.dtype == np.uint8:
        values = reflectance_table(gamma, 1.0)[color]
    else:
        values = np.nan_to_num(color.astype(np.float64), posinf=_HALF_MAX, neginf=0.0)
        values = values**gamma if picture.integers else values
    return np.asarray(np.broadcast_to(values, (*pixels.shape[:2], 3)))
