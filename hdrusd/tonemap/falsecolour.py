"""False colour: luminance on a logarithmic scale from blue to red, to check a scene.

The scale and the palette of Radiance's falsecolor ("spec"). The
legend is in legend.py. Twin of falsecolour.glsl.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, srgb_decode
from hdrusd.tonemap.operator import Array, Operator, Parameter, Parameters, Statistics, number

#: Base-10 logarithm of 2: GLSL has log2 only.
_LOG10_2 = 0.30102999566398120


def falsecolour_position(y: npt.ArrayLike, scale: float, decades: float) -> Array:
    """Where luminance ``y`` lies on the scale, 0 to 1: 1 + log10(y / scale) / decades.

    ``scale`` is the top in cd/m2, its lower end ``decades`` powers of ten below.
    """
    y = np.asarray(y)
    ratio = np.maximum(y / scale, 10.0**-decades)
    place: Array = np.clip(1.0 + np.log2(ratio) * (_LOG10_2 / decades), 0.0, 1.0)
    return place


def falsecolour_palette(v: npt.ArrayLike) -> Array:
    """Code values (..., 3) in [0, 1] for a position in [0, 1]: blue, green at 3/8, red."""
    v = np.asarray(v)
    green = np.where(v > 0.375, 1.6 - 1.6 * v, v * (8.0 / 3.0))
    code: Array = np.stack((1.6 * v - 0.6, green, 1.0 - v * (8.0 / 3.0)), axis=-1)
    return code.clip(0.0, 1.0)


def falsecolour(rgb: npt.ArrayLike, scale: float, decades: float) -> Array:
    """cd/m2 (..., 3) to display-linear colours of the palette, in [0, 1]."""
    return srgb_decode(falsecolour_palette(falsecolour_position(luminance(rgb), scale, decades)))


def _uniforms(_: Statistics | None, params: Parameters) -> dict[str, Any]:
    return {
        "falsecolour_scale": number("falsecolour", "scale", params["scale"], 1e-9, 1e12),
        "falsecolour_decades": number("falsecolour", "decades", params["decades"], 0.1, 20.0),
    }


def _reference(rgb: Array, stats: Statistics | None, params: Parameters) -> Array:
    uniforms = _uniforms(stats, params)
    return falsecolour(rgb, uniforms["falsecolour_scale"], uniforms["falsecolour_decades"])


OPERATOR = Operator(
    name="falsecolour",
    title="False colour of luminance, logarithmic",
    cite="G. Ward, falsecolor, Radiance",
    parameters=(
        Parameter("scale", 1000.0, "cd/m2", "luminance at the top of the scale (red)"),
        Parameter("decades", 5.0, "", "powers of ten from the top to the bottom (blue)"),
    ),
    reference=_reference,
    glsl="tonemap/falsecolour.glsl",
    function="falsecolour",
    uniforms=_uniforms,
    tone_curve=False,
)
