"""Frames on disk: what they hold, resuming, the display pictures, the writer's thread."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stage_text import GROUND, SKY, write_stage

from hdrusd.frame_io import Writer
from hdrusd.images import read_exr, read_image, write_png
from hdrusd.job import Job
from hdrusd.photometry.lightcut import EPSILON
from hdrusd.render import Frame, Renderer, render_sequence
from hdrusd.report import Kind, Report
from hdrusd.tonemap.operator import OPERATORS


def render(gl: Any, stage: Path, report: Report | None = None, **options: Any) -> list[Frame]:
    job = Job(stage, **({"width": 64, "height": 48} | options))
    return list(render_sequence(gl, job, report if report is not None else Report()))


def test_files_hold_what_the_frames_do(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    frames = render(
        gl,
        stage,
        times=[1.0, 2.0],
        exr=str(tmp_path / "new/f.####.exr"),
        png=str(tmp_path / "f.####.png"),
        operator=OPERATORS["reinhard02"],
    )
    for number, frame in enumerate(frames, 1):
        exr, png = tmp_path / f"new/f.{number:04}.exr", tmp_path / f"f.{number:04}.png"
        assert frame.files == (exr, png)
        rgb, header = read_exr(exr)
        np.testing.assert_array_equal(rgb, frame.hdr)
        np.testing.assert_array_equal(read_image(png).pixels, frame.ldr)
        assert header["hdrusd:frame"] == number
        assert header["hdrusd:camera"] == "/Camera"
        assert header["hdrusd:reflection"] == "lambert"
        assert header["whiteLuminance"] == 1.0
    assert not list(tmp_path.rglob(".*"))


def test_camera_matrices_in_the_header(gl: Any, tmp_path: Path) -> None:
    """Row vectors: the point (1, 0.75, 0) is 4 m ahead and in the middle of the upper right."""
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    render(gl, stage, exr=str(tmp_path / "a.exr"))
    header = read_exr(tmp_path / "a.exr")[1]
    point = np.array([1.0, 0.75, 0.0, 1.0])
    np.testing.assert_allclose(point @ header["worldToCamera"], [1.0, 0.75, -4.0, 1.0], atol=1e-6)
    clip = point @ header["worldToNDC"]
    np.testing.assert_allclose(clip[:2] / clip[3], [0.5, 0.5], atol=1e-6)


def lamps(count: int, more: str = "") -> str:
    """Points of 5 cm over the ground, a metre apart in a row."""
    return "".join(
        f"""\
