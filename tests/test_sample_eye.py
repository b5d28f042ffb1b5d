"""The sequences for the eye: photometry by closed forms and sums, motion, a rendered frame."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

from hdrusd.checking import validate
from hdrusd.errors import SourceRef
from hdrusd.images import read_image
from hdrusd.job import Job
from hdrusd.photometry.ies import read_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader

SCRIPT = Path(__file__).parents[1] / "samples" / "eye" / "make_sequences.py"
FPS = 24

pytestmark = pytest.mark.skipif(
    not SCRIPT.exists(), reason="the samples are not beside these tests"
)


def make(folder: Path) -> Path:
    subprocess.run([sys.executable, str(SCRIPT), str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("eye"))


def opened(made: Path, name: str) -> Usd.Stage:
    return Usd.Stage.Open(str(made / f"{name}.usda"))


def lamp_illuminance(stage: Usd.Stage, point: tuple[float, float, float]) -> float:
    """Lux on a level surface from flat lamps that look down, summed over 40 x 40 patches each.

    dE = L cos^2 / d^2 dA; the lamps' own nits, the UsdLux numbers, not the photometric ones.
    """
    total = 0.0
    for prim in stage.Traverse():
        if prim.IsA(UsdLux.RectLight):
            light = UsdLux.RectLight(prim)
            middle = np.array(
                UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0).ExtractTranslation()
            )
            size = np.array((light.GetWidthAttr().Get(), light.GetHeightAttr().Get()))
            share = (np.arange(40) + 0.5) / 40.0 - 0.5
            x, y = np.meshgrid(share * size[0], share * size[1])
            dx, dy, dz = middle[0] + x - point[0], middle[1] + y - point[1], middle[2] - point[2]
            d2 = dx**2 + dy**2 + dz**2
            nits = light.GetIntensityAttr().Get()
            total += nits * float((dz**2 / d2**2).sum()) * float(size.prod()) / 1600.0
    return total


def ambient(stage: Usd.Stage) -> float:
    return float(stage.GetDefaultPrim().GetAttribute("photometric:ambient:illuminance").Get())


def position(stage: Usd.Stage, path: str, seconds: float) -> npt.NDArray[np.float64]:
    form = UsdGeom.Xformable(stage.GetPrimAtPath(path))
    return np.array(form.ComputeLocalToWorldTransform(seconds * FPS).ExtractTranslation())


@pytest.mark.parametrize(
    ("name", "seconds"), [("tunnel", 10.0), ("oncoming", 8.0), ("lit_room", 9.0)]
)
class TestEach:
    """What all three have in common."""

    def test_it_passes_its_validators(self, made: Path, name: str, seconds: float) -> None:
        assert [str(problem) for problem in validate(opened(made, name))] == []

    def test_time_and_size(self, made: Path, name: str, seconds: float) -> None:
        stage = opened(made, name)
        assert stage.GetTimeCodesPerSecond() == FPS
        assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, seconds * FPS - 1)
        settings = stage.GetPrimAtPath("/Render/Settings")
        assert settings.GetAttribute("resolution").Get() == Gf.Vec2i(640, 360)

    def test_every_light_says_whence_its_numbers(
        self, made: Path, name: str, seconds: float
    ) -> None:
        stage = opened(made, name)
        for prim in stage.Traverse():
            if prim.HasAPI("HdrusdPhotometricLightAPI"):
                assert prim.GetAttribute("photometric:provenance").Get() == "authored"
                assert prim.GetAttribute("photometric:source").Get()

    def test_nothing_is_missing(self, made: Path, name: str, seconds: float) -> None:
        report = Report()
        StageReader(opened(made, name), report).read(0.0, Camera())
        kinds = {finding.code for finding in report}
        assert kinds <= {"profile-axes"}  # says where the beam's file points


def test_the_same_bytes_each_time(made: Path, tmp_path: Path) -> None:
    again = make(tmp_path)
    files = sorted(file.relative_to(made) for file in made.rglob("*") if file.is_file())
    assert [
        file for file in files if (made / file).read_bytes() != (again / file).read_bytes()
    ] == []


def test_the_grain_has_its_mean(made: Path) -> None:
    texels = np.asarray(read_image(made / "textures/grain.png").pixels)[..., 0] / 255.0
    # R = T^2.2 (Petit and Bremond 2010); 8 bits: half a code in 186 is 0.6 % of R, at random.
    assert np.mean(texels**2.2) == pytest.approx(0.5, rel=1e-3)


# -- tunnel -----------------------------------------------------------------------------------

ROAD = 0.2  # reflectance


def tunnel_road(stage: Usd.Stage, made: Path, y: float, x: float = 0.0) -> float:
    """cd/m2 of the road, by the lamps and the share of the sky's light there."""
    share = np.asarray(read_image(made / "textures/daylight.exr").pixels)[0, :, 0]
    depth = (np.arange(share.size) + 0.5) / share.size * 170.0
    diffuse = ambient(stage) * float(np.interp(y - 40.0, depth, share))
    return ROAD * (lamp_illuminance(stage, (x, y, 0.0)) + diffuse) / math.pi


