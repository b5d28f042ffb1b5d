"""Boxes by the thousand: those that meet one, without a look at all of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.intp]

#: Boxes of a class have lengths along the axis within this factor of one another.
_FACTOR = 4.0


class Boxes:
    """Boxes from ``low`` to ``high``, (n, 3) each.

    Along the axis of their greatest spread they are sorted, in classes by their length there: those
    of a class that meet an interval begin in it or at most the class's length before it.
    """

    def __init__(self, low: Floats, high: Floats) -> None:
        self.low, self.high = low, high
        self.axis = int(np.argmax(np.ptp(low, axis=0))) if len(low) else 0
        begin, length = low[:, self.axis], (high - low)[:, self.axis]
        longest = float(length.max(initial=0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = np.log(longest / length) / np.log(_FACTOR) if longest > 0.0 else length
        # Beyond ten classes boxes are thinner than a millionth of the longest.
        classes = np.clip(np.floor(np.nan_to_num(steps)), 0.0, 10.0)
        order = np.lexsort((begin, classes))
        edges = np.flatnonzero(np.diff(classes[order])) + 1
        self._classes = [
            (some, begin[some], float(np.nan_to_num(length[some].max(), nan=np.inf)))
            for some in np.split(order, edges)
            if len(some)
        ]

    def meeting(self, low: Floats, high: Floats) -> Ints:
        """The numbers, in order, of the boxes that touch that from ``low`` to ``high``, (3,)."""
        found = []
        for order, begin, longest in self._classes:
            # One rounding of a length or of the difference must not lose a box.
            reach = longest + 1e-9 * (longest + abs(float(low[self.axis])))
            first = np.searchsorted(begin, low[self.axis] - reach)
            end = np.searchsorted(begin, high[self.axis], "right")
            some = order[first:end]
            meets = (self.low[some] <= high) & (self.high[some] >= low)
            found.append(some[np.all(meets, axis=1)])
        return np.sort(np.concatenate(found)) if found else np.zeros(0, np.intp)
