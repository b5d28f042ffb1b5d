"""A sequence in which everything moves holds on to nothing (tests/bench/memory.py)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bench import memory


@pytest.mark.usefixtures("gl")
def test_nothing_is_forgotten_and_nothing_piles_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """From frame 40 to 60 lamps are switched, and all else moves."""
    monkeypatch.setattr(memory, "EVERY", 20)
    monkeypatch.setattr(memory, "LAMPS", 3)
    counts, lost = {}, {}
    for frame, _, held, forgotten in memory.watch(60, (32, 18)):
        counts[frame], lost[frame] = held, forgotten
    assert set(lost.values()) == {0}
    assert counts[60] == counts[40]


def test_the_stage_has_all_that_moves(tmp_path: Path) -> None:
    from pxr import Usd

    stage = Usd.Stage.Open(str(memory.write_stage(tmp_path, 100)))
    moving = {
        prim.GetName()
        for prim in stage.Traverse()
        if any(attribute.ValueMightBeTimeVarying() for attribute in prim.GetAttributes())
    }
    assert moving >= {"Car", "Walk", "Cloth", "Lamp0", "Profile", "Area", "Sky"}
