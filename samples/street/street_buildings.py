"""Whole buildings: ground floor, storeys of windows, cornice, roof, chimneys."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from street_materials import MATERIALS
from street_model import Node
from street_openings import CORNICE, STRING_COURSE, WindowStyle, balcony, rectangle, window
from street_shapes import Kit
from street_shops import ARCADE_DEPTH, Shop, arcade_bay, arcade_shop, shopfront

FLOOR = 0.14  # m, the pavement's height above the road
GROUND = 6.0  # m, top of an arcaded ground floor
BAY = 4.0


@dataclass(frozen=True, slots=True)
class Storey:
    """One storey of windows."""

    height: float
    window: WindowStyle
    balcony: bool = False


@dataclass(frozen=True, slots=True)
class Building:
    """A building's design. Its facade is ``bays`` times BAY wide and begins at x = 0."""

    name: str
    bays: int
    wall: str
    ground: str  # "arcade", "shops", "stone"
    storeys: tuple[Storey, ...]
    roof: str  # "mansard", "gable", "parapet"
    axes: int = 0  # windows in a storey; 0: one a bay
    depth: float = 13.0
    lit: float = 0.36  # share of the windows with a light behind them

    @property
    def width(self) -> float:
        """Metres of street front."""
        return self.bays * BAY


def _pane(rng: np.random.Generator, lit: float) -> str:
    if rng.random() < lit:
        return "WindowLit_Warm" if rng.random() < 0.75 else "WindowLit_Cool"
    return "WindowDark_Curtain" if rng.random() < 0.55 else "WindowDark_Bare"


