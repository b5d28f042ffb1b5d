"""Shadows below a normal map: what nothing hides is lit as without shadows, however it is lit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shadow_scenes import draw, plane, rect_light, scene
from small_scenes import look, render

from hdrusd.scene import CYLINDER, DISK, SPHERE, ImageData, Material, TextureRef, TextureUse

#: Low over the plane, from the side to which the bump tilts, and so that it is grazed.
LOW = (6.0, 0.0, 0.6)
LAMPS: dict[str, dict[str, Any]] = {
    "point": {"position": LOW, "intensity": 50.0},
    "spot": {"position": LOW, "intensity": 50.0, "axis": (-1.0, 0.0, -0.1), "outer": 0.6},
    "rect": rect_light(position=LOW, axis=(-1.0, 0.0, 0.0), x=(0.0, 0.2, 0.0), y=(0.0, 0.0, 0.2)),
    "disk": rect_light(
        shape=DISK, position=LOW, axis=(-1.0, 0.0, 0.0), x=(0.0, 0.2, 0.0), y=(0.0, 0.0, 0.2)
    ),
    "sphere": rect_light(shape=SPHERE, position=LOW, radius=0.1),
    "cylinder": rect_light(shape=CYLINDER, position=LOW, x=(0.0, 0.3, 0.0), radius=0.02),
    "sun": {"position": (0.995, 0.0, 0.1), "w": 0.0, "intensity": 50.0, "angle": math.radians(0.5)},
    "distant": {"position": (0.995, 0.0, 0.1), "w": 0.0, "intensity": 50.0},
}


@pytest.mark.parametrize(("tilt", "half"), [(0.8, 0.4), (-0.05, 0.4), (0.8, 1.5)])
@pytest.mark.parametrize("kind", LAMPS)
def test_a_bump_casts_no_shadow_on_itself(gl: Any, kind: str, tilt: float, half: float) -> None:
    """``tilt``: of the normals towards the light; ``half``: of the window, above 1 orthographic."""
    use = TextureUse(TextureRef("bump.exr", "linear"))
    texel = np.array([tilt, 0.0, math.sqrt(1.0 - tilt * tilt)], np.float32)
    camera = look(
        (0.0, -3.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), half=half, orthographic=half > 1.0
    )
    shown = scene(
        LAMPS[kind],
        draw(plane(2.0)),
        camera=camera,
        materials=(Material(diffuse=(0.5, 0.3, 0.2), normal_map=use),),
    )

    def load(_: TextureRef) -> ImageData:
        return ImageData(np.tile(texel, (2, 2, 1)))

    whole = render(gl, shown, load, shadows=False)
    found = render(gl, shown, load, shadows=True)
    lit = whole.surface & (whole.frame[..., 0] > 0.0)
    assert lit.sum() > 600
    # The same light by another program: roundings.
    np.testing.assert_allclose(found.frame[lit], whole.frame[lit], rtol=3e-6)
