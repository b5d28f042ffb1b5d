"""Textures of an OpenFlight file: the picture, and the attribute file beside it.

``asphalt.rgb.attr`` beside ``asphalt.rgb`` says how the picture repeats and how it
meets the colour of the face. Whether a picture has alpha is read in its first bytes,
since templates that do not blend show it cut out.

Sources: OpenFlight Specification 16.5, "Texture Files", "Texture Attribute Files";
Haeberli, "The SGI Image File Format" 1.00; ISO/IEC 15948 (PNG), 11.2.2; Truevision TGA
2.0, field 5.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path

from hdrusd.errors import SourceRef
from hdrusd.importers.flt_palettes import PaletteTexture
from hdrusd.legacy.scene import Image, Texture, Wrap, environment_note
from hdrusd.report import Kind, Report

_WRAPS: dict[int, Wrap] = {0: "repeat", 1: "clamp", 3: "mirror"}
_NO_WRAP = 2  # in u or v: as the field before them says
_MODES = ("MODULATE", "BLEND", "DECAL", "REPLACE", "ADD")

#: Where an attribute file has its wraps (both, u, v), its environment and "intensity as alpha".
_WRAPS_AT, _MODE_AT, _AS_ALPHA_AT = 36, 60, 64
_ATTRIBUTES = 68  # bytes of it that are read

_NO_ALPHA = {".jpg", ".jpeg"}
_SGI, _PNG = b"\x01\xda", b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True, slots=True)
class Attributes:
    """What an attribute file says."""

    wrap_s: Wrap = "repeat"
    wrap_t: Wrap = "repeat"
    mode: str = "MODULATE"


@dataclass(slots=True)
class TextureReader:
    """Makes textures of palette entries; a picture has one record however often it is named."""

    report: Report
    _textures: dict[PaletteTexture, tuple[Texture, bool]] = field(default_factory=dict)
    _images: dict[Path, Image] = field(default_factory=dict)

    def read(self, entry: PaletteTexture) -> tuple[Texture, bool]:
        """The texture, and whether its picture may have alpha. A missing one keeps its name."""
        if entry not in self._textures:
            self._textures[entry] = self._texture(entry)
        return self._textures[entry]

    def _texture(self, entry: PaletteTexture) -> tuple[Texture, bool]:
        path = entry.resolver.find(entry.name, entry.source)
        if path is None:
            return Texture(Image(entry.name, entry.source)), False
        image = self._images.setdefault(path, Image(entry.name, entry.source, path=path))
        said = self._attributes(entry, path)
        return Texture(image, "st", said.wrap_s, said.wrap_t, mode=said.mode), has_alpha(path)

    def _attributes(self, entry: PaletteTexture, path: Path) -> Attributes:
        beside = path.with_name(f"{path.name}.attr")
        if not entry.resolver.allowed(beside):
            return Attributes()
        raw = _beginning(beside, _ATTRIBUTES)
        source = SourceRef(beside)
        if len(raw) < _WRAPS_AT + 12:
            text = f"{len(raw)} bytes; want an attribute file; repeated and modulated"
            self.report.add(Kind.INVALID, "flt-attributes", source, entry.name, text)
            return Attributes()
        both, s, t = struct.unpack_from(">3i", raw, _WRAPS_AT)
        mode, as_alpha = 0, 0
        if len(raw) >= _ATTRIBUTES:  # the oldest end before these
            mode, as_alpha = struct.unpack_from(">2i", raw, _MODE_AT)
        if not 0 <= mode < len(_MODES):
            text = f"environment {mode}; want 0 to {len(_MODES) - 1}; modulated"
            self.report.add(Kind.INVALID, "flt-attributes", source, entry.name, text)
            mode = 0
        if mode != 0:
            text = environment_note(_MODES[mode])
            self.report.add(Kind.REPLACED, "flt-texture-mode", source, entry.name, text)
        if as_alpha:
            text = "intensity as alpha; the picture is used as it is"
            self.report.add(Kind.DROPPED, "flt-texture-alpha", source, entry.name, text)
        wrap_s = self._wrap(both if s == _NO_WRAP else s, source, entry.name)
        wrap_t = self._wrap(both if t == _NO_WRAP else t, source, entry.name)
        return Attributes(wrap_s, wrap_t, _MODES[mode])

    def _wrap(self, code: int, source: SourceRef, name: str) -> Wrap:
        if code not in _WRAPS and code != _NO_WRAP:
            text = f"wrap {code}; want 0, 1 or 3; repeated"
            self.report.add(Kind.INVALID, "flt-attributes", source, name, text)
        return _WRAPS.get(code, "repeat")


def has_alpha(path: Path) -> bool:
    """Whether a picture may have alpha; True for formats that are not looked into."""
    if path.suffix.lower() in _NO_ALPHA:
        return False
    raw = _beginning(path, 32)
    if raw[:2] == _SGI and len(raw) >= 12:
        return int.from_bytes(raw[10:12], "big") in (2, 4)  # channels
    if raw[:8] == _PNG and len(raw) >= 26:
        return raw[25] in (3, 4, 6)  # a palette may have some
    if path.suffix.lower() == ".tga" and len(raw) >= 18:
        return raw[17] & 15 > 0 or raw[16] == 32
    return True


def _beginning(path: Path, size: int) -> bytes:
    """The first bytes of a file that ``Resolver`` has allowed; none where it cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(size)
    except OSError:
        return b""
