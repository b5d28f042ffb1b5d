"""Where shadows fall: against geometry, from centimetres to hundreds of metres.

A texel of a tile is 2 tan(half angle) / cell of the distance: ``texel``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shadow_scenes import along, draw, edge, maps, plane, scene, seen, slab
from small_scenes import look

LAMP = {"position": (0.0, 0.0, 4.0), "intensity": 800.0, "radius": 0.05}
SPOT = LAMP | {"inner": 0.9, "outer": 1.0}
SUN = {"position": (0.6, 0.0, 0.8), "w": 0.0, "intensity": 1000.0}


def texel(lamp: dict[str, Any], distance: float) -> float:
    """m; as shadow_views.py has it, for lamps alone in their atlas."""
    if lamp.get("outer", 4.0) < 1.3:
        return 2 * math.tan(lamp["outer"]) / (2048 - 6) * distance
    return 2 / (1024 - 6) * distance


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("kind", ["cube", "spot"])
def test_the_shadow_of_a_square_has_the_projected_edge(gl: Any, size: float, kind: str) -> None:
    # A square of half side 0.5 at 1.3 below a lamp at 4: its shadow reaches 0.5 * 4 / 2.7.
    lamp = dict(LAMP if kind == "cube" else SPOT)
    lamp |= {"position": (0.0, 0.0, 4.0 * size), "radius": 0.05 * size}
    shown = scene(
        lamp,
        draw(plane(6 * size)),
        draw(plane(0.5 * size, 1.3 * size, "square")),
        camera=look((0, -7 * size, 5 * size), (0, 0, 0), (0, 0, 1)),
    )
    shadows = maps(gl)
    wanted = 0.5 * 4.0 / 2.7 * size
    places = along((0.0, 0.1 * size, 0.0), (1.5 * size, 0.1 * size, 0.0), 1501)
    share = seen(gl, shown, places, shadows=shadows)
    assert abs(edge(places[:, 0], share) - wanted) < texel(lamp, 4.0 * size)
    # Soft over one texel, and nothing else: shadow inside, light outside.
    blur = 1.5 * texel(lamp, 4.0 * size)
    assert np.all(share[places[:, 0] < wanted - blur] == 0.0)
    assert np.all(share[places[:, 0] > wanted + blur] == 1.0)


@pytest.mark.parametrize("lamp", [LAMP, SPOT], ids=["cube", "spot"])
@pytest.mark.parametrize("height", [0.02, 0.3, 8.0])
def test_a_plane_at_grazing_light_has_no_acne(gl: Any, lamp: dict[str, Any], height: float) -> None:
    """Light from as low as 0.3 degrees: cos(theta) 0.005 at 8 m / 1600 m and less."""
    lamp = lamp | {"position": (0.0, 0.0, height), "radius": 0.001, "axis": (0.9, 0.0, -0.436)}
    shown = scene(lamp, draw(plane(1600.0)), draw(slab((0, 0, 20), (1, 1, 21))))
    far = 200.0 * height
    share = seen(gl, shown, along((0.01 * height, 0.0, 0.0), (far, 0.3 * far, 0.0), 4001))
    assert np.all(share == 1.0)


def test_a_plane_three_kilometres_below_has_no_acne(gl: Any) -> None:
    """Where 24 bits of 1 - near / distance are coarser than the texels."""
    lamp = LAMP | {"position": (0.0, 0.0, 3000.0)}
    shown = scene(lamp, draw(plane(1600.0)), draw(slab((0, 0, 20), (1, 1, 21))))
    share = seen(gl, shown, along((10.0, 50.0, 0.0), (1500.0, 900.0, 0.0), 4001))
    assert np.all(share == 1.0)


@pytest.mark.parametrize("tilt", [0.0, 0.4, 0.9, 1.3, 1.5])
def test_tilted_planes_have_no_acne(gl: Any, tilt: float) -> None:
    # Planes in all directions through a point 3 m from the lamp, over several cube faces.
    normal = np.array([math.sin(tilt), 0.3 * math.sin(tilt), math.cos(tilt)])
    normal /= np.linalg.norm(normal)
    u = np.cross(normal, (0.0, 1.0, 0.0))
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    m = np.eye(4)
    m[:3, :3] = 8.0 * u, 8.0 * v, normal
    m[3, :3] = 0.0, 0.0, 1.0
    square = draw(plane(1.0), 0, m)
    t = np.linspace(-7.9, 7.9, 61)
    x, y = (a.ravel()[:, None] for a in np.meshgrid(t, t))
    points = x * u + y * v + (0.0, 0.0, 1.0)
    lit = (np.array([0.0, 0.0, 4.0]) - points) @ normal > 0.0
    share = seen(gl, scene(LAMP, square), points[lit], tuple(normal))
    assert np.all(share == 1.0)


def test_a_kerb_under_a_street_lamp_has_its_shadow(gl: Any) -> None:
    """A lamp 8 m up, a kerb 0.15 m high whose edge is 6 m away: shadow of 6 * 0.15 / 7.85 m."""
    lamp = LAMP | {"position": (0.0, 0.0, 8.0), "intensity": 8000.0}
    shown = scene(lamp, draw(plane(60.0)), draw(slab((5.7, -20, 0), (6.0, 20, 0.15))))
    end = 6.0 * 8.0 / 7.85
    places = along((6.001, 0.5, 0.0), (6.3, 0.5, 0.0), 300)
    share = seen(gl, shown, places)
    size = texel(lamp, 8.0)
    assert abs(edge(places[:, 0], share) - end) < size
    # The road behind the kerb is dark from the contact on, but for the lift of the point.
    assert np.all(share[(places[:, 0] > 6.0 + 2 * size) & (places[:, 0] < end - 1.5 * size)] == 0)
    # The top of the kerb and the road before it are lit.
    assert np.all(seen(gl, shown, along((5.71, 0.5, 0.15), (5.99, 0.5, 0.15))) == 1.0)
    assert np.all(seen(gl, shown, along((1.0, 0.5, 0.0), (5.69, 0.5, 0.0))) == 1.0)


def test_the_shadow_of_a_post_lies_where_it_should(gl: Any) -> None:
    """A post 5 cm thick, 5 m from a lamp 8 m up; its shadow is 8 / (8 - z) times as far out."""
    lamp = LAMP | {"position": (0.0, 0.0, 8.0)}
    post = slab((4.975, -0.025, 0.0), (5.025, 0.025, 3.0))
    shown = scene(lamp, draw(plane(60.0)), draw(post))
    # On the ground at x = 6 the edges are the rays past the post's near upright edges.
    for x in (5.5, 6.0, 7.0):
        half = 0.025 * x / 4.975
        places = along((x, -0.3, 0.0), (x, 0.3, 0.0), 1201)
        share = seen(gl, shown, places)
        dark = places[share < 0.5, 1]
        size = texel(lamp, 8.0)
        assert abs(dark.min() + half) < 2 * size
        assert abs(dark.max() - half) < 2 * size


@pytest.mark.parametrize("lamp", [LAMP, SPOT], ids=["cube", "spot"])
def test_a_shadow_begins_at_its_caster(gl: Any, lamp: dict[str, Any]) -> None:
    """No peter-panning: a box on the floor; light leaks in over two texels at most."""
    box = slab((1.0, -0.5, 0.0), (1.4, 0.5, 0.5))
    shown = scene(lamp, draw(plane(6.0)), draw(box))
    places = along((1.4, 0.0, 0.0), (1.5, 0.0, 0.0), 401)
    share = seen(gl, shown, places)
    assert np.all(share[places[:, 0] > 1.4 + 2 * texel(lamp, 4.0)] == 0.0)


def test_a_distant_light_casts_parallel_shadows(gl: Any) -> None:
    """Elevation tan = 4/3: a square 2 m up lies 1.5 m to the side, same size."""
    shown = scene(
        SUN | {"position": (0.6, 0.0, 0.8)},
        draw(plane(50.0)),
        draw(plane(0.5, 2.0, "square")),
        camera=look((0, -7, 5), (0, 0, 0), (0, 0, 1), half=0.5),
    )
    places = along((-3.0, 0.1, 0.0), (0.0, 0.1, 0.0), 3001)
    share = seen(gl, shown, places)
    dark = places[share < 0.5, 0]
    # The first map holds the ball around the view up to reach / 64; the next are 4 times coarser.
    assert abs(dark.min() + 2.0) < 0.04
    assert abs(dark.max() + 1.0) < 0.04
    assert np.all(share[np.abs(places[:, 0] + 1.5) < 0.46] == 0.0)
    assert np.all(share[np.abs(places[:, 0] + 1.5) > 0.54] == 1.0)


def test_a_distant_light_leaves_a_plane_without_acne(gl: Any) -> None:
    low = math.radians(2.0)
    sun = SUN | {"position": (math.cos(low), 0.0, math.sin(low))}
    shown = scene(
        sun,
        draw(plane(400.0)),
        draw(slab((0, 0, 30), (1, 1, 31))),
        camera=look((0, -7, 5), (0, 30, 0), (0, 0, 1), half=0.5),
    )
    share = seen(gl, shown, along((-20.0, -5.0, 0.0), (40.0, 300.0, 0.0), 4001))
    assert np.all(share == 1.0)


def test_shadows_come_from_beside_the_view(gl: Any) -> None:
    """A tower behind the camera, 100 m towards the sun, darkens what the camera sees."""
    tower = slab((74.0, -10.0, 0.0), (76.0, 10.0, 120.0))
    shown = scene(
        SUN, draw(plane(200.0)), draw(tower), camera=look((0, -7, 5), (0, 0, 0), (0, 0, 1))
    )
    assert np.all(seen(gl, shown, along((-1.0, -1.0, 0.0), (1.0, 1.0, 0.0))) == 0.0)


def test_the_edge_of_a_distant_shadow_stands_still(gl: Any) -> None:
    """The camera moves and turns; where a point is in the same map it sees the same."""
    places = along((-2.2, 0.1, 0.0), (-1.8, 0.1, 0.0), 401)
    edges = []
    for step in range(6):
        eye = (0.003 * step, -7 + 0.007 * step, 5)
        camera = look(eye, (0.002 * step, 0, 0), (0, 0, 1), half=0.5)
        square = draw(plane(0.5, 2.0, "square"))
        shown = scene(SUN, draw(plane(50.0)), square, camera=camera)
        edges.append(edge(places[:, 0], seen(gl, shown, places)))
    # Float32 of the eye: positions of a few metres and the filter's 8 bits of a 1 cm texel.
    assert np.ptp(edges) < 2e-4


def test_far_from_the_origin_of_the_world(gl: Any) -> None:
    """As over a map's origin: 500 km away a lamp casts the same shadow."""
    away = np.array([5e5, -3e5, 100.0])
    m = np.eye(4)
    m[3, :3] = away
    lamp = LAMP | {"position": (*away[:2], away[2] + 4.0)}
    shown = scene(
        lamp,
        draw(plane(6.0), 0, m),
        draw(plane(0.5, 1.3, "square"), 0, m),
        camera=look((away[0], away[1] - 7.0, away[2] + 5.0), tuple(away), (0, 0, 1)),
    )
    places = along((0.0, 0.1, 0.0), (1.5, 0.1, 0.0), 1501)
    share = seen(gl, shown, places + away)
    assert abs(edge(places[:, 0], share) - 0.5 * 4.0 / 2.7) < texel(LAMP, 4.0)
