"""Lengths that a file states of its lamps, in its own unit and below nodes that scale: their sizes,
and the attenuation of parts.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from converted import opened, run
from converted import sidecar as recipe
from flt_builder import (
    Pool,
    database,
    external,
    inside,
    light_entry,
    light_source,
    node,
    one_square,
    record,
    vertex,
)
from flt_builder import load as load_flt
from osg_builder import group, scene
from osg_builder import load as load_osg

from hdrusd.legacy.scene import TRS
from hdrusd.usd.lux import is_light, read_lux

INCH, FOOT = 0.0254, 0.3048
INCHES, FEET = 5, 4  # units of a header

CANDELA = '[[light]]\nmatch = "*"\ncandela = 100\n'


def studs(radius: float) -> str:
    """A light point node with one point."""
    point = (
        "LightPoint {\nPosition 0 0 2 \nColor 1 1 1 1 \n"
        f"Attributes TRUE 1 1 {radius} \nSector FALSE BlinkSequence FALSE }}\n"
    )
    return f'osgSim::LightPointNode {{\nName "studs" \nLightPointList 1 {{\n{point}}}\n}}'


def scaled(x: float, y: float, z: float, *children: str) -> str:
    """A MatrixTransform of a scale."""
    rows = f"{x} 0 0 0 \n0 {y} 0 0 \n0 0 {z} 0 \n0 0 0 1 "
    return group(*children, fields=f"Matrix {{\n{rows}\n}}", kind="osg::MatrixTransform")


def points(size: float) -> bytes:
    """An OpenFlight light point (111) of an actual size (a diameter) that is on at night."""
    pool = Pool()
    corners = inside(record(72, struct.pack(">I", *pool.add(vertex((0, 0, 60))))))
    fields = {
        16: struct.pack(">i", -1),
        24: struct.pack(">2f", 1.0, 0.0),
        64: struct.pack(">f", size),
        140: struct.pack(">I", 0x4000),
    }
    return database(node(111, "studs", 156, fields) + corners, vertices=pool.data, unit=INCHES)


def row_of(source: Path, **options: Any) -> dict[str, Any]:
    """The only light of the report, which the stage, and a second conversion, bear out."""
    result = run(source, **options)
    (row,) = result.lights
    stage = opened(result)
    (prototype,) = (prim for prim in stage.Traverse() if is_light(prim))
    reading = read_lux(prototype)
    assert reading is not None
    assert reading.radius == pytest.approx(row["radius_m"], rel=1e-6)
    (again,) = run(source.with_suffix(".usda"), source.with_name("again.usda")).lights
    for key in ("radius_m", "luminance_cd_m2", "value", "flux_lm", "lamps"):
        assert again[key] == pytest.approx(row[key], rel=1e-6)
    return row


@pytest.mark.parametrize(
    ("scale", "radius", "metres"),
    [
        ((0.01, 0.01, 0.01), 5.0, 0.05),  # a database in cm, shown in metres
        ((1.0, 2.0, 4.0), 0.1, 0.2),  # the mean: the cube root of the volume
        ((-1.0, 1.0, 1.0), 0.1, 0.1),
    ],
)
def test_a_stated_size_is_in_the_space_of_its_node(
    tmp_path: Path, scale: tuple[float, float, float], radius: float, metres: float
) -> None:
    """100 cd from a ball of this size have 100 / (pi r^2) cd/m2."""
    recipe(tmp_path, CANDELA)
    (tmp_path / "a.osgt").write_text(scene(scaled(*scale, studs(radius))))
    row = row_of(tmp_path / "a.osgt")
    assert row["radius_m"] == pytest.approx(metres, rel=1e-12)
    assert row["luminance_cd_m2"] == pytest.approx(100.0 / (math.pi * metres**2), rel=1e-12)


def test_the_unit_of_the_source_counts_once(tmp_path: Path) -> None:
    recipe(tmp_path, CANDELA)
    (tmp_path / "a.osgt").write_text(scene(scaled(2.0, 2.0, 2.0, studs(0.5))))
    assert row_of(tmp_path / "a.osgt", source_unit=INCH)["radius_m"] == pytest.approx(INCH)
    got = row_of(tmp_path / "a.osgt", source_unit=INCH, meters_per_unit=0.01)
    assert got["radius_m"] == pytest.approx(INCH)


@pytest.mark.parametrize(("said", "metres"), [("radius = 0.2\n", 0.2), ("", 0.05)])
def test_sizes_of_a_recipe_and_guesses_are_metres(tmp_path: Path, said: str, metres: float) -> None:
    """A point of radius 0 says nothing: 0.05 m, whatever stands above it."""
    recipe(tmp_path, CANDELA + said)
    radius = 5.0 if said else 0.0
    (tmp_path / "a.osgt").write_text(scene(scaled(0.01, 0.01, 0.01, studs(radius))))
    assert row_of(tmp_path / "a.osgt")["radius_m"] == metres


def test_a_size_is_judged_where_it_stands(tmp_path: Path) -> None:
    """0.5 m below a scale of 100 are 50 m, which no lamp has; 20 units of 1 cm are one's."""
    recipe(tmp_path, CANDELA)
    for scale, radius, sound in ((100.0, 0.5, False), (0.01, 20.0, True)):
        (tmp_path / "a.osgt").write_text(scene(scaled(scale, scale, scale, studs(radius))))
        result = run(tmp_path / "a.osgt")
        assert ("lamp-radius" not in result.report.codes()) == sound
        assert result.lights[0]["radius_m"] == pytest.approx(0.2 if sound else 0.05)


