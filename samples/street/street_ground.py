"""Carriageway, markings, puddles, kerbs, pavements and the arcade's floor.

Markings are cut out of the carriageway and lie in its plane: painted a little
above it, they would flicker at a distance, where the depth buffer is coarse.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from street_buildings import FLOOR
from street_materials import MATERIALS
from street_model import Node
from street_shapes import Kit

LENGTH = 160.0  # m of street, from y = 0
LANE = 3.3  # m, from the middle of the road to the parking strip
KERB = 5.5  # m, from the middle of the road to the kerb
FACADE_LEFT = -9.0  # x of the arcades' front
FACADE_RIGHT = 8.8  # x of the other row
ARCADE_BACK = -13.2
SIDE_STREET = 18.0  # m, width of the street across each end
CROSSING = (92.0, 95.5)  # y of the zebra crossing
STOP_LINES = ((90.0, 0.075, LANE), (97.0, -LANE, -0.075))  # y, from x, to x; 0.5 m wide
DASH = 3.0  # m, dash and gap of the centre line
WATER = 0.004  # m that a puddle stands above the road

#: Strips where water stands, x from and to: the gutters, the wheel tracks of both lanes.
_HOLLOWS = ((-5.42, -4.9), (-2.9, -2.2), (-1.1, -0.4), (0.4, 1.1), (2.2, 2.9), (4.9, 5.42))


def _carriageway(kit: Kit) -> None:
    """One grid of cells; each is asphalt or paint."""
    stripes = np.arange(-KERB + 0.25, KERB, 0.5)
    lines = (-KERB, -LANE - 0.06, -LANE + 0.06, -0.075, 0.075, LANE - 0.06, LANE + 0.06, KERB)
    xs = np.unique(np.round(np.concatenate((stripes, lines)), 3))
    ends = [edge for y, _, _ in STOP_LINES for edge in (y, y + 0.5)]
    ys = np.unique(np.concatenate((np.arange(0.0, LENGTH, DASH), CROSSING, ends, (LENGTH,))))
    y, x = np.meshgrid((ys[:-1] + ys[1:]) / 2.0, (xs[:-1] + xs[1:]) / 2.0, indexing="ij")
    crossing = (y > CROSSING[0]) & (y < CROSSING[1])
    near = (y > STOP_LINES[0][0]) & (y < STOP_LINES[1][0] + 0.5)  # no centre line around it
    striped = np.floor((x + KERB + 0.25) / 0.5).astype(int) % 2 == 1
    paint = crossing & striped & (abs(x) < KERB - 0.2)
    paint |= ~near & (abs(x) < 0.075) & (np.floor(y / DASH).astype(int) % 2 == 0)
    paint |= ~near & (abs(abs(x) - LANE) < 0.06)
    for at, x0, x1 in STOP_LINES:
        paint |= (y > at) & (y < at + 0.5) & (x > x0) & (x < x1)
    corners = np.stack((*np.meshgrid(xs, ys), np.zeros((len(ys), len(xs)))), axis=2)
    kit["Asphalt"].cells(corners, ~paint)
    kit["Marking"].cells(corners, paint)


def _puddles(kit: Kit) -> None:
    """Water in the gutters and the wheel tracks: long strips with smooth, wandering edges."""
    rng = np.random.default_rng(400)
    along = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 33))  # close together at the ends
    for low, high in _HOLLOWS:
        y = rng.uniform(1.0, 4.0)
        while (end := y + rng.uniform(5.0, 18.0)) < LENGTH - 1.0:
            if end < STOP_LINES[0][0] - 0.5 or y > STOP_LINES[1][0] + 1.0:
                bulge = np.sqrt(1.0 - np.abs(2.0 * along - 1.0) ** 5)
                phase = rng.uniform(0.0, 2.0 * np.pi, 2)
                sway = np.sin(np.multiply.outer((5.0, 11.0), along) + phase[:, None])
                half = bulge * (high - low) * (0.24 + 0.05 * sway[0] + 0.03 * sway[1])
                middle = (low + high) / 2.0 + bulge * (high - low) * 0.05 * sway[0]
                ys, level = y + along * (end - y), np.full(33, WATER)
                sides = [np.stack((x, ys, level), axis=1) for x in (middle - half, middle + half)]
                strip = np.stack((sides[0][:-1], sides[1][:-1], sides[1][1:], sides[0][1:]), axis=1)
                kit["Puddle"].faces(strip)
            y = end + rng.uniform(0.5, 7.0)


def _flat(
    kit: Kit, material: str, x: tuple[float, float], y: tuple[float, float], z: float
) -> None:
    """A level rectangle in cells of at most 8 m, so that light by vertex has something to go by."""
    xs = np.linspace(*x, max(2, round(abs(x[1] - x[0]) / 8.0) + 1))
    ys = np.linspace(*y, max(2, round(abs(y[1] - y[0]) / 8.0) + 1))
    corners = np.stack((*np.meshgrid(xs, ys), np.full((len(ys), len(xs)), z)), axis=2)
    kit[material].cells(corners, np.ones((len(ys) - 1, len(xs) - 1), dtype=bool))


def ground() -> Node:
    """Everything that is walked or driven on."""
    kit = Kit(MATERIALS)
    _carriageway(kit)
    _puddles(kit)
    inner = KERB + 0.28
    section = np.array(((KERB, 0.0), (KERB, 0.10), (KERB + 0.03, FLOOR), (inner, FLOOR)))
    at = np.linspace(0.0, LENGTH, 21)
    for side in (1.0, -1.0):
        points = np.array([[(side * x, y, z) for y in at[:: int(side)]] for x, z in section])
        for low, high in pairwise(points):
            corners = np.stack((low[:-1], low[1:], high[1:], high[:-1]), axis=1)
            kit["Kerb"].faces(corners[:, ::-1])
    full = (0.0, LENGTH)
    _flat(kit, "Pavement", (inner, FACADE_RIGHT + 0.6), full, FLOOR)
    _flat(kit, "Pavement", (FACADE_LEFT + 0.1, -inner), full, FLOOR)
    _flat(kit, "ArcadeFloor", (ARCADE_BACK - 0.5, FACADE_LEFT + 0.1), full, FLOOR)
    for y in ((-SIDE_STREET, 0.0), (LENGTH, LENGTH + SIDE_STREET)):
        _flat(kit, "Asphalt", (-48.0, 48.0), y, 0.0)
    for x in ((ARCADE_BACK, -KERB), (KERB, FACADE_RIGHT)):
        for y, side in ((0.0, "y"), (LENGTH, "Y")):
            kit["Kerb"].box((x[0], y, 0.0), (x[1], y, FLOOR), side)
    return Node("Ground", meshes=kit.meshes("Ground"))
