"""Lamps read once and moved: to all their places in point instancers, and along with cars."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from pxr import Gf, Usd

from hdrusd.report import Report
from hdrusd.scene import CYLINDER, DISK, RECT, light_rows
from hdrusd.usd.instancer import Copies, mixed
from hdrusd.usd.light import read_light_row
from hdrusd.usd.light_controls import light_key

Rows = npt.NDArray[np.void]
Doubles = npt.NDArray[np.float64]

#: How far a matrix may be from a turn and one scale for all directions, relative.
_SIMILAR = 1e-6


def instanced_rows(
    copies: Copies, time: Usd.TimeCode, meters_per_unit: float, report: Report
) -> Rows:
    """(n,) ``scene.LIGHT`` of the copies of a light; what has no row of its own is left out.

    Copies that differ from the first by a turn, a mirror, a place or a scale alike in
    all directions take its row, moved; a strength that follows the size of the lamp
    does so by the power that two readings of different size show. The others are read
    one by one.
    """
    key = np.int64(light_key(copies.source)) + mixed(copies.ids)
    rows: list[Rows] = []
    turns, scales = _turns(copies.transforms[0], copies.transforms)
    alone = scales == 0.0
    if not alone.all():
        moved = _moved(copies, ~alone, turns, scales, time, meters_per_unit, report)
        if moved is None:
            return light_rows(0)
        moved["key"] = key[~alone]
        rows.append(moved)
    for index in np.flatnonzero(alone):
        row = _read(copies.source, copies.transforms[index], time, meters_per_unit, report)
        if row is not None:
            row["key"] = key[index]
            rows.append(row)
    return joined(rows)


def moved_row(row: Rows, before: Doubles, after: Doubles, meters_per_unit: float) -> Rows | None:
    """The row of a lamp, read where it stood ``before``, for where it stands ``after``.

    (4, 4) local to world each. None where not only its place and direction changed: it has
    to be read again.
    """
    turns, scales = _turns(before, after[None])
    if abs(scales[0] - 1.0) > _SIMILAR:
        return None
    return _placed(row, turns, np.ones(1), after[None, 3, :3] * meters_per_unit)


def joined(rows: Sequence[Rows]) -> Rows:
    """Arrays of lights as one, as they lie in memory: to compare their fields takes longer."""
    none = light_rows(0)
    bare = np.dtype((np.void, none.dtype.itemsize))
    parts = [np.ascontiguousarray(part).view(bare) for part in (none, *rows)]
    return np.concatenate(parts).view(none.dtype)


def _moved(
    copies: Copies,
    chosen: npt.NDArray[np.bool_],
    turns: Doubles,
    scales: Doubles,
    time: Usd.TimeCode,
    meters_per_unit: float,
    report: Report,
) -> Rows | None:
    """The first copy's row at the chosen places; None where it has none."""
    base = copies.transforms[0]
    row = _read(copies.source, base, time, meters_per_unit, report)
    if row is None:
        return None
    scales = scales[chosen]
    origins = copies.transforms[chosen, 3, :3] * meters_per_unit
    rows = _placed(row, turns[chosen], scales, origins)
    if row["w"][0] != 0.0 and np.abs(scales - 1.0).max(initial=0.0) > _SIMILAR:
        double = base.copy()
        double[:3, :3] *= 2.0
        larger = _read(copies.source, double, time, meters_per_unit, report)
        if larger is None:
            return None
        one, two = float(row["intensity"].max()), float(larger["intensity"].max())
        power = np.log2(two / one) if one > 0.0 and two > 0.0 else 0.0
        rows["intensity"] *= (scales**power)[:, None]
    return rows


def _turns(first: Doubles, others: Doubles) -> tuple[Doubles, Doubles]:
    """What leads from the first matrix to each of the others, (k, 3, 3), p' = p first turn.

    And the scale (k,) of each: 0 where it is not the same in all directions.
    """
    linear = first[:3, :3]
    if not abs(np.linalg.det(linear)) > 1e-12 * np.abs(linear).max() ** 3:
        return np.zeros((len(others), 3, 3)), np.zeros(len(others))
    turns = np.linalg.inv(linear) @ others[:, :3, :3]
    gram = turns @ turns.transpose(0, 2, 1)
    square = np.trace(gram, axis1=1, axis2=2) / 3.0
    away = np.abs(gram - square[:, None, None] * np.eye(3)).max(axis=(1, 2))
    return turns, np.sqrt(np.where(away <= _SIMILAR * square, square, 0.0))


def _placed(row: Rows, turns: Doubles, scales: Doubles, origins: Doubles) -> Rows:
    """A row turned, scaled and placed k times; its strength stays."""
    rows = np.repeat(row, len(scales))
    for name in ("axis", "x", "y"):
        rows[name] = np.einsum("j,kji->ki", row[name][0], turns)
    units = ["axis"] if row["shape"][0] in (RECT, DISK, CYLINDER) else ["axis", "x", "y"]
    for name in units:
        rows[name] /= scales[:, None]
    if row["w"][0] == 0.0:
        rows["position"] = -rows["axis"]
        return rows
    rows["position"] = origins
    rows["radius"] *= scales
    return rows


def _read(
    prim: Usd.Prim, matrix: Doubles, time: Usd.TimeCode, meters_per_unit: float, report: Report
) -> Rows | None:
    return read_light_row(prim, time, Gf.Matrix4d(matrix), meters_per_unit, report)
