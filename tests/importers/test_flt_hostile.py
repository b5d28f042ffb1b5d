"""OpenFlight input that is out to break the reader: cut, flipped, repeated, and large."""

from __future__ import annotations

import struct
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from flt_builder import (
    SQUARE,
    Pool,
    colors,
    database,
    external,
    face,
    group,
    header,
    inside,
    light_entry,
    light_source,
    load,
    lod,
    material,
    moved,
    node,
    one_square,
    quick,
    record,
    texture,
    thing,
    vertex,
)
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.errors import InputError
from hdrusd.importers.flt_walk import walk
from hdrusd.importers.importer import Limits


def everything() -> bytes:
    """A small file with a record of nearly each kind."""
    pool = Pool()
    corners = pool.add(*(vertex(p, (0, 0, 1), p[:2], packed=(9, 9, 9)) for p in SQUARE))
    corners += pool.square(1.0)
    palettes = record(32, colors({1: (1, 2, 3)})[4:600]) + record(23, bytes(40))
    palettes += material(0, "m") + texture(0, "a.rgb") + light_entry(0, "l", 2, spot=(1, 30))
    palettes += node(128, "", 412) + node(129, "", 1380)
    points = record(85, struct.pack(">II", 3, 0xB8000000) + bytes(3 * 48))
    strip = record(86, struct.pack(">hHI3B", 1, 1, 3, 0, 1, 2))
    tree = [
        record(62, struct.pack(">HH", 0, 1)) + inside(thing("i", face(corners[:4]))),
        group("g", record(61, struct.pack(">HH", 0, 1)), more=moved(1, 0, 0)),
        group("r", more=moved(1, 0, 0) + record(60, struct.pack(">hh", 3, 0))),
        lod("near", 0, 9, thing("o", face(corners[4:], mode=3, material=0, texture=0))),
        lod("far", 9, 99),
        node(14, "d", 384) + inside(node(84, "m", 84) + points + inside(strip)),
        node(96, "s", 36, {16: struct.pack(">5I", 0, 1, 1, 0, 1)}) + inside(face(corners[:3])),
        external("scene.flt"),
        light_source("l", 0),
        node(111, "p", 156) + inside(record(72, struct.pack(">2I", *corners[:2]))),
        node(130, "q", 28) + inside(record(72, struct.pack(">I", corners[0]))),
        thing("sub", face(corners[:4]) + record(19) + face(corners[:4]) + record(20)),
        record(31, b"comment") + record(33, b"long name"),
    ]
    return database(*tree, palettes=palettes, vertices=pool.data)


EVERYTHING = everything()


def survives(folder: Path, content: bytes) -> None:
    """It is read, with what arrays must be, or refused."""
    limits = Limits(nodes=20_000, vertices=20_000)
    try:
        made = load(folder, content, limits=limits)
    except InputError:
        return
    for mesh in made.scene.meshes:
        assert np.isfinite(mesh.points).all()
        assert mesh.face_indices.min() >= 0
        assert mesh.face_indices.max() < len(mesh.points)
        assert len(mesh.face_indices) == mesh.face_counts.sum()
        assert mesh.face_counts.min() >= 3
        for subset in mesh.subsets:
            assert subset.material < len(made.scene.materials)
        for values, _ in mesh.uvs.values():
            assert np.isfinite(values).all()
    for each in made.nodes():
        if isinstance(each.transform, np.ndarray):
            assert np.isfinite(each.transform).all()


def test_the_whole_of_it_is_read(tmp_path: Path) -> None:
    made = load(tmp_path, EVERYTHING)
    assert made.scene.counts()["lights"] == 1
    assert "flt-cycle" in made.report.codes()


@given(st.integers(0, len(EVERYTHING)))
@quick
def test_cut_anywhere(tmp_path: Path, end: int) -> None:
    survives(tmp_path, EVERYTHING[:end])


@given(
    st.lists(
        st.tuples(
            st.integers(0, len(EVERYTHING) - 1),
            st.sampled_from([0, 1, 4, 10, 11, 0x7F, 0x80, 0xFF]) | st.integers(0, 255),
        ),
        min_size=1,
        max_size=12,
    )
)
@quick
def test_bytes_replaced(tmp_path: Path, changes: list[tuple[int, int]]) -> None:
    content = bytearray(EVERYTHING)
    for at, value in changes:
        content[at] = value
    survives(tmp_path, bytes(content))


