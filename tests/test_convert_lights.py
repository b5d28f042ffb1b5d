"""Convert: exact light units, and what the photometry file says of lights and nodes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import gltf_lights, osgt_light
from converted import (
    MOON,
    POINT,
    SPOT,
    lights,
    luminance,
    material,
    opened,
    run,
    sidecar,
    surface,
)
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.checking import validate
from hdrusd.errors import InputError
from hdrusd.usd.light import read_light_row
from hdrusd.usd.lux import read_lux

# -- exact light units --------------------------------------------------------------------


def emissive_gltf(path: Path, nodes: list[dict[str, Any]] | None = None) -> Path:
    """The three lights, and a triangle that shines with 20,000 cd/m2."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    path.with_suffix(".bin").write_bytes(points)
    name = "KHR_lights_punctual"
    nodes = nodes or [
        {"name": "point", "translation": [1, 2, 3], "extensions": {name: {"light": 0}}},
        {"name": "spot", "translation": [0, 5, 0], "extensions": {name: {"light": 1}}},
        {"name": "moon", "extensions": {name: {"light": 2}}},
        {"name": "panel", "mesh": 0},
    ]
    return gltf_lights(
        path,
        [POINT, SPOT, MOON],
        nodes,
        extensionsUsed=[name, "KHR_materials_emissive_strength"],
        buffers=[{"uri": path.with_suffix(".bin").name, "byteLength": len(points)}],
        bufferViews=[{"buffer": 0, "byteLength": len(points)}],
        accessors=[{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        materials=[
            {
                "name": "screen",
                "emissiveFactor": [1, 1, 1],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20_000}},
            }
        ],
    )


@pytest.mark.parametrize("unit", [1.0, 0.01])
@pytest.mark.parametrize("scale", [None, [4.0, 4.0, 4.0], [-1.0, 1.0, 1.0], [1.0, 2.0, 5.0]])
def test_light_units_are_exact(tmp_path: Path, unit: float, scale: list[float] | None) -> None:
    name = "KHR_lights_punctual"
    nodes: list[dict[str, Any]] = [
        {"name": "above", "children": [1, 2, 3, 4], "rotation": [0.0, 0.6, 0.0, 0.8]},
        {"name": "point", "translation": [1, 2, 3], "extensions": {name: {"light": 0}}},
        {"name": "spot", "rotation": [0.6, 0, 0, 0.8], "extensions": {name: {"light": 1}}},
        {"name": "moon", "extensions": {name: {"light": 2}}},
        {"name": "panel", "mesh": 0},
    ]
    if scale is not None:
        nodes[0]["scale"] = scale
    result = run(emissive_gltf(tmp_path / "units.gltf", nodes), meters_per_unit=unit)
    stage = opened(result)
    assert UsdGeom.GetStageMetersPerUnit(stage) == unit
    found = lights(stage)
    for key, stated in (("point", POINT), ("spot", SPOT), ("moon", MOON)):
        reading = read_lux(found[key])
        assert reading is not None
        wanted = np.multiply(stated.get("color", [1.0] * 3), stated["intensity"])
        assert reading.intensity == pytest.approx(wanted, rel=1e-5)
        attribute = "illuminance" if key == "moon" else "luminousIntensity"
        stated_by_schema = found[key].GetAttribute(f"inputs:photometric:{attribute}").Get()
        assert stated_by_schema == pytest.approx(luminance(wanted), rel=1e-5)
    for key in ("point", "spot"):
        reading = read_lux(found[key])
        assert reading is not None
        assert reading.radius == pytest.approx(0.05, rel=1e-5)  # a lamp is not scaled by its node
    screen = surface(stage, "screen").GetInput("emissiveColor").Get()
    assert luminance(screen) == pytest.approx(20_000.0, rel=1e-5)
    glow = material(stage, "screen").GetPrim().GetAttribute("photometric:luminance").Get()
    assert glow == pytest.approx(20_000.0, rel=1e-5)
    assert [p for p in validate(stage) if p.severity == "error"] == []


