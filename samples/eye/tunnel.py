"""By day into a tunnel and out again: 10 s at 90 km/h.

Outside the road has 5000 cd/m2. Inside it follows CIE 88 for 5 % of that and t seconds of
driving: the threshold zone's L_th, falling from its middle to 0.4 L_th, then
L_th (1.9 + t)^-1.4. The threshold zone is 60 m long here, where one stopping distance
(100 m and more at 90 km/h) is asked for, so that the film is short.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from eye_stage import EyeStage, Finish
from eye_surfaces import (
    conifers,
    dashes,
    day_sky,
    finishes,
    flat,
    grain,
    grainy,
    in_finishes,
    portal_share,
    sky,
    write_picture,
    write_street_textures,
)
from pxr import UsdLux
from street_cars import SALOON, car
from street_openings import Opening, wall
from street_shapes import Kit, Shape

SECONDS, SPEED = 10.0, 25.0  # s, m/s
START, END = 40.0, 210.0  # y of the portals, m
EYE = (1.5, 0.0, 1.3)

#: Of a concrete road. E rho / pi = 5093 cd/m2 under SUN sin(ELEVATION) + SKY = 80 klx.
ROAD = 0.2
SUN, ELEVATION, SKY = 77_860.0, 50.4, 20_000.0  # lx facing it, degrees, lx
ACCESS = 5000.0  # cd/m2 of the road before the portal
THRESHOLD = 0.05 * ACCESS  # L_th; Orden Circular 36/2015, table 2.4: class 3, stops in 100 m
INTERIOR = 6.0  # cd/m2; CIE 88:2004, unconfirmed: long tunnel with moderate traffic

ZONE = 60.0  # m, threshold zone
SEGMENT, WIDTH, HEIGHT = 10.0, 0.6, 5.6  # m: lamps along, across, up; over the middle of the road
SPRINGING, RISE, HALF = 3.0, 3.0, 5.0  # m: of the vault
PERIMETER = 2.0 * HALF + 2.0 * SPRINGING + 12.0  # m, the arc being about 12
WALLS = 0.3  # mean reflectance of all that

_SOURCE = "luminance of the road by CIE 88:2004, E = pi L / rho, a strip of lamps along the crown"


def wanted_luminance(depth: float) -> float:
    """cd/m2 of the road ``depth`` m behind the portal."""
    if depth <= 0.5 * ZONE:
        return THRESHOLD
    if depth <= ZONE:
        return THRESHOLD * (1.0 - 0.6 * (2.0 * depth / ZONE - 1.0))
    seconds = (depth - ZONE) / SPEED
    return max(THRESHOLD * (1.9 + seconds) ** -1.4, INTERIOR)


def strip_share() -> float:
    """E / (pi L) of an endless strip on the middle of the road.

    Seen between the angles -a and a from the zenith it gives E = pi L sin a.
    """
    return math.sin(math.atan(WIDTH / 2.0 / HEIGHT))


def reflected_share() -> float:
    """Light that goes from wall to wall over light that comes straight, on the road's middle.

    By the integrating sphere: the flux of a metre of tunnel, pi L w, on its perimeter, times
    R / (1 - R).
    """
    flux = math.pi * WIDTH / PERIMETER
    return flux * WALLS / (1.0 - WALLS) / (math.pi * strip_share())


def strip_luminance(road: float) -> float:
    """cd/m2 of an endless strip that gives the road's middle ``road`` cd/m2 in all."""
    return road / (ROAD * strip_share() * (1.0 + reflected_share()))


def diffuse_share(texels: int = 1024) -> np.ndarray:
    """Light from everywhere along the tunnel over that of the open sky: portals and walls."""
    depth = (np.arange(texels) + 0.5) / texels * (END - START)
    both = (depth, END - START - depth)
    portals = sum(portal_share(d, 2.0 * HALF, SPRINGING + RISE) for d in both)
    road = np.array([wanted_luminance(d) for d in depth])
    share = reflected_share() / (1.0 + reflected_share())
    return portals + share * math.pi * road / ROAD / SKY


