"""The block tree of .osgt and .osg, and what broken files do."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from osg_builder import (
    HEADER,
    array,
    coordinates,
    geode,
    geometry,
    group,
    inlined,
    light_source,
    load,
    material,
    old_geode,
    old_geometry,
    old_group,
    quick,
    scene,
    state_set,
    texture,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.importers.osg_text import Block, Document, parse
from hdrusd.report import Report

FILE = Path("scene.osgt")


def parsed(text: str | bytes, limits: Limits | None = None) -> Document:
    """The document of a text."""
    content = text if isinstance(text, bytes) else text.encode()
    return parse(content, FILE, Report(), limits or Limits())


def test_lines_are_counted_past_what_nothing_reads() -> None:
    buffered = "BufferObject TRUE {\n  osg::VertexBufferObject {\n    UniqueID 8 \n  }\n}\n"
    document = parsed(f"{HEADER}osg::Vec3Array {{\nUniqueID 7 \n{buffered}Binding BIND_OFF \n}}\n")
    array = document.root.statements[0]
    binding = document.field(array, "binding")
    assert binding is not None
    assert binding.words == ["Binding", "BIND_OFF"]
    assert binding.line == HEADER.count("\n") + 8
    assert document.definitions["7"] is array


@pytest.mark.parametrize(
    ("block", "indices"),
    [
        (Block(raw=b""), []),
        (Block(raw=b" \n "), []),
        (Block(raw=b" 0 2\n7 "), [0, 2, 7]),
        (Block(raw=b"-1 2"), [-1, 2]),
        (Block(raw=b"1e2 .5e1 -"), [100, 5, -1]),
        (Block(raw=b"9007199254740991 9007199254740992"), [9007199254740991, -1]),
        (Block(raw=b"99999999999999999999 1"), [-1, 1]),
        (Block(values=np.array([0, 65535], np.uint16)), [0, 65535]),
        (Block(values=np.array([0, 65535], ">u2")), [0, 65535]),
        (Block(values=np.array([3, -7], np.int32)), [3, -1]),
        (Block(values=np.array([4.0, np.nan, np.inf])), [4, -1, -1]),
    ],
)
def test_indices(block: Block, indices: list[int]) -> None:
    assert block.indices().tolist() == indices
    assert block.indices().dtype == np.int64


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b" \r\n\t", "empty"),
        (b"\xef\xbb\xbf", "empty"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS pointer"),
        (b"\xa1\x0e\x91\x6c\x45\x45\xfb\x1a\0\0", "binary"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "binary"),
        (b"#Ascii Image \n#Version 161 \n", "want #Ascii Scene"),
        (HEADER.encode() + b"osg::Group {\n", "not closed"),
        (HEADER.encode() + b"osg::Group {\nMatrix {\n1 0 0 0\n", "not closed"),
        (HEADER.encode() + b"osg::Group {\n}\n}\n", "nothing is open"),
        (b'Group {\nname "never closed\n}\n', 'want "'),
        (b"hello world", "no node of a known class"),
        (HEADER.encode(), "no node of a known class"),
    ],
)
def test_what_is_no_such_file_is_refused(tmp_path: Path, content: bytes, says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        load(tmp_path, content)


def test_an_unclosed_block_is_named_with_the_line_where_it_opens() -> None:
    with pytest.raises(InputError, match=re.escape("scene.osgt:2: Group: block not closed")):
        parsed("\nGroup {\n  StateSet {\n  }\n")


def test_depth_is_limited_and_needs_no_recursion() -> None:
    deep = "Group {\n" * 5000 + "}\n" * 5000
    with pytest.raises(InputError, match="deeper than 256"):
        parsed(deep)
    assert len(parsed(deep, Limits(depth=5000)).root.statements) == 1


def test_a_brace_on_its_own_line_belongs_to_the_line_before() -> None:
    root = parsed("VertexArray Vec3Array 2\n{\n 1 2 3\n 4 5 6\n}\nnext 1\n").root
    first, second = root.statements
    assert first.words == ["VertexArray", "Vec3Array", "2"]
    assert first.block is not None
    np.testing.assert_array_equal(first.block.numbers(), [1, 2, 3, 4, 5, 6])
    assert (second.words, second.line) == (["next", "1"], 6)


def test_text_keeps_its_escapes_braces_and_lines() -> None:
    text = 'name "a \\"quoted\\" {brace}\nand C:\\\\dir" last\nnext\n'
    first, second = parsed(text).root.statements
    assert first.words == ["name", 'a "quoted" {brace}\nand C:\\dir', "last"]
    assert second.line == 3


def test_windows_lines_and_latin_1_names(tmp_path: Path) -> None:
    text = old_group(fields='name "Stra\xdfe"').replace("\n", "\r\n").encode("latin-1")
    assert load(tmp_path, text).root.name == "Straße"


def test_a_field_is_found_under_the_names_of_both_formats() -> None:
    document = parsed("Light {\nspot_cutoff 30\nLightNum 2\n}\n")
    (light,) = document.root.statements
    assert document.number(light, 180.0, "spotcutoff") == 30.0
    assert document.number(light, 0.0, "lightnum") == 2.0
    assert document.number(light, 7.0, "spotexponent") == 7.0


@given(st.lists(st.floats(allow_nan=False, width=32), max_size=40))
def test_numbers_in_bulk_are_the_numbers_one_by_one(values: list[float]) -> None:
    text = "vector 3 {\n" + " \n".join(f"{value:.9g}" for value in values) + "\n}\n"
    (statement,) = parsed(text).root.statements
    assert statement.block is not None
    assert statement.block.numbers().tolist() == [float(f"{value:.9g}") for value in values]


def test_what_is_no_number_becomes_nan_and_the_rest_stays() -> None:
    for block in ("{ 1 2 1-2 4 }", "{\n1 2\n1.#QNAN 4\n}", "{\nUniqueID X_1\n1 2\nnan 4\n}"):
        (statement,) = parsed(f"vector 4 {block}\n").root.statements
        assert statement.block is not None
        np.testing.assert_array_equal(statement.block.numbers(), [1, 2, np.nan, 4])


def test_lines_of_findings_are_lines_of_the_file(tmp_path: Path) -> None:
    text = scene("osg::Group {\nUnknown 1 \n}", "osgText::Text {\n}")
    place = load(tmp_path, text).finding("osg-node-class").source.place
    assert text.splitlines()[int(str(place)) - 1] == "osgText::Text {"


#: One small file of each syntax with something of everything.
RICH_NEW = scene(
    geode(
        geometry(more=coordinates("0 0 \n1 0 \n1 1 \n0 1")),
        geometry(more=array("Color", "Vec4ubArray", "255 0 0 255", "BIND_OVERALL")),
        "osg::ShapeDrawable {\nShape TRUE {\nosg::Cone {\nRadius 2 \nHeight 4 \n}\n}\n}",
        fields=state_set(
            "GL_BLEND ON ",
            material('Name "m" \nDiffuse TRUE Front 1 0 0 1 Back 1 0 0 1 '),
            texture(inlined("2 1 1", 6407, "AAAAAAAA")),
        ),
    ),
    light_source("LightNum 1 \nDiffuse 1 1 1 1 \nPosition 1 2 3 1 \nSpotCutoff 45 "),
    group(
        "osg::Group {\nUniqueID 7 \n}",
        "osg::Group {\nUniqueID 7 \n}",
        kind="osg::Switch",
        fields="ValueList 2 {\nTRUE FALSE \n}",
    ),
    "osg::PositionAttitudeTransform {\nAttitude 0 0 0.6 0.8 \nPivotPoint 1 2 3 \n}",
)
RICH_OLD = old_group(
    old_geode(
        old_geometry(
            "DrawArrayLengths TRIANGLE_STRIP 0 1\n{\n4\n}",
            more="VertexIndices IntArray 4\n{\n0 1 3 2\n}\nNormalBinding PER_PRIMITIVE\n"
            "NormalArray Vec3Array 1\n{\n0 0 1\n}\nTexCoordArray 0 UniqueID A_1 Vec2Array 4\n"
            "{\n0 0\n1 0\n1 1\n0 1\n}\nTexCoordArray 1 Use A_1",
        ),
        fields="StateSet {\nUniqueID S_1\nGL_LIGHTING OVERRIDE|OFF\nMaterial {\n"
        "diffuseColor FRONT 1 0 0 1\n}\ntextureUnit 0 {\nGL_TEXTURE_2D ON\nTexMat {\n"
        "2 0 0 0 0 2 0 0 0 0 1 0 0 0 0 1\n}\n}\n}",
    ),
    "MatrixTransform {\nUpdateCallbacks {\nAnimationPathCallback {\nAnimationPath {\n"
    "LoopMode SWING\nControlPoints {\n0 0 0 0 0 0 0 1 1 1 1\n2 1 0 0 0 0 0 1 1 1 2\n}\n}\n}\n}\n"
    "Matrix {\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1\n}\nnum_children 1\nUse G_1\n}",
    "osgSim::LightPointNode {\nlightPoint {\nposition 0 0 1\ncolor 1 1 1 1\n}\n}",
    fields="UniqueID G_1",
)
SMALL = Limits(vertices=100_000, nodes=2_000, pixels=10_000)


@quick
@given(
    rich=st.sampled_from([RICH_NEW, RICH_OLD]),
    seed=st.integers(0, 2**32),
    edits=st.integers(1, 8),
)
def test_nothing_but_input_errors_escapes_from_damaged_files(
    tmp_path: Path, rich: str, seed: int, edits: int
) -> None:
    """Bytes overwritten, cut out and doubled, and words exchanged."""
    chance = random.Random(seed)
    data = bytearray(rich.encode())
    words = [b"{", b"}", b'"', b"nan", b"-1e308", b"9" * 30, b"Use", b"UniqueID", b"\0", b"\xff"]
    for _ in range(edits):
        start = chance.randrange(len(data))
        length = chance.randrange(1, 60)
        found = list(re.finditer(rb"\S+", bytes(data)))
        word = chance.choice(found)
        match chance.randrange(5):
            case 0:
                data[start] = chance.randrange(256)
            case 1:
                del data[start : start + length]
                data = data or bytearray(b" ")
            case 2:
                other = chance.randrange(len(data))
                data[start:start] = data[other : other + length]
            case 3:
                data[word.start() : word.end()] = chance.choice(words)
            case _:
                data[word.start() : word.end()] = chance.choice(found).group()
    try:
        loaded = load(tmp_path, bytes(data), limits=SMALL)
    except InputError:
        return
    for mesh in loaded.scene.meshes:
        assert np.isfinite(mesh.points).all()
        assert mesh.face_indices.max() < len(mesh.points)
        assert mesh.face_indices.min() >= 0
        assert mesh.face_counts.sum() == len(mesh.face_indices)
    document = json.loads(json.dumps(loaded.report.as_dict()))
    assert len(document["findings"]) == len(list(loaded.report))


def test_the_undamaged_files_are_read(tmp_path: Path) -> None:
    new, old = load(tmp_path, RICH_NEW), load(tmp_path, RICH_OLD)
    assert new.scene.counts()["meshes"] == 3
    assert new.scene.generator == "OpenSceneGraph 3.6.5"
    assert (old.faces, old.scene.generator) == ([[0, 1, 3], [3, 1, 2]], "")
