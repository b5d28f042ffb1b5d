"""Images, samplers and texture uses of COLLADA effects.

COLLADA 1.4.1, chapter 8: ``texture`` names a sampler, which names a surface, which names an
image; 1.5 has no surface. Exporters of Autodesk's FBX name the image at once. Wraps stand in
the sampler, or in an ``extra`` of Maya's and 3ds Max's exporters, which also move and scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from hdrusd.importers.collada_archive import Archive
from hdrusd.importers.collada_document import Document, extras
from hdrusd.importers.collada_xml import Element
from hdrusd.importers.importer import Resolver
from hdrusd.importers.mtl_textures import LONGEST, locate
from hdrusd.legacy.scene import Image, Texture, UVTransform, Wrap
from hdrusd.report import Kind

_WRAPS: dict[str, Wrap] = {
    "WRAP": "repeat",
    "REPEAT": "repeat",
    "MIRROR": "mirror",
    "CLAMP": "clamp",
    "CLAMP_TO_EDGE": "clamp",
    "BORDER": "black",
    "NONE": "black",
}
#: Longest chain from a texture to its image: sampler, surface, and params that hand on.
_CHAIN = 8
_NEUTRAL_MODES = ("", "NONE", "MULTIPLY", "MODULATE")


@dataclass(frozen=True, slots=True)
class TextureUse:
    """A texture as an effect has it; the mesh decides which set ``channel`` means."""

    texture: Texture
    channel: str


@dataclass(slots=True)
class TextureReader:
    """Reads the textures of one file; one image has one record however often it is named.

    ``archive``: what the file stands in, if it does; its members go before files.
    """

    document: Document
    resolver: Resolver
    archive: Archive | None = None
    _images: dict[int | str, Image] = field(default_factory=dict)

    def read(self, use: Element, params: dict[str, Element], thing: str) -> TextureUse | None:
        """The use of a texture; None, with a finding, where no image can be named.

        ``params``: the ``newparam`` of the effect and its profile by sid.
        """
        document = self.document
        chain = self._chain(use, params)
        image = self._image(chain[-1], use, thing) if chain else None
        if image is None:
            text = f"texture {use.get('texture')[:80]!r} leads to no image; not used"
            document.note(Kind.MISSING, "texture-missing", use, thing, text)
            return None
        sampler = next((c for c in chain if c.tag in ("sampler2D", "sampler_image")), None)
        stated = extras(use)
        wrap_s, wrap_t = self._wraps(sampler, stated, use, thing)
        nearest = sampler is not None and sampler.words("magfilter") == "NEAREST"
        if nearest:
            text = "a nearest filter; textures are filtered linearly"
            document.note(Kind.REPLACED, "sampler-nearest", use, thing, text)
        mode = "" if "blend_mode" not in stated else stated["blend_mode"].text.strip().upper()
        if mode not in _NEUTRAL_MODES:
            text = f"blend_mode {mode[:40]}; shown as MODULATE"
            document.note(Kind.REPLACED, "collada-texture-mode", use, thing, text)
        transform = self._transform(stated)
        made = Texture(image, "st", wrap_s, wrap_t, transform, mode or "MODULATE")
        return TextureUse(made, use.get("texcoord"))

    # -- from the texture to the image -------------------------------------------------------

    def _chain(self, use: Element, params: dict[str, Element]) -> list[Element]:
        """Sampler, surface, image as far as they are there; empty where it leads nowhere."""
        name = use.get("texture")
        chain: list[Element] = []
        for _ in range(_CHAIN):
            param = params.get(name)
            if param is None:
                image = self._by_id(name)
                return [*chain, image] if image is not None else []
            inner = param.child("sampler2D", "surface", "sampler_image", "samplerCUBE", "sampler3D")
            if inner is None:
                return []
            chain.append(inner)
            instance = inner.child("instance_image")
            if instance is not None:
                name = instance.get("url").removeprefix("#")
                image = self._by_id(name)
                return [*chain, image] if image is not None else []
            name = inner.words("source") or inner.words("init_from")
        return []

    def _by_id(self, name: str) -> Element | None:
        found = self.document.ids.get(name.removeprefix("#"))
        if found is not None and found.tag == "image":
            return found
        library = self.document.root.child("library_images")
        images = () if library is None else library.all("image")
        return next((image for image in images if name and image.get("name") == name), None)

    def _image(self, element: Element, use: Element, thing: str) -> Image | None:
        if element.tag != "image":
            return None
        if id(element) in self._images:
            return self._images[id(element)]
        source = element.child("init_from")
        inner = None if source is None else source.child("ref")
        reference = (inner or source or element).text.strip()
        place = self.document.ref(element)
        if not reference:
            what = ", ".join(child.tag for child in element.children)[:80] or "nothing"
            text = f"image of {what}; want init_from with a file; not read"
            self.document.note(Kind.DROPPED, "collada-image", element, element.get("id"), text)
            made = Image(element.get("id") or "image", place)
        else:
            made = self._file(reference, element, thing)
        self._images[id(element)] = made
        return made

    def _file(self, reference: str, element: Element, thing: str) -> Image:
        place = self.document.ref(element)
        plain = file_name(reference)
        names = list(dict.fromkeys([unquote(plain), plain]))
        if self.archive is not None:
            packed = self.archive.picture(names, place, thing)
            if packed is not None:
                return Image(reference[:LONGEST], place, data=packed)
        path: Path | None = None
        try:
            path = locate(names, self.resolver, place, thing)
        except (OSError, ValueError):  # a name that no file system has
            text = f"{reference[:200]!r}: not a file name"
            self.document.note(Kind.MISSING, "file-missing", element, thing, text)
        return Image(reference[:LONGEST], place, path=path)

    # -- how it is laid ------------------------------------------------------------------------

    def _wraps(
        self, sampler: Element | None, stated: dict[str, Element], use: Element, thing: str
    ) -> tuple[Wrap, Wrap]:
        wraps: list[Wrap] = []
        for axis, letter in (("s", "U"), ("t", "V")):
            word = "" if sampler is None else sampler.words(f"wrap_{axis}").upper()
            wrap = _WRAPS.get(word, "repeat")
            if word and word not in _WRAPS:
                text = f"wrap_{axis} {word[:40]!r} is unknown; repeated"
                self.document.note(Kind.INVALID, "sampler-wrap", use, thing, text)
            if not word:
                wrap = "repeat" if _flag(stated, f"wrap{letter}", default=True) else "black"
                if _flag(stated, f"mirror{letter}", default=False):
                    wrap = "mirror"
            wraps.append(wrap)
        return wraps[0], wraps[1]

    def _transform(self, stated: dict[str, Element]) -> UVTransform | None:
        """Repeat and offset of Maya's and 3ds Max's exporters: uv' = repeat uv + offset."""

        def number(name: str, default: float) -> float:
            place = stated.get(name)
            return default if place is None else self.document.value(place, default)

        scale = number("repeatU", 1.0), number("repeatV", 1.0)
        offset = number("offsetU", 0.0), number("offsetV", 0.0)
        # Maya turns by rotateUV about the middle of the picture.
        angle = number("rotateUV", 0.0)
        if (scale, offset, angle) == ((1.0, 1.0), (0.0, 0.0), 0.0) or 0.0 in scale:
            return None
        if angle:
            c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            x, y = offset[0] - 0.5, offset[1] - 0.5
            offset = c * x - s * y + 0.5, s * x + c * y + 0.5
        return UVTransform(scale, angle, offset)


def file_name(reference: str) -> str:
    """The path in a file URL, or the reference: ``file:///C:/a/b.png`` is ``C:/a/b.png``."""
    plain = reference.replace("\\", "/")
    if plain[:5].lower() == "file:":
        plain = plain[5:]
        if plain.startswith("//"):
            plain = plain[2:].lstrip("/") if plain[2:3] == "/" else plain[2:]
            plain = plain if plain[1:2] == ":" else f"/{plain}"
        if plain[:1] == "/" and plain[2:3] == ":":
            plain = plain[1:]
    elif plain[:1] == "/" and plain[2:3] == ":":  # 3ds Max writes /C:/maps/a.png
        plain = plain[1:]
    return plain


def _flag(stated: dict[str, Element], name: str, *, default: bool) -> bool:
    place = stated.get(name)
    word = "" if place is None else place.text.strip().lower()
    return default if not word else word not in ("0", "false", "0.0")
