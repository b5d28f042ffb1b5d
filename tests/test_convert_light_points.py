"""Light points from a database to the picture: their illuminance, their luminance, the report."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from converted import lights, luminance, opened, run, sidecar
from pxr import Usd, UsdGeom

from hdrusd.checking import validate
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.units import LUMINANCE_WEIGHTS

SIZE = (64, 36)  # as a camera of the recipe has it
FOV = 50.0

#: Beside what the camera sees of the floor, 1 m above it or so.
PLACES = [(-3.0, 0.5, 1.0), (-3.0, -1.5, 0.5), (3.0, 0.0, 2.0), (3.5, 1.0, 1.0), (0.0, 4.0, 1.5)]

FLOOR = """\
osg::Geode {
 Name "floor"
 StateSet TRUE {
  osg::StateSet {
   AttributeList 1 {
    osg::Material {
     Name "floor"
     Ambient TRUE Front 0 0 0 1 Back 0 0 0 1
     Diffuse TRUE Front 0.5 0.5 0.5 1 Back 0.5 0.5 0.5 1
     Specular TRUE Front 0 0 0 1 Back 0 0 0 1
     Emission TRUE Front 0 0 0 1 Back 0 0 0 1
    }
    Value OFF
   }
  }
 }
 Drawables 1 {
  osg::Geometry {
   PrimitiveSetList 1 {
    osg::DrawArrays {
     Mode QUADS
     Count 4
    }
   }
   VertexArray TRUE {
    osg::Vec3Array {
     Binding BIND_PER_VERTEX
     vector 4 {
      -9 -9 0
      9 -9 0
      9 9 0
      -9 9 0
     }
    }
   }
  }
 }
}
"""


def street(
    path: Path,
    places: list[tuple[float, ...]],
    *,
    sector: str = "FALSE",
    color: str = "1 1 1",
    attributes: str = "1 0.05",
    eye: str = "0 0 4",
) -> Path:
    """A floor of reflectance 0.5, an eye that looks down, and light points."""
    points = "".join(
        f"LightPoint {{\nPosition {' '.join(map(str, place))}\nColor {color} 1\n"
        f"Attributes TRUE 1 {attributes}\nSector {sector}\nBlinkSequence FALSE\n}}\n"
        for place in places
    )
    node = (
        f'osgSim::LightPointNode {{\nName "studs"\nLightPointList {len(places)} {{\n{points}}}\n}}'
    )
    matrix = f"1 0 0 0\n0 1 0 0\n0 0 1 0\n{eye} 1"
    above = f'osg::MatrixTransform {{\nName "Eye"\nMatrix {{\n{matrix}\n}}\n}}'
    path.write_text(
        "#Ascii Scene\n#Version 161\n#Generator OpenSceneGraph 3.6.5\n\n"
        f"osg::Group {{\nChildren 3 {{\n{FLOOR}{node}\n{above}\n}}\n}}\n"
    )
    return path


CAMERA = f'[[camera]]\nmatch = "Eye"\nfov = {FOV}\nnear = 0.01\n'


def cone(axis: tuple[float, ...], angle: float) -> str:
    """A sector of .osgt; ``angle``: from the axis, degrees."""
    way = " ".join(map(str, axis))
    return f"TRUE {{\nosgSim::ConeSector {{\nAxis {way}\nAngle {math.radians(angle)} 0\n}}\n}}"


def picture(gl: Any, stage: Path) -> tuple[np.ndarray, Report]:
    """The luminance (36, 64) in cd/m2, and the findings."""
    report = Report()
    (frame,) = render_sequence(gl, Job(stage, width=SIZE[0], height=SIZE[1]), report)
    return np.asarray(frame.hdr, np.float64) @ LUMINANCE_WEIGHTS, report


def floor_points(height: float = 4.0) -> np.ndarray:
    """(36, 64, 3) what the middles of the pixels see of the floor."""
    half = height * math.tan(math.radians(FOV / 2.0))
    x = ((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2.0 - 1.0) * half * SIZE[0] / SIZE[1]
    y = (1.0 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2.0) * half
    return np.stack([*np.meshgrid(x, y), np.zeros(SIZE[::-1])], axis=-1)


def way_to(place: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """From the floor to a lamp: unit vectors and distances."""
    way = np.array(place) - floor_points()
    distance = np.linalg.norm(way, axis=-1)
    return way / distance[..., None], distance


def test_a_string_lights_the_floor(gl: Any, tmp_path: Path) -> None:
    """E = sum I cos / d^2, L = R E / pi."""
    sidecar(tmp_path, CAMERA + '[[light]]\nmatch = "studs"\ncandela = 300\n')
    result = run(street(tmp_path / "a.osgt", PLACES))
    shown, report = picture(gl, result.output)
    lux = np.zeros(SIZE[::-1])
    for place in PLACES:
        way, distance = way_to(place)
        lux += 300.0 * way[..., 2] / distance**2
    # Places, 8 m at most, are known to 2^-22 of a metre, and 1 / d^3 thrice as well as d >= 1 m;
    # some twenty further roundings of 2^-24.
    np.testing.assert_allclose(shown, 0.5 * lux / math.pi, rtol=5e-6)
    assert "default-sky" not in report.codes()
    (row,) = result.lights
    assert (row["lamps"], row["value"], row["unit"], row["name"]) == (5, 300.0, "cd", "studs")


def test_beams_light_what_they_are_aimed_at(gl: Any, tmp_path: Path) -> None:
    """Cones of 30 degrees about a way down and inwards; a hundredth of a degree about the edge."""
    axis = (1.0, 0.0, -0.5)
    sidecar(tmp_path, CAMERA + '[[light]]\nmatch = "studs"\ncandela = 300\n')
    source = street(tmp_path / "a.osgt", PLACES[:2], sector=cone(axis, 30.0))
    shown, report = picture(gl, run(source).output)
    lux, edge = np.zeros(SIZE[::-1]), np.zeros(SIZE[::-1], np.bool_)
    for place in PLACES[:2]:
        way, distance = way_to(place)
        angle = np.degrees(np.arccos(-way @ (np.array(axis) / np.linalg.norm(axis))))
        lux += np.where(angle < 30.0, 300.0 * way[..., 2] / distance**2, 0.0)
        edge |= np.abs(angle - 30.0) < 0.01
    assert (lux[~edge] == 0.0).any()
    np.testing.assert_allclose(shown[~edge], 0.5 * lux[~edge] / math.pi, rtol=5e-6)
    assert "light-not-seen" not in report.codes()


@pytest.mark.parametrize("sector", ["FALSE", cone((0.0, 0.0, 1.0), 20.0)], ids=["ball", "beam"])
def test_a_lamp_is_seen_at_its_luminance(gl: Any, tmp_path: Path, sector: str) -> None:
    """I / (pi r^2), r being the point's own radius."""
    sidecar(tmp_path, CAMERA + '[[light]]\nmatch = "studs"\ncandela = 7\n')
    places = [(0.0, 0.0, 3.0), (0.0, 0.0, 1.0)]  # the nearer stands before the other
    source = street(tmp_path / "a.osgt", places, sector=sector, attributes="1 0.1")
    shown, _ = picture(gl, run(source).output)
    assert shown[18, 32] == pytest.approx(7.0 / (math.pi * 0.1**2), rel=1e-5)


