"""Texture2D of an OpenSceneGraph file: its image, wraps and coordinate transform.

Images are named or stand in the file as base64. OpenSceneGraph keeps row 0 at
t = 0, the bottom, so pixels are turned over here. Blocks of S3 texture
compression are not: they run from the top, as in a DDS file, which OpenSceneGraph
does not turn over either. What is seen there is the picture upside down, and
``t -> 1 - t`` in the texture's transform says so.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg/Image.cpp, Texture.cpp,
TexMat.cpp; its osgconv turns a DDS into a PNG upside down unless told ``dds_flip``.
Microsoft, Programming Guide for DDS (the header).
"""

from __future__ import annotations

import binascii
import math
import struct
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np
import numpy.typing as npt

from hdrusd.importers.importer import Resolver
from hdrusd.importers.osg_geometry import uv_set
from hdrusd.importers.osg_state import Setting
from hdrusd.importers.osg_text import Document, Statement
from hdrusd.legacy.scene import Image, Texture, UVTransform, Wrap
from hdrusd.report import Kind

_WRAPS: dict[str, Wrap] = {
    "REPEAT": "repeat",
    "CLAMP": "clamp",
    "CLAMP_TO_EDGE": "clamp",
    "CLAMP_TO_BORDER": "black",
    "MIRROR": "mirror",
    "MIRRORED_REPEAT": "mirror",
}
#: OpenGL's numbers of pixel formats to which stored channel each of ours is; None is full.
_FORMATS: dict[int, tuple[int, tuple[int | None, ...]]] = {
    0x1906: (1, (None, 0)),  # GL_ALPHA
    0x1907: (3, (0, 1, 2)),  # GL_RGB
    0x1908: (4, (0, 1, 2, 3)),  # GL_RGBA
    0x1909: (1, (0,)),  # GL_LUMINANCE
    0x190A: (2, (0, 1)),  # GL_LUMINANCE_ALPHA
    0x80E0: (3, (2, 1, 0)),  # GL_BGR
    0x80E1: (4, (2, 1, 0, 3)),  # GL_BGRA
}
#: OpenGL's numbers of S3TC formats to the four letters of a DDS file and the bytes of a block.
_S3TC = {33776: (b"DXT1", 8), 33777: (b"DXT1", 8), 33778: (b"DXT3", 16), 33779: (b"DXT5", 16)}
_DXT1_OPAQUE = 33776  # GL_COMPRESSED_RGB_S3TC_DXT1_EXT
_UNSIGNED_BYTE = 5121
#: Files that hold no alpha whatever they hold.
_NO_ALPHA = {".jpg", ".jpeg", ".int"}


