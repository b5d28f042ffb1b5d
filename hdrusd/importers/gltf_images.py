"""Images, samplers and texture references of glTF.

glTF 2.0 specification, sections 3.8.2 to 3.8.4 and 3.9.4 (textureInfo);
KHR_texture_transform, EXT_texture_webp and KHR_texture_basisu.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal
from urllib.parse import unquote

from hdrusd.errors import InputError
from hdrusd.importers.gltf_accessors import Accessors, data_uri
from hdrusd.importers.gltf_document import Document, Item, one_line
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import Image, Texture, UVTransform, Wrap
from hdrusd.report import Kind

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_PATH = "/\\:"
_LONG = 64  # characters of an image's name
_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".tga", ".bmp", ".tif", ".tiff", ".dds", ".exr")
_NEAREST = (9728, 9984, 9986)  # NEAREST, NEAREST_MIPMAP_NEAREST, NEAREST_MIPMAP_LINEAR


class Textures:
    """Makes the texture of each textureInfo; an image used twice is one object."""

    def __init__(self, document: Document, accessors: Accessors, resolver: Resolver) -> None:
        self._document = document
        self._accessors = accessors
        self._resolver = resolver
        self._images: dict[int, Image] = {}
        self._names: set[str] = set()
        self._views: dict[int, bytes] = {}
        self._view_bytes = 0

    def get(self, material: Item, key: str) -> Texture | None:
        """The texture at ``key``, or None where there is none or, with a finding, no image."""
        if key not in material:
            return None
        info = material.child(key)
        index = info.index("index", "textures")
        if index is None:
            info.note(Kind.MISSING, "texture-missing", f"{key}: no usable texture index")
            return None
        texture = self._document.table("textures")[index]
        source = self._image_index(texture)
        if source is None:
            return None
        transform = info.extension("KHR_texture_transform")
        uv_set = None if transform is None else transform.integer("texCoord")
        if uv_set is None:
            uv_set = info.integer("texCoord") or 0
        wrap_s, wrap_t = self._wraps(texture)
        return Texture(
            image=self._image(source),
            uv_set=uv_set_name(uv_set),
            wrap_s=wrap_s,
            wrap_t=wrap_t,
            transform=None if transform is None else uv_transform(transform),
        )

    def _image_index(self, texture: Item) -> int | None:
        webp = texture.extension("EXT_texture_webp")
        if webp is not None and (index := webp.index("source", "images")) is not None:
            return index
        index = texture.index("source", "images")
        basis = texture.extension("KHR_texture_basisu")
        if basis is not None:
            then = "there is no other image" if index is None else "the plain image is used"
            text = f"KTX2 image of KHR_texture_basisu is not read; {then}"
            texture.note(Kind.DROPPED, "texture-ktx2", text)
            if index is None:
                return basis.index("source", "images")
        elif index is None:
            texture.note(Kind.MISSING, "texture-missing", "texture without an image that is read")
        return index

    def _image(self, index: int) -> Image:
        if index not in self._images:
            self._images[index] = self._new_image(index, self._document.table("images")[index])
        return self._images[index]

    def _new_image(self, index: int, item: Item) -> Image:
        uri = item.text("uri")
        if uri and not uri.startswith("data:"):
            reference = unquote(uri)
            self._names.add(reference)
            path = self._resolver.find(reference, item.ref, thing=item.name)
            if path is not None and path.suffix.lower() in (".ktx2", ".ktx"):
                item.note(
                    Kind.DROPPED, "texture-ktx2", f"{one_line(reference)}: KTX images are not read"
                )
                path = None
            return Image(reference, item.ref, path=path)
        data: bytes | None = None
        suffix = ""
        try:
            data = data_uri(item, uri) if uri else self._embedded(item)
            suffix = _suffix(data)
            if not suffix:
                raise item.error("embedded image is no PNG, JPEG or WebP")
        except InputError as error:
            code, data = "image-data", None
            self._document.keep_going(error, code, item.name, "the image is missing")
        return Image(self._name(index, item, suffix), item.ref, data=data)

    def _name(self, index: int, item: Item, suffix: str) -> str:
        """That of an embedded image, by which it is told: no path, short, of no other image."""
        said = "".join(c if c.isprintable() and c not in _PATH else "_" for c in item.name[:_LONG])
        said = said.strip(" .")
        stem, _, last = said.rpartition(".")
        stem = stem if stem and f".{last.lower()}" in _SUFFIXES else said
        stem = stem or f"image_{index}"
        while stem + suffix in self._names:
            stem = f"{stem}_{index}"
        self._names.add(stem + suffix)
        return stem + suffix

    def _embedded(self, item: Item) -> bytes:
        index = item.index("bufferView", "bufferViews")
        if index is None:
            raise item.error("image without uri and without a usable bufferView")
        if index not in self._views:
            view = self._accessors.view(index)
            self._view_bytes += len(view)
            # Many views of the same bytes would multiply them; images of one file do not overlap.
            if self._view_bytes > self._accessors.size:
                raise item.error("image views overlap: together more than all buffers hold")
            self._views[index] = bytes(view)
        return self._views[index]

    def _wraps(self, texture: Item) -> tuple[Wrap, Wrap]:
        index = texture.index("sampler", "samplers")
        if index is None:
            return "repeat", "repeat"
        sampler = self._document.table("samplers")[index]
        if sampler.integer("magFilter") in _NEAREST or sampler.integer("minFilter") in _NEAREST:
            text = "NEAREST filter; textures are filtered linearly"
            sampler.note(Kind.REPLACED, "sampler-nearest", text)
        return _wrap(sampler, "wrapS"), _wrap(sampler, "wrapT")


def channel(
    texture: Texture | None,
    letter: Literal["r", "g", "b", "a"],
    factor: float = 1.0,
    offset: float = 0.0,
) -> Texture | None:
    """A texture as data: ``factor`` times one of its channels plus ``offset``."""
    if texture is None:
        return None
    return replace(texture, channel=letter, scale=(factor,) * 4, bias=(offset,) * 4)


def uv_set_name(index: int) -> str:
    """The name of TEXCOORD_``index`` in ``Mesh.uvs``: st, st1, st2 and so on."""
    return f"st{index}" if index else "st"


def uv_transform(item: Item) -> UVTransform | None:
    """KHR_texture_transform for coordinates whose t runs up; None where it changes nothing.

    glTF (v down): ``u' = c sx u + s sy v + ox``, ``v' = -s sx u + c sy v + oy`` with
    c, s the cosine and sine of the rotation. With t = 1 - v on both sides this is the
    same scale, the same angle counter-clockwise as seen with t up, and the translation
    ``(ox + s sy, 1 - oy - c sy)``.

    The GLSL listing in the extension's README has the sine the other way round. Its
    prose (counter-clockwise in the UV plane as drawn, v down), the Khronos
    TextureTransformTest asset and the Khronos Blender importer agree on the above.
    """
    sx, sy = item.numbers("scale", (1.0, 1.0))
    ox, oy = item.numbers("offset", (0.0, 0.0))
    angle = item.number("rotation", 0.0)
    sine, cosine = math.sin(angle), math.cos(angle)
    transform = UVTransform(
        scale=(sx, sy),
        rotation=math.degrees(angle),
        translation=(ox + sine * sy, 1.0 - oy - cosine * sy),
    )
    return None if transform == UVTransform() else transform


def _wrap(sampler: Item, key: str) -> Wrap:
    value = sampler.integer(key)
    if value is None:
        return "repeat"
    if value not in _WRAPS:
        text = f"{key} {value} is no wrap mode of glTF; repeat is used"
        sampler.note(Kind.INVALID, "sampler-wrap", text)
    return _WRAPS.get(value, "repeat")


def _suffix(data: bytes) -> str:
    """The file suffix that the first bytes show; nothing when they show none."""
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return ".png"
    if data.startswith(b"\xff\xd8\xff"):
        return ".jpg"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return ".webp"
    return ""
