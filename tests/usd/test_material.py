"""Materials: what convert writes, and what any UsdPreviewSurface network means to shader 1."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import new_stage, paint, texture
from hypothesis import given
from hypothesis import strategies as st
from looks import DIFFUSE, PATH, TYPES, fed, network, read, reader, shown, transform, uv_texture
from pxr import Gf, Usd, UsdShade

from hdrusd.legacy.scene import UVTransform
from hdrusd.report import Report
from hdrusd.usd.material import Map, Surface, write_look, write_photometric
from hdrusd.usd.network import transform_2d
from hdrusd.usd.preview import (
    roughness_from_shininess,
    shininess_from_roughness,
)

RAW = 'token inputs:sourceColorSpace = "raw"'


# -- written and read ---------------------------------------------------------------------


def test_a_legacy_material_there_and_back() -> None:
    stage = new_stage()
    source = paint(specular=(0.1, 0.2, 0.3), shininess=32.0)
    write_photometric(
        stage, PATH, source, Surface((0.5, 0.25, 0.125), 2.2, specular=(0.1, 0.2, 0.3))
    )
    made = shown(stage)
    assert made.diffuse == (0.5, 0.25, 0.125)
    assert made.specular == pytest.approx((0.1, 0.2, 0.3))
    assert (made.model, made.shininess, made.metallic) == ("blinn", 32.0, 0.0)
    assert made.emission == (0.0, 0.0, 0.0)
    surface = UsdShade.Material(stage.GetPrimAtPath(PATH)).ComputeSurfaceSource()[0]
    # The plain value for other renderers: roughness = (2 / (n + 2))^(1/4).
    assert surface.GetInput("roughness").Get() == pytest.approx((2 / 34) ** 0.25)
    assert surface.GetInput("useSpecularWorkflow").Get() == 1


def test_a_lamp_replaces_reflection() -> None:
    stage = new_stage()
    surface = Surface(
        (0.9, 0.9, 0.9),
        2.2,
        specular=(1.0, 1.0, 1.0),
        emission=(300.0, 200.0, 100.0),
        luminance=214.04,
        replaces_reflection=True,
        provenance="measured",
        rule="photometry.toml:material[1]",
        source="a meter",
    )
    write_photometric(stage, PATH, paint(specular=(1.0, 1.0, 1.0)), surface)
    made = shown(stage)
    assert made.emission == (300.0, 200.0, 100.0)
    assert made.diffuse == made.specular == (0.0, 0.0, 0.0)
    prim = stage.GetPrimAtPath(PATH)
    assert prim.GetAttribute("photometric:luminance").Get() == pytest.approx(214.04)
    assert prim.GetAttribute("photometric:provenance").Get() == "measured"
    assert prim.GetAttribute("photometric:source").Get() == "a meter"


def test_metallic_and_roughness_there_and_back() -> None:
    stage = new_stage()
    source = paint(pbr={"metallic": 0.25, "roughness": 0.5})
    write_photometric(stage, PATH, source, Surface((0.5, 0.5, 0.5), 2.2))
    made = shown(stage)
    assert (made.model, made.metallic, made.roughness) == ("ggx", 0.25, 0.5)
    assert made.specular == pytest.approx((0.04, 0.04, 0.04))  # ior 1.5


def test_glossiness_is_one_minus_roughness_and_keeps_its_specular_colour() -> None:
    stage = new_stage()
    source = paint(pbr={"glossiness": 0.5}, specular=(0.3, 0.2, 0.1))
    surface = Surface((0.5, 0.5, 0.5), 2.2, specular=source.specular)
    write_photometric(stage, PATH, source, surface)
    made = shown(stage)
    assert made.specular == pytest.approx((0.3, 0.2, 0.1))
    assert (made.model, made.roughness) == ("ggx", 0.5)


def test_textures_their_wraps_and_coordinates_there_and_back(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    used = texture(
        uv_set="st1",
        wrap_s="clamp",
        wrap_t="mirror",
        transform=UVTransform((2.0, 3.0), 90.0, (0.5, 0.25)),
    )
    made_map = Map("./maps/R.exr", used, raw=True, scale=(2.0, 3.0, 4.0))
    write_photometric(stage, PATH, paint(), Surface((1, 1, 1), 2.2, diffuse_map=made_map))
    use = shown(stage).diffuse_map
    assert use is not None
    assert use.texture.file == str(tmp_path / "maps" / "R.exr")
    assert (use.texture.wrap_s, use.texture.wrap_t) == ("clamp", "mirror")
    assert use.texture.decode == "linear"
    assert use.uv_set == "st1"
    assert use.scale == (2.0, 3.0, 4.0, 1.0)
    # (1, 0) scaled to (2, 0), turned by a quarter to (0, 2), moved to (0.5, 2.25).
    matrix = np.reshape(use.matrix, (2, 3))
    assert matrix @ [1, 0, 1] == pytest.approx([0.5, 2.25])
    assert matrix @ [0, 1, 1] == pytest.approx([-2.5, 0.25])


def test_opacity_is_one_channel_times_alpha(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    mask = Map("./leaf.png", texture(channel="a"), raw=True)
    source = paint(alpha_mode="mask", alpha_cutoff=0.25, alpha=0.5)
    write_photometric(stage, PATH, source, Surface((1, 1, 1), 2.2, opacity_map=mask))
    made = shown(stage)
    assert made.opacity_map is not None
    assert made.opacity_map.channel == 3
    assert made.opacity_map.scale[3] == 0.5
    assert made.opacity_threshold == 0.25


@pytest.mark.parametrize("mode", ["opaque", "mask"])
def test_what_nothing_cuts_is_opaque(mode: Any) -> None:
    stage = new_stage()
    source = paint(alpha_mode=mode, alpha_cutoff=0.0, alpha=0.5)
    write_photometric(stage, PATH, source, Surface((1, 1, 1), 2.2))
    report = Report()
    made = shown(stage, report)
    assert (made.opacity, made.opacity_threshold) == (1.0, 0.0)
    assert not report.codes()


def test_the_look_shows_emission_as_an_ldr_picture_would() -> None:
    stage = new_stage()
    source = paint(emission=(20_000.0, 10_000.0, 0.0), emission_cd_m2=True)
    write_look(stage, PATH, source, {}, "")
    assert shown(stage).emission == (1.0, 0.5, 0.0)


def test_extras_are_kept_as_json() -> None:
    stage = new_stage()
    write_look(stage, PATH, paint(extras={"Ni": 1.5, "map_bump": ("a.png", 2)}), {}, "")
    text = stage.GetPrimAtPath(PATH).GetCustomDataByKey("hdrusd:extras")
    assert text == '{"Ni": 1.5, "map_bump": ["a.png", 2]}'


@given(st.floats(0.0, 1e4))
def test_shininess_and_roughness_are_inverse(shininess: float) -> None:
    # n + 2 is what goes there and back: eight roundings of 1.1e-16, relative to it.
    back = shininess_from_roughness(roughness_from_shininess(shininess))
    assert back == pytest.approx(shininess, rel=2e-15, abs=4e-15)


def test_a_mirror_is_bounded() -> None:
    assert shininess_from_roughness(0.0) == 1e5
    assert shininess_from_roughness(1.0) == 0.0


# -- strangers' networks ------------------------------------------------------------------


def test_an_empty_surface_has_usd_preview_surfaces_defaults(tmp_path: Path) -> None:
    made = shown(network(tmp_path, ""))
    assert made.diffuse == (0.18, 0.18, 0.18)
    assert made.specular == pytest.approx((0.04, 0.04, 0.04))
    assert (made.model, made.roughness, made.blend) == ("ggx", 0.5, False)
    assert (made.clearcoat, made.clearcoat_roughness) == (0.0, pytest.approx(0.01))
    assert (made.occlusion, made.normal_map) == (1.0, None)
    assert (made.opacity, made.metallic, made.emission) == (1.0, 0.0, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "decode", "wraps"),
    [
        ("", "auto", ("black", "black")),  # useMetadata, and there is none
        ('token inputs:sourceColorSpace = "raw"', "linear", ("black", "black")),
        (
            'token inputs:sourceColorSpace = "sRGB"\ntoken inputs:wrapS = "repeat"\n'
            'token inputs:wrapT = "mirror"',
            "gamma",
            ("repeat", "mirror"),
        ),
        ('token inputs:wrapS = "spiral"\ntoken inputs:wrapT = "clamp"', "auto", ("black", "clamp")),
    ],
)
def test_texture_settings(tmp_path: Path, text: str, decode: str, wraps: tuple[str, str]) -> None:
    use = shown(network(tmp_path, DIFFUSE, uv_texture(text))).diffuse_map
    assert use is not None
    assert use.texture.decode == decode
    assert (use.texture.wrap_s, use.texture.wrap_t) == wraps
    assert use.texture.file == str(tmp_path / "a.png")  # not there; who draws it will say so
    assert use.uv_set == "st"


def test_scale_bias_and_fallback(tmp_path: Path) -> None:
    text = (
        "float4 inputs:scale = (2, 3, 4, 5)\nfloat4 inputs:bias = (-1, 0, 1, 0)\n"
        "float4 inputs:fallback = (0.1, 0.2, 0.3, 1)"
    )
    use = shown(network(tmp_path, DIFFUSE, uv_texture(text))).diffuse_map
    assert use is not None
    assert use.scale == (2.0, 3.0, 4.0, 5.0)
    assert use.bias == (-1.0, 0.0, 1.0, 0.0)
    assert use.fallback == pytest.approx((0.1, 0.2, 0.3, 1.0))


def test_transforms_in_a_row_apply_from_the_reader_outwards(tmp_path: Path) -> None:
    nodes = (
        uv_texture("float2 inputs:st.connect = </Looks/paint/Outer.outputs:result>")
        + transform("Outer", "Inner", "float2 inputs:translation = (1, 0)")
        + transform("Inner", "Reader", "float2 inputs:scale = (2, 2)\nfloat inputs:rotation = 90")
        + reader("Reader", "float2", "map1")
    )
    use = shown(network(tmp_path, DIFFUSE, nodes)).diffuse_map
    assert use is not None
    assert use.uv_set == "map1"
    # (1, 0): scaled (2, 0), turned (0, 2), then moved (1, 2).
    assert np.reshape(use.matrix, (2, 3)) @ [1, 0, 1] == pytest.approx([1.0, 2.0])


def test_transform_2d_is_scale_rotate_translate() -> None:
    got = transform_2d((2.0, 1.0), 90.0, (5.0, 7.0)) @ [1.0, 1.0, 1.0]
    assert got == pytest.approx([5.0 - 1.0, 7.0 + 2.0, 1.0])


def test_values_come_through_interfaces_and_node_graphs(tmp_path: Path) -> None:
    graph = (
        "    color3f inputs:paintColor = (0.2, 0.4, 0.6)\n    asset inputs:picture = @./b.png@\n"
        '    def NodeGraph "Graph"\n    {\n'
        "        color3f outputs:glow.connect = </Looks/paint/Graph/Glow.outputs:rgb>\n"
        '        def Shader "Glow"\n        {\n'
        '            uniform token info:id = "UsdUVTexture"\n'
        "            asset inputs:file.connect = </Looks/paint.inputs:picture>\n"
        "            float3 outputs:rgb\n        }\n    }\n"
    )
    inputs = (
        "color3f inputs:diffuseColor.connect = </Looks/paint.inputs:paintColor>\n"
        "color3f inputs:emissiveColor.connect = </Looks/paint/Graph.outputs:glow>"
    )
    made = shown(network(tmp_path, inputs, graph=graph))
    assert made.diffuse == pytest.approx((0.2, 0.4, 0.6))
    assert made.emission_map is not None
    assert made.emission_map.texture.file == str(tmp_path / "b.png")


@pytest.mark.parametrize(
    "inputs",
    [
        "color3f inputs:diffuseColor.connect = </Looks/paint/Surface.inputs:diffuseColor>",
        "color3f inputs:diffuseColor.connect = </Looks/paint/Surface.inputs:emissiveColor>\n"
        "color3f inputs:emissiveColor.connect = </Looks/paint/Surface.inputs:diffuseColor>",
        "color3f inputs:diffuseColor.connect = </Looks/none.outputs:rgb>",
    ],
)
def test_connections_in_circles_and_to_nowhere_end(tmp_path: Path, inputs: str) -> None:
    assert shown(network(tmp_path, inputs)).diffuse == (0.18, 0.18, 0.18)


def test_texture_coordinates_in_a_circle_end(tmp_path: Path) -> None:
    nodes = uv_texture("float2 inputs:st.connect = </Looks/paint/T.outputs:result>")
    nodes += transform("T", "T")
    use = shown(network(tmp_path, DIFFUSE, nodes)).diffuse_map
    assert use is not None
    assert use.uv_set == "st"


@pytest.mark.parametrize(
    ("inputs", "nodes", "code"),
    [
        ("float inputs:clearcoat = 0.5", "", None),
        ("float inputs:clearcoat = 0.5\nfloat inputs:ior = 1.4", "", "clearcoat-ior"),
        ("normal3f inputs:normal = (1, 0, 0)", "", "normal-constant"),
        ("float inputs:roughness = 1.5", "", "value-range"),
        ("float inputs:displacement = 1", "", "displacement-unused"),
        ("float inputs:opacity = 0.25", "", None),
        ('token inputs:opacityMode = "thin"', "", "value-invalid"),
        ("color3f inputs:diffuseColor = (-1, 0, 0)", "", "color-invalid"),
        ("color3f inputs:diffuseColor = (nan, 0, 0)", "", "value-invalid"),
        ('string inputs:diffuseColor = "red"', "", "value-invalid"),
        ('string inputs:opacity = "half"', "", "value-invalid"),
        ("float inputs:roughness = inf", "", "value-invalid"),
        ('token inputs:useSpecularWorkflow = "yes"', "", None),
        (DIFFUSE, uv_texture(file=""), "texture-missing"),
        (DIFFUSE, uv_texture("float inputs:scale = 3"), "value-invalid"),
        (DIFFUSE, uv_texture("float2 inputs:st"), "texture-coordinates"),
        (fed("roughness", "float", "r"), uv_texture(), "data-color-space"),
        (fed("opacity", "float", "a"), uv_texture(), None),  # alpha is never curved
        (fed("roughness", "float", "r"), uv_texture(file="./a.exr"), None),
        (fed("normal", "normal3f"), uv_texture(RAW), "normal-scale"),
        (fed("normal", "normal3f"), uv_texture(RAW, file="./a.exr"), None),
        (fed("ior", "float", "r"), uv_texture(), "node-unknown"),
        (
            DIFFUSE,
            uv_texture().replace("UsdUVTexture", "ND_noise"),
            "node-unknown",
        ),
        (
            fed("emissiveColor", "color3f", "result"),
            reader("Picture", "float3", "glow"),
            "node-unknown",
        ),
    ],
)
def test_what_is_not_shown_is_said(
    tmp_path: Path, inputs: str, nodes: str, code: str | None
) -> None:
    report = Report()
    made = shown(network(tmp_path, inputs, nodes), report)
    assert report.codes() == ({code} if code else set())
    numbers = [*made.diffuse, *made.emission, *made.specular, made.opacity, made.shininess]
    assert all(math.isfinite(v) and v >= 0.0 for v in numbers)
    if code == "node-unknown":
        assert made.emission == (0.0, 0.0, 0.0)


def test_a_primvar_is_a_factor_on_white(tmp_path: Path) -> None:
    inputs = fed("diffuseColor", "color3f", "result")
    fallback = "float3 inputs:fallback = (0.5, 0.25, 0.125)"
    made = shown(network(tmp_path, inputs, reader("Picture", "float3", "displayColor", fallback)))
    assert (made.vertex_color, made.diffuse) == ("displayColor", (1.0, 1.0, 1.0))
    assert made.vertex_absent == (0.5, 0.25, 0.125)


def test_another_surface_is_a_finding(tmp_path: Path) -> None:
    stage = network(tmp_path, "")
    shader = UsdShade.Shader(stage.GetPrimAtPath("/Looks/paint/Surface"))
    shader.SetShaderId("ND_standard_surface")
    report = Report()
    assert read(stage, report) is None
    assert "ND_standard_surface;" in str(next(iter(report)))
    UsdShade.Material(stage.GetPrimAtPath(PATH)).GetSurfaceOutput().GetAttr().ClearConnections()
    assert read(stage, report) is None
    assert report.codes() == {"material-unknown"}


def test_broken_photometric_attributes_are_not_used(tmp_path: Path) -> None:
    stage = network(tmp_path, "float inputs:roughness = 1")
    prim = stage.GetPrimAtPath(PATH)
    prim.CreateAttribute("legacy:shininess", TYPES.Float).Set(math.nan)
    prim.CreateAttribute("legacy:specularColor", TYPES.Color3f).Set(Gf.Vec3f(-1, 0, 0))
    made = shown(stage)
    assert (made.model, made.roughness) == ("ggx", 1.0)
    assert made.specular == pytest.approx((0.04, 0.04, 0.04))
