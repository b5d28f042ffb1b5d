"""The validator of materials: reflectance, and emission against cd/m2."""

from __future__ import annotations

import pytest
from pxr import Usd
from validated import found, only, world


def material(inputs: str = "", own: str = "", extra: str = "") -> Usd.Stage:
    return world(
        f"""def Material "M" (prepend apiSchemas = ["HdrusdPhotometricMaterialAPI"])
        {{
            token outputs:surface.connect = </World/M/Surface.outputs:surface>
            {own}
            def Shader "Surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
                {inputs}
                token outputs:surface
            }}
            {extra}
        }}"""
    )


def test_sound_material_passes() -> None:
    stage = material(
        "color3f inputs:diffuseColor = (0, 0.5, 1)\n color3f inputs:specularColor = (1, 1, 1)\n"
        " color3f inputs:emissiveColor = (500, 500, 500)",
        "uniform float photometric:gamma = 2.2\n uniform color3f photometric:diffuse = (1, 1, 0)\n"
        " float photometric:luminance = 500\n uniform float legacy:shininess = 0",
    )
    assert found(stage) == []


@pytest.mark.parametrize(
    ("inputs", "own", "text"),
    [
        ("color3f inputs:diffuseColor = (0, 1.01, 0)", "", "diffuseColor 0, 1.01, 0"),
        ("color3f inputs:diffuseColor = (0, -0.01, 0)", "", "diffuseColor"),
        ("color3f inputs:specularColor = (nan, 0, 0)", "", "specularColor nan"),
        ("color3f inputs:emissiveColor = (-1, 0, 0)", "", "emissiveColor -1"),
        ("color3f inputs:emissiveColor = (inf, 0, 0)", "", "emissiveColor inf"),
        ("", "uniform color3f photometric:diffuse = (2, 0, 0)", "photometric:diffuse 2"),
        ("", "uniform float photometric:gamma = 0", "photometric:gamma 0; want above 0"),
        ("", "uniform float photometric:gamma = nan", "photometric:gamma nan"),
        ("", "uniform float legacy:shininess = -1", "legacy:shininess -1"),
        ("", "float photometric:luminance = -1", "photometric:luminance -1"),
        ("", "float photometric:luminance = 5", "5 cd/m2, but emissiveColor has 0 cd/m2; want"),
        (
            "color3f inputs:emissiveColor = (10, 10, 10)",
            "float photometric:luminance = 10.02",
            "10.02 cd/m2, but emissiveColor has 10 cd/m2",
        ),
    ],
)
def test_unsound_material(inputs: str, own: str, text: str) -> None:
    problem = only(material(inputs, own))
    assert (problem.severity, problem.validator) == ("error", "MaterialReflectance")
    assert problem.path == "/World/M"
    assert text in problem.text


def test_emission_agrees_by_luminance() -> None:
    # (1000, 0, 0) has 212.6 cd/m2.
    red = "color3f inputs:emissiveColor = (1000, 0, 0)"
    assert found(material(red, "float photometric:luminance = 212.6")) == []


def glowing(luminance: float, inputs: str, node: str = "UsdUVTexture") -> Usd.Stage:
    return material(
        "color3f inputs:emissiveColor = (1, 1, 1)\n"
        " color3f inputs:emissiveColor.connect = </World/M/Picture.outputs:rgb>",
        f"float photometric:luminance = {luminance}",
        f'def Shader "Picture" {{\n uniform token info:id = "{node}"\n {inputs}\n'
        " float3 outputs:rgb\n}",
    )


@pytest.mark.parametrize(
    ("luminance", "inputs"),
    [
        (300.0, "float4 inputs:scale = (300, 300, 300, 1)"),
        (212.6, "float4 inputs:scale = (1000, 0, 0, 0.5)"),  # the luminance of red
        (1.0, ""),  # UsdUVTexture's scale is 1 where it is not stated
        (300.0, "float4 inputs:scale = (300.2, 300.2, 300.2, 1)"),  # 0.07 % apart
    ],
)
def test_emissive_texture_agrees_at_its_value_1(luminance: float, inputs: str) -> None:
    assert found(glowing(luminance, inputs)) == []


@pytest.mark.parametrize(
    ("inputs", "text"),
    [
        ("float4 inputs:scale = (300.6, 300.6, 300.6, 1)", "inputs:scale has 300.6 cd/m2; want"),
        ("float4 inputs:scale = (1000, 0, 0, 1)", "inputs:scale has 212.6 cd/m2; want"),
        ("", "300 cd/m2, but Picture.inputs:scale has 1 cd/m2; want"),
        (
            "float4 inputs:scale.timeSamples = { 1: (300, 300, 300, 1), 2: (30, 30, 30, 1) }",
            "inputs:scale has 30 cd/m2 at time 2; want",
        ),
        ("float4 inputs:scale = (-300, 300, 300, 1)", "inputs:scale -300, 300, 300, 1; want 0"),
        ("float4 inputs:scale = (nan, 300, 300, 1)", "inputs:scale nan, 300, 300, 1; want 0"),
        ('string inputs:scale = "bright"', "inputs:scale 'bright'; want 0"),
    ],
)
def test_emissive_texture_disagrees_at_its_value_1(inputs: str, text: str) -> None:
    problem = only(glowing(300.0, inputs))
    expected = ("error", "MaterialReflectance", "/World/M")
    assert (problem.severity, problem.validator, problem.path) == expected
    assert text in problem.text


def test_emission_of_which_1_says_nothing_is_not_compared() -> None:
    biased = "float4 inputs:scale = (5, 5, 5, 1)\n float4 inputs:bias = (1, 1, 1, 0)"
    assert found(glowing(300.0, biased)) == []
    assert found(glowing(300.0, "", "UsdPrimvarReader_float3")) == []


def test_values_of_the_material_interface_are_followed() -> None:
    stage = material(
        "color3f inputs:diffuseColor.connect = </World/M.inputs:paint>",
        "color3f inputs:paint = (3, 3, 3)",
    )
    assert "diffuseColor 3, 3, 3" in only(stage).text
