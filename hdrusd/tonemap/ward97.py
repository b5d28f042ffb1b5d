"""Ward Larson, Rushmeier and Piatko 1997: histogram adjustment of brightness.

G. Ward Larson, H. Rushmeier, C. Piatko, "A Visibility Matching Tone Reproduction Operator for
High Dynamic Range Scenes", IEEE TVCG 3(4), 1997, for an adapted observer. ``solver`` "fill" is
the curve that the paper's loop converges to (tonemap/histogram.py); "pcond" is Radiance's
program: its loop, its bins, and its linear map where the frame fits the display. Veil, acuity
and colour of the paper are not the operator's: they come before it. Twin of ward97.glsl.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdrusd.errors import HdrusdError, ParameterError
from hdrusd.eye.foveal import Foveal, centre_weights, gaze_weights
from hdrusd.eye.threshold import tvi_ward
from hdrusd.tonemap.curve import Curve, curve, display_range, proportional
from hdrusd.tonemap.histogram import (
    adapted_anchor,
    fill,
    histogram,
    proportionate,
    trimmed,
)
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

_WORDS = {
    "ceiling": ("linear", "human"),
    "method": ("histogram", "linear"),
    "weights": ("uniform", "centre", "gaze"),
    "solver": ("fill", "pcond"),
}


def ward97(rgb: Array, uniforms: Uniforms) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1] by the uniforms of curve.glsl."""
    return curve(rgb, uniforms)


def ward_curve(moment: Moment) -> Curve:
    """The curve for a frame. Raises ParameterError, HdrusdError without a foveal image."""
    params = moment.parameters
    for name, words in _WORDS.items():
        if params[name] not in words:
            raise ParameterError(f"ward97: {name}: {params[name]}; want {' or '.join(words)}")
    foveal = measured("ward97", moment.statistics).foveal
    if foveal is None:
        raise HdrusdError("ward97: statistics without a foveal image; want one")
    low, high, black = _display(moment)
    as_pcond = params["solver"] == "pcond"
    h = histogram(foveal, _weights(foveal, str(params["weights"])), pcond=as_pcond)
    threshold = tvi_ward if params["ceiling"] == "human" else proportionate
    anchor = adapted_anchor(h, low, high, threshold)
    scale = anchor.display / anchor.scene
    if not as_pcond:
        if params["method"] == "linear":
            return proportional(scale, high, black)
        seen = threshold(np.exp(h.centres))
        shown = fill(h, low, high, seen, anchor, display_threshold=threshold)
        return replace(shown, black=black)
    loop = None
    if params["method"] == "histogram" and h.bmax - h.bmin > np.log(high / low):
        loop = trimmed(h, low, high, threshold)
    # Its linear map is relative to the display's white alone.
    return proportional(scale, high) if loop is None else loop


def _display(moment: Moment) -> tuple[float, float, float]:
    """Range in cd/m2 for the curve, and what the display shows for 0."""
    low, high = display_range(moment.screen)
    black = moment.screen.black_level
    white, darkest = moment.parameters["white"], moment.parameters["black"]
    if white is not None:
        high = number("ward97", "white", white, 1e-3, 1e6)
    if darkest is not None:
        low = black = number("ward97", "black", darkest, 1e-6, 1e6)
    if low >= high:
        raise ParameterError(f"ward97: black: {low:g} cd/m2; want less than white, {high:g} cd/m2")
    return low, high, black


def _weights(foveal: Foveal, name: str) -> Array | None:
    size = foveal.rgb.shape[1], foveal.rgb.shape[0]
    if name == "centre":
        return centre_weights(size)
    return gaze_weights(size, foveal.field) if name == "gaze" else None


def _uniforms(moment: Moment) -> Uniforms:
    return ward_curve(moment).uniforms()


def _needs(_: Parameters) -> Need:
    return Need.FOVEAL


OPERATOR = Operator(
    name="ward97",
    title="Histogram adjustment that keeps visibility",
    cite="Ward Larson, Rushmeier, Piatko, IEEE TVCG 3(4), 1997",
    parameters=(
        Parameter(
            "ceiling",
            "linear",
            "",
            "contrast at most as in the scene (linear), or as an eye sees it there (human)",
        ),
        Parameter("method", "histogram", "", "histogram, or linear for one factor for all"),
        Parameter("weights", "uniform", "", "of the picture's samples: uniform, centre or gaze"),
        Parameter("solver", "fill", "", "fill, or pcond for what Radiance's program does"),
        Parameter("white", None, "cd/m2", "of the display; none for the screen's"),
        Parameter("black", None, "cd/m2", "of the display; none for the screen's"),
    ),
    reference=ward97,
    glsl="tonemap/ward97.glsl",
    function="ward97",
    uniforms=_uniforms,
    needs=_needs,
)
