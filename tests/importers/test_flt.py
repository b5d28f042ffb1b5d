"""OpenFlight: records, header, nodes, instances, references; whole files of the shared data."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from flt_builder import (
    POP,
    PUSH,
    Pool,
    database,
    face,
    group,
    header,
    inside,
    load,
    lod,
    matrix,
    moved,
    node,
    one_square,
    record,
    text,
    thing,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.report import Kind

# --- header and records -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "metres"), [(0, 1.0), (1, 1000.0), (4, 0.3048), (5, 0.0254), (8, 1852.0)]
)
def test_the_header_has_the_unit_and_z_is_up(tmp_path: Path, unit: int, metres: float) -> None:
    made = load(tmp_path, one_square(unit=unit))
    assert (made.scene.unit_m, made.scene.up, made.scene.format) == (metres, "Z", "flt")
    assert made.scene.generator == "OpenFlight 16.50"
    assert not made.report.codes()


def test_an_unknown_unit_is_metres(tmp_path: Path) -> None:
    made = load(tmp_path, one_square(unit=3))
    assert made.scene.unit_m == 1.0
    assert made.finding("flt-unit").kind is Kind.ASSUMED


@pytest.mark.parametrize("version", [1420, 1510, 1541, 1570, 1580, 1600, 1650])
def test_revisions(tmp_path: Path, version: int) -> None:
    assert load(tmp_path, one_square(version=version)).scene.counts()["triangles"] == 2


def test_other_revisions(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="byte 12: OpenFlight revision 13; want 1420"):
        load(tmp_path, one_square(version=13))
    assert load(tmp_path, one_square(version=1710)).finding("flt-version").kind is Kind.ASSUMED


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "empty file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "no header record"),
        (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS pointer"),
        (header()[:40], "no header record"),
        (header() + record(2)[:2] + b"\0\0", "byte 324: record 2 of length 0; want 4 to 4"),
        (header() + PUSH + record(4, size=28)[:20], "byte 328: record 4 of length 28"),
    ],
)
def test_what_is_no_whole_file_is_refused(tmp_path: Path, content: bytes, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        load(tmp_path, content)


def test_zeros_at_the_end_fill_up_a_block(tmp_path: Path) -> None:
    assert len(load(tmp_path, one_square() + bytes(1000)).scene.meshes) == 1


def test_pushes_without_a_node_and_padded_ones(tmp_path: Path) -> None:
    """A push in a push opens a block of the same node; records may be longer than they need."""
    pool = Pool()
    padded = record(10, bytes(4)) + face(pool.square()) + record(11, bytes(4))
    object_ = node(4, "o", 32) + padded
    content = database(PUSH + group("g") + PUSH + object_ + POP + POP, vertices=pool.data)
    made = load(tmp_path, content)
    (g,) = made.scene.roots[0].children
    assert (g.name, g.children[0].name, g.children[0].meshes) == ("g", "o", [0])


def test_pops_without_pushes(tmp_path: Path) -> None:
    made = load(tmp_path, one_square() + POP + POP + group("late"))
    assert made.finding("flt-levels").kind is Kind.INVALID
    assert [n.name for n in made.scene.roots[0].children] == ["o", "late"]


def test_a_vertex_list_goes_on_in_continuations(tmp_path: Path) -> None:
    pool = Pool()
    corners = pool.square()
    half = record(72, struct.pack(">2I", *corners[:2])) + record(23, struct.pack(">I", corners[2]))
    more = record(23, struct.pack(">I", corners[3]))
    own = face(corners)[:80] + inside(half, more)
    made = load(tmp_path, database(thing("o", own), vertices=pool.data))
    assert made.mesh.face_indices.tolist() == [0, 1, 2, 3]


def test_records_without_a_home(tmp_path: Path) -> None:
    made = load(tmp_path, one_square(record(83, size=100), record(83, size=100), record(149)))
    texts = [f.text for f in made.report if f.code == "flt-record"]
    assert texts == [
        "records 83, eyepoints and trackplanes: 2, this is the first; dropped",
        "records 149, unknown: 1, this is the first; dropped",
    ]


def test_limits(tmp_path: Path) -> None:
    deep = PUSH * 300 + POP * 300
    with pytest.raises(InputError, match="nested deeper than 256"):
        load(tmp_path, one_square(deep))
    many = [group(f"g{i}") for i in range(20)]
    with pytest.raises(InputError, match="more than 10 nodes"):
        load(tmp_path, one_square(*many), limits=Limits(nodes=10))
    with pytest.raises(InputError, match="more than 3 vertices"):
        load(tmp_path, one_square(), limits=Limits(vertices=3))


# --- nodes --------------------------------------------------------------------------------


def test_names_and_comments(tmp_path: Path) -> None:
    long = record(33, b"a long name\0") + record(31, b"said by hand\0")
    made = load(tmp_path, one_square(group("short", more=long)))
    (named, _) = made.scene.roots[0].children
    assert (named.name, named.extras["comment"]) == ("a long name", "said by hand")
    assert named.source.place == "byte 496"  # header 324, palette 8 + 4 x 40, push 4


def test_names_of_faces_are_counted(tmp_path: Path) -> None:
    pool = Pool()
    faces = [face(pool.square(z), more=record(33, b"face\0\0\0\0")) for z in (0.0, 1.0)]
    made = load(tmp_path, database(thing("o", *faces), vertices=pool.data))
    assert made.finding("flt-face-names").text.startswith("2 names of faces")


def test_a_matrix_acts_on_row_vectors_and_counts_alone(tmp_path: Path) -> None:
    parts = moved(1, 2, 3) + record(78, struct.pack(">i6d", 0, 0, 0, 0, 9, 9, 9))
    made = load(tmp_path, one_square(group("g", more=parts)))
    transform = made.node("g").transform
    assert isinstance(transform, np.ndarray)
    assert transform[3].tolist() == [1, 2, 3, 1]


HALF_TURN = 180.0


@pytest.mark.parametrize(
    ("part", "point", "goes_to"),
    [
        # 78: by the second of its vectors.
        (record(78, struct.pack(">i6d", 0, 5, 5, 5, 1, 2, 3)), (0, 0, 0), (1, 2, 3)),
        # 76: a quarter turn about the edge from (1, 0, 0) up: +X of it becomes +Y.
        (record(76, struct.pack(">i6df", 0, 1, 0, 0, 1, 0, 9, 90.0)), (2, 0, 0), (1, 1, 0)),
        # 79: twice and three times as large about (1, 1, 1).
        (record(79, struct.pack(">i3d3f", 0, 1, 1, 1, 2, 3, 1)), (2, 2, 2), (3, 4, 2)),
        # 80: a half turn about +Z through (1, 0, 0).
        (
            record(80, struct.pack(">i3d4f", 0, 1, 0, 0, 0, 0, 1, HALF_TURN)),
            (3, 0, 0),
            (-1, 0, 0),
        ),
        # 82: from the origin's frame to one at (5, 0, 0) with x along +Y.
        (
            record(
                82,
                struct.pack(">i18d", 0, *(0, 0, 0, 1, 0, 0, 0, 1, 0), *(5, 0, 0, 5, 1, 0, 4, 0, 0)),
            ),
            (1, 0, 0),
            (5, 1, 0),
        ),
        # 94: any matrix.
        (record(94, moved(1, 2, 3)[4:]), (1, 1, 1), (2, 3, 4)),
    ],
)
def test_parts_of_a_matrix(
    tmp_path: Path, part: bytes, point: tuple[float, ...], goes_to: tuple[float, ...]
) -> None:
    matrix = load(tmp_path, one_square(group("g", more=part))).node("g").transform
    assert isinstance(matrix, np.ndarray)
    np.testing.assert_allclose(np.array([*point, 1]) @ matrix, [*goes_to, 1], atol=1e-6)


def test_parts_follow_one_another(tmp_path: Path) -> None:
    """First doubled, then moved."""
    parts = record(79, struct.pack(">i3d3f", 0, 0, 0, 0, 2, 2, 2))
    parts += record(78, struct.pack(">i6d", 0, 0, 0, 0, 1, 0, 0))
    transform = load(tmp_path, one_square(group("g", more=parts))).node("g").transform
    assert isinstance(transform, np.ndarray)
    np.testing.assert_allclose([1, 1, 1, 1] @ transform, [3, 2, 2, 1], atol=1e-12)


def test_broken_matrices(tmp_path: Path) -> None:
    nan = matrix([math.nan] * 16)
    made = load(tmp_path, one_square(group("g", more=nan)))
    assert (made.node("g").transform, made.report.codes()) == (None, {"flt-number"})
    skewed = matrix((1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1))
    made = load(tmp_path, one_square(group("g", more=skewed)))
    assert (made.node("g").transform, made.report.codes()) == (None, {"flt-matrix"})


def test_copies_stand_one_step_from_one_another(tmp_path: Path) -> None:
    """Replicate 2: the node, and two further ones."""
    pool = Pool()
    more = moved(1, 0, 0) + record(60, struct.pack(">hh", 2, 0))
    row = group("g", thing("o", face(pool.square())), more=more)
    made = load(tmp_path, database(row, vertices=pool.data))
    copies = made.node("g").children
    assert len(copies) == 3
    assert copies[0].transform is None
    assert [np.asarray(copy.transform)[3, 0] for copy in copies[1:]] == [1.0, 2.0]
    assert all(copy.children == copies[0].children for copy in copies)
    assert len(made.scene.meshes) == 1


def test_too_many_copies(tmp_path: Path) -> None:
    more = moved(1, 0, 0) + record(60, struct.pack(">hh", 32767, 0))
    with pytest.raises(InputError, match="more than 1000 nodes"):
        load(tmp_path, one_square(group("g", more=more)), limits=Limits(nodes=1000))


def dof(yaw: float = 0.0, move: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> bytes:
    """A degree of freedom about (10, 0, 0) where it stands now."""
    frame = struct.pack(">9d", 10, 0, 0, 11, 0, 0, 10, 1, 0)
    now = [*reversed(move), 0.0, 0.0, yaw, 1.0, 1.0, 1.0]
    ranges = b"".join(struct.pack(">4d", value, value, value, 0) for value in now)
    return node(14, "d", 384, {16: frame, 88: ranges})


def test_degrees_of_freedom_at_rest(tmp_path: Path) -> None:
    """A quarter turn of yaw about z, and up, in a frame at (10, 0, 0)."""
    made = load(tmp_path, one_square(dof(90.0, (0.0, 0.0, 5.0))))
    transform = made.node("d").transform
    assert isinstance(transform, np.ndarray)
    np.testing.assert_allclose([11, 0, 0, 1] @ transform, [10, 1, 5, 1], atol=1e-12)
    assert load(tmp_path, one_square(dof())).node("d").transform is None


def test_levels_of_detail_of_one_centre(tmp_path: Path) -> None:
    levels = lod("near", 0, 100), lod("far", 100, 900), lod("else", 5, 9, center=7.0)
    root = load(tmp_path, one_square(*levels)).scene.roots[0]
    assert [child.kind for child in root.children] == ["lod", "group", "group"]
    made = root.children[0]
    assert [child.name for child in made.children] == ["near", "far"]
    assert made.lod_ranges == ((0, 100), (100, 900))
    assert root.children[1].extras["range"] == (5, 9)


def test_a_switch_shows_what_its_mask_has(tmp_path: Path) -> None:
    """Bit 0 is the first child; faces count too. Mask 1 of two has the second and third."""
    pool = Pool()
    switch = node(96, "s", 36, {16: struct.pack(">3I2I", 1, 2, 1, 0, 0b110)})
    name = record(132, struct.pack(">I", 1) + b"by night\0")
    children = inside(group("a"), group("b"), face(pool.square()), face(pool.square(1.0)))
    made = load(tmp_path, database(switch + name + children, vertices=pool.data))
    own = made.node("s")
    assert (own.kind, own.switch_on) == ("switch", (False, True, True, False))
    assert own.switch_masks == (("mask0", (False,) * 4), ("by night", own.switch_on))
    assert [len(child.meshes) for child in own.children] == [0, 0, 1, 1]
    assert all(child.visible for child in own.children)
    assert not made.report.codes()


def test_a_switch_whose_mask_is_not_there(tmp_path: Path) -> None:
    switch = node(96, "s", 28, {16: struct.pack(">3I", 7, 2**31, 2**31)})
    made = load(tmp_path, one_square(switch + inside(group("a"))))
    assert made.node("s").switch_on == (True,)
    assert made.finding("flt-switch").kind is Kind.INVALID


@pytest.mark.parametrize(
    ("version", "flags", "kind"),
    [
        (1650, 0x40000000, "sequence"),
        (1650, 0x02000000, "sequence"),
        (1650, 0x20000000, "group"),
        (1570, 0x20000000, "sequence"),
        (1570, 0x02000000, "group"),
    ],
)
def test_animated_groups(tmp_path: Path, version: int, flags: int, kind: str) -> None:
    made = load(tmp_path, one_square(group("g", group("a"), flags=flags), version=version))
    assert made.node("g").kind == kind
    assert ("flt-sequence" in made.report.codes()) == (kind == "sequence")


def test_objects_by_day_and_by_night(tmp_path: Path) -> None:
    """The flags' bits from the left: not in daylight, at dusk, at night."""
    made = load(tmp_path, one_square(thing("lit", flags=0x80000000), thing("sun", flags=1 << 29)))
    assert (made.node("lit").visible, made.node("lit").extras) == (True, {"not_at": ("day",)})
    assert (made.node("sun").visible, made.node("sun").extras) == (False, {"not_at": ("night",)})
    assert [f.kind for f in made.report] == [Kind.ASSUMED] * 2


def test_other_nodes_keep_their_children(tmp_path: Path) -> None:
    made = load(tmp_path, one_square(node(98, "clip", 200) + inside(group("in"))))
    assert made.node("clip").children[0].name == "in"
    assert made.finding("flt-node").text.startswith("clip region")


def test_texts_end_at_their_zero(tmp_path: Path) -> None:
    """What an editor left behind the end of a name is none of it."""
    noisy = node(2, "x", 44, {4: b"a\0bcdefg"}) + record(31, text("fine", 8) + b"noise")
    made = load(tmp_path, one_square(noisy))
    assert made.node("a").extras["comment"] == "fine"
