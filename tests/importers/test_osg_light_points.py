"""OpenSceneGraph's light point nodes: strings of lamps, sectors as beams."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from osg_builder import load, old_group, scene

from hdrusd.importers.light_points import lobe_cone


@pytest.mark.parametrize("syntax", ["new", "old"])
def test_light_points_are_lamps(tmp_path: Path, syntax: str) -> None:
    if syntax == "new":
        points = (
            "LightPointList 2 {\nLightPoint {\nPosition 1 2 3 \nColor 1 0.5 0 1 \n"
            "Attributes TRUE 1 0.4 0.05 \nSector FALSE BlinkSequence FALSE }\nLightPoint {\n"
            "Position 4 5 6 \nColor 1 0.5 0 1 \nAttributes FALSE 0 1 2 \nSector TRUE {\n"
            "osgSim::DirectionalSector {\nDirection 0 -1 0 \nHorizLobeAngle 0.5 \n"
            "VertLobeAngle 0.5 \nFadeAngle 0.1 \n}\n}\nBlinkSequence FALSE }\n}"
        )
        text = scene(f'osgSim::LightPointNode {{\nName "studs" \n{points}\n}}')
    else:
        body = "".join(
            f"lightPoint {{\nisOn {on}\nposition {p}\ncolor 1 0.5 0 1\nintensity {i}\n"
            f"radius {r}\n}}\n"
            for on, p, i, r in (("TRUE", "1 2 3", 0.4, 0.05), ("FALSE", "4 5 6", 1, 2))
        )
        text = old_group(f'osgSim::LightPointNode {{\nname "studs"\nnum_lightpoints 2\n{body}}}')
    made = load(tmp_path, text)
    one, two = (made.scene.lights[number] for number in made.node("studs").lights)
    assert one.positions is not None
    assert two.positions is not None
    assert (one.enabled, one.positions.tolist(), one.radius) == (True, [[1, 2, 3]], 0.05)
    assert one.diffuse == pytest.approx((0.4, 0.2, 0.0))
    assert (two.enabled, two.positions.tolist(), two.radius) == (False, [[4, 5, 6]], 2.0)
    assert one.extras["intensity"] == 0.4
    assert (one.kind, two.kind) == ("point", "spot" if syntax == "new" else "point")
    if syntax == "new":  # full angles of 0.5 and 0.5 rad, and 0.1 rad over which it fades
        assert two.direction == (0, -1, 0)
        degrees = math.degrees(1.0)
        assert (two.spot_cutoff, two.spot_inner) == pytest.approx((0.35 * degrees, 0.25 * degrees))


@pytest.mark.parametrize(
    ("sector", "cutoff", "codes"),
    [
        ("osgSim::ConeSector {\nAxis 0 0 -3 \nAngle 0.2 0 \n}", math.degrees(0.2), set()),
        ("osgSim::ConeSector {\nAxis 0 0 0 \nAngle 0.2 0 \n}", 180.0, {"light-point-lobe"}),
        ("osgSim::AzimSector {\n}", 180.0, {"light-point-sector"}),
        (
            "osgSim::DirectionalSector {\nDirection 0 0 -1 \nHorizLobeAngle 0.6 \n"
            "VertLobeAngle 0.2 \n}",
            lobe_cone(math.degrees(0.3), math.degrees(0.1)),
            {"light-point-lobe"},
        ),
    ],
)
def test_sectors_are_beams(tmp_path: Path, sector: str, cutoff: float, codes: set[str]) -> None:
    point = (
        "LightPoint {\nPosition 1 2 3 \nColor 1 1 1 1 \nAttributes TRUE 1 1 0.05 \n"
        f"Sector TRUE {{\n{sector}\n}}\nBlinkSequence FALSE }}\n"
    )
    text = scene(f'osgSim::LightPointNode {{\nName "p" \nLightPointList 2 {{\n{point * 2}}}\n}}')
    made = load(tmp_path, text)
    (light,) = made.scene.lights
    assert light.spot_cutoff == pytest.approx(cutoff, rel=1e-12)
    assert (light.lamps, light.direction) == (2, (0.0, 0.0, -1.0))
    assert made.codes() == codes


def test_a_blinking_point_is_said(tmp_path: Path) -> None:
    point = (
        "LightPoint {\nPosition 1 2 3 \nColor 1 1 1 1 \nAttributes TRUE 1 1 0.05 \n"
        "Sector FALSE BlinkSequence TRUE {\nosgSim::BlinkSequence {\nPhaseShift 1 \n}\n} }\n"
    )
    text = scene(f'osgSim::LightPointNode {{\nName "p" \nLightPointList 1 {{\n{point}}}\n}}')
    made = load(tmp_path, text)
    assert made.scene.lights[0].kind == "point"
    assert made.finding("light-point-animation").text.startswith("1 of 1 light points blink")
