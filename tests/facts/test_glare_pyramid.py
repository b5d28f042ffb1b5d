"""The pyramid of glare: the fit, and what a lamp looks like through it."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from hdrusd.errors import HdrusdError
from hdrusd.eye.observer import Observer
from hdrusd.glare.model import MODELS, GlareModel, angle
from hdrusd.glare.pyramid import (
    EXCESS,
    NODES,
    first_level,
    fitted,
    gaussians,
    nonnegative_least_squares,
    pyramid,
    sigmas,
    weights,
)
from hdrusd.glare.splats import as_lamps
from hdrusd.glare.veil import (
    directions,
    kernel,
    lamp_veil,
    painted,
    pixel_angle,
    pixel_solid_angles,
    scattered,
)

CIE, SPENCER, WARD = (MODELS[name] for name in ("cie135", "spencer95", "ward97"))
EYE = Observer()


def fields(hfov: float, size: tuple[int, int]) -> tuple[float, float]:
    """Of square pixels."""
    half = math.tan(math.radians(hfov) / 2.0) * size[1] / size[0]
    return hfov, math.degrees(2.0 * math.atan(half))


#: Pixels of 1920 across 60 degrees, and what of that picture a test can do with.
PIXEL = pixel_angle((1920, 1080), fields(60.0, (1920, 1080)))
SMALL = 480, 300
FIELD = fields(2.0 * math.degrees(math.atan(math.radians(PIXEL) * 240.0)), SMALL)


def box_sigmas(levels: int) -> np.ndarray:
    """Pixels, of levels of 2 x 2 means, blurred by one texel and enlarged by (1, 3) / 4."""
    power = 4.0 ** np.arange(levels)
    return np.sqrt((power - 1.0) / 3.0 + power)


def test_weights_of_gaussians_computed_elsewhere() -> None:
    found, error = fitted(CIE, EYE, PIXEL, PIXEL * box_sigmas(9))
    wanted = "0.0064128 0.0775825 0.0835976 0.0518288 0.0301037 0.0178883 0.0124289 0.0070795"
    wanted += " 0.0149152"
    np.testing.assert_allclose(found, [float(w) for w in wanted.split()], atol=5e-8)
    assert error < 0.0262
    assert found.sum() < scattered(CIE, EYE, PIXEL)


def test_ten_gaussians_computed_elsewhere() -> None:
    theta = np.geomspace(0.01, 40.0, 1200)
    ratios = gaussians(theta, 0.06 * 2.0 ** np.arange(10)) / kernel(CIE, EYE, 0.01, theta)[:, None]
    found = nonnegative_least_squares(ratios, np.ones(1200))
    wanted = "0.0504690 0.0876699 0.0640314 0.0373849 0.0219185 0.0140898 0.0097211 0.0087686"
    wanted += " 0.0047194 0.0193300"
    np.testing.assert_allclose(found, [float(w) for w in wanted.split()], atol=5e-8)


def test_to_all_their_digits(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    told = json.loads(text)["5_glare"]
    key = "pyramid weights 1920px wide, 60deg hfov (px=0.034458 deg), levels 0..8"
    found = fitted(CIE, EYE, PIXEL, PIXEL * box_sigmas(9))[0]
    np.testing.assert_allclose(found, told[key], rtol=1e-6)
    for theta, wanted in zip(*told["veil kernel (t0=0.1, age35, p.5) at angles"], strict=True):
        assert kernel(CIE, EYE, PIXEL, theta) == pytest.approx(wanted, rel=1e-6)


def test_nonnegative_least_squares_is_least() -> None:
    """Kuhn and Tucker: no gain from what is 0, none either way from what is not."""
    random = np.random.default_rng(5)
    for _ in range(50):
        matrix, wanted = random.normal(size=(30, 8)), random.normal(size=30)
        x = nonnegative_least_squares(matrix, wanted)
        slope = matrix.T @ (wanted - matrix @ x)
        assert np.all(x >= 0.0)
        assert np.all(slope[x == 0.0] <= 1e-9)
        np.testing.assert_allclose(slope[x > 0.0], 0.0, atol=1e-9)


@pytest.mark.parametrize("model", [CIE, SPENCER])
@pytest.mark.parametrize("pixel", [0.005, 0.0172, 0.0345, 0.0517])
def test_fit_is_good(model: GlareModel, pixel: float) -> None:
    first, levels = first_level(model, EYE, pixel)
    theta = np.geomspace(max(0.02, pixel / 2.0), 8.0, 300)
    for scale in (1.0, 0.8):
        found = weights(model, EYE, pixel, scale)
        sigma = sigmas(first, levels) * pixel * scale
        used = sigma > 0.0
        excess = np.broadcast_to(EXCESS, sigma.shape)
        fit = gaussians(theta, sigma[used], excess[used]) @ found[used]
        np.testing.assert_allclose(fit, kernel(model, EYE, pixel, theta), rtol=0.06)
        assert 0.0 < found.sum() < scattered(model, EYE, pixel)


def rings(theta: np.ndarray, ratio: np.ndarray, edges: tuple[float, ...]) -> np.ndarray:
    """Means of a ratio over rings about a lamp."""
    return np.array(
        [ratio[(theta >= a) & (theta < b)].mean() for a, b in itertools.pairwise(edges)]
    )


@pytest.mark.parametrize(("dx", "dy"), [(0, 0), (1, 0), (7, 2), (13, 14)])
def test_halo_of_a_lamp(dx: int, dy: int) -> None:
    """Wherever it stands to the texels, 6 % in every ring from 0.02 degrees, 26 % in any pixel."""
    frame = np.zeros((SMALL[1], SMALL[0], 1)).repeat(3, axis=2)
    y, x = 150 + dy, 240 + dx
    frame[y, x] = 1e4
    got = pyramid(CIE, EYE, SMALL, FIELD).paint(frame)[..., 0]
    rays = directions(SMALL, FIELD)
    theta = angle(rays, rays[y, x])
    lux = 1e4 * pixel_solid_angles(SMALL, FIELD)[y, x]
    theta[y, x] = 0.0
    ratio = got / (lux * kernel(CIE, EYE, PIXEL, theta))
    edges = (0.02, 0.06, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.5)
    np.testing.assert_allclose(rings(theta, ratio, edges), 1.0, atol=0.06)
    assert np.all(np.abs(np.delete(ratio.ravel(), y * SMALL[0] + x) - 1.0) < 0.26)


def test_halo_in_the_corner_of_a_wide_picture() -> None:
    """At 40 degrees from the axis a pixel has 0.45 of the solid angle; rings stay within 6 %."""
    size = 640, 400
    field = fields(90.0, size)
    pixel = pixel_angle(size, field)
    frame = np.zeros((400, 640, 3))
    y, x = 60, 580
    solid = pixel_solid_angles(size, field)[y, x]
    assert solid < 0.5 * pixel_solid_angles(size, field)[200, 320]
    frame[y, x] = 1.0 / solid
    got = pyramid(CIE, EYE, size, field).paint(frame)[..., 1]
    rays = directions(size, field)
    theta = angle(rays, rays[y, x])
    theta[y, x] = 0.0
    ratio = got / kernel(CIE, EYE, pixel, theta)
    edges = (0.5, 1.0, 2.0, 4.0, 8.0, 12.0, 20.0, 40.0, 70.0)
    np.testing.assert_allclose(rings(theta, ratio, edges), 1.0, atol=0.06)


@pytest.mark.parametrize("model", [CIE, SPENCER, WARD])
@pytest.mark.parametrize("size", [(97, 61), (64, 64), (1, 1), (3, 200)])
def test_even_frames_and_energy(model: GlareModel, size: tuple[int, int]) -> None:
    field = fields(50.0, size)
    plan = pyramid(model, EYE, size, field)
    even = np.full((size[1], size[0], 3), 20.0)
    # The matrix is float32: as many roundings as it has columns, at worst, of a share of it.
    np.testing.assert_allclose(plan.paint(even), even, rtol=1e-6)
    frame = np.random.default_rng(1).uniform(0.0, 1.0, even.shape) ** 8.0
    assert plan.paint(frame).sum() == pytest.approx(frame.sum(), rel=0.01)


def test_close_to_the_convolution() -> None:
    """A night of lamps: 2 % in the mean, and each pixel as the halo of a lamp is."""
    random = np.random.default_rng(9)
    size = 256, 160
    field = fields(10.0, size)
    frame = np.full((160, 256, 3), 0.1)
    frame[random.integers(0, 160, 30), random.integers(0, 256, 30)] = 1e4
    got = pyramid(CIE, EYE, size, field).paint(frame)
    wanted = painted(frame, field, CIE, EYE)
    np.testing.assert_allclose(got, wanted, rtol=0.26)
    assert abs(np.log(got / wanted).mean()) < 0.02


def test_lamp_in_the_frame_by_its_lux_or_its_pixel() -> None:
    """A lamp has the same halo as the pixel that would give as many lux."""
    plan = pyramid(CIE, EYE, SMALL, FIELD)
    y, x = 100, 300
    rays = directions(SMALL, FIELD)
    solid = pixel_solid_angles(SMALL, FIELD)[y, x]
    lit, dark = np.zeros((2, SMALL[1], SMALL[0], 3))
    lit[y, x] = 500.0
    lamp = np.concatenate([rays[y, x], np.full(3, 500.0 * solid)])[None]
    by_pixel, by_lux = plan.paint(lit)[..., 0], plan.paint(dark, lamp)[..., 0]
    theta = angle(rays, rays[y, x])
    ratio = by_lux / np.where(theta > 0.0, by_pixel, np.inf)
    edges = (0.02, 0.06, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)
    np.testing.assert_allclose(rings(theta, ratio, edges), 1.0, atol=0.04)


@pytest.mark.parametrize("degrees", [36.0, 60.0, 89.0, 95.0, 120.0])
def test_lamp_beside_the_frame(degrees: float) -> None:
    size = 320, 200
    field = fields(60.0, size)
    a = math.radians(degrees)
    lamp = np.array([[math.sin(a), 0.0, -math.cos(a), 3.0, 2.0, 1.0]])
    got = pyramid(CIE, EYE, size, field).paint(np.zeros((200, 320, 3)), lamp)
    rays = directions(size, field)
    wanted = lamp_veil(lamp, rays.reshape(-1, 3), CIE, EYE, pixel_angle(size, field))
    # E f(theta), but where the kernel ends within a texel.
    ends = np.abs(angle(rays, lamp[0, :3]) - 100.0) < 2.0
    near = np.where(ends[..., None], got, wanted.reshape(got.shape))
    np.testing.assert_allclose(got, near, rtol=0.06, atol=1e-12)


def test_halo_does_not_jump_as_a_lamp_leaves_the_frame() -> None:
    """From the last pixel inside to a lamp half a pixel outside: the halo hardly changes."""
    size = 480, 300
    plan = pyramid(CIE, EYE, size, FIELD)
    across = math.tan(math.radians(FIELD[0]) / 2.0)
    pixel = 2.0 * across / 480
    veils = []
    for off in (-0.5, 0.5):
        ray = np.array([across + off * pixel, 0.0, -1.0])
        row = np.concatenate([ray / np.linalg.norm(ray), np.ones(3)])[None]
        veils.append(plan.paint(np.zeros((300, 480, 3)), row)[140:160, 440:478, 0])
    # One pixel of 0.034 degrees at 0.1 degrees and more: kernels as steep as 1 / theta^3.
    np.testing.assert_allclose(veils[1], veils[0], rtol=0.4)
    assert np.all(veils[1][:, :-4] < veils[0][:, :-4] * 1.05)


def test_nodes() -> None:
    plan = pyramid(CIE, EYE, SMALL, FIELD)
    assert plan.weights.shape == (NODES, plan.last - plan.first + 1, 2)
    assert pyramid(CIE, EYE, SMALL, FIELD) is plan


def test_dark_or_bad_lamps() -> None:
    rows = np.array([[0.0, 0.0, -1.0, 1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]])
    assert len(as_lamps(rows)) == 1
    for bad in ([[1.0, 2.0]], [[0.0, 0.0, -1.0, math.nan, 0.0, 0.0]], 3.0):
        with pytest.raises(HdrusdError, match="lamps"):
            as_lamps(bad)


def test_picture_of_another_size() -> None:
    with pytest.raises(HdrusdError, match="4 x 3"):
        pyramid(CIE, EYE, SMALL, FIELD).paint(np.zeros((3, 4, 3)))
