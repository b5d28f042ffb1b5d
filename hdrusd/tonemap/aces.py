"""Two fits to the ACES 1.x output transform for a Rec. 709 screen.

"narkowicz": K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2016, a curve a channel, brighter
than ACES by about 1/0.6. "hill": S. Hill's fit of the RRT and the sRGB ODT with the colour
matrices, 2016. They take exposed RGB (exposure.py). Twin of aces.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.errors import ParameterError
from hdrusd.tonemap.exposure import (
    EXPOSURE_PARAMETERS,
    exposed,
    exposure_advance,
    exposure_needs,
    exposure_trace,
    exposure_uniforms,
)
from hdrusd.tonemap.operator import Array, Moment, Operator, Parameter, Uniforms

#: Linear Rec. 709 to the RRT's saturation-adjusted AP1, and from the ODT's back; a row a channel.
HILL_IN = np.array(
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]]
)
HILL_OUT = np.array(
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
)

_FITS = ("narkowicz", "hill")


def narkowicz(rgb: npt.ArrayLike) -> Array:
    """Exposed RGB (..., 3) to display-linear [0, 1], each channel for itself."""
    x = np.asarray(rgb)
    return np.asarray(np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0))


def hill(rgb: npt.ArrayLike) -> Array:
    """Exposed RGB (..., 3) to display-linear [0, 1]."""
    v = np.asarray(rgb) @ HILL_IN.T
    v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    return np.asarray(np.clip(v @ HILL_OUT.T, 0.0, 1.0))


def aces(rgb: npt.ArrayLike, scale: float, fit: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1]; ``scale`` in 1/(cd/m2), ``fit`` 0 or 1 (hill)."""
    x = exposed(rgb, scale)
    return hill(x) if fit > 0.5 else narkowicz(x)


def _uniforms(moment: Moment) -> dict[str, float]:
    fit = moment.parameters["fit"]
    if fit not in _FITS:
        raise ParameterError(f"aces: fit: {fit}; want {' or '.join(_FITS)}")
    return {"aces_fit": float(_FITS.index(fit)), **exposure_uniforms("aces", moment)}


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return aces(rgb, uniforms["exposure_scale"], uniforms["aces_fit"])


OPERATOR = Operator(
    name="aces",
    title="Fits to the ACES 1.x output transform",
    cite="Narkowicz, ACES Filmic Tone Mapping Curve, 2016; Hill, BakingLab, 2016",
    parameters=(Parameter("fit", "hill", "", "narkowicz or hill"), *EXPOSURE_PARAMETERS),
    reference=_reference,
    glsl="tonemap/aces.glsl",
    function="aces",
    uniforms=_uniforms,
    needs=exposure_needs,
    advance=exposure_advance,
    trace=exposure_trace,
)
