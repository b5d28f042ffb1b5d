"""The validators: for each one a stage that passes, and stages that fail for exactly its reason."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pxr import Sdf, Tf, Usd, UsdValidation

from hdrusd import validation
from hdrusd.schemas import PLUGIN_DIR
from hdrusd.validation import BUILT_IN, Problem, validate

METRES = '(defaultPrim = "World"\n metersPerUnit = 1\n upAxis = "Z")'

#: 1000 cd of a sphere of radius 0.05 m: 1000 / (pi 0.05^2) nits.
NITS = 1000.0 / (math.pi * 0.05**2)


def open_stage(text: str, head: str = METRES) -> Usd.Stage:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(f"#usda 1.0\n{head}\n{text}")
    return Usd.Stage.Open(layer)


def world(text: str, apis: str = "") -> Usd.Stage:
    return open_stage(f'def Xform "World" ({apis})\n{{\n{text}\n}}')


def light(kind: str, inputs: str, apis: str = '"HdrusdPhotometricLightAPI"') -> Usd.Stage:
    return world(f'def {kind}Light "Lamp" (prepend apiSchemas = [{apis}])\n{{\n{inputs}\n}}')


def found(stage: Usd.Stage) -> list[tuple[str, str, str]]:
    return [(problem.severity, problem.validator, problem.path) for problem in validate(stage)]


def only(stage: Usd.Stage) -> Problem:
    problems = validate(stage)
    assert len(problems) == 1, problems
    return problems[0]


# What USD knows of the validators.


def test_metadata_names_types_that_exist() -> None:
    # A name that is no type, such as a schema's identifier, keeps the validator from ever
    # running, and nothing complains.
    registry = UsdValidation.ValidationRegistry()
    metadata = registry.GetValidatorMetadataForKeyword("hdrusd")
    assert {entry.name for entry in metadata} == {
        f"hdrusd.validation:{name}"
        for name in ("StageUnits", "LightIntensity", "MaterialReflectance", "AmbientLight")
    }
    for entry in metadata:
        assert entry.doc.endswith(".")
        for name in entry.GetSchemaTypes():
            assert Tf.Type.FindByName(name) != Tf.Type.Unknown, name


def test_built_in_validators_exist() -> None:
    metadata = UsdValidation.ValidationRegistry().GetAllValidatorMetadata()
    assert set(BUILT_IN) <= {entry.name for entry in metadata}


def test_usd_loads_the_module_when_it_is_asked() -> None:
    code = (
        "import sys\n"
        "from pxr import Usd, UsdValidation\n"
        "stage = Usd.Stage.CreateInMemory()\n"
        "registry = UsdValidation.ValidationRegistry()\n"
        "known = len(registry.GetValidatorMetadataForKeyword('hdrusd'))\n"
        "early = 'hdrusd.validation' in sys.modules\n"
        "errors = UsdValidation.ValidationContext(['hdrusd'], True).Validate(stage)\n"
        "print(known, early, sorted(error.GetName() for error in errors))"
    )
    environment = os.environ | {"PXR_PLUGINPATH_NAME": str(PLUGIN_DIR)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.strip() == "4 False ['MissingMetersPerUnit', 'MissingUpAxis']"


def test_too_late_is_an_error() -> None:
    # Validators are listed once; register() in a process that listed them before cannot help.
    code = (
        "from pxr import UsdValidation\n"
        "UsdValidation.ValidationRegistry().GetAllValidatorMetadata()\n"
        "from hdrusd.errors import SchemaRegistrationError\n"
        "try:\n"
        "    from hdrusd.validation import validate\n"
        "except SchemaRegistrationError as error:\n"
        "    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "import hdrusd.usd first" in done.stdout


# StageUnits


def test_units_pass() -> None:
    assert found(world("")) == []


@pytest.mark.parametrize(
    ("head", "text"),
    [
        ('(defaultPrim = "World"\n upAxis = "Z")', "no metersPerUnit"),
        ('(defaultPrim = "World"\n metersPerUnit = 0\n upAxis = "Z")', "metersPerUnit 0;"),
        ('(defaultPrim = "World"\n metersPerUnit = -1\n upAxis = "Z")', "metersPerUnit -1;"),
        ('(defaultPrim = "World"\n metersPerUnit = inf\n upAxis = "Z")', "metersPerUnit inf;"),
        ('(defaultPrim = "World"\n metersPerUnit = nan\n upAxis = "Z")', "metersPerUnit nan;"),
        ('(defaultPrim = "World"\n metersPerUnit = 1)', "no upAxis"),
    ],
)
def test_units_fail(head: str, text: str) -> None:
    problem = only(open_stage('def Xform "World" { }', head))
    assert (problem.severity, problem.validator, problem.path) == ("error", "StageUnits", "/")
    assert text in problem.text


def test_usd_itself_asks_for_a_default_prim() -> None:
    problem = only(open_stage('def Xform "World" { }', '(metersPerUnit = 1\n upAxis = "Z")'))
    assert problem.validator == "usdValidation:StageMetadataChecker"
    assert "defaultPrim" in problem.text


# LightIntensity

AGREEING = {
    # Closed forms of the same number, for the radius, width and so on beside them.
    "Sphere": (
        f"float inputs:intensity = {NITS}\n float inputs:radius = 0.05\n"
        " float inputs:photometric:luminousIntensity = 1000"
    ),
    "Disk": (  # 100 nits of pi 0.5^2 m2
        "float inputs:intensity = 100\n float inputs:radius = 0.5\n"
        f" float inputs:photometric:luminousIntensity = {25 * math.pi}"
    ),
    "Rect": (  # 100 nits of 2 x 3 m
        "float inputs:intensity = 100\n float inputs:width = 2\n float inputs:height = 3\n"
        " float inputs:photometric:luminousIntensity = 600"
    ),
    "Cylinder": (  # 100 nits of 0.2 x 3 m seen from the side
        "float inputs:intensity = 100\n float inputs:radius = 0.1\n float inputs:length = 3\n"
        " float inputs:photometric:luminousIntensity = 60"
    ),
    "Distant": (  # 100 nits of pi sin^2(30 deg) sr
        "float inputs:intensity = 100\n float inputs:angle = 60\n"
        f" float inputs:photometric:illuminance = {25 * math.pi}"
    ),
    "Dome": (
        f"float inputs:intensity = 100\n float inputs:photometric:illuminance = {100 * math.pi}"
    ),
}


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


# MaterialReflectance


def material(inputs: str = "", own: str = "", extra: str = "") -> Usd.Stage:
    return world(
        f"""def Material "M" (prepend apiSchemas = ["HdrusdPhotometricMaterialAPI"])
        {{
            token outputs:surface.connect = </World/M/Surface.outputs:surface>
            {own}
            def Shader "Surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
                {inputs}
                token outputs:surface
            }}
            {extra}
        }}"""
    )


def test_sound_material_passes() -> None:
    stage = material(
        "color3f inputs:diffuseColor = (0, 0.5, 1)\n color3f inputs:specularColor = (1, 1, 1)\n"
        " color3f inputs:emissiveColor = (500, 500, 500)",
        "uniform float photometric:gamma = 2.2\n uniform color3f photometric:diffuse = (1, 1, 0)\n"
        " float photometric:luminance = 500\n uniform float legacy:shininess = 0",
    )
    assert found(stage) == []


@pytest.mark.parametrize(
    ("inputs", "own", "text"),
    [
        ("color3f inputs:diffuseColor = (0, 1.01, 0)", "", "diffuseColor 0, 1.01, 0"),
        ("color3f inputs:diffuseColor = (0, -0.01, 0)", "", "diffuseColor"),
        ("color3f inputs:specularColor = (nan, 0, 0)", "", "specularColor nan"),
        ("color3f inputs:emissiveColor = (-1, 0, 0)", "", "emissiveColor -1"),
        ("color3f inputs:emissiveColor = (inf, 0, 0)", "", "emissiveColor inf"),
        ("", "uniform color3f photometric:diffuse = (2, 0, 0)", "photometric:diffuse 2"),
        ("", "uniform float photometric:gamma = 0", "photometric:gamma 0; want above 0"),
        ("", "uniform float photometric:gamma = nan", "photometric:gamma nan"),
        ("", "uniform float legacy:shininess = -1", "legacy:shininess -1"),
        ("", "float photometric:luminance = -1", "photometric:luminance -1"),
        ("", "float photometric:luminance = 5", "5 cd/m2, but emissiveColor has 0 cd/m2; want"),
        (
            "color3f inputs:emissiveColor = (10, 10, 10)",
            "float photometric:luminance = 10.02",
            "10.02 cd/m2, but emissiveColor has 10 cd/m2",
        ),
    ],
)
def test_unsound_material(inputs: str, own: str, text: str) -> None:
    problem = only(material(inputs, own))
    assert (problem.severity, problem.validator) == ("error", "MaterialReflectance")
    assert problem.path == "/World/M"
    assert text in problem.text


def test_emission_agrees_by_luminance() -> None:
    # (1000, 0, 0) has 212.6 cd/m2.
    red = "color3f inputs:emissiveColor = (1000, 0, 0)"
    assert found(material(red, "float photometric:luminance = 212.6")) == []


def glowing(luminance: float, inputs: str, node: str = "UsdUVTexture") -> Usd.Stage:
    return material(
        "color3f inputs:emissiveColor = (1, 1, 1)\n"
        " color3f inputs:emissiveColor.connect = </World/M/Picture.outputs:rgb>",
        f"float photometric:luminance = {luminance}",
        f'def Shader "Picture" {{\n uniform token info:id = "{node}"\n {inputs}\n'
        " float3 outputs:rgb\n}",
    )


@pytest.mark.parametrize(
    ("luminance", "inputs"),
    [
        (300.0, "float4 inputs:scale = (300, 300, 300, 1)"),
        (212.6, "float4 inputs:scale = (1000, 0, 0, 0.5)"),  # the luminance of red
        (1.0, ""),  # UsdUVTexture's scale is 1 where it is not stated
        (300.0, "float4 inputs:scale = (300.2, 300.2, 300.2, 1)"),  # 0.07 % apart
    ],
)
def test_emissive_texture_agrees_at_its_value_1(luminance: float, inputs: str) -> None:
    assert found(glowing(luminance, inputs)) == []


@pytest.mark.parametrize(
    ("inputs", "text"),
    [
        ("float4 inputs:scale = (300.6, 300.6, 300.6, 1)", "inputs:scale has 300.6 cd/m2; want"),
        ("float4 inputs:scale = (1000, 0, 0, 1)", "inputs:scale has 212.6 cd/m2; want"),
        ("", "300 cd/m2, but Picture.inputs:scale has 1 cd/m2; want"),
        (
            "float4 inputs:scale.timeSamples = { 1: (300, 300, 300, 1), 2: (30, 30, 30, 1) }",
            "inputs:scale has 30 cd/m2 at time 2; want",
        ),
        ("float4 inputs:scale = (-300, 300, 300, 1)", "inputs:scale -300, 300, 300, 1; want 0"),
        ("float4 inputs:scale = (nan, 300, 300, 1)", "inputs:scale nan, 300, 300, 1; want 0"),
        ('string inputs:scale = "bright"', "inputs:scale 'bright'; want 0"),
    ],
)
def test_emissive_texture_disagrees_at_its_value_1(inputs: str, text: str) -> None:
    problem = only(glowing(300.0, inputs))
    expected = ("error", "MaterialReflectance", "/World/M")
    assert (problem.severity, problem.validator, problem.path) == expected
    assert text in problem.text


def test_emission_of_which_1_says_nothing_is_not_compared() -> None:
    biased = "float4 inputs:scale = (5, 5, 5, 1)\n float4 inputs:bias = (1, 1, 1, 0)"
    assert found(glowing(300.0, biased)) == []
    assert found(glowing(300.0, "", "UsdPrimvarReader_float3")) == []


def test_values_of_the_material_interface_are_followed() -> None:
    stage = material(
        "color3f inputs:diffuseColor.connect = </World/M.inputs:paint>",
        "color3f inputs:paint = (3, 3, 3)",
    )
    assert "diffuseColor 3, 3, 3" in only(stage).text


# AmbientLight


def ambient(own: str, dome: str, kind: str = "DomeLight") -> Usd.Stage:
    text = f"""{own}
        rel photometric:ambient:light = </World/Sky>
        def {kind} "Sky"
        {{
            {dome}
        }}"""
    return world(text, 'prepend apiSchemas = ["HdrusdAmbientAPI"]')


def test_ambient_passes() -> None:
    # 10 lx is a dome of 10 / pi nits.
    lux = "float photometric:ambient:illuminance = 10"
    assert found(ambient(lux, f"float inputs:intensity = {10 / math.pi}")) == []
    tint = "color3f photometric:ambient:color = (2, 0.8041, 0)"  # 0.4252 + 0.5751 = 1.0003
    blue = f"float inputs:intensity = {10 / math.pi}\n color3f inputs:color = (2, 0.8041, 0)"
    assert found(ambient(f"{lux}\n{tint}", blue)) == []
    nobody = world(lux, 'prepend apiSchemas = ["HdrusdAmbientAPI"]')
    assert found(nobody) == []


@pytest.mark.parametrize(
    ("own", "dome", "text"),
    [
        (10.0, "float inputs:intensity = 10", "ambient light of 10, 10, 10 lx"),
        (0.0, "float inputs:intensity = 1", "ambient light of 0, 0, 0 lx"),
        (
            10.0,
            f"float inputs:intensity = {10 / math.pi}\n color3f inputs:color = (2, 0.8041, 0)",
            "/World/Sky gives 20, 8.041, 0 lx",
        ),
        (-1.0, "", "photometric:ambient:illuminance -1"),
    ],
)
def test_ambient_fails(own: float, dome: str, text: str) -> None:
    problem = only(ambient(f"float photometric:ambient:illuminance = {own}", dome))
    expected = ("error", "AmbientLight", "/World")
    assert (problem.severity, problem.validator, problem.path) == expected
    assert text in problem.text


def test_ambient_colour_must_have_a_luminance_of_one() -> None:
    own = (
        "float photometric:ambient:illuminance = 1\n"
        " color3f photometric:ambient:color = (0.5, 0.5, 0.5)"
    )
    assert "luminance of 0.5; want 1" in only(ambient(own, "")).text


def test_ambient_needs_one_dome() -> None:
    own = "float photometric:ambient:illuminance = 1"
    assert "want one dome light" in only(ambient(own, "", "RectLight")).text
    gone = ambient(own.replace("= 1", "= 1\n custom rel other"), "")
    rel = gone.GetPrimAtPath("/World").GetRelationship("photometric:ambient:light")
    rel.SetTargets([Sdf.Path("/World/Nobody")])
    assert "/World/Nobody; want one dome light" in only(gone).text


def test_textured_dome_is_no_ambient_light(tmp_path: Path) -> None:
    picture = tmp_path / "sky.exr"
    picture.write_bytes(b"")
    stage = ambient(
        "float photometric:ambient:illuminance = 1", f"asset inputs:texture:file = @{picture}@"
    )
    problem = only(stage)
    assert (problem.severity, problem.validator) == ("warning", "AmbientLight")


# A check never raises.


def test_check_that_breaks_down_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("no more")

    monkeypatch.setattr(validation.lux, "read_lux", broken)
    problem = only(light("Sphere", AGREEING["Sphere"]))
    assert problem.severity == "error"
    assert "the check broke down: RuntimeError('no more')" in problem.text


def test_problems_are_sorted_and_said_once() -> None:
    stage = world(
        'def SphereLight "B" { float inputs:intensity = -1\n}\n'
        'def SphereLight "A" { float inputs:intensity = -1\n}\n'
        'def SphereLight "C" { float3 xformOp:scale = (1, 2, 3)\n'
        ' uniform token[] xformOpOrder = ["xformOp:scale"]\n}'
    )
    assert found(stage) == [
        ("error", "LightIntensity", "/World/A"),
        ("error", "LightIntensity", "/World/B"),
        ("warning", "LightIntensity", "/World/C"),
    ]
    assert str(validate(stage)[0]) == "/World/A: inputs:intensity -1; want 0 or more"


def test_lights_in_instances_are_checked() -> None:
    stage = world(
        """def Xform "Post" (
            instanceable = true
            references = </Prototype>
        ) { }"""
    )
    stage.GetRootLayer().ImportFromString(
        stage.GetRootLayer().ExportToString()
        + 'class Xform "Prototype" {\n def SphereLight "Lamp" {\n float inputs:intensity = -1\n}\n}'
    )
    assert found(stage) == [("error", "LightIntensity", "/World/Post/Lamp")]


def test_truth_set_passes() -> None:
    root = os.environ.get("HDRUSD_TESTDATA")
    if not root:
        pytest.skip("HDRUSD_TESTDATA is not set")
    stages = sorted(Path(root, "truth", "stages").glob("*.usda"))
    assert len(stages) >= 24
    assert {path.name: validate(Usd.Stage.Open(str(path))) for path in stages} == {
        path.name: [] for path in stages
    }
