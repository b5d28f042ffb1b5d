"""S/P of lamps, and the scene that a second frame is made of."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.colour import luminance
from hdrusd.eye.scotopic import scotopic
from hdrusd.photometry.scotopic_light import ILLUMINANTS, scotopic_factor, scotopic_scene
from hdrusd.scene import Material, RenderScene, TextureRef, TextureUse, light_rows


@pytest.mark.parametrize(
    ("name", "sp"),
    [
        # By another program from the same spectra, (1700 / 683) of the sums of E V' and E V.
        ("D65", 2.465),
        ("A", 1.412),
        ("FL2", 1.571),
        ("FL11", 1.596),
        ("HP1", 0.558),
        ("HP2", 1.058),
        ("LED-B1", 1.213),
        ("LED-B3", 1.721),
        ("LED-B5", 2.176),
    ],
)
def test_ratios_of_illuminants(name: str, sp: float) -> None:
    assert ILLUMINANTS[name] == pytest.approx(sp, abs=0.006)


def test_scaled_light_has_the_ratio() -> None:
    rng = np.random.default_rng(191)
    rgb, sp = rng.uniform(0.01, 100.0, (50, 3)), rng.uniform(0.2, 3.0, 50)
    scaled = rgb * scotopic_factor(rgb, sp)[:, None]
    assert scotopic(scaled) == pytest.approx(sp * luminance(rgb), rel=1e-12)
    assert scotopic_factor(rgb, np.zeros(50)).tolist() == [1.0] * 50
    assert scotopic_factor([0.0, 0.0, 0.0], 0.6) == 1.0


def test_without_a_stated_ratio_there_is_no_second_scene() -> None:
    assert scotopic_scene(RenderScene(lights=light_rows(3), materials=(Material(),))) is None
    assert scotopic_scene(RenderScene()) is None


def test_only_what_states_a_ratio_is_scaled() -> None:
    lights = light_rows(2)
    lights["intensity"] = [100.0, 50.0, 10.0]
    lights["sp"], lights["diffuse"] = [0.6, 0.0], 0.5
    picture = TextureUse(TextureRef("a.exr", "linear"), scale=(2.0, 1.0, 0.5, 1.0))
    lamp = Material(emission=(2.0, 1.0, 0.5), emission_map=picture, emission_sp=0.6)
    glow = Material(emission=(2.0, 1.0, 0.5))
    scene = RenderScene(lights=lights, materials=(glow, lamp))
    second = scotopic_scene(scene)
    assert second is not None
    factor = float(scotopic_factor(lights["intensity"][0], 0.6))
    for name, value in (("diffuse", 0.5), ("specular", 1.0)):
        assert second.lights[name] == pytest.approx([value * factor, value], rel=1e-12)
    assert (second.lights["intensity"] == lights["intensity"]).all()
    assert second.materials[0] is glow
    made = second.materials[1]
    assert scotopic(made.emission) == pytest.approx(0.6 * luminance(lamp.emission), rel=1e-12)
    assert made.emission_map is not None
    assert made.emission_map.scale[:3] == pytest.approx(made.emission, rel=1e-12)
    assert made.emission_map.scale[3] == 1.0
    # The first frame's scene is as it was.
    assert (scene.lights["diffuse"] == 0.5).all()
