"""Lights, transforms and animation paths of OpenSceneGraph files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from osg_builder import (
    HEADER,
    geode,
    geometry,
    group,
    light_source,
    load,
    old_group,
    scene,
    state_set,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import TRS
from hdrusd.report import Kind

WHITE = "Diffuse 1 1 1 1 \nSpecular 1 1 1 1 \nAmbient 0 0 0 1 "


def test_a_point_light_of_both_syntaxes(tmp_path: Path) -> None:
    new = (
        'Name "lamp" \nLightNum 3 \nAmbient 0.1 0.1 0.1 1 \nDiffuse 1 0.8 0.5 1 \n'
        "Specular 0.2 0.2 0.2 1 \nPosition 4 6 8 2 \nConstantAttenuation 0.5 \n"
        "LinearAttenuation 0.25 \nQuadraticAttenuation 0.125 "
    )
    old = (
        'name "lamp"\nlight_num 3\nambient 0.1 0.1 0.1 1\ndiffuse 1 0.8 0.5 1\n'
        "specular 0.2 0.2 0.2 1\nposition 4 6 8 2\ndirection 0 0 -1\nconstant_attenuation 0.5\n"
        "linear_attenuation 0.25\nquadratic_attenuation 0.125\nspot_exponent 0\nspot_cutoff 180"
    )
    texts = scene(light_source(new)), old_group(f"LightSource {{\nLight {{\n{old}\n}}\n}}")
    for text in texts:
        made = load(tmp_path, text)
        light = made.light
        assert (light.name, light.kind, light.position) == ("lamp", "point", (2, 3, 4))
        assert (light.ambient, light.diffuse) == ((0.1,) * 3, (1, 0.8, 0.5))
        assert (light.specular, light.attenuation) == ((0.2,) * 3, (0.5, 0.25, 0.125))
        assert light.extras["light_number"] == 3
        assert made.root.children[0].lights == [0]
        assert not made.codes()


def test_a_directional_light_travels_away_from_its_position(tmp_path: Path) -> None:
    light = load(tmp_path, scene(light_source(f"{WHITE}\nPosition 0 3 4 0 "))).light
    assert (light.kind, light.direction) == ("directional", (0, -0.6, -0.8))
    assert light.position == (0, 0, 0)


def test_a_spot_light(tmp_path: Path) -> None:
    fields = f"{WHITE}\nPosition 1 2 3 1 \nDirection 0 0 -2 \nSpotExponent 8 \nSpotCutoff 30 "
    light = load(tmp_path, scene(light_source(fields))).light
    assert (light.kind, light.spot_cutoff, light.spot_exponent) == ("spot", 30, 8)
    assert light.direction == (0, 0, -1)


def test_a_cutoff_that_opengl_refuses(tmp_path: Path) -> None:
    made = load(tmp_path, scene(light_source(f"{WHITE}\nPosition 0 0 1 1 \nSpotCutoff 120 ")))
    assert (made.light.kind, made.light.spot_cutoff) == ("point", 180)
    assert made.finding("osg-light-cutoff").kind is Kind.CLAMPED


def test_a_light_that_is_ambient_only(tmp_path: Path) -> None:
    fields = "Ambient 0.3 0.3 0.4 1 \nDiffuse 0 0 0 1 \nSpecular 0 0 0 1 \nPosition 0 0 1 0 "
    light = load(tmp_path, scene(light_source(fields))).light
    assert (light.kind, light.ambient) == ("ambient", (0.3, 0.3, 0.4))


@pytest.mark.parametrize("position", ["0 0 0 0 ", "1e308 1e308 1e308 1e-300 "])
def test_a_light_from_nowhere(tmp_path: Path, position: str) -> None:
    fields = f"{WHITE}\nPosition {position}\nSpotCutoff 20 "
    made = load(tmp_path, scene(light_source(fields)))
    assert made.codes() == {"osg-light-direction"}
    assert made.light.direction == (0, 0, -1)


def test_what_a_light_leaves_out(tmp_path: Path) -> None:
    """The .osgt writer leaves zero colours out; osg::Light's constructor has others."""
    new = load(tmp_path, scene(light_source("Diffuse 1 1 1 1 \nPosition 0 0 1 1 ")))
    assert (new.light.ambient, new.light.specular) == ((0, 0, 0), (0, 0, 0))
    assert (new.light.attenuation, new.light.spot_cutoff) == ((1, 0, 0), 180)
    assert "constantattenuation" in new.light.extras["defaults"]
    assert new.finding("osg-light-defaults").kind is Kind.ASSUMED
    old = load(tmp_path, old_group("LightSource {\nLight {\nposition 0 0 1 1\n}\n}")).light
    assert (old.ambient, old.diffuse, old.specular) == ((0.05,) * 3, (0.8,) * 3, (0.05,) * 3)


