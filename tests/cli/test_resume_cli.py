"""``--resume`` and what is there already: by other settings, by a run that was killed."""

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
from command_line import CommandLine
from stage_text import GROUND, write_stage

from hdrusd.images import read_exr_header, read_image, read_png_text, write_exr, write_png

FRAMES = 40

#: A lamp that comes up over 40 frames, from 1 to 400 cd/m2 on the ground.
LAMP = """
def SphereLight "Lamp"
{
    double3 xformOp:translate = (0.3, 0.2, 1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    float inputs:radius = 0.05
    float inputs:intensity.timeSamples = { 1: 500, 40: 200000 }
}
"""


@pytest.fixture
def hdrusd(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
) -> CommandLine:
    return CommandLine(monkeypatch, capsys, gl)


@pytest.fixture
def dusk(tmp_path: Path) -> Path:
    head = f"startTimeCode = 1\n    endTimeCode = {FRAMES}"
    return write_stage(tmp_path / "a.usda", GROUND, LAMP, head=head)


@pytest.fixture
def night(tmp_path: Path) -> str:
    """Four frames."""
    for number in range(1, 5):
        pixels = np.geomspace(0.1, 50.0, 12 * 16 * 3).reshape(12, 16, 3).astype(np.float32)
        write_exr(tmp_path / f"n.{number}.exr", pixels * number, {"hdrusd:frame": float(number)})
    return str(tmp_path / "n.#.exr")


def codes(report: Path) -> list[str]:
    return [finding["code"] for finding in json.loads(report.read_text())["findings"]]


def test_render_that_was_killed_goes_on_as_if_it_had_not_been(
    hdrusd: CommandLine, dusk: Path, tmp_path: Path
) -> None:
    """Kill -9 in the middle: pictures, frames with their states, and the table are the same."""
    options = ["-f", f"1:{FRAMES}", "-w", "48", "-op", "irawan05", "--glare", "cie135"]

    def files(name: str) -> list[Path]:
        folder = tmp_path / name
        return [folder / "h.####.exr", "--png", folder / "p.####.png"]  # type: ignore[list-item]

    hdrusd.run("render", dusk, *files("whole"), *options)
    command = [sys.executable, "-c", "from hdrusd.cli import main; main()", "render", str(dusk)]
    job = subprocess.Popen(
        [*command, *map(str, files("killed")), *options], stdout=subprocess.DEVNULL, env=os.environ
    )
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "killed/p.0005.png").exists() and time.monotonic() < deadline:
        time.sleep(0.002)
    job.send_signal(signal.SIGKILL)
    job.wait()
    before = len(list((tmp_path / "killed").glob("p.*.png")))
    assert 0 < before < FRAMES
    hdrusd.run("render", dusk, *files("killed"), *options, "--resume")
    for name in (*(f"p.{n:04}.png" for n in range(1, FRAMES + 1)), "p.eye.csv"):
        assert (tmp_path / "killed" / name).read_bytes() == (
            tmp_path / "whole" / name
        ).read_bytes(), name
    for number in range(1, FRAMES + 1):
        killed, whole = (
            read_exr_header(tmp_path / name / f"h.{number:04}.exr")["hdrusd:state"]
            for name in ("killed", "whole")
        )
        assert killed == whole


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["-op", "drago03"], "operator, parameters"),
        (["--set", "weights=centre"], "parameters"),
        (["--glare", "cie135"], "glare"),
        (["--night-vision", "acuity"], "acuity"),
        (["--screen", "peak=80"], "screen"),
        (["--observer", "elderly"], "observer"),
    ],
)
def test_pictures_by_other_settings_are_refused(
    hdrusd: CommandLine, night: str, tmp_path: Path, changes: list[str], said: str
) -> None:
    """An operator without a memory has no file of states that could tell."""
    to = ["tonemap", night, tmp_path / "p.#.png"]
    usual = ["-op", "ward97"]
    hdrusd.run(*to, *usual, "-f", "1:2")
    before = (tmp_path / "p.1.png").read_bytes()
    usual = [] if "-op" in changes else usual
    message = hdrusd.refused(*to, *usual, *changes, "-f", "1:4", "--resume", code=3)
    assert f"p.1.png: a picture by other settings ({said})" in message
    assert not (tmp_path / "p.3.png").exists()
    assert (tmp_path / "p.1.png").read_bytes() == before
    hdrusd.run(*to, "-op", "ward97", "-f", "1:4", "--resume", "--report", tmp_path / "r.json")
    assert (tmp_path / "p.1.png").read_bytes() == before
    assert (tmp_path / "p.4.png").is_file()
    assert "resume-unknown" not in codes(tmp_path / "r.json")


