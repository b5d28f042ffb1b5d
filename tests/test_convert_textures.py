"""Convert: reflectance maps, HDR textures, what a surface sends back and sends out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders import CODES, obj, png
from converted import (
    luminance,
    material,
    opened,
    run,
    sidecar,
    surface,
    texture_file,
    texture_node,
)
from pxr import Gf, Usd, UsdLux, UsdShade

from hdrusd.conversion import Result
from hdrusd.images import read_exr, read_image
from hdrusd.units import LUMINANCE_WEIGHTS

# -- materials and textures ---------------------------------------------------------------


def test_a_texture_becomes_a_linear_reflectance_map(tmp_path: Path) -> None:
    png(tmp_path / "wall.png")
    result = run(obj(tmp_path / "wall.obj", "Kd 0.5 1 0.25\nmap_Kd wall.png"))
    stage = opened(result)
    file = texture_file(surface(stage), "diffuseColor")
    assert file.suffix == ".exr"
    rgb, header = read_exr(file)
    # R = T^2.2 D; a half float has 11 bits: 2^-12 of relative rounding, 2^-25 at the low end.
    wanted = (CODES / 255.0) ** 2.2 * [0.5, 1.0, 0.25]
    assert rgb == pytest.approx(wanted, rel=2**-11, abs=2**-25)
    assert "whiteLuminance" not in header  # a reflectance is no luminance
    node = texture_node(surface(stage), "diffuseColor")
    assert node is not None
    assert node.GetInput("sourceColorSpace").Get() == "raw"
    prim = material(stage).GetPrim()
    assert prim.GetAttribute("photometric:gamma").Get() == pytest.approx(2.2)
    assert prim.GetAttribute("photometric:diffuse").Get() == Gf.Vec3f(0.5, 1.0, 0.25)
    kept = Path(prim.GetAttribute("photometric:sourceTexture").Get().resolvedPath)
    assert kept.read_bytes() == (tmp_path / "wall.png").read_bytes()


def test_a_missing_picture_and_a_name_that_usd_has_not_are_kept(tmp_path: Path) -> None:
    (tmp_path / "broken.png").write_text("no picture")
    file = obj(tmp_path / "wall.obj", "map_Kd maps\\Wall.TGA\nmap_Ke broken.png")
    library = tmp_path / "wall.mtl"
    library.write_text(library.read_text().replace("paint", "wände"))
    file.write_text(file.read_text().replace("paint", "wände"))
    (prim,) = (p for p in opened(run(file)).Traverse() if p.IsA(UsdShade.Material))
    assert prim.GetDisplayName() == "wände"
    kept = json.loads(prim.GetCustomDataByKey("hdrusd:extras"))
    assert kept["diffuse_map"] == "maps\\Wall.TGA"
    assert kept["emission_map"] == "broken.png"


@pytest.mark.parametrize(("option", "gamma"), [(None, 1.8), (2.4, 2.4)])
def test_gamma_comes_from_the_command_line_else_from_the_file(
    tmp_path: Path, option: float | None, gamma: float
) -> None:
    png(tmp_path / "wall.png")
    sidecar(tmp_path, "gamma = 1.8\n")
    result = run(obj(tmp_path / "wall.obj", "Kd 1 1 1\nmap_Kd wall.png"), gamma=option)
    rgb, _ = read_exr(texture_file(surface(opened(result)), "diffuseColor"))
    assert rgb[0, 1, 0] == pytest.approx((128 / 255) ** gamma, rel=2**-11)


def shared_texture(folder: Path, first: str, second: str) -> Result:
    png(folder / "wall.png")
    (folder / "two.mtl").write_text(
        f"newmtl a\nKd {first}\nmap_Kd wall.png\nnewmtl b\nKd {second}\nmap_Kd wall.png\n"
    )
    (folder / "two.obj").write_text(
        "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
        "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 3/3 2/2 1/1\n"
    )
    return run(folder / "two.obj")


@pytest.mark.parametrize(("second", "count"), [("0.5 0.5 0.5", 1), ("0.5 0.5 0.25", 2)])
def test_a_shared_texture_is_converted_once_for_each_diffuse_colour(
    tmp_path: Path, second: str, count: int
) -> None:
    result = shared_texture(tmp_path, "0.5 0.5 0.5", second)
    kinds = [made["kind"] for made in result.textures.values()]
    assert kinds.count("reflectance") == count
    assert kinds.count("look") == 1
    on_disk = {p.name for p in (tmp_path / "two.textures").iterdir()}
    assert on_disk == set(result.textures)


def test_alpha_is_untouched(tmp_path: Path) -> None:
    pixels = np.dstack([np.full((2, 2, 3), 200, np.uint8), np.array([[0, 85], [170, 255]])])
    png(tmp_path / "leaf.png", pixels.astype(np.uint8))
    result = run(obj(tmp_path / "leaf.obj", "Kd 1 1 1\nmap_Kd leaf.png\nmap_d leaf.png"))
    shader = surface(opened(result))
    map_pixels = np.asarray(read_image(texture_file(shader, "diffuseColor")).pixels, float)
    assert map_pixels[..., 3] == pytest.approx(np.array([[0, 1 / 3], [2 / 3, 1]]), abs=2**-12)
    assert map_pixels[..., :3] == pytest.approx((200 / 255) ** 2.2, rel=2**-11)
    opacity = texture_node(shader, "opacity")
    assert opacity is not None
    assert opacity.GetInput("sourceColorSpace").Get() == "raw"
    (source,), _ = shader.GetInput("opacity").GetConnectedSources()
    assert source.sourceName == "a"
    codes = np.asarray(read_image(texture_file(shader, "opacity")).pixels)[..., 3]
    assert codes.tolist() == [[0, 85], [170, 255]]


def test_reflectance_above_one_is_clipped_and_counted(tmp_path: Path) -> None:
    png(tmp_path / "wall.png")
    result = run(obj(tmp_path / "wall.obj", "Kd 2 1 1\nmap_Kd wall.png"))
    (finding,) = [f for f in result.report if f.code == "reflectance-clipped"]
    # Red codes 0, 128, 255, 200: T^2.2 = 0, 0.219, 1, 0.586; doubled, two are above 1.
    assert "50 %" in finding.text
    stage = opened(result)
    rgb, _ = read_exr(texture_file(surface(stage), "diffuseColor"))
    assert rgb[1, :, 0].tolist() == [1.0, 1.0]
    assert rgb[0, 1, 0] == pytest.approx(2 * (128 / 255) ** 2.2, rel=2**-11)
    assert [made["clipped_texels"] for made in result.textures.values() if "diffuse" in made] == [2]
    assert material(stage).GetPrim().GetAttribute("photometric:diffuse").Get()[0] == 1.0


@pytest.mark.parametrize("mtl", ["Kd 1.5 0.5 0.5", "Kd -1 0 0", "Kd 0.5 0.5 0.5\nKs 3 0 0\nNs 20"])
def test_colours_out_of_range_are_clipped_and_the_stage_is_valid(tmp_path: Path, mtl: str) -> None:
    result = run(obj(tmp_path / "wall.obj", mtl))
    assert result.report.codes() & {"diffuse-clipped", "specular-clipped"}
    stage = opened(result)
    shader = surface(stage)
    for name in ("diffuseColor", "specularColor"):
        value = shader.GetInput(name).Get()
        assert min(value) >= 0.0
        assert max(value) <= 1.0


def test_sixteen_bit_pictures_are_codes_too(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    codes = np.array([[[0, 32_768, 65_535]]], np.uint16)
    out = oiio.ImageOutput.create(str(tmp_path / "deep.png"))
    out.open(str(tmp_path / "deep.png"), oiio.ImageSpec(1, 1, 3, oiio.UINT16))
    out.write_image(codes)
    out.close()
    result = run(obj(tmp_path / "deep.obj", "Kd 1 1 1\nmap_Kd deep.png"))
    rgb, _ = read_exr(texture_file(surface(opened(result)), "diffuseColor"))
    assert rgb[0, 0] == pytest.approx((codes[0, 0] / 65_535) ** 2.2, rel=2**-11)


def test_an_hdr_texture_peaks_at_the_lamps_luminance(tmp_path: Path) -> None:
    png(tmp_path / "sign.png", CODES[:1])  # black and code 128
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 12000\nhdr_texture = true\n')
    result = run(obj(tmp_path / "sign.obj", "Kd 0.1 0.1 0.1\nmap_Kd sign.png"))
    stage = opened(result)
    shader = surface(stage)
    rgb, _ = read_exr(texture_file(shader, "emissiveColor"))
    node = texture_node(shader, "emissiveColor")
    assert node is not None
    shown = rgb * np.array(node.GetInput("scale").Get())[:3]
    assert (shown @ LUMINANCE_WEIGHTS).max() == pytest.approx(12_000.0, rel=2**-11)
    assert shown[0, 0].tolist() == [0.0, 0.0, 0.0]
    assert node.GetInput("sourceColorSpace").Get() == "raw"
    # It replaces the reflection (Figure 2 of the paper).
    assert shader.GetInput("diffuseColor").Get() == Gf.Vec3f(0.0)
    assert texture_node(shader, "diffuseColor") is None
    assert shader.GetInput("specularColor").Get() == Gf.Vec3f(0.0)
    prim = material(stage).GetPrim()
    assert prim.GetAttribute("photometric:luminance").Get() == 12_000.0
    assert prim.GetAttribute("photometric:hdrTexture").Get().resolvedPath


def test_an_hdr_texture_in_coloured_light_peaks_all_the_same(tmp_path: Path) -> None:
    # Red and green texels behind a red filter: only the red one shines.
    pixels = np.array([[[255, 0, 0], [0, 255, 0]]], np.uint8)
    png(tmp_path / "tail.png", pixels)
    sidecar(
        tmp_path,
        '[[material]]\nmatch = "paint"\nluminance = 500\nhdr_texture = true\ncolor = [1, 0, 0]\n',
    )
    shader = surface(opened(run(obj(tmp_path / "tail.obj", "Kd 1 1 1\nmap_Kd tail.png"))))
    rgb, _ = read_exr(texture_file(shader, "emissiveColor"))
    node = texture_node(shader, "emissiveColor")
    assert node is not None
    shown = rgb * np.array(node.GetInput("scale").Get())[:3] @ LUMINANCE_WEIGHTS
    assert shown[0] == pytest.approx([500.0, 0.0], rel=2**-11)


def test_a_stated_luminance_is_the_surfaces(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 12000\ntemperature = 2700\n')
    stage = opened(run(obj(tmp_path / "glass.obj", "Kd 0.9 0.9 0.9\nKs 1 1 1")))
    glow = surface(stage).GetInput("emissiveColor").Get()
    assert luminance(glow) == pytest.approx(12_000.0, rel=1e-6)
    assert np.array(glow) / 12_000 == pytest.approx(
        np.array(UsdLux.BlackbodyTemperatureAsRgb(2700)), abs=1e-5
    )


def test_a_lamp_of_no_luminance_reflects(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 0\n')
    shader = surface(opened(run(obj(tmp_path / "glass.obj", "Kd 0.9 0.9 0.9\nKe 1 1 1"))))
    assert shader.GetInput("emissiveColor").Get() == Gf.Vec3f(0.0)
    assert shader.GetInput("diffuseColor").Get() == Gf.Vec3f(0.9)


def test_an_hdr_texture_without_a_texture_is_a_finding(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 5\nhdr_texture = true\n')
    result = run(obj(tmp_path / "glass.obj", "Kd 0.9 0.9 0.9"))
    assert "hdr-texture-missing" in result.report.codes()
    assert luminance(surface(opened(result)).GetInput("emissiveColor").Get()) == pytest.approx(5.0)


def test_a_rule_may_state_reflectance_and_gamma(tmp_path: Path) -> None:
    png(tmp_path / "wall.png")
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\ndiffuse = [0.5, 0, 1]\ngamma = 1\n')
    stage = opened(run(obj(tmp_path / "wall.obj", "Kd 1 1 1\nmap_Kd wall.png"), gamma=None))
    rgb, _ = read_exr(texture_file(surface(stage), "diffuseColor"))
    assert rgb[0, 1] == pytest.approx(128 / 255 * np.array([0.5, 0, 1]), rel=2**-11)


def test_vertex_colours_multiply_the_diffuse_colour(tmp_path: Path) -> None:
    from hdrusd.report import Report
    from hdrusd.usd.preview import MaterialReader

    (tmp_path / "c.mtl").write_text("newmtl paint\nKd 0.5 0.25 1\n")
    (tmp_path / "c.obj").write_text(
        "mtllib c.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nusemtl paint\nf 1 2 3\n"
    )
    result = run(tmp_path / "c.obj")
    stage = opened(result)
    made = MaterialReader(stage, Report()).read(material(stage), Usd.TimeCode(0))
    assert made is not None
    assert made.vertex_color == "displayColor"
    assert made.diffuse == pytest.approx((0.5, 0.25, 1.0))
    assert "vertex-color" in result.report.codes()


def test_a_missing_picture_leaves_the_colour(tmp_path: Path) -> None:
    (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n broken")
    for name, code in (("none.png", "file-missing"), ("broken.png", "image-broken")):
        result = run(obj(tmp_path / "wall.obj", f"Kd 0.5 0.5 0.5\nmap_Kd {name}"))
        assert code in result.report.codes()
        shader = surface(opened(result))
        assert texture_node(shader, "diffuseColor") is None
        assert shader.GetInput("diffuseColor").Get() == Gf.Vec3f(0.5)


@pytest.mark.parametrize(
    ("mtl", "code"),
    [
        ("Kd 0.5 0.5 0.5\nillum 0", "lighting-off"),
        ("Kd 0.9 0.9 0.9\nKs 0.5 0.5 0.5", "energy"),
        ("Kd 0.5 0.5 0.5\nKs 0.2 0.2 0.2\nPm 0.5", "specular-unused"),
    ],
)
def test_what_a_material_says_beyond_reflectance_is_a_finding(
    tmp_path: Path, mtl: str, code: str
) -> None:
    result = run(obj(tmp_path / "wall.obj", mtl))
    (finding,) = [finding for finding in result.report if finding.code == code]
    assert (finding.thing, finding.source.file.name) == ("paint", "wall.mtl")


def test_a_lamp_needs_no_word_about_its_reflection(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 5\n')
    result = run(obj(tmp_path / "wall.obj", "Kd 0.9 0.9 0.9\nKs 1 1 1\nillum 0"))
    assert not result.report.codes() & {"energy", "lighting-off"}


def test_pictures_of_no_portable_format_are_kept_as_png_with_their_alpha(tmp_path: Path) -> None:
    # An uncompressed TGA of 32 bits, top row first: blue, green, red, alpha.
    header = bytes([0, 0, 2, *[0] * 9, 2, 0, 1, 0, 32, 0x28])
    (tmp_path / "leaf.tga").write_bytes(header + bytes([30, 20, 10, 51, 60, 50, 40, 255]))
    result = run(obj(tmp_path / "wall.obj", "Kd 1 1 1\nmap_Kd leaf.tga"))
    (name,) = [name for name, made in result.textures.items() if made["kind"] == "look"]
    assert name.endswith(".png")
    pixels = read_image(result.output.parent / "wall.textures" / name).pixels
    assert pixels.tolist() == [[[10, 20, 30, 51], [40, 50, 60, 255]]]
