"""What the shadow tiles of a distant light look at: up to four maps, the near ones finer.

Each is a square across the light that holds the ball around one part of the camera's view.
Balls do not change when the camera turns, and their centres move in steps of whole texels:
the edges of shadows stand still while the camera moves. NumPy only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.gpu.shadow_views import BORDER, SAMPLE_ROWS, pattern
from hdrusd.scene import Camera

Doubles = npt.NDArray[np.float64]

#: Maps of one distant light, and how much farther each reaches than the one before.
CASCADES = 4
_RATIO = 4.0

#: Half a distant light's angle (rad) above which its shadows have soft edges.
SOFT_ANGLE = math.radians(0.3)

#: Steps of a centre in a map: whole texels for every size of tile above this.
_STEPS = 32


@dataclass(frozen=True, slots=True, eq=False)
class DistantView:
    """The tiles of one distant light. Tile ``k c + i`` is map ``i`` of sample direction ``k``."""

    kind: str
    frame: Doubles  # (3, 3) rows u, v, a; a is the way the light travels
    centres: Doubles  # (c, 2) along u and v, m from the casters' origin
    halves: Doubles  # (c,) half sides, m
    depths: tuple[float, float]  # along a, m from the casters' origin
    shears: Doubles  # (k, 2) m across for each m along a, of the sample directions
    eye: Doubles  # (3,) from the casters' origin: the sheared maps meet the true one there

    @property
    def points(self) -> int:
        """Sample directions."""
        return len(self.shears)

    @property
    def rows(self) -> int:
        """Rows of its block of tiles."""
        return SAMPLE_ROWS if self.points > 1 else 1

    @property
    def faces(self) -> npt.NDArray[np.intp]:
        """(c,) numbers of the maps."""
        return np.arange(len(self.halves))

    def signature(self) -> bytes:
        """What the tiles depend on beside the light."""
        eye = self.eye.tobytes() if self.points > 1 else b""
        return b"".join(
            [self.centres.tobytes(), self.halves.tobytes(), repr(self.depths).encode(), eye]
        )

    def matrices(self, cell: int) -> Doubles:
        """(k c, 4, 4) row-vector matrices to clip space."""
        u, v, a = self.frame
        low, high = self.depths
        m = np.zeros((len(self.shears), len(self.halves), 4, 4))
        sheared = np.stack([u, v]) + self.shears[:, :, None] * a  # (k, 2, 3)
        scale = self._scale(cell)
        m[..., :3, :2] = sheared.swapaxes(1, 2)[:, None] * scale[:, None, None]
        shift = self.centres + (self.shears * (self.eye @ a))[:, None]
        m[..., 3, :2] = -shift * scale[:, None]
        m[..., :3, 2], m[..., 3, 2] = 2.0 * a / (high - low), -(high + low) / (high - low)
        m[..., 3, 3] = 1.0
        return m.reshape(-1, 4, 4)

    def balls(self) -> Doubles:
        """(k c, 4) zeros: a distant light has no lamp within which nothing casts."""
        return np.zeros((len(self.shears) * len(self.halves), 4))

    def tangents(self, cell: int) -> float:
        return 1.0

    def _scale(self, cell: int) -> Doubles:
        return np.asarray((cell - 2 * BORDER) / cell / self.halves)

    def data(self, cell: int, corner: tuple[int, int], size: tuple[int, int]) -> Doubles:
        """(6, 4) what shadow.glsl reads, relative to the eye."""
        u, v, a = self.frame
        low, high = self.depths
        rows = np.zeros((6, 4))
        rows[0] = *u, 1.0 / (high - low)
        rows[1] = corner[0] / size[0], corner[1] / size[1], cell / size[0], low - self.eye @ a
        used = np.minimum(np.arange(CASCADES), len(self.halves) - 1)
        rows[2:, :2] = (self.centres - [self.eye @ u, self.eye @ v])[used]
        rows[2:, 2], rows[2:, 3] = self._scale(cell)[used], used
        return rows


def distant_view(
    light: npt.NDArray[np.void], camera: Camera, origin: Doubles, bounds: Doubles, samples: int
) -> DistantView:
    """The tiles of a distant light for this camera.

    ``bounds`` (2, 3): lowest and highest corner of all casters, m from ``origin``.
    ``samples``: directions, where the light's angle is above ``SOFT_ANGLE``.
    """
    frame = _frame(-np.asarray(light["position"], np.float64))
    eye = np.asarray(camera.eye) - origin
    soft = samples > 1 and light["angle"] > SOFT_ANGLE
    shears = np.zeros((1, 2))
    if soft:
        shears = pattern("SHADOW_SUN", samples)[:, :2] * math.tan(min(float(light["angle"]), 1.5))
    balls, radii = view_balls(camera, _reach(camera, eye, bounds))
    halves = radii * (_STEPS / (_STEPS - 2.0))
    if soft:  # a sheared map is shifted by up to the radius times the shear
        halves *= 1.0 + 2.0 * math.tan(min(float(light["angle"]), 0.5))
    centres = _snapped((balls + eye) @ frame[:2].T, halves)
    return DistantView(
        kind="SHADOW_ORTHO SHADOW_SUN" if soft else "SHADOW_ORTHO",
        frame=frame,
        centres=centres,
        halves=halves,
        depths=_depths(frame[2], bounds),
        shears=shears,
        eye=eye,
    )


def _frame(axis: Doubles) -> Doubles:
    """(3, 3) rows u, v, a: orthonormal, a = ``axis``."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(axis, u), axis])


