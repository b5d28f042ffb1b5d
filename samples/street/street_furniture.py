"""What stands or hangs on the pavement: lamps, signals, bollards, a poster column."""

from __future__ import annotations

import numpy as np
from street_materials import MATERIALS
from street_model import Light, Node
from street_shapes import Kit, Shape

#: High-pressure sodium as a modeller paints it, and the lantern's warmer white.
SODIUM = (1.0, 0.78, 0.45)
WARM_WHITE = (1.0, 0.88, 0.68)

LAMP_HEIGHT = 9.0  # m; the City of Paris' standard height (see photometry.toml)
LAMP_REACH = 2.0  # m from the pole to the lamp
GLASS = (0.60, 0.20)  # m, along and across the head: 0.12 m2 seen from below
LANTERN_HEIGHT = 4.15  # m above the arcade's floor

LUMINAIRE = Light(
    "LuminaireLamp", "spot", SODIUM, cutoff=75.0, exponent=2.0, attenuation=(0.5, 0.05, 0.01)
)
DOWNLIGHT_REACH, DOWNLIGHT_HEIGHT = 0.55, 3.22  # m from the wall, above the pavement

DOWNLIGHT = Light("ShopLamp", "spot", WARM_WHITE, cutoff=70.0, exponent=6.0)
LANTERN = Light(
    "ArcadeLamp", "spot", WARM_WHITE, cutoff=90.0, attenuation=(0.5, 0.1, 0.05)
)  # its roof lets no light upwards


def luminaire() -> Node:
    """Pole, bracket and head; the bracket reaches along +X, the lamp's centre is at LAMP_REACH."""
    kit = Kit(MATERIALS)
    pole = kit["PoleGreen"]
    pole.revolve(
        (
            (0.24, 0.0),
            (0.24, 0.12),
            (0.17, 0.18),
            (0.15, 0.9),
            (0.18, 0.96),
            (0.11, 1.10),
            (0.08, 4.0),
            (0.055, 8.2),
            (0.0, 8.26),
        ),
        8,
    )
    bend = np.linspace(0.0, np.pi / 2.0, 7)
    spine = np.stack((1.55 * (1.0 - np.cos(bend)), 7.9 + 1.22 * np.sin(bend)), axis=1)
    _tube(pole, np.vstack((spine, ((1.75, 9.12),))), 0.038)
    strut = np.array(((0.0, 6.9), (0.55, 7.6), (0.75, 8.65)))
    _tube(pole, strut, 0.02)
    head = kit["PoleGreen"]
    x0, x1 = LAMP_REACH - 0.46, LAMP_REACH + 0.46
    sections = ((x0, 0.05, 9.08, 9.16), (x0 + 0.16, 0.13, 9.03, 9.21), (x1 - 0.2, 0.15, 9.03, 9.20))
    rows = [_section(x, w, low, high) for x, w, low, high in (*sections, (x1, 0.08, 9.03, 9.10))]
    head.grid(np.array(rows)[:, ::-1])
    half, across = GLASS[0] / 2.0, GLASS[1] / 2.0
    a, b = LAMP_REACH - half, LAMP_REACH + half
    kit["LampGlass"].box((a, -across, LAMP_HEIGHT), (b, across, 9.04), "xXyYz")
    return Node("LuminaireModel", meshes=kit.meshes("LuminaireModel"))


def _section(x: float, w: float, low: float, high: float) -> list[tuple[float, float, float]]:
    """A closed ring of nine points, counter-clockwise seen from +X, the last one the first."""
    ring = ((-w, low), (0, low), (w, low), (w, (low + high) / 2), (0.6 * w, high))
    ring = (*ring, (0, high), (-0.6 * w, high), (-w, (low + high) / 2), (-w, low))
    return [(x, y, z) for y, z in ring]


