"""Light in pictures: made ones with known content, and how few of other people's are suspected."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hdrusd.errors import HdrusdError
from hdrusd.images import read_image
from hdrusd.photometry.baked import baked_lamps, baked_shadow

Array = npt.NDArray[Any]

SIZE = 256
X, Y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)


def linear(codes: Array) -> Array:
    """T^2.2 of 8-bit codes as a file has them, (h, w) or (h, w, 3)."""
    rounded = np.clip(np.round(codes), 0, 255)
    rounded = rounded if rounded.ndim == 3 else np.repeat(rounded[..., None], 3, axis=2)
    return np.asarray((rounded / 255.0) ** 2.2)


def asphalt(grain: float = 0.0) -> Array:
    """Codes of a grey road, with a grain of that standard deviation."""
    return 100.0 + grain * np.random.default_rng(7).standard_normal((SIZE, SIZE))


def shade(width: float) -> Array:
    """Light on a picture whose left half is in a shadow of a quarter of the light."""
    t = np.clip((X - 0.5) / width + 0.5, 0.0, 1.0)
    return np.asarray(0.25 + 0.75 * t * t * (3.0 - 2.0 * t))


def shaded(codes: Array, width: float) -> Array:
    """Codes under that light: 1/2.2 of its logarithm."""
    return np.asarray(codes * shade(width) ** (1.0 / 2.2))


@pytest.mark.parametrize("grain", [0.0, 12.0])
def test_a_uniform_road_holds_no_light(grain: float) -> None:
    picture = linear(asphalt(grain))
    assert baked_shadow(picture) is None
    assert baked_lamps(picture) == 0


@pytest.mark.parametrize("grain", [0.0, 12.0])
def test_a_soft_shadow_is_suspected_and_its_depth_told(grain: float) -> None:
    found = baked_shadow(linear(shaded(asphalt(grain), 0.6)))
    assert found is not None
    # A quarter of the light; percentiles cut 5 % at both ends, codes are rounded to 1 %.
    assert found.ratio == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("width", [0.05, 0.1, 0.3, 0.5])
def test_a_painted_line_is_not_suspected(width: float) -> None:
    codes = asphalt(6.0)
    codes[np.abs(X - 0.5) < width / 2] = 230.0
    assert baked_shadow(linear(codes)) is None


def test_a_zebra_crossing_is_not_suspected() -> None:
    codes = np.where((X * 8).astype(int) % 2 == 0, 90.0, 220.0)
    assert baked_shadow(linear(codes)) is None


def test_a_change_of_colour_is_no_shadow() -> None:
    t = X[..., None]
    sky = (1 - t) * np.array([240.0, 240.0, 240.0]) + t * np.array([40.0, 90.0, 200.0])
    assert baked_shadow(linear(sky)) is None


def test_a_faint_shade_is_not_told() -> None:
    assert baked_shadow(linear(asphalt() * (1.0 - 0.2 * X))) is None  # 0.8^2.2 = 0.61 of the light


def test_small_pictures_say_nothing() -> None:
    assert baked_shadow(linear(shaded(asphalt(), 0.6))[:16, :16]) is None


def glow(radius: float) -> Array:
    """Codes of a dark wall with a lamp whose light falls off over a radius, in texels."""
    away = np.hypot(X - 0.5, Y - 0.5) * SIZE
    light = 1.0 / (1.0 + (np.maximum(away - 4.0, 0.0) / radius) ** 2)
    return np.asarray(255.0 * np.maximum(light, 0.01) ** (1.0 / 2.2))


def test_a_glowing_lamp_is_suspected() -> None:
    # Full within 4 texels and as far as rounding keeps code 250: 0.957 of the light.
    full = np.pi * (4.0 + 6.0 * np.sqrt(1 / 0.957 - 1)) ** 2
    assert baked_lamps(linear(glow(6.0))) == pytest.approx(full, rel=0.1)


def test_a_white_dot_is_not_suspected() -> None:
    codes = np.full((SIZE, SIZE), 40.0)
    codes[np.hypot(X - 0.5, Y - 0.5) * SIZE < 8.0] = 255.0
    assert baked_lamps(linear(codes)) == 0


def test_a_white_wall_is_no_lamp() -> None:
    assert baked_lamps(np.ones((SIZE, SIZE, 3))) == 0


def test_few_pictures_of_other_people_are_suspected(testdata: Path) -> None:
    suspected, count = [], 0
    for path in sorted((testdata / "data").rglob("*")):
        if path.suffix.lower() not in (".png", ".jpg", ".jpeg", ".tga", ".rgb"):
            continue
        try:
            pixels = read_image(path).pixels
        except HdrusdError:
            continue
        if pixels.dtype != np.uint8 or max(pixels.shape) > 2048:
            continue
        colour = pixels[..., :1] if pixels.shape[2] < 3 else pixels[..., :3]
        picture = np.broadcast_to((colour / 255.0) ** 2.2, (*pixels.shape[:2], 3))
        count += 1
        if baked_shadow(picture) is not None or baked_lamps(picture):
            suspected.append(path.name)
    assert count > 200
    assert len(suspected) <= 0.01 * count, suspected  # nobody would read more
