"""Where everything stands and how it moves: the whole street as one tree."""

from __future__ import annotations

import numpy as np
from street_buildings import FLOOR, Building, Storey, build
from street_cars import ESTATE, HATCHBACK, SALOON, Design, bonnet, car, headlights
from street_furniture import (
    DOWNLIGHT,
    DOWNLIGHT_HEIGHT,
    DOWNLIGHT_REACH,
    LAMP_HEIGHT,
    LAMP_REACH,
    LANTERN,
    LANTERN_HEIGHT,
    LUMINAIRE,
    bollard,
    bollard_far,
    downlight,
    lantern,
    luminaire,
    poster_column,
    signal,
)
from street_ground import FACADE_LEFT, FACADE_RIGHT, LENGTH, SIDE_STREET, ground
from street_model import UNTURNED, Camera, Light, Node, Path, Quat, Vec3, compose, turn
from street_openings import WindowStyle

DURATION = 4.0  # s: 96 frames at 24 a second
KEYS = 17
LANE_MIDDLE = 1.65  # m from the middle of the road; one drives on the right
EYE = (-0.37, 0.10, 1.30)  # m, the driver's eye from the middle of the own car

_TALL = WindowStyle(1.5, 2.45, 0.35, hood="pediment")
_PLAIN = WindowStyle(1.4, 2.1, 0.55, hood="hood")
_LOW = WindowStyle(1.3, 1.6, 0.65)
_RIVOLI = (Storey(3.6, _TALL, balcony=True), Storey(3.2, _PLAIN), Storey(2.7, _LOW))

_ARCADES = (
    Building("ArcadesCream", 10, "StoneCream", "arcade", _RIVOLI, "mansard", depth=14.0),
    Building("ArcadesGrey", 10, "StoneGrey", "arcade", _RIVOLI, "mansard", depth=14.0),
)


def _rows(count: int, height: float, style: WindowStyle) -> tuple[Storey, ...]:
    return (Storey(height, style),) * count


_NARROW = WindowStyle(1.15, 2.0, 0.5, guard=True)
_ARCHED = WindowStyle(1.3, 2.1, 0.5, rise=0.3, surround=0.16)
_BRICK = WindowStyle(1.2, 1.75, 0.7, rise=0.14, surround=0.12)
_BARE = WindowStyle(1.1, 1.7, 0.7, surround=0.10)
_HOUSES = (
    Building("House1", 6, "StoneCream", "shops", _rows(4, 3.1, _NARROW), "mansard", 8),
    Building("House2", 5, "PlasterOchre", "shops", _rows(3, 2.9, _BARE), "gable", 6),
    Building(
        "House3", 7, "StoneGrey", "shops", (Storey(3.5, _TALL, True), *_rows(3, 3.0, _PLAIN)),
        "mansard", 9,
    ),
    Building("House4", 4, "PlasterRose", "shops", _rows(3, 3.0, _BARE), "gable", 6),
    Building("House5", 6, "Brick", "shops", _rows(4, 2.95, _BRICK), "parapet", 8),
    Building("House6", 7, "StoneCream", "shops", _rows(4, 3.2, _ARCHED), "mansard", 10),
    Building("House7", 5, "PlasterOchre", "shops", _rows(4, 3.0, _NARROW), "gable", 7),
)  # fmt: skip
_PALACE = Building(
    "PalaceBuilding", 12, "StoneCream", "stone", (Storey(3.6, _TALL), *_rows(2, 3.2, _ARCHED)),
    "mansard", lit=0.28,
)  # fmt: skip

#: y of the shopfronts on the right that are lit from above: those of a hotel, a chemist and
#: a coffee house, no awning before them.
_SHOPS_LIT = (30.0, 34.0, 50.0, 54.0, 98.0, 102.0)

