"""The account of lights: what they count, by which pattern a line names them and no other."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import gltf_lights
from converted import POINT, SPOT, run, sidecar

from hdrusd.account.lights import pattern_finder
from hdrusd.account.text import summary


def fixes(folder: Path, text: str, shape: str = "v -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9") -> Any:
    """What to fix first of a grey square with a photometry file."""
    sidecar(folder, text)
    (folder / "a.mtl").write_text("newmtl grey\nKd 0.5 0.5 0.5\nnewmtl sky\nKd 0 0 0\nKe 1 1 1\n")
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{shape}\nusemtl grey\nf 1 2 3 4\n")
    return run(folder / "a.obj", source_unit=1.0).as_dict()["fix_first"]


@pytest.mark.parametrize("stated", ["", "illuminance = 0.2\n"])
def test_a_preset_is_mended_where_it_stands(tmp_path: Path, stated: str) -> None:
    for entry in fixes(tmp_path, f'[ambient]\npreset = "moonlit"\n{stated}'):
        assert entry["write"] is None  # no [[light]] fits the moon, and [ambient] is there
        assert entry["why"].endswith("; the number stands in ambient there")


def test_a_wall_has_light_though_nothing_is_below_it(tmp_path: Path) -> None:
    wall = "v -9 0 0\nv 9 0 0\nv 9 9 0\nv -9 9 0"
    (sun, sky) = fixes(tmp_path, '[ambient]\npreset = "clear-sun"\n', wall)
    assert (sun["what"][:4], sky["what"][:4]) == ("Sun:", "Sky:")
    # 127,500 exp(-0.21 / sin 45) lx of the sun, 0.8 + 15.5 sqrt(sin 45) klx of the sky; half.
    beam = 127_500 * np.exp(-0.21 * np.sqrt(2))
    share = beam / (beam + 800 + 15_500 * 0.5**0.25)
    assert sun["impact"] == pytest.approx(0.5 * share, abs=1e-4)


def test_what_glows_takes_nothing_from_a_lamps_share(tmp_path: Path) -> None:
    dome = (
        "v -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nv -5e3 0 0\nv 5e3 0 0\nv 5e3 5e3 0\nv -5e3 5e3 0\n"
        "usemtl sky\nf 5 6 7 8"
    )
    guess = '[[lamp]]\nat = [[0, 5, 0]]\ncandela = 400\nprovenance = "estimated"\n'
    impacts = {e["what"].partition(":")[0]: e["impact"] for e in fixes(tmp_path, guess, dome)}
    assert impacts["Lamp"] == 0.5  # all of the light, half a decade
    assert impacts["sky"] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("names", "patterns"),
    [
        (("ls0", "ls1", "ls12"), ["ls*"]),
        (("ls0", "ls1", "lsx"), ["ls[0-9]*"]),
        (("ls0", "ls1", "ls2x"), ["ls0", "ls1"]),
        (("ls0", "ls1", "board"), ["ls*"]),
        (("ls[0", "ls[1", "board"), ["ls[[]*"]),
        (("ls0", "ls1", "ls1"), ["ls0", "/a/1"]),
        (("ls0", "ls0", "ls0"), ["/a/0", "/a/1"]),
    ],
)
def test_patterns_fit_a_group_and_no_other(names: tuple[str, ...], patterns: list[str]) -> None:
    rows = [{"name": n, "node": f"node{i}", "path": f"/a/{i}"} for i, n in enumerate(names)]
    group = rows if names[2] == "ls12" else rows[:2]
    assert pattern_finder(rows)(group) == patterns
    fitting = [
        row
        for row in rows
        if any(fnmatchcase(row[k], p) for p in patterns for k in ("name", "path"))
    ]
    assert fitting == group


def test_a_node_of_the_name_is_no_lamp_of_the_group() -> None:
    rows = [
        {"name": name, "node": node, "path": f"/a/{node}/{name}"}
        for name, node in (("ls0", "ls0"), ("ls1", "ls1"), ("bulb", "ls9"))
    ]
    assert pattern_finder(rows)(rows[:2]) == ["ls0", "ls1"]


def test_lamps_of_one_name_get_their_own_numbers(tmp_path: Path) -> None:
    """Where each copied line counts, its lamp alone has what the line says."""
    lamps = [{"name": "lamp", "type": "point", "intensity": value} for value in (100.0, 500.0)]
    nodes = [
        {"name": "post", "extensions": {"KHR_lights_punctual": {"light": n}}} for n in (0, 1, 0)
    ]
    source = gltf_lights(tmp_path / "a.gltf", lamps, nodes)
    before = run(source)
    entries = {e["what"]: e["write"] for e in before.as_dict()["fix_first"]}
    (one,) = (write for what, write in entries.items() if "500 cd" in what)
    (two,) = (write for what, write in entries.items() if "100 cd" in what)
    sidecar(tmp_path, one.replace("500", "900"))
    assert [row["value"] for row in run(source).lights] == [100.0, 900.0, 100.0]
    sidecar(tmp_path, two.replace("100", "300") + "\n" + one.replace("500", "900"))
    after = run(source)
    assert [row["value"] for row in after.lights] == [300.0, 900.0, 300.0]
    assert "sidecar-no-match" not in after.report.codes()
    # Paths stay when a lamp is switched off.
    sidecar(tmp_path, one.replace("candela = 500.0", "enabled = false"))
    assert [row["path"] for row in run(source).lights] == [
        before.lights[0]["path"],
        before.lights[2]["path"],
    ]


def test_a_suns_lux_count_by_how_it_stands_to_the_ground(tmp_path: Path) -> None:
    """A square of 18 m x 18 m, 60 degrees of altitude: sin 60 of the lux on it."""
    (sun, sky) = fixes(tmp_path, '[ambient]\npreset = "clear-sun"\naltitude = 60\n')
    level = 127_500 * np.exp(-0.21 / np.sin(np.pi / 3)) * np.sin(np.pi / 3)
    assert (sun["what"][:4], sky["what"][:4]) == ("Sun:", "Sky:")
    share = level / (level + 800 + 15_500 * np.sqrt(np.sin(np.pi / 3)))
    assert sun["impact"] == pytest.approx(0.5 * share, abs=1e-4)


@pytest.mark.parametrize(("x", "level"), [(0.0, 0.0), (-30.0, 0.125), (-90.0, 0.25), (90.0, 0.0)])
def test_a_direction_is_told_with_its_lux_on_level_ground(
    tmp_path: Path, x: float, level: float
) -> None:
    """A light of 0.25 lx along -Z, turned about X: level, 30 degrees down, down, up."""
    half = np.radians(x) / 2.0
    light = {"name": "moon", "type": "directional", "intensity": 0.25}
    node = {
        "rotation": [np.sin(half), 0.0, 0.0, np.cos(half)],
        "extensions": {"KHR_lights_punctual": {"light": 0}},
    }
    result = run(gltf_lights(tmp_path / "a.gltf", [light], [node]))
    assert result.lights[0]["level_lux"] == pytest.approx(level, abs=1e-7)  # float32 in glTF
    again = run(tmp_path / "a.usda", tmp_path / "again.usda")
    assert again.lights[0]["level_lux"] == pytest.approx(level, abs=1e-7)


def test_a_sky_is_no_light(tmp_path: Path) -> None:
    sidecar(tmp_path, '[ambient]\npreset = "moonless"\n')
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT, SPOT]))
    totals = result.as_dict()["totals"]
    assert (totals["lamps"], totals["skies"]) == (3, 1)
    assert summary(result.as_dict(), 100)[0].startswith("lights: 2, skies: 1, ")
