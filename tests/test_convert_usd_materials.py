"""Convert a stage: reflectance maps and cd/m2 over its UsdPreviewSurface networks."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import CODES, png
from converted import opened, run, sidecar
from overlaid import paint, stage_file
from pxr import Sdf, Usd, UsdShade, UsdUtils

from hdrusd.conversion import Result
from hdrusd.images import read_exr, write_exr
from hdrusd.units import LUMINANCE_WEIGHTS

WALL = "asset inputs:file = @wall.png@"


def convert(folder: Path, *parts: str, toml: str = "", **options: Any) -> Result:
    png(folder / "wall.png")
    sidecar(folder, toml)
    source = stage_file(folder / "town.usda", *parts)
    return run(source, folder / "night.usda", **options)


def surface(result: Result, path: str = "/World/paint") -> UsdShade.Shader:
    stage = opened(result)
    return UsdShade.Material(stage.GetPrimAtPath(path)).ComputeSurfaceSource()[0]


def node(shader: UsdShade.Shader, name: str) -> UsdShade.Shader:
    sources, _ = shader.GetInput(name).GetConnectedSources()
    return UsdShade.Shader(sources[0].source.GetPrim())


def texels(shader: UsdShade.Shader, name: str = "diffuseColor") -> Any:
    return read_exr(Path(node(shader, name).GetInput("file").Get().resolvedPath))[0]


def close(diffuse: tuple[float, float, float]) -> Any:
    """R = T^2.2 D; half floats: 2^-12 of relative rounding, 2^-25 at the low end."""
    return pytest.approx((CODES / 255.0) ** 2.2 * diffuse, rel=2**-11, abs=2**-25)


@pytest.mark.parametrize("space", ["", 'token inputs:sourceColorSpace = "sRGB"'])
def test_a_picture_for_a_screen_becomes_a_reflectance_map(tmp_path: Path, space: str) -> None:
    texture = f"{WALL}\nfloat4 inputs:scale = (0.5, 1, 0.25, 1)\n{space}"
    result = convert(tmp_path, paint("/World/paint", texture))
    shader = surface(result)
    assert texels(shader) == close((0.5, 1.0, 0.25))
    made = node(shader, "diffuseColor")
    assert made.GetInput("sourceColorSpace").Get() == "raw"
    assert tuple(made.GetInput("scale").Get()) == (1.0, 1.0, 1.0, 1.0)
    prim = opened(result).GetPrimAtPath("/World/paint")
    assert tuple(prim.GetAttribute("photometric:diffuse").Get()) == (0.5, 1.0, 0.25)
    assert prim.GetAttribute("photometric:gamma").Get() == pytest.approx(2.2)
    kept = Path(prim.GetAttribute("photometric:sourceTexture").Get().resolvedPath)
    assert kept.read_bytes() == (tmp_path / "wall.png").read_bytes()
    (row,) = result.materials
    assert row["reflectance_map"].endswith(".exr")


def test_a_picture_of_reflectance_stays(tmp_path: Path) -> None:
    texture = f'{WALL}\ntoken inputs:sourceColorSpace = "raw"'
    result = convert(tmp_path, paint("/World/paint", texture))
    used = node(surface(result), "diffuseColor")
    assert used.GetPath() == "/World/paint/T"
    assert not result.textures


def test_floats_are_reflectance_when_the_file_decides(tmp_path: Path) -> None:
    write_exr(tmp_path / "wall.exr", np.full((2, 2, 3), 0.5, np.float32), luminance=False)
    result = convert(tmp_path, paint("/World/paint", "asset inputs:file = @wall.exr@"))
    assert node(surface(result), "diffuseColor").GetPath() == "/World/paint/T"


def test_what_the_picture_was_laid_by_stays(tmp_path: Path) -> None:
    """Wrap, bias, coordinates and their transform; what else the picture feeds is not touched."""
    texture = f"""{WALL}
        token inputs:wrapS = "mirror"
        token inputs:wrapT = "clamp"
        float4 inputs:fallback = (1, 0, 1, 1)
        float2 inputs:st.connect = </World/paint/X.outputs:result>"""
    extra = """
    def Shader "X"
    {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </World/paint/P.outputs:result>
        float2 inputs:scale = (4, 4)
        float2 outputs:result
    }
    def Shader "P"
    {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "map1"
        float2 outputs:result
    }"""
    opacity = "float inputs:opacity.connect = </World/paint/T.outputs:a>\n"
    opacity += "normal3f inputs:normal.connect = </World/paint/N.outputs:rgb>"
    result = convert(tmp_path, paint("/World/paint", texture, opacity, extra))
    shader = surface(result)
    made = node(shader, "diffuseColor")
    said = {name: made.GetInput(name).Get() for name in ("wrapS", "wrapT", "fallback")}
    assert said == {"wrapS": "mirror", "wrapT": "clamp", "fallback": (1.0, 0.0, 1.0, 1.0)}
    assert node(made, "st").GetPath() == "/World/paint/X"
    old = node(shader, "opacity")
    assert old.GetPath() == "/World/paint/T"
    assert old.GetInput("file").Get().path == "wall.png"
    targets = shader.GetPrim().GetAttribute("inputs:normal").GetConnections()
    assert targets == ["/World/paint/N.outputs:rgb"]


def test_the_photometry_layer_muted_leaves_the_source(tmp_path: Path) -> None:
    result = convert(tmp_path, paint("/World/paint", WALL))
    stage = Usd.Stage.Open(str(result.output))
    stage.MuteLayer(str(result.output.with_suffix(".photometry.usda")))
    shader = UsdShade.Material(stage.GetPrimAtPath("/World/paint")).ComputeSurfaceSource()[0]
    assert node(shader, "diffuseColor").GetPath() == "/World/paint/T"
    assert stage.GetDefaultPrim().GetPath() == "/World"


def test_a_constant_is_reflectance_already_and_none_is_above_1(tmp_path: Path) -> None:
    grey = paint("/World/paint", surface="color3f inputs:diffuseColor = (0.5, 0.25, 0.125)")
    white = paint("/World/white", surface="color3f inputs:diffuseColor = (2, 1, 0.5)")
    result = convert(tmp_path, grey, white)
    assert tuple(surface(result).GetInput("diffuseColor").Get()) == (0.5, 0.25, 0.125)
    clipped = surface(result, "/World/white").GetInput("diffuseColor").Get()
    assert tuple(clipped) == (1.0, 1.0, 0.5)
    assert "diffuse-clipped" in result.report.codes()


def test_emission_is_cd_by_the_letter_or_by_the_photometry_file(tmp_path: Path) -> None:
    glow = "color3f inputs:emissiveColor = (3, 3, 3)"
    toml = '[[material]]\nmatch = "glass"\nluminance = 12000\n'
    parts = paint("/World/paint", surface=glow), paint("/World/glass", surface=glow)
    result = convert(tmp_path, *parts, toml=toml)
    stage = opened(result)
    stated = {
        name: stage.GetPrimAtPath(f"/World/{name}").GetAttribute("photometric:luminance").Get()
        for name in ("paint", "glass")
    }
    assert stated == pytest.approx({"paint": 3.0, "glass": 12000.0})
    glass = surface(result, "/World/glass")
    assert tuple(glass.GetInput("emissiveColor").Get()) == pytest.approx((12000.0,) * 3)
    assert tuple(glass.GetInput("diffuseColor").Get()) == (0.0, 0.0, 0.0)  # a lamp's glass
    assert [f.thing for f in result.report if f.code == "usd-emission-unit"] == ["/World/paint"]


def test_a_lamp_s_picture_shows_its_luminance(tmp_path: Path) -> None:
    toml = '[[material]]\nmatch = "paint"\nluminance = 5000\nhdr_texture = true\n'
    result = convert(tmp_path, paint("/World/paint", WALL), toml=toml)
    made = node(surface(result), "emissiveColor")
    assert texels(surface(result), "emissiveColor") == close((1.0, 1.0, 1.0))  # its peak is white
    assert tuple(made.GetInput("scale").Get())[:3] == pytest.approx((5000.0,) * 3, rel=1e-6)


#: What feeds a lamp's emission, and the coat over it.
GLOW = """color3f inputs:emissiveColor.connect = </World/paint/E.outputs:rgb>
        float inputs:clearcoat.connect = </World/paint/E.outputs:r>"""
PICTURE = """
    def Shader "E"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{}@
        token inputs:sourceColorSpace = "{}"
        float3 outputs:rgb
        float outputs:r
    }}"""


@pytest.mark.parametrize(
    ("file", "space", "gamma"),
    [("wall.png", "sRGB", 2.2), ("wall.png", "raw", 1.0), ("wall.exr", "auto", 1.0)],
)
@pytest.mark.parametrize(
    ("stated", "mean"),  # cd/m2 over all of the lamp
    [
        ("luminance = 500", None),
        ("candela = 10\narea = 0.25", 40.0),
        ("lumens = 10\narea = 0.25", 40.0 / np.pi),
    ],
)
def test_a_lamp_keeps_its_picture_of_emission(
    tmp_path: Path, file: str, space: str, gamma: float, stated: str, mean: float | None
) -> None:
    """Codes for a screen by T^2.2, values as they are; I / A is the mean over the picture."""
    write_exr(tmp_path / "wall.exr", CODES / np.float32(255.0), luminance=False)
    toml = f'[[material]]\nmatch = "paint"\n{stated}\n'
    made = paint("/World/paint", surface=GLOW, extra=PICTURE.format(file, space))
    shader = surface(convert(tmp_path, made, toml=toml))
    linear = (CODES / 255.0) ** gamma
    assert texels(shader, "emissiveColor") == pytest.approx(linear, rel=2**-11, abs=2**-25)
    wanted = 500.0 if mean is None else mean / float((linear @ LUMINANCE_WEIGHTS).mean())
    scale = node(shader, "emissiveColor").GetInput("scale").Get()
    assert tuple(scale)[:3] == pytest.approx((wanted,) * 3, rel=1e-6)
    assert not shader.GetInput("diffuseColor")  # not made black
    assert shader.GetInput("clearcoat").GetConnectedSources()[0]


def test_a_lamp_s_glass_has_no_coat(tmp_path: Path) -> None:
    coat = "float inputs:clearcoat.connect = </World/paint/E.outputs:r>"
    made = paint("/World/paint", surface=coat, extra=PICTURE.format("wall.png", "raw"))
    toml = '[[material]]\nmatch = "paint"\nluminance = 500\n'
    shader = surface(convert(tmp_path, made, toml=toml))
    assert tuple(shader.GetInput("diffuseColor").Get()) == (0.0, 0.0, 0.0)
    assert shader.GetInput("clearcoat").Get() == 0.0
    assert not shader.GetInput("clearcoat").GetConnectedSources()[0]


def test_a_stated_gloss(tmp_path: Path) -> None:
    toml = '[[material]]\nmatch = "paint"\nspecular = [0.02, 0.02, 0.02]\nroughness = 0.3\n'
    result = convert(tmp_path, paint("/World/paint", WALL), toml=toml)
    shader = surface(result)
    assert shader.GetInput("useSpecularWorkflow").Get() == 1
    assert tuple(shader.GetInput("specularColor").Get()) == pytest.approx((0.02,) * 3)
    assert shader.GetInput("roughness").Get() == pytest.approx(0.3)


def test_what_is_not_converted_is_kept_and_said(tmp_path: Path) -> None:
    tiles = paint("/World/tiles", "asset inputs:file = @wall.<UDIM>.png@")
    negative = WALL + "\nfloat4 inputs:scale = (-1, -1, -1, 1)\nfloat4 inputs:bias = (1, 1, 1, 0)"
    samples = "color3f inputs:diffuseColor.timeSamples = { 0: (1, 1, 1), 9: (0, 0, 0) }"
    moving = paint("/World/moving", surface=samples)
    empty = 'def Material "empty"\n{\n}'
    film = paint("/World/film", negative)
    result = convert(tmp_path, tiles, moving, empty, film)
    kept = {f.thing for f in result.report if f.code == "usd-material-kept"}
    assert kept == {"/World/tiles", "/World/moving", "/World/empty", "/World/film"}
    assert node(surface(result, "/World/tiles"), "diffuseColor").GetPath() == "/World/tiles/T"


@pytest.mark.parametrize("picture", ["wood [old].png", "wood[1].png", "in [1]/wood.png"])
def test_a_bracket_in_a_files_name_makes_no_package_of_it(tmp_path: Path, picture: str) -> None:
    folder = tmp_path / "town [v2]"
    png(folder / picture)
    painted = paint("/World/paint", f"asset inputs:file = @./{picture}@")
    stage_file(folder / "base[1].usda", painted)
    layers = '#usda 1.0\n(\n    subLayers = [@./base[1].usda@]\n    defaultPrim = "World"\n)\n'
    result = run(stage_file(folder / "town[1].usda", head=layers), folder / "night.usda")
    assert texels(surface(result)) == close((1.0, 1.0, 1.0))
    assert not result.report.codes() & {"file-missing", "file-refused"}


@pytest.mark.parametrize(("folder", "picture"), [("", "wall.png"), ("to [1]", "wall[1].png")])
def test_pictures_in_a_package(tmp_path: Path, folder: str, picture: str) -> None:
    loose = tmp_path / "loose"
    png(loose / picture)
    stage_file(loose / "town.usda", paint("/World/paint", f"asset inputs:file = @./{picture}@"))
    package = tmp_path / folder / "town.usdz"
    package.parent.mkdir(exist_ok=True)
    assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(loose / "town.usda")), str(package))
    shutil.rmtree(loose)
    result = run(package, package.with_name("night.usda"))
    assert texels(surface(result)) == close((1.0, 1.0, 1.0))
    root = Sdf.Layer.FindOrOpen(str(result.output))
    assert list(root.subLayerPaths) == ["./night.photometry.usda", "./town.usdz"]


def test_pictures_outside_the_roots_are_not_read(tmp_path: Path) -> None:
    png(tmp_path / "secret.png")
    inside = stage_file(
        tmp_path / "in" / "town.usda", paint("/World/paint", "asset inputs:file = @../secret.png@")
    )
    refused = run(inside, tmp_path / "in" / "night.usda")
    assert "file-refused" in refused.report.codes()
    assert not refused.textures
    allowed = run(inside, tmp_path / "out" / "night.usda", roots=[tmp_path])
    assert texels(surface(allowed)) == close((1.0, 1.0, 1.0))


def test_layers_outside_the_roots_are_not_read(tmp_path: Path) -> None:
    stage_file(tmp_path / "secret.usda", 'def SphereLight "Secret"\n{\n}')
    layers = '#usda 1.0\n(\n    subLayers = [@../secret.usda@]\n    defaultPrim = "World"\n)\n'
    reference = 'def "Other" (\n    references = @../secret.usda@\n)\n{\n}\n'
    inside = stage_file(
        tmp_path / "in" / "town.usda",
        reference,
        'def SphereLight "Own"\n{\n}',
        head=layers,
    )
    result = run(inside, tmp_path / "in" / "night.usda")
    assert [row["name"] for row in result.lights] == ["Own"]
    assert "file-refused" in result.report.codes()


def test_the_same_input_makes_the_same_bytes(tmp_path: Path) -> None:
    png(tmp_path / "wall.png")
    source = stage_file(tmp_path / "town.usda", paint("/World/paint", WALL))
    written = []
    for name in ("a", "b"):
        result = run(source, tmp_path / name / "night.usda")
        files = sorted(p for p in (tmp_path / name).rglob("*") if p.is_file())
        written.append([(p.name, p.read_bytes()) for p in files])
        assert result.output.is_file()
    assert written[0] == written[1]
