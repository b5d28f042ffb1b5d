"""glTF materials, textures, images and KHR_texture_transform."""

from __future__ import annotations

import base64
import math
import os
from pathlib import Path
from typing import Any

import pytest
from gltf_builder import Doc, load, load_doc, load_json, only_triangle
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.importers.gltf_document import Document
from hdrusd.importers.gltf_images import uv_transform
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import Material, UVTransform
from hdrusd.report import Report

DATA = os.environ.get("HDRUSD_TESTDATA")
PNG = b"\x89PNG\r\n\x1a\n" + bytes(8)
JPEG = b"\xff\xd8\xff\xe0" + bytes(8)
WEBP = b"RIFF\0\0\0\0WEBP"
BASE = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}


def material(tmp_path: Path, source: dict[str, Any], **parts: Any) -> tuple[Material, Report]:
    """The one material, with a PNG behind texture 0 unless ``parts`` say otherwise."""
    (tmp_path / "wall.png").write_bytes(PNG)
    parts = {"images": [{"uri": "wall.png"}], "textures": [{"source": 0}]} | parts
    scene, report = load_json(tmp_path, materials=[source], **parts)
    return scene.materials[0], report


# Factors


def test_metallic_roughness_keeps_its_defaults_apart(tmp_path: Path) -> None:
    plain, _ = material(tmp_path, {})
    assert plain.diffuse == (1.0, 1.0, 1.0)
    assert plain.specular == plain.emission == (0.0, 0.0, 0.0)
    assert plain.pbr == {"metallic": 1.0, "roughness": 1.0}
    assert plain.defaults >= {"diffuse", "alpha", "metallic", "roughness", "emission"}
    assert (plain.lit, plain.two_sided, plain.emission_cd_m2) == (True, False, True)
    factors = {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0, "roughnessFactor": 0.6}
    source = {"pbrMetallicRoughness": factors, "doubleSided": True, "extras": {"id": 7}}
    given, report = material(tmp_path, source)
    assert given.diffuse == (0.1, 0.2, 0.3)
    assert given.pbr == {"metallic": 0.0, "roughness": 0.6}
    assert not given.defaults & {"diffuse", "alpha", "metallic", "roughness"}
    assert given.two_sided
    assert given.extras == {"id": 7}
    assert report.codes() == {"scene-empty"}


def test_specular_glossiness_gives_a_legacy_specular(tmp_path: Path) -> None:
    glossy = {
        "diffuseFactor": [0.5, 0.4, 0.3, 1],
        "specularFactor": [0.1, 0.2, 0.3],
        "diffuseTexture": {"index": 0},
        "specularGlossinessTexture": {"index": 0},
    }
    source = {"extensions": {"KHR_materials_pbrSpecularGlossiness": glossy}}
    result, report = material(tmp_path, source)
    assert result.diffuse == (0.5, 0.4, 0.3)
    assert result.specular == (0.1, 0.2, 0.3)
    assert result.pbr == {"glossiness": 1.0}
    assert "glossiness" in result.defaults
    assert result.diffuse_map is not None
    gloss = result.roughness_map
    assert gloss is not None
    assert (gloss.channel, gloss.scale[3], gloss.bias[3]) == ("a", -1.0, 1.0)
    assert result.specular_map is not None
    assert "material-part" not in report.codes()


def test_emission_is_factor_times_strength_in_nits(tmp_path: Path) -> None:
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 2000}}
    source = {"emissiveFactor": [1, 0.5, 0.25], "extensions": strength}
    lamp, report = material(tmp_path, source | {"emissiveTexture": {"index": 0}})
    assert lamp.emission == (2000.0, 1000.0, 500.0)
    assert lamp.emission_cd_m2
    assert "emission" not in lamp.defaults
    assert lamp.emission_map is not None
    assert report.codes() == {"scene-empty"}
    bright, report = material(tmp_path, {"emissiveFactor": [3, 0, 0]})
    assert bright.emission == (3.0, 0.0, 0.0)
    assert "colour-above-1" in report.codes()


def test_unlit_is_kept(tmp_path: Path) -> None:
    assert not material(tmp_path, {"extensions": {"KHR_materials_unlit": {}}})[0].lit


def test_unlit_is_no_metal(tmp_path: Path) -> None:
    """The extension knows no highlight, so that a metallicFactor that is not there is none."""
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1.0}}
    rough = {"pbrMetallicRoughness": {"roughnessFactor": 0.2, "metallicFactor": 1.0}}
    for more in ({}, rough):
        made, _ = material(tmp_path, {"extensions": {"KHR_materials_unlit": {}, **coat}, **more})
        assert made.pbr == {"metallic": 0.0, "roughness": 1.0}
        assert made.metallic_map is None


