"""Adaptation of cones and rods in time, and the thresholds of an eye that is not adapted yet.

The model of P. Irawan, J. Ferwerda, S. Marschner, "Perceptually Based Tone Mapping of High
Dynamic Range Image Streams", Eurographics Symposium on Rendering 2005: a fast and a slow
neural process and the bleaching of pigment shift the half saturation sigma of a response
R = L^n / (L^n + sigma^n), and a step dR of it is just seen. The paper itself could not be
read. Marked are: (A) found in two independent sources, (B) in one that agrees with memory and
with Weber's law, (O) chosen for this project. docs/eye.md says more.

Retinal illuminance in trolands (td), luminance in cd/m2, time in s. States are scalars;
what is a function of luminance takes any shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.eye.threshold import tvi_cone, tvi_rod

Array = npt.NDArray[Any]

#: Retinal illuminances between which an equivalent adaptation is looked for, td.
_DIMMEST, _BRIGHTEST = 1e-9, 1e9

#: Steps of Ridders' method at most, each at least a halving of ln(1e9 / 1e-9), and the change
#: in ln units at which it ends: the error is less than a hundredth of it by then.
_STEPS, _SMALL = 52, 1e-7

#: Loss of log10 sensitivity for each share of rod pigment that is bleached too much: 1.2 for
#: 10 % (M. Alpern, W. Rushton, S. Torii, J. Physiol. 207, 1970; B).
_DESENSITISATION = 12.0


class Saturation(NamedTuple):
    """log10 of a factor of sigma after I td: a I^m / (I^m + h^m) + o. (B) for all numbers."""

    a: float
    m: float
    h: float  # td
    o: float

    def __call__(self, trolands: float) -> float:
        # By the ratio h/I, which is 0 or infinite without overflow at either end.
        if trolands <= 0.0:
            return self.o
        return self.a / (1.0 + math.pow(self.h / trolands, self.m)) + self.o


@dataclass(frozen=True, slots=True)
class Receptor:
    """One kind of photoreceptor: its numbers, and the threshold ``tvi`` once it is adapted.

    Which of the two neural factors is the fast one is (O), supported by where cones saturate
    on flashed backgrounds. Time constants: S. Pattanaik et al., SIGGRAPH 2000 (A).
    """

    name: str
    fast: Saturation
    slow: Saturation
    half_bleach: float  # td that bleach half the pigment; (B) cones, (O) rods
    pigment_time: float  # s
    fast_time: float  # s
    weber: float  # just seen contrast in daylight
    desensitised: bool  # by more pigment bleached than belongs to the light
    tvi: Callable[[npt.ArrayLike], Array]


CONE = Receptor(
    name="cone",
    fast=Saturation(2.027, 0.6406, 5.859, 0.01711),
    slow=Saturation(1.929, 0.8471, 1048.0, 0.01820),
    half_bleach=1e4,
    pigment_time=110.0,
    fast_time=0.08,
    weber=10.0**-1.255,
    desensitised=False,
    tvi=tvi_cone,
)
ROD = Receptor(
    name="rod",
    fast=Saturation(2.311, 0.3604, 0.008061, -2.749),
    slow=Saturation(1.735, 0.9524, 1.277, 0.005684),
    half_bleach=1e4,
    pigment_time=400.0,
    fast_time=0.15,
    weber=10.0**-0.395,
    desensitised=True,
    tvi=tvi_rod,
)


class Adaptation(NamedTuple):
    """What one kind of receptor remembers of light."""

    fast: float  # td, as the fast neural process has it
    slow: float  # td, as the slow one has it
    pigment: float  # share that is not bleached, 0 to 1


def unbleached(receptor: Receptor, trolands: float) -> float:
    """Share of pigment that stays unbleached in steady light."""
    return receptor.half_bleach / (receptor.half_bleach + trolands)


def steady(receptor: Receptor, trolands: float) -> Adaptation:
    """The state after ``trolands`` for ever."""
    return Adaptation(trolands, trolands, unbleached(receptor, trolands))


def advance(
    receptor: Receptor, state: Adaptation, trolands: float, dt: float, slow_time: float = 10.0
) -> Adaptation:
    """The state after ``dt`` seconds (0 to infinity) of constant light; exact.

    ``slow_time`` is the time constant of the slow neural process, s: 10 s after M. Hayhoe,
    M. Levin, R. Koshel, Vision Research 32, 1992, whose subtractive process is done within
    10 to 15 s (O). Pigment: dp/dt = ((1 - p) - p I / I0) / tau.
    """
    limit = unbleached(receptor, trolands)
    fast_left = math.exp(-dt / receptor.fast_time)
    slow_left = math.exp(-dt / slow_time)
    bleach_left = math.exp(-dt / (receptor.pigment_time * limit))
    return Adaptation(
        trolands + (state.fast - trolands) * fast_left,
        trolands + (state.slow - trolands) * slow_left,
        limit + (state.pigment - limit) * bleach_left,
    )


def half_saturation(receptor: Receptor, state: Adaptation) -> float:
    """Sigma in td: photons lost to bleaching, the slow factor, the fast factor."""
    log = receptor.fast(state.fast) + receptor.slow(state.slow)
    return float(10.0**log / state.pigment)


def desensitisation(receptor: Receptor, state: Adaptation, trolands: float) -> float:
    """Factor on sigma for pigment that is bleached beyond what the present light would (O).

    Dowling and Rushton's law: it is what dark adaptation of half an hour comes from, where
    photon catch alone would lose little. 1 for an adapted eye, and for cones.
    """
    if not receptor.desensitised:
        return 1.0
    excess = max(unbleached(receptor, trolands) - state.pigment, 0.0)
    return float(10.0 ** (_DESENSITISATION * excess))


@lru_cache(maxsize=16)  # a frame asks several times for the same
def equivalent(receptor: Receptor, state: Adaptation) -> float:
    """The steady light, td, that has the same sigma; within 1e-9 to 1e9 td.

    Sigma rises with steady light, so ln I is found by C. Ridders, IEEE Transactions on Circuits
    and Systems 26(11), 1979: some 6 steps, where bisection takes 50.
    """
    wanted = math.log(half_saturation(receptor, state))

    def above(ln: float) -> float:
        return math.log(half_saturation(receptor, steady(receptor, math.exp(ln)))) - wanted

    low, high = math.log(_DIMMEST), math.log(_BRIGHTEST)
    at_low, at_high = above(low), above(high)
    if at_low >= 0.0 or at_high <= 0.0:
        return _DIMMEST if at_low >= 0.0 else _BRIGHTEST
    found = math.inf
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        at_middle = above(middle)
        if at_middle == 0.0:
            return math.exp(middle)
        last = found
        found = middle - (middle - low) * at_middle / math.sqrt(at_middle**2 - at_low * at_high)
        if abs(found - last) < _SMALL:
            break
        at_found = above(found)
        for ln, at in sorted(((middle, at_middle), (found, at_found))):
            if at < 0.0 and ln > low:
                low, at_low = ln, at
            elif at >= 0.0 and ln < high:
                high, at_high = ln, at
    return math.exp(found)


def response(luminance: npt.ArrayLike, sigma: npt.ArrayLike, exponent: float = 1.0) -> Array:
    """Naka and Rushton's response, 0 to 1; both arguments in one unit, of any shape."""
    signal = np.power(np.asarray(luminance, np.float64), exponent)
    return np.asarray(signal / (signal + np.power(sigma, exponent)))


