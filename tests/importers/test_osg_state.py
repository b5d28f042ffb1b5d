"""Render state and materials of OpenSceneGraph files."""

from __future__ import annotations

from pathlib import Path

import pytest
from osg_builder import (
    HEADER,
    array,
    dressed,
    geode,
    geometry,
    group,
    load,
    material,
    named,
    old_dressed,
    old_geode,
    old_geometry,
    scene,
    state_set,
    texture,
)

RED = material("Diffuse TRUE Front 1 0 0 1 Back 1 0 0 1 ")
GREEN = material("Diffuse TRUE Front 0 1 0 1 Back 0 1 0 1 ")
COLOURED = array("Color", "Vec4Array", "0.25 0.5 0.75 0.5", "BIND_OVERALL")


# --- inheritance --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parent", "child", "diffuse"),
    [
        ("", "", (0.8, 0.8, 0.8)),
        (RED, "", (1, 0, 0)),
        (RED, GREEN, (0, 1, 0)),
        (RED, GREEN.replace("OFF", "INHERIT"), (1, 0, 0)),
        (RED.replace("OFF", "OVERRIDE"), GREEN, (1, 0, 0)),
        (RED.replace("OFF", "OVERRIDE"), GREEN.replace("OFF", "PROTECTED"), (0, 1, 0)),
        (RED.replace("OFF", "OVERRIDE"), GREEN.replace("OFF", "OVERRIDE|PROTECTED"), (0, 1, 0)),
    ],
)
def test_a_child_replaces_what_is_not_overridden(
    tmp_path: Path, parent: str, child: str, diffuse: tuple[float, float, float]
) -> None:
    above, below = (state_set(attributes=a) if a else "" for a in (parent, child))
    tree = group(group(geode(geometry(more=below))), fields=above)
    assert load(tmp_path, HEADER + tree).material.diffuse == diffuse


@pytest.mark.parametrize(
    ("above", "below", "lit"),
    [
        ("ON", "OFF", False),
        ("OFF", "INHERIT", False),
        ("ON", "INHERIT", True),
        ("OFF", "ON", True),
        ("OVERRIDE|OFF", "ON", False),
        ("OVERRIDE_OFF", "ON", False),
        ("OVERRIDE|OFF", "PROTECTED|ON", True),
    ],
)
def test_modes_are_inherited_alike(tmp_path: Path, above: str, below: str, lit: bool) -> None:
    inner = old_geometry(before=f"StateSet {{\nGL_LIGHTING {below}\n}}")
    text = old_geode(inner, fields=f"StateSet {{\nGL_LIGHTING {above}\n}}")
    assert load(tmp_path, text).material.lit is lit


def test_equal_states_are_one_material_and_a_shared_mesh_may_wear_two(tmp_path: Path) -> None:
    shared = geometry(more="UniqueID 5 ")
    nodes = [geode(shared, fields=state_set(attributes=a)) for a in (RED, GREEN, RED)]
    made = load(tmp_path, scene(*nodes)).scene
    assert [m.name for m in made.materials] == ["state_0", "state_1"]
    assert [m.material for m in made.meshes] == [0, 1]
    assert made.meshes[0].points is made.meshes[1].points
    assert [node.meshes for node in made.roots[0].children] == [[0], [1], [0]]


def test_materials_are_named_by_themselves_or_their_picture(tmp_path: Path) -> None:
    (tmp_path / "wall.png").touch()
    own = dressed(tmp_path, state_set(attributes=material('Name "brick" ')))
    picture = dressed(tmp_path, state_set(unit=texture(named("wall.png"))))
    assert (own.material.name, picture.material.name) == ("brick", "wall")


def test_state_without_a_home_is_said(tmp_path: Path) -> None:
    attributes = "osg::Fog {\n}\nValue OFF \nosg::Program {\n}\nValue OFF "
    made = dressed(tmp_path, state_set("GL_FOG ON \nGL_STENCIL_TEST OFF ", attributes))
    things = {f.thing for f in made.report if f.code == "osg-state"}
    assert things == {"Fog", "Program", "GL_FOG"}
    old = old_dressed(tmp_path, "GL_FOG ON\nUniform {\nuName f\n}\nPoint {\nsize 2\n}")
    assert {f.thing for f in old.report if f.code == "osg-state"} == {"GL_FOG", "Uniform", "Point"}


