"""The validator of lights: UsdLux inputs against photometry, and unsound numbers."""

from __future__ import annotations

from pathlib import Path

import pytest
from validated import AGREEING, NITS, found, light, only, open_stage, world


@pytest.mark.parametrize("kind", list(AGREEING))
def test_agreeing_lights_pass(kind: str) -> None:
    assert found(light(kind, AGREEING[kind])) == []


@pytest.mark.parametrize(("exposure", "fine"), [(0.001, True), (-0.001, True), (0.002, False)])
@pytest.mark.parametrize("kind", list(AGREEING))
def test_two_thousandths_of_a_stop_are_too_much(kind: str, exposure: float, fine: bool) -> None:
    # 2^0.001 is 0.07 % and passes, 2^0.002 is 0.14 % and does not: the limit is 0.1 %.
    stage = light(kind, f"{AGREEING[kind]}\n float inputs:exposure = {exposure}")
    assert found(stage) == ([] if fine else [("error", "LightIntensity", "/World/Lamp")])


def test_disagreement_names_both_numbers() -> None:
    problem = only(
        light(
            "Sphere",
            "float inputs:intensity = 4\n float inputs:radius = 0.5\n"
            " float inputs:photometric:luminousIntensity = 1000",
        )
    )
    assert "1000 cd, but the UsdLux inputs say 3.14159 cd; want" in problem.text


def test_colour_weighs_by_its_luminance() -> None:
    # Green is 0.7152 of white.
    green = AGREEING["Sphere"].replace("= 1000", "= 715.2") + "\n color3f inputs:color = (0, 1, 0)"
    assert found(light("Sphere", green)) == []
    white = green.replace("(0, 1, 0)", "(1, 1, 1)")
    assert only(light("Sphere", white)).validator == "LightIntensity"


@pytest.mark.parametrize(
    ("inputs", "text"),
    [
        ("float inputs:intensity = nan", "inputs:intensity nan"),
        ("float inputs:intensity = -1", "inputs:intensity -1"),
        ("float inputs:exposure = inf", "inputs:exposure inf"),
        ("color3f inputs:color = (1, -0.5, 1)", "inputs:color 1, -0.5, 1"),
        ("float inputs:colorTemperature = nan", "inputs:colorTemperature nan"),
        ("float inputs:colorTemperature = -6500", "inputs:colorTemperature -6500"),
        ("float inputs:radius = -1", "inputs:radius -1"),
        ("float inputs:photometric:luminousIntensity = -5", "luminousIntensity -5"),
        ("float inputs:photometric:luminousIntensity = inf", "luminousIntensity inf"),
        ("float inputs:photometric:scotopicPhotopicRatio = 0", "scotopicPhotopicRatio 0"),
        ("float inputs:intensity.timeSamples = { 1: 1, 2: nan }", "inputs:intensity nan at time 2"),
        ('string inputs:intensity = "bright"', "inputs:intensity 'bright'"),
    ],
)
def test_unsound_numbers_of_a_light(inputs: str, text: str) -> None:
    problem = only(light("Sphere", inputs))
    assert (problem.severity, problem.validator) == ("error", "LightIntensity")
    assert text in problem.text


def test_negative_exposure_is_sound() -> None:
    assert found(light("Sphere", "float inputs:exposure = -3")) == []


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("Sphere", "illuminance", 5),
        ("Distant", "luminousIntensity", 5),
        ("Dome", "luminousIntensity", 5),
    ],
)
def test_quantity_that_a_light_cannot_have(kind: str, name: str, value: float) -> None:
    problem = only(light(kind, f"float inputs:photometric:{name} = {value}"))
    assert f"{name} has no meaning on a {kind.lower()} light" in problem.text


def test_animated_light_is_compared_at_its_samples() -> None:
    good = (
        f"float inputs:intensity.timeSamples = {{ 0: 0, 5: {NITS} }}\n float inputs:radius = 0.05\n"
        " float inputs:photometric:luminousIntensity.timeSamples = { 0: 0, 5: 1000 }"
    )
    assert found(light("Sphere", good)) == []
    problem = only(light("Sphere", good.replace("5: 1000", "5: 900")))
    assert "900 cd" in problem.text
    assert "at time 5" in problem.text


def test_radius_is_the_one_in_the_world() -> None:
    # A lamp of 5 units under a scale of 2 in a stage of half centimetres: 0.05 m.
    text = f"""def Xform "World" {{
        float3 xformOp:scale = (2, 2, 2)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        def SphereLight "Lamp" (prepend apiSchemas = ["HdrusdPhotometricLightAPI"])
        {{
            float inputs:intensity = {NITS}
            float inputs:radius = 5
            float inputs:photometric:luminousIntensity = 1000
        }}
    }}"""
    head = '(defaultPrim = "World"\n metersPerUnit = 0.005\n upAxis = "Z")'
    assert found(open_stage(text, head)) == []
    assert only(open_stage(text, head.replace("0.005", "0.01"))).validator == "LightIntensity"


def test_normalized_area_in_a_stage_without_metres_is_a_warning() -> None:
    text = 'def {} "World" {{ bool inputs:normalize = 1\n}}'
    head = '(defaultPrim = "World"\n metersPerUnit = 0.01\n upAxis = "Z")'
    problem = only(open_stage(text.format("SphereLight"), head))
    assert (problem.severity, problem.validator) == ("warning", "LightIntensity")
    assert "normalize" in problem.text
    assert found(open_stage(text.format("DistantLight"), head)) == []
    assert found(open_stage(text.format("SphereLight"))) == []


def test_stretched_lamp_is_a_warning() -> None:
    text = """def {} "World" {{
        float3 xformOp:scale = (1, 2, 1)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }}"""
    problem = only(open_stage(text.format("SphereLight")))
    assert problem.severity == "warning"
    assert "non-uniform scale" in problem.text
    assert found(open_stage(text.format("RectLight"))) == []


def test_a_photometric_file_gives_its_own_candela(tmp_path: Path) -> None:
    # The UsdLux inputs are then a factor on the file, not the light's candela.
    profile = tmp_path / "lamp.ies"
    profile.write_text("IESNA:LM-63-2002\n")
    inputs = AGREEING["Sphere"].replace("= 1000", "= 1")
    assert found(light("Sphere", inputs)) != []
    shaped = inputs.replace("float inputs:photometric:luminousIntensity = 1", "")
    assert shaped != inputs
    file = f"asset inputs:shaping:ies:file = @{profile}@"
    apis = '"HdrusdPhotometricLightAPI", "ShapingAPI"'
    assert found(light("Sphere", f"{shaped}\n{file}", apis)) == []
    problem = only(light("Sphere", f"{inputs}\n{file}", apis))
    assert problem.severity == "warning"
    assert "beside a photometric file" in problem.text


def test_lights_that_have_no_closed_form_are_only_checked_for_soundness() -> None:
    mesh = """def Mesh "Glow" (prepend apiSchemas = ["MeshLightAPI", "HdrusdPhotometricLightAPI"])
    {
        float inputs:intensity = 7
        float inputs:photometric:luminousIntensity = 5
    }"""
    assert found(world(mesh)) == []
    problem = only(world(mesh.replace("= 7", "= nan")))
    assert problem.path == "/World/Glow"
