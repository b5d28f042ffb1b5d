"""Averages that follow the frames with a delay, as automatic cameras and games have them.

It keeps the picture steady; it is not a model of sight (those are irawan05, pattanaik00).
"""

from __future__ import annotations

import math

from hdrusd.errors import ParameterError
from hdrusd.tonemap.operator import State

#: Time constants, s: the eye of a game is quicker toward light than toward dark.
TOWARD_LIGHT, TOWARD_DARK = 0.4, 0.8


def followed(before: float, now: float, dt: float) -> float:
    """A logarithm of luminance ``dt`` seconds, 0 to infinity, after it was ``before``.

    First order toward ``now``, exact, so that any steps of one frame make one.
    """
    time = TOWARD_LIGHT if now > before else TOWARD_DARK
    return now + (before - now) * math.exp(-dt / time)


def remembered(operator: str, state: State, key: str) -> float:
    """The number that a state holds. Raises ParameterError where it has none that is finite."""
    try:
        value = float(state[key])
    except (KeyError, TypeError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise ParameterError(f"{operator}: state: {key}; want what an earlier frame left")
    return value
