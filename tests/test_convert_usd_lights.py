"""Convert a stage: its lights in candela and lux, by the letter of UsdLux or by somebody's word."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import pytest
from converted import opened, run, sidecar
from overlaid import HEAD, lamp, stage_file
from pxr import Sdf, Usd

from hdrusd.conversion import Result
from hdrusd.usd.lux import read_lux

#: Relative: intensity and candela are float32, each rounded once; so are the inputs of the test.
CLOSE = 4 * 2.0**-24


def convert(tmp_path: Path, *lights: str, toml: str = "", head: str = HEAD) -> Result:
    # USD keeps layers by their paths, so each conversion has a folder of its own.
    folder = tmp_path / f"{len(list(tmp_path.iterdir()))}"
    source = stage_file(folder / "town.usda", *lights, head=head)
    for file in tmp_path.glob("*.ies"):
        shutil.copy(file, folder)
    sidecar(folder, toml)
    return run(source, folder / "night.usda")


def light(result: Result, name: str = "Lamp") -> Usd.Prim:
    return opened(result).GetPrimAtPath(f"/World/{name}")


def get(prim: Usd.Prim, name: str) -> Any:
    return prim.GetAttribute(name).Get()


# Closed forms of the text of UsdLux: I = L pi r^2 of a ball; L A of a face seen from its axis;
# 2 r l L of a tube; normalize divides by 4 pi r^2, pi r^2, w h and 2 pi r l. E = L pi
# sin^2(a/2) of a disc in the sky.
LETTER = [
    ("SphereLight", "intensity = 1000, radius = 0.1", 1000 * math.pi * 0.01),
    ("SphereLight", "intensity = 100, radius = 0.1, exposure = 3", 800 * math.pi * 0.01),
    ("SphereLight", "intensity = 40, radius = 0.1, normalize = 1", 40 / 4),
    ("DiskLight", "intensity = 500, radius = 0.2", 500 * math.pi * 0.04),
    ("DiskLight", "intensity = 500, radius = 0.2, normalize = 1", 500.0),
    ("RectLight", "intensity = 300, width = 2, height = 0.5", 300.0),
    ("RectLight", "intensity = 300, width = 2, height = 0.5, normalize = 1", 300.0),
    ("CylinderLight", "intensity = 50, radius = 0.02, length = 1.5", 50 * 2 * 0.02 * 1.5),
    ("CylinderLight", "intensity = 50, radius = 0.02, length = 1.5, normalize = 1", 50 / math.pi),
    (
        "DistantLight",
        "intensity = 50000, angle = 0.53",
        50000 * math.pi * math.sin(math.radians(0.265)) ** 2,
    ),
    ("DistantLight", "intensity = 10, angle = 0.53, normalize = 1", 10.0),
    ("DomeLight", "intensity = 2", 2 * math.pi),
]


def inputs(text: str) -> str:
    kinds = {"normalize": "bool"}
    pairs = (part.split(" = ") for part in text.split(", "))
    return "\n".join(f"{kinds.get(name, 'float')} inputs:{name} = {value}" for name, value in pairs)


@pytest.mark.parametrize(("kind", "text", "strength"), LETTER)
def test_a_light_says_what_the_letter_of_usdlux_says(
    tmp_path: Path, kind: str, text: str, strength: float
) -> None:
    result = convert(tmp_path, lamp(kind, inputs(text)))
    prim = light(result)
    local = kind not in ("DistantLight", "DomeLight")
    name = "luminousIntensity" if local else "illuminance"
    assert get(prim, f"inputs:photometric:{name}") == pytest.approx(strength, rel=CLOSE)
    # The plain inputs mean the same to everybody: nits of an area that is not divided by.
    assert get(prim, "inputs:normalize") is False
    assert get(prim, "inputs:exposure") == 0.0
    reading = read_lux(prim)
    assert reading is not None
    assert reading.intensity == pytest.approx((strength,) * 3, rel=CLOSE)
    assert get(prim, "photometric:provenance") == "authored"
    assert get(prim, "photometric:rule") == "UsdLux 25.05, nits"
    (row,) = result.lights
    assert row["value"] == pytest.approx(strength, rel=CLOSE)
    assert (row["unit"], row["confidence"]) == ("cd" if local else "lx", "low")
    assert result.report.codes() == {"usd-light-unit"}


def test_type_size_and_place_are_the_source_s(tmp_path: Path) -> None:
    inside = "float inputs:radius = 0.3\ndouble3 xformOp:translate = (1, 2, 3)\n"
    inside += 'uniform token[] xformOpOrder = ["xformOp:translate"]'
    result = convert(tmp_path, lamp("DiskLight", inside))
    layer = Sdf.Layer.FindOrOpen(str(result.output.with_suffix(".photometry.usda")))
    spec = layer.GetPrimAtPath("/World/Lamp")
    assert (spec.specifier, spec.typeName) == (Sdf.SpecifierOver, "")
    said = {name.removeprefix("inputs:") for name in map(str, spec.attributes.keys())}
    assert said == {
        "intensity",
        "color",
        "photometric:luminousIntensity",
        "photometric:provenance",
        "photometric:rule",
    }


def test_colour_goes_into_the_hue_and_its_luminance_into_the_strength(tmp_path: Path) -> None:
    inside = "float inputs:intensity = 100\nfloat inputs:radius = 0.1\n"
    inside += "color3f inputs:color = (2, 1, 0.5)\nbool inputs:enableColorTemperature = 0"
    prim = light(convert(tmp_path, lamp("SphereLight", inside)))
    y = 0.2126 * 2 + 0.7152 * 1 + 0.0722 * 0.5  # Rec. 709, to 4 digits as everywhere in hdrusd
    stated = get(prim, "inputs:photometric:luminousIntensity")
    assert stated == pytest.approx(math.pi * y, rel=1e-4)
    hue = get(prim, "inputs:color")
    assert tuple(hue) == pytest.approx((2 / y, 1 / y, 0.5 / y), rel=1e-4)


def test_a_lamp_that_blinks_blinks_in_candela(tmp_path: Path) -> None:
    inside = "float inputs:intensity.timeSamples = { 0: 0, 10: 1000, 12: 250 }\n"
    inside += "float inputs:radius = 0.1"
    toml = '[[light]]\nmatch = "Blinker"\ncandela = 80\n'
    first, second = (lamp("SphereLight", inside, name) for name in ("Lamp", "Blinker"))
    result = convert(tmp_path, first, second, toml=toml)
    for name, peak in (("Lamp", 1000 * math.pi * 0.01), ("Blinker", 80.0)):
        stated = light(result, name).GetAttribute("inputs:photometric:luminousIntensity")
        values = {time: stated.Get(time) for time in stated.GetTimeSamples()}
        assert values == pytest.approx({0: 0.0, 10: peak, 12: peak / 4}, rel=CLOSE)


def test_what_varies_on_no_straight_line_is_right_between_its_samples(tmp_path: Path) -> None:
    """2^exposure is 32 halfway from 0 to 10 stops; red to green has both halves halfway."""
    fixed = "float inputs:radius = 0.1\nfloat inputs:intensity = 1\n"
    stops = lamp("SphereLight", f"{fixed}float inputs:exposure.timeSamples = {{ 0: 0, 10: 10 }}")
    hues = "color3f inputs:color.timeSamples = { 0: (1, 0, 0), 4: (0, 1, 0) }"
    grows = "float inputs:intensity = 1\nfloat inputs:radius.timeSamples = { 0: 1, 2: 3 }"
    lamps = stops, lamp("SphereLight", fixed + hues, "Hue"), lamp("SphereLight", grows, "Grows")
    result = convert(tmp_path, *lamps)
    assert [f.code for f in result.report].count("usd-light-resampled") == 3
    for code in range(11):
        nits = light(result).GetAttribute("inputs:intensity").Get(code)
        assert nits == pytest.approx(2.0**code, rel=CLOSE)
    hue = light(result, "Hue")
    nits, color = (hue.GetAttribute(f"inputs:{name}").Get(2) for name in ("intensity", "color"))
    assert tuple(nits * channel for channel in color) == pytest.approx((0.5, 0.5, 0.0), rel=CLOSE)
    candela = light(result, "Grows").GetAttribute("inputs:photometric:luminousIntensity")
    assert candela.Get(1) == pytest.approx(4.0 * math.pi, rel=CLOSE)


def test_time_codes_are_those_of_a_source_with_another_rate(tmp_path: Path) -> None:
    """Layers that differ in timeCodesPerSecond would have their time stretched."""
    head = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 1\n    upAxis = "Z"\n'
    head += "    timeCodesPerSecond = 60\n    startTimeCode = 0\n    endTimeCode = 120\n)\n"
    inside = "float inputs:intensity.timeSamples = { 0: 1, 120: 1000 }\nfloat inputs:radius = 1"
    result = convert(tmp_path, lamp("SphereLight", inside), head=head)
    stage = opened(result)
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (60.0, 120.0)
    assert light(result).GetAttribute("inputs:intensity").GetTimeSamples() == [0.0, 120.0]


def test_a_centimetre_stage_keeps_its_unit(tmp_path: Path) -> None:
    head = (
        '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 0.01\n    upAxis = "Y"\n)\n'
    )
    inside = "float inputs:intensity = 1000\nfloat inputs:radius = 10"
    result = convert(tmp_path, lamp("SphereLight", inside), head=head)
    prim = light(result)
    candela = get(prim, "inputs:photometric:luminousIntensity")
    assert candela == pytest.approx(1000 * math.pi * 0.01, rel=CLOSE)
    assert (get(prim, "inputs:intensity"), get(prim, "inputs:radius")) == (1000.0, 10.0)


def test_units_that_are_not_said_are_usd_s(tmp_path: Path) -> None:
    head = '#usda 1.0\n(\n    defaultPrim = "World"\n)\n'
    inside = "float inputs:intensity = 1000\nfloat inputs:radius = 10"
    result = convert(tmp_path, lamp("SphereLight", inside), head=head)
    assert "no-units" in result.report.codes()
    layer = Sdf.Layer.FindOrOpen(str(result.output))
    stated = [layer.pseudoRoot.GetInfo(name) for name in ("metersPerUnit", "upAxis")]
    assert stated == [0.01, "Y"]


def test_a_unit_that_is_told_counts(tmp_path: Path) -> None:
    head = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 1\n)\n'
    inside = "float inputs:intensity = 1000\nfloat inputs:radius = 10"
    source = stage_file(tmp_path / "town.usda", lamp("SphereLight", inside), head=head)
    result = run(source, tmp_path / "night.usda", source_unit=0.01, up="Z")
    candela = get(light(result), "inputs:photometric:luminousIntensity")
    assert candela == pytest.approx(1000 * math.pi * 0.01, rel=CLOSE)
    layer = Sdf.Layer.FindOrOpen(str(result.output))
    stated = [layer.pseudoRoot.GetInfo(name) for name in ("metersPerUnit", "upAxis")]
    assert stated == [0.01, "Z"]


# -- somebody's word ---------------------------------------------------------------------


def test_the_photometry_file_goes_first(tmp_path: Path) -> None:
    toml = """
