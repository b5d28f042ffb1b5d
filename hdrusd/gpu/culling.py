"""Which spheres a camera may see."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.scene import Camera

Doubles = npt.NDArray[np.float64]


def in_view(camera: Camera, centres: Doubles, radii: Doubles) -> npt.NDArray[np.bool_]:
    """(n,) False where a sphere lies outside of a plane of the camera's frustum.

    ``centres`` (n, 3) m in the world, ``radii`` (n,) m. What is no number counts as seen.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, back = ((centres - camera.eye) @ camera.rotation()).T
        left, right, bottom, top = camera.window
        # Of a pinhole the window grows with the distance, and its planes are inclined.
        distance = np.ones_like(back) if camera.orthographic else -back
        slope = 0.0 if camera.orthographic else 1.0
        inside = [
            (x - left * distance) / np.hypot(1.0, slope * left),
            (right * distance - x) / np.hypot(1.0, slope * right),
            (y - bottom * distance) / np.hypot(1.0, slope * bottom),
            (top * distance - y) / np.hypot(1.0, slope * top),
            -back - camera.near,
            camera.far + back,
        ]
        return np.asarray(~(np.min(inside, axis=0) < -radii))