def test_a_beam_from_behind_is_not_seen(gl: Any, tmp_path: Path) -> None:
    sidecar(tmp_path, CAMERA + '[[light]]\nmatch = "studs"\ncandela = 7\n')
    down = cone((0.0, 0.0, -1.0), 20.0)
    source = street(tmp_path / "a.osgt", [(0.0, 0.0, 3.0)], sector=down, attributes="1 0.1")
    shown, _ = picture(gl, run(source).output)
    # What is seen is the floor beneath it: 0.5 x 7 cd / 9 m2 / pi at most.
    assert 0.0 < shown[18, 32] < 0.5 * 7.0 / 9.0 / math.pi * (1.0 + 1e-5)


def test_candela_by_the_rule_for_light_points(tmp_path: Path) -> None:
    """50 cd of white, times intensity, by the luminance of the colour."""
    result = run(street(tmp_path / "a.osgt", PLACES, color="1 0 0", attributes="0.4 0.03"))
    (row,) = result.lights
    assert row["value"] == pytest.approx(50.0 * 0.4 * LUMINANCE_WEIGHTS[0], rel=1e-6)
    assert (row["provenance"], row["rule"]) == ("estimated", "light-point-50cd")
    assert luminance(row["chromaticity"]) == pytest.approx(1.0, rel=1e-6)
    (prim,) = lights(opened(result)).values()
    assert prim.GetAttribute("inputs:radius").Get() == pytest.approx(0.03, rel=1e-6)
    assert "light-estimate" in result.report.codes()
    assert "lamp-radius" not in result.report.codes()
    assert result.counts["light_points"] == 5


@pytest.mark.parametrize("radius", ["0", "1e9"])
def test_a_lamp_without_a_size_has_a_stated_one(tmp_path: Path, radius: str) -> None:
    result = run(street(tmp_path / "a.osgt", PLACES, attributes=f"1 {radius}"))
    (prim,) = lights(opened(result)).values()
    assert prim.GetAttribute("inputs:radius").Get() == pytest.approx(0.05, rel=1e-6)
    assert "lamp-radius" in result.report.codes()


def test_an_airfield_is_few_prims_and_a_sound_stage(tmp_path: Path) -> None:
    places = np.random.default_rng(1).uniform(-900.0, 900.0, (10_000, 3)).round(2).tolist()
    result = run(street(tmp_path / "a.osgt", [tuple(place) for place in places]))
    stage = opened(result)
    (instancer,) = (p for p in stage.Traverse() if p.IsA(UsdGeom.PointInstancer))
    assert len(UsdGeom.PointInstancer(instancer).GetPositionsAttr().Get()) == 10_000
    assert len(list(Usd.PrimRange(stage.GetPseudoRoot()))) < 30
    assert [p for p in validate(stage) if p.severity == "error"] == []
    assert result.lights[0]["lamps"] == 10_000


def test_the_night_street_glows(gl: Any, testdata: Path, tmp_path: Path) -> None:
    """22 studs, 0.05 m above the road, every 12 m from y = -60 on, at x = -3.2 and 3.2."""
    source = testdata / "data" / "derived-osg" / "night_street.osgt"
    if not source.is_file():
        pytest.skip("no night street")
    result = run(source, tmp_path / "night.usda", roots=[testdata / "data"])
    rows = {row["name"]: row for row in result.lights}
    assert (rows["lamps"]["lamps"], rows["studs"]["lamps"]) == (6, 22)
    stage = opened(result)
    prim = next(p for p in stage.Traverse() if p.GetName() == "studs" and p.GetChild("Lamp"))
    form = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
    local = UsdGeom.PointInstancer(prim).GetPositionsAttr().Get()
    world = np.array([form.Transform(place) for place in local])
    wanted = [(x, -60.0 + 12.0 * i, 0.05) for i in range(11) for x in (-3.2, 3.2)]
    np.testing.assert_allclose(sorted(world.tolist()), sorted(wanted), atol=1e-5)
