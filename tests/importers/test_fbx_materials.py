"""FBX: Lambert and Phong by their factors, pictures, opacity, and physical shaders."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

import numpy as np
import pytest
from fbx_builder import SQUARE, Fbx, P, layer, load, needs_ufbx, properties

from hdrusd.legacy.scene import Material, UVTransform
from hdrusd.report import Report

pytestmark = needs_ufbx

#: A PNG of one grey texel.
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c6360000000020001e221bc330000000049454e44ae426082"
)


def add_material(fbx: Fbx, shading: str, *props: str, sets: tuple[str, ...] = ("uv",)) -> int:
    """A material on a square; its number."""
    node = fbx.model("n", "Mesh")
    layers = [
        layer("LayerElementUV", "UV", [0.0, 0.0], [0] * 4, number=number, name=name)
        for number, name in enumerate(sets)
    ]
    fbx.mesh(node, SQUARE, [(0, 1, 2, 3)], *layers)
    body = "Version: 102", f'ShadingModel: "{shading}"', properties(*props)
    return fbx.add("Material", "m", "", *body, under=node)


def add_texture(fbx: Fbx, material: int, prop: str, name: str, *props: str) -> int:
    """A picture on a property of a material."""
    body = f'RelativeFilename: "{name}"', f'FileName: "C:\\old\\{name}"', properties(*props)
    made = fbx.add("Texture", name, "", 'Type: "TextureVideoClip"', *body, under=None)
    fbx.connect(made, material, prop)
    return made


def one(folder: Path, shading: str, *props: str) -> tuple[Material, Report]:
    """A material without pictures."""
    fbx = Fbx()
    add_material(fbx, shading, *props)
    scene, report = load(fbx.write(folder))
    return scene.materials[0], report


def colour(name: str, r: float, g: float, b: float) -> str:
    return P(name, r, g, b, kind="Color")


PHONG = (
    colour("AmbientColor", 0.25, 0.5, 0.5),
    P("AmbientFactor", 0.5),
    colour("DiffuseColor", 1.0, 0.5, 0.5),
    P("DiffuseFactor", 0.5),
    colour("SpecularColor", 0.25, 0.25, 0.5),
    P("SpecularFactor", 0.5),
    P("ShininessExponent", 10.0),
    colour("EmissiveColor", 0.5, 0.25, 0.5),
    P("EmissiveFactor", 0.5),
)


def test_phong_is_colour_times_factor(tmp_path: Path) -> None:
    made, report = one(tmp_path, "phong", *PHONG)
    assert made.ambient == (0.125, 0.25, 0.25)
    assert made.diffuse == (0.5, 0.25, 0.25)
    assert made.specular == (0.125, 0.125, 0.25)
    assert made.emission == (0.25, 0.125, 0.25)
    assert made.shininess == 10.0
    assert made.alpha == 1.0
    assert made.alpha_mode == "opaque"
    assert made.pbr is None
    assert made.two_sided
    assert not made.emission_cd_m2
    assert made.defaults == {"alpha"}
    assert "material-part" not in report.codes()


def test_lambert_has_no_highlight(tmp_path: Path) -> None:
    made, _ = one(tmp_path, "lambert", colour("DiffuseColor", 0.25, 0.5, 1.0))
    assert made.diffuse == (0.25, 0.5, 1.0)
    assert made.specular == (0.0, 0.0, 0.0)
    assert {"ambient", "emission"} <= made.defaults
    assert "diffuse" not in made.defaults


@pytest.mark.parametrize(
    ("color", "factor", "alpha"),
    [
        ((0.0, 0.0, 0.0), 1.0, 1.0),  # Maya's opaque
        ((1.0, 1.0, 1.0), 0.0, 1.0),  # 3ds Max's and Blender's
        ((0.25, 0.25, 0.25), 1.0, 0.75),
        ((1.0, 1.0, 1.0), 0.25, 0.75),
        ((0.75, 0.5, 0.25), 1.0, 0.5),  # the mean, as the SDK writes Opacity
    ],
)
def test_opacity_is_what_is_not_let_through(
    tmp_path: Path, color: tuple[float, float, float], factor: float, alpha: float
) -> None:
    made, report = one(
        tmp_path, "phong", colour("TransparentColor", *color), P("TransparencyFactor", factor)
    )
    assert made.alpha == pytest.approx(alpha, rel=1e-15)
    assert made.alpha_mode == ("opaque" if alpha == 1.0 else "blend")
    assert ("fbx-transparent-colour" in report.codes()) == (len(set(color)) > 1)


def test_opacity_as_stated_goes_first(tmp_path: Path) -> None:
    """Transparent by colour and factor, and yet Opacity 1: what some exporters write."""
    made, report = one(
        tmp_path,
        "phong",
        colour("TransparentColor", 1.0, 1.0, 1.0),
        P("TransparencyFactor", 1.0),
        P("Opacity", 1.0),
    )
    assert made.alpha == 1.0
    assert "fbx-opacity" in report.codes()


def test_picture_stands_for_the_colour_and_the_factor_stays(tmp_path: Path) -> None:
    (tmp_path / "wall.png").write_bytes(PNG)
    fbx = Fbx()
    material = add_material(
        fbx, "lambert", colour("DiffuseColor", 0.25, 0.25, 0.25), P("DiffuseFactor", 0.5)
    )
    add_texture(fbx, material, "DiffuseColor", "wall.png")
    scene, report = load(fbx.write(tmp_path))
    (made,) = scene.materials
    assert made.diffuse == (0.5, 0.5, 0.5)
    assert made.diffuse_map is not None
    assert made.diffuse_map.image.path == (tmp_path / "wall.png").resolve()
    assert (made.diffuse_map.wrap_s, made.diffuse_map.wrap_t) == ("repeat", "repeat")
    assert made.diffuse_map.transform is None
    assert made.diffuse_map.uv_set == "st"
    assert "file-missing" not in report.codes()


def test_backslashes_case_and_windows_paths(tmp_path: Path) -> None:
    (tmp_path / "textures").mkdir()
    (tmp_path / "textures" / "Wall.PNG").write_bytes(PNG)
    for written in ("..\\maps\\wall.png", "D:\\work\\Wall.png"):
        fbx = Fbx()
        add_texture(fbx, add_material(fbx, "lambert"), "DiffuseColor", written)
        scene, report = load(fbx.write(tmp_path))
        found = scene.materials[0].diffuse_map
        assert found is not None
        assert found.image.path == (tmp_path / "textures" / "Wall.PNG").resolve()
        assert found.image.name == written
        assert "file-found-elsewhere" in report.codes()


def test_nothing_outside_the_roots_is_opened(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(PNG)
    folder = tmp_path / "in"
    folder.mkdir()
    fbx = Fbx()
    add_texture(fbx, add_material(fbx, "lambert"), "DiffuseColor", "..\\secret.png")
    scene, report = load(fbx.write(folder))
    found = scene.materials[0].diffuse_map
    assert found is not None
    assert found.image.missing
    assert "file-refused" in report.codes()


def test_wraps_and_sets(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(PNG)
    fbx = Fbx()
    material = add_material(fbx, "lambert", sets=("base", "light"))
    add_texture(
        fbx,
        material,
        "DiffuseColor",
        "a.png",
        P("UVSet", "light", kind="KString"),
        P("WrapModeU", 1, kind="enum"),
    )
    scene, report = load(fbx.write(tmp_path))
    found = scene.materials[0].diffuse_map
    assert found is not None
    assert found.uv_set == "st1"
    assert (found.wrap_s, found.wrap_t) == ("clamp", "repeat")
    assert "fbx-uv-set" not in report.codes()


def laid(found: UVTransform, u: float, v: float) -> tuple[float, float]:
    """UsdTransform2d: scale, turn, shift."""
    c, s = np.cos(np.radians(found.rotation)), np.sin(np.radians(found.rotation))
    x, y = u * found.scale[0], v * found.scale[1]
    return c * x - s * y + found.translation[0], s * x + c * y + found.translation[1]


@pytest.mark.parametrize(
    ("props", "uv", "texel"),
    [
        ({"Scaling": (5.0, 2.0, 1.0)}, (1.0, 1.0), (5.0, 2.0)),  # Maya's repeatUV
        ({"Translation": (1.0, 2.0, 0.0)}, (0.5, 0.5), (-0.5, -1.5)),  # translateFrame
        # rotateFrame 45 about the middle, as Maya writes it: the middle stays
        (
            {"Translation": (0.5, 0.5 - 0.5**0.5, 0.0), "Rotation": (0.0, 0.0, 45.0)},
            (0.5, 0.5),
            (0.5, 0.5),
        ),
        (
            {"Translation": (0.5, 0.5 - 0.5**0.5, 0.0), "Rotation": (0.0, 0.0, 45.0)},
            (1.0, 0.5),
            (0.5 + 0.125**0.5, 0.5 - 0.125**0.5),
        ),
        (
            {"Scaling": (3.0, 3.0, 1.0), "TextureScalingPivot": (0.5, 0.5, 0.0)},
            (0.5, 1.0),
            (0.5, 2.0),
        ),
        ({"Scaling": (-1.0, 1.0, 1.0)}, (0.25, 0.5), (-0.25, 0.5)),
    ],
)
def test_where_a_picture_is_laid(
    tmp_path: Path,
    props: dict[str, tuple[float, float, float]],
    uv: tuple[float, float],
    texel: tuple[float, float],
) -> None:
    fbx = Fbx()
    stated = [P(name, *values, kind="Vector") for name, values in props.items()]
    add_texture(fbx, add_material(fbx, "lambert"), "DiffuseColor", "a.png", *stated)
    scene, report = load(fbx.write(tmp_path))
    found = scene.materials[0].diffuse_map
    assert found is not None
    assert found.transform is not None
    assert laid(found.transform, *uv) == pytest.approx(texel, abs=1e-12)
    assert "fbx-uv-transform" in report.codes()


def test_embedded_picture(tmp_path: Path) -> None:
    fbx = Fbx()
    material = add_material(fbx, "lambert")
    texture = add_texture(fbx, material, "DiffuseColor", "gone.png")
    content = f'Content: ,\n"{b64encode(PNG).decode()}"'
    body = 'Type: "Clip"', 'RelativeFilename: "gone.png"', content
    fbx.connect(fbx.add("Video", "gone", "Clip", *body, under=None), texture)
    scene, report = load(fbx.write(tmp_path))
    found = scene.materials[0].diffuse_map
    assert found is not None
    assert found.image.data == PNG
    assert found.image.path is None
    assert "file-missing" not in report.codes()


def test_alpha_of_the_diffuse_picture(tmp_path: Path) -> None:
    """One picture on both: its alpha is the opacity."""
    (tmp_path / "leaf.png").write_bytes(PNG)
    fbx = Fbx()
    material = add_material(fbx, "lambert")
    for prop in ("DiffuseColor", "TransparentColor"):
        add_texture(fbx, material, prop, "leaf.png")
    made = load(fbx.write(tmp_path))[0].materials[0]
    assert made.opacity_map is not None
    assert made.opacity_map.channel == "a"
    assert (made.alpha, made.alpha_mode) == (1.0, "blend")


def test_pictures_without_a_home_are_kept_by_name(tmp_path: Path) -> None:
    fbx = Fbx()
    material = add_material(fbx, "phong")
    add_texture(fbx, material, "Bump", "dents.png")
    made, report = (scene := load(fbx.write(tmp_path)))[0].materials[0], scene[1]
    assert made.extras["Bump"] == "dents.png"
    assert made.normal_map is None
    assert "material-part" in report.codes()


def test_layers_show_the_lowest(tmp_path: Path) -> None:
    for name in ("ground.png", "moss.png"):
        (tmp_path / name).write_bytes(PNG)
    fbx = Fbx()
    material = add_material(fbx, "lambert")
    body = "LayeredTexture: 101", "BlendModes: *2 {\n a: 0,0\n}", "Alphas: *2 {\n a: 1,1\n}"
    layered = fbx.add("LayeredTexture", "both", "", *body, under=None)
    fbx.connect(layered, material, "DiffuseColor")
    for name in ("ground.png", "moss.png"):
        made = fbx.add("Texture", name, "", f'RelativeFilename: "{name}"', under=None)
        fbx.connect(made, layered)
    scene, report = load(fbx.write(tmp_path))
    found = scene.materials[0].diffuse_map
    assert found is not None
    assert found.image.name == "ground.png"
    assert any("moss.png" in f.text for f in report if f.code == "fbx-texture-layers")


def test_negative_and_no_numbers(tmp_path: Path) -> None:
    made, report = one(
        tmp_path,
        "phong",
        colour("DiffuseColor", 0.5, -1.0, 0.25),
        P("EmissiveFactor", 1e39),
        colour("EmissiveColor", 1.0, 1.0, 1.0),
    )
    assert made.diffuse == (0.5, 0.0, 0.25)
    assert bool(np.isfinite(made.emission).all())
    assert {"light-negative", "fbx-number"} <= report.codes()
