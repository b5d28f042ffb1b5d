"""``hdrusd render``: usdrecord's names and grammar, exit codes, files."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine, process
from stage_text import CAMERA, GROUND, SKY, panel, write_stage

from hdrusd.images import read_exr, read_image


@pytest.fixture
def hdrusd(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
) -> CommandLine:
    return CommandLine(monkeypatch, capsys, gl)


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    return write_stage(tmp_path / "street.usda", GROUND, SKY)


SMALL = ("--imageWidth", 64)


def test_one_frame(hdrusd: CommandLine, stage: Path, tmp_path: Path) -> None:
    exr = tmp_path / "a.exr"
    said = hdrusd.run("render", stage, exr, *SMALL)
    assert said.out == f"{exr}\n"
    assert said.err == ""  # no progress bar in a pipe, no findings
    rgb, _ = read_exr(exr)
    np.testing.assert_allclose(rgb, np.full((48, 64, 3), 10.0), rtol=1e-6)


def test_frames_with_pictures(hdrusd: CommandLine, stage: Path, tmp_path: Path) -> None:
    exr, png = tmp_path / "hdr/f.####.exr", tmp_path / "ldr/f.####.png"
    said = hdrusd.run("render", stage, exr, "--png", png, "--frames", "1:3x2,7", *SMALL)
    numbers = ("0001", "0003", "0007")
    wanted = [
        tmp_path / f"{kind}/f.{n}.{end}"
        for n in numbers
        for kind, end in (("hdr", "exr"), ("ldr", "png"))
    ]
    assert said.out.split() == [str(path) for path in wanted]
    assert all(path.is_file() for path in wanted)
    assert sorted(p.name for p in (tmp_path / "hdr").iterdir()) == [f"f.{n}.exr" for n in numbers]


def test_picture_alone(hdrusd: CommandLine, stage: Path, tmp_path: Path) -> None:
    hdrusd.run(
        "render", stage, tmp_path / "a.png", "--operator", "exposure", "--set", "ev100=3", *SMALL
    )
    assert read_image(tmp_path / "a.png").pixels.shape == (48, 64, 3)
    assert not list(tmp_path.glob("*.exr"))


#: usdrecord's spelling, and kebab-case.
SPELLINGS = {
    "camera": ["--camera", "-cam"],
    "width": ["--imageWidth", "--image-width", "-w"],
    "frames": ["--frames", "-f"],
    "default": ["--defaultTime", "--default-time", "-d"],
    "session": ["--sessionLayer", "--session-layer"],
    "settings": ["--renderSettingsPrimPath", "--render-settings-prim-path", "-rs"],
    "dark": ["--disableCameraLight", "--disable-camera-light"],
    "sky": ["--enableDomeLightVisibility", "--enable-dome-light-visibility"],
}


@pytest.mark.parametrize("name", [n for names in SPELLINGS.values() for n in names])
def test_option_names_of_usdrecord(hdrusd: CommandLine, tmp_path: Path, name: str) -> None:
    settings = 'def RenderSettings "Two"\n{\n    uniform int2 resolution = (32, 24)\n}\n'
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, settings)
    session = tmp_path / "session.usda"
    session.write_text('#usda 1.0\nover "Sky"\n{\n    float inputs:intensity = 3\n}\n')
    (meaning,) = [key for key, names in SPELLINGS.items() if name in names]
    values = {"camera": "/Camera", "width": "32", "frames": "5", "session": str(session)}
    values["settings"] = "/Two"
    given = [name, values[meaning]] if meaning in values else [name]
    if meaning not in ("width", "settings"):
        given += ["-w", "32"]
    target = tmp_path / ("f.####.exr" if meaning == "frames" else "f.exr")
    hdrusd.run("render", stage, target, *given)
    rgb, _ = read_exr(tmp_path / ("f.0005.exr" if meaning == "frames" else "f.exr"))
    assert rgb.shape == (24, 32, 3)
    assert rgb[12, 16, 0] == pytest.approx(3.0 if meaning == "session" else 10.0)


def test_resume(hdrusd: CommandLine, stage: Path, tmp_path: Path) -> None:
    command = ("render", stage, tmp_path / "f.####.exr", "-f", "1:4", *SMALL)
    hdrusd.run(*command)
    (tmp_path / "f.0003.exr").unlink()
    said = hdrusd.run(*command, "--resume", "--json")
    document = json.loads(said.out)
    assert document["files"] == [str(tmp_path / "f.0003.exr")]
    assert (document["frames"], document["skipped"]) == (4, 3)


def test_json_is_one_object(hdrusd: CommandLine, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND)
    said = hdrusd.run("render", stage, tmp_path / "a.exr", "--json", *SMALL)
    document = json.loads(said.out)
    assert document["files"] == [str(tmp_path / "a.exr")]
    assert [finding["code"] for finding in document["findings"]] == ["default-sky"]
    assert "no light" in said.err
    report = tmp_path / "report.json"
    hdrusd.run("render", stage, tmp_path / "a.exr", "--report", report, "--quiet", *SMALL)
    assert json.loads(report.read_text())["findings"] == document["findings"]


def test_strict_and_disable_camera_light(hdrusd: CommandLine, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND)
    exr = tmp_path / "a.exr"
    said = hdrusd.run("render", stage, exr, "--strict", *SMALL, code=6)
    assert said.out == f"{exr}\n"
    assert "--disableCameraLight" in said.err
    said = hdrusd.run("render", stage, exr, "--strict", "--disableCameraLight", *SMALL)
    assert said.err == ""
    assert not read_exr(exr)[0].any()


def test_mask_and_purposes(hdrusd: CommandLine, tmp_path: Path) -> None:
    guide = panel("Guide", inside='uniform token purpose = "guide"')
    stage = write_stage(tmp_path / "a.usda", GROUND, guide, SKY)
    exr = tmp_path / "a.exr"
    for given, red in (([], 10), (["--purposes", "render,guide"], 0)):
        hdrusd.run("render", stage, exr, *given, *SMALL)
        assert read_exr(exr)[0][24, 32, 0] == pytest.approx(red)
    said = hdrusd.run("render", stage, exr, "--mask", "/Camera,/Ground", *SMALL)
    assert "no light" in said.err
    line = hdrusd.refused("render", stage, exr, "--mask", "/Camera,/Sky", *SMALL, code=3)
    assert "nothing to draw" in line


def test_half_and_petit2010(hdrusd: CommandLine, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY.replace("= 10", "= 30000"))
    exr = tmp_path / "a.exr"
    said = hdrusd.run("render", stage, exr, "--half", "--reflection", "petit2010", *SMALL)
    assert "clipped at 65504 cd/m2" in said.err
    assert read_exr(exr)[0].max() == 65504.0
    said = hdrusd.run("render", stage, exr, "--half", *SMALL)
    assert said.err == ""
    assert read_exr(exr)[0][24, 32, 0] == pytest.approx(30000.0, rel=2**-11)


# -- refusals: one line, a documented code, no file -------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "code", "line"),
    [
        (["{stage}", "a.jpg"], 2, "a.jpg: want a name that ends in .exr or .png"),
        (["{stage}", "a"], 2, "want a name that ends in"),
        (["{stage}"], 2, "Missing argument 'OUTPUT'"),
        (["none.usda", "a.exr"], 3, "none.usda: no such file"),
        (["/dev/zero", "a.exr"], 3, "zero: not a regular file"),
        ([".", "a.exr"], 2, "is a directory"),
        (["{stage}", "a.exr", "--camera", "/Nope"], 3, "/Nope: no such camera; the stage has"),
        (["{stage}", "a.exr", "-f", "1:3"], 2, "a.exr: no frame placeholder"),
        (["{stage}", "a.####.exr"], 2, "a frame placeholder and no frames"),
        (["{stage}", "a.####.exr", "-f", "1:x"], 2, "'1:x': not a frame list"),
        (["{stage}", "a.####.exr", "-f", ""], 2, "not a frame list"),
        (["{stage}", "a.####.exr", "-f", "1:2x0.5"], 2, "a.####.exr"),
        (["{stage}", "a.####.exr", "-f", "1e999999999"], 2, "--frames"),
        (["{stage}", "a.####.exr", "-f", "1", "-d"], 2, "exclude one another"),
        (["{stage}", "a.exr", "-w", "0"], 2, "not in the range"),
        (["{stage}", "a.exr", "-w", "20000"], 2, "not in the range"),
        (["{stage}", "a.exr", "--operator", "reinhard02"], 2, "nothing is tone mapped"),
        (["{stage}", "a.png", "--png", "b.png"], 2, "OUTPUT is a PNG already"),
        (["{stage}", "a.exr", "--png", "b.jpg"], 2, "b.jpg: want a name that ends in .png"),
        (["{stage}", "a.png", "--operator", "nope"], 2, "nope: unknown; "),
        (["{stage}", "a.png", "--set", "foo=1"], 2, "foo: unknown; known: key, white"),
        (["{stage}", "a.png", "--set", "key=-1"], 2, "key: -1"),
        (["{stage}", "a.png", "--set", "key=big"], 2, "key: big"),
        (["{stage}", "a.png", "--set", "key"], 2, "want NAME=VALUE"),
        (["{stage}", "a.exr", "--purposes", "render,foo"], 2, "--purposes: foo; want render"),
        (["{stage}", "a.exr", "--mask", "World"], 3, "--mask World: no prim path"),
        (["{stage}", "a.exr", "--sessionLayer", "none.usda"], 3, "none.usda: no such file"),
        (["{stage}", "a.exr", "-rs", "/Camera"], 3, "/Camera: no RenderSettings"),
        (["{stage}", "a.exr", "--reflection", "phong"], 2, "'lambert', 'petit2010'"),
        (["{stage}", "/proc/none/a.exr"], 1, "/proc/none"),
        (["{stage}", "/proc/a.exr"], 1, "/proc/a.exr: cannot be written"),
        (["{stage}", "/proc/a.png"], 1, "/proc/a.png: cannot be written"),
        (["{stage}", "/dev/null/a.exr"], 1, "/dev/null"),
        (["{stage}", "a.exr", "--report", "."], 2, "is a directory"),
        (["{stage}", "a.exr", "--report", "/proc/none/r.json"], 1, "/proc/none/r.json: nothing"),
        (["{stage}", "a.exr", "--report", "{stage}/r.json"], 1, "street.usda (Not a directory)"),
        (["{stage}", "a.exr", "--report", "/dev/null"], 1, "/dev/null: not a regular file"),
        (["{stage}", "a.exr", "--frame", "1"], 2, "No such option"),
    ],
)
def test_refusals(
    hdrusd: CommandLine,
    stage: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    code: int,
    line: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    given = [argument.replace("{stage}", str(stage)) for argument in arguments]
    assert line in hdrusd.refused("render", *given, code=code)
    assert [path.name for path in tmp_path.iterdir()] == ["street.usda"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_read_only_folder(hdrusd: CommandLine, stage: Path, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o555)
    assert "locked" in hdrusd.refused("render", stage, folder / "a.exr", code=1)


@pytest.mark.parametrize(
    "name", ["empty.usda", "empty.usdc", "ref_cycle_a.usda", "ref_cycle_b.usda"]
)
def test_hostile_stages(hdrusd: CommandLine, testdata: Path, tmp_path: Path, name: str) -> None:
    """Empty files are no stages; two that include each other hold nothing to draw."""
    file = testdata / "data" / "hostile" / name
    assert name in hdrusd.refused("render", file, tmp_path / "a.exr", code=3)
    assert not list(tmp_path.iterdir())


# -- processes of their own -------------------------------------------------------------------


def test_without_a_driver_one_line_says_what_to_install(stage: Path, tmp_path: Path) -> None:
    """With libglvnd and no vendor EGL is there and has no device."""
    said = process("render", stage, tmp_path / "a.exr", __EGL_VENDOR_LIBRARY_FILENAMES="/dev/null")
    if said.code == 0:
        pytest.skip("this machine's EGL is not libglvnd's")
    assert said.code == 5
    assert said.err.count("\n") == 1
    assert "apt-get install libegl1 libgl1-mesa-dri" in said.err
    assert not (tmp_path / "a.exr").exists()


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_leaves_whole_frames_only(gl: Any, tmp_path: Path, sent: signal.Signals) -> None:
    """Ctrl-C, or a scheduler's word to stop, in the middle of 200 frames."""
    moving = CAMERA.replace(
        "xformOp:translate = (0, 0, 4)",
        "xformOp:translate.timeSamples = { 1: (0, 0, 4), 200: (1, 1, 3) }",
    )
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, panel("Panel"), camera=moving)
    frames = tmp_path / "frames"
    job = subprocess.Popen(
        [
            *[sys.executable, "-c", "from hdrusd.cli import main; main()", "render", stage],
            *[frames / "f.####.exr", "--png", frames / "f.####.png", "-f", "1:200", "-w", "640"],
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Who starts the tests in the background hands down an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 30.0
    while not (frames / "f.0003.png").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    job.send_signal(sent)
    out, err = job.communicate(timeout=30.0)
    assert job.returncode == 130, err
    assert err.strip() == "interrupted"
    assert out == ""
    written = sorted(frames.iterdir())
    assert 6 <= len(written) < 400
    assert {path.suffix for path in written} == {".exr", ".png", ".json", ".csv"}
    assert not [path for path in written if path.name.startswith(".")]
    last = [max(frames.glob(f"*.{end}")) for end in ("exr", "png")]
    assert read_exr(last[0])[0].shape == (480, 640, 3)
    assert read_image(last[1]).pixels.shape == (480, 640, 3)
