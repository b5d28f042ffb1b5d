"""What shader 1 reads from a texture, against the formulas of UsdUVTexture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import Array, Rendered, draw, lights, look, quad, rays, render

from hdrusd.scene import ImageData, Material, RenderScene, TextureRef, TextureUse

#: OpenGL grants 8 bits to the place between two texels; texels here are in [0, 1].
FILTER = 1.0 / 256.0

RNG = np.random.default_rng(5)
#: Smooth enough to see a shift of half a texel, different in every corner. Row 0 is on top.
PICTURE = RNG.uniform(0.0, 1.0, (4, 6, 4)).astype(np.float32)


def texture(file: str = "a.exr", **fields: Any) -> TextureUse:
    names = ("decode", "wrap_s", "wrap_t")
    ref = TextureRef(
        file, **({"decode": "linear"} | {n: fields.pop(n) for n in names if n in fields})
    )
    return TextureUse(texture=ref, **fields)


def scene(material: Material, **uvs: Any) -> RenderScene:
    """The square [-1, 1]^2 seen whole, no lamp: what is read comes out as emission."""
    return RenderScene(
        lights=lights(),
        draws=(draw(quad(uvs=uvs or None)),),
        materials=(material,),
        camera=look(half=1.01 / 3.0),
    )


def shown(gl: Any, made: RenderScene, pictures: dict[str, Array] | None = None) -> Rendered:
    images = pictures or {"a.exr": PICTURE}
    got = render(gl, made, lambda ref: ImageData(images[ref.file]) if ref.file in images else None)
    assert got.surface.sum() > 1000
    return got


def coordinates(made: RenderScene, seen: Array) -> Array:
    """(n, 2) place in the unit square of each pixel that shows it: the ray meets z = 0."""
    origins, directions = rays(made.camera)
    points = origins - directions * (origins[..., 2:] / directions[..., 2:])
    return np.asarray((points[..., :2] + 1.0) / 2.0)[seen]


def bilinear(picture: Array, st: Array, wrap_s: str, wrap_t: str) -> Array:
    """OpenGL 3.3 core, 3.8.8 and 3.8.9: linear filter between texel centres; t runs up."""
    h, w = picture.shape[:2]
    total = np.zeros((len(st), picture.shape[2]))
    x, y = st[:, 0] * w - 0.5, st[:, 1] * h - 0.5
    for dx in (0, 1):
        for dy in (0, 1):
            i, j = np.floor(x).astype(int) + dx, np.floor(y).astype(int) + dy
            weight = (1 - np.abs(x - i)) * (1 - np.abs(y - j))
            column, row = wrap(i, w, wrap_s), wrap(j, h, wrap_t)
            texel = picture[::-1][row, column].astype(np.float64)
            outside = ((wrap_s == "black") & ((i < 0) | (i >= w))) | (
                (wrap_t == "black") & ((j < 0) | (j >= h))
            )
            texel[outside] = 0.0
            total += weight[:, None] * texel
    return total


def wrap(index: Array, size: int, mode: str) -> Array:
    if mode == "repeat":
        return np.asarray(index % size)
    if mode == "mirror":
        return np.asarray(np.minimum(index % (2 * size), 2 * size - 1 - index % (2 * size)))
    return np.clip(index, 0, size - 1)


@pytest.mark.parametrize("wrap_s", ["repeat", "clamp", "mirror", "black"])
@pytest.mark.parametrize("wrap_t", ["repeat", "clamp", "mirror", "black"])
def test_wrap_modes(gl: Any, wrap_s: str, wrap_t: str) -> None:
    """Coordinates from -0.8 to 1.7: more than one and a half textures each way."""
    material = Material(emission_map=texture(wrap_s=wrap_s, wrap_t=wrap_t))
    made = scene(material, st=lambda st: 2.5 * st - 0.8)
    got = shown(gl, made)
    st = 2.5 * coordinates(made, got.surface) - 0.8
    wanted = bilinear(PICTURE, st, wrap_s, wrap_t)[:, :3]
    np.testing.assert_allclose(got.frame[got.surface], wanted, atol=2 * FILTER)


def test_top_row_of_the_file_is_at_t_1(gl: Any) -> None:
    picture = np.zeros((2, 2, 3), np.float32)
    picture[0] = 1.0
    got = shown(gl, scene(Material(emission_map=texture(wrap_t="clamp"))), {"a.exr": picture})
    assert got.frame[5, 32, 0] == 1.0
    assert got.frame[-5, 32, 0] == 0.0


def test_scale_and_bias(gl: Any) -> None:
    scale, bias = (2.0, 30.0, 0.5, 1.0), (0.1, 5.0, 0.25, 0.0)
    made = scene(Material(emission_map=texture(scale=scale, bias=bias)))
    got = shown(gl, made)
    wanted = bilinear(PICTURE, coordinates(made, got.surface), "repeat", "repeat")
    wanted = wanted[:, :3] * scale[:3] + np.array(bias[:3])
    np.testing.assert_allclose(
        got.frame[got.surface] / scale[:3], wanted / scale[:3], atol=2 * FILTER
    )


def test_negative_emission_is_dark(gl: Any) -> None:
    got = shown(gl, scene(Material(emission_map=texture(bias=(-5.0,) * 4))))
    assert not got.frame.any()


def test_matrix_of_the_coordinates(gl: Any) -> None:
    """By u' = a u + b v + c: a quarter turn, twice as dense, moved."""
    matrix = (0.0, 1.0, 0.25, -0.5, 0.0, 0.5)
    made = scene(Material(emission_map=texture(matrix=matrix)))
    got = shown(gl, made)
    st = coordinates(made, got.surface) @ np.reshape(matrix, (2, 3))[:, :2].T + matrix[2::3]
    wanted = bilinear(PICTURE, st, "repeat", "repeat")[:, :3]
    np.testing.assert_allclose(got.frame[got.surface], wanted, atol=2 * FILTER)


