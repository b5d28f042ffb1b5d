"""Materials of COLLADA: the common profile's phong, blinn, lambert and constant.

COLLADA 1.4.1, chapter 8, ``profile_COMMON`` and "Determining transparency"; 1.5 adds the modes
A_ZERO and RGB_ONE. What a shader leaves out is OpenGL's default and said so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from hdrusd.importers.collada_document import Document, Doubles, extras, named
from hdrusd.importers.collada_textures import TextureReader, TextureUse
from hdrusd.importers.collada_xml import Element
from hdrusd.legacy.scene import GREEN_UP, RGB, Material, normal_texels
from hdrusd.report import Kind
from hdrusd.units import LUMINANCE_WEIGHTS

_SHADERS = ("phong", "blinn", "lambert", "constant")
#: Terms that are read; any other term of a shader has no home.
_READ = frozenset(
    ("emission", "diffuse", "ambient", "specular", "shininess", "transparent", "transparency")
)
_EXTRAS = 64
_EXTRA_TEXT = 200
#: Writes transparency as one minus the opacity.
_INVERTING = "FBX COLLADA exporter"


@dataclass(frozen=True, slots=True)
class Look:
    """A material whose texture coordinate sets are not bound yet."""

    material: Material
    channels: Mapping[str, str]  # "diffuse_map", ... to the name that a mesh binds

    def bound(self, sets: Mapping[str, str]) -> Material:
        """With ``sets``: a channel's name to the key of a mesh's coordinates."""
        material = self.material
        for slot, channel in self.channels.items():
            texture = replace(getattr(material, slot), uv_set=sets.get(channel, "st"))
            material = replace(material, **{slot: texture})
        return material


class MaterialReader:
    """Reads the materials of one file; each once."""

    def __init__(self, document: Document, textures: TextureReader) -> None:
        self._document = document
        self._textures = textures
        self._known: dict[int, Look] = {}

    def read(self, element: Element) -> Look:
        """The look of a ``material``; OpenGL's default, with a finding, where it has no effect."""
        if id(element) not in self._known:
            self._known[id(element)] = self._read(element)
        return self._known[id(element)]

    def _read(self, element: Element) -> Look:
        document = self._document
        name = named(element, "material")
        plain = Look(Material(name, document.ref(element)), {})
        instance = element.child("instance_effect")
        if instance is None:
            text = "material without instance_effect; OpenGL's default is used"
            document.note(Kind.MISSING, "collada-material", element, name, text)
            return plain
        effect = document.resolve(instance, "url", "effect")
        if effect is None:
            return plain
        if instance.child("setparam") is not None:
            text = "setparam of the instance is not applied"
            document.note(Kind.DROPPED, "material-part", instance, name, text)
        profile = effect.child("profile_COMMON")
        technique = None if profile is None else profile.child("technique")
        shader = None if technique is None else technique.child(*_SHADERS)
        if profile is None or technique is None or shader is None:
            text = "effect without a phong, blinn, lambert or constant of profile_COMMON"
            document.note(Kind.DROPPED, "collada-shader", effect, name, f"{text}; default is used")
            return plain
        return _Shader(document, self._textures, name, element, effect, profile, shader).look()


