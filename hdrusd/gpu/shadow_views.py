"""What the shadow tiles of a local light look at: where from, which way, how wide.

A light with a cone has one perspective tile, others up to six faces of a cube along the
world's axes. An area light has as many of these as it has sample points. All in metres
relative to the origin of the casters (gpu/casters.py); NumPy only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from hdrusd.scene import CYLINDER, DISK, POINT, RECT, SPHERE, Profile

Doubles = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]

#: A cone up to this half-angle has one tile; a wider one would waste it on its rim.
WIDEST_CONE = math.radians(75.0)

#: Texels of a tile beyond what it is for: filter and normal offset read over the edge.
BORDER = 3

#: Rows of the block of a light with sample points.
SAMPLE_ROWS = 4

#: Slot of a face that has no tile: nothing there casts.
NO_TILE = 7

#: u, v and a (rows: right, up, ahead) of the cube faces +X, -X, +Y, -Y, +Z, -Z.
CUBE = np.array(
    [
        [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        [[0, 1, 0], [0, 0, 1], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, 1, 0], [0, 0, -1]],
    ],
    np.float64,
)

#: #define of the pattern of an area light's sample points.
PATTERNS = {SPHERE: "SHADOW_BALL", DISK: "SHADOW_DISK", RECT: "SHADOW_RECT"}
PATTERNS |= {CYLINDER: "SHADOW_TUBE"}

_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


@cache
def pattern(kind: str, count: int) -> Doubles:
    """(count, 4) sample points of an area light; each stands for an equal share of it.

    In units of the light's own vectors (``sample_frame``); last, how deep a point is
    below the lamp's surface, in radii. Seen from any side, the points of a ball or of a
    tube fill its outline evenly: their density is 1 / sqrt(1 - r^2), whose projection
    (Abel's integral) is constant.
    """
    i = np.arange(count)
    even = (i + 0.5) / count
    binary = _radical_inverse(count) + 0.5 / count
    points = np.zeros((count, 4))
    if kind == "SHADOW_RECT":  # Hammersley's points: every row and column of 1 / count has one
        points[:, 0], points[:, 1] = 2.0 * even - 1.0, 2.0 * binary - 1.0
    elif kind in ("SHADOW_DISK", "SHADOW_SUN"):  # Vogel's spiral
        radius, turn = np.sqrt(even), i * _GOLDEN_ANGLE
        points[:, 0], points[:, 1] = radius * np.cos(turn), radius * np.sin(turn)
    elif kind == "SHADOW_BALL":
        # Share within sin t: (2 / pi) (t - sin t cos t), inverted from a table.
        t = np.linspace(0.0, math.pi / 2.0, 4097)
        radius = np.sin(np.interp(binary, (t - np.sin(t) * np.cos(t)) * 2.0 / math.pi, t))
        z, turn = 1.0 - 2.0 * even, i * _GOLDEN_ANGLE
        across = np.sqrt(1.0 - z * z)
        directions = np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)
        points[:, :3], points[:, 3] = directions * radius[:, None], 1.0 - radius
    elif kind == "SHADOW_TUBE":
        radius, turn = np.sqrt(1.0 - (1.0 - binary) ** 2), i * _GOLDEN_ANGLE
        points[:, 0] = 2.0 * even - 1.0
        points[:, 1], points[:, 2] = radius * np.cos(turn), radius * np.sin(turn)
        points[:, 3] = 1.0 - radius
    else:
        raise ValueError(f"{kind}: not a pattern of sample points")
    return points


def _radical_inverse(count: int) -> Doubles:
    """(count,) van der Corput's numbers in base 2: the bits of 0, 1, 2 ... mirrored."""
    number, result = np.arange(count), np.zeros(count)
    for bit in range(1, max(count, 2).bit_length() + 1):
        result += (number & 1) * 2.0**-bit
        number = number >> 1
    return result


def sample_frame(light: npt.NDArray[np.void]) -> Doubles:
    """(3, 3) rows: the vectors, in m, that the points of ``pattern`` are in units of."""
    if light["shape"] in (DISK, RECT):
        return np.array([light["x"], light["y"], np.zeros(3)])
    if light["shape"] == CYLINDER:
        along = light["x"] / max(float(np.linalg.norm(light["x"])), 1e-12)
        across = np.cross(along, light["axis"])
        return np.array([light["x"], light["radius"] * light["axis"], light["radius"] * across])
    return np.asarray(np.eye(3) * light["radius"])


def half_size(light: npt.NDArray[np.void]) -> float:
    """m, of an area light; 0 for a point."""
    if light["shape"] == POINT:
        return 0.0
    flat = max(float(np.linalg.norm(light["x"])), float(np.linalg.norm(light["y"])))
    if light["shape"] == CYLINDER:
        return max(float(np.linalg.norm(light["x"])), float(light["radius"]))
    return float(light["radius"]) if light["shape"] == SPHERE else flat


def widest_angle(light: npt.NDArray[np.void], profiles: Sequence[Profile]) -> float:
    """Rad from the axis beyond which a local light gives nothing; pi or more for all around."""
    angle = float(light["outer"])
    if light["shape"] in (DISK, RECT):
        angle = min(angle, math.pi / 2.0)
    if 0 <= light["profile"] < len(profiles):
        profile = profiles[int(light["profile"])]
        if profile.type == "C":  # angles from the axis; beyond the last it is dark
            angle = min(angle, max(profile.angles))
    return angle


@cache
def _face_directions() -> Doubles:
    """(6, 289, 3) unit vectors over each cube face; one is within 6 degrees of each.

    They are widest apart in the middle of a face: atan(1 / 8) along a side, half of a diagonal
    of that from the nearest, 5.1 degrees.
    """
    across = np.linspace(-1.0, 1.0, 17)
    y, x = (a.ravel() for a in np.meshgrid(across, across, indexing="ij"))
    local = np.stack([x, y, np.ones_like(x)], axis=1)
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    return np.asarray(local @ CUBE)


def lit_faces(axis: Doubles, angle: float) -> Booleans:
    """(6,) the cube faces with directions up to ``angle`` (rad) from ``axis``."""
    cosines = np.max(_face_directions() @ axis, axis=1)
    return np.asarray(np.arccos(np.clip(cosines, -1.0, 1.0)) <= angle + math.radians(6.0))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The tiles of one local light. Tile ``k * f + i`` is face ``i`` of sample point ``k``."""

    kind: str  # #defines of its variant of shadow.glsl
    position: Doubles  # (3,) of the lamp
    samples: Doubles  # (k, 3) from there to where the tiles look from
    near: Doubles  # (k,) what is nearer does not cast
    frames: Doubles  # (f, 3, 3) u, v, a of each face: right, up and ahead
    faces: npt.NDArray[np.intp]  # (f,) cube faces
    tangent: float  # of half the angle that a tile is for
    radius: float  # nothing inside this ball around the lamp casts
    first_near: float  # ``near`` before a point's depth in the lamp

    @property
    def points(self) -> int:
        """Sample points."""
        return len(self.samples)

    @property
    def rows(self) -> int:
        """Rows of its block of tiles."""
        return SAMPLE_ROWS if self.points > 1 else 1

    def with_faces(self, which: Booleans) -> View:
        """The same with some of its faces (f,)."""
        return replace(self, frames=self.frames[which], faces=self.faces[which])

    def tangents(self, cell: int) -> float:
        """Tangent of half the angle of a tile of ``cell`` texels, border included."""
        return self.tangent * cell / (cell - 2 * BORDER)

    def matrices(self, cell: int) -> Doubles:
        """(k f, 4, 4) row-vector matrices to clip space; the far plane is at infinity."""
        frames = np.broadcast_to(self.frames, (len(self.samples), *self.frames.shape))
        m = np.zeros((*frames.shape[:2], 4, 4))
        m[..., :3, :2] = frames[..., :2, :].swapaxes(-1, -2) / self.tangents(cell)
        m[..., :3, 2] = m[..., :3, 3] = frames[..., 2, :]
        origins = (self.position + self.samples)[:, None, None, :]
        m[..., 3, :] = -(origins @ m[..., :3, :])[..., 0, :]
        m[..., 3, 2] -= 2.0 * self.near[:, None]
        return m.reshape(-1, 4, 4)

    def balls(self) -> Doubles:
        """(k f, 4): x, y, z of the tile's eye from the lamp in its frame; radius squared."""
        balls = np.empty((len(self.samples), len(self.faces), 4))
        balls[..., :3] = np.einsum("fij,kj->kfi", self.frames, self.samples)
        balls[..., 3] = self.radius**2
        return balls.reshape(-1, 4)

    def data(self, cell: int, corner: tuple[int, int], size: tuple[int, int]) -> Doubles:
        """(2, 4) what shadow.glsl reads: where the tiles lie in an atlas of ``size``."""
        place = (corner[0] / size[0], corner[1] / size[1], cell / size[0], self.first_near)
        tangent = self.tangents(cell)
        texel = 2.0 * tangent / cell
        if self.kind.startswith("SHADOW_SPOT"):
            return np.array([place, (*(self.frames[0, 0] / tangent), texel)])
        slots = np.full(6, NO_TILE)
        slots[self.faces] = np.arange(len(self.faces))
        code = float(np.sum(slots << (3 * np.arange(6))))
        return np.array([place, (code, 1.0 / tangent, texel, len(self.faces))])


def local_view(
    light: npt.NDArray[np.void],
    origin: Doubles,
    profiles: Sequence[Profile],
    *,
    samples: int,
    small: float,
    near: float,
) -> View:
    """The tiles of a local light, all faces that it can shine through.

    ``samples``: points of an area light; one whose half size is up to ``small`` (m) has
    one. ``near``: m, below which no tile of a lamp without size looks.
    """
    kind, points = "", np.zeros((1, 4))
    if samples > 1 and half_size(light) > small:
        kind = PATTERNS[int(light["shape"])]
        points = pattern(kind, samples)
    radius = float(light["radius"]) if light["shape"] in (POINT, SPHERE, CYLINDER) else 0.0
    if kind:
        nears = np.maximum(near, points[:, 3] * radius)
        first = near
    else:
        first = max(near, radius)
        nears = np.array([first])
    angle = widest_angle(light, profiles)
    axis = np.asarray(light["axis"], np.float64)
    if angle <= WIDEST_CONE:
        faces, frames = np.zeros(1, np.intp), _frame(axis, light["x"])[None]
        shape, tangent = "SHADOW_SPOT", math.tan(max(angle, 1e-4))
    else:
        faces = np.flatnonzero(lit_faces(axis, angle))
        shape, frames, tangent = "SHADOW_CUBE", CUBE[faces], 1.0
    return View(
        kind=f"{shape} {kind}".strip(),
        position=light["position"] - origin,
        samples=points[:, :3] @ sample_frame(light),
        near=nears,
        frames=frames,
        faces=faces,
        tangent=tangent,
        # The corners of a tessellated bulb may stand out a little.
        radius=0.0 if light["shape"] == CYLINDER else 1.02 * radius,
        first_near=first,
    )


def _frame(axis: Doubles, x: Doubles) -> Doubles:
    """(3, 3) rows u, v, a: orthonormal, a = ``axis``, u as near to ``x`` as can be."""
    u = x - axis * np.dot(axis, x)
    if np.linalg.norm(u) < 1e-6 * np.linalg.norm(x) or not np.any(u):
        u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u = u / np.linalg.norm(u)
    return np.array([u, np.cross(axis, u), axis])


def frustum_sees(matrices: Doubles, boxes: Doubles) -> Booleans:
    """(t, b): whether box b (middle, half size) may reach into the clip space of tile t.

    ``matrices`` (t, 4, 4) row-vector; a box that straddles two planes outside may pass.
    """
    x, y, z, w = matrices.transpose(2, 0, 1)  # columns: each (t, 4), coefficients of a plane
    planes = np.stack([w + x, w - x, w + y, w - y, w + z], axis=1).reshape(-1, 4)
    # A block of planes at a time: what it takes does not grow with the scene.
    rows = max(5, 4_000_000 // max(len(boxes), 1) // 5 * 5)
    seen = []
    for first in range(0, len(planes), rows):
        some = planes[first : first + rows]
        reach = boxes[:, 0] @ some[:, :3].T + boxes[:, 1] @ np.abs(some[:, :3]).T + some[:, 3]
        seen.append(np.all(reach.reshape(len(boxes), len(some) // 5, 5) > 0.0, axis=2).T)
    return np.concatenate(seen) if seen else np.zeros((0, len(boxes)), np.bool_)