@pytest.mark.parametrize("text", [None, "[1, 2", "[1, 2]", "x" * 70_000])
def test_pictures_that_say_nothing_are_taken_for_this_runs(
    hdrusd: CommandLine, night: str, tmp_path: Path, text: str | None
) -> None:
    texts = {"hdrusd:viewing": text} if text else None
    write_png(tmp_path / "p.1.png", np.zeros((12, 16, 3), np.uint8), texts=texts)
    (tmp_path / "p.2.png").write_bytes(b"not a picture")
    to = ["tonemap", night, tmp_path / "p.#.png", "-op", "ward97", "--resume"]
    hdrusd.run(*to, "--report", tmp_path / "r.json")
    (found,) = json.loads((tmp_path / "r.json").read_text())["findings"]
    assert found["code"] == "resume-unknown"
    assert found["text"].startswith("2 files ")
    assert (tmp_path / "p.4.png").is_file()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["--samples", "2"], "samples"),
        (["--reflection", "petit2010"], "reflection"),
        (["--shadows", "none"], "shadows"),
        (["-w", "40"], "size"),
    ],
)
def test_frames_by_other_settings_are_refused(
    hdrusd: CommandLine, dusk: Path, tmp_path: Path, changes: list[str], said: str
) -> None:
    to = ["render", dusk, tmp_path / "h.#.exr"]
    hdrusd.run(*to, "-w", "48", "-f", "1:2")
    size = [] if "-w" in changes else ["-w", "48"]
    message = hdrusd.refused(*to, *size, *changes, "-f", "1:3", "--resume", code=3)
    assert f"h.1.exr: a frame by other settings ({said})" in message
    hdrusd.run(*to, "-w", "48", "-f", "1:3", "--resume")
    assert (tmp_path / "h.3.exr").is_file()


def test_a_picture_says_how_it_was_seen(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    hdrusd.run("tonemap", night, tmp_path / "p.#.png", "-op", "ward97", "--observer", "age=60")
    said = json.loads(read_png_text(tmp_path / "p.3.png", "hdrusd:viewing") or "")
    assert said["operator"] == "ward97"
    assert said["observer"]["age"] == 60.0
    assert read_image(tmp_path / "p.3.png").pixels.shape == (12, 16, 3)


def test_cuts_that_are_no_frames_are_told(
    hdrusd: CommandLine, dusk: Path, night: str, tmp_path: Path
) -> None:
    to = [
        "tonemap",
        night,
        tmp_path / "p.#.png",
        "-op",
        "irawan05",
        "--report",
        tmp_path / "r.json",
    ]
    hdrusd.run(*to, "--cuts", "2,9,100:200")
    (found,) = (
        f for f in json.loads((tmp_path / "r.json").read_text())["findings"] if f["code"] == "cuts"
    )
    assert found["text"].startswith("--cuts 9, 100, 101, 102, 103, 104, 105, 106, ...: ")
    hdrusd.run(*to, "--cuts", "2:4")
    assert "cuts" not in codes(tmp_path / "r.json")
    to = ["render", dusk, tmp_path / "q.#.png", "-w", "16", "--report", tmp_path / "r.json"]
    hdrusd.run(*to, "-op", "irawan05", "-f", "1:2", "--cuts", "5")
    assert "cuts" in codes(tmp_path / "r.json")


@pytest.mark.parametrize(
    ("glare", "observer", "told"),
    [
        ("cie135", "age=70,pigment=1.2", ""),
        ("spencer95", "age=70,pigment=1.2", "observer's age 70, pigment 1.2: "),
        ("ward97", "pigment=0", "observer's pigment 0: "),
        ("ward97", "slow=5", ""),
        ("none", "age=70", ""),
    ],
)
def test_an_observer_whom_the_glare_does_not_know(
    hdrusd: CommandLine, night: str, tmp_path: Path, glare: str, observer: str, told: str
) -> None:
    to = ["tonemap", night, tmp_path / "p.#.png", "-op", "ward97", "-f", "1"]
    hdrusd.run(*to, "--glare", glare, "--observer", observer, "--report", tmp_path / "r.json")
    texts = [
        finding["text"]
        for finding in json.loads((tmp_path / "r.json").read_text())["findings"]
        if finding["code"] == "glare-observer"
    ]
    assert len(texts) == (1 if told else 0)
    assert not told or texts[0].startswith(told)
