"""The lamps that a frame passes on to who veils it: rows of glare/veil.py, not too many.

The most dazzling ones stay as they are. Of the others those that are within a cell of CELLS
degrees become one, in their middle by lux: seen from a few cells away that is the same veil. What
is still too much after the largest cells is left out, the least dazzling first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.glare.model import Array
from hdrusd.glare.veil import LAMP

#: Lamps, and pixels that show lamps, that are passed on at most.
MOST_LAMPS, MOST_PIXELS = 128, 256

#: Lamps that stay as they are where there are more than MOST_LAMPS.
ALONE = 64

#: Degrees of the cells in which others are taken together, the first that is enough. Beyond the
#: last one a halo would stand where no lamp is.
CELLS = (0.125, 0.25, 0.5, 1.0)


class Dazzling(NamedTuple):
    """Rows (n, 6) in float32's numbers; lamps that stand together, and the share of lux lost."""

    rows: Array
    merged: int = 0
    lost: float = 0.0


def most_dazzling(rows: npt.ArrayLike) -> Dazzling:
    """Of rows (n, 6) what a frame passes on; the order is that of before where all are."""
    given = np.asarray(rows, np.float64).reshape(-1, LAMP)
    pixels = given[np.any(given[:, 3:] < 0.0, axis=1)]
    lamps = given[np.all(given[:, 3:] >= 0.0, axis=1)]
    kept, merged, lost = lamps, 0, 0.0
    if len(lamps) > MOST_LAMPS:
        order = np.argsort(-_weight(lamps), kind="stable")
        alone, others = lamps[order[:ALONE]], lamps[order[ALONE:]]
        merged = len(others)
        for cell in CELLS:
            together = _together(others, cell)
            if len(together) <= MOST_LAMPS - ALONE:
                break
        best = np.argsort(-_weight(together), kind="stable")[: MOST_LAMPS - ALONE]
        kept = np.concatenate([alone, together[best]])
        lost = 1.0 - float(kept[:, 3:].sum() / max(lamps[:, 3:].sum(), 1e-300))
    most = np.argsort(pixels[:, 3:].min(axis=1, initial=0.0), kind="stable")[:MOST_PIXELS]
    passed = np.concatenate([kept, pixels[np.sort(most)]])
    return Dazzling(passed.astype(np.float32).astype(np.float64), merged, max(lost, 0.0))


def _weight(lamps: Array) -> Array:
    """(n,) lux by the square of the angle from the line of sight, as veils have it."""
    angle = np.arccos(np.clip(-lamps[:, 2], -1.0, 1.0))
    return np.asarray(lamps[:, 3:].max(axis=1, initial=0.0) / np.maximum(angle, 0.01) ** 2)


def _together(lamps: Array, cell: float) -> Array:
    """Lamps (n, 6) with those in one cell of ``cell`` degrees as one."""
    across = np.degrees(np.arctan2(lamps[:, 0], -lamps[:, 2]))
    up = np.degrees(np.arcsin(np.clip(lamps[:, 1], -1.0, 1.0)))
    cells = np.floor(np.stack([across, up], axis=1) / cell).astype(np.int64)
    found, which = np.unique(cells, axis=0, return_inverse=True)
    lux = lamps[:, 3:].sum(axis=1, keepdims=True)
    sums = np.zeros((len(found), LAMP))
    np.add.at(sums, which.ravel(), np.concatenate([lamps[:, :3] * lux, lamps[:, 3:]], axis=1))
    sums[:, :3] /= np.linalg.norm(sums[:, :3], axis=1, keepdims=True)
    return sums
