"""Textures of FBX: files and embedded content, layers, shader graphs, and how they are laid.

The parent of the worker looks references up; here an image has its name or its bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hdrusd.importers.fbx_document import Document
from hdrusd.importers.fbx_held import Held
from hdrusd.importers.mtl_textures import LONGEST
from hdrusd.legacy.scene import Image, Texture, UVTransform, Wrap
from hdrusd.report import Kind

_FILE, _LAYERED = 0, 1
_WRAPS: tuple[Wrap, Wrap] = ("repeat", "clamp")
#: A share of the scale below which a shear is rounding.
_STRAIGHT = 1e-6


@dataclass(slots=True)
class TextureReader:
    """Reads the textures of one file; one picture has one record however often it is named."""

    document: Document
    _images: dict[str, Image] = field(default_factory=dict)

    def read(self, texture: Held, sets: Iterable[tuple[str, ...]], thing: str) -> Texture | None:
        """The use of a texture; None, with a finding, where no file is behind it.

        ``sets``: the names of the coordinate sets of each mesh that wears the material.
        """
        found = self._file(texture, thing)
        if found is None:
            text = f"texture {texture.name!r} is made by a program, not a picture; dropped"
            place = self.document.ref("texture", texture.name)
            self.document.note(Kind.DROPPED, "fbx-texture-shader", place, thing, text)
            return None
        return Texture(
            self.image(found),
            self._uv_set(found, sets, thing),
            _WRAPS[int(found.wrap_u) & 1],
            _WRAPS[int(found.wrap_v) & 1],
            self._transform(found, thing),
        )

    def names(self, texture: Held) -> list[str]:
        """The references of all pictures behind a texture."""
        return [self.image(found).name for found in texture.file_textures]

    def _file(self, texture: Held, thing: str) -> Held | None:
        """The texture with a picture that stands for ``texture``."""
        place = self.document.ref("texture", texture.name)
        if int(texture.type) == _FILE:
            return texture if reference(texture) or texture.content else None
        files = list(texture.file_textures)
        if int(texture.type) == _LAYERED and len(texture.layers):
            bottom = texture.layers[0].texture
            files = list(bottom.file_textures)
            lost = [self.image(found).name for found in texture.file_textures]
            lost = [name for name in lost if name not in {self.image(f).name for f in files}]
            text = f"{len(texture.layers)} layers; the lowest is shown, without {lost}"
            self.document.note(Kind.DROPPED, "fbx-texture-layers", place, thing, text)
        elif files:
            text = f"{texture.name!r} works on a picture, which is shown as it is"
            self.document.note(Kind.REPLACED, "fbx-texture-shader", place, thing, text)
        return files[0] if files else None

    def image(self, texture: Held) -> Image:
        """The picture of a texture with a file."""
        name = reference(texture)
        key = name or f"#{texture.typed_id}"  # embedded without a reference: each its own
        name = (name or texture.name or "image")[:LONGEST]
        if key not in self._images:
            place = self.document.ref("texture", texture.name)
            content = texture.content
            if not content and texture.video is not None:
                content = texture.video.content
            self._images[key] = Image(name, place, data=bytes(content) if content else None)
        return self._images[key]

    def _uv_set(self, texture: Held, sets: Iterable[tuple[str, ...]], thing: str) -> str:
        """The key of the coordinates that a texture names, as ``fbx_meshes`` numbers them."""
        wanted, known = texture.uv_set, list(sets)
        if wanted in ("", "default") or not known:
            return "st"
        places = sorted({names.index(wanted) for names in known if wanted in names})
        several = any(len(names) > 1 for names in known)
        if len(places) != 1 and several:
            text = f"coordinates {wanted!r} "
            text += "are not the same set of all meshes" if places else "are in no mesh"
            text += "; the first of them are used"
            place = self.document.ref("texture", texture.name)
            self.document.note(Kind.ASSUMED, "fbx-uv-set", place, thing, text)
        return uv_key(places[0] if places else 0)

    def _transform(self, texture: Held, thing: str) -> UVTransform | None:
        """Scale, turn and shift that take the mesh's coordinates to the picture's.

        Programs disagree. 3ds Max, Maya and Unity write as scale how often a picture is repeated;
        shift and turn are those of the picture in Maya's frame, so the coordinates go the other
        way: uv' = P S P^-1 Q R^-1 Q^-1 (uv - T), with the pivots P and Q.
        """
        place = self.document.ref("texture", texture.name)

        def stated(name: str, default: float) -> npt.NDArray[np.float64]:
            prop = texture.props.find_prop(name)
            values = (default,) * 3 if prop is None else tuple(prop.value_vec4)[:3]
            return np.array(self.document.numbers(values, (default,) * 3, place, name))

        shift, scale = stated("Translation", 0.0)[:2], stated("Scaling", 1.0)[:2]
        angle = math.radians(math.fmod(stated("Rotation", 0.0)[2], 360.0))
        if texture.props.find_bool("UVSwap", False):
            text = "u and v change places, which UsdTransform2d cannot; laid without"
            self.document.note(Kind.REPLACED, "fbx-uv-transform", place, thing, text)
        if not shift.any() and (scale == 1.0).all() and not angle:
            return None
        if not scale.all():
            text = "a scale of 0 lays one line of texels everywhere; not used"
            self.document.note(Kind.INVALID, "fbx-uv-transform", place, thing, text)
            return None
        text = "scale read as repetitions, shift and turn as those of the picture"
        self.document.note(Kind.ASSUMED, "fbx-uv-transform", place, thing, text)
        cos, sin = math.cos(angle), math.sin(angle)
        back = np.array([[cos, sin], [-sin, cos]])
        scaling, turning = stated("TextureScalingPivot", 0.0), stated("TextureRotationPivot", 0.0)
        there = back @ (-shift - turning[:2]) + turning[:2]
        x, y = (scale * (there - scaling[:2]) + scaling[:2]).tolist()
        # scale after the turn; UsdTransform2d scales first
        (a, c), (b, d) = (scale[:, None] * back).tolist()
        across = math.hypot(a, b)
        cos, sin = a / across, b / across
        along, shear = d * cos - c * sin, c * cos + d * sin
        if abs(shear) > _STRAIGHT * max(across, abs(along)):
            text = "turned, then scaled unevenly: UsdTransform2d has no shear; laid without"
            self.document.note(Kind.REPLACED, "fbx-uv-transform", place, thing, text)
        return UVTransform((across, along), math.degrees(math.atan2(sin, cos)), (x, y))


def uv_key(index: int) -> str:
    """The key of a mesh's set number ``index``."""
    return f"st{index or ''}"


def reference(texture: Held) -> str:
    """The file as written: relative to the FBX first, else wherever its maker had it."""
    for raw in (texture.raw_relative_filename, texture.raw_absolute_filename):
        if raw:
            try:
                return str(raw, "utf-8")
            except UnicodeDecodeError:  # old exporters write what Windows of the West used
                return str(raw, "cp1252", "replace")
    return str(texture.relative_filename or texture.absolute_filename or "")
