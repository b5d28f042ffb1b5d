"""eye/scotopic.glsl against the NumPy functions of the same names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hdrusd.eye
from hdrusd.colour import luminance
from hdrusd.eye import scotopic
from hdrusd.gpu.evaluate import evaluate

FOLDER = Path(hdrusd.eye.__file__).parent
N = 4096
#: One rounding to float32, relative.
R = 2.0**-24

rng = np.random.default_rng(1951)

RGB = (10.0 ** rng.uniform(-6, 4, (N, 1)) * rng.uniform(0, 1, (N, 3))).astype(np.float32)
RGB[:3] = [[0, 0, 0], [1, 1, 1], [0, 0, 1e-3]]
RGB64 = RGB.astype(np.float64)
S_N = (scotopic.white_relative(scotopic.scotopic(RGB64))).astype(np.float32)
Y = luminance(RGB64)


def parts(rgb: np.ndarray, s_n: np.ndarray) -> np.ndarray:
    """What a colour is a mix of: an error is relative to the sum, as shares add up to 1."""
    return np.asarray(rgb + np.asarray(s_n)[:, None] * (1.0 + scotopic.NIGHT_BLUE))


# log2 within 2^-21 near 1 and 3 ulp elsewhere (Vulkan 1.3), times 0.30103, in t by 2.6; the
# slope of the smoothstep is 1.5 at most.
LOG = 1.5 / 2.6 * (0.30103 * 2.0**-21 + 6 * R * np.abs(np.log10(np.maximum(Y, 1e-9))) + 4 * R)
MIX = parts(RGB64, S_N.astype(np.float64))

#: Inputs; the largest absolute difference.
CASES: dict[str, tuple[tuple[np.ndarray, ...], np.ndarray]] = {
    "scotopic": ((RGB,), 5 * R * scotopic.scotopic(RGB64)),
    "white_relative": ((S_N,), 3 * R * S_N.astype(np.float64)),
    # Luminance 5 roundings, the ramp 4, the mix 4.
    "ward_scotopic": ((RGB, S_N), 13 * R * MIX),
    # The ratio by its parts: sums of 5 roundings, two products, a division; and the share.
    "jensen_night": ((RGB, S_N), (24 * R + 4 * LOG[:, None]) * MIX),
    "night_colour": ((RGB, S_N), (24 * R + 4 * LOG[:, None]) * MIX),
}


def functions(name: str) -> dict[str, tuple[str, list[str]]]:
    text = (FOLDER / f"{name}.glsl").read_text(encoding="utf-8")
    found = re.findall(r"^(\w+) (\w+)\(([^)]*)\)\s*\{", text, re.MULTILINE)
    return {
        function: (kind, [p.split()[-1] for p in parameters.split(",")])
        for kind, function, parameters in found
    }


def test_constants_are_those_of_numpy() -> None:
    text = (FOLDER / "scotopic.glsl").read_text(encoding="utf-8")
    for name, wanted in (
        ("SCOTOPIC_WEIGHTS", scotopic.SCOTOPIC_WEIGHTS),
        ("NIGHT_BLUE", scotopic.NIGHT_BLUE),
        ("RGB_SUM", scotopic.RGB_TO_XYZ.sum(axis=0)),
    ):
        match = re.search(rf"const vec3 {name} = vec3\(([^)]*)\)", text)
        assert match is not None
        assert [float(v) for v in match[1].split(",")] == pytest.approx(list(wanted), rel=1e-8)
    for name in ("WHITE_RATIO", "ROD_LIMIT", "CONE_LIMIT", "NIGHT_SUM"):
        match = re.search(rf"\b{name} = ([0-9.e+-]+)[,;]", text)
        assert match is not None
        assert float(match[1]) == pytest.approx(getattr(scotopic, name), rel=1e-12)


def test_every_function_of_night_colour_is_compared() -> None:
    assert functions("scotopic").keys() == CASES.keys()


@pytest.mark.parametrize("function", CASES)
def test_glsl_agrees_with_numpy(gl: Any, function: str) -> None:
    kind, names = functions("scotopic")[function]
    inputs, error = CASES[function]
    shares = {"night_ramp": 1.0, "night_tint": 0.3} if function == "night_colour" else {}
    columns = dict(zip(names, inputs, strict=True))
    got = evaluate(gl, "eye/scotopic.glsl", function, columns, kind, uniforms=shares)
    wanted = getattr(scotopic, function)(*(x.astype(np.float64) for x in inputs))
    over = np.abs(got - wanted) - error
    worst = np.unravel_index(int(np.argmax(over)), over.shape)
    assert over[worst] <= 0.0, (
        f"{[x[worst[0]] for x in inputs]}: GLSL {got[worst]}, NumPy {wanted[worst]}"
    )


@pytest.mark.parametrize("shares", [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5)])
def test_shares_are_those_of_numpy(gl: Any, shares: tuple[float, float]) -> None:
    uniforms = dict(zip(("night_ramp", "night_tint"), shares, strict=True))
    columns = {"rgb": RGB, "s_n": S_N}
    got = evaluate(gl, "eye/scotopic.glsl", "night_colour", columns, "vec3", uniforms=uniforms)
    wanted = scotopic.night_colour(RGB64, S_N.astype(np.float64), *shares)
    assert (np.abs(got - wanted) <= CASES["night_colour"][1]).all()
