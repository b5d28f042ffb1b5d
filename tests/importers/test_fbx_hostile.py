"""FBX that is broken or made to do harm: the process that reads it may die, hdrusd may not."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from fbx_builder import SQUARE, Fbx, P, array, layer, load, needs_ufbx, square

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits, Resolver, read
from hdrusd.report import Report

pytestmark = needs_ufbx

DATA = os.environ.get("HDRUSD_TESTDATA")
needs_data = pytest.mark.skipif(DATA is None, reason="HDRUSD_TESTDATA names no test data")
MAGIC = b"Kaydara FBX Binary  \x00\x1a\x00"


def refused(path: Path, limits: Limits | None = None) -> str:
    """The one line of a refusal."""
    report = Report()
    with pytest.raises(InputError) as caught:
        read(Resolver(path, report, limits=limits or Limits()), report)
    assert caught.value.exit_code == 3
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not an FBX",
        MAGIC,
        MAGIC + (7400).to_bytes(4, "little"),
        # a node that ends at 4 GiB, with as many properties
        MAGIC + (7400).to_bytes(4, "little") + b"\xff" * 12 + b"\x00",
        b"\x89PNG\r\n\x1a\n" + bytes(64),
        b"; FBX 7.4.0 project file\nObjects: {\n" * 100_000,
    ],
    ids=["empty", "text", "magic", "header", "huge node", "PNG", "deep"],
)
def test_no_fbx_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.fbx"
    path.write_bytes(content)
    assert "a.fbx" in refused(path)


def test_a_declared_length_is_not_believed(tmp_path: Path) -> None:
    """Four thousand million numbers are announced, three are there."""
    fbx = Fbx()
    square(fbx)
    text = fbx.text().replace("Vertices: *12", "Vertices: *4000000000")
    path = tmp_path / "a.fbx"
    path.write_text(text, encoding="utf-8")
    small = Limits(worker_bytes=1 << 30, worker_seconds=60)
    report = Report()
    scene = read(Resolver(path, report, limits=small), report)
    assert len(scene.meshes[0].points) == 4


def test_deep_and_many_nodes_stop_at_the_limits(tmp_path: Path) -> None:
    fbx = Fbx()
    under = 0
    for number in range(400):
        under = fbx.model(f"n{number}", "Null", under=under)
    path = fbx.write(tmp_path)
    refused(path)
    fbx = Fbx()
    for number in range(40):
        fbx.model(f"n{number}")
    path = fbx.write(tmp_path)
    assert "nodes" in refused(path, Limits(nodes=20))


def test_a_node_that_is_its_own_ancestor(tmp_path: Path) -> None:
    fbx = Fbx()
    a = fbx.model("a", "Null")
    b = fbx.model("b", "Null", under=a)
    fbx.connect(a, b)
    square(fbx, under=b)
    assert "Cyclic" in refused(fbx.write(tmp_path))


def test_indices_past_their_tables(tmp_path: Path) -> None:
    fbx = Fbx()
    node = fbx.model("n", "Mesh")
    uv = layer("LayerElementUV", "UV", [0.0, 0.0], [0, 7, -3, 0, 0, 0, 0], name="uv")
    fbx.mesh(node, SQUARE, [(0, 1, 2, 3), (0, 1, 2)], uv)
    scene, report = load(fbx.write(tmp_path))
    values, _ = scene.meshes[0].uvs["st"]
    assert (values == 0.0).all()
    assert "fbx-warning" in report.codes()
    fbx = Fbx()
    fbx.mesh(fbx.model("n", "Mesh"), SQUARE, [(0, 1, 99)])
    refused(fbx.write(tmp_path))


@pytest.mark.parametrize("word", ["1e400", "-1e300", "nan", "inf"])
def test_numbers_that_are_none(tmp_path: Path, word: str) -> None:
    fbx = Fbx()
    node = fbx.model("n", "Mesh", P("Lcl Translation", 77.0, 0.0, 0.0))
    fbx.mesh(node, [*SQUARE, (88.0, 0.0, 0.0)], [(0, 1, 2, 3), (0, 1, 4)])
    fbx.attribute("Light", P("Intensity", 99.0), under=fbx.model("lamp", "Light"))
    text = fbx.text()
    for number in ("77.0", "88.0", "99.0"):
        assert number in text
        text = text.replace(number, word)
    path = tmp_path / "a.fbx"
    path.write_text(text, encoding="utf-8")
    scene, report = load(path)
    assert scene.meshes[0].points.max() == 1.0
    assert scene.meshes[0].face_counts.tolist() == [4]
    assert scene.roots[0].transform is None
    assert scene.lights[0].diffuse == (1.0, 1.0, 1.0)
    assert {"fbx-number", "mesh-points"} <= report.codes()


def test_weights_of_points_that_are_not_there(tmp_path: Path) -> None:
    fbx = Fbx()
    square(fbx)
    bone = fbx.model("bone", "LimbNode")
    skin = fbx.add("Deformer", "s", "Skin", "Version: 101", under=1002)
    body = array("Indexes", [0, 1, 5000, -1]), array("Weights", [1.0, float(0), 1.0, 1.0])
    cluster = fbx.add("Deformer", "", "Cluster", "Version: 100", *body, under=skin)
    fbx.connect(bone, cluster)
    scene, report = load(fbx.write(tmp_path))
    weights, joints = scene.meshes[0].joint_weights, scene.meshes[0].joint_indices
    assert weights is not None
    assert joints is not None
    # A point without a weight would be drawn at the origin: it goes with the first joint.
    assert weights.sum(axis=1).tolist() == [1.0, 1.0, 1.0, 1.0]
    assert joints[1:, 0].tolist() == [0, 0, 0]
    assert "skin-weights" in report.codes()


@needs_data
@pytest.mark.parametrize("name", ["empty.fbx", "trunc_max.fbx"])
def test_hostile_files_are_refused(name: str) -> None:
    assert name in refused(Path(DATA or "") / "data" / "hostile" / name)


@needs_data
@pytest.mark.parametrize("seed", range(6))
def test_flipped_bits(tmp_path: Path, seed: int) -> None:
    """Either a scene or one line."""
    dice = random.Random(seed)
    files = sorted((Path(DATA or "") / "data" / "ufbx").glob("*.fbx"))
    content = bytearray(dice.choice(files).read_bytes())
    for _ in range(dice.choice((1, 3, 30))):
        content[dice.randrange(len(content))] ^= 1 << dice.randrange(8)
    path = tmp_path / "a.fbx"
    path.write_bytes(content)
    report = Report()
    try:
        scene = read(Resolver(path, report, limits=Limits(worker_seconds=30)), report)
    except InputError as error:
        line = str(error)
    else:
        line = scene.format
    assert line == "fbx" or "ufbx cannot read it" in line  # neither a crash nor a bug of ours
