"""AgX, the base look, by a polynomial for its curve.

T. Sobotka, AgX, 2022, as in Blender; matrices and the curve's 7th-order fit after B. Wrensch
and Google's Filament. It takes exposed RGB (exposure.py), works in Rec. 2020, and its white is
0.961. Twin of agx.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.colour import from_rec2020, to_rec2020
from hdrusd.tonemap.exposure import (
    EXPOSURE_PARAMETERS,
    exposed,
    exposure_advance,
    exposure_needs,
    exposure_trace,
    exposure_uniforms,
)
from hdrusd.tonemap.operator import Array, Moment, Operator, Uniforms

#: Linear Rec. 2020 to AgX's, and the inverse of the way back; a row a channel.
INSET = np.array(
    [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ]
)
INVERSE_OUTSET = np.array(
    [
        [0.899796955911611, 0.0871996192028351, 0.013003424885555],
        [0.11142098895748, 0.875575586156966, 0.0130034248855548],
        [0.11142098895748, 0.0871996192028349, 0.801379391839686],
    ]
)
_OUTSET = np.linalg.inv(INVERSE_OUTSET)

#: log2 of exposed RGB at the curve's ends.
_DARKEST, _BRIGHTEST = -12.47393, 4.026069

#: The curve's fit, from x^7 down, and where it is least: it rises again toward 0, by 0.002.
_LEAST = 0.0254
_CURVE = (-17.86, 78.01, -126.7, 92.06, -28.72, 4.361, -0.1718, 0.002857)


def agx_curve(v: npt.ArrayLike) -> Array:
    """Exposed values > 0 of AgX's primaries to its code values."""
    x = (np.log2(v) - _DARKEST) / (_BRIGHTEST - _DARKEST)
    return np.asarray(np.polyval(_CURVE, np.clip(x, _LEAST, 1.0)))


def agx_base(rgb: npt.ArrayLike) -> Array:
    """Exposed RGB >= 0 (..., 3) to display-linear [0, 1]."""
    inset = np.maximum(to_rec2020(rgb) @ INSET.T, 1e-10)
    code = np.maximum(agx_curve(inset) @ _OUTSET.T, 0.0)
    return np.clip(from_rec2020(code**2.2), 0.0, 1.0)


def agx(rgb: npt.ArrayLike, scale: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1]; ``scale`` in 1/(cd/m2)."""
    return agx_base(exposed(rgb, scale))


def _uniforms(moment: Moment) -> dict[str, float]:
    return exposure_uniforms("agx", moment)


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return agx(rgb, uniforms["exposure_scale"])


OPERATOR = Operator(
    name="agx",
    title="AgX, base look",
    cite="Sobotka, AgX, 2022; Wrensch, Minimal AgX Implementation, 2023",
    parameters=EXPOSURE_PARAMETERS,
    reference=_reference,
    glsl="tonemap/agx.glsl",
    function="agx",
    uniforms=_uniforms,
    needs=exposure_needs,
    advance=exposure_advance,
    trace=exposure_trace,
)
