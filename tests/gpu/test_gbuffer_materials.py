"""Fields of a material and their maps, as the G-buffer shows them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import Array, draw, gbuffer, lights, look, quad

from hdrusd.photometry.sky import ambient_lux
from hdrusd.scene import ImageData, Material, RenderScene, TextureRef, TextureUse

#: Of one colour, so that filters do not matter: r, g, b, a. Exact as half floats.
TEXEL = np.array([0.5, 0.25, 0.75, 0.125], np.float32)


def use(file: str = "a.exr", **fields: Any) -> TextureUse:
    return TextureUse(TextureRef(file, "linear"), **fields)


def load(ref: TextureRef) -> ImageData | None:
    return ImageData(np.tile(TEXEL, (2, 2, 1))) if ref.file.endswith(".exr") else None


def scene(material: Material, **fields: Any) -> RenderScene:
    """A square that fills the picture, without lamps."""
    made = RenderScene(
        lights=lights(),
        draws=(draw(quad(uvs={name: lambda st: st for name in material.uv_sets()})),),
        materials=(material,),
        camera=look(),
    )
    return replace(made, **fields)


def seen(gl: Any, material: Material, sky: Array | None = None, **fields: Any) -> dict[str, Array]:
    """The middle pixel of each target."""
    found = gbuffer(gl, scene(material, **fields), load, sky)
    return {name: values[24, 32] for name, values in found.items()}


def test_defaults_of_a_blinn_material(gl: Any) -> None:
    got = seen(gl, Material(diffuse=(0.5, 0.4, 0.3), specular=(0.1, 0.2, 0.3), shininess=40.0))
    np.testing.assert_allclose(got["g_diffuse"], [0.5, 0.4, 0.3, 40.0], rtol=1e-6)
    np.testing.assert_allclose(got["g_specular"], [0.1, 0.2, 0.3, 0.0], rtol=1e-6)
    np.testing.assert_allclose(got["g_normal"], [0.0, 0.0, 1.0, 3.0], atol=1e-6)
    np.testing.assert_allclose(got["g_extra"][[0, 2, 3]], 0.0)
    assert got["hdr"].tolist() == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(("roughness", "alpha"), [(0.5, 0.25), (1.0, 1.0), (0.0, 1e-3)])
def test_gloss_code_of_ggx_is_minus_alpha(gl: Any, roughness: float, alpha: float) -> None:
    got = seen(gl, Material(model="ggx", roughness=roughness, shininess=9.0))
    assert got["g_diffuse"][3] == pytest.approx(-alpha, rel=1e-6)


def test_metallic_moves_the_colour_into_the_highlight(gl: Any) -> None:
    base, f0, m = np.array([0.8, 0.6, 0.4]), np.array([0.04, 0.05, 0.06]), 0.25
    got = seen(gl, Material("ggx", tuple(base), specular=tuple(f0), metallic=m))
    np.testing.assert_allclose(got["g_diffuse"][:3], 0.75 * base, rtol=1e-6)
    np.testing.assert_allclose(got["g_specular"], [*(0.75 * f0 + 0.25 * base), m], rtol=1e-6)


def place(got: dict[str, Array], field: str) -> Any:
    """What the G-buffer says of one field of a GGX material, in the material's terms."""
    return {
        "diffuse": lambda: got["g_diffuse"][:3],
        "specular": lambda: got["g_specular"][:3],
        "emission": lambda: got["hdr"][:3],
        "metallic": lambda: got["g_specular"][3],
        "roughness": lambda: math.sqrt(-got["g_diffuse"][3]),
        "clearcoat": lambda: got["g_extra"][0],
        "clearcoat_roughness": lambda: math.sqrt(got["g_extra"][1]),
        "occlusion": lambda: got["hdr"][0] * math.pi,  # under 1 lx on white
    }[field]()


COLOURS = ("diffuse", "specular", "emission")
SCALARS = ("metallic", "roughness", "clearcoat", "clearcoat_roughness", "occlusion")


def value(gl: Any, field: str, **fields: Any) -> Any:
    """What is seen of one field of a material that is white, under 1 lx if that matters."""
    made = Material("ggx", **({"diffuse": (1.0, 1.0, 1.0)} | fields))
    ambient = (1.0, 1.0, 1.0) if field == "occlusion" else (0.0, 0.0, 0.0)
    return place(seen(gl, made, ambient=ambient), field)


