"""The palettes of an OpenFlight file: colours, materials, textures, light sources, light points.

A colour index counts in 128 steps of intensity: colour index // 128, times
(index mod 128) / 127.

Source: OpenFlight Specification 16.5, "Palette Records" (32, 64, 66, 102, 113, 128, 129)
and "Color Palette Record" for the intensity; revision 14.2 for 66.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.importers.flt_records import Document
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import RGB
from hdrusd.report import Kind

_COLORS, _TEXTURES, _OLD_MATERIALS, _LIGHTS, _MATERIALS = 32, 64, 66, 102, 113
_APPEARANCES, _ANIMATIONS = 128, 129

#: Bytes of a colour palette before its first colour, and the colours in it.
_COLORS_AT = 132
_OLD_COUNT, _COUNT = 512, 1024
_INDEXED_SINCE = 1510  # revision from which colour indices have 32 bits and a palette of 1024

#: An entry of the material palette of revision 14.2: 64 of these.
_OLD_MATERIAL, _OLD_MATERIAL_COUNT = 184, 64

_WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class PaletteMaterial:
    """Record 113: an OpenGL material."""

    name: str
    source: SourceRef
    ambient: RGB
    diffuse: RGB
    specular: RGB
    emission: RGB
    shininess: float
    alpha: float


@dataclass(frozen=True, slots=True)
class PaletteTexture:
    """Record 64: a file name, and how the file that says it finds others."""

    name: str
    source: SourceRef
    resolver: Resolver = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class PaletteLight:
    """Record 102: a light without a place. ``type``: 0 infinite, 1 local, 2 spot."""

    name: str
    source: SourceRef
    ambient: RGB
    diffuse: RGB
    specular: RGB
    type: int
    exponent: float
    cutoff: float  # degrees from the axis
    attenuation: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Appearance:
    """Records 111 and 128: how a light point looks.

    ``directionality``: 0 to all sides, 1 along its normal, 2 both ways along it.
    """

    name: str
    back: int  # colour index
    intensity: float
    back_intensity: float
    size: float  # actual pixel size: a diameter in source units
    directionality: int
    lobe: tuple[float, float, float]  # horizontal, vertical, roll, degrees
    flags: int


@dataclass(frozen=True, slots=True)
class Animation:
    """Record 129: how light points flash. ``type``: 0 flashing sequence, 1 rotating, 2 strobe,
    3 Morse code.
    """

    name: str
    type: int
    period: float  # s


def _default_colors() -> npt.NDArray[np.float32]:
    return np.ones((0, 3), np.float32)


@dataclass(slots=True)
class Palettes:
    """What the indices of one file mean."""

    colors: npt.NDArray[np.float32] = field(default_factory=_default_colors)  # (n, 3)
    materials: dict[int, PaletteMaterial] = field(default_factory=dict)
    textures: dict[int, PaletteTexture] = field(default_factory=dict)
    lights: dict[int, PaletteLight] = field(default_factory=dict)
    appearances: dict[int, Appearance] = field(default_factory=dict)
    animations: dict[int, Animation] = field(default_factory=dict)

    def color(self, index: npt.NDArray[np.int64]) -> npt.NDArray[np.float32]:
        """RGB (n, 3) of colour indices (n,); white for what the palette does not have."""
        row = index >> 7
        known = (row >= 0) & (row < len(self.colors))
        found = np.ones((len(index), 3), np.float32)
        intensity = (index[known] & 127).astype(np.float32) / np.float32(127.0)
        found[known] = self.colors[row[known]] * intensity[:, None]
        return found

    def inherited(self, own: Palettes, flags: int, version: int) -> Palettes:
        """The palettes of a file that another refers to: its own where the flags say so.

        Bits from the left: colour, material, texture, line style, sound, light source, light
        point (from 15.8). Those of the referring file, which these are, where a bit is 0.
        """

        def keeps(bit: int) -> bool:
            return bool(flags & (0x80000000 >> bit))

        points = keeps(6) or version < 1580
        return replace(
            own,
            colors=own.colors if keeps(0) else self.colors,
            materials=own.materials if keeps(1) else self.materials,
            textures=own.textures if keeps(2) else self.textures,
            lights=own.lights if keeps(5) else self.lights,
            appearances=own.appearances if points else self.appearances,
            animations=own.animations if points else self.animations,
        )


def read_palettes(document: Document) -> Palettes:
    """All palettes of a file. Of two entries with one index the last counts, with a finding."""
    made = Palettes()
    colors = document.records.of(_COLORS).tolist()
    if colors:
        made.colors = _read_colors(document, colors[0])
    for record in document.records.of(_OLD_MATERIALS).tolist():
        for index in range(_OLD_MATERIAL_COUNT):
            at = 4 + index * _OLD_MATERIAL
            if at + _OLD_MATERIAL <= document.records.size[record]:
                made.materials[index] = _material(document, record, at + 60, at)
    for record in document.records.of(_MATERIALS).tolist():
        material = _material(document, record, 8, 24)
        made.materials[_index(document, record, 4, made.materials)] = material
    for record in document.records.of(_TEXTURES).tolist():
        name = document.text(record, 4, 200)
        texture = PaletteTexture(name, document.ref(record), document.resolver)
        made.textures[_index(document, record, 204, made.textures)] = texture
    for record in document.records.of(_LIGHTS).tolist():
        made.lights[_index(document, record, 4, made.lights)] = _light(document, record)
    for record in document.records.of(_APPEARANCES).tolist():
        found = appearance(document, record, 268, document.text(record, 8, 256))
        made.appearances[_index(document, record, 264, made.appearances)] = found
    for record in document.records.of(_ANIMATIONS).tolist():
        name = document.text(record, 8, 256)
        (kind,) = document.integers(record, 296, "i")
        (period,) = document.numbers(record, 268, "f", (0.0,), name)
        entry = Animation(name, kind, period)
        made.animations[_index(document, record, 264, made.animations)] = entry
    return made


def appearance(document: Document, record: int, at: int, name: str) -> Appearance:
    """What records 111 and 128 share; ``at``: where the material code stands in them."""
    (back,) = document.integers(record, at + 4, "i")
    intensity = document.numbers(record, at + 12, "2f", (1.0, 0.0), name)
    (size,) = document.numbers(record, at + 52, "f", (0.0,), name)
    (directionality,) = document.integers(record, at + 84, "i")
    lobe = document.numbers(record, at + 88, "3f", (360.0, 360.0, 0.0), name)
    # In 111 four numbers of an animation come between.
    (flags,) = document.integers(record, at + (128 if at == 12 else 112), "I")
    return Appearance(
        name,
        back,
        intensity[0],
        intensity[1],
        size,
        directionality,
        (lobe[0], lobe[1], lobe[2]),
        flags,
    )


def _index(document: Document, record: int, offset: int, known: Mapping[int, object]) -> int:
    (index,) = document.integers(record, offset, "i")
    if index in known:
        text = f"palette entry {index} stands there twice; this one counts"
        document.add(Kind.INVALID, "flt-palette", record, "", text)
    return int(index)


def _read_colors(document: Document, record: int) -> npt.NDArray[np.float32]:
    count = _COUNT if document.version >= _INDEXED_SINCE else _OLD_COUNT
    raw = np.frombuffer(document.body(record), np.uint8)[_COLORS_AT:]
    rows = raw[: min(len(raw) // 4, count) * 4].reshape(-1, 4)
    return np.asarray(rows[:, [3, 2, 1]], np.float32) / np.float32(255.0)  # stored a, b, g, r


def _material(document: Document, record: int, name_at: int, colors_at: int) -> PaletteMaterial:
    name = document.text(record, name_at, 12)
    default = (0.2, 0.2, 0.2, 0.8, 0.8, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    found = document.numbers(record, colors_at, "14f", default, name)
    shininess = min(max(found[12], 0.0), 128.0)  # OpenGL 2.1, table 2.10
    alpha = min(max(found[13], 0.0), 1.0)
    if (shininess, alpha) != found[12:]:
        text = f"shininess {found[12]:g}, alpha {found[13]:g}; want 0 to 128, 0 to 1; clamped"
        document.add(Kind.CLAMPED, "flt-range", record, name, text)
    return PaletteMaterial(
        name,
        document.ref(record),
        rgb(found),
        rgb(found[3:]),
        rgb(found[6:]),
        rgb(found[9:]),
        shininess,
        alpha,
    )


def _light(document: Document, record: int) -> PaletteLight:
    name = document.text(record, 16, 20)
    colors = document.numbers(record, 40, "12f", (0.0, 0.0, 0.0, 1.0, *_WHITE, 1.0) + (0.0,) * 4)
    (kind,) = document.integers(record, 88, "i")
    if kind not in (0, 1, 2):
        text = f"light of type {kind}; want 0 to 2; read as a local light"
        document.add(Kind.INVALID, "flt-light", record, name, text)
        kind = 1
    shape = document.numbers(record, 132, "2f", (0.0, 180.0), name)
    falloff = document.numbers(record, 148, "3f", (1.0, 0.0, 0.0), name)
    return PaletteLight(
        name,
        document.ref(record),
        rgb(colors),
        rgb(colors[4:]),
        rgb(colors[8:]),
        kind,
        shape[0],
        shape[1],
        (falloff[0], falloff[1], falloff[2]),
    )


def rgb(values: tuple[float, ...]) -> RGB:
    """The first three of some numbers."""
    return values[0], values[1], values[2]
