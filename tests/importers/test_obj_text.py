"""The text of OBJ files: encodings, line ends, continued lines, numbers in bulk."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from obj_builder import TRIANGLE, load_text, quick

from hdrusd.importers import obj_statements, obj_text

TEXT = "# c\nv 0 0 0\nv 1 0 0\n\nv 0 1 0\no métal\nf 1 2 3\n"


@pytest.mark.parametrize(
    "content",
    [
        TEXT.encode(),
        TEXT.replace("\n", "\r\n").encode(),
        TEXT.replace("\n", "\r").encode(),
        TEXT.replace(" ", "\t ").replace("métal", "métal \t").encode(),
        b"\xef\xbb\xbf" + TEXT.encode(),
        TEXT.encode("utf-16"),
        b"\xfe\xff" + TEXT.encode("utf-16-be"),
        TEXT.encode("latin-1"),
        TEXT.rstrip("\n").encode(),
        TEXT.replace("f 1 2 3", "f 1 \\\n2\\\n 3").encode(),
        TEXT.replace("f 1 2 3", "f 1 \\\r\n2 3").encode(),
    ],
)
def test_encodings_line_ends_and_continued_lines(tmp_path: Path, content: bytes) -> None:
    loaded = load_text(tmp_path, content)
    assert loaded.mesh.name == "métal"
    assert loaded.mesh.source.place == 6
    assert loaded.mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert ("encoding" in loaded.report.codes()) == (content == TEXT.encode("latin-1"))


def test_line_numbers_count_continued_lines(tmp_path: Path) -> None:
    loaded = load_text(
        tmp_path, "v 0 \\\n 0 0\n" + "v 1 0 0\nv 0 1 0\n" + "o x\nf 1 2 3\nf 1 2 9\n"
    )
    assert loaded.mesh.source.place == 5
    assert loaded.finding("face-index").source.place == 7


def test_a_comment_is_not_continued(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "# C:\\models\\\n" + TRIANGLE + "v 1 \\\n1 1\nf 1 2 3\n")
    assert loaded.corner_points == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@given(st.integers(1, 80), st.sampled_from(["\n", "\\\n", "  \\\n"]))
@quick
def test_blocks_of_any_size_hold_the_same_lines(size: int, joint: str) -> None:
    text = f"v 0 0 0\n  # c \\\n\nf 1{joint} 2 3\n\t g x\nv 1 1 1\nusemtl {'y' * 50}\nf 3 2 1\n"
    whole, parts = (
        [
            (int(number), block.line(index).split())
            for block in obj_text.blocks(text.encode(), Path("x.obj"), size=length)
            for index, number in enumerate(block.numbers)
            if block.line(index)
        ]
        for length in (1 << 20, size)
    )
    assert parts == whole
    physical = text.count("\n")
    assert whole[-1] == (physical, [b"f", b"3", b"2", b"1"])


@pytest.mark.parametrize("size", [1, 30, 70, 1 << 20])
def test_statements_of_one_block_reach_into_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    """Indices that count back, colours, the current object and material, and line numbers."""
    monkeypatch.setattr(obj_statements, "blocks", partial(obj_text.blocks, size=size))
    text = "v 0 0 0\nv 1 0 0\nvt 0 0\nvt 1 0\no a\nusemtl x\nv 0 1 0 1 0 0\n\nvt 0 1\n"
    text += "f -3/-3 -2/-2 -1/-1\nusemtl y\nv 5 5 5\nf -1 -2 -3\nf 1 2 9\no b\nf 1 2 4\n"
    loaded = load_text(tmp_path, text)
    first, second = loaded.scene.meshes
    assert first.points[first.face_indices].tolist() == [
        *([0, 0, 0], [1, 0, 0], [0, 1, 0]),
        *([5, 5, 5], [0, 1, 0], [1, 0, 0]),
    ]
    assert first.uvs["st"][0].tolist()[:3] == [[0, 0], [1, 0], [0, 1]]
    assert first.colors is not None
    assert first.colors.tolist() == [[1, 1, 1, 1], [1, 1, 1, 1], [1, 0, 0, 1], [1, 1, 1, 1]]
    assert {s.material: s.faces.tolist() for s in first.subsets} == {0: [0], 1: [1]}
    assert (second.name, second.material, second.source.place) == ("b", 1, 15)
    assert loaded.finding("face-index").source.place == 14


WORDS = st.text("0123456789/-+.x", min_size=1, max_size=7)


@given(st.lists(st.lists(WORDS, max_size=5), min_size=1, max_size=6))
@quick
@example([["1/2/3/4", "5//6"], ["/1", "//", "1//2/3"]])
@example([["1_0", "+2", "--3", "1.0", "007"]])
@example([["1/2/3", "4/5/6", "7/8/9"], ["1/2/3", "-4/5/-6", "7/8/9"]])
@example([["1//3", "4//6", "7//9"]])
@example([["1/2", "4/5", "7/8"]])
@example([["1", "4", "7"]])
@example([["1", "4/5/6"]])  # as many numbers and slashes as of two v/t
@example([["1//3", "4/5/"], ["/1/2", "1/2/"]])  # as of v//n
@example([["1/2/3/4", "5/6"]])  # as of v/t/n
def test_a_broken_word_breaks_only_its_own_corner(lines: list[list[str]]) -> None:
    """Every word alone: up to three integers between slashes, or nothing of it is used."""
    data = "".join(f"f {' '.join(words)}\n" for words in lines).encode()
    (block,) = obj_text.blocks(data, Path("x.obj"))
    table, counts = obj_text.corners(block.arguments(block.byte(0) == ord("f"), 1))
    assert counts.tolist() == [len(words) for words in lines]
    wanted = []
    for word in (word for words in lines for word in words):
        parts = word.split("/")
        legal = len(parts) <= 3 and all(re.fullmatch(r"([+-]?\d+)?", part) for part in parts)
        wanted.append(([int(part or 0) for part in parts] + [0, 0])[:3] if legal else [0, 0, 0])
    assert table.tolist() == wanted
