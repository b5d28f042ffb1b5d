"""The log of the eye: every digit kept, what is missing stays empty, a plot with units."""

from __future__ import annotations

import builtins
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.adaptation_log import AdaptationLog, split
from hdrusd.errors import HdrusdError, InputError
from hdrusd.images import read_image

GOAL, PUPIL, ROD = "goal luminance [cd/m2]", "pupil [mm]", "rod threshold [cd/m2]"


def small_log() -> AdaptationLog:
    log = AdaptationLog()
    log.add(1, 0.0, {GOAL: 1000.0, PUPIL: 2.4, ROD: math.inf, "rod pigment": 0.7})
    log.add(2.5, 1.5 / 24.0, {GOAL: 0.1 + 0.2, PUPIL: 4.9})
    log.add(26, 25.0 / 24.0, {GOAL: 0.0, "cones": 1e-300, ROD: 0.01})
    return log


def test_header_and_lines(tmp_path: Path) -> None:
    small_log().write_csv(tmp_path / "eye.csv")
    lines = (tmp_path / "eye.csv").read_bytes().decode().split("\n")
    assert lines[0] == f"frame,time [s],{GOAL},{PUPIL},{ROD},rod pigment,cones"
    assert lines[1] == "1,0.0,1000.0,2.4,inf,0.7,"
    assert lines[2] == "2.5,0.0625,0.30000000000000004,4.9,,,"
    assert lines[3:] == ["26,1.0416666666666667,0.0,,0.01,,1e-300", ""]


def test_reading_undoes_writing(tmp_path: Path) -> None:
    log = small_log()
    log.write_csv(tmp_path / "eye.csv")
    assert AdaptationLog.read_csv(tmp_path / "eye.csv").rows == log.rows


def test_a_resumed_log_goes_on_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "eye.csv"
    small_log().write_csv(path)
    log = AdaptationLog.read_csv(path)
    log.add(26, 25.0 / 24.0, {GOAL: 7.0})
    log.add(2, 1.0 / 24.0, {GOAL: 8.0})
    log.write_csv(path)
    frames = [line.split(",")[0] for line in path.read_text().splitlines()]
    assert frames == ["frame", "1", "2", "2.5", "26"]
    assert "26,1.0416666666666667,7.0,,,\n" in path.read_text()


def test_a_log_that_cannot_be_written_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "eye.csv"
    small_log().write_csv(path)
    before = path.read_bytes()

    def interrupted(*_: object, **__: object) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr("hdrusd.adaptation_log.csv.writer", interrupted)
    with pytest.raises(KeyboardInterrupt):
        AdaptationLog().write_csv(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"time [s],frame\n",
        b"frame,goal\n1,2\n",
        b"frame,time [s]\n1\n",
        b"frame,time [s]\n1,2,3\n",
        b"frame,time [s]\nx,0\n",
        b"frame,time [s]\n1,x\n",
        b"frame,time [s]\n\n",
        b"\xff\xfe",
        b'frame,time [s]\n"' + b"x" * 200_000,
    ],
)
def test_another_file_is_refused_in_a_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "eye.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"eye\.csv:\d: not a log of the eye"):
        AdaptationLog.read_csv(path)


@pytest.mark.parametrize(
    ("column", "parts"),
    [
        (GOAL, ("goal luminance", "cd/m2")),
        ("rod pigment", ("rod pigment", "")),
        ("odd [", ("odd [", "")),
        ("[td]", ("[td]", "")),
    ],
)
def test_a_column_states_its_unit(column: str, parts: tuple[str, str]) -> None:
    assert split(column) == parts


@pytest.mark.parametrize("count", [0, 1, 3])
def test_the_plot_is_a_picture(tmp_path: Path, count: int) -> None:
    pytest.importorskip("matplotlib", reason="the plot needs matplotlib")
    log = AdaptationLog(dict(list(small_log().rows.items())[:count]))
    log.write_plot(tmp_path / "eye.png", "Tunnel")
    pixels = np.asarray(read_image(tmp_path / "eye.png").pixels)
    assert pixels.shape[1] == 1080  # 7.2 in at 150 dots
    assert pixels[..., :3].min() == 0  # text and axes
    assert pixels[..., :3].max() == 255


def test_panels_are_units_and_scales_fit_them() -> None:
    pytest.importorskip("matplotlib", reason="the plot needs matplotlib")
    log = small_log()
    figure = log._figure(log._panels(), "")
    cd, mm, share = figure.axes
    assert (cd.get_ylabel(), cd.get_yscale()) == ("Luminance (cd/m²)", "log")
    assert (mm.get_ylabel(), mm.get_yscale()) == ("Diameter (mm)", "linear")
    assert share.get_ylabel() == "Share"
    assert share.get_xlabel() == "Time (s)"
    goal, rod = cd.get_lines()
    np.testing.assert_array_equal(goal.get_ydata(), [1000.0, 0.1 + 0.2, np.nan])  # log of 0
    np.testing.assert_array_equal(rod.get_ydata(), [np.nan, np.nan, 0.01])
    np.testing.assert_array_equal(goal.get_xdata(), [0.0, 1.5 / 24.0, 25.0 / 24.0])


def test_without_matplotlib_there_is_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def missing(name: str, *rest: Any, **more: Any) -> Any:
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(HdrusdError, match=r"pip install 'hdrusd\[plot\]'"):
        small_log().write_plot(tmp_path / "eye.png")
    small_log().write_csv(tmp_path / "eye.csv")
    assert (tmp_path / "eye.csv").is_file()