#: Parked cars: y, design, paint. On the right they head +Y, on the left -Y.
_PARKED_RIGHT: tuple[tuple[float, Design, str], ...] = (
    (21.0, HATCHBACK, "Blue"),
    (27.0, SALOON, "Silver"),
    (33.5, ESTATE, "Black"),
    (46.0, HATCHBACK, "Red"),
    (63.0, SALOON, "White"),
    (69.5, HATCHBACK, "Green"),
    (83.0, ESTATE, "Silver"),
    (112.0, SALOON, "Blue"),
    (131.0, HATCHBACK, "White"),
)
_PARKED_LEFT: tuple[tuple[float, Design, str], ...] = (
    (16.0, ESTATE, "Green"),
    (29.0, SALOON, "Black"),
    (41.0, HATCHBACK, "White"),
    (54.0, SALOON, "Red"),
    (72.0, ESTATE, "Blue"),
    (108.0, HATCHBACK, "Silver"),
    (122.0, SALOON, "White"),
)


def _buildings() -> Node:
    """Four blocks of arcades, which are two drawn twice; seven houses; a palace across the end."""
    row = Node("Buildings")
    arcades = [build(design, 100 + i, first_sign=3 * i) for i, design in enumerate(_ARCADES)]
    y = 0.0
    for i in range(4):
        place: Vec3 = (FACADE_LEFT, y, 0.0)
        block = arcades[i % 2]
        row.children.append(
            Node(f"Arcades_{i + 1}", "matrix", place, turn("z", 90.0), children=[block])
        )
        y += _ARCADES[i % 2].width
    y = 0.0
    for i, design in enumerate(_HOUSES):
        y += design.width
        place = (FACADE_RIGHT, y, 0.0)
        house = build(design, 200 + i, first_sign=2 * i + 1)
        name = design.name.replace("House", "House_")
        row.children.append(Node(name, "matrix", place, turn("z", -90.0), children=[house]))
    palace = build(_PALACE, 300)
    place = (-_PALACE.width / 2.0, LENGTH + SIDE_STREET, 0.0)
    row.children.append(Node("Palace", "matrix", place, children=[palace]))
    return row


def _luminaires() -> Node:
    """Eight a side, 20 m apart and staggered, each over the edge of the lanes."""
    model, group = luminaire(), Node("Luminaires")
    for i in range(16):
        right = i % 2 == 0
        place: Vec3 = (6.1 if right else -6.1, 5.0 + 10.0 * i, FLOOR)
        name = f"Luminaire_{i + 1:02d}"
        lamp = Node(f"{name}_Lamp", translation=(LAMP_REACH, 0.0, LAMP_HEIGHT), light=LUMINAIRE)
        facing = turn("z", 180.0) if right else UNTURNED
        group.children.append(Node(name, "matrix", place, facing, children=[model, lamp]))
    return group


def _lanterns() -> Node:
    """One in every fourth bay of the arcade."""
    model, group = lantern(), Node("Lanterns")
    for i in range(10):
        name = f"ArcadeLantern_{i + 1:02d}"
        place = (FACADE_LEFT - 2.5, 6.0 + 16.0 * i, FLOOR + LANTERN_HEIGHT)
        lamp = Node(f"{name}_Lamp", light=LANTERN)
        group.children.append(Node(name, "pat", place, children=[model, lamp]))
    return group


def _downlights() -> Node:
    """One before the middle of each shopfront."""
    model, group = downlight(), Node("ShopDownlights")
    for i, y in enumerate(_SHOPS_LIT):
        name = f"ShopDownlight_{i + 1:02d}"
        place = (FACADE_RIGHT - DOWNLIGHT_REACH, y, FLOOR + DOWNLIGHT_HEIGHT)
        lamp = Node(f"{name}_Lamp", light=DOWNLIGHT)
        group.children.append(Node(name, "pat", place, children=[model, lamp]))
    return group


