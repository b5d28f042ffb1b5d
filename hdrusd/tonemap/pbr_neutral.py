"""Khronos PBR Neutral: base colours as they are, highlights compressed toward white.

Khronos Group, "Khronos PBR Neutral Tone Mapper", specification, 2024. It takes exposed RGB
(exposure.py). Twin of pbr_neutral.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.tonemap.exposure import (
    EXPOSURE_PARAMETERS,
    exposed,
    exposure_advance,
    exposure_needs,
    exposure_trace,
    exposure_uniforms,
)
from hdrusd.tonemap.operator import Array, Moment, Operator, Uniforms

#: Fresnel reflection at normal incidence that is taken off, where compression starts, and how
#: soon a highlight loses its colour.
_F0, _START, _DESATURATION = 0.04, 0.8 - 0.04, 0.15


def neutral(rgb: npt.ArrayLike) -> Array:
    """Exposed RGB >= 0 (..., 3) to display-linear [0, 1]."""
    rgb = np.asarray(rgb)
    least = rgb.min(axis=-1, keepdims=True)
    colour = rgb - np.where(least <= 2.0 * _F0, least - least * least / (4.0 * _F0), _F0)
    peak = colour.max(axis=-1, keepdims=True)
    high = np.maximum(peak, _START)  # the rest only counts above the start
    shown = 1.0 - (1.0 - _START) ** 2 / (high + 1.0 - 2.0 * _START)
    keep = 1.0 / (_DESATURATION * (high - shown) + 1.0)
    compressed = colour * (shown / high * keep) + shown * (1.0 - keep)
    return np.minimum(np.where(peak > _START, compressed, colour), 1.0)


def pbr_neutral(rgb: npt.ArrayLike, scale: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1]; ``scale`` in 1/(cd/m2)."""
    return neutral(exposed(rgb, scale))


def _uniforms(moment: Moment) -> dict[str, float]:
    return exposure_uniforms("pbr_neutral", moment)


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return pbr_neutral(rgb, uniforms["exposure_scale"])


OPERATOR = Operator(
    name="pbr_neutral",
    title="Khronos PBR Neutral",
    cite="Khronos Group, PBR Neutral Tone Mapper, 2024",
    parameters=EXPOSURE_PARAMETERS,
    reference=_reference,
    glsl="tonemap/pbr_neutral.glsl",
    function="pbr_neutral",
    uniforms=_uniforms,
    needs=exposure_needs,
    advance=exposure_advance,
    trace=exposure_trace,
)
