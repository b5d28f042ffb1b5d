"""Materials from accumulated OpenSceneGraph state.

The vertex colours' part follows OpenSceneGraph, which sets glColor before it draws:

* unlit (GL_LIGHTING off): what is seen is the vertex colour; without one, the
  Material's diffuse colour; without that, white;
* lit, ColorMode DIFFUSE or AMBIENT_AND_DIFFUSE: vertex colours replace the diffuse
  colour, which becomes white here and is multiplied by ``Mesh.colors``;
* lit, ColorMode OFF (a Material's default): vertex colours are not used;
* lit, no Material at all: OpenSceneGraph's global state has ColorMode
  AMBIENT_AND_DIFFUSE, so vertex colours replace the diffuse colour 0.8.

Sources: OpenSceneGraph 3.6, src/osg/Material.cpp (apply), src/osg/StateSet.cpp
(setGlobalDefaults), src/osgWrappers/serializers/osg/Material.cpp,
src/osgWrappers/deprecated-dotosg/osg/Material.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from pathlib import PurePosixPath
from typing import Any, Literal

from hdrusd.errors import SourceRef
from hdrusd.importers.osg_geometry import uv_set
from hdrusd.importers.osg_state import RenderState, Setting
from hdrusd.importers.osg_text import Document, Statement, listed, triple
from hdrusd.importers.osg_texture_maps import further_map
from hdrusd.importers.osg_textures import TextureReader
from hdrusd.legacy.scene import GREEN_UP, RGB, Material, Texture, environment_note, normal_texels
from hdrusd.report import Kind

#: Our field: names in .osgt and .osg, and the value of osg::Material's constructor.
_COLOURS: dict[str, tuple[tuple[str, ...], tuple[float, float, float, float]]] = {
    "ambient": (("ambient", "ambientcolor"), (0.2, 0.2, 0.2, 1.0)),
    "diffuse": (("diffuse", "diffusecolor"), (0.8, 0.8, 0.8, 1.0)),
    "specular": (("specular", "specularcolor"), (0.0, 0.0, 0.0, 1.0)),
    "emission": (("emission", "emissioncolor", "emissivecolor"), (0.0, 0.0, 0.0, 1.0)),
}
_FIELDS = frozenset({*_COLOURS, "shininess"})
_WHITE: RGB = (1.0, 1.0, 1.0)
_SHININESS_MAX = 128.0  # OpenGL 2.1, table 2.10; osg::Material clamps to it
_USUAL_BLENDING = ("SRC_ALPHA", "ONE_MINUS_SRC_ALPHA")


@dataclass(frozen=True, slots=True)
class Look:
    """What a state makes of a mesh."""

    material: int  # index into the scene's materials
    use_colors: bool  # whether Mesh.colors is used
    two_sided: bool
    left_handed: bool


class MaterialReader:
    """Makes materials from states; equal ones are one.

    What a state says may stand in several files, where one is part of another.
    """

    def __init__(self, materials: list[Material]) -> None:
        self.materials = materials
        self._textures: dict[int, TextureReader] = {}  # by document
        self._looks: dict[tuple[int, bool, frozenset[str]], Look] = {}
        self._known: dict[tuple[Any, ...], int] = {}
        self._unnamed = 0

    def add_file(self, document: Document, textures: TextureReader) -> None:
        """A file that states may refer to, and what reads its textures."""
        self._textures[id(document)] = textures

    def look(
        self, document: Document, state: RenderState, *, colored: bool, uvs: Collection[str]
    ) -> Look:
        """The look under ``state`` of a mesh of ``document``.

        ``colored``: it has vertex colours; ``uvs``: its sets of texture coordinates.
        """
        key = id(state), colored, frozenset(uvs)
        if key not in self._looks:
            self._looks[key] = self._look(document, state, colored, uvs)
        return self._looks[key]

    def _look(
        self, document: Document, state: RenderState, colored: bool, uvs: Collection[str]
    ) -> Look:
        two_sided, left_handed = self._sides(state)
        lit = state.mode("GL_LIGHTING") is not False
        made, use_colors = self._colours(
            document, state.attribute("Material"), colored=colored, lit=lit
        )
        alpha_mode, cutoff = self._transparency(document, state, made.name)
        diffuse_map, left_out, has_alpha = None, frozenset[str](), False
        units = [unit for unit in state.units() if self._enabled(state, unit, made.name)]
        if units:
            diffuse_map, left_out, has_alpha = self._texture(state, units[0])
        if diffuse_map is not None and diffuse_map.mode != "MODULATE":
            texture, text = state.settings[units[0], "Texture"], environment_note(diffuse_map.mode)
            texture.add(Kind.REPLACED, "osg-texture-mode", diffuse_map.image.name, text)
        opacity_map = None
        if alpha_mode != "opaque" and diffuse_map and has_alpha:
            opacity_map = replace(diffuse_map, channel="a")
        made = self._further_units(state, units, made, uvs)
        stem = ""
        if diffuse_map is not None:
            stem = PurePosixPath(diffuse_map.image.name.replace("\\", "/")).stem
        made = replace(
            made,
            name=made.name or stem,
            diffuse_map=diffuse_map,
            opacity_map=opacity_map,
            alpha_mode=alpha_mode,
            alpha_cutoff=cutoff,
            two_sided=two_sided,
            lit=lit,
            defaults=made.defaults | left_out,
        )
        return Look(self._index(made), use_colors, two_sided, left_handed)

    def _index(self, made: Material) -> int:
        """The number of an equal material; a new one is added."""
        key = tuple(_comparable(getattr(made, f.name)) for f in fields(made) if f.name != "source")
        if key not in self._known:
            self._known[key] = len(self.materials)
            if not made.name:
                made = replace(made, name=f"state_{self._unnamed}")
                self._unnamed += 1
            self.materials.append(made)
        return self._known[key]

    def _colours(
        self, home: Document, setting: Setting | None, *, colored: bool, lit: bool
    ) -> tuple[Material, bool]:
        """The colours of a Material, and whether vertex colours are used with them."""
        if setting is None:
            white = colored or not lit
            diffuse = _WHITE if white else triple(_COLOURS["diffuse"][1])
            source = SourceRef(home.file)
            return Material("", source, diffuse=diffuse, defaults=_FIELDS), colored
        document, place = setting.document, setting.place
        name = document.name(place)
        found: dict[str, tuple[float, ...]] = {}
        for field_name, (keys, _) in _COLOURS.items():
            values = _face_values(document, place, name, keys, 4)
            if values is not None:
                found[field_name] = values
        shininess = _face_values(document, place, name, ("shininess",), 1)
        if shininess is not None:
            found["shininess"] = (_clamped_shininess(document, place, name, shininess[0]),)
        colours = {k: found.get(k, default) for k, (_, default) in _COLOURS.items()}
        transparency = document.numbers(place, 1, "transparency")  # .osg only
        alpha = colours["diffuse"][3] if transparency is None else 1.0 - transparency[0]
        mode = document.word(place, "colormode") or "OFF"
        replaces = not lit or mode in ("DIFFUSE", "AMBIENT_AND_DIFFUSE")
        if colored and not replaces:
            text = f"ColorMode {mode}: vertex colours are not used for the diffuse colour; dropped"
            document.add(Kind.DROPPED, "osg-vertex-colours", place, name, text)
        diffuse = triple(colours["diffuse"])
        if colored and replaces:
            text = f"vertex colours replace the diffuse colour {listed(colours['diffuse'])}"
            document.add(Kind.REPLACED, "osg-vertex-colours", place, name, text)
            diffuse, alpha = _WHITE, 1.0
        made = Material(
            name,
            document.ref(place),
            ambient=triple(colours["ambient"]),
            diffuse=diffuse,
            specular=triple(colours["specular"]),
            emission=triple(colours["emission"]),
            shininess=found.get("shininess", (0.0,))[0],
            alpha=min(max(alpha, 0.0), 1.0),
            defaults=_FIELDS.difference(found),
            extras={} if mode == "OFF" else {"color_mode": mode},
        )
        return made, colored and replaces

    def _transparency(
        self, document: Document, state: RenderState, name: str
    ) -> tuple[Literal["opaque", "mask", "blend"], float]:
        function = state.attribute("BlendFunc")
        blend = state.mode("GL_BLEND")
        if blend is None and (function is not None or state.hint == "transparent"):
            blend = True
            text = "no GL_BLEND, but a blend function or the transparent bin; taken as blended"
            if function is not None:
                function.add(Kind.ASSUMED, "osg-blend", name, text)
            else:
                document.report.add(Kind.ASSUMED, "osg-blend", SourceRef(document.file), name, text)
        if blend and function is not None:
            source = function.word("sourcergb", "source") or _USUAL_BLENDING[0]
            target = function.word("destinationrgb", "destination") or _USUAL_BLENDING[1]
            if (source, target) != _USUAL_BLENDING:
                text = f"blending {source}, {target}; shown as {', '.join(_USUAL_BLENDING)}"
                function.add(Kind.REPLACED, "osg-blend-function", name, text)
        test = state.attribute("AlphaFunc")
        if test is None or state.mode("GL_ALPHA_TEST") is not True:
            return ("blend" if blend else "opaque"), 0.5
        comparison = test.word("function", "comparisonfunc") or "ALWAYS"
        cutoff = test.document.number(test.place, 1.0, "referencevalue")
        if comparison not in ("GREATER", "GEQUAL"):
            if comparison != "ALWAYS":
                text = f"alpha test {comparison} {cutoff:g}; want GREATER or GEQUAL; dropped"
                test.add(Kind.DROPPED, "osg-alpha-test", name, text)
            return ("blend" if blend else "opaque"), 0.5
        cutoff = min(max(cutoff, 0.0), 1.0)
        if not blend:
            return "mask", cutoff
        if cutoff > 0.0:
            text = f"alpha test {comparison} {cutoff:g} beside blending; blending is kept"
            test.add(Kind.DROPPED, "osg-alpha-test", name, text)
        return "blend", cutoff

    def _texture(
        self, state: RenderState, unit: int
    ) -> tuple[Texture | None, frozenset[str], bool]:
        """The texture of a unit, what the file leaves out of it, and whether it may have alpha."""
        found = state.settings[unit, "Texture"]
        textures = self._textures[id(found.document)]
        mode = _environment(state, unit) or "MODULATE"
        made, left_out = textures.read(found.place, unit, mode, state.attribute("TexMat", unit))
        return made, left_out, made is not None and textures.has_alpha(made.image)

    def _further_units(
        self, state: RenderState, units: list[int], made: Material, uvs: Collection[str]
    ) -> Material:
        """The material with the maps that further units are; the others are findings and noted."""
        names = {}
        taken: dict[str, Texture] = {}
        for unit in units[1:]:
            found = state.settings[unit, "Texture"]
            name = self._textures[id(found.document)].name(found.place)
            again = found.place is state.settings[units[0], "Texture"].place
            role, what = further_map(name, _environment(state, unit), again=again)
            said = f"texture unit {unit}, {name}: {what}"
            texture = self._map(state, unit, uvs) if role and role not in taken else None
            if role == "normal" and texture is not None and texture.transform is not None:
                texture = None  # which turns its directions too
            if role is None or texture is None:
                names[str(unit)] = name
                text = f"{said}; only unit {units[0]} is kept"
                found.add(Kind.DROPPED, "osg-texture-unit", made.name, text)
                continue
            taken[role] = texture
            code = "osg-emission-map" if role == "emission" else "osg-normal-map"
            found.add(Kind.GUESSED, code, made.name, f"{said}; taken as that")
            if role == "normal":
                found.add(Kind.ASSUMED, "normal-green", made.name, GREEN_UP)
        if "normal" in taken:
            scale, bias = normal_texels()
            made = replace(made, normal_map=replace(taken["normal"], scale=scale, bias=bias))
        if "emission" in taken:
            emission = made.emission if any(made.emission) else _WHITE
            left_out = made.defaults - {"emission"}
            glow = taken["emission"]
            made = replace(made, emission=emission, emission_map=glow, defaults=left_out)
        return replace(made, extras={**made.extras, "texture_units": names}) if names else made

    def _map(self, state: RenderState, unit: int, uvs: Collection[str]) -> Texture | None:
        """The texture of a further unit, where its picture and the coordinates are there.

        Shaders that know of one set of coordinates take the first unit's for all.
        """
        texture, *_ = self._texture(state, unit)
        if texture is None or texture.image.missing:
            return None
        near = next((name for name in (texture.uv_set, uv_set(0)) if name in uvs), None)
        return None if near is None else replace(texture, uv_set=near)

    def _enabled(self, state: RenderState, unit: int, name: str) -> bool:
        found = state.settings[unit, "Texture"]
        place = found.place
        if place.class_name not in ("Texture2D", "Texture"):
            text = f"{place.class_name} in unit {unit}; only Texture2D is kept"
            found.add(Kind.DROPPED, "osg-texture-class", name, text)
            return False
        on = state.mode("GL_TEXTURE_2D", unit)
        if on is None:
            text = f"unit {unit} has a texture and GL_TEXTURE_2D is neither on nor off; taken as on"
            found.add(Kind.ASSUMED, "osg-texture-mode-unset", name, text)
        if on is not False and state.mode("GL_TEXTURE_GEN_S", unit):
            text = f"coordinates of unit {unit} are generated (TexGen); the texture is dropped"
            found.add(Kind.DROPPED, "osg-texture-generated", name, text)
            return False
        return on is not False

    def _sides(self, state: RenderState) -> tuple[bool, bool]:
        """Whether both sides are shown, and whether faces are wound clockwise."""
        culled = state.mode("GL_CULL_FACE") is True
        cull, front = state.attribute("CullFace"), state.attribute("FrontFace")
        side = "BACK" if cull is None else cull.word("mode") or "BACK"
        if culled and cull is not None and side != "BACK":
            text = f"culls {side}; both sides are shown"
            cull.add(Kind.REPLACED, "osg-cull-face", "", text)
            culled = False
        clockwise = front is not None and front.word("mode") == "CLOCKWISE"
        return not culled, clockwise


def _environment(state: RenderState, unit: int) -> str | None:
    """The mode of a unit's TexEnv; None without one."""
    found = state.attribute("TexEnv", unit)
    return None if found is None else found.word("mode") or "MODULATE"


