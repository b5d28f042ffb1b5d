"""MaterialX networks, against its node definitions and its own translation graphs."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from looks import fed, network, node, shown
from pxr import Sdf, Usd

from hdrusd.report import Report
from hdrusd.scene import Material, TextureUse
from hdrusd.usd.opening import open_stage

SURFACE = "ND_standard_surface_surfaceshader"
IN = "inputs:in.connect"
BASE = fed("base_color", "color3f", "out")


def material(
    folder: Path, inputs: str, nodes: str = "", surface: str = SURFACE, codes: Collection[str] = ()
) -> Material:
    """What is read of a MaterialX surface, and that nothing else was said."""
    report = Report()
    stage = network(folder, inputs, nodes, surface=surface, output="mtlx:surface")
    made = shown(stage, report)
    assert report.codes() == set(codes)
    assert made.model == "ggx"
    return made


def image(name: str = "Picture", body: str = "", kind: str = "color3") -> str:
    """An image node of a float file, whose colour space is not in doubt."""
    outputs = "float outputs:out" if kind == "float" else "color3f outputs:out"
    return node(name, f"ND_image_{kind}", f"asset inputs:file = @./a.exr@\n{body}", outputs)


def base(folder: Path, nodes: str, codes: Collection[str] = ()) -> TextureUse:
    """The texture that reaches base_color."""
    use = material(folder, BASE, nodes, codes=codes).diffuse_map
    assert use is not None
    return use


# -- surfaces -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("surface", "wanted"),
    [
        (
            "ND_UsdPreviewSurface_surfaceshader",
            {"diffuse": (0.18,) * 3, "roughness": 0.5, "metallic": 0.0, "specular": (0.04,) * 3},
        ),
        (SURFACE, {"diffuse": (0.8,) * 3, "roughness": 0.2, "specular": (0.04,) * 3}),
        (f"{SURFACE}_100", {"diffuse": (0.8,) * 3, "roughness": 0.2, "metallic": 0.0}),
        (
            "ND_open_pbr_surface_surfaceshader",
            {"diffuse": (0.8,) * 3, "roughness": 0.3, "specular": (0.04,) * 3},
        ),
        (
            "ND_gltf_pbr_surfaceshader",
            {"diffuse": (1.0,) * 3, "roughness": 1.0, "metallic": 1.0, "specular": (0.04,) * 3},
        ),
    ],
)
def test_defaults(tmp_path: Path, surface: str, wanted: dict[str, Any]) -> None:
    """The values of the node definitions, MaterialX 1.39."""
    made = material(tmp_path, "", surface=surface)
    for name, value in wanted.items():
        assert getattr(made, name) == pytest.approx(value), name
    assert (made.clearcoat, made.opacity, made.blend) == (0.0, 1.0, False)
    assert made.emission == (0.0, 0.0, 0.0)


def test_standard_surface(tmp_path: Path) -> None:
    made = material(
        tmp_path,
        "float inputs:base = 0.5\ncolor3f inputs:base_color = (0.5, 0.25, 1)\n"
        "float inputs:metalness = 0.25\nfloat inputs:specular = 0.5\n"
        "color3f inputs:specular_color = (1, 0.5, 0)\nfloat inputs:specular_IOR = 2\n"
        "float inputs:coat = 0.5\ncolor3f inputs:coat_color = (1, 0.5, 0)\n"
        "float inputs:coat_roughness = 0.25\nfloat inputs:emission = 100\n"
        "color3f inputs:emission_color = (1, 0.5, 0.25)\n"
        "color3f inputs:opacity = (0.25, 0.25, 0.25)",
    )
    # standard_surface_to_usd: base times colour, seen through mix(1, coat_color, coat).
    assert made.diffuse == (0.25, 0.125 * 0.75, 0.5 * 0.5)
    assert made.specular == pytest.approx((0.5 / 9, 0.25 / 9, 0.0))
    assert (made.metallic, made.clearcoat_roughness) == (0.25, 0.25)
    assert made.clearcoat == 0.5 * 1.5 / 3.0  # the weight times the mean of its colour
    assert made.emission == (100.0, 50.0, 25.0)
    assert (made.opacity, made.blend, made.presence) == (0.25, True, True)


def test_openpbr_emits_nits(tmp_path: Path) -> None:
    inputs = "float inputs:emission_luminance = 800\ncolor3f inputs:emission_color = (1, 0.5, 0)"
    made = material(tmp_path, inputs, surface="ND_open_pbr_surface_surfaceshader")
    assert made.emission == (800.0, 400.0, 0.0)


@pytest.mark.parametrize(
    ("mode", "wanted"),
    [(0, (1.0, 0.0, False)), (1, (0.25, 0.75, False)), (2, (0.25, 0.0, True))],
)
def test_gltf_alpha_modes(tmp_path: Path, mode: int, wanted: tuple[float, float, bool]) -> None:
    inputs = "float inputs:alpha = 0.25\nfloat inputs:alpha_cutoff = 0.75\n"
    inputs += f"int inputs:alpha_mode = {mode}"
    made = material(tmp_path, inputs, surface="ND_gltf_pbr_surfaceshader")
    assert (made.opacity, made.opacity_threshold, made.blend) == wanted


def test_transmission_is_opacity_that_keeps_the_highlight(tmp_path: Path) -> None:
    made = material(tmp_path, "float inputs:transmission = 0.75", codes={"node-approximated"})
    assert (made.opacity, made.blend, made.presence) == (0.25, True, False)


@pytest.mark.parametrize("name", ["subsurface", "sheen", "thin_film_thickness"])
def test_what_has_no_term_is_said(tmp_path: Path, name: str) -> None:
    material(tmp_path, f"float inputs:{name} = 0.5", codes={"materialx-unused"})


def test_a_coat_of_another_ior_is_said(tmp_path: Path) -> None:
    material(
        tmp_path,
        "float inputs:coat_weight = 1",  # whose coat_ior is 1.6
        surface="ND_open_pbr_surface_surfaceshader",
        codes={"clearcoat-ior"},
    )


# -- nodes --------------------------------------------------------------------------------


def test_an_image(tmp_path: Path) -> None:
    use = base(tmp_path, image(body='string inputs:uaddressmode = "clamp"'))
    assert use.texture.file == str(tmp_path / "a.exr")
    assert (use.texture.wrap_s, use.texture.wrap_t) == ("clamp", "repeat")  # periodic by default
    assert (use.uv_set, use.channel, use.texture.decode) == ("st", -1, "linear")
    assert use.matrix == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("space", "decode", "code"),
    [
        ("srgb_texture", "gamma", None),
        ("lin_rec709", "linear", None),
        ("", "linear", "color-space"),  # MaterialX: no space, no conversion
        ("acescg", "linear", "color-space"),
    ],
)
def test_colour_spaces(tmp_path: Path, space: str, decode: str, code: str | None) -> None:
    said = f'(\ncolorSpace = "{space}"\n)' if space else ""
    picture = node("Picture", "ND_image_color3", f"asset inputs:file = @./a.png@ {said}")
    assert base(tmp_path, picture, {code} if code else set()).texture.decode == decode


def test_numbers_need_no_colour_space(tmp_path: Path) -> None:
    picture = node("Picture", "ND_image_float", "asset inputs:file = @./a.png@")
    made = material(tmp_path, fed("specular_roughness", "float", "out"), picture)
    assert made.roughness_map is not None
    assert (made.roughness_map.channel, made.roughness_map.texture.decode) == (0, "linear")


def test_arithmetic_with_constants(tmp_path: Path) -> None:
    """(1 - 2 texel) / 4 + 0.5 per channel, one factor a colour."""
    twice = "color3f inputs:in1.connect = </Looks/paint/P.outputs:out>\n"
    nodes = (
        image("P")
        + node("M", "ND_multiply_color3", f"{twice}color3f inputs:in2 = (2, 2, 3)")
        + node("I", "ND_invert_color3", "color3f inputs:in.connect = </Looks/paint/M.outputs:out>")
        + node(
            "D",
            "ND_divide_color3FA",
            "color3f inputs:in1.connect = </Looks/paint/I.outputs:out>\nfloat inputs:in2 = 4",
        )
        + node(
            "Picture",
            "ND_add_color3",
            "color3f inputs:in1 = (0.5, 0.5, 0.5)\n"
            "color3f inputs:in2.connect = </Looks/paint/D.outputs:out>",
        )
    )
    use = base(tmp_path, nodes)
    assert use.scale[:3] == (-0.5, -0.5, -0.75)
    assert use.bias[:3] == (0.75, 0.75, 0.75)


def test_constants_are_worked_out(tmp_path: Path) -> None:
    nodes = node("C", "ND_constant_color3", "color3f inputs:value = (0.5, 0.25, 1)") + node(
        "Picture",
        "ND_mix_color3",
        "color3f inputs:fg.connect = </Looks/paint/C.outputs:out>\n"
        "color3f inputs:bg = (0, 0, 1)\nfloat inputs:mix = 0.5",
    )
    assert material(tmp_path, BASE, nodes).diffuse == (0.25, 0.125, 1.0)


@pytest.mark.parametrize(
    ("kind", "body", "output", "channel"),
    [
        ("ND_extract_color3", "int inputs:index = 1", "out", 1),
        ("ND_separate3_color3", "", "outb", 2),
        ("ND_swizzle_color3_float", 'string inputs:channels = "g"', "out", 1),
    ],
)
def test_one_channel(tmp_path: Path, kind: str, body: str, output: str, channel: int) -> None:
    body += "\ncolor3f inputs:in.connect = </Looks/paint/P.outputs:out>"
    nodes = image("P") + node("Picture", kind, body, f"float outputs:{output}")
    made = material(tmp_path, fed("metalness", "float", output), nodes)
    assert made.metallic_map is not None
    assert made.metallic_map.channel == channel


def test_a_texture_times_vertex_colours(tmp_path: Path) -> None:
    nodes = (
        image("P")
        + node("V", "ND_geompropvalue_color3", 'string inputs:geomprop = "paint"')
        + node(
            "Picture",
            "ND_multiply_color3",
            "color3f inputs:in1.connect = </Looks/paint/P.outputs:out>\n"
            "color3f inputs:in2.connect = </Looks/paint/V.outputs:out>",
        )
    )
    made = material(tmp_path, BASE, nodes)
    assert made.diffuse_map is not None
    assert made.vertex_color == "paint"


def test_a_normal_map(tmp_path: Path) -> None:
    """(2 in - 1), x and y times scale."""
    body = "float inputs:scale = 0.5\nfloat3 inputs:in.connect = </Looks/paint/P.outputs:out>"
    nodes = image("P", kind="vector3") + node("Picture", "ND_normalmap", body)
    use = material(tmp_path, fed("normal", "float3", "out"), nodes).normal_map
    assert use is not None
    got = [t * s + b for t, s, b in zip((1.0, 0.75, 1.0), use.scale[:3], use.bias[:3], strict=True)]
    assert got == [0.5, 0.25, 1.0]


# -- coordinates --------------------------------------------------------------------------


def place(matrix: tuple[float, ...], u: float, v: float) -> Any:
    return pytest.approx(np.reshape(matrix, (2, 3)) @ [u, v, 1.0])


def test_tiled_image(tmp_path: Path) -> None:
    """Coordinates times uvtiling less uvoffset."""
    body = (
        "asset inputs:file = @./a.exr@\nfloat2 inputs:uvtiling = (2, 4)\n"
        "float2 inputs:uvoffset = (0.5, 0.25)"
    )
    use = base(tmp_path, node("Picture", "ND_tiledimage_color3", body))
    assert place(use.matrix, 1.0, 1.0) == [1.5, 3.75]
    assert use.texture.wrap_s == "repeat"


@pytest.mark.parametrize(
    ("order", "wanted"),
    [
        # (1, 0) about (0.5, 0.5) is (0.5, -0.5); halved (0.25, -0.125); a quarter turn
        # clockwise (-0.125, -0.25); less (1, 0), and back by (0.5, 0.5).
        (0, (-0.625, 0.25)),
        # (0.5, -0.5) less (1, 0) is (-0.5, -0.5); turned (-0.5, 0.5); halved (-0.25, 0.125).
        (1, (0.25, 0.625)),
    ],
)
def test_place2d(tmp_path: Path, order: int, wanted: tuple[float, float]) -> None:
    body = (
        "float2 inputs:pivot = (0.5, 0.5)\nfloat2 inputs:scale = (2, 4)\nfloat inputs:rotate = 90\n"
        f"float2 inputs:offset = (1, 0)\nint inputs:operationorder = {order}\n"
        "float2 inputs:texcoord.connect = </Looks/paint/UV.outputs:out>"
    )
    nodes = (
        image(body="float2 inputs:texcoord.connect = </Looks/paint/P.outputs:out>")
        + node("P", "ND_place2d_vector2", body, "float2 outputs:out")
        + node("UV", "ND_geompropvalue_vector2", 'string inputs:geomprop = "map2"')
    )
    use = base(tmp_path, nodes)
    assert use.uv_set == "map2"
    assert list(wanted) == place(use.matrix, 1.0, 0.0)


def test_arithmetic_on_coordinates(tmp_path: Path) -> None:
    connect = "float2 inputs:in1.connect = </Looks/paint"
    nodes = (
        image(body="float2 inputs:texcoord.connect = </Looks/paint/A.outputs:out>")
        + node("A", "ND_add_vector2", f"{connect}/M.outputs:out>\nfloat2 inputs:in2 = (0.5, 0)")
        + node("M", "ND_multiply_vector2FA", f"{connect}/UV.outputs:out>\nfloat inputs:in2 = 3")
        + node("UV", "ND_texcoord_vector2", "int inputs:index = 1")
    )
    use = base(tmp_path, nodes)
    assert use.uv_set == "st1"
    assert place(use.matrix, 1.0, 2.0) == [3.5, 6.0]


# -- what cannot be followed --------------------------------------------------------------


@pytest.mark.parametrize(
    "nodes",
    [
        node("Picture", "ND_noise2d_color3"),
        node("Picture", "", ""),
        node(
            "Picture", "ND_multiply_color3", "color3f inputs:in1.connect = </Looks/x.outputs:out>"
        ),
        # The product of two textures, and of a texture with itself.
        image("P")
        + node(
            "Picture",
            "ND_multiply_color3",
            "color3f inputs:in1.connect = </Looks/paint/P.outputs:out>\n"
            "color3f inputs:in2.connect = </Looks/paint/P.outputs:out>",
        ),
        # A node that feeds itself, twice over.
        node(
            "Picture",
            "ND_add_color3",
            "color3f inputs:in1.connect = </Looks/paint/Picture.outputs:out>\n"
            "color3f inputs:in2.connect = </Looks/paint/Picture.outputs:out>",
        ),
        # Colours for one channel.
        image("P", kind="float")
        + node(
            "C", "ND_convert_float_color3", "float inputs:in.connect = </Looks/paint/P.outputs:out>"
        )
        + node(
            "Picture",
            "ND_multiply_color3",
            "color3f inputs:in1.connect = </Looks/paint/C.outputs:out>\n"
            "color3f inputs:in2 = (1, 0.5, 0)",
        ),
    ],
)
def test_what_is_no_texture_falls_back_by_itself(tmp_path: Path, nodes: str) -> None:
    inputs = f"{BASE}\nfloat inputs:specular_roughness = 0.75"
    report = Report()
    stage = network(tmp_path, inputs, nodes, surface=SURFACE, output="mtlx:surface")
    made = shown(stage, report)
    assert report.codes() <= {"node-unknown"}
    assert made.roughness == 0.75
    assert made.diffuse in ((0.8, 0.8, 0.8), (0.0, 0.0, 0.0))


def test_a_long_chain_ends(tmp_path: Path) -> None:
    links = "".join(
        node(
            f"N{i}",
            "ND_dot_color3",
            f"color3f inputs:in.connect = </Looks/paint/N{i + 1}.outputs:out>",
        )
        for i in range(1000)
    )
    material(tmp_path, fed("base_color", "color3f", "out", "N0"), links, codes={"node-unknown"})


@pytest.mark.parametrize(
    "text",
    [
        'string inputs:base_color = "red"',
        "float inputs:specular_roughness = inf",
        "color3f inputs:specular_IOR = (1, 1, 1)",
        'string inputs:transmission = "all"',
    ],
)
def test_wrong_types_are_said(tmp_path: Path, text: str) -> None:
    made = material(tmp_path, text, codes={"value-invalid"})
    assert np.isfinite([*made.diffuse, *made.specular, made.roughness]).all()


def test_mtlx_files_need_a_plug_in_of_usd(tmp_path: Path) -> None:
    """USD of the package index has none; a reference to one is a warning of USD."""
    if Sdf.FileFormat.FindByExtension("mtlx"):
        pytest.skip("this USD reads MaterialX files")
    (tmp_path / "m.mtlx").write_text('<?xml version="1.0"?>\n<materialx version="1.39"/>\n')
    (tmp_path / "s.usda").write_text(
        '#usda 1.0\ndef "M" (references = @./m.mtlx@</MaterialX>) {}\n'
    )
    report = Report()
    stage: Usd.Stage = open_stage(tmp_path / "s.usda", report=report)
    assert stage.GetPrimAtPath("/M")
    assert report.codes() == {"usd-warning"}
    assert "m.mtlx" in str(next(iter(report)))
