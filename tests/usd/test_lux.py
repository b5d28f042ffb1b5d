"""What a UsdLux light says, against closed forms and against the truth set."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.lux import LuxReading, is_light, read_lux

# One float32 rounding each of intensity, radius (squared), a colour and a second length.
FLOAT32 = 8 * 2.0**-24


def open_stage(text: str, meters_per_unit: float = 1.0) -> Usd.Stage:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(f"#usda 1.0\n(metersPerUnit = {meters_per_unit})\n{text}")
    return Usd.Stage.Open(layer)


def read(text: str, meters_per_unit: float = 1.0, path: str = "/L") -> LuxReading:
    stage = open_stage(text, meters_per_unit)
    reading = read_lux(stage.GetPrimAtPath(path))
    assert reading is not None
    return reading


def luminance(color: tuple[float, float, float]) -> float:
    return sum(w * c for w, c in zip(LUMINANCE_WEIGHTS, color, strict=True))


def test_thousand_candela_lamp() -> None:
    # L = I / (pi r^2) = 127,323.95 cd/m2 for 1,000 cd and a radius of 5 cm.
    reading = read(
        """def SphereLight "L" {
            float inputs:intensity = 127323.954
            float inputs:radius = 0.05
        }"""
    )
    assert reading.kind == "sphere"
    assert reading.intensity == pytest.approx((1000.0,) * 3, rel=FLOAT32)
    assert reading.radius == pytest.approx(0.05, rel=FLOAT32)


# The areas by which the schema text divides, and the areas seen from the axis.
SHAPES = {
    "sphere": (
        "SphereLight",
        "float inputs:radius = 0.25",
        lambda s: 4 * math.pi * (0.25 * s) ** 2,
        lambda s: math.pi * (0.25 * s) ** 2,
    ),
    "disk": (
        "DiskLight",
        "float inputs:radius = 0.25",
        lambda s: math.pi * (0.25 * s) ** 2,
        lambda s: math.pi * (0.25 * s) ** 2,
    ),
    "rect": (
        "RectLight",
        "float inputs:width = 0.5\n float inputs:height = 0.125",
        lambda s: 0.5 * 0.125 * s * s,
        lambda s: 0.5 * 0.125 * s * s,
    ),
    "cylinder": (
        "CylinderLight",
        "float inputs:radius = 0.25\n float inputs:length = 2",
        lambda s: 2 * math.pi * 0.25 * 2 * s * s,
        lambda s: 2 * 0.25 * 2 * s * s,
    ),
}


@pytest.mark.parametrize("unit", [1.0, 0.01])
@pytest.mark.parametrize("scale", [1.0, 4.0])
@pytest.mark.parametrize("normalize", [0, 1])
@pytest.mark.parametrize("kind", list(SHAPES))
def test_area_lights(kind: str, normalize: int, scale: float, unit: float) -> None:
    # Candela on the axis = luminance x area seen from there (m2); normalize = 1 divides the
    # luminance by the whole world-space area in scene units.
    schema, size, surface, seen = SHAPES[kind]
    reading = read(
        f"""def Xform "X" {{
            double3 xformOp:translate = (3, 4, 5)
            float3 xformOp:scale = ({scale}, {scale}, {scale})
            float3 xformOp:rotateXYZ = (20, 30, 40)
            uniform token[] xformOpOrder = [
                "xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]
            def {schema} "L" {{
                float inputs:intensity = 300
                bool inputs:normalize = {normalize}
                {size}
            }}
        }}""",
        unit,
        "/X/L",
    )
    nits = 300.0 / surface(scale) if normalize else 300.0
    assert reading.kind == kind
    assert reading.intensity == pytest.approx((nits * seen(scale) * unit**2,) * 3, rel=FLOAT32)
    radius = 0.0 if kind == "rect" else 0.25 * scale * unit
    assert reading.radius == pytest.approx(radius, rel=FLOAT32)


def test_area_under_non_uniform_scale() -> None:
    # A rectangle and a disk have an exact area under any transform; the scale along the axis is
    # nothing to them. A sphere keeps its volume: 2 x 3 x 36 = 6^3.
    text = """def Xform "X" {{
        float3 xformOp:scale = (2, 3, 36)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        def {} "L" {{ }}
    }}"""
    rect = read(text.format("RectLight"), path="/X/L")  # 1 x 1, 1 nit
    assert rect.intensity == pytest.approx((6.0,) * 3)
    disk = read(text.format("DiskLight"), path="/X/L")  # radius 0.5
    assert disk.intensity == pytest.approx((6.0 * math.pi / 4,) * 3)
    sphere = read(text.format("SphereLight"), path="/X/L")
    assert sphere.radius == pytest.approx(3.0)


def test_cylinder_mean_intensity_is_a_quarter_of_its_surface() -> None:
    # Cauchy: seen from all directions alike, a convex body's area is a quarter of its surface.
    # The sides at an angle t to the axis look like 2 r l sin t, and sin t has a mean of pi / 4.
    reading = read('def CylinderLight "L" {\n float inputs:radius = 0.25\n}')
    assert reading.intensity[0] * math.pi / 4 == pytest.approx(2 * math.pi * 0.25 * 1.0 / 4)


@pytest.mark.parametrize(
    ("angle", "normalize", "lux"),
    [
        (0.0, 0, 7.0),  # a disc of no size: the number itself
        (0.0, 1, 7.0),
        (0.53, 1, 7.0),
        (0.53, 0, 7.0 * math.pi * math.sin(math.radians(0.265)) ** 2),
        (60.0, 0, 7.0 * math.pi / 4),  # sin^2(30 deg)
        (180.0, 0, 7.0 * math.pi),  # half the world
        (360.0, 0, 7.0 * math.pi),  # all of it: the plane sees half
        (270.0, 1, 7.0 / 1.5),  # sizeFactor (2 - sin^2(135 deg)) pi, of which the plane sees pi
    ],
)
def test_distant_light(angle: float, normalize: int, lux: float) -> None:
    reading = read(
        f'def DistantLight "L" {{\n float inputs:angle = {angle}\n float inputs:intensity = 7\n'
        f" bool inputs:normalize = {normalize}\n}}",
        meters_per_unit=0.01,
    )
    assert reading.intensity == pytest.approx((lux,) * 3, rel=FLOAT32)
    assert (reading.kind, reading.radius) == ("distant", 0.0)


@pytest.mark.parametrize("schema", ["DomeLight", "DomeLight_1"])
@pytest.mark.parametrize("normalize", [0, 1])
def test_dome_light(schema: str, normalize: int) -> None:
    # E = pi L under an unobstructed sky; normalize is ignored.
    reading = read(
        f"""def {schema} "L" {{
            float inputs:intensity = 100
            bool inputs:normalize = {normalize}
        }}"""
    )
    assert reading.kind == "dome"
    assert reading.intensity == pytest.approx((314.159265,) * 3, rel=1e-8)


def test_exposure_doubles_and_colour_multiplies() -> None:
    plain = read('def SphereLight "L" { }').intensity[0]
    reading = read(
        'def SphereLight "L" {\n float inputs:exposure = -3\n color3f inputs:color = (1, 0.5, 4)\n}'
    )
    assert reading.intensity == pytest.approx((plain / 8, plain / 16, plain / 2))


@pytest.mark.parametrize("kelvin", [1000, 2700, 6500, 10000])
def test_colour_temperature_keeps_the_luminance(kelvin: int) -> None:
    # UsdLuxBlackbodyTemperatureAsRgb is scaled to Y = 1; its float32 weights are rounded at 1e-7.
    text = (
        'def SphereLight "L" {{\n float inputs:colorTemperature = {}\n'
        " bool inputs:enableColorTemperature = {}\n}}"
    )
    off = read(text.format(kelvin, 0)).intensity
    on = read(text.format(kelvin, 1)).intensity
    assert luminance(off) == pytest.approx(off[0])
    assert luminance(on) == pytest.approx(off[0], rel=1e-6)
    if kelvin < 6500:
        assert on[0] > on[1] > on[2]


def test_connected_input_is_read_at_its_source() -> None:
    stage = open_stage(
        """
        def Material "M" {
            float inputs:nits = 12
            float outputs:pass.connect = </M.inputs:nits>
        }
        def Shader "Picture" {
            color3f outputs:rgb
        }
        def SphereLight "L" {
            float inputs:intensity.connect = </M.outputs:pass>
            float inputs:exposure.connect = </Nobody.inputs:exposure>
            color3f inputs:color = (0.5, 0.5, 0.5)
            color3f inputs:color.connect = </Picture.outputs:rgb>
        }
        """
    )
    reading = read_lux(stage.GetPrimAtPath("/L"))
    # 12 nits from the interface, the light's own colour in place of the picture's.
    assert reading is not None
    assert reading.intensity == pytest.approx((6.0 * math.pi / 4,) * 3)


@pytest.mark.parametrize("length", [1, 100])
def test_endless_connections_leave_the_own_value(length: int) -> None:
    # A circle of two, and one of many: no file makes the search deep or endless.
    stage = Usd.Stage.CreateInMemory()
    with Sdf.ChangeBlock():
        for i in range(length + 1):
            spec = Sdf.CreatePrimInLayer(stage.GetRootLayer(), f"/L{i}")
            spec.specifier, spec.typeName = Sdf.SpecifierDef, "SphereLight"
            attribute = Sdf.AttributeSpec(spec, "inputs:intensity", Sdf.ValueTypeNames.Float)
            attribute.default = 4.0 if i == 0 else 9.0
            nxt = f"/L{i + 1 if i < length else 0}.inputs:intensity"
            attribute.connectionPathList.explicitItems = [nxt]
    reading = read_lux(stage.GetPrimAtPath("/L0"), meters_per_unit=1.0)
    assert reading is not None
    assert reading.intensity == pytest.approx((4.0 * math.pi / 4,) * 3)


def test_time_samples_and_given_frame() -> None:
    stage = open_stage(
        """def SphereLight "L" {
            float inputs:intensity.timeSamples = { 0: 10, 10: 30 }
        }"""
    )
    light = stage.GetPrimAtPath("/L")
    reading = read_lux(light, Usd.TimeCode(5))
    assert reading is not None
    assert reading.intensity[1] == pytest.approx(20.0 * math.pi / 4)
    twice = read_lux(light, Usd.TimeCode(5), world=Gf.Matrix4d().SetScale(2.0), meters_per_unit=0.1)
    assert twice is not None
    assert twice.radius == pytest.approx(0.1)
    assert twice.intensity[1] == pytest.approx(20.0 * math.pi * 0.01)


def test_what_is_a_light() -> None:
    stage = open_stage(
        """
        def Mesh "Mesh" { }
        def Mesh "Glowing" (prepend apiSchemas = ["MeshLightAPI"]) { }
        def Scope "Scope" (prepend apiSchemas = ["LightAPI"]) { }
        def PortalLight "Portal" { }
        def SphereLight "Bulb" { }
        """
    )
    lights = [p.GetName() for p in stage.Traverse() if is_light(p)]
    assert lights == ["Glowing", "Scope", "Portal", "Bulb"]
    assert read_lux(stage.GetPrimAtPath("/Mesh")) is None
    assert not is_light(Usd.Prim())
    for name in ("Glowing", "Scope", "Portal"):
        assert read_lux(stage.GetPrimAtPath(f"/{name}")) == LuxReading((0.0,) * 3, "other", 0.0)


def test_broken_numbers_come_through_and_nothing_raises() -> None:
    stage = open_stage(
        """
        def SphereLight "Nan" {
            float inputs:intensity = nan
        }
        def SphereLight "Hot" {
            float inputs:colorTemperature = nan
            bool inputs:enableColorTemperature = 1
        }
        def SphereLight "Bright" {
            float inputs:exposure = 2000
        }
        def SphereLight "Dark" {
            float inputs:exposure = -inf
        }
        def SphereLight "Text" {
            string inputs:intensity = "5"
        }
        def SphereLight "Tint" {
            float inputs:color = 1
        }
        def DistantLight "Angle" {
            float inputs:angle = nan
        }
        def SphereLight "Flat" {
            float3 xformOp:scale = (0, nan, 1)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }
        """
    )
    for name in ("Nan", "Hot", "Text", "Tint", "Angle", "Flat"):
        reading = read_lux(stage.GetPrimAtPath(f"/{name}"))
        assert reading is not None
        assert math.isnan(reading.intensity[0]), name
    bright, dark = (read_lux(stage.GetPrimAtPath(f"/{name}")) for name in ("Bright", "Dark"))
    assert bright is not None
    assert dark is not None
    assert bright.intensity[0] == math.inf
    assert dark.intensity[0] == 0.0


def told(light: dict, unit: str) -> tuple[float, float, float]:
    """Candela or lux per channel of a light in the words of the truth set."""
    match light["type"]:
        case "point" | "spot":
            return tuple(light["intensity_rgb_cd"])
        case "photometric file":
            return tuple(light["multiplier"] * c for c in light["color"])
        case "distant":
            return tuple(light["illuminance_rgb"])
        case "ambient":
            return (light["illuminance_lux"],) * 3
        case "dome":
            return (light["luminance_nits"] * math.pi,) * 3
        case "rect area light":
            area = light["width_m"] * light["height_m"]
        case "disk area light" | "sphere area light":
            area = math.pi * light["radius_m"] ** 2
        case _:
            raise AssertionError(f"{unit}: a light of type {light['type']}")
    return tuple(area * c for c in light["luminance_rgb"])


def test_truth_set_lights() -> None:
    root = os.environ.get("HDRUSD_TESTDATA")
    if not root:
        pytest.skip("HDRUSD_TESTDATA is not set")
    seen = 0
    for words in sorted(Path(root, "truth", "stages").glob("*.lights.json")):
        case = json.loads(words.read_text())
        stage = Usd.Stage.Open(str(words.with_name(case["stage"])))
        assert UsdGeom.GetStageMetersPerUnit(stage) == case["meters_per_unit"]
        for light in case["lights"]:
            if "file" in light and light["type"] == "dome":
                continue  # its texture gives the luminance
            prim = stage.GetPrimAtPath(light["prim"])
            reading = read_lux(prim, Usd.TimeCode(0))
            assert reading is not None
            # 1e-5: both files are written with seven to eight digits.
            assert reading.intensity == pytest.approx(told(light, words.name), rel=1e-5), words.name
            if "radius_m" in light:
                assert reading.radius == pytest.approx(light["radius_m"], rel=1e-6)
            assert isinstance(UsdLux.LightAPI(prim).GetIntensityAttr().Get(), float)
            seen += 1
    assert seen >= 30
