"""FBX of real programs: counts of the data set's manifest, twins, and what is known of them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from fbx_builder import EPS, load, needs_ufbx

from hdrusd.legacy.scene import TRS, LegacyScene, Node

DATA = os.environ.get("HDRUSD_TESTDATA")
pytestmark = [
    needs_ufbx,
    pytest.mark.skipif(DATA is None, reason="HDRUSD_TESTDATA names no test data"),
]


def data(name: str) -> Path:
    return Path(DATA or "") / "data" / name


def manifest() -> dict[str, list[int]]:
    """Meshes, triangles, materials, textures, lights of each .fbx."""
    rows = {}
    text = data("MANIFEST.md").read_text(encoding="utf-8") if DATA else ""
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) > 9 and cells[2] == "fbx":
            rows[cells[1]] = [int(cell.split()[0]) for cell in cells[4:9]]
    return rows


def pictures(scene: LegacyScene) -> set[str]:
    """All that materials name: with a slot, or as extras where there is none yet."""
    found = set()
    for material in scene.materials:
        found |= {texture.image.name for texture in material.maps().values()}
        words = (word for word in material.extras.values() if isinstance(word, str))
        found |= {word for word in words if word.lower().endswith(".png")}
    return found


def walk(nodes: list[Node]) -> list[Node]:
    return [found for node in nodes for found in (node, *walk(node.children))]


def test_the_manifest_has_them_all() -> None:
    assert len(manifest()) == 17


@pytest.mark.parametrize("name", sorted(manifest()))
def test_counts(name: str) -> None:
    scene, _ = load(data(name))
    counts = scene.counts()
    nodes = walk(scene.roots)
    got = [
        sum(len(node.meshes) for node in nodes),
        counts["triangles"],
        counts["materials"],
        len(pictures(scene)),
        sum(len(node.lights) for node in nodes),
    ]
    assert got == manifest()[name]


UNITS = {
    "assimp/FBX/global_settings.fbx": (5.0, "Y"),
    "assimp/FBX/cubes_with_mirroring_and_pivot.fbx": (1.0, "Y"),
    "ufbx/max2009_cube_anim_6100_binary.fbx": (0.0254, "Z"),
    "ufbx/max_texture_mapping_7700_binary.fbx": (0.0254, "Z"),
    "ufbx/max7_skin_5000_binary.fbx": (0.01, "Y"),
}


@pytest.mark.parametrize("name", UNITS)
def test_units_and_axes(name: str) -> None:
    scene, _ = load(data(name))
    assert (pytest.approx(scene.unit_m, rel=1e-12), scene.up) == UNITS[name]


def test_twin_of_a_gltf() -> None:
    """The walls of Kenney's track corner stand on the edge of the road of its GLB, in metres."""
    wall, _ = load(data("kenney-racing/models/collision-track-corner.fbx"))
    road, _ = load(data("kenney-racing/models/track-corner.glb"))
    points = wall.meshes[0].points.astype(np.float64) * wall.unit_m
    ends = points[np.abs(points[:, [0, 2]]).max(axis=1) > 4.999]
    ends = ends[ends[:, 1] < 0.1]
    assert len(ends) >= 4
    away = np.linalg.norm(ends[:, None] - road.meshes[0].points[None], axis=2).min(axis=1)
    # 500 in float32, and the GLB's own rounding at 5
    assert away.max() < 500 * EPS * 0.01 + 5 * EPS + 1e-5


def test_materials_of_the_chart_are_one_colour() -> None:
    """Maya's chart, by the names of its twelve squares: (0.125, 0.25, 0.5) by every route."""
    scene, _ = load(data("ufbx/maya_material_chart_7700_binary.fbx"))
    by_name = {material.name: material for material in scene.materials}
    blue = pytest.approx((0.125, 0.25, 0.5), abs=EPS)
    for name in ("FBX_DIffuseColor", "FBX_DiffuseFactor", "Standard_BaseColor"):
        assert by_name[f"{name}Material"].diffuse == blue
    assert by_name["Standard_BaseFactorMaterial"].diffuse == blue
    for name in ("FBX_EmissiveColor", "Standard_EmissiveColor"):
        assert by_name[f"{name}Material"].emission == blue
        assert by_name[f"{name}Material"].diffuse == (0.0, 0.0, 0.0)
    for name, factor in (("FBX_DiffuseTexture", 1.0), ("Standard_BaseTexture", 1.0)):
        assert by_name[f"{name}Material"].diffuse == (factor,) * 3
        assert by_name[f"{name}FactorMaterial"].diffuse == (0.5,) * 3
    for name in ("FBX_EmissiveTexture", "Standard_EmissiveTexture"):
        assert by_name[f"{name}Material"].emission == (1.0, 1.0, 1.0)
        assert by_name[f"{name}Material"].emission_map is not None
    # specular weight 0 of Maya's Standard Surface: no highlight
    standard = by_name["Standard_BaseColorMaterial"]
    assert standard.specular == (0.0, 0.0, 0.0)
    assert standard.pbr == pytest.approx({"glossiness": 0.6}, abs=EPS)
    (camera,) = scene.cameras
    assert camera.kind == "orthographic"
    assert camera.height == pytest.approx(33.75, rel=1e-12)