@pytest.mark.parametrize("field", COLOURS)
def test_map_of_a_colour(gl: Any, field: str) -> None:
    fields = {f"{field}_map": use(scale=(0.5, 2.0, 1.0, 1.0), bias=(0.25, -0.125, 0.0, 0.0))}
    got = value(gl, field, **fields)
    np.testing.assert_allclose(got, [0.5, 0.375, 0.75], rtol=1e-6)


@pytest.mark.parametrize("field", COLOURS)
@pytest.mark.parametrize("channel", range(4))
def test_one_channel_as_a_colour(gl: Any, field: str, channel: int) -> None:
    scale, bias = (0.5, 0.25, 1.0, 2.0), (0.1, 0.2, 0.05, 0.0)
    got = value(gl, field, **{f"{field}_map": use(channel=channel, scale=scale, bias=bias)})
    wanted = TEXEL[channel] * scale[channel] + bias[channel]
    np.testing.assert_allclose(got, [wanted] * 3, rtol=1e-6)


@pytest.mark.parametrize("field", SCALARS)
@pytest.mark.parametrize("channel", range(-1, 4))
def test_map_of_a_number(gl: Any, field: str, channel: int) -> None:
    """Without a channel it is red; the value of the field counts no more."""
    scale, bias = (0.5, 0.25, 1.0, 2.0), (0.1, 0.2, 0.05, 0.0)
    maps = {f"{field}_map": use(channel=channel, scale=scale, bias=bias), field: 0.9}
    k = max(channel, 0)
    assert value(gl, field, **maps) == pytest.approx(TEXEL[k] * scale[k] + bias[k], rel=1e-6)


@pytest.mark.parametrize("field", ["diffuse", "specular"])
def test_reflectances_stay_in_their_range(gl: Any, field: str) -> None:
    """(0.5, 0.25, 0.75) by (3, 2, 1) less (0, 0.75, 0) is (1.5, -0.25, 0.75)."""
    scale, bias = (3.0, 2.0, 1.0, 1.0), (0.0, -0.75, 0.0, 0.0)
    got = value(gl, field, **{f"{field}_map": use(scale=scale, bias=bias)})
    np.testing.assert_allclose(got, [1.0, 0.0, 0.75], rtol=1e-6)


@pytest.mark.parametrize("field", SCALARS)
@pytest.mark.parametrize(("bias", "wanted"), [(-2.0, 0.0), (5.0, 1.0)])
def test_numbers_stay_in_their_range(gl: Any, field: str, bias: float, wanted: float) -> None:
    got = value(gl, field, **{f"{field}_map": use(bias=(bias,) * 4)})
    smooth = math.sqrt(1e-3) if "roughness" in field else 0.0  # alpha does not go below 0.001
    assert got == pytest.approx(max(wanted, smooth), rel=1e-6)


@pytest.mark.parametrize("field", [*COLOURS, *SCALARS])
def test_missing_texture_is_its_fallback(gl: Any, field: str) -> None:
    """By scale and bias as what it stands for, in the channel that is asked for."""
    gone = use("gone.png", fallback=(0.2, 0.4, 0.6, 0.8), scale=(0.5,) * 4, bias=(0.1,) * 4)
    got = value(gl, field, **{f"{field}_map": gone})
    np.testing.assert_allclose(got, [0.2, 0.3, 0.4] if field in COLOURS else 0.2, rtol=1e-6)


