"""A folder of databases becomes a folder of stages: ``hdrusd convert SOURCE... OUTPUT``."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
from command_line import HDRUSD, CommandLine, process
from pxr import Usd, UsdGeom
from report_schema import batch_problems

#: An OBJ whose one triangle has an area of 0.5 m2.
_TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n"


def _lamp(path: Path, name: str, candela: float) -> Path:
    """A glTF file that holds one point light and a camera to see by."""
    path.parent.mkdir(parents=True, exist_ok=True)
    light = {"type": "point", "name": name, "intensity": candela}
    node = {"name": name, "extensions": {"KHR_lights_punctual": {"light": 0}}}
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "extensions": {"KHR_lights_punctual": {"lights": [light]}},
    }
    path.write_text(json.dumps(document))
    return path


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """Two lamps, in folders of their own, and what cannot be read."""
    _lamp(tmp_path / "town/north/head.gltf", "Head", 1000.0)
    _lamp(tmp_path / "town/south/globe.gltf", "Globe", 250.0)
    (tmp_path / "town/south/broken.obj").write_text("f 1 2 3\n")
    return tmp_path / "town"


def test_each_file_becomes_the_stage_that_it_becomes_alone(town: Path, tmp_path: Path) -> None:
    done = process("convert", town, tmp_path / "out", "--jobs", 2)
    assert done.code == 3
    out = tmp_path / "out"
    assert sorted(path.relative_to(out).as_posix() for path in out.rglob("*")) == [
        "north",
        "north/head.geometry.usdc",
        "north/head.look.usda",
        "north/head.photometry.usda",
        "north/head.usda",
        "south",
        "south/globe.geometry.usdc",
        "south/globe.look.usda",
        "south/globe.photometry.usda",
        "south/globe.usda",
    ]
    assert [line.split(":")[0] for line in done.out.splitlines()] == [
        str(out / "north/head.usda"),
        str(out / "south/globe.usda"),
    ]
    refusals = [line for line in done.err.splitlines() if line.startswith(f"{town}")]
    assert [line.split(":")[0] for line in refusals] == [str(town / "south/broken.obj")]
    alone = process("convert", town / "north/head.gltf", tmp_path / "alone/head.usda", "--quiet")
    assert alone.code == 0
    for layer in ("head.usda", "head.photometry.usda", "head.look.usda"):
        assert (out / "north" / layer).read_bytes() == (tmp_path / "alone" / layer).read_bytes()


def test_the_report_sums_up(town: Path, tmp_path: Path, cli: CommandLine) -> None:
    report = tmp_path / "all.json"
    said = cli.run("convert", town, tmp_path / "out", "--report", report, "--json", code=3)
    document = json.loads(report.read_text())
    assert json.loads(said.out) == document
    assert batch_problems(document) == []
    assert document["totals"]["files"] == 3
    assert document["totals"]["converted"] == 2
    assert document["totals"]["lamps"] == 2
    # 1000 cd and 250 cd to all sides: 4 pi (1000 + 250) lm.
    assert document["totals"]["flux_lm"] == pytest.approx(15707.963, rel=1e-6)
    rows = {Path(row["source"]).name: row for row in document["files"]}
    assert rows["broken.obj"]["code"] == 3
    assert rows["broken.obj"]["output"] is None
    assert "broken.obj" in rows["broken.obj"]["error"]
    assert rows["head.gltf"]["report"]["lights"][0]["value"] == pytest.approx(1000.0, rel=1e-6)
    assert "2 of 3 files converted" in said.err


def test_a_shared_recipe_speaks_of_all_files_together(town: Path, tmp_path: Path) -> None:
    (town / "photometry.toml").write_text(
        '[[light]]\nmatch = "Head*"\ncandela = 40\n'
        '[[light]]\nmatch = "Globe*"\ncandela = 5\n'
        '[[light]]\nmatch = "Lantern*"\ncandela = 1\n'
    )
    report = tmp_path / "all.json"
    assert process("convert", town, tmp_path / "out", "--report", report).code == 3
    document = json.loads(report.read_text())
    values = [row["report"]["lights"][0]["value"] for row in document["files"] if not row["code"]]
    assert values == [40.0, 5.0]
    assert [entry["pattern"] for entry in document["unused_patterns"]] == ["Lantern*"]
    assert "sidecar-no-match" not in {entry["code"] for entry in document["findings_by_code"]}


def test_a_recipe_of_one_file_alone_is_as_strict_as_ever(town: Path, tmp_path: Path) -> None:
    (town / "north/photometry.toml").write_text('[[light]]\nmatch = "Lantern*"\ncandela = 1\n')
    report = tmp_path / "all.json"
    process("convert", town, tmp_path / "out", "--report", report)
    document = json.loads(report.read_text())
    codes = {entry["code"]: entry["files"] for entry in document["findings_by_code"]}
    assert codes["sidecar-no-match"] == 1
    assert document["unused_patterns"] == []


def test_what_is_mended_by_one_line_is_one_entry(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        (tmp_path / f"{name}.obj").write_text(_TRIANGLE)
    report = tmp_path / "all.json"
    sources = [tmp_path / f"{name}.obj" for name in ("a", "b", "c")]
    assert process("convert", *sources, tmp_path / "out", "--report", report).code == 0
    document = json.loads(report.read_text())
    dark = document["fix_first"][0]
    assert (dark["rank"], dark["files"]) == (1, 3)
    assert dark["for_example"] == [str(source) for source in sources]
    assert dark["impact"] == pytest.approx(3.0)  # of each file, so of their mean too


def test_recipes_of_one_name_are_told_apart(
    town: Path, tmp_path: Path, cli: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # a long path is broken over two lines
    (town / "south/broken.obj").unlink()
    for folder, lamp in (("north", "Head"), ("south", "Globe")):
        _lamp(town / folder / "second.gltf", lamp, 1.0)
        (town / folder / "photometry.toml").write_text(
            '[ambient]\npreset = "starlit-city"\n[[light]]\nmatch = "Lantern"\ncandela = 1\n'
            f'[[light]]\nmatch = "{lamp}"\ncandela = 5\nprovenance = "estimated"\n'
        )
    done = cli.run("convert", town.name, "out", "--report", "all.json")
    document = json.loads(Path("all.json").read_text())
    recipes = [f"{town.name}/{folder}/photometry.toml" for folder in ("north", "south")]
    places = [row["place"] for row in document["unused_patterns"]]
    assert places == [f"{recipe}:light[1]" for recipe in recipes]
    lamps = [row for row in document["fix_first"] if "5 cd" in row["what"]]
    assert sorted((row["where"], row["files"]) for row in lamps) == [(r, 2) for r in recipes]
    lines = [line.strip() for line in done.err.splitlines()]
    assert set(recipes) <= set(lines)  # below the entry that is mended there
    words = " ".join(lines)
    for recipe in recipes:
        assert f"{recipe}:light[1]: Lantern: nothing of that name in any of its files" in words


def test_of_equally_grave_entries_most_files_speak(tmp_path: Path) -> None:
    pictures = {"a": "rare.png", "b": "usual.png", "c": "usual.png"}
    for name, picture in pictures.items():
        (tmp_path / f"{name}.obj").write_text(f"mtllib {name}.mtl\n{_TRIANGLE}")
        (tmp_path / f"{name}.mtl").write_text(f"newmtl paint\nmap_Kd {picture}\n")
    report = tmp_path / "all.json"
    process("convert", tmp_path, tmp_path / "out", "--report", report)
    rows = json.loads(report.read_text())["fix_first"]
    missing = [(row["what"], row["files"]) for row in rows if "missing texture" in row["what"]]
    assert missing == [("1 missing texture: usual.png", 3)]


@pytest.mark.parametrize("alone", [True, False])
def test_an_option_for_some_files_wants_a_run_of_their_own(tmp_path: Path, alone: bool) -> None:
    (tmp_path / "car.obj").write_text(_TRIANGLE)  # no unit, and a car of 1.4 m
    if not alone:
        _lamp(tmp_path / "head.gltf", "Head", 1000.0)  # in metres, by its format
    report = tmp_path / "all.json"
    process("convert", tmp_path, tmp_path / "out", "--report", report)
    rows = json.loads(report.read_text())["fix_first"]
    (why,) = [row["why"] for row in rows if row["write"] == "--source-unit METERS"]
    assert ("[source] unit beside these is not" in why) is not alone


def test_a_second_run_over_its_own_output_finds_what_the_first_did(
    town: Path, cli: CommandLine
) -> None:
    (town / "south/broken.obj").unlink()
    # A stage that photometry has nothing to say of; all it gets is two layers.
    (town / "bare.usda").write_text(
        '#usda 1.0\n(\n defaultPrim = "a"\n metersPerUnit = 1\n upAxis = "Y"\n)\n'
        'def Mesh "a" {\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n'
        " point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\n"
    )
    cli.run("convert", town, town / "old", code=0)
    first = cli.run("convert", town, town / "new", code=0)
    second = cli.run("convert", town, town / "new", code=0)
    assert second.out == first.out
    assert len(first.out.splitlines()) == 3
    assert "passed over, stages and layers that hdrusd wrote: 10 (" in second.err
    assert "passed over" not in cli.run("convert", town, town / "new", "--quiet", code=0).err
    # Into the folder itself too: what stands beside a source is none.
    (town / "bare.usda").unlink()
    first = cli.run("convert", town, town, code=0)
    assert cli.run("convert", town, town, code=0).out == first.out


def test_what_is_wrong_for_all_files_is_said_once(
    town: Path, tmp_path: Path, cli: CommandLine
) -> None:
    out = tmp_path / "out"
    missing = tmp_path / "no.toml"
    line = cli.refused("convert", town, out, "--photometry", missing, code=3)
    assert line.strip().endswith("no.toml: no such file")
    line = cli.refused("convert", town, out, "--estimate", "moonshine", code=2)
    assert "moonshine: unknown" in line
    assert (
        cli.refused("convert", tmp_path / "twon", out, code=3)
        .strip()
        .endswith("twon: no such file or folder")
    )
    (tmp_path / "file").touch()
    line = cli.refused("convert", town, tmp_path / "file/out", code=1)
    assert f"nothing can be written in {tmp_path}/file (" in line
    assert not out.exists()


def test_a_name_of_two_lines_is_told_in_one(tmp_path: Path, cli: CommandLine) -> None:
    (tmp_path / "two\nlines.obj").write_text("f 1 2 3\n")
    said = cli.run("convert", tmp_path, tmp_path / "out", code=3)
    assert f"{tmp_path}/two lines.obj:" in said.err


def test_a_file_that_kills_its_process_is_one_line(tmp_path: Path) -> None:
    for name in ("before", "deadly", "later", "last"):
        (tmp_path / f"{name}.obj").write_text(_TRIANGLE)
    plugin = tmp_path / "python"
    plugin.mkdir()
    (plugin / "sitecustomize.py").write_text(
        "import os, hdrusd.importers.importer as importer\n"
        "read = importer.read\n"
        "def deadly(resolver, report):\n"
        "    if resolver.source.name == 'deadly.obj':\n"
        "        os.abort()\n"
        "    return read(resolver, report)\n"
        "importer.read = deadly\n"
    )
    done = process("convert", tmp_path, tmp_path / "out", "--jobs", 1, PYTHONPATH=str(plugin))
    assert done.code == 3
    assert f"{tmp_path}/deadly.obj: the process that read it was ended by SIGABRT" in done.err
    stages = sorted(path.name for path in (tmp_path / "out").glob("*.usda") if "." not in path.stem)
    assert stages == ["before.usda", "last.usda", "later.usda"]


@pytest.mark.parametrize("whole_group", [True, False])
def test_an_interrupt_leaves_whole_stages_only(tmp_path: Path, whole_group: bool) -> None:
    for number in range(400):
        (tmp_path / f"{number:03}.obj").write_text(_TRIANGLE)
    out, report = tmp_path / "out", tmp_path / "all.json"
    job = subprocess.Popen(
        [*HDRUSD, "convert", str(tmp_path), str(out), "--jobs", "2", "--report", str(report)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # Who starts the tests in the background hands down an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 120.0
    while not (out / "001.usda").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    (os.killpg if whole_group else os.kill)(job.pid, signal.SIGINT)
    _, err = job.communicate(timeout=60)
    assert job.returncode == 130, err
    assert err.strip() == "interrupted"
    assert not list(out.glob(".*"))
    stages = {path.stem for path in out.glob("*.usda") if "." not in path.stem}
    told = [Path(row["source"]).stem for row in json.loads(report.read_text())["files"]]
    assert told == [f"{number:03}" for number in range(len(told))]  # what was done, in order
    assert set(told) <= stages
    assert "001" in stages
    assert "399" not in stages
    for stem in stages:
        assert (out / f"{stem}.photometry.usda").exists()
        assert (out / f"{stem}.geometry.usdc").exists()


def test_parts_of_others_are_counted_once(tmp_path: Path) -> None:
    """A lamp of 1000 cd, in a file of its own, that a street refers to twice."""
    folder = tmp_path / "library"
    folder.mkdir()
    head = '#usda 1.0\n(\n defaultPrim = "a"\n metersPerUnit = 1\n upAxis = "Y"\n)\n'
    # pi r^2 nits of a sphere of radius 1 m are its candela.
    (folder / "lamp.usda").write_text(
        f'{head}def SphereLight "a" {{\n float inputs:radius = 1\n'
        f" float inputs:intensity = {1000.0 / 3.141592653589793}\n}}\n"
    )
    (folder / "street.usda").write_text(
        f'{head}def Xform "a" {{\n'
        + "".join(f' def "l{i}" (references = @./lamp.usda@) {{}}\n' for i in range(2))
        + "}\n"
    )
    report = tmp_path / "all.json"
    assert process("convert", folder, tmp_path / "out", "--report", report).code == 0
    document = json.loads(report.read_text())
    assert batch_problems(document) == []
    assert {Path(row["source"]).name: row["part"] for row in document["files"]} == {
        "lamp.usda": True,
        "street.usda": False,
    }
    assert (document["totals"]["converted"], document["totals"]["parts"]) == (2, 1)
    assert document["totals"]["lamps"] == 2
    assert (tmp_path / "out/lamp.usda").exists()


def test_a_folders_recipe_says_its_unit(tmp_path: Path) -> None:
    """An OBJ in inches whose Z is up beside one that needs nothing: 1 x 25.4 mm = 0.0254 m."""
    for name in ("inches", "metres"):
        (tmp_path / "db" / name).mkdir(parents=True)
        (tmp_path / "db" / name / "a.obj").write_text(_TRIANGLE)
    recipe = tmp_path / "db/inches/photometry.toml"
    recipe.write_text('[source]\nunit = 0.0254\nup = "Z"\n')
    out = tmp_path / "out"
    assert process("convert", tmp_path / "db", out).code == 0
    stages = {name: Usd.Stage.Open(str(out / name / "a.usda")) for name in ("inches", "metres")}
    lengths, ups = {}, {}
    for name, stage in stages.items():
        (mesh,) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
        matrix = UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        lengths[name] = matrix.TransformDir((1, 0, 0)).GetLength()
        ups[name] = UsdGeom.GetStageUpAxis(stage)
    assert lengths == {"inches": pytest.approx(0.0254, rel=1e-6), "metres": 1.0}
    assert ups == {"inches": "Z", "metres": "Y"}


def test_what_is_wrong_in_a_recipe_is_said_in_words_and_once(town: Path, tmp_path: Path) -> None:
    (town / "photometry.toml").write_text(
        '[source]\nup = "Q"\n[[light]]\nmatch = "*"\ncandela = -1\n'
    )
    done = process("convert", town, tmp_path / "out")
    for place in ("photometry.toml:source: up: ", "photometry.toml:light[1]: candela: "):
        assert done.err.count(place) == 1, done.err


def test_wrong_use(town: Path, tmp_path: Path, cli: CommandLine) -> None:
    one = town / "north/head.gltf"
    line = cli.refused("convert", town, tmp_path / "out.usda", code=2)
    assert "want a folder" in line
    assert "want several sources" in cli.refused(
        "convert", one, tmp_path / "out.usda", "--jobs", 2, code=2
    )
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "no database in it" in cli.refused("convert", empty, tmp_path / "out", code=3)
    assert not (tmp_path / "out").exists()


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """The command line in this process; its workers are processes of their own all the same."""
    return CommandLine(monkeypatch, capsys, None)
