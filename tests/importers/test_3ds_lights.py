"""Lights and cameras of 3D Studio."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tds_builder import (
    CAMERA_NODE,
    CAMERA_TARGET,
    OBJECT_NODE,
    OMNI_NODE,
    SPOT_NODE,
    SPOT_TARGET,
    Loaded,
    camera,
    chunk,
    file,
    floats,
    load_bytes,
    node,
    omni,
    position,
    spot,
    square,
    text,
    track,
)

from hdrusd.importers.tds_aim import aim
from hdrusd.importers.tds_nodes import matrix
from hdrusd.legacy.scene import Node
from hdrusd.photometry.estimate import reference_distance
from hdrusd.report import Kind

RED = chunk(0x0010, floats(1.0, 0.5, 0.25))


def lit(tmp_path: Path, *parts: bytes, keyframer: tuple[bytes, ...] = ()) -> Loaded:
    """One light at (1, 2, 3)."""
    return load_bytes(tmp_path, file(omni("L", (1, 2, 3), *parts), keyframer=keyframer))


def axes(found: Node) -> Any:
    """Where a node's own axes point, row by row, at the first frame."""
    return matrix(found)[:3, :3]


def test_an_omni_light(tmp_path: Path) -> None:
    loaded = lit(tmp_path, RED, chunk(0x465B, floats(2.0)))
    found = loaded.light
    assert (found.kind, found.enabled, found.spot_cutoff) == ("point", True, 180.0)
    assert found.diffuse == found.specular == (2.0, 1.0, 0.5)
    assert found.attenuation == (1.0, 0.0, 0.0)  # no DL_ATTENUATE: strong over any distance
    assert found.range is None
    assert found.extras["color"] == (1.0, 0.5, 0.25)
    np.testing.assert_array_equal(matrix(loaded.root)[3, :3], (1, 2, 3))


def test_a_light_that_is_off_stays_off(tmp_path: Path) -> None:
    assert not lit(tmp_path, RED, chunk(0x4620)).light.enabled


def test_ranges_count_only_where_they_are_switched_on(tmp_path: Path) -> None:
    ranges = chunk(0x4659, floats(5.0)), chunk(0x465A, floats(25.0))
    quiet = lit(tmp_path, RED, *ranges)
    assert quiet.light.extras["outer_range"] == 25.0
    assert quiet.light.range is None
    loaded = lit(tmp_path, RED, *ranges, chunk(0x4625), chunk(0x0010))
    assert loaded.light.range == 25.0
    assert reference_distance(loaded.light, 100.0) == pytest.approx(15.0)  # half of it is there
    assert loaded.finding("3ds-light-range").kind is Kind.REPLACED
    broken = lit(tmp_path, RED, chunk(0x4625))
    assert broken.light.attenuation == (1.0, 0.0, 0.0)
    assert broken.finding("3ds-light-range").kind is Kind.INVALID


def test_ranges_are_in_metres(tmp_path: Path) -> None:
    parts = RED, chunk(0x465A, floats(40.0)), chunk(0x4625)
    content = file(chunk(0x0100, floats(0.5)), omni("L", (0, 0, 0), *parts))
    assert load_bytes(tmp_path, content).light.range == 20.0


def test_a_spotlight_has_half_angles_and_looks_at_its_target(tmp_path: Path) -> None:
    loaded = lit(tmp_path, RED, spot((1, 2, 0), 100.0, 140.0))
    found = loaded.light
    assert (found.kind, found.spot_inner, found.spot_cutoff) == ("spot", 50.0, 70.0)
    assert found.direction == (0.0, 0.0, -1.0)
    np.testing.assert_allclose(-axes(loaded.root)[2], (0, 0, -1), atol=1e-12)
    assert loaded.finding("3ds-light-edge").kind is Kind.REPLACED
    along = lit(tmp_path, RED, spot((11, 2, 3), 40.0, 40.0))
    np.testing.assert_allclose(-axes(along.root)[2], (1, 0, 0), atol=1e-12)
    assert "3ds-light-edge" not in along.report.codes()


@pytest.mark.parametrize(
    ("hotspot", "falloff", "half"), [(50, 40, (20, 20)), (-1, 400, (0, 180)), (10, -5, (0, 0))]
)
def test_angles_out_of_range_are_clamped(
    tmp_path: Path, hotspot: float, falloff: float, half: tuple[float, float]
) -> None:
    loaded = lit(tmp_path, RED, spot((0, 0, 0), hotspot, falloff))
    assert (loaded.light.spot_inner, loaded.light.spot_cutoff) == half
    assert loaded.finding("3ds-light-angle").kind is Kind.CLAMPED


def test_what_a_light_cannot_keep_is_said(tmp_path: Path) -> None:
    cone = spot((0, 0, 0), 10, 10, chunk(0x4651), chunk(0x4652), chunk(0x4656, floats(30)))
    excluded = chunk(0x4654, text("Wall"))
    loaded = lit(tmp_path, RED, cone, excluded, chunk(0x4630), chunk(0x4641))
    assert loaded.finding("3ds-light-cone").text.startswith("rectangular cone, overshoot")
    assert "Wall" in loaded.finding("3ds-light-exclude").text
    assert loaded.light.extras["excluded"] == ("Wall",)
    assert loaded.light.extras["roll"] == 30.0
    assert "3ds-dropped" not in loaded.report.codes()  # how shadows are made says nothing here


