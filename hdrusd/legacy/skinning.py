"""Influences of joints as files have them, made into what can be summed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import Floats, Ints

#: Influences of one point that are kept, the strongest; exporters write 4 or 8.
MOST_INFLUENCES = 16


@dataclass(frozen=True, slots=True)
class Influences:
    """(n, k) indices and weights, the strongest first, weights of sum 1."""

    indices: Ints
    weights: Floats
    broken: int  # influences of a joint that is not there, negative or not finite: left out
    free: int  # points that no joint held: on joint 0 now


def influences(
    indices: npt.NDArray[np.integer], weights: npt.NDArray[np.floating], joints: int
) -> Influences:
    """Check (n, k) influences against the number of joints, at least 1, and normalise them."""
    index = np.asarray(indices, np.int64)
    share = np.array(weights, np.float64)
    with np.errstate(invalid="ignore"):
        bad = ~((share >= 0.0) & (share <= np.finfo(np.float32).max))
    bad |= ((index < 0) | (index >= joints)) & (share != 0.0)
    share[bad] = 0.0
    index = np.where(share > 0.0, index, 0)
    order = np.argsort(-share, axis=1, kind="stable")[:, :MOST_INFLUENCES]
    index, share = np.take_along_axis(index, order, 1), np.take_along_axis(share, order, 1)
    used = max(int((share > 0.0).any(axis=0).sum()), 1)
    if share.shape[1] == 0:
        index, share = np.zeros((len(share), 1), np.int64), np.zeros((len(share), 1))
    index, share = index[:, :used], share[:, :used]
    total = share.sum(axis=1)
    free = total == 0.0
    share[free, 0] = 1.0
    share /= np.where(free, 1.0, total)[:, None]
    return Influences(
        np.ascontiguousarray(index, np.int32),
        np.ascontiguousarray(share, np.float32),
        int(bad.sum()),
        int(free.sum()),
    )