@pytest.mark.parametrize("channel", [0, 1, 2, 3])
def test_one_channel_of_an_opacity_map(gl: Any, channel: int) -> None:
    use = texture(channel=channel)
    made = scene(Material(opacity_map=use, opacity_threshold=0.5, emission=(1.0, 1.0, 1.0)))
    got = shown(gl, made)
    whole = shown(gl, scene(Material(emission=(1.0, 1.0, 1.0))))
    st = coordinates(made, whole.surface)
    wanted = bilinear(PICTURE, st, "repeat", "repeat")[:, channel]
    sure = np.abs(wanted - 0.5) > 2 * FILTER
    np.testing.assert_array_equal(got.surface[whole.surface][sure], wanted[sure] > 0.5)


@pytest.mark.parametrize("dtype", [np.uint8, np.float16])
@pytest.mark.parametrize("code", [7, 51, 100, 128, 255])
def test_a_texel_at_the_threshold_is_there(gl: Any, code: int, dtype: Any) -> None:
    """By glTF 2.0, 3.9.6, what is not below the cutoff is opaque. Half floats may round down."""
    codes = np.arange(256).reshape(16, 16, 1)
    picture = codes.astype(dtype) if dtype is np.uint8 else (codes / 255.0).astype(dtype)
    use = texture(channel=0, wrap_s="clamp", wrap_t="clamp")
    material = Material(opacity_map=use, opacity_threshold=code / 255.0, emission=(1.0,) * 3)
    # A pixel shows a texel's centre: the square is 16 pixels wide.
    made = replace(scene(material), camera=replace(look(), window=(-1 / 3, 1 / 3, -1 / 3, 1 / 3)))
    got = render(gl, made, lambda ref: ImageData(picture), (16, 16))
    np.testing.assert_array_equal(got.frame[..., 0] > 0.5, codes[..., 0] >= code)


def test_three_maps_with_a_coordinate_set_each(gl: Any) -> None:
    material = Material(
        diffuse_map=texture(uv_set="plain"),
        emission_map=texture(uv_set="turned"),
        specular_map=texture(uv_set="small"),
    )
    sets = {"plain": lambda s: s, "turned": lambda s: s[:, ::-1], "small": lambda s: 0.5 * s}
    made = scene(material, **sets)
    got = shown(gl, made)
    st = coordinates(made, got.surface)
    for shown_value, place, part in (
        (got.diffuse, st, slice(0, 3)),
        (got.frame, st[:, ::-1], slice(0, 3)),
        (got.specular, 0.5 * st, slice(0, 3)),
    ):
        wanted = bilinear(PICTURE, place, "repeat", "repeat")[:, part]
        np.testing.assert_allclose(shown_value[got.surface], wanted, atol=2 * FILTER)


def test_map_replaces_the_constant(gl: Any) -> None:
    material = Material(diffuse=(0.9, 0.9, 0.9), diffuse_map=texture())
    made = scene(material)
    got = shown(gl, made)
    wanted = bilinear(PICTURE, coordinates(made, got.surface), "repeat", "repeat")[:, :3]
    np.testing.assert_allclose(got.diffuse[got.surface], wanted, atol=2 * FILTER)


def test_vertex_colour_multiplies_the_map(gl: Any) -> None:
    made = scene(Material(diffuse_map=texture(), vertex_color="paint"))
    painted = replace(made, draws=(draw(quad(colors={"paint": (0.5, 0.25, 0.0)})),))
    got = shown(gl, painted)
    wanted = bilinear(PICTURE, coordinates(made, got.surface), "repeat", "repeat")[:, :3]
    wanted = wanted * np.array([0.5, 0.25, 0.0])
    np.testing.assert_allclose(got.diffuse[got.surface], wanted, atol=2 * FILTER)


