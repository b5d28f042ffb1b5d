"""UsdPreviewSurface input by input, against the words of its specification."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from builders import new_stage, paint
from looks import PATH, TYPES, fed, network, reader, shown, transform, uv_texture
from pxr import Gf, Usd, UsdGeom, UsdShade

from hdrusd.report import Report
from hdrusd.scene import Material
from hdrusd.usd.bindings import Bindings
from hdrusd.usd.material import Surface, write_photometric

RAW = 'token inputs:sourceColorSpace = "raw"'


@pytest.mark.parametrize(("ior", "f0"), [(1.5, 0.04), (1.0, 0.0), (2.0, 1 / 9), (0.0, 1.0)])
def test_dielectrics_reflect_by_their_ior(tmp_path: Path, ior: float, f0: float) -> None:
    """F0 = ((1 - ior) / (1 + ior))^2."""
    made = shown(network(tmp_path, f"float inputs:ior = {ior}\nfloat inputs:metallic = 0.25"))
    assert made.specular == pytest.approx((f0,) * 3)
    assert made.metallic == 0.25


def test_the_specular_workflow_has_no_metal_and_no_ior(tmp_path: Path) -> None:
    made = shown(
        network(
            tmp_path,
            "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.5, 0.25, 0)\n"
            "float inputs:metallic = 1\nfloat inputs:ior = 3",
        )
    )
    assert (made.specular, made.metallic) == ((0.5, 0.25, 0.0), 0.0)


@pytest.mark.parametrize(
    ("name", "field"),
    [
        ("diffuseColor", "diffuse"),
        ("emissiveColor", "emission"),
        ("specularColor", "specular"),
        ("metallic", "metallic"),
        ("roughness", "roughness"),
        ("clearcoat", "clearcoat"),
        ("clearcoatRoughness", "clearcoat_roughness"),
        ("opacity", "opacity"),
        ("occlusion", "occlusion"),
    ],
)
@pytest.mark.parametrize("output", ["rgb", "r", "g", "b", "a"])
def test_every_input_takes_every_output_of_a_texture(
    tmp_path: Path, name: str, field: str, output: str
) -> None:
    color = name.endswith("Color")
    inputs = fed(name, "color3f" if color else "float", output)
    workflow = f"\nint inputs:useSpecularWorkflow = {int(name == 'specularColor')}"
    numbers = "float4 inputs:scale = (0.5, 0.25, 1, 0.125)\nfloat4 inputs:bias = (0, 0.5, 0, 0.25)"
    report = Report()
    made = shown(network(tmp_path, inputs + workflow, uv_texture(f"{RAW}\n{numbers}")), report)
    use = getattr(made, f"{field}_map")
    whole = -1 if color else 0  # a number takes the first of three
    assert use.channel == {"rgb": whole, "r": 0, "g": 1, "b": 2, "a": 3}[output]
    assert (use.scale, use.bias) == ((0.5, 0.25, 1.0, 0.125), (0.0, 0.5, 0.0, 0.25))
    assert use.texture.decode == "linear"
    assert not report.codes()
    assert list(made.maps()) == [f"{field}_map"]


@pytest.mark.parametrize(
    ("scale", "bias"), [("2, 1, 1, 1", "0, 0, 0, 0"), ("1, 1, 1, 1", "0, 0, -0.1, 0")]
)
def test_scale_and_bias_that_leave_no_reflectance_are_said(
    tmp_path: Path, scale: str, bias: str
) -> None:
    numbers = f"float4 inputs:scale = ({scale})\nfloat4 inputs:bias = ({bias})"
    report = Report()
    shown(
        network(tmp_path, fed("diffuseColor", "color3f"), uv_texture(f"{RAW}\n{numbers}")), report
    )
    assert report.codes() == {"value-range"}


@pytest.mark.parametrize(
    ("name", "output", "space", "decode"),
    [
        ("diffuseColor", "rgb", "auto", "auto"),
        ("diffuseColor", "rgb", "raw", "linear"),
        ("emissiveColor", "rgb", "sRGB", "gamma"),
        ("roughness", "r", "auto", "linear"),
        ("metallic", "g", "sRGB", "gamma"),  # said is said
        ("occlusion", "b", "raw", "linear"),
        ("opacity", "r", "auto", "linear"),
        ("opacity", "a", "auto", "auto"),  # alpha is not curved, and the file may be shared
        ("normal", "rgb", "auto", "linear"),
    ],
)
def test_colour_spaces(tmp_path: Path, name: str, output: str, space: str, decode: str) -> None:
    inputs = fed(name, "float", output)
    made = shown(
        network(tmp_path, inputs, uv_texture(f'token inputs:sourceColorSpace = "{space}"'))
    )
    (use,) = made.maps().values()
    assert use.texture.decode == decode


def test_a_file_for_colour_and_alpha_is_one_texture(tmp_path: Path) -> None:
    inputs = fed("diffuseColor", "color3f") + "\n" + fed("opacity", "float", "a")
    made = shown(network(tmp_path, inputs, uv_texture()))
    assert made.diffuse_map is not None
    assert made.opacity_map is not None
    assert made.diffuse_map.texture == made.opacity_map.texture


# -- opacity ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "blend", "presence", "threshold"),
    [
        ("", False, False, 0.0),
        ("float inputs:opacity = 0.25", True, False, 0.0),
        ("float inputs:opacity = 0.25\nfloat inputs:opacityThreshold = 0.5", False, False, 0.5),
        (
            'float inputs:opacity = 0.25\ntoken inputs:opacityMode = "presence"',
            True,
            True,
            0.0,
        ),
        (
            "float inputs:opacity = 0.25\nfloat inputs:opacityThreshold = 0.125\n"
            'token inputs:opacityMode = "presence"',  # ignored beside a threshold
            False,
            False,
            0.125,
        ),
        (fed("opacity", "float", "a"), True, False, 0.0),
        (
            fed("opacity", "float", "a") + "\nfloat inputs:opacityThreshold = 0.5",
            False,
            False,
            0.5,
        ),
    ],
)
def test_opacity(tmp_path: Path, text: str, blend: bool, presence: bool, threshold: float) -> None:
    report = Report()
    made = shown(network(tmp_path, text, uv_texture()), report)
    assert (made.blend, made.presence) == (blend, presence)
    assert made.opacity_threshold == threshold
    assert not report.codes()


def test_a_lamp_behind_its_glass_is_let_through(tmp_path: Path) -> None:
    made = shown(
        network(tmp_path, "color3f inputs:emissiveColor = (9, 9, 9)\nfloat inputs:opacity = 0.5")
    )
    assert (made.opacity, made.opacity_threshold, made.blend) == (0.5, 0.0, True)


@pytest.mark.parametrize(
    ("mode", "blend", "presence"),
    [("opaque", False, False), ("mask", False, False), ("blend", True, True)],
)
def test_what_convert_writes_for_blending(mode: str, blend: bool, presence: bool) -> None:
    """Alpha in OpenGL and glTF fades a surface whole: opacityMode presence."""
    stage = new_stage()
    source = paint(alpha_mode=mode, alpha_cutoff=0.5, alpha=0.25)
    write_photometric(stage, PATH, source, Surface((1, 1, 1), 2.2))
    made = shown(stage)
    assert (made.blend, made.presence) == (blend, presence)


# -- normal maps --------------------------------------------------------------------------


def decoded(made: Material, texel: tuple[float, ...]) -> list[float]:
    use = made.normal_map
    assert use is not None
    return [t * s + b for t, s, b in zip(texel, use.scale, use.bias, strict=True)][:3]


def test_normals_with_scale_and_bias_as_written(tmp_path: Path) -> None:
    flipped = "float4 inputs:scale = (2, -2, 2, 1)\nfloat4 inputs:bias = (-1, 1, -1, 0)"
    report = Report()
    made = shown(
        network(tmp_path, fed("normal", "normal3f"), uv_texture(f"{RAW}\n{flipped}")), report
    )
    assert decoded(made, (0.75, 0.75, 1.0, 1.0)) == [0.5, -0.5, 1.0]
    assert not report.codes()


def test_eight_bit_normals_without_scale_and_bias_get_the_specifications(tmp_path: Path) -> None:
    report = Report()
    made = shown(network(tmp_path, fed("normal", "normal3f"), uv_texture(RAW)), report)
    assert decoded(made, (0.5, 0.5, 1.0, 1.0)) == [0.0, 0.0, 1.0]
    assert report.codes() == {"normal-scale"}


def test_normals_in_floats_are_directions_already(tmp_path: Path) -> None:
    exr = uv_texture(RAW, file="./n.exr")
    made = shown(network(tmp_path, fed("normal", "normal3f"), exr))
    assert decoded(made, (0.0, 0.0, 1.0, 1.0)) == [0.0, 0.0, 1.0]


@pytest.mark.parametrize("scale", ["", "float4 inputs:scale = (2, -2, 2, 0)"])
def test_a_missing_normal_map_leaves_the_surface_as_it_is(tmp_path: Path, scale: str) -> None:
    made = shown(network(tmp_path, fed("normal", "normal3f"), uv_texture(f"{RAW}\n{scale}")))
    assert made.normal_map is not None
    assert decoded(made, made.normal_map.fallback) == [0.0, 0.0, 1.0]


# -- coordinates --------------------------------------------------------------------------


def test_constant_coordinates_are_one_place(tmp_path: Path) -> None:
    picture = uv_texture("float2 inputs:st = (0.25, 0.75)")
    made = shown(network(tmp_path, fed("diffuseColor", "color3f"), picture))
    assert made.diffuse_map is not None
    matrix = np.reshape(made.diffuse_map.matrix, (2, 3))
    assert matrix @ [0.9, 0.1, 1.0] == pytest.approx([0.25, 0.75])


def test_constant_coordinates_are_transformed_too(tmp_path: Path) -> None:
    values = "float2 inputs:scale = (2, 2)\nfloat2 inputs:translation = (1, 0)"
    nodes = uv_texture("float2 inputs:st.connect = </Looks/paint/T.outputs:result>")
    nodes += transform("T", "none", values).replace(
        "inputs:in.connect = </Looks/paint/none.outputs:result>", "inputs:in = (0.25, 0.5)"
    )
    made = shown(network(tmp_path, fed("diffuseColor", "color3f"), nodes))
    assert made.diffuse_map is not None
    matrix = np.reshape(made.diffuse_map.matrix, (2, 3))
    assert matrix @ [0.9, 0.1, 1.0] == pytest.approx([1.5, 1.0])


def test_more_coordinate_sets_than_are_read(tmp_path: Path) -> None:
    names = ["diffuseColor", "emissiveColor", "roughness", "metallic", "opacity"]
    inputs, nodes = "", ""
    for name in names:
        kind = "color3f" if name.endswith("Color") else "float"
        inputs += fed(name, kind, "r", f"T{name}") + "\n"
        st = f"float2 inputs:st.connect = </Looks/paint/U{name}.outputs:result>\n{RAW}"
        nodes += uv_texture(st, f"T{name}") + reader(f"U{name}", "float2", f"uv_{name}")
    report = Report()
    made = shown(network(tmp_path, inputs, nodes), report)
    assert len(made.uv_sets()) == 5
    assert report.codes() == {"uv-sets"}


# -- primvars -----------------------------------------------------------------------------


def test_a_primvar_on_another_input_is_its_fallback(tmp_path: Path) -> None:
    nodes = reader("Picture", "float", "rough", "float inputs:fallback = 0.125")
    report = Report()
    made = shown(network(tmp_path, fed("roughness", "float", "result"), nodes), report)
    assert made.roughness == 0.125
    assert report.codes() == {"node-unknown"}


def worn(stage: Usd.Stage, report: Report, *names: str) -> list[Material]:
    """The materials that gprims wear."""
    bindings = Bindings(stage, report)
    return [
        bindings.materials[piece.material]
        for name in names
        for piece in bindings.pieces(stage.GetPrimAtPath(name), Usd.TimeCode(0))
    ]


def test_display_colour_and_opacity_without_a_material() -> None:
    stage, report = new_stage(), Report()
    for name, opacity in (("/Solid", None), ("/Thin", [0.25]), ("/Uneven", [0.25, 0.75])):
        cube = UsdGeom.Cube.Define(stage, name)
        cube.CreateDisplayColorAttr([Gf.Vec3f(1, 0, 0)])
        if opacity:
            cube.CreateDisplayOpacityAttr(opacity)
    solid, thin, uneven = worn(stage, report, "/Solid", "/Thin", "/Uneven")
    assert (solid.opacity, solid.blend, solid.vertex_color) == (1.0, False, "displayColor")
    assert (thin.opacity, thin.blend, thin.presence) == (0.25, True, True)
    assert uneven.opacity == 0.5
    assert report.codes() == {"display-opacity"}


def test_a_gprim_without_the_primvar_wears_its_fallback(tmp_path: Path) -> None:
    color = reader("Picture", "float3", "paint", "float3 inputs:fallback = (0.5, 0.25, 0)")
    opacity = reader("Alpha", "float", "glass", "float inputs:fallback = 0.5")
    inputs = fed("diffuseColor", "color3f", "result")
    inputs += "\n" + fed("opacity", "float", "result", "Alpha")
    stage, report = network(tmp_path, inputs, color + opacity), Report()
    material = UsdShade.Material(stage.GetPrimAtPath(PATH))
    for name in ("/Plain", "/Painted"):
        cube = UsdGeom.Cube.Define(stage, name)
        UsdShade.MaterialBindingAPI.Apply(cube.GetPrim()).Bind(material)
    primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/Painted"))
    primvars.CreatePrimvar("paint", TYPES.Color3f).Set(Gf.Vec3f(0, 1, 0))
    primvars.CreatePrimvar("glass", TYPES.Float).Set(0.125)
    plain, painted = worn(stage, report, "/Plain", "/Painted")
    assert (plain.diffuse, plain.vertex_color, plain.opacity) == ((0.5, 0.25, 0.0), "", 0.5)
    assert (painted.diffuse, painted.vertex_color) == ((1.0, 1.0, 1.0), "paint")
    assert (painted.opacity, painted.blend) == (0.125, True)
    assert report.codes() == {"primvar-missing"}


def test_a_varying_material_is_read_again_for_each_who_wears_it(tmp_path: Path) -> None:
    inputs = "float inputs:roughness.timeSamples = { 0: 0.25, 1: 0.75 }"
    stage = network(tmp_path, inputs)
    cube = UsdGeom.Cube.Define(stage, "/Cube")
    material = UsdShade.Material(stage.GetPrimAtPath(PATH))
    UsdShade.MaterialBindingAPI.Apply(cube.GetPrim()).Bind(material)
    bindings = Bindings(stage, Report())
    (piece,) = bindings.pieces(cube.GetPrim(), Usd.TimeCode(0))
    assert bindings.materials[piece.material].roughness == 0.25
    bindings.update(Usd.TimeCode(1))
    assert bindings.materials[piece.material].roughness == 0.75


# -- contexts -----------------------------------------------------------------------------


def test_a_preview_surface_comes_before_materialx(tmp_path: Path) -> None:
    """UsdPreviewSurface is read whole, MaterialX in part."""
    other = "    token outputs:mtlx:surface.connect = </Looks/paint/Other.outputs:out>\n"
    nodes = (
        'def Shader "Other"\n{\n uniform token info:id = "ND_standard_surface_surfaceshader"\n'
        " float inputs:specular_roughness = 0.875\n token outputs:out\n}\n"
    )
    stage = network(tmp_path, "float inputs:roughness = 0.25", nodes, graph=other)
    assert shown(stage).roughness == 0.25
    surface = UsdShade.Shader(stage.GetPrimAtPath("/Looks/paint/Surface"))
    surface.SetShaderId("SomebodysSurface")
    report = Report()
    assert shown(stage, report).roughness == 0.875
    assert not report.codes()


def test_udim_files_are_resolved_where_they_are_named(tmp_path: Path) -> None:
    (tmp_path / "tex").mkdir()
    (tmp_path / "tex" / "a.1012.png").touch()
    picture = uv_texture(file="tex/a.<UDIM>.png")
    made = shown(network(tmp_path, fed("diffuseColor", "color3f"), picture))
    assert made.diffuse_map is not None
    assert made.diffuse_map.texture.file == str(tmp_path / "tex" / "a.<UDIM>.png")


def test_material_fields_are_all_known_to_the_reader() -> None:
    """A map without a constant of its own is the normal map alone."""
    names = {field.name for field in dataclasses.fields(Material)}
    without = {n for n in names if n.endswith("_map") and n.removesuffix("_map") not in names}
    assert without == {"normal_map"}
