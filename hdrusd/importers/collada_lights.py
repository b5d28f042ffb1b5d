"""Lights of COLLADA, and what exporters say of them beyond the common profile.

COLLADA 1.4.1, chapter 5, ``light``: colours without a unit and OpenGL's attenuation. The angle
of a spot is that of the whole cone: the specification is silent, Blender's, Maya's and 3ds Max's
exporters write it so. From version 2.80 Blender's lights are in watts and its exporter multiplies
the colour by them; 683 lm/W, as its glTF exporter has it, makes candela and lux of these.
"""

from __future__ import annotations

import math
import re
from typing import Literal

from hdrusd.importers.collada_document import LARGEST, Document, extras, named
from hdrusd.importers.collada_materials import scalars
from hdrusd.importers.collada_xml import Element
from hdrusd.legacy.scene import RGB, Light
from hdrusd.report import Kind

_KINDS: dict[str, Literal["point", "spot", "directional", "ambient"]] = {
    "point": "point",
    "spot": "spot",
    "directional": "directional",
    "ambient": "ambient",
}
_READ = frozenset(
    (
        "color",
        "constant_attenuation",
        "linear_attenuation",
        "quadratic_attenuation",
        "falloff_angle",
        "falloff_exponent",
        "intensity",
        "zfar",
    )
)
#: Of radiant power as a lamp's light, lm/W: 683 is that of 555 nm, as glTF exporters agreed.
LUMENS_A_WATT = 683.0
_AT = f" at {LUMENS_A_WATT:g} lm/W, if white"
_BLENDER = re.compile(r"Blender (\d+)\.(\d+)")
#: The first Blender whose lights are in watts.
_WATTS_SINCE = 2, 80


