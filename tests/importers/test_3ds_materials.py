"""Materials and maps of 3D Studio as OpenGL records."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tds_builder import (
    SQUARE,
    SQUARE_FACES,
    chunk,
    color,
    faces,
    file,
    floats,
    load_bytes,
    load_material,
    material,
    mesh,
    percent,
    points,
    square,
    texture,
    wears,
    words,
)

from hdrusd.legacy.scene import UVTransform
from hdrusd.report import Kind

DIFFUSE = color(0xA020, 1.0, 0.5, 0.25)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """A file that is there; a reader does not look into it."""
    path = tmp_path / "Brick.TGA"
    path.write_bytes(b"pixels")
    return path


def apply(transform: UVTransform, u: float, v: float) -> tuple[float, float]:
    """UsdTransform2d: scale, rotate counter-clockwise, translate."""
    u, v = u * transform.scale[0], v * transform.scale[1]
    cos, sin = (f(math.radians(transform.rotation)) for f in (math.cos, math.sin))
    x, y = transform.translation
    return cos * u - sin * v + x, sin * u + cos * v + y


def test_colours_and_percentages(tmp_path: Path) -> None:
    parts = [color(0xA010, 0.1, 0.2, 0.3), DIFFUSE, color(0xA030, 1.0, 0.5, 0.0)]
    parts += [percent(0xA040, 60), percent(0xA041, 50), percent(0xA050, 25)]
    found = load_material(tmp_path, *parts).material
    assert found.name == "m"
    assert found.ambient == pytest.approx((0.1, 0.2, 0.3))
    assert found.diffuse == (1.0, 0.5, 0.25)
    assert found.specular == (0.5, 0.25, 0.0)  # times its strength
    assert found.shininess == 64.0  # 2^(10 * 0.6)
    assert (found.alpha, found.alpha_mode) == (0.75, "blend")
    assert found.emission == (0.0, 0.0, 0.0)
    assert found.defaults == {"emission"}
    assert found.extras == {"shininess": 60.0, "strength": 50.0, "transparency": 25.0}


def test_bytes_go_before_the_linear_twin(tmp_path: Path) -> None:
    linear, shown = chunk(0x0012, bytes((55, 0, 0))), chunk(0x0011, bytes((255, 51, 0)))
    found = load_material(tmp_path, chunk(0xA020, linear, shown)).material
    assert found.diffuse == (1.0, 0.2, 0.0)
    alone = load_material(tmp_path, chunk(0xA020, linear)).material
    assert alone.diffuse == (55 / 255.0, 0.0, 0.0)


def test_what_is_left_out_is_a_default(tmp_path: Path) -> None:
    found = load_material(tmp_path).material
    assert found.diffuse == (0.8, 0.8, 0.8)
    assert found.defaults == {"ambient", "diffuse", "specular", "emission", "shininess", "alpha"}


def test_self_illumination_is_emission_in_the_diffuse_colour(tmp_path: Path) -> None:
    """100 % of it is never white."""
    assert load_material(tmp_path, DIFFUSE, percent(0xA084, 100)).material.emission == (
        1.0,
        0.5,
        0.25,
    )
    assert load_material(tmp_path, DIFFUSE, percent(0xA084, 50)).material.emission == (
        0.5,
        0.25,
        0.125,
    )
    flagged = load_material(tmp_path, DIFFUSE, chunk(0xA080)).material
    assert flagged.emission == (1.0, 0.5, 0.25)


def test_a_glowing_picture_is_its_own_emission_map(tmp_path: Path, picture: Path) -> None:
    brick = texture(0xA200, "BRICK.TGA")
    found = load_material(tmp_path, DIFFUSE, brick, percent(0xA084, 40)).material
    assert found.emission == (0.4, 0.4, 0.4)
    assert found.emission_map is not None
    assert found.emission_map.image.path == picture
    glow = texture(0xA33D, "brick.tga", amount=50)
    loaded = load_material(tmp_path, DIFFUSE, glow)
    assert loaded.material.emission == (0.5, 0.25, 0.125)
    assert loaded.finding("3ds-map-amount").kind is Kind.REPLACED
    both = load_material(tmp_path, DIFFUSE, brick, texture(0xA33D, "brick.tga"))
    assert both.finding("3ds-self-illumination").kind is Kind.REPLACED


def test_a_whole_texture_stands_in_place_of_the_colour(tmp_path: Path, picture: Path) -> None:
    loaded = load_material(tmp_path, DIFFUSE, texture(0xA200, "BRICK.TGA"))
    found = loaded.material.diffuse_map
    assert found is not None
    assert (found.mode, found.wrap_s, found.transform) == ("REPLACE", "repeat", None)
    assert found.image.path == picture
    assert found.image.name == "BRICK.TGA"
    assert loaded.finding("file-found-elsewhere").kind is Kind.ASSUMED
    part = load_material(tmp_path, DIFFUSE, texture(0xA200, "Brick.TGA", amount=30))
    assert part.finding("3ds-map-amount").text.startswith("30 % of Brick.TGA")
    none = load_material(tmp_path, DIFFUSE, texture(0xA200, "Brick.TGA", amount=0))
    assert none.material.diffuse_map is None
    assert none.finding("3ds-map-amount").kind is Kind.DROPPED


def test_without_the_picture_the_colour_shows(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, DIFFUSE, texture(0xA200, "GONE.TGA"), percent(0xA084, 100))
    found = loaded.material
    assert found.diffuse_map is not None
    assert found.diffuse_map.image.missing
    assert found.diffuse_map.mode == "MODULATE"
    assert found.emission == found.diffuse
    assert loaded.finding("file-missing").thing == "m"


def test_a_picture_outside_the_roots_is_refused(tmp_path: Path, picture: Path) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    loaded = load_material(folder, texture(0xA200, "..\\Brick.TGA"))
    assert loaded.finding("file-refused").kind is Kind.MISSING


def test_tiling_is_about_the_middle_of_the_picture(tmp_path: Path, picture: Path) -> None:
    parts = chunk(0xA354, floats(4)), chunk(0xA356, floats(2))
    parts += chunk(0xA358, floats(0.25)), chunk(0xA35A, floats(0.0))
    found = load_material(tmp_path, texture(0xA200, "Brick.TGA", *parts)).material.diffuse_map
    assert found is not None
    assert found.transform is not None
    assert apply(found.transform, 0.75, 0.5) == pytest.approx((0.5, 0.5))  # moved by a quarter
    assert apply(found.transform, 1.0, 1.0) == pytest.approx((1.5, 1.5))  # 0.25 * 4, 0.5 * 2


def test_a_turned_picture_turns_its_coordinates_back(tmp_path: Path, picture: Path) -> None:
    """Counter-clockwise by 90 degrees its right edge comes to the top."""
    loaded = load_material(tmp_path, texture(0xA200, "Brick.TGA", chunk(0xA35C, floats(90))))
    found = loaded.material.diffuse_map
    assert found is not None
    assert found.transform is not None
    assert apply(found.transform, 0.5, 1.0) == pytest.approx((1.0, 0.5))
    assert loaded.finding("3ds-map-angle").kind is Kind.ASSUMED


@pytest.mark.parametrize(
    ("flags", "wrap", "codes"),
    [
        (0x00, "repeat", set()),
        (0x02, "mirror", set()),
        (0x10, "clamp", {"3ds-map-decal"}),
        (0x08, "repeat", {"3ds-map-option"}),
        (0x80, "repeat", {"3ds-map-option"}),
        (0x20, "repeat", set()),
    ],
)
def test_map_flags(tmp_path: Path, picture: Path, flags: int, wrap: str, codes: set[str]) -> None:
    loaded = load_material(tmp_path, texture(0xA200, "Brick.TGA", chunk(0xA351, words(flags))))
    found = loaded.material.diffuse_map
    assert found is not None
    assert (found.wrap_s, found.wrap_t) == (wrap, wrap)
    assert loaded.report.codes() == codes | {"3ds-units"}


def test_an_opacity_map_is_the_opacity(tmp_path: Path, picture: Path) -> None:
    parts = percent(0xA050, 100), texture(0xA210, "Brick.TGA")
    found = load_material(tmp_path, *parts).material
    assert found.opacity_map is not None
    assert (found.opacity_map.channel, found.alpha, found.alpha_mode) == ("r", 1.0, "blend")
    alpha = load_material(tmp_path, texture(0xA210, "Brick.TGA", chunk(0xA351, words(0x40))))
    assert alpha.material.opacity_map is not None
    assert alpha.material.opacity_map.channel == "a"


@pytest.mark.parametrize(
    ("tag", "name"),
    [
        (0xA230, "bump"),
        (0xA204, "specular"),
        (0xA33C, "shininess"),
        (0xA220, "reflection"),
        (0xA33A, "texture 2"),
        (0xA33E, "texture mask"),
    ],
)
def test_maps_without_a_home_are_kept_as_notes(tmp_path: Path, tag: int, name: str) -> None:
    parts = chunk(0xA354, floats(2)), chunk(0xA351, words(2))
    loaded = load_material(tmp_path, texture(tag, "B.TGA", *parts, amount=30))
    assert loaded.material.extras == {
        f"{name} map": "B.TGA, amount 0.3, flags 0x2, scale 2 1, offset 0 0, angle 0"
    }
    assert loaded.finding("3ds-map-dropped").thing == "m"
    assert "file-missing" not in loaded.report.codes()


def test_switches_and_shadings(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, chunk(0xA085), chunk(0xA083), percent(0xA052, 20))
    assert loaded.finding("3ds-material-switch").text == (
        "wire frame, additive transparency, transparency falloff 20 %: no home; dropped"
    )
    metal = load_material(tmp_path, chunk(0xA100, words(4)))
    assert metal.finding("3ds-shading").kind is Kind.REPLACED
    wrong = load_material(tmp_path, chunk(0xA100, words(9)))
    assert wrong.finding("3ds-shading").kind is Kind.INVALID
    quiet = load_material(
        tmp_path, chunk(0xA087, floats(1)), chunk(0xA08A), chunk(0xA100, words(3))
    )
    assert quiet.report.codes() == {"3ds-units"}


def test_two_sides(tmp_path: Path) -> None:
    two, one = material("two", chunk(0xA081)), material("one")
    for names, sided, codes in (
        (("one", "one"), False, set()),
        (("two", "two"), True, set()),
        (("one", "two"), True, {"3ds-two-sided"}),
    ):
        parts = (wears(names[0], 0), wears(names[1], 1))
        loaded = load_bytes(tmp_path, file(two, one, square("S", *parts)))
        assert loaded.mesh.two_sided is sided
        assert loaded.report.codes() - {"3ds-units"} == codes


@pytest.mark.parametrize(
    ("part", "code"),
    [
        (percent(0xA050, 130), "3ds-percent"),
        (percent(0xA050, -1), "3ds-percent"),
        (chunk(0xA050), "3ds-value"),
        (chunk(0xA020, chunk(0x0010, floats(1, 1, math.nan))), "3ds-value"),
        (chunk(0xA020, chunk(0x0011, b"\0")), "3ds-value"),
        (chunk(0xA200), "3ds-map"),
        (texture(0xA200, "b.tga", chunk(0xA354, floats(0))), "3ds-map"),
        (texture(0xA200, "b.tga", chunk(0xA358, floats(1e30))), "3ds-map"),
        (chunk(0xA0F0), "3ds-unknown"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, part: bytes, code: str) -> None:
    loaded = load_material(tmp_path, part)
    assert loaded.findings(code)
    assert loaded.findings(code)[0].thing == "m"


def test_a_second_material_of_a_name_does_not_count(tmp_path: Path) -> None:
    content = file(material("m", DIFFUSE), material("m"), square("S", wears("m", 0, 1)))
    loaded = load_bytes(tmp_path, content)
    assert loaded.material.diffuse == (1.0, 0.5, 0.25)
    assert loaded.finding("3ds-duplicate").thing == "m"


def test_box_mapping_is_said(tmp_path: Path) -> None:
    box = mesh("S", points(SQUARE), faces(SQUARE_FACES, chunk(0x4190, b"a\0" * 6)))
    assert load_bytes(tmp_path, file(box)).finding("3ds-box-map").thing == "S"
