"""Materials that assimp read: its raw keys as the OpenGL record, and their textures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.importers import assimp_library as ai
from hdrusd.legacy.scene import (
    GREEN_UP,
    RGB,
    Image,
    Material,
    Texture,
    UVTransform,
    Wrap,
    normal_texels,
)
from hdrusd.report import Kind, Report

#: (name of the key, role, number); the role is 0 but for textures.
_Key = tuple[str, int, int]
_COLORS = ("ambient", "diffuse", "specular", "emission")
_KEYS = {"emission": "emissive"}
_UNLIT = 9  # aiShadingMode_NoShading
_TYPES = {1: "<f4", 2: "<f8", 4: "<i4"}
_STRING_TYPE = 3
#: Roles of textures (aiTextureType): the first given of each counts.
_ROLES = {"diffuse_map": (1, 12), "emission_map": (4, 14), "opacity_map": (8,), "normal_map": (6,)}
_NAMES = {2: "specular", 3: "ambient", 5: "height", 7: "shininess", 10: "light"}
_WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror", "black")
_USE_ALPHA = 0x2  # aiTextureFlags


@dataclass(slots=True)
class MaterialReader:
    """Reads the materials of one file; ``embedded`` are its aiTextures."""

    source: Path
    report: Report
    embedded: Sequence[Any]
    _images: dict[str, Image] = field(default_factory=dict)

    def read(self, record: Any, number: int) -> Material:
        """A material; what it leaves out has OpenGL's default."""
        said = _said(record)
        place = SourceRef(self.source, f"material {number}")
        name = str(said.get(("?mat.name", 0, 0), f"material_{number}"))
        values: dict[str, Any] = {}
        for key in _COLORS:
            found = _numbers(said, f"$clr.{_KEYS.get(key, key)}", 3)
            if found is not None:
                values[key] = found
        for key, path in (("shininess", "$mat.shininess"), ("alpha", "$mat.opacity")):
            one = _numbers(said, path, 1)
            if one is not None:
                values[key] = max(one[0], 0.0)
        four = _numbers(said, "$clr.diffuse", 4)
        if four is not None and "alpha" not in values:  # .x keeps its opacity there
            values["alpha"] = max(four[3], 0.0)
        left_out = frozenset((*_COLORS, "shininess")).difference(values)
        values["alpha"] = min(values.get("alpha", 1.0), 1.0)
        maps = self._maps(said, place, name)
        strength = _numbers(said, "$mat.shinpercent", 1)
        clear = values["alpha"] < 1.0 or "opacity_map" in maps
        return Material(
            name,
            place,
            **values,
            diffuse_map=maps.get("diffuse_map"),
            emission_map=maps.get("emission_map"),
            opacity_map=maps.get("opacity_map"),
            normal_map=maps.get("normal_map"),
            alpha_mode="blend" if clear else "opaque",
            two_sided=bool(_integer(said, ("$mat.twosided", 0, 0))),
            lit=_integer(said, ("$mat.shadingm", 0, 0)) != _UNLIT,
            defaults=left_out,
            extras={} if strength is None else {"specular_strength": strength[0]},
        )

    def _maps(self, said: dict[_Key, Any], place: SourceRef, name: str) -> dict[str, Texture]:
        files = {key[1:]: value for key, value in said.items() if key[0] == "$tex.file"}
        made: dict[str, Texture] = {}
        for slot, roles in _ROLES.items():
            for role, number in sorted(files):
                if role in roles and slot not in made:
                    texture = self._texture(said, role, number, place, name)
                    made[slot] = texture
                    del files[role, number]
        normal = made.get("normal_map")
        if normal is not None:
            scale, bias = normal_texels()
            made["normal_map"] = replace(normal, scale=scale, bias=bias)
            self.report.add(Kind.ASSUMED, "normal-green", place, name, GREEN_UP)
        for role, number in sorted(files):
            what = _NAMES.get(role, f"role {role}")
            text = f"{files[role, number]}: {what} texture {number}; left out"
            self.report.add(Kind.DROPPED, "assimp-texture", place, name, text)
        return made

    def _texture(
        self, said: dict[_Key, Any], role: int, number: int, place: SourceRef, name: str
    ) -> Texture:
        def integer(key: str) -> int:
            return _integer(said, (key, role, number))

        wraps = [integer(f"$tex.mapmode{axis}") for axis in "uv"]
        wrap_s, wrap_t = (_WRAPS[mode] if 0 <= mode < 4 else "repeat" for mode in wraps)
        uv_set = integer("$tex.uvwsrc")
        alpha = bool(integer("$tex.flags") & _USE_ALPHA)
        if integer("$tex.mapping"):
            text = "its texture is projected; its texture coordinates are used"
            self.report.add(Kind.REPLACED, "assimp-texture", place, name, text)
        return Texture(
            self._image(str(said["$tex.file", role, number]), place, name),
            f"st{uv_set}" if uv_set > 0 else "st",
            wrap_s,
            wrap_t,
            _transform(said.get(("$tex.uvtrafo", role, number))),
            channel="rgb" if role != _ROLES["opacity_map"][0] else "a" if alpha else "r",
        )

    def _image(self, name: str, place: SourceRef, thing: str) -> Image:
        if name not in self._images:
            self._images[name] = self._embedded(name, place, thing) or Image(name, place)
        return self._images[name]

    def _embedded(self, name: str, place: SourceRef, thing: str) -> Image | None:
        """``*0`` is the first picture that the file holds."""
        number = int(name[1:]) if name.startswith("*") and name[1:].isdigit() else -1
        if not 0 <= number < len(self.embedded):
            return None
        record = self.embedded[number]
        width, height = int(record["width"]), int(record["height"])
        made = ai.text(record["file"]) or f"embedded_{number}"
        if not height:  # a whole file
            return Image(made, place, data=ai.view(record["data"], "u1", width).tobytes())
        pixels = ai.view(record["data"], "u1", width * height * 4)
        if not len(pixels):
            text = f"the picture {made} is empty"
            self.report.add(Kind.INVALID, "assimp-texture", place, thing, text)
            return None
        blue_first = pixels.reshape(height, width, 4)
        return Image(made, place, pixels=blue_first[:, :, [2, 1, 0, 3]])


