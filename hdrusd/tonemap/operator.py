"""What a tone mapping operator is, and what of a frame it may ask for beside the pixels."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntFlag
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import clean, luminance
from hdrusd.errors import HdrusdError, ParameterError, UnknownNameError
from hdrusd.eye.foveal import VOID, Foveal, default_field, foveal
from hdrusd.eye.observer import Observer
from hdrusd.eye.screen import Screen
from hdrusd.registry import Registry

Array = npt.NDArray[Any]

#: A parameter's value; None and words ("auto") mean what the parameter says.
Value = float | str | None
Parameters = Mapping[str, Value]

#: What the pixels' part of an operator gets: numbers, vectors, and tables as float32 arrays of
#: shape (n,), (h, w) or (h, w, c).
Uniforms = Mapping[str, Any]

#: What an operator remembers from frame to frame: values that JSON has, so that it can be saved.
State = Mapping[str, Any]

#: cd/m2 that a pixel must exceed to be counted: the logarithm of a
#: black pixel would decide the average of the whole frame.
FLOOR = VOID


@dataclass(frozen=True, slots=True)
class Statistics:
    """Luminance of a frame, cd/m2. All but ``average`` are of the pixels above FLOOR.

    A frame without such a pixel has FLOOR everywhere. ``p01`` and ``p99`` are the
    luminances that 1 % and 99 % of the pixels do not exceed, ``foveal`` the frame in samples
    of one degree; None where nobody asked for them. Where nobody asked for anything but
    ``foveal``, the others are estimates from it (``of_foveal``).
    """

    log_average: float
    minimum: float
    maximum: float
    average: float  # arithmetic, over all pixels: what a light meter sees
    p01: float | None = None
    p99: float | None = None
    foveal: Foveal | None = None


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


def statistics(
    rgb: npt.ArrayLike, need: Need | None = None, field: tuple[float, float] | None = None
) -> Statistics:
    """Statistics of an absolute frame (..., 3), cd/m2; the definition of gpu/measure.py.

    ``need``: which (default: averages and percentiles); with FOVEAL the frame is (h, w, 3) and
    ``field`` its width and height in degrees (default: eye.foveal.default_field).
    """
    rgb = clean(np.asarray(rgb, np.float64))
    found = None
    if need is not None and Need.FOVEAL in need:
        found = foveal(rgb, field or default_field(rgb.shape[1], rgb.shape[0]))
        if need == Need.FOVEAL:
            return of_foveal(found)
    return replace(_luminances(luminance(rgb).ravel()), foveal=found)


def of_foveal(found: Foveal) -> Statistics:
    """What a foveal image tells of its whole frame, which is for people to read.

    The average is that of its samples, which may differ by a pixel in size; the others are of
    its single pixels, which are spread evenly at random: some 40,000 in a frame of 60 degrees.
    """
    return replace(
        _luminances(found.points),
        average=float(found.luminance.mean()),
        p01=None,
        p99=None,
        foveal=found,
    )


def _luminances(y: Array) -> Statistics:
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


class Need(IntFlag):
    """Which statistics an operator reads."""

    NOTHING = 0
    AVERAGES = 1  # all but the percentiles
    PERCENTILES = 3  # with the averages
    FOVEAL = 4


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
class Moment:
    """All that an operator knows of a frame beside its pixels.

    ``parameters`` are complete (Operator.settings); ``state`` is what its ``advance`` returned
    for this frame.
    """

    parameters: Parameters
    statistics: Statistics | None = None
    observer: Observer = field(default_factory=Observer)
    screen: Screen = field(default_factory=Screen)
    state: State | None = None


@dataclass(frozen=True, slots=True)
class Operator:
    """A tone mapping operator: NumPy reference and GLSL twin.

    ``uniforms(moment)`` does, in float64, whatever is not done pixel by pixel.
    ``reference(rgb, uniforms)`` maps cleaned scene RGB (..., 3) in cd/m2 to display-linear RGB in
    [0, 1], 0 being the screen's black and 1 its white. The GLSL function ``function``, in the
    file ``glsl`` (from the root of hdrusd, or "package:path"), is ``vec3 f(vec3 rgb)`` and does
    the same with the same uniforms; a table is a sampler2D of n x 1 or w x h texels, to be read
    by texelFetch.

    An operator in time has ``advance(state, moment, dt)``: the state after ``dt`` seconds of this
    frame. It is pure, takes any dt >= 0 (infinity: until nothing changes), composes (a and then
    b seconds of one frame are a + b), and starts at the steady state where ``state`` is None.
    ``trace(moment)`` gives numbers that tell what it did, in units that their names state.

    A local operator has ``blurs(parameters)``: 1-D kernels of odd length, each applied to the
    luminance in both directions, the picture's edge continued. The functions then take their
    results too: ``reference(rgb, uniforms, around)`` as (..., number of blurs),
    ``f(vec3 rgb, float around[BLURS])``.

    An operator whose code depends on its parameters has ``build(parameters)``: the operator to
    take in its place (``built``). The ``glsl`` of that may be the text itself, which has line
    breaks; its first line is its name in messages.
    """

    name: str
    title: str
    cite: str
    parameters: tuple[Parameter, ...]
    reference: Callable[..., Array]
    glsl: str
    function: str
    uniforms: Callable[[Moment], Uniforms]
    needs: Callable[[Parameters], Need] = _nothing
    advance: Callable[[State | None, Moment, float], State] | None = None
    trace: Callable[[Moment], Mapping[str, float]] | None = None
    blurs: Callable[[Parameters], tuple[Array, ...]] | None = None
    build: Callable[[Parameters], Operator] | None = None
    encoded: bool = False  # the results are code values of a screen already
    tone_curve: bool = True  # more luminance never gives less; False for a coding by hue

    def settings(self, given: Parameters | None = None) -> dict[str, Value]:
        """All parameters, defaults filled in. Raises UnknownNameError for a name it has not."""
        known = {parameter.name: parameter.default for parameter in self.parameters}
        for name in given or {}:
            if name not in known:
                raise UnknownNameError(f"{self.name}: parameter", name, known)
        return {**known, **(given or {})}

    def built(self, parameters: Parameters) -> Operator:
        """The operator for these complete parameters. Raises HdrusdError."""
        return self if self.build is None else self.build(parameters)

    def check(self, given: Parameters) -> None:
        """Try parameters on a frame of one luminance. Raises UnknownNameError, ParameterError."""
        moment = self.moment(given)
        self.built(moment.parameters)
        stats = statistics(np.ones((2, 2, 3)), self.needs(moment.parameters))
        self.uniforms(self.steady(replace(moment, statistics=stats)))

    def moment(
        self,
        given: Parameters | None = None,
        stats: Statistics | None = None,
        observer: Observer | None = None,
        screen: Screen | None = None,
    ) -> Moment:
        """A frame with these parameters, defaults filled in. Raises UnknownNameError."""
        return Moment(self.settings(given), stats, observer or Observer(), screen or Screen())

    def steady(self, moment: Moment) -> Moment:
        """``moment`` with the state of an eye that has looked at its frame for long enough."""
        if self.advance is None:
            return moment
        return replace(moment, state=self.advance(None, moment, math.inf))

    def apply(
        self,
        rgb: npt.ArrayLike,
        stats: Statistics | None = None,
        params: Parameters | None = None,
        moment: Moment | None = None,
    ) -> Array:
        """The reference on a frame (..., 3) in cd/m2, cleaned, measured where it has to be.

        With ``moment`` by its parameters, statistics and state; without, by ``stats`` and
        ``params``, fully adapted. A local operator wants (h, w, 3).
        """
        rgb = clean(rgb)
        if moment is None:
            moment = self.moment(params, stats)
            if stats is None and (need := self.needs(moment.parameters)):
                moment = replace(moment, statistics=statistics(rgb, need))
            moment = self.steady(moment)
        operator = self.built(moment.parameters)
        uniforms = operator.uniforms(moment)
        if operator.blurs is None:
            return operator.reference(rgb, uniforms)
        return operator.reference(rgb, uniforms, blurred(rgb, operator.blurs(moment.parameters)))


def blurred(rgb: npt.ArrayLike, kernels: tuple[Array, ...]) -> Array:
    """Luminance of a frame (h, w, 3) under each kernel: (h, w, number of kernels)."""
    y = luminance(np.asarray(rgb, np.float64))
    return np.stack([_separable(y, np.asarray(kernel, np.float64)) for kernel in kernels], axis=-1)


def _separable(y: Array, kernel: Array) -> Array:
    for axis in (1, 0):
        reach = kernel.size // 2
        padded = np.pad(y, [(reach, reach) if axis == a else (0, 0) for a in (0, 1)], mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, kernel.size, axis=axis)
        y = windows @ kernel
    return y


def number(operator: str, name: str, value: Value, low: float, high: float) -> float:
    """A parameter's value as a float in [low, high]; raises ParameterError otherwise."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        result = math.nan
    if not low <= result <= high:
        raise ParameterError(f"{operator}: {name}: {value}; want {low:g} to {high:g}")
    return result


