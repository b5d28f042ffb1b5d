"""Frames read ahead: each its own, problems in their turn, one frame in advance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hdrusd.errors import InputError
from hdrusd.frame_io import Reader
from hdrusd.images import write_exr


def written(folder: Path, number: int) -> Path:
    path = folder / f"f.{number}.exr"
    write_exr(path, np.full((2, 3, 3), number, np.float32))
    return path


def test_each_file_is_its_own(tmp_path: Path) -> None:
    files = [written(tmp_path, number) for number in range(4)]
    with Reader() as reader:
        for number, file in enumerate(files):
            rgb, _, _ = reader.read(file, files[number + 1] if number < 3 else None)
            assert (rgb == number).all()


def test_another_file_than_was_announced(tmp_path: Path) -> None:
    first, second, third = (written(tmp_path, number) for number in range(3))
    with Reader() as reader:
        reader.read(first, second)
        assert (reader.read(third)[0] == 2.0).all()
        assert (reader.read(second)[0] == 1.0).all()


def test_a_problem_comes_in_its_turn(tmp_path: Path) -> None:
    good, bad = written(tmp_path, 7), tmp_path / "bad.exr"
    bad.write_bytes(b"not a picture")
    with Reader() as reader:
        assert (reader.read(good, bad)[0] == 7.0).all()
        with pytest.raises(InputError, match=r"bad\.exr"):
            reader.read(bad, good)
        assert (reader.read(good)[0] == 7.0).all()


def test_what_was_announced_may_stay_unread(tmp_path: Path) -> None:
    good, bad = written(tmp_path, 7), tmp_path / "missing.exr"
    with Reader() as reader:
        reader.read(good, bad)