def test_the_road_outside_has_5000(made: Path) -> None:
    stage = opened(made, "tunnel")
    sun = stage.GetPrimAtPath("/World/Sun")
    light, angle = UsdLux.DistantLight(sun), UsdLux.DistantLight(sun).GetAngleAttr().Get()
    facing = light.GetIntensityAttr().Get() * math.pi * math.sin(math.radians(angle) / 2.0) ** 2
    down = -UsdGeom.Xformable(sun).ComputeLocalToWorldTransform(0).TransformDir((0, 0, -1))[2]
    luminance = ROAD * (facing * down + ambient(stage)) / math.pi
    assert luminance == pytest.approx(5000.0, rel=0.03)


@pytest.mark.parametrize(
    ("depth", "luminance", "error"),
    [
        # CIE 88: L_th, here 5 % of 5000 cd/m2, in the first half of the threshold zone; of the
        # rest 0.4 L_th at its end, at 60 m here. Then (1.9 + t)^-1.4, 25 m being a second.
        (22.0, 250.0, 0.02),
        (45.0, 175.0, 0.02),
        (85.0, 250.0 * 2.9**-1.4, 0.05),
        (110.0, 250.0 * 3.9**-1.4, 0.05),
        (120.0, 250.0 * 4.3**-1.4, 0.05),
    ],
)
def test_the_road_inside_follows_cie88(
    made: Path, depth: float, luminance: float, error: float
) -> None:
    # Lamps 10 m long, 5.6 m up, blur the curve by a few per cent; the portals add daylight.
    stage = opened(made, "tunnel")
    assert tunnel_road(stage, made, 40.0 + depth) == pytest.approx(luminance, rel=error)


def test_half_of_the_sky_is_left_at_the_portal(made: Path) -> None:
    share = np.asarray(read_image(made / "textures/daylight.exr").pixels)[0, :, 0]
    # The lamps' light from wall to wall is 0.02 of the sky's there.
    assert share[0] == pytest.approx(0.5, abs=0.03)
    assert (share > 0.0).all()
    assert share.max() <= 1.0  # an occlusion; more would be cut off


def test_rendered_roads_outside_and_inside(gl: Any, made: Path) -> None:
    """The lower middle of the picture is road: as bright as the sums say."""
    stage = opened(made, "tunnel")
    job = Job(made / "tunnel.usda", times=[0.0, 60.0], width=160, height=90)
    outside, inside = (frame.hdr for frame in render_sequence(gl, job, Report()))
    weights = np.array((0.2126, 0.7152, 0.0722))

    def mean(hdr: Any) -> float:
        return float((np.asarray(hdr, np.float64)[70:89, 60:95, :3] @ weights).mean())

    # 5 %: the grain of a stretch of road 10 m long, and a dash of paint.
    assert mean(outside) == pytest.approx(5093.0, rel=0.05)
    # At 2.5 s, 22.5 m behind the portal; the road in view is 3 to 7 m ahead, at x = 1.4 m.
    assert mean(inside) == pytest.approx(tunnel_road(stage, made, 67.5, 1.4), rel=0.05)


