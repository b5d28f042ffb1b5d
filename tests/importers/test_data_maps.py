"""Maps of data by format: which channel, with what scale and bias, and what is no such map."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from collada_builder import document, material
from collada_builder import load as load_collada
from fbx_builder import Fbx, P, needs_ufbx, properties
from fbx_builder import load as load_fbx
from gltf_builder import load_json
from obj_builder import load_material
from test_assimp import X, needs_assimp
from test_assimp import load as load_assimp
from test_fbx_materials import PNG, add_material, add_texture

from hdrusd.legacy.scene import Material, Texture
from hdrusd.report import Kind, Report

NORMAL = (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0)


def read_as(texture: Texture | None) -> tuple[str, float, float]:
    """Channel, scale and bias of a map of one number."""
    assert texture is not None
    (scale,), (bias,) = set(texture.scale), set(texture.bias)
    return texture.channel, scale, bias


def of_normals(texture: Texture | None) -> tuple[Any, Any]:
    """Scale and bias of a normal map."""
    assert texture is not None
    return texture.scale, texture.bias


# -- glTF ---------------------------------------------------------------------------------


def gltf(folder: Path, source: dict[str, Any]) -> tuple[Material, Report]:
    """A material with two pictures."""
    parts = {"images": [{"uri": "a.png"}, {"uri": "b.png"}]}
    for name in ("a.png", "b.png"):
        (folder / name).write_bytes(PNG)
    textures = [{"source": 0}, {"source": 1}]
    scene, report = load_json(folder, materials=[source], textures=textures, **parts)
    return scene.materials[0], report


def test_gltf_has_a_map_for_each_number(tmp_path: Path) -> None:
    packed = {"index": 0, "texCoord": 1}
    made, report = gltf(
        tmp_path,
        {
            "pbrMetallicRoughness": {
                "metallicFactor": 0.25,
                "roughnessFactor": 0.5,
                "metallicRoughnessTexture": packed,
            },
            "occlusionTexture": packed | {"strength": 0.25},
            "normalTexture": {"index": 1, "scale": 0.5},
        },
    )
    assert read_as(made.metallic_map) == ("b", 0.25, 0.0)
    assert read_as(made.roughness_map) == ("g", 0.5, 0.0)
    assert read_as(made.occlusion_map) == ("r", 0.25, 0.75)
    assert of_normals(made.normal_map) == ((1.0, 1.0, 2.0, 1.0), (-0.5, -0.5, -1.0, 0.0))
    assert made.roughness_map is not None
    assert made.roughness_map.uv_set == "st1"
    assert made.pbr == {"metallic": 0.25, "roughness": 0.5}
    assert report.codes() == {"scene-empty"}


def test_gltf_metal_of_factor_0_needs_no_map(tmp_path: Path) -> None:
    pbr = {"metallicFactor": 0.0, "metallicRoughnessTexture": {"index": 0}}
    made, _ = gltf(tmp_path, {"pbrMetallicRoughness": pbr})
    assert made.metallic_map is None
    assert made.roughness_map is not None


@pytest.mark.parametrize(
    ("coat_normal", "same"), [({"index": 1}, True), ({"index": 0}, False), (None, False)]
)
def test_gltf_clear_coat(tmp_path: Path, coat_normal: Any, same: bool) -> None:
    coat = {
        "clearcoatFactor": 0.5,
        "clearcoatTexture": {"index": 0},
        "clearcoatRoughnessFactor": 0.25,
        "clearcoatRoughnessTexture": {"index": 0},
    } | ({"clearcoatNormalTexture": coat_normal} if coat_normal else {})
    source = {"normalTexture": {"index": 1}, "extensions": {"KHR_materials_clearcoat": coat}}
    made, report = gltf(tmp_path, source)
    assert read_as(made.clearcoat_map) == ("r", 0.5, 0.0)
    assert read_as(made.clearcoat_roughness_map) == ("g", 0.25, 0.0)
    assert made.pbr is not None
    assert (made.pbr["clearcoat"], made.pbr["clearcoat_roughness"]) == (0.5, 0.25)
    assert ("clearcoat-normal" in report.codes()) == (not same)
    none, report = gltf(tmp_path, {"extensions": {"KHR_materials_clearcoat": {}}})
    assert none.pbr == {"metallic": 1.0, "roughness": 1.0}
    assert report.codes() == {"scene-empty"}


def specular(folder: Path, metallic: float, ior: float | None, **more: Any) -> Any:
    """pbr, specular colour and findings of the two extensions."""
    extensions: dict[str, Any] = {"KHR_materials_specular": more} if more else {}
    extensions |= {"KHR_materials_ior": {"ior": ior}} if ior is not None else {}
    pbr = {"metallicFactor": metallic, "roughnessFactor": 0.75}
    source = {"pbrMetallicRoughness": pbr, "extensions": extensions}
    made, report = gltf(folder, source)
    return made.pbr, made.specular, [f.kind for f in report if f.code == "gltf-specular"]


def test_gltf_reflectance_at_normal_incidence(tmp_path: Path) -> None:
    """F0 = min(((n - 1) / (n + 1))^2 colour, 1) factor; as n where it is grey."""
    plain = {"metallic": 0.5, "roughness": 0.75}
    assert specular(tmp_path, 0.5, None) == (plain, (0.0, 0.0, 0.0), [])
    assert specular(tmp_path, 0.5, 1.5)[0]["ior"] == pytest.approx(1.5)
    assert specular(tmp_path, 0.5, 1.33)[0]["ior"] == pytest.approx(1.33)
    assert specular(tmp_path, 0.5, None, specularFactor=0.0)[0]["ior"] == 1.0
    # F0 = 4 x 0.04 = 0.16: n = 1.4 / 0.6.
    grey = specular(tmp_path, 0.5, None, specularColorFactor=[4, 4, 4])
    assert grey[0]["ior"] == pytest.approx(1.4 / 0.6)
    # Of n = 3, F0 = 0.25; the red is cut at 1.
    pbr, colour, kinds = specular(tmp_path, 0.0, 3.0, specularColorFactor=[8, 1, 0])
    assert pbr == {"roughness": 0.75, "glossiness": 0.25}
    assert (colour, kinds) == ((1.0, 0.25, 0.0), [])
    pbr, _, kinds = specular(tmp_path, 0.5, 3.0, specularColorFactor=[1, 0, 0])
    # Luminance 0.2126 x 0.25.
    root = (0.2126 * 0.25) ** 0.5
    assert pbr["ior"] == pytest.approx((1 + root) / (1 - root), rel=1e-3)
    assert kinds == [Kind.REPLACED]
    _, _, kinds = specular(tmp_path, 0.5, None, specularTexture={"index": 0}, specularFactor=0.5)
    assert kinds == [Kind.DROPPED, Kind.REPLACED]


# -- Wavefront MTL ------------------------------------------------------------------------


def test_maps_of_data(tmp_path: Path) -> None:
    for name in ("r.png", "m.png", "n.png", "c.png"):
        (tmp_path / name).write_bytes(b"")
    loaded = load_material(
        tmp_path,
        "Pr 0.5\nmap_Pr r.png\nmap_Pm -imfchan b m.png\nmap_Pcr c.png\nnorm -s 2 2 2 n.png",
    )
    maps = loaded.material.maps()
    assert {name: used.image.name for name, used in maps.items()} == {
        "roughness_map": "r.png",
        "metallic_map": "m.png",
        "clearcoat_roughness_map": "c.png",
        "normal_map": "n.png",
    }
    assert [maps[f"{name}_map"].channel for name in ("roughness", "metallic")] == ["r", "b"]
    normal = maps["normal_map"]
    assert (normal.scale, normal.bias) == ((2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0))
    assert normal.transform is not None
    assert normal.transform.scale == (2.0, 2.0)
    assert maps["roughness_map"].scale == (1.0, 1.0, 1.0, 1.0)
    assert "Pr 0.5" in loaded.finding("mtl-map-factor").text
    assert loaded.finding("normal-green").kind is Kind.ASSUMED
    assert not loaded.findings("mtl-dropped")


def test_numbers_of_mtl_are_shares(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, "Pr 1e300\nPm -1\nPc 2")
    assert loaded.material.pbr == {"roughness": 1.0, "metallic": 0.0, "clearcoat": 1.0}
    assert len(loaded.findings("mtl-number")) == 3


def test_a_height_is_no_normal_and_packed_maps_have_no_firm_order(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, "bump b.png\nmap_RMA p.png\nmap_ORM p.png")
    assert loaded.material.maps() == {}
    assert loaded.finding("mtl-dropped").text.startswith("bump, map_RMA, map_ORM")


def test_of_two_normal_maps_one_counts_and_the_other_is_said(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, "map_norm b.png\nnorm a.png")
    assert loaded.material.normal_map is not None
    assert loaded.material.normal_map.image.name == "a.png"
    assert loaded.finding("mtl-repeated").text == "map_norm beside norm, which counts"
    alike = load_material(tmp_path, "map_norm a.png\nnorm a.png")
    assert not alike.findings("mtl-repeated")


# -- COLLADA ------------------------------------------------------------------------------

IMAGE = '<library_images><image id="i"><init_from>a.png</init_from></image></library_images>'


@pytest.mark.parametrize(
    ("kind", "profile", "read"),
    [
        ('bumptype="NORMALMAP"', "FCOLLADA", True),
        ('bumptype="normalmap"', "OpenCOLLADAMaya", True),
        ('bumptype="HEIGHTFIELD"', "OpenCOLLADA3dsMax", False),
        ("", "FCOLLADA", False),
    ],
)
def test_collada_bump_that_says_it_is_a_normal_map(
    tmp_path: Path, kind: str, profile: str, read: bool
) -> None:
    (tmp_path / "a.png").write_bytes(PNG)
    use = '<texture texture="i" texcoord="U"/>'
    extra = f'<extra><technique profile="{profile}"><bump {kind}>{use}</bump></technique></extra>'
    shader = f"<phong><diffuse><color>1 1 1 1</color></diffuse></phong>{extra}"
    scene, report = load_collada(tmp_path, document(IMAGE + material(shader)))
    (made,) = scene.materials
    assert (made.normal_map is not None) == read
    assert ("normal-green" in report.codes()) == read
    assert ("material-part" in report.codes()) == (not read)
    if read:
        assert of_normals(made.normal_map) == NORMAL


# -- FBX ----------------------------------------------------------------------------------


@needs_ufbx
@pytest.mark.parametrize("program", ["", "Blender (stable FBX IO)"])
def test_fbx_normal_map(tmp_path: Path, program: str) -> None:
    """Blender's strength s mixes: (1 - s) z + s (2 t - 1), and its green points up."""
    (tmp_path / "n.png").write_bytes(PNG)
    fbx = Fbx()
    number = add_material(fbx, "phong", P("BumpFactor", 0.25, kind="double"))
    add_texture(fbx, number, "NormalMap", "n.png")
    path = fbx.write(tmp_path)
    if program:
        word = P("Original|ApplicationName", program, kind="KString")
        info = f'SceneInfo: "SceneInfo::GlobalInfo", "UserData" {{\n{properties(word)}\n}}'
        text = path.read_text()
        head = 'Creator: "made by hand"\n'
        path.write_text(text.replace(head, head + info + "\n"))
    scene, report = load_fbx(path)
    mixed = (0.5, 0.5, 0.5, 1.0), (-0.25, -0.25, 0.5, 0.0)
    assert of_normals(scene.materials[0].normal_map) == (mixed if program else NORMAL)
    assert ("normal-green" in report.codes()) == (not program)
    assert "material-part" not in report.codes()


