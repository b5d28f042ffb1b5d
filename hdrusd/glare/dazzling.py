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
MOST_LAMPS, MOST_PIXELS = 128, 512

#: Lamps that stay as they are where there are more than MOST_LAMPS.
ALONE = 64

#: Degrees of the cells in which others are taken together, the first that is enough. Beyond the
#: last one a halo would stand where no lamp is.
CELLS = (0.125, 0.25, 0.5, 1.0)


class Dazzling(NamedTuple):
    """Rows (n, 6) in float32's numbers: lamps, then pixels; what was done to have few.

    ``merged`` lamps stand together, ``lost`` is the share of all lux that is left out, and
    ``pixels`` of those that show lamps are left out: these lamps count twice.
    """

    rows: Array
    merged: int = 0
    lost: float = 0.0
    pixels: int = 0


def most_dazzling(
    lamps: npt.ArrayLike,
    pixels: npt.ArrayLike = (),
    owner: npt.ArrayLike = (),
) -> Dazzling:
    """Of lamps (n, 6) and of pixels (m, 6) that show them what a frame passes on.

    ``owner`` (m,): the lamp of each pixel, or -1; a pixel whose lamp is left out is as well. The
    order of lamps is that of before where all are passed on.
    """
    given = np.asarray(lamps, np.float64).reshape(-1, LAMP)
    shown = np.asarray(pixels, np.float64).reshape(-1, LAMP)
    owners = np.asarray(owner, np.int64).reshape(-1)
    kept, merged, lost = given, 0, 0.0
    if len(given) > MOST_LAMPS:
        order = np.argsort(-_weight(given), kind="stable")
        others = order[ALONE:]
        merged = len(others)
        for cell in CELLS:
            together, which = _together(given[others], cell)
            if len(together) <= MOST_LAMPS - ALONE:
                break
        best = np.argsort(-_weight(together), kind="stable")[: MOST_LAMPS - ALONE]
        kept = np.concatenate([given[order[:ALONE]], together[best]])
        lost = max(1.0 - float(kept[:, 3:].sum() / max(given[:, 3:].sum(), 1e-300)), 0.0)
        passed = np.ones(len(given), np.bool_)
        passed[others[~np.isin(which, best)]] = False
        shown = shown[(owners < 0) | passed[owners]]
    most = np.sort(np.argsort(shown[:, 3:].min(axis=1, initial=0.0), kind="stable")[:MOST_PIXELS])
    rows = np.concatenate([kept, shown[most]]).astype(np.float32).astype(np.float64)
    return Dazzling(rows, merged, lost, len(shown) - len(most))


def _weight(lamps: Array) -> Array:
    """(n,) lux by the square of the angle from the line of sight, as veils have it."""
    angle = np.arccos(np.clip(-lamps[:, 2], -1.0, 1.0))
    return np.asarray(lamps[:, 3:].max(axis=1, initial=0.0) / np.maximum(angle, 0.01) ** 2)


def _together(lamps: Array, cell: float) -> tuple[Array, npt.NDArray[np.intp]]:
    """Lamps (n, 6) with those in one cell of ``cell`` degrees as one; and (n,) which is whose."""
    across = np.degrees(np.arctan2(lamps[:, 0], -lamps[:, 2]))
    up = np.degrees(np.arcsin(np.clip(lamps[:, 1], -1.0, 1.0)))
    cells = np.floor(np.stack([across, up], axis=1) / cell).astype(np.int64)
    found, which = np.unique(cells, axis=0, return_inverse=True)
    lux = lamps[:, 3:].sum(axis=1, keepdims=True)
    sums = np.zeros((len(found), LAMP))
    np.add.at(sums, which.ravel(), np.concatenate([lamps[:, :3] * lux, lamps[:, 3:]], axis=1))
    sums[:, :3] /= np.linalg.norm(sums[:, :3], axis=1, keepdims=True)
    return sums, which.ravel()
