"""Input that cannot be had: exit 3 and one line, whichever command wants it; folders are 2."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from command_line import CommandLine, process

#: Commands up to the input, and what follows it.
COMMANDS = (
    (["convert"], ["o.usda"], ".obj"),
    (["convert"], ["o.usda"], ".usda"),
    (["inspect"], [], ".osgt"),
    (["recipe", "init"], ["-"], ".gltf"),
    (["recipe", "init"], ["-"], ".usda"),
    (["photometry"], [], ".ies"),
    (["bracket", "--ev", "0,1", "-o", "o.exr"], ["second.jpg"], ".jpg"),
    (["check"], [], ".usdc"),
    (["info"], [], ".exr"),
    (["info"], [], ".usd"),
    (["render"], ["o.exr"], ".usda"),
    (["tonemap"], ["o.png"], ".exr"),
    (["convert", "ok.obj", "o.usda", "--photometry"], [], ".toml"),
    (["tonemap", "x.exr", "o.png", "--observer"], [], ".toml"),
)
NAMES = "before", "after", "suffix"
BY_NAME = pytest.mark.parametrize(NAMES, COMMANDS)


@pytest.fixture
def hdrusd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(monkeypatch, capsys, None)


@pytest.fixture(autouse=True)
def at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, but for a triangle."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ok.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path


@BY_NAME
def test_a_file_that_is_not_there_is_exit_3(
    before: list[str], after: list[str], suffix: str, hdrusd: CommandLine
) -> None:
    line = hdrusd.refused(*before, f"none{suffix}", *after, code=3)
    assert line == f"none{suffix}: no such file"


@BY_NAME
def test_a_file_without_permission_is_exit_3(
    before: list[str], after: list[str], suffix: str, at: Path
) -> None:
    closed = at / f"closed{suffix}"
    closed.write_bytes(b"x")
    closed.chmod(0)
    said = process(*before, closed.name, *after, permitted=False)
    wanted = f"closed{suffix}: cannot be read: Permission denied; want a readable file\n"
    assert said == (3, "", wanted)


@BY_NAME
def test_a_pipe_is_exit_3(
    before: list[str], after: list[str], suffix: str, at: Path, hdrusd: CommandLine
) -> None:
    pipe = at / f"pipe{suffix}"
    os.mkfifo(pipe)
    line = hdrusd.refused(*before, pipe.name, *after, code=3)
    assert line == f"pipe{suffix}: not a regular file"


@pytest.mark.parametrize(NAMES, COMMANDS[2:-1])  # convert takes folders, the last words
def test_a_folder_is_wrong_use(
    before: list[str], after: list[str], suffix: str, at: Path, hdrusd: CommandLine
) -> None:
    (at / f"folder{suffix}").mkdir()
    line = hdrusd.refused(*before, f"folder{suffix}", *after, code=2)
    assert f"'folder{suffix}' is a directory" in line
