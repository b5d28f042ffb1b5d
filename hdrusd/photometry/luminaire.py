"""What a photometric file says of a luminaire: candela over directions, in the file's own grid.

Angles are degrees, as in the files. Type C (LM-63, and all EULUMDAT): planes C about the
luminaire's vertical axis, in each gamma from 0 (down) to 180 (up). Types A and B (LM-63):
H to the right and V upwards of the aim as seen from behind, with the vertical axis common
to all planes of H (A) or the horizontal one to all planes of V (B); a row is one H.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.report import Kind, Report

Doubles = npt.NDArray[np.float64]
Type = Literal["A", "B", "C"]

#: Where a number is said: of "planes", "angles" or "candela" (row by row), and its index.
At = Callable[[str, int], SourceRef]

#: Bytes of a file that are read: 721 x 1441 values of eight characters take 9 MB.
MOST_BYTES = 16 << 20

#: Planes or angles of a file, and candela.
MOST_ANGLES = 4096
MOST_VALUES = 1 << 21

#: cd; more is no lamp, and times a multiplier would leave 32-bit floats.
BRIGHTEST = 1e12

#: Fewer are no lamp's, and what is a share of them would leave the numbers that there are.
_LEAST_LUMENS = 1e-6

#: Angles this near to the end of a range are meant to be it, degrees.
_NEAR = 0.01

#: Angles nearer to one another than this are not in ascending order, degrees.
_APART = 1e-4

#: Largest |plane| and the span of angles that a type can have, degrees.
_RANGES: dict[Type, tuple[float, float, float]] = {
    "A": (180.0, -90.0, 90.0),
    "B": (90.0, -180.0, 180.0),
    "C": (720.0, 0.0, 180.0),  # a turn may begin anywhere
}


@dataclass(frozen=True, slots=True)
class Opening:
    """The luminous opening, m: along C = 0, along C = 90, and high; 0, 0, 0 is a point."""

    x: float = 0.0
    y: float = 0.0
    height: float = 0.0
    round: bool = False  # a circle or an ellipse, not a rectangle


@dataclass(frozen=True, slots=True, eq=False)
class Luminaire:
    """One photometric file. Made by ``checked``; directions outside ``angles`` are dark."""

    name: str
    type: Type
    planes: Doubles  # (m,) degrees, ascending: C, or H of types A and B
    angles: Doubles  # (n,) degrees, ascending: gamma, or V
    candela: Doubles  # (m, n) cd, with all factors of the file
    lumens: float | None = None  # of its lamps, as stated; None where it is absolute
    opening: Opening = Opening()
    keywords: Mapping[str, str] = field(default_factory=dict)

    def unfolded(self) -> tuple[Doubles, Doubles]:
        """All planes in degrees, (k,), and their candela, (k, n), without symmetries.

        Type C: from 0 to 360, both included. Interpolation between them is that between
        the file's own planes.
        """
        planes, candela = self.planes, self.candela
        if self.type != "C":
            if planes[0] != 0.0:
                return planes, candela
            return np.concatenate([-planes[:0:-1], planes]), _joined(candela[:0:-1], candela)
        ends = planes[0], planes[-1]
        if len(planes) == 1:
            return np.array([0.0, 360.0]), np.repeat(candela, 2, axis=0)
        if ends == (0.0, 90.0):
            planes, candela = _mirrored(planes, candela, 90.0)
            return _mirrored(planes, candela, 180.0)
        if ends == (0.0, 180.0):
            return _mirrored(planes, candela, 180.0)
        if ends == (90.0, 270.0):  # I(C) = I(180 - C) = I(540 - C)
            return _from_zero(*_mirrored(planes, candela, 270.0))
        if ends == (-90.0, 90.0):
            return _from_zero(*_mirrored(planes, candela, 90.0))
        if ends == (0.0, 360.0):
            return planes, candela
        if planes[-1] < planes[0] + 360.0:
            planes, candela = np.append(planes, planes[0] + 360.0), _joined(candela, candela[:1])
        return _from_zero(planes, candela)

    def value(self, plane: npt.ArrayLike, angle: npt.ArrayLike) -> Doubles:
        """Candela in directions (degrees, any shape): linear in the angle, then in the plane."""
        planes, candela = self.unfolded()
        x, y = np.broadcast_arrays(np.asarray(plane, np.float64), np.asarray(angle, np.float64))
        if self.type == "C":
            x = np.mod(x, 360.0)
        inside = (x >= planes[0]) & (x <= planes[-1])
        inside &= (y >= self.angles[0]) & (y <= self.angles[-1])
        i, s = _cell(planes, x)
        j, t = _cell(self.angles, y)
        low = candela[i, j] * (1 - t) + candela[i, j + 1] * t
        high = candela[i + 1, j] * (1 - t) + candela[i + 1, j + 1] * t
        return np.where(inside, low * (1 - s) + high * s, 0.0)

    def flux(self) -> float:
        """Lumens: the integral of ``value`` over the sphere, in closed form."""
        planes, candela = self.unfolded()
        rows, columns = np.radians(planes), np.radians(self.angles)
        if self.type == "C":
            weights = _even(rows), _hats(columns, -np.cos(columns), -np.sin(columns))
        elif self.type == "A":
            weights = _even(rows), _hats(columns, np.sin(columns), -np.cos(columns))
        else:
            weights = _hats(rows, np.sin(rows), -np.cos(rows)), _even(columns)
        return float(weights[0] @ candela @ weights[1])


def checked(
    place: SourceRef,
    report: Report,
    *,
    name: str,
    type: Type,
    planes: Doubles,
    angles: Doubles,
    candela: Doubles,
    factor: float,
    lumens: float | None,
    opening: Opening,
    keywords: Mapping[str, str],
    at: At,
) -> Luminaire:
    """A ``Luminaire`` of what a file says: (m,), (n,) and (m, n). Raises InputError.

    ``factor``: what all candela are multiplied by.
    """
    widest, lowest, highest = _RANGES[type]
    _ascending(at, "planes", "plane angles", planes, -widest, widest)
    _ascending(at, "angles", "angles within a plane", angles, lowest, highest)
    if len(angles) < 2:
        raise InputError(at("angles", 0), "angles within a plane: 1; want 2 or more")
    if not 0.0 < factor < BRIGHTEST:
        raise InputError(place, f"the factors on its candela make {factor:g}; want more than 0")
    largest = float(np.abs(candela).max())
    if largest > BRIGHTEST or largest * factor > BRIGHTEST:
        index = int(np.abs(candela).argmax())
        raise InputError(at("candela", index), f"candela: want at most {BRIGHTEST:g}")
    candela = candela * factor
    negative = candela < 0.0
    if negative.any():
        text = f"{int(negative.sum())} negative values, read as 0"
        first = at("candela", int(negative.argmax()))
        report.add(Kind.CLAMPED, "profile-negative", first, name, text)
        candela = np.where(negative, 0.0, candela)
    planes = _settled(at("planes", 0), type, planes)
    _ascending(at, "planes", "plane angles", planes, -widest, widest)  # its ends have moved
    if lumens is not None and lumens < _LEAST_LUMENS:
        lumens = None
    return Luminaire(name, type, planes, angles, candela, lumens, opening, keywords)


def _ascending(at: At, part: str, what: str, values: Doubles, least: float, most: float) -> None:
    low, high = float(values.min()), float(values.max())
    outside = (values < least - _NEAR) | (values > most + _NEAR)
    if outside.any():
        problem = f"{what}: {low:g} to {high:g}; want {least:g} to {most:g}"
        raise InputError(at(part, int(outside.argmax())), problem)
    falling = np.diff(values) < _APART
    if falling.any():
        index = int(falling.argmax()) + 1
        problem = f"{what}: {values[index]:g} after {values[index - 1]:g}, not in ascending order"
        raise InputError(at(part, index), problem)


def _settled(place: SourceRef, type: Type, planes: Doubles) -> Doubles:
    """The planes with the ends of their symmetry exact; InputError where they have none."""
    planes = planes.copy()
    for end in (0, -1):
        nominal = round(float(planes[end]) / 90.0) * 90.0
        if abs(planes[end] - nominal) <= _NEAR:
            planes[end] = nominal
    if type != "C":
        if len(planes) < 2:
            raise InputError(place, f"1 horizontal angle; type {type} wants 2 or more")
        return planes
    first, last = float(planes[0]), float(planes[-1])
    if len(planes) == 1 or (first, last) in ((0, 90), (0, 180), (90, 270), (-90, 90)):
        return planes
    # All round from any start, the first plane once more at the end or left out there.
    gap = first + 360.0 - last
    if abs(gap) <= _NEAR:
        planes[-1] = first + 360.0
        return planes
    if 0.0 < gap < 180.0 and gap <= float(np.diff(planes).max()) + _NEAR:
        return planes
    raise InputError(
        place,
        f"planes: {first:g} to {last:g} degrees; want 0 alone, 0 to 90, 0 to 180, 90 to 270, "
        "-90 to 90 or a whole turn",
    )


def _joined(first: Doubles, second: Doubles) -> Doubles:
    return np.concatenate([first, second])


def _mirrored(planes: Doubles, candela: Doubles, about: float) -> tuple[Doubles, Doubles]:
    """The planes and beyond the last one, at ``about``, their mirror images."""
    return (
        np.concatenate([planes, 2.0 * about - planes[-2::-1]]),
        _joined(candela, candela[-2::-1]),
    )


def _from_zero(planes: Doubles, candela: Doubles) -> tuple[Doubles, Doubles]:
    """A whole turn of planes, first and last alike, as one from 0 to 360."""
    turned = np.mod(planes[:-1], 360.0)
    turned[np.minimum(turned, 360.0 - turned) < _APART / 4.0] = 0.0
    order = np.argsort(turned)
    turned, candela = turned[order], candela[:-1][order]
    if turned[0] > 0.0:
        share = turned[0] / (turned[0] + 360.0 - turned[-1])
        zero = candela[0] * (1 - share) + candela[-1] * share
        turned, candela = np.insert(turned, 0, 0.0), _joined(zero[None], candela)
    return np.append(turned, 360.0), _joined(candela, candela[:1])


def _cell(nodes: Doubles, x: Doubles) -> tuple[npt.NDArray[np.intp], Doubles]:
    """The interval of ``nodes`` that ``x`` lies in, and where in it, 0 to 1."""
    index = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    share = (x - nodes[index]) / (nodes[index + 1] - nodes[index])
    return index, np.clip(share, 0.0, 1.0)


def _hats(x: Doubles, once: Doubles, twice: Doubles) -> Doubles:
    """(n,) integrals of a weight times each node's hat function.

    ``once``, ``twice``: the weight's first and second antiderivative at the nodes ``x``.
    By parts, a hat rising over an interval of width h gives F(x1) - (G(x1) - G(x0)) / h.
    """
    mean = np.diff(twice) / np.diff(x)
    result = np.zeros_like(x)
    result[1:] += once[1:] - mean
    result[:-1] += mean - once[:-1]
    return result


def _even(x: Doubles) -> Doubles:
    """``_hats`` for a weight of 1."""
    half = np.diff(x) / 2.0
    return np.append(half, 0.0) + np.insert(half, 0, 0.0)


def plain(value: float) -> str:
    """A finite number with all its digits and without an exponent, which old readers lack."""
    text = repr(float(value)).removesuffix(".0")
    return np.format_float_positional(value, trim="-") if "e" in text else text