def test_units_that_opengl_has_not_are_said(tmp_path: Path) -> None:
    (tmp_path / "a.png").touch()
    made = old_dressed(
        tmp_path, "textureUnit 32 {\nGL_TEXTURE_2D ON\nTexture2D {\nfile a.png\n}\n}"
    )
    assert (made.material.diffuse_map, made.codes()) == (None, {"osg-state"})
    made = dressed(tmp_path, state_set(unit=texture(named("a.png")), units=33))
    assert made.material.diffuse_map is not None
    assert [f.thing for f in made.report if f.code == "osg-state"] == ["units from 32 on"] * 2


# --- materials ----------------------------------------------------------------------------


def test_the_fields_of_both_syntaxes(tmp_path: Path) -> None:
    new = material(
        'Name "m" \nAmbient TRUE Front 0.1 0.2 0.3 1 Back 0 0 0 1 \n'
        "Diffuse TRUE Front 0.4 0.5 0.6 0.5 Back 0 0 0 1 \nShininess TRUE Front 12 Back 0 \n"
        "Specular FALSE Front 0.7 0.8 0.9 1 Back 0.7 0.8 0.9 1 \n"
        "Emission TRUE Front 2 1 0 1 Back 0 0 0 1 "
    )
    old = (
        'Material {\nname "m"\nambientColor 0.1 0.2 0.3\ndiffuseColor FRONT 0.4 0.5 0.6 0.5\n'
        "specularColor 0.7 0.8 0.9 1\nemissiveColor 2 1 0 1\nshininess 12\n}"
    )
    for made in (dressed(tmp_path, state_set(attributes=new)), old_dressed(tmp_path, old)):
        found = made.material
        assert (found.ambient, found.diffuse) == ((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
        assert (found.specular, found.emission) == ((0.7, 0.8, 0.9), (2, 1, 0))
        assert (found.shininess, found.alpha, found.defaults) == (12.0, 0.5, frozenset())
        assert not made.codes()


def test_what_is_left_out_is_the_constructors(tmp_path: Path) -> None:
    found = dressed(tmp_path, state_set(attributes=material('Name "m" '))).material
    assert (found.ambient, found.diffuse, found.alpha) == ((0.2,) * 3, (0.8,) * 3, 1.0)
    assert (found.specular, found.emission, found.shininess) == ((0.0,) * 3, (0.0,) * 3, 0.0)
    assert found.defaults == {"ambient", "diffuse", "specular", "emission", "shininess"}


def test_back_faces_that_differ_are_said(tmp_path: Path) -> None:
    new = material("Diffuse FALSE Front 1 0 0 1 Back 0 1 0 1 ")
    made = dressed(tmp_path, state_set(attributes=new))
    assert "(0, 1, 0, 1)" in made.finding("osg-back-face").text
    assert made.material.diffuse == (1, 0, 0)
    old = "Material {\ndiffuseColor FRONT 1 0 0 1\ndiffuseColor BACK  0 1 0 1\n}"
    assert old_dressed(tmp_path, old).codes() == {"osg-back-face"}


def test_broken_and_impossible_numbers(tmp_path: Path) -> None:
    fields = "Diffuse TRUE Front nan 0 0 1 Back 1 0 0 1 \nShininess TRUE Front 500 Back 500 "
    made = dressed(tmp_path, state_set(attributes=material(fields)))
    assert made.codes() == {"osg-number", "osg-shininess"}
    assert (made.material.diffuse, made.material.shininess) == ((0.8,) * 3, 128.0)


WHITE = (1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("modes", "colour_mode", "coloured", "diffuse", "kept"),
    [
        # glColorMaterial: the vertex colour takes the place of the diffuse colour.
        ("", "DIFFUSE", True, WHITE, True),
        ("", "AMBIENT_AND_DIFFUSE", True, WHITE, True),
        ("", "AMBIENT_AND_DIFFUSE", False, (1, 0, 0), False),
        # Without it lighting does not look at the vertex colour.
        ("", "OFF", True, (1, 0, 0), False),
        ("", "", True, (1, 0, 0), False),
        ("", "EMISSION", True, (1, 0, 0), False),
        # Without lighting nothing but the vertex colour is seen.
        ("GL_LIGHTING OFF ", "OFF", True, WHITE, True),
        ("GL_LIGHTING OFF ", "OFF", False, (1, 0, 0), False),
    ],
)
def test_vertex_colours_beside_a_material(
    tmp_path: Path,
    modes: str,
    colour_mode: str,
    coloured: bool,
    diffuse: tuple[float, float, float],
    kept: bool,
) -> None:
    mode = f"ColorMode {colour_mode} \n" if colour_mode else ""
    attribute = material(mode + "Diffuse TRUE Front 1 0 0 1 Back 1 0 0 1 ")
    made = dressed(tmp_path, state_set(modes, attribute), more=COLOURED if coloured else "")
    assert made.material.diffuse == diffuse
    assert (made.mesh.colors is not None) is kept
    assert ("osg-vertex-colours" in made.codes()) is coloured


@pytest.mark.parametrize(
    ("modes", "coloured", "diffuse"),
    [
        ("GL_LIGHTING ON ", True, WHITE),
        ("GL_LIGHTING ON ", False, (0.8, 0.8, 0.8)),
        ("GL_LIGHTING OFF ", True, WHITE),
        ("GL_LIGHTING OFF ", False, WHITE),
    ],
)
def test_vertex_colours_without_a_material(
    tmp_path: Path, modes: str, coloured: bool, diffuse: tuple[float, float, float]
) -> None:
    made = dressed(tmp_path, state_set(modes), more=COLOURED if coloured else "")
    assert made.material.diffuse == diffuse
    assert (made.mesh.colors is not None) is coloured
    assert "diffuse" in made.material.defaults


@pytest.mark.parametrize(
    ("modes", "attributes", "two_sided", "left_handed", "codes"),
    [
        ("", "", True, False, set()),
        ("GL_CULL_FACE ON ", "", False, False, set()),
        ("GL_CULL_FACE OFF ", "osg::CullFace {\n}\nValue OFF ", True, False, set()),
        ("GL_CULL_FACE ON ", "osg::CullFace {\nMode FRONT \n}", True, False, {"osg-cull-face"}),
        ("", "osg::FrontFace {\nMode CLOCKWISE \n}\nValue OFF ", True, True, set()),
    ],
)
def test_sides(
    tmp_path: Path,
    modes: str,
    attributes: str,
    two_sided: bool,
    left_handed: bool,
    codes: set[str],
) -> None:
    made = dressed(tmp_path, state_set(modes, attributes))
    assert (made.mesh.two_sided, made.material.two_sided) == (two_sided, two_sided)
    assert made.mesh.left_handed is left_handed
    assert made.codes() == codes


ABOVE = "osg::AlphaFunc {\nFunction GREATER \nReferenceValue 0.25 \n}\nValue OFF "
ADDED = "osg::BlendFunc {\nSourceRGB ONE \nDestinationRGB ONE \n}\nValue OFF "
USUAL = "osg::BlendFunc {\nSourceRGB SRC_ALPHA \nDestinationRGB ONE_MINUS_SRC_ALPHA \n}\nValue OFF "


@pytest.mark.parametrize(
    ("modes", "attributes", "fields", "mode", "codes"),
    [
        ("", "", "", "opaque", set()),
        ("GL_BLEND ON ", "", "", "blend", set()),
        ("GL_BLEND ON ", USUAL, "", "blend", set()),
        ("GL_BLEND ON ", ADDED, "", "blend", {"osg-blend-function"}),
        ("GL_BLEND OFF ", USUAL, "RenderingHint 2 ", "opaque", set()),
        ("", USUAL, "", "blend", {"osg-blend"}),
        ("", "", "RenderingHint 2 ", "blend", {"osg-blend"}),
        ("", "", "RenderingHint 1 ", "opaque", set()),
        ("GL_ALPHA_TEST ON ", ABOVE, "", "mask", set()),
        ("", ABOVE, "", "opaque", set()),
        ("GL_ALPHA_TEST ON ", ABOVE.replace("GREATER", "LESS"), "", "opaque", {"osg-alpha-test"}),
        ("GL_ALPHA_TEST ON \nGL_BLEND ON ", ABOVE, "", "blend", {"osg-alpha-test"}),
    ],
)
def test_transparency(
    tmp_path: Path, modes: str, attributes: str, fields: str, mode: str, codes: set[str]
) -> None:
    (tmp_path / "leaf.png").touch()
    unit = texture(named("leaf.png"))
    made = dressed(tmp_path, state_set(modes, attributes, unit, fields))
    assert (made.material.alpha_mode, made.codes()) == (mode, codes)
    assert (made.material.opacity_map is None) == (mode == "opaque")
    if made.material.opacity_map is not None:
        assert made.material.opacity_map.channel == "a"
    if "GREATER" in attributes and mode == "mask":
        assert made.material.alpha_cutoff == 0.25


def test_a_jpeg_has_no_opacity(tmp_path: Path) -> None:
    (tmp_path / "leaf.JPG").touch()
    made = dressed(tmp_path, state_set("GL_BLEND ON ", unit=texture(named("leaf.JPG"))))
    assert made.material.opacity_map is None
