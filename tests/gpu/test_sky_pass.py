"""Skies on the GPU: behind the scene, in glossy surfaces, as lux and as suns."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sky_scenes import GBuffer, sky, sky_pass, surfaces
from small_scenes import look, rays

from hdrusd.photometry.environment import (
    LAST,
    TABLE,
    blur_level,
    blurred_levels,
    main_direction,
    mean_schlick,
    reflected,
    reflected_table,
    table_place,
)
from hdrusd.photometry.microfacet import coat_reflectance, grazing_reflectance
from hdrusd.photometry.sky import (
    ambient_lux,
    irradiance_coefficients,
    sky_uv,
    texel_directions,
)
from hdrusd.report import Report
from hdrusd.scene import Camera, Material, RenderScene

PI = math.pi
SIZE = (32, 24)
rng = np.random.default_rng(22)

#: Filters of a texture unit have 8 bits for the place between two texels (Vulkan 1.3,
#: subTexelPrecisionBits is at least 4), so of two levels and two rows: 3 / 256 of the contrast.
FILTER = 3.0 / 256.0

GLOSSY = Material(model="ggx", specular=(0.04, 0.04, 0.04))


def camera(**options: Any) -> Camera:
    return look(**{"eye": (0.0, 0.0, 3.0), "half": 0.5} | options)


def directions(view: Camera) -> Any:
    _, towards = rays(view, SIZE)
    return towards / np.linalg.norm(towards, axis=-1, keepdims=True)


def scene(**fields: Any) -> RenderScene:
    return RenderScene(**{"camera": camera(), "materials": (GLOSSY,)} | fields)


def smooth(height: int = 32) -> Any:
    """A picture without sharp edges: each channel by its own direction."""
    return 1.2 + texel_directions(height, 2 * height) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]


def empty() -> Any:
    return np.zeros((SIZE[1], SIZE[0], 3)), np.zeros((SIZE[1], SIZE[0]))


# -- behind everything


@pytest.mark.parametrize("eye", [(0, 0, 3), (3, 0.5, 0), (-1, -2, -3), (0.01, 4, 0)])
def test_the_background_shows_the_texel_of_each_direction(gl: Any, eye: Any) -> None:
    colours = rng.uniform(0.0, 1.0, (4, 8, 3)).astype(np.float32)
    texels = colours.repeat(64, axis=0).repeat(64, axis=1)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    dome = sky(visible=True, factor=(2.0, 3.0, 4.0), rotation=tuple(rotation.ravel()))
    view = camera(eye=eye)
    buffer = GBuffer(gl, **surfaces(*empty()))
    sky_pass(gl, sky=texels).draw_background(scene(skies=(dome,), camera=view), buffer.frame, SIZE)
    uv = sky_uv(directions(view) @ rotation.T)
    place = np.stack([(1.0 - uv[..., 1]) * 4, uv[..., 0] * 8], axis=-1)
    # Not within two of the 64 texels of an edge between colours, where they are filtered.
    inside = np.all(np.abs(place - np.round(place)) > 2 / 64, axis=-1)
    row, column = np.floor(place).astype(int).transpose(2, 0, 1)
    assert np.count_nonzero(inside) > 400
    got = buffer.read()
    assert got[inside][:, :3] == pytest.approx(
        (colours[row, column] * [2.0, 3.0, 4.0])[inside], rel=1e-6
    )
    assert (got[..., 3] == 0.0).all()


def test_surfaces_hide_the_sky_and_it_is_added_to_what_is_there(gl: Any) -> None:
    normal, depth = empty()
    normal[:12, :, 2], depth[:12] = 1.0, 2.0
    buffer = GBuffer(gl, **surfaces(normal, depth))
    buffer.hdr.write(np.full((SIZE[1], SIZE[0], 4), 10.0, np.float32))
    skies = sky_pass(gl, sky=np.ones((8, 16, 3), np.float32))
    skies.draw_background(scene(skies=(sky(visible=True),)), buffer.frame, SIZE)
    got = buffer.read()
    assert (got[:12, :, 0] == 10.0).all()
    assert (got[12:, :, 0] == 11.0).all()


def test_a_sky_that_is_not_visible_is_not_seen(gl: Any) -> None:
    buffer = GBuffer(gl, **surfaces(*empty()))
    skies = sky_pass(gl, sky=np.ones((8, 16, 3), np.float32))
    skies.draw_background(scene(skies=(sky(),)), buffer.frame, SIZE)
    assert (buffer.read() == 0.0).all()


def test_an_orthographic_camera_sees_one_direction(gl: Any) -> None:
    texels = smooth(64).astype(np.float32)
    view = camera(eye=(1.0, 2.0, 3.0), orthographic=True)
    buffer = GBuffer(gl, **surfaces(*empty()))
    sky_pass(gl, sky=texels).draw_background(
        scene(skies=(sky(visible=True),), camera=view), buffer.frame, SIZE
    )
    uv = sky_uv(-np.asarray(view.back))
    wanted = texels[int((1 - uv[1]) * 64), int(uv[0] * 128)]
    assert np.ptp(buffer.read()[..., :3], axis=(0, 1)).max() == 0.0
    assert buffer.read()[0, 0, :3] == pytest.approx(wanted, abs=0.05)


# -- in glossy surfaces


def leaning() -> Any:
    """Normals on every side of the view, and distances."""
    x, y = np.meshgrid(np.linspace(-0.9, 0.9, SIZE[0]), np.linspace(-0.9, 0.9, SIZE[1]))
    normal = np.stack([x, y, np.full_like(x, 0.7)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return normal, np.full(x.shape, 2.0)


def between(picture: Any, x: Any, y: Any, columns: Any) -> Any:
    """Bilinear reads at texel places (from the first texel's middle), rows as they are."""
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    rows = [np.clip(k, 0, picture.shape[0] - 1) for k in (j, j + 1)]
    s, t = (x - i)[..., None], (y - j)[..., None]
    low, high = (picture[r, columns(i)] * (1 - s) + picture[r, columns(i + 1)] * s for r in rows)
    return low * (1 - t) + high * t


def mirrored(texels: Any, normal: Any, view: Any, alpha: Any, f0: Any, f90: Any) -> Any:
    """The split sum in NumPy, (h, w, 3)."""
    nv = np.clip(np.sum(normal * view, axis=-1), 0.0, 1.0)
    place = table_place(nv, alpha) * TABLE - 0.5
    entry = between(
        reflected_table(), place[..., 0], place[..., 1], lambda k: np.clip(k, 0, TABLE - 1)
    )
    light = reflected(f0, f90, entry)
    if texels is None:
        return light
    towards = main_direction(normal, 2 * nv[..., None] * normal - view, alpha)
    uv = sky_uv(towards)
    level = blur_level(alpha)
    found = np.zeros_like(normal)
    for k, picture in enumerate(blurred_levels(texels)):
        h, w = picture.shape[:2]
        share = np.maximum(1.0 - np.abs(level - k), 0.0)[..., None]
        x, y = uv[..., 0] * w - 0.5, (1.0 - uv[..., 1]) * h - 0.5
        found += share * between(picture, x, y, lambda i, w=w: i % w)
    assert level.max() <= LAST
    return light * found


def test_glossy_surfaces_mirror_the_sky_by_the_split_sum(gl: Any) -> None:
    texels = smooth().astype(np.float32)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    dome = sky(factor=(2.0, 1.0, 0.5), rotation=tuple(rotation.ravel()))
    normal, depth = leaning()
    alpha = rng.uniform(0.05, 1.0, depth.shape) ** 2
    f0 = rng.uniform(0.0, 1.0, normal.shape)
    buffer = GBuffer(gl, **surfaces(normal, depth, f0=f0, metallic=0.3, alpha=alpha))
    shown = scene(skies=(dome,))
    sky_pass(gl, sky=texels).add_mirrored(shown, buffer.layers, buffer.frame, 1 / PI)
    turned = [v @ rotation.T for v in (normal, -directions(shown.camera))]
    f90 = grazing_reflectance(f0, np.full(depth.shape, 0.3))
    wanted = mirrored(texels, *turned, alpha, f0, f90) * dome.factor
    assert buffer.read()[..., :3] == pytest.approx(wanted, abs=FILTER * wanted.max())
    assert np.abs(buffer.read()[..., :3] / wanted - 1.0).mean() < 0.002


def test_ambient_light_is_mirrored_like_a_sky_of_its_luminance(gl: Any) -> None:
    normal, depth = leaning()
    for scale, times in ((1 / PI, 1.0), (1.0, PI)):
        buffer = GBuffer(gl, **surfaces(normal, depth, f0=0.3, alpha=0.2))
        shown = scene(ambient=(PI, 2 * PI, 3 * PI))
        sky_pass(gl).add_mirrored(shown, buffer.layers, buffer.frame, scale)
        f0, f90 = np.full(normal.shape, 0.3), np.ones(normal.shape)
        view = -directions(shown.camera)
        wanted = mirrored(None, normal, view, np.full(depth.shape, 0.2), f0, f90)
        assert buffer.read()[..., :3] == pytest.approx(
            wanted * np.array([1.0, 2.0, 3.0]) * times, abs=FILTER * 3.0 * times
        )


def test_what_hides_the_sky_takes_its_share_of_the_reflection(gl: Any) -> None:
    normal, depth = leaning()
    open_sky, hidden = (GBuffer(gl, **surfaces(normal, depth, f0=0.3)) for _ in range(2))
    # A third of the luminance arrives: rgb of 1 against a of 3.
    arriving = gl.texture(SIZE, 4, np.tile(np.float32([1, 1, 1, 3]), (*SIZE, 1)), dtype="f4")
    shown = scene(ambient=(PI, PI, PI))
    skies = sky_pass(gl)
    skies.add_mirrored(shown, open_sky.layers, open_sky.frame, 1 / PI)
    skies.add_mirrored(shown, hidden.layers, hidden.frame, 1 / PI, arriving)
    wanted = open_sky.read()[..., :3] / 3.0
    assert wanted.min() > 0.0
    assert hidden.read()[..., :3] == pytest.approx(wanted, rel=1e-6)


def test_a_clear_coat_mirrors_and_shades_what_is_below(gl: Any) -> None:
    normal, depth = leaning()
    alpha = np.full(depth.shape, 0.5)
    buffer = GBuffer(gl, **surfaces(normal, depth, f0=0.3, alpha=0.5, coat=(0.8, 0.1)))
    shown = scene(ambient=(PI, PI, PI))
    sky_pass(gl).add_mirrored(shown, buffer.layers, buffer.frame, 1 / PI)
    view = -directions(shown.camera)
    f0, f90 = np.full(normal.shape, 0.3), np.ones(normal.shape)
    below = mirrored(None, normal, view, alpha, f0, f90)
    nv = np.clip(np.sum(normal * view, axis=-1), 0.0, 1.0)
    below *= 1.0 - coat_reflectance(0.8, mean_schlick(nv))[..., None]
    coat = mirrored(None, normal, view, alpha / 5, 0.04 * 0.8 * f90, 0.8 * f90)
    assert buffer.read()[..., :3] == pytest.approx(below + coat, abs=2 * FILTER)


def test_what_is_not_ggx_or_reflects_nothing_mirrors_nothing(gl: Any) -> None:
    normal, depth = leaning()
    shown = scene(ambient=(PI, PI, PI), skies=(sky(),))
    skies = sky_pass(gl, sky=np.ones((8, 16, 3), np.float32))
    for changes in ({"shininess": 20.0, "f0": 0.5}, {"f0": 0.0}):
        buffer = GBuffer(gl, **surfaces(normal, depth, **changes))
        skies.add_mirrored(shown, buffer.layers, buffer.frame, 1 / PI)
        assert (buffer.read()[..., :3] == 0.0).all()


def test_a_scene_of_dull_materials_costs_nothing(gl: Any) -> None:
    normal, depth = leaning()
    buffer = GBuffer(gl, **surfaces(normal, depth, f0=0.5))
    dull = scene(materials=(Material(), Material(model="ggx")), ambient=(PI, PI, PI))
    sky_pass(gl).add_mirrored(dull, buffer.layers, buffer.frame, 1 / PI)
    assert (buffer.read() == 0.0).all()


# -- lux and suns


def test_lux_of_skies_and_ambient_add_up_in_the_world(gl: Any) -> None:
    texels = smooth()
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    dome = sky(factor=(2.0, 1.0, 0.5), rotation=tuple(rotation.ravel()))
    shown = scene(skies=(dome, sky()), ambient=(1.0, 2.0, 3.0))
    got = sky_pass(gl, sky=texels.astype(np.float32)).lux_coefficients(shown)
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    own = irradiance_coefficients(texels)
    wanted = ambient_lux(normals @ rotation.T, own) * dome.factor + ambient_lux(normals, own)
    assert ambient_lux(normals, got) == pytest.approx(wanted + np.array([1.0, 2.0, 3.0]), rel=1e-5)


def test_a_sun_becomes_a_light_in_the_world_and_a_finding(gl: Any) -> None:
    texels = np.ones((64, 128, 3), np.float32)
    texels[20, 30] = [1e6, 2e6, 3e6]
    towards = texel_directions(64, 128)[20, 30]
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    dome = sky(factor=(0.5, 0.5, 0.5), rotation=tuple(rotation.ravel()))
    report = Report()
    skies = sky_pass(gl, report, sky=texels)
    lit = skies.with_suns(scene(skies=(dome,)))
    (sun,) = lit.lights
    assert sun["w"] == 0.0
    assert sun["shadow"] == 1
    assert sun["position"] == pytest.approx(towards @ rotation, abs=1e-9)
    assert sun["axis"] == pytest.approx(-towards @ rotation, abs=1e-9)
    omega = 2 * PI / 128 * (math.cos(20 * PI / 64) - math.cos(21 * PI / 64))
    assert sun["intensity"] == pytest.approx(np.array([0.5e6, 1e6, 1.5e6]) * omega, rel=1e-5)
    assert sun["angle"] < PI / 128
    assert report.codes() == {"sky-sun"}
    assert not skies.with_suns(scene(skies=(replace(dome, shadow=False),))).lights["shadow"].any()
    # The rest is even: pi L.
    lux = ambient_lux(np.array([0.0, 1.0, 0.0]), skies.lux_coefficients(lit))
    assert lux == pytest.approx(np.full(3, 0.5 * PI), rel=1e-3)


def test_without_suns_the_scene_is_the_same(gl: Any) -> None:
    shown = scene(skies=(sky(),))
    assert sky_pass(gl, sky=np.ones((8, 16, 3), np.float32)).with_suns(shown) is shown


def test_a_picture_that_is_missing_is_dark(gl: Any) -> None:
    shown = scene(skies=(sky(visible=True),), ambient=(1.0, 2.0, 3.0))
    skies = sky_pass(gl, sky=None)
    assert skies.with_suns(shown) is shown
    wanted = np.zeros((18, 3))
    wanted[0] = [1.0, 2.0, 3.0]
    assert skies.lux_coefficients(shown) == pytest.approx(wanted)
    buffer = GBuffer(gl, **surfaces(*empty()))
    skies.draw_background(shown, buffer.frame, SIZE)
    assert (buffer.read() == 0.0).all()


def test_pictures_that_are_no_skies_are_findings(gl: Any) -> None:
    report = Report()
    texels = np.ones((10, 10, 3), np.float16)
    texels[3, 3] = np.inf
    skies = sky_pass(gl, report, sky=texels)
    lux = skies.lux_coefficients(scene(skies=(sky(),)))
    assert report.codes() == {"sky-aspect", "sky-texels"}
    assert lux[0] == pytest.approx(np.full(3, PI), rel=1e-3)


def test_eight_bits_are_decoded_as_colours(gl: Any) -> None:
    skies = sky_pass(gl, sky=np.full((8, 16, 3), 128, np.uint8))
    lux = skies.lux_coefficients(scene(skies=(sky(),)))
    assert lux[0] == pytest.approx(np.full(3, PI * (128 / 255) ** 2.2), rel=2e-3)


def test_luminance_of_directions(gl: Any) -> None:
    colours = rng.uniform(0.0, 1.0, (2, 4, 3)).astype(np.float32)
    texels = colours.repeat(32, axis=0).repeat(32, axis=1)
    shown = scene(skies=(sky(factor=(2.0, 2.0, 2.0)),), ambient=(PI, PI, PI))
    eight = texel_directions(2, 4).reshape(-1, 3)
    got = sky_pass(gl, sky=texels).luminance(shown, eight)
    assert got == pytest.approx(1.0 + 2.0 * colours.reshape(-1, 3), rel=1e-6)
