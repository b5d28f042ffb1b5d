"""OpenSceneGraph's StateSets: what each says and how they add up down the tree.

A setting of a child replaces its parent's, unless the parent's is OVERRIDE and
the child's is not PROTECTED. Modes (GL_LIGHTING) and attributes (Material) have
one namespace here, with the texture unit beside the name; unit -1 is no texture.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg/StateSet.cpp,
src/osgWrappers/deprecated-dotosg/osg/StateSet.cpp, include/osg/StateAttribute.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

from hdrusd.importers.osg_text import Document, Statement
from hdrusd.report import Kind

Key = tuple[int, str]
Hint = Literal["opaque", "transparent"]

NO_UNIT = -1
_UNITS = 32  # OpenGL numbers GL_TEXTURE0 to GL_TEXTURE31
_TEXTURE_CLASSES = {
    "Texture",
    "Texture1D",
    "Texture2D",
    "Texture2DArray",
    "Texture2DMultisample",
    "Texture3D",
    "TextureCubeMap",
    "TextureRectangle",
}
_TEXTURE_ATTRIBUTES = _TEXTURE_CLASSES | {
    "TexEnv",
    "TexEnvCombine",
    "TexEnvFilter",
    "TexGen",
    "TexMat",
    "PointSprite",
}
#: Attributes that become part of a material or a mesh; all others are findings.
_KEPT = {"Material", "CullFace", "FrontFace", "BlendFunc", "AlphaFunc", "LightModel"}
_KEPT_ON_TEXTURE = {"Texture", "TexEnv", "TexMat", "TexGen"}
#: Modes that are used, or that change nothing that is kept.
_KNOWN_MODES = {
    "GL_LIGHTING",
    "GL_CULL_FACE",
    "GL_BLEND",
    "GL_ALPHA_TEST",
    "GL_DEPTH_TEST",
    "GL_NORMALIZE",
    "GL_RESCALE_NORMAL",
    "GL_TEXTURE_1D",
    "GL_TEXTURE_2D",
    "GL_TEXTURE_3D",
    "GL_TEXTURE_CUBE_MAP",
    "GL_TEXTURE_RECTANGLE",
    "GL_TEXTURE_GEN_S",
    "GL_TEXTURE_GEN_T",
    "GL_TEXTURE_GEN_R",
    "GL_TEXTURE_GEN_Q",
    *(f"GL_LIGHT{n}" for n in range(8)),
}
_HINTS: dict[str | None, Hint] = {
    "1": "opaque",
    "2": "transparent",
    "OPAQUE_BIN": "opaque",
    "TRANSPARENT_BIN": "transparent",
}


@dataclass(frozen=True, slots=True)
class Setting:
    """A mode that is ``on`` or an attribute that stands at ``place`` of ``document``.

    Which need not be the file that it holds in: a file may be part of another.
    """

    document: Document
    place: Statement
    on: bool
    override: bool = False
    protected: bool = False

    def word(self, *keys: str) -> str | None:
        """The second word of a field."""
        return self.document.word(self.place, *keys)

    def add(self, kind: Kind, code: str, thing: str, text: str) -> None:
        """Note a finding where it stands."""
        self.document.add(kind, code, self.place, thing, text)


@dataclass(frozen=True, slots=True, eq=False)
class RenderState:
    """All settings that hold at a node, and the render bin's hint."""

    settings: Mapping[Key, Setting] = field(default_factory=dict)
    hint: Hint | None = None

    def mode(self, name: str, unit: int = NO_UNIT) -> bool | None:
        """Whether a mode is on; None where nothing says."""
        found = self.settings.get((unit, name))
        return None if found is None else found.on

    def attribute(self, name: str, unit: int = NO_UNIT) -> Setting | None:
        """Where an attribute stands."""
        return self.settings.get((unit, name))

    def units(self) -> list[int]:
        """The units that have a texture, in order."""
        return sorted(unit for unit, name in self.settings if name == "Texture")

    def below(self, own: RenderState) -> RenderState:
        """The state of a child that sets ``own``."""
        settings = dict(self.settings)
        for key, setting in own.settings.items():
            inherited = settings.get(key)
            if inherited is None or not inherited.override or setting.protected:
                settings[key] = setting
        return RenderState(settings, own.hint or self.hint)


