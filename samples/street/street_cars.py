"""Low-polygon cars: a lofted body with wheel arches, a glass house, wheels, lamps, plates.

A car heads +Y and stands on z = 0 with its middle at the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from street_materials import MATERIALS
from street_model import Array, Light, Node, turn
from street_shapes import Kit, Shape

WHEEL = 0.31  # m, radius
ARCH = 0.37
HEADLAMP = (0.26, 0.14)  # m, width and height of the glass
TAIL_LAMP = (0.22, 0.20)
HEADLAMP_HEIGHT = 0.64  # m above the road

#: The passing beam as a cone with the highest exponent that OpenGL takes, aimed so low that
#: little is left at the horizon; its edge, at 2 % of the axis, does not show on the road.
BEAM_DOWN = 10.6
_BEAM = Light(
    "Headlamp",
    "spot",
    (1.0, 0.95, 0.85),
    cutoff=14.0,
    exponent=128.0,
    attenuation=(0.5, 0.02, 0.002),
)


@dataclass(frozen=True, slots=True)
class Design:
    """The measures of a car, in metres; y from the middle, forward positive."""

    name: str
    length: float
    width: float
    roof: float  # height
    belt: float  # height of the window sill
    cowl: float  # y of the windscreen's foot
    roof_front: float
    roof_rear: float
    tail: float  # y of the rear window's foot
    bonnet: float  # height at the front


HATCHBACK = Design("Hatchback", 3.95, 1.72, 1.47, 0.92, 0.95, 0.30, -1.45, -1.86, 0.70)
SALOON = Design("Saloon", 4.60, 1.80, 1.44, 0.93, 0.92, 0.20, -1.00, -1.72, 0.70)
ESTATE = Design("Estate", 4.45, 1.84, 1.70, 1.02, 1.10, 0.55, -1.80, -2.05, 0.82)


def _wheels(design: Design) -> tuple[float, float]:
    """The rear and front axles' y."""
    return (-design.length / 2.0 + 0.78, design.length / 2.0 - 0.82)


def _half_width(design: Design, y: Array) -> Array:
    """Half the width in plan: nearly straight, drawn in at both ends."""
    return design.width / 2.0 * (1.0 - 0.16 * np.abs(2.0 * y / design.length) ** 8)


def _sections(design: Design) -> Array:
    """(stations, 9, 3) rings over the lower body from the left sill to the right, tail first."""
    rear, front = _wheels(design)
    half = design.length / 2.0
    arch = ARCH * np.cos(np.linspace(np.pi, 0.0, 7))
    ends = (half, half - 0.06, half - 0.25)
    y = np.unique(np.round([*(-e for e in ends), *(rear + arch), *(front + arch), *ends, 0.0], 3))
    low = np.full(len(y), 0.22)
    for axle in (rear, front):
        rise = np.sqrt(np.clip(ARCH**2 - (y - axle) ** 2, 0.0, None))
        low = np.maximum(low, np.where(rise > 0.0, WHEEL + rise, 0.0))
    nose = np.interp(y, (-half, -half + 0.25, half - 0.25, half), (0.10, 0.0, 0.0, 0.10))
    belt = np.interp(
        y,
        (-half, design.tail, design.cowl, half),
        (design.belt - 0.02, design.belt + 0.02, design.belt - 0.02, design.bonnet),
    )
    belt, w = belt - nose, _half_width(design, y)
    middle = np.maximum(0.55, low + 0.03)
    ring = [(-0.96, low), (-1.0, middle), (-0.94, belt), (-0.52, belt + 0.05), (0.0, belt + 0.07)]
    ring += [(-share, z) for share, z in ring[-2::-1]]
    return np.stack([np.stack((share * w, y, z), axis=1) for share, z in ring], axis=1)


def _body(paint: Shape, design: Design) -> None:
    """The lower body, lofted from the tail to the nose and closed at both."""
    points = _sections(design)
    paint.grid(points)
    tail, nose = points[0], points[-1]
    for a, b in ((tail[:5], tail[:3:-1]), (nose[:3:-1], nose[:5])):
        paint.faces(np.stack((a[:-1], b[:-1], b[1:], a[1:]), axis=1))


@cache
def bonnet(design: Design, paint: str) -> Node:
    """What a driver sees of the own car: the body's upper side ahead of the windscreen."""
    kit = Kit(MATERIALS)
    points = _sections(design)
    kit[f"CarPaint{paint}"].grid(points[points[:, 0, 1] > design.cowl - 0.4, 2:7])
    name = f"{design.name}{paint}Bonnet"
    return Node(name, meshes=kit.meshes(name))


