"""Where the eye's commands write, and what they leave alone."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine

from hdrusd.images import read_image, write_exr


@pytest.fixture
def hdrusd(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
) -> CommandLine:
    return CommandLine(monkeypatch, capsys, gl)


@pytest.fixture
def frames(tmp_path: Path) -> str:
    for number in (1, 2, 3):
        rgb = np.geomspace(0.01, 100.0 * number, 48, dtype=np.float32).reshape(6, 8, 1)
        header = {"hdrusd:timeCodesPerSecond": 24.0, "hdrusd:frame": float(number)}
        write_exr(tmp_path / f"n.{number}.exr", rgb * np.ones(3, np.float32), header)
    return str(tmp_path / "n.#.exr")


@pytest.mark.parametrize("option", ["--state-out", "--report"])
def test_a_pipe_is_no_place_for_a_file(
    hdrusd: CommandLine, frames: str, tmp_path: Path, option: str
) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    to = ["tonemap", frames, tmp_path / "p.#.png", "-op", "irawan05", option, pipe]
    assert "not a regular file" in hdrusd.run(*to, code=1).err
    assert pipe.is_fifo()


def test_a_link_stays_one(hdrusd: CommandLine, frames: str, tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    link = tmp_path / "link.json"
    link.symlink_to(tmp_path / "far" / "states.json")
    hdrusd.run(*["tonemap", frames, tmp_path / "p.#.png", "-op", "irawan05", "--state-out", link])
    assert link.is_symlink()
    assert json.loads((tmp_path / "far" / "states.json").read_text())["operator"] == "irawan05"


def test_info_of_a_frame(hdrusd: CommandLine, frames: str) -> None:
    said = json.loads(hdrusd.run("info", frames.replace("#", "1"), "--json").out)
    assert said["maximum"] == pytest.approx(100.0, rel=1e-5)
    assert said["hdrusd:frame"] == 1.0


def test_another_operator_s_table_is_not_told(
    hdrusd: CommandLine, frames: str, tmp_path: Path
) -> None:
    to = ["tonemap", frames, tmp_path / "p.#.png", "--json"]
    assert "flicker" in json.loads(hdrusd.run(*to, "-op", "pattanaik00").out)
    assert "flicker" not in json.loads(hdrusd.run(*to, "-op", "ward97").out)


def test_missing_frames_are_told_before_anything_is_written(
    hdrusd: CommandLine, frames: str, tmp_path: Path
) -> None:
    to = ["tonemap", frames, tmp_path / "p.#.png", "-op", "irawan05"]
    hdrusd.run(*to, "-f", "1:3")
    before = {file: file.read_bytes() for file in tmp_path.glob("p.*")}
    assert "n.4.exr: no such file" in hdrusd.refused(*to, "-f", "1:4", code=3)
    assert {file: file.read_bytes() for file in tmp_path.glob("p.*")} == before


def test_other_settings_are_named(hdrusd: CommandLine, frames: str, tmp_path: Path) -> None:
    to = ["tonemap", frames, tmp_path / "p.#.png", "-op", "irawan05"]
    hdrusd.run(*to)
    said = hdrusd.refused(*to, "--night-vision", "acuity", "--resume", code=3)
    assert "other settings (acuity)" in said


def test_the_next_shot_begins_with_the_last_eye(
    hdrusd: CommandLine, frames: str, tmp_path: Path
) -> None:
    """A shot numbered from 1 again goes on with the last state of the one before."""
    to = ["tonemap", frames]
    hdrusd.run(*to, tmp_path / "a.#.png", "-op", "irawan05", "--adapt-from", "5000")
    for name, options in (("b", ["--state-in", tmp_path / "a.eye.json"]), ("c", [])):
        hdrusd.run(*to, tmp_path / f"{name}.#.png", "-op", "irawan05", "-f", "1", *options)
    after, alone = (read_image(tmp_path / f"{name}.1.png").pixels for name in "bc")
    assert after.mean() < alone.mean()


def test_broken_pixels_are_told(hdrusd: CommandLine, tmp_path: Path) -> None:
    rgb = np.ones((4, 4, 3), np.float32)
    rgb[0, 0], rgb[1, 1], rgb[2, 2, 0] = np.nan, np.inf, -1.0
    write_exr(tmp_path / "a.exr", rgb)
    said = hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "a.png", "--json").out
    (finding,) = json.loads(said)["findings"]
    assert finding["code"] == "exr-pixels"
    assert finding["text"].startswith("3 pixels")


def test_a_lamp_in_the_dark_has_no_ghosts(hdrusd: CommandLine, tmp_path: Path) -> None:
    """What is dark beside a lamp does not gather the lamp's light."""
    rgb = np.full((200, 300, 3), 1e-4, np.float32)
    rgb[60:63, 150:160] = 9000.0
    write_exr(tmp_path / "a.exr", rgb)
    to = ["tonemap", tmp_path / "a.exr", tmp_path / "a.png", "--night-vision", "acuity"]
    hdrusd.run(*to, "-op", "exposure", "--set", "scale=0.001", "--field", "30")
    picture = read_image(tmp_path / "a.png").pixels.max(axis=-1)
    picture[58:65, 148:162] = 0
    assert picture.max() <= 1
