"""Texts of decimal numbers to float64, in bulk and correctly rounded.

NumPy reads a whole number out of text in a quarter of the time of one with a point. So points
are taken out, and each whole number is divided by its power of ten: below 2^53, and up to 10^22,
both are float64 without a rounding, and their quotient or product is then the number nearest to
the text (W. D. Clinger, How to read floating point numbers accurately, PLDI 1990). The few words
of more digits are read one by one.
"""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]
_Longs = npt.NDArray[np.int64]

#: NumPy before 2.4 warns of what is no number where later ones raise.
_WARNS = np.lib.NumpyVersion(np.__version__) < "2.4.0"
#: Bytes that are read at a time: what comes of them stays in the processor's cache.
_BLOCK = 1 << 18
#: Below it, bytes, NumPy's own reader is done before this one has begun.
_SHORT = 1 << 10

_BLANK = 32  # this and every control byte below it separate words
_ANY_BLANK = re.compile(rb"[\0-\x20]")
_PLUS, _MINUS, _POINT, _EXPONENT = b"+-.e"
#: A mantissa and its exponent become two whole numbers.
_APART = bytes.maketrans(b"eE", b"  ")

_EXACT = 1 << 53
_POWERS = 10.0 ** np.arange(23)
#: An exponent beyond it is not computed with.
_LARGEST_EXPONENT = 1 << 10
#: Blanks that stand between two numbers as programs write them.
_MOST_BLANKS = 16
#: Of so many words one may be read by itself; with more of them NumPy's reader is as quick.
_WORDS_A_HARD_ONE = 8


def decimals(text: bytes) -> Doubles | None:
    """All words of ``text``, separated by blanks, as numbers; None if one of them is none."""
    if len(text) < _SHORT:
        return _numpys(text, np.float64)
    parts = []
    start = 0
    while start < len(text):
        match = _ANY_BLANK.search(text, start + _BLOCK)
        end = match.end() if match else len(text)
        piece = text[start:end]
        values = _quick(b" " + piece + b" 0 ")  # NumPy takes a sign alone for 0 at the very end
        if values is None:
            return _numpys(text, np.float64)
        parts.append(values[:-1])
        start = end
    return np.concatenate(parts)


def wholes(text: bytes) -> _Longs | None:
    """Likewise as whole numbers; what 64 bits do not hold is the nearest that they do."""
    return _numpys(text, np.int64)


def _numpys(text: bytes, kind: type[np.int64] | type[np.float64]) -> npt.NDArray[Any] | None:
    if not text or text.isspace():
        return np.zeros(0, kind)
    try:
        if not _WARNS:
            return np.fromstring(text, kind, sep=" ")
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)
            return np.fromstring(text, kind, sep=" ")
    except (ValueError, DeprecationWarning):
        return None


def _quick(text: bytes) -> Doubles | None:
    """The numbers of a text between blanks; None where another way must be tried."""
    whole = wholes(text.translate(_APART, b"."))
    if whole is None:
        return None
    data = np.frombuffer(text, np.uint8)
    blank = data <= _BLANK
    stop = np.zeros(len(data), bool)
    np.greater(blank[1:], blank[:-1], out=stop[1:])
    powers = b"e" in text or b"E" in text
    if powers:
        stop |= (data | 32) == _EXPONENT
    stops = np.flatnonzero(stop)  # behind each number of ``whole``
    points = np.flatnonzero(data == _POINT)
    owner = _owners(points, stops)
    follow = data[points + 1]
    signs = (follow == _PLUS) | (follow == _MINUS)  # ".-5" has become -5
    if len(stops) != len(whole) or (owner[1:] == owner[:-1]).any() or signs.any():
        return None
    places = np.zeros(len(whole), np.int64)  # digits behind the point
    places[owner] = stops[owner] - points - 1
    values = _signed(whole, data, stops)
    if values is None:
        return None
    if not powers:
        hard = _scale(values, places)
        return _with_hard(values, hard, text, blank) if hard.any() else values
    exponent = np.flatnonzero(data[stops] > _BLANK) + 1
    pointed = np.zeros(len(whole), bool)
    pointed[owner] = True
    if (data[stops[exponent]] > _BLANK).any() or pointed[exponent].any():
        return None
    places[exponent - 1] -= np.clip(whole[exponent], -_LARGEST_EXPONENT, _LARGEST_EXPONENT)
    mantissa = np.ones(len(whole), bool)
    mantissa[exponent] = False
    values, places = values[mantissa], places[mantissa]
    hard = _scale(values, places)
    return _with_hard(values, hard, text, blank) if hard.any() else values


def _owners(points: _Longs, stops: _Longs) -> _Longs:
    """Of each point the number that it stands in, by the ends of numbers."""
    if len(points) == len(stops) and (points < stops).all() and (points[1:] > stops[:-1]).all():
        return np.arange(len(points))
    return np.searchsorted(stops, points)


def _signed(whole: _Longs, data: npt.NDArray[np.uint8], stops: _Longs) -> Doubles | None:
    """``whole``, whose last digits stand before ``stops``, with the sign of "-0.0".

    None where more blanks stand before a zero than are looked through.
    """
    values = whole.astype(np.float64)
    zeros = np.flatnonzero(whole == 0)
    begin = np.where(zeros, stops[zeros - 1], 0)
    for _ in range(_MOST_BLANKS):
        blank = data[begin] <= _BLANK
        if not blank.any():
            values[zeros[data[begin] == _MINUS]] = -0.0
            return values
        begin += blank
    return None


def _scale(values: Doubles, places: _Longs) -> npt.NDArray[np.bool_]:
    """Divide by 10^``places`` in place; returns where that is not exact."""
    hard: npt.NDArray[np.bool_] = np.abs(values) >= _EXACT
    least, most = int(places.min(initial=0)), int(places.max(initial=0))
    limit = len(_POWERS) - 1
    if least < -limit or most > limit:
        hard |= np.abs(places) > limit
        places = np.where(hard, 0, places)
    if least < 0:
        values *= _POWERS[np.maximum(-places, 0)]
        places = np.maximum(places, 0)
    values /= _POWERS[places]
    return hard


def _with_hard(
    values: Doubles, hard: npt.NDArray[np.bool_], text: bytes, blank: npt.NDArray[np.bool_]
) -> Doubles | None:
    """With the words that are ``hard`` read by themselves; None if they are many."""
    numbers = np.flatnonzero(hard)
    if len(numbers) * _WORDS_A_HARD_ONE > len(values):
        return None
    begin = np.flatnonzero(blank[:-1] > blank[1:]) + 1
    for number, start in zip(numbers.tolist(), begin[numbers].tolist(), strict=True):
        match = _ANY_BLANK.search(text, start)
        assert match is not None  # the last byte is a blank
        values[number] = float(text[start : match.start()])
    return values
