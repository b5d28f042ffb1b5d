"""Materials of FBX: Lambert and Phong as OpenGL's record, physical shaders with PBR beside it.

FBX SDK, ``FbxSurfacePhong``: a colour times its factor; a texture stands in place of the colour;
what is let through is TransparentColor times TransparencyFactor, and Opacity, where written, one
minus the mean of that. ufbx gives these, and those of Max, Arnold, Maya and Blender, one set of
names ("maps").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from hdrusd.importers.fbx_document import Document, own_properties, user_properties
from hdrusd.importers.fbx_held import Held
from hdrusd.importers.fbx_textures import TextureReader
from hdrusd.importers.refraction import index_of
from hdrusd.legacy.scene import GREEN_UP, RGB, Material, Texture, normal_texels
from hdrusd.report import Kind

#: ufbx's shader types.
_LAMBERT, _MAX_PHYSICAL, _SPECULAR_GLOSS, _GLTF, _BLENDER = 1, 5, 7, 8, 11
#: Words of FBX for the fields of the record; those of the oldest versions too.
_WORDS = {
    "ambient": ("AmbientColor", "Ambient"),
    "diffuse": ("DiffuseColor", "Diffuse"),
    "specular": ("SpecularColor", "Specular"),
    "emission": ("EmissiveColor", "Emissive"),
    "shininess": ("ShininessExponent", "Shininess"),
    "alpha": ("TransparencyFactor", "TransparentColor", "Opacity"),
}
_LUMINANCE = "3dsMax|Parameters|emit_luminance"
_BLACK: RGB = (0.0, 0.0, 0.0)
#: Of a surface whose roughness is a picture, and which states a number that means nothing.
_MIDDLE = 0.5
#: Beyond it a normal map's strength says nothing more, and float32 would end.
_STRONGEST = 1e6
#: Index of refraction of a UsdPreviewSurface.
_IOR = 1.5


def read_materials(
    document: Document, wearers: Mapping[int, set[tuple[str, ...]]]
) -> list[Material]:
    """All materials by ufbx's number of them.

    ``wearers``: to that number the names of the coordinate sets of each mesh with the material.
    """
    textures = TextureReader(document)
    return [
        _Reader(document, textures, material, wearers.get(int(material.typed_id), set())).read()
        for material in document.scene.materials
    ]


@dataclass(slots=True)
class _Reader:
    document: Document
    textures: TextureReader
    material: Held
    sets: set[tuple[str, ...]]
    kept: set[str] = field(default_factory=set)  # references that found a place

    @property
    def name(self) -> str:
        return str(self.material.name) or f"material_{self.material.typed_id}"

    def read(self) -> Material:
        """The record, with PBR beside it where the shader is physical."""
        document, material = self.document, self.material
        place = document.ref("material", self.name)
        default = Material(self.name, place)
        own = own_properties(material)
        made = replace(
            default,
            ambient=self._color("fbx.ambient_color", "fbx.ambient_factor", default.ambient),
            diffuse=self._color("fbx.diffuse_color", "fbx.diffuse_factor", default.diffuse),
            emission=self._color("fbx.emission_color", "fbx.emission_factor", _BLACK),
            diffuse_map=self._texture("fbx.diffuse_color"),
            emission_map=self._texture("fbx.emission_color"),
            defaults=frozenset(f for f, words in _WORDS.items() if not own.keys() & set(words)),
            extras=user_properties(document, material, place) | {"shader": self._shader()},
        )
        if int(material.shader_type) != _LAMBERT:
            specular = self._color("fbx.specular_color", "fbx.specular_factor", _BLACK)
            shininess = max(self._number("fbx.specular_exponent", 0.0), 0.0)
            made = replace(made, specular=specular, shininess=shininess)
        made = replace(self._transparent(made, own), normal_map=self._normal())
        if material.features.pbr.enabled:
            made = self._physical(made)
        if material.features.double_sided.is_explicit:
            made = replace(made, two_sided=bool(material.features.double_sided.enabled))
        else:
            made = replace(made, two_sided=True)
        return self._with_lost_textures(replace(made, lit=not material.features.unlit.enabled))

    def _shader(self) -> str:
        return str(self.material.shader_type.name).lower()

    def _note(self, kind: Kind, code: str, text: str) -> None:
        self.document.note(kind, code, self.document.ref("material", self.name), self.name, text)

    # -- one map -------------------------------------------------------------------------------

    def _map(self, path: str) -> Held:
        group, _, name = path.partition(".")
        found = getattr(getattr(self.material, group), name)
        assert isinstance(found, Held)
        return found

    def _number(self, path: str, default: float) -> float:
        found = self._map(path)
        if not found.has_value:
            return default
        place = self.document.ref("material", self.name)
        return self.document.number(float(found.value_vec4.x), default, place, path)

    def _color(self, path: str, factor: str, default: RGB) -> RGB:
        """Colour times factor; white times factor where a texture stands for the colour."""
        found = self._map(path)
        color = default
        if self._worn(path) is not None:
            color = (1.0, 1.0, 1.0)
        elif found.has_value:
            place = self.document.ref("material", self.name)
            values = tuple(float(v) for v in tuple(found.value_vec4)[:3])
            r, g, b = self.document.numbers(values, default, place, path)
            color = r, g, b
        scale = self._number(factor, 1.0)
        red, green, blue = (max(c * scale, 0.0) for c in color)
        if min(color) * scale < 0.0:
            text = f"{path} ({', '.join(f'{c * scale:g}' for c in color)}); below 0 read as 0"
            self._note(Kind.CLAMPED, "light-negative", text)
        return red, green, blue

    def _worn(self, path: str) -> Held | None:
        """The texture of a map, if it is switched on and leads to a picture."""
        found = self._map(path)
        texture = found.texture
        if texture is None or not found.texture_enabled or not self.textures.names(texture):
            return None
        assert isinstance(texture, Held)
        return texture

    def _texture(self, path: str) -> Texture | None:
        found = self._map(path)
        if found.texture is None or not found.texture_enabled:
            return None
        made = self.textures.read(found.texture, self.sets, self.name)
        if made is not None:
            self.kept.add(made.image.name)
        return made

    def _data(self, path: str) -> Texture | None:
        """The picture of a number: its red."""
        found = self._texture(path) if self._worn(path) is not None else None
        return None if found is None else replace(found, channel="r")

    def _normal(self) -> Texture | None:
        """What NormalMap names; Bump, and bump_map of 3ds Max, may be heights.

        Blender writes the strength s of the mixture n' = (1 - s) z + s n as BumpFactor.
        """
        paths = ["fbx.normal_map"]
        paths += ["pbr.normal_map"] if int(self.material.shader_type) == _GLTF else []
        path = next((p for p in paths if self._worn(p) is not None), None)
        found = None if path is None else self._texture(path)
        if found is None:
            return None
        scale, bias = normal_texels()
        if self.document.application().startswith("Blender"):
            s = min(max(self._number("fbx.bump_factor", 1.0), 0.0), _STRONGEST)
            scale, bias = (2.0 * s, 2.0 * s, 2.0 * s, 1.0), (-s, -s, 1.0 - 2.0 * s, 0.0)
        elif path == "fbx.normal_map":
            self._note(Kind.ASSUMED, "normal-green", GREEN_UP)
        return replace(found, scale=scale, bias=bias)

    # -- what lets light through -----------------------------------------------------------------

    def _transparent(self, made: Material, own: Mapping[str, Held]) -> Material:
        color = self._map("fbx.transparency_color")
        factor = self._number("fbx.transparency_factor", 1.0 if color.has_value else 0.0)
        through = (1.0, 1.0, 1.0) if not color.has_value else tuple(color.value_vec4)[:3]
        mean = sum(through) / 3.0
        alpha = 1.0 - mean * factor
        if max(through) != min(through) and factor:
            text = "lets colours through unequally; their mean counts"
            self._note(Kind.REPLACED, "fbx-transparent-colour", text)
        stated = own.get("Opacity")
        if stated is not None and abs(float(stated.value_vec4.x) - alpha) > 1e-3:
            opacity = float(stated.value_vec4.x)
            text = f"Opacity {opacity:g}, and transparency says {alpha:g}; Opacity is used"
            self._note(Kind.ASSUMED, "fbx-opacity", text)
            alpha = opacity
        place = self.document.ref("material", self.name)
        alpha = min(max(self.document.number(alpha, 1.0, place, "opacity"), 0.0), 1.0)
        made = self._transparency_map(replace(made, alpha=alpha))
        if alpha == 0.0 and made.opacity_map is None:
            text = "opacity 0: nothing that wears it is seen"
            self._note(Kind.ASSUMED, "fbx-opacity", text)
        seen_through = made.alpha < 1.0 or made.opacity_map is not None
        return replace(made, alpha_mode="blend" if seen_through else "opaque")

    def _transparency_map(self, made: Material) -> Material:
        """The alpha of the diffuse picture; of another one 3ds Max and Blender write opacity."""
        for path in ("fbx.transparency_color", "fbx.transparency_factor"):
            texture = self._worn(path)
            if texture is None:
                continue
            diffuse = made.diffuse_map
            names = self.textures.names(texture)
            program = self.document.application()
            if diffuse is not None and names == [diffuse.image.name]:
                return replace(made, alpha=1.0, opacity_map=replace(diffuse, channel="a"))
            if "Max" in program or program.startswith("Blender"):
                opacity = self._texture(path)
                assert opacity is not None
                text = f"{names[0]} of its own for transparency: its red is read as opacity"
                self._note(Kind.ASSUMED, "fbx-transparency-map", text)
                return replace(made, alpha=1.0, opacity_map=replace(opacity, channel="r"))
            text = f"{names[0]} is 0 where the surface is opaque, and no picture is turned over"
            self._note(Kind.DROPPED, "fbx-transparency-map", text)
        return made

    # -- physical shaders --------------------------------------------------------------------------

    def _physical(self, made: Material) -> Material:
        """Base colour, emission and opacity of a physical shader, and its PBR numbers.

        Blender's exporter hides its numbers in a Phong, whose record stays.
        """
        kind = int(self.material.shader_type)
        roughness, roughness_map = self._roughness("roughness", "glossiness", _MIDDLE)
        metallic = min(max(self._number("pbr.metalness", 0.0), 0.0), 1.0)
        metallic_map = self._data("pbr.metalness")
        pbr = {"roughness": roughness, "metallic": metallic}
        made = replace(
            made,
            roughness_map=roughness_map,
            metallic_map=metallic_map,
            occlusion_map=self._data("pbr.ambient_occlusion"),
        )
        if kind == _BLENDER:
            return replace(made, pbr=pbr)
        specular = self._reflectance(kind)
        dull = metallic == 0.0 and metallic_map is None
        if kind == _SPECULAR_GLOSS or (dull and specular is not None):
            pbr = {"glossiness": 1.0 - roughness}
        elif specular is not None and max(specular) == min(specular):
            pbr["ior"] = index_of(specular[0])
        coat, maps = self._coat()
        pbr |= coat
        made = replace(
            made,
            **maps,
            specular=specular if specular is not None and "glossiness" in pbr else _BLACK,
            pbr=pbr,
            diffuse=self._color("pbr.base_color", "pbr.base_factor", made.diffuse),
            diffuse_map=self._texture("pbr.base_color"),
            emission=self._color("pbr.emission_color", "pbr.emission_factor", _BLACK),
            emission_map=self._texture("pbr.emission_color"),
            defaults=frozenset({"ambient", "specular", "shininess"}),
        )
        opacity = self._texture("pbr.opacity")
        if opacity is not None:
            made = replace(made, opacity_map=replace(opacity, channel="r"), alpha_mode="blend")
        elif self._map("pbr.opacity").has_value:
            alpha = min(max(self._number("pbr.opacity", 1.0), 0.0), 1.0)
            made = replace(made, alpha=alpha, alpha_mode="opaque" if alpha == 1.0 else "blend")
        if self._number("pbr.transmission_factor", 0.0) > 0.0:
            text = "light goes through it (transmission): shown as if it did not"
            self._note(Kind.DROPPED, "material-part", text)
        return self._luminance(made) if kind == _MAX_PHYSICAL else made

    def _reflectance(self, kind: int) -> RGB | None:
        """Reflectance at normal incidence; None where it is the 4 % that goes without saying."""
        color = self._color("pbr.specular_color", "pbr.specular_factor", (1.0, 1.0, 1.0))
        if kind == _SPECULAR_GLOSS:
            return color
        ior = self._number("pbr.specular_ior", _IOR)
        fresnel = ((ior - 1.0) / (ior + 1.0)) ** 2 if ior > 0.0 else 0.0
        red, green, blue = (min(fresnel * c, 1.0) for c in color)
        usual = ((_IOR - 1.0) / (_IOR + 1.0)) ** 2
        return (
            None if max(abs(c - usual) for c in (red, green, blue)) < 1e-3 else (red, green, blue)
        )

    def _roughness(self, rough: str, glossy: str, default: float) -> tuple[float, Texture | None]:
        """The number of a map ``rough``, or one minus that of ``glossy``, and its picture."""
        direct, turned = self._data(f"pbr.{rough}"), self._data(f"pbr.{glossy}")
        if direct is not None:
            return default, direct
        if turned is not None:
            return default, replace(turned, scale=(-1.0,) * 4, bias=(1.0,) * 4)
        if self._worn(f"pbr.{rough}") is not None or self._worn(f"pbr.{glossy}") is not None:
            text = f"{rough} is a picture that cannot be shown; {default:g} is used"
            self._note(Kind.ASSUMED, "fbx-roughness", text)
            return default, None
        if not self._map(f"pbr.{rough}").has_value and self._map(f"pbr.{glossy}").has_value:
            return 1.0 - min(max(self._number(f"pbr.{glossy}", 1.0 - default), 0.0), 1.0), None
        return min(max(self._number(f"pbr.{rough}", default), 0.0), 1.0), None

    def _coat(self) -> tuple[dict[str, float], dict[str, Any]]:
        """The numbers of a clear coat and its maps, by the fields of ``Material``."""
        amount = min(max(self._number("pbr.coat_factor", 0.0), 0.0), 1.0)
        coat_map = self._data("pbr.coat_factor")
        if amount == 0.0 and coat_map is None:
            return {}, {}
        roughness, rough_map = self._roughness("coat_roughness", "coat_glossiness", 0.0)
        ior = self._number("pbr.coat_ior", _IOR)
        if abs(((ior - 1.0) / (ior + 1.0)) ** 2 - 0.04) > 5e-3:
            text = f"clear coat of ior {ior:g} reflects 0.04 at normal incidence, as of 1.5"
            self._note(Kind.REPLACED, "clearcoat-ior", text)
        maps = {"clearcoat_map": coat_map, "clearcoat_roughness_map": rough_map}
        return {"clearcoat": amount, "clearcoat_roughness": roughness}, maps

    def _luminance(self, made: Material) -> Material:
        """3ds Max's Physical Material states cd/m2: weight times colour times luminance."""
        stated = self.material.props.find_prop(_LUMINANCE)
        if stated is None or not any(made.emission):
            return made
        place = self.document.ref("material", self.name)
        nits = self.document.number(float(stated.value_vec4.x), 0.0, place, "emit_luminance")
        red, green, blue = (max(nits, 0.0) * c for c in made.emission)
        return replace(made, emission=(red, green, blue), emission_cd_m2=True)

    # -- what has no home ----------------------------------------------------------------------

    def _with_lost_textures(self, made: Material) -> Material:
        """Pictures without a slot, as extras: the property that has one, and its reference."""
        lost: dict[str, str] = {}
        uses = [(str(use.material_prop).rpartition("|")[2], use) for use in self.material.textures]
        for word, use in sorted(uses, key=lambda pair: pair[0].startswith("mapM")):
            for name in self.textures.names(use.texture):  # 3ds Max has some twice, as mapM1, ...
                if name not in self.kept and name not in lost.values():
                    lost[word if word not in lost else f"{word}_{len(lost)}"] = name
        if lost:
            text = f"dropped: no home yet for the pictures of {', '.join(sorted(lost))}"
            self._note(Kind.DROPPED, "material-part", text)
        return replace(made, extras=dict(made.extras) | lost)
