"""OpenSceneGraph's binary files that are cut, damaged, hostile or strange."""

from __future__ import annotations

import random
import shutil
import subprocess
import zlib
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from osg_builder import HEADER, SQUARE, quick
from osgb_builder import Loaded, Writer, load

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.report import Kind

NOW = Writer()
OLD = Writer(91, sizes=False)
#: A square, and a class with a field that only OpenSceneGraph reads.
SEGMENT = f"""{HEADER}
osg::Group {{
  UniqueID 1
  Children 2 {{
    osg::Geode {{
      UniqueID 2
      Drawables 1 {{
        osg::Geometry {{
          UniqueID 3
          PrimitiveSetList 1 {{
            osg::DrawArrays {{
              UniqueID 4
              Mode QUADS
              Count 4
            }}
          }}
          VertexArray TRUE {{
            osg::Vec3Array {{
              UniqueID 5
              Binding BIND_PER_VERTEX
              vector 4 {{
                {SQUARE}
              }}
            }}
          }}
        }}
      }}
    }}
    osgSim::SphereSegment {{
      UniqueID 6
    }}
  }}
}}
"""
BOTH = pytest.mark.parametrize("w", [NOW, OLD], ids=["sizes", "no_sizes"])


def plate(w: Writer) -> bytes:
    """A file with most kinds of fields."""
    pixels = w.image(23, "wall.rgb", 0, w.pixels(2, 1, 0x1907, bytes(6)))
    material = w.material(21, "paint")
    state = w.state(20, material, modes=((0x0B50, 0),), unit=w.texture(22, pixels))
    geode = w.geode(2, w.geometry(3), name="plate", state=state)
    return w.file(w.group(1, geode, w.light_source(30), name="top"))


@pytest.fixture
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without osgconv."""
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))


def refused(folder: Path, data: bytes, limits: Limits | None = None) -> str:
    """The message of the refusal: one line that names the file."""
    with pytest.raises(InputError) as caught:
        load(folder, data, limits)
    text = str(caught.value)
    assert text.startswith("scene.osgb")
    assert "\n" not in text
    return text


def may_refuse(folder: Path, data: bytes) -> Loaded | None:
    """A scene, or None for a refusal; no other exception may leave."""
    with suppress(InputError):
        return load(folder, data)
    return None


@pytest.mark.usefixtures("alone")
@BOTH
def test_cut_anywhere(tmp_path: Path, w: Writer) -> None:
    data = plate(w)
    assert load(tmp_path, data).faces == [[0, 1, 2]]
    for length in range(0, len(data), 3):
        refused(tmp_path, data[:length])


@pytest.mark.usefixtures("alone")
@BOTH
def test_any_byte_may_be_another(tmp_path: Path, w: Writer) -> None:
    data, chance = plate(w), random.Random(7)
    for at in range(0, len(data), 2):
        changed = bytearray(data)
        changed[at] ^= chance.choice((1, 0x80, 0xFF))
        may_refuse(tmp_path, bytes(changed))


@pytest.mark.usefixtures("alone")
@quick
@given(
    old=st.booleans(),
    edits=st.lists(st.tuples(st.floats(0.0, 1.0), st.binary(max_size=9)), max_size=6),
    cut=st.integers(0, 40),
)
def test_pieces_replaced(
    tmp_path: Path, old: bool, edits: list[tuple[float, bytes]], cut: int
) -> None:
    data = plate(OLD if old else NOW)
    for where, piece in edits:
        at = 8 + int(where * (len(data) - 8))
        data = data[:at] + piece + data[at + len(piece) :]
    may_refuse(tmp_path, data[: len(data) - cut])


def test_a_real_file_damaged(testdata: Path, tmp_path: Path) -> None:
    whole = (testdata / "data/derived-osg/night_street.osgb").read_bytes()
    chance = random.Random(3)
    for _ in range(60):
        changed = bytearray(whole)
        for _ in range(chance.randint(1, 20)):
            changed[chance.randrange(8, len(whole))] = chance.randrange(256)
        may_refuse(tmp_path, bytes(changed))


# --- what is not known --------------------------------------------------------------------


def strange(w: Writer) -> bytes:
    """An object of somebody's own class beside a geode."""
    own = w.object("ours::Tree", 9, w.node("oak"), b"leaves and all that")
    return w.file(w.group(1, own, w.geode(2, w.geometry(3), name="plate")))


def test_a_class_that_is_not_known_is_passed_over(tmp_path: Path) -> None:
    found = load(tmp_path, strange(NOW))
    assert found.faces == [[0, 1, 2]]
    assert [child.name for child in found.root.children] == ["Tree", "plate"]
    finding = found.finding("osg-unread")
    assert finding.kind is Kind.DROPPED
    assert finding.text.startswith("ours::Tree is no class that is known here; ")


@pytest.mark.usefixtures("alone")
def test_without_sizes_it_ends_the_reading(tmp_path: Path) -> None:
    text = refused(tmp_path, strange(OLD))
    assert "ours::Tree is no class that is known here" in text
    assert "install the package openscenegraph" in text


