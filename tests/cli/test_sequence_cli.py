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

from hdrusd.by_products import screen_luminance
from hdrusd.colour import luminance, pq_encode, to_rec2020
from hdrusd.eye.screen import Screen
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


def test_two_halves_in_one_folder_are_one_sequence(
    hdrusd: CommandLine, night: str, tmp_path: Path
) -> None:
    """The second half goes on in the first one's file, so that the whole can be resumed."""
    to = ["tonemap", night, tmp_path / "p.####.png", "-op", "irawan05"]
    hdrusd.run(*to, "-f", "1:25")
    hdrusd.run(*to, "-f", "26:60", "--state-in", tmp_path / "p.eye.json")
    wanted = pictures(tmp_path)
    for frame in (5, 40):
        (tmp_path / f"p.{frame:04}.png").unlink()
    hdrusd.run(*to, "--resume")
    assert pictures(tmp_path) == wanted


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
    assert 0 < len(pictures(killed)) < FRAMES
    hdrusd.run("tonemap", night, killed / "p.####.png", "-op", "irawan05", "--resume")
    assert pictures(killed) == pictures(whole)
    assert (killed / "p.eye.csv").read_text() == (whole / "p.eye.csv").read_text()


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
    (["--state-in", "long.json"], 3, "long.json: states; want frame, time and state"),
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
        "long.json": json.dumps(
            {
                "format": "hdrusd-eye/1",
                "operator": "irawan05",
                "states": [{**state, "state": {"cone": [10**400]}}],
            }
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


def test_infinite_settings_are_kept(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    """JSON has no infinity, and white=inf is a setting that the paper has."""
    to = ["tonemap", night, tmp_path / "p.####.png", "--set", "white=inf", "-f", "1:3"]
    hdrusd.run(*to)
    (tmp_path / "p.0002.png").unlink()
    said = json.loads(hdrusd.run(*to, "--resume", "--json").out)
    assert said["skipped"] == 2


def test_pq_sequences(hdrusd: CommandLine, night: str, tmp_path: Path) -> None:
    """16 bits: resumed and measured like 8; but no video of BT.709 is made of them."""
    to = ["tonemap", night, tmp_path / "p.####.png", "-op", "irawan05", "--screen", "hdr"]
    hdrusd.run(*to, "-f", "1:4")
    table = (tmp_path / "p.eye.csv").read_text()
    (tmp_path / "p.0003.png").unlink()
    hdrusd.run(*to, "-f", "1:4", "--resume")
    assert (tmp_path / "p.eye.csv").read_text() == table
    assert "PQ" in hdrusd.refused(*to, "--video", tmp_path / "p.mp4", code=2)


def test_mean_luminance_of_screens() -> None:
    """Patches of one colour whose cd/m2 the screen is told."""
    for name, rgb in (("red", [4.0, 0.0, 0.0]), ("blue", [0.0, 0.0, 20.0]), ("grey", [3.0] * 3)):
        light = np.broadcast_to(np.array(rgb), (8, 8, 3))
        screen = Screen(eotf="pq", peak=1000.0, black=0.0, ambient=10.0, reflectance=0.1)
        code = (pq_encode(np.maximum(to_rec2020(light), 0.0)) * 65535.0 + 0.5).astype(np.uint16)
        wanted = float(luminance(np.array(rgb))) + 1.0 / np.pi
        assert screen_luminance(code, screen) == pytest.approx(wanted, rel=2e-3), name
    white = np.full((4, 4, 3), 255, np.uint8)
    assert screen_luminance(white, Screen()) == pytest.approx(100.0)
    assert screen_luminance(0 * white, Screen()) == pytest.approx(1.0)


def test_a_screen_s_field_is_for_frames_without_a_camera(
    hdrusd: CommandLine, tmp_path: Path, gl: Any
) -> None:
    """What the frame's camera says goes before; ``render`` and ``tonemap`` agree."""
    from stage_text import GROUND, SKY, panel, write_stage

    stage = write_stage(tmp_path / "a.usda", GROUND, panel("P", color=(0.2, 1, 0.1)), SKY)
    to = ["-op", "irawan05", "--screen", "headset", "--glare", "cie135"]
    hdrusd.run("render", stage, tmp_path / "a.exr", "--png", tmp_path / "a.png", "-w", "64", *to)
    hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "b.png", *to)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


LAMP_BESIDE = """
def SphereLight "Beside" {
    double3 xformOp:translate = (9, 1, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    bool treatAsPoint = 1
    float inputs:radius = 0.1
    float inputs:intensity = 300000
}
"""


def test_lamps_beside_the_frame_are_in_its_header(
    hdrusd: CommandLine, tmp_path: Path, gl: Any
) -> None:
    """So that they dazzle in the second pass as they did in the first."""
    from stage_text import GROUND, write_stage

    stage = write_stage(tmp_path / "a.usda", GROUND, LAMP_BESIDE)
    to = ["-op", "exposure", "--set", "scale=0.5", "--glare", "cie135"]
    hdrusd.run("render", stage, tmp_path / "a.exr", "--png", tmp_path / "a.png", "-w", "64", *to)
    assert len(json.loads(read_exr_header(tmp_path / "a.exr")["hdrusd:lamps"])) == 1
    hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "b.png", *to)
    hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "none.png", *to[:4])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "none.png").read_bytes()


