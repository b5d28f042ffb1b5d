"""Lights of an OpenSceneGraph file.

What a file leaves out: .osg is written in full, so the values of osg::Light's
constructor stand in. The writer of .osgt leaves out a value that equals its
serializer's default, which is 0 for the colours, the position and the direction
and OpenGL's default for the rest, so that is what is read; the fields are listed in
``extras["defaults"]``. (osgconv reads the constructor's 0.05, 0.8, 0.05 there, and
so changes a light that it wrote itself.)

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg/Light.cpp, LightSource.cpp,
src/osg/Light.cpp.
"""

from __future__ import annotations

import math
from typing import Any, Literal

from hdrusd.importers.osg_state import RenderState
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


class LightReader:
    """Reads the lights of one file into ``lights``; a shared light has one record."""

    def __init__(self, document: Document, lights: list[Light]) -> None:
        self.document = document
        self.lights = lights
        self._known: dict[tuple[int, bool], int] = {}
        self._numbers: dict[int, list[int]] = {}

    def read(self, source: Statement, name: str, state: RenderState) -> int | None:
        """The number of a LightSource's light; None, with a finding, where it has none."""
        place = self.document.object(source, "light")
        if place is None:
            text = "light source without a light"
            self.document.add(Kind.MISSING, "osg-light", source, name, text)
            return None
        number = int(self.document.number(place, 0.0, "lightnum"))
        enabled = state.mode(f"GL_LIGHT{number}") is not False
        key = id(place), enabled
        if key not in self._known:
            self._known[key] = len(self.lights)
            self._numbers.setdefault(number, []).append(len(self.lights))
            self.lights.append(self._light(place, name, number, enabled))
        return self._known[key]

    def _light(self, place: Statement, name: str, number: int, enabled: bool) -> Light:
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
            enabled=enabled,
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

    def finish(self) -> None:
        """Say which lights share a number: OpenGL would show the last, a database means all."""
        for number, lights in self._numbers.items():
            if len(lights) > 1:
                first, second = (self.lights[light] for light in lights[:2])
                text = (
                    f"{len(lights)} lights are GL_LIGHT{number}, as {first.name} is; all are kept"
                )
                report = self.document.report
                report.add(Kind.ASSUMED, "osg-light-number", second.source, second.name, text)
