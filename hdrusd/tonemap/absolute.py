"""Luminances as they are: what the scene has is what the screen shows, up to its white.

For screens that reach the scene's luminances (SMPTE ST 2084). Above: clipped at white, or
rolled off in code values of ST 2084 by the EETF of ITU-R BT.2390-11, 5.4.1, on luminance.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.colour import PQ_PEAK, pq_decode, pq_encode
from hdrusd.errors import ParameterError
from hdrusd.eye.screen import Screen
from hdrusd.tonemap.curve import Curve, curve, proportional
from hdrusd.tonemap.operator import Array, Moment, Operator, Parameter, Uniforms, number

#: Steps of the curve that is handed to the shader: straight between them it errs by 1e-6.
_STEPS = 1024


def roll_off(y: npt.ArrayLike, white: float, source: float) -> Array:
    """Luminance ``y`` compressed so that ``source`` becomes ``white``; all in cd/m2.

    In code values, a Hermite spline from slope 1 at the knee, 1.5 white - 0.5 source, to
    slope 0 at the source (BT.2390). Below the knee nothing changes, above the source all is
    white. ``source`` must be above ``white``, its code value at most 3 times the white's: the
    knee would lie below black.
    """
    y = np.asarray(y)
    top, end = float(pq_encode(white)), float(pq_encode(source))
    knee = _knee(top, end)
    code = np.clip(pq_encode(y), knee, end)
    t = (code - knee) / (end - knee)
    spline = (
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * knee
        + t * (1.0 - t) ** 2 * (end - knee)
        + t * t * (3.0 - 2.0 * t) * top
    )
    return np.where(code > knee, pq_decode(spline), y)


def _knee(white: float, source: float) -> float:
    return 1.5 * white - 0.5 * source


def rolled_off(screen: Screen, source: float) -> Curve:
    """The curve for a screen on which ``source`` cd/m2 become white; BT.2390's code values."""
    top = float(pq_encode(screen.white_level))
    end = min(float(pq_encode(source)), 3.0 * top)
    if end <= top:
        return proportional(1.0, screen.white_level, screen.black_level)
    source = float(pq_decode(end))
    # A knee at black has no logarithm; 1e-4 cd/m2 is the first of 12 bits.
    start = max(float(pq_decode(_knee(top, end))), 1e-4)
    edges = np.linspace(math.log(start), math.log(source), _STEPS + 1)
    shown = np.log(roll_off(np.exp(edges), screen.white_level, source))
    return Curve(edges[0], edges[-1], shown, screen.black_level, screen.white_level)


def _uniforms(moment: Moment) -> Uniforms:
    params, screen = moment.parameters, moment.screen
    source = number("absolute", "source", params["source"], 1.0, PQ_PEAK)
    if params["above"] == "clip":
        return proportional(1.0, screen.white_level, screen.black_level).uniforms()
    if params["above"] == "rolloff":
        return rolled_off(screen, source).uniforms()
    raise ParameterError(f"absolute: above: {params['above']}; want clip or rolloff")


OPERATOR = Operator(
    name="absolute",
    title="Luminances as they are",
    cite="SMPTE ST 2084:2014; ITU-R BT.2390-11, 5.4.1",
    parameters=(
        Parameter("above", "clip", "", "what is brighter than white: clip or rolloff"),
        Parameter("source", PQ_PEAK, "cd/m2", "with rolloff, the luminance that becomes white"),
    ),
    reference=curve,
    glsl="tonemap/curve.glsl",
    function="curve",
    uniforms=_uniforms,
)
