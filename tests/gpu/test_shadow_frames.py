"""Frames of lights that have a size, half hidden: black, penumbra, and lit as without shadows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from shadow_scenes import (
    EDGE,
    HEIGHT,
    STEP,
    draw,
    half_plane,
    plane,
    rect_light,
    rectangle_factor,
    scene,
    segment,
    slab,
)
from small_scenes import Rendered, look, render

from hdrusd.scene import CYLINDER, DISK, SPHERE, Camera, Draw, Material, RenderScene

Array = npt.NDArray[Any]

MATTE = Material(diffuse=(0.5, 0.3, 0.2))
PAINT = Material("ggx", (0.5, 0.3, 0.2), specular=(0.04,) * 3, roughness=0.5)

#: From under the half plane, of the surface from x = -2 to 2.
BELOW = look((0.3, -4.0, 1.0), (0.0, 0.6, 0.0), (0.0, 0.0, 1.0), half=0.42)

WIDE = math.radians(5.0)
LAMPS: dict[str, dict[str, Any]] = {
    "rect": rect_light(),
    "disk": rect_light(shape=DISK, x=(0.6, 0.0, 0.0), y=(0.0, 0.6, 0.0)),
    "sphere": rect_light(shape=SPHERE, radius=0.3),
    "cylinder": rect_light(shape=CYLINDER, x=(1.0, 0.0, 0.0), radius=0.02),
    "rect in a cone": rect_light(inner=0.9, outer=1.2),
    "wide distant": {"position": (0.0, 0.0, 1.0), "w": 0.0, "intensity": 50.0, "angle": WIDE},
}

#: Half of what each fills along x, m.
REACH = {"rect": 0.8, "disk": 0.6, "sphere": 0.31, "cylinder": 1.02, "rect in a cone": 0.8}


def pair(gl: Any, shown: RenderScene) -> tuple[Rendered, Array]:
    """The surface z = 0 in a frame with shadows; the same frame without."""
    whole = render(gl, shown, shadows=False)
    got = render(gl, shown, shadows=True)
    assert np.array_equal(got.surface, whole.surface)
    return got, whole.frame


def behind_the_edge(gl: Any, kind: str, material: Material = MATTE) -> tuple[Array, Array, Array]:
    """Of pixels of the floor: x and y (n,) m, and the share of light that the edge leaves (n,)."""
    shown = scene(
        LAMPS[kind],
        draw(plane(40.0)),
        draw(half_plane()),
        camera=BELOW,
        materials=(material,),
    )
    got, whole = pair(gl, shown)
    floor = got.surface & (np.abs(got.position[..., 2]) < 1e-3) & (whole.max(axis=-1) > 1e-3)
    assert floor.sum() > 600
    share = got.frame[floor] / whole[floor]
    # Of its light and its highlight alike, and in all channels.
    np.testing.assert_allclose(share, share[:, :1] * np.ones(3), atol=1e-5)
    x, y, _ = got.position[floor].T
    return x, y, share[:, 0]


def edge_on_the_light(x: Array) -> Array:
    """Where the ray from x past the edge reaches the height of the light, m."""
    return np.asarray(x * (1.0 - HEIGHT / EDGE))


@pytest.mark.parametrize("material", [MATTE, PAINT], ids=["matte", "ggx"])
@pytest.mark.parametrize("kind", LAMPS)
def test_black_behind_and_whole_before_the_edge(gl: Any, kind: str, material: Material) -> None:
    x, _, share = behind_the_edge(gl, kind, material)
    # A texel and the normal's lift: 3 cm at the surface.
    if kind == "wide distant":
        dark, lit = (x < -EDGE * math.tan(WIDE) - 0.03), (x > EDGE * math.tan(WIDE) + 0.03)
    else:
        cut, margin = edge_on_the_light(x), REACH[kind] + 0.05
        dark, lit = cut > margin, cut < -margin
    assert dark.sum() > 50
    assert lit.sum() > 50
    assert not share[dark].any()
    # The same light by another program: roundings.
    np.testing.assert_allclose(share[lit], 1.0, rtol=3e-6)


@pytest.mark.parametrize("kind", ["rect", "rect in a cone"])
def test_the_penumbra_of_a_rectangle(gl: Any, kind: str) -> None:
    """What the edge leaves of it is a rectangle again."""
    x, y, share = behind_the_edge(gl, kind)
    cut = np.clip(edge_on_the_light(x), -0.8, 0.8)
    sides = (-0.5 - y) / HEIGHT, (0.5 - y) / HEIGHT
    part = rectangle_factor((cut - x) / HEIGHT, (0.8 - x) / HEIGHT, *sides)
    whole = rectangle_factor((-0.8 - x) / HEIGHT, (0.8 - x) / HEIGHT, *sides)
    wrong = np.abs(share - part / whole)
    assert wrong.max() < STEP
    assert math.sqrt(np.mean(wrong[np.abs(cut) < 0.8] ** 2)) < 0.5 * STEP


def test_the_penumbra_of_a_disk(gl: Any) -> None:
    """Its points by cos cos / d^2 on each side of the edge."""
    x, y, share = behind_the_edge(gl, "disk")
    t = (np.arange(128) + 0.5) / 64 - 1.0
    u, v = (0.6 * a.ravel() for a in np.meshgrid(t, t))
    inside = u * u + v * v < 0.36
    u, v = u[inside], v[inside]
    weight = ((u - x[:, None]) ** 2 + (v - y[:, None]) ** 2 + HEIGHT**2) ** -2
    seen = u >= edge_on_the_light(x)[:, None]
    wanted = np.sum(weight * seen, axis=1) / np.sum(weight, axis=1)
    # The spiral has 16 points that are not in rows: the largest gap across is that of the rows.
    assert np.abs(share - wanted).max() < STEP


def test_the_penumbra_of_a_sphere(gl: Any) -> None:
    """The edge cuts a segment off its outline, which is a disk."""
    x, _, share = behind_the_edge(gl, "sphere")
    distance = x * (HEIGHT - EDGE) / np.hypot(x, EDGE)
    assert np.abs(share - segment(-distance / 0.3)).max() < STEP


def test_the_penumbra_of_a_tube(gl: Any) -> None:
    """The integral of cos^4 over the angle at which the rest of a line is seen."""
    x, y, share = behind_the_edge(gl, "cylinder")
    away = np.hypot(HEIGHT, y)

    def integral(end: Array) -> Array:
        u = (end - x) / away
        return np.asarray(u / (2.0 * (1.0 + u * u)) + np.arctan(u) / 2.0)

    cut = np.clip(edge_on_the_light(x), -1.0, 1.0)
    first, middle, last = (integral(e) for e in (-np.ones_like(x), cut, np.ones_like(x)))
    assert np.abs(share - (last - middle) / (last - first)).max() < STEP


def test_the_penumbra_of_a_wide_distant_light(gl: Any) -> None:
    x, _, share = behind_the_edge(gl, "wide distant")
    assert np.abs(share - segment(-x / (EDGE * math.tan(WIDE)))).max() < STEP


def room(kind: str, *more: Draw, camera: Camera, **lamp: Any) -> RenderScene:
    floor, box = draw(plane(8.0)), draw(slab((1.5, 0.5, 0.0), (2.0, 1.0, 0.6)))
    return scene(LAMPS[kind] | lamp, floor, box, *more, camera=camera, materials=(MATTE,))


ABOVE = look((-3.0, -5.0, 2.5), (0.0, 0.5, 0.0), (0.0, 0.0, 1.0), half=0.4)


@pytest.mark.parametrize("kind", LAMPS)
def test_a_lid_under_the_light_makes_it_dark(gl: Any, kind: str) -> None:
    """A slab under all of the light hides it from everything below, faces of a box too."""
    size = 30.0 if kind == "wide distant" else 2.0 * HEIGHT
    lid = slab((-size, -size, HEIGHT - 0.4), (size, size, HEIGHT - 0.35), "lid")
    got, whole = pair(gl, room(kind, draw(lid), camera=ABOVE))
    below = got.surface & (got.position[..., 2] < 1.0)
    assert whole[below].max() > 1.0
    assert not got.frame[below].any()


@pytest.mark.parametrize("kind", LAMPS)
def test_a_light_that_casts_no_shadows_is_the_same(gl: Any, kind: str) -> None:
    got, whole = pair(gl, room(kind, camera=ABOVE, shadow=0))
    assert np.array_equal(got.frame, whole)


@pytest.mark.parametrize("kind", LAMPS)
def test_away_from_the_box_its_shadow_changes_nothing(gl: Any, kind: str) -> None:
    """The shadow of a box of 0.6 m lies within 1.5 m of it; all else is as bright as without."""
    got, whole = pair(gl, room(kind, camera=ABOVE))
    away = np.linalg.norm(got.position[..., :2] - (1.75, 0.75), axis=-1) > 1.5
    free = got.surface & away
    assert free.sum() > 500
    np.testing.assert_allclose(got.frame[free], whole[free], rtol=3e-6)
    assert np.any(got.frame[~away & got.surface] < 0.5 * whole[~away & got.surface])
