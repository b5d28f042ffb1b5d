"""Textures that are pictures: windows, shops, doors, signs, a poster, a number plate.

Each function returns (height, width, 3) floats between 0 and 1, row 0 at the top,
as they stand in the file. They are daylight pictures: what a lit window shows is
bright because the thing is bright, and its cd/m2 are said elsewhere.
"""

from __future__ import annotations

import numpy as np
from street_lettering import text_mask
from street_model import Array, Vec3
from street_surfaces import tint

SIGNS = (
    "BOULANGERIE", "LIBRAIRIE", "CAFE DU PASSAGE", "FLEURS", "HOTEL LUMIERE",
    "TABAC", "OPTIQUE MICHEL", "PHARMACIE",
)  # fmt: skip
_SIGN_GROUNDS: tuple[Vec3, ...] = (
    (0.42, 0.10, 0.10), (0.09, 0.22, 0.16), (0.35, 0.20, 0.06), (0.30, 0.12, 0.30),
    (0.10, 0.14, 0.34), (0.50, 0.08, 0.07), (0.07, 0.24, 0.33), (0.05, 0.36, 0.17),
)  # fmt: skip


def _casement(pane: Array, wood: Vec3) -> Array:
    """``pane`` behind a French window: two leaves of four panes below a fanlight."""
    n = len(pane)
    y, x = np.mgrid[0:n, 0:n]
    bars = (x < 14) | (x >= n - 14) | (y < 12) | (y >= n - 16) | (abs(x - n // 2) < 9)
    for level in (62, 126, 190):
        bars |= abs(y - level) < (7 if level == 62 else 4)
    bars |= abs(x - 74) < 3
    bars |= abs(x - (n - 75)) < 3
    image = np.where(bars[:, :, None], np.array(wood), pane)
    image[:, [13, n // 2 + 8]] *= 0.75  # the shadow of the frame on its own rebate
    return image


def window_bare() -> Array:
    """A dark room behind glass that mirrors a little of the day."""
    n = 256
    y, x = np.mgrid[0:n, 0:n] / n
    sheen = 0.10 + 0.16 * (1.0 - y) + 0.05 * np.sin(9.0 * (x + 0.6 * y))
    return _casement(tint(sheen, (0.75, 0.90, 1.0)), (0.78, 0.77, 0.72))


def window_curtain() -> Array:
    """Net curtains drawn to the sides of a dark room."""
    n = 256
    y, x = np.mgrid[0:n, 0:n] / n
    folds = 0.46 + 0.07 * np.sin(2 * np.pi * 18 * x)
    open_ = abs(x - 0.5) < 0.06 + 0.26 * y
    pane = np.where(open_[:, :, None], np.array((0.11, 0.13, 0.15)), tint(folds, (1.0, 0.98, 0.93)))
    return _casement(pane, (0.80, 0.79, 0.75))


def window_warm() -> Array:
    """A lit room: amber curtains, a wall, and a lamp whose shade is the brightest thing."""
    n = 256
    y, x = np.mgrid[0:n, 0:n] / n
    glow = np.exp(-(((x - 0.36) / 0.30) ** 2 + ((y - 0.50) / 0.35) ** 2))
    wall = tint(0.34 + 0.40 * glow, (1.0, 0.82, 0.55))
    folds = tint(0.46 + 0.08 * np.sin(2 * np.pi * 16 * x) + 0.18 * glow, (1.0, 0.66, 0.36))
    pane = np.where((abs(x - 0.5) < 0.26 + 0.05 * y)[:, :, None], wall, folds)
    shade = (abs(x - 0.36) < 0.05 + 0.10 * (y - 0.40)) & (y > 0.40) & (y < 0.54)
    stand = (abs(x - 0.36) < 0.008) & (y >= 0.54)
    pane = np.where(shade[:, :, None], np.array((1.0, 0.93, 0.74)), pane)
    pane = np.where(stand[:, :, None], np.array((0.15, 0.10, 0.06)), pane)
    return _casement(pane, (0.24, 0.20, 0.16))


def window_cool() -> Array:
    """An office after hours: a luminous ceiling, a cupboard, a half-drawn blind."""
    n = 256
    y, x = np.mgrid[0:n, 0:n] / n
    pane = tint(0.66 - 0.28 * y, (0.93, 1.0, 0.97))
    tubes = (y > 0.24) & (y < 0.31) & (abs((x * 3.0) % 1.0 - 0.5) < 0.34)
    pane = np.where(tubes[:, :, None], np.array((1.0, 1.0, 0.98)), pane)
    shelf = (y > 0.62) & (x > 0.52)
    pane = np.where(shelf[:, :, None], np.array((0.30, 0.30, 0.28)), pane)
    blind = (y < 0.22)[:, :, None]
    slats = tint(0.62 + 0.10 * np.sign(np.sin(2 * np.pi * 26 * y)), (1.0, 0.98, 0.90))
    return _casement(np.where(blind, slats, pane), (0.22, 0.21, 0.20))


def _shop(back: Vec3) -> Array:
    """(256, 512) the inside of a shop: light falling from lamps behind the lintel on a wall."""
    y, x = np.mgrid[0:256, 0:512]
    lamps = np.zeros(y.shape)
    for centre in (70, 192, 320, 442):
        lamps += np.exp(-(((x - centre) / 62.0) ** 2) - ((y - 10) / 130.0) ** 2)
    image = tint(0.42 + 0.50 * np.clip(lamps, 0.0, 1.0), back)
    image[226:] = np.array((0.42, 0.30, 0.20))
    spots = (np.hypot((x - 70) % 124 - 0.0, (y - 8) * 1.5) < 8) & (y < 14)
    image[spots] = 1.0
    return image


def shop_books() -> Array:
    """A bookshop: four shelves of spines and a table."""
    rng = np.random.default_rng(21)
    image = _shop((1.0, 0.86, 0.62))
    for top in (44, 90, 136, 182):
        image[top + 36 : top + 41, 16:496] = np.array((0.34, 0.21, 0.12))
        x = 18
        while x < 488:
            width, height = int(rng.integers(5, 13)), int(rng.integers(20, 34))
            colour = rng.choice(
                ((0.7, 0.15, 0.1), (0.1, 0.3, 0.5), (0.85, 0.75, 0.5), (0.2, 0.4, 0.2))
            )
            if rng.random() < 0.86:
                image[top + 36 - height : top + 36, x : x + width - 1] = colour * (
                    0.7 + 0.5 * rng.random()
                )
            x += width
    return image


def shop_fashion() -> Array:
    """A dress shop: five figures before a pale wall."""
    image = _shop((1.0, 0.96, 0.93))
    y, x = np.mgrid[0:256, 0:512]
    dresses = (
        (0.65, 0.08, 0.12),
        (0.10, 0.15, 0.35),
        (0.85, 0.65, 0.15),
        (0.08, 0.08, 0.09),
        (0.15, 0.4, 0.3),
    )
    for i, colour in enumerate(dresses):
        cx = 60 + 98 * i
        head = np.hypot(x - cx, (y - 58) * 0.85) < 10
        waist = 11 + 8 * abs((y - 128) / 50.0)
        gown = (
            (abs(x - cx) < np.where(y < 128, waist, 11 + 0.34 * (y - 128))) & (y > 76) & (y < 220)
        )
        image[head] = (0.80, 0.70, 0.60)
        image[gown] = colour
        image[gown & (x > cx + 4)] *= 0.8
    return image


def shop_cafe() -> Array:
    """A cafe: mirrors, a bar with bottles, people at tables."""
    rng = np.random.default_rng(23)
    image = _shop((1.0, 0.78, 0.48))
    y, x = np.mgrid[0:256, 0:512]
    for left in range(24, 500, 98):
        image[40:110, left : left + 70] = np.array((0.86, 0.78, 0.60))
        image[44:106, left + 4 : left + 66] = np.array((0.58, 0.52, 0.42))
    for left in range(20, 490, 11):
        height = int(rng.integers(14, 26))
        image[150 - height : 150, left : left + 7] = rng.choice(
            ((0.2, 0.35, 0.15), (0.5, 0.3, 0.1), (0.7, 0.6, 0.4))
        )
    image[150:158] = np.array((0.30, 0.16, 0.08))
    for cx in (66, 120, 250, 372, 430):
        shade = 0.10 + 0.10 * rng.random()
        image[np.hypot(x - cx, y - 152) < 13] = (shade * 1.6, shade, shade)
        image[(np.hypot((x - cx) * 0.8, y - 204) < 36) & (y > 166)] = (shade, shade * 0.9, shade)
    return image


def shop_dark() -> Array:
    """A closed shop: a steel shutter's slats behind glass."""
    y, _ = np.mgrid[0:256, 0:512]
    slats = 0.30 + 0.06 * np.sin(2 * np.pi * y / 12.0) - 0.06 * (y % 12 < 2)
    return tint(slats, (0.94, 0.98, 1.0))


def door() -> Array:
    """A panelled double door with a brass plate."""
    n = 256
    y, x = np.mgrid[0:n, 0:n]
    u = abs((x % 128) - 64)
    v = abs((y % 86) - 43)
    panel = (u < 46) & (v < 32)
    rim = panel & ~((u < 41) & (v < 27))
    image = tint(np.where(panel, 0.32, 0.38) + np.where(rim, -0.10, 0.0), (0.42, 0.62, 0.52))
    image[:, 126:130] = 0.08
    image[128:140, 108:118] = np.array((0.72, 0.58, 0.25))
    return image


def awning() -> Array:
    """Striped canvas, across the width."""
    x = np.arange(256)
    stripes = np.where((x // 32) % 2 == 0, 0.0, 1.0)[None, :, None]
    return np.repeat(
        stripes * np.array((0.88, 0.84, 0.74)) + (1 - stripes) * np.array((0.55, 0.10, 0.10)),
        256,
        axis=0,
    )


def signs() -> Array:
    """Eight fascia boards, the first at the top, each eight times as wide as it is high."""
    image = np.zeros((512, 512, 3))
    for row, (text, ground) in enumerate(zip(SIGNS, _SIGN_GROUNDS, strict=True)):
        board = image[64 * row : 64 * row + 64]
        board[:] = ground
        board[[4, 5, 58, 59], 6:506] = np.array((0.80, 0.66, 0.30))
        mask = text_mask(text, 5)
        left = (512 - mask.shape[1]) // 2
        board[14 : 14 + mask.shape[0], left : left + mask.shape[1]][mask] = (1.0, 0.95, 0.82)
    return image


def poster() -> Array:
    """A theatre bill for the advertising column, shown three times around it."""
    image = np.zeros((256, 512, 3))
    y, x = np.mgrid[0:256, 0:512]
    image[:] = (0.92, 0.86, 0.70)
    sun = np.hypot((x % 170) - 85, y - 150) < 60
    image[sun] = (0.85, 0.30, 0.12)
    image[(y > 150) & sun] = (0.60, 0.16, 0.14)
    for cell in range(3):
        for text, top, scale in (("NUIT", 22, 5), ("BLANCHE", 64, 3), ("OPERA", 222, 3)):
            mask = text_mask(text, scale)
            left = 170 * cell + (170 - mask.shape[1]) // 2
            image[top : top + mask.shape[0], left : left + mask.shape[1]][mask] = (0.10, 0.12, 0.28)
    return image


def plate() -> Array:
    """A number plate."""
    image = np.full((64, 256, 3), 0.86)
    image[:, :24] = (0.10, 0.20, 0.55)
    image[:, 232:] = (0.10, 0.20, 0.55)
    mask = text_mask("HD-042-RV", 3)
    image[21 : 21 + mask.shape[0], 47 : 47 + mask.shape[1]][mask] = 0.05
    return image
