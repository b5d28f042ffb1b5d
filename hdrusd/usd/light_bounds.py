"""Which lights can be computed with: ``sound`` rows keep all of shading finite in float32.

float32 ends at 3.4e38. The illuminance formulas take the fourth power of a distance and, of
the candela, their share per square metre down to 1e-20 m2 in the lamp itself; the lights of a
scene add up. All bounds are far beyond what there is: the sun has 2e9 cd/m2, and the moon is
4e8 m away.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hdrusd.scene import CYLINDER, DISK, LIGHT, RECT, SPHERE

#: m from the origin of the world.
FARTHEST = 1e9

#: m, of a radius, half a side or half a length.
LARGEST = 1e8

#: cd, or lux of distant lights, per channel.
STRONGEST = 1e18

#: cd/m2 of what is seen of an area light.
BRIGHTEST = 1e30


def sound(rows: npt.NDArray[np.void]) -> npt.NDArray[np.bool_]:
    """(n,) whether all numbers of ``scene.LIGHT`` rows are finite, positive and within bounds."""
    if not len(rows):
        return np.zeros(0, np.bool_)
    finite = [np.isfinite(rows[name]).reshape(len(rows), -1) for name in LIGHT.names or ()]
    positive = (rows["intensity"] >= 0.0).all(axis=1)
    good = np.asarray(np.concatenate(finite, axis=1).all(axis=1) & positive)
    checked = rows[good]
    sizes = np.abs(np.concatenate([checked["x"], checked["y"], checked["radius"][:, None]], axis=1))
    strongest = checked["intensity"].max(axis=1)
    good[good] = (
        (np.abs(checked["position"]).max(axis=1) <= FARTHEST)
        & (sizes.max(axis=1) <= LARGEST)
        & (strongest <= STRONGEST)
        & (strongest <= BRIGHTEST * seen_area(checked))
    )
    return good


def seen_area(rows: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    """m2 (n,) of area lights as seen from their axis; infinite for lights of no shape."""
    shape, radius = rows["shape"], rows["radius"]
    face = np.linalg.norm(np.cross(rows["x"], rows["y"]), axis=1)
    side = 4.0 * np.linalg.norm(rows["x"], axis=1) * radius
    return np.select(
        [shape == RECT, shape == DISK, shape == CYLINDER, shape == SPHERE],
        [4.0 * face, np.pi * face, side, np.pi * radius**2],
        math.inf,
    )