@pytest.mark.parametrize("unit", [1.0, 0.01])
@pytest.mark.parametrize("scale", [[1.0, 1.0, 1.0], [3.0, 3.0, 3.0], [3.0, 1.0, 0.5]])
def test_lights_stand_and_aim_where_the_source_has_them(
    tmp_path: Path, unit: float, scale: list[float]
) -> None:
    name = "KHR_lights_punctual"
    turn = [0.5, 0.1, 0.7, 0.5]
    turn = (np.array(turn) / np.linalg.norm(turn)).tolist()
    nodes: list[dict[str, Any]] = [
        {"name": "above", "children": [1], "scale": scale},
        {
            "name": "spot",
            "translation": [1, 2, 3],
            "rotation": turn,
            "extensions": {name: {"light": 0}},
        },
    ]
    result = run(gltf_lights(tmp_path / "aim.gltf", [SPOT], nodes), meters_per_unit=unit)
    stage = opened(result)
    prim = lights(stage)["spot_2" if "spot" not in lights(stage) else "spot"]
    world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
    row = read_light_row(prim, Usd.TimeCode(0), world, unit, result.report)
    assert row is not None
    assert row["position"][0] == pytest.approx(np.multiply([1, 2, 3], scale), rel=1e-9)
    x, y, z, w = turn
    # -Z turned by the quaternion, then stretched by the node above.
    axis = np.multiply(
        [-2 * (x * z + w * y), -2 * (y * z - w * x), -(1 - 2 * (x * x + y * y))], scale
    )
    assert row["axis"][0] == pytest.approx(axis / np.linalg.norm(axis), abs=1e-9)


def test_range_is_kept_and_not_applied(tmp_path: Path) -> None:
    result = run(gltf_lights(tmp_path / "range.gltf", [POINT | {"range": 25.0}]))
    prim = lights(opened(result))["point"]
    assert prim.GetAttribute("photometric:legacy:range").Get() == 25.0
    assert luminance(read_lux(prim).intensity) == pytest.approx(820.86, rel=1e-5)
    assert "light-range" in result.report.codes()


def test_an_opengl_light_is_estimated_and_says_so(tmp_path: Path) -> None:
    source = osgt_light(tmp_path / "lamp.osgt", {"QuadraticAttenuation": "0.01"})
    result = run(source)
    (prim,) = lights(opened(result)).values()
    # k = (1, 0, 0.01): half is left at 10 m; 20 lx there: 20 * 0.5 * 10^2 = 1000 cd.
    assert prim.GetAttribute("inputs:photometric:luminousIntensity").Get() == pytest.approx(1000.0)
    assert prim.GetAttribute("photometric:provenance").Get() == "estimated"
    assert prim.GetAttribute("photometric:rule").Get() == "night-20lx"
    attenuation = prim.GetAttribute("photometric:legacy:attenuation").Get()
    assert attenuation == Gf.Vec3f(1, 0, 0.01)
    assert {"light-estimate", "light-attenuation"} <= result.report.codes()
    day = run(source, estimate="day-10000lx")
    assert day.lights[0]["value"] == pytest.approx(500_000.0, rel=1e-6)


def test_source_unit_counts_for_places_and_estimates(tmp_path: Path) -> None:
    light = {"QuadraticAttenuation": "0.01", "Position": "10 0 0 1"}
    result = run(osgt_light(tmp_path / "feet.osgt", light), source_unit=0.3048)
    stage = opened(result)
    (prim,) = lights(stage).values()
    world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
    assert world.ExtractTranslation()[0] == pytest.approx(3.048)
    assert result.lights[0]["value"] == pytest.approx(20 * 0.5 * 3.048**2, rel=1e-6)


# -- photometry.toml ----------------------------------------------------------------------