def test_missing_texture_shows_its_fallback(gl: Any) -> None:
    use = texture("not there.png", fallback=(0.1, 0.2, 0.3, 1.0))
    got = shown(gl, scene(Material(diffuse_map=use)))
    np.testing.assert_allclose(
        got.diffuse[got.surface], np.tile([0.1, 0.2, 0.3], (got.surface.sum(), 1)), rtol=1e-6
    )


def test_missing_texture_beside_one_that_is_there(gl: Any) -> None:
    """The one texture does not stand in for the other."""
    missing = texture("not there.png", fallback=(0.1, 0.2, 0.3, 1.0))
    made = scene(Material(diffuse_map=missing, emission_map=texture()))
    got = shown(gl, made)
    np.testing.assert_allclose(got.diffuse[got.surface].mean(axis=0), [0.1, 0.2, 0.3], rtol=1e-6)
    wanted = bilinear(PICTURE, coordinates(made, got.surface), "repeat", "repeat")[:, :3]
    np.testing.assert_allclose(got.frame[got.surface], wanted, atol=2 * FILTER)


def test_mesh_without_the_coordinates_reads_one_place(gl: Any) -> None:
    got = shown(gl, scene(Material(diffuse_map=texture(uv_set="other"))))
    values = got.diffuse[got.surface]
    np.testing.assert_array_equal(values, np.broadcast_to(values[0], values.shape))


def test_alpha_mask_cuts_the_picture(gl: Any) -> None:
    picture = np.zeros((2, 2, 4), np.float32)
    picture[:, 0] = 1.0  # left half opaque
    use = texture(channel=3, wrap_s="clamp")
    made = scene(Material(emission=(1.0, 1.0, 1.0), opacity_map=use, opacity_threshold=0.5))
    got = render(gl, made, lambda _: ImageData(picture))
    assert got.surface[24, 20]
    assert not got.surface[24, 44]


# -- what the numbers of a file mean ----------------------------------------------------------


@pytest.mark.parametrize(
    ("decode", "channels", "exponent"),
    [("gamma", 3, 2.2), ("auto", 3, 2.2), ("auto", 4, 2.2), ("linear", 3, 1.0), ("auto", 1, 1.0)],
)
def test_8_bit_codes(gl: Any, decode: str, channels: int, exponent: float) -> None:
    """R = (code / 255)^2.2 for pictures, the plain number for data; half floats: 2^-11."""
    picture = np.full((2, 2, channels), 100, np.uint8)
    got = shown(gl, scene(Material(emission_map=texture(decode=decode))), {"a.exr": picture})
    wanted = (100 / 255) ** exponent
    np.testing.assert_allclose(got.frame[got.surface], wanted, rtol=2**-11)


def test_alpha_is_never_curved(gl: Any) -> None:
    picture = np.full((2, 2, 4), 100, np.uint8)
    use = texture(decode="gamma", channel=3)
    made = scene(Material(metallic_map=use))
    got = shown(gl, made, {"a.exr": picture})
    np.testing.assert_allclose(got.metallic[got.surface], 100 / 255, rtol=2**-11)


def test_own_gamma(gl: Any) -> None:
    picture = np.full((2, 2, 3), 100, np.uint8)
    made = scene(Material(emission_map=texture(decode="gamma")))
    got = render(gl, made, lambda _: ImageData(picture), gamma=1.8)
    np.testing.assert_allclose(got.frame[got.surface], (100 / 255) ** 1.8, rtol=2**-11)


def test_hdr_textures_keep_float32(gl: Any) -> None:
    picture = np.full((2, 2, 3), 1.6e9, np.float32)  # the sun's disc, cd/m2
    got = shown(gl, scene(Material(emission_map=texture())), {"a.exr": picture})
    np.testing.assert_allclose(got.frame[got.surface], 1.6e9, rtol=1e-6)


def test_colours_are_filtered_as_light(gl: Any) -> None:
    """Black beside white: half way is half the reflectance, not 0.5^2.2 of it."""
    picture = np.zeros((1, 2, 3), np.uint8)
    picture[:, 1] = 255
    use = texture(decode="gamma", wrap_s="clamp")
    made = scene(Material(emission_map=use))
    got = shown(gl, made, {"a.exr": picture})
    wanted = bilinear(picture / 255.0, coordinates(made, got.surface), "clamp", "repeat")
    np.testing.assert_allclose(got.frame[got.surface], wanted, atol=2 * FILTER)