def SphereLight "Lamp{k}" (
    prepend apiSchemas = ["ShadowAPI"]
)
{{
    float inputs:radius = 0.05
    {more}
    double3 xformOp:translate = ({k - count / 2}, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""
        for k in range(count)
    )


@pytest.mark.parametrize(
    ("count", "mode", "merged"),
    [(70, "auto", True), (70, "exact", False), (8, "auto", False), (8, "merged", True)],
)
def test_the_header_says_how_lights_were_added(
    gl: Any, tmp_path: Path, count: int, mode: Any, merged: bool
) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, lamps(count))
    report = Report()
    exr = str(tmp_path / "a.####.exr")
    render(gl, stage, report, times=[1.0, 2.0], exr=exr, lights=mode, shadows=False)
    header = read_exr(tmp_path / "a.0002.exr")[1]
    assert header["hdrusd:lights"] == ("merged" if merged else "exact")
    assert header["hdrusd:lightErrorBound"] == pytest.approx(EPSILON if merged else 0.0, rel=1e-6)
    assert header["hdrusd:shadows"] == "none"
    assert (header["hdrusd:samples"], header["hdrusd:skySamples"]) == (1, 0)
    found = [f for f in report if f.code == "lights-merged"]
    assert [(f.kind, f.source.file) for f in found] == merged * [(Kind.ASSUMED, stage)]
    assert all(f.text.startswith(f"{count} lamps: ") and "2 %" in f.text for f in found)


@pytest.mark.parametrize("shadow", [True, False])
def test_lamps_with_shadow_maps_are_counted_alone(gl: Any, tmp_path: Path, shadow: bool) -> None:
    """What is merged is said by what was done, not by what was allowed."""
    more = f"bool inputs:shadow:enable = {int(shadow)}"
    stage = write_stage(tmp_path / "a.usda", GROUND, lamps(8, more))
    exr = str(tmp_path / "a.exr")
    report = Report()
    render(gl, stage, report, exr=exr, lights="merged", samples=4, sky_samples=4)
    header = read_exr(Path(exr))[1]
    assert header["hdrusd:lights"] == ("exact" if shadow else "merged")
    assert ("lights-merged" in report.codes()) != shadow
    assert header["hdrusd:shadows"] == "maps"
    assert (header["hdrusd:samples"], header["hdrusd:skySamples"]) == (4, 4)


def test_half_that_clips_is_a_finding(gl: Any, tmp_path: Path) -> None:
    bright = write_stage(tmp_path / "a.usda", GROUND, SKY.replace("= 10", "= 70000"))
    dim = write_stage(tmp_path / "b.usda", GROUND, SKY)
    report = Report()
    render(gl, dim, report, exr=str(tmp_path / "b.exr"), half=True)
    assert not len(report)
    render(gl, bright, report, exr=str(tmp_path / "a.exr"), half=True)
    (finding,) = report
    assert (finding.kind, finding.code) == (Kind.CLAMPED, "half-clipped")
    assert finding.source.file == tmp_path / "a.exr"
    assert finding.text.startswith("3072 pixels")
    assert read_exr(tmp_path / "a.exr")[0].max() == 65504.0


def test_resume_renders_what_is_not_there(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    options: dict[str, Any] = {"exr": str(tmp_path / "f.####.exr"), "times": [1.0, 2.0, 3.0]}
    render(gl, stage, **options)
    marker = tmp_path / "f.0001.exr"
    marker.write_bytes(b"kept")
    (tmp_path / "f.0002.exr").unlink()
    frames = render(gl, stage, resume=True, **options)
    assert [frame.skipped for frame in frames] == [True, False, True]
    assert marker.read_bytes() == b"kept"
    assert (tmp_path / "f.0002.exr").is_file()
    render(gl, stage, **options)
    assert marker.read_bytes() != b"kept"


def test_resume_wants_both_files_of_a_frame(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    exr, png = str(tmp_path / "a.exr"), str(tmp_path / "a.png")
    render(gl, stage, exr=exr)
    (frame,) = render(gl, stage, exr=exr, png=png, operator=OPERATORS["exposure"], resume=True)
    assert not frame.skipped
    assert Path(png).is_file()


def test_failed_write_ends_the_job(gl: Any, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(OSError, match="file"):
        render(gl, stage, exr=str(tmp_path / "file/f.####.exr"), times=[1.0, 2.0, 3.0])


# -- display ----------------------------------------------------------------------------------


def test_settings_of_the_stage_and_of_the_user(gl: Any, tmp_path: Path) -> None:
    """The user's parameters over the stage's, the stage's over the default."""
    settings = """\
def RenderSettings "Settings" (
    prepend apiSchemas = ["HdrusdEyeAPI"]
)
{
    uniform token hdrusd:tonemap:operator = "reinhard02"
    uniform float hdrusd:tonemap:key = 0.5
}
"""
    stage = write_stage(
        tmp_path / "a.usda", GROUND, SKY, settings, head='renderSettingsPrimPath = "/Settings"'
    )
    job = Job(stage, width=8, height=6, operator=OPERATORS["reinhard02"])
    report = Report()
    for given, key in ({}, 0.5), ({"key": 0.2}, 0.2):
        renderer = Renderer(gl, replace(job, parameters=given), report)
        moment = renderer.frame(0.0).moment
        assert moment is not None
        assert moment.parameters["key"] == key
    gl.extra["framebuffer"].use()


# -- the writer's thread ----------------------------------------------------------------------


def test_writer_writes_in_order(tmp_path: Path) -> None:
    done: list[int] = []
    with Writer() as writer:
        for number in range(20):
            writer.submit(done.append, number)
    assert done == list(range(20))


def test_writer_does_not_hoard() -> None:
    """While one is written at most two wait: frames are large."""
    gate, started = threading.Event(), threading.Event()
    submitted: list[int] = []

    def work(_: int) -> None:
        started.set()
        gate.wait(5.0)

    def feed() -> None:
        with Writer() as writer:
            for number in range(10):
                writer.submit(work, number)
                submitted.append(number)

    feeder = threading.Thread(target=feed)
    feeder.start()
    started.wait(5.0)
    time.sleep(0.2)
    assert len(submitted) <= 3
    gate.set()
    feeder.join(5.0)
    assert submitted == list(range(10))


def test_failure_in_the_thread_reaches_the_caller(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(OSError, match="file"), Writer() as writer:
        writer.submit(write_png, tmp_path / "file/a.png", np.zeros((2, 2, 3), np.uint8))


def test_interrupt_finishes_the_file_in_hand(tmp_path: Path) -> None:
    started = threading.Event()
    done: list[str] = []

    def slow(name: str) -> None:
        started.set()
        time.sleep(0.2)
        done.append(name)

    def job() -> None:
        with Writer() as writer:
            for name in ("first", "second"):
                writer.submit(slow, name)
            started.wait(5.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        job()
    assert done == ["first"]