def test_phong_of_maya() -> None:
    """Colours times factors, as the old words beside them in the file say; half of it is seen."""
    (made,) = load(data("assimp/FBX/phong_cube.fbx"))[0].materials
    assert made.ambient == (0.125, 0.25, 0.25)
    assert made.diffuse == (0.5, 0.25, 0.25)
    assert made.specular == (0.125, 0.125, 0.25)
    assert made.emission == (0.25, 0.125, 0.25)
    assert (made.shininess, made.alpha) == (10.0, 0.5)


def test_three_sets_of_coordinates() -> None:
    (mesh,) = load(data("ufbx/blender_279_uv_sets_7400_binary.fbx"))[0].meshes
    assert set(mesh.uvs) == {"st", "st1", "st2"}


def test_two_materials_on_one_mesh() -> None:
    scene, _ = load(data("ufbx/maya_shared_textures_7500_binary.fbx"))
    a, b = scene.meshes
    assert [scene.materials[s.material].name for s in a.subsets] == ["Special", "Shared"]
    assert sorted(f for s in a.subsets for f in s.faces.tolist()) == list(range(6))
    assert b.material == a.subsets[1].material


def test_light_and_camera_look_forward() -> None:
    """Both are named forward: along -Z of Maya's world."""
    scene, _ = load(data("ufbx/maya_camera_light_axes_y_up_7700_ascii.fbx"))
    camera, light = scene.roots

    def turned(node: Node, v: np.ndarray) -> np.ndarray:
        assert isinstance(node.transform, TRS)
        u, w = np.array(node.transform.rotation[:3]), node.transform.rotation[3]
        return v + 2.0 * w * np.cross(u, v) + 2.0 * np.cross(u, np.cross(u, v))

    (view,) = camera.children
    down = np.array(scene.lights[0].direction)
    ahead = turned(camera, turned(view, np.array([0.0, 0.0, -1.0])))
    np.testing.assert_allclose(ahead, [0, 0, -1], atol=1e-7)
    np.testing.assert_allclose(turned(light, down), [0, 0, -1], atol=1e-7)


def test_embedded_pictures_need_no_files() -> None:
    scene, report = load(data("ufbx/blender_293_embedded_textures_7400_binary.fbx"))
    (made,) = scene.materials
    assert made.diffuse_map is not None
    assert made.diffuse_map.image.data is not None
    assert made.diffuse_map.image.data.startswith(b"\x89PNG")
    assert "file-missing" not in report.codes()


def test_skin_of_3ds_max_7() -> None:
    """Every point is held, and the bones stand where the skin was bound, 30 units apart."""
    scene, _ = load(data("ufbx/max7_skin_5000_binary.fbx"))
    (skin,) = scene.skins
    assert [joint.name for joint in skin.joints] == ["Bone01", "Bone02", "Bone03", "Bone04"]
    (mesh,) = scene.meshes
    assert mesh.joint_weights is not None
    np.testing.assert_allclose(mesh.joint_weights.sum(axis=1), 1.0, atol=4 * EPS)
    places = [np.linalg.inv(inverse)[3, 0] for inverse in skin.inverse_binds]
    steps = np.diff([np.linalg.inv(inverse)[3, :3] for inverse in skin.inverse_binds], axis=0)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), [30.0, 30.0, 20.0], rtol=1e-5)
    assert len(places) == 4
    assert all(node.visible for node in walk(scene.roots))  # Visibility 100 of version 5.0


def test_animation_of_3ds_max_2009() -> None:
    scene, _ = load(data("ufbx/max2009_cube_anim_6100_binary.fbx"))
    (node,) = scene.roots
    assert [channel.path for channel in node.animation] == ["translation", "rotation", "scale"]
    for channel in node.animation:
        assert (channel.times[0], channel.times[-1]) == (0.0, 2.0)


def test_old_blender_and_new_blender_lights() -> None:
    """2.79 writes energy 1 as 100 %, with the distance of half the light; 2.83 writes watts."""
    old, _ = load(data("assimp/FBX/global_settings.fbx"))
    assert [light.diffuse for light in old.lights] == [(1.0, 1.0, 1.0)] * 2
    new, report = load(data("magnum-plugins/light-area.fbx"))
    assert new.lights[0].diffuse == (1000.0, 1000.0, 1000.0)
    assert new.lights[0].candela is None
    assert {"fbx-light-watts", "fbx-light-area"} <= report.codes()
