"""What a worker that decompresses may answer, and what becomes of a wrong answer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.errors import InputError
from hdrusd.importers import worker
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.unpacking import Answer, Unpacker
from hdrusd.report import Report

NUMBERS = np.arange(6, dtype="<u2")
GOOD = {"answers": [[0, None], "ValueError: broken"], "arrays": [["<u2", [2, 3]]]}


def answers(
    monkeypatch: pytest.MonkeyPatch, record: Any, arrays: bytes = NUMBERS.tobytes()
) -> list[Answer]:
    """What comes of two pieces where the worker leaves that."""

    def leave(module: str, folder: Path, resolver: Resolver, **more: Any) -> None:
        assert (folder / "packed.bin").read_bytes() == b"abcdef"
        (folder / "answer.json").write_text(
            record if isinstance(record, str) else json.dumps(record)
        )
        (folder / "arrays.bin").write_bytes(arrays)

    monkeypatch.setattr(worker, "run_module", leave)
    unpacker = Unpacker(Resolver(Path("a.glb"), Report(), limits=Limits(file_bytes=1 << 20)), 6)
    whole = memoryview(b"abcdef")
    first, second = whole[:3], whole[3:]
    assert unpacker.ask("one", first, count=1) == 0
    assert unpacker.ask("one", second, count=1) == 1
    assert unpacker.ask("one", first, count=1) == 0  # asked already
    return unpacker.answers()


def test_arrays_and_problems_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = answers(monkeypatch, GOOD)
    assert isinstance(first, list)
    np.testing.assert_array_equal(first[0], NUMBERS.reshape(2, 3))
    assert first[1:] == [None]
    assert second == "cannot be decompressed: ValueError: broken"


@pytest.mark.parametrize(
    "record",
    [
        "",
        "[]",
        "{}",
        "{" + '"a": {' * 100_000,
        '{"answers": NaN, "arrays": []}',
        GOOD | {"answers": [[0]]},
        GOOD | {"answers": [[1], "x"]},
        GOOD | {"answers": [[-1], "x"]},
        GOOD | {"answers": [[True], "x"]},
        GOOD | {"answers": [{"a": 0}, 7.5]},
        GOOD | {"arrays": [["<u2", [2, 4]]]},
        GOOD | {"arrays": [["<u2", [10**30]]]},
        GOOD | {"arrays": [["<u2", [-2, -3]]]},
        GOOD | {"arrays": [["|O", [2, 3]]]},
        GOOD | {"arrays": [["<u2", [1] * 40]]},
        GOOD | {"arrays": [7]},
        GOOD | {"arrays": None},
    ],
)
def test_nonsense_is_one_line(monkeypatch: pytest.MonkeyPatch, record: Any) -> None:
    with pytest.raises(InputError, match=r"a\.glb: the decoder answered nonsense") as caught:
        answers(monkeypatch, record)
    assert "\n" not in str(caught.value)


def test_arrays_past_the_limit_are_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    record = GOOD | {"arrays": [["|u1", [2 << 20]]]}
    with pytest.raises(InputError, match="at most 1048576 bytes"):
        answers(monkeypatch, record, bytes(2 << 20))


def test_no_piece_starts_no_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "run_module", None)
    assert Unpacker(Resolver(Path("a.glb"), Report()), 6).answers() == []


@pytest.mark.parametrize(
    ("limits", "match"),
    [
        (Limits(worker_bytes=48 << 20), "the decoder (needs more than 48 MiB|failed)"),
        (Limits(worker_seconds=0), "the decoder took more than 0 s"),
    ],
)
def test_a_worker_at_its_limits_is_one_line(limits: Limits, match: str) -> None:
    unpacker = Unpacker(Resolver(Path("a.glb"), Report(), limits=limits), 3)
    unpacker.ask("draco", memoryview(b"abc"), attributes=[])
    with pytest.raises(InputError, match=match) as caught:
        unpacker.answers()
    assert "\n" not in str(caught.value)
