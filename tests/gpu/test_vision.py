"""Acuity on the GPU against its definition in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hdrusd.eye.acuity import acuity_blur, acuity_levels, between_samples, mip_texel, resolvable
from hdrusd.eye.foveal import Foveal, foveal
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.program import Programs
from hdrusd.gpu.vision import AcuityPass

rng = np.random.default_rng(1937)

#: One rounding to float32, relative.
R = 2.0**-24


def scene(height: int, width: int) -> np.ndarray:
    """From dark on the left to bright on the right, every pixel its own: (h, w, 4)."""
    texture = 10.0 ** rng.uniform(-1, 1, (height, width, 4))
    return (texture * np.logspace(-4, 1, width)[None, :, None]).astype(np.float32)


def seen(
    gl: Any, image: np.ndarray, frame: Foveal, *, top_first: bool = True
) -> tuple[np.ndarray, bool]:
    """What the pass makes of an image (h, w, 4), top row first; and whether it made anything."""
    height, width = image.shape[:2]
    rows = slice(None, None, 1 if top_first else -1)
    hdr = gl.texture((width, height), 4, np.ascontiguousarray(image[rows]), dtype="f4")
    acuity = AcuityPass(gl, Programs(gl))
    try:
        result = acuity.apply(hdr, frame, top_first=top_first)
        pixels = np.frombuffer(result.read(), np.float32).reshape(height, width, 4)
        return pixels[rows].astype(np.float64), result is not hdr
    finally:
        acuity.release()
        hdr.release()


#: Width, height, degrees: odd sides at all levels, several pairs of levels, a frame of few pixels.
FRAMES = [
    (301, 64, (2.0, 0.4)),
    (255, 129, (1.0, 0.5)),
    (160, 90, (5.0, 3.0)),
    (7, 5, (0.05, 0.05)),
]


@pytest.mark.parametrize("top_first", [True, False])
@pytest.mark.parametrize(("width", "height", "field"), FRAMES)
def test_the_frame_is_that_of_numpy(
    gl: Any, width: int, height: int, field: tuple[float, float], *, top_first: bool
) -> None:
    image = scene(height, width)
    frame = foveal(image[..., :3], field)
    samples = acuity_levels(frame, (width, height))
    assert samples is not None
    assert samples.max() > 0.2
    got, made = seen(gl, image, frame, top_first=top_first)
    assert made
    wanted = acuity_blur(image.astype(np.float64), frame)
    # A level is off by the roundings of a sample's number, 16 at most, times the step between
    # samples; it moves a pixel by as much of what its levels differ, and shares of texels are
    # off by a rounding of their place. The scene's neighbours differ by a factor of 100 at most.
    assert got == pytest.approx(wanted, rel=1e-3)
    assert np.median(np.abs(got / wanted - 1.0)) < 1e-6


def test_a_pass_sees_frames_of_other_sizes(gl: Any) -> None:
    acuity = AcuityPass(gl, Programs(gl))
    for width, height, field in (FRAMES[0], FRAMES[3], FRAMES[1], FRAMES[0]):
        image = scene(height, width)
        frame = foveal(image[..., :3], field)
        hdr = gl.texture((width, height), 4, image, dtype="f4")
        pixels = np.frombuffer(acuity.apply(hdr, frame, top_first=True).read(), np.float32)
        wanted = acuity_blur(image.astype(np.float64), frame)
        assert pixels.reshape(wanted.shape) == pytest.approx(wanted, rel=1e-3)
        hdr.release()
    acuity.release()


def test_what_the_eye_resolves_is_the_frame_itself(gl: Any) -> None:
    image = scene(48, 64) * np.float32(1e6)
    got, made = seen(gl, image, foveal(image[..., :3], (5.0, 4.0)))
    assert not made
    assert (got == image).all()


def test_sharp_pixels_beside_blurred_ones_are_untouched(gl: Any) -> None:
    image = scene(64, 301)
    frame = foveal(image[..., :3], (8.0, 1.7))
    samples = acuity_levels(frame, (301, 64))
    assert samples is not None
    sharp = between_samples(samples, (301, 64)) < -1e-3
    assert 0.2 < sharp.mean() < 0.8
    got, _ = seen(gl, image, frame)
    assert (got[sharp] == image[sharp]).all()


def test_lost_pixels_do_not_spread(gl: Any) -> None:
    image = scene(64, 128)
    frame = foveal(image[..., :3], (1.0, 0.5))
    image[20, 30, :3], image[40, 50, 0] = np.nan, np.inf
    got, _ = seen(gl, image, frame)
    assert np.isfinite(got).all()
    image[20, 30, :3] = 0.0
    black, _ = seen(gl, image, frame)
    assert (got == black).all()


def test_another_texture_is_refused(gl: Any) -> None:
    hdr = gl.texture((4, 4), 3, dtype="f4")
    frame = Foveal(np.ones((2, 2, 3)), np.zeros(0), (1.0, 1.0))
    with pytest.raises(ValueError, match="3 components; want RGBA"):
        AcuityPass(gl, Programs(gl)).apply(hdr, frame)
    hdr.release()


def test_between_texels_as_numpy(gl: Any, write_shader: Callable[..., str]) -> None:
    name = write_shader("texels.glsl", "uniform sampler2D image;", "uniform vec2 texel;")
    width, height = 13, 9
    image = 10.0 ** rng.uniform(-4, 4, (height, width, 4)).astype(np.float32)
    place = rng.uniform((-3, -3), (width + 3, height + 3), (4096, 2)).astype(np.float32)
    got = evaluate(
        gl,
        [name, "eye/acuity.glsl"],
        "mip_texel(image, place, texel)",
        {"place": place},
        "vec4",
        uniforms={"image": image, "texel": (1.0 / width, 1.0 / height)},
    )
    wanted = mip_texel(image.astype(np.float64), place.astype(np.float64))
    # place - 0.5 rounds for a place above -0.5 only once, by 8 R; shares count the difference.
    assert (np.abs(got - wanted) <= 2 * 8 * R * image.max() + 6 * R * wanted).all()


def test_acuity_in_the_dark_hides_a_grating(gl: Any) -> None:
    # Bars of one pixel at twice the finest grating vanish; those of half its frequency stay.
    for factor, contrast in ((2.0, (0.0, 0.2)), (0.25, (0.6, 1.0))):
        cycles = factor * float(resolvable(1e-3))
        width = 64 / cycles  # degrees of 64 cycles
        bars = np.tile(np.repeat([0.5e-3, 1.5e-3], 4), 64)
        image = np.broadcast_to(bars[None, :, None], (32, 512, 4)).astype(np.float32)
        frame = Foveal(np.full((1, 1, 3), 1e-3), np.zeros(0), (width, width / 16))
        got, _ = seen(gl, np.ascontiguousarray(image), frame)
        row = got[16, 128:-128, 0]
        found = (row.max() - row.min()) / (row.max() + row.min()) / 0.5
        assert contrast[0] <= found <= contrast[1]
