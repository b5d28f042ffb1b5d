"""What reaches the inputs of a surface becomes a ``scene.Material``, whatever its language."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from hdrusd.report import Kind
from hdrusd.scene import Material, TextureUse
from hdrusd.usd.network import Findings, Signal

#: Inputs that are colours, by the fields of scene.Material; the others are shares.
_COLORS = ("diffuse", "specular", "emission")
_REFLECTANCES = ("diffuse", "specular")

#: Reflectance at normal incidence of the clearcoat that shader 1 draws.
CLEARCOAT_F0 = 0.04


def f0_from_ior(ior: float) -> float:
    """Reflectance at normal incidence of a dielectric: ((1 - n) / (1 + n))^2 (Fresnel)."""
    return ((1.0 - ior) / (1.0 + ior)) ** 2


def build_material(
    findings: Findings,
    signals: Mapping[str, Signal],
    *,
    threshold: float,
    presence: bool,
    normal_map: TextureUse | None,
) -> Material:
    """A GGX material from what reaches its inputs, by the names of ``Material``'s fields.

    ``threshold``: of a cut-out, 0 for none; ``presence``: opacity takes the highlight too.
    """
    values: dict[str, Any] = {}
    for name, signal in signals.items():
        if name in _COLORS:
            values[name] = findings.color(name, signal.value)
        else:
            values[name] = findings.share(name, signal.value[0])
        if signal.use is not None:
            values[f"{name}_map"] = signal.use
            if name in _REFLECTANCES and signal.use.leaves_shares():
                text = f"{name}: its texture's scale and bias lead out of 0 to 1; held there"
                findings.finding("value-range", text, Kind.CLAMPED)
        if signal.primvar and name not in ("diffuse", "opacity"):
            shown = ", ".join(f"{v:g}" for v in signal.value)
            findings.finding("node-unknown", f"{name}: primvar is not read; {shown} is used")
    color, opacity = signals["diffuse"], signals["opacity"]
    varies = opacity.use is not None or bool(opacity.primvar)
    return Material(
        model="ggx",
        vertex_color=color.primvar,
        vertex_absent=_three(color.absent),
        vertex_opacity=opacity.primvar,
        opacity_threshold=threshold,
        blend=threshold <= 0.0 and (varies or values["opacity"] < 1.0),
        presence=presence and threshold <= 0.0,
        normal_map=normal_map,
        **values,
    )


def _three(absent: tuple[float, ...]) -> tuple[float, float, float]:
    if len(absent) != 3:
        return 1.0, 1.0, 1.0
    r, g, b = (max(v, 0.0) for v in absent)
    return r, g, b


def note_clearcoat(findings: Findings, made: Material, ior: float) -> None:
    """Say where a clearcoat has another index of refraction than the one that is drawn."""
    used = made.clearcoat > 0.0 or made.clearcoat_map is not None
    if used and abs(f0_from_ior(ior) - CLEARCOAT_F0) > 1e-6:
        text = f"clearcoat of ior {ior:g} reflects {CLEARCOAT_F0:g} at normal incidence, as of 1.5"
        findings.finding("clearcoat-ior", text, Kind.REPLACED)


def level_fallback(use: TextureUse) -> TextureUse:
    """A normal map that leaves the surface as it is where its file cannot be read."""
    x, y, z, w = (
        (wanted - bias) / scale if scale else 0.0
        for wanted, scale, bias in zip((0.0, 0.0, 1.0, 1.0), use.scale, use.bias, strict=True)
    )
    return replace(use, fallback=(x, y, z, w))