def test_ten_maps_at_once(gl: Any) -> None:
    """Every field from a texture of its own: as many texture units as ever are needed."""
    channels = {"metallic": 1, "roughness": 2, "clearcoat": 3, "clearcoat_roughness": 0}
    maps = {
        f"{field}_map": use(f"{field}.exr", channel=channels.get(field, -1))
        for field in (*COLOURS, *SCALARS, "opacity")
    }
    normal = use("normal.exr", scale=(0.0,) * 4, bias=(0.0, 0.0, 1.0, 0.0))
    made = Material("ggx", normal_map=normal, opacity_threshold=0.4, **maps)
    got = seen(gl, made)
    rgb, metal = TEXEL[:3], TEXEL[1]
    np.testing.assert_allclose(got["g_normal"][:3], [0.0, 0.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(got["g_diffuse"][:3], rgb * (1 - metal), rtol=1e-6)
    assert got["g_diffuse"][3] == pytest.approx(-(TEXEL[2] ** 2), rel=1e-6)
    np.testing.assert_allclose(got["g_specular"], [*rgb, metal], rtol=1e-6)
    np.testing.assert_allclose(got["g_extra"][:2], [TEXEL[3], TEXEL[0] ** 2], rtol=1e-6)
    np.testing.assert_allclose(got["hdr"][:3], rgb, rtol=1e-6)  # of emission


def test_channels_of_one_texture_with_several_meanings(gl: Any) -> None:
    """Occlusion, roughness, metallic in one file, as glTF has them."""
    made = Material(
        "ggx",
        diffuse=(1.0, 1.0, 1.0),
        occlusion_map=use(channel=0),
        roughness_map=use(channel=1),
        metallic_map=use(channel=2),
    )
    got = seen(gl, made, ambient=(math.pi,) * 3)
    whole = seen(gl, replace(made, occlusion_map=None), ambient=(math.pi,) * 3)
    assert got["hdr"][0] == pytest.approx(TEXEL[0] * whole["hdr"][0], rel=1e-6)
    assert got["g_diffuse"][3] == pytest.approx(-(TEXEL[1] ** 2), rel=1e-6)
    assert got["g_specular"][3] == pytest.approx(TEXEL[2], rel=1e-6)


def test_occlusion_takes_ambient_and_nothing_else(gl: Any) -> None:
    made = Material(diffuse=(0.5, 0.5, 0.5), emission=(7.0, 7.0, 7.0), occlusion=0.25)
    got = seen(gl, made, ambient=(10.0, 20.0, 30.0))
    np.testing.assert_allclose(
        got["hdr"][:3], 7.0 + 0.25 * 0.5 * np.array([10, 20, 30]) / math.pi, rtol=1e-6
    )
    np.testing.assert_allclose(got["g_diffuse"][:3], 0.5)


def test_links_and_coat_of_each_draw(gl: Any) -> None:
    bits = 0b1010_0101_0000_0001_0000_0011
    made = scene(Material("ggx", clearcoat=0.75, clearcoat_roughness=0.5))
    linked = replace(made, draws=(replace(made.draws[0], links=bits),))
    found = gbuffer(gl, linked)
    assert found["g_extra"][24, 32].tolist() == [0.75, 0.25, float(bits), 0.0]


def test_light_of_a_sky_depends_on_the_normal(gl: Any) -> None:
    """Instead of ``ambient``, by the same function as in NumPy; of a wall that faces +Z."""
    coefficients = np.random.default_rng(9).uniform(0.0, 5.0, (18, 3)).astype(np.float32)
    coefficients[0] = 100.0
    got = seen(gl, Material(diffuse=(0.5, 0.25, 1.0)), coefficients, ambient=(9.0, 9.0, 9.0))
    lux = ambient_lux(np.array([0.0, 0.0, 1.0]), coefficients.astype(np.float64))
    np.testing.assert_allclose(
        got["hdr"][:3], np.array([0.5, 0.25, 1.0]) * lux / math.pi, rtol=1e-5
    )


def test_material_that_changes_between_frames(gl: Any) -> None:
    """Values, maps and texture coordinate sets of a kept geometry follow the scene."""
    from small_scenes import HEIGHT, WIDTH

    from hdrusd.gpu.hdr import HdrRenderer
    from hdrusd.gpu.program import Programs

    renderer = HdrRenderer(gl, Programs(gl), (WIDTH, HEIGHT), load)
    geometry = quad(uvs={"st": lambda st: st, "two": lambda st: st})
    places = (draw(geometry),)
    for made, wanted in (
        (Material(diffuse=(0.9, 0.8, 0.7)), (0.9, 0.8, 0.7)),
        (Material(diffuse=(0.1, 0.2, 0.3)), (0.1, 0.2, 0.3)),
        (Material(diffuse_map=use()), TEXEL[:3]),
        (Material(diffuse_map=use(uv_set="two"), emission_map=use()), TEXEL[:3]),
        (Material(diffuse=(0.4, 0.4, 0.4)), (0.4, 0.4, 0.4)),
    ):
        renderer.render(RenderScene(draws=places, materials=(made,), camera=look()))
        got = renderer.layer("g_diffuse")[24, 32, :3]
        np.testing.assert_allclose(got, wanted, rtol=1e-6)
    gl.extra["framebuffer"].use()