def _snapped(centres: Doubles, halves: Doubles) -> Doubles:
    """(c, 2) moved by up to half a step, so that they stand still or jump by whole texels."""
    step = 2.0 * halves[:, None] / _STEPS
    return np.asarray(np.floor(centres / step + 0.5) * step)


def view_balls(camera: Camera, reach: float) -> tuple[Doubles, Doubles]:
    """Centres (c, 3), m from the eye, and radii (c,) of balls around parts of the view.

    The first part ends at ``reach`` / 64, each next one four times as far. An orthographic
    camera has one part.
    """
    left, right, bottom, top = camera.window
    x, y, z = np.asarray(camera.right), np.asarray(camera.up), -np.asarray(camera.back)
    middle = (left + right) / 2.0 * x + (bottom + top) / 2.0 * y
    corners = np.array([i * x + j * y for i in (left, right) for j in (bottom, top)])
    if camera.orthographic:
        radius = math.hypot(reach / 2.0, float(np.max(np.linalg.norm(corners - middle, axis=1))))
        return (middle + z * (reach / 2.0))[None], np.array([radius])
    ends = reach * _RATIO ** np.arange(1.0 - CASCADES, 1.0)
    starts = np.concatenate([[0.0], ends[:-1]])
    wide = float(np.max(np.sum((corners - middle) ** 2, axis=1)))
    # The ball through the corners of both ends, or half of it where the view is wider than deep.
    along = np.minimum(ends, (starts + ends) / 2.0 * (1.0 + wide))
    centres = along[:, None] * (middle + z)
    rims = np.stack([starts, ends])[:, :, None, None] * (corners + z)
    radii = np.max(np.linalg.norm(rims - centres[None, :, None], axis=-1), axis=(0, 2))
    return centres, radii


def _reach(camera: Camera, eye: Doubles, bounds: Doubles) -> float:
    """m, how far the view goes: to the end of the casters, in steps of sqrt(2)."""
    farthest = np.linalg.norm(np.maximum(np.abs(bounds[0] - eye), np.abs(bounds[1] - eye)))
    return min(_rounded_up(float(farthest), 2.0), max(camera.far, 1e-3))


def _depths(axis: Doubles, bounds: Doubles) -> tuple[float, float]:
    """From the first to the last caster along the light, in coarse steps: they may move."""
    middle, half = bounds.mean(axis=0) @ axis, (bounds[1] - bounds[0]) / 2.0 @ np.abs(axis)
    step = _rounded_up(float(half), 1.0) / 8.0
    low, high = math.floor((middle - half) / step) - 1.0, math.ceil((middle + half) / step) + 1.0
    return low * step, high * step


def _rounded_up(length: float, steps: float) -> float:
    """The next of ``steps`` even ratios to an octave."""
    return float(2.0 ** (math.ceil(math.log2(max(length, 1e-3)) * steps) / steps))
