"""Ferwerda et al. 1996, visual adaptation by thresholds of cones and rods.

J. Ferwerda, S. Pattanaik, P. Shirley, D. Greenberg, "A Model of Visual Adaptation for
Realistic Image Synthesis", SIGGRAPH 1996; with the rods' factor and weight of F. Durand,
J. Dorsey, "Interactive Tone Mapping", EGWR 2000: the screen is seen by cones. The weight
"walraven" is J. Walraven, J. Valeton, "Visual Adaptation and Response Saturation", 1984.
The picture of the rods is grey; it is this operator's own, so night colours before it would
have them twice. Both kinds adapt to the frame's log average (the paper: half its maximum,
which for a night scene is a lamp's); rods see luminance in units in which white has the same
for them and for cones. Twin of ferwerda96.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.errors import ParameterError
from hdrusd.eye.scotopic import scotopic, white_relative
from hdrusd.eye.threshold import tvi_cone, tvi_rod
from hdrusd.tonemap.on_screen import on_screen, screen_uniforms
from hdrusd.tonemap.operator import (
    Array,
    Moment,
    Need,
    Operator,
    Parameter,
    Parameters,
    Uniforms,
    measured,
)


def cone_scale(white: float, adaptation: float) -> float:
    """Luminance of the screen per luminance of the scene, for what cones see.

    ``white`` of the screen, half of which its viewer adapts to, and ``adaptation`` of the
    scene's observer, cd/m2.
    """
    return float(tvi_cone(0.5 * white) / tvi_cone(adaptation))


def rod_scale(white: float, adaptation: float) -> float:
    """As cone_scale, for what rods see: ``adaptation`` is theirs (Durand and Dorsey 2000)."""
    return float(tvi_cone(0.5 * white) / tvi_rod(adaptation))


def durand_weight(adaptation: float) -> float:
    """Share of the rods' picture at an adapting luminance in cd/m2 (Durand and Dorsey 2000)."""
    return min(max(1.0 - (0.5 * adaptation - 0.01) / 9.99, 0.0), 1.0) ** 2


def walraven_weight(adaptation: float) -> float:
    """Share of the rods' picture at an adapting luminance in cd/m2 (Walraven, Valeton 1984)."""
    return max((100.0 - 0.25 * adaptation) / (100.0 + adaptation), 0.0)


_WEIGHTS = {"durand": durand_weight, "walraven": walraven_weight}


def adapted_light(rgb: npt.ArrayLike, rods: npt.ArrayLike, cone: float, rod: float) -> Array:
    """Light that the screen shall show, cd/m2 (..., 3).

    From ``rgb`` in cd/m2 (..., 3) and the luminance ``rods`` (...) that rods see of it;
    ``cone`` is cone_scale, ``rod`` is rod_scale times the rods' weight.
    """
    return cone * np.asarray(rgb) + rod * np.asarray(rods)[..., None]


def ferwerda96(rgb: npt.ArrayLike, cone: float, rod: float, black: float, white: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1].

    ``cone`` and ``rod`` as in adapted_light, ``black`` and ``white`` as in on_screen.
    """
    rods = white_relative(scotopic(rgb))
    return on_screen(adapted_light(rgb, rods, cone, rod), black, white)


def _uniforms(moment: Moment) -> dict[str, float]:
    weight = _WEIGHTS.get(str(moment.parameters["rods"]))
    if weight is None:
        raise ParameterError(
            f"ferwerda96: rods: {moment.parameters['rods']}; want {' or '.join(_WEIGHTS)}"
        )
    average = measured("ferwerda96", moment.statistics).log_average
    white = moment.screen.white_level
    return {
        "ferwerda96_cone": cone_scale(white, average),
        "ferwerda96_rod": rod_scale(white, average) * weight(average),
        **screen_uniforms(moment.screen),
    }


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return ferwerda96(
        rgb,
        uniforms["ferwerda96_cone"],
        uniforms["ferwerda96_rod"],
        uniforms["screen_black"],
        uniforms["screen_white"],
    )


def _needs(_: Parameters) -> Need:
    return Need.AVERAGES


OPERATOR = Operator(
    name="ferwerda96",
    title="Visual adaptation by thresholds of cones and rods",
    cite="Ferwerda, Pattanaik, Shirley, Greenberg, SIGGRAPH 1996; Durand, Dorsey, EGWR 2000",
    parameters=(Parameter("rods", "durand", "", "weight of what rods see: durand or walraven"),),
    reference=_reference,
    glsl="tonemap/ferwerda96.glsl",
    function="ferwerda96",
    uniforms=_uniforms,
    needs=_needs,
)
