"""The HDR frame against NumPy's shading of its own G-buffer."""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
from small_scenes import Rendered, render

from hdrusd.photometry.shading import shade
from hdrusd.scene import RenderScene

#: float32 positions and normals of 6e-8 each, some twenty operations a light, an error of
#: the angle of 1e-7 in 1e-2 of a soft edge: 1e-4 leaves a factor of four.
RELATIVE = 1e-4

#: Where light grazes, N.L is a difference: its error is absolute, a share of the brightest pixel.
ABSOLUTE = 1e-6


def shading(
    got: Rendered, scene: RenderScene, reflection: str = "lambert"
) -> npt.NDArray[np.float64]:
    """(n, 3) cd/m2 that the scene's lights give the n pixels of ``got`` that show a surface."""
    seen = got.surface
    eye: Any = np.asarray(scene.camera.eye)
    if scene.camera.orthographic:
        eye = got.position[seen] + np.asarray(scene.camera.back)
    return shade(
        got.position[seen],
        got.normal[seen],
        got.diffuse[seen],
        got.specular[seen],
        got.shininess[seen],
        scene.lights,
        eye=eye,
        scale=1.0 if reflection == "petit2010" else 1.0 / math.pi,
        metallic=got.metallic[seen],
        coat=got.coat[seen],
        links=got.links[seen],
        profiles=scene.profiles,
    )


def assert_is_its_shading(gl: moderngl.Context, scene: RenderScene, **options: Any) -> Rendered:
    """The frame is what NumPy makes of the G-buffer; returns it. For scenes of lamps alone."""
    got = render(gl, scene, **options)
    assert got.surface.mean() > 0.3, "the scene has to be seen"
    wanted = shading(got, scene, options.get("reflection", "lambert"))
    assert wanted.max() > 0.0, "and lit"
    np.testing.assert_allclose(
        got.frame[got.surface], wanted, rtol=RELATIVE, atol=ABSOLUTE * wanted.max()
    )
    assert not got.frame[~got.surface].any()
    return got
