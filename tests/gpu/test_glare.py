"""The veil drawn on the GPU against the pyramid in NumPy, its definition."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.errors import HdrusdError
from hdrusd.eye.observer import Observer
from hdrusd.glare.model import MODELS
from hdrusd.glare.pyramid import pyramid
from hdrusd.glare.veil import painted
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.glare import GlarePass
from hdrusd.gpu.program import Programs

EYE = Observer()
FIELD = 50.0, 32.0


def close(size: tuple[int, int]) -> float:
    """Relative error of float32.

    Thirty roundings a level at most, fewer than eleven levels; the matrix is float32 in both.
    A place in a texture that is enlarged is a share of its size, rounded twice: that many
    texels, times how much neighbours differ, which is less than what they are.
    """
    return float((30 * 11 + 2 * max(size)) * 2.0**-24)


def texture(gl: Any, rgb: np.ndarray) -> Any:
    """Bottom row first."""
    data = np.ascontiguousarray(rgb[::-1], np.float32)
    return gl.texture((rgb.shape[1], rgb.shape[0]), rgb.shape[2], data, dtype="f4", alignment=1)


def read(veiled: Any) -> np.ndarray:
    """(h, w, 4), top row first."""
    return np.frombuffer(veiled.read(), np.float32).reshape(veiled.height, veiled.width, 4)[::-1]


def night(height: int, width: int) -> np.ndarray:
    """Six decades, a lamp that half floats cannot hold, and every hue."""
    random = np.random.default_rng(11)
    level = 10.0 ** random.uniform(-4.0, 2.0, (height, width, 1))
    frame = (level * random.uniform(0.1, 1.0, (height, width, 3))).astype(np.float32)
    frame[height // 3, width // 4] = (1e7, 8e6, 5e6)
    return frame


def lamp(degrees: float, up: float, *lux: float) -> list[float]:
    a, b = math.radians(degrees), math.radians(up)
    return [math.sin(a) * math.cos(b), math.sin(b), -math.cos(a) * math.cos(b), *lux]


#: In the frame, just outside it, to the side, and behind.
LAMPS = np.array(
    [
        lamp(3.0, -2.0, 0.2, 0.1, 0.05),
        lamp(25.4, 4.0, 3.0, 2.0, 1.0),
        lamp(70.0, 10.0, 9.0, 8.0, 7.0),
        lamp(98.0, 0.0, 50.0, 50.0, 50.0),
        lamp(170.0, 0.0, 50.0, 50.0, 50.0),
    ]
)


@pytest.mark.parametrize("name", ["cie135", "spencer95", "ward97"])
@pytest.mark.parametrize(
    ("size", "field"),
    [
        ((64, 36), FIELD),
        ((333, 211), FIELD),
        ((1, 1), FIELD),
        ((5, 2), FIELD),
        ((1, 130), FIELD),
        ((640, 360), (15.0, 8.5)),  # as fine as 2560 pixels: starts at level 1
        ((301, 200), (1.0, 0.7)),  # and at level 3
        ((90, 60), (120.0, 100.0)),
    ],
)
def test_equal_to_numpy(
    gl: Any, name: str, size: tuple[int, int], field: tuple[float, float]
) -> None:
    model = MODELS[name]
    frame = night(size[1], size[0])
    glare = GlarePass(gl, Programs(gl))
    for lamps in (None, LAMPS):
        got = read(glare.veil(texture(gl, frame), field, model, EYE, lamps))[..., :3]
        wanted = pyramid(model, EYE, size, field).paint(frame, lamps)
        np.testing.assert_allclose(got, wanted, rtol=close(size), atol=1e-12)
    glare.release()


def test_close_to_the_convolution(gl: Any) -> None:
    frame = np.full((160, 256, 3), 0.1, np.float32)
    random = np.random.default_rng(9)
    frame[random.integers(0, 160, 30), random.integers(0, 256, 30)] = 1e4
    field = 10.0, 2.0 * math.degrees(math.atan(math.tan(math.radians(5.0)) * 160 / 256))
    veiled = GlarePass(gl, Programs(gl)).veil(texture(gl, frame), field, MODELS["cie135"], EYE)
    wanted = painted(frame, field, MODELS["cie135"], EYE)
    got = read(veiled)[..., :3]
    # As tests/facts/test_glare_pyramid.py has it of the definition.
    np.testing.assert_allclose(got, wanted, rtol=0.26)
    assert abs(np.log(got / wanted).mean()) < 0.02


@pytest.mark.parametrize("name", ["cie135", "spencer95", "ward97"])
def test_even_frames_stay_and_light_is_kept(gl: Any, name: str) -> None:
    glare = GlarePass(gl, Programs(gl))
    even = np.full((90, 160, 3), 250.0, np.float32)
    got = read(glare.veil(texture(gl, even), FIELD, MODELS[name], EYE))[..., :3]
    np.testing.assert_allclose(got, even, rtol=close((160, 90)))
    frame = night(90, 160)
    got = read(glare.veil(texture(gl, frame), FIELD, MODELS[name], EYE))[..., :3]
    assert got.sum(dtype=np.float64) == pytest.approx(frame.sum(dtype=np.float64), rel=0.01)


def test_broken_pixels_do_not_spread(gl: Any) -> None:
    frame = night(40, 60)
    sound = frame.copy()
    frame[7, 9], sound[7, 9] = (math.nan, -3.0, -math.inf), 0.0
    model = MODELS["cie135"]
    got = read(GlarePass(gl, Programs(gl)).veil(texture(gl, frame), FIELD, model, EYE))
    wanted = pyramid(model, EYE, (60, 40), FIELD).paint(sound)
    np.testing.assert_allclose(got[..., :3], wanted, rtol=close((60, 40)))


def test_alpha_stays_and_the_frame_too(gl: Any) -> None:
    frame = np.concatenate([night(20, 30), np.zeros((20, 30, 1), np.float32)], axis=-1)
    frame[3:9, 4:20, 3] = 1.0
    hdr = texture(gl, frame)
    veiled = read(GlarePass(gl, Programs(gl)).veil(hdr, FIELD, MODELS["cie135"], EYE))
    np.testing.assert_array_equal(veiled[..., 3], frame[..., 3])
    np.testing.assert_array_equal(read(hdr), frame)
    # A does not count: what is behind everything has its light too.
    alone = pyramid(MODELS["cie135"], EYE, (30, 20), FIELD).paint(frame[..., :3])
    np.testing.assert_allclose(veiled[..., :3], alone, rtol=close((30, 20)))


def test_sizes_models_and_eyes_in_turn(gl: Any) -> None:
    glare = GlarePass(gl, Programs(gl))
    old = Observer(age=70.0, pigment=1.0)
    for size in ((160, 90), (33, 21), (160, 90)):
        frame = night(size[1], size[0])
        for name, eye in (("cie135", EYE), ("ward97", EYE), ("cie135", old)):
            got = read(glare.veil(texture(gl, frame), FIELD, MODELS[name], eye, LAMPS))
            wanted = pyramid(MODELS[name], eye, size, FIELD).paint(frame, LAMPS)
            np.testing.assert_allclose(got[..., :3], wanted, rtol=close(size), atol=1e-12)
    glare.release()
    # The resting framebuffer is bound again: without one this would be an OpenGL error.
    assert evaluate(gl, [], "x * 2.0", {"x": [1.0]}, "float").tolist() == [2.0]


def test_no_such_field(gl: Any) -> None:
    with pytest.raises(HdrusdError, match="field of view"):
        GlarePass(gl, Programs(gl)).veil(
            texture(gl, night(4, 4)), (200.0, 30.0), MODELS["cie135"], EYE
        )
