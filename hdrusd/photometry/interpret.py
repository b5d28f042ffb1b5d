"""What legacy lights and materials mean: the only place where colours become photometry.

A number comes from the photometry file, else from the source where its format has
units (glTF: cd, lx, cd/m2), else from a named rule of ``estimate.py``; which one is
recorded. Each step that changes or guesses something is a finding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from hdrusd.legacy import scene as legacy
from hdrusd.legacy.scene import RGB
from hdrusd.photometry.estimate import Estimate
from hdrusd.photometry.light import PhotometricLight, Provenance, chromaticity
from hdrusd.photometry.sidecar import Rule
from hdrusd.report import Kind, Report
from hdrusd.units import LUMINANCE_WEIGHTS

#: Radius of a lamp whose size nobody states, m; only other renderers' values depend on it.
LAMP_RADIUS = 0.05

#: From a colour temperature in K to linear Rec. 709 of luminance 1.
TemperatureToRGB = Callable[[float], RGB]


def luminance(color: RGB) -> float:
    """Relative luminance of linear Rec. 709."""
    return sum(w * c for w, c in zip(LUMINANCE_WEIGHTS, color, strict=True))


def rule_color(rule: Rule | None, temperature: TemperatureToRGB) -> RGB | None:
    """The chromaticity that a photometry rule states, luminance 1; None when it states none."""
    if rule is None:
        return None
    color = rule.color()
    if color is not None and luminance(color) > 0.0:
        return chromaticity(color)[0]
    kelvin = rule.number("temperature")
    return temperature(kelvin) if kelvin else None


@dataclass(frozen=True, slots=True)
class Interpreter:
    """The rules of one conversion. ``diagonal``: of the scene, m, for estimates."""

    estimate: Estimate
    diagonal: float
    temperature: TemperatureToRGB
    report: Report

    def light(self, light: legacy.Light, rule: Rule | None) -> PhotometricLight | None:
        """The lamp, or None where it is switched off or dark. House rule: one light, end to end."""
        enabled = light.enabled if rule is None else rule.values.get("enabled", light.enabled)
        if not enabled:
            self._note(light, Kind.DROPPED, "light-off", "switched off; not written")
            return None
        kind = _KINDS[light.kind]
        if light.kind == "ambient":
            return self._ambient_light(light, rule)
        color, strength = chromaticity(light.diffuse)
        intensity, provenance, name, source = self._strength(light, rule, kind, strength)
        if rule is not None and intensity is not None:
            color = rule_color(rule, self.temperature) or color
        if intensity is None or not math.isfinite(intensity) or intensity <= 0.0:
            self._note(light, Kind.DROPPED, "light-dark", "gives no light; not written")
            return None
        self._note_differences(light, kind)
        cutoff, softness = 180.0, 0.0
        if light.spot_cutoff < 180.0:
            cutoff = light.spot_cutoff
            if light.spot_inner is not None and cutoff > 0.0:
                softness = 1.0 - min(light.spot_inner, cutoff) / cutoff
        radius = (rule.number("radius") if rule else None) or LAMP_RADIUS
        if kind != "distant" and (rule is None or "radius" not in rule.values):
            self._note(
                light,
                Kind.ASSUMED,
                "lamp-radius",
                f"lamp of {LAMP_RADIUS} m radius; none is stated",
            )
        return PhotometricLight(
            kind="spot" if cutoff < 180.0 or light.spot_exponent > 0.0 else kind,
            intensity=intensity,
            chromaticity=color,
            cutoff=cutoff,
            softness=softness,
            exponent=light.spot_exponent,
            radius=radius,
            provenance=provenance,
            rule=name,
            source=source,
        )

    def _strength(
        self, light: legacy.Light, rule: Rule | None, kind: str, luminance_of_color: float
    ) -> tuple[float | None, Provenance, str, str]:
        """(cd or lx, provenance, rule, source) by the first that knows."""
        key, other = ("illuminance", "candela") if kind == "distant" else ("candela", "illuminance")
        if rule is not None:
            value = rule.number(key)
            if value is not None:
                return value, rule.provenance, f"{rule.place}", rule.source
            if other in rule.values:
                self._note(
                    light, Kind.INVALID, "sidecar-unit", f"{rule.place} says {other}; want {key}"
                )
        stated = light.lux if kind == "distant" else light.candela
        if stated is not None:
            return stated * luminance_of_color, "authored", "source file", ""
        value = self.estimate.strength(light, self.diagonal) * luminance_of_color
        unit = "lx" if kind == "distant" else "cd"
        self._note(
            light,
            Kind.GUESSED,
            "light-estimate",
            f"{value:.4g} {unit} by rule {self.estimate.name}; the source has no unit",
        )
        return value, "estimated", self.estimate.name, self.estimate.text

    def _ambient_light(self, light: legacy.Light, rule: Rule | None) -> PhotometricLight | None:
        value = rule.number("illuminance") if rule else None
        color, strength = chromaticity(
            light.ambient if luminance(light.ambient) > 0.0 else light.diffuse
        )
        if rule is not None and value is not None:
            color = rule_color(rule, self.temperature) or color
            return PhotometricLight(
                "ambient", value, color, provenance=rule.provenance, rule=str(rule.place)
            )
        value = self.estimate.ambient * strength
        if value <= 0.0:
            return None
        self._note(
            light,
            Kind.GUESSED,
            "ambient-estimate",
            f"{value:.4g} lx of sky by rule {self.estimate.name}; the source has no unit",
        )
        return PhotometricLight("ambient", value, color, rule=self.estimate.name)

    def _note_differences(self, light: legacy.Light, kind: str) -> None:
        if light.attenuation is not None and kind != "distant" and light.attenuation != (0, 0, 1):
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
        if kind != "distant" and light.kind != "ambient" and luminance(light.ambient) > 0.0:
            self._note(
                light, Kind.DROPPED, "light-ambient", "ambient part of a local light has no home"
            )
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
        self, material: legacy.Material, rule: Rule | None
    ) -> tuple[RGB, Provenance, str, str]:
        """Emission in cd/m2 per channel (at 1.0 of its texture): (rgb, provenance, rule, source)."""
        stated = rule.number("luminance") if rule else None
        if rule is not None and stated is not None:
            color = rule_color(rule, self.temperature)
            if color is None and luminance(material.emission) > 0.0:
                color = chromaticity(material.emission)[0]
            if color is None and not rule.values.get("hdr_texture"):
                color = chromaticity(material.diffuse)[0]
            r, g, b = color or (1.0, 1.0, 1.0)
            rgb = (r * stated, g * stated, b * stated)
            return rgb, rule.provenance, str(rule.place), rule.source
        if luminance(material.emission) <= 0.0:
            return (0.0, 0.0, 0.0), "authored", "", ""
        if material.emission_cd_m2:
            return material.emission, "authored", "source file", ""
        r, g, b = (self.estimate.luminance * c for c in material.emission)
        self.report.add(
            Kind.GUESSED,
            "emission-estimate",
            material.source,
            material.name,
            f"{luminance((r, g, b)):.4g} cd/m2 by rule {self.estimate.name}; the source has no unit",
        )
        return (r, g, b), "estimated", self.estimate.name, self.estimate.text

    def _note(self, light: legacy.Light, kind: Kind, code: str, text: str) -> None:
        self.report.add(kind, code, light.source, light.name, text)


_KINDS = {"point": "point", "spot": "spot", "directional": "distant", "ambient": "ambient"}
