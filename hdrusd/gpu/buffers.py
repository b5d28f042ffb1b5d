"""Geometry and its places in the layouts that gbuffer.vert reads."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.scene import Geometry

Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]


def corner_buffer(
    geometry: Geometry, uv_sets: list[str], color: str
) -> tuple[Floats, list[tuple[str, str]]]:
    """Corner attributes side by side, (3 t, .) float32, and (format, attribute) of each part.

    ``uv_sets``: up to four, two to an attribute; one that the geometry has not is 0.
    ``color``: a primvar of it, or "".
    """
    count = len(geometry.points)
    columns: list[Floats] = [geometry.points, geometry.normals]
    content = [("3f", "in_position"), ("3f", "in_normal")]
    blank = np.zeros((count, 2), np.float32)
    uvs = [geometry.uvs.get(name, blank) for name in uv_sets[:4]]
    for first, name in ((0, "in_uv01"), (2, "in_uv23")):
        pair = uvs[first : first + 2]
        if pair:
            columns += [*pair, blank][:2]
            content.append(("4f", name))
    if color:
        columns.append(geometry.colors[color])
        content.append(("3f", "in_color"))
    return np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32), content


def weld(corners: Floats) -> tuple[Floats, Indices]:
    """Equal rows once: (vertices (n, .), indices (3 t,)), so that each is transformed once."""
    first, indices = weld_rows(corners)
    return corners[first], indices


def weld_rows(corners: Floats) -> tuple[Indices, Indices]:
    """Rows of corners (3 t, .) that differ: (first (n,), indices (3 t,)).

    The vertices are ``corners[first]``, and ``corners[first][indices]`` is ``corners``. Rows
    are told apart by a 64-bit hash, and checked: on a collision nothing is welded.
    """
    each = np.arange(len(corners), dtype=np.uint32)
    if not len(each):
        return each, each
    keys = _hashes(corners)
    order = np.argsort(keys)
    keys = keys[order]
    start = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    first = np.minimum.reduceat(order, start)
    # In order of first use: neighbours in the mesh stay neighbours in memory.
    by_use = np.argsort(first)
    rank = np.empty(len(by_use), np.uint32)
    rank[by_use] = np.arange(len(by_use), dtype=np.uint32)
    indices = np.empty(len(order), np.uint32)
    indices[order] = np.repeat(rank, np.diff(start, append=len(order)))
    found = first[by_use].astype(np.uint32), indices
    if is_weld(corners, *found):
        return found
    return each, each


def _hashes(corners: Floats) -> npt.NDArray[np.uint64]:
    """(3 t,) of the bits of each row; column by column, as the rows can be many millions."""
    words = corners.view(np.uint32)
    keys = np.zeros(len(words), np.uint64)
    factors = np.random.default_rng(1).integers(1, 2**63, words.shape[1], np.uint64) * 2 + 1
    for column, factor in zip(words.T, factors, strict=True):
        mixed = column * factor
        keys = (keys ^ mixed ^ (mixed >> np.uint64(29))) * factor
    return keys


def is_weld(corners: Floats, first: Indices, indices: Indices) -> bool:
    """Whether a weld, perhaps of the frame before, holds for these corners."""
    words = corners.view(np.uint32)
    return len(indices) == len(corners) and np.array_equal(words[first][indices], words)


def split(values: npt.NDArray[np.float64]) -> tuple[Floats, Floats]:
    """Doubles as two floats each, the nearest and what it misses: 48 bits together."""
    high = values.astype(np.float32)
    return high, (values - high).astype(np.float32)


def instance_rows(transforms: npt.NDArray[np.float64]) -> Floats:
    """(k, 16) float32 of matrices (k, 4, 4) to world metres (row vectors).

    The three columns with the translation, what float32 loses of that, and the sign of
    the determinant. The shader subtracts the eye, split likewise, so that a stage far from
    its origin keeps its millimetres and the rows stay while the camera moves.
    """
    high, low = split(transforms[:, 3, :3])
    rows = np.empty((len(transforms), 4, 4), np.float32)
    rows[:, :3, :3] = transforms[:, :3, :3].transpose(0, 2, 1)
    rows[:, :3, 3] = high
    rows[:, 3, :3] = low
    rows[:, 3, 3] = np.where(mirrored(transforms), -1.0, 1.0)
    return rows.reshape(-1, 16)


def mirrored(transforms: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """(k,) True where a matrix turns right hands into left ones."""
    # Written out: a general determinant takes longer than the whole draw.
    (a, b, c), (d, e, f), (g, h, i) = transforms[:, :3, :3].transpose(1, 2, 0)
    return np.asarray(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0)
