"""What legacy lights and materials mean: the only place where colours become photometry.

A number comes from the photometry file, else from the source where its format has
units (glTF: cd, lx, cd/m2), else from a named rule of ``estimate.py``; which one is
recorded. Each step that changes or guesses something is a finding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Literal

from hdrusd.legacy import scene as legacy
from hdrusd.legacy.scene import RGB
from hdrusd.photometry.estimate import (
    LIGHT_POINT,
    LIGHT_POINT_RULE,
    LIGHT_POINT_TEXT,
    Estimate,
)
from hdrusd.photometry.light import PhotometricLight, Provenance, chromaticity
from hdrusd.photometry.luminaire import Luminaire, Opening
from hdrusd.photometry.sidecar import Rule
from hdrusd.photometry.spread import SHAPES, Beam
from hdrusd.photometry.strength import STRENGTHS, note_wrong_unit, stated_candela
from hdrusd.report import Kind, Report
from hdrusd.units import LUMINANCE_WEIGHTS

#: Radius of a lamp whose size nobody states, m; only other renderers' values depend on it.
LAMP_RADIUS = 0.05

#: Radius of a lamp that has a size, m; a smaller one is a point, a larger one a mistake.
_LEAST_RADIUS, _LARGEST_RADIUS = 1e-3, 1e3

#: The largest lamp that a light point may be, m.
_LARGEST_LAMP = 10.0

#: The strongest light that is written, cd or lx: its luminance must fit into 32-bit floats.
_STRONGEST = 1e30

#: From a colour temperature in K to linear Rec. 709 of luminance 1.
TemperatureToRGB = Callable[[float], RGB]


def luminance(color: RGB) -> float:
    """Relative luminance of linear Rec. 709."""
    return sum(w * c for w, c in zip(LUMINANCE_WEIGHTS, color, strict=True))


def rule_color(rule: Rule | None, temperature: TemperatureToRGB) -> RGB | None:
    """The chromaticity that a photometry rule states, luminance 1; None when it states none."""
    if rule is None:
        return None
    color = rule.three("color")
    if color is not None and luminance(color) > 0.0:
        return chromaticity(color)[0]
    kelvin = rule.number("temperature")
    if kelvin is None and rule.lamp is not None:
        if rule.lamp.color is not None:
            return chromaticity(rule.lamp.color)[0]
        kelvin = rule.lamp.temperature
    return temperature(kelvin) if kelvin else None


@dataclass(frozen=True, slots=True)
class LuminaireFile:
    """A photometric file of a rule, read, and the name by which the stage has it."""

    name: str
    luminaire: Luminaire

    @property
    def symmetric(self) -> bool:
        """Whether it gives the same in all planes, so that it may be turned about its axis."""
        candela = self.luminaire.candela
        return self.luminaire.type == "C" and bool((candela == candela[0]).all())


@dataclass(frozen=True, slots=True)
class Interpreter:
    """The rules of one conversion.

    ``diagonal``: of the scene, m, for estimates; ``unit``: metres a source unit, in
    which OpenGL's attenuation counts.
    """

    estimate: Estimate
    diagonal: float
    unit: float
    temperature: TemperatureToRGB
    report: Report

    def light(
        self,
        light: legacy.Light,
        rule: Rule | None,
        file: LuminaireFile | None = None,
        *,
        metres: float | None = None,
    ) -> PhotometricLight | None:
        """The lamp, or None where it is switched off or dark. House rule: one light, end to end.

        ``file``: that of the rule's ``ies``, if there is one and it can be read. ``metres``: that
        a unit of the light's own space measures in the world; None: as many as a source unit.
        """
        metres = self.unit if metres is None else metres
        enabled = light.enabled if rule is None else rule.values.get("enabled", light.enabled)
        if not enabled:
            self._note(light, Kind.DROPPED, "light-off", "switched off; not written")
            return None
        light = self._without_negative_colours(light)
        if rule is not None and "ies" in rule.values and light.kind in ("directional", "ambient"):
            text = f"{rule.place}: a light without a place takes no photometric file"
            self._note(light, Kind.DROPPED, "profile-unused", text)
            file = None
        if light.kind == "ambient":
            return self._ambient_light(light, rule)
        kind: Literal["point", "distant"] = "distant" if light.kind == "directional" else "point"
        color, strength = chromaticity(light.diffuse)
        if rule is not None and file is not None:
            intensity, provenance = _factor(rule, file.luminaire), rule.provenance
            name, source = str(rule.place), rule.source
        else:
            intensity, provenance, name, source = self._strength(light, rule, kind, strength)
        if rule is not None:
            color = rule_color(rule, self.temperature) or color
            self._note_lamp_type(light, rule)
        if intensity <= 0.0:
            self._note(light, Kind.DROPPED, "light-dark", "gives no light; not written")
            return None
        peak = 1.0 if file is None else max(float(file.luminaire.candela.max()), 1.0)
        if not intensity * peak <= _STRONGEST:
            text = f"{intensity * peak:g} is beyond 32-bit floats; not written"
            self._note(light, Kind.INVALID, "light-intensity", text)
            return None
        self._note_differences(light)
        lamp = PhotometricLight(
            kind=kind,
            intensity=intensity,
            chromaticity=color,
            sp=0.0 if rule is None else rule.sp,
            provenance=provenance,
            rule=name,
            source=source,
        )
        if kind == "distant":
            return lamp
        if file is not None:
            return self._with_file(lamp, light, rule, file, metres)
        return self._with_lamp(lamp, light, rule, metres)

    def _with_file(
        self,
        lamp: PhotometricLight,
        light: legacy.Light,
        rule: Rule | None,
        file: LuminaireFile,
        metres: float,
    ) -> PhotometricLight:
        """What a photometric file says in the place of a cone: where the light goes, its size."""
        if light.spot_cutoff < 180.0 or light.spot_exponent > 0.0:
            text = f"cone and exponent replaced by the candela of {file.luminaire.name}"
            self._note(light, Kind.REPLACED, "light-cone", text)
        radius = self._radius(light, rule, metres, _opening_radius(file.luminaire.opening))
        return replace(lamp, profile=file.name, radius=radius)

    def _radius(
        self, light: legacy.Light, rule: Rule | None, metres: float, of_file: float | None = None
    ) -> float:
        """The lamp's size, m: of the rule, the photometric file, the source, else a stated guess.

        That of the source is in the light's own space; a unit of it measures ``metres``.
        """
        radius = (rule.number("radius") if rule else None) or of_file
        if radius is None and light.radius is not None:
            radius = light.radius * metres
            if not _LEAST_RADIUS <= radius <= _LARGEST_LAMP:
                text = f"lamp of {radius:.3g} m radius; {LAMP_RADIUS} m is used"
                self._note(light, Kind.INVALID, "lamp-radius", text)
                radius = LAMP_RADIUS
        if radius is None:
            radius = LAMP_RADIUS
            text = f"lamp of {LAMP_RADIUS} m radius; none is stated"
            self._note(light, Kind.ASSUMED, "lamp-radius", text)
        return radius

    def _with_lamp(
        self, lamp: PhotometricLight, light: legacy.Light, rule: Rule | None, metres: float
    ) -> PhotometricLight:
        """What only a light with a place has: a cone, a focus, a size."""
        beam = _beam(light, rule)
        return replace(
            lamp,
            kind="spot" if beam.shaped else "point",
            cutoff=beam.cutoff,
            softness=beam.softness,
            exponent=beam.exponent,
            radius=self._radius(light, rule, metres),
        )

    def _note_lamp_type(self, light: legacy.Light, rule: Rule) -> None:
        """What a lamp's type says of its colour and S/P where the entry leaves it to it."""
        lamp = rule.lamp
        if lamp is None:
            return
        taken: list[str] = []
        if not {"temperature", "color"} & rule.values.keys():
            taken.append("its colour" if lamp.color else f"{lamp.temperature:g} K")
        if not {"sp_ratio", "illuminant"} & rule.values.keys():
            taken.append(f"S/P {rule.sp:.3g} ({lamp.sp_source})")
        if taken:
            text = f"{' and '.join(taken)} by lamp type {lamp.name}; {rule.place} does not say"
            self._note(light, Kind.ASSUMED, "lamp-type", text)

    def _without_negative_colours(self, light: legacy.Light) -> legacy.Light:
        """OpenGL lets a light take light away; a lamp does not."""
        colours = {
            name: _not_negative(getattr(light, name)) for name in ("diffuse", "specular", "ambient")
        }
        if all(getattr(light, name) == color for name, color in colours.items()):
            return light
        text = "colour below 0, which would take light away; read as 0"
        self._note(light, Kind.CLAMPED, "light-negative", text)
        return replace(light, **colours)  # type: ignore[arg-type]

    def _strength(
        self, light: legacy.Light, rule: Rule | None, kind: str, luminance_of_color: float
    ) -> tuple[float, Provenance, str, str]:
        """(cd or lx, provenance, rule, source) by the first that knows."""
        stated = None if rule is None else self._stated(light, rule, kind)
        if stated is not None:
            return stated
        own = light.lux if kind == "distant" else light.candela
        if own is not None:
            return own * luminance_of_color, "authored", "source file", ""
        if light.positions is not None:
            value = LIGHT_POINT * luminance_of_color
            text = f"{light.lamps} lamps of {value:.4g} cd each by rule {LIGHT_POINT_RULE}"
            text = f"{text}; the source has no unit"
            self._note(light, Kind.GUESSED, "light-estimate", text)
            return value, "estimated", LIGHT_POINT_RULE, LIGHT_POINT_TEXT
        value = self.estimate.strength(self._in_metres(light), self.diagonal) * luminance_of_color
        unit = "lx" if kind == "distant" else "cd"
        self._note(
            light,
            Kind.GUESSED,
            "light-estimate",
            f"{value:.4g} {unit} by rule {self.estimate.name}; the source has no unit",
        )
        return value, "estimated", self.estimate.name, self.estimate.text

    def _stated(
        self, light: legacy.Light, rule: Rule, kind: str
    ) -> tuple[float, Provenance, str, str] | None:
        """The same by the photometry file; None where it does not say."""

        def note(kind: Kind, code: str, text: str) -> None:
            self._note(light, kind, code, text)

        if kind == "distant":
            lux = rule.number("illuminance")
            if lux is None:
                others = tuple(key for key in STRENGTHS if key != "illuminance")
                note_wrong_unit(rule, "illuminance", others, note)
                return None
            note_wrong_unit(rule, "illuminance alone", ("distance",), note)
            return lux, rule.provenance, str(rule.place), rule.source
        made = stated_candela(rule, _beam(light, rule), note)
        if made is None:
            wanted = "candela, lumens, watts, or a distance beside it"
            note_wrong_unit(rule, wanted, ("illuminance",), note)
            return None
        return made.value, made.provenance, made.rule, made.source

    def _in_metres(self, light: legacy.Light) -> legacy.Light:
        """The light with its attenuation per metre instead of per source unit."""
        if light.attenuation is None:
            return light
        k0, k1, k2 = light.attenuation
        return replace(light, attenuation=(k0, k1 / self.unit, k2 / self.unit**2))

    def _ambient_light(self, light: legacy.Light, rule: Rule | None) -> PhotometricLight | None:
        value = rule.number("illuminance") if rule else None
        if rule is not None:
            others = tuple(key for key in STRENGTHS if key != "illuminance")
            note_wrong_unit(rule, "illuminance", others, lambda *found: self._note(light, *found))
        if rule is not None and rule.sp:
            text = f"{rule.place}: the S/P of the ambient light is not used; its colour tells"
            self._note(light, Kind.DROPPED, "light-scotopic", text)
        color, strength = chromaticity(
            light.ambient if luminance(light.ambient) > 0.0 else light.diffuse
        )
        if rule is not None and value is not None:
            color = rule_color(rule, self.temperature) or color
            return PhotometricLight(
                "ambient",
                value,
                color,
                provenance=rule.provenance,
                rule=str(rule.place),
                source=rule.source,
            )
        value = self.estimate.ambient * strength
        if value <= 0.0:
            self._note(light, Kind.DROPPED, "light-dark", "gives no light; not written")
            return None
        self._note(
            light,
            Kind.GUESSED,
            "ambient-estimate",
            f"{value:.4g} lx of sky by rule {self.estimate.name}; the source has no unit",
        )
        color = rule_color(rule, self.temperature) or color
        return PhotometricLight(
            "ambient", value, color, rule=self.estimate.name, source=self.estimate.text
        )

    def _note_differences(self, light: legacy.Light) -> None:
        local = light.kind != "directional"
        if light.attenuation is not None and local and light.attenuation != (0, 0, 1):
            k = ", ".join(f"{v:g}" for v in light.attenuation)
            self._note(
                light, Kind.REPLACED, "light-attenuation", f"attenuation ({k}) replaced by 1/d^2"
            )
        if light.range is not None:
            self._note(
                light,
                Kind.REPLACED,
                "light-range",
                f"range {light.range:g} m kept as metadata and not applied; light has no range",
            )
        if luminance(light.ambient) > 0.0:
            self._note(
                light, Kind.DROPPED, "light-ambient", "ambient part of one light has no home"
            )
        if not local and (light.spot_cutoff < 180.0 or light.spot_exponent > 0.0):
            text = "cone of a light without a place; it shines everywhere alike"
            self._note(light, Kind.DROPPED, "light-cone", text)
        if light.candela is None and light.lux is None and light.specular != light.diffuse:
            self._note(
                light,
                Kind.DROPPED,
                "light-specular",
                "own specular colour; the diffuse one is used",
            )
        if light.candela is not None and light.spot_inner is not None:
            self._note(
                light,
                Kind.REPLACED,
                "spot-edge",
                "the cone's edge fades by UsdLux softness between the same two angles",
            )

    def emission(
        self, material: legacy.Material, rule: Rule | None, stated: float | None = None
    ) -> tuple[RGB, Provenance, str, str]:
        """Emission in cd/m2 per channel at 1.0 of its texture: (rgb, provenance, rule, source).

        ``stated``: what the rule's candela or lumens make, else its luminance counts.
        """
        if stated is None and rule is not None:
            stated = rule.number("luminance")
        if rule is not None and stated is not None:
            color = rule_color(rule, self.temperature)
            if color is None and luminance(material.emission) > 0.0:
                color = chromaticity(_not_negative(material.emission))[0]
            if color is None and not rule.values.get("hdr_texture"):
                color = chromaticity(_not_negative(material.diffuse))[0]
            r, g, b = color or (1.0, 1.0, 1.0)
            rgb = (r * stated, g * stated, b * stated)
            return rgb, rule.provenance, str(rule.place), rule.source
        emission = _not_negative(material.emission)
        if emission != material.emission:
            text = "emission below 0, which would take light away; read as 0"
            self._note(material, Kind.CLAMPED, "light-negative", text)
        if not any(emission):
            return (0.0, 0.0, 0.0), "authored", "", ""
        if material.emission_cd_m2:
            return emission, "authored", "source file", ""
        r, g, b = (self.estimate.luminance * c for c in emission)
        value = luminance((r, g, b))
        text = f"{value:.4g} cd/m2 by rule {self.estimate.name}; the source has no unit"
        self._note(material, Kind.GUESSED, "emission-estimate", text)
        return (r, g, b), "estimated", self.estimate.name, self.estimate.text

    def _note(
        self, thing: legacy.Light | legacy.Material, kind: Kind, code: str, text: str
    ) -> None:
        self.report.add(kind, code, thing.source, thing.name, text)


