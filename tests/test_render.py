"""A stage becomes frames: what is shown, what is written, what is said."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stage_text import CAMERA, GROUND, SKY, panel, write_stage

from hdrusd.errors import InputError
from hdrusd.images import read_exr
from hdrusd.job import Job
from hdrusd.render import Frame, render_sequence
from hdrusd.report import Kind, Report

GREEN = (0.0, 10.0, 0.0)
WHITE = (10.0, 10.0, 10.0)


def render(gl: Any, stage: Path, report: Report | None = None, **options: Any) -> list[Frame]:
    job = Job(stage, **({"width": 64, "height": 48} | options))
    return list(render_sequence(gl, job, report if report is not None else Report()))


def middle(gl: Any, stage: Path, report: Report | None = None, **options: Any) -> tuple[float, ...]:
    """cd/m2 in the middle of the only frame."""
    (frame,) = render(gl, stage, report, **options)
    height, width = frame.hdr.shape[:2]
    return tuple(round(float(v), 4) for v in frame.hdr[height // 2, width // 2])


# -- camera and size --------------------------------------------------------------------------

OTHER_CAMERA = CAMERA.replace('"Camera"', '"Other"').replace("(0, 0, 4)", "(9, 0, 4)")

SETTINGS = """\
def Scope "Render"
{
    def RenderSettings "Big"
    {
        rel camera = </Other>
        uniform int2 resolution = (40, 30)
    }
}
"""


def test_stage_says_camera_and_size(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(
        tmp_path / "a.usda",
        OTHER_CAMERA,
        GROUND,
        SKY,
        SETTINGS,
        head='renderSettingsPrimPath = "/Render/Big"',
    )
    (frame,) = render(gl, stage, width=None, height=None)
    assert frame.hdr.shape == (30, 40, 3)
    assert frame.camera.name == "/Other"
    (frame,) = render(gl, stage, width=None, height=None, camera="Camera")
    assert frame.camera.name == "/Camera"


def test_settings_can_be_named(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", OTHER_CAMERA, GROUND, SKY, SETTINGS)
    (frame,) = render(gl, stage, width=None, height=None, settings="/Render/Big")
    assert (frame.hdr.shape, frame.camera.name) == ((30, 40, 3), "/Other")
    with pytest.raises(InputError, match="/Render/None: no RenderSettings"):
        render(gl, stage, settings="/Render/None")


def test_without_settings_the_film_gives_the_shape(gl: Any, tmp_path: Path) -> None:
    """usdrecord: 960 wide, height by the camera's aspect ratio (24 : 18)."""
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    (frame,) = render(gl, stage, width=None, height=None)
    assert frame.hdr.shape == (720, 960, 3)
    assert frame.camera.name == "/Camera"
    (frame,) = render(gl, stage, width=80, height=None)
    assert frame.hdr.shape == (60, 80, 3)
    (frame,) = render(gl, stage, width=None, height=30)
    assert frame.hdr.shape == (30, 40, 3)


