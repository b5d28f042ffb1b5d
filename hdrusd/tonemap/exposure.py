"""A photometric camera: EV at ISO 100, saturation-based exposure, clipping at white.

ISO 12232 (saturation-based speed, q = 0.65) and ISO 2720 (meters: K = 12.5, C = 250).
Twin of exposure.glsl.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.tonemap.operator import (
    FLOOR,
    Array,
    Need,
    Operator,
    Parameter,
    Parameters,
    Statistics,
    measured,
    number,
)

#: Reflected-light meter constant K, cd s/(m2 ISO), and incident-light C, lx s/ISO (ISO 2720).
REFLECTED_K = 12.5
INCIDENT_C = 250.0


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


def _scale(stats: Statistics | None, params: Parameters) -> float:
    if params["scale"] is not None:
        return number("exposure", "scale", params["scale"], 0.0, 1e12)
    if params["ev100"] == "auto":
        average = max(measured("exposure", stats).average, FLOOR)
        return 1.0 / saturation_luminance(ev100_from_luminance(average))
    return 1.0 / saturation_luminance(number("exposure", "ev100", params["ev100"], -40.0, 40.0))


def _uniforms(stats: Statistics | None, params: Parameters) -> dict[str, float]:
    return {"exposure_scale": _scale(stats, params)}


def _reference(rgb: Array, stats: Statistics | None, params: Parameters) -> Array:
    return exposure(rgb, _scale(stats, params))


def _needs(params: Parameters) -> Need:
    automatic = params["scale"] is None and params["ev100"] == "auto"
    return Need.AVERAGES if automatic else Need.NOTHING


OPERATOR = Operator(
    name="exposure",
    title="Photometric camera, linear up to saturation",
    cite="ISO 12232:2019 (saturation-based speed), ISO 2720:1974 (meter constants)",
    parameters=(
        Parameter("ev100", "auto", "EV", "exposure value at ISO 100, or auto from the average"),
        Parameter(
            "scale",
            None,
            "1/(cd/m2)",
            "linear scale in place of an exposure value, as a USD camera computes it",
        ),
    ),
    reference=_reference,
    glsl="tonemap/exposure.glsl",
    function="exposure",
    uniforms=_uniforms,
    needs=_needs,
)