@pytest.mark.parametrize(
    ("mode", "alpha", "channel"),
    [("OPAQUE", 1.0, None), ("MASK", 0.25, "a"), ("BLEND", 0.25, "a"), ("FOG", 1.0, None)],
)
def test_alpha_counts_only_where_the_mode_says_so(
    tmp_path: Path, mode: str, alpha: float, channel: str | None
) -> None:
    pbr = {"baseColorFactor": [1, 1, 1, 0.25], "baseColorTexture": {"index": 0}}
    source = {"pbrMetallicRoughness": pbr, "alphaMode": mode, "alphaCutoff": 0.7}
    result, report = material(tmp_path, source)
    assert (result.alpha, result.alpha_cutoff) == (alpha, 0.7)
    assert (result.opacity_map and result.opacity_map.channel) == channel
    assert result.diffuse_map is not None
    assert result.diffuse_map.channel == "rgb"
    assert ("material-alpha" in report.codes()) == (mode == "FOG")


def test_wrong_factors_are_clamped_or_replaced_with_a_finding(tmp_path: Path) -> None:
    pbr = {"baseColorFactor": [2, -1, 0.5, 1], "metallicFactor": "shiny", "roughnessFactor": 7}
    result, report = material(tmp_path, {"pbrMetallicRoughness": pbr})
    assert result.diffuse == (1.0, 0.0, 0.5)
    assert result.pbr == {"metallic": 1.0, "roughness": 1.0}
    assert report.codes() >= {"gltf-range", "gltf-value"}


def test_what_has_no_home_is_one_finding_a_material(tmp_path: Path) -> None:
    source = {
        "extensions": {"KHR_materials_sheen": {}, "KHR_materials_transmission": {}},
    }
    _, report = material(tmp_path, source)
    (text,) = [f.text for f in report if f.code == "material-part"]
    assert "KHR_materials_sheen, KHR_materials_transmission" in text


# Textures and images


def test_samplers(tmp_path: Path) -> None:
    parts = {"samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]}
    textures = [{"source": 0, "sampler": 0}, {"source": 0}]
    source = {**BASE, "emissiveTexture": {"index": 1}}
    result, report = material(tmp_path, source, textures=textures, **parts)
    first, second = result.diffuse_map, result.emission_map
    assert first is not None
    assert second is not None
    assert (first.wrap_s, first.wrap_t) == ("clamp", "mirror")
    assert (second.wrap_s, second.wrap_t) == ("repeat", "repeat")
    assert first.image is second.image
    assert "sampler-nearest" in report.codes()


def test_the_uv_set_and_its_override(tmp_path: Path) -> None:
    override = {"KHR_texture_transform": {"texCoord": 3}}
    base = {"index": 0, "texCoord": 1, "extensions": override}
    source = {"pbrMetallicRoughness": {"baseColorTexture": base}}
    result, _ = material(tmp_path, source | {"emissiveTexture": {"index": 0, "texCoord": 1}})
    assert result.diffuse_map is not None
    assert result.emission_map is not None
    assert (result.diffuse_map.uv_set, result.emission_map.uv_set) == ("st3", "st1")
    assert result.diffuse_map.transform is None  # nothing but the set is changed


def test_a_mesh_without_the_uv_set_of_its_texture_is_a_finding(tmp_path: Path) -> None:
    doc = only_triangle(tmp_path)
    doc.primitive["material"] = 0
    doc.json |= {"materials": [BASE], "textures": [{"source": 0}], "images": [{"uri": "gone.png"}]}
    scene, report = load_doc(tmp_path, doc)
    assert report.codes() == {"mesh-uv-set", "file-missing"}
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert (texture.image.name, texture.image.missing) == ("gone.png", True)


@pytest.mark.parametrize(("content", "suffix"), [(PNG, "png"), (JPEG, "jpg"), (WEBP, "webp")])
@pytest.mark.parametrize("embedded", ["uri", "view"])
def test_embedded_images_are_told_by_their_first_bytes(
    tmp_path: Path, content: bytes, suffix: str, embedded: str
) -> None:
    doc = Doc(materials=[BASE], textures=[{"source": 0}])
    view = doc.view(content)
    uri = "data:image/any;base64," + base64.b64encode(content).decode()
    doc.json["images"] = [{"uri": uri} if embedded == "uri" else {"bufferView": view}]
    texture = load_doc(tmp_path, doc)[0].materials[0].diffuse_map
    assert texture is not None
    assert (texture.image.data, texture.image.name) == (content, f"image_0.{suffix}")
    assert texture.image.path is None


@pytest.mark.parametrize(
    ("names", "wanted"),
    [
        (["asphalt_road", "wet asphalt"], ["asphalt_road.png", "wet asphalt.png"]),
        (["road.png", "road.TGA"], ["road.png", "road_1.png"]),
        (["road", "road"], ["road.png", "road_1.png"]),
        (["road_1", "road"], ["road_1.png", "road.png"]),
        (["image_1", ""], ["image_1.png", "image_1_1.png"]),
        (["v1.2", "..."], ["v1.2.png", "image_1.png"]),
        (["../../etc/passwd", "C:\\a\nb\0c"], ["_.._etc_passwd.png", "C__a_b_c.png"]),
        (["x" * 5000, "\ud800"], ["x" * 64 + ".png", "?.png"]),
        ([7, None], ["image_0.png", "image_1.png"]),
    ],
)
def test_an_embedded_image_keeps_its_name(
    tmp_path: Path, names: list[Any], wanted: list[str]
) -> None:
    source = BASE | {"emissiveTexture": {"index": 1}}
    doc = Doc(materials=[source], textures=[{"source": 0}, {"source": 1}])
    doc.json["images"] = [{"bufferView": doc.view(PNG), "name": name} for name in names]
    made = load_doc(tmp_path, doc)[0].materials[0]
    assert made.diffuse_map is not None
    assert made.emission_map is not None
    assert [made.diffuse_map.image.name, made.emission_map.image.name] == wanted


def test_an_embedded_image_is_told_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "wall.png").write_bytes(PNG)
    for embedded, name in ((1, "wall_1.png"), (0, "wall.png")):
        source = BASE | {"emissiveTexture": {"index": 1}}
        doc = Doc(materials=[source], textures=[{"source": 0}, {"source": 1}])
        images: list[Any] = [{"uri": "wall.png"}]
        images.insert(embedded, {"bufferView": doc.view(PNG), "name": "wall"})
        doc.json["images"] = images
        made = load_doc(tmp_path, doc)[0].materials[0]
        found = (made.diffuse_map, made.emission_map)[embedded]
        assert found is not None
        assert found.image.name == name