class StateReader:
    """Reads the StateSets of a file, each once, and adds them up."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._own: dict[int, RenderState] = {}
        self._sums: dict[tuple[int, int], RenderState] = {}

    def below(self, inherited: RenderState, owner: Statement) -> RenderState:
        """The state at a node or drawable; the same object for the same pair of states."""
        place = self.document.object(owner, "stateset")
        if place is None:
            return inherited
        key = id(inherited), id(place)
        if key not in self._sums:
            self._sums[key] = inherited.below(self.own(place))
        return self._sums[key]

    def below_light(self, inherited: RenderState, source: Statement, mode: str) -> RenderState:
        """The state below a LightSource: its own state set is made anew with its light on."""
        key = id(inherited), id(source)
        if key not in self._sums:
            on = RenderState({(NO_UNIT, mode): Setting(self.document, source, True)})
            self._sums[key] = inherited.below(on)
        return self._sums[key]

    def own(self, place: Statement) -> RenderState:
        """What one StateSet says."""
        if id(place) not in self._own:
            found = self._new(place) if self.document.new else self._old(place)
            hint = _HINTS.get(self.document.word(place, "renderinghint"))
            self._own[id(place)] = RenderState(dict(found), hint)
        return self._own[id(place)]

    def _new(self, place: Statement) -> Iterator[tuple[Key, Setting]]:
        document = self.document
        yield from self._modes(document.field(place, "modelist"), NO_UNIT)
        yield from self._attributes(document.field(place, "attributelist"), NO_UNIT)
        for key, read in (
            ("texturemodelist", self._modes),
            ("textureattributelist", self._attributes),
        ):
            listed = document.field(place, key)
            units = listed.block.statements if listed is not None and listed.block else []
            for unit, statement in enumerate(units[:_UNITS]):
                yield from read(statement, unit)
            for statement in units[_UNITS : _UNITS + 1]:
                self._dropped(statement, f"units from {_UNITS} on")
        for key in ("uniformlist", "definelist", "updatecallback", "eventcallback"):
            found = document.field(place, key)
            if found is not None and found.block is not None:
                self._dropped(found, found.words[0])

    def _modes(self, listed: Statement | None, unit: int) -> Iterator[tuple[Key, Setting]]:
        for statement in listed.block.statements if listed is not None and listed.block else []:
            if len(statement.words) > 1:
                yield from self._mode(statement, statement.words[0], statement.words[1], unit)

    def _attributes(self, listed: Statement | None, unit: int) -> Iterator[tuple[Key, Setting]]:
        """Objects, each followed by a line ``Value OVERRIDE|PROTECTED``; OFF is neither."""
        statements = listed.block.statements if listed is not None and listed.block else []
        for number, statement in enumerate(statements):
            place = self.document.resolve(statement) if statement.block is not None else None
            if place is None:
                continue
            after = statements[number + 1] if number + 1 < len(statements) else None
            flags = (
                after.words[1] if after and after.key == "value" and len(after.words) > 1 else ""
            )
            yield from self._attribute(place, flags, unit)

    def _old(self, place: Statement) -> Iterator[tuple[Key, Setting]]:
        for statement in place.block.statements if place.block is not None else []:
            if statement.key == "textureunit" and len(statement.words) > 1:
                unit = statement.declared
                if unit is None or unit >= _UNITS:
                    self._dropped(statement, " ".join(statement.words[:2]))
                    continue
                for item in statement.block.statements if statement.block is not None else []:
                    yield from self._old_statement(item, unit)
            else:
                yield from self._old_statement(statement, NO_UNIT)

    def _old_statement(self, statement: Statement, unit: int) -> Iterator[tuple[Key, Setting]]:
        if statement.block is not None or statement.key == "use":
            place = self.document.resolve(statement)
            if place is not None:
                texture = unit == NO_UNIT and place.class_name in _TEXTURE_ATTRIBUTES
                yield from self._attribute(place, "", 0 if texture else unit)
        elif len(statement.words) > 1 and statement.words[0].startswith(("GL_", "0x")):
            name = statement.words[0]
            texture = unit == NO_UNIT and name.startswith("GL_TEXTURE_")
            yield from self._mode(statement, name, statement.words[1], 0 if texture else unit)

    def _mode(
        self, place: Statement, name: str, value: str, unit: int
    ) -> Iterator[tuple[Key, Setting]]:
        flags = value.replace("_", "|").split("|")  # .osg knows OVERRIDE_ON too
        if "INHERIT" in flags:
            return
        on = "ON" in flags
        if name not in _KNOWN_MODES:
            if on:
                self._dropped(place, name)
            return
        yield (
            (unit, name),
            Setting(self.document, place, on, "OVERRIDE" in flags, "PROTECTED" in flags),
        )

    def _attribute(self, place: Statement, flags: str, unit: int) -> Iterator[tuple[Key, Setting]]:
        name = place.class_name
        kind = "Texture" if name in _TEXTURE_CLASSES else name
        if kind not in (_KEPT if unit == NO_UNIT else _KEPT_ON_TEXTURE):
            self._dropped(place, name)
            return
        parts = flags.split("|")
        if "INHERIT" in parts:
            return
        yield (
            (unit, kind),
            Setting(self.document, place, True, "OVERRIDE" in parts, "PROTECTED" in parts),
        )

    def _dropped(self, place: Statement, what: str) -> None:
        text = "render state that has no home; dropped"
        self.document.add(Kind.DROPPED, "osg-state", place, what, text)
