"""Ground floors: shopfronts in joinery, and the arcade with its vaulted walk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from street_openings import HOOD, Opening, rectangle, reveal, surround, wall
from street_pictures import SIGNS
from street_shapes import Kit

#: What each sign's shop shows in its window.
_WINDOW = {
    "BOULANGERIE": "Cafe",
    "LIBRAIRIE": "Books",
    "CAFE DU PASSAGE": "Cafe",
    "FLEURS": "Fashion",
    "HOTEL LUMIERE": "Cafe",
    "TABAC": "Books",
    "OPTIQUE MICHEL": "Fashion",
    "PHARMACIE": "Fashion",
}

ARCADE_DEPTH = 4.2  # m from the front of the piers to the shops
PIER_DEPTH = 0.8
ARCADE_CEILING = 5.5


@dataclass(frozen=True, slots=True)
class Shop:
    """One bay of shopfront."""

    sign: int  # index into SIGNS
    lit: bool
    joinery: str  # "WoodGreen", "WoodRed", "WoodNavy"
    door: bool
    awning: bool


def shopfront(kit: Kit, shop: Shop, x0: float, x1: float, z: float, y: float) -> float:
    """A shopfront between x0 and x1 on the floor ``z``; returns its top, 3.71 m above.

    The wall above it is the caller's.
    """
    wood = kit[shop.joinery]
    sill, head, fascia = z + 0.55, z + 2.85, z + 3.45
    wood.box((x0, y - 0.12, z), (x0 + 0.28, y, fascia), "xXyZ")
    wood.box((x1 - 0.28, y - 0.12, z), (x1, y, fascia), "xXyZ")
    left = x0 + 0.28
    if shop.door:
        left = x0 + 1.45
        hole = Opening(x0 + 0.28, left, z, z + 2.30)
        bounds = (x0 + 0.28, left, z, head)
        wall(wood, bounds, hole, y)
        reveal(wood, hole, y, y + 0.5, sill=False)
        door = [(hole.left, z), (hole.right, z), (hole.right, z + 2.3), (hole.left, z + 2.3)]
        kit["Door"].picture([(a, y + 0.45, b) for a, b in door], (0.0, 0.0, 1.0, 1.0))
    hole = Opening(left + 0.08, x1 - 0.36, sill, head - 0.08)
    wall(wood, (left, x1 - 0.28, z, head), hole, y)
    reveal(wood, hole, y, y + 0.22)
    wood.box((left + 0.14, y - 0.04, z + 0.12), (x1 - 0.42, y, sill - 0.10), "xXyZ")
    name = SIGNS[shop.sign]
    pane = kit[f"ShopLit_{_WINDOW[name]}" if shop.lit else "ShopDark"]
    a, b, low, high = hole.left, hole.right, hole.bottom, hole.springing
    share = 0.5 * (b - a) / (2.0 * (high - low))  # of the picture's 2 : 1, keeping its shape
    corners = ((a, y + 0.2, low), (b, y + 0.2, low), (b, y + 0.2, high), (a, y + 0.2, high))
    pane.picture(corners, (0.5 - share, 0.0, 0.5 + share, 1.0))
    middle = (a + b) / 2.0
    wood.box((middle - 0.03, y + 0.12, low), (middle + 0.03, y + 0.2, high), "xXy")
    wood.box((a, y + 0.12, high - 0.45), (b, y + 0.2, high - 0.39), "yzZ")
    _fascia(kit, shop, x0, x1, (head, fascia), y)
    return fascia + 0.26


def _fascia(
    kit: Kit, shop: Shop, x0: float, x1: float, levels: tuple[float, float], y: float
) -> None:
    """The board with the name, the cornice over it, an awning below it, the chemist's cross."""
    low, high = levels
    wood, middle = kit[shop.joinery], (x0 + x1) / 2.0
    wood.box((x0 + 0.28, y - 0.10, low), (x1 - 0.28, y, high), "yzZ")
    half, base, front = 1.6, (low + high) / 2.0 - 0.2, y - 0.115
    board = (
        (middle - half, front, base),
        (middle + half, front, base),
        (middle + half, front, base + 0.4),
        (middle - half, front, base + 0.4),
    )
    row = 1.0 / len(SIGNS)
    t = 1.0 - (shop.sign + 1) * row
    kit["SignLit" if shop.lit else "Sign"].picture(board, (0.0, t, 1.0, t + row))
    wood.extrude(np.add(HOOD, (y, high)), x0, x1)
    if shop.awning:
        canvas, foot = kit["Awning"], low - 0.45
        back, out = y - 0.13, y - 1.25
        u0, u1 = x0 / 1.2, x1 / 1.2
        slope = ((u0, 0.0), (u1, 0.0), (u1, 1.0), (u0, 1.0))
        canvas.quad((x0, out, foot), (x1, out, foot), (x1, back, low), (x0, back, low), slope)
        hem = ((u0, 0.0), (u1, 0.0), (u1, 0.15), (u0, 0.15))
        canvas.quad(
            (x0, out, foot - 0.2), (x1, out, foot - 0.2), (x1, out, foot), (x0, out, foot), hem
        )
    if shop.lit and shop.door and SIGNS[shop.sign] == "PHARMACIE":
        cross, x, z = kit["CrossLit"], x0 + 0.14, high + 0.75
        cross.box((x - 0.05, y - 1.0, z), (x + 0.05, y - 0.2, z + 0.27), "xXyYzZ")
        cross.box((x - 0.05, y - 0.735, z + 0.27), (x + 0.05, y - 0.465, z + 0.535), "xXyYZ")
        cross.box((x - 0.05, y - 0.735, z - 0.265), (x + 0.05, y - 0.465, z), "xXyYz")
        kit["Iron"].box((x - 0.02, y - 0.2, z + 0.1), (x + 0.02, y, z + 0.16), "xXzZ")


