"""Ward 1994, a contrast-based scale factor.

G. Ward, "A Contrast-Based Scalefactor for Luminance Display", Graphics Gems IV, 1994: one
factor, so that what can just be told apart in the scene can just be told apart on the
screen. Twin of ward94.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.tonemap.on_screen import on_screen, screen_uniforms
from hdrusd.tonemap.operator import (
    Array,
    Moment,
    Need,
    Operator,
    Parameters,
    Uniforms,
    measured,
)


def contrast_scale(white: float, world_adaptation: float) -> float:
    """Luminance of the screen per luminance of the scene; both arguments in cd/m2.

    The eye is taken to adapt to half of the screen's white, and to ``world_adaptation`` in
    the scene: its log average.
    """
    shown, seen = 1.219 + (0.5 * white) ** 0.4, 1.219 + world_adaptation**0.4
    return float((shown / seen) ** 2.5)


def ward94(rgb: npt.ArrayLike, scale: float, black: float, white: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1]; ``black`` and ``white`` as in on_screen."""
    return on_screen(np.asarray(rgb) * scale, black, white)


def _uniforms(moment: Moment) -> dict[str, float]:
    average = measured("ward94", moment.statistics).log_average
    scale = contrast_scale(moment.screen.white_level, average)
    return {"ward94_scale": scale, **screen_uniforms(moment.screen)}


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return ward94(rgb, uniforms["ward94_scale"], uniforms["screen_black"], uniforms["screen_white"])


def _needs(_: Parameters) -> Need:
    return Need.AVERAGES


OPERATOR = Operator(
    name="ward94",
    title="Contrast-based scale factor",
    cite="Ward, Graphics Gems IV, 1994",
    parameters=(),
    reference=_reference,
    glsl="tonemap/ward94.glsl",
    function="ward94",
    uniforms=_uniforms,
    needs=_needs,
)
