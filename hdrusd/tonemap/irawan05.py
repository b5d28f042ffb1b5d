"""Irawan, Ferwerda, Marschner 2005: the picture that an eye sees while it adapts.

P. Irawan, J. Ferwerda, S. Marschner, "Perceptually Based Tone Mapping of High Dynamic Range
Image Streams", Eurographics Symposium on Rendering 2005. The histogram adjustment of Ward
Larson, Rushmeier and Piatko 1997 with the thresholds of an observer who is not adapted yet
(eye/adaptation.py): what he does not see gets no contrast on the display. docs/eye.md says
what is not the paper's. Twin of irawan05.glsl.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdrusd.errors import ParameterError
from hdrusd.eye.adaptation import (
    Eye,
    Goal,
    adapted,
    equivalent_luminance,
    goal,
    looked,
    rod_loss,
    thresholds,
)
from hdrusd.eye.foveal import Foveal, centre_weights, gaze_weights
from hdrusd.eye.retina import CONE, ROD, Adaptation, half_saturation
from hdrusd.eye.screen import Screen
from hdrusd.eye.threshold import tvi_ward
from hdrusd.tonemap.curve import Curve, curve, display_range
from hdrusd.tonemap.histogram import Anchor, Histogram, fill, histogram
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
    number,
)

#: ln units that a histogram's range has at least, and share of a jump that nobody sees.
_ONE_LUMINANCE, _FORGOTTEN = 0.02, 1e-9

#: Values of a curve that a state may have.
_MOST_EDGES = 4096


def irawan05(rgb: Array, uniforms: Uniforms) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1] by the uniforms of curve.glsl."""
    return curve(rgb, uniforms)


def anchor(eye: Eye, at: Goal, low: float, high: float) -> Anchor:
    """Where the goal's luminance belongs on a display from ``low`` to ``high`` cd/m2.

    As far above the threshold of a viewer adapted to the middle of that range as it is above
    that of an eye as insensitive as this one (after G. Ward, Graphics Gems IV, 1994). So a
    picture begins black after a bright place, and white after a dark one.
    """
    shown, seen = tvi_ward(np.array([math.sqrt(low * high), equivalent_luminance(eye, at)]))
    return Anchor(at.cone, at.cone * float(shown / seen))


def seen_curve(
    h: Histogram, eye: Eye, at: Goal, moment: Moment, start: Curve | None = None
) -> Curve:
    """The curve for a frame's histogram and an eye that looks at it; ``start`` as in fill."""
    low, high = display_range(moment.screen)
    exponent = number("irawan05", "exponent", moment.parameters["exponent"], 0.7, 1.0)
    both = thresholds(eye, at, np.exp(h.centres), moment.observer, exponent)
    wanted = anchor(eye, at, low, high)
    bright = number("irawan05", "highlights", moment.parameters["highlights"], 0.0, 1.0)
    return fill(h, low, high, np.minimum(*both), wanted, highlights=bright, start=start)


def _frame(moment: Moment) -> tuple[Foveal, Array | None]:
    """The foveal image and the weights of its samples."""
    foveal = measured("irawan05", moment.statistics).foveal
    if foveal is None:
        raise ParameterError("irawan05: statistics without a foveal image; want one")
    size = foveal.rgb.shape[1], foveal.rgb.shape[0]
    match moment.parameters["weights"]:
        case "uniform":
            return foveal, None
        case "centre":
            return foveal, centre_weights(size)
        case "gaze":
            return foveal, gaze_weights(size, foveal.field)
        case other:
            raise ParameterError(f"irawan05: weights: {other}; want uniform, centre or gaze")


def _advance(state: State | None, moment: Moment, dt: float) -> State:
    foveal, weights = _frame(moment)
    smoothing = number("irawan05", "smoothing", moment.parameters["smoothing"], 0.0, 60.0)
    at = goal(foveal, moment.observer, weights)
    h = histogram(foveal, weights)
    if state is None:
        eye = adapted(at)
        return _packed(eye, seen_curve(h, eye, at, moment))
    before, old = _unpacked(state)
    eye = looked(before, at, dt, moment.observer)
    shown = seen_curve(h, eye, at, moment)
    left = math.exp(-dt / smoothing) if smoothing > 0.0 else 0.0
    began = _blank(old.bmin, old.bmax) and not _blank(h.bmin, h.bmax)
    if left > _FORGOTTEN and not began:
        # What the new frame changed at once goes away smoothly; what the eye does is not
        # delayed, so that two steps of one frame are one.
        at_once = seen_curve(h, before, at, moment, start=shown)
        jump = _continued(old, h.edges, moment.screen) - at_once.log_display
        shown = replace(shown, log_display=shown.log_display + left * jump)
    return _packed(eye, shown)


def _blank(bmin: float, bmax: float) -> bool:
    """Whether a histogram of that range is of a frame without a picture to continue."""
    return bmax - bmin < _ONE_LUMINANCE


