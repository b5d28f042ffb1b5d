"""OpenFlight: instances, external references; whole files of the shared data."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from flt_builder import (
    Pool,
    database,
    external,
    face,
    group,
    inside,
    load,
    moved,
    one_square,
    record,
    thing,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Resolver
from hdrusd.importers.importer import read as read_any
from hdrusd.legacy.scene import TRS, LegacyScene, Light, Node
from hdrusd.report import Kind, Report

# --- instances ----------------------------------------------------------------------------


def definition(number: int, *children: bytes) -> bytes:
    """An instance definition (62)."""
    return record(62, struct.pack(">HH", 0, number)) + inside(*children)


def reference(number: int) -> bytes:
    """An instance reference (61)."""
    return record(61, struct.pack(">HH", 0, number))


def test_instances_share_their_nodes(tmp_path: Path) -> None:
    pool = Pool()
    lamp = definition(3, thing("lamp", face(pool.square())))
    uses = [group(f"g{i}", reference(3), more=moved(i, 0, 0)) for i in range(3)]
    made = load(tmp_path, database(lamp, *uses, vertices=pool.data))
    assert sum(n.name == "lamp" for n in made.nodes()) == 3
    assert len(made.scene.meshes) == 1
    assert not made.report.codes()


def test_instances_that_lead_nowhere(tmp_path: Path) -> None:
    made = load(tmp_path, one_square(reference(9), definition(4, group("a", reference(4)))))
    texts = [f.text for f in made.report if f.code == "flt-instance"]
    assert texts == [
        "definition 9 does not stand before it; left out",
        "definition 4 refers to itself; cut here",
    ]


def test_instances_of_instances_are_limited(tmp_path: Path) -> None:
    """Forty levels of two references each would be 2^40 nodes."""
    levels = [definition(0, group("leaf"))]
    levels += [definition(i, reference(i - 1), reference(i - 1)) for i in range(1, 41)]
    with pytest.raises(InputError, match="more than 1000000 nodes with its instances"):
        load(tmp_path, one_square(*levels, reference(40)))


# --- external references ------------------------------------------------------------------


def test_a_file_is_read_once_for_all_its_uses(tmp_path: Path) -> None:
    (tmp_path / "part.flt").write_bytes(one_square())
    uses = [group(f"g{i}", external("part.flt")) for i in range(3)]
    made = load(tmp_path, one_square(*uses))
    assert len(made.scene.meshes) == 2
    assert sum(n.name == "o" for n in made.nodes()) == 4


def test_one_node_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "part.flt").write_bytes(one_square(group("a"), group("b")))
    made = load(tmp_path, one_square(external("part.flt<b>")))
    assert [n.name for n in made.node("external").children] == ["b"]
    made = load(tmp_path, one_square(external("part.flt<c>")))
    assert made.finding("flt-external").text == "part.flt has no node c; all of it is shown"


def test_a_file_of_other_units_is_scaled(tmp_path: Path) -> None:
    (tmp_path / "feet.flt").write_bytes(one_square(unit=4))
    made = load(tmp_path, one_square(external("feet.flt")))
    (scaled,) = made.node("external").children
    assert scaled.transform == TRS(scale=(0.3048,) * 3)
    assert made.finding("flt-unit").kind is Kind.REPLACED


@pytest.mark.parametrize("names", [("scene",), ("scene", "b"), ("scene", "b", "c")])
def test_a_reference_to_a_file_above_is_cut(tmp_path: Path, names: tuple[str, ...]) -> None:
    for name, following in zip(names, [*names[1:], names[0]], strict=True):
        (tmp_path / f"{name}.flt").write_bytes(one_square(external(f"{following}.flt")))
    made = load(tmp_path, (tmp_path / "scene.flt").read_bytes())
    assert made.finding("flt-cycle").kind is Kind.INVALID
    assert len(made.scene.meshes) == len(names)


def test_two_files_that_refer_to_one_another_and_both_from_above(tmp_path: Path) -> None:
    (tmp_path / "b.flt").write_bytes(one_square(external("c.flt")))
    (tmp_path / "c.flt").write_bytes(one_square(external("b.flt")))
    made = load(tmp_path, one_square(external("b.flt"), external("c.flt")))
    assert len(made.scene.meshes) == 3
    assert sum(1 for _ in made.nodes()) < 30
    assert "flt-cycle" in made.report.codes()


def test_files_that_are_broken_missing_or_outside(tmp_path: Path) -> None:
    inner = tmp_path / "in"
    inner.mkdir()
    (tmp_path / "outside.flt").write_bytes(one_square())
    (inner / "broken.flt").write_bytes(one_square()[:-2])
    names = ("broken.flt", "missing.flt", "../outside.flt", "/etc/passwd")
    made = load(inner, one_square(*map(external, names)))
    assert {f.code for f in made.report} == {"flt-external", "file-missing", "file-refused"}
    assert len(made.scene.meshes) == 1


def test_names_in_a_referred_file_are_relative_to_it(tmp_path: Path) -> None:
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "part.flt").write_bytes(one_square(external("b/leaf.flt")))
    (tmp_path / "a" / "b" / "leaf.flt").write_bytes(one_square())
    made = load(tmp_path, one_square(external("a/part.flt")))
    assert len(made.scene.meshes) == 3
    assert not made.report.codes()


# --- real files ---------------------------------------------------------------------------


def read_real(path: Path, *roots: Path) -> tuple[LegacyScene, Report]:
    """A file of the shared data, without regard to its suffix's case."""
    report = Report()
    return read_any(Resolver(path, report, roots), report), report