# -- oncoming car -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def beam(made: Path) -> Luminaire:
    file = made / "low_beam.ies"
    return read_ies(file.read_bytes(), SourceRef(file), Report())


#: The cut-off falls by 1 %, 0.57 degrees: the file's 0 is there.
AIM = -0.57


@pytest.mark.parametrize(
    ("across", "up", "least", "most"),
    [
        # UN R112, class B: cd at points of a passing beam, degrees from the lamp's level.
        (1.15, -0.57, 10_100.0, math.inf),  # 75 R
        (1.72, -0.86, 10_100.0, math.inf),  # 50 R
        (-3.43, -0.57, 0.0, 10_600.0),  # 75 L
        (-3.43, -0.86, 0.0, 13_200.0),  # 50 L
        (0.0, -0.86, 5100.0, math.inf),  # 50 V
        (-9.0, -1.72, 1700.0, math.inf),  # 25 L
        (9.0, -1.72, 1700.0, math.inf),  # 25 R
        (2.5, 1.0, 0.0, 1750.0),  # BR
        (-3.43, 0.57, 0.0, 350.0),  # B 50 L: oncoming eyes
        (-8.0, 4.0, 0.0, 625.0),  # zone III
    ],
)
def test_the_beam_is_one_of_traffic(
    beam: Luminaire, across: float, up: float, least: float, most: float
) -> None:
    assert least <= float(beam.value(across, up - AIM)) <= most


def test_the_beams_lie_on_the_cars_and_look_ahead(made: Path) -> None:
    stage = opened(made, "oncoming")
    for car, ahead in (("OwnCar", 1.0), ("OncomingCar", -1.0)):
        for side in ("Left", "Right"):
            prim = stage.GetPrimAtPath(f"/World/{car}/Headlamp{side}")
            matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
            aim = matrix.TransformDir((0, 0, -1))
            assert aim[1] * ahead == pytest.approx(math.cos(math.radians(AIM)), abs=1e-6)
            assert aim[2] == pytest.approx(math.sin(math.radians(AIM)), abs=1e-6)
            assert matrix.TransformDir((0, 1, 0))[2] > 0.99  # the file's top is up
            assert matrix.ExtractTranslation()[2] == pytest.approx(0.64)


def test_the_cars_meet_after_six_seconds(made: Path) -> None:
    stage = opened(made, "oncoming")
    own, other = (position(stage, f"/World/{car}", 6.0) for car in ("OwnCar", "OncomingCar"))
    assert own[1] == pytest.approx(other[1])
    assert own[0] - other[0] == pytest.approx(3.5)  # a lane
    speed = position(stage, "/World/OwnCar", 5.0)[1] - position(stage, "/World/OwnCar", 4.0)[1]
    assert speed * 3.6 == pytest.approx(72.0)
    eye = position(stage, "/World/Driver", 7.5)
    assert eye[1] == pytest.approx(position(stage, "/World/Person", 0.0)[1], abs=0.2)


def test_illuminance_of_the_road_from_both_own_lamps(made: Path, beam: Luminaire) -> None:
    """E = I cos / d^2, 25 m before the lamps in the middle of the lane."""
    stage = opened(made, "oncoming")
    scene = StageReader(stage, Report()).read(0.0, Camera())
    lamps = [row for row in scene.lights if row["position"][0] > 0.0]
    assert len(lamps) == 2
    for row in lamps:
        # A factor of 1 on the file's candela, luminance 1 in the colour of 3200 K.
        assert row["intensity"] @ (0.2126, 0.7152, 0.0722) == pytest.approx(1.0, rel=1e-5)
    lux = 0.0
    for x in (-0.55, 0.55):
        across = math.degrees(math.atan2(-x, 25.0))
        up = math.degrees(math.atan2(-0.64, math.hypot(25.0, x)))
        d2 = 25.0**2 + x**2 + 0.64**2
        lux += float(beam.value(across, up - AIM)) / d2 * 0.64 / math.sqrt(d2)
    # 1 to 2 lx on the road there, so 0.03 cd/m2 and more of asphalt: mesopic.
    assert 0.5 < lux < 3.0


