"""Convert a stage: opinions where composition hears them, in variants and below instances."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from builders import png
from converted import opened, run
from overlaid import lamp, paint, stage_file
from pxr import Sdf, Usd, UsdGeom, UsdShade

from hdrusd.conversion import Result
from hdrusd.usd.overs import CLASSES

WALL = "asset inputs:file = @./wall.png@"
LAMP = lamp("SphereLight", "float inputs:intensity = 100\nfloat inputs:radius = 0.1")
CANDELA = 100 * math.pi * 0.01


def asset(folder: Path) -> Path:
    """A car with a lamp and a paint, to be referred to."""
    png(folder / "wall.png")
    return stage_file(folder / "car.usda", LAMP, paint("/World/paint", WALL))


def map_of(stage: Usd.Stage, path: str) -> str:
    """The name of the picture on the diffuse colour of a material."""
    shader = UsdShade.Material(stage.GetPrimAtPath(path)).ComputeSurfaceSource()[0]
    sources, _ = shader.GetInput("diffuseColor").GetConnectedSources()
    file = UsdShade.Shader(sources[0].source.GetPrim()).GetInput("file").Get()
    assert Path(file.resolvedPath).is_file()
    return Path(file.resolvedPath).name


def candela(stage: Usd.Stage, path: str) -> float:
    stated = stage.GetPrimAtPath(path).GetAttribute("inputs:photometric:luminousIntensity")
    return float(stated.Get())


def photometry(result: Result) -> Sdf.Layer:
    return Sdf.Layer.FindOrOpen(str(result.output.with_suffix(".photometry.usda")))


def instance(name: str, extra: str = "", file: str = "car.usda") -> str:
    return (
        f'def "{name}" (\n    instanceable = true\n    references = @{file}@\n)\n{{\n{extra}\n}}\n'
    )


def test_instances_stay_instances_of_one_prototype(tmp_path: Path) -> None:
    asset(tmp_path)
    source = stage_file(tmp_path / "town.usda", *(instance(f"Car_{i}") for i in range(3)))
    result = run(source, tmp_path / "night.usda")
    stage = opened(result)
    (prototype,) = stage.GetPrototypes()
    assert len(prototype.GetInstances()) == 3
    for index in range(3):
        assert map_of(stage, f"/World/Car_{index}/paint").startswith("wall_R_")
        assert candela(stage, f"/World/Car_{index}/Lamp") == pytest.approx(CANDELA, rel=2e-7)
    # Written once, in a class, which is not shown.
    assert len(photometry(result).GetPrimAtPath(CLASSES).nameChildren) == 1
    assert stage.GetPrimAtPath(CLASSES).IsAbstract()
    (row,) = result.lights
    assert row["lamps"] == 3


def test_instances_inside_instances(tmp_path: Path) -> None:
    asset(tmp_path)
    stage_file(tmp_path / "row.usda", instance("A"), instance("B"))
    source = stage_file(
        tmp_path / "town.usda", *(instance(f"Row_{i}", file="row.usda") for i in range(2))
    )
    stage = opened(run(source, tmp_path / "night.usda"))
    assert len(stage.GetPrototypes()) == 2  # the row and the car
    for path in ("Row_0/A", "Row_0/B", "Row_1/A", "Row_1/B"):
        assert map_of(stage, f"/World/{path}/paint").startswith("wall_R_")
        assert candela(stage, f"/World/{path}/Lamp") == pytest.approx(CANDELA, rel=2e-7)


def test_instances_of_different_size_have_no_candela_in_common(tmp_path: Path) -> None:
    asset(tmp_path)
    grown = 'float3 xformOp:scale = (2, 2, 2)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    source = stage_file(tmp_path / "town.usda", instance("A"), instance("B", grown))
    result = run(source, tmp_path / "night.usda")
    assert "usd-light-copies" in result.report.codes()
    prim = opened(result).GetPrimAtPath("/World/B/Lamp")
    stated = prim.GetAttribute("inputs:photometric:luminousIntensity")
    assert not stated.HasAuthoredValue()
    assert prim.GetAttribute("inputs:intensity").Get() == 100.0  # nits hold at any size


VARIANTS = """\
def Xform "Car" (
    variants = {
        string paint = "red"
    }
    prepend variantSets = "paint"
)
{
    variantSet "paint" = {
        "blue" {
            def Scope "Looks" { %s }
        }
        "red" {
            def Scope "Looks" { %s }
        }
    }
}
"""


def test_each_variant_has_its_own_maps(tmp_path: Path) -> None:
    png(tmp_path / "red.png")
    png(tmp_path / "blue.png")
    looks = [
        "\n" + paint("/World/Car/Looks/paint", f"asset inputs:file = @./{color}.png@") + "\n"
        for color in ("blue", "red")
    ]
    source = stage_file(tmp_path / "town.usda", VARIANTS % tuple(looks))
    result = run(source, tmp_path / "night.usda")
    stage = opened(result)
    car = stage.GetPrimAtPath("/World/Car").GetVariantSet("paint")
    assert (car.GetVariantSelection(), car.GetVariantNames()) == ("red", ["blue", "red"])
    assert map_of(stage, "/World/Car/Looks/paint").startswith("red_R_")
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        car.SetVariantSelection("blue")
    assert map_of(stage, "/World/Car/Looks/paint").startswith("blue_R_")


def test_variants_that_bring_assets_with_variants_of_their_own(tmp_path: Path) -> None:
    """What a variant refers to is there only in it; what that chooses itself, only in both."""
    asset(tmp_path)
    inner = """\