@pytest.mark.skipif(shutil.which("osgconv") is None, reason="osgconv is missing")
def test_then_osgconv_is_asked(tmp_path: Path) -> None:
    """A field that we do not know: the area of a SphereSegment."""
    (tmp_path / "a.osgt").write_text(SEGMENT, encoding="ascii")
    arguments = ["osgconv", "-O", "RobustBinaryFormat=false", "a.osgt", "a.osgb"]
    subprocess.run(arguments, cwd=tmp_path, check=True)
    found = load(tmp_path, (tmp_path / "a.osgb").read_bytes())
    assert found.mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert found.finding("osgb-osgconv").text.endswith("Area is not known here; read by osgconv")


def test_what_was_passed_over_cannot_be_referred_to(tmp_path: Path) -> None:
    w = NOW
    inside = w.geode(7, w.geometry(3))
    own = w.object("ours::Tree", 9, w.node("oak"), inside)
    found = load(tmp_path, w.file(w.group(1, own, w.object("osg::Geode", 7))))
    assert found.finding("osg-reference").kind is Kind.MISSING


def test_damage_inside_an_object_costs_that_object(tmp_path: Path) -> None:
    w = NOW
    broken = w.object(
        "osg::Geode", 8, w.node("broken"), b"\1", w.pack("I", 3), w.block(b"\xff" * 9)
    )
    found = load(tmp_path, w.file(w.group(1, broken, w.geode(2, w.geometry(3), name="plate"))))
    assert [child.name for child in found.root.children] == ["broken", "plate"]
    assert found.faces == [[0, 1, 2]]
    assert found.finding("osg-unread").kind is Kind.INVALID


# --- what is only declared ----------------------------------------------------------------


@pytest.mark.parametrize("count", [4, 0x7FFFFFFF, 0xFFFFFFFF])
def test_counts_are_not_believed(tmp_path: Path, count: int) -> None:
    w = Writer(161, sizes=False)
    root = w.object("osg::Group", 1, w.node(), b"\1", w.pack("I", count), w.group(2))
    assert "4 bytes wanted, 0 are left; want a whole" in refused(tmp_path, w.file(root))


def test_an_array_longer_than_the_file(tmp_path: Path) -> None:
    w = Writer(161, sizes=False)
    rows = w.pack("i", 4) + b"\0\0" + w.pack("I", 0xFFFFFFF0)
    array = w.object("osg::Vec4dArray", 3, w.named(), b"\0", rows)
    body = w.pack("I", 0) + b"\1" + array
    geometry = w.object("osg::Geometry", 2, w.drawable(), body)
    text = refused(tmp_path, w.file(w.geode(1, geometry)))
    assert f"{0xFFFFFFF0 * 32} bytes wanted" in text


def test_a_bomb(tmp_path: Path) -> None:
    packer = zlib.compressobj(9, wbits=zlib.MAX_WBITS | 16)
    zeros = b"".join(packer.compress(bytes(1 << 20)) for _ in range(80)) + packer.flush()
    data = NOW.file(b"")[:-5] + NOW.text("zlib") + zeros
    assert len(data) < 100_000
    assert "unpacks to more than 67108864 bytes" in refused(tmp_path, data)
    assert "unpacks to more than 1000000 bytes" in refused(
        tmp_path, data, Limits(file_bytes=1_000_000)
    )


@pytest.mark.parametrize("w", [NOW, Writer(161, sizes=False)], ids=["sizes", "no_sizes"])
def test_deep_nesting(tmp_path: Path, w: Writer) -> None:
    data = w.group(10_000)
    for number in range(3_000):
        data = w.group(number, data)
    assert "objects deeper than 256" in refused(tmp_path, w.file(data))


def test_as_deep_as_is_allowed(tmp_path: Path) -> None:
    data = NOW.geode(10_000, NOW.geometry(9_000))
    for number in range(200):
        data = NOW.group(number, data)
    assert load(tmp_path, NOW.file(data)).faces == [[0, 1, 2]]


def test_too_many_objects(tmp_path: Path) -> None:
    w = NOW
    groups = [w.group(number) for number in range(2, 200)]
    assert "more than 160 objects" in refused(
        tmp_path, w.file(w.group(1, *groups)), Limits(nodes=10)
    )


def test_a_node_inside_itself(tmp_path: Path) -> None:
    w = NOW
    root = w.group(1, w.group(2, w.object("osg::Group", 1)), w.geode(3, w.geometry(4)))
    found = load(tmp_path, w.file(root))
    assert found.faces == [[0, 1, 2]]
    assert "osg-cycle" in found.codes()


# --- heads --------------------------------------------------------------------------------


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "empty"),
        (b"\x89PNG\r\n\x1a\n" + bytes(99), "not .osgb, by its first bytes"),
        (NOW.pack("I", 0x6C910EA1, 0x1AFB4545), "want a head of 20"),
        (NOW.pack("I", 0x6C910EA1, 0x1AFB4545, 2, 161, 4) + bytes(9), "holds 2; want 1, a scene"),
        (NOW.file(b"")[:-5] + NOW.text("brotli"), "compressed by brotli; want zlib or none"),
        (NOW.file(b"")[:-5] + NOW.pack("I", 0xFFFFFFFF), "text of 4294967295 bytes"),
        (NOW.file(b"")[:-5] + NOW.text("zlib") + b"\x1f\x8bnoise", "packed part is damaged"),
        (NOW.file(NOW.group(1), "zlib")[:-20], "packed part is cut"),
    ],
)
def test_heads(tmp_path: Path, data: bytes, said: str) -> None:
    assert said in refused(tmp_path, data)