def test_the_keyframers_colour_and_cone_go_first(tmp_path: Path) -> None:
    tracks = [position((0, (7, 8, 9))), track(0xB025, (0, (0, 1, 0)))]
    tracks += [track(0xB027, (0, (20,))), track(0xB028, (0, (30,)))]
    nodes = (
        node(SPOT_NODE, "L", 0, *tracks),
        node(SPOT_TARGET, "L", 1, position((0, (7, 20, 9)))),
    )
    loaded = lit(tmp_path, RED, spot((1, 2, 0), 100.0, 140.0), keyframer=nodes)
    assert loaded.light.diffuse == (0.0, 1.0, 0.0)
    assert (loaded.light.spot_inner, loaded.light.spot_cutoff) == (10.0, 15.0)
    np.testing.assert_array_equal(matrix(loaded.root)[3, :3], (7, 8, 9))
    np.testing.assert_allclose(-axes(loaded.root)[2], (0, 1, 0), atol=1e-12)


def test_colours_that_change_are_said(tmp_path: Path) -> None:
    tracks = track(0xB025, (0, (0, 1, 0)), (30, (1, 0, 0)))
    loaded = lit(tmp_path, RED, keyframer=(node(OMNI_NODE, "L", 0, tracks),))
    assert loaded.light.diffuse == (0.0, 1.0, 0.0)
    assert loaded.finding("3ds-track-dropped").thing == "L"
    np.testing.assert_array_equal(matrix(loaded.root)[3, :3], (1, 2, 3))  # as in the editor


# -- cameras --------------------------------------------------------------------------------


def test_a_lens_is_2400_by_the_width_of_the_field(tmp_path: Path) -> None:
    """53.33 mm are the 45 degrees that 3ds Max writes beside them."""
    loaded = load_bytes(tmp_path, file(camera("C", (0, -10, 0), (0, 0, 0), lens=2400 / 45)))
    (found,) = loaded.scene.cameras
    assert found.aspect == pytest.approx(16 / 9)
    across = 2 * math.atan(math.tan(math.radians(found.fov_y) / 2) * found.aspect)
    assert math.degrees(across) == pytest.approx(45.0, rel=1e-6)
    assert found.near < 10 < found.far
    assert loaded.finding("3ds-camera-frame").kind is Kind.ASSUMED


def test_a_camera_looks_at_its_target_with_z_up(tmp_path: Path) -> None:
    loaded = load_bytes(tmp_path, file(camera("C", (5, -10, 2), (5, 0, 2))))
    right, up, back = axes(loaded.root)
    np.testing.assert_allclose((right, up, back), [(1, 0, 0), (0, 0, 1), (0, -1, 0)], atol=1e-12)
    np.testing.assert_array_equal(matrix(loaded.root)[3, :3], (5, -10, 2))


def test_a_roll_turns_clockwise(tmp_path: Path) -> None:
    loaded = load_bytes(tmp_path, file(camera("C", (0, -10, 0), (0, 0, 0), roll=90.0)))
    np.testing.assert_allclose(axes(loaded.root)[1], (1, 0, 0), atol=1e-12)  # up is right


def test_straight_down_and_nowhere(tmp_path: Path) -> None:
    down = load_bytes(tmp_path, file(camera("C", (0, 0, 10), (0, 0, 0))))
    np.testing.assert_allclose(axes(down.root)[2], (0, 0, 1), atol=1e-12)
    nowhere = load_bytes(tmp_path, file(camera("C", (1, 1, 1), (1, 1, 1))))
    np.testing.assert_allclose(-axes(nowhere.root)[2], (0, 1, 0), atol=1e-12)


@pytest.mark.parametrize("lens", [0.0, -5.0, 1.0])
def test_a_lens_that_is_none(tmp_path: Path, lens: float) -> None:
    loaded = load_bytes(tmp_path, file(camera("C", (0, -10, 0), (0, 0, 0), lens=lens)))
    assert 0.0 < loaded.scene.cameras[0].fov_y < 180.0
    assert loaded.finding("3ds-camera").kind is Kind.INVALID


def test_a_camera_follows_its_target(tmp_path: Path) -> None:
    """At rest at the origin; the target goes from +X to +Y on a straight line."""
    nodes = [
        node(CAMERA_NODE, "C", 0, position((0, (0, 0, 0))), track(0xB023, (0, (60,)))),
        node(CAMERA_TARGET, "C", 1, position((0, (1, 0, 0)), (30, (0, 1, 0)))),
    ]
    content = file(camera("C", (9, 9, 9), (8, 8, 8)), keyframer=nodes)
    loaded = load_bytes(tmp_path, content)
    (channel,) = loaded.root.animation
    assert channel.path == "rotation"
    np.testing.assert_allclose(channel.times, np.arange(31) / 30)
    share = np.arange(31) / 30
    wanted = np.stack([1 - share, share, 0 * share], axis=1)
    np.testing.assert_allclose(
        channel.values, aim(np.zeros((31, 3)), wanted, np.zeros(31)), atol=1e-7
    )
    across = math.tan(math.radians(loaded.scene.cameras[0].fov_y) / 2) * 16 / 9
    assert math.degrees(2 * math.atan(across)) == pytest.approx(60.0)


def test_a_camera_in_a_car_looks_at_what_stands_outside(tmp_path: Path) -> None:
    """The camera hangs on a node at (10, 0, 0); its target is in the world."""
    nodes = [
        node(OBJECT_NODE, "S", 0, position((0, (10, 0, 0)))),
        node(CAMERA_NODE, "C", 1, position((0, (0, 0, 0))), parent=0),
        node(CAMERA_TARGET, "C", 2, position((0, (10, 5, 0)))),
    ]
    content = file(square("S"), camera("C", (0, 0, 0), (0, 1, 0)), keyframer=nodes)
    (inside,) = load_bytes(tmp_path, content).root.children
    np.testing.assert_allclose(-axes(inside)[2], (0, 1, 0), atol=1e-12)
