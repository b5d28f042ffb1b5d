"""The parts of pattanaik00.glsl against NumPy; the whole is in test_tonemap_twins.py."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.tonemap.pattanaik00 import (
    Adaptation,
    pattanaik00_response,
    pattanaik00_saturation,
    scene_uniforms,
)

GLSL = "tonemap/pattanaik00.glsl"

STATES = {
    "night": Adaptation(0.01, 0.02, 1.0, 0.7),
    "day": Adaptation(1000.0, 900.0, 0.9995, 4e-5),
    "from day to night": Adaptation(0.01, 500.0, 0.9995, 3e-4),
}


@pytest.mark.parametrize("name", STATES)
def test_parts(gl: Any, name: str) -> None:
    uniforms = scene_uniforms(STATES[name], "hunt", 0.5, 300.0)
    eye = {key: uniforms[key] for key in ("pattanaik00_sigma", "pattanaik00_pigment")}
    display = {**eye, "pattanaik00_display": uniforms["pattanaik00_display"]}
    y = np.geomspace(1e-6, 1e9, 400).astype(np.float32)
    other = y[::-1].copy()
    # pow by log2 and exp2, each to 2^-21 of exponents up to 30, and a dozen roundings.
    tolerance = 3e-5
    got = evaluate(gl, GLSL, "pattanaik00_response", {"y": y, "rods": other}, "float", uniforms=eye)
    wanted = pattanaik00_response(y.astype(np.float64), other.astype(np.float64), uniforms)
    np.testing.assert_allclose(got, wanted, rtol=tolerance)
    shown = np.geomspace(0.5, 300.0, 400).astype(np.float32)
    got = evaluate(
        gl, GLSL, "pattanaik00_saturation", {"y": y, "shown": shown}, "float", uniforms=display
    )
    wanted = pattanaik00_saturation(y.astype(np.float64), shown.astype(np.float64), uniforms)
    np.testing.assert_allclose(got, wanted, rtol=tolerance)
