"""Convert by the photometry file's recipes: lumens, watts, lux and areas, to the frame."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import CODES, gltf_lights, obj, osgt_light, png
from converted import (
    MOON,
    POINT,
    lights,
    luminance,
    material,
    opened,
    run,
    sidecar,
    surface,
    texture_file,
    texture_node,
)
from lit_ground import findings, ground, rows, seen
from stage_text import GROUND

from hdrusd.conversion import Result
from hdrusd.images import read_exr
from hdrusd.report import Kind
from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.light_controls import SP_RATIO

#: The lamp's node: 2 m above a ground that is z = 0.
ABOVE = [
    {
        "name": "bulb",
        "translation": [0.0, 0.0, 2.0],
        "extensions": {"KHR_lights_punctual": {"light": 0}},
    }
]


def converted(folder: Path, text: str, light: dict[str, Any] = POINT) -> Result:
    """One lamp 2 m up, by one entry of a photometry file."""
    sidecar(folder, f'[[light]]\nmatch = "*"\n{text}\n')
    return run(gltf_lights(folder / "a.gltf", [light], ABOVE), up="Z")


# -- lamps ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "candela", "codes"),
    [
        ("lumens = 1000", 1000 / (4 * math.pi), {"light-spread"}),
        ('lumens = 1000\nspread = "sphere"', 1000 / (4 * math.pi), set()),
        ('lumens = 1000\nspread = "cone"', 1000 / (4 * math.pi), {"light-spread"}),
        ('lumens = 1000\nspread = "hemisphere"\naxis = [0, 0, -1]', 1000 / (2 * math.pi), set()),
        ("illuminance = 1\ndistance = 25", 625.0, set()),
        ('watts = 60\nefficacy = 15\nspread = "sphere"', 900 / (4 * math.pi), set()),
        ('radiant_watts = 10\nspread = "sphere"', 6830 / (4 * math.pi), set()),
        ("radiant_watts = 10", 6830 / (4 * math.pi), {"light-spread"}),
        (
            'radiant_watts = 10\nefficacy = 250\nspread = "sphere"',
            2500 / (4 * math.pi),
            set(),
        ),
        (
            'watts = 70\nlamp = "high-pressure-sodium"\nspread = "sphere"',
            6300 / (4 * math.pi),
            {"lamp-efficacy", "lamp-type"},
        ),
    ],
)
def test_a_lamp_lights_the_ground(
    gl: Any, tmp_path: Path, text: str, candela: float, codes: set[str]
) -> None:
    """E = I h / d^3 on a level ground of reflectance 1, L = E / pi."""
    result = converted(tmp_path, f"{text}\nradius = 0.05")
    assert rows(result)["point"]["value"] == pytest.approx(candela, rel=1e-6)
    # glTF has Y up, which is not what is asked.
    assert result.report.codes() - {"light-aim", "source-measure"} == codes
    x, y = ground()
    expected = candela * 2.0 / (x * x + y * y + 4.0) ** 1.5 / math.pi
    # float32 sums, a 24-bit depth buffer over 0.05 to 100 m: some 1e-6 of 4 m.
    np.testing.assert_allclose(seen(gl, result, GROUND), expected, rtol=1e-4)


def test_a_lambert_lamp(gl: Any, tmp_path: Path) -> None:
    """1600 lm: I = 1600 / pi cos t, and E = I cos t cos t / d^2 = I0 h^2 / d^4."""
    text = 'lumens = 1600\nspread = "lambert"\naxis = [0, 0, -1]\nradius = 0.05'
    result = converted(tmp_path, text)
    assert result.report.codes() == {"source-measure"}
    row = rows(result)["point"]
    assert row["value"] == pytest.approx(1600 / math.pi, rel=1e-6)
    assert row["flux_lm"] == pytest.approx(1600.0, rel=1e-6)
    x, y = ground()
    expected = 1600 / math.pi * 4.0 / (x * x + y * y + 4.0) ** 2 / math.pi
    np.testing.assert_allclose(seen(gl, result, GROUND), expected, rtol=1e-4)


def test_a_lambert_lamp_without_an_axis_says_where_it_shines(tmp_path: Path) -> None:
    result = converted(tmp_path, 'lumens = 1600\nspread = "lambert"')
    assert [f.kind for f in result.report if f.code == "light-aim"] == [Kind.ASSUMED]


@pytest.mark.parametrize(
    ("fields", "angle"),
    [
        ({"SpotCutoff": "30"}, 2 * math.pi * (1 - math.cos(math.radians(30)))),
        (
            {"SpotCutoff": "30", "SpotExponent": "8"},
            2 * math.pi * (1 - math.cos(math.radians(30)) ** 9) / 9,
        ),
        ({"SpotCutoff": "90", "SpotExponent": "128"}, 2 * math.pi / 129),
    ],
)
def test_a_spots_lumens_fill_its_own_cone(
    tmp_path: Path, fields: dict[str, str], angle: float
) -> None:
    sidecar(tmp_path, '[[light]]\nmatch = "*"\nlumens = 1000\n')
    result = run(osgt_light(tmp_path / "a.osgt", fields))
    (row,) = result.lights
    assert row["value"] == pytest.approx(1000 / angle, rel=1e-9)
    assert row["flux_lm"] == pytest.approx(1000.0, rel=1e-9)
    assert "light-spread" in result.report.codes()


def test_a_spots_radiant_watts_count_before_its_cone(tmp_path: Path) -> None:
    """As Blender has them: the cone takes away what it does not let pass."""
    sidecar(tmp_path, '[[light]]\nmatch = "*"\nradiant_watts = 10\n')
    result = run(osgt_light(tmp_path / "a.osgt", {"SpotCutoff": "30"}))
    (row,) = result.lights
    assert row["value"] == pytest.approx(6830 / (4 * math.pi), rel=1e-9)
    # (1 - cos 30) / 2 of 6830 lm are 457.5 lm.
    cut = [f.text for f in result.report if (f.kind, f.code) == (Kind.REPLACED, "light-spread")]
    assert cut == ["its cone and focus make 457.5 lm of 6830 lm over 12.57 sr"]


def test_what_a_lamps_type_says_is_told_and_marked(tmp_path: Path) -> None:
    result = converted(tmp_path, 'watts = 70\nlamp = "high-pressure-sodium"\nsource = "plate"')
    row = rows(result)["point"]
    assert (row["provenance"], row["confidence"]) == ("estimated", "medium")
    assert row["rule"].startswith("lamp type high-pressure-sodium, photometry.toml:light[1], 70 W")
    assert row["source"].startswith("plate; Regulation (EC) 245/2009")
    (text,) = findings(result, "lamp-efficacy")
    assert "6300 lm" in text
    assert "50 to 140" in text
    (text,) = findings(result, "lamp-type")
    assert "2000 K" in text
    assert "S/P 0.56" in text
    prim = lights(opened(result))["point"]
    assert prim.GetAttribute(f"inputs:{SP_RATIO}").Get() == pytest.approx(0.56)
    red, green, blue = row["chromaticity"]
    assert red > 1.0 > green > blue


def test_guessed_watts_are_worth_no_more_than_a_guess(tmp_path: Path) -> None:
    guess = 'watts = 70\nlamp = "high-pressure-sodium"\nprovenance = "estimated"'
    row = rows(converted(tmp_path, guess))["point"]
    assert (row["confidence"], row["flux_lm"]) == ("low", pytest.approx(6300.0))
    assert "lamp type high-pressure-sodium, 70 W at 90 lm/W" in row["rule"]


@pytest.mark.parametrize(
    ("stated", "left"),
    [
        ("temperature = 3000", "S/P"),
        ("sp_ratio = 0.6", "K by"),
        ('color = [1, 0.5, 0]\nilluminant = "HP2"', ""),
    ],
)
def test_what_is_stated_beside_a_lamps_type_counts(tmp_path: Path, stated: str, left: str) -> None:
    result = converted(tmp_path, f'candela = 100\nlamp = "led"\n{stated}')
    texts = findings(result, "lamp-type")
    assert len(texts) == (1 if left else 0)
    assert all(left in text for text in texts)


def test_how_lumens_became_candela_is_in_the_stage(tmp_path: Path) -> None:
    result = converted(tmp_path, 'lumens = 800\nspread = "sphere"\nsource = "box"')
    prim = lights(opened(result))["point"]
    rule = prim.GetAttribute("photometric:rule").Get()
    assert rule == "photometry.toml:light[1], 800 lm over 12.57 sr (sphere)"
    assert prim.GetAttribute("photometric:source").Get() == "box"
    assert rows(result)["point"]["confidence"] == "high"


@pytest.mark.parametrize(
    "text", ["lumens = 5", "watts = 5\nefficacy = 5", "radiant_watts = 5", "candela = 5"]
)
def test_a_direction_takes_lux_alone(tmp_path: Path, text: str) -> None:
    result = converted(tmp_path, text, MOON)
    assert rows(result)["moon"]["value"] != 5.0
    assert "sidecar-unit" in result.report.codes()


def test_lux_at_a_distance_are_for_lamps_with_a_place(tmp_path: Path) -> None:
    result = converted(tmp_path, "illuminance = 5\ndistance = 25", MOON)
    assert rows(result)["moon"]["value"] == 5.0
    assert "sidecar-unit" in result.report.codes()
    result = converted(tmp_path, "illuminance = 5")
    assert rows(result)["point"]["value"] != 5.0
    assert "sidecar-unit" in result.report.codes()


# -- surfaces -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "nits"),
    [
        ("candela = 500", 1.0, 500.0),  # the square has 1 m2
        ("candela = 500", 0.5, 2000.0),
        ("candela = 500\narea = 0.25", 1.0, 2000.0),
        ("lumens = 500", 1.0, 500 / math.pi),
        ("lumens = 500\narea = 0.25", 1.0, 2000 / math.pi),
    ],
)
def test_a_lamp_glass_in_the_frame(
    gl: Any, tmp_path: Path, text: str, unit: float, nits: float
) -> None:
    """L = I / A and L = Phi / (pi A), as the EXR has it; the square begins at the origin."""
    sidecar(tmp_path, f'[[material]]\nmatch = "paint"\n{text}\ncolor = [1, 1, 1]\n')
    result = run(obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5"), up="Z", source_unit=unit)
    picture = seen(gl, result)
    x, y = ground()
    inside = (x > 0.05) & (x < unit - 0.05) & (y > 0.05) & (y < unit - 0.05)
    assert inside.sum() > 20
    np.testing.assert_allclose(picture[inside], nits, rtol=1e-6)
    assert ("emission-area" in result.report.codes()) == ("area" not in text)


def two_lamps(folder: Path) -> Path:
    """Squares of 1 m2 and 4 m2 in one material."""
    source = obj(folder / "a.obj", "Kd 0.5 0.5 0.5", uvs=False)
    more = "o Large\nv 5 0 0\nv 7 0 0\nv 7 2 0\nv 5 2 0\nusemtl paint\nf 5 6 7 8\n"
    source.write_text(source.read_text() + more)
    return source


def test_lamps_of_two_sizes_have_the_luminance_of_their_mean(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\ncandela = 500\nsource = "sheet"\n')
    result = run(two_lamps(tmp_path))
    (text,) = findings(result, "emission-area")
    assert text.startswith("2.5 m2 seen along its mean normal, the mean of 2 meshes of 1 to 4 m2")
    prim = material(opened(result)).GetPrim()
    assert prim.GetAttribute("photometric:luminance").Get() == pytest.approx(200.0, rel=1e-6)
    rule = prim.GetAttribute("photometric:rule").Get()
    assert rule == "photometry.toml:material[1], 500 cd of 2.5 m2"
    assert prim.GetAttribute("photometric:source").Get() == "sheet"


def test_a_luminance_beyond_32_bits_is_not_written(tmp_path: Path) -> None:
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\ncandela = 1e30\narea = 1e-9\n')
    result = run(obj(tmp_path / "a.obj", "Kd 1 1 1"))
    assert [f.kind for f in result.report if f.code == "emission-area"] == [Kind.INVALID]
    assert luminance(surface(opened(result)).GetInput("emissiveColor").Get()) == 0.0


def test_a_lamps_texture_keeps_its_candela(gl: Any, tmp_path: Path) -> None:
    """I = A mean(L): the brightest texel has I / A times peak over mean of T^gamma."""
    png(tmp_path / "sign.png")
    sidecar(
        tmp_path,
        '[[material]]\nmatch = "paint"\ncandela = 300\nhdr_texture = true\ncolor = [1, 1, 1]\n',
    )
    result = run(obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5\nmap_Kd sign.png"), up="Z")
    # 16 x 16 pixels of 1/256 m2 see all of it; interpolation between texels keeps the mean.
    x, y = ground()
    inside = (x > 0.0) & (x < 1.0) & (y > 0.0) & (y < 1.0)
    assert inside.sum() == 256
    assert seen(gl, result)[inside].mean() == pytest.approx(300.0, rel=0.01)
    texels = ((CODES / 255.0) ** 2.2) @ LUMINANCE_WEIGHTS
    peak = 300.0 * float(texels.max() / texels.mean())
    stage = opened(result)
    prim = material(stage).GetPrim()
    # The mean over the lamp is taken at 16,384 places, of which each quarter has its share but
    # for some log2(n)^2 of them: 1 %.
    assert prim.GetAttribute("photometric:luminance").Get() == pytest.approx(peak, rel=0.01)
    shader = surface(stage)
    rgb, _ = read_exr(texture_file(shader, "emissiveColor"))
    node = texture_node(shader, "emissiveColor")
    assert node is not None
    nits = rgb * np.array(node.GetInput("scale").Get())[:3] @ LUMINANCE_WEIGHTS
    assert nits.max() == pytest.approx(peak, rel=0.01)
    assert nits.mean() == pytest.approx(300.0, rel=0.01)
    assert "emission-texture" in result.report.codes()


def test_an_emission_texture_keeps_its_lumens(tmp_path: Path) -> None:
    png(tmp_path / "sign.png")
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nlumens = 100\narea = 2\n')
    result = run(obj(tmp_path / "a.obj", "Ke 1 0.2 0\nmap_Ke sign.png"))
    shader = surface(opened(result))
    rgb, _ = read_exr(texture_file(shader, "emissiveColor"))
    node = texture_node(shader, "emissiveColor")
    assert node is not None
    nits = rgb * np.array(node.GetInput("scale").Get())[:3] @ LUMINANCE_WEIGHTS
    assert nits.mean() == pytest.approx(100 / (2 * math.pi), rel=0.01)


def test_a_lamp_that_shows_part_of_a_picture(tmp_path: Path) -> None:
    """The white quarter of an atlas is all that the lamp shows: L = I / A there, no more."""
    png(tmp_path / "atlas.png", np.array([[[0] * 3, [0] * 3], [[255] * 3, [0] * 3]], np.uint8))
    source = obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd atlas.png")
    text = source.read_text().replace("vt 1", "vt 0.5").replace(" 1\nvt", " 0.5\nvt")
    source.write_text(text.replace("vt 0 1", "vt 0 0.5"))
    assert "vt 0.5 0\nvt 0.5 0.5\nvt 0 0.5" in source.read_text()
    sidecar(
        tmp_path,
        '[[material]]\nmatch = "paint"\ncandela = 300\nhdr_texture = true\ncolor = [1, 1, 1]\n',
    )
    prim = material(opened(run(source))).GetPrim()
    assert prim.GetAttribute("photometric:luminance").Get() == pytest.approx(300.0, rel=1e-6)


def test_a_black_texture_cannot_be_a_lamp(tmp_path: Path) -> None:
    png(tmp_path / "sign.png", np.zeros((2, 2, 3), np.uint8))
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\ncandela = 5\nhdr_texture = true\n')
    result = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd sign.png"))
    assert [f.kind for f in result.report if f.code == "emission-texture"] == [Kind.INVALID]


def test_an_unworn_material_has_no_area(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 1 1 1\nnewmtl spare\nKd 1 1 1")
    sidecar(tmp_path, '[[material]]\nmatch = "spare"\ncandela = 5\n')
    result = run(source)
    assert [f.kind for f in result.report if f.code == "emission-area"] == [Kind.MISSING]
    glow = surface(opened(result), "spare").GetInput("emissiveColor").Get()
    assert luminance(glow) == 0.0
