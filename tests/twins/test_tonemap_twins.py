"""Every operator, plug-ins included, keeps what hdrusd.testing asks; and that asks enough."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.evaluate import evaluate
from hdrusd.testing import check_operator
from hdrusd.tonemap import falsecolour
from hdrusd.tonemap.operator import OPERATORS

REINHARD = OPERATORS["reinhard02"]

VARIANTS = [
    ("reinhard02", {"white": math.inf}),
    ("reinhard02", {"key": "auto", "white": "auto"}),
    ("reinhard02", {"key": 0.72, "white": 0.5}),
    ("reinhard02", {"key": 1e6, "white": 0.0}),
    ("exposure", {"ev100": -4.0}),
    ("exposure", {"scale": 0.02}),
    ("falsecolour", {"scale": 10.0, "decades": 2.0}),
    ("falsecolour", {"palette": "pm3d", "decades": None}),
    ("falsecolour", {"palette": "hot", "steps": 8.0}),
    ("falsecolour", {"palette": "eco", "steps": 3.0}),
    ("drago03", {"bias": 0.5}),
    ("drago03", {"bias": 1.0}),
    ("ferwerda96", {"rods": "walraven"}),
    ("pbr_neutral", {"ev100": -3.0}),
    ("pbr_neutral", {"scale": 1e12}),
    ("aces", {"fit": "narkowicz", "ev100": -3.0}),
    ("aces", {"fit": "hill", "scale": 1e12}),
    ("agx", {"ev100": 2.0}),
    ("agx", {"scale": 1e12}),
    ("absolute", {"above": "rolloff"}),
    ("absolute", {"above": "rolloff", "source": 1000.0}),
    ("reinhard02_local", {"key": 0.5, "phi": 10.0, "eps": 0.01, "white": 3.0}),
    ("irawan05", {"weights": "gaze", "smoothing": 0.0}),
    ("irawan05", {"weights": "centre", "exponent": 0.7}),
    ("pattanaik00", {"rods": "paper"}),
]


@pytest.mark.parametrize("name", OPERATORS.names())
def test_operator(gl: Any, name: str) -> None:
    if name == "ocio":
        pytest.importorskip("PyOpenColorIO", reason="the extra ocio is not installed")
    check_operator(OPERATORS[name], gl)


@pytest.mark.parametrize(("name", "params"), VARIANTS)
def test_parameters(gl: Any, name: str, params: dict) -> None:
    check_operator(OPERATORS[name], gl, params)


@pytest.mark.parametrize("name", OPERATORS.names())
def test_operator_says_what_it_is(name: str) -> None:
    operator = OPERATORS[name]
    assert operator.name == name
    assert operator.title
    assert operator.cite
    assert all(parameter.meaning for parameter in operator.parameters)


def test_falsecolour_parts(gl: Any) -> None:
    y = np.geomspace(1e-4, 1e6, 500)
    place = evaluate(
        gl,
        "tonemap/falsecolour.glsl",
        "falsecolour_position",
        {"y": y},
        "float",
        uniforms={"falsecolour_scale": 1000.0, "falsecolour_decades": 5.0},
    )
    # log2 errs by 2^-21 of up to 17 octaves; the sum of terms up to 1 by two roundings.
    wanted = falsecolour.falsecolour_position(y, 1000.0, 5.0)
    np.testing.assert_allclose(place, wanted, rtol=0, atol=1e-6)
    v = np.linspace(0.0, 1.0, 500).astype(np.float32)
    code = evaluate(gl, "tonemap/falsecolour.glsl", "falsecolour_palette", {"v": v}, "vec3")
    # A product of up to 8/3 and a sum.
    wanted = falsecolour.falsecolour_palette(v.astype(np.float64))
    np.testing.assert_allclose(code, wanted, rtol=0, atol=8 * 2.0**-24)


BROKEN = {
    "too bright": (lambda rgb, u: REINHARD.reference(rgb, u) * 1.01, r"want \[0, 1\]"),
    "below black": (lambda rgb, u: REINHARD.reference(rgb, u) - 0.01, r"want \[0, 1\]"),
    "NaN": (lambda rgb, u: np.where(rgb > 1e9, np.nan, 0.5), "NaN"),
    "falling": (lambda rgb, u: 1.0 / (1.0 + rgb), "more light in and less out"),
    "not the shader": (lambda rgb, u: REINHARD.reference(rgb, u) ** 1.001, "differ"),
    "one pixel less": (lambda rgb, u: REINHARD.reference(rgb, u)[1:], "shape"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_broken_operator_is_refused(gl: Any, fault: str) -> None:
    reference, message = BROKEN[fault]
    with pytest.raises(AssertionError, match=message):
        check_operator(replace(REINHARD, reference=reference), gl)
