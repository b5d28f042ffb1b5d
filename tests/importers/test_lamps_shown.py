"""Lamps that the selected states do not show: counted apart, in no sum and no share."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import pytest
from converted import lights, opened, run
from converted import sidecar as recipe
from flt_builder import (
    database,
    group,
    inside,
    light_entry,
    light_source,
    lod,
    moved,
    node,
    record,
)
from overlaid import lamp, stage_file

from hdrusd.account.text import summary
from hdrusd.conversion import Result

#: A post of 100 cd in three places, a lamp of 30 cd in two levels of detail, and one of 1000 cd
#: that a switch has off.
CANDELA = """\
[[light]]
match = "PL"
candela = 100
[[light]]
match = "LodL"
candela = 30
[[light]]
match = "Off"
candela = 1000
"""
LUMENS = 4.0 * math.pi * (3 * 100 + 30)


def database_with_states(folder: Path) -> Path:
    """The database of ``CANDELA``."""
    entry = light_entry(0, "bulb", 1)
    post = record(62, struct.pack(">HH", 0, 1)) + inside(group("post", light_source("PL", 0)))
    use = record(61, struct.pack(">HH", 0, 1))
    places = [group(f"p{i}", use, more=moved(10 * i, 0, 0)) for i in range(3)]
    spans = ("near", 0, 50), ("far", 50, 500)
    levels = [lod(*span, light_source("LodL", 0)) for span in spans]
    off = node(96, "sw", 32, {16: struct.pack(">3I", 0, 1, 1), 28: struct.pack(">I", 0b01)})
    off += inside(group("on"), group("held", light_source("Off", 0)))
    path = folder / "a.flt"
    path.write_bytes(database(post, *places, *levels, off, palettes=entry))
    recipe(folder, CANDELA)
    return path


def counts(result: Result) -> list[tuple[str, int, int]]:
    return [(row["name"], row["lamps"], row["lamps_shown"]) for row in result.lights]


def test_states_that_are_not_selected_are_in_no_sum(tmp_path: Path) -> None:
    result = run(database_with_states(tmp_path))
    assert sorted(counts(result)) == [("LodL", 1, 0), ("LodL", 1, 1), ("Off", 1, 0), ("PL", 3, 3)]
    document = result.as_dict()
    totals = document["totals"]
    assert (totals["lamps"], totals["lamps_not_shown"]) == (4, 2)
    assert totals["flux_lm"] == pytest.approx(LUMENS, rel=1e-12)
    assert totals["lamps_by_confidence"] == {"medium": 4}
    assert sum(totals["lamps_by_rule"].values()) == 4
    lines = summary(document, 120)
    assert lines[0].startswith("lights: 4, 4147 lm; 2 more in states not shown; confidence:")
    assert not any("Off" in line for line in lines)
    assert not any("LodL (2)" in line for line in lines)
    fixes = document["fix_first"]
    assert fixes[0]["what"].startswith("PL: 3 lamps")
    assert fixes[0]["impact"] == pytest.approx(0.1 * 300 / 330, abs=1e-4)  # of medium confidence
    assert not any("Off" in entry["what"] for entry in fixes)


def test_a_node_that_the_recipe_shows_is_counted(tmp_path: Path) -> None:
    source = database_with_states(tmp_path)
    more = '[[node]]\nmatch = "held"\nvisible = true\n[[node]]\nmatch = "p0"\nvisible = false\n'
    recipe(tmp_path, CANDELA + more)
    result = run(source)
    assert ("Off", 1, 1) in counts(result)
    assert ("PL", 3, 2) in counts(result)
    lumens = result.as_dict()["totals"]["flux_lm"]
    assert lumens == pytest.approx(4.0 * math.pi * (200 + 30 + 1000), rel=1e-12)


def test_the_sums_of_a_second_conversion_are_those_of_the_first(tmp_path: Path) -> None:
    """And its paths are such that a pattern fits: not those that USD makes up in each run."""
    first = run(database_with_states(tmp_path))
    again = run(tmp_path / "a.usda", tmp_path / "again.usda")
    ones, others = (result.as_dict()["totals"] for result in (first, again))
    assert others["flux_lm"] == pytest.approx(ones["flux_lm"], rel=1e-6)  # candela are float32
    assert others["lamps"] == ones["lamps"]
    stage = opened(first)
    for row in again.lights:
        assert stage.GetPrimAtPath(row["path"]) or not row["lamps_shown"]
        assert "/__Prototype_" not in row["path"]


def test_a_database_whose_lamps_are_all_off_is_dark(tmp_path: Path) -> None:
    entry = light_entry(0, "bulb", 1)
    off = node(96, "sw", 32, {16: struct.pack(">3I", 0, 1, 1), 28: struct.pack(">I", 0)})
    off += inside(group("held", light_source("Off", 0)))
    (tmp_path / "a.flt").write_bytes(database(off, palettes=entry))
    document = run(tmp_path / "a.flt").as_dict()
    assert summary(document, 120)[0] == "lights: none; 1 more in states not shown"
    assert document["totals"]["flux_lm"] is None
    assert document["fix_first"][0]["what"].startswith(
        "nothing shines: no light in the states that are shown"
    )


# --- stages -------------------------------------------------------------------------------


def bulb(name: str, more: str = "") -> str:
    """A ball of 1 m: pi cd a nit, 4 pi^2 lm."""
    inputs = "float inputs:intensity = 1\nfloat inputs:radius = 1\n"
    return lamp("SphereLight", inputs + more, name)


def stage_totals(tmp_path: Path, *parts: str, **options: Any) -> tuple[Result, dict[str, Any]]:
    """A conversion of a stage, and its totals, which those of its result are."""
    result = run(stage_file(tmp_path / "town.usda", *parts), tmp_path / "night.usda", **options)
    totals = result.as_dict()["totals"]
    again = run(tmp_path / "night.usda", tmp_path / "again.usda").as_dict()["totals"]
    assert again["lamps"] == totals["lamps"]
    assert again["flux_lm"] == pytest.approx(totals["flux_lm"], rel=1e-6)
    return result, totals


def test_invisible_lights_of_a_stage_are_counted_apart(tmp_path: Path) -> None:
    hidden = f'def Scope "Off"\n{{\ntoken visibility = "invisible"\n{bulb("C")}\n}}'
    parts = bulb("A"), bulb("B", 'token visibility = "invisible"'), hidden
    result, totals = stage_totals(tmp_path, *parts)
    assert counts(result) == [("A", 1, 1), ("B", 1, 0), ("C", 1, 0)]
    assert (totals["lamps"], totals["lamps_not_shown"]) == (1, 2)
    assert totals["flux_lm"] == pytest.approx(4.0 * math.pi**2, rel=1e-6)


def test_a_node_that_the_recipe_hides_in_a_stage(tmp_path: Path) -> None:
    recipe(tmp_path, '[[node]]\nmatch = "B"\nvisible = false\n')
    result, _ = stage_totals(tmp_path, bulb("A"), bulb("B"))
    assert counts(result) == [("A", 1, 1), ("B", 1, 0)]


def test_variants_that_are_not_selected_are_counted_apart(tmp_path: Path) -> None:
    """The selected one has one lamp, the other two; what neither brings is there once."""
    own = f'"low" {{\n{bulb("Low")}\n}}\n"high" {{\n{bulb("High")}\n{bulb("Higher")}\n}}\n'
    post = (
        'def Xform "Post" (\nvariants = { string power = "low" }\n'
        f'prepend variantSets = "power"\n)\n{{\n{bulb("Base")}\n'
        f'variantSet "power" = {{\n{own}}}\n}}'
    )
    result, totals = stage_totals(tmp_path, post)
    shown = {row["name"]: row["lamps_shown"] for row in result.lights}
    assert shown == {"Base": 1, "Low": 1, "High": 0, "Higher": 0}
    assert (totals["lamps"], totals["lamps_not_shown"]) == (2, 2)
    assert len(lights(opened(result))) == 2


def test_lamps_of_instances_one_of_which_is_hidden(tmp_path: Path) -> None:
    stage_file(tmp_path / "post.usda", bulb("Lamp"))
    uses = [
        f'def "P{i}" (\ninstanceable = true\nreferences = @post.usda@\n)\n{{\n{more}\n}}'
        for i, more in enumerate(("", 'token visibility = "invisible"', ""))
    ]
    result, _ = stage_totals(tmp_path, *uses)
    (row,) = result.lights
    assert (row["lamps"], row["lamps_shown"], row["path"]) == (3, 2, "/World/P0/Lamp")
    assert row["place"].endswith("/World/P0/Lamp")
    assert all("__Prototype_" not in str(finding) for finding in result.report)
    (again,) = run(tmp_path / "night.usda", tmp_path / "again.usda").lights
    assert (again["path"], again["lamps_shown"]) == ("/World/P0/Lamp", 2)
    recipe(tmp_path, f'[[light]]\nmatch = "{row["path"]}"\ncandela = 7\n')
    assert run(tmp_path / "town.usda", tmp_path / "night.usda").lights[0]["value"] == 7.0


def test_a_lamp_that_changes_is_told_at_its_brightest_by_both(tmp_path: Path) -> None:
    blinks = "float inputs:intensity.timeSamples = { 1: 0, 2: 3, 3: 1 }\nfloat inputs:radius = 1\n"
    result, totals = stage_totals(tmp_path, lamp("SphereLight", blinks, "A"))
    assert result.lights[0]["value"] == pytest.approx(3.0 * math.pi, rel=1e-6)
    assert totals["flux_lm"] == pytest.approx(12.0 * math.pi**2, rel=1e-6)
