"""``hdrusd bracket`` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bracketed import STOPS, scene, write_bracket
from command_line import CommandLine

from hdrusd.colour import luminance
from hdrusd.images import read_exr

LIGHT = scene(60, 100)


@pytest.fixture
def hdrusd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(monkeypatch, capsys, None)


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    return write_bracket(tmp_path, LIGHT, suffix=".jpg")


def test_a_bracket_becomes_a_picture(hdrusd: CommandLine, files: list[Path]) -> None:
    output = files[0].parent / "lamp.exr"
    report = files[0].parent / "lamp.json"
    said = hdrusd.run("bracket", *files, "-o", output, "--spot", "50,30,3=250", "--report", report)
    assert said.out.startswith(f"{output}: 100 x 60, peak ")
    picture = read_exr(output)[0]
    down, right = np.ogrid[:60, :100]
    inside = (down - 30) ** 2 + (right - 50) ** 2 <= 9
    assert luminance(picture[inside].astype(np.float64)).mean() == pytest.approx(250.0, rel=1e-6)
    document = json.loads(report.read_text())
    assert document["format"] == "hdrusd-report/1"
    assert document["calibration"] == "spot 50,30,3 = 250 cd/m2"
    assert [source["file"] for source in document["sources"]] == [file.name for file in files]


def test_stops_and_exposures_say_the_same(hdrusd: CommandLine, files: list[Path]) -> None:
    outputs = [files[0].parent / name for name in ("a.exr", "b.exr", "c.exr")]
    options = [
        [],
        ["--ev", ",".join(f"{stop:g}" for stop in STOPS)],
        ["--exposures", ",".join(f"{2.0**stop:.9g}" for stop in STOPS)],
    ]
    for output, option in zip(outputs, options, strict=True):
        hdrusd.run("bracket", *files, "-o", output, "--candela", 5, "--area", "0.01", *option)
    first, *others = [read_exr(output)[0] for output in outputs]
    for other in others:
        assert np.median(np.abs(other / first - 1.0)) < 1e-4


def test_a_response_is_written_and_read(hdrusd: CommandLine, files: list[Path]) -> None:
    kept = files[0].parent / "camera.json"
    output = files[0].parent / "lamp.exr"
    hdrusd.run("bracket", *files, "-o", output, "--response", "robertson", "--response-out", kept)
    one = read_exr(output)[0]
    said = hdrusd.run("bracket", *files, "-o", output, "--response", kept, "--json", "-q")
    assert json.loads(said.out)["response"]["method"] == "robertson"
    assert read_exr(output)[0] == pytest.approx(one, rel=1e-5)


def test_an_estimate_is_a_finding(hdrusd: CommandLine, files: list[Path]) -> None:
    said = hdrusd.run("bracket", *files, "-o", files[0].parent / "a.exr", "--strict", code=6)
    assert "camera equation" in said.err


@pytest.mark.parametrize(
    ("options", "code", "line"),
    [
        (["--ev", "1,two"], 2, "want numbers with commas"),
        (["--ev", "nan,0,0,0,0,0,0"], 2, "want numbers with commas"),
        (["--ev", "900,0,0,0,0,0,0"], 2, "want stops of -39 to 39"),
        (["--ev", "0,1"], 3, "2 exposures for 7 pictures"),
        (["--exposures", "1,1,1,1,1,1,1"], 3, "of one exposure"),
        (["--exposures", "1,0,1,1,1,1,1"], 3, "want numbers above 0"),
        (["--ev", "0,1", "--exposures", "1,2"], 2, "want one of them"),
        (["--response", "fuji"], 2, "no such file; want one of debevec"),
        (
            ["--response", "srgb", "--response-out", "a.json"],
            2,
            "want a response that is recovered",
        ),
        (["--response", "srgb", "--smoothness", "3"], 2, "of --response debevec alone"),
        (["--spot", "4,4"], 2, "want X,Y"),
        (["--spot", "4=3"], 2, "want X,Y"),
        (["--spot", "4,4=3,2"], 2, "want X,Y"),
        (["--spot", "4.5,4=3"], 2, "want whole pixels"),
        (["--spot", "4,4=nan"], 2, "want numbers"),
        (["--spot", "4,4=0"], 2, "want a positive number"),
        (["--spot", "400,4=3"], 1, "outside of the picture"),
        (["--candela", "3"], 2, "want both"),
        (["--candela", "3", "--area", "0"], 2, "want a positive number"),
        (["--candela", "3", "--area", "1", "--region", "0,0,9"], 2, "want X,Y,W,H"),
        (["--candela", "3", "--area", "1", "--region", "0,0,999,9"], 1, "not inside"),
        (["--candela", "3", "--area", "1", "--region", "0,0,0,0"], 1, "not inside"),
        (["--camera-constant", "-1"], 2, "want a positive number"),
    ],
)
def test_wrong_use_is_one_line(
    hdrusd: CommandLine, files: list[Path], options: list[str], code: int, line: str
) -> None:
    output = files[0].parent / "lamp.exr"
    assert line in hdrusd.refused("bracket", *files, "-o", output, *options, code=code)
    assert not output.exists()


def test_one_image_and_a_wrong_output_are_one_line(hdrusd: CommandLine, files: list[Path]) -> None:
    folder = files[0].parent
    output = folder / "lamp.exr"
    assert "want 2 to 64" in hdrusd.refused("bracket", files[0], "-o", output, code=3)
    assert "ends in .exr" in hdrusd.refused("bracket", *files, "-o", folder / "a.png", code=2)
    assert "no such file" in hdrusd.refused(
        "bracket", folder / "x.jpg", files[0], "-o", output, code=3
    )