def test_rendered_road_before_the_own_car(gl: Any, made: Path, beam: Luminaire) -> None:
    """L = R I cos / (pi d^2) of both lamps and the ambient light, over 5 to 20 m of the lane."""
    job = Job(made / "oncoming.usda", times=[0.0], width=320, height=180)
    (frame,) = render_sequence(gl, job, Report())
    found = np.asarray(frame.hdr, np.float64)[..., :3] @ (0.2126, 0.7152, 0.0722)
    eye, scale = np.array((1.38, 0.10, 1.30)), 160.0 / math.tan(math.radians(25.0))
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(0.6, 3.0, 25), np.linspace(5.0, 20.0, 61)))
    column = 160.0 + scale * (x - eye[0]) / (y - eye[1])
    row = 90.0 + scale * eye[2] / (y - eye[1])
    lux = np.full(x.shape, ambient(opened(made, "oncoming")))
    for lamp in (1.75 - 0.55, 1.75 + 0.55):
        # In the beam's own frame, which is turned down by AIM about the lamp.
        to = np.stack((x - lamp, y - 2.005, np.full(x.shape, -0.64)))
        sine, cosine = math.sin(math.radians(AIM)), math.cos(math.radians(AIM))
        ahead, up = cosine * to[1] + sine * to[2], cosine * to[2] - sine * to[1]
        across = np.degrees(np.arctan2(to[0], ahead))
        angle = np.degrees(np.arctan2(up, np.hypot(to[0], ahead)))
        lux += beam.value(across, angle) * 0.64 / (to**2).sum(axis=0) ** 1.5
    inside = (column < 319) & (row < 179)
    rendered = found[row[inside].astype(int), column[inside].astype(int)].mean()
    # 5 %: grain.
    assert rendered == pytest.approx(0.08 / math.pi * lux[inside].mean(), rel=0.05)


# -- lit room ---------------------------------------------------------------------------------


def test_the_table_has_500_lux(made: Path) -> None:
    stage = opened(made, "lit_room")
    lux = lamp_illuminance(stage, (0.5, 4.0, 0.75)) + ambient(stage)
    assert lux == pytest.approx(500.0, rel=1e-3)  # 40 x 40 patches: 1e-4


def test_the_street_at_the_door_has_a_tenth_of_a_lux(made: Path) -> None:
    stage = opened(made, "lit_room")
    lamp = stage.GetPrimAtPath("/World/LanternLamp")
    candela = lamp.GetAttribute("inputs:photometric:luminousIntensity").Get()
    to = np.array((0.0, 0.0, 1.5)) - position(stage, "/World/LanternLamp", 0.0)
    d = float(np.linalg.norm(to))
    lantern = candela * float(to[1]) / d**3  # on the facade, which faces -Y
    shader = UsdShade.Shader(stage.GetPrimAtPath("/World/Looks/StoneCream/Surface"))
    glow = ambient(stage) * shader.GetInput("occlusion").Get()
    assert glow == pytest.approx(0.03, rel=1e-5)
    assert lantern + glow == pytest.approx(0.1, rel=0.2)


def test_the_walk_goes_through_the_door(made: Path) -> None:
    stage = opened(made, "lit_room")
    track = np.array([position(stage, "/World/Walker", t) for t in np.linspace(0.0, 9.0, 217)])
    in_door = track[(track[:, 1] > -0.4) & (track[:, 1] < 0.4)]
    assert len(in_door) > 3
    assert (np.abs(in_door[:, 0]) < 0.3).all()  # the door is 1.1 m wide
    steps = np.linalg.norm(np.diff(track, axis=0), axis=1) * FPS
    assert steps.max() < 2.0  # m/s
