"""OpenFlight lights: sources with their palette, light points as strings of lamps."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from flt_builder import (
    Loaded,
    Pool,
    database,
    face,
    inside,
    light_entry,
    light_source,
    load,
    node,
    record,
    text,
    thing,
    vertex,
)

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.importers.flt_lights import direction
from hdrusd.importers.light_points import lobe_cone
from hdrusd.legacy.scene import Light
from hdrusd.report import Kind


def lit(folder: Path, *records: bytes, palettes: bytes) -> Loaded:
    """A file of lights."""
    return load(folder, database(*records, palettes=palettes))


def test_a_spot(tmp_path: Path) -> None:
    entry = light_entry(
        4, "sodium", 2, ambient=(0.1, 0.2, 0.3, 1), diffuse=(1, 0.5, 0.25, 1),
        specular=(0.5, 0.5, 0.5, 1), spot=(2.0, 70.0), attenuation=(0.5, 0.25, 0.125),
    )  # fmt: skip
    made = lit(tmp_path, light_source("ls", 4, (1, 2, 3), 0.0, -90.0), palettes=entry)
    got = made.light
    assert (got.name, got.kind, got.position, got.direction) == (
        "ls",
        "spot",
        (1, 2, 3),
        (0, 0, -1),
    )
    assert (got.spot_cutoff, got.spot_exponent, got.attenuation) == (70.0, 2.0, (0.5, 0.25, 0.125))
    assert (got.diffuse, got.specular) == ((1, 0.5, 0.25), (0.5, 0.5, 0.5))
    assert got.ambient == pytest.approx((0.1, 0.2, 0.3), abs=1e-7)
    assert (got.enabled, got.extras, got.candela) == (True, {"palette": "sodium"}, None)
    assert made.node("ls").lights == [0]
    assert not made.report.codes()


@pytest.mark.parametrize(
    ("yaw", "pitch", "way"),
    [
        (0.0, 0.0, (0, 1, 0)),
        (90.0, 0.0, (-1, 0, 0)),  # counter-clockwise about +Z
        (0.0, 90.0, (0, 0, 1)),
        (30.0, -90.0, (0, 0, -1)),
        (180.0, -45.0, (0, -math.sqrt(0.5), -math.sqrt(0.5))),
    ],
)
def test_directions(yaw: float, pitch: float, way: tuple[float, ...]) -> None:
    assert direction(yaw, pitch) == pytest.approx(way, abs=1e-15)


def test_other_kinds(tmp_path: Path) -> None:
    dark = (0.0, 0.0, 0.0, 1.0)
    palettes = (
        light_entry(0, "moon", 0)
        + light_entry(1, "bulb", 1)
        + light_entry(2, "sky", 0, ambient=(1, 1, 1, 1), diffuse=dark, specular=dark)
        + light_entry(3, "odd", 9)
        + light_entry(4, "wide", 2, spot=(0.0, 120.0))
    )
    made = lit(tmp_path, *(light_source(f"l{i}", i) for i in range(5)), palettes=palettes)
    kinds = [light.kind for light in made.scene.lights]
    assert kinds == ["directional", "point", "ambient", "point", "point"]
    assert [light.attenuation for light in made.scene.lights][:2] == [None, (1.0, 0.0, 0.0)]
    assert made.finding("flt-light-cutoff").kind is Kind.CLAMPED
    assert made.finding("flt-light").text.startswith("light of type 9")


def test_lights_that_are_off_missing_or_of_one_branch(tmp_path: Path) -> None:
    sources = (
        light_source("off", 0, flags=0x40000000),
        light_source("branch", 0, flags=0x80000000),
        light_source("gone", 7),
    )
    made = lit(tmp_path, *sources, palettes=light_entry(0, "bulb", 1))
    assert [light.enabled for light in made.scene.lights] == [False, True]
    assert made.finding("flt-light-scope").kind is Kind.ASSUMED
    assert made.finding("flt-light").kind is Kind.MISSING
    assert made.node("gone").lights == []


def test_candela_come_from_the_estimate_rule(tmp_path: Path) -> None:
    """1 / d^2 is one half of its value at 1 m by sqrt(2) m: 20 lx x 1/2 x 2 m^2 = 20 cd."""
    entry = light_entry(0, "bulb", 1, attenuation=(0.0, 0.0, 1.0))
    content = database(light_source("ls", 0), palettes=entry)
    (tmp_path / "a.flt").write_bytes(content)
    result = convert(tmp_path / "a.flt", tmp_path / "a.usda", Options())
    (row,) = result.lights
    assert (row["value"], row["provenance"]) == (pytest.approx(20.0), "estimated")
    assert "light-estimate" in result.report.codes()


# --- light points -------------------------------------------------------------------------


def look(
    at: int, *, front: float, back: float, size: float, way: int, flags_at: int, flags: int
) -> dict[int, bytes]:
    """Fields of records 111 and 128, counted from the material code at ``at``."""
    return {
        at + 4: struct.pack(">i", -1),
        at + 12: struct.pack(">2f", front, back),
        at + 52: struct.pack(">f", size),
        at + 84: struct.pack(">i3f", way, 60.0, 20.0, 5.0),
        flags_at: struct.pack(">I", flags),
    }


NIGHT, DAY, FLASHING = 0x4000, 0x10000, 0x400000


def lamps(made: Loaded, name: str) -> list[Light]:
    """The strings of lamps at a node."""
    return [made.scene.lights[number] for number in made.node(name).lights]


def two(pool: Pool, normal: tuple[float, ...] | None = None) -> bytes:
    """A vertex list of a red point and one without colour."""
    corners = pool.add(
        vertex((1, 2, 3), normal, packed=(255, 0, 0)),
        vertex((4, 5, 6), normal),
    )
    return inside(record(72, struct.pack(">2I", *corners)))


def test_light_points_are_lamps(tmp_path: Path) -> None:
    """One for each colour and each way; the back has the colour that index -1 is, white."""
    pool = Pool()
    fields = look(12, front=0.4, back=0.2, size=0.5, way=2, flags_at=140, flags=NIGHT | FLASHING)
    own = node(111, "studs", 156, fields) + two(pool, (0, -2, 0))
    made = load(tmp_path, database(own, vertices=pool.data))
    red, white, back = lamps(made, "studs")
    assert [light.name for light in (red, white, back)] == ["studs", "studs", "studs_back"]
    assert [light.kind for light in (red, white, back)] == ["spot"] * 3
    assert red.positions is not None
    assert white.positions is not None
    assert back.positions is not None
    assert (red.positions.tolist(), white.positions.tolist()) == ([[1, 2, 3]], [[4, 5, 6]])
    assert back.positions.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert (red.diffuse, white.diffuse, back.diffuse) == (
        pytest.approx((0.4, 0, 0)),
        pytest.approx((0.4,) * 3),
        pytest.approx((0.2,) * 3),
    )
    assert (red.direction, red.directions, red.radius, red.enabled) == (
        (0, -1, 0),
        None,
        0.25,
        True,
    )
    assert back.direction == (0, 1, 0)
    assert red.spot_cutoff == back.spot_cutoff == lobe_cone(30.0, 10.0)
    assert red.extras == {
        "color": (1, 0, 0),
        "intensity": pytest.approx(0.4),
        "radius": 0.25,
        "directionality": "bidirectional",
        "visible": ["night"],
        "lobe_degrees": (60.0, 20.0, 5.0),
        "back_intensity": pytest.approx(0.2),
        "animation": "flashing",
    }
    assert made.report.codes() == {"light-point-lobe", "light-point-animation"}
    assert made.scene.counts() == {
        "meshes": 0, "triangles": 0, "materials": 0, "textures": 0, "lights": 0, "cameras": 0,
        "light_points": 4,
    }  # fmt: skip


def test_beams_without_a_normal_shine_to_all_sides(tmp_path: Path) -> None:
    pool = Pool()
    fields = look(12, front=1, back=1, size=0, way=2, flags_at=140, flags=0)
    own = node(111, "p", 156, fields) + two(pool)
    made = load(tmp_path, database(own, vertices=pool.data))
    assert [(light.kind, light.lamps, light.radius) for light in lamps(made, "p")] == [
        ("point", 1, None)
    ] * 2
    assert made.finding("light-point-beam").text.startswith("2 beams")


def test_beams_go_each_its_own_way(tmp_path: Path) -> None:
    pool = Pool()
    fields = look(12, front=1, back=0, size=1, way=1, flags_at=140, flags=0)
    corners = pool.add(vertex((0, 0, 0), (1, 0, 0)), vertex((1, 0, 0), (0, 0, 1)))
    own = node(111, "p", 156, fields) + inside(record(72, struct.pack(">2I", *corners)))
    (light,) = lamps(load(tmp_path, database(own, vertices=pool.data)), "p")
    assert light.directions is not None
    assert light.directions.tolist() == [[1, 0, 0], [0, 0, 1]]


def test_points_that_are_not_there_at_night_are_off(tmp_path: Path) -> None:
    pool = Pool()
    fields = look(12, front=1, back=0, size=1, way=0, flags_at=140, flags=DAY)
    made = load(tmp_path, database(node(111, "p", 156, fields) + two(pool), vertices=pool.data))
    assert [light.enabled for light in lamps(made, "p")] == [False, False]


@pytest.mark.parametrize(("flags", "on"), [(0x80000000, True), (0, False)])
def test_a_light_point_system_dims_and_switches(tmp_path: Path, flags: int, on: bool) -> None:
    pool = Pool()
    fields = look(12, front=0.5, back=0, size=1, way=0, flags_at=140, flags=0)
    system = node(131, "s", 24, {12: struct.pack(">fiI", 0.5, 0, flags)})
    own = system + inside(node(111, "p", 156, fields) + two(pool))
    made = load(tmp_path, database(own, vertices=pool.data))
    assert [(light.enabled, light.diffuse) for light in lamps(made, "p")] == [
        (on, (0.25, 0, 0)),
        (on, (0.25, 0.25, 0.25)),
    ]


def test_indexed_light_points(tmp_path: Path) -> None:
    """Record 130 names an appearance (128), after which lamps are called, and an animation."""
    pool = Pool()
    fields = look(268, front=0.7, back=0, size=2.0, way=1, flags_at=380, flags=0)
    fields[264] = struct.pack(">i", 5)
    fields[8] = b"edge"
    appearance = node(128, "", 412, fields)
    animation = record(129, bytes(4) + text("blink", 256) + struct.pack(">i", 6), 1380)
    animation = animation[:268] + struct.pack(">f", 1.5) + animation[272:]
    animation = animation[:296] + struct.pack(">i", 2) + animation[300:]
    own = node(130, "p", 28, {12: struct.pack(">2i", 5, 6)}) + two(pool, (0, 0, 1))
    made = load(tmp_path, database(own, palettes=appearance + animation, vertices=pool.data))
    found = lamps(made, "p")
    assert [(light.name, light.extras["intensity"]) for light in found] == [
        ("edge", pytest.approx(0.7))
    ] * 2
    assert (found[0].extras["animation"], found[0].extras["period_s"]) == ("strobe", 1.5)
    lost = load(tmp_path, database(own, vertices=pool.data))
    assert "appearance 5 is not in the palette" in lost.finding("flt-palette-entry").text
    assert [light.name for light in lamps(lost, "p")] == ["p", "p"]


def test_faces_drawn_as_lights(tmp_path: Path) -> None:
    pool = Pool()
    own = thing("o", face(pool.square(), draw=8))
    made = load(tmp_path, database(own, vertices=pool.data))
    (light,) = lamps(made, "o")
    assert light.positions is not None
    assert light.positions[2].tolist() == [1.0, 1.0, 0.0]
    assert made.scene.meshes == []
