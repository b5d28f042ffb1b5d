"""A sequence seen by an eye in time: broken off, split, started elsewhere; its by-products."""

from __future__ import annotations

import csv
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

from hdrusd.images import read_exr, read_exr_header, read_image, write_exr

FRAMES = 60


@pytest.fixture
def hdrusd(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
) -> CommandLine:
    return CommandLine(monkeypatch, capsys, gl)


@pytest.fixture(scope="module")
def night(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A dark road that a lamp crosses, from 0.05 up to 20,000 cd/m2; 24 frames a second."""
    folder = tmp_path_factory.mktemp("night")
    rows = np.geomspace(0.05, 3.0, 36)[:, None] * np.ones((36, 64))
    for frame in range(1, FRAMES + 1):
        picture = rows.copy()
        place = frame % 60
        picture[10:14, place : place + 4] = 20_000.0 * (frame / FRAMES)
        rgb = picture[..., None] * np.array([1.0, 0.8, 0.5])
        header = {"hdrusd:timeCodesPerSecond": 24.0, "hdrusd:frame": float(frame)}
        write_exr(folder / f"n.{frame:04}.exr", rgb.astype(np.float32), header)
    return str(folder / "n.####.exr")


def pictures(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.glob("p.0*.png"))}


@pytest.fixture(params=["irawan05", "pattanaik00", "reinhard02"])
def operator(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_what_was_begun_goes_on(
    hdrusd: CommandLine, night: str, tmp_path: Path, operator: str
) -> None:
    """Stopped between two saved states and taken up again, with frames missing in the middle."""
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    hdrusd.run("tonemap", night, whole / "p.####.png", "-op", operator)
    wanted = pictures(whole)
    assert len(wanted) == FRAMES
    hdrusd.run("tonemap", night, broken / "p.####.png", "-op", operator, "-f", "1:40")
    (broken / "p.0030.png").unlink()
    said = hdrusd.run(
        "tonemap", night, broken / "p.####.png", "-op", operator, "--resume", "--json"
    )
    assert json.loads(said.out)["skipped"] == 39
    assert pictures(broken) == wanted
    # the numbers of all frames too, also of those that were seen before the break
    tables = [(folder / "p.eye.csv").read_text() for folder in (whole, broken)]
    assert tables[0] == tables[1]


def test_a_split_sequence_is_the_whole_one(
    hdrusd: CommandLine, night: str, tmp_path: Path, operator: str
) -> None:
    whole, split = tmp_path / "whole", tmp_path / "split"
    hdrusd.run("tonemap", night, whole / "p.####.png", "-op", operator)
    to = ["tonemap", night, split / "p.####.png", "-op", operator]
    hdrusd.run(*to, "-f", "1:25", "--state-out", split / "a.json")
    hdrusd.run(*to, "-f", "26:60", "--state-in", split / "a.json")
    assert pictures(split) == pictures(whole)
    tables = [(folder / "p.eye.csv").read_text() for folder in (whole, split)]
    assert tables[0] == tables[1]


def test_killed(night: str, tmp_path: Path, gl: Any, hdrusd: CommandLine) -> None:
    """Kill -9 in the middle; the rest is made by --resume."""
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    hdrusd.run("tonemap", night, whole / "p.####.png", "-op", "irawan05")
    command = [sys.executable, "-c", "from hdrusd.cli import main; main()", "tonemap", night]
    job = subprocess.Popen(
        [*command, str(killed / "p.####.png"), "-op", "irawan05"],
        stdout=subprocess.DEVNULL,
        env=os.environ,
    )
    deadline = time.monotonic() + 60.0
    while not (killed / "p.0005.png").exists() and time.monotonic() < deadline:
        time.sleep(0.002)
    job.send_signal(signal.SIGKILL)
    job.wait()
    hdrusd.run("tonemap", night, killed / "p.####.png", "-op", "irawan05", "--resume")
    assert pictures(killed) == pictures(whole)


def test_states_of_other_settings_are_refused(
    hdrusd: CommandLine, night: str, tmp_path: Path
) -> None:
    to = ["tonemap", night, tmp_path / "p.####.png", "-op", "irawan05"]
    hdrusd.run(*to, "-f", "1:3")
    said = hdrusd.refused(*to, "-f", "1:5", "--resume", "--observer", "age=70", code=3)
    assert "p.eye.json" in said
    assert "other settings" in said


def test_adapted_elsewhere(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    """Who comes out of the light sees a night road darker than who is adapted to it."""
    for name, options in {
        "adapted": [],
        "from_light": ["--adapt-from", "10000"],
        "a_moment_of_light": ["--adapt-from", "10000,0.2"],
        "later": ["--adapt-from", "10000", "--warm-up", "60"],
    }.items():
        hdrusd.run(
            *["tonemap", night, tmp_path / name / "p.####.png", "-op", "irawan05", "-f", "1"],
            *options,
        )
    mean = {
        folder.name: read_image(folder / "p.0001.png").pixels.mean()
        for folder in tmp_path.iterdir()
    }
    assert mean["from_light"] < mean["later"] <= mean["adapted"]
    assert mean["from_light"] < mean["a_moment_of_light"]


def test_stills_know_no_time(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    hdrusd.run("tonemap", night, tmp_path / "all.####.png", "-op", "irawan05", "--stills")
    one = Path(night.replace("####", "0044"))
    hdrusd.run("tonemap", one, tmp_path / "one.png", "-op", "irawan05")
    assert (tmp_path / "all.0044.png").read_bytes() == (tmp_path / "one.png").read_bytes()
    assert not list(tmp_path.glob("*.eye.*"))


def test_a_cut(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    """With a reset at frame 50 the eye is that of who has only ever seen frame 50."""
    options = ["-op", "irawan05", "--adapt-from", "1000"]
    hdrusd.run(
        *["tonemap", night, tmp_path / "cut.####.png", *options, "--cut", "reset", "--cuts", "50"]
    )
    hdrusd.run("tonemap", night, tmp_path / "kept.####.png", *options, "--cuts", "50")
    hdrusd.run("tonemap", night, tmp_path / "own.####.png", "-op", "irawan05", "-f", "50")
    cut, kept, own = (
        (tmp_path / f"{name}.0050.png").read_bytes() for name in ("cut", "kept", "own")
    )
    assert cut == own
    assert kept != own


def steady(folder: Path) -> str:
    """A still street that one lamp crosses at 10 degrees a second, 48 frames."""
    rows = np.geomspace(0.02, 3.0, 90)[:, None, None] * np.ones((90, 160, 3)) * [1.0, 0.8, 0.5]
    rows[:25] = 1e-3
    for frame in range(1, 49):
        picture = rows.copy()
        place = 40 + 80 * frame // 48
        picture[50:52, place : place + 2] = 20_000.0
        header = {"hdrusd:timeCodesPerSecond": 24.0, "hdrusd:frame": float(frame)}
        write_exr(folder / f"n.{frame:04}.exr", picture.astype(np.float32), header)
    return str(folder / "n.####.exr")


@pytest.mark.parametrize(
    ("operator", "options", "limit"),
    [
        ("irawan05", [], 0.001),
        ("irawan05", ["--glare", "cie135"], 0.005),
        ("pattanaik00", [], 0.005),
        ("ward97", [], 0.0),
    ],
)
def test_a_moving_lamp_does_not_make_the_picture_flicker(
    hdrusd: CommandLine, tmp_path: Path, operator: str, options: list[str], limit: float
) -> None:
    """From frame to frame the screen's mean changes by less than the half per cent of docs/eye.md.

    0.1 % without a veil, whose light comes and goes at the frame's edges. An operator without
    a memory is not held to that, and says nothing.
    """
    to = ["tonemap", steady(tmp_path), tmp_path / "p.####.png", "-op", operator, "--json"]
    said = json.loads(hdrusd.run(*to, *options).out)
    if operator == "ward97":
        assert "flicker" not in said
    else:
        assert 0.0 < said["flicker"] < limit


def test_another_camera_is_a_cut(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    """Also for a run that is resumed just there."""
    for number, name in ((1, "front"), (2, "front"), (3, "rear"), (4, "rear")):
        rgb, header = read_exr(Path(night.replace("####", f"{number * 12:04}")))
        entries = {"hdrusd:frame": float(number), "hdrusd:camera": name}
        write_exr(tmp_path / f"n.{number}.exr", rgb, entries)
        assert header["hdrusd:frame"] == number * 12
    to = ["tonemap", tmp_path / "n.#.exr", tmp_path / "p.#.png", "-op", "irawan05"]
    options = ["--adapt-from", "1000", "--cut", "reset", "--fps", "24"]
    hdrusd.run(*to, *options, "-f", "1:4")
    wanted = (tmp_path / "p.3.png").read_bytes()
    hdrusd.run("tonemap", tmp_path / "n.3.exr", tmp_path / "own.png", "-op", "irawan05")
    assert wanted == (tmp_path / "own.png").read_bytes()
    (tmp_path / "p.eye.json").unlink()
    for number in (3, 4):
        (tmp_path / f"p.{number}.png").unlink()
    hdrusd.run(*to, *options, "-f", "1:2")
    hdrusd.run(*to, *options, "-f", "1:4", "--resume")
    assert wanted == (tmp_path / "p.3.png").read_bytes()


def test_numbers_of_the_eye(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    hdrusd.run("tonemap", night, tmp_path / "p.####.png", "-op", "irawan05")
    with (tmp_path / "p.eye.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["frame"]) for row in rows] == [float(n) for n in range(1, FRAMES + 1)]
    assert float(rows[-1]["time [s]"]) == pytest.approx(FRAMES / 24.0, rel=1e-12)
    assert all(float(row["goal luminance [cd/m2]"]) > 0.0 for row in rows)


REFUSED = [
    (["--adapt-from", "bright"], 2, "--adapt-from bright: want cd/m2"),
    (["--adapt-from", "-1"], 2, "--adapt-from -1: want"),
    (["--adapt-from", "10", "--state-in", "a.json"], 2, "exclude one another"),
    (["--state-in", "none.json"], 3, "none.json: no such file"),
    (["--state-in", "junk.json"], 3, "junk.json: not JSON"),
    (["--state-in", "deep.json"], 3, "deep.json: not JSON"),
    (["--state-in", "other.json"], 3, "other.json: state of pattanaik00; want one of irawan05"),
    (["--state-in", "empty.json"], 2, "irawan05: state: not an eye"),
    (["--warm-up", "3"], 2, "--warm-up: want --adapt-from"),
    (["--observer", "age=tall"], 2, "age"),
    (["--screen", "cinema9000"], 2, "cinema9000"),
    (["--glare", "fog"], 2, "fog: unknown"),
]


@pytest.mark.parametrize(("options", "code", "words"), REFUSED)
def test_refusals(
    hdrusd: CommandLine, night: str, tmp_path: Path, options: list[str], code: int, words: str
) -> None:
    state = {"frame": 0, "time": 0, "state": {}}
    for name, text in {
        "junk.json": "{",
        "deep.json": "[" * 100_000,
        "other.json": json.dumps(
            {"format": "hdrusd-eye/1", "operator": "pattanaik00", "states": [state]}
        ),
        "empty.json": json.dumps(
            {"format": "hdrusd-eye/1", "operator": "irawan05", "states": [state]}
        ),
    }.items():
        (tmp_path / name).write_text(text)
    given = [str(tmp_path / o) if o.endswith(".json") else o for o in options]
    to = ["tonemap", night, tmp_path / "p.####.png", "-op", "irawan05", "-f", "1:2"]
    assert words in hdrusd.refused(*to, *given, code=code)
    assert not list(tmp_path.glob("p.*"))


def test_exr_frames_hold_the_state(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    """``render`` writes it into the frame's header, from where another run takes it."""
    from stage_text import GROUND, SKY, panel, write_stage

    stage = write_stage(tmp_path / "a.usda", GROUND, panel("P", color=(0.2, 1, 0.1)), SKY)
    to = ["render", stage, tmp_path / "a.exr", "--png", tmp_path / "a.png", "-w", "64"]
    hdrusd.run(*to, "-op", "irawan05")
    document = json.loads(read_exr_header(tmp_path / "a.exr")["hdrusd:state"])
    assert document["operator"] == "irawan05"
    state = document["states"][0]
    hdrusd.run(
        *["tonemap", tmp_path / "a.exr", tmp_path / "b.png", "-op", "irawan05"],
        *["--state-in", tmp_path / "a.exr"],
    )
    assert state["state"]
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