def test_unknown_camera_names_those_there_are(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", OTHER_CAMERA)
    with pytest.raises(InputError, match=r"/Nope: no such camera; the stage has /Camera, /Other"):
        render(gl, stage, camera="/Nope")


def test_stage_without_camera_is_seen_whole(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, camera="")
    (frame,) = render(gl, stage)
    seen = frame.hdr.any(axis=-1)
    assert 0.1 < seen.mean() < 0.9
    border = np.ones_like(seen)
    border[1:-1, 1:-1] = False
    assert not seen[border].any()


@pytest.mark.parametrize("size", ["(0, 10)", "(-5, 5)", "(20000, 2)"])
def test_absurd_resolution_is_refused(gl: Any, tmp_path: Path, size: str) -> None:
    settings = SETTINGS.replace("(40, 30)", size)
    stage = write_stage(tmp_path / "a.usda", OTHER_CAMERA, settings)
    with pytest.raises(InputError, match="pixels; want 1 to 16384"):
        render(gl, stage, width=None, height=None, settings="/Render/Big")


# -- light that nobody authored ---------------------------------------------------------------


def test_stage_without_light_is_shown_under_a_stated_sky(gl: Any, tmp_path: Path) -> None:
    """1000 lx of sky and 1000 lx from the camera on a white plane: 2000 / pi cd/m2."""
    report = Report()
    stage = write_stage(tmp_path / "a.usda", GROUND)
    assert middle(gl, stage, report)[0] == pytest.approx(2000.0 / math.pi, rel=1e-4)
    (finding,) = report
    assert (finding.kind, finding.code) == (Kind.ASSUMED, "default-sky")
    assert "1000 lx" in finding.text


def test_default_sky_can_be_left_out(gl: Any, tmp_path: Path) -> None:
    report = Report()
    stage = write_stage(tmp_path / "a.usda", GROUND)
    assert middle(gl, stage, report, default_sky=False) == (0.0, 0.0, 0.0)
    assert not len(report)


def test_sky_behind_the_scene_only_on_request(gl: Any, tmp_path: Path) -> None:
    """A panel out of view: the dome's own 10 cd/m2, or nothing."""
    stage = write_stage(tmp_path / "a.usda", panel("Aside", (7, 8)), SKY)
    assert middle(gl, stage) == (0.0, 0.0, 0.0)
    assert middle(gl, stage, sky_visible=True) == WHITE


def test_stage_with_nothing_to_draw_is_refused(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", SKY)
    with pytest.raises(InputError, match="nothing to draw"):
        render(gl, stage)
    assert middle(gl, stage, sky_visible=True) == WHITE


BLINKING = """\
def SphereLight "Lamp"
{
    float inputs:intensity = 127323.954
    float inputs:radius = 0.05
    bool treatAsPoint = 1
    token visibility.timeSamples = { 1: "invisible", 2: "inherited" }
    double3 xformOp:translate = (0, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def test_lamp_that_blinks_brings_no_sky(gl: Any, tmp_path: Path) -> None:
    """A stage has light or has none: not in one frame so and in the next otherwise."""
    stage = write_stage(tmp_path / "a.usda", GROUND, BLINKING)
    off, on = render(gl, stage, times=[1.0, 2.0])
    assert not off.hdr.any()
    assert on.hdr.any()


def test_blinking_lamp_is_off_when_off(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, BLINKING)
    off, on = render(gl, stage, times=[1.0, 2.0], default_sky=False)
    assert not off.hdr.any()
    assert on.hdr[24, 32, 0] == pytest.approx(1000.0 / 4.0 / math.pi, rel=1e-3)


# -- what is shown ----------------------------------------------------------------------------


def test_back_faces_are_shown_unless_the_stage_says_otherwise(gl: Any, tmp_path: Path) -> None:
    """As usdrecord: only an authored doubleSided = false culls."""
    turned = panel("Panel").replace("[0, 1, 2, 3]", "[3, 2, 1, 0]")
    for said, seen in (("", GREEN), ("1", GREEN), ("0", WHITE)):
        line = f"    uniform bool doubleSided = {said}\n    int[] faceVertexCounts"
        part = turned.replace("    int[] faceVertexCounts", line) if said else turned
        assert middle(gl, write_stage(tmp_path / f"a{said}.usda", GROUND, part, SKY)) == seen


def test_mask_opens_what_it_names(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, panel("Panel"), SKY)
    assert middle(gl, stage) == GREEN
    assert middle(gl, stage, mask=["/Camera", "/Ground", "/Sky"]) == WHITE


def test_mask_that_names_nothing_is_said(gl: Any, tmp_path: Path) -> None:
    report = Report()
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    render(gl, stage, report, mask=["/Ground", "/Sky", "/Nope"])
    assert [(f.code, f.thing) for f in report] == [("mask", "/Nope")]
    for wrong in ("World", "not a path", "/A.points"):
        with pytest.raises(InputError, match="--mask"):
            render(gl, stage, mask=[wrong])


@pytest.mark.parametrize("purpose", ["render", "proxy", "guide"])
def test_purposes(gl: Any, tmp_path: Path, purpose: str) -> None:
    shown = panel("Panel", inside=f'uniform token purpose = "{purpose}"')
    stage = write_stage(tmp_path / "a.usda", GROUND, shown, SKY)
    assert middle(gl, stage, purposes=[purpose]) == GREEN
    assert middle(gl, stage, purposes=[]) == WHITE


def test_session_layer_is_strongest(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    session = tmp_path / "session.usda"
    session.write_text('#usda 1.0\nover "Sky"\n{\n    float inputs:intensity = 3\n}\n')
    assert middle(gl, stage) == WHITE
    assert middle(gl, stage, session_layer=session) == (3.0, 3.0, 3.0)
    with pytest.raises(InputError, match=r"none\.usda: no such file"):
        render(gl, stage, session_layer=tmp_path / "none.usda")


def test_visibility_is_inherited_and_animated(gl: Any, tmp_path: Path) -> None:
    group = (
        'def Xform "Group"\n{\n'
        '    token visibility.timeSamples = { 1: "invisible", 2: "inherited" }\n'
        + panel("Panel")
        + "}\n"
    )
    stage = write_stage(tmp_path / "a.usda", GROUND, group, SKY)
    assert middle(gl, stage, times=[1.0]) == WHITE
    assert middle(gl, stage, times=[2.0]) == GREEN
    hidden = panel("Panel", inside='token visibility = "invisible"')
    assert middle(gl, write_stage(tmp_path / "b.usda", GROUND, hidden, SKY)) == WHITE


def test_animated_transforms_interpolate(gl: Any, tmp_path: Path) -> None:
    """From x = -3 to x = 3 in ten frames: in the middle at frame 5."""
    moving = panel(
        "Panel",
        inside="double3 xformOp:translate.timeSamples = { 0: (-3, 0, 0), 10: (3, 0, 0) }\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]',
    )
    stage = write_stage(tmp_path / "a.usda", GROUND, moving, SKY)
    seen = [tuple(f.hdr[24, 32].round(4)) for f in render(gl, stage, times=[0.0, 5.0, 10.0, 5.0])]
    assert seen == [WHITE, GREEN, WHITE, GREEN]


@pytest.mark.parametrize(
    "times",
    [
        (1.0, 2.0),
        (-1.0, -2.0),
    ],
)
def test_animated_points(gl: Any, tmp_path: Path, times: tuple[float, float]) -> None:
    square = "[(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]"
    away = "[(8, -1, 1), (9, -1, 1), (9, 1, 1), (8, 1, 1)]"
    moving = f"""\
def Mesh "Moving"
{{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points.timeSamples = {{ {times[0]}: {square}, {times[1]}: {away} }}
    color3f[] primvars:displayColor = [(0, 1, 0)]
}}
"""
    stage = write_stage(tmp_path / "a.usda", GROUND, moving, SKY)
    seen = [tuple(f.hdr[24, 32].round(4)) for f in render(gl, stage, times=times)]
    assert seen == [GREEN, WHITE]


def test_default_time_is_where_nothing_is_animated(gl: Any, tmp_path: Path) -> None:
    sky = SKY.replace("= 10", "= 10\n    float inputs:intensity.timeSamples = { 0: 1, 10: 2 }")
    points = "point3f[] points.timeSamples = { 0: [(9, 9, 9), (9, 9, 9), (9, 9, 9), (9, 9, 9)] }"
    stage = write_stage(tmp_path / "a.usda", GROUND, panel("Panel", inside=points), sky)
    exr = tmp_path / "a.exr"
    assert middle(gl, stage, times=[math.nan], exr=str(exr)) == GREEN
    assert "hdrusd:frame" not in read_exr(exr)[1]


def test_start_time_code_without_frames(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, head="startTimeCode = 7")
    (frame,) = render(gl, stage)
    assert frame.time == 7.0


# -- broken stages ----------------------------------------------------------------------------


def test_unreadable_stages(gl: Any, tmp_path: Path) -> None:
    (tmp_path / "empty.usda").touch()
    (tmp_path / "empty.usdc").touch()
    (tmp_path / "text.usd").write_text("hello")
    (tmp_path / "a.txt").write_text("hello")
    for name in ("empty.usda", "empty.usdc", "text.usd", "a.txt", "none.usda", "."):
        with pytest.raises(InputError) as problem:
            render(gl, tmp_path / name)
        assert "\n" not in str(problem.value)


def test_what_usd_warns_of_is_a_finding(
    gl: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    broken = 'def "Gone" (\n    references = @./none.usda@</Gone>\n)\n{\n}\n'
    loop = 'def "A" (\n    references = </B>\n)\n{\n}\ndef "B" (\n    references = </A>\n)\n{\n}\n'
    report = Report()
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, broken, loop)
    assert middle(gl, stage, report) == WHITE
    texts = [f.text for f in report if f.code == "usd-warning"]
    assert any("none.usda" in text for text in texts)
    assert any("Cycle" in text for text in texts)
    assert not any("0x" in text or "\n" in text for text in texts)
    assert "Warning" not in capfd.readouterr().err


NAN_LAMP = """\
def SphereLight "Lamp"
{
    float inputs:intensity = nan
    float inputs:radius = 0.05
}
"""


def test_numbers_that_are_none_are_left_out_and_said(gl: Any, tmp_path: Path) -> None:
    points = "point3f[] points = [(nan, 0, 1), (1, -1, 1), (1, 1, 1), (-1, 1, inf)]"
    broken = GROUND.replace('"Ground"', '"Broken"').replace(
        "point3f[] points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]", points
    )
    report = Report()
    stage = write_stage(tmp_path / "a.usda", GROUND, broken, NAN_LAMP, SKY)
    (frame,) = render(gl, stage, report)
    assert np.isfinite(frame.hdr).all()
    assert tuple(frame.hdr[24, 32].round(4)) == WHITE
    assert {"mesh-not-finite", "light-invalid"} <= report.codes()


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("[0, 1, 2, 3]", "[0, 1, 2]", "mesh-topology"),
        ("faceVertexCounts = [4]", "faceVertexCounts = [-4]", "mesh-topology"),
        ("faceVertexCounts = [4]", "faceVertexCounts = [2000000000]", "mesh-topology"),
        ("[0, 1, 2, 3]", "[0, 1, 2, 99]", "mesh-index"),
        ("[0, 1, 2, 3]", "[0, 1, -2, 3]", "mesh-index"),
    ],
)
def test_meshes_that_contradict_themselves(
    gl: Any, tmp_path: Path, old: str, new: str, code: str
) -> None:
    broken = GROUND.replace('"Ground"', '"Broken"').replace(old, new)
    report = Report()
    stage = write_stage(tmp_path / "a.usda", GROUND, broken, SKY)
    assert middle(gl, stage, report) == WHITE
    assert code in report.codes()


def test_chain_of_50000_connections(gl: Any, tmp_path: Path) -> None:
    """USD's own search recurses and overflows the stack."""
    chain = "\n".join(
        f"        color3f inputs:c{k}.connect = </Deep.inputs:c{k + 1}>" for k in range(50_000)
    )
    deep = f"""\
def Material "Deep"
{{
{chain}
    token outputs:surface.connect = </Deep/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Deep.inputs:c0>
        token outputs:surface
    }}
}}
"""
    bound = GROUND.replace(
        '"Ground"', '"Ground" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)'
    )
    bound = bound.replace("{", "{\n    rel material:binding = </Deep>", 1)
    (frame,) = render(gl, write_stage(tmp_path / "a.usda", bound, deep, SKY))
    assert np.isfinite(frame.hdr).all()
    assert frame.hdr[24, 32].any()


def test_missing_texture_is_said_once(gl: Any, tmp_path: Path) -> None:
    textured = """\
def Material "Wall"
{
    token outputs:surface.connect = </Wall/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        color3f inputs:diffuseColor.connect = </Wall/T.outputs:rgb>
        token outputs:surface
    }
    def Shader "T"
    {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./none.png@
        float4 inputs:fallback = (0.5, 0.25, 0.125, 1)
        float3 outputs:rgb
    }
}
"""
    bound = GROUND.replace(
        '"Ground"', '"Ground" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)'
    )
    bound = bound.replace("{", "{\n    rel material:binding = </Wall>", 1)
    stage = write_stage(tmp_path / "a.usda", bound, textured, SKY)
    report = Report()
    frames = render(gl, stage, report, times=[1.0, 2.0])
    assert tuple(frames[0].hdr[24, 32].round(4)) == (5.0, 2.5, 1.25)
    (finding,) = [f for f in report if f.code == "texture-unreadable"]
    assert finding.thing == "none.png"
