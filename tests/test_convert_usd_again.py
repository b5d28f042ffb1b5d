"""Convert a stage that is photometric: nothing changes; and what is no source is refused."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import png
from converted import opened, run, sidecar
from overlaid import composed, lamp, paint, record, stage_file
from pxr import Sdf, Usd

import hdrusd
from hdrusd.conversion import Result
from hdrusd.errors import InputError
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report

LAMP = lamp("SphereLight", "float inputs:intensity = 100\nfloat inputs:radius = 0.1")
WALL = paint("/World/paint", "asset inputs:file = @wall.png@")
STREET = Path(__file__).parents[1] / "samples" / "street" / "make_street.py"


def frame(gl: Any, stage: Path) -> Any:
    return next(iter(render_sequence(gl, Job(stage, width=160, height=90), Report()))).hdr


def says_nothing_new(first: Path, second: Result) -> None:
    """The second stage says what the first says, by references to it."""
    assert composed(opened(second)) == composed(Usd.Stage.Open(str(first)))
    layer = Sdf.Layer.FindOrOpen(str(second.output.with_suffix(".photometry.usda")))
    assert not layer.rootPrims
    assert not second.textures
    assert "usd-photometric" in second.report.codes()


@pytest.mark.parametrize("name", ["street.gltf", "street.osgt"])
def test_the_sample_street_converted_twice(gl: Any, tmp_path: Path, name: str) -> None:
    subprocess.run([sys.executable, str(STREET), str(tmp_path / "source")], check=True)
    source = tmp_path / "source" / name
    first = run(source, tmp_path / "once" / "street.usda")
    toml = source.parent / "photometry.toml"
    second = run(first.output, tmp_path / "twice" / "night.usda", photometry=toml)
    says_nothing_new(first.output, second)
    assert len(second.lights) == len(first.lights)
    assert np.array_equal(frame(gl, first.output), frame(gl, second.output))


@pytest.mark.parametrize("name", ["night_street.osgt", "suv.osgt", "lamp_post.osg"])
def test_real_osg_converted_twice(gl: Any, tmp_path: Path, testdata: Path, name: str) -> None:
    first = run(testdata / "data" / "derived-osg" / name, tmp_path / "once" / "a.usda")
    second = run(first.output, tmp_path / "twice" / "b.usda")
    says_nothing_new(first.output, second)
    assert np.array_equal(frame(gl, first.output), frame(gl, second.output))


def test_a_converted_stage_converted_again(gl: Any, tmp_path: Path) -> None:
    png(tmp_path / "wall.png")
    source = stage_file(tmp_path / "town.usda", LAMP, WALL)
    sidecar(tmp_path, "[ambient]\nilluminance = 0.05\n")
    first = run(source, tmp_path / "once" / "a.usda", photometry=tmp_path / "photometry.toml")
    second = run(
        first.output,
        tmp_path / "twice" / "b.usda",
        photometry=tmp_path / "photometry.toml",
        roots=[tmp_path],
    )
    says_nothing_new(first.output, second)


def test_what_was_added_to_a_converted_stage_is_converted(tmp_path: Path) -> None:
    source = stage_file(tmp_path / "town.usda", LAMP)
    run(source, tmp_path / "night.usda")
    new = lamp("SphereLight", "float inputs:intensity = 1\nfloat inputs:radius = 1", "New")
    head = '#usda 1.0\n(\n    subLayers = [@./night.usda@]\n    defaultPrim = "World"\n)\n'
    grown = stage_file(tmp_path / "grown.usda", new, head=head)
    second = run(grown, tmp_path / "grown_night.usda")
    layer = Sdf.Layer.FindOrOpen(str(second.output.with_suffix(".photometry.usda")))
    assert list(layer.GetPrimAtPath("/World").nameChildren.keys()) == ["New"]
    assert {row["name"] for row in second.lights} == {"Lamp", "New"}
    # Each step has a record of its own.
    world = opened(second).GetDefaultPrim()
    made = [record(world.GetStage(), name)["inputs"][1] for name in ("hdrusd", "hdrusd_2")]
    assert made == ["town.usda", "grown.usda"]


def test_a_blocked_sample_is_no_strength(tmp_path: Path) -> None:
    """What is in the samples of a photometric light may be nothing (a value block)."""
    moving = "float inputs:intensity.timeSamples = { 1: 3, 5: 1, 9: 2 }"
    source = stage_file(
        tmp_path / "town.usda", lamp("SphereLight", f"{moving}\nfloat inputs:radius = 1")
    )
    first = run(source, tmp_path / "night.usda")
    layer = Sdf.Layer.FindOrOpen(str(first.output.with_suffix(".photometry.usda")))
    at = Sdf.Path("/World/Lamp.inputs:photometric:luminousIntensity")
    layer.SetTimeSample(at, 5.0, Sdf.ValueBlock())
    layer.Save()
    second = run(first.output, tmp_path / "later.usda")
    # The stage holds float32.
    assert second.lights[0]["value"] == pytest.approx(first.lights[0]["value"], rel=2**-23)


# -- who made it ---------------------------------------------------------------------------


def test_a_stage_says_who_made_it_of_what(tmp_path: Path) -> None:
    """UsdMedia AuthorshipAPI, for every format, and no date: the same input, the same bytes."""
    sidecar(tmp_path, "gamma = 2.2\n")
    over = run(stage_file(tmp_path / "town.usda", LAMP), tmp_path / "night.usda")
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    made = run(tmp_path / "tri.obj", tmp_path / "tri.usda")
    for result, name in ((over, "town.usda"), (made, "tri.obj")):
        assert record(opened(result)) == {
            "package": "hdrusd",
            "version": hdrusd.__version__,
            "inputs": ["source", name, "photometry", "photometry.toml"],
        }


# -- what is refused -----------------------------------------------------------------------


def test_a_stage_does_not_replace_its_source(tmp_path: Path) -> None:
    source = stage_file(tmp_path / "town.usda", LAMP)
    before = source.read_bytes()
    with pytest.raises(InputError, match=r"would replace .*town\.usda; want another name"):
        run(source, source)
    first = run(source, tmp_path / "night.usda")
    with pytest.raises(InputError, match="would replace"):
        run(first.output, first.output)
    layer = first.output.with_suffix(".photometry.usda")
    text = layer.read_bytes()
    with pytest.raises(InputError, match=r"would replace .*night\.photometry\.usda"):
        run(layer, tmp_path / "night.usda")
    assert (source.read_bytes(), layer.read_bytes()) == (before, text)


@pytest.mark.skipif(os.name == "nt", reason="links")
def test_nor_by_another_name(tmp_path: Path) -> None:
    source = stage_file(tmp_path / "town.usda", LAMP)
    (tmp_path / "link.usda").symlink_to(source)
    with pytest.raises(InputError, match="would replace"):
        run(tmp_path / "link.usda", source)


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("a.usda", b"", "not a USD layer"),
        ("a.usdc", b"", "not a USD layer"),
        ("a.usdz", b"PK\3\4", "not a USD layer"),
        ("a.usd", b"not usd at all", "not a USD layer"),
        ("a.usda", b"#usda 1.0\ndef Xform {", "not a USD layer"),
        ("a.usda", b"#usda 1.0\n", "nothing in it that a stage could show"),
    ],
)
def test_what_is_no_stage_is_told_in_one_line(
    tmp_path: Path, name: str, content: bytes, text: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=text) as raised:
        run(tmp_path / name, tmp_path / "out" / "night.usda")
    assert "\n" not in str(raised.value)
    assert not (tmp_path / "out").exists()


def test_an_overlay_of_a_source_elsewhere_names_the_root_that_it_wants(tmp_path: Path) -> None:
    source = stage_file(tmp_path / "town" / "town.usda", LAMP)
    first = run(source, tmp_path / "night" / "night.usda")
    says_nothing_new(first.output, run(first.output, tmp_path / "b.usda", roots=(source.parent,)))
    with pytest.raises(InputError) as raised:
        run(first.output, tmp_path / "again.usda")
    wanted = f"outside the declared roots; not converted; --root {source.parent} would allow it"
    assert str(raised.value) == f"night.usda: {source}: {wanted}"


@pytest.mark.parametrize("name", ["empty.usda", "empty.usdc", "ref_cycle_a.usda"])
def test_hostile_files(tmp_path: Path, testdata: Path, name: str) -> None:
    with pytest.raises(InputError, match=name):
        run(testdata / "data" / "hostile" / name, tmp_path / "night.usda")
    assert not list(tmp_path.iterdir())


def test_a_circle_of_references_is_told_and_the_rest_converted(tmp_path: Path) -> None:
    for one, other in ("ab", "ba"):
        text = '#usda 1.0\n(\n    defaultPrim = "World"\n)\ndef Xform "World" (\n'
        text += f"    references = @./{other}.usda@\n)\n{{\n{LAMP}\n}}\n"
        (tmp_path / f"{one}.usda").write_text(text)
    result = run(tmp_path / "a.usda", tmp_path / "night.usda")
    assert [row["name"] for row in result.lights] == ["Lamp"]
    assert "usd-warning" in result.report.codes()


def test_instances_beyond_counting_are_refused_at_once(tmp_path: Path) -> None:
    """8 instances each of 8 instances, 16 deep: 8^16 lamps in 17 small files."""
    stage_file(tmp_path / "0.usda", LAMP)
    for level in range(1, 17):
        below = f"(\n    instanceable = true\n    references = @./{level - 1}.usda@\n)\n{{\n}}"
        stage_file(tmp_path / f"{level}.usda", *(f'def "I_{i}" {below}' for i in range(8)))
    with pytest.raises(InputError, match=r"\d+ prims with all instances; want at most 1000000"):
        run(tmp_path / "16.usda", tmp_path / "night.usda")


def test_instances_too_deep_in_one_another_are_refused(tmp_path: Path) -> None:
    def chain(count: int) -> Path:
        made = [f'class Xform "C0"\n{{\n{LAMP}\n}}']
        for level in range(1, count + 1):
            below = f"(\n    instanceable = true\n    references = </World/C{level - 1}>\n)\n{{\n}}"
            kind = "def" if level == count else "class"
            made.append(f'{kind} Xform "C{level}"\n{{\ndef "I" {below}\n}}')
        return stage_file(tmp_path / f"{count}.usda", *made)

    result = run(chain(64), tmp_path / "night.usda")
    assert [row["name"] for row in result.lights] == ["Lamp"]
    with pytest.raises(InputError, match="2000 instances in one another; want at most 64"):
        run(chain(2000), tmp_path / "deep.usda")


# -- real stages ---------------------------------------------------------------------------

#: Of their files by ``grep``: lights, materials.
REAL = {
    "data/usd-wg/full_assets/McUsd/McUsd.usda": (2, 23),
    "data/derived-usd/sedan.usdz": (0, 13),
    "data/usd-wg/test_assets/TextureTransformTest/TextureTransformTest.usd": (0, 9),
    "truth/stages/headlights_anim.usda": (2, 1),
    "truth/stages/ies_road.usda": (2, 1),
    "truth/stages/area_rect.usda": (1, 1),
    "truth/stages/dome_two_tone.usda": (1, 1),
}


@pytest.mark.parametrize("name", REAL)
def test_real_stages_look_as_they_did(gl: Any, tmp_path: Path, testdata: Path, name: str) -> None:
    """By the letter, with R = T^2.2: what the renderer makes of the source itself."""
    source = testdata / name
    result = run(source, tmp_path / "night.usda")
    assert (result.counts["lights"], result.counts["materials"]) == REAL[name]
    before, after = frame(gl, source), frame(gl, result.output)
    # Candela go through nits and back: 2 roundings of float32 more on each side.
    assert after == pytest.approx(before, rel=2.0**-22, abs=0.0)
