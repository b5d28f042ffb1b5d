"""What the lamps of a scene give at the eye: E = I(direction) / d^2, square to their rays.

For the veil of lamps that no pixel shows, by E f(theta) (hdrusd.glare). A lamp that has a size
is one at its centre, at least its own size away; so is the light of the scene's skies not in it.
Whether something stands in the way of their light is not known here: what the frame holds, the
frame can tell (gpu/small_lamps.py); a lamp beside it counts through walls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import cone_factor, focus_factor, inverse_edge, inverse_square
from hdrusd.photometry.lighttree import extent
from hdrusd.photometry.profile import pack_profiles, profile_candela
from hdrusd.scene import CYLINDER, DISK, RECT, Camera, RenderScene

Array = npt.NDArray[Any]


def eye_illuminance(scene: RenderScene) -> Array:
    """Lamps outside the frame of the scene's camera, (n, 6).

    Rows: the unit vector towards one in view space (+x right, +y up, the camera looks along
    -z), and lx per channel on a plane that faces it. None for a camera that projects in
    parallel, which is no eye's.
    """
    rows = lamps_at_eye(scene)
    shines = np.any(rows[:, 3:] > 0.0, axis=1) & np.all(np.isfinite(rows), axis=1)
    return np.asarray(rows[shines & ~in_frame(rows[:, :3], scene.camera)])


def lamps_at_eye(scene: RenderScene) -> Array:
    """All lights of a scene, (n, 6), as rows of ``eye_illuminance``; (0, 6) for no eye's camera."""
    camera = scene.camera
    if camera.orthographic or not len(scene.lights):
        return np.zeros((0, 6))
    lights = scene.lights
    to = np.asarray(lights["position"]) - lights["w"][:, None] * np.asarray(camera.eye)
    d2 = np.sum(to * to, axis=1)
    away = -to * np.sqrt(inverse_square(np.sqrt(d2)))[:, None]
    nearest = np.maximum(extent(lights), lights["radius"])
    share = np.minimum(inverse_square(np.sqrt(d2)), inverse_square(nearest))
    share = np.where(lights["w"] > 0.0, share * _intensity(scene, away), 1.0)
    seen = -away @ camera.rotation()
    return np.concatenate([seen, np.asarray(lights["intensity"]) * share[:, None]], axis=1)


def in_frame(direction: Array, camera: Camera) -> npt.NDArray[np.bool_]:
    """(n,) whether directions (n, 3) in view space lie within a camera's window."""
    left, right, bottom, top = camera.window
    ahead = direction[:, 2] < 0.0
    x, y = (direction[:, k] / np.where(ahead, -direction[:, 2], 1.0) for k in (0, 1))
    return np.asarray(ahead & (x >= left) & (x <= right) & (y >= bottom) & (y <= top))


def _intensity(scene: RenderScene, away: Array) -> Array:
    """(n,) factor on LIGHT.intensity in the unit directions (n, 3) in which lamps shine."""
    lights = scene.lights
    cosine = np.sum(away * lights["axis"], axis=1)
    share = cone_factor(cosine, lights["inner"], inverse_edge(lights["inner"], lights["outer"]))
    share = share * focus_factor(cosine, lights["exponent"])
    sides = [v / np.sqrt(np.maximum(np.sum(v * v, axis=1), 1e-20))[:, None] for v in _axes(lights)]
    along, across = (np.sum(away * side, axis=1) for side in sides)
    flat = (lights["shape"] == RECT) | (lights["shape"] == DISK)
    share = np.where(flat, share * np.maximum(cosine, 0.0), share)
    tube = np.sqrt(np.maximum(1.0 - along * along, 0.0))
    share = np.where(lights["shape"] == CYLINDER, share * tube, share)
    filed = lights["profile"] >= 0
    if np.any(filed):
        atlas, placements = pack_profiles(scene.profiles)
        place, grid = np.moveaxis(placements[lights["profile"][filed]], 1, 0)
        local = np.stack([along, across, cosine], axis=-1)[filed]
        share[filed] *= profile_candela(atlas, place, grid, local)
    return share


def _axes(lights: npt.NDArray[np.void]) -> tuple[Array, Array]:
    return np.asarray(lights["x"]), np.asarray(lights["y"])
