"""Where cameras and spotlights look: a place, a target and a roll become a rotation.

As lights and cameras of a stage have it, -Z looks at the target and +Y is up: the
world's Z as nearly as it can, -X for one that looks straight up or down. A roll turns
it clockwise as it looks.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]

#: Of the horizontal part of a direction to its length: below it it is straight up or down.
_UPRIGHT = 1e-9


def aim(places: Doubles, targets: Doubles, rolls: Doubles) -> Doubles:
    """Unit quaternions (k, 4), x y z w, of k places and targets (k, 3) and rolls (k,), degrees.

    A place on its target looks along +Y, as a camera without a turn does.
    """
    ahead = targets - places
    length = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = np.where(length > 0.0, ahead / np.where(length > 0.0, length, 1.0), (0.0, 1.0, 0.0))
    upright = np.hypot(ahead[:, 0], ahead[:, 1]) < _UPRIGHT
    up = np.where(upright[:, None], (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(right, ahead)
    cos, sin = (f(np.radians(rolls))[:, None] for f in (np.cos, np.sin))
    axes = np.stack([cos * right - sin * up, cos * up + sin * right, -ahead], axis=1)
    return quaternions(axes)


def quaternions(rows: Doubles) -> Doubles:
    """(k, 4), x y z w, of rotation matrices (k, 3, 3) for row vectors.

    Of the four ways to divide that with the largest divisor (S. W. Shepperd,
    Quaternion from rotation matrix, 1978).
    """
    x, y, z = rows[:, 0, 0], rows[:, 1, 1], rows[:, 2, 2]
    squares = np.stack([1 + x - y - z, 1 - x + y - z, 1 - x - y + z, 1 + x + y + z], axis=1)
    best = np.argmax(squares, axis=1)
    a, b, c = (rows[:, i, j] - rows[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1)))
    d, e, f = (rows[:, i, j] + rows[:, j, i] for i, j in ((0, 1), (2, 0), (1, 2)))
    table = np.stack(
        [
            np.stack([squares[:, 0], d, e, a], axis=1),
            np.stack([d, squares[:, 1], f, b], axis=1),
            np.stack([e, f, squares[:, 2], c], axis=1),
            np.stack([a, b, c, squares[:, 3]], axis=1),
        ],
        axis=1,
    )
    found = table[np.arange(len(rows)), best]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))