@dataclass(slots=True)
class TextureReader:
    """Reads the textures of one file; one image has one record however often it is named.

    ``files`` are the pictures of the files that a scene is made of: many may name one.
    """

    document: Document
    resolver: Resolver
    files: dict[Path, Image] = field(default_factory=dict)
    _images: dict[str | int, Image] = field(default_factory=dict)
    _opaque: set[int] = field(default_factory=set)  # images whose format has no alpha

    def read(
        self, texture: Statement, unit: int, mode: str, matrix: Setting | None
    ) -> tuple[Texture | None, frozenset[str]]:
        """The texture of a unit and the fields that the file leaves to the format's defaults.

        ``mode``: of its TexEnv. None, with a finding, where there is no image at all; a missing
        file keeps its name.
        """
        image = self.image(texture)
        if image is None:
            return None, frozenset()
        wrap_s, wrap_t = self._wrap(texture, "wraps"), self._wrap(texture, "wrapt")
        made = Texture(
            image,
            uv_set(unit),
            wrap_s or "clamp",
            wrap_t or "clamp",
            self._transform(image, texture, matrix),
            mode,
        )
        left = {"wrap_s": wrap_s, "wrap_t": wrap_t}
        return made, frozenset(name for name, wrap in left.items() if wrap is None)

    def has_alpha(self, image: Image) -> bool:
        """False where an image certainly has no alpha; one that has none reads as full."""
        if image.missing or id(image) in self._opaque:
            return False
        if image.pixels is not None:
            return image.pixels.shape[2] in (2, 4)
        path = image.name if image.path is None else image.path.name
        return image.data is not None or PurePosixPath(path).suffix.lower() not in _NO_ALPHA

    def name(self, texture: Statement) -> str:
        """The file name that a texture gives, without looking for the file."""
        named = self.document.field(texture, "file")
        holder = self.document.field(texture, "image")
        if named is not None and len(named.words) > 1:
            return named.words[1]
        resolved = None if holder is None else self.document.resolve(holder)
        return "" if resolved is None else self.document.word(resolved, "filename") or ""

    def image(self, texture: Statement) -> Image | None:
        """The image of a texture; None, with a finding, where there is none."""
        document = self.document
        named = document.field(texture, "file")
        if named is not None and len(named.words) > 1:  # .osg
            return self._file(named.words[1], named)
        holder = document.field(texture, "image", "imagesequence")
        holder = None if holder is None else document.resolve(holder)
        if holder is None or holder.block is None:
            self._imageless(texture)
            return None
        name = document.word(holder, "filename") or ""
        if "ImageSequence" in (document.word(holder, "classname") or holder.label):
            listed = document.field(holder, "filenames", "filenamelist")
            files = listed.block.statements if listed is not None and listed.block else []
            name = name or (files[0].words[0] if files and files[0].words else "")
            text = "image sequence; its first picture is used"
            document.add(Kind.DROPPED, "osg-image-sequence", holder, name, text)
        empty = document.numbers(holder, 3, "size") == (0.0, 0.0, 0.0)  # osgconv found no file
        held = document.field(holder, "data", "inlinefile")
        if held is not None and not (name and empty):
            key = id(holder)
            if key not in self._images:
                name = name or f"inline_{holder.line}"
                block = held.block
                if held.key == "inlinefile" and block is not None and block.data is not None:
                    file = bytes(block.data)  # a picture file as it was
                    self._images[key] = Image(name, document.ref(holder), data=file)
                else:
                    self._images[key] = self._inline(name, holder)
            return self._images[key]
        if not name:
            self._imageless(texture)
            return None
        return self._file(name, holder)

    def _imageless(self, texture: Statement) -> None:
        text = "no image; the texture is left out"
        self.document.add(Kind.MISSING, "osg-image", texture, self.document.name(texture), text)

    def _file(self, name: str, place: Statement) -> Image:
        if name not in self._images:
            source = self.document.ref(place)
            path = self.resolver.find(name, source)
            made = Image(name, source, path=path)
            self._images[name] = made if path is None else self.files.setdefault(path, made)
        return self._images[name]

    def _inline(self, name: str, place: Statement) -> Image:
        """An image from its fields; without pixels, and with a finding, where they do not fit."""
        source = self.document.ref(place)
        try:
            width, height, pixel_format, data = self._data(place)
            if pixel_format in _S3TC:
                made = Image(name, source, data=_dds(width, height, pixel_format, data))
                if pixel_format == _DXT1_OPAQUE:
                    self._opaque.add(id(made))
                return made
            packing = int(self.document.number(place, 1.0, "packing"))
            return Image(name, source, pixels=_pixels(width, height, pixel_format, packing, data))
        except ValueError as error:
            self.document.add(Kind.INVALID, "osg-image", place, name, f"inlined image: {error}")
            return Image(name, source)

    def _data(self, place: Statement) -> tuple[int, int, int, bytes]:
        size = self.document.numbers(place, 3, "size")
        if size is None or not all(1 <= n <= 1 << 20 for n in size):
            raise ValueError("no size; want width, height and 1")
        width, height, depth = (int(n) for n in size)
        if depth != 1 or width * height > self.resolver.limits.pixels:
            limit = self.resolver.limits.pixels
            raise ValueError(f"{width} x {height} x {depth}; want one layer, {limit} pixels")
        pixel_format = int(self.document.number(place, 0.0, "pixelformat"))
        kind = int(self.document.number(place, _UNSIGNED_BYTE, "datatype"))
        plain = pixel_format in _FORMATS and kind == _UNSIGNED_BYTE
        if not plain and pixel_format not in _S3TC:  # whose type is written as the format or 0
            raise ValueError(f"format {pixel_format} of type {kind}; want 8-bit or S3TC")
        data = self.document.field(place, "data")
        if data is not None and data.block is not None and data.block.data is not None:
            return width, height, pixel_format, bytes(data.block.data)
        strings = [] if data is None or data.block is None else data.block.statements
        text = strings[0].words[0] if strings and strings[0].words else ""
        try:  # the levels below the first follow, in the same text or in their own
            return width, height, pixel_format, binascii.a2b_base64(text)
        except (binascii.Error, ValueError) as error:
            raise ValueError(f"data are no base64 ({error})") from None

    def _wrap(self, texture: Statement, key: str) -> Wrap | None:
        word = self.document.word(texture, key)
        if word is None:
            return None
        found = _WRAPS.get(word.removeprefix("GL_"))
        if found is None:
            text = f"wrap {word} is unknown; clamped"
            self.document.add(Kind.INVALID, "osg-wrap", texture, "", text)
        return found

    def _transform(
        self, image: Image, texture: Statement, matrix: Setting | None
    ) -> UVTransform | None:
        values: tuple[float, ...] | None = None
        if matrix is not None and matrix.place.block is not None:
            if matrix.document.field(matrix.place, "matrix") is not None:
                values = matrix.document.numbers(matrix.place, 16, "matrix")
            else:  # .osg writes the numbers into TexMat itself
                values = tuple(matrix.place.block.numbers()[:16].tolist())
                values = values if len(values) == 16 and all(map(math.isfinite, values)) else None
        suffix = PurePosixPath(image.name if image.path is None else image.path.name).suffix
        a_file = image.data is None and image.pixels is None and suffix.lower() == ".dds"
        if a_file:
            text = "OpenSceneGraph does not turn a DDS over; t runs down for it"
            self.document.add(Kind.ASSUMED, "osg-dds-rows", texture, image.name, text)
        from_top = a_file or (image.data is not None and image.data.startswith(b"DDS "))
        try:
            return uv_transform(values or _IDENTITY, from_top=from_top)
        except ValueError as error:
            home, place = self.document, texture
            if matrix is not None:
                home, place = matrix.document, matrix.place
            home.add(Kind.DROPPED, "osg-texture-matrix", place, image.name, str(error))
            return uv_transform(_IDENTITY, from_top=from_top)


