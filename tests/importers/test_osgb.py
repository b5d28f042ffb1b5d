"""OpenSceneGraph's binary files by our own reader: hand-made bytes, real files."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from osgb_builder import SQUARE, Writer, load
from same_scene import differences

from hdrusd.errors import InputError
from hdrusd.importers import importer
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Report

#: Before block sizes, with old arrays, with short sizes, drawables that are no nodes yet; now.
WRITERS = [
    Writer(60, sizes=False),
    Writer(80, sizes=False),
    Writer(97, sizes=False),
    Writer(111),
    Writer(112, sizes=False),
    Writer(130),
    Writer(148),
    Writer(149),
    Writer(154),
    Writer(161),
    Writer(161, ">"),
    Writer(161, sizes=False),
]
_ids = [f"{w.version}{'sizes' if w.sizes else ''}{w.order}" for w in WRITERS]
each_writer = pytest.mark.parametrize("w", WRITERS, ids=_ids)
NOW = Writer()


def read(file: Path) -> tuple[LegacyScene, Report]:
    """A file by its suffix."""
    report = Report()
    return importer.read(Resolver(file, report), report), report


def dressed(w: Writer, image: bytes, name: str = "face") -> bytes:
    """A group with a geode whose state has a material, a mode and a texture."""
    material = w.material(21, "paint", diffuse=[0.1, 0.2, 0.3, 1.0])
    state = w.state(20, material, modes=((0x0B50, 0),), unit=w.texture(22, image))
    return w.group(1, w.geode(2, w.geometry(3, name), name="plate", state=state), name="top")


@each_writer
def test_every_version_in_either_byte_order(tmp_path: Path, w: Writer) -> None:
    pixels = w.image(23, "wall.rgb", 0, w.pixels(2, 1, 0x1907, bytes([7, 8, 9, 1, 2, 3])))
    found = load(tmp_path, w.file(dressed(w, pixels)))
    assert [node.name for node in found.nodes()] == ["top", "plate"]
    assert found.mesh.points.tolist() == np.reshape(SQUARE, (4, 3)).tolist()
    assert found.faces == [[0, 1, 2]]
    assert found.mesh.normals is not None
    assert found.mesh.normals.tolist() == [[0.0, 0.0, 1.0]]
    assert found.mesh.normals_interpolation == "constant"
    assert found.material.name == "paint"
    assert found.material.diffuse == (0.1, 0.2, 0.3)  # not 0.10000000149, of which nobody spoke
    assert found.material.shininess == 32.0
    assert not found.material.lit
    texture = found.material.diffuse_map
    assert texture is not None
    assert (texture.image.name, texture.wrap_s, texture.wrap_t) == ("wall.rgb", "repeat", "repeat")
    assert texture.image.pixels is not None
    assert texture.image.pixels.tolist() == [[[7, 8, 9], [1, 2, 3]]]
    assert found.codes() == {"osg-no-coordinates"}


@pytest.mark.parametrize("packed", ["0", "null", "zlib"])
def test_packed(tmp_path: Path, packed: str) -> None:
    root = NOW.group(1, NOW.geode(2, NOW.geometry(3)))
    found = load(tmp_path, NOW.file(root, packed, domains={"theirs": 3}))
    assert found.faces == [[0, 1, 2]]


def test_a_schema_in_the_file_says_which_fields_there_are(tmp_path: Path) -> None:
    w = NOW
    body = w.text("plate") + w.pack("i", 2)  # no container, and nothing of a node but these
    geode = w.object("osg::Geode", 1, body, w.pack("I", 0), b"\0")
    schema = "osg::Object=Name:26 DataVariance:27 \nosg::Node=NodeMask:11 \n"
    found = load(tmp_path, w.file(geode, schema=schema))
    assert (found.root.name, found.root.visible) == ("plate", False)


@dataclass(frozen=True)
class Buffered(Writer):
    """What a program writes whose arrays and primitive sets have buffer objects."""

    numbers: Iterator[int] = field(default_factory=lambda: count(90))

    def _held(self) -> bytes:
        own = self.pack("I", 0x8892, 0x88E4) + b"\0"  # what for, how often it changes, no copy
        buffer = self.object("osg::VertexBufferObject", next(self.numbers), self.named(), own)
        return self.named() + b"\1" + buffer


@pytest.mark.parametrize("sizes", [True, False])
def test_what_nothing_reads_is_passed_over(tmp_path: Path, sizes: bool) -> None:
    w = Buffered(sizes=sizes)
    found = load(tmp_path, w.file(w.group(1, w.geode(2, w.geometry(3)))))
    assert found.mesh.points.tolist() == np.reshape(SQUARE, (4, 3)).tolist()
    assert found.faces == [[0, 1, 2]]
    assert found.mesh.normals is not None
    assert found.codes() == set()


def test_an_object_is_shared_by_its_number(tmp_path: Path) -> None:
    w = NOW
    shared = w.geode(2, w.geometry(3), name="twice")
    root = w.group(1, shared, w.object("osg::Geode", 2), w.text("NULL"))
    found = load(tmp_path, w.file(root))
    assert [child.name for child in found.root.children] == ["twice", "twice"]
    assert found.root.children[0] is found.root.children[1]
    assert len(found.scene.meshes) == 1


def test_a_light_is_complete(tmp_path: Path) -> None:
    found = load(tmp_path, NOW.file(NOW.group(1, NOW.light_source(2))))
    light = found.light
    assert (light.name, light.kind, light.position) == ("lamp", "spot", (1.0, 2.0, 3.0))
    assert (light.diffuse, light.ambient) == ((1.0, 0.8, 0.5), (0.0, 0.0, 0.0))
    assert (light.attenuation, light.spot_cutoff) == ((1.0, 0.0, 0.25), 60.0)
    assert light.spot_exponent == 2.0
    assert "defaults" not in light.extras  # the text form leaves zeros out, this one nothing
    assert found.codes() == set()


def test_positions_keep_all_their_digits(tmp_path: Path) -> None:
    w = NOW
    matrix = np.eye(4)
    matrix[3, :3] = 4_470_912.123456, 557_034.987654, 321.5
    block = w.block(w.pack("d", *matrix.ravel()))
    moved = w.group(
        1, w.geode(2, w.geometry(3)), label="osg::MatrixTransform", more=w.pack("i", 0) + block
    )
    transform = load(tmp_path, w.file(moved)).root.transform
    assert isinstance(transform, np.ndarray)
    assert transform.tolist() == matrix.tolist()


def test_an_animation_path(tmp_path: Path) -> None:
    w = NOW
    point = w.pack("d", 4.0, 5.0, 6.0) + w.pack("d", 0.0, 0.0, 0.0, 1.0) + w.pack("d", 1, 1, 1)
    points = w.pack("I", 1) + w.block(w.pack("d", 0.5) + w.block(point))
    path = w.object("osg::AnimationPath", 5, w.named(), b"\1" + points, w.pack("i", 2))
    times = w.pack("d", 0.0, 0.0, 0.0) + b"\0" + w.pack("d", 2.0, 1.0) + b"\0"
    # osg::NodeCallback has no fields, and those of osg::Callback are none of this class's
    update = w.object("osg::AnimationPathCallback", 4, w.named(), b"\1" + path + times)
    moved = w.group(
        1,
        w.geode(2, w.geometry(3)),
        label="osg::MatrixTransform",
        update=update,
        more=w.pack("i", 0) + w.block(w.pack("d", *np.eye(4).ravel())),
    )
    found = load(tmp_path, w.file(moved))
    translation = found.root.animation[0]
    assert (translation.path, translation.loop) == ("translation", "none")
    assert translation.times.tolist() == [2.5]
    assert translation.values.tolist() == [[4.0, 5.0, 6.0]]


def test_light_points(tmp_path: Path) -> None:
    w = NOW
    sector = w.object(
        "osgSim::ConeSector", 3, w.named(), w.pack("f", 0, 0, -1), b"\1" + w.pack("f", 0.5, 0.25)
    )
    seen = w.pack("f", 1, 2, 3) + w.pack("f", 1, 0.5, 0.25, 1) + b"\1" + w.pack("i", 0)
    seen += w.pack("f", 0.75, 0.125) + b"\1" + w.block(sector) + b"\0"
    points = w.pack("I", 1) + w.block(w.block(seen))
    more = w.pack("f", 0, 30, 1e30) + b"\0\0"
    node = w.object("osgSim::LightPointNode", 2, w.node("studs"), b"\1" + points + more)
    found = load(tmp_path, w.file(w.group(1, node)))
    (light,) = found.scene.lights
    assert light.positions is not None
    assert light.positions.tolist() == [[1.0, 2.0, 3.0]]
    assert light.diffuse == (0.75, 0.375, 0.1875)
    assert light.radius == 0.125
    assert light.spot_cutoff == pytest.approx(np.degrees(0.75), abs=1e-9)
    assert found.codes() == set()


def test_switches_and_levels(tmp_path: Path) -> None:
    w = NOW
    sets = w.pack("I", 2) + w.block(
        w.pack("I", 2) + w.block(b"\1\0") + w.pack("I", 2) + w.block(b"\0\1")
    )
    children = [w.geode(number, name=f"g{number}") for number in (10, 11)]
    switch = w.group(
        2, *children, label="osgSim::MultiSwitch", more=b"\1" + w.pack("I", 1) + b"\1" + sets
    )
    ranges = w.pack("I", 2) + w.block(w.pack("f", 0.0, 50.0, 50.0, 400.0))
    lod = w.group(
        3,
        *(w.object("osg::Geode", number) for number in (10, 11)),
        label="osg::LOD",
        more=w.pack("i", 0) + b"\0" + w.pack("i", 0) + b"\1" + ranges,
    )
    found = load(tmp_path, w.file(w.group(1, switch, lod)))
    first, second = found.root.children
    assert (first.kind, first.switch_on) == ("switch", (False, True))
    assert first.switch_masks == (("set0", (True, False)), ("set1", (False, True)))
    assert (second.kind, second.lod_ranges) == ("lod", ((0.0, 50.0), (50.0, 400.0)))


def test_a_compressed_picture(tmp_path: Path) -> None:
    blocks = struct.pack("<HHI", 0xF800, 0x001F, 0)  # 4 x 4 pixels of the first colour, red
    held = NOW.pixels(4, 4, 33776, blocks)
    found = load(tmp_path, NOW.file(dressed(NOW, NOW.image(23, "wall.dds", 0, held))))
    texture = found.material.diffuse_map
    assert texture is not None
    assert texture.image.data is not None
    assert texture.image.data[:4] == b"DDS "
    assert texture.image.data[84:88] == b"DXT1"
    assert texture.image.data[128:] == blocks
    assert texture.transform is not None  # t runs down
    assert texture.transform.scale == (1.0, -1.0)


def test_a_picture_file_in_the_file(tmp_path: Path) -> None:
    png = b"\x89PNG\r\n\x1a\n and so on"
    held = NOW.pack("I", len(png)) + png
    found = load(tmp_path, NOW.file(dressed(NOW, NOW.image(23, "wall.png", 1, held))))
    texture = found.material.diffuse_map
    assert texture is not None
    assert (texture.image.data, texture.transform) == (png, None)


def test_a_picture_by_name(tmp_path: Path) -> None:
    (tmp_path / "wall.png").write_bytes(b"\x89PNG")
    found = load(tmp_path, NOW.file(dressed(NOW, NOW.image(23, "wall.png"))))
    texture = found.material.diffuse_map
    assert texture is not None
    assert texture.image.path == tmp_path / "wall.png"


def test_places_are_bytes(tmp_path: Path) -> None:
    data = NOW.file(dressed(NOW, NOW.image(23, "gone.png")))
    found = load(tmp_path, data)
    place = found.finding("file-missing").source.place
    assert isinstance(place, str)
    start = int(place.removeprefix("byte "))
    assert data[start:].startswith(b"\1" + NOW.text("osg::Image"))


# --- real files ---------------------------------------------------------------------------


def test_the_street_is_that_of_the_text(testdata: Path) -> None:
    text, _ = read(testdata / "data/derived-osg/night_street.osgt")
    scene, _ = read(testdata / "data/derived-osg/night_street.osgb")
    # the text has six digits
    found = differences(text, scene, rtol=5e-6)
    picture = "materials[2].diffuse_map.image"
    lights = [f"lights[{n}].extras" for n in range(6)]  # which fields the text leaves out
    assert set(found) == {"source", "generator", f"{picture}.path", f"{picture}.pixels", *lights}


@pytest.mark.parametrize(
    ("name", "meshes", "triangles", "materials", "textures", "lights"),
    [  # counted by another reader; one more material than osg::Materials in street_lamp, OpenGL's
        ("derived-osg/night_street.osgb", 14, 86, 4, 1, 6),
        ("derived-osg/lamp_post.osgb", 1, 270, 1, 1, 1),
        ("osgearth/data/street_lamp.osgb", 1, 2024, 1, 1, 1),
        ("osgearth/data/streetlight.osgb", 4, 2152, 4, 0, 0),
    ],
)
def test_real_files_need_no_other_program(
    testdata: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    meshes: int,
    triangles: int,
    materials: int,
    textures: int,
    lights: int,
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    scene, report = read(testdata / "data" / name)
    found = scene.counts()
    want = {"meshes": meshes, "triangles": triangles, "materials": materials}
    want |= {"textures": textures, "lights": lights}
    assert {key: found[key] for key in want} == want
    assert not {"osg-unread", "osgb-osgconv"} & report.codes()
    maps = [material.diffuse_map for material in scene.materials if material.diffuse_map]
    assert all(texture.image.data or texture.image.pixels is not None for texture in maps)


def test_hostile_files(testdata: Path) -> None:
    for name, said in (("trunc_streetlight", "are left"), ("lfs_pointer", "Git LFS pointer")):
        with pytest.raises(InputError, match=f"{name}.osgb:.*{said}.*; ?want|{said}"):
            read(testdata / "data/hostile" / f"{name}.osgb")
