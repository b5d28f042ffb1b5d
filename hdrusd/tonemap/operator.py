"""What a tone mapping operator is, and the statistics of a frame that it may ask for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import clean, luminance
from hdrusd.errors import HdrusdError, ParameterError, UnknownNameError
from hdrusd.registry import Registry

Array = npt.NDArray[Any]

#: A parameter's value; None and words ("auto") mean what the parameter says.
Value = float | str | None
Parameters = Mapping[str, Value]

#: cd/m2 that a pixel must exceed to be counted: the logarithm of a
#: black pixel would decide the average of the whole frame.
FLOOR = 1e-5


@dataclass(frozen=True, slots=True)
class Statistics:
    """Luminance of a frame, cd/m2. All but ``average`` are of the pixels above FLOOR.

    A frame without such a pixel has FLOOR everywhere. ``p01`` and ``p99`` are the
    luminances that 1 % and 99 % of the pixels do not exceed; None where nobody
    asked for them.
    """

    log_average: float
    minimum: float
    maximum: float
    average: float  # arithmetic, over all pixels: what a light meter sees
    p01: float | None = None
    p99: float | None = None


def log_average(y: npt.ArrayLike, *, floor: float | None = FLOOR, delta: float = 0.0) -> float:
    """exp(mean(ln(delta + L))) over the luminances above ``floor`` (None: all), cd/m2.

    Reinhard et al. 2002, eq. 1, with 1/N inside the exponential (the paper's print
    has it outside). ``delta`` is what the paper keeps black pixels away with; with
    a floor it is not needed.
    """
    y = np.asarray(y, np.float64)
    counted = y if floor is None else y[y > floor]
    if counted.size == 0:
        return FLOOR
    return math.exp(float(np.log(counted + delta).mean()))


def statistics(rgb: npt.ArrayLike) -> Statistics:
    """Statistics of an absolute frame (..., 3), cd/m2; the definition of gpu/measure.py."""
    y = luminance(clean(np.asarray(rgb, np.float64))).ravel()
    counted = y[y > FLOOR]
    n = counted.size
    if n == 0:
        return Statistics(FLOOR, FLOOR, FLOOR, float(y.sum()) / max(y.size, 1), FLOOR, FLOOR)
    low, high = percentile_rank(n, 1), percentile_rank(n, 99)
    ranked = np.partition(counted, (low, high))
    return Statistics(
        log_average=log_average(counted),
        minimum=float(counted.min()),
        maximum=float(counted.max()),
        average=float(y.mean()),
        p01=float(ranked[low]),
        p99=float(ranked[high]),
    )


def percentile_rank(count: int, percent: int) -> int:
    """Index, in rising order, of the first of ``count`` values that ``percent`` % do not exceed."""
    return max((count * percent + 99) // 100 - 1, 0)


class Need(IntEnum):
    """Which statistics an operator reads, by what they cost."""

    NOTHING = 0
    AVERAGES = 1  # all but the percentiles
    PERCENTILES = 2


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number that the user may set. ``unit`` is "" for a plain ratio."""

    name: str
    default: Value
    unit: str
    meaning: str


def _nothing(_: Parameters) -> Need:
    return Need.NOTHING


@dataclass(frozen=True, slots=True)
class Operator:
    """A tone mapping operator: NumPy reference and GLSL twin.

    ``reference(rgb, stats, params)`` maps cleaned scene RGB (..., 3) in cd/m2 to
    display-linear RGB in [0, 1]. The GLSL function ``function``, in the file
    ``glsl`` (from the root of hdrusd, or "package:path"), is ``vec3 f(vec3 rgb)``
    and does the same with the uniforms that ``uniforms(stats, params)`` gives.
    Both callables get every parameter (``settings``).
    """

    name: str
    title: str
    cite: str
    parameters: tuple[Parameter, ...]
    reference: Callable[[Array, Statistics | None, Parameters], Array]
    glsl: str
    function: str
    uniforms: Callable[[Statistics | None, Parameters], Mapping[str, Any]]
    needs: Callable[[Parameters], Need] = _nothing
    tone_curve: bool = True  # more luminance never gives less; False for a coding by hue

    def settings(self, given: Parameters | None = None) -> dict[str, Value]:
        """All parameters, defaults filled in. Raises UnknownNameError for a name it has not."""
        known = {parameter.name: parameter.default for parameter in self.parameters}
        for name in given or {}:
            if name not in known:
                raise UnknownNameError(f"{self.name}: parameter", name, known)
        return {**known, **(given or {})}

    def check(self, given: Parameters) -> None:
        """Try parameters on a frame of one luminance. Raises UnknownNameError, ParameterError."""
        self.uniforms(Statistics(1.0, 1.0, 1.0, 1.0, 1.0, 1.0), self.settings(given))

    def apply(
        self, rgb: npt.ArrayLike, stats: Statistics | None = None, params: Parameters | None = None
    ) -> Array:
        """The reference on any frame (..., 3) in cd/m2, cleaned, measured where it has to be."""
        rgb = clean(rgb)
        settings = self.settings(params)
        if stats is None and self.needs(settings) > Need.NOTHING:
            stats = statistics(rgb)
        return self.reference(rgb, stats, settings)


def number(operator: str, name: str, value: Value, low: float, high: float) -> float:
    """A parameter's value as a float in [low, high]; raises ParameterError otherwise."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        result = math.nan
    if not low <= result <= high:
        raise ParameterError(f"{operator}: {name}: {value}; want {low:g} to {high:g}")
    return result


def measured(operator: str, stats: Statistics | None) -> Statistics:
    """``stats``, or HdrusdError where an operator needs some and has none."""
    if stats is None:
        raise HdrusdError(f"{operator}: no statistics of the frame; want those it was made with")
    return stats


#: The operator where neither the user nor the stage names one: the paper's.
DEFAULT_OPERATOR = "reinhard02"

OPERATORS: Registry[Operator] = Registry("operator", "hdrusd.tonemap")
OPERATORS.add("reinhard02", "hdrusd.tonemap.reinhard02:OPERATOR")
OPERATORS.add("exposure", "hdrusd.tonemap.exposure:OPERATOR")
OPERATORS.add("falsecolour", "hdrusd.tonemap.falsecolour:OPERATOR")