def arcade_bay(kit: Kit, x0: float, x1: float, z: float, top: float, stone: str) -> None:
    """One bay of arcade from the floor ``z`` to the wall's ``top``: arch, piers, ceiling.

    A semicircular arch on piers 1.1 m wide, archivolt, keystone, imposts, plinths;
    both faces of the wall, since one walks behind it.
    """
    front, trim = kit[stone], kit["Trim"]
    hole = Opening(x0 + 0.55, x1 - 0.55, z, z + 3.35, (x1 - x0 - 1.1) / 2.0, 12)
    wall(front, (x0, x1, z, top), hole)
    reveal(front, hole, 0.0, PIER_DEPTH, sill=False)
    wall(kit["Trim"], (x0, x1, z, ARCADE_CEILING), hole, PIER_DEPTH, back=True)
    ring = Opening(hole.left, hole.right, hole.springing, hole.springing, hole.rise, 12)
    surround(trim, ring, 0.30, 0.06, inner_edge=True)
    middle, crown = (x0 + x1) / 2.0, hole.top
    trim.box((middle - 0.17, -0.16, crown - 0.05), (middle + 0.17, 0.0, crown + 0.52), "xXyzZ")
    high = hole.springing
    for a, b, side in ((x0, hole.left + 0.06, "X"), (hole.right - 0.06, x1, "x")):
        trim.box((a, -0.09, high - 0.22), (b, PIER_DEPTH + 0.06, high), side + "yYzZ")
        trim.box((a, -0.08, z), (b, PIER_DEPTH + 0.06, z + 0.55), side + "yYZ")
    roof, back = kit["Ceiling"], ARCADE_DEPTH
    corners = ((x0, back, ARCADE_CEILING), (x1, back, ARCADE_CEILING))
    roof.quad(*corners, (x1, PIER_DEPTH, ARCADE_CEILING), (x0, PIER_DEPTH, ARCADE_CEILING))
    rib = ARCADE_CEILING - 0.35
    roof.box((x0 - 0.2, PIER_DEPTH, rib), (x0 + 0.2, back, ARCADE_CEILING), "xXz")


def arcade_shop(kit: Kit, shop: Shop, x0: float, x1: float, z: float) -> None:
    """The shopfront at the back of the arcade and the wall above it."""
    top = shopfront(kit, shop, x0, x1, z, ARCADE_DEPTH)
    rectangle(kit["Ceiling"], x0, x1, top, ARCADE_CEILING, ARCADE_DEPTH)