def _furniture() -> Node:
    group = Node("Furniture")
    ends = (60.0, 2000.0)
    post = Node("BollardLOD", "lod", children=[bollard(), bollard_far()], lod_ends=ends)
    for i, y in enumerate(y for y in np.arange(2.5, LENGTH, 5.0) if not 89.0 < y < 99.0):
        group.children.append(
            Node(f"Bollard_{i + 1:02d}", "pat", (-6.0, float(y), FLOOR), children=[post])
        )
    model = signal()
    for name, place, degrees in (
        ("Signal_Right", (6.1, 90.6, FLOOR), 0.0),
        ("Signal_Left", (-6.1, 96.9, FLOOR), 180.0),
    ):
        group.children.append(Node(name, "pat", place, turn("z", degrees), children=[model]))
    column = poster_column()
    group.children.append(Node("PosterColumn_1", "pat", (7.2, 57.0, FLOOR), children=[column]))
    return group


def _parked() -> Node:
    group = Node("ParkedCars")
    for side, cars in ((1.0, _PARKED_RIGHT), (-1.0, _PARKED_LEFT)):
        for y, design, paint in cars:
            facing = UNTURNED if side > 0 else turn("z", 180.0)
            name = f"Parked_{len(group.children) + 1:02d}"
            group.children.append(
                Node(name, "pat", (side * 4.42, y, 0.0), facing, children=[car(design, paint)])
            )
    return group


def _drive(start: Vec3, speed: float, rotation: Quat = UNTURNED) -> Path:
    """Straight along the street from ``start`` at ``speed`` m/s (negative: towards -Y)."""
    times = np.linspace(0.0, DURATION, KEYS)
    positions = np.array(start) + np.outer(speed * times, (0.0, 1.0, 0.0))
    return Path(times, np.round(positions, 3), rotation)


def _traffic() -> list[Node]:
    """The car ahead, the oncoming car, and the bonnet and beams of the own car."""
    own, back = (LANE_MIDDLE, 14.0, 0.0), turn("z", 180.0)
    speed = 40.0 / 3.6
    moving = (
        ("CarAhead", _drive((LANE_MIDDLE, 35.0, 0.0), 1.04 * speed), (SALOON, "Red")),
        ("CarOncoming", _drive((-LANE_MIDDLE, 118.0, 0.0), -speed, back), (HATCHBACK, "Silver")),
    )
    nodes = []
    for name, path, (design, paint) in moving:
        body = [car(design, paint, lit=True), *headlights(name, design)]
        nodes.append(Node(name, "matrix", path=path, children=body))
    front = [bonnet(HATCHBACK, "Blue"), *headlights("OwnCar", HATCHBACK)]
    nodes.append(Node("OwnCar", "matrix", path=_drive(own, speed), children=front))
    eye = (own[0] + EYE[0], own[1] + EYE[1], EYE[2])
    look = turn("x", 90.0)
    nodes.append(Node("Driver", "matrix", path=_drive(eye, speed, look), camera=Camera(50.0)))
    return nodes


def _views() -> list[Node]:
    """The cameras that stand still."""
    overview, low = turn("x", 88.0), compose(turn("z", -1.0), turn("x", 88.0))
    arcade = compose(turn("z", -4.0), turn("x", 91.0))
    return [
        Node("Overview", "matrix", (0.8, 3.0, 6.0), overview, camera=Camera(50.0)),
        Node("ArcadeWalk", "matrix", (-11.2, 2.0, 1.75), arcade, camera=Camera(60.0)),
        Node("WetRoad", "matrix", (-0.6, 57.0, 1.0), low, camera=Camera(32.0)),
    ]


def street() -> Node:
    """The whole scene."""
    sun = Light("SunLight", "directional", (0.9, 0.9, 0.9))
    high = compose(turn("z", 35.0), turn("x", 50.0))  # from behind the right shoulder
    return Node(
        "Street",
        children=[
            Node("Sun", translation=(0.0, 0.0, 50.0), rotation=high, light=sun),
            ground(),
            _buildings(),
            _luminaires(),
            _lanterns(),
            _downlights(),
            _furniture(),
            _parked(),
            *_traffic(),
            *_views(),
        ],
    )
