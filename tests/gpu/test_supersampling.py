"""Supersampled frames: what a pixel shows is the mean over its square."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from small_scenes import quad

from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.program import Programs
from hdrusd.gpu.supersampling import offsets
from hdrusd.scene import Camera, Draw, Material, RenderScene


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 7, 8, 16, 64])
def test_offsets_are_even(samples: int) -> None:
    """A lattice: each coordinate takes every one of n places once, and the mean is 0."""
    points = np.array(list(offsets(samples)))
    places = (np.arange(samples) + 0.5) / samples - 0.5
    for axis in range(2):
        np.testing.assert_allclose(np.sort(points[:, axis]), places, atol=1e-12)


def test_an_edge_shows_the_share_that_it_covers(gl: moderngl.Context) -> None:
    """A glowing half plane whose edge lies a quarter into a pixel: 0.25 of its luminance."""
    edge = -1.0 + 2.0 * (3.25 / 8.0)
    glowing = quad((-5.0, -5.0, -1.0), (5.0 + edge, 0.0, 0.0), (0.0, 10.0, 0.0))
    scene = RenderScene(
        draws=(Draw(glowing, 0, np.eye(4)[None], double_sided=True),),
        materials=(Material(diffuse=(0.0, 0.0, 0.0), emission=(100.0, 100.0, 100.0)),),
        camera=Camera(window=(-1.0, 1.0, -1.0, 1.0), near=0.1, far=10.0),
    )
    renderer = HdrRenderer(gl, Programs(gl), (8, 8), lambda _: None, Options(samples=64))
    renderer.render(scene)
    row = renderer.read()[4, :, 0]
    np.testing.assert_allclose(row, [100.0] * 3 + [25.0] + [0.0] * 4, rtol=1e-6)