def mode(value: str, name: str = "GL_LIGHT2") -> str:
    """A StateSet with a mode."""
    return state_set(modes=f"{name} {value} ")


ON, OFF, UNLIT = mode("ON"), mode("OFF"), mode("OFF", "GL_LIGHTING")


@pytest.mark.parametrize(
    ("own", "above", "drawn", "enabled"),
    [
        # Drawn things decide: OpenSceneGraph draws each with the modes that hold there.
        ("", "", (ON,), True),
        ("", "", (OFF,), False),
        (OFF, "", (ON,), True),
        (OFF, OFF, (ON, OFF), True),
        (ON, "", (OFF, OFF), False),
        (ON, OFF, ("",), False),  # what is drawn is below it too
        # Where they say nothing, what the file says at the light.
        ("", "", (), True),
        ("", "", ("",), True),
        (ON, "", ("",), True),
        (OFF, "", ("",), False),
        ("", "", ("", OFF), True),
        (OFF, "", (), False),
        ("", OFF, (), False),
        # What is not lit by any light has no say.
        ("", "", (UNLIT,), True),
        (OFF, "", (UNLIT,), False),
    ],
)
def test_lights_are_switched_by_what_they_would_light(
    tmp_path: Path, own: str, above: str, drawn: tuple[str, ...], enabled: bool
) -> None:
    source = light_source(f"LightNum 2 \n{WHITE}", own)
    things = (geode(geometry(), fields=state) for state in drawn)
    made = load(tmp_path, scene(source, *things, fields=above))
    assert made.light.enabled is enabled
    assert ("osg-light-mode" in made.codes()) == (enabled and own == OFF)
    assert ("osg-light-scope" in made.codes()) == (drawn == (ON, OFF))


def test_what_is_below_a_light_source_is_lit_by_it(tmp_path: Path) -> None:
    """OpenSceneGraph puts its GL_LIGHTn ON when it has read the light, whatever the file says."""
    inner = geode(geometry())
    source = light_source(f"LightNum 2 \n{WHITE}", f"{OFF}\nChildren 1 {{\n{inner}\n}}\n")
    made = load(tmp_path, scene(source))
    assert made.light.enabled
    assert made.finding("osg-light-mode").kind is Kind.ASSUMED


def test_the_light_of_another_file(tmp_path: Path) -> None:
    """The modes of what is drawn count in all files, and so do numbers."""
    lamp = light_source(f"LightNum 2 \n{WHITE}")
    (tmp_path / "lamp.osgt").write_text(scene(lamp))
    named = 'osg::ProxyNode {\nFileNames 1 {\n"lamp.osgt" \n}\n}'
    made = load(tmp_path, scene(named, geode(geometry(), fields=OFF)))
    assert not made.light.enabled
    made = load(tmp_path, scene(named, named, lamp))
    assert len(made.scene.lights) == 2
    assert made.finding("osg-light-number").text.startswith("2 lights are GL_LIGHT2")


