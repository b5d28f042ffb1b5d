"""Candela of a direction from a grid, as shader 1 looks it up; twin of ``profile.glsl``.

A luminaire becomes a ``scene.Profile`` on even angles, and all profiles of a scene become
one atlas: texel (row, column) of a profile, row by row after its offset, holds the four
corners of one cell, so that a direction costs one fetch. Interpolation is exact, linear in
the angle within a plane and then between planes; texture filters keep 8 bits of a share.

Directions are (toward C = 0, toward C = 90, along the axis): the light's +X, +Y and -Z.

    type   plane                         angle
    C      C, from the first to the      gamma, from the axis
           second component
    A      H, from the axis to the       V, toward the second, 90 degrees there
           first
    B      H, toward the first,          V, from the axis to the second
           90 degrees there

Types A and B aim along the axis. LM-63 does not say how they lie in a scene: right is +X and
up is +Y, as a camera would see it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import ParameterError
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.scene import Profile

Array = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

#: Texels in a row of the atlas, a power of 2.
ATLAS_WIDTH = 2048

#: Texels of an atlas, 64 MiB: more than a thousand usual profiles, four of the largest.
MOST_CELLS = 1 << 22

#: Largest grid, planes and angles: a quarter of a degree.
MOST_PLANES, MOST_ANGLES = 1441, 721

#: Where a file's angles have no common step the grid is refined until it differs by less
#: than this share of the largest candela.
RESAMPLED = 1e-3

#: Part of a cell by which a direction may lie outside by rounding.
EDGE = 1e-3

#: Angles of files are whole multiples of this, degrees.
_UNIT = 1e-3

_TYPES = "CAB"  # by their number in the shader


def even_profile(luminaire: Luminaire, source: str = "") -> tuple[Profile, float]:
    """The luminaire on even angles, and the largest difference from it, cd.

    0 where the angles of the file are multiples of a step that the largest grid allows;
    else a bound, the sum of what the two directions of the grid lose.
    """
    planes, candela = luminaire.unfolded()
    peak = float(candela.max())
    candela, columns_lost = _evenly(luminaire.angles, candela, MOST_ANGLES, peak)
    turned, rows_lost = _evenly(planes, candela.T, MOST_PLANES, peak)
    profile = Profile(
        candela=np.ascontiguousarray(turned.T, np.float32),
        planes=(math.radians(planes[0]), math.radians(planes[-1])),
        angles=(math.radians(luminaire.angles[0]), math.radians(luminaire.angles[-1])),
        type=luminaire.type,
        source=source,
    )
    return profile, columns_lost + rows_lost


def _evenly(nodes: Doubles, values: Doubles, most: int, peak: float) -> tuple[Doubles, float]:
    """Values (k, n) at ascending nodes (n,) as values at even ones, and the largest error.

    Both are linear between their nodes, so they differ most at a node of the file.
    """
    units = np.round(np.diff(nodes) / _UNIT).astype(np.int64)
    on_units = bool(np.abs(np.diff(nodes) / _UNIT - units).max() < 1e-6)
    intervals = int(units.sum() // np.gcd.reduce(units)) if on_units else most
    if intervals < most:
        return _interpolated(nodes, values, intervals)[0], 0.0
    tried = len(nodes) - 1  # angles may be even and rounded in the file
    while True:
        tried = min(tried, most - 1)
        result, even = _interpolated(nodes, values, tried)
        back = _at(even, result, nodes)
        lost = float(np.abs(back - values).max())
        if lost <= RESAMPLED * peak or tried == most - 1:
            return result, lost
        tried *= 2


def _interpolated(nodes: Doubles, values: Doubles, intervals: int) -> tuple[Doubles, Doubles]:
    even = np.linspace(nodes[0], nodes[-1], intervals + 1)
    return _at(nodes, values, even), even


def _at(nodes: Doubles, values: Doubles, x: Doubles) -> Doubles:
    """Values (k, n) at ``nodes`` as (k, len(x)), linear in between."""
    index = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    share = np.clip((x - nodes[index]) / (nodes[index + 1] - nodes[index]), 0.0, 1.0)
    return np.asarray(values[:, index] * (1.0 - share) + values[:, index + 1] * share)


def cell_count(candela: Floats) -> int:
    """Texels of the atlas that a grid (m, n) takes."""
    return math.prod(max(size - 1, 1) for size in candela.shape)


def pack_profiles(profiles: Sequence[Profile]) -> tuple[Floats, Floats]:
    """The atlas, (h, ATLAS_WIDTH, 4), and (k, 2, 4) texels that a light keeps of each profile.

    A texel: candela at the cell's (plane, angle), (plane, next angle), (next plane, angle)
    and (next plane, next angle). Of a profile: offset, columns and rows of its cells, number
    of its type (C 0, A 1, B 2); first plane, planes a radian, first angle, angles a radian.
    Profiles that share one array of candela share its cells. Raises ParameterError for more
    than ``MOST_CELLS``.
    """
    grids = {id(profile.candela): profile.candela for profile in profiles}
    ends = np.cumsum([cell_count(candela) for candela in grids.values()], dtype=np.int64)
    used = int(ends[-1]) if len(ends) else 0
    if used > MOST_CELLS:
        raise ParameterError(f"profiles: {used} cells; want at most {MOST_CELLS}")
    atlas = np.zeros((max(math.ceil(used / ATLAS_WIDTH), 1) * ATLAS_WIDTH, 4), np.float32)
    offsets: dict[int, int] = {}
    for (key, candela), end in zip(grids.items(), ends.tolist(), strict=True):
        offsets[key] = end - cell_count(candela)
        atlas[offsets[key] : end] = _cells(candela).reshape(-1, 4)
    placements = np.zeros((len(profiles), 2, 4), np.float32)
    for number, profile in enumerate(profiles):
        rows, columns = (max(size - 1, 1) for size in profile.candela.shape)
        kind = _TYPES.index(profile.type)
        placements[number, 0] = offsets[id(profile.candela)], columns, rows, kind
        placements[number, 1] = (
            profile.planes[0],
            _per_radian(profile.planes, rows),
            profile.angles[0],
            _per_radian(profile.angles, columns),
        )
    return atlas.reshape(-1, ATLAS_WIDTH, 4), placements


def _cells(candela: Floats) -> Floats:
    """(m, n) values as (m - 1, n - 1, 4) corners; a lone row or column stands for two."""
    candela = np.pad(candela, [(0, max(2 - size, 0)) for size in candela.shape], mode="edge")
    corners = candela[:-1, :-1], candela[:-1, 1:], candela[1:, :-1], candela[1:, 1:]
    return np.stack(corners, axis=-1)


def _per_radian(ends: tuple[float, float], intervals: int) -> float:
    """Intervals a radian; 0 where first and last are one."""
    span = ends[1] - ends[0]
    return intervals / span if span > 0.0 else 0.0


def angle_from_sides(y: Array, x: Array) -> Array:
    """The angle in radians of the direction (x, y), from -pi to pi; 0 for (0, 0).

    The shader has it of photometry/arc.glsl.
    """
    return np.asarray(np.arctan2(y, x))


def profile_angles(direction: Array, type: Array) -> Array:
    """(..., 2) plane and angle, rad, of directions (..., 3); ``type``: C 0, A 1, B 2."""
    right, up, ahead = np.moveaxis(np.asarray(direction), -1, 0)
    angles = [
        (angle_from_sides(up, right), angle_from_sides(np.hypot(right, up), ahead)),
        (angle_from_sides(right, ahead), angle_from_sides(up, np.hypot(right, ahead))),
        (angle_from_sides(right, np.hypot(up, ahead)), angle_from_sides(up, ahead)),
    ]
    index = np.broadcast_to(np.asarray(type, np.intp), right.shape)
    return np.stack(
        [np.choose(index, [pair[0] for pair in angles]), np.choose(index, [p[1] for p in angles])],
        axis=-1,
    )


def profile_candela(atlas: Array, place: Array, grid: Array, direction: Array) -> Array:
    """Candela in unit directions (..., 3); ``place`` and ``grid`` (..., 4) as in ``pack_profiles``.

    0 outside the table. A plane of type C counts from the first one, once round.
    """
    angles = profile_angles(direction, place[..., 3])
    plane = angles[..., 0] - grid[..., 0]
    plane = plane - np.where(place[..., 3] == 0, 2 * np.pi * np.floor(plane / (2 * np.pi)), 0.0)
    u = plane * grid[..., 1]
    v = (angles[..., 1] - grid[..., 2]) * grid[..., 3]
    columns, rows = place[..., 1], place[..., 2]
    inside = (u >= -EDGE) & (u <= rows + EDGE) & (v >= -EDGE) & (v <= columns + EDGE)
    row, column = np.clip(np.floor(u), 0, rows - 1), np.clip(np.floor(v), 0, columns - 1)
    s, t = np.clip(u - row, 0.0, 1.0), np.clip(v - column, 0.0, 1.0)
    index = (place[..., 0] + row * columns + column).astype(np.intp)
    corners = np.asarray(atlas)[index // ATLAS_WIDTH, index % ATLAS_WIDTH]
    low = corners[..., 0] * (1 - t) + corners[..., 1] * t
    high = corners[..., 2] * (1 - t) + corners[..., 3] * t
    return np.where(inside, low * (1 - s) + high * s, 0.0)
