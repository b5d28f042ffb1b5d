"""A photometric camera: EV at ISO 100, saturation-based exposure, clipping at white.

ISO 12232 (saturation-based speed, q = 0.65) and ISO 2720 (meters: K = 12.5, C = 250).
The operators that take exposed RGB (pbr_neutral, aces, agx, ocio) have its parameters and
its uniform. Twin of exposure.glsl.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hdrusd.tonemap.operator import (
    FLOOR,
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

#: Reflected-light meter constant K, cd s/(m2 ISO), and incident-light C, lx s/ISO (ISO 2720).
REFLECTED_K = 12.5
INCIDENT_C = 250.0

#: Exposed RGB that stands for all above: every curve is at its top, and its square is a float32.
BRIGHTEST_EXPOSED = 1e9


def ev100_from_settings(f_number: float, time: float, iso: float) -> float:
    """EV at ISO 100 of a camera: f-number, exposure time (s), speed (ISO)."""
    return math.log2(f_number * f_number / time * 100.0 / iso)


def ev100_from_luminance(average: float) -> float:
    """EV at ISO 100 that a meter gives for an average luminance (cd/m2)."""
    return math.log2(average * 100.0 / REFLECTED_K)


def ev100_from_illuminance(lux: float) -> float:
    """EV at ISO 100 that an incident-light meter gives (lx)."""
    return math.log2(lux * 100.0 / INCIDENT_C)


def saturation_luminance(ev100: float) -> float:
    """cd/m2 that just become white: 78/(100 q) 2^EV with q = 0.65, so 1.2 x 2^EV."""
    return 1.2 * math.exp2(ev100)


def exposure(rgb: npt.ArrayLike, scale: float) -> Array:
    """cd/m2 (..., 3) to display-linear [0, 1]; ``scale`` in 1/(cd/m2). Channels clip alone."""
    return np.minimum(np.asarray(rgb) * scale, 1.0)


def exposed(rgb: npt.ArrayLike, scale: float) -> Array:
    """cd/m2 (..., 3) to exposed RGB, 1 being a diffuse white; without an end but a float's."""
    return np.minimum(np.asarray(rgb) * scale, BRIGHTEST_EXPOSED)


def exposure_uniforms(operator: str, moment: Moment) -> dict[str, float]:
    """The uniform of exposure.glsl from EXPOSURE_PARAMETERS, for the operator of that name."""
    params = moment.parameters
    if params["scale"] is not None:
        return {"exposure_scale": number(operator, "scale", params["scale"], 0.0, 1e12)}
    if params["ev100"] == "auto":
        if moment.state:
            ev100 = remembered(operator, moment.state, "ev100")
        else:
            ev100 = _metered(operator, moment)
    else:
        ev100 = number(operator, "ev100", params["ev100"], -40.0, 40.0)
    return {"exposure_scale": 1.0 / saturation_luminance(ev100)}


def _metered(operator: str, moment: Moment) -> float:
    return ev100_from_luminance(max(measured(operator, moment.statistics).average, FLOOR))


def exposure_advance(state: State | None, moment: Moment, dt: float) -> State:
    """The exposure value that an automatic camera has after ``dt`` s of a frame.

    Nothing where EXPOSURE_PARAMETERS fix the exposure.
    """
    if not exposure_needs(moment.parameters):
        return {}
    now = _metered("exposure", moment)
    if state:
        now = followed(remembered("exposure", state, "ev100"), now, dt)
    return {"ev100": now}


def exposure_trace(moment: Moment) -> Mapping[str, float]:
    """The exposure value in use and, of an automatic camera, the one it goes to."""
    scale = exposure_uniforms("exposure", moment)["exposure_scale"]
    trace = {"exposure value [EV]": -math.log2(1.2 * scale) if scale > 0.0 else math.inf}
    if exposure_needs(moment.parameters):
        trace["goal exposure value [EV]"] = _metered("exposure", moment)
    return trace


def _uniforms(moment: Moment) -> dict[str, float]:
    return exposure_uniforms("exposure", moment)


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return exposure(rgb, uniforms["exposure_scale"])


def exposure_needs(params: Parameters) -> Need:
    """The averages, where EXPOSURE_PARAMETERS leave the exposure to the frame."""
    automatic = params["scale"] is None and params["ev100"] == "auto"
    return Need.AVERAGES if automatic else Need.NOTHING


EXPOSURE_PARAMETERS = (
    Parameter("ev100", "auto", "EV", "exposure value at ISO 100, or auto from the average"),
    Parameter(
        "scale",
        None,
        "1/(cd/m2)",
        "linear scale in place of an exposure value, as a USD camera computes it",
    ),
)

OPERATOR = Operator(
    name="exposure",
    title="Photometric camera, linear up to saturation",
    cite="ISO 12232:2019 (saturation-based speed), ISO 2720:1974 (meter constants)",
    parameters=EXPOSURE_PARAMETERS,
    reference=_reference,
    glsl="tonemap/exposure.glsl",
    function="exposure",
    uniforms=_uniforms,
    needs=exposure_needs,
    advance=exposure_advance,
    trace=exposure_trace,
)
