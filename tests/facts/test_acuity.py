"""Acuity: the fit to Shlaer's gratings, levels of a mip chain, and the blur."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from hdrusd.eye.acuity import (
    acuity_blur,
    acuity_levels,
    between_samples,
    halve,
    mip_chain,
    mip_texel,
    pixel_angles,
    resolvable,
    top_level,
)
from hdrusd.eye.foveal import Foveal, foveal

rng = np.random.default_rng(1937)


def uniform(luminance: float, field: tuple[float, float], size: tuple[int, int] = (4, 3)) -> Foveal:
    return Foveal(np.full((*size[::-1], 3), luminance), np.zeros(0), field)


def test_the_fit() -> None:
    wanted = [1.8706, 5.3085, 31.5276, 47.5136, 49.9439]
    assert resolvable([1e-4, 0.01, 1.0, 100.0, 1e4]) == pytest.approx(wanted, abs=5e-5)
    # Held below 1e-5 cd/m2, and rising up to 60 cycles a degree at most.
    assert resolvable(0.0) == resolvable(1e-5)
    steps = np.diff(resolvable(np.logspace(-5, 6, 200)))
    assert (steps > 0.0).all()


def test_a_pixel_is_smaller_away_from_the_middle() -> None:
    # Solid angle of a pixel of a plane: cos^3, so its side goes by cos^1.5.
    frame = uniform(1.0, (90.0, 90.0), (3, 3))
    angles = pixel_angles(frame, (1000, 1000))
    middle = math.degrees(2.0 * math.tan(math.radians(45.0)) / 1000)
    assert angles[1, 1] == pytest.approx(middle, rel=1e-12)
    cosine = 1.0 / math.sqrt(1.0 + 2 * (2 / 3) ** 2)
    assert angles[0, 0] == pytest.approx(middle * cosine**1.5, rel=1e-12)


def test_a_level_halves_the_finest_grating() -> None:
    # One degree over 1024 pixels; at 0.01 cd/m2 half a cycle is 1 / (2 x 5.3085) degrees.
    frame = uniform(0.01, (1.0, 1.0), (2, 2))
    levels = acuity_levels(frame, (1024, 1024))
    assert levels is not None
    assert levels[0, 0] == pytest.approx(math.log2(1024 / (2 * 5.308549)), abs=1e-3)


def test_sharp_where_five_per_cent_resolve_the_pixels() -> None:
    # 100 pixels over 20 degrees: 2.5 cycles a degree at most, which 0.01 cd/m2 resolves.
    assert acuity_levels(uniform(0.01, (20.0, 20.0)), (100, 100)) is None
    assert acuity_levels(uniform(1e-5, (20.0, 20.0)), (100, 100)) is not None
    # A tenth of the frame in the dark is enough, a fiftieth is not.
    for dark, blurred in ((10, True), (2, False)):
        frame = uniform(1.0, (20.0, 20.0), (100, 1))
        frame.rgb[0, :dark] = 1e-5
        assert (acuity_levels(frame, (100, 100)) is not None) == blurred


@pytest.mark.parametrize(
    ("size", "level"), [((1, 1), 0), ((2, 1), 1), ((3, 2), 2), ((1920, 1080), 11)]
)
def test_the_top_level_is_one_texel(size: tuple[int, int], level: int) -> None:
    assert top_level(size) == level
    chain = mip_chain(np.ones((*size[::-1], 1)), level)
    assert chain[-1].shape == (1, 1, 1)
    assert level == 0 or chain[-2].shape != (1, 1, 1)


def test_levels_are_means_of_boxes() -> None:
    image = rng.uniform(size=(8, 12, 3))
    wanted = image.reshape(4, 2, 6, 2, 3).mean(axis=(1, 3))
    assert halve(image) == pytest.approx(wanted, rel=1e-15)
    # The last column and row of odd sides count twice.
    odd = halve(np.array([[[1.0], [2.0], [5.0]]]))
    assert odd[..., 0].tolist() == [[1.5, 5.0]]


def test_between_texels() -> None:
    image = np.array([[[0.0], [1.0]], [[10.0], [11.0]]])
    at = np.array([[0.5, 0.5], [1.0, 0.5], [1.0, 1.0], [0.0, -3.0], [9.0, 9.0]])
    assert mip_texel(image, at)[:, 0].tolist() == [0.0, 0.5, 5.5, 0.0, 11.0]


def test_samples_are_held_beyond_the_outermost() -> None:
    found = between_samples(np.array([[0.0, 1.0]]), (8, 2))
    wanted = [0.0, 0.0, 0.125, 0.375, 0.625, 0.875, 1.0, 1.0]
    assert found == pytest.approx(np.tile(wanted, (2, 1)), rel=1e-15)


def scene() -> tuple[np.ndarray, tuple[float, float]]:
    """Dark on the left, bright on the right; 1.5 degrees over 150 pixels."""
    image = 10.0 ** rng.uniform(-1, 1, (75, 150, 3))
    return image * np.logspace(-4, 3, 150)[None, :, None], (1.5, 0.75)


def test_an_even_field_stays() -> None:
    image = np.full((33, 47, 3), 1e-3)
    found = acuity_blur(image, foveal(image, (0.5, 0.4)))
    assert found == pytest.approx(image, rel=1e-12)


def test_what_the_eye_resolves_stays() -> None:
    image, field = scene()
    bright = image * 1e6
    assert acuity_blur(bright, foveal(bright, field)) == pytest.approx(bright, rel=1e-15)


def test_energy_stays() -> None:
    # A uniform level away from the border: texels are means, and weights of a pixel's add to 1.
    image = np.full((256, 256, 1), 1e-3)
    image[128, 128] = 1.0
    frame = uniform(1e-3, (2.0, 2.0), (2, 2))
    found = acuity_blur(image, frame)
    level = acuity_levels(frame, (256, 256))
    assert level is not None
    assert level.max() > 2.0
    assert found.sum() == pytest.approx(image.sum(), rel=1e-9)
    assert found[128, 128, 0] < 0.05


def test_an_integer_level_is_bilinear_in_it() -> None:
    # 2 x 2^3 pixels to a grating's cycle at the middle: level 3 there.
    image = rng.uniform(1e-3, 2e-3, (64, 64, 3))
    width = 64 / (16.0 * float(resolvable(1e-3)))
    frame = uniform(1e-3, (width, width), (1, 1))
    angle = math.degrees(2.0 * math.tan(math.radians(width / 2.0)) / 64)
    wanted = -math.log2(2.0 * angle * float(resolvable(1e-3)))
    levels = acuity_levels(frame, (64, 64))
    assert levels is not None
    assert levels[0, 0] == pytest.approx(wanted, abs=1e-9)
    assert wanted == pytest.approx(3.0, abs=1e-3)
    third = mip_chain(image, 3)[3]
    place = np.stack(np.meshgrid(*2 * [np.arange(64) + 0.5]), axis=-1) / 8.0
    # A level off by 1e-3 blends so much of the neighbour level in.
    assert acuity_blur(image, frame) == pytest.approx(mip_texel(third, place), abs=2e-6)


def test_lost_pixels_are_black() -> None:
    image, field = scene()
    image[0, 0], image[1, 1] = np.nan, -5.0
    found = acuity_blur(image, foveal(image, field))
    assert np.isfinite(found).all()
    assert (found >= 0.0).all()


def test_vectors(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    tvi = json.loads(text)["2_tvi"]
    assert resolvable(tvi["La"]) == pytest.approx(tvi["acuity cpd"], rel=1e-6)
