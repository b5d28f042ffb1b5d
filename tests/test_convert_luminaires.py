"""Convert: lights with photometric files, and surfaces with a stated gloss."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import gltf_lights, obj, osgt_light
from converted import MOON, POINT, SPOT, lights, material, opened, run, sidecar, surface
from photometric_files import ies_text, ldt_text
from pxr import Usd, UsdGeom, UsdLux

from hdrusd.conversion import Result
from hdrusd.photometry.profile import pack_profiles, profile_candela
from hdrusd.report import Kind, Report
from hdrusd.scene import Camera, RenderScene
from hdrusd.usd.extract import StageReader
from hdrusd.usd.preview import MaterialReader

#: All four sides differ: 10, 20, 30 and 40 cd at C = 0, 90, 180 and 270, gamma 90; 50 below.
SIDES = ies_text(
    [[50, 10 * i] for i in (1, 2, 3, 4)], planes=(0, 90, 180, 270), angles=(0, 90), size=(0, 0, 0)
)


def rule(text: str, match: str = "*") -> str:
    return f'[[light]]\nmatch = "{match}"\n{text}\n'


def scene(result: Result) -> tuple[RenderScene, Report]:
    """The lights of the stage; a box, so that there is something to draw."""
    stage = opened(result)
    UsdGeom.Cube.Define(stage, "/Box")
    report = Report()
    return StageReader(stage, report).read(0.0, Camera()), report


def toward(made: RenderScene, *ways: tuple[float, float, float]) -> list[float]:
    """Candela of the first light in directions of the world, by their luminance."""
    row = made.lights[0]
    atlas, places = pack_profiles(made.profiles)
    place, grid = places[row["profile"]].astype(np.float64)
    factor = float(np.dot((0.2126, 0.7152, 0.0722), row["intensity"]))
    found = []
    for way in ways:
        local = np.array([np.dot(way, row[name]) for name in ("x", "y", "axis")])
        found.append(float(profile_candela(atlas, place, grid, local)) * factor)
    return found


# -- the light shines as its file ---------------------------------------------------------


@pytest.mark.parametrize("unit", [1.0, 0.01])
@pytest.mark.parametrize("file", ["lamp.ies", "photometry/lamp.ies"])
def test_candela_and_orientation_are_the_files(tmp_path: Path, unit: float, file: str) -> None:
    (tmp_path / "photometry").mkdir()
    (tmp_path / file).write_text(SIDES)
    turned = {"rotation": [0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)], "scale": [3.0, 3.0, 3.0]}
    nodes = [turned | {"extensions": {"KHR_lights_punctual": {"light": 0}}}]
    source = gltf_lights(tmp_path / "a.gltf", [SPOT], nodes)
    sidecar(
        tmp_path,
        rule(f'ies = "{file}"\nscale = 0.5\naxis = [0, -2, 0]\nc0 = [0, 7, 1]\nradius = 0.2'),
    )
    result = run(source, tmp_path / "out" / "a.usda", meters_per_unit=unit)
    made, report = scene(result)
    assert "profile-missing" not in report.codes()
    # The node is turned by 90 degrees about +Y: its +Z, where C = 0 points, is the world's +X,
    # and C = 90, the axis being down, is at the cross product of up and C = 0: -Z.
    ways = [(0, -1, 0), (1, 0, 0), (0, 0, 1), (-1, 0, 0), (0, 0, -1), (0, 1, 0)]
    assert toward(made, *ways) == pytest.approx([25, 5, 20, 15, 10, 0], rel=1e-5)
    assert made.lights["radius"][0] == pytest.approx(0.2, rel=1e-6)
    assert "light-cone" in result.report.codes()


def test_lumens_scale_the_file_to_a_flux(tmp_path: Path) -> None:
    # 100 cd into the lower half space are 200 pi lm, 628 of which 314 are asked for.
    (tmp_path / "a.ies").write_text(ies_text([100, 100], planes=(0,), angles=(0, 90)))
    sidecar(tmp_path, rule(f'ies = "a.ies"\nlumens = {100 * math.pi}\naxis = [0, -1, 0]'))
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT]))
    assert toward(scene(result)[0], (0, -1, 0)) == pytest.approx([50.0], rel=1e-5)
    (row,) = result.lights
    assert row["flux_lm"] == pytest.approx(100 * math.pi)
    assert (row["unit"], row["value"]) == ("times the file", pytest.approx(0.5))
    assert row["file"].startswith("./a.textures/")


def test_the_file_is_copied_once_and_named_by_the_light(tmp_path: Path) -> None:
    (tmp_path / "a.ldt").write_text(ldt_text())
    sidecar(tmp_path, rule('ies = "a.ldt"\nc0 = [1, 0, 0]', "p*") + rule('ies = "a.ldt"', "s*"))
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT, SPOT]))
    (copy,) = (tmp_path / "a.textures").iterdir()
    assert copy.read_text() == (tmp_path / "a.ldt").read_text()
    assert result.textures[copy.name]["kind"] == "photometric"
    for prim in lights(opened(result)).values():
        shaping = UsdLux.ShapingAPI(prim)
        assert shaping.GetShapingIesFileAttr().Get().resolvedPath == str(copy)
        assert shaping.GetShapingConeAngleAttr().Get() == 180.0
        candela = prim.GetAttribute("inputs:photometric:luminousIntensity")
        assert not candela.HasAuthoredValue()
    assert "validation" not in result.report.codes()
    findings = [finding for finding in result.report if finding.code == "profile-eulumdat"]
    assert len(findings) == 1
    # The spot's rule leaves C = 0 open, and this file is no figure of rotation.
    aims = [finding for finding in result.report if finding.code == "profile-aim"]
    assert {(finding.kind, finding.thing) for finding in aims} == {
        (Kind.ASSUMED, "point"),  # where gamma = 0 points
        (Kind.ASSUMED, "spot"),
    }


def test_the_copy_holds_what_its_tilt_file_says(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(ies_text(tilt="TILT=lamp.tlt"))
    (tmp_path / "lamp.tlt").write_text("1\n2\n0 90\n0.5 1\n\x1a")
    sidecar(tmp_path, rule('ies = "a.ies"\naxis = [0, -1, 0]\nc0 = [1, 0, 0]'))
    made, _ = scene(run(gltf_lights(tmp_path / "a.gltf", [POINT]), tmp_path / "out" / "a.usda"))
    assert toward(made, (0, -1, 0)) == pytest.approx([200.0], rel=1e-5)


def test_size_and_colour_come_from_the_rule_else_from_the_file(tmp_path: Path) -> None:
    # A luminous opening of 0.4 m x 0.3 m: pi r^2 = 0.12 m2.
    (tmp_path / "a.ies").write_text(ies_text(size=(0.3, 0.4, 0.0)))
    sidecar(tmp_path, rule('ies = "a.ies"\ntemperature = 2000'))
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT]))
    prim = lights(opened(result))["point"]
    radius = prim.GetAttribute("inputs:radius").Get()
    assert radius == pytest.approx(math.sqrt(0.12 / math.pi), rel=1e-6)
    assert "lamp-radius" not in result.report.codes()
    sodium = UsdLux.BlackbodyTemperatureAsRgb(2000)
    assert prim.GetAttribute("inputs:color").Get() == pytest.approx(sodium, rel=1e-5)


# -- what can be wrong --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("none.ies", None, "file-missing"),
        ("", None, "file-missing"),
        ("a\\u0000.ies", None, "file-missing"),
        ("../a.ies", SIDES, "file-refused"),
        ("a.ies", "IESNA91\n", "profile-invalid"),
        ("a.ldt", "EULUMDAT\n" * 30, "profile-invalid"),
        ("a.ies", ies_text(tilt="TILT=" + "x" * 3000), ""),
        ("a.ies", ies_text(tilt="TILT=\0"), ""),
    ],
)
def test_without_its_file_a_light_is_what_the_rest_says(
    tmp_path: Path, name: str, content: str | None, code: str
) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    if content is not None:
        (folder / name).write_text(content)
    sidecar(folder, rule(f'ies = "{name}"'))
    result = run(gltf_lights(folder / "a.gltf", [POINT]))
    (row,) = result.lights
    if code:
        (finding,) = [finding for finding in result.report if finding.code == code]
        assert str(finding.source) == "photometry.toml:light[1]"
        assert str(finding).count("\n") == 0
        assert (row["unit"], row["value"]) == ("cd", pytest.approx(820.86))
        assert list(folder.glob("a.textures/*")) == []
    else:
        assert row["unit"] == "times the file"


@pytest.mark.parametrize(
    ("file", "keys", "rivals"),
    [
        ("a.ies", "candela = 1", ["candela"]),
        ("a.ies", "lumens = 1", []),  # the luminaire's flux
        ("a.ies", "scale = 1\nlumens = 2", ["scale"]),
        ("a.ies", "watts = 1\nefficacy = 9", ["watts"]),
        ("a.ies", 'lumens = 1\nspread = "sphere"', ["spread"]),
        ("bad.ies", "candela = 1", []),
        ("gone.ies", "candela = 1", []),
        ("gone.ies", "candela = 1\nlumens = 9", ["lumens"]),
    ],
)
def test_what_counts_beside_a_file_is_said_when_it_is_read(
    tmp_path: Path, file: str, keys: str, rivals: list[str]
) -> None:
    (tmp_path / "a.ies").write_text(SIDES)
    (tmp_path / "bad.ies").write_text("IESNA91\n")
    sidecar(tmp_path, rule(f'ies = "{file}"\n{keys}'))
    nodes = [{"extensions": {"KHR_lights_punctual": {"light": 0}}}] * 2
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT], nodes))
    assert [f.thing for f in result.report if f.code == "sidecar-rival"] == rivals
    units = [row["unit"] for row in result.lights]
    assert units == ["times the file" if file == "a.ies" else "cd"] * 2


def test_a_declared_root_allows_a_file_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "a.ies").write_text(SIDES)
    sidecar(tmp_path / "in", rule('ies = "../a.ies"'))
    source = gltf_lights(tmp_path / "in" / "a.gltf", [POINT])
    assert run(source, roots=[tmp_path]).lights[0]["unit"] == "times the file"


def test_a_light_without_a_place_takes_no_file(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(SIDES)
    sidecar(tmp_path, rule('ies = "a.ies"\nilluminance = 2'))
    result = run(gltf_lights(tmp_path / "a.gltf", [MOON]))
    assert "profile-unused" in result.report.codes()
    assert result.lights[0]["value"] == 2.0


def test_c0_along_the_axis_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(SIDES)
    sidecar(tmp_path, rule('ies = "a.ies"\naxis = [0, -1, 0]\nc0 = [0, 3, 0]'))
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT]))
    (finding,) = [finding for finding in result.report if finding.code == "profile-aim"]
    assert finding.kind == Kind.INVALID


def test_a_file_or_a_factor_that_gives_no_light(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(ies_text([0, 0], planes=(0,), angles=(0, 90)))
    (tmp_path / "b.ies").write_text(SIDES)
    sidecar(tmp_path, rule('ies = "a.ies"\nlumens = 5', "p*") + rule('ies = "b.ies"\nscale = 0'))
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT, SPOT, MOON]))
    assert [row["name"] for row in result.lights] == ["moon"]
    assert sum(finding.code == "light-dark" for finding in result.report) == 2


def test_opengl_lights_take_files_too(tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(SIDES)
    source = osgt_light(tmp_path / "lamp.osgt", {"Direction": "0 0 -1", "SpotCutoff": "60"})
    sidecar(tmp_path, rule('ies = "a.ies"\nc0 = [0, -1, 0]'))
    made, _ = scene(run(source))
    ways = [(0, 0, -1), (0, -1, 0), (1, 0, 0)]
    assert toward(made, *ways) == pytest.approx([50, 10, 20], rel=1e-5)


# -- surfaces -----------------------------------------------------------------------------


def read_material(result: Result, name: str = "paint") -> Any:
    stage = opened(result)
    return MaterialReader(stage, Report()).read(material(stage, name), Usd.TimeCode.Default())


WET = "specular = [0.02, 0.02, 0.02]\nroughness = 0.3\n"


def test_a_stated_roughness_is_that_of_ggx(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5\nKs 0.3 0.3 0.3\nNs 40\nillum 2")
    sidecar(tmp_path, f'[[material]]\nmatch = "paint"\n{WET}source = "by eye"\n')
    result = run(source)
    made = read_material(result)
    assert (made.model, made.roughness, made.metallic) == ("ggx", pytest.approx(0.3), 0.0)
    assert made.specular == pytest.approx((0.02, 0.02, 0.02))
    prim = material(opened(result)).GetPrim()
    assert prim.GetAttribute("photometric:source").Get() == "by eye"
    assert prim.GetAttribute("photometric:provenance").Get() == "authored"
    assert result.materials[0]["rule"] == "photometry.toml:material[1]"
    # The look stays as the source had it.
    shininess = 40.0
    look = surface(opened(result)).GetPrim().GetParent().GetChild("Look")
    roughness = look.GetAttribute("inputs:roughness").Get()
    assert roughness == pytest.approx((2.0 / (shininess + 2.0)) ** 0.25)


def test_a_stated_shininess_is_blinn_and_phongs(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5\nKs 0.3 0.3 0.3\nNs 40\nillum 2")
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nshininess = 200\n')
    made = read_material(run(source))
    assert (made.model, made.shininess) == ("blinn", 200.0)
    assert made.specular == pytest.approx((0.3, 0.3, 0.3))
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nspecular = [0.1, 0.2, 0.3]\n')
    made = read_material(run(source, tmp_path / "b.usda"))
    assert (made.model, made.shininess) == ("blinn", 40.0)
    assert made.specular == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("text", "specular", "roughness", "metallic"),
    [
        (WET, 0.02, 0.3, 0.0),
        ("roughness = 0.3\n", None, 0.3, 1.0),
        ("specular = [0.02, 0.02, 0.02]\n", 0.02, 0.8, 0.0),
        ("shininess = 0\n", None, 1.0, 1.0),  # alpha = sqrt(2 / (n + 2)), roughness its root
    ],
)
def test_a_material_of_metallic_and_roughness_stays_with_ggx(
    tmp_path: Path, text: str, specular: float | None, roughness: float, metallic: float
) -> None:
    source = obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5\nPm 1\nPr 0.8")
    sidecar(tmp_path, f'[[material]]\nmatch = "paint"\n{text}')
    made = read_material(run(source))
    assert made.model == "ggx"
    assert made.roughness == pytest.approx(roughness)
    assert made.metallic == metallic
    if specular is not None:
        assert made.specular == pytest.approx((specular,) * 3)