[[light]]
match = "Lamp"
candela = 3200
radius = 0.2
sp_ratio = 0.6
color = [1, 0.5, 0.25]
source = "data sheet"
[[light]]
match = "/World/Moon"
illuminance = 0.25
[[light]]
match = "Off"
enabled = false
"""
    result = convert(
        tmp_path,
        lamp("SphereLight", inputs("intensity = 1, radius = 0.1, exposure = 2, normalize = 1")),
        lamp("DistantLight", inputs("intensity = 1, angle = 0.5"), "Moon"),
        lamp("SphereLight", inputs("intensity = 1, radius = 0.1"), "Off"),
        toml=toml,
    )
    prim = light(result)
    assert get(prim, "inputs:photometric:luminousIntensity") == 3200.0
    assert get(prim, "inputs:radius") == pytest.approx(0.2, rel=CLOSE)
    reading = read_lux(prim)
    assert reading is not None
    assert sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), reading.intensity, strict=True)) == (
        pytest.approx(3200.0, rel=1e-4)
    )
    assert reading.intensity[0] / reading.intensity[2] == pytest.approx(4.0, rel=CLOSE)
    assert get(prim, "inputs:photometric:scotopicPhotopicRatio") == pytest.approx(0.6)
    assert get(prim, "photometric:source") == "data sheet"
    moon = light(result, "Moon")
    assert get(moon, "inputs:photometric:illuminance") == 0.25
    assert get(light(result, "Off"), "visibility") == "invisible"
    assert {row["name"]: row["confidence"] for row in result.lights} == {
        "Lamp": "high",
        "Moon": "medium",
    }


# I = Phi / W: 4 pi of a ball, pi of a matt face, pi^2 of a matt tube square to it.
@pytest.mark.parametrize(
    ("kind", "size", "solid"),
    [
        ("SphereLight", "radius = 0.1", 4 * math.pi),
        ("DiskLight", "radius = 0.1", math.pi),
        ("RectLight", "width = 0.6, height = 0.6", math.pi),
        ("CylinderLight", "radius = 0.02, length = 1.2", math.pi**2),
    ],
)
def test_lumens_become_candela_by_the_shape(
    tmp_path: Path, kind: str, size: str, solid: float
) -> None:
    toml = '[[light]]\nmatch = "Lamp"\nlumens = 4000\n'
    result = convert(tmp_path, lamp(kind, inputs(f"intensity = 1, {size}")), toml=toml)
    prim = light(result)
    stated = get(prim, "inputs:photometric:luminousIntensity")
    assert stated == pytest.approx(4000 / solid, rel=CLOSE)
    assert result.lights[0]["flux_lm"] == pytest.approx(4000, rel=CLOSE)
    assert "ShapingAPI" not in prim.GetAppliedSchemas()


def test_lumens_go_through_the_cone_that_is_there(tmp_path: Path) -> None:
    toml = '[[light]]\nmatch = "Lamp"\nlumens = 4000\n'
    inside = inputs("intensity = 1, radius = 0.1, shaping:cone:angle = 60")
    result = convert(tmp_path, lamp("SphereLight", inside), toml=toml)
    stated = get(light(result), "inputs:photometric:luminousIntensity")
    # W = 2 pi (1 - cos 60 degrees) = pi of a hard cone.
    assert stated == pytest.approx(4000 / math.pi, rel=CLOSE)
    assert get(light(result), "inputs:shaping:cone:angle") == 60.0


def test_a_sky_of_the_photometry_file_takes_the_place_of_domes(tmp_path: Path) -> None:
    toml = "[ambient]\nilluminance = 0.05\n"
    result = convert(tmp_path, lamp("DomeLight", inputs("intensity = 1"), "Sky"), toml=toml)
    stage = opened(result)
    assert get(light(result, "Sky"), "visibility") == "invisible"
    root = stage.GetDefaultPrim()
    assert get(root, "photometric:ambient:illuminance") == pytest.approx(0.05)
    dome = light(result, "Sky_2")
    assert get(dome, "inputs:intensity") == pytest.approx(0.05 / math.pi, rel=CLOSE)
    assert "ambient-replaced" in result.report.codes()


def test_a_node_is_switched_off(tmp_path: Path) -> None:
    toml = '[[node]]\nmatch = "/World/Moon"\nvisible = false\n'
    result = convert(tmp_path, lamp("DistantLight", "", "Moon"), toml=toml)
    assert get(light(result, "Moon"), "visibility") == "invisible"


def test_what_a_stage_says_itself_is_not_asked_of_the_photometry_file(tmp_path: Path) -> None:
    toml = '[[camera]]\nmatch = "Eye"\nfov = 40\n[[light]]\nmatch = "Lamp"\ncandela = 9\n'
    toml += "fixture_shadow = true\n"
    result = convert(tmp_path, lamp("SphereLight", "float inputs:radius = 1"), toml=toml)
    unused = [finding.thing for finding in result.report if finding.code == "usd-rule-unused"]
    assert unused == ["Eye", "Lamp"]
    assert "sidecar-no-match" not in result.report.codes()


def test_ies_takes_the_place_of_cone_and_candela(tmp_path: Path, ies: Path) -> None:
    toml = f'[[light]]\nmatch = "Lamp"\nies = "{ies.name}"\nscale = 2\n'
    inside = inputs("intensity = 1, radius = 0.1") + "\nfloat inputs:shaping:cone:angle = 30"
    result = convert(tmp_path, lamp("SphereLight", inside), toml=toml)
    prim = light(result)
    file = get(prim, "inputs:shaping:ies:file")
    assert Path(file.resolvedPath).read_bytes() == ies.read_bytes()
    assert get(prim, "inputs:shaping:cone:angle") == 180.0
    assert not prim.GetAttribute("inputs:photometric:luminousIntensity").HasAuthoredValue()
    reading = read_lux(prim)
    assert reading is not None
    assert reading.intensity == pytest.approx((2.0,) * 3, rel=CLOSE)


@pytest.fixture
def ies(tmp_path: Path) -> Path:
    """100 cd all round."""
    text = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 10\n0 90 180\n0\n100 100 100\n"
    file = tmp_path / "round.ies"
    file.write_bytes(text.replace("\n", "\r\n").encode())
    return file


# -- writers whose units are known ---------------------------------------------------------

BLENDER = '#usda 1.0\n(\n    doc = "Blender v5.0.1"\n    defaultPrim = "World"\n'
BLENDER += '    metersPerUnit = 1\n    upAxis = "Z"\n)\n'


@pytest.mark.parametrize("metres", ["1", "0.01"])
def test_blender_s_watts_are_told_and_read_when_asked(tmp_path: Path, metres: str) -> None:
    """The 1000 cd of a glTF are 1000 4 pi / 683 W in Blender, which writes W / pi with normalize
    1; a sun of 0.25 lx is 0.25 / 683 W/m2, which it writes over 4. In centimetres it writes
    the same watts, which by the letter are a 10,000th.
    """
    head = BLENDER.replace("metersPerUnit = 1", f"metersPerUnit = {metres}")
    watts = 1000 * 4 * math.pi / 683
    stage = (
        lamp(
            "SphereLight", inputs(f"intensity = {watts / math.pi!r}, radius = 0.1, normalize = 1")
        ),
        lamp(
            "DistantLight",
            inputs(f"intensity = {0.25 / 683 / 4!r}, angle = 0, normalize = 1"),
            "Sun",
        ),
    )
    told = convert(tmp_path, *stage, head=head)
    assert get(light(told), "inputs:photometric:luminousIntensity") == pytest.approx(
        1000 / 683 * float(metres) ** 2, rel=CLOSE
    )
    said = [str(finding) for finding in told.report if finding.code == "usd-light-writer"]
    assert ["1000 cd" in said[0], "0.25 lx" in said[1]] == [True, True]
    assert all('light_unit = "blender-watts"' in text for text in said)
    read = convert(tmp_path, *stage, head=head, toml='[usd]\nlight_unit = "blender-watts"\n')
    candela = get(light(read), "inputs:photometric:luminousIntensity")
    assert candela == pytest.approx(1000, rel=CLOSE)
    lux = get(light(read, "Sun"), "inputs:photometric:illuminance")
    assert lux == pytest.approx(0.25, rel=CLOSE)
    assert "usd-light-writer" not in read.report.codes()


def test_an_unknown_unit_is_refused_with_those_there_are(tmp_path: Path) -> None:
    result = convert(
        tmp_path,
        lamp("SphereLight", inputs("intensity = 1, radius = 0.1")),
        toml='[usd]\nlight_unit = "foot-candles"\n',
    )
    (found,) = [f for f in result.report if f.code == "sidecar-invalid"]
    assert "want nits, blender-watts" in found.text


def test_a_constant_of_a_known_converter_is_told(tmp_path: Path) -> None:
    result = convert(tmp_path, lamp("SphereLight", inputs("intensity = 30000, radius = 0.5")))
    assert result.report.codes() == {"usd-light-unit", "usd-light-writer"}


def test_what_is_no_light_in_closed_form_is_kept(tmp_path: Path) -> None:
    result = convert(
        tmp_path,
        lamp("GeometryLight", inputs("intensity = 5")),
        lamp("SphereLight", inputs("intensity = -5, radius = 0.1"), "Dark"),
    )
    # That the source's own numbers are invalid is said, and no reason to refuse it.
    assert result.report.codes() == {"usd-light-kept", "validation"}
    layer = Sdf.Layer.FindOrOpen(str(result.output.with_suffix(".photometry.usda")))
    assert not layer.rootPrims


def test_lamps_of_an_instancer_are_counted(tmp_path: Path) -> None:
    bulb = lamp("SphereLight", "float inputs:intensity = 100\nfloat inputs:radius = 0.1", "Bulb")
    other = lamp("SphereLight", "float inputs:intensity = 1\nfloat inputs:radius = 0.1", "Other")
    string = f"""def PointInstancer "String"
{{
    rel prototypes = [</World/String/A>, </World/String/B>]
    int[] protoIndices = [0, 1, 0, 0]
    point3f[] positions = [(0, 0, 1), (1, 0, 1), (2, 0, 1), (3, 0, 1)]
    def Xform "A"
    {{
        {bulb}
    }}
    def Xform "B"
    {{
        {other}
    }}
}}"""
    first = run(stage_file(tmp_path / "a.usda", string), tmp_path / "b.usda")
    second = run(first.output, tmp_path / "again" / "c.usda")
    for result in (first, second):
        rows = {row["name"]: row for row in result.lights}
        assert (rows["Bulb"]["lamps"], rows["Other"]["lamps"]) == (3, 1)
        # I = L pi r^2 and Phi = 4 pi I of each.
        assert rows["Bulb"]["flux_lm"] == pytest.approx(
            4 * math.pi * 100 * math.pi * 0.01, rel=1e-5
        )
