"""What a database says, told whole as data and within a screen as text."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders import gltf_lights, lamp, node, obj, one_square, paint, png, square
from click.testing import CliRunner

from hdrusd.cli.main import hdrusd
from hdrusd.inspection import inspect, lines
from hdrusd.legacy.scene import Camera, LegacyScene, Node
from hdrusd.report import Report


def text(scene: LegacyScene) -> str:
    return "\n".join(lines(inspect(scene, Report())))


def test_numbers_stand_as_the_file_has_them(tmp_path: Path) -> None:
    lights = [
        {"name": "street", "type": "spot", "intensity": 4000.0, "range": 30.0},
        {"name": "moon", "type": "directional", "intensity": 0.25, "color": [0.5, 0.5, 1.0]},
    ]
    lights[0]["spot"] = {"outerConeAngle": 0.5}
    source = gltf_lights(tmp_path / "a.gltf", lights)
    done = CliRunner().invoke(hdrusd, ["inspect", str(source), "--json"])
    assert done.exit_code == 0
    told = json.loads(done.stdout)
    street, moon = told["lights"]
    assert (street["candela"], street["lux"], street["range"]) == (4000.0, None, 30.0)
    assert street["spot_cutoff"] == pytest.approx(np.degrees(0.5))
    assert (moon["candela"], moon["lux"], moon["diffuse"]) == (None, 0.25, [0.5, 0.5, 1.0])
    assert (told["unit_m"], told["up"], street["nodes"]) == (1.0, "Y", ["street"])
    done = CliRunner().invoke(hdrusd, ["inspect", str(source)])
    assert "street  spot         1          4000 cd  range 30, cone 28.6479" in done.stdout
    assert "moon    directional  0.5 0.5 1  0.25 lx" in done.stdout


def test_pictures_that_are_missing_are_told(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "map_Kd wall.png\nmap_Ke none.png")
    png(tmp_path / "wall.png")
    done = CliRunner().invoke(hdrusd, ["inspect", str(source), "--json"])
    told = {row["name"]: row for row in json.loads(done.stdout)["textures"]}
    assert (told["wall.png"]["state"], told["none.png"]["state"]) == ("file", "missing")
    assert told["wall.png"]["uses"] == ["paint:diffuse"]
    done = CliRunner().invoke(hdrusd, ["inspect", str(source)])
    assert "missing: a.mtl" in done.stderr


def test_what_hangs_in_two_places_is_opened_once() -> None:
    shared = node("car", children=[node("wheel", meshes=[0])])
    scene = one_square(roots=[node("a", children=[shared]), node("b", children=[shared])])
    assert [row["name"] for row in inspect(scene, Report())["nodes"]] == [
        "a",
        "car",
        "wheel",
        "b",
        "car",
    ]
    assert [line.split() for line in text(scene).splitlines()[-2:]] == [
        ["b"],
        ["car", "as", "above"],
    ]


def test_nothing_of_a_hostile_scene_runs_away() -> None:
    top: Node = node("leaf")
    for level in range(60):  # 2^60 paths
        top = node(f"level{level}", children=[top, top])
    scene = one_square(roots=[top])
    assert len(inspect(scene, Report())["nodes"]) == 121
    assert "more nodes; --json has them all" in text(scene)
    named = one_square(materials=[paint(name="a\x1b[31m\n" + "b" * 1000)], roots=[node("n")])
    shown = text(named)
    assert "\x1b" not in shown
    assert max(map(len, shown.splitlines())) < 400


def test_lights_that_are_off_and_cameras() -> None:
    scene = one_square(
        lights=[lamp(name="dead", enabled=False), lamp(name="l", attenuation=(1.0, 0.0, 0.5))],
        cameras=[Camera("c", square().source, fov_y=33.0)],
        roots=[node("n", lights=[0, 1], cameras=[0])],
    )
    shown = text(scene)
    assert "point, off" in shown
    assert "1/(1, 0, 0.5)" in shown
    assert "33 degrees" in shown


def test_a_stage_is_for_info(tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    done = CliRunner().invoke(hdrusd, ["inspect", str(tmp_path / "a.usda")])
    assert done.exit_code == 2
    assert "hdrusd info" in done.stderr
