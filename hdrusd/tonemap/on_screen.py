"""Luminances that a screen shall show, in cd/m2, as display-linear values.

For operators whose result is absolute (ward94, ferwerda96, absolute). Twin of on_screen.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, to_gamut
from hdrusd.eye.screen import Screen
from hdrusd.tonemap.operator import Array


def on_screen(rgb: npt.ArrayLike, black: float, white: float) -> Array:
    """Light to be seen (..., 3) in cd/m2 to display-linear [0, 1], chromaticity kept.

    ``black`` and ``white`` are what is seen at the screen's black and white, cd/m2, its
    reflections included; v = (L - black) / (white - black). What is darker than black is
    black, what is brighter than white is white.
    """
    rgb = np.asarray(rgb)
    y = luminance(rgb)
    shown = np.maximum((y - black) / (white - black), 0.0)
    gain = shown / np.where(shown > 0.0, y, 1.0)
    return to_gamut(rgb * gain[..., None], shown)


def screen_uniforms(screen: Screen) -> dict[str, float]:
    """The uniforms of on_screen.glsl."""
    return {"screen_black": screen.black_level, "screen_white": screen.white_level}