def _shop(rng: np.random.Generator, bay: int, first: int, joinery: str) -> Shop:
    return Shop(
        sign=(first + bay // 2) % 8,
        lit=bool(rng.random() < 0.75),
        joinery=joinery,
        door=bay % 2 == 0,
        awning=False,
    )


def _ground_floor(kit: Kit, design: Building, rng: np.random.Generator, first_sign: int) -> float:
    """Build the ground floor; returns the height of its top."""
    joinery = ("WoodGreen", "WoodNavy", "WoodRed")
    if design.ground == "arcade":
        for bay in range(design.bays):
            x0, x1 = bay * BAY, (bay + 1) * BAY
            arcade_bay(kit, x0, x1, FLOOR, GROUND, "StoneRusticated")
            wood = joinery[(bay // 2 + first_sign) % 3]
            arcade_shop(kit, _shop(rng, bay, first_sign, wood), x0, x1, FLOOR)
        return GROUND
    top = FLOOR + 4.4
    for bay in range(design.bays):
        x0, x1 = bay * BAY, (bay + 1) * BAY
        if design.ground == "stone":
            style = WindowStyle(1.4, 2.4, 1.0, 0.25)
            bounds = (x0, x1, 0.0, top)
            window(kit, "StoneRusticated", bounds, style, _pane(rng, design.lit))
            continue
        shop = _shop(rng, bay, first_sign, joinery[(bay // 2 + first_sign) % 3])
        if shop.lit and (bay // 2 + first_sign) % 3 == 2:
            shop = Shop(shop.sign, shop.lit, shop.joinery, shop.door, awning=True)
        pier = 0.22
        kit["StoneRusticated"].box((x0, -0.04, 0.0), (x0 + pier, 0.0, top), "xXyZ")
        kit["StoneRusticated"].box((x1 - pier, -0.04, 0.0), (x1, 0.0, top), "xXyZ")
        high = shopfront(kit, shop, x0 + pier, x1 - pier, FLOOR, 0.0)
        rectangle(kit[design.wall], x0, x1, high, top, 0.0)
    return top


def _storeys(kit: Kit, design: Building, rng: np.random.Generator, z: float) -> float:
    """Stack the storeys on ``z``; returns the top of the wall."""
    count = design.axes or design.bays
    step = design.width / count
    for level, storey in enumerate(design.storeys):
        for i in range(count):
            bounds = (i * step, (i + 1) * step, z, z + storey.height)
            window(kit, design.wall, bounds, storey.window, _pane(rng, design.lit))
        if level > 0:
            kit["Trim"].extrude(np.add(STRING_COURSE, (0.0, z - 0.15)), 0.0, design.width)
        if storey.balcony:
            balcony(kit, 0.2, design.width - 0.2, z + storey.window.sill - 0.02)
        z += storey.height
    return z


def _dormer(kit: Kit, x: float, z: float, pane: str) -> None:
    """A dormer window 1.5 m wide that stands on the cornice, its front at y = 0.35."""
    a, b, y, high = x - 0.75, x + 0.75, 0.35, z + 2.1
    trim, zinc = kit["Trim"], kit["Zinc"]
    low = z + 0.35
    frame = ((a, a + 0.22), (b - 0.22, b))
    for left, right in frame:
        trim.box((left, y, z), (right, y + 0.14, high), "xXy")
    rectangle(trim, a + 0.22, b - 0.22, z, low, y)
    corners = ((a + 0.22, y + 0.1, low), (b - 0.22, y + 0.1, low))
    above = ((b - 0.22, y + 0.1, high), (a + 0.22, y + 0.1, high))
    kit[pane].picture((*corners, *above), (0.0, 0.0, 1.0, 1.0))
    back = 1.55
    zinc.faces(
        [
            ((a, back, z), (a, y, z), (a, y, high), (a, back, high)),
            ((b, y, z), (b, back, z), (b, back, high), (b, y, high)),
            ((a - 0.08, y - 0.12, high), (x, y - 0.12, high + 0.42), (x, back, high + 0.42),
             (a - 0.08, back, high)),
            ((x, y - 0.12, high + 0.42), (b + 0.08, y - 0.12, high), (b + 0.08, back, high),
             (x, back, high + 0.42)),
        ]
    )  # fmt: skip
    trim.faces(
        [((a - 0.08, y - 0.12, high), (b + 0.08, y - 0.12, high), (x, y - 0.12, high + 0.42))]
    )


def _mansard(kit: Kit, design: Building, rng: np.random.Generator, z: float) -> float:
    """A steep slate slope with dormers, a flat zinc top; returns the ridge's height."""
    w, d = design.width, design.depth
    z += 0.72
    top, ridge = z + 3.0, z + 3.9
    slate, zinc = kit["Slate"], kit["Zinc"]
    slate.quad((0.0, 0.2, z), (w, 0.2, z), (w, 1.4, top), (0.0, 1.4, top))
    slate.quad((w, d - 0.2, z), (0.0, d - 0.2, z), (0.0, d - 1.4, top), (w, d - 1.4, top))
    zinc.quad((0.0, -0.6, z), (w, -0.6, z), (w, 0.2, z), (0.0, 0.2, z))
    zinc.quad((0.0, 1.4, top), (w, 1.4, top), (w, d / 2, ridge), (0.0, d / 2, ridge))
    zinc.quad((w, d - 1.4, top), (0.0, d - 1.4, top), (0.0, d / 2, ridge), (w, d / 2, ridge))
    for bay in range(design.bays):
        _dormer(kit, (bay + 0.5) * BAY, z, _pane(rng, design.lit))
    for x, flip in ((0.0, False), (w, True)):
        lower = [(x, d - 0.2, z), (x, 0.2, z), (x, 1.4, top), (x, d - 1.4, top)]
        upper = [(x, d - 1.4, top), (x, 1.4, top), (x, d / 2, ridge)]
        kit["PartyWall"].faces([lower[::-1] if flip else lower])
        kit["PartyWall"].faces([upper[::-1] if flip else upper])
    return ridge


def _gable(kit: Kit, design: Building, z: float) -> float:
    """A pitched slate roof along the street; returns the ridge's height."""
    w, d = design.width, design.depth
    z += 0.72
    ridge = z + 3.4
    slate = kit["Slate"]
    slate.quad((0.0, -0.62, z), (w, -0.62, z), (w, d / 2, ridge), (0.0, d / 2, ridge))
    slate.quad((w, d, z), (0.0, d, z), (0.0, d / 2, ridge), (w, d / 2, ridge))
    end = kit[design.wall]
    end.faces([((0.0, d, z), (0.0, -0.62, z), (0.0, d / 2, ridge))])
    end.faces([((w, -0.62, z), (w, d, z), (w, d / 2, ridge))])
    return ridge


def _parapet(kit: Kit, design: Building, z: float) -> float:
    """A flat roof behind a parapet with a coping; returns the parapet's height."""
    w, d = design.width, design.depth
    z += 0.72
    top = z + 0.9
    rectangle(kit[design.wall], 0.0, w, z, top, 0.0)
    kit["Trim"].box((0.0, -0.1, top), (w, 0.3, top + 0.12), "xXyYzZ")
    rectangle(kit[design.wall], 0.0, w, z, top, 0.3, back=True)
    kit["Zinc"].quad((0.0, 0.3, z), (w, 0.3, z), (w, d, z), (0.0, d, z))
    return top


def _chimneys(kit: Kit, design: Building, wall_top: float, ridge: float) -> None:
    """A stack with three pots at each party wall."""
    for x in (0.5, design.width - 0.5):
        middle, top = design.depth / 2.0 - 2.2, max(ridge, wall_top + 2.0) + 1.0
        kit["Brick"].box((x - 0.3, middle - 1.2, wall_top), (x + 0.3, middle + 1.2, top), "xXyYZ")
        for i in (-1, 0, 1):
            pot = ((0.15, top), (0.12, top + 0.55))
            kit["Chimney"].revolve(pot, 6, (x, middle + 0.7 * i, 0.0))


def build(design: Building, seed: int, first_sign: int = 0) -> Node:
    """The building as a node without a transform, its meshes one a material."""
    kit, rng = Kit(MATERIALS), np.random.default_rng(seed)
    foot = _ground_floor(kit, design, rng, first_sign)
    kit["Trim"].extrude(
        np.add(np.multiply(CORNICE, (0.55, 0.6)), (0.0, foot - 0.35)), 0.0, design.width
    )
    top = _storeys(kit, design, rng, foot)
    kit["Trim"].extrude(np.add(CORNICE, (0.0, top)), 0.0, design.width)
    for x in np.arange(0.3, design.width - 0.2, 0.8):  # dentils below the cornice
        kit["Trim"].box((x, -0.36, top + 0.24), (x + 0.2, -0.1, top + 0.42), "xXyz")
    if design.roof == "mansard":
        ridge = _mansard(kit, design, rng, top)
    elif design.roof == "gable":
        ridge = _gable(kit, design, top)
    else:
        ridge = _parapet(kit, design, top)
    _chimneys(kit, design, top, ridge)
    w, d, high = design.width, design.depth, top + 0.72
    side = kit["PartyWall"]
    walk = ARCADE_DEPTH if design.ground == "arcade" else 0.0  # one walks through the arcade
    for low_z, high_z, y in ((0.0, foot, walk), (foot, high, 0.0)):
        side.quad((0.0, d, low_z), (0.0, y, low_z), (0.0, y, high_z), (0.0, d, high_z))
        side.quad((w, y, low_z), (w, d, low_z), (w, d, high_z), (w, y, high_z))
    side.quad((w, d, 0.0), (0.0, d, 0.0), (0.0, d, high), (w, d, high))
    return Node(design.name, meshes=kit.meshes(design.name))