def weber_step(receptor: Receptor, exponent: float = 1.0) -> float:
    """Smallest just seen step of response: Weber's contrast about half saturation (O)."""
    signal = math.pow(1.0 + receptor.weber, exponent)
    return signal / (signal + 1.0) - 0.5


def response_step(
    receptor: Receptor, state: Adaptation, area: float, exponent: float = 1.0
) -> float:
    """Just seen step of response (O): an adapted eye of the same sigma shall see its tvi.

    ``area`` of the pupil in mm2. Not below Weber's step: beyond saturation rods would look
    ever keener.
    """
    trolands = equivalent(receptor, state)
    sigma = half_saturation(receptor, steady(receptor, trolands)) / area
    adapting = trolands / area
    seen = response([adapting, adapting + float(receptor.tvi(adapting))], sigma, exponent)
    return max(float(seen[1] - seen[0]), weber_step(receptor, exponent))


def threshold(
    receptor: Receptor,
    luminance: npt.ArrayLike,
    state: Adaptation,
    area: float,
    desensitised: float = 1.0,
    exponent: float = 1.0,
) -> Array:
    """TVIA: the smallest step seen on ``luminance`` (...) in cd/m2; infinite where saturated.

    ``area`` of the pupil in mm2, ``desensitised`` a factor on sigma. An eye adapted to
    something else never sees more than the adapted one (O).
    """
    luminance = np.asarray(luminance, np.float64)
    sigma = half_saturation(receptor, state) * desensitised / area
    step = response_step(receptor, state, area, exponent)
    raised = response(luminance, sigma, exponent) + step
    seen = raised < 1.0
    odds = np.where(seen, raised, 0.0) / np.where(seen, 1.0 - raised, 1.0)
    found = sigma * odds ** (1.0 / exponent) - luminance
    return np.where(seen, np.maximum(found, receptor.tvi(luminance)), np.inf)