def _said(record: Any) -> dict[_Key, Any]:
    """What a material says: text, or arrays of numbers."""
    found: dict[_Key, Any] = {}
    for item in ai.records(record["properties"], record["count"], ai.PROPERTY):
        key = ai.text(item["key"]), int(item["role"]), int(item["index"])
        data = ai.view(item["data"], "u1", int(item["size"])).tobytes()
        kind = int(item["type"])
        if kind == _STRING_TYPE and len(data) >= 4:  # a length, the text, a 0
            length = int.from_bytes(data[:4], "little")
            found[key] = data[4:][:length].decode("utf-8", "replace")
        elif kind in _TYPES:
            dtype = np.dtype(_TYPES[kind])
            found[key] = np.frombuffer(data, dtype, len(data) // dtype.itemsize)
        elif len(data) in (1, 4):  # a buffer: flags
            found[key] = np.array([int.from_bytes(data, "little")])
    return found


def _numbers(said: dict[_Key, Any], key: str, count: int) -> RGB | tuple[float, ...] | None:
    found = said.get((key, 0, 0))
    if not isinstance(found, np.ndarray) or len(found) < count:
        return None
    values = tuple(float(value) for value in found[:count])
    return values if all(map(math.isfinite, values)) else None


def _integer(said: dict[_Key, Any], key: _Key) -> int:
    """A number that counts or switches, 0 where it is left out."""
    found = said.get(key)
    if not isinstance(found, np.ndarray) or not len(found) or not np.isfinite(found[0]):
        return 0
    return int(found[0])


def _transform(found: Any) -> UVTransform | None:
    """Translation, scale and a turn about the middle of the picture (radians)."""
    if not isinstance(found, np.ndarray) or len(found) < 5 or not np.isfinite(found).all():
        return None
    move_s, move_t, scale_s, scale_t, angle = (float(value) for value in found[:5])
    if (move_s, move_t, scale_s, scale_t, angle) == (0.0, 0.0, 1.0, 1.0, 0.0):
        return None
    c, s = math.cos(angle), math.sin(angle)
    middle = 0.5 - (0.5 * c - 0.5 * s), 0.5 - (0.5 * s + 0.5 * c)
    return UVTransform(
        (scale_s, scale_t), math.degrees(angle), (move_s + middle[0], move_t + middle[1])
    )
