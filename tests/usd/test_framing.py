"""The camera of a stage without one, and what such a stage must hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from hdrusd.errors import InputError
from hdrusd.job import Job
from hdrusd.render import Renderer
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.camera import framing_camera
from hdrusd.usd.extract import StageReader

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)  # faces +z


def stage_of(sheets: list[np.ndarray[Any, Any]]) -> Usd.Stage:
    """Squares by their corners, counter-clockwise where they face."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    for index, points in enumerate(sheets):
        mesh = UsdGeom.Mesh.Define(stage, f"/sheet_{index}")
        mesh.CreatePointsAttr(points)
        mesh.CreateFaceVertexCountsAttr([4])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
        mesh.CreateSubdivisionSchemeAttr("none")
    return stage


def framed(stage: Usd.Stage) -> Camera:
    """The camera that a stage without one gets."""
    return StageReader(stage, Report()).camera(None, 0.0, 16 / 9)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_sheet_is_seen_from_its_front(axis: int, sign: int) -> None:
    points = np.roll(SQUARE, axis - 2, axis=1)  # a cyclic change of axes keeps the winding
    points = points if sign > 0 else points[::-1]
    assert sign * framed(stage_of([points])).back[axis] > 0.0


def test_a_mirrored_sheet_is_seen_from_its_front() -> None:
    stage = stage_of([SQUARE])
    UsdGeom.Xformable(stage.GetPrimAtPath("/sheet_0")).AddScaleOp().Set((1.0, 1.0, -1.0))
    assert framed(stage).back[2] < 0.0


def test_a_closed_body_is_seen_from_the_usual_side() -> None:
    stage = stage_of([])
    UsdGeom.Cube.Define(stage, "/cube")
    camera, plain = framed(stage), framing_camera(-np.ones(3), np.ones(3), "Y", 16 / 9)
    assert camera.back == pytest.approx(plain.back)
    assert min(camera.back) > 0.0


def test_a_box_is_seen_through_its_open_side() -> None:
    # Inward walls at the back and at both sides, a floor, a ceiling; open towards -z.
    wall = np.add(SQUARE[::-1], [0, 0, 1])
    sides = [np.roll(wall, 1, axis=1), np.roll(SQUARE - [0, 0, 1], 1, axis=1)]
    floors = [np.roll(wall, 2, axis=1), np.roll(SQUARE - [0, 0, 1], 2, axis=1)]
    assert framed(stage_of([wall, *sides, *floors])).back[2] < 0.0


def test_a_stage_with_nothing_to_draw_is_refused(gl: Any, tmp_path: Path) -> None:
    path = tmp_path / "lights.usda"
    path.write_text('#usda 1.0\n( metersPerUnit = 1 )\ndef DistantLight "Sun" {}\n')
    renderer = Renderer(gl, Job(path, width=8, height=8), Report())
    with pytest.raises(InputError, match="nothing to draw"):
        renderer.frame(0.0)


def test_a_hidden_shape_is_still_something_to_draw(gl: Any, tmp_path: Path) -> None:
    path = tmp_path / "blink.usda"
    path.write_text(
        '#usda 1.0\n( metersPerUnit = 1 )\ndef Sphere "Ball" {\n'
        '    token visibility.timeSamples = { 0: "invisible", 1: "inherited" }\n}\n'
    )
    renderer = Renderer(gl, Job(path, width=8, height=8), Report())
    assert renderer.frame(0.0).hdr.max() == 0.0
    assert renderer.frame(1.0).hdr.max() > 0.0
