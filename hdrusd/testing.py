"""What every tone mapping operator must do: for ours, and for authors of plug-ins.

from hdrusd.testing import check_operator
check_operator(MY_OPERATOR)
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, with_luminance
from hdrusd.gpu.context import create_context
from hdrusd.gpu.evaluate import evaluate
from hdrusd.tonemap.operator import Moment, Operator, Parameters, blurred, statistics

#: cd/m2 of the sun's disc, the brightest thing that a scene shows.
SUN = 1.6e9

#: GLSL against NumPy in display-linear light: share of the value, and of white. 1e-4 is for
#: closed formulas with pow, log2 and exp2 in float32, whose precision GLSL 3.30 leaves open;
#: 1e-5 of white is a thirtieth of an 8-bit step in black.
PARITY_RELATIVE, PARITY_ABSOLUTE = 1e-4, 1e-5

#: Code values for a unit of light in black, by sRGB: what PARITY_ABSOLUTE is where an operator's
#: results are code values.
_CODES = 12.92

#: Degrees that the frames are wide and high.
FIELD = (40.0, 25.0)

_CHROMATICITIES = (
    (1.0, 1.0, 1.0),
    (1.0, 0.53, 0.06),  # sodium lamp
    (1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, 0.0, 1.0),
)


def check_operator(operator: Operator, ctx: Any = None, params: Parameters | None = None) -> None:
    """Raise AssertionError unless ``operator`` keeps its promises with these parameters.

    In [0, 1]; no NaN for black and for the sun, in a night scene, in a black frame and
    beside the sun; brighter in, not darker out (``tone_curve``); GLSL like NumPy.
    ``ctx``: the OpenGL context to use; without one, one is made (ContextError).
    """
    ctx = create_context() if ctx is None else ctx
    plain = operator.moment(params)
    operator = operator.built(plain.parameters)
    need = operator.needs(plain.parameters)
    scales = np.concatenate([[0.0], np.geomspace(1e-6, SUN, 400)])
    # (chromaticity, luminance, 3), float32 as a frame has it
    ramp = np.stack(
        [with_luminance(np.tile(c, (scales.size, 1)), scales) for c in _CHROMATICITIES]
    ).astype(np.float32)
    frames: dict[str, npt.NDArray[Any]] = {
        "a night scene": np.geomspace(1e-3, 1e4, 1000).reshape(25, 40, 1) * np.ones(3),
        "the sun in the picture": ramp,
        "a black frame": np.zeros((4, 4, 3)),
        "one luminance": np.full((4, 4, 3), 50.0),
    }
    moments = {
        name: operator.steady(replace(plain, statistics=statistics(pixels, need, FIELD)))
        for name, pixels in frames.items()
    }
    for name, moment in moments.items():
        _check_moment(operator, ctx, ramp, moment, f"{operator.name}, statistics of {name}")
    if operator.advance is None:
        return
    for before, earlier in moments.items():
        for now, moment in moments.items():
            for dt in (0.0, 0.1, 60.0):
                state = operator.advance(earlier.state, moment, dt)
                where = f"{operator.name}, {dt:g} s of {now} after {before}"
                _check_moment(operator, ctx, ramp, replace(moment, state=state), where)
                assert json.loads(json.dumps(state)) == state, f"{where}: state is not JSON's"


def _check_moment(
    operator: Operator, ctx: Any, ramp: npt.NDArray[Any], moment: Moment, where: str
) -> None:
    mapped = operator.apply(ramp, moment=moment)
    _check_range(mapped, ramp.shape, where)
    if operator.tone_curve:
        _check_rising(mapped, where)
    _check_parity(operator, ctx, ramp, mapped.reshape(-1, 3), moment, where)


def _check_range(mapped: npt.NDArray[Any], shape: tuple[int, ...], where: str) -> None:
    assert mapped.shape == shape, f"{where}: shape {mapped.shape}; want {shape}"
    assert np.isfinite(mapped).all(), f"{where}: NaN or infinity"
    low, high = mapped.min(), mapped.max()
    assert 0.0 <= low <= high <= 1.0, f"{where}: {low} to {high}; want [0, 1]"


def _check_rising(mapped: npt.NDArray[Any], where: str) -> None:
    # 1e-6: a dozen roundings of float32.
    falls = np.diff(luminance(mapped), axis=-1) < -1e-6
    assert not falls.any(), f"{where}: {falls.sum()} steps of more light in and less out"


def _check_parity(
    operator: Operator,
    ctx: Any,
    frame: npt.NDArray[Any],
    wanted: npt.NDArray[Any],
    moment: Moment,
    where: str,
) -> None:
    pixels = frame.reshape(-1, 3)
    arrays, call, defines = {"rgb": pixels}, "rgb", {}
    if operator.blurs is not None:
        around = blurred(frame, operator.blurs(moment.parameters)).reshape(len(pixels), -1)
        count = around.shape[1]
        defines = {"BLURS": count}
        arrays |= {f"around_{i}": around[:, i] for i in range(count)}
        call += f", float[BLURS]({', '.join(list(arrays)[1:])})"
    got = evaluate(
        ctx,
        operator.glsl,
        f"{operator.function}({call})",
        arrays,
        "vec3",
        uniforms=operator.uniforms(moment),
        defines=defines,
    )
    absolute = PARITY_ABSOLUTE * (_CODES if operator.encoded else 1.0)
    wrong = ~(np.abs(got - wanted) <= PARITY_RELATIVE * np.abs(wanted) + absolute)
    if wrong.any():
        row = int(wrong.any(axis=1).argmax())
        raise AssertionError(
            f"{where}: {operator.glsl} gives {got[row]} for {pixels[row]} cd/m2, "
            f"NumPy {wanted[row]}; {wrong.any(axis=1).sum()} of {len(pixels)} differ"
        )
