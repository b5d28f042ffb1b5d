"""Skins of COLLADA, and nodes that are instanced: one object in many places."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from collada_builder import (
    document,
    geometry,
    instance,
    load,
    names,
    source,
    triangles,
)
from pxr import Usd

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.errors import InputError
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader

BAR = "0 0 0  1 0 0  2 0 0  0 0 1  1 0 1  2 0 1"
FACES = "0 1 4 0 4 3 1 2 5 1 5 4"
#: Point 1 half on each joint, the end on the elbow.
WEIGHTS = "<vcount>1 2 1 1 2 1</vcount><v>0 0  0 1 1 1  1 0  0 0  0 1 1 1  1 0</v>"
JOINTS = (
    '<joints><input semantic="JOINT" source="#j"/>'
    '<input semantic="INV_BIND_MATRIX" source="#b"/></joints>'
)
INPUTS = (
    '<input semantic="JOINT" source="#j" offset="0"/>'
    '<input semantic="WEIGHT" source="#w" offset="1"/>'
)
#: 90 degrees about z, 1 to the right: the matrix of the elbow, by rows, for columns.
TURNED = "0 -1 0 1  1 0 0 0  0 0 1 0  0 0 0 1"


def moved(x: float) -> str:
    return f"1 0 0 {x} 0 1 0 0 0 0 1 0 0 0 0 1"


def skinned(
    *,
    joints: str = "upper lower",
    binds: str = f"{moved(0)} {moved(-1)}",
    weights: str = "1 0.5",
    rows: str = WEIGHTS,
    shape: str = moved(0),
    tool: str = "",
    parts: str = "",
    lower: str = TURNED,
    above: str = "",
) -> str:
    skin = parts or (
        f"{names('j', joints)}{source('b', binds, 16)}{source('w', weights, 1)}{JOINTS}"
        f'<vertex_weights count="6">{INPUTS}{rows}</vertex_weights>'
    )
    libraries = (
        f"<library_geometries>{geometry(triangles(FACES), points=BAR)}</library_geometries>"
        f'<library_controllers><controller id="c"><skin source="#g" name="rig">'
        f"<bind_shape_matrix>{shape}</bind_shape_matrix>{skin}</skin></controller>"
        "</library_controllers>"
    )
    nodes = (
        f'<node id="figure">{above}<node id="u" sid="upper"><node id="l" sid="lower"><matrix>'
        f'{lower}</matrix></node></node><node id="body"><instance_controller url="#c"><skeleton>'
        "#u</skeleton></instance_controller></node></node>"
    )
    return document(libraries, nodes, tool=tool)


def drawn(folder: Path, text: str) -> tuple[np.ndarray, set[str]]:
    """The corners of the triangles in the world, and what was found."""
    path = folder / "bar.dae"
    path.write_text(text)
    result = convert(path, folder / "bar.usda", Options())
    stage = Usd.Stage.Open(str(result.output))
    (draw,) = StageReader(stage, Report(), default_sky=False).read(0.0, Camera()).draws
    matrix = draw.transforms[0]
    points = draw.geometry.points @ matrix[:3, :3] + matrix[3, :3]
    return np.asarray(points), result.report.codes()


CORNERS = [int(word) for word in FACES.split()]
BENT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]])[CORNERS]

#: Where the figure of some tests stands.
RIGHT = np.array([3.0, 0.0, 0.0])


def test_a_bar_bends_by_a_quarter_turn(tmp_path: Path) -> None:
    points, codes = drawn(tmp_path, skinned())
    np.testing.assert_allclose(points, BENT, atol=1e-5)
    assert not {code for code in codes if code.startswith("skin")}


def test_the_bind_shape_comes_first(tmp_path: Path) -> None:
    # Modelled one to the left, and moved right to be bound.
    text = skinned(shape=moved(1.0)).replace(BAR, "-1 0 0  0 0 0  1 0 0  -1 0 1  0 0 1  1 0 1")
    points, _ = drawn(tmp_path, text)
    np.testing.assert_allclose(points, BENT, atol=1e-5)


def test_a_bind_shape_of_blender_is_below_the_parent(tmp_path: Path) -> None:
    # The figure stands 3 to the right; joints are bound in the world, there.
    above = "<translate>3 0 0</translate>"
    binds = f"{moved(-3)} {moved(-4)}"
    text = skinned(above=above, binds=binds, tool="Blender 2.80")
    points, codes = drawn(tmp_path, text)
    np.testing.assert_allclose(points, BENT + RIGHT, atol=1e-5)
    assert "collada-bind-shape" in codes
    # Of others it is in the world already.
    text = skinned(above=above, binds=binds, shape=moved(3), tool="Maya")
    points, codes = drawn(tmp_path, text)
    np.testing.assert_allclose(points, BENT + RIGHT, atol=1e-5)
    assert "collada-bind-shape" not in codes


def test_joints_by_id(tmp_path: Path) -> None:
    text = skinned(joints="u l").replace("Name_array", "IDREF_array")
    points, _ = drawn(tmp_path, text)
    np.testing.assert_allclose(points, BENT, atol=1e-5)


def test_what_the_file_says(tmp_path: Path) -> None:
    scene, report = load(tmp_path, skinned())
    (figure,) = scene.roots
    upper, body = figure.children
    (skin,) = scene.skins
    assert skin.joints == (upper, upper.children[0])
    assert (body.skin, body.meshes, skin.name) == (0, [0], "rig")
    assert scene.meshes[0].joint_weights.tolist()[:3] == [[1, 0], [0.5, 0.5], [1, 0]]
    assert not report.codes() & {"skin-dropped", "skin-weights"}


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"joints": "upper nobody"}, "skin-dropped"),
        ({"joints": ""}, "skin-dropped"),
        ({"binds": moved(0)}, "skin-dropped"),
        ({"binds": "nan " * 32}, "skin-dropped"),
        ({"parts": JOINTS}, "skin-dropped"),
        ({"rows": "<vcount>1</vcount>"}, "skin-dropped"),
        ({"weights": ""}, "skin-dropped"),
        ({"rows": "<vcount>9999999 1 1 1 1 1</vcount><v>0 0 0 0</v>"}, "skin-weights"),
        ({"rows": "<vcount>-5 1 x 1 1 1</vcount><v>0 0 0 0 1 1</v>"}, "skin-weights"),
        (
            {"rows": "<vcount>1 1 1 1 1 1</vcount><v>7 0 -1 0 0 99 0 -4 0 nan 0 0</v>"},
            "skin-weights",
        ),
        ({"weights": "nan -1"}, "skin-weights"),
    ],
)
def test_broken_skins_leave_a_finding_and_a_stage(
    tmp_path: Path, changes: dict[str, Any], code: str
) -> None:
    points, codes = drawn(tmp_path, skinned(**changes))
    assert code in codes
    assert np.isfinite(points).all()
    if code == "skin-dropped":
        every = np.array([float(word) for word in BAR.split()]).reshape(-1, 3)
        np.testing.assert_allclose(points, every[CORNERS], atol=1e-6)


@pytest.mark.parametrize("many", [16, 17])
def test_more_joints_than_are_kept_are_told(tmp_path: Path, many: int) -> None:
    """The first point is held by 16 or 17, in turn by the two joints with weight 1."""
    pairs = "0 0 1 0 " * (many // 2) + "0 0 " * (many % 2 + 5)
    rows = f"<vcount>{many} 1 1 1 1 1</vcount><v>{pairs}</v>"
    _, report = load(tmp_path, skinned(rows=rows, weights="1"))
    told = [str(f.kind) + " " + f.text for f in report if f.code == "skin-weights"]
    text = "dropped 1 of 6 points are held by more than 16 joints; the strongest are kept"
    assert told == [text] * (many > 16)


# -- instances ------------------------------------------------------------------------------


def test_an_instanced_node_is_one_object(tmp_path: Path) -> None:
    libraries = (
        f"<library_geometries>{geometry(triangles('0 1 2'))}</library_geometries>"
        f'<library_nodes><node id="car"><node>{instance()}</node></node></library_nodes>'
    )
    nodes = "".join('<node><instance_node url="#car"/></node>' for _ in range(300))
    scene, _ = load(tmp_path, document(libraries, nodes))
    assert len({id(root.children[0]) for root in scene.roots}) == 1
    path = tmp_path / "cars.dae"
    path.write_text(document(libraries, nodes))
    result = convert(path, tmp_path / "cars.usda", Options())
    stage = Usd.Stage.Open(str(result.output))
    assert len([prim for prim in stage.Traverse() if prim.IsInstance()]) == 300
    found = StageReader(stage, Report(), default_sky=False).read(0.0, Camera())
    assert found.triangles() == 300


def test_instances_of_instances_are_limited(tmp_path: Path) -> None:
    """Each node holds the next one twice: 2^30 nodes in thirty lines."""
    library = "".join(
        f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>'
        for i in range(30)
    )
    libraries = f'<library_nodes>{library}<node id="n30"/></library_nodes>'
    start = time.monotonic()
    with pytest.raises(InputError, match="nodes with its instances"):
        load(tmp_path, document(libraries, '<node><instance_node url="#n0"/></node>'))
    assert time.monotonic() - start < 10.0