def _house_corners(design: Design) -> dict[str, tuple[float, float, float]]:
    """The glass house's right-hand corners: foot and head of windscreen and rear window."""
    front, rear = (
        0.92 * float(w) for w in _half_width(design, np.array((design.cowl, design.tail)))
    )
    head = 0.90 * design.width / 2.0 - 0.17
    return {
        "a": (front, design.cowl, design.belt - 0.02),
        "b": (head, design.roof_front, design.roof - 0.05),
        "c": (head, design.roof_rear, design.roof - 0.05),
        "d": (rear, design.tail, design.belt + 0.02),
    }


def _house(kit: Kit, paint: Shape, design: Design) -> None:
    """Glass all round, then the roof and pillars in paint just outside it."""
    glass = kit["CarGlass"]
    p = _house_corners(design)
    q = {k: (-x, y, z) for k, (x, y, z) in p.items()}
    glass.faces(
        [
            (p["a"], q["a"], q["b"], p["b"]),
            (q["d"], p["d"], p["c"], q["c"]),
            (p["d"], p["a"], p["b"], p["c"]),
            (q["a"], q["d"], q["c"], q["b"]),
        ]
    )
    a, b, c, d = (np.array(p[k]) for k in "abcd")
    pillars = ((0.0, 0.09), (0.44, 0.50), (0.86, 1.0))  # shares of the way from a to d
    for side in (1.0, -1.0):
        mirror = np.array((side, 1.0, 1.0))
        for start, stop in pillars:
            quad = [
                a + (d - a) * start,
                a + (d - a) * stop,
                b + (c - b) * stop,
                b + (c - b) * start,
            ]
            corners = np.add(quad, (0.010, 0.0, 0.0)) * mirror
            paint.faces([corners[::-1] if side > 0 else corners])
        edge = (a, b, b - (0.06, 0, 0), a - (0.07, 0, 0))
        front = np.add(edge, (0.0, 0.012, 0.004))
        paint.faces([(front if side > 0 else (front * mirror)[::-1])])
    w, y0, y1, top = b[0], design.roof_front, design.roof_rear, design.roof
    across = np.array((-w - 0.015, -w, -0.5 * w, 0.0, 0.5 * w, w, w + 0.015))
    drop = np.array((0.08, 0.035, 0.01, 0.0, 0.01, 0.035, 0.08))
    rows = [(y1 - 0.03, 0.06), (y1 + 0.05, 0.015), ((y0 + y1) / 2, 0.0), (y0 - 0.05, 0.015)]
    rows.append((y0 + 0.04, 0.06))
    paint.grid(
        [[(x, y, top - dx - dy) for x, dx in zip(across, drop, strict=True)] for y, dy in rows]
    )


def _wheel(kit: Kit, x: float, y: float) -> None:
    """A tyre with a rim; its outer face is on the side of ``x``."""
    side, half = (1.0, 0.1) if x > 0 else (-1.0, 0.1)
    angle = np.linspace(0.0, 2.0 * np.pi, 13)
    profile = ((-half, WHEEL), (half - 0.03, WHEEL), (half, 0.27))
    rows = [
        np.stack((np.full(13, x + dx), y + r * np.cos(angle), WHEEL + r * np.sin(angle)), axis=1)
        for dx, r in profile
    ]
    points = np.array(rows)
    points[:, -1] = points[:, 0]
    kit["Tyre"].grid(points)
    facing = "X" if side > 0 else "x"
    kit["Tyre"].disc((x + side * half, y, WHEEL), 0.27, 12, facing)
    kit["Rim"].disc((x + side * (half + 0.008), y, WHEEL), 0.20, 12, facing)
    kit["CarTrim"].disc((x + side * (half + 0.014), y, WHEEL), 0.06, 8, facing)