def test_real_files(testdata: Path) -> None:
    """Counts of the data's own list: faces as triangles, textures, and one look a texture."""
    data = testdata / "data"
    if not (data / "cdb").is_dir():
        pytest.skip("no real files")
    (bridge,) = (data / "cdb").rglob("*.flt")
    scene, report = read_real(bridge, data / "cdb")
    counts = scene.counts()
    assert (counts["meshes"], counts["triangles"], counts["textures"]) == (2, 1676, 3)
    assert not report.codes()
    scene, report = read_real(data / "osgearth" / "data" / "tank.FLT")
    assert scene.counts()["triangles"] == 2623
    assert (scene.counts()["materials"], scene.counts()["textures"]) == (1, 1)
    assert report.codes() == {"file-found-elsewhere", "flt-face-names", "flt-record"}
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert (texture.wrap_s, texture.image.missing) == ("mirror", False)  # as its .attr says


def split(scene: LegacyScene) -> tuple[list[Light], list[Light]]:
    """The strings of lamps of a scene, and its light sources."""
    points = [light for light in scene.lights if light.positions is not None]
    return points, [light for light in scene.lights if light.positions is None]


def test_the_night_street_is_that_of_openscenegraph(testdata: Path) -> None:
    """The same street, written by osgconv from this file: points, lights, colours, look."""
    data = testdata / "data"
    street = data / "synthetic" / "night_street.flt"
    other = data / "derived-osg" / "night_street.osgt"
    if not street.is_file() or not other.is_file():
        pytest.skip("no night street")
    scene, _ = read_real(street)
    twin, _ = read_real(other)
    assert scene.counts() == twin.counts() | {"meshes": 14}
    assert {m.name for m in scene.materials} == {"asphalt", "paint", "steel", "sodium"}
    points, sources = split(scene)
    other_points, other_sources = split(twin)
    for mine, theirs in zip(sources, other_sources, strict=True):
        assert (mine.kind, mine.spot_cutoff, mine.spot_exponent) == ("spot", 70.0, 2.0)
        assert mine.diffuse == pytest.approx(theirs.diffuse, abs=1e-6)
        assert mine.attenuation == theirs.attenuation
        assert mine.position == pytest.approx(theirs.position, abs=1e-5)
        assert mine.direction == pytest.approx(theirs.direction, abs=1e-6)
    mine, theirs = (
        np.unique(np.round(np.concatenate([m.points for m in s.meshes]), 4), axis=0)
        for s in (scene, twin)
    )
    np.testing.assert_allclose(mine, theirs, atol=1e-4)
    nodes = list(scene.roots)
    found: list[Node] = []
    while nodes:
        found.append(nodes.pop())
        nodes += found[-1].children
    assert {light.name: light.lamps for light in points} == {"lamps": 6, "studs": 22}
    for mine, theirs in zip(points, other_points, strict=True):
        np.testing.assert_allclose(mine.positions, theirs.positions, atol=1e-4)
        assert (mine.name, mine.kind) == (theirs.name, theirs.kind)
        assert mine.direction == pytest.approx(theirs.direction, abs=1e-6)
        # Colours of 8 bits as text, angles in degrees as radians of 6 digits.
        assert mine.diffuse == pytest.approx(theirs.diffuse, abs=1e-5)
        assert mine.spot_cutoff == pytest.approx(theirs.spot_cutoff, rel=1e-5)
        assert mine.radius == pytest.approx(theirs.radius, rel=1e-6)
    assert sum(n.extras.get("not_at") == ("day",) for n in found) == 6


@pytest.mark.parametrize("name", ["deep_push", "trunc_palm", "zero_record"])
def test_hostile_files_are_refused(testdata: Path, name: str) -> None:
    path = testdata / "data" / "hostile" / f"{name}.flt"
    if not path.is_file():
        pytest.skip("no hostile files")
    with pytest.raises(InputError, match=f"{name}.flt:byte"):
        read_real(path)


def test_the_hostile_cycle_is_cut(testdata: Path, tmp_path: Path) -> None:
    for half in "ab":
        path = testdata / "data" / "hostile" / f"extref_cycle_{half}.flt"
        if not path.is_file():
            pytest.skip("no hostile files")
        shutil.copy(path, tmp_path)
    scene, report = read_real(tmp_path / "extref_cycle_a.flt")
    assert report.codes() == {"flt-cycle"}
    assert scene.meshes == []
