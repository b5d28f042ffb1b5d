"""From a dark street through a door into a lit room: 9 s on foot.

At the door the street has about a tenth of a lux, of a lantern far off and the sky. The room
has 500 lx on its table, as EN 12464-1 asks for reading and writing, from two flat lamps.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from eye_stage import EyeStage, Finish
from eye_surfaces import (
    flat,
    grain,
    grainy,
    in_finishes,
    sky,
    street_finish,
    write_picture,
    write_street_textures,
)
from street_cars import ESTATE, car
from street_furniture import lantern
from street_materials import MATERIALS
from street_openings import CORNICE, Opening, WindowStyle, reveal, surround, wall, window
from street_shapes import Kit

SECONDS = 9.0
STREET = 0.03  # lx from everywhere: a town's glow
LANTERN, LANTERN_AT = 12.0, (-7.0, -3.2, 3.6)  # cd to all sides; m from the door

#: The room: x from left to right, y from the facade's inner face to the back wall, ceiling. m
ROOM_X, ROOM_Y, CEILING = (-2.6, 3.6), (0.35, 6.35), 2.8
LAMPS, LAMP_SIZE, LAMP_Z = ((-0.6, 3.6), (1.7, 3.6)), (0.6, 1.2), 2.74  # middles, sides; m
TABLE, TABLE_Z, TASK = (0.5, 4.0), 0.75, 500.0  # its middle and height, m; lx on it
WALLS = 0.5  # mean reflectance of the room

_SOURCE = "500 lx on the table (EN 12464-1: reading, writing) from two flat lamps"


def rectangle_share(x: float, y: float, height: float, size: tuple[float, float]) -> float:
    """E / (pi L) of a flat lamp on a plane below that faces it.

    The lamp's middle is at x, y from the point, ``height`` above it. Each corner adds
    (a / A atan(b / A) + b / B atan(a / B)) / 2 pi, A^2 = a^2 + h^2, B^2 = b^2 + h^2
    (J. R. Howell, A Catalog of Radiation Configuration Factors, B-3).
    """

    def corner(a: float, b: float) -> float:
        far_a, far_b = math.hypot(a, height), math.hypot(b, height)
        return (a / far_a * math.atan(b / far_a) + b / far_b * math.atan(a / far_b)) / math.tau

    x0, x1, y0, y1 = (v + s * e / 2.0 for v, e in zip((x, y), size, strict=True) for s in (-1, 1))
    return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)


def room_light() -> tuple[float, float]:
    """cd/m2 of the lamps, and lx that reach everything from wall to wall, for TASK on the table.

    From wall to wall by the integrating sphere: flux / area R / (1 - R).
    """
    share = sum(
        rectangle_share(x - TABLE[0], y - TABLE[1], LAMP_Z - TABLE_Z, LAMP_SIZE) for x, y in LAMPS
    )
    width, depth = ROOM_X[1] - ROOM_X[0], ROOM_Y[1] - ROOM_Y[0]
    area = 2.0 * (width * depth + CEILING * (width + depth))
    reflected = len(LAMPS) * LAMP_SIZE[0] * LAMP_SIZE[1] / area * WALLS / (1.0 - WALLS)
    luminance = TASK / (math.pi * (share + reflected))
    return luminance, math.pi * luminance * reflected


def write(out: Path) -> Path:
    """The stage and its textures."""
    stage = EyeStage(out / "lit_room.usda", SECONDS)
    write_picture(out / "textures/grain.png", grain())
    names = ("stone_ashlar", "stone_smooth", "pavement", "granite", "asphalt", "plate")
    write_street_textures(out, *names, "window_bare", "window_curtain", "poster")
    luminance, everywhere = room_light()
    # What reaches everything in the room is the stage's ambient light; outside of it little is.
    stage.ambient(everywhere, (1.15, 0.98, 0.75), dome=False)
    outside = STREET / everywhere
    _street(stage, outside)
    _room(stage)
    for index, (x, y) in enumerate(LAMPS):
        stage.rectangle(
            f"Lamp{index}", (x, y, LAMP_Z), LAMP_SIZE, luminance, kelvin=3500.0, source=_SOURCE
        )
    x, y, z = LANTERN_AT
    stage.tree(stage.place("Lantern", LANTERN_AT), in_finishes(lantern(), outside))
    stage.ball("LanternLamp", (x, y, z - 0.05), 0.19, LANTERN, kelvin=3000.0,
               source="0.1 lx at the door")  # fmt: skip
    sky(stage, Finish("NightSky", luminance=0.01, colour=(1.0, 1.0, 1.1), source="a town's glow"))
    walk = ((0.0, 2.8, -8.8), (4.0, 0.35, -2.2), (5.5, 0.0, 0.2), (7.0, 0.0, 1.5), (9.0, 0.0, 2.0))
    look = [(0.0, 17.0), (3.6, 15.0), (5.5, 0.0), (6.5, -4.0), (9.0, -46.0)]
    stage.camera("Walker", [(t, (a, b, 1.65)) for t, a, b in walk], 60.0, heading=look, tilt=-3.0)
    return stage.save()


def _street(stage: EyeStage, share: float) -> None:
    names = ("StoneCream", "Trim", "Pavement", "Kerb", "Asphalt", "Iron", "WoodGreen",
             "WindowDark_Curtain", "WindowDark_Bare")  # fmt: skip
    kit = Kit({name: street_finish(MATERIALS[name], share) for name in names})
    stone, trim = kit["StoneCream"], kit["Trim"]
    door = Opening(-0.55, 0.55, 0.0, 2.2)
    pane = Opening(1.35, 2.65, 0.85, 2.25)
    for hole, bounds in ((door, (-1.0, 1.0, 0.0, 3.3)), (pane, (1.0, 3.0, 0.0, 3.3))):
        wall(stone, bounds, hole)
        reveal(trim, hole, -0.06, 0.35)
        surround(trim, hole, 0.16, 0.06)
    style, low = WindowStyle(1.15, 2.0, 0.5, hood="hood"), WindowStyle(1.15, 1.6, 0.85)
    for index, x in enumerate((-7.0, -5.0, -3.0, 3.0, 5.0, 7.0)):
        dark = "WindowDark_Curtain" if index % 2 else "WindowDark_Bare"
        window(kit, "StoneCream", (x, x + 2.0, 0.0, 3.3), low, dark)
    for index, x in enumerate(np.arange(-9.0, 9.0, 2.0)):
        dark = "WindowDark_Bare" if index % 3 else "WindowDark_Curtain"
        window(kit, "StoneCream", (float(x), float(x) + 2.0, 3.6, 6.8), style, dark)
    trim.box((-9.0, -0.1, 3.3), (9.0, 0.0, 3.6), "yzZ")
    trim.extrude(np.add(CORNICE, (0.0, 6.8)), -9.0, 9.0)
    stone.quad((-9.0, 0.0, 0.0), (-7.0, 0.0, 0.0), (-7.0, 0.0, 3.3), (-9.0, 0.0, 3.3))
    for x, back in ((-9.0, False), (9.0, True)):
        a, b = (8.0, 0.0) if not back else (0.0, 8.0)
        stone.quad((x, a, 0.0), (x, b, 0.0), (x, b, 7.5), (x, a, 7.5))
    kit["WoodGreen"].box((-0.60, -0.62, 0.02), (-0.56, 0.30, 2.18))  # the door, open outwards
    # Fine, since the light from the door changes quickly over them.
    for name, y0, y1, z in (("Pavement", -2.6, 0.36, 0.0), ("Asphalt", -12.0, -2.75, -0.12)):
        x, y = np.linspace(-30.0, 30.0, 41), np.linspace(y0, y1, 9)
        kit[name].grid([[(a, b, z) for a in x] for b in y])
    kit["Kerb"].box((-30.0, -2.75, -0.12), (30.0, -2.6, 0.005), "yZ")
    pole = ((0.07, -0.0), (0.06, 0.3), (0.04, 4.8))
    kit["Iron"].revolve(pole, 10, (LANTERN_AT[0], LANTERN_AT[1] + 0.8, 0.0))
    kit["Iron"].box((LANTERN_AT[0] - 0.02, LANTERN_AT[1] - 0.02, 4.76),
                    (LANTERN_AT[0] + 0.02, LANTERN_AT[1] + 0.8, 4.8))  # fmt: skip
    stage.surfaces(stage.place("Street"), kit.meshes("Street"))
    parked = stage.place("ParkedCar", (-4.6, -3.7, -0.12), heading=-90.0)
    stage.tree(parked, in_finishes(car(ESTATE, "Red"), share))


def _room(stage: EyeStage) -> None:
    each = (
        flat("Plaster", (0.72, 0.69, 0.62)),
        flat("Ceiling", (0.82, 0.82, 0.80)),
        grainy("Parquet", (0.30, 0.19, 0.11), 1.5),
        grainy("Rug", (0.30, 0.08, 0.07), 0.6),
        grainy("Wood", (0.24, 0.15, 0.08), 0.8, roughness=0.45),
        flat("Sofa", (0.10, 0.20, 0.24)),
        flat("Cushion", (0.70, 0.45, 0.12)),
        flat("White", 0.78),
        flat("Pot", (0.45, 0.20, 0.12)),
        flat("Leaf", (0.06, 0.16, 0.05)),
        *(flat(f"Book{i}", c) for i, c in enumerate(
            ((0.45, 0.10, 0.08), (0.08, 0.16, 0.35), (0.55, 0.48, 0.32), (0.10, 0.25, 0.14)))),
        Finish("Poster", texture="poster.png"),
        flat("LampFrame", 0.6),
    )  # fmt: skip
    kit = Kit({finish.name: finish for finish in each})
    (x0, x1), (y0, y1) = ROOM_X, ROOM_Y
    plaster = kit["Plaster"]
    inner = (
        (Opening(-0.55, 0.55, 0.0, 2.2), (-1.0, 1.0)),
        (Opening(1.35, 2.65, 0.85, 2.25), (1.0, 3.0)),
    )
    for hole, (a, b) in inner:
        wall(plaster, (a, b, 0.0, CEILING), hole, y0, back=True)
    for a, b in ((x0, -1.0), (3.0, x1)):
        plaster.quad((b, y0, 0.0), (a, y0, 0.0), (a, y0, CEILING), (b, y0, CEILING))
    plaster.quad((x0, y1, 0.0), (x1, y1, 0.0), (x1, y1, CEILING), (x0, y1, CEILING))
    plaster.quad((x0, y0, 0.0), (x0, y1, 0.0), (x0, y1, CEILING), (x0, y0, CEILING))
    plaster.quad((x1, y1, 0.0), (x1, y0, 0.0), (x1, y0, CEILING), (x1, y1, CEILING))
    kit["Parquet"].quad((x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0))
    kit["Ceiling"].quad((x0, y1, CEILING), (x1, y1, CEILING), (x1, y0, CEILING), (x0, y0, CEILING))
    for low, high in (
        ((x0, y1 - 0.015, 0.0), (x1, y1, 0.09)),
        ((x0, y0, 0.0), (x0 + 0.015, y1, 0.09)),
        ((x1 - 0.015, y0, 0.0), (x1, y1, 0.09)),
    ):
        kit["White"].box(low, high)
    for x, y in LAMPS:
        a, b = LAMP_SIZE[0] / 2.0 + 0.02, LAMP_SIZE[1] / 2.0 + 0.02
        kit["LampFrame"].box((x - a, y - b, LAMP_Z + 0.005), (x + a, y + b, CEILING), "xXyYz")
    kit["Rug"].box((-0.8, 2.9, 0.0), (1.8, 5.1, 0.012), "xXyYZ")
    _table(kit)
    _shelf(kit)
    sofa = kit["Sofa"]
    sofa.box((2.65, 2.3, 0.12), (3.55, 4.7, 0.42))
    sofa.box((3.3, 2.3, 0.42), (3.58, 4.7, 0.85))
    for y in (2.3, 4.5):
        sofa.box((2.65, y, 0.42), (3.5, y + 0.2, 0.62))
    kit["Cushion"].box((3.05, 2.65, 0.44), (3.28, 3.05, 0.80))
    for y, z, tall in ((2.5, 1.25, 0.9), (3.7, 1.35, 0.7)):
        corners = ((x1 - 0.02, y + 0.65, z), (x1 - 0.02, y, z),
                   (x1 - 0.02, y, z + tall), (x1 - 0.02, y + 0.65, z + tall))  # fmt: skip
        kit["Poster"].picture(corners, (0.0, 0.0, 1.0, 1.0))
    kit["Pot"].revolve(((0.12, 0.0), (0.17, 0.34), (0.15, 0.34), (0.0, 0.30)), 14, (-2.1, 5.8, 0.0))
    rng = np.random.default_rng(4)
    for index in range(26):
        turn, up, reach = index * 2.4, 0.55 + 0.9 * rng.random(), 0.25 + 0.3 * rng.random()
        tip = np.array((math.cos(turn), math.sin(turn))) * reach
        side = np.array((-tip[1], tip[0])) * 0.22
        foot, mid, end = (
            (-2.1, 5.8, 0.3),
            np.array((-2.1, 5.8)) + 0.55 * tip,
            np.array((-2.1, 5.8)) + tip,
        )
        leaf = [foot, (*(mid + side), up), (*end, up - 0.05), (*(mid - side), up)]
        kit["Leaf"].faces([leaf, leaf[::-1]])
    stage.surfaces(stage.place("Room"), kit.meshes("Room"))


def _table(kit: Kit) -> None:
    """1.6 m x 0.9 m, with a bowl, a book and four chairs."""
    (x, y), z, wood = TABLE, TABLE_Z, kit["Wood"]
    wood.box((x - 0.8, y - 0.45, z - 0.04), (x + 0.8, y + 0.45, z))
    for a in (-0.72, 0.66):
        for b in (-0.38, 0.32):
            wood.box((x + a, y + b, 0.012), (x + a + 0.06, y + b + 0.06, z - 0.04), "xXyY")
    kit["White"].revolve(
        ((0.06, 0.0), (0.16, 0.08), (0.15, 0.08), (0.0, 0.02)), 20, (x + 0.42, y, z)
    )
    kit["Book1"].box((x - 0.35, y - 0.2, z), (x - 0.13, y + 0.1, z + 0.03))
    kit["White"].box((x - 0.1, y - 0.3, z), (x + 0.11, y, z + 0.002), "Z")
    for a, b, back in ((-0.4, -0.75, -1), (0.4, -0.75, -1), (-0.4, 0.75, 1), (0.4, 0.75, 1)):
        cx, cy = x + a, y + b
        wood.box((cx - 0.21, cy - 0.2, 0.43), (cx + 0.21, cy + 0.2, 0.46))
        for p in (-0.2, 0.16):
            for q in (-0.19, 0.15):
                wood.box((cx + p, cy + q, 0.012), (cx + p + 0.04, cy + q + 0.04, 0.43), "xXyY")
        rear = cy + back * 0.19
        wood.box((cx - 0.21, rear - 0.015, 0.62), (cx + 0.21, rear + 0.015, 0.92))
        for p in (-0.2, 0.17):
            wood.box((cx + p, rear - 0.015, 0.46), (cx + p + 0.03, rear + 0.015, 0.92))


def _shelf(kit: Kit) -> None:
    """Against the back wall, with books."""
    rng, (x0, x1), y = np.random.default_rng(3), (-1.2, 1.9), ROOM_Y[1]
    wood = kit["Wood"]
    for z in (0.1, 0.5, 0.9, 1.3, 1.7, 2.1):
        wood.box((x0, y - 0.3, z - 0.03), (x1, y, z))
    for x in np.linspace(x0, x1 - 0.03, 4):
        wood.box((float(x), y - 0.3, 0.07), (float(x) + 0.03, y, 2.1), "xXy")
    for z in (0.1, 0.5, 0.9, 1.3, 1.7):
        x = x0 + 0.05
        while x < x1 - 0.1:
            thick, tall = 0.02 + 0.035 * rng.random(), 0.2 + 0.12 * rng.random()
            posts = np.linspace(x0, x1 - 0.03, 4)
            near = posts[(posts > x - 0.03) & (posts < x + thick)]
            if len(near):
                x = float(near[0]) + 0.035
            if rng.random() < 0.85:
                low, high = (x, y - 0.25, z), (x + thick, y - 0.02, z + tall)
                kit[f"Book{rng.integers(4)}"].box(low, high, "xXyZ")
            x += thick + 0.003 + (0.12 if rng.random() < 0.08 else 0.0)
