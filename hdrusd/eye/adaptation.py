"""What an eye is adapting to, how far it is, and what it sees until then.

Cones and rods (eye/retina.py) behind one pupil: P. Irawan, J. Ferwerda, S. Marschner, EGSR
2005. What the eye adapts to is not in what could be read of the paper: here it is the mean of
ln luminance over samples of one degree, and the pupil follows at once. Luminance in cd/m2,
that of rods white-relative (eye/scotopic.py), retinal illuminance in td, time in s.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.eye.foveal import Foveal, log_mean
from hdrusd.eye.mesopic import mesopic
from hdrusd.eye.observer import Observer
from hdrusd.eye.pupil import moon_spencer, pupil_area, watson_yellott
from hdrusd.eye.retina import (
    CONE,
    ROD,
    Adaptation,
    advance,
    desensitisation,
    equivalent,
    steady,
    threshold,
)
from hdrusd.eye.scotopic import WHITE_RATIO, scotopic, white_relative

Array = npt.NDArray[Any]


class Goal(NamedTuple):
    """What the eye looks at and will be adapted to."""

    cone: float  # cd/m2
    rod: float  # cd/m2, white-relative
    area: float  # of the pupil, mm2
    share: float  # of the cones at this luminance, 0 to 1: m of CIE 191:2010

    @classmethod
    def of(cls, cone: float, rod: float, observer: Observer, field: tuple[float, float]) -> Goal:
        """Of luminances in cd/m2 over a ``field`` of degrees by degrees."""
        if observer.pupil == "moon-spencer":
            diameter = moon_spencer(cone)
        else:
            diameter = watson_yellott(cone, field[0] * field[1], observer.age)
        share = mesopic(cone, rod * WHITE_RATIO)[1]
        return cls(cone, rod, float(pupil_area(diameter)), float(share))


def goal(foveal: Foveal, observer: Observer, weights: npt.ArrayLike | None = None) -> Goal:
    """The goal that a frame gives; ``weights`` (fh, fw) of its samples."""
    rods = white_relative(scotopic(np.asarray(foveal.rgb, np.float64)))
    return Goal.of(
        log_mean(foveal.luminance, weights), log_mean(rods, weights), observer, foveal.field
    )


class Eye(NamedTuple):
    """How far both kinds of receptors are."""

    cone: Adaptation
    rod: Adaptation


def adapted(to: Goal) -> Eye:
    """The eye that has looked there for long enough."""
    return Eye(steady(CONE, to.cone * to.area), steady(ROD, to.rod * to.area))


def looked(eye: Eye, at: Goal, dt: float, observer: Observer) -> Eye:
    """The eye after ``dt`` seconds, 0 to infinity, of the same light; exact."""
    return Eye(
        advance(CONE, eye.cone, at.cone * at.area, dt, observer.slow),
        advance(ROD, eye.rod, at.rod * at.area, dt, observer.slow),
    )


def rod_loss(eye: Eye, at: Goal, observer: Observer) -> float:
    """Factor by which bleached pigment desensitises rods beyond its photons."""
    if observer.rod_bleach == "photon":
        return 1.0
    return desensitisation(ROD, eye.rod, at.rod * at.area)


def thresholds(
    eye: Eye, at: Goal, luminance: npt.ArrayLike, observer: Observer, exponent: float = 1.0
) -> tuple[Array, Array]:
    """Just seen steps of cones and of rods on ``luminance`` (...), cd/m2, infinity if none.

    The eye sees the smaller of the two. Rods are taken to see white light there: one curve for
    all pixels is one of luminance.
    """
    loss = rod_loss(eye, at, observer)
    cones = threshold(CONE, luminance, eye.cone, at.area, 1.0, exponent)
    return cones, threshold(ROD, luminance, eye.rod, at.area, loss, exponent)


def equivalent_luminance(eye: Eye, at: Goal) -> float:
    """The luminance, cd/m2, to which an eye as insensitive as this one would be adapted.

    Of cones and rods as mesopic vision weighs them: the geometric mean by the goal's share.
    """
    cone, rod = equivalent(CONE, eye.cone), equivalent(ROD, eye.rod)
    return math.exp(at.share * math.log(cone) + (1.0 - at.share) * math.log(rod)) / at.area