@pytest.mark.parametrize(
    ("images", "textures", "code"),
    [
        ([{"uri": "data:;base64,AAAA"}], [{"source": 0}], "image-data"),
        ([{"uri": "data:;base64,A*"}], [{"source": 0}], "image-data"),
        ([{"bufferView": 5}], [{"source": 0}], "image-data"),
        ([{"uri": "../../../etc/passwd"}], [{"source": 0}], "file-"),
        ([{"uri": "file:///etc/passwd"}], [{"source": 0}], "file-missing"),
        ([{"uri": "wall.ktx2"}], [{"source": 0}], "texture-ktx2"),
        (
            [{"uri": "wall.ktx2"}],
            [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
            "texture-ktx2",
        ),
    ],
)
def test_images_that_cannot_be_used_are_missing_with_a_finding(
    tmp_path: Path, images: list[Any], textures: list[Any], code: str
) -> None:
    (tmp_path / "wall.ktx2").write_bytes(b"\xabKTX 20\xbb")
    result, report = material(tmp_path, BASE, images=images, textures=textures)
    assert result.diffuse_map is not None
    assert result.diffuse_map.image.missing
    assert any(found.startswith(code) for found in report.codes())


def test_a_texture_without_an_image_is_a_finding(tmp_path: Path) -> None:
    for textures in ([], [{}], [{"source": 8}]):
        result, report = material(tmp_path, BASE, textures=textures)
        assert result.diffuse_map is None
        assert "texture-missing" in report.codes()


def test_webp_is_preferred_and_ktx2_has_a_fallback(tmp_path: Path) -> None:
    images = [{"uri": "wall.png"}, {"uri": "wall%20b.webp"}]
    (tmp_path / "wall b.webp").write_bytes(WEBP)
    for name, wanted in (("EXT_texture_webp", "wall b.webp"), ("KHR_texture_basisu", "wall.png")):
        textures = [{"source": 0, "extensions": {name: {"source": 1}}}]
        result, _ = material(tmp_path, BASE, images=images, textures=textures)
        assert result.diffuse_map is not None
        assert result.diffuse_map.image.path == (tmp_path / wanted).resolve()


def test_overlapping_image_views_cannot_multiply_the_file(tmp_path: Path) -> None:
    emissive = {"emissiveTexture": {"index": 1}}
    doc = Doc(materials=[BASE | emissive], textures=[{"source": 0}, {"source": 1}])
    doc.json["images"] = [{"bufferView": doc.view(PNG)}, {"bufferView": 1}]
    doc.json["bufferViews"].append(dict(doc.json["bufferViews"][0]))
    scene, report = load_doc(tmp_path, doc)
    first, second = scene.materials[0].diffuse_map, scene.materials[0].emission_map
    assert first is not None
    assert second is not None
    assert first.image.data == PNG
    assert second.image.missing
    assert "image views overlap" in next(f.text for f in report if f.code == "image-data")


# KHR_texture_transform


def converted(source: dict[str, Any]) -> UVTransform | None:
    data = {"texture": source}
    document = Document(Path("scene.gltf"), Report(), Limits(), data)
    return uv_transform(document.root.child("texture"))


#: The Khronos TextureTransformTest asset, and UsdTransform2d in the USD of the same asset
#: published by the USD working group (usd-wg/assets, test_assets/TextureTransformTest).
KHRONOS = [
    ({"offset": [0.5, 0]}, (1.0, 1.0), 0.0, (0.5, 0.0)),
    ({"offset": [0, 0.5]}, (1.0, 1.0), 0.0, (0.0, -0.5)),
    (
        {"rotation": 0.39269908169872415480783042290994},
        (1.0, 1.0),
        22.5,
        (0.3826834261417389, 0.07612049579620361),
    ),
    ({"scale": [1.5, 1.5]}, (1.5, 1.5), 0.0, (0.0, -0.5)),
    (
        {"offset": [-0.2, -0.1], "rotation": 0.3, "scale": [1.5, 1.5]},
        (1.5, 1.5),
        17.18873405456543,
        (0.2432803362607956, -0.3330046236515045),
    ),
]


@pytest.mark.parametrize(("source", "scale", "rotation", "translation"), KHRONOS)
def test_texture_transforms_agree_with_the_khronos_asset_in_usd(
    source: dict[str, Any],
    scale: tuple[float, float],
    rotation: float,
    translation: tuple[float, float],
) -> None:
    result = converted(source)
    assert result is not None
    assert result.scale == scale
    # the published values are float32, made by a few float32 operations on numbers near 1
    assert result.rotation == pytest.approx(rotation, rel=2**-22)
    assert result.translation == pytest.approx(translation, abs=2**-22)


numbers = st.floats(-4.0, 4.0)


@given(numbers, numbers, numbers, numbers, numbers, numbers, numbers)
def test_a_transformed_coordinate_hits_the_same_texel(
    ox: float, oy: float, angle: float, sx: float, sy: float, u: float, v: float
) -> None:
    """Turn, scale and shift with v down, then compare in the image, t up."""
    result = converted({"offset": [ox, oy], "rotation": angle, "scale": [sx, sy]})
    result = UVTransform() if result is None else result
    c, s = math.cos(angle), math.sin(angle)
    # Counter-clockwise as drawn with v down: (1, 0) goes up, to v = -sin.
    want_u = c * sx * u + s * sy * v + ox
    want_v = -s * sx * u + c * sy * v + oy
    x, y = result.scale[0] * u, result.scale[1] * (1.0 - v)
    turn = math.radians(result.rotation)
    got_s = math.cos(turn) * x - math.sin(turn) * y + result.translation[0]
    got_t = math.sin(turn) * x + math.cos(turn) * y + result.translation[1]
    # sums of terms up to 20 in size, some ten roundings each
    assert got_s == pytest.approx(want_u, abs=10 * 20 * 2**-52)
    assert 1.0 - got_t == pytest.approx(want_v, abs=10 * 20 * 2**-52)


def test_a_transform_that_changes_nothing_is_none() -> None:
    assert converted({}) is None
    assert converted({"offset": [0, 0], "rotation": 0, "scale": [1, 1]}) is None


@pytest.mark.skipif(DATA is None, reason="HDRUSD_TESTDATA names no test data")
def test_the_materials_of_real_files() -> None:
    root = Path(str(DATA)) / "data"
    scene, _ = load(root / "synthetic/night_corner.glb", roots=[root])
    head = next(m for m in scene.materials if m.name == "sodium_head")
    assert head.emission == pytest.approx((20000.0, 15600.0, 10000.0), rel=1e-15)
    wrapping, _ = load(root / "gltf-blender-io/13_texture_wrapping/13_texture_wrapping.gltf")
    maps = [m.diffuse_map for m in wrapping.materials]
    assert {(m.wrap_s, m.wrap_t) for m in maps if m} == {("mirror", "mirror"), ("repeat", "clamp")}
