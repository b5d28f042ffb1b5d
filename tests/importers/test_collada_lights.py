"""COLLADA lights and cameras."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from collada_builder import document, load

from hdrusd.legacy.scene import Camera, Light
from hdrusd.report import Kind, Report


def light(folder: Path, common: str, extra: str = "", tool: str = "") -> tuple[Light, Report]:
    """The one light of a document; ``extra`` in a technique of its own."""
    if extra:
        extra = f'<extra><technique profile="blender">{extra}</technique></extra>'
    library = (
        f'<library_lights><light id="l" name="Lamp"><technique_common>{common}'
        f"</technique_common>{extra}</light></library_lights>"
    )
    nodes = '<node><instance_light url="#l"/></node><node><instance_light url="#l"/></node>'
    scene, report = load(folder, document(library, nodes, tool=tool))
    (made,) = scene.lights
    assert [node.lights for node in scene.roots] == [[0], [0]]
    return made, report


def camera(folder: Path, lens: str) -> tuple[Camera, Report]:
    """The one camera of a document."""
    library = (
        f'<library_cameras><camera id="c"><optics><technique_common>{lens}'
        "</technique_common></optics></camera></library_cameras>"
    )
    nodes = '<node><instance_camera url="#c"/></node>'
    scene, report = load(folder, document(library, nodes))
    (made,) = scene.cameras
    return made, report


def test_a_point_with_its_attenuation(tmp_path: Path) -> None:
    text = (
        "<point><color>.5 .25 .05</color><constant_attenuation>.1</constant_attenuation>"
        "<linear_attenuation>.7</linear_attenuation>"
        "<quadratic_attenuation>.9</quadratic_attenuation></point>"
    )
    made, report = light(tmp_path, text)
    assert (made.kind, made.diffuse, made.attenuation) == (
        "point",
        (0.5, 0.25, 0.05),
        (0.1, 0.7, 0.9),
    )
    assert made.candela is None
    assert not report.codes()


def test_left_out_attenuation_is_the_formats_default(tmp_path: Path) -> None:
    made, _ = light(tmp_path, "<point><color>1 1 1</color></point>")
    assert made.attenuation == (1.0, 0.0, 0.0)


def test_a_spot_shines_into_half_its_falloff_angle(tmp_path: Path) -> None:
    text = (
        "<spot><color>1 1 1</color><falloff_angle>45</falloff_angle>"
        "<falloff_exponent>2</falloff_exponent></spot>"
    )
    made, report = light(tmp_path, text)
    assert (made.kind, made.spot_cutoff, made.spot_exponent) == ("spot", 22.5, 2.0)
    assert made.direction == (0.0, 0.0, -1.0)
    assert "collada-spot-angle" in report.codes()


def test_blenders_blend_is_an_edge_and_no_exponent(tmp_path: Path) -> None:
    text = (
        "<spot><color>1 1 1</color><falloff_angle>80</falloff_angle>"
        "<falloff_exponent>0.25</falloff_exponent></spot>"
    )
    made, report = light(tmp_path, text, "<spotblend>0.25</spotblend>")
    assert (made.spot_cutoff, made.spot_inner, made.spot_exponent) == (40.0, 30.0, 0.0)
    assert "collada-spot-blend" in report.codes()


@pytest.mark.parametrize("kind", ["directional", "ambient"])
def test_lights_without_a_place(tmp_path: Path, kind: str) -> None:
    made, _ = light(tmp_path, f"<{kind}><color>.1 .2 .3</color></{kind}>")
    assert (made.kind, made.diffuse) == (kind, (0.1, 0.2, 0.3))
    assert made.attenuation is None


def test_watts_of_blender_are_candela(tmp_path: Path) -> None:
    # 1000 W times 683 lm/W over 4 pi sr; its exporter multiplies the colour by the watts
    text = "<point><color>1000 500 0</color></point>"
    extra = '<energy sid="blender_energy">1000</energy>'
    made, report = light(tmp_path, text, extra, "Blender 2.93.4 commit date:2021-08-31")
    assert made.candela == pytest.approx(1000.0 * 683.0 / (4.0 * math.pi), rel=1e-12)
    assert made.diffuse == (1.0, 0.5, 0.0)
    assert [f.kind for f in report if f.code == "collada-light-watts"] == [Kind.GUESSED]


def test_a_sun_of_blender_is_in_watts_a_square_metre(tmp_path: Path) -> None:
    made, _ = light(
        tmp_path,
        "<directional><color>2 2 2</color></directional>",
        "<energy>2</energy>",
        "Blender 3.6.0",
    )
    assert made.lux == pytest.approx(1366.0, rel=1e-12)
    assert made.diffuse == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("tool", ["Blender 2.74.0", "Blender 2.79.0", "Maya", ""])
def test_energy_without_a_unit_is_none(tmp_path: Path, tool: str) -> None:
    made, _ = light(tmp_path, "<point><color>2 2 2</color></point>", "<energy>2</energy>", tool)
    assert (made.candela, made.diffuse) == (None, (2.0, 2.0, 2.0))
    assert made.extras["energy"] == 2.0  # for the photometry file's author to see


def test_an_intensity_multiplies_the_colour(tmp_path: Path) -> None:
    made, report = light(
        tmp_path, "<directional><color>1 .5 .25</color><intensity>10</intensity></directional>"
    )
    assert made.diffuse == (10.0, 5.0, 2.5)
    assert "collada-light-factor" in report.codes()


@pytest.mark.parametrize(
    ("common", "code"),
    [
        ("<point><color>1 x 1</color></point>", "collada-number"),
        ("<point/>", "collada-light-colour"),
        ("<spot><color>1 1 1</color><falloff_angle>0</falloff_angle></spot>", "light-cone"),
        ("<spot><color>1 1 1</color><falloff_angle>-9</falloff_angle></spot>", "collada-range"),
        ("<point><color>1e38 1 1</color><intensity>1e9</intensity></point>", "light-intensity"),
    ],
)
def test_broken_lights_say_so(tmp_path: Path, common: str, code: str) -> None:
    made, report = light(tmp_path, common)
    assert code in report.codes()
    assert all(math.isfinite(c) for c in made.diffuse)


def test_a_light_of_no_kind_is_dropped(tmp_path: Path) -> None:
    library = (
        '<library_lights><light id="l"><technique_common><laser/></technique_common></light>'
        "</library_lights>"
    )
    scene, report = load(tmp_path, document(library, '<node><instance_light url="#l"/></node>'))
    assert not scene.lights
    assert "light-type" in report.codes()


def test_a_perspective_by_its_width(tmp_path: Path) -> None:
    # Blender's 49.13434 degrees across 16:9, its 35 mm lens on a 32 mm sensor
    made, _ = camera(
        tmp_path,
        "<perspective><xfov>49.13434</xfov><aspect_ratio>1.777778</aspect_ratio>"
        "<znear>.1</znear><zfar>100</zfar></perspective>",
    )
    assert made.fov_y == pytest.approx(2 * math.degrees(math.atan(16 / 35 / (16 / 9))), abs=1e-4)
    assert (made.near, made.far) == (0.1, 100.0)
    assert made.aspect == pytest.approx(16 / 9, rel=1e-6)


def test_a_perspective_by_both_angles(tmp_path: Path) -> None:
    made, _ = camera(tmp_path, "<perspective><xfov>90</xfov><yfov>60</yfov></perspective>")
    assert made.fov_y == 60.0
    assert made.aspect == pytest.approx(math.sqrt(3.0), rel=1e-12)  # tan 45 / tan 30


def test_an_orthographic_has_half_magnitudes(tmp_path: Path) -> None:
    made, _ = camera(
        tmp_path,
        "<orthographic><xmag>3</xmag><aspect_ratio>1.5</aspect_ratio><znear>.1</znear>"
        "<zfar>100</zfar></orthographic>",
    )
    assert (made.kind, made.height, made.aspect) == ("orthographic", 4.0, 1.5)


@pytest.mark.parametrize(
    "lens",
    [
        "<perspective/>",
        "<perspective><xfov>900</xfov></perspective>",
        "<perspective><yfov>-1</yfov><znear>0</znear></perspective>",
        "<perspective><yfov>30</yfov><znear>5</znear><zfar>1</zfar></perspective>",
    ],
)
def test_a_broken_lens_says_so(tmp_path: Path, lens: str) -> None:
    made, report = camera(tmp_path, lens)
    assert "camera-value" in report.codes()
    assert 0.0 < made.fov_y < 180.0
    assert 0.0 < made.near < made.far
