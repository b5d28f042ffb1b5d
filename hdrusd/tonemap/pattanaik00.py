"""Pattanaik, Tumblin, Yee, Greenberg 2000: what is seen while cones and rods adapt.

S. Pattanaik, J. Tumblin, H. Yee, D. Greenberg, "Time-Dependent Visual Adaptation for Fast
Realistic Image Display", SIGGRAPH 2000, with Hunt's model of colour appearance for the
static part. Of the equations as printed and as programs have them, three are mended: 0.171
is in the cones' sigma; j of the rods has 5e5; the rods' sigma is Hunt's by default, where
the paper's is five times too small (``rods``: hunt or paper). Twin of pattanaik00.glsl.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.colour import DARKEST, luminance, to_gamut, with_luminance
from hdrusd.errors import ParameterError
from hdrusd.eye.adaptation import Goal, goal
from hdrusd.eye.retina import response
from hdrusd.eye.scotopic import scotopic, white_relative
from hdrusd.tonemap.operator import (
    Array,
    Moment,
    Need,
    Operator,
    Parameter,
    Parameters,
    State,
    Uniforms,
    measured,
)

#: Exponent of the response.
EXPONENT = 0.73

#: Time constants of neural adaptation and of pigment, s, and cd/m2 that bleach half of it.
CONE_TIMES, ROD_TIMES = (0.080, 110.0), (0.150, 400.0)
CONE_HALF_BLEACH, ROD_HALF_BLEACH = 2e6, 0.04

#: White is 5 times the luminance adapted to, and black a 32nd of white.
_WHITE, _BLACK = 5.0, 32.0

#: Least share of luminance that a channel has where its power is taken: 0^0 is nothing.
_LEAST = 1e-6


def cone_sigma(adapting: float) -> float:
    """Half saturation of the cones, cd/m2, at a luminance > 0 in cd/m2."""
    k4 = (1.0 / (5.0 * adapting + 1.0)) ** 4
    level = k4 * adapting + 0.171 * (1.0 - k4) ** 2 * math.pow(adapting, 1.0 / 3.0)
    return 12.9223 * adapting / level


def paper_rod_sigma(adapting: float) -> float:
    """Half saturation of the rods, cd/m2, as the paper prints it, but for j."""
    j2 = (1.0 / (5e5 * adapting + 1.0)) ** 2
    level = 19000.0 * j2 * adapting + 0.2615 * (1.0 - j2) ** 4 * math.pow(adapting, 1.0 / 6.0)
    return 2.5874 * adapting / level


def hunt_rod_sigma(adapting: float) -> float:
    """Half saturation of the rods, cd/m2, after Hunt's model of 1995."""
    x = 5.0 * adapting / 2.26
    j2 = (1e-5 / (x + 1e-5)) ** 2
    level = 3800.0 * j2 * x + 0.2 * (1.0 - j2) ** 4 * x ** (1.0 / 6.0)
    return float(5.0 * 2.0 ** (1.0 / EXPONENT) * adapting / level)


ROD_SIGMAS: dict[str, Callable[[float], float]] = {
    "hunt": hunt_rod_sigma,
    "paper": paper_rod_sigma,
}


class Adaptation(NamedTuple):
    """State of the eye: neural adaptation in cd/m2, and pigment as shares."""

    cone: float
    rod: float
    cone_pigment: float
    rod_pigment: float


def steady(cone: float, rod: float) -> Adaptation:
    """The state after these luminances, cd/m2, for ever."""
    return Adaptation(
        cone, rod, _unbleached(cone, CONE_HALF_BLEACH), _unbleached(rod, ROD_HALF_BLEACH)
    )


def _unbleached(light: float, half: float) -> float:
    return half / (half + light)


def looked(state: Adaptation, cone: float, rod: float, dt: float) -> Adaptation:
    """The state after ``dt`` s, 0 to infinity, of constant luminances in cd/m2; exact."""
    limit = steady(cone, rod)

    def left(time: float) -> float:
        return math.exp(-dt / time)

    shares = (
        left(CONE_TIMES[0]),
        left(ROD_TIMES[0]),
        left(CONE_TIMES[1] * limit.cone_pigment),
        left(ROD_TIMES[1] * limit.rod_pigment),
    )
    return Adaptation(*(e + (s - e) * k for s, e, k in zip(state, limit, shares, strict=True)))


class Appearance(NamedTuple):
    """What the scene's response becomes on the display: gain x R + offset."""

    gain: float
    offset: float


def appearance(white: float, black: float, shown_white: float, shown_black: float) -> Appearance:
    """From responses to white and black in the scene and on the display (section 4.4)."""
    span, shown = white - black, shown_white - shown_black
    if white <= shown_white and black >= shown_black:
        return Appearance(1.0, 0.0)
    if span > shown:
        gain = shown / span
        return Appearance(gain, shown_black - gain * black)
    return Appearance(1.0, shown_white - white if white > shown_white else shown_black - black)


def _power(y: Array, sigma: float) -> Array:
    return np.asarray(np.power(np.maximum(y, 0.0) / sigma, EXPONENT))


def pattanaik00_response(y: npt.ArrayLike, rods: npt.ArrayLike, uniforms: Uniforms) -> Array:
    """Response of cones and rods, 0 to 2, to luminances in cd/m2, the rods' white-relative."""
    cone_sigma_, rod_sigma = uniforms["pattanaik00_sigma"]
    cone_share, rod_share = uniforms["pattanaik00_pigment"]
    c, r = _power(np.asarray(y), cone_sigma_), _power(np.asarray(rods), rod_sigma)
    return np.asarray(cone_share * (c / (1.0 + c)) + rod_share * (r / (1.0 + r)))