def test_lights_of_one_number_are_all_kept(tmp_path: Path) -> None:
    sources = [light_source(f'Name "l{n}" \nLightNum 1 \n{WHITE}') for n in range(3)]
    made = load(tmp_path, scene(*sources, "osg::LightSource {\n}"))
    assert len(made.scene.lights) == 3
    assert made.finding("osg-light-number").text.startswith("3 lights are GL_LIGHT1")
    assert made.finding("osg-light").kind is Kind.MISSING


def test_the_light_model_is_the_scenes(tmp_path: Path) -> None:
    def model(value: str) -> str:
        return (
            "StateSet TRUE {\nosg::StateSet {\nAttributeList 1 {\nosg::LightModel {\n"
            f"AmbientIntensity {value} \nTwoSided TRUE \n}}\nValue OFF \n}}\n}}\n}}"
        )

    made = load(
        tmp_path, scene(group(fields=model("0.9 0.9 0.9 1")), fields=model("0.1 0.2 0.3 1"))
    )
    assert made.scene.ambient == (0.1, 0.2, 0.3)
    texts = [f.text for f in made.report if f.code == "osg-light-model"]
    assert sum("two-sided" in text for text in texts) == 2
    assert sum("(0.9, 0.9, 0.9)" in text for text in texts) == 1


# --- transforms ---------------------------------------------------------------------------


def test_matrices_act_on_row_vectors(tmp_path: Path) -> None:
    rows = "1 0 0 0 \n0 1 0 0 \n0 0 1 0 \n5 6 7 1 "
    new = HEADER + group(kind="osg::MatrixTransform", fields=f"Matrix {{\n{rows}\n}}\n")
    old = old_group(kind="MatrixTransform", fields=f"Type DYNAMIC\nMatrix {{\n{rows}\n}}")
    for text in (new, old):
        made = load(tmp_path, text)
        assert isinstance(made.root.transform, np.ndarray)
        assert made.root.transform[3].tolist() == [5, 6, 7, 1]
    identity = new.replace("5 6 7 1", "0 0 0 1")
    assert load(tmp_path, identity).root.transform is None


def test_broken_matrices(tmp_path: Path) -> None:
    text = HEADER + group(kind="osg::MatrixTransform", fields="Matrix {\n1 0 nan 0 \n}\n")
    made = load(tmp_path, text)
    assert (made.root.transform, made.codes()) == (None, {"osg-number"})
    rows = "1 0 0 0.5 \n0 1 0 0 \n0 0 1 0 \n0 0 0 2 "
    text = HEADER + group(kind="osg::MatrixTransform", fields=f"Matrix {{\n{rows}\n}}\n")
    made = load(tmp_path, text)
    assert (made.root.transform, made.codes()) == (None, {"osg-matrix"})


HALF = math.sqrt(0.5)
PLACED = f"Position 1 2 3 \nAttitude 0 0 {HALF} {HALF} \nScale 2 4 8 "


def test_a_position_attitude_transform(tmp_path: Path) -> None:
    made = load(tmp_path, HEADER + group(kind="osg::PositionAttitudeTransform", fields=PLACED))
    transform = made.root.transform
    assert isinstance(transform, TRS)
    assert (transform.translation, transform.scale) == ((1, 2, 3), (2, 4, 8))
    assert transform.rotation == pytest.approx((0, 0, HALF, HALF), abs=1e-15)


@pytest.mark.parametrize("syntax", ["new", "old"])
def test_a_pivot_is_what_stands_at_the_position(tmp_path: Path, syntax: str) -> None:
    """Scale, a quarter turn about z, then move: the x axis becomes y."""
    fields = f"{PLACED}\nPivotPoint 10 20 30 "
    text = HEADER + group(kind="osg::PositionAttitudeTransform", fields=fields)
    if syntax == "old":
        fields = f"{PLACED.lower()}\npivotPoint 10 20 30"
        text = old_group(kind="PositionAttitudeTransform", fields=fields)
    matrix = load(tmp_path, text).root.transform
    assert isinstance(matrix, np.ndarray)
    np.testing.assert_allclose([10, 20, 30, 1] @ matrix, [1, 2, 3, 1], atol=1e-12)
    np.testing.assert_allclose([11, 20, 30, 1] @ matrix, [1, 4, 3, 1], atol=1e-12)
    np.testing.assert_allclose([10, 21, 30, 1] @ matrix, [-3, 2, 3, 1], atol=1e-12)


