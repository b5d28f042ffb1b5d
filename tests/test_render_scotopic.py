"""Scotopic and mesopic luminance of frames: by closed forms under lamps that state their S/P."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stage_text import GROUND, SKY, write_stage

from hdrusd.colour import luminance
from hdrusd.eye.mesopic import mesopic
from hdrusd.eye.scotopic import scotopic
from hdrusd.images import read_exr, read_exr_layers
from hdrusd.job import Job
from hdrusd.render import Frame, render_sequence
from hdrusd.report import Report

#: Channels of high-pressure sodium, about.
SODIUM = (1.0, 0.6, 0.05)


def lamp(
    name: str,
    sp: float | None,
    color: tuple[float, ...] = SODIUM,
    place: tuple[float, ...] = (0, 0, 10),
) -> str:
    """1000 cd, square above the ground."""
    ratio = "" if sp is None else f"float inputs:photometric:scotopicPhotopicRatio = {sp}"
    intensity = 1000 / (math.pi * 0.05**2) / float(luminance(color))
    return f"""\
def SphereLight "{name}" (
    prepend apiSchemas = ["HdrusdPhotometricLightAPI"]
)
{{
    float inputs:radius = 0.05
    color3f inputs:color = {color}
    float inputs:intensity = {intensity}
    float inputs:photometric:luminousIntensity = 1000
    {ratio}
    bool treatAsPoint = 1
    double3 xformOp:translate = {place}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


def frame(gl: Any, stage: Path, **options: Any) -> tuple[Frame, Report]:
    report = Report()
    job = Job(stage, width=64, height=48, scotopic=True, **options)
    (made,) = render_sequence(gl, job, report)
    return made, report


def rods(gl: Any, tmp_path: Path, *parts: str, **options: Any) -> tuple[np.ndarray, np.ndarray]:
    """Photopic and scotopic luminance, (h, w) each."""
    made, _ = frame(gl, write_stage(tmp_path / "a.usda", *parts), **options)
    cones = luminance(made.hdr.astype(np.float64))
    return cones, made.layers["scotopic.Y"].astype(np.float64)


def test_under_sodium_rods_see_little(gl: Any, tmp_path: Path) -> None:
    cones, seen = rods(gl, tmp_path, GROUND, lamp("Sodium", 0.6))
    # E = I cos / d^2 = 1000 h / (h^2 + r^2)^1.5 for a lamp h = 10 m up; L = E / pi.
    x, y = np.meshgrid((np.arange(64) + 0.5) / 16 - 2.0, (np.arange(48) + 0.5) / 16 - 1.5)
    wanted = 1000 * 10 / (100 + x**2 + y**2) ** 1.5 / math.pi
    assert cones == pytest.approx(wanted, rel=1e-4)
    assert seen == pytest.approx(0.6 * wanted, rel=1e-4)
    # By its colour it would be more.
    assert float(scotopic(SODIUM) / luminance(SODIUM)) > 1.1


def test_lamps_add_up(gl: Any, tmp_path: Path) -> None:
    white = lamp("White", None, (1.0, 0.9, 0.8), (1, 0, 5))
    _, first = rods(gl, tmp_path, GROUND, lamp("Sodium", 0.6))
    made, _ = frame(gl, write_stage(tmp_path / "b.usda", GROUND, white))
    # Nobody states a ratio there, so the colour tells.
    second = made.layers["scotopic.Y"]
    assert second == pytest.approx(scotopic(made.hdr.astype(np.float64)), rel=1e-6)
    _, both = rods(gl, tmp_path, GROUND, lamp("Sodium", 0.6), white)
    assert both == pytest.approx(first + second, rel=1e-5)


@pytest.mark.parametrize("kind", ["RectLight", "DiskLight"])
def test_a_lamp_that_is_seen(gl: Any, tmp_path: Path, kind: str) -> None:
    panel = f"""\
def {kind} "Panel" (
    prepend apiSchemas = ["HdrusdPhotometricLightAPI"]
)
{{
    float inputs:intensity = 50
    color3f inputs:color = {SODIUM}
    float inputs:photometric:scotopicPhotopicRatio = 0.6
    float3 xformOp:rotateXYZ = (180, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}}
"""
    cones, seen = rods(gl, tmp_path, panel)
    assert cones.max() == pytest.approx(50 * luminance(SODIUM), rel=1e-4)
    assert seen == pytest.approx(0.6 * cones, rel=1e-4)


def test_the_photopic_frame_stays(gl: Any, tmp_path: Path) -> None:
    wall = 'def Cube "Wall"\n{\n    double size = 0.5\n}\n'
    lamps = [lamp("A", 0.6, place=(1, 0, 3)), lamp("B", 2.2, (1, 1, 1), (-1, 1, 3))]
    stage = write_stage(tmp_path / "a.usda", GROUND, wall, *lamps)
    report = Report()
    (plain,) = render_sequence(gl, Job(stage, width=64, height=48), report)
    made, found = frame(gl, stage)
    assert (made.hdr == plain.hdr).all()
    assert found.codes() == report.codes()
    assert not plain.layers


def test_mesopic_is_of_both(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, lamp("Sodium", 0.6, place=(0, 0, 60)))
    made, _ = frame(gl, stage, mesopic=True)
    cones = luminance(made.hdr.astype(np.float64))
    wanted, m = mesopic(cones, 0.6 * cones)
    assert 0.0 < m.min() < m.max() < 1.0
    assert made.layers["mesopic.Y"] == pytest.approx(wanted, rel=1e-4)
    assert (made.layers["mesopic.Y"] < cones).all()


@pytest.mark.parametrize("half", [False, True])
def test_layers_are_in_the_file(gl: Any, tmp_path: Path, half: bool) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, lamp("Sodium", 0.6))
    exr = str(tmp_path / "a.exr")
    made, _ = frame(gl, stage, mesopic=True, exr=exr, half=half)
    rgb, header, layers = read_exr_layers(Path(exr))
    assert layers.keys() == {"scotopic.Y", "mesopic.Y"}
    for name, layer in layers.items():
        assert layer.dtype == np.float32
        assert (layer == made.layers[name]).all()
    again, other = read_exr(Path(exr))
    assert (again == rgb).all()
    assert other.keys() == header.keys()
    assert again == pytest.approx(made.hdr, rel=2.0**-11 if half else 0.0)


@pytest.mark.parametrize("sp", [0.0, -1.0, "nan", 1e6])
def test_a_ratio_that_cannot_be_is_not_used(gl: Any, tmp_path: Path, sp: Any) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, lamp("Sodium", sp))
    made, report = frame(gl, stage)
    assert "light-scotopic" in report.codes()
    wanted = scotopic(made.hdr.astype(np.float64))
    assert made.layers["scotopic.Y"] == pytest.approx(wanted, rel=1e-6)


def test_of_a_dome_it_is_not_used(gl: Any, tmp_path: Path) -> None:
    line = "    float inputs:photometric:scotopicPhotopicRatio = 2\n}"
    dome = SKY.replace('"Sky"\n', '"Sky" (\n    apiSchemas = ["HdrusdPhotometricLightAPI"]\n)\n')
    made, report = frame(gl, write_stage(tmp_path / "a.usda", GROUND, dome.replace("}", line)))
    assert "light-scotopic" in report.codes()
    assert made.layers["scotopic.Y"] == pytest.approx(scotopic(made.hdr), rel=1e-6)
