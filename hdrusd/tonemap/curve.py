"""One curve for all pixels, from ln scene luminance to ln display luminance; twin of curve.glsl.

The curve is given at equally spaced brightnesses and straight between them, as a cumulated
histogram is (Ward Larson, Rushmeier, Piatko, IEEE TVCG 3(4), 1997, eq. 4). Beyond its ends it
goes on in proportion to the luminance, until the display's black or white stops it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, to_gamut, with_luminance
from hdrusd.eye.screen import Screen

Array = npt.NDArray[Any]

#: Darkest that a display is taken to show, in whites: the first code of 8 bits above 0 is 3e-4.
DEEPEST = 1e-4

#: cd/m2 that stand for 0 where a logarithm is taken.
LEAST = 1e-30

LN2 = math.log(2.0)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Ln cd/m2 on the display (n + 1,) at equal steps of ln cd/m2 of the scene, bmin to bmax.

    ``black`` and ``white``, cd/m2, are what a display shows for 0 and 1.
    """

    bmin: float
    bmax: float
    log_display: Array
    black: float
    white: float

    def display(self, y: npt.ArrayLike) -> Array:
        """Display luminance for a scene luminance, cd/m2 both, any shape."""
        b = np.log(np.maximum(np.asarray(y, np.float64), LEAST))
        edges = np.linspace(self.bmin, self.bmax, self.log_display.size)
        beyond = b - np.clip(b, self.bmin, self.bmax)
        shown = np.exp(np.interp(b, edges, self.log_display) + beyond)
        limited: Array = np.clip(shown, self.black, self.white)
        return limited

    def uniforms(self) -> dict[str, Any]:
        """What ``curve`` and its twin read.

        ``curve_steps`` (1, n + 2, 2): log2 display luminance where a step begins, in units of
        white - black, and its rise; before the first step and after the last one more, each in
        proportion to the scene. ``curve_place``: what makes the number of a step of a log2
        luminance, factor and summand. ``curve_to``: log2 of white, and black, in the same units.
        ``curve_last``: number of the last step.
        """
        n = self.log_display.size - 1
        width, range_ = (self.bmax - self.bmin) / n, self.white - self.black
        ends = self.log_display[0] - width, self.log_display[-1] + width
        edges = (np.concatenate([ends[:1], self.log_display, ends[1:]]) - math.log(range_)) / LN2
        pairs = np.stack([edges[:-1], np.diff(edges)], axis=-1)
        return {
            "curve_steps": pairs[None].astype(np.float32),
            "curve_place": (LN2 / width, 1.0 - self.bmin / width),
            "curve_to": (math.log2(self.white / range_), self.black / range_),
            "curve_last": n + 1.0,
        }


def display_range(screen: Screen) -> tuple[float, float]:
    """Luminances in cd/m2 between which a curve may use a screen, logarithms taken.

    A screen that shows black as nothing is taken to show DEEPEST of its white.
    """
    return max(screen.black_level, DEEPEST * screen.white_level), screen.white_level


def proportional(scale: float, white: float, black: float = 0.0) -> Curve:
    """The curve display luminance = ``scale`` x scene luminance, up to ``white`` cd/m2."""
    top = math.log(white)
    end = top - math.log(scale)
    return Curve(end - 1.0, end, np.array([top - 1.0, top]), black, white)


def curve_at(rgb: npt.ArrayLike, uniforms: Mapping[str, Any]) -> Array:
    """The number of a step, and how far on in it, for cd/m2 (..., 3)."""
    return _place(luminance(np.asarray(rgb, np.float64)), uniforms)


def curve_step(at: npt.ArrayLike, uniforms: Mapping[str, Any]) -> Array:
    """(..., 2) where the step at a place begins, and its rise."""
    return np.asarray(np.asarray(uniforms["curve_steps"], np.float64)[0][_number(at, uniforms)])


def curve_shown(at: npt.ArrayLike, step: npt.ArrayLike, uniforms: Mapping[str, Any]) -> Array:
    """Display-relative value in [0, 1] at a place in a ``step`` (..., 2)."""
    top, black = uniforms["curve_to"]
    step = np.asarray(step)
    shown = step[..., 0] + (np.asarray(at) - _number(at, uniforms)) * step[..., 1]
    # Cut before the exponential, which the sun would overflow in float32.
    return np.asarray(np.clip(np.exp2(np.minimum(shown, top)) - black, 0.0, 1.0))


def curve_value(y: npt.ArrayLike, uniforms: Mapping[str, Any]) -> Array:
    """Display-relative value in [0, 1] for a scene luminance in cd/m2, any shape."""
    at = _place(np.asarray(y, np.float64), uniforms)
    return curve_shown(at, curve_step(at, uniforms), uniforms)


def _place(y: Array, uniforms: Mapping[str, Any]) -> Array:
    factor, summand = uniforms["curve_place"]
    return np.asarray(np.log2(np.maximum(y, LEAST)) * factor + summand)


def _number(at: npt.ArrayLike, uniforms: Mapping[str, Any]) -> npt.NDArray[np.intp]:
    return np.asarray(np.clip(at, 0, uniforms["curve_last"]), np.intp)


def curve(rgb: npt.ArrayLike, uniforms: Mapping[str, Any]) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1] by ``Curve.uniforms``; chromaticity is kept."""
    rgb = np.asarray(rgb)
    value = curve_value(luminance(rgb), uniforms)
    return to_gamut(with_luminance(rgb, value), value)