def test_the_photometry_file_overrides_lights(tmp_path: Path) -> None:
    source = gltf_lights(tmp_path / "street.gltf", [POINT, MOON])
    sidecar(
        tmp_path,
        '[[light]]\nmatch = "poi*"\ncandela = 5000\nradius = 0.2\ntemperature = 2000\n'
        'provenance = "measured"\nsource = "data sheet"\n'
        '[[light]]\nmatch = "moon"\nilluminance = 0.1\n'
        '[ambient]\nilluminance = 0.05\ncolor = [1, 0.5, 0.25]\nsource = "meter"\n',
    )
    result = run(source)
    stage = opened(result)
    found = lights(stage)
    point = read_lux(found["point"])
    assert point is not None
    assert luminance(point.intensity) == pytest.approx(5000.0, rel=1e-5)
    assert point.radius == pytest.approx(0.2, rel=1e-6)
    sodium = UsdLux.BlackbodyTemperatureAsRgb(2000)
    assert np.divide(point.intensity, 5000.0) == pytest.approx(np.array(sodium), abs=1e-5)
    assert found["point"].GetAttribute("photometric:provenance").Get() == "measured"
    assert found["point"].GetAttribute("photometric:source").Get() == "data sheet"
    assert luminance(read_lux(found["moon"]).intensity) == pytest.approx(0.1, rel=1e-5)
    root = stage.GetDefaultPrim()
    assert root.GetAttribute("photometric:ambient:illuminance").Get() == pytest.approx(0.05)
    (sky,) = root.GetRelationship("photometric:ambient:light").GetTargets()
    dome = read_lux(stage.GetPrimAtPath(sky))
    hue = np.array([1, 0.5, 0.25]) / luminance([1, 0.5, 0.25])
    assert dome.intensity == pytest.approx(0.05 * hue, rel=1e-5)
    assert {row["name"]: row["value"] for row in result.lights} == {
        "point": 5000.0,
        "moon": 0.1,
        "Sky": 0.05,
    }


def test_wrong_units_and_patterns_that_match_nothing_are_findings(tmp_path: Path) -> None:
    source = gltf_lights(tmp_path / "street.gltf", [POINT])
    sidecar(
        tmp_path,
        '[[light]]\nmatch = "point"\nilluminance = 3\n[[light]]\nmatch = "sun"\ncandela = 1\n'
        '[[material]]\nmatch = "none"\n[[node]]\nmatch = "none"\n[[camera]]\nmatch = "none"\n',
    )
    result = run(source)
    assert sum(f.code == "sidecar-no-match" for f in result.report) == 4
    assert "sidecar-unit" in result.report.codes()
    assert result.lights[0]["value"] == pytest.approx(820.86)


def test_a_photometry_file_elsewhere_is_taken_instead(tmp_path: Path) -> None:
    source = gltf_lights(tmp_path / "a" / "street.gltf", [POINT])
    sidecar(tmp_path / "a", '[[light]]\nmatch = "*"\ncandela = 1\n')
    other = tmp_path / "other.toml"
    other.write_text('[[light]]\nmatch = "*"\ncandela = 2\n')
    assert run(source, tmp_path / "out.usda", photometry=other).lights[0]["value"] == 2.0
    with pytest.raises(InputError, match=r"none\.toml: no such file"):
        run(source, tmp_path / "out2.usda", photometry=tmp_path / "none.toml")


