"""Reinhard et al. 2002, photographic tone reproduction, dodging and burning.

E. Reinhard, M. Stark, P. Shirley, J. Ferwerda, "Photographic Tone Reproduction for Digital
Images", SIGGRAPH 2002, eq. 5 to 9: each pixel is compressed by the average of the largest
surround of about its own luminance. The scale is the first that exceeds the threshold, as in
the authors' program (the paper's words are one scale less). Twin of reinhard02_local.glsl.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, to_gamut
from hdrusd.tonemap.operator import (
    Array,
    Moment,
    Need,
    Operator,
    Parameter,
    Parameters,
    Uniforms,
    number,
)
from hdrusd.tonemap.reinhard02 import adapted_average, advance_average, average_trace

#: Scales, each 1.6 times the one before, beginning with one pixel; the surround of one is the
#: centre of the next.
SCALES, STEP = 8, 1.6

#: A Gaussian exp(-(r / (alpha s))^2) with alpha = 1 / (2 sqrt 2) (eq. 5): its deviation is
#: alpha s / sqrt 2.
_DEVIATION = 0.25


def gaussian_kernel(deviation: float) -> Array:
    """Weights of odd length and sum 1 of a Gaussian, its integral over each pixel.

    ``deviation`` in pixels. Sampled in pixels' centres instead, the smallest, of a quarter
    of a pixel, would be none. Cut at six deviations, where 2e-9 is left.
    """
    reach = max(math.ceil(6.0 * deviation), 1)
    edges = (np.arange(2 * reach + 2) - reach - 0.5) / (deviation * math.sqrt(2.0))
    weights = np.diff([math.erf(edge) for edge in edges])
    return np.asarray(weights / weights.sum())


def surround_kernels() -> tuple[Array, ...]:
    """The kernels of the scales, the narrowest first."""
    return tuple(gaussian_kernel(_DEVIATION * STEP**i) for i in range(SCALES))


def surround(around: npt.ArrayLike, scale: float, sharpness: float, threshold: float) -> Array:
    """Scaled luminance (...) of the surround that a pixel is compressed by (eq. 7 and 8).

    ``around`` (..., SCALES) is blurred luminance in cd/m2, ``scale`` key / log average in
    1/(cd/m2), ``sharpness`` 2^phi key, ``threshold`` the epsilon of eq. 8.
    """
    v = scale * np.asarray(around)
    centre, size = v[..., :-1], STEP ** np.arange(SCALES - 1)
    exceeds = np.abs(centre - v[..., 1:]) > threshold * (sharpness / size**2 + centre)
    first = np.where(exceeds.any(axis=-1), exceeds.argmax(axis=-1), SCALES - 1)
    return np.asarray(np.take_along_axis(v, first[..., None], axis=-1)[..., 0])


def reinhard02_local(
    rgb: npt.ArrayLike,
    around: npt.ArrayLike,
    scale: float,
    sharpness: float,
    threshold: float,
    inverse_white2: float,
) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1], chromaticity kept (eq. 9).

    Arguments as in ``surround``; ``inverse_white2`` is 1 / white^2 of a factor 1 + L / white^2
    that eq. 9 does not have (0: none).
    """
    rgb = np.asarray(rgb)
    y = luminance(rgb)
    gain = (1.0 + scale * y * inverse_white2) * scale
    gain = gain / (1.0 + surround(around, scale, sharpness, threshold))
    return to_gamut(rgb * gain[..., None], y * gain)


def _uniforms(moment: Moment) -> dict[str, float]:
    params = moment.parameters
    key = number("reinhard02_local", "key", params["key"], 1e-6, 1e6)
    phi = number("reinhard02_local", "phi", params["phi"], 0.0, 32.0)
    white = math.inf if params["white"] is None else params["white"]
    white = number("reinhard02_local", "white", white, 1e-6, math.inf)
    return {
        "reinhard02_local_scale": key / adapted_average(moment),
        "reinhard02_local_sharpness": math.exp2(phi) * key,
        "reinhard02_local_threshold": number("reinhard02_local", "eps", params["eps"], 0.0, 1.0),
        "reinhard02_local_inverse_white2": white**-2.0,
    }


def _reference(rgb: Array, uniforms: Uniforms, around: Array) -> Array:
    return reinhard02_local(
        rgb,
        around,
        uniforms["reinhard02_local_scale"],
        uniforms["reinhard02_local_sharpness"],
        uniforms["reinhard02_local_threshold"],
        uniforms["reinhard02_local_inverse_white2"],
    )


def _needs(_: Parameters) -> Need:
    return Need.AVERAGES


def _blurs(_: Parameters) -> tuple[Array, ...]:
    return surround_kernels()


OPERATOR = Operator(
    name="reinhard02_local",
    title="Photographic tone reproduction, dodging and burning",
    cite="Reinhard, Stark, Shirley, Ferwerda, SIGGRAPH 2002",
    parameters=(
        Parameter("key", 0.18, "", "what the log average becomes before compression"),
        Parameter("phi", 8.0, "", "sharpness: more for smaller surrounds at edges"),
        Parameter("eps", 0.05, "", "difference of centre and surround that ends the search"),
        Parameter("white", None, "", "scaled luminance that becomes white, or none"),
    ),
    reference=_reference,
    glsl="tonemap/reinhard02_local.glsl",
    function="reinhard02_local",
    uniforms=_uniforms,
    needs=_needs,
    advance=advance_average,
    trace=average_trace,
    blurs=_blurs,
    tone_curve=False,  # of two pixels with different surrounds the brighter may become darker
)
