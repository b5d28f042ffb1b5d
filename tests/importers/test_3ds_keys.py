"""Tracks of the keyframer: splines and turns, by closed forms and by what 3ds Max wrote."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tds_builder import chunk, load, track

from hdrusd.importers.importer import Limits
from hdrusd.importers.osg_transforms import rotation_matrix
from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.importers.tds_keys import Track, TrackReader, samples, turns, vectors
from hdrusd.report import Report


def read(content: bytes, width: int) -> tuple[Track | None, Report]:
    """The track of one chunk."""
    report = Report()
    document = Document(Path("model.3ds"), content, report, Limits())
    whole = Chunk(0xB020, 0, 6, len(content))
    return TrackReader(document).read(whole, width, "thing"), report


def made(
    frames: list[float], values: list[list[float]], parameters: dict[int, list[float]] | None = None
) -> Track:
    """A track; ``parameters``: tension, continuity, bias, ease to, ease from by key."""
    rows = np.zeros((len(frames), 5))
    for key, row in (parameters or {}).items():
        rows[key] = row
    return Track(Chunk(0, 0, 0, 0), 0, np.array(frames, float), np.array(values, float), rows)


def test_keys_with_and_without_parameters() -> None:
    keys = struct.pack("<IH3f", 0, 0, 1, 2, 3)
    keys += struct.pack("<IH5f3f", 10, 0x1F, 0.5, -0.5, 0.25, 0.125, 1.0, 4, 5, 6)
    keys += struct.pack("<IH1f3f", 20, 0x04, -1.0, 7, 8, 9)
    found, report = read(chunk(0xB020, struct.pack("<H8xI", 3, 3), keys), 3)
    assert found is not None
    assert found.loops
    assert found.frames.tolist() == [0, 10, 20]
    assert found.values.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert found.parameters[1:].tolist() == [[0.5, -0.5, 0.25, 0.125, 1.0], [0, 0, -1, 0, 0]]
    assert len(report) == 0


def test_plain_keys_are_read_alike() -> None:
    found, _ = read(track(0xB020, (0, (1, 2, 3)), (5, (4, 5, 6))), 3)
    assert found is not None
    assert found.values.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert not found.loops


@pytest.mark.parametrize(
    ("content", "keys"),
    [
        (struct.pack("<H8xI", 0, 0xFFFFFFFF) + struct.pack("<IHf", 0, 0, 1), 1),
        (struct.pack("<H8xI", 0, 2) + struct.pack("<IHfIHf", 5, 0, 1, 5, 0, 2), 1),
        (struct.pack("<H8xI", 0, 2) + struct.pack("<IHfIHf", 5, 0, 1, 6, 0, math.inf), 1),
        (struct.pack("<H8xI", 0, 1) + struct.pack("<IHf", 5, 0, math.nan), 0),
        (struct.pack("<H8xI", 0, 2), 0),
        (b"\0" * 5, 0),
    ],
)
def test_broken_tracks(content: bytes, keys: int) -> None:
    found, report = read(chunk(0xB020, content), 1)
    assert (0 if found is None else len(found.frames)) == keys
    assert report.codes() == {"3ds-track"}


def test_two_keys_are_a_straight_line() -> None:
    frames, values = vectors(made([0, 100], [[0.0], [5.0]]))
    assert (frames.tolist(), values.tolist()) == ([0, 100], [[0], [5]])


def test_a_spline_goes_through_its_keys_and_is_a_cubic_between() -> None:
    """Keys of t^2 at 0, 10, 20, 30: between two others the spline is the parabola itself.

    The ends have no curvature: their slope, 50 a span, is 1.5 chords less half the next
    slope, 200, so that halfway it is (0 + 100) / 2 + (50 - 200) / 8.
    """
    keys = [0.0, 10.0, 20.0, 30.0]
    frames, values = vectors(made(keys, [[t * t] for t in keys]))
    np.testing.assert_allclose(frames, np.arange(31))
    np.testing.assert_allclose(values[10:21, 0], frames[10:21] ** 2, atol=1e-10)
    assert values[[0, 5, 30], 0] == pytest.approx([0.0, 31.25, 900.0])


def test_uneven_keys_keep_their_speed() -> None:
    """Keys at 0, 10, 40 of 0, 1, 4: 0.1 a frame throughout, which needs no more samples."""
    frames, values = vectors(made([0, 10, 40], [[0.0], [1.0], [4.0]]))
    assert frames.tolist() == [0, 10, 40]
    assert values[:, 0].tolist() == [0, 1, 4]


def test_full_tension_stops_at_the_key() -> None:
    """Otherwise 0.02 a frame; now 1 - 3 u^2 near the key, with u = 1 / 50 a frame."""
    _, values = vectors(made([0, 50, 100], [[0.0], [1.0], [2.0]], {1: [1.0, 0, 0, 0, 0]}))
    assert abs(np.diff(values[49:52, 0])).max() < 3 * 0.02**2


def test_easing_starts_slowly() -> None:
    """Ease to 1 at the end alone: s = 1 - (1 - u)^2 of the way."""
    frames, values = vectors(made([0, 100], [[0.0], [1.0]], {1: [0, 0, 0, 1.0, 0]}))
    np.testing.assert_allclose(values[:, 0], 1.0 - (1.0 - frames / 100.0) ** 2, atol=1e-12)
    frames, values = vectors(made([0, 100], [[0.0], [1.0]], {0: [0, 0, 0, 0, 1.0]}))
    np.testing.assert_allclose(values[:, 0], (frames / 100.0) ** 2, atol=1e-12)


def test_a_wheel_turns_as_far_as_it_is_said_to() -> None:
    """Two keys, one and a half turns about +Z apart: 5.4 degrees a frame, clockwise."""
    frames, values = turns(made([0, 100], [[0, 0, 0, 1], [3 * math.pi, 0, 0, 1]]))
    np.testing.assert_allclose(frames, np.arange(101))
    angle = -3 * math.pi * frames / 100
    wanted = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    sign = np.sign(np.sum(values * wanted, axis=1))[:, None]
    np.testing.assert_allclose(values * sign, wanted, atol=1e-9)


def test_a_quarter_turn_needs_no_samples_between() -> None:
    frames, values = turns(made([0, 30], [[0, 0, 0, 1], [math.pi / 2, 0, 0, -1]]))
    assert frames.tolist() == [0, 30]
    np.testing.assert_allclose(values[1], (0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4)))


def test_turns_about_one_axis_are_the_spline_of_their_angle() -> None:
    keys = [0.0, 10.0, 20.0, 30.0]
    steps = [0.0, 0.5, 1.0, 0.5]
    frames, values = turns(made(keys, [[step, 0, 0, -1] for step in steps]))
    _, angles = vectors(made(keys, [[angle] for angle in np.cumsum(steps)]))
    np.testing.assert_allclose(2 * np.arcsin(values[:, 2]), angles[:, 0], atol=1e-9)
    np.testing.assert_allclose(frames, np.arange(31))


def test_turns_about_many_axes_pass_through_their_keys() -> None:
    steps = [[0.3, 1, 0, 0], [2.0, 0, 1, 0], [2.5, 0.6, 0, 0.8], [1.0, 0, 0, -1]]
    track_of = made([0, 7, 20, 30], steps)
    frames, values = turns(track_of)
    whole = np.eye(3)
    for frame, (angle, *axis) in zip((0, 7, 20, 30), steps, strict=True):
        half = -angle / 2
        x, y, z = np.array(axis) * math.sin(half)
        whole = whole @ rotation_matrix((x, y, z, math.cos(half)))[:3, :3]
        found = values[frames == frame][0]
        np.testing.assert_allclose(rotation_matrix(tuple(found))[:3, :3], whole, atol=1e-9)
    assert np.abs(np.diff(values, axis=0)).max() < 0.4  # nothing jumps between


def test_an_axis_of_no_length_does_not_turn() -> None:
    _, values = turns(made([0], [[2.0, 0, 0, 0]]))
    assert values.tolist() == [[0, 0, 0, 1]]


@given(st.lists(st.integers(0, 2**32 - 1), min_size=2, max_size=8, unique=True))
def test_samples_are_few_and_rise(frames: list[int]) -> None:
    found = samples(np.array(sorted(frames), float))
    assert len(found) <= 65 * len(frames) + 1
    assert (np.diff(found) > 0).all()
    assert set(frames) <= set(found.tolist())


# -- what 3ds Max wrote ----------------------------------------------------------------------


def test_the_matrix_of_a_mesh_is_that_of_its_keys_at_the_current_frame(testdata: Path) -> None:
    """RotatingCube.3DS: KFCURTIME is 28800 ticks of 160 a frame, so that it is at frame 180.

    Its 182 keys multiplied up must give the mesh's own matrix there, to 32-bit rounding.
    """
    path = testdata / "data" / "assimp" / "3DS" / "RotatingCube.3DS"
    data = path.read_bytes()
    assert struct.unpack_from("<I", data, data.index(b"\x09\xb0\x0a\0\0\0") + 6) == (28800,)
    at = data.index(b"\x60\x41\x36\0\0\0") + 6
    wanted = np.frombuffer(data, "<f4", 12, at).reshape(4, 3)
    scene = load(path).scene
    (channel,) = scene.roots[0].animation
    (turned,) = channel.values[channel.times == 180 / 30]
    np.testing.assert_allclose(rotation_matrix(tuple(turned))[:3, :3], wanted[:3], atol=1e-6)


def test_a_camera_with_a_target_keeps_it_in_the_middle(testdata: Path) -> None:
    """TargetCameraAnim.3ds: at the keys that place and target share, -Z looks at the target."""
    path = testdata / "data" / "assimp" / "3DS" / "TargetCameraAnim.3ds"
    scene = load(path).scene
    (node,) = [root for root in scene.roots if root.cameras]
    channels = {channel.path: channel for channel in node.animation}
    place, turn = channels["translation"], channels["rotation"]
    goals = {0: (14.4292, 28.2159, 0), 30: (14.4292, 28.2159, 0), 60: (100.41, 28.2159, 0)}
    for frame, goal in goals.items():
        (stands,) = place.values[place.times == frame / 30]
        (turned,) = turn.values[turn.times == frame / 30]
        ahead = -rotation_matrix(tuple(turned))[2, :3]
        wanted = np.array(goal) - stands
        np.testing.assert_allclose(ahead, wanted / np.linalg.norm(wanted), atol=1e-5)
