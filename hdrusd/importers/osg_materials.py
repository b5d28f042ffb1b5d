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
from dataclasses import dataclass, fields, replace
from pathlib import PurePosixPath
from typing import Any, Literal

from hdrusd.errors import SourceRef
from hdrusd.importers.osg_state import RenderState
from hdrusd.importers.osg_text import Document, Statement, listed, triple
from hdrusd.importers.osg_textures import TextureReader
from hdrusd.legacy.scene import RGB, Material, Texture
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
    """Makes materials from states; equal ones are one."""

    def __init__(
        self, document: Document, textures: TextureReader, materials: list[Material]
    ) -> None:
        self.document = document
        self.textures = textures
        self.materials = materials
        self._looks: dict[tuple[int, bool], Look] = {}
        self._known: dict[tuple[Any, ...], int] = {}
        self._unnamed = 0

    def look(self, state: RenderState, *, colored: bool) -> Look:
        """The look under ``state`` of a mesh that is ``colored``: has vertex colours."""
        key = id(state), colored
        if key not in self._looks:
            self._looks[key] = self._look(state, colored)
        return self._looks[key]

    def _look(self, state: RenderState, colored: bool) -> Look:
        two_sided, left_handed = self._sides(state)
        place = state.attribute("Material")
        lit = state.mode("GL_LIGHTING") is not False
        made, use_colors = self._colours(place, colored=colored, lit=lit)
        alpha_mode, cutoff = self._transparency(state, made.name)
        diffuse_map, left_out, extras = self._texture(state, made.name)
        opacity_map = None
        if alpha_mode != "opaque" and diffuse_map and self.textures.has_alpha(diffuse_map.image):
            opacity_map = replace(diffuse_map, channel="a")
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
            extras={**made.extras, **extras},
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
        self, place: Statement | None, *, colored: bool, lit: bool
    ) -> tuple[Material, bool]:
        """The colours of a Material, and whether vertex colours are used with them."""
        document = self.document
        if place is None:
            white = colored or not lit
            diffuse = _WHITE if white else triple(_COLOURS["diffuse"][1])
            source = SourceRef(document.file)
            return Material("", source, diffuse=diffuse, defaults=_FIELDS), colored
        name = document.name(place)
        found: dict[str, tuple[float, ...]] = {}
        for field_name, (keys, _) in _COLOURS.items():
            values = self._face_values(place, name, keys, 4)
            if values is not None:
                found[field_name] = values
        shininess = self._face_values(place, name, ("shininess",), 1)
        if shininess is not None:
            found["shininess"] = (self._clamped_shininess(place, name, shininess[0]),)
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

    def _face_values(
        self, place: Statement, name: str, keys: tuple[str, ...], width: int
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
                    self.document.add(Kind.INVALID, "osg-number", statement, name, text)
                else:
                    sides[words[start].upper() if marks else "FRONT"] = values
            if words[:1] == ["TRUE"]:
                sides.pop("BACK", None)
        front = sides.get("FRONT")
        if "BACK" in sides and sides["BACK"] != front:
            text = f"{keys[0]} of the back face is {listed(sides['BACK'])}; the front's is used"
            self.document.add(Kind.DROPPED, "osg-back-face", place, name, text)
        return front

    def _clamped_shininess(self, place: Statement, name: str, value: float) -> float:
        clamped = min(max(value, 0.0), _SHININESS_MAX)
        if clamped != value:
            text = f"shininess {value:g}; want 0 to {_SHININESS_MAX:g}"
            self.document.add(Kind.CLAMPED, "osg-shininess", place, name, text)
        return clamped

    def _transparency(
        self, state: RenderState, name: str
    ) -> tuple[Literal["opaque", "mask", "blend"], float]:
        document = self.document
        function = state.attribute("BlendFunc")
        blend = state.mode("GL_BLEND")
        if blend is None and (function is not None or state.hint == "transparent"):
            blend = True
            text = "no GL_BLEND, but a blend function or the transparent bin; taken as blended"
            if function is not None:
                document.add(Kind.ASSUMED, "osg-blend", function, name, text)
            else:
                document.report.add(Kind.ASSUMED, "osg-blend", SourceRef(document.file), name, text)
        if blend and function is not None:
            source = document.word(function, "sourcergb", "source") or _USUAL_BLENDING[0]
            target = document.word(function, "destinationrgb", "destination") or _USUAL_BLENDING[1]
            if (source, target) != _USUAL_BLENDING:
                text = f"blending {source}, {target}; shown as {', '.join(_USUAL_BLENDING)}"
                document.add(Kind.REPLACED, "osg-blend-function", function, name, text)
        test = state.attribute("AlphaFunc")
        if test is None or state.mode("GL_ALPHA_TEST") is not True:
            return ("blend" if blend else "opaque"), 0.5
        comparison = document.word(test, "function", "comparisonfunc") or "ALWAYS"
        cutoff = document.number(test, 1.0, "referencevalue")
        if comparison not in ("GREATER", "GEQUAL"):
            if comparison != "ALWAYS":
                text = f"alpha test {comparison} {cutoff:g}; want GREATER or GEQUAL; dropped"
                document.add(Kind.DROPPED, "osg-alpha-test", test, name, text)
            return ("blend" if blend else "opaque"), 0.5
        cutoff = min(max(cutoff, 0.0), 1.0)
        if not blend:
            return "mask", cutoff
        if cutoff > 0.0:
            text = f"alpha test {comparison} {cutoff:g} beside blending; blending is kept"
            document.add(Kind.DROPPED, "osg-alpha-test", test, name, text)
        return "blend", cutoff

    def _texture(
        self, state: RenderState, name: str
    ) -> tuple[Texture | None, frozenset[str], dict[str, Any]]:
        """The texture of the first unit that shows one; the others are findings and noted."""
        enabled = [unit for unit in state.units() if self._enabled(state, unit, name)]
        if not enabled:
            return None, frozenset(), {}
        unit, *others = enabled
        place = state.settings[unit, "Texture"].place
        texture, left_out = self.textures.read(
            place, unit, state.attribute("TexEnv", unit), state.attribute("TexMat", unit)
        )
        names = {}
        for other in others:
            place = state.settings[other, "Texture"].place
            names[str(other)] = self.textures.name(place)
            text = f"texture unit {other}, {names[str(other)]}; only unit {unit} is kept"
            self.document.add(Kind.DROPPED, "osg-texture-unit", place, name, text)
        return texture, left_out, {"texture_units": names} if names else {}

    def _enabled(self, state: RenderState, unit: int, name: str) -> bool:
        place = state.settings[unit, "Texture"].place
        if place.class_name not in ("Texture2D", "Texture"):
            text = f"{place.class_name} in unit {unit}; only Texture2D is kept"
            self.document.add(Kind.DROPPED, "osg-texture-class", place, name, text)
            return False
        on = state.mode("GL_TEXTURE_2D", unit)
        if on is None:
            text = f"unit {unit} has a texture and GL_TEXTURE_2D is neither on nor off; taken as on"
            self.document.add(Kind.ASSUMED, "osg-texture-mode-unset", place, name, text)
        if on is not False and state.mode("GL_TEXTURE_GEN_S", unit):
            text = f"coordinates of unit {unit} are generated (TexGen); the texture is dropped"
            self.document.add(Kind.DROPPED, "osg-texture-generated", place, name, text)
            return False
        return on is not False

    def _sides(self, state: RenderState) -> tuple[bool, bool]:
        """Whether both sides are shown, and whether faces are wound clockwise."""
        document = self.document
        culled = state.mode("GL_CULL_FACE") is True
        cull, front = state.attribute("CullFace"), state.attribute("FrontFace")
        side = "BACK" if cull is None else document.word(cull, "mode") or "BACK"
        if culled and cull is not None and side != "BACK":
            text = f"culls {side}; both sides are shown"
            document.add(Kind.REPLACED, "osg-cull-face", cull, "", text)
            culled = False
        clockwise = front is not None and document.word(front, "mode") == "CLOCKWISE"
        return not culled, clockwise


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
