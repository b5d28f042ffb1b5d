"""usdrecord's frame grammar and file names."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import UsdUtils

from hdrusd.errors import HdrusdError
from hdrusd.frames import (
    FrameError,
    check_pattern,
    find_frames,
    format_frames,
    frame_path,
    has_placeholder,
    parse_frames,
)


@pytest.mark.parametrize(
    ("spec", "times"),
    [
        ("123", [123.0]),
        ("101:105", [101.0, 102.0, 103.0, 104.0, 105.0]),
        ("105:101", [105.0, 104.0, 103.0, 102.0, 101.0]),
        ("101:109x2", [101.0, 103.0, 105.0, 107.0, 109.0]),
        ("101:104x0.5", [101.0, 101.5, 102.0, 102.5, 103.0, 103.5, 104.0]),
        ("105:101x-2", [105.0, 103.0, 101.0]),
        ("1:2x5", [1.0]),
        ("-3:-1", [-3.0, -2.0, -1.0]),
        ("1,5:6, 3", [1.0, 5.0, 6.0, 3.0]),
    ],
)
def test_grammar(spec: str, times: list[float]) -> None:
    """The examples of usdrecord's help (OpenUSD 26.11, framesArgs.py) and a few more."""
    assert parse_frames(spec) == times


@given(
    st.integers(-2000, 2000),
    st.integers(-500, 500),
    st.sampled_from(["", "1", "2", "7", "0.5", "0.25"]),
)
def test_ranges_are_those_of_openusd(first: int, length: int, stride: str) -> None:
    """UsdUtils.TimeCodeRange is what usdrecord counts with."""
    sign = "-" if length < 0 and stride else ""
    spec = f"{first}:{first + length}" + (f"x{sign}{stride}" if stride else "")
    wanted = [code.GetValue() for code in UsdUtils.TimeCodeRange.CreateFromFrameSpec(spec)]
    assert parse_frames(spec) == wanted


def test_fractions_do_not_drift() -> None:
    """0.1 a thousand times: each time code is the nearest float to its decimal."""
    assert parse_frames("0:100x0.1") == [k / 10 for k in range(1001)]


@given(st.lists(st.floats(-1e9, 1e9, allow_nan=False, width=64), min_size=1, max_size=20))
def test_parse_undoes_format(times: list[float]) -> None:
    assert parse_frames(format_frames(times)) == times


@pytest.mark.parametrize(
    "spec",
    [
        *["", ",", "x", "1:", ":1", "1x2", "1:2x", "1:2x0", "1:5x-1", "1:2:3", "1:4x2x1", "a:b"],
        *["nan", "inf", "1:inf", "1e400", "1e999999999", "1:1e999999x1e-999999", "1:2x1e-12"],
        *["1:2,", "0x1"],
    ],
)
def test_nonsense_is_refused_in_one_line(spec: str) -> None:
    with pytest.raises(FrameError) as problem:
        parse_frames(spec)
    assert str(problem.value).startswith("--frames")
    assert "\n" not in str(problem.value)
    assert problem.value.exit_code == 2


@pytest.mark.parametrize("spec", ["1:1000000000", "0:1000x0.0001", "1:600000,1:600000"])
def test_too_many_frames(spec: str) -> None:
    with pytest.raises(FrameError, match="more than 1000000 frames"):
        parse_frames(spec)


@pytest.mark.parametrize(
    ("pattern", "time", "name"),
    [
        ("out.####.exr", 7.0, "out.0007.exr"),
        ("out.####.exr", 12345.0, "out.12345.exr"),
        ("out.#.exr", 7.0, "out.7.exr"),
        ("out.###.###.exr", 7.25, "out.007.250.exr"),
        ("out_##.#_a.exr", 7.5, "out_07.5_a.exr"),
        ("out.####.exr", -2.0, "out.-002.exr"),
        ("out.exr", 7.0, "out.exr"),
    ],
)
def test_file_names(pattern: str, time: float, name: str) -> None:
    assert frame_path(f"a/b#c/{pattern}", time) == Path(f"a/b#c/{name}")
    assert has_placeholder(f"a/b#c/{pattern}") is (name != pattern)


@pytest.mark.parametrize(
    ("pattern", "times", "wanted"),
    [
        ("out.exr", [1.0, 2.0], "no frame placeholder"),
        ("out.exr", [1.0], "no frame placeholder"),
        ("out.####_##.exr", [1.0], "two frame placeholders"),
        ("out.####.exr", [1.0, 1.5], "frame|fraction"),
        ("out.####.exr", [1.5], "###.###"),
        ("out.##.#.exr", [0.25], "###.###"),
        ("out.####.exr", None, "no frames"),
    ],
)
def test_patterns_that_cannot_hold_the_frames(
    pattern: str, times: list[float] | None, wanted: str
) -> None:
    """As usdrecord: exactly one placeholder with frames, none without, enough precision."""
    with pytest.raises(FrameError, match=wanted):
        check_pattern(pattern, times)


def test_good_patterns() -> None:
    check_pattern("out.####.exr", [1.0, 2.0])
    check_pattern("out.###.###.exr", [1.0, 1.125])
    check_pattern("out.####.exr", [1.0, 1.0])  # the same frame twice is one file
    check_pattern("out.exr", None)


def test_frames_are_found_by_number(tmp_path: Path) -> None:
    for name in ("a.0010.exr", "a.0002.exr", "a.2.exr", "a.exr", "b.0001.exr", "a.0001.exr.part"):
        (tmp_path / name).touch()
    found = find_frames(str(tmp_path / "a.####.exr"))
    assert found == [(2.0, tmp_path / "a.0002.exr"), (10.0, tmp_path / "a.0010.exr")]
    assert find_frames(str(tmp_path / "none.####.exr")) == []
    assert find_frames(str(tmp_path / "a.exr")) == [(0.0, tmp_path / "a.exr")]


@given(st.lists(st.integers(-99, 20000), min_size=1, max_size=5, unique=True))
def test_what_was_named_is_found(
    tmp_path_factory: pytest.TempPathFactory, times: list[int]
) -> None:
    folder = tmp_path_factory.mktemp("frames")
    for pattern in ("f.####.exr", "f.##.##.exr"):
        for time in times:
            frame_path(str(folder / pattern), float(time)).touch()
        assert [t for t, _ in find_frames(str(folder / pattern))] == sorted(map(float, times))


def test_frame_errors_are_ours() -> None:
    assert issubclass(FrameError, HdrusdError)