NODES = st.sampled_from([1, 2, 4, 5, 10, 11, 14, 19, 20, 23, 49, 60, 61, 62, 63, 64, 67, 72, 73])
OTHERS = st.sampled_from([76, 79, 80, 81, 82, 84, 85, 86, 89, 94, 96, 101, 102, 111, 113, 130])
NOISE = st.tuples(NODES | OTHERS | st.integers(0, 150), st.binary(max_size=90))


@given(st.lists(NOISE, max_size=25))
@quick
def test_records_of_noise(tmp_path: Path, noise: list[tuple[int, bytes]]) -> None:
    survives(tmp_path, header() + b"".join(record(op, body) for op, body in noise))


# --- the walk -----------------------------------------------------------------------------


def walked(data: bytes) -> list[int]:
    """The records one by one, as the format has them; without a vertex palette."""
    places, at = [], 0
    while at + 4 <= len(data):
        places.append(at)
        at += struct.unpack_from(">H", data, at + 2)[0]
    return places


@given(
    st.lists(
        st.sampled_from(
            [
                record(10),
                record(10, bytes(4)),
                record(11),
                record(5, bytes(8)),
                record(5, record(10) * 3),  # what looks like pushes inside
                record(7, b"\0"),  # what follows is not on a multiple of 4
                record(7, bytes(3)),
                record(72, b"\x00\x0a\x00\x04\x00\x43\x00\x08"),
            ]
        ),
        max_size=300,
    )
)
@quick
def test_walkers_find_the_records_of_the_chain(tmp_path: Path, parts: list[bytes]) -> None:
    data = header() + b"".join(parts)
    assert walk(data, tmp_path).tolist() == walked(data)


@pytest.mark.parametrize(
    "body",
    [
        record(10) + record(11),
        record(5, record(10) * 2),
        b"\x00\x0a\x00\x04\x00\x05\x00\x06\x00\x0a" + b"\x00\x05\x00\x06\x00\x04",
        record(7, b"\0") + record(10) + record(7, bytes(3)),
    ],
)
def test_the_walk_is_never_slow(tmp_path: Path, body: bytes) -> None:
    """Two megabytes of what might lead walkers astray, in the time that 40 MB should take."""
    data = header() + body * (2_000_000 // len(body))
    start = time.perf_counter()
    places = walk(data, tmp_path)
    assert time.perf_counter() - start < 5.0
    assert places.tolist() == walked(data)


# --- declared sizes -----------------------------------------------------------------------


def test_declared_sizes_cost_nothing(tmp_path: Path) -> None:
    """Palettes, pools, masks and copies that declare four thousand million entries."""
    huge = 2**32 - 1
    switch = node(96, "s", 28, {16: struct.pack(">3I", 0, 1, huge)})
    pool = node(84, "m", 84) + record(85, struct.pack(">II", huge, huge))
    content = one_square(switch + inside(group("a")), pool)
    content = content.replace(struct.pack(">HHI", 67, 8, 168), struct.pack(">HHI", 67, 8, huge))
    tracemalloc.start()
    load(tmp_path, content)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


def test_light_points_beyond_a_limit_are_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A point is named by 4 bytes, and its lamp is many times as large."""
    monkeypatch.setattr("hdrusd.importers.flt_light_points.MOST_POINTS", 100_000)
    pool = Pool()
    (corner,) = pool.add(vertex((0, 0, 0)))
    points = node(111, "p", 156) + inside(*[record(72, struct.pack(">I", corner) * 16_000)] * 20)
    made = load(tmp_path, database(points, vertices=pool.data))
    assert made.scene.counts()["light_points"] == 100_000
    assert made.finding("light-point-limit").text.startswith("320000 light points, 100000 of them")


def test_many_small_meshes_take_time_in_proportion(tmp_path: Path) -> None:
    """Ten times as many mesh records and objects: not a hundred times as long."""
    taken = []
    for count in (300, 3000):
        pool = record(85, struct.pack(">II9d", 3, 0x80000000, 0, 0, 0, 1, 0, 0, 0, 1, 0))
        part = inside(record(86, struct.pack(">hHI3B", 4, 1, 3, 0, 1, 2)))
        own = thing("o", node(84, "m", 84) + pool + part)
        content = database(*[own] * count)
        start = time.process_time()
        made = load(tmp_path, content)
        taken.append(time.process_time() - start)
        assert len(made.scene.meshes) == count
    assert taken[1] < 40 * taken[0]
