"""OpenSceneGraph: what further texture units hold, and what becomes of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from osg_builder import Loaded, load, old_geode, old_geometry

from hdrusd.importers.importer import Resolver, read
from hdrusd.importers.osg_texture_maps import further_map, named_map
from hdrusd.legacy.scene import normal_texels
from hdrusd.report import Kind, Report

CORNERS = "TexCoordArray 0 Vec2Array 4 {\n0 0\n1 0\n1 1\n0 1\n}"


def units(
    folder: Path, *more: tuple[int, str, str], material: str = "", coordinates: str = CORNERS
) -> Loaded:
    """A square that wears ``wall.png`` and further pictures: unit, name, mode or none."""
    parts = [material]
    for number, name, mode in ((0, "wall.png", ""), *more):
        (folder / name).touch()
        environment = f"TexEnv {{\nmode {mode}\n}}" if mode else ""
        parts.append(
            f"textureUnit {number} {{\nGL_TEXTURE_2D ON\nTexture2D {{\nfile {name}\n"
            f"wrap_s REPEAT\nwrap_t REPEAT\n}}\n{environment}\n}}"
        )
    state = "StateSet {\n" + "\n".join(parts) + "\n}"
    return load(folder, old_geode(old_geometry(more=coordinates), fields=state))


@pytest.mark.parametrize(
    ("name", "what"),
    [
        (r"images\Lamppost_Trident_ILLUM.png", "an emission map"),
        ("lampSelfIllum.png", "an emission map"),
        ("self_illum2.tga", "an emission map"),
        ("../maps/lamp-emissive.rgb", "an emission map"),
        ("GlowSign_DIFF.png", "a colour map"),
        ("LAMP_LightMap.png", "a light map"),
        ("street_light_map.png", "a light map"),
        ("wall_lightmap_01.png", "a light map"),
        ("Lamppost_Trident_NORM.png", "a normal map"),
        ("Lamppost_Trident_SPEC.png", "a specular map"),
        ("wall_bump.png", "a height map"),
        ("night_street.png", None),
        ("light.png", None),
        ("", None),
    ],
)
def test_names_of_maps(name: str, what: str | None) -> None:
    assert named_map(name) == what


@pytest.mark.parametrize(
    ("name", "mode", "role"),
    [
        ("lamp_glow.png", None, "emission"),
        ("lamp_glow.png", "ADD", "emission"),
        ("lamp_illum.png", "MODULATE", None),  # light that was baked: multiplied, it adds none
        ("lamp_illum.png", "DECAL", None),
        ("x.png", "ADD", "emission"),
        ("wall_lightmap.png", "ADD", None),
        ("wall_detail.png", "ADD", None),
        ("x.png", "MODULATE", None),
        ("x.png", None, None),
        ("wall_norm.png", "MODULATE", "normal"),
    ],
)
def test_what_a_unit_is_taken_as(name: str, mode: str | None, role: str | None) -> None:
    assert further_map(name, mode, again=False)[0] == role
    assert further_map(name, mode, again=True)[0] is None


def test_a_map_that_glows(tmp_path: Path) -> None:
    made = units(tmp_path, (4, "lamp_ILLUM.png", ""))
    lamp = made.material
    assert lamp.emission_map is not None
    assert lamp.diffuse_map is not None
    assert lamp.emission_map.image.path == tmp_path / "lamp_ILLUM.png"
    assert lamp.emission_map.uv_set == "st"  # it has no coordinates of its own
    assert (lamp.emission, lamp.emission_cd_m2) == ((1, 1, 1), False)
    assert "emission" not in lamp.defaults
    assert lamp.diffuse_map.image.path == tmp_path / "wall.png"
    assert not lamp.extras
    found = made.finding("osg-emission-map")
    assert (found.kind, found.source.place) == (Kind.GUESSED, 15)
    assert found.text == (
        "texture unit 4, lamp_ILLUM.png: no mode, by its name an emission map; taken as that"
    )


def test_an_emission_colour_is_the_factor_of_the_map(tmp_path: Path) -> None:
    colour = "Material {\nemissionColor 0.5 0.25 0 1\n}"
    made = units(tmp_path, (1, "lamp_glow.png", "ADD"), material=colour)
    assert made.material.emission == (0.5, 0.25, 0)
    assert made.material.emission_map is not None


def test_a_map_with_coordinates_of_its_own(tmp_path: Path) -> None:
    both = CORNERS + "\n" + CORNERS.replace("TexCoordArray 0", "TexCoordArray 1")
    made = units(tmp_path, (1, "a.png", "ADD"), coordinates=both)
    assert made.material.emission_map is not None
    assert made.material.emission_map.uv_set == "st1"
    assert "added to what is lit" in made.finding("osg-emission-map").text


def test_a_normal_map(tmp_path: Path) -> None:
    made = units(tmp_path, (1, "wall_NORM.png", ""))
    normal = made.material.normal_map
    assert normal is not None
    assert (normal.scale, normal.bias) == normal_texels()
    assert normal.image.path == tmp_path / "wall_NORM.png"
    assert made.finding("osg-normal-map").kind is Kind.GUESSED
    assert made.finding("normal-green").kind is Kind.ASSUMED
    assert made.material.emission_map is None


def test_light_that_was_baked_is_no_reflectance(tmp_path: Path) -> None:
    made = units(tmp_path, (1, "bake_lightmap.png", "MODULATE"), (2, "x.png", "MODULATE"))
    assert list(made.material.maps()) == ["diffuse_map"]
    assert made.material.emission == (0, 0, 0)
    assert made.material.extras == {"texture_units": {"1": "bake_lightmap.png", "2": "x.png"}}
    texts = [f.text for f in made.report if f.code == "osg-texture-unit"]
    assert "mode MODULATE, by its name a light map; only unit 0 is kept" in texts[0]
    assert "mode MODULATE, multiplied with the first: a light map or a detail;" in texts[1]


def test_maps_that_cannot_be_placed_or_read_are_not_taken(tmp_path: Path) -> None:
    made = units(tmp_path, (1, "lamp_glow.png", ""), coordinates="")
    assert made.material.emission_map is None
    assert made.material.emission == (0, 0, 0)
    assert made.material.extras == {"texture_units": {"1": "lamp_glow.png"}}
    state = (
        "StateSet {\ntextureUnit 0 {\nGL_TEXTURE_2D ON\nTexture2D {\nfile wall.png\n}\n}\n"
        "textureUnit 1 {\nGL_TEXTURE_2D ON\nTexture2D {\nfile gone_glow.png\n}\n}\n}"
    )
    made = load(tmp_path, old_geode(old_geometry(more=CORNERS), fields=state))
    assert made.material.emission_map is None
    assert {"file-missing", "osg-texture-unit"} <= made.codes()


def test_only_one_map_glows(tmp_path: Path) -> None:
    made = units(tmp_path, (1, "a_glow.png", ""), (2, "b_glow.png", ""))
    assert made.material.emission_map is not None
    assert made.material.emission_map.image.name == "a_glow.png"
    assert made.material.extras == {"texture_units": {"2": "b_glow.png"}}


def test_the_picture_of_the_first_unit_again(tmp_path: Path) -> None:
    """As exporters write that name one picture for the ambient and the diffuse colour."""
    (tmp_path / "wall_glow.png").touch()
    picture = "Texture2D {\nUniqueID T\nfile wall_glow.png\n}"
    state = (
        f"StateSet {{\ntextureUnit 0 {{\nGL_TEXTURE_2D ON\n{picture}\n}}\n"
        "textureUnit 1 {\nGL_TEXTURE_2D ON\nUse T\n}\n}"
    )
    made = load(tmp_path, old_geode(old_geometry(more=CORNERS), fields=state))
    assert made.material.emission_map is None
    assert "the picture of the first unit again" in made.finding("osg-texture-unit").text


def test_the_lamp_of_the_collection(testdata: Path) -> None:
    """Delta3D's post has four pictures: colour, normals, gloss and what glows, by their names."""
    file = testdata / "data/delta3d/examples/data/StaticMeshes/lamps/Lamppost_Trident.osg"
    report = Report()
    made = Loaded(read(Resolver(file, report), report), report)
    names = {key: used.image.name.rpartition("_")[2] for key, used in made.material.maps().items()}
    assert names == {
        "diffuse_map": "DIFF.png",
        "emission_map": "ILLUM.png",
        "normal_map": "NORM.png",
    }
    assert list(made.material.extras["texture_units"]) == ["2"]