@needs_ufbx
def test_fbx_numbers_of_real_files_have_their_pictures(testdata: Path) -> None:
    """By the names of the pictures, which say what each is."""
    folder = testdata / "data" / "ufbx"
    files = (
        "blender_293_embedded_textures_7400_binary.fbx",
        "max_physical_material_textures_7500_binary.fbx",
        "max_texture_mapping_7700_binary.fbx",
    )
    for name in files:
        scene, report = load_fbx(folder / name)
        (made,) = scene.materials
        for part in ("roughness", "metallic"):
            texture = made.maps()[f"{part}_map"]
            assert texture.image.name.endswith(f"checkerboard_{part}.png")
            assert read_as(texture) == ("r", 1.0, 0.0)
        assert made.normal_map is None  # its bump_map may be a height
        assert "fbx-roughness" not in report.codes()
        # Of 3ds Max's material the pictures of its specular and of its coat are one.
        coat = made.maps().get("clearcoat_map")
        assert (coat is not None) == name.startswith("max_physical")


# -- assimp -------------------------------------------------------------------------------


@needs_assimp
def test_assimp_normal_map(tmp_path: Path) -> None:
    """DirectX's exporters have NormalmapFilename beside TextureFilename."""
    (tmp_path / "n.png").write_bytes(PNG)
    pictures = 'NormalmapFilename { "n.png"; } }'
    text = X.replace("0.4;0.5;0.6;; }", f"0.4;0.5;0.6;; {pictures}")
    assert text != X
    scene, report = load_assimp(tmp_path, "a.x", text)
    (made,) = scene.materials
    assert of_normals(made.normal_map) == NORMAL
    assert {"normal-green"} <= report.codes()
    assert "assimp-texture" not in report.codes()
