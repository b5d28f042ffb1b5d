"""glTF nodes, lights, cameras and animations.

Numbers come from the glTF 2.0 specification and KHR_lights_punctual, not from the reader.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_builder import LIGHTS, TRIANGLE, Doc, animated, load_doc, load_json, nodes, only_triangle

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import TRS, LegacyScene
from hdrusd.report import Report

TURN = math.sqrt(0.5)  # the quaternion (0, 0, TURN, TURN) turns +X to +Y


# Nodes


def test_a_matrix_is_read_for_row_vectors(tmp_path: Path) -> None:
    # Column-major, for columns: +X to +Y, +Y to -X, then 10, 20, 30 along the axes.
    columns = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1]
    scene, report = load_json(tmp_path, nodes=[{"matrix": columns}, {}])
    matrix = scene.roots[0].transform
    assert isinstance(matrix, np.ndarray)
    np.testing.assert_array_equal(np.array([1.0, 0, 0, 1]) @ matrix, [10, 21, 30, 1])
    assert scene.roots[1].transform is None
    assert report.codes() == {"scene-empty"}


def test_translation_rotation_and_scale_are_kept_apart(tmp_path: Path) -> None:
    node = {"translation": [1, 2, 3], "rotation": [0, 3, 0, 4], "scale": [1, 1, 0]}
    scene, report = load_json(tmp_path, nodes=[node, {"rotation": [0, 0, 0, 0]}])
    assert scene.roots[0].transform == TRS((1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8), (1.0, 1.0, 0.0))
    assert scene.roots[1].transform == TRS()
    assert report.codes() >= {"node-rotation", "node-singular"}


def test_a_singular_or_projective_matrix_is_a_finding(tmp_path: Path) -> None:
    flat = [1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 0, 1]
    odd = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0]
    scene, report = load_json(tmp_path, nodes=[{"matrix": flat}, {"matrix": odd}])
    np.testing.assert_array_equal(scene.roots[1].transform, np.eye(4))
    assert report.codes() >= {"node-singular", "node-matrix"}


@pytest.mark.parametrize(
    ("tree", "match"),
    [
        ([{"children": [1]}, {"children": [0]}], "cycle"),
        ([{"children": [0]}], "cycle"),
        ([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {}], "nodes 1 and 2"),
        ([{"children": [1, 1]}, {}], "nodes 0 and 0"),
    ],
)
@pytest.mark.parametrize("scenes", [None, [{"nodes": [0]}]])
def test_what_is_no_tree_is_refused(
    tmp_path: Path, tree: list[Any], match: str, scenes: list[Any] | None
) -> None:
    parts = {"nodes": tree} if scenes is None else {"nodes": tree, "scenes": scenes}
    with pytest.raises(InputError, match=match):
        load_json(tmp_path, **parts)


def test_depth_and_number_of_nodes_are_limited(tmp_path: Path) -> None:
    chain = [{"children": [n + 1]} for n in range(9)] + [{}]
    scene, _ = load_json(tmp_path, nodes=chain)
    assert len(nodes(scene)) == 10
    doc = Doc(nodes=chain)
    load_doc(tmp_path, doc, limits=Limits(depth=10, nodes=10))
    with pytest.raises(InputError, match="/nodes/9: nested deeper than 9"):
        load_doc(tmp_path, doc, limits=Limits(depth=9))
    with pytest.raises(InputError, match="10 nodes; at most 9"):
        load_doc(tmp_path, doc, limits=Limits(nodes=9))


def test_the_default_scene_is_read_and_the_rest_reported(tmp_path: Path) -> None:
    parts = {
        "nodes": [{"name": "a"}, {"name": "b"}, {}],
        "scenes": [{"nodes": [0]}, {"nodes": [1]}],
    }
    scene, report = load_json(tmp_path, scene=1, **parts)
    assert [(n.name, n.source.place) for n in nodes(scene)] == [("b", "/nodes/1")]
    assert report.codes() == {"scenes-other", "nodes-elsewhere", "scene-empty"}
    assert [n.name for n in nodes(load_json(tmp_path, **parts)[0])] == ["a"]


def test_wrong_numbers_are_findings_and_the_rest_is_used(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    doc.json["nodes"] = [{"mesh": 0, "children": [9, "x", 1]}, {"mesh": 7, "camera": -1}]
    scene, report = load_doc(tmp_path, doc)
    assert [n.meshes for n in nodes(scene)] == [[0], []]
    assert len([f for f in report if f.code == "gltf-value"]) == 3


def test_extras_keep_short_scalars(tmp_path: Path) -> None:
    extras = {"lamp": "HPS", "n": 3, "on": True, "list": [1], "long": "x" * 2000, "big": 10**30}
    scene, report = load_json(tmp_path, nodes=[{"extras": extras}])
    assert scene.roots[0].extras == {"lamp": "HPS", "n": 3, "on": True}
    assert [f.text for f in report if f.code == "extras-dropped"] == [
        "3 of 6 extras dropped; short scalars are kept"
    ]


def test_names_without_a_unicode_form_are_mended(tmp_path: Path) -> None:
    scene, _ = load_json(tmp_path, nodes=[{"name": "lamp\ud800"}])
    assert scene.roots[0].name == "lamp?"


# Lights


def lit(tmp_path: Path, lights: list[Any], placed: list[Any]) -> tuple[LegacyScene, Report]:
    return load_json(
        tmp_path,
        extensions={LIGHTS: {"lights": lights}},
        nodes=[{"extensions": {LIGHTS: {"light": n}}} for n in placed],
    )


def test_lights_keep_candela_and_lux(tmp_path: Path) -> None:
    lights = [
        {"type": "point", "color": [1, 0.5, 0], "intensity": 800, "range": 30},
        {"type": "directional", "intensity": 0.2},
        {"type": "spot", "spot": {"innerConeAngle": math.pi / 6, "outerConeAngle": math.pi / 3}},
        {"type": "spot", "name": "lamp", "extras": {"watt": 70}},
    ]
    scene, report = lit(tmp_path, lights, [0, 0, 3])
    point, sun, spot, plain = scene.lights
    assert (point.kind, point.candela, point.lux, point.range) == ("point", 800.0, None, 30.0)
    assert point.diffuse == point.specular == (1.0, 0.5, 0.0)
    assert (point.spot_cutoff, point.spot_inner) == (180.0, None)
    assert (sun.kind, sun.candela, sun.lux) == ("directional", None, 0.2)
    # two roundings: radians to degrees
    assert spot.spot_inner == pytest.approx(30.0, rel=1e-15)
    assert spot.spot_cutoff == pytest.approx(60.0, rel=1e-15)
    # defaults of the extension: intensity 1, white, inner 0, outer pi / 4
    assert (plain.candela, plain.diffuse) == (1.0, (1.0, 1.0, 1.0))
    assert (plain.spot_inner, plain.spot_cutoff) == (0.0, 45.0)
    assert (plain.name, plain.extras) == ("lamp", {"watt": 70})
    assert [root.lights for root in scene.roots] == [[0], [0], [3]]
    assert len(report) == 0


def test_broken_lights_are_clamped_or_dropped_with_findings(tmp_path: Path) -> None:
    lights = [
        {"type": "lasers"},
        {"type": "point", "intensity": -5, "color": [-1, 2, 0], "range": 0},
        {"type": "point", "intensity": 1e39},
        {"type": "point", "intensity": 1e30, "color": [1e30, 1, 1]},
        {"type": "spot", "spot": {"innerConeAngle": 2, "outerConeAngle": 1}},
        {"type": "spot", "intensity": "much"},
    ]
    scene, report = lit(tmp_path, lights, [0, 1, 4, 99, None])
    assert [light.source.place for light in scene.lights] == [
        f"/extensions/{LIGHTS}/lights/1",
        f"/extensions/{LIGHTS}/lights/4",
    ]
    point, spot = scene.lights
    assert (point.candela, point.diffuse, point.range) == (0.0, (0.0, 2.0, 0.0), None)
    assert spot.spot_inner == spot.spot_cutoff == math.degrees(1.0)
    assert [root.lights for root in scene.roots] == [[], [0], [1], [], []]
    assert report.codes() >= {
        "light-type",
        "light-intensity",
        "light-range",
        "gltf-range",
        "colour-above-1",
        "light-missing",
        "light-index",
    }


# Cameras


def test_cameras(tmp_path: Path) -> None:
    lens = {"yfov": math.pi / 3, "znear": 0.5, "zfar": 100, "aspectRatio": 1.5}
    cameras = [
        {"type": "perspective", "perspective": lens, "name": "driver"},
        {"type": "orthographic", "orthographic": {"xmag": 8, "ymag": 2, "znear": 0, "zfar": 9}},
        {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}},
        {"type": "perspective", "perspective": {"yfov": 9, "znear": -1, "zfar": -2}},
    ]
    scene, report = load_json(tmp_path, cameras=cameras, nodes=[{"camera": 1}])
    eye, plan, far, broken = scene.cameras
    assert (eye.name, eye.near, eye.far, eye.aspect) == ("driver", 0.5, 100.0, 1.5)
    assert eye.fov_y == pytest.approx(60.0, rel=1e-15)
    assert (plan.kind, plan.height, plan.aspect) == ("orthographic", 4.0, 4.0)
    assert far.far >= 1e4
    assert 0.0 < broken.near < broken.far
    assert scene.roots[0].cameras == [1]
    assert report.codes() == {"camera-infinite", "camera-value"}


# Animation


def test_linear_and_step_keys_are_kept(tmp_path: Path) -> None:
    doc = Doc(nodes=[{"translation": [7, 7, 7]}])
    animated(doc, "translation", [0, 2], [[0, 0, 0], [0, 0, -20]])
    animated(doc, "rotation", [0.5], [[0, 0, 2 * TURN, 2 * TURN]], "STEP")
    (node,) = load_doc(tmp_path, doc)[0].roots
    move, turn = node.animation
    assert (move.path, move.interpolation, turn.path, turn.interpolation) == (
        "translation",
        "linear",
        "rotation",
        "step",
    )
    np.testing.assert_array_equal(move.times, [0.0, 2.0])
    np.testing.assert_array_equal(move.values, [[0, 0, 0], [0, 0, -20]])
    # float32 keys, then one normalisation
    np.testing.assert_allclose(turn.values, [[0, 0, TURN, TURN]], rtol=2**-23)
    assert isinstance(node.transform, TRS)


def test_a_cubic_spline_is_resampled_onto_its_curve(tmp_path: Path) -> None:
    """A Hermite spline through t^3 with slopes 3 t^2 is t^3 itself (appendix C.5)."""
    keys = np.array([0.0, 0.5, 2.0])
    triples = np.zeros((3, 3, 3))
    triples[:, 0, 0] = triples[:, 2, 0] = 3.0 * keys**2
    triples[:, 1, 0] = keys**3
    triples[0, 0] = triples[2, 2] = 999.0  # slopes before the first and after the last key
    doc = Doc(nodes=[{}])
    animated(doc, "translation", keys, triples.reshape(9, 3), "CUBICSPLINE")
    scene, report = load_doc(tmp_path, doc)
    (channel,) = scene.roots[0].animation
    assert set(keys) <= set(channel.times.tolist())
    assert np.diff(channel.times).max() <= 1.0 / 60.0 + 1e-12
    # values to 8; the polynomial cancels to a few roundings of float64 of that size
    np.testing.assert_allclose(channel.values[:, 0], channel.times**3, atol=64 * 2**-53)
    assert "60 times a second" in next(f.text for f in report if f.code == "animation-cubic")


def test_a_long_cubic_span_does_not_grow_without_bound(tmp_path: Path) -> None:
    doc = Doc(nodes=[{}])
    animated(doc, "scale", [0, 1e30], np.zeros((6, 3)), "CUBICSPLINE")
    (channel,) = load_doc(tmp_path, doc)[0].roots[0].animation
    assert len(channel.times) <= 2 * 64 + 2


def test_channels_without_a_home_are_findings(tmp_path: Path) -> None:
    doc = Doc(nodes=[{}, {"matrix": np.eye(4).reshape(-1).tolist()}])
    animated(doc, "translation", [0, 1], [[1, 0, 0]] * 2)
    animated(doc, "translation", [0, 1], [[2, 0, 0]] * 2)
    animated(doc, "weights", [0, 1], [0, 1])
    animated(doc, "scale", [1, 1], [[2, 0, 0]] * 2)
    animated(doc, "scale", [0, math.inf], [[2, 0, 0]] * 2)
    animated(doc, "scale", [0, 1], [[2, 0, 0]] * 3)
    animated(doc, "rotation", [0], [[0, 0, 0, 0]])
    animated(doc, "scale", [0], [[1, 1, 1]], node=1)
    animated(doc, "scale", [0], [[1, 1, 1]], node=5)
    scene, report = load_doc(tmp_path, doc)
    (channel,) = scene.roots[0].animation
    np.testing.assert_array_equal(channel.values[0], [1, 0, 0])
    assert scene.roots[1].animation == ()
    codes = [f.code for f in report]
    assert codes.count("animation-dropped") == 4
    assert set(codes) >= {
        "animation-second",
        "animation-path",
        "animation-target",
        "animation-matrix",
    }


def test_a_skin_that_is_not_there_leaves_the_bind_pose(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    doc.json["nodes"] = [{"mesh": 0, "skin": 0}, {"mesh": 0, "skin": 0}]
    scene, report = load_doc(tmp_path, doc)
    np.testing.assert_array_equal(scene.meshes[0].points, TRIANGLE)
    assert {f.code for f in report} == {"gltf-value"}
    assert not scene.skins
