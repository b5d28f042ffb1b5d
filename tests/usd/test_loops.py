"""Animations that loop are written as often as they run until the stage ends."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import new_spec, new_stage, node, one_square
from pxr import Usd, UsdGeom

import hdrusd.usd.transform
from hdrusd.legacy.scene import Channel, Node
from hdrusd.report import Report
from hdrusd.usd.transform import last_key, matrices, write_transform
from hdrusd.usd.writer import StageWriter

RATE = 24.0


def channel(times: Any, values: Any, path: Any = "translation", **more: Any) -> Channel:
    return Channel(path, np.array(times, float), np.array(values, float), **more)


def along_x(*values: float) -> list[list[float]]:
    return [[value, 0.0, 0.0] for value in values]


def positions(made: Node, end: float, codes: Any) -> list[float]:
    stage = new_stage()
    write_transform(new_spec(stage, "/Node", "Xform"), made, RATE, end)
    form = UsdGeom.Xform.Get(stage, "/Node")
    worlds = [form.ComputeLocalToWorldTransform(Usd.TimeCode(code)) for code in codes]
    found = [world.ExtractTranslation()[0] for world in worlds]
    # The same by our own evaluation, which the joints of skins take.
    own = matrices(made, np.array(codes, float), RATE, end)[:, 3, 0]
    assert own == pytest.approx(found, abs=1e-9)
    return found


def test_a_loop_begins_again() -> None:
    # From 0 to 8 in a second, then at once at 0 again.
    made = node(animation=(channel([0.0, 1.0], along_x(0.0, 8.0), loop="loop"),))
    found = positions(made, 3.0, [0, 12, 23.9, 24, 36, 47.9, 48, 60, 72])
    wanted = [0, 4, 8 * 23.9 / 24, 0, 4, 8 * 23.9 / 24, 0, 4, 8]
    # Just before the jump it is at its end a thousandth of a code early.
    assert found == pytest.approx(wanted, abs=8e-3)


def test_a_closed_loop_has_no_jump() -> None:
    made = node(animation=(channel([0.0, 0.5, 1.0], along_x(0.0, 4.0, 0.0), loop="loop"),))
    found = positions(made, 2.5, [12, 24, 36, 48, 60])
    assert found == pytest.approx([4, 0, 4, 0, 4], abs=1e-9)


def test_a_swing_comes_back() -> None:
    made = node(animation=(channel([0.0, 1.0], along_x(0.0, 8.0), loop="swing"),))
    found = positions(made, 3.0, [12, 24, 36, 48, 60, 72])
    assert found == pytest.approx([4, 8, 4, 0, 4, 8], abs=1e-9)


def test_steps_are_held_in_every_round() -> None:
    steps = channel([0.0, 1.0, 2.0], along_x(0.0, 1.0, 5.0), interpolation="step", loop="loop")
    found = positions(node(animation=(steps,)), 4.0, [12, 36, 47, 49, 71, 73, 95])
    assert found == pytest.approx([0, 1, 1, 0, 0, 1, 1], abs=1e-9)


def test_turns_go_on_round() -> None:
    def about_z(degrees: float) -> list[float]:
        half = math.radians(degrees) / 2.0
        return [0.0, 0.0, math.sin(half), math.cos(half)]

    keys = [about_z(angle) for angle in (0.0, 120.0, 240.0, 360.0)]
    turn = channel([0.0, 1.0, 2.0, 3.0], keys, "rotation", loop="loop")
    stage = new_stage()
    write_transform(new_spec(stage, "/Node", "Xform"), node(animation=(turn,)), RATE, 6.0)
    form = UsdGeom.Xform.Get(stage, "/Node")
    for seconds in (0.5, 2.5, 3.5, 5.5):
        world = form.ComputeLocalToWorldTransform(Usd.TimeCode(seconds * RATE))
        angle = math.radians(120.0 * seconds)
        assert world[0][0] == pytest.approx(math.cos(angle), abs=1e-9)
        assert world[0][1] == pytest.approx(math.sin(angle), abs=1e-9)


def test_a_loop_ends_with_the_longest_animation(tmp_path: Path) -> None:
    mill = node("mill", animation=(channel([0.0, 1.0], along_x(0.0, 1.0), loop="swing"),))
    drive = node("car", animation=(channel([0.0, 10.0], along_x(0.0, 100.0)),))
    assert last_key([mill, drive]) == 10.0
    report = Report()
    made = StageWriter(
        tmp_path,
        "s",
        one_square(roots=[mill, drive]),
        report,
        meters_per_unit=1.0,
        source_unit=1.0,
        up="Z",
    )
    made.write_geometry()
    assert made.stage.GetEndTimeCode() == 240.0
    form = UsdGeom.Xformable(made.stage.GetPrimAtPath("/s/mill"))
    assert form.ComputeLocalToWorldTransform(228.0).ExtractTranslation()[0] == pytest.approx(0.5)
    (finding,) = report
    assert finding.code == "animation-loop"
    assert "10 times" in finding.text
    assert "10 s" in finding.text


def test_a_loop_is_not_written_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hdrusd.usd.transform, "_MOST_SAMPLES", 10)
    blink = channel([0.0, 1e-3], along_x(0.0, 1.0), loop="swing")
    stage = new_stage()
    write_transform(new_spec(stage, "/Node", "Xform"), node(animation=(blink,)), RATE, 3600.0)
    form = UsdGeom.Xform.Get(stage, "/Node")
    assert len(form.GetTranslateOp().GetTimeSamples()) <= 10
