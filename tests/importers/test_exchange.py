"""Nothing that a worker leaves is believed."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from worker_readers import everything

from hdrusd.errors import InputError
from hdrusd.importers.exchange import ARRAYS, SCENE, load_scene, save_scene
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Report

quick = settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def left(folder: Path) -> Resolver:
    """A scene left in ``folder``, and who is to load it."""
    report = Report()
    resolver = Resolver(folder / "model.fbx", report)
    save_scene(everything(resolver, report), folder, report)
    return resolver


def load(folder: Path, limits: Limits | None = None) -> LegacyScene:
    """What the parent makes of ``folder``."""
    report = Report()
    resolver = Resolver(folder / "model.fbx", report, limits=limits or Limits())
    return load_scene(folder, resolver, report)


def change(folder: Path, changed: Callable[[Any], None]) -> None:
    """Change the record that was left."""
    record = json.loads((folder / SCENE).read_text())
    changed(record)
    (folder / SCENE).write_text(json.dumps(record))


def put(*path: str | int, value: Any) -> Callable[[Any], None]:
    """A change that puts a value at a path into the record."""

    def changed(record: Any) -> None:
        for step in path[:-1]:
            record = record[step]
        record[path[-1]] = value

    return changed


#: The nodes in the order of the walk: root, hip, tip, body, second.
@pytest.mark.parametrize(
    "changed",
    [
        put("nodes", 1, "children", value=[0]),  # a cycle
        put("nodes", 0, "children", value=[1, 3, 2]),  # two parents
        put("nodes", 0, "children", value=[1, 1, 3]),
        put("nodes", 0, "children", value=[3]),  # lost nodes
        put("nodes", 0, "children", value=[1, 99]),
        put("nodes", 3, "meshes", value=[1]),
        put("nodes", 3, "meshes", value=[-1]),
        put("nodes", 3, "meshes", value=[10**30]),
        put("nodes", 3, "skin", value=1),
        put("nodes", 2, "lights", value=[1]),
        put("nodes", 0, "cameras", value=[0.0]),
        put("nodes", 0, "kind", value="castle"),
        put("nodes", 0, "name", value=None),
        put("nodes", 0, "new", value=1),
        put("nodes", 2, "transform", value={"translation": [1.0, 2.0]}),
        put("nodes", 2, "transform", value={"translation": [1.0, 2.0, True]}),
        put("nodes", 2, "transform", value={"translation": [1.0, 2.0, 10**400]}),
        put("nodes", 2, "transform", value={"array": 99}),
        put("nodes", 1, "lod_ranges", value=[[0.0, 1.0], [2.0, 3.0]]),
        put("nodes", 1, "animation", 0, "path", value="scale"),  # of four numbers
        put("scene", "meshes", 0, "material", value=1),
        put("scene", "meshes", 0, "colors_interpolation", value="vertex"),
        put("scene", "meshes", 0, "normals_interpolation", value="uniform"),
        put("scene", "meshes", 0, "joint_weights", value=None),
        put("scene", "meshes", 0, "points", value=None),
        put("scene", "meshes", 0, "face_indices", value={"array": 0}),
        put("scene", "meshes", 0, "uvs", value={"st": [{"array": 0}]}),
        put("scene", "materials", 0, "diffuse", value=[0.5, 0.5, "x"]),
        put("scene", "materials", 0, "diffuse_map", "image", "path", value="/etc/passwd"),
        put("scene", "skins", 0, "joints", value=[0]),
        put("scene", "roots", value=[]),
        put("scene", "up", value="X"),
        put("scene", "unit_m", value=0.0),
        put("scene", "unit_m", value=-1.0),
        put("scene", "roots", value={}),
        put("findings", value=[{"kind": "grave", "code": "", "place": 1, "thing": "", "text": ""}]),
        put("findings", value=[{}]),
        put("arrays", value=[["<f4", [1 << 60]]]),
        put("arrays", value=[["<f4", [-1]]]),
        put("arrays", value=[["|O", [1]]]),
        put("arrays", value=[["|u1", [0, 10**40]]]),
        put("arrays", value=7),
        put("scene", value=[]),
        put("nodes", value=3),
        put("refusal", value=3),
    ],
)
def test_a_scene_that_does_not_fit_together(tmp_path: Path, changed: Callable[[Any], None]) -> None:
    left(tmp_path)
    assert len(load(tmp_path).meshes) == 1
    change(tmp_path, changed)
    with pytest.raises(InputError, match="nonsense"):
        load(tmp_path)


def test_a_string_of_no_lamps(tmp_path: Path) -> None:
    left(tmp_path)

    def changed(record: Any) -> None:
        record["arrays"].append(["<f8", [0, 3]])
        record["scene"]["lights"][0]["positions"] = {"array": len(record["arrays"]) - 1}

    change(tmp_path, changed)
    with pytest.raises(InputError, match="the places of a light do not fit"):
        load(tmp_path)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity"])
def test_numbers_that_are_none(tmp_path: Path, number: str) -> None:
    left(tmp_path)
    text = (tmp_path / SCENE).read_text()
    (tmp_path / SCENE).write_text(text.replace('"unit_m":0.0254', f'"unit_m":{number}'))
    with pytest.raises(InputError, match=f"{number} is no number"):
        load(tmp_path)


def test_arrays_with_numbers_that_are_none(tmp_path: Path) -> None:
    left(tmp_path)
    data = (tmp_path / ARRAYS).read_bytes()
    points = np.float32([[1, 0, 0], [1, 1, 0]]).tobytes()
    assert points in data
    broken = points[:-4] + np.float32(np.nan).tobytes()
    (tmp_path / ARRAYS).write_bytes(data.replace(points, broken, 1))
    with pytest.raises(InputError, match="not finite"):
        load(tmp_path)


def test_the_limits_hold(tmp_path: Path) -> None:
    left(tmp_path)
    for limits in (Limits(nodes=4), Limits(vertices=5), Limits(depth=2)):
        with pytest.raises(InputError, match=r"more than|deeper than"):
            load(tmp_path, limits)
    for limits in (Limits(pixels=7), Limits(file_bytes=100)):
        with pytest.raises(InputError, match="nonsense"):
            load(tmp_path, limits)
    load(tmp_path, Limits(nodes=5, vertices=6, depth=3, pixels=8))


def test_only_plain_files_are_read(tmp_path: Path) -> None:
    left(tmp_path)
    whole = (tmp_path / SCENE).read_bytes()
    (tmp_path / "other").write_bytes(whole)
    (tmp_path / SCENE).unlink()
    (tmp_path / SCENE).symlink_to(tmp_path / "other")
    with pytest.raises(InputError, match="nonsense"):
        load(tmp_path)
    (tmp_path / SCENE).unlink()
    os.mkfifo(tmp_path / SCENE)
    with pytest.raises(InputError, match="nonsense"):
        load(tmp_path)


def test_lists_without_end(tmp_path: Path) -> None:
    (tmp_path / SCENE).write_text("[" * 1_000_000)
    with pytest.raises(InputError, match=r"nonsense|without end"):
        load(tmp_path)


@quick
@given(at=st.integers(0, 10_000), byte=st.integers(32, 126))
def test_any_changed_byte_is_a_scene_or_one_line(tmp_path: Path, at: int, byte: int) -> None:
    left(tmp_path)
    data = bytearray((tmp_path / SCENE).read_bytes())
    data[at % len(data)] = byte
    (tmp_path / SCENE).write_bytes(data)
    with suppress(InputError):  # what else it raises fails
        load(tmp_path)


def test_a_picture_outside_the_roots_stays_outside(tmp_path: Path) -> None:
    (tmp_path / "secret.png").touch()
    (tmp_path / "in").mkdir()
    left(tmp_path / "in")
    picture = ("scene", "materials", 0, "diffuse_map", "image", "name")
    change(tmp_path / "in", put(*picture, value="../secret.png"))
    report = Report()
    scene = load_scene(tmp_path / "in", Resolver(tmp_path / "in" / "model.fbx", report), report)
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert texture.image.missing
    assert texture.image.name == "../secret.png"
    assert "file-refused" in report.codes()


def test_a_deep_tree_costs_no_stack(tmp_path: Path) -> None:
    source = tmp_path / "model.fbx"
    report = Report()
    resolver = Resolver(source, report, limits=Limits(depth=5_000))
    place = everything(resolver, report).roots[0].source
    root = node = Node("0", place)
    for _ in range(4_999):
        node.children.append(Node("n", place))
        node = node.children[0]
    save_scene(LegacyScene(source, "test", [root]), tmp_path, report)
    node, depth = load_scene(tmp_path, resolver, report).roots[0], 1
    while node.children:
        node, depth = node.children[0], depth + 1
    assert depth == 5_000


def test_a_node_in_two_places_is_a_bug_of_the_reader(tmp_path: Path) -> None:
    report = Report()
    scene = everything(Resolver(tmp_path / "model.fbx", report), report)
    scene.roots.append(scene.roots[0].children[0])
    with pytest.raises(ValueError, match="'hip' stands in the tree twice"):
        save_scene(scene, tmp_path, report)