def test_a_rotation_of_no_length(tmp_path: Path) -> None:
    fields = "Position 1 2 3 \nAttitude 0 0 0 0 "
    made = load(tmp_path, HEADER + group(kind="osg::PositionAttitudeTransform", fields=fields))
    assert (made.root.transform, made.codes()) == (TRS((1, 2, 3)), {"osg-rotation"})


def test_transforms_that_follow_the_viewer(tmp_path: Path) -> None:
    fields = "Position 1 2 3 \nAutoRotateMode ROTATE_TO_SCREEN \nAutoScaleToScreen TRUE "
    made = load(tmp_path, HEADER + group(kind="osg::AutoTransform", fields=fields))
    assert (made.root.kind, made.root.transform) == ("billboard", TRS((1, 2, 3)))
    assert made.codes() == {"osg-auto-rotate", "osg-auto-scale"}
    sky = load(tmp_path, old_group(kind="Transform", fields="referenceFrame ABSOLUTE"))
    assert sky.codes() == {"osg-reference-frame"}


def test_degrees_of_freedom_at_rest(tmp_path: Path) -> None:
    """Heading about z and a translation, within a frame that is put at 10, 0, 0."""
    put = "PutMatrix {\n1 0 0 0 \n0 1 0 0 \n0 0 1 0 \n-10 0 0 1 \n}"
    fields = f"CurrentHPR {math.pi / 2} 0 0 \nCurrentTranslate 0 0 5 \n{put}\nAnimationOn TRUE "
    made = load(tmp_path, HEADER + group(kind="osgSim::DOFTransform", fields=fields))
    matrix = made.root.transform
    assert isinstance(matrix, np.ndarray)
    np.testing.assert_allclose([10, 0, 0, 1] @ matrix, [10, 0, 5, 1], atol=1e-12)
    np.testing.assert_allclose([11, 0, 0, 1] @ matrix, [10, 1, 5, 1], atol=1e-12)
    assert made.codes() == {"osg-degrees-of-freedom"}


# --- animation ----------------------------------------------------------------------------


def animated(path: str, more: str = "", kind: str = "osg::MatrixTransform") -> str:
    """A transform with an AnimationPathCallback, in the newer syntax."""
    callback = (
        "UpdateCallback TRUE {\nosg::AnimationPathCallback {\nAnimationPath TRUE {\n"
        f"osg::AnimationPath {{\n{path}\n}}\n}}\n{more}\n}}\n}}"
    )
    return HEADER + group(kind=kind, fields=f"{callback}\nMatrix {{\n{'1 ' * 16}\n}}\n")


def point(time: float, x: float, rotation: str = "0 0 0 1", scale: str = "1 1 1") -> str:
    """A control point."""
    return f"Time {time} {{\nPosition {x} 0 0 \nRotation {rotation} \nScale {scale} \n}}\n"


TWO = f"TimeControlPointMap 2 {{\n{point(1, 0)}{point(3, 5, '0 0 2 0')}}}\n"


@pytest.mark.parametrize(
    ("mode", "loop"),
    [("", "loop"), ("LoopMode NO_LOOPING ", "none"), ("LoopMode SWING ", "swing")],
)
def test_a_path_takes_the_place_of_the_matrix(tmp_path: Path, mode: str, loop: str) -> None:
    made = load(tmp_path, animated(TWO + mode))
    move, turn = made.root.animation
    assert (made.root.transform, move.path, turn.path) == (None, "translation", "rotation")
    assert (move.loop, turn.loop, move.interpolation) == (loop, loop, "linear")
    assert move.times.tolist() == turn.times.tolist() == [1, 3]
    assert move.values.tolist() == [[0, 0, 0], [5, 0, 0]]
    assert turn.values.tolist() == [[0, 0, 0, 1], [0, 0, 1, 0]]  # of length 1
    assert not made.codes()