def "Wheel" (
    variants = { string kind = "plain" }
    prepend variantSets = "kind"
)
{
    variantSet "kind" = {
        "plain" {
        }
        "car" ( references = @car.usda@ ) {
        }
    }
}
"""
    stage_file(tmp_path / "axle.usda", inner)
    outer = """\
def "Part" (
    variants = { string part = "none" }
    prepend variantSets = "part"
)
{
    variantSet "part" = {
        "axle" ( references = @axle.usda@ ) {
        }
        "none" {
        }
    }
}
"""
    source = stage_file(tmp_path / "town.usda", outer)
    stage = opened(run(source, tmp_path / "night.usda"))
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        stage.GetPrimAtPath("/World/Part").GetVariantSet("part").SetVariantSelection("axle")
        wheel = stage.GetPrimAtPath("/World/Part/Wheel")
        wheel.GetVariantSet("kind").SetVariantSelection("car")
    assert map_of(stage, "/World/Part/Wheel/paint").startswith("wall_R_")
    assert candela(stage, "/World/Part/Wheel/Lamp") == pytest.approx(CANDELA, rel=2e-7)


def test_what_composition_says_is_the_source_s(tmp_path: Path) -> None:
    """Cameras, settings, animation and skins are where they were: the source is a sublayer."""
    head = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 0.01\n    upAxis = "Z"\n'
    head += "    timeCodesPerSecond = 30\n    startTimeCode = 1\n    endTimeCode = 9\n"
    head += '    renderSettingsPrimPath = "/World/Settings"\n)\n'
    camera = 'def Camera "Eye"\n{\n    float focalLength.timeSamples = { 1: 20, 9: 50 }\n}\n'
    source = stage_file(
        tmp_path / "town.usda", camera, 'def RenderSettings "Settings"\n{\n}', head=head
    )
    before = Usd.Stage.Open(str(source))
    after = opened(run(source, tmp_path / "deep" / "night.usda"))
    for key in ("metersPerUnit", "upAxis", "timeCodesPerSecond", "endTimeCode", "defaultPrim"):
        assert after.GetMetadata(key) == before.GetMetadata(key)
    assert after.GetMetadata("renderSettingsPrimPath") == "/World/Settings"
    eye = UsdGeom.Camera(after.GetPrimAtPath("/World/Eye")).GetFocalLengthAttr()
    assert [eye.Get(time) for time in (1, 5, 9)] == [20.0, 35.0, 50.0]
    root = after.GetRootLayer()
    assert list(root.subLayerPaths) == ["./night.photometry.usda", "../town.usda"]