class LightReader:
    """Reads the lights of one file into ``lights``; a light in many places has one record."""

    def __init__(self, document: Document) -> None:
        self.lights: list[Light] = []
        self._document = document
        self._known: dict[int, int | None] = {}
        version = _BLENDER.match(document.generator)
        self._watts = version is not None and (
            (int(version[1][:6]), int(version[2][:6])) >= _WATTS_SINCE
        )

    def read(self, element: Element) -> int | None:
        """The number of a light; None, with a finding, where it is none."""
        if id(element) not in self._known:
            light = self._read(element)
            self._known[id(element)] = None if light is None else len(self.lights)
            if light is not None:
                self.lights.append(light)
        return self._known[id(element)]

    def _read(self, element: Element) -> Light | None:
        document, name = self._document, named(element, "light")
        common = element.child("technique_common")
        place = None if common is None else common.child(*_KINDS)
        if place is None:
            text = "light without a point, spot, directional or ambient; dropped"
            document.note(Kind.INVALID, "light-type", element, name, text)
            return None
        kind = _KINDS[place.tag]
        for child in place.children:
            if child.tag not in _READ:
                text = f"{child.tag[:40]} of a light is not read"
                document.note(Kind.DROPPED, "collada-element", child, name, text)
        stated = extras(element)
        color = self._color(place, name)
        color, candela, lux = self._strength(element, place, kind, name, color, stated)
        values = (1.0, 0.0, 0.0)
        words = ("constant_attenuation", "linear_attenuation", "quadratic_attenuation")
        k0, k1, k2 = (
            document.number(place, word, value, low=0.0)
            for word, value in zip(words, values, strict=True)
        )
        cutoff, inner, exponent = 180.0, None, 0.0
        if kind == "spot":
            cutoff, inner = self._cone(place, name, stated)
            exponent = document.number(place, "falloff_exponent", 0.0, low=0.0)
            exponent = self._blender_exponent(place, name, stated, exponent)
        has_place = kind in ("point", "spot")
        return Light(
            name,
            document.ref(element),
            kind,
            ambient=color if kind == "ambient" else (0.0, 0.0, 0.0),
            diffuse=color,
            specular=color,
            attenuation=(k0, k1, k2) if has_place and candela is None else None,
            spot_cutoff=cutoff,
            spot_inner=inner,
            spot_exponent=exponent,
            candela=candela,
            lux=lux,
            extras=scalars(document, stated),
        )

    def _color(self, place: Element, name: str) -> RGB:
        found = place.child("color")
        if found is None:
            text = "light without a colour; white is used"
            self._document.note(Kind.ASSUMED, "collada-light-colour", place, name, text)
            return 1.0, 1.0, 1.0
        values = self._document.vector(found, 3)
        return (1.0, 1.0, 1.0) if values is None else (values[0], values[1], values[2])

    def _strength(
        self,
        element: Element,
        place: Element,
        kind: str,
        name: str,
        color: RGB,
        stated: dict[str, Element],
    ) -> tuple[RGB, float | None, float | None]:
        """Colour, candela and lux; the last two where an exporter's numbers have a unit."""
        document = self._document
        energy = stated.get("energy") or stated.get("blender_energy")
        if self._watts and energy is not None and kind != "ambient":
            watts = document.value(energy, 0.0, low=0.0)
            if watts > 0.0:
                red, green, blue = (c / watts for c in color)
                if kind == "directional":
                    lux = watts * LUMENS_A_WATT
                    text = f"Blender says {watts:g} W/m2; {lux:g} lx{_AT}"
                    document.note(Kind.GUESSED, "collada-light-watts", element, name, text)
                    return (red, green, blue), None, lux
                candela = watts * LUMENS_A_WATT / (4.0 * math.pi)
                text = f"Blender says {watts:g} W; {candela:g} cd{_AT}"
                document.note(Kind.GUESSED, "collada-light-watts", element, name, text)
                return (red, green, blue), candela, None
        holder = place.child("intensity") or stated.get("intensity") or stated.get("multiplier")
        if holder is None:
            return color, None, None
        factor = document.value(holder, 1.0, low=0.0)
        if factor == 1.0:
            return color, None, None
        if factor * max(*map(abs, color)) > LARGEST:
            text = f"{holder.tag} {factor:g} times the colour is beyond 32-bit floats; not used"
            document.note(Kind.INVALID, "light-intensity", holder, name, text)
            return color, None, None
        text = f"{holder.tag} {factor:g} multiplies the colour; it has no unit"
        document.note(Kind.ASSUMED, "collada-light-factor", holder, name, text)
        red, green, blue = (c * factor for c in color)
        return (red, green, blue), None, None

    def _cone(
        self, place: Element, name: str, stated: dict[str, Element]
    ) -> tuple[float, float | None]:
        """Outer and inner half-angle in degrees."""
        document = self._document
        if place.child("falloff_angle") is None:
            return 90.0, None  # the format's default is 180 degrees
        angle = document.number(place, "falloff_angle", 180.0, low=0.0, high=360.0)
        if angle == 0.0:
            text = "falloff_angle 0 lights nothing; the default of 180 degrees is used"
            document.note(Kind.INVALID, "light-cone", place, name, text)
            angle = 180.0
        text = f"falloff_angle {angle:g} is read as the angle of the whole cone"
        document.note(Kind.ASSUMED, "collada-spot-angle", place, name, text)
        half = angle / 2.0
        blend = stated.get("spotblend")
        if blend is None:
            return half, None
        # Blender fades over this share of the cone, counted from the edge.
        share = document.value(blend, 0.0, low=0.0, high=1.0)
        return half, half * (1.0 - share)

    def _blender_exponent(
        self, place: Element, name: str, stated: dict[str, Element], exponent: float
    ) -> float:
        """Blender writes its blend, a share of the cone, as the exponent: no power of a cosine."""
        blend = stated.get("spotblend")
        if blend is None or exponent == 0.0:
            return exponent
        if not math.isclose(self._document.value(blend, 0.0), exponent, rel_tol=1e-3):
            return exponent
        text = f"falloff_exponent {exponent:g} is Blender's blend of the edge, not an exponent"
        self._document.note(Kind.REPLACED, "collada-spot-blend", place, name, text)
        return 0.0