@dataclass(slots=True)
class _Shader:
    document: Document
    textures: TextureReader
    name: str
    element: Element
    effect: Element
    profile: Element
    shader: Element

    def look(self) -> Look:
        """All terms together."""
        shader, kind = self.shader, self.shader.tag
        default = Material(self.name, self.document.ref(self.element))
        stated = extras(self.effect) | extras(self.profile)
        technique = self.profile.child("technique")
        if technique is not None:
            stated |= extras(technique)
        emission, emission_use = self._term("emission", (0.0, 0.0, 0.0))
        diffuse, diffuse_use = self._term("diffuse", default.diffuse)
        ambient, ambient_use = self._term("ambient", default.ambient)
        specular, specular_use = self._term("specular", (0.0, 0.0, 0.0))
        lost = [n for n, u in (("ambient", ambient_use), ("specular", specular_use)) if u]
        lost = [f"texture of {name}" for name in lost]
        defaults = {
            term for term in ("diffuse", "ambient", "specular") if shader.child(term) is None
        }
        if kind == "constant":
            defaults.discard("diffuse")
            diffuse = diffuse if shader.child("diffuse") is not None else (0.0, 0.0, 0.0)
        elif "diffuse" in defaults:
            text = f"{kind} without diffuse; {list(default.diffuse)} is used"
            self._note(Kind.ASSUMED, "collada-diffuse-default", text)
        if kind == "lambert" and any(specular):
            lost.append("specular colour of a lambert")
            specular = (0.0, 0.0, 0.0)
        shininess = self._shininess()
        alpha, opacity_use = self._opacity()
        bump = self._normal_bump()
        lost += self._lost_terms(bump)
        if lost:
            text = f"{', '.join(lost)} dropped: no home"
            self._note(Kind.DROPPED, "material-part", text)
        normal_use = None if bump is None else self._normal_map(bump)
        uses = {"diffuse_map": diffuse_use, "emission_map": emission_use, "normal_map": normal_use}
        maps = {slot: use for slot, use in uses.items() if use is not None}
        if opacity_use is not None:
            maps["opacity_map"] = opacity_use
        alpha_mode: Literal["opaque", "blend"] = (
            "blend" if alpha < 1.0 or opacity_use is not None else "opaque"
        )
        both = stated.get("double_sided")
        material = replace(
            default,
            ambient=ambient,
            diffuse=diffuse,
            specular=specular,
            emission=emission,
            shininess=shininess,
            alpha=alpha,
            diffuse_map=None if diffuse_use is None else diffuse_use.texture,
            emission_map=None if emission_use is None else emission_use.texture,
            opacity_map=None if opacity_use is None else opacity_use.texture,
            normal_map=None if normal_use is None else normal_use.texture,
            alpha_mode=alpha_mode,
            two_sided=both is None or self.document.value(both, 1.0) != 0.0,
            lit=kind != "constant",
            defaults=frozenset(defaults),
            extras=scalars(self.document, stated),
        )
        return Look(material, {slot: use.channel for slot, use in maps.items()})

    def _note(self, kind: Kind, code: str, text: str) -> None:
        self.document.note(kind, code, self.shader, self.name, text)

    def _params(self) -> dict[str, Element]:
        found: dict[str, Element] = {}
        technique = self.profile.child("technique")
        for holder in (technique, self.profile, self.effect):
            for param in () if holder is None else holder.all("newparam"):
                found.setdefault(param.get("sid"), param)
        # effects of other exporters keep the image beside the shader
        return found

    def _term(self, term: str, default: RGB) -> tuple[RGB, TextureUse | None]:
        """The colour and texture of a term; white times the texture, as it replaces the colour."""
        place = self.shader.child(term)
        if place is None:
            return default, None
        use = place.child("texture")
        if use is not None:
            read = self.textures.read(use, self._params(), self.name)
            return ((1.0, 1.0, 1.0), read) if read is not None else (default, None)
        color = self._color(place, term)
        if color is None:
            return default, None
        if term == "diffuse" and color[3] != 1.0:
            text = f"diffuse has alpha {color[3]:g}, which is no opacity in COLLADA; not used"
            self._note(Kind.DROPPED, "collada-diffuse-alpha", text)
        return (float(color[0]), float(color[1]), float(color[2])), None

    def _color(self, place: Element, term: str) -> Doubles | None:
        """Four numbers of a ``color``, or of the param that it names."""
        found = place.child("color")
        param = place.child("param")
        if found is None and param is not None:
            named_param = self._params().get(param.get("ref"))
            if named_param is not None:
                found = named_param.child("float4", "float3", "color")
        if found is None:
            self._note(Kind.INVALID, "collada-number", f"{term} without a colour; not used")
            return None
        return self.document.vector(found, 4, 3)

    def _shininess(self) -> float:
        place = self.shader.child("shininess")
        if place is None:
            return 0.0
        value = self.document.value(place, 0.0, low=0.0)
        if self.shader.tag == "blinn" and 0.0 < value < 1.0:
            text = f"shininess {value:g} of a blinn below 1; read as an exponent as it stands"
            self._note(Kind.ASSUMED, "collada-shininess", text)
        return value

    def _opacity(self) -> tuple[float, TextureUse | None]:
        """Alpha, and the texture that it comes from, of ``transparent`` and ``transparency``.

        A_ONE: alpha a t; RGB_ZERO: 1 - luminance t; A_ZERO: 1 - a t; RGB_ONE: luminance t,
        where t is ``transparency``, 1 if it is not stated.
        """
        document, place = self.document, self.shader.child("transparent")
        amount = document.number(self.shader, "transparency", 1.0, low=0.0, high=1.0)
        stated = self.shader.child("transparency") is not None
        mode = ("A_ONE" if place is None else place.get("opaque")) or "A_ONE"
        if mode not in ("A_ONE", "A_ZERO", "RGB_ZERO", "RGB_ONE"):
            self._note(Kind.INVALID, "collada-opaque", f"opaque {mode[:40]!r}; A_ONE is used")
            mode = "A_ONE"
        if stated and _INVERTING in document.generator:
            amount = 1.0 - amount
            text = f"the FBX exporter writes 1 - opacity; transparency read as {amount:g}"
            self._note(Kind.REPLACED, "collada-opacity-inverted", text)
        use = None if place is None else place.child("texture")
        if use is not None:
            return self._opacity_map(use, mode, amount)
        color = None if place is None else self._color(place, "transparent")
        alpha, grey = 1.0, 1.0
        if color is not None:
            alpha = float(color[3])
            r, g, b = (float(c) for c in color[:3])
            grey = sum(w * c for w, c in zip(LUMINANCE_WEIGHTS, (r, g, b), strict=True))
            if mode.startswith("RGB") and not r == g == b:
                text = "transparent lets colours through unequally; their luminance counts"
                self._note(Kind.REPLACED, "collada-transparent-colour", text)
        through = (alpha if mode.startswith("A") else grey) * amount
        opacity = min(max(1.0 - through if mode.endswith("ZERO") else through, 0.0), 1.0)
        if opacity == 0.0:
            text = (
                f"{mode} with transparency {amount:g} shows nothing; read the other way round, "
                "as some exporters write it"
            )
            self._note(Kind.REPLACED, "collada-opacity-inverted", text)
            opacity = 1.0
        return opacity, None

    def _opacity_map(
        self, use: Element, mode: str, amount: float
    ) -> tuple[float, TextureUse | None]:
        read = self.textures.read(use, self._params(), self.name)
        if read is None:
            return 1.0, None
        if mode.endswith("ZERO"):
            text = f"transparent texture of mode {mode}, which is 0 where it is opaque; not used"
            self._note(Kind.DROPPED, "collada-opaque", text)
            return 1.0, None
        channel: Literal["a", "r"] = "a" if mode == "A_ONE" else "r"
        if amount == 0.0:
            text = "transparency 0 of a texture would show nothing; 1 is used"
            self._note(Kind.REPLACED, "collada-opacity-inverted", text)
            amount = 1.0
        return amount, TextureUse(replace(read.texture, channel=channel), read.channel)

    def _holders(self) -> list[Element]:
        """Where an ``extra`` of the shader may stand."""
        technique = self.profile.child("technique")
        holders = [self.effect, self.profile, self.shader]
        return holders if technique is None else [*holders, technique]

    def _normal_bump(self) -> Element | None:
        """The ``bump`` of FCOLLADA and OpenCOLLADA that says it is no height: of NORMALMAP."""
        for holder in self._holders():
            found = extras(holder).get("bump")
            if found is not None and found.get("bumptype").upper() == "NORMALMAP":
                return found if found.child("texture") is not None else None
        return None

    def _normal_map(self, bump: Element) -> TextureUse | None:
        use = bump.child("texture")
        read = None if use is None else self.textures.read(use, self._params(), self.name)
        if read is None:
            return None
        self._note(Kind.ASSUMED, "normal-green", GREEN_UP)
        scale, bias = normal_texels()
        return TextureUse(replace(read.texture, scale=scale, bias=bias), read.channel)

    def _lost_terms(self, kept: Element | None) -> list[str]:
        """Terms of the shader without a home that change what is seen, but for ``kept``."""
        lost = []
        for term in self.shader.children:
            if term.tag in _READ or term.tag in ("extra", "index_of_refraction"):
                continue
            if term.tag in ("reflective", "reflectivity"):
                colour = self.shader.path("reflective", "color")
                values = self.document.numbers(colour)[:3] if colour is not None else None
                texture = self.shader.path("reflective", "texture") is not None
                shows = texture or (values is not None and bool((values != 0.0).any()))
                if term.tag == "reflectivity" or not shows:
                    continue
            lost.append(term.tag[:40])
        for holder in self._holders():
            for name, leaf in extras(holder).items():
                if leaf.child("texture") is not None and leaf is not kept:
                    lost.append(f"texture of {name[:40]}")
        return sorted(set(lost))


def scalars(document: Document, stated: Mapping[str, Element]) -> dict[str, Any]:
    """The short leaves of extras as numbers or words, 64 at most; the rest is a finding."""
    kept: dict[str, Any] = {}
    lost = []
    for name, leaf in stated.items():
        word = leaf.text.strip()
        if leaf.children or not word:
            continue
        if len(kept) >= _EXTRAS or len(word) > _EXTRA_TEXT or len(name) > _EXTRA_TEXT:
            lost.append(leaf)
            continue
        try:
            number = float(word)
        except ValueError:
            kept[name] = word
        else:
            kept[name] = number if abs(number) < 1e300 else word
    if lost:
        text = f"{len(lost)} values of extra dropped; {_EXTRAS} short ones are kept"
        document.note(Kind.DROPPED, "extras-dropped", lost[0], "", text)
    return kept
