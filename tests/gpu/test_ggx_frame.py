"""Lamps on UsdPreviewSurface materials: the frame is the shading of its G-buffer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from parity import assert_is_its_shading
from small_scenes import draw, lights, look, quad, waves

from hdrusd.scene import Material, RenderScene

LAMPS = lights(
    {"position": (1.0, 0.5, 2.0), "intensity": (900.0, 700.0, 400.0)},
    {"position": (-1.5, 1.0, 0.8), "intensity": (90.0, 200.0, 300.0)},
    {"position": (0.36, 0.48, 0.8), "w": 0.0, "intensity": (30.0, 40.0, 50.0)},
)

MATERIALS = {
    "rough paint": Material("ggx", (0.5, 0.3, 0.2), specular=(0.04,) * 3, roughness=0.7),
    "smooth paint": Material("ggx", (0.5, 0.3, 0.2), specular=(0.04,) * 3, roughness=0.2),
    "metal": Material("ggx", (0.9, 0.6, 0.3), specular=(0.04,) * 3, roughness=0.45, metallic=1.0),
    "half a metal": Material("ggx", (0.9, 0.6, 0.3), specular=(0.04,) * 3, metallic=0.5),
    "dark highlight": Material("ggx", (0.5, 0.3, 0.2), specular=(0.01, 0.005, 0.0)),
    "no highlight": Material("ggx", (0.5, 0.3, 0.2), roughness=1.0),
}


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("reflection", ["lambert", "petit2010"])
def test_frame_is_the_shading_of_its_g_buffer(gl: Any, name: str, reflection: Any) -> None:
    scene = RenderScene(
        lights=LAMPS,
        draws=(draw(waves()),),
        materials=(MATERIALS[name],),
        camera=look((0.5, -2.5, 1.2), half=0.45),
    )
    assert_is_its_shading(gl, scene, reflection=reflection)


def test_legacy_and_modern_side_by_side(gl: Any) -> None:
    """Both highlights in one tile of the screen, each on its own surface."""
    left, right = (
        draw(quad((x, -1.0, 0.0), (1.0, 0, 0), (0, 2.0, 0), key=f"{x}"), k)
        for k, x in enumerate((-1.0, 0.0))
    )
    glossy = Material(specular=(0.3,) * 3, shininess=20.0)
    scene = RenderScene(
        lights=LAMPS, draws=(left, right), materials=(glossy, MATERIALS["metal"]), camera=look()
    )
    got = assert_is_its_shading(gl, scene)
    assert set(np.unique(got.shininess[got.surface] < 0.0)) == {False, True}
