"""FBX: lights in percent with their laws of decay, cameras by film and lens."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fbx_builder import Fbx, P, load, needs_ufbx

from hdrusd.legacy.scene import TRS, Camera, Light
from hdrusd.report import Report

pytestmark = needs_ufbx


def one_light(folder: Path, *props: str, unit: float = 1.0) -> tuple[Light, Report]:
    """The light of a file with one."""
    fbx = Fbx(unit=unit)
    fbx.attribute("Light", *props, under=fbx.model("lamp", "Light"))
    scene, report = load(fbx.write(folder))
    (light,) = scene.lights
    assert light.name == "lamp"
    return light, report


def enum(name: str, value: int) -> str:
    return P(name, value, kind="enum")


def test_a_light_of_a_hundred_percent_is_its_colour(tmp_path: Path) -> None:
    light, report = one_light(tmp_path, P("Color", 1.0, 0.5, 0.25, kind="Color"))
    assert (light.kind, light.diffuse, light.enabled) == ("point", (1.0, 0.5, 0.25), True)
    assert light.candela is None
    assert light.lux is None
    assert light.direction == (0.0, -1.0, 0.0)  # FBX SDK: along -Y
    assert report.codes() == set()


def test_intensity_is_a_percentage(tmp_path: Path) -> None:
    light, _ = one_light(tmp_path, P("Color", 1.0, 0.5, 0.25, kind="Color"), P("Intensity", 250.0))
    assert light.diffuse == (2.5, 1.25, 0.625)
    assert light.extras["intensity_percent"] == 250.0
    assert tuple(light.extras["color"]) == (1.0, 0.5, 0.25)


@pytest.mark.parametrize(
    ("decay", "start", "attenuation"),
    [
        (0, 0.0, (1.0, 0.0, 0.0)),
        (1, 0.0, (0.0, 1.0, 0.0)),  # Maya: one at one unit
        (2, 0.0, (0.0, 0.0, 1.0)),
        (1, 40.0, (0.0, 1.0 / 40.0, 0.0)),  # 3ds Max: one at its start
        (2, 40.0, (0.0, 0.0, 1.0 / 1600.0)),
    ],
)
def test_decay(
    tmp_path: Path, decay: int, start: float, attenuation: tuple[float, float, float]
) -> None:
    light, _ = one_light(tmp_path, enum("DecayType", decay), P("DecayStart", start))
    assert light.attenuation == pytest.approx(attenuation, rel=1e-15)


def test_cubic_decay_is_a_finding(tmp_path: Path) -> None:
    _, report = one_light(tmp_path, enum("DecayType", 3))
    assert "fbx-light-decay" in report.codes()


def test_far_attenuation_is_half_midway(tmp_path: Path) -> None:
    light, report = one_light(
        tmp_path,
        P("EnableFarAttenuation", 1, kind="bool"),
        P("FarAttenuationStart", 200.0),
        P("FarAttenuationEnd", 600.0),
        unit=100.0,
    )
    k0, k1, k2 = light.attenuation or (0.0, 0.0, 0.0)
    assert 1.0 / (k0 + k1 * 400.0 + k2 * 400.0**2) == pytest.approx(0.5, rel=1e-15)
    assert light.range == 600.0  # metres
    assert "fbx-light-range" in report.codes()


def test_cone_angles_are_whole(tmp_path: Path) -> None:
    light, report = one_light(
        tmp_path, enum("LightType", 2), P("InnerAngle", 30.0), P("OuterAngle", 50.0)
    )
    assert (light.kind, light.spot_cutoff, light.spot_inner) == ("spot", 25.0, 15.0)
    assert "fbx-light-edge" in report.codes()


def test_cone_out_of_range_is_clamped(tmp_path: Path) -> None:
    light, report = one_light(
        tmp_path, enum("LightType", 2), P("InnerAngle", 400.0), P("OuterAngle", 300.0)
    )
    assert (light.spot_cutoff, light.spot_inner) == (90.0, 90.0)
    assert "fbx-light-angle" in report.codes()


def test_directional_area_and_off(tmp_path: Path) -> None:
    sun, _ = one_light(tmp_path, enum("LightType", 1))
    assert (sun.kind, sun.attenuation) == ("directional", None)
    panel, report = one_light(tmp_path, enum("LightType", 3))
    # Lambert's cosine: what a flat lamp sends out by angle
    assert (panel.kind, panel.spot_cutoff, panel.spot_exponent) == ("spot", 90.0, 1.0)
    assert "fbx-light-area" in report.codes()
    ball, report = one_light(tmp_path, enum("LightType", 3), enum("AreaLightShape", 1))
    assert (ball.kind, ball.spot_cutoff) == ("point", 180.0)
    assert "fbx-light-area" in report.codes()
    off, _ = one_light(tmp_path, P("CastLight", 0, kind="bool"))
    assert not off.enabled


def test_light_of_two_nodes_is_one(tmp_path: Path) -> None:
    fbx = Fbx()
    a, b = fbx.model("a", "Light"), fbx.model("b", "Light")
    fbx.connect(fbx.attribute("Light", P("Intensity", 50.0), under=a), b)
    scene, _ = load(fbx.write(tmp_path))
    assert [node.lights for node in scene.roots] == [[0], [0]]


def test_ambient_light_of_the_scene(tmp_path: Path) -> None:
    fbx = Fbx()
    fbx.settings.append(P("AmbientColor", 0.25, 0.5, 0.125, kind="ColorRGB"))
    fbx.model("n")
    assert load(fbx.write(tmp_path))[0].ambient == (0.25, 0.5, 0.125)
    assert load(Fbx().write(tmp_path))[0].ambient is None


# -- cameras ---------------------------------------------------------------------------------


def one_camera(folder: Path, *props: str) -> tuple[Camera, TRS]:
    """The camera of a file with one, and how it is turned below its node."""
    fbx = Fbx()
    fbx.attribute("Camera", *props, under=fbx.model("eye", "Camera"))
    scene, _ = load(fbx.write(folder))
    (camera,) = scene.cameras
    (view,) = scene.roots[0].children
    assert view.cameras == [0]
    assert isinstance(view.transform, TRS)
    return camera, view.transform


FILM = (P("FilmWidth", 1.0), P("FilmHeight", 0.5), P("FilmAspectRatio", 2.0))
FRAME = (P("AspectWidth", 200.0), P("AspectHeight", 100.0), enum("AspectRatioMode", 2))


def test_vertical_angle_by_film_and_lens(tmp_path: Path) -> None:
    """2 atan(height / (2 f)): half an inch is 12.7 mm; the frame has the film's shape."""
    camera, _ = one_camera(
        tmp_path,
        enum("ApertureMode", 3),
        P("FocalLength", 25.4),
        *FILM,
        *FRAME,
        P("NearPlane", 5.0),
        P("FarPlane", 800.0),
    )
    assert camera.kind == "perspective"
    # ufbx has nine digits of an inch
    assert camera.fov_y == pytest.approx(math.degrees(2.0 * math.atan(12.7 / 50.8)), rel=2e-9)
    assert camera.aspect == pytest.approx(2.0, rel=1e-12)
    assert (camera.near, camera.far) == (5.0, 800.0)


