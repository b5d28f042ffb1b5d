"""Photometric files of UsdLux lights: ``inputs:shaping:ies:*`` to scene rows and profiles."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from photometric_files import ies_text, ldt_text
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdUtils

import hdrusd.usd  # noqa: F401 (registers the schemas before the first stage)
from hdrusd.photometry.profile import pack_profiles, profile_candela
from hdrusd.report import Report
from hdrusd.scene import Camera, RenderScene
from hdrusd.usd.extract import StageReader
from hdrusd.usd.profile import beside

#: 100 cd alike in all directions of the lower half: 200 pi lumens.
HALF = ies_text([100, 100], planes=(0,), angles=(0, 90))

#: The grid's steps are 32 bits: 4 cells are off by 2^-22 of one, in which it falls by 210 cd.
ROUNDED = 210 * 2.0**-22


@pytest.fixture
def stage(tmp_path: Path) -> Usd.Stage:
    made = Usd.Stage.CreateNew(str(tmp_path / "street.usda"))
    UsdGeom.SetStageMetersPerUnit(made, 1.0)
    UsdGeom.Cube.Define(made, "/Box")
    return made


def lamp(
    stage: Usd.Stage, file: str, path: str = "/Lamp", multiplier: float = 1.0, **inputs: Any
) -> Usd.Prim:
    """A sphere light of ``multiplier`` cd without its file."""
    light = UsdLux.SphereLight.Define(stage, path)
    light.CreateRadiusAttr(0.5)
    light.CreateTreatAsPointAttr(True)
    light.CreateIntensityAttr(multiplier / (math.pi * 0.25))
    shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
    shaping.CreateShapingConeAngleAttr(180.0)
    shaping.CreateShapingIesFileAttr(Sdf.AssetPath(file))
    for name, value in inputs.items():
        light.GetPrim().GetAttribute(f"inputs:shaping:ies:{name}").Set(value)
    return light.GetPrim()


def read(stage: Usd.Stage, time: float = 0.0) -> tuple[RenderScene, Report]:
    report = Report()
    return StageReader(stage, report).read(time, Camera()), report


def toward(scene: RenderScene, world: tuple[float, float, float], light: int = 0) -> float:
    """Candela of a light in a direction of the world, first channel."""
    row = scene.lights[light]
    atlas, places = pack_profiles(scene.profiles)
    place, grid = places[row["profile"]].astype(np.float64)
    way = np.array(world) / np.linalg.norm(world)
    local = np.array([way @ row[name] for name in ("x", "y", "axis")])
    return float(profile_candela(atlas, place, grid, local) * row["intensity"][0])


@pytest.mark.parametrize(("file", "text"), [("a.ies", ies_text()), ("a.ldt", ldt_text())])
def test_a_light_shines_as_its_file(stage: Usd.Stage, tmp_path: Path, file: str, text: str) -> None:
    (tmp_path / file).write_text(text)
    lamp(stage, f"./{file}", multiplier=1.5)
    scene, report = read(stage)
    assert not report.codes()
    assert scene.lights["profile"].tolist() == [0]
    assert scene.profiles[0].source == str(tmp_path / file)
    assert toward(scene, (0, 0, -1)) == pytest.approx(600.0)
    assert toward(scene, (0, 0, 1)) == 0.0
    assert toward(scene, (1, 0, 0)) == pytest.approx(15.0, abs=ROUNDED)
    assert toward(scene, (0, -1, 0)) == pytest.approx(9.0, abs=ROUNDED)
    assert toward(scene, (1, 1, -math.sqrt(2.0))) == pytest.approx(1.5 * 260.0)


def test_a_turned_lamp_turns_its_file(stage: Usd.Stage, tmp_path: Path) -> None:
    # All planes differ: C 0 is 1, C 90 is 2, and so on, at gamma 90.
    rows = [[50, 10 * i] for i in (1, 2, 3, 4)]
    (tmp_path / "a.ies").write_text(ies_text(rows, planes=(0, 90, 180, 270), angles=(0, 90)))
    xform = UsdGeom.Xform.Define(stage, "/Pole")
    xform.AddRotateZOp().Set(90.0)  # +X of the lamp is +Y of the world
    lamp(stage, "./a.ies", "/Pole/Lamp")
    scene, _ = read(stage)
    sides = [(0, 1, 0), (-1, 0, 0), (0, -1, 0), (1, 0, 0)]
    assert [toward(scene, side) for side in sides] == pytest.approx([10, 20, 30, 40], rel=1e-5)
    assert toward(scene, (0, 0, -1)) == pytest.approx(50.0)


def test_a_file_is_read_once(stage: Usd.Stage, tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(ies_text())
    (tmp_path / "b.ies").write_text(ies_text([1, 2], planes=(0,), angles=(0, 90)))
    for index, file in enumerate(("a", "b", "a")):
        lamp(stage, f"./{file}.ies", f"/Lamp{index}")
    UsdLux.SphereLight.Define(stage, "/Plain")
    instancer = UsdGeom.PointInstancer.Define(stage, "/Many")
    lamp(stage, "./b.ies", "/Many/Lamp")
    instancer.CreatePrototypesRel().SetTargets([Sdf.Path("/Many/Lamp")])
    instancer.CreateProtoIndicesAttr([0, 0])
    instancer.CreatePositionsAttr([Gf.Vec3f(0), Gf.Vec3f(1)])
    report = Report()
    reader = StageReader(stage, report)
    scene = reader.read(0.0, Camera())
    assert scene.lights["profile"].tolist() == [0, 1, 0, -1, 1, 1]
    assert len(scene.profiles) == 2
    assert reader.read(1.0, Camera()).profiles is scene.profiles


def test_a_file_in_a_package(stage: Usd.Stage, tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(ies_text(tilt="TILT=a.tlt"))
    (tmp_path / "a.tlt").write_text("1 2 0 90 0.5 1")
    lamp(stage, "./a.ies")
    stage.Save()
    package = tmp_path / "street.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "street.usda"), str(package))
    scene, report = read(Usd.Stage.Open(str(package)))
    assert report.codes() == {"profile-tilt"}  # the package does not hold what a file names
    assert toward(scene, (0, 0, -1)) == pytest.approx(400.0)
    scene, report = read(stage)
    assert toward(scene, (0, 0, -1)) == pytest.approx(200.0)


@pytest.mark.parametrize(
    ("path", "name", "wanted"),
    [
        ("/a/lamp.ies", "t.tlt", "/a/t.tlt"),
        ("/a/lamp.ies", "..\\..\\etc/t.tlt", "/a/t.tlt"),
        ("/a [1]/lamp[1].ies", "t[2].tlt", "/a [1]/t[2].tlt"),
        ("/a/b.usdz[lamp.ies]", "t.tlt", "/a/b.usdz[t.tlt]"),
        ("/a/b.usdz[0/lamp.ies]", "/t.tlt", "/a/b.usdz[0/t.tlt]"),
    ],
)
def test_a_tilt_file_lies_beside(path: str, name: str, wanted: str) -> None:
    assert beside(path, name) == wanted


@pytest.mark.parametrize(
    ("content", "code"),
    [(None, "profile-missing"), ("IESNA91\n", "profile-invalid"), ("\0" * 9, "profile-invalid")],
)
def test_a_light_without_its_file_is_left_out(
    stage: Usd.Stage, tmp_path: Path, content: str | None, code: str
) -> None:
    if content is not None:
        (tmp_path / "a.ies").write_text(content)
    lamp(stage, "./a.ies", multiplier=3.0)
    scene, report = read(stage)
    assert report.codes() == {code}
    assert scene.lights["intensity"].tolist() == [[0.0, 0.0, 0.0]]
    assert scene.lights["profile"].tolist() == [-1]
    assert scene.profiles == ()


def test_a_normalized_light_without_its_file_shines_evenly(stage: Usd.Stage) -> None:
    lamp(stage, "./a.ies", multiplier=3.0, normalize=True)
    scene, report = read(stage)
    assert report.codes() == {"profile-missing"}
    assert scene.lights["intensity"][0] == pytest.approx([3.0] * 3)


def test_normalize_keeps_the_lumens(stage: Usd.Stage, tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(HALF)
    lamp(stage, "./a.ies", multiplier=30.0, normalize=True)
    scene, report = read(stage)
    assert report.codes() == {"profile-normalize"}
    # 30 cd all round are 120 pi lumens; in one half that is 60 cd.
    assert toward(scene, (0, 0, -1)) == pytest.approx(60.0)
    assert toward(scene, (0.1, 0, 1)) == 0.0


@pytest.mark.parametrize(
    ("scale", "gamma", "shown"),
    [  # by the schema's formulas: gamma of the file for a gamma of the light
        (0.5, 30.0, 60.0),
        (2.0, 30.0, 15.0),
        (-0.5, 150.0, 120.0),
        (-2.0, 100.0, 140.0),
        (-2.0, 0.0, 90.0),
        (0.5, 100.0, None),  # beyond 180: nothing there
    ],
)
def test_angle_scale(
    stage: Usd.Stage, tmp_path: Path, scale: float, gamma: float, shown: float | None
) -> None:
    angles = np.arange(0, 181, 10)
    (tmp_path / "a.ies").write_text(ies_text(angles + 1, planes=(0,), angles=angles.tolist()))
    lamp(stage, "./a.ies", angleScale=scale)
    scene, _ = read(stage)
    turn = math.radians(gamma)
    got = toward(scene, (math.sin(turn), 0.0, -math.cos(turn)))
    assert got == pytest.approx(0.0 if shown is None else shown + 1.0, rel=1e-5)


def test_an_angle_scale_that_moves_shares_its_candela(stage: Usd.Stage, tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(ies_text())
    prim = lamp(stage, "./a.ies")
    attribute = prim.GetAttribute("inputs:shaping:ies:angleScale")
    attribute.Set(1.0, 0.0)
    attribute.Set(2.0, 10.0)
    reader = StageReader(stage, Report())
    scenes = [reader.read(float(time), Camera()) for time in range(11)]
    assert [scene.lights["profile"][0] for scene in scenes] == list(range(11))
    assert len({id(p.candela) for p in scenes[-1].profiles}) == 1


def test_types_a_and_b_say_how_they_lie(stage: Usd.Stage, tmp_path: Path) -> None:
    rows = [[10, 20], [30, 40]]
    text = ies_text(rows, planes=(-10, 10), angles=(-5, 5), type="B")
    (tmp_path / "a.ies").write_text(text)
    lamp(stage, "./a.ies", angleScale=2.0)
    scene, report = read(stage)
    assert report.codes() == {"profile-axes", "profile-angle-scale"}
    assert toward(scene, (0, 0, -1)) == pytest.approx(25.0)
    right, up = math.tan(math.radians(9.9)), math.tan(math.radians(4.9))
    assert toward(scene, (right, up, -1)) == pytest.approx(40.0, rel=0.02)
    assert toward(scene, (-right, up, -1)) == pytest.approx(20.0, rel=0.03)
    assert toward(scene, (right, -up, -1)) == pytest.approx(30.0, rel=0.03)


def test_uneven_angles_are_a_finding(stage: Usd.Stage, tmp_path: Path) -> None:
    angles = [0, 10.0 * math.sqrt(2.0), 31.0, 10 * math.pi, 77.7, 90.0]
    (tmp_path / "a.ies").write_text(ies_text([9, 7, 2, 8, 3, 0], planes=(0,), angles=angles))
    lamp(stage, "./a.ies")
    _, report = read(stage)
    assert report.codes() == {"profile-resampled"}


def test_a_sun_takes_no_file(stage: Usd.Stage, tmp_path: Path) -> None:
    (tmp_path / "a.ies").write_text(ies_text())
    sun = UsdLux.DistantLight.Define(stage, "/Sun")
    shaping = UsdLux.ShapingAPI.Apply(sun.GetPrim())
    shaping.CreateShapingIesFileAttr(Sdf.AssetPath("./a.ies"))
    scene, report = read(stage)
    assert "profile-unused" in report.codes()
    assert scene.lights["profile"].tolist() == [-1]


def test_a_stage_of_large_profiles_is_bounded(
    stage: Usd.Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hdrusd.usd.profile.MOST_CELLS", 100)
    for name in "ab":
        (tmp_path / f"{name}.ies").write_text(ies_text())  # 8 x 4 cells unfolded
    (tmp_path / "c.ies").write_text(ies_text([1] * 73, planes=(0,), angles=np.arange(73).tolist()))
    for name in "acb":
        lamp(stage, f"./{name}.ies", f"/Lamp_{name}")
    scene, report = read(stage)
    assert scene.lights["profile"].tolist() == [0, -1, 1]
    assert report.codes() == {"profile-invalid"}
