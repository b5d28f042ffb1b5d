"""Blended surfaces: which are seen through which, and what is left of what is behind."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import Array, draw, layers, lights, look, quad

from hdrusd.gpu.peeling import MAX_LAYERS
from hdrusd.scene import Draw, ImageData, Material, RenderScene, TextureRef, TextureUse

WALL = Material(emission=(8.0, 8.0, 8.0))


def pane(z: float, material: int, **fields: Any) -> Draw:
    """A sheet across the whole view at a height over the plane z = 0."""
    geometry = quad((-2.0, -2.0, z), (4.0, 0, 0), (0, 4.0, 0), key=f"pane {z} {material}")
    return replace(draw(geometry, material), **fields)


def glass(opacity: float, glow: float, **fields: Any) -> Material:
    options: dict[str, Any] = {"model": "ggx", "blend": True, "diffuse": (0.0, 0.0, 0.0)}
    return Material(opacity=opacity, emission=(glow,) * 3, **(options | fields))


def scene(draws: list[Draw], *materials: Material, **fields: Any) -> RenderScene:
    made = RenderScene(lights=lights(), draws=tuple(draws), materials=materials, camera=look())
    return replace(made, **fields)


def middle(image: Array) -> Array:
    return np.asarray(image[24, 32])


def over(back: float, *panes: tuple[float, float]) -> float:
    """Opacity and glow of panes from back to front, each hiding its share of what is behind."""
    for opacity, glow in panes:
        back = opacity * glow + (1.0 - opacity) * back
    return back


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("moving", [False, True])
def test_order_of_draws_does_not_matter(gl: Any, order: tuple[int, ...], moving: bool) -> None:
    """Two panes before a wall: 0.25 of 2 over 0.5 of 3 over 8 cd/m2."""
    panes = [pane(-1.0, 0), pane(0.0, 1, moving=moving), pane(1.0, 2, moving=moving)]
    made = scene([panes[k] for k in order], WALL, glass(0.5, 3.0), glass(0.25, 2.0))
    found, together, peeling = layers(gl, made)
    assert [round(float(middle(layer["g_normal"])[3]), 5) for layer in found] == [2.0, 3.0]
    np.testing.assert_allclose(middle(together)[:3], over(8.0, (0.5, 3.0), (0.25, 2.0)), rtol=1e-6)
    assert middle(together)[3] == pytest.approx(1.0)
    assert not peeling.truncated


@pytest.mark.parametrize("presence", [False, True])
def test_both_modes_hide_alike_what_is_behind(gl: Any, presence: bool) -> None:
    made = scene([pane(-1.0, 0), pane(0.0, 1)], WALL, glass(0.3, 2.0, presence=presence))
    _, together, _ = layers(gl, made)
    np.testing.assert_allclose(middle(together)[:3], over(8.0, (0.3, 2.0)), rtol=1e-6)


def test_transparent_keeps_the_highlight_whole(gl: Any) -> None:
    """UsdPreviewSurface: "opacity reduces just the contribution of the diffuse component"."""
    clear = glass(0.0, 2.0, diffuse=(0.5, 0.4, 0.3), specular=(0.04,) * 3)
    (layer,), together, _ = layers(gl, scene([pane(-1.0, 0), pane(0.0, 1)], WALL, clear))
    assert middle(layer["g_diffuse"])[:3].tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(middle(layer["g_specular"])[:3], 0.04, rtol=1e-6)
    assert middle(layer["hdr"]).tolist() == [0.0, 0.0, 0.0, 0.0]
    assert middle(together)[:3].tolist() == [8.0] * 3


def test_presence_takes_the_highlight_away_too(gl: Any) -> None:
    """The layer is lit whole, and multiplied when it is complete; absent, it is not there."""
    half = glass(0.5, 2.0, diffuse=(0.5,) * 3, specular=(0.04,) * 3, presence=True)
    (layer,), _, _ = layers(gl, scene([pane(0.0, 0)], half))
    np.testing.assert_allclose(middle(layer["g_diffuse"])[:3], 0.5)
    np.testing.assert_allclose(middle(layer["hdr"]), [2.0, 2.0, 2.0, -0.5])
    found, _, _ = layers(gl, scene([pane(0.0, 0)], replace(half, opacity=0.0)))
    assert found == []


def test_legacy_blending_fades_everything(gl: Any) -> None:
    made = Material(emission=(2.0,) * 3, opacity=0.25, blend=True)
    (layer,), together, _ = layers(gl, scene([pane(-1.0, 0), pane(0.0, 1)], WALL, made))
    assert middle(layer["hdr"])[3] == -0.25
    np.testing.assert_allclose(middle(together)[:3], over(8.0, (0.25, 2.0)), rtol=1e-6)


def test_ambient_light_of_a_blended_surface(gl: Any) -> None:
    made = scene([pane(0.0, 0)], glass(0.25, 0.0, diffuse=(0.8,) * 3), ambient=(10.0,) * 3)
    _, together, _ = layers(gl, made)
    np.testing.assert_allclose(middle(together)[:3], 0.25 * 0.8 * 10.0 / math.pi, rtol=1e-6)
    assert middle(together)[3] == pytest.approx(0.25)


def test_behind_a_wall_nothing_is_blended(gl: Any) -> None:
    found, together, _ = layers(gl, scene([pane(0.0, 0), pane(-1.0, 1)], WALL, glass(0.5, 3.0)))
    assert found == []
    assert middle(together)[:3].tolist() == [8.0] * 3


def test_marking_in_the_plane_of_the_road(gl: Any) -> None:
    """What is painted on a surface lies in it: not half of its pixels, all of them."""
    camera = look((0.4, -2.0, 1.1), half=0.2)
    road = draw(quad((-9.0, -9.0, 0.0), (18.0, 0, 0), (0, 18.0, 0), key="road"), 0)
    paint = draw(quad((-0.3, -2.0, 0.0), (0.7, 0.1, 0), (-0.1, 5.0, 0), key="paint"), 1)
    found, _, _ = layers(gl, scene([road, paint], WALL, glass(0.5, 1.0), camera=camera))
    alone, _, _ = layers(gl, scene([paint], WALL, glass(0.5, 1.0), camera=camera))
    assert len(found) == 1
    assert (alone[0]["hdr"][..., 3] > 0).sum() > 300
    np.testing.assert_array_equal(found[0]["hdr"], alone[0]["hdr"])


def test_crossing_panes_change_places(gl: Any) -> None:
    """Two that cross: each in front on its own side."""
    tilted = [
        draw(quad((-2.0, -2.0, -2.0), (4.0, 0, 4.0), (0, 4.0, 0), key="rising"), 0),
        draw(quad((-2.0, -2.0, 2.0), (4.0, 0, -4.0), (0, 4.0, 0), key="falling"), 1),
    ]
    _, together, _ = layers(gl, scene(tilted, glass(0.5, 1.0), glass(0.5, 4.0)))
    left, right = together[24, 8, :3], together[24, 56, :3]
    np.testing.assert_allclose(left, over(0.0, (0.5, 1.0), (0.5, 4.0)), rtol=1e-6)
    np.testing.assert_allclose(right, over(0.0, (0.5, 4.0), (0.5, 1.0)), rtol=1e-6)


@pytest.mark.parametrize(("count", "truncated"), [(MAX_LAYERS, False), (MAX_LAYERS + 1, True)])
def test_no_more_layers_than_are_said(gl: Any, count: int, truncated: bool) -> None:
    """The nearest count; what is missing is the farthest."""
    panes = [pane(-0.1 * k, k) for k in range(count)]
    made = scene(panes, *(glass(0.5, float(k + 1)) for k in range(count)))
    found, together, peeling = layers(gl, made)
    assert len(found) == MAX_LAYERS
    assert peeling.truncated is truncated
    shown = [(0.5, float(k + 1)) for k in range(MAX_LAYERS)]
    np.testing.assert_allclose(middle(together)[:3], over(0.0, *shown[::-1]), rtol=1e-5)


def test_both_sides_of_one_mesh_are_two_layers(gl: Any) -> None:
    corners = [
        pane(0.0, 0, double_sided=True).geometry,
        quad((-2, -2, -1.0), (0, 4.0, 0), (4.0, 0, 0), key="back"),
    ]
    box = [draw(geometry, 0, double_sided=True) for geometry in corners]
    found, _, _ = layers(gl, scene(box, glass(0.5, 1.0)))
    assert [round(float(middle(layer["g_normal"])[3]), 5) for layer in found] == [3.0, 4.0]


def test_opacity_of_a_texture_pixel_by_pixel(gl: Any) -> None:
    """Left clear, right opaque."""
    pixels = np.zeros((1, 2, 4), np.float32)
    pixels[0, 1, 3] = 1.0
    use = TextureUse(TextureRef("a.exr", "linear", "clamp", "clamp"), channel=3)
    made = scene([pane(-1.0, 0), pane(0.0, 1)], WALL, glass(1.0, 3.0, opacity_map=use))
    _, together, _ = layers(gl, made, lambda _: ImageData(pixels))
    assert together[24, 1, 0] == 8.0  # beyond the middle of the texel
    assert together[24, 62, 0] == 3.0


def test_wholly_opaque_blending_is_no_layer(gl: Any) -> None:
    found, together, _ = layers(gl, scene([pane(0.0, 0)], glass(1.0, 3.0)))
    assert found == []
    assert middle(together).tolist() == [3.0, 3.0, 3.0, 1.0]


def test_orthographic_camera(gl: Any) -> None:
    camera = look(half=0.5, orthographic=True)
    panes = [pane(-1.0, 0), pane(0.0, 1), pane(1.0, 2)]
    made = scene(panes, WALL, glass(0.5, 3.0), glass(0.25, 2.0), camera=camera)
    _, together, _ = layers(gl, made)
    np.testing.assert_allclose(middle(together)[:3], over(8.0, (0.5, 3.0), (0.25, 2.0)), rtol=1e-6)
