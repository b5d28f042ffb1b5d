"""Lights as a stage has them: hidden, instanced, edited, broken; and the stage's own operator."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stage_text import GROUND, SKY, write_stage

from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report

#: 1000 cd, 2 m above the middle of the ground.
LAMP = """\
def SphereLight "Lamp" (
    prepend apiSchemas = ["HdrusdPhotometricLightAPI"]
)
{
    float inputs:radius = 0.05
    float inputs:intensity = 127323.954
    float inputs:photometric:luminousIntensity = 1000
    bool treatAsPoint = 1
    double3 xformOp:translate = (0, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    MORE
}
"""

#: A sky of 100 lx that a dome repeats for other renderers.
AMBIENT = """\
def Xform "World" (
    prepend apiSchemas = ["HdrusdAmbientAPI"]
)
{
    float photometric:ambient:illuminance = 100
    color3f photometric:ambient:color = (1, 1, 1)
    rel photometric:ambient:light = </Sky>
}
"""


def show(gl: Any, stage: Path, **options: Any) -> tuple[Any, Report]:
    """The only frame's picture in cd/m2, and the findings."""
    report = Report()
    (frame,) = render_sequence(gl, Job(stage, width=64, height=48, **options), report)
    return frame.hdr, report


def lamp(more: str = "") -> str:
    return LAMP.replace("MORE", more)


def middle(picture: Any) -> float:
    """cd/m2 of the four pixels round the middle, which see the ground within 3 cm of it."""
    return float(picture[23:25, 31:33].mean())


def test_a_hidden_lamp_brings_no_sky(gl: Any, tmp_path: Path) -> None:
    hidden = lamp('token visibility = "invisible"')
    picture, report = show(gl, write_stage(tmp_path / "a.usda", GROUND, hidden))
    assert not picture.any()
    assert "default-sky" not in report.codes()


@pytest.mark.parametrize(("visibility", "lux"), [("inherited", 100.0), ("invisible", 0.0)])
def test_the_sky_hides_with_its_dome(gl: Any, tmp_path: Path, visibility: str, lux: float) -> None:
    """The stated sky stands for the dome: once when it is shown, not at all when it is hidden."""
    dome = SKY.replace("= 10", f'= {100 / math.pi}\n    token visibility = "{visibility}"')
    head = 'defaultPrim = "World"'
    picture, _ = show(gl, write_stage(tmp_path / "a.usda", GROUND, AMBIENT, dome, head=head))
    np.testing.assert_allclose(picture, lux / math.pi, rtol=1e-6)


def test_lamps_in_a_point_instancer_shine(gl: Any, tmp_path: Path) -> None:
    """Two copies of 1000 cd, 2 m up, 1 m to either side: E = 2 I h / d^3."""
    copies = f"""\
def PointInstancer "Lamps"
{{
    int[] protoIndices = [0, 0]
    point3f[] positions = [(-1, 0, 0), (1, 0, 0)]
    rel prototypes = </Lamps/Lamp>
{lamp()}
}}
"""
    picture, report = show(gl, write_stage(tmp_path / "a.usda", GROUND, copies))
    expected = 2.0 * 1000.0 * 2.0 / math.sqrt(5.0) ** 3 / math.pi
    # The middle of the picture lies between four pixels, 3 cm from each: E is flat to 1e-3 there.
    assert middle(picture) == pytest.approx(expected, rel=1e-3)
    assert "default-sky" not in report.codes()


def test_edited_plain_values_are_told(gl: Any, tmp_path: Path) -> None:
    """Photometry is shown, and that the plain values differ is said."""
    stage = write_stage(tmp_path / "a.usda", GROUND, lamp("float inputs:exposure = -10"))
    picture, report = show(gl, stage)
    assert middle(picture) == pytest.approx(1000.0 / 4.0 / math.pi, rel=1e-3)
    assert "light-disagreement" in report.codes()
    _, agreed = show(gl, write_stage(tmp_path / "b.usda", GROUND, lamp()))
    assert "light-disagreement" not in agreed.codes()


@pytest.mark.parametrize(
    ("more", "share"),
    [
        ("float inputs:diffuse = 0", 0.0),
        ("float inputs:diffuse = 0.5", 0.5),
        ("float inputs:specular = 0", 1.0),
        ("rel collection:lightLink:excludes = </Ground>", 0.0),
        ("rel collection:lightLink:excludes = </Nothing>", 1.0),
    ],
)
def test_factors_and_links(gl: Any, tmp_path: Path, more: str, share: float) -> None:
    picture, report = show(gl, write_stage(tmp_path / "a.usda", GROUND, lamp(more)))
    wanted = share * 1000.0 / 4.0 / math.pi
    assert middle(picture) == pytest.approx(wanted, rel=1e-3, abs=1e-9)
    assert not report.codes() & {"light-multiplier", "light-linking"}


@pytest.mark.parametrize(
    "parts",
    [
        (lamp().replace("float inputs:photometric:luminousIntensity = 1000", 'string inputs:photometric:luminousIntensity = "much"'),),  # noqa: E501
        (lamp('string inputs:shaping:cone:angle = "wide"').replace('["Hdrusd', '["ShapingAPI", "Hdrusd'),),  # noqa: E501
        (AMBIENT.replace("float photometric:ambient:illuminance = 100", 'string photometric:ambient:illuminance = "much"'), SKY),  # noqa: E501
    ],
    ids=["intensity", "cone", "sky"],
)  # fmt: skip
def test_values_of_the_wrong_type_are_left_out(
    gl: Any, tmp_path: Path, parts: tuple[str, ...]
) -> None:
    head = 'defaultPrim = "World"'
    picture, report = show(gl, write_stage(tmp_path / "a.usda", GROUND, *parts, head=head))
    assert not picture.any()
    assert "light-invalid" in report.codes()


def test_the_stage_names_its_operator(gl: Any, tmp_path: Path) -> None:
    """A PNG follows the stage's operator, and the user's over it."""
    settings = """\
def RenderSettings "Settings" (
    prepend apiSchemas = ["HdrusdEyeAPI"]
)
{
    uniform token hdrusd:tonemap:operator = "falsecolour"
    uniform float hdrusd:display:peak = 250
}
"""
    head = 'renderSettingsPrimPath = "/Settings"'
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, settings, head=head)
    plain = write_stage(tmp_path / "b.usda", GROUND, SKY)
    _, report = show(gl, stage, png=str(tmp_path / "a.png"))
    show(gl, plain, png=str(tmp_path / "b.png"))
    assert "display-unused" in report.codes()
    from hdrusd.images import read_image
    from hdrusd.tonemap.operator import OPERATORS

    show(gl, stage, png=str(tmp_path / "c.png"), operator=OPERATORS["reinhard02"])
    first, second, third = (read_image(tmp_path / f"{name}.png").pixels for name in "abc")
    assert not np.array_equal(first, second)
    assert np.array_equal(third, second)
