"""``hdrusd tonemap``: the second half of the way alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine, process
from stage_text import GROUND, SKY, panel, write_stage

from hdrusd.images import read_image, write_exr


@pytest.fixture
def hdrusd(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
) -> CommandLine:
    return CommandLine(monkeypatch, capsys, gl)


def gradient(path: Path, scale: float = 1.0) -> Path:
    """0.01 to 10,000 cd/m2 from left to right."""
    row = scale * np.logspace(-2.0, 4.0, 96, dtype=np.float32)
    write_exr(path, np.broadcast_to(row[None, :, None], (20, 96, 3)) * np.float32([1.0, 0.8, 0.5]))
    return path


def test_a_frame_becomes_a_picture(hdrusd: CommandLine, tmp_path: Path) -> None:
    said = hdrusd.run("tonemap", gradient(tmp_path / "a.exr"), tmp_path / "a.png")
    assert said.out == f"{tmp_path / 'a.png'}\n"
    assert said.err == ""
    picture = read_image(tmp_path / "a.png").pixels.astype(int)
    assert picture.shape == (20, 96, 3)
    # brighter from left to right but for the dither's one code
    assert np.diff(picture[:, :, 0].max(axis=0)).min() >= -1
    assert picture[:, 0].max() < 10
    assert picture[:, -1].max() > 250


@pytest.mark.parametrize("operator", ["reinhard02", "exposure", "falsecolour"])
def test_reference_and_gpu_agree(hdrusd: CommandLine, tmp_path: Path, operator: str) -> None:
    source = gradient(tmp_path / "a.exr")
    hdrusd.run("tonemap", source, tmp_path / "gpu.png", "--operator", operator)
    hdrusd.run("tonemap", source, tmp_path / "cpu.png", "--operator", operator, "--reference")
    gpu, cpu = (read_image(tmp_path / f"{n}.png").pixels.astype(int) for n in ("gpu", "cpu"))
    # a value within a rounding of the dither's threshold may fall to either side
    assert np.abs(gpu - cpu).max() <= 1


def test_render_and_tonemap_give_one_picture(hdrusd: CommandLine, tmp_path: Path) -> None:
    """Two stages (decision 12): HDR frames, then the display; at once or one by one."""
    stage = write_stage(tmp_path / "a.usda", GROUND, panel("P", color=(0.2, 1, 0.1)), SKY)
    hdrusd.run("render", stage, tmp_path / "a.exr", "--png", tmp_path / "a.png", "-w", "64")
    hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "b.png")
    np.testing.assert_array_equal(
        read_image(tmp_path / "a.png").pixels, read_image(tmp_path / "b.png").pixels
    )


def test_sequences(hdrusd: CommandLine, tmp_path: Path) -> None:
    for number in (1, 2, 10):
        gradient(tmp_path / f"f.{number:04}.exr")
    gradient(tmp_path / "f.3.exr")  # another sequence's
    source, target = tmp_path / "f.####.exr", tmp_path / "p.###.png"
    said = hdrusd.run("tonemap", source, target)
    assert [Path(line).name for line in said.out.split()] == ["p.001.png", "p.002.png", "p.010.png"]
    (tmp_path / "p.002.png").unlink()
    said = hdrusd.run("tonemap", source, target, "--resume", "--json")
    document = json.loads(said.out)
    assert document["files"] == [str(tmp_path / "p.002.png")]
    assert (document["frames"], document["skipped"]) == (3, 2)
    said = hdrusd.run("tonemap", source, tmp_path / "q.####.png", "-f", "2,10")
    assert [Path(line).name for line in said.out.split()] == ["q.0002.png", "q.0010.png"]


def test_white_luminance_of_the_file_counts(hdrusd: CommandLine, tmp_path: Path) -> None:
    """18 cd/m2 written as 18, or as 0.18 with white at 100 cd/m2."""
    for name, value, white in (("a", 18.0, 1.0), ("b", 0.18, 100.0)):
        write_exr(tmp_path / f"{name}.exr", np.full((4, 4, 3), value), {"whiteLuminance": white})
        hdrusd.run("tonemap", tmp_path / f"{name}.exr", tmp_path / f"{name}.png", "-op", "exposure")
    np.testing.assert_array_equal(
        read_image(tmp_path / "a.png").pixels, read_image(tmp_path / "b.png").pixels
    )


def test_files_that_do_not_say_their_unit(hdrusd: CommandLine, tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.ones((4, 4, 3)), luminance=False)
    said = hdrusd.run(
        "tonemap", tmp_path / "a.exr", tmp_path / "a.png", "--json", "--strict", code=6
    )
    assert [finding["code"] for finding in json.loads(said.out)["findings"]] == ["exr-unit"]
    assert "1.0 is taken as 1 cd/m2" in said.err


def test_other_primaries_are_said(hdrusd: CommandLine, tmp_path: Path) -> None:
    rec2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
    write_exr(tmp_path / "a.exr", np.ones((4, 4, 3)), {"chromaticities": rec2020})
    said = hdrusd.run("tonemap", tmp_path / "a.exr", tmp_path / "a.png")
    assert "read as Rec. 709" in said.err


def test_frames_of_one_value_and_black_ones(hdrusd: CommandLine, tmp_path: Path) -> None:
    for name, value in (("black", 0.0), ("grey", 5.0), ("sun", 1.6e9)):
        write_exr(tmp_path / f"{name}.exr", np.full((4, 4, 3), value))
        for operator in ("reinhard02", "exposure", "falsecolour"):
            hdrusd.run("tonemap", tmp_path / f"{name}.exr", tmp_path / "a.png", "-op", operator)
    write_exr(tmp_path / "nan.exr", np.full((4, 4, 3), np.nan))
    hdrusd.run("tonemap", tmp_path / "nan.exr", tmp_path / "a.png")
    assert not read_image(tmp_path / "a.png").pixels.any()


@pytest.mark.parametrize(
    ("arguments", "code", "line"),
    [
        (["none.exr", "a.png"], 3, "none.exr: no such file"),
        (["-", "a.png"], 3, "-: no such file"),
        (["none.####.exr", "a.####.png"], 3, "no such frames"),
        (["in.exr", "a.jpg"], 2, "want a name that ends in .png"),
        (["in.exr", "in.exr"], 2, "want a name that ends in .png"),
        (["in.exr", "a.####.png"], 2, "a frame placeholder and no frames"),
        (["f.####.exr", "a.png"], 2, "a.png: no frame placeholder"),
        (["f.####.exr", "a.####.png", "-f", "1:3"], 3, "f.0002.exr: no such file"),
        (["f.####.exr", "a.####.png", "-f", ""], 2, "not a frame list"),
        (["in.exr", "a.####.png", "-f", "1"], 2, "in.exr: no frame placeholder"),
        (["text.exr", "a.png"], 3, "text.exr: not a readable EXR"),
        (["in.exr", "a.png", "--operator", "nope"], 2, "nope: unknown"),
        (["in.exr", "a.png", "--set", "key=0"], 2, "key: 0"),
        (["in.exr", "/proc/a.png"], 1, "/proc/a.png: cannot be written"),
        (["in.exr"], 2, "Missing argument 'OUTPUT'"),
    ],
)
def test_refusals(
    hdrusd: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    code: int,
    line: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    gradient(tmp_path / "in.exr")
    gradient(tmp_path / "f.0001.exr")
    (tmp_path / "text.exr").write_text("hello")
    said = hdrusd.run("tonemap", *arguments, code=code)
    wrong = [text for text in said.err.splitlines() if line in text]
    assert len(wrong) == 1, said.err
    assert not list(tmp_path.glob(".*"))


def test_reference_needs_no_device(tmp_path: Path) -> None:
    gradient(tmp_path / "a.exr")
    arguments = ("tonemap", tmp_path / "a.exr", tmp_path / "a.png", "--reference")
    said = process(*arguments, __EGL_VENDOR_LIBRARY_FILENAMES="/dev/null")
    assert said.code == 0, said.err
    assert (tmp_path / "a.png").is_file()
