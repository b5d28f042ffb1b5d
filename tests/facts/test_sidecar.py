"""photometry.toml: every key, and everything that can be wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from hdrusd.errors import InputError
from hdrusd.photometry.lamp_types import LAMP_TYPES
from hdrusd.photometry.sidecar import Sidecar, read_sidecar
from hdrusd.report import Kind, Report

EVERY_KEY = """
gamma = 1.8
[ambient]
illuminance = 0.25
temperature = 4100
color = [1, 0.8, 0.6]
source = "a lux meter"
provenance = "measured"
[[light]]
match = "lamp_*"
candela = 3200
illuminance = 2
temperature = 2000
color = [1.0, 0.5, 0.1]
sp_ratio = 0.62
radius = 0.1
enabled = true
source = "data sheet"
provenance = "measured"
[[light]]
match = "Road_*"
ies = "road.ies"
lumens = 5600
illuminant = "HP1"
axis = [0, 0.1, -1]
c0 = [-1, 0, 0]
[[light]]
match = "Bulb"
lumens = 800
spread = "lambert"
axis = [0, 0, -1]
[[light]]
match = "Head"
illuminance = 20
distance = 25
[[light]]
match = "Lantern"
watts = 70
lamp = "high-pressure-sodium"
[[light]]
match = "Lantern2"
watts = 70
efficacy = 80.5
[[light]]
match = "Blender"
radiant_watts = 10
efficacy = 250
[[material]]
match = "Lens"
candela = 700
area = 0.02
[[material]]
match = "Panel"
lumens = 700
area = 0.5
[[material]]
match = "Glass"
luminance = 12000
hdr_texture = true
temperature = 2700
color = [1, 1, 1]
diffuse = [0.2, 0.3, 0]
gamma = 2.4
specular = [0.02, 0.02, 0.02]
roughness = 0.3
source = "luminance meter"
provenance = "estimated"
[[camera]]
match = "Driver"
fov = 50
near = 0.5
far = 200
[[node]]
match = "Debug"
visible = false
"""


def read(tmp_path: Path, text: str) -> tuple[Sidecar, Report]:
    path = tmp_path / "photometry.toml"
    path.write_text(text, encoding="utf-8")
    report = Report()
    return read_sidecar(path, report), report


def test_every_key_is_known(tmp_path: Path) -> None:
    sidecar, report = read(tmp_path, EVERY_KEY)
    assert len(report) == 0
    assert sidecar.gamma == 1.8
    assert sidecar.ambient is not None
    assert sidecar.ambient.number("illuminance") == 0.25
    assert (sidecar.ambient.provenance, sidecar.ambient.source) == ("measured", "a lux meter")
    light = sidecar.match("light", "lamp_07")
    assert light is not None
    assert light.number("candela") == 3200.0
    assert light.three("color") == (1.0, 0.5, 0.1)
    assert light.number("radius") == 0.1
    assert light.sp == 0.62
    assert light.values["enabled"] is True
    road = sidecar.match("light", "Road_1")
    assert road is not None
    assert (road.values["ies"], road.number("lumens")) == ("road.ies", 5600.0)
    assert road.sp == 0.56
    assert (road.three("axis"), road.three("c0")) == ((0.0, 0.1, -1.0), (-1.0, 0.0, 0.0))
    material = sidecar.match("material", "Glass")
    assert material is not None
    assert (material.three("specular"), material.number("roughness")) == ((0.02,) * 3, 0.3)
    assert material.values["hdr_texture"] is True
    assert material.three("diffuse") == (0.2, 0.3, 0.0)
    assert material.provenance == "estimated"
    camera = sidecar.match("camera", "Driver")
    assert camera is not None
    assert [camera.number(key) for key in ("fov", "near", "far")] == [50.0, 0.5, 200.0]
    node = sidecar.match("node", "Debug")
    assert node is not None
    assert node.values["visible"] is False
    assert str(material.place) == "photometry.toml:material[3]"
    lantern = sidecar.match("light", "Lantern")
    assert lantern is not None
    assert lantern.lamp is not None
    assert (lantern.lamp.name, lantern.sp) == ("high-pressure-sodium", 0.56)


def test_an_empty_file_says_nothing(tmp_path: Path) -> None:
    sidecar, report = read(tmp_path, "")
    assert (len(report), sidecar.gamma, sidecar.ambient, sidecar.rules) == (0, None, None, [])
    assert sidecar.match("light", "lamp") is None


def test_what_somebody_wrote_down_is_authored_unless_it_says_more(tmp_path: Path) -> None:
    sidecar, _ = read(tmp_path, '[[light]]\nmatch = "a"\ncandela = 1\n')
    assert sidecar.rules[0].provenance == "authored"
    assert sidecar.rules[0].source == ""


@pytest.mark.parametrize(
    ("section", "line", "key"),
    [
        ("light", 'candela = "3200"', "candela"),
        ("light", "candela = -1", "candela"),
        ("light", "candela = nan", "candela"),
        ("light", "candela = inf", "candela"),
        ("light", "candela = true", "candela"),
        ("light", f"candela = 1{'0' * 400}", "candela"),
        ("light", "illuminance = [1]", "illuminance"),
        ("light", "temperature = 0", "temperature"),
        ("light", "temperature = 20000", "temperature"),
        ("light", "radius = 0", "radius"),
        ("light", "sp_ratio = 0", "sp_ratio"),
        ("light", 'illuminant = "SON"', "illuminant"),
        ("light", "illuminant = 1", "illuminant"),
        ("light", "color = [1, 1]", "color"),
        ("light", "color = [1, 1, -1]", "color"),
        ("light", "color = [0, 0, 0]", "color"),
        ("light", 'color = "red"', "color"),
        ("light", "lumens = -1", "lumens"),
        ("light", 'lamp = "sodium"', "lamp"),
        ("light", "lamp = 3", "lamp"),
        ("light", "ies = 3", "ies"),
        ("light", "enabled = 1", "enabled"),
        ("light", "source = 1", "source"),
        ("light", 'provenance = "guess"', "provenance"),
        ("material", "luminance = false", "luminance"),
        ("material", "hdr_texture = 1", "hdr_texture"),
        ("material", "gamma = 0", "gamma"),
        ("material", "diffuse = [1, 2, nan]", "diffuse"),
        ("material", "specular = 0.04", "specular"),
        ("material", "specular = [0.1, 0.1, 1.1]", "specular"),
        ("material", "roughness = 1.5", "roughness"),
        ("material", "shininess = -1", "shininess"),
        ("camera", "fov = 180", "fov"),
        ("camera", "fov = 0", "fov"),
        ("camera", "near = 0", "near"),
        ("camera", "far = -5", "far"),
        ("node", "visible = 0", "visible"),
    ],
)
def test_a_wrong_value_is_left_out_with_a_finding(
    tmp_path: Path, section: str, line: str, key: str
) -> None:
    sidecar, report = read(tmp_path, f'[[{section}]]\nmatch = "x"\n{line}\n')
    (finding,) = report
    assert (finding.kind, finding.code, finding.thing) == (Kind.INVALID, "sidecar-invalid", key)
    assert str(finding.source) == f"photometry.toml:{section}[1]"
    assert "; want " in finding.text
    assert key not in sidecar.rules[0].values


@pytest.mark.parametrize(
    "line", ["scale = -1", "lumens = inf", "axis = [0, 0, 0]", "c0 = [1, 0]", 'c0 = "x"']
)
def test_a_wrong_value_beside_a_photometric_file(tmp_path: Path, line: str) -> None:
    _, report = read(tmp_path, f'[[light]]\nmatch = "x"\nies = "a.ies"\n{line}\n')
    (finding,) = report
    assert (finding.code, finding.thing) == ("sidecar-invalid", line.split()[0])


@pytest.mark.parametrize(
    ("company", "line"),
    [
        ("lumens = 1", 'spread = "square"'),
        ("illuminance = 1", "distance = 0"),
        ('lamp = "led"', "watts = -1"),
        ("watts = 1", "efficacy = 684"),
        ("radiant_watts = 1", "efficacy = 0"),
    ],
)
def test_a_wrong_value_beside_a_strength(tmp_path: Path, company: str, line: str) -> None:
    _, report = read(tmp_path, f'[[light]]\nmatch = "x"\n{company}\n{line}\n')
    assert ("sidecar-invalid", line.split()[0]) in {(f.code, f.thing) for f in report}


def test_an_unknown_lamp_says_which_there_are(tmp_path: Path) -> None:
    _, report = read(tmp_path, '[[light]]\nmatch = "x"\nwatts = 9\nlamp = "neon"\n')
    texts = [finding.text for finding in report if finding.thing == "lamp"]
    assert len(texts) == 1
    for name in LAMP_TYPES:
        assert name in texts[0]


@pytest.mark.parametrize(
    ("section", "lines", "rivals"),
    [
        ("light", ["candela = 1", "lumens = 1"], ["lumens"]),
        ("light", ["candela = 1", "illuminance = 1", "distance = 2"], ["illuminance"]),
        ("light", ["candela = 1", "illuminance = 1"], []),  # of a direction, and of a place
        ("light", ["lumens = 1", "radiant_watts = 1"], ["radiant_watts"]),
        ("light", ["lumens = 1", "watts = 1", 'lamp = "led"'], ["watts"]),
        ("light", ['ies = "a"', "lumens = 1"], []),  # the luminaire's flux
        ("light", ['ies = "a"', "candela = 1", "lumens = 1"], []),  # depends on the file
        ("light", ['ies = "a"', "sp_ratio = 1", 'illuminant = "E"'], ["illuminant"]),
        ("material", ["luminance = 1", "candela = 1"], ["candela"]),
        ("material", ["candela = 1", "lumens = 1", "area = 1"], ["lumens"]),
    ],
)
def test_of_two_that_say_one_thing_the_first_counts(
    tmp_path: Path, section: str, lines: list[str], rivals: list[str]
) -> None:
    _, report = read(tmp_path, "\n".join([f"[[{section}]]", 'match = "x"', *lines]))
    assert [f.thing for f in report if f.code == "sidecar-rival"] == rivals
    assert report.codes() <= {"sidecar-rival"}


@pytest.mark.parametrize(
    ("text", "thing"),
    [
        ('[[light]]\nmatch = "a"\nwatts = 70', "watts"),
        ('[[light]]\nmatch = "a"\ncandela = 1\nspread = "sphere"', "spread"),
        ('[[light]]\nmatch = "a"\ndistance = 25', "distance"),
        ('[[light]]\nmatch = "a"\ncandela = 1\nefficacy = 25', "efficacy"),
        ('[[light]]\nmatch = "a"\ncandela = 1\naxis = [0, 0, 1]', "axis"),
        ('[[material]]\nmatch = "a"\narea = 25', "area"),
        ("[ambient]\nilluminance = 3\naltitude = 2", "altitude"),
        ('[ambient]\npreset = "noon"\nilluminance = 1', "preset"),
    ],
)
def test_what_says_nothing_alone(tmp_path: Path, text: str, thing: str) -> None:
    _, report = read(tmp_path, text)
    assert [(f.code, f.thing) for f in report] == [("sidecar-invalid", thing)]


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        ("gama = 2.2", "sidecar-unknown-key", "gama"),
        ("[lights]\nx = 1", "sidecar-unknown-key", "lights"),
        ('[[light]]\nmatch = "a"\ncandle = 3', "sidecar-unknown-key", "light[1]"),
        ('[[light]]\nmatch = "a"\nfile = "a.ies"', "sidecar-unknown-key", "light[1]"),
        ('[[light]]\nmatch = "a"\nscale = 2', "sidecar-invalid", "light[1]"),
        ('[[light]]\nmatch = "a"\nc0 = [1, 0, 0]', "sidecar-invalid", "light[1]"),
        ('[[light]]\nmatch = "a"\nlumens = 1\ncandela = 2', "sidecar-rival", "light[1]"),
        (
            '[[material]]\nmatch = "a"\nroughness = 0.1\nshininess = 2',
            "sidecar-rival",
            "material[1]",
        ),
        ("gamma = 0", "sidecar-invalid", "gamma"),
        ("gamma = [2.2]", "sidecar-invalid", "gamma"),
        ("ambient = 3", "sidecar-invalid", "ambient"),
        ("[ambient]\ntemperature = 4000", "sidecar-invalid", "ambient"),
        ('[light]\nmatch = "a"', "sidecar-invalid", "light"),
        ("light = [1, 2]", "sidecar-invalid", "light"),
        ("[[light]]\ncandela = 3", "sidecar-invalid", "light[1]"),
        ('[[light]]\nmatch = ["a"]\n', "sidecar-invalid", "light[1]"),
    ],
)
def test_wrong_structure_is_a_finding(tmp_path: Path, text: str, code: str, place: str) -> None:
    sidecar, report = read(tmp_path, text)
    assert {finding.code for finding in report} == {code}
    assert str(next(iter(report)).source) == f"photometry.toml:{place}"
    assert sidecar.gamma is None
    assert sidecar.ambient is None


@pytest.mark.parametrize(
    "content",
    [
        b"gamma = ",
        b"\xff\xfe\x00",
        b"[[light]\n",
        b"a = [" * 5000,
        b"a.b = 1\na = 2\n",
        b"gamma = 1" + b"0" * 6000,  # more digits than Python turns into a number
    ],
)
def test_what_is_no_toml_ends_with_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "photometry.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as problem:
        read_sidecar(path, Report())
    assert str(problem.value).startswith("photometry.toml: not TOML: ")
    assert "\n" not in str(problem.value)


def test_a_file_that_is_not_there_ends_with_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_sidecar(tmp_path / "none.toml", Report())
    with pytest.raises(InputError, match="not a regular file"):
        read_sidecar(tmp_path, Report())


def test_patterns_are_the_shells_and_case_counts(tmp_path: Path) -> None:
    text = "".join(f'[[light]]\nmatch = "{p}"\n' for p in ("lamp_[0-4]", "Lamp_?", "*head*"))
    sidecar, _ = read(tmp_path, text)

    def pattern(*names: str) -> str | None:
        found = sidecar.match("light", *names)
        return found.pattern if found else None

    assert pattern("lamp_3") == "lamp_[0-4]"
    assert pattern("lamp_7") is None
    assert pattern("Lamp_7") == "Lamp_?"
    assert pattern("LAMP_7") is None
    assert pattern("", "car_headlight") == "*head*"
    assert sidecar.match("material", "lamp_3") is None


def test_the_first_rule_wins_and_one_behind_it_is_told_so(tmp_path: Path) -> None:
    text = "".join(f'[[light]]\nmatch = "{p}"\n' for p in ("lamp_*", "lamp_07", "sun"))
    sidecar, report = read(tmp_path, text)
    for name in ("lamp_01", "lamp_07"):
        found = sidecar.match("light", name)
        assert found is not None
        assert found.pattern == "lamp_*"
    for pattern in sidecar.unmatched():
        pattern.note(report)
    late, missing = report
    assert (late.code, late.thing) == ("sidecar-no-match", "lamp_07")
    assert "a pattern before it" in late.text
    assert (missing.code, missing.thing, missing.text) == (
        "sidecar-no-match",
        "sun",
        "no light of that name",
    )
