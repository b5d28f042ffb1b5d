"""Convert, then render: normal, gloss, metal, coat and occlusion maps by closed forms in cd/m2."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from builders import obj, png
from converted import material, opened, run, sidecar, surface, texture_file, texture_node
from gltf_square import SUN_LUX, TOWARDS_SUN, matt, square
from lit_ground import findings, seen

from hdrusd.images import read_image

Array = npt.NDArray[np.float64]

#: Of the ground's 64 x 48 pixels those that show the square, without its rim.
MIDDLE = (slice(16, 32), slice(24, 40))

#: Directions between texels: 2^-12 of a half float, twice that by the scale, in three components;
#: differences of positions over the screen, 1e-4 (tests/gpu/test_gbuffer_normals.py).
DIRECTION = 2 * math.sqrt(3) * 2**-12 + 1e-4

#: The rounding of a direction to 8 bits: half a code of 2 / 255, in three components.
EIGHT_BITS = math.sqrt(3) / 255

#: The normal (sin a, 0, cos a) and the like: towards +u, -u, and up and down in the picture.
TILTS = {
    "+u": (0.6, 0.0, 0.8),
    "-u": (-0.6, 0.0, 0.8),
    "up": (0.0, 0.6, 0.8),
    "down": (0, -0.6, 0.8),
}


def codes(normal: Any) -> npt.NDArray[np.uint8]:
    """A picture of one normal."""
    texel = np.round((np.asarray(normal) + 1.0) * 127.5).astype(np.uint8)
    return np.tile(texel, (4, 4, 1))


def stored(normal: Any, strength: float = 1.0) -> Array:
    """The unit vector that its codes mean (glTF 2.0, section 3.9.3)."""
    vector = codes(normal)[0, 0] / 127.5 - 1.0
    vector = vector * [strength, strength, 1.0]
    return np.asarray(vector / np.linalg.norm(vector))


def nits(reflectance: float, normal: Any) -> float:
    """cd/m2 of a matt surface in the sun."""
    return reflectance / math.pi * SUN_LUX * float(np.dot(normal, TOWARDS_SUN))


def middle(gl: Any, path: Path) -> Array:
    """cd/m2 of the square, converted and rendered."""
    return seen(gl, run(path))[MIDDLE]


# -- normal maps --------------------------------------------------------------------------


@pytest.mark.parametrize("tilt", TILTS)
def test_a_tilted_normal_is_lit_by_its_cosine(gl: Any, tmp_path: Path, tilt: str) -> None:
    png(tmp_path / "n.png", codes(TILTS[tilt]))
    found = middle(gl, square(tmp_path, matt(0.5), normalTexture={"index": 0}, picture="n.png"))
    full = 0.5 / math.pi * SUN_LUX
    np.testing.assert_allclose(found, nits(0.5, stored(TILTS[tilt])), atol=full * DIRECTION)
    np.testing.assert_allclose(found, nits(0.5, TILTS[tilt]), atol=full * (EIGHT_BITS + DIRECTION))


#: Coordinates (u, v), v down, of the corners below left, right, above right, left; and where +u
#: and up of the picture then lie in the world.
LAYOUTS = {
    "mirrored in u": ([[1, 1], [0, 1], [0, 0], [1, 0]], (-1, 0), (0, 1)),
    "mirrored in v": ([[0, 0], [1, 0], [1, 1], [0, 1]], (1, 0), (0, -1)),
    "a quarter turn": ([[0, 0], [0, 1], [1, 1], [1, 0]], (0, 1), (-1, 0)),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("tilt", ["+u", "up"])
def test_tilts_follow_the_picture_as_it_lies(
    gl: Any, tmp_path: Path, layout: str, tilt: str
) -> None:
    png(tmp_path / "n.png", codes(TILTS[tilt]))
    uv, across, up = LAYOUTS[layout]
    path = square(tmp_path, matt(0.5), normalTexture={"index": 0}, picture="n.png", uv=uv)
    x, y, z = stored(TILTS[tilt])
    wanted = nits(0.5, [*(x * np.array(across) + y * np.array(up)), z])
    np.testing.assert_allclose(middle(gl, path), wanted, atol=0.5 / math.pi * SUN_LUX * DIRECTION)


@pytest.mark.parametrize("strength", [0.25, 1.5])
def test_the_strength_of_a_normal_map_scales_x_and_y(
    gl: Any, tmp_path: Path, strength: float
) -> None:
    png(tmp_path / "n.png", codes(TILTS["+u"]))
    info = {"index": 0, "scale": strength}
    found = middle(gl, square(tmp_path, matt(0.5), normalTexture=info, picture="n.png"))
    wanted = nits(0.5, stored(TILTS["+u"], strength))
    np.testing.assert_allclose(found, wanted, atol=0.5 / math.pi * SUN_LUX * 1.5 * DIRECTION)


def test_a_turned_picture_turns_its_tilts(gl: Any, tmp_path: Path) -> None:
    """KHR_texture_transform, 30 degrees: u grows along (cos, sin) of (u, v), v down."""
    png(tmp_path / "n.png", codes(TILTS["up"]))
    turn = {"KHR_texture_transform": {"rotation": math.radians(30.0), "scale": [2, 2]}}
    info = {"index": 0, "extensions": turn}
    found = middle(gl, square(tmp_path, matt(0.5), normalTexture=info, picture="n.png"))
    x, y, z = stored(TILTS["up"])
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    # u' = c u + s v, v' = -s u + c v; the world's x is u and its y is -v.
    wanted = nits(0.5, x * np.array([c, -s, 0]) + y * np.array([s, c, 0]) + [0, 0, z])
    np.testing.assert_allclose(found, wanted, atol=0.5 / math.pi * SUN_LUX * DIRECTION)


def test_a_legacy_highlight_meets_the_normal_map_too(gl: Any, tmp_path: Path) -> None:
    """MTL's norm below Blinn and Phong's highlight: the matt part by the tilted cosine."""
    png(tmp_path / "n.png", codes(TILTS["+u"]))
    sun = (
        'def DistantLight "Sun"\n{\n    float inputs:intensity = 100\n'
        "    float inputs:angle = 0.53\n    float xformOp:rotateY = 30\n"
        '    uniform token[] xformOpOrder = ["xformOp:rotateY"]\n}'
    )
    lit = {}
    for name, norm in (("flat", ""), ("bumpy", "norm n.png\n")):
        result = run(obj(tmp_path / f"{name}.obj", f"Kd 0.5 0.5 0.5\nNs 20\n{norm}"))
        lit[name] = seen(gl, result, sun)[10:20, 36:44]
        prim = material(opened(result)).GetPrim()
        assert prim.GetAttribute("legacy:shininess").Get() == 20.0
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    x, _, z = stored(TILTS["+u"])
    wanted = (x * s + z * c) / c
    np.testing.assert_allclose(lit["bumpy"] / lit["flat"], wanted, atol=DIRECTION / c)


# -- numbers in a channel -----------------------------------------------------------------

#: A polished metal would mirror the sun: rough enough that its lobe is smooth over the square.
ROUGH, METAL = 0.5, 0.75


def frames(gl: Any, folder: Path, *materials: dict[str, Any], **pictures: Any) -> list[Array]:
    """The square in each of the materials."""
    made = []
    for number, look in enumerate(materials):
        below = folder / str(number)
        below.mkdir()
        for name, pixels in pictures.items():
            png(below / f"{name}.png", np.tile(np.array(pixels, np.uint8), (4, 4, 1)))
        made.append(middle(gl, square(below, look, picture="p.png")))
    return made


def pbr(base: float = 0.5, **more: Any) -> dict[str, Any]:
    factors = {"baseColorFactor": [base, base, base, 1.0], **more}
    return {"pbrMetallicRoughness": factors}


def test_white_channels_are_the_factors_and_others_do_not_count(gl: Any, tmp_path: Path) -> None:
    factors = {"roughnessFactor": ROUGH, "metallicFactor": METAL}
    constant, mapped = frames(
        gl,
        tmp_path,
        pbr(**factors),
        pbr(**factors, metallicRoughnessTexture={"index": 0}),
        p=[13, 255, 255],
    )
    assert constant.min() > 0.0
    np.testing.assert_array_equal(mapped, constant)


def test_codes_are_shares_of_the_factors_without_gamma(gl: Any, tmp_path: Path) -> None:
    rough, metal = 128 / 255, 64 / 255
    constant, mapped = frames(
        gl,
        tmp_path,
        pbr(roughnessFactor=0.8 * rough, metallicFactor=0.9 * metal),
        pbr(roughnessFactor=0.8, metallicFactor=0.9, metallicRoughnessTexture={"index": 0}),
        p=[200, 128, 64],
    )
    # A lobe's peak is as roughness^-4, and a half float is off by 2^-12.
    np.testing.assert_allclose(mapped, constant, rtol=5 * 2**-12)


def test_glossiness_is_in_the_alpha_and_specular_in_the_colour(gl: Any, tmp_path: Path) -> None:
    """Its roughness is 1 - gloss a; F0 = T^2.2 specular."""

    def glossy(**more: Any) -> dict[str, Any]:
        factors = {"diffuseFactor": [0.2, 0.2, 0.2, 1.0], **more}
        return {"extensions": {"KHR_materials_pbrSpecularGlossiness": factors}}

    tint = [0.5 * (c / 255) ** 2.2 for c in (255, 180, 90)]
    constant, mapped = frames(
        gl,
        tmp_path,
        glossy(specularFactor=tint, glossinessFactor=0.75 * 128 / 255),
        glossy(
            specularFactor=[0.5, 0.5, 0.5],
            glossinessFactor=0.75,
            specularGlossinessTexture={"index": 0},
        ),
        p=[255, 180, 90, 128],
    )
    np.testing.assert_allclose(mapped, constant, rtol=6 * 2**-11)


def test_a_clear_coat_by_its_channels(gl: Any, tmp_path: Path) -> None:
    def coated(**more: Any) -> dict[str, Any]:
        return matt(0.5) | {
            "extensions": matt(0.5)["extensions"] | {"KHR_materials_clearcoat": more}
        }

    bare, constant, mapped = frames(
        gl,
        tmp_path,
        matt(0.5),
        coated(clearcoatFactor=128 / 255, clearcoatRoughnessFactor=0.9 * 200 / 255),
        coated(
            clearcoatFactor=1.0,
            clearcoatTexture={"index": 0},
            clearcoatRoughnessFactor=0.9,
            clearcoatRoughnessTexture={"index": 0},
        ),
        p=[128, 200, 7],
    )
    np.testing.assert_allclose(mapped, constant, rtol=6 * 2**-12)
    assert np.abs(constant / bare - 1.0).min() > 1e-3


def test_an_index_of_refraction_is_a_reflectance(tmp_path: Path) -> None:
    """F0 of glass of n = 2 is 1 / 9; with a specular factor of 0.36, 0.04: n is 1.5 again."""
    result = run(square(tmp_path, pbr(metallicFactor=0.0) | ior(2.0, specularFactor=0.36)))
    assert surface(opened(result), "paint").GetInput("ior").Get() == pytest.approx(1.5, rel=1e-6)
    assert findings(result, "gltf-specular")


def ior(value: float, **specular: Any) -> dict[str, Any]:
    return {"extensions": {"KHR_materials_ior": {"ior": value}, "KHR_materials_specular": specular}}


# -- occlusion ----------------------------------------------------------------------------


@pytest.mark.parametrize("strength", [1.0, 0.25])
def test_occlusion_scales_the_sky_and_no_lamp(gl: Any, tmp_path: Path, strength: float) -> None:
    """L = R / pi (E_sky (1 + strength (x - 1)) + E_sun cos)."""
    sidecar(tmp_path, "[ambient]\nilluminance = 40\n")
    png(tmp_path / "ao.png", np.full((4, 4, 3), [102, 255, 255], np.uint8))
    info = {"index": 0, "strength": strength}
    found = middle(gl, square(tmp_path, matt(0.5), occlusionTexture=info, picture="ao.png"))
    share = 1.0 + strength * (102 / 255 - 1.0)
    wanted = 0.5 / math.pi * 40.0 * share + nits(0.5, (0, 0, 1))
    np.testing.assert_allclose(found, wanted, rtol=2**-12)


# -- the files ----------------------------------------------------------------------------


def test_data_are_copied_bit_by_bit_and_once(tmp_path: Path) -> None:
    orm = png(tmp_path / "orm.png", np.full((4, 4, 3), [10, 20, 30], np.uint8)).read_bytes()
    source = pbr(metallicRoughnessTexture={"index": 0})
    path = square(tmp_path, source, occlusionTexture={"index": 0}, picture="orm.png")
    result = run(path)
    shader = surface(opened(result))
    files = {texture_file(shader, name) for name in ("metallic", "roughness", "occlusion")}
    (file,) = files
    assert file.read_bytes() == orm
    assert [f.name for f in file.parent.iterdir()] == [file.name]
    for name, channel in (("metallic", "b"), ("roughness", "g"), ("occlusion", "r")):
        node = texture_node(shader, name)
        assert node is not None
        assert node.GetInput("sourceColorSpace").Get() == "raw"
        (fed,), _ = shader.GetInput(name).GetConnectedSources()
        assert fed.sourceName == channel
    (row,) = result.images
    assert (row["name"], row["class"], row["also"]) == ("orm.png", "data", [])
    assert row["files"] == [file.name]


def test_sixteen_bits_of_another_format_are_kept(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    texels = np.array([[[0, 257, 32_769], [65_535, 1, 40_000]]], np.uint16)
    out = oiio.ImageOutput.create(str(tmp_path / "deep.tif"))
    out.open(str(tmp_path / "deep.tif"), oiio.ImageSpec(2, 1, 3, oiio.UINT16))
    out.write_image(texels)
    out.close()
    result = run(obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5\nnorm deep.tif"))
    shader = surface(opened(result))
    found = read_image(texture_file(shader, "normal")).pixels
    # A float32 has 24 bits.
    np.testing.assert_allclose(found, texels / 65_535, rtol=2**-23)


def test_a_missing_picture_leaves_the_numbers(gl: Any, tmp_path: Path) -> None:
    source = pbr(roughnessFactor=0.5, metallicRoughnessTexture={"index": 0})
    result = run(square(tmp_path, source, normalTexture={"index": 0}, picture="../none.png"))
    assert findings(result, "file-missing")
    shader = surface(opened(result))
    assert shader.GetInput("roughness").Get() == 0.5
    assert not shader.GetInput("normal")
    kept = json.loads(shader.GetPrim().GetParent().GetCustomDataByKey("hdrusd:extras"))
    assert kept["normal_map"] == kept["roughness_map"] == "../none.png"


def test_what_the_photometry_file_states_takes_the_maps_place(tmp_path: Path) -> None:
    stated = "roughness = 0.25\nspecular = [0.1, 0.1, 0.1]"
    sidecar(tmp_path, f'[[material]]\nmatch = "paint"\n{stated}\n')
    png(tmp_path / "p.png")
    source = pbr(metallicRoughnessTexture={"index": 0})
    result = run(square(tmp_path, source, normalTexture={"index": 0}, picture="p.png"))
    shader = surface(opened(result))
    assert texture_node(shader, "roughness") is None
    assert shader.GetInput("roughness").Get() == 0.25
    assert tuple(shader.GetInput("specularColor").Get()) == pytest.approx((0.1,) * 3)
    assert not shader.GetInput("metallic")
    assert texture_node(shader, "normal") is not None


def test_a_coat_stays_over_a_stated_specular_reflectance(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nspecular = [0.1, 0.1, 0.1]\n')
    png(tmp_path / "p.png")
    coat = {"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 0}}
    source = pbr() | {"extensions": {"KHR_materials_clearcoat": coat}}
    shader = surface(opened(run(square(tmp_path, source, picture="p.png"))))
    assert shader.GetInput("useSpecularWorkflow").Get() == 1
    assert shader.GetInput("clearcoat").Get() == 0.5
    assert texture_file(shader, "clearcoat").is_file()


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_heights_in_the_place_of_normals_are_left_out(tmp_path: Path, channels: int) -> None:
    heights = np.tile(np.arange(0, 256, 16, dtype=np.uint8).reshape(4, 4, 1), (1, 1, channels))
    png(tmp_path / "n.png", heights)
    result = run(square(tmp_path, matt(0.5), normalTexture={"index": 0}, picture="n.png"))
    assert not surface(opened(result)).GetInput("normal")
    assert findings(result, "normal-grey") == [
        "n.png is grey, so heights and no directions; left out"
    ]


def test_a_lamp_has_no_maps(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 100\n')
    png(tmp_path / "p.png")
    source = pbr(metallicRoughnessTexture={"index": 0})
    result = run(square(tmp_path, source, normalTexture={"index": 0}, picture="p.png"))
    shader = surface(opened(result))
    assert not shader.GetInput("normal")
    assert not shader.GetInput("metallic")
    (row,) = result.images
    assert row["class"] == "unused"