def test_a_path_of_the_older_syntax(tmp_path: Path) -> None:
    path = "LoopMode LOOP\nControlPoints {\n3 5 0 0 0 0 1 0 1 1 1\n1 0 0 0 0 0 0 1 2 2 2\n}"
    callback = f"AnimationPathCallback {{\npivotPoint 0 0 0\nAnimationPath {{\n{path}\n}}\n}}"
    fields = f"UpdateCallbacks {{\n{callback}\n}}"
    made = load(tmp_path, old_group(kind="PositionAttitudeTransform", fields=fields))
    move, _, size = made.root.animation
    assert (move.times.tolist(), size.path) == ([1, 3], "scale")  # in the order of time
    assert size.values.tolist() == [[2, 2, 2], [1, 1, 1]]


def test_offset_and_multiplier_of_time(tmp_path: Path) -> None:
    """A path's time is (scene time - offset) x multiplier."""
    made = load(tmp_path, animated(TWO, "TimeOffset 10 \nTimeMultiplier 2 "))
    assert made.root.animation[0].times.tolist() == [10.5, 11.5]
    stopped = load(tmp_path, animated(TWO, "TimeMultiplier 0 "))
    assert stopped.root.animation[0].times.tolist() == [1, 3]
    assert stopped.codes() == {"osg-animation"}


def test_shared_paths_are_limited(tmp_path: Path) -> None:
    path = f"AnimationPath TRUE {{\nosg::AnimationPath {{\nUniqueID 5 \n{TWO}\n}}\n}}\n"
    callback = f"UpdateCallback TRUE {{\nosg::AnimationPathCallback {{\n{path}}}\n}}\n"
    nodes = [group(kind="osg::MatrixTransform", fields=callback)] * 6
    assert len(load(tmp_path, scene(*nodes)).root.children) == 6
    with pytest.raises(InputError, match="more than 10 control points"):
        load(tmp_path, scene(*nodes), limits=Limits(vertices=10))


def test_a_pivot_is_an_inner_node(tmp_path: Path) -> None:
    made = load(tmp_path, animated(TWO, "PivotPoint 1 2 3 "))
    (inner,) = made.root.children
    assert inner.transform == TRS((-1, -2, -3))
    assert made.codes() == {"osg-animation-pivot"}


def test_a_later_point_replaces_one_of_the_same_time(tmp_path: Path) -> None:
    points = point(0, 1) + point(2, 2) + point(0, 3)
    made = load(tmp_path, animated(f"TimeControlPointMap 3 {{\n{points}}}\n"))
    assert made.root.animation[0].times.tolist() == [0, 2]
    assert made.root.animation[0].values[:, 0].tolist() == [3, 2]


def test_points_that_are_broken_are_left_out(tmp_path: Path) -> None:
    points = point(0, 1) + point(math.nan, 2) + point(4, 3, "0 0 0 0") + point(5, 4)
    made = load(tmp_path, animated(f"TimeControlPointMap 4 {{\n{points}}}\n"))
    assert made.root.animation[0].times.tolist() == [0, 5]
    assert made.codes() == {"osg-animation"}


@pytest.mark.parametrize(
    "text",
    [
        animated("TimeControlPointMap 0 \n"),
        animated(TWO, "UseInverseMatrix TRUE "),
        animated(TWO, kind="osg::Group"),
    ],
)
def test_paths_that_are_dropped(tmp_path: Path, text: str) -> None:
    made = load(tmp_path, text.replace("1 " * 16, "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"))
    assert made.root.animation == ()
    assert made.finding("osg-animation").kind is Kind.DROPPED