def _face_values(
    document: Document, place: Statement, name: str, keys: tuple[str, ...], width: int
) -> tuple[float, ...] | None:
    """The front face's values of a field; a back face that differs is a finding.

    .osgt: ``Diffuse FALSE Front r g b a Back r g b a``, TRUE if both are as Front.
    .osg: ``diffuseColor r g b a``, or a line with FRONT and one with BACK; no alpha is 1.
    """
    sides: dict[str, tuple[float, ...]] = {}
    for statement in place.block.statements if place.block is not None else []:
        if statement.key not in keys:
            continue
        words = statement.words[1:]
        marks = [i for i, word in enumerate(words) if word.upper() in ("FRONT", "BACK")]
        for start, end in zip(marks or [-1], [*marks[1:], len(words)], strict=True):
            values = _floats(words[start + 1 : end], width)
            if values is None:
                text = f"{statement.words[0]}: want {width} finite numbers; the default stands"
                document.add(Kind.INVALID, "osg-number", statement, name, text)
            else:
                sides[words[start].upper() if marks else "FRONT"] = values
        if words[:1] == ["TRUE"]:
            sides.pop("BACK", None)
    front = sides.get("FRONT")
    if "BACK" in sides and sides["BACK"] != front:
        text = f"{keys[0]} of the back face is {listed(sides['BACK'])}; the front's is used"
        document.add(Kind.DROPPED, "osg-back-face", place, name, text)
    return front


def _clamped_shininess(document: Document, place: Statement, name: str, value: float) -> float:
    clamped = min(max(value, 0.0), _SHININESS_MAX)
    if clamped != value:
        text = f"shininess {value:g}; want 0 to {_SHININESS_MAX:g}"
        document.add(Kind.CLAMPED, "osg-shininess", place, name, text)
    return clamped


def _floats(words: list[str], width: int) -> tuple[float, ...] | None:
    """``width`` finite numbers; a colour of three is given alpha 1."""
    try:
        values = [float(word) for word in words[:width]]
    except ValueError:
        return None
    if width == 4 and len(values) == 3:
        values.append(1.0)
    return tuple(values) if len(values) == width and all(map(math.isfinite, values)) else None


def _comparable(value: Any) -> Any:
    """A field as part of a dictionary's key: an image counts as itself."""
    if isinstance(value, Texture):
        return tuple(
            id(value.image) if f.name == "image" else getattr(value, f.name) for f in fields(value)
        )
    return repr(value) if isinstance(value, dict) else value
