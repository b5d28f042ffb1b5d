"""Drago et al. 2003, adaptive logarithmic mapping.

F. Drago, K. Myszkowski, T. Annen, N. Chiba, "Adaptive Logarithmic Mapping For Displaying
High Contrast Scenes", Computer Graphics Forum 22(3), 2003, eq. 4. Its gamma (section 4.2) is
left to the screen's encoding. Twin of drago03.glsl.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, to_gamut, with_luminance
from hdrusd.tonemap.operator import (
    Array,
    Moment,
    Need,
    Operator,
    Parameter,
    Parameters,
    Uniforms,
    measured,
    number,
)


def world_adaptation(log_average: float, bias: float) -> float:
    """Luminance that the scene's are divided by, cd/m2; the log average for the bias 0.85."""
    return log_average / (1.0 + bias - 0.85) ** 5


def drago03_curve(y: npt.ArrayLike, scale: float, top: float, power: float) -> Array:
    """Luminance ``y`` in cd/m2 to display-linear, 1 for the brightest of the frame (eq. 4).

    ``scale`` is 1 / world_adaptation in 1/(cd/m2), ``top`` the frame's largest luminance
    times it, ``power`` ln(bias) / ln(0.5). Where ``top`` is past 2e5 (bias 0.85) the curve
    goes through 1 below the brightest pixel and comes back to 1 there: clip it.
    """
    x = np.asarray(y) * scale
    # A pixel is never brighter than its frame's brightest, but statistics may be another's.
    base = 2.0 + 8.0 * np.minimum(x / top, 1.0) ** power
    curve: Array = np.log1p(x) / (np.log(base) * math.log10(1.0 + top))
    return curve


def drago03(rgb: npt.ArrayLike, scale: float, top: float, power: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1], chromaticity kept; arguments of drago03_curve."""
    rgb = np.asarray(rgb)
    shown = drago03_curve(luminance(rgb), scale, top, power)
    return to_gamut(with_luminance(rgb, shown), shown)


def _uniforms(moment: Moment) -> dict[str, float]:
    stats = measured("drago03", moment.statistics)
    bias = number("drago03", "bias", moment.parameters["bias"], 0.5, 1.0)
    scale = 1.0 / world_adaptation(stats.log_average, bias)
    return {
        "drago03_scale": scale,
        "drago03_top": stats.maximum * scale,
        "drago03_power": math.log(bias) / math.log(0.5),
    }


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return drago03(
        rgb, uniforms["drago03_scale"], uniforms["drago03_top"], uniforms["drago03_power"]
    )


def _needs(_: Parameters) -> Need:
    return Need.AVERAGES


OPERATOR = Operator(
    name="drago03",
    title="Adaptive logarithmic mapping",
    cite="Drago, Myszkowski, Annen, Chiba, Computer Graphics Forum 22(3), 2003",
    parameters=(Parameter("bias", 0.85, "", "0.5 to 1: less for more contrast in the dark parts"),),
    reference=_reference,
    glsl="tonemap/drago03.glsl",
    function="drago03",
    uniforms=_uniforms,
    needs=_needs,
)