ODD = {
    "hdrusd:camera": np.arange(9.0, dtype=np.float32),
    "hdrusd:frame": "first",
    "hdrusd:timeCodesPerSecond": -1.0,
    "hdrusd:lamps": "[[1, 2, 3]]",
    "hdrusd:exposureScale": "bright",
    "worldToCamera": "nowhere",
}


@pytest.mark.parametrize("name", ODD)
def test_odd_headers(hdrusd: CommandLine, night: str, tmp_path: Path, name: str) -> None:
    """What makes no sense is as if it were not there."""
    rgb, _ = read_exr(Path(night.replace("####", "0005")))
    write_exr(tmp_path / "plain.exr", rgb)
    write_exr(tmp_path / "odd.exr", rgb, {name: ODD[name]})
    for file in ("plain", "odd"):
        to = ["-op", "irawan05", "--glare", "cie135"]
        hdrusd.run("tonemap", tmp_path / f"{file}.exr", tmp_path / f"{file}.png", *to)
    assert (tmp_path / "odd.png").read_bytes() == (tmp_path / "plain.png").read_bytes()


def test_broken_scotopic_layer(hdrusd: CommandLine, tmp_path: Path) -> None:
    """No light where it is not a number, on the GPU and in NumPy."""
    rgb = np.full((8, 8, 3), 0.01, np.float32)
    rods = np.full((8, 8), 0.02, np.float32)
    rods[2, 2], rods[3, 3], rods[4, 4] = np.nan, -1.0, np.inf
    write_exr(tmp_path / "a.exr", rgb, layers={"scotopic.Y": rods})
    to = ["--night-vision", "colour", "-op", "exposure", "--set", "scale=20"]
    for name, options in (("gpu", []), ("cpu", ["--reference"])):
        hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / f"{name}.png", *to, *options)
    gpu, cpu = (read_image(tmp_path / f"{n}.png").pixels.astype(int) for n in ("gpu", "cpu"))
    assert np.abs(gpu - cpu).max() <= 1
    assert gpu[2, 2].max() < gpu[0, 0].max()
    assert gpu[4, 4].min() == 255


@pytest.mark.parametrize(
    "option", [["--night-vision", "all"], ["--cut", "reset"], ["--glare", "cie135"], ["--plot"]]
)
def test_options_of_pictures_want_a_picture(
    hdrusd: CommandLine, tmp_path: Path, option: list[str]
) -> None:
    from stage_text import GROUND, SKY, write_stage

    stage = write_stage(tmp_path / "a.usda", GROUND, SKY)
    said = hdrusd.refused("render", stage, tmp_path / "a.exr", *option, code=2)
    assert f"{option[0]}: nothing is tone mapped" in said


def test_the_camera_s_exposure_goes_with_the_frame(
    hdrusd: CommandLine, night: str, tmp_path: Path
) -> None:
    rgb, _ = read_exr(Path(night.replace("####", "0005")))
    write_exr(tmp_path / "a.exr", rgb, {"hdrusd:exposureScale": 0.25})
    hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "a.png", "-op", "exposure")
    to = ["-op", "exposure", "--set", "scale=0.25"]
    hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "b.png", *to)
    # The files say how they were made, and differ in that.
    first, second = (read_image(tmp_path / name).pixels for name in ("a.png", "b.png"))
    assert np.array_equal(first, second)
