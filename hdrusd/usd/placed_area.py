"""How large faces are in the places of their mesh, whatever these do to it: ``place_kinds``.

Where points (row vectors) are multiplied by M, area vectors are by the matrix of its cofactors,
det(M) M^-T (Nanson's formula), which a flat place has too. Places that differ by a turn, a
reflection or an even scale give the same areas but for a factor: they are of one kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pxr import Gf, Vt

Doubles = npt.NDArray[np.float64]

#: Digits in which the places of one kind agree: turns that are stored in float32 are of one.
_DIGITS = 6

#: Areas of one mesh that are computed at once, and at all: about a second.
_AT_ONCE, _MOST = 1 << 20, 1 << 25


@dataclass(frozen=True, slots=True, eq=False)
class PlaceKinds:
    """Places by what they do to areas: ``cofactors[kind[i]] * factor[i]`` of the i-th, up to a
    turn or a reflection.
    """

    cofactors: Doubles  # (k, 3, 3), what area vectors (row vectors) are multiplied by
    kind: npt.NDArray[np.int64]  # (p,)
    factor: Doubles  # (p,), not negative; 0 of a place without area or beyond float64


@dataclass(frozen=True, slots=True, eq=False)
class PlacedArea:
    """What the places of one mesh, all together, make of its areas."""

    cofactors: Doubles  # (k, 3, 3), one of each kind of place
    factors: Doubles  # (k,), m2 a square unit, of all places of a kind together

    def of(self, faces: Doubles) -> Doubles:
        """m2 (n,) of each face in all places together. ``faces`` (n, 3): normal times area.

        Where that would take very long, of places of every so many kinds for all.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            if len(self.factors) == 1:
                return np.asarray(self.factors[0] * _lengths(faces @ self.cofactors[0]))
            return self._of_several(faces)

    def _of_several(self, faces: Doubles) -> Doubles:
        most = max(_MOST // max(len(faces), 1), 1)
        step = -(-len(self.factors) // most) or 1
        cofactors, factors = self.cofactors[::step], self.factors[::step]
        if step > 1:
            factors = factors * (self.factors.sum() / factors.sum())
        found = np.zeros(len(faces))
        some = max(_AT_ONCE // max(len(faces), 1), 1)
        for first in range(0, len(factors), some):
            areas = _lengths(faces @ cofactors[first : first + some])  # (k, n)
            found += factors[first : first + some] @ areas
        return found


def place_kinds(worlds: Sequence[Gf.Matrix4d], unit: float) -> PlaceKinds:
    """The kinds of places. ``worlds`` (p): local to world; ``unit``: metres of one of the world."""
    if not worlds:
        return PlaceKinds(np.empty((0, 3, 3)), np.empty(0, np.int64), np.empty(0))
    axes = np.array(Vt.Matrix4dArray(list(worlds)))[:, :3, :3]
    with np.errstate(all="ignore"):
        cofactors = _cofactors(axes) * unit**2
        size = np.abs(cofactors).max(axis=(1, 2))
        sound = (size > 0.0) & np.isfinite(size)
        cofactors = np.where(sound[:, None, None], cofactors / size[:, None, None], 0.0)
    # The metric of areas, by which a turn in the world does not show; its largest length is 1.
    metric = cofactors @ cofactors.transpose(0, 2, 1)
    length = np.sqrt(np.diagonal(metric, axis1=1, axis2=2))
    largest = np.where(sound, length.max(axis=1), 1.0)
    cofactors /= largest[:, None, None]
    factor = np.where(sound, size * largest, 0.0)
    first, kind = _alike(metric, length, largest)
    return PlaceKinds(cofactors[first], kind, factor)


def placed_areas(kinds: PlaceKinds, owner: npt.ArrayLike) -> dict[int, PlacedArea]:
    """Of each of the owners of places. ``owner`` (p,): by number, of the i-th place."""
    owner = np.asarray(owner, np.int64)
    count = max(len(kinds.cofactors), 1)
    pairs, at = np.unique(owner * count + kinds.kind, return_inverse=True)
    owners, kind = np.divmod(pairs, count)
    factors = np.asarray(np.bincount(at, kinds.factor, len(pairs)), np.float64)
    names, starts = np.unique(owners, return_index=True)
    ends = [*starts.tolist(), len(pairs)][1:]
    found: dict[int, PlacedArea] = {}
    for name, start, end in zip(names.tolist(), starts.tolist(), ends, strict=True):
        found[name] = PlacedArea(kinds.cofactors[kind[start:end]], factors[start:end])
    return found


def _alike(
    metric: Doubles, length: Doubles, largest: Doubles
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The first place of each kind, and the kind of every place.

    By lengths to so many digits each and the cosines between them, so that of an uneven place the
    small ones count as much.
    """
    with np.errstate(all="ignore"):
        mantissa, power = np.frexp(length / largest[:, None])
        lengths = np.ldexp(np.round(mantissa, _DIGITS), power)
        i, j = np.array([0, 0, 1]), np.array([1, 2, 2])
        product = length[:, i] * length[:, j]
        cosines = np.where(product > 0.0, metric[:, i, j] / product, 0.0)
    keys = np.column_stack([lengths, np.round(cosines, _DIGITS)]) + 0.0  # without -0
    order = np.lexsort(keys.T)
    new = np.ones(len(keys), np.bool_)
    new[1:] = (keys[order[1:]] != keys[order[:-1]]).any(axis=1)
    kind = np.empty(len(keys), np.int64)
    kind[order] = np.cumsum(new) - 1
    return order[new], kind


def _lengths(vectors: Doubles) -> Doubles:
    """(...) of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))


def _cofactors(axes: Doubles) -> Doubles:
    """(p, 3, 3) of the axes (p, 3, 3) of places."""
    x, y, z = np.moveaxis(axes, 1, 0)
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1)