_IDENTITY = tuple(np.eye(4).ravel().tolist())


def uv_transform(matrix: tuple[float, ...], *, from_top: bool = False) -> UVTransform | None:
    """A texture matrix (16 numbers, row vectors) as scale, rotation, translation.

    ``(s, t, 0, 1) M``, then ``t -> 1 - t`` if ``from_top``. None for the identity.
    Raises ValueError for a matrix with shear or perspective.
    """
    a, b, _, p, c, d, _, q, _, _, _, _, u, v, _, w = matrix
    if from_top:
        b, d, v = -b, -d, 1.0 - v
    if (a, b, c, d, u, v) == (1.0, 0.0, 0.0, 1.0, 0.0, 0.0):
        return None
    size = math.hypot(a, b), math.hypot(c, d)
    if (p, q, w) != (0.0, 0.0, 1.0) or not 0.0 < size[0] * size[1] < math.inf:
        raise ValueError("texture matrix with perspective or without area; left out")
    if abs(a * c + b * d) > 1e-6 * size[0] * size[1]:
        raise ValueError("texture matrix with shear; left out")
    angle = math.atan2(b, a)
    scale = size[0], math.copysign(size[1], a * d - b * c)
    if abs(angle) > math.pi / 2.0:  # half a turn less, and both scales negative
        angle -= math.copysign(math.pi, angle)
        scale = -scale[0], -scale[1]
    return UVTransform(scale, math.degrees(angle), (u, v))


def _pixels(
    width: int, height: int, pixel_format: int, packing: int, data: bytes
) -> npt.NDArray[np.uint8]:
    """Pixels (height, width, channels), row 0 at the top. Raises ValueError."""
    stored, channels = _FORMATS[pixel_format]
    packing = packing if packing in (1, 2, 4, 8) else 1
    row = -(-width * stored // packing) * packing  # rows are padded to a multiple of packing
    if len(data) < row * height:
        raise ValueError(f"{len(data)} bytes; want {row * height}")
    rows = np.frombuffer(data, dtype=np.uint8, count=row * height).reshape(height, row)
    found = rows[::-1, : width * stored].reshape(height, width, stored)
    full = np.full((height, width), 255, dtype=np.uint8)
    return np.stack([full if c is None else found[:, :, c] for c in channels], axis=2)


def _dds(width: int, height: int, pixel_format: int, data: bytes) -> bytes:
    """A DDS file with the first level of an S3TC image. Raises ValueError."""
    letters, block = _S3TC[pixel_format]
    size = -(-width // 4) * -(-height // 4) * block
    if len(data) < size:
        raise ValueError(f"{len(data)} bytes; want {size}")
    caps_height_width_format_size = 0x1 | 0x2 | 0x4 | 0x1000 | 0x80000
    header = struct.pack("<7I44x", 124, caps_height_width_format_size, height, width, size, 0, 0)
    compressed = struct.pack("<2I4s20x", 32, 0x4, letters)
    texture = struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    return b"DDS " + header + compressed + texture + data[:size]
