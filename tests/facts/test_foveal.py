"""The foveal image: its size by the field of view, its means, its points, its weights."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import BRIGHTEST, luminance
from hdrusd.eye.foveal import (
    MOST,
    Foveal,
    borders,
    centre_weights,
    default_field,
    directions,
    foveal,
    foveal_size,
    gaze_weights,
    grid,
    log_mean,
    point_pixels,
)

WIDE = (60.0, 34.0)


def test_one_sample_a_degree_at_the_centre() -> None:
    # 2 tan(30 deg) / (pi / 180) = 66.16, 2 tan(17 deg) / (pi / 180) = 35.03.
    assert foveal_size(WIDE) == (66, 35)
    # 2 tan(45 deg) / (pi / 180) = 114.6
    assert foveal_size((90.0, 1.0)) == (115, 2)
    assert foveal_size((0.0, 0.0)) == (2, 2)
    assert foveal_size((1e9, 179.9)) == (MOST, MOST)


def test_unknown_camera_is_forty_degrees() -> None:
    across, down = default_field(1920, 1080)
    assert across == pytest.approx(40.0)
    assert math.tan(math.radians(down / 2)) == pytest.approx(0.5625 * math.tan(math.radians(20)))
    assert default_field(100, 200)[1] == pytest.approx(40.0)


def test_means_of_a_small_frame() -> None:
    # 6 x 4 pixels in 3 x 2 samples: each is the mean of 2 x 2 pixels.
    frame = np.arange(72.0).reshape(4, 6, 3)
    field = (math.degrees(2 * math.atan(1.5 * math.pi / 180)), 2.0)
    got = foveal(frame, field)
    assert got.rgb.shape == (2, 3, 3)
    np.testing.assert_allclose(got.rgb, frame.reshape(2, 2, 3, 2, 3).mean(axis=(1, 3)), rtol=1e-15)
    np.testing.assert_allclose(got.luminance, luminance(got.rgb), rtol=1e-15)


@given(st.integers(1, 5000), st.data())
def test_borders_share_out_all_pixels(pixels: int, data: st.DataObject) -> None:
    samples = data.draw(st.integers(1, min(pixels, MOST)))
    found = borders(pixels, samples)
    assert found[0] == 0
    assert found[-1] == pixels
    sizes = np.diff(found)
    assert sizes.min() >= 1
    assert sizes.max() - sizes.min() <= 1
    # Nearest whole pixel to where the border would be.
    assert np.abs(found - np.arange(samples + 1) * pixels / samples).max() <= 0.5


@given(st.integers(1, 70), st.integers(1, 70), st.integers(1, 40))
def test_samples_weighted_by_area_are_the_frame(width: int, height: int, degrees: int) -> None:
    random = np.random.default_rng(width + 100 * height)
    frame = random.uniform(0.0, 10.0, (height, width, 3))
    got = foveal(frame, (float(degrees), 20.0))
    fh, fw = got.rgb.shape[:2]
    areas = np.diff(borders(height, fh))[:, None] * np.diff(borders(width, fw))
    mean = (got.rgb * areas[..., None]).sum(axis=(0, 1)) / areas.sum()
    np.testing.assert_allclose(mean, frame.mean(axis=(0, 1)), rtol=1e-12)


def test_points_are_pixels_in_their_cells() -> None:
    width, height, size = 1920, 1080, (66, 37)
    x, y = point_pixels(width, height, size).T
    assert x.size == 16 * 66 * 37
    column, row = np.tile(np.arange(264), 148), np.repeat(np.arange(148), 264)
    # A cell is 7.3 x 7.3 pixels; its first pixel may begin in the cell before it.
    assert (x >= np.floor(column * width / 264)).all()
    assert (x <= (column + 1) * width / 264).all()
    assert (y >= np.floor(row * height / 148)).all()
    assert (y <= (row + 1) * height / 148).all()
    # At random: as far from the cells' beginnings as from their ends, in both directions, and
    # one does not follow from the other. Three standard errors of 39,072.
    for place, cell, pixels in ((x, column, width / 264), (y, row, height / 148)):
        offset = (place + 0.5) / pixels - cell
        assert offset.mean() == pytest.approx(0.5, abs=3 * 0.29 / math.sqrt(x.size))
    correlation = np.corrcoef(x / (width / 264) - column, y / (height / 148) - row)[0, 1]
    assert abs(correlation) < 3 / math.sqrt(x.size)


def test_points_are_the_same_every_time() -> None:
    frame = np.random.default_rng(1).uniform(0.0, 1.0, (200, 300, 3))
    assert (foveal(frame, WIDE).points == foveal(frame.copy(), WIDE).points).all()


def test_all_pixels_of_a_small_frame() -> None:
    frame = np.random.default_rng(1).uniform(0.0, 1.0, (20, 30, 3))
    got = foveal(frame, WIDE)
    np.testing.assert_allclose(got.points, luminance(frame).ravel(), rtol=1e-14)
    assert grid(30, 20, WIDE) == (30, 20)


def test_a_small_lamp_is_in_a_mean_for_certain() -> None:
    frame = np.full((540, 960, 3), 0.1)
    frame[123, 456] = 1e5
    got = foveal(frame, WIDE)
    area = np.max(np.diff(borders(540, 35))) * np.max(np.diff(borders(960, 66)))
    assert got.luminance.max() >= 1e5 / area


def test_broken_pixels_count_as_black() -> None:
    frame = np.ones((8, 8, 3))
    frame[0, 0], frame[1, 1], frame[2, 2] = np.nan, -5.0, np.inf
    got = foveal(frame, (4.0, 4.0))
    assert np.isfinite(got.rgb).all()
    assert got.rgb[0, 0, 0] == 0.5  # two of four
    assert got.rgb[1, 1, 0] == pytest.approx(BRIGHTEST / 4)


def test_directions() -> None:
    rays = directions((66, 37), (60.0, 35.983398))
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1.0, rtol=1e-15)
    x, y, z = np.moveaxis(rays, -1, 0)
    # Half a sample inside the field's edges, the first row on top.
    assert x[0, -1] / -z[0, -1] == pytest.approx(math.tan(math.radians(30)) * 65 / 66)
    assert y[0, 0] / -z[0, 0] == pytest.approx(math.tan(math.radians(17.991699)) * 36 / 37)
    np.testing.assert_allclose(rays[18], rays[18] * [1, 0, 1], atol=1e-15)
    # One sample a degree at the centre.
    angle = math.degrees(math.acos(float(rays[18, 32] @ rays[18, 33])))
    assert angle == pytest.approx(1.0, rel=0.01)


def test_weights() -> None:
    centre = centre_weights((91, 3))
    assert centre[1, 45] == 1.0
    # 45 samples from the centre: 1 - 0.25.
    assert centre[1, 0] == pytest.approx(0.75)
    assert centre[0, 45] == pytest.approx(1.0 - 1.0 / 8100.0)
    assert centre_weights((256, 256)).min() == 0.0
    field = (math.degrees(2 * math.atan(math.tan(math.radians(10.0)) * 1.5)), 20.0)
    gaze = gaze_weights((3, 3), field)
    assert gaze[1, 1] == 1.0
    # The outer columns are 10 degrees away, one standard deviation.
    assert gaze[1, 0] == pytest.approx(math.exp(-0.5))


def test_log_mean() -> None:
    assert log_mean([1.0, 100.0]) == pytest.approx(10.0)
    assert log_mean([1.0, 100.0], [3.0, 1.0]) == pytest.approx(10.0**0.5)
    # Black says nothing about what an eye adapts to, until there is nothing else.
    assert log_mean([0.0, 4.0]) == pytest.approx(4.0)
    assert log_mean([0.0, 0.0]) == 1e-6
    assert log_mean([[2.0, 2.0]], [[0.5, 0.1]]) == pytest.approx(2.0)


def test_is_a_value() -> None:
    one = foveal(np.ones((4, 4, 3)), WIDE)
    assert isinstance(one, Foveal)
    with pytest.raises(AttributeError):
        one.field = (1.0, 1.0)  # type: ignore[misc]
