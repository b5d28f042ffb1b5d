"""Texture maps of 3D Studio's materials: the picture, how much of it, and how it lies.

A map is mixed into what it maps by its amount: at 100 % it takes its place. Its
coordinates are scaled and turned about the middle of the picture after the offset is
taken away: uv' = R S (uv - offset - 1/2) + 1/2, so that an offset moves the picture by
that share of a tile and a scale of 2 shows it twice.

Sources: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions"
(MAT_TEXMAP and its like); 3ds Max Reference, "Coordinates Rollout (2D)".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hdrusd.importers.importer import Resolver
from hdrusd.importers.mtl_textures import locate
from hdrusd.importers.obj_text import shorten
from hdrusd.importers.tds_chunks import PERCENTAGES, Chunk, Document
from hdrusd.legacy.scene import Image, Texture, UVTransform, Wrap
from hdrusd.report import Kind

_MAPNAME, _TILING_OLD, _TILING, _ANGLE = 0xA300, 0xA350, 0xA351, 0xA35C
#: Number of a chunk with one float to its name here.
_FLOATS = {
    0xA354: "scale_u",
    0xA356: "scale_v",
    0xA358: "offset_u",
    0xA35A: "offset_v",
    _ANGLE: "angle",
}
#: Blur is a filter; tints without the flag that uses them are left-overs.
_SILENT = frozenset({0xA352, 0xA353, 0xA360, 0xA362, 0xA364, 0xA366, 0xA368})

#: Beyond so many tiles 32-bit coordinates do not tell texels apart.
_LARGEST = 1e6

_DECAL, _MIRROR, _NEGATE, _NO_TILE, _ALPHA = 0x01, 0x02, 0x08, 0x10, 0x40
#: Flags that change a picture in a way that no texture of a stage can.
_LOST_FLAGS = {_NEGATE: "negative", 0x80: "tint", 0x200: "RGB tint"}


@dataclass(frozen=True, slots=True)
class Map:
    """A map as the file has it. ``amount``: 0 to 1."""

    chunk: Chunk
    image: Image
    amount: float = 1.0
    flags: int = 0
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    angle: float = 0.0  # degrees, counter-clockwise as the picture is seen

    @property
    def uses_alpha(self) -> bool:
        """Whether the picture's alpha is read instead of its brightness."""
        return bool(self.flags & _ALPHA)

    def texture(self) -> Texture:
        """As a material's texture; see ``MapReader`` for what that leaves out."""
        wrap: Wrap = "repeat"
        if self.flags & _MIRROR:
            wrap = "mirror"
        elif self.flags & _NO_TILE:
            wrap = "clamp"
        return Texture(self.image, wrap_s=wrap, wrap_t=wrap, transform=self._transform())

    def _transform(self) -> UVTransform | None:
        if self.scale == (1.0, 1.0) and self.offset == (0.0, 0.0) and self.angle == 0.0:
            return None
        turn = -self.angle  # a picture turns one way when its coordinates turn the other
        cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        x = self.scale[0] * (-self.offset[0] - 0.5)
        y = self.scale[1] * (-self.offset[1] - 0.5)
        return UVTransform(self.scale, turn, (cos * x - sin * y + 0.5, sin * x + cos * y + 0.5))

    def __str__(self) -> str:
        """For the notes of a material that has no home for the map."""
        words = [self.image.name, f"amount {self.amount:g}", f"flags 0x{self.flags:X}"]
        words.append(f"scale {self.scale[0]:g} {self.scale[1]:g}")
        words.append(f"offset {self.offset[0]:g} {self.offset[1]:g}, angle {self.angle:g}")
        return ", ".join(words)


@dataclass(slots=True)
class MapReader:
    """Reads the maps of one file; of one name there is one image."""

    document: Document
    resolver: Resolver
    images: dict[str, Image] = field(default_factory=dict)

    def read(self, chunk: Chunk, material: str, *, find: bool = True) -> Map | None:
        """A map; None, with a finding, where it names no picture.

        ``find``: False for a map without a home, whose picture is not looked for.
        """
        document = self.document
        amount, flags, name = 1.0, 0, ""
        values = {"scale_u": 1.0, "scale_v": 1.0, "offset_u": 0.0, "offset_v": 0.0, "angle": 0.0}
        for child in document.children(chunk):
            if child.tag == _MAPNAME:
                name, _ = document.text(child)
            elif child.tag in _FLOATS:
                key = _FLOATS[child.tag]
                values[key] = self._number(child, values[key], material)
            elif child.tag in (_TILING, _TILING_OLD):
                flags = document.word(child, 0, material)
                if child.tag == _TILING_OLD and flags & _DECAL:
                    flags |= _NO_TILE
            elif child.tag in PERCENTAGES:
                amount = document.percentage(child, 1.0, material)
            else:
                document.unread(child, material, _SILENT)
        if not name.strip():
            text = "no name of a picture; the map is left out"
            document.note(Kind.INVALID, "3ds-map", chunk, material, text)
            return None
        scale = self._scale(chunk, material, values["scale_u"], values["scale_v"])
        offset = (values["offset_u"], values["offset_v"])
        image = self._image(name, chunk, material) if find else Image(name, document.ref(chunk))
        found = Map(chunk, image, amount, flags, scale, offset, math.fmod(values["angle"], 360.0))
        if find:
            self._note_flags(found, material)
        return found

    def _number(self, chunk: Chunk, default: float, material: str) -> float:
        value = self.document.number(chunk, default, material)
        if abs(value) <= _LARGEST:
            return value
        text = f"{value:g}; want at most {_LARGEST:g}; {default:g} is used"
        self.document.note(Kind.INVALID, "3ds-map", chunk, material, text)
        return default

    def _scale(self, chunk: Chunk, material: str, u: float, v: float) -> tuple[float, float]:
        if u != 0.0 and v != 0.0:
            return u, v
        text = f"scale {u:g} {v:g} shows nothing of the picture; 1 in place of 0"
        self.document.note(Kind.INVALID, "3ds-map", chunk, material, text)
        return u or 1.0, v or 1.0

    def _image(self, name: str, chunk: Chunk, material: str) -> Image:
        if name not in self.images:
            place = self.document.ref(chunk)
            path = locate([name], self.resolver, place, shorten(material))
            self.images[name] = Image(name, place, path)
        return self.images[name]

    def _note_flags(self, found: Map, material: str) -> None:
        lost = [word for flag, word in _LOST_FLAGS.items() if found.flags & flag]
        if lost:
            text = f"{shorten(found.image.name)}: {', '.join(lost)}: no home for the options"
            self.document.note(Kind.DROPPED, "3ds-map-option", found.chunk, material, text)
        if found.flags & _NO_TILE:
            text = "shown once, with the material's own colour around; its border goes on here"
            self.document.note(Kind.REPLACED, "3ds-map-decal", found.chunk, material, text)
        if found.angle:
            text = f"turned by {found.angle:g} degrees, taken as counter-clockwise"
            self.document.note(Kind.ASSUMED, "3ds-map-angle", found.chunk, material, text)
