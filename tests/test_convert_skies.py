"""Convert by the photometry file's skies: presets, to the stage and to the frame."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import gltf_lights, obj
from converted import MOON, lights, opened, run, sidecar
from lit_ground import findings, rows, seen
from overlaid import stage_file
from pxr import Gf, Usd, UsdGeom, UsdLux
from stage_text import GROUND

from hdrusd.conversion import Result
from hdrusd.images import read_exr
from hdrusd.photometry.sky_presets import PRESETS


def sky(folder: Path, text: str, up: str = "Z") -> Result:
    sidecar(folder, f"[ambient]\n{text}\n")
    return run(obj(folder / "a.obj", "Kd 0.5 0.5 0.5"), up=up)


@pytest.mark.parametrize("name", ["moonless", "starlit-city", "dusk"])
def test_an_even_sky_lights_the_ground(gl: Any, tmp_path: Path, name: str) -> None:
    result = sky(tmp_path, f'preset = "{name}"')
    lux = PRESETS[name].sky().illuminance
    np.testing.assert_allclose(seen(gl, result, GROUND)[30:, :30], lux / math.pi, rtol=1e-6)
    assert rows(result)["Sky"]["confidence"] == "low"
    assert rows(result)["Sky"]["rule"] == f"class sky {name}, photometry.toml:ambient"
    assert findings(result, "sky-preset")


def test_an_overcast_day_lights_the_ground(gl: Any, tmp_path: Path) -> None:
    result = sky(tmp_path, 'preset = "overcast-day"\naltitude = 30')
    # Spherical harmonics pass 0.9989 of it (tests/facts/test_sky_presets.py).
    np.testing.assert_allclose(seen(gl, result, GROUND)[30:, :30], 10_800 / math.pi, rtol=1.3e-3)
    picture = tmp_path / "a.textures" / "sky_overcast-day.exr"
    rgb, header = read_exr(picture)
    assert header["whiteLuminance"] == 1.0
    assert rgb[0].mean() == pytest.approx(9 * 10_800 / (7 * math.pi), rel=1e-3)
    assert result.textures[picture.name]["unit"] == "cd/m2"


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_the_sun_is_a_light_of_half_a_degree(tmp_path: Path, up: str) -> None:
    result = sky(tmp_path, 'preset = "clear-sun"\naltitude = 30\nazimuth = 90', up)
    stage = opened(result)
    sun = lights(stage)["Sun"]
    lux = 127_500 * math.exp(-0.42)
    assert sun.GetAttribute("inputs:photometric:illuminance").Get() == pytest.approx(lux, rel=1e-6)
    assert UsdLux.DistantLight(sun).GetAngleAttr().Get() == pytest.approx(0.53)
    world = UsdGeom.Xformable(sun).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    way = world.TransformDir(Gf.Vec3d(0, 0, -1))
    level, down = math.cos(math.radians(30)), -0.5
    wanted = (-level, down, 0.0) if up == "Y" else (-level, 0.0, down)
    assert tuple(way) == pytest.approx(wanted, abs=1e-12)
    assert not any(f.code == "validation" for f in result.report)


@pytest.mark.parametrize("name", ["clear-sun", "moonlit"])
def test_sun_and_sky_light_the_ground(gl: Any, tmp_path: Path, name: str) -> None:
    result = sky(tmp_path, f'preset = "{name}"\naltitude = 60')
    made = PRESETS[name].sky(60.0)
    found = seen(gl, result, GROUND)[30:, :30] * math.pi
    # The scattered part is good to 5.9 % (docs/lights.md), the sun to float32.
    np.testing.assert_allclose(found, made.illuminance, atol=0.059 * made.lux)


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_the_domes_picture_is_upright(tmp_path: Path, up: str) -> None:
    """Its top row is up, and where it is brightest stands the moon."""
    result = sky(tmp_path, 'preset = "moonlit"\naltitude = 20\nazimuth = 0', up)
    stage = opened(result)
    dome = lights(stage)["Sky"]
    world = UsdGeom.Xformable(dome).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    top = world.TransformDir(Gf.Vec3d(0, 1, 0))
    assert tuple(top) == pytest.approx((0, 1, 0) if up == "Y" else (0, 0, 1), abs=1e-12)
    north = world.TransformDir(Gf.Vec3d(0, 0, -1))
    assert tuple(north) == pytest.approx((0, 0, -1) if up == "Y" else (0, 1, 0), abs=1e-12)
    moon = UsdGeom.Xformable(lights(stage)["Moon"])
    way = -moon.ComputeLocalToWorldTransform(Usd.TimeCode.Default()).TransformDir(
        Gf.Vec3d(0, 0, -1)
    )
    assert Gf.Dot(way, north) == pytest.approx(math.cos(math.radians(20.0)), abs=1e-12)


def test_a_stage_gets_its_moon_too(tmp_path: Path) -> None:
    source = stage_file(tmp_path / "town.usda", GROUND)
    sidecar(tmp_path, '[ambient]\npreset = "moonlit"\n')
    result = run(source, tmp_path / "night.usda")
    assert set(rows(result)) == {"Sky", "Moon"}
    assert opened(result).GetPrimAtPath(rows(result)["Moon"]["path"]).GetName() == "Moon"
    # The ground gets lux times sin 45 of it.
    moon = rows(result)["Moon"]
    assert moon["level_lux"] == pytest.approx(moon["value"] * math.sqrt(0.5), rel=1e-12)
    again = run(result.output, tmp_path / "again.usda")
    assert rows(again)["Moon"]["level_lux"] == pytest.approx(moon["level_lux"], rel=1e-6)


def test_a_stated_illuminance_takes_the_presets_place(tmp_path: Path) -> None:
    result = sky(tmp_path, 'preset = "clear-sun"\nilluminance = 1000\nprovenance = "measured"')
    made = rows(result)
    up = math.sin(math.radians(45.0))
    assert made["Sky"]["value"] + up * made["Sun"]["value"] == pytest.approx(1000.0, rel=1e-9)
    assert made["Sun"]["provenance"] == "measured"
    assert not findings(result, "sky-preset")


def test_a_preset_of_no_light_is_dark(gl: Any, tmp_path: Path) -> None:
    result = sky(tmp_path, 'preset = "overcast-day"\nilluminance = 0')
    assert not seen(gl, result, GROUND).any()


def test_a_second_sun_is_told(tmp_path: Path) -> None:
    sidecar(tmp_path, '[ambient]\npreset = "moonlit"\n')
    result = run(gltf_lights(tmp_path / "a.gltf", [MOON]))
    assert [f.thing for f in result.report if f.code == "sky-two-suns"] == ["moon"]


@pytest.mark.parametrize(
    "text", ['preset = "dusk"\naltitude = 20', 'preset = "moonless"\naltitude = 20']
)
def test_an_altitude_that_a_sky_cannot_have(tmp_path: Path, text: str) -> None:
    result = sky(tmp_path, text)
    (finding,) = [f for f in result.report if f.code == "sidecar-invalid"]
    assert finding.thing == "altitude"
    name = text.split('"')[1]
    assert rows(result)["Sky"]["value"] == PRESETS[name].sky().illuminance


def test_a_stated_number_is_not_the_presets(tmp_path: Path) -> None:
    said = 'preset = "moonlit"\nilluminance = 0.2'
    found = rows(sky(tmp_path, said))
    assert set(found) == {"Sky", "Moon"}
    for name in found:
        assert (found[name]["source"], found[name]["confidence"]) == ("", "medium")
        assert found[name]["rule"] == "photometry.toml:ambient, sky moonlit"
    measured = rows(sky(tmp_path, f'{said}\nsource = "meter, 3 May"'))["Sky"]
    assert (measured["source"], measured["confidence"]) == ("meter, 3 May", "high")