@pytest.mark.parametrize("whole", ["flt", "osgt"])
def test_a_part_in_inches_has_the_lamps_that_it_has_alone(tmp_path: Path, whole: str) -> None:
    """A size of 6 inches is a radius of 3, 0.0762 m."""
    recipe(tmp_path, CANDELA)
    (tmp_path / "part.flt").write_bytes(points(6.0))
    if whole == "flt":
        (tmp_path / "a.flt").write_bytes(database(external("part.flt")))
    else:
        (tmp_path / "a.osgt").write_text(scene(proxy("part.flt")))
    for name in ("part.flt", f"a.{whole}"):
        assert row_of(tmp_path / name)["radius_m"] == pytest.approx(3 * INCH, rel=1e-12)


# --- attenuation --------------------------------------------------------------------------


def proxy(name: str) -> str:
    """A ProxyNode."""
    return f'osg::ProxyNode {{\nFileNames 1 {{\n"{name}" \n}}\n}}'


def lit(*before: bytes, unit: int) -> bytes:
    """A file with a local light that has 1 / (1 + 0.5 d + 1e-4 d^2)."""
    entry = light_entry(0, "bulb", 1, attenuation=(1.0, 0.5, 1e-4))
    return database(*before, light_source("bulb", 0), palettes=entry, unit=unit)


def in_metres(unit: float) -> Any:
    """That attenuation by distances in metres; OpenFlight has it in single precision."""
    k1, k2 = 0.5, float(np.float32(1e-4))
    return pytest.approx((1.0, k1 / unit, k2 / unit**2), rel=1e-12)


def test_the_attenuation_of_a_part_is_in_its_own_unit(tmp_path: Path) -> None:
    (tmp_path / "part.flt").write_bytes(lit(unit=INCHES))
    assert load_flt(tmp_path, database(external("part.flt"))).light.attenuation == in_metres(INCH)
    made = load_osg(tmp_path, scene(proxy("part.flt")))
    assert made.light.attenuation == in_metres(INCH)
    alone = load_flt(tmp_path, lit(unit=INCHES))  # per inch, as the scene is
    assert alone.light.attenuation == (1.0, 0.5, float(np.float32(1e-4)))


def test_the_attenuation_of_a_part_of_a_part(tmp_path: Path) -> None:
    (tmp_path / "inner.flt").write_bytes(lit(unit=FEET))
    (tmp_path / "part.flt").write_bytes(lit(external("inner.flt"), unit=INCHES))
    found = load_flt(tmp_path, database(external("part.flt"))).scene.lights
    assert [light.attenuation for light in found] == [in_metres(INCH), in_metres(FOOT)]


def test_the_candela_of_a_part_are_those_that_it_has_alone(tmp_path: Path) -> None:
    """20 lx where 1 / (1 + k1 d + k2 d^2) is a half, at d: 10 d^2 cd."""
    (tmp_path / "part.flt").write_bytes(lit(unit=INCHES))
    (tmp_path / "a.flt").write_bytes(database(external("part.flt")))
    (tmp_path / "b.osgt").write_text(scene(proxy("part.flt")))
    k2 = float(np.float32(1e-4))
    distance = INCH * (math.sqrt(0.25 + 4.0 * k2) - 0.5) / (2.0 * k2)
    for name in ("part.flt", "a.flt", "b.osgt"):
        (row,) = run(tmp_path / name, tmp_path / "out.usda").lights
        assert row["value"] == pytest.approx(10.0 * distance**2, rel=1e-9)


def test_a_part_of_two_files_of_different_units(tmp_path: Path) -> None:
    """Each scales it from feet into its own: 1 of metres, 12 of inches."""
    (tmp_path / "part.flt").write_bytes(one_square(unit=FEET))
    (tmp_path / "inches.flt").write_bytes(database(external("part.flt"), unit=INCHES))
    made = load_flt(tmp_path, database(external("inches.flt"), external("part.flt")))
    scales = [
        found.transform.scale[0]
        for found in made.nodes()
        if isinstance(found.transform, TRS) and found.transform.scale != (1.0, 1.0, 1.0)
    ]
    assert scales == [INCH, pytest.approx(12.0), FOOT]
