"""Reinhard et al. 2002, photographic tone reproduction, the global operator.

E. Reinhard, M. Stark, P. Shirley, J. Ferwerda, "Photographic Tone Reproduction for
Digital Images", SIGGRAPH 2002, eq. 1, 2 and 4; key and white from the frame by
E. Reinhard, "Parameter Estimation for Photographic Tone Reproduction", Journal of
Graphics Tools 7(1), 2003. This is the tone mapping of Petit and Bremond 2010.
Twin of reinhard02.glsl.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, to_gamut
from hdrusd.errors import HdrusdError
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
from hdrusd.tonemap.smoothing import followed, remembered


def reinhard02(rgb: npt.ArrayLike, scale: float, inverse_white2: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1], chromaticity kept (eq. 4).

    ``scale`` is key / log average in 1/(cd/m2); ``inverse_white2`` is 1 / white^2,
    white being the smallest scaled luminance that becomes 1.
    """
    rgb = np.asarray(rgb)
    y = luminance(rgb)
    scaled = scale * y
    # L_d / L: no division by the luminance, so black needs no exception.
    gain = (1.0 + scaled * inverse_white2) * (scale / (1.0 + scaled))
    return to_gamut(rgb * gain[..., None], y * gain)


def automatic_key(log_average: float, low: float, high: float) -> float:
    """Key from how the log average lies between low and high luminance (2003).

    All in cd/m2. A frame of one luminance has the key of an even one, 0.18.
    """
    if high <= low:
        return 0.18
    lo, hi, av = math.log2(low), math.log2(high), math.log2(log_average)
    # With percentiles for low and high, the average of a few lamps in the dark is above high.
    f = min(max((2.0 * av - lo - hi) / (hi - lo), -1.0), 1.0)
    return 0.18 * math.pow(4.0, f)


def automatic_white(low: float, high: float) -> float:
    """Scaled luminance that becomes 1, from the range low to high in cd/m2 (2003)."""
    return 1.5 * math.exp2(math.log2(high) - math.log2(low) - 5.0)


def advance_average(state: State | None, moment: Moment, dt: float) -> State:
    """The log average that the eye of this operator has after ``dt`` s of a frame."""
    now = math.log(measured("reinhard02", moment.statistics).log_average)
    if state is not None:
        now = followed(remembered("reinhard02", state, "ln_average"), now, dt)
    return {"ln_average": now}


def adapted_average(moment: Moment) -> float:
    """The log average, cd/m2, to scale a frame by: its state's, or else its own."""
    if moment.state is None:
        return measured("reinhard02", moment.statistics).log_average
    return math.exp(remembered("reinhard02", moment.state, "ln_average"))


def average_trace(moment: Moment) -> Mapping[str, float]:
    """The log average of a frame, and the one that it is shown by."""
    goal = measured("reinhard02", moment.statistics).log_average
    return {"goal luminance [cd/m2]": goal, "adaptation [cd/m2]": adapted_average(moment)}


def _uniforms(moment: Moment) -> dict[str, float]:
    stats = measured("reinhard02", moment.statistics)
    key, white = moment.parameters["key"], moment.parameters["white"]
    low = high = 0.0
    if "auto" in (key, white):
        if stats.p01 is None or stats.p99 is None:
            raise HdrusdError("reinhard02: auto: statistics without percentiles; want both")
        low, high = stats.p01, stats.p99
    if key == "auto":
        key = automatic_key(stats.log_average, low, high)
    scale = number("reinhard02", "key", key, 1e-6, 1e6) / adapted_average(moment)
    if white == "auto":
        white = automatic_white(low, high)
    elif white is None:
        white = scale * stats.maximum
    # 1e-6: its inverse square times the brightest scaled luminance stays in float32.
    white = max(number("reinhard02", "white", white, 0.0, math.inf), 1e-6)
    return {"reinhard02_scale": scale, "reinhard02_inverse_white2": white**-2.0}


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return reinhard02(rgb, uniforms["reinhard02_scale"], uniforms["reinhard02_inverse_white2"])


def _needs(params: Parameters) -> Need:
    return Need.PERCENTILES if "auto" in (params["key"], params["white"]) else Need.AVERAGES


OPERATOR = Operator(
    name="reinhard02",
    title="Photographic tone reproduction, global",
    cite="Reinhard, Stark, Shirley, Ferwerda, SIGGRAPH 2002; Reinhard, J. Graphics Tools 2003",
    parameters=(
        Parameter("key", 0.18, "", "what the log average becomes before compression, or auto"),
        Parameter(
            "white",
            None,
            "",
            "scaled luminance that becomes white: none for the brightest pixel, inf, or auto",
        ),
    ),
    reference=_reference,
    glsl="tonemap/reinhard02.glsl",
    function="reinhard02",
    uniforms=_uniforms,
    needs=_needs,
    advance=advance_average,
    trace=average_trace,
)
