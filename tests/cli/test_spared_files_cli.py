"""What a slip of the hand, a full disk or an odd name may cost: one line, and no file."""

from __future__ import annotations

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from builders import obj, png
from command_line import CommandLine, process

LUMINAIRE = Path(__file__).parents[1] / "truth_stages" / "luminaire.ies"
KD = "Kd 0.5 0.5 0.5"


@pytest.fixture
def hdrusd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(monkeypatch, capsys, None)


def test_a_report_never_replaces_what_is_no_report(hdrusd: CommandLine, tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", KD)
    text, stage = source.read_text(), tmp_path / "wall.usda"
    line = hdrusd.refused("convert", source, stage, "-q", "--report", source, code=1)
    assert line == f"{source}: not an earlier report; want another name for --report"
    assert source.read_text() == text
    assert not stage.exists()


def test_a_report_never_replaces_the_stage_just_made(hdrusd: CommandLine, tmp_path: Path) -> None:
    source, stage = obj(tmp_path / "wall.obj", KD), tmp_path / "wall.usda"
    said = hdrusd.run("convert", source, stage, "-q", "--report", stage, code=1)
    assert said.err.endswith("not an earlier report; want another name for --report\n")
    assert stage.read_text().startswith("#usda 1.0")


def test_a_report_replaces_an_earlier_one_and_an_empty_file(
    hdrusd: CommandLine, tmp_path: Path
) -> None:
    source, report = obj(tmp_path / "wall.obj", KD), tmp_path / "r.json"
    report.touch()
    for _ in range(2):
        hdrusd.run("convert", source, tmp_path / "wall.usda", "-q", "--report", report)
        assert report.read_text().startswith('{\n "format": "hdrusd-report/')


def test_a_recipe_never_replaces_its_database(hdrusd: CommandLine, tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", KD)
    text = source.read_text()
    line = hdrusd.refused("recipe", "init", source, source, "--overwrite", code=2)
    assert line == f"Error: {source}: the database itself; want another OUTPUT"
    assert source.read_text() == text


@pytest.mark.parametrize("option", ["--gamma", "--source-unit", "--meters-per-unit"])
def test_nan_is_no_number(hdrusd: CommandLine, tmp_path: Path, option: str) -> None:
    source = obj(tmp_path / "wall.obj", KD)
    line = hdrusd.refused("convert", source, tmp_path / "wall.usda", option, "nan", code=2)
    assert line.endswith("nan is no number.")


@pytest.mark.parametrize("folder", ["new\nline", "\udcff"])
def test_an_output_that_usd_cannot_name_is_refused(
    hdrusd: CommandLine, tmp_path: Path, folder: str
) -> None:
    source = obj(tmp_path / "wall.obj", KD)
    line = hdrusd.refused("convert", source, tmp_path / folder / "wall.usda", "-q", code=3)
    assert line.startswith("wall.usda: the path has a '")
    assert not (tmp_path / folder).exists()


def test_a_database_whose_name_is_no_text_is_refused(hdrusd: CommandLine, tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", KD).rename(tmp_path / "\udcff.obj")
    line = hdrusd.refused("convert", source, tmp_path / "wall.usda", "-q", code=3)
    assert line == ".obj: the path has a '\\udcff' in it; want one of printable characters"


def test_a_line_break_in_the_folder_of_a_database_is_no_matter(
    hdrusd: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "new\nline").mkdir()
    source = obj(tmp_path / "new\nline" / "wall.obj", KD)
    hdrusd.run("convert", source, tmp_path / "wall.usda", "-q")


def test_a_stage_that_usd_cannot_name_is_refused(hdrusd: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "new\nline").mkdir()
    source = tmp_path / "new\nline" / "wall.usda"
    source.write_text('#usda 1.0\ndef Sphere "Ball" {}\n')
    line = hdrusd.refused("convert", source, tmp_path / "out.usda", "-q", code=3)
    assert line == "wall.usda: the path has a '\\n' in it; want one of printable characters"


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """Programs that are started here can write files of so many bytes, as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # so writing says EFBIG
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)


@pytest.mark.parametrize("mtl", [KD, f"{KD}\nmap_Kd wall.png"])  # a layer; a texture
def test_a_full_disk_is_one_line_about_the_output(tmp_path: Path, mtl: str) -> None:
    png(tmp_path / "wall.png")
    source, stage = obj(tmp_path / "wall.obj", mtl), tmp_path / "out" / "wall.usda"
    with files_of_at_most(200):
        said = process("convert", str(source), str(stage), "-q")
    assert said.code == 1
    assert said.err.startswith(f"{stage}: cannot be written (")
    assert len(said.err.splitlines()) == 1
    assert ".hdrusd-" not in said.err
    assert not stage.parent.exists()


def test_nor_a_recipe_or_a_report_of_a_full_disk(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", KD)
    with files_of_at_most(20):
        said = process("recipe", "init", str(source), str(tmp_path / "a.toml"), "-q")
        told = process("photometry", str(LUMINAIRE), "--report", str(tmp_path / "a.json"))
    assert said == (1, "", f"{tmp_path / 'a.toml'}: cannot be written (File too large)\n")
    assert (told.code, told.err) == (
        1,
        f"{tmp_path / 'a.json'}: cannot be written (File too large)\n",
    )
    assert {path.name for path in tmp_path.iterdir()} == {"wall.obj", "wall.mtl"}


def test_a_file_in_place_of_a_folder_is_named(hdrusd: CommandLine, tmp_path: Path) -> None:
    source, file = obj(tmp_path / "wall.obj", KD), tmp_path / "file"
    file.touch()
    line = hdrusd.refused("convert", source, file / "sub" / "wall.usda", "-q", code=1)
    assert line == f"{file}: not a folder; want one to write in"


@pytest.mark.parametrize(
    ("before", "name"), [(["convert", "-q"], "wall.usda"), (["recipe", "init", "-q"], "a.toml")]
)
def test_a_folder_without_permission_is_told_by_the_output(
    tmp_path: Path, before: list[str], name: str
) -> None:
    source = obj(tmp_path / "wall.obj", KD)
    (tmp_path / "closed").mkdir(mode=0o500)
    output = tmp_path / "closed" / name
    said = process(*before, source, output, permitted=False)
    assert said == (1, "", f"{output}: cannot be written (Permission denied)\n")