def test_nodes_are_shown_and_hidden_and_become_cameras(tmp_path: Path) -> None:
    nodes = [
        {"name": "Debug", "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"name": "Driver", "translation": [0, 1.2, 5]},
        {"name": "Passenger", "translation": [1, 1.2, 5]},
    ]
    source = gltf_lights(tmp_path / "street.gltf", [POINT], nodes)
    sidecar(
        tmp_path,
        '[[node]]\nmatch = "Debug"\nvisible = false\n'
        '[[camera]]\nmatch = "*er"\nfov = 60\nnear = 0.5\nfar = 200\n',
    )
    stage = opened(run(source, meters_per_unit=0.01))
    debug = stage.GetPrimAtPath("/street/Debug")
    assert UsdGeom.Imageable(debug).ComputeVisibility() == "invisible"
    cameras = [UsdGeom.Camera(p) for p in stage.Traverse() if p.IsA(UsdGeom.Camera)]
    assert len(cameras) == 2
    lens = cameras[0].GetCamera(0)
    assert lens.GetFieldOfView(Gf.Camera.FOVVertical) == pytest.approx(60.0, rel=1e-6)
    assert lens.clippingRange.min == pytest.approx(50.0)  # scene units: 0.5 m in centimetres
    assert lens.clippingRange.max == pytest.approx(20_000.0)
    settings = stage.GetPrimAtPath("/Render/Settings")
    assert settings.GetRelationship("camera").GetTargets() == [cameras[0].GetPath()]


def test_a_camera_looks_along_minus_z_of_its_node(tmp_path: Path) -> None:
    """A quarter turn about Y has -Z along -X; 45 degrees high if nobody says, 16:9 wide."""
    turned = {"name": "Driver", "translation": [0, 1, 5], "rotation": [0, 0.5**0.5, 0, 0.5**0.5]}
    lamp = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    source = gltf_lights(tmp_path / "a.gltf", [POINT], [turned | lamp])
    sidecar(tmp_path, '[[camera]]\nmatch = "Driver"\n')
    stage = opened(run(source))
    (camera,) = (UsdGeom.Camera(p) for p in stage.Traverse() if p.IsA(UsdGeom.Camera))
    lens = camera.GetCamera(0)
    assert tuple(lens.frustum.position) == pytest.approx((0, 1, 5))
    assert tuple(lens.frustum.ComputeViewDirection()) == pytest.approx((-1, 0, 0), abs=1e-7)
    assert tuple(lens.frustum.ComputeUpVector()) == pytest.approx((0, 1, 0), abs=1e-7)
    assert lens.GetFieldOfView(Gf.Camera.FOVVertical) == pytest.approx(45.0, rel=1e-6)
    assert lens.aspectRatio == pytest.approx(16 / 9, rel=1e-6)
    assert lens.clippingRange.min == pytest.approx(0.1)
    assert lens.clippingRange.max == pytest.approx(10_000.0)


# -- the report ---------------------------------------------------------------------------


def test_the_report_has_every_finding_and_every_light(tmp_path: Path) -> None:
    source = gltf_lights(tmp_path / "street.gltf", [POINT | {"range": 9.0}, MOON])
    document = json.loads(json.dumps(run(source).as_dict()))
    assert document["format"].startswith("hdrusd-report/")
    codes = {finding["code"] for finding in document["findings"]}
    assert {"light-range", "lamp-radius"} <= codes
    assert all(finding["file"] and finding["text"] for finding in document["findings"])
    point, moon = document["lights"]
    assert (point["name"], point["unit"], point["kind"]) == ("point", "cd", "point")
    assert point["source_value"]["candela"] == 1000.0
    assert point["source_value"]["diffuse"] == [1.0, 0.8, 0.5]
    assert point["value"] == pytest.approx(820.86)
    assert (moon["unit"], moon["source_value"]["lux"]) == ("lx", 0.25)
    assert Sdf.Path(point["path"]).IsAbsolutePath()


def test_an_ambient_light_yields_to_the_photometry_file(tmp_path: Path) -> None:
    source = osgt_light(
        tmp_path / "lamp.osgt",
        {"Ambient": "0.5 0.5 0.5 1", "Diffuse": "0 0 0 1", "Specular": "0 0 0 1"},
    )
    guessed = run(source)
    assert guessed.lights[0]["value"] == pytest.approx(10.0)  # half of 20 lx
    assert "ambient-estimate" in guessed.report.codes()
    sidecar(tmp_path, "[ambient]\nilluminance = 0.3\n")
    stated = run(source)
    assert [row["value"] for row in stated.lights] == [pytest.approx(0.3)]
    assert "ambient-estimate" not in stated.report.codes()
    assert "ambient-replaced" in stated.report.codes()
