"""Skies against closed forms: which way a picture stands, lux by the tilt, suns taken out."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.images import read_exr
from hdrusd.photometry.sky import (
    SH_TERMS,
    SUN_RADIUS,
    ambient_lux,
    irradiance_coefficients,
    reduced,
    sh_polynomials,
    sky_direction,
    sky_uv,
    sound_texels,
    split_suns,
    texel_directions,
    texel_solid_angles,
    turned_coefficients,
)
from hdrusd.units import LUMINANCE_WEIGHTS

PI = math.pi
X, Y, Z = np.eye(3)

#: Texels stand for the direction in their middle: of a picture of 64 rows the moments are off
#: by the square of half a texel, (pi / 128)^2 / 3 = 2e-4.
MIDDLES = 3e-4

rng = np.random.default_rng(2001)


def unit(count: int = 500) -> Any:
    v = rng.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def tilted(degrees: float) -> Any:
    return np.array([0.0, math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


def picture(luminance: Any, height: int = 64) -> Any:
    """A grey sky of 2 x 1 from the luminance of a direction (..., 3)."""
    texels = np.asarray(luminance(texel_directions(height, 2 * height)), np.float64)
    return np.repeat(np.broadcast_to(texels, (height, 2 * height))[..., None], 3, axis=-1)


def lux(texels: Any, normal: Any) -> Any:
    return ambient_lux(np.asarray(normal), irradiance_coefficients(texels))


def exact_lux(texels: Any, normal: Any) -> Any:
    """The sum over all texels, (n, 3)."""
    h, w = texels.shape[:2]
    towards = texel_directions(h, w).reshape(-1, 3)
    weighted = (texels * texel_solid_angles(h, w)[..., None]).reshape(-1, 3)
    return np.maximum(normal @ towards.T, 0.0) @ weighted


# -- which way a picture stands


@pytest.mark.parametrize(
    ("u", "v", "direction"),
    [
        # OpenEXR, lat-long map: the first texel of the top row has latitude +90, longitude +180
        # degrees; latitudes +-90 are +-Y; longitude 0 is +Z and longitude 90 degrees +X.
        (0.5, 0.5, Z),
        (0.25, 0.5, X),
        (0.75, 0.5, -X),
        (0.0, 0.5, -Z),
        (1.0, 0.5, -Z),
        (0.3, 1.0, Y),
        (0.9, 0.0, -Y),
        (0.375, 0.75, (0.5, math.sqrt(0.5), 0.5)),  # longitude 45, latitude 45 degrees
    ],
)
def test_directions_of_a_lat_long_map(u: float, v: float, direction: Any) -> None:
    uv = np.array([u, v])
    assert sky_direction(uv) == pytest.approx(np.asarray(direction), abs=1e-15)
    back = sky_uv(np.asarray(direction, np.float64))
    assert back[1] == pytest.approx(v, abs=1e-15)
    if 0.0 < v < 1.0:
        assert (back[0] - u) % 1.0 == pytest.approx(0.0, abs=1e-15)


def test_texture_coordinates_and_directions_undo_each_other() -> None:
    directions = unit()
    assert sky_direction(sky_uv(directions)) == pytest.approx(directions, abs=1e-14)
    assert sky_uv(7.0 * directions) == pytest.approx(sky_uv(directions), abs=1e-14)


def test_texels_share_the_sphere() -> None:
    assert texel_solid_angles(7, 12).sum() * 12 == pytest.approx(4 * PI, rel=1e-14)
    # A quarter of the sphere is above 30 degrees: 2 pi (1 - sin 30).
    assert texel_solid_angles(3, 1)[0] == pytest.approx(PI, rel=1e-14)
    top_left = texel_directions(2, 4)[0, 0]
    assert top_left == pytest.approx([0.5, math.sqrt(0.5), -0.5], abs=1e-15)


# -- lux by the normal


def test_an_even_sky_gives_pi_times_its_luminance_to_every_surface() -> None:
    texels = np.ones((64, 128, 3)) * [1.0, 2.0, 3.0]
    wanted = np.tile([PI, 2 * PI, 3 * PI], (500, 1))
    assert lux(texels, unit()) == pytest.approx(wanted, rel=3 * MIDDLES)
    even = np.zeros((SH_TERMS, 3))
    even[0] = PI, 2 * PI, 3 * PI
    exact = ambient_lux(unit(), even)
    assert exact == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize("degrees", [0, 25, 45, 60, 90, 120, 155, 180])
def test_a_sky_in_two_halves_by_the_tilt(degrees: float) -> None:
    # E = pi (sky (1 + cos b) / 2 + ground (1 - cos b) / 2).
    cosine = math.cos(math.radians(degrees))
    wanted = PI * (2000.0 * (1 + cosine) / 2 + 150.0 * (1 - cosine) / 2)
    texels = picture(lambda d: np.where(d[..., 1] > 0.0, 2000.0, 150.0))
    assert lux(texels, tilted(degrees)) == pytest.approx([wanted] * 3, abs=PI * 2000.0 * MIDDLES)


def test_the_overcast_sky_of_moon_and_spencer() -> None:
    # L = (1 + 2 sin h) / 3 over black ground (CIE S 011, type 16): level 7 pi / 9, upright
    # pi / 6 + 4 / 9, their ratio the 0.396 of every handbook.
    texels = picture(lambda d: np.where(d[..., 1] > 0.0, (1.0 + 2.0 * d[..., 1]) / 3.0, 0.0))
    level, upright = lux(texels, Y)[0], lux(texels, Z)[0]
    # Bands 6 and up of it are left out.
    assert level == pytest.approx(7 * PI / 9, rel=5e-3)
    assert upright == pytest.approx(PI / 6 + 4 / 9, rel=5e-3)
    assert upright / level == pytest.approx(0.396, abs=3e-3)


def test_each_quarter_of_a_four_coloured_sky_lights_its_own_side() -> None:
    # From the left: green, red, white, blue, a quarter each; +X is where green and red meet.
    colours = np.array([[0, 1, 0], [1, 0, 0], [1, 1, 1], [0, 0, 1]], np.float64)
    texels = np.repeat(colours, 32, axis=0)[None] * np.ones((64, 1, 1))
    direction = sky_direction(np.array([[0.125, 0.5], [0.375, 0.5], [0.625, 0.5], [0.875, 0.5]]))
    e = lux(texels, direction)
    # The integral of cos^2(latitude) cos(longitude) over a lune of 90 degrees, in front of a
    # plane and a quarter beside it. White gives to all channels; green and blue meet at the seam.
    own, beside = PI * math.sqrt(0.5), PI * (1.0 - math.sqrt(0.5)) / 2.0
    wanted = [
        [beside, own, beside],
        [own + beside, 2 * beside, beside],
        [own + beside, own, own + beside],
        [beside, 2 * beside, own + beside],
    ]
    assert exact_lux(texels, direction) == pytest.approx(np.array(wanted), abs=2e-3)
    assert e == pytest.approx(np.array(wanted), abs=0.06 * PI)


def test_a_turned_dome_lights_as_the_picture_turned() -> None:
    texels = rng.uniform(0.0, 1.0, (16, 32, 3))
    coefficients = irradiance_coefficients(texels)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]  # may mirror
    normals = unit()
    turned = turned_coefficients(coefficients, rotation)
    wanted = ambient_lux(normals @ rotation.T, coefficients)
    assert ambient_lux(normals, turned) == pytest.approx(wanted, abs=1e-12)


def test_the_basis_is_orthogonal_and_has_whole_bands() -> None:
    # Gauss quadrature in the height is exact for polynomials of degree 8, as is the mean over
    # 32 longitudes: the Gram matrix is diagonal.
    heights, weights = np.polynomial.legendre.leggauss(16)
    turn = 2 * PI * np.arange(32) / 32
    level = np.sqrt(1 - heights**2)[:, None]
    parts = [level * np.cos(turn), level * np.sin(turn), heights[:, None] + 0 * turn]
    values = sh_polynomials(np.stack(parts, axis=-1)).reshape(-1, 18)
    gram = values.T @ (values * np.repeat(weights * 2 * PI / 32, 32)[:, None])
    assert gram - np.diag(np.diag(gram)) == pytest.approx(np.zeros((18, 18)), abs=1e-12)
    # The sum of squares within a band is the same in all directions (Unsoeld's theorem).
    squares = sh_polynomials(unit()) ** 2 / np.diag(gram)
    for first, last in ((0, 1), (1, 4), (4, 9), (9, 18)):
        wanted = np.full(500, (last - first) / (4 * PI))
        assert squares[:, first:last].sum(axis=1) == pytest.approx(wanted, rel=1e-12)


def test_a_source_too_small_for_the_bands_is_off_by_5_9_percent_at_most() -> None:
    texels = np.zeros((64, 128, 3))
    texels[20, 30] = 1.0
    facing = texel_solid_angles(64, 128)[20, 0]
    towards = texel_directions(64, 128)[20, 30]
    normals = np.concatenate([unit(), np.cross(unit(), towards), [towards, -towards]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    off = np.abs(lux(texels, normals)[:, 0] - exact_lux(texels, normals)[:, 0]) / facing
    # 15/256 of it at a right angle: 1/4 - 5/32 - 9/256, the series there.
    assert off.max() == pytest.approx(15 / 256, rel=1e-9)
    assert lux(texels, normals).min() >= 0.0


@pytest.mark.parametrize(
    ("name", "luminance", "off"),
    [
        ("glow of a town at the horizon", lambda d: np.exp(-np.maximum(d[..., 1], 0) / 0.1), 0.02),
        ("dusk", lambda d: np.exp(3.0 * (d[..., 2] - 1)) + 0.1, 0.01),
        ("clear", lambda d: 0.3 + np.exp(8.0 * (d @ tilted(40.0) - 1)) * 3.0, 0.012),
        ("window of 40 degrees", lambda d: np.where(d[..., 0] > math.cos(0.35), 1.0, 0.05), 0.04),
    ],
)
def test_lux_of_skies_without_a_closed_form(name: str, luminance: Any, off: float) -> None:
    """Largest error over all normals, as a share of the largest lux."""
    texels = picture(luminance)
    normals = unit()
    wanted = exact_lux(texels, normals)
    error = np.abs(lux(texels, normals) - wanted).max() / wanted.max()
    assert error <= off, name


# -- suns


def disc(direction: Any, radius: float, height: int = 256, luminance: float = 1e6) -> Any:
    """A sky of 1 cd/m2 with a disc, its rim averaged over 8 x 8 points a texel."""
    fine = picture(lambda d: d @ np.asarray(direction) >= math.cos(radius), height * 4)
    return 1.0 + luminance * reduced(fine, 2 * height)


@pytest.mark.parametrize(
    "direction",
    [
        sky_direction(np.array([0.3, 0.8])),
        sky_direction(np.array([0.0, 0.6])),  # across the seam
        sky_direction(np.array([0.1, 0.995])),  # beside the pole
        Y,
    ],
)
def test_a_sun_becomes_a_light_and_nothing_is_lost(direction: Any) -> None:
    radius = 6 * PI / 1024  # about a degree; at the pole it has to be whole rows
    texels = disc(direction, radius)
    rest, (sun,) = split_suns(texels)
    weights = texel_solid_angles(*texels.shape[:2])[..., None]
    flux = np.sum(texels * weights, axis=(0, 1))
    assert np.sum(rest * weights, axis=(0, 1)) + sun.lux == pytest.approx(flux, rel=1e-12)
    # L pi sin^2(a) of a disc; its texels add up to 2 pi (1 - cos a), which is the same for it.
    assert sun.lux[0] == pytest.approx(1e6 * PI * math.sin(radius) ** 2, rel=2e-2)
    assert math.degrees(math.acos(min(float(sun.direction @ direction), 1.0))) < 0.05
    assert sun.angle == pytest.approx(radius, rel=0.1)
    assert rest == pytest.approx(np.ones_like(rest), rel=1e-9)


def test_the_sun_keeps_its_colour() -> None:
    texels = disc(sky_direction(np.array([0.4, 0.7])), 0.01) * [1.0, 0.8, 0.5]
    _, (sun,) = split_suns(texels)
    assert np.array(sun.lux) / sun.lux[0] == pytest.approx([1.0, 0.8, 0.5], rel=1e-9)


@pytest.mark.parametrize(
    "texels",
    [
        np.ones((64, 128, 3)),
        np.zeros((64, 128, 3)),
        picture(lambda d: np.where(d[..., 1] > 0.0, 2000.0, 150.0)),
        picture(lambda d: np.exp(20.0 * (d[..., 2] - 1))),
        picture(lambda d: d @ X > math.cos(4 * SUN_RADIUS)),
        np.ones((1, 2, 3)),
        np.ones((1, 1, 3)),
        disc(X, 0.005, luminance=100.0),  # 100 cd/m2 over 8e-5 sr against 4 pi
    ],
)
def test_what_is_no_sun_stays(texels: Any) -> None:
    rest, suns = split_suns(texels)
    assert suns == []
    assert (rest == texels).all()


def test_at_most_eight_suns_the_brightest_first() -> None:
    texels = np.full((128, 256, 3), 1e-3)
    texels[64, ::16] = np.arange(100, 116)[:, None]
    rest, suns = split_suns(texels)
    lux = [float(np.dot(sun.lux, LUMINANCE_WEIGHTS)) for sun in suns]
    assert len(lux) == 8
    assert lux == sorted(lux, reverse=True)
    assert np.count_nonzero(rest[..., 0] > 1.0) == 8


# -- pictures as they come


def test_reduced_keeps_the_flux_at_any_size() -> None:
    for shape in ((37, 91), (512, 1024), (5, 300), (300, 5)):
        texels = rng.uniform(0.0, 1.0, (*shape, 3)).astype(np.float32)
        small = reduced(texels, 64)
        assert small.shape == (min(shape[0], 32), min(shape[1], 64), 3)
    texels = rng.uniform(0.0, 1.0, (128, 256, 3))
    small = reduced(texels, 32)
    flux = [np.sum(t * texel_solid_angles(*t.shape[:2])[..., None]) for t in (texels, small)]
    assert flux[0] == pytest.approx(flux[1], rel=1e-12)


def test_texels_that_are_no_luminance() -> None:
    texels = np.ones((2, 4, 3), np.float16)
    texels[0, 0] = [np.nan, 2.0, np.inf]
    texels[1, 3] = [-1.0, 5.0, -np.inf]
    sound, count = sound_texels(texels)
    assert count == 2
    assert sound.dtype == np.float16
    assert sound[0, 0].tolist() == [0.0, 2.0, 5.0]
    assert sound[1, 3].tolist() == [0.0, 5.0, 0.0]
    same, none = sound_texels(sound)
    assert same is sound
    assert none == 0
    hopeless, _ = sound_texels(np.full((1, 2, 3), np.nan, np.float32))
    assert (hopeless == 0.0).all()
    wild, _ = sound_texels(np.full((1, 2, 3), 3e38, np.float32))
    assert (wild == 0.0).all()


# -- the truth set's sky, in NumPy


def test_probes_of_the_two_tone_dome(testdata: Path) -> None:
    truth = testdata / "truth"
    if not (truth / "expected.json").is_file():
        pytest.skip("the test data has no truth set")
    cases = json.loads((truth / "expected.json").read_text(encoding="utf-8"))["cases"]
    (case,) = [case for case in cases if case["id"] == "dome_two_tone"]
    light = json.loads((truth / case["photometry"]).read_text(encoding="utf-8"))
    (dome,), (material,) = light["lights"], light["materials"]
    texels, _ = read_exr(truth / "stages" / dome["file"])
    coefficients = irradiance_coefficients(split_suns(np.asarray(texels, np.float64))[0])
    for probe in case["probes"]:
        e = ambient_lux(np.array(probe["normal"]), coefficients)
        got = np.array(material["reflectance_rgb"]) * e / PI
        # Ten times better than what is asked for.
        assert got == pytest.approx(probe["expect"]["RGB"], rel=probe["rel_tol"] / 10)
