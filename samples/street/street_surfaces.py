"""Textures that repeat: ground, walls, roofs.

Each function returns (size, size, 3) floats between 0 and 1, row 0 at the top, as
they stand in the file (display values, not linear light), without a seam.
"""

from __future__ import annotations

import numpy as np
from street_model import Array, Vec3


def _noise(rng: np.random.Generator, size: int, *cells: int) -> Array:
    """Tileable value noise (size, size) about 0, the sum of one octave for each of ``cells``."""
    total = np.zeros((size, size))
    for n in cells:
        lattice = rng.random((n, n)) - 0.5
        at = np.arange(size) * n / size
        low = at.astype(int)
        t = at - low
        t = t * t * (3.0 - 2.0 * t)
        rows = lattice[low] * (1.0 - t)[:, None] + lattice[(low + 1) % n] * t[:, None]
        total += (rows[:, low] * (1.0 - t) + rows[:, (low + 1) % n] * t) * cells[0] / n
    return total


def tint(grey: Array, colour: Vec3) -> Array:
    return grey[:, :, None] * np.array(colour)


def asphalt() -> Array:
    """Worn asphalt: aggregate, a mended patch, tar-filled cracks."""
    rng, n = np.random.default_rng(1), 512
    grey = 0.37 + 0.10 * _noise(rng, n, 4, 8, 16) + 0.16 * (rng.random((n, n)) - 0.5)
    stones = rng.random((n, n)) > 0.985
    grey = np.where(stones, grey + 0.16, grey)
    patch = np.zeros((n, n), dtype=bool)
    patch[60:190, 300:430] = True
    grey = np.where(patch, grey * 0.88, grey)
    y = np.arange(n)
    for start, wave, width in ((90, 23.0, 1), (390, 31.0, 0)):
        walk = start + wave * np.sin(2 * np.pi * y / n) + 7.0 * np.sin(6 * np.pi * y / n + wave)
        walk += np.cumsum(rng.integers(-1, 2, n)) * np.sin(
            np.pi * y / n
        )  # ragged, closed at the ends
        for dx in range(-width, width + 1):
            grey[y, (walk.astype(int) + dx) % n] *= 0.72
    return tint(grey, (1.0, 1.0, 1.0))


def marking() -> Array:
    """White road paint, worn through to the asphalt in places."""
    rng, n = np.random.default_rng(2), 256
    grey = 0.80 + 0.06 * _noise(rng, n, 8, 16) + 0.04 * (rng.random((n, n)) - 0.5)
    worn = _noise(rng, n, 16, 32, 64) > 0.42
    return tint(np.where(worn, 0.45, grey), (1.0, 0.99, 0.95))


def _courses(
    rng: np.random.Generator, n: int, rows: int, columns: int, joint: int, spread: float
) -> tuple[Array, Array]:
    """Blocks in running bond: (shade of each block about 0, 1 on the joints), both (n, n)."""
    y, x = np.mgrid[0:n, 0:n]
    row = y * rows // n
    width = n // columns
    shifted = (x + (row % 2) * (width // 2)) % n
    column = shifted // width
    shade = spread * (rng.random((rows, columns)) - 0.5)
    on_joint = (shifted % width < joint) | (y % (n // rows) < joint)
    return shade[row, column], on_joint.astype(float)


def stone_ashlar() -> Array:
    """Parisian limestone in courses, with rain streaks and fine joints."""
    rng, n = np.random.default_rng(3), 512
    shade, joint = _courses(rng, n, 8, 4, 3, 0.09)
    streak = np.cumsum(rng.random((1, n)) - 0.5, axis=1)
    streak -= np.linspace(0.0, 1.0, n) * streak[0, -1]
    grain = 0.05 * _noise(rng, n, 8, 16, 32) + 0.03 * (rng.random((n, n)) - 0.5)
    grey = 0.74 + shade + grain + 0.006 * streak - 0.20 * joint
    return tint(grey, (1.0, 0.93, 0.79))


def stone_rusticated() -> Array:
    """Ground-floor stone: tall courses with deep channels and a lit upper edge."""
    rng, n = np.random.default_rng(4), 512
    shade, joint = _courses(rng, n, 4, 2, 14, 0.06)
    edge = np.roll(joint, 8, axis=0) * (1.0 - joint)
    grain = 0.06 * _noise(rng, n, 8, 16, 32) + 0.03 * (rng.random((n, n)) - 0.5)
    return tint(0.69 + shade + grain - 0.38 * joint + 0.08 * edge, (1.0, 0.93, 0.81))


def stone_smooth() -> Array:
    """Dressed stone for mouldings and surrounds."""
    rng, n = np.random.default_rng(5), 256
    grain = 0.05 * _noise(rng, n, 4, 8, 16) + 0.03 * (rng.random((n, n)) - 0.5)
    return tint(0.76 + grain, (1.0, 0.95, 0.85))


def plaster() -> Array:
    """White render that the material's diffuse colour tints."""
    rng, n = np.random.default_rng(6), 256
    return tint(0.85 + 0.07 * _noise(rng, n, 4, 8, 32) + 0.03 * rng.random((n, n)), (1, 1, 1))


def brick() -> Array:
    """Red brick, sixteen courses, pale mortar."""
    rng, n = np.random.default_rng(7), 512
    shade, joint = _courses(rng, n, 16, 8, 4, 0.20)
    grain = 0.06 * (rng.random((n, n)) - 0.5)
    red = tint(0.62 + shade + grain, (1.0, 0.50, 0.38))
    return np.where(joint[:, :, None] > 0, tint(0.66 + grain, (1.0, 0.96, 0.88)), red)


def slate() -> Array:
    """Roof slates, each row overlapping the next."""
    rng, n = np.random.default_rng(8), 256
    shade, joint = _courses(rng, n, 8, 8, 2, 0.12)
    lap = 0.10 * ((np.arange(n) % 32) / 32.0)[:, None]
    return tint(0.38 + shade + lap - 0.16 * joint, (0.90, 0.95, 1.0))


def granite() -> Array:
    """Kerb stones, one joint a repeat."""
    rng, n = np.random.default_rng(9), 256
    grey = 0.56 + 0.16 * (rng.random((n, n)) - 0.5) + 0.05 * _noise(rng, n, 8)
    grey[:4] = 0.30
    return tint(grey, (1.0, 0.98, 0.96))


def pavement() -> Array:
    """Stone slabs in running bond, stained, with dark joints."""
    rng, n = np.random.default_rng(10), 512
    shade, joint = _courses(rng, n, 4, 4, 4, 0.10)
    stains = 0.07 * _noise(rng, n, 4, 8, 16)
    grey = 0.50 + shade + stains + 0.05 * (rng.random((n, n)) - 0.5) - 0.20 * joint
    return tint(grey, (1.0, 0.98, 0.94))


def arcade_floor() -> Array:
    """The arcade's floor: a chequerboard of pale and dark stone, laid on the diagonal."""
    rng, n = np.random.default_rng(11), 256
    y, x = np.mgrid[0:n, 0:n]
    dark = ((x + y) // 64 + (x - y) // 64) % 2 == 0
    grey = np.where(dark, 0.34, 0.62) + 0.04 * (rng.random((n, n)) - 0.5)
    joint = ((x + y) % 64 < 2) | ((x - y) % 64 < 2)
    return tint(np.where(joint, 0.28, grey), (1.0, 0.97, 0.92))