@cache
def _fittings(design: Design) -> Node:
    """Wheels, floor, grille, bumpers, mirrors and plates: the same under every paint."""
    kit = Kit(MATERIALS)
    half, w = design.length / 2.0, design.width / 2.0
    trim = kit["CarTrim"]
    trim.box((-w + 0.24, -half + 0.1, 0.18), (w - 0.24, half - 0.1, 0.60), "xXyYz")
    for axle in _wheels(design):
        for x in (w - 0.12, -w + 0.12):
            _wheel(kit, x, axle)
    front, back = half + 0.012, -half - 0.012
    trim.box((-0.40, half - 0.1, 0.47), (0.40, front, 0.58), "xXYzZ")
    trim.box((-0.62, half - 0.1, 0.24), (0.62, front + 0.02, 0.36), "xXYzZ")
    trim.box((-0.62, back - 0.02, 0.24), (0.62, -half + 0.1, 0.40), "xXyzZ")
    plate = kit["Plate"]
    whole, y = (0.0, 0.0, 1.0, 1.0), front + 0.025
    plate.picture(((0.26, y, 0.36), (-0.26, y, 0.36), (-0.26, y, 0.47), (0.26, y, 0.47)), whole)
    y = back - 0.01
    plate.picture(((-0.26, y, 0.48), (0.26, y, 0.48), (0.26, y, 0.59), (-0.26, y, 0.59)), whole)
    for side in (1.0, -1.0):
        x0, x1 = sorted((side * (0.90 * w - 0.02), side * (w + 0.10)))
        low, y = design.belt + 0.04, design.cowl - 0.28
        trim.box((x0, y - 0.05, low), (x1, y + 0.05, low + 0.13))
    name = f"{design.name}Fittings"
    return Node(name, meshes=kit.meshes(name))


@cache
def _lamps(design: Design, lit: bool) -> Node:
    """Head and tail lamps, their glass lit or not."""
    kit = Kit(MATERIALS)
    state = "Lit" if lit else "Off"
    half, z = design.length / 2.0, HEADLAMP_HEIGHT
    for side in (1.0, -1.0):
        x0, x1 = sorted((side * (0.68 - HEADLAMP[0]), side * 0.68))
        low, high = z - HEADLAMP[1] / 2.0, z + HEADLAMP[1] / 2.0
        head = kit[f"Headlamp{state}"]
        head.box((x0, half - 0.1, low), (x1, half + 0.014, high), "xXYzZ")
        x0, x1 = sorted((side * (0.71 - TAIL_LAMP[0]), side * 0.71))
        tail = kit[f"TailLamp{state}"]
        tail.box((x0, -half - 0.014, 0.64), (x1, -half + 0.1, 0.64 + TAIL_LAMP[1]), "xXyzZ")
    name = f"{design.name}Lamps{state}"
    return Node(name, meshes=kit.meshes(name))


@cache
def _painted(design: Design, paint: str) -> Node:
    kit = Kit(MATERIALS)
    shape = kit[f"CarPaint{paint}"]
    _body(shape, design)
    _house(kit, shape, design)
    name = f"{design.name}{paint}"
    return Node(name, meshes=kit.meshes(name))


@cache
def _far(design: Design, paint: str) -> Node:
    """The car as a LOD shows it from afar: two boxes."""
    kit = Kit(MATERIALS)
    half, w = design.length / 2.0, design.width / 2.0
    kit[f"CarPaint{paint}"].box((-w, -half, 0.2), (w, half, design.belt), "xXyYZ")
    low, high = (
        (-w + 0.12, design.roof_rear, design.belt),
        (w - 0.12, design.cowl - 0.3, design.roof),
    )
    kit["CarGlass"].box(low, high, "xXyYZ")
    name = f"{design.name}{paint}Far"
    return Node(name, meshes=kit.meshes(name))


@cache
def car(design: Design, paint: str, lit: bool = False) -> Node:
    """A car as a LOD: in full up to 90 m, as two boxes beyond."""
    name = f"{design.name}{paint}{'Lit' if lit else ''}"
    full = [_painted(design, paint), _fittings(design), _lamps(design, lit)]
    near = Node(f"{name}Near", children=full)
    return Node(f"{name}LOD", "lod", children=[near, _far(design, paint)], lod_ends=(90.0, 2000.0))


def headlights(owner: str, design: Design) -> list[Node]:
    """The two passing beams of a car, below its node."""
    place = ((-0.55, "Left"), (0.55, "Right"))
    aim = turn("x", 90.0 - BEAM_DOWN)
    y = design.length / 2.0 + 0.03
    return [
        Node(
            f"{owner}_Headlamp{side}",
            translation=(x, y, HEADLAMP_HEIGHT),
            rotation=aim,
            light=_BEAM,
        )
        for x, side in place
    ]