def _continued(old: Curve, brightness: Array, screen: Screen) -> Array:
    """The old curve's ln display luminance at new edges; beyond its ends as it was shown."""
    edges = np.linspace(old.bmin, old.bmax, old.log_display.size)
    inside = np.interp(brightness, edges, old.log_display)
    beyond = brightness - np.clip(brightness, old.bmin, old.bmax)
    bottom, top = (math.log(y) for y in display_range(screen))
    went = np.clip(inside + beyond, bottom, top)
    # Inside not even the last bit may change, nor may what lies off the display for a while.
    return np.where(beyond == 0.0, inside, went)


def _packed(eye: Eye, shown: Curve) -> State:
    return {
        "cone": list(eye.cone),
        "rod": list(eye.rod),
        "curve_from": [shown.bmin, shown.bmax],
        "curve": [float(value) for value in shown.log_display],
    }


def _unpacked(state: State) -> tuple[Eye, Curve]:
    """The eye and its curve; the latter may lie off the display and fall here and there."""
    try:
        eye = Eye(*(Adaptation(*map(float, state[key])) for key in ("cone", "rod")))
        bmin, bmax = map(float, state["curve_from"])
        log_display = np.array(state["curve"], np.float64)
        light = np.array([[of.fast, of.slow] for of in eye])
        sound = np.isfinite(light).all() and (light >= 0.0).all()
        sound = sound and all(0.0 < of.pigment <= 1.0 for of in eye)
        sound = sound and math.isfinite(bmin) and bmin < bmax < math.inf
        sound = sound and log_display.ndim == 1 and 2 <= log_display.size <= _MOST_EDGES
        sound = sound and np.isfinite(log_display).all()
    except (KeyError, TypeError, ValueError):
        sound = False
    if not sound:
        raise ParameterError("irawan05: state: not an eye; want what an earlier frame left")
    return eye, Curve(bmin, bmax, log_display, 0.0, math.inf)


def _shown(moment: Moment) -> Curve:
    """The curve of a moment as its display has it."""
    state = moment.state if moment.state is not None else _advance(None, moment, math.inf)
    bottom, top = (math.log(y) for y in display_range(moment.screen))
    kept = _unpacked(state)[1]
    return replace(
        kept,
        log_display=np.maximum.accumulate(np.clip(kept.log_display, bottom, top)),
        black=moment.screen.black_level,
        white=moment.screen.white_level,
    )


def _uniforms(moment: Moment) -> Uniforms:
    return _shown(moment).uniforms()


def _trace(moment: Moment) -> Mapping[str, float]:
    foveal, weights = _frame(moment)
    at = goal(foveal, moment.observer, weights)
    eye = adapted(at) if moment.state is None else _unpacked(moment.state)[0]
    exponent = number("irawan05", "exponent", moment.parameters["exponent"], 0.7, 1.0)
    cone, rod = (float(t) for t in thresholds(eye, at, at.cone, moment.observer, exponent))
    low, high = display_range(moment.screen)
    used = float(np.ptp(_shown(moment).log_display)) / math.log(high / low)
    return {
        "goal luminance [cd/m2]": at.cone,
        "goal luminance of rods [cd/m2]": at.rod,
        "equivalent luminance [cd/m2]": equivalent_luminance(eye, at),
        "pupil [mm]": math.sqrt(at.area * 4.0 / math.pi),
        "threshold of cones [cd/m2]": cone,
        "threshold of rods [cd/m2]": rod,
        "threshold [cd/m2]": min(cone, rod),
        "sigma of cones [td]": half_saturation(CONE, eye.cone),
        "sigma of rods [td]": half_saturation(ROD, eye.rod) * rod_loss(eye, at, moment.observer),
        "cone pigment": eye.cone.pigment,
        "rod pigment": eye.rod.pigment,
        "display range used": used,
    }


def _needs(_: Parameters) -> Need:
    return Need.FOVEAL


OPERATOR = Operator(
    name="irawan05",
    title="Histogram adjustment for an eye that adapts in time",
    cite="Irawan, Ferwerda, Marschner, Eurographics Symposium on Rendering 2005",
    parameters=(
        Parameter(
            "weights", "uniform", "", "of the picture for adaptation: uniform, centre or gaze"
        ),
        Parameter(
            "smoothing", 0.2, "s", "in which a change of the picture reaches the curve; 0 for none"
        ),
        Parameter(
            "highlights",
            0.5,
            "",
            "contrast that what is brighter than the eye's adaptation keeps at least, 0 to 1; "
            "with 0 what dazzles is no brighter than what is just told apart",
        ),
        Parameter("exponent", 1.0, "", "of the receptors' response, 0.7 to 1"),
    ),
    reference=irawan05,
    glsl="tonemap/irawan05.glsl",
    function="irawan05",
    uniforms=_uniforms,
    needs=_needs,
    advance=_advance,
    trace=_trace,
)