def write(out: Path) -> Path:
    """The stage and its textures."""
    stage = EyeStage(out / "tunnel.usda", SECONDS)
    write_picture(out / "textures/grain.png", grain())
    write_picture(out / "textures/day_sky.png", day_sky())
    write_picture(out / "textures/daylight.exr", np.tile(diffuse_share(), (4, 1)))
    write_street_textures(out, "plate")

    _outside(stage)
    _inside(stage)
    stage.ambient(SKY, (0.85, 1.0, 1.15))
    backdrop = Finish("DaySky", texture="day_sky.png", luminance=12_000.0, source="clear sky")
    beyond = sky(stage, backdrop)
    sun = stage.distant(
        "Sun", -35.0, ELEVATION, SUN, kelvin=5500.0,
        source="60 klx on the road; with 20 klx of the sky 5093 cd/m2 on concrete of 0.2",
    )  # fmt: skip
    UsdLux.LightAPI(sun).GetShadowLinkCollectionAPI().CreateExcludesRel().AddTarget(beyond)
    for index, y in enumerate(np.arange(START, END, SEGMENT) + SEGMENT / 2.0):
        stage.rectangle(
            f"Strip/Lamp{index:02d}", (0.0, float(y), HEIGHT), (WIDTH, SEGMENT),
            strip_luminance(wanted_luminance(float(y) - START)), kelvin=5000.0, shadows=False,
            source=_SOURCE,
        )  # fmt: skip
    path = [(t, (EYE[0], SPEED * t, EYE[2])) for t in (0.0, SECONDS)]
    stage.camera("Driver", path, 60.0)
    ahead = [(t, (EYE[0] + 0.2, SPEED * t + 32.0, 0.0)) for t in (0.0, SECONDS)]
    stage.tree(stage.place("CarAhead", ahead), in_finishes(car(SALOON, "Red", lit=True)))
    return stage.save()


def _road(road: Shape, paint: Shape, y0: float, y1: float) -> None:
    road.quad((-3.75, y0, 0), (3.75, y0, 0), (3.75, y1, 0), (-3.75, y1, 0))
    for x in (-3.5, 3.5):
        dashes(paint, x, y0, y1, y1 - y0, 0.0)
    dashes(paint, 0.0, y0 + 2.0, y1, 3.0, 9.0)


def _outside(stage: EyeStage) -> None:
    kit = finishes(
        grainy("Road", ROAD, 5.0),
        flat("Paint", 0.5),
        grainy("Concrete", (0.36, 0.35, 0.33), 6.0),
        grainy("Grass", (0.07, 0.105, 0.035), 9.0),
        grainy("Rock", (0.20, 0.185, 0.165), 14.0),
        grainy("Meadow", (0.10, 0.12, 0.055), 25.0),
        flat("Fir", (0.03, 0.05, 0.025)),
        flat("Steel", 0.35),
    )
    rng = np.random.default_rng(5)
    for y0, y1 in ((-40.0, START), (END, END + 500.0)):
        _road(kit["Road"], kit["Paint"], y0, y1)
        for side in (-1.0, 1.0):
            x0, x1 = sorted((side * 3.75, side * 300.0))
            corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
            kit["Grass"].quad(*((x, y, -0.02) for x, y in corners))
            low, high = sorted((side * 4.6, side * 4.75))
            kit["Steel"].box((low, y0, 0.45), (high, y1, 0.75), "xXzZ")
            for y in np.arange(y0 + 2.0, min(y1, y0 + 80.0), 4.0):
                kit["Steel"].box((low, float(y), 0.0), (high, float(y) + 0.1, 0.45), "xXyY")
    _hill(kit)
    hole = Opening(-HALF, HALF, 0.0, SPRINGING, RISE, 16)
    for y, back in ((START, False), (END, True)):
        wall(kit["Concrete"], (-9.0, 9.0, 0.0, 8.6), hole, y, back)
        kit["Concrete"].box((-9.3, y - 0.5, 8.6), (9.3, y + 0.5, 9.2))
    places = [
        (side * (9.0 + 70.0 * rng.random() ** 1.5), y, 0.0)
        for side in (-1.0, 1.0)
        for y in (*rng.uniform(-20.0, 38.0, 12), *rng.uniform(END + 15.0, END + 260.0, 55))
    ]
    conifers(kit["Fir"], np.array(places), rng)
    on_hill = np.stack((rng.uniform(-80, 80, 60), rng.uniform(START + 6, START + 60, 60)), axis=1)
    heights = [_height(x, y) - 0.3 for x, y in on_hill]
    conifers(kit["Fir"], np.column_stack((on_hill, heights)), rng)
    stage.surfaces(stage.place("Outside"), kit.meshes("Outside"))


