"""The validators: for each one a stage that passes, and stages that fail for exactly its reason."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pxr import Sdf, Tf, Usd, UsdValidation
from validated import AGREEING, found, light, only, open_stage, world

from hdrusd import validation
from hdrusd.checking import BUILT_IN, validate
from hdrusd.schemas import PLUGIN_DIR

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
        "    import hdrusd.validation\n"
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
    def broken(*_: object, **__: object) -> None:
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
