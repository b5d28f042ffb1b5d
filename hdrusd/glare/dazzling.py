"""The lamps that a frame passes on to who veils it: rows of glare/veil.py, not too many.

The most dazzling ones stay as they are. All others become few: a tree is split from the top, always
the node with the largest lux times the square of its extent, until there are as many nodes as rows
are left. A node is a lamp in the middle of its own by lux, with all their lux: none is lost. That
middle has the first order of where they are, so that at theta degrees from a node of R degrees the
veil is off by the order of (R / theta)^2 of the node's. Nearer than R it is that of one lamp in
the middle, where there may be none.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.glare.model import Array
from hdrusd.glare.veil import LAMP

#: Lamps, and pixels that show lamps, that are passed on at most.
MOST_LAMPS, MOST_PIXELS = 128, 512

#: Lamps that stay as they are where there are more than MOST_LAMPS.
ALONE = 64

#: Lamps no farther apart than this (rad, along each axis) are in one place, as float32 has it.
_ONE_PLACE = 2.0**-24


class Dazzling(NamedTuple):
    """Rows (n, 6) in float32's numbers: lamps, then pixels; what was done to have few.

    ``merged`` lamps stand together, each at most ``within`` degrees from the row that has its
    lux, and ``pixels`` of those that show lamps are left out: these lamps count twice.
    """

    rows: Array
    merged: int = 0
    within: float = 0.0
    pixels: int = 0


class _Node(NamedTuple):
    """Lamps that stand together. As a heap has it: the first to split, then the first made."""

    urgency: float  # minus lux by the square of the extent; 0: all in one place
    number: int
    row: Array  # (6,)
    extent: float  # rad from the row to its farthest lamp
    lamps: Array  # (6, n)


def most_dazzling(
    lamps: npt.ArrayLike,
    pixels: npt.ArrayLike = (),
    owner: npt.ArrayLike = (),
) -> Dazzling:
    """Of lamps (n, 6) and of pixels (m, 6) that show them what a frame passes on.

    ``owner`` (m,): the lamp of each pixel, or -1. The rows have all lux of the lamps. The order of
    lamps is that of before where all are passed on.
    """
    given = np.asarray(lamps, np.float64).reshape(-1, LAMP)
    shown = np.asarray(pixels, np.float64).reshape(-1, LAMP)
    owners = np.asarray(owner, np.int64).reshape(-1)
    kept, merged, within = given, 0, 0.0
    if len(given) > MOST_LAMPS:
        order = np.argsort(-_weight(given), kind="stable")
        others = given[order[ALONE:]]
        nodes = _together(others, MOST_LAMPS - ALONE)
        kept = np.concatenate([given[order[:ALONE]], [node.row for node in nodes]])
        merged, within = len(others), math.degrees(max(node.extent for node in nodes))
    # Those of the weakest lamps are left out: little counts twice.
    lux = np.append(given[:, 3:].sum(axis=1), 0.0)  # the last one is that of owner -1
    twice = shown[:, 3:].min(axis=1, initial=0.0) * lux[owners]
    most = np.sort(np.argsort(twice, kind="stable")[:MOST_PIXELS])
    rows = np.concatenate([kept, shown[most]]).astype(np.float32).astype(np.float64)
    return Dazzling(rows, merged, within, len(shown) - len(most))


def _weight(lamps: Array) -> Array:
    """(n,) lux by the square of the angle from the line of sight, as veils have it."""
    angle = np.arccos(np.clip(-lamps[:, 2], -1.0, 1.0))
    return np.asarray(lamps[:, 3:].max(axis=1, initial=0.0) / np.maximum(angle, 0.01) ** 2)


def _together(lamps: Array, most: int) -> list[_Node]:
    """Lamps (n, 6) as at most ``most`` nodes, in the order in which they were made."""
    nodes, made = [_node(np.ascontiguousarray(lamps.T), 0)], 1
    while len(nodes) < most and nodes[0].urgency < 0.0:
        whole = heapq.heappop(nodes).lamps
        low, high = whole[:3].min(axis=1), whole[:3].max(axis=1)
        axis = int(np.argmax(high - low))
        # In the middle of the box: one that stands far off is by itself after few splits.
        beyond = whole[axis] > (low[axis] + high[axis]) / 2.0
        for part in (~beyond, beyond):
            heapq.heappush(nodes, _node(whole.take(np.flatnonzero(part), axis=1), made))
            made += 1
    return sorted(nodes, key=lambda node: node.number)


def _node(lamps: Array, number: int) -> _Node:
    """Lamps (6, n) as one, in their middle by lux."""
    ways, lights = lamps[:3], lamps[3:].sum(axis=1)
    each = lamps[3] + lamps[4] + lamps[5]
    middle = np.einsum("ij,j->i", ways, each)
    length, lux = float(np.linalg.norm(middle)), float(lights.sum())
    # All about the eye they have no middle: then it is where the brightest one is.
    way = middle / length if length > 1e-9 * lux else ways[:, int(np.argmax(each))]
    off = ways - way[:, None]
    chord = math.sqrt(np.einsum("ij,ij->j", off, off).max())
    extent = 2.0 * math.asin(min(chord / 2.0, 1.0))
    apart = float(np.ptp(ways, axis=1).max()) > _ONE_PLACE
    urgency = -lux * extent**2 if apart else 0.0
    return _Node(urgency, number, np.concatenate([way, lights]), extent, lamps)
