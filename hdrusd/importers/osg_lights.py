"""Lights of an OpenSceneGraph file.

What a file leaves out: .osg is written in full, so the values of osg::Light's
constructor stand in. The writer of .osgt leaves out a value that equals its
serializer's default, which is 0 for the colours, the position and the direction
and OpenGL's default for the rest, so that is what is read; the fields are listed in
``extras["defaults"]``. (osgconv reads the constructor's 0.05, 0.8, 0.05 there, and
so changes a light that it wrote itself.)

Whether a light is on is no matter of its own: it lights what is drawn while GL_LIGHTn is on.
The state set of a LightSource only says so of what is below it, and OpenSceneGraph makes even
that one anew, with GL_LIGHTn ON, as soon as it has read the light. So lit drawables are asked.
Where none of them says ON and not all OFF, that is up to a program: the light is on, unless the
state set of its LightSource, as it stands in the file, or what holds above it says OFF.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg/Light.cpp, LightSource.cpp,
src/osg/Light.cpp, src/osg/LightSource.cpp (setLight, setLocalStateSetModes),
src/osgUtil/CullVisitor.cpp (apply(LightSource&)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

from hdrusd.importers.osg_state import RenderState, StateReader
from hdrusd.importers.osg_text import Document, Statement, listed, triple
from hdrusd.legacy.scene import Light, Vec3
from hdrusd.report import Kind

#: Field names in both formats, folded, to the values of osg::Light's constructor.
_DEFAULTS: dict[str, tuple[float, ...]] = {
    "ambient": (0.05, 0.05, 0.05, 1.0),
    "diffuse": (0.8, 0.8, 0.8, 1.0),
    "specular": (0.05, 0.05, 0.05, 1.0),
    "position": (0.0, 0.0, 1.0, 0.0),
    "direction": (0.0, 0.0, -1.0),
    "constantattenuation": (1.0,),
    "linearattenuation": (0.0,),
    "quadraticattenuation": (0.0,),
    "spotexponent": (0.0,),
    "spotcutoff": (180.0,),
}
_COLOURS = ("ambient", "diffuse", "specular")
_ZERO = (*_COLOURS, "position", "direction")  # what .osgt leaves out where it is 0
_NO_SPOT = 180.0
_LIGHTS = 8  # GL_LIGHT0 to GL_LIGHT7 are modes that are read


@dataclass(slots=True)
class _Placed:
    """A light of the scene, and where it was read."""

    document: Document
    place: Statement
    number: int  # of GL_LIGHTn
    above: bool | None  # whether it is on at its LightSource, without that one's own state
    stored: bool | None  # what that one's own state says


class LightSwitches:
    """Which lights of a scene are on: for all files that it is made of."""

    def __init__(self, lights: list[Light]) -> None:
        self.lights = lights
        self._placed: list[tuple[int, _Placed]] = []  # with the light's index
        self._says: list[set[bool | None]] = [set() for _ in range(_LIGHTS)]  # what is drawn
        self._seen: set[int] = set()

    def add(self, light: int, placed: _Placed) -> None:
        """A light of the scene."""
        self._placed.append((light, placed))

    def drawn(self, state: RenderState) -> None:
        """Something is drawn in a state, which lives as long as this."""
        if id(state) not in self._seen and state.mode("GL_LIGHTING") is not False:
            self._seen.add(id(state))
            for number, says in enumerate(self._says):
                says.add(state.mode(f"GL_LIGHT{number}"))

    def finish(self) -> None:
        """Switch off what is off, and say which lights share a number.

        OpenGL would show the last of a number, a database means all.
        """
        numbers: dict[int, list[tuple[int, _Placed]]] = {}
        for light, placed in self._placed:
            numbers.setdefault(placed.number, []).append((light, placed))
            self._switch(light, placed)
        for number, found in numbers.items():
            if len(found) > 1:
                first, second = (self.lights[light] for light, _ in found[:2])
                text = f"{len(found)} lights are GL_LIGHT{number}, as {first.name} is; all are kept"
                report = found[1][1].document.report
                report.add(Kind.ASSUMED, "osg-light-number", second.source, second.name, text)

    def _switch(self, light: int, placed: _Placed) -> None:
        says = self._says[placed.number] if 0 <= placed.number < _LIGHTS else set()
        name, mode = self.lights[light].name, f"GL_LIGHT{placed.number}"
        if True not in says and (says == {False} or False in (placed.above, placed.stored)):
            self.lights[light] = replace(self.lights[light], enabled=False)
            return
        if placed.stored is False:
            text = f"{mode} is off in its own state set, which OpenSceneGraph sets anew; it shines"
            placed.document.add(Kind.ASSUMED, "osg-light-mode", placed.place, name, text)
        if {True, False} <= says:
            text = f"{mode} is off for a part of what is drawn; it lights all here"
            placed.document.add(Kind.ASSUMED, "osg-light-scope", placed.place, name, text)


class LightReader:
    """Reads the lights of one file into ``switches.lights``; a shared light has one record."""

    def __init__(self, document: Document, states: StateReader, switches: LightSwitches) -> None:
        self.document = document
        self.states = states
        self.switches = switches
        self.lights = switches.lights
        self._known: dict[int, int] = {}

    def read(
        self, source: Statement, name: str, above: RenderState
    ) -> tuple[int | None, RenderState]:
        """The number of a LightSource's light, and the state of what is below it.

        The number is None, with a finding, where it has none. ``above``: what holds there without
        its own state set.
        """
        place = self.document.object(source, "light")
        if place is None:
            text = "light source without a light"
            self.document.add(Kind.MISSING, "osg-light", source, name, text)
            return None, self.states.below(above, source)
        number = int(self.document.number(place, 0.0, "lightnum"))
        mode = f"GL_LIGHT{number}"
        if id(place) not in self._known:
            self._known[id(place)] = len(self.lights)
            own = self.document.object(source, "stateset")
            stored = None if own is None else self.states.own(own).mode(mode)
            placed = _Placed(self.document, source, number, above.mode(mode), stored)
            self.switches.add(len(self.lights), placed)
            self.lights.append(self._light(place, name, number))
        return self._known[id(place)], self.states.below_light(above, source, mode)

    def _light(self, place: Statement, name: str, number: int) -> Light:
        document = self.document
        name = document.name(place) or name or f"light_{len(self.lights)}"
        values: dict[str, tuple[float, ...]] = {}
        left_out = []
        for key, default in _DEFAULTS.items():
            found = document.numbers(place, len(default), key)
            if found is None:
                left_out.append(key)
                found = (0.0,) * len(default) if document.new and key in _ZERO else default
            values[key] = found
        missing = [key for key in _COLOURS if key in left_out]
        if missing:
            text = f"{', '.join(missing)} left out; read as {listed(values[missing[0]])}"
            document.add(Kind.ASSUMED, "osg-light-defaults", place, name, text)
        kind = self._kind(place, name, values)
        extras: dict[str, Any] = {"light_number": number}
        if left_out:
            extras["defaults"] = tuple(left_out)
        position, direction = self._where(place, name, kind, values)
        return Light(
            name,
            document.ref(place),
            kind,
            position,
            direction,
            triple(values["ambient"]),
            triple(values["diffuse"]),
            triple(values["specular"]),
            (
                values["constantattenuation"][0],
                values["linearattenuation"][0],
                values["quadraticattenuation"][0],
            ),
            spot_cutoff=values["spotcutoff"][0] if kind == "spot" else _NO_SPOT,
            spot_exponent=values["spotexponent"][0] if kind == "spot" else 0.0,
            extras=extras,
        )

    def _kind(
        self, place: Statement, name: str, values: dict[str, tuple[float, ...]]
    ) -> Literal["point", "spot", "directional", "ambient"]:
        shines = any(values["diffuse"][:3]) or any(values["specular"][:3])
        if not shines and any(values["ambient"][:3]):
            return "ambient"
        if values["position"][3] == 0.0:
            return "directional"
        cutoff = values["spotcutoff"][0]
        if 0.0 <= cutoff <= 90.0:
            return "spot"
        if cutoff != _NO_SPOT:
            text = f"spot cutoff {cutoff:g}; want 0 to 90, or 180; read as 180"
            self.document.add(Kind.CLAMPED, "osg-light-cutoff", place, name, text)
        return "point"

    def _where(
        self, place: Statement, name: str, kind: str, values: dict[str, tuple[float, ...]]
    ) -> tuple[Vec3, Vec3]:
        """Position and the way the light travels; OpenGL's position of a directional light is the
        direction to it.
        """
        x, y, z, w = values["position"]
        if kind == "directional":
            travel, position = (0.0 - x, 0.0 - y, 0.0 - z), (0.0, 0.0, 0.0)
        else:
            travel = triple(values["direction"])
            position = (x / w, y / w, z / w) if w else (x, y, z)
        length = math.hypot(*travel)
        if not 0.0 < length < math.inf or not all(map(math.isfinite, position)):
            if kind in ("directional", "spot"):
                text = "direction or position is out of range; it shines along -Z from the origin"
                self.document.add(Kind.INVALID, "osg-light-direction", place, name, text)
            travel, length = (0.0, 0.0, -1.0), 1.0
            position = position if all(map(math.isfinite, position)) else (0.0, 0.0, 0.0)
        return position, (travel[0] / length, travel[1] / length, travel[2] / length)
