"""Convert a stage: lumens of the photometry file are what its lamps send out, whatever their shape.

What is sent out is computed from the plain UsdLux inputs that were written: pi L A of a disk or
a rectangle, which are Lambert's and have one side; 4 pi^2 r^2 L of a ball and 2 pi^2 r l L of a
tube, pi L times their surface; and of a cone and a focus their share of it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from converted import lights, opened, run, sidecar
from overlaid import lamp, stage_file
from pxr import Usd

from hdrusd.conversion import Result

#: Relative: nits, sizes and angles are float32; the file's numbers may be rounded once more.
CLOSE = 8 * 2.0**-24

SIZES = {
    "SphereLight": "float inputs:radius = 0.1",
    "DiskLight": "float inputs:radius = 0.5",
    "RectLight": "float inputs:width = 0.6\nfloat inputs:height = 0.3",
    "CylinderLight": "float inputs:radius = 0.02\nfloat inputs:length = 1.5",
}
OWN = {
    "SphereLight": "sphere",
    "DiskLight": "lambert",
    "RectLight": "lambert",
    "CylinderLight": None,
}
SPREADS = (None, "sphere", "hemisphere", "lambert", "cone")

#: Without it, ShapingAPI says 90 degrees.
ALL_ROUND = "float inputs:shaping:cone:angle = 180"

#: Cones and foci, and the share of its light that each shape sends through them. A ball:
#: (1 - cos a) / 2, 1 / (n + 1); a face: sin^2 a, 2 / (n + 2); a tube: half of it before it,
#: and 3 pi^2 / 8 of pi^2 sr.
SHAPINGS = {
    "float inputs:shaping:cone:angle = 60": {
        "SphereLight": 0.25,
        "DiskLight": 0.75,
        "RectLight": 0.75,
    },
    "float inputs:shaping:cone:angle = 90": {
        "SphereLight": 0.5,
        "DiskLight": 1.0,
        "RectLight": 1.0,
        "CylinderLight": 0.5,
    },
    f"{ALL_ROUND}\nfloat inputs:shaping:focus = 2": {
        "SphereLight": 1 / 3,
        "DiskLight": 0.5,
        "RectLight": 0.5,
        "CylinderLight": 3 / 8,
    },
}
SHAPED = [
    (kind, text, share) for text, shares in SHAPINGS.items() for kind, share in shares.items()
]


def converted(tmp_path: Path, kind: str, entry: str, inside: str = "") -> Result:
    text = f"float inputs:intensity = 7\n{SIZES.get(kind, '')}\n{inside}"
    source = stage_file(tmp_path / "town.usda", lamp(kind, text))
    sidecar(tmp_path, f'[[light]]\nmatch = "Lamp"\n{entry}\n')
    return run(source, tmp_path / "night.usda")


def said(spread: str | None) -> str:
    return f'\nspread = "{spread}"' if spread else ""


def get(prim: Usd.Prim, name: str) -> Any:
    return prim.GetAttribute(f"inputs:{name}").Get()


def emitted(result: Result) -> float:
    """Lumens of the lamp before a cone or a focus."""
    prim = lights(opened(result))["Lamp"]
    assert (get(prim, "normalize"), get(prim, "exposure")) == (False, 0.0)
    surface = {
        "SphereLight": lambda: 4 * math.pi * get(prim, "radius") ** 2,
        "DiskLight": lambda: math.pi * get(prim, "radius") ** 2,
        "RectLight": lambda: get(prim, "width") * get(prim, "height"),
        "CylinderLight": lambda: 2 * math.pi * get(prim, "radius") * get(prim, "length"),
    }[str(prim.GetTypeName())]()
    return math.pi * float(get(prim, "intensity")) * surface


def spreads(result: Result) -> list[str]:
    return [finding.text for finding in result.report if finding.code == "light-spread"]


@pytest.mark.parametrize("spread", SPREADS)
@pytest.mark.parametrize("kind", SIZES)
def test_lumens_are_sent_out(tmp_path: Path, kind: str, spread: str | None) -> None:
    result = converted(tmp_path, kind, f"lumens = 1000{said(spread)}")
    prim = lights(opened(result))["Lamp"]
    beam = get(prim, "shaping:cone:angle"), get(prim, "shaping:focus")
    # What a ball is given shines to one half, there evenly or by the cosine.
    share = {(90.0, 0.0): 0.5, (90.0, 1.0): 0.25}.get(beam, 1.0)
    shaped = kind == "SphereLight" and spread in ("hemisphere", "lambert")
    assert share == (1.0 if not shaped else 0.5 if spread == "hemisphere" else 0.25)
    assert emitted(result) * share == pytest.approx(1000.0, rel=CLOSE)
    assert result.lights[0]["flux_lm"] == pytest.approx(1000.0, rel=CLOSE)
    if kind != "SphereLight":
        # A shape that cannot shine as it is told says so; told nothing it needs no guess.
        assert bool(spreads(result)) == (spread not in (None, OWN[kind]))


@pytest.mark.parametrize(("kind", "shaping", "share"), SHAPED)
def test_lumens_go_through_a_lamp_s_own_cone(
    tmp_path: Path, kind: str, shaping: str, share: float
) -> None:
    result = converted(tmp_path, kind, "lumens = 1000", shaping)
    # Of a tube by a sum of steps of 5e-5 rad, see tests/facts/test_spread.py.
    assert emitted(result) * share == pytest.approx(1000.0, rel=CLOSE)
    assert result.lights[0]["flux_lm"] == pytest.approx(1000.0, rel=CLOSE)
    if share < 1.0:
        assert any("spread says otherwise" in text for text in spreads(result))


@pytest.mark.parametrize(("kind", "shaping", "share"), SHAPED)
def test_radiant_watts_count_before_it(
    tmp_path: Path, kind: str, shaping: str, share: float
) -> None:
    """A finding has what passes the cone."""
    result = converted(tmp_path, kind, "radiant_watts = 2\nefficacy = 500", shaping)
    assert emitted(result) == pytest.approx(1000.0, rel=CLOSE)
    assert result.lights[0]["flux_lm"] == pytest.approx(1000.0 * share, rel=CLOSE)
    if share < 1.0:
        assert any(f"make {1000.0 * share:.4g} lm" in text for text in spreads(result))


def test_a_face_with_a_cone_may_have_its_lumens_before_it(tmp_path: Path) -> None:
    """Behind the glass pi L A, sin^2 60 degrees of it out of the cone."""
    cone = "float inputs:shaping:cone:angle = 60"
    result = converted(tmp_path, "DiskLight", 'lumens = 1000\nspread = "lambert"', cone)
    assert emitted(result) == pytest.approx(1000.0, rel=CLOSE)
    assert result.lights[0]["flux_lm"] == pytest.approx(750.0, rel=CLOSE)
    (text,) = spreads(result)
    assert "750 lm of 1000 lm" in text


@pytest.mark.parametrize("kind", SIZES)
def test_watts_of_a_lamp_type(tmp_path: Path, kind: str) -> None:
    result = converted(tmp_path, kind, "watts = 10\nefficacy = 120")
    assert emitted(result) == pytest.approx(1200.0, rel=CLOSE)
    rule = lights(opened(result))["Lamp"].GetAttribute("photometric:rule").Get()
    assert "10 W at 120 lm/W" in rule


@pytest.mark.parametrize("shaping", ["", "float inputs:shaping:cone:angle = 90"])
@pytest.mark.parametrize("kind", SIZES)
def test_a_stage_that_is_converted_already_is_told_of_alike(
    tmp_path: Path, kind: str, shaping: str
) -> None:
    first = converted(tmp_path / "a", kind, "lumens = 1000", shaping)
    (row,) = run(first.output, tmp_path / "b" / "again.usda").lights
    assert row["flux_lm"] == pytest.approx(1000.0, rel=CLOSE)
    nits = get(lights(opened(first))["Lamp"], "intensity")
    assert row["luminance_cd_m2"] == pytest.approx(nits, rel=CLOSE)


@pytest.mark.parametrize("spread", SPREADS)
@pytest.mark.parametrize("kind", SIZES)
def test_candela_are_those_on_the_axis(tmp_path: Path, kind: str, spread: str | None) -> None:
    result = converted(tmp_path, kind, f"candela = 80{said(spread)}")
    prim = lights(opened(result))["Lamp"]
    assert get(prim, "photometric:luminousIntensity") == 80.0
    unlike = kind != "SphereLight" and spread not in (None, "cone", OWN[kind])
    assert bool(spreads(result)) == unlike


@pytest.mark.parametrize("kind", ["DistantLight", "DomeLight"])
def test_what_has_no_lumens_says_so(tmp_path: Path, kind: str) -> None:
    result = converted(tmp_path, kind, "lumens = 1000")
    assert "sidecar-unit" in result.report.codes()
    assert get(lights(opened(result))["Lamp"], "intensity") == pytest.approx(7.0, rel=CLOSE)


@pytest.mark.parametrize("kind", SIZES)
def test_a_photometric_file_of_the_stage_is_no_factor_on_lumens(tmp_path: Path, kind: str) -> None:
    """Its candela are not known here, and 1000 times as many would be nobody's word."""
    file = "asset inputs:shaping:ies:file = @./lamp.ies@"
    bare = converted(tmp_path / "a", kind, "sp_ratio = 1.5", file)
    told = converted(tmp_path / "b", kind, "lumens = 1000\nsp_ratio = 1.5", file)
    assert emitted(told) == emitted(bare)
    assert [f.code for f in told.report if f not in set(bare.report)].count("sidecar-unit") == 1
