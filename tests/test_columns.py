"""Text by the columns that it takes on a terminal."""

from __future__ import annotations

from pathlib import Path

import pytest
from builders import gltf_lights
from converted import run

from hdrusd.account.text import summary
from hdrusd.columns import columns, cut, padded, wrapped


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("", 0),
        ("lamp", 4),
        ("läm", 3),
        ("la\u0308m", 3),  # the dots combine with the letter before them
        ("街灯", 4),  # wide
        ("ＬＥＤ", 6),  # fullwidth
        ("ｶﾞ", 2),  # halfwidth
        ("한글", 4),
    ],
)
def test_east_asian_characters_are_two_columns_wide(text: str, count: int) -> None:
    assert columns(text) == count


@pytest.mark.parametrize("width", range(4, 12))
def test_what_is_cut_or_padded_has_its_width(width: int) -> None:
    for text in ("街灯街灯街灯", "a街灯街灯街灯", "lamp", "a long name of a lamp"):
        short = cut(text, width)
        assert columns(short) <= width
        assert short == text or (short.endswith("...") and text.startswith(short[:-3]))
        assert columns(padded(text, width)) == width


@pytest.mark.parametrize("width", [9, 10, 40])
def test_lines_fit_and_lose_nothing(width: int) -> None:
    text = "街灯の光は明るい street  lamps 道路照明器具街灯の光"
    lines = wrapped(text, width, "  ")
    assert max(map(columns, lines)) <= width
    assert "".join("".join(lines).split()) == "".join(text.split())
    assert all(line.startswith("  ") for line in lines[1:])
    assert wrapped("", width) == []


def test_two_blanks_in_a_name_stay() -> None:
    assert wrapped('match = "a  b"', 60) == ['match = "a  b"']


def test_the_table_of_lights_is_straight(tmp_path: Path) -> None:
    lamps = [
        {"name": name, "type": "point", "intensity": 100.0 * n}
        for n, name in enumerate(("街灯", "lamp", "道路照明器具" * 9), start=1)
    ]
    lines = summary(run(gltf_lights(tmp_path / "a.gltf", lamps)).as_dict(), 100)

    def wide(text: str) -> int:
        return sum(2 if "\u4e00" <= c <= "\u9fff" else 1 for c in text)

    table = [line.rpartition("  ") for line in lines[1:5]]
    assert [last for _, _, last in table] == ["confidence", "medium", "medium", "medium"]
    assert len({wide(before) for before, _, _ in table}) == 1
    assert max(map(wide, lines)) <= 100
