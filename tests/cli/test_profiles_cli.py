"""``hdrusd observers`` and ``hdrusd screens``."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import CommandLine

from hdrusd.eye.observer import Observer
from hdrusd.eye.screen import Screen


@pytest.fixture
def hdrusd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(monkeypatch, capsys, None)


def test_observers_are_listed_and_explained(hdrusd: CommandLine) -> None:
    listed = hdrusd.run("observers").out.splitlines()
    assert [line.split()[0] for line in listed] == list(Observer.profiles())
    for name in Observer.profiles():
        told = hdrusd.run("observers", name).out
        assert f"age={Observer.parse(name).age:g} years: " in told
    assert "pigment=1.2: " in hdrusd.run("observers", "elderly,pigment=1.2").out
    assert "known: blue-eyed," in hdrusd.refused("observers", "nobody", code=2)
    assert "want 10 to 100" in hdrusd.refused("observers", "age=3", code=2)


def test_screens_are_listed_and_explained(hdrusd: CommandLine, tmp_path: Path) -> None:
    listed = hdrusd.run("screens").out.splitlines()
    assert [line.split()[0] for line in listed] == list(Screen.profiles())
    told = hdrusd.run("screens", "hdr,peak=600").out
    assert "peak=600 cd/m2: " in told
    assert "field=none: " in told
    assert told.endswith("seen: 0.005 to 600 cd/m2, reflections included\n")
    (tmp_path / "lab.toml").write_text("peak = 1e9\n")
    line = hdrusd.refused("screens", tmp_path / "lab.toml", code=3)
    assert line == "lab.toml: screen: peak: 1000000000.0; want 0.1 to 100000"