def test_vertical_angle_as_stated(tmp_path: Path) -> None:
    camera, _ = one_camera(tmp_path, enum("ApertureMode", 2), P("FieldOfView", 33.0), *FILM, *FRAME)
    assert camera.fov_y == pytest.approx(33.0, rel=1e-12)
    assert (camera.near, camera.far) == (10.0, 4000.0)  # FBX SDK's, as the file says none


def test_camera_looks_along_x(tmp_path: Path) -> None:
    """FBX SDK: along the node's +X with +Y up."""
    _, turn = one_camera(tmp_path)
    x, y, z, w = turn.rotation
    u = np.array([x, y, z])
    for own, want in (((0.0, 0.0, -1.0), (1.0, 0.0, 0.0)), ((0.0, 1.0, 0.0), (0.0, 1.0, 0.0))):
        v = np.array(own)
        turned = v + 2.0 * w * np.cross(u, v) + 2.0 * np.cross(u, np.cross(u, v))
        np.testing.assert_allclose(turned, want, atol=1e-15)


def test_a_target_is_a_finding(tmp_path: Path) -> None:
    fbx = Fbx()
    lamp = fbx.model("lamp", "Light")
    fbx.attribute("Light", under=lamp)
    fbx.connect(fbx.model("road"), lamp, "LookAtProperty")
    _, report = load(fbx.write(tmp_path))
    (finding,) = [f for f in report if f.code == "fbx-look-at"]
    assert finding.thing == "lamp"
    assert "road" in finding.text


def test_orthographic(tmp_path: Path) -> None:
    """OrthoZoom 1 is a picture of 30 units; fitted by its width, at 2:1, 15 units high."""
    camera, _ = one_camera(
        tmp_path,
        enum("CameraProjectionType", 1),
        P("OrthoZoom", 2.0),
        enum("GateFit", 2),
        *FILM,
        *FRAME,
    )
    assert camera.kind == "orthographic"
    assert camera.height == pytest.approx(30.0, rel=1e-12)
