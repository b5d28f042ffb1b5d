"""The painted veil: its kernel, and convolutions that keep the light of the frame."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hdrusd.errors import HdrusdError
from hdrusd.eye.observer import Observer
from hdrusd.glare.cie135 import total_glare
from hdrusd.glare.model import MODELS
from hdrusd.glare.veil import (
    core,
    directions,
    kernel,
    lamp_veil,
    painted,
    pixel_angle,
    pixel_solid_angles,
    plane,
    scattered,
    seen,
)

CIE = MODELS["cie135"]
EYE = Observer()


def fields(hfov: float, size: tuple[int, int]) -> tuple[float, float]:
    """Of square pixels."""
    half = math.tan(math.radians(hfov) / 2.0) * size[1] / size[0]
    return hfov, math.degrees(2.0 * math.atan(half))


def test_pixel_of_a_usual_picture() -> None:
    size = 1920, 1080
    pixel = pixel_angle(size, fields(60.0, size))
    assert pixel == pytest.approx(0.034458056, rel=1e-8)
    assert core(pixel) == 0.1
    assert core(0.5) == pytest.approx(0.6)


def test_kernel_has_a_soft_core() -> None:
    theta = np.array([0.0, 0.02, 0.1, 1.0, 10.0, 100.5])
    wanted = total_glare(np.hypot(theta, 0.1))
    wanted[-1] = 0.0
    np.testing.assert_allclose(kernel(CIE, EYE, 0.03, theta), wanted, rtol=1e-12)
    # What Vos and van den Berg measured is changed by 1 % from 1.2 degrees on.
    np.testing.assert_allclose(kernel(CIE, EYE, 0.03, 1.2), total_glare(1.2), rtol=0.011)


@pytest.mark.parametrize(
    ("age", "pigment", "share"),
    [
        (25.0, 0.5, 0.32102850),
        (35.0, 0.5, 0.32429447),
        (50.0, 0.5, 0.33817739),
        (70.0, 0.5, 0.38881503),
        (35.0, 0.0, 0.30750171),
        (35.0, 1.2, 0.34659635),
    ],
)
def test_scattered_share(age: float, pigment: float, share: float) -> None:
    got = scattered(CIE, Observer(age=age, pigment=pigment), 0.034458)
    assert got == pytest.approx(share, rel=1e-7)


def test_solid_angles_are_those_of_the_pixels_of_a_plane() -> None:
    # A square of 90 x 90 degrees is a sixth of the sphere.
    total = pixel_solid_angles((400, 400), (90.0, 90.0)).sum()
    assert total == pytest.approx(4.0 * math.pi / 6.0, rel=1e-5)
    one = pixel_solid_angles((3, 1), (90.0, 40.0))[0, 1]
    assert one == pytest.approx(4.0 * math.tan(math.radians(20.0)) / 3.0, rel=1e-12)


def test_even_frame_stays_even_to_its_edges() -> None:
    size = 24, 18
    frame = np.full((18, 24, 3), 3.0)
    for function in (painted, seen):
        got = function(frame, fields(40.0, size), CIE, EYE)
        np.testing.assert_allclose(got, 3.0, rtol=1e-12)


def test_what_is_sent_is_what_is_taken() -> None:
    # A kernel of distances is the same both ways, so the sum over the frame stays.
    frame = np.random.default_rng(3).uniform(0.0, 1.0, (40, 64, 2))
    frame[3, 60] = 1e6
    got = painted(frame, fields(50.0, (64, 40)), CIE, EYE)
    assert got.sum() == pytest.approx(frame.sum(), rel=1e-12)


def test_a_lamp_in_the_dark_is_the_kernel_around_it() -> None:
    size = 65, 33
    field = fields(8.0, size)
    pixel = pixel_angle(size, field)
    frame = np.zeros((33, 65, 1))
    frame[16, 32] = 1e5
    got = painted(frame, field, CIE, EYE)[..., 0]
    lux = 1e5 * math.radians(pixel) ** 2
    x = np.abs(np.arange(65) - 32)
    row = lux * kernel(CIE, EYE, pixel, pixel * x)
    np.testing.assert_allclose(np.delete(got[16], 32), np.delete(row, 32), rtol=1e-9)
    # Within 4 degrees, angles of a plane and of the eye differ by 0.2 %, solid angles by 0.7 %.
    true = seen(frame, field, CIE, EYE)[..., 0]
    np.testing.assert_allclose(np.delete(got[16], 32), np.delete(true[16], 32), rtol=0.01)


def test_reading_the_plane_as_angles_errs_at_the_edge() -> None:
    """At 27 degrees a pixel is 0.84 as wide; 1 / theta^2 hides most of it."""
    size = 61, 31
    field = fields(60.0, size)
    frame = np.zeros((31, 61, 1))
    frame[15, 57] = 1e5
    flat, true = (f(frame, field, CIE, EYE)[15, 40:50, 0] for f in (painted, seen))
    np.testing.assert_allclose(flat, true, rtol=0.2)


def test_lamps_by_their_lux() -> None:
    field, size = (60.0, 40.0), (6, 4)
    pixel = pixel_angle(size, field)
    rays = directions(size, field).reshape(-1, 3)
    lamp = np.array([[math.sin(0.8), 0.0, -math.cos(0.8), 2.0, 1.0, 0.5]])
    got = lamp_veil(lamp, rays, CIE, EYE, pixel)
    theta = np.degrees(np.arccos(rays @ lamp[0, :3]))
    wanted = kernel(CIE, EYE, pixel, theta)[:, None] * lamp[0, 3:]
    np.testing.assert_allclose(got, wanted, rtol=1e-9)
    both = lamp_veil(np.concatenate([lamp, lamp]), rays, CIE, EYE, pixel)
    np.testing.assert_allclose(both, 2.0 * got, rtol=1e-12)


@pytest.mark.parametrize("field", [(0.0, 40.0), (60.0, 180.0), (math.nan, 40.0), (-3.0, 40.0)])
def test_no_such_field(field: tuple[float, float]) -> None:
    with pytest.raises(HdrusdError, match="field of view"):
        plane(field)


def test_no_point_spread() -> None:
    with pytest.raises(HdrusdError, match="ward97"):
        kernel(MODELS["ward97"], EYE, 0.1, 1.0)