def _tube(shape: Shape, spine: np.ndarray, radius: float) -> None:
    """A six-sided tube around a (k, 2) line of x and z in the plane y = 0."""
    tangent = np.gradient(spine, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    turn = np.linspace(0.0, 2.0 * np.pi, 7)
    side = np.stack((-tangent[:, 1], np.zeros(len(spine)), tangent[:, 0]), axis=1)
    across = np.array((0.0, 1.0, 0.0))
    centre = np.stack((spine[:, 0], np.zeros(len(spine)), spine[:, 1]), axis=1)
    ring = (
        np.cos(turn)[None, :, None] * side[:, None, :] - np.sin(turn)[None, :, None] * across
    ) * radius
    ring[:, -1] = ring[:, 0]
    shape.grid(centre[:, None, :] + ring)


def lantern() -> Node:
    """A hexagonal lantern on a rod from the arcade's ceiling; its origin is the lamp."""
    kit = Kit(MATERIALS)
    kit["LanternGlass"].revolve(((0.0, -0.24), (0.10, -0.24), (0.19, 0.16)), 6)
    kit["Iron"].revolve(((0.20, 0.16), (0.22, 0.18), (0.10, 0.34), (0.03, 0.38), (0.015, 1.21)), 6)
    return Node("LanternModel", meshes=kit.meshes("LanternModel"))


def downlight() -> Node:
    """A can on an arm that reaches from a wall along -X; its origin is the glass."""
    kit = Kit(MATERIALS)
    iron = kit["Iron"]
    iron.revolve(((0.05, -0.01), (0.065, -0.01), (0.065, 0.16), (0.03, 0.20), (0.0, 0.20)), 12)
    iron.box((0.0, -0.012, 0.185), (DOWNLIGHT_REACH, 0.012, 0.21), "yYzZ")
    kit["DownlightGlass"].box((-0.045, -0.045, 0.0), (0.045, 0.045, 0.01), "z")
    return Node("DownlightModel", meshes=kit.meshes("DownlightModel"))


def bollard() -> Node:
    """A cast-iron bollard, 0.95 m high."""
    kit = Kit(MATERIALS)
    profile = ((0.10, 0.0), (0.10, 0.1), (0.07, 0.14), (0.06, 0.72), (0.085, 0.76), (0.085, 0.82))
    kit["Iron"].revolve((*profile, (0.05, 0.92), (0.0, 0.95)), 6)
    return Node("BollardModel", meshes=kit.meshes("BollardModel"))


def bollard_far() -> Node:
    """The bollard as a LOD shows it from afar: a post of four faces."""
    kit = Kit(MATERIALS)
    kit["Iron"].box((-0.06, -0.06, 0.0), (0.06, 0.06, 0.95), "xXyYZ")
    return Node("BollardFar", meshes=kit.meshes("BollardFar"))


_LENSES = (("Red", 2.92), ("Amber", 2.62), ("Green", 2.32))


def _lens(name: str, material: str, z: float) -> Node:
    """A roundel of 200 mm diameter that faces -Y."""
    kit = Kit(MATERIALS)
    kit[material].disc((0.0, -0.165, z), 0.1, 16, "y")
    return Node(name, meshes=kit.meshes(name))


def signal() -> Node:
    """A traffic signal that faces -Y and shows green.

    Its Switch has one child for each aspect, and a child holds all three lenses:
    the one that is lit and the two that are not.
    """
    kit = Kit(MATERIALS)
    kit["PoleGreen"].revolve(((0.09, 0.0), (0.06, 0.3), (0.05, 3.2), (0.0, 3.22)), 8)
    box = kit["SignalHousing"]
    box.box((-0.15, -0.15, 2.15), (0.15, 0.06, 3.09))
    for _, z in _LENSES:
        t = np.linspace(0.0, np.pi, 7)
        rim = np.stack((0.115 * np.cos(t), np.zeros(7), z + 0.115 * np.sin(t)), axis=1)
        hood = np.stack((np.add(rim, (0, -0.16, 0)), np.add(rim, (0, -0.34, 0))))
        box.grid(hood)
        box.grid(hood[::-1])  # its other side
    aspects = []
    for lit in ("Red", "Green"):
        lenses = [
            _lens(f"{name}Lens", f"Signal{name}{'Lit' if name == lit else 'Off'}", z)
            for name, z in _LENSES
        ]
        aspects.append(Node(f"Aspect{lit}", children=lenses))
    switch = Node("SignalAspect", "switch", children=aspects, switch_on=(False, True))
    return Node("SignalModel", meshes=kit.meshes("SignalModel"), children=[switch])


def poster_column() -> Node:
    """An advertising column with a lit drum of posters below a domed cap."""
    kit = Kit(MATERIALS)
    kit["PoleGreen"].revolve(((0.74, 0.0), (0.74, 0.45), (0.68, 0.55), (0.66, 0.62)), 18)
    kit["PosterLit"].revolve(((0.65, 0.62), (0.65, 2.70)), 18)
    cap = ((0.66, 2.70), (0.84, 2.76), (0.84, 2.92), (0.72, 3.0), (0.60, 3.3), (0.36, 3.6))
    kit["PoleGreen"].revolve((*cap, (0.12, 3.75), (0.05, 3.95), (0.0, 4.15)), 18)
    return Node("PosterColumn", meshes=kit.meshes("PosterColumn"))