def _beam(light: legacy.Light, rule: Rule | None) -> Beam:
    """The cone and focus of a light; those of the rule's ``spread`` where it has none."""
    cutoff, softness = 180.0, 0.0
    if light.spot_cutoff < 180.0:
        cutoff = max(light.spot_cutoff, 0.0)
        if light.spot_inner is not None and cutoff > 0.0:
            softness = 1.0 - min(max(light.spot_inner, 0.0), cutoff) / cutoff
    beam = Beam(cutoff, softness, max(light.spot_exponent, 0.0))
    if beam.shaped or rule is None:
        return beam
    return SHAPES.get(rule.values.get("spread", "sphere"), beam)


def _factor(rule: Rule, luminaire: Luminaire) -> float:
    """What a rule multiplies the candela of its photometric file by."""
    lumens = rule.number("lumens")
    if lumens is not None:
        flux = luminaire.flux()
        return lumens / flux if flux > 0.0 else 0.0
    scale = rule.number("scale")
    return 1.0 if scale is None else scale


def _opening_radius(opening: Opening) -> float | None:
    """m, of the sphere whose cross-section is the luminous opening; None of a point."""
    area = opening.x * opening.y * (pi / 4.0 if opening.round else 1.0)
    radius = sqrt(max(area, 0.0) / pi)
    return radius if _LEAST_RADIUS <= radius <= _LARGEST_RADIUS else None


def _not_negative(color: RGB) -> RGB:
    r, g, b = (max(c, 0.0) for c in color)
    return r, g, b
