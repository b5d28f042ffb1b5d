"""The corpus run, on files made here and, where they are, on hostile and real ones."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
import pytest

from hdrusd.importers.assimp_library import find_library
from tests import corpus, gallery
from tests.corpus import CONVERTED, Row, corpus_files, markdown, run_corpus, totals

#: Small real files: each format, texture folders beside the meshes, lights, cameras, packages.
REAL = (
    "assimp/Collada/cube_with_2UVs.DAE",
    "castle-demo/gltf/punctual_lights/test_lights.glb",
    "delta3d/examples/data/StaticMeshes/lamps/Lamppost_Trident_PHYSICS.osg",
    "derived-osg/night_street.osgt",
    "derived-usd/sedan.usdz",
    "synthetic/night_street.flt",
    "gazebo/stop_light/meshes/stop_light.obj",
    "gltf-blender-io/22_vertex_color/22_vertex_color.gltf",
    "godot-demos/truck_town/town/lamp/scene.gltf",
    "kenney/models/road-straight.glb",
    "openmaterial/lights/pointLight.gltf",
    "osgearth/data/red_flag.osg",
    "synthetic/night_street.3ds",
    "tinyobjloader/tr-and-d-issue-43.obj",
    "usd-wg/test_assets/TextureTransformTest/TextureTransformTest.usd",
)

#: Those that are read by what may not be installed.
BY_OTHERS = (
    ("assimp/AC/SphereWithLight.ac", find_library() is not None),
    ("derived-osg/night_street.ive", shutil.which("osgconv") is not None),
    ("gltf-transform/extensions/test/in/BoxMeshopt.glb", find_spec("meshopt") is not None),
    ("osgearth/data/streetlight.osgb", shutil.which("osgconv") is not None),
    ("ufbx/maya_material_chart_7700_binary.fbx", find_spec("ufbx") is not None),
)

#: What of the hostile files has nothing in it that can be trusted, or nothing left that can be
#: shown, and must be refused as input; and words of the line that says why.
BROKEN = {
    "bad_indices.obj": "nothing in it",
    "billion_laughs.dae": "entity 'a'",
    "bomb.zae": "big.dae: unpacks to more than 200 times its size",
    "dag_two_parents.gltf": "node 3 is a child of nodes 1 and 2",
    "deep_chain.gltf": "deeper than 256",
    "deep_push.flt": "deeper than 256",
    "empty.3ds": "0 bytes",
    "empty.dae": "empty",
    "empty.fbx": "Empty",
    "empty.glb": "empty",
    "empty.ive": "empty",
    "empty.obj": "no vertex",
    "empty.osgt": "empty",
    "empty.usda": "not a USD layer",
    "empty.usdc": "not a USD layer",
    "extref_cycle_a.flt": "nothing in it",
    "extref_cycle_b.flt": "nothing in it",
    "huge_count.gltf": "4000000000 elements",
    "huge_glb_chunk.glb": "cut short",
    "lfs_pointer.osgb": "Git LFS pointer",
    "nan_inf.obj": "nothing in it",
    "nan_lights.gltf": "nothing in it",
    "node_cycle.dae": "node 'a' contains itself",
    "node_cycle.gltf": "a cycle",
    "png_named.obj": "binary data",
    "ref_cycle_a.usda": "nothing",
    "ref_cycle_b.usda": "nothing",
    "trunc_max.fbx": "Truncated",
    "trunc_palm.flt": "record 70 of length 64",
    "trunc_streetlight.osgb": "",
    "uri_file.gltf": "/buffers/1: buffer file:///etc/passwd",
    "zero_record.flt": "record 2 of length 0",
}

#: What of them is whole but for a part, textures or names, and must still be shown; the code of
#: the finding that tells what is wrong ("": nothing is, but for names).
USABLE = {
    "dev_zero.obj": "file-refused",
    "huge_fields.osgt": "osg-draw-count",
    "huge_png.obj": "image-broken",
    "long_line.obj": "vertex-numbers",
    "missing_tex.obj": "file-missing",
    "names.obj": "",
    "traversal_tex.obj": "file-refused",
    "trunc_box.3ds": "3ds-chunk-length",
    "uri_traversal.gltf": "file-refused",
}

#: What of the hostile files another one names.
PARTS = {".md", ".mtl", ".png", ".rgb", ".tga"}

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"

STAGE = (
    '#usda 1.0\n(\n defaultPrim = "Thing"\n metersPerUnit = 1\n upAxis = "Y"\n)\n'
    'def {kind} "Thing" {{}}\n'
)


def run(folder: Path, files: Sequence[Path], output: Path) -> dict[str, Row]:
    """Rows by name; two at a time."""
    return {row.name: row for row in run_corpus(folder, files, output, workers=2)}


def problems(rows: dict[str, Row]) -> dict[str, str]:
    """The files that did not pass, and why."""
    return {name: row.problem for name, row in rows.items() if row.problem}


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """An empty folder of databases."""
    folder = tmp_path / "data"
    folder.mkdir()
    return folder


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """A folder for results."""
    folder = tmp_path / "results"
    folder.mkdir()
    return folder


@pytest.mark.usefixtures("gl")
def test_pictures_and_refusals_pass(source: Path, output: Path) -> None:
    (source / "square.obj").write_text(SQUARE)
    (source / "black.obj").write_text("mtllib black.mtl\n" + SQUARE.replace("f", "usemtl k\nf"))
    (source / "black.mtl").write_text("newmtl k\nKd 0 0 0\n")
    (source / "empty.osgt").write_text("")
    (source / "sphere.usda").write_text(STAGE.format(kind="Sphere"))
    (source / "nothing.usda").write_text(STAGE.format(kind="Scope"))
    (source / "notes.txt").write_text("no database")
    rows = run(source, corpus_files(source), output)
    assert problems(rows) == {}
    stages = [f"{name}.usda{way}" for name in ("nothing", "sphere") for way in ("", CONVERTED)]
    assert list(rows) == ["black.obj", "empty.osgt", *stages, "square.obj"]
    assert rows["square.obj"].counts["triangles"] == 2
    assert rows["square.obj"].lit > 0.0
    assert rows["sphere.usda"].lit == rows[f"sphere.usda{CONVERTED}"].lit > 0.0
    assert rows["black.obj"].dark
    assert {name: row.code for name, row in rows.items() if row.code} == {
        "empty.osgt": 3,
        "nothing.usda": 3,
        f"nothing.usda{CONVERTED}": 3,
    }
    assert totals(list(rows.values())) == "7 runs: 4 pictures, 3 refused, 0 wrong."
    table = markdown(list(rows.values()))
    assert str(source) not in table
    assert len(table.splitlines()) == 2 + 7 + 2


@pytest.mark.usefixtures("gl")
def test_gallery_has_a_tile_of_each_picture(source: Path, output: Path, tmp_path: Path) -> None:
    (source / "a.usda").write_text(STAGE.format(kind="Sphere"))
    (source / "b.usda").write_text(STAGE.format(kind="Scope"))
    (source / "hostile").mkdir()
    (source / "hostile" / "c.usda").write_text(STAGE.format(kind="Cube"))
    rows = list(run(source, corpus_files(source), output).values())
    for public, names in ((False, ["a.usda", "hostile/c.usda"]), (True, ["a.usda"])):
        folder = tmp_path / f"gallery-{public}"
        corpus.write_gallery(rows, output, folder, public=public)
        text = (folder / "gallery.md").read_text(encoding="utf-8")
        assert [name for name in ("a.usda", "b.usda", "hostile/c.usda") if name in text] == names
        assert "| a.usda | default-sky 1 |" in text
        sheet = oiio.ImageBuf(str(folder / "gallery-1.jpg")).spec()
        assert sheet.height == gallery.HEIGHT + gallery.LABEL
        assert sheet.width == gallery.COLUMNS * gallery.WIDTH


@pytest.mark.parametrize(
    ("program", "problem"),
    [
        ("import sys; sys.exit('no')", ""),
        ("import sys; print('a', file=sys.stderr); sys.exit('b')", "2 lines"),
        ("import sys; sys.exit(1)", "0 lines"),
        ("import sys; sys.exit(99)", "not documented"),
        ("1 / 0", "traceback: ZeroDivisionError"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"),
        ("import time; time.sleep(60)", "still running"),
        ("import sys; open('core', 'w'); sys.exit('no')", "left behind: cwd/core"),
        ("import sys, tempfile; tempfile.mkstemp('x', 'x'); sys.exit('no')", "left behind: tmp/x"),
        ("import sys; open('../out/half.usda', 'w'); sys.exit('no')", "left behind: out/half"),
        ("import sys; open('../../../data/x', 'w'); sys.exit('no')", "source folder"),
        ("import sys; open('../beside', 'w'); sys.exit('no')", "left behind: beside"),
        ("bytearray(3 << 30)", "traceback: MemoryError"),
    ],
)
def test_what_a_command_does_wrong_is_told(
    source: Path, output: Path, monkeypatch: pytest.MonkeyPatch, program: str, problem: str
) -> None:
    head, _, _ = corpus._PROGRAM.partition("from hdrusd")
    monkeypatch.setattr(corpus, "_PROGRAM", head + program)
    monkeypatch.setattr(corpus, "SECONDS", 2.0)
    (source / "square.obj").write_text(SQUARE)
    (row,) = run(source, corpus_files(source), output).values()
    assert problem in row.problem
    assert bool(problem) == bool(row.problem)


def test_a_frame_without_light_is_wrong(
    source: Path, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer: dict[str, Any] = {
        "counts": {"triangles": 1},
        "materials": [{"diffuse": [1, 1, 1], "reflectance_map": None, "luminance_cd_m2": 0}],
        "textures": {},
        "lights": [],
        "findings": [],
    }
    program = f"""
