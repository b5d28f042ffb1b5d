"""Where a scene faces, for the camera of a stage that has none."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from hdrusd.scene import Doubles, Draw


def facing(draws: Iterable[Draw]) -> Doubles:
    """Where the surfaces face: sum of their area vectors over the sum of their areas, world.

    0 for a closed body, a unit vector for a flat sheet, towards the opening of a box.
    """
    towards, area = np.zeros(3), 0.0
    for draw in draws:
        a, b, c = np.moveaxis(draw.geometry.points.reshape(-1, 3, 3).astype(np.float64), 1, 0)
        vectors = np.cross(b - a, c - a) / 2.0
        agree = (vectors * draw.geometry.normals[::3]).sum(axis=1)  # a face may be wound badly
        vectors *= np.where(agree < 0.0, -1.0, 1.0)[:, None]
        total, size = vectors.sum(axis=0), float(np.linalg.norm(vectors, axis=1).sum())
        for matrix in draw.transforms[:, :3, :3]:
            # Area vectors turn by the cofactor matrix.
            cofactors = np.cross(matrix[[1, 2, 0]], matrix[[2, 0, 1]])
            towards += total @ cofactors * np.sign(np.linalg.det(matrix))
            area += size * float(np.linalg.norm(cofactors)) / math.sqrt(3.0)
    return towards / area if area > 0.0 else towards
