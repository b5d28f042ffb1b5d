"""Skins of glTF: what the file says of joints, bind matrices and weights; hostile ones."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import Doc, load
from pxr import Usd

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.importers.gltf import read
from hdrusd.importers.importer import Resolver
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader

BAR = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, 1]], "f4")
FACES = [0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4]
HALF = math.sqrt(0.5)


def bar(indices: Any = None, weights: Any = None, dtype: str = "u1", **more: Any) -> Doc:
    """A bar of two joints; the elbow turns by 90 degrees about z from 0 to 1 s."""
    doc = Doc()
    indices = [[0, 0, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]] * 2 if indices is None else indices
    weights = [[1, 0, 0, 0], [0.5, 0.5, 0, 0], [1, 0, 0, 0]] * 2 if weights is None else weights
    doc.mesh(
        FACES,
        POSITION=doc.add(BAR),
        JOINTS_0=doc.add(np.array(indices), dtype),
        WEIGHTS_0=doc.add(np.array(weights, "f4")),
        **more,
    )
    # Column-major, so the translation is the last four numbers.
    binds = np.tile(np.eye(4), (2, 1, 1))
    binds[1, 3, 0] = -1.0
    view = doc.view(binds.astype("<f4").tobytes())
    matrices = doc.accessor(view, 2, 5126, "MAT4")
    doc.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices, "name": "rig"}]
    doc.json["nodes"] = [
        {"mesh": 0, "skin": 0, "translation": [7, 8, 9]},
        {"name": "shoulder", "children": [2]},
        {"name": "elbow", "translation": [1, 0, 0]},
    ]
    times, turns = doc.add([0.0, 1.0]), doc.add([[0, 0, 0, 1], [0, 0, HALF, HALF]])
    doc.json["animations"] = [
        {
            "samplers": [{"input": times, "output": turns}],
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}],
        }
    ]
    return doc


def read_doc(folder: Path, doc: Doc) -> Any:
    return load(doc.write(folder / "a.gltf"))


def drawn(stage: Usd.Stage, code: float) -> np.ndarray:
    """The corners of the triangles in the world."""
    (draw,) = StageReader(stage, Report(), default_sky=False).read(code, Camera()).draws
    matrix = draw.transforms[0]
    return np.asarray(draw.geometry.points @ matrix[:3, :3] + matrix[3, :3])


def test_a_bar_bends_by_a_quarter_turn(tmp_path: Path) -> None:
    source = bar().write(tmp_path / "bar.gltf")
    result = convert(source, tmp_path / "bar.usda", Options())
    assert not result.report.codes() & {"skin-bind", "skin-dropped", "skin-weights", "validation"}
    stage = Usd.Stage.Open(str(result.output))
    np.testing.assert_allclose(drawn(stage, 0.0), BAR[FACES], atol=1e-5)
    bent = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]])
    np.testing.assert_allclose(drawn(stage, 24.0), bent[FACES], atol=1e-5)


def test_what_the_file_says(tmp_path: Path) -> None:
    scene, report = read_doc(tmp_path, bar())
    (skin,) = scene.skins
    assert skin.name == "rig"
    assert skin.joints == (scene.roots[1], scene.roots[1].children[0])
    assert skin.joints[1] is scene.roots[1].children[0]
    assert skin.inverse_binds[1][3].tolist() == [-1.0, 0.0, 0.0, 1.0]
    assert scene.roots[0].skin == 0
    assert scene.meshes[0].joint_weights.tolist()[1] == [0.5, 0.5]
    assert not report.codes()


@pytest.mark.parametrize("dtype", ["u1", "u2"])
def test_normalized_weights(tmp_path: Path, dtype: str) -> None:
    full = {"u1": 255, "u2": 65535}[dtype]
    doc = bar()
    doc.primitive["attributes"]["WEIGHTS_0"] = doc.add(
        np.array([[full, 0, 0, 0]] * 6), dtype, normalized=True
    )
    scene, _ = read_doc(tmp_path, doc)
    assert scene.meshes[0].joint_weights.tolist() == [[1.0]] * 6


def test_a_second_set_of_influences(tmp_path: Path) -> None:
    doc = bar(weights=[[0.4, 0, 0, 0]] * 6, indices=[[0, 0, 0, 0]] * 6)
    more = doc.primitive["attributes"]
    more["JOINTS_1"] = doc.add(np.array([[1, 0, 0, 0]] * 6), "u1")
    more["WEIGHTS_1"] = doc.add(np.array([[0.6, 0, 0, 0]] * 6, "f4"))
    scene, report = read_doc(tmp_path, doc)
    assert scene.meshes[0].joint_indices.tolist() == [[1, 0]] * 6
    np.testing.assert_allclose(scene.meshes[0].joint_weights, [[0.6, 0.4]] * 6, rtol=1e-6)
    assert not report.codes()


def spoil(key: str, value: Any) -> Any:
    return lambda doc: doc.json["skins"][0].__setitem__(key, value)


def unusable(doc: Doc) -> None:
    doc.primitive["attributes"]["WEIGHTS_0"] = doc.add(np.zeros((5, 4), "f4"))


@pytest.mark.parametrize(
    ("break_it", "code"),
    [
        (spoil("joints", []), None),
        (spoil("joints", [1]), "skin-weights"),
        (spoil("joints", [1, 99]), "gltf-value"),
        (spoil("inverseBindMatrices", 0), "skin-dropped"),
        (spoil("inverseBindMatrices", 10**9), "gltf-value"),
        (unusable, "skin-dropped"),
        (lambda doc: doc.json["nodes"][0].__setitem__("skin", 5), "gltf-value"),
        (lambda doc: doc.json.__setitem__("scenes", [{"nodes": [0]}]), "skin-dropped"),
        (
            lambda doc: doc.primitive["attributes"].__setitem__(
                "JOINTS_0", doc.add(np.full((6, 4), np.nan, "f4"))
            ),
            "skin-weights",
        ),
    ],
)
def test_broken_skins_leave_a_finding_and_a_stage(
    tmp_path: Path, break_it: Any, code: str | None
) -> None:
    doc = bar()
    break_it(doc)
    result = convert(doc.write(tmp_path / "a.gltf"), tmp_path / "a.usda", Options())
    assert code is None or code in result.report.codes()
    drawn(Usd.Stage.Open(str(result.output)), 0.0)


def test_a_bind_matrix_that_is_not_finite(tmp_path: Path) -> None:
    doc = bar()
    view = doc.view(np.full(32, np.nan, "<f4").tobytes())
    doc.json["skins"][0]["inverseBindMatrices"] = doc.accessor(view, 2, 5126, "MAT4")
    scene, report = read_doc(tmp_path, doc)
    assert "skin-dropped" in report.codes()
    assert (scene.skins, scene.roots[0].skin) == ([], None)


def test_a_cylinder_by_its_raw_numbers(testdata: Path) -> None:
    """03_skinned_cylinder: the sum of section 3.7.3.3 over the file's own arrays, at rest."""
    path = testdata / "data/gltf-blender-io/03_skinned_cylinder/03_skinned_cylinder.gltf"
    data = json.loads(path.read_text())
    body = (path.parent / data["buffers"][0]["uri"]).read_bytes()

    def array(number: int) -> np.ndarray:
        accessor = data["accessors"][number]
        view = data["bufferViews"][accessor["bufferView"]]
        dtype = {5126: "<f4", 5121: "<u1", 5123: "<u2"}[accessor["componentType"]]
        width = {"VEC3": 3, "VEC4": 4, "MAT4": 16, "SCALAR": 1}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = accessor["count"] * width
        return np.frombuffer(body, dtype, count, start).reshape(-1, width)

    parents = {c: n for n, node in enumerate(data["nodes"]) for c in node.get("children", [])}

    def local(number: int) -> np.ndarray:
        node = data["nodes"][number]
        x, y, z, w = node.get("rotation", [0, 0, 0, 1])
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
                [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
                [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        made = np.eye(4)
        made[:3, :3] = np.array(node.get("scale", [1, 1, 1]))[:, None] * turn
        made[3, :3] = node.get("translation", [0, 0, 0])
        return made

    def world(number: int) -> np.ndarray:
        made = local(number)
        while number in parents:
            number = parents[number]
            made = made @ local(number)
        return made

    skin = data["skins"][0]
    binds = array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).astype(float)
    matrices = np.array([b @ world(j) for b, j in zip(binds, skin["joints"], strict=True)])
    attributes = data["meshes"][0]["primitives"][0]["attributes"]
    points = array(attributes["POSITION"]).astype(float)
    joints, weights = array(attributes["JOINTS_0"]), array(attributes["WEIGHTS_0"]).astype(float)
    mixed = (matrices[joints] * weights[:, :, None, None]).sum(axis=1)
    wanted = np.einsum("ni,nij->nj", np.append(points, np.ones((len(points), 1)), axis=1), mixed)

    report = Report()
    scene = read(Resolver(path, report), report)
    (made,) = scene.skins
    assert [joint.name for joint in made.joints] == [
        data["nodes"][j].get("name", f"node_{j}") for j in skin["joints"]
    ]
    mesh = scene.meshes[0]
    ours = np.array([b @ world(j) for b, j in zip(made.inverse_binds, skin["joints"], strict=True)])
    sums = (ours[mesh.joint_indices] * mesh.joint_weights[:, :, None, None]).sum(axis=1)
    own = np.append(mesh.points, np.ones((len(mesh.points), 1)), axis=1)
    got = np.einsum("ni,nij->nj", own, sums)
    np.testing.assert_allclose(got[:, :3], wanted[:, :3], atol=1e-5)