def pattanaik00_saturation(y: npt.ArrayLike, shown: npt.ArrayLike, uniforms: Uniforms) -> Array:
    """Exponent of C/Y: how colourful the scene is seen over how colourful the display is.

    Both are slopes of the cones' response to ln luminance, at ``y`` and ``shown`` cd/m2.
    """
    c = _power(np.asarray(y), uniforms["pattanaik00_sigma"][0])
    d = _power(np.asarray(shown), uniforms["pattanaik00_display"][0])
    scene = uniforms["pattanaik00_pigment"][0] * c / (1.0 + c) ** 2
    # Where the display is black, any exponent gives black.
    display = np.maximum(d / (1.0 + d) ** 2, 1e-12)
    return np.asarray(np.minimum(scene / display, 1.0))


def pattanaik00(rgb: npt.ArrayLike, uniforms: Uniforms) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1]."""
    rgb = np.asarray(rgb, np.float64)
    y = luminance(rgb)
    gain, offset = uniforms["pattanaik00_appearance"]
    sigma, most = uniforms["pattanaik00_display"]
    black, white = uniforms["pattanaik00_screen"]
    seen = pattanaik00_response(y, white_relative(scotopic(rgb)), uniforms)
    seen = np.clip(gain * seen + offset, 0.0, most)
    shown = sigma * np.power(seen / (1.0 - seen), 1.0 / EXPONENT)
    exponent = pattanaik00_saturation(y, shown, uniforms)
    colour = np.maximum(rgb / np.maximum(y, DARKEST)[..., None], _LEAST)
    colour = np.power(colour, exponent[..., None])
    value = np.clip((shown - black) / (white - black), 0.0, 1.0)
    # The power changes the luminance; what the operator says of it is kept.
    return to_gamut(with_luminance(colour, value), value)


def scene_uniforms(state: Adaptation, rods: str, black: float, white: float) -> Uniforms:
    """All that pixels need, for a display from ``black`` to ``white`` cd/m2.

    The viewer is adapted to a fifth of the display's white, with cones alone.
    """
    if rods not in ROD_SIGMAS:
        raise ParameterError(f"pattanaik00: rods: {rods}; want {' or '.join(ROD_SIGMAS)}")
    sigma = cone_sigma(state.cone), ROD_SIGMAS[rods](state.rod)
    pigment = state.cone_pigment, state.rod_pigment
    eye = {"pattanaik00_sigma": sigma, "pattanaik00_pigment": pigment}
    whites = np.array([1.0, 1.0 / _BLACK]) * _WHITE
    seen = pattanaik00_response(whites * state.cone, whites * state.rod, eye)
    viewer = cone_sigma(white / _WHITE)
    shown = response([white, white / _BLACK], viewer, EXPONENT)
    return {
        **eye,
        "pattanaik00_appearance": tuple(appearance(*map(float, (*seen, *shown)))),
        "pattanaik00_display": (viewer, float(shown[0])),
        "pattanaik00_screen": (black, white),
    }


def _goal(moment: Moment) -> Goal:
    foveal = measured("pattanaik00", moment.statistics).foveal
    if foveal is None:
        raise ParameterError("pattanaik00: statistics without a foveal image; want one")
    return goal(foveal, moment.observer)


def _advance(state: State | None, moment: Moment, dt: float) -> State:
    at = _goal(moment)
    if state is None:
        return steady(at.cone, at.rod)._asdict()
    return looked(_unpacked(state), at.cone, at.rod, dt)._asdict()


def _unpacked(state: State) -> Adaptation:
    try:
        eye = Adaptation(**{key: float(value) for key, value in state.items()})
    except (TypeError, ValueError):
        eye = Adaptation(*[math.nan] * 4)
    if not (all(0.0 < v < math.inf for v in eye) and max(eye[2:]) <= 1.0):
        raise ParameterError("pattanaik00: state: not an eye; want what an earlier frame left")
    return eye


def _eye(moment: Moment) -> Adaptation:
    return _unpacked(moment.state or _advance(None, moment, math.inf))


def _uniforms(moment: Moment) -> Uniforms:
    screen = moment.screen
    rods = str(moment.parameters["rods"])
    return scene_uniforms(_eye(moment), rods, screen.black_level, screen.white_level)


def _trace(moment: Moment) -> Mapping[str, float]:
    eye, at, uniforms = _eye(moment), _goal(moment), _uniforms(moment)
    return {
        "goal luminance [cd/m2]": at.cone,
        "goal luminance of rods [cd/m2]": at.rod,
        "adaptation of cones [cd/m2]": eye.cone,
        "adaptation of rods [cd/m2]": eye.rod,
        "sigma of cones [cd/m2]": uniforms["pattanaik00_sigma"][0],
        "sigma of rods [cd/m2]": uniforms["pattanaik00_sigma"][1],
        "cone pigment": eye.cone_pigment,
        "rod pigment": eye.rod_pigment,
    }


def _needs(_: Parameters) -> Need:
    return Need.FOVEAL


OPERATOR = Operator(
    name="pattanaik00",
    title="Appearance while cones and rods adapt",
    cite="Pattanaik, Tumblin, Yee, Greenberg, SIGGRAPH 2000; Hunt, Reproduction of Colour, 1995",
    parameters=(Parameter("rods", "hunt", "", "half saturation of the rods: hunt or paper"),),
    reference=pattanaik00,
    glsl="tonemap/pattanaik00.glsl",
    function="pattanaik00",
    uniforms=_uniforms,
    needs=_needs,
    advance=_advance,
    trace=_trace,
)