def unbuilt(*_: object) -> Array:
    """The reference of an operator that has one only when it is built."""
    raise HdrusdError("an operator that was not built; want Operator.built")


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
OPERATORS.add("ocio", "hdrusd.tonemap.ocio:OPERATOR")
OPERATORS.add("drago03", "hdrusd.tonemap.drago03:OPERATOR")
OPERATORS.add("ward94", "hdrusd.tonemap.ward94:OPERATOR")
OPERATORS.add("ward97", "hdrusd.tonemap.ward97:OPERATOR")
OPERATORS.add("ferwerda96", "hdrusd.tonemap.ferwerda96:OPERATOR")
OPERATORS.add("pbr_neutral", "hdrusd.tonemap.pbr_neutral:OPERATOR")
OPERATORS.add("aces", "hdrusd.tonemap.aces:OPERATOR")
OPERATORS.add("agx", "hdrusd.tonemap.agx:OPERATOR")
OPERATORS.add("absolute", "hdrusd.tonemap.absolute:OPERATOR")
OPERATORS.add("reinhard02_local", "hdrusd.tonemap.reinhard02_local:OPERATOR")
OPERATORS.add("irawan05", "hdrusd.tonemap.irawan05:OPERATOR")
OPERATORS.add("pattanaik00", "hdrusd.tonemap.pattanaik00:OPERATOR")
