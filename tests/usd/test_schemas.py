"""The schemas: what they promise, and that nobody needs them to read a stage."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade

from hdrusd.schemas import API_SCHEMAS, PLUGIN_DIR, register

register()

#: Every property of the schemas: its type, whether it is uniform, its unit.
CONTRACT = {
    "HdrusdPhotometricLightAPI": {
        "inputs:photometric:luminousIntensity": ("float", False, "cd"),
        "inputs:photometric:illuminance": ("float", False, "lx"),
        "inputs:photometric:scotopicPhotopicRatio": ("float", False, "1"),
        "photometric:provenance": ("token", True, None),
        "photometric:rule": ("string", True, None),
        "photometric:source": ("string", True, None),
        "photometric:confidence": ("token", True, None),
        "photometric:legacy:range": ("float", True, "m"),
        "photometric:legacy:attenuation": ("float3", True, "1, 1/u, 1/u2"),
    },
    "HdrusdPhotometricMaterialAPI": {
        "photometric:gamma": ("float", True, "1"),
        "photometric:diffuse": ("color3f", True, "1"),
        "photometric:sourceTexture": ("asset", True, None),
        "photometric:luminance": ("float", False, "cd/m2"),
        "photometric:hdrTexture": ("asset", True, None),
        "photometric:vertexColor": ("token", True, None),
        "photometric:provenance": ("token", True, None),
        "photometric:rule": ("string", True, None),
        "photometric:source": ("string", True, None),
        "photometric:confidence": ("token", True, None),
        "legacy:specularColor": ("color3f", True, "1"),
        "legacy:shininess": ("float", True, "1"),
        "legacy:ambient": ("color3f", True, "1"),
        "legacy:emission": ("color3f", True, "1"),
    },
    "HdrusdAmbientAPI": {
        "photometric:ambient:illuminance": ("float", False, "lx"),
        "photometric:ambient:color": ("color3f", False, "1"),
        "photometric:ambient:light": ("relationship", True, None),
    },
    "HdrusdEyeAPI": {
        "hdrusd:tonemap:operator": ("token", True, None),
        "hdrusd:tonemap:key": ("float", True, "1"),
        "hdrusd:tonemap:white": ("float", True, "1"),
        "hdrusd:display:peak": ("float", True, "cd/m2"),
        "hdrusd:display:black": ("float", True, "cd/m2"),
    },
}


def definition(name: str) -> Usd.PrimDefinition:
    return Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(name)


def properties() -> list[tuple[str, str]]:
    return [
        (schema, name) for schema in API_SCHEMAS for name in definition(schema).GetPropertyNames()
    ]


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    env = {key: value for key, value in os.environ.items() if key != "PXR_PLUGINPATH_NAME"}
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, env=env | environment)


def test_contract() -> None:
    assert set(CONTRACT) == set(API_SCHEMAS)
    found: dict[str, dict[str, tuple[str, bool, str | None]]] = {name: {} for name in API_SCHEMAS}
    for schema, name in properties():
        spec = definition(schema).GetSchemaPropertySpec(name)
        unit = (definition(schema).GetPropertyMetadata(name, "sdrMetadata") or {}).get("unit")
        kind = str(getattr(spec, "typeName", "relationship"))
        found[schema][name] = (kind, spec.variability == Sdf.VariabilityUniform, unit)
    assert found == CONTRACT


@pytest.mark.parametrize(("schema", "name"), properties())
def test_documented_and_every_number_has_a_unit(schema: str, name: str) -> None:
    # The brief is the first sentence, the only part of the documentation that USD shows.
    brief = definition(schema).GetPropertyDocumentation(name)
    assert brief.endswith(".")
    spec = definition(schema).GetSchemaPropertySpec(name)
    if not isinstance(spec, Sdf.AttributeSpec) or str(spec.typeName) in {
        "token",
        "string",
        "asset",
    }:
        return
    unit = definition(schema).GetPropertyMetadata(name, "sdrMetadata")["unit"]
    assert f"({unit})" in brief


@pytest.mark.parametrize(("schema", "name"), properties())
def test_nothing_has_a_fallback(schema: str, name: str) -> None:
    # What nobody has said must stay distinguishable from what somebody has.
    assert definition(schema).GetAttributeFallbackValue(name) is None


def test_scalars_say_that_they_are_not_negative() -> None:
    for schema, name in properties():
        spec = definition(schema).GetSchemaPropertySpec(name)
        if isinstance(spec, Sdf.AttributeSpec) and str(spec.typeName) == "float":
            limits = definition(schema).GetPropertyMetadata(name, "limits")
            assert limits["hard"]["minimum"] == 0.0, name


def test_light_schema_applies_to_every_light_and_nothing_else() -> None:
    stage = Usd.Stage.CreateInMemory()
    for kind in ("Sphere", "Disk", "Rect", "Cylinder", "Distant", "Dome", "Portal"):
        assert stage.DefinePrim(f"/{kind}", f"{kind}Light").ApplyAPI("HdrusdPhotometricLightAPI")
    mesh = UsdGeom.Mesh.Define(stage, "/Mesh").GetPrim()
    assert not mesh.CanApplyAPI("HdrusdPhotometricLightAPI")
    UsdLux.MeshLightAPI.Apply(mesh)
    assert mesh.CanApplyAPI("HdrusdPhotometricLightAPI")


def test_other_schemas_apply_where_they_belong() -> None:
    stage = Usd.Stage.CreateInMemory()
    prims = {
        "material": UsdShade.Material.Define(stage, "/Material").GetPrim(),
        "settings": UsdRender.Settings.Define(stage, "/Settings").GetPrim(),
        "world": UsdGeom.Xform.Define(stage, "/World").GetPrim(),
    }
    allowed = {
        schema: {name for name, prim in prims.items() if prim.CanApplyAPI(schema)}
        for schema in API_SCHEMAS
    }
    assert allowed == {
        "HdrusdPhotometricLightAPI": set(),
        "HdrusdPhotometricMaterialAPI": {"material"},
        "HdrusdAmbientAPI": {"material", "settings", "world"},
        "HdrusdEyeAPI": {"settings"},
    }


def test_photometric_numbers_are_inputs_of_the_light() -> None:
    stage = Usd.Stage.CreateInMemory()
    light = UsdLux.SphereLight.Define(stage, "/Light")
    assert light.GetPrim().ApplyAPI("HdrusdPhotometricLightAPI")
    names = {
        light_input.GetBaseName()
        for light_input in UsdLux.LightAPI(light).GetInputs(onlyAuthored=False)
    }
    assert {"photometric:luminousIntensity", "photometric:illuminance"} <= names
    attribute = light.GetPrim().GetAttribute("inputs:photometric:luminousIntensity")
    assert not attribute.HasAuthoredValue()
    attribute.Set(5000.0)
    assert attribute.HasAuthoredValue()
    assert attribute.Get() == 5000.0


def test_registering_again_does_nothing() -> None:
    register()
    done = run("from hdrusd.schemas import register as r; r(); r.cache_clear(); r()")
    assert (done.returncode, done.stderr) == (0, "")


def test_registered_by_the_environment() -> None:
    code = (
        "from pxr import Usd; stage = Usd.Stage.CreateInMemory()\n"
        "stage.DefinePrim('/P', 'Xform')\n"
        "from hdrusd.schemas import register; register()\n"
        "assert stage.DefinePrim('/L', 'SphereLight').ApplyAPI('HdrusdPhotometricLightAPI')"
    )
    done = run(code, PXR_PLUGINPATH_NAME=str(PLUGIN_DIR))
    assert (done.returncode, done.stderr) == (0, "")


def test_too_late_says_what_to_do() -> None:
    code = (
        "from pxr import Usd; stage = Usd.Stage.CreateInMemory()\n"
        "stage.DefinePrim('/P', 'Xform')\n"
        "from hdrusd.errors import SchemaRegistrationError\n"
        "from hdrusd.schemas import register\n"
        "try: register()\n"
        "except SchemaRegistrationError as error: print(error)"
    )
    done = run(code)
    assert (done.returncode, done.stderr) == (0, "")
    assert "HdrusdPhotometricLightAPI" in done.stdout
    assert "import hdrusd.usd first" in done.stdout
    assert f"PXR_PLUGINPATH_NAME={PLUGIN_DIR}" in done.stdout


def test_stage_opens_without_the_plug_in(tmp_path: Path) -> None:
    file = tmp_path / "lamp.usda"
    stage = Usd.Stage.CreateNew(str(file))
    light = UsdLux.SphereLight.Define(stage, "/Lamp")
    light.CreateIntensityAttr(636620.0)
    assert light.GetPrim().ApplyAPI("HdrusdPhotometricLightAPI")
    light.GetPrim().GetAttribute("inputs:photometric:luminousIntensity").Set(5000.0)
    light.GetPrim().GetAttribute("photometric:provenance").Set("measured")
    assert light.GetPrim().ApplyAPI("HdrusdAmbientAPI")
    stage.Save()
    code = (
        "import sys\n"
        "from pxr import Usd, UsdLux\n"
        f"stage = Usd.Stage.Open({str(file)!r})\n"
        "lamp = stage.GetPrimAtPath('/Lamp')\n"
        "print(UsdLux.SphereLight(lamp).GetIntensityAttr().Get(), 'hdrusd' in sys.modules)\n"
        "print(lamp.GetAttribute('inputs:photometric:luminousIntensity').Get())\n"
        "print(Usd.SchemaRegistry().FindAppliedAPIPrimDefinition('HdrusdPhotometricLightAPI'))"
    )
    done = run(code)
    assert (done.returncode, done.stderr) == (0, "")
    # The attribute is kept as data; the schema is unknown.
    assert done.stdout.split() == ["636620.0", "False", "5000.0", "None"]


def test_generated_files_are_fresh() -> None:
    pytest.importorskip("jinja2", reason="usdGenSchema needs jinja2")
    script = PLUGIN_DIR / "tools" / "regenerate.py"
    if not script.is_file():
        pytest.skip("schemas/tools is not installed")
    done = subprocess.run([sys.executable, str(script), "--check"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_changed_source_is_noticed(tmp_path: Path) -> None:
    pytest.importorskip("jinja2", reason="usdGenSchema needs jinja2")
    script = PLUGIN_DIR / "tools" / "regenerate.py"
    if not script.is_file():
        pytest.skip("schemas/tools is not installed")
    spec = importlib.util.spec_from_file_location("regenerate", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    source = (PLUGIN_DIR / "hdrusd" / "schema.usda").read_text(encoding="utf-8")
    changed = tmp_path / "schema.usda"
    changed.write_text(
        source.replace("photometric:gamma (", "photometric:delta ("), encoding="utf-8"
    )
    committed = (PLUGIN_DIR / "hdrusd" / "generatedSchema.usda").read_text(encoding="utf-8")
    made = module.generate(changed)["generatedSchema.usda"]
    assert made != committed
    assert "photometric:delta" in made