import sys, numpy as np
from pathlib import Path
from hdrusd.images import write_exr, write_png
if sys.argv[1] == "render":
    write_exr(Path(sys.argv[3]), np.zeros(({corpus.HEIGHT}, {corpus.WIDTH}, 3)))
    write_png(Path(sys.argv[5]), np.zeros(({corpus.HEIGHT}, {corpus.WIDTH}, 3), np.uint8))
print({json.dumps(json.dumps(answer))})
"""
    monkeypatch.setattr(corpus, "_PROGRAM", program.replace("{", "{{").replace("}", "}}"))
    (source / "square.obj").write_text(SQUARE)
    (row,) = run(source, corpus_files(source), output).values()
    assert row.problem == "the picture is black"


@pytest.mark.usefixtures("gl")
def test_hostile_files(testdata: Path, output: Path) -> None:
    """Each ends as its kind must, a stage both ways, under the limits of the corpus run."""
    folder = testdata / "data"
    everything = {path.name for path in (folder / "hostile").iterdir()}
    assert {name for name in everything if Path(name).suffix not in PARTS} == {*BROKEN, *USABLE}
    files = corpus_files(folder, "hostile/*")
    assert {file.name for file in files} == {*BROKEN, *USABLE}
    rows = list(run_corpus(folder, files, output, workers=2))
    assert [(row.name, row.problem) for row in rows if row.problem] == []
    names = [(row.name.removeprefix("hostile/").removesuffix(CONVERTED), row) for row in rows]
    wanted = [(name, 3 if name in BROKEN else 0) for name, _ in names]
    assert [(name, row.code) for name, row in names] == wanted
    broken = [(name, row.message) for name, row in names if name in BROKEN]
    assert [one for one in broken if BROKEN[one[0]] not in one[1]] == []
    usable = [(name, row.codes) for name, row in names if USABLE.get(name)]
    assert [one for one in usable if USABLE[one[0]] not in one[1]] == []


@pytest.mark.usefixtures("gl")
def test_real_files(testdata: Path, output: Path) -> None:
    folder = testdata / "data"
    names = [*REAL, *(name for name, here in BY_OTHERS if here)]
    rows = run(folder, [folder / name for name in names], output)
    assert problems(rows) == {}
    refused = [name for name, row in rows.items() if row.code]
    assert refused == ["openmaterial/lights/pointLight.gltf"]  # lights alone
