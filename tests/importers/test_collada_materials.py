"""COLLADA materials: shaders, the ways to say opacity, textures and what they are bound to."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from collada_builder import (
    bound,
    document,
    load,
    material,
    mesh_document,
    source,
    triangles,
)

from hdrusd.importers.collada_textures import file_name
from hdrusd.legacy.scene import Material, Texture
from hdrusd.report import Report

IMAGE = '<library_images><image id="i"><init_from>{}</init_from></image></library_images>'
SAMPLED = (
    '<newparam sid="sf"><surface type="2D"><init_from>i</init_from></surface></newparam>'
    '<newparam sid="sm"><sampler2D><source>sf</source>{}</sampler2D></newparam>'
)


def only(folder: Path, shader: str, **more: str) -> tuple[Material, Report]:
    """The one material of a document with a shader."""
    tool = more.pop("tool", "")
    image = IMAGE.format(more.pop("image", "a.png"))
    scene, report = load(folder, document(image + material(shader, **more), tool=tool))
    (made,) = scene.materials
    return made, report


def textured(folder: Path, wraps: str = "", more: str = "") -> tuple[Texture, Report]:
    """The diffuse texture of a material with a sampler."""
    (folder / "a.png").write_bytes(b"picture")
    shader = (
        f'<phong><diffuse><texture texture="sm" texcoord="U">{more}</texture></diffuse></phong>'
    )
    made, report = only(folder, shader, params=SAMPLED.format(wraps))
    assert made.diffuse_map is not None
    return made.diffuse_map, report


def test_a_phong_has_all_that_opengl_has(tmp_path: Path) -> None:
    shader = (
        "<phong><emission><color>.5 .25 0 1</color></emission>"
        "<ambient><color>.1 .2 .3 1</color></ambient><diffuse><color>.4 .5 .6 1</color></diffuse>"
        "<specular><color>.7 .8 .9 1</color></specular><shininess><float>20</float></shininess>"
        "</phong>"
    )
    made, report = only(tmp_path, shader)
    assert made.emission == (0.5, 0.25, 0.0)
    assert made.ambient == (0.1, 0.2, 0.3)
    assert made.diffuse == (0.4, 0.5, 0.6)
    assert made.specular == (0.7, 0.8, 0.9)
    assert (made.shininess, made.alpha, made.lit) == (20.0, 1.0, True)
    assert not made.defaults
    assert not report.codes()


def test_a_lambert_has_no_highlight(tmp_path: Path) -> None:
    shader = (
        "<lambert><diffuse><color>1 1 1 1</color></diffuse>"
        "<specular><color>0 .5 0 1</color></specular></lambert>"
    )
    made, report = only(tmp_path, shader)
    assert made.specular == (0.0, 0.0, 0.0)
    assert "material-part" in report.codes()


def test_a_constant_is_not_lit(tmp_path: Path) -> None:
    made, _ = only(tmp_path, "<constant><emission><color>1 1 0 1</color></emission></constant>")
    assert not made.lit
    assert made.emission == (1.0, 1.0, 0.0)
    assert made.diffuse == (0.0, 0.0, 0.0)


def test_colours_may_be_named(tmp_path: Path) -> None:
    params = '<newparam sid="c"><float4>.1 .2 .3 1</float4></newparam>'
    shader = '<phong><diffuse><param ref="c"/></diffuse></phong>'
    made, _ = only(tmp_path, shader, params=params)
    assert made.diffuse == (0.1, 0.2, 0.3)


OPACITY = [
    # COLLADA 1.4.1 chapter 7, "Determining transparency": A_ONE is a t, RGB_ZERO 1 - l t
    ('opaque="A_ONE"', "1 1 1 1", 0.25, 0.25),
    ('opaque="A_ONE"', "1 1 1 .5", 0.5, 0.25),
    ("", "0 0 0 .5", 1.0, 0.5),
    ('opaque="RGB_ZERO"', "1 1 1 1", 0.25, 0.75),
    ('opaque="RGB_ZERO"', ".5 .5 .5 1", 0.5, 0.75),
    ('opaque="RGB_ZERO"', "0 0 0 1", 1.0, 1.0),
    ('opaque="A_ZERO"', "1 1 1 .25", 1.0, 0.75),
    ('opaque="RGB_ONE"', ".25 .25 .25 1", 1.0, 0.25),
]


@pytest.mark.parametrize(("mode", "color", "amount", "alpha"), OPACITY)
def test_opacity(tmp_path: Path, mode: str, color: str, amount: float, alpha: float) -> None:
    shader = (
        f"<phong><diffuse><color>1 1 1 1</color></diffuse><transparent {mode}>"
        f"<color>{color}</color></transparent><transparency><float>{amount}</float>"
        "</transparency></phong>"
    )
    made, report = only(tmp_path, shader)
    assert math.isclose(made.alpha, alpha, rel_tol=1e-12)
    assert made.alpha_mode == ("opaque" if alpha == 1.0 else "blend")
    assert not report.codes()


@pytest.mark.parametrize(
    ("tool", "amount", "alpha"),
    [("FBX COLLADA exporter", 0.0, 1.0), ("FBX COLLADA exporter", 0.25, 0.75), ("", 0.0, 1.0)],
)
def test_opacity_that_exporters_turned_over(
    tmp_path: Path, tool: str, amount: float, alpha: float
) -> None:
    shader = (
        "<phong><diffuse><color>1 1 1 1</color></diffuse><transparent><color>1 1 1 1</color>"
        f"</transparent><transparency><float>{amount}</float></transparency></phong>"
    )
    made, report = only(tmp_path, shader, tool=tool)
    assert made.alpha == alpha
    assert "collada-opacity-inverted" in report.codes()


def test_opacity_from_the_alpha_of_a_picture(tmp_path: Path) -> None:
    use = '<texture texture="i" texcoord="U"/>'
    shader = (
        f"<phong><diffuse>{use}</diffuse><transparent opaque='A_ONE'>{use}</transparent></phong>"
    )
    made, _ = only(tmp_path, shader)
    assert made.opacity_map is not None
    assert made.opacity_map.channel == "a"
    assert made.diffuse_map is not None
    assert made.diffuse_map.image is made.opacity_map.image
    assert (made.alpha, made.alpha_mode) == (1.0, "blend")


def test_the_alpha_of_the_diffuse_colour_is_no_opacity(tmp_path: Path) -> None:
    made, report = only(tmp_path, "<phong><diffuse><color>1 1 1 .5</color></diffuse></phong>")
    assert made.alpha == 1.0
    assert "collada-diffuse-alpha" in report.codes()


def test_double_sided_by_an_extra(tmp_path: Path) -> None:
    shader = "<phong><diffuse><color>1 1 1 1</color></diffuse></phong>"
    extra = '<extra><technique profile="{}"><double_sided>{}</double_sided></technique></extra>'
    for profile, value, both in (("GOOGLEEARTH", 1, True), ("MAX3D", 0, False)):
        made, _ = only(tmp_path, shader, more=extra.format(profile, value))
        assert made.two_sided is both


@pytest.mark.parametrize(
    ("word", "wrap"),
    [("WRAP", "repeat"), ("MIRROR", "mirror"), ("CLAMP", "clamp"), ("BORDER", "black")],
)
def test_wraps_of_the_sampler(tmp_path: Path, word: str, wrap: str) -> None:
    texture, report = textured(tmp_path, f"<wrap_s>{word}</wrap_s>")
    assert (texture.wrap_s, texture.wrap_t) == (wrap, "repeat")
    assert not report.codes() - {"collada-diffuse-default"}


def test_wraps_and_scale_of_an_exporter(tmp_path: Path) -> None:
    more = (
        '<extra><technique profile="MAYA"><wrapU>0</wrapU><mirrorV>TRUE</mirrorV>'
        "<repeatU>4</repeatU><repeatV>2</repeatV><offsetU>.5</offsetU></technique></extra>"
    )
    texture, _ = textured(tmp_path, "", more)
    assert (texture.wrap_s, texture.wrap_t) == ("black", "mirror")
    assert texture.transform is not None
    assert texture.transform.scale == (4.0, 2.0)
    assert texture.transform.translation == (0.5, 0.0)


def test_a_rotation_about_the_middle_keeps_the_middle(tmp_path: Path) -> None:
    more = '<extra><technique profile="MAYA"><rotateUV>90</rotateUV></technique></extra>'
    texture, _ = textured(tmp_path, "", more)
    transform = texture.transform
    assert transform is not None
    c, s = math.cos(math.radians(transform.rotation)), math.sin(math.radians(transform.rotation))
    middle = (
        c * 0.5 - s * 0.5 + transform.translation[0],
        s * 0.5 + c * 0.5 + (transform.translation[1]),
    )
    assert middle == pytest.approx((0.5, 0.5), abs=1e-15)


@pytest.mark.parametrize(
    ("reference", "name"),
    [
        ("a.png", "a.png"),
        ("file:///C:/maps/a.png", "C:/maps/a.png"),
        ("file://C:\\maps\\a.png", "C:/maps/a.png"),
        ("file:///home/me/a.png", "/home/me/a.png"),
        ("file:///etc/passwd", "/etc/passwd"),
        ("/C:/maps/a.png", "C:/maps/a.png"),
        ("./a.png", "./a.png"),
    ],
)
def test_file_urls(reference: str, name: str) -> None:
    assert file_name(reference) == name


@pytest.mark.parametrize(
    "reference", ["my%20wall.png", "my wall.png", "file:///C:/maps/my%20wall.png", "MY WALL.PNG"]
)
def test_pictures_are_found_beside_the_file(tmp_path: Path, reference: str) -> None:
    (tmp_path / "my wall.png").write_bytes(b"picture")
    shader = '<phong><diffuse><texture texture="i" texcoord="U"/></diffuse></phong>'
    made, _ = only(tmp_path, shader, image=reference)
    assert made.diffuse_map is not None
    assert made.diffuse_map.image.path == (tmp_path / "my wall.png").resolve()


@pytest.mark.parametrize(
    "reference", ["file:///etc/passwd", "../../secret.png", "/etc/passwd", "%2e%2e/secret.png"]
)
def test_nothing_outside_the_roots_is_read(tmp_path: Path, reference: str) -> None:
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    (tmp_path / "secret.png").write_bytes(b"secret")
    (tmp_path / "a" / "secret.png").write_bytes(b"secret")
    shader = '<phong><diffuse><texture texture="i" texcoord="U"/></diffuse></phong>'
    made, report = only(inner, shader, image=reference)
    assert made.diffuse_map is not None
    assert made.diffuse_map.image.missing
    assert made.diffuse_map.image.name == reference  # kept, so that it can be mended
    assert report.codes() & {"file-refused", "file-missing"}


@pytest.mark.parametrize(
    ("channel", "inputs", "uv_set"),
    [
        ("A", '<bind_vertex_input semantic="A" input_semantic="TEXCOORD" input_set="2"/>', "st1"),
        ("A", '<bind_vertex_input semantic="A" input_semantic="TEXCOORD" input_set="1"/>', "st"),
        ("CHANNEL2", "", "st1"),
        ("whatever", "", "st"),
    ],
)
def test_textures_read_the_coordinates_that_are_bound(
    tmp_path: Path, channel: str, inputs: str, uv_set: str
) -> None:
    more = (
        '<input semantic="TEXCOORD" source="#t" offset="1" set="1"/>'
        '<input semantic="TEXCOORD" source="#t" offset="2" set="2"/>'
    )
    use = f'<texture texture="i" texcoord="{channel}"/>'
    libraries = IMAGE.format("a.png") + material(f"<phong><diffuse>{use}</diffuse></phong>")
    text = mesh_document(
        triangles("0 0 0 1 1 0 2 0 1", more),
        source("t", "0 0 1 1", 2),
        bind=bound(inputs),
        libraries=libraries,
    )
    scene, report = load(tmp_path, text)
    texture = scene.materials[scene.meshes[0].material or 0].diffuse_map
    assert texture is not None
    assert texture.uv_set == uv_set
    assert ("collada-texcoord" in report.codes()) == (not inputs)


def test_lost_textures_are_named(tmp_path: Path) -> None:
    use = '<texture texture="i" texcoord="U"/>'
    shader = (
        f"<phong><diffuse><color>1 1 1 1</color></diffuse><specular>{use}</specular></phong>"
        f'<extra><technique profile="FCOLLADA"><bump>{use}</bump></technique></extra>'
    )
    _, report = only(tmp_path, shader)
    (text,) = [f.text for f in report if f.code == "material-part"]
    assert "specular" in text
    assert "bump" in text
