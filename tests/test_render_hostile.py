"""Stages with numbers that are none: refused in one line, or shown without them and said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stage_text import CAMERA, GROUND, SKY, panel, write_stage

from hdrusd.errors import InputError
from hdrusd.job import Job
from hdrusd.render import Frame, render_sequence
from hdrusd.report import Report

LAMP = """\
def SphereLight "Lamp"
{
    float inputs:intensity = 1000
    float inputs:radius = 0.05
    double3 xformOp:translate = (0, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""

INSTANCER = f"""\
def PointInstancer "Copies"
{{
    point3f[] positions = [(0, 0, 0.1), (1, 0, 0.1)]
    int[] protoIndices = [0, 0]
    rel prototypes = </Copies/Panel>
    {panel("Panel")}
}}
"""

MATERIAL = """\
def Material "Paint"
{
    token outputs:surface.connect = </Paint/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0, 0, 0)
        token outputs:surface
    }
}
"""

PAINTED = GROUND.replace(
    '"Ground"', '"Ground" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)'
)
PAINTED = PAINTED.replace("{", "{\n    rel material:binding = </Paint>", 1)


def render(gl: Any, tmp_path: Path, *parts: str, **options: Any) -> tuple[list[Frame], Report]:
    report = Report()
    stage = write_stage(tmp_path / "a.usda", *parts, camera=options.pop("camera", CAMERA))
    job = Job(stage, width=64, height=48, default_sky=False, **options)
    return list(render_sequence(gl, job, report)), report


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("focalLength = 24", "focalLength = nan"),
        ("focalLength = 24", "focalLength = -24"),
        ("focalLength = 24", "focalLength = 0"),
        ("horizontalAperture = 24", "horizontalAperture = 0"),
        ("(0.05, 100)", "(nan, inf)"),
        ("(0, 0, 4)", "(nan, 0, 4)"),
        ("(0, 0, 4)", "(inf, 0, 4)"),
    ],
)
def test_cameras_that_see_nothing(gl: Any, tmp_path: Path, old: str, new: str) -> None:
    with pytest.raises(InputError, match="/Camera: "):
        render(gl, tmp_path, GROUND, SKY, camera=CAMERA.replace(old, new))


@pytest.mark.parametrize(
    "light",
    [
        LAMP.replace("1000", "nan"),
        LAMP.replace("1000", "inf"),
        LAMP.replace("1000", "-1000"),
        SKY.replace("10", "nan"),
        SKY.replace("10", "inf"),
        SKY.replace("10", "-5"),
        SKY.replace("= 10", "= 10\n    float inputs:exposure = 2000"),
    ],
    ids=["nan", "inf", "negative", "sky-nan", "sky-inf", "sky-negative", "sky-overflow"],
)
def test_lights_without_a_value(gl: Any, tmp_path: Path, light: str) -> None:
    """The schema: negative, infinite and NaN are invalid. Left out, and a finding."""
    (frame,), report = render(gl, tmp_path, GROUND, light)
    assert not frame.hdr.any()
    assert "light-invalid" in report.codes()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[(1, 1, 1)]", "[(nan, 1, 1)]"),
        ("[(1, 1, 1)]", "[(-1, 1, 1)]"),
        (
            "uniform token",
            "normal3f[] normals = [(0,0,0), (0,0,0), (0,0,0), (0,0,0)]\nuniform token",
        ),
        (
            "uniform token",
            "normal3f[] normals = [(nan,0,0), (0,0,1), (0,0,1), (0,0,1)]\nuniform token",
        ),
    ],
    ids=["colour-nan", "colour-negative", "normal-zero", "normal-nan"],
)
def test_meshes_with_values_that_are_none(gl: Any, tmp_path: Path, old: str, new: str) -> None:
    (frame,), report = render(gl, tmp_path, GROUND.replace(old, new), LAMP)
    assert np.isfinite(frame.hdr).all()
    assert frame.hdr.min() >= 0.0
    assert len(report)


@pytest.mark.parametrize("op", ["scale = (0, 0, 0)", "translate = (nan, 0, 0)"])
def test_transforms_that_lead_nowhere_harm_nobody_else(gl: Any, tmp_path: Path, op: str) -> None:
    name = op.split(" ", 1)[0]
    inside = f'double3 xformOp:{op}\nuniform token[] xformOpOrder = ["xformOp:{name}"]'
    (frame,), _ = render(gl, tmp_path, GROUND, panel("Broken", inside=inside), SKY)
    np.testing.assert_allclose(frame.hdr, 10.0, rtol=1e-6)


# -- PointInstancers --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[0, 0]", "[7, -1]"),
        ("[0, 0]", "[0]"),
        ("</Copies/Panel>", "</Copies>"),
        ("</Copies/Panel>", "</Nope>"),
    ],
)
def test_instancers_that_contradict_themselves(gl: Any, tmp_path: Path, old: str, new: str) -> None:
    (frame,), report = render(gl, tmp_path, GROUND, INSTANCER.replace(old, new), SKY)
    assert np.isfinite(frame.hdr).all()
    assert len(report)


def test_hidden_prototypes_are_hidden(gl: Any, tmp_path: Path) -> None:
    hidden = panel("Panel", inside='token visibility = "invisible"')
    (frame,), _ = render(gl, tmp_path, GROUND, INSTANCER.replace(panel("Panel"), hidden), SKY)
    np.testing.assert_allclose(frame.hdr, 10.0, rtol=1e-6)


def test_hidden_copies_are_hidden(gl: Any, tmp_path: Path) -> None:
    some = INSTANCER.replace("int[] proto", "int64[] invisibleIds = [0]\n    int[] proto")
    (frame,), _ = render(gl, tmp_path, GROUND, some, SKY)
    assert tuple(frame.hdr[24, 32].round(4)) == (10.0, 10.0, 10.0)
    assert tuple(frame.hdr[24, 51].round(4)) == (0.0, 10.0, 0.0)


# -- a frame does not depend on those before it -----------------------------------------------


def test_materials_change_in_time(gl: Any, tmp_path: Path) -> None:
    """A brake light that goes on at frame 2."""
    blinking = MATERIAL.replace(
        "token outputs:surface\n    }",
        "color3f inputs:emissiveColor.timeSamples = { 1: (0, 0, 0), 2: (300, 0, 0) }\n"
        "        token outputs:surface\n    }",
    )
    frames, _ = render(gl, tmp_path, PAINTED, blinking, SKY, times=[1.0, 2.0])
    off, on = (frame.hdr[24, 32, 0] for frame in frames)
    assert on - off == pytest.approx(300.0, rel=1e-6)


def test_a_frame_is_the_same_alone_and_in_a_sequence(gl: Any, tmp_path: Path) -> None:
    """What --resume and render farms count on."""
    moving = LAMP.replace(
        "xformOp:translate = (0, 0, 2)",
        "xformOp:translate.timeSamples = { 0: (-1, 0, 2), 9: (1, 1, 1) }",
    )
    turned = panel(
        "Panel",
        inside="float xformOp:rotateZ.timeSamples = { 0: 0, 9: 90 }\n"
        'uniform token[] xformOpOrder = ["xformOp:rotateZ"]',
    )
    whole, _ = render(gl, tmp_path, GROUND, moving, turned, times=[0.0, 3.0, 6.0, 9.0])
    for frame in whole:
        (alone,), _ = render(gl, tmp_path, GROUND, moving, turned, times=[frame.time])
        np.testing.assert_array_equal(alone.hdr, frame.hdr)