def _height(x: float, y: float) -> float:
    """Of the hill; over the portals it is their wall's height."""
    inward = min(y - START, END - y)
    over = 8.5 if abs(x) < 9.5 else 0.0
    rough = 1.5 * math.sin(0.23 * x + 1.0) * math.sin(0.19 * y) * min(inward / 8.0, 1.0)
    return max(over, min(0.9 * inward, 40.0 * (1.0 - math.exp(-inward / 40.0)))) + rough


def _hill(kit: Kit) -> None:
    x = np.array([*np.arange(-120.0, -9.0, 6.0), -9.6, -9.0, -3.0, 3.0, 9.0, 9.6])
    x = np.concatenate([x, -np.arange(-120.0, -9.0, 6.0)[::-1]])
    y = np.linspace(START, END, 46)
    points = [[(a, b, _height(a, b)) for a in x] for b in y]
    for name, rows in (("Rock", points[:5]), ("Meadow", points[4:-4]), ("Rock", points[-5:])):
        kit[name].grid(rows)


def _inside(stage: EyeStage) -> None:
    daylight = {"daylight": "daylight.exr"}
    kit = finishes(
        grainy("RoadInside", ROAD, 5.0, **daylight),
        flat("PaintInside", 0.5, **daylight),
        flat("Panels", (0.52, 0.52, 0.50), **daylight),
        grainy("Vault", 0.30, 5.0, **daylight),
        flat("Joints", 0.18, **daylight),
    )
    _road(kit["RoadInside"], kit["PaintInside"], START, END)
    vault = Opening(-HALF, HALF, 0.0, SPRINGING, RISE, 24).head()[::-1]
    y = np.linspace(START, END, 35)
    kit["Vault"].grid([[(x, b, z) for x, z in vault] for b in y])
    for side in (-1.0, 1.0):
        walk0, walk1 = side * 3.75, side * HALF
        low, high = sorted((walk0, walk1))
        kit["Vault"].quad(
            (low, START, 0.18), (high, START, 0.18), (high, END, 0.18), (low, END, 0.18)
        )
        a, b = (START, END) if side < 0 else (END, START)
        for y in (START, END):
            kit["Vault"].box((low, y - 0.001, 0.0), (high, y + 0.001, 0.18), "yY")
        kit["Vault"].quad((walk0, b, 0.0), (walk0, a, 0.0), (walk0, a, 0.18), (walk0, b, 0.18))
        wall_x = side * (HALF - 0.01)
        kit["Panels"].quad(
            (wall_x, a, 0.18), (wall_x, b, 0.18), (wall_x, b, SPRINGING), (wall_x, a, SPRINGING)
        )
        x = wall_x - side * 0.005
        for y0 in np.arange(START + 4.0, END, 4.0):  # joints between the panels
            c, d = (y0, y0 + 0.05) if side < 0 else (y0 + 0.05, y0)
            kit["Joints"].quad((x, c, 0.18), (x, d, 0.18), (x, d, SPRINGING), (x, c, SPRINGING))
    path = stage.place("Inside")
    stage.surfaces(path, kit.meshes("Inside"), daylight=(START, END))
